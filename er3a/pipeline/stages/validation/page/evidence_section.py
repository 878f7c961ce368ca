"""The part of the page that shows the table with the evidence for each entry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from math import pi
from typing import Any

from er3a.identifiability.entries import column_of
from er3a.identifiability.entry_evidence import EntryEvidence, Status
from er3a.pipeline.language import N_, own_title, tr, with_unit
from er3a.pipeline.messages.numbers import fixed, number
from er3a.pipeline.messages.references import STATUS_MEANINGS, STATUS_WORDS
from er3a.pipeline.messages.say import joined, say, word
from er3a.pipeline.messages.validation import not_confirmed
from er3a.pipeline.stages.validation.model import OtherTableFound, TableEvidence
from er3a.references.quantities import MM
from er3a.robots.robot import Robot

MARKS: Mapping[Status, str] = {
    "settled": "✓",
    "settled_up_to_signs": "(✓)",
    "weak": "~",
    "contradicted": "✗",
    "consistent": STATUS_WORDS["consistent"],  # a sign would be read as a confirmation
    "open": "?",
    "gauge": "↔",
    "given": "·",
}
SETTLED = ("settled", "settled_up_to_signs", "gauge")
COLUMNS = {
    "a": "a (mm)",
    "alpha": "α (°)",
    "d": "d (mm)",
    "beta": "β (°)",
    "offset": N_("offset (°)"),
    "direction": N_("direction"),
    "lower": N_("from (°)"),
    "upper": N_("to (°)"),
    "speed": N_("speed (°/s)"),
}
OPEN_COLUMNS = (
    N_("Entry"),
    N_("Value>"),
    N_("Status"),
    N_("Evidence leaves open"),
    N_("Documents"),
    N_("Tool off by"),
    N_("Fits as well"),
    N_("What would settle it"),
)
SETTLED_COLUMNS = OPEN_COLUMNS[:5]
OTHER_COLUMNS = ("a", "alpha", "d", "beta", "offset", "direction")
LIMITS = ("lower", "upper")
DIFFERS = 2e-3
IN_UNIT = {"a": MM, "d": MM, "direction": 1.0} | dict.fromkeys(("alpha", "beta", "offset", *LIMITS), 180 / pi)
OTHER_TITLES = {
    "described": N_("The table that independent documents describe"),
    "allowed": N_("Another table that fits every document"),
}
OTHER_TEXTS = {
    "described": N_(
        "Of all tables that meet the independent documents this is the nearest that was found; what differs is marked. "
        "Values are one choice within what the documents leave open, with as few decimals as that allows."
    ),
    "allowed": N_(
        "The documents fit this table just as well: they can't tell which of the two is right. Differences are marked."
    ),
}


def evidence_section(robot: Robot, evidence: TableEvidence | None) -> dict[str, Any] | None:
    """What the page shows of a table's evidence: the table by rows (a cell is None where it has no such entry), its
    legend, and the entries in words; rows of entries begin with the name, which is the address on the page."""
    if evidence is None:
        return None
    by_name = {each.entry: each for each in evidence.entries}
    joints = sorted({int(name[len(kind) :]) for name in by_name if (kind := name.rstrip("0123456789")) in COLUMNS})
    kinds = [kind for kind in COLUMNS if any(f"{kind}{joint}" in by_name for joint in joints)]
    everything = [*evidence.entries, *evidence.combinations]
    numbers = [each for each in everything if each.value is not None]
    left = [each for each in numbers if each.status not in SETTLED]
    proposals = {proposal.entry: say(proposal) for proposal in evidence.proposals}
    present = {each.status for each in numbers}
    return dict(
        columns=[tr(COLUMNS[kind]) for kind in kinds],
        rows=[(joint, [_cell(by_name.get(f"{kind}{joint}"), evidence) for kind in kinds]) for joint in joints],
        legend=[
            (status, _marked(status), word("status_meaning", STATUS_MEANINGS, status))
            for status in MARKS
            if status in present
        ],
        open_columns=[tr(column) for column in OPEN_COLUMNS],
        settled_columns=[tr(column) for column in SETTLED_COLUMNS],
        open_rows=[[*_row(each), _tool_off(each), _fits(each), proposals.get(each.entry, "–")] for each in left],
        settled_rows=[_row(each) for each in numbers if each.status in SETTLED],
        unmet=not evidence.table_meets and evidence.other is None,
        other=_other(evidence) if evidence.other else None,
        tolerance=tr(
            "{mm} mm and {deg} deg", mm=number(evidence.tolerance.mm, 2), deg=number(evidence.tolerance.deg, 2)
        ),
    )


def _other(evidence: TableEvidence) -> dict[str, Any] | None:
    found = evidence.other
    if found is None:
        return None
    by_name = {each.entry: each for each in evidence.entries}
    kinds = [kind for kind in OTHER_COLUMNS if f"{kind}1" in by_name]
    if found.code == "described":
        kinds += [kind for kind in LIMITS if f"{kind}1" in by_name]
    rows = []
    for joint in range(1, len(found.table.a) + 1):
        cells = []
        for kind in kinds:
            each = by_name.get(f"{kind}{joint}")
            if each is None:  # a limit of a joint that turns on and on
                cells.append(("–", False, "", ""))
                continue
            value = _other_value(found, each)
            cells.append((_plain(value), abs(value - (each.value or 0.0)) > DIFFERS, "", ""))
        rows.append((joint, cells))
    title, text = (word(found.code, words, found.code) for words in (OTHER_TITLES, OTHER_TEXTS))
    return dict(title=title, text=text, page="", columns=[tr(COLUMNS[kind]) for kind in kinds], rows=rows)


def _other_value(found: OtherTableFound, each: EntryEvidence) -> float:
    """An entry's value in the other table, as rounded as its evidence allows."""
    kind = column_of(each.entry)
    if kind not in OTHER_COLUMNS:
        return rounded_within(_limit(each), each)
    joint = int(each.entry.removeprefix(kind))
    return rounded_within(getattr(found.table, kind)[joint - 1] * IN_UNIT[kind], each)


