"""Robot programs: what was read and written, what they make the arm do, what to do about it, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.finding import Amount, Finding, is_one
from er3a.kinematics.singularity import SingularityType
from er3a.pipeline.language import N_, tr, words
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
from er3a.planning.motion_faults import rate_ratio
from er3a.program_check.check_program import ProgramCheck
from er3a.program_check.program_check_findings import RANKS, Level, NotFollowedReason

LEVELS: dict[Level, str] = words(
    {
        "pass": "pass",
        "note": "note",
        "caution": "caution",
        "fail": "fail",
    }
)
REASONS: dict[NotFollowedReason, str] = words(
    {
        "undefined": "its value is not in the program",
        "not_finite": "it is no finite number",
        "too_far": "it is more than 100 m away, as where millimetres were written for metres",
        "position_unknown": "it depends on where the arm stands, which is not known",
        "external_tool": "the workpiece is moved along a fixed tool",
        "not_understood": "it is no target of this motion",
        "too_many_joints": "it refers to axes that the arm does not have",
        "instruction": "it may do anything that is not known here",
        "setting": "motions are not followed as it asks",
        "tool": "this tool is not given",
        "base": "this base is not given",
        "turns_with_path": "it turns the tool with its path (CirPathMode)",
        "external_axes": "these axes may carry the arm or the workpiece",
        "arc_angle": "the arc does not end at its target",
        "half_turn": "the tool turns by half a turn, either way round",
        "redundant": "the arm can move along it in more ways than one",
        "operations": "the program carries out too many instructions",
        "ways": "the program has too many sides of branches that only the cell decides",
        "depth": "too many calls are within each other",
        "unreached": "nothing leads to it",
    }
)
NEARER = N_("Move the target nearer to the arm, or tilt the tool towards it.")
LATER = N_("End the loop before these passes, or set its target anew.")
OUT_OF_REACH = ("target_out_of_reach", "way_out_of_reach")
AT_START_MM = 0.5  # of a way: what ends within that is out of reach from its start
OTHER_SOLUTION = N_(
    "Correct the target's joint values; if it is given as a pose, give it another orientation or place."
)
FRAMES = N_("Map the name to a frame under frames in the file that lists the programs (--frames).")
REMEDIES: dict[str, str] = words(
    {
        "combination_exceeded": OTHER_SOLUTION,
        **dict.fromkeys(OUT_OF_REACH, NEARER),
        "later_out_of_reach": LATER,
        "configuration_ends": "End the line before that point: it does not lead on in this configuration.",
        "whole_turn": "Teach the target with the nearer angle, unless the turn is meant to unwind cables.",
        "arrives_otherwise": "Teach the target again where the line arrives.",
        "configuration_not_met": "Teach the target again, or correct its configuration.",
        "configuration_guessed": "Give start_deg of the program (--start), or begin with a move to joint angles.",
        "way_not_known": "Give start_deg of the program (--start), or mend the motion before.",
        "pairs_unexamined": "Correct these shapes in the robot's file, or allow the pair there with a reason.",
        "zone_collides": "Make the zone smaller, or stop at the corner.",
        "clearance_not_proven": "Give the check more time.",
        "program_nothing_moves": "Check that this is the program to run.",
        "program_not_understood": "Compare this line with the controller's manual.",
        "speed_not_given": "Give a speed, as a number above 0, before the motion (KRL: $VEL.CP in m/s, 3 at most).",
        "frames_from_robot_file": "Set tool and base in the program before its first pose.",
        "load_above_payload": "Carry less, or correct the load if it is wrong.",
        "suspect_number": "Correct it if it is a mistake.",
    }
)
NOT_FOLLOWED: dict[NotFollowedReason, str] = words(
    {
        "undefined": "Put the file beside the program that gives it, or give its value by --assume NAME=VALUE.",
        "position_unknown": "Give start_deg of the program (--start), or begin with a move to joint angles.",
        "too_far": "Write the target in the unit of the language: metres in URScript, mm in the others.",
        "instruction": "Put the module that holds it beside the program; if it moves nothing, say so by --assume.",
        "tool": FRAMES,
        "base": FRAMES,
        "half_turn": "Turn the tool in two lines by 90° each, or by a joint motion.",
        "unreached": "Check what leads to this motion, or remove it if nothing does.",
    }
)
OTHERWISE = N_("Watch this line at low speed on the controller.")
SINGULAR: dict[SingularityType, str] = words(
    {
        "wrist": "Tilt the tool so that J5 stays away from 0.",
        "elbow": "Keep the path nearer to the arm, so that it is not stretched.",
        "shoulder": "Keep the wrist at a distance from axis 1.",
    }
)
KEY_FIGURES = words(
    {
        "programs_passed": "Programs that pass, of those meant to",
        "instructions_passed": "Motion instructions that pass, of programs meant to pass",
        "least_clearance": "Least clearance of programs meant to pass",
    }
)


TEXTS = texts(
    {
        "unreadable": "{problem}. {remedy}",
        "programs.none": "The list of programs is empty.",
        "programs.verdict": (
            "[{programs:?}{passed} of {programs} programs pass.][ Fail: {failed:, }.][ Caution: {caution:, }.][ "
            "Not all examined: {not_examined:, }.][ Expected to fail, and did: {demonstrations:, }.]"
        ),
        "not_followed": "{reason:target_reason}: not followed: {text:not_followed}",
        "way_not_known": "start of the motion unknown; only the target was checked",
        "configuration_guessed": "{solutions} solutions possible: the joints before are not known",
        "configuration_not_met": "no solution within the limits, or not the line's end, has the configuration {text}",
        "whole_turn": "J{joint} turns by {angle_deg:.1f}°; its nearest equivalent is {nearest_deg:.1f}° away",
        "joint_jumps": "J{joint} turns by {angle_deg:.1f}° while the tool moves {moved_mm:.1f} mm",
        "clear_of_assumed": "{pair}: least gap {clearance_mm:.1f} mm; assumed shapes may be off by {margin_mm:g} mm",
        "clearance_not_proven": "clear at points of the way; not settled between them in the given time",
        "zone_collides": "blending zone allows a collision ({assumed:shapes}): {pair}, {depth_mm:.1f} mm deep",
        "zone_too_large": "zone larger than its line: {zone_mm:.1f} > {motion_mm:.1f} mm",
        "target_out_of_reach": "target out of reach: {reasons:; }",
        "later_out_of_reach": "out of reach in later passes: {reasons:; }",
        "way_out_of_reach": (
            "out of reach[ at its start{at_start:?}][ after {at_mm:.1f} mm{at_start:!}]: {reasons:; }"
        ),
        "configuration_ends": "configuration ends after {at_mm:.1f} mm: J{joint} would have to jump by {jump:.1f}",
        "meets_singularity": "{type:singularity} singularity after {at_mm:.1f} mm: joint speeds stay bounded",
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
        "remedy.limit": "Keep J{joint} within {limit_deg:g}°; turn or move a target given as a pose.",
        "remedy.jump": "Teach the target with J{joint} near {near_deg:.0f}°, not at {target_deg:.0f}°.",
        "remedy.end": "End it at ({end_mm:.1f, }) mm: {margin_mm:.1f} mm clear.",
        "remedy.solid": (
            "[Add a via point around {name}: the target itself is clear.{there:!}][Move the target away from "
            "{name}.{there:?}]"
        ),
        "remedy.links": (
            "Keep these links apart: give the target another place, orientation or configuration, or add a via point."
        ),
        "remedy.misspelled": "Misspelled? The program gives {near:, }. Else give its value by --assume NAME=VALUE.",
        "remedy.slower": "Lower this line's speed to {percent:g} % or less, its acceleration to {acceleration:g} %.",
        "programs.waits": "waits for signals: {count}",
    }
)
WORDS.update(
    words(
        {
            "target_reason": REASONS,
            "not_followed": {"": "from here on"},
            "shapes": {True: "assumed shapes", False: "stated shapes"},
            "speed_given": {"": "none"},
            "suspect": {
                "impossible_speed": "more than any point of the arm can do",
                "share": "more than there is",
                "speed": "ten times the usual speed",
                "tool": "a tool used only here",
                "base": "a base used only here",
            },
            "frames": {"tool": "tool", "base": "base", "both": "tool and base"},
        }
    )
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
    if near := getattr(found, "near", ()):
        return sentence("remedy.misspelled", near=near)
    return word("remedy", NOT_FOLLOWED, found.reason) if found.reason in NOT_FOLLOWED else tr(OTHERWISE)


@advises("meets_singularity", "passes_singularity")
def _(found: Finding) -> str:
    return word("remedy", SINGULAR, found.type)


@advises("above_limit", "below_limit", "joint_jumps")
def _(found: Finding) -> str:
    return sentence("remedy.limit" if "limit_deg" in found.params else "remedy.jump", **found.params)


@says("way_out_of_reach")
def _(found: Finding) -> str:
    return say_as(found, at_start=found.at_mm < AT_START_MM)


@advises("motion_collides")
def _(found: Finding) -> str:
    there = next((touch for touch in found.touches if touch.at_target), None)
    if there and "end_mm" in found.params:
        return sentence("remedy.end", end_mm=found.end_mm, margin_mm=found.margin_mm)
    pair = (there or found.touches[0]).pair
    if is_one(pair, "link_and_solid"):
        return sentence("remedy.solid", there=there is not None, name=pair.solid)
    return sentence("remedy.links")


@advises("too_fast", "acceleration_too_great")
def _(found: Finding) -> str:
    ratio = rate_ratio(found)
    percent = math.floor(1000 / (ratio if is_one(found, "too_fast") else math.sqrt(ratio))) / 10
    return sentence("remedy.slower", percent=percent, acceleration=math.floor(percent**2 / 10) / 10)


@advises("zone_too_large")
def _(found: Finding) -> str:
    return sentence("remedy.zone_too_large", half=found.motion_mm / 2)


def rates_text(paces: Sequence[Finding]) -> str:
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
