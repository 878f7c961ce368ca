"""Whether positions suffice to estimate a level of entries, and what more it takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from er3a.calibration.measured import Observations
from er3a.calibration.outcomes import CalibrationError, LevelName, MorePositions, NoPositions
from er3a.calibration.parameters import LEVELS, SCALE, Parameter, Subspace, jacobian, parameters_of, subspace
from er3a.kinematics.table_batch import tables_of
from er3a.numerics.quasi_random import quasi_random_points
from er3a.references.quantities import COORDINATES, ZERO_POSE, CarriedCoordinate, PointCoordinate, Pose, Quantity
from er3a.robots.robot import Robot

RICH_POSES = 64
SHOWN_POSES = 3


@dataclass(frozen=True, eq=False)
class Level:
    """The entries that are estimated.

    Attributes
    ----------
    name : one of ``LEVELS``
    parameters : its entries; subspace : which of them the observations determine
    more : what a fuller level would take; None if all entries are estimated
    """

    name: LevelName
    parameters: tuple[Parameter, ...]
    subspace: Subspace
    more: MorePositions | None


def choose_level(robot: Robot, observations: Observations) -> Level:
    """The fullest level that the observations determine as far as positions of these points ever can, with numbers to
    spare.

    Raises
    ------
    CalibrationError
        if even the lengths ask for more
    """
    if not len(observations):
        raise CalibrationError(NoPositions(), "there are no positions of single points to calibrate from")
    rich = _rich(robot, observations.quantities)
    deviation = np.full(len(rich), np.median(observations.deviation_mm))
    more: list[MorePositions] = []
    for name in LEVELS[::-1]:
        parameters = parameters_of(robot, name)
        here = subspace(robot, parameters, observations.quantities, observations.deviation_mm)
        best = subspace(robot, parameters, rich, deviation)
        if len(best.kept) == len(here.kept) and len(observations) > len(here.kept):
            return Level(name, parameters, here, more[-1] if more else None)
        more.append(_what_more(robot, name, parameters, here, best, observations))
    problem = f"{len(observations)} coordinates determine too little; positions to be added: {more[-1].least} at least"
    raise CalibrationError(more[-1], problem)


def _rich(robot: Robot, quantities: Sequence[Quantity]) -> tuple[Quantity, ...]:
    """The same points at poses all over the joint range."""
    points = dict.fromkeys(
        replace(quantity, coordinate=c, pose=ZERO_POSE)
        if isinstance(quantity, CarriedCoordinate | PointCoordinate)
        else PointCoordinate(ZERO_POSE, "wrist_centre", c)
        for quantity in quantities
        for c in COORDINATES
    )
    return tuple(replace(point, pose=pose) for pose in _spread(robot) for point in points)


def _spread(robot: Robot) -> list[Pose]:
    low, high = np.degrees(robot.lower), np.degrees(robot.upper)
    rows = np.round(quasi_random_points(low, high, RICH_POSES) / 5) * 5 + 0.0
    return [cast(Pose, tuple(row)) for row in rows.tolist()]


def _what_more(
    robot: Robot,
    level: LevelName,
    parameters: tuple[Parameter, ...],
    here: Subspace,
    best: Subspace,
    observations: Observations,
) -> MorePositions:
    lacking = len(best.kept) - len(here.kept)
    return MorePositions(
        coordinates=len(observations),
        poses=observations.poses,
        determined=len(here.kept),
        determinable=len(best.kept),
        level=level,
        least=-(-max(lacking, len(best.kept) + 1 - len(observations)) // 3),
        entries=tuple(parameters[k].name for k in best.kept if k not in here.kept),
        examples_deg=_examples(robot, [parameters[k] for k in best.kept], observations.quantities),
    )


def _examples(robot: Robot, kept: list[Parameter], quantities: Sequence[Quantity]) -> tuple[Pose, ...]:
    """Poses that add most to what is known: greedily the greatest gain in ln det of the information matrix."""
    poses = _spread(robot)
    candidates = [PointCoordinate(pose, "flange", c) for pose in poses for c in COORDINATES]
    table = tables_of(robot)
    blocks = SCALE * jacobian(table, robot, kept, candidates).reshape(len(poses), 3, len(kept))
    known = SCALE * jacobian(table, robot, kept, quantities)
    information = known.T @ known + 1e-9 * np.eye(len(kept))
    chosen = []
    for _ in range(SHOWN_POSES):
        gain = [np.linalg.slogdet(information + block.T @ block)[1] for block in blocks]
        at = int(np.argmax(gain))
        information += blocks[at].T @ blocks[at]
        chosen.append(poses[at])
    return tuple(chosen)
