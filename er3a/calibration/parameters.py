"""The numbers that a calibration may correct: a table's entries, and where base and tool are.

Base and tool are corrected behind what the robot's file says of them: the base by a shift and a turn in its own frame,
``base S`` with ``S = T(x, y, z) Rz(rz) Ry(ry) Rx(rx)``, the tool by a shift of its point in the flange's frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from er3a.calibration.outcomes import LevelName, PlacementName
from er3a.geometry.transforms import rot_x, rot_y, rot_z, translation
from er3a.kinematics.table_batch import Tables, robot_of, tables_of
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot

LEVELS: tuple[LevelName, ...] = ("lengths", "lengths_and_offsets", "all_entries")
BASE_COLUMNS = ("base_x", "base_y", "base_z", "base_rx", "base_ry", "base_rz")
TOOL_COLUMNS = ("tool_x", "tool_y", "tool_z")
IN_MM = ("a", "d", *BASE_COLUMNS[:3], *TOOL_COLUMNS)
PARALLEL_RAD = np.radians(1.0)
MM = 1000.0
DEPENDENT = 1e-3
"""Share of a direction's length that has to lie outside the span of others to count as one more: 0.1 mm of 100 mm."""


@dataclass(frozen=True)
class Parameter:
    """One number.

    Attributes
    ----------
    column : a, alpha, beta, d or offset of the table, or one of ``BASE_COLUMNS`` and ``TOOL_COLUMNS``
    joint : from 1; 0 for base and tool
    """

    column: str
    joint: int

    @property
    def name(self) -> str:
        """The parameter's name, such as ``d4`` or ``base_x``."""
        return f"{self.column}{self.joint}" if self.joint else self.column

    @property
    def unit(self) -> Literal["mm", "deg"]:
        """mm or deg."""
        return "mm" if self.column in IN_MM else "deg"

    @property
    def in_unit(self) -> float:
        """Factor from m or rad to the unit."""
        return MM if self.unit == "mm" else 180 / np.pi

    def nominal(self, robot: Robot) -> float:
        """The robot's own value, in the unit; 0 for the base, whose corrections come behind what the file says."""
        if self.joint:
            return float(getattr(robot, self.column)[self.joint - 1] * self.in_unit)
        return float(robot.tool[TOOL_COLUMNS.index(self.column), 3] * MM) if self.column in TOOL_COLUMNS else 0.0


def parameters_of(robot: Robot, level: LevelName) -> tuple[Parameter, ...]:
    """The entries of a level, in the order in which they are preferred where some can't be told apart.

    ``lengths`` are those that are not 0. ``all_entries`` has Hayati's beta beside alpha wherever neighbouring axes are
    parallel: their common normal, on which the other four entries rest, is undefined there.
    """
    joints = range(1, robot.rows + 1)
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


def placements_of(names: Sequence[PlacementName]) -> tuple[Parameter, ...]:
    """The parameters of base and tool; they are preferred to table entries with the same effect."""
    columns = (BASE_COLUMNS if "base" in names else ()) + (TOOL_COLUMNS if "tool" in names else ())
    return tuple(Parameter(column, 0) for column in columns)


def all_parameters(robot: Robot) -> tuple[Parameter, ...]:
    """Every parameter of the robot that a calibration can correct."""
    joints = range(1, robot.rows + 1)
    table = (Parameter(column, j) for column in ("a", "alpha", "beta", "d", "offset") for j in joints)
    return (*table, *placements_of(("base", "tool")))


def parallel_pairs(robot: Robot) -> list[tuple[int, tuple[int, int]]]:
    """Rows whose alpha stands between two parallel joint axes (within 1 deg), each with the two joints."""
    shift = 1 if robot.convention == "modified" else 0
    pairs = []
    for joint in range(1, robot.rows):
        row = joint + shift
        if abs(np.sin(robot.alpha[row - 1])) < np.sin(PARALLEL_RAD):
            pairs.append((row, (joint, joint + 1)))
    return pairs


def moved(tables: Tables, parameters: Sequence[Parameter], amounts: Reals) -> Tables:
    """One table of the batch for each row of amounts (H, p), in m and rad, added to the entries; amounts of base and
    tool change no table."""
    columns: dict[str, Any] = {}
    for parameter, amount in zip(parameters, amounts.T):
        if parameter.joint:
            if parameter.column not in columns:
                columns[parameter.column] = getattr(tables, parameter.column).copy()
            columns[parameter.column][:, parameter.joint - 1] += amount
    return replace(tables, **columns)


def placed(parameters: Sequence[Parameter], amounts: Reals) -> tuple[Reals, Reals]:
    """What amounts (p,) say of base and tool: S (4, 4), behind the base, and the tool's shift (3,), m."""
    by_column = {parameter.column: amount for parameter, amount in zip(parameters, amounts) if not parameter.joint}
    x, y, z, rx, ry, rz = (by_column.get(column, 0.0) for column in BASE_COLUMNS)
    S = translation(x, y, z) @ rot_z(rz) @ rot_y(ry) @ rot_x(rx)
    return S, np.array([by_column.get(column, 0.0) for column in TOOL_COLUMNS])


WIDEST = 0.05
"""Rad, and in sizes of the arm, its lengths and strokes: a table that is off by more is another arm's."""


def settles(robot: Robot, unit: Literal["mm", "deg"], half_width: float) -> bool:
    """Whether the half-width of a 95 % interval, mm or deg, is less than the largest plausible error of a table."""
    return half_width <= WIDEST * (whole_length_mm(robot) if unit == "mm" else float(np.degrees(1)))


def whole_length_mm(robot: Robot) -> float:
    """Of all lengths and strokes."""
    strokes = (robot.upper - robot.lower)[robot.slides]
    return MM * float(np.abs(robot.a).sum() + np.abs(robot.d).sum() + strokes.sum())


def coupled(robot: Robot, errors: Mapping[tuple[int, int], float]) -> Robot:
    """The robot whose rows (from 1) move, for each (row, other), by ``error`` times what the other is meant to move by
    more than they are meant to, by its coupling."""
    factors = np.eye(robot.rows)
    for (row, other), error in errors.items():
        factors[row - 1, other - 1] += error
    return robot.replace(coupling=factors if robot.coupling is None else factors @ robot.coupling) if errors else robot


def corrected(robot: Robot, parameters: Sequence[Parameter], amounts: Reals) -> Robot:
    """The robot with amounts (p,), in m and rad, added to its table, base and tool."""
    found = robot_of(moved(tables_of(robot), parameters, amounts[None]), 0, robot)
    S, shift = placed(parameters, amounts)
    if any(parameter.column in BASE_COLUMNS for parameter in parameters):
        found = found.replace(base=robot.base @ S)
    if shift.any():
        found = found.replace(tool=translation(*shift) @ robot.tool)
    return found
