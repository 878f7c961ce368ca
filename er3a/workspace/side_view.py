"""The side view as manufacturers draw it: x in the arm's plane, positive to the front at joint 1 = 0, and height.

The exact border of the section is made of circular arcs, which come with the joint values that make them. In the arm's
plane, with points as complex numbers x + i z, an arm that is its own mirror image has

    W = C + e^(-i theta_2) (U + e^(-i tau) M),    p = W + d e^(-i gamma) f,    f = e^(-i (theta_2 + tau)) F

with the tilt gamma of the tool against the forearm. On the border, each joint is at a limit or the links that it
moves are in line with what they turn about (Kumar and Waldron 1981 [1]_): one joint sweeps, the others stand, so the
border is made of circular arcs. Of all such arcs, the parts are kept that have proven unreachable points beside them.

References
----------
.. [1] A. Kumar, K. J. Waldron, "The workspaces of a mechanical manipulator", J. Mech. Design 103, 1981.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from er3a.kinematics.chain import constant_links
from er3a.kinematics.forward import forward
from er3a.kinematics.wrist_partitioned import wrist_partition_missing, wrist_partitioned_arm
from er3a.numerics.arrays import Flags, Integers, Reals, runs
from er3a.numerics.jit import kernel
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid, make_grid
from er3a.sampling.point_chain import at_wrist_centre, plane_direction
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import Tally, tally_blocks
from er3a.workspace.section_arm import SectionArm, section_arm, section_frame
from er3a.workspace.section_proof import STACK, is_empty

Complexes = NDArray[np.complex128]
Swept = Literal["theta_2", "tau", "gamma"]

SAMPLES = 121
_SWEPT: tuple[Swept, ...] = ("theta_2", "tau", "gamma")
_BESIDE = 4e-3
_MAX_BOXES = 12_000
_ANGLE = 1e-9


@dataclass(frozen=True)
class BorderArc:
    """Part of a circle in the section.

    Attributes
    ----------
    points : (n, 2), m, radius (in a side view: x, negative on the far side of axis 1) and height
    joints : (n, 3), rad, theta_2, tau and gamma
    """

    points: Reals
    joints: Reals
    sweeps: Swept


def border(arm: SectionArm, side_view: bool = False) -> list[BorderArc]:
    """Arcs of the border of the section; none if the arm is no mirror image of itself.

    A limited joint 1 is left out of account: what counts is whether any azimuth reaches the ring, or, in a side view,
    whether the arm reaches the point of its own plane without joint 1, as manufacturers draw it.
    """
    if not arm.mirrored or arm.inner_low > arm.inner_high:
        return []
    arcs, seen = [], set()
    for sweeps, joints in _candidates(arm):
        points = _points(arm, joints)
        key = tuple(np.round(points[[0, SAMPLES // 3, -1]].view(float), 9))
        if key in seen or np.ptp(np.abs(points - points.mean())) == 0:
            continue
        seen.add(key)
        kept = _on_border(arm, points, side_view)
        for run in _runs(kept):
            across = points[run].real if side_view else np.abs(points[run].real)
            section = np.stack([across, points[run].imag], axis=1)
            arcs.append(BorderArc(section, joints[run], sweeps))
    return arcs


def _points(arm: SectionArm, joints: Reals) -> Complexes:
    centre, upper, forearm, direction = (
        complex(vector[0], vector[2]) for vector in (arm.centre, arm.upper, arm.forearm, arm.direction)
    )
    theta_2, tau, gamma = joints.T
    wrist = centre + np.exp(-1j * theta_2) * (upper + np.exp(-1j * tau) * forearm)
    points: Complexes = wrist + arm.d * np.exp(-1j * (theta_2 + tau + gamma)) * direction
    return points


def _candidates(arm: SectionArm) -> Iterator[tuple[Swept, Reals]]:
    """All arcs on which one joint sweeps: pairs of its name and joint values (SAMPLES, 3)."""
    upper, forearm, tool = (complex(v[0], v[2]) for v in (arm.upper, arm.forearm, arm.direction))
    tool = arm.d * tool
    tilts = _tilts(arm)
    ends = {end for tilt in tilts for end in tilt if abs(end) > _ANGLE and end < np.pi}
    tilt_ends = sorted(ends) or [0.0]

    def in_line(fixed: complex, moving: complex, ranges: list[tuple[float, float]]) -> list[float]:
        """Angles within the ranges at which e^(-i angle) moving points along or against ``fixed``."""
        if min(abs(fixed), abs(moving)) < 1e-9:
            return []
        angle = -np.angle(fixed / moving)
        turns = [float(angle + half * np.pi) for half in range(-4, 5)]
        return sorted({turn for low, high in ranges for turn in turns if low - _ANGLE <= turn <= high + _ANGLE})

    def sweep(joint: int, low: float, high: float, values: tuple[float, float, float]) -> tuple[Swept, Reals]:
        joints = np.tile(np.array(values), (SAMPLES, 1))
        joints[:, joint] = np.linspace(low, high, SAMPLES)
        return _SWEPT[joint], joints

    stands = [(tau, gamma) for tau in arm.tau for gamma in tilt_ends]
    for tau in arm.tau:
        bend = np.exp(-1j * tau)
        stands += [(tau, gamma) for gamma in in_line(upper + bend * forearm, bend * tool, tilts)]
    for gamma in [*tilt_ends, *in_line(forearm, tool, tilts)]:
        stands += [(tau, gamma) for tau in in_line(upper, forearm + np.exp(-1j * gamma) * tool, [arm.tau])]
    for tau, gamma in stands:
        yield sweep(0, *arm.theta_2, (0.0, tau, gamma))
    for theta_2 in arm.theta_2:
        for gamma in [*tilt_ends, *in_line(forearm, tool, tilts)]:
            yield sweep(1, *arm.tau, (theta_2, 0.0, gamma))
        for tau in arm.tau if arm.d > 0 else ():
            for low, high in tilts:
                yield sweep(2, low, high, (theta_2, tau, 0.0))


def _tilts(arm: SectionArm) -> list[tuple[float, float]]:
    """Ranges of gamma in the arm's plane."""
    if arm.d == 0:
        return [(0.0, 0.0)]
    smallest, most = float(np.arccos(arm.inner_high)), float(np.arccos(arm.inner_low))
    return [(-most, most)] if smallest < _ANGLE else [(-most, -smallest), (smallest, most)]


