"""Poses as a controller would show them, with one or two known causes between it and the model; how many are named.

python -m testing.controller_cases [SEEDS]      counts, alone and in pairs, on the arms that come with er3a

Values are rounded as a pendant rounds them: 0.01 mm, 0.01 deg, joint values too.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

import er3a
from er3a.confirmation.fit import Fitter, Solution
from er3a.confirmation.layers import Attempts, search
from er3a.confirmation.pairs import Pairs
from er3a.files.orientations import OF_THREE, of_angles
from er3a.geometry.transforms import rot_y, rot_z, rpy_of, translation

ARMS = ("er3_600", "er3a_c60", "lbr_iiwa_14", "ur5e")
CAUSES = ("tool", "base", "zero", "sense", "ground", "small", "family", "angles", "inches")
POSES, DIGIT = 12, 0.01
ALIKE = 45.0  # squares and price by which another explanation may be worse and counts as listed


@dataclass(frozen=True)
class Case:
    """Pairs, and what is between model and controller: joints and entries by cause."""

    pairs: Pairs
    truth: dict[str, Any]


def case(robot: er3a.Robot, causes: tuple[str, ...], seed: int, count: int = POSES) -> Case:
    """Poses with causes between controller and model.

    Parameters
    ----------
    causes : of ``CAUSES``
    count : how many poses, all over the limits
    """
    random, truth = np.random.default_rng(seed), dict.fromkeys(causes, True)
    lower, upper = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    q = lower + (upper - lower) * random.uniform(0.1, 0.9, (count, robot.joints))
    own, arm, Y, X = q.copy(), robot, np.eye(4), np.eye(4)
    for cause in causes:
        if cause == "tool":
            X = translation(*random.choice([(0, 0, 0.12), (0.02, -0.05, 0.1)])) @ rot_y(random.choice([0, 0.5]))
        elif cause == "base":
            Y = translation(0.3, -0.2, 0.05) @ rot_z(np.pi / 4)
        elif cause == "zero":  # of an inner joint: those of the first and the last act as base and tool do
            truth[cause] = int(random.integers(1, robot.joints - 1))
            own[:, truth[cause]] += np.radians(random.choice([1.5, -2.3]))
        elif cause == "sense":
            truth[cause] = int(random.integers(0, robot.joints))
            own[:, truth[cause]] *= -1
        elif cause == "ground":
            own[:, 2] -= q[:, 1]
        elif cause == "small":
            arm = _calibrated(arm, random)
        elif cause == "family":
            arm, truth[cause] = _longer(arm, robot, random)
    return Case(_typed(q, Y @ er3a.forward(arm, own) @ X, causes), truth)


def _calibrated(arm: er3a.Robot, random: np.random.Generator) -> er3a.Robot:
    """An arm with errors of 0.4 mm and 1 mrad in all entries."""
    sizes = {"a": 4e-4, "d": 4e-4, "alpha": 1e-3, "offset": 1e-3}
    return replace(arm, **{name: getattr(arm, name) + random.normal(0, size, arm.rows) for name, size in sizes.items()})


def _longer(arm: er3a.Robot, robot: er3a.Robot, random: np.random.Generator) -> tuple[er3a.Robot, set[str]]:
    """An arm of the same family: two of its lengths are 100 mm more."""
    inner = [("a", k) for k in range(robot.rows)] + [("d", k) for k in range(1, robot.rows - 1)]
    long = [(name, k) for name, k in inner if abs(getattr(robot, name)[k]) > 0.05]
    chosen = [long[i] for i in random.choice(len(long), 2, replace=False)]
    for name, k in chosen:
        values = getattr(arm, name).copy()
        values[k] += 0.1 * np.sign(values[k])
        arm = replace(arm, **{name: values})
    return arm, {f"{name}{k + 1}" for name, k in chosen}


def _typed(q: np.ndarray, T: np.ndarray, causes: tuple[str, ...]) -> Pairs:
    """Rows as typed from a pendant, under headings of roll, pitch and yaw, in mm."""
    size = 1 / 25.4 if "inches" in causes else 1.0
    angles = rpy_of(T)[:, ::-1] if "angles" in causes else rpy_of(T)
    shown = [
        np.round(values / DIGIT) * DIGIT for values in (np.degrees(q), 1000 * size * T[:, :3, 3], np.degrees(angles))
    ]
    forms = sorted(OF_THREE, key=lambda form: form != "rpy")
    turns = {form: of_angles(form, np.radians(shown[2])) for form in forms}
    digit = float(np.radians(DIGIT))
    digits = np.full(q.shape[1], digit), np.full(3, DIGIT / 1000), digit
    return Pairs(np.radians(shown[0]), shown[1] / 1000, turns, 1, *digits, np.arange(len(q)))


def names(solution: Solution, truth: dict[str, Any]) -> bool:
    """Whether an explanation is the truth: all causes, and no other."""
    found = solution.explanation
    joints = {(each.code, each.joint) for each in found.joints.faults}
    wanted = {("counted_from", 3)} if "ground" in truth else set()
    wanted |= {("turns_other_way", truth["sense"] + 1)} if "sense" in truth else set()
    entries = {f"offset{truth['zero'] + 1}"} if "zero" in truth else set()
    return (
        joints == wanted
        and {each.name for each in found.entries} == entries | truth.get("family", set())
        and {"base", "tool"} & truth.keys() == set(found.free)
        and (found.small, found.form, found.factor)
        == ("small" in truth, "abc" if "angles" in truth else "rpy", 25.4 if "inches" in truth else 1.0)
        and bool(solution.rows.all())
    )


def judged(found: Attempts, truth: dict[str, Any]) -> str:
    """``first``, ``alike`` where the truth fits as well as what is named first, or ``missed``."""
    explained = found.explained()
    if explained and names(explained[0], truth):
        return "first"
    near = [each for each in explained if found.total(each) < found.total(explained[0]) + ALIKE]
    return "alike" if any(names(each, truth) for each in near) else "missed"


def main() -> None:
    """Print counts, alone and in pairs, and the longest time."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 2
    kinds = {"alone": [(), *((cause,) for cause in CAUSES)], "pairs": list(combinations(CAUSES, 2))}
    for kind, every in kinds.items():
        counts, times = Counter[str](), []
        for name in ARMS:
            robot = er3a.load_robot(name)
            for causes in every:
                for seed in range(seeds):
                    made = case(robot, causes, seed)
                    start = time.process_time()
                    result = judged(search(Fitter(robot, made.pairs)), made.truth)
                    times.append(time.process_time() - start)
                    counts[result] += 1
                    if result != "first":
                        print(f"{kind}: {name} {' + '.join(causes)} (seed {seed}): {result}")
        print(f"{kind}: {dict(counts)} of {len(times)}, {max(times):.1f} s at most, {np.mean(times):.2f} s on average")


if __name__ == "__main__":
    main()
