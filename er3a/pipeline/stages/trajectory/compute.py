"""Plan and check every path of a robot: where it is singular, leaves the limits, collides, or can't be reached."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from er3a.by_value import by_identity
from er3a.collision.along import ClearanceAlong, clearance_along
from er3a.collision.shapes import shapes_assumed
from er3a.finding import Finding, fact
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.singularity import NearSingular, characteristic_length, conditioning, factors_where_defined
from er3a.kinematics.solutions import branch_labels
from er3a.kinematics.wrist_partitioned import has_branches, wrist_partition_missing
from er3a.numerics.arrays import Reals
from er3a.numerics.si_units import from_si, stated
from er3a.pipeline.results import Figure, Status, Verdict
from er3a.pipeline.scope import CHECKS_OF_MOTIONS, Check, Coverage, Open, by_reason, coverages
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.covered import Covered, assumed_rates, assumed_tool, covered_collisions, gaps_of_orientations
from er3a.pipeline.stages.expectations import demonstrations, pass_of, unmet_expectations
from er3a.pipeline.stages.programs.model import finding_at
from er3a.pipeline.stages.trajectory import judgement, model
from er3a.pipeline.stages.trajectory.motion import (
    ROUNDED,
    ListedMotion,
    Motion,
    MotionTask,
    corner_misses,
    listed_motions,
    margin_of,
    task_of,
)
from er3a.pipeline.stages.trajectory.written_programs import near_assumed_shapes, program_files
from er3a.pipeline.study import Study
from er3a.planning.avoidance.avoidance import SingularSegment, singular_segment
from er3a.planning.avoidance.strategies import (
    StrategyCost,
    StrategyResult,
    best,
    beyond_limits,
    compare_strategies,
    deviation,
)
from er3a.planning.motion_faults import Interval
from er3a.planning.names import PATH_VERDICTS, TOO_FAST, UNFOLLOWED, PathVerdict, StrategyName
from er3a.planning.piecewise import PiecewiseMotion
from er3a.planning.singular_events import SingularEvent
from er3a.planning.timing import JointLimits, TimingError, fastest, nodes_along
from er3a.planning.way_around import WayAround, way_between
from er3a.robots.joint_limits import shown, speeds_given, within
from er3a.robots.robot import Robot

MIN_RATIO = 1e-3  # of the limits, below which a path counts as standing still
ROWS = 250  # of each motion in the table
CLEARANCE_TIMES = 41


@by_identity
class Avoided:
    """What was tried on a path, and what to take.

    Attributes
    ----------
    fastest_s : duration of the path itself as fast as the joints can; None where no motion follows it
    """

    tried: tuple[model.TriedStrategy, ...]
    chosen: StrategyName | None
    fastest_s: float | None
    rows: model.AvoidanceRows
    clearance: model.Clearances


@by_identity
class AvoidanceTask(MotionTask):
    """What all paths of a robot have in common.

    Attributes
    ----------
    margin : m, that a motion which is advised keeps from bodies, if any does
    only : the strategy that the study asks for; None to compare all
    """

    only: StrategyName | None = None
    margin: float = 0.0

    def avoid(self, motion: Motion, found: judgement.Judgement) -> Avoided:
        """Compare the strategies where a path is not safe; find its fastest time law where it can be run as it is.

        A strategy on whose motion the arm meets its surroundings or itself is not usable. Where the path keeps the
        joints' limits of rates, strategies are timed to need no more of them than the path does, so that none is worse
        than what it corrects. Where it collides or can't be run at all, a motion is planned between its ends.
        """
        results: list[StrategyResult] = []
        if motion.followed is None:
            quickest, results = self._joint_move(motion, found)
        else:
            fixed_start = motion.built.q_start is not None
            segment = singular_segment(motion.followed, self.near, self.limits, found.events, fixed_start)
            quickest = _quickest(segment)
            if found.of_joints != "safe":
                results = compare_strategies(
                    replace(segment, limits=self._no_more_than(found), allowed=self.limits), self.only
                )
        collides = bool(found.along.contacts)
        barred = collides or not found.faults.keys().isdisjoint(UNFOLLOWED)
        if barred and motion.not_planned is None and self.only in (None, "planned"):
            results += self._planned(motion)
        ends, name = found.along.distance[[0, -1]], motion.entry.name
        margin = float(min([self.margin, *(ends[ends > 0] - ROUNDED)]))  # no more than the ends of the path have
        along = {result.name: self._along(result.cost.motion) for result in results if result.cost}
        met = {each: _meets(own, margin) for each, own in along.items()}
        free = [result for result in results if result.name not in met or met[result.name][0] is None]
        meets = motion.followed is not None and any(event.crossing for event in found.events)
        chosen = best(free, meets, motion.curve.duration)
        tried = tuple(_tried(result, *met.get(result.name, (None, None))) for result in results)
        return Avoided(
            tried=tried,
            chosen=chosen.name if chosen else None,
            fastest_s=quickest.duration if quickest else None,
            rows=model.AvoidanceRows.stacked(
                [
                    *(self._rows(name, each.name, each.cost.motion, each.cost) for each in results if each.cost),
                    *([self._rows(name, model.FASTEST, quickest, None)] if quickest else []),
                ]
            ),
            clearance=model.Clearances.stacked(
                [judgement.clearance_rows(name, each, own) for each, own in along.items()]
            ),
        )

    def _no_more_than(self, found: judgement.Judgement) -> JointLimits:
        """The limits, or what of them the path needs if that is less."""
        if found.max_rates is None or not found.faults.keys().isdisjoint(TOO_FAST):
            return self.limits
        limits = self.limits.speed, self.limits.acceleration
        ratios = (float((most / limit).max()) for most, limit in zip(found.max_rates, limits))
        speed, acceleration = (limit * min(1.0, max(ratio, MIN_RATIO)) for limit, ratio in zip(limits, ratios))
        return replace(self.limits, speed=speed, acceleration=acceleration)

    def _planned(self, motion: Motion) -> list[StrategyResult]:
        """The planner's motion between the ends of a path, where both can be reached."""
        tool = motion.tool(np.array([0.0, motion.curve.duration]))
        ends = [self._end(q, T) for q, T in zip(motion.q[[0, -1]], tool)]
        found = way_between(self, *ends)
        if not isinstance(found, WayAround):
            return [StrategyResult("planned", None, (found,))]
        timed = found.motion
        path = motion.built.tool or _ToolPath(motion)
        distance, angle, _ = deviation(path, forward(self.robot, timed.joints(timed.times)))
        cost = StrategyCost(timed, 1.0, distance, angle, *self.limits.ratios(timed), keeps_clear=True)
        return [StrategyResult("planned", cost)]

    def _end(self, q: Reals, T: Reals) -> Reals:
        """Joint angles (k, n) within the limits at an end of a path: its own, else others that reach the pose."""
        if np.isfinite(q).all() and within(self.robot, q):
            return q[None]
        solved = inverse(self.robot, T, self_motion_rows=True)
        return solved.q[solved.within_limits]

    def _joint_move(
        self, motion: Motion, found: judgement.Judgement
    ) -> tuple[PiecewiseMotion | None, list[StrategyResult]]:
        """Fastest time law; slowing down is the only strategy that a joint move can need."""
        t, q = nodes_along(motion.joints, motion.t, motion.q, self.limits)
        try:
            quickest = fastest(q, self.limits)
            if found.faults.keys().isdisjoint(TOO_FAST):
                return quickest, []
            slower = fastest(q, self.limits, t)
        except TimingError:
            return None, []
        speed, acceleration = self.limits.ratios(slower)
        nothing = np.zeros(len(slower.times))
        cost = StrategyCost(slower, 1.0, nothing, nothing, speed, acceleration, False)
        return quickest, [StrategyResult("slow", cost, tuple(beyond_limits(self.robot, slower, self.limits)))]

    def _along(self, motion: PiecewiseMotion) -> ClearanceAlong:
        """The clearance along a strategy's motion."""
        grid = np.linspace(0.0, motion.duration, CLEARANCE_TIMES)
        return clearance_along(self.bodies, motion.joints, motion.rate_bounds, grid, grid, self.tolerance)

    def _rows(self, path: str, strategy: str, timed: PiecewiseMotion, cost: StrategyCost | None) -> model.AvoidanceRows:
        """At most ROWS rows of a motion, and those of its maximum speed and deviation."""
        kept = np.unique(np.linspace(0, len(timed.times) - 1, min(ROWS, len(timed.times))).round().astype(int))
        kept = kept if cost is None else np.union1d(kept, [np.argmax(cost.distance)])
        times = np.union1d(timed.times[kept], [self._fastest_time(timed)])
        q, velocity, acceleration = timed.rates(times)
        off = (cost.distance, cost.angle) if cost else (np.zeros(len(timed.times)),) * 2
        distance, angle = (np.interp(times, timed.times, part) for part in off)
        measures = conditioning(self.robot, q, characteristic_length(self.robot))
        return model.AvoidanceRows.of(
            path=path,
            strategy=strategy,
            t_s=times,
            q_deg=shown(self.robot, q),
            q_deg_s=shown(self.robot, velocity),
            q_deg_s2=shown(self.robot, acceleration),
            xyz_mm=forward(self.robot, q)[:, :3, 3] * 1000,
            deviation_mm=distance * 1000,
            deviation_deg=np.degrees(angle),
            speed_ratio=speed_ratio(velocity, self.limits),
            condition_number=measures.condition_number,
            smallest_singular_value=measures.smallest_singular_value,
        )

    def _fastest_time(self, timed: PiecewiseMotion) -> float:
        """When a joint comes nearest to its maximum speed."""
        j = int(np.argmax(timed.max_rates[0] / self.limits.speed))
        return max(timed.of_joint(timed.velocity, j, sign).peak() for sign in (1.0, -1.0))[1]


