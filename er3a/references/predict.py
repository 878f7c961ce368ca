"""What a model says about each reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from er3a.kinematics.chain import row_values
from er3a.kinematics.forward import frames
from er3a.kinematics.table_batch import Tables, frames_of
from er3a.numerics.arrays import Reals
from er3a.references.quantities import ZERO_POSE, AxisLines, Extreme, ModelState, Pose, Quantity
from er3a.references.reach import search
from er3a.references.reference import Reference, quantities_of
from er3a.robots.robot import Robot
from er3a.robots.shown import meant

REACH_STARTS = 32
CHUNK = 2048
TABLE_COLUMNS = ("a", "alpha", "d", "offset")


def predict(robot: Robot, references: Sequence[Reference], starts: int = REACH_STARTS) -> Reals:
    """The model's value for each reference.

    Parameters
    ----------
    starts : local searches for each reference about an extreme

    Returns
    -------
    values : (n,), aligned with ``expected``, ``uncertainty`` and ``unit`` of the references; NaN where the robot's file
        says nothing (speeds)
    """
    quantities = quantities_of(references)
    return read(quantities, state_of(robot, quantities, starts))


def read(quantities: Sequence[Quantity], state: ModelState) -> Reals:
    """Values (..., n) of quantities in a state that may hold a batch of models."""
    if not quantities:
        return np.empty((*state.lower.shape[:-1], 0))
    return np.stack([quantity.value(state) for quantity in quantities], axis=-1)


def state_of(
    robot: Robot,
    quantities: Sequence[Quantity],
    starts: int = REACH_STARTS,
    extremes: Mapping[Quantity, float] | None = None,
    axes: AxisLines | None = None,
) -> ModelState:
    """One model's state, with the extremes searched for unless given. The robot's tool does not count."""
    robot = robot.without_tool()
    poses = _poses_of(quantities)
    if extremes is None:
        wanted = dict.fromkeys(quantity for quantity in quantities if isinstance(quantity, Extreme))
        extremes = {quantity: search(robot, quantity, starts)[0] for quantity in wanted}
    return ModelState(
        frames=frames(robot, joints_of(robot, poses)),
        index=_places(poses),
        direction=robot.direction,
        lower=robot.lower,
        upper=robot.upper,
        speed=robot.speed,
        extremes=extremes,
        axes=axes,
        columns={name: getattr(robot, name) for name in TABLE_COLUMNS}
        | {"twist": robot.alpha[1:] if robot.convention == "modified" else robot.alpha[:-1]},
    )


def predict_tables(tables: Tables, robot: Robot, quantities: Sequence[Quantity]) -> Reals:
    """What each of many tables says about quantities, none of which may be an extreme over the limits.

    Parameters
    ----------
    robot : for the base, and the speeds

    Returns
    -------
    values : (H, n), in the quantities' units
    """
    values = np.empty((len(tables), len(quantities)))
    for start in range(0, len(tables), CHUNK):
        part = slice(start, start + CHUNK)
        values[part] = read(quantities, state_of_tables(tables[part], robot, quantities))
    return values


def state_of_tables(tables: Tables, robot: Robot, quantities: Sequence[Quantity]) -> ModelState:
    """The state of many tables, for quantities none of which is an extreme over the limits."""
    return TablesState(robot, quantities).of(tables)


class TablesState:
    """States of tables of one arm at the poses at which quantities look at it; ``index``: places of the poses."""

    def __init__(self, robot: Robot, quantities: Sequence[Quantity]):
        poses = _poses_of(quantities)
        self.robot, self.index = robot, _places(poses)
        self._rows = row_values(robot, joints_of(robot, poses))

    def of(self, tables: Tables) -> ModelState:
        """The state of many tables."""
        return ModelState(
            frames=frames_of(tables, self.robot, self._rows),
            index=self.index,
            direction=tables.direction,
            lower=tables.lower,
            upper=tables.upper,
            speed=self.robot.speed,
            extremes={},
            columns={name: getattr(tables, name) for name in TABLE_COLUMNS}
            | {"twist": np.where(tables.modified[:, None], tables.alpha[:, 1:], tables.alpha[:, :-1])},
        )


def joints_of(robot: Robot, poses: Sequence[Pose]) -> Reals:
    """Poses as they are written (six values) as joint values (P, n) in rad or m; further joints are at 0."""
    written = np.array(poses, float).reshape(-1, len(ZERO_POSE))
    q = np.zeros((len(written), robot.joints))
    count = min(robot.joints, written.shape[1])
    q[:, :count] = written[:, :count]
    return meant(robot, q)


def _poses_of(quantities: Sequence[Quantity]) -> tuple[Pose, ...]:
    """The poses at which quantities look at the arm, in deg; the zero pose first."""
    return tuple(dict.fromkeys([ZERO_POSE, *(quantity.seen_at for quantity in quantities)]))


def _places(poses: Sequence[Pose]) -> dict[Pose, int]:
    return {pose: place for place, pose in enumerate(poses)}
