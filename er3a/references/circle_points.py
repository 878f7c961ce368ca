"""Circle point analysis: turn one joint at a time, and find its axis from the circle that a carried point runs on.

This is how a real arm's axes are measured with a tracker [1]_; here the model goes through the same procedure, so that
its motion, not its table, is compared with the manufacturer's axis lines.

References
----------
.. [1] B. W. Mooring, Z. S. Roth, M. R. Driels, *Fundamentals of Manipulator Calibration*, Wiley 1991, section 5.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from er3a.kinematics.forward import forward, frames
from er3a.numerics.arrays import Reals
from er3a.references.quantities import MM, AxisLines
from er3a.robots.robot import Robot

OFF_EVERY_AXIS_MM = 100.0  # a smaller circle determines its axis less well
TRIED_OFFSETS_MM = (200.0, 400.0, 800.0, 1600.0)
STATIONS = 25  # positions of each joint; the fits are exact for any number of at least 3, as nothing is noisy
MIN_TURN, MAX_TURN = np.pi / 2, 2 * np.pi  # rad: a shorter arc determines its centre less well
MIN_SLIDE = 0.1  # m


@dataclass(frozen=True, eq=False)
class CirclePoints:
    """Axes found from circles.

    Attributes
    ----------
    axes : direction of positive rotation and the circle's centre, per joint
    radius_mm : (n,), of the circles; 0 of prismatic joints, whose track is a line
    roundness_mm : (n,), largest distance of a track's point from its circle, or line
    offset_mm : (3,), the carried point in the flange's frame
    """

    axes: AxisLines
    radius_mm: Reals
    roundness_mm: Reals
    offset_mm: Reals


def circle_points(robot: Robot) -> CirclePoints:
    """Find the axes of a robot from the tracks of a carried point, one joint at a time [1]_.

    Each joint turns through its limits (a quarter turn at least, a full one at most), the others are at 0.

    Parameters
    ----------
    robot : its tool does not count

    Returns
    -------
    points : axes (unit vectors, mm) in the base frame, with radius and roundness (mm) of each circle
    """
    offset = carried_point(robot)
    tracks = [_track(robot, joint, offset) for joint in range(robot.joints)]
    fits = [fit_line(track) if slides else fit_circle(track) for track, slides in zip(tracks, robot.slides)]
    direction, centre, radius, roundness = (np.array(part) for part in zip(*fits))
    return CirclePoints(AxisLines(direction, centre), radius, roundness, offset)


def carried_point(robot: Robot) -> Reals:
    """A point on the flange that runs on a wide circle, whichever joint turns.

    Parameters
    ----------
    robot : in its zero pose

    Returns
    -------
    offset_mm : (3,), mm, in the flange's frame, at least 100 mm off every axis in the zero pose

    Notes
    -----
    Of 26 directions and the lengths ``TRIED_OFFSETS_MM``, the shortest length that suffices is taken, and of its
    directions the one farthest from the nearest axis.
    """
    T = frames(robot.without_tool(), np.zeros(robot.joints))
    toward = np.array([each for each in product((-1.0, 0.0, 1.0), repeat=3) if any(each)])
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    offsets = np.concatenate([toward * length for length in TRIED_OFFSETS_MM])
    points = T[-1, :3, 3] + (offsets / MM) @ T[-1, :3, :3].T
    across = np.cross(T[:-1, None, :3, 2], points - T[:-1, None, :3, 3])
    smallest = np.linalg.norm(across, axis=-1).min(axis=0) * MM
    by_length = smallest.reshape(len(TRIED_OFFSETS_MM), -1)
    length = int(np.argmax(by_length.max(axis=1) >= OFF_EVERY_AXIS_MM))
    chosen: Reals = offsets[length * len(toward) + int(np.argmax(by_length[length]))]
    return chosen


def fit_circle(track: Reals) -> tuple[Reals, Reals, float, float]:
    """Fit a circle to a track: plane by singular values, then centre and radius by linear least squares (Kasa 1976).

    Parameters
    ----------
    track : (N, 3), points in order, in any unit of length

    Returns
    -------
    normal : (3,), unit vector about which the points run right-handed
    centre : (3,), in the track's unit
    radius, roundness : radius, and the largest distance of a point from the circle
    """
    middle = track.mean(axis=0)
    basis = np.linalg.svd(track - middle)[2]
    normal = basis[2]
    x, y = ((track - middle) @ basis[:2].T).T
    system = np.column_stack([2 * x, 2 * y, np.ones_like(x)])
    (cx, cy, rest), *_ = np.linalg.lstsq(system, x**2 + y**2, rcond=None)
    centre = middle + np.array([cx, cy]) @ basis[:2]
    radius = float(np.sqrt(rest + cx**2 + cy**2))
    spokes = track - centre
    # Singular vectors have no sign: the sum of the areas swept from the centre gives it.
    if np.einsum("ij,j->i", np.cross(spokes[:-1], spokes[1:]), normal).sum() < 0:
        normal = -normal
    height = spokes @ normal
    across = np.linalg.norm(spokes - height[:, None] * normal, axis=1)
    return normal, centre, radius, float(np.hypot(height, across - radius).max())


def fit_line(track: Reals) -> tuple[Reals, Reals, float, float]:
    """Fit a line to the track of a prismatic joint, by singular values.

    Parameters
    ----------
    track : (N, 3), points in order, in any unit of length

    Returns
    -------
    direction : (3,), unit vector from the first point to the last
    middle : (3,), mean of the points
    radius : 0, as a line has none
    straightness : largest distance of a point from the line, in the track's unit
    """
    middle = track.mean(axis=0)
    direction = np.linalg.svd(track - middle)[2][0]
    direction = -direction if (track[-1] - track[0]) @ direction < 0 else direction
    off = track - middle - ((track - middle) @ direction)[:, None] * direction
    return direction, middle, 0.0, float(np.linalg.norm(off, axis=1).max())


def _track(robot: Robot, joint: int, offset_mm: Reals) -> Reals:
    """The carried point's positions (N, 3) in mm while one joint turns from its lower to its upper limit."""
    lower, upper = sorted((robot.lower[joint], robot.upper[joint]))
    middle, turn = (lower + upper) / 2, np.clip(upper - lower, MIN_TURN, MAX_TURN)
    if robot.slides[joint]:
        turn = max(upper - lower, MIN_SLIDE)
    q = np.zeros((STATIONS, robot.joints))
    q[:, joint] = middle + np.linspace(-turn / 2, turn / 2, STATIONS)
    T = forward(robot.without_tool(), q)
    return T[:, :3, 3] * MM + T[:, :3, :3] @ offset_mm
