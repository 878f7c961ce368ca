"""The part of the page that shows the table with what is known of each of its entries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from er3a.identifiability.entry_evidence import EntryEvidence, OtherReading, Status
from er3a.pipeline.messages.evidence import STATUS_MEANINGS, STATUS_WORDS
from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.messages.say import joined, say, word
from er3a.pipeline.stages.validation.model import TableEvidence
from er3a.pipeline.viewing.numbers import fixed, number

MARKS: Mapping[Status, str] = {
    "settled": "✓",
    "weak": "~",
    "contradicted": "✗",
    "consistent": "=",
    "open": "?",
    "gauge": "↔",
    "given": "·",
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


@dataclass(frozen=True)
class EntryCell:
    """An entry in the table: its value, a mark and a class for its status, and what to tell of it."""

    value: str
    status: Status
    mark: str
    told: str


@dataclass(frozen=True)
class EvidenceSection:
    """The table by rows (a cell is None where the table has no such entry), its legend, and the entries in words."""

    columns: list[str]
    rows: list[tuple[int, list[EntryCell | None]]]
    legend: list[tuple[str, str, str, str]]
    open_columns: list[str]
    open_rows: list[list[str]]
    settled_columns: list[str]
    settled_rows: list[list[str]]
    tolerance: str


def evidence_section(evidence: TableEvidence | None) -> EvidenceSection | None:
    """What the page shows of a table's evidence."""
    if evidence is None:
        return None
    by_name = {each.entry: each for each in evidence.entries}
    joints = sorted({int(name[len(kind) :]) for name in by_name if (kind := name.rstrip("0123456789")) in COLUMNS})
    kinds = [kind for kind in COLUMNS if any(f"{kind}{joint}" in by_name for joint in joints)]
    everything = [*evidence.entries, *evidence.combinations]
    numbers = [each for each in everything if each.value is not None]
    left = [each for each in numbers if each.status not in ("settled", "gauge")]
    proposals = {proposal.entry: say(proposal) for proposal in evidence.proposals}
    present = dict.fromkeys(each.status for each in numbers)
    return EvidenceSection(
        columns=[tr(COLUMNS[kind]) for kind in kinds],
        rows=[(joint, [_cell(by_name.get(f"{kind}{joint}")) for kind in kinds]) for joint in joints],
        legend=[
            (status, mark, _status(status), word("status_meaning", STATUS_MEANINGS, status))
            for status, mark in MARKS.items()
            if status in present
        ],
        open_columns=[tr(column) for column in DETAIL_COLUMNS],
        settled_columns=[tr(column) for column in DETAIL_COLUMNS[:-1]],
        open_rows=[[*_row(each), proposals.get(each.entry, "–")] for each in left],
        settled_rows=[_row(each) for each in numbers if each.status in ("settled", "gauge")],
        tolerance=tr(
            "{mm} mm and {deg} deg", mm=number(evidence.tolerance.mm, 2), deg=number(evidence.tolerance.deg, 2)
        ),
    )


def _cell(each: EntryEvidence | None) -> EntryCell | None:
    if each is None or each.value is None:
        return None
    told = tr("{entry}: {status}", entry=each.entry, status=_status(each.status))
    return EntryCell(_value(each), each.status, MARKS[each.status], told)


def _status(status: Status) -> str:
    return word("status", STATUS_WORDS, status)


def _value(each: EntryEvidence) -> str:
    return _plain(each.value) if each.value is not None else ""


def _plain(value: float) -> str:
    return fixed(value, 3).rstrip("0").rstrip(".")


def _row(each: EntryEvidence) -> list[str]:
    unit = f" {each.unit}" if each.unit else ""
    return [
        each.entry,
        _value(each) + unit,
        f"{MARKS[each.status]} {_status(each.status)}",
        _interval(each) if each.interval and each.status != "gauge" else "–",
        tr("no bound") if each.status == "consistent" else _off(each.off.mm, each.off.deg) if each.off.moves else "–",
        joined(each.by, ", ") or "–",
        joined([_reading(reading) for reading in each.alternatives[:SHOWN_READINGS]]) or "–",
    ]


def _interval(each: EntryEvidence) -> str:
    if each.interval is None:
        return "–"
    low, high = (fixed(value, 2).rstrip("0").rstrip(".") for value in each.interval)
    if each.entry.startswith("direction"):
        return tr("{low} or {high}", low=low, high=high) if low != high else low
    if each.status in ("consistent", "open"):
        return tr("anything")
    return tr("{low} to {high} {unit}", low=low, high=high, unit=each.unit)


def _off(mm: float, deg: float) -> str:
    return tr("{mm} mm, {deg} deg", mm=fixed(mm, 0 if mm >= 10 else 1), deg=fixed(deg, 0 if deg >= 10 else 1))


def _reading(reading: OtherReading) -> str:
    changes = joined([f"{name} = {_plain(value)}" for name, value in reading.entries], ", ")
    if not reading.off.moves:
        return tr("{changes}: the same robot", changes=changes)
    if reading.excluded_by:
        return tr("{changes}: excluded by {documents}", changes=changes, documents=", ".join(reading.excluded_by))
    return tr("{changes}: allowed", changes=changes)
