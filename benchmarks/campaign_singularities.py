"""Poses at and next to singularities: is the arm that made the pose among the results?

The same generator and judgement as the tests', at full size.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor

import numpy as np

from er3a import forward, inverse, load_robot
from testing.arms import pose_errors
from testing.evidence import sized
from testing.singular_poses import CLASSES, admissible_slots, family_holds, joints_near, tolerance, turned

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
POSES, SEED = sized(1000), 20261120


def judged(task: tuple[str, str]) -> str:
    """The table's row for a robot and a class; tasks are seeded by themselves, so that their order is free."""
    name, kind = task
    robot = load_robot(name)
    random = np.random.default_rng([SEED, ROBOTS.index(name), CLASSES.index(kind)])
    q = joints_near(robot, kind, random, POSES)
    if not len(q):
        return f"| {name} | {kind} | none: the arm can't stand so | | | | | | |"
    while len(q) < POSES:
        q = np.concatenate([q, joints_near(robot, kind, random, POSES)])
    q = q[:POSES]
    T, slots, most = forward(robot, q), admissible_slots(robot, q), tolerance(robot, q, random)
    found = twice = rows = families = 0
    worst = worst_member = 0.0
    for n in range(POSES):
        solution = inverse(robot, T[n], q[n] if n % 2 else np.zeros(6))
        residuals = pose_errors(forward(robot, solution.q), T[n])
        worst = max(worst, *(part.max() for part in residuals))
        apart = np.abs(solution.q[:, None] - solution.q[None]).max(axis=-1) + np.eye(len(solution.q))
        twice += bool(apart.min() < 1e-9)
        rows += len(solution.q)
        families += len(solution.families)
        for family in solution.families:
            members = family.members(np.linspace(*family.range, 5))
            worst_member = max(worst_member, *(part.max() for part in pose_errors(forward(robot, members), T[n])))
        own = (turned(solution.q - q[n]).max(axis=1) <= most[n]) & slots[n][solution.branch]
        found += bool(own.any() or any(family_holds(f, q[n], slots[n], most[n]) for f in solution.families))
    row = (
        f"| {name} | {kind} | {POSES:,} | {found / POSES:.2%} ({found:,}) | {twice} | {worst:.2e} | {rows:,} "
        f"| {families:,} | {worst_member:.2e} |"
    )
    print(row, flush=True)
    return row


def table() -> str:
    """The evidence as Markdown."""
    lines = [
        "# Inverse kinematics at and next to singularities",
        "",
        f"{POSES:,} poses per class and robot, made from random joints within the limits of which those of the class",
        "were put at 0 (one in eight) and +-1e-12 ... +-1e-3 rad from: wrist aligned, elbow straight, elbow folded,",
        "wrist centre on axis 1 (shoulder), and all combinations. Half of them are solved with the generating joints",
        "as reference, half with zeros. *Own found*: a row, or a member of a family, with the same labels and a joint",
        "difference of at most max(1e-9, 10 times what a change of 1e-15 in T causes). *Twice*: poses with two rows",
        "that agree to 1e-9.",
        f"Residuals are the greater of metres and radians. Seed {SEED}. Written by",
        "`make campaigns ARGS=singularities`.",
        "",
        "| robot | class | poses | own found | twice | worst residual | rows | families | worst residual of a member |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    tasks = [(name, kind) for name in ROBOTS for kind in CLASSES]
    with ProcessPoolExecutor() as pool:
        lines += pool.map(judged, tasks)
    return "\n".join(lines) + "\n"
