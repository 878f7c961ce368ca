"""Six revolute joints reduced to one: a determinant that vanishes at one joint's angle of each solution.

The chain and the pose close a loop of six joints, ``Rz(x_1) K_1 ... Rz(x_6) K_6 = 1``, which can be read from any joint
on and in either sense. Joint 6's axis, as fifteen numbers (below), seen from joint 2, has two forms:

    K_2 Rz(x_3) K_3 Rz(x_4) K_4 Rz(x_5) K_5 axis = Rz(-x_2) K_1^-1 Rz(-x_1) K_6^-1 axis

Six of the rows, those along joint 2, are linear in cos and sin of x_1 alone; the eight across it, as four complex
numbers, are ``exp(-i x_2)`` times a linear form. Orthogonal matrices take both joints out and leave six equations in
joints 3, 4 and 5 [1]_. With x_3 fixed they are biquadratic in the tangents of half the other two angles; multiplied by
one tangent they are twelve linear equations for twelve monomials [1]_. Entries are linear in cos x_3 and sin x_3, so
the determinant is a trigonometric polynomial of degree 8 in x_3 (of Raghavan and Roth's degree 24 the factor
``(1 + tan^2)^4`` has gone): twenty samples give it, and three more numbers that would vanish without rounding.

Special lengths and angles make the determinant vanish for some readings of the loop, never for all in arms that were
met; :mod:`six_revolute` chooses among the twelve.

**Fifteen numbers** of a directed line with a point on it are mapped linearly by every rigid motion. For the point p and
the direction l they are p, l, ``p x l``, ``(p . p) l - 2 (p . l) p`` (three numbers each), ``p . p``,
``p . l`` and 1. They are the monomials of Raghavan and Roth's fourteen equations [1]_. Under x -> R x + t each image is
a linear combination of them, so the equations of a chain are products of constant matrices and rotations about z, and
those turn the first two components of each triple.

**All real zeros** of the polynomial are found that rise above its noise. On each of eight arcs the polynomial, as a
polynomial in the tangent of half the angle from the arc's middle, is written in Bernstein's basis, whose coefficients
enclose its values [2]_. Arcs without a change of sign hold no zero, arcs on which the coefficients are in order hold at
most one; others are halved. The change of basis enlarges no noise by more than 1.4, because it is a product of factors
of equal size. Where the coefficients sink below the noise the arc is reported as *dark*: there may be zeros, a double
one for instance.

References
----------
.. [1] M. Raghavan, B. Roth, "Inverse kinematics of the general 6R manipulator and related linkages", J. Mech. Design
   115 (1993).
.. [2] B. Mourrain, F. Rouillier, M.-F. Roy, "Bernstein's basis and real root isolation", INRIA RR-5149 (2004).
"""

from __future__ import annotations

from math import comb, factorial
from typing import NamedTuple

import numpy as np

from er3a.kinematics.chain import invert_rigid
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.jit import inner_kernel, kernel

NUMBERS = 15


@inner_kernel
def carry(K: Reals, v: Reals, out: Reals) -> None:
    """Carry a line's fifteen numbers along a rigid motion. Kernel.

    Parameters
    ----------
    K : (4, 4), rigid
    v : (15,), p, l, ``p x l``, ``(p . p) l - 2 (p . l) p``, ``p . p``, ``p . l``, 1
    out : (15,), filled with those of the moved line; it must not be v
    """
    t0, t1, t2 = K[0, 3], K[1, 3], K[2, 3]
    tt = t0 * t0 + t1 * t1 + t2 * t2
    for block in range(4):
        b = 3 * block
        for i in range(3):
            out[b + i] = K[i, 0] * v[b] + K[i, 1] * v[b + 1] + K[i, 2] * v[b + 2]
    along_p = t0 * out[0] + t1 * out[1] + t2 * out[2]
    along_l = t0 * out[3] + t1 * out[4] + t2 * out[5]
    m0, m1, m2 = out[6], out[7], out[8]
    out[6] = m0 + t1 * out[5] - t2 * out[4]
    out[7] = m1 + t2 * out[3] - t0 * out[5]
    out[8] = m2 + t0 * out[4] - t1 * out[3]
    twice = 2.0 * (v[13] + along_l)
    out[9] += -2.0 * (t1 * m2 - t2 * m1) + tt * out[3] - twice * t0
    out[10] += -2.0 * (t2 * m0 - t0 * m2) + tt * out[4] - twice * t1
    out[11] += -2.0 * (t0 * m1 - t1 * m0) + tt * out[5] - twice * t2
    out[12] = v[12] + 2.0 * along_p + tt * v[14]
    out[13] = v[13] + along_l
    out[14] = v[14]
    out[0] += t0 * v[14]
    out[1] += t1 * v[14]
    out[2] += t2 * v[14]


