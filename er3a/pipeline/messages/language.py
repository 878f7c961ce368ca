"""Texts in the reader's language, through gettext catalogues.

Texts are written in English in the code. What a page says itself goes through :func:`tr`; what was found is a finding,
of which :mod:`er3a.pipeline.messages.say` makes a text.
"""

from __future__ import annotations

import gettext
import io
from pathlib import Path
from typing import Any

LANGUAGES = ("en", "zh")
CATALOGUES = Path(__file__).with_name("locale")

_catalogue: gettext.NullTranslations = gettext.NullTranslations()
_language = "en"


def N_(text: str) -> str:
    """Mark a text for the catalogues without translating it yet: words in a table of constants."""
    return text


def use(language: str) -> None:
    """Set the language of texts for this process: one of ``LANGUAGES``."""
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
    """A text in the language in use, its fields filled in as ``str.format`` does."""
    translated_text = _catalogue.gettext(text) if text else text
    return translated_text.format(**parts) if parts else translated_text


def translated(context: str, text: str) -> str:
    """A text in the language in use, looked up with its context, and without it where the catalogue has none."""
    found = _catalogue.pgettext(context, text)
    return found if found != text else _catalogue.gettext(text)


def translated_count(context: str, one: str, many: str, count: int) -> str:
    """The form of a text that fits a number."""
    found = _catalogue.npgettext(context, one, many, count)
    return found if found not in (one, many) else _catalogue.ngettext(one, many, count)


def _load(file: Path) -> gettext.NullTranslations:
    from babel.messages.mofile import write_mo
    from babel.messages.pofile import read_po

    compiled = io.BytesIO()
    with file.open("rb") as source:
        write_mo(compiled, read_po(source))
    compiled.seek(0)
    return gettext.GNUTranslations(compiled)
