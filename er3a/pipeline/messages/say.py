"""From findings to sentences in the language in use.

The texts of an area stand in one table, by code: of a finding, or of a sentence that others are made of. Each has one
form. The fields of a text are those of its finding::

    TEXTS = texts(
        {
            "not_reached": "joint {joint} is {gap_mm:.1f} mm short[ (assumed{assumed:?})]",
            "wrong_limit": "the {side:side} is wrong",
            "blocked": "blocked by {bodies:3, }",
        }
    )

Numbers are formatted as the English text says, and a finding in a field is said. What is between ``[`` and ``]`` is
there only if each of its fields has a value: not None, and no empty text or list. A field with the format ``?`` or
``!`` is not shown; it asks that its value holds, or does not hold: a truth value, a number other than 0, a list.
Formats besides those of Python:

- the name of a table of words (:data:`WORDS`): the word for the field's value;
- one of :data:`FORMATS`: ``own`` for a title out of somebody's file, ``unit`` for a unit after its number,
  ``at_least L`` for a bound that stays one;
- of several values: how many are shown at most, the format of each, and what is between them: ``{bodies:3, }``,
  ``{xyz_mm:.1f, }``, ``{faults:; }``.

Each text has ``{assumed}``, which holds if its finding's basis is assumed. Catalogues hold translations by key, so that
a changed English wording loses none. Where a sentence needs more than that, a function makes it::

    @says("free_space")
    def _(found: Finding) -> str:
        return say_as(found, percent=100 * found.free_ratio)

Views and the command line import the modules whose findings they show.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from functools import partial, singledispatch
from string import Formatter
from typing import Any

from er3a.finding import Amount
from er3a.finding import Finding as Found
from er3a.pipeline import language
from er3a.pipeline.language import N_, tr
from er3a.pipeline.messages.numbers import at_least

LONGEST, EXCERPT = 2_000, 200  # letters
_texts: dict[str, str] = {}
Maker = Callable[[Found], str]
WORDS: dict[str, Mapping[Any, str]] = {}
"""Tables of words marked with ``N_``: a field whose format names one takes its word, as ``{reason:target_reason}``."""
MAKERS: dict[str, Maker] = {}
"""What makes the texts of findings, by their codes, where a text alone can't."""
_OPTIONAL = re.compile(r"\[([^\[\]]*)\]")
_MARKS = ("?", "!")
_MARKED = re.compile(r"\{\w+:[?!]\}")
_SEVERAL = re.compile(r"(\d*)([\w.+]*?)(; |, |\. | or | and | |)")
FORMATS: dict[str, Callable[[Any], str]] = {
    "own": language.own_title,
    "unit": partial(language.with_unit, ""),
    "at_least L": lambda litres: at_least(litres, "L"),
    "at_least %": lambda ratio: f"{at_least(100 * ratio, 1)} %",
}
"""Formats of fields besides those of Python and the tables of words; modules of messages add theirs."""


def texts(table: Mapping[str, str]) -> Mapping[str, str]:
    """Make the texts of an area known, and return them."""
    _texts.update(table)
    return table


TEXTS = texts(
    {
        "bracketed": "{text} ({more})",
        "finding": "{finding}.",
        "more": "{count} more",
        "stage.not_computed": "Not computed: {reason}",
        "stage.not_examined": "This stage has not been computed yet.",
        "stage.outdated": "Changed since, so this tells of what was before (run the study again): {names}. {text}",
    }
)


def english(key: str) -> str:
    """The English text by its key."""
    return _texts[key]


@singledispatch
def say(finding: Any) -> str:
    """A finding as a text in the language in use, by its code; functions for types are registered with it."""
    maker = MAKERS.get(finding.code, say_as)
    return maker(finding)


def by_code(makers: dict[str, Maker]) -> Callable[..., Callable[[Maker], Maker]]:
    """What has functions make texts of findings, where a text alone can't.

    Parameters
    ----------
    makers : by the finding's code; a function decorated with ``@...("code", ...)`` is added
    """

    def of(*codes: str) -> Callable[[Maker], Maker]:
        def known(maker: Maker) -> Maker:
            makers.update(dict.fromkeys(codes, maker))
            return maker

        return known

    return of


says = by_code(MAKERS)
"""Has a function make the texts of findings with these codes."""


def same_text(key: str, *codes: str) -> None:
    """Have findings with these codes share the text of a key, which is none of a finding's."""
    MAKERS.update(dict.fromkeys(codes, lambda found: sentence(key, **_params(found))))


