"""The interval that a set of references allows for each continuous entry.

Tables far from a given one that also meet the requirements.

At a table with right angles the requirements often have no slope along the free directions, so a search by small steps
ends early although the set continues, there or elsewhere. So the search is repeated from points spread evenly about the
table, near and far. A result is written in the equivalent rows nearest to the table: reversing the x axis of a frame,
or the z axis with its joint, changes rows but not the robot.

Counterexamples to entries that would count as settled, searched from many starts at once.

Starts are spread near and far about a table that meets the requirements, some with joints reversed and angles negated.
Then each entry is held at an offset, in both directions, from that table and from what was found. From each start
damped Gauss-Newton steps go towards the requirements, all in one batch, so that hundreds cost as much as a few one by
one. Extremes over the joint limits are ignored meanwhile and checked afterwards.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import isnan

import numpy as np

from er3a.identifiability.alternatives import amounts_between
from er3a.identifiability.entries import Gauge, TableNumber, shifted
from er3a.identifiability.entry_evidence import Tolerance
from er3a.identifiability.feasible import (
    MAX_DAMPING,
    MET,
    PROFILE,
    STAYING,
    WIDEST_DEG,
    OpenTable,
    Reached,
    Region,
    largest_length,
)
from er3a.identifiability.requirements import Asked
from er3a.identifiability.statements import NOT_OFF, ToolOff, ToolRange
from er3a.kinematics.table_batch import Tables, join
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.references.seen import TableEntry

STARTS, MORE_STARTS = 8, 48
WIDTHS = 0.1, 1.0, 0.3, 1.0
WIDEST_M, WIDEST_RAD = 0.4, np.pi
REACTS = 1e-9
FAR = 3.0  # of an entry's scale
A_LENGTH_M, REVERSED_RAD, UNWATCHED, ROUNDED = 0.3, 0.3, 0.01, 6
MAX_ROWS = 1 << 15


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """An open table away from the one that was given, and the region that it is a point of."""

    region: Region
    point: OpenTable


def open_elsewhere(region: Region, start: OpenTable, watched: Sequence[int]) -> list[Elsewhere]:
    """Open tables found from places spread about an open one: few, and more if some of these lie far away.

    Parameters
    ----------
    region : its entries are those that may change; watched : places of those that show whether a table lies far away
    """
    k, found = len(region.entries), list[Elsewhere]()
    wide = np.array([WIDEST_M if entry.unit == "mm" else WIDEST_RAD for entry in region.entries]) / region.scale
    shares = quasi_random_points(-np.ones(k), np.ones(k), MORE_STARTS) * np.resize(WIDTHS, MORE_STARTS)[:, None]
    for n, amounts in enumerate(start.amounts + (shares * wide) @ region.basis @ region.basis.T):
        if n == STARTS and not any(_is_far(each, start, watched) for each in found):
            break
        reached = region.restarted(amounts, start.chi2)
        nearest = _nearest(region, reached, start.chi2, watched) if reached else None
        found += [nearest] if nearest else []
    return found


def _is_far(found: Elsewhere, start: OpenTable, watched: Sequence[int]) -> bool:
    basis = found.region.basis  # what moves no tool doesn't count
    apart = basis @ (basis.T @ (found.point.amounts - start.amounts))
    return bool(np.abs(apart[list(watched)]).max(initial=0.0) > FAR)


def seen_entries(asked: Asked, table: Tables, entries: Sequence[TableNumber]) -> list[int]:
    """Places of entries that requirements react to at a table with nothing special about it."""
    k = len(entries)
    wide = np.array([WIDEST_M if entry.unit == "mm" else WIDEST_RAD for entry in entries])
    share = quasi_random_points(-np.ones(k), np.ones(k), 1) * WIDTHS[0]
    other = shifted(table, entries, share * wide)
    asked.off(other, afresh=True)
    found: list[int] = np.flatnonzero(np.abs(asked.slope(other, entries)).max(axis=0, initial=0.0) > REACTS).tolist()
    return found


def _nearest(region: Region, point: OpenTable, chi2: float, watched: Sequence[int]) -> Elsewhere | None:
    """The same robot in the rows that are nearest to the region's table."""
    own = region.at(point.amounts)
    nearest = nearest_rows(own, region, watched)
    if nearest is own:
        return Elsewhere(region, point)
    table = region.table.with_column("direction", slice(None), nearest.direction)
    other = Region(region.asked, table, region.entries, region.gauge)
    reached = other.restarted(amounts_between(table, nearest, region.entries), chi2)
    return Elsewhere(other, reached) if reached else None


