"""Sentences of the workspace stage's verdict."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.pipeline.messages.say import joined, say, sentence
from er3a.pipeline.messages.workspace_proof import is_predicate
from er3a.pipeline.stages.workspace.model import (
    Flat,
    NoVoid,
    OnSurface,
    Undersampled,
    VoidAtShoulder,
    VoidUncertain,
    VoidUnexpected,
)
from er3a.workspace.causes import VoidCause


@say.register
def _(found: Flat) -> str:
    return sentence(found.code, "The tool point moves on a line or not at all, so there is no volume.")


@say.register
def _(found: OnSurface) -> str:
    surface = found.surface
    lower, upper = surface.lower, surface.upper
    if upper is None:
        return sentence(found.code, "The tool point moves on a surface; its area was not computed.")
    if lower is None:
        return sentence(
            found.code,
            "The tool point moves on a curved surface of at most {upper:.4g} m²: the area that two joints "
            "sweep; parts swept twice count twice.",
            upper=upper,
        )
    if surface.kind == "plane":
        return sentence(
            found.code,
            "The tool point moves on a plane and reaches at least {lower:.4g} m² and at most {upper:.4g} m² of it.",
            lower=lower,
            upper=upper,
        )
    return sentence(
        found.code,
        "The tool point moves on a sphere and reaches at least {lower:.4g} m² and at most {upper:.4g} m² of it.",
        lower=lower,
        upper=upper,
    )


@say.register
def _(found: Undersampled) -> str:
    return sentence(
        found.code,
        "Too few samples for cells this small: about {percent:.0f} % of the reachable cells hold no sample yet,"
        " so voids can't be judged.",
        percent=found.unseen_percent,
    )


@say.register
def _(found: VoidUnexpected) -> str:
    where = sentence(
        found.code,
        "An enclosed void of {litres:.3g} L lies at ({x}, {y}, {z}) mm, away from the shoulder, proven empty.",
        **_place(found),
    )
    return joined([where, _advice(found.cause)], " ")


@say.register
def _(found: VoidUncertain) -> str:
    return sentence(
        found.code,
        "An enclosed void of {litres:.3g} L may lie at ({x}, {y}, {z}) mm, away from the shoulder; there is no proof, "
        "and the samples can't tell.",
        **_place(found),
    )


@say.register
def _(found: VoidAtShoulder) -> str:
    return sentence(
        found.code,
        "An enclosed void of {litres:.3g} L surrounds the shoulder, where the arm can't fold to; no other void "
        "indicates a wrong joint range.",
        **_place(found),
    )


@say.register
def _(found: NoVoid) -> str:
    if found.undecided_percent is not None:
        return sentence(
            found.code,
            "The proof finds no enclosed void; {percent:.2g} % of the volume is left undecided.",
            percent=found.undecided_percent,
        )
    if found.proven:
        return sentence(found.code, "The workspace holds no enclosed void.")
    return sentence(found.code, "The samples leave no enclosed void inside the hull; no proof.")


def _advice(cause: VoidCause) -> str:
    """What to check, given a void's cause."""
    if is_predicate(cause):
        return sentence(
            "void_advice",
            "It {cause}: check the limits, the zero and the direction of joints 2 and 3.",
            cause=say(cause),
        )
    return sentence(
        "void_advice",
        "It has this cause: {cause}: check the limits, the zero and the direction of joints 2 and 3.",
        cause=say(cause),
    )


def _place(found: VoidUnexpected | VoidUncertain | VoidAtShoulder) -> dict[str, float | str]:
    shown = {"x": found.x_mm, "y": found.y_mm, "z": found.z_mm}
    return {"litres": found.litres} | {key: str(round(value)).replace("-", "−") for key, value in shown.items()}
