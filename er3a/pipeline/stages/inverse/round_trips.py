"""Random joint angles to poses and back: does the solver find the arm that made the pose?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.geometry.angles import wrap_to_pi
from er3a.geometry.transforms import rotation_angle
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.closed_form import SLOTS
from er3a.kinematics.forward import forward
from er3a.robots.robot import Robot

SAME_JOINTS_RAD = 1e-6


@dataclass(frozen=True, eq=False)
class RoundTrips:
    """Outcome of the round trips.

    Attributes
    ----------
    poses : number of random joint vectors
    solutions : number of solutions, all poses together
    worst_position : m; worst_orientation : rad, of any solution put back through forward kinematics
    own_found : number of poses whose own joint angles are among the solutions (to 1e-6 rad, turns apart)
    worst_own : rad, greatest joint difference between any pose's own angles and the nearest solution
    counts_within_limits : (9,) int, number of poses with 0 .. 8 solutions within the limits
    """

    poses: int
    solutions: int
    worst_position: float
    worst_orientation: float
    own_found: int
    worst_own: float
    counts_within_limits: np.ndarray


def round_trips(robot: Robot, random: np.random.Generator, poses: int) -> RoundTrips:
    """Send that many joint vectors, uniform within the limits, to poses and back."""
    own = random.uniform(robot.lower, robot.upper, size=(poses, 6))
    T = forward(robot, own)
    solved = inverse_batch(robot, T)
    q, valid = solved.q, solved.valid
    back = forward(robot, q[valid])
    asked = np.repeat(T, valid.sum(axis=1), axis=0)
    apart = np.abs(wrap_to_pi(q - own[:, None])).max(axis=2)
    apart = np.where(valid, apart, np.inf).min(axis=1)
    return RoundTrips(
        poses=poses,
        solutions=int(valid.sum()),
        worst_position=float(np.linalg.norm(back[:, :3, 3] - asked[:, :3, 3], axis=1).max(initial=0.0)),
        worst_orientation=float(rotation_angle(back[:, :3, :3], asked[:, :3, :3]).max(initial=0.0)),
        own_found=int((apart < SAME_JOINTS_RAD).sum()),
        worst_own=float(apart.max()),
        counts_within_limits=np.bincount(solved.within_limits.sum(axis=1), minlength=SLOTS + 1),
    )
