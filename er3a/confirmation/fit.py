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
from dataclasses import replace
from typing import Literal

import numpy as np

from er3a.by_value import by_identity
from er3a.calibration.fit import jacobian
from er3a.calibration.observations import PointObservations
from er3a.calibration.parameters import corrected, parameters_of, placements_of
from er3a.calibration.terms import effects
from er3a.comparison.entries import Entry
from er3a.confirmation.pairs import ROUNDED, Pairs
from er3a.finding import Finding
from er3a.geometry.transforms import transposed
from er3a.kinematics.chain import row_values
from er3a.kinematics.table_batch import frames_of, tables_of
from er3a.numerics.arrays import Flags, Reals
from er3a.references.quantities import MM
from er3a.robots.robot import Robot

Place = Literal["base", "tool"]
STEPS, HALVINGS = 16, 6
DONE = 1e-9  # m or rad
FLOOR = 5e-6
"""M and rad, standard deviation of what no digits explain: tables are printed to 0.01 mm."""
SMALL = 2e-3  # m and rad: standard deviation of what a factory's calibration corrects
BIG = 3.0  # of these, beyond which a correction is no small one
SINGULAR = 1e-9


@by_identity
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
        return q @ self.factors.T + self.shift


@by_identity
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


@by_identity
class State:
    """An explanation with values.

    Attributes
    ----------
    seen : the poses, read as the explanation says
    arm : as the controller has it: its base and tool, and the table with ``amounts``
    amounts : (k,), m and rad, of ``entries``, those of the explanation first, then those that are off by a little
    """

    explanation: Explanation
    seen: PointObservations
    arm: Robot
    entries: tuple[Entry, ...]
    amounts: Reals

    @property
    def free(self) -> tuple[Entry, ...]:
        """All that is fitted: base, tool and entries."""
        return (*placements_of(self.explanation.free, self.seen.oriented), *self.entries)

    @property
    def prior(self) -> Reals:
        """(k,), by how much entries are held at 0, per m or rad: those that are off by a little."""
        own = len(self.explanation.entries)
        return np.concatenate([np.zeros(own), np.full(len(self.entries) - own, 1 / SMALL)])

    def stepped(self, step: Reals) -> State:
        """The state after a step.

        Parameters
        ----------
        step : (p,), m and rad, of all that is free
        """
        own = step[len(step) - len(self.entries) :]
        return replace(self, arm=corrected(self.arm, self.free, step), amounts=self.amounts + own)

    def off(self) -> Reals:
        """Differences (N, 6), m and rad, model minus controller; 0 where no orientation is given."""
        found = np.zeros(self.seen.seen.shape)
        found[self.seen.seen] = (self.seen.predict(self.arm) - self.seen.values_mm) / MM
        return found


@by_identity
class Solution(State):
    """An explanation with the values that fit best.

    Attributes
    ----------
    left : (N, 6), the differences at the pairs
    by_row : (N,), squares of these in standard deviations
    freedom : degrees of freedom; J : (r, p), derivatives of what is left by base, tool and entries, as far as free, in
        standard deviations
    rows : (N,) bool, those that were fitted
    """

    left: Reals
    by_row: Reals
    freedom: int
    J: Reals
    rows: Flags

    @property
    def chi2(self) -> float:
        """Of fitted rows and small corrections, in their standard deviations."""
        return float(self.by_row[self.rows].sum() + ((self.prior * self.amounts) ** 2).sum())

    @property
    def plausible(self) -> bool:
        """Whether small corrections are small."""
        small = self.amounts[len(self.explanation.entries) :]
        return float(np.abs(small).max(initial=0.0)) <= BIG * SMALL

    @property
    def rms(self) -> float:
        """Root mean square of the distances, m, of the rows that were fitted."""
        return float(np.sqrt((self.left[self.rows, :3] ** 2).sum(axis=1).mean()))

    @property
    def errors(self) -> Reals:
        """(p,), standard deviations of all that is free, m and rad; of the base by the axes of the controller."""
        J, turn = self.J.copy(), self.arm.base[:3, :3].T
        for part in (slice(3), slice(3, 6)) if "base" in self.explanation.free else ():
            J[:, part] = J[:, part] @ turn
        return np.sqrt(np.diag(np.linalg.pinv(J.T @ J, rcond=1e-14, hermitian=True)))

    @property
    def per_freedom(self) -> float:
        """Of what is left, in standard deviations squared, per degree of freedom: near 1 if only digits are left."""
        return self.chi2 / self.freedom


