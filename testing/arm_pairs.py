"""Random pairs of arms for comparisons, made and judged without er3a: plain D-H matrices in NumPy.

A pair is a printed table and an arm: the same one with its base, flange, zeros, directions and feet of normals chosen
otherwise, or with wrong entries besides. Which entries can be known at all is found by moving each of them a little and
taking away what free choices can undo: what is left over is what an entry changes of the arm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

KINDS = ("generic", "industrial", "offset_wrist", "parallel", "coincident", "nearly_parallel", "slides", "scara")
LENGTHS_M, ANGLES_DEG = (6e-4, 2e-3, 0.01, 0.08, 0.3), (0.2, 0.5, 2.0, 15.0, 37.0, 90.0)
POSES = 24
STEP = 1e-6
MIN_SEEN = 0.2, 0.06  # of what an entry, a length or an angle, changes of the flange by itself
ALIKE = 1 - 1e-5


@dataclass(frozen=True)
class Arm:
    """A standard D-H table in m and rad: ``theta = direction q + offset``; for prismatic joints ``d`` is so."""

    a: np.ndarray
    alpha: np.ndarray
    d: np.ndarray
    offset: np.ndarray
    direction: np.ndarray
    sliding: np.ndarray
    base: np.ndarray
    flange: np.ndarray


def rot(axis: int, angle: float | np.ndarray) -> np.ndarray:
    """Turns (..., 4, 4) about x, y or z (0, 1, 2)."""
    T = np.broadcast_to(np.eye(4), (*np.shape(angle), 4, 4)).copy()
    i, j = (axis + 1) % 3, (axis + 2) % 3
    T[..., i, i] = T[..., j, j] = np.cos(angle)
    T[..., j, i] = np.sin(angle)
    T[..., i, j] = -T[..., j, i]
    return T


def shift(x: float, y: float, z: float | np.ndarray) -> np.ndarray:
    """Shifts (..., 4, 4) in m."""
    T = np.broadcast_to(np.eye(4), (*np.shape(z), 4, 4)).copy()
    T[..., :2, 3] = x, y
    T[..., 2, 3] = z
    return T


def flange_at(arm: Arm, q: np.ndarray) -> np.ndarray:
    """The flange's frames (..., 4, 4) at joint values (..., n)."""
    T = arm.base
    for k in range(len(arm.a)):
        x = arm.direction[k] * q[..., k]
        theta, d = (arm.offset[k], arm.d[k] + x) if arm.sliding[k] else (arm.offset[k] + x, arm.d[k])
        T = T @ rot(2, theta) @ shift(0, 0, d) @ shift(arm.a[k], 0, 0) @ rot(0, arm.alpha[k])
    return np.asarray(T @ arm.flange)


def random_arm(random: np.random.Generator, kind: str) -> Arm:
    """A printed table of 4 to 8 joints."""
    n = 4 if kind == "scara" else int(random.integers(4, 9))
    a, d = random.choice([0, 0, 0.1, 0.25, 0.42], (2, n)) * random.uniform(0.9, 1.1, (2, n))
    alpha = np.radians(random.choice([90.0, -90.0, 0.0, 180.0], n))
    sliding = np.zeros(n, dtype=bool)
    k = int(random.integers(0, n - 1))
    if kind == "generic":
        a, d, alpha = random.uniform(-0.5, 0.5, n), random.uniform(-0.5, 0.5, n), random.uniform(-3, 3, n)
    if kind == "industrial":
        a, d = (np.resize(own, n) for own in ([0.15, 0.6, 0.13, 0.0, 0.0], [0.4, 0.0, 0.0, 0.64, 0.0, 0.1]))
        alpha = np.radians(np.resize([-90.0, 0.0, -90.0, 90.0, -90.0, 0.0], n))
    if kind == "offset_wrist":
        a, d = (np.resize(own, n) for own in ([0.0, -0.61, -0.57, 0.0, 0.0], [0.13, 0.0, 0.0, 0.16, 0.12, 0.1]))
        alpha = np.radians(np.resize([90.0, 0.0, 0.0, 90.0, -90.0, 0.0], n))
    if kind == "parallel":
        alpha[:3], a[:3] = np.radians(random.choice([0.0, 180.0], 3)), random.uniform(0.1, 0.5, 3)
    if kind == "coincident":
        a[k], alpha[k] = 0.0, random.choice([0.0, np.pi])
    if kind == "nearly_parallel":
        alpha[k] = np.radians(10 ** random.uniform(-6, 0.4)) * random.choice([1, -1])
    if kind == "slides":
        sliding = random.random(n) < 0.3
    if kind == "scara":
        a, d, alpha = np.array([0.25, 0.25, 0, 0]), np.array([0.2, 0, 0, 0.05]), np.array([0, np.pi, 0, 0])
        sliding = np.arange(4) == 2
        if random.random() < 0.3:  # the slide first
            a, d, alpha = np.array([0.0, 0.3, 0.25, 0]), np.array([0.2, 0, 0.1, 0.05]), np.array([0, 0, np.pi, 0])
            sliding = np.arange(4) == 0
    offset = np.where(sliding, np.radians(random.choice([0.0, 90.0, 180.0, 30.0], n)), random.uniform(-3, 3, n))
    direction = random.choice([1.0, -1.0], n)
    return Arm(a, alpha, d, offset, direction, sliding, np.eye(4), np.eye(4))


def pose(random: np.random.Generator) -> np.ndarray:
    """A random frame within half a metre."""
    turns = [rot(axis, random.uniform(-3, 3)) for axis in (2, 1, 0)]
    return np.asarray(shift(*random.uniform(-0.5, 0.5, 3)) @ turns[0] @ turns[1] @ turns[2])


