"""The part of the page that shows the table with the evidence for each entry."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Set
from dataclasses import asdict, dataclass
from itertools import combinations, product
from math import pi
from typing import Any

import numpy as np
from markupsafe import Markup

from er3a.finding import is_one
from er3a.geometry.transforms import rpy_of
from er3a.geometry.vectors import wrap_to_pi
from er3a.identifiability.entries import column_of
from er3a.identifiability.entry_evidence import EntryEvidence, OtherReading, Status
from er3a.kinematics.forward import forward
from er3a.pipeline.language import N_, own_title, tr, with_unit
from er3a.pipeline.messages.numbers import fixed, number
from er3a.pipeline.messages.references import STATUS_MEANINGS, STATUS_WORDS
from er3a.pipeline.messages.say import joined, say, word
from er3a.pipeline.messages.validation import not_confirmed, shortened
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
CONFIRMED = ("settled", "settled_up_to_signs")
SETTLED = ("settled", "settled_up_to_signs", "gauge")
VERDICTS: Mapping[str, Mapping[Status, str]] = {  # in the three words that a reader of the index needs
    N_("confirmed"): {
        "settled": "",
        "settled_up_to_signs": N_("as long as the open entries are right"),
    },
    N_("nothing to confirm"): {"gauge": N_("only the sum counts")},
    N_("not confirmed"): {
        "weak": N_("too loosely"),
        "consistent": N_("the only document that gives the value agrees with it, but confirms none of its own values"),
        "open": N_("no document tells it from another value"),
    },
    N_("contradicted"): {"contradicted": N_("→ what the evidence gives")},
}
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
SHOWN_READINGS = 3
DETAIL_COLUMNS = (
    N_("Entry"),
    N_("Value>"),
    N_("Status"),
    N_("Evidence leaves open"),
    N_("Tool off by"),
    N_("Documents"),
    N_("Other readings"),
    N_("What would settle it"),
)


OFF_COLUMNS = (
    N_("Entry"),
    N_("Stated>"),
    N_("Supported>"),
    N_("Difference>"),
    N_("Tool off by"),
    N_("Documents"),
)
OTHER_COLUMNS = ("a", "alpha", "d", "beta", "offset", "direction")
LIMITS = ("lower", "upper")
DIFFERS = 2e-3
BENT, BENT_BY = 5, pi / 6  # a joint (from 1) that is not at 0 where two tables are told apart, and its angle
MAX_DIFFERENT = 3  # entries in which two tables may differ to be told apart at one pose
READ_WITHIN = 0.5  # deg, of an angle that a pendant shows
STEEP = 85.0  # deg, from which pitch on roll and yaw are not unique enough to compare
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


def evidence_section(
    robot: Robot, evidence: TableEvidence | None, to_use: TableEvidence | None = None
) -> dict[str, Any] | None:
    """What the page shows of a table's evidence: the table by rows (a cell is None where it has no such entry), its
    legend, and the entries in words; rows of entries begin with the name, which is the address on the page.

    ``to_use``: the evidence of the table to use instead. What only its own source gives is marked so in both: that
    document alone settles an entry of another table, which stays settled, but confirms nothing beside its own table.
    """
    if evidence is None:
        return None
    unconfirmed = {each.entry for each in to_use.entries if each.status == "consistent"} if to_use else set()
    of_one = [each.entry for each in evidence.entries if each.status in CONFIRMED and each.entry in unconfirmed]
    by_name = {each.entry: each for each in evidence.entries}
    joints = sorted({int(name[len(kind) :]) for name in by_name if (kind := name.rstrip("0123456789")) in COLUMNS})
    kinds = [kind for kind in COLUMNS if any(f"{kind}{joint}" in by_name for joint in joints)]
    everything = [*evidence.entries, *evidence.combinations]
    numbers = [each for each in everything if each.value is not None]
    left = [each for each in numbers if each.status not in SETTLED]
    read = _read_pose(robot, evidence)
    by_pose = tr("{measurement}; or read a pose on the pendant (“What would settle it”)")
    proposals = {
        proposal.entry: by_pose.format(measurement=say(proposal))
        if read and is_one(proposal, "measure_angle")
        else say(proposal)
        for proposal in evidence.proposals
    }
    alone: list[Status] = ["consistent"] if of_one else []
    present = dict.fromkeys([*(each.status for each in numbers), *alone])
    return dict(
        columns=[tr(COLUMNS[kind]) for kind in kinds],
        rows=[
            (joint, [_cell(by_name.get(f"{kind}{joint}"), evidence, unconfirmed) for kind in kinds]) for joint in joints
        ],
        verdicts=verdict_legend(present),
        allowed=_allowed(evidence),
        legend=[
            (status, _marked(status), word("status_meaning", STATUS_MEANINGS, status))
            for status in MARKS
            if status in present
        ],
        off_columns=[tr(column) for column in OFF_COLUMNS],
        off_rows=[_off_row(each) for each in numbers if each.status == "contradicted"],
        open_columns=[tr(column) for column in DETAIL_COLUMNS],
        settled_columns=[tr(column) for column in DETAIL_COLUMNS[:-1]],
        open_rows=[[*_row(each), proposals.get(each.entry, "–")] for each in left],
        settled_rows=[_row(each, each.entry in of_one) for each in numbers if each.status in SETTLED],
        unmet=not evidence.table_meets and evidence.other is None,
        other=_other(evidence) if evidence.other else None,
        readings=read,
        of_one=shortened(of_one),
        tolerance=tr(
            "{mm} mm and {deg} deg", mm=number(evidence.tolerance.mm, 2), deg=number(evidence.tolerance.deg, 2)
        ),
    )


def verdict_legend(statuses: Iterable[Status]) -> list[tuple[str, list[tuple[Status, str, str]]]]:
    """What the marks of these statuses mean: each verdict with its statuses, in mark and word, and what they add."""
    present = set(statuses)
    return [
        (
            tr(verdict),
            [(status, _marked(status), text and tr(text)) for status, text in each.items() if status in present],
        )
        for verdict, each in VERDICTS.items()
        if not present.isdisjoint(each)
    ]


@dataclass(frozen=True)
class PoseReadings:
    """What a pendant shows at a pose, by what a table of an arm can be: reading and the entries that differ there.

    ``first``: directions of joints, as words, that are to be checked before; ``within``: how far off a reading
    may be, deg.
    """

    pose: str
    first: str
    rows: tuple[tuple[str, str], ...]
    within: float = READ_WITHIN


def _read_pose(robot: Robot, evidence: TableEvidence) -> PoseReadings | None:
    """What a pendant shows at a pose, which distinguishes the table from another that fits all documents, and from what
    lies between the two: each of the entries in which they differ by itself, and the bent joint's direction.

    None where there is no other, or its orientation is the same or has no unique angles there.
    """
    other = other_robot(robot, evidence)
    if other is None or evidence.other is None or evidence.other.code != "allowed" or robot.joints < BENT:
        return None
    q, bent = np.zeros(robot.joints), BENT - 1
    q[bent] = BENT_BY if robot.upper[bent] >= BENT_BY else -BENT_BY
    differs = [
        (kind, k)
        for kind in ("alpha", "offset")
        for k in np.flatnonzero(np.abs(getattr(other, kind) - getattr(robot, kind)) > DIFFERS).tolist()
    ]
    if len(differs) > MAX_DIFFERENT:
        return None
    read: dict[tuple[float, ...], list[str]] = {}
    for turned, *changed in product((False, True), *([(False, True)] * len(differs))):
        values = {kind: getattr(robot, kind).copy() for kind in ("alpha", "offset", "direction")}
        values["direction"][bent] *= -1 if turned else 1
        named = []
        for (kind, k), change in zip(differs, changed):
            if change:
                values[kind][k] = getattr(other, kind)[k]
                named.append(f"{kind}{k + 1} = {_plain(np.degrees(values[kind][k]))}")
        if turned:
            named.append(f"direction{BENT} = {_plain(values['direction'][bent])}")
        angles = np.degrees(rpy_of(forward(robot.replace(**values), q)))
        if abs(angles[1]) > STEEP:
            return None
        seen = tuple((np.where(angles.round(1) == -180, 180.0, angles.round(1)) + 0.0).tolist())
        read.setdefault(seen, []).append(joined(named, ", ") or tr("the table of this page"))
    apart = [np.abs(wrap_to_pi(np.radians(np.subtract(a, b)))).max() for a, b in combinations(read, 2)]
    if not apart or np.degrees(min(apart)) < 2 * READ_WITHIN:
        return None
    joints = [
        each.entry[len("direction") :]
        for each in evidence.entries
        if column_of(each.entry) == "direction" and each.status not in SETTLED
    ]
    return PoseReadings(
        pose=tr("J{joint} at {angle} deg, all others at 0", joint=BENT, angle=fixed(np.degrees(q[bent]), 0)),
        first=", ".join(joints),
        rows=tuple((", ".join(fixed(angle, 1) for angle in seen), joined(named)) for seen, named in read.items()),
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


def _allowed(evidence: TableEvidence) -> str:
    """The entries of another table that fits every document, as it has them; empty where there is none."""
    if evidence.other is None or evidence.other.code != "allowed":
        return ""
    given = [(each, _gives(each, evidence)) for each in evidence.entries]
    texts = [
        tr("{entry} = {value} (here {own})", entry=each.entry, value=v, own=_value(each)) for each, v in given if v
    ]
    return joined(texts, ", ")


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


def _cell(each: EntryEvidence | None, evidence: TableEvidence, unconfirmed: Set[str]) -> dict[str, Any] | None:
    if each is None or each.value is None:
        return None
    of_one = each.status in CONFIRMED and each.entry in unconfirmed
    title = tr("{entry}: {status}", entry=each.entry, status=_also_of_one(_status(each.status), of_one))
    mark = joined([_mark(each.status), tr("one source, agrees") if of_one else ""], " ")
    shown = dict(entry=each.entry, value=_value(each), status=each.status, mark=mark, title=title)
    gives = _gives(each, evidence) or _alone(each)
    alone = gives and each.status == "contradicted" and each.entry in unconfirmed
    shown |= dict(plain=gives, gives=f"{gives} {_mark('consistent')}" if alone else gives)
    return shown | dict(status="consistent") if of_one else shown  # not in the colour of what is confirmed


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


def _also_of_one(status: str, of_one: bool) -> str:
    """A status, and that only the source of the table to use gives the value."""
    return joined([status, _mark("consistent") if of_one else ""], ", ")


def _row(each: EntryEvidence, of_one: bool = False) -> list[str]:
    return [
        each.entry,
        with_unit(_value(each), each.unit),
        _also_of_one(_marked(each.status), of_one),
        _interval(each) if each.interval and each.status != "gauge" else "–",
        _tool_off(each),
        joined(each.by, ", ") or "–",
        joined([_reading(reading) for reading in each.alternatives[:SHOWN_READINGS]]) or "–",
    ]


def _off_row(each: EntryEvidence) -> list[str]:
    """A contradicted entry: what is stated, the middle of what evidence leaves open with half its width, and how far
    apart they are."""
    link = Markup('<a href="#entry-{0}">{0}</a>').format(each.entry)
    last_cells = [_tool_off(each), joined(each.by, ", ") or "–"]
    if each.value is None or each.interval is None:
        return [link, _value(each), "–", "–", *last_cells]
    if column_of(each.entry) == "direction":
        return [link, _signed(each.value, 0), _signed(each.interval[0], 0), tr("turns the other way"), *last_cells]
    stated = with_unit(_value(each), each.unit)
    if each.at_least:
        return [link, stated, _interval(each), "–", *last_cells]
    low, high = each.interval
    middle, half = (low + high) / 2, (high - low) / 2
    supported = with_unit(f"{fixed(middle, 2)} ± {fixed(half, 2)}", each.unit)
    return [link, stated, supported, with_unit(_signed(each.value - middle, 2), each.unit), *last_cells]


def _signed(value: float, decimals: int) -> str:
    return ("+" if value > 0 else "") + fixed(value, decimals)


def _tool_off(each: EntryEvidence) -> str:
    if each.status == "consistent":
        return tr("no bound")
    if not each.off.moves:
        return "–"
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


def _reading(reading: OtherReading) -> str:
    changes = joined([f"{name} = {_plain(value)}" for name, value in reading.entries], ", ")
    if not reading.off.moves:
        return tr("{changes}: the same robot", changes=changes)
    if reading.excluded_by:
        return tr(
            "{changes}: excluded only by {documents}, not independent",
            changes=changes,
            documents=", ".join(reading.excluded_by),
        )
    return tr("{changes}: allowed", changes=changes)