def _on_border(arm: SectionArm, points: Complexes, side_view: bool) -> Flags:
    """Which points have a proven unreachable ring (or point of the plane) close beside them, on either side."""
    along = np.gradient(points)
    length = np.abs(along)
    normal = np.where(length > 0, 1j * along / np.where(length > 0, length, 1), 0)
    beside = np.concatenate([points + s * _BESIDE * arm.reach * normal for s in (1, -1)])
    rings = np.stack([np.abs(beside.real), beside.imag], axis=1)
    angles = np.tile([0.0, np.pi], (len(rings), 1))
    if side_view:
        angles[:] = np.where(beside.real >= 0, 0.0, np.pi)[:, None]
    free = np.zeros(len(rings), dtype=bool)
    _unreachable(arm, rings, angles, free)
    return free[: len(points)] | free[len(points) :]


@kernel
def _unreachable(arm: SectionArm, rings: Reals, angles: Reals, out: Flags) -> None:
    stack = np.empty((STACK, 6))
    for n in range(rings.shape[0]):
        rho, z = rings[n, 0], rings[n, 1]
        out[n], _ = is_empty(arm, (rho, rho, z, z), angles[n, 0], angles[n, 1], _MAX_BOXES, stack)


def _runs(kept: Flags) -> list[slice]:
    """Stretches of at least three points in a row."""
    return [slice(a, b) for a, b in runs(kept) if b - a >= 3]


BorderPoint = Literal["tool_point", "wrist_centre", "flange"]
Sweeping = Literal["joint_2", "joint_3", "wrist"]

WRIST_SAMPLES = 4_000_000
_SWEEPING: dict[Swept, Sweeping] = {"theta_2": "joint_2", "tau": "joint_3", "gamma": "wrist"}
_VIEWS: tuple[Literal["section"], Literal["side"]] = ("section", "side")


@dataclass(frozen=True, eq=False)
class SideView:
    """Touched cells of the side view of one point.

    Attributes
    ----------
    x, z : (n,), m, middles of the cells, to the front and along axis 1; cell : m, their edge
    samples : (n,), how many fell into each
    """

    point: Literal["tool_point", "wrist_centre"]
    x: Reals
    z: Reals
    cell: float
    samples: Integers


