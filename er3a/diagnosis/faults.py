"""Common faults of tables that have no free number, each as a repair: the change that corrects the faulty table. Faults
with a free number are in :mod:`er3a.diagnosis.fitting`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import ClassVar, Literal

import numpy as np

from er3a.kinematics.table_batch import COLUMNS, Tables
from er3a.numerics.arrays import Reals
from er3a.references.quantities import Limit, PoseOutside, Side, value_at
from er3a.references.reference import Reference, expected_of

FaultKind = Literal[
    "unit",
    "alpha_sign",
    "alpha",
    "swap",
    "rows",
    "limits",
    "shift",
    "offset",
    "direction",
    "convention",
    "length",
    "scale",
    "base",
    "flange",
    "ground",
]
Misread = Literal["metres_as_millimetres", "millimetres_as_metres", "radians_as_degrees", "degrees_as_radians"]
Entries = Literal["a", "d", "lengths", "alpha", "offset", "limits", "angles"]
LimitFault = Literal["crossed", "signs_swapped", "lower_sign", "upper_sign"]
LengthColumn = Literal["a", "d"]


@dataclass(frozen=True)
class WrongUnit:
    """Entries were read in the wrong unit."""

    entries: Entries
    misread: Misread
    kind: ClassVar[FaultKind] = "unit"
    code: Literal["wrong_unit"] = "wrong_unit"


@dataclass(frozen=True)
class WrongAlphaSign:
    """A joint's alpha has the wrong sign."""

    joint: int
    given_deg: float
    fits_deg: float
    kind: ClassVar[FaultKind] = "alpha_sign"
    code: Literal["wrong_alpha_sign"] = "wrong_alpha_sign"


@dataclass(frozen=True)
class WrongAlpha:
    """A joint's alpha is missing (given as 0) or wrong."""

    joint: int
    given_deg: float
    fits_deg: float
    kind: ClassVar[FaultKind] = "alpha"
    code: Literal["wrong_alpha"] = "wrong_alpha"


@dataclass(frozen=True)
class SwappedEntries:
    """a and d are swapped, of one joint or, if None, of all."""

    joint: int | None
    kind: ClassVar[FaultKind] = "swap"
    code: Literal["swapped_entries"] = "swapped_entries"


@dataclass(frozen=True)
class SwappedRows:
    """Two rows of the table are swapped."""

    first: int
    second: int
    kind: ClassVar[FaultKind] = "rows"
    code: Literal["swapped_rows"] = "swapped_rows"


@dataclass(frozen=True)
class SwappedLimits:
    """The limits of two joints are swapped."""

    first: int
    second: int
    kind: ClassVar[FaultKind] = "limits"
    code: Literal["swapped_limits"] = "swapped_limits"


@dataclass(frozen=True)
class ShiftedRows:
    """A column, or all rows, are shifted by one joint."""

    entries: Literal["rows", "a", "alpha", "d"]
    toward: Literal["down", "up"]
    kind: ClassVar[FaultKind] = "shift"
    code: Literal["shifted_rows"] = "shifted_rows"


@dataclass(frozen=True)
class WrongOffset:
    """A joint's offset is missing (given as 0) or wrong."""

    joint: int
    given_deg: float
    fits_deg: float
    kind: ClassVar[FaultKind] = "offset"
    code: Literal["wrong_offset"] = "wrong_offset"


@dataclass(frozen=True)
class ReversedDirection:
    """A joint turns the other way."""

    joint: int
    kind: ClassVar[FaultKind] = "direction"
    code: Literal["reversed_direction"] = "reversed_direction"


@dataclass(frozen=True)
class WrongConvention:
    """The table was read in the other Denavit-Hartenberg convention; ``read_as`` is the one that it was read in."""

    read_as: Literal["standard", "modified"]
    kind: ClassVar[FaultKind] = "convention"
    code: Literal["wrong_convention"] = "wrong_convention"


@dataclass(frozen=True)
class WrongLimits:
    """The limits of one joint, or of all if None, are crossed or have wrong signs."""

    joint: int | None
    fault: LimitFault
    kind: ClassVar[FaultKind] = "limits"
    code: Literal["wrong_limits"] = "wrong_limits"


@dataclass(frozen=True)
class WrongLimit:
    """One of a joint's two limits is wrong."""

    joint: int
    side: Side
    given_deg: float
    fits_deg: float
    kind: ClassVar[FaultKind] = "limits"
    code: Literal["wrong_limit"] = "wrong_limit"


