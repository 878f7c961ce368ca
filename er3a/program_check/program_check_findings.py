"""Findings of a program check, in addition to those of :mod:`er3a.planning.motion_faults`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from er3a.collision.pairs import Pair
from er3a.finding import Amount, Finding, is_one
from er3a.planning.motion_faults import KINDS
from er3a.planning.names import FAULTS
from er3a.programs.instructions import Unresolved

Level = Literal["pass", "note", "caution", "fail"]
RANKS: dict[Level, int] = {"pass": 0, "note": 1, "caution": 2, "fail": 3}
"""Of errors, of questions that an input answers, of notes."""

NotFollowedReason = Literal[
    Unresolved,
    "instruction",
    "setting",
    "tool",
    "base",
    "turns_with_path",
    "external_axes",
    "half_turn",
    "redundant",
    "operations",
    "ways",
    "depth",
    "unreached",
]


def with_touches_of(found: Finding, others: Iterable[Finding]) -> Finding:
    """A collision, together with what was found for other ways to the same motion.

    Parameters
    ----------
    found : ``motion_collides``: ``touches`` in the order of first contact, each ``bodies_touch``: of ``pair``, from a
        time (``t_s``) of the motion on, there where they touch first (``place_m``, world), and a place of a line
        (``at_mm``); ``depth_mm`` at most; ``at_target``: whether they overlap at the motion's end; ``certain``: as of
        ``collision.shapes.surely_touch``; ``assumed``: by shapes of the arm that no document gives, and by none of
        what is carried
    others : findings of the same instruction

    Returns
    -------
    finding : each pair with its greatest depth; pairs that touch only in the others follow
    """
    deepest: dict[Pair, Finding] = {touch.pair: touch for touch in found.touches}
    for touch in (touch for other in others for touch in other.touches):
        first = deepest.setdefault(touch.pair, touch)
        depth, at_target = max(first.depth_mm, touch.depth_mm), first.at_target or touch.at_target
        deepest[touch.pair] = first.but(depth_mm=depth, at_target=at_target, certain=first.certain or touch.certain)
    return found.but(touches=tuple(deepest.values()))


FAILS = frozenset(
    (
        *(code for code, kind in KINDS.items() if kind in FAULTS),
        *("target_out_of_reach", "way_out_of_reach", "configuration_ends"),
        *("load_above_payload", "program_not_understood"),
    )
)
NOTES = frozenset(("frames_from_robot_file", "meets_singularity", "clear_of_assumed", "passes_singularity"))
WRONG = frozenset(("not_understood", "not_finite", "too_far", "too_many_joints"))
"""Why a target is none: the program gives it, but not as a target of its motion or of the arm."""


IMPOSSIBLE = ("impossible_speed", "mm", "mm/s")
"""Numbers that no arm can take, in the unit that the language has."""


def level_of(finding: Finding, guessed: bool = False) -> Level:
    """Severity of a finding: ``fail`` where the program can't be executed as written, never on a guess.

    Parameters
    ----------
    finding : of any kind; a collision fails where bodies touch for certain
    guessed : whether it rests on a start that was taken among several, so that nothing is certain

    Returns
    -------
    level : ``note``, ``caution`` or ``fail``; ``caution`` for all that no rule names
    """
    params = finding.params
    match finding.code:
        case "not_followed":
            fails, note = params["reason"] in WRONG, params["reason"] == "unreached"
        case "speed_not_given":
            fails, note = params["refused"], not params["word"]
        case "suspect_number":
            fails, note = params["kind"] in IMPOSSIBLE, False
        case "motion_collides":
            fails, note = any(touch.certain for touch in finding.touches), False
        case code:
            fails, note = code in FAILS and getattr(finding, "basis", "") != "assumed", code in NOTES
    return "fail" if fails and not guessed else "note" if note and not fails else "caution"


def gravity(finding: Finding) -> float:
    """How far a finding goes, to choose the worst of like ones.

    Parameters
    ----------
    finding : compared only with those of its kind at the same instruction

    Returns
    -------
    size : in the finding's own unit, the greater the worse; 0 where it has no size
    """
    if is_one(finding, "above_limit", "below_limit"):
        return float(abs(finding.reached_deg - finding.limit_deg))
    if is_one(finding, "clear_of_assumed"):
        return float(-finding.clearance_mm)
    if is_one(finding, "passes_singularity"):
        return float(-finding.distance.value)
    if is_one(finding, "zone_too_large"):
        return float(finding.zone_mm / max(finding.motion_mm, 1e-9))
    names = ("depth_mm", "needed", "excess_mm", "excess", "angle_deg", "jump", "difference")
    sizes = (getattr(finding, name, None) for name in names)
    return max(abs(float(size.value if isinstance(size, Amount) else size or 0.0)) for size in sizes)


def which(finding: Finding) -> str:
    """Key that distinguishes findings of one code at one instruction.

    Parameters
    ----------
    finding : of any kind
    """
    names = ("joint", "joints", "side", "type", "name", "text", "kind", "mass_kg", "reason")
    return " ".join(f"{getattr(finding, name)}" for name in names if hasattr(finding, name))


def worst_of(levels: Iterable[Level]) -> Level:
    """The most severe of levels.

    Parameters
    ----------
    levels : in any order

    Returns
    -------
    level : ``pass`` if there are none; the order is pass, note, caution, fail
    """
    return max(levels, key=RANKS.__getitem__, default="pass")
