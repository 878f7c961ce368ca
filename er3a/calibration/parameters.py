"""Which entries of a table are estimated, and which of them positions can tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.calibration.outcomes import Held, LevelName, MovesNothing, NotToldApart
from er3a.kinematics.table_batch import Tables, join, tables_of
from er3a.numerics.arrays import Reals
from er3a.references.predict import predict_tables
from er3a.references.quantities import MM, Quantity
from er3a.robots.robot import Robot

LEVELS: tuple[LevelName, ...] = ("lengths", "lengths_and_offsets", "all_entries")
PARALLEL_RAD = np.radians(1.0)
STEP = 1e-5
SCALE = 1e-3  # m and rad alike: 1 mm, and 1 mrad, which moves a flange about as far
NO_EFFECT = 1e-6
DEPENDENT = 1e-3


@dataclass(frozen=True)
class Parameter:
    """One entry of the table.

    Attributes
    ----------
    column : a, alpha, beta, d or offset; joint : 1 to 6
    """

    column: str
    joint: int

    @property
    def name(self) -> str:
        """Such as ``d4``."""
        return f"{self.column}{self.joint}"

    @property
    def unit(self) -> Literal["mm", "deg"]:
        """mm or deg."""
        return "mm" if self.column in ("a", "d") else "deg"

    @property
    def in_unit(self) -> float:
        """Factor from m or rad to the unit."""
        return MM if self.unit == "mm" else 180 / np.pi


@dataclass(frozen=True, eq=False)
class Subspace:
    """What references determine.

    Attributes
    ----------
    kept : places of the parameters that are estimated
    held : why the others keep their values
    singular_values : of the scaled Jacobian over all parameters (one standard deviation per mm or mrad), descending
    """

    kept: tuple[int, ...]
    held: tuple[Held, ...]
    singular_values: Reals


def parameters_of(robot: Robot, level: LevelName) -> tuple[Parameter, ...]:
    """The entries of a level, in the order in which they are preferred where some can't be told apart.

    ``lengths`` are those that are not 0. ``all_entries`` has Hayati's beta beside alpha wherever neighbouring axes are
    parallel: their common normal, on which the other four entries rest, is undefined there.
    """
    joints = range(1, 7)
    lengths = [Parameter(column, j) for column in "ad" for j in joints if getattr(robot, column)[j - 1]]
    offsets = [Parameter("offset", j) for j in joints]
    if level == LEVELS[0]:
        return tuple(lengths)
    if level == LEVELS[1]:
        return (*lengths, *offsets)
    turns = [Parameter("alpha", j) for j in joints]
    hayati = [Parameter("beta", row) for row, _ in parallel_pairs(robot)]
    others = [Parameter(column, j) for column in "ad" for j in reversed(joints) if not getattr(robot, column)[j - 1]]
    return (*lengths, *offsets, *turns, *hayati, *others)


def parallel_pairs(robot: Robot) -> list[tuple[int, tuple[int, int]]]:
    """Rows whose alpha stands between two parallel joint axes (within 1 deg), each with the two joints."""
    shift = 1 if robot.convention == "modified" else 0
    pairs = []
    for joint in range(1, 6):
        row = joint + shift
        if abs(np.sin(robot.alpha[row - 1])) < np.sin(PARALLEL_RAD):
            pairs.append((row, (joint, joint + 1)))
    return pairs


def moved(tables: Tables, parameters: Sequence[Parameter], amounts: Reals) -> Tables:
    """One table of the batch for each row of amounts (H, p), in m and rad, added to the entries."""
    for parameter, amount in zip(parameters, amounts.T):
        entry = getattr(tables, parameter.column)[:, [parameter.joint - 1]]
        tables = tables.with_column(parameter.column, [parameter.joint - 1], entry + amount[:, None])
    return tables


def jacobian(tables: Tables, robot: Robot, parameters: Sequence[Parameter], quantities: Sequence[Quantity]) -> Reals:
    """Derivative (n, p) of quantities with respect to entries, in the quantities' units per m or rad, by central
    differences at a table (a batch of one); exact to about 1e-8."""
    count = len(parameters)
    steps = STEP * np.concatenate([np.eye(count), -np.eye(count)])
    values = predict_tables(moved(join([tables] * (2 * count)), parameters, steps), robot, quantities)
    slopes: Reals = (values[:count] - values[count:]).T / (2 * STEP)
    return slopes


def subspace(
    robot: Robot, parameters: Sequence[Parameter], quantities: Sequence[Quantity], deviation: Reals
) -> Subspace:
    """The identifiable part of the parameters: columns of the weighted Jacobian are taken in order of preference, and
    one that lies in the span of those before it (to 0.1 % of its length) is held.

    Parameters
    ----------
    deviation : (n,), standard deviation of the measured quantities
    """
    J = SCALE * jacobian(tables_of(robot), robot, parameters, quantities) / deviation[:, None]
    norms = np.linalg.norm(J, axis=0)
    kept: list[int] = []
    held: list[Held] = []
    basis: Reals = np.empty((len(J), 0))
    for k, norm in enumerate(norms):
        rest = J[:, k] - basis @ (basis.T @ J[:, k])
        rest -= basis @ (basis.T @ rest)
        if norm > NO_EFFECT * norms.max() and np.linalg.norm(rest) > DEPENDENT * norm:
            kept.append(k)
            basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
            continue
        still = norm <= NO_EFFECT * norms.max()
        held.append(MovesNothing(parameters[k].name) if still else _told_apart_from(robot, parameters, k, kept, J))
    singular_values = np.asarray(np.linalg.svd(J, compute_uv=False), np.float64)
    return Subspace(tuple(kept), tuple(held), singular_values)


def _told_apart_from(robot: Robot, parameters: Sequence[Parameter], k: int, kept: list[int], J: Reals) -> NotToldApart:
    """Which entries act on the measured points as entry ``k`` does."""
    share = np.linalg.lstsq(J[:, kept], J[:, k], rcond=None)[0] * np.linalg.norm(J[:, kept], axis=0)
    partners = [parameters[i] for i, part in zip(kept, share) if abs(part) > DEPENDENT * np.linalg.norm(J[:, k])]
    between = [
        joints for row, joints in parallel_pairs(robot)
        if parameters[k].column == "d" and {parameters[k].joint, partners[-1].joint} == set(joints)
    ]  # fmt: skip
    entries = (parameters[k].name, *(partner.name for partner in partners))
    return NotToldApart(entries, between[0] if between and len(partners) == 1 else None)
