"""How many of the poses that a tool reaches in a cell can be held with nothing touched: tried at random, not proven.

A pose counts as reached if an arm within the limits is found, and as clear if one of its arms touches neither the
surroundings nor itself. An arm that does is proof for its pose; a share of few tries is an estimate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.robots.robot import Robot
from er3a.workspace.cell_frame import cell_frame
from er3a.workspace.directions import across, poses
from er3a.workspace.orientations import AskedOrientations
from er3a.workspace.tool_inverse import all_solutions

Free = Callable[[Reals], Flags]
"""Which arms (N, n), rad, are free of collisions, (N,)."""
_POSES = 50_000


@dataclass(frozen=True, eq=False)
class ClearPoses:
    """What came of the poses tried in cells: of ``tries`` in each, how many were reached and clear, both (n,)."""

    tries: int
    reached: Integers
    clear: Integers


def try_poses(
    robot: Robot,
    middles: Reals,
    places: tuple[Reals, float],
    tries: int,
    free: Free,
    random: np.random.Generator,
    *,
    asked: AskedOrientations,
) -> ClearPoses:
    """Try poses with the tool point on the circles (or bars) of cells' middles, orientations uniform over all.

    Parameters
    ----------
    middles : (n, 2), m, radius and height about axis 1; places : their sectors' middles (n,) and width, rad or m
    tries : poses in each; free : which arms count as clear
    asked : what is asked of the tool; where that is no direction, the orientations are even among these
    """
    frame = cell_frame(robot)
    reached, clear = (np.zeros(len(middles), np.int64) for _ in range(2))
    for start in range(0, len(middles), step := max(1, _POSES // tries)):
        part = slice(start, start + step)
        rho, z = middles[part, 0, None], middles[part, 1, None]
        at = places[0][part, None] + places[1] * (random.random((len(rho), tries)) - 0.5)
        points = frame.points(rho, at, z)
        if asked.kind == "directions":
            rotations = _orientations(random, at.shape)
        else:
            rotations = asked.at_random(points.reshape(-1, 3), random).reshape(*at.shape, 3, 3)
        q, inside = all_solutions(robot, poses(points, rotations).reshape(-1, 4, 4))
        held = np.zeros(at.size, bool)
        for slot, within in enumerate(inside.T):  # arms of one branch after another are alike
            pose = np.flatnonzero(within & ~held)
            held[pose] = free(q[pose, slot])
        reached[part] = inside.any(axis=1).reshape(at.shape).sum(axis=1)
        clear[part] = held.reshape(at.shape).sum(axis=1)
    return ClearPoses(tries, reached, clear)


def _orientations(random: np.random.Generator, shape: tuple[int, ...]) -> Reals:
    """Uniform over all orientations (..., 3, 3): a direction, and a roll about it."""
    count = int(np.prod(shape))
    z = random.normal(size=(count, 3))
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    x, y = across(z)
    roll = 2 * np.pi * random.random((count, 1))
    c, s = np.cos(roll), np.sin(roll)
    return np.stack([c * x + s * y, c * y - s * x, z], axis=-1).reshape(*shape, 3, 3)
