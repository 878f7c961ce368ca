"""The set of tables that meet the requirements: a point of it, and its extent along an entry.

Extents are found by sequential linear programming: each step maximises over the requirements linearised at the last
table, within a trust region that grows while steps succeed; a step that leaves the set is brought back by Gauss-Newton
steps on what it exceeds. Angles to a direction (cones) are bounded by eight tangents and one that follows the point.
Standard deviations bound the likelihood: chi squared may exceed its minimum by 3.84, the 95 % profile interval of one
number [1]_; that ball is bounded by tangents, one of them across the direction that is maximised, so that the extent is
exact if nothing else bounds it, and on the safe side otherwise. Combinations that do not move the tool are held. An
extreme over the joint limits that is attained in several places at once has kinks, at which such steps can end too
early; so each extent is computed a second time with the entries that cause them held. Tables attain the extent; nothing
beyond it was found.

References
----------
.. [1] A. C. Davison, *Statistical Models*, Cambridge University Press 2003, section 4.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from er3a.identifiability.entries import TableNumber, shifted
from er3a.identifiability.requirements import Asked
from er3a.kinematics.table_batch import Tables
from er3a.numerics.arrays import Flags, Reals

PROFILE = 1.959963984540054
TANGENTS = 8
MET = 1e-3  # of a half-width
MIN_MM, WIDEST_DEG = 1000.0, 180.0
FIRST_TRUST, MIN_TRUST, GROWTH, SHRINKING = 4.0, 1e-3, 3.0, 0.4
STEPS, RETURNS = 40, 8
FOLLOWED = 0.05  # of a half-width, by which an extreme that was followed may be missed
IDLE_COST, EXCESS_COST = 1e-4, 1e3
SETTLED_GAIN, IDLE_STEPS = 4e-3, 5
SEARCH_STEPS = 40
UNSEEN = 1e-6  # of the largest singular value, below which measurements see nothing
MAX_DAMPING, NOTHING_GAINED = 1e3, 1e-3
DAMPINGS = 1e-2, 1e-5
STAYING = 0.9  # of a half-width, up to which steps leave alone what is met
FEW = 3


@dataclass(frozen=True, eq=False)
class OpenTable:
    """A table that meets the requirements, or, if none was found, that exceeds them least.

    Attributes
    ----------
    amounts : (k,), added to the table's entries, in their scales; off, slope : (m,), (m, k) there
    excess : largest violation there, in half-widths
    chi2 : smallest sum of squares of what has a standard deviation
    places : where extremes are attained
    """

    amounts: Reals
    off: Reals
    slope: Reals
    excess: float
    chi2: float
    places: tuple[Reals, ...]

    @property
    def open(self) -> bool:
        """Whether all requirements with a half-width are met."""
        return self.excess <= MET


@dataclass(frozen=True, eq=False)
class Reached:
    """Result of a search: a value, whether the search ended, and the amounts (k,) of an open table there."""

    value: float
    finished: bool
    amounts: Reals


def largest_length(table: Tables) -> float:
    """Search range in mm around the table's length: all its lengths together, at least a metre."""
    return max(float(np.abs(table.a).sum() + np.abs(table.d).sum()) * 1000.0, MIN_MM)


