"""Corrections to a table from measured positions, by weighted least squares.

Base and tool are estimated with the table's entries where points were measured, because a tracker's frame is no arm's
base and a reflector is not where the drawing has it. Only parameters that the measurements can tell apart are
estimated; the others keep the table's values. Errors of joints that no table holds are estimated beside it where they
lower the error at poses left out (:mod:`er3a.calibration.cross_validation`). Of these the robot's file can hold the
ratios of joints, and what couples them, as its coupling; the table that goes there is fitted with these alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy

from er3a.by_value import ByValue, Displayed, Sheet, by_identity, frozen, shortly
from er3a.calibration.clustered import clustered_covariance
from er3a.calibration.cross_validation import (
    ChosenTerms,
    HeldOutErrors,
    TriedTerm,
    can_leave_out,
    choose_terms,
    left_out,
)
from er3a.calibration.fit import (
    FAR_OUT,
    MEDIAN_TO_DEVIATION,
    OUTLIER_ROUNDS,
    PLAUSIBLE,
    ROUNDING,
    Fit,
    Subspace,
    fit,
    held_with,
    jacobian,
    places_at,
    rough_places,
    scale_of,
    subspace,
    without_scale,
)
from er3a.calibration.observations import Measurement, PointObservations, Touched, observed
from er3a.calibration.parameters import (
    DEPENDENT,
    LEVELS,
    CalibrationError,
    FixedName,
    LevelName,
    corrected,
    coupled,
    parameters_of,
    settles,
    whole_length_mm,
)
from er3a.calibration.terms import (
    FOR_ALL_JOINTS,
    FOR_ROBOT_FILE,
    TYPICAL,
    CorrectedModel,
    JointErrors,
    JointTerm,
    places_of,
)
from er3a.comparison.entries import Entry
from er3a.finding import Finding, fact, is_one
from er3a.numerics.arrays import Flags, Reals
from er3a.references.quantities import MM
from er3a.references.reference import INTERVAL_95
from er3a.robots.robot import Robot

MAX_SCATTER = 3.0  # standard deviations, beyond which the model does not fit
TOGETHER = 0.5
"""Ratio to the farthest point's distance: points at least this far out are set aside in one go."""
MAX_OUTLIER_SHARE = 0.1  # of the measurements, that is set aside at most
FAR_WIDEST = {"mm": 1.0, "deg": 2.0}
"""Times ``WIDEST``: a correction beyond is none of this arm. A joint may lose its zero; a length is wrong by less."""
ROUGHLY = 10.0
FAR_REST = 0.004
"""Of an arm's whole length: a root mean square that no tracker leaves of an arm whose table is right."""
FEW_SPARE = 10
"""Degrees of freedom below which what remains says how large noise is, but not where; at least as many as numbers."""


@by_identity
class Level:
    """The entries that are estimated.

    Attributes
    ----------
    name : one of ``LEVELS``
    kept : its entries that are estimated, with those of base and tool; held : why the others keep their values
    more : what a fuller level would take; None if all entries are estimated
    left : entries, base and tool that are not estimated although more observations could settle them
    """

    name: LevelName
    kept: tuple[Entry, ...]
    held: tuple[Finding, ...]
    more: Finding | None
    left: tuple[Entry, ...] = ()


