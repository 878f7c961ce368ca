"""What a model says about each reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from er3a.kinematics.forward import frames
from er3a.references.extremes import search
from er3a.references.quantities import ZERO_POSE, Extreme, ModelState, Pose, Quantity
from er3a.references.reference import Reference
from er3a.robots.robot import Robot

REACH_STARTS = 32


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
) -> ModelState:
    """One model's state, with the extremes searched for unless given."""
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
    )
