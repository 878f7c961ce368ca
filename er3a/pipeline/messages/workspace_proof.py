"""Sentences of the workspace library: what makes a void, and how cells were decided."""

from __future__ import annotations

from er3a.pipeline.messages import kinematics as _kinematics  # noqa: F401 (says what an arm lacks)
from er3a.pipeline.messages.language import as_text
from er3a.pipeline.messages.say import joined, say, sentence
from er3a.workspace.causes import (
    Disappears,
    Geometry,
    OnlySampled,
    Relaxed,
    SeveralLimits,
    VoidCause,
)
from er3a.workspace.proven import BoundsFarApart, GeneralMethod, SphericalWrist, ToolNearWrist


@say.register
def _(found: Disappears) -> str:
    first, *others = (_extended(limit) for limit in found.limits)
    if others:
        return sentence(found.code, "disappears if {first} or if {second}", first=first, second=others[0])
    return sentence(found.code, "disappears if {extended}", extended=first)


@say.register
def _(found: SeveralLimits) -> str:
    if found.most is None:
        return sentence(found.code, "made by several limits together")
    return joined([_shrinks(found.most), sentence(found.code, "only several limits together make it")])


@say.register
def _(found: Geometry) -> str:
    left = sentence(
        found.code,
        "geometry: {percent:.0f} % of it stays without any joint limit",
        percent=100 * found.remaining_ratio,
    )
    return joined([left, _shrinks(found.most) if found.most else ""])


@say.register
def _(found: OnlySampled) -> str:
    return sentence(found.code, "unknown: known from samples only")


def is_predicate(cause: VoidCause) -> bool:
    """Whether a cause's sentence says what the void does, so that "it" can stand before it."""
    return isinstance(cause, Disappears) or (isinstance(cause, SeveralLimits) and cause.most is not None)


def _shrinks(limit: Relaxed) -> str:
    return sentence(
        "void_shrinks",
        "shrinks by {percent:.0f} % if {extended}",
        percent=100 * limit.filled,
        extended=_extended(limit),
    )


def _extended(limit: Relaxed) -> str:
    value = as_text(limit.extended, "+.4g")
    if limit.factors == (1.0,):
        return _joint_extended(limit, {"joint": limit.joints[0], "limit": value})
    terms = " ".join(f"{factor:+.4g} × J{joint}" for joint, factor in zip(limit.joints, limit.factors))
    return _sum_extended(limit, {"sum": terms, "limit": value})


def _joint_extended(limit: Relaxed, shown: dict[str, int | str]) -> str:
    if limit.unit == "mm":
        if limit.side == "upper":
            return sentence("limit_extended", "joint {joint}'s upper limit is extended to {limit} mm", **shown)
        return sentence("limit_extended", "joint {joint}'s lower limit is extended to {limit} mm", **shown)
    if limit.side == "upper":
        return sentence("limit_extended", "joint {joint}'s upper limit is extended to {limit} deg", **shown)
    return sentence("limit_extended", "joint {joint}'s lower limit is extended to {limit} deg", **shown)


def _sum_extended(limit: Relaxed, shown: dict[str, int | str]) -> str:
    if limit.unit == "mm":
        if limit.side == "upper":
            return sentence("limit_extended", "the upper limit of {sum} is extended to {limit} mm", **shown)
        return sentence("limit_extended", "the lower limit of {sum} is extended to {limit} mm", **shown)
    if limit.side == "upper":
        return sentence("limit_extended", "the upper limit of {sum} is extended to {limit} deg", **shown)
    return sentence("limit_extended", "the lower limit of {sum} is extended to {limit} deg", **shown)


@say.register
def _(found: SphericalWrist) -> str:
    return sentence(found.code, "spherical wrist")


@say.register
def _(found: GeneralMethod) -> str:
    return sentence(found.code, "general method, because {lacks}", lacks=say(found.lacks))


@say.register
def _(found: ToolNearWrist) -> str:
    return sentence(
        found.code, "its tool point is only {distance:.3g} mm from the wrist centre", distance=found.distance_mm
    )


@say.register
def _(found: BoundsFarApart) -> str:
    return sentence(
        found.code, "the method for spherical wrists leaves {percent:.3g} % between its bounds", percent=found.percent
    )