def defined_elsewhere(random: np.random.Generator, arm: Arm) -> Arm:
    """The same arm with other zeros, directions, ends, and other feet of normals between parallel axes."""
    n = len(arm.a)
    offset = np.where(arm.sliding, arm.offset, random.uniform(-3, 3, n))
    d = np.where(arm.sliding, arm.d + random.uniform(-0.2, 0.2, n), arm.d)
    a, alpha = arm.a.copy(), arm.alpha.copy()
    d[[0, -1]], a[-1], alpha[-1] = random.uniform(-0.3, 0.3, 2), 0.05, random.uniform(-3, 3)
    for k in np.flatnonzero(np.abs(np.sin(alpha[:-1])) < 1e-12):
        moved = random.uniform(-0.2, 0.2)
        d[k] += moved
        d[k + 1] -= moved * np.cos(alpha[k])
    direction, ends = random.choice([1.0, -1.0], n), (pose(random), pose(random))
    return Arm(a, alpha, d, offset, direction, arm.sliding, *ends)


def entries_of(arm: Arm) -> list[tuple[str, int]]:
    """The entries between the first joint and the last that can be geometry; theta is a sliding joint's."""
    n = len(arm.a)
    inner = [("d", k) for k in range(1, n - 1) if not arm.sliding[k]]
    turned = [("theta", k) for k in range(1, n - 1) if arm.sliding[k]]
    return [(column, k) for column in ("a", "alpha") for k in range(n - 1)] + inner + turned


def changed(arm: Arm, entry: tuple[str, int], amount: float) -> Arm:
    """The arm with one entry changed by an amount, m or rad."""
    column, k = entry
    name = "offset" if column == "theta" else column
    values = getattr(arm, name).copy()
    values[k] += amount
    return replace(arm, **{name: values})


def effects(arm: Arm, entries: Sequence[tuple[str, int]]) -> np.ndarray:
    """What entries change of the arm per m or rad, (numbers, entries), without what free choices can undo."""
    random, n = np.random.default_rng(1), len(arm.a)
    q = np.where(arm.sliding, random.uniform(0, 0.5, (POSES, n)), random.uniform(-3, 3, (POSES, n)))

    def seen(changed_arm: Arm) -> np.ndarray:
        return flange_at(changed_arm, q)[:, :3].ravel()

    def twist(place: str, k: int) -> Arm:
        move = np.eye(4)
        if k < 3:
            move[k, 3] = STEP
        else:
            move = rot(k - 3, STEP)
        return replace(arm, **{place: arm.base @ move if place == "base" else move @ arm.flange})

    here = seen(arm)
    free = [twist(place, k) for place in ("base", "flange") for k in range(6)]
    free += [changed(arm, ("d" if arm.sliding[k] else "theta", k), STEP) for k in range(n)]
    nothing = np.stack([(seen(each) - here) / STEP for each in free], axis=1)
    own = np.stack([(seen(changed(arm, each, STEP)) - here) / STEP for each in entries], axis=1)
    U, S, _ = np.linalg.svd(nothing, full_matrices=False)
    U = U[:, 1e-7 * S[0] < S]
    return np.asarray(own - U @ (U.T @ own))


@dataclass(frozen=True)
class Wrong:
    """Entries that were made wrong, each with all others that no data can distinguish from it."""

    entries: tuple[tuple[str, int], ...]
    alike: tuple[frozenset[str], ...]


def name(entry: tuple[str, int]) -> str:
    """Column and joint, counted from 1: ``d4``."""
    return f"{entry[0]}{entry[1] + 1}"


def with_wrong_entries(random: np.random.Generator, arm: Arm) -> tuple[Arm, Wrong] | None:
    """The arm with one to four entries wrong, each of which can be known beside the others; None if none were drawn."""
    entries, effect = entries_of(arm), effects(arm, entries_of(arm))
    size = np.linalg.norm(effect, axis=0)
    for _ in range(100):
        wrong, chosen = arm, random.permutation(len(entries))[: random.integers(1, 5)].tolist()
        for i in chosen:
            lengths = entries[i][0] in ("a", "d")
            amount = random.choice(LENGTHS_M) if lengths else np.radians(random.choice(ANGLES_DEG))
            wrong = changed(wrong, entries[i], amount * random.choice([1, -1]))
        if _known(entries, effect, chosen) and _known(entries, effects(wrong, entries), chosen):
            rows = [entries[i][1] for i in chosen if entries[i][0] == "a"]
            if (np.abs(wrong.a + arm.a)[rows] < 1e-9).any():
                continue  # the same normal, the other way
            same = np.abs(effect.T @ effect) > ALIKE * np.outer(size, size)
            alike = [frozenset(name(entries[j]) for j in np.flatnonzero(same[i])) for i in chosen]
            return wrong, Wrong(tuple(entries[i] for i in chosen), tuple(alike))
    return None


def _known(entries: Sequence[tuple[str, int]], effect: np.ndarray, chosen: Sequence[int]) -> bool:
    """Whether each of the chosen entries changes the arm as neither free choices nor the others can."""
    for i in chosen:
        rest = effect[:, [j for j in chosen if j != i]]
        left = effect[:, i] - rest @ np.linalg.lstsq(rest, effect[:, i], rcond=None)[0]
        least = MIN_SEEN[0 if entries[i][0] in ("a", "d") else 1] * np.sqrt(POSES)
        if np.linalg.norm(left) < max(least, 0.1 * np.linalg.norm(effect[:, i])):
            return False
    return True
