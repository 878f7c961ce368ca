"""Sentences about what an arm meets."""

from __future__ import annotations

from er3a.collision.pairs import (
    BASE,
    TRIED,
    CarriedAndLink,
    CarriedAndSolid,
    LinkAndSolid,
    LinkPair,
    PairOverlaps,
    PairsUnexamined,
)
from er3a.pipeline.messages.say import joined, listed, say, sentence

NAMED = 3


@say.register
def _(found: LinkPair) -> str:
    return sentence(found.code, "{first} and {second}", first=_link(found.first), second=_link(found.second))


@say.register
def _(found: LinkAndSolid) -> str:
    return sentence(found.code, "{link} and {own_name}", link=_link(found.link), own_name=found.solid)


@say.register
def _(found: CarriedAndLink) -> str:
    return sentence(found.code, "{link} and {own_name}", link=_link(found.link), own_name=found.carried)


@say.register
def _(found: CarriedAndSolid) -> str:
    return sentence(found.code, "{own_name} and {solid}", own_name=found.carried, solid=found.solid)


@say.register
def _(found: PairOverlaps) -> str:
    return sentence(found.code, "{pair} overlap by {depth:.1f} mm", pair=say(found.pair), depth=found.depth_mm)


@say.register
def _(found: PairsUnexamined) -> str:
    named = listed(found.pairs[:NAMED])
    if len(found.pairs) > NAMED:
        named.append(sentence("none_for", "{count} more", count=len(found.pairs) - NAMED))
    return sentence(
        found.code,
        "Collisions not examined, because the shapes overlap in every joint vector tried ({count}): {pairs}.",
        count=TRIED,
        pairs=joined(named, ", "),
    )


def _link(number: int) -> str:
    return sentence("link", "base") if number == BASE else sentence("link", "link {number}", number=number)
