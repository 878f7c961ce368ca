"""Which arm angle a seven-joint arm takes along a path of the tool: that which keeps most distance from the limits.

The arm angle is a polynomial of degree 2 in the share of the way, told by its values at the start, half way and at the
end. Margins of all eight solutions on a grid of ways and arm angles tell which of many such polynomials keeps most;
that one is improved by smaller and smaller changes. Where none of these keeps the limits, polynomials of higher degree
are fitted to a way through the grid: the evenest of those that keep half of the margin that any can keep. Nothing is
proven by this choice: what the joints then do is judged exactly, as for every other motion, and a path could in
principle be followed by a law of another form.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import chebyshev

from er3a.geometry.angles import TURN
from er3a.kinematics.by_class import class_rows
from er3a.numerics.arrays import Integers, Reals
from er3a.numerics.jit import kernel
from er3a.robots.joint_limits import limit_margin, nearest_equivalent
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import shortest_way, take_turns_off, turns_inward, whole_turns

ANGLES = 72  # of the grid, over a turn
BEGUN_AT, FEW_CHANGES = 24, 13  # arm angles at the start where none is given; then changes from it
CHANGES = 25  # from the start to half way and to the end, up to half a turn
LEAP = 0.6  # rad, m, that a joint may move between two of the poses; a turn more, or a singularity, would be more
SLOPE_PRICE = 1e-3  # rad of margin that a change by 1 rad has to gain
ROUNDS, FIRST_STEP = 7, np.radians(7.5)
DEGREES, STEPS = (4, 6, 8, 10, 12), np.arange(-3, 4)  # of bent laws; steps of the grid between two poses


@dataclass(frozen=True, eq=False)
class ArmAngleLaw:
    """An arm angle along a path: values (3,), rad, at the start, half way and at the end, or Chebyshev series (k,) of a
    ``bent`` one over the way.

    ``slot`` is the solution that keeps the least distance ``margin`` (rad, m) from the joint limits.
    """

    values: Reals
    slot: int
    margin: float
    bent: bool = False

    def at(self, share: Reals) -> Reals:
        """Arm angles (N, 1) at shares (N,) of the way."""
        if self.bent:
            return np.asarray(chebyshev.chebval(2 * share - 1, self.values), dtype=float)[:, None]
        return _quadratic(self.values, share)[:, None]


def roomiest_laws(
    robot: Robot, T: Reals, share: Reals, start: tuple[float, Reals] | None, slots: Integers
) -> list[ArmAngleLaw]:
    """The best law of each slot, most margin first; slots that don't reach all poses are left out.

    Parameters
    ----------
    T : (K, 4, 4), poses of the tool, m, at shares (K,) of the way
    start : the arm angle at the start, rad, and the joints (n,), rad; None leaves them open, whole turns too
    slots : (s,), those that may be taken
    """
    search = _LawSearch(robot, T, share, slots, None if start is None else start[1])
    begun = -np.pi + TURN * np.arange(BEGUN_AT) / BEGUN_AT if start is None else np.array([start[0]])
    changes = np.linspace(-np.pi, np.pi, FEW_CHANGES if start is None else CHANGES)
    first, middle, last = (part.ravel() for part in np.meshgrid(begun, changes, changes, indexing="ij"))
    laws = np.stack([first, first + middle, first + last], axis=1)
    priced = search.on_grid(laws) - SLOPE_PRICE * (np.abs(middle) + np.abs(last - middle))[:, None]
    found = []
    for s, slot in enumerate(slots.tolist()):
        best = laws[int(priced[:, s].argmax())]
        law = _improved(search, s, ArmAngleLaw(best, slot, search.margin(_quadratic(best, share), s)))
        if np.isfinite(law.margin):
            found.append(law)
    return sorted(found, key=lambda law: -law.margin)


def bent_laws(
    robot: Robot, T: Reals, share: Reals, start: tuple[float, Reals] | None, slots: Integers
) -> list[ArmAngleLaw]:
    """Laws of higher degree that keep the limits at the poses, most margin first; the rest as :func:`roomiest_laws`."""
    search = _LawSearch(robot, T, share, slots, None if start is None else start[1])
    first = -np.pi if start is None else start[0]
    q = search.rows(first + TURN * np.arange(ANGLES) / ANGLES)
    margins = _margins_alone(robot, q)
    if start is not None:
        margins[0, 1:] = -np.inf
    weights = np.where(np.arange(len(share)) == 0, 1e3, 1.0)  # the start may be given
    found = []
    for s, slot in enumerate(slots.tolist()):
        way = _even_way(robot, margins[:, :, s], q[:, :, s])
        if way is None:
            continue
        angles = first + TURN / ANGLES * way
        for degree in DEGREES:
            values = np.asarray(chebyshev.chebfit(2 * share - 1, angles, degree, w=weights), dtype=float)
            values[0] += angles[0] - chebyshev.chebval(-1.0, values)
            law = ArmAngleLaw(values, slot, 0.0, bent=True)
            least = search.margin(law.at(share)[:, 0], s)
            if least > 0:
                found.append(replace(law, margin=least))
    return sorted(found, key=lambda law: -law.margin)


def _margins_alone(robot: Robot, q: Reals) -> Reals:
    """Distances of rows (..., n) from the joint limits, each in its best turn; -inf without a row."""
    middle = np.where(robot.continuous, 0.0, 0.5 * (robot.lower + robot.upper))
    turned = nearest_equivalent(robot, np.nan_to_num(q), middle)
    return np.where(np.isnan(q[..., 0]), -np.inf, limit_margin(robot, turned))


def _even_way(robot: Robot, margins: Reals, q: Reals) -> Reals | None:
    """Steps of the grid (K,) from its first angle, not taken modulo a turn, along the way with the least sum of squared
    steps that keeps half of the margin that one can keep; None if none keeps the limits.

    Parameters
    ----------
    margins : (K, angles); q : (K, angles, n), rad, m
    """
    at = np.arange(margins.shape[1])
    before = (at[None] - STEPS[:, None]) % len(at)  # (steps, angles)
    moved = [shortest_way(robot, q[k][None] - q[k - 1][before]) for k in range(1, len(q))]
    free = [np.abs(each).max(axis=-1) <= LEAP for each in moved]  # not where there is no row
    widest = margins[0]
    for k, passable in enumerate(free, 1):
        widest = np.minimum(margins[k], np.where(passable, widest[before], -np.inf).max(axis=0))
    if not widest.max() > 0:
        return None
    allowed = margins >= widest.max() / 2
    price, taken = np.where(allowed[0], 0.0, np.inf), []
    for k, passable in enumerate(free, 1):
        prices = np.where(passable, price[before] + STEPS[:, None] ** 2, np.inf)
        taken.append(prices.argmin(axis=0))
        price = np.where(allowed[k], prices.min(axis=0), np.inf)
    place, steps = int(price.argmin()), []
    for choice in reversed(taken):
        steps.append(int(STEPS[choice[place]]))
        place = (place - steps[-1]) % len(at)
    return place + np.concatenate([[0.0], np.cumsum(steps[::-1])])


@dataclass(frozen=True, eq=False)
class _LawSearch:
    """Margins of laws at poses T (K, 4, 4) and shares (K,), by slots (s,); ``start`` (n,), rad, holds the joints' turns
    at the start, None leaves them open."""

    robot: Robot
    T: Reals
    share: Reals
    slots: Integers
    start: Reals | None

    def rows(self, angles: Reals) -> Reals:
        """Joints (K, A, s, n) of all poses at all arm angles (A,); NaN where there are none."""
        count = len(angles)
        q = class_rows(self.robot, np.repeat(self.T, count, axis=0), np.tile(angles, len(self.T))[:, None]).q
        return q.reshape(len(self.T), count, *q.shape[1:])[:, :, self.slots]

    def on_grid(self, laws: Reals) -> Reals:
        """About the margins (L, s) of laws (L, 3), by the nearest of ``ANGLES`` arm angles."""
        angles = _quadratic(laws.T[:, None], self.share[:, None])
        place = np.round((angles + np.pi) * ANGLES / TURN).astype(np.int64) % ANGLES
        return self._margins(self.rows(-np.pi + TURN * np.arange(ANGLES) / ANGLES), place)

    def margin(self, angles: Reals, s: int) -> float:
        """The margin of arm angles (K,) by the slot of this number, as :class:`ArmAngleLaw` has it."""
        q = class_rows(self.robot, self.T, angles[:, None]).q
        return float(self._margins(q[:, None, self.slots[s : s + 1]], np.zeros((len(q), 1), np.int64))[0, 0])

    def _margins(self, q: Reals, place: Integers) -> Reals:
        """Least distances (L, s) from the limits, rad, of motions through rows (K, A, s, n) at places (K, L) in A: by
        turns that hold on the whole way. Less than nothing where a joint leaps, -inf where a pose is not reached."""
        robot, count = self.robot, self.robot.joints
        turns = whole_turns(robot)
        near = np.zeros(count) if self.start is None else self.start
        low, high, step = _ranges(np.ascontiguousarray(q), place, near, (turns.steps, turns.counts), turns.lines)
        if self.start is None:
            rows = (values.reshape(-1, len(turns.lines)) for values in (low, high))
            turned = turns_inward(robot, *rows).reshape(*step.shape, count) @ turns.lines.T
            low, high = low + turned, high + turned
        each = np.minimum(low - turns.lower, turns.upper - high)
        return np.where(
            np.isinf(step), -np.inf, np.minimum(each.min(axis=-1), np.where(step > LEAP, LEAP - step, np.inf))
        )


def _quadratic(values: Reals, share: Reals) -> Reals:
    """Lagrange's polynomial through values (3, ...) at shares 0, 1/2 and 1."""
    a, b, c = values
    return np.asarray(
        a * (2 * share - 1) * (share - 1) + 4 * b * share * (1 - share) + c * share * (2 * share - 1), dtype=float
    )


