"""The workspace: what makes a void, how cells were decided, the verdict of the stage, and what its page says."""

from __future__ import annotations

from collections.abc import Sequence

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.finding import Finding, is_one
from er3a.pipeline.language import N_, as_text, own_title, tr, with_unit
from er3a.pipeline.messages.kinematics import sum_of_joints
from er3a.pipeline.messages.numbers import at_least, at_most
from er3a.pipeline.messages.say import Plural, joined, say, say_as, says, sentence, texts
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
        "workspace.flat": "The tool point moves on a surface, on a line or not at all, so there is no volume.",
        "workspace.unsettled": (
            "The proof leaves {undecided_percent:.2g} % of the volume undecided, so voids can't be judged."
        ),
        "workspace.no_void": (
            "The proof finds no enclosed void; {undecided_percent:.2g} % of the volume is left undecided."
        ),
        "workspace.void_unexpected": (
            "An enclosed void of at least {litres} L lies at ({x}, {y}, {z}) mm, away from the shoulder, proven empty."
        ),
        "workspace.void_at_shoulder": (
            "An enclosed void of at least {litres} L, centred at ({x}, {y}, {z}) mm, surrounds the shoulder: the "
            "arm can't fold far enough to reach it. No other enclosed void was found that would hint at a wrong "
            "limit; this confirms none."
        ),
        "void_advice#cause": (
            "It has this cause: {cause}: check the limits, the zero and the direction of joints 2 and 3; never widen a "
            "limit of the arm for it."
        ),
        "void_advice#predicate": (
            "It {cause}: check the limits, the zero and the direction of joints 2 and 3; never widen a limit of the "
            "arm for it."
        ),
        "void_changes": (
            "{count} of {tried} single changes of the table leave less than a tenth of it: {named}. References must "
            "tell which is right."
        ),
        "void_changes#undecided": (
            "{count} of {tried} single changes of the table leave less than a tenth of it, of {undecided} more it is "
            "not decided: {named}. References must tell which is right."
        ),
        "single_change#deg": "{entry} = {tried} deg",
        "single_change#mm": "{entry} = {tried} mm",
        "single_change#sign": "{entry} = {tried}",
        "void_disappears#one": "disappears if {extended}",
        "void_disappears#two": "disappears if {first} or if {second}",
        "void_of_several_limits#only": "made by several limits together",
        "void_of_several_limits#together": "only several limits together make it",
        "void_of_geometry": "geometry: {percent:.0f} % of it stays without any joint limit",
        "void_shrinks": "shrinks by {percent:.0f} % if {extended}",
        "limit_extended#lower_deg": "joint {joint}'s lower limit is extended to {limit} deg",
        "limit_extended#lower_mm": "joint {joint}'s lower limit is extended to {limit} mm",
        "limit_extended#upper_deg": "joint {joint}'s upper limit is extended to {limit} deg",
        "limit_extended#upper_mm": "joint {joint}'s upper limit is extended to {limit} mm",
        "limit_extended#sum_lower_deg": "the lower limit of {sum} is extended to {limit} deg",
        "limit_extended#sum_lower_mm": "the lower limit of {sum} is extended to {limit} mm",
        "limit_extended#sum_upper_deg": "the upper limit of {sum} is extended to {limit} deg",
        "limit_extended#sum_upper_mm": "the upper limit of {sum} is extended to {limit} mm",
        "workspace.pockets": Plural("count", "{count} open pocket", "{count} open pockets"),
        "workspace.voids": Plural("count", "{count} enclosed void", "{count} enclosed voids"),
        "inverse_unknown": "no method here finds all inverse solutions of this arm",
        "joint_one_shared": (
            "joint 1 is coupled with other joints or limited together with them, so that what holds at one azimuth "
            "does not follow from another"
        ),
        "orientations_unknown": (
            "with its {joints} joints the arm takes only few orientations at each point, and which these are is not "
            "known for its kind"
        ),
        "workspace.placement_too_long": (
            "Not computed: a pose takes milliseconds with this arm, and within seconds only points wider apart than "
            "the tray could be asked. A larger tray or a narrower cone may do."
        ),
        "stand.fits": "On {name}: centre at ({centre}) mm; {reached}.",
        "stand.too_low": "Not on {name}: at {height} mm it is lower than the {lowest} mm that the task allows.",
        "stand.too_small": "Not on {name}: there is no room for it.",
        "stand.out_of_reach": "Not on {name}: nowhere on it does the tool reach all of the tray.",
        "stand.in_the_way": (
            "Not on {name} itself: an arm that reaches all of the tray comes within {margin} mm of the scene or of "
            "itself."
        ),
        "void.none": "None.",
        "void.shoulder": (
            "{lower} to {upper} L around the shoulder, centred at ({centre}) mm: no target there can be reached."
        ),
        "void.away": (
            "{lower} to {upper} L away from the shoulder, centred at ({centre}) mm: no target there can be reached."
        ),
        "void.normal": "That is normal for the arm.",
        "void.not_normal": "That is not normal: a limit, a zero or a direction of joint 2 or 3 may be wrong.",
        "void.within": "It lies within {box} mm of the base.",
        "void.side": "{axis} {low} to {high}",
        "void.cause#limit": "What makes it: {limits}{unconfirmed}. Never widen a joint limit to reach there.",
        "void.unconfirmed": ", which nothing confirms (another limit, another void)",
        "void.rests": "The bounds hold for {limits}, which nothing confirms.",
        "void.cause#noun": "Its cause: {cause}.",
        "void.larger": "Collisions of the arm are not counted, so what can't be reached is larger.",
        "void.no_tool": "With a tool the void is elsewhere.",
        "void.pocket": (
            "Out of reach too, but open to the outside: a larger pocket of {lower} to {upper} L, within {box} mm."
        ),
        "void.more": Plural(
            "count", "There is {count} other enclosed void.", "There are {count} other enclosed voids."
        ),
        "box.contradicted": "No place for the tray is recommended: evidence contradicts this table.",
        "box.unknown": "Tray of {box} mm: {why}",
        "box.nowhere": "Tray of {box} mm: no place was found where the tool reaches all of it.",
        "box.run_again#tray": (
            "Before you run a motion there, put the tray into the study's scene file as a box, and run again: no path, "
            "program or grasp was planned around it."
        ),
        "box.run_again#stand": (
            "Before you run a motion there, put the tray and its stand into the study's scene file as boxes, and run "
            "again: no path, program or grasp was planned around them."
        ),
        "box.no_tool": "No tool is given: the flange's own centre enters the tray. Repeat it with your tool's length.",
        "box.sampled#all": "the tool point, {tilt}, reaches all points sampled in it; {unchecked}",
        "box.sampled#upper": (
            "the tool point, {tilt}, reaches all points sampled in it except the lowest {served_from} mm; {unchecked}"
        ),
        "box.tilt#down": "tilted up to {cone:g} deg from straight down",
        "box.tilt#along": "tilted up to {cone:g} deg from ({axis})",
        "box.unchecked": ("the arm's clearance there was only sampled, and does not count the tray and its stand"),
        "workspace.tool_points_elsewhere": (
            "Nowhere: the arm can't tilt its tool, which points along ({x:.2f}, {y:.2f}, {z:.2f}) and not within the "
            "cone."
        ),
    }
)