@inner_kernel
def turned_parts(v: Reals, parts: Reals) -> None:
    """Write the turn of a line about z as a linear form of cosine and sine. Kernel.

    Parameters
    ----------
    v : (15,), numbers of the line
    parts : (3, 15), filled: ``Rz(angle) v = cos(angle) parts[0] + sin(angle) parts[1] + parts[2]``
    """
    parts[:, :] = 0.0
    for b in range(0, 12, 3):
        parts[0, b], parts[0, b + 1] = v[b], v[b + 1]
        parts[1, b], parts[1, b + 1] = -v[b + 1], v[b]
        parts[2, b + 2] = v[b + 2]
    parts[2, 12], parts[2, 13], parts[2, 14] = v[12], v[13], v[14]


@inner_kernel
def slid_parts(v: Reals, parts: Reals) -> None:
    """Write the shift of a line along z as a polynomial of the shift. Kernel.

    Parameters
    ----------
    v : (15,), numbers of the line
    parts : (3, 15), filled: ``Tz(x) v = parts[0] + x parts[1] + x^2 parts[2]``
    """
    parts[:, :] = 0.0
    parts[0, :] = v
    parts[1, 2] = v[14]
    parts[1, 6], parts[1, 7] = -v[4], v[3]
    parts[1, 9], parts[1, 10], parts[1, 11] = 2.0 * v[7], -2.0 * v[6], -2.0 * v[13]
    parts[1, 12], parts[1, 13] = 2.0 * v[2], v[5]
    parts[2, 9], parts[2, 10], parts[2, 11] = v[3], v[4], -v[5]
    parts[2, 12] = v[14]


DEGREE = 8  # of the determinant as a trigonometric polynomial: sixteen zeros at most
TERMS = 2 * DEGREE + 1
SAMPLES = 20  # 17 coefficients, and three more that would vanish without rounding
ARCS = 8  # of the circle, each with the tangent of half the angle from its own middle
ORDER = 2 * DEGREE
MAX_PARTS = 150  # intervals looked at on an arc, before the reading is given up
CLOSE = 1e-13  # rad: a step to a zero this short has reached it
LOCAL_ORDER = 12  # of the polynomial through values on a short interval
LOCAL_NOISE = 1e-11  # of the largest value: above what the change to Bernstein's basis makes of rounding
LOCAL_GROWTH = 1e3  # about how much that change enlarges the noise of values (at worst 3.7e3)
LEFT_OVER = 1 / (2**LOCAL_ORDER * factorial(LOCAL_ORDER + 1))  # of interpolation at Chebyshev's nodes
FIRST_ANGLE = 0.1234  # rad: no usual joint angle is at a sample or at the border of arcs
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
    """Value and derivative of a trigonometric polynomial. Kernel.

    Parameters
    ----------
    terms : (17,) at least, coefficients 1, cos, sin, cos 2, sin 2, ...
    angle : rad

    Returns
    -------
    value, slope : slope per rad
    """
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
def isolate(stack: Reals, order: int, noise: float, found: Reals, count: int) -> int:  # noqa: C901, PLR0912
    """Find the intervals of -1..1 that hold the zeros of a polynomial in Bernstein's basis [2]_. Kernel.

    Parameters
    ----------
    stack : (rows, order + 3), the coefficients in ``stack[0, :order + 1]``; scratch memory
    order : degree of the polynomial
    noise : size below which a coefficient has no sign
    found : (n, 3), filled from row ``count`` on with low end, high end and kind: 1 or -1 for one zero where the
        values rise or fall, 0 for a dark interval
    count : rows that are filled already

    Returns
    -------
    count : how many rows there are; -1 if more are needed than may be used
    """
    last = order
    stack[0, last + 1], stack[0, last + 2] = -1.0, 1.0
    depth, used = 1, 0
    while depth > 0:
        depth -= 1
        used += 1
        b = stack[depth]
        # Descartes' rule: the changes of sign of the coefficients bound the zeros inside.
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
        if used > MAX_PARTS or depth + 2 > stack.shape[0]:
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
    """Find all zeros of a trigonometric polynomial. Kernel.

    Parameters
    ----------
    terms : (17,) at least, coefficients 1, cos, sin, cos 2, sin 2, ...
    noise : of the values
    found : (n, 3), filled with low end, high end (rad) and kind: of a single zero (1) both ends are the zero; 0 is a
        dark interval
    stack : (100, 19), scratch memory

    Returns
    -------
    count : how many rows; -1 if there is no place
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
    """Find all zeros on a short interval, from values at its nodes. Kernel.

    To the noise comes what a polynomial of degree 12 leaves of the trigonometric one, whose largest value is ``peak``:
    by Bernstein's inequality no 13th derivative exceeds ``8^13 peak``.

    Parameters
    ----------
    values : (13,), at :data:`NODES` of the interval
    noise : of the values
    peak : largest value of the polynomial on the circle
    low, high : rad, the interval
    found, stack : as for :func:`zeros_on_circle`

    Returns
    -------
    count : how many rows; -1 if there is no place
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


