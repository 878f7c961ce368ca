"""Collisions: pairs of bodies, the verdict of the stage, and what its page and recording say."""

from __future__ import annotations

from collections.abc import Sequence
from typing import assert_never

import numpy as np

from er3a.collision.matrix import PairState
from er3a.collision.pairs import BASE, TRIED, Pair
from er3a.collision.scene import Box, Cylinder, Mesh, Plane, Scene, Sphere
from er3a.finding import AnyFinding, Finding
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import N_, own_title, tr
from er3a.pipeline.messages import scope  # noqa: F401
from er3a.pipeline.messages.numbers import at_least, at_most
from er3a.pipeline.messages.say import Plural, by, joined, listed, say, say_as, says, sentence, texts, word
from er3a.pipeline.stages.collision.model import FreeSpace, HomeCollides

NAMED = 3
KEY_FIGURES = {
    "free_of_collisions": N_("Collision-free joint space"),
    "free_of_itself": N_("Free of self-collision"),
    "free_of_scene": N_("Free of collisions with the scene"),
    "clear_places": N_("Cells reached without collision"),
    "joined_places": N_("Of these, connected to home"),
    "lost_volume": N_("Volume lost to collisions, estimate"),
    "watched_pairs": N_("Pairs of links that can collide, and are checked"),
    "undecided_pairs": N_("Pairs undecided"),
}
STATES: dict[PairState, str] = {
    "never": N_("never collide"),
    "joined": N_("adjacent"),
    "overlaps": N_("shapes in error"),
    "guessed": N_("guess in error"),
    "meets": N_("can collide"),
    "undecided": N_("undecided"),
    "allowed": N_("allowed"),
    "watched": N_("checked on request"),
}


TEXTS = texts(
    {
        "carried_and_solid": "{carried} and {solid}",
        "pair_overlaps": "{pair} overlap by {depth_mm:.1f} mm",
        "pair_too_near": "{pair} come within {clearance_mm:.1f} mm; {margin_mm:g} mm are to be kept",
        "link_pair": "{first} and {second}",
        "link_and_solid": "{link} and {solid}",
        "carried_and_link": "{link} and {carried}",
        "pairs_unexamined": "Collisions not examined, because the shapes overlap where no arm's can: {pairs}.",
        "shapes_assumed#given": "Link shapes are assumed (no authoritative source): real collisions may differ.",
        "shapes_assumed#guessed": (
            "Link shapes are capsules guessed from the table, as the robot's file gives none: real collisions may "
            "differ."
        ),
        "shapes_assumed#partial": (
            "The given shapes cover some links only in part, so that no more is shown than of the shapes themselves: "
            "real collisions may differ."
        ),
        "shapes_assumed.near": "Within {margin_mm:g} mm of assumed shapes, and so not settled: {names}.",
        "collision.never_free#given": (
            "No joint vector within the limits is collision-free (proven): {pairs} always overlap."
        ),
        "collision.never_free#assumed": (
            "No joint vector within the limits is free of collisions of the assumed shapes: {pairs} always overlap."
        ),
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
            "reachable without collision, {joined} of these by a proven motion from home; at most {lost} % of the "
            "cells are lost to collisions."
        ),
        "collision.free_space#assumed": (
            "With the assumed shapes {percent:.1f} % of the joint space is collision-free. Of {places} cells reached, "
            "{clear} are reachable without collision, {joined} of these by a collision-free motion from home; at most "
            "{lost} % of the cells are lost to collisions."
        ),
        "collision.free_space#doubt": (
            "Pairs of links that may or may not collide, and are therefore checked: {undecided}."
        ),
        "collision.free_space#targets": Plural(
            "targets",
            "The chosen solution of {count} target is clear by {nearest}.",
            "The chosen solutions of {count} targets are clear by {nearest} or more.",
        ),
        "nearest_target": "{clearance_mm:.1f} mm ({name}, {pair})",
        "colliding_path": by("expected", true="{name} ({pair}; as expected)", false="{name} ({pair}; not expected)"),
        "collision.free_space#paths": Plural(
            "colliding", "{count} path collides: {colliding:, }.", "{count} paths collide: {colliding:, }."
        ),
        "colliding_target": by("expected", true="{name} ({pair}; as expected)", false="{name} ({pair}; not expected)"),
        "collision.free_space#blocked": Plural(
            "blocked",
            "{count} target collides in every solution within the limits: {named}.",
            "{count} targets collide in every solution within the limits: {named}.",
        ),
        "collision.free_space#none": "No collision-free configuration was found.",
    }
)


@say.register
def _(found: Pair) -> str:
    bodies = {key: value for key, value in vars(found).items() if key != "code"}
    return say_as(found, **{key: own_title(it) if isinstance(it, str) else _link(it) for key, it in bodies.items()})


@says("pairs_unexamined")
def _(found: Finding) -> str:
    return say_as(found, pairs=_first_of(found.pairs))


def _first_of(findings: Sequence[AnyFinding]) -> str:
    """The first few, and how many more there are."""
    more = [sentence("more", count=len(findings) - NAMED)] if len(findings) > NAMED else []
    return joined([*listed(findings[:NAMED]), *more], ", ")


@says("shapes_assumed")
def _(found: Finding) -> str:
    rests = say_as(found, "partial" if found.partial else "given" if found.given else "guessed")
    return joined([rests, near_shapes(found.margin_mm, found.near)], " ")


