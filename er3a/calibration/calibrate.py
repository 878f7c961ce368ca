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
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, cast

import numpy as np

from er3a.by_value import ByValue, Displayed, Sheet, first_rows, shortly
from er3a.calibration import outcomes
from er3a.calibration.outcomes import (
    CalibrationError,
    Held,
    LevelName,
    MorePositions,
    MovesNothing,
    NoPositions,
    NotToldApart,
)
from er3a.errors import InputError
from er3a.kinematics.table_batch import Tables, join, robot_of, tables_of
from er3a.numerics.arrays import Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.references.predict import predict_tables
from er3a.references.quantities import (
    COORDINATES,
    MM,
    ZERO_POSE,
    CarriedCoordinate,
    PointCoordinate,
    Pose,
    Quantity,
    SectionCoordinate,
)
from er3a.references.reference import ReferenceSet, expected_of, quantities_of
from er3a.robots.robot import Robot

LEVELS: tuple[LevelName, ...] = ("lengths", "lengths_and_offsets", "all_entries")
PARALLEL_RAD = np.radians(1.0)
STEP = 1e-5
SCALE = 1e-3  # m and rad alike: 1 mm, and 1 mrad, which moves a flange about as far
NO_EFFECT = 1e-6
DEPENDENT = 1e-3


@dataclass(frozen=True)
class Parameter:
    """One entry of the table.

    Attributes
    ----------
    column : a, alpha, beta, d or offset; joint : 1 to 6
    """

    column: str
    joint: int

    @property
    def name(self) -> str:
        """Such as ``d4``."""
        return f"{self.column}{self.joint}"

    @property
    def unit(self) -> Literal["mm", "deg"]:
        """mm or deg."""
        return "mm" if self.column in ("a", "d") else "deg"

    @property
    def in_unit(self) -> float:
        """Factor from m or rad to the unit."""
        return MM if self.unit == "mm" else 180 / np.pi


@dataclass(frozen=True, eq=False)
class Subspace:
    """What references determine.

    Attributes
    ----------
    kept : places of the parameters that are estimated
    held : why the others keep their values
    singular_values : of the scaled Jacobian over all parameters (one standard deviation per mm or mrad), descending
    """

    kept: tuple[int, ...]
    held: tuple[Held, ...]
    singular_values: Reals


def parameters_of(robot: Robot, level: LevelName) -> tuple[Parameter, ...]:
    """The entries of a level, in the order in which they are preferred where some can't be told apart.

    ``lengths`` are those that are not 0. ``all_entries`` has Hayati's beta beside alpha wherever neighbouring axes are
    parallel: their common normal, on which the other four entries rest, is undefined there.
    """
    joints = range(1, 7)
    lengths = [Parameter(column, j) for column in "ad" for j in joints if getattr(robot, column)[j - 1]]
    offsets = [Parameter("offset", j) for j in joints]
    if level == LEVELS[0]:
        return tuple(lengths)
    if level == LEVELS[1]:
        return (*lengths, *offsets)
    turns = [Parameter("alpha", j) for j in joints]
    hayati = [Parameter("beta", row) for row, _ in parallel_pairs(robot)]
    others = [Parameter(column, j) for column in "ad" for j in reversed(joints) if not getattr(robot, column)[j - 1]]
    return (*lengths, *offsets, *turns, *hayati, *others)


def parallel_pairs(robot: Robot) -> list[tuple[int, tuple[int, int]]]:
    """Rows whose alpha stands between two parallel joint axes (within 1 deg), each with the two joints."""
    shift = 1 if robot.convention == "modified" else 0
    pairs = []
    for joint in range(1, 6):
        row = joint + shift
        if abs(np.sin(robot.alpha[row - 1])) < np.sin(PARALLEL_RAD):
            pairs.append((row, (joint, joint + 1)))
    return pairs


def moved(tables: Tables, parameters: Sequence[Parameter], amounts: Reals) -> Tables:
    """One table of the batch for each row of amounts (H, p), in m and rad, added to the entries."""
    for parameter, amount in zip(parameters, amounts.T):
        entry = getattr(tables, parameter.column)[:, [parameter.joint - 1]]
        tables = tables.with_column(parameter.column, [parameter.joint - 1], entry + amount[:, None])
    return tables


def jacobian(tables: Tables, robot: Robot, parameters: Sequence[Parameter], quantities: Sequence[Quantity]) -> Reals:
    """Derivative (n, p) of quantities with respect to entries, in the quantities' units per m or rad, by central
    differences at a table (a batch of one); exact to about 1e-8."""
    count = len(parameters)
    steps = STEP * np.concatenate([np.eye(count), -np.eye(count)])
    values = predict_tables(moved(join([tables] * (2 * count)), parameters, steps), robot, quantities)
    slopes: Reals = (values[:count] - values[count:]).T / (2 * STEP)
    return slopes


