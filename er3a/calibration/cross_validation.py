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
from typing import Literal

import numpy as np
import scipy
import scipy.sparse
from scipy.cluster.vq import kmeans, vq

from er3a.by_value import by_identity, frozen
from er3a.calibration.fit import ROUNDING, Fit, jacobian
from er3a.calibration.observations import PointObservations
from er3a.calibration.parameters import DEPENDENT
from er3a.calibration.terms import (
    FOR_ALL_JOINTS,
    RIPPLES,
    TAKEN,
    TYPICAL,
    JointTerm,
    TermKind,
    candidates,
    places_of,
    term_jacobian,
    wrong_way,
)
from er3a.comparison.entries import Entry
from er3a.numerics.arrays import Integers, Reals
from er3a.robots.robot import Robot

TermVerdict = Literal["taken", "not_lower", "noise", "wrong_way"]
"""Whether a term beyond the table was taken; or left, because poses left out are not met better with it, because noise
may have made it, or because a load would have to lift the arm."""
PARTS = 10  # tenths, each left out once
SEEDS = 1, 2, 3, 4  # of ways of leaving out; an average of several depends less on the draw
SURE = 1e-5
"""How improbable a term's share has to be if there is only noise; some 80 terms are tried, again with each taken."""
MIN_GAIN = 0.01
"""Share of the mean squared error at poses left out that a term has to take away, either way of leaving out."""
MIN_POSES = 40
MIN_SPARE = 3
"""Coordinates for each number of the model with all terms that are tried, for them to be tried."""
RIDGE = 1e-12  # of columns of unit length, so that dependent ones can be solved for


@frozen
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


@dataclass(frozen=True, kw_only=True)
class TriedTerm(JointTerm):
    """A term that was tried; of ripples the one of the joint that explains most.

    Attributes
    ----------
    change, far_change : of the mean squared error at poses left out, as a share, tenths at random and neighbourhoods:
        when a term was taken, or of a term that was not, or was dropped, beside those that were
    probability : of so large a share by chance, if there is only noise, of ripples for all numbers a turn
    verdict : whether it was taken, or why not
    """

    change: float
    far_change: float
    probability: float
    verdict: TermVerdict


class _Linear:
    """The model near the best fit: columns of numbers, of terms that were taken and of others, ``counts`` of the first
    two, and the tenths that are left out."""

    def __init__(self, J: Reals, rest: Reals, counts: tuple[int, int], pose_of: Integers, parts: Sequence[Integers]):
        scale = np.linalg.norm(J, axis=0)
        scale[scale == 0] = 1.0
        self.J, self.rest, self.scale = J / scale, rest, scale
        count, taken = counts
        prior = np.r_[np.zeros(count), np.full(taken, 1 / TAKEN), np.full(J.shape[1] - count - taken, 1 / TYPICAL)]
        self._prior = (prior / scale) ** 2 + RIDGE
        self.whole = self.J.T @ self.J, self.J.T @ rest
        self._parts = [[np.flatnonzero(part[pose_of] == k) for k in range(PARTS)] for part in parts]

    def errors(self, columns: list[int]) -> list[Reals]:
        """Errors at coordinates whose part was left out of the fit.

        Parameters
        ----------
        columns : which numbers are fitted

        Returns
        -------
        errors : (n,) for each way of leaving out, in standard deviations of a coordinate
        """
        J, (whole, right), found = np.ascontiguousarray(self.J[:, columns]), self._normal(columns), []
        for parts in self._parts:
            errors = np.empty_like(self.rest)
            for out in parts:
                own, rest = J[out], self.rest[out]
                errors[out] = rest - own @ np.linalg.solve(whole - own.T @ own, right - own.T @ rest)
            found.append(errors)
        return found

    def squares(self, columns: list[int]) -> Reals:
        """Mean square of the errors at what was left out.

        Parameters
        ----------
        columns : which numbers are fitted

        Returns
        -------
        squares : one for each way of leaving out
        """
        return np.array([errors @ errors / len(errors) for errors in self.errors(columns)])

    def fitted(self, columns: list[int]) -> tuple[Reals, float]:
        """The fit to all coordinates, with the priors of terms.

        Parameters
        ----------
        columns : c numbers that are fitted

        Returns
        -------
        amounts, squares : (c,), and the sum of squares that they leave
        """
        amounts = np.linalg.solve(*self._normal(columns))
        rest = self.rest - self.J[:, columns] @ amounts
        return amounts / self.scale[columns], float(rest @ rest)

    def _normal(self, columns: list[int]) -> tuple[Reals, Reals]:
        """The normal equations of a fit to all coordinates."""
        return self.whole[0][np.ix_(columns, columns)] + np.diag(self._prior[columns]), self.whole[1][columns]


