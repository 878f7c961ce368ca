"""Which numbers measurements can tell apart, and their values by weighted least squares.

Gauss-Newton steps on the weighted differences; the covariance of the estimates is ``inv(J^T W J)`` [1]_.

References
----------
.. [1] J. M. Hollerbach, C. W. Wampler, "The calibration index and taxonomy for robot kinematic calibration methods",
   Int. J. of Robotics Research 15(6), 1996.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
import scipy

from er3a.by_value import by_identity
from er3a.calibration.observations import PointObservations
from er3a.calibration.parameters import (
    DEPENDENT,
    CalibrationError,
    PlacementName,
    corrected,
    parallel_pairs,
    parameters_of,
    placements_of,
    placing_axes,
)
from er3a.calibration.terms import TAKEN, JointErrors, JointTerm, term_jacobian
from er3a.comparison.entries import BASE_COLUMNS, Entry, entry_twists
from er3a.finding import Finding, fact
from er3a.geometry.transforms import exp_rotation, nearest_rotations, posed, rpy_of, skew, transposed
from er3a.kinematics.table_batch import tables_of
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.references.quantities import MM
from er3a.robots.robot import Robot

SCALE = 1e-3  # m and rad alike: 1 mm, and 1 mrad, which moves a flange about as far
NO_EFFECT = 1e-6
STEPS, MAX_STEPS = 30, 100
PLAUSIBLE = 0.05  # m and rad: a standard deviation of corrections
FAR_OFF = 4.0  # of these
SMALL_STEP = 1e-12  # m and rad
SMALL_CHANGE, SLOW_CHANGE = 1e-6, 1e-3  # of the weighted differences, of measured points; after STEPS
HALVINGS = 12
ROUNDING = 1e-6  # mm: a fit that leaves less has met its points exactly
CLEAR = 10.0
"""Times what the table leaves of touched points that the ways of joints that slide have to be to set a length, root
mean square. Taken for part of it, what is left errs by the square, 1 %."""
MIN_ALIGNED = 3
FAR = 2.0  # times as near, where base and tool start elsewhere than in the robot's file
OUTLIER_ROUNDS = 3
FAR_OUT = 6.0
"""Standard deviations beyond which a point is set aside: noise goes there once in 500 million."""
MEDIAN_TO_DEVIATION = 1.4826  # of a normal distribution: the standard deviation over the median of the size
TURNS_ALL = Entry("offset", 1)
"""Turns all points alike, which is nothing to points that are seen against each other alone."""


@by_identity
class Subspace:
    """What measurements determine.

    Attributes
    ----------
    kept : the parameters that are estimated
    held : why the others keep their values
    """

    kept: tuple[Entry, ...]
    held: tuple[Finding, ...]


def jacobian(
    robot: Robot,
    parameters: Sequence[Entry],
    observations: PointObservations,
    amounts: Reals | float = 0.0,
    *,
    gathered: bool = False,
) -> Reals:
    """Derivatives of observed values by parameters.

    Parameters
    ----------
    parameters : p entries of table, base and tool
    amounts : (p,), m or rad, added to the robot's values, where the derivatives are taken
    gathered : whether all points of a place are taken to be together, so that what turns all of them shows in none

    Returns
    -------
    J : (n, p), mm per m or rad, and mrad of orientations; small turns count, however far these are from measured ones
    """
    amounts = np.broadcast_to(amounts, len(parameters))
    here = corrected(robot, parameters, amounts) if amounts.any() else robot
    of_rows = np.array([bool(each.joint) for each in parameters], dtype=bool)
    xyz, turns = observations.positions(here), observations.turns(here)
    xyz = observations.gathered(xyz) if gathered else xyz
    rows = [each for each in parameters if each.joint]
    shifts = np.empty((len(xyz), 6, len(parameters)))
    shifts[..., of_rows] = entry_twists(tables_of(here), here, observations.row_values, rows, xyz)
    by_tool = np.where(observations.on_tool[:, None, None], turns, 0.0)
    if not of_rows.all():
        along, about = placing_axes(parameters, amounts)
        of_base = np.array([each.column in BASE_COLUMNS for each in parameters])
        of_tool, lever = ~of_rows & ~of_base, skew(xyz - here.base[:3, 3])
        by_base, turned = (robot.base[:3, :3] @ each[of_base].T for each in (along, about))
        shifts[:, :3, of_base], shifts[:, 3:, of_base] = by_base - lever @ turned, turned
        shifts[:, :3, of_tool] = by_tool @ along[of_tool].T
        shifts[:, 3:, of_tool] = by_tool @ robot.tool[:3, :3] @ about[of_tool].T
    return MM * observations.relative_shift(shifts, xyz)[observations.seen]


def subspace(
    robot: Robot,
    parameters: Sequence[Entry],
    observations: PointObservations,
    dependent: float = DEPENDENT,
    *,
    imagined: bool = False,
) -> Subspace:
    """The identifiable part of the parameters.

    Columns of the weighted Jacobian are taken in order of preference. One that lies in the span of those before it (to
    ``dependent`` of its length) is held. So is one for which that is so if points of one place are together, as a
    corrected table will have them, or that shows no more than what the table leaves between them.

    Parameters
    ----------
    parameters : p entries, the preferred ones first
    dependent : share of a column's length that has to lie outside of the others' span
    imagined : whether the poses touch nothing, so that what is left between points of a place means nothing

    Returns
    -------
    subspace : the parameters kept, and why others are held
    """
    rows, scale = observations.independent(robot)[0], SCALE / observations.deviation_mm[:, None]
    ways = (False, True) if observations.kinds else (False,)
    every = [rows @ (scale * jacobian(robot, parameters, observations, gathered=way)) for way in ways]
    no_effect = NO_EFFECT * np.linalg.norm(1 / observations.deviation_mm)
    kept: list[int] = []
    held: list[Finding] = []
    bases: list[Reals] = [np.empty((len(J), 0)) for J in every]
    for k, parameter in enumerate(parameters):
        norms = [(float(np.linalg.norm(J[:, k])), np.linalg.norm(J, axis=0).max()) for J in every]
        rests = [_outside(J[:, k], basis) for J, basis in zip(every, bases)]
        spread = 0.0 if imagined else float(np.linalg.norm(every[0][:, k] - every[-1][:, k]))
        if any(norm <= max(no_effect, NO_EFFECT * most) for norm, most in norms):
            held.append(fact("moves_nothing", entry=parameter.name))
        elif any(np.linalg.norm(rest) <= max(dependent * norm, spread) for rest, (norm, _) in zip(rests, norms)):
            held.append(_confounded_with(robot, parameters, k, kept, every[0]))
        else:
            kept.append(k)
            bases = [np.column_stack([basis, rest / np.linalg.norm(rest)]) for basis, rest in zip(bases, rests)]
    return Subspace(tuple(parameters[k] for k in kept), tuple(held))


def _outside(column: Reals, basis: Reals) -> Reals:
    """What of a column is outside the span of a basis; taken off twice, against rounding."""
    rest = column - basis @ (basis.T @ column)
    return np.asarray(rest - basis @ (basis.T @ rest))


def scale_of(robot: Robot, observations: PointObservations) -> Entry | None:
    """The longest length of the table that moves the points as nothing else does, which sets the scale.

    Parameters
    ----------
    observations : if only places and planes were touched, nothing in them sets the scale

    Returns
    -------
    entry : to be taken as it is; None where coordinates were measured, or joints have slid while a place or plane was
        touched
    """
    if not observations.all_touched:
        return None
    lengths = parameters_of(robot, "lengths")
    effect = np.linalg.norm(jacobian(robot, lengths, observations.rich(robot), gathered=True), axis=0)
    moving = [entry for entry, size in zip(lengths, effect) if size > NO_EFFECT * effect.max()]
    replaceable = _replaceable(robot, moving, observations)
    alone = [entry for entry in moving if entry not in replaceable] or moving
    longest = max(alone, key=lambda entry: abs(entry.value(robot)), default=None)
    if longest is None:
        return None
    off = observations.predict(robot) - observations.values_mm
    known = np.linalg.norm(observations.slid(robot))
    min_known = max(CLEAR * float(np.linalg.norm(off)), DEPENDENT * abs(longest.value(robot)) * len(off) ** 0.5)
    return longest if known < min_known else None


def _replaceable(robot: Robot, lengths: Sequence[Entry], observations: PointObservations) -> list[Entry]:
    """Lengths in whose place others move the points alike: such a one may stay as it is while all shrink to a point."""
    every, seen = [*observations.placements, *parameters_of(robot, "all_entries")], observations.as_coordinates()
    ordered = ([*(each for each in every if each != entry), entry] for entry in lengths)
    return [order[-1] for order in ordered if order[-1] not in subspace(robot, order, seen).kept]


def without_scale(parameters: Sequence[Entry], scale: Entry | None) -> tuple[Entry, ...]:
    """Parameters that can still be estimated if a length sets the scale.

    Parameters
    ----------
    scale : as of :func:`scale_of`

    Returns
    -------
    parameters : all if nothing sets the scale
    """
    return tuple(each for each in parameters if scale is None or each not in (scale, TURNS_ALL))


def held_with(scale: Entry | None) -> tuple[Finding, ...]:
    """Why parameters are held if a length sets the scale.

    Parameters
    ----------
    scale : as of :func:`scale_of`

    Returns
    -------
    held : empty if nothing sets the scale
    """
    return (fact("moves_nothing", entry=TURNS_ALL.name), fact("sets_scale", entry=scale.name)) if scale else ()


def _confounded_with(robot: Robot, parameters: Sequence[Entry], k: int, kept: list[int], J: Reals) -> Finding:
    """Which entries act on the measured points as entry ``k`` does."""
    share = np.linalg.lstsq(J[:, kept], J[:, k], rcond=None)[0] * np.linalg.norm(J[:, kept], axis=0)
    partners = [parameters[i] for i, part in zip(kept, share) if abs(part) > DEPENDENT * np.linalg.norm(J[:, k])]
    between = [
        joints for row, joints in parallel_pairs(robot)
        if parameters[k].column == "d" and {parameters[k].joint, partners[-1].joint} == set(joints)
    ]  # fmt: skip
    entries = (parameters[k].name, *(partner.name for partner in partners))
    return fact(
        "not_told_apart", entries=entries, parallel_joints=between[0] if between and len(partners) == 1 else None
    )


@by_identity
class Fit:
    """A least squares' solution.

    Attributes
    ----------
    kept, terms : what was fitted
    amounts : (k,), added to what the robot has, in m and rad; coefficients : (c,), of the terms
    before, after : (n,), differences to the measurements in standard deviations
    J, rest : (m, k + c) and (m,), derivatives and differences of what is independent of places and planes
        that nobody knows, in standard deviations of it, ``deviation_mm`` (m,)
    last : (m,), the last of the n observed values that it is made of
    ran_off : whether another arm meets the observations better, so that corrections were taken to be small
    """

    kept: tuple[Entry, ...]
    terms: tuple[JointTerm, ...]
    amounts: Reals
    coefficients: Reals
    before: Reals
    after: Reals
    J: Reals
    rest: Reals
    deviation_mm: Reals
    last: Integers
    ran_off: bool = False

    @property
    def freedom(self) -> int:
        """Degrees of freedom of what remains."""
        return max(len(self.rest) - int(self.J.shape[1]), 1)

    @property
    def covariance(self) -> Reals:
        """(k + c, k + c), of the estimates; coefficients of terms are about ``TAKEN`` at most."""
        prior = np.r_[np.zeros(len(self.amounts)), np.full(len(self.coefficients), TAKEN**-2)]
        scale = np.linalg.norm(self.J, axis=0)
        information = (self.J / scale).T @ (self.J / scale) + np.diag(prior / scale**2)
        return np.asarray(np.linalg.inv(information) / np.outer(scale, scale), np.float64)

    @property
    def scatter(self) -> float:
        """Root mean square of what remains, in standard deviations, per degree of freedom."""
        return float(np.sqrt((self.rest @ self.rest) / self.freedom))


def aligned(points: Reals, measured: Reals) -> tuple[Reals, float, float]:
    """Rigid transform that brings points nearest to measured ones, in the least squares (Kabsch).

    Parameters
    ----------
    points, measured : (P, 3), m

    Returns
    -------
    S : (4, 4), m, places the points at the measured ones
    scale : how many times as large the measured figure is; NaN if all points of one are at one place
    share : of the squares, what remains after such a scale, 0 to 1

    References
    ----------
    W. Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta Cryst. A 32, 1976.
    """
    at, centre = points.mean(axis=0), measured.mean(axis=0)
    products = (measured - centre).T @ (points - at)
    R = nearest_rotations(products)
    both, own, theirs = (R * products).sum(), ((points - at) ** 2).sum(), ((measured - centre) ** 2).sum()
    scale, share = (both / own, 1 - both**2 / (own * theirs)) if own * theirs else (np.nan, 1.0)
    return posed(R, centre - R @ at), float(scale), float(share)


def rough_places(robot: Robot, observations: PointObservations) -> tuple[Reals, Flags]:
    """Rough places of base and tool, by the table as it is and points that were measured whole.

    The tracker's frame may be anywhere, and the tool's place a guess. Let the table put points at x, and turn flanges
    by R. A base S and a tool moved by t then put the measured points at ``m = S (x + R t)``, which is solved by least
    squares, from where the base alone would be.

    Parameters
    ----------
    observations : of P points

    Returns
    -------
    amounts : of the observations' placements, m and rad, 0 where too few points say something
    used : (P,), points without those that are far out, by the median of all
    """
    whole = np.flatnonzero(observations.seen[:, :3].all(axis=1) & (observations.touched < 0))
    used, own = np.ones(len(observations.seen), dtype=bool), np.ones(len(whole), dtype=bool)
    S, t, inverse = np.eye(4), np.zeros(3), np.linalg.inv(robot.base)
    turned = inverse[:3, :3] @ observations.turns(robot)
    values = np.zeros(observations.seen.shape)
    values[observations.seen] = observations.values_mm / MM
    x, m = (xyz @ inverse[:3, :3].T + inverse[:3, 3] for xyz in (observations.positions(robot), values[:, :3]))
    x, m, R = x[whole], m[whole], np.where(observations.on_tool[:, None, None], turned, 0.0)[whole]  # of flange: 0
    for _ in range(OUTLIER_ROUNDS):
        if own.sum() < MIN_ALIGNED:
            break
        S, t = _base_and_tool(x[own], R[own], m[own], observations.free)
        off = np.linalg.norm((x + R @ t) @ S[:3, :3].T + S[:3, 3] - m, axis=1)
        own = off <= FAR_OUT * MEDIAN_TO_DEVIATION * np.median(off)
    used[whole] = own
    own = observations.seen[:, 3:].any(axis=1) & observations.on_tool
    off = transposed(robot.base[:3, :3] @ S[:3, :3] @ turned @ robot.tool[:3, :3]) @ observations.orientations
    of_tool = rpy_of(nearest_rotations(off[own].sum(axis=0))) if own.any() else np.zeros(3)
    amounts = dict(zip(placements_of(("base", "tool"), oriented=True), [*S[:3, 3], *rpy_of(S), *t, *of_tool]))
    return np.array([amounts[each] for each in observations.placements]), used


def _base_and_tool(x: Reals, R: Reals, m: Reals, free: Sequence[PlacementName]) -> tuple[Reals, Reals]:
    """S (4, 4) and t (3,) of :func:`rough_places`, each left where it is if it is not free."""
    start = aligned(x, m)[0] if "base" in free else np.eye(4)
    moving = np.repeat(["base" in free, "tool" in free], (6, 3))

    def at(v: Reals) -> tuple[Reals, Reals]:
        """Base shifted and turned from the start, and the tool's shift."""
        v = moving * v
        return start @ posed(exp_rotation(v[3:6]), v[:3]), v[6:]

    def off(v: Reals) -> Reals:
        S, t = at(v)
        return ((x + R @ t) @ S[:3, :3].T + S[:3, 3] - m).ravel()

    return at(scipy.optimize.least_squares(off, np.zeros(len(moving)), method="lm").x)


