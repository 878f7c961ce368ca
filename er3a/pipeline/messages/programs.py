"""Robot programs: what was read and written, what they make the arm do, what to do about it, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.finding import Amount, Finding, is_one
from er3a.kinematics.singularity import SingularityType
from er3a.pipeline.language import N_, tr
from er3a.pipeline.messages import expectations  # noqa: F401
from er3a.pipeline.messages.kinematics import singular_pose
from er3a.pipeline.messages.planning import rate_needed
from er3a.pipeline.messages.say import (
    WORDS,
    Maker,
    by_code,
    joined,
    same_text,
    say_as,
    says,
    sentence,
    texts,
    word,
)
from er3a.pipeline.stages.programs.model import FindingAt, ProgramSummary
from er3a.planning.motion_faults import RateCause, rate_ratio
from er3a.program_check.check_program import ProgramCheck
from er3a.program_check.program_check_findings import RANKS, Level, NotFollowedReason

LEVELS: dict[Level, str] = {
    "pass": N_("pass"),
    "note": N_("note"),
    "caution": N_("caution"),
    "fail": N_("fail"),
}
REASONS: dict[NotFollowedReason, str] = {
    "undefined": N_("its value is not in the program"),
    "not_finite": N_("it is no finite number"),
    "too_far": N_("it is more than 100 m away, as where millimetres were written for metres"),
    "position_unknown": N_("it depends on where the arm stands, which is not known"),
    "external_tool": N_("the workpiece is moved along a fixed tool"),
    "not_understood": N_("it is no target of this motion"),
    "too_many_joints": N_("it refers to axes that the arm does not have"),
    "instruction": N_("it may do anything that is not known here"),
    "setting": N_("motions are not followed as it asks"),
    "tool": N_("this tool is not given"),
    "base": N_("this base is not given"),
    "turns_with_path": N_("it turns the tool with its path (CirPathMode)"),
    "external_axes": N_("these axes were taken to rest"),
    "arc_angle": N_("the arc does not end at its target"),
    "half_turn": N_("the tool turns by half a turn, either way round"),
    "redundant": N_("the arm can move along it in more ways than one"),
    "operations": N_("the program carries out too many instructions"),
    "ways": N_("the program has too many sides of branches that only the cell decides"),
    "depth": N_("too many calls are within each other"),
    "unreached": N_("nothing leads to it"),
}
NEARER = N_("Move the target nearer to the arm, or tilt the tool towards it.")
OTHER_SOLUTION = N_(
    "Correct the target's joint values; if it is given as a pose, give it another orientation or place."
)
FRAMES = N_("Map the name to a frame under frames in the file that lists the programs (--frames).")
REMEDIES: dict[str, str] = {
    "limit_exceeded": OTHER_SOLUTION,
    "combination_exceeded": OTHER_SOLUTION,
    "target_out_of_reach": NEARER,
    "way_out_of_reach": NEARER,
    "configuration_ends": N_("End the line before that point: it does not lead on in this configuration."),
    "joint_jumps": N_("Teach the target with this joint near to where it comes from."),
    "whole_turn": N_("Teach the target with the nearer angle, unless the turn is meant to unwind cables."),
    "arrives_otherwise": N_("Teach the target again where the line arrives."),
    "configuration_not_met": N_("Teach the target again, or correct its configuration."),
    "configuration_guessed": N_("Give start_deg of the program (--start), or begin with a move to joint angles."),
    "way_not_known": N_("Give start_deg of the program (--start), or mend the motion before."),
    "pairs_unexamined": N_("Correct these shapes in the robot's file, or allow the pair there with a reason."),
    "zone_collides": N_("Make the zone smaller, or stop at the corner."),
    "clearance_not_proven": N_("Give the check more time."),
    "program_nothing_moves": N_("Check that this is the program to run."),
    "program_not_understood": N_("Compare this line with the controller's manual."),
    "speed_not_given": N_("Give a speed, as a number above 0, before the motion (KRL: $VEL.CP in m/s, 3 at most)."),
    "frames_from_robot_file": N_("Set tool and base in the program before its first pose."),
    "load_above_payload": N_("Carry less, or correct the load if it is wrong."),
    "suspect_number": N_("Correct it if it is a mistake."),
}
NOT_FOLLOWED: dict[NotFollowedReason, str] = {
    "undefined": N_("Put the file beside the program that gives it, or give its value by --assume NAME=VALUE."),
    "position_unknown": N_("Give start_deg of the program (--start), or begin with a move to joint angles."),
    "too_far": N_("Write the target in the unit of the language: metres in URScript, mm in the others."),
    "instruction": N_("Put the module that holds it beside the program; if it moves nothing, say so by --assume."),
    "tool": FRAMES,
    "base": FRAMES,
    "half_turn": N_("Turn the tool in two lines by 90 deg each, or by a joint motion."),
    "unreached": N_("Check what leads to this motion, or remove it if nothing does."),
}
OTHERWISE = N_("Watch this line at low speed on the controller.")
SINGULAR: dict[SingularityType, str] = {
    "wrist": N_("Tilt the tool so that J5 stays away from 0."),
    "elbow": N_("Keep the path nearer to the arm, so that it is not stretched."),
    "shoulder": N_("Keep the wrist at a distance from axis 1."),
}
KEY_FIGURES = {
    "programs_passed": N_("Programs that pass, of those meant to"),
    "instructions_passed": N_("Motion instructions that pass, of programs meant to pass"),
    "instructions_caution": N_("Motion instructions with caution, of programs meant to pass"),
    "instructions_failed": N_("Motion instructions that fail, of programs meant to pass"),
    "least_clearance": N_("Least clearance of programs meant to pass"),
}


TEXTS = texts(
    {
        "unreadable": "{problem}. {remedy}",
        "programs.none": "The list of programs is empty.",
        "programs.verdict": (
            "[{programs:?}{passed} of {programs} programs pass.][ Fail: {failed:, }.][ Caution: {caution:, }.][ "
            "Not all examined: {not_examined:, }.][ Expected to fail, and did: {demonstrations:, }.]"
        ),
        "not_followed": "not followed: {text:not_followed} ({reason:target_reason})",
        "way_not_known": "start of the motion unknown; only the target was checked",
        "configuration_guessed": "{solutions} solutions possible: the joints before are not known",
        "configuration_not_met": "no solution within the limits, or not the line's end, has the configuration {text}",
        "whole_turn": "J{joint} turns by {angle_deg:.1f} deg; its nearest equivalent is {nearest_deg:.1f} deg away",
        "joint_jumps": "J{joint} turns by {angle_deg:.1f} deg while the tool moves {moved_mm:.1f} mm",
        "clear_of_assumed": "{pair}: {clearance_mm:.1f} mm clear of assumed shapes, wrong by up to {margin_mm:g} mm",
        "clearance_not_proven": "clear at points of the way; not settled between them in the given time",
        "zone_collides": "blending zone allows a collision ({assumed:shapes}): {pair}, {depth_mm:.1f} mm deep",
        "zone_too_large": "zone {zone_mm:.1f} mm, motion only {motion_mm:.1f} mm",
        "target_out_of_reach": "target out of reach: {reasons:; }",
        "way_out_of_reach": "out of reach after {at_mm:.1f} mm: {reasons:; }",
        "configuration_ends": "configuration ends after {at_mm:.1f} mm: J{joint} would have to jump by {jump:.1f}",
        "meets_singularity": "{type:singularity} singularity after {at_mm:.1f} mm: joint speeds {bounded:bounded}",
        "passes_singularity": "passes the {type:singularity} singularity at {distance:.2f}, after {at_mm:.1f} mm",
        "arrives_otherwise": "the arm arrives in other joint angles: J{joint} differs by {difference:.2f}",
        "motion_collides": "collision ({assumed:shapes}): {touches:3; }",
        "bodies_touch": "{pair} after {at:.4g}, {depth_mm:.1f} mm deep",
        "speed_not_given": "no usable speed (given: {word:speed_given}); {assumed:g} assumed",
        "suspect_number": "{text} looks like {kind:suspect}; expected: {usual}",
        "frames_from_robot_file": (
            "no {kind:frames} set before this pose: the robot file's was taken; the controller may have another"
        ),
        "program_not_understood": "not understood: {text}",
        "program_nothing_moves": "no instruction moves the arm",
        "load_above_payload": "{mass_kg:g} kg on the flange; payload {payload_kg:g} kg",
        "remedy.zone_too_large": "Make the zone {half:.1f} mm at most.",
        "remedy.limit": "Keep J{joint} within {limit:g} deg; turn or move a target given as a pose.",
        "remedy.solid": (
            "[Add a via point around {name}: the target itself is clear.{there:!}][Move the target away from "
            "{name}: they overlap there.{there:?}]"
        ),
        "remedy.links": (
            "Keep these links apart: give the target another place, orientation or configuration, or add a via point."
        ),
        "remedy.slower": "Lower this line's speed to {percent:g} % or less, its acceleration to {acceleration:g} %.",
        "programs.waits": "waits for signals: {count}",
    }
)
WORDS.update(
    {
        "target_reason": REASONS,
        "not_followed": {"": N_("from here on")},
        "shapes": {True: N_("assumed shapes"), False: N_("stated shapes")},
        "bounded": {True: N_("stay bounded"), False: N_("have no bound")},
        "speed_given": {"": N_("none")},
        "suspect": {
            "impossible_speed": N_("more than any point of the arm can do"),
            "share": N_("more than there is"),
            "speed": N_("ten times the usual speed"),
            "tool": N_("a tool used only here"),
            "base": N_("a base used only here"),
        },
        "frames": {"tool": N_("tool"), "base": N_("base"), "both": N_("tool and base")},
    }
)


same_text("programs.verdict", "programs.pass", "programs.caution", "programs.fail")


def level_word(level: Level) -> str:
    """A level in the language in use."""
    return word("program_level", LEVELS, level)


@says("bodies_touch")
def _(found: Finding) -> str:
    return say_as(found, at=Amount(found.t_s, "s") if found.at_mm is None else Amount(found.at_mm, "mm"))


ADVISED: dict[str, Maker] = {}
advises = by_code(ADVISED)


def remedy(finding: Finding) -> str:
    """What to do about a finding, as a sentence in the language in use; empty where nothing is to be done."""
    if maker := ADVISED.get(finding.code):
        return maker(finding)
    return word("remedy", REMEDIES, finding.code) if finding.code in REMEDIES else ""


@advises("not_followed")
def _(found: Finding) -> str:
    return word("remedy", NOT_FOLLOWED, found.reason) if found.reason in NOT_FOLLOWED else tr(OTHERWISE)


@advises("meets_singularity", "passes_singularity")
def _(found: Finding) -> str:
    return word("remedy", SINGULAR, found.type)


@advises("above_limit", "below_limit")
def _(found: Finding) -> str:
    return sentence("remedy.limit", joint=found.joint, limit=found.limit_deg)


@advises("motion_collides")
def _(found: Finding) -> str:
    there = next((touch for touch in found.touches if touch.at_target), None)
    pair = (there or found.touches[0]).pair
    if is_one(pair, "link_and_solid"):
        return sentence("remedy.solid", there=there is not None, name=pair.solid)
    return sentence("remedy.links")


@advises("too_fast")
def _(found: Finding) -> str:
    percent = math.floor(1000 / rate_ratio(found)) / 10
    return sentence("remedy.slower", percent=percent, acceleration=math.floor(percent**2 / 10) / 10)


@advises("acceleration_too_great")
def _(found: Finding) -> str:
    ratio = rate_ratio(found)
    percent = math.floor(1000 / math.sqrt(ratio)) / 10
    return sentence("remedy.slower", percent=percent, acceleration=math.floor(1000 / ratio) / 10)


@advises("zone_too_large")
def _(found: Finding) -> str:
    return sentence("remedy.zone_too_large", half=found.motion_mm / 2)


def rates_text(paces: Sequence[RateCause]) -> str:
    """What is too fast on a line, all joints together: the worst of them."""
    joints = sorted({each.joint for each in paces})
    worst = rate_needed(max(paces, key=rate_ratio))
    named = tuple(f"J{joint}" for joint in joints)
    return sentence("rates", joints=named, worst=(worst,)) if len(joints) > 1 else worst


def singular_cause(found: Finding) -> str:
    """That a line comes to a singular pose, and how the arm stands there."""
    return sentence("path.cause", event=found, pose=singular_pose(found.type))


def remedies(findings: Sequence[Finding | FindingAt]) -> list[str]:
    """What to do about findings at one line, each thing once: about those that weigh most; of speeds the slowest."""
    located = [each for each in findings if isinstance(each, FindingAt)]
    worst = max((RANKS[each.level] for each in located), default=0)
    kept: list[Finding] = [each for each in findings if not isinstance(each, FindingAt)]
    kept += [each.finding for each in located if RANKS[each.level] == worst]
    fast = [each for each in kept if is_one(each, "too_fast")]
    slowest = max(fast, key=rate_ratio, default=None)
    said = (remedy(each) for each in kept if not is_one(each, "too_fast") or each is slowest)
    return list(dict.fromkeys(filter(None, said)))


def cycle_text(program: ProgramSummary | ProgramCheck) -> str:
    """How long a program takes, and what that leaves out."""
    cycle = program.cycle
    low, high = f"{cycle.blended_s:.2f}", f"{cycle.stopping_s:.2f}"
    time = tr("{time} s", time=low) if low == high else tr("{low} to {high} s", low=low, high=high)
    what = tr("one round: {time}", time=time) if cycle.repeats else time
    waits = sentence("programs.waits", count=cycle.waits) if cycle.waits else ""
    unknown = "" if cycle.complete else tr("without motions whose path is unknown or was not checked")
    return joined([what, waits, unknown], ", ")
