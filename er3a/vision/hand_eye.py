"""Hand-eye calibration: the likeliest poses of camera and board, how sure they are, and what contradicts them.

**Outliers** are found without a calibration, by rotation angles (:func:`check_angles`), and with one, by residuals
(:func:`worst_sample`). Between two samples hand and board turn by equal angles, whatever the hand-eye pose, and
whichever way round the transforms are written [1]_. Samples are taken out, the one in most conflicts first, until all
remaining pairs agree. For each one taken out, the rotations that detectors confuse are tried. The remaining samples
are judged by their residuals.

**Conventions**: poses that were read by another convention than they were written by are recognised because the samples
fit only by the other. Rotation angles don't show most of them: an exchange of a quaternion's real part acts on it as a
rotation and a mirror image in four dimensions.

References
----------
.. [1] H. H. Chen, "A screw motion approach to uniqueness analysis of head-eye geometry", CVPR 1991.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np
import scipy
from scipy.spatial.transform import Rotation

from er3a.by_value import ByValue, Displayed, Sheet, frozen, shortly
from er3a.finding import Finding, fact
from er3a.geometry.transforms import (
    inverted,
    log_rotation,
    posed,
    quaternion_of,
    rotation_angle,
    rpy_of,
    skew,
    step_between,
    transposed,
)
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.classic_methods import mean_pose, park
from er3a.vision.likelihood import (
    UNKNOWNS,
    Refined,
    half_width,
    refine,
    residuals,
)
from er3a.vision.typical_causes import DistanceFit, moved_between, wrong_distances, wrong_zero
from er3a.vision.vision_findings import HandEyeError, grave_warnings

DEVIATIONS = 20.0  # of the angle between two samples; beyond, a pair is in conflict. Tilts seen head-on are as vague
MAX_DEVIATION = np.radians(2.0)  # of a camera that is of any use
ROUNDING = 1e-6  # rad
MOSTLY_APART = 0.8  # of samples that stand apart, so that their residuals are judged as independent
COPY_DECIMALS = 9  # of m and of rotation matrices
FALSE_ALARMS = 1e-3  # of sound sets in which a sample is called far from the fit
BOARD_TURNS = {  # axis of the board, and deg
    "half_turn_x": ("x", (180.0,)),
    "half_turn_y": ("y", (180.0,)),
    "half_turn_z": ("z", (180.0,)),
    "quarter_turn_z": ("z", (90.0, -90.0)),
}
MEND_KINDS = (*BOARD_TURNS, "mirrored_tilt")


@frozen
class AngleCheck(ByValue):
    """What the rotation angles show.

    Attributes
    ----------
    tolerance : rad, beyond which a pair is in conflict
    used : (N,), samples whose pairs all agree
    """

    tolerance: float
    used: Flags
    found: tuple[Finding, ...]
    warning: Finding | None


def angles_between(R: Reals) -> Reals:
    """Angles between all pairs of rotations.

    Parameters
    ----------
    R : (N, 3, 3)

    Returns
    -------
    angles : (N, N), rad, 0 to pi
    """
    return rotation_angle(R[:, None], R[None])


def check_angles(samples: CalibrationSet) -> AngleCheck:
    """Find samples whose turning angles contradict the others': hand and board turn by equal angles [1]_.

    Parameters
    ----------
    samples : N of them

    Returns
    -------
    check : the samples that agree, and a finding for each other one; if no more than half agree, all are used and a
        warning says so
    """
    hand, eye = samples.flange[:, :3, :3], samples.target[:, :3, :3]
    turned = angles_between(hand)
    mismatch = np.abs(turned - angles_between(transposed(eye)))
    upper = np.triu_indices(len(samples), 1)
    tolerance = _tolerance(samples, mismatch[upper])
    used = _agreeing(mismatch > tolerance)
    if used.sum() <= len(samples) / 2:
        conflict = mismatch[upper] > tolerance
        warning = fact(
            "no_majority",
            pairs=int(conflict.sum()),
            of=len(conflict),
            median_deg=float(np.degrees(np.median(mismatch[upper]))),
        )
        return AngleCheck(tolerance, np.ones(len(samples), bool), (), warning)
    found = tuple(
        fact(
            "rotation_mismatch",
            sample=samples.names[i],
            kind=_mending_turn(samples.target, turned, int(i), used, tolerance),
            off_deg=float(np.degrees(np.median(mismatch[i, used]))),
        )
        for i in np.flatnonzero(~used)
    )
    return AngleCheck(tolerance, used, found, None)


def _tolerance(samples: CalibrationSet, mismatch: Reals) -> float:
    """Half of the mismatches of sound pairs lie below 0.674 standard deviations."""
    deviation = min(float(np.median(mismatch)) / 0.674, MAX_DEVIATION)
    if samples.camera_covariance is not None:
        stated = np.linalg.eigvalsh(samples.camera_covariance[:, 3:, 3:])[:, -1].mean()
        # A sample can be bad in so many pairs that the median is, too; what is stated then holds it down.
        deviation = min(deviation, 3 * float(np.sqrt(2 * stated)))
        deviation = max(deviation, float(np.sqrt(2 * stated)))
    return float(max(DEVIATIONS * deviation, ROUNDING))


def _agreeing(conflict: Flags) -> Flags:
    """Samples left when the one in most conflicts is taken out until there are none (N,)."""
    used = np.ones(len(conflict), dtype=bool)
    while True:
        count = np.where(used, (conflict & used).sum(axis=1), 0)
        if not count.any():
            return used
        used[int(count.argmax())] = False


def _mending_turn(target: Reals, turned: Reals, i: int, used: Flags, tolerance: float) -> str:
    best, mending = tolerance, "rotation"
    for kind in MEND_KINDS:
        for R in _rotation_candidates(target[i], kind):
            angle = rotation_angle(transposed(R)[None], transposed(target[used, :3, :3]))
            off = float(np.median(np.abs(angle - turned[i, used])))
            if off < best:
                best, mending = off, kind
    return mending


def _rotation_candidates(T: Reals, kind: str) -> list[Reals]:
    """The rotations (3, 3) that a detection may have been mistaken for."""
    R = T[:3, :3]
    if kind == "mirrored_tilt":
        sight = T[:3, 3] / max(float(np.linalg.norm(T[:3, 3])), 1e-12)
        away = np.eye(3) - 2 * np.outer(sight, sight)
        return [away @ R @ np.diag([1.0, 1.0, -1.0])]
    axis, turns = BOARD_TURNS[kind]
    return [R @ Rotation.from_euler(axis, turn, degrees=True).as_matrix() for turn in turns]


def worst_sample(samples: CalibrationSet, refined: Refined) -> tuple[int, Finding] | None:
    """The sample whose residuals are too large compared with those of all others.

    The share by which a sample pulls the fit towards itself is taken back from its six residuals. Over the others'
    scatter these are distributed as F with 6 and the remaining degrees of freedom. What is within stated deviations is
    not too large, however little the others scatter.

    Parameters
    ----------
    samples : N of them
    refined : the fit of all of them

    Returns
    -------
    number, finding : from 0, in mm and deg; None if no sample is too far from the fit
    """
    free = 6 * len(samples) - 12 - 6
    if free < 6:
        return None
    squares = (refined.whitened**2 / np.maximum(1 - refined.leverage, 0.02)).sum(axis=1)
    others = np.maximum((refined.whitened**2).sum() - (refined.whitened**2).sum(axis=1), 1e-300) / free
    if samples.camera_covariance is not None:
        others = np.maximum(others, 1.0)
    probability = scipy.special.fdtrc(6, free, squares / 6 / others)
    worst = int(probability.argmin())
    if probability[worst] * len(samples) >= FALSE_ALARMS:
        return None
    own = refined.residual[worst] / np.maximum(1 - refined.leverage[worst], 0.02)
    off_mm, off_deg = 1000 * np.linalg.norm(own[:3]), np.degrees(np.linalg.norm(own[3:]))
    return worst, fact(
        "far_from_fit",
        sample=samples.names[worst],
        off_mm=float(off_mm),
        off_deg=float(off_deg),
        probability=float(probability[worst]),
    )


def _copies(samples: CalibrationSet) -> Flags:
    """Samples (N,) equal to an earlier one in both poses, which measure nothing and would narrow intervals."""
    rows = np.concatenate([samples.flange, samples.target], axis=1).reshape(len(samples), -1).round(COPY_DECIMALS)
    copies = np.ones(len(samples), bool)
    copies[np.unique(rows, axis=0, return_index=True)[1]] = False
    return copies


MUCH_DISTANCE, MUCH_ROTATION = 0.01, np.radians(3)  # m, rad
MISREAD = 0.3  # of these, below which no wrong convention leaves residuals
MUCH_BETTER = 5
AS_GOOD = 1.5  # ratio of residuals, within which two conventions explain the samples equally well
STREAMS = ("flange", "target", "both")


def _rotations(read: Callable[[Reals], Reals]) -> Callable[[Reals], Reals]:
    """Poses with rotations that are read otherwise."""
    return lambda T: posed(read(T), T[:, :3, 3])


def _quaternions(shift: int) -> Callable[[Reals], Reals]:
    """Quaternions whose real part is at the other end."""
    return _rotations(
        lambda T: Rotation.from_quat(np.roll(quaternion_of(T), shift, axis=1), scalar_first=False).as_matrix()
    )


def _angles(axes: str) -> Callable[[Reals], Reals]:
    """Roll, pitch and yaw as turns about these axes, each about the one that those before have turned."""
    return _rotations(lambda T: Rotation.from_euler(axes, rpy_of(T)).as_matrix())


def _axes(rows: list[list[int]]) -> Callable[[Reals], Reals]:
    """Positions by other axes."""
    return lambda T: posed(T[:, :3, :3], T[:, :3, 3] @ np.array(rows).T)


CONVENTIONS: dict[str, Callable[[Reals], Reals]] = {
    "inverted": inverted,
    "transposed": _rotations(lambda T: transposed(T[:, :3, :3])),
    "real_part_first": _quaternions(2),
    "real_part_last": _quaternions(0),
    "turning_axes": _angles("XYZ"),
    "abc": _angles("ZYX"),
    "zyz": _angles("ZYZ"),
    "opengl": _axes([[1, 0, 0], [0, -1, 0], [0, 0, -1]]),
    "to_optical": _axes([[0, -1, 0], [0, 0, -1], [1, 0, 0]]),
    "from_optical": _axes([[0, 0, 1], [-1, 0, 0], [0, -1, 0]]),
}
"""How poses may have been meant, from how they are read."""


def other_conventions(samples: CalibrationSet, residual: Reals) -> tuple[Finding, ...]:
    """Conventions by which the samples fit much better than as they were read, all that fit equally well.

    Parameters
    ----------
    residual : (N, 6), m and rad, of the samples as they were read

    Returns
    -------
    findings : empty where the samples fit as they were read, or no better otherwise

    Notes
    -----
    Each reading is judged by the residuals of Park's closed form (:mod:`er3a.vision.classic_methods`).
    """
    given, *rms = _misfit(residual)
    if given < MISREAD:
        return ()
    found = []
    for stream in STREAMS:
        for name, read in CONVENTIONS.items():
            flange = samples.flange if stream == "target" else read(samples.flange)
            target = samples.target if stream == "flange" else read(samples.target)
            again = replace(samples, flange=flange, target=target)
            try:
                left = residuals(again.hand, again.target, *park(again.hand, again.target))[0]
            except np.linalg.LinAlgError:
                continue
            size, mm, deg = _misfit(left)
            if size < given / MUCH_BETTER:
                found.append(
                    (
                        size,
                        fact(
                            "other_convention",
                            stream=stream,
                            convention=name,
                            rms_given_mm=rms[0],
                            rms_given_deg=rms[1],
                            rms_other_mm=mm,
                            rms_other_deg=deg,
                        ),
                    )
                )
    least = min((size for size, _ in found), default=0.0)
    return tuple(each for size, each in found if size <= AS_GOOD * least)


def _misfit(residual: Reals) -> tuple[float, float, float]:
    """Residuals (N, 6) in what a camera of any use keeps, both parts added; and root mean squares, mm and deg."""
    distance, turn = (float(np.sqrt((residual[:, part] ** 2).mean())) for part in (slice(3), slice(3, 6)))
    return distance / MUCH_DISTANCE + turn / MUCH_ROTATION, 1000 * distance, float(np.degrees(turn))


MIN_SAMPLES = 3  # two motions with different axes determine the rotation
FEW_SAMPLES = 6  # of which none is judged by the others
EQUAL = 1e-9  # m and rad, within which all poses are one: nothing was moved
MIN_TURN = np.radians(0.5)  # of the hand, without which nothing is determined
MIN_SPREAD = np.radians(1.0)  # of the rotation axes, without which a shift along them stays open
LITTLE_TURN, LITTLE_SPREAD = np.radians(15), np.radians(10)
EXCLUDED = 1e-3
CONTRADICTED = 1e-3  # probability of touched points as far off, below which they contradict the calibration
MAX_FACTS = 10  # findings that a notebook shows


@frozen
class TouchCheck(ByValue):
    """Points touched with the robot, held out of the calibration, against where the camera puts them.

    Attributes
    ----------
    difference : (M, 3), m, touched less predicted, base frame
    half_width : (M, 3), m, of their 95 % intervals
    probability : that differences are as large if calibration and intervals are right
    """

    difference: Reals
    half_width: Reals
    probability: float

    @property
    def contradiction(self) -> Finding | None:
        """The finding that the points contradict the calibration; None if they don't."""
        if self.probability >= CONTRADICTED:
            return None
        return fact(
            "touch_contradicts",
            points=len(self.difference),
            largest_mm=1000 * self.largest,
            probability=self.probability,
        )

    @property
    def largest(self) -> float:
        """How far a point is off at most, m."""
        return float(np.linalg.norm(self.difference, axis=1).max())


