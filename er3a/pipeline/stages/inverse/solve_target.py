"""One target: all its solutions as a table, and what the summary holds of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from er3a.collision.pairs import PairOverlaps
from er3a.collision.scene import Scene
from er3a.geometry.transforms import rotation_angle, rpy_of
from er3a.kinematics.by_class import task_mask
from er3a.kinematics.closed_form import ORIENTATION
from er3a.kinematics.cuspidal import cuspidal_move
from er3a.kinematics.families import Family
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.neighbours import neighbours
from er3a.kinematics.self_motions import SelfMotionCurve
from er3a.kinematics.singularity import TYPES, characteristic_length, conditioning, determinant_factors
from er3a.kinematics.solutions import ByClass, Method, Solutions
from er3a.kinematics.targets import Target, TargetOutcome
from er3a.kinematics.wrist_partitioned import has_branches, solve_slots
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.pipeline.stages.inverse.inverse_findings import (
    Advice,
    AtSingularity,
    BranchesCollide,
    BranchesLeaveLimits,
    MoveObstacle,
    NearLimit,
    NothingFound,
    Obstacle,
    ReachMissing,
    ShiftingDoesNotHelp,
    ShiftTool,
    TiltMissing,
    TurningDoesNotHelp,
    TurnTool,
)
from er3a.pipeline.stages.inverse.model import SINGULAR_PARTS, NeighbourPoses, SelfMotion, SolutionRows, TargetResult
from er3a.robots.joint_limits import limit_margin
from er3a.robots.robot import Robot
from er3a.robots.shown import shown
from er3a.selection.nearest import AllCollide, Choice, Refusal, nearest
from er3a.selection.select import refusals

SINGULAR = 1e-6
LITTLE_MARGIN_DEG = 2.0


@dataclass(frozen=True, eq=False)
class SolvedTarget:
    """What the summary holds of a target, one row for each of its solutions, and what they were made from."""

    result: TargetResult
    rows: SolutionRows
    solutions: Solutions


def solve_target(
    robot: Robot,
    target: Target,
    random: np.random.Generator,
    scene: Scene | None = None,
    many: bool = False,
    advise: bool = True,
) -> SolvedTarget:
    """Solve, choose, explain; solutions that collide with the scene or with themselves are not chosen.

    One of ``many``: only the turn nearest to the reference is kept of each arm. With ``advise`` what would help a pose
    without solution is looked for.
    """
    solutions = inverse(robot, target.T, target.q_ref, self_motion_rows=True)
    if many:
        solutions = solutions.without_turns()
    refused = refusals(robot, solutions, scene)
    choice = nearest(robot, solutions, target.q_ref, refused)
    rows = _rows(robot, target, solutions, choice, refused)
    found, within = np.unique(rows.branch), np.unique(rows.branch[rows.within_limits])
    chosen = choice.chosen
    near: NeighbourPoses | None = None
    obstacle: Obstacle | None = None
    advice: tuple[Advice, ...] = ()
    if chosen is not None:
        advice = _what_to_know(rows, chosen)
    elif isinstance(choice.reason, AllCollide):
        obstacle, advice = BranchesCollide(len(within)), (MoveObstacle(),)
    else:
        obstacle = _obstacle(robot, target, solutions, len(found))
        if advise and has_branches(robot):
            near = _neighbours(robot, target, random)
            advice = _what_would_help(near)
    x, y, z = (target.T[:3, 3] * 1000).tolist()
    quaternion = scipy.spatial.transform.Rotation.from_matrix(target.T[:3, :3]).as_quat(
        canonical=True, scalar_first=True
    )
    result = TargetResult(
        name=target.name,
        note=target.note,
        xyz_mm=(x, y, z),
        rpy_deg=tuple(np.degrees(rpy_of(target.T)).tolist()),
        quaternion_wxyz=tuple(quaternion.tolist()),
        q_ref_deg=target.q_ref_deg,
        solutions=len(found),
        within_limits=len(within),
        rows_within_limits=int(rows.within_limits.sum()),
        collide=len(np.unique(rows.branch[collides(rows)])),
        chosen_deg=None if chosen is None else tuple(rows.q_deg[chosen].tolist()),
        chosen_branch=None if chosen is None else int(rows.branch[chosen]),
        reason=choice.reason,
        obstacle=obstacle,
        outcome=_outcome(obstacle),
        expect=target.expect,
        unsolved=solutions.unsolved,
        method=_method(robot, solutions.method),
        families=tuple(map(_self_motion, solutions.families)),
        neighbours=near,
        advice=advice,
    )
    return SolvedTarget(result, rows, solutions)


def collides(rows: SolutionRows) -> Flags:
    """Which rows are refused because something overlaps."""
    return np.array([isinstance(why, PairOverlaps) for why in rows.refusal], dtype=bool)


def _rows(
    robot: Robot, target: Target, solutions: Solutions, choice: Choice, refused: tuple[Refusal | None, ...]
) -> SolutionRows:
    q, T, count = solutions.q, target.T, len(solutions.q)
    back = forward(robot, q)
    rank = np.zeros(count, dtype=int)
    rank[choice.order] = np.arange(1, len(choice.order) + 1)
    why = np.full(count, None, dtype=object)
    why[:] = refused
    return SolutionRows(
        target=np.full(count, target.name, dtype=object),
        branch=solutions.branch,
        label=solutions.label,
        q_deg=shown(robot, q) + 0.0,
        turn=solutions.turn,
        within_limits=solutions.within_limits,
        refusal=why,
        rank=rank,
        first_of_branch=_first_of_branch(solutions.branch, rank),
        position_residual_mm=np.linalg.norm(back[:, :3, 3] - T[:3, 3], axis=1) * 1000,
        orientation_residual_deg=np.degrees(_missed_orientation(robot, back[:, :3, :3], T[:3, :3])),
        manipulability=conditioning(robot, q, characteristic_length(robot)).manipulability,
        singular=_singular(robot, solutions),
        limit_margin_deg=np.degrees(limit_margin(robot, q)),
        greatest_move_deg=np.degrees(choice.greatest_move),
        distance_deg=np.degrees(choice.distance),
    )


def _missed_orientation(robot: Robot, R: Reals, asked: Reals) -> Reals:
    """By how much (n,), rad, rotations R (n, 3, 3) miss the one asked for, in what the arm's task asks of it."""
    mask = task_mask(robot)[3:]
    if mask.all():
        return rotation_angle(R, np.tile(asked, (len(R), 1, 1)))
    if not len(R):
        return np.zeros(0)
    missed = scipy.spatial.transform.Rotation.from_matrix(asked.T @ R).as_rotvec()
    return np.asarray(np.linalg.norm(mask * missed, axis=1), dtype=float)


