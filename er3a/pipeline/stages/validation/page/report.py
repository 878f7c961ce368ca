"""The validation page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from er3a.files.robot_library import robot_of
from er3a.files.robot_writer import robot_file, robot_text
from er3a.finding import is_one
from er3a.identifiability.entries import column_of
from er3a.kinematics.forward import frames
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import N_, own_title, tr, unit_sign, with_unit
from er3a.pipeline.messages.diagnosis import CONVENTIONS
from er3a.pipeline.messages.numbers import fixed, measured
from er3a.pipeline.messages.pages import GRADE_NAMES
from er3a.pipeline.messages.say import bracketed, joined, say, word
from er3a.pipeline.messages.validation import GRADES, GROUPS
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.validation import model
from er3a.pipeline.stages.validation.page import diagnosis_section
from er3a.pipeline.stages.validation.page.evidence_section import (
    SETTLED,
    entry_word,
    evidence_section,
    known_alone,
    other_robot,
    plain_table,
    poses_to_read,
)
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, Fix
from er3a.pipeline.viewing.page import (
    alternative_table,
    render_stage,
    text_address,
)
from er3a.pipeline.viewing.side_view import (
    COLUMN,
    UPRIGHT,
    Label,
    LabelKind,
    beyond,
    dimension,
    entry_places,
    flanges_off,
    seen_arm,
    side_view,
)
from er3a.robots.robot import Robot

ANGLES = ("alpha", "beta", "offset")
AROUND = np.radians(np.linspace(-125.0, 125.0, 31))  # of an arrow around an axis: open at the back
SEEN_FROM_SIDE = 0.64  # of that: the half before an axis in the drawing's plane
HEAD = 0.5  # of its radius, the length of its head
TILT = 0.35  # of a circle around an axis in the drawing's plane, seen a little from above
RADIUS = 0.045  # of such an arrow, of the size of the arm
BELOW = 0.1  # of a reach: from one line to the next below the base
LABELLED = 5  # of the lengths that are wrong, at most, so that words have room
SEEN = "seen"  # address in the picture of what is to be done next
DECIMALS = {"mm": 2, "deg": 2, "deg/s": 1, "mm/s": 1, "": 0}
COLUMNS = (
    N_("Check"),
    N_("Model>"),
    N_("Reference>"),
    N_("Difference>"),
    N_("Tolerance>"),
    N_("Unit"),
    N_("Source"),
)

Judged = model.Judged


def group_rows(checks: Iterable[Judged]) -> list[list[Any]]:
    """A row for each set and group."""
    rows, sets = [], dict[str, list[Judged]]()
    for check in checks:
        sets.setdefault(check.reference_set or tr("the model itself"), []).append(check)
    for title, own in sets.items():
        for group in dict.fromkeys(check.group for check in own):
            part = [check for check in own if check.group == group]
            counted = Counter(check.status for check in part)
            worst = max(part, key=lambda check: check.tolerances_off)
            off = with_unit(_value(worst.difference, worst), worst.unit)
            counts = counted["pass"], counted["fail"], counted["conflict"]
            rows.append([title, word("group", GROUPS, group), *counts, say(worst.subject), off])
    return rows


def check_row(check: Judged) -> list[str]:
    """A check in the columns of ``COLUMNS``."""
    values = [_value(value, check) for value in (check.measured, check.expected, check.difference)]
    if check.source is not None and check.grade is not None:
        grade = word("grade", GRADE_NAMES, check.grade)
        source = bracketed(own_title(check.source), grade)
    else:
        source = tr("the model itself")
    return [say(check.subject), *values, f"{check.tolerance:g}", unit_sign(check.unit), source]


def _value(value: float, check: model.Check) -> str:
    """A value in its unit's decimals; errors of round trips, which are far smaller, by what they are below."""
    if check.group == "round_trips" and 0 < abs(value) < 1e-3:
        return measured(value, None, check.unit)
    return fixed(value, DECIMALS[check.unit])


