"""What the collision page and recording say beside the verdict."""

from __future__ import annotations

from er3a.collision.matrix import PairState
from er3a.collision.shapes import BASE, TRIED, link_label
from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.messages.say import sentence, word

FIGURES = {
    "free_of_collisions": N_("Collision-free joint space"),
    "free_of_itself": N_("Free of self-collision"),
    "free_of_scene": N_("Free of collisions with the scene"),
    "clear_places": N_("Cells reached without collision"),
    "joined_places": N_("Of these, connected to home"),
    "lost_volume": N_("Volume lost to collisions, estimate"),
    "watched_pairs": N_("Pairs of links that are checked"),
    "undecided_pairs": N_("Pairs undecided"),
}
STATES: dict[PairState, str] = {
    "never": N_("never collide"),
    "joined": N_("adjacent"),
    "overlaps": N_("shapes in error"),
    "meets": N_("can collide"),
    "undecided": N_("undecided"),
    "allowed": N_("allowed"),
    "watched": N_("checked on request"),
}


def state_word(state: PairState) -> str:
    """What holds of a pair, in short."""
    return word("collision.state", STATES, state)


def body_word(name: str) -> str:
    """A body of the arm, or what is carried, by its name."""
    if name == link_label(BASE):
        return sentence("link#base")
    number = name.removeprefix("link_")
    return sentence("link#number", number=number) if number != name else name


def why(state: PairState, least_mm: float, left_out_mm: float, boxes: int, witness: str, reason: str) -> str:
    """Why a pair is watched or not.

    Parameters
    ----------
    witness : joint values with their units; empty where there are none
    """
    match state:
        case "never":
            return tr(
                "At least {least:.1f} mm apart in every pose; proven with {boxes} boxes.", least=least_mm, boxes=boxes
            )
        case "allowed" | "watched":
            return tr("Decided in the robot or scene file: {reason}", reason=reason)
        case "undecided":
            return tr("Neither proven apart nor found to collide, in {boxes} boxes; checked.", boxes=boxes)
        case "overlaps":
            return tr(
                "Their shapes overlap in every joint vector tried ({count}), and no joint explains it: correct the "
                "shapes. What overlaps is not checked.",
                count=TRIED,
            )
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
