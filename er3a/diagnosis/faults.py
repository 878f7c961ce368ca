"""Common faults of tables that have no free number, each as a repair: the change that corrects the faulty table. Faults
with a free number are in :mod:`er3a.diagnosis.fitting`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal, cast

import numpy as np

from er3a.comparison.entries import LENGTHS, Entry
from er3a.finding import Finding, fact, is_one
from er3a.kinematics.table_batch import COLUMNS, Tables
from er3a.numerics.arrays import Reals
from er3a.references.quantities import Limit, LimitExcess, Side, value_at
from er3a.references.reference import Reference, expected_of

Misread = Literal["metres_as_millimetres", "millimetres_as_metres", "radians_as_degrees", "degrees_as_radians"]
Entries = Literal["a", "d", "lengths", "alpha", "offset", "limits", "angles"]
LimitFault = Literal["crossed", "signs_swapped", "lower_sign", "upper_sign"]
LengthColumn = Literal["a", "d"]


Fault = Finding
Faults = tuple[Fault, ...]
"""One fault, or two; of conventions (zeros, directions, base, flange, what joints are counted from) any number."""

CONVENTIONS = "wrong_offset", "reversed_direction", "base_elsewhere", "flange_elsewhere", "counted_from_ground"
"""What can be chosen without changing the arm."""


def wrong_number(entry: Entry, given: float, fits: float) -> Fault:
    """The fault of an entry that is given with one value where another fits.

    Parameters
    ----------
    given, fits : m or rad; for the scale 1, and the factor that fits

    Returns
    -------
    fault : its numbers in mm or deg
    """
    given, fits = (float(value * entry.in_unit) for value in (given, fits))
    if entry.column == "scale":
        return fact("wrong_scale", factor=fits)
    if entry.column in LENGTHS:
        return fact(
            "wrong_length", joint=entry.joint, column=cast(LengthColumn, entry.column), given_mm=given, fits_mm=fits
        )
    return fact(
        "wrong_alpha" if entry.column == "alpha" else "wrong_offset", joint=entry.joint, given_deg=given, fits_deg=fits
    )


def rounded(fault: Fault) -> Fault:
    """The fault with fitted numbers to four digits and given ones to six: equal ones are the same fault.

    Parameters
    ----------
    fault : of any kind

    Returns
    -------
    fault : unchanged if it has no such numbers; the scale's factor to six digits
    """
    if is_one(fault, "wrong_length"):
        return fault.but(given_mm=_digits(fault.given_mm, 6), fits_mm=_digits(fault.fits_mm, 4))
    if is_one(fault, "wrong_offset", "wrong_alpha", "wrong_alpha_sign", "wrong_limit"):
        return fault.but(given_deg=_digits(fault.given_deg, 6), fits_deg=_digits(fault.fits_deg, 4))
    if is_one(fault, "wrong_scale"):
        return fact("wrong_scale", factor=_digits(fault.factor, 6))
    return fault


def entry_of(fault: Fault) -> str | None:
    """The one entry of the table that a fault is in.

    Parameters
    ----------
    fault : of any kind

    Returns
    -------
    name : such as ``d4``, ``alpha3`` or ``lower2``; None if it is in several
    """
    match fault:
        case Finding(code="wrong_length", joint=joint, column=column):
            return f"{column}{joint}"
        case Finding(code="wrong_offset", joint=joint):
            return f"offset{joint}"
        case Finding(code="wrong_alpha", joint=joint) | Finding(code="wrong_alpha_sign", joint=joint):
            return f"alpha{joint}"
        case Finding(code="reversed_direction", joint=joint):
            return f"direction{joint}"
        case Finding(code="wrong_limit", joint=joint, side=side):
            return f"{side}{joint}"
        case Finding(code="wrong_limits", joint=int(joint), fault="lower_sign" | "upper_sign" as sign):
            return f"{sign.removesuffix('_sign')}{joint}"
    return None


def place_of(fault: Fault) -> str | Fault:
    """Where a fault is, to gather faults at one place.

    Parameters
    ----------
    fault : of any kind

    Returns
    -------
    place : the name of its entry; the rounded fault itself if it is in several
    """
    return entry_of(fault) or rounded(fault)


def _digits(value: float, count: int) -> float:
    return float(f"{value:.{count}g}")


SIDES: tuple[Side, ...] = ("lower", "upper")
RADIANS_PER_DEGREE = np.pi / 180
SAME = 1e-12
DECIMALS = 9

Change = Callable[[Tables], Tables]


@dataclass(frozen=True)
class Repair:
    """A change without free number.

    Attributes
    ----------
    fault : what was wrong with a table that the repair corrects
    apply : the change
    free : whether its number could have been any
    """

    fault: Fault
    apply: Change
    free: bool = False


def repairs_of(given: Tables, references: Sequence[Reference] = ()) -> list[Repair]:
    """All repairs without free number that change the given table.

    Parameters
    ----------
    given : a batch of one
    references : a limit that they contradict is a repair, with the value that they state

    Returns
    -------
    repairs : each with the fault that it corrects
    """
    joints, alphas = range(given.a.shape[-1]), np.degrees(given.alpha[0]).tolist()
    candidates = [
        *limit_repairs(given, references),
        *_units(),
        *(
            Repair(fact("wrong_alpha_sign", joint=j + 1, given_deg=alpha, fits_deg=-alpha), _negated("alpha", j))
            for j, alpha in enumerate(alphas)
        ),
        *_swaps(joints),
        *_offsets(given, joints),
        *(Repair(fact("reversed_direction", joint=j + 1), _negated("direction", j)) for j in joints),
        Repair(
            fact("wrong_convention", read_as="modified" if given.modified[0] else "standard"),
            lambda tables: replace(tables, modified=~tables.modified),
        ),
        *_limits(joints),
    ]
    return [repair for repair in candidates if _differs(repair.apply(given), given)]


def limit_repairs(given: Tables, references: Sequence[Reference]) -> list[Repair]:
    """Repairs of limits that references contradict.

    Parameters
    ----------
    given : a batch of one table

    Returns
    -------
    repairs : to the middle of what references leave open; where they state no limit, to the farthest pose shown
    """
    found = []
    for joint in range(given.a.shape[-1]):
        for side in SIDES:
            now = float(np.degrees(getattr(given, side)[0, joint]))
            fits = limit_stated(joint, side, now, references)
            if fits is not None:
                fault = fact("wrong_limit", joint=joint + 1, side=side, given_deg=now, fits_deg=fits)
                found.append(Repair(fault, _set(side, joint, np.radians(fits)), free=True))
    return found


def limit_stated(joint: int, side: Side, now: float, references: Sequence[Reference]) -> float | None:
    """What references say about a joint's limit, if they contradict it.

    Parameters
    ----------
    joint : from 0
    side : ``lower`` or ``upper``
    now : deg, the table's limit

    Returns
    -------
    limit : deg, the middle of what they leave open, or the farthest pose shown; None if they don't contradict it
    """
    stated = [r for r in references if r.quantity == Limit(joint + 1, side) and r.expected is not None]
    if stated:
        expected, uncertainty = expected_of(stated)
        met = (np.abs(expected - now) <= uncertainty).all()
        middle = (np.max(expected - uncertainty) + np.min(expected + uncertainty)) / 2
        return None if met else round(float(middle), DECIMALS)
    shown = [value_at(r.quantity.pose, joint + 1) for r in references if isinstance(r.quantity, LimitExcess)]
    if not shown:
        return None
    farthest = min(shown) if side == "lower" else max(shown)
    outside = now > farthest if side == "lower" else now < farthest
    return farthest if outside else None


def _set(column: str, joint: int, value: float) -> Change:
    return lambda tables: tables.with_column(column, [joint], np.full((len(tables), 1), value))


def _differs(left: Tables, right: Tables) -> bool:
    if left.modified[0] != right.modified[0]:
        return True
    return any(np.abs(getattr(left, name) - getattr(right, name).astype(float)).max() > SAME for name in COLUMNS)


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
        Repair(fact("wrong_unit", entries=entries, misread=misread), _scaled(columns, factor))
        for places, misreadings in ((_LENGTHS, _MISREAD_LENGTHS), (_ANGLES, _MISREAD_ANGLES))
        for entries, columns in places
        for factor, misread in misreadings
    ]


def _scaled(columns: tuple[str, ...], factor: float) -> Change:
    return lambda tables: replace(tables, **{name: getattr(tables, name) * factor for name in columns})


def _negated(column: str, joint: int) -> Change:
    return lambda tables: tables.with_column(column, [joint], -getattr(tables, column)[:, [joint]])


_SHIFTS: tuple[tuple[Literal["rows", "a", "alpha", "d"], tuple[str, ...]], ...] = (
    ("rows", ("a", "alpha", "d")),
    ("a", ("a",)),
    ("alpha", ("alpha",)),
    ("d", ("d",)),
)


def _swaps(joints: range) -> list[Repair]:
    found = [Repair(fact("swapped_entries", joint=j + 1), _columns_swapped([j])) for j in joints]
    found.append(Repair(fact("swapped_entries", joint=None), _columns_swapped(list(joints))))
    for i, j in combinations(joints, 2):
        order = list(joints)
        order[i], order[j] = j, i
        found.append(Repair(fact("swapped_rows", first=i + 1, second=j + 1), _reordered(("a", "alpha", "d"), order)))
        found.append(Repair(fact("swapped_limits", first=i + 1, second=j + 1), _reordered(("lower", "upper"), order)))
    for entries, columns in _SHIFTS:
        found.append(
            Repair(fact("shifted_rows", entries=entries, toward="down"), _reordered(columns, list(np.roll(joints, -1))))
        )
        found.append(
            Repair(fact("shifted_rows", entries=entries, toward="up"), _reordered(columns, list(np.roll(joints, 1))))
        )
    return found


def _columns_swapped(joints: list[int]) -> Change:
    return lambda tables: tables.with_column("a", joints, tables.d[:, joints]).with_column(
        "d", joints, tables.a[:, joints]
    )


def _reordered(columns: tuple[str, ...], order: list[int]) -> Change:
    return lambda tables: replace(tables, **{name: getattr(tables, name)[:, order] for name in columns})


def _offsets(given: Tables, joints: range) -> list[Repair]:
    found = []
    for j in joints:
        before = float(np.degrees(given.offset[0, j]))
        for step in (90.0, -90.0, 180.0):
            after = (before + step + 180.0) % 360.0 - 180.0 or 0.0
            after = 180.0 if after == -180.0 else after
            found.append(
                Repair(
                    fact("wrong_offset", joint=j + 1, given_deg=before, fits_deg=after),
                    _offset_moved(j, np.radians(step)),
                )
            )
    return found


def _offset_moved(joint: int, angle: float) -> Change:
    return lambda tables: tables.with_column("offset", [joint], tables.offset[:, [joint]] + angle)


_LIMIT_FAULTS: tuple[tuple[LimitFault, Callable[[Reals, Reals], tuple[Reals, Reals]]], ...] = (
    ("crossed", lambda low, high: (high, low)),
    ("signs_swapped", lambda low, high: (-high, -low)),
    ("lower_sign", lambda low, high: (-low, high)),
    ("upper_sign", lambda low, high: (low, -high)),
)


def _limits(joints: range) -> list[Repair]:
    places: list[tuple[list[int], int | None]] = [([j], j + 1) for j in joints]
    return [
        Repair(fact("wrong_limits", joint=joint, fault=fault), _limits_changed(changed, change))
        for changed, joint in (*places, (list(joints), None))
        for fault, change in _LIMIT_FAULTS
    ]


def _limits_changed(joints: list[int], change: Callable[[Reals, Reals], tuple[Reals, Reals]]) -> Change:
    def apply(tables: Tables) -> Tables:
        low, high = change(tables.lower[:, joints], tables.upper[:, joints])
        return tables.with_column("lower", joints, low).with_column("upper", joints, high)

    return apply
