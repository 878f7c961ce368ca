"""Proven bounds of an arm's motion between the solved points of a tool path.

With q(s) the joints along the share s of the path, J q' = v, where v is the tool's twist per unit of s (its linear part
divided by a characteristic length). From one solved pose the motion is continued by bounds alone: as long as the joints
have turned by little, the inverse of J has grown by little, so that::

    |q''| <= B (|v'| + C V^2),   |q'''| <= B (|v''| + 3 C V A + C V^3),   B = b / (1 - b sqrt(n) C h V),
    |q''''| <= B (|v'''| + C (4 V Z + 3 A^2 + 6 V^2 A + V^4)),

with b the norm of the inverse at the pose solved, h the path from there, V, A, Z sums over the joints of the sizes of
q', q'', q''', and C the largest length of a column of J (turning an earlier joint turns a column, turning a later one
turns its lever: no derivative of a column is longer). Under a coupling u = c q, V is the sum of the rows' rates, C is
of the rows' columns, and the norm of c goes with sqrt(n). Where the bound on q'' that is put in comes out no greater,
the motion exists over the whole interval, on one branch and without a singular pose [1]_; Taylor's formula then bounds
angles, speeds, accelerations and distances from singular sets on it, and the bound on q'''' how far jerks are from the
mean of the interval. An interval whose bounds decide too little is halved. What is still open at the shortest intervals
is *undecided*.

References
----------
.. [1] J. M. Ortega, W. C. Rheinboldt, *Iterative Solution of Nonlinear Equations in Several Variables*, section 10.4.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.by_value import ByValue, Finding
from er3a.kinematics.chain import arm_length
from er3a.kinematics.forward import frames, jacobian
from er3a.kinematics.singularity import TYPES, NearSingular, SingularityType, characteristic_length, determinant_factors
from er3a.kinematics.wrist_partitioned import wrist_partition_missing
from er3a.numerics.arrays import Flags, Reals, runs
from er3a.planning.follow import Followed, follow
from er3a.planning.motion_faults import (
    ELBOW_JOINT,
    WRIST_JOINT,
    Interval,
    RateLimit,
    factor_forms,
    singular_events,
)
from er3a.planning.moves import ToolPath
from er3a.planning.piecewise import PiecewiseMotion, max_between, polynomial_motion
from er3a.planning.profiles import TimeLaw, times_at
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import LIMIT_TOLERANCE

SHORTEST = 1e-9  # share of the duration
SHORTEST_JERK = 2e-7  # share of the duration; below, jerks are differences of equal numbers
SETTLED_ELSEWHERE = 1e-5  # share of the duration: shortest interval for what another interval breaks already
BESIDE_EVENT = 2e-3, 1e-4  # shares of the duration: so near to a known singular pose no interval is made shorter
# than that, nor where start, middle and end are singular
MAX_INTERVALS = 240_000
MANY_INTERVALS = 4_000  # beyond which means of jerks, which take two more poses each, pay
FIRST_INTERVALS = 64
GROWN = 0.5  # b sqrt(n) C h V up to which a motion is continued
ATTEMPTS = 3
MAX_ROUNDS = 3
BLURRED = 1e-9  # relative, rounding of second derivatives by differences of the Jacobian
STEP_ASIDE = 1e-10  # share of the duration

Quantity = Literal["singular", "limits", "speed", "acceleration", "jerk", "near"]
QUANTITIES: tuple[Quantity, ...] = ("singular", "limits", "speed", "acceleration", "jerk", "near")
RATES = slice(2, 5)


class Undecided(Finding):
    """What the bounds do not settle."""

    quantity: Quantity


@dataclass(frozen=True, eq=False)
class ToolProof(ByValue):
    """What is known of all times of a followed path.

    Attributes
    ----------
    times : (m + 1,), s, rising: ends of the intervals
    proven : (m,) bool, whether the arm follows the path over the interval, without a singular pose
    velocity, acceleration : (m, n), bounds of their sizes, rad/s and rad/s^2; infinite where nothing is proven
    t, q : (k,) s and (k, n) rad, the ends and middles of all intervals; q NaN where unreachable
    middles, rates : the middles (m,) in s, with velocity and acceleration there, (m, 2, n)
    jerk : (m, n), rad/s^3, met in each interval, where a limit of jerk is to be settled; else 0
    steps : times (k,) in s at which the acceleration steps, and by how much, (k, n) in rad/s^2; the same
    undecided : stretches, and what is open there; a rate is not where its limit is exceeded elsewhere
    beside : the same next to the times at which the path is said to be singular, or to end: it settles what is open
        there only if whoever judges the path finds it so
    """

    times: Reals
    proven: Flags
    velocity: Reals
    acceleration: Reals
    t: Reals
    q: Reals
    middles: Reals
    rates: Reals
    jerk: Reals
    steps: tuple[Reals, Reals]
    undecided: tuple[Interval[Undecided], ...]
    beside: tuple[Interval[Undecided], ...]

    def rate_bounds(self, start: Reals, end: Reals) -> tuple[Reals, Reals]:
        """As :meth:`er3a.planning.piecewise.PiecewiseMotion.rate_bounds`."""
        last = len(self.proven) - 1
        first = np.clip(np.searchsorted(self.times, start, side="right") - 1, 0, last)
        final = np.clip(np.searchsorted(self.times, end, side="left") - 1, first, last)
        return max_between(self.velocity, first, final), max_between(self.acceleration, first, final)


@dataclass(frozen=True, eq=False)
class ProofRequirements:
    """What is to be settled: limits of rates, and the distances of near passes."""

    rates: tuple[RateLimit, ...]
    near: NearSingular


@dataclass(frozen=True, eq=False)
class _Bounds:
    """Over intervals (k,): angles' change, sizes of rates (k, n), and whether the motion was continued.

    ``blur`` (k,) is by how much rounding may falsify second derivatives.
    """

    proven: Flags
    change: Reals
    first: Reals
    second: Reals
    third: Reals
    fourth: Reals
    blur: Reals


@dataclass(frozen=True, eq=False)
class _Settled:
    """What came of intervals (k,): flags (k, quantities) of what is open and what is broken, bounds and middles."""

    start: Reals
    end: Reals
    proven: Flags
    open: Flags
    broken: Flags
    velocity: Reals
    acceleration: Reals
    q: Reals
    rates: Reals
    jerk: Reals

    def part(self, wanted: Flags) -> _Settled:
        """Some of the intervals."""
        return _Settled(*(getattr(self, name)[wanted] for name in self.__dataclass_fields__))


def follow_and_prove(
    robot: Robot,
    line: ToolPath,
    t: Reals,
    required: ProofRequirements,
    q_start: Reals | None = None,
    start_slot: int | None = None,
) -> tuple[Followed, ToolProof]:
    """Follow a path (:func:`er3a.planning.follow.follow`), and settle it.

    Where a pose proves out of reach between others that are not, the path is followed again with that pose among them.
    """
    for _ in range(MAX_ROUNDS):
        followed = follow(robot, line, t, q_start, start_slot)
        events = singular_events(robot, followed.t, followed.q, followed.joints, required.near)
        beyond = np.flatnonzero(np.diff(np.isnan(followed.q[:, 0])))
        known = [
            [time for event in events if event.crossing for time in (event.t, event.until)],
            [jump.t for jump in followed.jumps],
            followed.t[beyond],
        ]
        proof = prove(followed, required, np.unique(np.concatenate([np.asarray(part, float) for part in known])))
        lost = np.isnan(proof.q[:, 0])
        after = np.clip(np.searchsorted(followed.t, proof.t), 1, len(followed.t) - 1)
        reached = np.isfinite(followed.q[:, 0])
        lost &= reached[after] & reached[after - 1]
        if not lost.any():
            break
        t = np.union1d(followed.t, proof.t[lost])
    return followed, proof


def prove(followed: Followed, required: ProofRequirements, singular: Reals) -> ToolProof:
    """Settle a followed path.

    Parameters
    ----------
    singular : (k,), s, times at which the path is known to be singular or to end: there nothing can be proven
    """
    law = followed.line.law
    duration = followed.line.duration
    progress = law_motion(law)
    breaks = [followed.t, np.linspace(0, duration, FIRST_INTERVALS), law.breaks]
    edges = np.unique(np.concatenate([*breaks, times_at(law, followed.line.edges)]))
    edges = edges[np.concatenate([[True], np.diff(edges) > SHORTEST * duration])]
    edges[-1] = duration
    start, end = edges[:-1], edges[1:]
    done: list[_Settled] = []
    count, broken = 0, np.zeros(len(QUANTITIES), bool)
    asks_jerk = any(limit.order == 3 for limit in required.rates)
    while len(start):
        by_means = asks_jerk or count > MANY_INTERVALS
        found = _settle(followed, required, (progress, by_means), start, end)
        count += len(start)
        broken |= found.broken.any(axis=0)
        smallest = np.where(broken, SETTLED_ELSEWHERE, SHORTEST) * duration
        smallest[4] = max(SHORTEST_JERK * duration, smallest[4])
        smallest[0] = (SETTLED_ELSEWHERE if broken.any() else SHORTEST) * duration
        hopeless = (_distance(singular, start, end) < BESIDE_EVENT[0] * duration) | _singular_throughout(
            followed, found
        )
        shortest = np.where(hopeless[:, None], np.maximum(smallest, BESIDE_EVENT[1] * duration), smallest)
        again = (found.open & ((end - start)[:, None] > 2 * shortest)).any(axis=1) & (count <= MAX_INTERVALS)
        done.append(found.part(~again))
        middle = (start + end)[again] / 2
        start = np.concatenate([start[again], middle])
        end = np.concatenate([middle, end[again]])
    for part in done:
        part.open[:, RATES] &= ~broken[RATES]
    return _proof(followed, done, singular)


def _singular_throughout(followed: Followed, found: _Settled) -> Flags:
    """Whether the Jacobian is singular at start, middle and end of intervals: halves of them are settled no better."""
    throughout = np.isnan(found.rates[:, 0, 0]) & np.isfinite(found.q[:, 0])
    share = followed.line.progress(np.stack([found.start[throughout], found.end[throughout]]))[0]
    dq, _ = followed.through_jacobian(followed.joints_at(share).reshape(-1, found.q.shape[1]), share.ravel())
    throughout[throughout] = np.isnan(dq[:, 0]).reshape(share.shape).all(axis=0)
    return throughout


def _acceleration_steps(followed: Followed) -> tuple[Reals, Reals]:
    """Times at which pieces of the law or of the curve meet, start and end among them, and the accelerations' steps."""
    law, duration = followed.line.law, followed.line.duration
    times = np.unique(np.concatenate([law.breaks, times_at(law, followed.line.edges)]))
    aside = STEP_ASIDE * duration
    after = followed.rates(np.minimum(times + aside, duration))[2]
    before = followed.rates(np.maximum(times - aside, 0.0))[2]
    after[times >= duration - aside], before[times <= aside] = 0.0, 0.0  # at rest
    return times, after - before


