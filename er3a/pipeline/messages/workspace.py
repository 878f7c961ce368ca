"""The workspace: what makes a void, how cells were decided, the verdict of the stage, and what its page says."""

from __future__ import annotations

from collections.abc import Sequence

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.finding import Finding
from er3a.pipeline.language import N_, as_text, own_title, tr, with_unit
from er3a.pipeline.messages.kinematics import sum_of_joints
from er3a.pipeline.messages.numbers import at_least, at_most
from er3a.pipeline.messages.say import joined, say, say_as, says, sentence, texts
from er3a.pipeline.results import Summary
from er3a.pipeline.stages.workspace import model
from er3a.workspace.causes import (
    Disappears,
    Geometry,
    Relaxed,
    SeveralLimits,
    SingleChange,
    VoidCause,
)

KEY_FIGURES = {
    "greatest_reach": N_("greatest reach from axis 1"),
    "enclosed_voids_lower": N_("enclosed voids, at least"),
    "volume_lower": N_("reached volume, at least"),
    "volume_upper": N_("reached volume, at most"),
    "hull_volume": N_("convex hull of the samples: holds voids and dents, misses the rim"),
    "least_reach": N_("least distance from axis 1"),
    "samples": N_("samples"),
}
VOID_KINDS = {"enclosed": N_("enclosed"), "open": N_("open pocket")}


ENTRIES = {
    "a": N_("a{joint}"),
    "d": N_("d{joint}"),
    "offset": N_("offset {joint}"),
    "direction": N_("direction {joint}"),
    "lower": N_("lower limit {joint}"),
    "upper": N_("upper limit {joint}"),
}
TEXTS = texts(
    {
        "workspace.flat": "The tool point moves on a surface, on a line or not at all: there is no volume.",
        "workspace.unsettled": "Voids can't be judged: {undecided_percent:.2g} % of the volume is undecided.",
        "workspace.no_void": "No enclosed void is found; {undecided_percent:.2g} % of the volume is undecided.",
        "workspace.void_unexpected": (
            "An enclosed void of at least {litres} L lies away from the shoulder, at ({x}, {y}, {z}) mm."
        ),
        "workspace.void_at_shoulder": (
            "An enclosed void of at least {litres} L surrounds the shoulder: normal. Its centre is ({x}, {y}, {z}) mm; "
            "no other was found."
        ),
        "void_changes": (
            "Single changes of the table that leave less than a tenth of it: {named} ({count} of {tried}; undecided: "
            "{undecided}). References must tell which is right."
        ),
        "void_disappears": "{limits}; it disappears at {extended}",
        "void_of_several_limits": "several limits together",
        "void_of_geometry": "geometry: {percent:.0f} % of it stays without any joint limit",
        "void_shrinks": "it shrinks by {percent:.0f} % at {limit}",
        "workspace.pockets": "open pockets: {count}",
        "workspace.voids": "enclosed voids: {count}",
        "inverse_unknown": "no method here finds all inverse solutions of this arm",
        "joint_one_shared": "joint 1 is coupled or limited together with others, so no azimuth stands for another",
        "orientations_unknown": "the orientations that {joints} joints reach at a point are not known for this kind",
        "workspace.placement_too_long": (
            "Not computed: this arm takes milliseconds for a pose. A larger tray or a narrower cone may do."
        ),
        "stand.fits": "On {name}: centre at ({centre}) mm; {reached}.",
        "stand.too_low": "Not on {name}: at {height} mm it is lower than the {lowest} mm allowed.",
        "stand.too_small": "Not on {name}: there is no room for it.",
        "stand.out_of_reach": "Not on {name}: nowhere on it does the tool reach all of the tray.",
        "stand.in_the_way": "Not on {name}: the arm comes within {margin} mm of the scene or of itself.",
        "void.at": "{lower} to {upper} L, centred at ({centre}) mm: no target there can be reached.",
        "void.normal": "It surrounds the shoulder, which is normal.",
        "void.not_normal": "That is not normal: a limit, a zero or a direction of joint 2 or 3 may be wrong.",
        "void.within": "It lies within {box} mm of the base.",
        "void.rests": "The bounds hold for {limits}, which nothing confirms.",
        "void.cause": "Cause: {cause}. Never widen a limit of the arm for it.",
        "void.larger": "It is larger where the arm collides: that is not counted.",
        "void.pocket": "Open pocket besides: {lower} to {upper} L, within {box} mm.",
        "void.more": "Other enclosed voids: {count}.",
        "box.contradicted": "No place for the tray is recommended: evidence contradicts this table.",
        "box.unknown": "Tray of {box} mm: {why}",
        "box.nowhere": "nowhere does the tool reach all of it.",
        "box.run_again": (
            "Before a motion is run there, put the tray, and its stand if any, into the study's scene file as boxes, "
            "and run again."
        ),
        "box.no_tool": "No tool is given: repeat it with your tool's length.",
        "box.sampled": (
            "the tool, up to {cone:g} deg from {axis}, reaches all points sampled above the tray's lowest "
            "{served_from} mm; the arm's clearance was only sampled, without tray and stand"
        ),
        "workspace.tool_points_elsewhere": (
            "Nowhere: the arm can't tilt its tool out of ({x:.2f}, {y:.2f}, {z:.2f}) into the cone."
        ),
    }
)


@say.register
def _(found: model.VoidUnexpected) -> str:
    check = sentence("void.not_normal")
    return joined([say_as(found, **_place(found)), _cause(found.cause), check, _changes(found)], " ")


CHANGED_FIRST = ("offset", "direction", "lower", "upper", "a", "d")
NAMED_CHANGES = 4


