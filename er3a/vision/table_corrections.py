"""Corrections to an arm's table together with hand-eye and board pose, from the same samples.

To the twelve numbers of both poses come the table's entries. The samples can't tell all of them apart: the first
joint's d and offset move the arm as the base's frame does, in which a fixed camera or board stands; the last rows move
the flange, on which the other of the two is. So the twelve numbers come first, then the entries in the order of
preference of :mod:`er3a.calibration.parameters`; one whose effect lies in the span of those before it (to 0.1 % of its
size) keeps its value, and is named with those that act as it does. What is left is estimated by Gauss-Newton steps,
with the weights and intervals of :mod:`er3a.vision.likelihood`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy

from er3a.by_value import ByValue, Finding
from er3a.calibration.calibrate import CLOSE, Close, Estimate
from er3a.calibration.fit import NO_EFFECT, SCALE
from er3a.calibration.outcomes import Held, LevelName, MovesNothing, NotToldApart
from er3a.calibration.parameters import DEPENDENT, parallel_pairs, parameters_of
from er3a.comparison.entries import Entry
from er3a.comparison.entries import shifted as moved_tables
from er3a.geometry.transforms import inverse_right_jacobian, inverted, step_between
from er3a.kinematics.chain import row_values
from er3a.kinematics.forward import forward
from er3a.kinematics.table_batch import Tables, frames_of, join, robot_of, tables_of
from er3a.numerics.arrays import Reals
from er3a.robots.joint_limits import joint_names
from er3a.robots.robot import Robot
from er3a.vision import likelihood
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.hand_eye import HandEye, calibrate_hand_eye
from er3a.vision.vision_findings import (
    HandEyeError,
    JointZero,
    grave_warnings,
)

STEP = 1e-6  # m and rad
STEPS = 40
STEP_ENDS = 1e-10
HALVINGS = 10
TABLE_JOINTS = 6
MIN_FREEDOM = 6
TABLE_CONTRADICTED = 0.01  # probability of such samples by the table as it is, below which they contradict it


class NoCorrections(Finding):
    """Why no corrections come with a calibration.

    ``joints``: no joint angles were recorded, or the arm does not have six; ``few``: too few samples for so many
    numbers; ``steps``: the search does not end.
    """

    why: Literal["joints", "few", "steps"]


@dataclass(frozen=True, eq=False)
class TableCorrections(ByValue):
    """Hand-eye and board pose with the table's corrections.

    Attributes
    ----------
    robot : with the corrected table
    level : which entries were requested
    estimates : of those that can be determined, in mm and deg, with half-widths of their 95 % intervals (k,)
    held : why the others keep their values
    X, Y, half_width : as of :class:`er3a.vision.hand_eye.HandEye`, (12,)
    moved : (2,), m and rad: how far X is from the one without corrections
    scatter, scatter_before : root mean square of the residuals with and without corrections, in standard deviations
    probability : of residuals that fall as much by chance, if no entry were wrong
    """

    robot: Robot
    level: LevelName
    estimates: tuple[Estimate, ...]
    entry_half_width: Reals
    held: tuple[Held, ...]
    close: tuple[Close, ...]
    X: Reals
    Y: Reals
    half_width: Reals
    moved: Reals
    scatter: float
    scatter_before: float
    probability: float


@dataclass(frozen=True, eq=False)
class _Problem:
    """Samples that were used, and the table they are predicted by."""

    robot: Robot
    samples: CalibrationSet
    rows: Reals

    def flange(self, tables: Tables) -> Reals:
        """T_base_flange (H, N, 4, 4) by each table."""
        found: Reals = frames_of(tables, self.robot, self.rows)[:, :, -1]
        return found

    def hand(self, flange: Reals) -> Reals:
        return flange if self.samples.setup == "eye_in_hand" else inverted(flange)

    def linear(self, table: Tables, parameters: list[Entry], X: Reals, Y: Reals) -> tuple[Reals, Reals]:
        """Residuals (N, 6), and their derivatives by poses and entries (N, 6, 12 + p)."""
        F = self.hand(self.flange(table)[0])
        raw, J = likelihood.residuals(F, self.samples.target, X, Y)
        count = len(parameters)
        if not count:
            return raw, J
        both = STEP * np.concatenate([np.eye(count), -np.eye(count)])
        flange = self.flange(moved_tables(join([table] * (2 * count)), parameters, both))
        shift = step_between(flange[count:], flange[:count]) / (2 * STEP)
        by_entry = -np.einsum("nij,pnj->nip", likelihood.flange_to_camera(self.samples.setup, F, X, Y), shift)
        by_entry[:, 3:] = inverse_right_jacobian(raw[:, 3:]) @ by_entry[:, 3:]
        return raw, np.concatenate([J, by_entry], axis=2)


def correct_table(found: HandEye, robot: Robot, level: LevelName = "all_entries") -> TableCorrections | NoCorrections:
    """Estimate the entries of a table with the poses of a calibration, from the samples that it rests on.

    Parameters
    ----------
    found : a calibration of samples with joint angles
    robot : whose table turned the angles into poses
    """
    samples = found.samples.take(found.used)
    if samples.q is None or robot.joints != TABLE_JOINTS or robot.slides.any():
        return NoCorrections("joints")
    problem = _Problem(robot, samples, row_values(robot, samples.q))
    every = list(parameters_of(robot, level))
    seen = likelihood.PoseObservations.of(samples)
    before = likelihood.refine(seen, found.X, found.Y)
    J = problem.linear(tables_of(robot), every, before.X, before.Y)[1]
    kept, held = _identified(before.W @ J, every, samples.setup, robot)
    if 6 * len(samples) - likelihood.UNKNOWNS - len(kept) < MIN_FREEDOM:
        return NoCorrections("few")

    def model(X: Reals, Y: Reals, amounts: Reals) -> tuple[Reals, Reals]:
        return problem.linear(moved_tables(tables_of(robot), kept, amounts[None]), kept, X, Y)

    fit = likelihood.refine(seen, before.X, before.Y, model, len(kept), before.W)
    return _result(problem, (level, kept, held), before, fit) if fit.converged else NoCorrections("steps")


ZERO_CHANCE = 1e-4  # of sound sets in which a zero is called wrong
MIN_ZERO = np.radians(0.5)
ZERO_STEP = 1e-5


def zeros_tried(found: HandEye, robot: Robot) -> tuple[HandEye, tuple[str, ...], float]:
    """A calibration whose warnings name the joint with a wrong zero, if one explains all that contradicts it.

    A zero is named if its value is more than chance, and nothing serious contradicts the samples with it.

    Returns
    -------
    found, unseen : names of joints whose zero the samples don't tell from the two poses: all where no joint values are
        recorded, those that slide, and mostly the first and the last
    smallest : deg; a wrong zero of another joint is named if it is at least this large; 0 if there are no others
    """
    names, q = joint_names(robot), found.samples.q
    if q is None:
        return found, names, 0.0
    samples = found.samples.take(found.used)
    before = likelihood.refine(likelihood.PoseObservations.of(samples), found.X, found.Y)
    free = 6 * len(samples) - likelihood.UNKNOWNS - 1
    best, unseen = (1.0, 0, 0.0, 0.0, np.inf), []
    smallest, sure = 0.0, (1 + likelihood.CONFIDENCE) / 2
    widths = float(scipy.special.stdtrit(free, 1 - ZERO_CHANCE / len(names) / 2) / scipy.special.stdtrit(free, sure))
    for k, name in enumerate(names):
        turn = _Turned(robot, samples, k)
        if robot.slides[k] or not turn.seen(found.X, found.Y):
            unseen.append(name)
            continue
        seen = likelihood.PoseObservations.of(samples)
        fit = likelihood.refine(seen, before.X, before.Y, turn.at, 1, before.W)
        value, half_width = float(fit.values[0]), float(fit.half_width[likelihood.UNKNOWNS])
        smallest = max(smallest, round(float(np.degrees(max(MIN_ZERO, widths * half_width))), 2))
        gain = max(before.squares - fit.squares, 0.0) / (fit.squares / free)
        chance = float(scipy.special.fdtrc(1, free, gain)) * len(names)
        rms = float(1000 * np.sqrt((fit.residual[:, :3] ** 2).mean()))
        best = min(best, (chance, k, value, half_width, rms))
    chance, k, value, half_width, rms = best
    explained = {each.code for each in grave_warnings(found.warnings)} <= EXPLAINED_BY_A_ZERO
    if chance > ZERO_CHANCE or abs(value) < MIN_ZERO or not explained:
        return found, tuple(unseen), smallest
    mended = _Turned(robot, found.samples, k).flange(value)
    try:
        again = calibrate_hand_eye(replace(found.samples, flange=mended))
    except HandEyeError:
        return found, tuple(unseen), smallest
    if grave_warnings(again.warnings):
        return found, tuple(unseen), smallest
    given = float(1000 * np.sqrt((found.residual[found.used, :3] ** 2).mean()))
    zero = JointZero(k + 1, float(np.degrees(value)), float(np.degrees(half_width)), given, rms)
    others = tuple(each for each in found.warnings if each.code not in EXPLAINED_BY_A_ZERO)
    return replace(found, warnings=(zero, *others)), tuple(unseen), smallest


EXPLAINED_BY_A_ZERO = {
    *("board_scale", "focal_length", "principal_point", "unexplained_residuals", "moved_between", "more_scatter")
}


@dataclass(frozen=True, eq=False)
class _Turned:
    """Samples whose joint k, from 0, is off its recorded values."""

    robot: Robot
    samples: CalibrationSet
    k: int

    def flange(self, value: float) -> Reals:
        """T_base_flange (N, 4, 4) with this many rad more."""
        return forward(self.robot.without_tool(), self.samples.q + value * np.eye(self.robot.joints)[self.k])

    def at(self, X: Reals, Y: Reals, values: Reals) -> tuple[Reals, Reals]:
        """Residuals and their derivatives, as :data:`er3a.vision.likelihood.Model`."""
        value, setup = float(values[0]), self.samples.setup
        flange = self.flange(value)
        F = flange if setup == "eye_in_hand" else inverted(flange)
        raw, J = likelihood.residuals(F, self.samples.target, X, Y)
        shift = step_between(self.flange(value - ZERO_STEP), self.flange(value + ZERO_STEP)) / (2 * ZERO_STEP)
        own = -np.einsum("nij,nj->ni", likelihood.flange_to_camera(setup, F, X, Y), shift)
        own[:, 3:] = np.einsum("nij,nj->ni", inverse_right_jacobian(raw[:, 3:]), own[:, 3:])
        return raw, np.concatenate([J, own[..., None]], axis=2)

    def seen(self, X: Reals, Y: Reals) -> bool:
        """Whether the zero moves the samples otherwise than the two poses do."""
        J = self.at(X, Y, np.zeros(1))[1].reshape(-1, likelihood.UNKNOWNS + 1)
        J, column = J[:, :-1], J[:, -1]
        left = column - J @ np.linalg.lstsq(J, column, rcond=None)[0]
        return bool(np.linalg.norm(left) > DEPENDENT * np.linalg.norm(column))


def _identified(J: Reals, every: list[Entry], setup: str, robot: Robot) -> tuple[list[Entry], tuple[Held, ...]]:
    """Which entries the samples distinguish, and why the others keep their values; J is whitened, (N, 6, 12 + p)."""
    J = SCALE * J.reshape(-1, J.shape[-1])
    poses = ("T_flange_camera", "T_base_board") if setup == "eye_in_hand" else ("T_base_camera", "T_flange_board")
    names = [*(poses[0],) * 6, *(poses[1],) * 6, *(each.name for each in every)]
    norms = np.linalg.norm(J, axis=0)
    columns = list(range(likelihood.UNKNOWNS))
    held: list[Held] = []
    for k in range(likelihood.UNKNOWNS, J.shape[1]):
        if norms[k] <= NO_EFFECT * norms.max():
            held.append(MovesNothing(names[k]))
            continue
        scaled = J[:, columns] / norms[columns]
        share, *_ = np.linalg.lstsq(scaled, J[:, k], rcond=None)
        if np.linalg.norm(J[:, k] - scaled @ share) > DEPENDENT * norms[k]:
            columns.append(k)
            continue
        partners = [names[i] for i, part in zip(columns, share) if abs(part) > DEPENDENT * norms[k]]
        entries = (names[k], *dict.fromkeys(partners))
        between = [pair for _, pair in parallel_pairs(robot) if set(entries) == {f"d{joint}" for joint in pair}]
        held.append(NotToldApart(entries, between[0] if between else None))
    return [every[k - likelihood.UNKNOWNS] for k in columns[likelihood.UNKNOWNS :]], tuple(held)


def _result(
    problem: _Problem,
    asked: tuple[LevelName, list[Entry], tuple[Held, ...]],
    before: likelihood.Refined,
    fit: likelihood.Refined,
) -> TableCorrections:
    (level, kept, held), robot = asked, problem.robot
    error, half = np.sqrt(np.diag(fit.covariance)), fit.half_width
    correlation = (fit.covariance / np.outer(error, error))[likelihood.UNKNOWNS :, likelihood.UNKNOWNS :]
    rows, columns = np.nonzero(np.triu(np.abs(correlation) > CLOSE, 1))
    free = fit.whitened.size - likelihood.UNKNOWNS - len(kept)
    ratio = (before.squares - fit.squares) / max(len(kept), 1) / (fit.squares / free)
    step = step_between(before.X, fit.X)
    units = np.array([each.in_unit for each in kept])
    return TableCorrections(
        robot=robot_of(moved_tables(tables_of(robot), kept, fit.values[None]), 0, robot),
        level=level,
        estimates=tuple(
            Estimate(
                each,
                float(getattr(robot, each.column)[each.joint - 1] * each.in_unit),
                float(amount * each.in_unit),
                float(own * each.in_unit),
            )
            for each, amount, own in zip(kept, fit.values, error[likelihood.UNKNOWNS :])
        ),
        entry_half_width=half[likelihood.UNKNOWNS :] * units,
        held=held,
        close=tuple(Close(kept[i].name, kept[j].name, float(correlation[i, j])) for i, j in zip(rows, columns)),
        X=fit.X,
        Y=fit.Y,
        half_width=half[: likelihood.UNKNOWNS],
        moved=np.array([np.linalg.norm(step[:3]), np.linalg.norm(step[3:])]),
        scatter=fit.scatter,
        scatter_before=before.scatter,
        probability=float(scipy.special.fdtrc(len(kept), free, max(ratio, 0.0))) if kept else 1.0,
    )
