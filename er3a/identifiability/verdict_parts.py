"""What a verdict consists of: geometry, zero and directions, limits, speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from er3a.identifiability.alternatives import Alternative, with_readings
from er3a.identifiability.entries import GROUP_OF, entries_of
from er3a.identifiability.entry_evidence import EntryEvidence, Evidence, Status
from er3a.identifiability.tool_motion import NOT_OFF, ToolOff, ToolRange
from er3a.kinematics.table_batch import tables_of

PartName = Literal["geometry", "zero_and_directions", "limits", "speeds"]
PartStatus = Literal["settled", "consistent", "weak", "open", "contradicted", "absent"]
PART_OF_GROUP: dict[str, PartName] = {
    "dh": "geometry",
    "zero": "zero_and_directions",
    "limits": "limits",
    "speeds": "speeds",
}
GRAVEST: tuple[PartStatus, ...] = ("contradicted", "open", "weak", "consistent", "settled")
SETTLED: tuple[Status, ...] = ("settled", "gauge", "given")
MOST_COMBINED = 256


@dataclass(frozen=True)
class PartEvidence:
    """A part of the verdict.

    Attributes
    ----------
    status : the gravest of its entries'; absent where the robot's file gives none of them
    unsettled : its entries that aren't settled
    off : how far the tool could be off for any one of them, or for all discrete ones together
    code : the part's name
    """

    status: PartStatus
    unsettled: tuple[EntryEvidence, ...]
    off: ToolOff
    code: PartName


def parts_of(evidence: Evidence) -> tuple[PartEvidence, ...]:
    """The parts of the verdict."""
    columns = {entry.name: PART_OF_GROUP[GROUP_OF[entry.column]] for entry in entries_of(evidence.robot)}
    found = []
    for part in PART_OF_GROUP.values():
        own = [each for each in (*evidence.entries, *evidence.combinations) if _part(each, columns) == part]
        unsettled = tuple(each for each in own if each.status not in SETTLED)
        held = {each.status for each in unsettled}
        best: PartStatus = "settled" if own else "absent"
        status: PartStatus = next((each for each in GRAVEST if each in held), best)
        off = NOT_OFF
        for each in unsettled:
            off = off.worse(each.off)
        if part == "zero_and_directions" and unsettled:
            off = off.worse(together(evidence, [each.entry for each in unsettled]))
        found.append(PartEvidence(status, unsettled, off, part))
    return tuple(found)


def settles_tool(evidence: Evidence) -> bool:
    """Whether everything that moves the tool is settled."""
    found = (*evidence.entries, *evidence.combinations)
    return evidence.table_meets and all(each.status in SETTLED for each in found if each.moves_tool)


def together(evidence: Evidence, names: list[str]) -> ToolOff:
    """How far the tool is off at most if any of the discrete readings of these entries hold together."""
    readings = [each for each in evidence.readings if set(each.names) <= set(names)]
    tool = ToolRange(evidence.robot, tables_of(evidence.robot))
    combined: list[tuple[Alternative, ...]] = [()]
    for each in readings:
        free = [own for own in combined if not {n for other in own for n in other.names} & set(each.names)]
        combined += [(*own, each) for own in free][: MOST_COMBINED - len(combined)]
    off = NOT_OFF
    for own in combined[1:]:
        off = off.worse(tool.off(with_readings(tool.table, evidence.robot, own)))
    return off


def _part(each: EntryEvidence, columns: dict[str, PartName]) -> PartName | None:
    return columns.get(each.entry) or columns.get(each.entry.split()[0].lstrip("-"))
