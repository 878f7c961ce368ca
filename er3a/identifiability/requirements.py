"""The requirements of references on a table's geometry, as smooth functions for an optimiser.

A reference with a half-width requires ``|off| <= half-width``; one with a standard deviation is a term of a likelihood.
Of references that contradict each other, either may be right, so they require only the hull of the values they allow.
Extremes over the joint limits are tracked with the pose at which they are attained: their derivative with respect to
the table is that at the maximiser (envelope theorem).

In this order:

- :class:`Components`: how far many tables are from the references' values, as each quantity measures it
  (:meth:`~er3a.references.quantities.Quantity.off`), those of one kind at once;
- :func:`climber`: kernels that climb to the largest or smallest value of a measure of one arm, from where it was
  attained before, by Newton's method with Levenberg's damping; blocking bounds are held, derivatives are
  central differences;
- :func:`peak`: the largest value of any smooth function over a box of joint angles: from the best of given points
  Newton's method, its Hessian made definite by the absolute values of its eigenvalues. Nothing is random;
- :class:`Asked`: the requirements on a table, and by how much tables miss them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, cast

import numpy as np

from er3a.identifiability.entries import TableNumber, shifted
from er3a.kinematics.table_batch import Tables, fill_frames, frames_of, kernel_columns, tables_of
from er3a.numerics.arrays import Flags, Integers, Reals, copy_values, for_kernel
from er3a.numerics.jit import inner_kernel, kernel
from er3a.numerics.quasi_random import quasi_random_points
from er3a.references import quantities
from er3a.references.predict import TablesState
from er3a.references.reference import Reference, conflicts
from er3a.robots.robot import Robot

Reader = Callable[[quantities.ModelState], Reals]
"""Components (H, n, k) of n quantities of one kind."""


class Components:
    """Quantities, none of them an extreme over the limits, beside what is stated of them.

    Parameters
    ----------
    expected : (n,), in the quantities' units

    Attributes
    ----------
    sizes : (n,), how many components each has
    """

    def __init__(self, robot: Robot, asked: Sequence[quantities.Quantity], expected: Sequence[float]):
        self._state = TablesState(robot, asked)
        kinds: dict[type[quantities.Quantity] | int, list[int]] = {}
        for i, (quantity, value) in enumerate(zip(asked, expected)):
            together = type(quantity) in READERS and not (
                value and isinstance(quantity, quantities.AxisAngle | quantities.SegmentAngle)
            )
            kinds.setdefault(type(quantity) if together else i, []).append(i)
        self._readers = [
            (
                own,
                READERS.get(kind, _alone)([asked[i] for i in own], np.array([expected[i] for i in own]), self._state),
            )
            for kind, own in kinds.items()
        ]
        own_state = self._state.of(tables_of(robot))
        self.sizes = np.zeros(len(asked), dtype=np.int64)
        for own, reader in self._readers:
            self.sizes[own] = reader(own_state).shape[-1]
        starts = (np.cumsum(self.sizes) - self.sizes)[:, None]
        self._columns = [(starts[own] + np.arange(self.sizes[own[0]])).ravel() for own, _ in self._readers]

    def off(self, tables: Tables) -> Reals:
        """Components (H, m), each quantity's side by side, whose length is how far tables are off, in its unit."""
        state = self._state.of(tables)
        off = np.empty((len(tables), int(self.sizes.sum())))
        for columns, (_, reader) in zip(self._columns, self._readers):
            off[:, columns] = reader(state).reshape(len(tables), -1)
        return off


def _alone(asked: list[quantities.Quantity], expected: Reals, states: TablesState) -> Reader:
    return lambda state: asked[0].off(state, float(expected[0]))[:, None]


def _angles(asked: list[quantities.AxisAngle], expected: Reals, states: TablesState) -> Reader:
    joints = np.array([each.joint - 1 for each in asked])
    toward = np.array([each.toward for each in asked])
    signed = np.array([each.signed for each in asked])
    turned = quantities.TurnedApart(toward)

    def read(state: quantities.ModelState) -> Reals:
        axis = state.frames[:, 0][:, joints][..., :3, 2] * state.direction[:, joints, None]
        backward = ~signed & (np.einsum("hni,ni->hn", axis, toward) < 0)
        return turned.from_these(np.where(backward[..., None], -axis, axis))

    return read


def _segments(asked: list[quantities.SegmentAngle], expected: Reals, states: TablesState) -> Reader:
    def read(state: quantities.ModelState) -> Reals:
        return quantities.FROM_UPRIGHT.from_these(np.stack([each.direction(state) for each in asked], axis=1))

    return read