@say.register
def _(found: model.VoidUnexpected) -> str:
    where = say_as(found, **_place(found))
    return joined([where, _advice(found.cause), _changes(found)], " ")


SERVED_ALL_M = 1e-6
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
    tried, undecided = len(found.single_changes), len(found.single_changes) - len(decided)
    form = "void_changes#undecided" if undecided else "void_changes"
    return sentence(form, count=len(least), tried=tried, named=named, undecided=undecided)


def change_text(change: SingleChange) -> str:
    """An entry and the value that was tried."""
    tried = as_text(change.tried, ".6g" if change.unit else "+.6g")
    return sentence(f"single_change#{change.unit or 'sign'}", entry=entry_word(change), tried=tried)


def entry_word(change: SingleChange) -> str:
    """The entry, such as "offset 2"."""
    return tr(ENTRIES[change.column], joint=change.joint)


@says("workspace.void_at_shoulder")
def _(found: Finding) -> str:
    return say_as(found, **_place(found))


def _advice(cause: VoidCause) -> str:
    """What to check, given a void's cause."""
    if is_predicate(cause):
        return sentence("void_advice#predicate", cause=say(cause))
    return sentence("void_advice#cause", cause=say(cause))


def _place(found: model.VoidUnexpected | Finding) -> dict[str, str]:
    shown = {"x": found.x_mm, "y": found.y_mm, "z": found.z_mm}
    return {"litres": at_least(found.litres, "L")} | {
        key: str(round(value)).replace("-", "−") for key, value in shown.items()
    }


