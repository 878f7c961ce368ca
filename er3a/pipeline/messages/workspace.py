"""The workspace: what makes a void, how cells were decided, the verdict of the stage, and what its page says."""

from __future__ import annotations

from collections.abc import Sequence

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.finding import Finding
from er3a.pipeline.language import as_text, tr, with_unit, words
from er3a.pipeline.messages.kinematics import sum_of_joints
from er3a.pipeline.messages.say import FORMATS, say_as, says, sentence, texts
from er3a.pipeline.results import Summary
from er3a.pipeline.stages.workspace import model

KEY_FIGURES = words(
    {
        "greatest_reach": "greatest reach from axis 1",
        "enclosed_voids_lower": "enclosed voids, at least",
        "volume_lower": "reached volume, at least",
        "volume_upper": "reached volume, at most",
        "least_reach": "least distance from axis 1",
    }
)


TEXTS = texts(
    {
        "workspace.flat": "The tool point moves on a surface, on a line or not at all: there is no volume.",
        "workspace.unsettled": "Voids can't be judged: {undecided_percent:.2g} % of the volume is undecided.",
        "workspace.no_void": "No enclosed void of 1 mL is found; {undecided_percent:.2g} % of the volume is undecided.",
        "workspace.void_unexpected": (
            "An enclosed void of at least {litres:at_least L} L lies away from the shoulder, at ({x_mm:.0f}, "
            "{y_mm:.0f}, {z_mm:.0f}) mm. Cause: {cause}. Never widen a limit of the arm for it. That is not "
            "normal: a limit, a zero or a direction of joint 2 or 3 may be wrong."
        ),
        "workspace.void_at_shoulder": (
            "No enclosed void but that about the shoulder, which is normal. It is {litres:at_least L} L at least; its "
            "centre is ({x_mm:.0f}, {y_mm:.0f}, {z_mm:.0f}) mm."
        ),
        "void_disappears": "{limits:limit, }; it disappears at {extended:extended or }",
        "void_of_several_limits": "several limits together[; {most}]",
        "void_of_geometry": "geometry: {remaining_ratio:.0%} of it stays without any joint limit[; {most}]",
        "relaxed_limit": "it shrinks by {filled:.0%} at {limit}",
        "workspace.capability_missing": "{lacks}",
        "inverse_unknown": "no method here finds all inverse solutions of this arm",
        "joint_one_shared": "joint 1 is coupled or limited together with others, so no azimuth stands for another",
        "orientations_unknown": "the orientations that {joints} joints reach at a point are not known for this kind",
        "workspace.placement_too_long": (
            "Not computed: this arm takes milliseconds for a pose. A larger tray or a narrower cone may do."
        ),
        "stand.fits": "On {name:own}: centre at ({centre}) mm; {reached}.",
        "stand.none": (
            "Not on {name:own}: [there is no room for it{too_small:?}][nowhere on it does the tool reach all of the "
            "tray{out_of_reach:?}][the arm comes within {margin} mm of the scene or of itself{in_the_way:?}]."
        ),
        "box.run_again": (
            "Before a motion is run there, put the tray, and its stand if any, into the study's scene file as boxes, "
            "and run again.[ No tool is given: repeat it with your tool's length.{bare:?}]"
        ),
        "box.sampled": (
            "the tool[ along the flange's {own}][ from the last link's end, {beyond} mm beyond it], up to "
            "{cone:g}° from {axis}, reaches all points sampled above the tray's lowest {served_from} mm; clearance was "
            "sampled, without tray and stand"
        ),
        "workspace.tool_points_elsewhere": (
            "Nowhere: the arm can't tilt its tool out of ({direction:.2f, }) into the cone."
        ),
    }
)


@says("void_disappears")
def _(found: Finding) -> str:
    return say_as(found, extended=found.limits)


@says("relaxed_limit")
def _(found: Finding) -> str:
    return say_as(found, limit=_limit(found, found.extended))


def _limit(limit: Finding, at: float) -> str:
    """A limit at a value, such as "J3 ≤ 65°"."""
    value = with_unit(as_text(at, ".4g"), limit.unit)
    return f"{sum_of_joints(limit.joints, limit.factors)} {'≤' if limit.side == 'upper' else '≥'} {value}"


FORMATS["limit"] = lambda limit: _limit(limit, limit.limit)
FORMATS["extended"] = lambda limit: _limit(limit, limit.extended)


def reached_text(placement: model.PlacementSummary, served_from_m: float = 0.0) -> str:
    """How much of a tray the tool reaches, from a height above its underside on, how it is tilted there, and what was
    not checked."""
    axis, cone = placement.task.tool_direction, placement.task.cone_deg
    down = tuple(round(each, 6) for each in axis) == (0, 0, -1)
    along = tr("straight down") if down else f"({', '.join(f'{x:g}' for x in axis)})"
    own = None if placement.tool_axis == "z" else placement.tool_axis
    beyond = millimetres([placement.beyond_m]) if placement.beyond_m else None
    return sentence(
        "box.sampled", axis=along, cone=cone, served_from=millimetres([served_from_m]), own=own, beyond=beyond
    )


def run_again_text(summary: Summary) -> str:
    """What to do before a motion is run beside the tray, or with a tool."""
    return sentence("box.run_again", bare=_is_bare(summary))


def _is_bare(summary: Summary) -> bool:
    """Whether no tool is given, so that the tool point is the flange."""
    return any(each.reason == "tool" for each in summary.assumed)


def reaches(summary: model.WorkspaceSummary) -> str:
    """How far from axis 1 an arm reaches, and with which point: the flange where no tool is given."""
    far = millimetres([summary.reach_m.furthest_from_axis])
    return tr("flange reaches {far} mm", far=far) if _is_bare(summary) else tr("tool reaches {far} mm", far=far)


def millimetres(values: Sequence[float]) -> str:
    """Lengths (m) in whole mm, one after the other on one line."""
    return ",\u00a0".join(as_text(round(1000 * value) + 0, "d") for value in values)


def stand_text(stand: model.StandSummary, placement: model.PlacementSummary) -> str:
    """Whether the tray can stand on a surface, and if not why."""
    if stand.place and stand.served_from_m is not None:
        reached = reached_text(placement, stand.served_from_m)
        return sentence("stand.fits", name=stand.name, reached=reached, centre=millimetres(stand.place.centre_m))
    why = {each: each == stand.why_none for each in ("too_small", "out_of_reach", "in_the_way")}
    return sentence("stand.none", name=stand.name, margin=as_text(placement.margin_mm, "g"), **why)
