"""Capability of the tool in each cell: reachability, number of solutions, and manipulability.

Reachability is the index of Zacharias, Borst and Hirzinger [1]_: directions spread evenly over the sphere, a direction
counts if some roll about it has an inverse solution within limits. Here all directions are tested at the cell's centre.
For arms with fewer joints, the orientations that they can set are tested (:mod:`.orientations`).

Joint 1 only turns everything about its axis, or shifts it. So each cell of the section is solved once, at azimuth 0 and
with joint 1 free; the result at another azimuth follows exactly by turning joint 1. With a limited joint 1, azimuths
are divided into sectors, judged at their middles; so are positions along a prismatic joint 1.

References
----------
.. [1] F. Zacharias, C. Borst, G. Hirzinger, "Capturing robot workspace structure: representing robot capabilities",
   IEEE/RSJ Int. Conf. on Intelligent Robots and Systems (IROS), 2007.
.. [2] T. Yoshikawa, "Manipulability of robotic mechanisms", Int. J. Robotics Research 4(2), 1985.
"""

from __future__ import annotations

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.kinematics.block_inverse import BlockConstants
from er3a.kinematics.wrist_partitioned import constants_for_blocks, wrist_partition_missing
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.jit import kernel
from er3a.robots.robot import Robot
from er3a.workspace.cell_frame import cell_frame, places_served, without_first_limits
from er3a.workspace.cells import ring_volumes
from er3a.workspace.directions import left_to_roll, poses
from er3a.workspace.orientations import AskedOrientations
from er3a.workspace.tool_inverse import all_solutions, generic_manipulability, slot_count

_POSES = 50_000  # solved at a time, so that their solutions stay within some hundred megabytes


@by_identity
class Capability:
    """Numbers per cell and sector of azimuth (part of a bar), both (n, sectors); a full turn of joint 1 makes one.

    Attributes
    ----------
    reachability : ratio of the directions [1]_, or of the required orientations, that are reached
    solutions : branches within limits, the mean over reached directions (0 where none is), of the roll that has most
    most_solutions : the most branches that any direction has
    manipulability : m^3, the largest ``|det J|`` [2]_ of any reached pose
    """

    reachability: Reals
    solutions: Reals
    most_solutions: Reals
    manipulability: Reals


@frozen
class Overall:
    """Figures over all reached cells: means by volume, the best of any cell, manipulability in m^3."""

    mean_reachability: float
    best_reachability: float
    mean_solutions: float
    most_solutions: int
    best_manipulability_m3: float


def rings(reach: float, heights: tuple[float, float], cell: float) -> Reals:
    """Square cells of the section that cover everything within reach.

    Parameters
    ----------
    reach : m, largest distance from axis 1
    heights : m, lowest and highest z; the cells are centred about their middle
    cell : m, edge

    Returns
    -------
    cells : (n, 4), m: rho_0, rho_1, z_0, z_1
    """
    count = int(np.ceil(reach / cell)), int(np.ceil((heights[1] - heights[0]) / cell))
    rho, z = np.arange(count[0]) * cell, (heights[0] + heights[1] - count[1] * cell) / 2 + np.arange(count[1]) * cell
    rho, z = (grid.ravel() for grid in np.meshgrid(rho, z, indexing="ij"))
    return np.stack([rho, rho + cell, z, z + cell], axis=1)


def overall(capability: Capability, cells: Reals, bar: float = 0.0) -> Overall:
    """Figures over all reached cells: means by volume, and the best of any cell.

    Parameters
    ----------
    capability : of n cells
    cells : (n, 4), m, see :func:`rings`
    bar : m, length of bars; 0 for rings

    Returns
    -------
    figures : all 0 if no cell is reached
    """
    volume = np.broadcast_to(ring_volumes(cells, bar)[:, None], capability.reachability.shape)
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