def _gives(each: EntryEvidence, evidence: TableEvidence) -> str:
    """What evidence gives instead of a contradicted entry, or as well as an open one; empty where that is no other."""
    found, kind = evidence.other, column_of(each.entry)
    if found is None or (found.code == "described") != (each.status == "contradicted"):
        return ""
    if kind not in (*OTHER_COLUMNS, *LIMITS) or (found.code == "allowed" and kind in LIMITS):
        return ""
    value = _other_value(found, each)
    return _plain(value) if abs(value - (each.value or 0.0)) > DIFFERS else ""


def _alone(each: EntryEvidence) -> str:
    """Another value that an open entry may have though all others are right; empty where it has none."""
    readings = [reading for reading in each.alternatives if reading.off.moves and not reading.excluded_by]
    values = [dict(reading.entries) for reading in readings if each.status == "open"]
    return next((_plain(value[each.entry]) for value in values if value.keys() == {each.entry}), "")


def _limit(each: EntryEvidence) -> float:
    """A limit that documents exclude, as they have it; any other as it is given."""
    if each.status == "contradicted" and each.interval is not None:
        return sum(each.interval) / 2
    return each.value or 0.0


def rounded_within(value: float, each: EntryEvidence) -> float:
    """A value with as few decimals as the entry's evidence allows; with three where it leaves nothing open."""
    low, high = each.interval or (value, value)
    if each.status != "contradicted" and abs(value - (each.value or 0.0)) < DIFFERS:
        return each.value or 0.0
    if each.status == "gauge":  # a sum alone is known: its parts are not rounded one by one
        return round(value, 3)
    return next((rounded for k in range(3) if low <= (rounded := round(value, k)) <= high), round(value, 3))