EQUATIONS, MONOMIALS = 6, 9
SHIFT_4, SHIFT_5 = 0.7312, -1.1753  # angles from which halves are taken, so that no usual angle is at infinity
ROUNDING = 2e-15  # of an elimination's pivots, about nine times the unit of rounding
_ALONG = (2, 5, 8, 11, 12, 13)  # of the fifteen numbers those that a turn about z leaves as they are


class Reading(NamedTuple):
    """The loop read from one joint on in one sense.

    ``joint`` (6,) is the arm's joint at each place, ``sense`` +1 or -1 the sign of its angle there, ``links`` (6, 4, 4)
    the links after them without the pose's, which is at ``place`` and is inverted if ``sense`` is -1.
    ``left`` (14, 27) are the left side's coefficients if the pose is not in it. ``slides`` (6,) marks the prismatic
    joints, which may be at places 1, 4 and 5 only.
    """

    joint: Integers
    sense: float
    links: Reals
    place: int
    left: Reals
    slides: Flags


class Scratch(NamedTuple):
    """Memory of one pose: links of the loop, both sides' numbers, the six equations."""

    links: Reals
    left: Reals
    right: Reals
    equations: Reals
    samples: Reals
    terms: Reals
    work: Reals
    along: Reals


def new_scratch() -> Scratch:
    """Memory for :func:`equations_of_pose` and what follows."""
    return Scratch(
        links=np.zeros((6, 4, 4)),
        left=np.zeros((14, 27)),
        right=np.zeros((3, NUMBERS)),
        equations=np.zeros((3, EQUATIONS, MONOMIALS)),
        samples=np.zeros(SAMPLES),
        terms=np.zeros(SAMPLES),
        work=np.zeros((12, 9)),
        along=np.zeros((6, 30)),
    )


def readings_of(links: Reals, sliding: Flags) -> list[Reading]:
    """All readings of the loop: twelve, or those with the prismatic joints at places 1, 4 and 5.

    Parameters
    ----------
    links : (7, 4, 4), with L_0 = 1 (base in the pose), in parts of the chain's size
    sliding : (6,), prismatic joints

    Returns
    -------
    readings : forwards from each joint, then backwards
    """
    found = []
    for backwards in (False, True):
        for shift in range(6):
            arranged = np.empty((6, 4, 4))
            joint = np.empty(6, dtype=np.int64)
            place = -1
            for i in range(6):
                k = (4 - i - shift) % 6 if backwards else (i + shift) % 6
                joint[i] = (5 - i - shift) % 6 if backwards else k
                K = np.array(links[k + 1])
                arranged[i] = np.linalg.inv(K) if backwards else K
                if k == 5:
                    place = i
            slides = sliding[joint]
            if slides[[1, 2, 5]].any():
                continue
            reading = Reading(joint, -1.0 if backwards else 1.0, arranged, place, np.zeros((14, 27)), slides)
            if place in (0, 5):
                left_side(arranged, slides, reading.left)
            found.append(reading)
    return found


