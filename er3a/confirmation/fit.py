"""The fit ``C = Y F(q) X`` of a controller's poses C by least squares.

F is the arm by its table, from its base to its flange; Y is where the controller's frame has the arm's base, X is where
the controller's tool is on the flange. What the digits of poses and joint values leave open is the covariance: joint
values count through the Jacobian. Gauss-Newton steps with halving [1]_.

References
----------
.. [1] G. A. F. Seber, C. J. Wild, *Nonlinear Regression*, 1989, chapter 14.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from er3a.calibration.parameters import parameters_of
from er3a.comparison.entries import Entry, shifted
from er3a.confirmation.pairs import ROUNDED, Pairs
from er3a.finding import Finding
from er3a.geometry.transforms import exp_rotation, log_rotation, posed, skew, transposed
from er3a.kinematics.chain import row_values
from er3a.kinematics.table_batch import frames_of, tables_of
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot

Place = Literal["base", "tool"]
STEP = 1e-5  # m or rad, of central differences
STEPS, HALVINGS = 16, 6
DONE = 1e-9  # m or rad
FLOOR = 5e-6
"""M and rad, standard deviation of what no digits explain: tables are printed to 0.01 mm."""
SMALL = 2e-3  # m and rad: standard deviation of what a factory's calibration corrects
BIG = 3.0  # of these, beyond which a correction is no small one
SINGULAR = 1e-9


@dataclass(frozen=True, eq=False)
class JointReading:
    """How the model's joints follow from the pendant's: ``q = factors @ p + shift``.

    Attributes
    ----------
    factors, shift : (n, n) and (n,), rad or m
    faults : what this says, none if the joints are taken as they are
    """

    factors: Reals
    shift: Reals
    faults: tuple[Finding, ...] = ()

    def of(self, q: Reals) -> Reals:
        """The model's joint values.

        Parameters
        ----------
        q : (N, n), rad or m, the pendant's
        """
        found: Reals = q @ self.factors.T + self.shift
        return found


@dataclass(frozen=True, eq=False)
class Explanation:
    """What could be between a model and its controller.

    Attributes
    ----------
    form : in which orientations are read; factor : of the written positions
    joints : how joint values are read
    free : whether base, tool or both are fitted
    entries : of the table that are wrong; small : whether all others are off by a little, too
    """

    joints: JointReading
    form: str = ""
    factor: float = 1.0
    free: tuple[Place, ...] = ()
    entries: tuple[Entry, ...] = ()
    small: bool = False


@dataclass(frozen=True, eq=False)
class Solution:
    """An explanation with the values that fit best.

    Attributes
    ----------
    Y, X : (4, 4), m, the controller's base and tool; amounts : (k,), m and rad, of ``entries``
    off : (N, 6), m and rad, model minus controller, position and rotation vector, 0 where no orientation is given
    by_row : (N,), squares of these in standard deviations
    prior : squares of small corrections in their standard deviations
    freedom : degrees of freedom; J : (r, p), derivatives of what is left by base, tool and entries, as far as free, in
        standard deviations
    rows : (N,) bool, those that were fitted
    """

    explanation: Explanation
    entries: tuple[Entry, ...]
    Y: Reals
    X: Reals
    amounts: Reals
    off: Reals
    by_row: Reals
    prior: float
    freedom: int
    J: Reals
    rows: Flags

    @property
    def chi2(self) -> float:
        """Of fitted rows and small corrections."""
        return float(self.by_row[self.rows].sum()) + self.prior

    @property
    def plausible(self) -> bool:
        """Whether small corrections are small."""
        small = self.amounts[len(self.explanation.entries) :]
        return float(np.abs(small).max(initial=0.0)) <= BIG * SMALL

    @property
    def rms(self) -> float:
        """Root mean square of the distances, m, of the rows that were fitted."""
        return float(np.sqrt((self.off[self.rows, :3] ** 2).sum(axis=1).mean()))

    @property
    def errors(self) -> Reals:
        """(p,), standard deviations of base, tool and entries, as far as free, m and rad."""
        found: Reals = np.sqrt(np.diag(np.linalg.pinv(self.J.T @ self.J, rcond=1e-14, hermitian=True)))
        return found

    @property
    def per_freedom(self) -> float:
        """Of what is left, in standard deviations squared, per degree of freedom: near 1 if only digits are left."""
        return self.chi2 / self.freedom


class Fitter:
    """Fits explanations to pairs; ``widen``: of all standard deviations, where more than digits is left."""

    def __init__(self, robot: Robot, pairs: Pairs):
        self.robot, self.pairs = robot, pairs
        self.bare = robot.replace(base=np.eye(4), tool=np.eye(4))
        self.table = tables_of(robot)
        self.every = parameters_of(robot, "all_entries")
        self.widen = 1.0

    def flanges(self, entries: Sequence[Entry], amounts: Reals, u: Reals) -> Reals:
        """Flanges of tables with amounts added.

        Parameters
        ----------
        amounts : (H, k), m and rad, of k entries
        u : (N, m), rad or m, row values

        Returns
        -------
        F : (H, N, 4, 4), m, from the arm's base
        """
        found: Reals = frames_of(shifted(self.table, entries, amounts), self.bare, u)[:, :, -1]
        return found

    def slopes(self, entries: Sequence[Entry], every: Sequence[Entry], amounts: Reals, u: Reals
               ) -> tuple[Reals, Reals]:  # fmt: skip
        """Twists of the flange by entries, at a table with amounts added to some.

        Parameters
        ----------
        entries : k, by which to derive
        every, amounts : what is added to the table

        Returns
        -------
        twists, F : (k, N, 6), of the flange's point (m) and rotation, base axes; and the flanges (N, 4, 4)
        """
        steps = STEP * np.eye(len(entries))
        both = np.concatenate([steps, -steps, np.zeros((1, len(entries)))])
        moved = np.concatenate([np.broadcast_to(amounts, (len(both), len(amounts))), both], axis=1)
        F = self.flanges((*every, *entries), moved, u)
        plus, minus = F[: len(entries)], F[len(entries) : -1]
        turn = (plus[..., :3, :3] @ transposed(minus[..., :3, :3]) - np.eye(3)) / (2 * STEP)
        turn = turn[..., [2, 0, 1], [1, 2, 0]] - turn[..., [1, 2, 0], [2, 0, 1]]
        turn = turn / 2
        return np.concatenate([(plus - minus)[..., :3, 3] / (2 * STEP), turn], axis=-1), F[-1]

    def fit(
        self, explanation: Explanation, start: tuple[Reals, Reals, Reals | None], weights: Reals | None = None
    ) -> Solution:
        """The values that fit best.

        Parameters
        ----------
        start : Y, X (4, 4), and amounts of the explanation's entries
        weights : (N,), of rows; 0 leaves one out

        Returns
        -------
        solution : the best near to the start
        """
        entries = explanation.entries
        if explanation.small:
            entries = (*entries, *(each for each in self.every if each not in entries))
        state = start[0], start[1], np.zeros(len(entries))
        if start[2] is not None:
            state[2][: len(start[2])] = start[2]
        u = self.rows_at(explanation)
        weights = np.ones(len(u)) if weights is None else weights
        prior = np.array([0.0 if each in explanation.entries else 1 / SMALL for each in entries])
        whiten = self._whitening(explanation, entries, state, u) * weights[:, None, None]
        left, off = self._left(explanation, entries, state, u, whiten, prior)
        for number in range(STEPS if explanation.free or entries else 0):
            J = self._jacobian(explanation, entries, state, u, whiten, prior)
            step = np.asarray(np.linalg.lstsq(J, -left, rcond=SINGULAR)[0], np.float64)
            for halving in range(HALVINGS):
                tried = self._stepped(explanation, state, step * 0.5**halving)
                now, now_off = self._left(explanation, entries, tried, u, whiten, prior)
                if now @ now < left @ left:
                    break
            else:
                break
            gain = 1 - (now @ now) / (left @ left)
            state, left, off = tried, now, now_off
            if number < 2:
                whiten = self._whitening(explanation, entries, state, u) * weights[:, None, None]
                left, off = self._left(explanation, entries, state, u, whiten, prior)
            elif gain < 1e-4 or np.abs(step).max() < DONE:
                break
        J = self._jacobian(explanation, entries, state, u, whiten, prior)
        plain = self._whitening(explanation, entries, state, u)
        by_row = (np.einsum("nij,nj->ni", plain, off) ** 2).sum(axis=1)
        rows = weights > 0
        own = J.shape[1] - int((prior > 0).sum())
        freedom = max(int(rows.sum()) * self.dimensions - own, 1)
        squares = float(((prior * state[2]) ** 2).sum())
        return Solution(explanation, entries, *state, off, by_row, squares, freedom, J, rows)

    def linear(self, explanation: Explanation, state: tuple[Reals, Reals, Reals]) -> tuple[Reals, Reals]:
        """Derivatives of the differences, and these, in standard deviations.

        Parameters
        ----------
        state : base, tool and amounts of all entries of the explanation

        Returns
        -------
        J, left : (r, p), and (r,)
        """
        entries, prior = explanation.entries, np.zeros(len(explanation.entries))
        u = self.rows_at(explanation)
        whiten = self._whitening(explanation, entries, state, u)
        J = self._jacobian(explanation, entries, state, u, whiten, prior)
        left = self._left(explanation, entries, state, u, whiten, prior)[0]
        return J[: len(J) - len(prior)], left[: len(left) - len(prior)]

    def at(self, solution: Solution) -> Solution:
        """A solution's differences at all of the pairs.

        Parameters
        ----------
        solution : of the same robot, fitted to any pairs
        """
        explanation, state, u = (
            solution.explanation,
            (solution.Y, solution.X, solution.amounts),
            self.rows_at(solution.explanation),
        )
        whiten = self._whitening(explanation, solution.entries, state, u)
        _, off = self._left(explanation, solution.entries, state, u, whiten, np.zeros(len(solution.entries)))
        by_row = (np.einsum("nij,nj->ni", whiten, off) ** 2).sum(axis=1)
        return replace(solution, off=off, by_row=by_row, rows=np.ones(len(u), dtype=bool))

    def expected(self, solution: Solution) -> tuple[float, float]:
        """What digits explain of a pose's distance (m) and turn (rad), root mean square.

        Parameters
        ----------
        solution : of the same robot
        """
        state = solution.Y, solution.X, solution.amounts
        whiten = self._whitening(solution.explanation, solution.entries, state, self.rows_at(solution.explanation))
        size = self.dimensions
        by_place = np.linalg.inv(whiten[:, :size, :size])
        squares = (by_place**2).sum(axis=2).mean(axis=0)
        return float(np.sqrt(squares[:3].sum())), float(np.sqrt(squares[3:].sum()))

    def rows_at(self, explanation: Explanation) -> Reals:
        """Row values (N, m), rad or m, of the model.

        Parameters
        ----------
        explanation : which says how the pendant's joints are read
        """
        return row_values(self.robot, explanation.joints.of(self.pairs.q))

    @property
    def dimensions(self) -> int:
        """Numbers of a pose: 6, or 3 without orientations."""
        return 6 if self.pairs.turns else 3

    def twists(self, explanation: Explanation, entries: Sequence[Entry], state: tuple[Reals, Reals, Reals], u: Reals,
               by: Sequence[Entry]) -> Reals:  # fmt: skip
        """Twists (k, N, 6) of the controller's tool point by entries, in the controller's axes."""
        Y, X, amounts = state
        moved, F = self.slopes(by, entries, amounts, u)
        arm = F[:, :3, :3] @ X[:3, 3]
        point = moved[..., :3] + np.cross(moved[..., 3:], arm)
        found: Reals = np.concatenate([point @ Y[:3, :3].T, moved[..., 3:] @ Y[:3, :3].T], axis=-1)
        return found

    def _whitening(self, explanation: Explanation, entries: Sequence[Entry], state: tuple[Reals, Reals, Reals],
                   u: Reals) -> Reals:  # fmt: skip
        """(N, 6, 6), which make standard deviations of differences; rows of 0 for orientations that are not given."""
        robot, pairs = self.robot, self.pairs
        moving = [Entry("d" if slides else "offset", k + 1) for k, slides in enumerate(robot.sliding)]
        coupling = np.eye(robot.rows) if robot.coupling is None else robot.coupling
        by_joint = (robot.direction[:, None] * coupling) @ explanation.joints.factors
        J = np.einsum("kni,kj->nij", self.twists(explanation, entries, state, u, moving), by_joint)
        J *= (pairs.q_digit * ROUNDED)[:, None]
        turned = np.repeat(pairs.turn_digit, 3, axis=1)
        own = np.concatenate([pairs.xyz_digit * abs(explanation.factor), turned], axis=1) * ROUNDED
        covariance = J @ transposed(J)
        covariance[:, range(6), range(6)] += own**2 + FLOOR**2
        size = self.dimensions
        found: Reals = np.zeros((len(u), 6, 6))
        found[:, :size, :size] = np.linalg.inv(np.linalg.cholesky(covariance[:, :size, :size])) / self.widen
        return found

    def _left(self, explanation: Explanation, entries: Sequence[Entry], state: tuple[Reals, Reals, Reals], u: Reals,
              whiten: Reals, prior: Reals) -> tuple[Reals, Reals]:  # fmt: skip
        """Differences in standard deviations, and in m and rad (N, 6)."""
        Y, X, amounts = state
        M = Y @ self.flanges(entries, amounts[None], u)[0] @ X
        off = np.zeros((len(M), 6))
        off[:, :3] = M[:, :3, 3] - explanation.factor * self.pairs.xyz
        if self.pairs.turns:
            off[:, 3:] = log_rotation(M[:, :3, :3] @ transposed(self.pairs.turns[explanation.form]))
        left = np.einsum("nij,nj->ni", whiten, off)[:, : self.dimensions].ravel()
        return np.concatenate([left, prior * amounts]), off

    def _jacobian(self, explanation: Explanation, entries: Sequence[Entry], state: tuple[Reals, Reals, Reals], u: Reals,
                  whiten: Reals, prior: Reals) -> Reals:  # fmt: skip
        """Derivatives of the differences in standard deviations by base, tool and entries."""
        columns = self.columns(explanation, entries, state, u, entries)
        count = len(columns) * self.dimensions
        J = np.einsum("nij,njk->nik", whiten, columns)[:, : self.dimensions].reshape(count, columns.shape[-1])
        rows = np.zeros((len(prior), J.shape[1]))
        rows[:, J.shape[1] - len(prior) :] = np.diag(prior)
        return np.concatenate([J, rows])

    def columns(self, explanation: Explanation, entries: Sequence[Entry], state: tuple[Reals, Reals, Reals], u: Reals,
                by: Sequence[Entry]) -> Reals:  # fmt: skip
        """Derivatives (N, 6, p) of the differences, m and rad, by base and tool, as far as free, and by entries."""
        Y, X, amounts = state
        F = self.flanges(entries, amounts[None], u)[0]
        R = Y[:3, :3] @ F[:, :3, :3]
        parts = []
        if "base" in explanation.free:
            base = np.zeros((len(F), 6, 6))
            base[:, :3, :3] = base[:, 3:, 3:] = np.eye(3)
            base[:, :3, 3:] = -skew(R @ X[:3, 3] + F[:, :3, 3] @ Y[:3, :3].T)
            parts.append(base)
        if "tool" in explanation.free:
            turned = self.dimensions == 6
            tool = np.zeros((len(F), 6, 6 if turned else 3))
            tool[:, :3, :3] = R
            if turned:
                tool[:, 3:, 3:] = R @ X[:3, :3]
            parts.append(tool)
        if by:
            parts.append(np.moveaxis(self.twists(explanation, entries, state, u, by), 0, -1))
        return np.concatenate(parts, axis=-1) if parts else np.zeros((len(F), 6, 0))

    def _stepped(self, explanation: Explanation, state: tuple[Reals, Reals, Reals], step: Reals
                 ) -> tuple[Reals, Reals, Reals]:  # fmt: skip
        """Base, tool and amounts after a step of all that is free."""
        Y, X, amounts = state
        if "base" in explanation.free:
            Y = posed(exp_rotation(step[3:6]) @ Y[:3, :3], Y[:3, 3] + step[:3])
            step = step[6:]
        if "tool" in explanation.free:
            size = self.dimensions
            turn = exp_rotation(step[3:6]) if size == 6 else np.eye(3)
            X = posed(X[:3, :3] @ turn, X[:3, 3] + step[:3])
            step = step[size:]
        return Y, X, amounts + step
