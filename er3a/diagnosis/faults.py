"""The faults that tables are known to have, as repairs: what to change so that a faulty table becomes right again.

A *repair* changes a batch of tables at one place. Repairs with a free number (a missing length, a wrong scale) are
*slopes*: predictions are linear in lengths, so their best value follows from least squares.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal

import numpy as np

from er3a.diagnosis.fault_kinds import (
    Entries,
    Fault,
    LimitFault,
    Misread,
    ReversedDirection,
    ShiftedRows,
    SwappedEntries,
    SwappedLimits,
    SwappedRows,
    WrongAlphaSign,
    WrongConvention,
    WrongLength,
    WrongLimits,
    WrongOffset,
    WrongScale,
    WrongUnit,
)
from er3a.kinematics.table_batch import COLUMNS, Tables
from er3a.numerics.arrays import Reals
from er3a.references.quantities import MM

JOINTS = range(6)
RADIANS_PER_DEGREE = np.pi / 180
SAME = 1e-12

Change = Callable[[Tables], Tables]
LengthColumn = Literal["a", "d"]


@dataclass(frozen=True)
class Repair:
    """A change without free number.

    Attributes
    ----------
    fault : what was wrong with a table that the repair corrects
    apply : the change
    """

    fault: Fault
    apply: Change


@dataclass(frozen=True)
class Slope:
    """A change with a free number: ``apply(tables, amounts)`` adds the amount (m, or relative for a scale).

    ``fault(before, amount)`` is what was wrong, with the entry's value before the repair (m).
    """

    fault: Callable[[float, float], Fault]
    apply: Callable[[Tables, Reals], Tables]
    entry: Callable[[Tables], Reals]


def repairs_of(given: Tables) -> list[Repair]:
    """All repairs that change the given table (a batch of one)."""
    candidates = [
        *_units(),
        *_signs(given),
        *_swaps(),
        *_offsets(given),
        *_directions(),
        *_convention(given),
        *_limits(),
    ]
    return [repair for repair in candidates if _differs(repair.apply(given), given)]


def slopes() -> list[Slope]:
    """All repairs with a free number: each length, and a common scale."""
    columns: tuple[LengthColumn, ...] = ("a", "d")
    return [*(_length(column, joint) for column in columns for joint in JOINTS), _SCALE]


def _differs(left: Tables, right: Tables) -> bool:
    if left.modified[0] != right.modified[0]:
        return True
    return any(np.abs(getattr(left, name) - getattr(right, name)).max() > SAME for name in COLUMNS)


_LENGTHS: tuple[tuple[Entries, tuple[str, ...]], ...] = (("a", ("a",)), ("d", ("d",)), ("lengths", ("a", "d")))
_ANGLES: tuple[tuple[Entries, tuple[str, ...]], ...] = (
    ("alpha", ("alpha",)),
    ("offset", ("offset",)),
    ("limits", ("lower", "upper")),
    ("angles", ("alpha", "offset", "lower", "upper")),
)
_MISREAD_LENGTHS: tuple[tuple[float, Misread], ...] = (
    (1000.0, "metres_as_millimetres"),
    (0.001, "millimetres_as_metres"),
)
_MISREAD_ANGLES: tuple[tuple[float, Misread], ...] = (
    (1 / RADIANS_PER_DEGREE, "radians_as_degrees"),
    (RADIANS_PER_DEGREE, "degrees_as_radians"),
)


def _units() -> list[Repair]:
    return [
        Repair(WrongUnit(entries, misread), _scaled(columns, factor))
        for places, misreadings in ((_LENGTHS, _MISREAD_LENGTHS), (_ANGLES, _MISREAD_ANGLES))
        for entries, columns in places
        for factor, misread in misreadings
    ]


def _scaled(columns: tuple[str, ...], factor: float) -> Change:
    return lambda tables: replace(tables, **{name: getattr(tables, name) * factor for name in columns})


def _signs(given: Tables) -> list[Repair]:
    found = []
    for j in JOINTS:
        alpha = float(np.degrees(given.alpha[0, j]))
        found.append(Repair(WrongAlphaSign(j + 1, alpha, -alpha), _negated("alpha", j)))
    return found


def _negated(column: str, joint: int) -> Change:
    return lambda tables: tables.with_column(column, [joint], -getattr(tables, column)[:, [joint]])


_SHIFTS: tuple[tuple[Literal["rows", "a", "alpha", "d"], tuple[str, ...]], ...] = (
    ("rows", ("a", "alpha", "d")),
    ("a", ("a",)),
    ("alpha", ("alpha",)),
    ("d", ("d",)),
)


def _swaps() -> list[Repair]:
    found = [Repair(SwappedEntries(j + 1), _columns_swapped([j])) for j in JOINTS]
    found.append(Repair(SwappedEntries(None), _columns_swapped(list(JOINTS))))
    for i, j in combinations(JOINTS, 2):
        order = list(JOINTS)
        order[i], order[j] = j, i
        found.append(Repair(SwappedRows(i + 1, j + 1), _reordered(("a", "alpha", "d"), order)))
        found.append(Repair(SwappedLimits(i + 1, j + 1), _reordered(("lower", "upper"), order)))
    for entries, columns in _SHIFTS:
        found.append(Repair(ShiftedRows(entries, "down"), _reordered(columns, list(np.roll(JOINTS, -1)))))
        found.append(Repair(ShiftedRows(entries, "up"), _reordered(columns, list(np.roll(JOINTS, 1)))))
    return found


def _columns_swapped(joints: list[int]) -> Change:
    return lambda tables: tables.with_column("a", joints, tables.d[:, joints]).with_column(
        "d", joints, tables.a[:, joints]
    )


def _reordered(columns: tuple[str, ...], order: list[int]) -> Change:
    return lambda tables: replace(tables, **{name: getattr(tables, name)[:, order] for name in columns})


def _offsets(given: Tables) -> list[Repair]:
    found = []
    for j in JOINTS:
        before = float(np.degrees(given.offset[0, j]))
        for step in (90.0, -90.0, 180.0):
            after = (before + step + 180.0) % 360.0 - 180.0 or 0.0
            after = 180.0 if after == -180.0 else after
            found.append(Repair(WrongOffset(j + 1, before, after), _turned(j, np.radians(step))))
    return found


def _turned(joint: int, angle: float) -> Change:
    return lambda tables: tables.with_column("offset", [joint], tables.offset[:, [joint]] + angle)


def _directions() -> list[Repair]:
    return [Repair(ReversedDirection(j + 1), _negated("direction", j)) for j in JOINTS]


def _convention(given: Tables) -> list[Repair]:
    fault = WrongConvention("modified" if given.modified[0] else "standard")
    return [Repair(fault, lambda tables: replace(tables, modified=~tables.modified))]


_LIMIT_FAULTS: tuple[tuple[LimitFault, Callable[[Reals, Reals], tuple[Reals, Reals]]], ...] = (
    ("crossed", lambda low, high: (high, low)),
    ("signs_swapped", lambda low, high: (-high, -low)),
    ("lower_sign", lambda low, high: (-low, high)),
    ("upper_sign", lambda low, high: (low, -high)),
)


def _limits() -> list[Repair]:
    places: list[tuple[list[int], int | None]] = [([j], j + 1) for j in JOINTS]
    return [
        Repair(WrongLimits(joint, fault), _limits_changed(joints, change))
        for joints, joint in (*places, (list(JOINTS), None))
        for fault, change in _LIMIT_FAULTS
    ]


def _limits_changed(joints: list[int], change: Callable[[Reals, Reals], tuple[Reals, Reals]]) -> Change:
    def apply(tables: Tables) -> Tables:
        low, high = change(tables.lower[:, joints], tables.upper[:, joints])
        return tables.with_column("lower", joints, low).with_column("upper", joints, high)

    return apply


def _length(column: LengthColumn, joint: int) -> Slope:
    return Slope(
        lambda before, amount: WrongLength(joint + 1, column, before * MM, (before + amount) * MM),
        lambda tables, amounts: tables.with_column(
            column, [joint], getattr(tables, column)[:, [joint]] + amounts[:, None]
        ),
        lambda tables: (tables.a if column == "a" else tables.d)[:, joint],
    )


_SCALE = Slope(
    lambda before, amount: WrongScale(1 + amount),
    lambda tables, amounts: replace(tables, a=tables.a * (1 + amounts[:, None]), d=tables.d * (1 + amounts[:, None])),
    lambda tables: np.ones(len(tables)),
)