def report(study: Study, stored: Stored[model.ValidationResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, summary = stored.robot, stored.results.summary
    robot, checks = model.model_of(study, name), summary.checks
    judged = [check for check in checks if not isinstance(check, model.Unjudged)]
    failed = sorted((each for each in judged if each.status == "fail"), key=lambda each: -each.tolerances_off)
    source = robot.sources.get("dh")
    table = robot_of(study.table(name)).replace(name=name)
    corrected, _ = diagnosis_section.corrected_robot(table, summary.diagnoses)
    file = robot_file(corrected) if corrected and not summary.is_beyond_correction else None
    text = robot_text(file) if file else ""
    instead = alternative_table(study, stored) if summary.verdict.status == "fail" else None
    evidence = evidence_section(robot, summary.evidence)
    disputed = [each for each in summary.conflicts if is_one(each.subject, "reach") and each.subject.axis == 1]
    render_stage(
        study,
        stored,
        output,
        _answer(study, name, summary, instead, disputed),
        arms=_both_arms(
            robot, study.robot(instead) if instead else other_robot(robot, summary.evidence), evidence or {}, disputed
        ),
        at_side=True,
        plain_table=None if evidence else plain_table(robot),
        robot=robot,
        table_evidence=evidence,
        diagnoses=diagnosis_section.diagnosis_stories(summary),
        corrected=text,
        corrected_address=text_address(text),
        poses=poses_to_read(table) if summary.verdict.status != "fail" else ([], []),
        groups=group_rows(judged),
        failed=[*map(check_row, failed)],
        columns=COLUMNS,
        conflicts=[(say(conflict.subject), conflict) for conflict in summary.conflicts],
        table_source=source and (own_title(source.source), word("grade", GRADES, source.grade)),
        convention=word("convention", CONVENTIONS, robot.convention),
    )


def _both_arms(
    robot: Robot, other: Robot | None, evidence: Mapping[str, Any], disputed: Sequence[model.Conflict]
) -> Markup:
    """The arm of the table, with its doubtful entries, and the one that documents describe, from the side at one
    scale."""
    arms = [seen_arm(robot, tr("This table"), "", "right")]
    if other is not None:
        arms.insert(0, seen_arm(other, tr("Documents"), tr("describe this arm"), "right"))
    off = flanges_off(arms)
    arms = [arms[0], replace(arms[-1], kind="wrong")] if off else arms[-1:]
    reaches, dimensions = _dimensions(disputed)
    labels = [*_entries_seen(robot, evidence), *off, *reaches]
    column = max([beyond(arms), *((1 + COLUMN) * each.measured for each in disputed)])
    places, over = entry_places(robot), []
    radius = RADIUS * float(np.ptp(arms[-1].points_mm, axis=0).max())
    for joint, cells in evidence.get("rows", ()):
        if any(cell and column_of(cell["entry"]) == "direction" and _kind(cell["status"]) == "open" for cell in cells):
            over.append(_turn_arrow(robot, joint, places[f"d{joint}"], radius))
    return side_view(arms, ratio=UPRIGHT, labels=labels, column_mm=column, over=[*over, *dimensions])


def _turn_arrow(robot: Robot, joint: int, at: Reals, radius: float) -> tuple[str, Reals]:
    """An arrow about a place (2,), mm, as an axis turns with its joint's value: before an axis in the drawing's
    plane, over one across it."""
    axis = robot.direction[joint - 1] * frames(robot, np.zeros(robot.joints))[joint - 1, :3, 2]
    across = abs(axis[1]) > np.sqrt(0.5)
    first, around = ([0.0, 0.0, 1.0], AROUND) if across else ([0.0, -1.0, 0.0], SEEN_FROM_SIDE * AROUND)
    ring = np.outer(np.cos(around), first) + np.outer(np.sin(around), np.cross(axis, first))
    seen = ring[:, ::2] + TILT * ring[:, 1:2] * np.abs(axis[::2])
    tip, back = seen[-1], seen[-3] - seen[-1]
    back *= HEAD / np.linalg.norm(back)
    wide = back[::-1] * [-0.7, 0.7]
    return f"turn J{joint}", at + radius * np.stack([*seen, tip + back + wide, tip, tip + back - wide])


def _dimensions(disputed: Iterable[model.Conflict]) -> tuple[list[Label], list[tuple[str, Reals]]]:
    """What documents contradict each other about: each reach that one states as a dimension of its own, below the base,
    from axis 1 on; that of the table in its colour.

    Returns
    -------
    labels, lines : what is measured, then each value with its source, each over its line
    """
    labels, lines = [], []
    for each in disputed:
        step = BELOW * each.measured
        labels.append(Label(say(each.subject), np.array([0.0, -step]), "open", SEEN, written_there=True))
        for row, stated in enumerate(each.statements, 2):
            kind: LabelKind = "right" if stated.met else "open"
            text = joined([with_unit(fixed(stated.expected, 1), each.unit), own_title(stated.document)], ": ")
            labels.append(Label(text, np.array([0.0, -step * row]), kind, written_there=True))
            lines += dimension(stated.expected, -step * (row + 0.5), 0.0, kind)[:1]
    return labels, lines


def _difference(disputed: model.Conflict) -> str:
    """By how much documents contradict each other about a reach."""
    values = [stated.expected for stated in disputed.statements]
    return tr("{far} of difference", far=with_unit(fixed(max(values) - min(values), 1), disputed.unit))


def _entries_seen(robot: Robot, evidence: Mapping[str, Any]) -> list[Label]:
    """The lengths that evidence contradicts most, and the angles that it leaves open, each at the link or joint that it
    is of; what is settled is in the table."""
    places, found = entry_places(robot), []
    worst = [row.address for row in evidence.get("first", ())[:LABELLED]]
    for joint, cells in evidence.get("rows", ()):
        for cell in filter(None, cells):
            entry = cell["entry"]
            angle = column_of(entry) in ANGLES
            if cell["status"] == "open" if angle else column_of(entry) in ("a", "d") and f"#cell-{entry}" in worst:
                kind, gives = _kind(cell["status"]), cell["gives"]
                values = joined([cell["value"], gives], " → " if kind == "wrong" else tr(" or "))
                text = f"{entry_word(entry)}: {with_unit(values, 'deg' if angle else 'mm')}"
                text += "?" if kind == "open" else ""
                found.append(Label(text, places.get(entry, places[str(joint)]), kind))
    return found


def _kind(status: str) -> LabelKind:
    return "wrong" if status == "contradicted" else "sound" if status in SETTLED else "open"


def _answer(
    study: Study, robot: str, summary: model.ValidationSummary, instead: str | None, disputed: Sequence[model.Conflict]
) -> Answer:
    """How many checks pass, how much of the table is confirmed, and what to do."""
    found, counts = summary.verdict.finding, summary.counts.independent
    evidence = summary.evidence
    bad, unsure = (evidence.contradicted, len(evidence.unconfirmed)) if evidence else (0, 0)
    headline, rest = _headline(summary, bad, unsure)
    keys = [(f"{counts.passed}/{counts.total}", tr("independent checks pass"))] if counts.total else []
    below = ""
    if evidence:
        alone = known_alone(evidence)
        count, what = (bad, tr("entries contradicted")) if bad else (alone - unsure, tr("entries settled by them"))
        keys.append((f"{count}/{alone}", what))
        if unsure and not bad:
            below = tr("{count} entries may be wrong unnoticed.", count=unsure)
    if disputed:
        keys[0] = _difference(disputed[0]), tr("between documents")
    if instead:
        fix = Fix(
            tr("use the table of {robot}.", robot=own_title(study.robot(instead).title)),
            f"../{instead}/validation.html",
        )
    elif disputed:
        stated = joined([fixed(each.expected, 1) for each in disputed[0].statements], " or ")
        fix = Fix(
            tr("measure the {subject}: {values} mm?", subject=say(disputed[0].subject), values=stated),
            f"#{SEEN}",
            instead=False,
        )
    elif is_one(found, "validation.left_open") and found.next_measurement:
        fix = Fix(say(found.next_measurement), f"#cell-{found.next_measurement.entry}", instead=False)
    elif is_one(found, "validation.no_reference"):
        fix = Fix(tr("read five poses at the pendant: er3a confirm {robot} --plan", robot=robot), instead=False)
    else:
        fix = None
    return Answer(headline, rest, below, keys, (), fix)


def _headline(summary: model.ValidationSummary, bad: int, unsure: int) -> tuple[str, str]:
    """The verdict in two short sentences; ``bad``, ``unsure``: entries contradicted, and not confirmed."""
    status = summary.verdict.status
    if is_one(summary.verdict.finding, "validation.defined_otherwise"):
        return tr("The same arm, defined otherwise."), tr("Correct zeros, directions, base or flange first.")
    if status == "fail":
        another = tr("Another arm's table.") if summary.is_beyond_correction else tr("This table is wrong.")
        return another, tr("Documents contradict {count} entries.", count=bad) if bad else ""
    if summary.conflicts:
        return tr("Sources disagree."), tr("Measure before you rely on it.")
    if status == "no_reference":
        return tr("Nothing to check against."), tr("Find documents or measure.")
    if unsure:
        return tr("Partly settled."), tr("Nothing contradicts this D-H table.")
    return tr("This D-H table is right."), tr("Documents settle every entry.")
