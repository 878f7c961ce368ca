"""What a table can have wrong."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from er3a.references.quantities import Side

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
)
Faults = tuple[Fault, ...]
"""One fault, or two."""

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
