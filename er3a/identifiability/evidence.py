"""Evidence, entry by entry: values that independent documents settle, allow or exclude."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property, reduce
from itertools import chain
from typing import Literal

import numpy as np

from er3a.comparison.entries import Entry, shifted, wrapped_between
from er3a.diagnosis.defined_otherwise import described_by
from er3a.diagnosis.ranking import usable
from er3a.identifiability.alternatives import Alternative, alternatives_to, as_written, with_readings
from er3a.identifiability.continuous import Extent, Extents, same_robots
from er3a.identifiability.entries import continuous_of, document_of, entries_of, gauge_of
from er3a.identifiability.entry_evidence import EntryEvidence, Evidence, OtherReading, OtherTable, Status, Tolerance
from er3a.identifiability.feasible import MET
from er3a.identifiability.reactions import reactions
from er3a.identifiability.requirements import Asked, requirements_of
from er3a.identifiability.statements import NOT_OFF, ToolOff, ToolRange
from er3a.kinematics.table_batch import Tables, robot_of, tables_of
from er3a.numerics.arrays import Flags, Reals
from er3a.references.quantities import LimitExcess, OfJoint, value_at
from er3a.references.reference import Documents, Reference, conflicts
from er3a.robots.robot import Robot

LimitStatus = Literal["settled", "weak", "contradicted", "consistent", "open"]
OUTRIGHT_OR_NOT: tuple[Status, ...] = ("settled", "settled_up_to_signs")
ROUNDING = 1e-9  # in an entry's unit
OF_SIGNS = ("direction", "offset", "alpha", "a", "d", "beta")
MAX_REWRITTEN = 3  # entries that differ in other rows of the same robot, for these to be listed
LIMITS = ("lower", "upper", "speed")
CORRECTED = 1e-6  # in an entry's unit, from which on a corrected value is another one
WIDEST = 720.0
FIRST_STEP, HALVINGS = 0.05, 12


def judge_limit(
    robot: Robot, entry: Entry, independent: Sequence[Reference], reacts: bool
) -> tuple[LimitStatus, tuple[float, float]]:
    """Status of a limit or speed, and what independent references leave open for it.

    Parameters
    ----------
    independent : references that react to it and rest on other documents than it does
    reacts : whether any reference reacts to it

    Returns
    -------
    status, interval : and lower and upper bound, in the entry's unit
    """
    value = entry.value(robot)
    direct = [r for r in independent if isinstance(r.quantity, OfJoint)]
    if direct:
        spans = [(float(r.expected or 0.0) - r.uncertainty, float(r.expected or 0.0) + r.uncertainty) for r in direct]
        agree = [low - ROUNDING <= value <= high + ROUNDING for low, high in spans]
        hull = min(low for low, _ in spans), max(high for _, high in spans)
        status: LimitStatus = "settled" if all(agree) else "weak" if any(agree) else "contradicted"
        return status, hull
    low, high = value - WIDEST, value + WIDEST
    if not independent:
        return ("consistent" if reacts else "open"), (low, high)
    for reference in independent:
        if isinstance(reference.quantity, LimitExcess):  # it lies beyond every pose at which a document shows the arm
            angle = value_at(reference.quantity.pose, entry.joint)
            if entry.column == "upper":
                low = max(low, angle - reference.uncertainty)
            else:
                high = min(high, angle + reference.uncertainty)
    if entry.column != "speed":
        low, high = _by_extremes(robot, entry, independent, low, high)
    inside = low - ROUNDING <= value <= high + ROUNDING
    return ("weak" if inside else "contradicted"), (low, high)


def _by_extremes(
    robot: Robot, entry: Entry, independent: Sequence[Reference], low: float, high: float
) -> tuple[float, float]:
    """How far a limit may go before reach or extents are missed, the rest of the table as it is."""
    asked = Asked(robot, requirements_of(independent))
    if not asked.extreme:
        return low, high
    value = entry.value(robot)
    table = tables_of(robot)

    def met(amount: float) -> bool:
        changed = shifted(table, [entry], np.array([[amount / entry.in_unit]]))
        return asked.missed_by(changed) <= ROUNDING

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
    corrected: Sequence[Robot] = (),
) -> Evidence:
    """What independent references settle of a robot's table.

    A table that misses them is judged from a corrected one that meets them, as diagnosis gives it, else as comparison
    with the arm whose axes they state does: entries that differ are contradicted, of all others it is asked what that
    arm leaves open. Where there is no such table, nothing is settled and no interval is known.

    Parameters
    ----------
    references : of all sets together; official, measured, CAD and export ones count, if there are any, else claims do
    tolerance : how far the tool may be off for what counts as settled
    only : names of the requested entries; all by default
    corrected : the robot without faults, in the ways that could be right, likeliest first

    Returns
    -------
    evidence : the same for the same input
    """
    judge = _Judge(robot, references, documents, tolerance or Tolerance())
    if judge.meets_trusted:
        return judge.evidence(only)
    for each in chain(corrected, _by_axes(judge)):
        other = _Judge(each, references, documents, judge.tolerance)
        if other.meets_trusted:
            return _of_stated(robot, each, other.evidence(only))
    return judge.evidence(only)


def _by_axes(judge: _Judge) -> Iterator[Robot]:
    """The table that the arm with the axes which references state has, led to what they ask, if there is any."""
    for each in described_by(judge.robot, usable(judge.references)):
        led = judge.view(judge.trusted).extents.led_to(tables_of(each))
        if led is not None:
            yield robot_of(led, 0, judge.robot)


def _of_stated(robot: Robot, corrected: Robot, found: Evidence) -> Evidence:
    """Evidence of a corrected table as evidence of the one that is stated."""
    by_name = {entry.name: entry for entry in entries_of(robot)}
    tool, values = ToolRange(corrected, tables_of(corrected)), dict[str, float]()
    for name, entry in by_name.items():
        own, right = entry.value(robot), entry.value(corrected)
        gap = own - right if entry.unit != "deg" or entry.column in LIMITS else (own - right + 180) % 360 - 180
        if abs(gap) > CORRECTED:
            values[name] = own

    def stated(each: EntryEvidence) -> EntryEvidence:
        if each.entry in ("base", "flange"):
            moved = not np.allclose(getattr(robot, each.entry), getattr(corrected, each.entry), atol=ROUNDING)
            return replace(each, status="contradicted") if moved else each
        if each.entry not in values:
            return each
        entry = by_name[each.entry]
        low, high = each.interval or (np.inf, -np.inf)
        if each.status in OUTRIGHT_OR_NOT and low <= values[each.entry] <= high:  # documents leave both open
            return replace(each, value=values[each.entry])
        if entry.column in LIMITS and not robot.states("limits"):
            return replace(each, value=values[each.entry], status="open")
        amount = np.array([[(values[each.entry] - entry.value(corrected)) / entry.in_unit]])
        off = tool.off(shifted(tool.table, [entry], amount)) if entry.column not in LIMITS else NOT_OFF
        return replace(each, value=values[each.entry], status="contradicted", alternatives=(), off=off)

    return replace(
        found,
        entries=tuple(stated(each) for each in found.entries),
        table_meets=False,
        other=OtherTable(tables_of(corrected), "described"),
    )


class _View:
    """What references that are independent of some document leave open of the table.

    Attributes
    ----------
    own : places of those that ask for something of the tool's place
    extents : intervals of all free entries; alternatives : discrete changes of a table that meets them
    """

    def __init__(self, judge: _Judge, asked: Asked, own: tuple[int, ...]):
        self.judge, self.asked, self.own = judge, asked, own

    @cached_property
    def extents(self) -> Extents:
        """Intervals of all free entries under these references."""
        judge = self.judge
        relevant = [k for k, entry in enumerate(judge.free) if judge.relevant(entry, self.own)]
        return Extents(
            self.asked, judge.table, judge.free, relevant, judge.gauge, judge.tool, tolerance=judge.tolerance
        )

    @cached_property
    def alternatives(self) -> list[Alternative]:
        """Discrete changes of the table that these references allow, too; none if they are missed."""
        return alternatives_to(self.judge.table, self.asked, self.judge.tool) if self.extents.met else []

    @property
    def open_names(self) -> set[str]:
        """Entries that some alternative changes."""
        return {name for each in self.alternatives for name in each.names}


class _Judge:
    """Evidence in the making: what is independent of an entry depends on its document only, so work is done once for
    each set of references that is independent of some."""

    def __init__(self, robot: Robot, references: Sequence[Reference], documents: Documents, tolerance: Tolerance):
        self.robot, self.documents, self.tolerance = robot, documents, tolerance
        self.references = [reference for reference in references if reference.expected is not None]
        self.table, self.entries, self.free = tables_of(robot), entries_of(robot), continuous_of(robot)
        self.turning = [each for column in OF_SIGNS for each in self.entries if each.column == column]
        self.reacts = reactions(robot, self.references, self.entries)
        self.tool, self.gauge = ToolRange(robot, self.table), gauge_of(robot, self.free)
        self.every = tuple(range(len(self.references)))
        self.trusted = tuple(i for i in self.every if self.references[i].is_authoritative) or self.every
        self.values = {entry.name: entry.value(robot) for entry in self.entries}
        self.conflicts = conflicts(self.references)
        self._views: dict[tuple[int, ...], _View] = {}
        self._readings: dict[Alternative, OtherReading] = {}

    @property
    def meets_trusted(self) -> bool:
        """Whether the table meets all that trusted references ask."""
        return self.view(self.trusted).asked.missed_by(self.table) <= MET

    def evidence(self, only: Sequence[str] | None = None) -> Evidence:
        """Evidence of all entries, or of some.

        Parameters
        ----------
        only : names of entries and combinations; None for all

        Returns
        -------
        evidence : values in the entries' units
        """
        judged = [self._judged(entry) for entry in self.entries if only is None or entry.name in only]
        sums = [self._number(row) for row in self.gauge.determined]
        trusted = self.view(self.trusted)
        views = list(dict.fromkeys(self._views.values()))
        unmet = {name for each in views if not each.extents.met for name in self._documents(each.own)}
        return Evidence(
            robot=self.robot,
            tolerance=self.tolerance,
            entries=(*judged, *self._given()),
            combinations=tuple(each for each in sums if only is None or each.entry in only),
            conflicts=tuple((self.references[i], self.references[j]) for i, j in self.conflicts),
            readings=tuple({each.entries: each for own in views for each in own.alternatives}.values()),
            allowed=tuple(trusted.alternatives),
            unmet=tuple(sorted(unmet)),
            table_meets=all(each.extents.met for each in views),
            other=self._other(trusted),
        )

    def _other(self, trusted: _View) -> OtherTable | None:
        table, taken = self.table, set[str]()
        for each in trusted.alternatives:
            changed = with_readings(table, self.robot, [each])
            if not taken & set(each.names) and trusted.asked.missed_by(changed) <= MET:
                table, taken = changed, taken | set(each.names)
        return OtherTable(table, "allowed") if taken else None

    def view(self, own: tuple[int, ...]) -> _View:
        """What references leave open; one view for all sets that ask for the same.

        Parameters
        ----------
        own : places of the references

        Returns
        -------
        view : kept for further calls
        """
        if own not in self._views:
            asked = Asked(self.robot, requirements_of([self.references[i] for i in own], own))
            asking = {i for each in asked.order for i in each.references}
            alike = next((each for each in self._views.values() if set(each.own) == asking), None)
            self._views[own] = alike or _View(self, asked, tuple(sorted(asking)))
        return self._views[own]

    def _judged(self, entry: Entry) -> EntryEvidence:
        if entry in self.free:
            return self._number(np.eye(len(self.free))[self.free.index(entry)])
        own = self._independent(document_of(self.robot, entry))
        relevant = self.relevant(entry, own)
        if entry.column in LIMITS:
            return self._bound(entry, relevant)
        return self._direction(entry, own, relevant, self.view(own))

    def _independent(self, document: str) -> tuple[int, ...]:
        """Trusted references of documents that are independent of one; of those that contradict another which the table
        meets, only beside that other."""
        own = {i for i in self.trusted if self.documents.independent(self.references[i].document, document)}
        return tuple(sorted(i for i in own if self._outvoted.get(i, own) & own))

    @cached_property
    def _outvoted(self) -> dict[int, set[int]]:
        """References that the table misses, with those that it meets and that contradict them."""
        alone = {i: requirements_of([self.references[i]]) for pair in self.conflicts for i in pair}
        missed = {i: Asked(self.robot, each).missed_by(self.table) > ROUNDING for i, each in alone.items() if each}
        found: dict[int, set[int]] = {}
        for pair in self.conflicts:
            for i, j in (pair, pair[::-1]):
                if missed.get(i) and not missed[j]:
                    found.setdefault(i, set()).add(j)
        return found

    def relevant(self, entry: Entry, among: Sequence[int]) -> tuple[int, ...]:
        """References that react to an entry.

        Parameters
        ----------
        entry : of the table
        among : places of the references that count

        Returns
        -------
        places : of those that do
        """
        row: Flags = self.reacts[:, self.entries.index(entry)]
        return tuple(i for i in among if row[i])

    def _documents(self, places: Sequence[int]) -> tuple[str, ...]:
        return tuple(dict.fromkeys(self.references[i].document for i in places))

    def _number(self, row: Reals) -> EntryEvidence:
        """Of an entry that can take any value, or of what is determined together of several that are gauge, by their
        factors (k,)."""
        factors = [(entry, float(f)) for entry, f in zip(self.free, row) if f]
        first, names, alone = factors[0][0], [entry.name for entry, _ in factors], len(factors) == 1
        own = self._independent(document_of(self.robot, first))
        view = self.view(own)
        gauge = alone and bool(self.gauge.support()[self.free.index(first)])
        extent = view.extents.along(row, moves_tool=not gauge)
        relevant, every = (
            sorted({i for entry, _ in factors for i in self.relevant(entry, among)}) for among in (own, self.every)
        )
        concerned = [each for each in view.alternatives if alone and first.name in each.names]
        open_anyway = alone and first.name in self.view(self.trusted).open_names
        status: Status = "weak"
        if gauge:
            status = "gauge"
        elif not relevant:
            status = "consistent" if every and not open_anyway else "open"
        elif open_anyway:
            status = "open"
        elif not concerned and view.extents.met and self._small(extent):
            status = self._settled(view, names)
        if alone:
            return self._described(first, status, extent, concerned, relevant)
        return replace(
            self._described(first, status, extent, [], relevant or every),
            entry=_sum_of(factors),
            value=sum(f * self.values[entry.name] for entry, f in factors),
            alternatives=(),
        )

    def _direction(self, entry: Entry, own: tuple[int, ...], relevant: tuple[int, ...], view: _View) -> EntryEvidence:
        concerned = [each for each in view.alternatives if entry.name in each.names]
        value, extents, trusted = self.values[entry.name], view.extents, self.view(self.trusted)
        doubtful = bool(own) and extents.met and (bool(concerned) or extents.may_reverse(entry.joint))
        status: Status = "weak" if relevant or doubtful else "open"
        if concerned and entry.name in trusted.open_names:
            status = "open"
        elif concerned and not relevant:
            status = "consistent"
        elif own and extents.met and not doubtful:
            status = self._settled(view, [entry.name])
        ends = (-1.0, 1.0) if doubtful or concerned else (value, value)
        off = reduce(ToolOff.worse, (each.off for each in concerned), NOT_OFF)
        return self._described(entry, status, Extent(*ends, off), concerned, relevant)

    def _bound(self, entry: Entry, relevant: tuple[int, ...]) -> EntryEvidence:
        every = self.relevant(entry, self.every)
        status, interval = judge_limit(self.robot, entry, [self.references[i] for i in relevant], bool(every))
        trusted = [self.references[i] for i in every if i in self.trusted]
        if status == "consistent" and trusted and judge_limit(self.robot, entry, trusted, True)[0] == "contradicted":
            status = "contradicted"
        if status == "contradicted" and not self.robot.states("speeds" if entry.column == "speed" else "limits"):
            status = "open"  # er3a assumed it: nobody is contradicted
        return self._described(entry, status, Extent(*interval, NOT_OFF), [], relevant)

    def _described(
        self, entry: Entry, status: Status, extent: Extent, concerned: list[Alternative], relevant: Sequence[int]
    ) -> EntryEvidence:
        readings = [self._reading(each) for each in concerned]
        readings += [each for each in self._same if entry.name in dict(each.entries)]
        if entry in self.free:
            readings += [self._shift(row) for row in self.gauge.directions if row[self.free.index(entry)]]
        off = reduce(ToolOff.worse, (each.off for each in concerned), extent.off)
        return EntryEvidence(
            entry=entry.name,
            value=self.values[entry.name],
            unit=entry.unit,
            status=status,
            interval=extent.interval,
            by=self._documents(relevant or self.relevant(entry, self.every)),
            alternatives=tuple(readings),
            document=document_of(self.robot, entry),
            off=NOT_OFF if status in (*OUTRIGHT_OR_NOT, "gauge") else off,
            at_least=extent.at_least and status == "weak",
        )

    def _settled(self, view: _View, names: Sequence[str]) -> Status:
        """Settled; but only up to signs where evidence allows another arm, for it can be written otherwise here."""
        return "settled_up_to_signs" if view.alternatives and self._rewritten & set(names) else "settled"

    @cached_property
    def _otherwise(self) -> tuple[Tables, Flags]:
        """All ways to write the robot's rows (H), and which of the k entries ``turning`` differ there, (H, k)."""
        rows = same_robots(self.table)
        return rows, np.array([np.abs(wrapped_between(rows, self.table, each)) > ROUNDING for each in self.turning]).T

    @cached_property
    def _rewritten(self) -> set[str]:
        """Entries that have another sign or half turn in other rows of the same robot."""
        return {each.name for each, differs in zip(self.turning, self._otherwise[1].T) if differs.any()}

    @cached_property
    def _same(self) -> list[OtherReading]:
        """Few entries written otherwise so that it is the same robot, without those that contain others."""
        rows, differ = self._otherwise
        count, kept = differ.sum(axis=1), list[int]()
        for k in np.argsort(count, kind="stable").tolist():
            if 0 < count[k] <= MAX_REWRITTEN and not any((differ[j] <= differ[k]).all() for j in kept):
                kept.append(k)
        return [
            OtherReading(tuple(self._value_in(rows[[k]], n) for n in np.flatnonzero(differ[k]).tolist()), NOT_OFF)
            for k in kept
        ]

    def _value_in(self, rows: Tables, place: int) -> tuple[str, float]:
        """Name and value of one of ``turning`` in a batch of one, in its unit."""
        entry = self.turning[place]
        value = entry.of(rows) if entry.unit != "deg" else as_written(entry.of(rows))
        return entry.name, float(value[0] * entry.in_unit)

    def _small(self, extent: Extent) -> bool:
        """Whether what is left open moves the tool by less than the tolerance, as far as a finished search can tell."""
        return not extent.at_least and extent.off.within(self.tolerance.mm, self.tolerance.deg)

    def _given(self) -> list[EntryEvidence]:
        found = []
        for name in ("base", *(() if self.robot.flange_is_last_frame else ("flange",)), "tool"):
            source = self.robot.sources.get(name)
            document = (source.origin or source.source) if source else ""
            found.append(EntryEvidence(name, None, "", "given", None, (), (), document))
        return found

    def _reading(self, alternative: Alternative) -> OtherReading:
        if alternative not in self._readings:
            violated = self._asked_by_all.excluding(alternative.table, self.table)
            self._readings[alternative] = OtherReading(alternative.entries, alternative.off, self._documents(violated))
        return self._readings[alternative]

    @cached_property
    def _asked_by_all(self) -> Asked:
        return Asked(self.robot, requirements_of(self.references))

    def _shift(self, row: Reals) -> OtherReading:
        """A combination that moves no tool, with a step of 5 units for its first entry."""
        own = [(entry, f * entry.scale * entry.in_unit) for entry, f in zip(self.free, row) if f]
        step = SHOWN_STEP / own[0][1]
        return OtherReading(tuple((e.name, self.values[e.name] + step * by) for e, by in own), NOT_OFF)


