"""Evidence, entry by entry: values that independent documents settle, allow or exclude."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from er3a.identifiability.alternatives import (
    Alternative,
    alternatives_to,
    flips_of,
    gauge_flips,
    open_table,
    with_readings,
)
from er3a.identifiability.continuous import Extent, Extents, turned_once
from er3a.identifiability.entries import (
    GROUP_OF,
    Gauge,
    TableNumber,
    column_of,
    continuous_of,
    document_of,
    entries_of,
    gauge_of,
    shifted,
)
from er3a.identifiability.entry_evidence import EntryEvidence, Evidence, OtherReading, OtherTable, Status, Tolerance
from er3a.identifiability.feasible import MET
from er3a.identifiability.reactions import reactions
from er3a.identifiability.requirements import Asked, Requirement, requirements_of
from er3a.identifiability.statements import NOT_OFF, ToolOff, ToolRange
from er3a.kinematics.table_batch import Tables, robot_of, tables_of
from er3a.numerics.arrays import Flags
from er3a.references.quantities import Limit, LimitExcess, Speed, value_at
from er3a.references.reference import Documents, Reference, conflicts
from er3a.robots.robot import Robot

LimitStatus = Literal["settled", "weak", "contradicted", "consistent", "open"]
OUTRIGHT_OR_NOT: tuple[Status, ...] = ("settled", "settled_up_to_signs")
ROUNDING = 1e-9
OF_SIGNS = ("a", "alpha", "d", "beta", "offset", "direction")
WIDEST = 720.0
FIRST_STEP, HALVINGS = 0.05, 12


def judge_limit(
    robot: Robot, entry: TableNumber, independent: Sequence[Reference], reacts: bool
) -> tuple[LimitStatus, tuple[float, float]]:
    """Status of a limit or speed, and what independent references leave open for it, in its unit.

    Parameters
    ----------
    independent : references that react to it and rest on other documents than it does
    reacts : whether any reference reacts to it
    """
    value = entry.value(robot)
    direct = [r for r in independent if isinstance(r.quantity, Limit | Speed)]
    if direct:
        spans = [(float(r.expected or 0.0) - r.uncertainty, float(r.expected or 0.0) + r.uncertainty) for r in direct]
        agree = [low - ROUNDING <= value <= high + ROUNDING for low, high in spans]
        hull = min(low for low, _ in spans), max(high for _, high in spans)
        status: LimitStatus = "settled" if all(agree) else "weak" if any(agree) else "contradicted"
        return status, hull
    low, high = value - WIDEST, value + WIDEST
    if not independent:
        return ("consistent" if reacts else "open"), (low, high)
    low, high = _past_poses(entry, independent, low, high)
    if entry.column != "speed":
        low, high = _by_extremes(robot, entry, independent, low, high)
    inside = low - ROUNDING <= value <= high + ROUNDING
    return ("weak" if inside else "contradicted"), (low, high)


def _past_poses(entry: TableNumber, independent: Sequence[Reference], low: float, high: float) -> tuple[float, float]:
    """A limit lies beyond every pose at which a document shows the arm."""
    for reference in independent:
        if isinstance(reference.quantity, LimitExcess):
            angle = value_at(reference.quantity.pose, entry.joint)
            if entry.column == "upper":
                low = max(low, angle - reference.uncertainty)
            else:
                high = min(high, angle + reference.uncertainty)
    return low, high


def _by_extremes(
    robot: Robot, entry: TableNumber, independent: Sequence[Reference], low: float, high: float
) -> tuple[float, float]:
    """How far a limit may go before reach or extents are missed, the rest of the table as it is."""
    asked = Asked(robot, requirements_of(independent))
    if not asked.extreme:
        return low, high
    value = entry.value(robot)
    table = tables_of(robot)

    def met(amount: float) -> bool:
        changed = shifted(table, [entry], np.array([[amount / entry.in_unit]]))
        return bool(asked.violation(asked.off(changed, afresh=True)).max() <= ROUNDING)

    if not met(0.0):
        return low, high
    return value + max(-_reach(lambda x: met(-x), value - low), low - value), value + _reach(met, high - value)


def _reach(met: Callable[[float], bool], most: float) -> float:
    """How far one can go before requirements are missed, by doubling and halving steps."""
    inside, step = 0.0, FIRST_STEP
    while step < most and met(step):
        inside, step = step, 2 * step
    if step >= most:
        return most
    outside = step
    for _ in range(HALVINGS):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if met(middle) else (inside, middle)
    return inside


SHOWN_STEP = 5.0


def evidence_of(
    robot: Robot,
    references: Sequence[Reference],
    documents: Documents,
    tolerance: Tolerance | None = None,
    only: Sequence[str] | None = None,
) -> Evidence:
    """What independent references settle of a robot's table.

    Parameters
    ----------
    references : of all sets together; official, measured, CAD and export ones count, if there are any, else claims do
    tolerance : how far the tool may be off for what counts as settled
    only : names of the requested entries; all by default

    Returns
    -------
    evidence : the same for the same input
    """
    return _Judge(robot, references, documents, tolerance or Tolerance()).evidence(only)


class _Judge:
    """Evidence in the making: what is independent of an entry depends on its document only, so work is done once for
    each set of references that is independent of some."""

    def __init__(self, robot: Robot, references: Sequence[Reference], documents: Documents, tolerance: Tolerance):
        self.robot, self.documents, self.tolerance = robot, documents, tolerance
        self.references = [reference for reference in references if reference.expected is not None]
        self.table, self.entries = tables_of(robot), entries_of(robot)
        self.free = continuous_of(robot)
        self.reacts = reactions(robot, self.references, self.entries)
        self.tool = ToolRange(robot, self.table)
        self.gauge: Gauge = gauge_of(robot, self.free)
        trusted = [i for i, reference in enumerate(self.references) if reference.is_authoritative]
        self.trusted = tuple(trusted or range(len(self.references)))
        self._asked: dict[tuple[int, ...], Asked] = {}
        self._alternatives: dict[tuple[int, ...], list[Alternative]] = {}
        self._readings: dict[Alternative, OtherReading] = {}
        self._repairs: dict[tuple[int, ...], list[Alternative]] = {}
        self._extents: dict[tuple[int, ...], Extents] = {}
        self._found: list[Tables] = []
        flips = flips_of(robot, [])
        self.same = gauge_flips(self.tool, flips)
        self.values = {entry.name: entry.value(robot) for entry in self.entries}
        self.conflicts = conflicts(self.references)

    def evidence(self, only: Sequence[str] | None = None) -> Evidence:
        """All of it, or about some entries."""
        judged = [self._judged(entry) for entry in self.entries if only is None or entry.name in only]
        sums = [self._combination(i) for i in range(len(self.gauge.determined)) if self._wanted_sum(i, only)]
        return Evidence(
            robot=self.robot,
            tolerance=self.tolerance,
            entries=(*judged, *self._given()),
            combinations=tuple(sums),
            conflicts=tuple((self.references[i], self.references[j]) for i, j in self.conflicts),
            readings=self._all_readings(),
            allowed=tuple(self._alternatives_of(self.trusted)),
            unmet=self._unmet(),
            table_meets=all(each.table_meets for each in self._extents.values()),
            other=self._other(),
        )

    def _other(self) -> OtherTable | None:
        extents, asked = self._extents_of(self.trusted), self._asked_of(self._geometric(self.trusted))
        if not extents.table_meets:
            return OtherTable(extents.met_by, "described") if extents.met else None
        table, taken = self.table, list[Alternative]()
        for each in self._alternatives_of(self.trusted):
            changed = with_readings(table, self.robot, [each])
            apart = not {name for other in taken for name in other.names} & set(each.names)
            if apart and (not len(asked) or asked.violation(asked.off(changed, afresh=True)).max() <= MET):
                table, taken = changed, [*taken, each]
        return OtherTable(table, "allowed") if taken else None

    def _unmet(self) -> tuple[str, ...]:
        without = [own for own, each in self._extents.items() if not each.met]
        return tuple(sorted({name for own in without for name in self._documents(own)}))

    def _wanted_sum(self, row: int, only: Sequence[str] | None) -> bool:
        return only is None or _sum_of(self._factors(row)) in only

    def _factors(self, row: int) -> list[tuple[TableNumber, float]]:
        return [(entry, float(f)) for entry, f in zip(self.free, self.gauge.determined[row]) if f]

    def _all_readings(self) -> tuple[Alternative, ...]:
        found = {each.entries: each for own in self._alternatives.values() for each in own}
        return tuple(found.values())

    def _judged(self, entry: TableNumber) -> EntryEvidence:
        if entry.column in ("lower", "upper", "speed"):
            return self._bound(entry)
        if entry.column == "direction":
            return self._direction(entry)
        return self._number(entry)

    def _independent(self, document: str) -> tuple[int, ...]:
        """Trusted references of documents that are independent of one; of those that contradict another which the table
        meets, only beside that other."""
        own = {i for i in self.trusted if self.documents.independent(self.references[i].document, document)}
        return tuple(sorted(i for i in own if self._outvoted.get(i, own) & own))

    @cached_property
    def _outvoted(self) -> dict[int, set[int]]:
        """References that the table misses, with those that it meets and that contradict them."""
        asked = Asked(self.robot, [each for pair in self.conflicts for i in pair for each in self._alone(i)])
        if not len(asked):
            return {}
        missed = asked.violation(asked.off(self.table, afresh=True)) > ROUNDING
        by_place = {each.references[0]: bool(own) for each, own in zip(asked.order, missed)}
        found: dict[int, set[int]] = {}
        for pair in self.conflicts:
            for i, j in (pair, pair[::-1]):
                if by_place.get(i) and not by_place[j]:
                    found.setdefault(i, set()).add(j)
        return found

    def _alone(self, i: int) -> list[Requirement]:
        return [replace(asked, references=(i,)) for asked in requirements_of([self.references[i]])]

    def _relevant_references(self, entry: TableNumber, among: Sequence[int]) -> tuple[int, ...]:
        row: Flags = self.reacts[:, self.entries.index(entry)]
        return tuple(i for i in among if row[i])

    def _documents(self, places: Sequence[int]) -> tuple[str, ...]:
        return tuple(dict.fromkeys(self.references[i].document for i in places))

    def _number(self, entry: TableNumber) -> EntryEvidence:
        document = document_of(self.robot, entry)
        own = self._independent(document)
        relevant = self._relevant_references(entry, own)
        extents = self._extents_of(own)
        gauge = self.free.index(entry) in self._in_gauge
        extent = extents.free_choice(entry) if gauge else extents.of(entry)
        concerned = [each for each in self._alternatives_of(own) if entry.name in each.names]
        by_all = self._names_open(self.trusted)
        status: Status = "weak"
        if gauge:
            status = "gauge"
        elif extent.excluded or entry.name in self._repaired(own):
            status = "contradicted"
        elif not relevant:
            consistent = self._relevant_references(entry, range(len(self.references)))
            status = "consistent" if consistent and entry.name not in by_all else "open"
            status = "contradicted" if consistent and self._excluded_by_all(entry) else status
        elif entry.name in by_all:
            status = "open"
        elif not concerned and extents.met and self._small(extent):
            status = self._settled(own, [entry.name])
        return self._described(entry, status, extent, concerned, relevant)

    def _direction(self, entry: TableNumber) -> EntryEvidence:
        own = self._independent(document_of(self.robot, entry))
        relevant = self._relevant_references(entry, own)
        concerned = [each for each in self._alternatives_of(own) if entry.name in each.names]
        value = self.values[entry.name]
        interval = (-1.0, 1.0) if concerned else (value, value)
        extents = self._extents_of(own)
        reversed_ = extents.met_by.direction[0, entry.joint - 1] != value
        if entry.name in self._repaired(own) or (reversed_ and extents.met and not concerned):
            status: Status = "contradicted"
            interval = (-value, -value)
        elif concerned:
            if entry.name in self._names_open(self.trusted):
                status = "open"
            else:
                status = "weak" if relevant else "contradicted" if self._excluded_by_all(entry) else "consistent"
        else:
            doubtful = bool(own) and extents.met and extents.may_reverse(entry.joint)
            interval = (-1.0, 1.0) if doubtful else interval
            status = "weak" if relevant or doubtful else "open"
            if own and extents.met and not doubtful:
                status = self._settled(own, [entry.name])
        off = _worst([each.off for each in concerned])
        if status in OUTRIGHT_OR_NOT and not relevant:
            relevant = self._relevant_at(extents.met_by, entry, own)
        return self._described(entry, status, Extent(*interval, off, False), concerned, relevant)

    def _relevant_at(self, table: Tables, entry: TableNumber, among: Sequence[int]) -> tuple[int, ...]:
        """References that react to an entry of another table (a batch of one), as they may not do at the robot's."""
        references = [self.references[i] for i in among]
        reacts = reactions(robot_of(table, 0, self.robot), references, [entry])[:, 0]
        return tuple(i for i, own in zip(among, reacts) if own)

    def _excluded_by_all(self, entry: TableNumber) -> bool:
        """Whether what an entry rests on itself excludes it: then it was not even taken over rightly."""
        if entry.name in self._repaired(self.trusted):
            return True
        extents = self._extents_of(self.trusted)
        return entry.column != "direction" and not extents.table_meets and extents.of(entry).excluded

    def _bound(self, entry: TableNumber) -> EntryEvidence:
        own = self._independent(document_of(self.robot, entry))
        relevant = self._relevant_references(entry, own)
        all_relevant = self._relevant_references(entry, range(len(self.references)))
        status, interval = judge_limit(self.robot, entry, [self.references[i] for i in relevant], bool(all_relevant))
        trusted = [self.references[i] for i in all_relevant if i in self.trusted]
        if status == "consistent" and trusted and judge_limit(self.robot, entry, trusted, True)[0] == "contradicted":
            status = "contradicted"
        return EntryEvidence(
            entry=entry.name,
            value=self.values[entry.name],
            unit=entry.unit,
            status=status,
            interval=interval,
            by=self._documents(relevant or all_relevant),
            alternatives=(),
            document=document_of(self.robot, entry),
        )

    def _described(
        self, entry: TableNumber, status: Status, extent: Extent, concerned: list[Alternative], relevant: Sequence[int]
    ) -> EntryEvidence:
        readings = [self._reading(each) for each in concerned]
        readings += [
            OtherReading(tuple((name, self._flipped(name)) for name in names), NOT_OFF)
            for names in self.same
            if entry.name in names
        ]
        readings += [self._shift(k) for k in range(len(self.gauge.directions)) if self._shifts(k, entry)]
        known = relevant or self._relevant_references(entry, range(len(self.references)))
        off = _worst([extent.off, *(each.off for each in concerned)])
        return EntryEvidence(
            entry=entry.name,
            value=self.values[entry.name],
            unit=entry.unit,
            status=status,
            interval=extent.interval,
            by=self._documents(known),
            alternatives=tuple(readings),
            document=document_of(self.robot, entry),
            off=NOT_OFF if status in (*OUTRIGHT_OR_NOT, "gauge") else off,
            at_least=extent.at_least and status == "weak",
        )

    def _settled(self, own: tuple[int, ...], names: Sequence[str]) -> Status:
        """Settled; but only up to signs where evidence allows another arm, for it can be written otherwise here."""
        return "settled_up_to_signs" if self._alternatives_of(own) and self._rewritten & set(names) else "settled"

    @cached_property
    def _rewritten(self) -> set[str]:
        """Entries that have another sign or half turn in other rows of the same robot."""
        every, found = turned_once(self.table), set[str]()
        for entry in self.entries:
            if entry.column in OF_SIGNS:
                values = getattr(every, entry.column)[:, entry.joint - 1]
                off = values - values[0]
                off = (off + np.pi) % (2 * np.pi) - np.pi if entry.unit == "deg" else off
                if np.abs(off).max() > ROUNDING:
                    found.add(entry.name)
        return found

    def _small(self, extent: Extent) -> bool:
        """Whether what is left open moves the tool by less than the tolerance, as far as a finished search can tell."""
        return not extent.at_least and extent.off.within(self.tolerance.mm, self.tolerance.deg)

    def _combination(self, row: int) -> EntryEvidence:
        """What of entries that are gauge is determined together."""
        factors = self._factors(row)
        first = factors[0][0]
        document = document_of(self.robot, first)
        own = self._independent(document)
        extents = self._extents_of(own)
        extent = extents.along(self.gauge.determined[row])
        relevant = sorted({i for entry, _ in factors for i in self._relevant_references(entry, own)})
        everyone = sorted(
            {i for entry, _ in factors for i in self._relevant_references(entry, range(len(self.references)))}
        )
        status: Status = "weak"
        if extent.excluded:
            status = "contradicted"
        elif not relevant:
            status = "consistent" if everyone else "open"
        elif extents.met and self._small(extent):
            status = self._settled(own, [entry.name for entry, _ in factors])
        return EntryEvidence(
            entry=_sum_of(factors),
            value=sum(f * self.values[entry.name] for entry, f in factors),
            unit=first.unit,
            status=status,
            interval=extent.interval,
            by=self._documents(relevant or everyone),
            alternatives=(),
            document=document,
            off=NOT_OFF if status in OUTRIGHT_OR_NOT else extent.off,
            at_least=extent.at_least and status == "weak",
        )

    def _given(self) -> list[EntryEvidence]:
        found = []
        for name in ("base", *(() if self.robot.flange_is_last_frame else ("flange",)), "tool"):
            source = self.robot.sources.get(name)
            document = (source.origin or source.source) if source else ""
            found.append(EntryEvidence(name, None, "", "given", None, (), (), document))
        return found

    def _reading(self, alternative: Alternative) -> OtherReading:
        if alternative not in self._readings:
            violated = self._asked_of(tuple(range(len(self.references)))).excluding(alternative.table, self.table)
            reading = OtherReading(alternative.entries, alternative.off, self._documents(violated))
            self._readings[alternative] = reading
        return self._readings[alternative]

    def _flipped(self, name: str) -> float:
        value = self.values.get(name, 0.0)
        if column_of(name) in ("offset", "alpha"):
            return value + 180.0 if value <= 0 else value - 180.0
        return -value

    def _shifts(self, k: int, entry: TableNumber) -> bool:
        return entry in self.free and bool(self.gauge.directions[k][self.free.index(entry)])

    def _shift(self, k: int) -> OtherReading:
        """A combination that moves no tool, with a step of 5 units for its first entry."""
        own = [(entry, f) for entry, f in zip(self.free, self.gauge.directions[k]) if f]
        entry, f = own[0]
        step = SHOWN_STEP / (f * entry.scale * entry.in_unit)
        return OtherReading(
            tuple((e.name, self.values[e.name] + step * g * e.scale * e.in_unit) for e, g in own), NOT_OFF
        )

    @cached_property
    def _in_gauge(self) -> set[int]:
        return {k for k, held in enumerate(self.gauge.support()) if held}

    def _asked_of(self, own: tuple[int, ...]) -> Asked:
        if own not in self._asked:
            requirements = requirements_of([self.references[i] for i in own])
            placed = [replace(each, references=tuple(own[i] for i in each.references)) for each in requirements]
            self._asked[own] = Asked(self.robot, placed)
        return self._asked[own]

    def _geometric(self, own: tuple[int, ...]) -> tuple[int, ...]:
        """Those of the references that ask for something of the tool's place."""
        return tuple(i for each in self._asked_of(own).requirements for i in each.references)

    def _alternatives_of(self, own: tuple[int, ...]) -> list[Alternative]:
        """What else evidence allows: alternatives to the table, or to one near it that meets the evidence."""
        own = self._geometric(own)
        if own not in self._alternatives:
            extents = self._extents_of(own)
            tool = self.tool if extents.table_meets else ToolRange(self.robot, extents.met_by)
            self._alternatives[own] = alternatives_to(extents.met_by, self._asked_of(own), tool)
        return self._alternatives[own]

    def _repairs_of(self, own: tuple[int, ...]) -> list[Alternative]:
        """Discrete changes by which a table that misses evidence misses less of it."""
        own = self._geometric(own)
        if own not in self._repairs:
            asked = self._asked_of(own)
            missed = len(asked) and asked.violation(asked.off(self.table, afresh=True)).max() > MET
            found = alternatives_to(self.table, asked, self.tool) if missed else []
            self._repairs[own] = [each for each in found if each.repairs]
        return self._repairs[own]

    def _names_open(self, own: tuple[int, ...]) -> set[str]:
        return {name for each in self._alternatives_of(own) for name in each.names}

    def _repaired(self, own: tuple[int, ...]) -> set[str]:
        """Entries that a discrete change sets right: those in every smallest change that repairs most."""
        repairing = self._repairs_of(own)
        if not repairing:
            return set()
        fewest = min(len(each.entries) for each in repairing)
        return set.intersection(*(set(each.names) for each in repairing if len(each.entries) == fewest))

    def _extents_of(self, own: tuple[int, ...]) -> Extents:
        own = self._geometric(own)
        if own not in self._extents:
            fewest = min(self._repairs_of(own), key=lambda each: len(each.entries), default=None)
            table = fewest.table if fewest else self.table
            relevant = [k for k, entry in enumerate(self.free) if self._relevant_references(entry, own)]
            asked = self._asked_of(own)
            near = Extents(asked, table, self.free, relevant, self.gauge, self.tool, tolerance=self.tolerance)
            self._extents[own] = near if near.met else self._far(asked, near)
        return self._extents[own]

    def _far(self, asked: Asked, near: Extents) -> Extents:
        """What evidence leaves open far from the table, where nothing near it will do; ``near`` if there is nothing."""
        known = [each for each in self._found if asked.violation(asked.off(each, afresh=True)).max() <= MET]
        found = known[0] if known else open_table(asked, self.table, near.region.entries, near.held)
        if found is None:
            return near
        self._found.append(found)
        joints = list(range(found.direction.shape[1]))
        table = self.table.with_column("direction", joints, found.direction)
        return Extents(
            asked, table, self.free, near.relevant, self.gauge, self.tool, found=found, tolerance=self.tolerance
        )