def _axis_points(asked: list[quantities.AxisCoordinate], expected: Reals, states: TablesState) -> Reader:
    joints = np.array([each.joint - 1 for each in asked])
    near = np.array([each.point_mm for each in asked])
    coordinates = np.array([quantities.COORDINATES.index(each.coordinate) for each in asked])
    every = np.arange(len(asked))

    def read(state: quantities.ModelState) -> Reals:
        T = state.frames[:, 0][:, joints]
        axis = T[..., :3, 2] * state.direction[:, joints, None]
        value = quantities.nearest_on_line(axis, T[..., :3, 3] * quantities.MM, near)[:, every, coordinates]
        off: Reals = (value - expected)[..., None]
        return off

    return read


def _points(asked: list[quantities.PointCoordinate], expected: Reals, states: TablesState) -> Reader:
    places = np.array([states.index[each.pose] for each in asked])
    frames = np.array([quantities.FRAME_OF_POINT[each.point] for each in asked])
    coordinates = np.array([quantities.COORDINATES.index(each.coordinate) for each in asked])

    def read(state: quantities.ModelState) -> Reals:
        off: Reals = (state.frames[:, places, frames, coordinates, 3] * quantities.MM - expected)[..., None]
        return off

    return read


def _turns(asked: list[quantities.FlangeTurn], expected: Reals, states: TablesState) -> Reader:
    seen = [(states.index[each.pose], each.stated) for each in asked]
    turns = list(dict.fromkeys(seen))
    places, stated = np.array([place for place, _ in turns]), np.array([each for _, each in turns])
    which = np.array([turns.index(each) for each in seen])
    coordinates = np.array([quantities.COORDINATES.index(each.coordinate) for each in asked])

    def read(state: quantities.ModelState) -> Reals:
        R = state.frames[:, places, quantities.FRAME_OF_POINT["flange"], :3, :3] @ stated.transpose(0, 2, 1)
        off: Reals = (quantities.rotation_vectors_deg(R)[:, which, coordinates] - expected)[..., None]
        return off

    return read


def _sections(asked: list[quantities.SectionCoordinate], expected: Reals, states: TablesState) -> Reader:
    places = np.array([states.index[each.pose] for each in asked])
    along_x = np.array([each.coordinate == "x" for each in asked])
    unsigned = np.array([each.unsigned for each in asked])
    rows, origins = np.where(along_x, 0, 2), np.where(along_x, 0, 1)  # x is counted from axis 1, z from axis 2
    wrist = quantities.FRAME_OF_POINT["wrist_centre"]

    def read(state: quantities.ModelState) -> Reals:
        value = (state.frames[:, places, wrist, rows, 3] - state.frames[:, places, origins, rows, 3]) * quantities.MM
        off: Reals = (np.where(unsigned, np.abs(value), value) - expected)[..., None]
        return off

    return read


READERS: dict[type[quantities.Quantity] | int, Callable[[Any, Reals, TablesState], Reader]] = {
    quantities.AxisAngle: _angles,
    quantities.SegmentAngle: _segments,
    quantities.AxisCoordinate: _axis_points,
    quantities.FlangeTurn: _turns,
    quantities.PointCoordinate: _points,
    quantities.SectionCoordinate: _sections,
}
"""Quantities that are read together; angles only if they are to be 0."""

STEP = 1e-4
STEPS = 40
LONGEST_STEP = 0.5
ENOUGH_M = 1e-9
DISTANCE, SECTION_X, SECTION_Z = 0, 1, 2
FLANGE = quantities.FRAME_OF_POINT["flange"]

Columns = tuple[Reals, Reals, Reals, Reals, Reals, Reals, Flags]
Ends = tuple[Reals, Reals]
"""The base (4, 4), and the flange (3,), m, in the last frame of the table."""
What = tuple[int, int, int, float]
"""Measure, axis, frame and sign."""


def measure_code(quantity: quantities.Extreme) -> tuple[int, int, int]:
    """Which measure, of which axis and frame."""
    frame = quantities.FRAME_OF_POINT[quantity.point]
    if isinstance(quantity, quantities.AxisDistance):
        return DISTANCE, quantity.axis - 1, frame
    return (SECTION_X if cast(quantities.SectionExtent, quantity).coordinate == "x" else SECTION_Z), 0, frame


Climber = Callable[[Reals], tuple[Reals, float]]


