"""Sequences of lines and arcs, with rounded corners or stops between them.

The whole has one parameter: the arc length of each segment, or TURN_LENGTH per radian of rotation if that is more.
Position and orientation are both rounded at a corner; the orientation as rotation vector about the corner's own, in
which each side is straight. At a corner that is not rounded the tool stops, unless the two sides are tangent.

Curves of pieces of fifth degree, including the pieces that round corners.

A corner is rounded by the quintic that leaves the one side and joins the other with their point, velocity and
acceleration, so that the whole has two continuous derivatives there. Between two straight sides that turn by an angle
g, a rounding over the length r on either side passes the corner at 3/8 r sin(g/2).

Rates of an orientation that is written as a rotation vector: R(s) = exp(w(s)) R_0.

References
----------
.. [1] T. D. Barfoot, *State Estimation for Robotics*, 2nd ed., section 8.1.5 (left Jacobian of SO(3)).
"""

from __future__ import annotations

import math
from collections.abc import Sequence as Many
from typing import ClassVar

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from er3a.by_value import ByValue, Displayed, by_identity, frozen
from er3a.errors import PathError, PoseError
from er3a.geometry.transforms import check_poses, exp_rotation, posed
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.planning.moves import Segment, rotation_between
from er3a.planning.piecewise import PiecewiseMotion, polynomial_motion
from er3a.planning.profiles import (
    POWERS,
    FromRestToRest,
    LegTimes,
    Rates,
    TimeLaw,
    Times,
    Timetable,
    joining,
    polynomial,
    times_at,
)

ON_A_LINE = 1e-6  # rad; three points this near to a straight line fix no circle


@frozen
class Arc(Segment):
    """A circular arc of the tool point.

    Attributes
    ----------
    centre, normal : (3,), m and unit vector, of the circle; the arc turns about the normal
    angle : rad, greater than 0; of an arc to a pose less than a full circle
    """

    centre: Reals
    normal: Reals
    angle: float

    @property
    def radius(self) -> float:
        """Radius of the circle, m."""
        return float(np.linalg.norm(self.T_start[:3, 3] - self.centre))

    @property
    def length(self) -> float:
        """Radius times angle, m."""
        return self.radius * self.angle

    def points(self, progress: Reals) -> Reals:
        """The tool point along the circle.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        points : (..., 3), m, base frame
        """
        return self.centre + self._spokes(np.asarray(progress, float))

    def twists(self, progress: Reals) -> tuple[Reals, Reals]:
        """Velocity of the tool per unit of progress, and its derivative.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        twist, slope : (..., 6), linear (m) then angular (rad), of the tool point, in base axes
        """
        spokes = self._spokes(np.asarray(progress, float))
        turning = np.broadcast_to(self.rotation, spokes.shape)
        first = np.concatenate([self.angle * np.cross(self.normal, spokes), turning], axis=-1)
        return first, np.concatenate([-(self.angle**2) * spokes, np.zeros_like(spokes)], axis=-1)

    def _spokes(self, progress: Reals) -> Reals:
        """From the centre to the tool point, (..., 3)."""
        spoke = self.T_start[:3, 3] - self.centre
        turn = (self.angle * progress)[..., None]
        return np.cos(turn) * spoke + np.sin(turn) * np.cross(self.normal, spoke)


def arc(
    T_start: Reals,
    via: Reals,
    T_end: Reals,
    duration: float,
    half_turn_axis: Reals | None = None,
    ramp: float | None = None,
) -> Arc:
    """The arc from a pose of the tool through a point to another pose.

    Parameters
    ----------
    T_start, T_end : (4, 4), T_base_tool, m
    via : (3,), m, base frame
    duration : s
    half_turn_axis : (3,), base frame; for rotations by exactly half a turn, the side to which the axis shall point
    ramp : share of the time of each ramp of a trapezoid; None for the quintic

    Returns
    -------
    arc : from rest to rest, by less than a full circle

    Raises
    ------
    PoseError
        if the three points fix no circle, a pose is no rigid transform, or ``half_turn_axis`` can't choose
    """
    T_start, T_end = check_poses(T_start, "T_start"), check_poses(T_end, "T_end")
    start = T_start[:3, 3]
    a, b = np.asarray(via, float) - start, T_end[:3, 3] - start
    normal = np.cross(a, b)
    far = max(np.linalg.norm(a), np.linalg.norm(b))
    apart = min(np.linalg.norm(a), np.linalg.norm(b), np.linalg.norm(a - b))
    if not apart > ON_A_LINE * far:
        raise PoseError("two of the arc's three points are one; a full circle takes two arcs")
    if np.linalg.norm(normal) < ON_A_LINE * apart * far:
        raise PoseError("the arc's three points lie on a straight line")
    to_centre = np.cross((a @ a) * b - (b @ b) * a, normal) / (2 * normal @ normal)
    normal = normal / np.linalg.norm(normal)
    last = b - to_centre
    angle = np.arctan2(normal @ np.cross(-to_centre, last), -to_centre @ last) % (2 * np.pi)
    rotation, half_turn = rotation_between(T_start, T_end, half_turn_axis)
    return Arc(T_start, rotation, duration, half_turn, ramp, start + to_centre, normal, float(angle))


GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)


@by_identity
class Curve:
    """Pieces over a parameter that runs from 0 to 1.

    Attributes
    ----------
    edges : (n + 1,), rising from 0 to 1
    coefficients : (n, 6, k), of the powers 0 to 5 of each piece's own share
    """

    edges: Reals
    coefficients: Reals

    def piece(self, s: Reals) -> tuple[Integers, Reals]:
        """Which piece a parameter is in, and where in it.

        Parameters
        ----------
        s : (...,), 0 to 1

        Returns
        -------
        i, share : (...,), number of the piece from 0, and the share of it, 0 to 1
        """
        s = np.asarray(s, float)
        i = np.clip(np.searchsorted(self.edges, s, side="right") - 1, 0, len(self.coefficients) - 1)
        return i, (s - self.edges[i]) / (self.edges[i + 1] - self.edges[i])

    def __call__(self, s: Reals) -> tuple[Reals, Reals, Reals]:
        """Value, first and second derivative by the parameter, each (..., k), at parameters (...,)."""
        i, u = self.piece(s)
        span = (self.edges[i + 1] - self.edges[i])[..., None]
        x, dx, ddx = polynomial(np.moveaxis(self.coefficients[i], -2, 0), u[..., None])
        return x, dx / span, ddx / span**2


def straight(start: Reals, end: Reals) -> Reals:
    """The straight piece between two points, as coefficients of powers.

    Parameters
    ----------
    start, end : (k,), in any unit

    Returns
    -------
    coefficients : (6, k), of the powers 0 to 5 of the piece's share; those from 2 on are 0
    """
    found = np.zeros((POWERS, len(start)))
    found[0], found[1] = start, np.subtract(end, start)
    return found


SERIES = 20  # terms of coefficients of a turn's rates: they are exact to rounding for more than two turns
OF_TURN = [[(-1.0) ** k / math.factorial(2 * k + first) for k in range(SERIES)] for first in (2, 3)]
"""(1 - cos) / x and (angle - sin) / (x angle) as series of the squared angle x."""


def spin(w: Reals, dw: Reals, ddw: Reals) -> tuple[Reals, Reals]:
    """Angular velocity J(w) w' and its derivative, by the left Jacobian J [1]_.

    Parameters
    ----------
    w, dw, ddw : (..., 3), rad: rotation vector and its derivatives by the curve's parameter

    Returns
    -------
    omega, its derivative : (..., 3), in the frame that the rotation vector is written in
    """
    x = (w * w).sum(axis=-1, keepdims=True)
    a, b = (polyval(x, series) for series in OF_TURN)
    da, db = (polyval(x, polyder(series)) for series in OF_TURN)
    dx = 2 * (w * dw).sum(axis=-1, keepdims=True)
    first = np.cross(w, dw)
    second = np.cross(w, first)
    omega = dw + a * first + b * second
    third = np.cross(w, ddw)
    slope = ddw + da * dx * first + a * third + db * dx * second + b * (np.cross(dw, first) + np.cross(w, third))
    return omega, slope


TURN_LENGTH = 0.1  # m per rad, of a turn on the spot, when time is shared out
ZERO_LENGTH = 1e-12  # m; shorter segments are left out
RUNS_ON = 1e-9  # relative difference of twists below which a corner is none


