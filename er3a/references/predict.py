"""The value of each reference as a model predicts it.

Largest and smallest values over the joint limits are searched for (:mod:`er3a.robots.extremes`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from er3a.kinematics.chain import row_values
from er3a.kinematics.forward import frames
from er3a.kinematics.table_batch import Tables, frames_of
from er3a.numerics.arrays import Reals
from er3a.references.quantities import (
    MM,
    ZERO_POSE,
    Extreme,
    ModelState,
    Pose,
    Quantity,
    QuantityAtPose,
    not_of_arm,
)
from er3a.references.reference import INTERVAL_95, Reference, quantities_of
from er3a.robots.extremes import highest
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

SCAN = 4096  # points of the first look at the box of joint values; one batch of forward kinematics
IDLE = 1e-12  # m, that a joint without influence changes


def search(robot: Robot, quantity: Extreme, starts: int) -> tuple[float, Reals]:
    """Find an extreme of a measure over all joint values within the limits.

    The robot's tool does not count. Joint 1 stays at 0 if it turns: none of the measures changes with it, or the side
    view is drawn there. Limits of sums of joints are kept. A joint without influence on the result is given as 0 (or
    its limit nearest to 0).

    Parameters
    ----------
    quantity : what is to be greatest or least
    starts : number of local searches

    Returns
    -------
    value : mm
    q : (n,), rad or m, where it is attained
    """
    robot = robot.without_tool()
    lower, upper = robot.lower.copy(), robot.upper.copy()
    if not robot.slides[0]:
        lower[0] = upper[0] = 0.0
    sign = 1.0 if quantity.extreme == "greatest" else -1.0

    def size(q: Reals) -> Reals:
        return sign * quantity.measure(frames(robot, q))

    q, value = highest(robot, size, (lower, upper), SCAN, starts)
    rest = np.clip(0.0, lower, upper)
    for joint in range(robot.joints if not robot.combined else 0):
        trial = q.copy()
        trial[joint] = rest[joint]
        if size(trial) >= value - IDLE:
            q = trial
    return float(sign * size(q) * MM), q


REACH_STARTS = 32  # local searches for each extreme
CHUNK = 2048  # tables at a time, so that the frames of many hypotheses fit into memory
TABLE_COLUMNS = ("a", "alpha", "d", "offset")


def predict(robot: Robot, references: Sequence[Reference], starts: int = REACH_STARTS) -> Reals:
    """The model's value for each reference.

    Parameters
    ----------
    robot : the model; its tool does not count
    references : of quantities that the arm has
    starts : local searches for each reference about an extreme

    Returns
    -------
    values : (n,), aligned with ``expected``, ``uncertainty`` and ``unit`` of the references; NaN where the robot's file
        says nothing (speeds)
    """
    quantities = quantities_of(references)
    return read(quantities, state_of(robot, quantities, starts))


def with_rounding(robot: Robot, references: Iterable[Reference]) -> tuple[Reference, ...]:
    """References whose uncertainty includes what the rounding of their joint values leaves open on an arm.

    Parameters
    ----------
    robot : the arm whose table says how much a joint value matters
    references : those without ``rounding`` stay as they are

    Returns
    -------
    references : in the same order, all with ``rounding`` empty

    Notes
    -----
    A value rounded to its last digit may be off by half of it. Each joint's share is the larger change that this makes
    of what the arm's table predicts; half-widths add up, standard deviations (of a uniform distribution: the half-width
    over root 3, GUM 4.3.7) add as squares. A table with a fault is as good for this: what it has wrong, it has wrong in
    the tolerance by the same share.
    """
    return tuple(_widened(robot, reference) if reference.rounding else reference for reference in references)


def _widened(robot: Robot, reference: Reference) -> Reference:
    """A reference with what the rounding of its pose leaves open added to its uncertainty."""
    quantity = reference.quantity
    if not isinstance(quantity, QuantityAtPose) or not_of_arm(quantity, robot):
        return replace(reference, rounding=())
    pose = (*quantity.pose, *[0.0] * robot.joints)[: robot.joints]
    steps = np.diag((*reference.rounding, *[0.0] * robot.joints)[: robot.joints])
    asked = [
        quantity,
        *(replace(quantity, pose=tuple(row)) for row in np.vstack([pose + steps, pose - steps]).tolist()),
    ]
    value, *changed = read(asked, state_of(robot, asked))
    shares = np.abs(np.array(changed) - value).reshape(2, -1).max(axis=0)
    if reference.deviation is None:
        return replace(reference, uncertainty=reference.uncertainty + float(shares.sum()), rounding=())
    deviation = float(np.hypot(reference.deviation, np.linalg.norm(shares) / np.sqrt(3)))
    return replace(reference, uncertainty=INTERVAL_95 * deviation, deviation=deviation, rounding=())


def read(quantities: Sequence[Quantity], state: ModelState) -> Reals:
    """Values of quantities in the state of a model, or of a batch of models.

    Parameters
    ----------
    quantities : n of them
    state : that holds the poses of all of them

    Returns
    -------
    values : (..., n), each in its quantity's unit (mm, deg, deg/s or mm/s)
    """
    if not quantities:
        return np.empty((*state.lower.shape[:-1], 0))
    return np.stack([quantity.value(state) for quantity in quantities], axis=-1)


def state_of(
    robot: Robot,
    quantities: Sequence[Quantity],
    starts: int = REACH_STARTS,
    extremes: Mapping[Quantity, float] | None = None,
) -> ModelState:
    """The state of one model, from which quantities are read.

    Parameters
    ----------
    robot : its tool does not count
    quantities : the poses at which they look at the arm are computed
    starts : local searches for each extreme
    extremes : values (mm) of extremes; None: they are searched for

    Returns
    -------
    state : without batch dimensions
    """
    robot = robot.without_tool()
    poses = _poses_of(quantities)
    if extremes is None:
        wanted = dict.fromkeys(quantity for quantity in quantities if isinstance(quantity, Extreme))
        extremes = {quantity: search(robot, quantity, starts)[0] for quantity in wanted}
    twist = robot.alpha[1:] if robot.convention == "modified" else robot.alpha[:-1]
    return _state(robot, robot, frames(robot, joints_of(robot, poses)), _places(poses), twist, extremes)


def _state(
    robot: Robot,
    table: Robot | Tables,
    frames: Reals,
    index: Mapping[Pose, int],
    twist: Reals,
    extremes: Mapping[Quantity, float],
) -> ModelState:
    """The state of a table, or of many, of an arm that gives what tables don't."""
    return ModelState(
        frames=frames,
        index=index,
        direction=table.direction,
        lower=table.lower,
        upper=table.upper,
        speed=robot.speed,
        extremes=extremes,
        slides=robot.slides,
        sliding=robot.sliding,
        coupling=robot.coupling,
        columns={name: getattr(table, name) for name in TABLE_COLUMNS} | {"twist": twist},
    )