@by_identity
class _ToolPath:
    """The way of the tool on a move of the joints."""

    motion: Motion

    def poses(self, progress: Reals) -> Reals:
        """Poses of the tool along a move of the joints.

        Parameters
        ----------
        progress : (...,), share of the time, 0 to 1

        Returns
        -------
        T : T_base_tool (..., 4, 4), m
        """
        return self.motion.tool(np.asarray(progress) * self.motion.curve.duration)


def speed_ratio(velocity: Reals, limits: JointLimits) -> Reals:
    """How near joints come to their speed limits.

    Parameters
    ----------
    velocity : (N, n), rad/s or m/s
    limits : with speeds (n,) in the same units

    Returns
    -------
    ratio : (N,), the largest of all joints; above 1 is too fast, NaN where a velocity is unknown
    """
    ratio: Reals = np.abs(velocity / limits.speed).max(axis=1)
    return ratio


def _meets(along: ClearanceAlong, margin: float) -> tuple[Finding | None, model.MinClearance | None]:
    """The deepest overlap on a motion, or what comes nearer than a margin (m), and its smallest clearance (None if
    nothing can meet)."""
    smallest = judgement.min_clearance(along)
    if smallest is None:
        return None, None
    if along.contacts:
        return fact("pair_overlaps", pair=smallest.between, depth_mm=-smallest.least_mm), smallest
    near = smallest.least_mm < 1000 * margin
    return fact(
        "pair_too_near", pair=smallest.between, clearance_mm=smallest.least_mm, margin_mm=1000 * margin
    ) if near else None, smallest


