"""Titles that people wrote in their files are shown in the page's language where the file says them in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from er3a.errors import InputError
from er3a.files.annotations import translations_in
from er3a.pipeline import language
from er3a.pipeline.study import load_study
from tests.viewing.untranslated import texts_from_files

ROOT = Path(__file__).resolve().parents[1]
SETS = ("er3_600", "er3a_c60", "er3a_c60_article")


def test_titles_and_notes_at_any_depth_are_found_with_their_translations(tmp_path):
    file = tmp_path / "paths.yaml"
    file.write_text("title: Seam\ntitle_zh: 焊缝\npaths:\n  - {note: Up, note_zh: 上}\n  - {title: Down}\n", "utf-8")
    assert translations_in([file, tmp_path / "table.csv"], "zh") == {"Seam": "焊缝", "Up": "上"}
    assert translations_in([file], "en") == {}


def test_a_study_s_own_titles_are_shown_in_its_language(monkeypatch):
    monkeypatch.chdir(ROOT)
    study = load_study("config/small.yaml")
    chinese = study.model_copy(update={"report": study.report.model_copy(update={"language": "zh"})})
    own = chinese.own_titles()
    try:
        language.use("zh", own)
        assert language.own_title("Table and post") == "工作台与立柱"
        assert language.own_title("no title of ours") == "no title of ours"
        assert "EFORT ER3-600" not in own
    finally:
        language.use("en")
    assert study.own_titles() == {}


@pytest.mark.parametrize("kind", ["robots", "paths", "scenes", "targets"])
def test_shipped_files_of_each_kind_may_say_titles_in_chinese(kind):
    assert translations_in(sorted((ROOT / "data" / kind).glob("*.yaml")), "zh")


def test_other_texts_are_translated_by_a_catalogue_beside_the_file(tmp_path):
    (tmp_path / "zh.po").write_text('msgid "zero pose"\nmsgstr "零位"\n\nmsgid "home"\nmsgstr ""\n', "utf-8")
    assert translations_in([tmp_path / "positions.csv"], "zh") == {"zero pose": "零位"}


def test_a_catalogue_that_is_none_is_refused_with_its_name(tmp_path):
    (tmp_path / "zh.po").write_text("zero pose: 零位\n", "utf-8")
    with pytest.raises(InputError, match=r"zh\.po: not a gettext catalogue"):
        translations_in([tmp_path / "positions.csv"], "zh")


@pytest.mark.parametrize(
    "folder", ["robots", "scenes", "programs", "vision", *(f"manual_refs/{name}" for name in SETS)]
)
def test_each_entry_of_a_shipped_catalogue_translates_a_text_of_its_folder(folder):
    catalogue = translations_in([ROOT / "data" / folder / "none.csv"], "zh")
    assert catalogue
    assert set(catalogue) - texts_from_files(ROOT / "data" / folder) == set()