def climber(table: Tables, robot: Robot, code: tuple[int, int, int], sign: float, joints: Integers) -> Climber:
    """What climbs to where a measure of a table (a batch of one) is extreme.

    Parameters
    ----------
    robot : whose base and flange the table has
    sign : 1 for the largest, -1 for the smallest value
    joints : (d,), those that are turned

    Returns
    -------
    climber : takes joint vectors (P, n) and climbs from the first and, if another is higher than where that leads, from
        the best of them; gives the joint vector (n,) where that ends, and ``sign`` times the measure there in m
    """
    columns, ends = kernel_columns(table), (for_kernel(robot.base), for_kernel(robot.flange[:3, 3]))
    bounds = np.minimum(table.lower[0], table.upper[0]), np.maximum(table.lower[0], table.upper[0])

    def climb(starts: Reals) -> tuple[Reals, float]:
        q = np.ascontiguousarray(starts)
        value = _climb(ends, columns, bounds, q, joints, (*code, sign))
        return q[0], float(value)

    return climb


@kernel
def _measure(ends: Ends, columns: Columns, q: Reals, what: What, out: tuple[Reals, Reals]) -> None:
    """Fill frames and ``sign`` times the measure (P,) at joint vectors (P, n)."""
    frames, values = out
    base, flange = ends
    a, alpha, beta, d, direction, offset, sliding = columns
    fill_frames(base, a, alpha, beta, d, direction, offset, sliding, q, frames)
    kind, axis, frame, sign = what
    for p in range(q.shape[0]):
        T = frames[0, p]
        x, y, z = T[frame, 0, 3], T[frame, 1, 3], T[frame, 2, 3]
        if frame == FLANGE:
            x += T[frame, 0, 0] * flange[0] + T[frame, 0, 1] * flange[1] + T[frame, 0, 2] * flange[2]
            y += T[frame, 1, 0] * flange[0] + T[frame, 1, 1] * flange[1] + T[frame, 1, 2] * flange[2]
            z += T[frame, 2, 0] * flange[0] + T[frame, 2, 1] * flange[1] + T[frame, 2, 2] * flange[2]
        if kind == SECTION_X:
            values[p] = sign * (x - T[0, 0, 3])
        elif kind == SECTION_Z:
            values[p] = sign * (z - T[1, 2, 3])
        else:
            x, y, z = x - T[axis, 0, 3], y - T[axis, 1, 3], z - T[axis, 2, 3]
            u, v, w = T[axis, 0, 2], T[axis, 1, 2], T[axis, 2, 2]
            values[p] = sign * np.sqrt((v * z - w * y) ** 2 + (w * x - u * z) ** 2 + (u * y - v * x) ** 2)


@kernel
def _climb(
    ends: Ends, columns: Columns, bounds: tuple[Reals, Reals], starts: Reals, joints: Integers, what: What
) -> float:
    count = starts.shape[0]
    frames, values = np.empty((1, count, starts.shape[1] + 1, 4, 4)), np.empty(count)
    best = _from(ends, columns, bounds, starts[0], joints, what)
    if count > 1:
        _measure(ends, columns, starts, what, (frames, values))
        other = 1 + np.argmax(values[1:])
        if values[other] > best + ENOUGH_M:
            second = _from(ends, columns, bounds, starts[other], joints, what)
            if second > best:
                copy_values(starts[other], starts[0])
                best = second
    return best


@inner_kernel
def _from(ends: Ends, columns: Columns, bounds: tuple[Reals, Reals], q: Reals, joints: Integers, what: What) -> float:
    """Climb from q (n,), which is changed to where that leads; the value there."""
    lower, upper = bounds
    n, k = q.shape[0], joints.shape[0]
    points = 1 + 2 * k + k * (k - 1) // 2
    stencil, values = np.empty((points, n)), np.empty(points)
    frames = np.empty((1, points, n + 1, 4, 4))
    trial, trial_value, trial_frames = np.empty((1, n)), np.empty(1), np.empty((1, 1, n + 1, 4, 4))
    slope, curvature = np.empty(k), np.empty((k, k))
    damping, here = 0.0, -np.inf
    for _ in range(STEPS):
        _fill_stencil(q, joints, stencil)
        _measure(ends, columns, stencil, what, (frames, values))
        here = values[0]
        _slope_and_curvature(values, slope, curvature)
        free = np.ones(k, np.bool_)
        for i in range(k):
            j = joints[i]
            free[i] = not ((q[j] <= lower[j] and slope[i] <= 0) or (q[j] >= upper[j] and slope[i] >= 0))
        size = np.abs(curvature).max() + 1e-9
        gained = 0.0
        for _ in range(8):
            step, definite = _damped(slope, curvature, free, damping * size)
            if definite:
                longest = np.abs(step).max()
                share = min(1.0, LONGEST_STEP / longest) if longest > 0 else 0.0
                copy_values(q, trial[0])
                for i in range(k):
                    j = joints[i]
                    trial[0, j] = min(max(q[j] + share * step[i], lower[j]), upper[j])
                _measure(ends, columns, trial, what, (trial_frames, trial_value))
                gained = trial_value[0] - here
                if gained > 0:
                    break
            damping = max(4 * damping, 1e-3)
        if gained <= ENOUGH_M:
            if gained > 0:
                copy_values(trial[0], q)
                here = trial_value[0]
            break
        copy_values(trial[0], q)
        here = trial_value[0]
        damping = damping / 8 if damping > 1e-3 else 0.0
    return here