def law_motion(law: TimeLaw) -> PiecewiseMotion:
    """A law of time as polynomials, n = 1."""

    def rates(t: Reals) -> tuple[Reals, Reals, Reals]:
        share, speed, acceleration = law(t)
        return share[..., None], speed[..., None], acceleration[..., None]

    return polynomial_motion(rates, law.breaks, law.degree)


def _distance(points: Reals, start: Reals, end: Reals) -> Reals:
    """Of intervals (k,) from the nearest of some points."""
    if not points.size:
        return np.full(len(start), np.inf)
    points = np.sort(points)
    after = np.searchsorted(points, start)
    ahead = np.append(points, np.inf)[after] - end
    behind = start - np.append(-np.inf, points)[after]
    distance: Reals = np.maximum(np.minimum(ahead, behind), 0.0)
    return distance


def _proof(followed: Followed, done: list[_Settled], singular: Reals) -> ToolProof:
    order = np.argsort(np.concatenate([part.start for part in done]))
    names = _Settled.__dataclass_fields__
    whole = _Settled(*(np.concatenate([getattr(part, name) for part in done])[order] for name in names))
    times = np.append(whole.start, whole.end[-1])
    middles = (whole.start + whole.end) / 2
    t = np.concatenate([times, middles])
    q = np.concatenate([followed.joints(times), whole.q])
    order = np.argsort(t, kind="stable")
    duration = followed.line.duration
    undecided: list[Interval[Undecided]] = []
    beside: list[Interval[Undecided]] = []
    for k, quantity in enumerate(QUANTITIES):
        for first, last in runs(whole.open[:, k]):
            start, end = np.array([whole.start[first]]), np.array([whole.end[last - 1]])
            apart = _distance(singular, start, end)[0] > BESIDE_EVENT[0] * duration
            (undecided if apart else beside).append(Interval(float(start[0]), float(end[0]), Undecided(quantity)))
    return ToolProof(
        times=times,
        proven=whole.proven,
        velocity=whole.velocity,
        acceleration=whole.acceleration,
        t=t[order],
        q=q[order],
        middles=middles,
        rates=whole.rates,
        jerk=whole.jerk,
        steps=_acceleration_steps(followed),
        undecided=tuple(sorted(undecided, key=lambda part: part.start)),
        beside=tuple(sorted(beside, key=lambda part: part.start)),
    )


