"""Samples that can't be right: found without any calibration, by angles, and with one, by residuals.

Between two samples hand and board turn by equal angles, whatever the hand-eye pose, and whichever way round the
transforms are written [1]_. Samples are taken out, the one in most conflicts first, until all pairs left agree. For
each one taken out the turns that detectors mistake are tried. What is left over is judged by its residuals.

References
----------
.. [1] H. H. Chen, "A screw motion approach to uniqueness analysis of head-eye geometry", CVPR 1991.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from er3a.by_value import ByValue
from er3a.geometry.transforms import rotation_angle
from er3a.numerics.arrays import Flags, Reals
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.likelihood import Refined
from er3a.vision.tangent import step_between, transposed
from er3a.vision.vision_findings import (
    FarFromFit,
    NoMajority,
    RepeatedPose,
    RotationMismatch,
    SuspectKind,
)

DEVIATIONS = 6.0  # of the angle between two samples; beyond, a pair is in conflict
MOST_DEVIATION = np.radians(2.0)  # of a camera that is of any use
ROUNDING = 1e-6  # rad
SAME_POSITION_M, SAME_ROTATION_RAD = 5e-5, 2e-4
FALSE_ALARMS = 0.01  # of sound sets in which a sample is called far from the fit
BOARD_TURNS: dict[SuspectKind, tuple[str, tuple[float, ...]]] = {  # axis of the board, and deg
    "half_turn_x": ("x", (180.0,)),
    "half_turn_y": ("y", (180.0,)),
    "half_turn_z": ("z", (180.0,)),
    "quarter_turn_z": ("z", (90.0, -90.0)),
}
MEND_KINDS: tuple[SuspectKind, ...] = (*BOARD_TURNS, "mirrored_tilt")


@dataclass(frozen=True, eq=False)
class AngleCheck(ByValue):
    """What the turning angles tell.

    Attributes
    ----------
    mismatch : (N, N), rad, by how much hand and board differ in how far they turn
    tolerance : rad, beyond which a pair is in conflict
    used : (N,), samples whose pairs all agree
    """

    mismatch: Reals
    tolerance: float
    used: Flags
    found: tuple[RotationMismatch, ...]
    warning: NoMajority | None


def angles_between(R: Reals) -> Reals:
    """Angles (N, N) in rad between rotations (N, 3, 3)."""
    return rotation_angle(R[:, None], R[None])


def check_angles(samples: CalibrationSet) -> AngleCheck:
    """Find samples whose turning angles contradict the others'."""
    hand, eye = samples.flange[:, :3, :3], samples.target[:, :3, :3]
    turned = angles_between(hand)
    mismatch = np.abs(turned - angles_between(transposed(eye)))
    upper = np.triu_indices(len(samples), 1)
    tolerance = _tolerance(samples, mismatch[upper])
    used = _agreeing(mismatch > tolerance)
    if used.sum() <= len(samples) / 2:
        conflict = mismatch[upper] > tolerance
        warning = NoMajority(int(conflict.sum()), len(conflict), float(np.degrees(np.median(mismatch[upper]))))
        return AngleCheck(mismatch, tolerance, np.ones(len(samples), bool), (), warning)
    found = tuple(
        RotationMismatch(
            samples.names[i],
            _mending_turn(samples.target, turned, int(i), used, tolerance),
            float(np.degrees(np.median(mismatch[i, used]))),
        )
        for i in np.flatnonzero(~used)
    )
    return AngleCheck(mismatch, tolerance, used, found, None)


def _tolerance(samples: CalibrationSet, mismatch: Reals) -> float:
    """Half of the mismatches of sound pairs lie below 0.674 standard deviations."""
    deviation = min(float(np.median(mismatch)) / 0.674, MOST_DEVIATION)
    if samples.camera_covariance is not None:
        stated = np.linalg.eigvalsh(samples.camera_covariance[:, 3:, 3:])[:, -1].mean()
        if samples.flange_covariance is not None:
            stated += np.linalg.eigvalsh(samples.flange_covariance[3:, 3:])[-1]
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


def _mending_turn(target: Reals, turned: Reals, i: int, used: Flags, tolerance: float) -> SuspectKind:
    best = tolerance
    mending: SuspectKind = "rotation"
    for kind in MEND_KINDS:
        for R in _mended(target[i], kind):
            angle = rotation_angle(transposed(R)[None], transposed(target[used, :3, :3]))
            off = float(np.median(np.abs(angle - turned[i, used])))
            if off < best:
                best, mending = off, kind
    return mending


def _mended(T: Reals, kind: SuspectKind) -> list[Reals]:
    """The rotations (3, 3) that a detection may have been mistaken for."""
    R = T[:3, :3]
    if kind == "mirrored_tilt":
        sight = T[:3, 3] / max(float(np.linalg.norm(T[:3, 3])), 1e-12)
        away = np.eye(3) - 2 * np.outer(sight, sight)
        return [away @ R @ np.diag([1.0, 1.0, -1.0])]
    axis, turns = BOARD_TURNS[kind]
    return [R @ scipy.spatial.transform.Rotation.from_euler(axis, turn, degrees=True).as_matrix() for turn in turns]


def worst_sample(samples: CalibrationSet, refined: Refined) -> tuple[int, FarFromFit] | None:
    """The sample whose residuals are too large beside those of all others; None if there is none.

    Each sample's six residuals, with the share that it pulls towards itself taken back, over the others' scatter are
    distributed as F with 6 and the remaining degrees of freedom. What is within stated deviations is not too large,
    however little the others scatter.
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
    return worst, FarFromFit(samples.names[worst], float(off_mm), float(off_deg), float(probability[worst]))


def repeated_poses(samples: CalibrationSet) -> tuple[RepeatedPose, ...]:
    """Samples taken where the flange had been before."""
    found = []
    for i in range(1, len(samples)):
        step = step_between(np.broadcast_to(samples.flange[i], (i, 4, 4)), samples.flange[:i])
        near = (np.linalg.norm(step[:, :3], axis=1) < SAME_POSITION_M) & (
            np.linalg.norm(step[:, 3:], axis=1) < SAME_ROTATION_RAD
        )
        if near.any():
            first = int(near.argmax())
            seen = step_between(samples.target[first], samples.target[i])
            apart_mm, apart_deg = 1000 * np.linalg.norm(seen[:3]), np.degrees(np.linalg.norm(seen[3:]))
            found.append(RepeatedPose(samples.names[i], samples.names[first], float(apart_mm), float(apart_deg)))
    return tuple(found)