@dataclass(frozen=True)
class WrongLength:
    """A length is missing (given as 0) or wrong."""

    joint: int
    column: LengthColumn
    given_mm: float
    fits_mm: float
    kind: ClassVar[FaultKind] = "length"
    code: Literal["wrong_length"] = "wrong_length"


@dataclass(frozen=True)
class WrongScale:
    """All lengths are wrong by a common factor."""

    factor: float
    kind: ClassVar[FaultKind] = "scale"
    code: Literal["wrong_scale"] = "wrong_scale"


@dataclass(frozen=True)
class BaseElsewhere:
    """The references' base stands elsewhere: ``shift_mm`` and ``turn_deg`` are the arm's in the base's frame."""

    shift_mm: tuple[float, float, float]
    turn_deg: float
    kind: ClassVar[FaultKind] = "base"
    code: Literal["base_elsewhere"] = "base_elsewhere"


@dataclass(frozen=True)
class FlangeElsewhere:
    """The references' flange stands elsewhere than the table's: ``shift_mm`` and ``turn_deg`` in the flange's frame."""

    shift_mm: tuple[float, float, float]
    turn_deg: float = 0.0
    kind: ClassVar[FaultKind] = "flange"
    code: Literal["flange_elsewhere"] = "flange_elsewhere"


@dataclass(frozen=True)
class CountedFromGround:
    """The references count a joint from the ground, as arms with a linkage are sold: the table's joint is theirs plus
    (``sign`` 1) or minus the sum of the joints ``along``."""

    joint: int
    along: tuple[int, ...]
    sign: Literal[1, -1]
    kind: ClassVar[FaultKind] = "ground"
    code: Literal["counted_from_ground"] = "counted_from_ground"


Fault = (
    WrongUnit
    | WrongAlphaSign
    | WrongAlpha
    | SwappedEntries
    | SwappedRows
    | SwappedLimits
    | ShiftedRows
    | WrongOffset
    | ReversedDirection
    | WrongConvention
    | WrongLimits
    | WrongLimit
    | WrongLength
    | WrongScale
    | BaseElsewhere
    | FlangeElsewhere
    | CountedFromGround
)
Faults = tuple[Fault, ...]
"""One fault, or two; of conventions (zeros, directions, base, flange, what joints are counted from) any number."""

CONVENTIONS = WrongOffset, ReversedDirection, BaseElsewhere, FlangeElsewhere, CountedFromGround
"""What can be chosen without changing the arm."""

SIGNIFICANT_GIVEN, SIGNIFICANT_FITTED = 6, 4


def rounded(fault: Fault) -> Fault:
    """The fault with fitted numbers to four digits and given ones to six: equal ones are the same fault."""
    if isinstance(fault, WrongLength):
        return replace(fault, given_mm=_given(fault.given_mm), fits_mm=_fitted(fault.fits_mm))
    if isinstance(fault, WrongOffset | WrongAlpha | WrongAlphaSign | WrongLimit):
        return replace(fault, given_deg=_given(fault.given_deg), fits_deg=_fitted(fault.fits_deg))
    if isinstance(fault, WrongScale):
        return WrongScale(_given(fault.factor))
    return fault


def entry_of(fault: Fault) -> str | None:
    """The one entry of the table that a fault is in, such as "d4", "alpha3", "lower2"; None if it is in several."""
    match fault:
        case WrongLength(joint, column):
            return f"{column}{joint}"
        case WrongOffset(joint):
            return f"offset{joint}"
        case WrongAlpha(joint) | WrongAlphaSign(joint):
            return f"alpha{joint}"
        case ReversedDirection(joint):
            return f"direction{joint}"
        case WrongLimit(joint, side):
            return f"{side}{joint}"
        case WrongLimits(int(joint), "lower_sign" | "upper_sign" as sign):
            return f"{sign.removesuffix('_sign')}{joint}"
    return None


def place_of(fault: Fault) -> str | Fault:
    """The entry that a fault is in; the fault itself if it is in several."""
    return entry_of(fault) or rounded(fault)


def _given(value: float) -> float:
    return _digits(value, SIGNIFICANT_GIVEN)


def _fitted(value: float) -> float:
    return _digits(value, SIGNIFICANT_FITTED)


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
    """All repairs that change the given table (a batch of one).

    Parameters
    ----------
    references : a limit that they contradict is a repair, with the value that they state
    """
    joints = range(given.a.shape[-1])
    candidates = [
        *limit_repairs(given, references),
        *_units(),
        *_signs(given, joints),
        *_swaps(joints),
        *_offsets(given, joints),
        *_directions(joints),
        *_convention(given),
        *_limits(joints),
    ]
    return [repair for repair in candidates if _differs(repair.apply(given), given)]