def _quickest(segment: SingularSegment) -> PiecewiseMotion | None:
    if np.isnan(segment.q[:, 0]).any() or segment.followed.jumps:
        return None
    try:
        return segment.along(0, len(segment.t) - 1, programmed=False)
    except TimingError:
        return None


def _tried(
    result: StrategyResult,
    meets: Finding | None,
    clearance: model.MinClearance | None,
) -> model.TriedStrategy:
    reasons = (*result.reasons, meets) if meets else result.reasons
    motion = _motion(result.cost, clearance) if result.cost else None
    return model.TriedStrategy(result.name, motion is not None and not reasons, reasons, motion)


def _motion(cost: StrategyCost, clearance: model.MinClearance | None) -> model.StrategyMotion:
    return stated(
        model.StrategyMotion,
        cost,
        max_deviation_mm=from_si("mm", cost.distance.max()),
        max_deviation_deg=from_si("deg", cost.angle.max()),
        duration=cost.motion.duration,
        max_joint_speed=cost.motion.max_rates[0],
        clearance=clearance,
    )


def path_summary(
    task: AvoidanceTask,
    motion: Motion,
    found: judgement.Judgement,
    avoided: Avoided,
    assumed_margin: float,
) -> model.PathSummary:
    """All that is known of a path, for the stage's summary.

    Parameters
    ----------
    found : its faults
    avoided : what was tried where it is not safe
    assumed_margin : m, by how much assumed shapes of the arm may be wrong

    Returns
    -------
    summary : in mm, deg and s
    """
    robot, limits = task.robot, task.limits
    followed, entry = motion.followed, motion.entry
    labels = branch_labels(robot) if has_branches(robot) else ()
    slots = [] if followed is None else [int(slot) for slot in dict.fromkeys(followed.slot) if slot >= 0]
    contacts = judgement.collisions(robot, found.along, assumed_margin)
    speed, acceleration = found.max_rates or (None, None)
    missed_mm, missed_deg = corner_misses(robot, motion.built)
    return model.PathSummary(
        name=entry.name,
        title=entry.title,
        kind=entry.kind,
        verdict=found.verdict,
        outcomes=found.outcomes,
        expect=entry.expected,
        in_joint_space=followed is None,
        duration_s=float(motion.curve.duration),
        samples=entry.samples,
        length_m=float(motion.way(motion.samples[-1:])[0]),
        branches=tuple(labels[slot] for slot in slots),
        half_turns=_half_turns(motion),
        corner_deviation_mm=missed_mm or None,
        corner_deviation_deg=missed_deg or None,
        repeated_rows=tuple(motion.built.repeated_rows),
        sliding=tuple((np.flatnonzero(robot.slides) + 1).tolist()),
        start_turn_deg=None if followed is None else tuple(np.degrees(followed.start_turn).tolist()),
        singularities=tuple(_singularity(event) for event in found.events),
        faults=_stretches(motion, [*(part for own in found.faults.values() for part in own), *contacts]),
        jumps=tuple(
            model.Jump(jump.t, jump.joint, float(np.degrees(jump.angle)))
            for jump in (followed.jumps if followed else ())
        ),
        max_joint_speed_deg_s=None if speed is None else tuple(shown(robot, speed).tolist()),
        max_joint_speed_ratio=_ratio(speed, limits.speed),
        max_joint_acceleration_ratio=_ratio(acceleration, limits.acceleration),
        joint_speed_bounded=found.speed_bounded,
        clearance=judgement.min_clearance(found.along),
        not_planned=motion.not_planned,
        fastest_s=avoided.fastest_s,
        avoidance=avoided.tried,
        strategy=avoided.chosen,
    )


