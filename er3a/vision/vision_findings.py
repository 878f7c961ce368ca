"""What hand-eye calibration finds: samples that don't fit, directions, motion that determines too little."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from er3a.errors import Er3aError
from er3a.finding import Finding, is_one

SuspectKind = Literal["half_turn_x", "half_turn_y", "half_turn_z", "quarter_turn_z", "mirrored_tilt", "rotation"]
"""Turns of the board, as detected, about its own axes that would mend a sample; ``mirrored_tilt``: the other of the two
poses in which a flat board looks alike; ``rotation``: none of these."""


Suspect = Finding
"""Of single samples; both reject the sample."""


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


WrongDistances = Finding


CalibrationWarning = Finding


MUCH_SCATTER = 3.0  # standard deviations: residuals so much larger than stated contradict what is stated
_GRAVE = (
    *("no_majority", "other_convention", "unexplained_residuals", "moved_between", "not_converged", "joint_zero"),
    *("board_scale", "focal_length", "principal_point"),
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
        if is_one(each, *_GRAVE) or (is_one(each, "more_scatter") and each.scatter > MUCH_SCATTER)
    )


NotCalibratable = Finding


class HandEyeError(Er3aError):
    """Samples don't determine hand-eye and board pose; see ``finding``."""

    def __init__(self, finding: NotCalibratable):
        self.finding = finding
        super().__init__(f"no hand-eye calibration ({finding.code.replace('_', ' ')})")


GraspOutcome = Literal["grasped", "not graspable"]
