"""Errors of distances that all samples share: a board of another size, and a camera with other intrinsics.

Each moves the board's position seen at p to p + v D p, with one matrix D (3, 3) and one unknown value v. With a wrong
focal length the board is seen at the right place across the camera's axis and at a wrong distance along it. A wrong
principal point shifts it across by a share of that distance. What either does to the board's tilt is left out, which
detectors get mostly from how its outline is foreshortened.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
import scipy

from er3a.geometry.transforms import moved
from er3a.numerics.arrays import Reals
from er3a.vision import vision_findings
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.likelihood import UNKNOWNS, Refined, residuals

CONFIDENCE = 0.95
EXTRA_ROUNDS = 20
SURE_SCALE = 3.0  # half widths of its interval, from 0; a vaguer factor comes of samples that don't fit at all
MIN_SCALE_ERROR = 2e-3
MIN_SHIFT = 5e-3  # of the focal length; smaller ones look like the camera turned, and errors of tables reach them

DistanceError = Literal["board", "focal_length", "principal_point_x", "principal_point_y"]


def _matrix(*entries: tuple[int, int]) -> Reals:
    D = np.zeros((3, 3))
    D[tuple(np.array(entries).T)] = 1.0
    return D


MATRICES: dict[DistanceError, Reals] = {
    "board": np.eye(3),
    "focal_length": _matrix((2, 2)),
    "principal_point_x": _matrix((0, 2)),
    "principal_point_y": _matrix((1, 2)),
}
"""D of each."""


def wrong_distances(samples: CalibrationSet, refined: Refined) -> vision_findings.WrongDistances | None:
    """The error that explains most of the residuals, of those that chance does not; None if there is none."""
    best: tuple[float, DistanceError, float, float] | None = None
    for name in MATRICES:
        value, half_width, left = _fitted(name, samples.target, samples, refined)
        if _is_sure(value, half_width, name) and (best is None or left < best[0]):
            best = left, name, value, half_width
    if best is None:
        return None
    _, name, value, half_width = best
    half_width = _with_shared(name, samples, refined, (value, half_width))
    if not _is_sure(value, half_width, name):
        return None
    if name == "board":
        return vision_findings.BoardScale(1 + value, half_width)
    if name == "focal_length":
        return vision_findings.FocalLength(1 + value, half_width)
    axis: Literal["x", "y"] = "x" if name == "principal_point_x" else "y"
    return vision_findings.PrincipalPoint(axis, 100 * value, 100 * half_width)


def _is_sure(value: float, half_width: float, name: DistanceError) -> bool:
    factor, least = (1 + value, MIN_SCALE_ERROR) if name in ("board", "focal_length") else (1.0, MIN_SHIFT)
    return abs(value) > max(2 * half_width, least) and factor > SURE_SCALE * half_width


def board_scale(samples: CalibrationSet, refined: Refined) -> tuple[float, float]:
    """The factor by which distances seen have to grow to fit best, and half its 95 % interval.

    Errors that all samples share count too: a focal length estimated from the same images scales all distances.
    """
    value, half_width, _ = _fitted("board", samples.target, samples, refined)
    return 1 + value, _with_shared("board", samples, refined, (value, half_width))


def _with_shared(name: DistanceError, samples: CalibrationSet, refined: Refined, found: tuple[float, float]) -> float:
    """Half the 95 % interval of a value, with errors of intrinsics that were estimated from the same images."""
    value, half_width = found
    if samples.shared is None:
        return half_width
    shifted = (moved(samples.target, error) for error in np.moveaxis(samples.shared, 2, 0))
    shifts = [_fitted(name, target, samples, refined)[0] - value for target in shifted]
    return float(np.hypot(half_width, scipy.special.ndtri((1 + CONFIDENCE) / 2) * np.linalg.norm(shifts)))


def _fitted(
    name: DistanceError, target: Reals, samples: CalibrationSet, refined: Refined
) -> tuple[float, float, float]:
    """The value for board poses (N, 4, 4), half its 95 % interval by their residuals, and the sum of squares left."""
    seen = np.concatenate([target[:, :3, 3] @ MATRICES[name].T, np.zeros((len(target), 3))], axis=1)

    def shifted(X: Reals, Y: Reals, value: float) -> tuple[Reals, Reals, Reals]:
        B = target.copy()
        B[:, :3, 3] += value * seen[:, :3]
        return *residuals(samples.hand, B, X, Y), seen

    value, half_width, raw = fit_extra_parameter(shifted, (refined.X, refined.Y), refined.deviations)
    return value, half_width, float(((raw / np.repeat(refined.deviations, 3)) ** 2).sum())


def fit_extra_parameter(
    at: Callable[[Reals, Reals, float], tuple[Reals, Reals, Reals]], poses: tuple[Reals, Reals], deviations: Reals
) -> tuple[float, float, Reals]:
    """One more unknown beside the twelve: its value, half its 95 % interval, and the residuals (N, 6) with it.

    ``at(X, Y, value)`` gives residuals (N, 6), their derivatives by the twelve (N, 6, 12), and by the value (N, 6).
    """
    (X, Y), value = poses, 0.0
    weight = 1 / np.repeat(deviations, 3)
    for _ in range(EXTRA_ROUNDS):
        raw, J, own = at(X, Y, value)
        J = (np.concatenate([J, own[..., None]], axis=2) * weight[:, None]).reshape(-1, UNKNOWNS + 1)
        r = (raw * weight).ravel()
        inverse = np.linalg.pinv(J.T @ J)
        step = -inverse @ (J.T @ r)
        X, Y, value = moved(X, step[:6]), moved(Y, step[6:12]), float(value + step[12])
        if np.abs(step).max() < 1e-10:
            break
    free = max(len(r) - UNKNOWNS - 1, 1)
    half_width = scipy.special.stdtrit(free, (1 + CONFIDENCE) / 2) * np.sqrt(r @ r / free * inverse[12, 12])
    return value, float(half_width), raw
