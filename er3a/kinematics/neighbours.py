"""Poses near one that has no solution within the limits: by how little must the tool turn or shift to have one?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from er3a.geometry.vectors import fibonacci_sphere
from er3a.kinematics.batch import inverse_batch
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot

DIRECTIONS = 400
TURN_STEPS = 90
HALVINGS = 12
RANDOM_ORIENTATIONS = 4000
COARSE_GRID, FINE_GRID, REFINEMENTS = 25, 9, 5


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Poses near a refused one that have a solution within the limits.

    The least turn is searched about ``DIRECTIONS`` evenly spread axes, the least shift over a grid that spans the arm
    and is refined around its best point, so both are upper bounds.

    Attributes
    ----------
    orientation_ratio : part of 4000 random tool orientations at the target's position that have a solution
    least_turn : rad, least rotation of the tool found that has one, position kept; None if none has
    least_shift : m, least shift of the tool found that has one, orientation kept; None if none has
    shifted_to : (3,), m, where that shift ends; None if none has
    """

    orientation_ratio: float
    least_turn: float | None
    least_shift: float | None
    shifted_to: Reals | None


def solvable(robot: Robot, T: Reals) -> Flags:
    """Whether poses (N, 4, 4) have a solution within the limits, (N,)."""
    found: Flags = np.any(inverse_batch(robot, T).within_limits, axis=1)
    return found


def neighbours(robot: Robot, T: Reals, random: np.random.Generator) -> Neighbours:
    """Search around a pose (4, 4) of the tool."""
    turned = np.tile(T, (RANDOM_ORIENTATIONS, 1, 1))
    turned[:, :3, :3] = scipy.spatial.transform.Rotation.random(RANDOM_ORIENTATIONS, rng=random).as_matrix()
    shifted_to = _nearest_position(robot, T)
    return Neighbours(
        orientation_ratio=float(solvable(robot, turned).mean()),
        least_turn=_least_turn(robot, T),
        least_shift=None if shifted_to is None else float(np.linalg.norm(shifted_to - T[:3, 3])),
        shifted_to=shifted_to,
    )


def _least_turn(robot: Robot, T: Reals) -> float | None:
    axes, angles = fibonacci_sphere(DIRECTIONS, turned_back=True), np.linspace(0, np.pi, TURN_STEPS + 1)[1:]

    def turned_ok(about: Reals, by: Reals) -> Flags:
        poses = np.tile(T, (len(about), 1, 1))
        poses[:, :3, :3] = scipy.spatial.transform.Rotation.from_rotvec(about * by[:, None]).as_matrix() @ T[:3, :3]
        return solvable(robot, poses)

    found = turned_ok(np.repeat(axes, TURN_STEPS, axis=0), np.tile(angles, DIRECTIONS)).reshape(DIRECTIONS, TURN_STEPS)
    if not found.any():
        return None
    first = np.where(found.any(axis=1), found.argmax(axis=1), TURN_STEPS)
    about = axes[first == first.min()]
    high = np.full(len(about), angles[first.min()])
    low = high - angles[0]
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        ok = turned_ok(about, middle)
        low, high = np.where(ok, low, middle), np.where(ok, middle, high)
    return float(high.min())


def _nearest_position(robot: Robot, T: Reals) -> Reals | None:
    """Position (3,) nearest to that of T which has a solution with its orientation, on a grid refined step by step."""
    half = np.abs(robot.a).sum() + np.abs(robot.d).sum() + np.linalg.norm(robot.last_to_tool[:3, 3])
    centre, count = robot.base[:3, 3], COARSE_GRID
    for _ in range(1 + REFINEMENTS):
        ticks = np.linspace(-half, half, count)
        points = centre + np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
        poses = np.tile(T, (len(points), 1, 1))
        poses[:, :3, 3] = points
        points = points[solvable(robot, poses)]
        if not len(points):
            return None
        centre = points[np.linalg.norm(points - T[:3, 3], axis=1).argmin()]
        half, count = ticks[1] - ticks[0], FINE_GRID
    return centre
