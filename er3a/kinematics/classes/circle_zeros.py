"""All real zeros of a trigonometric polynomial of degree 8, none missed that rises above its noise.

On each of eight arcs the polynomial, as a polynomial in the tangent of half the angle from the arc's middle, is written
in Bernstein's basis, whose coefficients enclose its values [1]_. Arcs without a change of sign hold no zero, arcs on
which the coefficients are in order hold at most one; others are halved. The change of basis enlarges no noise by more
than 1.4, because it is a product of factors of equal size. Where the coefficients sink below the noise the arc is
reported as *dark*: there may be zeros, a double one for instance.

References
----------
.. [1] B. Mourrain, F. Rouillier, M.-F. Roy, "Bernstein's basis and real root isolation", INRIA RR-5149 (2004).
"""

from __future__ import annotations

from math import comb, factorial

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.numerics.jit import inner_kernel, kernel

DEGREE = 8
TERMS = 2 * DEGREE + 1
SAMPLES = 20
ARCS = 8
ORDER = 2 * DEGREE
MOST_PARTS = 150
CLOSE = 1e-13
LOCAL_ORDER = 12
LOCAL_NOISE = 1e-11
LOCAL_GROWTH = 1e3
LEFT_OVER = 1 / (2**LOCAL_ORDER * factorial(LOCAL_ORDER + 1))  # of interpolation at Chebyshev's nodes
FIRST_ANGLE = 0.1234
_HALF = np.tan(np.pi / ARCS / 2)


