"""Six joints, two of them prismatic, in any order and direction: all solutions, up to eight.

The four revolute joints must close the orientation alone, ``Rz(x_1) A_1 Rz(x_2) A_2 Rz(x_3) A_3 Rz(x_4) A_4 = 1``:
the loop of a spherical four-bar. For each x_1 two angles x_2 do so, and the other two follow from both. The position is
linear in the slides, so they go out with one determinant [1]_: that of both sliding directions and of where the loop
ends with both slides at 0. Its product over both angles x_2, times a power of what the roots of x_2 divide by, is a
trigonometric polynomial in x_1; samples give it, with further terms that would vanish without rounding, and the
eigenvalues of its companion matrix are its zeros. Newton's method on the chain decides what is a solution.

The loop can be read from each of the four joints on in either sense; special geometry spoils some readings, and what
one leaves in doubt the next look at, too.

References
----------
.. [1] C. Mavroidis, B. Roth, "Structural parameters which reduce the number of manipulator configurations", J. Mech.
   Design 116 (1994).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from er3a.by_value import by_identity
from er3a.geometry.transforms import inverted
from er3a.kinematics.chain import invert_rigid, poses_of, size_of
from er3a.kinematics.classes.hidden_joint import HARMONICS, SAMPLE_ANGLES, SAMPLES
from er3a.kinematics.classes.loop_rows import LoopMemory
from er3a.kinematics.classes.polish import SOLVES
from er3a.kinematics.classes.six_revolute import (
    CERTAIN,
    CONTINUUM,
    STUCK,
    UNCERTAIN,
    RowsFound,
    add_root,
    all_rows,
)
from er3a.numerics.arrays import Complexes, Flags, Integers, Reals, zeros_of
from er3a.numerics.jit import inner_kernel, kernel

TRIALS = 24  # random poses on which readings are compared
MAX_READINGS = 3  # that are conclusive, for a pose in doubt
NOISE = 1e-9  # of the largest sample: more, and a reading is inconclusive
MIN_SAMPLE = 1e-20  # largest sample below which a reading vanishes for all poses
MAX_DEGREE = 8  # of the trigonometric polynomial in joint 1
FAINT = 1e-13  # of the largest coefficient: so small ones are rounding
ACROSS = 1e-6  # sine between the axes of the two joints that follow
ON_CIRCLE, NEAR_CIRCLE = 1e-6, 3e-2  # a zero's distance from the unit circle: real; perhaps one of several that meet
NOWHERE = 1e-12  # of a reading's usual largest sample: a polynomial as small as this vanishes
CLUSTER = 1e-3  # distance from the unit circle at which a zero without a solution leaves a doubt


class SlideReading(NamedTuple):
    """The loop read from a joint that turns on, in one sense.

    ``joint`` (6,), ``sense``, ``links`` (6, 4, 4) and ``place`` as in :class:`hidden_joint.Reading`; ``slides`` (6,)
    determines the sliding places; the polynomial has this ``degree`` if the product is taken times ``rho^(2 power)``,
    and its largest sample is about ``usual`` times the square of the pose's distance.
    """

    joint: Integers
    sense: float
    links: Reals
    place: int
    slides: Flags
    power: int
    degree: int
    usual: float


@by_identity
class TwoSlides:
    """What the solver keeps of a chain: links in units of its size, and readings of its loop, best first."""

    links: Reals
    size: float
    sliding: Flags
    readings: tuple[SlideReading, ...]


def two_slides(links: Reals, sliding: Flags) -> TwoSlides | None:
    """The solver of six joints, two of which are prismatic; readings are tried out on poses of random joints.

    Parameters
    ----------
    links : (7, 4, 4), m
    sliding : (6,), prismatic joints

    Returns
    -------
    solver : None if no reading of the loop determines its solutions
    """
    size = size_of(links)
    scaled = np.array(links, float)
    scaled[:, :3, 3] /= size
    random = np.random.default_rng(7)
    q = random.uniform(-1, 1, (TRIALS, 6)) * np.where(sliding, 1.0, np.pi)
    loops = scaled[6] @ inverted(poses_of(scaled, q, sliding)) @ scaled[0]
    ranked = []
    for number, (joint, sense, arranged, place, slides) in enumerate(_arrangements(scaled, sliding)):
        for power in (1, 2):
            reading = SlideReading(joint, sense, arranged, place, slides, power, MAX_DEGREE, 1.0)
            terms, peak = _polynomials(reading, loops)
            clear = _clear(terms, peak) & (peak > MIN_SAMPLE)
            if clear.sum() * 2 <= TRIALS:
                continue
            reading = reading._replace(usual=float(np.median((peak / _reach(loops) ** 2)[clear])))
            size_of_terms = np.abs(terms[clear]) / np.abs(terms[clear]).max(axis=1, keepdims=True)
            degree = (int(np.flatnonzero((size_of_terms > FAINT).any(axis=0))[-1]) + 1) // 2
            degree = min(max(degree, 1), MAX_DEGREE)
            ranked.append((int(TRIALS - clear.sum()), degree, power, number, reading._replace(degree=degree)))
            break
    if not ranked:
        return None
    ranked.sort(key=lambda entry: entry[:-1])
    return TwoSlides(scaled, size, np.asarray(sliding, dtype=bool), tuple(entry[-1] for entry in ranked))


def _arrangements(links: Reals, sliding: Flags) -> list[tuple[Integers, float, Reals, int, Flags]]:
    """Joints, sense, links, place of the pose's link and slides of the loop as read from each turning joint on."""
    found = []
    for backwards in (False, True):
        for shift in range(6):
            order = [(4 - i - shift) % 6 if backwards else (i + shift) % 6 for i in range(6)]
            joint = np.array([(k + 1) % 6 if backwards else k for k in order])
            if sliding[joint[0]]:
                continue
            arranged = np.array([links[k + 1] for k in order])
            if backwards:
                arranged = inverted(arranged)
            sense = -1.0 if backwards else 1.0
            found.append((joint, sense, arranged, order.index(5), np.asarray(sliding)[joint]))
    return found


