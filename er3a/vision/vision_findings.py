"""What hand-eye calibration finds: samples that don't fit, directions, motion that determines too little."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, get_args

from er3a.by_value import Finding
from er3a.errors import Er3aError

SuspectKind = Literal["half_turn_x", "half_turn_y", "half_turn_z", "quarter_turn_z", "mirrored_tilt", "rotation"]
"""Turns of the board, as detected, about its own axes that would mend a sample; ``mirrored_tilt``: the other of the two
poses in which a flat board looks alike; ``rotation``: none of these."""


class RotationMismatch(Finding):
    """Hand and board turn by different angles between this sample and the others; ``off_deg`` in the median."""

    sample: str
    kind: SuspectKind
    off_deg: float


class FarFromFit(Finding):
    """A sample is farther from what all others predict than their scatter allows, with this probability."""

    sample: str
    off_mm: float
    off_deg: float
    probability: float


Suspect = RotationMismatch | FarFromFit
"""Of single samples; both reject the sample."""


class NoMajority(Finding):
    """No more than half of the samples agree on how far hand and board turn; ``pairs`` of ``of`` differ."""

    pairs: int
    of: int
    median_deg: float


Streams = Literal["flange", "target", "both"]


Convention = Literal[
    "inverted",
    "transposed",
    "real_part_first",
    "real_part_last",
    "turning_axes",
    "abc",
    "zyz",
    "opengl",
    "to_optical",
    "from_optical",
]


class OtherConvention(Finding):
    """The samples fit if a stream, or both, are read by another convention; residuals as given, and so."""

    stream: Streams
    convention: Convention
    rms_given_mm: float
    rms_given_deg: float
    rms_other_mm: float
    rms_other_deg: float


class UnexplainedResiduals(Finding):
    """The residuals are larger than those of a camera of any use, and no convention explains them."""

    rms_mm: float
    rms_deg: float


class BoardScale(Finding):
    """The distances seen require a board larger by this factor, beyond its 95 % interval."""

    factor: float
    half_width: float


class FocalLength(Finding):
    """Distances along the camera's axis are larger by this factor, those across are right, as by a wrong focal length:
    the right one is about as many times as long."""

    factor: float
    half_width: float


class PrincipalPoint(Finding):
    """The board is seen shifted along the camera's ``axis``: the principal point is off by as many percent of the focal
    length, and too large where this is positive."""

    axis: Literal["x", "y"]
    percent: float
    half_width_percent: float


WrongDistances = BoardScale | FocalLength | PrincipalPoint


class LittleMotion(Finding):
    """The samples turn little: the largest angle between two, and of the rotation axes to their common direction."""

    greatest_turn_deg: float
    axes_apart_deg: float


class FewSamples(Finding):
    """Too few samples to judge one by the others, or to know their scatter well."""

    samples: int


class MoreScatter(Finding):
    """The residuals are larger than the stated standard deviations allow."""

    scatter: float
    largest: float


class MovedBetween(Finding):
    """From ``sample`` on the camera, or the board, is elsewhere: the set is of two setups.

    ``probability``: that chance makes such a step; 0 where one end of the set was left out and a step explains it.
    """

    sample: str
    what: Literal["camera", "board"]
    moved_mm: float
    moved_deg: float
    probability: float


class NotConverged(Finding):
    """The search for the likeliest poses, or for their intervals, does not end; what is given is where it stopped."""

    samples: int


class JointZero(Finding):
    """The samples fit if a joint is off its recorded value by ``offset_deg``, with half its 95 % interval."""

    joint: int
    offset_deg: float
    half_width_deg: float
    rms_given_mm: float
    rms_other_mm: float


CalibrationWarning = (
    NoMajority
    | OtherConvention
    | UnexplainedResiduals
    | BoardScale
    | FocalLength
    | PrincipalPoint
    | LittleMotion
    | FewSamples
    | MoreScatter
    | MovedBetween
    | NotConverged
    | JointZero
)


class TouchContradicts(Finding):
    """Touched points, held out of the calibration, are not where it puts them."""

    points: int
    largest_mm: float
    probability: float


MUCH_SCATTER = 3.0  # standard deviations: residuals so much larger than stated contradict what is stated
_GRAVE = (
    *(NoMajority, OtherConvention, UnexplainedResiduals, MovedBetween, NotConverged, JointZero),
    *get_args(WrongDistances),
)


def grave_warnings(warnings: Iterable[CalibrationWarning]) -> tuple[CalibrationWarning, ...]:
    """Warnings with which no calibration can be used.

    Parameters
    ----------
    warnings : of a calibration

    Returns
    -------
    grave : in the given order; more scatter than stated is one above ``MUCH_SCATTER``
    """
    return tuple(
        each
        for each in warnings
        if isinstance(each, _GRAVE) or (isinstance(each, MoreScatter) and each.scatter > MUCH_SCATTER)
    )


class TooFewSamples(Finding):
    """Hand-eye calibration needs three samples at least."""

    samples: int
    needed: int


class AllSamplesEqual(Finding):
    """The flange never moved, or the board never did."""

    stream: Literal["flange", "target"]


class ParallelTurns(Finding, code="parallel_axes"):
    """All motions turn about one direction (by the flange's axes at a sample), so that the shift along it is open."""

    axis: tuple[float, float, float]
    spread_deg: float


class NoRotation(Finding):
    """The flange moves but does not turn, so that the camera's position is open."""

    greatest_turn_deg: float


class NothingFits(Finding):
    """The search for the likeliest poses does not end: the two streams don't belong together."""


NotCalibratable = TooFewSamples | AllSamplesEqual | ParallelTurns | NoRotation | NothingFits


class HandEyeError(Er3aError):
    """Samples don't determine hand-eye and board pose; see ``finding``."""

    def __init__(self, finding: NotCalibratable):
        self.finding = finding
        super().__init__(f"no hand-eye calibration ({finding.code.replace('_', ' ')})")


GraspOutcome = Literal["grasped", "not graspable"]