@frozen
class HandEye(ByValue, Displayed):
    """A calibration.

    Attributes
    ----------
    samples : all that were given; used : (N,), those that the estimate rests on
    X, Y : (4, 4): T_flange_camera and T_base_board (camera on the flange), T_base_camera and T_flange_board (fixed)
    covariance : (12, 12) of X's position (m) and rotation (rad), by the axes of its parent frame, then Y's
    half_width : (12,), of their 95 % intervals
    residual : (N, 6), m and rad, by the camera's axes, of all samples
    scatter : root mean square of the whitened residuals; 1 is as stated, and where nothing is stated
    deviations : (2,), m and rad, of T_camera_board's position and rotation by axis, stated or estimated
    """

    samples: CalibrationSet
    used: Flags
    X: Reals
    Y: Reals
    covariance: Reals
    half_width: Reals
    residual: Reals
    scatter: float
    deviations: Reals
    greatest_turn: float
    axes_apart: float
    suspects: tuple[Finding, ...]
    warnings: tuple[Finding, ...]
    touch: TouchCheck | None

    def sheet(self) -> Sheet:
        """What the notebook shows: the twelve numbers in mm and deg, with half their 95 % intervals.

        Returns
        -------
        sheet : a row for each axis of both poses, and the first findings
        """
        in_hand = self.samples.setup == "eye_in_hand"
        poses = ("T_flange_camera", "T_base_board") if in_hand else ("T_base_camera", "T_flange_board")
        rows = [
            (name, axis, 1000 * T[k, 3], 1000 * half[k], np.degrees(rpy_of(T)[k]), np.degrees(half[3 + k]))
            for name, T, half in zip(poses, (self.X, self.Y), self.half_width.reshape(2, 6))
            for k, axis in enumerate("xyz")
        ]
        columns = ("pose", "axis", "mm", "half_width_mm", "rpy_deg", "half_width_deg")
        found = [*self.suspects, *self.warnings]
        facts = tuple(shortly(each) for each in found[:MAX_FACTS])
        heading = f"Hand-eye calibration, {int(self.used.sum())} of {len(self.samples)} samples used"
        return Sheet.of_table(heading, columns, rows, facts)

    @property
    def copies(self) -> tuple[str, ...]:
        """Names of samples left out as equal to an earlier one in both poses."""
        return tuple(name for name, copy in zip(self.samples.names, _copies(self.samples)) if copy)


