"""The result types: evidence of a table, entry by entry."""

from __future__ import annotations

from functools import cached_property
from typing import Literal, get_args

from er3a.by_value import ByValue, Displayed, Sheet, frozen, shortly
from er3a.comparison.entries import EntryUnit
from er3a.identifiability.alternatives import Alternative
from er3a.identifiability.entries import column_of
from er3a.identifiability.statements import NOT_OFF, ToolOff
from er3a.kinematics.table_batch import Tables
from er3a.references.reference import Reference
from er3a.robots.robot import Robot

Status = Literal["contradicted", "open", "weak", "consistent", "gauge", "given", "settled_up_to_signs", "settled"]
"""The gravest first. ``settled_up_to_signs``: every arm that evidence allows can be written with this value; but one of
them moves otherwise than the table's, and can be written with another sign or half turn here as well."""
TOLERANCE_MM, TOLERANCE_DEG = 5.0, 0.5
"""How far a settled entry may leave the tool off: what an arm of this size is off without calibration. What matters
less is the business of a calibration and says nothing about the table."""


NAMED = 6  # entries of a status in a line of a sheet


@frozen
class Tolerance:
    """How far the tool may be off for an entry that counts as settled, anywhere in the joint ranges."""

    mm: float = TOLERANCE_MM
    deg: float = TOLERANCE_DEG


@frozen
class OtherReading:
    """A table that differs in a few entries, and that evidence allows.

    Attributes
    ----------
    entries : those that differ, with their values there in their units
    off : how far the tool is off then; not at all, where it is the same robot
    excluded_by : documents that exclude it, though not independent ones
    """

    entries: tuple[tuple[str, float], ...]
    off: ToolOff
    excluded_by: tuple[str, ...] = ()


@frozen
class EntryEvidence:
    """What is known of an entry.

    Attributes
    ----------
    entry : such as ``d4``; of a combination that alone is determined, such as ``d2 + d3``
    value, unit : in the robot's file
    status : see :data:`Status`
    interval : what independent evidence leaves open for it, the others free; None for what has no number
    by : documents that concern it: independent ones if there are any, else its own
    alternatives : other readings of the table that concern it, and combinations with it that are the same robot
    document : that it rests on
    off : how far the tool could be off for it
    at_least : whether interval and off are what was found, and more may be left open
    """

    entry: str
    value: float | None
    unit: EntryUnit
    status: Status
    interval: tuple[float, float] | None
    by: tuple[str, ...]
    alternatives: tuple[OtherReading, ...]
    document: str
    off: ToolOff = NOT_OFF
    at_least: bool = False

    @property
    def moves_tool(self) -> bool:
        """Whether it is one of those that say where the tool is."""
        return column_of(self.entry) not in ("lower", "upper", "speed")

    @property
    def trust(self) -> Status:
        """The status to act on. A direction that one document settles is to be seen on the arm first: a sign is right
        or wrong as a whole, and one jog shows which."""
        one_sign = column_of(self.entry) == "direction" and self.status in ("settled", "settled_up_to_signs")
        return "consistent" if one_sign and len(self.by) < 2 else self.status


@frozen
class OtherTable(ByValue):
    """Another table (a batch of one): the one that evidence describes where it excludes the robot's, or one that it
    can't tell from the robot's, with all that is open at once."""

    table: Tables
    code: Literal["described", "allowed"]


@frozen
class Evidence(ByValue, Displayed):
    """What references say about a table.

    Attributes
    ----------
    entries : of the table, base and tool
    combinations : what of entries that are gauge is determined together
    conflicts : pairs of references that contradict each other
    readings : tables that independent evidence of some entry allows, see :class:`Alternative`
    allowed : those that all trusted references allow
    unmet : documents without any table near this one that meets all that they say
    table_meets : whether the table as it is meets all independent references
    other : None where no other table was found
    """

    robot: Robot
    tolerance: Tolerance
    entries: tuple[EntryEvidence, ...]
    combinations: tuple[EntryEvidence, ...]
    conflicts: tuple[tuple[Reference, Reference], ...]
    readings: tuple[Alternative, ...]
    allowed: tuple[Alternative, ...]
    unmet: tuple[str, ...]
    table_meets: bool
    other: OtherTable | None

    def __getitem__(self, entry: str) -> EntryEvidence:
        return self._by_name[entry]

    @cached_property
    def _by_name(self) -> dict[str, EntryEvidence]:
        return {each.entry: each for each in (*self.entries, *self.combinations)}

    def sheet(self) -> Sheet:
        """What the notebook shows: how many entries have each status, and which; the most important first.

        Returns
        -------
        sheet : with the tolerance in mm and deg
        """
        judged = (*self.entries, *self.combinations)
        names = {status: [each.entry for each in judged if each.status == status] for status in get_args(Status)}
        kept = {"other_table": self.other.code if self.other else None, "unmet": self.unmet or None}
        return Sheet(
            f"Evidence of {self.robot.name}: {len(judged)} entries, "
            f"tolerance {shortly(self.tolerance.mm)} mm, {shortly(self.tolerance.deg)} deg",
            ("status", "count", "entries"),
            tuple((status, str(len(found)), shortly(found[:NAMED])) for status, found in names.items() if found),
            facts=(
                f"table_meets: {shortly(self.table_meets)}; conflicts: {len(self.conflicts)}; "
                f"readings: {len(self.readings)}, allowed: {len(self.allowed)}",
                *(f"{key}: {shortly(value)}" for key, value in kept.items() if value),
            ),
        )