@say.register
def _(found: Disappears) -> str:
    first, *others = (_extended(limit) for limit in found.limits)
    if others:
        return say_as(found, "two", first=first, second=others[0])
    return say_as(found, "one", extended=first)


@say.register
def _(found: SeveralLimits) -> str:
    if found.most is None:
        return say_as(found, "only")
    return joined([_shrinks(found.most), say_as(found, "together")])


@say.register
def _(found: Geometry) -> str:
    left = say_as(found, percent=100 * found.remaining_ratio)
    return joined([left, _shrinks(found.most) if found.most else ""])


def is_predicate(cause: VoidCause) -> bool:
    """Whether a cause's sentence says what the void does, so that "it" can stand before it."""
    return isinstance(cause, Disappears) or (isinstance(cause, SeveralLimits) and cause.most is not None)


def _shrinks(limit: Relaxed) -> str:
    return sentence("void_shrinks", percent=100 * limit.filled, extended=_extended(limit))


def _extended(limit: Relaxed) -> str:
    value = as_text(limit.extended, "+.4g")
    if limit.factors == (1.0,):
        return _joint_extended(limit, {"joint": limit.joints[0], "limit": value})
    terms = " ".join(f"{factor:+.4g} × J{joint}" for joint, factor in zip(limit.joints, limit.factors))
    return _sum_extended(limit, {"sum": terms, "limit": value})


def _joint_extended(limit: Relaxed, shown: dict[str, int | str]) -> str:
    if limit.unit == "mm":
        if limit.side == "upper":
            return sentence("limit_extended#upper_mm", **shown)
        return sentence("limit_extended#lower_mm", **shown)
    if limit.side == "upper":
        return sentence("limit_extended#upper_deg", **shown)
    return sentence("limit_extended#lower_deg", **shown)


def _sum_extended(limit: Relaxed, shown: dict[str, int | str]) -> str:
    if limit.unit == "mm":
        if limit.side == "upper":
            return sentence("limit_extended#sum_upper_mm", **shown)
        return sentence("limit_extended#sum_lower_mm", **shown)
    if limit.side == "upper":
        return sentence("limit_extended#sum_upper_deg", **shown)
    return sentence("limit_extended#sum_lower_deg", **shown)


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
    if placement is None:
        return ""
    asked = " × ".join(as_text(value, "g") for value in placement.task.box_mm)
    if not isinstance(placement, model.PlacementSummary):
        return sentence("box.unknown", box=asked, why=say(placement))
    return "" if placement.named_places else sentence("box.nowhere", box=asked)


def reached_text(placement: model.PlacementSummary, place: model.PlaceSummary, served_from_m: float = 0.0) -> str:
    """How much of a tray the tool reaches, from a height above its underside on, how it is tilted there, and what was
    not checked."""
    axis, cone = placement.task.tool_direction, placement.task.cone_deg
    down = tuple(round(each, 6) for each in axis) == (0, 0, -1)
    tilt = sentence("box.tilt#down" if down else "box.tilt#along", cone=cone, axis=", ".join(f"{x:g}" for x in axis))
    form = "upper" if served_from_m > SERVED_ALL_M else "all"
    served, unchecked = millimetres([served_from_m]), sentence("box.unchecked")
    return sentence(f"box.sampled#{form}", tilt=tilt, unchecked=unchecked, served_from=served)


