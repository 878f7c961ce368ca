"""Collisions: pairs of bodies, the verdict of the stage, and what its page and recording say."""

from __future__ import annotations

from typing import Any

from er3a.collision.matrix import PairState
from er3a.collision.pairs import BASE, TRIED, bodies_of
from er3a.finding import Finding
from er3a.pipeline.language import own_title, tr, with_unit, words
from er3a.pipeline.messages import expectations, scope  # noqa: F401
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import FORMATS, WORDS, same_text, say, say_as, says, sentence, texts, word
from er3a.pipeline.stages.collision.model import NEAR_MM

KEY_FIGURES = words(
    {
        "free_of_collisions": "Collision-free joint space",
        "clear_places": "Cells reached without collision",
        "joined_places": "Of these, connected to home",
        "lost_volume": "Volume lost to collisions, estimate",
    }
)
HOMES = words({"study": "as given", "zero": "joints at 0", "chosen": "chosen away from singular poses"})
STATES: dict[PairState, str] = words(
    {
        "never": "never collide",
        "joined": "adjacent",
        "overlaps": "shapes in error",
        "coarse": "shapes too coarse",
        "meets": "can collide",
        "undecided": "undecided",
        "allowed": "allowed",
        "watched": "checked on request",
    }
)


TEXTS = texts(
    {
        "pair": "{bodies:body and }",
        "hits": "hits [{solid:own}][itself{solid:!}]",
        "least_clearance": "least clearance {far_mm:.1f} mm: {pair}",
        "why.decided": "Decided in the robot or scene file: {reason:own}",
        "why.undecided": "Neither proven apart nor found to collide, in {boxes} ranges of joint values; checked.",
        "why.overlaps": (
            "Their shapes overlap in every joint vector tried ({count}), and no joint explains it: correct the shapes. "
            "What overlaps is not checked."
        ),
        "why.coarse": "Their shapes overlap in too many joint vectors. Not checked: give the robot closer shapes.",
        "why.meets": (
            "[{radius:?}They touch by design: left out within {radius:.0f} mm of their joint.]"
            "[{radius:?} Outside they collide at ({witness}).][{radius:?}{witness:!} Outside no collision was found.]"
            "[{radius:!}They collide at joint values ({witness}).]"
            "[{radius:!}{witness:!}A joint joins them. Not checked.]"
        ),
        "pair_overlaps": "{pair} overlap by {depth_mm:.1f} mm",
        "pair_too_near": "{pair} come within {clearance_mm:.1f} mm; to keep: {margin_mm:g} mm",
        "pairs_unexamined": "Not checked, as the shapes overlap where no arm's can: {pairs:3, }.",
        "shapes_assumed": (
            "{partial:shapes_missing}, so real collisions may differ: give them under envelopes in the robot's file."
            "[ Within {margin_mm:g} mm of assumed shapes: {near:, }.]"
        ),
        "collision.never_free": "No joint vector within the limits is free of collisions: {pairs:3, } always overlap.",
        "collision.shapes_overlap": (
            "Shapes in error: {pairs:3, } overlap in all {count} joint vectors tried. Correct their size, unit or "
            "placement in the robot's file, or allow the pair there. Of the rest, {free_ratio:.1%} of the joint space "
            "is collision-free."
        ),
        "collision.base_in_solid": (
            "The base is always inside {solids:own, }: correct the scene or the position of the base."
        ),
        "collision.home_collides": (
            "{found} At home {pair} overlap by {depth_mm:.1f} mm, so what can be reached from there is unknown."
        ),
        "collision.free_space": (
            "[Targets that collide in every solution: {blocked:3, }.][{targets:?} Targets solved: {targets}; the "
            "nearest is clear by {nearest}.][ Paths that collide: {colliding:, }.] {free_ratio:.1%} of the joint "
            "space is collision-free. Of {places} cells {clear} are reached without collision.[ From home: "
            "{joined}.]"
        ),
        "nearest_target": "{clearance_mm:.1f} mm ({name}[, {pair}{near:?}])",
        "colliding": "{name} ({pair}[; as expected{expected:?}])",
    }
)
WORDS["shapes_missing"] = words(
    {
        False: "Link shapes are assumed",
        True: "Shapes are missing for parts of links",
    }
)


def _body(body: int | str) -> str:
    return own_title(body) if isinstance(body, str) else sentence("link", base=body == BASE, number=body)


FORMATS["body"] = _body


@says("link_pair", "link_and_solid", "carried_and_link", "carried_and_solid")
def _(found: Finding) -> str:
    return sentence("pair", bodies=bodies_of(found))


same_text("colliding", "colliding_path", "colliding_target")


@says("nearest_target")
def _(found: Finding) -> str:
    return say_as(found, near=found.clearance_mm <= NEAR_MM)


def clearance_text(clearance_mm: float, pair: Finding) -> str:
    """How near what comes; what is farther than ``NEAR_MM`` decides nothing, so it is not named."""
    if clearance_mm > NEAR_MM:
        return with_unit(fixed(clearance_mm, 0), "mm")
    return tr("{far} mm: {pair}", far=fixed(clearance_mm, 1), pair=say(pair))


def hit_word(pair: Finding) -> str:
    """What an arm, or what it carries, hits, in two words."""
    return sentence("hits", solid=pair.params.get("solid"))


@says("collision.home_collides")
def _(found: Finding) -> str:
    return say_as(found, found=sentence("collision.free_space", **found.params))


def state_word(state: PairState) -> str:
    """What holds of a pair, in short."""
    return word("collision.state", STATES, state)


def why(state: PairState, **parts: Any) -> str:
    """Why a pair is watched or not.

    Parameters
    ----------
    parts : ``radius``, mm, of what is left out around a joint; ``witness``, joint values with their units at which the
        pair collides, empty where there are none; ``boxes`` of joint values looked at; ``reason`` that somebody wrote
    """
    kind = "decided" if state in ("allowed", "watched") else state if f"why.{state}" in TEXTS else "meets"
    return sentence(f"why.{kind}", count=TRIED, **parts)
