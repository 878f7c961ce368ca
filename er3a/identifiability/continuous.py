"""What a set of references leaves open for each entry that can take any value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from er3a.identifiability.entries import TableNumber, shifted
from er3a.identifiability.feasible import MET, WIDEST_DEG, OpenTable, Region, farthest
from er3a.identifiability.gauge import Gauge
from er3a.identifiability.requirements import Asked
from er3a.identifiability.restarts import amounts_between
from er3a.identifiability.tool_motion import NOT_OFF, ToolOff, ToolRange
from er3a.kinematics.table_batch import Tables
from er3a.numerics.arrays import Reals

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
    ):
        self.asked, self.table, self.entries, self.tool = asked, table, tuple(entries), tool
        self.speaking = list(speaking)
        held = gauge.directions[:, self.speaking]
        held = held[np.linalg.norm(held, axis=1) > 0]
        self.held = held / np.linalg.norm(held, axis=1, keepdims=True) if len(held) else held
        self.region = Region(asked, table, [entries[k] for k in self.speaking], self.held)
        begun = np.zeros(len(self.speaking)) if found is None else amounts_between(table, found, self.region.entries)
        self.start: OpenTable | None = self.region.start(begun) if self.speaking else None
        self.table_meets = table is tool.table and (self.start is None or not self.start.amounts.any())
        self.met = self.start is None or self.start.open

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
            widest = farthest(self.table) if entry.unit == "mm" else WIDEST_DEG
            return Extent(value - widest, value + widest, self._off(factors, widest / factor), False)
        if not self.met:
            return Extent(np.nan, np.nan, NOT_OFF, bool(self._blamed(factors)))
        toward = factors[self.speaking]
        above, below = self.region.extent(self.start, toward), self.region.extent(self.start, -toward)
        high, low = above.value, -below.value
        excluded = not low - ALREADY <= 0 <= high + ALREADY and not self._could_stay(toward)
        if not excluded:
            low, high = min(low, 0.0), max(high, 0.0)
        off = self._off(factors, low).worse(self._off(factors, high))
        return Extent(
            value + low * factor, value + high * factor, off, excluded, not (above.finished and below.finished)
        )

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

    def _could_stay(self, toward: Reals) -> bool:
        """Whether some table with the combination as it is meets all requirements."""
        if self.start is None:
            return True
        held = np.concatenate([self.held, toward[None] / np.linalg.norm(toward)])
        region = Region(self.asked, self.table, self.region.entries, held)
        for amounts in (np.zeros(len(toward)), self.start.amounts):
            begun = amounts - toward * (toward @ amounts) / (toward @ toward)
            if region.start(begun, few_first=False).excess <= MET:
                return True
        return False

    def _blamed(self, factors: Reals) -> bool:
        """Whether the table that comes nearest to requirements which none meets differs in a combination."""
        return self.start is not None and abs(float(factors[self.speaking] @ self.start.amounts)) > 1.0
