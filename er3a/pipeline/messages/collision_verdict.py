"""Sentences of the collision stage's verdict."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.collision.pairs import TRIED
from er3a.pipeline.messages.say import joined, listed, say, sentence
from er3a.pipeline.stages.collision.model import BaseInSolid, FreeSpace, HomeCollides, NeverFree, ShapesOverlap

NAMED = 3


@say.register
def _(found: NeverFree) -> str:
    return sentence(
        found.code,
        "No joint vector within the limits is collision-free (proven): {pairs} always overlap.",
        pairs=joined(listed(found.pairs[:NAMED]), ", "),
    )


@say.register
def _(found: ShapesOverlap) -> str:
    return sentence(
        found.code,
        "The shapes of {pairs} overlap in every joint vector tried ({count}), which no joint between them explains: an "
        "error of the shapes, not of the arm. Correct their size, unit or placement in the robot's file, or allow the "
        "pair there with a reason. Of the rest of the shapes, {percent:.1f} % of the joint space is collision-free.",
        count=TRIED,
        pairs=joined(listed(found.pairs[:NAMED]), ", "),
        percent=100 * found.free_ratio,
    )


@say.register
def _(found: BaseInSolid) -> str:
    return sentence(
        found.code,
        "The base is inside {own_name} at every joint vector: correct the scene or the position of the base.",
        own_name=", ".join(found.solids[:NAMED]),
    )


@say.register
def _(found: HomeCollides) -> str:
    return sentence(
        found.code,
        "In the home pose {pair} overlap by {depth:.1f} mm, so what can be reached from there is unknown; "
        "{percent:.1f} % of the joint space is collision-free.",
        pair=say(found.pair),
        depth=found.depth_mm,
        percent=100 * found.free_ratio,
    )


@say.register
def _(found: FreeSpace) -> str:
    if not found.clear:
        return sentence(found.code, "No collision-free configuration was found.")
    free = sentence(
        found.code,
        "{percent:.1f} % of the joint space is collision-free. Of {places} cells reached, {clear} are proven "
        "reachable without collision, {joined} of these by a proven motion from home; at most {lost:.1f} % of the "
        "cells are lost to collisions.",
        percent=100 * found.free_ratio,
        lost=100 * (1 - found.clear / found.places),
        places=found.places,
        clear=found.clear,
        joined=found.joined,
    )
    if not found.undecided:
        return free
    doubt = sentence(
        found.code,
        "Pairs of links that may or may not collide, and are therefore checked: {count}.",
        count=found.undecided,
    )
    return joined([free, doubt], " ")