def _settle(
    followed: Followed, required: ProofRequirements, how: tuple[PiecewiseMotion, bool], start: Reals, end: Reals
) -> _Settled:
    """What the bounds say of intervals (k,); ``how``: the law of time, and whether means of jerks narrow them."""
    progress, by_means = how
    robot, count = followed.robot, len(start)
    middle, half = (start + end) / 2, (end - start) / 2
    (s_start, s, s_end), (_, speed, _), (_, pull, _) = (
        part.reshape(3, count) for part in (x[:, 0] for x in progress.rates(np.concatenate([start, middle, end])))
    )
    shares, at = np.unique(np.concatenate([s_start, s_end]), return_inverse=True)
    q_start, q_end = followed.joints_at(shares)[at].reshape(2, count, -1)
    q = followed.joints_at(s)
    dq, ddq = followed.through_jacobian(q, s)
    none = np.zeros_like(q), np.full_like(q, np.inf), np.ones(count)
    jerk, third, apart = _mean_thirds(followed, start, end) if by_means else none
    bounds = _continued(followed, q, (dq, ddq, third), (s_start, s, s_end), apart)
    for beside in (q_start, q_end):
        bounds.proven[:] &= (np.abs(beside - q) <= bounds.change * (1 + 1e-6) + LIMIT_TOLERANCE).all(axis=1)
    velocity, acceleration = dq * speed[:, None], ddq * speed[:, None] ** 2 + dq * pull[:, None]
    blur = (2 * bounds.blur * speed**2 / (end - start))[:, None]
    law = (speed, pull, half)
    rates, highest = _rate_bounds(bounds, (velocity, acceleration, np.abs(jerk) + blur), progress, (start, end), law)
    unreached = np.isnan(np.stack([q_start, q, q_end])[..., 0])
    open_, broken = (np.zeros((count, len(QUANTITIES)), bool) for _ in range(2))
    known = bounds.proven
    open_[:, 0] = ~known & ~unreached.all(axis=0)
    outside = _outside(robot, np.stack([q_start, q, q_end])).any(axis=0)
    sure = ~_outside(robot, q, bounds.change)
    open_[:, 1], broken[:, 1] = known & ~np.all(sure | outside, axis=1), np.any(outside, axis=1)
    for limit in required.rates:
        k = 1 + limit.order
        over = np.abs((velocity, acceleration, jerk)[limit.order - 1]) > limit.allowed + (blur if k == 4 else 0.0)
        sure = (highest[limit.order] <= limit.allowed) | ~np.isfinite(limit.most)
        open_[:, k], broken[:, k] = known & ~(sure | over).all(axis=1), over.any(axis=1)
    open_[known, 5] = _near_open(robot, required.near, q[known], bounds.change[known])
    return _Settled(
        start=start,
        end=end,
        proven=bounds.proven,
        open=open_,
        broken=broken,
        velocity=np.where(known[:, None], highest[1], np.inf),
        acceleration=np.where(known[:, None], highest[2], np.inf),
        q=q,
        rates=rates,
        jerk=jerk,
    )