def calibrate_hand_eye(samples: CalibrationSet) -> HandEye:
    """Estimate the poses of camera and board, with 95 % intervals, and check every sample.

    Parameters
    ----------
    samples : at least three, whose motions rotate about two directions

    Returns
    -------
    found : the maximum-likelihood estimate from all samples except those that can't be right, which are named

    Raises
    ------
    HandEyeError
        if the samples do not determine the camera's or the board's pose
    """
    _check_determined(samples)
    angles = check_angles(samples)
    once = ~_copies(samples)
    used = angles.used & once
    suspects: list[Finding] = list(angles.found)
    while True:
        kept = samples.take(used)
        greatest, apart = _check_determined(kept)
        refined = _fitted(kept)
        if len(kept) <= FEW_SAMPLES or (worst := worst_sample(kept, refined)) is None:
            break
        used[np.flatnonzero(used)[worst[0]]] = False
        suspects.append(worst[1])
    warnings: list[Finding] = [angles.warning] if angles.warning else []
    distances = wrong_distances(kept, refined)
    warnings += _warnings(kept, refined, greatest, apart, distances)
    share = len(set(kept.places.tolist())) / len(kept)
    named = {each.code for each in grave_warnings(warnings)} - {"unexplained_residuals", "more_scatter"}
    if not named and share > MOSTLY_APART:
        every = samples.take(once)
        step = moved_between(every, refined if used[once].all() else _fitted(every))
        warnings += [step] if step else []
    covariance = refined.covariance + _shared_covariance(kept, refined)
    half = half_width(covariance, refined.freedom)
    wider = _wider(half, refined, distances) / half
    found = HandEye(
        samples=samples,
        used=used,
        X=refined.X,
        Y=refined.Y,
        covariance=covariance * np.outer(wider, wider),
        half_width=half * wider,
        residual=residuals(samples.hand, samples.target, refined.X, refined.Y)[0],
        scatter=refined.scatter,
        deviations=refined.deviations,
        greatest_turn=greatest,
        axes_apart=apart,
        suspects=tuple(suspects),
        warnings=tuple(warnings),
        touch=None,
    )
    return found if samples.touched is None else replace(found, touch=_touch(found, samples.touched))