def subspace(
    robot: Robot, parameters: Sequence[Parameter], quantities: Sequence[Quantity], deviation: Reals
) -> Subspace:
    """The identifiable part of the parameters: columns of the weighted Jacobian are taken in order of preference, and
    one that lies in the span of those before it (to 0.1 % of its length) is held.

    Parameters
    ----------
    deviation : (n,), standard deviation of the measured quantities
    """
    J = SCALE * jacobian(tables_of(robot), robot, parameters, quantities) / deviation[:, None]
    norms = np.linalg.norm(J, axis=0)
    kept: list[int] = []
    held: list[Held] = []
    basis: Reals = np.empty((len(J), 0))
    for k, norm in enumerate(norms):
        rest = J[:, k] - basis @ (basis.T @ J[:, k])
        rest -= basis @ (basis.T @ rest)
        if norm > NO_EFFECT * norms.max() and np.linalg.norm(rest) > DEPENDENT * norm:
            kept.append(k)
            basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
            continue
        still = norm <= NO_EFFECT * norms.max()
        held.append(MovesNothing(parameters[k].name) if still else _told_apart_from(robot, parameters, k, kept, J))
    singular_values = np.asarray(np.linalg.svd(J, compute_uv=False), np.float64)
    return Subspace(tuple(kept), tuple(held), singular_values)


def _told_apart_from(robot: Robot, parameters: Sequence[Parameter], k: int, kept: list[int], J: Reals) -> NotToldApart:
    """Which entries act on the measured points as entry ``k`` does."""
    share = np.linalg.lstsq(J[:, kept], J[:, k], rcond=None)[0] * np.linalg.norm(J[:, kept], axis=0)
    partners = [parameters[i] for i, part in zip(kept, share) if abs(part) > DEPENDENT * np.linalg.norm(J[:, k])]
    between = [
        joints for row, joints in parallel_pairs(robot)
        if parameters[k].column == "d" and {parameters[k].joint, partners[-1].joint} == set(joints)
    ]  # fmt: skip
    entries = (parameters[k].name, *(partner.name for partner in partners))
    return NotToldApart(entries, between[0] if between and len(partners) == 1 else None)


LIMIT_SLACK_DEG = 0.01
HALF_WIDTH_TO_DEVIATION = 1 / np.sqrt(3)


@dataclass(frozen=True)
class Measurement:
    """Where a point was seen.

    Attributes
    ----------
    row : line of the file
    pose : joint angles, deg
    point : flange or tool (the origin of the robot's tool frame)
    xyz_mm : base frame; None for coordinates that weren't measured
    deviation_mm : standard deviation of each coordinate
    """

    row: int
    pose: Pose
    point: Literal["flange", "tool"]
    xyz_mm: tuple[float | None, float | None, float | None]
    deviation_mm: float


@dataclass(frozen=True, eq=False)
class Observations:
    """Measured coordinates of points.

    Attributes
    ----------
    quantities : n coordinates at poses
    values_mm, deviation_mm : (n,), what was measured, and its standard deviation
    """

    quantities: tuple[Quantity, ...]
    values_mm: Reals
    deviation_mm: Reals

    def __len__(self) -> int:
        return len(self.quantities)

    @property
    def poses(self) -> int:
        """Number of poses."""
        return len({quantity.seen_at for quantity in self.quantities})


def observed(measurements: Sequence[Measurement] | ReferenceSet, robot: Robot) -> Observations:
    """Measurements coordinate by coordinate, or a reference set's coordinates at single poses.

    Of a set, official, CAD and export data count, if there are any; a standard deviation is the half-width over root 3,
    as for a value that may lie anywhere within (GUM 4.3.7).

    Raises
    ------
    InputError
        for measurements outside the joint limits
    """
    if isinstance(measurements, ReferenceSet):
        stated = [r for r in measurements.checkable if isinstance(r.quantity, PointCoordinate | SectionCoordinate)]
        stated = [r for r in stated if r.authoritative] or stated
        expected, uncertainty = expected_of(stated)
        return Observations(quantities_of(stated), expected, HALF_WIDTH_TO_DEVIATION * uncertainty)
    check_poses(measurements, robot)
    x, y, z = robot.tool[:3, 3] * MM
    offsets = {"tool": (float(x), float(y), float(z)), "flange": (0.0, 0.0, 0.0)}
    rows = [
        (CarriedCoordinate(each.pose, offsets[each.point], coordinate), value, each.deviation_mm)
        for each in measurements
        for coordinate, value in zip(COORDINATES, each.xyz_mm)
        if value is not None
    ]
    quantities = tuple(quantity for quantity, _, _ in rows)
    return Observations(quantities, np.array([row[1] for row in rows]), np.array([row[2] for row in rows]))


