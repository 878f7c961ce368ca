"""Sentences of the collision stage's verdict."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.collision.shapes import TRIED
from er3a.pipeline.messages.say import joined, listed, say, say_as, texts
from er3a.pipeline.stages.collision.model import BaseInSolid, FreeSpace, HomeCollides, NeverFree, ShapesOverlap

NAMED = 3


TEXTS = texts(
    {
        "collision.never_free": "No joint vector within the limits is collision-free (proven): {pairs} always overlap.",
        "collision.shapes_overlap": (
            "The shapes of {pairs} overlap in every joint vector tried ({count}), which no joint between them "
            "explains: an error of the shapes, not of the arm. Correct their size, unit or placement in the robot's "
            "file, or allow the pair there with a reason. Of the rest of the shapes, {percent:.1f} % of the joint "
            "space is collision-free."
        ),
        "collision.base_in_solid": (
            "The base is inside {own_name} at every joint vector: correct the scene or the position of the base."
        ),
        "collision.home_collides": (
            "In the home pose {pair} overlap by {depth_mm:.1f} mm, so what can be reached from there is unknown; "
            "{percent:.1f} % of the joint space is collision-free."
        ),
        "collision.free_space#free": (
            "{percent:.1f} % of the joint space is collision-free. Of {places} cells reached, {clear} are proven "
            "reachable without collision, {joined} of these by a proven motion from home; at most {lost:.1f} % of the "
            "cells are lost to collisions."
        ),
        "collision.free_space#doubt": (
            "Pairs of links that may or may not collide, and are therefore checked: {undecided}."
        ),
        "collision.free_space#none": "No collision-free configuration was found.",
    }
)


@say.register
def _(found: NeverFree) -> str:
    return say_as(found, pairs=joined(listed(found.pairs[:NAMED]), ", "))


@say.register
def _(found: ShapesOverlap) -> str:
    return say_as(found, count=TRIED, pairs=joined(listed(found.pairs[:NAMED]), ", "), percent=100 * found.free_ratio)


@say.register
def _(found: BaseInSolid) -> str:
    return say_as(found, own_name=", ".join(found.solids[:NAMED]))


@say.register
def _(found: HomeCollides) -> str:
    return say_as(found, percent=100 * found.free_ratio)


@say.register
def _(found: FreeSpace) -> str:
    if not found.clear:
        return say_as(found, "none")
    free = say_as(found, "free", percent=100 * found.free_ratio, lost=100 * (1 - found.clear / found.places))
    if not found.undecided:
        return free
    doubt = say_as(found, "doubt")
    return joined([free, doubt], " ")