def predict_tables(tables: Tables, robot: Robot, quantities: Sequence[Quantity]) -> Reals:
    """What each of many tables says about quantities, none of which may be an extreme over the limits.

    Parameters
    ----------
    tables : H tables of one arm
    robot : for the base, and the speeds
    quantities : n of them

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
    """The state of many tables, for quantities none of which is an extreme over the limits.

    Parameters
    ----------
    tables : H tables of one arm
    robot : for the base, the speeds, the coupling and the types of the joints
    quantities : the poses at which they look at the arm are computed

    Returns
    -------
    state : with the batch dimension (H,)
    """
    return TablesState(robot, quantities).of(tables)


class TablesState:
    """States of tables of one arm at the poses at which quantities look at it; ``index``: places of the poses."""

    def __init__(self, robot: Robot, quantities: Sequence[Quantity]):
        poses = _poses_of(quantities)
        self.robot, self.index = robot, _places(poses)
        self._rows = row_values(robot, joints_of(robot, poses))

    def of(self, tables: Tables) -> ModelState:
        """The state of many tables of the arm.

        Parameters
        ----------
        tables : H tables, limits and directions included

        Returns
        -------
        state : with the batch dimension (H,)
        """
        twist = np.where(tables.modified[:, None], tables.alpha[:, 1:], tables.alpha[:, :-1])
        return _state(self.robot, tables, frames_of(tables, self.robot, self._rows), self.index, twist, {})


def joints_of(robot: Robot, poses: Sequence[Pose]) -> Reals:
    """Poses as they are written, as joint values.

    Parameters
    ----------
    robot : n joints
    poses : P poses, deg, or mm of joints that slide

    Returns
    -------
    q : (P, n), rad or m; joints that a pose does not name are at 0
    """
    q = np.zeros((len(poses), robot.joints))
    for row, pose in zip(q, poses):
        count = min(robot.joints, len(pose))
        row[:count] = pose[:count]
    return meant(robot, q)


def _poses_of(quantities: Sequence[Quantity]) -> tuple[Pose, ...]:
    """The poses at which quantities look at the arm, in deg; the zero pose first."""
    return tuple(dict.fromkeys([ZERO_POSE, *(quantity.arm_pose for quantity in quantities)]))


def _places(poses: Sequence[Pose]) -> dict[Pose, int]:
    """Place of each pose."""
    return {pose: place for place, pose in enumerate(poses)}
