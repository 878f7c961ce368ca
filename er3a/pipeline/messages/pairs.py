"""Sentences about what an arm meets."""

from __future__ import annotations

from er3a.collision.shapes import (
    BASE,
    TRIED,
    CarriedAndLink,
    LinkAndSolid,
    LinkPair,
    PairsUnexamined,
)
from er3a.pipeline.messages.say import joined, listed, say, say_as, sentence, texts

NAMED = 3


TEXTS = texts(
    {
        "carried_and_solid": "{carried} and {solid}",
        "pair_overlaps": "{pair} overlap by {depth_mm:.1f} mm",
        "link_pair": "{first} and {second}",
        "link_and_solid": "{link} and {solid}",
        "carried_and_link": "{link} and {carried}",
        "pairs_unexamined": (
            "Collisions not examined, because the shapes overlap in every joint vector tried ({count}): {pairs}."
        ),
        "link#base": "base",
        "link#number": "link {number}",
    }
)


@say.register
def _(found: LinkPair) -> str:
    return say_as(found, first=_link(found.first), second=_link(found.second))


@say.register
def _(found: LinkAndSolid) -> str:
    return say_as(found, link=_link(found.link))


@say.register
def _(found: CarriedAndLink) -> str:
    return say_as(found, link=_link(found.link))


@say.register
def _(found: PairsUnexamined) -> str:
    named = listed(found.pairs[:NAMED])
    if len(found.pairs) > NAMED:
        named.append(sentence("more", count=len(found.pairs) - NAMED))
    return say_as(found, count=TRIED, pairs=joined(named, ", "))


def _link(number: int) -> str:
    return sentence("link#base") if number == BASE else sentence("link#number", number=number)
