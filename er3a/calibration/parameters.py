"""The numbers that a calibration may correct: a table's entries, and where base and tool are.

Base and tool are corrected behind what the robot's file says of them: the base by a shift and a turn in its own frame,
``base S`` with ``S = T(x, y, z) Rz(rz) Ry(ry) Rx(rx)``, the tool by a shift of its point in the flange's frame, and,
where orientations were measured, by a turn about its own axes in the same order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from er3a.comparison.entries import BASE_COLUMNS, TOOL_COLUMNS, TOOL_TURNS, Entry, EntryUnit, entries_in, shifted
from er3a.errors import Er3aError
from er3a.finding import Finding
from er3a.geometry.transforms import posed, rot_x, rot_y, rot_z, translation
from er3a.kinematics.table_batch import robot_of, tables_of
from er3a.numerics.arrays import Reals
from er3a.references.quantities import MM
from er3a.robots.joint_limits import size_of
from er3a.robots.robot import Robot

LevelName = Literal["lengths", "lengths_and_offsets", "all_entries"]
"""Which entries are estimated: lengths that aren't 0, joint offsets besides, or all."""

PlacementName = Literal["base", "tool"]
"""Where the arm stands, and which point of the tool was measured: estimated too, unless they are fixed."""

FixedName = Literal["base", "tool", "ratios"]
"""What can be taken as the robot's file has it: places, and by how much joints turn for what is commanded."""

LEVELS: tuple[LevelName, ...] = ("lengths", "lengths_and_offsets", "all_entries")
PARALLEL_RAD = np.radians(1.0)  # within which two axes count as parallel
DEPENDENT = 1e-3
"""Share of a direction's length that has to lie outside the span of others to count as one more: 0.1 mm of 100 mm."""


class CalibrationError(Er3aError):
    """Measurements determine too little of a table, or no corrections make the table fit them; see ``finding``."""

    def __init__(self, finding: Finding, problem: str):
        self.finding = finding
        super().__init__(problem)


def parameters_of(robot: Robot, level: LevelName) -> tuple[Entry, ...]:
    """The entries of a level, in the order in which they are preferred where some have the same effect.

    ``lengths`` are those that are not 0. ``all_entries`` has Hayati's beta with alpha wherever neighbouring axes are
    parallel: their common normal, on which the other four entries rest, is undefined there.

    Parameters
    ----------
    level : one of ``LEVELS``

    Returns
    -------
    entries : of the table; base and tool are not among them
    """
    lengths = [each for each in entries_in("ad", robot.rows) if each.value(robot)]
    offsets = entries_in(("offset",), robot.rows)
    if level == LEVELS[0]:
        return tuple(lengths)
    if level == LEVELS[1]:
        return (*lengths, *offsets)
    hayati = [Entry("beta", row) for row, _ in parallel_pairs(robot)]
    others = [each for column in "ad" for each in reversed(entries_in(column, robot.rows)) if each not in lengths]
    return (*lengths, *offsets, *entries_in(("alpha",), robot.rows), *hayati, *others)


def placements_of(names: Sequence[PlacementName], oriented: bool = False) -> tuple[Entry, ...]:
    """The parameters of base and tool; they are preferred to table entries with the same effect.

    Parameters
    ----------
    names : ``base``, ``tool``, both or none
    oriented : whether the tool's orientation was measured, too

    Returns
    -------
    entries : six of the base, three of the tool, or six
    """
    of_tool = (*TOOL_COLUMNS, *TOOL_TURNS) if oriented else TOOL_COLUMNS
    columns = (BASE_COLUMNS if "base" in names else ()) + (of_tool if "tool" in names else ())
    return tuple(Entry(column) for column in columns)


def all_parameters(robot: Robot) -> tuple[Entry, ...]:
    """Every parameter of the robot that a calibration can correct.

    Parameters
    ----------
    robot : with m rows

    Returns
    -------
    entries : a, alpha, beta, d and offset of each row, then those of base and tool
    """
    table = entries_in(("a", "alpha", "beta", "d", "offset"), robot.rows)
    return (*table, *placements_of(("base", "tool"), oriented=True))


def parallel_pairs(robot: Robot) -> list[tuple[int, tuple[int, int]]]:
    """Rows whose alpha is between two parallel joint axes, to within ``PARALLEL_RAD``.

    Parameters
    ----------
    robot : in standard or modified (Craig) rows

    Returns
    -------
    pairs : the row of alpha, and the two joints, all from 1
    """
    shift = 1 if robot.convention == "modified" else 0
    pairs = []
    for joint in range(1, robot.rows):
        row = joint + shift
        if abs(np.sin(robot.alpha[row - 1])) < np.sin(PARALLEL_RAD):
            pairs.append((row, (joint, joint + 1)))
    return pairs


