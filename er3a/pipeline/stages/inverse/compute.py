"""Solve each target of the study, and choose among its solutions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from er3a.by_value import by_identity
from er3a.collision.along import bodies_of
from er3a.collision.scene import Scene
from er3a.collision.shapes import shapes_assumed
from er3a.files.target_file import load_targets
from er3a.finding import Amount, Finding, fact, is_one
from er3a.geometry.transforms import quaternion_of, rpy_of
from er3a.kinematics.by_class import misses
from er3a.kinematics.closed_form import ORIENTATION
from er3a.kinematics.inverse import inverse
from er3a.kinematics.neighbours import Usable, neighbours
from er3a.kinematics.singularity import TYPES, characteristic_length, conditioning
from er3a.kinematics.solutions import MANY_TARGETS, Solutions, Target, TargetOutcome
from er3a.kinematics.wrist_partitioned import has_branches, solve_slots
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.si_units import stated
from er3a.pipeline.progress import shown_work
from er3a.pipeline.results import Figure, Verdict
from er3a.pipeline.scope import Coverage, Open, coverages
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.covered import (
    Covered,
    assumed_tool,
    covered_collisions,
    gaps_in_solids,
    gaps_of_orientations,
)
from er3a.pipeline.stages.expectations import demonstrations, pass_of, unmet_expectations
from er3a.pipeline.stages.inverse import model
from er3a.pipeline.study import Study
from er3a.robots.joint_limits import limit_margin, meant, shown, unit_compared
from er3a.robots.robot import Robot
from er3a.selection.nearest import Choice
from er3a.selection.regular_first import regular_first, singular
from er3a.selection.select import refusals

LITTLE_MARGIN_DEG = 2.0  # mm of a prismatic joint; as much as grasps and boxes are asked for by default


@by_identity
class SolvedTarget:
    """What the summary holds of a target, one row for each of its solutions, and what they were made from."""

    result: model.TargetResult
    rows: model.SolutionRows
    solutions: Solutions


def solve_target(
    robot: Robot,
    target: Target,
    scene: Scene | None = None,
    *,
    many: bool = False,
    advise: bool = True,
    clearance: float = 0.0,
) -> SolvedTarget:
    """Solve, choose, explain; solutions that collide with the scene or with themselves are not chosen.

    One of ``many``: only the turn nearest to the reference is kept of each arm. With ``advise`` what would help a pose
    without solution is searched for: poses where the arm keeps a ``clearance`` (m) and ``LITTLE_MARGIN_DEG``.
    """
    solutions = inverse(robot, target.T, target.q_ref, self_motion_rows=True)
    if many:
        solutions = solutions.without_turns()
    refused = refusals(robot, solutions, scene)
    choice = regular_first(robot, solutions, target.q_ref, refused)
    rows = _rows(robot, target, solutions, choice, refused)
    found, within = np.unique(rows.branch), np.unique(rows.branch[rows.within_limits])
    chosen = choice.chosen
    near: model.NeighbourPoses | None = None
    obstacle: Finding | None = None
    advice: tuple[Finding, ...] = ()
    if chosen is not None:
        advice = _what_to_know(robot, rows, chosen)
    else:
        if is_one(choice.reason, "all_collide"):
            obstacle = fact("branches_collide", count=len(within))
            alone = scene is not None and _usable(robot, None, clearance)(solutions.q[solutions.within_limits]).any()
            advice = (fact("move_obstacle"),) if alone else ()
        else:
            obstacle = _obstacle(robot, target, len(found))
        if advise and has_branches(robot):
            usable = _usable(robot, scene, clearance)
            near = stated(model.NeighbourPoses, neighbours(robot, target.T, usable))
            advice = (*advice, *_what_would_help(near, clearance))
    result = stated(
        model.TargetResult,
        target,
        xyz=target.T[:3, 3],
        rpy=rpy_of(target.T),
        quaternion_wxyz=quaternion_of(target.T),
        q_ref_deg=target.q_ref_deg,
        solutions=len(found),
        within_limits=len(within),
        chosen_deg=None if chosen is None else tuple(rows.q_deg[chosen].tolist()),
        reason=choice.reason,
        obstacle=obstacle,
        outcome=_outcome(obstacle),
        unsolved=() if is_one(choice.reason, "no_solution") else solutions.unsolved,
        method=solutions.method,
        neighbours=near,
        advice=advice,
    )
    return SolvedTarget(result, rows, solutions)


def collides(rows: model.SolutionRows) -> Flags:
    """Which solutions are refused because something overlaps.

    Parameters
    ----------
    rows : of one target or several

    Returns
    -------
    collides : (rows,); others may be refused for other reasons
    """
    return np.array([is_one(why, "pair_overlaps") for why in rows.refusal], dtype=bool)


def _rows(
    robot: Robot, target: Target, solutions: Solutions, choice: Choice, refused: tuple[Finding | None, ...]
) -> model.SolutionRows:
    q, count = solutions.q, len(solutions.q)
    position, orientation, freed = misses(robot, target.T, q)
    rank = np.zeros(count, dtype=int)
    rank[choice.order] = np.arange(1, len(choice.order) + 1)
    return model.SolutionRows.of(
        solutions,
        target=target.name,
        q_deg=shown(robot, q) + 0.0,
        refusal=refused,
        rank=rank,
        first_of_branch=_first_of_branch(solutions.branch, rank),
        position_residual=position,
        orientation_residual=orientation,
        freed_turn=freed,
        manipulability=conditioning(robot, q, characteristic_length(robot)).manipulability,
        singular=singular(robot, solutions),
        limit_margin=limit_margin(robot, q),
        greatest_move=choice.max_joint_move,
        distance=choice.distance,
    )


def _first_of_branch(branch: Integers, rank: Integers) -> Flags:
    order = np.lexsort((np.arange(len(rank)), rank == 0, rank))
    first = np.zeros(len(rank), dtype=bool)
    seen: set[int] = set()
    for row in order:
        if branch[row] not in seen:
            seen.add(branch[row])
            first[row] = True
    return first


def _obstacle(robot: Robot, target: Target, branches: int) -> Finding:
    """Why there is no solution within the limits: of the branch that misses the pose by least."""
    if branches:
        return fact("branches_leave_limits", count=branches)
    if not has_branches(robot):
        return fact("nothing_found")
    _, fault, gap = (batch[0] for batch in solve_slots(robot, target.T[None], target.q_ref[None]))
    smallest = int(gap.argmin())
    if fault[smallest] == ORIENTATION:
        return fact("tilt_missing", angle_deg=float(np.degrees(gap[smallest])))
    return fact("reach_missing", gap_mm=float(gap[smallest] * 1000))


def _outcome(obstacle: Finding | None) -> TargetOutcome:
    match obstacle:
        case None:
            return "reached"
        case Finding(code="branches_leave_limits"):
            return "leaves limits"
        case Finding(code="branches_collide"):
            return "collides"
        case _:
            return "unreachable"


def _usable(robot: Robot, scene: Scene | None, clearance: float) -> Usable:
    """Which arms could be advised: with little margin neither to the limits nor to what they may not touch."""
    bodies = bodies_of(robot, scene)

    def usable(q: Reals) -> Flags:
        kept: Flags = limit_margin(robot, q) >= np.radians(LITTLE_MARGIN_DEG)
        kept[kept] = bodies.free(q[kept], clearance)
        return kept

    return usable


def _what_would_help(near: model.NeighbourPoses, clearance: float) -> tuple[Finding, ...]:
    turn = fact("turning_does_not_help")
    if near.least_turn_deg is not None and near.turned_to_deg is not None:
        turn = fact(
            "turn_tool",
            orientation_ratio=near.orientation_ratio,
            least_turn_deg=near.least_turn_deg,
            to_deg=near.turned_to_deg,
            margin_deg=LITTLE_MARGIN_DEG,
            clearance_mm=1000 * clearance,
        )
    shift = fact("shifting_does_not_help")
    if near.least_shift_mm is not None and near.shifted_to_mm is not None:
        shift = fact(
            "shift_tool",
            shift_mm=near.least_shift_mm,
            to_mm=near.shifted_to_mm,
            margin_deg=LITTLE_MARGIN_DEG,
            clearance_mm=1000 * clearance,
        )
    return turn, shift


def _what_to_know(robot: Robot, rows: model.SolutionRows, chosen: int) -> tuple[Finding, ...]:
    found: list[Finding] = [fact("at_singularity", kind=kind) for kind, on in zip(TYPES, rows.singular[chosen]) if on]
    margin = float(rows.limit_margin_deg[chosen])
    near = fact("near_limit", margin=Amount(margin, unit_compared(robot)))
    return (*found, near) if margin < LITTLE_MARGIN_DEG else tuple(found)


STAGE_NAME = "inverse"
REPRODUCED_M = 1e-9  # by which a solution may miss its target: far above the rounding of a solution in closed form
REPRODUCED_RAD = 1e-9
STACKED = 200  # tables of targets
MAX_ADVISED = 100  # of many targets those for which it is looked for what would help


def compute(study: Study, name: str) -> model.InverseResults:
    """Solve the targets of a robot of the study, and choose among their solutions.

    Parameters
    ----------
    name : of a robot

    Returns
    -------
    results : the same on every run with the study's seed

    Raises
    ------
    InputError
        naming file and field that can't be used
    """
    robot = study.robot(name)
    targets = load_targets(study.entry(name).targets, robot)
    motion = study.section(TrajectorySettings)
    scene = study.scene(name, STAGE_NAME)
    margin = study.assumed_margin(name)
    assumed = shapes_assumed(robot, margin, {})
    clearance = margin if assumed else motion.penetration_tolerance_mm / 1000
    many, advised, stacks, solved = len(targets) > MANY_TARGETS, 0, 0, list[model.TargetResult]()
    rows = list[model.SolutionRows]()
    with shown_work(f"{name}: solving {len(targets)} targets"):
        for target in targets:
            advise = not many or advised < MAX_ADVISED
            one = solve_target(robot, target, scene, many=many, advise=advise, clearance=clearance)
            advised += one.result.neighbours is not None
            solved.append(one.result)
            if len(one.rows):
                rows.append(one.rows)
            if len(rows) - stacks == STACKED:  # thousands of tables of few rows would fill the memory
                rows[stacks:] = [model.SolutionRows.stacked(rows[stacks:])]
                stacks += 1
    solutions = model.SolutionRows.stacked(rows).of_joints(robot.slides)
    rows.clear()
    results = _with_clearance(robot, scene, solved)
    asked = [each for each in results if each.chosen_deg is not None and each.expect in (None, "reached")]
    chosen = meant(robot, np.reshape([each.chosen_deg for each in asked], (-1, robot.joints)))
    T_of = {target.name: target.T for target in targets}
    smallest = {each.name: each.clearance.least_mm / 1000 for each in asked if each.clearance}
    rests_on = shapes_assumed(robot, margin, smallest)
    covered = covered_collisions(robot, bodies_of(robot, scene), scene)
    worst = (
        float(solutions.position_residual_mm.max(initial=0.0)) / 1000,
        float(np.radians(solutions.orientation_residual_deg).max(initial=0.0)),
    )
    summary = model.InverseSummary(
        verdict=_verdict(results, worst, bool(scene and scene.solids)).with_assumed_shapes(rests_on),
        figures=_figures(results, worst),
        scene=scene.title if scene else None,
        turns=not many,
        targets=tuple(model.shown_targets(results)) if many else results,
        checked=_checked(
            results,
            covered,
            (
                *gaps_of_orientations(robot, ((each.name, T_of[each.name], q) for each, q in zip(asked, chosen))),
                *gaps_in_solids(scene, ((each.name, T_of[each.name][:3, 3], 0.0) for each in asked)),
            ),
        ),
        assumed=(*_assumed(results), *assumed_tool(robot), *covered.assumed),
    )
    return model.InverseResults(summary, _target_rows(results), solutions)


def _target_rows(targets: Sequence[model.TargetResult]) -> model.TargetRows:
    return model.TargetRows.of_rows(
        (
            each.name,
            each.xyz_mm,
            each.outcome,
            each.expect or "",
            each.obstacle,
            each.clearance.least_mm if each.clearance else np.nan,
        )
        for each in targets
    )


def _with_clearance(
    robot: Robot, scene: Scene | None, targets: list[model.TargetResult]
) -> tuple[model.TargetResult, ...]:
    """The targets with the clearance of their chosen solutions."""
    bodies, chosen = bodies_of(robot, scene), [k for k, each in enumerate(targets) if each.chosen_deg is not None]
    q = meant(robot, np.reshape([targets[k].chosen_deg for k in chosen], (-1, robot.joints)))
    for k, distance, pair in zip(chosen, *bodies.min_distance(q)):
        if pair >= 0:
            nearest = model.TargetClearance(float(1000 * distance), bodies.pairs[pair])
            targets[k] = replace(targets[k], clearance=nearest)
    return tuple(targets)


def _checked(targets: Sequence[model.TargetResult], seen: Covered, gaps: Iterable[Open]) -> tuple[Coverage, ...]:
    """What the checks cover of the targets that are to be reached."""
    asked = [each for each in targets if each.expect in (None, "reached")]
    all_of = len(asked), len(asked)
    return coverages({"reach": all_of, "limits": all_of, **seen.asked}, (*seen.gaps, *gaps))


def _assumed(targets: Sequence[model.TargetResult]) -> tuple[Open, ...]:
    """Targets whose solutions may not be all that there are."""
    names = tuple(
        each.name
        for each in targets
        if is_one(each.method, "iteration") or (is_one(each.method, "by_class") and not each.method.certain)
    )
    return (Open("solutions_complete", names),) if names else ()


def _verdict(targets: Sequence[model.TargetResult], worst: tuple[float, float], collisions: bool) -> Verdict:
    position, orientation = worst
    if position > REPRODUCED_M or orientation > REPRODUCED_RAD:
        return Verdict(
            "fail",
            fact("inverse.not_reproduced", worst_mm=position * 1000, worst_deg=float(np.degrees(orientation))),
        )
    if unmet := unmet_expectations(targets, "reached"):
        return Verdict("fail", unmet)
    asked = [target for target in targets if target.expect in (None, "reached")]
    unsolved = tuple(
        fact("unsolved_target", name=target.name, obstacle=target.obstacle) for target in asked if target.obstacle
    )
    singular = tuple(each.name for each in asked if any(is_one(it, "at_singularity") for it in each.advice))
    solved = len(asked) - len(unsolved)
    found = fact(
        "inverse.targets",
        targets=len(asked),
        solved=solved,
        unsolved=unsolved,
        collisions=collisions,
        demonstrations=demonstrations(targets, "reached"),
        singular=singular if solved else (),
    )
    return Verdict(pass_of(asked) if not unsolved else "caution" if solved else "fail", found)


def _figures(targets: Sequence[model.TargetResult], worst: tuple[float, float]) -> tuple[Figure, ...]:
    position, orientation = worst
    asked = [target for target in targets if target.expect in (None, "reached")]  # demonstrations are counted apart
    solved = sum(target.chosen_deg is not None for target in asked)
    return (
        Figure("targets_solved", solved, "", of=len(asked)),
        Figure("worst_position_residual", position * 1000, "mm"),
        Figure("worst_orientation_residual", float(np.degrees(orientation)), "deg"),
    )
