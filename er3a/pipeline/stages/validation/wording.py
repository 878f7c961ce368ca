"""Findings and words put together in the page's language."""

from __future__ import annotations

import re
from collections.abc import Iterable

from er3a.pipeline.messages.language import tr


def listed(words: Iterable[str]) -> str:
    """Words of results in a row."""
    return tr(", ").join(tr(word) for word in words)


def in_a_row(first: str, second: str) -> str:
    """Two sentences, one after the other."""
    return tr("{first} {rest}", first=first, rest=second)


def both_faults(faults: list[str]) -> str:
    """One fault or two as one text."""
    if len(faults) == 1:
        return typographic(faults[0])
    return typographic(tr("{fault} and {second_fault}", fault=faults[0], second_fault=faults[1]))


def typographic(finding: str) -> str:
    """A finding in the page's language, with minus signs instead of hyphens before numbers."""
    return re.sub(r"(?<![0-9A-Za-z])-(?=[0-9])", "−", tr(finding))
