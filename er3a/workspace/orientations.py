"""The tool orientations that are tested for an arm, depending on what its joints can set.

For arms with six joints and more, *directions* of the tool's z axis all over the sphere are tested; also for arms with
five that can't set the rotation about it. If joints 2 to 4 have parallel axes and no other joint tilts the tool, it
points within a plane that joint 1 carries around: *tilts* in that plane are tested. For a SCARA *turns* about its axes
are tested, for an arm of three joints only *points*.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from er3a.by_value import by_identity
from er3a.collision.shapes import outward
from er3a.geometry.transforms import exp_rotation
from er3a.geometry.vectors import fibonacci_sphere
from er3a.kinematics.by_class import arm_solver, with_task_frame
from er3a.kinematics.chain import axes_at_zero_theta, constant_links
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot
from er3a.workspace.cell_frame import cell_frame
from er3a.workspace.directions import Roll, cone_directions, roll_of, tool_rotations

AskedKind = Literal["directions", "tilts", "turns", "points"]
_PARALLEL = 1e-9  # sine: rounding of tables that are exact
_MIN_PLANAR = 3  # joints that place the tool in a plane and tilt it there
ALONG = 1 - 1e-6  # cosine: axes of files that round pi/2 to three decimals
_TASK_TURNS = 36  # about a SCARA's axes, one for each 10 deg


@by_identity
class TiltPlane:
    """The plane that the tool points within, with joint 1 at theta 0, in the base frame.

    Attributes
    ----------
    axis, normal, up : (3,), unit vectors: axis 1, what joints 2 to 4 turn about, and axis 1 across it
    origin : (3,), m, on axis 1; beside : m, how far the tool point is from there along the normal, always
    tool : (3, 3), orientation of the tool with all joints at 0; tilt : rad, its tilt from ``up`` about the normal
    """

    axis: Reals
    normal: Reals
    up: Reals
    origin: Reals
    beside: float
    tool: Reals
    tilt: float

    def turns(self, points: Reals) -> Reals:
        """By how much joint 1 turns the plane to reach points.

        Parameters
        ----------
        points : (n, 3), m, base frame

        Returns
        -------
        turns : (n, 2), rad, NaN where it can't

        Notes
        -----
        The plane is at a constant distance from axis 1, so it meets a circle about the axis twice, once, or never.
        """
        away = points - self.origin
        flat = self.normal - (self.normal @ self.axis) * self.axis
        a, b = away @ flat, away @ np.cross(self.axis, flat)
        c = self.beside - (self.normal @ self.axis) * (away @ self.axis)
        size = np.hypot(a, b)
        ratio = np.divide(c, size, out=np.full(len(points), 2.0), where=size > 0)
        aside = np.arccos(np.where(np.abs(ratio) <= 1, ratio, np.nan))
        return np.asarray(np.arctan2(b, a)[:, None] + np.stack([aside, -aside], axis=1))

    def tilted(self, points: Reals, tilts: Reals) -> Reals:
        """Orientations of the tool at points, for tilts within the plane.

        Parameters
        ----------
        points : (n, 3), m, base frame
        tilts : (1 or n, asked, 2), rad, one for each of the plane's two turns

        Returns
        -------
        rotations : (n, asked, 2, 3, 3); one that the arm can't take where the plane can't reach the point
        """
        return self._rotations(*np.broadcast_arrays(self.turns(points)[:, None], tilts))

    def tilted_within(self, points: Reals, axis: Reals, half_angle: float, step: float) -> Reals:
        """Orientations of the tool at points along which it is within an angle of an axis.

        Parameters
        ----------
        points : (n, 3), m, base frame
        axis : (3,), unit vector
        half_angle : rad
        step : rad, between one tilt and the next at most

        Returns
        -------
        rotations : (n, asked, 2, 3, 3), of the plane's two turns
        """
        turns = self.turns(points)
        frames = exp_rotation(np.nan_to_num(turns).reshape(-1, 1) * self.axis)
        normal, up = frames @ self.normal, frames @ self.up
        aside = float(self.tool[:, 2] @ self.normal)
        x, y = up @ axis, np.cross(normal, up) @ axis
        size = np.hypot(x, y) * np.sqrt(max(0.0, 1 - aside**2))
        smallest = np.cos(half_angle) - aside * (normal @ axis)
        ratio = np.divide(smallest, size, out=np.where(smallest > 0, 2.0, -1.0), where=size > 1e-12)
        width = np.arccos(np.where(ratio <= 1 + 1e-9, np.clip(ratio, -1, 1), np.nan)).reshape(turns.shape)
        middle = np.arctan2(y, x).reshape(turns.shape)
        share = np.linspace(-1, 1, 2 * int(np.ceil(half_angle / step - 1e-9)) + 1)[:, None] * [1.0, -1.0]
        return self.tilted(points, middle[:, None] + width[:, None] * share)

    def _rotations(self, turns: Reals, tilts: Reals) -> Reals:
        """Orientations (..., 3, 3) of the tool at turns and tilts (rad, of one shape); out of the plane where NaN."""
        none = np.isnan(turns) | np.isnan(tilts)
        about_1 = exp_rotation(np.where(none, 0.0, turns).reshape(-1, 1) * self.axis)
        about_2 = exp_rotation(np.where(none, 0.0, tilts - self.tilt).reshape(-1, 1) * self.normal)
        found = (about_1 @ about_2 @ self.tool).reshape(*turns.shape, 3, 3)
        found[none] = tool_rotations((0.8 * self.normal + 0.6 * self.up)[None], Roll(True, (0.0,)))[0, 0]
        return np.asarray(found)


@by_identity
class AskedOrientations:
    """The required tool orientations: their kind, how the roll is treated, and the zero of turns and tilts.

    Attributes
    ----------
    tool : (3, 3), orientation of the tool with all joints at theta 0; axis : (3,), axis 1, both in the base frame
    plane : of tilts
    """

    kind: AskedKind
    roll: Roll
    tool: Reals
    axis: Reals
    plane: TiltPlane | None = None

    def everywhere(self, points: Reals, count: int) -> Reals:
        """All required orientations at points of place 0.

        Parameters
        ----------
        points : (n, 3), m, base frame
        count : of directions, turns or tilts

        Returns
        -------
        rotations : (1 or n, asked, tries, 3, 3); an orientation counts as reached if one of its tries is
        """
        if self.kind == "points":
            return np.eye(3)[None, None, None]
        if self.kind == "turns":
            return self._about_axis(2 * np.pi * np.linspace(0, 1, count, endpoint=False))[None, :, None]
        if self.plane is not None:
            tilts = np.arange(count) * (2 * np.pi / count)
            return self.plane.tilted(points, np.stack([tilts, -tilts], axis=1)[None])
        return tool_rotations(fibonacci_sphere(count), self.roll)[None]

    def in_cone(self, points: Reals, axis: Reals, half_angle: float, step: float) -> Reals:
        """A task's orientations at points (n, 3), m: (1 or n, asked, tries, 3, 3), none if no orientation fits.

        Directions within ``half_angle`` (rad) of ``axis`` (3,) are asked every ``step`` (rad); of a SCARA, one of the
        turns along which its tool points so.
        """
        if self.kind == "points":
            return np.eye(3)[None, None, None]
        if self.kind == "turns":
            turned = self._about_axis(2 * np.pi * np.linspace(0, 1, _TASK_TURNS, endpoint=False))
            fits = turned[:, :, 2] @ axis >= np.cos(half_angle) - 1e-9
            return turned[fits][None, None] if fits.any() else np.empty((1, 0, 1, 3, 3))
        if self.plane is not None:
            return self.plane.tilted_within(points, axis, half_angle, step)
        return tool_rotations(cone_directions(axis, half_angle, step), self.roll)[None]

    def _about_axis(self, turns: Reals) -> Reals:
        """The tool turned about the axis by angles (n,), rad: (n, 3, 3)."""
        return exp_rotation(turns[:, None] * self.axis) @ self.tool


def asked_of(robot: Robot, rolls: int) -> AskedOrientations | None:
    """Which orientations are asked of a robot's tool, depending on what its joints can set.

    Parameters
    ----------
    rolls : how many to try about a direction, where they matter

    Returns
    -------
    asked : None where it is not known what its few joints can do at a point
    """
    axes, _, T = axes_at_zero_theta(robot)
    code, tool, axis = arm_solver(robot).chain.code, T[:3, :3], axes[0]
    none = Roll(True, (0.0,), last_joint=False)
    if code == "position":
        return AskedOrientations("points", none, tool, axis)
    if code == "scara":
        return AskedOrientations("turns", none, tool, axes[int(np.flatnonzero(~robot.sliding)[0])])
    if code == "free_roll":
        return AskedOrientations("directions", none, tool, axis) if with_task_frame(robot) is robot else None
    if robot.rows != robot.joints:  # a linkage decides the tool's orientation
        return None
    if code == "planar_wrist":
        roll = roll_of(robot, rolls)
        plane = _tilt_plane(robot, robot.joints - int(roll.free))
        roll = roll if roll.free else none
        return None if plane is None else AskedOrientations("tilts", roll, tool, axis, plane)
    return AskedOrientations("directions", roll_of(robot, rolls), tool, axis)


def along_last_axis(robot: Robot) -> tuple[Robot, str]:
    """A robot whose tool points along the axis of its last joint, as grippers are mounted.

    Parameters
    ----------
    robot : whose file may give the flange another axis there, as ROS's frames ``flange`` and ``ee_link`` have x, or
        one that points into the arm

    Returns
    -------
    robot : with its tool frame turned, z outward; the same where a tool is given or z is along that axis
    name : of the flange's axis that is z there, "z" of the same robot
    """
    axis = constant_links(robot)[-1][2, :3]
    k = int(np.abs(axis).argmax())
    z = axis * (outward(robot)[0] or np.sign(axis[k]))
    if robot.slides[-1] or z[2] > ALONG or abs(axis[k]) < ALONG or not np.array_equal(robot.tool, np.eye(4)):
        return robot, "z"
    x = np.cross(np.eye(3)[(k + 1) % 3], z)
    x /= np.linalg.norm(x)
    turned = np.eye(4)
    turned[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return robot.replace(tool=turned), ("" if z[k] > 0 else "−") + "xyz"[k]


def _tilt_plane(robot: Robot, joints: int) -> TiltPlane | None:
    """The plane in which an arm's first ``joints`` joints tilt its tool; None if they do not tilt it in a plane."""
    axes, _, T = axes_at_zero_theta(robot)
    later_axes, sliding = axes[1:joints], robot.sliding[1:joints]
    if robot.sliding[0] or len(later_axes) < _MIN_PLANAR or sliding.all():
        return None
    normal = later_axes[~sliding][0]
    apart = np.linalg.norm(np.cross(later_axes[~sliding], normal), axis=1).max()
    along = np.abs(later_axes[sliding] @ normal).max(initial=0.0)
    up = axes[0] - (axes[0] @ normal) * normal
    if max(apart, along) > _PARALLEL or np.linalg.norm(up) < _PARALLEL:
        return None
    up /= np.linalg.norm(up)
    origin, pointing = cell_frame(robot).origin, T[:3, 2]
    tilt = float(np.arctan2(np.cross(up, pointing) @ normal, up @ pointing))
    return TiltPlane(axes[0], normal, up, origin, float((T[:3, 3] - origin) @ normal), T[:3, :3], tilt)
