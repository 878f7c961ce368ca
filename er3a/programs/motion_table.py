"""A motion over time as a CSV table, which a path of kind ``table`` reads.

Columns, in this order: ``t_s``, from 0; ``q1_deg``, ``q2_deg`` ..., the joints (``q3_mm`` of one that slides);
``x_mm, y_mm, z_mm`` and ``roll_deg, pitch_deg, yaw_deg``, the tool in the base frame with
R = Rz(yaw) Ry(pitch) Rx(roll). Lines that begin with ``#`` are comments.
"""

from __future__ import annotations

import numpy as np

from er3a.geometry.transforms import rpy_of
from er3a.numerics.arrays import Reals

POSE_COLUMNS = ("x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg")
DECIMALS = 6


def write_csv(times: Reals, joints: Reals, poses: Reals, head: tuple[str, ...], columns: tuple[str, ...]) -> str:
    """A table of a motion.

    Parameters
    ----------
    times : (n,), s
    joints : (n, k), deg, or mm of prismatic joints
    poses : (n, 4, 4), T_base_tool, m
    head : comments, one to a line
    columns : names of the k columns of joints, as :func:`er3a.robots.joint_limits.joint_columns` has them
    """
    turned = np.degrees(rpy_of(poses))
    rows = np.column_stack([times, joints, poses[:, :3, 3] * 1000, turned])
    rows = np.round(rows, DECIMALS) + 0.0
    lines = [f"# {line}" for line in head]
    lines.append(",".join(("t_s", *columns, *POSE_COLUMNS)))
    lines += [",".join(f"{value:.{DECIMALS}f}" for value in row) for row in rows]
    return "\n".join(lines) + "\n"
