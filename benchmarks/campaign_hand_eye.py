"""Do the 95 % intervals of hand-eye calibrations hold the truth in 95 of 100 runs?"""

from __future__ import annotations

import numpy as np

from testing.evidence import sized
from testing.hand_eye_coverage import BOARDS, SAMPLES, board_coverage, pose_coverage

SETUPS = ("eye_in_hand", "eye_to_hand")
SETS, RUNS, BOARD_RUNS, SEED = sized(10), sized(50), sized(40), 20261121


def _error(runs: int) -> str:
    """Standard error of a share of 95 %."""
    return f"{np.sqrt(0.95 * 0.05 / runs):.1%}"


def table() -> str:
    """The evidence as Markdown."""
    lines = [
        "# Hand-eye calibration: coverage of the 95 % intervals",
        "",
        f"The twelve numbers of hand-eye and board pose, from {SAMPLES} samples with normal errors of the camera:",
        f"{SETS * RUNS} runs a row, {RUNS} at each of {SETS} sets of poses.",
        f"The standard error of a share is {_error(SETS * RUNS)}. Written by `make campaigns ARGS=hand_eye`.",
        "",
        "| camera | deviations | all numbers | lowest of one | highest of one |",
        "|---|---|---|---|---|",
    ]
    for setup in SETUPS:
        for stated in (True, False):
            share = np.mean([pose_coverage(setup, stated, RUNS, SEED + k) for k in range(SETS)], axis=0)
            lines.append(
                f"| {setup.replace('_', ' ')} | {'stated' if stated else 'estimated'} | {share.mean():.2%} "
                f"| {share.min():.1%} | {share.max():.1%} |"
            )
    lines += [
        "",
        f"Poses that OpenCV computes from a board's corners with noise in pixels, {BOARD_RUNS} sets a row; the",
        f"standard error of one number's share is {_error(BOARD_RUNS)}.",
        "",
        "| camera | samples | camera's position | rotation | board's position | rotation |",
        "|---|---|---|---|---|---|",
    ]
    for setup in SETUPS:
        for cell in BOARDS:
            share = board_coverage(setup, cell, BOARD_RUNS, SEED).reshape(-1, 4, 3).mean(axis=(0, 2))
            lines.append(
                f"| {setup.replace('_', ' ')} | {cell} | " + " | ".join(f"{part:.1%}" for part in share) + " |"
            )
    return "\n".join(lines) + "\n"