def zeros_tried(found: HandEye, robot: Robot) -> tuple[HandEye, tuple[str, ...], float]:
    """A calibration whose warnings name the joint with a wrong zero, if one explains all that contradicts it.

    Parameters
    ----------
    found : a calibration; samples without joint values leave all joints unseen

    Returns
    -------
    found, unseen, smallest : see :class:`er3a.vision.typical_causes.ZerosTried`
    """
    used = found.samples.take(found.used)
    tried = wrong_zero(found.samples, used, refine(used, found.X, found.Y), robot)
    explained = {each.code for each in grave_warnings(found.warnings)} <= EXPLAINED_BY_A_ZERO
    if tried.zero and tried.mended and explained:
        with suppress(HandEyeError):
            if not grave_warnings(calibrate_hand_eye(tried.mended).warnings):
                others = tuple(each for each in found.warnings if each.code not in EXPLAINED_BY_A_ZERO)
                found = replace(found, warnings=(tried.zero, *others))
    return found, tried.unseen, tried.smallest


EXPLAINED_BY_A_ZERO = {
    *("board_scale", "focal_length", "principal_point", "unexplained_residuals", "moved_between", "more_scatter")
}


def _fitted(samples: CalibrationSet) -> Refined:
    with suppress(np.linalg.LinAlgError):
        found = refine(samples, *park(samples.hand, samples.target))
        if np.isfinite(found.covariance).all() and (np.diag(found.covariance) > 0).all():
            return found
    raise HandEyeError(fact("nothing_fits"))