class Fitter:
    """Fits explanations to pairs; ``widen``: of all standard deviations, where more than digits is left."""

    def __init__(self, robot: Robot, pairs: Pairs):
        self.robot, self.pairs = robot, pairs
        self.every = parameters_of(robot, "all_entries")
        self.widen = 1.0

    @property
    def dimensions(self) -> int:
        """Numbers of a pose: 6, or 3 without orientations."""
        return 6 if self.pairs.turns else 3

    def flanges(self, joints: Sequence[JointReading]) -> Reals:
        """Flanges by the table at the pairs' joint values.

        Parameters
        ----------
        joints : M ways in which these are read

        Returns
        -------
        F : (M, N, 4, 4), m, from the arm's base
        """
        u = row_values(self.robot, np.concatenate([each.of(self.pairs.q) for each in joints]))
        F = frames_of(tables_of(self.robot), self.robot.replace(base=np.eye(4)), u)[0, :, -1]
        return F.reshape(len(joints), -1, 4, 4)

    def seen(self, explanation: Explanation) -> PointObservations:
        """The pairs as an explanation reads them, as observations of the tool."""
        count, pairs = len(self.pairs), self.pairs
        seen = np.tile(np.arange(6) < self.dimensions, (count, 1))
        xyz_mm = MM * explanation.factor * pairs.xyz
        return PointObservations(
            row_values=row_values(self.robot, explanation.joints.of(pairs.q)),
            on_tool=np.ones(count, dtype=bool),
            seen=seen,
            values_mm=np.hstack([xyz_mm, np.zeros((count, 3))])[seen],
            deviation_mm=np.ones(int(seen.sum())),
            deviation_known=True,
            lines=pairs.lines,
            free=(),
            touched=np.full(count, -1),
            orientations=pairs.turns.get(explanation.form, np.tile(np.eye(3), (count, 1, 1))),
        )

    def state(self, explanation: Explanation, near: State | Robot, entries: tuple[Entry, ...]) -> State:
        """An explanation with values to start from.

        Parameters
        ----------
        near : whose base and tool are taken where they are free, and whose amounts of entries, 0 of others
        """
        arm, known = (near, {}) if isinstance(near, Robot) else (near.arm, dict(zip(near.entries, near.amounts)))
        amounts = np.array([known.get(each, 0.0) for each in entries])
        placed = self.robot.replace(**{place: getattr(arm, place) for place in explanation.free})
        return State(explanation, self.seen(explanation), corrected(placed, entries, amounts), entries, amounts)

    def fit(self, explanation: Explanation, near: State | Robot, weights: Reals | None = None) -> Solution:
        """The values that fit best.

        Parameters
        ----------
        near : where to start, as of :meth:`state`
        weights : (N,), of rows; 0 leaves one out

        Returns
        -------
        solution : the best near to the start
        """
        entries = explanation.entries
        if explanation.small:
            entries = (*entries, *(each for each in self.every if each not in entries))
        state = self.state(explanation, near, entries)
        weights = np.ones(len(self.pairs)) if weights is None else weights
        by_row = weights[:, None, None]
        whiten = self._whitening(state) * by_row
        left = self._left(state, whiten)
        for number in range(STEPS if state.free else 0):
            step = np.asarray(np.linalg.lstsq(self._jacobian(state, whiten), -left, rcond=SINGULAR)[0], np.float64)
            for halving in range(HALVINGS):
                tried = state.stepped(step * 0.5**halving)
                now = self._left(tried, whiten)
                if now @ now < left @ left:
                    break
            else:
                break
            gain = 1 - (now @ now) / (left @ left)
            state, left = tried, now
            if number < 2:
                whiten = self._whitening(state) * by_row
                left = self._left(state, whiten)
            elif gain < 1e-4 or np.abs(step).max() < DONE:
                break
        J = self._jacobian(state, whiten)
        rows = weights > 0
        own = J.shape[1] - len(entries) + len(explanation.entries)
        freedom = max(int(rows.sum()) * self.dimensions - own, 1)
        none: Reals = np.zeros(0)
        return self.at(Solution(**vars(state), left=none, by_row=none, freedom=freedom, J=J, rows=rows), rows)

    def linear(self, state: State) -> tuple[Reals, Reals]:
        """Derivatives of the differences, and these, in standard deviations.

        Parameters
        ----------
        state : whose entries are all the explanation's

        Returns
        -------
        J, left : (r, p), and (r,)
        """
        whiten = self._whitening(state)
        count = len(self.pairs) * self.dimensions
        return self._jacobian(state, whiten)[:count], self._left(state, whiten)[:count]

    def effects(self, state: State, more: Sequence[Entry]) -> tuple[Reals, Reals, Reals]:
        """What k entries more do, to first order.

        Parameters
        ----------
        state : at which; none of its entries is among them

        Returns
        -------
        own, rest, left : (r, k), derivatives of the differences, (r, k), the part of these that nothing which is free
            takes up, and (r,), the differences, all in standard deviations
        """
        amounts = np.append(state.amounts, np.zeros(len(more)))
        J, left = self.linear(replace(state, entries=(*state.entries, *more), amounts=amounts))
        free, own = np.split(J, [J.shape[1] - len(more)], axis=1)
        Q = np.linalg.qr(free)[0]
        return own, own - Q @ (Q.T @ own), left

    def at(self, solution: Solution, rows: Flags | None = None) -> Solution:
        """A solution's differences at all of the pairs.

        Parameters
        ----------
        solution : of the same robot, fitted to any pairs
        rows : (N,) bool, those of the pairs that were fitted; default: all
        """
        here = replace(solution, seen=self.seen(solution.explanation))
        left = here.off()
        by_row = (np.einsum("nij,nj->ni", self._whitening(here), left) ** 2).sum(axis=1)
        return replace(here, left=left, by_row=by_row, rows=np.ones(len(left), dtype=bool) if rows is None else rows)

    def expected(self, solution: Solution) -> tuple[float, float]:
        """What digits explain of a pose's distance (m) and turn (rad), root mean square.

        Parameters
        ----------
        solution : of these pairs
        """
        size = self.dimensions
        by_place = np.linalg.inv(self._whitening(solution)[:, :size, :size])
        squares = (by_place**2).sum(axis=2).mean(axis=0)
        return float(np.sqrt(squares[:3].sum())), float(np.sqrt(squares[3:].sum()))

    def _whitening(self, state: State) -> Reals:
        """(N, 6, 6), which make standard deviations of differences; rows of 0 for orientations that are not given."""
        robot, pairs, seen = self.robot, self.pairs, state.seen
        by_joint = robot.joint_to_row @ state.explanation.joints.factors
        J = effects(state.arm, seen.row_values, seen.points(state.arm)) @ by_joint
        J *= (pairs.q_digit * ROUNDED)[:, None]
        turned = np.repeat(pairs.turn_digit, 3, axis=1)
        own = np.concatenate([pairs.xyz_digit * abs(state.explanation.factor), turned], axis=1) * ROUNDED
        covariance = J @ transposed(J)
        covariance[:, range(6), range(6)] += own**2 + FLOOR**2
        size = self.dimensions
        found: Reals = np.zeros((len(J), 6, 6))
        found[:, :size, :size] = np.linalg.inv(np.linalg.cholesky(covariance[:, :size, :size])) / self.widen
        return found

    def _left(self, state: State, whiten: Reals) -> Reals:
        """Differences, and small corrections, in standard deviations."""
        left = np.einsum("nij,nj->ni", whiten, state.off())[:, : self.dimensions].ravel()
        return np.concatenate([left, state.prior * state.amounts])

    def _jacobian(self, state: State, whiten: Reals) -> Reals:
        """Derivatives of what is left by all that is free."""
        size = self.dimensions
        shape = len(whiten), size, len(state.free)
        columns = jacobian(state.arm, state.free, state.seen).reshape(shape) / MM
        J = (whiten[:, :size, :size] @ columns).reshape(shape[0] * size, shape[2])
        prior = state.prior[:, None]
        return np.concatenate([J, prior * np.eye(len(prior), J.shape[1], J.shape[1] - len(prior))])