def _ratio(largest: Reals | None, most: Reals) -> float | None:
    return None if largest is None else float((largest / most).max())


def _half_turns(motion: Motion) -> tuple[model.HalfTurn, ...]:
    turns = motion.built.tool.half_turns() if motion.built.tool else []
    return tuple(model.HalfTurn(k, tuple(float(x) for x in np.round(axis, 12) + 0.0)) for k, axis in turns)


def _singularity(event: SingularEvent) -> model.Singularity:
    shoulder = event.type == "shoulder"
    return stated(
        model.Singularity,
        event,
        distance_deg=None if shoulder or event.axes else from_si("deg", event.distance),
        distance_mm=from_si("mm", event.distance) if shoulder else None,
        smallest_singular_value=event.distance if event.axes else None,
    )


def _stretches(motion: Motion, intervals: Iterable[Interval]) -> tuple[model.Stretch, ...]:
    """Intervals in time and on the tool point's way."""
    found = []
    for interval in intervals:
        s0, s1 = (float(value) for value in motion.way(np.array([interval.start, interval.end])))
        found.append(model.Stretch(interval.start, interval.end, s0, s1, interval.cause, interval.worst))
    return tuple(found)


class JudgedPath(NamedTuple):
    """A path's summary and its rows of the stage's tables."""

    path: model.PathSummary
    checks: model.PathChecks
    clearance: model.Clearances
    avoidance: model.AvoidanceRows
    programs: model.ProgramFiles


