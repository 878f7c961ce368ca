"""Errors of distances that all samples share: a board of another size, and a camera with other intrinsics.

Each moves the board's position seen at p to p + v D p, with one matrix D (3, 3) and one unknown value v. With a wrong
focal length the board is seen at the right place across the camera's axis and at a wrong distance along it. A wrong
principal point shifts it across by a share of that distance. What either does to the board's tilt is left out, which
detectors get mostly from how its outline is foreshortened.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy

from er3a.geometry.transforms import moved
from er3a.numerics.arrays import Reals
from er3a.vision import vision_findings
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.likelihood import (
    CONFIDENCE,
    GROUPS,
    START_DEVIATIONS,
    UNKNOWNS,
    PoseObservations,
    Refined,
    refine,
    residuals,
)

AS_GOOD = float(scipy.special.chdtri(1, 1 - CONFIDENCE))  # by which chance alone makes two causes differ
SURE_RATIO = 16.0  # chance reaches it in one of 10 000 sets
LEAST_SAMPLES = 6  # of which the noise can be told from such an error
SURE_SCALE = 5.0  # half widths of its interval, from 0; a vaguer factor comes of samples that don't fit at all
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


@dataclass(frozen=True, eq=False)
class DistanceFit:
    """An error of distances, and the samples' fit with it."""

    finding: vision_findings.WrongDistances
    refined: Refined


def wrong_distances(samples: CalibrationSet, refined: Refined) -> tuple[DistanceFit, ...]:
    """The errors that explain the residuals best, of those that chance does not explain."""
    if len(samples) < LEAST_SAMPLES:
        return ()
    seen, W = PoseObservations.of(samples), np.tile(np.diag(1 / START_DEVIATIONS[GROUPS]), (len(samples), 1, 1))
    plain, found = refine(seen, refined.X, refined.Y, W=W), []
    free = plain.whitened.size - UNKNOWNS - 1
    for name in MATRICES:
        fit = fitted_distances(name, samples, refined)
        value, (own, shared) = float(fit.values[0]), _half_widths(name, samples, refined, fit)
        half_width = float(np.hypot(own, shared))
        ratio = (plain.squares - fit.squares) / (fit.squares / free)  # F with 1 and ``free`` degrees of freedom
        if ratio > SURE_RATIO and abs(value) > max(own, 2 * shared) and _is_large(value, half_width, name):
            found.append(DistanceFit(_finding(name, value, half_width), fit))
    least = min((each.refined.squares for each in found), default=0.0)
    return tuple(each for each in found if each.refined.squares <= least * (1 + AS_GOOD / free))


def _finding(name: DistanceError, value: float, half_width: float) -> vision_findings.WrongDistances:
    if name == "board":
        return vision_findings.BoardScale(1 + value, half_width)
    if name == "focal_length":
        return vision_findings.FocalLength(1 + value, half_width)
    axis: Literal["x", "y"] = "x" if name == "principal_point_x" else "y"
    return vision_findings.PrincipalPoint(axis, 100 * value, 100 * half_width)


def _is_large(value: float, half_width: float, name: DistanceError) -> bool:
    factor, least = (1 + value, MIN_SCALE_ERROR) if name in ("board", "focal_length") else (1.0, MIN_SHIFT)
    return abs(value) > least and factor > SURE_SCALE * half_width


def board_scale(samples: CalibrationSet, refined: Refined) -> tuple[float, float]:
    """The factor by which distances seen have to grow to fit best, and half its 95 % interval.

    Errors that all samples share count too: a focal length estimated from the same images scales all distances.
    """
    fit = fitted_distances("board", samples, refined)
    return 1 + float(fit.values[0]), float(np.hypot(*_half_widths("board", samples, refined, fit)))


def _half_widths(name: DistanceError, samples: CalibrationSet, refined: Refined, fit: Refined) -> tuple[float, float]:
    """Half the 95 % intervals of a value: by its samples, and by intrinsics estimated from the same images."""
    own = float(fit.half_width[UNKNOWNS])
    if samples.shared is None:
        return own, 0.0
    shifted = (replace(samples, target=moved(samples.target, error)) for error in np.moveaxis(samples.shared, 2, 0))
    shifts = [fitted_distances(name, each, refined).values[0] - fit.values[0] for each in shifted]
    return own, float(scipy.special.ndtri((1 + CONFIDENCE) / 2) * np.linalg.norm(shifts))


def fitted_distances(name: DistanceError, samples: CalibrationSet, refined: Refined) -> Refined:
    """The fit with an error of distances.

    All samples weigh alike: such an error makes the noise seem larger where it acts, and would be missed there.
    """
    seen = samples.target[:, :3, 3] @ MATRICES[name].T
    W = np.tile(np.diag(1 / START_DEVIATIONS[GROUPS]), (len(samples), 1, 1))

    def shifted(X: Reals, Y: Reals, values: Reals) -> tuple[Reals, Reals]:
        B = samples.target.copy()
        B[:, :3, 3] += values[0] * seen
        raw, J = residuals(samples.hand, B, X, Y)
        own = np.concatenate([seen, np.zeros_like(seen)], axis=1)
        return raw, np.concatenate([J, own[..., None]], axis=2)

    return refine(PoseObservations.of(samples), refined.X, refined.Y, shifted, 1, W)
