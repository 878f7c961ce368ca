"""What a tool can do, at full size: brackets of the dexterous core, and random poses against what is called proven."""

from __future__ import annotations

import time

import numpy as np
from scipy.spatial.transform import Rotation

from er3a import load_robot
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.closed_form import SLOTS
from er3a.kinematics.forward import forward
from er3a.kinematics.wrist_partitioned import constants_for_blocks
from er3a.robots.robot import Robot
from er3a.workspace.capability import rings
from er3a.workspace.dexterous import dexterous_core
from er3a.workspace.directions import from_polar, poses, roll_of, tool_rotations
from er3a.workspace.interval_inverse import GOOD, NEVER, branches, theta_ranges
from er3a.workspace.placement import NO, Task, choose_places, fitting_places, narrowed, proven_bricks, survey
from er3a.workspace.section_arm import section_arm
from testing.evidence import sized

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
SEED, ACROSS, DIRECTIONS = 20261120, 64, 300
BUDGETS = (sized(1_000_000), sized(10_000_000))
NEIGHBOURHOODS, MEMBERS = sized(4000), 50
SIZES = ((0.001, 0.003), (0.005, 0.02), (0.02, 0.1))
SERVICES = sized(400_000)
TRAY = Task(np.array([0.2, 0.15, 0.05]), np.array([0.0, 0.0, -1.0]), np.radians(30), 0.0, 0.15, np.radians(2))


def cores(name: str) -> list[str]:
    """Rows of the core's bracket by budget."""
    robot = load_robot(name)
    arm, roll, rows = section_arm(robot), roll_of(robot, 1), []
    cells = rings(arm.reach, arm.heights, 2 * (arm.upper_length + arm.forearm_length + arm.d) / ACROSS)
    for budget in BUDGETS:
        start = time.process_time()
        core = dexterous_core(robot, cells, DIRECTIONS, roll, budget)
        litres = " | ".join(f"{1000 * value:.4g}" for value in (core.lower, core.estimate, core.upper))
        rows.append(f"| {name} | {core.poses:,} | {core.cells:,} | {litres} | {time.process_time() - start:.1f} s |")
    return rows


def neighbourhoods(name: str, rho: float, delta: float, random: np.random.Generator) -> str:
    """Row of what is told of neighbourhoods of random poses, against members of them solved one by one."""
    robot = load_robot(name)
    free = robot.replace(lower=np.r_[-np.pi, robot.lower[1:]], upper=np.r_[np.pi, robot.upper[1:]])
    arm, ranges = constants_for_blocks(robot), theta_ranges(robot)
    lever = float(np.linalg.norm(arm.wrist_in_tool))
    states = np.empty((NEIGHBOURHOODS, SLOTS), dtype=np.int8)
    T = forward(robot, random.uniform(robot.lower, robot.upper, (NEIGHBOURHOODS, 6)))
    for pose, state in zip(T, states):
        branches(arm, ranges, pose, rho, delta, lever, state, np.empty((SLOTS, 2)))
    members = np.repeat(T, MEMBERS, axis=0)
    members[:, :3, 3] += rho * _in_ball(random, len(members))
    members[:, :3, :3] = Rotation.from_rotvec(delta * _in_ball(random, len(members))).as_matrix() @ members[:, :3, :3]
    within = inverse_batch(free, members).within_limits.reshape(NEIGHBOURHOODS, MEMBERS, SLOTS)
    wrong = int((~within & (states == GOOD)[:, None]).sum() + (within & (states == NEVER)[:, None]).sum())
    shares = " | ".join(f"{100 * (states == value).mean():.1f} %" for value in (GOOD, NEVER))
    return f"| {name} | {1000 * rho:g} mm, {np.degrees(delta):.2g} deg | {shares} | {within.size:,} | {wrong} |"


def _in_ball(random: np.random.Generator, count: int) -> np.ndarray:
    away = random.normal(size=(count, 3))
    return away / np.linalg.norm(away, axis=1, keepdims=True) * random.random((count, 1)) ** (1 / 3)


def services(name: str, random: np.random.Generator) -> str:
    """Row of the tray's places, with random points and directions in proven bricks solved one by one."""
    robot = narrowed(load_robot(name), TRAY.margin)
    arm, roll = section_arm(robot), roll_of(robot, 1)
    field = survey(robot, TRAY, roll, 2 * (arm.upper_length + arm.forearm_length + arm.d) / ACROSS)
    bricks = proven_bricks(robot, TRAY, field, roll)
    places = fitting_places(field, bricks, TRAY.box)
    chosen = choose_places(robot, TRAY, places, roll, 5, BUDGETS[0])
    low = field.origin + random.choice(np.argwhere(bricks), SERVICES) * field.spacing
    missed = _missed(robot, low + random.random((SERVICES, 3)) * field.spacing, roll, random)
    listed = f"{sum(chosen.proven)} of {len(chosen.proven)}"
    served = int((field.manipulability_any > NO).sum())
    share = f"{100 * places.proven.mean():.1f} %"
    return f"| {name} | {served:,} | {len(places.slot):,} | {share} | {listed} | {SERVICES:,} | {missed} |"


def _missed(robot: Robot, points: np.ndarray, roll, random: np.random.Generator) -> int:
    polar = np.arccos(1 - random.random(SERVICES) * (1 - np.cos(TRAY.half_angle)))
    rotations = tool_rotations(from_polar(TRAY.axis, polar, random.random(SERVICES) * 2 * np.pi), roll)[:, 0]
    return int((~inverse_batch(robot, poses(points, rotations)).within_limits.any(axis=1)).sum())


def table() -> str:
    """The evidence as Markdown."""
    random = np.random.default_rng(SEED)
    lines = [
        "# What a tool can do, at full size",
        "",
        "Written by `make campaigns ARGS=capability` (benchmarks/campaign_capability.py).",
        "",
        "Dexterous core (all tool directions), proven bounds, by the number of neighbourhoods of poses looked at; CPU",
        "time of one core on a shared machine:",
        "",
        "| arm | neighbourhoods | rings | at least (L) | estimate (L) | at most (L) | CPU |",
        "|---|---|---|---|---|---|---|",
        *(row for name in ROBOTS for row in cores(name)),
        "",
        "Neighbourhoods of random poses: branches told good or impossible throughout, and members that contradict it:",
        "",
        "| arm | radius | good | impossible | members × branches | contradictions |",
        "|---|---|---|---|---|---|",
        *(neighbourhoods(name, *size, random) for name in ROBOTS for size in SIZES),
        "",
        "A tray of 200 × 150 × 50 mm, tool down within 30 deg, 2 deg from limits; random points and directions in the",
        "proven bricks, each solved by the closed form:",
        "",
        "| arm | lattice points that serve | places | proven | best five proven | random services | missed |",
        "|---|---|---|---|---|---|---|",
        *(services(name, random) for name in ROBOTS),
    ]
    return "\n".join(lines) + "\n"
