"""The part of the page that shows the table with the evidence for each entry."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import asdict
from math import pi
from typing import Any

from er3a.confirmation.plan import plan
from er3a.errors import Er3aError
from er3a.finding import Finding, is_one
from er3a.identifiability.entries import CONTINUOUS, column_of
from er3a.identifiability.entry_evidence import EntryEvidence, OtherReading, Status
from er3a.pipeline.language import N_, tr, with_unit
from er3a.pipeline.messages.confirm import on_pendant
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.references import STATUS_MEANINGS, STATUS_WORDS, entry_word
from er3a.pipeline.messages.say import joined, say, word
from er3a.pipeline.stages.validation.model import OtherTableFound, TableEvidence
from er3a.pipeline.viewing.answer import ListRow
from er3a.pipeline.viewing.page import panel_link, whole_sentence
from er3a.references.quantities import MM
from er3a.robots.joint_limits import shown
from er3a.robots.robot import Robot

# What to do with an entry is all that the grid says; why, its evidence does.
LOOKS: Mapping[Status, str] = {
    "settled": "sound",
    "settled_up_to_signs": "sound",
    "weak": "open",
    "consistent": "open",
    "open": "open",
    "contradicted": "wrong",
    "gauge": "free",
    "given": "free",
}
LEGEND = {
    "sound": N_("✓ {count} keep"),
    "open": N_("? {count} confirm"),
    "wrong": N_("✗ {count} wrong → instead (?: confirm)"),
}
MARKS = {"sound": "✓", "open": "?", "wrong": "✗", "free": "–"}
FIRST = 8  # entries to settle, named at the table's side
SETTLED = ("settled", "settled_up_to_signs", "gauge")
COLUMNS = {
    "a": "a (mm)",
    "alpha": "α (°)",
    "d": "d (mm)",
    "beta": "β (°)",
    "offset": N_("offset (°)"),
    "direction": N_("dir."),
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
    N_("What would settle it"),
)
OTHER_COLUMNS = ("a", "alpha", "d", "beta", "offset", "direction")
LIMITS = ("lower", "upper")
DIFFERS = 2e-3
IN_UNIT = {"a": MM, "d": MM, "direction": 1.0} | dict.fromkeys(("alpha", "beta", "offset", *LIMITS), 180 / pi)


def evidence_section(evidence: TableEvidence | None, behind: Collection[str] = ()) -> dict[str, Any] | None:
    """What the page shows of a table's evidence: the table by rows (a cell is None where it has no such entry), its
    legend, and the entries in words; the addresses of rows are names of entries. Those
    not settled come by how far the tool may be off, then those without a bound, then those that don't move it;
    ``first``: the worst of those that evidence contradicts, or else what to do. ``behind``: entries that a disputed
    reach is made of."""
    if evidence is None:
        return None
    by_name = {each.entry: each for each in evidence.entries}
    joints = sorted({int(name[len(kind) :]) for name in by_name if (kind := name.rstrip("0123456789")) in COLUMNS})
    kinds = [kind for kind in COLUMNS if any(f"{kind}{joint}" in by_name for joint in joints)]
    everything = [*evidence.entries, *evidence.combinations]
    numbers = [each for each in everything if each.value is not None]
    left = [each for each in numbers if each.status not in SETTLED]
    left.sort(key=lambda each: (not each.off.moves, _unbounded(each), -each.off.mm, -each.off.deg))
    listed = [*left, *(each for each in numbers if each.status in SETTLED)]
    proposals = {proposal.entry: to_settle(proposal) for proposal in evidence.proposals}
    todo = {each.entry: proposals[each.entry] for each in evidence.proposals if not is_one(each, "look_at_motion")}
    counts = Counter(LOOKS[each.trust] for each in evidence.entries if each.value is not None)
    present = {each.trust for each in numbers}
    legend = [(look, tr(text, count=counts[look])) for look, text in LEGEND.items() if counts[look]]
    first = [
        ListRow(
            "fail",
            entry_word(each.entry),
            _tool_off(each),
            f"#cell-{each.entry}",
            length=each.off.mm / (left[0].off.mm or 1.0),
        )
        for each in left[:FIRST]
    ]
    return dict(
        columns=[tr(COLUMNS[kind]) for kind in kinds],
        rows=[(joint, [_cell(by_name.get(f"{kind}{joint}"), evidence, todo) for kind in kinds]) for joint in joints],
        legend=[*legend, *([("open behind", tr("set this reach"))] if behind else [])],
        behind=behind,
        meanings=[
            (look, _status(status), word("status_meaning", STATUS_MEANINGS, status))
            for status, look in LOOKS.items()
            if status in present
        ],
        open_columns=OPEN_COLUMNS,
        open_entries=[each.entry for each in listed],
        open_rows=[[*_row(each, evidence), _tool_off(each), proposals.get(each.entry, "–")] for each in listed],
        looks=[each for each in evidence.proposals if is_one(each, "look_at_motion")],
        first=first if evidence.contradicted else to_confirm(evidence),
    )


def cells_of(section: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """What :func:`evidence_section` says of each entry, by its name."""
    return {cell["entry"]: cell for _, row in section.get("rows", ()) for cell in row if cell}


def to_settle(proposal: Finding) -> str:
    """What would settle an entry: of lengths and angles the poses of :func:`to_confirm`, whose second step they are."""
    if not is_one(proposal, "measure_angle", "measure_length"):
        return say(proposal)
    return tr("Read five poses, for {names}", names=entry_word(proposal.entry))


def to_confirm(evidence: TableEvidence | None) -> list[ListRow]:
    """What to do before the real arm moves, each with how far the tool is off if the worst that it finds out is wrong,
    and the place on the page that says how; all of it where no document speaks of the table."""
    left = [each for each in evidence.entries if each.entry in evidence.unconfirmed] if evidence else []
    steps = (
        (N_("Jog each joint: turns as drawn?"), ("direction",), "cell-direction1"),
        (N_("Read five poses, for {names}"), (*CONTINUOUS, "beta"), "poses"),
        (N_("Enter the controller's limits and speeds, run again"), LIMITS, "limits"),
    )
    rows = []
    for text, kinds, place in steps:
        own = [each for each in left if column_of(each.entry) in kinds]
        named = joined([entry_word(each.entry) for each in own[:2]], ", ") + (" …" if len(own) > 2 else "") or tr(
            "the table"
        )
        worst = max(own, key=lambda each: (each.off.mm, each.off.deg), default=None)
        if own or evidence is None:
            off = _tool_off(worst) if worst and worst.off.moves else tr("may hit a stop") if worst else ""
            rows.append(ListRow("caution", tr(text, names=named), off, f"#{place}"))
    return rows


def known_alone(evidence: TableEvidence) -> int:
    """How many entries of a table mean something alone."""
    return sum(each.value is not None and each.status != "gauge" for each in evidence.entries)


def poses_to_read(robot: Robot) -> tuple[list[str], list[list[str]]]:
    """Columns and rows of the poses to read at the pendant; no rows where too few are safe.

    Parameters
    ----------
    robot : the table alone, with its own base and the flange as tool
    """
    try:
        found = plan(robot)
    except Er3aError:
        return [], []
    units = ["mm" if slides else "°" for slides in robot.slides]
    columns = [f"J{k} ({unit})>" for k, unit in enumerate(units, 1)]
    columns += [f"{name} ({'mm' if name in 'XYZ' else '°'})>" for name in "XYZABC"]
    poses = enumerate(zip(shown(robot, found.q), found.T), 1)
    rows = [
        [panel_link(q, str(k)), *(fixed(value, 0) for value in q), *(fixed(value, 2) for value in on_pendant(T))]
        for k, (q, T) in poses
    ]
    return [tr("pose"), *columns], rows


def plain_table(robot: Robot) -> tuple[list[str], list[list[str]]]:
    """Columns and rows of a table that no document speaks of, as the page shows them: mm and deg."""
    kinds = [kind for kind in OTHER_COLUMNS if kind != "beta" or robot.beta.any()]
    rows = zip(*(getattr(robot, kind) * IN_UNIT[kind] for kind in kinds))
    columns = [tr("joint"), *(f"{tr(COLUMNS[kind])}>" for kind in kinds)]
    return columns, [[str(joint), *(_plain(float(value)) for value in row)] for joint, row in enumerate(rows, 1)]


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
    given = kind in OTHER_COLUMNS or (found.code != "allowed" and kind in LIMITS)
    value = _other_value(found, each)
    return _plain(value) if given and abs(value - (each.value or 0.0)) > DIFFERS else ""


def _other_given(each: EntryEvidence, evidence: TableEvidence) -> str:
    """What an entry may be instead, or as well; empty where that is no other number."""
    return _gives(each, evidence) or _alone(each)


def _alone(each: EntryEvidence) -> str:
    """Another value that an open entry may have though all others are right; empty where it has none."""
    values = [dict(reading.entries) for reading in _others(each) if each.status == "open"]
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


def other_robot(robot: Robot, evidence: TableEvidence | None) -> Robot | None:
    """The robot with the other table, if there is one."""
    return robot.replace(**asdict(evidence.other.table)) if evidence and evidence.other else None


def _cell(each: EntryEvidence | None, evidence: TableEvidence, proposals: Mapping[str, str]) -> dict[str, Any] | None:
    """An entry in the table; None where there is none."""
    if each is None or each.value is None:
        return None
    look = LOOKS[each.trust]
    return dict(
        entry=each.entry,
        value=_plain(each.value),
        status=each.trust,
        unit=each.unit,
        look=look,
        mark=MARKS[look],
        title=tr("{entry}: {status}", entry=entry_word(each.entry), status=_status(each.trust)),
        gives=_other_given(each, evidence),
        said=_said(each, evidence, proposals),
        unsure=len(each.by) == 1,
    )


def _said(each: EntryEvidence, evidence: TableEvidence, proposals: Mapping[str, str]) -> str:
    """What is known of an entry, and what to do, in short sentences."""
    other, status = _other_given(each, evidence), each.trust
    first = word("status_meaning", STATUS_MEANINGS, status)
    if other:
        known = N_("it is {value}") if each.by[1:] else N_("by one document it is {value}: confirm it")
        text = known if status == "contradicted" else N_("it could be {value}")
        first = tr(text, value=with_unit(other, each.unit))
    said = map(whole_sentence, filter(None, (first, proposals.get(each.entry, ""))))
    return joined([entry_word(each.entry), joined(said, " ")], ": ")


def _status(status: Status) -> str:
    return word("status", STATUS_WORDS, status)


def _plain(value: float, digits: int = 3) -> str:
    return fixed(value, digits).rstrip("0").rstrip(".")


def _row(each: EntryEvidence, evidence: TableEvidence) -> list[str]:
    return [
        entry_word(each.entry),
        with_unit(_plain(each.value or 0.0), each.unit),
        _status(each.trust),
        _interval(each, evidence),
        joined(each.by, ", ") or "–",
    ]


def _unbounded(each: EntryEvidence) -> bool:
    """Whether an entry could be anything but for its one document; a direction is 1 or -1 all the same."""
    return each.status == "consistent" and column_of(each.entry) != "direction"


def _tool_off(each: EntryEvidence) -> str:
    if _unbounded(each):
        return tr("no bound")
    if not each.off.moves:
        return "–"
    off = _off(each.off.mm, each.off.deg)
    return tr("at least {off}", off=off) if each.at_least else off


def _interval(each: EntryEvidence, evidence: TableEvidence) -> str:
    if each.interval is None or each.status == "gauge":
        return "–"
    low, high = (_plain(value, 2) for value in each.interval)
    if column_of(each.entry) == "direction":
        return tr("{low} or {high}", low=low, high=high) if low != high else low
    if each.status in ("consistent", "open"):
        other = _other_given(each, evidence)
        return with_unit(joined([_plain(each.value or 0.0), other], tr(" or ")), each.unit) if other else tr("anything")
    text = tr("{low} to {high}", low=low, high=with_unit(high, each.unit))
    return tr("at least {off}", off=text) if each.at_least else text


def _off(mm: float, deg: float) -> str:
    far, turned = (fixed(value, 0 if value >= 10 else 1) for value in (mm, deg))
    if far == "0.0":  # of a turn in place, which "0.0 mm" would make look harmless
        return tr("turned by {deg}°", deg=turned)
    if turned == "0.0":
        return with_unit(far, "mm")
    return tr("{mm} mm, {deg}°", mm=far, deg=turned)


def _others(each: EntryEvidence) -> list[OtherReading]:
    return [reading for reading in each.alternatives if reading.off.moves and not reading.excluded_by]
