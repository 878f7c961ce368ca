"""Do the 95 % intervals of estimated corrections hold the truth in 95 of 100 runs?"""

from __future__ import annotations

import numpy as np

from er3a import load_robot
from testing.evidence import sized
from testing.simulated_measurements import ANGLE_ERROR_RAD, LENGTH_ERROR_M, covered

ROBOTS = ("er3a_c60", "er3_600")
RUNS, POSES, DEVIATION_MM, SEED = sized(500), 30, 0.05, 20261120


def table() -> str:
    """The evidence as Markdown."""
    random = np.random.default_rng(SEED)
    lines = [
        "# Calibration: coverage of the 95 % intervals",
        "",
        f"{RUNS} arms per robot with random errors in every identifiable entry (standard deviation",
        f"{LENGTH_ERROR_M * 1000:g} mm, {np.degrees(ANGLE_ERROR_RAD):.3f} deg), each measured at {POSES} random poses",
        f"with {DEVIATION_MM:g} mm noise a coordinate; how often the interval holds the true correction. The standard",
        f"error of a share over {RUNS} runs is {np.sqrt(0.95 * 0.05 / RUNS):.1%}. Seed {SEED}. Written by",
        "`make campaigns ARGS=calibration`.",
        "",
        "| robot | entries | all entries | lowest of one entry | highest of one entry |",
        "|---|---|---|---|---|",
    ]
    for name in ROBOTS:
        names, inside = covered(load_robot(name), RUNS, POSES, DEVIATION_MM, random)
        share = inside.mean(axis=0)
        low, high = int(share.argmin()), int(share.argmax())
        lines.append(
            f"| {name} | {len(names)} | {inside.mean():.2%} | {share[low]:.1%} ({names[low]}) "
            f"| {share[high]:.1%} ({names[high]}) |"
        )
    return "\n".join(lines) + "\n"
