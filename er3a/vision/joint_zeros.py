"""A joint whose zero is off: the cause that explains samples which contradict a calibration, if one joint does.

To the twelve numbers of both poses comes one: how far a joint is from its recorded values. Each joint is tried, and the
one that lowers the residuals most is named if chance hardly does so.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from er3a.calibration.parameters import DEPENDENT
from er3a.geometry.transforms import inverse_right_jacobian, inverted, step_between
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.robots.joint_limits import joint_names
from er3a.robots.robot import Robot
from er3a.vision import likelihood
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.hand_eye import HandEye, calibrate_hand_eye
from er3a.vision.vision_findings import HandEyeError, JointZero, grave_warnings

ZERO_CHANCE = 1e-4  # of sound sets in which a zero is called wrong
MIN_ZERO = np.radians(0.5)
ZERO_STEP = 1e-5


def zeros_tried(found: HandEye, robot: Robot) -> tuple[HandEye, tuple[str, ...], float]:
    """A calibration whose warnings name the joint with a wrong zero, if one explains all that contradicts it.

    A zero is named if its value is more than chance, and nothing serious contradicts the samples with it.

    Returns
    -------
    found, unseen : names of joints whose zero the samples don't tell from the two poses: all where no joint values are
        recorded, those that slide, and mostly the first and the last
    smallest : deg; a wrong zero of another joint is named if it is at least this large; 0 if there are no others
    """
    names, q = joint_names(robot), found.samples.q
    if q is None:
        return found, names, 0.0
    samples = found.samples.take(found.used)
    before = likelihood.refine(likelihood.PoseObservations.of(samples), found.X, found.Y)
    free = 6 * len(samples) - likelihood.UNKNOWNS - 1
    best, unseen = (1.0, 0, 0.0, 0.0, np.inf), []
    smallest, sure = 0.0, (1 + likelihood.CONFIDENCE) / 2
    widths = float(scipy.special.stdtrit(free, 1 - ZERO_CHANCE / len(names) / 2) / scipy.special.stdtrit(free, sure))
    for k, name in enumerate(names):
        turn = _Turned(robot, samples, k)
        if robot.slides[k] or not turn.seen(found.X, found.Y):
            unseen.append(name)
            continue
        seen = likelihood.PoseObservations.of(samples)
        fit = likelihood.refine(seen, before.X, before.Y, turn.at, 1, before.W)
        value, half_width = float(fit.values[0]), float(fit.half_width[likelihood.UNKNOWNS])
        smallest = max(smallest, round(float(np.degrees(max(MIN_ZERO, widths * half_width))), 2))
        gain = max(before.squares - fit.squares, 0.0) / (fit.squares / free)
        chance = float(scipy.special.fdtrc(1, free, gain)) * len(names)
        rms = float(1000 * np.sqrt((fit.residual[:, :3] ** 2).mean()))
        best = min(best, (chance, k, value, half_width, rms))
    chance, k, value, half_width, rms = best
    explained = {each.code for each in grave_warnings(found.warnings)} <= EXPLAINED_BY_A_ZERO
    if chance > ZERO_CHANCE or abs(value) < MIN_ZERO or not explained:
        return found, tuple(unseen), smallest
    mended = _Turned(robot, found.samples, k).flange(value)
    try:
        again = calibrate_hand_eye(replace(found.samples, flange=mended))
    except HandEyeError:
        return found, tuple(unseen), smallest
    if grave_warnings(again.warnings):
        return found, tuple(unseen), smallest
    given = float(1000 * np.sqrt((found.residual[found.used, :3] ** 2).mean()))
    zero = JointZero(k + 1, float(np.degrees(value)), float(np.degrees(half_width)), given, rms)
    others = tuple(each for each in found.warnings if each.code not in EXPLAINED_BY_A_ZERO)
    return replace(found, warnings=(zero, *others)), tuple(unseen), smallest


EXPLAINED_BY_A_ZERO = {
    *("board_scale", "focal_length", "principal_point", "unexplained_residuals", "moved_between", "more_scatter")
}


@dataclass(frozen=True, eq=False)
class _Turned:
    """Samples whose joint k, from 0, is off its recorded values."""

    robot: Robot
    samples: CalibrationSet
    k: int

    def flange(self, value: float) -> Reals:
        """T_base_flange (N, 4, 4) with this many rad more."""
        return forward(self.robot.without_tool(), self.samples.q + value * np.eye(self.robot.joints)[self.k])

    def at(self, X: Reals, Y: Reals, values: Reals) -> tuple[Reals, Reals]:
        """Residuals and their derivatives, as :data:`er3a.vision.likelihood.Model`."""
        value, setup = float(values[0]), self.samples.setup
        flange = self.flange(value)
        F = flange if setup == "eye_in_hand" else inverted(flange)
        raw, J = likelihood.residuals(F, self.samples.target, X, Y)
        shift = step_between(self.flange(value - ZERO_STEP), self.flange(value + ZERO_STEP)) / (2 * ZERO_STEP)
        own = -np.einsum("nij,nj->ni", likelihood.flange_to_camera(setup, F, X, Y), shift)
        own[:, 3:] = np.einsum("nij,nj->ni", inverse_right_jacobian(raw[:, 3:]), own[:, 3:])
        return raw, np.concatenate([J, own[..., None]], axis=2)

    def seen(self, X: Reals, Y: Reals) -> bool:
        """Whether the zero moves the samples otherwise than the two poses do."""
        J = self.at(X, Y, np.zeros(1))[1].reshape(-1, likelihood.UNKNOWNS + 1)
        J, column = J[:, :-1], J[:, -1]
        left = column - J @ np.linalg.lstsq(J, column, rcond=None)[0]
        return bool(np.linalg.norm(left) > DEPENDENT * np.linalg.norm(column))