@kernel
def _ranges(
    q: Reals, place: Integers, near: Reals, turns: tuple[Reals, Reals], lines: Reals
) -> tuple[Reals, Reals, Reals]:
    """Least and greatest values (L, s, m) of lines (m, n) of joints, through rows (K, A, s, n) at places (K, L), made
    continuous by whole turns (steps (n, r), counts (r, n)) from those nearest to ``near`` (n,) on; and the greatest
    step (L, s) of a joint, infinite where there is no row."""
    poses, _, slots, joints = q.shape
    shape = (place.shape[1], slots, len(lines))
    low, high, most = np.full(shape, np.inf), np.full(shape, -np.inf), np.zeros(shape[:2])
    last, step = np.empty(joints), np.empty(joints)
    for law in range(shape[0]):
        for slot in range(slots):
            last[:] = near
            for k in range(poses):
                row = q[k, place[k, law], slot]
                if np.isnan(row[0]):
                    most[law, slot] = np.inf
                    break
                for j in range(joints):
                    step[j] = row[j] - last[j]
                take_turns_off(step, turns)
                for j in range(joints):
                    last[j] += step[j]
                    if k > 0:
                        most[law, slot] = max(most[law, slot], abs(step[j]))
                for line in range(shape[2]):
                    value = 0.0
                    for j in range(joints):
                        value += lines[line, j] * last[j]
                    low[law, slot, line] = min(low[law, slot, line], value)
                    high[law, slot, line] = max(high[law, slot, line], value)
    return low, high, most


def _improved(search: _LawSearch, s: int, law: ArmAngleLaw) -> ArmAngleLaw:
    """The law of the slot of number ``s`` after changes of its values, one at a time, by steps that are halved."""
    step = FIRST_STEP
    for _ in range(ROUNDS):
        for k in range(0 if search.start is None else 1, 3):
            for sign in (1.0, -1.0):
                values = law.values.copy()
                values[k] += sign * step
                margin = search.margin(_quadratic(values, search.share), s)
                if margin > law.margin + SLOPE_PRICE * step:
                    law = ArmAngleLaw(values, law.slot, margin)
        step *= 0.5
    return law
