"""The tables that meet requirements, with some entries free: many starts are led there at once.

Damped Gauss-Newton steps go from each start towards what is asked, to just within the half-widths, so that hundreds of
starts cost as much as a few one by one. Entries can be held. Extremes over the joint limits are followed where they
were attained last, and sought afresh where that decides. Standard deviations bound the likelihood: chi squared may
exceed its minimum by 3.84, the 95 % profile interval of one number [1]_.

References
----------
.. [1] A. C. Davison, *Statistical Models*, Cambridge University Press 2003, section 4.4.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from er3a.comparison.entries import Entry, shifted
from er3a.diagnosis.fitting import arm_lengths, lowered
from er3a.identifiability.requirements import Asked
from er3a.kinematics.table_batch import Tables
from er3a.numerics.arrays import Flags, Integers, Reals

PROFILE = 1.959963984540054  # its square is 3.84, the 95 % point of chi squared with one degree of freedom
MET = 1e-3  # of a half-width
NEAR = 0.05  # of a half-width, by which an extreme that was followed may be missed once it is sought afresh
INSIDE = 1.0 - MET / 2
MIN_M = 1.0
PASSES, DAMPING = 30, 1e-2
CHUNK = 96  # starts that are led on at once
FOLLOWED = 8  # times that extremes are sought afresh


def largest_length(table: Tables) -> float:
    """How far lengths are searched around the table's.

    Parameters
    ----------
    table : a batch of one

    Returns
    -------
    length : m, all its lengths together, at least ``MIN_M``
    """
    return max(float(arm_lengths(table)[0]), MIN_M)


class Region:
    """Tables about one table whose k entries requirements bound.

    Attributes
    ----------
    chi2 : the smallest sum of squares of what has a standard deviation that was found
    widest : (k,), m and rad, how far entries are searched
    """

    def __init__(self, asked: Asked, table: Tables, entries: Sequence[Entry]):
        self.asked, self.table, self.entries, self.chi2 = asked, table, tuple(entries), np.inf
        self.widest = np.array([largest_length(table) if each.unit == "mm" else np.pi for each in entries])
        self.scale = np.array([each.scale for each in entries])

    def tables(self, direction: Reals, amounts: Reals) -> Tables:
        """Tables with directions, and with amounts added to the region's entries.

        Parameters
        ----------
        direction : (R, n), +1 or -1
        amounts : (R, k), m or rad

        Returns
        -------
        tables : R
        """
        return shifted(self.table, self.entries, amounts).with_column("direction", slice(None), direction)

    def reached(
        self, direction: Reals, amounts: Reals, held: Flags | None = None, *, inner: float = INSIDE, near: bool = False
    ) -> tuple[Reals, Flags]:
        """Amounts that starts lead to, and whether these meet what is asked but for extremes.

        Parameters
        ----------
        direction : (R, n), +1 or -1
        amounts : (R, k), m or rad, of the starts
        held : (R, k), entries that keep their amounts
        inner : of the half-widths, to which steps lead
        near : whether extremes count, where they were attained last

        Returns
        -------
        amounts, met : (R, k), m or rad, and (R,) bool
        """
        found, met = amounts.copy(), np.zeros(len(amounts), dtype=bool)
        for begun in range(0, len(amounts), CHUNK):
            own = slice(begun, begun + CHUNK)
            holding = None if held is None else held[own]
            found[own], met[own] = self._reached(direction[own], amounts[own], holding, inner, near)
        return found, met

    def _reached(
        self, direction: Reals, amounts: Reals, held: Flags | None, inner: float, near: bool
    ) -> tuple[Reals, Flags]:
        off_of = self.asked.near_off if near else self.asked.plain_off

        def model(at: Reals, rows: Integers) -> Reals:
            return off_of(self.tables(direction[rows], at))

        def within(off: Reals) -> Reals:
            return self.asked.rest(off, inner)

        found, off = lowered(
            model, amounts, held, within, passes=PASSES, damping=DAMPING, floor=1.0, widest=self.widest
        )
        chi2 = (off[:, self.asked.likely] ** 2).sum(axis=1)
        return found, (self.asked.excess(off) <= MET) & (chi2 <= self.chi2 + PROFILE**2 * (1 + MET) + MET)

    def meets(self, direction: Reals, amounts: Reals) -> bool:
        """Whether a table meets what is asked but for extremes.

        Parameters
        ----------
        direction : (n,), +1 or -1
        amounts : (k,), m or rad

        Returns
        -------
        meets : within half-widths, and ``NEAR`` more; what has a standard deviation does not count
        """
        off = self.asked.plain_off(self.tables(direction[None], amounts[None]))
        return bool(self.asked.excess(off)[0] <= NEAR)

    def confirmed(self, direction: Reals, amounts: Reals, held: Flags | None = None) -> Reals | None:
        """A table near another one that meets what is asked, with extremes sought afresh.

        Parameters
        ----------
        direction : (n,), +1 or -1
        amounts : (k,), m or rad
        held : (k,) bool, entries that keep their amounts; None for none

        Returns
        -------
        amounts : (k,), m or rad; None if none were found in ``FOLLOWED`` rounds
        """
        for _ in range(FOLLOWED if self.asked.extreme else 0):
            table = self.tables(direction[None], amounts[None])
            if all(float(self.asked.excess(self.asked.off(table, afresh))) <= NEAR for afresh in (False, True)):
                return amounts
            found, met = self.reached(direction[None], amounts[None], None if held is None else held[None], near=True)
            if not met[0]:
                return None
            amounts = found[0]
        return None if self.asked.extreme else amounts