def placed(parameters: Sequence[Entry], amounts: Reals) -> tuple[Reals, Reals]:
    """What amounts say of base and tool.

    Parameters
    ----------
    parameters : p entries, of which those of base and tool count
    amounts : (p,), m or rad

    Returns
    -------
    S, X : (4, 4), m, behind the robot's base; and of the tool, its point's shift in the flange's frame, and its turn
    """
    by_column = {parameter.column: amount for parameter, amount in zip(parameters, amounts) if not parameter.joint}

    def at(columns: Sequence[str]) -> Reals:
        x, y, z, rx, ry, rz = (by_column.get(column, 0.0) for column in columns)
        return translation(x, y, z) @ rot_z(rz) @ rot_y(ry) @ rot_x(rx)

    return at(BASE_COLUMNS), at((*TOOL_COLUMNS, *TOOL_TURNS))


def placing_axes(parameters: Sequence[Entry], amounts: Reals) -> tuple[Reals, Reals]:
    """Along and about which axes parameters of base and tool move what they place.

    Parameters
    ----------
    parameters, amounts : p entries and (p,), m or rad, at which it is asked

    Returns
    -------
    along, about : (p, 3), of which one is 0, both for entries of the table; in the axes that base or tool have without
        corrections
    """
    found: Reals = np.zeros((2, len(parameters), 3))
    S, X = placed(parameters, amounts)
    yaws = {each.column: amount for each, amount in zip(parameters, amounts)}
    for k, parameter in enumerate(parameters):
        place, _, part = parameter.column.partition("_")
        if part:
            yaw = rot_z(yaws.get(f"{place}_rz", 0.0))[:3, 1]
            turns = {"rx": (S if place == "base" else X)[:3, 0], "ry": yaw, "rz": np.eye(3)[2]}
            found[int(part in turns), k] = turns[part] if part in turns else np.eye(3)["xyz".index(part)]
    return found[0], found[1]


WIDEST = 0.05
"""Rad, and in sizes of the arm, its lengths and strokes: a table that is off by more is another arm's."""


def settles(robot: Robot, unit: EntryUnit, half_width: float) -> bool:
    """Whether an estimate is sure enough to say something about a table.

    Parameters
    ----------
    unit : of the entry, mm or deg
    half_width : of its 95 % interval, in that unit

    Returns
    -------
    settles : whether that is less than the largest plausible error of a table
    """
    return half_width <= WIDEST * (whole_length_mm(robot) if unit == "mm" else float(np.degrees(1)))


def whole_length_mm(robot: Robot) -> float:
    """Sum of all lengths a and d, and of the strokes of joints that slide.

    Parameters
    ----------
    robot : any arm

    Returns
    -------
    length : mm
    """
    strokes = (robot.upper - robot.lower)[robot.slides]
    return MM * float(size_of(robot) + strokes.sum())


def coupled(robot: Robot, errors: Mapping[tuple[int, int], float]) -> Robot:
    """The robot with errors of ratios and couplings in its coupling.

    Parameters
    ----------
    errors : by (row, other), both from 1: ``row`` moves too far by this share of what ``other`` is meant to move by

    Returns
    -------
    robot : itself if there are no errors
    """
    factors = np.eye(robot.rows)
    for (row, other), error in errors.items():
        factors[row - 1, other - 1] += error
    return robot.replace(coupling=factors @ robot.joint_to_row) if errors else robot


def corrected(robot: Robot, parameters: Sequence[Entry], amounts: Reals) -> Robot:
    """The robot with amounts added to its table, base and tool.

    Parameters
    ----------
    parameters : p entries
    amounts : (p,), m or rad

    Returns
    -------
    robot : its base is ``base S``, its tool's point is shifted in the flange's frame, and the tool turned about it
    """
    found = robot_of(shifted(tables_of(robot), parameters, amounts[None]), 0, robot)
    if all(parameter.joint for parameter in parameters):
        return found
    S, X = placed(parameters, amounts)
    if any(parameter.column in BASE_COLUMNS for parameter in parameters):
        found = found.replace(base=robot.base @ S)
    if not np.array_equal(X, np.eye(4)):
        found = found.replace(tool=posed(robot.tool[:3, :3] @ X[:3, :3], robot.tool[:3, 3] + X[:3, 3]))
    return found
