"""Errors of joints that no table holds: of a gear's ratio, once, twice and many times a turn, and sag under a load.

A row that is meant to move by x moves by ``x + sum_k c_k s_k``: ``s = x`` for its ratio, what another row is meant to
move by for a coupling to it, ``(sin kx, cos kx)`` for what returns k times a turn (eccentric gears and encoders once
and twice, teeth many times), and ``-dh/dx`` for sag: the torque of a unit weight at the measured point, of height h
(m), by its Jacobian [1]_. A weight that sinks lowers the arm, so the compliance c can't be negative.

References
----------
.. [1] B. W. Mooring, Z. S. Roth, M. R. Driels, *Fundamentals of Manipulator Calibration*, 1991, chapter 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Literal, get_args

import numpy as np

from er3a.by_value import ByValue, frozen
from er3a.calibration.observations import Measurement, PointObservations, observed
from er3a.comparison.entries import row_twists
from er3a.kinematics.chain import row_values
from er3a.kinematics.forward import forward
from er3a.kinematics.table_batch import frames_of, tables_of
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot

TermKind = Literal["ratio", "once", "twice", "sag", "ripple", "coupling"]
KINDS: tuple[TermKind, ...] = get_args(TermKind)
WITHOUT_COUPLINGS = tuple(kind for kind in KINDS if kind != "coupling")
WITHOUT_RIPPLES = tuple(kind for kind in WITHOUT_COUPLINGS if kind != "ripple")
FOR_ALL_JOINTS = KINDS, WITHOUT_COUPLINGS, WITHOUT_RIPPLES
"""What is tried of as many measurements as it takes, or of fewer: couplings and ripples ask for most."""
RATIOS: tuple[TermKind, ...] = ("ratio",)
IN_ROBOT_FILE: tuple[TermKind, ...] = (*RATIOS, "coupling")
FOR_ROBOT_FILE = IN_ROBOT_FILE, RATIOS
RIPPLES = range(3, 257)
"""How many times a turn an error is looked for; strain wave gears have some 200 a turn."""
TYPICAL = 2e-3  # rad, m; each per rad, m of what it is multiplied by: how large coefficients are taken to be, one sigma
TAKEN = 0.1
"""The same of terms that were taken: it holds what measurements leave open, and doesn't pull at what they settle."""


@frozen
class JointTerm:
    """One kind of error of the joint of one row, from 1; ``turns``: how often a ripple returns in a turn; ``by``: the
    row that it is coupled to."""

    kind: TermKind
    joint: int
    turns: int = 0
    by: int = 0

    @property
    def count(self) -> int:
        """Number of coefficients."""
        return 2 if self.kind in ("once", "twice", "ripple") else 1

    def shapes(self, x: Reals, climb: Reals) -> Reals:
        """What the coefficients are multiplied by.

        Parameters
        ----------
        x : (P, m), rad or m, what the rows are meant to move by
        climb : (P, m), derivative of the measured point's height by it

        Returns
        -------
        shapes : (P, count)
        """
        own = x[:, (self.by or self.joint) - 1]
        if self.kind in IN_ROBOT_FILE:
            return own[:, None]
        if self.kind == "sag":
            return -climb[:, [self.joint - 1]]
        turns = {"once": 1, "twice": 2}.get(self.kind, self.turns)
        return np.column_stack([np.sin(turns * own), np.cos(turns * own)])


def candidates(robot: Robot, kinds: Sequence[TermKind] = KINDS) -> tuple[JointTerm, ...]:
    """The terms that are tried besides ripples; prismatic joints have no harmonics.

    Parameters
    ----------
    kinds : of terms; ripples among them are left out

    Returns
    -------
    terms : kind by kind, rows from 1
    """
    joints = range(1, robot.rows + 1)
    return tuple(
        JointTerm(kind, row, by=by)
        for kind in kinds
        for row in joints
        for by in (joints if kind == "coupling" else [0])
        if kind != "ripple" and row != by and (kind not in ("once", "twice") or not robot.sliding[row - 1])
    )


def terms_of(robot: Robot) -> tuple[JointTerm, ...]:
    """All terms that apply to the robot's joints.

    Parameters
    ----------
    robot : with m rows

    Returns
    -------
    terms : candidates of all kinds, then ripples of joints that turn
    """
    turning = np.flatnonzero(~robot.sliding) + 1
    return (*candidates(robot), *(JointTerm("ripple", int(row), turns) for row in turning for turns in RIPPLES))


def starting_table(robot: Robot) -> dict[str, Any]:
    """All that a model takes of the robot that it started from, as plain numbers for a file.

    Parameters
    ----------
    robot : uncorrected

    Returns
    -------
    table : columns in m and rad, transforms as lists
    """
    names = ("a", "alpha", "beta", "d", "direction", "offset", "sliding", "base", "flange", "tool")
    return {
        "convention": robot.convention,
        **{name: getattr(robot, name).tolist() for name in names},
        "coupling": robot.joint_to_row.tolist(),
    }


def effects(robot: Robot, row_values: Reals, points: Reals) -> Reals:
    """How points move with what the rows move by.

    Parameters
    ----------
    row_values : (P, m), rad or m
    points : (P, 3), m, in the flange's frame

    Returns
    -------
    effects : (P, 6, m), m and rad per rad or m, in the base frame
    """
    T = frames_of(tables_of(robot), robot, row_values)[0, :, -1]
    xyz = np.einsum("pij,pj->pi", T[:, :3, :3], points) + T[:, :3, 3]
    return row_twists(tables_of(robot), robot, row_values, xyz)