def parts_of(observations: PointObservations, seed: int) -> tuple[Integers, Integers]:
    """Which of ten parts each point is in, all of one pose in one.

    Parameters
    ----------
    observations : of P points
    seed : of the random parts and of the neighbourhoods' first centres

    Returns
    -------
    random, near : (P,), numbers of parts, drawn at random, and by neighbourhood in joint space (k-means)
    """
    row_values, pose = observations.row_values, observations.same_pose
    count = len(row_values)
    random = (np.random.default_rng(seed).permutation(count) % PARTS)[pose]
    spread = row_values.std(axis=0)
    scaled = row_values / np.where(spread > 0, spread, 1.0)
    centres = kmeans(scaled, min(PARTS, count), seed=np.random.default_rng(seed))[0]  # fewer if some would be empty
    return random, vq(scaled, centres)[0].astype(np.int64)[pose]


@by_identity
class ChosenTerms:
    """Terms that lower the error at poses left out, all that were tried, and that error without them."""

    terms: tuple[JointTerm, ...]
    tried: tuple[TriedTerm, ...]


def can_leave_out(pose_of: Integers, numbers: int) -> bool:
    """Whether there are enough poses to leave some out.

    Parameters
    ----------
    pose_of : (m,), the pose of each independent coordinate
    numbers : how many numbers are estimated

    Returns
    -------
    enough : ``MIN_POSES`` poses, and twice as many coordinates as numbers
    """
    return len(np.unique(pose_of)) >= MIN_POSES and len(pose_of) >= 2 * numbers


def left_out(observations: PointObservations, found: Fit) -> HeldOutErrors:
    """Errors of a fitted model at poses left out, in other parts than those that terms are chosen by.

    Parameters
    ----------
    found : the fit to all observations

    Returns
    -------
    errors : mean and largest distance in mm, for poses left out at random, and by neighbourhood
    """
    parts = parts_of(observations, 0)
    unknowns = np.r_[found.amounts, found.coefficients]
    poses, pose_of = np.unique(observations.pose_of[found.last], return_inverse=True)
    counts = len(found.amounts), len(found.coefficients)
    linear = _Linear(found.J, found.J @ unknowns - found.rest, counts, poses[pose_of], parts)
    lengths = found.deviation_mm * observations.is_length[found.last]
    near, far = (
        np.sqrt(np.bincount(pose_of, weights=(errors * lengths) ** 2))
        for errors in linear.errors(list(range(len(unknowns))))
    )
    return HeldOutErrors(float(near.mean()), float(near.max()), float(far.mean()), float(far.max()))


def choose_terms(
    robot: Robot,
    here: Robot,
    kept: Sequence[Entry],
    observations: PointObservations,
    ways: Sequence[Sequence[TermKind]] = FOR_ALL_JOINTS,
) -> ChosenTerms:
    """Terms, one after the other, as long as both errors at poses left out fall and noise can't have done it.

    One that was taken in place of others is dropped when these are there.

    Parameters
    ----------
    robot : the table to start from; here : corrected without terms
    kept : entries that are fitted with the terms
    ways : kinds that are tried, by the first for which there are coordinates enough; none if there is no such, or if
        the table leaves nothing but rounding

    Returns
    -------
    chosen : the terms taken, and what was tried
    """
    rows, last = observations.independent(here)
    pose_of, rows = observations.pose_of[last], rows / observations.deviation_mm
    measured, turning, count = not (observations.touched >= 0).any(), int((~robot.sliding).sum()), len(kept)
    for kinds in ways if can_leave_out(pose_of, 0) else ():
        fixed_terms, ripples = candidates(robot, kinds), "ripple" in kinds and measured and turning > 0
        numbers = count + sum(term.count for term in fixed_terms) + ripples * 2 * turning
        if len(last) >= MIN_SPARE * numbers:
            break
    else:
        return ChosenTerms((), ())
    off = observations.values_mm - observations.predict(here)
    if np.sqrt(np.mean(off**2)) < ROUNDING:
        return ChosenTerms((), ())
    J, rest = rows @ jacobian(here, kept, observations), rows @ off
    rest = rest / np.sqrt(rest @ rest / (len(rest) - count))
    parts = [part for seed in SEEDS for part in parts_of(observations, seed)]
    search = _RippleSearch(here, observations, rows) if ripples else None
    taken: dict[JointTerm, TriedTerm] = {}
    dropped: dict[JointTerm, TriedTerm] = {}
    while True:
        own = rows @ term_jacobian(here, robot, tuple(taken), observations)
        open_terms = [*fixed_terms, *(search.best(np.hstack([J, own]), rest) if search else [])]
        open_terms = [term for term in open_terms if term not in taken and term not in dropped]
        more = rows @ term_jacobian(here, robot, open_terms, observations)
        linear = _Linear(np.hstack([J, own, more]), rest, (count, own.shape[1]), pose_of, parts)
        used, places = list(range(count + own.shape[1])), places_of(open_terms, count + own.shape[1])
        trials = [_Trial(linear, used, *pair) for pair in zip(open_terms, places)]
        before = linear.squares(used)
        by_gain = sorted((trial for trial in trials if trial.probability <= SURE), key=lambda trial: trial.rest)
        outcomes = ((trial.term, trial.outcome(before)) for trial in by_gain)
        if pair := next((pair for pair in outcomes if pair[1].verdict == "taken"), None):
            taken[pair[0]] = pair[1]
        elif pair := _needless(linear, used, list(taken), count):
            dropped[pair[0]] = pair[1]
            del taken[pair[0]]
        else:
            others = (trial.outcome(before) for trial in trials)
            return ChosenTerms(tuple(taken), (*taken.values(), *dropped.values(), *others))


