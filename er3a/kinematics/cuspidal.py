"""Whether an arm can change from one solution of a pose to another without a singularity (a cuspidal arm [1]_).

Then no signs of factors of the determinant name its branches. It is shown by an example: two solutions of one pose that
a straight joint move joins, along which the Jacobian keeps its rank, with a bound between samples
(:mod:`er3a.kinematics.singularity`). Where none is found nothing is proven.

References
----------
.. [1] P. Wenger, "Uniqueness domains and regions of feasible paths for cuspidal manipulators", IEEE Trans. Robotics 20
   (2004).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import rank_losses, scaled_jacobian
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot, derived

POSES, SAMPLES, SEED = 60, 41, 20261121  # random poses that are tried, and points of a move
CLEAR = 5e-3  # smallest singular value that the whole move must keep


@dataclass(frozen=True, eq=False)
class CuspidalMove:
    """Two joint solutions (6,) of one pose, rad, and the minimum of the smallest singular values between them."""

    start: Reals
    end: Reals
    smallest: float


@derived
def cuspidal_move(robot: Robot) -> CuspidalMove | None:
    """A joint move without singularity between two solutions of one pose, which shows that an arm is cuspidal [1]_.

    Parameters
    ----------
    robot : with six joints that all turn; others give None

    Returns
    -------
    move : rad, straight in joint space; None if none of those tried is one, which proves nothing

    Notes
    -----
    Poses of 60 random joint vectors are tried.
    """
    if robot.joints != 6 or robot.sliding.any():
        return None
    q = np.random.default_rng(SEED).uniform(-np.pi, np.pi, (POSES, 6))
    found = inverse_batch(robot, forward(robot, q))
    share = np.linspace(0, 1, SAMPLES)[:, None]
    for rows, solved in zip(found.q, found.solved):
        rows = rows[solved]
        # Solutions with different signs are separated by a singularity on any way.
        signs = np.sign(np.linalg.det(scaled_jacobian(robot, rows)))
        for i in range(len(rows)):
            for j in np.flatnonzero(signs[i + 1 :] == signs[i]) + i + 1:
                step = wrap_to_pi(rows[j] - rows[i])
                values = np.linalg.svd(scaled_jacobian(robot, rows[i] + share * step), compute_uv=False)[:, -1]
                if values.min() > 2 * CLEAR and _keeps_rank(robot, rows[i], step):
                    return CuspidalMove(rows[i], rows[i] + step, float(values.min()))
    return None


def _keeps_rank(robot: Robot, start: Reals, step: Reals) -> bool:
    """Whether the smallest singular value stays above ``CLEAR`` along a move, with a bound between samples."""
    t = np.linspace(0, 1, SAMPLES)

    def joints(at: Reals) -> Reals:
        return start + np.asarray(at)[..., None] * step

    return not rank_losses(robot, t, joints(t), joints, CLEAR, np.abs(step))
