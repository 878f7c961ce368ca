"""The faults that tables are known to have, as repairs: what to change so that a faulty table becomes right again.

A *repair* changes a batch of tables at one place. Repairs with a free number (a missing length, a wrong scale) are
*slopes*: predictions are linear in lengths, so their best value follows from least squares.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from er3a.kinematics.table_batch import COLUMNS, Tables

JOINTS = range(6)
RADIANS_PER_DEGREE = np.pi / 180
SAME = 1e-12


@dataclass(frozen=True)
class Repair:
    """A change without free number.

    Attributes
    ----------
    kind : which family of faults
    fault : what was wrong, in words, for a table that the repair mends
    apply : the change
    """

    kind: str
    fault: str
    apply: Callable[[Tables], Tables]


@dataclass(frozen=True)
class Slope:
    """A change with a free number: ``apply(tables, amounts)`` adds the amount (m, or relative for a scale).

    ``fault(before, amount)`` says in words what was wrong, with the entry's value before the repair (m).
    """

    kind: str
    fault: Callable[[float, float], str]
    apply: Callable[[Tables, np.ndarray], Tables]
    entry: Callable[[Tables], np.ndarray]


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
    found = [_length(column, joint) for column in "ad" for joint in JOINTS]
    return [*found, _SCALE]


def _differs(left: Tables, right: Tables) -> bool:
    if left.modified[0] != right.modified[0]:
        return True
    return any(np.abs(getattr(left, name) - getattr(right, name)).max() > SAME for name in COLUMNS)


def _units() -> list[Repair]:
    limits = ("lower", "upper")
    lengths = ((("a",), "column a"), (("d",), "column d"), (("a", "d"), "all lengths"))
    angles = (
        (("alpha",), "column alpha"),
        (("offset",), "column offset"),
        (limits, "joint limits"),
        (("alpha", "offset", *limits), "all angles"),
    )
    found = []
    for columns, words in lengths:
        for factor, fault in (
            (1000.0, "metres read as millimetres (1000 times too small)"),
            (0.001, "millimetres read as metres (1000 times too large)"),
        ):
            found.append(Repair("unit", f"{words}: {fault}", _scaled(columns, factor)))
    for columns, words in angles:
        for factor, fault in (
            (1 / RADIANS_PER_DEGREE, "radians read as degrees (57.3 times too small)"),
            (RADIANS_PER_DEGREE, "degrees read as radians (57.3 times too large)"),
        ):
            found.append(Repair("unit", f"{words}: {fault}", _scaled(columns, factor)))
    return found


def _scaled(columns: tuple[str, ...], factor: float) -> Callable[[Tables], Tables]:
    return lambda tables: replace(tables, **{name: getattr(tables, name) * factor for name in columns})


def _signs(given: Tables) -> list[Repair]:
    found = []
    for j in JOINTS:
        alpha = np.degrees(given.alpha[0, j])
        words = f"joint {j + 1}: alpha has the wrong sign ({alpha:g} deg given, {-alpha:g} deg fits)"
        found.append(Repair("alpha sign", words, _negated("alpha", j)))
    return found


def _negated(column: str, joint: int) -> Callable[[Tables], Tables]:
    return lambda tables: tables.with_column(column, [joint], -getattr(tables, column)[:, [joint]])


def _swaps() -> list[Repair]:
    found = [Repair("swap", f"joint {j + 1}: a and d are swapped", _columns_swapped([j])) for j in JOINTS]
    found.append(Repair("swap", "columns a and d are swapped", _columns_swapped(list(JOINTS))))
    for i, j in combinations(JOINTS, 2):
        order = list(JOINTS)
        order[i], order[j] = j, i
        found.append(Repair("rows", f"rows {i + 1} and {j + 1} are swapped", _reordered(("a", "alpha", "d"), order)))
        words = f"limits of joints {i + 1} and {j + 1} are swapped"
        found.append(Repair("limits", words, _reordered(("lower", "upper"), order)))
    for columns, words in (
        (("a", "alpha", "d"), "all rows are"),
        (("a",), "column a is"),
        (("alpha",), "column alpha is"),
        (("d",), "column d is"),
    ):
        for step, way in ((-1, "down"), (1, "up")):
            found.append(
                Repair("shift", f"{words} shifted {way} by one joint", _reordered(columns, list(np.roll(JOINTS, step))))
            )
    return found


def _columns_swapped(joints: list[int]) -> Callable[[Tables], Tables]:
    return lambda tables: tables.with_column("a", joints, tables.d[:, joints]).with_column(
        "d", joints, tables.a[:, joints]
    )


def _reordered(columns: tuple[str, ...], order: list[int]) -> Callable[[Tables], Tables]:
    return lambda tables: replace(tables, **{name: getattr(tables, name)[:, order] for name in columns})


def _offsets(given: Tables) -> list[Repair]:
    found = []
    for j in JOINTS:
        before = np.degrees(given.offset[0, j])
        for step in (90.0, -90.0, 180.0):
            after = (before + step + 180.0) % 360.0 - 180.0 or 0.0
            after = 180.0 if after == -180.0 else after
            missing = (
                f"offset {after:g} deg missing" if before == 0 else f"offset is {before:g} deg, {after:g} deg fits"
            )
            found.append(Repair("offset", f"joint {j + 1}: {missing}", _turned(j, np.radians(step))))
    return found


def _turned(joint: int, angle: float) -> Callable[[Tables], Tables]:
    return lambda tables: tables.with_column("offset", [joint], tables.offset[:, [joint]] + angle)


def _directions() -> list[Repair]:
    return [Repair("direction", f"joint {j + 1}: direction reversed", _negated("direction", j)) for j in JOINTS]


def _convention(given: Tables) -> list[Repair]:
    other, this = ("standard", "modified") if given.modified[0] else ("modified", "standard")
    words = f"the table is a {other} one, read as {this}"
    return [Repair("convention", words, lambda tables: replace(tables, modified=~tables.modified))]


_LIMIT_FAULTS = (
    ("limits crossed", lambda low, high: (high, low)),
    ("limits signed the wrong way round", lambda low, high: (-high, -low)),
    ("lower limit has the wrong sign", lambda low, high: (-low, high)),
    ("upper limit has the wrong sign", lambda low, high: (low, -high)),
)


def _limits() -> list[Repair]:
    places = [([j], f"joint {j + 1}") for j in JOINTS] + [(list(JOINTS), "every joint")]
    return [
        Repair("limits", f"{place}: {words}", _limits_changed(joints, change))
        for joints, place in places
        for words, change in _LIMIT_FAULTS
    ]


def _limits_changed(joints: list[int], change: Callable) -> Callable[[Tables], Tables]:
    def apply(tables: Tables) -> Tables:
        low, high = change(tables.lower[:, joints], tables.upper[:, joints])
        return tables.with_column("lower", joints, low).with_column("upper", joints, high)

    return apply


def _length(column: str, joint: int) -> Slope:
    def fault(before: float, amount: float) -> str:
        fits = f"{(before + amount) * 1000:.4g} mm fits"
        return (
            f"joint {joint + 1}: {column} missing, {fits}"
            if before == 0
            else (f"joint {joint + 1}: {column} is {before * 1000:.6g} mm, {fits}")
        )

    return Slope(
        "length",
        fault,
        lambda tables, amounts: tables.with_column(
            column, [joint], getattr(tables, column)[:, [joint]] + amounts[:, None]
        ),
        lambda tables: getattr(tables, column)[:, joint],
    )


_SCALE = Slope(
    "scale",
    lambda before, amount: f"all lengths: scale wrong, times {1 + amount:.6g} fits",
    lambda tables, amounts: replace(tables, a=tables.a * (1 + amounts[:, None]), d=tables.d * (1 + amounts[:, None])),
    lambda tables: np.ones(len(tables)),
)