@kernel
def left_side(links: Reals, slides: Flags, left: Reals) -> None:
    """Fill the coefficients of the left side of a loop's equations. Kernel.

    Parameters
    ----------
    links : (6, 4, 4), of the loop
    slides : (6,), prismatic joints at places 1, 4 and 5
    left : (14, 27), filled: rows along joint 2, then real and imaginary parts of those across it; columns (cos, sin,
        1) of x_3 times squares and product of cosine and sine of half x_4 times those of x_5; of a prismatic joint
        1, x and x^2 instead
    """
    axis = np.zeros(NUMBERS)
    axis[5], axis[14] = 1.0, 1.0
    first, last, carried = np.empty(NUMBERS), np.empty(NUMBERS), np.empty(NUMBERS)
    parts_5, parts_4, parts_3 = np.empty((3, NUMBERS)), np.empty((3, NUMBERS)), np.empty((3, NUMBERS))
    c4, s4, c5, s5 = np.cos(SHIFT_4), np.sin(SHIFT_4), np.cos(SHIFT_5), np.sin(SHIFT_5)
    left[:, :] = 0.0
    carry(links[4], axis, first)
    if slides[4]:
        slid_parts(first, parts_5)
    else:
        turned_parts(first, parts_5)
    for k in range(3):
        carry(links[3], parts_5[k], last)
        if slides[3]:
            slid_parts(last, parts_4)
        else:
            turned_parts(last, parts_4)
        for j in range(3):
            carry(links[2], parts_4[j], last)
            turned_parts(last, parts_3)
            for i in range(3):
                carry(links[1], parts_3[i], carried)
                # (cos, sin, 1) of an angle in monomials (C^2, C S, S^2) of half its distance from the shift
                for u in range(3):
                    w4 = _monomial(j, u, c4, s4, slides[3])
                    for v in range(3):
                        w = w4 * _monomial(k, v, c5, s5, slides[4])
                        if w != 0.0:
                            column = 9 * i + 3 * u + v
                            for r in range(6):
                                left[r, column] += w * carried[_ALONG[r]]
                            for b in range(4):
                                left[6 + 2 * b, column] += w * carried[3 * b]
                                left[7 + 2 * b, column] += w * carried[3 * b + 1]


@inner_kernel
def _monomial(part: int, power: int, c: float, s: float, slides: bool) -> float:
    """Coefficient of C^2, C S or S^2 (``power``) in the cosine, the sine or 1 (``part``) of an angle shifted by (c, s);
    in 1, x or x^2 if the joint is prismatic, x = S / C."""
    if slides:
        return 1.0 if part == power else 0.0
    if part == 2:
        return 0.0 if power == 1 else 1.0
    if part == 0:
        return c if power == 0 else (-2.0 * s if power == 1 else -c)
    return s if power == 0 else (2.0 * c if power == 1 else -s)


@kernel
def equations_of_pose(reading: Reading, pose_link: Reals, m: Scratch) -> None:
    """Fill the six equations of the loop that a pose closes, with joints 1 and 2 taken out [1]_. Kernel.

    Parameters
    ----------
    reading : of the loop
    pose_link : (4, 4), ``L_6 T^-1 L_0``, in parts of the chain's size
    m : scratch memory; ``m.equations`` (3, 6, 9) and ``m.right`` (3, 15) are filled, each equation of length 1
    """
    for i in range(6):
        m.links[i] = reading.links[i]
    if reading.sense > 0.0:
        m.links[reading.place] = pose_link
    else:
        invert_rigid(pose_link, m.links[reading.place])
    left = reading.left
    if reading.place != 0 and reading.place != 5:
        left = m.left
        left_side(m.links, reading.slides, left)
    _right_side(reading.slides[0], m)
    _without_first_joint(left, reading.slides, m)
    _without_second_joint(left, m)
    for r in range(EQUATIONS):
        total = 0.0
        for i in range(3):
            for j in range(MONOMIALS):
                total += m.equations[i, r, j] * m.equations[i, r, j]
        per = 1.0 / np.sqrt(total) if total > 0.0 else 0.0
        for i in range(3):
            for j in range(MONOMIALS):
                m.equations[i, r, j] *= per


