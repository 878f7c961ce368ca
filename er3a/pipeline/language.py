"""Texts in the reader's language, through gettext catalogues.

What a page says itself is written in English where it stands and goes through :func:`tr`; what was found is a finding,
of which :mod:`er3a.pipeline.messages.say` makes a text. Catalogues hold the former by the English text, the latter by
its key.
"""

from __future__ import annotations

import gettext
import io
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from numbers import Real
from pathlib import Path
from string import Formatter
from typing import Any, Literal, TypeVar, get_args

LanguageCode = Literal["en", "zh"]
LANGUAGES = get_args(LanguageCode)  # English and those that have a catalogue
MOST_DECIMALS = 9  # of numbers that have to be shown as different
TableT = TypeVar("TableT")
KEYED = "key"  # the context of texts whose key, not whose English, is their entry in a catalogue
TITLE = "title"  # the context of titles and notes that er3a writes into files
CATALOGUES = Path(__file__).with_name("messages") / "locale"

_catalogue: gettext.NullTranslations = gettext.NullTranslations()
_language = "en"
_own: Mapping[str, str] = {}


class _AsIs(Formatter):
    """Fills in what is formatted already."""

    def format_field(self, value: Any, format_spec: str) -> Any:
        """A part of a text as it is, since it was written with its format before.

        Parameters
        ----------
        value : the part's text
        format_spec : of the translation, which has none
        """
        return value


def N_(text: str) -> str:
    """Mark a text for the catalogues without translating it yet: words in a table of constants.

    Parameters
    ----------
    text : in English; :func:`tr` translates it where it is shown

    Returns
    -------
    text : unchanged
    """
    return text


def words(table: TableT) -> TableT:
    """Mark the values of a table of words for the catalogues, as :func:`N_` marks one.

    Parameters
    ----------
    table : a literal: texts by code, or tables and tuples of these

    Returns
    -------
    table : unchanged
    """
    return table


def terms(table: Mapping[str, str]) -> Mapping[str, str]:
    """Mark both the keys and the values of a table for the catalogues.

    Parameters
    ----------
    table : a literal

    Returns
    -------
    table : unchanged
    """
    return table


def written_title(text: str) -> str:
    """Mark a title or note that er3a writes into a file, in English.

    Parameters
    ----------
    text : pages show it by :func:`own_title`

    Returns
    -------
    text : unchanged
    """
    return text


# Those that are not the same in every language.
UNITS = (N_("deg (mm of a prismatic joint)"),)


def use(language: str, own: Mapping[str, str] | None = None) -> None:
    """Set the language of texts for this process.

    Parameters
    ----------
    language : one of ``LANGUAGES``
    own : people's titles and notes in that language, by the text that they translate
    """
    global _catalogue, _language, _own
    _language, _own = language, own or {}
    _catalogue = gettext.NullTranslations() if language == "en" else _load(catalogue_file(language))


@contextmanager
def using(language: str) -> Iterator[None]:
    """Texts in a language for as long as a block runs; then in the language before.

    Parameters
    ----------
    language : one of ``LANGUAGES``; within the block people's own titles are not translated
    """
    global _catalogue, _language, _own
    kept = _catalogue, _language, _own
    use(language)
    try:
        yield
    finally:
        _catalogue, _language, _own = kept


def current() -> str:
    """The language in use."""
    return _language


def catalogue_file(language: str) -> Path:
    """The catalogue of a language other than English.

    Parameters
    ----------
    language : one of ``LANGUAGES``

    Returns
    -------
    path : of the gettext catalogue (``.po``)
    """
    return CATALOGUES / language / "LC_MESSAGES" / "er3a.po"


def translations() -> gettext.NullTranslations:
    """The catalogue in use, for templates."""
    return _catalogue


def tr(text: str, /, **parts: Any) -> str:
    """A text in the language in use.

    Parameters
    ----------
    text : in English, with fields as ``str.format`` has them
    parts : values of the fields; numbers are written as :func:`as_number` writes them

    Returns
    -------
    text : in English where the catalogue has no translation
    """
    found = _catalogue.gettext(text) if text else text
    return filled(found, text, parts) if parts else found