def _params(finding: Found) -> Mapping[str, Any]:
    return {"assumed": finding.basis == "assumed", **finding.params}


def excerpt(text: str) -> str:
    """The beginning of a text that is longer than any sentence of ours, such as a line of a program of 900 kB."""
    return text if len(text) <= LONGEST else f"{text[:EXCERPT]} …"


def say_as(finding: Found, /, **parts: Any) -> str:
    """A finding's text, with parts besides its own fields or in place of them."""
    return sentence(finding.code, **{**_params(finding), **parts})


def sentence(key: str, /, **parts: Any) -> str:
    """A text by its key in the language in use, its fields filled in."""
    try:
        text = _texts[key]
    except KeyError:
        raise KeyError(f"no text is known for {key!r}; import the module of messages that has it") from None
    held, translated = _held(text, parts), _held(language.by_key(key, text), parts)
    return language.filled(translated, held, parts, _as_text).strip()


def _held(text: str, parts: Mapping[str, Any]) -> str:
    """A text without those of its optional parts whose fields hold nothing."""

    def holds(name: str, spec: str) -> bool:
        value = parts[name]
        if spec in _MARKS:
            return bool(value) == (spec == "?")
        return value is not None and (not isinstance(value, str | tuple | list) or len(value) > 0)

    def part(found: re.Match[str]) -> str:
        fields = [(name, spec or "") for _, name, spec, _ in Formatter().parse(found[1]) if name]
        return _MARKED.sub("", found[1]) if all(holds(*field) for field in fields) else ""

    return _OPTIONAL.sub(part, text)


def _as_text(part: Any, spec: str) -> str:
    """A part of a text; see the module for formats."""
    if spec in FORMATS:
        return FORMATS[spec](part)
    if isinstance(part, tuple | list):
        return _several(part, spec)
    if spec in WORDS:
        part, spec = word(spec, WORDS[spec], part), ""
    if hasattr(part, "code"):
        return say(part)
    if isinstance(part, Amount):
        return language.with_unit(language.as_text(part.value, spec), part.unit.removeprefix("1"))
    if isinstance(part, str):
        return excerpt(part)
    text = language.as_text(part + 0.0 if isinstance(part, float) else part, spec)
    return f"{text[:-1]} %" if spec.endswith("%") else text


def _several(parts: tuple[Any, ...] | list[Any], spec: str) -> str:
    """Values as one text: how many at most, the format of each, what is between them."""
    found = _SEVERAL.fullmatch(spec)
    if found is None:
        raise ValueError(f"{spec!r} is no format of several values")
    most, each, separator = found.groups()
    shown = [_as_text(part, each) for part in parts[: int(most) if most else None]]
    more = len(parts) - len(shown)
    if each.endswith(("f", "g")):  # coordinates
        return separator.join(shown)
    return joined([*shown, sentence("more", count=more) if more else ""], separator or "; ")


def word(code: str, words: Mapping[Any, str], key: Any) -> str:
    """The word for a code out of a table of words marked with ``N_``; a key without one stays as it is."""
    return language.translated(code, words[key]) if key in words else key


def listed(findings: Iterable[Found]) -> list[str]:
    """Each finding's text."""
    return [say(finding) for finding in findings]


def say_all(findings: Iterable[Found]) -> str:
    """Findings, each a sentence, one after the other."""
    return joined(listed(findings), " ")


def bracketed(text: str, more: str) -> str:
    """A text, followed by something in brackets, such as a unit; the text alone where that is empty."""
    return sentence("bracketed", text=text, more=more) if more else text


def say_first(finding: Any) -> str:
    """A finding with the first of the reasons that it names, and of the bodies that touch the first and the deepest."""
    if reasons := getattr(finding, "reasons", ()):
        return say(finding.but(reasons=reasons[:1]))
    if touches := getattr(finding, "touches", ()):
        deepest = max(touches, key=lambda each: each.depth_mm)
        return say(finding.but(touches=tuple(dict.fromkeys((touches[0], deepest)))))
    return say(finding)


SEPARATORS = (N_("; "), N_(", "), N_(". "), N_(" "), N_(": "), N_(" or "), N_(" and "))


def joined(parts: Iterable[str], separator: str = "; ") -> str:
    """Texts as one, with one of ``SEPARATORS`` between them; empty ones are left out."""
    return tr(separator).join(filter(None, parts))
