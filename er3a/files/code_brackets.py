"""Pairs of brackets in a program, and texts cut at marks outside them."""

from __future__ import annotations

import re

from er3a.by_value import frozen

LONGEST_GROUP = 30_000  # characters between two brackets
_CLOSING = {"(": ")", "[": "]", "{": "}"}


@frozen
class CodeGroup:
    """A pair of brackets: where they are, what is in them and what is written before them."""

    start: int
    end: int
    bracket: str
    inside: str
    before: str


def groups_of(text: str) -> list[CodeGroup]:
    """All pairs of brackets, in the order of their ends."""
    found, open_ones = list[CodeGroup](), list[int]()
    for bracket in re.finditer(r"[()\[\]{}]", text):
        place = bracket.start()
        if bracket[0] in _CLOSING:
            open_ones.append(place)
        elif open_ones and _CLOSING[text[open_ones[-1]]] == bracket[0]:
            start = open_ones.pop()
            if place - start > LONGEST_GROUP:
                continue
            before = text[max(0, start - 120) : start]
            found.append(CodeGroup(start, place, text[start], text[start + 1 : place], before))
    return found


def parts(text: str, mark: str = ",") -> list[str]:
    """A text cut at marks that are in no brackets and no quotes."""
    cut, depth, quote, start = list[str](), 0, "", 0
    for place, sign in enumerate(text):
        if quote:
            quote = "" if sign == quote else quote
        elif sign in "\"'" and not re.match(r"[\w\])}.]", text[max(place - 1, 0) : place]):
            quote = sign
        else:
            depth += (sign in "([{") - (sign in ")]}")
            if sign == mark and depth == 0:
                cut.append(text[start:place])
                start = place + 1
    return [each.strip() for each in [*cut, text[start:]]]
