"""Typical causes of samples that no pose of camera and board explains: each a change of all samples by a few numbers.

- *distances*: a board of another size, and a camera with other intrinsics. Each moves the board's position seen at p to
  p + v D p, with one matrix D (3, 3) and one unknown value v. With a wrong focal length the board is seen at the right
  place across the camera's axis and at a wrong distance along it; a wrong principal point shifts it across by a share
  of that distance. What either does to the board's tilt is left out, which detectors get mostly from how its outline is
  foreshortened.
- *steps*: from one sample on, camera or board are elsewhere; six numbers.
- *zeros*: a joint is off its recorded values by a fixed angle.

All are judged alike: the numbers are fitted beside the twelve of both poses, and the drop of the sum of squares is
distributed as F with as many and the remaining degrees of freedom. The probability is that of the best of all that were
tried.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import scipy

from er3a.by_value import by_identity
from er3a.calibration.parameters import DEPENDENT
from er3a.finding import Finding, fact
from er3a.geometry.transforms import inverted, moved, step_between
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.robots.joint_limits import joint_names
from er3a.robots.robot import Robot
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.likelihood import (
    CONFIDENCE,
    GROUPS,
    START_DEVIATIONS,
    UNKNOWNS,
    Refined,
    refine,
    residuals,
)

STEP = 1e-5  # of numbers, for derivatives
AS_GOOD = float(scipy.special.chdtri(1, 1 - CONFIDENCE))  # by which chance alone makes two causes differ
OPEN_RATIO = float(scipy.special.chdtri(1, 0.01))  # chance reaches it in one of 100 sets
SURE_RATIO = 16.0  # chance reaches it in one of 10 000 sets
LEAST_SAMPLES = 6  # of which the noise can be told from such an error
SURE_SCALE = 5.0  # half widths of its interval, from 0; a vaguer factor comes of samples that don't fit at all
MIN_SCALE_ERROR = 2e-3
MIN_SHIFT = 5e-3  # of the focal length; smaller ones look like the camera turned, and errors of tables reach them
STEP_CHANCE = 3e-5  # of sound sets in which a step is found
MIN_BLOCK = 2  # samples on either side of a step
MIN_STEP = 1e-9  # m, rad; less is rounding, of poses that a simulation gives without errors
ZERO_CHANCE = 1e-4  # of sound sets in which a zero is called wrong
MIN_ZERO = np.radians(0.5)  # below which a joint's zero is not named


@by_identity
class TypicalCause:
    """A change of all samples.

    Attributes
    ----------
    count : of its numbers; 0 change nothing
    applied : from the numbers (count,) to F and B (N, 4, 4) of the samples, see :mod:`er3a.vision.classic_methods`
    """

    count: int
    applied: Callable[[Reals], tuple[Reals, Reals]]

    def at(self, X: Reals, Y: Reals, values: Reals) -> tuple[Reals, Reals]:
        """Residuals and their derivatives, as :data:`er3a.vision.likelihood.Model`.

        Parameters
        ----------
        X, Y : (4, 4), m, hand-eye and board pose
        values : (count,), of the cause's numbers

        Returns
        -------
        residual, derivative : (N, 6), m and rad, and (N, 6, 12 + count); by the numbers from central differences
        """

        def raw(values: Reals) -> tuple[Reals, Reals]:
            return residuals(*self.applied(values), X, Y)

        steps = STEP * np.eye(self.count)
        own = [(raw(values + step)[0] - raw(values - step)[0]) / (2 * STEP) for step in steps]
        here, J = raw(values)
        return here, np.concatenate([J, np.stack(own, axis=2)], axis=2)

    def fitted(self, samples: CalibrationSet, start: Refined, W: Reals) -> Refined:
        """The fit of both poses and the cause's numbers.

        Parameters
        ----------
        start : a fit of the poses alone, whose poses are the start
        W : (N, 6, 6), weights to keep, 1/m and 1/rad

        Returns
        -------
        fit : its ``values`` (count,) are the cause's numbers

        Raises
        ------
        LinAlgError
            where the samples leave some of the unknowns open
        """
        return refine(samples, start.X, start.Y, self.at, self.count, W)

    def drop(self, refined: Refined) -> float | None:
        """By how much the numbers lower the sum of squares of a fit, to first order.

        Parameters
        ----------
        refined : the fit of the poses alone, with its whitened residuals

        Returns
        -------
        drop : None where the samples can't distinguish the numbers from the two poses
        """
        J = (refined.W @ self.at(refined.X, refined.Y, np.zeros(self.count))[1]).reshape(-1, UNKNOWNS + self.count)
        poses, own = J[:, :UNKNOWNS], J[:, UNKNOWNS:]
        rest = own - poses @ np.linalg.lstsq(poses, own, rcond=None)[0]
        axes, sizes, _ = np.linalg.svd(rest, full_matrices=False)
        if sizes[-1] < DEPENDENT * np.linalg.norm(own, axis=0).max():
            return None
        return float(((refined.whitened.ravel() @ axes) ** 2).sum())


def chance_of(drop: float, count: int, squares: float, free: int, least: float = 1e-300) -> float:
    """Probability that some numbers lower a sum of squares by as much by chance, by the F distribution.

    Parameters
    ----------
    drop : of the sum of squares
    count : of the numbers
    squares : before the numbers were fitted
    free : degrees of freedom of what remains
    least : variance of a residual, if it is stated

    Returns
    -------
    probability : 0 to 1
    """
    scale = max((squares - drop) / free, least)
    return float(scipy.special.fdtrc(count, free, max(drop, 0.0) / count / scale))


# Distances ------------------------------------------------------------------------------------------------------------


def _matrix(*entries: tuple[int, int]) -> Reals:
    D = np.zeros((3, 3))
    D[tuple(np.array(entries).T)] = 1.0
    return D


FACTORS = "board_scale", "focal_length"
MATRICES: dict[str, Reals] = {
    "board_scale": np.eye(3),
    "focal_length": _matrix((2, 2)),
    "principal_point_x": _matrix((0, 2)),
    "principal_point_y": _matrix((1, 2)),
}
"""D of each."""


@by_identity
class DistanceFit:
    """An error of distances that the samples don't exclude, and their fit with it.

    Attributes
    ----------
    sure : whether chance does not explain it, so that it is named
    """

    finding: Finding
    refined: Refined
    sure: bool


def wrong_distances(samples: CalibrationSet, refined: Refined) -> tuple[DistanceFit, ...]:
    """Errors of distances that lower the residuals as those of 1 of 100 sound sets do, or more.

    All of them widen the intervals of the poses, because the samples do not exclude them. Of those that chance does not
    explain the ones that explain the samples best are sure.

    Parameters
    ----------
    refined : the fit of the samples without such an error

    Returns
    -------
    fits : empty for fewer than ``LEAST_SAMPLES`` samples
    """
    if len(samples) < LEAST_SAMPLES:
        return ()
    plain, found = refine(samples, refined.X, refined.Y, W=_alike(samples)), []
    free = plain.whitened.size - UNKNOWNS - 1
    for name in MATRICES:
        fit = fitted_distances(name, samples, refined)
        value, (own, shared) = float(fit.values[0]), half_widths(name, samples, refined, fit)
        half_width = float(np.hypot(own, shared))
        ratio = (plain.squares - fit.squares) / (fit.squares / free)  # F with 1 and ``free`` degrees of freedom
        sure = ratio > SURE_RATIO and abs(value) > max(own, 2 * shared) and _is_large(value, half_width, name)
        if ratio > OPEN_RATIO:
            found.append(DistanceFit(_finding(name, value, half_width), fit, sure))
    most = min((each.refined.squares for each in found if each.sure), default=0.0) * (1 + AS_GOOD / free)
    return tuple(replace(each, sure=each.sure and each.refined.squares <= most) for each in found)


def _finding(name: str, value: float, half_width: float) -> Finding:
    if name in FACTORS:
        return fact(name, factor=1 + value, half_width=half_width)
    return fact("principal_point", axis=name[-1], percent=100 * value, half_width_percent=100 * half_width)


def _is_large(value: float, half_width: float, name: str) -> bool:
    factor, least = (1 + value, MIN_SCALE_ERROR) if name in FACTORS else (1.0, MIN_SHIFT)
    return abs(value) > least and factor > SURE_SCALE * half_width


def half_widths(name: str, samples: CalibrationSet, refined: Refined, fit: Refined) -> tuple[float, float]:
    """Half the 95 % intervals of a distance error, by its two sources.

    Parameters
    ----------
    refined : the fit of the poses alone
    fit : the fit with the distance error

    Returns
    -------
    own, shared : shares of 1, by the samples, and by intrinsics estimated from the same images, which all share
    """
    own = float(fit.half_width[UNKNOWNS])
    if samples.shared is None:
        return own, 0.0
    shifted = (replace(samples, target=moved(samples.target, error)) for error in np.moveaxis(samples.shared, 2, 0))
    shifts = [fitted_distances(name, each, refined).values[0] - fit.values[0] for each in shifted]
    return own, float(scipy.special.ndtri((1 + CONFIDENCE) / 2) * np.linalg.norm(shifts))


def fitted_distances(name: str, samples: CalibrationSet, refined: Refined) -> Refined:
    """The fit of both poses with an error of distances.

    Parameters
    ----------
    name : what is wrong: the board's size, the focal length, or the principal point
    refined : the fit of the poses alone, where it starts

    Returns
    -------
    fit : ``values`` (1,), by what share distances are wrong
    """

    def applied(values: Reals) -> tuple[Reals, Reals]:
        B = samples.target.copy()
        B[:, :3, 3] += values[0] * samples.target[:, :3, 3] @ MATRICES[name].T
        return samples.hand, B

    return TypicalCause(1, applied).fitted(samples, refined, _alike(samples))


def _alike(samples: CalibrationSet) -> Reals:
    """Weights (N, 6, 6) by which all samples count alike: an error of distances makes the noise seem larger where it
    acts, and would be missed there."""
    return np.tile(np.diag(1 / START_DEVIATIONS[GROUPS]), (len(samples), 1, 1))


# Steps ----------------------------------------------------------------------------------------------------------------


def moved_between(samples: CalibrationSet, refined: Refined) -> Finding | None:
    """The likeliest step of camera or board, if chance does not explain it.

    Parameters
    ----------
    refined : the fit of all these samples

    Returns
    -------
    finding : from which sample on, by how many mm and deg; None if there is no such step
    """
    count = len(samples)
    free = 6 * count - UNKNOWNS - 6
    if count < 2 * MIN_BLOCK or free < 6:
        return None
    tried = [(what, at) for what in ("camera", "board") for at in range(MIN_BLOCK, count - MIN_BLOCK + 1)]
    drops = [_step_at(samples, *each).drop(refined) or 0.0 for each in tried]
    what, at = tried[int(np.argmax(drops))]
    fit = _step_at(samples, what, at).fitted(samples, refined, refined.W)
    least = 1e-300 if samples.camera_covariance is None else 1.0
    chance = chance_of(refined.squares - fit.squares, 6, refined.squares, free, least) * len(tried)
    pose = fit.X if what == "camera" else fit.Y
    step = step_between(pose, moved(np.eye(4), fit.values) @ pose)
    if chance >= STEP_CHANCE or np.linalg.norm(step) < MIN_STEP:
        return None
    distance, turn = 1000 * np.linalg.norm(step[:3]), np.degrees(np.linalg.norm(step[3:]))
    return fact(
        "moved_between",
        sample=samples.names[at],
        what=what,
        moved_mm=float(distance),
        moved_deg=float(turn),
        probability=chance,
    )


def _step_at(samples: CalibrationSet, what: str, at: int) -> TypicalCause:
    """A motion, about the origin of its parent frame, of camera or board before the sample ``at``."""

    def applied(values: Reals) -> tuple[Reals, Reals]:
        F, step = samples.hand.copy(), moved(np.eye(4), values)
        F[at:] = F[at:] @ step if what == "camera" else inverted(step) @ F[at:]
        return F, samples.target

    return TypicalCause(6, applied)


# Zeros ----------------------------------------------------------------------------------------------------------------


@by_identity
class ZerosTried:
    """What became of the zeros of joints.

    Attributes
    ----------
    zero : the one that is wrong, if one explains the samples; mended : these with it set right
    unseen : names of joints whose zero the samples don't tell from the two poses: all where no joint values are
        recorded, those that slide, and mostly the first and the last
    smallest : deg; a wrong zero of another joint is named if it is at least this large; 0 if there are no others
    """

    zero: Finding | None
    mended: CalibrationSet | None
    unseen: tuple[str, ...]
    smallest: float


def wrong_zero(samples: CalibrationSet, used: CalibrationSet, refined: Refined, robot: Robot) -> ZerosTried:
    """The joint whose zero explains samples that contradict a calibration.

    Parameters
    ----------
    used : those of the samples that the fit ``refined`` rests on

    Returns
    -------
    tried : the joint with its zero in deg, if one explains them; and which joints no sample shows
    """
    names = joint_names(robot)
    if samples.q is None:
        return ZerosTried(None, None, names, 0.0)
    free = 6 * len(used) - UNKNOWNS - 1
    best, unseen, smallest = (1.0, 0, refined), [], 0.0
    sure = (ZERO_CHANCE / len(names) / 2, (1 - CONFIDENCE) / 2)
    widths = float(np.divide(*(scipy.special.stdtrit(free, 1 - each) for each in sure)))
    for k, name in enumerate(names):
        cause = TypicalCause(1, partial(_turned, robot, used, k))
        if robot.slides[k] or cause.drop(refined) is None:
            unseen.append(name)
            continue
        fit = cause.fitted(used, refined, refined.W)
        smallest = max(smallest, round(float(np.degrees(max(MIN_ZERO, widths * fit.half_width[UNKNOWNS]))), 2))
        chance = chance_of(refined.squares - fit.squares, 1, refined.squares, free) * len(names)
        best = min(best, (chance, k, fit), key=lambda each: each[0])
    chance, k, fit = best
    if chance > ZERO_CHANCE or abs(fit.values[0]) < MIN_ZERO:
        return ZerosTried(None, None, tuple(unseen), smallest)
    given, other = (float(1000 * np.sqrt((each.residual[:, :3] ** 2).mean())) for each in (refined, fit))
    value, half_width = np.degrees([fit.values[0], fit.half_width[UNKNOWNS]]).tolist()
    zero = fact(
        "joint_zero", joint=k + 1, offset_deg=value, half_width_deg=half_width, rms_given_mm=given, rms_other_mm=other
    )
    mended = replace(samples, flange=_flange(robot, samples, k, float(fit.values[0])))
    return ZerosTried(zero, mended, tuple(unseen), smallest)


def _flange(robot: Robot, samples: CalibrationSet, k: int, value: float) -> Reals:
    """T_base_flange (N, 4, 4) with joint k, from 0, turned by this many rad more."""
    return forward(robot.without_tool(), samples.q + value * np.eye(robot.joints)[k])


def _turned(robot: Robot, samples: CalibrationSet, k: int, values: Reals) -> tuple[Reals, Reals]:
    flange = _flange(robot, samples, k, float(values[0]))
    return (flange if samples.setup == "eye_in_hand" else inverted(flange)), samples.target
