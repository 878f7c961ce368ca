"""Texts in the reader's language: composed, kept with results, said again."""

from __future__ import annotations

import gettext

import pytest

from er3a.pipeline.messages import language
from er3a.pipeline.messages.language import joined, keeps_sentences, know, note_written, said, sentences, tr

GERMAN = {
    "the {joint} is {angle:.1f} deg off": "{angle} deg daneben: {joint}",
    "elbow": "Ellbogen",
    "{first}; {rest}": "{first} | {rest}",
    "{count} faults": "{count} Fehler",
}


class German(gettext.NullTranslations):
    def gettext(self, message: str) -> str:
        return GERMAN.get(message, message)


@pytest.fixture
def german(monkeypatch):
    monkeypatch.setattr(language, "_catalogue", German())
    monkeypatch.setattr(language, "_read", {})


@keeps_sentences
def finding() -> tuple[str, dict]:
    said("{count} faults", count=9)  # never written
    text = joined([said("the {joint} is {angle:.1f} deg off", joint="elbow", angle=2.04), "", "x"])
    note_written({"a": [text, 3]})
    return text, sentences()


def test_a_finding_is_english_and_can_be_said_again(german):
    text, kept = finding()
    assert text == "the elbow is 2.0 deg off; x"
    assert tr(text) == text
    know(kept)
    assert tr(text) == "2.0 deg daneben: Ellbogen | x"
    assert "9 faults" not in kept


def test_names_from_input_files_are_no_words(german):
    assert tr("{own_name}: {joint}", own_name="elbow", joint="elbow") == "elbow: Ellbogen"


def test_equal_findings_are_kept_alike_whatever_was_found_before():
    assert finding() == finding()
    note_written("the elbow is 2.0 deg off; x")
    assert sentences() == {}


def test_words_numbers_and_names(german):
    assert tr("elbow") == "Ellbogen"
    assert tr("EFORT {") == "EFORT {"
    assert tr("") == ""
    assert tr("{count} faults", count=3) == "3 Fehler"
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