def run_again_text(summary: Summary, *, stand: bool) -> str:
    """What to do before a motion is run beside the tray, or with a tool; ``stand``: whether the tray needs one."""
    bare = any(each.reason == "tool" for each in summary.assumed)
    again = sentence("box.run_again#stand" if stand else "box.run_again#tray")
    return joined([again, sentence("box.no_tool") if bare else ""], " ")


def void_text(summary: Summary, *, confirmed: bool = True) -> tuple[str, str]:
    """The void that the verdict tells of: its bounds, centre and what it means; then where it lies, its cause and a
    larger open pocket. Empty where voids were not judged. ``confirmed``: whether independent documents settle the
    joints' limits."""
    finding = summary.verdict.finding
    if is_one(finding, "workspace.no_void"):
        return joined([sentence("void.none"), say(finding)], " "), ""
    if not isinstance(summary, model.WorkspaceSummary) or not (
        is_one(finding, "workspace.void_at_shoulder") or isinstance(finding, model.VoidUnexpected)
    ):
        return "", ""
    voids, judged = summary.enclosed_voids, judged_void(summary)
    normal = is_one(finding, "workspace.void_at_shoulder")
    where = "void.shoulder" if judged.holds_shoulder else "void.away"
    means = "void.normal" if normal else "void.not_normal"
    lead = joined([sentence(where, **_void_parts(judged)), sentence(means)], " ")
    limits = _limits(judged.cause)
    if is_predicate(judged.cause):
        unconfirmed = "" if confirmed else sentence("void.unconfirmed")
        cause = sentence("void.cause#limit", limits=limits, unconfirmed=unconfirmed)
    else:
        rests = sentence("void.rests", limits=limits) if limits and not confirmed else ""
        cause = joined([sentence("void.cause#noun", cause=say(judged.cause)), rests], " ")
    bare = normal and any(each.reason == "tool" for each in summary.assumed)
    more = sentence("void.more", count=len(voids) - 1) if len(voids) > 1 else ""
    pocket = max(summary.voids, key=lambda void: void.volume_m3.upper)
    open_one = sentence("void.pocket", **_void_parts(pocket)) if pocket.kind == "open" else ""
    within, tool = sentence("void.within", **_void_parts(judged)), sentence("void.no_tool") if bare else ""
    return lead, joined([within, cause, sentence("void.larger") if normal else "", tool, more, open_one], " ")


def judged_void(summary: model.WorkspaceSummary) -> model.VoidSummary:
    """The enclosed void that the verdict tells of."""
    voids = summary.enclosed_voids
    unexpected = (void for void in voids if not void.holds_shoulder)
    return next(unexpected, voids[0])


def _limits(cause: VoidCause) -> str:
    """The limits that make a void, or have a part in it; empty where none has."""
    if isinstance(cause, Disappears):
        limits = cause.limits
    elif cause.most is None:
        return ""
    else:
        limits = (cause.most,)
    said = [
        f"{sum_of_joints(limit.joints, limit.factors)} {'≤' if limit.side == 'upper' else '≥'} "
        + with_unit(as_text(limit.limit, ".4g"), limit.unit)
        for limit in limits
    ]
    return joined(said, ", ")


def _void_parts(void: model.VoidSummary) -> dict[str, str]:
    bounds = void.volume_m3
    box = [
        sentence("void.side", axis=axis, low=millimetres((low,)), high=millimetres((high,)))
        for axis, low, high in zip("xyz", void.low_m, void.high_m)
    ]
    return {
        "lower": at_least(1000 * bounds.lower, "L"),
        "upper": at_most(1000 * bounds.upper, "L"),
        "box": joined(box, ", "),
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