def _sum_of(factors: Sequence[tuple[TableNumber, float]]) -> str:
    text = ""
    for entry, factor in factors:
        sign = ("-" if factor < 0 else "") if not text else (" - " if factor < 0 else " + ")
        size = "" if abs(abs(factor) - 1) < 1e-9 else f"{abs(factor):.3g} "
        text += f"{sign}{size}{entry.name}"
    return text


def _worst(found: Sequence[ToolOff]) -> ToolOff:
    worst = NOT_OFF
    for each in found:
        worst = worst.worse(each)
    return worst


PartName = Literal["geometry", "zero_and_directions", "limits", "speeds"]
PartStatus = Literal["settled", "settled_up_to_signs", "consistent", "weak", "open", "contradicted", "absent"]
PART_OF_GROUP: dict[str, PartName] = {
    "dh": "geometry",
    "zero": "zero_and_directions",
    "limits": "limits",
    "speeds": "speeds",
}
GRAVEST: tuple[PartStatus, ...] = ("contradicted", "open", "weak", "consistent", "settled_up_to_signs", "settled")
SETTLED: tuple[Status, ...] = (*OUTRIGHT_OR_NOT, "gauge", "given")
MAX_COMBINED = 256


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
        held = {each.status for each in own}
        best: PartStatus = "settled" if own else "absent"
        status: PartStatus = next((each for each in GRAVEST if each in held), best)
        off = NOT_OFF
        for each in unsettled:
            off = off.worse(each.off)
        if part == "zero_and_directions" and unsettled:
            off = off.worse(together(evidence, [each.entry for each in unsettled]))
        found.append(PartEvidence(status, unsettled, off, part))
    return tuple(found)


def together(evidence: Evidence, names: list[str]) -> ToolOff:
    """How far the tool is off at most if any of the discrete readings of these entries hold together."""
    readings = [each for each in evidence.readings if set(each.names) <= set(names)]
    tool = ToolRange(evidence.robot, tables_of(evidence.robot))
    combined: list[tuple[Alternative, ...]] = [()]
    for each in readings:
        free = [own for own in combined if not {n for other in own for n in other.names} & set(each.names)]
        combined += [(*own, each) for own in free][: MAX_COMBINED - len(combined)]
    off = NOT_OFF
    for own in combined[1:]:
        off = off.worse(tool.off(with_readings(tool.table, evidence.robot, own)))
    return off


def _part(each: EntryEvidence, columns: dict[str, PartName]) -> PartName | None:
    return columns.get(each.entry) or columns.get(each.entry.split()[0].lstrip("-"))
