"""Robot programs: what was read and written, what they make the arm do, what to do about it, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import singledispatch
from typing import Any, get_args

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.collision.pairs import LinkAndSolid
from er3a.kinematics.singularity import SingularityType
from er3a.pipeline.messages.expectations import demonstrated, outcome_word
from er3a.pipeline.messages.kinematics import branch_word, singular_pose, singularity_word
from er3a.pipeline.messages.language import N_, alike, tr
from er3a.pipeline.messages.planning import UNBOUNDED, needed_text, rate_needed, unit_of
from er3a.pipeline.messages.say import Plural, by, joined, listed, say, say_as, sentence, texts, word
from er3a.pipeline.stages.programs.model import FindingAt, ProgramCounts, ProgramSummary
from er3a.planning.motion_faults import AboveLimit, AccelerationTooGreat, BelowLimit, TooFast
from er3a.program_check import program_check_findings as found_in
from er3a.program_check.check_program import LocatedFinding
from er3a.program_check.program_check_findings import (
    RANKS,
    AcceleratesMoreThanAssumed,
    CheckFinding,
    ConfigurationChanges,
    FasterThanAssumed,
    JointJumps,
    Level,
    MeetsSingularity,
    MotionCollides,
    NotFollowedToEnd,
    PassesSingularity,
    ZoneTooLarge,
)
from er3a.programs import program_findings as text
from er3a.programs.execution import EndKind
from er3a.programs.instructions import Unresolved
from er3a.programs.program_names import ProgramOutcome

LEVELS: dict[Level, str] = {
    "pass": N_("pass"),
    "note": N_("note"),
    "caution": N_("caution"),
    "fail": N_("fail"),
}
REASONS: dict[Unresolved, str] = {
    "undefined": N_(
        "the program does not define it, or makes it of what is not known here, such as joint angles after a straight "
        "line"
    ),
    "perhaps_changed": N_("something that is not understood may have changed it"),
    "not_evaluated": N_("the program computes it by what is not evaluated here"),
    "not_finite": N_("it is no finite number"),
    "too_far": N_("it is more than 100 m away, as where millimetres were written for metres"),
    "position_unknown": N_("it depends on where the arm stands, which is not known"),
    "external_tool": N_("the workpiece is moved along a fixed tool, which is not supported"),
    "not_understood": N_("it is not understood"),
    "too_many_joints": N_("it refers to axes that the arm does not have"),
    "turns_with_arc": N_("how the tool turns with an arc of half a turn or more is not followed"),
}
NEARER = N_("Move the target or the workpiece nearer to the arm, or tilt the tool towards the arm.")
OTHER_SOLUTION = N_(
    "Correct the target's joint values; if it is given as a pose, give it another orientation or place."
)
BY_HAND = N_("Watch this line at low speed on the controller, or replace it by an instruction that is understood.")
FURTHER = N_("Give the check more time, or in a study raise most_steps, most_branches or loop_rounds of programs.")
REMEDIES: dict[str, str] = {
    "slide_exceeded": OTHER_SOLUTION,
    "combination_exceeded": OTHER_SOLUTION,
    "target_out_of_reach": NEARER,
    "way_out_of_reach": NEARER,
    "configuration_ends": N_("End the line before that point: it does not lead on in this configuration."),
    "more_than_full_speed": N_("Ask for 100 % at most."),
    "configuration_changes": N_(
        "If the change is not meant, give the target's configuration or joint angles; if it is, make it where there "
        "is room."
    ),
    "whole_turn": N_("Teach the target with the nearer angle, unless the turn is meant to unwind cables."),
    "arrives_otherwise": N_("Teach the target again where the line arrives."),
    "turns_at_start": N_("Begin the line beside the singular pose."),
    "turn_not_met": N_("Correct the target's Turn (T), or teach the target again."),
    "configuration_not_met": N_("Teach the target again, or correct its configuration."),
    "configuration_guessed": N_("Give start_deg of the program, or begin with a move to joint angles."),
    "moves_beside": BY_HAND,
    "never_reached": N_("Check what leads to this motion as a program of its own, or remove it if nothing does."),
    "pairs_unexamined": N_("Correct these shapes in the robot's file, or allow the pair there with a reason."),
    "zone_collides": N_("Make the zone smaller, or stop at the corner."),
    "zone_not_settled": N_("Stop at the corner, or make the zone smaller until this is no longer found."),
    "arc_has_no_circle": N_("Teach the arc's via point off the straight line between its ends, or use a line."),
    "arc_turn_in_doubt": N_("Give the arc's via point the orientation that the tool shall have there."),
    "arc_goes_on": N_("Check on the controller where the arc ends, or split it into arcs that end at targets."),
    "undecided": N_("Keep the path farther from singular poses and limits, or run this line slowly under supervision."),
    "line_not_checked": BY_HAND,
    "may_move": BY_HAND,
    "program_not_understood": BY_HAND,
    "program_not_simulated": N_("Check on the controller what this instruction does to the motions after it."),
    "program_form_inferred": N_("Compare this element with what the controller does."),
    "program_joint_speed_inferred": N_("Give the speed of joint motions in percent (v50perc)."),
    "external_axes_left_out": N_("Check by hand that the external axes stand as assumed."),
    "frame_not_given": N_("Map the name to a frame under frames in the file that lists the programs."),
    "frame_taken_as_flange": N_(
        "Map the name to a frame under frames in the file that lists the programs, if a tool is mounted."
    ),
    "frame_of_several": N_(
        "Give the index in the program, or check it once with each frame that the index may choose."
    ),
    "tool_stated_elsewhere": N_("Make the table anew for this arm and its tool, or leave its pose columns out."),
    "frames_in_doubt": N_("Set tool and base after it, end what it begins, or remove it."),
    "way_not_known": N_("Give start_deg of the program, or mend the motion before."),
    "not_come_to": FURTHER,
    "rest_not_checked": N_("Give the check more time or motions, or split the program and check its parts."),
    "begun_again": N_("Let the program end where it begins, and write the way there at its end: it is checked then."),
    "loop_comes_back_otherwise": N_("Turn the tool back within the loop, so that each round ends as it began."),
    "program_data_file_missing": N_("Put the data file beside the program."),
    "program_begun_within": N_("Check the module with main: it takes this one with it."),
    "program_name_twice": N_("Remove one of the two definitions."),
    "program_module_twice": N_("Remove the one that the controller does not have."),
    "program_nothing_moves": N_("Check that this is the program to run."),
    "speed_not_given": N_("Give a speed, as a number above 0, before the motion (KRL: $VEL.CP in m/s, 3 at most)."),
    "turn_speed_not_given": N_(
        "Give the speed of the tool's turn (KRL: $VEL.ORI1 and $VEL.ORI2), or where the language has none, the time "
        "of the motion (URScript: t)."
    ),
    "frames_from_robot_file": N_("Set tool and base in the program before its first pose."),
    "frames_decide": N_("Set tool and base in the program before it reads where the arm is."),
    "position_completed": N_("Give all coordinates of the position."),
    "frame_given_twice": N_("Correct the one that is wrong, or remove it from the frames."),
    "kept_to_next_start": N_("Set this variable at the program's beginning."),
    "turns_otherwise": N_("Turn the tool by a joint motion, or in parts: swing its x axis first, then turn about it."),
    "turns_either_way": N_("Turn the tool in two lines by 90 deg each, or by a joint motion."),
    "turn_not_followed": N_("Set $ORI_TYPE=#VAR and $CIRC_TYPE=#BASE for it, or make it a joint motion."),
    "relative_turn_assumed": N_("Give the target as an absolute position, or turn in the tool's frame (#TOOL)."),
    "set_elsewhere": N_("Set this variable at the program's beginning."),
    "waits_for_others": N_(
        "Look up what else the task sets that answers this wait, and set what motions use after the wait."
    ),
    "errors_not_followed": N_("End the program in the handler, or watch at low speed what it does after an error."),
    "acceleration_not_known": N_("Give the acceleration as a number."),
    "zone_without_size": N_("Give the zone's size: in mm, or for C_PTP in percent ($APO.CPTP)."),
    "spline_as_line": N_("Write straight lines of the spline (SLIN), or joint moves outside of it (SPTP)."),
    "configuration_not_read": N_("Check on the controller that it takes this solution."),
    "load_not_examined": N_(
        "List the program as a path of a study: its stage dynamics computes torques with a load whose numbers are all "
        "given."
    ),
    "load_above_payload": N_("Carry less, or correct the load if it is wrong."),
}
SINGULAR: dict[SingularityType, str] = {
    "wrist": N_("Tilt the tool so that J5 stays away from 0."),
    "elbow": N_("Keep the path nearer to the arm, so that it is not stretched."),
    "shoulder": N_("Keep the wrist at a distance from axis 1."),
}
TARGETS: dict[Unresolved, str] = {
    "too_far": N_("Write the target in the unit of the language: metres in URScript, mm in the others."),
    "undefined": N_("Give the target in the program or in its data file."),
    "perhaps_changed": N_(
        "Check the program together with the module that holds what is called, or give the target after the call."
    ),
    "not_evaluated": N_("Write the value that it has in the program, or compute it by numbers and arithmetic alone."),
    "turns_with_arc": N_("Write the arc as several of less than half a turn each."),
}
STOPPED: dict[EndKind, str] = {
    "drifts": N_(
        "Let the loop come back to where it began, or give it a fixed number of rounds that stays within reach."
    ),
    "operations": FURTHER,
    "branches": FURTHER,
    "rounds": N_("Give the loop a number of rounds in the program, the greatest that it may have."),
    "stopped": FURTHER,
    "recursion": N_("Give the routine a condition to return."),
    "guessed": N_("Call routines by their names, chosen by a test of the text."),
}
STAYS_MM = 1.0  # that a tool moves when it stays where it is
Pace = TooFast | FasterThanAssumed | AccelerationTooGreat | AcceleratesMoreThanAssumed
PACED = get_args(Pace)
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
        "frame_not_given": by(
            "frame",
            base="the base {name} is not given; map it to a frame",
            tool="the tool {name} is not given; map it to a frame",
        ),
        "frame_of_several": by(
            "frame",
            tool="the index in {name} is not known; one tool was given for every value of it",
            base="the index in {name} is not known; one base was given for every value of it",
        ),
        "tool_stated_elsewhere": (
            "the table says that the tool is {moved_mm:.1f} mm and {turned_deg:.2f} deg from where its joints put it; "
            "the joints were taken"
        ),
        "frame_taken_as_flange": "{name} is not given; the flange was taken for it",
        "frames_in_doubt": ("checked with the tool, base and way that are known, but {text} may have changed them"),
        "way_not_known": "the start of the motion is not known; only the target was checked",
        "more_than_full_speed": "asks for {percent:g} % of the joints' speed or acceleration",
        "joint_jumps": "J{joint} turns by {angle_deg:.1f} deg while the tool moves by {moved_mm:.1f} mm",
        "whole_turn": "J{joint} turns by {angle_deg:.1f} deg; its nearest equivalent is {nearest_deg:.1f} deg away",
        "turns_at_start": (
            "the line starts at a singular pose: J{joint} first has to turn by {angle_deg:.1f} deg with the tool at "
            "rest"
        ),
        "turn_not_met": "no solution within the limits has the signs that T {turn} asks for; the nearest was taken",
        "configuration_not_met": by(
            "where",
            target="no solution within the limits has the configuration {text}; the nearest was taken",
            line="the line does not arrive in the configuration {text}; a controller that supervises it stops",
        ),
        "configuration_not_read": (
            "the configuration {text} is not known to select one solution; the solution nearest to the joints before "
            "was taken"
        ),
        "configuration_guessed": (
            "where the arm comes from is not known: of {solutions} solutions the one nearest to 0 was taken, and what "
            "follows is checked from there"
        ),
        "moves_beside": by(
            "kind",
            thread=(
                "the thread {routine} moves the arm while the program goes on; its motions and the program's were "
                "checked apart"
            ),
            interrupt=(
                "the interrupt {routine} can move the arm at any time; its motions were checked apart, from where it "
                "is not known"
            ),
            sets=(
                "{routine} runs beside the program from here on and can set {names}; the motions after it were checked "
                "without that"
            ),
        ),
        "clear_of_assumed": (
            "clear of {pair} by {clearance_mm:.1f} mm of assumed shapes only, which may be wrong by {margin_mm:g} mm"
        ),
        "zone_collides": "a corner path that the blending zone allows collides: {pair}, {depth_mm:.1f} mm deep",
        "zone_collides.assumed": (
            "a corner path that the blending zone allows collides, by assumed shapes: {pair}, {depth_mm:.1f} mm deep"
        ),
        "zone_not_settled": (
            "not every corner path that the zone allows is proven clear; the nearest measured passes at "
            "{least_mm:.1f} mm"
        ),
        "zone_too_large": (
            "the zone of {zone_mm:.1f} mm is larger than half of a motion of {motion_mm:.1f} mm: checked with half; a "
            "controller may round more, or, as UR's where blends overlap, skip the point: the way without it was not "
            "followed"
        ),
        "zone_without_size": "the size of the zone {zone} is not known; half of each motion was taken",
        "arc_has_no_circle": "the arc's points do not define a circle",
        "spline_as_line": "the spline was checked as straight from point to point; how it bends was not examined",
        "external_axes_left_out": "external axes are assumed at rest: {axes:, }",
        "line_not_checked": (
            "the arm has no closed-form inverse: the line was not followed, only its target was checked"
        ),
        "may_move": "not understood, and may move the arm or change the program's data: {text}",
        "never_reached": by(
            "moves",
            true="no branch that was followed leads to this motion; it was not checked",
            false="no branch that was followed leads to this instruction, which may move the arm; it was not checked",
        ),
        "not_come_to": "not checked: the program was not followed as far as this motion",
        "both_sides_checked": "both sides were checked: {condition}",
        "not_followed_to_end": by(
            "kind",
            drifts="the loop never comes back to a state that it was in; it was followed for {limit} rounds",
            operations="the program was followed for {limit} instructions, and no further than here",
            branches=(
                "not each side of this branch was followed: the program has more than {limit} sequences of its branches"
            ),
            rounds=(
                "how often this loop goes round is known on the cell alone; not each number of rounds was followed, as "
                "the program has more than {limit} sequences of its branches"
            ),
            stopped="the program was followed no further than here: the time for it was over",
            recursion="routines call themselves or each other without end",
            guessed=(
                "which routine is called is known on the cell alone; that it is one that runs already was not followed"
            ),
        ),
        "target_not_given.named": "the target {name} is not known: {reason}",
        "target_not_given": "the target is not known: {reason}",
        "target_not_given.perhaps": "the target is not known: {name}, which is not understood, may have changed it",
        "target_out_of_reach": "the target is out of reach: {reasons:; }",
        "target_out_of_reach.bare": "the target is out of reach",
        "target_out_of_reach.carried": "the target is out of reach while the external axes rest",
        "way_out_of_reach": "out of reach after {at_mm:.1f} mm; at worst, {reasons}",
        "way_out_of_reach.carried": (
            "out of reach after {at_mm:.1f} mm while the external axes rest; at worst, {reasons}"
        ),
        "configuration_ends": (
            "the configuration ends after {at_mm:.1f} mm: J{joint} would have to jump by {angle_deg:.1f} {unit}"
        ),
        "meets_singularity": "meets the {type} singularity after {at:.1f} mm, where joint speeds have no bound",
        "meets_singularity.bounded": "meets the {type} singularity after {at:.1f} mm",
        "passes_singularity": "passes the {type} singularity at {distance:.2f} deg, after {at:.1f} mm",
        "passes_singularity.mm": "passes the {type} singularity at {distance:.1f} mm, after {at:.1f} mm",
        "faster_than_assumed": (
            "J{joint} exceeds the assumed limit of {assumed_deg_s:g} {unit}/s (no document gives its speed), at worst "
            "needing {needed}"
        ),
        "accelerates_more_than_assumed": (
            "J{joint} exceeds the assumed limit of {assumed_deg_s2:g} {unit}/s², at worst needing {needed}"
        ),
        "programs.rates": Plural(
            "joints",
            "{named} exceeds {limits}: {worst:, }",
            "{named} exceed {limits}: {worst:, }",
        ),
        "programs.rates#far": Plural(
            "joints",
            "{named} exceeds {limits}, at worst by more than {times:g} times",
            "{named} exceed {limits}, at worst by more than {times:g} times",
        ),
        "programs.cause": "{finding}: {pose}",
        "configuration_changes": "the configuration changes from {before} to {after}",
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
        "arc_turn_in_doubt": (
            "the orientation of the arc's via point does not tell in which direction the tool turns; the one that "
            "comes nearer to it was checked"
        ),
        "arc_goes_on": "the arc ends after {angle_deg:g} deg, not at its target",
        "arc_goes_on.unknown": "the angle at which the arc ends is not known; the arc was not checked",
        "arc_goes_on.turns": (
            "the arc ends after {angle:g} deg, not at its target; the tool is taken to have the target's orientation "
            "there"
        ),
        "speed_not_given": "the program gives no speed; {assumed:g} m/s were assumed for the duration",
        "speed_not_given.share": "the program gives no speed; {percent:g} % were assumed for the duration",
        "speed_not_given.word": (
            "the speed '{word}' is not known, not above 0, or more than a controller takes; {assumed} was assumed for "
            "duration and joint speeds"
        ),
        "turn_speed_not_given": (
            "the tool's turn decides how long this takes, and the program does not give its speed; "
            "{assumed_deg_s:.0f} deg/s were assumed"
        ),
        "turn_speed_not_given.word": (
            "the tool's turn decides how long this takes, and its speed '{word}' is not known, or not above 0; "
            "{assumed_deg_s:.0f} deg/s were assumed"
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
        "frames_decide": by(
            "kind",
            tool=(
                "which way the program takes depends on this pose, and no tool is set before: the robot file's was "
                "taken, and with another one on the controller it may take a way that was not checked"
            ),
            base=(
                "which way the program takes depends on this pose, and no base is set before: the robot's was taken, "
                "and with another one on the controller it may take a way that was not checked"
            ),
            both=(
                "which way the program takes depends on this pose, and neither tool nor base is set before: those of "
                "the robot file were taken, and with others on the controller it may take a way that was not checked"
            ),
        ),
        "position_completed": (
            "the position does not give {text}, taken from where the arm stands; no document says that of a variable"
        ),
        "turns_otherwise": (
            "on the way the tool was turned about one axis; no public text says how KRL turns it: a swing of its x "
            "axis and a turn about that are up to {off_deg:.1f} deg from there"
        ),
        "turns_either_way": (
            "the tool turns by 180 deg, and both ways round are equally far: it was turned about ({axis}) of the base; "
            "no public text says which way the controller takes"
        ),
        "turn_not_followed": (
            "checked with the tool turning evenly to the target's orientation; {text} asks for another turn, which is "
            "not followed"
        ),
        "relative_turn_assumed": (
            "the angles were taken for turns about the axes of the base; added to the angles before, they lead to an "
            "orientation {off_deg:.1f} deg from that"
        ),
        "frame_given_twice": (
            "the program's own {name} was taken; that of the frames given for the check is {moved_mm:.1f} mm and "
            "{turned_deg:.2f} deg from it"
        ),
        "kept_to_next_start": (
            "motions depend on {name}, which keeps what is set here: checked for the first start only, not for later "
            "starts or cycles"
        ),
        "set_elsewhere": (
            "motions depend on {name}, and {file} sets it too (line {line}): checked with the value of the data file "
            "only"
        ),
        "waits_for_others": (
            "nothing that was read ends this wait ('{condition}'): another task does, and what else that sets is not "
            "known"
        ),
        "errors_not_followed": (
            "the program may go on after an error in this routine, or in one that it calls; that was followed for few "
            "instructions only (waits with a time limit, files, sockets), and not all that is skipped or set then"
        ),
        "acceleration_not_known": (
            "the acceleration '{word}' is not known, or not above 0; one was assumed for duration and joint "
            "accelerations"
        ),
        "rest_not_checked.targets": (
            "only the first {checked} motions that are carried out were checked; of those from here on {targets} "
            "targets, for reach and limits, but not the motions between them"
        ),
        "rest_not_checked": "only the first {checked} motions that are carried out were checked, none from here on",
        "begun_again": (
            "if the controller begins the program again from where it ends (run mode Continuous), this motion has: "
            "{codes:, }"
        ),
        "loop_comes_back_otherwise": (
            "the loop begins again with J{joint} {difference_deg:.2f} {unit} from where it was in the round that was "
            "checked"
        ),
        "program_data_file_missing": "{file} is missing, which holds the program's points",
        "program_begun_within": (
            "followed from {routine} alone: the program begins in {file}, and what it sets before was not examined"
        ),
        "program_name_twice": "{name} is declared twice; the later one counts",
        "program_module_twice": "{name} is here too, and differs: {taken} was taken",
        "program_not_understood": "not understood: {text}",
        "program_not_simulated": "not simulated: {text}",
        "program_rows_from_rest": (
            "each row was checked as a move from rest to rest in its time; an arm that runs through the rows needs "
            "less speed and acceleration, and may leave the straight way between rows (a study's path of kind table "
            "follows it as one motion)"
        ),
        "program_form_inferred": "the structure of <{element}> is not documented; it was read like that of <while>",
        "program_joint_speed_inferred": (
            "how long joint motions at speeds of the tool ('{word}') take is not documented; as long as the tool's "
            "straight way at that speed was assumed"
        ),
        "program_other_encoding": "the file is not UTF-8; it was read as {encoding}",
        "program_nothing_moves": "no instruction moves the arm",
        "load_not_examined": "{mass_kg:g} kg on the flange from here on; torques with this load are not examined",
        "load_not_examined.text": "not all numbers of the load {text} are known; torques with it are not examined",
        "load_above_payload": "{mass_kg:g} kg on the flange, and the arm may carry {payload_kg:g} kg",
        "written_zones_dropped": Plural(
            "zones",
            "{count} zone has no equivalent in this language: the arm stops there",
            "{count} zones have no equivalent in this language: the arm stops there",
        ),
        "written_splines_as_lines": Plural(
            "points",
            "{count} point of splines written as a straight line",
            "{count} points of splines written as straight lines",
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
        "written_arcs_turn_otherwise": Plural(
            "arcs",
            "{count} arc turns the tool about one axis, and not with the path as the arc that was read",
            "{count} arcs turn the tool about one axis, and not with the path as the arcs that were read",
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
        "remedy.clear_of_assumed": (
            "Keep {margin:g} mm between {pair}, or give shapes from a drawing or model in the robot's file."
        ),
        "remedy.joint_move": (
            "From where this line starts, go by a joint move to the joint angles ({end}) deg: in the model it is "
            "within limits, speeds and clear, at the joint speed assumed here. On the way the tool does not go "
            "straight."
        ),
        "remedy.joint_moves": (
            "From where this line starts, go by joint moves to the joint angles ({via}) deg, then ({end}) deg: in the "
            "model they are within limits, speeds and clear, at the joint speed assumed here. On the way the tool "
            "does not go straight."
        ),
        "remedy.joint_move#off": (
            "From where this line starts, go by a joint move to the joint angles ({end}) deg, on which the tool leaves "
            "the programmed way by up to {far:.1f} mm and tilts by up to {turned:.1f} deg from it: in the model it is "
            "within limits, speeds and clear, at the joint speed assumed here."
        ),
        "remedy.joint_moves#off": (
            "From where this line starts, go by joint moves to the joint angles ({via}) deg, then ({end}) deg, on "
            "which the tool leaves the programmed way by up to {far:.1f} mm and tilts by up to {turned:.1f} deg from "
            "it: in the model they are within limits, speeds and clear, at the joint speed assumed here."
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
        "remedy.joint_jumps#stays": (
            "If the tool should stay here, leave this line out; if the joint should turn, turn it where there is room."
        ),
        "remedy.joint_jumps#moves": "Teach the target with this joint near to where it comes from.",
        "remedy.slower": (
            "Lower the speed of this line to {percent:g} % of its own or less, and its acceleration to "
            "{acceleration:g} %."
        ),
        "programs.waits": Plural("count", "and {count} wait for a signal", "and {count} waits for signals"),
    }
)


@say.register
def _(found: ProgramCounts) -> str:
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


@say.register
def _(found: found_in.TargetNotGiven) -> str:
    reason = word("target_reason", REASONS, found.reason)
    if not found.target:
        return say_as(found, reason=reason)
    if found.reason == "perhaps_changed":
        return sentence("target_not_given.perhaps", name=found.target)
    return sentence("target_not_given.named", name=found.target, reason=reason)


@say.register
def _(found: found_in.TargetOutOfReach) -> str:
    if found.carried:
        return sentence("target_out_of_reach.carried")
    if not found.reasons:
        return sentence("target_out_of_reach.bare")
    return say_as(found)


@say.register
def _(found: found_in.StretchOutOfReach) -> str:
    reasons = joined(listed(found.reasons))
    if found.carried:
        return sentence("way_out_of_reach.carried", at_mm=found.at_mm, reasons=reasons)
    return say_as(found, reasons=reasons)


@say.register
def _(
    found: found_in.ConfigurationEnds | found_in.ArrivesOtherwise | found_in.LoopComesBackOtherwise,
) -> str:
    return say_as(found, unit=unit_of(found.slides))


@say.register
def _(found: FasterThanAssumed) -> str:
    unit = unit_of(found.slides)
    return say_as(found, unit=unit, needed=needed_text(found.needed_deg_s, over_limit(found), f"{unit}/s"))


@say.register
def _(found: AcceleratesMoreThanAssumed) -> str:
    unit = unit_of(found.slides)
    return say_as(found, unit=unit, needed=needed_text(found.needed_deg_s2, over_limit(found), f"{unit}/s²"))


@say.register
def _(found: found_in.MeetsSingularity) -> str:
    parts = {"type": singularity_word(found.type), "at": found.at_mm}
    if found.bounded:
        return sentence("meets_singularity.bounded", **parts)
    return say_as(found, **parts)


@say.register
def _(found: found_in.PassesSingularity) -> str:
    parts = {"type": singularity_word(found.type), "at": found.at_mm, "distance": found.distance}
    if found.type == "shoulder":
        return sentence("passes_singularity.mm", **parts)
    return say_as(found, **parts)


@say.register
def _(found: found_in.ConfigurationChanges) -> str:
    return say_as(found, before=branch_word(found.before), after=branch_word(found.after))


@say.register
def _(found: found_in.MotionCollides) -> str:
    parts = {"touches": joined(listed(found.touches[:MAX_PAIRS]))}
    if len(found.touches) > MAX_PAIRS:
        return sentence("motion_collides.assumed_more" if found.assumed else "motion_collides.more", **parts)
    return sentence("motion_collides.assumed", **parts) if found.assumed else say_as(found, **parts)


@say.register
def _(found: found_in.ZoneCollides) -> str:
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


@say.register
def _(found: found_in.ArcGoesOn) -> str:
    if found.angle_deg is None:
        return sentence("arc_goes_on.unknown")
    if found.turns:
        return sentence("arc_goes_on.turns", angle=found.angle_deg)
    return say_as(found)


@say.register
def _(found: found_in.TurnsEitherWay) -> str:
    return say_as(found, axis=", ".join(f"{part:g}" for part in found.axis))


@say.register
def _(found: found_in.SpeedNotGiven) -> str:
    if found.word:
        assumed = f"{100 * found.assumed:g} %" if found.unit == "share" else f"{found.assumed:g} m/s"
        return sentence("speed_not_given.word", word=found.word, assumed=assumed)
    if found.unit == "share":
        return sentence("speed_not_given.share", percent=found.assumed * 100)
    return say_as(found)


@say.register
def _(found: found_in.TurnSpeedNotGiven) -> str:
    if found.word:
        return sentence("turn_speed_not_given.word", word=found.word, assumed_deg_s=found.assumed_deg_s)
    return say_as(found)


@say.register
def _(found: found_in.LoadNotExamined) -> str:
    return sentence("load_not_examined.text", text=found.text) if found.text else say_as(found)


@say.register
def _(found: found_in.RestNotChecked) -> str:
    if not found.targets:
        return say_as(found)
    return sentence("rest_not_checked.targets", checked=found.checked, targets=found.targets)


@say.register
def _(found: text.ArcsSplit) -> str:
    return say_as(found, deviation=found.deviation_m * 1000)


@say.register
def _(found: text.WrittenUnsafe) -> str:
    return say_as(found, verdict=outcome_word(found.verdict))


@singledispatch
def remedy(finding: Any) -> str:
    """What to do about a finding, as a sentence in the language in use; empty where nothing is to be done."""
    return word("remedy", REMEDIES, finding.code) if finding.code in REMEDIES else ""


@remedy.register
def _(found: found_in.TargetNotGiven) -> str:
    return word("remedy", TARGETS, found.reason if found.reason in TARGETS else "undefined")


@remedy.register
def _(found: found_in.ClearOfAssumed) -> str:
    return sentence("remedy.clear_of_assumed", margin=found.margin_mm, pair=found.pair)


@remedy.register
def _(found: MeetsSingularity | PassesSingularity) -> str:
    return word("remedy", SINGULAR, found.type)


@remedy.register
def _(found: NotFollowedToEnd) -> str:
    return word("remedy", STOPPED, found.kind)


@remedy.register
def _(found: AboveLimit | BelowLimit) -> str:
    side = "above" if isinstance(found, AboveLimit) else "below"
    return sentence(f"remedy.limit#{side}", joint=found.joint, limit=found.limit_deg, unit=tr("deg"))


@remedy.register
def _(found: MotionCollides) -> str:
    there = next((touch for touch in found.touches if touch.at_target), None)
    pair = (there or found.touches[0]).pair
    if isinstance(pair, LinkAndSolid):
        return sentence("remedy.collision#solid_at_target" if there else "remedy.collision#solid", name=pair.solid)
    return sentence("remedy.collision#links")


@remedy.register
def _(found: Pace) -> str:
    return _slower(_pace(found))


@remedy.register
def _(found: JointJumps) -> str:
    return sentence("remedy.joint_jumps#stays" if found.moved_mm < STAYS_MM else "remedy.joint_jumps#moves")


@remedy.register
def _(found: ZoneTooLarge) -> str:
    return sentence("remedy.zone_too_large", half=found.motion_mm / 2)


def rates_text(paces: Sequence[Pace]) -> str:
    """What is too fast on a line, all joints together: of speeds and of accelerations the worst."""
    joints = sorted({each.joint for each in paces})
    known = [isinstance(each, TooFast | AccelerationTooGreat) for each in paces]
    kinds = (TooFast | FasterThanAssumed, AccelerationTooGreat | AcceleratesMoreThanAssumed)
    worst = [min(alike, key=_pace) for kind in kinds if (alike := [each for each in paces if isinstance(each, kind)])]
    limits = sentence("rate_limits#known" if any(known) else "rate_limits#assumed")
    parts = {"joints": joints, "named": ", ".join(f"J{joint}" for joint in joints), "limits": limits}
    if all(over_limit(each) > UNBOUNDED for each in worst):
        return sentence("programs.rates#far", times=UNBOUNDED, **parts)
    return sentence("programs.rates", worst=tuple(map(_pace_needed, worst)), **parts)


def over_limit(found: Pace) -> float:
    """What a joint needs over what it has."""
    match found:
        case FasterThanAssumed():
            return found.needed_deg_s / found.assumed_deg_s
        case AcceleratesMoreThanAssumed():
            return found.needed_deg_s2 / found.assumed_deg_s2
        case _:
            return found.ratio


def _pace_needed(found: Pace) -> str:
    match found:
        case FasterThanAssumed():
            return rate_needed(TooFast(found.joint, found.needed_deg_s, found.assumed_deg_s, found.slides))
        case AcceleratesMoreThanAssumed():
            return rate_needed(
                AccelerationTooGreat(found.joint, found.needed_deg_s2, found.assumed_deg_s2, found.slides)
            )
        case _:
            return rate_needed(found)


def singular_cause(found: MeetsSingularity | PassesSingularity) -> str:
    """That a line comes to a singular pose, and how the arm stands there."""
    return sentence("programs.cause", finding=found, pose=singular_pose(found.type))


def remedy_at(found: FindingAt | LocatedFinding) -> str:
    """What to do about a finding: joint moves that pass, or else what mends it and was not tried here."""
    if not found.joint_moves:
        return remedy(found.finding)
    *via, end = [", ".join(alike(row)).replace("−", "-") for row in found.joint_moves]  # to be copied into a program
    parts = {"end": end, **({"via": via[0]} if via else {})}
    form = "remedy.joint_moves" if via else "remedy.joint_move"
    if found.off_mm is None:
        return sentence(form, **parts)
    return sentence(f"{form}#off", far=found.off_mm, turned=found.off_deg, **parts)


def _pace(found: Pace) -> float:
    """The share of its pace at which the joint keeps its limit: speeds go with it, accelerations with its square."""
    over = over_limit(found)
    return 1 / over if isinstance(found, TooFast | FasterThanAssumed) else 1 / math.sqrt(over)


def _slower(pace: float) -> str:
    """The same motion at another pace: a lower speed alone is no help where it is not reached."""
    percent = math.floor(1000 * pace) / 10
    return sentence("remedy.slower", percent=percent, acceleration=math.floor(percent**2 / 10) / 10)


def remedies(findings: Sequence[CheckFinding | FindingAt], program: Iterable[FindingAt] = ()) -> list[str]:
    """What to do about findings at one line, each thing once: about those that weigh most; of paces the lowest, and
    none where another motion takes the line's place.

    ``program``: all findings of a program that a line is of, whose loop may be what leads the line astray.
    """
    located = [each for each in findings if isinstance(each, FindingAt)]
    worst = max((RANKS[each.level] for each in located), default=0)
    checked: list[tuple[CheckFinding, FindingAt | None]] = [
        (each, None) for each in findings if not isinstance(each, FindingAt)
    ]
    checked += [(each.finding, each if each.joint_moves else None) for each in located if RANKS[each.level] == worst]
    if any(moves for _, moves in checked):
        checked = [(each, moves) for each, moves in checked if not isinstance(each, PACED)]
    if any(isinstance(each, JointJumps) for each, _ in checked):
        checked = [(each, moves) for each, moves in checked if moves or not isinstance(each, ConfigurationChanges)]
    drifts = [each.finding for each in program if isinstance(each.finding, NotFollowedToEnd)]
    if worst == RANKS["fail"]:
        checked = [*((each, None) for each in drifts if each.kind == "drifts"), *checked]
    paced = [each for each, _ in checked if isinstance(each, PACED)]
    slowest = min(paced, key=_pace, default=None)
    kept = [(each, moves) for each, moves in checked if not isinstance(each, PACED) or each is slowest]
    return list(dict.fromkeys(text for each, moves in kept if (text := remedy_at(moves) if moves else remedy(each))))


def cycle_text(program: ProgramSummary) -> str:
    """How long a program takes, and what that leaves out."""
    cycle = program.cycle
    low, high = f"{cycle.blended_s:.2f}", f"{cycle.stopping_s:.2f}"
    time = tr("{time} s", time=low) if low == high else tr("{low} to {high} s", low=low, high=high)
    what = tr("one round: {time}", time=time) if cycle.repeats else time
    waits = sentence("programs.waits", count=cycle.waits) if cycle.waits else ""
    unknown = "" if cycle.complete else tr("without motions whose path is unknown or was not checked")
    return joined([what, waits, unknown], ", ")
