"""What to do about what is wrong with a program."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import singledispatch
from typing import Any

from er3a.kinematics.singularity import EventType
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import sentence, texts, word
from er3a.planning.intervals import TooFast
from er3a.program_check.program_check_findings import (
    CheckFinding,
    FasterThanAssumed,
    MeetsSingularity,
    NotFollowedToEnd,
    PassesSingularity,
    ZoneTooLarge,
)
from er3a.programs.execution import EndKind

NEARER = N_("Move the target or the workpiece nearer to the arm, or tilt the tool towards the arm.")
OTHER_SOLUTION = N_(
    "Teach the target in another configuration or with the tool turned otherwise, or go through a via point that keeps "
    "the joint away from its limit."
)
BY_HAND = N_("Watch this line at low speed on the controller, or replace it by an instruction that is understood.")
FURTHER = N_("Give the check more time, or in a study raise most_steps, most_branches or loop_rounds of programs.")
REMEDIES: dict[str, str] = {
    "above_limit": OTHER_SOLUTION,
    "below_limit": OTHER_SOLUTION,
    "slide_exceeded": OTHER_SOLUTION,
    "combination_exceeded": OTHER_SOLUTION,
    "target_out_of_reach": NEARER,
    "way_out_of_reach": NEARER,
    "configuration_ends": N_("Go there by a joint move, or begin the line in another configuration."),
    "accelerates_more_than_assumed": N_("Lower acceleration and speed of this line."),
    "more_than_full_speed": N_("Ask for 100 % at most."),
    "configuration_changes": N_(
        "If the change is not meant, give the target's configuration or joint angles; if it is, make it where there "
        "is room."
    ),
    "joint_jumps": N_("Teach the target with this joint near to where it comes from."),
    "whole_turn": N_("Teach the target with the nearer angle, unless the turn is meant to unwind cables."),
    "arrives_otherwise": N_("Teach the target again where the line arrives, or go there by a joint move."),
    "turns_at_start": N_("Turn the joint by a joint move first, or begin the line beside the singular pose."),
    "turn_not_met": N_("Correct the target's Turn (T), or teach the target again."),
    "motion_collides": N_(
        "Go round by a via point, take another configuration or tool orientation, or move what stands in the way."
    ),
    "pairs_unexamined": N_("Correct these shapes in the robot's file, or allow the pair there with a reason."),
    "zone_collides": N_("Make the zone smaller, or stop at the corner."),
    "zone_not_settled": N_("Make the zone smaller, or move the corner away from what is near."),
    "arc_has_no_circle": N_("Teach the arc's via point off the straight line between its ends, or use a line."),
    "arc_goes_on": N_("Check on the controller where the arc ends, or split it into arcs that end at targets."),
    "undecided": N_("Keep the path farther from singular poses and limits, or run this line slowly under supervision."),
    "line_not_checked": BY_HAND,
    "may_move": BY_HAND,
    "program_not_understood": BY_HAND,
    "program_form_inferred": N_("Compare this element with what the controller does."),
    "external_axes_left_out": N_("Check by hand that the external axes stand as assumed."),
    "target_not_given": N_("Give the target in the program or in its data file."),
    "frame_not_given": N_("Map the name to a frame under `frames` in the file of programs."),
    "frame_taken_as_flange": N_(
        "Map the name to a frame under `frames` in the file of programs, if a tool is mounted."
    ),
    "way_not_known": N_("Give start_deg of the program, or mend the motion before."),
    "not_come_to": FURTHER,
    "rest_not_checked": N_("Give the check more time or motions, or split the program and check its parts."),
    "loop_comes_back_otherwise": N_("Begin the loop with a joint move to fixed angles."),
    "program_data_file_missing": N_("Put the data file beside the program."),
    "program_name_twice": N_("Remove one of the two definitions."),
    "program_nothing_moves": N_("Check that this is the program to run."),
    "speed_not_given": N_("Give a speed before the motion."),
    "zone_without_size": N_("Give the zone's size in mm."),
    "configuration_not_read": N_("Check on the controller that it takes this solution."),
}
SINGULAR: dict[EventType, str] = {
    "wrist": N_("Tilt the tool so that J5 stays away from 0, or cross this place by a joint move."),
    "elbow": N_("Keep the target nearer to the arm, so that it is not stretched, or cross this place by a joint move."),
    "shoulder": N_("Lead the wrist past axis 1 at a distance by a via point, or cross this place by a joint move."),
    "dependent_axes": N_("Shift or tilt the path, or cross this place by a joint move."),
}
STOPPED: dict[EndKind, str] = {
    "drifts": N_("Let the loop come back to where it began, or give it a fixed number of rounds."),
    "operations": FURTHER,
    "branches": FURTHER,
    "stopped": FURTHER,
    "recursion": N_("Give the routine a condition to return."),
}


TEXTS = texts(
    {
        "remedy.zone_too_large": "Make the zone {half:.1f} mm at most.",
        "remedy.slower": "Lower the speed of this line to {percent:g} % of its own or less.",
    }
)


@singledispatch
def remedy(finding: Any) -> str:
    """What to do about a finding, as a sentence in the language in use; empty where nothing is to be done."""
    return word("remedy", REMEDIES, finding.code) if finding.code in REMEDIES else ""


@remedy.register
def _(found: MeetsSingularity | PassesSingularity) -> str:
    return word("remedy", SINGULAR, found.type)


@remedy.register
def _(found: NotFollowedToEnd) -> str:
    return word("remedy", STOPPED, found.kind)


@remedy.register
def _(found: TooFast | FasterThanAssumed) -> str:
    return _slower(_allowed(found))


@remedy.register
def _(found: ZoneTooLarge) -> str:
    return sentence("remedy.zone_too_large", half=found.motion_mm / 2)


def _allowed(found: TooFast | FasterThanAssumed) -> float:
    """The share of its speed that the joint can do."""
    return (found.limit_deg_s if isinstance(found, TooFast) else found.assumed_deg_s) / found.needed_deg_s


def _slower(share: float) -> str:
    percent = math.floor(1000 * share) / 10
    return sentence("remedy.slower", percent=percent)


def remedies(findings: Iterable[CheckFinding]) -> list[str]:
    """What to do about findings at one line, each thing once; of speeds the lowest."""
    told = list(findings)
    slowest = min((each for each in told if isinstance(each, TooFast | FasterThanAssumed)), key=_allowed, default=None)
    kept = [each for each in told if not isinstance(each, TooFast | FasterThanAssumed) or each is slowest]
    return list(dict.fromkeys(text for each in kept if (text := remedy(each))))
