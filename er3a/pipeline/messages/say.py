"""From findings to sentences in the language in use.

The texts of an area stand in one table, by key: the code of a finding, or of a sentence that others are made of, and
where it has several forms, ``#`` and which one. The fields of a text are those of its finding::

    TEXTS = texts(
        {
            "not_reached": "joint {joint} is {gap_mm:.1f} mm short",
            "wrong_limit": by("side", lower="the lower limit is wrong", upper="the upper limit is wrong"),
            "missed": Plural("missed", "{count} check is missed", "{count} checks are missed"),
            "blocked": "blocked by {bodies:, }",
        }
    )

Numbers are formatted as the English text says, and a finding in a field is said; several findings or texts are joined
by ``", "``, ``"; "`` or ``" "``, whichever stands as their format. Catalogues hold translations by key, so that a
changed English wording loses none. Where a sentence needs more than that, a function makes it::

    @says("free_space")
    def _(found: Finding) -> str:
        return say_as(found, percent=100 * found.free_ratio)

Views and the command line import the modules whose findings they show.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import singledispatch
from typing import Any, Literal, TypeVar

from er3a.finding import Amount, AnyFinding
from er3a.finding import Finding as Found
from er3a.pipeline import language

KeyT = TypeVar("KeyT", bound=str)
Separator = Literal["; ", ", ", ". ", " "]


@dataclass(frozen=True)
class Plural:
    """A text whose form depends on a field: a number, or how many it holds; ``{count}`` in the text."""

    field: str
    one: str
    many: str


@dataclass(frozen=True)
class By:
    """Texts of which a field decides."""

    field: str
    texts: Mapping[str, str]


LONGEST, EXCERPT = 2_000, 200  # letters
Text = str | Plural
_texts: dict[str, Text] = {}
Maker = Callable[[Found], str]
WORDS: dict[str, Mapping[Any, str]] = {}
"""Tables of words marked with ``N_``: a field whose format names one takes its word, as ``{reason:target_reason}``."""
MAKERS: dict[str, Maker] = {}
"""What makes the texts of findings, by their codes, where a text alone can't."""
_fields: dict[str, str] = {}  # of keys whose form is decided by a field of the finding


def by(field: str, **variants: str) -> By:
    """Texts by the value of a field; those of a truth value are ``true`` and ``false``."""
    return By(field, variants)


def texts(table: Mapping[str, Text | By]) -> Mapping[str, Text | By]:
    """Make the texts of an area known, and return them."""
    for key, text in table.items():
        if isinstance(text, By):
            _fields[key] = text.field
            _texts.update({f"{key}#{variant}": each for variant, each in text.texts.items()})
        else:
            _texts[key] = text
    return table


TEXTS = texts(
    {
        "joined#; ": "{first}; {rest}",
        "joined#, ": "{first}, {rest}",
        "joined#. ": "{first}. {rest}",
        "bracketed": "{text} ({more})",
        "joined# ": "{first} {rest}",
        "finding": "{finding}.",
        "more": "{count} more",
        "stage.not_computed": "Not computed: {reason}",
        "stage.not_examined": "This stage has not been computed yet.",
        "page.last_run": (
            "The last run of this study did not end well, so this page may tell of what was before: {problem}"
        ),
        "stage.outdated": "Changed since, so this tells of what was before (run the study again): {names}. {text}",
    }
)


def english(key: str) -> tuple[str, ...]:
    """The English forms of a text by its key."""
    text = _texts[key]
    return (text.one, text.many) if isinstance(text, Plural) else (text,)


@singledispatch
def say(finding: Any) -> str:
    """A finding as a text in the language in use, by its code; functions for types are registered with it."""
    if maker := MAKERS.get(finding.code):
        return maker(finding)
    field = _fields.get(finding.code)
    return say_as(finding, str(_params(finding)[field]).lower() if field else "")


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


def _params(finding: Any) -> Mapping[str, Any]:
    if isinstance(finding, Found):
        return finding.params
    return {name: getattr(finding, name) for name in finding.__dataclass_fields__}


def excerpt(text: str) -> str:
    """The beginning of a text that is longer than any sentence of ours, such as a line of a program of 900 kB."""
    return text if len(text) <= LONGEST else f"{text[:EXCERPT]} …"


def say_as(finding: AnyFinding, variant: str = "", /, **parts: Any) -> str:
    """A finding as one of its texts, with parts besides its own fields or in place of them."""
    return sentence(f"{finding.code}#{variant}" if variant else finding.code, **{**_params(finding), **parts})


def sentence(key: str, /, **parts: Any) -> str:
    """A text by its key in the language in use, its fields filled in."""
    try:
        text = _texts[key]
    except KeyError:
        raise KeyError(f"no text is known for {key!r}; import the module of messages that has it") from None
    if isinstance(text, Plural):
        count = parts[text.field]
        count = len(count) if isinstance(count, Sequence) else count
        form, parts = text.one if count == 1 else text.many, parts | {"count": count}
        return language.filled(language.by_key(key, form, count), text.many + form, parts, _as_text)
    return language.filled(language.by_key(key, text), text, parts, _as_text)


def _as_text(part: Any, spec: str) -> str:
    """A part of a text: findings as sentences, words out of tables, several parts joined as the format says."""
    if spec in WORDS:
        part, spec = word(spec, WORDS[spec], part), ""
    if isinstance(part, tuple | list):
        return joined([_as_text(each, "") for each in part], spec or "; ")
    if hasattr(part, "code"):
        return say(part)
    if isinstance(part, Amount):
        return language.with_unit(language.as_text(part.value, spec), part.unit)
    return language.as_text(excerpt(part) if isinstance(part, str) else part, spec)


def word(code: str, words: Mapping[Any, str], key: Any) -> str:
    """The word for a code out of a table of words marked with ``N_``; a key without one stays as it is."""
    return language.translated(code, words[key]) if key in words else key


def listed(findings: Iterable[AnyFinding]) -> list[str]:
    """Each finding's text."""
    return [say(finding) for finding in findings]


def say_all(findings: Iterable[AnyFinding]) -> str:
    """Findings, each a sentence, one after the other."""
    return joined(listed(findings), " ")


def bracketed(text: str, more: str) -> str:
    """A text, followed by something in brackets, such as a unit; the text alone where that is empty."""
    return sentence("bracketed", text=text, more=more) if more else text


def say_first(finding: Any) -> str:
    """A finding with the first of the reasons that it names, and of the bodies that touch the first and the deepest."""
    if reasons := getattr(finding, "reasons", ()):
        return say(
            finding.but(reasons=reasons[:1]) if isinstance(finding, Found) else replace(finding, reasons=reasons[:1])
        )
    if touches := getattr(finding, "touches", ()):
        deepest = max(touches, key=lambda each: each.depth_mm)
        return say(replace(finding, touches=tuple(dict.fromkeys((touches[0], deepest)))))
    return say(finding)


def joined(parts: Iterable[str], separator: Separator | str = "; ") -> str:
    """Texts as one: apart by ``"; "``, ``", "``, ``". "`` or ``" "`` (whole sentences); empty ones are left out."""
    kept = [text for text in parts if text]
    whole = kept[-1] if kept else ""
    for text in reversed(kept[:-1]):
        whole = sentence(f"joined#{separator}", first=text, rest=whole)
    return whole
