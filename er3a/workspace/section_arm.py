"""A wrist-partitioned arm as the proofs take it: wrist centre and forearm about axis 1, and the tool point's zone.

Rotations about concurrent axes keep distances, so the tool point stays on the sphere of radius ``d`` about the wrist
centre W, for any tool and wrist. If joint 4 makes a full turn, everything is symmetric about the forearm's
direction f (axis 4), and the tool point fills exactly a *zone* of that sphere: ``low <= cos(angle to f) <= high``, with
the extremes of one trigonometric function of joints 5 and 6 over their limits. For an orthogonal wrist with the tool on
axis 6 the zone is a cap (Gupta and Roth 1982 [1]_ treat the point case).

In a frame with z on axis 1 and the arm's plane at joint 1 = 0 along x:

    W = C + U(theta_2) + M(theta_2 + tau),    f = F(theta_2 + tau),    tau = elbow_sign * theta_3

where U and M turn about axis 2 and C is constant.

References
----------
.. [1] K. C. Gupta, B. Roth, "Design considerations for manipulator workspace", J. Mech. Design 104, 1982.

Sets of azimuths as lists of arcs, for kernels.

A set is an array (n, 2) of disjoint intervals ``[from, to]`` within [0, 2 pi], and a count; an arc across 0 is held in
two pieces.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.geometry.vectors import TURN, Vector, add, cross, dot, scaled, subtract
from er3a.kinematics.wrist_partitioned import WristPartitionedArm, wrist_partitioned_arm
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.jit import inner_kernel, kernel
from er3a.robots.joint_limits import theta_limits
from er3a.robots.robot import Robot

Range = tuple[float, float]
Cell = tuple[float, float, float, float]
"""A rectangle of the section, m: rho_0, rho_1, z_0, z_1."""

ROUND_OFF = 1e-12
"""Bound (m per metre of reach, and rad) on the rounding of any length or angle computed here."""
FULL_TURN = 2 * np.pi - ROUND_OFF
_MIRRORED = 1e-12
_TOOL_STEPS = 20_000


class SectionArm(NamedTuple):
    """Plain numbers for kernels, in the frame about axis 1 (m, rad).

    Attributes
    ----------
    axis_2 : direction of axis 2
    centre, upper, forearm, direction : C, U, M and F at angle 0
    upper_length, forearm_length : lengths of U and M
    d : distance of the tool point from W
    outer_low, outer_high : cosines that bound the zone from outside, for any value of joint 4
    inner_low, inner_high : cosines of a zone wholly reachable at every azimuth about f; low > high if none is known
    theta_1, theta_2, tau : (lower, upper), each at most a full turn wide
    full_turn : whether joint 1 covers a full turn
    mirrored : whether the arm is its own mirror image in the plane through axis 1 across axis 2
    """

    axis_2: Vector
    centre: Vector
    upper: Vector
    forearm: Vector
    direction: Vector
    upper_length: float
    forearm_length: float
    d: float
    outer_low: float
    outer_high: float
    inner_low: float
    inner_high: float
    theta_1: Range
    theta_2: Range
    tau: Range
    full_turn: bool
    mirrored: bool

    @property
    def reach(self) -> float:
        """No tool point is further from axis 1, m."""
        return float(np.hypot(self.centre[0], self.centre[1]) + self.upper_length + self.forearm_length + self.d)

    @property
    def heights(self) -> tuple[float, float]:
        """No tool point is lower or higher along axis 1, m."""
        length = self.upper_length + self.forearm_length + self.d
        return self.centre[2] - length, self.centre[2] + length


def section_frame(robot: Robot) -> tuple[Reals, Reals]:
    """The frame about axis 1.

    Returns
    -------
    R : (3, 3), rows are its x, y, z axes in the base frame; z along axis 1, y along the part of axis 2 across it
    origin : (3,), m, the table's point on axis 1
    """
    arm = wrist_partitioned_arm(robot)
    z = arm.axes[0]
    x = np.cross(arm.axes[1], z)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z]), arm.points[0]


def section_arm(robot: Robot, wrist_centre: bool = False) -> SectionArm:
    """Take a robot to its section form.

    Parameters
    ----------
    wrist_centre : ask for the wrist centre's workspace instead of the tool point's

    Raises
    ------
    NotWristPartitionedError
        naming the property that the arm lacks
    """
    arm = wrist_partitioned_arm(robot)
    R, origin = section_frame(robot)
    limits = [(low, high) for low, high in at_most_a_turn(robot).tolist()]
    tau = limits[2] if arm.elbow_sign > 0 else (-limits[2][1], -limits[2][0])
    centre = arm.points[1] + arm.axes[1] * (arm.axes[1] @ (arm.wrist - arm.points[1])) - origin
    zone = (0.0, -1.0, 1.0, -1.0, 1.0) if wrist_centre else _zone(arm, limits)
    across = (abs(arm.axes[0] @ arm.axes[1]), abs((R @ centre)[1]), abs(arm.axes[1] @ arm.axes[3]))
    return SectionArm(
        axis_2=_vector(R @ arm.axes[1]),
        centre=_vector(R @ centre),
        upper=_vector(R @ arm.upper_arm),
        forearm=_vector(R @ arm.forearm),
        direction=_vector(R @ arm.axes[3]),
        upper_length=arm.upper_arm_length,
        forearm_length=arm.forearm_length,
        d=zone[0],
        outer_low=zone[1],
        outer_high=zone[2],
        inner_low=zone[3],
        inner_high=zone[4],
        theta_1=limits[0],
        theta_2=limits[1],
        tau=tau,
        full_turn=bool(limits[0][1] - limits[0][0] >= FULL_TURN),
        mirrored=bool(max(across) < _MIRRORED),
    )


def at_most_a_turn(robot: Robot) -> Reals:
    """Ends (6, 2), rad, of the range of each theta, cut down to a full turn."""
    ends = theta_limits(robot)
    full = ends[:, 1] - ends[:, 0] >= FULL_TURN
    ends[full, 1] = ends[full, 0] + 2 * np.pi
    return ends


def _vector(array: Reals) -> Vector:
    return float(array[0]), float(array[1]), float(array[2])


def _zone(arm: WristPartitionedArm, limits: list[tuple[float, float]]) -> tuple[float, float, float, float, float]:
    """Radius of the zone, its outer and its inner cosines."""
    tool = arm.tool_rotation @ -arm.wrist_in_tool
    d = float(np.linalg.norm(tool))
    if d < ROUND_OFF:
        return 0.0, -1.0, 1.0, -1.0, 1.0
    low, high, pad = _cosines(arm, tool / d, limits[4], limits[5])
    outer = max(-1.0, low - pad), min(1.0, high + pad)
    inner = (low, high)
    span_4 = limits[3][1] - limits[3][0]
    if span_4 < FULL_TURN:
        on_axis = np.linalg.norm(np.cross(arm.axes[5], tool)) < ROUND_OFF * d
        square = max(abs(arm.axes[4] @ arm.axes[3]), abs(arm.axes[4] @ arm.axes[5])) < _MIRRORED
        inner = _both_directions(arm, tool, limits[4]) if on_axis and square and span_4 >= np.pi else (1.0, -1.0)
    return d, outer[0], outer[1], inner[0], inner[1]


def _cosines(arm: WristPartitionedArm, tool: Reals, range_5: Range, range_6: Range) -> tuple[float, float, float]:
    """Attained extremes of the cosine between axis 4 and the tool point's direction, and by how much they may be off.

    For each angle of joint 6 the cosine is ``A + B cos(theta_5) + C sin(theta_5)``, whose extremes on an interval are
    known; over joint 6 it is Lipschitz with the tool's part across axis 6, so a fine grid bounds it.
    """
    w4, w5, w6 = arm.axes[3], arm.axes[4], arm.axes[5]
    beside = float(np.linalg.norm(np.cross(w6, tool)))
    steps = _TOOL_STEPS if beside > ROUND_OFF else 1
    theta_6 = np.linspace(range_6[0], range_6[1], steps + 1)[:, None]
    y = tool * np.cos(theta_6) + np.cross(w6, tool) * np.sin(theta_6) + w6 * (w6 @ tool) * (1 - np.cos(theta_6))
    along = y @ w5
    constant, cosine, sine = along * (w4 @ w5), y @ w4 - along * (w4 @ w5), np.cross(w5, y) @ w4
    size, peak = np.hypot(cosine, sine), np.arctan2(sine, cosine)

    def inside(angle: Reals) -> Flags:
        return np.asarray((angle - range_5[0]) % (2 * np.pi) <= range_5[1] - range_5[0])

    ends = np.stack([constant + cosine * np.cos(end) + sine * np.sin(end) for end in range_5])
    high: float = np.where(inside(peak), constant + size, ends.max(axis=0)).max()
    low: float = np.where(inside(peak + np.pi), constant - size, ends.min(axis=0)).min()
    pad = beside * (range_6[1] - range_6[0]) / steps / 2 + ROUND_OFF
    return float(np.clip(low, -1, 1)), float(np.clip(high, -1, 1)), pad


def _both_directions(arm: WristPartitionedArm, tool: Reals, range_5: Range) -> tuple[float, float]:
    """With half a turn of joint 4, the tilts that joint 5 reaches with both signs still have every azimuth."""
    aligned = np.arctan2(np.cross(tool, arm.axes[3]) @ arm.axes[4], tool @ arm.axes[3])
    middle = (range_5[0] + range_5[1]) / 2
    shift = aligned + 2 * np.pi * np.round((middle - aligned) / (2 * np.pi))
    low, high = range_5[0] - shift, range_5[1] - shift
    if not low < 0 < high:
        return 1.0, -1.0
    return float(np.cos(min(high, -low, np.pi))), 1.0


@kernel
def turned(v: Vector, axis: Vector, c: float, s: float) -> Vector:
    """v across the unit axis, turned about it by the angle with cosine c and sine s; a part along the axis stays."""
    along = v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2]
    flat = subtract(v, scaled(axis, along))
    side = cross(axis, v)
    return add(add(scaled(flat, c), scaled(side, s)), scaled(axis, along))


@kernel
def wrist_and_forearm(arm: SectionArm, theta_2: float, tau: float) -> tuple[Vector, Vector]:
    """Wrist centre W (m) and forearm direction f at joint 1 = 0."""
    c, s = np.cos(theta_2 + tau), np.sin(theta_2 + tau)
    upper = turned(arm.upper, arm.axis_2, np.cos(theta_2), np.sin(theta_2))
    forearm = turned(arm.forearm, arm.axis_2, c, s)
    return add(arm.centre, add(upper, forearm)), turned(arm.direction, arm.axis_2, c, s)


@inner_kernel
def along_change(
    arm: SectionArm, x: Vector, x_1: Vector, theta_2: float, f: Vector, e1: float, e2: float, e3: float
) -> float:
    """Bound on how much ``(x - W) . f`` changes over a box about (phi, theta_2, tau).

    ``(x - W) . f = y . f - U . f + const`` with y = x - C, and ``U . f`` depends on tau alone.

    Parameters
    ----------
    x : point at the box's middle, m; x_1 : its derivative in phi
    f : forearm direction at the middle; e1, e2, e3 : half-widths of the box, rad
    """
    y, f_t = subtract(x, arm.centre), cross(arm.axis_2, f)
    rho: float = np.sqrt(dot(x_1, x_1))
    away = np.sqrt(dot(y, y)) + rho * e1
    upper = turned(arm.upper, arm.axis_2, np.cos(theta_2), np.sin(theta_2))
    s_2 = dot(y, f_t)
    first = abs(dot(x_1, f)) * e1 + abs(s_2) * e2 + abs(s_2 - dot(upper, f_t)) * e3
    second = rho * e1 * e1 + away * (e2 + e3) ** 2 + arm.upper_length * e3 * e3
    bound: float = first + 0.5 * second + rho * e1 * (e2 + e3)
    return bound


MAX_ARCS = 12


@kernel
def _cut(arcs: Reals, count: int, low: float, high: float, more: bool) -> int:
    """Take the interval [low, high] within [0, 2 pi] out of the set; see :func:`remove`."""
    n = 0
    while n < count:
        a, b = arcs[n, 0], arcs[n, 1]
        if high <= a or low >= b:
            n += 1
        elif low <= a and high >= b:
            count -= 1
            arcs[n, 0], arcs[n, 1] = arcs[count, 0], arcs[count, 1]
        elif low > a and high < b:
            if count == MAX_ARCS and not more:
                return count
            arcs[n, 1] = low
            if count == MAX_ARCS:
                return count
            arcs[count, 0], arcs[count, 1] = high, b
            count += 1
            n += 1
        else:
            if low <= a:
                arcs[n, 0] = high
            else:
                arcs[n, 1] = low
            n += 1
    return count


@kernel
def remove(arcs: Reals, count: int, low: float, high: float, more: bool) -> int:
    """Take the arc from ``low`` up to ``high`` (any turn) out of the set; returns the new count.

    Where the list is full, ``more`` says whether to take out too much or too little.
    """
    if high <= low:
        return count
    if high - low >= TURN:
        return 0
    shift = np.floor(low / TURN) * TURN
    low, high = low - shift, high - shift
    if high <= TURN:
        return _cut(arcs, count, low, high, more)
    count = _cut(arcs, count, low, TURN, more)
    return _cut(arcs, count, 0.0, high - TURN, more)


@kernel
def meets(arcs: Reals, count: int, low: float, high: float) -> bool:
    """Whether the arc from ``low`` to ``high`` (any turn) meets the set."""
    if high - low >= TURN:
        return count > 0
    shift = np.floor(low / TURN) * TURN
    low, high = low - shift, high - shift
    for n in range(count):
        if arcs[n, 0] <= high and arcs[n, 1] >= low:
            return True
        if arcs[n, 0] <= high - TURN:
            return True
    return False


@kernel
def measure(arcs: Reals, count: int) -> float:
    """Sum of the arcs' lengths, rad."""
    total = 0.0
    for n in range(count):
        total += arcs[n, 1] - arcs[n, 0]
    return total
