"""Where a tray can stand, at full size: random points and directions of listed places, solved one by one."""

from __future__ import annotations

import numpy as np

from er3a import load_robot
from er3a.kinematics.batch import inverse_batch
from er3a.workspace.cell_frame import cell_frame
from er3a.workspace.directions import from_polar, poses, roll_of, tool_rotations
from er3a.workspace.orientations import asked_of
from er3a.workspace.placement import NO, Task, find_places, narrowed
from testing.evidence import sized

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
SEED, ACROSS, PLACES = 20261120, 64, 5
SERVICES = sized(400_000)
TRAY = Task(np.array([0.2, 0.15, 0.05]), np.array([0.0, 0.0, -1.0]), np.radians(30), 0.0, 0.15, np.radians(2))


def services(name: str, random: np.random.Generator) -> str:
    """Row of the tray's places, with random points and directions in the best ones."""
    robot = load_robot(name)
    frame, roll, tight = cell_frame(robot), roll_of(robot, 1), narrowed(robot, TRAY.margin)
    found = find_places(robot, TRAY, asked_of(robot, 1), (frame.heights[1] - frame.heights[0]) / ACROSS, PLACES)
    places, row = found.places, random.choice(found.chosen, SERVICES)
    size = np.where(places.turned[row, None], TRAY.box[[1, 0, 2]], TRAY.box)
    points = places.centre[row] + (random.random((SERVICES, 3)) - 0.5) * size
    polar = np.arccos(1 - random.random(SERVICES) * (1 - np.cos(TRAY.half_angle)))
    rotations = tool_rotations(from_polar(TRAY.axis, polar, random.random(SERVICES) * 2 * np.pi), roll)[:, 0]
    missed = int((~inverse_batch(tight, poses(points, rotations)).within_limits.any(axis=1)).sum())
    served = int((found.field.manipulability_any > NO).sum())
    return f"| {name} | {served:,} | {len(places.slot):,} | {SERVICES:,} | {missed} |"


def table() -> str:
    """The evidence as Markdown."""
    random = np.random.default_rng(SEED)
    lines = [
        "# Where a tray can stand, at full size",
        "",
        "Written by `make campaigns ARGS=capability` (benchmarks/campaign_capability.py).",
        "",
        "A tray of 200 × 150 × 50 mm, tool down within 30 deg, 2 deg from limits. Places are found from a lattice;",
        f"random points and directions of the best {PLACES}, each solved by the closed form:",
        "",
        "| arm | lattice points that serve | places | random services | missed |",
        "|---|---|---|---|---|",
        *(services(name, random) for name in ROBOTS),
    ]
    return "\n".join(lines) + "\n"
