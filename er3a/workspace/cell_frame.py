"""The frame of cells: rings about axis 1, or bars along a first prismatic joint, in parts along it.

Joint 1 alone moves the tool around (or along), so the capability at one place of a ring or bar holds at the others with
joint 1 moved, within its limits.
"""

from __future__ import annotations

import numpy as np

from er3a.by_value import by_identity
from er3a.geometry.vectors import TURN
from er3a.kinematics.by_class import arm_solver
from er3a.kinematics.classes.chain_solvers import LockedJoint
from er3a.kinematics.classes.class_solvers import ARM_CLASSES, ChainSolver, PaddedChain
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot, derived
from er3a.robots.whole_turns import LIMIT_TOLERANCE
from er3a.sampling.grid import tool_bound
from er3a.workspace.arcs import FULL_TURN
from er3a.workspace.general_arm import general_arm

SECTORS = 64
"""Sectors of azimuth with a limited joint 1, the first about azimuth 0, or parts of bars; one bit each in a proof's
masks."""
_FEW_SECTORS = 16
"""The same of arms whose inverse takes long."""


@by_identity
class CellFrame:
    """Where cells lie.

    Attributes
    ----------
    R, origin : x, y, z of the frame in the base frame as rows (3, 3), and its origin (3,), m; z along axis 1, or y
        along the slide of joint 1
    reach, heights : m, the tool point is never further from axis 1 (or x of bars, from 0 on), nor outside these heights
    bar : m, length of bars along y from 0 on; 0 for rings
    sectors : sectors of azimuth of rings (1 if joint 1 makes a full turn), or parts of bars
    middle, ball : (3,) in the base frame and m, a ball that the tool point never leaves
    """

    R: Reals
    origin: Reals
    reach: float
    heights: tuple[float, float]
    bar: float
    sectors: int
    middle: Reals
    ball: float

    @property
    def width(self) -> float:
        """Of a sector, rad, or of a part of a bar, m."""
        return (self.bar or TURN) / self.sectors

    def points(self, rho: Reals, place: Reals, z: Reals) -> Reals:
        """Points of cells in the base frame.

        Parameters
        ----------
        rho : m, radius, or x across bars
        place : rad about axis 1, or m along the bar
        z : m, height; the three broadcast against each other

        Returns
        -------
        points : (..., 3), m, base frame
        """
        x, y = (rho, place) if self.bar else (rho * np.cos(place), rho * np.sin(place))
        local: Reals = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
        return local @ self.R + self.origin

    def holds(self, points: Reals) -> Flags:
        """Whether points lie where cells can be.

        Parameters
        ----------
        points : (n, 3), m, base frame

        Returns
        -------
        inside : (n,) bool
        """
        x, y, z = ((points - self.origin) @ self.R.T).T
        inside: Flags = (z >= self.heights[0]) & (z <= self.heights[1])
        if self.bar:
            return np.asarray(inside & (x >= 0) & (x <= self.reach) & (y >= 0) & (y <= self.bar))
        return np.asarray(inside & (np.hypot(x, y) <= self.reach))

    def distance(self, points: Reals) -> Reals:
        """Distance of points from axis 1.

        Parameters
        ----------
        points : (n, 3), m, base frame

        Returns
        -------
        distance : (n,), m; infinite where joint 1 slides
        """
        x, y, _ = ((points - self.origin) @ self.R.T).T
        return np.full(len(points), np.inf) if self.bar else np.hypot(x, y)


@derived
def cell_frame(robot: Robot) -> CellFrame:
    """The frame of a robot's cells, and how far they go.

    Parameters
    ----------
    robot : limits of joint 1 decide about sectors

    Returns
    -------
    frame : m, base frame; one sector if joint 1 makes a full turn
    """
    turns = not robot.slides[0] and (robot.continuous[0] or robot.upper[0] - robot.lower[0] >= FULL_TURN)
    sectors = 1 if turns else SECTORS if is_quick(robot) else _FEW_SECTORS
    arm, R, origin = general_arm(robot)
    reach, (low, high) = float(arm.radii[0]), arm.heights[0].tolist()
    if bar := arm.bar:
        half = np.array([reach, bar, high - low]) / 2
        middle = origin + (half + np.array([0.0, 0.0, low])) @ R
        return CellFrame(R, origin, reach, (low, high), bar, sectors, middle, float(np.linalg.norm(half)))
    bound = tool_bound(robot)
    middle = bound.axis_point + bound.height * bound.axis
    return CellFrame(R, origin, reach, (low, high), 0.0, sectors, middle, bound.reach)


def is_quick(robot: Robot) -> bool:
    """Whether the inverse of a pose takes microseconds, rather than tenths of a millisecond.

    Parameters
    ----------
    robot : judged by its class of arm

    Returns
    -------
    quick : True for closed forms, also behind locked joints
    """
    chain: ChainSolver | None = arm_solver(robot).chain
    while isinstance(chain, LockedJoint | PaddedChain):
        chain = chain.rest
    return chain is not None and ARM_CLASSES[chain.code].closed_form


def joint_1_alone(robot: Robot) -> bool:
    """Whether joint 1 carries around what the others reach, as rings and bars suppose.

    Parameters
    ----------
    robot : its coupling and its limits of sums are looked at

    Returns
    -------
    alone : joint 1 moves the first row alone and as far as itself, is the only one that does, and has limits of its own
    """
    coupling = robot.coupling
    if any(limit.factors[0] for limit in robot.combined):
        return False
    return coupling is None or not (coupling[1:, 0].any() or coupling[0, 1:].any() or abs(coupling[0, 0]) != 1)


@derived
def without_first_limits(robot: Robot) -> Robot:
    """The robot with joint 1 free to bring the tool to place 0 from wherever the others leave it.

    Parameters
    ----------
    robot : with its own limits

    Returns
    -------
    robot : a copy; joint 1 has a full turn, or on a slide the length of the bars
    """
    lower, upper = robot.lower.copy(), robot.upper.copy()
    if robot.slides[0]:
        spare = cell_frame(robot).bar - float(upper[0] - lower[0])
        if _sense(robot) > 0:
            lower[0], upper[0] = lower[0] - spare, lower[0]
        else:
            lower[0], upper[0] = upper[0], upper[0] + spare
    else:
        lower[0], upper[0] = -np.pi, np.pi
    return robot.replace(lower=lower, upper=upper)


def places_served(robot: Robot, q_1: Reals) -> tuple[Reals, Reals]:
    """Which places of a ring or bar an arm serves by moving joint 1 within its limits.

    Parameters
    ----------
    q_1 : (...), rad or m, joint 1 where the arm brings the tool to place 0

    Returns
    -------
    low, high : (...), rad or m, first and last place; 0 if joint 1 makes a full turn
    """
    if cell_frame(robot).sectors == 1:
        return np.zeros(q_1.shape), np.zeros(q_1.shape)
    low, high = robot.lower[0] - LIMIT_TOLERANCE - q_1, robot.upper[0] + LIMIT_TOLERANCE - q_1
    return (low, high) if _sense(robot) > 0 else (-high, -low)


def _sense(robot: Robot) -> float:
    """The sense in which joint 1 moves along its axis or slide, +1 or -1."""
    return float(np.sign(robot.direction[0] * robot.joint_to_row[0, 0]))
