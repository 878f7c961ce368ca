"""Joint values and the poses that a controller shows for them, as arrays, with the digits that they were written to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace

import numpy as np

from er3a.by_value import ByValue, frozen
from er3a.numerics.arrays import Flags, Integers, Reals

ROUNDED = 12**-0.5  # standard deviation of rounding, in last digits


def spread(count: int, most: int) -> Integers:
    """Numbers of some of many rows, evenly over all.

    Parameters
    ----------
    count : of rows, from 0; most : how many are taken
    """
    return np.unique(np.linspace(0, max(count - 1, 0), min(count, most)).astype(np.int64))


@frozen
class Pairs(ByValue):
    """N poses of a controller.

    Attributes
    ----------
    q : (N, n), rad or m, as the columns say
    xyz : (N, 3), m, as the columns say
    turns : rotations (N, 3, 3) by the form of orientation that they were read in, the likeliest first; empty if the
        controller's orientations are not given
    named : how many of these forms the columns' names allow; the others are tried because names can be wrong
    q_digit, xyz_digit : (N, n) and (N, 3), rad or m, the last digit of each number, or what broadcasts to it
    turn_digit : (N, 1), of orientations, rad, or what broadcasts to it
    lines : (N,), where each pose was read
    notes : what was assumed, as (code, word)
    """

    q: Reals
    xyz: Reals
    turns: Mapping[str, Reals] = field(default_factory=dict)
    named: int = 1
    q_digit: Reals = field(default_factory=lambda: np.zeros(1))
    xyz_digit: Reals = field(default_factory=lambda: np.zeros(3))
    turn_digit: Reals | float = 0.0
    lines: Integers = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    notes: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        sizes = {"q_digit": self.q.shape, "xyz_digit": self.xyz.shape, "turn_digit": (len(self.q), 1)}
        for name, size in sizes.items():
            object.__setattr__(self, name, np.broadcast_to(getattr(self, name), size))

    def __len__(self) -> int:
        return len(self.q)

    @property
    def forms(self) -> tuple[str, ...]:
        """The forms of orientation, the likeliest first; one empty name without orientations."""
        return tuple(self.turns) or ("",)

    def some(self, rows: Integers | Flags | slice) -> Pairs:
        """Some of the poses.

        Parameters
        ----------
        rows : numbers from 0, or (N,) bool
        """
        turns = {form: R[rows] for form, R in self.turns.items()}
        arrays = ("q", "xyz", "q_digit", "xyz_digit", "turn_digit", "lines")
        return replace(self, turns=turns, **{name: getattr(self, name)[rows] for name in arrays})