def solve_two_slides(arm: TwoSlides, T: Reals) -> RowsFound:
    """All solutions for poses, by the determinant that takes both slides out [1]_.

    Parameters
    ----------
    T : (N, 4, 4), m

    Returns
    -------
    found : (N, 16, 6), rad and m, NaN after the last
    """
    return all_rows(arm, _by_readings, T)


def _by_readings(arm: TwoSlides, T: Reals, memory: LoopMemory, q: Reals, count: Integers, certainty: Integers) -> None:
    """Fill rows (N, 16, 6), their number (N,) and certainty (N,), which starts as CONTINUUM."""
    loops = arm.links[6] @ inverted(T) @ arm.links[0]
    far = _reach(loops) ** 2
    readings_used, left, moving = np.zeros(len(T), dtype=np.int64), np.arange(len(T)), np.zeros(len(T), dtype=bool)
    for reading in arm.readings:
        if not left.size:
            break
        terms, peak = _polynomials(reading, loops[left])
        vanishes = peak < NOWHERE * reading.usual * far[left]
        moving[left] |= vanishes
        clear = _clear(terms, peak) & ~vanishes
        known = left[clear]
        verdicts = np.empty(len(known), dtype=np.int64)
        zeros = _zeros(terms[clear], reading.degree)
        _rows(reading, arm.links, T, loops, known, zeros, memory, q, count, verdicts)
        certainty[known] = np.minimum(certainty[known], verdicts)
        moving[known] |= verdicts == CONTINUUM
        readings_used[known] += 1
        done = np.zeros(len(T), dtype=bool)
        done[known] = verdicts == CERTAIN
        left = left[~done[left] & (readings_used[left] < MAX_READINGS)]
    certainty[moving] = CONTINUUM


def _reach(loops: Reals) -> Reals:
    """How far (N,) the poses of loops are, in units of the chain's size, at least 1."""
    return np.asarray(np.maximum(1.0, np.linalg.norm(loops[:, :3, 3], axis=1)))