def table_to_use(robot: Robot, other: Robot, unconfirmed: str, evidence: TableEvidence | None) -> dict[str, Any]:
    """The whole table of another robot of the study, limits included, as its file gives it: by joint its values,
    whether they differ, which is marked where both tables are of one convention, and what an open one may be as well.
    ``unconfirmed``: what of it nothing settles; ``evidence``: of its entries, of which those that are not settled are
    marked."""
    known = {each.entry: each for each in evidence.entries} if evidence else {}
    kinds = [kind for kind in OTHER_COLUMNS if kind != "beta" or other.beta.any()]
    comparable = robot.convention == other.convention and robot.rows == other.rows and robot.joints == other.joints
    rows = []
    for k in range(other.rows):
        cells = []
        for kind in (*kinds, *LIMITS):
            if kind in LIMITS and k >= other.joints:
                cells.append(("–", False, "", ""))
                continue
            unit = MM if kind in LIMITS and other.slides[k] else IN_UNIT[kind]
            value = round(float(getattr(other, kind)[k]) * unit, 3)
            differs = comparable and abs(value - float(getattr(robot, kind)[k]) * unit) > DIFFERS
            each = known.get(f"{kind}{k + 1}")
            mark = "" if each is None or each.status in SETTLED else _mark(each.status)
            cells.append((_plain(value), differs, _alone(each) if each else "", mark))
        rows.append((k + 1, cells))
    source = other.sources.get("dh")
    parts = [tr("Source: {source}.", source=own_title(source.source))] if source else []
    if comparable:
        parts.append(tr("What differs is marked."))
    if unconfirmed:
        parts.append(not_confirmed(unconfirmed))
        parts.append(
            tr(
                "“One source”: only the source of {robot} gives it, which may contradict another table but confirms "
                "none of its own values; ? and ~ no document settles it. Check all of these on the arm.",
                robot=other.name,
            )
        )
    return dict(
        title=tr("The table to use: {robot}", robot=other.name),
        text=joined(parts, " "),
        page=f"../{other.name}/validation.html",
        columns=[tr(COLUMNS[kind]) for kind in (*kinds, *LIMITS)],
        rows=rows,
    )


def other_robot(robot: Robot, evidence: TableEvidence | None) -> Robot | None:
    """The robot with the other table, if there is one."""
    return robot.replace(**asdict(evidence.other.table)) if evidence and evidence.other else None


def _cell(each: EntryEvidence | None, evidence: TableEvidence) -> dict[str, Any] | None:
    if each is None or each.value is None:
        return None
    title = tr("{entry}: {status}", entry=each.entry, status=_status(each.status))
    gives = _gives(each, evidence) or _alone(each)
    return dict(
        entry=each.entry, value=_value(each), status=each.status, mark=_mark(each.status), title=title, gives=gives
    )


def _mark(status: Status) -> str:
    return tr(MARKS[status]) if MARKS[status] == STATUS_WORDS[status] else MARKS[status]


def _marked(status: Status) -> str:
    """A status with its mark, unless that is the same word."""
    return _status(status) if MARKS[status] == STATUS_WORDS[status] else f"{MARKS[status]} {_status(status)}"


def _status(status: Status) -> str:
    return word("status", STATUS_WORDS, status)


def _value(each: EntryEvidence) -> str:
    return _plain(each.value) if each.value is not None else ""


def _plain(value: float) -> str:
    return fixed(value, 3).rstrip("0").rstrip(".")


def _row(each: EntryEvidence) -> list[str]:
    return [
        each.entry,
        with_unit(_value(each), each.unit),
        _marked(each.status),
        _interval(each) if each.interval and each.status != "gauge" else "–",
        joined(each.by, ", ") or "–",
    ]


def _tool_off(each: EntryEvidence) -> str:
    if each.status == "consistent":
        return tr("no bound")
    if not each.off.moves:
        return tr("no bound") if each.status == "contradicted" and column_of(each.entry) == "direction" else "–"
    off = _off(each.off.mm, each.off.deg)
    return tr("at least {off}", off=off) if each.at_least else off


def _interval(each: EntryEvidence) -> str:
    if each.interval is None:
        return "–"
    low, high = (fixed(value, 2).rstrip("0").rstrip(".") for value in each.interval)
    if column_of(each.entry) == "direction":
        return tr("{low} or {high}", low=low, high=high) if low != high else low
    if each.status in ("consistent", "open"):
        return tr("anything")
    if each.at_least:
        return tr("at least {low} to {high}", low=low, high=with_unit(high, each.unit))
    return tr("{low} to {high}", low=low, high=with_unit(high, each.unit))


def _off(mm: float, deg: float) -> str:
    return tr("{mm} mm, {deg} deg", mm=fixed(mm, 0 if mm >= 10 else 1), deg=fixed(deg, 0 if deg >= 10 else 1))


def _fits(each: EntryEvidence) -> str:
    """Other values that independent documents allow, and that make another robot."""
    others = [reading for reading in each.alternatives if reading.off.moves and not reading.excluded_by]
    named = (joined([f"{name} = {_plain(value)}" for name, value in reading.entries], ", ") for reading in others)
    return joined(named) or "–"