@inner_kernel
def _right_side(slides: bool, m: Scratch) -> None:
    """``m.right`` (3, 15): K_1^-1 Rz(-x_1) K_6^-1 axis = cos right[0] + sin right[1] + right[2]; of a prismatic joint 1
    x^2 and x replace cos and sin."""
    axis, seen = np.zeros(NUMBERS), np.empty(NUMBERS)
    axis[5], axis[14] = 1.0, 1.0
    K, parts = np.empty((4, 4)), np.empty((3, NUMBERS))
    invert_rigid(m.links[5], K)
    carry(K, axis, seen)
    if slides:
        slid_parts(seen, parts)
        for j in range(NUMBERS):
            parts[0, j], parts[2, j] = parts[2, j], parts[0, j]
    else:
        turned_parts(seen, parts)
    for j in range(NUMBERS):
        parts[1, j] = -parts[1, j]
    invert_rigid(m.links[0], K)
    for i in range(3):
        carry(K, parts[i], m.right[i])


@inner_kernel
def _without_first_joint(left: Reals, slides: Flags, m: Scratch) -> None:  # noqa: C901, PLR0912
    """Four equations from the rows along joint 2: two reflections take cos x_1 and sin x_1 out of all but two rows.

    ``m.along`` (6, 30) keeps the reflected rows: cos, sin, constant, then the left side.
    """
    A = m.along
    for r in range(6):
        for i in range(3):
            A[r, i] = m.right[i, _ALONG[r]]
        for j in range(27):
            A[r, 3 + j] = left[r, j]
    for k in range(2):
        squares = 0.0
        for r in range(k, 6):
            squares += A[r, k] * A[r, k]
        norm = np.sqrt(squares)
        if norm == 0.0:
            continue
        # Householder's reflection, away from the entry's own sign so that no digits cancel.
        if A[k, k] > 0.0:
            norm = -norm
        v = np.zeros(6)
        for r in range(k, 6):
            v[r] = A[r, k]
        v[k] -= norm
        beta = 0.0
        for r in range(k, 6):
            beta += v[r] * v[r]
        for j in range(k, 30):
            total = 0.0
            for r in range(k, 6):
                total += v[r] * A[r, j]
            total *= 2.0 / beta
            for r in range(k, 6):
                A[r, j] -= total * v[r]
    for r in range(4):
        for i in range(3):
            for j in range(MONOMIALS):
                m.equations[i, r, j] = A[2 + r, 3 + 9 * i + j]
        # the constant 1 is (C^2 + S^2) (C^2 + S^2); of a prismatic joint C^2
        for i in (0, 2):
            for j in (0, 2):
                if not (slides[3] and i == 2) and not (slides[4] and j == 2):
                    m.equations[2, r, 3 * i + j] -= A[2 + r, 2]


@inner_kernel
def _without_second_joint(left: Reals, m: Scratch) -> None:  # noqa: C901, PLR0912
    """Two equations from the rows across joint 2: the complex row that is orthogonal to the right side's columns."""
    B, normal, v = np.empty((4, 3), np.complex128), np.zeros((3, 4), np.complex128), np.zeros(4, np.complex128)
    for b in range(4):
        for i in range(3):
            B[b, i] = complex(m.right[i, 3 * b], m.right[i, 3 * b + 1])
    for k in range(3):
        total = 0.0
        for r in range(k, 4):
            total += B[r, k].real ** 2 + B[r, k].imag ** 2
        norm = np.sqrt(total)
        if norm == 0.0:
            continue
        head = abs(B[k, k])
        # The same reflection in complex numbers: the sign becomes a phase.
        phase = B[k, k] / head if head > 0.0 else 1.0 + 0.0j
        for r in range(k, 4):
            normal[k, r] = B[r, k]
        normal[k, k] += phase * norm
        beta = 2.0 * norm * (norm + head)
        for r in range(k, 4):
            normal[k, r] /= np.sqrt(0.5 * beta)
        for j in range(k, 3):
            inner = 0.0 + 0.0j
            for r in range(k, 4):
                inner += np.conj(normal[k, r]) * B[r, j]
            for r in range(k, 4):
                B[r, j] -= inner * normal[k, r]
    # What the reflections leave in the last row: the direction orthogonal to all three columns.
    v[3] = 1.0
    for k in range(2, -1, -1):
        inner = 0.0 + 0.0j
        for r in range(k, 4):
            inner += np.conj(normal[k, r]) * v[r]
        for r in range(k, 4):
            v[r] -= inner * normal[k, r]
    for i in range(3):
        for j in range(MONOMIALS):
            re, im = 0.0, 0.0
            for b in range(4):
                x, y = left[6 + 2 * b, 9 * i + j], left[7 + 2 * b, 9 * i + j]
                re += v[b].real * x + v[b].imag * y
                im += v[b].real * y - v[b].imag * x
            m.equations[i, 4, j], m.equations[i, 5, j] = re, im