def places_at(robot: Robot, kept: Sequence[Entry], observations: PointObservations) -> Reals:
    """Amounts to start a fit from.

    Parameters
    ----------
    kept : k entries that are fitted, with those of base and tool

    Returns
    -------
    amounts : (k,), m or rad; 0, unless other places of base and tool bring the points much nearer to the measured ones
    """
    amounts, none = np.zeros(len(kept)), np.zeros(len(kept))
    rough, used = rough_places(robot, observations)
    by_name = dict(zip(observations.placements, rough.tolist()))
    placing = [k for k, each in enumerate(kept) if each in by_name]
    amounts[placing] = [by_name[kept[k]] for k in placing]
    seen = observations.take(used)
    off, there = (
        np.linalg.norm(seen.predict(arm) - seen.values_mm) for arm in (robot, corrected(robot, kept, amounts))
    )
    return amounts if FAR * there < off else none


def fit(
    robot: Robot,
    kept: Sequence[Entry],
    observations: PointObservations,
    terms: Sequence[JointTerm] = (),
) -> Fit:
    """Corrections, and coefficients of terms, that meet the observations best, by weighted least squares [1]_.

    Points that touch something may be met best by quite another arm, if they settle little or some are outliers. If the
    steps don't end, or end there, corrections are taken to be small (``PLAUSIBLE``), and none of them is settled.

    Parameters
    ----------
    kept : k entries to correct
    terms : of measured points only

    Returns
    -------
    fit : amounts in m and rad

    Raises
    ------
    CalibrationError
        if the steps don't end
    """
    if not observations.all_touched:
        return _fit(robot, kept, observations, terms, 0.0)
    with suppress(CalibrationError):
        found = _fit(robot, kept, observations, terms, 0.0)
        if np.abs(found.amounts).max() < FAR_OFF * PLAUSIBLE:
            return found
    return replace(_fit(robot, kept, observations, terms, 1 / PLAUSIBLE), ran_off=True)