@frozen
class SegmentPath(ByValue, Displayed):
    """A sequence as a :class:`er3a.planning.moves.ToolPath`.

    Attributes
    ----------
    duration : s
    law : when the tool is where
    curve : position and rotation vector (k = 6) over the share of the path
    origins : (n, 3, 3), the orientation that each piece's rotation vectors start from
    arcs : per piece the arc that it is a part of, else None
    arc_shares : (n, 2), where on its arc a piece starts and ends
    turned : rad, by how much the tool turns in all
    turns : half turns, as of :class:`er3a.planning.moves.ToolPath`
    misses : (2,), m and rad, by how much its rounded corners pass their poses at most
    """

    duration: float
    law: TimeLaw
    curve: Curve
    origins: Reals
    arcs: tuple[Arc | None, ...]
    arc_shares: Reals
    turned: float
    turns: tuple[tuple[int, Reals], ...]
    misses: Reals

    @property
    def length(self) -> float:
        """Length of the tool point's path, m."""
        return float(self.arc_length(np.array(1.0)))

    @property
    def edges(self) -> Reals:
        """(m,), shares of the path, 0 to 1, where its pieces meet."""
        return self.curve.edges

    def progress(self, t: Reals) -> Rates:
        """Share of the path done, with its derivatives by time.

        Parameters
        ----------
        t : (...,), s, from 0 to ``duration``

        Returns
        -------
        progress, first, second : (...,), 0 to 1, 1/s and 1/s^2
        """
        return self.law(t)

    def poses(self, progress: Reals) -> Reals:
        """Poses of the tool along the path.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        T : (..., 4, 4), T_base_tool, m
        """
        progress = np.asarray(progress, float)
        values = self._values(progress)[0]
        i = self.curve.piece(progress)[0]
        return posed(exp_rotation(values[..., 3:]) @ self.origins[i], values[..., :3])

    def twists(self, progress: Reals) -> tuple[Reals, Reals]:
        """Velocity of the tool per unit of progress, and its derivative.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        twist, slope : (..., 6), linear (m) then angular (rad), of the tool point, in base axes
        """
        x, dx, ddx = self._values(np.asarray(progress, float))
        omega, slope = spin(x[..., 3:], dx[..., 3:], ddx[..., 3:])
        return np.concatenate([dx[..., :3], omega], axis=-1), np.concatenate([ddx[..., :3], slope], axis=-1)

    def arc_length(self, progress: Reals) -> Reals:
        """Length of the tool point's path so far, by Gauss quadrature with 12 points per piece.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        length : (...,), m
        """
        progress = np.asarray(progress, float)
        edges = self.curve.edges
        whole = np.concatenate([[0.0], np.cumsum(self._lengths(edges[:-1], edges[1:]))])
        i = self.curve.piece(progress)[0]
        return whole[i] + self._lengths(edges[i], progress)

    def half_turns(self) -> tuple[tuple[int, Reals], ...]:
        """Turns by exactly 180 deg, whose sense had to be chosen.

        Returns
        -------
        turns : number of the segment (from 1), and the axis taken, a unit vector (3,) in the base frame
        """
        return self.turns

    def _lengths(self, start: Reals, end: Reals) -> Reals:
        """Length of the tool point's path (...,) between shares (...,) of the path, both on one piece."""
        half = (end - start) / 2
        at = start[..., None] + half[..., None] * (1 + GAUSS_POINTS)
        speeds: Reals = np.linalg.norm(self._values(at)[1][..., :3], axis=-1)
        lengths: Reals = (speeds * GAUSS_WEIGHTS).sum(axis=-1) * half
        return lengths

    def _values(self, progress: Reals) -> tuple[Reals, Reals, Reals]:
        """Position and rotation vector (..., 6) with derivatives by progress."""
        x, dx, ddx = self.curve(progress)
        i, u = self.curve.piece(progress)
        for k, arc in ((k, arc) for k, arc in enumerate(self.arcs) if arc is not None):
            here = i == k
            start, end = self.arc_shares[k]
            rate = (end - start) / (self.curve.edges[k + 1] - self.curve.edges[k])
            share = start + (end - start) * u[here]
            first, second = arc.twists(share)
            x[here, :3] = arc.points(share)
            dx[here, :3], ddx[here, :3] = rate * first[..., :3], rate**2 * second[..., :3]
        return x, dx, ddx


