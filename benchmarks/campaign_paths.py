"""Paths and their singularities at full size: what is missed, how well it is placed, what avoiding them costs, speed.

The same generators and judgements as the tests', at full size.
"""

from __future__ import annotations

import time

import numpy as np
import roboticstoolbox as rtb

from benchmarks.campaign_speed import elementary, pinned
from er3a import load_robot
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import characteristic_length, conditioning, determinant_factors
from er3a.planning.avoidance.avoidance import singular_segment
from er3a.planning.avoidance.strategies import STRATEGIES, best, compare_strategies
from er3a.planning.follow import follow
from er3a.planning.moves import line
from er3a.planning.singular_events import singular_events
from er3a.planning.timing import joint_limits
from er3a.planning.tool_curve import curve_of
from testing.evidence import sized
from testing.exact_paths import worst_location
from testing.random_paths import KINDS, NEAR, Found

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
PATHS, LINES, TROUBLED, SEED = sized(60), sized(200), sized(20), 20261120
SAMPLES, PEER_SAMPLES = 10_000, 1000


def missed_rows(robot, random) -> list[str]:
    """Crossings and near passes of a sampling 100 times finer that the events lack."""
    rows = []
    for kind, make in KINDS.items():
        found = Found()
        for _ in range(PATHS):
            found.add(robot, make(robot, random))
        rows.append(
            f"| {robot.name} | {kind} | {PATHS:,} | {found.crossings:,} | {found.missed_crossings} "
            f"| {found.passes:,} | {found.missed_passes} |"
        )
    return rows


def place_rows(robot, random) -> list[str]:
    """How far the closest passes lie from where extended precision finds them."""
    found = worst_location(robot, random, LINES)
    return [f"| {robot.name} | {kind} | {count} | {worst:.1e} |" for kind, (count, worst) in found.items() if count]


def avoidance_rows(robot, random) -> list[str]:
    """What the strategies of avoidance cost on random lines that come near a singularity within the limits."""
    limits = joint_limits(robot, np.radians([180, 180, 180, 360, 360, 360]), 0.25)
    t, costs, taken, count = np.linspace(0, 4, 300), {name: [] for name in STRATEGIES}, dict.fromkeys(STRATEGIES, 0), 0
    while count < TROUBLED:
        q = random.uniform(robot.lower, robot.upper) * 0.8
        way = line(*forward(robot, np.stack([q, q + random.uniform(-0.6, 0.6, 6)])), 4.0)
        followed = follow(robot, way, t, q)
        inside = np.isfinite(followed.q).all() and (followed.q < robot.upper).all() and (followed.q > robot.lower).all()
        if not inside or followed.jumps or (NEAR.margin(robot, followed.q[[0, -1]]) < 1).any():
            continue
        events = singular_events(robot, curve_of(followed)[0], NEAR)
        if not events:
            continue
        count += 1
        results = compare_strategies(singular_segment(followed, NEAR, limits, events, fixed_start=True))
        for result in results:
            if (cost := result.cost) and (not result.reasons or result.name == "stop"):
                cells = cost.distance.max() * 1000, np.degrees(cost.angle.max()), cost.motion.duration
                costs[result.name].append((*cells, max(cost.max_joint_speed_ratio, cost.max_joint_acceleration_ratio)))
        if (choice := best(results, any(event.crossing for event in events))) is not None:
            taken[choice.name] += 1
    rows = []
    for name, cells in costs.items():
        if not cells:
            rows.append(f"| {robot.name} | {name} | 0 of {count} | – | – | – | – | 0 |")
            continue
        far, turned, duration, share = np.array(cells).T
        rows.append(
            f"| {robot.name} | {name} | {len(cells)} of {count} | {np.median(far):.3g} ({far.max():.3g}) "
            f"| {np.median(turned):.3g} ({turned.max():.3g}) | {np.median(duration):.2f} | {share.max():.6f} "
            f"| {taken[name]} |"
        )
    return rows


