"""What a model errs by at poses that its fit has not seen, and which terms of joints lower that.

Poses are left out in tenths: drawn at random, as new poses among the old ones would come, and as neighbourhoods of
joint space (k-means), where a model has to carry over to what it has not been near [1]_. Near the best fit the
measured coordinates are linear in all corrections, so that each fit without a tenth is a small linear system.

References
----------
.. [1] D. R. Roberts et al., "Cross-validation strategies for data with temporal, spatial, hierarchical, or phylogenetic
   structure", Ecography 40(8), 2017.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from scipy.cluster.vq import kmeans2

from er3a.calibration.fit import Fit, jacobian
from er3a.calibration.observations import PointObservations
from er3a.calibration.outcomes import TermVerdict
from er3a.calibration.parameters import Parameter
from er3a.calibration.terms import TYPICAL, JointTerm, TermKind, candidates, places_of, term_jacobian, wrong_way
from er3a.numerics.arrays import Integers, Reals
from er3a.robots.robot import Robot

PARTS = 10
SEEDS = 1, 2, 3, 4
SURE = 1e-4
"""How improbable a term's share has to be if there is only noise; some 25 terms are tried."""
LEAST_POSES = 40
LEAST_SPARE = 4
"""Coordinates for each number of the largest model, for terms to be tried."""
RIDGE = 1e-12


@dataclass(frozen=True)
class HeldOutErrors:
    """Distances between model and measurement at poses that were left out, mm.

    Attributes
    ----------
    mean_mm, worst_mm : over the poses, tenths drawn at random
    far_mean_mm, far_worst_mm : neighbourhoods of joint space
    """

    mean_mm: float
    worst_mm: float
    far_mean_mm: float
    far_worst_mm: float


@dataclass(frozen=True)
class TriedTerm:
    """A term that was tried.

    Attributes
    ----------
    kind, joint : which
    change, far_change : of the mean squared error at poses left out, as a share, tenths at random and neighbourhoods:
        when a term was taken, or of a term that was not, beside those that were
    probability : of so large a share by chance, if there is only noise
    verdict : whether it was taken, or why not
    """

    kind: TermKind
    joint: int
    change: float
    far_change: float
    probability: float
    verdict: TermVerdict


class _Linear:
    """The model near the best fit: columns of numbers and terms, and the tenths that are left out."""

    def __init__(self, J: Reals, rest: Reals, prior: Reals, pose_of: Integers, parts: Sequence[Integers]):
        scale = np.linalg.norm(J, axis=0)
        scale[scale == 0] = 1.0
        self.J, self.rest, self._pose_of = J / scale, rest, pose_of
        self._prior = (prior / scale) ** 2 + RIDGE
        self.whole = self.J.T @ self.J, self.J.T @ rest
        self.parts = [[self._part(part[pose_of] == k) for k in range(PARTS)] for part in parts]
        self.scale = scale

    def _part(self, out: np.ndarray) -> tuple[np.ndarray, Reals, Reals]:
        own = self.J[out]
        return out, self.whole[0] - own.T @ own, self.whole[1] - own.T @ self.rest[out]

    def errors(self, columns: list[int]) -> list[Reals]:
        """(n,) for each way of leaving out: what the fits without a coordinate's part leave of it."""
        square, prior = np.ix_(np.array(columns), np.array(columns)), np.diag(self._prior[columns])
        found = []
        for parts in self.parts:
            errors = np.empty_like(self.rest)
            for out, information, right in parts:
                amounts = np.linalg.solve(information[square] + prior, right[columns])
                errors[out] = self.rest[out] - self.J[out][:, columns] @ amounts
            found.append(errors)
        return found

    def squares(self, columns: list[int]) -> Reals:
        """Mean square for each way of leaving out."""
        return np.array([errors @ errors / len(errors) for errors in self.errors(columns)])

    def fitted(self, columns: list[int]) -> tuple[Reals, float]:
        """Amounts (c,) from all coordinates, and what they leave, squared."""
        information = self.whole[0][np.ix_(np.array(columns), np.array(columns))] + np.diag(self._prior[columns])
        amounts = np.linalg.solve(information, self.whole[1][columns])
        rest = self.rest - self.J[:, columns] @ amounts
        return amounts / self.scale[columns], float(rest @ rest)


