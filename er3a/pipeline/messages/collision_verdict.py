"""Sentences of the collision stage's verdict."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.pipeline.messages.say import joined, listed, say, sentence
from er3a.pipeline.stages.collision.model import BaseInSolid, FreeSpace, HomeCollides, NeverFree

NAMED = 3


@say.register
def _(found: NeverFree) -> str:
    return sentence(
        found.code,
        "No joint vector within the limits is free of collisions, proven: {pairs} always overlap.",
        pairs=joined(listed(found.pairs[:NAMED]), ", "),
    )


@say.register
def _(found: BaseInSolid) -> str:
    return sentence(
        found.code,
        "The base stands inside {own_name}, whatever the joints do: correct the scene or the base's place.",
        own_name=", ".join(found.solids[:NAMED]),
    )


@say.register
def _(found: HomeCollides) -> str:
    return sentence(
        found.code,
        "At home {pair} overlap by {depth:.1f} mm, so it is not known what can be reached from there; {percent:.1f} % "
        "of the joint space is free of collisions.",
        pair=say(found.pair),
        depth=found.depth_mm,
        percent=100 * found.free_ratio,
    )


@say.register
def _(found: FreeSpace) -> str:
    if not found.clear:
        return sentence(found.code, "No arm free of collisions was found.")
    free = sentence(
        found.code,
        "{percent:.1f} % of the joint space is free of collisions. Of {places} places reached, {clear} are proven to "
        "be reached clear of everything, {joined} of these by a proven motion from home.",
        percent=100 * found.free_ratio,
        places=found.places,
        clear=found.clear,
        joined=found.joined,
    )
    if not found.undecided:
        return free
    doubt = sentence(
        found.code,
        "Pairs of links of which it is not known whether they can meet, and which are watched: {count}.",
        count=found.undecided,
    )
    return joined([free, doubt], " ")
