"""The side section about axis 1, in cells: it holds the tool point at all joint angles."""

from __future__ import annotations

import numpy as np

from er3a.by_value import by_identity
from er3a.geometry.transforms import translation
from er3a.kinematics.chain import constant_links
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.robots.joint_limits import theta_limits
from er3a.robots.robot import Robot

SECTION_REFINEMENT = 4  # the section has two dimensions, so finer cells still hold enough samples
_MARGIN = 2e-5  # the sampling loop works in single precision


@by_identity
class Grid:
    """Cells in the side section about axis 1.

    Attributes
    ----------
    cell : m, edge of the cells that the study asks for; those of the section are ``SECTION_REFINEMENT`` times finer
    axis_point, axis : (3,), m and unit vector, the line of joint 1; the section's height z is measured from the point
    section_origin : (2,), m, lowest (rho, z); section_cell : m; section_shape : cells along rho (from the axis) and z
    """

    cell: float
    axis_point: Reals
    axis: Reals
    section_origin: Reals
    section_cell: float
    section_shape: tuple[int, int]


@by_identity
class Bound:
    """A ball that joint 1 sweeps around its axis; the tool point never leaves the swept solid.

    Attributes
    ----------
    axis_point, axis : (3,), the line of joint 1; height, offset : m, the ball's centre above the point and off the axis
    radius : m, of the ball
    """

    axis_point: Reals
    axis: Reals
    height: float
    offset: float
    radius: float

    @property
    def reach(self) -> float:
        """No tool point is further (m) from axis 1."""
        return self.offset + self.radius


def tool_bound(robot: Robot) -> Bound:
    """A solid that the tool point never leaves, from lengths alone: a ball that joint 1 sweeps around its axis.

    Parameters
    ----------
    robot : limits matter only of prismatic joints

    Returns
    -------
    bound : m, in the base frame

    Notes
    -----
    The tool point is a chain of constant steps joined by rotations about z. The part of a step along its joint's z axis
    does not turn with that joint, so it may be added to the step before; this is done where it shortens the sum of
    lengths (forearm and elbow offset become one lever). Joint 2 onwards then give a ball by the triangle inequality. A
    prismatic joint is taken at the middle of its range, and half the range is added to the radius.
    """
    links, half = constant_links(robot), 0.0
    if robot.sliding.any():
        links = links.copy()
        for row in np.flatnonzero(robot.sliding):
            low, high = theta_limits(robot)[row]
            links[row + 1] = translation(0, 0, (low + high) / 2) @ links[row + 1]
            half += float(high - low) / 2
    steps = links[:, :3, 3].copy()
    for k in range(robot.rows, 1, -1):
        # From the tip inwards, so that a step that was moved can move on.
        moved = steps[k - 1] + links[k - 1, :3, 2] * steps[k, 2]
        kept_length = np.linalg.norm(steps[k - 1]) + np.linalg.norm(steps[k])
        if np.linalg.norm(moved) + np.linalg.norm(steps[k, :2]) < kept_length:
            steps[k - 1], steps[k, 2] = moved, 0.0
    return Bound(
        axis_point=steps[0],
        axis=links[0, :3, 2],
        height=float(steps[1, 2]),
        offset=float(np.linalg.norm(steps[1, :2])),
        radius=float(np.linalg.norm(steps[2:], axis=1).sum()) + half,
    )


def make_grid(robot: Robot, cells_across: int) -> Grid:
    """The section's cells for a robot.

    Parameters
    ----------
    robot : its tool point stays within the section at all joint values
    cells_across : cells along the longest side of the tool point's bounding box, by which the section's are refined

    Returns
    -------
    grid : ``SECTION_REFINEMENT`` times finer cells in the section
    """
    bound = tool_bound(robot)
    reach = max(bound.radius, 1e-6)
    half = (bound.offset * np.sqrt(np.maximum(0.0, 1 - bound.axis**2)) + reach) * (1 + _MARGIN)
    cell = float(2 * half.max() / cells_across)
    fine = cell / SECTION_REFINEMENT
    section = ((bound.offset + reach) * (1 + _MARGIN), 2 * reach * (1 + _MARGIN))
    return Grid(
        cell=cell,
        axis_point=bound.axis_point,
        axis=bound.axis,
        section_origin=np.array([0.0, bound.height - section[1] / 2]),
        section_cell=fine,
        section_shape=(int(np.ceil(section[0] / fine)), int(np.ceil(section[1] / fine))),
    )


def shoulder_of(robot: Robot, grid: Grid) -> Reals:
    """The point of axis 1 at the height of joint 2, with all joints at 0.

    Parameters
    ----------
    robot : with at least one joint
    grid : of the same robot, for the line of axis 1

    Returns
    -------
    point : (3,), m, in the base frame
    """
    joint_2 = forward(robot, np.zeros(robot.joints), frame=1)[:3, 3]
    return grid.axis_point + ((joint_2 - grid.axis_point) @ grid.axis) * grid.axis