def parts_of(row_values: Reals, seed: int) -> tuple[Integers, Integers]:
    """Which of ten parts each pose (P, m) is in: at random, and by neighbourhood."""
    count = len(row_values)
    random = np.random.default_rng(seed).permutation(count) % PARTS
    spread = row_values.std(axis=0)
    scaled = row_values / np.where(spread > 0, spread, 1.0)
    near = kmeans2(scaled, min(PARTS, count), seed=np.random.default_rng(seed), minit="++")[1]
    return random, near.astype(np.int64)


@dataclass(frozen=True, eq=False)
class ChosenTerms:
    """Terms that lower the error at poses left out, all that were tried, and that error without them."""

    terms: tuple[JointTerm, ...]
    tried: tuple[TriedTerm, ...]


def can_leave_out(observations: PointObservations, numbers: int) -> bool:
    """Whether there are poses enough to leave some out."""
    return len(observations.row_values) >= LEAST_POSES and len(observations) >= 2 * numbers


def left_out(observations: PointObservations, found: Fit, seed: int = 0) -> HeldOutErrors:
    """What the model of a fit errs by at poses left out; other parts than those that terms are chosen by."""
    parts = parts_of(observations.row_values, seed)
    prior = np.r_[np.zeros(len(found.amounts)), np.full(len(found.coefficients), 1 / TYPICAL)]
    unknowns = np.r_[found.amounts, found.coefficients]
    linear = _Linear(found.J, found.J @ unknowns - found.after, prior, observations.pose_of, parts)
    near, far = (
        np.sqrt(np.bincount(observations.pose_of, weights=(errors * observations.deviation_mm) ** 2))
        for errors in linear.errors(list(range(len(unknowns))))
    )
    return HeldOutErrors(float(near.mean()), float(near.max()), float(far.mean()), float(far.max()))


def choose_terms(robot: Robot, here: Robot, kept: Sequence[Parameter], observations: PointObservations) -> ChosenTerms:
    """Terms, one after the other, as long as both errors at poses left out fall and noise can't have done it.

    Parameters
    ----------
    robot : the table to start from; here : corrected without terms
    """
    every = candidates(robot)
    count, numbers = len(kept), len(kept) + sum(term.count for term in every)
    if not can_leave_out(observations, 0) or len(observations) < LEAST_SPARE * numbers:
        return ChosenTerms((), ())
    weights = observations.deviation_mm[:, None]
    J = np.hstack([jacobian(here, kept, observations), term_jacobian(here, robot, every, observations)]) / weights
    rest = (observations.values_mm - observations.predict(here, kept, np.zeros((1, count)))[0]) / weights[:, 0]
    prior = np.r_[np.zeros(count), np.full(numbers - count, 1 / TYPICAL)]
    parts = [part for seed in SEEDS for part in parts_of(observations.row_values, seed)]
    linear = _Linear(J, rest / np.sqrt(rest @ rest / (len(rest) - count)), prior, observations.pose_of, parts)
    places, open_terms = dict(zip(every, places_of(every, count))), list(every)
    columns, taken, tried = list(range(count)), [], []
    while True:
        outcomes = {term: _outcome(linear, columns, places[term], term) for term in open_terms}
        good = [term for term, outcome in outcomes.items() if outcome.verdict == "taken"]
        if not good:
            break
        best = min(good, key=lambda term: outcomes[term].change + outcomes[term].far_change)
        columns += places[best]
        taken.append(best)
        tried.append(outcomes[best])
        open_terms.remove(best)
    return ChosenTerms(tuple(taken), (*tried, *outcomes.values()))


def _outcome(linear: _Linear, columns: list[int], own: list[int], term: JointTerm) -> TriedTerm:
    before, after = linear.squares(columns), linear.squares([*columns, *own])
    change = (after / before - 1).reshape(len(SEEDS), 2).mean(axis=0)
    (_, squares), (amounts, fewer) = linear.fitted(columns), linear.fitted([*columns, *own])
    freedom = len(linear.rest) - len(columns) - len(own)
    ratio = max((squares - fewer) / len(own) / (fewer / freedom), 0.0)
    probability = float(scipy.special.fdtrc(len(own), freedom, ratio))
    verdict: TermVerdict = "taken"
    if probability > SURE:
        verdict = "noise"
    elif change.max() >= 0:
        verdict = "not_lower"
    elif wrong_way(term, amounts[-len(own) :]):
        verdict = "wrong_way"
    return TriedTerm(term.kind, term.joint, float(change[0]), float(change[1]), probability, verdict)
