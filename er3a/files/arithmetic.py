"""Arithmetic as tables print it: ``θ2 − 90°``, ``25*10^-3``, ``deg2rad(30)``. It is parsed, nothing is executed."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

LONGEST = 200  # characters of an expression
DEEPEST = 20  # brackets within each other, and names that are given by other names
UNITS = {"mm": "mm", "毫米": "mm", "cm": "cm", "m": "m", "米": "m", "in": "in", "inch": "in"}
UNITS |= {"°": "deg", "deg": "deg", "degs": "deg", "degree": "deg", "degrees": "deg", "度": "deg", "rad": "rad"}
UNITS |= {"rads": "rad", "radian": "rad", "radians": "rad", "metre": "m", "meter": "m", "metres": "m", "meters": "m"}
_RADIANS = {"deg2rad", "radians", "d2r", "dtr", "torad"}
_DEGREES = {"rad2deg", "degrees"}
_FUNCTIONS: dict[str, Callable[..., float]] = {
    "sqrt": math.sqrt,
    "atan": math.atan,
    "arctan": math.atan,
    "atan2": math.atan2,
    "arctan2": math.atan2,
    "asin": math.asin,
    "acos": math.acos,
    "sin": math.sin,
    "cos": math.cos,
}
_TOKEN = re.compile(
    r"\s*(?:(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)|([^\W\d][\w.]*'?|°)|(\*\*|[-+*/^(),\[\]]))"
)
_SIGNS = str.maketrans("−–—﹣∗⋅·×∕÷º˚∘◦⍺", "----****//°°°°α")
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺", "0123456789-+")


@dataclass(frozen=True)
class CellAmount:
    """A number, the unit that it is said to be in ("" if none), and how often each variable is added to it."""

    number: float
    unit: str = ""
    variables: Mapping[str, float] = field(default_factory=dict)


def plain(text: str) -> str:
    """A text in plain letters and signs: full-width, mathematical and lowered ones become the usual.

    Parameters
    ----------
    text : raised digits become a power, so that 10⁻³ is no 10-3

    Returns
    -------
    text : with ``-``, ``*``, ``/`` and ``°`` for all their forms; nothing else is changed
    """
    text = re.sub("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺]+", lambda found: "^" + found[0].translate(_RAISED), text.translate(_SIGNS))
    return unicodedata.normalize("NFKC", text).translate(_SIGNS).replace("\u200b", "").replace("⁄", "/")


def amount_of(text: str, given: Mapping[str, str] | None = None) -> CellAmount:
    """What an expression amounts to.

    Parameters
    ----------
    text : numbers, ``pi``, names, ``+ - * / ^``, brackets, units; angles converted by ``deg2rad`` and the like
    given : expressions by the names that they have; all other names are variables

    Returns
    -------
    amount : in its own unit; ``pi`` is one of radians

    Raises
    ------
    ValueError
        with what can't be read, in words
    """
    return _Reader(plain(text), given or {}, 0).all()


def name_of(text: str) -> str:
    """A symbol as its definition and its uses have it in common: ``d_{1}``, ``d(1)`` and ``d₁`` are ``d1``."""
    return re.sub(r"[\s_{}()\[\]]", "", plain(text))


class _Reader:
    """One expression; ``depth`` counts names that led here."""

    def __init__(self, text: str, given: Mapping[str, str], depth: int):
        if len(text) > LONGEST or text.count("(") + text.count("[") > DEEPEST or depth > DEEPEST:
            raise ValueError("is too long or too deep")
        self.given, self.depth, self.text = given, depth, text
        self.tokens: list[tuple[str, str]] = []
        place, text = 0, text.rstrip()
        while place < len(text):
            found = _TOKEN.match(text, place)
            if found is None:
                raise ValueError("is not a number or an expression")
            kind = "number" if found[1] else "name" if found[2] else "sign"
            self.tokens.append((kind, found[1] or found[2] or found[3].replace("**", "^")))
            place = found.end()
        self.place = 0

    def all(self) -> CellAmount:
        """The amount of the whole text."""
        found = self.sum()
        if self.place < len(self.tokens):
            raise ValueError("is not a number or an expression")
        if not math.isfinite(found.number):
            raise ValueError("is no finite number")
        return found

    def peek(self) -> str:
        return self.tokens[self.place][1] if self.place < len(self.tokens) else ""

    def kind(self) -> str:
        return self.tokens[self.place][0] if self.place < len(self.tokens) else ""

    def take(self) -> str:
        token = self.peek()
        self.place += 1
        return token

    def sum(self) -> CellAmount:
        found = self.product()
        while self.peek() in ("+", "-"):
            sign = 1 if self.take() == "+" else -1
            other = self.product()
            if found.unit and other.unit and found.unit != other.unit:
                raise ValueError(_two_units(found.unit, other.unit))
            names = {*found.variables, *other.variables}
            both = {each: found.variables.get(each, 0) + sign * other.variables.get(each, 0) for each in names}
            found = CellAmount(found.number + sign * other.number, found.unit or other.unit, both)
        return found

    def product(self) -> CellAmount:
        found = self.signed()
        while self.peek() in ("*", "/") or self.kind() in ("number", "name") or self.peek() == "(":
            divides = self.peek() == "/"
            if self.peek() in ("*", "/"):
                self.take()
            found = _quotient(found, self.signed()) if divides else _product(found, self.signed())
        return found

    def signed(self) -> CellAmount:
        sign = 1
        while self.peek() in ("+", "-"):
            sign *= 1 if self.take() == "+" else -1
        return _product(CellAmount(sign), self.power())

    def power(self) -> CellAmount:
        found = self.atom()
        if self.peek() == "^":
            self.take()
            if self.peek() == "°":  # ^° of LaTeX
                return self.with_unit(found)
            sign = -1 if self.peek() == "-" and self.take() else 1
            exponent = _product(CellAmount(sign), self.atom())
            if found.variables or exponent.variables or found.unit or exponent.unit:
                raise ValueError("raises what is no plain number")
            try:
                found = CellAmount(math.pow(found.number, exponent.number))
            except (OverflowError, ValueError):
                raise ValueError("is no finite number") from None
        return self.with_unit(found)

    def with_unit(self, found: CellAmount) -> CellAmount:
        """An amount with the unit that is written after it."""
        if self.kind() == "name" and self.peek().lower() in UNITS and self.peek() not in self.given:
            unit = UNITS[self.take().lower()]
            if found.unit or found.variables:
                raise ValueError(_two_units(found.unit, unit) or f"is a variable in {unit}")
            return CellAmount(found.number, unit)
        return found

    def atom(self) -> CellAmount:
        kind, token = self.kind(), self.take()
        if kind == "number":
            return CellAmount(float(token))
        if token == "(":
            found = self.sum()
            if self.take() != ")":
                raise ValueError("has a bracket that is not closed")
            return found
        if kind == "name":
            return self.named(token)
        raise ValueError("is not a number or an expression")

    def named(self, token: str) -> CellAmount:
        """The amount of a function's value, of pi, of a given name, or of a variable."""
        word = token.rpartition(".")[2]
        low = word.lower()
        if self.peek() in ("(", "[") and low in _RADIANS | _DEGREES | {*_FUNCTIONS}:
            return self.called(low)
        name = token
        if self.peek() in ("(", "[") and not token[-1].isdigit():
            index = self.tokens[self.place + 1 : self.place + 3]
            if len(index) == 2 and index[0][0] == "number" and index[1][1] in (")", "]"):
                self.place += 3
                name = f"{token}{index[0][1]}"
        if low in ("pi", "π", "m_pi"):
            return CellAmount(math.pi, "rad")
        for each in (name, name_of(name)):
            if each in self.given:
                return _Reader(plain(self.given[each]), self.given, self.depth + 1).all()
        if low in _RADIANS:
            return CellAmount(math.radians(1.0), "rad")
        if low in UNITS and UNITS[low] == "deg":
            return CellAmount(math.radians(1.0), "rad")
        return CellAmount(0.0, "", {name_of(name): 1.0})

    def called(self, name: str) -> CellAmount:
        """The value of a function."""
        self.take()
        values = [self.sum()]
        while self.peek() == ",":
            self.take()
            values.append(self.sum())
        if self.take() not in (")", "]") or any(each.variables for each in values):
            raise ValueError(f"has no number in {name}(...)")
        (value, *_rest) = values
        if name in _RADIANS | _DEGREES:
            turn = math.radians(value.number) if name in _RADIANS else math.degrees(value.number)
            return CellAmount(turn, "rad" if name in _RADIANS else "deg")
        numbers = [math.radians(each.number) if each.unit == "deg" else each.number for each in values]
        try:
            return CellAmount(_FUNCTIONS[name](*numbers), "rad" if name[0] == "a" else "")
        except (TypeError, ValueError, OverflowError):
            raise ValueError(f"has no value of {name}(...)") from None


def _two_units(a: str, b: str) -> str:
    if {a, b} == {"deg", "rad"}:
        return "has fractions of pi in a column of degrees"
    return f"is in {a} and in {b}" if a and b else ""


def _product(a: CellAmount, b: CellAmount) -> CellAmount:
    if (a.variables and b.variables) or (a.unit and b.unit):
        raise ValueError(_two_units(a.unit, b.unit) or "multiplies two variables")
    scaled = {name: times * b.number for name, times in a.variables.items()}
    scaled |= {name: times * a.number for name, times in b.variables.items()}
    return CellAmount(a.number * b.number, a.unit or b.unit, scaled)


def _quotient(a: CellAmount, b: CellAmount) -> CellAmount:
    if b.variables or not b.number:
        raise ValueError("divides by a variable or by zero")
    if b.unit and (b.unit != "rad" or a.unit):  # 180/pi is a number
        raise ValueError(_two_units(a.unit, b.unit) or f"divides by {b.unit}")
    return CellAmount(a.number / b.number, a.unit, {name: times / b.number for name, times in a.variables.items()})