def _needless(
    linear: _Linear, used: list[int], taken: Sequence[JointTerm], count: int
) -> tuple[JointTerm, TriedTerm] | None:
    """Of the terms that were taken the one that lowers the errors least, if it would not be taken beside the others."""
    found = []
    for term, own in zip(taken, places_of(taken, count)):
        rest = [place for place in used if place not in own]
        outcome = _Trial(linear, rest, term, own).outcome(linear.squares(rest))
        if outcome.verdict != "taken":
            found.append((term, outcome))
    return max(found, key=lambda pair: pair[1].change + pair[1].far_change, default=None)


class _Trial:
    """A term beside those that were taken: what it leaves, and whether noise may have made it."""

    def __init__(self, linear: _Linear, used: list[int], term: JointTerm, own: list[int]):
        self.term, self._linear, self._columns = term, linear, [*used, *own]
        squares = linear.fitted(used)[1]
        amounts, self.rest = linear.fitted(self._columns)
        self._amounts = amounts[-len(own) :]
        freedom = len(linear.rest) - len(self._columns)
        ratio = max((squares - self.rest) / len(own) / (self.rest / freedom), 0.0)  # of the F test
        self.probability = float(scipy.special.fdtrc(len(own), freedom, ratio))
        if term.kind == "ripple":
            self.probability = min(1.0, len(RIPPLES) * self.probability)

    def outcome(self, before: Reals) -> TriedTerm:
        """What leaving out poses says of a term.

        Parameters
        ----------
        before : mean squares of errors without it, for each way of leaving out

        Returns
        -------
        tried : with the share by which it changes them (negative is better), and whether it is taken
        """
        term = self.term
        change = (self._linear.squares(self._columns) / before - 1).reshape(len(SEEDS), 2).mean(axis=0)
        verdict: TermVerdict = "taken"
        if self.probability > SURE:
            verdict = "noise"
        elif change.max() > -MIN_GAIN:
            verdict = "not_lower"
        elif wrong_way(term, self._amounts):
            verdict = "wrong_way"
        near, far = change.tolist()
        return TriedTerm(**vars(term), change=near, far_change=far, probability=self.probability, verdict=verdict)


class _RippleSearch:
    """Of each joint's ripples the one that explains most, of coordinates that were measured.

    Attributes
    ----------
    rows : (n, n), which take observed values to independent ones, in standard deviations
    """

    def __init__(self, here: Robot, observations: PointObservations, rows: scipy.sparse.csr_array):
        self._terms = [
            [JointTerm("ripple", int(row) + 1, turns) for turns in RIPPLES] for row in np.flatnonzero(~here.sliding)
        ]
        self._columns = [(rows @ term_jacobian(here, here, terms, observations)).T for terms in self._terms]
        pairs = (columns.reshape(len(RIPPLES), 2, -1) for columns in self._columns)
        self._grams = [own @ own.swapaxes(1, 2) + DEPENDENT * (own**2).sum() / len(own) * np.eye(2) for own in pairs]

    def best(self, J: Reals, rest: Reals) -> list[JointTerm]:
        """The ripple of each turning joint that explains most of what is left.

        Parameters
        ----------
        J : (n, k), columns that are fitted with it
        rest : (n,), what is to be explained, in standard deviations

        Returns
        -------
        terms : one for each turning joint
        """
        span, found = np.linalg.qr(J)[0], []
        beside = np.column_stack([rest - span @ (span.T @ rest), span])
        for terms, columns, own in zip(self._terms, self._columns, self._grams):
            along = (columns @ beside).reshape(len(terms), 2, -1)
            aim, taken = along[..., 0], along[..., 1:]
            gram = own - taken @ taken.swapaxes(1, 2)
            explained = np.einsum("tk,tk->t", aim, np.linalg.solve(gram, aim[..., None])[..., 0])
            found.append(terms[int(explained.argmax())])
        return found
