"""Texts in the reader's language."""

from __future__ import annotations

import gettext

import pytest

from er3a.pipeline import language
from er3a.pipeline.language import tr
from er3a.pipeline.messages import say as say_module
from er3a.pipeline.messages.say import Plural, joined, sentence, texts, word

GERMAN = {
    "off": "{angle} deg daneben: {joint}",
    "elbow": "Ellbogen",
    "joined#; ": "{first} | {rest}",
    "{count} faults": "{count} Fehler",
    "f": "{count} Fehler von {size} mm",
}


class German(gettext.NullTranslations):
    def gettext(self, message: str) -> str:
        return GERMAN.get(message, message)

    def ngettext(self, msgid1: str, msgid2: str, n: int) -> str:
        return GERMAN[msgid1 if n == 1 else msgid2]

    def pgettext(self, context: str, message: str) -> str:
        return self.gettext(message)

    def npgettext(self, context: str, msgid1: str, msgid2: str, n: int) -> str:
        return self.ngettext(msgid1, msgid2, n)


@pytest.fixture
def german(monkeypatch):
    monkeypatch.setattr(language, "_catalogue", German())


@pytest.fixture
def made(monkeypatch):
    monkeypatch.setattr(say_module, "_texts", dict(say_module._texts))
    texts(
        {
            "off": "the {joint} is {angle:.1f} deg off",
            "f": Plural("count", "{count} fault of {size:.2f} mm", "{count} faults of {size:.2f} mm"),
        }
    )


def test_a_translation_is_filled_in_with_the_formats_of_the_english_text(german, made):
    off = sentence("off", joint=word("joint", {"j3": "elbow"}, "j3"), angle=2.04)
    assert off == "2.0 deg daneben: Ellbogen"
    assert joined([off, "", "x"]) == "2.0 deg daneben: Ellbogen | x"
    for count in (1, 2):
        assert sentence("f", count=count, size=0.5) == f"{count} Fehler von 0.50 mm"


def test_parts_are_no_words(german):
    assert tr("{name}: {joint}", name="elbow", joint="elbow") == "elbow: elbow"


def test_words_numbers_and_names(german):
    assert tr("elbow") == "Ellbogen"
    assert tr("EFORT {") == "EFORT {"
    assert tr("") == ""
    assert tr("{count} faults", count=3) == "3 Fehler"
    assert word("joint", {"j3": "elbow"}, "j4") == "j4"
    assert joined([]) == ""
    assert joined(["one"]) == "one"


def test_chinese_is_read_from_its_catalogue():
    try:
        language.use("zh")
        assert language.current() == "zh"
        assert tr("All robots") == "所有机器人"
    finally:
        language.use("en")
    assert tr("All robots") == "All robots"


def test_numbers_in_sentences_have_a_minus_sign_and_names_keep_their_hyphens():
    text = language.filled("{name} at {at:.1f} deg, {rows:d} of {count}", "{name} at {at:.1f} deg, {rows:d} of {count}",
                           {"name": "er3-600", "at": -206.58, "rows": -3, "count": -4})  # fmt: skip
    assert text == "er3-600 at −206.6 deg, −3 of −4"


def test_different_numbers_are_shown_as_different():
    assert language.distinct([1.04, 2.0, 1.0]) == ["1.04", "2.00", "1.00"]
    assert language.distinct([-480.1, -480.1, 3.0]) == ["−480.1", "−480.1", "3.0"]