@frozen
class JointErrors(ByValue):
    """Terms with their coefficients.

    Attributes
    ----------
    robot : the uncorrected table, which heights are computed by
    terms : which; coefficients : (c,) of all, in order
    """

    robot: Robot
    terms: tuple[JointTerm, ...]
    coefficients: Reals

    def columns(self, x: Reals, points: Reals) -> list[tuple[int, Reals]]:
        """What each coefficient is multiplied by.

        Parameters
        ----------
        x : (P, m), rad or m, what rows are commanded to move by
        points : (P, 3), m, in the flange's frame

        Returns
        -------
        columns : for each coefficient the row (from 0) that it acts on, and its factors (P,)
        """
        climb = effects(self.robot, x, points)[:, 2]
        shapes = [(term, term.shapes(x, climb)) for term in self.terms]
        return [(term.joint - 1, values[:, k]) for term, values in shapes for k in range(term.count)]

    def amounts(self, x: Reals, points: Reals) -> Reals:
        """Errors of rows, by all terms.

        Parameters
        ----------
        x : (P, m), rad or m, what rows are commanded to move by
        points : (P, 3), m, in the flange's frame, where a load is

        Returns
        -------
        amounts : (P, m), rad or m, to be added to x
        """
        found = np.zeros_like(x)
        for coefficient, (row, values) in zip(self.coefficients, self.columns(x, points)):
            found[:, row] += coefficient * values
        return found


@frozen
class CorrectedModel(ByValue):
    """A corrected arm with errors of joints that no table holds.

    Attributes
    ----------
    robot : its table, base and tool; it is right with the errors alone
    errors : by how much joints miss what they are meant to do
    """

    robot: Robot
    errors: JointErrors

    def forward(self, q: Reals) -> Reals:
        """Pose of the tool by the corrected model.

        Parameters
        ----------
        q : (..., n), rad or m, commanded joint values

        Returns
        -------
        T : (..., 4, 4), T_base_tool, m
        """
        if not self.errors.terms:
            return forward(self.robot, q)
        q = np.asarray(q, float)
        x = row_values(self.robot, q.reshape(-1, q.shape[-1]))
        points = np.broadcast_to(self.errors.robot.tool[:3, 3], (len(x), 3))
        flange = frames_of(tables_of(self.robot), self.robot, x + self.errors.amounts(x, points))[0][:, -1]
        T: Reals = (flange @ self.robot.tool).reshape(*q.shape[:-1], 4, 4)
        return T

    def positions_mm(self, measurements: Sequence[Measurement]) -> Reals:
        """Where the measured points are by the model.

        Parameters
        ----------
        measurements : P of them

        Returns
        -------
        xyz : (P, 3), mm, base frame
        """
        return 1000 * self._seen(measurements).positions(self.robot)

    def differences_mm(self, measurements: Sequence[Measurement]) -> Reals:
        """What the model says minus what was observed.

        Parameters
        ----------
        measurements : P of them

        Returns
        -------
        differences : (P, 3), mm; NaN where nothing was observed. For places and planes see :class:`PointObservations`
        """
        seen = self._seen(measurements)
        found = np.full(seen.seen.shape, np.nan)
        found[seen.seen] = seen.predict(self.robot) - seen.values_mm
        return found[:, :3]

    def distances_mm(self, measurements: Sequence[Measurement]) -> Reals:
        """How far the model is from measurements, over what was observed of each.

        Parameters
        ----------
        measurements : P of them

        Returns
        -------
        distances : (P,), mm
        """
        found: Reals = np.sqrt(np.nansum(self.differences_mm(measurements) ** 2, axis=1))
        return found

    def _seen(self, measurements: Sequence[Measurement]) -> PointObservations:
        seen = observed(measurements, self.robot)
        return seen.shifted(self.errors.amounts(seen.row_values, seen.points(self.errors.robot)))


def term_jacobian(
    here: Robot,
    robot: Robot,
    terms: Sequence[JointTerm],
    observations: PointObservations,
    shifted: PointObservations | None = None,
) -> Reals:
    """Derivatives of observed values by the coefficients of terms.

    Parameters
    ----------
    here : the corrected robot at which they are taken
    robot : uncorrected, which heights are computed by, as of :class:`JointErrors`
    terms : with c coefficients in all
    shifted : the observations with the errors of joints; None for none

    Returns
    -------
    J : (n, c), mm per unit of each coefficient
    """
    x, shifted = observations.row_values, shifted or observations
    by_row = effects(here, shifted.row_values, observations.points(here)) * 1000
    columns = JointErrors(robot, tuple(terms), np.empty(0)).columns(x, observations.points(robot))
    shifts = np.zeros((*by_row.shape[:2], len(columns)))
    for k, (row, values) in enumerate(columns):
        shifts[..., k] = values[:, None] * by_row[..., row]
    return observations.relative_shift(shifts, shifted.positions(here))[observations.seen]


def places_of(terms: Sequence[JointTerm], first: int = 0) -> list[list[int]]:
    """Places of each term's coefficients among those of all.

    Parameters
    ----------
    first : place of the first coefficient

    Returns
    -------
    places : one list for each term
    """
    ends = first + np.cumsum([0, *(term.count for term in terms)])
    return [list(range(start, end)) for start, end in pairwise(ends)]


def wrong_way(term: JointTerm, coefficients: Reals) -> bool:
    """Whether an estimated sag has the wrong sign: a load would lift the arm.

    Parameters
    ----------
    term : of any kind
    coefficients : its own; of sag the compliance, rad per m of lever, or m for a row that slides

    Returns
    -------
    wrong : False for terms other than sag
    """
    return term.kind == "sag" and float(coefficients[0]) < 0
