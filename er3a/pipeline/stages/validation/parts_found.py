"""The parts of the verdict, as the stage's results hold them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

from er3a.identifiability.entries import GROUP_OF
from er3a.identifiability.entry_evidence import EntryEvidence, Evidence, Status
from er3a.identifiability.tool_motion import NOT_OFF, ToolOff
from er3a.identifiability.verdict_parts import PART_OF_GROUP, PartName, PartStatus, parts_of, together
from er3a.pipeline.stages.validation.validation_findings import PartFound

OF_THE_TOOL: tuple[PartName, ...] = ("geometry", "zero_and_directions")


def parts_found(evidence: Evidence) -> tuple[PartFound, ...]:
    """The parts of a table that its file gives."""
    statuses = {part.code: part.status for part in parts_of(evidence)}
    by_part: dict[PartName, list[EntryEvidence]] = {part: [] for part in PART_OF_GROUP.values()}
    parts_by_column = {column: PART_OF_GROUP[group] for column, group in GROUP_OF.items()}
    for each in (*evidence.entries, *evidence.combinations):
        column = each.entry.split()[0].lstrip("-").rstrip("0123456789")
        for known, part in parts_by_column.items():
            if known == column:
                by_part[part].append(each)
    return tuple(_part(evidence, part, statuses[part], own) for part, own in by_part.items() if own)


def _part(evidence: Evidence, part: PartName, status: PartStatus, own: Sequence[EntryEvidence]) -> PartFound:
    def named(wanted: Status) -> tuple[str, ...]:
        return tuple(each.entry for each in own if each.status == wanted)

    off = reduce(ToolOff.worse, (each.off for each in own if each.status in ("weak", "open")), NOT_OFF)
    if part == "zero_and_directions" and named("open"):
        off = off.worse(together(evidence, list(named("open"))))
    return PartFound(
        part=part,
        status=status,
        entries=sum(each.status != "gauge" for each in own),
        settled=len(named("settled")),
        contradicted=named("contradicted"),
        open=named("open"),
        off=off,
    )
