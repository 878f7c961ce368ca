"""What hand-eye calibration finds: samples that don't fit, directions, motion that determines too little."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from er3a.errors import Er3aError
from er3a.finding import Finding, is_one

MUCH_SCATTER = 3.0  # standard deviations: residuals so much larger than stated contradict what is stated
_GRAVE = (
    *("no_majority", "other_convention", "unexplained_residuals", "moved_between", "not_converged", "joint_zero"),
    *("board_scale", "focal_length", "principal_point"),
)


def grave_warnings(warnings: Iterable[Finding]) -> tuple[Finding, ...]:
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


class HandEyeError(Er3aError):
    """Samples don't determine hand-eye and board pose; see ``finding``."""

    def __init__(self, finding: Finding):
        self.finding = finding
        super().__init__(f"no hand-eye calibration ({finding.code.replace('_', ' ')})")


GraspOutcome = Literal["grasped", "not graspable"]
