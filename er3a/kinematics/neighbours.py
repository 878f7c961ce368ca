"""Poses near one that has no solution within the limits: by how little must the tool turn or shift to have one?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from er3a.geometry.transforms import rpy_of, transform
from er3a.geometry.vectors import fibonacci_sphere
from er3a.kinematics.batch import inverse_batch
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.joint_limits import size_of
from er3a.robots.robot import Robot

DIRECTIONS = 400  # axes about which the tool is turned: one for each 10 deg
TURN_STEPS = 90  # of half a turn: 2 deg
HALVINGS = 12  # of such a step: to 0.0005 deg
RANDOM_ORIENTATIONS = 4000  # a ratio of these is known to 1 %
COARSE_GRID, FINE_GRID, REFINEMENTS = 25, 9, 5  # points across, at first and when refined, and how often


SPARE_TURNS, SPARE_SHIFTS = np.radians([1.0, 2.0, 5.0, 10.0]), np.array([5.0, 10.0, 20.0, 50.0]) / 1000
"""Margins beyond the smallest turn (rad) or shift (m) for an advised one; the first usable margin is taken."""
SHOWN_ANGLE, SHOWN_LENGTH = np.radians(0.01), 1e-4
"""Rounding of advised poses."""
CHUNK = 512  # points solved at a time, until one is usable

Usable = Callable[[Reals], Flags]
"""Which arms (N, n), rad, within the limits count, (N,)."""


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Poses near a refused one that have a solution within the limits.

    The smallest turn is searched about ``DIRECTIONS`` evenly spread axes, the smallest shift over a grid that spans the
    arm and is refined around its best point, so both are upper bounds.

    Attributes
    ----------
    orientation_ratio : part of 4000 random tool orientations at the target's position that have a solution
    least_turn : rad, smallest rotation of the tool found that has one, position kept; None if none has
    turned_to : (3,), rad, roll, pitch and yaw where that turn ends; None if none has
    least_shift : m, smallest shift of the tool found that has one, orientation kept; None if none has
    shifted_to : (3,), m, where that shift ends; None if none has
    """

    orientation_ratio: float
    least_turn: float | None
    turned_to: Reals | None
    least_shift: float | None
    shifted_to: Reals | None


def solvable(robot: Robot, T: Reals, usable: Usable | None = None) -> Flags:
    """Whether poses have a solution within the limits that is usable.

    Parameters
    ----------
    T : (N, 4, 4), m
    usable : which arms (k, n) count; None: all

    Returns
    -------
    solved : (N,) bool
    """
    found = inverse_batch(robot, T)
    kept = found.within_limits.copy()
    if usable is not None:
        kept[kept] = usable(found.q[kept])
    solved: Flags = np.any(kept, axis=1)
    return solved


def neighbours(robot: Robot, T: Reals, random: np.random.Generator, usable: Usable | None = None) -> Neighbours:
    """Search poses near a refused one that have a solution within the limits.

    Parameters
    ----------
    T : (4, 4), m
    random : draws the orientations for the ratio
    usable : which arms count. If given, the poses are fit for advice: beyond the smallest usable turn or shift by one
        of ``SPARE_TURNS`` or ``SPARE_SHIFTS``, and usable after rounding for display

    Returns
    -------
    found : rad and m; the turn and the shift are upper bounds of the smallest ones
    """
    turned = np.tile(T, (RANDOM_ORIENTATIONS, 1, 1))
    turned[:, :3, :3] = scipy.spatial.transform.Rotation.random(RANDOM_ORIENTATIONS, rng=random).as_matrix()
    turned_to, shifted_to = _least_turn(robot, T, usable), _nearest_position(robot, T, usable)
    if usable is not None:
        turned_to = None if turned_to is None else _turned_on(robot, T, turned_to, usable)
        shifted_to = None if shifted_to is None else _shifted_on(robot, T, shifted_to, usable)
    return Neighbours(
        orientation_ratio=float(solvable(robot, turned).mean()),
        least_turn=None if turned_to is None else float(np.linalg.norm(_turn(T, turned_to))),
        turned_to=None if turned_to is None else rpy_of(turned_to),
        least_shift=None if shifted_to is None else float(np.linalg.norm(shifted_to - T[:3, 3])),
        shifted_to=shifted_to,
    )


