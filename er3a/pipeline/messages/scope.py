"""What a stage checked, why not all of it, and what it assumed, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from er3a.collision.pairs import BASE, link_label
from er3a.pipeline.language import own_title, tr, words
from er3a.pipeline.messages.pages import GRADE_NAMES, GROUP_NAMES
from er3a.pipeline.messages.say import FORMATS, WORDS, bracketed, joined, sentence, texts, word
from er3a.pipeline.scope import Check, Coverage, Open

CHECKS: Mapping[Check, str] = words(
    {
        "table": "table against documents",
        "round_trips": "round trips",
        "limits": "joint limits",
        "reach": "reach",
        "rates": "speeds, accelerations",
        "singularity": "singularities",
        "self_collision": "self-collision",
        "scene_collision": "scene collision",
        "torque": "torques",
        "camera": "camera",
        "program_lines": "program lines",
        "units": "units",
    }
)
GAP_WORDS: Mapping[str, str] = words(
    {
        "unsettled": "documents leave entries open, or settle them but for signs",
        "not_run": "the check was not made",
        "limits_assumed": "the robot's file assumes the limits: write the arm's own into it",
        "not_followed": "paths not followed",
        "points_missed": "points that the motion misses as it rounds corners",
        "tool_turned": "the joints set only part of how the tool is turned (off by up to {amount:.1f}°)",
        "undecided_cells": "undecided: {amount:.0f} % of the volume, so raise proof_cells",
        "half_turns": "turns of half a circle, which a controller may make either way",
        "tray_inside": "the tray would stand inside solids",
        "rates_contradict": "the trajectory's rates contradict its points",
        "uncovered_links": "links that reach out of all shapes",
        "partial_links": "links whose shapes cover less than {amount:.0f} % of their length",
        "bare_tool": "the scene gives the tool no shape",
        "allowed_contacts": "contacts that the scene's or the robot's file allows",
        "wrong_shapes": "shapes that overlap where no arm's can",
        "coarse_shapes": "pairs of links whose shapes in the file are too large near their joints",
        "no_scene": "no scene is given",
        "base_inside": "the base lies inside solids",
        "inside_solid": "places inside solids",
        "gripper": "the scene gives the tool no shape",
        "gravity": "gravity is set to {amount:g} m/s²",
        "paths_not_run": "paths that may not be run",
        "program_loads": "loads that programs name",
        "no_torque_limits": "no motor's limit is known",
        "arm_errors": "the file does not state all of the arm's own errors",
        "out_of_view": "objects out of the camera's stated view",
        "flange_frame": "the recorded poses may be a tool's, not the flange's",
        "base_frame": "the recorded poses may be in another frame than the base",
        "intrinsics": "the camera's intrinsics are unknown, and no touched points confirm the result",
        "program_rest": "lines that may move the arm and belong to no path",
        "program_findings": "doubts or faults in these programs",
        "program_lines": "lines not followed each time",
        "units": "numbers that look like radians or metres (`units_checked: true` confirms them)",
        "as_above": "as above",
    }
)
"""Why a check does not cover all, by the reasons of gaps."""
ASSUMED: Mapping[str, str] = words(
    {
        "own_values": "values of the robot's file that are inferred",
        "own_speeds": "limits of joint speeds (once they are confirmed, begin at 10 % override)",
        "own_accelerations": "limits of joint accelerations",
        "tool": "no tool: the flange's centre is the tip",
        "beyond_flange": "the last link's shape goes on {amount:.0f} mm beyond the flange, where reach is counted to",
        "carried": "nothing is carried",
        "guessed_pairs": "pairs of links for which guessed shapes are too coarse",
        "base_contacts": "the base is mounted on these solids",
        "start_branches": "the solution to start with",
        "arm_angles": "arm angle",
        "solutions_complete": "the solutions found are all",
        "program_starts": "where programs start from",
        "program_load": "loads that programs name",
        "capability": "tool directions were not computed",
        "places": "no place for the tray was looked for",
        "references": "what no document states",
        "loose_references": "references too loose to tell",
        "tool_and_base": "the study's tool and base",
        "link_masses": "links without a mass weigh nothing",
        "peak_torques": "peak torques are unknown",
        "rated_torques": "rated torques are unknown",
        "rotor_inertias": "rotors have no inertia",
        "friction": "joints have no friction",
        "wrist_moments": "allowed moments at the wrist are unknown",
        "wrist_inertias": "allowed inertias at the wrist are unknown",
        "rated_payload": "the rated payload is unknown",
        "drives_guess": "the drives' limits, which the robot's file guesses",
        "wrist_guess": "the wrist's limits, which the robot's file guesses",
        "load": "tool and payload weigh nothing",
        "open_space": "nothing stands around the arm",
        "mounting": "the base stands upright",
        "real_camera": "the camera is simulated",
        "joint_zeros": "joint zeros, not tried",
        "small_joint_zeros": "joint zeros that were tried are right to {amount:g}°",
        "touched_points": "no touched points confirm the result",
        "given_intrinsics": (
            "the intrinsics are exact (a principal point 1 % of the focal length off turns the camera 0.6°)"
        ),
    }
)
"""What is assumed, by its reason."""

NEVER: Mapping[str, str] = words(
    {
        "validation": "Never checked: how the arm at hand differs from its table. A calibration measures that.",
        "workspace": "Never checked: collisions along the way to a point, points between samples, real shapes.",
        "inverse": "Never checked: the motions from one target to the next, and real shapes.",
        "trajectory": (
            "Never checked: torques, the ways between paths, real shapes, and how a controller rounds and ramps."
        ),
        "collision": "Never checked: real shapes; links where a joint joins them; joint space between samples.",
        "dynamics": "Never checked: heat, wear, elasticity, and what drives can do at speed.",
        "vision": "Never checked: the detector, torques, and real shapes.",
        "programs": (
            "Never checked: torques, ways back to the start, real shapes, and how a controller rounds and ramps."
        ),
    }
)
"""What each stage never checks."""
TEXTS = texts(
    {
        "link": "[base{base:?}][{base:!}link {number}]",
        "not_checked": "Not fully checked: {checks:missed; }.",
        "not_checked.one": "{check}: {gaps}",
        "coverage": "[all {of}{all:?}][none{none:?}][not all{some:?}][{part:?}{covered} of {of}]",
    }
)


MAX_NAMED = 6  # in a sentence; the table names all
_words: dict[str, tuple[str, Mapping[str, str]]] = {}


def names_in_words(reason: str, code: str, words: Mapping[Any, str]) -> None:
    """Say a reason's names by a table of words marked with ``N_``; a stage's messages call this."""
    _words[reason] = code, {str(name): text for name, text in words.items()}


names_in_words("own_values", "group", GROUP_NAMES)


def open_names(found: Open, most: int | None = None) -> str:
    """Of which, in the language in use; beyond ``most`` how many more."""
    code, words = _words.get(found.reason, ("", {}))
    count = len(found.names)
    if count > 2 and list(found.names) == [f"J{k}" for k in range(1, count + 1)]:
        return f"J1–J{count}"
    named = [own_title(word(code, words, name)) for name in found.names[:most]]
    rest = count - len(named)
    return joined([*named, *([sentence("more", count=rest)] if rest else [])], ", ")


def gap_text(found: Open, most: int | None = MAX_NAMED) -> str:
    """Why a check does not cover all, and of what."""
    return bracketed(tr(GAP_WORDS[found.reason], amount=found.amount), open_names(found, most))


def assumed_text(found: Open) -> str:
    """What is assumed, and of what."""
    return bracketed(tr(ASSUMED[found.reason], amount=found.amount), open_names(found, None))


def check_name(check: Check) -> str:
    """A check in the language in use."""
    return tr(CHECKS[check])


def covered_text(found: Coverage) -> str:
    """How much a check covers: all, none, or how many of how many."""
    whole, covered = found.complete, found.covered
    part = {"some": not whole and 0 < covered == found.of, "part": 0 < covered < found.of}
    marks = {"all": whole, "none": not (whole or covered), **part}
    return sentence("coverage", covered=covered, of=found.of, **marks)


def why_not_all(found: Coverage, most: int | None) -> str:
    """The reasons, with ``most`` names of each; of a check without any the one before it says them."""
    return joined([gap_text(gap, most) for gap in found.gaps], ", ") or gap_text(Open("as_above"))


def missed_text(found: Coverage) -> str:
    """A check that does not cover all, and why."""
    gaps = why_not_all(found, MAX_NAMED)
    return sentence("not_checked.one", check=check_name(found.check), gaps=gaps)


def never_text(stage: str) -> str:
    """What a stage never checks; empty for a stage of others, which says it on its page."""
    return tr(NEVER[stage]) if stage in NEVER else ""


FORMATS["missed"] = missed_text
WORDS["data"] = GRADE_NAMES


def not_checked(missed: tuple[Coverage, ...]) -> str:
    """What was to be checked and was not, or not all of it; empty where that is nothing."""
    return sentence("not_checked", checks=missed) if missed else ""


def body_word(name: str) -> str:
    """A body of the arm, or what is carried, by its name."""
    number = name.removeprefix("link_")
    base = name == link_label(BASE)
    return sentence("link", base=base, number=number) if base or number != name else own_title(name)