def _shared_covariance(samples: CalibrationSet, refined: Refined) -> Reals:
    """What errors that all samples share add to the covariance of the two poses, (12, 12)."""
    if samples.shared is None:
        return np.zeros((UNKNOWNS, UNKNOWNS))
    moves = refined.inverse @ np.einsum("nki,nkj->ij", refined.J, refined.W @ samples.shared)
    added: Reals = moves @ moves.T
    return added


def _wider(half: Reals, refined: Refined, distances: tuple[DistanceFit, ...]) -> Reals:
    """Half widths (12,) that also hold what the poses are with each error of distances that samples don't exclude."""
    for each in distances:
        fit = each.refined
        shift = np.concatenate([step_between(refined.X, fit.X), step_between(refined.Y, fit.Y)])
        half = np.maximum(half, np.abs(shift) + fit.half_width[:UNKNOWNS])
    return half


def _check_determined(samples: CalibrationSet) -> tuple[float, float]:
    """The largest turn between two samples and how far the rotation axes leave one direction, rad."""
    if len(samples) < MIN_SAMPLES:
        raise HandEyeError(fact("too_few_samples", samples=len(samples), needed=MIN_SAMPLES))
    for stream in ("flange", "target"):
        poses = getattr(samples, stream)
        if np.abs(step_between(poses[:1], poses)).max() < EQUAL:
            raise HandEyeError(fact("all_samples_equal", stream=stream))
    R = samples.hand[:, :3, :3]
    greatest = float(angles_between(R).max())
    if greatest < MIN_TURN:
        raise HandEyeError(fact("no_rotation", greatest_turn_deg=float(np.degrees(greatest))))
    i, j = np.triu_indices(len(samples), 1)
    turns = log_rotation(transposed(R[j]) @ R[i])
    _, size, axes = np.linalg.svd(turns, full_matrices=False)
    apart = float(np.arctan2(size[1], size[0]))
    if apart < MIN_SPREAD:
        raise HandEyeError(
            fact("parallel_axes", axis=tuple(axes[0].round(2).tolist()), spread_deg=float(np.degrees(apart)))
        )
    return greatest, apart


