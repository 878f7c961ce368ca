"""The set of pairs that explain, against a refit of every pair of numbers from many places by kinematics and least
squares of its own."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from scipy.optimize import linprog

import er3a
from er3a.diagnosis.diagnose import diagnosis_of
from er3a.diagnosis.faults import entry_of
from er3a.files.robot_library import load_robot
from er3a.numerics.arrays import Reals
from testing.flange_positions import HALF_WIDTH_MM, flange_mm, references_to

pytestmark = pytest.mark.long

COLUMNS = ("a", "d", "alpha", "offset")
ENTRIES = [f"{column}{joint}" for column in COLUMNS for joint in range(1, 7)]
STARTS, PASSES, PROBE = 48, 60, 1e-6
CORRUPTED = [
    ("er3a_c60", {"d6": 0.01192, "alpha5": 0.01197}),
    ("er3_600", {"alpha4": 0.9, "offset5": -0.3}),
]


def positions(numbers: Reals, direction: Reals, base: Reals) -> Reals:
    """Positions (B, 15) of rows (B, 4, 6) in m and rad."""
    signs = np.broadcast_to(direction, (len(numbers), 1, 6))
    return flange_mm(np.concatenate([numbers, signs], axis=1), False, base)


class Refit:
    """Every pair of numbers of a robot's table against stated positions (15,) in mm."""

    def __init__(self, robot: er3a.Robot, stated: Reals):
        self.robot, self.stated = robot, stated
        self.numbers = np.stack([getattr(robot, column) for column in COLUMNS])

    def left(self, places: Reals, amounts: Reals) -> Reals:
        """Residuals (B, 15) in half-widths with amounts (B, 2) added to flat places (B, 2)."""
        numbers = np.repeat(self.numbers.reshape(1, -1), len(places), axis=0)
        np.add.at(numbers, (np.arange(len(places))[:, None], places), amounts)
        found = positions(numbers.reshape(-1, 4, 6), self.robot.direction, self.robot.base)
        return (found - self.stated) / HALF_WIDTH_MM

    def slope(self, places: Reals, amounts: Reals, left: Reals) -> Reals:
        """(B, 15, 2)."""
        return np.stack([self.left(places, amounts + PROBE * unit) - left for unit in np.eye(2)], axis=-1) / PROBE

    def explaining(self) -> set[tuple[str, str]]:
        """Pairs of which some values meet all positions."""
        random = np.random.default_rng(3)
        pairs = list(combinations(range(24), 2))
        places = np.repeat(np.array(pairs), STARTS, axis=0)
        wide = np.where(places < 12, 0.6, np.pi) * random.choice([0.02, 0.2, 1.0], (len(places), 1))
        amounts = random.uniform(-wide, wide)
        amounts[::STARTS] = 0
        left, damping = self.left(places, amounts), np.full(len(places), 1e-3)
        going = np.ones(len(places), dtype=bool)
        for _ in range(PASSES):
            rows = np.flatnonzero(going)
            J = self.slope(places[rows], amounts[rows], left[rows])
            normal = np.einsum("bnk,bnl->bkl", J, J)
            size = np.einsum("bkk->bk", normal) + 1e-9 * np.abs(normal).max(axis=(1, 2), keepdims=True)[:, 0] + 1e-12
            normal = normal + np.eye(2) * (damping[rows, None] * size)[:, None]
            step = -np.linalg.solve(normal, np.einsum("bnk,bn->bk", J, left[rows])[..., None])[..., 0]
            trial = self.left(places[rows], amounts[rows] + step)
            before, after = (left[rows] ** 2).sum(axis=1), (trial**2).sum(axis=1)
            better = after < before
            amounts[rows[better]] += step[better]
            left[rows[better]] = trial[better]
            damping[rows] = np.where(better, damping[rows] / 8, damping[rows] * 5)
            going[rows[better & (before - after < 1e-9 * before)]] = False
            going &= damping < 1e8
        squares = (left**2).sum(axis=1)
        found = set[int]()
        for row in np.flatnonzero(squares < 2.5 * len(self.stated)):
            if row // STARTS not in found and self._least(places[[row]], amounts[[row]]) <= 1:
                found.add(int(row // STARTS))
        return {(ENTRIES[i], ENTRIES[j]) for i, j in (pairs[k] for k in found)}

    def _least(self, places: Reals, amounts: Reals) -> float:
        """The least greatest residual near amounts (1, 2), by linear programs."""
        left = self.left(places, amounts)
        for _ in range(6):
            J, one = self.slope(places, amounts, left)[0], np.ones((left.shape[1], 1))
            bounds = [(-0.05, 0.05), (-0.05, 0.05), (0, None)]
            rows = np.block([[J, -one], [-J, -one]])
            solved = linprog([0, 0, 1], A_ub=rows, b_ub=np.concatenate([-left[0], left[0]]), bounds=bounds)
            trial = self.left(places, amounts + solved.x[:2])
            if not np.abs(trial).max() < np.abs(left).max():
                break
            amounts, left = amounts + solved.x[:2], trial
        return float(np.abs(left).max())


@pytest.mark.parametrize(("name", "wrong"), CORRUPTED)
def test_the_pairs_in_the_verdict_are_all_that_explain(name, wrong):
    robot = load_robot(name).without_tool()
    numbers = np.stack([getattr(robot, column) for column in COLUMNS])
    stated = positions(numbers[None], robot.direction, robot.base)[0].round(1)
    for entry, by in wrong.items():
        numbers[COLUMNS.index(entry[:-1]), int(entry[-1]) - 1] += by
    given = robot.replace(**dict(zip(COLUMNS, numbers)))
    best = diagnosis_of(given, references_to(stated))[0]
    assert best.explains
    sets = [[entry_of(fault) for fault in faults] for faults in (best.faults, *best.indistinguishable_from)]
    in_verdict = {tuple(sorted(own, key=ENTRIES.index)) for own in sets if set(own) <= set(ENTRIES)}
    oracle = Refit(given, stated).explaining()
    assert tuple(sorted(wrong, key=ENTRIES.index)) in oracle
    assert in_verdict == oracle