def _changes(found: model.VoidUnexpected) -> str:
    """The single changes of the table that take the void away; empty where none was tried or none does."""
    decided = [(change, change.left_litres[1]) for change in found.single_changes if change.left_litres]
    least = [change for change, litres in decided if litres < 0.1 * found.litres]
    if not least:
        return ""
    shown = sorted(least, key=lambda change: CHANGED_FIRST.index(change.column))
    named = joined([*map(change_text, shown[:NAMED_CHANGES]), *(["…"] if len(shown) > NAMED_CHANGES else [])], ", ")
    tried = len(found.single_changes)
    return sentence("void_changes", count=len(least), tried=tried, named=named, undecided=tried - len(decided))


def change_text(change: SingleChange) -> str:
    """An entry and the value that was tried, such as "offset 2 = 90 deg"."""
    tried = as_text(change.tried, ".6g" if change.unit else "+.6g")
    return f"{tr(ENTRIES[change.column], joint=change.joint)} = {with_unit(tried, change.unit)}"


@says("workspace.void_at_shoulder")
def _(found: Finding) -> str:
    return say_as(found, **_place(found))


def _cause(cause: VoidCause) -> str:
    return sentence("void.cause", cause=say(cause))


def _place(found: model.VoidUnexpected | Finding) -> dict[str, str]:
    shown = {"x": found.x_mm, "y": found.y_mm, "z": found.z_mm}
    return {"litres": at_least(found.litres, "L")} | {
        key: str(round(value)).replace("-", "−") for key, value in shown.items()
    }


@say.register
def _(found: Disappears) -> str:
    extended = tr(" or ").join(_limit(limit, limit.extended) for limit in found.limits)
    return say_as(found, limits=_limits(found), extended=extended)


@say.register
def _(found: SeveralLimits) -> str:
    return joined([say_as(found), _shrinks(found.most)])


@say.register
def _(found: Geometry) -> str:
    return joined([say_as(found, percent=100 * found.remaining_ratio), _shrinks(found.most)])


def _shrinks(limit: Relaxed | None) -> str:
    return sentence("void_shrinks", percent=100 * limit.filled, limit=_limit(limit, limit.extended)) if limit else ""


def _limit(limit: Relaxed, at: float) -> str:
    """A limit at a value, such as "J3 ≤ 65 deg"."""
    value = with_unit(as_text(at, ".4g"), limit.unit)
    return f"{sum_of_joints(limit.joints, limit.factors)} {'≤' if limit.side == 'upper' else '≥'} {value}"


@says("workspace.capability_missing")
def _(found: Finding) -> str:
    return say(found.lacks)


@say.register
def _(found: model.ToolPointsElsewhere) -> str:
    x, y, z = found.direction
    return say_as(found, x=x, y=y, z=z)


def no_box_text(summary: Summary) -> str:
    """Why there is no place for the tray of the study; empty where there is one, or none was looked for."""
    placement = getattr(summary, "placement", None)
    if placement is None or (isinstance(placement, model.PlacementSummary) and placement.named_places):
        return ""
    asked = " × ".join(as_text(value, "g") for value in placement.task.box_mm)
    nowhere = isinstance(placement, model.PlacementSummary)
    return sentence("box.unknown", box=asked, why=sentence("box.nowhere") if nowhere else say(placement))


def reached_text(placement: model.PlacementSummary, place: model.PlaceSummary, served_from_m: float = 0.0) -> str:
    """How much of a tray the tool reaches, from a height above its underside on, how it is tilted there, and what was
    not checked."""
    axis, cone = placement.task.tool_direction, placement.task.cone_deg
    down = tuple(round(each, 6) for each in axis) == (0, 0, -1)
    along = tr("straight down") if down else f"({', '.join(f'{x:g}' for x in axis)})"
    return sentence("box.sampled", axis=along, cone=cone, served_from=millimetres([served_from_m]))


def run_again_text(summary: Summary) -> str:
    """What to do before a motion is run beside the tray, or with a tool."""
    bare = any(each.reason == "tool" for each in summary.assumed)
    return joined([sentence("box.run_again"), sentence("box.no_tool") if bare else ""], " ")


def _limits(cause: VoidCause) -> str:
    """The limits that make a void, or have a part in it; empty where none has."""
    if isinstance(cause, Disappears):
        limits = cause.limits
    elif cause.most is None:
        return ""
    else:
        limits = (cause.most,)
    return joined([_limit(limit, limit.limit) for limit in limits], ", ")


def _void_parts(void: model.VoidSummary) -> dict[str, str]:
    bounds = void.volume_m3
    sides = [
        f"{axis} {tr('{low} to {high}', low=millimetres((low,)), high=millimetres((high,)))}"
        for axis, low, high in zip("xyz", void.low_m, void.high_m)
    ]
    return {
        "lower": at_least(1000 * bounds.lower, "L"),
        "upper": at_most(1000 * bounds.upper, "L"),
        "box": joined(sides, ", "),
        "centre": millimetres(void.centroid_m),
    }


def millimetres(values: Sequence[float]) -> str:
    """Lengths (m) in whole mm, one after the other."""
    return ", ".join(as_text(round(1000 * value) + 0, "d") for value in values)


def stand_text(stand: model.StandSummary, placement: model.PlacementSummary) -> str:
    """Whether the tray can stand on a surface, and if not why."""
    named = {"name": own_title(stand.name), "height": millimetres([stand.height_m])}
    if stand.place and stand.served_from_m is not None:
        reached = reached_text(placement, stand.place, stand.served_from_m)
        return sentence("stand.fits", reached=reached, centre=millimetres(stand.place.centre_m), **named)
    margin, lowest = as_text(placement.margin_mm, "g"), as_text(placement.task.lowest_mm, "g")
    return sentence(f"stand.{stand.why_none}", margin=margin, lowest=lowest, **named)
