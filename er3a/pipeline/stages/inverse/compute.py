"""Solve each target of the study, choose among its solutions, and try the solver on random poses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from er3a.collision.clearance import bodies_of
from er3a.files.scene_file import load_scene
from er3a.files.target_file import load_targets
from er3a.kinematics.by_class import arm_solver
from er3a.kinematics.classes.chain_solvers import Unsolved
from er3a.kinematics.round_trips import MOST_BY_CLASS, SAME_JOINTS_RAD, BatchRoundTrips, batch_round_trips
from er3a.kinematics.targets import MANY_TARGETS
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.pipeline.progress import shown_progress
from er3a.pipeline.results import Figure, Verdict
from er3a.pipeline.stages.expectations import ExpectationsUnmet, demonstrations, unmet_expectations
from er3a.pipeline.stages.inverse.entry import InverseSettings
from er3a.pipeline.stages.inverse.inverse_findings import (
    AllSolved,
    NoneSolved,
    NotReproduced,
    SomeUnsolved,
    UnsolvedTarget,
)
from er3a.pipeline.stages.inverse.model import (
    InverseResults,
    InverseSummary,
    MapRows,
    RankingRows,
    RoundTrips,
    SolutionRows,
    TargetResult,
)
from er3a.pipeline.stages.inverse.rankings import rankings, sequence
from er3a.pipeline.stages.inverse.solution_map import solution_map
from er3a.pipeline.stages.inverse.solve_target import SolvedTarget, solve_target
from er3a.pipeline.stages.trajectory.entry import TrajectorySettings
from er3a.pipeline.stages.trajectory.motion_demands import limits_of
from er3a.pipeline.study import Study

STAGE = "inverse"
REPRODUCED_M = 1e-9
REPRODUCED_RAD = 1e-9
MOST_ADVISED = 100  # of many targets those for which it is looked for what would help
ADVICE_STREAM, ROUND_TRIP_STREAM = 0, 1


def compute(study: Study, name: str) -> InverseResults:
    """Solve the targets of a robot of the study."""
    robot = study.robot(name)
    targets = load_targets(study.entry(name).targets, robot)
    settings, motion = study.section(InverseSettings), study.section(TrajectorySettings)
    scene_file = study.scene(name, STAGE)
    scene = load_scene(scene_file) if scene_file else None
    many, advised, solved = len(targets) > MANY_TARGETS, 0, list[SolvedTarget]()
    with shown_progress(len(targets), f"{name}: targets solved") as advance:
        for number, target in enumerate(targets):
            random = np.random.default_rng([study.seed, ADVICE_STREAM, number])
            solved.append(solve_target(robot, target, random, scene, many, not many or advised < MOST_ADVISED))
            advised += solved[-1].result.neighbours is not None
            advance(1)
    ranked = [rankings(robot, target, one, scene, settings.mix) for target, one in zip(targets, solved)]
    solutions = SolutionRows.stacked(one.rows for one in solved).of_joints(robot.slides)
    results = tuple(one.result for one in solved)
    complete = not isinstance(arm_solver(robot).chain, Unsolved)
    random = np.random.default_rng([study.seed, ROUND_TRIP_STREAM])
    wanted = settings.round_trips if has_branches(robot) else min(settings.round_trips, MOST_BY_CLASS)
    trips = batch_round_trips(robot, random, wanted) if complete else None
    worst = _worst_residuals(solutions, trips)
    summary = InverseSummary(
        verdict=_verdict(results, worst, trips, scene is not None).without(bodies_of(robot, scene).unexamined),
        figures=_figures(results, worst, trips),
        mix=settings.mix,
        scene=scene.title if scene else None,
        turns=not many,
        targets=results,
        sequence=sequence(robot, targets, solved, limits_of(robot, motion).acceleration),
        round_trips=_round_trips(trips) if trips else None,
    )
    number_of_solutions = solution_map(robot, settings.map_cells, scene) if has_branches(robot) else MapRows.empty()
    return InverseResults(summary, solutions, RankingRows.stacked(ranked), number_of_solutions)


def _verdict(
    targets: Sequence[TargetResult], worst: tuple[float, float], trips: BatchRoundTrips | None, collisions: bool
) -> Verdict[AllSolved | SomeUnsolved | NoneSolved | NotReproduced | ExpectationsUnmet]:
    position, orientation = worst
    lost = trips.poses - trips.own_found if trips else 0
    if lost or position > REPRODUCED_M or orientation > REPRODUCED_RAD:
        return Verdict("fail", NotReproduced(position * 1000, float(np.degrees(orientation)), lost))
    if unmet := unmet_expectations(targets):
        return Verdict("fail", unmet)
    shown = demonstrations(targets, "reached")
    asked = [target for target in targets if target.expect in (None, "reached")]
    unsolved = tuple(UnsolvedTarget(target.name, target.obstacle) for target in asked if target.obstacle)
    count, solved = len(asked), len(asked) - len(unsolved)
    if not unsolved:
        return Verdict("pass", AllSolved(count, solved, unsolved, collisions, shown))
    if not solved:
        return Verdict("fail", NoneSolved(count, solved, unsolved, collisions, shown))
    return Verdict("caution", SomeUnsolved(count, solved, unsolved, collisions, shown))


def _figures(
    targets: Sequence[TargetResult], worst: tuple[float, float], trips: BatchRoundTrips | None
) -> tuple[Figure, ...]:
    position, orientation = worst
    solved = sum(target.chosen_deg is not None for target in targets)
    return (
        Figure("targets_solved", solved, "", of=len(targets)),
        *(_of_random_poses(trips) if trips else ()),
        Figure("worst_position_residual", position * 1000, "mm"),
        Figure("worst_orientation_residual", float(np.degrees(orientation)), "deg"),
    )


def _of_random_poses(trips: BatchRoundTrips) -> tuple[Figure, ...]:
    counts = trips.counts_within_limits
    mean = float(counts @ np.arange(len(counts)) / trips.poses)
    deviation = float(np.sqrt(counts @ (np.arange(len(counts)) - mean) ** 2 / max(trips.poses - 1, 1)))
    return (
        Figure("solutions_of_random_pose", mean, "", 1.96 * deviation / trips.poses**0.5, of=len(counts) - 1),
        Figure("random_poses_solved_back", 100.0 * trips.own_found / trips.poses, "%"),
    )


def _worst_residuals(solutions: SolutionRows, trips: BatchRoundTrips | None) -> tuple[float, float]:
    """Over all targets' solutions and all round trips, m and rad."""
    position = solutions.position_residual_mm / 1000
    orientation = np.radians(solutions.orientation_residual_deg)
    return (
        float(position.max(initial=trips.worst_position if trips else 0.0)),
        float(orientation.max(initial=trips.worst_orientation if trips else 0.0)),
    )


def _round_trips(trips: BatchRoundTrips) -> RoundTrips:
    return RoundTrips(
        poses=trips.poses,
        solutions=trips.solutions,
        own_found=trips.own_found,
        same_joints_deg=float(np.degrees(SAME_JOINTS_RAD)),
        worst_own_deg=float(np.degrees(trips.worst_own)) if np.isfinite(trips.worst_own) else None,
        worst_position_mm=trips.worst_position * 1000,
        worst_orientation_deg=float(np.degrees(trips.worst_orientation)),
        counts_within_limits=tuple(trips.counts_within_limits.tolist()),
    )
