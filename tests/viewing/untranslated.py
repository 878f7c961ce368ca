"""Finds words in views that no catalogue has: every text that goes through one is written in wide letters, and words in
plain letters that are left come from elsewhere."""

from __future__ import annotations

import csv
import gettext
import json
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib.text
import pytest
import yaml
from babel.messages.pofile import read_po
from matplotlib.backends.backend_svg import FigureCanvasSVG

from er3a.pipeline import language
from er3a.pipeline.messages.say import english
from er3a.programs.languages import LANGUAGES, SUFFIXES

KEPT = re.compile(r"(\{[^}]*\}|%\(\w+\)s|<[^>]*>|&\w+;)")
WIDE = {ord(letter): ord(letter) + 0xFEE0 for letter in "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"}
WORD = re.compile(r"[A-Za-z]{3,}")
# Units, and names that are the same in every language.
SAME_EVERYWHERE = {"deg", "rad", "er3a", "sha", "rrd", "rpm", *LANGUAGES}
PROGRAM_SUFFIXES = ("csv", "dat", "var", "XPL", *(suffix[1:] for suffix in SUFFIXES))
NAMES = re.compile(
    r"\b(?:alpha|beta|offset|direction|lower|upper|speed) ?\d(?:, \d)*\b"  # entries of a table
    r"|\bT_[a-z]+_[a-z]+\b"  # transforms
    rf"|\b[\w-]+\.(?:{'|'.join(PROGRAM_SUFFIXES)})\b|\b[A-Z_]{{4,}}\[\d+\]"  # files and frames of programs
)
SPOKEN = {"alt", "aria-label", "title", "placeholder", "data-differs"}


class Wide(gettext.NullTranslations):
    """A catalogue whose language is English in wide letters."""

    def __init__(self, texts: set[str]):
        super().__init__()
        self._texts = texts

    def gettext(self, message: str) -> str:
        """The message in wide letters if the catalogue has it; fields and tags as they are."""
        if message not in self._texts:
            return message
        return _wide(message)

    def pgettext(self, context: str, message: str) -> str:
        """As :meth:`gettext`; the English of a key."""
        if context != language.KEYED or message not in self._texts:
            return self.gettext(message)
        return _wide(english(message))

    def ngettext(self, msgid1: str, msgid2: str, n: int) -> str:
        """As :meth:`gettext`, of the form for n."""
        return self.gettext(msgid1 if n == 1 else msgid2)


def _wide(text: str) -> str:
    return "".join(part if KEPT.fullmatch(part) else part.translate(WIDE) for part in KEPT.split(text))


def catalogue_texts() -> set[str]:
    """All texts that the Chinese catalogue has an entry for."""
    with language.catalogue_file("zh").open("rb") as file:
        entries = [entry.id for entry in read_po(file) if entry.id]
    return {text for entry in entries for text in ([entry] if isinstance(entry, str) else entry)}


@contextmanager
def wide_letters() -> Iterator[list[str]]:
    """Views written in here are in wide letters; the list collects the texts of their figures, which are not drawn."""
    shown: list[str] = []

    def saved(canvas, *_, **__):
        shown.extend(text.get_text() for text in canvas.figure.findobj(matplotlib.text.Text) if text.get_visible())

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(language, "_catalogue", Wide(catalogue_texts()))
        patch.setattr(language, "_language", "zh")
        patch.setattr(FigureCanvasSVG, "print_svg", saved)
        yield shown


def plain_words(texts: Iterable[str], own_texts: set[str]) -> list[str]:
    """Texts with words in plain letters that do not come from the study's own files."""
    own = sorted(own_texts, key=len, reverse=True)
    found = []
    for text in texts:
        rest = NAMES.sub(" ", text.replace("−", "-"))
        for piece in own:
            rest = rest.replace(piece, " ")
        rest = re.sub(r"\$[^$]*\$|\\\w+", " ", rest)  # formulas
        if any(word.lower() not in SAME_EVERYWHERE for word in WORD.findall(rest)):
            found.append(" ".join(text.split()))
    return list(dict.fromkeys(found))


def texts_from_files(folder: Path) -> set[str]:
    """All texts that people wrote into the input files below a folder, and the titles before a colon in them."""
    found: set[str] = set()
    for file in folder.rglob("*.yaml"):
        found.update(_leaves(yaml.safe_load(file.read_text(encoding="utf-8")), keys=True))
    for file in folder.rglob("*.csv"):
        with file.open(encoding="utf-8", newline="") as lines:
            found.update(cell for row in csv.reader(lines) for cell in row)
    for suffix in PROGRAM_SUFFIXES:
        for file in folder.rglob(f"*.{suffix}"):
            found.update(line.strip().removesuffix(":") for line in file.read_text("utf-8", "replace").splitlines())
    found.update([text.split(":")[0] for text in found])
    return {text for text in found if WORD.search(text)}


class PageTexts(HTMLParser):
    """What a page says: its text and spoken attributes, without styles, scripts and code."""

    def __init__(self, html: str):
        super().__init__()
        self.texts: list[str] = []
        self._silent: list[str] = []
        self._breakable = False  # the word goes on behind a place where a line may end
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self._breakable = tag == "wbr"
        if tag in ("style", "script", "code"):
            self._silent.append(tag)
            self._words = dict(attrs).get("type") == "application/json"
        self.texts += [value for name, value in attrs if name in SPOKEN and value]

    def handle_endtag(self, tag):
        if self._silent and self._silent[-1] == tag:
            self._silent.pop()

    def handle_data(self, data):
        if not self._silent:
            self.texts[-1:] = [self.texts[-1] + data] if self._breakable else [*self.texts[-1:], data]
        elif self._silent[-1] == "script" and self._words:
            self.texts += _words_of(json.loads(data))


def _words_of(data: Any) -> list[str]:
    """Texts that a page hands to its scripts: names of what a figure in space shows, all below a key ``words`` (fields
    left out), or all if there are no further levels."""
    if not isinstance(data, dict):
        return []
    if "layers" in data:
        return [layer["name"] for layer in data["layers"]]
    if "words" in data:
        return [re.sub(r"\{\w+\}", " ", text) for text in _leaves(data["words"], keys=False)]
    texts = data.values() if all(isinstance(value, str) for value in data.values()) else []
    return [re.sub(r"\{\w+\}", " ", text) for text in texts]


def _leaves(data: Any, keys: bool) -> Iterator[str]:
    if isinstance(data, str):
        yield data
    elif isinstance(data, dict):
        for key, value in data.items():
            if keys:
                yield str(key)
            yield from _leaves(value, keys)
    elif isinstance(data, list):
        for value in data:
            yield from _leaves(value, keys)
