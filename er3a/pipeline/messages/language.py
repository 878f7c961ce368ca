"""Texts in the reader's language, through gettext catalogues.

Texts are written in English in the code. What a page says itself goes through :func:`tr`. What a stage finds is written
to its results in English, composed with :func:`said`; how it was composed is kept in ``summary.json`` (``sentences``),
so that a page can say it in another language although the results know none.
"""

from __future__ import annotations

import gettext
import io
from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import wraps
from pathlib import Path
from string import Formatter
from typing import Any

LANGUAGES = ("en", "zh")
CATALOGUES = Path(__file__).with_name("locale")

Composed = tuple[str, dict[str, str]]
"""A template with named fields, and the texts that fill them."""


@dataclass
class _Findings:
    """What has been said since a stage began to compute, and which of it went into its results."""

    composed: dict[str, Composed] = field(default_factory=dict)
    written: set[str] = field(default_factory=set)


_findings: ContextVar[_Findings | None] = ContextVar("findings", default=None)
_read: dict[str, Composed] = {}
_catalogue: gettext.NullTranslations = gettext.NullTranslations()
_language = "en"


class _AsIs(Formatter):
    """Fills in texts that are formatted already."""

    def format_field(self, value: Any, format_spec: str) -> str:
        return value


def N_(text: str) -> str:
    """Mark a text for the catalogues without translating it yet: words in a table of constants."""
    return text


def said(template: str, /, **parts: Any) -> str:
    """A finding in English: ``template`` with its fields filled in as ``str.format`` does.

    Within a function that :func:`keeps_sentences`, how the text was composed is remembered. Parts may be findings
    themselves. Fields are plain names: ``{angle:.1f}``, not ``{joint.angle}``. A field whose name starts with ``own_``
    holds a name out of an input file: it is never taken for a word of ours.
    """
    text = template.format(**parts)
    findings = _findings.get()
    if findings is not None and parts:
        findings.composed.setdefault(text, (template, _filled(template, parts)))
    return text


def joined(texts: Iterable[str], separator: str = "; ") -> str:
    """Findings as one: apart by ``"; "``, ``", "`` or ``" "`` (whole sentences)."""
    texts = [text for text in texts if text]
    pair = {"; ": N_("{first}; {rest}"), ", ": N_("{first}, {rest}"), " ": N_("{first} {rest}")}[separator]
    if not texts:
        return ""
    whole = texts[-1]
    for text in reversed(texts[:-1]):
        whole = said(pair, first=text, rest=whole)
    return whole


def keeps_sentences(compute: Callable) -> Callable:
    """A function whose findings are remembered until it returns, for ``write_summary``."""

    @wraps(compute)
    def remembering(*arguments, **named):
        token = _findings.set(_Findings())
        try:
            return compute(*arguments, **named)
        finally:
            _findings.reset(token)

    return remembering


def note_written(data: Any) -> None:
    """Tell which texts are written to the results: all those in nested plain data."""
    findings = _findings.get()
    if findings is not None:
        findings.written.update(text for text in _texts(data) if text in findings.composed)


def sentences() -> dict[str, list]:
    """How the findings that were written were composed, and the findings they were composed of: plain data."""
    findings = _findings.get() or _Findings()
    found: dict[str, list] = {}
    todo = list(findings.written)
    while todo:
        text = todo.pop()
        if text not in found:
            template, parts = findings.composed[text]
            found[text] = [template, parts]
            todo += [part for part in parts.values() if part in findings.composed]
    return dict(sorted(found.items()))


def _texts(data: Any) -> Iterator[str]:
    if isinstance(data, str):
        yield data
    elif isinstance(data, dict):
        for value in data.values():
            yield from _texts(value)
    elif isinstance(data, (list, tuple)):
        for value in data:
            yield from _texts(value)


def know(sentences: dict[str, list]) -> None:
    """Take over what results say of how their findings were composed."""
    _read.update({text: (template, parts) for text, (template, parts) in sentences.items()})


def use(language: str) -> None:
    """Set the language of :func:`tr` for this process: one of ``LANGUAGES``."""
    global _catalogue, _language
    _language = language
    _catalogue = gettext.NullTranslations() if language == "en" else _load(catalogue_file(language))


def current() -> str:
    """The language in use."""
    return _language


def catalogue_file(language: str) -> Path:
    """The catalogue of a language other than English."""
    return CATALOGUES / language / "LC_MESSAGES" / "er3a.po"


def translations() -> gettext.NullTranslations:
    """The catalogue in use, for templates."""
    return _catalogue


def tr(text: str, /, **parts: Any) -> str:
    """A text in the language in use.

    Parameters
    ----------
    text : a template whose fields ``parts`` fill in; without parts a word of the code or a finding out of the results.
        A text that is neither (a name from an input file, a number) stays as it is.
    """
    if parts:
        return _compose(text, _filled(text, parts))
    if text in _read:
        return _compose(*_read[text])
    return _catalogue.gettext(text) if text else text


def translated(context: str, text: str) -> str:
    """A text in the language in use, looked up with its context, and without it where the catalogue has none."""
    found = _catalogue.pgettext(context, text)
    return found if found != text else _catalogue.gettext(text)


def translated_count(context: str, one: str, many: str, count: int) -> str:
    """The form of a text that fits a number."""
    found = _catalogue.npgettext(context, one, many, count)
    return found if found not in (one, many) else _catalogue.ngettext(one, many, count)


def _compose(template: str, parts: dict[str, str]) -> str:
    shown = {name: part if name.startswith("own_") else tr(part) for name, part in parts.items()}
    return _AsIs().format(_catalogue.gettext(template), **shown)


def _filled(template: str, parts: dict[str, Any]) -> dict[str, str]:
    """The parts as texts, each formatted as the template asks."""
    specs = {name: spec for _, name, spec, _ in Formatter().parse(template) if name}
    return {name: format(parts[name], spec) for name, spec in specs.items()}


def _load(file: Path) -> gettext.NullTranslations:
    from babel.messages.mofile import write_mo
    from babel.messages.pofile import read_po

    compiled = io.BytesIO()
    with file.open("rb") as source:
        write_mo(compiled, read_po(source))
    compiled.seek(0)
    return gettext.GNUTranslations(compiled)