@by_identity
class JointSequence:
    """Straight sides in joint space, their corners rounded or stopped at; all joints together.

    Attributes
    ----------
    duration : s
    law : when the arm is where
    curve : joint angles (k = 6), rad, over the share of the path
    misses : (k,), rad, by how much each joint passes the points of rounded corners at most
    """

    duration: float
    law: TimeLaw
    curve: Curve
    misses: Reals

    def joints(self, t: Reals) -> Rates:
        """Angles, velocities and accelerations at times.

        Parameters
        ----------
        t : (...,), s, from 0 to ``duration``

        Returns
        -------
        q, velocity, acceleration : (..., 6), rad, rad/s and rad/s^2
        """
        progress, speed, acceleration = self.law(t)
        q, dq, ddq = self.curve(progress)
        speed, acceleration = speed[..., None], acceleration[..., None]
        return q, dq * speed, ddq * speed**2 + dq * acceleration

    def polynomials(self) -> PiecewiseMotion:
        """The sequence as polynomials in time, one for each piece of the curve within each piece of the law.

        Returns
        -------
        motion : rad and s
        """
        breaks = np.unique(np.concatenate([self.law.breaks, times_at(self.law, self.curve.edges[1:-1])]))
        return polynomial_motion(self.joints, breaks, self.law.degree * (POWERS - 1))


@by_identity
class _Leg:
    """A straight way of the joints: from ``start`` (n,) by ``step`` (n,), rad."""

    start: Reals
    step: Reals
    rotation: ClassVar[Reals] = np.zeros(0)

    def points(self, progress: Reals) -> Reals:
        return self.start + np.asarray(progress)[..., None] * self.step

    def twists(self, progress: Reals) -> tuple[Reals, Reals]:
        return self.step, np.zeros_like(self.step)


@by_identity
class _Piece:
    """A piece of a sequence: of a part between shares of it, or the rounded corner where a part begins.

    Attributes
    ----------
    part : number of the part in whose frame it is written
    span : its length; shares : of the part; None of a corner
    """

    part: int
    span: float
    coefficients: Reals
    shares: tuple[float, float] | None = None


def _pieces(parts: Many[Segment | _Leg], sizes: Reals, blends: Reals) -> tuple[list[_Piece], Reals, Flags]:
    """Parts with rounded corners.

    Returns
    -------
    pieces : one after another
    off : (m, k), by how much the middle of each rounded corner misses it, after a row of 0
    runs_on : (n - 1,), where the next part goes on as the one before ends, so that a sharp corner is none
    """
    starts, ends = np.append(0.0, blends) / sizes, 1 - np.append(blends, 0.0) / sizes
    pieces: list[_Piece] = []
    off, runs_on = [0.0 * _near_corner(parts[0], 0.0, 1.0, 0.0)[0]], []
    for k, part in enumerate(parts):
        u = np.array([starts[k], ends[k]])
        if u[1] - u[0] > RUNS_ON:
            both = np.hstack([part.points(u), u[:, None] * part.rotation])
            pieces.append(_Piece(k, (u[1] - u[0]) * sizes[k], straight(*both), (u[0], u[1])))
        if k + 1 == len(parts):
            break
        onward, span = parts[k + 1], 2 * blends[k]
        if span > 0:
            before = _near_corner(part, ends[k], sizes[k], -1 + ends[k])
            after = _near_corner(onward, starts[k + 1], sizes[k + 1], starts[k + 1])
            pieces.append(_Piece(k + 1, span, joining(before, after, span)))
            middle = 0.5 ** np.arange(POWERS) @ pieces[-1].coefficients
            off.append(middle - _near_corner(onward, 0.0, 1.0, 0.0)[0])
            runs_on.append(False)
        else:
            ending = _near_corner(part, 1.0, sizes[k], 0.0)[1]
            beginning = _near_corner(onward, 0.0, sizes[k + 1], 0.0)[1]
            runs_on.append(np.linalg.norm(ending - beginning) < RUNS_ON * np.linalg.norm(ending))
    return pieces, np.array(off), np.array(runs_on, bool)