def _clear(terms: Reals, peak: Reals) -> Flags:
    """Whether the terms (N, 20) that would vanish without rounding are small; False where the reading is
    inconclusive."""
    return np.asarray(np.abs(terms[:, 2 * MAX_DEGREE + 1 :]).max(axis=1) < NOISE * peak)


def _polynomials(reading: SlideReading, loops: Reals) -> tuple[Reals, Reals]:
    """Coefficients (N, 20) 1, cos, sin, ... for the loop's links with the pose (N, 4, 4), and the largest samples."""
    samples = np.empty((len(loops), SAMPLES))
    _sampled(reading, np.ascontiguousarray(loops), SAMPLE_ANGLES, samples)
    return samples @ HARMONICS.T, np.abs(samples).max(axis=1)


def _zeros(terms: Reals, degree: int) -> Reals:
    """Angle and logarithm of the modulus (N, 2 degree, 2) of ``exp(i x)`` at the zeros; NaN where there is none."""
    count = 2 * degree
    ascending = np.zeros((len(terms), count + 1), dtype=complex)
    ascending[:, degree] = terms[:, 0]
    for k in range(1, degree + 1):
        # As a polynomial in z = exp(i x), of twice the degree; real zeros are on the unit circle.
        ascending[:, degree + k] = 0.5 * (terms[:, 2 * k - 1] - 1j * terms[:, 2 * k])
        ascending[:, degree - k] = np.conj(ascending[:, degree + k])
    largest = np.abs(ascending).max(axis=1, initial=0.0)
    out = np.full((len(terms), count, 2), np.nan)
    size = np.zeros(len(terms), dtype=int)  # of this pose's own degree
    for k in range(1, degree + 1):
        size[np.abs(ascending[:, degree + k]) > FAINT * largest] = k
    for own in np.unique(size[size > 0]).tolist():
        at = size == own
        a = ascending[at, degree - own : degree + own + 1]
        z = zeros_of(a)
        out[at, : 2 * own, 0], out[at, : 2 * own, 1] = np.angle(z), np.log(np.maximum(np.abs(z), 1e-300))
    return out


@inner_kernel
def _loop_of(reading: SlideReading, pose_link: Reals, links: Reals, A: Reals) -> None:
    """Fill ``links`` (6, 4, 4) of the loop and the rotations ``A`` (4, 3, 3) after each revolute joint."""
    for i in range(6):
        links[i] = reading.links[i]
    K = links[reading.place]
    if reading.sense > 0.0:
        K[:, :] = pose_link
    else:
        invert_rigid(pose_link, K)
    at = -1
    for i in range(6):
        if not reading.slides[i]:
            at += 1
            A[at] = links[i, :3, :3]
        else:
            A[at] = A[at].copy() @ np.ascontiguousarray(links[i, :3, :3])


@inner_kernel
def _second_angle(A: Reals, c1: float, s1: float) -> tuple[float, float, float]:
    """a, b, c of ``a cos x_2 + b sin x_2 + c = 0``, which keeps the angle between the axes of joints 3 and 4."""
    r0 = A[3, 2, 0] * c1 + A[3, 2, 1] * s1
    r1 = A[3, 2, 1] * c1 - A[3, 2, 0] * s1
    r2 = A[3, 2, 2]
    t0 = r0 * A[0, 0, 0] + r1 * A[0, 1, 0] + r2 * A[0, 2, 0]
    t1 = r0 * A[0, 0, 1] + r1 * A[0, 1, 1] + r2 * A[0, 2, 1]
    t2 = r0 * A[0, 0, 2] + r1 * A[0, 1, 2] + r2 * A[0, 2, 2]
    w0, w1, w2 = A[1, 0, 2], A[1, 1, 2], A[1, 2, 2]
    return t0 * w0 + t1 * w1, t1 * w0 - t0 * w1, t2 * w2 - A[2, 2, 2]