@inner_kernel
def _fill_stencil(q: Reals, joints: Integers, stencil: Reals) -> None:
    k = joints.shape[0]
    at = 1 + 2 * k
    for i in range(stencil.shape[0]):
        copy_values(q, stencil[i])
    for i in range(k):
        stencil[1 + i, joints[i]] += STEP
        stencil[1 + k + i, joints[i]] -= STEP
        for j in range(i):
            stencil[at, joints[i]] += STEP
            stencil[at, joints[j]] += STEP
            at += 1


@inner_kernel
def _slope_and_curvature(values: Reals, slope: Reals, curvature: Reals) -> None:
    k = slope.shape[0]
    at = 1 + 2 * k
    for i in range(k):
        slope[i] = (values[1 + i] - values[1 + k + i]) / (2 * STEP)
        curvature[i, i] = (values[1 + i] - 2 * values[0] + values[1 + k + i]) / STEP**2
        for j in range(i):
            curvature[i, j] = (values[at] - values[1 + i] - values[1 + j] + values[0]) / STEP**2
            curvature[j, i] = curvature[i, j]
            at += 1


@inner_kernel
def _damped(slope: Reals, curvature: Reals, free: Flags, damping: float) -> tuple[Reals, bool]:
    """Step uphill by (damping - curvature)^-1 slope over the free joints, and whether that matrix is definite."""
    k = slope.shape[0]
    low = np.zeros((k, k))
    step = np.zeros(k)
    for i in range(k):
        for j in range(i + 1):
            total = (damping if i == j else 0.0) - curvature[i, j]
            if not (free[i] and free[j]):
                total = 1.0 if i == j else 0.0
            for m in range(j):
                total -= low[i, m] * low[j, m]
            if i == j:
                if total <= 1e-12:
                    return step, False
                low[i, i] = np.sqrt(total)
            else:
                low[i, j] = total / low[j, j]
    for i in range(k):
        total = slope[i] if free[i] else 0.0
        for m in range(i):
            total -= low[i, m] * step[m]
        step[i] = total / low[i, i]
    for i in range(k - 1, -1, -1):
        total = step[i]
        for m in range(i + 1, k):
            total -= low[m, i] * step[m]
        step[i] = total / low[i, i]
    return step, True


Function = Callable[[Reals], Reals]
"""Values (P,) at points (P, d)."""
SCAN = 384
CORNERS_UP_TO = 6
STARTS = 3
PEAK_STEPS = 25
GAINS_NOTHING = 1e-10
SHARES = np.array([1.0, 0.5, 0.2, 0.05, 0.01])


def box_points(lower: Reals, upper: Reals, count: int = SCAN) -> Reals:
    """Points (P, d) all over a box, with its middle and, of few dimensions, its corners."""
    points = [quasi_random_points(lower, upper, count), (lower + upper)[None] / 2]
    if len(lower) <= CORNERS_UP_TO:
        points.append(np.array(list(product(*zip(lower, upper)))))
    return np.concatenate(points)


def peak(function: Function, lower: Reals, upper: Reals, points: Reals) -> tuple[Reals, float]:
    """Where a function is largest, and its value there; ``points`` (P, d): where to look first."""
    starts = points[best_apart(points, function(points), STARTS)]
    ends = [climb(function, start, lower, upper) for start in starts]
    return max(ends, key=lambda end: end[1])


