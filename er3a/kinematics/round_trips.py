"""Random joint angles to poses and back: does the inverse find the joints that made the pose?

``batch_round_trips`` tests the batch inverse, ``slot_round_trips`` the closed form; its joint errors leave out poses
near a singularity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.geometry.transforms import rotation_angle
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.by_class import arm_solver, misses, parameters_of
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import NearSingular
from er3a.kinematics.wrist_partitioned import solve_slots
from er3a.numerics.arrays import Flags, Integers
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import shortest_move

SAME_JOINTS_RAD = 1e-6  # a solution so near to the joints drawn is them
NEAR_WRIST_DEG = NEAR_ELBOW_DEG = 0.5
NEAR_SHOULDER_MM = 1.0  # nearer to singularities joints are known less exactly, whatever the solver
NEAR = NearSingular(np.radians(NEAR_WRIST_DEG), np.radians(NEAR_ELBOW_DEG), NEAR_SHOULDER_MM / 1000)
BLOCK = 20_000  # poses at a time
MAX_BY_CLASS = 500  # poses solved in validation for arms without a spherical wrist


@dataclass(frozen=True, eq=False)
class BatchRoundTrips:
    """All solutions of random poses, put back through forward kinematics.

    Attributes
    ----------
    poses : number of random joint vectors
    solutions : number of solutions, all poses together
    worst_position : m; worst_orientation : rad, of any solution put back through forward kinematics
    own_found : number of poses whose own joint angles are among the solutions (to 1e-6 rad, but for turns)
    worst_own : rad, largest joint difference between any pose's own angles and the nearest solution
    counts_within_limits : (S + 1,) int, number of poses with 0 .. S solutions within the limits, S slots of the class
    """

    poses: int
    solutions: int
    worst_position: float
    worst_orientation: float
    own_found: int
    worst_own: float
    counts_within_limits: Integers


@dataclass(frozen=True)
class SlotRoundTrips:
    """Worst errors of random poses taken back to joints.

    Attributes
    ----------
    poses : how many; near_singular : how many of them nearer to a singularity than the margins
    joint_error_deg : worst angle between the joints and the nearest solution, over the other poses
    position_error_mm, orientation_error_deg : worst over all solutions of all poses
    unsolved : poses without any solution
    """

    poses: int
    near_singular: int
    joint_error_deg: float
    position_error_mm: float
    orientation_error_deg: float
    unsolved: int


def batch_round_trips(robot: Robot, random: np.random.Generator, poses: int) -> BatchRoundTrips:
    """Send random joint vectors, uniform within the limits, to poses and back through the batch inverse.

    Parameters
    ----------
    robot : arms with more than six joints are solved at the redundancy parameter of the joints drawn
    random : the generator
    poses : how many

    Returns
    -------
    trips : m and rad
    """
    own = random.uniform(robot.lower, robot.upper, size=(poses, robot.joints))
    T = forward(robot, own)
    solved = inverse_batch(robot, T, own if parameters_of(robot) else None)
    q, valid = solved.q, solved.solved
    position, orientation, _ = misses(robot, np.repeat(T, valid.sum(axis=1), axis=0), q[valid])
    away = q - own[:, None]
    difference = np.abs(shortest_move(robot, away)).max(axis=2)
    difference = np.where(valid, difference, np.inf).min(axis=1)
    return BatchRoundTrips(
        poses=poses,
        solutions=int(valid.sum()),
        worst_position=float(position.max(initial=0.0)),
        worst_orientation=float(orientation.max(initial=0.0)),
        own_found=int((difference < SAME_JOINTS_RAD).sum()),
        worst_own=float(difference.max()),
        counts_within_limits=np.bincount(solved.within_limits.sum(axis=1), minlength=q.shape[1] + 1),
    )


def has_class(robot: Robot) -> bool:
    """Whether a class's solver, not random starts, solves the arm.

    Returns
    -------
    has : False for dependent joints, and for chains of no class
    """
    return arm_solver(robot).chain.code not in ("dependent", "unsolved")


def slot_round_trips(robot: Robot, poses: int, seed: int) -> SlotRoundTrips:
    """Draw joints uniformly within the limits, take them to a pose, solve it in closed form, and compare.

    Parameters
    ----------
    robot : an arm with a closed-form inverse
    poses : how many
    seed : of the draws

    Returns
    -------
    trips : worst errors, mm and deg
    """
    random = np.random.default_rng(seed)
    blocks = [_block(robot, random, min(BLOCK, poses - done)) for done in range(0, poses, BLOCK)]
    near, joint, position, orientation, unsolved = np.array(blocks).T
    return SlotRoundTrips(
        poses=poses,
        near_singular=int(near.sum()),
        joint_error_deg=float(joint.max()),
        position_error_mm=float(position.max()),
        orientation_error_deg=float(orientation.max()),
        unsolved=int(unsolved.sum()),
    )


def _block(robot: Robot, random: np.random.Generator, count: int) -> tuple[float, ...]:
    """Near-singular poses, worst errors (deg, mm, deg) and unsolved poses of a block."""
    q = robot.lower + random.random((count, 6)) * (robot.upper - robot.lower)
    T = forward(robot, q)
    found = solve_slots(robot, T, np.zeros_like(q))[0]
    solved: Flags = np.all(np.isfinite(found), axis=2)
    gap = np.abs(wrap_to_pi(found - q[:, None])).max(axis=2)
    nearest = np.where(solved, gap, np.inf).min(axis=1)

    near = NEAR.contains(robot, q)
    judged = nearest[~near & solved.any(axis=1)]

    rows, slots = np.nonzero(solved)
    back = forward(robot, found[rows, slots])
    position = np.linalg.norm(back[:, :3, 3] - T[rows, :3, 3], axis=1)
    orientation = rotation_angle(back[:, :3, :3], T[rows, :3, :3])
    return (
        float(near.sum()),
        float(np.degrees(judged.max(initial=0.0))),
        float(position.max(initial=0.0) * 1000),
        float(np.degrees(orientation.max(initial=0.0))),
        float((~solved.any(axis=1)).sum()),
    )
