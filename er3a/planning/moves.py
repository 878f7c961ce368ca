"""Moves between two points: in joint space, and along a straight line of the tool.

Joint moves run on a quintic; lines on a quintic or a trapezoid, from rest to rest. The orientation turns
about one fixed axis at a rate proportional to the position's (slerp [1]_), in the shorter direction.

A rotation by half a turn is equally short in both directions. It is then taken counter-clockwise as seen from
above: of the two opposite axes, the one that points up (+Z of the base), if level the one towards +Y, if that is 0 too
towards +X. A path may choose the other one by naming an axis.

``jtraj``, ``ctraj`` and ``rpy`` have the names of the Robotics Toolbox [2]_. Times are in seconds.

References
----------
.. [1] K. Shoemake, "Animating rotation with quaternion curves", SIGGRAPH 1985.
.. [2] P. Corke, *Robotics, Vision and Control*, 2nd ed., sections 3.1 to 3.3.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Protocol, runtime_checkable

import numpy as np

from er3a.by_value import ByValue, Displayed, frozen
from er3a.errors import Er3aError, PoseError
from er3a.geometry.transforms import check_poses, exp_rotation, log_rotation, posed
from er3a.numerics.arrays import Reals
from er3a.planning.piecewise import PiecewiseMotion, polynomial_motion
from er3a.planning.profiles import BEYOND, Ends, FromRestToRest, Rates, TimeLaw, check_times, quintic

HALF_TURN_TOLERANCE = 1e-5  # rad, and of the axis: six digits of a quaternion or a matrix leave so much open


@runtime_checkable
class ToolPath(Protocol):
    """A path of the tool in space, and when it is where: what :func:`er3a.planning.follow.follow` can follow.

    Attributes
    ----------
    duration : s
    length : of the tool point's path, m
    turned : by how much the tool turns in all, rad
    """

    @property
    def duration(self) -> float:
        """Duration, s."""

    @property
    def length(self) -> float:
        """Length of the tool point's path, m."""

    @property
    def turned(self) -> float:
        """By how much the tool turns in all, rad."""

    def progress(self, t: Reals) -> Rates:
        """Share of the path done, which never falls, with its derivatives by time.

        Parameters
        ----------
        t : (...,), s, from 0 to ``duration``

        Returns
        -------
        progress, first, second : (...,), 0 to 1, 1/s and 1/s^2
        """

    def poses(self, progress: Reals) -> Reals:
        """Poses of the tool along the path.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        T : (..., 4, 4), T_base_tool, m
        """

    def twists(self, progress: Reals) -> tuple[Reals, Reals]:
        """Velocity of the tool per unit of progress, and its derivative by progress.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        twist, slope : (..., 6), linear (m) then angular (rad), of the tool point, in base axes
        """

    def arc_length(self, progress: Reals) -> Reals:
        """Length of the tool point's path so far.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        length : (...,), m
        """

    @property
    def law(self) -> TimeLaw:
        """When the tool is where: the share of the path as a function of time."""

    @property
    def edges(self) -> Reals:
        """Shares of the path (m,), from 0 to 1, between which the twist and its derivative are continuous."""

    def half_turns(self) -> tuple[tuple[int, Reals], ...]:
        """Turns by exactly 180 deg, whose sense had to be chosen.

        Returns
        -------
        turns : number of the segment (from 1), and the axis taken, a unit vector (3,) in the base frame
        """


@frozen
class JointMove(ByValue, Displayed):
    """All joints start and stop together.

    Attributes
    ----------
    start, end : (6,), rad, manufacturer's angles
    duration : s
    velocities, accelerations : at start and end, (6,) in rad/s and rad/s^2, or 0
    """

    start: Reals
    end: Reals
    duration: float
    velocities: Ends = (0.0, 0.0)
    accelerations: Ends = (0.0, 0.0)

    def joints(self, t: Reals) -> tuple[Reals, Reals, Reals]:
        """Angles, velocities and accelerations of the quintic.

        Parameters
        ----------
        t : (...,), s, from 0 to ``duration``

        Returns
        -------
        q, velocity, acceleration : (..., 6), rad, rad/s and rad/s^2, manufacturer's angles

        Raises
        ------
        Er3aError
            for times beyond start and end
        """
        t = np.asarray(t, float)
        check_times(t, 0.0, self.duration)
        return quintic(t, self.duration, self.start, self.end, self.velocities, self.accelerations)

    def polynomials(self) -> PiecewiseMotion:
        """The move as one polynomial of fifth degree.

        Returns
        -------
        motion : one piece from 0 to ``duration``, rad and s
        """
        return polynomial_motion(self.joints, np.array([0.0, self.duration]), 5)