def _judged(
    task: AvoidanceTask, each: ListedMotion, motion: Motion, settings: TrajectorySettings, assumed_margin: float
) -> JudgedPath:
    """A path with its faults, what avoids them, and its programs; ``assumed_margin``: m, around assumed shapes."""
    robot, limits = task.robot, task.limits
    found = judgement.judged(task, motion)
    avoided = task.avoid(motion, found)
    checks = _checks(robot, motion, found, task.near, limits)
    path = replace(
        path_summary(task, motion, found, avoided, assumed_margin),
        clear_until=judgement.last_safe_stop(task, motion, found, task.margin),
        of_program=tuple(map(finding_at, each.found)),
    )
    path = replace(path, sound_end=judgement.advised_end(path, checks, _limits_used(robot, limits, settings)))
    repair = avoided.rows.take(avoided.rows.strategy == (avoided.chosen or ""))
    close = near_assumed_shapes(robot, each.name, path.clearance, assumed_margin)
    asked = settings.programs, settings.write_unsafe
    programs = program_files(robot, motion, path.verdict, *asked, near=close, repaired=repair, speed=limits.speed)
    clearance = model.Clearances.stacked([judgement.clearance_rows(each.name, "", found.along), avoided.clearance])
    return JudgedPath(path, checks, clearance, avoided.rows, programs)


def compute(study: Study, name: str) -> model.TrajectoryResults:
    """Plan and check every path of a robot, by its name in the study, and write programs of it.

    :class:`InputError` if a file of the study can't be used.
    """
    robot, settings = study.robot(name), study.section(TrajectorySettings)
    plain, assumed_margin = task_of(study, name), study.assumed_margin(name)
    only = None if settings.avoidance == "compare" else settings.avoidance
    task = AvoidanceTask(**vars(plain), only=only, margin=margin_of(plain, assumed_margin))
    listed = list(listed_motions(study.entry(name).paths, task, settings.checks_per_sample))
    judged = [_judged(task, each, each.motion, settings, assumed_margin) for each in listed if each.motion]
    checks = model.PathChecks.stacked([each.checks for each in judged]).of_joints(robot.slides)
    own = checks.take(checks.sample)
    avoidance = model.AvoidanceRows.stacked([each.avoidance for each in judged])
    return model.TrajectoryResults(
        summary=_summary(task, listed, [each.path for each in judged], settings, assumed_margin),
        samples=model.Samples(**{name: getattr(own, name) for name in model.Samples.columns()}).of_joints(robot.slides),
        checks=checks,
        clearance=model.Clearances.stacked([each.clearance for each in judged]),
        avoidance=avoidance.of_joints(robot.slides),
        programs=model.ProgramFiles.stacked([each.programs for each in judged]),
    )


