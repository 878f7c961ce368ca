"""Random joint angles to poses and back: does the inverse find the joints that made the pose?"""

from __future__ import annotations

import numpy as np

from er3a.by_value import by_identity
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.by_class import arm_solver, misses, parameters_of
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import NearSingular
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import shortest_move

SAME_JOINTS_RAD = 1e-6  # a solution so near to the joints drawn is them
NEAR_WRIST_DEG = NEAR_ELBOW_DEG = 0.5
NEAR_SHOULDER_MM = 1.0  # nearer to singularities joints are known less exactly, whatever the solver
NEAR = NearSingular(np.radians(NEAR_WRIST_DEG), np.radians(NEAR_ELBOW_DEG), NEAR_SHOULDER_MM / 1000)
MAX_BY_CLASS = 500  # poses solved in validation for arms without a spherical wrist


@by_identity
class BatchRoundTrips:
    """All solutions of random poses, put back through forward kinematics.

    Attributes
    ----------
    poses : number of random joint vectors
    solutions : number of solutions, all poses together
    worst_position : m; worst_orientation : rad, of any solution put back through forward kinematics
    own_found : number of poses whose own joint angles are among the solutions (to 1e-6 rad, but for turns)
    worst_own : rad, largest joint difference between any pose's own angles and the nearest solution
    near_singular : number of poses nearer to a singularity than ``NEAR``; worst_regular : as ``worst_own``, of the
        others
    unsolved : number of poses without any solution
    within_limits : number of solutions within the limits, all poses together
    """

    poses: int
    solutions: int
    worst_position: float
    worst_orientation: float
    own_found: int
    worst_own: float
    near_singular: int
    worst_regular: float
    unsolved: int
    within_limits: int


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
    near = NEAR.contains(robot, own)
    return BatchRoundTrips(
        poses=poses,
        solutions=int(valid.sum()),
        worst_position=float(position.max(initial=0.0)),
        worst_orientation=float(orientation.max(initial=0.0)),
        own_found=int((difference < SAME_JOINTS_RAD).sum()),
        worst_own=float(difference.max()),
        near_singular=int(near.sum()),
        worst_regular=float(difference[~near & valid.any(axis=1)].max(initial=0.0)),
        unsolved=int((~valid.any(axis=1)).sum()),
        within_limits=int(solved.within_limits.sum()),
    )


def has_class(robot: Robot) -> bool:
    """Whether a class's solver, not random starts, solves the arm.

    Returns
    -------
    has : False for dependent joints, and for chains of no class
    """
    return arm_solver(robot).chain.code not in ("dependent", "unsolved")
