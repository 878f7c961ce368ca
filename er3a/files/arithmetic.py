"""Arithmetic as tables print it: ``θ2 − 90°``, ``25*10^-3``, ``deg2rad(30)``. It is parsed, nothing is executed."""

from __future__ import annotations

import ast
import math
import re
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import field, replace

from er3a.by_value import frozen

LONGEST = 200  # characters of an expression
TWO_VALUES = "two values"
"""In place of the value of a name that has several."""
DEEPEST = 20  # brackets within each other, and names that are given by other names


def words_of(text: str) -> dict[str, str]:
    """What words mean.

    Parameters
    ----------
    text : pairs such as ``metre=m``, or words without a meaning, with blanks between them
    """
    return {word: meaning for word, _, meaning in (pair.partition("=") for pair in text.split())}


UNITS = words_of(
    "mm=mm 毫米=mm cm=cm dm=dm ft=ft gon=gon m=m 米=m metre=m meter=m metres=m meters=m in=in inch=in "
    "°=deg deg=deg degs=deg degree=deg degrees=deg grad=deg 度=deg rad=rad rads=rad radian=rad radians=rad"
)
_RADIANS = {"deg2rad", "degtorad", "deg_to_rad", "radians", "toradians", "d2r", "dtr", "torad"}
_DEGREES = {"rad2deg", "degrees"}
_FUNCTIONS: dict[str, Callable[..., float]] = {
    name: getattr(math, name.replace("arc", "a"))
    for name in words_of("sqrt atan arctan atan2 arctan2 asin acos sin cos")
}
CALLED = _RADIANS | _DEGREES | {*_FUNCTIONS}
"""The functions that expressions may call."""
_TOKEN = re.compile(
    r"\s*(?:(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)|([^\W\d][\w.]*'?|°)|(\*\*|[-+*/^(),\[\]]))\s*"
)
_NOTED = re.compile(r"(?<![\w.])\d[\d.]*\s*[(\[]|^\s*[-+]?(?!10\^)[\d.]+\s*\^\s*\d+\s*$")
"""A number with a footnote or its last digits' error, ``72²`` or ``72.5(2)``: neither a power nor a product."""
_PI = re.compile(r"π|(?:(?:m|frac|eigen|math|const)_)?pi(?:_([24]))?")
_INDEX = re.compile(r"[(\[]\s*(\d+)\s*(?:,\s*[01]\s*)?[)\]]\s*")
_NONE = "is not a number or an expression"
_SIGNS = str.maketrans("−–—﹣∗⋅·×∕÷º˚∘◦⍺", "----****//°°°°α")
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺", "0123456789-+")


@frozen
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
    text = re.sub(r"(\d)(?=[¼-¾⅐-⅞])", r"\1 ", text)  # 23½ is no 231/2
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
    return _amount(plain(text), given or {}, 0)


def name_of(text: str) -> str:
    """A symbol as its definition and its uses have it in common: ``d_{1}``, ``d(1)`` and ``d₁`` are ``d1``."""
    return re.sub(r"[\s_{}()\[\]]", "", plain(text))


def _amount(text: str, given: Mapping[str, str], depth: int) -> CellAmount:
    """The amount of an expression; ``depth`` counts names that led here."""
    if len(text) > LONGEST or text.count("(") + text.count("[") > DEEPEST or depth > DEEPEST:
        raise ValueError("is too long or too deep")
    if _NOTED.search(text):
        raise ValueError(_NONE)
    values: dict[str, CellAmount | str] = {}
    expression = _in_python(re.sub(r"\^\s*°", "°", text), given, depth, values)
    try:
        found = _value(ast.parse(expression, mode="eval").body, values)
    except SyntaxError:
        raise ValueError(_NONE) from None
    if not math.isfinite(found.number):
        raise ValueError("is no finite number")
    return found


def _in_python(text: str, given: Mapping[str, str], depth: int, values: dict[str, CellAmount | str]) -> str:
    """An expression as Python would write it, with a name for each number and symbol, whose values are filled in.

    A unit follows what it is of: that is ``@``, which binds as a product does.
    """
    made, place, follows, calls = "", 0, False, False
    while place < len(text):
        found = _TOKEN.match(text, place)
        if found is None:
            raise ValueError(_NONE)
        place, (number, word, sign) = found.end(), found.groups()
        if sign in ("(", "["):
            made += "*(" if follows and not calls else "("
            follows = calls = False
        elif sign:
            made += {"^": "**", "]": ")"}.get(sign, sign)
            follows = sign in (")", "]")
        else:
            is_unit = follows and word and word.lower() in UNITS and word not in given
            made += "@" if is_unit else "*" if follows else ""
            low = (word or "").rpartition(".")[2].lower()
            calls = text[place : place + 1] in ("(", "[") and low in CALLED
            value: CellAmount | str = low
            if number and follows:  # 1 070, 0..90: no product
                raise ValueError(_NONE)
            if number or is_unit:
                value = CellAmount(float(number)) if number else CellAmount(1.0, UNITS[word.lower()])
            elif not calls:
                if not word[-1].isdigit() and (index := _INDEX.match(text, place)):
                    word, place = f"{word}{index[1]}", index.end()
                value = _named(word, low, given, depth)
            name = f"v{len(values)}"
            values[name], follows = value, True
            made += name
    return made