@inner_kernel
def _others(A: Reals, turns: Complexes) -> None:
    """Fill rows 2 and 3 of ``turns`` (4, 2), complex cosine and sine of each joint, from rows 0 and 1."""
    M = np.zeros((3, 3), np.complex128)
    row, other = np.zeros(3, np.complex128), np.zeros(3, np.complex128)
    for i in range(3):
        for j in range(3):
            row[j] = A[3, i, j]
        for k in range(2):
            c, s = turns[k, 0], turns[k, 1]
            other[0], other[1], other[2] = row[0] * c + row[1] * s, row[1] * c - row[0] * s, row[2]
            for j in range(3):
                row[j] = other[0] * A[k, 0, j] + other[1] * A[k, 1, j] + other[2] * A[k, 2, j]
        for j in range(3):
            M[i, j] = row[j]
    g0, g1, h0, h1 = A[2, 2, 0], A[2, 2, 1], A[2, 0, 2], A[2, 1, 2]
    per = 1.0 / (g0 * g0 + g1 * g1)
    turns[3, 0], turns[3, 1] = (g0 * M[0, 2] + g1 * M[1, 2]) * per, (g1 * M[0, 2] - g0 * M[1, 2]) * per
    turns[2, 0], turns[2, 1] = (h0 * M[2, 0] + h1 * M[2, 1]) * per, (h0 * M[2, 1] - h1 * M[2, 0]) * per


@inner_kernel
def _ends(links: Reals, slides: Flags, turns: Complexes, shifts: Complexes) -> complex:
    """The determinant of both sliding directions and of where the loop ends with the slides at 0, which are the rows
    of ``ways`` (3, 3), complex."""
    R, S = np.zeros((3, 3), np.complex128), np.zeros((3, 3), np.complex128)
    for i in range(3):
        R[i, i] = 1.0
        shifts[2, i] = 0.0
    turn, slide = 0, 0
    for k in range(6):
        if slides[k]:
            for i in range(3):
                shifts[slide, i] = R[i, 2]
            slide += 1
        else:
            c, s = turns[turn, 0], turns[turn, 1]
            turn += 1
            for i in range(3):
                R[i, 0], R[i, 1] = R[i, 0] * c + R[i, 1] * s, R[i, 1] * c - R[i, 0] * s
        for i in range(3):
            shifts[2, i] += R[i, 0] * links[k, 0, 3] + R[i, 1] * links[k, 1, 3] + R[i, 2] * links[k, 2, 3]
            for j in range(3):
                S[i, j] = R[i, 0] * links[k, 0, j] + R[i, 1] * links[k, 1, j] + R[i, 2] * links[k, 2, j]
        R[:, :] = S
    u, v, p = shifts[0], shifts[1], shifts[2]
    value: complex = (
        p[0] * (u[1] * v[2] - u[2] * v[1]) + p[1] * (u[2] * v[0] - u[0] * v[2]) + p[2] * (u[0] * v[1] - u[1] * v[0])
    )
    return value


@kernel
def _sampled(reading: SlideReading, loops: Reals, angles: Reals, samples: Reals) -> None:
    """Values (N, S) of the polynomial, NaN where the reading is inconclusive."""
    links, A = np.empty((6, 4, 4)), np.empty((4, 3, 3))
    turns, shifts = np.zeros((4, 2), np.complex128), np.zeros((3, 3), np.complex128)
    for n in range(loops.shape[0]):
        _loop_of(reading, loops[n], links, A)
        usable = np.hypot(A[2, 2, 0], A[2, 2, 1]) > ACROSS
        for m in range(angles.shape[0]):
            samples[n, m] = 0.0 if usable else np.nan
            c1, s1 = np.cos(angles[m]), np.sin(angles[m])
            a, b, c = _second_angle(A, c1, s1)
            square = a * a + b * b
            if not usable or square < 1e-24:
                continue
            root = np.sqrt(complex(square - c * c, 0.0))
            turns[0, 0], turns[0, 1] = c1, s1
            # Both roots of x_2 together have no square root of x_1 left; the power takes away what they divide by.
            product = complex(square**reading.power, 0.0)
            for side in range(2):
                sign = 1.0 - 2.0 * side
                turns[1, 0], turns[1, 1] = (-c * a - sign * b * root) / square, (-c * b + sign * a * root) / square
                _others(A, turns)
                product *= _ends(links, reading.slides, turns, shifts)
            samples[n, m] = product.real