@inner_kernel
def at_angle(equations: Reals, angle: float, F: Reals) -> None:
    """Evaluate the six equations at one angle of the hidden joint. Kernel.

    Parameters
    ----------
    equations : (3, 6, 9), the parts of cosine, sine and 1
    angle : rad
    F : (6, 9), filled
    """
    c, s = np.cos(angle), np.sin(angle)
    for r in range(EQUATIONS):
        for j in range(MONOMIALS):
            F[r, j] = c * equations[0, r, j] + s * equations[1, r, j] + equations[2, r, j]


@inner_kernel
def eliminate(M: Reals, rows: int, columns: int) -> tuple[float, float]:
    """Eliminate below the first columns by row pivots. Kernel.

    Parameters
    ----------
    M : (rows, 9), changed
    columns : how many

    Returns
    -------
    value, smallest : product of the pivots, with the sign of the rows' order, and the smallest of them; the
        determinant, if of all columns of a square matrix
    """
    value, smallest = 1.0, np.inf
    for k in range(columns):
        pivot = k
        for r in range(k + 1, rows):
            if abs(M[r, k]) > abs(M[pivot, k]):
                pivot = r
        if pivot != k:
            value = -value
            for j in range(k, 9):
                M[k, j], M[pivot, j] = M[pivot, j], M[k, j]
        value *= M[k, k]
        smallest = min(smallest, abs(M[k, k]))
        if M[k, k] == 0.0:
            continue
        per = 1.0 / M[k, k]
        for r in range(k + 1, rows):
            x = M[r, k] * per
            for j in range(k + 1, 9):
                M[r, j] -= x * M[k, j]
    return value, smallest


@inner_kernel
def nine_rows(F: Reals, M: Reals) -> tuple[float, float]:
    """Reduce the twelve equations to nine with the same zeros. Kernel.

    Six rows are F; three are combinations of F without C^2 of joint 4, one power further.

    Parameters
    ----------
    F : (6, 9), of :func:`at_angle`, changed
    M : (9, 9), filled, singular where the twelve equations are

    Returns
    -------
    factor : by which the determinant of M is that of the twelve equations
    smallest : smallest pivot
    """
    for r in range(6):
        for j in range(9):
            M[r, j] = F[r, j]
    factor, smallest = eliminate(F, 6, 3)
    for r in range(3):
        for j in range(6):
            M[6 + r, j] = F[3 + r, 3 + j]
        for j in range(6, 9):
            M[6 + r, j] = 0.0
    return factor, smallest


@inner_kernel
def determinant_at(equations: Reals, angle: float, F: Reals, M: Reals) -> tuple[float, float]:
    """The determinant of the twelve equations at an angle, and about how much of it is rounding. Kernel.

    Parameters
    ----------
    equations : (3, 6, 9)
    angle : rad, of the hidden joint
    F, M : (6, 9) and (9, 9), scratch memory

    Returns
    -------
    value, rounding : the determinant, and its error by the smallest pivot
    """
    at_angle(equations, angle, F)
    factor, smallest = nine_rows(F, M)
    value, smallest_of_nine = eliminate(M, 9, 9)
    smallest = min(smallest, smallest_of_nine)
    value *= factor
    return value, ROUNDING * abs(value) / smallest if smallest > 0.0 else 0.0


@kernel
def sampled_determinant(m: Scratch) -> tuple[float, float]:
    """Find the determinant's coefficients as a trigonometric polynomial, from samples. Kernel.

    Parameters
    ----------
    m : scratch memory with equations; ``m.terms`` (20,) is filled with the coefficients 1, cos, sin, ...

    Returns
    -------
    peak : the largest sample
    noise : size of the three terms above degree 8, which are rounding only
    """
    F, M = np.empty((6, 9)), np.empty((9, 9))
    peak = 0.0
    for i in range(SAMPLES):
        m.samples[i] = determinant_at(m.equations, SAMPLE_ANGLES[i], F, M)[0]
        peak = max(peak, abs(m.samples[i]))
    noise = 0.0
    for k in range(SAMPLES):
        total = 0.0
        for i in range(SAMPLES):
            total += HARMONICS[k, i] * m.samples[i]
        m.terms[k] = total
        if k >= 17:
            noise = max(noise, abs(total))
    return peak, noise