def _fit(
    robot: Robot,
    kept: Sequence[Entry],
    observations: PointObservations,
    terms: Sequence[JointTerm],
    holding: float,
) -> Fit:
    """``holding``: by how much corrections are held at 0, per rad or m."""
    kept, terms, deviation = tuple(kept), tuple(terms), observations.deviation_mm
    prior = np.full(sum(term.count for term in terms), 1 / TAKEN)
    unknowns = np.r_[places_at(robot, kept, observations), np.zeros(len(prior))]
    n, k = len(observations), len(kept)
    held = holding * np.eye(k if holding else 0, len(unknowns))

    def with_errors(coefficients: Reals) -> PointObservations:
        if not terms:
            return observations
        errors = JointErrors(robot, terms, coefficients)
        return observations.shifted(errors.amounts(observations.row_values, observations.points(robot)))

    def weighted(unknowns: Reals) -> Reals:
        values = with_errors(unknowns[k:]).predict(corrected(robot, kept, unknowns[:k]))
        return np.concatenate([(values - observations.values_mm) / deviation, prior * unknowns[k:], held @ unknowns])

    def slopes(unknowns: Reals) -> Reals:
        seen = with_errors(unknowns[k:])
        J = jacobian(robot, kept, seen, unknowns[:k]) / deviation[:, None]
        if terms:
            here = corrected(robot, kept, unknowns[:k])
            by_terms = term_jacobian(here, robot, terms, observations, seen) / deviation[:, None]
            J = np.block([[J, by_terms], [np.zeros((len(prior), k)), np.diag(prior)]])
        return np.vstack([J, held])

    before, rest = weighted(np.zeros(len(unknowns)))[:n], weighted(unknowns)
    for number in range(MAX_STEPS):
        J = slopes(unknowns)
        step = np.linalg.lstsq(J, -rest, rcond=None)[0]
        gain = np.linalg.norm(J @ step)
        for _ in range(HALVINGS):
            trial = unknowns + step
            new = weighted(trial)
            if new @ new <= rest @ rest * (1 + 1e-9):
                break
            step = step / 2
        unknowns, rest = trial, new
        small = SMALL_CHANGE if number < STEPS else SLOW_CHANGE
        if gain < small * np.linalg.norm(rest) or np.abs(step).max() < SMALL_STEP + 1e-9 * np.abs(unknowns).max():
            rows, last = with_errors(unknowns[k:]).independent(corrected(robot, kept, unknowns[:k]))
            own = np.sqrt(rows**2 @ deviation**2)
            return Fit(
                kept, terms, unknowns[:k], unknowns[k:], before, rest[:n], rows @ J[:n], rows @ rest[:n], own, last
            )
    rest_mm = observations.rms_mm(rest[:n] * deviation)
    raise CalibrationError(
        fact("no_correction_fits", steps=MAX_STEPS, rest_mm=rest_mm),
        f"no corrections make the table fit: after {MAX_STEPS} steps the positions are still {rest_mm:.3g} mm off. "
        "The table has a gross fault or is another arm's; er3a confirm names what is other",
    )
