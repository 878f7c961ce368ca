"""What a stage checked, why not all of it, and what it assumed, in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from er3a.collision.pairs import BASE, link_label
from er3a.finding import AnyFinding
from er3a.pipeline.language import N_, own_title, tr
from er3a.pipeline.messages.pages import GROUP_NAMES
from er3a.pipeline.messages.say import bracketed, joined, say, say_as, sentence, texts, word
from er3a.pipeline.results import NotChecked
from er3a.pipeline.scope import Check, Coverage, Open

CHECKS: Mapping[Check, str] = {
    "table": N_("table against documents"),
    "round_trips": N_("round trips"),
    "limits": N_("joint limits"),
    "reach": N_("reach"),
    "rates": N_("speeds and accelerations"),
    "singularity": N_("singularities"),
    "self_collision": N_("collisions with itself"),
    "scene_collision": N_("collisions with the scene"),
    "torque": N_("torques"),
    "camera": N_("camera"),
    "program_lines": N_("lines of programs"),
    "units": N_("units"),
}

TEXTS = texts(
    {
        "link#base": "base",
        "link#number": "link {number}",
        "reserved.dynamics.no_limits": (
            "What is not known comes on top of these torques, whose ± is that of the known masses alone: don't choose "
            "motors by them."
        ),
        "not_checked": "Not checked: {checks}.",
        "not_checked.one": "{check}: {gaps}",
        "coverage.all": "all",
        "coverage.none": "none",
        "coverage.part": "{covered} of {of}",
        "gap.not_run": "the check was not made",
        "gap.limits_assumed": "the robot's file assumes the limits",
        "gap.not_followed": "paths not followed",
        "gap.points_missed": "points that the motion misses as it rounds corners",
        "gap.tool_turned": "the joints set only part of how the tool is turned (off by up to {amount:.1f}°)",
        "gap.undecided_cells": "undecided: {amount:.0f} % of the volume, so raise proof_cells",
        "gap.half_turns": "turns of half a circle, which a controller may make either way",
        "gap.tray_inside": "the tray would stand inside solids",
        "gap.rates_contradict": "the trajectory's rates contradict its points",
        "gap.uncovered_links": "links that reach out of all shapes",
        "gap.partial_links": "links whose shapes cover less than {amount:.0f} % of their length",
        "gap.bare_tool": "the tool has no shape (`carried` in the scene)",
        "gap.allowed_contacts": "contacts that the scene's or the robot's file allows",
        "gap.wrong_shapes": "shapes that overlap where no arm's can",
        "gap.no_scene": "no scene is given",
        "gap.base_inside": "the base lies inside solids",
        "gap.inside_solid": "places inside solids",
        "gap.gripper": "the gripper has no shape (`carried` in the scene)",
        "gap.gravity": "gravity is set to {amount:g} m/s²",
        "gap.paths_not_run": "paths that may not be run",
        "gap.program_loads": "loads that programs name",
        "gap.arm_errors": "the file does not state all of the arm's own errors",
        "gap.out_of_view": "objects out of the camera's stated view",
        "gap.flange_frame": "the recorded poses may be a tool's, not the flange's",
        "gap.base_frame": "the recorded poses may be in another frame than the base",
        "gap.intrinsics": "the camera's intrinsics are unknown, and no touched points confirm the result",
        "gap.program_rest": "lines that may move the arm and belong to no path",
        "gap.program_findings": "doubts or faults in these programs",
        "gap.program_lines": "lines not followed each time",
        "gap.units": "numbers that look like radians or metres (`units_checked: true` confirms them)",
        "assumed.own_values": "values of the robot's file that are inferred",
        "assumed.own_speeds": "joint speeds",
        "assumed.own_accelerations": "joint accelerations",
        "assumed.tool": "no tool: the flange's centre is the tip",
        "assumed.carried": "nothing is carried",
        "assumed.guessed_pairs": "pairs of links for which guessed shapes are too coarse",
        "assumed.base_contacts": "the base is mounted on these solids",
        "assumed.start_branches": "the solution to start with",
        "assumed.arm_angles": "the arm angle",
        "assumed.solutions_complete": "the solutions found are all",
        "assumed.program_starts": "where programs start from",
        "assumed.program_load": "programs name loads",
        "assumed.outer_axes": "axes beside the arm's rest",
        "assumed.capability": "tool directions were not computed",
        "assumed.places": "no place for the tray was looked for",
        "assumed.tray_nowhere": "no place for the tray was found",
        "assumed.references": "no reference states these",
        "assumed.loose_references": "references too loose to tell",
        "assumed.tool_and_base": "the study's tool and base",
        "assumed.link_masses": "links without a mass weigh nothing",
        "assumed.peak_torques": "peak torques are unknown",
        "assumed.rated_torques": "rated torques are unknown",
        "assumed.rotor_inertias": "rotors have no inertia",
        "assumed.friction": "joints have no friction",
        "assumed.wrist_limits": "wrist limits are unknown",
        "assumed.load": "tool and payload weigh nothing",
        "assumed.open_space": "nothing stands around the arm",
        "assumed.mounting": "the base stands upright",
        "assumed.real_camera": "the camera is simulated",
        "assumed.joint_zeros": "joint zeros",
        "assumed.small_joint_zeros": "joint zeros are right to {amount:g} deg",
        "assumed.touched_points": "no touched points confirm the result",
        "assumed.given_intrinsics": "the camera's intrinsics are exact",
        "assumed.pose_intrinsics": "the camera's intrinsics are exact",
        "never.validation": "Never checked: how the arm at hand differs from its table. A calibration measures that.",
        "never.workspace": "Never checked: collisions along the way to a point, and points between those sampled.",
        "never.inverse": "Never checked: the motions from one target to the next.",
        "never.trajectory": (
            "Never checked: torques, the ways between paths, real shapes, and how a controller rounds and ramps."
        ),
        "never.collision": "Never checked: real shapes; links where a joint joins them; what lies between samples.",
        "never.dynamics": "Never checked: heat, wear, elasticity, and what drives can do at speed.",
        "never.vision": "Never checked: the detector, the part in the gripper, and torques.",
        "never.programs": (
            "Never checked: torques, the way back to a program's start, and how a controller rounds and ramps."
        ),
    }
)


MAX_NAMED = 6  # in a sentence; the table names all
_words: dict[str, tuple[str, Mapping[str, str]]] = {}
RESERVED: Mapping[str, tuple[str, ...]] = {
    "dynamics.no_limits": ("link_masses", "load", "friction"),
}


def names_in_words(reason: str, code: str, words: Mapping[Any, str]) -> None:
    """Say a reason's names by a table of words marked with ``N_``; a stage's messages call this."""
    _words[reason] = code, {str(name): text for name, text in words.items()}


names_in_words("own_values", "group", GROUP_NAMES)


def open_names(found: Open, most: int | None = None) -> str:
    """Of which, in the language in use; beyond ``most`` how many more."""
    code, words = _words.get(found.reason, ("", {}))
    named = [word(code, words, name) for name in found.names[:most]]
    rest = len(found.names) - len(named)
    return joined([*named, *([sentence("more", count=rest)] if rest else [])], ", ")


def gap_text(found: Open, most: int | None = MAX_NAMED) -> str:
    """Why a check does not cover all, and of what."""
    return bracketed(sentence(f"gap.{found.reason}", amount=found.amount), open_names(found, most))


def assumed_text(found: Open, most: int | None = None) -> str:
    """What is assumed, and of what."""
    return bracketed(sentence(f"assumed.{found.reason}", amount=found.amount), open_names(found, most))


def check_name(check: Check) -> str:
    """A check in the language in use."""
    return tr(CHECKS[check])


def covered_text(found: Coverage) -> str:
    """How much a check covers: all, none, or how many of how many."""
    form = "all" if found.complete else "none" if not found.covered else "part"
    return sentence(f"coverage.{form}", covered=found.covered, of=found.of)


def missed_text(found: Coverage) -> str:
    """A check that does not cover all, and why."""
    gaps = joined(map(gap_text, found.gaps), ", ") or covered_text(found)
    return sentence("not_checked.one", check=check_name(found.check), gaps=gaps)


def never_text(stage: str) -> str:
    """What a stage never checks; empty for a stage of others, which says it on its page."""
    return sentence(key) if (key := f"never.{stage}") in TEXTS else ""


def say_reserved(finding: AnyFinding, assumed: Iterable[Open]) -> str:
    """A verdict's finding, and what it is not to be taken for where its stage assumed something."""
    reserved = any(each.reason in RESERVED.get(finding.code, ()) for each in assumed)
    return joined([say(finding), sentence(f"reserved.{finding.code}") if reserved else ""], " ")


@say.register
def _(found: NotChecked) -> str:
    return say_as(found, checks=joined(map(missed_text, found.checks)))


def body_word(name: str) -> str:
    """A body of the arm, or what is carried, by its name."""
    if name == link_label(BASE):
        return sentence("link#base")
    number = name.removeprefix("link_")
    return sentence("link#number", number=number) if number != name else own_title(name)


def pair_words(label: str) -> str:
    """Two bodies by their label in columns of text."""
    return tr(" and ").join(map(body_word, label.split("/")))
