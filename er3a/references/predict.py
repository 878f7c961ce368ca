"""What a model says about each reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from er3a.kinematics.forward import frames
from er3a.kinematics.table_batch import Tables, frames_of
from er3a.references.quantities import ZERO_POSE, AxisLines, Extreme, ModelState, Pose, Quantity
from er3a.references.reach import search
from er3a.references.reference import Reference
from er3a.robots.robot import Robot

REACH_STARTS = 32
CHUNK = 2048


def predict(robot: Robot, references: Sequence[Reference], starts: int = REACH_STARTS) -> np.ndarray:
    """The model's value for each reference.

    Parameters
    ----------
    starts : local searches for each reference about an extreme

    Returns
    -------
    values : (n,), aligned with ``expected``, ``uncertainty`` and ``unit`` of the references; NaN where the robot's file
        says nothing (speeds)
    """
    return read(references, state_of(robot, references, starts))


def read(references: Sequence[Reference], state: ModelState) -> np.ndarray:
    """Values (..., n) of the references in a state that may hold a batch of models."""
    if not references:
        return np.empty((*state.lower.shape[:-1], 0))
    return np.stack([reference.quantity.value(state) for reference in references], axis=-1)


def poses_of(references: Sequence[Reference]) -> tuple[Pose, ...]:
    """The poses at which the references look at the arm, in deg; the zero pose first."""
    return tuple(dict.fromkeys([ZERO_POSE, *(reference.quantity.seen_at for reference in references)]))


def state_of(
    robot: Robot,
    references: Sequence[Reference],
    starts: int = REACH_STARTS,
    extremes: Mapping[Quantity, float] | None = None,
    axes: AxisLines | None = None,
) -> ModelState:
    """One model's state, with the extremes searched for unless given. The robot's tool does not count."""
    robot = robot.without_tool()
    poses = poses_of(references)
    if extremes is None:
        wanted = dict.fromkeys(r.quantity for r in references if isinstance(r.quantity, Extreme))
        extremes = {quantity: search(robot, quantity, starts)[0] for quantity in wanted}
    return ModelState(
        frames=frames(robot, np.radians(poses)),
        index={pose: i for i, pose in enumerate(poses)},
        direction=robot.direction,
        lower=robot.lower,
        upper=robot.upper,
        speed=robot.speed,
        extremes=extremes,
        axes=axes,
    )


def predict_tables(tables: Tables, robot: Robot, references: Sequence[Reference]) -> np.ndarray:
    """What each of many tables says about references, none of which may be about an extreme over the limits.

    Parameters
    ----------
    robot : for the base, and the speeds

    Returns
    -------
    values : (H, n), in the references' units
    """
    poses = poses_of(references)
    values = np.empty((len(tables), len(references)))
    for start in range(0, len(tables), CHUNK):
        part = tables[start : start + CHUNK]
        state = ModelState(
            frames=frames_of(part, robot.base, np.radians(poses)),
            index={pose: i for i, pose in enumerate(poses)},
            direction=part.direction,
            lower=part.lower,
            upper=part.upper,
            speed=robot.speed,
            extremes={},
        )
        values[start : start + CHUNK] = read(references, state)
    return values