def choose_level(robot: Robot, observations: PointObservations) -> Level:
    """The fullest level that the observations determine.

    They have to determine it as far as positions of these points ever can, with numbers to spare. At each level, base
    and tool are tried with the table first.

    Parameters
    ----------
    robot : the table to start from

    Returns
    -------
    level : with what more observations would settle

    Raises
    ------
    CalibrationError
        if even the lengths ask for more
    """
    if not len(observations):
        raise CalibrationError(fact("no_positions"), "there are no positions of single points to calibrate from")
    placed = observations.placements
    robot, dependent = _with_rough_tool(robot, observations)
    scale = scale_of(robot, observations)
    spare = len(observations) - observations.dropped
    rich = observations.rich(robot)
    more: list[Finding] = []
    every: tuple[Entry, ...] = ()
    for first in (placed, ()) if placed else ((),):
        for name in LEVELS[::-1]:
            parameters = (*first, *without_scale(parameters_of(robot, name), scale))
            here = subspace(robot, parameters, observations, dependent)
            best = subspace(robot, parameters, rich, dependent, imagined=True)
            every = every or best.kept
            settled = len(best.kept) <= len(here.kept)
            if not (settled and here.kept) or spare <= len(here.kept):
                more.append(_what_more(name, (here, best), observations))
            if (settled or is_one(more[-1], "more_touches")) and spare > len(here.kept) > 0:
                what = next((each for each in more if is_one(each, "more_touches")), more[-1] if more else None)
                left = tuple(each for each in every if each not in parameters)
                return Level(name, here.kept, (*here.held, *held_with(scale)), what, left)
    if not more[-1].determinable:
        raise CalibrationError(more[-1], "no entry of the table moves what was measured; touch or measure elsewhere")
    lack = "numbers" if is_one(more[-1], "more_touches") else "positions"
    problem = f"{len(observations)} coordinates determine too little; {lack} to be added: {more[-1].missing} at least"
    raise CalibrationError(more[-1], problem)


def _with_rough_tool(robot: Robot, observations: PointObservations) -> tuple[Robot, float]:
    """The robot with its tool where the measurements put it, if that is far from where its file does; and the share of
    its length that an entry's effect then has to have beside others: near an axis, what a rough place shows of the
    entries about it is no effect of theirs."""
    placed = observations.placements
    amounts = places_at(robot, placed, observations)
    shift = np.where([each.column.startswith("tool") for each in placed], amounts, 0.0)
    if np.linalg.norm(shift) <= PLAUSIBLE:
        return robot, DEPENDENT
    return corrected(robot, placed, shift), ROUGHLY * DEPENDENT