def nearest_rows(own: Tables, region: Region, watched: Collection[int]) -> Tables:
    """A robot's rows (a batch of one) as near as they can be written to a region's table, above all in the entries at
    places ``watched``; of equals those with fewer joints reversed."""
    every = same_robots(own)
    apart = list(REVERSED_RAD * (every.direction != region.table.direction).T)
    for place, entry in enumerate(region.entries):
        off = (getattr(every, entry.column) - getattr(region.table, entry.column))[:, entry.joint - 1]
        turned = off / A_LENGTH_M if entry.unit == "mm" else (off + np.pi) % (2 * np.pi) - np.pi
        apart.append(turned if place in watched else UNWATCHED * turned)
    i = int(np.argmin(np.abs(apart).sum(axis=0).round(ROUNDED)))
    return every[[i]] if i else own


def same_robots(table: Tables) -> Tables:
    """The rows (a batch) that are the same robot as a table's (a batch of one), itself first; of arms with more than
    eight joints the first ``MAX_ROWS`` of them."""
    found = table
    for turn in _turns(table):
        found = join([found, turn(found)]) if len(found) < MAX_ROWS else found
    return found


def turned_once(table: Tables) -> Tables:
    """Rows (a batch) of the same robot as a table's, with one axis turned round in each; itself first."""
    return join([table, *(turn(table) for turn in _turns(table))])


def _turns(table: Tables) -> list[Callable[[Tables], Tables]]:
    """What turns an x axis or a z axis between base and flange round."""
    joints, first = table.direction.shape[1], 0 if not table.modified[0] else 1
    if table.beta.any():
        return []
    links = [partial(_x_turned, joint=link, row=link + first) for link in range(joints - 1)]
    return [
        *links,
        *(partial(_z_turned, joint=joint, row=joint - 1 + first) for joint in range(1 - first, joints - first)),
    ]


def _x_turned(tables: Tables, joint: int, row: int) -> Tables:
    """The x axis between a joint and the next turned round."""
    for name in ("a", "alpha"):
        tables = tables.with_column(name, [row], -getattr(tables, name)[:, [row]])
    return tables.with_column("offset", [joint, joint + 1], tables.offset[:, [joint, joint + 1]] + np.pi)


def _z_turned(tables: Tables, joint: int, row: int) -> Tables:
    """The z axis of a joint reversed, with the rows before and after it."""
    for name in ("direction", "offset", "d"):
        tables = tables.with_column(name, [joint], -getattr(tables, name)[:, [joint]])
    return tables.with_column("alpha", [row, row + 1], tables.alpha[:, [row, row + 1]] + np.pi)


SPREAD, CHALLENGE_WIDTHS = 192, (0.02, 0.1, 0.3, 1.0)
REVERSED, TURNED = 0.2, 0.15  # shares of joints reversed and angles turned round, in every second spread start
PUSHES = 1.1, 1.7, 3.0, 8.0  # of the smallest step that matters
ROUNDS, PUSHED_FROM, MAX_KEPT = 3, 3, 40
PASSES, STEP, DAMPING, STALLED, FLOOR, NOTHING = 40, 1e-3, 1e-2, 1e-3, 1e-8, 1e-12
CHUNK, SEED = 48, 20261121


def challenges_to(region: Region, start: OpenTable, matters: Mapping[int, float]) -> list[Elsewhere]:
    """Open tables that are extreme along some entry, in either direction.

    Parameters
    ----------
    region : its entries are those that may change; start : an open table of it
    matters : places of entries that are held some way off, with the smallest step (in their scales) that matters
    """
    search = _ManyStarts(region, start, matters)
    search.try_from(*_spread(region, start))
    for _ in range(ROUNDS):
        places = search.farthest_tables()[:PUSHED_FROM]
        before = search.reach.copy()
        search.try_from(*_pushed(region, start, places, matters))
        if (search.reach - before).max() < FAR:
            break
    return search.found()


