"""Corrections to a table from measured positions, by weighted least squares.

Only parameters that the measurements can tell apart are estimated; the others keep the table's values. Gauss-Newton
steps on the weighted differences, then the covariance ``inv(J^T W J)`` of the estimates [1]_.

References
----------
.. [1] J. M. Hollerbach, C. W. Wampler, "The calibration index and taxonomy for robot kinematic calibration methods",
   Int. J. of Robotics Research 15(6), 1996.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.by_value import ByValue
from er3a.calibration import outcomes
from er3a.calibration.identifiable import Level, choose_level
from er3a.calibration.measured import Measurement, Observations, observed
from er3a.calibration.parameters import Parameter, jacobian, moved
from er3a.display import Displayed, Sheet, first_rows, shortly
from er3a.kinematics.table_batch import Tables, robot_of, tables_of
from er3a.numerics.arrays import Reals
from er3a.references.predict import predict_tables
from er3a.references.reference import ReferenceSet
from er3a.robots.robot import Robot

STEPS = 30
SMALL_STEP = 1e-12  # m and rad
HALVINGS = 12
INTERVAL_95 = 1.959963984540054
CLOSE = 0.9
MOST_SCATTER = 3.0


@dataclass(frozen=True)
class Estimate:
    """One estimated entry, in mm or deg.

    Attributes
    ----------
    nominal : the table's value; correction : to be added to it; standard_error : of the correction
    """

    parameter: Parameter
    nominal: float
    correction: float
    standard_error: float

    @property
    def name(self) -> str:
        """Such as d4."""
        return self.parameter.name

    @property
    def unit(self) -> Literal["mm", "deg"]:
        """Of the numbers."""
        return self.parameter.unit

    @property
    def half_width(self) -> float:
        """Half-width of the 95 % interval."""
        return INTERVAL_95 * self.standard_error


@dataclass(frozen=True)
class Close:
    """Two estimates whose errors are correlated by more than 0.9."""

    first: str
    second: str
    correlation: float


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(ByValue, Displayed):
    """A table's corrections.

    Attributes
    ----------
    robot : with the corrected table
    level : which entries were estimated
    estimates : one per identifiable entry; correlation : (k, k), of their errors
    held : why the other entries of the level keep their values
    singular_values : of the scaled Jacobian (standard deviations per mm or mrad), descending
    coordinates, poses : how many measured coordinates at how many poses
    rms_before_mm, rms_after_mm : of the differences to the measurements
    scatter : root mean square of what remains, in standard deviations, per degree of freedom: near 1 if table and
        stated deviations are right
    more : what it takes to estimate more entries; None if all are estimated
    """

    robot: Robot
    level: outcomes.LevelName
    estimates: tuple[Estimate, ...]
    correlation: Reals
    held: tuple[outcomes.Held, ...]
    close: tuple[Close, ...]
    singular_values: Reals
    coordinates: int
    poses: int
    rms_before_mm: float
    rms_after_mm: float
    scatter: float
    more: outcomes.MorePositions | None

    @property
    def fits(self) -> bool:
        """Whether the corrected table meets the measurements to three times their uncertainty."""
        return self.scatter <= MOST_SCATTER

    @property
    def conclusion(self) -> outcomes.CalibrationConclusion:
        """What the measurements say about the table."""
        if not self.fits:
            return outcomes.Misfit(self.level, self.rms_before_mm, self.rms_after_mm)
        beyond = tuple(each.name for each in self.estimates if abs(each.correction) > each.half_width)
        return outcomes.CorrectionsFound(beyond) if beyond else outcomes.NoCorrectionFound(len(self.estimates))

    def sheet(self) -> Sheet:
        """A row for each estimated entry."""
        rows = ((each.name, each.nominal, each.correction, each.half_width, each.unit) for each in self.estimates)
        shown, left_out = first_rows(rows, len(self.estimates))
        rms = f"rms {shortly(self.rms_before_mm)} -> {shortly(self.rms_after_mm)} mm"
        return Sheet(
            f"Calibration of {self.robot.name} with {self.coordinates} coordinates at {self.poses} poses: {rms}",
            ("entry", "nominal", "correction", "+-95 %", "unit"),
            shown,
            left_out,
            (shortly(self.conclusion), *(f"held: {shortly(why)}" for why in self.held)),
        )


def calibrate(robot: Robot, measurements: Sequence[Measurement] | ReferenceSet) -> Calibration:
    """Estimate corrections to a robot's table from positions of its flange or tool.

    Of lengths, lengths and joint offsets, or all entries, the fullest set is estimated that the positions determine.

    Parameters
    ----------
    robot : the table to start from
    measurements : measured positions, or a reference set, whose key poses are used then

    Raises
    ------
    InputError
        for positions measured outside the joint limits
    CalibrationError
        if the positions determine too little, or no corrections make the table fit
    """
    observations = observed(measurements, robot)
    level = choose_level(robot, observations)
    kept = [level.parameters[i] for i in level.subspace.kept]
    return _result(robot, level, kept, observations, _fit(robot, kept, observations))


@dataclass(frozen=True, eq=False)
class _Fit:
    """Amounts (k,) in m and rad, weighted differences (n,) before and after, and the weighted Jacobian (n, k)."""

    amounts: Reals
    before: Reals
    after: Reals
    J: Reals


def _fit(robot: Robot, kept: list[Parameter], observations: Observations) -> _Fit:
    given, quantities, deviation = tables_of(robot), observations.quantities, observations.deviation_mm

    def weighted(table: Tables) -> Reals:
        difference: Reals = (predict_tables(table, robot, quantities)[0] - observations.values_mm) / deviation
        return difference

    amounts = np.zeros(len(kept))
    table, rest = given, weighted(given)
    before = rest
    for _ in range(STEPS):
        J = jacobian(table, robot, kept, quantities)
        step = np.linalg.lstsq(J / deviation[:, None], -rest, rcond=None)[0]
        for _ in range(HALVINGS):
            table = moved(given, kept, (amounts + step)[None])
            new = weighted(table)
            if new @ new <= rest @ rest * (1 + 1e-9):
                break
            step = step / 2
        amounts, rest = amounts + step, new
        if np.abs(step).max() < SMALL_STEP + 1e-9 * np.abs(amounts).max():
            return _Fit(amounts, before, rest, J / deviation[:, None])
    rest_mm = float(np.sqrt(np.mean((rest * deviation) ** 2)))
    raise outcomes.CalibrationError(
        outcomes.NoCorrectionFits(STEPS, rest_mm),
        f"no corrections make the table fit: after {STEPS} steps the positions are still {rest_mm:.3g} mm off. The "
        "table has a gross fault or is another arm's; er3a.diagnose names single faults",
    )


def _result(robot: Robot, level: Level, kept: list[Parameter], observations: Observations, fit: _Fit) -> Calibration:
    J, deviation = fit.J, observations.deviation_mm
    scale = np.linalg.norm(J, axis=0)
    covariance = np.linalg.inv((J / scale).T @ (J / scale)) / np.outer(scale, scale)
    error = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(error, error)
    estimates = tuple(
        Estimate(
            parameter,
            float(getattr(robot, parameter.column)[parameter.joint - 1] * parameter.in_unit),
            float(amount * parameter.in_unit),
            float(own * parameter.in_unit),
        )
        for parameter, amount, own in zip(kept, fit.amounts, error)
    )
    rows, columns = np.nonzero(np.triu(np.abs(correlation) > CLOSE, 1))
    freedom = len(fit.after) - len(kept)
    return Calibration(
        robot=robot_of(moved(tables_of(robot), kept, fit.amounts[None]), 0, robot),
        level=level.name,
        estimates=estimates,
        correlation=correlation,
        held=level.subspace.held,
        close=tuple(Close(kept[i].name, kept[j].name, float(correlation[i, j])) for i, j in zip(rows, columns)),
        singular_values=level.subspace.singular_values,
        coordinates=len(observations),
        poses=observations.poses,
        rms_before_mm=float(np.sqrt(np.mean((fit.before * deviation) ** 2))),
        rms_after_mm=float(np.sqrt(np.mean((fit.after * deviation) ** 2))),
        scatter=float(np.sqrt((fit.after @ fit.after) / freedom)),
        more=level.more,
    )