@kernel
def _rows(
    reading: SlideReading,
    chain: Reals,
    poses: Reals,
    loops: Reals,
    numbers: Integers,
    zeros: Reals,
    m: LoopMemory,
    q: Reals,
    count: Integers,
    verdicts: Integers,
) -> None:
    """Add to ``q`` (N, 16, 6) and ``count`` (N,) the solutions at zeros (k, z, 2) of the poses with numbers (k,)."""
    links, A = np.empty((6, 4, 4)), np.empty((4, 3, 3))
    turns, shifts = np.zeros((4, 2), np.complex128), np.zeros((3, 3), np.complex128)
    for i in range(numbers.shape[0]):
        n = numbers[i]
        _loop_of(reading, loops[n], links, A)
        reach = max(1.0, abs(poses[n, 0, 3]), abs(poses[n, 1, 3]), abs(poses[n, 2, 3]))
        verdict, expected, before = CERTAIN, 0, count[n]
        for z in range(zeros.shape[1]):
            # Zeros off the unit circle are complex angles; those near to it may be real ones that rounding has moved.
            off = abs(zeros[i, z, 1])
            if not off < NEAR_CIRCLE:
                continue
            solved = False
            c1, s1 = np.cos(zeros[i, z, 0]), np.sin(zeros[i, z, 0])
            a, b, c = _second_angle(A, c1, s1)
            square = a * a + b * b
            if square < 1e-24:
                verdict = max(verdict, UNCERTAIN)
                continue
            root = np.sqrt(max(square - c * c, 0.0))
            turns[0, 0], turns[0, 1] = c1, s1
            for side in range(2):
                sign = 1.0 - 2.0 * side
                turns[1, 0], turns[1, 1] = (-c * a - sign * b * root) / square, (-c * b + sign * a * root) / square
                _others(A, turns)
                _ends(links, reading.slides, turns, shifts)
                _as_joints(reading, turns, shifts, m.candidate)
                count[n], pivot = add_root(chain, poses[n], m, 12, SOLVES * reach, q[n], count[n])
                if pivot >= 0.0:
                    away = m.candidate[reading.joint[0]] * reading.sense - zeros[i, z, 0]
                    away -= 2 * np.pi * np.round(away / (2 * np.pi))
                    solved = solved or abs(away) < 1e-2
                    if pivot < STUCK:
                        verdict = CONTINUUM
            expected += off < ON_CIRCLE
            if off < CLUSTER and not solved:
                verdict = max(verdict, UNCERTAIN)
        # Complex solutions come in pairs, and each zero on the circle has a solution of its own.
        if count[n] % 2 == 1 or (before == 0 and count[n] < expected):
            verdict = max(verdict, UNCERTAIN)
        verdicts[i] = verdict


@inner_kernel
def _as_joints(reading: SlideReading, turns: Complexes, shifts: Complexes, x: Reals) -> None:
    """Fill x (6,) with the arm's joints: angles of ``turns``, slides that bring the loop's end back."""
    u, v, p = shifts[0].real, shifts[1].real, shifts[2].real
    inner, pu, pv = 0.0, 0.0, 0.0
    for i in range(3):
        inner += u[i] * v[i]
        pu += p[i] * u[i]
        pv += p[i] * v[i]
    across = 1.0 - inner * inner
    first, second = -pu, 0.0
    if across > 1e-12:
        first, second = (inner * pv - pu) / across, (inner * pu - pv) / across
    turn, slide = 0, 0
    for k in range(6):
        if reading.slides[k]:
            x[reading.joint[k]] = reading.sense * (first if slide == 0 else second)
            slide += 1
        else:
            x[reading.joint[k]] = reading.sense * np.arctan2(turns[turn, 1].real, turns[turn, 0].real)
            turn += 1
