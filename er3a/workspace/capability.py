"""What a tool can do in each cell: its reachability, the number of solutions, and the manipulability there.

Reachability is the index of Zacharias, Borst and Hirzinger [1]_: directions spread evenly over the sphere, a
direction counts if some roll about it has an inverse solution within limits. Here all directions are asked of the
cell's middle.

Joint 1 only turns everything about its axis. So each cell of the section is solved once, at azimuth 0 and with joint 1
free; what another azimuth has follows by turning joint 1 on, exactly. With a limited joint 1 azimuths are told apart
in sectors, by their middles.

References
----------
.. [1] F. Zacharias, C. Borst, G. Hirzinger, "Capturing robot workspace structure: representing robot capabilities",
   IEEE/RSJ Int. Conf. on Intelligent Robots and Systems (IROS), 2007.
.. [2] T. Yoshikawa, "Manipulability of robotic mechanisms", Int. J. Robotics Research 4(2), 1985.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.geometry.sphere import fibonacci_sphere
from er3a.kinematics.block_constants import BlockConstants
from er3a.kinematics.closed_form import SLOTS
from er3a.kinematics.wrist_partitioned import closed_form_missing, constants_for_blocks
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.jit import kernel
from er3a.robots.joint_limits import LIMIT_TOLERANCE, theta_limits
from er3a.robots.robot import Robot
from er3a.workspace.directions import Roll, left_to_roll, poses, tool_rotations, with_full_turn
from er3a.workspace.proof import ring_volumes
from er3a.workspace.section_arm import FULL_TURN
from er3a.workspace.tool_inverse import all_solutions, frame_about_axis_1, generic_manipulability

SECTORS = 64
"""Sectors of azimuth with a limited joint 1, the first about azimuth 0; one bit each in a proof's masks."""
_POSES = 50_000
_TURN = 2 * np.pi


@dataclass(frozen=True, eq=False)
class Capability:
    """Numbers per cell and sector of azimuth, both (n, sectors); a full turn of joint 1 makes one sector.

    Attributes
    ----------
    reachability : ratio of the directions that are reached [1]_
    solutions : branches within limits, the mean over reached directions (0 where none is), of the roll that has most
    most_solutions : the most branches that any direction has
    manipulability : m^3, the greatest ``|det J|`` [2]_ of any reached pose
    """

    reachability: Reals
    solutions: Reals
    most_solutions: Reals
    manipulability: Reals


@dataclass(frozen=True)
class Overall:
    """Figures over all reached cells: means by volume, the best of any cell, manipulability in m^3."""

    mean_reachability: float
    best_reachability: float
    mean_solutions: float
    most_solutions: int
    best_manipulability_m3: float


def rings(reach: float, heights: tuple[float, float], cell: float) -> Reals:
    """Square cells (n, 4) of the section, m, that cover everything within reach: rho_0, rho_1, z_0, z_1."""
    count = int(np.ceil(reach / cell)), int(np.ceil((heights[1] - heights[0]) / cell))
    rho, z = np.arange(count[0]) * cell, (heights[0] + heights[1] - count[1] * cell) / 2 + np.arange(count[1]) * cell
    rho, z = (grid.ravel() for grid in np.meshgrid(rho, z, indexing="ij"))
    return np.stack([rho, rho + cell, z, z + cell], axis=1)


def overall(capability: Capability, cells: Reals) -> Overall:
    """Figures over all reached cells (n, 4), see :func:`rings`."""
    volume = np.broadcast_to(ring_volumes(cells)[:, None], capability.reachability.shape)
    weight = np.where(capability.reachability > 0, volume, 0.0)
    total = float(weight.sum())
    if total == 0:
        return Overall(0.0, 0.0, 0.0, 0, 0.0)
    return Overall(
        float((weight * capability.reachability).sum()) / total,
        float(capability.reachability.max()),
        float((weight * capability.solutions).sum()) / total,
        int(capability.most_solutions.max()),
        float(capability.manipulability.max()),
    )


def sector_count(robot: Robot) -> int:
    """How many sectors of azimuth differ."""
    return 1 if robot.upper[0] - robot.lower[0] >= FULL_TURN else SECTORS


