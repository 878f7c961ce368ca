"""Do the 95 % intervals of estimated corrections hold the truth in 95 of 100 runs?"""

from __future__ import annotations

import itertools

import numpy as np

from er3a import load_robot
from testing.evidence import sized
from testing.simulated_measurements import ANGLE_ERROR_RAD, LENGTH_ERROR_M, covered

ROBOTS = ("er3a_c60", "er3_600")
RUNS = {30: sized(500), 130: sized(200)}
DEVIATION_MM, SEED = 0.05, 20261120


def table() -> str:
    """The evidence as Markdown."""
    random = np.random.default_rng(SEED)
    lines = [
        "# Calibration: coverage of the 95 % intervals, and terms that are not there",
        "",
        f"Arms with random errors in every identifiable entry (standard deviation {LENGTH_ERROR_M * 1000:g} mm,",
        f"{np.degrees(ANGLE_ERROR_RAD):.3f} deg), each measured at random poses with {DEVIATION_MM:g} mm noise a",
        "coordinate; how often the interval holds the true correction, with the standard error of a share of the runs.",
        "Errors of joints beyond the table, couplings among them, are tried where there are poses enough; how many",
        "runs took one, by the whole model or in the robot file, though there is none.",
        f"Seed {SEED}. Written by `make campaigns ARGS=calibration`.",
        "",
        "| robot | poses | runs | entries | all entries | lowest of one | highest of one | +- | terms taken |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, (poses, runs) in itertools.product(ROBOTS, RUNS.items()):
        names, inside, terms = covered(load_robot(name), runs, poses, DEVIATION_MM, random)
        share = inside.mean(axis=0)
        low, high = int(share.argmin()), int(share.argmax())
        lines.append(
            f"| {name} | {poses} | {runs} | {len(names)} | {inside.mean():.2%} | {share[low]:.1%} ({names[low]}) "
            f"| {share[high]:.1%} ({names[high]}) | {np.sqrt(0.95 * 0.05 / runs):.1%} "
            f"| {terms if poses > min(RUNS) else 'none tried'} |"
        )
    return "\n".join(lines) + "\n"
