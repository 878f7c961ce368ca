"""A calibration as lines of text for a terminal, and as plain data."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

import er3a.pipeline.messages.diagnosis  # noqa: F401
from er3a.calibration.calibrate import Beyond, Calibration, Estimate, TermEstimate
from er3a.calibration.cross_validation import TriedTerm
from er3a.calibration.held_back import AGAINST, held_back_findings
from er3a.calibration.observations import Measurement
from er3a.calibration.terms import starting_table
from er3a.finding import is_one, plain
from er3a.pipeline.language import as_text, tr, words
from er3a.pipeline.messages.say import joined, listed, say
from er3a.robots.robot import Robot

RECORDED = (
    *("level", "coordinates", "poses", "repeated", "freedom", "rms_before_mm", "rms_after_mm", "turned_before_deg"),
    *("turned_after_deg", "scatter", "fits", "ratios", "idle", "left_out", "tried", "tried_for_file"),
)
OF_AN_ENTRY = ("name", "nominal", "correction", "half_width", "unit")
MUCH_SCATTER, LITTLE_SCATTER = 2.0, 0.3
TERMS = words(
    {
        "ratio": "ratio",
        "once": "once a turn",
        "twice": "twice a turn",
        "sag": "sag under a load",
        "ripple": "{turns} times a turn",
        "coupling": "coupled to J{by}",
    }
)
KINDS = words({"place": "place", "plane": "plane"})
VERDICTS = words(
    {
        "taken": "taken",
        "not_lower": "left: poses left out are not met better",
        "noise": "left: noise may have made it",
        "wrong_way": "left: a load would have to lift the arm",
    }
)


def lines_of(found: Calibration, fitted: Sequence[Measurement] = (), others: Sequence[Measurement] = ()) -> str:
    """The answer of a calibration as lines of text for a terminal: pages and JSON hold the rest.

    Parameters
    ----------
    fitted, others : measured positions that it rests on, and those held back
    """
    settled, numbers = len(found.estimates) - len(found.open), len(found.estimates) + len(found.held)
    not_settled = f"; not settled: {', '.join(found.open)}" if found.open else ""
    lines = [
        *([] if found.fits else [say(found.conclusion)]),
        *listed(held_back_findings(found, fitted, others)),
        *_summary(found),
        *warning_texts(found),
        f"{found.coordinates} coordinates at {found.poses} poses settle {settled} of {numbers} numbers{not_settled}",
        f"root mean square difference {found.rms_before_mm:.4g} mm before, {found.rms_after_mm:.4g} mm after",
        *(
            []
            if found.turned_before_deg is None
            else [f"orientations: {found.turned_before_deg:.4g}° before, {found.turned_after_deg:.4g}° after"]
        ),
        *_entry_lines(found.estimates),
        *(f"not estimated: {say(reason)}" for reason in found.held),
        *(f"set aside: row {each.row}, {each.distance_mm:.3g} mm off" for each in found.outliers),
        *(f"says nothing: {text}" for text in idle_texts(found)),
    ]
    terms = found.beyond.terms if found.beyond else found.ratios
    if terms:
        named = ", ".join(f"J{term.joint} {term_kind(term)}" for term in terms)
        lines.append(f"errors of joints beyond the table: {named}; --html and --json list all")
    if found.scatter > MUCH_SCATTER:
        lines.append("warning: residuals exceed the stated standard deviations; errors may exceed the intervals")
    if found.deviation_mm is None and found.scatter < LITTLE_SCATTER:
        lines.append("warning: residuals are far below the stated standard deviations, on which the intervals rest")
    if found.more:
        lines.append(f"to estimate more: {say(found.more)}")
    lines += [f"not examined: {text}" for text in not_examined_texts(found, others) if fitted]
    return "\n".join(lines)


def not_examined_texts(found: Calibration, others: Sequence[Measurement] = ()) -> list[str]:
    """What the corrections take for granted, and what ``others``, held back, can't tell."""
    untold = others and not (found.beyond.left_out if found.beyond else found.left_out)
    texts = [tr("positions held back: too few poses were fitted to leave some out")] if untold else []
    scale = [tr("the scale of the measurements: all lengths of the arm are off by the same share as it is")]
    return [*texts, *(scale if found.scale_is_assumed else [])]


def warning_texts(found: Calibration) -> list[str]:
    """How many poses there are, if some were read again, and what too few of them don't settle."""
    texts = []
    if found.repeated:
        texts.append(
            tr(
                "{poses} distinct poses; lines that repeat one: {repeated}. A pose counts once, with their mean.",
                poses=found.poses,
                repeated=found.repeated,
            )
        )
    if found.deviation_mm is not None and found.freedom == 1:
        texts.append(
            tr(
                "Nothing is settled with one coordinate more than numbers. Measure more poses, or state the standard "
                "deviation."
            )
        )
    return texts


def _summary(found: Calibration) -> list[str]:
    """How well the corrected arm does at poses that its fit has not seen."""
    forms = {"the corrected robot file": found.left_out}
    if found.beyond:
        forms = {"the whole model": found.beyond.left_out, "the robot file alone": found.left_out}
    return [
        f"{name} errs at poses left out by {each.mean_mm:.4g} mm on average, {each.worst_mm:.4g} mm at worst"
        for name, each in forms.items()
        if each
    ]


