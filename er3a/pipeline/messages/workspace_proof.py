"""Sentences of the workspace library: what makes a void, and how cells were decided."""

from __future__ import annotations

from er3a.pipeline.messages import kinematics as _kinematics  # noqa: F401 (says what an arm lacks)
from er3a.pipeline.messages.language import as_text
from er3a.pipeline.messages.say import joined, say, say_as, sentence, texts
from er3a.workspace.causes import (
    Disappears,
    Geometry,
    Relaxed,
    SeveralLimits,
    VoidCause,
)

TEXTS = texts(
    {
        "void_only_sampled": "unknown: known from samples only",
        "spherical_wrist": "spherical wrist",
        "general_method": "general method, because {lacks}",
        "tool_near_wrist": "its tool point is only {distance_mm:.3g} mm from the wrist centre",
        "bounds_far_apart": "the method for spherical wrists leaves {percent:.3g} % between its bounds",
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
    }
)


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
