"""The workspace proof at full size: brackets and their cost, samples against empty cells, the stratified estimate."""

from __future__ import annotations

import time

import numpy as np

from er3a import load_robot
from er3a.kinematics.chain import JOINTS, constant_links
from er3a.kinematics.jit import kernel
from er3a.stages.workspace.tally import _points
from er3a.workspace.arcs import TURN
from er3a.workspace.lookup import SectionMap
from er3a.workspace.proof import prove
from er3a.workspace.section_arm import section_arm, section_frame
from er3a.workspace.volume import estimate_volume, stratified_volume

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
CELLS = (6_000, 25_000, 60_000)
SAMPLES, SEED, RUNS, POINTS = 1_000_000_000 // 3 + 1, 20261120, 12, 2000
_BLOCK = 1 << 20


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


def samples_in_empty(robot, section: SectionMap) -> int:
    """How many of ``SAMPLES`` random samples fall into cells (or arcs of them) that are proven empty."""
    R, origin = section_frame(robot)
    q, points = np.empty(JOINTS), np.empty((_BLOCK, 3))
    found = 0
    for block in range(-(-SAMPLES // _BLOCK)):
        span, links = robot.upper - robot.lower, constant_links(robot)
        _points(np.uint64(SEED), block, 0, robot.lower, span, robot.direction, robot.offset, links, q, points)
        found += _in_empty(points, R, origin, section.low, 1 / section.size, section.owner, section.proof.empty)
    return found


def table() -> str:
    """The evidence as Markdown."""
    lines = [
        "# The workspace proof at full size",
        "",
        "One thread on a shared machine, so times are upper bounds. Seed 20261120. Written by",
        "`make campaigns ARGS=workspace`. Width is (upper - lower) / upper of the reached volume.",
        "",
        "| robot | cells looked at | lower (m³) | upper (m³) | width | time (s) |",
        "|---|---|---|---|---|---|",
    ]
    maps = {}
    for name in ROBOTS:
        arm = section_arm(load_robot(name))
        prove(arm, 0.0, 1)
        for cells in CELLS:
            start = time.perf_counter()
            proof = prove(arm, 0.0, cells)
            elapsed = time.perf_counter() - start
            lower, upper = proof.bounds
            lines.append(f"| {name} | {cells:,} | {lower:.4f} | {upper:.4f} | {proof.width:.2%} | {elapsed:.0f} |")
        maps[name] = SectionMap(proof)
    lines += [
        "",
        f"Random samples ({SAMPLES:,} per robot, joints uniform within their limits) in the cells of the last row that",
        f"are proven empty; and the root mean square error of the volume over {RUNS} runs of {POINTS:,} points,",
        "against the middle of the bracket: uniform points in the bounding solid, and the stratified estimate,",
        "which rests on the proof with 6,000 cells (its cost is not counted).",
        "",
        "| robot | samples in empty cells | uniform (m³) | stratified (m³) | ratio |",
        "|---|---|---|---|---|",
    ]
    for name in ROBOTS:
        robot, section = load_robot(name), maps[name]
        arm = section_arm(robot)
        coarse = SectionMap(prove(arm, 0.0, 6000))
        exact = sum(section.proof.bounds) / 2
        plain = [
            estimate_volume(arm, coarse, arm.reach, arm.heights, POINTS, seed).value - exact for seed in range(RUNS)
        ]
        strata = [stratified_volume(arm, coarse, POINTS, seed) - exact for seed in range(RUNS)]
        a, b = (float(np.sqrt(np.mean(np.square(errors)))) for errors in (plain, strata))
        lines.append(f"| {name} | {samples_in_empty(robot, section)} | {a:.5f} | {b:.5f} | {a / b:.0f} |")
    return "\n".join(lines) + "\n"
