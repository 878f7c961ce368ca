"""Joint vectors that bring the tool point into cells: what makes a cell *touched*."""

from __future__ import annotations

import numpy as np

from er3a.kinematics.forward import forward
from er3a.kinematics.numerical import solve
from er3a.kinematics.wrist_partitioned import wrist_partitioned_arm
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot
from er3a.workspace.proof import Proof, in_section
from er3a.workspace.section_arm import SectionArm, section_frame

POSITION_ONLY = np.array([1, 1, 1, 0, 0, 0])
_RESTARTS, _TOLERANCE = 10, 1e-9


def reach_points(robot: Robot, points: Reals, starts: Reals, restarts: int = _RESTARTS) -> Reals:
    """Joint vectors (n, 6), rad, within the limits, that bring the tool point to ``points`` (n, 3), m; NaN where the
    iteration finds none from ``starts`` (n, 6) and from random starts."""
    T = np.tile(np.eye(4), (len(points), 1, 1))
    T[:, :3, 3] = points
    found = solve(robot, T, starts, mask=POSITION_ONLY, restarts=restarts, position_tolerance=_TOLERANCE)
    return np.where(found.solved[:, None], found.q, np.nan)


def witness_joints(robot: Robot, arm: SectionArm, proof: Proof) -> Reals:
    """Joint vectors (cells, 6), rad, that reach into the cells; NaN where none is known.

    The proof's configurations give joints 2 and 3 and the angle phi between arm and cell, from which the rest is found
    by iteration towards the middle of the cell. Each one is checked: it lies within the limits and in its cell.
    """
    q = np.full((len(proof.cells), 6), np.nan)
    known = np.flatnonzero(proof.witness[:, 3] > 0)
    if not len(known):
        return q
    theta_2, tau, phi, _ = proof.witness[known].T
    theta = np.zeros((len(known), 6))
    middle = (robot.lower + robot.upper) / 2
    theta[:] = robot.direction * middle + robot.offset
    theta[:, 1], theta[:, 2] = theta_2, wrist_partitioned_arm(robot).elbow_sign * tau
    turns = 2 * np.pi
    starts = robot.direction * (theta - robot.offset)
    starts = np.clip(starts + turns * np.round((middle - starts) / turns), robot.lower, robot.upper)
    R, origin = section_frame(robot)
    rho, z = proof.cells[known].reshape(-1, 2, 2).mean(axis=2).T
    azimuth = theta[:, 0] + phi
    points = np.stack([rho * np.cos(azimuth), rho * np.sin(azimuth), z], axis=1) @ R + origin
    q[known] = reach_points(robot, points, starts)
    return np.where(lies_in_cell(robot, q, proof, R, origin)[:, None], q, np.nan)


def lies_in_cell(robot: Robot, q: Reals, proof: Proof, R: Reals, origin: Reals) -> Flags:
    """Whether each joint vector (cells, 6) brings the tool point into its own cell; False for NaN."""
    rho, _, z = in_section((forward(robot, np.nan_to_num(q))[:, :3, 3] - origin) @ R.T, proof.bar)
    a, b, c, d = proof.cells.T
    inside: Flags = np.isfinite(q[:, 0]) & (a <= rho) & (rho <= b) & (c <= z) & (z <= d)
    return inside