def climb(function: Function, q: Reals, lower: Reals, upper: Reals) -> tuple[Reals, float]:
    """From a point up to the next maximum: the point and its value."""
    offsets = _stencil(len(q))
    here = -np.inf
    for _ in range(PEAK_STEPS):
        values = function(q + offsets)
        here = float(values[0])
        slope, curvature = _derivatives(values, len(q))
        held = ((q <= lower) & (slope <= 0)) | ((q >= upper) & (slope >= 0))
        free = ~held
        if not free.any() or np.abs(slope[free]).max() < GAINS_NOTHING:
            break
        step = np.zeros(len(q))
        step[free] = _newton(slope[free], curvature[np.ix_(free, free)])
        trials = np.clip(q + SHARES[:, None] * step, lower, upper)
        reached = function(trials)
        best = int(np.argmax(reached))
        if not reached[best] > here + GAINS_NOTHING:
            break
        q, here = trials[best], float(reached[best])
    return q, here


def best_apart(points: Reals, values: Reals, count: int) -> list[int]:
    """Places of up to ``count`` points (P, d) with the largest values (P,), none near a better one."""
    order = np.argsort(-values, kind="stable")
    chosen: list[int] = []
    for i in order:
        if all(np.abs(points[i] - points[k]).max() > LONGEST_STEP for k in chosen):
            chosen.append(int(i))
        if len(chosen) == count:
            break
    return chosen


def _newton(slope: Reals, curvature: Reals) -> Reals:
    values, vectors = np.linalg.eigh(curvature)
    size = np.maximum(np.abs(values), 1e-3 * max(float(np.abs(values).max()), float(np.abs(slope).max())) + 1e-12)
    step: Reals = vectors @ ((vectors.T @ slope) / size)
    length = float(np.linalg.norm(step))
    return step * min(1.0, LONGEST_STEP / length) if length else step


def _stencil(d: int) -> Reals:
    unit = STEP * np.eye(d)
    pairs = [unit[i] + unit[j] for i in range(d) for j in range(i)]
    return np.concatenate([np.zeros((1, d)), unit, -unit, np.array(pairs).reshape(-1, d)])


def _derivatives(values: Reals, d: int) -> tuple[Reals, Reals]:
    here, up, down, pairs = values[0], values[1 : d + 1], values[d + 1 : 2 * d + 1], values[2 * d + 1 :]
    slope = (up - down) / (2 * STEP)
    curvature = np.diag((up - 2 * here + down) / STEP**2)
    at = 0
    for i in range(d):
        for j in range(i):
            curvature[i, j] = curvature[j, i] = (pairs[at] - up[i] - up[j] + here) / STEP**2
            at += 1
    return slope, curvature


LIKELY = 4.0  # standard deviations, beyond which a discrete alternative is excluded
SLIGHT = 1e-3  # of a half-width
SLOPE_STEP = 1e-3  # of an entry's scale
SCANNED, WATCHED, OVERTAKEN_M = 512, 48, 1e-9
ACROSS, OVERTAKINGS, CLIMBS = np.linspace(0.0, 1.0, 9), 4, 6
TINY = 1e-300
KINK_STEP, KINK = 1.0, 1.0  # of an entry's scale, and of a half-width


@dataclass(frozen=True)
class Requirement:
    """One required number.

    Attributes
    ----------
    half_width : or the standard deviation, if ``gaussian``
    references : places of the references that ask for it
    """

    quantity: quantities.Quantity
    expected: float
    half_width: float
    gaussian: bool
    references: tuple[int, ...]


def requirements_of(references: Sequence[Reference]) -> list[Requirement]:
    """What references ask of a table; those about limits and speeds ask nothing of it."""
    asked = {
        i: reference
        for i, reference in enumerate(references)
        if reference.expected is not None and reference.quantity.depends_on_table
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
    if all(type(references[i].quantity).apart is quantities.Quantity.apart for i in places):
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

    def __init__(self, quantity: quantities.Extreme, robot: Robot):
        self.quantity, self.robot = quantity, robot
        self.count = len(robot.a)
        moving = quantities.FRAME_OF_POINT[quantity.point] % (self.count + 1)
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
        return self.sign * value * quantities.MM

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
        measured: Reals = self._measure(tables, self.q[None])[:, 0] * quantities.MM
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
        self.plain = [each for each in requirements if not isinstance(each.quantity, quantities.Extreme)]
        self._components = Components(
            robot, [each.quantity for each in self.plain], [each.expected for each in self.plain]
        )
        self.extreme = [
            (each, FollowedExtreme(each.quantity, robot))
            for each in requirements
            if isinstance(each.quantity, quantities.Extreme)
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
        """Components (m,) of a table (a batch of one); ``afresh``: extremes are searched for all over the joint
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
        """Derivative (m, k) with respect to entries, in their scales, at the table whose ``off`` was computed last."""
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
