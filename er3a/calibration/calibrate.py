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
from pathlib import Path

import numpy as np

from er3a.calibration.identifiable import Level, choose_level
from er3a.calibration.parameters import Parameter, jacobian, moved
from er3a.errors import IdentificationError
from er3a.files.measurements import (
    Measurement,
    check_poses,
    load_measurements,
    scalars_of_measurements,
    scalars_of_set,
)
from er3a.kinematics.table_batch import Tables, robot_of, tables_of
from er3a.pipeline.messages.language import said
from er3a.references.predict import predict_tables
from er3a.references.reference import Reference, ReferenceSet, expected_of
from er3a.robots.robot import Robot, Source

STEPS = 30
SMALL_STEP = 1e-12  # m and rad
HALVINGS = 12
INTERVAL_95 = 1.959963984540054
CLOSE = 0.9
MUCH_SCATTER = 2.0


@dataclass(frozen=True)
class Estimate:
    """One estimated entry, in mm or deg.

    Attributes
    ----------
    name : such as d4; nominal : the table's value; correction : to be added to it; standard_error : of the correction
    """

    name: str
    unit: str
    nominal: float
    correction: float
    standard_error: float

    @property
    def half_width(self) -> float:
        """Half-width of the 95 % interval."""
        return INTERVAL_95 * self.standard_error


@dataclass(frozen=True, eq=False)
class Identification:
    """A table's corrections.

    Attributes
    ----------
    robot : with the corrected table
    level : which entries were estimated
    estimates : one per identifiable entry; correlation : (k, k), of their errors
    held : why the other entries of the level keep their values, in words
    close : pairs of estimates correlated by more than 0.9: name, name, correlation
    singular_values : of the scaled Jacobian (standard deviations per mm or mrad), descending
    numbers, poses : how many measured coordinates at how many poses
    rms_before_mm, rms_after_mm : of the differences to the measurements
    scatter : root mean square of what remains, in standard deviations, per degree of freedom: near 1 if table and
        stated deviations are right
    more : what it takes to estimate more entries, in words; empty if all are estimated
    """

    robot: Robot
    level: str
    estimates: tuple[Estimate, ...]
    correlation: np.ndarray
    held: tuple[str, ...]
    close: tuple[tuple[str, str, float], ...]
    singular_values: np.ndarray
    numbers: int
    poses: int
    rms_before_mm: float
    rms_after_mm: float
    scatter: float
    more: str


def identify(robot: Robot, measurements: str | Path | Sequence[Measurement] | ReferenceSet) -> Identification:
    """Estimate corrections to a robot's table from positions of its flange or tool.

    Of lengths, lengths and joint offsets, or all entries, the fullest set is estimated that the positions determine.

    Parameters
    ----------
    robot : the table to start from
    measurements : a CSV file of measured positions (:mod:`er3a.files.measurements`), its rows, or a reference
        set, whose key poses are used then

    Raises
    ------
    InputError
        if the file can't be used, or holds poses outside the joint limits
    IdentificationError
        if the positions determine too little (the message says what is needed), or no corrections make the table fit
    """
    if isinstance(measurements, ReferenceSet):
        references, deviation = scalars_of_set(measurements)
    else:
        path = measurements if isinstance(measurements, str | Path) else None
        rows = load_measurements(path) if path else measurements
        check_poses(rows, robot, path)
        references, deviation = scalars_of_measurements(rows, robot)
    chosen = choose_level(robot, references, deviation)
    kept = [chosen.parameters[i] for i in chosen.subspace.kept]
    amounts, before, after, J = _fit(robot, kept, references, deviation)
    return _result(robot, chosen, kept, references, amounts, before, after, J / deviation[:, None])