def _summary(
    task: AvoidanceTask,
    listed: Sequence[ListedMotion],
    paths: list[model.PathSummary],
    settings: TrajectorySettings,
    assumed_margin: float,
) -> model.TrajectorySummary:
    """The stage's answer, its paths, and what it did not look at."""
    robot, limits, bodies = task.robot, task.limits, task.bodies
    skipped = [_not_followed(robot, each) for each in listed if each.motion is None]
    safe = [each for each in listed if each.meant_safe]
    turned = [asked for each in safe if each.motion for asked in _asked_of_tool(each.name, each.motion)]
    length, used = characteristic_length(robot), _limits_used(robot, limits, settings)
    clearance = {path.name: path.clearance.least_mm / 1000 for path in paths if path.clearance and path.meant_safe}
    assumed_shapes = shapes_assumed(robot, assumed_margin, clearance)
    covered = covered_collisions(robot, bodies, bodies.scene)
    gaps = (*(gap for each in safe for gap in each.gaps), *gaps_of_orientations(robot, turned))
    return model.TrajectorySummary(
        verdict=_verdict(paths, skipped, assumed_shapes).with_assumed_shapes(assumed_shapes),
        figures=_figures(paths, used, assumed_shapes),
        characteristic_length_m=length,
        near=model.NearThresholds(settings.near_wrist_deg, settings.near_elbow_deg, settings.near_shoulder_mm),
        joint_limits=used,
        scene=bodies.scene.title if bodies.scene else None,
        penetration_tolerance_mm=settings.penetration_tolerance_mm,
        paths=tuple(paths),
        not_followed=tuple(skipped),
        checked=_checked(covered, paths, skipped, gaps),
        assumed=(
            *assumed_rates(speeds_given(robot), not used.acceleration_assumed),
            *by_reason(chosen for each in safe for chosen in each.assumed),
            *assumed_tool(robot),
            *covered.assumed,
        ),
    )


def _not_followed(robot: Robot, listed: ListedMotion) -> model.PathNotFollowed:
    lacking, why = (None, listed.refused.problem) if listed.refused else (wrist_partition_missing(robot), "")
    stops = listed.ends.t if listed.ends else None
    return model.PathNotFollowed(
        listed.name, listed.title, lacking, listed.outcome_unfollowed, listed.expected, stops, why
    )


def _asked_of_tool(name: str, motion: Motion) -> Iterator[tuple[str, Reals, Reals]]:
    """The poses (N, 4, 4) that a path of the tool asks for where joints (N, n) reach it."""
    path, seen = motion.built.tool, np.isfinite(motion.q).all(axis=1)
    if path and seen.any():
        yield name, path.poses(path.progress(motion.t[seen])[0]), motion.q[seen]


def _limits_used(robot: Robot, limits: JointLimits, settings: TrajectorySettings) -> model.LimitsUsed:
    return model.LimitsUsed(
        speed_deg_s=_shown(robot, limits.speed),
        speed_assumed=tuple(bool(value) for value in ~speeds_given(robot)),
        acceleration_deg_s2=_shown(robot, limits.acceleration),
        acceleration_assumed=limits.acceleration_assumed,
        acceleration_time_s=settings.acceleration_time_s,
        jerk_deg_s3=None if limits.jerk is None else _shown(robot, limits.jerk),
    )


def _checked(
    seen: Covered, paths: list[model.PathSummary], skipped: list[model.PathNotFollowed], rest: Iterable[Open]
) -> tuple[Coverage, ...]:
    """What the checks cover of the paths that are given to be run."""
    asked = [each for each in skipped if set(each.expect) <= {"safe"}]
    lost = tuple(f"{each.name}: {each.refused}" if each.refused else each.name for each in asked)
    followed = sum(path.meant_safe for path in paths)
    of = followed, followed
    gaps = (*seen.gaps, *by_reason(rest))
    gaps += (Open("not_followed", lost),) if lost else ()
    checks: dict[Check, tuple[int, int]] = dict.fromkeys(CHECKS_OF_MOTIONS, of)
    return coverages({**checks, "reach": (followed, followed + len(lost)), **seen.asked}, gaps)


