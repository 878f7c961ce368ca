"""Sobol' points in up to ten dimensions: evenly spread, each one computed from its number alone.

Direction numbers are those of Joe and Kuo [1]_; a random digital shift, keyed by the seed, keeps every point uniformly
distributed and the estimates unbiased (Owen [2]_).

References
----------
.. [1] S. Joe, F. Y. Kuo, "Constructing Sobol sequences with better two-dimensional projections", SIAM J. Sci. Comput.
   30, 2008 (file new-joe-kuo-6.21201).
.. [2] A. B. Owen, "Quasi-Monte Carlo sampling", SIGGRAPH course, 2003.
"""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Singles, Words
from er3a.numerics.jit import inner_kernel

BITS = 40
"""Of the number of a point: more than the study allows samples. Of a coordinate, the first 21 are used."""
# Degree, coefficients and first numbers of dimensions 2 to 10.
_JOE_KUO = (
    (1, 0, (1,)),
    (2, 1, (1, 3)),
    (3, 1, (1, 3, 1)),
    (3, 2, (1, 1, 1)),
    (4, 1, (1, 1, 3, 3)),
    (4, 4, (1, 3, 5, 13)),
    (5, 2, (1, 1, 5, 5, 17)),
    (5, 4, (1, 1, 5, 5, 5)),
    (5, 7, (1, 1, 7, 11, 19)),
)
_CUT, _HALF, _STEP = np.uint64(BITS - 21), np.float32(0.5), np.float32(2.0**-21)
_ONE = np.uint64(1)


def direction_numbers(dimensions: int) -> Words:
    """Direction numbers (dimensions, BITS), uint64: that of bit 0 of a point's number first."""
    out = [[1 << (BITS - 1 - bit) for bit in range(BITS)]]
    for degree, coefficients, start in _JOE_KUO[: dimensions - 1]:
        row = [m << (BITS - 1 - bit) for bit, m in enumerate(start)]
        for bit in range(degree, BITS):
            value = row[bit - degree] ^ (row[bit - degree] >> degree)
            for k in range(1, degree):
                if coefficients >> (degree - 1 - k) & 1:
                    value ^= row[bit - k]
            row.append(value)
        out.append(row)
    return np.array(out, dtype=np.uint64)


def shifted_directions(seed: int, dimensions: int) -> Words:
    """Direction numbers and, as last column, the shift of each dimension: (dimensions, BITS + 1)."""
    random = np.random.Generator(np.random.Philox(key=seed))
    shift = random.integers(0, 1 << BITS, size=(dimensions, 1), dtype=np.uint64)
    return np.concatenate([direction_numbers(dimensions), shift], axis=1)


@inner_kernel
def fill_sobol(directions: Words, first: int, count: int, chunk: int, rows: Singles) -> None:
    """Set a row (``chunk`` long) for each dimension to the points numbered from ``first`` on, in (0, 1)."""
    for k in range(directions.shape[0]):
        # Neighbours in number differ by the directions of the trailing ones (Gray code): one step, one exclusive or.
        value, number = directions[k, BITS], np.uint64(first)
        gray = number ^ (number >> _ONE)
        for bit in range(BITS):
            if (gray >> np.uint64(bit)) & _ONE:
                value ^= directions[k, bit]
        for i in range(count):
            rows[k * chunk + i] = (np.float32(np.int32(value >> _CUT)) + _HALF) * _STEP
            bit = 0
            number += _ONE
            while bit < BITS - 1 and not (number >> np.uint64(bit)) & _ONE:
                bit += 1
            value ^= directions[k, bit]
