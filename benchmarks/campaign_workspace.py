"""The workspace proof at full size: brackets and their cost, samples against empty cells.

And the sampling loop's speed beside its parts and Robotics Toolbox, with its peak memory.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time

import numpy as np
import roboticstoolbox as rtb

from er3a import forward, load_robot
from er3a.geometry.vectors import TURN
from er3a.numerics.jit import kernel
from er3a.robots.robot import Robot
from er3a.sampling.grid import make_grid
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import tally_blocks
from er3a.workspace.general_arm import general_arm
from er3a.workspace.general_proof import prove_general
from er3a.workspace.proven import SectionMap
from testing.evidence import sized

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
SAMPLES, SEED = sized(100_000_000), 20261120
_BLOCK = 1 << 18
_SPEED_SAMPLES, _MEMORY_SAMPLES = sized(20_000_000), sized(1_000_000_000)
CELLS = (8_000, 32_000)  # of a quarter of the default budget, and of it (`proof_cells: 8000`)


@kernel
def _in_empty(points, R, origin, low, per_length, owner, arcs):
    found = 0
    for n in range(points.shape[0]):
        x, y, z = points[n, 0] - origin[0], points[n, 1] - origin[1], points[n, 2] - origin[2]
        u = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z
        v = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z
        w = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z
        i, j = int((np.sqrt(u * u + v * v) - low[0]) * per_length), int((w - low[1]) * per_length)
        if i < 0 or j < 0 or i >= owner.shape[0] or j >= owner.shape[1]:
            found += 1
            continue
        cell = owner[i, j]
        if np.isnan(arcs[cell, 0, 0]):
            continue
        azimuth = np.arctan2(v, u) % TURN
        for k in range(arcs.shape[1]):
            if arcs[cell, k, 0] < azimuth < arcs[cell, k, 1]:
                found += 1
    return found


def samples_in_empty(robot: Robot) -> int:
    """How many of ``SAMPLES`` random samples fall into cells (or arcs of them) that are proven empty."""
    arm, R, origin = general_arm(robot)
    section = SectionMap(prove_general(arm, 0.0, CELLS[-1], SEED))
    random, found = np.random.Generator(np.random.Philox(key=SEED)), 0
    q, T = np.empty((_BLOCK, 6)), np.empty((_BLOCK, 4, 4))
    for _ in range(-(-SAMPLES // _BLOCK)):
        random.random(out=q)
        q *= robot.upper - robot.lower
        q += robot.lower
        points = forward(robot, q, out=T)[:, :3, 3]
        found += _in_empty(points, R, origin, section.low, 1 / section.size, section.owner, section.proof.empty)
    return found


def cpu_time(run) -> float:
    """Least processor time of three runs after a first one, s: less disturbed than wall time on a shared machine."""
    run()
    times = []
    for _ in range(3):
        start = time.thread_time()
        run()
        times.append(time.thread_time() - start)
    return min(times)


def speed_row(name: str) -> str:
    """The loop against its parts made from public pieces, per sample, one thread."""
    robot = load_robot(name)
    grid, draw = make_grid(robot, 64), Draw(SEED, _SPEED_SAMPLES, 1)
    q, T = np.empty((1 << 20, 6)), np.empty((1 << 20, 4, 4))
    random = np.random.default_rng(SEED)
    peer = rtb.DHRobot([rtb.RevoluteDH(a=a, d=d, alpha=b) for a, d, b in zip(robot.a, robot.d, robot.alpha)])

    def plain():
        random.random(out=q)
        forward(robot, q, out=T)

    def loop():
        for row in q[:300]:
            peer.fkine(row)

    base = cpu_time(plain) / len(q)
    counted = cpu_time(lambda: tally_blocks(robot, grid, draw, [0])) / _SPEED_SAMPLES
    theirs = cpu_time(loop) / 300
    times = f"{base * 1e9:.1f} | {counted * 1e9:.1f} | {base / counted:.1f}"
    return f"| {name} | {times} | {theirs / counted:,.0f} |"


def scaling() -> float:
    """Wall time of two processes one after the other, over that of both side by side."""
    command = [sys.executable, __file__, "sample"]

    def timed(groups: list[int]) -> float:
        start = time.perf_counter()
        for count in groups:
            for process in [
                subprocess.Popen([*command, str(10 * _SPEED_SAMPLES)], stdout=subprocess.DEVNULL) for _ in range(count)
            ]:
                process.wait()
        return time.perf_counter() - start

    return timed([1, 1]) / timed([2])


def peak_memory() -> int:
    """Peak resident memory (MiB) of a process that draws ``_MEMORY_SAMPLES``."""
    command = [sys.executable, __file__, "sample", str(_MEMORY_SAMPLES)]
    return int(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def sample(count: int) -> None:
    """Draw and count, and print the peak resident memory in MiB."""
    robot = load_robot("er3a_c60")
    tally_blocks(robot, make_grid(robot, 64), Draw(SEED, count, 32), range(32))
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)


def general_arms() -> dict[str, Robot]:
    """Arms of other builds than a spherical wrist with a long tool."""
    turn, right = np.pi, np.pi / 2

    def arm(name: str, rows: list[tuple[float, float, float]], limits_deg: list[float], offset_2: float = 0.0) -> Robot:
        a, alpha, d = np.transpose(rows)
        ends, offset = np.radians(limits_deg), np.zeros(len(rows))
        offset[1] = offset_2
        return Robot(name, name, "standard", a, alpha, d, np.ones(len(rows)), offset, -ends, ends)

    arms = {name: load_robot(name) for name in ("ur5e", "lbr_iiwa_14")}
    crx = [(0, -right, 0.245), (0.71, turn, 0), (0, -right, 0), (0, right, -0.54), (0, -right, 0.15), (0, turn, -0.16)]
    arms["crx_10ia_l"] = arm("crx_10ia_l", crx, [180, 180, 270, 190, 180, 190], -right)
    for name, d6 in (("puma_560", 0.05625), ("puma_560_wrist", 0.0)):
        rows = [
            (0, right, 0),
            (0.4318, 0, 0),
            (0.0203, -right, 0.15005),
            (0, right, 0.4318),
            (0, -right, 0),
            (0, 0, d6),
        ]
        arms[name] = arm(name, rows, [160, 110, 135, 266, 100, 266])
    scara = arm("scara", [(0.325, 0, 0.387), (0.275, turn, 0), (0, 0, 0), (0, 0, 0)], [105, 157.5, 0, 360])
    upper = np.array([*scara.upper[:2], 0.21, scara.upper[3]])
    arms["scara"] = scara.replace(sliding=np.array([False, False, True, False]), upper=upper)
    return arms


def row(name: str, robot: Robot, cells: int) -> str:
    """One arm's bracket."""
    arm = general_arm(robot)[0]
    start = time.process_time()
    proof = prove_general(arm, 0.0, cells, SEED)
    (lower, upper), busy = proof.bounds, time.process_time() - start
    return f"| {name} | {cells:,} | {lower:.4f} | {upper:.4f} | {proof.width:.2%} | {busy:.0f} |"


