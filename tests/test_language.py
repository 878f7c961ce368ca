"""Texts in the reader's language."""

from __future__ import annotations

import gettext

import pytest

from er3a.pipeline import language
from er3a.pipeline.language import tr
from er3a.pipeline.messages import say as say_module
from er3a.pipeline.messages.say import joined, sentence, texts, word

GERMAN = {
    "off": "{angle} deg daneben: {joint}",
    "elbow": "Ellbogen",
    "; ": " | ",
    "{count} faults": "{count} Fehler",
    "f": "[{sure:!}vielleicht ]{names}: {size} mm[ ({why})]",
}


class German(gettext.NullTranslations):
    def gettext(self, message: str) -> str:
        return GERMAN.get(message, message)

    def pgettext(self, context: str, message: str) -> str:
        return self.gettext(message)


@pytest.fixture
def german(monkeypatch):
    monkeypatch.setattr(language, "_catalogue", German())


@pytest.fixture
def made(monkeypatch):
    monkeypatch.setattr(say_module, "_texts", dict(say_module._texts))
    texts(
        {
            "off": "the {joint} is {angle:.1f} deg off",
            "f": "[{sure:!}maybe ]{names:2, } by {size:.2f} mm[ ({why})]",
        }
    )


def test_a_translation_is_filled_in_with_the_formats_of_the_english_text(german, made):
    off = sentence("off", joint=word("joint", {"j3": "elbow"}, "j3"), angle=2.04)
    assert off == "2.0 deg daneben: Ellbogen"
    assert joined([off, "", "x"]) == "2.0 deg daneben: Ellbogen | x"


def test_a_part_in_brackets_is_there_only_with_what_it_names(german, made):
    names, parts = ("a", "b", "c"), {"size": 0.5, "sure": False, "why": ""}
    assert sentence("f", names=names, **parts) == "vielleicht a, b, 1 more: 0.50 mm"
    assert sentence("f", names=names[:1], **parts | {"sure": True, "why": "d"}) == "a: 0.50 mm (d)"
    assert sentence("f", names=names[:1], **parts | {"why": None}) == "vielleicht a: 0.50 mm"


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