def near_shapes(margin_mm: float, names: Sequence[str]) -> str:
    """What comes so near to assumed shapes that it is not settled; empty where nothing does."""
    return sentence("shapes_assumed.near", margin_mm=margin_mm, names=", ".join(names)) if names else ""


def _link(number: int) -> str:
    return sentence("link#base") if number == BASE else sentence("link#number", number=number)


@says("collision.never_free")
def _(found: Finding) -> str:
    return say_as(found, "assumed" if found.assumed else "given", pairs=joined(listed(found.pairs[:NAMED]), ", "))


@says("collision.shapes_overlap")
def _(found: Finding) -> str:
    return say_as(found, count=TRIED, pairs=joined(listed(found.pairs[:NAMED]), ", "), percent=100 * found.free_ratio)


@says("collision.base_in_solid")
def _(found: Finding) -> str:
    return say_as(found, own_name=", ".join(found.solids[:NAMED]))


@say.register
def _(found: HomeCollides) -> str:
    home = say_as(found, percent=100 * found.found.free_ratio)
    return joined([*_asked(found.found), home], " ")


@say.register
def _(found: FreeSpace) -> str:
    free = say_as(found, "none")
    if found.clear:
        free = say_as(
            found,
            "assumed" if found.assumed else "free",
            percent=100 * found.free_ratio,
            lost=at_most(100 * (1 - found.clear / found.places), 1),
        )
    doubt = say_as(found, "doubt") if found.undecided else ""
    return joined([*_asked(found), free, doubt], " ")


def _asked(found: FreeSpace) -> list[str]:
    """What targets and paths come to, a sentence each."""
    targets = say_as(found, "targets") if found.nearest else ""
    paths = say_as(found, "paths") if found.colliding else ""
    blocked = say_as(found, "blocked", named=_first_of(found.blocked)) if found.blocked else ""
    return [blocked, targets, paths]


def solid_rows(scene: Scene | None) -> list[list[str]]:
    """What stands around an arm: name, centre and size of each solid, mm; of a plane its normal and where it ends."""
    rows = []
    for each in scene.solids if scene else ():
        match each:
            case Plane():
                rows.append([each.name, tr("all below a plane"), _below(each)])
                continue
            case Box():
                size = tr("box {size}", size=_millimetres(each.size).replace(", ", " × "))
            case Cylinder():
                size = tr("cylinder ⌀ {wide:g} × {long:g}", wide=2000 * each.radius, long=1000 * each.length)
            case Sphere():
                size = tr("ball ⌀ {wide:g}", wide=2000 * each.radius)
            case Mesh():
                extent = np.ptp(np.concatenate(each.pieces), axis=0)
                size = tr("mesh {size}", size=_millimetres(extent).replace(", ", " × "))
            case _:
                assert_never(each)
        rows.append([each.name, size, f"({_millimetres(each.T[:3, 3])})"])
    return rows


def _below(plane: Plane) -> str:
    """Where a plane's solid ends: in words where the plane is square to an axis."""
    end = _millimetres([plane.offset])
    if np.count_nonzero(plane.normal) == 1 and plane.normal.max() > 0:
        return tr("all points with {axis} up to {end}", axis="xyz"[int(np.argmax(plane.normal))], end=end)
    return tr("up to {end} from the origin along ({normal})", end=end, normal=_millimetres(plane.normal, 1))


def _millimetres(values: Reals | list[float], scale: float = 1000) -> str:
    return ", ".join(f"{scale * value + 0.0:.6g}" for value in values).replace("-", "−")


def state_word(state: PairState) -> str:
    """What holds of a pair, in short."""
    return word("collision.state", STATES, state)


def why(
    state: PairState, least_mm: float, left_out_mm: float, boxes: int, witness: str, reason: str, *, assumed: bool
) -> str:
    """Why a pair is watched or not.

    Parameters
    ----------
    assumed : whether no document that verdicts rest on gives the shapes
    witness : joint values with their units; empty where there are none
    """
    match state:
        case "never" if assumed:
            return tr(
                "The assumed shapes are at least {least} mm apart in every pose ({boxes} ranges of joint values).",
                least=at_least(least_mm, 1),
                boxes=boxes,
            )
        case "never":
            return tr(
                "At least {least} mm apart in every pose; proven over {boxes} ranges of joint values.",
                least=at_least(least_mm, 1),
                boxes=boxes,
            )
        case "allowed" | "watched":
            return tr("Decided in the robot or scene file: {reason}", reason=own_title(reason))
        case "undecided":
            return tr(
                "Neither proven apart nor found to collide, in {boxes} ranges of joint values; checked.", boxes=boxes
            )
        case "overlaps":
            return tr(
                "Their shapes overlap in every joint vector tried ({count}), and no joint explains it: correct the "
                "shapes. What overlaps is not checked.",
                count=TRIED,
            )
        case "guessed":
            return tr("Shapes guessed from the table are too coarse here. Not checked: give the robot's shapes.")
        case "joined" if not left_out_mm:
            return tr("A joint joins them. Not checked.")
    if not left_out_mm:
        return tr("They collide at joint values ({witness}).", witness=witness)
    joined = tr(
        "They touch by design: the region within {radius:.0f} mm of their joint is left out.", radius=left_out_mm
    )
    if witness:
        return tr(
            "{first} {rest}", first=joined, rest=tr("Outside that region they collide at ({witness}).", witness=witness)
        )
    rest = tr(
        "Outside that region no collision was found; if one of them lies within it as a whole, nothing is checked."
    )
    return tr("{first} {rest}", first=joined, rest=rest)