def _harmonics() -> Reals:
    """(20, 20): samples at equal angles to coefficients 1, cos, sin, cos 2, sin 2, ... cos 9, sin 9, cos 10."""
    angles = FIRST_ANGLE + 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    rows = [np.full(SAMPLES, 1.0)]
    for k in range(1, SAMPLES // 2):
        rows += [2 * np.cos(k * angles), 2 * np.sin(k * angles)]
    rows.append(np.cos(SAMPLES // 2 * (angles - FIRST_ANGLE)))
    return np.array(rows) / SAMPLES


def _bernstein() -> Reals:
    """(8, 17, 17): coefficients 1, cos, sin, ... to Bernstein coefficients of the polynomial on each arc."""
    rising, falling = np.array([1 - 1j * _HALF, 1 + 1j * _HALF]), np.array([1 + 1j * _HALF, 1 - 1j * _HALF])
    binomials = np.array([comb(ORDER, j) for j in range(TERMS)], dtype=float)
    out = np.empty((ARCS, TERMS, TERMS))
    for arc in range(ARCS):
        middle = FIRST_ANGLE + 2 * np.pi * (arc + 0.5) / ARCS
        for k in range(DEGREE + 1):
            product = np.array([np.exp(1j * k * middle)])
            for factor in [rising] * (DEGREE + k) + [falling] * (DEGREE - k):
                product = np.convolve(product, factor)
            values = product / binomials
            if k:
                out[arc, :, 2 * k - 1], out[arc, :, 2 * k] = values.real, values.imag
            else:
                out[arc, :, 0] = values.real
    return out


def _local_bernstein() -> Reals:
    """(13, 13): values at the nodes to Bernstein coefficients on -1..1."""
    t = 0.5 * (NODES + 1)
    basis = np.array([comb(LOCAL_ORDER, j) * t**j * (1 - t) ** (LOCAL_ORDER - j) for j in range(LOCAL_ORDER + 1)]).T
    return np.linalg.inv(basis)


NODES = np.cos(np.pi * (np.arange(LOCAL_ORDER + 1) + 0.5) / (LOCAL_ORDER + 1))
HARMONICS, BERNSTEIN, LOCAL_BERNSTEIN = (
    _harmonics(),
    np.ascontiguousarray(np.swapaxes(_bernstein(), 1, 2)),
    _local_bernstein(),
)
SAMPLE_ANGLES = FIRST_ANGLE + 2 * np.pi * np.arange(SAMPLES) / SAMPLES


@inner_kernel
def value_and_slope(terms: Reals, angle: float) -> tuple[float, float]:
    """Value and derivative of the polynomial with coefficients 1, cos, sin, ... at an angle."""
    c, s = np.cos(angle), np.sin(angle)
    ck, sk, value, slope = 1.0, 0.0, terms[0], 0.0
    for k in range(1, DEGREE + 1):
        ck, sk = ck * c - sk * s, sk * c + ck * s
        value += terms[2 * k - 1] * ck + terms[2 * k] * sk
        slope += k * (terms[2 * k] * ck - terms[2 * k - 1] * sk)
    return value, slope


@inner_kernel
def _zero_between(terms: Reals, low: float, high: float, rises: bool) -> float:
    """The zero in an interval on which the values' signs differ: Newton's steps, halving where they leave it."""
    angle = 0.5 * (low + high)
    for _ in range(60):
        value, slope = value_and_slope(terms, angle)
        if (value > 0.0) == rises:
            high = angle
        else:
            low = angle
        step = value / slope if slope != 0.0 else np.inf
        following = angle - step
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - angle) < CLOSE:
            return following
        angle = following
    return angle


@inner_kernel
def isolate(stack: Reals, order: int, noise: float, found: Reals, count: int) -> int:
    """Intervals of -1..1 with zeros of the polynomial whose Bernstein coefficients are ``stack[0, :order + 1]``.

    Rows of ``found`` from ``count`` on are filled with low end, high end and kind: 1 or -1 for one zero where the
    values rise or fall, 0 for a dark interval. Returns how many rows there are; -1 if more are needed than may be used.
    """
    last = order
    stack[0, last + 1], stack[0, last + 2] = -1.0, 1.0
    depth, used = 1, 0
    while depth > 0:
        depth -= 1
        used += 1
        b = stack[depth]
        largest, faint, changes, sign = 0.0, 0, 0, 0.0
        for i in range(last + 1):
            size = abs(b[i])
            largest = max(largest, size)
            if size <= noise:
                faint += 1
            else:
                changes += sign * b[i] < 0.0
                sign = 1.0 if b[i] > 0.0 else -1.0
        if faint == 0 and changes == 0:
            continue
        low, high = b[last + 1], b[last + 2]
        clear = abs(b[0]) > noise and abs(b[last]) > noise
        single = clear and changes == 1 and faint <= 1
        if clear and not single and changes <= 1:
            rising, falling = 0, 0
            for i in range(last):
                rising += b[i + 1] >= b[i]
                falling += b[i + 1] <= b[i]
            if rising == last or falling == last:
                if changes == 0:
                    continue
                single = True
        dark = largest < 4.0 * noise or high - low < 1e-12
        if single or dark:
            kind = 0.0 if dark else (1.0 if b[last] > 0.0 else -1.0)
            if dark and count > 0 and found[count - 1, 2] == 0.0 and found[count - 1, 1] == low:
                found[count - 1, 1] = high
                continue
            if count >= found.shape[0]:
                return -1
            found[count, 0], found[count, 1], found[count, 2] = low, high, kind
            count += 1
            continue
        if used > MOST_PARTS or depth + 2 > stack.shape[0]:
            return -1
        # Halved by de Casteljau: b becomes the right half and waits below the left.
        left = stack[depth + 1]
        half = 0.5 * (low + high)
        for i in range(last + 1):
            left[i] = b[0]
            for j in range(last - i):
                b[j] = 0.5 * (b[j] + b[j + 1])
        left[last + 1], left[last + 2] = low, half
        b[last + 1], b[last + 2] = half, high
        depth += 2
    return count


@kernel
def zeros_on_circle(terms: Reals, noise: float, found: Reals, stack: Reals) -> int:
    """Fill ``found`` (n, 3) with low end, high end and kind of all zeros of the polynomial; -1 if there is no place.

    Of a single zero (kind 1) both ends are the zero; kind 0 is a dark interval. ``stack`` (100, 19) is scratch memory.
    """
    count = 0
    for arc in range(ARCS):
        for i in range(TERMS):
            stack[0, i] = 0.0
        for k in range(TERMS):
            x = terms[k]
            for i in range(TERMS):
                stack[0, i] += BERNSTEIN[arc, k, i] * x
        middle = FIRST_ANGLE + 2 * np.pi * (arc + 0.5) / ARCS
        before = count
        count = isolate(stack, ORDER, noise, found, count)
        if count < 0:
            return -1
        for row in range(before, count):
            low, high = middle + 2.0 * np.arctan(_HALF * found[row, 0]), middle + 2.0 * np.arctan(_HALF * found[row, 1])
            if found[row, 2] != 0.0:
                low = high = _zero_between(terms, low, high, found[row, 2] > 0.0)
                found[row, 2] = 1.0
            found[row, 0], found[row, 1] = low, high
    return count


@inner_kernel
def zeros_between(values: Reals, noise: float, peak: float, low: float, high: float, found: Reals, stack: Reals) -> int:
    """The same on a short interval, from values (13,) with that noise at :data:`NODES` of it.

    To the noise comes what a polynomial of degree 12 leaves of the trigonometric one, whose largest value is ``peak``:
    by Bernstein's inequality no 13th derivative exceeds ``8^13 peak``.
    """
    largest = 0.0
    for i in range(LOCAL_ORDER + 1):
        total = 0.0
        for k in range(LOCAL_ORDER + 1):
            total += LOCAL_BERNSTEIN[i, k] * values[k]
        stack[0, i] = total
        largest = max(largest, abs(values[i]))
    coefficients = np.empty(LOCAL_ORDER + 1)
    coefficients[:] = stack[0, : LOCAL_ORDER + 1]
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    noise += LEFT_OVER * peak * (DEGREE * half) ** (LOCAL_ORDER + 1)
    count = isolate(stack, LOCAL_ORDER, max(LOCAL_NOISE * largest, LOCAL_GROWTH * noise), found, 0)
    for row in range(count):
        a, b = found[row, 0], found[row, 1]
        if found[row, 2] != 0.0:
            for _ in range(50):
                x = 0.5 * (a + b)
                for i in range(LOCAL_ORDER + 1):
                    stack[0, i] = coefficients[i]
                t = 0.5 * (x + 1.0)
                for i in range(LOCAL_ORDER):
                    for j in range(LOCAL_ORDER - i):
                        stack[0, j] += t * (stack[0, j + 1] - stack[0, j])
                if (stack[0, 0] > 0.0) == (found[row, 2] > 0.0):
                    b = x
                else:
                    a = x
            a = b = 0.5 * (a + b)
            found[row, 2] = 1.0
        found[row, 0], found[row, 1] = middle + half * a, middle + half * b
    return count