def _continued(
    followed: Followed,
    q: Reals,
    derivatives: tuple[Reals, Reals, Reals],
    s: tuple[Reals, Reals, Reals],
    apart: Reals,
) -> _Bounds:
    """Continue the motion from solved poses (k, n) at middles over intervals, by the formulas of the module's text.

    ``derivatives`` by s are the first two there and a mean of the third, taken over ``apart`` (k,); infinite for none.
    """
    dq, ddq, mean_third = derivatives
    robot, n = followed.robot, q.shape[-1]
    coupling = np.eye(n) if robot.coupling is None else robot.coupling
    length, root = characteristic_length(robot), np.sqrt(n) * np.linalg.norm(coupling, 2)
    count = len(q)
    solved = np.isfinite(dq[:, 0])
    h = np.maximum(s[2] - s[1], s[1] - s[0])
    sizes = followed.line.twist_bounds(s[0], s[2]) / np.array([length, 1.0])
    v1, v2, v3 = np.linalg.norm(sizes, axis=-1)[:, 1:].T
    b, reach = np.full(count, np.inf), np.full(count, np.inf)
    b[solved], reach[solved] = inverse_and_reach(robot, q[solved], length)
    sum_first, first, second = (np.full(count, np.inf) for _ in range(3))
    sum_first[solved] = np.abs(dq[solved] @ coupling.T).sum(axis=1)
    first[solved], second[solved] = np.linalg.norm(dq[solved], axis=1), np.linalg.norm(ddq[solved], axis=1)
    with np.errstate(all="ignore"):

        def formulas(most: Reals, third: Reals) -> tuple[Reals, Reals, Reals, Reals]:
            """Bounds of q'' to q'''' if q'' and q''' are no greater, and whether the motion is continued."""
            V = sum_first + root * h * most
            C = np.sqrt(1 + (reach * np.exp(np.minimum(h * V, 1.0))) ** 2)
            grown = b * root * C * h * V
            B = b / (1 - grown)
            within = (grown < GROWN) & (h * V < 1.0)
            A, Z = root * most, root * third
            fourth = B * (v3 + C * (4 * V * Z + 3 * A**2 + 6 * V**2 * A + V**4))
            return B * (v1 + C * V**2), B * (v2 + 3 * C * V * A + C * V**3), fourth, within

        most = np.maximum(1.5 * b * (v1 + np.sqrt(1 + reach**2) * sum_first**2), second)
        proven = np.zeros(count, bool)
        for _ in range(ATTEMPTS):
            bound, _, _, within = formulas(most, most)
            now = solved & within & (bound <= most)
            proven |= now
            most = np.where(proven, np.minimum(most, np.where(now, bound, np.inf)), 1.3 * np.maximum(bound, most))
        third = np.full(count, np.inf)
        for _ in range(ATTEMPTS):
            bound, next_, _, _ = formulas(most, third)
            third = np.minimum(third, next_)
            most = np.minimum(np.minimum(most, bound), second + h * third)
        blur = BLURRED * b * np.sqrt(1 + reach**2) * np.maximum(1.0, sum_first) * sum_first
        mean = np.linalg.norm(mean_third, axis=1) + 2 * np.sqrt(n) * blur / apart
        fourth = formulas(most, third)[2]
        for _ in range(ATTEMPTS):
            third = np.fmin(third, mean + 2 * h * fourth)
            most = np.minimum(most, second + h * third)
            fourth = np.fmin(fourth, formulas(most, third)[2])
    h, third = h[:, None], third[:, None]
    high2 = np.minimum(np.abs(ddq) + h * third, most[:, None])
    high1 = np.abs(dq) + h * np.abs(ddq) + h**2 * third / 2
    change = h * np.abs(dq) + h**2 * np.abs(ddq) / 2 + h**3 * third / 6
    found = (change, high1, high2, np.broadcast_to(third, q.shape), np.broadcast_to(fourth[:, None], q.shape))
    change, high1, high2, third, fourth = (np.where(proven[:, None], part, np.inf) for part in found)
    return _Bounds(proven, change, high1, high2, third, fourth, blur)