def _named(word: str, low: str, given: Mapping[str, str], depth: int) -> CellAmount:
    """The amount of pi, of a given name, of a degree as programs have it, or of a variable."""
    if found := _PI.fullmatch(low):
        return CellAmount(math.pi / int(found[1] or 1), "rad")
    for each in (word, name_of(word)):
        if each in given:
            if given[each] == TWO_VALUES:
                raise ValueError(f"holds {each}, which has two values")
            try:
                return _amount(plain(given[each]), given, depth + 1)
            except ValueError as error:
                if depth:
                    raise
                raise ValueError(f"holds {each} = {given[each]}, which {error}") from None
    if low in _RADIANS or UNITS.get(low) == "deg":
        return CellAmount(math.radians(1.0), "rad")
    return CellAmount(0.0, "", {name_of(word): 1.0})


def _value(node: ast.expr, values: Mapping[str, CellAmount | str]) -> CellAmount:
    """What a part of a parsed expression amounts to."""
    if isinstance(node, ast.Name) and isinstance(found := values[node.id], CellAmount):
        return found
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        return _called(str(values[node.func.id]), [_value(each, values) for each in node.args])
    if isinstance(node, ast.UnaryOp):
        return _product(CellAmount(-1.0 if isinstance(node.op, ast.USub) else 1.0), _value(node.operand, values))
    if not isinstance(node, ast.BinOp):
        raise ValueError(_NONE)
    a, b = _value(node.left, values), _value(node.right, values)
    if isinstance(node.op, ast.MatMult) and a.variables:
        raise ValueError(f"is a variable in {b.unit}")
    if isinstance(node.op, ast.Mult | ast.MatMult):
        return _product(a, b)
    if isinstance(node.op, ast.Div):
        return _quotient(a, b)
    if isinstance(node.op, ast.Pow):
        return _power(a, b)
    return _sum(a, b, -1 if isinstance(node.op, ast.Sub) else 1)


def _called(name: str, values: list[CellAmount]) -> CellAmount:
    """The value of a function."""
    if values and name in _RADIANS:
        return replace(values[0], number=math.radians(values[0].number), unit="rad")
    if not values or any(each.variables for each in values):
        raise ValueError(f"has no number in {name}(...)")
    if name in _DEGREES:
        return CellAmount(math.degrees(values[0].number), "deg")
    numbers = [math.radians(each.number) if each.unit == "deg" else each.number for each in values]
    try:
        return CellAmount(_FUNCTIONS[name](*numbers), "rad" if name[0] == "a" else "")
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"has no value of {name}(...)") from None


def _sum(a: CellAmount, b: CellAmount, sign: int) -> CellAmount:
    if {a.unit, b.unit} == {"deg", "rad"}:  # each is said with its own unit
        a, b = (replace(x, number=math.radians(x.number), unit="rad") if x.unit == "deg" else x for x in (a, b))
    if a.unit and b.unit and a.unit != b.unit:
        raise ValueError(f"is in {a.unit} and in {b.unit}")
    names = {*a.variables, *b.variables}
    both = {each: a.variables.get(each, 0) + sign * b.variables.get(each, 0) for each in names}
    return CellAmount(a.number + sign * b.number, a.unit or b.unit, both)


def _power(a: CellAmount, b: CellAmount) -> CellAmount:
    if a.variables or b.variables or a.unit or b.unit:
        raise ValueError("raises what is no plain number")
    try:
        return CellAmount(math.pow(a.number, b.number))
    except (OverflowError, ValueError):
        raise ValueError("is no finite number") from None


def _product(a: CellAmount, b: CellAmount) -> CellAmount:
    if a.unit and b.unit and not (a.unit == "rad" and b == CellAmount(1.0, "rad")):  # pi/2 rad
        raise ValueError(f"is in {a.unit} and in {b.unit}")
    if a.variables and b.variables:
        raise ValueError("multiplies two variables")
    scaled = {name: times * b.number for name, times in a.variables.items()}
    scaled |= {name: times * a.number for name, times in b.variables.items()}
    return CellAmount(a.number * b.number, a.unit or b.unit, scaled)


def _quotient(a: CellAmount, b: CellAmount) -> CellAmount:
    if b.variables or not b.number:
        raise ValueError("divides by a variable or by zero")
    if b.unit and (b.unit != "rad" or a.unit):  # 180/pi is a number
        raise ValueError(f"divides by {b.unit}")
    return CellAmount(a.number / b.number, a.unit, {name: times / b.number for name, times in a.variables.items()})
