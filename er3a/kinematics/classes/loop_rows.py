"""From a zero of the hidden joint's determinant to all six joints, and the memory that one pose needs.

The null vector of the nine equations holds squares and products of half-angle cosines and sines of joints 4 and 5;
where two solutions share the hidden joint's angle, the two null vectors are distinguished by a pencil. Joint 1 follows
from the reflected rows, joint 2 from the angle between both sides, joint 6 closes the loop.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.kinematics.chain import multiply_rigid, post_rotate_z
from er3a.kinematics.classes.hidden_joint import (
    LOCAL_ORDER,
    NODES,
    SHIFT_4,
    SHIFT_5,
    TERMS,
    Reading,
    Scratch,
    at_angle,
    determinant_at,
    new_scratch,
    nine_rows,
    zeros_between,
    zeros_on_circle,
)
from er3a.kinematics.classes.polish import null_vector, pivoted
from er3a.numerics.arrays import Flags, Integers, Reals, for_kernel
from er3a.numerics.jit import inner_kernel, kernel

MAX_ZEROS = 48  # rows for zeros and for intervals that may hold one; a pose has 16 zeros at most
MAX_DARK = 64  # dark intervals of a pose; with more the reading is given up
WIDEST = 0.2  # rad, that a dark interval is sampled in one piece
NARROWEST = 1e-6  # rad: a dark interval this narrow is given as one possible zero
DEEPEST = 4.0  # times that a dark interval is sampled anew within one
NEAR_NULL = 1e-4  # of the first pivot: below, a second null vector may belong to another solution


class LoopMemory(NamedTuple):
    """Scratch memory of one thread."""

    elimination: Scratch
    found: Reals
    zeros: Reals
    values: Reals
    stack: Reals
    F: Reals
    M: Reals
    frames: Reals
    J: Reals
    dq: Reals
    columns: Integers
    pairs: Reals
    x: Reals
    candidate: Reals
    start: Reals
    sliding: Flags


def new_memory(sliding: Flags) -> LoopMemory:
    """Working memory of one thread.

    Parameters
    ----------
    sliding : (6,), prismatic joints

    Returns
    -------
    memory : for the kernels of this module and of :mod:`polish`
    """
    return LoopMemory(
        elimination=new_scratch(),
        found=np.zeros((MAX_ZEROS, 3)),
        zeros=np.zeros((MAX_ZEROS, 3)),
        values=np.zeros(LOCAL_ORDER + 1),
        stack=np.zeros((100, TERMS + 2)),
        F=np.zeros((6, 9)),
        M=np.zeros((9, 9)),
        frames=np.zeros((2, 4, 4)),
        J=np.zeros((6, 7)),
        dq=np.zeros(12),
        columns=np.zeros(6, dtype=np.int64),
        pairs=np.zeros((12, 2)),
        x=np.zeros((2, 6)),
        candidate=np.zeros(6),
        start=np.zeros(6),
        sliding=for_kernel(sliding),
    )


@kernel
def hidden_angles(e: Scratch, level: float, m: LoopMemory) -> int:  # noqa: C901, PLR0912
    """Find the hidden joint's possible angles. Kernel.

    Dark intervals are sampled anew by determinants on them alone, whose rounding is that of their own size.

    Parameters
    ----------
    e : with the equations and terms of a pose
    level : noise of the polynomial
    m : memory; ``m.zeros`` (48, 3) is filled, rad, column 2 is 0 where it is not one clear zero

    Returns
    -------
    count : how many; -1 if there is no place
    """
    found = zeros_on_circle(e.terms, level, m.found, m.stack)
    if found < 0:
        return -1
    count, dark = 0, np.empty((MAX_DARK, 3))
    waiting = 0
    for row in range(found):
        low, high = m.found[row, 0], m.found[row, 1]
        if m.found[row, 2] != 0.0:
            m.zeros[count] = m.found[row]
            count += 1
            continue
        parts = int(np.ceil((high - low) / WIDEST))
        for part in range(parts):
            if waiting == MAX_DARK:
                return -1
            step, margin = (high - low) / parts, 0.1 * (high - low) / parts + 1e-7
            dark[waiting, 0], dark[waiting, 1] = low + part * step - margin, low + (part + 1) * step + margin
            dark[waiting, 2] = 0.0
            waiting += 1
    F, M, peak = m.F, m.M, np.abs(e.samples).max()
    looked = 0
    while waiting > 0:
        waiting -= 1
        low, high, depth = dark[waiting, 0], dark[waiting, 1], dark[waiting, 2]
        looked += 1
        if looked > MAX_DARK:
            return -1
        middle, half, noise = 0.5 * (low + high), 0.5 * (high - low), 0.0
        for i in range(LOCAL_ORDER + 1):
            m.values[i], rounding = determinant_at(e.equations, middle + half * NODES[i], F, M)
            noise = max(noise, rounding)
        found = zeros_between(m.values, noise, peak, low, high, m.found, m.stack)
        if found < 0:
            return -1
        for row in range(found):
            below, above = m.found[row, 0], m.found[row, 1]
            if m.found[row, 2] == 0.0 and above - below > NARROWEST and depth < DEEPEST:
                if waiting == MAX_DARK:
                    return -1
                margin = 0.1 * (above - below)
                dark[waiting, 0], dark[waiting, 1], dark[waiting, 2] = below - margin, above + margin, depth + 1.0
                waiting += 1
                continue
            if count == MAX_ZEROS:
                return -1
            m.zeros[count, 0], m.zeros[count, 1], m.zeros[count, 2] = 0.5 * (below + above), above, m.found[row, 2]
            count += 1
    return count


@inner_kernel
def pairs_at(e: Scratch, angle: float, slides: Flags, m: LoopMemory) -> int:
    """Find the angles of joints 4 and 5 at a zero, from null vectors of the nine equations. Kernel.

    Parameters
    ----------
    e : with the equations of a pose
    angle : rad, of the hidden joint
    slides : (6,), prismatic places of the loop
    m : memory; ``m.pairs`` (12, 2) is filled, rad or parts of the size

    Returns
    -------
    count : how many pairs
    """
    at_angle(e.equations, angle, m.F)
    nine_rows(m.F, m.M)
    M = m.M
    order = np.empty(9, np.int64)
    pivoted(M, order)
    Y = np.zeros((2, 9))
    null_vector(M, order, 8, 8, Y[0])
    count = 0
    m.pairs[count, 0], m.pairs[count, 1] = _angles_of(Y[0], slides)
    count += 1
    if abs(M[7, 7]) < NEAR_NULL * abs(M[0, 0]):
        null_vector(M, order, 7, 7, Y[1])
        null_vector(M, order, 8, 7, Y[0])
        count = _pencil(Y, 3, slides, m.pairs, count)
        count = _pencil(Y, 1, slides, m.pairs, count)
    return count


@inner_kernel
def _angles_of(y: Reals, slides: Flags) -> tuple[float, float]:
    """The two angles (or lengths) whose half-angle squares and products are nearest to y (3 x 3)."""
    row, column, best = 0, 0, -1.0
    for i in range(3):
        for j in range(3):
            if abs(y[3 * i + j]) > best:
                row, column, best = i, j, abs(y[3 * i + j])
    first = _angle_of(y[column], y[3 + column], y[6 + column])
    second = _angle_of(y[3 * row], y[3 * row + 1], y[3 * row + 2])
    return (
        np.tan(0.5 * first) if slides[3] else first + SHIFT_4,
        np.tan(0.5 * second) if slides[4] else second + SHIFT_5,
    )


@inner_kernel
def _angle_of(cc: float, cs: float, ss: float) -> float:
    """The angle whose half has the squares and product of cosine and sine nearest to these three."""
    sign = 1.0 if cc + ss >= 0.0 else -1.0
    angle: float = np.arctan2(2.0 * cs * sign, (cc - ss) * sign)
    return angle


@inner_kernel
def _pencil(Y: Reals, step: int, slides: Flags, pairs: Reals, count: int) -> int:
    """Combinations of two null vectors that belong to one angle: entries one power further are tan(half) times.

    ``step`` is 3 to decide by joint 4, 1 by joint 5. For the angle's (C, S), S low - C high = 0 with low and high the
    six entries without the highest and without the lowest power; projected to two equations.
    """
    low, high = np.empty((2, 6)), np.empty((2, 6))
    for b in range(2):
        for i in range(2):
            for j in range(3):
                at = 3 * i + j if step == 3 else 3 * j + i
                low[b, 3 * i + j], high[b, 3 * i + j] = Y[b, at], Y[b, at + step]
    P, Q = np.zeros((2, 2)), np.zeros((2, 2))
    for a in range(2):
        for b in range(2):
            for k in range(6):
                side = 0.6 * low[a, k] + 0.8 * high[a, k]
                P[a, b] += side * low[b, k]
                Q[a, b] += side * high[b, k]
    # det(S P - C Q) = 0
    ss = P[0, 0] * P[1, 1] - P[0, 1] * P[1, 0]
    cc = Q[0, 0] * Q[1, 1] - Q[0, 1] * Q[1, 0]
    sc = -(P[0, 0] * Q[1, 1] + P[1, 1] * Q[0, 0] - P[0, 1] * Q[1, 0] - P[1, 0] * Q[0, 1])
    under = 0.25 * sc * sc - ss * cc
    root = np.sqrt(max(under, 0.0))
    y = np.empty(9)
    for side in range(2):
        # ss S^2 + sc S C + cc C^2 = 0 without cancellation
        h = -0.5 * sc - (root if sc > 0.0 else -root)
        S, C = (h, ss) if side == 0 else (cc, h)
        length = np.hypot(S, C)
        if length == 0.0:
            continue
        S, C = S / length, C / length
        a, b = S * P[0, 0] - C * Q[0, 0], S * P[0, 1] - C * Q[0, 1]
        c, d = S * P[1, 0] - C * Q[1, 0], S * P[1, 1] - C * Q[1, 1]
        if abs(a) + abs(b) < abs(c) + abs(d):
            a, b = c, d
        for k in range(9):
            y[k] = b * Y[0, k] - a * Y[1, k]
        if count < pairs.shape[0]:
            pairs[count, 0], pairs[count, 1] = _angles_of(y, slides)
            count += 1
    return count


@inner_kernel
def remaining_joints(reading: Reading, e: Scratch, m: LoopMemory) -> int:  # noqa: C901, PLR0912
    """Find joints 1, 2 and 6 from joints 3, 4 and 5. Kernel.

    Parameters
    ----------
    reading : of the loop
    e : with both sides of the pose's equations
    m : memory; ``m.x[0]`` (6,) holds joints 3, 4 and 5, and gets the others, rad or parts of the size

    Returns
    -------
    count : two, with ``m.x[1]`` filled too, where the equations leave two values of joint 1; else one
    """
    x = m.x[0]
    half_4, half_5 = 0.5 * (x[3] - SHIFT_4), 0.5 * (x[4] - SHIFT_5)
    c4, s4, c5, s5 = np.cos(half_4), np.sin(half_4), np.cos(half_5), np.sin(half_5)
    if reading.slides[3]:
        c4, s4 = 1.0, x[3]
    if reading.slides[4]:
        c5, s5 = 1.0, x[4]
    monomials = np.empty(27)
    trig = (np.cos(x[2]), np.sin(x[2]), 1.0)
    powers_4, powers_5 = (c4 * c4, c4 * s4, s4 * s4), (c5 * c5, c5 * s5, s5 * s5)
    for i in range(3):
        for u in range(3):
            for v in range(3):
                monomials[9 * i + 3 * u + v] = trig[i] * powers_4[u] * powers_5[v]
    A = e.along
    b0, b1 = -A[0, 2], -A[1, 2]
    for j in range(27):
        b0 += A[0, 3 + j] * monomials[j]
        b1 += A[1, 3 + j] * monomials[j]
    count = 1
    if reading.slides[0]:
        count = _first_shift(A[0, 0], A[0, 1], A[1, 1], b0, b1, m.x)
    elif abs(A[1, 1]) > 1e-5 * (abs(A[0, 0]) + abs(A[0, 1])):
        s = b1 / A[1, 1]
        if abs(A[0, 0]) > 1e-5 * abs(A[0, 1]):
            x[0] = np.arctan2(s, (b0 - A[0, 1] * s) / A[0, 0])
        else:
            rest = np.sqrt(max(1.0 - s * s, 0.0))
            m.x[1, 2:5] = x[2:5]
            x[0], m.x[1, 0] = np.arctan2(s, rest), np.arctan2(s, -rest)
            count = 2
    else:
        middle = np.arctan2(A[0, 1], A[0, 0])
        ratio = b0 / max(np.hypot(A[0, 0], A[0, 1]), 1e-300)
        spread = np.arccos(min(max(ratio, -1.0), 1.0))
        m.x[1, 2:5] = x[2:5]
        x[0], m.x[1, 0] = middle + spread, middle - spread
        count = 2
    left = reading.left if reading.place == 0 or reading.place == 5 else e.left
    across = np.zeros(8)
    for r in range(8):
        total = 0.0
        for j in range(27):
            total += left[6 + r, j] * monomials[j]
        across[r] = total
    for k in range(count):
        _second_and_last(e, across, reading.slides, m.x[k])
    return count


@inner_kernel
def _first_shift(square: float, linear: float, alone: float, b0: float, b1: float, x: Reals) -> int:
    """Joint 1 that slides, from ``square x^2 + linear x = b0`` and ``alone x = b1``, into ``x`` (2, 6); how many."""
    if abs(alone) > 1e-5 * (abs(square) + abs(linear)):
        x[0, 0] = b1 / alone
        return 1
    x[1, 2:5] = x[0, 2:5]
    h = -0.5 * (linear + np.copysign(np.sqrt(max(linear * linear + 4.0 * square * b0, 0.0)), linear))
    x[0, 0] = h / square if square != 0.0 else 0.0
    x[1, 0] = -b0 / h if h != 0.0 else 0.0
    return 2


@inner_kernel
def _second_and_last(e: Scratch, across: Reals, slides: Flags, x: Reals) -> None:
    """Joint 2 by the rows across it, then joint 6 as what closes the loop, into ``x`` (6,)."""
    c, s = (x[0] * x[0], x[0]) if slides[0] else (np.cos(x[0]), np.sin(x[0]))
    re, im = 0.0, 0.0
    for b in range(4):
        u = c * e.right[0, 3 * b] + s * e.right[1, 3 * b] + e.right[2, 3 * b]
        v = c * e.right[0, 3 * b + 1] + s * e.right[1, 3 * b + 1] + e.right[2, 3 * b + 1]
        re += across[2 * b] * u + across[2 * b + 1] * v
        im += across[2 * b] * v - across[2 * b + 1] * u
    x[1] = np.arctan2(im, re)
    frame, other = np.empty((4, 4)), np.empty((4, 4))
    frame[:, :] = e.links[5]
    for k in range(5):
        if slides[k]:
            for i in range(3):
                frame[i, 3] += frame[i, 2] * x[k]
        else:
            post_rotate_z(frame, np.cos(x[k]), np.sin(x[k]))
        multiply_rigid(frame, e.links[k], other)
        frame, other = other, frame
    x[5] = -np.arctan2(frame[1, 0] - frame[0, 1], frame[0, 0] + frame[1, 1])
