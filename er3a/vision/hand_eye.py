"""Hand-eye calibration: the likeliest poses of camera and board, how sure they are, and what speaks against them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from er3a.by_value import ByValue
from er3a.display import Displayed, Sheet, first_rows, shortly
from er3a.geometry.transforms import rpy_of
from er3a.numerics.arrays import Flags, Reals
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.classic_methods import METHOD_NAMES, MethodName, mean_pose, solved_by
from er3a.vision.likelihood import PoseObservations, Refined, refine, residuals
from er3a.vision.readings import other_reading
from er3a.vision.suspects import angles_between, check_angles, repeated_poses, worst_sample
from er3a.vision.tangent import inverted, log_rotation, moved, skew, step_between, transposed
from er3a.vision.vision_findings import (
    AllSamplesEqual,
    BoardScale,
    CalibrationWarning,
    DirectionStatus,
    DirectionTried,
    HandEyeError,
    LittleMotion,
    MoreScatter,
    NoRotation,
    NothingFits,
    OtherDirection,
    ParallelTurns,
    Suspect,
    TooFewSamples,
)

LEAST_SAMPLES = 3
EQUAL = 1e-9
LEAST_TURN = np.radians(0.5)
LEAST_SPREAD = np.radians(1.0)
LITTLE_TURN, LITTLE_SPREAD = np.radians(15), np.radians(10)
EXCLUDED = 1e-3
SURE = 0.95
MOST_FACTS = 10
SCALE_ROUNDS = 20
SURE_SCALE = 3.0  # half widths of its interval, from 0; a vaguer factor comes of samples that don't fit at all
LEAST_SCALE_ERROR = 2e-3
DIRECTIONS = ((False, False), (True, True), (True, False), (False, True))


@dataclass(frozen=True, eq=False)
class MethodAnswer(ByValue):
    """What a closed form answers, beside the likeliest.

    Attributes
    ----------
    X : (4, 4); None where the method fails
    apart_mm, apart_deg : from the likeliest hand-eye pose
    beyond : the greatest ratio of a difference in X's six numbers to half its 95 % interval
    """

    name: MethodName
    X: Reals | None
    apart_mm: float
    apart_deg: float
    beyond: float
    rms_mm: float
    rms_deg: float


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False, repr=False)
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
    without_suspects : (2,), m and rad: how far X moves if the samples taken out are left in; None if there are none
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
    methods: tuple[MethodAnswer, ...]
    directions: tuple[DirectionTried, ...]
    suspects: tuple[Suspect, ...]
    warnings: tuple[CalibrationWarning, ...]
    without_suspects: Reals | None
    touch: TouchCheck | None
    mismatch: Reals

    def sheet(self) -> Sheet:
        """The twelve numbers with half their 95 % intervals."""
        in_hand = self.samples.setup == "eye_in_hand"
        poses = ("T_flange_camera", "T_base_board") if in_hand else ("T_base_camera", "T_flange_board")
        rows = [
            (name, axis, 1000 * T[k, 3], 1000 * half[k], np.degrees(rpy_of(T)[k]), np.degrees(half[3 + k]))
            for name, T, half in zip(poses, (self.X, self.Y), self.half_width.reshape(2, 6))
            for k, axis in enumerate("xyz")
        ]
        shown, left_out = first_rows(rows, len(rows))
        columns = ("pose", "axis", "mm", "half_width_mm", "rpy_deg", "half_width_deg")
        found = [*self.suspects, *self.warnings]
        facts = tuple(shortly(each) for each in found[:MOST_FACTS])
        heading = f"Hand-eye calibration, {int(self.used.sum())} of {len(self.samples)} samples used"
        return Sheet(heading, columns, shown, left_out, facts)


def calibrate_hand_eye(samples: CalibrationSet) -> HandEye:
    """Estimate where camera and board are, with 95 % intervals, and judge every sample.

    Parameters
    ----------
    samples : three at least, whose motions turn about two directions

    Returns
    -------
    found : estimated by the likelihood of all samples but those that can't be right, which are named

    Raises
    ------
    HandEyeError
        where the samples leave hand-eye or board pose open
    """
    _check_determined(samples)
    angles = check_angles(samples)
    used = angles.used.copy()
    suspects: list[Suspect] = list(angles.found)
    greatest, apart = _check_determined(samples.take(used))
    refined = _fitted(samples.take(used))
    while used.sum() > 2 * LEAST_SAMPLES and (worst := worst_sample(samples.take(used), refined)):
        used[np.flatnonzero(used)[worst[0]]] = False
        suspects.append(worst[1])
        greatest, apart = _check_determined(samples.take(used))
        refined = _fitted(samples.take(used))
    kept = samples.take(used)
    warnings: list[CalibrationWarning] = [angles.warning] if angles.warning else []
    directions = directions_tried(kept, refined)
    warnings += _warnings(kept, refined, greatest, apart, directions)
    half_width = scipy.special.stdtrit(refined.freedom, (1 + SURE) / 2) * np.sqrt(np.diag(refined.covariance))
    found = HandEye(
        samples=samples,
        used=used,
        X=refined.X,
        Y=refined.Y,
        covariance=refined.covariance,
        half_width=half_width,
        residual=residuals(samples.hand, samples.target, refined.X, refined.Y)[0],
        scatter=float(refined.scatter),
        deviations=refined.deviations,
        greatest_turn=greatest,
        axes_apart=apart,
        methods=tuple(_answer(name, kept, refined, half_width) for name in METHOD_NAMES),
        directions=directions,
        suspects=(*suspects, *repeated_poses(samples)),
        warnings=tuple(warnings),
        without_suspects=None if used.all() else _shift_with_all(samples, refined),
        touch=None,
        mismatch=angles.mismatch,
    )
    return found if samples.touched is None else replace(found, touch=_touch(found, samples.touched))


def start(F: Reals, B: Reals, deviations: Reals) -> tuple[Reals, Reals]:
    """The closed-form answer X, Y (4, 4) with the smallest residuals, in standard deviations (2,) in m and rad.

    Raises
    ------
    HandEyeError
        if no method has one
    """
    best: tuple[float, Reals, Reals] | None = None
    for name in METHOD_NAMES:
        try:
            X, Y = solved_by(name, F, B)
        except np.linalg.LinAlgError:
            continue
        if np.isfinite(X).all() and np.isfinite(Y).all():
            cost = float(np.sum((residuals(F, B, X, Y)[0] / np.repeat(deviations, 3)) ** 2))
            best = min(best or (np.inf, X, Y), (cost, X, Y), key=lambda each: each[0])
    if best is None:
        raise HandEyeError(NothingFits())
    return best[1], best[2]


def _fitted(samples: CalibrationSet) -> Refined:
    seen = PoseObservations(
        samples.setup, samples.hand, samples.target, samples.camera_covariance, samples.flange_covariance
    )
    try:
        found = refine(seen, *start(samples.hand, samples.target, np.array([1e-3, 5e-3])))
    except np.linalg.LinAlgError:
        raise HandEyeError(NothingFits()) from None
    if not np.isfinite(found.covariance).all() or (np.diag(found.covariance) <= 0).any():
        raise HandEyeError(NothingFits())
    return found


def _check_determined(samples: CalibrationSet) -> tuple[float, float]:
    """The greatest turn between two samples and how far the rotation axes leave one direction, rad."""
    if len(samples) < LEAST_SAMPLES:
        raise HandEyeError(TooFewSamples(len(samples), LEAST_SAMPLES))
    for stream in ("flange", "target"):
        poses = getattr(samples, stream)
        if np.abs(step_between(poses[:1], poses)).max() < EQUAL:
            raise HandEyeError(AllSamplesEqual(stream))  # type: ignore[arg-type]
    R = samples.hand[:, :3, :3]
    greatest = float(angles_between(R).max())
    if greatest < LEAST_TURN:
        raise HandEyeError(NoRotation(float(np.degrees(greatest))))
    i, j = np.triu_indices(len(samples), 1)
    turns = log_rotation(transposed(R[j]) @ R[i])
    _, size, axes = np.linalg.svd(turns, full_matrices=False)
    apart = float(np.arctan2(size[1], size[0]))
    if apart < LEAST_SPREAD:
        raise HandEyeError(ParallelTurns(tuple(axes[0].tolist()), float(np.degrees(apart))))
    return greatest, apart


def _warnings(
    samples: CalibrationSet,
    refined: Refined,
    greatest: float,
    apart: float,
    directions: tuple[DirectionTried, ...],
) -> list[CalibrationWarning]:
    found: list[CalibrationWarning] = []
    if greatest < LITTLE_TURN or apart < LITTLE_SPREAD:
        found.append(LittleMotion(float(np.degrees(greatest)), float(np.degrees(apart))))
    free = 6 * len(samples) - 12
    largest = float(np.sqrt(scipy.special.chdtri(free, EXCLUDED) / free))
    if samples.camera_covariance is not None and refined.scatter > largest:
        found.append(MoreScatter(float(refined.scatter), largest))
    if reading := other_reading(samples, refined.residual):
        return [*found, reading]
    if directions[0].status == "excluded":
        best = next(each for each in directions if each.status == "best")
        return [*found, OtherDirection(best.flange_inverted, best.target_inverted)]
    factor, half_width = board_scale(samples, refined)
    if abs(factor - 1) > max(2 * half_width, LEAST_SCALE_ERROR) and factor > SURE_SCALE * half_width:
        found.append(BoardScale(factor, half_width))
    return found


def board_scale(samples: CalibrationSet, refined: Refined) -> tuple[float, float]:
    """The factor by which distances seen have to grow to fit best, and half its 95 % interval."""
    X, Y, s = refined.X, refined.Y, 1.0
    weight = 1 / np.repeat(refined.deviations, 3)
    for _ in range(SCALE_ROUNDS):
        B = samples.target.copy()
        B[:, :3, 3] *= s
        raw, J = residuals(samples.hand, B, X, Y)
        seen = np.concatenate([samples.target[:, :3, 3], np.zeros((len(B), 3))], axis=1)[..., None]
        J = (np.concatenate([J, seen], axis=2) * weight[:, None]).reshape(-1, 13)
        r = (raw * weight).ravel()
        inverse = np.linalg.pinv(J.T @ J)
        step = -inverse @ (J.T @ r)
        X, Y, s = moved(X, step[:6]), moved(Y, step[6:12]), float(s + step[12])
        if np.abs(step).max() < 1e-10:
            break
    free = len(r) - 13
    scatter = np.sqrt(r @ r / max(free, 1))
    return s, float(scipy.special.stdtrit(max(free, 1), (1 + SURE) / 2) * scatter * np.sqrt(inverse[12, 12]))


def _answer(name: MethodName, samples: CalibrationSet, refined: Refined, half_width: Reals) -> MethodAnswer:
    try:
        X, Y = solved_by(name, samples.hand, samples.target)
    except np.linalg.LinAlgError:
        X, Y = np.full((4, 4), np.nan), np.full((4, 4), np.nan)
    if not (np.isfinite(X).all() and np.isfinite(Y).all()):
        return MethodAnswer(name, None, np.inf, np.inf, np.inf, np.inf, np.inf)
    step = step_between(refined.X, X)
    raw = residuals(samples.hand, samples.target, X, Y)[0]
    return MethodAnswer(
        name=name,
        X=X,
        apart_mm=float(1000 * np.linalg.norm(step[:3])),
        apart_deg=float(np.degrees(np.linalg.norm(step[3:]))),
        beyond=float((np.abs(step) / half_width[:6]).max()),
        rms_mm=float(1000 * np.sqrt((raw[:, :3] ** 2).mean())),
        rms_deg=float(np.degrees(np.sqrt((raw[:, 3:] ** 2).mean()))),
    )


def directions_tried(samples: CalibrationSet, refined: Refined) -> tuple[DirectionTried, ...]:
    """The four ways to take the two streams, as given first, judged by their residuals in equal standard deviations.

    Both streams inverted is the problem as given with X and Y swapped, F^-1 Y B^-1 = X, so that no residual tells
    the two apart; inverting a single stream makes another problem.
    """
    sigma = refined.deviations
    free = 6 * len(samples) - 12
    found: list[tuple[float, Reals | None]] = []
    for flange_inverted, target_inverted in DIRECTIONS:
        F = inverted(samples.hand) if flange_inverted else samples.hand
        B = inverted(samples.target) if target_inverted else samples.target
        raw = _residuals_of(F, B, sigma)
        found.append((np.inf if raw is None else float(np.sum((raw / np.repeat(sigma, 3)) ** 2)), raw))
    costs = np.array([cost for cost, _ in found])
    best = int(costs.argmin())
    twin = best ^ 1  # both streams the other way round
    directions = []
    for k, ((flange_inverted, target_inverted), (cost, raw)) in enumerate(zip(DIRECTIONS, found)):
        probability = float(scipy.special.fdtrc(free, free, cost / costs[best])) if np.isfinite(cost) else 0.0
        status: DirectionStatus = "excluded" if probability < EXCLUDED else "open"
        status = {best: "best", twin: "same_problem"}.get(k, status)  # type: ignore[assignment]
        rms = [None, None] if raw is None else [float(np.sqrt((raw[:, part] ** 2).mean())) for part in _PARTS]
        directions.append(
            DirectionTried(
                flange_inverted,
                target_inverted,
                status,
                None if rms[0] is None else 1000 * rms[0],
                None if rms[1] is None else float(np.degrees(rms[1])),
                probability,
            )
        )
    return tuple(directions)


_PARTS = (slice(3), slice(3, 6))


def _residuals_of(F: Reals, B: Reals, sigma: Reals) -> Reals | None:
    covariance = np.broadcast_to(np.diag(np.repeat(sigma, 3) ** 2), (len(F), 6, 6))
    try:
        found = refine(PoseObservations("eye_in_hand", F, B, covariance), *start(F, B, sigma))
    except (np.linalg.LinAlgError, HandEyeError):
        return None
    return found.residual


def _shift_with_all(samples: CalibrationSet, refined: Refined) -> Reals:
    step = step_between(refined.X, _fitted(samples).X)
    return np.array([np.linalg.norm(step[:3]), np.linalg.norm(step[3:])])


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


def board_poses(found: HandEye) -> Reals:
    """Where each sample puts the board: F X B (N, 4, 4), all equal to Y without errors."""
    poses: Reals = found.samples.hand @ found.X @ found.samples.target
    return poses


def spread_of(found: HandEye) -> tuple[float, float]:
    """Root mean square distance (m) and angle (rad) of the samples' board poses from their mean, of those used."""
    poses = board_poses(found)[found.used]
    step = step_between(mean_pose(poses), poses)
    size = [np.linalg.norm(step[:, part], axis=1) for part in _PARTS]
    return float(np.sqrt((size[0] ** 2).mean())), float(np.sqrt((size[1] ** 2).mean()))