@dataclass(frozen=True, eq=False)
class BorderLine:
    """An arc of the exact border of one point, with the joint values that make it.

    Attributes
    ----------
    view : "section" (folded about axis 1) or "side"
    number : of the arc among those of its point and view, from 1
    sweeps : what moves along the arc while the other joints are fixed
    points : (n, 2), m, distance from axis 1 (in a side view: x to the front) and height
    q : (n, 2), rad, joints 2 and 3; tilt : (n,), rad, angle of the tool point's direction to axis 4
    """

    view: Literal["section", "side"]
    point: BorderPoint
    number: int
    sweeps: Sweeping
    points: Reals
    q: Reals
    tilt: Reals


def side_views(robot: Robot, tally: Tally, grid: Grid, draw: Draw) -> list[SideView]:
    """Side views of the tool point and, with fewer samples, of the wrist centre, if there is one."""
    front = _front(robot, plane_direction(robot))
    found = [_side_view("tool_point", grid, tally, front)]
    if wrist_partition_missing(robot) or robot.coupling is not None:
        return found
    bare = at_wrist_centre(robot)
    wrist_grid = make_grid(bare, max(grid.shape))
    fewer = Draw(draw.seed, min(draw.samples, WRIST_SAMPLES), 1, draw.sampling)
    return [*found, _side_view("wrist_centre", wrist_grid, tally_blocks(bare, wrist_grid, fewer, [0], 0), front)]


def _side_view(point: Literal["tool_point", "wrist_centre"], grid: Grid, tally: Tally, front: float) -> SideView:
    index = np.argwhere(tally.side > 0)
    x = np.asarray(front * (index[:, 0] - grid.section_shape[0] + 0.5) * grid.section_cell, np.float64)
    z = grid.section_origin[1] + (index[:, 1] + 0.5) * grid.section_cell
    return SideView(point, x, z, grid.section_cell, tally.side[tally.side > 0])


def border_lines(robot: Robot) -> list[BorderLine]:
    """Exact borders of tool point, flange and wrist centre; none without a spherical wrist."""
    if wrist_partition_missing(robot) or robot.coupling is not None or robot.combined:
        return []
    front, elbow = _front(robot, section_frame(robot)[0][0]), wrist_partitioned_arm(robot).elbow_sign
    arms: dict[BorderPoint, SectionArm] = {
        "tool_point": section_arm(robot),
        "wrist_centre": section_arm(robot, wrist_centre=True),
    }
    if not np.array_equal(robot.tool, np.eye(4)):
        arms["flange"] = section_arm(robot.replace(tool=np.eye(4)))
    found = []
    for view in _VIEWS:
        for point, arm in arms.items():
            for number, arc in enumerate(border(arm, side_view=view == "side"), start=1):
                across = arc.points[:, 0] * (front if view == "side" else 1)
                theta = np.stack([arc.joints[:, 0], elbow * arc.joints[:, 1]], axis=1)
                line = np.stack([across, arc.points[:, 1]], axis=1)
                q, tilt = _joints_2_3(robot, theta), np.abs(arc.joints[:, 2])
                found.append(BorderLine(view, point, number, _SWEEPING[arc.sweeps], line, q, tilt))
    return found


def _joints_2_3(robot: Robot, theta: Reals) -> Reals:
    """The manufacturer's angles (n, 2), rad, by whole turns within the limits."""
    q = robot.direction[1:3] * (theta - robot.offset[1:3])
    middle = (robot.lower[1:3] + robot.upper[1:3]) / 2
    return q + 2 * np.pi * np.round((middle - q) / (2 * np.pi))


def corner_side(robot: Robot, q2: float, q3: float) -> float:
    """-1 if the wrist centre lies behind axis 1 with joints 2 and 3 (rad) at these values, else +1."""
    if wrist_partition_missing(robot):
        return 1.0
    bare = at_wrist_centre(robot)
    away = forward(bare, np.array([0, q2, q3, 0, 0, 0]))[:3, 3] - constant_links(bare)[0, :3, 3]
    return 1.0 if away @ robot.base[:3, 0] >= 0 else -1.0


def _front(robot: Robot, direction: Reals) -> float:
    """+1 if a direction (3,) across axis 1, given for theta_1 = 0, points to the base's +x at joint 1 = 0, else -1."""
    axis, angle = constant_links(robot)[0, :3, 2], robot.offset[0]
    turned = np.cos(angle) * direction + np.sin(angle) * np.cross(axis, direction)
    return 1.0 if turned @ robot.base[:3, 0] >= 0 else -1.0
