"""From findings to sentences in the language in use.

Each module of this room makes sentences for the findings of one area::

    @say.register
    def _(found: OutOfReach) -> str:
        return sentence(found.code, "joint {joint} is {gap:.1f} mm short", joint=found.joint, gap=found.gap_mm)

Views and the command line import the modules whose findings they show. The code of a finding is the context of its
text in the catalogues.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import singledispatch
from typing import Any, TypeVar

from er3a.findings import Finding
from er3a.pipeline.messages import language
from er3a.pipeline.messages.language import N_

KeyT = TypeVar("KeyT", bound=str)


PAIRS = {"; ": N_("{first}; {rest}"), ", ": N_("{first}, {rest}"), " ": N_("{first} {rest}")}


@singledispatch
def say(finding: Any) -> str:
    """A finding as a text in the language in use."""
    raise TypeError(f"no sentence is known for {type(finding).__name__}; import the room of messages that has it")


def sentence(code: str, template: str, /, **parts: Any) -> str:
    """A text in the language in use, its fields filled in as ``str.format`` does; ``code`` tells equal texts apart."""
    return language.filled(language.translated(code, template), template, parts)


def counted(code: str, one: str, many: str, count: int, /, **parts: Any) -> str:
    """A text whose form depends on a number, which is the field ``{count}`` in it."""
    found = language.translated_count(code, one, many, count)
    return language.filled(found, one if count == 1 else many, {"count": count} | parts)


def word(code: str, words: Mapping[KeyT, str], key: KeyT) -> str:
    """The word for a code out of a table of words marked with ``N_``; a key without one stays as it is."""
    return language.translated(code, words[key]) if key in words else key


def listed(findings: Iterable[Finding]) -> list[str]:
    """Each finding's text."""
    return [say(finding) for finding in findings]


def say_all(findings: Iterable[Finding]) -> str:
    """Findings, each a sentence, one after the other."""
    return joined(listed(findings), " ")


def joined(texts: Iterable[str], separator: str = "; ") -> str:
    """Texts as one: apart by ``"; "``, ``", "`` or ``" "`` (whole sentences); empty ones are left out."""
    told = [text for text in texts if text]
    whole = told[-1] if told else ""
    for text in reversed(told[:-1]):
        whole = sentence("joined", PAIRS[separator], first=text, rest=whole)
    return whole
