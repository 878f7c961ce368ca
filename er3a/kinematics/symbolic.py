"""Transforms of a table's links and of the whole arm as polynomials: sines, cosines, and the d of prismatic joints.

Each entry is a sum of products, so no algebra system is needed. Angles of parallel axes are added: for ``Rz(a) L
Rz(b)`` with a link L that does not rotate, the rotation is ``Rz(a + b)``, so sums appear as textbooks write them (c23
for upper arm and forearm). A prismatic joint along the same direction does not change that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from er3a.geometry.transforms import translation
from er3a.kinematics.chain import ALONG_Z, TO_NEXT_AXIS, constant_links, link_parts
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot

ROUNDING = 1e-12  # a factor below this is the rounding of a right angle
Factor = tuple[str, tuple[int, ...]]  # "c" or "s" of the sum of these rows' angles, or "d" of a row; rows from 1
Product = tuple[Factor, ...]
Polynomial = dict[Product, float]
Entries = list[list[Polynomial]]


@dataclass(frozen=True)
class SymbolicTransform:
    """A transform (4, 4) whose entries are polynomials: coefficient by product of factors; lengths in m."""

    entries: tuple[tuple[Mapping[Product, float], ...], ...]

    def at(self, moved: Reals) -> Reals:
        """The transform at values of what moves.

        Parameters
        ----------
        moved : (m,), of each row theta, rad, or d, m

        Returns
        -------
        T : (4, 4), m
        """
        return np.array([[_value(entry, moved) for entry in row] for row in self.entries])


def link_transforms(robot: Robot) -> tuple[SymbolicTransform, ...]:
    """Each row of the table as a symbolic transform.

    Parameters
    ----------
    robot : m rows

    Returns
    -------
    transforms : m, ``Rz Tz Tx Rx`` (standard) or ``Rx Tx Rz Tz`` (modified), m
    """
    parts, found = link_parts(robot), []
    for k in range(robot.rows):
        moved = _product(_motion(robot, k), _constant(_without_d(robot, k) @ parts[k + 1, ALONG_Z]))
        if robot.convention == "standard":
            row = _product(moved, _constant(parts[k + 1, TO_NEXT_AXIS]))
        else:
            row = _product(_constant(parts[k, TO_NEXT_AXIS]), moved)
        found.append(_frozen(row))
    return tuple(found)


def arm_transform(robot: Robot) -> SymbolicTransform:
    """The symbolic transform from the tool to the base frame, base and tool included.

    Parameters
    ----------
    robot : m rows

    Returns
    -------
    transform : its entries are sums of products of sines and cosines of sums of angles, and of d
    """
    links = constant_links(robot)
    whole = _constant(links[0])
    group: tuple[int, ...] = ()  # rows that turn about parallel axes, whose rotation still follows whole on the right
    for k in range(robot.rows):
        if robot.sliding[k]:  # along the group's axes: the order of the two does not matter
            whole = _product(whole, _motion(robot, k))
        else:
            group += (k + 1,)
        link = _constant(_without_d(robot, k) @ links[k + 1])
        last = k == robot.rows - 1
        if not last and np.abs(links[k + 1][:3, :3] - np.eye(3)).max() < ROUNDING:
            whole = _product(whole, _shifted(_product(_rotation(group), link)))
        else:
            whole = _product(_product(whole, _rotation(group)), link)
            group = ()
    return _frozen(whole)


def _motion(robot: Robot, k: int) -> Entries:
    """What row k does: a rotation about z, or a shift along it by the table's d."""
    if not robot.sliding[k]:
        return _rotation((k + 1,))
    entries = _constant(np.eye(4))
    entries[2][3] = {(("d", (k + 1,)),): 1.0}
    return entries


def _without_d(robot: Robot, k: int) -> Reals:
    """Takes back the table's d where it is what moves."""
    return translation(0, 0, -robot.d[k] if robot.sliding[k] else 0.0)


def _rotation(joints: tuple[int, ...]) -> Entries:
    """A rotation about z by the sum of some rows' angles."""
    entries = _constant(np.eye(4))
    if not joints:
        return entries
    c, s = ("c", joints), ("s", joints)
    entries[0][0], entries[0][1] = {(c,): 1.0}, {(s,): -1.0}
    entries[1][0], entries[1][1] = {(s,): 1.0}, {(c,): 1.0}
    return entries


def _constant(matrix: Reals) -> Entries:
    """A matrix of numbers as polynomials, rounding left out."""
    return [[{(): float(value)} if abs(value) > ROUNDING else {} for value in row] for row in matrix]


def _shifted(entries: Entries) -> Entries:
    """The same shift without the rotation."""
    return [[entries[r][c] if c == 3 else ({(): 1.0} if r == c else {}) for c in range(4)] for r in range(4)]


def _product(left: Entries, right: Entries) -> Entries:
    """The product of two matrices of polynomials."""
    return [[_sum_of_products(left[r], [row[c] for row in right]) for c in range(4)] for r in range(4)]


def _sum_of_products(row: list[Polynomial], column: list[Polynomial]) -> Polynomial:
    """A row times a column, factors of each product in one order."""
    total: Polynomial = {}
    for a, b in zip(row, column):
        for one, x in a.items():
            for other, y in b.items():
                key = tuple(sorted(one + other, key=lambda factor: (factor[1], factor[0])))
                total[key] = total.get(key, 0.0) + x * y
    return {key: value for key, value in total.items() if abs(value) > ROUNDING}


def _frozen(entries: Entries) -> SymbolicTransform:
    """Entries that can't be changed."""
    return SymbolicTransform(tuple(tuple(row) for row in entries))


def _value(entry: Mapping[Product, float], moved: Reals) -> float:
    """A polynomial's value at angles (rad) and shifts (m) of the rows."""
    total = 0.0
    for product, coefficient in entry.items():
        for function, rows in product:
            value = sum(moved[k - 1] for k in rows)
            coefficient *= value if function == "d" else np.cos(value) if function == "c" else np.sin(value)
        total += coefficient
    return float(total)
