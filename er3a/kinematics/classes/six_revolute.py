"""All solutions, up to sixteen, of any chain of six revolute joints.

One joint's angle follows from the zeros of a trigonometric polynomial (:mod:`hidden_joint`); the
null vector of its matrix gives two more, the remaining three follow one by one, and Newton's method on the chain itself
(:mod:`polish`) decides what is a solution.

The certainty rests on measured noise: the polynomial's noise is known from terms that vanish in exact arithmetic. A
place where the polynomial sinks into the noise is searched like a zero. If the noise is large, a zero yields no
solution, or a place is dark, further readings of the loop are taken and their solutions united. A pose that stays in
doubt is also solved at neighbouring poses, whose solutions are followed back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Protocol, TypeVar

import numpy as np

from er3a.by_value import by_identity
from er3a.geometry.transforms import exp_rotation, inverted
from er3a.kinematics.chain import invert_rigid, multiply_rigid, poses_of, size_of
from er3a.kinematics.classes.hidden_joint import Reading, equations_of_pose, readings_of, sampled_determinant
from er3a.kinematics.classes.loop_rows import LoopMemory, hidden_angles, new_memory, pairs_at, remaining_joints
from er3a.kinematics.classes.polish import SOLVES, newton, residual_and_jacobian, twin_start
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.jit import inner_kernel, kernel

SLOTS = 16
SAME_ZERO = 1e-9  # rad: zeros of two intervals that overlap
SAME = 1e-6  # rad: nearer rows are one
SPREAD = 1e-11  # rad
MAYBE_SAME = 1e-2  # rad: rows nearer than this are one if what lies midway solves the pose too
DARK = 200.0  # noise is taken as so many times what it was measured to be
LOUD = 1e-7  # of the largest sample: with more noise than this a reading is not certain
FAMILY_PEAK = 1e-25  # largest sample below which the determinant vanishes: the arm can move
MAX_READINGS = 4  # that were conclusive, for a pose in doubt
TRIALS = 24  # random poses on which readings are compared
BESIDE, NOTHING_NEW = 24, 6  # poses next to one in doubt, and after how many that bring nothing new it is left
ASIDE = (1e-3, 1e-2, 3e-2)  # how far from it, in turn: rad and parts of the size

CERTAIN, UNCERTAIN, CONTINUUM = 0, 1, 2
STUCK = 1e-9  # last pivot below which a row may move with the tool at rest


class PreparedArm(Protocol):
    """A chain in units of its size (m), and which joints are prismatic (6,)."""

    @property
    def links(self) -> Reals:
        """(7, 4, 4), lengths in units of the size."""

    @property
    def size(self) -> float:
        """Length (m) that the chain is scaled with."""

    @property
    def sliding(self) -> Flags:
        """(6,) bool, prismatic joints."""


_Arm = TypeVar("_Arm", bound=PreparedArm)


@by_identity
class SixRevolute:
    """What the solver keeps of a chain: links in units of its size, and readings of its loop, best first; whether the
    first is clear at all poses that were tried."""

    links: Reals
    size: float
    sliding: Flags
    readings: tuple[Reading, ...]
    clear: bool


@by_identity
class RowsFound:
    """Solutions of a batch of poses.

    Attributes
    ----------
    q : (N, 16, 6), rad, in (-pi, pi], in order of the first joint; NaN after the last
    count : (N,)
    certainty : (N,), CERTAIN, UNCERTAIN (no reading of the loop was free of doubt) or CONTINUUM (in every reading
        the determinant vanishes: the arm moves with its tool at rest, rows are members)
    """

    q: Reals
    count: Integers
    certainty: Integers


def prepared(links: Reals, sliding: Flags | None = None) -> SixRevolute:
    """The solver for a chain of six joints; readings are tried out on poses of random joints.

    Parameters
    ----------
    links : (7, 4, 4), m
    sliding : (6,), prismatic joints; one is within what the method can do, of two no reading was left so far

    Returns
    -------
    solver : with the readings that are clear most often first
    """
    sliding = np.zeros(6, dtype=bool) if sliding is None else np.asarray(sliding, dtype=bool)
    size = size_of(links)
    scaled = np.array(links, float)
    scaled[:, :3, 3] /= size
    bare = scaled.copy()
    bare[0] = np.eye(4)
    random = np.random.default_rng(7)
    q = random.uniform(-1, 1, (TRIALS, 6)) * np.where(sliding, 1.0, np.pi)
    T = poses_of(bare, q, sliding)
    memory = new_memory(sliding)
    ranked: list[tuple[bool, int, bool, float, int, Reading]] = []
    for number, reading in enumerate(readings_of(bare, sliding)):
        good = _trial(reading, bare, T, memory)
        ranked.append((good < 0.5, -round(4 * good), reading.place not in (0, 5), -good, number, reading))
    ranked.sort(key=lambda entry: entry[:-1])
    clear = bool(ranked) and ranked[0][3] == -1.0
    return SixRevolute(scaled, size, sliding, tuple(entry[5] for entry in ranked if entry[3] < 0), clear)


def _trial(reading: Reading, links: Reals, T: Reals, memory: LoopMemory) -> float:
    """Share of poses in which this reading has a clear polynomial without dark places."""
    good = 0.0
    for pose in T:
        equations_of_pose(reading, links[6] @ inverted(pose), memory.elimination)
        peak, noise = sampled_determinant(memory.elimination)
        if peak < FAMILY_PEAK or noise > LOUD * peak:
            continue
        level = DARK * max(noise, 1e-16 * peak)
        count = hidden_angles(memory.elimination, level, memory)
        good += 0.25 if count < 0 else 0.5 + 0.5 * bool((memory.zeros[:count, 2] == 1.0).all())
    return good / len(T)


def solve_six_revolute(arm: SixRevolute, T: Reals) -> RowsFound:
    """All solutions for poses; each reading takes the poses that those before it left in doubt.

    Parameters
    ----------
    T : (N, 4, 4), m

    Returns
    -------
    found : (N, 16, 6), rad or m, with certainty

    Notes
    -----
    After ``MAX_READINGS`` that were conclusive a pose stays in doubt; those whose determinant vanishes don't count, as
    they may do so next to special geometry where others don't.
    """
    return all_rows(arm, _by_readings, T)


def _by_readings(
    arm: SixRevolute, T: Reals, memory: LoopMemory, q: Reals, count: Integers, certainty: Integers
) -> None:
    """Fill rows (N, 16, 6), their number (N,) and certainty (N,), which starts as CONTINUUM.

    The joint that a reading hides may rest along a self-motion, whose row then differs from others by its pivot only.
    """
    readings_used, left = np.zeros(len(T), dtype=np.int64), np.arange(len(T))
    moving = np.zeros(len(T), dtype=bool)
    for reading in arm.readings:
        verdicts = np.empty(len(left), dtype=np.int64)
        rows_by_reading(reading, arm.links, T, left, memory, q, count, verdicts, moving)
        certainty[left] = np.minimum(certainty[left], verdicts)
        readings_used[left] += verdicts != CONTINUUM
        left = left[(verdicts != CERTAIN) & (readings_used[left] < MAX_READINGS)]
    certainty[moving] = CONTINUUM


def all_rows(
    arm: _Arm, by_readings: Callable[[_Arm, Reals, LoopMemory, Reals, Integers, Integers], None], T: Reals
) -> RowsFound:
    """What readings find at poses, and, where they leave doubt, at poses next to these.

    Parameters
    ----------
    arm : in units of its size
    by_readings : takes arm, poses in units of its size, and memory, and fills rows (N, 16, 6), their number (N,) and
        certainty (N,), which starts as CONTINUUM
    T : (N, 4, 4), m

    Returns
    -------
    found : (N, 16, 6), rad or m, in order of the first joint
    """
    T = np.array(T, dtype=float, order="C")
    T[:, :3, 3] /= arm.size
    q, count = np.full((len(T), SLOTS, 6), np.nan), np.zeros(len(T), dtype=np.int64)
    certainty = np.full(len(T), CONTINUUM)
    memory = new_memory(arm.sliding)
    by_readings(arm, T, memory, q, count, certainty)
    for numbers, beside in _beside(certainty, T, count):
        near = np.full((len(numbers), SLOTS, 6), np.nan), np.zeros(len(numbers), dtype=np.int64)
        by_readings(arm, beside, memory, *near, np.full(len(numbers), CONTINUUM))
        followed_back(arm.links, T, numbers, memory, *near, q, count)
    in_order(q, count)
    q[:, :, arm.sliding] *= arm.size
    return RowsFound(q, count, certainty)


def _beside(certainty: Integers, T: Reals, count: Integers) -> Iterator[tuple[Integers, Reals]]:
    """Numbers (k,) of poses in doubt, and poses (k, 4, 4) next to them, until nothing new is counted."""
    random, in_doubt = np.random.default_rng(3), np.flatnonzero(certainty == UNCERTAIN)
    idle = np.zeros(len(in_doubt), dtype=np.int64)
    for k in range(BESIDE):
        in_doubt, idle = in_doubt[idle < NOTHING_NEW], idle[idle < NOTHING_NEW]
        if not in_doubt.size:
            return
        offset = random.normal(size=6) * ASIDE[k % len(ASIDE)]
        beside = np.eye(4)
        beside[:3, :3] = exp_rotation(offset[:3])
        beside[:3, 3] = offset[3:]
        before = count[in_doubt]
        yield in_doubt, T[in_doubt] @ beside
        idle = np.where(count[in_doubt] > before, 0, idle + 1)


@kernel
def rows_by_reading(
    reading: Reading,
    links: Reals,
    T: Reals,
    numbers: Integers,
    m: LoopMemory,
    q: Reals,
    count: Integers,
    verdicts: Integers,
    moving: Flags,
) -> None:
    """Add what one reading of the loop finds at some poses. Kernel.

    Parameters
    ----------
    reading : of the loop
    links : (7, 4, 4), in units of the chain's size
    T : (N, 4, 4), in these units
    numbers : (k,), of the poses to look at
    m : memory
    q, count : (N, 16, 6), rad, or parts of the size, and (N,); rows are added
    verdicts : (k,), filled with the reading's verdict
    moving : (N,), set where some row may move with the tool at rest
    """
    rest, pose_link = np.empty((4, 4)), np.empty((4, 4))
    for i in range(numbers.shape[0]):
        n = numbers[i]
        # K_6 = L_6 T^-1 L_0
        invert_rigid(T[n], rest)
        multiply_rigid(rest, links[0], pose_link)
        multiply_rigid(links[6], pose_link, rest)
        verdicts[i], count[n], smallest = _by_reading(reading, links, T[n], rest, m, q[n], count[n])
        moving[n] |= smallest < STUCK


@kernel
def followed_back(
    links: Reals,
    T: Reals,
    numbers: Integers,
    m: LoopMemory,
    near: Reals,
    near_count: Integers,
    q: Reals,
    count: Integers,
) -> None:
    """Add what solutions of neighbouring poses lead to. Kernel.

    Parameters
    ----------
    links : (7, 4, 4), in units of the chain's size
    T : (N, 4, 4), in these units
    numbers : (k,), of the poses
    m : memory
    near, near_count : (k, 16, 6), rad, or parts of the size, and (k,), solutions of a pose next to each of these
    q, count : (N, 16, 6) and (N,); rows are added
    """
    for i in range(numbers.shape[0]):
        n = numbers[i]
        for r in range(near_count[i]):
            m.candidate[:] = near[i, r]
            residual, pivot = newton(links, m.sliding, T[n], m.candidate, 20, m.frames, m.J, m.dq, m.columns)
            if residual < SOLVES:
                count[n] = add_row(links, T[n], m, m.candidate, pivot, q[n], count[n])


@kernel
def in_order(q: Reals, count: Integers) -> None:
    """Sort the rows of each pose by the first joint. Kernel.

    Parameters
    ----------
    q : (N, 16, 6), changed in place
    count : (N,), how many rows count
    """
    for n in range(q.shape[0]):
        for r in range(count[n]):
            smallest = r
            for other in range(r + 1, count[n]):
                if q[n, other, 0] < q[n, smallest, 0]:
                    smallest = other
            if smallest != r:
                for k in range(6):
                    q[n, r, k], q[n, smallest, k] = q[n, smallest, k], q[n, r, k]


@inner_kernel
def _by_reading(
    reading: Reading, links: Reals, pose: Reals, pose_link: Reals, m: LoopMemory, q: Reals, rows: int
) -> tuple[int, int, float]:
    """Add the solutions that one reading of the loop finds; returns its verdict, the number of rows, and the
    minimum of their last pivots."""
    e = m.elimination
    equations_of_pose(reading, pose_link, e)
    peak, noise = sampled_determinant(e)
    if peak < FAMILY_PEAK:
        return CONTINUUM, rows, np.inf
    verdict = UNCERTAIN if noise > LOUD * peak else CERTAIN
    level = DARK * max(noise, 1e-16 * peak)
    zeros = hidden_angles(e, level, m)
    if zeros < 0:
        return UNCERTAIN, rows, np.inf
    earlier, distinct, smallest = rows, 0, np.inf
    for z in range(zeros):
        solved, candidates = False, 0
        again = False
        for other in range(z):
            again = again or abs(m.zeros[z, 0] - m.zeros[other, 0]) < SAME_ZERO
        distinct += not again
        pairs = pairs_at(e, m.zeros[z, 0], reading.slides, m)
        for p in range(pairs):
            m.x[0, 2], m.x[0, 3], m.x[0, 4] = m.zeros[z, 0], m.pairs[p, 0], m.pairs[p, 1]
            candidates = remaining_joints(reading, e, m)
            for k in range(candidates):
                for i in range(6):
                    m.candidate[reading.joint[i]] = reading.sense * m.x[k, i]
                rows, pivot = add_root(links, pose, m, 8, SOLVES, q, rows)
                if pivot >= 0.0:
                    smallest = min(smallest, pivot)
                    away = m.candidate[reading.joint[2]] * reading.sense - m.zeros[z, 0]
                    away -= 2 * np.pi * np.round(away / (2 * np.pi))
                    solved = solved or abs(away) < 1e-2
        if m.zeros[z, 2] == 0.0 or not solved:
            verdict = UNCERTAIN
    # Complex zeros come in pairs, and each real zero has a solution of its own.
    if rows % 2 == 1 or (earlier == 0 and rows < distinct):
        verdict = UNCERTAIN
    return verdict, rows, smallest


@inner_kernel
def add_root(
    links: Reals, pose: Reals, m: LoopMemory, most: int, solves: float, q: Reals, rows: int
) -> tuple[int, float]:
    """Move ``m.candidate`` to a root and add it, and near a fold the other root that meets it there. Kernel.

    That one may be so close that its zero has merged with this one's.

    Parameters
    ----------
    links, pose : (7, 4, 4) and (4, 4), in units of the chain's size
    m : memory; its candidate is wrapped in place
    most : how many of Newton's steps
    solves : residual, rad and parts of the size, that a root may have
    q : (16, 6), rows of the pose, changed in place
    rows : how many there are

    Returns
    -------
    rows : how many there are then
    pivot : the last pivot's ratio at the root, -1 if there is none
    """
    residual, pivot = newton(links, m.sliding, pose, m.candidate, most, m.frames, m.J, m.dq, m.columns)
    if not residual < solves:
        return rows, -1.0
    rows = add_row(links, pose, m, m.candidate, pivot, q, rows)
    if pivot < 1e-3 and twin_start(links, m.sliding, pose, m.candidate, m.start, m.frames, m.J, m.columns):
        residual, other = newton(links, m.sliding, pose, m.start, 12, m.frames, m.J, m.dq, m.columns)
        if residual < solves:
            rows = add_row(links, pose, m, m.start, other, q, rows)
    return rows, pivot


@inner_kernel
def add_row(links: Reals, pose: Reals, m: LoopMemory, found: Reals, pivot: float, q: Reals, rows: int) -> int:
    """Add a row unless it is present. Kernel.

    Where the Jacobian's last pivot is small, rows are known to ``SPREAD / pivot`` only: a root of higher order is
    spread by that much.

    Parameters
    ----------
    links, pose : (7, 4, 4) and (4, 4), in units of the chain's size
    m : memory
    found : (6,), rad, or parts of the size, wrapped in place
    pivot : the last pivot's ratio at this row
    q : (16, 6), rows of the pose, changed in place
    rows : how many there are

    Returns
    -------
    rows : how many there are then
    """
    for k in range(6):
        if not m.sliding[k]:
            found[k] -= 2 * np.pi * np.ceil((found[k] - np.pi) / (2 * np.pi))
    middle = np.empty(6)
    for r in range(rows):
        apart = 0.0
        for k in range(6):
            away = found[k] - q[r, k]
            if not m.sliding[k]:
                away -= 2 * np.pi * np.round(away / (2 * np.pi))
            apart = max(apart, abs(away))
            middle[k] = q[r, k] + 0.5 * away
        if apart < SAME or (apart < MAYBE_SAME and pivot * apart < SPREAD):
            return rows
        # Two rows of one flat root: what lies midway solves the pose, too.
        if apart < MAYBE_SAME and residual_and_jacobian(links, m.sliding, pose, middle, m.frames, m.J) < SOLVES:
            return rows
    if rows < SLOTS:
        for k in range(6):
            q[rows, k] = found[k]
        return rows + 1
    return rows