def _sum_of(factors: Sequence[tuple[Entry, float]]) -> str:
    text = ""
    for entry, factor in factors:
        sign = ("-" if factor < 0 else "") if not text else (" - " if factor < 0 else " + ")
        size = "" if abs(abs(factor) - 1) < 1e-9 else f"{abs(factor):.3g} "
        text += f"{sign}{size}{entry.name}"
    return text


PartName = Literal["geometry", "zero_and_directions", "limits", "speeds"]
PartStatus = Literal["settled", "settled_up_to_signs", "consistent", "weak", "open", "contradicted"]
PART_OF_GROUP: dict[str, PartName] = {
    "dh": "geometry",
    "zero": "zero_and_directions",
    "limits": "limits",
    "speeds": "speeds",
}
GRAVEST: tuple[PartStatus, ...] = ("contradicted", "open", "weak", "consistent", "settled_up_to_signs", "settled")
MAX_COMBINED = 256


def together(evidence: Evidence, names: list[str]) -> ToolOff:
    """How far the tool is off at most if any of the discrete readings of some entries hold together.

    Parameters
    ----------
    names : of entries; readings that change others too are left out

    Returns
    -------
    off : mm and deg, over ``MAX_COMBINED`` combinations at most
    """
    readings = [each for each in evidence.readings if set(each.names) <= set(names)]
    tool = ToolRange(evidence.robot, tables_of(evidence.robot))
    combined: list[tuple[Alternative, ...]] = [()]
    for each in readings:
        free = [own for own in combined if not {n for other in own for n in other.names} & set(each.names)]
        combined += [(*own, each) for own in free][: MAX_COMBINED - len(combined)]
    offs = (tool.off(with_readings(tool.table, evidence.robot, own)) for own in combined[1:])
    return reduce(ToolOff.worse, offs, NOT_OFF)