def _singular(robot: Robot, solutions: Solutions) -> Flags:
    """Which of ``SINGULAR_PARTS`` each row is on, (n, 4); arms without closed form by the Jacobian's rank."""
    found = np.zeros((len(solutions.q), len(SINGULAR_PARTS)), dtype=bool)
    if has_branches(robot):
        factors = determinant_factors(robot, solutions.q)
        for column, kind in enumerate(TYPES):
            found[:, column] = np.abs(getattr(factors, kind)) < SINGULAR
    else:
        smallest = conditioning(robot, solutions.q, characteristic_length(robot)).smallest_singular_value
        found[:, SINGULAR_PARTS.index("rank")] = smallest < SINGULAR
    return found


def _first_of_branch(branch: Integers, rank: Integers) -> Flags:
    order = np.lexsort((np.arange(len(rank)), rank == 0, rank))
    first = np.zeros(len(rank), dtype=bool)
    seen: set[int] = set()
    for row in order:
        if branch[row] not in seen:
            seen.add(branch[row])
            first[row] = True
    return first


def _self_motion(family: Family | SelfMotionCurve) -> SelfMotion:
    low, high = np.degrees(family.range).tolist()
    return SelfMotion(
        kind=family.kind,
        q0_deg=tuple(shown(family.robot, family.q0).tolist()),
        direction=tuple((shown(family.robot, family.direction) / np.degrees(1.0)).tolist()),
        range_deg=(low, high),
        within_limits=family.within_limits,
        branches=family.branches,
        dimension=family.dimension,
    )


def _method(robot: Robot, method: Method) -> Method:
    """The method, with what is known of numbered branches."""
    if isinstance(method, ByClass) and not method.named and method.arm_class == "general_six":
        return replace(method, cuspidal=cuspidal_move(robot) is not None)
    return method


def _obstacle(robot: Robot, target: Target, solutions: Solutions, branches: int) -> Obstacle:
    """Why there is no solution within the limits: of the branch that misses the pose by least."""
    if branches:
        return BranchesLeaveLimits(branches)
    if not has_branches(robot):
        return NothingFound()
    _, fault, gap = (batch[0] for batch in solve_slots(robot, target.T[None], target.q_ref[None]))
    least = int(gap.argmin())
    if fault[least] == ORIENTATION:
        return TiltMissing(float(np.degrees(gap[least])))
    return ReachMissing(float(gap[least] * 1000))


def _outcome(obstacle: Obstacle | None) -> TargetOutcome:
    match obstacle:
        case None:
            return "reached"
        case BranchesLeaveLimits():
            return "leaves limits"
        case BranchesCollide():
            return "collides"
        case _:
            return "unreachable"


def _neighbours(robot: Robot, target: Target, random: np.random.Generator) -> NeighbourPoses:
    near = neighbours(robot, target.T, random)
    return NeighbourPoses(
        orientation_ratio=near.orientation_ratio,
        least_turn_deg=None if near.least_turn is None else float(np.degrees(near.least_turn)),
        least_shift_mm=None if near.least_shift is None else near.least_shift * 1000,
        shifted_to_mm=None if near.shifted_to is None else _triple(near.shifted_to * 1000),
    )


def _triple(vector: Reals) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


def _what_would_help(near: NeighbourPoses) -> tuple[Advice, ...]:
    turn: Advice = TurningDoesNotHelp()
    if near.least_turn_deg is not None:
        turn = TurnTool(near.orientation_ratio, near.least_turn_deg)
    shift: Advice = ShiftingDoesNotHelp()
    if near.least_shift_mm is not None and near.shifted_to_mm is not None:
        shift = ShiftTool(near.least_shift_mm, near.shifted_to_mm)
    return turn, shift


def _what_to_know(rows: SolutionRows, chosen: int) -> tuple[Advice, ...]:
    found: list[Advice] = [AtSingularity(kind) for kind, on in zip(TYPES, rows.singular[chosen]) if on]
    margin = float(rows.limit_margin_deg[chosen])
    return (*found, NearLimit(margin)) if margin < LITTLE_MARGIN_DEG else tuple(found)