def _checks(
    robot: Robot, motion: Motion, found: judgement.Judgement, near: NearSingular, limits: JointLimits
) -> model.PathChecks:
    """One row per check point; joint columns are NaN where the path can't be reached."""
    reached = np.isfinite(found.q[:, 0])
    measures = np.full((len(found.q), 3), np.nan)
    part = conditioning(robot, found.q[reached], characteristic_length(robot))
    measures[reached] = np.stack([part.manipulability, part.condition_number, part.smallest_singular_value], axis=1)
    factors = factors_where_defined(robot, found.q)
    return model.PathChecks.of(
        path=motion.entry.name,
        t_s=found.times,
        s_m=motion.way(found.times),
        q_deg=shown(robot, found.q),
        q_deg_s=shown(robot, found.velocity),
        q_deg_s2=shown(robot, found.acceleration),
        xyz_mm=motion.tool(found.times)[:, :3, 3] * 1000,
        speed_ratio=speed_ratio(found.velocity, limits),
        manipulability=measures[:, 0],
        condition_number=measures[:, 1],
        smallest_singular_value=measures[:, 2],
        wrist_deg=np.degrees(factors.wrist),
        elbow_deg=np.degrees(factors.elbow),
        shoulder_mm=factors.shoulder * 1000,
        reachable=reached,
        within_limits=within(robot, found.q) & reached,
        near_singular=near.contains(robot, found.q),
        sample=np.isin(found.times, motion.samples),
    )


def _verdict(paths: list[model.PathSummary], skipped: list[model.PathNotFollowed], shapes: Finding | None) -> Verdict:
    if unmet := unmet_expectations([*paths, *skipped], "safe"):
        return Verdict("fail", unmet)
    asked = [path for path in paths if path.meant_safe]
    unfollowed = [path for path in skipped if not path.expect]

    by_verdict: dict[PathVerdict, list[str]] = {}
    for path in asked:
        by_verdict.setdefault(path.verdict, []).append(path.name)
    safe, count = sum(model.is_safe(path, shapes) for path in asked), len(asked) + len(unfollowed)
    failed = any(path.fails for path in asked) or any(path.stops_at_s is not None for path in unfollowed)
    failed |= not by_verdict.get("safe")
    status: Status = pass_of([*asked, *unfollowed]) if safe == count else "fail" if failed else "caution"
    found = [each for each in PATH_VERDICTS if each != "safe" and each in by_verdict]
    of_program = tuple(path.name for path in asked if path.verdict == "safe" and path.of_program)
    counts = fact(
        "trajectory.paths",
        paths=count,
        safe=safe,
        faults=tuple(fact("paths_of", outcome=each, names=tuple(by_verdict[each])) for each in found),
        not_followed=tuple(path.name for path in unfollowed),
        of_program=of_program,
        near_assumed=len(by_verdict.get("safe", ())) - safe - len(of_program),
        demonstrations=demonstrations([*paths, *skipped], "safe"),
    )
    return Verdict(status, counts)


def _figures(paths: list[model.PathSummary], limits: model.LimitsUsed, shapes: Finding | None) -> tuple[Figure, ...]:
    asked = [path for path in paths if path.meant_safe]  # demonstrations are counted apart
    events = [event for path in asked for event in path.singularities]
    speeds = [
        (speed, limit, "mm/s" if joint in path.sliding else "deg/s")
        for path in asked
        for joint, (speed, limit) in enumerate(zip(path.max_joint_speed_deg_s or (), limits.speed_deg_s), 1)
    ]
    speed, limit, unit = max(speeds, key=lambda each: each[0] / each[1], default=(None, None, "deg/s"))
    colliding = sum(bool(path.of("collides")) for path in asked)
    return (
        Figure("safe", sum(model.is_safe(path, shapes) for path in asked), "", of=len(asked)),
        Figure("singular_poses", sum(event.crossing for event in events), ""),
        Figure("colliding", colliding, ""),
        Figure("max_joint_speed", speed, unit),
        Figure(
            "assumed_speed_ratio" if any(limits.speed_assumed) else "speed_ratio",
            speed / limit if speed is not None and limit is not None else None,
            "",
        ),
    )


def _shown(robot: Robot, values: Reals) -> tuple[float, ...]:
    return tuple(shown(robot, values).tolist())