def _spread(region: Region, start: OpenTable) -> tuple[Reals, Reals, Flags]:
    """Directions (R, n), amounts (R, k) and what is held (R, k), spread about an open table."""
    random = np.random.Generator(np.random.Philox(SEED))
    k, own = len(region.entries), region.table.direction
    wide = np.array([WIDEST_M if entry.unit == "mm" else WIDEST_RAD for entry in region.entries]) / region.scale
    shares = random.uniform(-1, 1, (SPREAD, k)) * np.resize(CHALLENGE_WIDTHS, SPREAD)[:, None]
    second = (np.arange(SPREAD) // len(CHALLENGE_WIDTHS) % 2 == 1)[:, None]
    is_angle = np.array([entry.unit != "mm" for entry in region.entries])
    turned = second & is_angle & (random.uniform(size=(SPREAD, k)) < TURNED)
    reversed_ = second & (random.uniform(size=(SPREAD, own.shape[1])) < REVERSED)
    amounts = start.amounts + shares * wide + np.where(turned, np.pi / region.scale, 0.0)
    return np.where(reversed_, -own, own), amounts, np.zeros((SPREAD, k), dtype=bool)


def _pushed(
    region: Region, start: OpenTable, places: Sequence[tuple[Reals, Reals]], matters: Mapping[int, float]
) -> tuple[Reals, Reals, Flags]:
    """Likewise, each entry held some way off the open table, the others as they are there and at places found."""
    direction, amounts, held = [], [], []
    for own, begun in [(region.table.direction[0], start.amounts), *places]:
        for k, step in matters.items():
            for push in step * np.array([*PUSHES, *(-push for push in PUSHES)]):
                row = begun.copy()
                row[k] = start.amounts[k] + push
                direction.append(own)
                amounts.append(row)
                held.append(np.arange(len(row)) == k)
    return np.array(direction), np.array(amounts), np.array(held)


class _ManyStarts:
    """What was found so far.

    Attributes
    ----------
    reach : (2, k), how far entries were found above and below the start, in their scales
    best : for each of these the directions (n,) and amounts (k,) of the table that lies there
    reversed : by joint (from 0) those of a table in which it turns the other way, extreme or not
    """

    def __init__(self, region: Region, start: OpenTable, watched: Collection[int]):
        self.region, self.start, self.watched = region, start, watched
        self.reach = np.zeros((2, len(region.entries)))
        self.best: dict[tuple[int, int], tuple[Reals, Reals]] = {}
        self.reversed: dict[int, tuple[Reals, Reals]] = {}

    def try_from(self, direction: Reals, amounts: Reals, held: Flags) -> None:
        """Go from starts toward the target, and keep the extremes."""
        for begun in range(0, len(amounts), CHUNK):
            own = slice(begun, begun + CHUNK)
            for row, place in zip(direction[own], self._lowered(direction[own], amounts[own], held[own])):
                if place is not None:
                    self._keep(row, place)

    def _keep(self, direction: Reals, amounts: Reals) -> None:
        region = self.region
        table = region.at(amounts).with_column("direction", slice(None), direction[None])
        nearest = nearest_rows(table, region, self.watched)
        place = nearest.direction[0], amounts_between(region.table, nearest, region.entries)
        basis = region.basis
        apart = basis @ (basis.T @ (place[1] - self.start.amounts))
        for way, sign in enumerate((1.0, -1.0)):
            for k in np.flatnonzero(sign * apart > self.reach[way] + FAR / 2).tolist():
                self.reach[way, k], self.best[way, k] = sign * apart[k], place
        for joint in np.flatnonzero(place[0] != region.table.direction[0]).tolist():
            self.reversed.setdefault(joint, place)

    def farthest_tables(self) -> list[tuple[Reals, Reals]]:
        """Different tables found, the extreme ones along most entries first."""
        counted: dict[bytes, list[tuple[Reals, Reals]]] = {}
        for place in self.best.values():
            counted.setdefault(place[1].tobytes(), []).append(place)
        return [same[0] for same in sorted(counted.values(), key=lambda same: -len(same))]

    def found(self) -> list[Elsewhere]:
        """Tables found, as points of the regions with their directions; those that extremes allow as well."""
        region, found = self.region, list[Elsewhere]()
        for direction, amounts in (*self.farthest_tables()[:MAX_KEPT], *self.reversed.values()):
            table = region.table.with_column("direction", slice(None), direction[None])
            other = Region(region.asked, table, region.entries, region.gauge)
            point = other.restarted(amounts, self.start.chi2)
            found += [Elsewhere(other, point)] if point else []
        return found

    def _lowered(self, direction: Reals, amounts: Reals, held: Flags) -> list[Reals | None]:
        """Amounts (k,) that meet the target, reached from each of R starts; None where it is not."""
        region, likely = self.region, self.region.asked.likely
        amounts = np.clip(amounts, -region.widest, region.widest)
        off = self._off(direction, amounts)
        rest = self._rest(off)
        damping = np.full(len(amounts), DAMPING)
        going: Flags = (rest != 0).any(axis=1)
        for _ in range(PASSES):
            rows = np.flatnonzero(going)
            if not len(rows):
                break
            step = self._steps(direction[rows], amounts[rows], off[rows], rest[rows], damping[rows], held[rows])
            trial = np.clip(amounts[rows] + step, -region.widest, region.widest)
            new_off = self._off(direction[rows], trial)
            new = self._rest(new_off)
            before, after = (rest[rows] ** 2).sum(axis=1), (new**2).sum(axis=1)
            better = after < before
            kept = rows[better]
            amounts[kept], off[kept], rest[kept] = trial[better], new_off[better], new[better]
            damping[rows] = np.where(better, np.maximum(damping[rows] / 10, 1e-9), damping[rows] * 10)
            stalled = better & (after > (1 - STALLED) * before)
            going[rows[stalled | (after == 0)]] = False
            going &= damping < MAX_DAMPING
        chi2 = (off[:, likely] ** 2).sum(axis=1)
        met = self.region.asked.excess(off) <= MET
        met &= chi2 <= self.start.chi2 + PROFILE**2
        return [amount if good else None for amount, good in zip(amounts, met)]

    def _tables(self, direction: Reals, amounts: Reals) -> Tables:
        region = self.region
        return shifted(region.table, region.entries, amounts * region.scale).with_column(
            "direction", slice(None), direction
        )

    def _off(self, direction: Reals, amounts: Reals) -> Reals:
        return self.region.asked.plain_off(self._tables(direction, amounts))

    def _steps(self, direction: Reals, amounts: Reals, off: Reals, rest: Reals, damping: Reals, held: Flags) -> Reals:
        """Damped Gauss-Newton steps (R, k) that leave alone what is held and what moves no tool."""
        count, k = amounts.shape
        near = (amounts[:, None] + STEP * np.eye(k)).reshape(-1, k)
        beside = self._off(np.repeat(direction, k, axis=0), near).reshape(count, k, -1)
        J = np.where((rest[:, None] != 0) & ~held[..., None], (beside - off[:, None]) / STEP, 0.0)  # (R, k, m)
        normal = J @ J.swapaxes(1, 2)
        own = np.einsum("rkk->rk", normal)
        size = np.maximum(own.max(axis=1, keepdims=True), NOTHING)
        system = normal + np.eye(k) * (damping[:, None] * own + FLOOR * size)[:, None]
        step = np.linalg.solve(system, np.einsum("rkm,rm->rk", J, rest)[..., None])[..., 0]
        found: Reals = -step @ self.region.basis @ self.region.basis.T
        return found

    def _rest(self, off: Reals) -> Reals:
        """Components (R, m) of what lies outside the half-widths, a little within; of a likelihood all."""
        rest = self.region.asked.outside(off, STAYING)
        likely = self.region.asked.likely
        rest[:, likely] = off[:, likely]
        return rest


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

    @property
    def interval(self) -> tuple[float, float] | None:
        """Bounds to nine decimals; None where nothing meets the evidence."""
        return None if isnan(self.low) else (round(self.low, 9), round(self.high, 9))


class Extents:
    """Intervals of entries under requirements, the other entries free.

    Parameters
    ----------
    table : from which the search starts (a batch of one)
    entries : all that can take any value; relevant : places of those to which a requirement reacts
    tolerance : how far the tool may be off for what counts as settled
    found : a table that meets the requirements, if the search from ``table`` is known to find none
    """

    def __init__(
        self,
        asked: Asked,
        table: Tables,
        entries: Sequence[TableNumber],
        relevant: Sequence[int],
        gauge: Gauge,
        tool: ToolRange,
        *,
        found: Tables | None = None,
        tolerance: Tolerance | None = None,
    ):
        self.tolerance = tolerance or Tolerance()
        self.asked, self.table, self.entries, self.tool = asked, table, tuple(entries), tool
        self.relevant = list(relevant)
        self.held = self._held(gauge, self.relevant)
        self.region = Region(asked, table, [entries[k] for k in self.relevant], self.held)
        begun = np.zeros(len(self.relevant)) if found is None else amounts_between(table, found, self.region.entries)
        self.start: OpenTable | None = self.region.start(begun) if self.relevant else None
        self.table_meets = table is tool.table and (self.start is None or not self.start.amounts.any())
        self.met = self.start is None or self.start.open
        self._extended: dict[bytes, Reached] = {}
        self._challenged = False
        self._half_turns: dict[int, bool] = {}
        self.elsewhere: list[Elsewhere] = []
        if self.start is not None and self.met:
            self.seen = sorted({*self.relevant, *seen_entries(asked, table, self.entries)})
            self._everywhere = Region(asked, table, [entries[k] for k in self.seen], self._held(gauge, self.seen))
            amounts = np.zeros(len(entries))
            amounts[self.relevant] = self.start.amounts
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
        if self.start is None or not factors[self.relevant].any():
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
        return [self.seen.index(k) for k in self.relevant]

    def _challenge(self) -> bool:
        """Look once for tables that contradict what was found; whether there are any."""
        if self._challenged or self.start is None or not self.met:
            return False
        self._challenged = True
        matters = {place: self._step_that_matters(self.entries[self.seen[place]]) for place in self._watched}
        found = challenges_to(self._everywhere, self._begun, matters)
        self.elsewhere += found
        return bool(found)

    def _step_that_matters(self, entry: TableNumber) -> float:
        """The smallest change of an entry, in its scale, that moves the tool by more than the tolerance."""
        if entry.unit == "mm":
            return self.tolerance.mm / entry.in_unit / entry.scale
        one = self.tool.off(shifted(self.tool.table, [entry], np.array([[entry.scale]])))
        return 1.0 / max(one.mm / self.tolerance.mm, one.deg / self.tolerance.deg)

    def _small(self, factors: Reals, ends: Sequence[float]) -> bool:
        """Whether the tool is off by less than is tolerated at both ends of a combination."""
        return all(self._off(factors, end).within(self.tolerance.mm, self.tolerance.deg) for end in ends)

    def may_reverse(self, joint: int) -> bool:
        """Whether a table was found whose joint (from 1) turns the other way, or the table's robot has rows in which it
        does that differ, of all to which requirements react, in angles alone that are open by half a turn: what is left
        of such an angle about its value and what is left about half a turn from it meet."""
        self._challenge()
        own = self.table.direction[0]
        reversed_ = np.arange(len(own)) == joint - 1
        if any(each.region.table.direction[0, joint - 1] != own[joint - 1] for each in self.elsewhere):
            return True
        if self.start is None or not self.elsewhere:
            return False
        rows = same_robots(self.met_by)
        rows = rows[((rows.direction != own) == reversed_).all(axis=1)]
        for place in sorted(self.seen, key=lambda place: self.entries[place].unit != "mm"):
            entry = self.entries[place]
            off = (getattr(rows, entry.column) - getattr(self.met_by, entry.column))[:, entry.joint - 1]
            off = off if entry.unit == "mm" else (off + np.pi) % (2 * np.pi) - np.pi
            differs = np.abs(off) > REACTS
            if differs.any() and not (entry.unit == "deg" and self._is_open_by_half_a_turn(place)):
                rows = rows[~differs]
        return len(rows) > 0

    def _is_open_by_half_a_turn(self, place: int) -> bool:
        if place not in self._half_turns:
            low, high, *_ = self._found(np.eye(len(self.entries))[place])
            self._half_turns[place] = (high - low) * self.entries[place].scale >= np.pi
        return self._half_turns[place]

    def free_choice(self, entry: TableNumber) -> Extent:
        """The interval of an entry that moves no tool if others are changed with it."""
        return self._anything(entry, self._values()[self.entries.index(entry)], NOT_OFF)

    def _anything(self, entry: TableNumber, value: float, off: ToolOff) -> Extent:
        return Extent(value - self._widest(entry), value + self._widest(entry), off, False)

    def _widest(self, entry: TableNumber) -> float:
        return largest_length(self.table) if entry.unit == "mm" else WIDEST_DEG

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
        toward = factors[self.relevant]
        key = toward.tobytes()
        if key not in self._extended and self.start is not None:
            self._extended[key] = self.region.extent(self.start, toward)
        return self._extended[key]

    def _reached(self, factors: Reals) -> tuple[float, bool]:
        """How far a combination was found, in its scale, and whether that is its end: the end of the start's own
        surroundings, with nothing beyond it from other starts, or all that is searched for."""
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
            ways.append(self.region.extent(self.start, factors[self.relevant], quick=True))
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
        places = [(self.region, np.zeros(len(self.relevant))), (self.region, self.start.amounts)]
        for own, amounts in (*places, *((each.region, each.point.amounts) for each in self.elsewhere)):
            toward = factors[self.relevant if own is self.region else self.seen]
            held = np.concatenate([own.gauge, toward[None] / np.linalg.norm(toward)])
            region = Region(self.asked, own.table, own.entries, held)
            begun = amounts - toward * (toward @ amounts) / (toward @ toward)
            if region.start(begun, few_first=False).excess <= MET:
                return True
        return False

    def _blamed(self, factors: Reals) -> bool:
        """Whether the table that comes nearest to requirements which none meets differs in a combination."""
        return self.start is not None and abs(float(factors[self.relevant] @ self.start.amounts)) > 1.0