def speed_rows(robot) -> list[str]:
    """Solutions, Jacobians, measures and roots of one line, against a loop over its samples."""
    pinned({0})
    length = characteristic_length(robot)
    ends = [transform(np.array(xyz) * length, [np.pi, 0, 0]) for xyz in ([0.5, -0.25, 0.5], [0.5, 0.25, 0.5])]
    way = line(*ends, 4.0)
    t = np.linspace(0, 4, SAMPLES)

    def ours():
        followed = follow(robot, way, t)
        conditioning(robot, followed.q, length)
        determinant_factors(robot, followed.q)
        singular_events(robot, curve_of(followed)[0], NEAR)
        return followed

    followed = ours()
    mine = min(_seconds(ours) for _ in range(5)) / SAMPLES
    rows = [f"| {robot.name} | er3a: all branches, measures, events | {mine * 1e6:.1f} | |"]
    T, sequence = way.poses(way.progress(t[:PEER_SAMPLES])[0]), elementary(robot)
    for method in ("ikine_LM", "ik_LM"):
        solve = getattr(sequence, method)

        def theirs(solve=solve):
            q = followed.q[0]
            for pose in T:
                found = solve(pose, q0=q)
                q = np.ravel(found.q) if np.all(found.success) else q
                J = sequence.jacob0(q)
                J[:3] /= length
                np.linalg.svd(J, compute_uv=False)

        each = _seconds(theirs) / len(T)
        rows.append(
            f"| {robot.name} | Robotics Toolbox {rtb.__version__}: `{method}`, `jacob0`, singular values "
            f"| {each * 1e6:.1f} | {each / mine:.1f} |"
        )
    return rows


def _seconds(function) -> float:
    start = time.process_time()
    function()
    return time.process_time() - start


def table() -> str:
    """The evidence as Markdown."""
    robots = [load_robot(name) for name in ROBOTS]
    lines = [
        "# Paths and their singularities",
        "",
        "Written by `make campaigns ARGS=paths`; the tests hold smaller forms of the first three tables.",
        "",
        "## Nothing is missed",
        "",
        f"{PATHS} random paths per robot and kind ({9 * PATHS:,} in all), checked at 101 points and by root",
        "finding, against the same path sampled 100 times as finely. A crossing is a change of sign of a factor of the",
        f"determinant; a pass a stretch within 5 deg (wrist, elbow) or 30 mm (shoulder) of the set. Seed {SEED}.",
        "",
        "| robot | paths | number | crossings of the finer sampling | missed | passes of the finer sampling | missed |",
        "|---|---|---|---|---|---|---|",
    ]
    for part, head in (
        (missed_rows, None),
        (
            place_rows,
            [
                "",
                "## Each is where it is said to be",
                "",
                f"Closest passes of {LINES} random lines per robot, against plane trigonometry in extended precision",
                "(80 bits) without inverse kinematics. The error is a share of the way.",
                "",
                "| robot | type | passes | greatest error of the place |",
                "|---|---|---|---|",
            ],
        ),
        (
            avoidance_rows,
            [
                "",
                "## What the strategies of avoidance cost",
                "",
                f"{TROUBLED} random lines per robot within reach and limits that come near a singularity in 4 s, but",
                "not at their ends; start joints given. Usable: the whole path is done within the limits of angles,",
                "speeds and accelerations (for `stop`: it stops in time). Deviation as median (greatest); time as",
                "median; the greatest share of a speed or acceleration limit in use; how often it is the one to take.",
                "",
                "| robot | strategy | usable | off path (mm) | off path (deg) | time (s) | share of a limit | taken |",
                "|---|---|---|---|---|---|---|---|",
            ],
        ),
    ):
        lines += head or []
        for robot in robots:
            lines += part(robot, np.random.default_rng(SEED))
            print(lines[-1], flush=True)
    lines += [
        "",
        "## Speed",
        "",
        f"A line of {SAMPLES:,} samples, µs of processor time per sample, in one run. `ikine_LM` is the Toolbox's",
        "numerical inverse as the article uses it; `ik_LM` its compiled form; they do the first",
        f"{PEER_SAMPLES:,}, each from the last solution. er3a solves all eight branches, chooses the best sequence as",
        "a whole and finds the events between samples besides.",
        "",
        "| robot | what | µs per sample | er3a is faster by |",
        "|---|---|---|---|",
    ]
    lines += speed_rows(robots[0])
    return "\n".join(lines) + "\n"