def limit_repairs(given: Tables, references: Sequence[Reference]) -> list[Repair]:
    """Each limit that references contradict, at the middle of what they leave open; where they state no limit, at the
    farthest pose that they show."""
    found = []
    for joint in range(given.a.shape[-1]):
        for side in SIDES:
            now = float(np.degrees(getattr(given, side)[0, joint]))
            fits = limit_stated(joint, side, now, references)
            if fits is not None:
                fault = WrongLimit(joint + 1, side, now, fits)
                found.append(Repair(fault, _set(side, joint, np.radians(fits)), free=True))
    return found


def limit_stated(joint: int, side: Side, now: float, references: Sequence[Reference]) -> float | None:
    """What references say (deg) about a limit that is ``now``; None if they don't contradict it."""
    stated = [r for r in references if r.quantity == Limit(joint + 1, side) and r.expected is not None]
    if stated:
        expected, uncertainty = expected_of(stated)
        met = (np.abs(expected - now) <= uncertainty).all()
        middle = (np.max(expected - uncertainty) + np.min(expected + uncertainty)) / 2
        return None if met else round(float(middle), DECIMALS)
    shown = [value_at(r.quantity.pose, joint + 1) for r in references if isinstance(r.quantity, PoseOutside)]
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
        Repair(WrongUnit(entries, misread), _scaled(columns, factor))
        for places, misreadings in ((_LENGTHS, _MISREAD_LENGTHS), (_ANGLES, _MISREAD_ANGLES))
        for entries, columns in places
        for factor, misread in misreadings
    ]


def _scaled(columns: tuple[str, ...], factor: float) -> Change:
    return lambda tables: replace(tables, **{name: getattr(tables, name) * factor for name in columns})


def _signs(given: Tables, joints: range) -> list[Repair]:
    found = []
    for j in joints:
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


def _swaps(joints: range) -> list[Repair]:
    found = [Repair(SwappedEntries(j + 1), _columns_swapped([j])) for j in joints]
    found.append(Repair(SwappedEntries(None), _columns_swapped(list(joints))))
    for i, j in combinations(joints, 2):
        order = list(joints)
        order[i], order[j] = j, i
        found.append(Repair(SwappedRows(i + 1, j + 1), _reordered(("a", "alpha", "d"), order)))
        found.append(Repair(SwappedLimits(i + 1, j + 1), _reordered(("lower", "upper"), order)))
    for entries, columns in _SHIFTS:
        found.append(Repair(ShiftedRows(entries, "down"), _reordered(columns, list(np.roll(joints, -1)))))
        found.append(Repair(ShiftedRows(entries, "up"), _reordered(columns, list(np.roll(joints, 1)))))
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
            found.append(Repair(WrongOffset(j + 1, before, after), _offset_moved(j, np.radians(step))))
    return found


def _offset_moved(joint: int, angle: float) -> Change:
    return lambda tables: tables.with_column("offset", [joint], tables.offset[:, [joint]] + angle)


def _directions(joints: range) -> list[Repair]:
    return [Repair(ReversedDirection(j + 1), _negated("direction", j)) for j in joints]


def _convention(given: Tables) -> list[Repair]:
    fault = WrongConvention("modified" if given.modified[0] else "standard")
    return [Repair(fault, lambda tables: replace(tables, modified=~tables.modified))]


_LIMIT_FAULTS: tuple[tuple[LimitFault, Callable[[Reals, Reals], tuple[Reals, Reals]]], ...] = (
    ("crossed", lambda low, high: (high, low)),
    ("signs_swapped", lambda low, high: (-high, -low)),
    ("lower_sign", lambda low, high: (-low, high)),
    ("upper_sign", lambda low, high: (low, -high)),
)


def _limits(joints: range) -> list[Repair]:
    places: list[tuple[list[int], int | None]] = [([j], j + 1) for j in joints]
    return [
        Repair(WrongLimits(joint, fault), _limits_changed(changed, change))
        for changed, joint in (*places, (list(joints), None))
        for fault, change in _LIMIT_FAULTS
    ]


def _limits_changed(joints: list[int], change: Callable[[Reals, Reals], tuple[Reals, Reals]]) -> Change:
    def apply(tables: Tables) -> Tables:
        low, high = change(tables.lower[:, joints], tables.upper[:, joints])
        return tables.with_column("lower", joints, low).with_column("upper", joints, high)

    return apply
