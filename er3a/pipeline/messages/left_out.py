"""What a stage did not examine, in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeVar

from er3a.by_value import Finding
from er3a.collision.pairs import BASE, link_label
from er3a.pipeline.language import own_title, tr
from er3a.pipeline.messages.pages import GROUP_NAMES
from er3a.pipeline.messages.say import bracketed, joined, say, say_as, sentence, texts, word
from er3a.pipeline.results import LeftOut, LeftOutSubject, NoPass

TEXTS = texts(
    {
        "link#base": "base",
        "link#number": "link {number}",
        "left_out.obstacles": (
            "obstacles: none are given, so the arm was checked only against itself and what it carries"
        ),
        "reserved.dynamics.no_limits": (
            "What is not known comes on top of these torques, whose ± is that of the known masses alone: don't choose "
            "motors by them."
        ),
        "no_pass": "Not examined, and therefore no pass: {missed}.",
        "left_out.bare_links": "collisions of links without a shape that lie within the shapes of others",
        "left_out.uncovered_links": (
            "collisions of links that reach out of all shapes: they have none, or look larger than the shapes checked"
        ),
        "left_out.partial_links": (
            "collisions of the rest of links whose shapes reach along less than {amount:.0f} % of their lengths in the "
            "table"
        ),
        "left_out.bare_tool": (
            "collisions of the tool (or bare flange): it reaches out of the last link's shapes, and the scene gives no "
            "shape to all of it (`carried`)"
        ),
        "left_out.allowed_contacts": "collisions that the scene's or the robot's file allows",
        "left_out.arm_errors": "what the arm's own errors add to a grasp's: the file does not state all of them",
        "left_out.objects_out_of_view": "whether the camera can have seen objects that lie out of its stated view",
        "left_out.unexamined_pairs": "collisions of pairs whose shapes can't be right",
        "left_out.guessed_pairs": (
            "collisions of these links with each other: the shapes guessed from the table are too coarse there"
        ),
        "left_out.allowed_pairs": ("collisions of pairs that the robot's file allows: they never meet, or always do"),
        "left_out.joined_pairs": (
            "collisions of these links where a joint joins them: of meshes all, else those around the joint"
        ),
        "left_out.scene_shapes": "whether what stands in the cell is shaped and placed as the scene's file says",
        "left_out.shallow_overlaps": "overlaps of less than {amount:g} mm between the points measured",
        "left_out.own_limits": "the joints' real limits: the robot's file assumes all or some of them",
        "left_out.own_values": "whether these values are the arm's: the robot's file grades them as inferred",
        "left_out.own_speeds": "the joints' real speeds: no document gives them, so speeds are assumed",
        "left_out.own_accelerations": (
            "the joints' real accelerations: no document gives them, so accelerations are assumed"
        ),
        "left_out.jerk": "jerk: no limit is given",
        "left_out.torques": "torques, payload and deflection of the arm",
        "left_out.paths": "paths that were not followed to their end",
        "left_out.path_stretches": (
            "stretches of paths that the computed bounds can't decide, or along which no pose of the arm is known"
        ),
        "left_out.strategies": "avoidance strategies that the study does not ask for",
        "left_out.program_lines": "lines of programs that were not examined, or not each time",
        "left_out.program_rest": "lines of programs that may move the arm but belong to no path checked",
        "left_out.program_findings": (
            "what these programs do at lines where their check has a doubt or a fault (er3a check-program says more)"
        ),
        "left_out.given_rates": (
            "what a controller makes of rates of trajectories that do not go together (joint, time, the one / the "
            "other): the file states none there, or others than its points need"
        ),
        "left_out.missed_rows": (
            "the points of tables that the motion passes beside, by up to so much: corners are rounded over half of "
            "the shorter side, as neither blend_mm nor blend_deg is given (0 stops at each point), and a controller "
            "that goes to the points or blends otherwise moves elsewhere"
        ),
        "left_out.half_turns": (
            "the other way round, where the tool turns by exactly 180 deg (segments by their numbers): no "
            "`half_turn_axis` says which, and a controller may turn it either way"
        ),
        "left_out.start_branches": (
            "other branches of paths that begin at a pose and name none: the arm may stand on another one"
        ),
        "left_out.arm_angles": (
            "other arm angles: these paths leave them open, and a controller that holds the elbow elsewhere moves the "
            "links elsewhere"
        ),
        "left_out.program_starts": "motions from where the arm is not known to stand",
        "left_out.program_again": (
            "the way from a program's end to its beginning, where a controller runs it again and again"
        ),
        "left_out.outer_axes": "axes beside the arm's, which are taken to be at rest",
        "left_out.controller_language": "whether the controller takes this robot language",
        "left_out.controller_ramps": "the controller's own ramps and blends, which decide times and corners",
        "left_out.joint_vectors": "joint vectors other than {amount:,.0f} random ones: shares are estimates",
        "left_out.lost_cells": "whether {amount:,.0f} cells in which no clear arm was found are really blocked",
        "left_out.link_masses": "torques of links whose mass is not given; they count as massless",
        "left_out.peak_torques": "peak torques of drives whose limit no document gives",
        "left_out.rated_torques": "RMS and holding torques of drives whose rated torque no document gives",
        "left_out.rotor_inertias": "torques of the rotors: their inertias are not known",
        "left_out.friction": "friction in the joints: it is not known",
        "left_out.wrist_limits": "payload, moments and inertias that the wrist allows, where no document gives them",
        "left_out.load": "tool and payload: the study doesn't give their masses, or not all of them",
        "left_out.paths_not_run": "paths that may not be run as they are: motors and limits don't count them",
        "left_out.torque_peaks": "torques of paths between the times computed, at least {amount:,.0f} of each",
        "left_out.program_torques": "torques of programs that are not among the paths",
        "left_out.program_loads": "torques with the loads that programs name",
        "left_out.drive_behaviour": (
            "what changes with speed, heat and wear in motors, gears and brakes, and what elasticity adds"
        ),
        "left_out.other_gravity": (
            "torques on the ground: the study sets gravity to {amount:g} m/s², which no place on Earth has"
        ),
        "left_out.mounting": (
            "torques of an arm on a wall, a slope or a ceiling: neither robot file nor study places the base, and it "
            "is taken to stand upright"
        ),
        "left_out.real_camera": "what a real camera sees: the samples are simulated",
        "left_out.boardless_images": "images in which no board was found",
        "left_out.left_out_samples": "samples that contradict the others: the calibration does not rest on them",
        "left_out.copied_samples": "samples that repeat another one exactly: they measure nothing and are left out",
        "left_out.joint_zeros": (
            "whether the zeros of these joints are right: the samples hold no joint angles, or a wrong zero acts on "
            "them as another pose of camera or board would"
        ),
        "left_out.small_joint_zeros": (
            "wrong joint zeros below {amount:g} deg: the samples do not tell them from noise, or they are not named"
        ),
        "left_out.touched_points": "where the arm really touches what the camera sees: no touched points are given",
        "left_out.flange_poses": (
            "whether the recorded poses are the flange's, as the robot's table has it, and not a tool's: the samples "
            "hold no joint values to compare them with"
        ),
        "left_out.given_intrinsics": (
            "errors of the camera's intrinsics: the file gives them, and they count as exact; the intervals do not "
            "include them"
        ),
        "left_out.pose_intrinsics": (
            "errors of the camera's intrinsics: the board's poses were computed with intrinsics that the set doesn't "
            "give; errors of theirs are in no interval"
        ),
        "left_out.open_intrinsics": (
            "errors of the camera's intrinsics: the board's poses were computed with intrinsics that the set doesn't "
            "give; errors of theirs are in no interval, and no touched points show closely enough where the camera is"
        ),
        "left_out.base_poses": (
            "whether the recorded poses are in the robot's own base, not in a frame set at its controller: the samples "
            "hold no joint values to compare them with, and no touched points are given"
        ),
        "left_out.detections": "whether detected objects are where the detector says, within the deviations stated",
        "left_out.gripped_parts": "collisions of the objects themselves and of a part in the gripper",
        "left_out.grasps": "where these objects are and how they can be grasped: there is no calibration to rest on",
        "left_out.unjoined_cells": (
            "whether {amount:,.0f} clear cells can be reached from home: no chain of straight joint moves was found"
        ),
        "left_out.within_cells": "places within a cell of {amount:.0f} mm beside the one that an arm was found for",
        "left_out.targets": "targets without a solution within the limits",
        "left_out.turns": "other turns of the joints in solutions of targets, as there are many targets",
        "left_out.carried": "collisions of a tool, gripper or workpiece: the scene gives none a shape (`carried`)",
        "left_out.carried_shapes": "whether what the flange carries is shaped and held as the scene's file says",
        "left_out.tool": "the tool: none is given, so the flange's centre is taken as its tip",
        "left_out.plans": "motions for which the planner found none within its tries; there may be one",
        "left_out.references": "quantities that no reference states, or for which the robot's file gives no value",
        "left_out.loose_references": (
            "references whose source leaves so much open that a value taken at random would pass as often as not"
        ),
        "left_out.conflicting_references": (
            "references that the table misses, and that other references which it meets contradict: they decide nothing"
        ),
        "left_out.tool_and_base": (
            "the tool, and where the study places the base: references speak of the flange and the robot's own base"
        ),
        "left_out.table_entries": "entries of the table that independent references don't settle, signs included",
        "left_out.diagnosis": "which entry is wrong: diagnosis is for arms whose joints all turn",
        "left_out.more_faults": "tables with more wrong entries than one or two",
        "left_out.round_trips": "poses other than {amount:,.0f} random ones that were solved back",
        "left_out.near_singular_poses": "joint values at {amount:,.0f} random poses near singularities",
        "left_out.all_solutions": "whether the solutions found are all: no method here finds those of this arm",
        "left_out.reach_starts": "greatest and least reach that searches from {amount:,.0f} starts don't find",
        "left_out.the_arm_itself": "how the arm at hand differs from its table; a calibration measures that",
        "left_out.uncertain_solutions": "whether the solutions found are all",
        "left_out.advice": "what would help at targets without a solution",
        "left_out.orientations": (
            "how the tool is turned at these targets and on these paths: the arm's joints set only part of it (off by "
            "up to {amount:.1f}°)"
        ),
        "left_out.rules": "rules of the mix for which the robot's file has no data",
        "left_out.ways_between": "motions from one target, or path, to the next",
        "left_out.colliding_reach": (
            "collisions, in reach, voids and tool directions: arms count there that touch themselves or obstacles"
        ),
        "left_out.undecided_volume": "{amount:.3g} L that the proof of the reached volume leaves undecided",
        "left_out.hidden_voids": (
            "what voids lie in the {amount:.0f} % of the volume that so few proof_cells leave undecided"
        ),
        "left_out.tool_directions": "tool directions between the {amount:,.0f} that were asked in each cell",
        "left_out.capability": "tool directions, and where a tray can stand",
        "left_out.places": "where the tray can stand: a pose takes too long with this arm",
        "left_out.sampled_places": (
            "points and directions between those asked, at {amount:,.0f} places for the tray that pass by samples only"
        ),
        "left_out.between_places": "places for the tray between grid points {amount:.0f} mm apart",
        "left_out.tray_nowhere": (
            "motions into the tray: no place was found where the tool reaches all of it, which the verdict does not "
            "count"
        ),
        "left_out.base_contacts": "whether the base is mounted where it overlaps these solids, as is assumed",
        "left_out.base_inside": "collisions of the base, whose middle lies in these solids: scene or base is misplaced",
        "left_out.places_in_solids": (
            "whether these places, or the scene, are right: they lie inside solids on which they don't stand"
        ),
        "left_out.units": (
            "whether numbers that look like radians or metres are degrees and mm, as their keys say: convert them, or "
            "confirm them by `units_checked: true` in their file (in a table: a column)"
        ),
        "left_out.box_directions": (
            "directions of the tray's cone: the arm's joints don't set them all, and those that they don't are not "
            "asked"
        ),
        "left_out.placed_box": (
            "collisions with the tray where it is placed, or with its stand: no path, program or target was checked "
            "with them"
        ),
    }
)


MAX_NAMED = 6  # in a sentence; the table names all
_words: dict[LeftOutSubject, tuple[str, Mapping[str, str]]] = {}
RESERVED: Mapping[str, tuple[LeftOutSubject, ...]] = {
    "dynamics.no_limits": ("link_masses", "load", "friction"),
}
NameT = TypeVar("NameT", bound=str)


def names_in_words(subject: LeftOutSubject, code: str, words: Mapping[NameT, str]) -> None:
    """Say a subject's names by a table of words marked with ``N_``; a stage's messages call this."""
    _words[subject] = code, {str(name): text for name, text in words.items()}


names_in_words("own_values", "group", GROUP_NAMES)


def say_reserved(finding: Finding, not_examined: Iterable[LeftOut]) -> str:
    """A verdict's finding, and what it is not to be taken for where its stage left something out."""
    reserved = any(each.subject in RESERVED.get(finding.code, ()) for each in not_examined)
    return joined([say(finding), sentence(f"reserved.{finding.code}") if reserved else ""], " ")


def left_out_names(found: LeftOut, most: int | None = None) -> str:
    """Of which, in the language in use; beyond ``most`` how many more."""
    code, words = _words.get(found.subject, ("", {}))
    named = [word(code, words, name) for name in found.names[:most]]
    rest = len(found.names) - len(named)
    return joined([*named, *([sentence("more", count=rest)] if rest else [])], ", ")


def left_out_text(found: LeftOut) -> str:
    """What was not examined, in the language in use."""
    return sentence(f"left_out.{found.subject}", amount=found.amount)


@say.register
def _(found: NoPass) -> str:
    missed = [bracketed(left_out_text(each), left_out_names(each, MAX_NAMED)) for each in found.missed]
    return say_as(found, missed=joined(missed))


def body_word(name: str) -> str:
    """A body of the arm, or what is carried, by its name."""
    if name == link_label(BASE):
        return sentence("link#base")
    number = name.removeprefix("link_")
    return sentence("link#number", number=number) if number != name else own_title(name)


def pair_words(label: str) -> str:
    """Two bodies by their label in columns of text."""
    return tr(" and ").join(map(body_word, label.split("/")))