@frozen
class Segment(ByValue, Displayed, ABC):
    """What a :class:`Line` and an :class:`er3a.planning.sequences.Arc` of the tool share.

    Attributes
    ----------
    T_start : (4, 4), T_base_tool at the start
    rotation : (3,), rad, rotation vector of the tool from start to end in the base frame
    duration : s
    half_turn : whether the rotation is half a turn, so that its sense had to be chosen
    ramp : share of the time of each ramp of a trapezoid; None for the quintic
    """

    T_start: Reals
    rotation: Reals
    duration: float
    half_turn: bool
    ramp: float | None

    @property
    @abstractmethod
    def length(self) -> float:
        """Length of the tool point's path, m."""

    @abstractmethod
    def points(self, progress: Reals) -> Reals:
        """The tool point along the path.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        points : (..., 3), m, base frame
        """

    @abstractmethod
    def twists(self, progress: Reals) -> tuple[Reals, Reals]:
        """Velocity of the tool per unit of progress, and its derivative, as of :class:`ToolPath`.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        twist, slope : (..., 6), linear (m) then angular (rad), of the tool point, in base axes
        """

    @property
    def turned(self) -> float:
        """Size of the rotation from start to end, rad."""
        return float(np.linalg.norm(self.rotation))

    def progress(self, t: Reals) -> Rates:
        """Share of the path done, with its derivatives by time.

        Parameters
        ----------
        t : (...,), s, from 0 to ``duration``

        Returns
        -------
        progress, first, second : (...,), 0 to 1, 1/s and 1/s^2

        Raises
        ------
        Er3aError
            for times beyond start and end
        """
        return self.law(t)

    @property
    def law(self) -> TimeLaw:
        """From rest to rest over the duration: quintic, or trapezoid if ``ramp`` is given."""
        return FromRestToRest(np.array([0.0, self.duration]), np.array([0.0, 1.0]), self.ramp)

    @property
    def edges(self) -> Reals:
        """(2,), 0 and 1: the twist is continuous all along."""
        return np.array([0.0, 1.0])

    def at(self, t: Reals) -> Reals:
        """Poses of the tool at times.

        Parameters
        ----------
        t : (...,), s, from 0 to ``duration``

        Returns
        -------
        T : (..., 4, 4), T_base_tool, m

        Raises
        ------
        Er3aError
            for times beyond start and end
        """
        return self.poses(self.progress(t)[0])

    def poses(self, progress: Reals) -> Reals:
        """Poses of the tool along the path.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        T : (..., 4, 4), T_base_tool, m

        Raises
        ------
        Er3aError
            for shares beyond 0 and 1, such as times in s
        """
        progress = np.asarray(progress, float)
        if progress.size and (progress.min() < -BEYOND or progress.max() > 1 + BEYOND):
            ends = f"{progress.min():g} to {progress.max():g}"
            raise Er3aError(f"progress runs from {ends}; expected shares of the way, 0 to 1. At times in s: at(t)")
        return turning_poses(self.T_start, self.points(progress), self.rotation, progress)

    def arc_length(self, progress: Reals) -> Reals:
        """Length of the tool point's path so far; it grows evenly with the share.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        length : (...,), m
        """
        return self.length * np.asarray(progress)

    def half_turns(self) -> tuple[tuple[int, Reals], ...]:
        """The rotation if it is by exactly 180 deg, so that its sense had to be chosen.

        Returns
        -------
        turns : empty, or one pair: 1, and the axis taken, a unit vector (3,) in the base frame
        """
        return ((1, self.rotation / np.pi),) if self.half_turn else ()


