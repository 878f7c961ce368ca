"""The faults of a motion, their places, and the verdict."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import scipy

from er3a.by_value import by_identity, frozen
from er3a.collision.along import ClearanceAlong, Contact, clearance_along
from er3a.collision.bodies import Bodies
from er3a.collision.pairs import label_of
from er3a.collision.shapes import surely_touch
from er3a.finding import fact
from er3a.geometry.transforms import rpy_of
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.trajectory import model
from er3a.pipeline.stages.trajectory.motion import Motion, MotionTask
from er3a.planning.motion_faults import Interval, by_kind, joints_of, over_limits, unreachable
from er3a.planning.names import FAULTS, NOT_TO_BE_RUN, UNFOLLOWED, PathVerdict, gravest, in_order
from er3a.planning.piecewise import PiecewiseMotion
from er3a.planning.singular_events import SingularEvent, singular_events
from er3a.robots.joint_limits import shown
from er3a.robots.robot import Robot

STEPS_TO_CONTACT, ATTEMPTS = 1000, 5
BEFORE_STOP = 0.99  # of the time until limits or reach are left, where the motion is not solved any more
LIMIT_MARGIN = 2.0  # deg (mm of a prismatic joint), between an advised end and a joint limit that the path leaves later
REACH_MARGIN = 0.02  # m of the path before it leaves the reach
SPEED_MARGIN = 0.9  # of a joint's speed limit; these four are chosen, no standard states them
STOPS = 2.0  # times the time that the joints take to stop, left before the first fault


@by_identity
class Judgement:
    """A motion's faults and the verdict that they make.

    Attributes
    ----------
    verdict : the gravest; of_joints : the gravest where bodies are passed over
    outcomes : all that it came to, the first fault first
    faults : where no branch reaches the pose, joints exceed a limit, or the bounds leave something open
    along : its clearance
    max_rates : maximum speeds (n,), rad/s, and accelerations (n,), rad/s^2, if any are known
    times, q, velocity, acceleration : (N,) s and (N, n) in rad, rad/s, rad/s^2 at all points of the table
    speed_bounded : False where the exact path needs a joint speed without bound
    """

    verdict: PathVerdict
    of_joints: PathVerdict
    outcomes: tuple[PathVerdict, ...]
    events: list[SingularEvent]
    faults: Mapping[PathVerdict, list[Interval]]
    along: ClearanceAlong
    max_rates: tuple[Reals, Reals] | None
    times: Reals
    q: Reals
    velocity: Reals
    acceleration: Reals
    speed_bounded: bool

    @property
    def may_run(self) -> bool:
        """Whether nothing that it came to forbids to run it, and joint speeds have a bound."""
        return set(self.outcomes).isdisjoint(NOT_TO_BE_RUN) and self.speed_bounded


def judged(task: MotionTask, motion: Motion, along: ClearanceAlong | None = None) -> Judgement:
    """Check a motion, whatever made it: its polynomials, exactly.

    Parameters
    ----------
    task : what it is judged by
    motion : of the arm, with its times
    along : its clearance, if that has been measured

    Returns
    -------
    found : gaps of the polynomials are undecided; where the path ends or is singular, they are what that leaves
    """
    curve, followed = motion.curve, motion.followed
    events = singular_events(task.robot, curve, task.near)
    crossed, jumps = any(event.crossing for event in events), followed.jumps if followed else ()
    ends = followed is not None and (jumps or np.isnan(followed.q).any() or crossed)
    times = np.unique(np.concatenate([motion.checks, [event.t for event in events]]))
    q, velocity, acceleration = motion.rates(times)
    beyond = unreachable(task.robot, followed) if followed else []
    edge = any(interval.start > 0 or interval.end < times[-1] for interval in beyond)
    bounded = not edge and not jumps and not (np.isfinite(q[:, 0]) & np.isnan(velocity[:, 0])).any()
    known = np.isfinite(curve.velocity).any()  # not where the tool reaches no point of its path
    parts = by_kind([*beyond, *over_limits(task.robot, curve, task.limits.rates)])
    if ends:  # which is why the polynomials have gaps
        parts.pop("undecided", None)
    along = along or measured(task.bodies, task.tolerance, motion)
    spans = {kind: [(part.start, part.end) for part in own] for kind, own in parts.items() if kind in FAULTS}
    if along.contacts:
        spans["collides"] = [(contact.start, contact.end) for contact in along.contacts]
    others: dict[PathVerdict, object] = {
        "none found": motion.not_planned,
        "singular": followed and (jumps or crossed),
        "near-singular": followed and events,
    }
    there = [*parts, *spans, *(name for name, found in others.items() if found)]
    verdict = gravest(there)
    if motion.not_planned:  # then the straight move is shown
        spans = {kind: own for kind, own in spans.items() if kind == "collides"}
    firsts = in_order({verdict: [(0.0, 0.0)], **spans}, float(motion.curve.duration))
    return Judgement(
        verdict=verdict,
        of_joints=gravest(name for name in there if name != "collides"),
        outcomes=tuple(each.kind for each in firsts if not each.follows),
        events=events,
        faults=parts,
        along=along,
        max_rates=curve.max_rates if known and bounded else None,
        times=times,
        q=q,
        velocity=velocity,
        acceleration=acceleration,
        speed_bounded=bounded,
    )


def measured(bodies: Bodies, tolerance: float, motion: Motion) -> ClearanceAlong:
    """Clearance along a motion, proven between the points that are measured, and given at its samples.

    Parameters
    ----------
    tolerance : m, the overlap that may go unnoticed

    Returns
    -------
    along : distances in m, negative by the depth of an overlap
    """
    return clearance_along(bodies, motion.joints, motion.rate_bounds, motion.t, motion.samples, tolerance)


def collisions(robot: Robot, along: ClearanceAlong, margin: float) -> list[Interval]:
    """Stretches of a motion on which bodies overlap.

    Parameters
    ----------
    along : clearance along the motion
    margin : m, by how much assumed shapes of the arm may be wrong

    Returns
    -------
    stretches : in s, each with its pairs of bodies, and their depths in mm
    """
    return [
        Interval(
            contact.start,
            contact.end,
            fact(
                "bodies_overlap",
                touches=tuple(
                    fact(
                        "pair_touches",
                        pair=each.pair,
                        t0_s=each.start,
                        depth_mm=each.depth * 1000,
                        t_s=each.at,
                        certain=surely_touch(robot, each.pair, each.depth, margin),
                    )
                    for each in contact.touches
                ),
            ),
        )
        for contact in along.contacts
    ]


def min_clearance(along: ClearanceAlong) -> model.MinClearance | None:
    """Where the arm comes nearest to anything.

    Parameters
    ----------
    along : clearance along the motion

    Returns
    -------
    nearest : mm and s; None where nothing could be measured
    """
    at = along.closest
    if at < 0 or (pair := along.pair[at]) is None:
        return None
    return model.MinClearance(float(along.distance[at] * 1000), float(along.t[at]), pair)


@frozen
class SafeStop:
    """Up to where a motion keeps a margin.

    Attributes
    ----------
    margin : m; of links that touch by design at their joint half of their first distance, where that is less
    kept_to : s, proven
    begin, stop : when (s) the last stop along the motion begins that ends by then, and how long it takes
    """

    margin: float
    kept_to: float
    begin: float
    stop: float


def safe_stop(
    task: MotionTask,
    motion: Motion | PiecewiseMotion,
    known: Reals,
    contacts: Sequence[Contact],
    stops: Sequence[float],
    margin: float,
) -> SafeStop | None:
    """The last stop of a motion with a margin (m) kept; None if it meets nothing, or keeps it nowhere.

    The end of the margin is searched for on a grid up to the first contact, or to one of ``stops`` (s), where the
    motion leaves limits or reach, and proven: where the clearance along the motion up to it is less, it is moved back.
    Of links that touch by design at their joint, which may have no margin to keep there, those that overlap elsewhere
    and begin within it keep half of their first distance. ``known`` (N,), s, rising: times from which it is measured.
    """
    bodies, acceleration = task.bodies, task.limits.acceleration
    if not contacts:
        return None
    first, met = contacts[0].start, {pair for contact in contacts for pair in contact.pairs}
    joined = np.array([k for k, pair in enumerate(bodies.pairs) if bodies.joined[k] and pair in met], int)

    def apart(t: Reals) -> Reals:
        """Distances (k, joined), m, at times (k,)."""
        return np.array([bodies.distances(q, joined) for q in motion.joints(t)])

    begin = apart(np.zeros(1))[0] if joined.size else np.empty(0)
    kept = np.where(begin > margin, margin, begin / 2)

    def beyond(t: Reals) -> Reals:
        """By how much (k,), m, more than the margin is kept at times (k,)."""
        spare = bodies.min_distance(motion.joints(t))[0] - margin
        return np.minimum(spare, (apart(t) - kept).min(axis=1)) if joined.size else spare

    last = min([first, *(BEFORE_STOP * stop for stop in stops)])
    kept_to = _margin_end(task, motion, known, beyond, last, margin)
    if kept_to is None:
        return None
    begun = kept_to, float(_stop_time(motion, np.array([kept_to]), acceleration)[0])
    if kept_to < last:
        found = _stop_before(motion, kept_to, acceleration)
        if found is None:
            return None
        begun = found
    return SafeStop(float(min([margin, *kept])), kept_to, *begun)


def last_safe_stop(task: MotionTask, motion: Motion, found: Judgement, margin: float) -> model.ClearUntil | None:
    """The last point from which a path still stops with a margin (m) kept, as of :func:`safe_stop`."""
    stops = [part.start for kind in UNFOLLOWED for part in found.faults.get(kind, ())]
    last = safe_stop(task, motion, motion.t, found.along.contacts, stops, margin)
    if last is None:
        return None
    end = np.array([last.begin])
    pose, q = motion.tool(end)[0], motion.joints(np.append(end, found.along.contacts[0].start))
    first = np.array([k for k, pair in enumerate(task.bodies.pairs) if pair == found.along.contacts[0].pairs[0]])
    nearest = first[task.bodies.distances(q[1], first).argmin()]
    touching = task.bodies.surface_points(q[1], int(nearest)).mean(axis=0)
    return model.ClearUntil(
        1000 * last.margin,
        last.begin,
        last.stop,
        float(motion.way(end)[0]),
        tuple((1000 * pose[:3, 3]).tolist()),
        tuple(np.degrees(rpy_of(pose)).tolist()),
        tuple(shown(task.robot, q[0]).tolist()),
        tuple((1000 * touching).tolist()),
    )


def _margin_end(
    task: MotionTask,
    motion: Motion | PiecewiseMotion,
    known: Reals,
    beyond: Callable[[Reals], Reals],
    last: float,
    margin: float,
) -> float | None:
    """Up to when (s, ``last`` at most) a motion keeps a margin (m), proven; None if nowhere.

    ``beyond``: by how much more than the margin is kept, m, at times (k,).
    """
    end = last
    for _ in range(ATTEMPTS):
        grid = np.linspace(0.0, end, STEPS_TO_CONTACT + 1)
        spare = beyond(grid)
        if not (end > 0 and spare[0] > 0):
            return None
        k = int(np.argmax(spare <= 0))
        if k > 0:
            end = scipy.optimize.brentq(lambda t: beyond(np.array([t]))[0], grid[k - 1], grid[k], xtol=1e-9 * last)
        times = np.append(known[known < end], end)
        until = clearance_along(task.bodies, motion.joints, motion.rate_bounds, times, times[[0, -1]], task.tolerance)
        short = until.distance < margin - task.tolerance
        if not short.any():
            return float(end)
        end = float(until.t[int(np.argmax(short))])
    return None


def _stop_before(motion: Motion | PiecewiseMotion, end: float, acceleration: Reals) -> tuple[float, float] | None:
    """The last time (s) at which a stop along a motion can begin that ends by a time, and how long it takes; None if
    none can. What keeps the accelerations comes, in the time that a stop takes, at least as far as the stop does."""
    times = np.linspace(0.0, end, STEPS_TO_CONTACT + 1)
    stops = _stop_time(motion, times, acceleration)
    kept = np.flatnonzero(times + stops <= end)
    return (float(times[kept[-1]]), float(stops[kept[-1]])) if len(kept) else None


def _stop_time(motion: Motion | PiecewiseMotion, t: Reals, acceleration: Reals) -> Reals:
    """How long (s) the joints take to stop at times (k,)."""
    found: Reals = (np.abs(motion.rates(t)[1]) / acceleration).max(axis=1)
    return found


def advised_end(path: model.PathSummary, rows: model.PathChecks, limits: model.LimitsUsed) -> model.SoundEnd | None:
    """The last point of a path's ``rows``, or the last with the margin of a collision, at which it may end.

    ``STOPS``, ``LIMIT_MARGIN``, ``REACH_MARGIN`` and ``SPEED_MARGIN`` are kept before the first fault; a path of the
    tool also ends before it is near-singular. None where no point of the path allows that, nothing is wrong, a
    collision's margin is kept nowhere, or no motion was planned.
    """
    until = path.clear_until
    if path.not_planned or (path.of("collides") and until is None):
        return None
    found = by_kind(path.faults)
    starts = [part.t0_s for kind, own in found.items() if kind != "collides" for part in own]
    starts += [event.t_s for event in path.singular]
    starts += [] if path.in_joint_space else rows.t_s[rows.near_singular][:1].tolist()
    first = min(starts, default=np.inf)
    stop = (np.abs(rows.q_deg_s) / limits.acceleration_deg_s2).max(axis=1)
    kept = rows.reachable & (rows.t_s + STOPS * stop <= first) & (np.nan_to_num(rows.speed_ratio) <= SPEED_MARGIN)
    for part in found.get("leaves limits", ()):
        joints, at = [j - 1 for j in joints_of(part.cause)], int(np.argmin(np.abs(rows.t_s - part.t0_s)))
        if joints:
            kept &= np.abs(rows.q_deg[:, joints] - rows.q_deg[at, joints]).max(axis=1) >= LIMIT_MARGIN
    for lost in found.get("unreachable", ()):
        kept &= rows.s_m <= lost.s0_m - REACH_MARGIN
    if until and (np.isinf(first) or kept[rows.t_s <= until.t_s][-1:].any()):
        return model.SoundEnd(until.t_s, until.xyz_mm)
    ends = np.flatnonzero(kept & (rows.t_s < first) & (rows.t_s <= (until.t_s if until else np.inf)))
    if not starts or not len(ends):
        return None
    k = ends[-1]
    return model.SoundEnd(
        float(rows.t_s[k]), tuple(rows.xyz_mm[k].tolist()), float(first - rows.t_s[k]), float(stop[k])
    )


def clearance_rows(name: str, strategy: str, along: ClearanceAlong) -> model.Clearances:
    """One row for each time at which the clearance was measured in full.

    Parameters
    ----------
    name : of the path
    strategy : that the motion follows; empty for the path as programmed

    Returns
    -------
    rows : s and mm; NaN where the path can't be reached
    """
    between = [label_of(pair) if pair else "" for pair in along.pair]
    return model.Clearances.of(
        path=name, strategy=strategy, t_s=along.t, clearance_mm=along.distance * 1000, between=between
    )
