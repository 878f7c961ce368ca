"""What a set of requirements leaves open for each entry of a table, the other entries free.

From a table that meets the requirements each entry is pushed either way, by doubled and then halved steps, while the
others follow it (:mod:`er3a.identifiability.feasible`): that is the interval about the table. Tables far away may meet
the requirements as well, and at a table with right angles no small step leads there. So starts are spread near and far
about it, some with joints reversed and angles turned round, and entries are pushed from the tables that are farthest.
A table is written in the equivalent rows nearest to the given one: reversing the x axis of a frame, or the z axis with
its joint, changes rows but not the robot.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import cached_property, partial
from math import isnan

import numpy as np

from er3a.by_value import frozen
from er3a.comparison.entries import Entry, shifted, wrapped_between
from er3a.identifiability.entries import Gauge
from er3a.identifiability.entry_evidence import Tolerance
from er3a.identifiability.feasible import MET, Region, largest_length
from er3a.identifiability.requirements import Asked
from er3a.identifiability.statements import NOT_OFF, ToolOff, ToolRange
from er3a.kinematics.table_batch import Tables, join
from er3a.numerics.arrays import Flags, Reals

WIDEST_M, WIDEST_RAD = 0.4, np.pi
REACTS = 1e-9
FAR = 3.0  # of an entry's scale
PRINTED = 3  # decimals of mm and deg, with which a table that was led to is as good as with all
A_LENGTH_M, REVERSED_RAD, UNWATCHED, ROUNDED = 0.3, 0.3, 0.01, 6
MAX_ROWS = 1 << 15
SPREAD, WIDTHS = 192, (0.02, 0.1, 0.3, 1.0)
REVERSED, TURNED = 0.2, 0.15  # shares of joints reversed and angles turned round, in every second spread start
PUSHES = 1.1, 3.0, 8.0  # of the tolerance's step
FARTHER = 1.5  # times as far as known, for a table to be looked at
ROUNDS, PUSHED_FROM, SEED = 3, 6, 20261121
STAYING = 0.9  # of a half-width, to within which spread starts are led
FIRST_PUSH, FINE, MOST_PUSHES = 0.1, 0.01, 26  # of an entry's scale; of what was reached


def nearest_rows(own: Tables, region: Region, watched: Collection[int]) -> Tables:
    """A robot's rows as near as they can be written to a region's table.

    Parameters
    ----------
    own : a batch of one
    watched : places of the region's entries that count most

    Returns
    -------
    rows : a batch of one, the same robot; of equally near ones those with fewer joints reversed
    """
    every = same_robots(own)
    apart = list(REVERSED_RAD * (every.direction != region.table.direction).T)
    for place, entry in enumerate(region.entries):
        off = wrapped_between(every, region.table, entry) / (A_LENGTH_M if entry.unit == "mm" else 1.0)
        apart.append(off if place in watched else UNWATCHED * off)
    return every[[int(np.argmin(np.abs(apart).sum(axis=0).round(ROUNDED)))]]


def same_robots(table: Tables) -> Tables:
    """All ways to write a robot's rows, by axes turned round.

    Parameters
    ----------
    table : a batch of one

    Returns
    -------
    rows : a batch, itself first; once there are ``MAX_ROWS``, as of arms with more than eight joints, further axes
        are turned alone
    """
    found = table
    for turn in _turns(table):
        found = join([found, turn(found if len(found) < MAX_ROWS else table)])
    return found


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


@frozen
class Extent:
    """What is left open for an entry, in its unit; NaN where no table was found that meets the evidence.

    Attributes
    ----------
    off : how far the tool is off at most if it alone is anywhere in there
    at_least : whether more may be left open: tables far away were found, and how far they go was not
    """

    low: float
    high: float
    off: ToolOff
    at_least: bool = False

    @property
    def interval(self) -> tuple[float, float] | None:
        """Bounds to nine decimals; None where nothing meets the evidence."""
        return None if isnan(self.low) else (round(self.low, 9), round(self.high, 9))


class Extents:
    """Intervals of entries under requirements, the other entries free.

    Parameters
    ----------
    table : the table (a batch of one) whose entries they are
    entries : all that can take any value; relevant : places of those to which a requirement reacts
    tolerance : how far the tool may be off for what counts as settled

    Attributes
    ----------
    met : whether the table meets the requirements; where it does not, nothing is known of any entry
    far : tables far away that meet them, too, once these were searched for: how far such go was not
    goes_far : whether these differ in most entries: then no search tells where any entry ends
    """

    def __init__(
        self,
        asked: Asked,
        table: Tables,
        entries: Sequence[Entry],
        relevant: Sequence[int],
        gauge: Gauge,
        tool: ToolRange,
        *,
        tolerance: Tolerance | None = None,
    ):
        self.tolerance, self.entries, self.tool, self.table = tolerance or Tolerance(), tuple(entries), tool, table
        seen = {*relevant, *_seen(asked, table, entries)} if relevant else set[int]()
        self.places = sorted(seen - set(gauge.chosen))
        self.region = Region(asked, table, [entries[k] for k in self.places])
        self.watched = [n for n, k in enumerate(self.places) if k in set(relevant)]
        self.met = not relevant or asked.missed_by(table) <= MET
        self.direction, self.start = table.direction[0], np.zeros(len(self.places))
        likely = asked.likely
        if self.met and len(likely) and len(self.places):
            self.start = self.region.reached(self.direction[None], self.start[None])[0][0]
            self.region.chi2 = float((asked.near_off(self.met_by)[0][likely] ** 2).sum())
        self.far: list[tuple[Reals, Reals]] = []
        self.goes_far = False
        self._ends: dict[bytes, tuple[float, float]] = {}

    @property
    def met_by(self) -> Tables:
        """The table; where some requirements have standard deviations, the one near it that is likeliest."""
        return self.region.tables(self.direction[None], self.start[None])

    def led_to(self, other: Tables) -> Tables | None:
        """A table near another one that meets the requirements, in the rows that are nearest to the given table.

        Parameters
        ----------
        other : a batch of one

        Returns
        -------
        table : a batch of one, entries that nothing reacts to as they are given if that will do, to few decimals if
            these will do, so that parallel axes are parallel; None if steps from ``other`` lead to none
        """
        direction, amounts = self._rewritten(*self._amounts(other))
        watched = np.isin(np.arange(len(amounts)), self.watched)
        for start in (np.where(watched, amounts, 0.0), amounts):
            found, met = self.region.reached(direction[None], start[None], inner=0.0)
            units = np.array([10.0**-PRINTED / each.in_unit for each in self.region.entries])
            given = np.array([each.of(self.table)[0] for each in self.region.entries])
            for amounts in (np.round((given + found[0]) / units) * units - given, found[0]) if met[0] else ():
                if self.region.confirmed(direction, amounts, np.ones(len(amounts), dtype=bool)) is not None:
                    return self.region.tables(direction[None], amounts[None])
        return None

    def _amounts(self, other: Tables) -> tuple[Reals, Reals]:
        """Directions (n,) of another table, and what is to be added (k,) to the free entries to get it."""
        amounts = [float(wrapped_between(other, self.table, each)[0]) for each in self.region.entries]
        return other.direction[0], np.array(amounts)

    def _rewritten(self, direction: Reals, amounts: Reals) -> tuple[Reals, Reals]:
        """The same robot in the rows that are nearest to the table."""
        return self._amounts(
            nearest_rows(self.region.tables(direction[None], amounts[None]), self.region, self.watched)
        )

    def along(self, factors: Reals, moves_tool: bool = True) -> Extent:
        """The interval of a combination of entries, the others free.

        Parameters
        ----------
        factors : (k,), of the entries' steps; one at least is not 0, and of an entry alone it is 1
        moves_tool : False if others can be changed with it so that no tool moves: then any value is allowed

        Returns
        -------
        extent : in the unit of the first entry that occurs
        """
        first = self.entries[int(np.flatnonzero(factors)[0])]
        weights = factors * first.scale / np.array([each.scale for each in self.entries])
        value = float(sum(w * each.of(self.table)[0] for w, each in zip(weights, self.entries) if w))
        own = weights[self.places]
        watched = np.isin(np.arange(len(own)), self.watched)
        if not (moves_tool and own[watched].any()):
            widest = self._widest(first)
            off = self._off(first, widest) if moves_tool else NOT_OFF
            return Extent((value - widest) * first.in_unit, (value + widest) * first.in_unit, off)
        if not self.met:
            return Extent(np.nan, np.nan, NOT_OFF)
        low, high = self._end(own)
        reached = [float(own @ amounts) for _, amounts in self.elsewhere]
        low, high = min([low, 0.0, *reached]), max([high, 0.0, *reached])
        off = self._off(first, low).worse(self._off(first, high))
        ends = (value + low) * first.in_unit, (value + high) * first.in_unit
        at_least = self.goes_far or (bool(self.far) and not off.within(self.tolerance.mm, self.tolerance.deg))
        return Extent(*ends, off, at_least)

    def _widest(self, entry: Entry) -> float:
        return largest_length(self.table) if entry.unit == "mm" else np.pi

    def _off(self, entry: Entry, amount: float) -> ToolOff:
        """How far the tool is off if the entry alone changes, by an amount in m or rad."""
        if entry.unit == "mm":
            return ToolOff(abs(amount) * 1000.0, 0.0)
        return self.tool.off(shifted(self.tool.table, [entry], np.array([[amount]])))

    def _end(self, weights: Reals) -> tuple[float, float]:
        """How low and how high a combination goes about the start; of all single entries with the first."""
        if weights.tobytes() not in self._ends:
            unknown = [*(np.eye(len(weights))[self.watched] if not self._ends else ()), weights]
            for each, ends in zip(unknown, self._pushed(np.array(unknown))):
                self._ends[each.tobytes()] = ends
        return self._ends[weights.tobytes()]

    def _pushed(self, weights: Reals) -> list[tuple[float, float]]:
        """The ends of combinations (T, k), by pushes from the start, extremes where it attains them."""
        if self.region.asked.extreme:
            self.region.asked.off(self.met_by)
        weights, sign = np.repeat(weights, 2, axis=0), np.tile([-1.0, 1.0], len(weights))
        toward = weights / (weights**2).sum(axis=1, keepdims=True)
        first = [int(np.flatnonzero(row)[0]) for row in weights]
        widest, fine = self.region.widest[first], FIRST_PUSH * self.region.scale[first]
        inside, outside, place = np.zeros(len(sign)), np.full(len(sign), np.inf), np.tile(self.start, (len(sign), 1))
        for _ in range(MOST_PUSHES):
            rows = np.flatnonzero((inside < widest) & ~(outside - inside <= FINE * np.maximum(inside, fine)))
            if not len(rows):
                break
            trial = np.where(outside < np.inf, (inside + outside) / 2, np.maximum(fine, 2 * inside))
            trial = np.minimum(trial, widest)[rows]
            share = np.where(inside[rows] > 0, trial / np.maximum(inside[rows], REACTS), 1.0)
            ahead = self.start + (place[rows] - self.start) * share[:, None]
            lacking = sign[rows] * trial - ((ahead - self.start) * weights[rows]).sum(axis=1)
            ahead += lacking[:, None] * toward[rows]
            direction = np.tile(self.direction, (len(rows), 1))
            reached, met = self.region.reached(direction, ahead, weights[rows] != 0, near=True)
            inside[rows[met]], place[rows[met]], outside[rows[~met]] = trial[met], reached[met], trial[~met]
        ends = (self.start * weights).sum(axis=1) + sign * inside
        return list(zip(ends[::2].tolist(), ends[1::2].tolist()))

    @cached_property
    def elsewhere(self) -> list[tuple[Reals, Reals]]:
        """Tables far away that meet the requirements, those that go farthest along an entry in either direction."""
        if not self.met or not len(self.places):
            return []
        best: dict[tuple[int, float], tuple[Reals, Reals]] = {}
        reversed_: dict[int, tuple[Reals, Reals]] = {}
        farthest: dict[tuple[int, float], float] = {}

        def keep(direction: Reals, amounts: Reals) -> bool:
            each = self._rewritten(direction, amounts)
            apart = (each[1] - self.start) / self.region.scale
            if not self.region.meets(*each):  # an entry that is measured by itself tells an arm's rows apart
                each = direction, amounts
            ways = [
                (n, s) for n in self.watched for s in (1.0, -1.0) if s * apart[n] > FARTHER * farthest.get((n, s), FAR)
            ]
            joints = [j for j in np.flatnonzero(each[0] != self.table.direction[0]).tolist() if j not in reversed_]
            confirmed = self.region.confirmed(*each) if ways or joints else None
            if confirmed is None:
                return False
            each = each[0], confirmed
            for way in ways:
                farthest[way], best[way] = way[1] * float(apart[way[0]]), each
            reversed_.update(dict.fromkeys(joints, each))
            return bool(ways)

        def tried(direction: Reals, amounts: Reals, held: Flags | None = None) -> bool:
            reached, met = self.region.reached(direction, amounts, held, inner=STAYING)
            return any([keep(direction[i], reached[i]) for i in np.flatnonzero(met)])

        tried(*_spread(self.region, self.direction, self.start))
        for _ in range(ROUNDS):
            near = [n for n in self.watched if {(n, 1.0), (n, -1.0)}.isdisjoint(best)]
            if not near or not tried(*self._far_pushes(near, _distinct(best.values())[:PUSHED_FROM])):
                break
        self.far = _distinct(best.values())
        self.goes_far = 2 * len({n for n, _ in best}) > len(self.watched)
        return _distinct([*best.values(), *reversed_.values()])

    def _far_pushes(self, near: Sequence[int], places: Sequence[tuple[Reals, Reals]]) -> tuple[Reals, Reals, Flags]:
        """Directions (R, n), amounts (R, k) and what is held (R, k): each entry that is near in all some way off,
        the others as they are at the start and at places far away."""
        rows = [
            (
                direction,
                np.where(np.arange(len(begun)) == n, self.start[n] + push * self._step_that_matters(n), begun),
                n,
            )
            for direction, begun in ((self.direction, self.start), *places)
            for n in near
            for push in (*PUSHES, *(-push for push in PUSHES))
        ]
        held = np.array([n for *_, n in rows])[:, None] == np.arange(len(self.start))
        return np.array([each for each, *_ in rows]), np.array([each for _, each, _ in rows]), held

    def _step_that_matters(self, place: int) -> float:
        """The smallest change of an entry, m or rad, that moves the tool by more than the tolerance."""
        entry = self.region.entries[place]
        one = self._off(entry, entry.scale)
        return entry.scale / max(one.mm / self.tolerance.mm, one.deg / self.tolerance.deg, FAR / 1e3)

    def may_reverse(self, joint: int) -> bool:
        """Whether a joint may turn the other way.

        Parameters
        ----------
        joint : from 1

        Returns
        -------
        reverse : True if a table was found in which it does; also if rows of the same robot in which it does differ in
            open angles alone

        Notes
        -----
        Only entries to which requirements react count. An angle is open by half a turn if what is left about its value
        meets what is left about half a turn from it.
        """
        own = self.direction
        if any(direction[joint - 1] != own[joint - 1] for direction, _ in self.elsewhere):
            return True
        if not self.elsewhere:
            return False
        rows = same_robots(self.met_by)
        rows = rows[((rows.direction != own) == (np.arange(len(own)) == joint - 1)).all(axis=1)]
        for place, entry in sorted(enumerate(self.region.entries), key=lambda each: each[1].unit != "mm"):
            differs = np.abs(wrapped_between(rows, self.met_by, entry)) > REACTS
            if differs.any() and not (entry.unit == "deg" and self._is_open_by_half_a_turn(place)):
                rows = rows[~differs]
        return len(rows) > 0

    def _is_open_by_half_a_turn(self, place: int) -> bool:
        reached = [*self._end(np.eye(len(self.start))[place]), *(own[place] for _, own in self.elsewhere)]
        return bool(max(reached) - min(reached) >= np.pi)


def _seen(asked: Asked, table: Tables, entries: Sequence[Entry]) -> list[int]:
    """Places of entries that requirements react to at a table with nothing special about it."""
    random, k = np.random.Generator(np.random.Philox(SEED)), len(entries)
    wide = np.array([WIDEST_M if entry.unit == "mm" else WIDEST_RAD for entry in entries])
    steps = random.uniform(-1, 1, k) * wide * WIDTHS[1] + np.concatenate([np.zeros((1, k)), 1e-6 * np.eye(k)])
    off = asked.near_off(shifted(table, entries, steps))
    return np.flatnonzero(np.abs(off[1:] - off[0]).max(axis=1, initial=0.0) > REACTS).tolist()


def _spread(region: Region, own: Reals, start: Reals) -> tuple[Reals, Reals]:
    """Directions (R, n) and amounts (R, k) spread about a table."""
    random, k = np.random.Generator(np.random.Philox(SEED)), len(region.entries)
    is_angle = np.array([entry.unit != "mm" for entry in region.entries])
    shares = random.uniform(-1, 1, (SPREAD, k)) * np.resize(WIDTHS, SPREAD)[:, None]
    second = (np.arange(SPREAD) // len(WIDTHS) % 2 == 1)[:, None]
    turned = second & is_angle & (random.uniform(size=(SPREAD, k)) < TURNED)
    reversed_ = second & (random.uniform(size=(SPREAD, len(own))) < REVERSED)
    amounts = start + shares * np.where(is_angle, WIDEST_RAD, WIDEST_M) + np.where(turned, np.pi, 0.0)
    return np.where(reversed_, -own, own), amounts


def _distinct(places: Collection[tuple[Reals, Reals]]) -> list[tuple[Reals, Reals]]:
    """Different tables, those that are there most often first."""
    counted: dict[bytes, list[tuple[Reals, Reals]]] = {}
    for place in places:
        counted.setdefault(place[0].tobytes() + place[1].tobytes(), []).append(place)
    return [same[0] for same in sorted(counted.values(), key=lambda same: -len(same))]
