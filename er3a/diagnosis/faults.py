"""Common faults of tables that have no free number, each as a repair: the change that corrects the faulty table. Faults
with a free number are in :mod:`er3a.diagnosis.fitting`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from er3a.by_value import frozen
from er3a.comparison.changes import SHAPE, Change, Slip, slips_of, swapped, times
from er3a.comparison.entries import LENGTHS, Entry
from er3a.finding import Finding, fact, is_one
from er3a.kinematics.table_batch import COLUMNS, Tables
from er3a.references.quantities import Limit, LimitExcess, Side, value_at
from er3a.references.reference import Reference, expected_of

Fault = Finding
Faults = tuple[Fault, ...]
"""One fault, or two; of conventions (zeros, directions, base, flange, what joints are counted from) any number."""

CONVENTIONS = "wrong_offset", "reversed_direction", "base_elsewhere", "flange_elsewhere", "counted_from_ground"
"""What can be chosen without changing the arm."""


DIGITS = {"given_mm": 6, "given_deg": 6, "factor": 6, "fits_mm": 4, "fits_deg": 4}
COLUMN_OF = {
    "wrong_offset": "offset",
    "wrong_alpha": "alpha",
    "wrong_alpha_sign": "alpha",
    "reversed_direction": "direction",
}


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
        return fact("wrong_length", joint=entry.joint, column=entry.column, given_mm=given, fits_mm=fits)
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
    return fault.but(
        **{name: float(f"{fault.params[name]:.{count}g}") for name, count in DIGITS.items() if name in fault.params}
    )


def entry_of(fault: Fault) -> str | None:
    """The one entry of the table that a fault is in.

    Parameters
    ----------
    fault : of any kind

    Returns
    -------
    name : such as ``d4``, ``alpha3`` or ``lower2``; None if it is in several
    """
    column = COLUMN_OF.get(fault.code) or fault.params.get("column") or fault.params.get("side")
    if is_one(fault, "wrong_limits") and fault.joint and fault.fault in ("lower_sign", "upper_sign"):
        column = fault.fault.removesuffix("_sign")
    return f"{column}{fault.joint}" if column else None


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


SIDES: tuple[Side, Side] = ("lower", "upper")
RADIANS_PER_DEGREE = np.pi / 180
SAME = 1e-12
DECIMALS = 9


@frozen
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
    joints = range(given.a.shape[-1])
    candidates = [
        *limit_repairs(given, references),
        *_units(),
        *(Repair(fault, slip.undone) for slip in slips_of(len(joints)) if (fault := _fault_of(slip, given))),
        *_offsets(given, joints),
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


_LENGTHS = (("a", ("a",)), ("d", ("d",)), ("lengths", ("a", "d")))
_ANGLES = (
    ("alpha", ("alpha",)),
    ("offset", ("offset",)),
    ("limits", ("lower", "upper")),
    ("angles", ("alpha", "offset", "lower", "upper")),
)
_MISREAD_LENGTHS = (
    (1000.0, "metres_as_millimetres"),
    (0.001, "millimetres_as_metres"),
)
_MISREAD_ANGLES = (
    (1 / RADIANS_PER_DEGREE, "radians_as_degrees"),
    (RADIANS_PER_DEGREE, "degrees_as_radians"),
)


def _units() -> list[Repair]:
    return [
        Repair(fact("wrong_unit", entries=entries, misread=misread), times(factor, columns))
        for places, misreadings in ((_LENGTHS, _MISREAD_LENGTHS), (_ANGLES, _MISREAD_ANGLES))
        for entries, columns in places
        for factor, misread in misreadings
    ]


_SHIFTED = {SHAPE: "rows", ("a",): "a", ("alpha",): "alpha", ("d",): "d"}


def _fault_of(slip: Slip, given: Tables) -> Fault | None:
    """The fault that a slip of a pen is; None for those that are free numbers, or too many to be tried in pairs."""
    joints = [row + 1 for row in slip.rows]
    joint = joints[0] if len(joints) == 1 else None
    if slip.code == "one_alpha_negated":
        alpha = float(np.degrees(given.alpha[0, slip.rows[0]]))
        return fact("wrong_alpha_sign", joint=joint, given_deg=alpha, fits_deg=-alpha)
    if slip.code == "direction_reversed":
        return fact("reversed_direction", joint=joint)
    if slip.code == "other_convention":
        return fact("wrong_convention", read_as="modified" if given.modified[0] else "standard")
    if slip.code == "a_and_d_swapped":
        return fact("swapped_entries", joint=joint)
    if slip.code == "limits_exchanged":
        return fact("swapped_limits", first=joints[0], second=joints[1])
    if slip.code == "rows_exchanged" and slip.columns == SHAPE:
        return fact("swapped_rows", first=joints[0], second=joints[1])
    if slip.code == "rows_shifted" and slip.columns in _SHIFTED:
        return fact("shifted_rows", entries=_SHIFTED[slip.columns], toward="up" if slip.amount > 0 else "down")
    return None


def _offsets(given: Tables, joints: range) -> list[Repair]:
    found = []
    for j in joints:
        before = float(np.degrees(given.offset[0, j]))
        for step in (90.0, -90.0, 180.0):
            after = 180.0 - (180.0 - before - step) % 360.0
            fault = fact("wrong_offset", joint=j + 1, given_deg=before, fits_deg=after)
            found.append(Repair(fault, _added("offset", j, np.radians(step))))
    return found


def _added(column: str, joint: int, amount: float) -> Change:
    return lambda tables: tables.with_column(column, [joint], getattr(tables, column)[:, [joint]] + amount)


def _limits(joints: range) -> list[Repair]:
    found = []
    for row in (*joints, None):
        changes = {
            "crossed": swapped(row, SIDES),
            "signs_swapped": _signs_swapped(row),
            "lower_sign": times(-1.0, ("lower",), row),
            "upper_sign": times(-1.0, ("upper",), row),
        }
        joint = None if row is None else row + 1
        found += [Repair(fact("wrong_limits", joint=joint, fault=fault), change) for fault, change in changes.items()]
    return found


def _signs_swapped(row: int | None) -> Change:
    return lambda tables: times(-1.0, SIDES, row)(swapped(row, SIDES)(tables))
