"""Titles that people wrote in their files are shown in the page's language where the file says them in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from er3a.files.annotations import translations_in
from er3a.pipeline.messages import language
from er3a.pipeline.study import load_study

ROOT = Path(__file__).resolve().parents[1]


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