def check_poses(measurements: Sequence[Measurement], robot: Robot, path: str | Path | None = None) -> None:
    """Refuse poses outside the joint limits: :class:`InputError` naming row and joint."""
    lower, upper = np.degrees(robot.lower), np.degrees(robot.upper)
    for measurement in measurements:
        for joint, angle in enumerate(measurement.pose):
            if not lower[joint] - LIMIT_SLACK_DEG <= angle <= upper[joint] + LIMIT_SLACK_DEG:
                limits = f"{lower[joint]:g} .. {upper[joint]:g}"
                problem = f"{angle:g} deg is outside the limits {limits} of joint {joint + 1}"
                remedy = "Check the angle, its sign and its unit, or the robot's limits"
                raise InputError(path, f"row {measurement.row}, column q{joint + 1}_deg", problem, remedy)


RICH_POSES = 64
SHOWN_POSES = 3


@dataclass(frozen=True, eq=False)
class Level:
    """The entries that are estimated.

    Attributes
    ----------
    name : one of ``LEVELS``
    parameters : its entries; subspace : which of them the observations determine
    more : what a fuller level would take; None if all entries are estimated
    """

    name: LevelName
    parameters: tuple[Parameter, ...]
    subspace: Subspace
    more: MorePositions | None


def choose_level(robot: Robot, observations: Observations) -> Level:
    """The fullest level that the observations determine as far as positions of these points ever can, with numbers to
    spare.

    Raises
    ------
    CalibrationError
        if even the lengths ask for more
    """
    if not len(observations):
        raise CalibrationError(NoPositions(), "there are no positions of single points to calibrate from")
    rich = _rich(robot, observations.quantities)
    deviation = np.full(len(rich), np.median(observations.deviation_mm))
    more: list[MorePositions] = []
    for name in LEVELS[::-1]:
        parameters = parameters_of(robot, name)
        here = subspace(robot, parameters, observations.quantities, observations.deviation_mm)
        best = subspace(robot, parameters, rich, deviation)
        if len(best.kept) == len(here.kept) and len(observations) > len(here.kept):
            return Level(name, parameters, here, more[-1] if more else None)
        more.append(_what_more(robot, name, parameters, here, best, observations))
    problem = f"{len(observations)} coordinates determine too little; positions to be added: {more[-1].least} at least"
    raise CalibrationError(more[-1], problem)


def _rich(robot: Robot, quantities: Sequence[Quantity]) -> tuple[Quantity, ...]:
    """The same points at poses all over the joint range."""
    points = dict.fromkeys(
        replace(quantity, coordinate=c, pose=ZERO_POSE)
        if isinstance(quantity, CarriedCoordinate | PointCoordinate)
        else PointCoordinate(ZERO_POSE, "wrist_centre", c)
        for quantity in quantities
        for c in COORDINATES
    )
    return tuple(replace(point, pose=pose) for pose in _spread(robot) for point in points)


def _spread(robot: Robot) -> list[Pose]:
    low, high = np.degrees(robot.lower), np.degrees(robot.upper)
    rows = np.round(quasi_random_points(low, high, RICH_POSES) / 5) * 5 + 0.0
    return [cast(Pose, tuple(row)) for row in rows.tolist()]


def _what_more(
    robot: Robot,
    level: LevelName,
    parameters: tuple[Parameter, ...],
    here: Subspace,
    best: Subspace,
    observations: Observations,
) -> MorePositions:
    lacking = len(best.kept) - len(here.kept)
    return MorePositions(
        coordinates=len(observations),
        poses=observations.poses,
        determined=len(here.kept),
        determinable=len(best.kept),
        level=level,
        least=-(-max(lacking, len(best.kept) + 1 - len(observations)) // 3),
        entries=tuple(parameters[k].name for k in best.kept if k not in here.kept),
        examples_deg=_examples(robot, [parameters[k] for k in best.kept], observations.quantities),
    )


def _examples(robot: Robot, kept: list[Parameter], quantities: Sequence[Quantity]) -> tuple[Pose, ...]:
    """Poses that add most to what is known: greedily the greatest gain in ln det of the information matrix."""
    poses = _spread(robot)
    candidates = [PointCoordinate(pose, "flange", c) for pose in poses for c in COORDINATES]
    table = tables_of(robot)
    blocks = SCALE * jacobian(table, robot, kept, candidates).reshape(len(poses), 3, len(kept))
    known = SCALE * jacobian(table, robot, kept, quantities)
    information = known.T @ known + 1e-9 * np.eye(len(kept))
    chosen = []
    for _ in range(SHOWN_POSES):
        gain = [np.linalg.slogdet(information + block.T @ block)[1] for block in blocks]
        at = int(np.argmax(gain))
        information += blocks[at].T @ blocks[at]
        chosen.append(poses[at])
    return tuple(chosen)


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
