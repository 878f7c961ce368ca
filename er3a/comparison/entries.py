"""One entry of a table, tables with amounts added to entries, and how these move a tool: what comparison, diagnosis,
calibration and evidence name and change."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from er3a.by_value import frozen
from er3a.geometry.transforms import rot_x, rot_z, translation
from er3a.kinematics.table_batch import Tables, frames_of
from er3a.numerics.arrays import Reals
from er3a.references.quantities import MM
from er3a.robots.robot import Robot

EntryUnit = Literal["mm", "deg", "deg/s", ""]
LENGTHS = ("a", "d")
BASE_COLUMNS = ("base_x", "base_y", "base_z", "base_rx", "base_ry", "base_rz")
TOOL_COLUMNS = ("tool_x", "tool_y", "tool_z")
TOOL_TURNS = ("tool_rx", "tool_ry", "tool_rz")
IN_MM = (*LENGTHS, *BASE_COLUMNS[:3], *TOOL_COLUMNS)
SCALE_M, SCALE_RAD = 1e-3, float(np.radians(0.1))  # 0.1 deg moves a point 0.6 m away by a millimetre
"""Steps of lengths and angles that move a tool about as far: 1 mm, and 0.1 deg at half a metre."""


@frozen
class Entry:
    """One number of a table, of its base or its tool.

    Attributes
    ----------
    column : of the table, or one of ``BASE_COLUMNS``, ``TOOL_COLUMNS``, ``TOOL_TURNS``, or ``scale``, a common factor
        of all lengths
    joint : the row, from 1; 0 for base, tool and scale
    """

    column: str
    joint: int = 0

    @property
    def name(self) -> str:
        """Such as ``d4``, ``direction5`` or ``base_x``."""
        return f"{self.column}{self.joint}" if self.joint else self.column

    @property
    def unit(self) -> EntryUnit:
        """mm, deg, deg/s, or nothing for a direction and the scale."""
        if self.column in IN_MM:
            return "mm"
        return "" if self.column in ("direction", "scale") else "deg/s" if self.column == "speed" else "deg"

    @property
    def in_unit(self) -> float:
        """Factor from SI to the unit."""
        return {"mm": MM, "": 1.0}.get(self.unit, 180 / np.pi)

    @property
    def scale(self) -> float:
        """A step in SI that moves a tool by about a millimetre."""
        return SCALE_M if self.unit == "mm" else SCALE_RAD

    def value(self, robot: Robot) -> float:
        """The robot's value of this entry.

        Parameters
        ----------
        robot : with as many rows as ``joint`` at least

        Returns
        -------
        value : in :attr:`unit`; 0 for the base and turns of the tool, whose corrections come behind what the file says
        """
        if self.joint:
            return round(float(getattr(robot, self.column)[self.joint - 1] * self.in_unit), 9)
        return float(robot.tool[TOOL_COLUMNS.index(self.column), 3] * MM) if self.column in TOOL_COLUMNS else 0.0

    def of(self, tables: Tables) -> Reals:
        """The entry of many tables.

        Parameters
        ----------
        tables : H of them

        Returns
        -------
        values : (H,), m or rad; 1 for the scale
        """
        if self.column == "scale":
            return np.ones(len(tables))
        column: Reals = getattr(tables, self.column)[:, self.joint - 1]
        return column


def entries_in(columns: Iterable[str], rows: int) -> tuple[Entry, ...]:
    """All entries of some columns.

    Parameters
    ----------
    rows : how many the table has

    Returns
    -------
    entries : column by column, rows from 1
    """
    return tuple(Entry(column, row + 1) for column in columns for row in range(rows))


def shifted(tables: Tables, entries: Sequence[Entry], amounts: Reals) -> Tables:
    """Tables with amounts added to k entries; those of base and tool change no table.

    Parameters
    ----------
    tables : one, or one for each of H rows of amounts
    amounts : (H, k), m and rad; relative for the scale, which has to come before lengths

    Returns
    -------
    tables : H
    """
    found = tables if len(tables) == len(amounts) else tables[np.zeros(len(amounts), dtype=np.int64)]
    columns: dict[str, Any] = {}
    for entry, amount in zip(entries, amounts.T):
        for name in LENGTHS if entry.column == "scale" else (entry.column,) * bool(entry.joint):
            if name not in columns:
                columns[name] = getattr(found, name).copy()
            if entry.joint:
                columns[name][:, entry.joint - 1] += amount
            else:
                columns[name] *= 1 + amount[:, None]
    return replace(found, **columns)


def wrapped_between(tables: Tables, other: Tables, entry: Entry) -> Reals:
    """By how much an entry of tables is more than another's.

    Parameters
    ----------
    tables, other : H each, or one that is compared with all
    entry : of rows; not of base or tool

    Returns
    -------
    difference : (H,), m or rad; angles in [-pi, pi)
    """
    off = entry.of(tables) - entry.of(other)
    return off if entry.unit == "mm" else (off + np.pi) % (2 * np.pi) - np.pi


def entry_twists(table: Tables, robot: Robot, x: Reals, entries: Sequence[Entry], points: Reals) -> Reals:
    """How points on the flange move and turn with entries of a table's rows.

    A row is ``Rz(offset) Tz(d) Tx(a) Rx(alpha) Ry(beta)``, a modified one begins with the last three: lengths move
    along an axis of such a frame, angles turn about it.

    Parameters
    ----------
    table : a batch of one
    robot : for base and flange
    x : (N, m), rad or m, what the rows move by
    entries : k of them, none of base, tool or scale
    points : (N, 3), m, base frame

    Returns
    -------
    twists : (N, 6, k), m and rad per m or rad, base frame
    """
    T = frames_of(table, robot, x)[0, :, :-1]
    a, alpha, d, offset, sliding = (getattr(table, name)[0] for name in ("a", "alpha", "d", "offset", "sliding"))
    links = T @ np.array(
        [rot_z(angle) for angle in np.where(sliding, offset, 0.0)]
    )  # a sliding row's frame is unturned
    if table.modified[0]:
        links = np.concatenate([np.broadcast_to(robot.base, links[:, :1].shape), links[:, :-1]], axis=1)
        d = np.append(0.0, d[:-1])
    found: Reals = np.zeros((len(x), 6, len(entries)))
    for k, entry in enumerate(entries):
        row, column = entry.joint - 1, 2
        frame = T[:, row]
        if entry.column not in ("d", "offset"):
            frame = links[:, row] @ translation(a[row], 0.0, d[row]) @ rot_x(alpha[row])
            column = 1 if entry.column == "beta" else 0
        axis = frame[:, :3, column]
        if entry.column in LENGTHS:
            found[:, :3, k] = axis
        else:
            found[:, :3, k], found[:, 3:, k] = np.cross(axis, points - frame[:, :3, 3]), axis
    return found


def row_twists(table: Tables, robot: Robot, x: Reals, points: Reals) -> Reals:
    """How points on the flange move and turn with what the rows move by.

    Parameters
    ----------
    table : a batch of one
    robot : for base and flange
    x : (N, m), rad or m, what the rows move by
    points : (N, 3), m, base frame

    Returns
    -------
    twists : (N, 6, m), m and rad per m or rad, base frame
    """
    moved = [Entry("d" if slides else "offset", k) for k, slides in enumerate(table.sliding[0], 1)]
    found: Reals = table.direction[0] * entry_twists(table, robot, x, moved, points)
    return found