def map_capability(robot: Robot, middles: Reals, directions: int, roll: Roll) -> Capability:
    """Ask cells for their directions.

    Parameters
    ----------
    middles : (n, 2), m, radius and height of the cells' middles about axis 1 (see ``section_arm.section_frame``)
    directions : how many, over the sphere; roll : how the roll is treated
    """
    R, origin = frame_about_axis_1(robot)
    asked = with_full_turn(left_to_roll(robot, roll), 0)
    rotations = R.T @ tool_rotations(fibonacci_sphere(directions), roll)
    sectors = sector_count(robot)
    reachability, solutions, most, best = np.zeros((4, len(middles), sectors))
    per_cell = directions * len(roll.angles)
    points = np.stack([middles[:, 0], np.zeros(len(middles)), middles[:, 1]], axis=1) @ R + origin
    for start in range(0, len(middles), step := max(1, _POSES // per_cell)):
        part = slice(start, start + step)
        T = poses(points[part][:, None, None], rotations)
        q, within = all_solutions(asked, T.reshape(-1, 4, 4))
        theta = robot.direction * q + robot.offset
        shape = (len(T), directions, -1, SLOTS)
        values = manipulability_of(robot, q, within).reshape(shape)
        within = within.reshape(shape)
        out = reachability[part], solutions[part], most[part], best[part]
        _tally(theta[..., 0].reshape(shape), within, values, theta_limits(robot)[0], out)
    return Capability(reachability, solutions, most, best)


def manipulability_of(robot: Robot, q: Reals, within: Flags) -> Reals:
    """Manipulability (m^3) of joint values (..., n), rad; where these are not ``within`` the limits it may be 0."""
    if closed_form_missing(robot):
        return generic_manipulability(robot, q, within)
    return manipulability(constants_for_blocks(robot), robot.direction * q + robot.offset)


def manipulability(arm: BlockConstants, theta: Reals) -> Reals:
    """``|det J|`` in m^3 for the table's angles (..., 6): the product of the shoulder's, elbow's and wrist's factors.

    The determinant is that of the Jacobian at the wrist centre, where it falls into blocks (Siciliano et al.,
    *Robotics*, section 3.3.1): axis 1 moves the wrist by its distance ahead of axis 1, axes 2 and 3 by the triangle's
    area, and the wrist turns by the volume that axes 4, 5 and 6 span.
    """
    upper = arm.turn_2 + theta[..., 1]
    bend = arm.turn_3 + arm.elbow_sign * theta[..., 2]
    ahead = arm.point_2[0] + arm.upper_arm * np.cos(upper) + arm.forearm * np.cos(upper + bend)
    size = arm.sin_12 * arm.upper_arm * arm.forearm * arm.sin_45 * arm.sin_56
    return np.abs(size * ahead * np.sin(bend) * np.sin(theta[..., 4] + arm.turn_5))


@kernel
def _tally(
    theta_1: Reals, within: Flags, values: Reals, range_1: Reals, out: tuple[Reals, Reals, Reals, Reals]
) -> None:
    """Sum up cells: ``theta_1``, ``within``, ``values`` are (cells, directions, rolls, slots), ``out`` is filled."""
    reachability, solutions, most, best = out
    sectors = reachability.shape[1]
    width = _TURN / sectors
    count, reached = np.zeros(sectors, dtype=np.int64), np.zeros(sectors, dtype=np.int64)
    for cell in range(theta_1.shape[0]):
        for d in range(theta_1.shape[1]):
            reached[:] = 0
            for roll in range(theta_1.shape[2]):
                count[:] = 0
                for slot in range(theta_1.shape[3]):
                    if not within[cell, d, roll, slot]:
                        continue
                    first, many = 0, sectors
                    if range_1[1] - range_1[0] < FULL_TURN:
                        at = theta_1[cell, d, roll, slot]
                        first = int(np.ceil((range_1[0] - LIMIT_TOLERANCE - at) / width))
                        last = int(np.floor((range_1[1] + LIMIT_TOLERANCE - at) / width))
                        many = min(sectors, last - first + 1)
                    value = values[cell, d, roll, slot]
                    for i in range(many):
                        sector = (first + i) % sectors
                        count[sector] += 1
                        best[cell, sector] = max(best[cell, sector], value)
                for sector in range(sectors):
                    reached[sector] = max(reached[sector], count[sector])
            for sector in range(sectors):
                if reached[sector]:
                    reachability[cell, sector] += 1.0
                    solutions[cell, sector] += reached[sector]
                    most[cell, sector] = max(most[cell, sector], reached[sector])
        for sector in range(sectors):
            solutions[cell, sector] /= max(reachability[cell, sector], 1.0)
            reachability[cell, sector] /= theta_1.shape[1]