def filled(text: str, template: str, parts: Mapping[str, Any], written: Callable[[Any, str], str] | None = None) -> str:
    """A translation of a template, its fields filled in with the formats of the template: translations have none.

    Parameters
    ----------
    text : the translation, such as ``{distance} 毫米``
    template : in English, such as ``{distance:.1f} mm``
    parts : values by field
    written : makes the text of a value by its format; :func:`as_text` by default
    """
    formats = {name: spec or "" for _, name, spec, _ in Formatter().parse(template) if name}
    write = written or as_text
    return _AsIs().format(text, **{name: write(parts[name], spec) for name, spec in formats.items()})


def as_text(part: Any, spec: str = "") -> str:
    """A part of a text; a number as :func:`as_number` writes it.

    Parameters
    ----------
    part : of any type
    spec : its format, as of ``format``
    """
    text = format(part, spec)
    if not isinstance(part, Real):
        return text
    return as_number(text if re.search("[1-9n]", text) else text.replace("-", ""))


def as_number(text: str) -> str:
    """A number's text as pages print it.

    Parameters
    ----------
    text : with a decimal point and a hyphen as minus sign

    Returns
    -------
    text : with narrow spaces between thousands from five digits on, and a true minus sign
    """
    whole, point, rest = text.partition(".")
    digits = whole.lstrip("+-")
    if digits.isdecimal() and len(digits) > 4:
        whole = whole.removesuffix(digits) + f"{int(digits):,}".replace(",", "\u202f")
    return (whole + point + rest).replace("-", "−")


def alike(values: Iterable[float], most: int = 3) -> list[str]:
    """Numbers with equally many decimals: as few as show each of them to ``most``.

    Parameters
    ----------
    values : in one unit
    most : decimals that any of them can need

    Returns
    -------
    texts : trailing zeros stay where another number needs the digit
    """
    exact = [f"{value:.{most}f}" for value in values]
    decimals = max((len(text.rstrip("0").partition(".")[2]) for text in exact), default=0)
    return [as_text(float(text) + 0.0, f".{decimals}f") for text in exact]


def distinct(values: Iterable[float], decimals: int = 1) -> list[str]:
    """Numbers with equally many decimals: as few as show different ones as different.

    Parameters
    ----------
    values : in one unit
    decimals : to begin with; there are ``MOST_DECIMALS`` at most
    """
    given = list(values)
    while decimals < MOST_DECIMALS and len({f"{value:.{decimals}f}" for value in given}) < len(set(given)):
        decimals += 1
    return [as_text(value, f".{decimals}f") for value in given]


def with_unit(value: str, unit: str, gap: str = " ") -> str:
    """A value with its unit as the language in use writes it.

    Parameters
    ----------
    value : as text
    unit : in English; empty for none
    gap : between both; there is none before °
    """
    shown = unit_sign(unit)
    return value + ("" if shown.startswith("°") else gap) + shown if shown else value


def unit_sign(unit: str) -> str:
    """A unit as pages and the command line print it: deg as °.

    Parameters
    ----------
    unit : as results name it
    """
    return tr(unit).replace("deg", "°")


def own_title(text: str) -> str:
    """A title or note out of a file in the language in use.

    Parameters
    ----------
    text : as the file has it

    Returns
    -------
    text : the file's own translation, or the catalogue's for titles that er3a wrote; else unchanged
    """
    return _own[text] if text in _own else _catalogue.pgettext(TITLE, text)


def translated(context: str, text: str) -> str:
    """A text in the language in use, looked up with its context.

    Parameters
    ----------
    context : of gettext, which separates texts that are alike in English only
    text : in English; looked up without context where the catalogue has none with it
    """
    found = _catalogue.pgettext(context, text)
    return found if found != text else _catalogue.gettext(text)


def by_key(key: str, english: str) -> str:
    """A text in the language in use, looked up by its key.

    Parameters
    ----------
    key : under which the catalogue has it
    english : returned where the catalogue has none
    """
    found = _catalogue.pgettext(KEYED, key)
    return english if found == key else found


def _load(file: Path) -> gettext.NullTranslations:
    from babel.messages.mofile import write_mo
    from babel.messages.pofile import read_po

    compiled = io.BytesIO()
    with file.open("rb") as source:
        write_mo(compiled, read_po(source))
    compiled.seek(0)
    return gettext.GNUTranslations(compiled)


def first_sentence(text: str) -> tuple[str, str]:
    """A text up to the end of its first sentence, and the rest.

    Parameters
    ----------
    text : in English or Chinese

    Returns
    -------
    first, rest : the rest is empty for a single sentence
    """
    end = re.search(r"\.(?= )|。", text)
    return (text[: end.end()], text[end.end() :].strip()) if end else (text, "")