def _turn(T: Reals, turned_to: Reals) -> Reals:
    """The rotation vector (3,) from a pose's orientation to another's."""
    R: Reals = turned_to[:3, :3] @ T[:3, :3].T
    return np.asarray(scipy.spatial.transform.Rotation.from_matrix(R).as_rotvec(), float)


def _rotated(T: Reals, turns: Reals) -> Reals:
    """Poses (N, 4, 4) turned by rotation vectors (N, 3)."""
    poses = np.tile(T, (len(turns), 1, 1))
    poses[:, :3, :3] = scipy.spatial.transform.Rotation.from_rotvec(turns).as_matrix() @ T[:3, :3]
    return poses


def _shifted(T: Reals, points: Reals) -> Reals:
    """Poses (N, 4, 4) at other points (N, 3)."""
    poses = np.tile(T, (len(points), 1, 1))
    poses[:, :3, 3] = points
    return poses


def _turned_on(robot: Robot, T: Reals, turned_to: Reals, usable: Usable) -> Reals | None:
    """The pose turned a little further and rounded; None where that is not usable."""
    turn = _turn(T, turned_to)
    angle = float(np.linalg.norm(turn))
    poses = _rotated(T, turn / angle * (angle + SPARE_TURNS)[:, None])
    poses = transform(poses[:, :3, 3], np.round(rpy_of(poses) / SHOWN_ANGLE) * SHOWN_ANGLE)
    kept = np.flatnonzero(solvable(robot, poses, usable))
    return np.asarray(poses[kept[0]]) if len(kept) else None


def _shifted_on(robot: Robot, T: Reals, shifted_to: Reals, usable: Usable) -> Reals | None:
    """The position shifted a little further and rounded; None where that is not usable."""
    shift = shifted_to - T[:3, 3]
    points = shifted_to + shift / np.linalg.norm(shift) * SPARE_SHIFTS[:, None]
    points = np.round(points / SHOWN_LENGTH) * SHOWN_LENGTH
    kept = np.flatnonzero(solvable(robot, _shifted(T, points), usable))
    return np.asarray(points[kept[0]]) if len(kept) else None


def _least_turn(robot: Robot, T: Reals, usable: Usable | None) -> Reals | None:
    """The pose (4, 4) turned by as little as has a usable solution."""
    axes, angles = fibonacci_sphere(DIRECTIONS, turned_back=True), np.linspace(0, np.pi, TURN_STEPS + 1)[1:]
    turns = angles[:, None, None] * axes
    within = solvable(robot, _rotated(T, turns.reshape(-1, 3))).reshape(TURN_STEPS, DIRECTIONS)
    for step in np.flatnonzero(within.any(axis=1)):
        about = axes[within[step]]
        if usable is not None:
            about = about[solvable(robot, _rotated(T, angles[step] * about), usable)]
        if len(about):
            break
    else:
        return None
    high = np.full(len(about), angles[step])
    low = high - angles[0]
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        ok = solvable(robot, _rotated(T, about * middle[:, None]), usable)
        low, high = np.where(ok, low, middle), np.where(ok, middle, high)
    smallest = int(high.argmin())
    return np.asarray(_rotated(T, (about[smallest] * high[smallest])[None])[0])


def _nearest_position(robot: Robot, T: Reals, usable: Usable | None) -> Reals | None:
    """Position (3,) nearest to that of T with a usable solution in its orientation, on a grid refined step by step."""
    half = size_of(robot) + np.linalg.norm(robot.last_to_tool[:3, 3])
    centre, count = robot.base[:3, 3], COARSE_GRID
    for _ in range(1 + REFINEMENTS):
        ticks = np.linspace(-half, half, count)
        points = centre + np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
        points = points[solvable(robot, _shifted(T, points))]
        points = points[np.linalg.norm(points - T[:3, 3], axis=1).argsort(kind="stable")]
        nearest = _first_usable(robot, T, points, usable)
        if nearest is None:
            return None
        centre, half, count = nearest, ticks[1] - ticks[0], FINE_GRID
    return centre


def _first_usable(robot: Robot, T: Reals, points: Reals, usable: Usable | None) -> Reals | None:
    """The first of points (N, 3) with a usable solution; None if there is none."""
    if usable is None:
        return points[0] if len(points) else None
    for start in range(0, len(points), CHUNK):
        part = points[start : start + CHUNK]
        kept = np.flatnonzero(solvable(robot, _shifted(T, part), usable))
        if len(kept):
            return np.asarray(part[kept[0]])
    return None