def inverse_and_reach(robot: Robot, q: Reals, length: float) -> tuple[Reals, Reals]:
    """Norm (k,) of the inverse of the scaled Jacobian, and largest lever of the tool point over the length."""
    J = jacobian(robot, q)
    J[..., :3, :] /= length
    smallest = np.linalg.svd(J, compute_uv=False)[..., -1]
    lever = np.linalg.norm(J[..., :3, :], axis=-2).max(axis=-1)
    T = frames(robot, q)
    far = np.linalg.norm(T[:, -1:, :3, 3] - T[:, :-1, :3, 3], axis=-1).max(axis=-1) / length
    return 1 / smallest, np.maximum(lever, far)


def _rate_bounds(
    bounds: _Bounds,
    met: tuple[Reals, Reals, Reals],
    progress: PiecewiseMotion,
    ends: tuple[Reals, Reals],
    law: tuple[Reals, Reals, Reals],
) -> tuple[Reals, dict[int, Reals]]:
    """Rates at the middles (k, 2, n), and bounds of speed, acceleration and jerk over the intervals.

    ``met`` are velocities and accelerations at the middles, and bounds of the size of a jerk met in each, (k, n).
    """
    velocity, acceleration, mean_jerk = met
    speed, pull, half = (part[:, None] for part in law)
    piece = np.clip(np.searchsorted(progress.times, (ends[0] + ends[1]) / 2) - 1, 0, len(progress.times) - 2)
    jerk, snap = (np.abs(series[piece, :, 0]).sum(axis=1)[:, None] for series in (progress.jerk, progress.snap))
    most_pull = np.abs(pull) + half * jerk
    most_speed = speed + half * np.abs(pull) + half**2 * jerk / 2
    with np.errstate(invalid="ignore"):
        third = bounds.third * most_speed**3 + 3 * bounds.second * most_speed * most_pull + bounds.first * jerk
        fast = np.abs(velocity) + half * np.abs(acceleration) + half**2 * third / 2
        hard = np.abs(acceleration) + half * third
        bent = bounds.second * (3 * most_pull**2 + 4 * most_speed * jerk) + bounds.first * snap
        fourth = bounds.fourth * most_speed**4 + 6 * bounds.third * most_speed**2 * most_pull + bent
        jerky = np.minimum(third, mean_jerk + 2 * half * fourth)
    return np.stack([velocity, acceleration], axis=1), {1: fast, 2: hard, 3: np.where(np.isnan(jerky), third, jerky)}


