"""The table's transforms as formulas, typeset by the browser, beside their numbers in the zero pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from er3a.kinematics.symbolic import Factor, Product, SymbolicTransform, arm_transform, link_transforms
from er3a.pipeline.viewing.numbers import fixed
from er3a.robots.robot import Robot

COLUMNS = "noap"  # of a transform: the frame's x, y and z axis, and its origin
MM = 1000.0
DIGITS = 6
MOST_PRODUCTS = 200  # of one entry: behind that nobody reads it


@dataclass(frozen=True)
class Formulas:
    """MathML of a table's transforms.

    Attributes
    ----------
    moved : what moves of each row, its theta or its d, by the joints
    links : a matrix in symbols and one in numbers for each link, lengths in mm
    arm : name, formula and value in the zero pose of each entry of the upper three rows; none if one is too long
    longest : products of the arm's longest entry
    """

    moved: list[Markup]
    links: list[Markup]
    arm: list[tuple[Markup, Markup, str]]
    longest: int


def formulas(robot: Robot) -> Formulas:
    """A robot's transforms."""
    zero, arm = np.where(robot.sliding, robot.d, robot.offset), arm_transform(robot)
    values = arm.at(zero)
    longest = max(len(entry) for row in arm.entries for entry in row)
    entries = [(r, c) for c in range(4) for r in range(3)] if longest <= MOST_PRODUCTS else []
    return Formulas(
        moved=[_moved(robot, k) for k in range(robot.rows)],
        links=[_link(k, link, zero) for k, link in enumerate(link_transforms(robot))],
        arm=[
            (
                _math(_sub(COLUMNS[c], "xyz"[r])),
                _math(_sum(arm.entries[r][c], c == 3)),
                fixed(values[r, c] * (MM if c == 3 else 1.0), 2 if c == 3 else 4),
            )
            for r, c in entries
        ],
        longest=longest,
    )


def _moved(robot: Robot, k: int) -> Markup:
    """``θ3 = q2 + q3 + 90°`` or ``d3 = −q3 + 200``: what moves of a row, by the joints."""
    by_joint = robot.direction[k] * (np.eye(robot.rows) if robot.coupling is None else robot.coupling)[k]
    terms = Markup("")
    for n in np.flatnonzero(by_joint):
        terms += _signed(by_joint[n], _sub("q", int(n) + 1), first=not terms)
    if robot.sliding[k]:
        name, shift, unit = "d", float(robot.d[k]) * MM, ""
    else:
        name, shift, unit = "θ", float(np.degrees(robot.offset[k])), "°"
    if shift:
        terms += Markup("<mo>{}</mo><mn>{}{}</mn>").format("+" if shift > 0 else "−", _plain(abs(shift)), unit)
    return _math(Markup("{}<mo>=</mo>{}").format(_sub(name, k + 1), terms))


def _signed(factor: float, symbol: Markup, first: bool) -> Markup:
    sign = "−" if factor < 0 else "" if first else "+"
    shown = Markup("") if abs(factor) == 1 else _number(abs(factor))
    return Markup("{}{}{}").format(Markup("<mo>{}</mo>").format(sign) if sign else "", shown, symbol)


def _link(k: int, link: SymbolicTransform, zero: np.ndarray) -> Markup:
    symbols = [[_sum(entry, c == 3 and r < 3) for c, entry in enumerate(row)] for r, row in enumerate(link.entries)]
    values = link.at(zero) * np.array([[1, 1, 1, MM]] * 3 + [[1] * 4])
    numbers = [[_number(value) for value in row] for row in values]
    return _math(Markup("{}<mo>=</mo>{}<mo>=</mo>{}").format(_sub("A", k + 1), _matrix(symbols), _matrix(numbers)))


def _sum(entry: Mapping[Product, float], is_length: bool) -> Markup:
    terms = Markup("")
    for product, coefficient in entry.items():
        in_mm = is_length and not any(function == "d" for function, _ in product)
        size = abs(coefficient) * (MM if in_mm else 1.0)
        sign = "−" if coefficient < 0 else "+" if terms else ""
        shown = Markup("") if product and abs(size - 1) < 1e-9 and not in_mm else _number(size)
        factors = Markup("<mo>&#8290;</mo>").join(map(_factor, product))
        terms += Markup("{}{}{}").format(Markup("<mo>{}</mo>").format(sign) if sign else "", shown, factors)
    return terms or _number(0.0)


def _factor(factor: Factor) -> Markup:
    return _sub(factor[0], "".join(map(str, factor[1])))


def _sub(letter: str, index: int | str) -> Markup:
    return Markup("<msub><mi>{}</mi><mn>{}</mn></msub>").format(letter, index)


def _number(value: float) -> Markup:
    rounded = round(value, DIGITS) + 0.0
    sign = Markup("<mo>−</mo>") if rounded < 0 else Markup("")
    return Markup("<mrow>{}<mn>{}</mn></mrow>").format(sign, _plain(abs(rounded)))


def _plain(value: float) -> str:
    return f"{value:.{DIGITS}f}".rstrip("0").rstrip(".")


def _matrix(rows: list[list[Markup]]) -> Markup:
    cells = [Markup("").join(Markup("<mtd>{}</mtd>").format(cell) for cell in row) for row in rows]
    lines = Markup("").join(Markup("<mtr>{}</mtr>").format(row) for row in cells)
    return Markup("<mrow><mo>[</mo><mtable>{}</mtable><mo>]</mo></mrow>").format(lines)


def _math(content: Markup) -> Markup:
    return Markup("<math>{}</math>").format(content)
