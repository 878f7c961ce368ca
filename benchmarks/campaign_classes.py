"""Solvers of further classes of arms: completeness against starts from everywhere, and times beside the peers'.

*Own arm*: each pose is made of random joint values, which must be among the rows. *Starts*: a damped Newton's method of
this file's own, from random joint values until 60 successes in a row bring nothing new, on every pose.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import numba
import numpy as np
from eaik.IK_DH import DhRobot

from er3a import Robot, forward, inverse, inverse_batch, jacobian, load_robot
from er3a.kinematics.by_class import task_mask
from er3a.kinematics.chain import poses_of
from er3a.kinematics.classes.arm_angle import arm_angle_arm, solve_at_arm_angle
from er3a.kinematics.classes.four_bar import solve_three_parallel
from er3a.kinematics.classes.parallel_axes import three_parallel
from er3a.kinematics.classes.six_revolute import prepared, solve_six_revolute
from testing.arms import links_of_rows
from testing.evidence import sized

POSES = sized(800, 400)
SEED, ROUNDS = 20261121, 15
SPECIAL_ARMS, SINGULAR = POSES // 32, POSES // 200
H = np.pi / 2
UR5 = ([0, -0.425, -0.39225, 0, 0, 0], [H, 0, 0, H, -H, 0], [0.089159, 0, 0, 0.10915, 0.09465, 0.0823])
CRX = ([0, 0.71, 0, 0, 0, 0], [-H, np.pi, -H, H, -H, np.pi], [0, 0, 0, -0.54, 0.15, -0.16])
PUMA = ([0, 0.4318, 0.0203, 0, 0, 0], [H, 0, -H, H, -H, 0], [0, 0, 0.15005, 0.4318, 0, 0.1])
MANSEUR_DOTY = ([0.3, 1, 0, 1.5, 0, 0], [H, np.radians(1), H, np.radians(1), H, np.radians(1)], [0, 0, 0.2, 0, 0, 0])
JACO = ([0, 0.41, 0, 0, 0, 0], [H, np.pi, H, 1.0472, 1.0472, np.pi], [0.2755, 0, -0.0098, -0.2501, -0.0856, -0.2228])
IIWA = ([0] * 7, [-H, H, H, -H, -H, H, 0], [0.34, 0, 0.4, 0, 0.4, 0, 0.126])
PANDA = ([0, 0, 0.0825, -0.0825, 0, 0.088, 0], [-H, H, H, -H, H, H, 0], [0.333, 0, 0.316, 0, 0.384, 0, 0.107])
TRACK = ([0, *PUMA[0]], [H, *PUMA[1]], [0, *PUMA[2]])
STANFORD = ([0] * 6, [-H, H, 0, -H, H, 0], [0.412, 0.154, 0, 0, 0, 0.263])
SCARA = ([0.325, 0.225, 0, 0], [0, np.pi, 0, 0], [0.4, 0, 0.1, 0.05])
VERTICAL_5 = ([0, 0.3, 0.25, 0, 0], [H, 0, 0, H, 0], [0.3, 0, 0, 0, 0.1])
NEAR = (1e-6, 1e-4, 1e-2)
Found = TypeVar("Found")


@numba.njit(error_model="numpy")
def _started(a, alpha, d, T, seed, found):
    """Roots of one pose from random starts, into ``found`` (32, 6); how many."""
    np.random.seed(seed)  # noqa: NPY002
    count, idle, tries = 0, 0, 0
    J, e = np.empty((6, 6)), np.empty(6)
    z, p = np.empty((7, 3)), np.empty((7, 3))
    while idle < 60 and tries < 1500:
        tries += 1
        q = np.random.uniform(-np.pi, np.pi, 6)  # noqa: NPY002
        good = False
        for turn in range(40):
            A = np.eye(4)
            for k in range(6):
                z[k], p[k] = A[:3, 2], A[:3, 3]
                c, s, ca, sa = np.cos(q[k]), np.sin(q[k]), np.cos(alpha[k]), np.sin(alpha[k])
                B = np.eye(4)
                B[0, 0], B[0, 1], B[0, 2], B[0, 3] = c, -s * ca, s * sa, a[k] * c
                B[1, 0], B[1, 1], B[1, 2], B[1, 3] = s, c * ca, -c * sa, a[k] * s
                B[2, 1], B[2, 2], B[2, 3] = sa, ca, d[k]
                A = A @ B
            R = np.ascontiguousarray(T[:3, :3]) @ np.ascontiguousarray(A[:3, :3].T)
            e[:3] = T[:3, 3] - A[:3, 3]
            e[3], e[4], e[5] = 0.5 * (R[2, 1] - R[1, 2]), 0.5 * (R[0, 2] - R[2, 0]), 0.5 * (R[1, 0] - R[0, 1])
            size = np.abs(e).max()
            trace = R[0, 0] + R[1, 1] + R[2, 2]
            if size < 1e-12 and trace > 2.0:
                good = True
                break
            if turn == 24 and size > 1e-2:
                break
            for k in range(6):
                J[:3, k] = np.cross(z[k], A[:3, 3] - p[k])
                J[3:, k] = z[k]
            M = J.T @ J
            for k in range(6):
                M[k, k] += 1e-2 * np.sum(e * e) + 1e-14
            q += np.linalg.solve(M, J.T @ e)
        if not good:
            continue
        new = True
        for r in range(count):
            away = q - found[r]
            away -= 2 * np.pi * np.round(away / (2 * np.pi))
            new = new and np.abs(away).max() > 1e-4
        idle = 0 if new else idle + 1
        if new and count < 32:
            found[count] = q
            count += 1
    return count


@numba.njit(error_model="numpy", parallel=True)
def _all_started(a, alpha, d, T, found):
    """Roots of poses T (N, 4, 4) from random starts, into ``found`` (N, 32, 6); how many (N,)."""
    counts = np.zeros(len(T), np.int64)
    for n in numba.prange(len(T)):
        counts[n] = _started(a, alpha, d, T[n], n, found[n])
    return counts


def by_starts(a, alpha, d, T):
    """For each pose what starts find (k, 6)."""
    found = np.empty((len(T), 32, 6))
    return [rows[:count] for rows, count in zip(found, _all_started(a, alpha, d, np.ascontiguousarray(T), found))]


def turned(q: np.ndarray) -> np.ndarray:
    return q - 2 * np.pi * np.round(q / (2 * np.pi))


def timed(solve: Callable[[], Found]) -> tuple[Found, float]:
    """What a solver finds, and its processor time a pose (us) once its kernels are compiled."""
    solve()
    begin = time.process_time()
    return solve(), (time.process_time() - begin) / POSES * 1e6


def general_row(name: str, rows, random: np.random.Generator) -> str:
    """One arm: what was missed, listed twice or invented."""
    a, alpha, d = (np.array(column, float) for column in rows)
    chain = links_of_rows(a, alpha, d)
    q = random.uniform(-np.pi, np.pi, (POSES, 6))
    T = poses_of(chain, q)
    arm = prepared(chain)
    found, took = timed(lambda: solve_six_revolute(arm, T))
    solved = np.isfinite(found.q[..., 0])
    away = np.where(solved, np.abs(turned(found.q - q[:, None])).max(axis=2), 9)
    lost = int((away.min(axis=1) > 1e-4).sum())
    back = poses_of(chain, np.where(solved[..., None], found.q, 0))
    wrong = np.abs(back - T[:, None]).max(axis=(2, 3))[solved]
    twice = 0
    for n in range(POSES):
        each = found.q[n, : found.count[n]]
        apart = np.abs(turned(each[:, None] - each[None])).max(axis=2) + 9 * np.eye(len(each))
        twice += int(len(each) > 1 and apart.min() < 1e-6)
    more, roots = 0, 0
    for n, started in enumerate(by_starts(a, alpha, d, T)):
        roots += len(started)
        for row in started:
            more += int(np.abs(turned(found.q[n, : found.count[n]] - row)).max(axis=1).min(initial=9) > 1e-3)
    histogram = ", ".join(f"{k}: {v}" for k, v in enumerate(np.bincount(found.count)) if v)
    unsure = int((found.certainty != 0).sum())
    return (
        f"| {name} | {lost} | {more} of {roots} | {twice} | {int((wrong > 1e-9).sum())} ({wrong.max():.0e}) "
        f"| {unsure} | {took:.0f} | {histogram} |"
    )


def arms(random: np.random.Generator):
    """Names and rows of all arms."""
    for k in range(3):
        yield f"generic {k + 1}", (random.uniform(-1, 1, 6), random.uniform(-3, 3, 6), random.uniform(-1, 1, 6))
    yield from (("Manseur and Doty", MANSEUR_DOTY), ("CRX-10iA/L", CRX), ("Jaco", JACO), ("UR5", UR5), ("Puma", PUMA))
    for name, rows in (("Puma", PUMA), ("UR5", UR5), ("CRX", CRX)):
        for size in NEAR:
            near = tuple(np.array(column, float) + size * random.uniform(-1, 1, 6) for column in rows)
            yield f"{name}, all entries off by up to {size:g}", near


@numba.njit(error_model="numpy")
def _started_any(a, alpha, d, sliding, T, starts, found):
    """Joint values (k, n) to which starts (k, n) lead, into ``found``; how many."""
    n, count = a.shape[0], 0
    J, e = np.empty((6, n)), np.empty(6)
    z, p = np.empty((n, 3)), np.empty((n, 3))
    for start in range(starts.shape[0]):
        q = starts[start].copy()
        for _ in range(60):
            A = np.eye(4)
            for k in range(n):
                z[k], p[k] = A[:3, 2], A[:3, 3]
                angle, shift = (0.0, d[k] + q[k]) if sliding[k] else (q[k], d[k])
                c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha[k]), np.sin(alpha[k])
                B = np.eye(4)
                B[0, 0], B[0, 1], B[0, 2], B[0, 3] = c, -s * ca, s * sa, a[k] * c
                B[1, 0], B[1, 1], B[1, 2], B[1, 3] = s, c * ca, -c * sa, a[k] * s
                B[2, 1], B[2, 2], B[2, 3] = sa, ca, shift
                A = A @ B
            R = np.ascontiguousarray(T[:3, :3]) @ np.ascontiguousarray(A[:3, :3].T)
            e[:3] = T[:3, 3] - A[:3, 3]
            e[3], e[4], e[5] = 0.5 * (R[2, 1] - R[1, 2]), 0.5 * (R[0, 2] - R[2, 0]), 0.5 * (R[1, 0] - R[0, 1])
            if np.abs(e).max() < 1e-12 and R[0, 0] + R[1, 1] + R[2, 2] > 2.0:
                found[count] = q
                count += 1
                break
            for k in range(n):
                J[:3, k] = z[k] if sliding[k] else np.cross(z[k], A[:3, 3] - p[k])
                J[3:, k] = 0.0 * z[k] if sliding[k] else z[k]
            M = J.T @ J
            for k in range(n):
                M[k, k] += 1e-2 * np.sum(e * e) + 1e-14
            q += np.linalg.solve(M, J.T @ e)
    return count


def arm_of(rows, sliding=None, most: float = 2 * np.pi) -> Robot:
    """A robot of D-H rows, with limits of that many rad, or 1 m, either way."""
    a, alpha, d = (np.array(column, float) for column in rows)
    slides = np.zeros(len(a), bool) if sliding is None else np.array(sliding, bool)
    limit = np.where(slides, 1.0, most)
    ones = np.ones(len(a))
    return Robot("made", "made", "standard", a, alpha, d, ones, 0 * ones, -limit, limit, sliding=slides)


def special_rows(random: np.random.Generator) -> str:
    """Arms whose lengths and angles are often 0, 90 deg or equal, that have full rank: one line for all."""
    arms, poses, lost, more, roots, wrong, unsure, worst = 0, 100, 0, 0, 0, 0, 0, 0.0
    while arms < SPECIAL_ARMS:
        alpha = [
            random.choice([0, H, -H, np.pi, random.uniform(-3, 3)], p=[0.15, 0.25, 0.25, 0.05, 0.3]) for _ in "6 rows"
        ]
        a, d = (
            np.array(
                [
                    random.choice([0, 0.1, 0.3, 0.5, random.uniform(-1, 1)], p=[0.45, 0.1, 0.1, 0.05, 0.3])
                    for _ in "6 rows"
                ]
            )
            for _ in range(2)
        )
        alpha = np.array(alpha)
        q = random.uniform(-np.pi, np.pi, (poses, 6))
        robot = arm_of((a, alpha, d))
        if np.linalg.svd(jacobian(robot, q[0]), compute_uv=False)[-1] < 1e-6:
            continue
        arms += 1
        T = forward(robot, q)
        found = inverse_batch(robot, T)
        own = np.abs(turned(found.q - q[:, None])).max(axis=2)
        lost += int((np.nanmin(np.where(np.isnan(own), 9, own), axis=1) > 1e-4).sum())
        back = np.abs(forward(robot, np.nan_to_num(found.q)) - T[:, None]).max(axis=(2, 3))[found.solved]
        wrong, worst = wrong + int((back > 1e-9).sum()), max(worst, float(back.max()))
        unsure += 0 if found.certain is None else int((~found.certain).sum())
        for n, started in enumerate(by_starts(a, alpha, d, T)):
            roots += len(started)
            each = found.q[n][found.solved[n]]
            more += sum(int(np.abs(turned(each - row)).max(axis=1).min(initial=9) > 1e-3) for row in started)
    return (
        f"| {arms} arms of special geometry, {poses} poses each | {lost} | {more} of {roots} | - "
        f"| {wrong} ({worst:.0e}) | {unsure} | - | - |"
    )


def held(motion, q: np.ndarray) -> bool:
    """Whether joint values lie on a self-motion, by the points of its curve."""
    return motion.chain.holds(motion.curve, q)


def singular_row(name: str, robot: Robot, joints: np.ndarray, random: np.random.Generator) -> str:
    """Singular poses by ``inverse``: the own arm, and what starts find, among rows and self-motions."""
    poses = len(joints)
    lost, lost_far, missed, roots, invented, differ, motions = 0, 0, 0, 0, 0, 0, 0
    found = np.empty((120, robot.joints))
    for q in joints:
        T = forward(robot, q)
        single, far = inverse(robot, T, q), inverse(robot, T)
        batch = inverse_batch(robot, T[None], q)
        lost += int(np.abs(single.q - q).max(axis=1).min(initial=9) > 1e-6)
        lost_far += int(not _told(robot, far, q))
        motions += len(single.families)
        invented += int((np.abs(forward(robot, single.q) - T).max(axis=(1, 2)) > 1e-8).sum())
        rows = batch.q[0][batch.solved[0]]
        differ += sum(int(np.abs(single.q - row).max(axis=1).min(initial=9) > 1e-8) for row in rows)
        starts = random.uniform(-1, 1, found.shape) * np.where(robot.sliding, 1.0, np.pi)
        count = _started_any(robot.a, robot.alpha, robot.d, robot.sliding, T, starts, found)
        roots += count
        missed += sum(int(not _told(robot, far, row)) for row in found[:count])
    told = f"{lost} | {lost_far} | {missed} of {roots} | {invented} | {differ}"
    return f"| {name} | {poses} | {told} | {motions / poses:.1f} |"


def _told(robot: Robot, solutions, q: np.ndarray) -> bool:
    """Whether joint values are a row, turns aside, or lie on a self-motion (limits aside)."""
    away = solutions.q - q
    away = np.abs(np.where(robot.slides, away, turned(away))).max(axis=1).min(initial=9)
    return away < 2e-4 or any(held(motion, q) for motion in solutions.families)


def singular_rows(random: np.random.Generator):
    """Lines of singular poses and of arms with more than six joints."""
    ur, crx = arm_of(UR5), arm_of(CRX)
    for name, robot, fixed in (
        ("UR5, q5 = 0", ur, {4: 0.0}),
        ("UR5, q5 = 180 deg", ur, {4: np.pi}),
        ("UR5, arm stretched", ur, {2: 0.0}),
        ("UR5, stretched, q5 = 0", ur, {2: 0.0, 4: 0.0}),
        ("CRX, q5 = 0", crx, {4: 0.0}),
        ("CRX, q3 = q5 = 0", crx, {2: 0.0, 4: 0.0}),
        ("CRX, all at 0", crx, dict.fromkeys(range(6), 0.0)),
    ):
        q = random.uniform(-3, 3, (SINGULAR, 6))
        for joint, value in fixed.items():
            q[:, joint] = value
        yield singular_row(name, robot, q if len(fixed) < 6 else q[:1], random)
    for name, robot in (
        ("iiwa", arm_of(IIWA)),
        ("Panda", arm_of(PANDA)),
        ("Puma on a track", arm_of(TRACK, [1] + [0] * 6)),
    ):
        yield singular_row(
            name, robot, random.uniform(-2.8, 2.8, (SINGULAR, 7)) * np.where(robot.sliding, 0.3, 1), random
        )


def other_rows(random: np.random.Generator):
    """Lines of arms with sliding joints, and with fewer than six."""
    short = tuple(column[:5] for column in UR5)
    for name, robot in (
        ("Stanford (RRP, spherical wrist)", arm_of(STANFORD, [0, 0, 1, 0, 0, 0])),
        ("SCARA", arm_of(SCARA, [0, 0, 1, 0])),
        ("five axes, vertical", arm_of(VERTICAL_5)),
        ("UR5 without joint 6", arm_of(short)),
        ("Puma on a track", arm_of(TRACK, [1] + [0] * 6)),
        ("iiwa", arm_of(IIWA)),
        ("Panda", arm_of(PANDA)),
    ):
        q = random.uniform(robot.lower, robot.upper, (POSES, robot.joints))
        T = forward(robot, q)
        found, took = timed(lambda robot=robot, T=T, q=q: inverse_batch(robot, T, q))
        away = found.q - q[:, None]
        own = np.abs(np.where(robot.slides, away, turned(away))).max(axis=2)
        lost = int((np.nanmin(np.where(np.isnan(own), 9, own), axis=1) > 1e-6).sum())
        task = task_mask(robot)
        back = np.abs(forward(robot, np.nan_to_num(found.q)) - T[:, None])
        wrong = back[..., :3, 3].max(axis=2) if not task.all() else back.max(axis=(2, 3))
        code, slots = found.method.arm_class, found.q.shape[1]
        yield (
            f"| {name} | {code} | {slots} | {POSES:,} | {lost} | {wrong[found.solved].max():.0e} "
            f"| {found.solved.sum(axis=1).mean():.1f} | {took:.1f} |"
        )


def least(*runs: Callable[[], object]) -> list[float]:
    """Least processor time of each, all in turn."""
    best = [np.inf] * len(runs)
    for number in range(ROUNDS + 1):
        for k, run in enumerate(runs):
            begin = time.process_time()
            run()
            if number:
                best[k] = min(best[k], time.process_time() - begin)
    return best


def times(random: np.random.Generator) -> list[str]:
    """Times in one run, one thread."""
    robot = load_robot("er3a_c60")
    many, few = 20_000, 500
    own = forward(robot, random.uniform(robot.lower, robot.upper, (many, 6)))
    ur, iiwa, crx = (links_of_rows(*(np.array(c, float) for c in rows)) for rows in (UR5, IIWA, CRX))
    generic = links_of_rows(random.uniform(-1, 1, 6), random.uniform(-3, 3, 6), random.uniform(-1, 1, 6))
    doty = links_of_rows(*(np.array(c, float) for c in MANSEUR_DOTY))
    parallel, seven = three_parallel(ur), arm_angle_arm(iiwa)
    T_ur, T_7 = (poses_of(x, random.uniform(-3, 3, (many, len(x) - 1))) for x in (ur, iiwa))
    psi = random.uniform(-3, 3, many)
    ur_robot, iiwa_robot = arm_of(UR5), arm_of(IIWA)
    six = [(prepared(x), poses_of(x, random.uniform(-3, 3, (few, 6)))) for x in (crx, generic, doty)]
    peer = DhRobot(*(np.array(UR5[k], float) for k in (1, 0, 2)))
    got = least(
        lambda: inverse_batch(robot, own),
        lambda: peer.IK_batched(T_ur, 1),
        lambda: solve_three_parallel(parallel, T_ur),
        lambda: inverse_batch(ur_robot, T_ur),
        lambda: solve_at_arm_angle(seven, T_7, psi),
        lambda: inverse_batch(iiwa_robot, T_7, redundancy=psi[:, None]),
        *(lambda each=each: solve_six_revolute(*each) for each in six),
    )
    each = [value / n * 1e6 for value, n in zip(got, [many] * 6 + [few] * 3)]
    names = (
        "spherical wrist, `inverse_batch`",
        "EAIK `IK_batched`, UR5",
        f"UR5, three parallel axes: {each[1] / each[2]:.1f} times as fast as EAIK",
        f"UR5, `inverse_batch`: {each[1] / each[3]:.1f} times as fast as EAIK",
        "iiwa at a given arm angle",
        "iiwa at a given arm angle, `inverse_batch`",
        "CRX-10iA/L, all solutions",
        "generic six revolute joints, all solutions",
        "Manseur and Doty, all solutions",
    )
    return [f"| {name} | {value:.2f} | {value / each[0]:.2f} |" for name, value in zip(names, each)]


def table() -> str:
    """The evidence as Markdown."""
    random = np.random.default_rng(SEED)
    return "\n".join(
        [
            "# Other classes of arms",
            "",
            "Written by `make campaigns ARGS=classes`.",
            "",
            f"{POSES:,} poses for each arm, of random joint angles. *Lost*: poses whose own joint angles are not among",
            "the rows; *by starts*: roots that starts from everywhere found on all of these poses, until 60 in a row",
            "brought nothing new, and how many of them are not among the rows; *twice*: poses with two rows within",
            "1e-6 rad; *invented*: rows that miss the pose by more than 1e-9 m or 1 (worst miss); *unsure*: poses at",
            "which the solver leaves a doubt.",
            "",
            "| arm | lost | missed by starts | twice | invented | unsure | us a pose | poses by number of solutions |",
            "|---|---|---|---|---|---|---|---|",
            *(general_row(name, rows, random) for name, rows in arms(random)),
            special_rows(random),
            "",
            "## Singular poses, and more than six joints",
            "",
            "By `inverse`, with the own joints as the reference and with none. *Own lost*: the own joints are no row",
            "(own reference); *untold*: they are neither a row nor on a self-motion (no reference); *missed*: of what",
            "120 starts found, what is neither; *invented*: rows that miss the pose by more than 1e-8; *differ*: rows",
            "of `inverse_batch` that `inverse` does not give; self-motions a pose.",
            "",
            "| poses of | poses | own lost | untold | missed | invented | differ | self-motions |",
            "|---|---|---|---|---|---|---|---|",
            *singular_rows(random),
            "",
            "## Sliding joints, fewer than six, more than six at the own redundancy parameter",
            "",
            "| arm | class | slots | poses | own lost | worst miss (m or 1) | rows a pose | us a pose |",
            "|---|---|---|---|---|---|---|---|",
            *other_rows(random),
            "",
            "## Times",
            "",
            f"One thread, least processor time of {ROUNDS} rounds in which all run in turn.",
            "",
            "| what | us a pose | in times of the spherical wrist |",
            "|---|---|---|",
            *times(random),
            "",
        ]
    )
