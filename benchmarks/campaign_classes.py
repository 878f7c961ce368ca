"""Solvers of further classes of arms: completeness against starts from everywhere, and times beside the peers'.

*Own arm*: each pose is made of random joint angles, which must be among the rows. *Starts*: a damped Newton's method of
this file's own, from random joint angles until 60 successes in a row bring nothing new, on some of the poses.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable

import numba
import numpy as np
from eaik.IK_DH import DhRobot

from er3a import forward, inverse_batch, load_robot
from er3a.kinematics.classes.arm_angle import arm_angle_arm, solve_at_arm_angle
from er3a.kinematics.classes.four_bar import solve_three_parallel
from er3a.kinematics.classes.links import links_of_rows, poses_of
from er3a.kinematics.classes.parallel_axes import three_parallel
from er3a.kinematics.classes.six_revolute import prepared, solve_six_revolute

POSES = int(os.environ.get("CLASSES_POSES", "10000"))
STARTED, SEED, ROUNDS = POSES // 20, 20261121, 5
H = np.pi / 2
UR5 = ([0, -0.425, -0.39225, 0, 0, 0], [H, 0, 0, H, -H, 0], [0.089159, 0, 0, 0.10915, 0.09465, 0.0823])
CRX = ([0, 0.71, 0, 0, 0, 0], [-H, np.pi, -H, H, -H, np.pi], [0, 0, 0, -0.54, 0.15, -0.16])
PUMA = ([0, 0.4318, 0.0203, 0, 0, 0], [H, 0, -H, H, -H, 0], [0, 0, 0.15005, 0.4318, 0, 0.1])
MANSEUR_DOTY = ([0.3, 1, 0, 1.5, 0, 0], [H, np.radians(1), H, np.radians(1), H, np.radians(1)], [0, 0, 0.2, 0, 0, 0])
JACO = ([0, 0.41, 0, 0, 0, 0], [H, np.pi, H, 1.0472, 1.0472, np.pi], [0.2755, 0, -0.0098, -0.2501, -0.0856, -0.2228])
IIWA = ([0] * 7, [-H, H, H, -H, -H, H, 0], [0.34, 0, 0.4, 0, 0.4, 0, 0.126])
NEAR = (1e-6, 1e-4, 1e-2)


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
            R = T[:3, :3] @ A[:3, :3].T
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
                M[k, k] += 1e-2 * np.sum(e * e) + 1e-17
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


def turned(q: np.ndarray) -> np.ndarray:
    return q - 2 * np.pi * np.round(q / (2 * np.pi))


def general_row(name: str, rows, random: np.random.Generator) -> str:
    """One arm: what was missed, listed twice or invented."""
    a, alpha, d = (np.array(column, float) for column in rows)
    chain = links_of_rows(a, alpha, d)
    q = random.uniform(-np.pi, np.pi, (POSES, 6))
    T = poses_of(chain, q)
    arm = prepared(chain)
    solve_six_revolute(arm, T[:2])
    begin = time.process_time()
    found = solve_six_revolute(arm, T)
    took = (time.process_time() - begin) / POSES * 1e6
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
    missed, roots = np.empty((32, 6)), 0
    more = 0
    for n in range(STARTED):
        count = _started(a, alpha, d, T[n], n, missed)
        roots += count
        for row in missed[:count]:
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
    six = [(prepared(x), poses_of(x, random.uniform(-3, 3, (few, 6)))) for x in (crx, generic, doty)]
    peer = DhRobot(*(np.array(UR5[k], float) for k in (1, 0, 2)))
    got = least(
        lambda: inverse_batch(robot, own),
        lambda: peer.IK_batched(T_ur, 1),
        lambda: solve_three_parallel(parallel, T_ur),
        lambda: solve_at_arm_angle(seven, T_7, psi),
        *(lambda each=each: solve_six_revolute(*each) for each in six),
    )
    each = [value / n * 1e6 for value, n in zip(got, [many] * 4 + [few] * 3)]
    names = (
        "spherical wrist, `inverse_batch`",
        "EAIK `IK_batched`, UR5",
        f"UR5, three parallel axes: {each[1] / each[2]:.1f} times as fast as EAIK",
        "iiwa at a given arm angle",
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
            f"{POSES:,} poses for each arm, of random joint angles. *Lost*: poses whose own joint angles are not among",
            f"the rows; *by starts*: roots that starts from everywhere found on {STARTED:,} of the poses, and how many",
            "of them are not among the rows; *twice*: poses with two rows within 1e-6 rad; *invented*: rows that miss",
            "the pose by more than 1e-9 m or 1 (worst miss); *unsure*: poses at which the solver leaves a doubt.",
            "",
            "| arm | lost | missed by starts | twice | invented | unsure | us a pose | poses by number of solutions |",
            "|---|---|---|---|---|---|---|---|",
            *(general_row(name, rows, random) for name, rows in arms(random)),
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
