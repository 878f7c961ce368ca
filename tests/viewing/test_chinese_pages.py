"""A Chinese page reads as Chinese writes: full-width marks without blanks behind them, °, and no English in between."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from er3a.pipeline import language
from er3a.pipeline.stages.run import show
from er3a.pipeline.study import load_study
from er3a.pipeline.viewing.page import closed_up
from testing.small_study import stages_of
from tests.viewing.untranslated import PageTexts

HAN = "[\u4e00-\u9fff]"
MARKS = re.compile(rf"{HAN} ?[,;:!?]|(?<=.)[,;:!?] ?{HAN}|{HAN}\.(?: |$)|[，。；：！？、] \S")
BRACKETS = re.compile(rf"{HAN} ?\((?![^)]*, )[^)]*{HAN}|{HAN} ?\((?:mm|s|°|L|kg)\)")  # those of coordinates stay
UNITS = re.compile(r"\bdeg\b|\d °")
WORDS = re.compile(r"(?:\b[A-Za-z][a-z]{2,} ){2,}[a-z]{2,}\b")


@pytest.fixture
def chinese(small_study, monkeypatch):
    """The small study with Chinese pages."""
    monkeypatch.chdir(small_study.folder)
    study = load_study("config/small.yaml")
    study = study.model_copy(update={"report": study.report.model_copy(update={"language": "zh"})})
    with language.using("zh"):
        language.use("zh", study.own_titles())
        yield study


KINDS = [(stage, "er3a_c60") for stage in stages_of("er3a_c60")] + [("validation", "er3a_c60_article")]


@pytest.mark.filterwarnings("ignore:Glyph")
@pytest.mark.parametrize(("stage", "name"), KINDS)
def test_a_page_has_chinese_marks_and_units(stage, name, chinese, tmp_path):
    page = tmp_path / "page.html"
    show("report", stage, chinese, name, Path("results") / name / stage, page)
    assert '<html lang="zh-CN"' in page.read_text(encoding="utf-8")
    texts = [" ".join(text.split()) for text in PageTexts(page.read_text(encoding="utf-8")).texts]
    for wrong in (MARKS, BRACKETS, UNITS, WORDS):
        assert [text for text in texts if wrong.search(text)] == []


def test_blanks_that_chinese_does_not_write_are_left_out():
    assert (
        closed_up("<p>第一句。 <b>第二句</b>， x\n与 连杆 2，转 90 °。</p>")
        == "<p>第一句。<b>第二句</b>，x\n与连杆 2，转 90°。</p>"
    )
