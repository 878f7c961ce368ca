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
from er3a.robots.joint_limits import limit_margin, nearest_equivalent
from er3a.robots.robot import Robot

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


def roomiest_laws(robot: Robot, T: Reals, share: Reals, start: float | None, slots: Integers) -> list[ArmAngleLaw]:
    """The best law of each slot, most margin first; slots that don't reach all poses are left out.

    Parameters
    ----------
    T : (K, 4, 4), poses of the tool, m, at shares (K,) of the way
    start : the arm angle at the start, rad; None leaves it open
    slots : (s,), those that may be taken
    """
    grid = -np.pi + TURN * np.arange(ANGLES) / ANGLES
    margins, q = _rows(robot, np.repeat(T, ANGLES, axis=0), np.tile(grid, len(T)))
    margins = margins.reshape(len(T), ANGLES, -1)[..., slots]
    q = q.reshape(len(T), ANGLES, -1, robot.joints)[:, :, slots]
    begun = -np.pi + TURN * np.arange(BEGUN_AT) / BEGUN_AT if start is None else np.array([start])
    changes = np.linspace(-np.pi, np.pi, FEW_CHANGES if start is None else CHANGES)
    first, middle, last = (part.ravel() for part in np.meshgrid(begun, changes, changes, indexing="ij"))
    laws = np.stack([first, first + middle, first + last], axis=1)
    least, before = np.full((len(laws), len(slots)), np.inf), None
    for k, at in enumerate(share):
        place = np.round((_quadratic(laws.T, np.full(len(laws), at)) + np.pi) * ANGLES / TURN).astype(int) % ANGLES
        least = np.minimum(least, margins[k, place])
        if before is not None:
            least = np.minimum(least, _leap(q[k, place], before))
        before = q[k, place]
    priced = least - SLOPE_PRICE * (np.abs(middle) + np.abs(last - middle))[:, None]
    found = []
    for s, slot in enumerate(slots.tolist()):
        best = laws[int(priced[:, s].argmax())]
        law = _improved(robot, T, share, ArmAngleLaw(best, slot, _least(robot, T, share, best, slot)), start is None)
        if np.isfinite(law.margin):
            found.append(law)
    return sorted(found, key=lambda law: -law.margin)


def bent_laws(robot: Robot, T: Reals, share: Reals, start: float | None, slots: Integers) -> list[ArmAngleLaw]:
    """Laws of higher degree that keep the limits at the poses, most margin first; the rest as :func:`roomiest_laws`."""
    first = -np.pi if start is None else start
    grid = first + TURN * np.arange(ANGLES) / ANGLES
    margins, q = _rows(robot, np.repeat(T, ANGLES, axis=0), np.tile(grid, len(T)))
    margins = margins.reshape(len(T), ANGLES, -1)
    q = q.reshape(len(T), ANGLES, -1, robot.joints)
    if start is not None:
        margins[0, 1:] = -np.inf
    found = []
    for slot in slots.tolist():
        way = _even_way(margins[:, :, slot], q[:, :, slot])
        if way is None:
            continue
        angles = first + TURN / ANGLES * way
        weights = np.where(np.arange(len(share)) == 0, 1e3, 1.0)  # the start may be given
        for degree in DEGREES:
            values = np.asarray(chebyshev.chebfit(2 * share - 1, angles, degree, w=weights), dtype=float)
            values[0] += angles[0] - chebyshev.chebval(-1.0, values)
            law = ArmAngleLaw(values, slot, 0.0, bent=True)
            rows, joints = _rows(robot, T, law.at(share)[:, 0])
            least = min(rows[:, slot].min(), _leap(joints[1:, slot], joints[:-1, slot]).min())
            if least > 0:
                found.append(replace(law, margin=float(least)))
    return sorted(found, key=lambda law: -law.margin)


def _even_way(margins: Reals, q: Reals) -> Reals | None:
    """Steps of the grid (K,) from its first angle, not taken modulo a turn, along the way with the least sum of squared
    steps that keeps half of the margin that one can keep; None if none keeps the limits.

    Parameters
    ----------
    margins : (K, angles); q : (K, angles, n), rad, m
    """
    at = np.arange(margins.shape[1])
    before = (at[None] - STEPS[:, None]) % len(at)  # (steps, angles)
    free = [np.abs(q[k][None] - q[k - 1][before]).max(axis=-1) <= LEAP for k in range(1, len(q))]
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


def _quadratic(values: Reals, share: Reals) -> Reals:
    """Lagrange's polynomial through values (3, ...) at shares 0, 1/2 and 1."""
    a, b, c = values
    return np.asarray(
        a * (2 * share - 1) * (share - 1) + 4 * b * share * (1 - share) + c * share * (2 * share - 1), dtype=float
    )


def _rows(robot: Robot, T: Reals, angles: Reals) -> tuple[Reals, Reals]:
    """Distances (N, slots) of all solutions from the joint limits, -inf without one, and the joints (N, slots, n), each
    in its best turn."""
    q = class_rows(robot, T, angles[:, None]).q
    middle = np.where(robot.continuous, 0.0, 0.5 * (robot.lower + robot.upper))
    q, missing = nearest_equivalent(robot, np.nan_to_num(q), middle), np.isnan(q[..., 0])
    return np.where(missing, -np.inf, limit_margin(robot, q)), q


def _leap(q: Reals, before: Reals) -> Reals:
    """Less than nothing where a joint leaps between rows (..., n); infinite elsewhere."""
    step = np.abs(q - before).max(axis=-1)
    return np.where(step > LEAP, LEAP - step, np.inf)


def _least(robot: Robot, T: Reals, share: Reals, values: Reals, slot: int) -> float:
    margins, q = _rows(robot, T, _quadratic(values, share))
    return float(min(margins[:, slot].min(), _leap(q[1:, slot], q[:-1, slot]).min(initial=np.inf)))


def _improved(robot: Robot, T: Reals, share: Reals, law: ArmAngleLaw, with_start: bool) -> ArmAngleLaw:
    """The law after changes of its values, one at a time, by steps that are halved."""
    step = FIRST_STEP
    for _ in range(ROUNDS):
        for k in range(0 if with_start else 1, 3):
            for sign in (1.0, -1.0):
                values = law.values.copy()
                values[k] += sign * step
                margin = _least(robot, T, share, values, law.slot)
                if margin > law.margin + SLOPE_PRICE * step:
                    law = ArmAngleLaw(values, law.slot, margin)
        step *= 0.5
    return law