class Region:
    """Tables near one table whose entries requirements bound.

    Parameters
    ----------
    entries : k that may change; gauge : (g, k), combinations that are held
    """

    def __init__(self, asked: Asked, table: Tables, entries: Sequence[TableNumber], gauge: Reals):
        self.asked, self.table, self.entries, self.gauge = asked, table, tuple(entries), gauge
        self.scale = np.array([entry.scale for entry in entries])
        widest = np.array([largest_length(table) if entry.unit == "mm" else WIDEST_DEG for entry in entries])
        self.widest = widest / np.array([entry.in_unit for entry in entries]) / self.scale
        self.basis = np.linalg.svd(gauge, full_matrices=True)[2][len(gauge) :].T if len(gauge) else np.eye(len(entries))
        self._kinked: Flags | None = None

    def at(self, amounts: Reals) -> Tables:
        """The table with amounts (k,) added."""
        return shifted(self.table, self.entries, (amounts * self.scale)[None])

    def off(self, amounts: Reals, afresh: bool = False) -> Reals:
        """How far it is off."""
        return self.asked.off(self.at(amounts), afresh)

    def slope(self, amounts: Reals, used: Sequence[int] | None = None) -> Reals:
        """Derivative (m, k) there, or with respect to those entries alone that are ``used``."""
        entries = self.entries if used is None else [self.entries[k] for k in used]
        return self.asked.slope(self.at(amounts), entries)

    def excess(self, off: Reals) -> float:
        """The largest violation, in half-widths."""
        return float(self.asked.excess(off))

    def start(self, amounts: Reals, few_first: bool = True) -> OpenTable:
        """A table that is left open near one. What meets everything stays as it is; else one that differs in one entry,
        or two or three, is searched for, then any, by damped Gauss-Newton steps."""
        off = self.off(amounts, afresh=True)
        if self.excess(off) > MET and few_first:
            amounts, off = self._few_changed(amounts, off)
        for damping in DAMPINGS:
            if self.excess(off) <= MET and not len(self.asked.likely):
                break
            trial, trial_off = self._nearer(amounts, off, self.basis, (0.0, damping))
            trial, trial_off = self._nearer(trial, trial_off, self.basis, (STAYING, damping))
            if self.excess(trial_off) < self.excess(off) or len(self.asked.likely):
                amounts, off = trial, trial_off
        off = self.off(amounts, afresh=True)
        chi2 = float((off[self.asked.likely] ** 2).sum())
        return OpenTable(amounts, off, self.slope(amounts), self.excess(off), chi2, self.asked.places)

    def restarted(self, amounts: Reals, chi2: float) -> OpenTable | None:
        """An open table near one, found by damped Gauss-Newton steps alone; None if they lead to none."""
        off = self.off(amounts, afresh=True)
        amounts, off = self._nearer(amounts, off, self.basis, (STAYING, DAMPINGS[0]))
        if not self.allowed(off, chi2):
            return None
        off = self.off(amounts, afresh=True)
        if not self.allowed(off, chi2):
            return None
        return OpenTable(amounts, off, self.slope(amounts), self.excess(off), chi2, self.asked.places)

    def _few_changed(self, amounts: Reals, off: Reals) -> tuple[Reals, Reals]:
        """The table that comes nearest by changes of up to three entries, found one after the other."""
        chosen: list[int] = []
        best = amounts, off
        for _ in range(FEW):
            tried = []
            for k in range(len(amounts)):
                if k not in chosen and not self.gauge[:, k].any():
                    basis = np.eye(len(amounts))[:, [*chosen, k]]
                    near = self._nearer(*best, basis, (0.0, DAMPINGS[-1]))
                    rest = self._exceeded(near[1], STAYING)
                    tried.append((float(rest @ rest), k, near))
            if not tried:
                break
            least = min(tried, key=lambda each: each[:2])
            if not least[0] < float(np.sum(self._exceeded(best[1], STAYING) ** 2)):
                break
            chosen.append(least[1])
            best = least[2]
            if self.excess(best[1]) <= MET:
                break
        return best if self.excess(best[1]) <= MET else (amounts, off)

    def _nearer(self, amounts: Reals, off: Reals, basis: Reals, how: tuple[float, float]) -> tuple[Reals, Reals]:
        """Steps within a basis (k, b) that bring components down: those of what is asked for, to its middle (``how`` 0)
        or to within a share of its half-widths; with the damping to begin with."""
        inner, damping = how
        rest = self._exceeded(off, inner)
        used = [k for k in range(len(amounts)) if basis[k].any()]
        self.off(amounts)
        for _ in range(SEARCH_STEPS):
            slope, places = self.slope(amounts, used), self.asked.places
            while damping < MAX_DAMPING:
                step = basis @ self._toward(rest, slope @ basis[used], damping)
                trial = np.clip(amounts + step, -self.widest, self.widest)
                new_off = self.off(trial)
                new = self._exceeded(new_off, inner)
                if new @ new < rest @ rest:
                    break
                damping *= 10
                self.asked.follow(places)
            else:
                break
            gained = 1 - (new @ new) / (rest @ rest)
            amounts, off, rest, damping = trial, new_off, new, max(damping / 30, 1e-9)
            if gained < NOTHING_GAINED or (self.excess(off) <= MET and not len(self.asked.likely)):
                break
        return amounts, off

    def extent(self, start: OpenTable, toward: Reals, quick: bool = False) -> Reached:
        """How far the set extends from a start along ``toward`` (k,); ``quick``: with what makes kinks held only."""
        kinks = self._kinks(start) & (toward == 0)
        ways = [self.gauge] + ([np.concatenate([self.gauge, np.eye(len(toward))[kinks]])] if kinks.any() else [])
        ways = ways[-1:] if quick else ways
        found = [Region(self.asked, self.table, self.entries, held).followed(start, toward) for held in ways]
        return max(found, key=lambda reached: (reached.value, reached.finished))

    def _kinks(self, start: OpenTable) -> Flags:
        if self._kinked is None:
            self._kinked = self.asked.kinked(self.at(start.amounts), self.entries)
        return self._kinked

    def followed(self, start: OpenTable, toward: Reals, steps: int = STEPS) -> Reached:
        """The extent in one direction, as far as some steps reach."""
        amounts, off, slope = start.amounts, start.off, start.slope
        places, trust, finished = start.places, FIRST_TRUST, False
        passed = [amounts]
        self.asked.follow(places)
        for _ in range(steps):
            step = self._step(amounts, off, slope, toward, start.chi2, trust)
            settled = SETTLED_GAIN * max(1.0, abs(float(toward @ (amounts - start.amounts))))
            idle = len(passed) > IDLE_STEPS and float(toward @ (amounts - passed[-1 - IDLE_STEPS])) < settled
            finished = idle or float(toward @ step) < settled * min(1.0, trust)
            if finished:
                break
            trial, trial_off = self._returned(amounts + step, slope)
            if self.allowed(trial_off, start.chi2) and toward @ trial > toward @ amounts:
                long = np.abs(step).max() > 0.9 * trust
                amounts, off = trial, trial_off
                passed.append(amounts)
                slope, places = self.slope(amounts), self.asked.places
                trust = trust * GROWTH if long else trust
            else:
                trust = min(trust, float(np.abs(step).max())) * SHRINKING
                finished = trust < MIN_TRUST
                if finished:
                    break
                self.asked.follow(places)
        while len(passed) > 1 and self.excess(self.off(passed[-1], afresh=True)) > FOLLOWED:
            passed.pop()
            finished = False
        return Reached(float(toward @ passed[-1]), finished, passed[-1])

    def allowed(self, off: Reals, chi2: float) -> bool:
        """Whether components (m,) are met, and as likely as the likeliest leave open."""
        likely = (off[self.asked.likely] ** 2).sum()
        return self.excess(off) <= MET and likely <= chi2 + PROFILE**2 * (1 + MET) + MET

    def _returned(self, amounts: Reals, slope: Reals) -> tuple[Reals, Reals]:
        """Amounts brought back to where what they exceed is met, with the slope at hand; and how far off they are."""
        off = self.off(amounts)
        last = np.inf
        for _ in range(RETURNS):
            rest = self._exceeded(off, inner=1.0 - MET / 2)
            size = float(np.abs(rest).max(initial=0.0))
            if size <= MET / 2 or size > 0.6 * last:
                break
            last = size
            rows = np.abs(rest) > 0
            amounts = amounts + self.basis @ np.linalg.lstsq(slope[rows] @ self.basis, -rest[rows], rcond=1e-6)[0]
            off = self.off(amounts)
        return amounts, off

    def _exceeded(self, off: Reals, inner: float) -> Reals:
        """Components (m,), each of what lies outside ``inner`` half-widths; of a likelihood all."""
        rest = self.asked.outside(off, inner)
        rest[self.asked.likely] = off[self.asked.likely] if inner < 1 - MET else 0.0
        return rest

    def _toward(self, rest: Reals, slope: Reals, damping: float) -> Reals:
        """The damped Gauss-Newton step (b,) against components (m,) of which those that are 0 don't count."""
        own, wanted = slope[np.abs(rest) > 0], -rest[np.abs(rest) > 0]
        size = float((own**2).sum(axis=0).max(initial=0.0)) or 1.0
        system = own.T @ own + damping * size * np.eye(own.shape[1])
        return np.asarray(np.linalg.solve(system, own.T @ wanted), np.float64)

    def _step(self, amounts: Reals, off: Reals, slope: Reals, toward: Reals, chi2: float, trust: float) -> Reals:
        """The step (k,) that gains most within the linearised requirements and the trust region."""
        k = len(toward)
        rows, most = self._rows(off, slope)
        likely, to_least, radius = self._ball(off, slope, toward, chi2)
        if len(likely):
            exact = to_least + self._across_ball(likely, toward) * radius
            exact *= min(1.0, trust / float(np.abs(exact).max(initial=1e-12)))
            if (rows @ exact <= most).all() and (np.abs(amounts + exact) <= self.widest).all():
                return exact
        centre = likely @ to_least
        count = len(rows) + len(likely)
        A = np.zeros((count + len(self.gauge), 2 * k + 1))
        A[: len(rows), :k], A[: len(rows), -1] = rows, -1.0
        A[len(rows) : count, :k] = likely
        A[count:, :k] = self.gauge
        A[:, k : 2 * k] = -A[:, :k]
        low = np.concatenate([np.full(len(rows), -np.inf), centre - radius, np.zeros(len(self.gauge))])
        high = np.concatenate([most, centre + radius, np.zeros(len(self.gauge))])
        up = np.minimum(trust, np.maximum(self.widest - amounts, 0.0))
        down = np.minimum(trust, np.maximum(self.widest + amounts, 0.0))
        cost = np.concatenate([-toward + IDLE_COST, toward + IDLE_COST, [EXCESS_COST]])
        bounds = scipy.optimize.Bounds(np.zeros(2 * k + 1), np.concatenate([up, down, [np.inf]]))
        solved = scipy.optimize.milp(cost, constraints=scipy.optimize.LinearConstraint(A, low, high), bounds=bounds)
        if solved.x is None:
            return np.zeros(k)
        step: Reals = solved.x[:k] - solved.x[k : 2 * k]
        length = float(np.linalg.norm(likely @ (step - to_least))) if len(likely) else 0.0
        return step if length <= radius else to_least + (step - to_least) * (radius / length)

    def _across_ball(self, H: Reals, toward: Reals) -> Reals:
        """The step (k,) that gains most along ``toward`` for |H step| = 1, what H does not see being left alone."""
        pull = np.linalg.lstsq((H @ self.basis).T, self.basis.T @ toward, rcond=UNSEEN)[0]
        length = float(np.linalg.norm(pull))
        if length < 1e-12:
            return np.zeros(len(toward))
        step: Reals = self.basis @ np.linalg.lstsq(H @ self.basis, pull / length, rcond=UNSEEN)[0]
        return step

    def _rows(self, off: Reals, slope: Reals) -> tuple[Reals, Reals]:
        """Rows (r, k) and bounds (r,) of the linearised requirements with a half-width: rows @ step <= bounds."""
        rows: list[Reals] = []
        most: list[Reals] = []
        turns = 2 * np.pi * np.arange(TANGENTS) / TANGENTS
        for part, gaussian in zip(self.asked.slices, self.asked.gaussian):
            if gaussian:
                continue
            own, J = off[part], slope[part]
            if len(own) == 1:
                tangents = np.array([[1.0], [-1.0]])
            else:
                tangents = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
                length = float(np.linalg.norm(own))
                if length > 1e-6:
                    tangents = np.concatenate([tangents, own[None] / length])
            rows.append(tangents @ J)
            most.append(1.0 - tangents @ own)
        if not rows:
            return np.empty((0, len(self.entries))), np.empty(0)
        return np.concatenate(rows), np.concatenate(most)

    def _ball(self, off: Reals, slope: Reals, toward: Reals, chi2: float) -> tuple[Reals, Reals, float]:
        """Rows (r, k) of the likelihood's ball, the step (k,) to its middle, and its radius."""
        own = self.asked.likely
        if not len(own):
            return np.empty((0, len(toward))), np.zeros(len(toward)), 0.0
        J, rest = slope[own], off[own]
        _, values, basis = np.linalg.svd(J, full_matrices=False)
        seen = values > UNSEEN * values[0]
        H = values[seen, None] * basis[seen]  # |J step|^2 = |H step|^2
        to_least = self.basis @ np.linalg.lstsq(J @ self.basis, -rest, rcond=UNSEEN)[0]
        least = float(((rest + J @ to_least) ** 2).sum())
        radius = float(np.sqrt(max(chi2 + PROFILE**2 - least, 0.0)))
        across = np.linalg.lstsq(H.T, toward, rcond=None)[0]
        length = float(np.linalg.norm(across))
        if length > 1e-12:
            first = across / length
            turned = np.linalg.svd(first[None])[2]
            H = turned @ H
        return H, to_least, radius