def table() -> str:
    """The evidence as Markdown."""
    own = {name: load_robot(name) for name in ROBOTS}
    arms = own | general_arms()
    lines = [
        "# The workspace at full size",
        "",
        "On a shared machine. Seed 20261120. Written by `make campaigns ARGS=workspace`. Width is",
        "(upper - lower) / upper of the reached volume; one thread. `puma_560_wrist` has the tool point on the wrist",
        "centre (d6 = 0).",
        "",
        "| arm | cells looked at | lower (m³) | upper (m³) | width | processor time (s) |",
        "|---|---|---|---|---|---|",
        *(row(name, robot, cells) for name, robot in arms.items() for cells in CELLS),
        "",
        f"Random samples ({SAMPLES:,} per robot, joints uniform within their limits) in the cells of the last row that",
        "are proven empty:",
        "",
        "| robot | samples in empty cells |",
        "|---|---|",
        *(f"| {name} | {samples_in_empty(robot)} |" for name, robot in own.items()),
    ]
    lines += [
        "",
        "## Sampling",
        "",
        "Nanoseconds of processor time per sample, one thread. *Plain* is `Generator.random(out=)` and er3a's",
        "`forward` with `out=`, without counting anything. *Loop* draws, places and counts in the side view.",
        "The last column is against Robotics Toolbox's `fkine` in a Python loop.",
        "",
        "| robot | plain | loop | times | times `fkine` |",
        "|---|---|---|---|---|",
        *map(speed_row, ROBOTS),
        "",
        f"Two processes side by side: {scaling():.2f} times one after the other. Peak memory at {_MEMORY_SAMPLES:,}",
        f"samples: {peak_memory()} MiB, libraries included.",
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sample(int(sys.argv[2]))
