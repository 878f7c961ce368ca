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
from er3a.pipeline.messages.language import N_, said

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
    lengths = ((("a",), N_("column a")), (("d",), N_("column d")), (("a", "d"), N_("all lengths")))
    angles = (
        (("alpha",), N_("column alpha")),
        (("offset",), N_("column offset")),
        (limits, N_("joint limits")),
        (("alpha", "offset", *limits), N_("all angles")),
    )
    found = []
    for columns, words in lengths:
        for factor, fault in (
            (1000.0, N_("metres read as millimetres (1000 times too small)")),
            (0.001, N_("millimetres read as metres (1000 times too large)")),
        ):
            found.append(Repair("unit", _fault_at(words, fault), _scaled(columns, factor)))
    for columns, words in angles:
        for factor, fault in (
            (1 / RADIANS_PER_DEGREE, N_("radians read as degrees (57.3 times too small)")),
            (RADIANS_PER_DEGREE, N_("degrees read as radians (57.3 times too large)")),
        ):
            found.append(Repair("unit", _fault_at(words, fault), _scaled(columns, factor)))
    return found


def _fault_at(place: str, fault: str) -> str:
    return said("{place}: {fault}", place=place, fault=fault)


def _at_joint(joint: int, fault: str) -> str:
    return _fault_at(said("joint {joint}", joint=joint + 1), fault)


def _scaled(columns: tuple[str, ...], factor: float) -> Callable[[Tables], Tables]:
    return lambda tables: replace(tables, **{name: getattr(tables, name) * factor for name in columns})


def _signs(given: Tables) -> list[Repair]:
    found = []
    for j in JOINTS:
        alpha = np.degrees(given.alpha[0, j])
        fault = said("alpha has the wrong sign ({given:g} deg given, {fits:g} deg fits)", given=alpha, fits=-alpha)
        found.append(Repair("alpha sign", _at_joint(j, fault), _negated("alpha", j)))
    return found


def _negated(column: str, joint: int) -> Callable[[Tables], Tables]:
    return lambda tables: tables.with_column(column, [joint], -getattr(tables, column)[:, [joint]])


_SHIFTS = (
    (("a", "alpha", "d"), N_("all rows are shifted down by one joint"), N_("all rows are shifted up by one joint")),
    (("a",), N_("column a is shifted down by one joint"), N_("column a is shifted up by one joint")),
    (("alpha",), N_("column alpha is shifted down by one joint"), N_("column alpha is shifted up by one joint")),
    (("d",), N_("column d is shifted down by one joint"), N_("column d is shifted up by one joint")),
)


def _swaps() -> list[Repair]:
    found = [Repair("swap", _at_joint(j, N_("a and d are swapped")), _columns_swapped([j])) for j in JOINTS]
    found.append(Repair("swap", N_("columns a and d are swapped"), _columns_swapped(list(JOINTS))))
    for i, j in combinations(JOINTS, 2):
        order = list(JOINTS)
        order[i], order[j] = j, i
        words = said("rows {first} and {second} are swapped", first=i + 1, second=j + 1)
        found.append(Repair("rows", words, _reordered(("a", "alpha", "d"), order)))
        words = said("limits of joints {first} and {second} are swapped", first=i + 1, second=j + 1)
        found.append(Repair("limits", words, _reordered(("lower", "upper"), order)))
    for columns, down, up in _SHIFTS:
        found.append(Repair("shift", down, _reordered(columns, list(np.roll(JOINTS, -1)))))
        found.append(Repair("shift", up, _reordered(columns, list(np.roll(JOINTS, 1)))))
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
            fault = (
                said("offset {fits:g} deg missing", fits=after)
                if before == 0
                else said("offset is {given:g} deg, {fits:g} deg fits", given=before, fits=after)
            )
            found.append(Repair("offset", _at_joint(j, fault), _turned(j, np.radians(step))))
    return found


def _turned(joint: int, angle: float) -> Callable[[Tables], Tables]:
    return lambda tables: tables.with_column("offset", [joint], tables.offset[:, [joint]] + angle)


def _directions() -> list[Repair]:
    return [Repair("direction", _at_joint(j, N_("direction reversed")), _negated("direction", j)) for j in JOINTS]


def _convention(given: Tables) -> list[Repair]:
    words = (
        N_("the table is a standard one, read as modified")
        if given.modified[0]
        else N_("the table is a modified one, read as standard")
    )
    return [Repair("convention", words, lambda tables: replace(tables, modified=~tables.modified))]


_LIMIT_FAULTS = (
    (N_("limits crossed"), lambda low, high: (high, low)),
    (N_("limits signed the wrong way round"), lambda low, high: (-high, -low)),
    (N_("lower limit has the wrong sign"), lambda low, high: (-low, high)),
    (N_("upper limit has the wrong sign"), lambda low, high: (low, -high)),
)


def _limits() -> list[Repair]:
    places = [([j], said("joint {joint}", joint=j + 1)) for j in JOINTS] + [(list(JOINTS), N_("every joint"))]
    return [
        Repair("limits", _fault_at(place, words), _limits_changed(joints, change))
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
        given, fits = before * 1000, (before + amount) * 1000
        fault = (
            said("{entry} missing, {fits:.4g} mm fits", entry=column, fits=fits)
            if before == 0
            else said("{entry} is {given:.6g} mm, {fits:.4g} mm fits", entry=column, given=given, fits=fits)
        )
        return _at_joint(joint, fault)

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
    lambda before, amount: _fault_at(
        N_("all lengths"), said("scale wrong, times {factor:.6g} fits", factor=1 + amount)
    ),
    lambda tables, amounts: replace(tables, a=tables.a * (1 + amounts[:, None]), d=tables.d * (1 + amounts[:, None])),
    lambda tables: np.ones(len(tables)),
)