def _fit(
    robot: Robot, kept: list[Parameter], references: tuple[Reference, ...], deviation: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Amounts (k,) in m and rad, weighted differences (n,) before and after, and the Jacobian (n, k) at the end."""
    given, expected = tables_of(robot), expected_of(references)[0]

    def weighted(table: Tables) -> np.ndarray:
        return (predict_tables(table, robot, references)[0] - expected) / deviation

    amounts = np.zeros(len(kept))
    table, rest = given, weighted(given)
    before = rest
    for _ in range(STEPS):
        J = jacobian(table, robot, kept, references)
        step = np.linalg.lstsq(J / deviation[:, None], -rest, rcond=None)[0]
        for _ in range(HALVINGS):
            table = moved(given, kept, (amounts + step)[None])
            new = weighted(table)
            if new @ new <= rest @ rest * (1 + 1e-9):
                break
            step = step / 2
        amounts, rest = amounts + step, new
        if np.abs(step).max() < SMALL_STEP + 1e-9 * np.abs(amounts).max():
            return amounts, before, rest, J
    raise IdentificationError(
        said(
            "no corrections make the table fit: after {steps} steps the positions are still {rest:.3g} mm off. The "
            "table has a gross fault or is another arm's; er3a.diagnose names single faults",
            steps=STEPS,
            rest=np.sqrt(np.mean((rest * deviation) ** 2)),
        )
    )


def _result(
    robot: Robot,
    chosen: Level,
    kept: list[Parameter],
    references: tuple[Reference, ...],
    amounts: np.ndarray,
    before: np.ndarray,
    after: np.ndarray,
    J: np.ndarray,
) -> Identification:
    scale = np.linalg.norm(J, axis=0)
    covariance = np.linalg.inv((J / scale).T @ (J / scale)) / np.outer(scale, scale)
    error = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(error, error)
    deviation = chosen.deviation
    estimates = tuple(
        Estimate(
            parameter.name,
            parameter.unit,
            float(getattr(robot, parameter.column)[parameter.joint - 1] * parameter.in_unit),
            float(amount * parameter.in_unit),
            float(own * parameter.in_unit),
        )
        for parameter, amount, own in zip(kept, amounts, error)
    )
    rows, columns = np.nonzero(np.triu(np.abs(correlation) > CLOSE, 1))
    freedom = len(after) - len(kept)
    corrected = robot_of(moved(tables_of(robot), kept, amounts[None]), 0, robot)
    words = f"Identified from {len(references)} measured coordinates, starting from the table of {robot.name}"
    source = Source(words, "inferred")
    return Identification(
        robot=corrected.replace(sources={**robot.sources, "dh": source, "zero": source}),
        level=chosen.name,
        estimates=estimates,
        correlation=correlation,
        held=chosen.subspace.words,
        close=tuple((kept[i].name, kept[j].name, float(correlation[i, j])) for i, j in zip(rows, columns)),
        singular_values=chosen.subspace.singular_values,
        numbers=len(references),
        poses=len({reference.quantity.seen_at for reference in references}),
        rms_before_mm=float(np.sqrt(np.mean((before * deviation) ** 2))),
        rms_after_mm=float(np.sqrt(np.mean((after * deviation) ** 2))),
        scatter=float(np.sqrt((after @ after) / freedom)),
        more=chosen.more,
    )


def in_words(found: Identification) -> str:
    """The result as lines of text for a terminal."""
    lines = [
        f"{found.numbers} coordinates at {found.poses} poses; estimated: {found.level}",
        f"root mean square difference {found.rms_before_mm:.4g} mm before, {found.rms_after_mm:.4g} mm after; "
        f"scatter {found.scatter:.2f} standard deviations",
        f"{'entry':<9}{'table':>12}{'correction':>14}{'95 % interval':>16}",
    ]
    for each in found.estimates:
        values = f"{each.nominal:>12.4f}{each.correction:>+14.4f}{each.half_width:>12.4f}"
        lines.append(f"{each.name:<9}{values} {each.unit}")
    lines += [f"held: {words}" for words in found.held]
    lines += [f"close: {first} and {second} are correlated by {value:.2f}" for first, second, value in found.close]
    if found.scatter > MUCH_SCATTER:
        lines.append("warning: what remains is larger than the stated deviations allow; so are the errors")
    if found.more:
        lines.append(f"for more: {found.more}")
    return "\n".join(lines)
