"""Poses near one that has no solution within the limits: by how little must the tool turn or shift to have one?"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import scipy

from er3a.by_value import by_identity
from er3a.geometry.transforms import exp_rotation, rotation_angle, rpy_of, transform
from er3a.kinematics.batch import inverse_batch
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.joint_limits import size_of
from er3a.robots.robot import Robot

ORIENTATIONS = 2000  # a ratio of these is known to 1 %
TURN_GRID, SHIFT_GRID = 41, 25  # changes across at first: 9 deg, and a twelfth of the arm's reach
FINE_GRID, REFINEMENTS = 5, 10  # changes across when refined, each time to a half, and how often

SPARE_TURNS, SPARE_SHIFTS = np.radians([1.0, 2.0, 5.0, 10.0]), np.array([5.0, 10.0, 20.0, 50.0]) / 1000
"""Margins beyond the smallest turn (rad) or shift (m) for an advised one; the first usable margin is taken."""
SHOWN_ANGLE, SHOWN_LENGTH = np.radians(0.01), 1e-4
"""Rounding of advised poses."""
CHUNKS = 64 * (2 ** np.arange(1, 13) - 1)  # of changes that are tried, until one is usable: twice as many each time

Usable = Callable[[Reals], Flags]
"""Which arms (N, n), rad, within the limits count, (N,)."""


@by_identity
class Neighbours:
    """Poses near a refused one that have a solution within the limits.

    The smallest turn is searched over a grid of all turns, for advice only if one of the orientations that are tried is
    usable; the smallest shift over one that spans the arm. Both grids are refined around their best point, so both are
    upper bounds.

    Attributes
    ----------
    orientation_ratio : part of 2000 random tool orientations that have a solution at the target's position
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


def neighbours(robot: Robot, T: Reals, usable: Usable) -> Neighbours:
    """Search poses near a refused one that have a solution within the limits.

    Parameters
    ----------
    T : (4, 4), m
    usable : which arms count. The poses are beyond the smallest usable turn or shift by one of ``SPARE_TURNS`` or
        ``SPARE_SHIFTS`` or up to a cell of the first grid, and usable after rounding for display

    Returns
    -------
    found : rad and m; the turn and the shift are upper bounds of the smallest ones
    """

    def turned(turns: Reals) -> Reals:
        """Poses (N, 4, 4) turned by rotation vectors (N, 3)."""
        return _turned(T, exp_rotation(turns))

    def shifted(shifts: Reals) -> Reals:
        """Poses (N, 4, 4) shifted by vectors (N, 3), m."""
        poses = np.tile(T, (len(shifts), 1, 1))
        poses[:, :3, 3] += shifts
        return poses

    half = size_of(robot) + float(np.linalg.norm(robot.last_to_tool[:3, 3]))
    spread = _turned(T, _orientations())
    solved = solvable(robot, spread)
    turns = _first(robot, spread[solved], usable) is not None
    turn = _least(robot, turned, (np.zeros(3), np.pi, TURN_GRID), usable, SPARE_TURNS) if turns else None
    shift = _least(robot, shifted, (robot.base[:3, 3] - T[:3, 3], half, SHIFT_GRID), usable, SPARE_SHIFTS)
    return Neighbours(
        orientation_ratio=float(solved.mean()),
        least_turn=None if turn is None else float(rotation_angle(T[:3, :3], turn[:3, :3])),
        turned_to=None if turn is None else rpy_of(turn),
        least_shift=None if shift is None else float(np.linalg.norm(shift[:3, 3] - T[:3, 3])),
        shifted_to=None if shift is None else shift[:3, 3],
    )


@cache
def _orientations() -> Reals:
    """Random rotations (ORIENTATIONS, 3, 3), the same for all poses."""
    return np.asarray(scipy.spatial.transform.Rotation.random(ORIENTATIONS, rng=np.random.default_rng(0)).as_matrix())


def _turned(T: Reals, turns: Reals) -> Reals:
    """Poses (N, 4, 4): a pose (4, 4) turned about its place by rotations (N, 3, 3)."""
    poses = np.tile(T, (len(turns), 1, 1))
    poses[:, :3, :3] = turns @ T[:3, :3]
    return poses


def _first(robot: Robot, changes: Reals, usable: Usable, made: Callable[[Reals], Reals] = np.asarray) -> int | None:
    """The first of changes (N, ...) whose pose has a usable solution; None if none has."""
    for start, end in zip((0, *CHUNKS), CHUNKS):
        solved = np.flatnonzero(solvable(robot, made(changes[start:end]), usable))
        if len(solved):
            return int(start + solved[0])
    return None


def _least(
    robot: Robot,
    made: Callable[[Reals], Reals],
    grid: tuple[Reals, float, int],
    usable: Usable,
    spare: Reals,
) -> Reals | None:
    """The pose (4, 4) made by the smallest change with a usable solution; None if none is found.

    ``grid``: centre (3,), half width and changes across of those that are tried first, rad or m. The pose is
    the first usable one made by a change that is larger by one of ``spare`` (k,), or by the first one found, rounded.
    """
    centre, half, count = grid
    found: list[Reals] = []
    for _ in range(1 + REFINEMENTS):
        ticks = np.linspace(-half, half, count)
        changes = centre + ticks[np.indices((count, count, count)).reshape(3, -1).T]
        size = np.linalg.norm(changes, axis=1)
        # Known to 1/65535 of the largest: integers of 16 bits are sorted at once.
        changes = changes[(size * (65535 / size.max())).astype(np.uint16).argsort(kind="stable")]
        best = _first(robot, changes, usable, made)
        if best is None:
            return None
        found.append(changes[best])
        centre, half, count = found[-1], ticks[1] - ticks[0], FINE_GRID
    spared = centre * (1 + spare[:, None] / np.linalg.norm(centre))
    poses = made(np.vstack([spared, found[0]]))
    places, turns = (
        np.round(x / unit) * unit for x, unit in ((poses[:, :3, 3], SHOWN_LENGTH), (rpy_of(poses), SHOWN_ANGLE))
    )
    poses = transform(places, turns)
    kept = np.flatnonzero(solvable(robot, poses, usable))
    return np.asarray(poses[kept[0]]) if len(kept) else None
