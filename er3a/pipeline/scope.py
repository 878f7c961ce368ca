"""What a stage checked, and of how much: a verdict is about this and about nothing else.

A stage names the checks that its question needs (``needs`` of its summary) and says of each what it covers. A pass
needs all of them in full. So what no check covers needs no name: it is no part of a verdict.

What a check rests on without a document, such as a speed assumed for a joint, is an :class:`Open` point of the
summary's ``assumed``: it lowers no verdict, and is said once.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

from er3a.by_value import frozen

Check = Literal[
    "table",
    "round_trips",
    "limits",
    "reach",
    "rates",
    "singularity",
    "self_collision",
    "scene_collision",
    "torque",
    "camera",
    "program_lines",
    "units",
]
GAPS: Mapping[str, Check] = {
    "unsettled": "table",
    "not_run": "reach",
    "limits_assumed": "limits",
    "not_followed": "reach",
    "points_missed": "reach",
    "tool_turned": "reach",
    "undecided_cells": "reach",
    "half_turns": "reach",
    "tray_inside": "reach",
    "rates_contradict": "rates",
    "uncovered_links": "self_collision",
    "partial_links": "self_collision",
    "bare_tool": "self_collision",
    "allowed_contacts": "self_collision",
    "wrong_shapes": "self_collision",
    "coarse_shapes": "self_collision",
    "base_inside": "self_collision",
    "no_scene": "scene_collision",
    "inside_solid": "scene_collision",
    "gripper": "scene_collision",
    "gravity": "torque",
    "program_loads": "torque",
    "no_torque_limits": "torque",
    "paths_not_run": "torque",
    "arm_errors": "camera",
    "out_of_view": "camera",
    "flange_frame": "camera",
    "base_frame": "camera",
    "intrinsics": "camera",
    "program_rest": "program_lines",
    "program_findings": "program_lines",
    "program_lines": "program_lines",
    "units": "units",
}
"""Reasons why a check does not cover all, and of which check each is."""

OF_MOTIONS: tuple[Check, ...] = ("reach", "rates", "program_lines")
"""What has to be known of a motion before anything else can be said of it."""
CHECKS_OF_MOTIONS: tuple[Check, ...] = (*OF_MOTIONS, "limits", "singularity")
"""What each motion of a path or program that is followed is checked for, but for collisions."""


@frozen
class Open:
    """A reason why a check does not cover all, or an assumption.

    Attributes
    ----------
    reason : of a gap a key of ``GAPS``
    names : of what; empty for all
    amount : a setting, limit or share that it depends on
    """

    reason: str
    names: tuple[str, ...] = ()
    amount: float | None = None


@frozen
class Coverage:
    """How much of what a stage was asked a check covers.

    Attributes
    ----------
    covered, of : in the items that the check is made of: paths, targets, joints, pairs of bodies, files
    gaps : why it does not cover all; a check with a gap is never complete, whatever the numbers are
    """

    check: Check
    covered: int
    of: int
    gaps: tuple[Open, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether nothing that was asked is left."""
        return self.covered == self.of and not self.gaps


def coverages(asked: Mapping[Check, int | tuple[int, int]], gaps: Iterable[Open]) -> tuple[Coverage, ...]:
    """What each check of a stage covers.

    Parameters
    ----------
    asked : by check how many items there are, and before it how many of these are covered, where that is counted
    gaps : of a check whose covered items are not counted, each takes as many as it has names, and all if it has none;
        those of checks that were not asked do not count

    Returns
    -------
    checked : in the order of ``asked``
    """
    found = tuple(dict.fromkeys(gaps))
    checked = []
    for check, number in asked.items():
        own = tuple(each for each in found if GAPS[each.reason] == check)
        if isinstance(number, tuple):
            covered, of = number
        else:
            lost = number if any(not each.names for each in own) else sum(len(each.names) for each in own)
            covered, of = max(number - lost, 0), number
        checked.append(Coverage(check, covered, of, own))
    return tuple(checked)


def uncovered(checked: Sequence[Coverage], gaps: Sequence[Open]) -> tuple[Coverage, ...]:
    """What checks cover when it turns out that some cover nothing.

    Parameters
    ----------
    checked : of a stage
    gaps : why, all of one check; they do not count where the stage does not make it

    Returns
    -------
    checked : in the same order
    """
    return tuple(
        replace(each, covered=0, gaps=(*each.gaps, *gaps)) if gaps and each.check == GAPS[gaps[0].reason] else each
        for each in checked
    )


def by_reason(found: Iterable[Open]) -> tuple[Open, ...]:
    """What several paths, or programs, leave open, each reason once.

    Parameters
    ----------
    found : of all of them

    Returns
    -------
    found : each with all its names, and the largest amount
    """
    kept: dict[str, Open] = {}
    for each in found:
        old = kept.get(each.reason, Open(each.reason))
        amounts = [amount for amount in (old.amount, each.amount) if amount is not None]
        names = tuple(dict.fromkeys((*old.names, *each.names)))
        kept[each.reason] = Open(each.reason, names, max(amounts, default=None))
    return tuple(kept.values())
