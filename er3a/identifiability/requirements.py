"""What references ask of a table's geometry, as smooth numbers that an optimiser can follow.

A reference with a half-width asks for ``|off| <= half-width``; one with a standard deviation is a term of a likelihood.
Of references that contradict each other, either may be right, so they ask for no more than the hull of what they leave
open. Extremes over the joint limits are followed along with where they are attained: their derivative with respect to
the table is that at the maximiser (envelope theorem).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from er3a.identifiability.entries import TableNumber, shifted
from er3a.identifiability.extreme_climb import Climber, climber, measure_code
from er3a.identifiability.peaks import best_apart, box_points, climb, peak
from er3a.kinematics.table_batch import Tables, frames_of
from er3a.numerics.arrays import Flags, Reals
from er3a.references.components import Components
from er3a.references.quantities import FRAME_OF_POINT, MM, Extreme, Limit, PoseOutside, Quantity, Speed
from er3a.references.reference import Reference, conflicts
from er3a.robots.robot import Robot

LIKELY = 4.0  # standard deviations, beyond which a discrete alternative is excluded
SLIGHT = 1e-3  # of a half-width
SLOPE_STEP = 1e-3  # of an entry's scale
SCANNED, WATCHED, OVERTAKEN_M = 512, 48, 1e-9
ACROSS, OVERTAKINGS, CLIMBS = np.linspace(0.0, 1.0, 9), 4, 6
TINY = 1e-300
KINK_STEP, KINK = 1.0, 1.0  # of an entry's scale, and of a half-width


@dataclass(frozen=True)
class Requirement:
    """One number that is asked for.

    Attributes
    ----------
    half_width : or the standard deviation, if ``gaussian``
    references : places of the references that ask for it
    """

    quantity: Quantity
    expected: float
    half_width: float
    gaussian: bool
    references: tuple[int, ...]


def requirements_of(references: Sequence[Reference]) -> list[Requirement]:
    """What references ask of a table; those about limits and speeds ask nothing of it."""
    asked = {
        i: reference
        for i, reference in enumerate(references)
        if reference.expected is not None and not isinstance(reference.quantity, Limit | Speed | PoseOutside)
    }
    rivals: dict[int, set[int]] = {}
    for i, j in conflicts(references):
        if i in asked and j in asked:
            together = {i, j} | rivals.get(i, set()) | rivals.get(j, set())
            rivals.update(dict.fromkeys(together, together))
    found = []
    for i, reference in asked.items():
        if i in rivals:
            if i == min(rivals[i]):
                found.append(_hull(references, sorted(rivals[i])))
            continue
        stated = _stated(reference)
        width = reference.deviation or reference.uncertainty
        found.append(Requirement(reference.quantity, stated, width, reference.deviation is not None, (i,)))
    return found


def _hull(references: Sequence[Reference], places: list[int]) -> Requirement:
    first = references[places[0]]
    stated = [_stated(references[i]) for i in places]
    if all(type(references[i].quantity).apart is Quantity.apart for i in places):
        low = min(value - references[i].uncertainty for value, i in zip(stated, places))
        high = max(value + references[i].uncertainty for value, i in zip(stated, places))
        return Requirement(first.quantity, (low + high) / 2, (high - low) / 2, False, tuple(places))
    width = max(
        first.quantity.apart(stated[0], references[i].quantity, value) + references[i].uncertainty
        for value, i in zip(stated, places)
    )
    return Requirement(first.quantity, stated[0], width, False, tuple(places))


def _stated(reference: Reference) -> float:
    return float(reference.expected if reference.expected is not None else np.nan)


@dataclass(frozen=True, eq=False)
class _Spread:
    """Joint vectors within limits: a few and many all over them, (P, n) each; joints that are turned (A, n), and where
    to."""

    limits: Reals
    lower: Reals
    upper: Reals
    watched: Reals
    scanned: Reals
    turned: Flags
    elsewhere: Reals

    def across(self, q: Reals) -> Reals:
        """Joint vectors (A, n), one joint elsewhere than in q (n,): there a climb that ended on a saddle goes on."""
        return np.where(self.turned, self.elsewhere, q)


class FollowedExtreme:
    """An extreme over the joint limits, and where it was attained last."""

    def __init__(self, quantity: Extreme, robot: Robot):
        self.quantity, self.robot = quantity, robot
        self.count = len(robot.a)
        moving = FRAME_OF_POINT[quantity.point] % (self.count + 1)
        self.joints = list(range(1, min(moving, self.count)))  # none of the measures changes with joint 1
        self.sign = 1.0 if quantity.extreme == "greatest" else -1.0
        self.q = np.zeros(self.count)
        self.known = False
        self._spread: _Spread | None = None
        self.code = measure_code(quantity)
        box = np.zeros(len(self.joints)), np.ones(len(self.joints))
        self.watched, self.scanned = box_points(*box, WATCHED), box_points(*box, SCANNED)

    def at(self, table: Tables) -> float:
        """The extreme in mm of a table (a batch of one)."""
        if self.code is not None:
            spread = self._spread_of(table)
            climb_from = climber(table, self.robot, self.code, self.sign, np.array(self.joints))
            if not self.known:
                self.q = self._scanned(table, spread, climb_from)
            q = np.clip(self.q, spread.lower, spread.upper)
            q[0] = 0.0
            value = -np.inf
            last = np.concatenate([q[None], spread.watched])
            for _ in range(OVERTAKINGS):
                self.q, now = climb_from(last)
                if now <= value + OVERTAKEN_M:
                    break
                value, last = now, np.concatenate([self.q[None], spread.across(self.q)])
            self.known = True
            return self.sign * value * MM
        lower, upper = table.lower[0, self.joints], table.upper[0, self.joints]
        lower, upper = np.minimum(lower, upper), np.maximum(lower, upper)

        def measured(q: Reals) -> Reals:
            values: Reals = self.sign * self._measure(table, self._whole(q))[0]
            return values

        if self.known:
            q, value = climb(measured, np.clip(self.q[self.joints], lower, upper), lower, upper)
            points = box_points(lower, upper, WATCHED)
            values = measured(points)
            if values.max() > value + OVERTAKEN_M:
                q, value = peak(measured, lower, upper, points)
        else:
            q, value = peak(measured, lower, upper)
        self.q, self.known = self._whole(q), True
        return self.sign * value * MM

    def _spread_of(self, table: Tables) -> _Spread:
        """Where to look, for the limits of a table: those of the last one, as a rule."""
        limits = np.concatenate([table.lower[0], table.upper[0]])
        if self._spread is None or not np.array_equal(self._spread.limits, limits):
            lower, upper = np.minimum(*np.split(limits, 2)), np.maximum(*np.split(limits, 2))
            low, wide = lower[self.joints], (upper - lower)[self.joints]
            watched, scanned = (self._whole(low + shares * wide) for shares in (self.watched, self.scanned))
            turned = np.repeat(np.eye(self.count, dtype=bool)[self.joints], len(ACROSS), axis=0)
            elsewhere = lower + np.tile(ACROSS, len(self.joints))[:, None] * (upper - lower)
            self._spread = _Spread(limits, lower, upper, watched, scanned, turned, elsewhere)
        return self._spread

    def _scanned(self, table: Tables, spread: _Spread, climb_from: Climber) -> Reals:
        """Where the best climb ends of those that begin at the best places all over the joint ranges, far apart."""
        values = self.sign * self._measure(table, spread.scanned)[0]
        ends = [climb_from(spread.scanned[[i]]) for i in best_apart(spread.scanned, values, CLIMBS)]
        best: Reals = max(ends, key=lambda end: end[1])[0]
        return best

    def along(self, tables: Tables) -> Reals:
        """The measure (H,) in mm of many tables where the extreme was attained last."""
        measured: Reals = self._measure(tables, self.q[None])[:, 0] * MM
        return measured

    def _measure(self, tables: Tables, q: Reals) -> Reals:
        measured: Reals = self.quantity.measure(frames_of(tables, self.robot, q))
        return measured

    def _whole(self, q: Reals) -> Reals:
        whole = np.zeros((*q.shape[:-1], self.count))
        whole[..., self.joints] = q
        return whole


class Asked:
    """Requirements beside a robot's table: how far tables are off, in half-widths.

    Attributes
    ----------
    order : the requirements, those that are no extremes first; gaussian : (r,) bool, those with a standard deviation
    sizes, slices : how many components each has, and which; likely : components of those with a standard deviation
    """

    def __init__(self, robot: Robot, requirements: Sequence[Requirement]):
        self.robot, self.requirements = robot, tuple(requirements)
        self.plain = [each for each in requirements if not isinstance(each.quantity, Extreme)]
        self._components = Components(
            robot, [each.quantity for each in self.plain], [each.expected for each in self.plain]
        )
        self.extreme = [
            (each, FollowedExtreme(each.quantity, robot)) for each in requirements if isinstance(each.quantity, Extreme)
        ]
        self.order = (*self.plain, *(each for each, _ in self.extreme))
        half_widths = np.array([each.half_width for each in self.order])
        self.gaussian = np.array([each.gaussian for each in self.order], dtype=bool)
        self.sizes = np.concatenate([self._components.sizes, np.ones(len(self.extreme), dtype=np.int64)])
        self._starts = np.cumsum(self.sizes) - self.sizes
        self._plain_half = np.repeat(half_widths[: len(self.plain)], self._components.sizes)
        self._most = np.where(self.gaussian, LIKELY, 1.0)
        self.slices = [slice(start, start + size) for start, size in zip(self._starts.tolist(), self.sizes.tolist())]
        self.likely = np.flatnonzero(np.repeat(self.gaussian, self.sizes))

    def __len__(self) -> int:
        return len(self.order)

    def off(self, table: Tables, afresh: bool = False) -> Reals:
        """Components (m,) of a table (a batch of one); ``afresh``: extremes are looked for all over the joint
        ranges."""
        extremes = []
        for each, followed in self.extreme:
            followed.known &= not afresh
            extremes.append((followed.at(table) - each.expected) / each.half_width)
        return np.append(self.plain_off(table)[0], extremes)

    def plain_off(self, tables: Tables) -> Reals:
        """Components (H, m) of many tables, of the requirements that are no extremes (the first ones)."""
        if not self.plain:
            return np.empty((len(tables), 0))
        off: Reals = self._components.off(tables) / self._plain_half
        return off

    def plain_violation(self, tables: Tables) -> Reals:
        """Violations (H, r) of many tables, of the requirements that are no extremes (the first ones)."""
        return self.violation(self.plain_off(tables))

    def excluding(self, table: Tables, nominal: Tables) -> tuple[int, ...]:
        """Places of references that a table misses though another one meets them."""
        if not len(self):
            return ()
        violations = [self.violation(self.off(each, afresh=True)) for each in (table, nominal)]
        missed = (violations[0] > SLIGHT) & (violations[1] <= SLIGHT)
        return tuple(i for each, own in zip(self.order, missed) if own for i in each.references)

    def follow(self, places: Sequence[Reals]) -> None:
        """Follow extremes from where they were attained (see ``places``)."""
        for (_, followed), q in zip(self.extreme, places):
            followed.q, followed.known = q, True

    @property
    def places(self) -> tuple[Reals, ...]:
        """Where extremes were attained last."""
        return tuple(followed.q for _, followed in self.extreme)

    def off_near(self, tables: Tables) -> Reals:
        """Components (H, m) of many tables, extremes where they were attained last."""
        extremes = [(followed.along(tables) - each.expected) / each.half_width for each, followed in self.extreme]
        return np.column_stack([self.plain_off(tables), *extremes])

    def slope(self, table: Tables, entries: Sequence[TableNumber]) -> Reals:
        """Derivative (m, k) with respect to entries, in their scales, at the table whose ``off`` was asked for last."""
        k = len(entries)
        scale = np.array([entry.scale for entry in entries])
        steps = SLOPE_STEP * np.concatenate([np.eye(k), -np.eye(k)]) * scale
        off = self.off_near(shifted(table, entries, steps))
        slope: Reals = (off[:k] - off[k:]).T / (2 * SLOPE_STEP)
        return slope

    def kinked(self, table: Tables, entries: Sequence[TableNumber]) -> Flags:
        """Which entries (k,) make an extreme have a kink at a table: it is attained in several places at once there,
        and they take it in different directions."""
        here = self.off(table, afresh=True)
        found = np.zeros(len(entries), dtype=bool)
        for k, entry in enumerate(entries if self.extreme else ()):
            ahead, behind = (
                self.off(shifted(table, [entry], np.array([[sign * KINK_STEP * entry.scale]])), afresh=True)
                for sign in (1, -1)
            )
            found[k] = np.abs(ahead + behind - 2 * here).max() > KINK
        return found

    def violation(self, off: Reals) -> Reals:
        """How far each requirement is exceeded (..., r), in half-widths (or four standard deviations) less one."""
        lengths = self.lengths(off)
        return lengths / self._most[: lengths.shape[-1]] - 1.0

    def lengths(self, off: Reals) -> Reals:
        """Lengths (..., r) of components (..., m) of all requirements, or of those that are no extremes."""
        starts = self._starts[self._starts < off.shape[-1]]
        return np.sqrt(np.add.reduceat(off * off, starts, axis=-1)) if len(starts) else np.empty((*off.shape[:-1], 0))

    def excess(self, off: Reals) -> Reals:
        """How far (...,) the requirement with a half-width that is exceeded most is, in half-widths less one."""
        lengths = self.lengths(off)
        bounded = lengths[..., ~self.gaussian[: lengths.shape[-1]]]
        most: Reals = bounded.max(axis=-1, initial=0.0) - 1.0
        return most

    def outside(self, off: Reals, inner: float) -> Reals:
        """Components (..., m) of what lies outside ``inner`` half-widths; 0 for requirements with a deviation."""
        lengths = self.lengths(off)
        count = lengths.shape[-1]
        share = np.where(lengths > inner, 1.0 - inner / np.maximum(lengths, TINY), 0.0)
        rest: Reals = off * np.repeat(np.where(self.gaussian[:count], 0.0, share), self.sizes[:count], axis=-1)
        return rest