def _what_more(level: LevelName, subspaces: tuple[Subspace, Subspace], observations: PointObservations) -> Finding:
    here, best = subspaces
    lacking = len(best.kept) - len(here.kept)
    if observations.all_touched:
        return _what_touches(len(here.kept), max(len(best.kept), len(here.kept)), observations)
    return fact(
        "more_positions",
        coordinates=len(observations),
        poses=observations.poses,
        determined=len(here.kept),
        determinable=len(best.kept),
        fitted=level,
        missing=-(-max(lacking, len(best.kept) + 1 - len(observations)) // 3),
        entries=tuple(each.name for each in best.kept if each not in here.kept),
    )


def _what_touches(settled: int, best: int, observations: PointObservations) -> Finding:
    """Number of poses needed at each place to determine ``best`` numbers, with one to spare."""
    things = observations.things()
    numbers = sum(each.numbers for each in things)
    missing, each = max(best - settled, best + 1 - numbers), []
    for kind in dict.fromkeys(thing.kind for thing in things):
        own = [thing for thing in things if thing.kind == kind]
        whole = missing + sum(thing.numbers for thing in own)
        each.append((kind, len(own), max(thing.unknown for thing in own) - (-whole // (own[0].coordinates * len(own)))))
    return fact(
        "more_touches",
        poses=observations.poses,
        numbers=numbers,
        determined=settled,
        determinable=best,
        missing=missing,
        each=tuple(each),
    )


@frozen
class Estimate:
    """One estimated number, in mm or deg.

    Attributes
    ----------
    nominal : the table's value; correction : to be added to it; standard_error : of the correction
    quantile : half-width of its 95 % interval in standard errors
    settled : whether that is less than what the table could be wrong by, and no quite different arm fits better
    """

    parameter: Entry
    nominal: float
    correction: float
    standard_error: float
    quantile: float = INTERVAL_95
    settled: bool = True

    @property
    def name(self) -> str:
        """Name of the entry, such as ``d4``."""
        return self.parameter.name

    @property
    def unit(self) -> Literal["mm", "deg"]:
        """Unit of the numbers, mm or deg."""
        return "mm" if self.parameter.unit == "mm" else "deg"

    @property
    def half_width(self) -> float:
        """Half-width of the correction's 95 % interval, mm or deg."""
        return self.quantile * self.standard_error


@frozen
class Outlier:
    """A measurement that was set aside: its line in the file, and how far it is from the model that the others fit."""

    row: int
    distance_mm: float


@dataclass(frozen=True, kw_only=True)
class TermEstimate(JointTerm):
    """A term beyond the table, in units of 1/1000 (rad, m; each per rad, m of what it is multiplied by).

    Attributes
    ----------
    coefficients, standard_errors : one for a ratio and for sag; else of sine and cosine
    """

    coefficients: tuple[float, ...]
    standard_errors: tuple[float, ...]


@frozen
class Beyond(CorrectedModel):
    """A model with errors of joints that no table holds, fitted together with a table of its own.

    Attributes
    ----------
    terms : their coefficients
    estimates : the table's corrections
    rms_mm : of what remains
    deviation_mm : standard deviation of a coordinate, estimated from what this model leaves; None if it was stated
    left_out : at poses left out; None of too few poses
    """

    terms: tuple[TermEstimate, ...]
    estimates: tuple[Estimate, ...]
    rms_mm: float
    deviation_mm: float | None
    left_out: HeldOutErrors | None


@frozen
class Calibration(ByValue, Displayed):
    """A table's corrections.

    Attributes
    ----------
    robot : with the corrected table, base and tool, the best without terms but for those of its coupling
    level : which entries were estimated
    estimates : one per identifiable entry
    ratios : of joints, and couplings, where poses left out are met better with them
    held : why the other entries of the level keep their values
    coordinates, poses : how many measured coordinates at how many poses; of those that were read again the means
    wrong : why measurements and table can't belong together; None if they can
    freedom : how many more independent coordinates than numbers there are; of one nothing is settled, unless the
        deviation was stated
    repeated : how many lines read a point again at a pose of another line; their mean counts once
    rms_before_mm, rms_after_mm : of the differences to the measurements
    turned_before_deg, turned_after_deg : the same of orientations, of the turn; None where none were measured
    scatter : root mean square of what remains, in standard deviations, per degree of freedom: near 1 if table and
        stated deviations are right; 1 if the deviation was estimated
    more : what it takes to estimate more entries; None if all are estimated
    idle : what was touched at too few poses to say anything
    deviation_mm : standard deviation of a coordinate, estimated from what the robot file's model leaves; None if it
        was stated
    outliers : measurements that were set aside
    left_out : at poses left out, by what the robot's file holds; None of too few poses
    tried : terms beyond the table, in the order in which they were taken, then those that were not; of too few
        measurements for all kinds no couplings, or those that a robot file can hold
    tried_for_file : those that a robot file can hold, beside no others, where others were tried and taken, or
        couplings were not among them
    beyond : the model with those that were taken; None if there are none
    """

    robot: Robot
    level: LevelName
    estimates: tuple[Estimate, ...]
    held: tuple[Finding, ...]
    coordinates: int
    poses: int
    rms_before_mm: float
    rms_after_mm: float
    scatter: float
    more: Finding | None
    turned_before_deg: float | None = None
    turned_after_deg: float | None = None
    repeated: int = 0
    freedom: int = FEW_SPARE
    wrong: Finding | None = None
    deviation_mm: float | None = None
    outliers: tuple[Outlier, ...] = ()
    ratios: tuple[TermEstimate, ...] = ()
    idle: tuple[Touched, ...] = ()
    left_out: HeldOutErrors | None = None
    tried: tuple[TriedTerm, ...] = ()
    tried_for_file: tuple[TriedTerm, ...] = ()
    beyond: Beyond | None = None

    def sheet(self) -> Sheet:
        """What the notebook shows: a row for each estimated entry, in mm and deg, with its 95 % interval.

        Returns
        -------
        sheet : with the conclusion, and why other entries were held
        """
        rows = ((each.name, each.nominal, each.correction, each.half_width, each.unit) for each in self.estimates)
        rms = f"rms {shortly(self.rms_before_mm)} -> {shortly(self.rms_after_mm)} mm"
        return Sheet.of_table(
            f"Calibration of {self.robot.name} with {self.coordinates} coordinates at {self.poses} poses: {rms}",
            ("entry", "nominal", "correction", "+-95 %", "unit"),
            rows,
            (shortly(self.conclusion), *(f"held: {shortly(why)}" for why in self.held)),
        )

    @property
    def fits(self) -> bool:
        """Whether the corrected table meets the measurements to three times their uncertainty and is the same arm's."""
        return self.scatter <= MAX_SCATTER and self.wrong is None

    @property
    def open(self) -> tuple[str, ...]:
        """Estimates whose intervals are wider than what the table could be wrong by."""
        return tuple(each.name for each in self.estimates if not each.settled)

    @property
    def scale_is_assumed(self) -> bool:
        """Whether lengths were measured, whose scale counts as exact; else the longest of the table keeps its value."""
        return not any(is_one(why, "sets_scale") for why in self.held)

    @property
    def conclusion(self) -> Finding:
        """What the measurements say about the table."""
        if self.wrong:
            return self.wrong
        if not self.fits:
            return fact("misfit", fitted=self.level, rms_before_mm=self.rms_before_mm, rms_after_mm=self.rms_after_mm)
        beyond = tuple(each.name for each in self.estimates if abs(each.correction) > each.half_width)
        if beyond and len(self.open) < len(self.estimates):
            return fact("corrections_found", entries=beyond)
        return fact("no_correction_found", intervals=len(self.estimates), open=self.open)

    @property
    def model(self) -> CorrectedModel:
        """The corrected arm, with the terms beyond the table if there are any."""
        return self.beyond or CorrectedModel(self.robot, JointErrors(self.robot, (), np.empty(0)))

    def forward(self, q: Reals) -> Reals:
        """Pose of the tool by the model; without terms as ``er3a.forward(found.robot, q)``.

        Parameters
        ----------
        q : (..., n), rad or m, commanded joint values

        Returns
        -------
        T : (..., 4, 4), T_base_tool, m
        """
        return self.model.forward(q)

    def without_terms(self) -> Calibration:
        """The same calibration with what a robot file holds: the table, and ratios of joints.

        Returns
        -------
        calibration : whose :attr:`model` has no terms beyond the table
        """
        return replace(self, beyond=None)

    def distances_mm(self, measurements: Sequence[Measurement]) -> Reals:
        """How far the model is from other measurements, over their measured coordinates.

        Parameters
        ----------
        measurements : P of them

        Returns
        -------
        distances : (P,), mm

        Raises
        ------
        InputError
            for poses of another arm, or outside its limits
        """
        return self.model.distances_mm(measurements)


def calibrate(
    robot: Robot,
    measurements: Sequence[Measurement],
    fixed: Sequence[FixedName] = (),
) -> Calibration:
    """Estimate corrections to a robot's table, base and tool from positions and orientations of its flange or tool.

    Of lengths, lengths and joint offsets, or all entries, the fullest set is estimated that the positions determine.

    Parameters
    ----------
    robot : the table to start from
    measurements : in mm, and joint values in deg, or mm of joints that slide
    fixed : ``"base"``, ``"tool"``, ``"ratios"``: to be taken from the robot's file; the tool is fixed unless its point
        was measured

    Returns
    -------
    calibration : the corrected robot, with intervals in mm and deg

    Raises
    ------
    InputError
        for positions measured outside the joint limits
    CalibrationError
        if the positions determine too little, or no corrections make the table fit
    """
    return _from_points(robot, observed(measurements, robot, fixed), "ratios" not in fixed)


def _result(robot: Robot, level: Level, observations: PointObservations, found: Fit) -> Calibration:
    """What the table, with ratios, has of a calibration."""
    beside, deviation = _beside(robot, level, observations, found), observations.deviation_mm
    estimates, ratios = _estimated(robot, observations, found, beside)
    here = corrected(robot, found.kept, found.amounts)
    return Calibration(
        robot=coupled(here, {(t.joint, t.by or t.joint): float(c) for t, c in zip(found.terms, found.coefficients)}),
        level=level.name,
        estimates=estimates,
        ratios=ratios,
        held=level.held,
        coordinates=len(observations),
        poses=observations.poses,
        rms_before_mm=observations.rms_mm(found.before * deviation),
        rms_after_mm=observations.rms_mm(found.after * deviation),
        turned_before_deg=_turned(observations, found.before * deviation),
        turned_after_deg=_turned(observations, found.after * deviation),
        scatter=_scatter(found, beside),
        freedom=found.freedom,
        more=level.more,
        idle=tuple(each for each in observations.things() if not each.numbers),
    )


def _turned(observations: PointObservations, off: Reals) -> float | None:
    """Root mean square of turns, deg, among differences off (n,) in mm and mrad."""
    own = off[~observations.is_length].reshape(-1, 3) / MM
    return float(np.degrees(np.sqrt((own**2).sum(axis=1).mean()))) if len(own) else None


def _beside(robot: Robot, level: Level, observations: PointObservations, found: Fit) -> Reals:
    """(m, l), standard deviations: what entries that are left out do if they are off by ``TYPICAL``, a base or tool by
    ``PLAUSIBLE``."""
    if not level.left:
        return np.empty((len(found.rest), 0))
    here, off = corrected(robot, found.kept, found.amounts), [TYPICAL if p.joint else PLAUSIBLE for p in level.left]
    J = jacobian(here, level.left, observations) / observations.deviation_mm[:, None]
    rows: Reals = observations.independent(here)[0] @ (J * off)
    return rows


def _scatter(found: Fit, beside: Reals) -> float:
    """Of what remains, beside what entries that are left out may do."""
    if not beside.size:
        return found.scatter
    root = np.linalg.cholesky(np.eye(len(found.rest)) + beside @ beside.T)
    J, rest = np.linalg.solve(root, found.J), np.linalg.solve(root, found.rest)
    left = rest - J @ np.linalg.lstsq(J, rest, rcond=None)[0]
    return float(np.sqrt((left @ left) / found.freedom))


def _covariance(observations: PointObservations, found: Fit) -> tuple[Reals, Reals]:
    """By the stated deviations; where none was stated, by what remains at each pose, or of all poses alike if these are
    few; and half-widths (k + c,) of 95 % intervals in standard errors."""
    if observations.deviation_known:
        return found.covariance, np.full(found.J.shape[1], INTERVAL_95)
    if found.freedom < max(FEW_SPARE, found.J.shape[1]):
        quantile = float(scipy.special.stdtrit(found.freedom, 0.975))
        return found.scatter**2 * found.covariance, np.full(found.J.shape[1], quantile)
    pose_of = observations.same_pose[observations.pose_of[found.last]]
    covariance, freedom = clustered_covariance(found.J, found.rest, found.covariance, pose_of)
    return covariance, np.asarray(scipy.special.stdtrit(freedom, 0.975))


def _estimated(
    robot: Robot, observations: PointObservations, found: Fit, others: Reals | None = None
) -> tuple[tuple[Estimate, ...], tuple[TermEstimate, ...]]:
    """Entries and terms with their intervals; ``others``: what entries that are left out do."""
    covariance, quantiles = _covariance(observations, found)
    if others is not None:
        bias = found.covariance @ found.J.T @ others
        covariance = covariance + bias @ bias.T
    error, known = np.sqrt(np.diag(covariance)), observations.deviation_known or found.freedom > 1
    estimates = tuple(
        Estimate(
            parameter,
            parameter.value(robot),
            float(amount * parameter.in_unit),
            float(own * parameter.in_unit),
            float(quantile),
            not found.ran_off and known and settles(robot, parameter.unit, float(quantile * own * parameter.in_unit)),
        )
        for parameter, amount, own, quantile in zip(found.kept, found.amounts, error, quantiles)
    )
    of_terms = error[len(found.kept) :]
    terms = tuple(
        TermEstimate(
            **vars(term),
            coefficients=tuple((1000 * found.coefficients[own]).tolist()),
            standard_errors=tuple((1000 * of_terms[own]).tolist()),
        )
        for term, own in zip(found.terms, places_of(found.terms))
    )
    return estimates, terms


def _fitted(robot: Robot, level: Level, observations: PointObservations) -> Fit:
    """The table; if nothing fits while entries are left out, positions are too few to say that the table is wrong."""
    try:
        return fit(robot, level.kept, observations)
    except CalibrationError as error:
        if not (level.left and level.more and is_one(error.finding, "no_correction_fits")):
            raise
        problem = f"{observations.poses} poses settle too little of the table to fit it"
        raise CalibrationError(level.more, problem) from None


@by_identity
class _Model:
    """Points that are used, the table with what a robot file can hold, and with all terms that are chosen (the same if
    there are none), which has observations of its own deviation."""

    observations: PointObservations
    for_whole: PointObservations
    level: Level
    table: Fit
    choice: ChosenTerms
    for_file: ChosenTerms
    whole: Fit


def _model(robot: Robot, observations: PointObservations, free_ratios: bool) -> _Model:
    level = choose_level(robot, observations)
    observations, table = _refitted(robot, observations, _fitted(robot, level, observations))
    here = corrected(robot, table.kept, table.amounts)
    # A table is so far from straight in what touches leave open that terms would be taken for that.
    unclear = level.left or (
        observations.all_touched and not all(each.settled for each in _estimated(robot, observations, table)[0])
    )
    ways = () if unclear else FOR_ALL_JOINTS  # terms would stand for what entries that are left out do
    choice, for_file = choose_terms(robot, here, table.kept, observations, ways), ChosenTerms((), ())
    all_tried = any(each.kind == "coupling" for each in choice.tried)
    if free_ratios and ways and (choice.terms or not all_tried):  # else none helps
        for_file = choose_terms(robot, here, table.kept, observations, FOR_ROBOT_FILE)
        table = fit(robot, level.kept, observations, for_file.terms) if for_file.terms else table
    whole = fit(robot, level.kept, observations, choice.terms) if choice.terms else table
    if (
        for_file.terms
        and not all_tried
        and _error_left_out(observations, whole) >= _error_left_out(observations, table)
    ):
        choice, whole = ChosenTerms((), ()), table  # they stand for a coupling, which was not tried beside them
    # The deviation of the table alone would let the prior pull coefficients towards 0.
    seen, table = _refitted(robot, observations, table) if for_file.terms else (observations, table)
    finer, whole = _refitted(robot, observations, whole) if choice.terms else (seen, table)
    return _Model(seen, finer, level, table, choice, for_file, whole)


def _refitted(robot: Robot, observations: PointObservations, found: Fit) -> tuple[PointObservations, Fit]:
    """A fit by standard deviations that it leaves, of coordinates and of orientations, where none is stated."""
    if observations.deviation_known:
        return observations, found
    lengths, deviation = observations.is_length, observations.deviation_mm.copy()
    for own in (lengths, ~lengths):
        left = found.rest[own[found.last]]
        share = found.freedom * len(left) / len(found.rest)
        deviation[own] *= np.sqrt(left @ left / share) if len(left) else 1.0
    seen = observations.with_deviation(deviation)
    return seen, fit(robot, found.kept, seen, found.terms)


def _error_left_out(observations: PointObservations, found: Fit) -> float:
    errors = left_out(observations, found)
    return errors.mean_mm + errors.far_mean_mm


def _from_points(robot: Robot, every: PointObservations, free_ratios: bool) -> Calibration:
    used = rough_places(robot, every)[1]
    used |= (~used).mean() > MAX_OUTLIER_SHARE
    model = _model(robot, every.take(used).merged(), free_ratios)
    for _ in range(2 * OUTLIER_ROUNDS):
        out = _out_of(every, _off_mm(robot, every, model, used), used[every.pose_of])
        again = out <= max(1.0, TOGETHER * out[used].max())
        if (again == used).all() or (~again).mean() > MAX_OUTLIER_SHARE:
            break
        used, model = again, _model(robot, every.take(again).merged(), free_ratios)
    off = _off_mm(robot, every, model, used) * every.is_length
    distances = np.sqrt(np.bincount(every.pose_of, weights=off**2))
    observations, table = model.observations, _result(robot, model.level, model.observations, model.table)
    return replace(
        table,
        wrong=None if model.level.left else _wrong(robot, observations, table),
        repeated=int(used.sum()) - len(observations.row_values),
        deviation_mm=_deviation(observations, model.table),
        outliers=tuple(Outlier(int(every.lines[k]), float(distances[k])) for k in np.flatnonzero(~used)),
        left_out=_left_out(observations, model.table),
        tried=model.choice.tried or model.for_file.tried,
        tried_for_file=model.for_file.tried if model.choice.tried else (),
        beyond=_beyond(robot, model.for_whole, model.whole) if model.choice.terms else None,
    )


def _wrong(robot: Robot, observations: PointObservations, found: Calibration) -> Finding | None:
    """Why measurements and table can't belong together: corrections or residuals far beyond those of arms and
    trackers."""
    far = tuple(
        each.name
        for each in found.estimates
        if each.parameter.joint
        and each.settled
        and not settles(robot, each.unit, (abs(each.correction) - each.half_width) / FAR_WIDEST[each.unit])
    )
    too_much = not observations.deviation_known and found.rms_after_mm > FAR_REST * whole_length_mm(robot)
    return fact("far_from_table", entries=far, rest_mm=found.rms_after_mm) if far or too_much else None


def _out_of(observations: PointObservations, off_mm: Reals, usual: Flags) -> Reals:
    """By how many times (P,) points are farther off than noise goes; its deviation by the median of ``usual`` (n,)
    values, which knows of no outliers, of coordinates and of orientations, or as stated if that is more."""
    noise, lengths = np.full(len(off_mm), ROUNDING), observations.is_length
    for own in (lengths, ~lengths) if observations.oriented else (lengths,):
        noise[own] = max(MEDIAN_TO_DEVIATION * float(np.median(np.abs(off_mm[own & usual]))), ROUNDING)
    if observations.deviation_known:
        noise = np.maximum(noise, observations.deviation_mm)
    out = np.zeros(len(observations.row_values))
    np.maximum.at(out, observations.pose_of, np.abs(off_mm) / (FAR_OUT * noise))
    return out


def _off_mm(robot: Robot, every: PointObservations, model: _Model, used: Flags) -> Reals:
    """What the whole model leaves of all points, mm (n,); places and planes are where those that are used (P,)
    put them, and each of the others alone beside these."""
    here = corrected(robot, model.whole.kept, model.whole.amounts)
    errors = JointErrors(robot, model.whole.terms, model.whole.coefficients)
    shifted = every.shifted(errors.amounts(every.row_values, every.points(robot)))

    def off_of(part: PointObservations) -> Reals:
        return part.predict(here) - part.values_mm

    off = np.empty(len(every))
    off[used[every.pose_of]] = off_of(shifted.take(used))
    for k in np.flatnonzero(~used):
        part = shifted.take(used | (np.arange(len(used)) == k))
        off[every.pose_of == k] = off_of(part)[part.pose_of == np.count_nonzero(used[:k])]
    return off


def _deviation(observations: PointObservations, found: Fit) -> float | None:
    """Of a coordinate, mm, by what a fit leaves; None if it was stated."""
    return None if observations.deviation_known else float(observations.deviation_mm[0]) * found.scatter


def _left_out(observations: PointObservations, found: Fit) -> HeldOutErrors | None:
    return left_out(observations, found) if can_leave_out(observations.pose_of[found.last], found.J.shape[1]) else None


def _beyond(robot: Robot, observations: PointObservations, found: Fit) -> Beyond:
    estimates, terms = _estimated(robot, observations, found)
    return Beyond(
        robot=corrected(robot, found.kept, found.amounts),
        errors=JointErrors(robot, found.terms, found.coefficients),
        terms=terms,
        estimates=estimates,
        rms_mm=observations.rms_mm(found.after * observations.deviation_mm),
        deviation_mm=_deviation(observations, found),
        left_out=_left_out(observations, found),
    )
