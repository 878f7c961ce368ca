"""Any serial arm in the form of the general proof: a chain of joints about and along z, and bounds of its levers.

The tool point is carried from the tip to axis 1: turned about the z axis of a joint's frame or shifted along it, then
taken over a constant link. The distance of the point from a joint's axis, its *lever*, depends only on the joints after
that one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.geometry.vectors import Vector, add, cross, in_frame_of, subtract
from er3a.kinematics.chain import constant_links, joint_starts, moving_tip
from er3a.kinematics.forward import slide_row, step_row, turn_row
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.jit import inner_kernel, kernel
from er3a.robots.joint_limits import theta_limits
from er3a.robots.robot import Robot
from er3a.workspace.arcs import FULL_TURN, ROUND_OFF

_SPARE = 0.01  # of what is reached, left on either side of bars
_UPRIGHT = 1e-6  # sine between the slide and the vertical, below which another direction is z


class GeneralArm(NamedTuple):
    """Plain numbers for kernels, in the frame of joint 1 (z along axis 1).

    n rows of the table move the point: ``x = drive @ v + start`` with x (n,) the angle theta of rows that turn (rad)
    and the shift of those that slide (m). v (m,) are those values themselves, or the joints' where some depend on
    others.

    Attributes
    ----------
    links : (n, 4, 4), from the frame of each row's joint to that of the one before; the first unused
    tip : (3,), m, the tool point in the frame that moves with the last of these joints
    sliding : (n,), whether the joint is prismatic
    lower, upper : (n,), rad or m, what x is never outside of, turns at most a full one wide
    levers, radii : (n,), m, the point is never further from each axis; a prismatic joint has the lever 1
    heights : (n, 2), lowest and highest z of the point along each axis once its joint moved, m
    drive, start : (n, m) and (n,)
    v_lower, v_upper : (m,), limits of v
    combined (c, m), combined_lower, combined_upper (c,) : ``combined_lower <= combined @ v <= combined_upper``
    full_turn : whether joint 1 covers a full turn
    bar : m, length of the bars along a joint 1 that slides, 0 where it turns. Then the frame has y along the slide, the
        point is at x from 0 to ``radii[0]`` and, with the slide at its lower limit, at y from 0 on; places along
        y are given as angles, ``bar`` being a turn, and so is the range of joint 1 (from 0)
    """

    links: Reals
    tip: Reals
    sliding: Flags
    lower: Reals
    upper: Reals
    levers: Reals
    radii: Reals
    heights: Reals
    drive: Reals
    start: Reals
    v_lower: Reals
    v_upper: Reals
    combined: Reals
    combined_lower: Reals
    combined_upper: Reals
    full_turn: bool
    bar: float

    @property
    def carries_around(self) -> bool:
        """Whether joint 1 can turn or shift the tool point with all rows after it at rest, as far as its own limits."""
        shared = self.drive[0, 1:].any() or self.drive[1:, 0].any() or self.combined[:, 0].any()
        return bool(len(self.lower) > 1 and not shared)


def coupled(robot: Robot) -> bool:
    """Whether joints depend on one another, or sums of them have limits.

    Returns
    -------
    coupled : if so, the values v of :class:`GeneralArm` are joint values instead of row values
    """
    return robot.coupling is not None or bool(robot.combined)


def general_arm(robot: Robot) -> tuple[GeneralArm, Reals, Reals]:
    """The chain of a robot for the proof, and the frame about axis 1.

    Parameters
    ----------
    robot : any; a joint 1 that slides along other joints makes bars, see :class:`GeneralArm`

    Returns
    -------
    arm : in the frame about axis 1
    R : (3, 3), rows are x, y, z of that frame in the base frame
    origin : (3,), m, its origin in the base frame
    """
    links = constant_links(robot)
    last, tip = moving_tip(links, robot.sliding)
    n = last + 1
    links, sliding, ends = links[:n], robot.sliding[:n], theta_limits(robot)[:n]
    wide = (ends[:, 1] - ends[:, 0] >= FULL_TURN) & ~sliding
    ends[wide, 1] = ends[wide, 0] + 2 * np.pi
    lower, upper = ends.T.copy()
    drive, start, v_lower, v_upper = np.eye(n), np.zeros(n), lower, upper
    if coupled(robot):
        drive = np.ascontiguousarray((robot.direction[:, None] * robot.joint_to_row)[:n])
        start, v_lower, v_upper = joint_starts(robot)[:n].copy(), robot.lower.copy(), robot.upper.copy()
    combined = np.array([limit.factors for limit in robot.combined]).reshape(-1, drive.shape[1])
    sums = np.array([[limit.lower, limit.upper] for limit in robot.combined]).reshape(-1, 2).T.copy()
    radii, heights = _levers(links, tip, sliding, lower, upper)
    links, tip, sliding = (np.array(each, order="C") for each in (links, tip, sliding))
    arm = GeneralArm(  # kernels are compiled anew for arrays that can't be written to: none of these is one
        links=links,
        tip=tip,
        sliding=sliding,
        lower=lower,
        upper=upper,
        levers=np.where(sliding, 1.0, radii),
        radii=radii,
        heights=heights,
        drive=drive,
        start=start,
        v_lower=v_lower,
        v_upper=v_upper,
        combined=combined,
        combined_lower=sums[0],
        combined_upper=sums[1],
        full_turn=bool(wide[0]),
        bar=0.0,
    )
    if sliding[0] and n > 1:
        return _along_slide(arm, links[0])
    return arm, links[0, :3, :3].T, links[0, :3, 3]


def _along_slide(arm: GeneralArm, first: Reals) -> tuple[GeneralArm, Reals, Reals]:
    """The arm in a frame along its first joint, which slides, and that frame; z is as near to the base's as it can be.

    Parameters
    ----------
    first : (4, 4), frame of joint 1 in the base frame
    """
    along = first[:3, 2]
    up = np.array([0.0, 0.0, 1.0]) if np.hypot(along[0], along[1]) > _UPRIGHT else np.array([1.0, 0.0, 0.0])
    up = up - (up @ along) * along
    up /= np.linalg.norm(up)
    frame = np.stack([np.cross(along, up), along, up])
    links = arm.links.copy()
    links[1, :3] = frame @ first[:3, :3] @ arm.links[1, :3]
    low, high = _box(arm, links[1, :3])
    size, slide = high - low, float(arm.upper[0] - arm.lower[0])
    spare = _SPARE * (size + np.array([0.0, slide, 0.0])) + ROUND_OFF
    corner = np.array([low[0] - spare[0], low[1] - spare[1], 0.0])
    links[1, :3, 3] -= corner
    bar = float(size[1] + slide + 2 * spare[1])
    lower, upper, radii, heights = (array.copy() for array in (arm.lower, arm.upper, arm.radii, arm.heights))
    start, lower[0], upper[0] = float(lower[0]), 0.0, 2 * np.pi * slide / bar
    radii[0], heights[0] = size[0] + 2 * spare[0], (low[2], high[2])
    arm = arm._replace(links=links, lower=lower, upper=upper, radii=radii, heights=heights, bar=bar)
    return arm, frame, first[:3, 3] + (corner + np.array([0.0, start, 0.0])) @ frame


def _box(arm: GeneralArm, link: Reals) -> tuple[Reals, Reals]:
    """Lowest and highest corner (3,), m, of what the joints after joint 1 reach, with its link (3, 4)."""
    middles = link[:, 3] + np.outer(arm.heights[1], link[:, 2])
    across = np.hypot(link[:, 0], link[:, 1]) * arm.radii[1]
    return middles.min(axis=0) - across, middles.max(axis=0) + across


def _levers(links: Reals, tip: Reals, sliding: Flags, lower: Reals, upper: Reals) -> tuple[Reals, Reals]:
    """Bounds of the distance from each axis (n,) and of the height along it (n, 2), from the tip inwards.

    Turned about z, a point fills at most a disc of radius ``radius`` at heights between ``low`` and ``high``, and a
    ball of radius ``ball`` about the frame's origin.
    """
    last = len(lower) - 1
    radii, heights = np.empty(last + 1), np.empty((last + 1, 2))
    radius, low, high, ball = np.hypot(tip[0], tip[1]), tip[2], tip[2], float(np.linalg.norm(tip))
    for k in range(last, -1, -1):
        if sliding[k]:
            low, high, ball = low + lower[k], high + upper[k], ball + max(abs(lower[k]), abs(upper[k]))
        # Two bounds at a time: what one gives away over a link, the other may keep.
        radius, low, high = min(radius, ball), max(low, -ball), min(high, ball)
        radii[k], heights[k] = radius, (low, high)
        R, t = links[k, :3, :3], links[k, :3, 3]
        middles = t + np.outer([low, high], R[:, 2])
        across = np.hypot(R[2, 0], R[2, 1]) * radius
        radius = np.hypot(middles[:, 0], middles[:, 1]).max() + radius
        low, high = middles[:, 2].min() - across, middles[:, 2].max() + across
        ball += float(np.linalg.norm(t))
    return radii, heights


@kernel
def place(arm: GeneralArm, theta: Reals, radii: Reals, columns: Reals) -> Vector:
    """The tool point for one joint vector, with levers and derivatives. Kernel.

    Parameters
    ----------
    theta : (n,), rad or m
    radii : (n,), filled with the point's distance from each axis, m; 1 for prismatic joints
    columns : (n, 3), filled with the derivative of the point by each value, m

    Returns
    -------
    x, y, z : m, in the frame of joint 1 before it moves
    """
    point = point_of(arm, theta, radii)
    x, y, z = (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0)
    for k in range(theta.shape[0]):
        if k > 0:
            L = arm.links[k]
            x, y, z = step_row(x, L), step_row(y, L), step_row(z, L)
        axis = x[2], y[2], z[2]
        if arm.sliding[k]:
            columns[k, 0], columns[k, 1], columns[k, 2] = axis
            x, y, z = slide_row(x, theta[k]), slide_row(y, theta[k]), slide_row(z, theta[k])
            continue
        columns[k, 0], columns[k, 1], columns[k, 2] = cross(axis, subtract(point, (x[3], y[3], z[3])))
        c, s = np.cos(theta[k]), np.sin(theta[k])
        x, y, z = turn_row(x, c, s), turn_row(y, c, s), turn_row(z, c, s)
    return point


@inner_kernel
def point_of(arm: GeneralArm, theta: Reals, radii: Reals) -> Vector:
    """The tool point for one joint vector, and its levers. Kernel.

    Parameters
    ----------
    theta : (n,), rad or m
    radii : (n,), filled with the point's distance from each axis, m; 1 for prismatic joints

    Returns
    -------
    x, y, z : m, in the frame of joint 1 before it moves
    """
    x, y, z = arm.tip[0], arm.tip[1], arm.tip[2]
    for k in range(theta.shape[0] - 1, -1, -1):
        if arm.sliding[k]:
            radii[k] = 1.0
            z += theta[k]
        else:
            radii[k] = np.sqrt(x * x + y * y)
            c, s = np.cos(theta[k]), np.sin(theta[k])
            x, y = c * x - s * y, s * x + c * y
        if k > 0:
            L = arm.links[k]
            x, y, z = add(in_frame_of(L, (x, y, z)), (L[0, 3], L[1, 3], L[2, 3]))
    return x, y, z


@inner_kernel
def curvature(arm: GeneralArm, moves: Reals, radii: Reals) -> float:
    """Bound on the second derivative of the point along a straight line of joint values. Kernel.

    ``|d2p / dx_i dx_j|`` for i <= j is at most the distance of p from axis j if both turn [1]_, 1 if j slides and 0 if
    i does.

    Parameters
    ----------
    moves : (n,), by how much each value changes, rad or m, no less than 0
    radii : (n,), the levers at a point of the line

    Returns
    -------
    bound : m, for the line's parameter from 0 to 1

    References
    ----------
    .. [1] ``w_i x (w_j x (p - o_j))``: J.-P. Merlet, *Parallel Robots*, 2nd ed., 2006, chapter 7.
    """
    total, beyond, n = 0.0, 0.0, moves.shape[0]
    inner = 0.0
    for k in range(n):
        inner += 0.0 if arm.sliding[k] else moves[k]
    for k in range(n - 1, -1, -1):
        if arm.sliding[k]:
            total += 2.0 * moves[k] * inner
            beyond += moves[k]
            continue
        lever = min(arm.levers[k], radii[k] + beyond)
        inner -= moves[k]
        total += lever * moves[k] * (moves[k] + 2.0 * inner)
        beyond += lever * moves[k]
    return total