@frozen
class Line(Segment):
    """A straight line of the tool; ``translation`` (3,), m, leads from start to end in the base frame."""

    translation: Reals

    @property
    def length(self) -> float:
        """Distance from start to end, m."""
        return float(np.linalg.norm(self.translation))

    def points(self, progress: Reals) -> Reals:
        """The tool point along the line.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        points : (..., 3), m, base frame
        """
        return self.T_start[:3, 3] + np.asarray(progress)[..., None] * self.translation

    def twists(self, progress: Reals) -> tuple[Reals, Reals]:
        """Velocity of the tool per unit of progress, and its derivative, which is 0: both rates are constant.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        twist, slope : (..., 6), linear (m) then angular (rad), of the tool point, in base axes
        """
        shape = (*np.shape(progress), 6)
        return np.broadcast_to(np.concatenate([self.translation, self.rotation]), shape), np.zeros(shape)


def line(
    T_start: Reals, T_end: Reals, duration: float, half_turn_axis: Reals | None = None, ramp: float | None = None
) -> Line:
    """The straight line between two poses of the tool.

    Parameters
    ----------
    T_start, T_end : (4, 4), T_base_tool, m
    duration : s
    half_turn_axis : (3,), base frame; for rotations by exactly half a turn, the side to which the axis shall point
    ramp : share of the time of each ramp of a trapezoid; None for the quintic

    Returns
    -------
    line : from rest to rest

    Raises
    ------
    Er3aError
        if the duration is an array of times, which :func:`er3a.ctraj` takes, instead of a number
    PoseError
        if a pose is not a rigid transform, or ``half_turn_axis`` does not decide between the two axes
    """
    if np.ndim(duration):
        raise Er3aError(f"duration has shape {np.shape(duration)}; expected s, such as 5.0. Poses at times: er3a.ctraj")
    T_start, T_end = check_poses(T_start, "T_start"), check_poses(T_end, "T_end")
    rotation, half_turn = rotation_between(T_start, T_end, half_turn_axis)
    return Line(T_start, rotation, duration, half_turn, ramp, T_end[:3, 3] - T_start[:3, 3])


def rotation_between(T_start: Reals, T_end: Reals, half_turn_axis: Reals | None = None) -> tuple[Reals, bool]:
    """Rotation of the tool from one pose to another, in the shorter direction.

    Parameters
    ----------
    T_start, T_end : (4, 4), T_base_tool
    half_turn_axis : (3,), base frame, the side to which the axis of exactly half a turn shall point; None for upwards

    Returns
    -------
    rotation, half_turn : (3,), rotation vector, rad, base frame; and whether it is by half a turn

    Raises
    ------
    PoseError
        if ``half_turn_axis`` can't choose
    """
    rotation = log_rotation(T_end[:3, :3] @ T_start[:3, :3].T)
    angle = np.linalg.norm(rotation)
    half_turn = bool(abs(angle - np.pi) < HALF_TURN_TOLERANCE)
    if half_turn_axis is not None and not half_turn:
        raise PoseError(f"half_turn_axis is given, but the rotation is by {np.degrees(angle):.6g} deg, not by 180 deg")
    if half_turn and _sense(rotation / angle, half_turn_axis) < 0:
        rotation = rotation * (1.0 - 2.0 * np.pi / angle)
    return rotation, half_turn


def turning_poses(T_start: Reals, points: Reals, rotation: Reals, progress: Reals) -> Reals:
    """Poses at given points, turned evenly about one axis of the base frame.

    Parameters
    ----------
    T_start : (4, 4), T_base_tool with the orientation at the start
    points : (..., 3), m, base frame
    rotation : (3,), rad, rotation vector of the whole way, base frame
    progress : (...,), shares of that rotation, 0 to 1

    Returns
    -------
    T : (..., 4, 4), T_base_tool, with ``R = exp(progress [rotation]x) R_start``
    """
    return posed(exp_rotation(progress[..., None] * rotation) @ T_start[:3, :3], points)


def _sense(axis: Reals, wanted: Reals | None) -> float:
    """+1 to turn about ``axis``, -1 to turn about its opposite."""
    if wanted is not None:
        side = float(axis @ wanted)
        if abs(side) < 1e-6 * np.linalg.norm(wanted) or not np.any(wanted):
            shown = ", ".join(f"{value:.3g}" for value in axis + 0.0)
            raise PoseError(f"half_turn_axis is at right angles to the axis of the half turn, ({shown})")
        return float(np.sign(side))
    for component in axis[::-1]:
        if abs(component) > HALF_TURN_TOLERANCE:
            return float(np.sign(component))
    return 1.0