def kept_lines(
    found: Calibration, robot: str, output: Path | None, model: Path | None, *, contradicted: bool = False
) -> list[str]:
    """How to go on with the corrected arm: the whole model first.

    Parameters
    ----------
    robot : as the command was given it; output, model : the files that were written, if any
    contradicted : whether positions held back contradict it
    """
    python = f"er3a.load_calibration('{model or 'FILE_model.json'}', er3a.load_robot('{robot}')).forward(q)"
    if output is None or model is None:
        return [f"keep it: --output FILE.yaml writes the robot file, and FILE_model.json for {python} in Python"]
    lines = []
    doubts = {"positions held back contradict it": contradicted, "measurements and table don't fit": not found.fits}
    if against := " and ".join(each for each, holds in doubts.items() if holds):
        lines.append(f"written although {against}: don't use these files until that is settled")
    lines.append(f"{model}: written; the whole model: {python} in Python, or")
    lines.append(f"    er3a predict {shlex.quote(str(model))} JOINTS.csv --robot {shlex.quote(robot)}")
    lines.append(f"{output}: written" + (f"; {text}" if (text := file_text(found)) else ""))
    if found.ratios:
        lines.append(
            f"{output}: its coupling counts; for a program that reads a table alone, calibrate with --fixed ratios"
        )
    return lines


def held_back_line(found: Calibration, others: Sequence[Measurement]) -> str:
    """How far the model is from positions that the fit has not seen, mm."""
    off = found.distances_mm(others)
    worst = f"{off.max():.4g} mm at worst (row {others[int(off.argmax())].row})"
    return f"held back: {len(off)} positions, {off.mean():.4g} mm off on average, {worst}"


def idle_texts(found: Calibration) -> list[str]:
    """What was touched at too few poses."""
    return [
        tr(
            "{kind} {name}: {poses} poses; {least} needed",
            kind=tr(KINDS[each.kind]),
            name=each.name,
            poses=each.poses,
            least=each.unknown + 1,
        )
        for each in found.idle
    ]


def file_text(found: Calibration) -> str | None:
    """What a robot file lacks, and the errors at poses left out without and with it; None if there are no terms."""
    if found.beyond is None or found.left_out is None or found.beyond.left_out is None:
        return None
    return tr(
        "A robot file holds no terms but couplings: at poses left out it errs by {table:.3g} mm, all terms by "
        "{model:.3g} mm on average.",
        table=found.left_out.mean_mm,
        model=found.beyond.left_out.mean_mm,
    )


def term_kind(term: TriedTerm | TermEstimate) -> str:
    """Such as once a turn."""
    return tr(TERMS[term.kind], turns=term.turns, by=term.by) if term.turns or term.by else tr(TERMS[term.kind])


def _entry_lines(estimates: Sequence[Estimate]) -> list[str]:
    lines = [f"{'entry':<9}{'table':>12}{'correction':>14}{'95 % interval':>16}"]
    for each in estimates:
        values = as_text(each.nominal, ">12.4f") + as_text(each.correction, ">+14.4f") + f"{each.half_width:>12.4f}"
        lines.append(f"{each.name:<9}{values} {each.unit}")
    return lines


def calibration_record(
    found: Calibration, robot: Robot, fitted: Sequence[Measurement] = (), others: Sequence[Measurement] = ()
) -> dict[str, object]:
    """A calibration as plain data, for another program; corrections in mm and deg with half their 95 % interval.

    Parameters
    ----------
    robot : that the calibration started from
    fitted, others : measured positions that it rests on, and those held back
    """
    findings = held_back_findings(found, fitted, others)
    return {
        "start": starting_table(robot),
        **{name: plain(getattr(found, name)) for name in RECORDED},
        "wrong": say(found.wrong) if found.wrong else None,
        "standard_deviation_mm": found.deviation_mm,
        "entries": _entries(found.estimates),
        "held": [say(reason) for reason in found.held],
        "more": say(found.more) if found.more else None,
        "set_aside": plain(found.outliers),
        "beyond": _beyond(found.beyond) if found.beyond else None,
        "held_back": _held_back(found, others) if others else None,
        "held_back_warning": joined(listed(findings), " ") or None,
        "held_back_contradicts": any(is_one(each, *AGAINST) for each in findings),
        "not_examined": not_examined_texts(found, others) if fitted else [],
    }


def _held_back(found: Calibration, others: Sequence[Measurement]) -> dict[str, object]:
    models = found.model, found.without_terms().model
    model, alone = (each.distances_mm(others) for each in models)
    positions = zip(others, *(each.positions_mm(others).tolist() for each in models))
    return {
        "positions": len(model),
        "mean_mm": float(model.mean()),
        "worst_mm": float(model.max()),
        "worst_row": others[int(model.argmax())].row,
        "table_mean_mm": float(alone.mean()),
        "table_worst_mm": float(alone.max()),
        "rows": [{"row": each.row, "xyz_mm": xyz, "table_xyz_mm": table} for each, xyz, table in positions],
    }


def _entries(estimates: Sequence[Estimate]) -> list[dict[str, object]]:
    return [{name: getattr(each, name) for name in OF_AN_ENTRY} for each in estimates]


def _beyond(found: Beyond) -> dict[str, object]:
    return {
        "terms": plain(found.terms),
        "entries": _entries(found.estimates),
        "rms_mm": found.rms_mm,
        "standard_deviation_mm": found.deviation_mm,
        "left_out": plain(found.left_out),
    }