def segment_path(
    segments: Many[Segment], blends: Reals, timing: float | Times | LegTimes, ramp: float | None = None
) -> SegmentPath:
    """Put lines and arcs together to one path, with rounded corners or stops between them.

    Parameters
    ----------
    segments : n, each starting where the one before ends, none of length 0; their durations are ignored
    blends : (n - 1,), m, over which length on either side each corner is rounded; 0 for a corner to stop at
    timing : s, divided between halts by path length; or the times of the corners; or those of the legs
    ramp : share of the time of each ramp of a trapezoid between halts; None for the quintic

    Returns
    -------
    path : in m, rad and s

    Raises
    ------
    PathError
        for a segment of length 0, or a rounding longer than half of a side
    """
    sizes = np.array([max(part.length, part.turned * TURN_LENGTH) for part in segments])
    _check(sizes, blends, 1000.0, "mm")
    pieces, off, runs_on = _pieces(segments, sizes, blends)
    law, duration = _timed(sizes, np.asarray(blends) == 0, runs_on, timing, ramp)
    whose = [(segments[piece.part], piece.shares) for piece in pieces]
    return SegmentPath(
        duration=duration,
        law=law,
        curve=_curve(pieces),
        origins=np.array([part.T_start[:3, :3] for part, _ in whose]),
        arcs=tuple(part if isinstance(part, Arc) and shares else None for part, shares in whose),
        arc_shares=np.array([shares or (0.0, 1.0) for _, shares in whose]),
        turned=float(sum(part.turned for part in segments)),
        turns=tuple((k + 1, axis) for k, part in enumerate(segments) for _, axis in part.half_turns()),
        misses=np.array([np.linalg.norm(each, axis=1).max() for each in (off[:, :3], off[:, 3:])]),
    )


def joint_sequence(
    points: Reals, blends: Reals, timing: float | Times | LegTimes, ramp: float | None = None
) -> JointSequence:
    """The path through joint angles, with rounded corners.

    Parameters
    ----------
    points : (n, 6), rad
    blends : (n - 2,), rad of the joint that turns most, over which each corner is rounded on either side; 0 stops there
    timing : s, divided between halts by joint travel; or the times of the corners; or those of the legs
    ramp : share of the time of each ramp of a trapezoid between halts; None for the quintic

    Returns
    -------
    sequence : in rad and s

    Raises
    ------
    PathError
        for two equal points, or a rounding longer than half of a side
    """
    steps = np.diff(points, axis=0)
    sizes = np.abs(steps).max(axis=1)
    _check(sizes, blends, np.degrees(1.0), "deg")
    pieces, off, runs_on = _pieces([_Leg(*leg) for leg in zip(points, steps)], sizes, blends)
    law, duration = _timed(sizes, np.asarray(blends) == 0, runs_on, timing, ramp)
    return JointSequence(duration, law, _curve(pieces), np.abs(off).max(axis=0))


def _check(sizes: Reals, blends: Reals, unit: float, name: str) -> None:
    for k, size in enumerate(sizes):
        if not size > ZERO_LENGTH:
            raise PathError(k + 1, "has no way: it ends where it starts")
    for k, blend in enumerate(blends):
        most = min(sizes[k], sizes[k + 1]) / 2
        if blend > most * (1 + RUNS_ON):
            problem = f"its corner can't be rounded over {blend * unit:g} {name}: half of the shorter side is "
            raise PathError(k + 1, problem + f"{most * unit:.4g} {name}")


def _near_corner(part: Segment | _Leg, share: float, size: float, turn: float) -> tuple[Reals, Reals, Reals]:
    """Position and rotation vector of a part near a corner, with derivatives by its path length."""
    first, second = part.twists(np.array(share))
    value = np.concatenate([part.points(np.array(share)), turn * part.rotation])
    return value, first / size, second / size**2


def _curve(pieces: Many[_Piece]) -> Curve:
    edges = np.concatenate([[0.0], np.cumsum([piece.span for piece in pieces])])
    edges /= edges[-1]
    edges[-1] = 1.0
    return Curve(edges, np.array([piece.coefficients for piece in pieces]))


def _timed(
    sizes: Reals, sharp: Flags, runs_on: Flags, timing: float | Times | LegTimes, ramp: float | None
) -> tuple[TimeLaw, float]:
    """The law of time, and the duration."""
    corners = np.concatenate([[0.0], np.cumsum(sizes)]) / sizes.sum()
    corners[-1] = 1.0
    if isinstance(timing, LegTimes):
        times = np.append(0.0, np.cumsum(timing.times))
        return FromRestToRest(times, corners, timing.ramps), float(times[-1])
    halt = np.concatenate([[True], sharp & ~runs_on, [True]])
    if isinstance(timing, Times):
        return Timetable(timing.times, corners[timing.corner], halt[timing.corner]), float(timing.times[-1])
    return FromRestToRest(timing * corners[halt], corners[halt], ramp), float(timing)
