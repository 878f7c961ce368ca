"""Robot programs: what was read and written, what they make the arm do, what to do about it, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import singledispatch
from typing import Any

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.collision.pairs import LinkAndSolid
from er3a.finding import AnyFinding, Finding, is_one
from er3a.kinematics.singularity import SingularityType
from er3a.pipeline.language import N_, tr
from er3a.pipeline.messages.expectations import demonstrated, outcome_word
from er3a.pipeline.messages.kinematics import singular_pose, singularity_word
from er3a.pipeline.messages.planning import rate_needed, unit_of
from er3a.pipeline.messages.say import (
    Maker,
    Plural,
    by,
    by_code,
    joined,
    listed,
    say,
    say_as,
    says,
    sentence,
    texts,
    word,
)
from er3a.pipeline.stages.programs.model import FindingAt, ProgramSummary
from er3a.planning.motion_faults import RateCause, rate_ratio
from er3a.program_check import program_check_findings as found_in
from er3a.program_check.program_check_findings import RANKS, CheckFinding, Level, MotionCollides, NotFollowedReason
from er3a.programs.program_names import ProgramOutcome

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
NEARER = N_("Move the target or the workpiece nearer to the arm, or tilt the tool towards the arm.")
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
MAX_PAIRS = 3  # that are named of a collision
KEY_FIGURES = {
    "programs_passed": N_("Programs that pass, of those meant to"),
    "instructions_passed": N_("Motion instructions that pass, of programs meant to pass"),
    "instructions_caution": N_("Motion instructions with caution, of programs meant to pass"),
    "instructions_failed": N_("Motion instructions that fail, of programs meant to pass"),
    "least_clearance": N_("Least clearance of programs meant to pass"),
}


TEXTS = texts(
    {
        "programs.none": "The robot's list of programs is empty.",
        "programs.programs": Plural(
            "count", "{passed} of {count} program passes in the model", "{passed} of {count} programs pass in the model"
        ),
        "programs.not_examined": "not all examined ({names})",
        "programs.fault": "{count} {word} ({names})",
        "not_followed": "not followed: {text} ({reason})",
        "not_followed.course": "not followed on from here: {reason}",
        "way_not_known": "the start of the motion is not known; only the target was checked",
        "configuration_guessed": "{solutions} solutions are possible, as the joints before are not known",
        "configuration_not_met": "no solution within the limits, or not the line's end, has the configuration {text}",
        "whole_turn": "J{joint} turns by {angle_deg:.1f} deg; its nearest equivalent is {nearest_deg:.1f} deg away",
        "joint_jumps": "J{joint} turns by {angle_deg:.1f} deg while the tool moves by {moved_mm:.1f} mm",
        "clear_of_assumed": (
            "clear of {pair} by {clearance_mm:.1f} mm of assumed shapes only, which may be wrong by {margin_mm:g} mm"
        ),
        "clearance_not_proven": "clear at points of the way; between them that was not settled in the given time",
        "zone_collides": "a corner path that the blending zone allows collides: {pair}, {depth_mm:.1f} mm deep",
        "zone_collides.assumed": (
            "a corner path that the blending zone allows collides, by assumed shapes: {pair}, {depth_mm:.1f} mm deep"
        ),
        "zone_too_large": "the zone of {zone_mm:.1f} mm is larger than half of a motion of {motion_mm:.1f} mm",
        "target_out_of_reach": "the target is out of reach: {reasons:; }",
        "way_out_of_reach": "out of reach after {at_mm:.1f} mm; at worst, {reasons}",
        "configuration_ends": (
            "the configuration ends after {at_mm:.1f} mm: J{joint} would have to jump by {angle_deg:.1f} {unit}"
        ),
        "meets_singularity": "meets the {type} singularity after {at:.1f} mm, where joint speeds have no bound",
        "meets_singularity.bounded": "meets the {type} singularity after {at:.1f} mm",
        "passes_singularity": "passes the {type} singularity at {distance:.2f} deg, after {at:.1f} mm",
        "passes_singularity.mm": "passes the {type} singularity at {distance:.1f} mm, after {at:.1f} mm",
        "programs.cause": "{finding}: {pose}",
        "arrives_otherwise": (
            "the arm arrives in other joint angles than the target's: J{joint} differs by {difference_deg:.2f} {unit}"
        ),
        "motion_collides": "collision: {touches}",
        "motion_collides.more": "collision: {touches}; and more later",
        "motion_collides.assumed": "collision of assumed shapes: {touches}",
        "motion_collides.assumed_more": "collision of assumed shapes: {touches}; and more later",
        "bodies_touch": "{pair} after {at_mm:.1f} mm, up to {depth_mm:.1f} mm deep",
        "bodies_touch.enlarged": "{touch} (these shapes are up to {enlarged_mm:.1f} mm larger than the meshes in them)",
        "bodies_touch.joint": "{pair} after {t_s:.2f} s, up to {depth_mm:.1f} mm deep",
        "speed_not_given": "the program gives no speed; {assumed:g} m/s were assumed for the duration",
        "speed_not_given.share": "the program gives no speed; {percent:g} % were assumed for the duration",
        "speed_not_given.word": (
            "the speed '{word}' is not known, not above 0, or more than a controller takes; {assumed} was assumed for "
            "duration and joint speeds"
        ),
        "suspect_number": by(
            "kind",
            unit="{text} looks like a number in {unit}; in the unit of this language that is {usual}",
            impossible_speed="{text} is faster than any point of the arm can be ({usual})",
            share="{text} of the joints' speed is more than there is, so that {usual} is taken",
            speed="{text} is more than ten times the program's usual {usual}",
            tool="the tool {text} is used here alone; the motions around have {usual}",
            base="the base {text} is used here alone; the motions around have {usual}",
        ),
        "frames_from_robot_file": by(
            "kind",
            tool="no tool is set before this pose; the robot file's was taken, and the controller may have another",
            base="no base is set before this pose; the robot's was taken, and the controller may have another",
            both=(
                "neither tool nor base is set before this pose; the tool of the robot file and the base of the robot "
                "were taken, and the controller may have others"
            ),
        ),
        "program_not_understood": "not understood: {text}",
        "program_nothing_moves": "no instruction moves the arm",
        "load_above_payload": "{mass_kg:g} kg on the flange, and the arm may carry {payload_kg:g} kg",
        "written_zones_dropped": Plural(
            "zones",
            "{count} zone has no equivalent in this language: the arm stops there",
            "{count} zones have no equivalent in this language: the arm stops there",
        ),
        "written_speeds_estimated": Plural(
            "motions",
            "{count} duration written as a speed: the controller's ramps decide the time",
            "{count} durations written as speeds: the controller's ramps decide the time",
        ),
        "written_speeds_cut": Plural(
            "motions",
            "{count} speed above 100 % written as 100 %",
            "{count} speeds above 100 % written as 100 %",
        ),
        "written_speeds_raised": Plural(
            "motions",
            "{count} speed below the least that has a name, which was taken: faster than what was checked",
            "{count} speeds below the least that has a name, which was taken: faster than what was checked",
        ),
        "written_speeds_of_assumed": Plural(
            "motions",
            "{count} speed written with an assumed {assumed} as 100 %: the controller's 100 % may be far from that",
            "{count} speeds written with an assumed {assumed} as 100 %: the controller's 100 % may be far from that",
        ),
        "written_half_turns_split": Plural(
            "lines",
            "{count} line or arc that turns the tool by 180 deg written in two halves, which fixes the sense",
            "{count} lines or arcs that turn the tool by 180 deg written in two halves, which fixes the sense",
        ),
        "written_targets_left_out": Plural(
            "motions",
            "{count} motion left out: its target is not known",
            "{count} motions left out: their targets are not known",
        ),
        "written_tool_not_given": "set this tool or base on the controller: {name}",
        "written_values_rounded": Plural(
            "values",
            "{count} speed or zone rounded down to the next that has a name",
            "{count} speeds or zones rounded down to the next that has a name",
        ),
        "written_not_translated": Plural(
            "instructions",
            "{count} instruction of the other language kept as a comment",
            "{count} instructions of the other language kept as comments",
        ),
        "written_one_side": Plural(
            "branches",
            "{count} branch of which one side alone was written: what the other does is left out",
            "{count} branches of which one side alone was written: what the others do is left out",
        ),
        "written_external_axes_dropped": Plural(
            "motions",
            "{count} motion written without its external axes",
            "{count} motions written without their external axes",
        ),
        "written_arcs_split": Plural(
            "arcs",
            "{count} arc written as {lines} lines that stay within {deviation:g} mm of it",
            "{count} arcs written as {lines} lines that stay within {deviation:g} mm of them",
        ),
        "written_unsafe": "the path {path} is not safe: {verdict}",
        "written_near_assumed": (
            "the path {path} is clear by {clearance_mm:.1f} mm of assumed shapes only, which may be wrong by "
            "{margin_mm:g} mm"
        ),
        "written_beside_points": (
            "the path {path} was checked with rounded corners that pass beside its points by up to {missed}; a "
            "controller that stops at the points, or blends otherwise, moves elsewhere"
        ),
        "remedy.zone_too_large": "Make the zone {half:.1f} mm at most.",
        "remedy.limit#above": (
            "Give J{joint} {limit:g} {unit} at most; if the target is a pose, turn the tool otherwise there, or move "
            "the target."
        ),
        "remedy.limit#below": (
            "Give J{joint} {limit:g} {unit} at least; if the target is a pose, turn the tool otherwise there, or move "
            "the target."
        ),
        "remedy.collision#solid": "Add a via point around {name}: the way meets it, the target does not.",
        "remedy.collision#solid_at_target": "The arm overlaps {name} at the target: move the target away.",
        "remedy.collision#links": (
            "Keep these links apart: give the target another place, tool orientation or configuration, or add a via "
            "point."
        ),
        "remedy.slower": (
            "Lower the speed of this line to {percent:g} % of its own or less, and its acceleration to "
            "{acceleration:g} %."
        ),
        "programs.waits": Plural("count", "and {count} wait for a signal", "and {count} waits for signals"),
    }
)


@says("programs.pass", "programs.caution", "programs.fail")
def _(found: Finding) -> str:
    passed = sentence("programs.programs", count=found.programs + len(found.demonstrations), passed=found.passed)
    unsound: dict[ProgramOutcome, tuple[str, ...]] = {"fail": found.failed, "caution": found.caution}
    others = []
    for outcome, names in unsound.items():
        parts = {"count": len(names), "word": outcome_word(outcome), "names": joined(names, ", ")}
        others.append(sentence("programs.fault", **parts) if names else "")
    missed = joined(found.not_examined, ", ")
    open_parts = sentence("programs.not_examined", names=missed) if missed else ""
    sentences = [
        passed if found.programs else "",
        joined(others, ", "),
        open_parts,
        demonstrated(found.demonstrations, found.programs),
    ]
    return sentence("finding", finding=joined(sentences))


def level_word(level: Level) -> str:
    """A level in the language in use."""
    return word("program_level", LEVELS, level)


@says("not_followed")
def _(found: Finding) -> str:
    reason = word("target_reason", REASONS, found.reason)
    if not found.text:
        return sentence("not_followed.course", reason=reason)
    return say_as(found, reason=reason)


@says("way_out_of_reach")
def _(found: Finding) -> str:
    return say_as(found, reasons=joined(listed(found.reasons)))


@says("configuration_ends", "arrives_otherwise")
def _(found: Finding) -> str:
    return say_as(found, unit=unit_of(found.slides))


@says("meets_singularity")
def _(found: Finding) -> str:
    parts = {"type": singularity_word(found.type), "at": found.at_mm}
    if found.bounded:
        return sentence("meets_singularity.bounded", **parts)
    return say_as(found, **parts)


@says("passes_singularity")
def _(found: Finding) -> str:
    parts = {"type": singularity_word(found.type), "at": found.at_mm, "distance": found.distance}
    if found.type == "shoulder":
        return sentence("passes_singularity.mm", **parts)
    return say_as(found, **parts)


@say.register
def _(found: found_in.MotionCollides) -> str:
    parts = {"touches": joined(listed(found.touches[:MAX_PAIRS]))}
    if len(found.touches) > MAX_PAIRS:
        return sentence("motion_collides.assumed_more" if found.assumed else "motion_collides.more", **parts)
    return sentence("motion_collides.assumed", **parts) if found.assumed else say_as(found, **parts)


@says("zone_collides")
def _(found: Finding) -> str:
    code = "zone_collides.assumed" if found.assumed else "zone_collides"
    return sentence(code, pair=say(found.pair), depth_mm=found.depth_mm)


@say.register
def _(found: found_in.BodiesTouch) -> str:
    at = {"pair": say(found.pair), "depth_mm": found.depth_mm}
    if found.at_mm is None:
        touch = sentence("bodies_touch.joint", t_s=found.t_s, **at)
    else:
        touch = sentence("bodies_touch", at_mm=found.at_mm, **at)
    if not found.enlarged_mm:
        return touch
    return sentence("bodies_touch.enlarged", touch=touch, enlarged_mm=found.enlarged_mm)


@says("speed_not_given")
def _(found: Finding) -> str:
    if found.word:
        assumed = f"{100 * found.assumed:g} %" if found.unit == "share" else f"{found.assumed:g} m/s"
        return sentence("speed_not_given.word", word=found.word, assumed=assumed)
    if found.unit == "share":
        return sentence("speed_not_given.share", percent=found.assumed * 100)
    return say_as(found)


@says("written_arcs_split")
def _(found: Finding) -> str:
    return say_as(found, deviation=found.deviation_m * 1000)


@says("written_unsafe")
def _(found: Finding) -> str:
    return say_as(found, verdict=outcome_word(found.verdict))


ADVISED: dict[str, Maker] = {}
advises = by_code(ADVISED)


@singledispatch
def remedy(finding: Any) -> str:
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
    side = "above" if is_one(found, "above_limit") else "below"
    return sentence(f"remedy.limit#{side}", joint=found.joint, limit=found.limit_deg, unit=tr("deg"))


@remedy.register
def _(found: MotionCollides) -> str:
    there = next((touch for touch in found.touches if touch.at_target), None)
    pair = (there or found.touches[0]).pair
    if isinstance(pair, LinkAndSolid):
        return sentence("remedy.collision#solid_at_target" if there else "remedy.collision#solid", name=pair.solid)
    return sentence("remedy.collision#links")


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
    named = ", ".join(f"J{joint}" for joint in joints)
    return sentence("rates", named=named, worst=(worst,)) if len(joints) > 1 else worst


def singular_cause(found: AnyFinding) -> str:
    """That a line comes to a singular pose, and how the arm stands there."""
    return sentence("programs.cause", finding=found, pose=singular_pose(found.type))


def remedies(findings: Sequence[CheckFinding | FindingAt]) -> list[str]:
    """What to do about findings at one line, each thing once: about those that weigh most; of speeds the slowest."""
    located = [each for each in findings if isinstance(each, FindingAt)]
    worst = max((RANKS[each.level] for each in located), default=0)
    kept: list[CheckFinding] = [each for each in findings if not isinstance(each, FindingAt)]
    kept += [each.finding for each in located if RANKS[each.level] == worst]
    fast = [each for each in kept if is_one(each, "too_fast")]
    slowest = max(fast, key=rate_ratio, default=None)
    said = (remedy(each) for each in kept if not is_one(each, "too_fast") or each is slowest)
    return list(dict.fromkeys(filter(None, said)))


def cycle_text(program: ProgramSummary) -> str:
    """How long a program takes, and what that leaves out."""
    cycle = program.cycle
    low, high = f"{cycle.blended_s:.2f}", f"{cycle.stopping_s:.2f}"
    time = tr("{time} s", time=low) if low == high else tr("{low} to {high} s", low=low, high=high)
    what = tr("one round: {time}", time=time) if cycle.repeats else time
    waits = sentence("programs.waits", count=cycle.waits) if cycle.waits else ""
    unknown = "" if cycle.complete else tr("without motions whose path is unknown or was not checked")
    return joined([what, waits, unknown], ", ")
