"""Transforms of a table's links and of the whole arm as polynomials in sines and cosines of the table's angles.

Each entry is a sum of products, so no algebra system is needed. Joints whose axes are parallel turn as one: of
``Rz(a) L Rz(b)`` with a link L that does not turn, the rotation is ``Rz(a + b)``, so sums of angles appear where a
person writes them (c23 for the upper arm and forearm).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from er3a.errors import Er3aError
from er3a.kinematics.chain import ALONG_Z, TO_NEXT_AXIS, constant_links, link_parts
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot

ROUNDING = 1e-12
Factor = tuple[str, tuple[int, ...]]  # "c" or "s" of the sum of these joints' angles, joints from 1
Product = tuple[Factor, ...]
Polynomial = dict[Product, float]
Entries = list[list[Polynomial]]


@dataclass(frozen=True)
class SymbolicTransform:
    """A transform (4, 4) whose entries are polynomials: coefficient by product of sines and cosines; lengths in m."""

    entries: tuple[tuple[Mapping[Product, float], ...], ...]

    def at(self, theta: Reals) -> Reals:
        """The transform (4, 4), in m, at angles of the table (n,), in rad."""
        return np.array([[_value(entry, theta) for entry in row] for row in self.entries])


def link_transforms(robot: Robot) -> tuple[SymbolicTransform, ...]:
    """Each row of the table as a transform: ``Rz Tz Tx Rx`` (standard) or ``Rx Tx Rz Tz`` (modified).

    Raises
    ------
    Er3aError
        for an arm with a joint that slides
    """
    _needs_turning(robot)
    parts, found = link_parts(robot), []
    for k in range(robot.rows):
        turn, along = _rotation((k + 1,)), _constant(parts[k + 1, ALONG_Z])
        if robot.convention == "standard":
            row = _product(_product(turn, along), _constant(parts[k + 1, TO_NEXT_AXIS]))
        else:
            row = _product(_constant(parts[k, TO_NEXT_AXIS]), _product(turn, along))
        found.append(_frozen(row))
    return tuple(found)


def arm_transform(robot: Robot) -> SymbolicTransform:
    """From the tool to the base frame, base and tool included.

    Raises
    ------
    Er3aError
        for an arm with a joint that slides
    """
    _needs_turning(robot)
    links = constant_links(robot)
    whole, group = _constant(links[0]), [1]
    for k in range(1, len(links)):
        last = k == len(links) - 1
        if not last and np.abs(links[k][:3, :3] - np.eye(3)).max() < ROUNDING:
            whole = _product(whole, _shifted(_product(_rotation(tuple(group)), _constant(links[k]))))
            group.append(k + 1)
        else:
            whole = _product(_product(whole, _rotation(tuple(group))), _constant(links[k]))
            group = [k + 1]
    return _frozen(whole)


def _needs_turning(robot: Robot) -> None:
    if robot.sliding.any():
        raise Er3aError("symbolic transforms are made of arms whose joints all turn; this one has a joint that slides")


def _rotation(joints: tuple[int, ...]) -> Entries:
    c, s = ("c", joints), ("s", joints)
    entries = _constant(np.eye(4))
    entries[0][0], entries[0][1] = {(c,): 1.0}, {(s,): -1.0}
    entries[1][0], entries[1][1] = {(s,): 1.0}, {(c,): 1.0}
    return entries


def _constant(matrix: Reals) -> Entries:
    return [[{(): float(value)} if abs(value) > ROUNDING else {} for value in row] for row in matrix]


def _shifted(entries: Entries) -> Entries:
    """The same shift without the rotation."""
    return [[entries[r][c] if c == 3 else ({(): 1.0} if r == c else {}) for c in range(4)] for r in range(4)]


def _product(left: Entries, right: Entries) -> Entries:
    return [[_sum_of_products(left[r], [row[c] for row in right]) for c in range(4)] for r in range(4)]


def _sum_of_products(row: list[Polynomial], column: list[Polynomial]) -> Polynomial:
    total: Polynomial = {}
    for a, b in zip(row, column):
        for one, x in a.items():
            for other, y in b.items():
                key = tuple(sorted(one + other, key=lambda factor: (factor[1], factor[0])))
                total[key] = total.get(key, 0.0) + x * y
    return {key: value for key, value in total.items() if abs(value) > ROUNDING}


def _frozen(entries: Entries) -> SymbolicTransform:
    return SymbolicTransform(tuple(tuple(row) for row in entries))


def _value(entry: Mapping[Product, float], theta: Reals) -> float:
    total = 0.0
    for product, coefficient in entry.items():
        for function, joints in product:
            angle = sum(theta[k - 1] for k in joints)
            coefficient *= np.cos(angle) if function == "c" else np.sin(angle)
        total += coefficient
    return float(total)
