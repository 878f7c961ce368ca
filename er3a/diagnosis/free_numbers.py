"""The entries of a table that may have any value: lengths, twists, offsets, and a common scale of all lengths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from er3a.diagnosis.fault_kinds import Fault, WrongAlpha, WrongLength, WrongOffset, WrongScale
from er3a.kinematics.table_batch import Tables
from er3a.numerics.arrays import Integers, Reals
from er3a.references.quantities import MM

FreeColumn = Literal["a", "d", "alpha", "offset"]
COLUMNS: tuple[FreeColumn, ...] = ("a", "d", "alpha", "offset")
ANGLES = ("alpha", "offset")


@dataclass(frozen=True)
class FreeNumber:
    """An entry with a free value.

    Attributes
    ----------
    column : None for the common scale of all lengths
    joint : counted from 0; 0 for the scale
    """

    column: FreeColumn | None
    joint: int

    @property
    def name(self) -> str:
        """The entry's name, such as "d4"."""
        return f"{self.column}{self.joint + 1}" if self.column else "scale"

    @property
    def is_angle(self) -> bool:
        """Whether the number comes round after a turn."""
        return self.column in ANGLES

    def value(self, tables: Tables) -> Reals:
        """The entry (H,), in m or rad; 1 for the scale."""
        if self.column is None:
            return np.ones(len(tables))
        column: Reals = getattr(tables, self.column)[:, self.joint]
        return column

    def fault(self, given: float, fits: float) -> Fault:
        """What was wrong with an entry that is given with one value (m or rad; 1 for the scale) where another fits."""
        joint = self.joint + 1
        if self.column is None:
            return WrongScale(fits)
        if self.column == "alpha":
            return WrongAlpha(joint, _degrees(given), _degrees(fits))
        if self.column == "offset":
            return WrongOffset(joint, _degrees(given), _degrees(fits))
        return WrongLength(joint, self.column, given * MM, fits * MM)


def free_numbers(joints: int) -> tuple[FreeNumber, ...]:
    """All free numbers of a table; the scale first, so that it is applied before a length is set."""
    entries = (FreeNumber(column, joint) for column in COLUMNS for joint in range(joints))
    return (FreeNumber(None, 0), *entries)


def moved(tables: Tables, numbers: Sequence[FreeNumber], which: Integers, amounts: Reals) -> Tables:
    """Tables with amounts added to entries.

    Parameters
    ----------
    which : (H, k), the places among ``numbers`` of the k entries to change in each table
    amounts : (H, k), m or rad; relative for the scale
    """
    columns = {name: getattr(tables, name).copy() for name in COLUMNS}
    for own, by in zip(which.T, amounts.T):
        for place in np.unique(own):
            rows, number = own == place, numbers[place]
            if number.column is None:
                for name in ("a", "d"):
                    columns[name][rows] *= (1 + by[rows])[:, None]
            else:
                columns[number.column][rows, number.joint] += by[rows]
    return replace(tables, **columns)


def wrapped(angle: Reals) -> Reals:
    """The same angles (rad) within (-pi, pi]."""
    turned: Reals = np.pi - (np.pi - angle) % (2 * np.pi)
    return turned


def _degrees(angle: float) -> float:
    return float(np.degrees(angle))
