"""What a set of references leaves open for each entry that can take any value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from er3a.identifiability.challenges import challenges_to
from er3a.identifiability.elsewhere import FAR, Elsewhere, open_elsewhere, seen_entries
from er3a.identifiability.entries import TableNumber, shifted
from er3a.identifiability.entry_evidence import Tolerance
from er3a.identifiability.feasible import MET, WIDEST_DEG, OpenTable, Reached, Region, farthest
from er3a.identifiability.gauge import Gauge
from er3a.identifiability.requirements import Asked
from er3a.identifiability.restarts import amounts_between
from er3a.identifiability.tool_motion import NOT_OFF, ToolOff, ToolRange
from er3a.kinematics.table_batch import Tables
from er3a.numerics.arrays import Reals
from er3a.references.seen import TableEntry

FEW_STEPS = 10
ALREADY = 1e-4  # of a scale's step, in which an entry counts as inside its interval


@dataclass(frozen=True)
class Extent:
    """What is left open for an entry, in its unit; NaN where no table was found that meets the evidence.

    Attributes
    ----------
    off : how far the tool is off at most if it alone is anywhere in there
    excluded : whether the table's value is not
    at_least : whether more may be left open: the search was cut off
    """

    low: float
    high: float
    off: ToolOff
    excluded: bool
    at_least: bool = False


class Extents:
    """Intervals of entries under requirements, the other entries free.

    Parameters
    ----------
    table : from which the search starts (a batch of one)
    entries : all that can take any value; speaking : places of those to which a requirement reacts
    tolerance : how far the tool may be off for what counts as settled
    found : a table that meets the requirements, if the search from ``table`` is known to find none
    """

    def __init__(
        self,
        asked: Asked,
        table: Tables,
        entries: Sequence[TableNumber],
        speaking: Sequence[int],
        gauge: Gauge,
        tool: ToolRange,
        *,
        found: Tables | None = None,
        tolerance: Tolerance | None = None,
    ):
        self.tolerance = tolerance or Tolerance()
        self.asked, self.table, self.entries, self.tool = asked, table, tuple(entries), tool
        self.speaking = list(speaking)
        self.held = self._held(gauge, self.speaking)
        self.region = Region(asked, table, [entries[k] for k in self.speaking], self.held)
        begun = np.zeros(len(self.speaking)) if found is None else amounts_between(table, found, self.region.entries)
        self.start: OpenTable | None = self.region.start(begun) if self.speaking else None
        self.table_meets = table is tool.table and (self.start is None or not self.start.amounts.any())
        self.met = self.start is None or self.start.open
        self._extended: dict[bytes, Reached] = {}
        self._challenged = False
        self.elsewhere: list[Elsewhere] = []
        if self.start is not None and self.met:
            self.seen = sorted({*self.speaking, *seen_entries(asked, table, self.entries)})
            self._everywhere = Region(asked, table, [entries[k] for k in self.seen], self._held(gauge, self.seen))
            amounts = np.zeros(len(entries))
            amounts[self.speaking] = self.start.amounts
            self.begun = amounts[self.seen]
            self._begun = replace(self.start, amounts=self.begun)
            self.elsewhere = open_elsewhere(self._everywhere, self._begun, self._watched)

    @staticmethod
    def _held(gauge: Gauge, places: Sequence[int]) -> Reals:
        """Combinations (g, k) of the entries at places that move no tool, of length 1."""
        held: Reals = gauge.directions[:, list(places)]
        held = held[np.linalg.norm(held, axis=1) > 0]
        held /= np.linalg.norm(held, axis=1, keepdims=True)
        return held

    @property
    def met_by(self) -> Tables:
        """The table, or if it does not meet the requirements, one near it that does."""
        return self.table if self.start is None else self.region.at(self.start.amounts)

    def of(self, entry: TableNumber) -> Extent:
        """The interval of an entry."""
        k = self.entries.index(entry)
        toward = np.zeros(len(self.entries))
        toward[k] = 1.0
        return self.along(toward)

    def along(self, factors: Reals) -> Extent:
        """The interval of a combination of entries, ``factors`` (k,) of their steps."""
        entry = self.entries[int(np.flatnonzero(factors)[0])]
        factor = entry.scale * entry.in_unit
        scales = np.array([each.scale * each.in_unit for each in self.entries])
        units = factors * factor / scales
        value = float(sum(u * v for u, v in zip(units, self._values()) if u))
        if self.start is None or not factors[self.speaking].any():
            return self._anything(entry, value, self._off(factors, self._widest(entry) / factor))
        if not self.met:
            return Extent(np.nan, np.nan, NOT_OFF, bool(self._blamed(factors)))
        measured = self._measured(entry, together=bool(np.count_nonzero(factors) > 1))
        ends = [(bound - value) / factor for bound in measured] if measured else []
        within = bool(ends) and ends[0] <= 0 <= ends[1]
        low, high, excluded, at_least = self._found(factors)
        if not at_least and not (within and self._small(factors, ends)) and self._challenge():
            low, high, excluded, at_least = self._found(factors)
        if at_least and within:
            (low, high), at_least = ends, False
        off = self._off(factors, low).worse(self._off(factors, high))
        return Extent(value + low * factor, value + high * factor, off, excluded, at_least)

    def _measured(self, entry: TableNumber, together: bool) -> tuple[float, float] | None:
        """The bounds of an entry, in its unit, if a requirement is about it alone: no table can leave these. Of what is
        determined ``together`` from that entry on: lengths along parallel axes are measured as one."""
        for each in self.asked.plain:
            own = each.quantity
            if not isinstance(own, TableEntry) or (own.column == "d") != together or each.gaussian:
                continue
            if (own.column, own.joint) == (entry.column, entry.joint):
                return each.expected - each.half_width, each.expected + each.half_width
        return None

    @property
    def _watched(self) -> list[int]:
        """Places of the entries to which a requirement reacts, among those that are seen."""
        return [self.seen.index(k) for k in self.speaking]

    def _challenge(self) -> bool:
        """Look once for tables that speak against what was found; whether there are any."""
        if self._challenged or self.start is None or not self.met:
            return False
        self._challenged = True
        matters = {place: self._step_that_matters(self.entries[self.seen[place]]) for place in self._watched}
        found = challenges_to(self._everywhere, self._begun, matters)
        self.elsewhere += found
        return bool(found)

    def _step_that_matters(self, entry: TableNumber) -> float:
        """The least change of an entry, in its scale, by which the tool is off by more than is tolerated."""
        if entry.unit == "mm":
            return self.tolerance.mm / entry.in_unit / entry.scale
        one = self.tool.off(shifted(self.tool.table, [entry], np.array([[entry.scale]])))
        return 1.0 / max(one.mm / self.tolerance.mm, one.deg / self.tolerance.deg)

    def _small(self, factors: Reals, ends: Sequence[float]) -> bool:
        """Whether the tool is off by less than is tolerated at both ends of a combination."""
        return all(self._off(factors, end).within(self.tolerance.mm, self.tolerance.deg) for end in ends)

    def may_reverse(self, joint: int) -> bool:
        """Whether a table was found whose joint (from 1) turns the other way, however its rows are written."""
        self._challenge()
        own = self.table.direction[0, joint - 1]
        return any(each.region.table.direction[0, joint - 1] != own for each in self.elsewhere)

    def free_choice(self, entry: TableNumber) -> Extent:
        """The interval of an entry that moves no tool if others are changed with it."""
        return self._anything(entry, self._values()[self.entries.index(entry)], NOT_OFF)

    def _anything(self, entry: TableNumber, value: float, off: ToolOff) -> Extent:
        return Extent(value - self._widest(entry), value + self._widest(entry), off, False)

    def _widest(self, entry: TableNumber) -> float:
        return farthest(self.table) if entry.unit == "mm" else WIDEST_DEG

    def _found(self, factors: Reals) -> tuple[float, float, bool, bool]:
        """How low and how high a combination was found, in its scale; whether 0 is excluded; whether there may be
        more."""
        ways = [self._reached(sign * factors) for sign in (1.0, -1.0)]
        high, low, at_least = ways[0][0], -ways[1][0], not all(finished for _, finished in ways)
        excluded = False
        if not self.table_meets:
            near = [self._near(sign * factors).value for sign in (1.0, -1.0)]
            excluded = not -near[1] - ALREADY <= 0 <= near[0] + ALREADY and not self._could_stay(factors)
        return (low, high, True, at_least) if excluded else (min(low, 0.0), max(high, 0.0), False, at_least)

    def _near(self, factors: Reals) -> Reached:
        """How far the start's own surroundings extend."""
        toward = factors[self.speaking]
        key = toward.tobytes()
        if key not in self._extended and self.start is not None:
            self._extended[key] = self.region.extent(self.start, toward)
        return self._extended[key]

    def _reached(self, factors: Reals) -> tuple[float, bool]:
        """How far a combination was found, in its scale, and whether that is its end: the end of the start's own
        surroundings, with nothing beyond it from other starts, or all that is looked for."""
        toward = factors[self.seen]
        best = max(self.elsewhere, key=lambda each: float(toward @ each.point.amounts), default=None)
        own = float(toward @ best.point.amounts) if best else -np.inf
        if best is None or own - float(toward @ self.begun) < FAR:
            near = self._near(factors)
            if best is None or own <= near.value + ALREADY:
                return near.value, near.finished
            reached = best.region.followed(best.point, toward)
            return max(own, reached.value), reached.finished
        ways = [best.region.followed(best.point, toward, FEW_STEPS)]
        if self.start is not None:
            ways.append(self.region.extent(self.start, factors[self.speaking], quick=True))
        value = max(own, *(way.value for way in ways))
        return value, value > float(np.abs(toward) @ best.region.widest) - ALREADY

    def _values(self) -> list[float]:
        return [float(getattr(self.table, e.column)[0, e.joint - 1] * e.in_unit) for e in self.entries]

    def _off(self, factors: Reals, amount: float) -> ToolOff:
        """How far the tool is off if the first of the entries alone changes, by an amount in its scale."""
        k = int(np.flatnonzero(factors)[0])
        entry = self.entries[k]
        if entry.unit == "mm":
            return ToolOff(abs(amount * entry.scale) * 1000.0 / abs(factors[k]), 0.0)
        step = np.array([[amount * entry.scale / factors[k]]])
        return self.tool.off(shifted(self.tool.table, [entry], step))

    def _could_stay(self, factors: Reals) -> bool:
        """Whether some table with the combination as it is meets all requirements."""
        if self.start is None:
            return True
        places = [(self.region, np.zeros(len(self.speaking))), (self.region, self.start.amounts)]
        for own, amounts in (*places, *((each.region, each.point.amounts) for each in self.elsewhere)):
            toward = factors[self.speaking if own is self.region else self.seen]
            held = np.concatenate([own.gauge, toward[None] / np.linalg.norm(toward)])
            region = Region(self.asked, own.table, own.entries, held)
            begun = amounts - toward * (toward @ amounts) / (toward @ toward)
            if region.start(begun, few_first=False).excess <= MET:
                return True
        return False

    def _blamed(self, factors: Reals) -> bool:
        """Whether the table that comes nearest to requirements which none meets differs in a combination."""
        return self.start is not None and abs(float(factors[self.speaking] @ self.start.amounts)) > 1.0