def _mean_thirds(followed: Followed, start: Reals, end: Reals) -> tuple[Reals, Reals, Reals]:
    """Mean jerk (k, n) over intervals, mean third derivative by share of the path, and the shares' differences (k,).

    There is a time in each interval at which a joint's jerk is the mean one; likewise its third derivative.
    """
    inner = (end - start) * 1e-3  # off the ends, where the law's acceleration may step
    times = np.concatenate([start + inner, end - inner])
    share, speed, pull = followed.line.progress(times)
    _, dq, ddq = followed.derivatives(share)
    rates = ddq * speed[:, None] ** 2 + dq * pull[:, None]
    halves = [np.split(part, 2) for part in (times, share, rates, ddq)]
    length, apart, gained, bent = (last - first for first, last in halves)
    with np.errstate(all="ignore"):
        return gained / length[:, None], bent / apart[:, None], apart


def _outside(robot: Robot, q: Reals, change: Reals | None = None) -> Flags:
    """Whether angles (..., n), or any that differ from them by at most ``change``, are outside each of the limits.

    Shape (..., n + c): of the joints, then of the c sums of joints that are limited.
    """
    factors = np.array([limit.factors for limit in robot.combined]).reshape(-1, q.shape[-1])
    ends = [(limit.lower, limit.upper) for limit in robot.combined]
    lower = np.concatenate([np.where(robot.continuous, -np.inf, robot.lower), [low for low, _ in ends]])
    upper = np.concatenate([np.where(robot.continuous, np.inf, robot.upper), [high for _, high in ends]])
    values = np.concatenate([q, q @ factors.T], axis=-1)
    spread = 0.0 if change is None else np.concatenate([change, change @ np.abs(factors).T], axis=-1)
    outside: Flags = (values - spread < lower - LIMIT_TOLERANCE) | (values + spread > upper + LIMIT_TOLERANCE)
    return outside


def _near_open(robot: Robot, near: NearSingular, q: Reals, change: Reals) -> Flags:
    """Whether it is open that an interval keeps its distance from each singular set."""
    moved = _factors_change(robot, change)
    factors = determinant_factors(robot, q)
    found = np.zeros(len(q), bool)
    for kind in TYPES:
        size = np.abs(getattr(factors, kind))
        found |= (size >= near.of(kind)) & (size - moved[kind] < near.of(kind))
    return found


def _factors_change(robot: Robot, change: Reals) -> dict[SingularityType, Reals]:
    """By how much the distances from the singular sets change at most (k,), if joints do by ``change`` (k, n).

    An angle between axes or links by no more than all joints together; a distance of the wrist centre by no more than
    that times the arm's length. Where the factors' forms are known, less.
    """
    if wrist_partition_missing(robot) is not None:
        both = change.sum(axis=1)
        return {"wrist": both, "elbow": both, "shoulder": 2 * arm_length(robot) * both}
    if robot.coupling is not None:
        change = change @ np.abs(robot.coupling).T
    in_q2, in_both = factor_forms(robot).shoulder_slopes
    return {
        "wrist": change[:, WRIST_JOINT],
        "elbow": change[:, ELBOW_JOINT],
        "shoulder": in_q2 * change[:, 1] + in_both * (change[:, 1] + change[:, 2]),
    }