def map_capability(robot: Robot, middles: Reals, count: int, asked: AskedOrientations) -> Capability:
    """Find for each cell which of the required orientations are reached, by how many branches, and how well [1]_.

    Parameters
    ----------
    robot : with its own limits
    middles : (n, 2), m, radius and height of the cells' middles (see :class:`.cell_frame.CellFrame`)
    count : of directions over the sphere, of turns or of tilts
    asked : the required orientations

    Returns
    -------
    capability : (n, sectors) each
    """
    frame, free = cell_frame(robot), left_to_roll(without_first_limits(robot), asked.roll)
    reachability, solutions, most, best = np.zeros((4, len(middles), frame.sectors))
    points = frame.points(middles[:, 0], np.zeros(len(middles)), middles[:, 1])
    # even directions are even about axis 1 in the cells' frame, for any base frame
    turned = frame.R.T if asked.kind == "directions" else np.eye(3)
    per_cell = int(np.prod(asked.everywhere(points[:1], count).shape[1:3]))
    for start in range(0, len(middles), step := max(1, _POSES // per_cell)):
        part = slice(start, start + step)
        T = poses(points[part][:, None, None], turned @ asked.everywhere(points[part], count))
        q, within = all_solutions(free, T.reshape(-1, 4, 4))
        shape = (*T.shape[:2], -1, slot_count(robot))
        values = manipulability_of(robot, q, within).reshape(shape)
        low, high = places_served(robot, q[..., 0])
        out = reachability[part], solutions[part], most[part], best[part]
        bounds = low.reshape(shape), high.reshape(shape), frame.width, frame.bar > 0
        _tally(bounds, within.reshape(shape), values, out)
    return Capability(reachability, solutions, most, best)


def manipulability_of(robot: Robot, q: Reals, within: Flags) -> Reals:
    """Yoshikawa's manipulability [2]_ at joint values.

    Parameters
    ----------
    q : (..., n), rad or m
    within : (...), where joint values are not within the limits, the result is 0: of maps most slots are empty

    Returns
    -------
    manipulability : (...), m^3 for six joints; see :func:`.tool_inverse.generic_manipulability`
    """
    if wrist_partition_missing(robot) or robot.coupling is not None:
        return generic_manipulability(robot, q, within)
    found = np.zeros(within.shape)
    found[within] = manipulability(constants_for_blocks(robot), robot.direction * q[within] + robot.offset)
    return found


def manipulability(arm: BlockConstants, theta: Reals) -> Reals:
    """``|det J|`` of an arm with a spherical wrist: the product of the shoulder's, elbow's and wrist's factors [2]_.

    Parameters
    ----------
    arm : constants of the arm
    theta : (..., 6), rad, the table's angles

    Returns
    -------
    manipulability : (...), m^3

    Notes
    -----
    The determinant is that of the Jacobian at the wrist centre, where it falls into blocks (Siciliano et al.,
    *Robotics*, section 3.3.1): axis 1 moves the wrist by its distance ahead of axis 1, axes 2 and 3 by the triangle's
    area, and the wrist turns by the volume that axes 4, 5 and 6 span.
    """
    upper = arm.turn_2 + theta[..., 1]
    bend = arm.turn_3 + arm.elbow_sign * theta[..., 2]
    ahead = arm.point_2[0] + arm.upper_arm * np.cos(upper) + arm.forearm * np.cos(upper + bend)
    size = arm.sin_12 * arm.upper_arm * arm.forearm * arm.sin_45 * arm.sin_56
    return np.abs(size * ahead * np.sin(bend) * np.sin(theta[..., 4] + arm.turn_5))


_Places = tuple[Reals, Reals, float, bool]


@kernel
def _tally(places: _Places, within: Flags, values: Reals, out: tuple[Reals, Reals, Reals, Reals]) -> None:
    """Sum up cells: ``within``, ``values`` and the first and last place that each serves are (cells, asked, tries,
    slots); places go round, but along bars, whose parts have their middles half a part on. ``out`` is filled."""
    reachability, solutions, most, best = out
    from_place, to_place, width, bars = places
    sectors = reachability.shape[1]
    shift = 0.5 if bars else 0.0
    count, reached = np.zeros(sectors, dtype=np.int64), np.zeros(sectors, dtype=np.int64)
    for cell in range(within.shape[0]):
        for d in range(within.shape[1]):
            reached[:] = 0
            for roll in range(within.shape[2]):
                count[:] = 0
                for slot in range(within.shape[3]):
                    if not within[cell, d, roll, slot]:
                        continue
                    first = int(np.ceil(from_place[cell, d, roll, slot] / width - shift))
                    last = int(np.floor(to_place[cell, d, roll, slot] / width - shift))
                    if bars or sectors == 1:
                        first, last = max(first, 0), min(last, sectors - 1)
                    value = values[cell, d, roll, slot]
                    for i in range(min(sectors, last - first + 1)):
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
            reachability[cell, sector] /= within.shape[1]
