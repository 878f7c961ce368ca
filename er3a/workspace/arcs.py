"""Sets of azimuths as lists of arcs, for kernels.

A set is an array (n, 2) of disjoint intervals ``[from, to]`` within [0, 2 pi], and a count; an arc across 0 is held in
two pieces.
"""

from __future__ import annotations

import numpy as np

from er3a.geometry.vectors import TURN
from er3a.numerics.arrays import Reals
from er3a.numerics.jit import inner_kernel, kernel

ROUND_OFF = 1e-12
"""Bound (m per metre of reach, and rad) on the rounding of any length or angle of the proofs."""
FULL_TURN = TURN - ROUND_OFF
Cell = tuple[float, float, float, float]
"""A rectangle of the section, m: rho_0, rho_1, z_0, z_1."""
MAX_ARCS = 12  # disjoint intervals that a set has place for; where more would be needed, a set errs to the safe side


@inner_kernel
def _cut(arcs: Reals, count: int, low: float, high: float, more: bool) -> int:
    """Take the interval [low, high] within [0, 2 pi] out of the set; see :func:`remove`."""
    n = 0
    while n < count:
        a, b = arcs[n, 0], arcs[n, 1]
        if high <= a or low >= b:
            n += 1
        elif low <= a and high >= b:
            count -= 1
            arcs[n, 0], arcs[n, 1] = arcs[count, 0], arcs[count, 1]
        elif low > a and high < b:
            if count == len(arcs) and not more:
                return count
            arcs[n, 1] = low
            if count == len(arcs):
                return count
            arcs[count, 0], arcs[count, 1] = high, b
            count += 1
            n += 1
        else:
            if low <= a:
                arcs[n, 0] = high
            else:
                arcs[n, 1] = low
            n += 1
    return count


@kernel
def remove(arcs: Reals, count: int, low: float, high: float, more: bool) -> int:
    """Take an arc out of a set of azimuths. Kernel.

    Parameters
    ----------
    arcs : (most, 2), rad in [0, 2 pi], changed in place
    count : how many of them count
    low, high : rad, of any turn; nothing happens if high is not above low
    more : where the list is full, whether to take out too much (True) or too little

    Returns
    -------
    count : of the arcs that are left
    """
    if high <= low:
        return count
    if high - low >= TURN:
        return 0
    shift = np.floor(low / TURN) * TURN
    low, high = low - shift, high - shift
    if high <= TURN:
        return _cut(arcs, count, low, high, more)
    count = _cut(arcs, count, low, TURN, more)
    return _cut(arcs, count, 0.0, high - TURN, more)


@kernel
def meets(arcs: Reals, count: int, low: float, high: float) -> bool:
    """Whether an arc meets a set of azimuths. Kernel.

    Parameters
    ----------
    arcs, count : the set, rad in [0, 2 pi]
    low, high : rad, of any turn

    Returns
    -------
    meets : touching counts
    """
    if high - low >= TURN:
        return count > 0
    shift = np.floor(low / TURN) * TURN
    low, high = low - shift, high - shift
    for n in range(count):
        if arcs[n, 0] <= high and arcs[n, 1] >= low:
            return True
        if arcs[n, 0] <= high - TURN:
            return True
    return False


@kernel
def measure(arcs: Reals, count: int) -> float:
    """Sum of the lengths of a set's arcs. Kernel.

    Parameters
    ----------
    arcs, count : the set, rad in [0, 2 pi]

    Returns
    -------
    total : rad, 2 pi at most
    """
    total = 0.0
    for n in range(count):
        total += arcs[n, 1] - arcs[n, 0]
    return total
