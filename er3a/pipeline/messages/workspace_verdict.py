"""Sentences of the workspace stage's verdict."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.pipeline.messages.say import joined, say, say_as, sentence, texts
from er3a.pipeline.messages.workspace_proof import is_predicate
from er3a.pipeline.stages.workspace.model import (
    NoVoid,
    OnSurface,
    VoidAtShoulder,
    VoidUncertain,
    VoidUnexpected,
)
from er3a.workspace.causes import VoidCause

TEXTS = texts(
    {
        "workspace.flat": "The tool point moves on a line or not at all, so there is no volume.",
        "workspace.undersampled": (
            "Too few samples for cells this small: about {unseen_percent:.0f} % of the reachable cells hold no sample "
            "yet, so voids can't be judged."
        ),
        "workspace.on_surface#sphere": (
            "The tool point moves on a sphere and reaches at least {lower:.4g} m² and at most {upper:.4g} m² of it."
        ),
        "workspace.on_surface#unknown": "The tool point moves on a surface; its area was not computed.",
        "workspace.on_surface#curved": (
            "The tool point moves on a curved surface of at most {upper:.4g} m²: the area that two joints sweep; "
            "parts swept twice count twice."
        ),
        "workspace.on_surface#plane": (
            "The tool point moves on a plane and reaches at least {lower:.4g} m² and at most {upper:.4g} m² of it."
        ),
        "workspace.void_unexpected": (
            "An enclosed void of {litres:.3g} L lies at ({x}, {y}, {z}) mm, away from the shoulder, proven empty."
        ),
        "workspace.void_uncertain": (
            "An enclosed void of {litres:.3g} L may lie at ({x}, {y}, {z}) mm, away from the shoulder; there is no "
            "proof, and the samples can't tell."
        ),
        "workspace.void_at_shoulder": (
            "An enclosed void of {litres:.3g} L surrounds the shoulder, where the arm can't fold to; no other void "
            "indicates a wrong joint range."
        ),
        "workspace.no_void#sampled": "The samples leave no enclosed void inside the hull; no proof.",
        "workspace.no_void#undecided": (
            "The proof finds no enclosed void; {undecided_percent:.2g} % of the volume is left undecided."
        ),
        "workspace.no_void#none": "The workspace holds no enclosed void.",
        "void_advice#cause": (
            "It has this cause: {cause}: check the limits, the zero and the direction of joints 2 and 3."
        ),
        "void_advice#predicate": "It {cause}: check the limits, the zero and the direction of joints 2 and 3.",
    }
)


@say.register
def _(found: OnSurface) -> str:
    surface = found.surface
    lower, upper = surface.lower, surface.upper
    if upper is None:
        return say_as(found, "unknown")
    if lower is None:
        return say_as(found, "curved", upper=upper)
    if surface.kind == "plane":
        return say_as(found, "plane", lower=lower, upper=upper)
    return say_as(found, "sphere", lower=lower, upper=upper)


@say.register
def _(found: VoidUnexpected) -> str:
    where = say_as(found, **_place(found))
    return joined([where, _advice(found.cause)], " ")


@say.register
def _(found: VoidUncertain) -> str:
    return say_as(found, **_place(found))


@say.register
def _(found: VoidAtShoulder) -> str:
    return say_as(found, **_place(found))


@say.register
def _(found: NoVoid) -> str:
    if found.undecided_percent is not None:
        return say_as(found, "undecided")
    if found.proven:
        return say_as(found, "none")
    return say_as(found, "sampled")


def _advice(cause: VoidCause) -> str:
    """What to check, given a void's cause."""
    if is_predicate(cause):
        return sentence("void_advice#predicate", cause=say(cause))
    return sentence("void_advice#cause", cause=say(cause))


def _place(found: VoidUnexpected | VoidUncertain | VoidAtShoulder) -> dict[str, float | str]:
    shown = {"x": found.x_mm, "y": found.y_mm, "z": found.z_mm}
    return {"litres": found.litres} | {key: str(round(value)).replace("-", "−") for key, value in shown.items()}