def _warnings(
    samples: CalibrationSet,
    refined: Refined,
    greatest: float,
    apart: float,
    distances: tuple[DistanceFit, ...],
) -> list[Finding]:
    found: list[Finding] = []
    if not refined.converged:
        found.append(fact("not_converged", samples=len(samples)))
    if greatest < LITTLE_TURN or apart < LITTLE_SPREAD:
        found.append(
            fact(
                "little_motion", greatest_turn_deg=float(np.degrees(greatest)), axes_apart_deg=float(np.degrees(apart))
            )
        )
    if (places := len(set(samples.places.tolist()))) <= FEW_SAMPLES:
        found.append(fact("few_samples", samples=places))
    free = 6 * len(samples) - 12
    largest = float(np.sqrt(scipy.special.chdtri(free, EXCLUDED) / free))
    if samples.camera_covariance is not None and refined.scatter > largest:
        found.append(fact("more_scatter", scatter=refined.scatter, largest=largest))
    if read := other_conventions(samples, refined.residual):
        return [*found, *read]
    found += [each.finding for each in distances if each.sure]
    size, distance, turn = _misfit(refined.residual)
    if size > 1 and not grave_warnings(found):
        found.append(fact("unexplained_residuals", rms_mm=distance, rms_deg=turn))
    return found


_PARTS = (slice(3), slice(3, 6))


def _touch(found: HandEye, touched: Reals) -> TouchCheck:
    """A fixed camera sees the points itself; with the camera on the flange they lie on the fixed board."""
    fixed = found.samples.setup == "eye_to_hand"
    T, part = (found.X, slice(0, 6)) if fixed else (found.Y, slice(6, 12))
    turned = touched[:, 0] @ T[:3, :3].T
    difference = touched[:, 1] - turned - T[:3, 3]
    J = np.concatenate([np.broadcast_to(np.eye(3), (len(touched), 3, 3)), -skew(turned)], axis=2)
    own = found.deviations[0] ** 2 if fixed else 0.0
    shared = np.einsum("mik,kl,njl->minj", J, found.covariance[part, part], J).reshape(3 * len(J), -1)
    whole = shared + (own + found.samples.touch_deviation**2 + 1e-18) * np.eye(len(shared))
    flat = difference.ravel()
    probability = float(scipy.special.chdtrc(len(flat), flat @ np.linalg.solve(whole, flat)))
    half_width = 1.96 * np.sqrt(np.diag(whole)).reshape(-1, 3)
    return TouchCheck(difference, half_width, probability)


def spread_of(found: HandEye) -> tuple[float, float]:
    """How much the used samples' board poses scatter about their mean.

    Parameters
    ----------
    found : a calibration

    Returns
    -------
    distance, angle : root mean squares, m and rad
    """
    poses = (found.samples.hand @ found.X @ found.samples.target)[found.used]  # all equal to Y without errors
    step = step_between(mean_pose(poses), poses)
    size = [np.linalg.norm(step[:, part], axis=1) for part in _PARTS]
    return float(np.sqrt((size[0] ** 2).mean())), float(np.sqrt((size[1] ** 2).mean()))
