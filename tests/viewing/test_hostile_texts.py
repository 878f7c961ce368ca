"""Texts from input files in pages and recordings: shown as they are, never carried out, never fetched."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
import yaml

from er3a.errors import InputError
from er3a.finding import fact
from er3a.pipeline.overview.index import write_index
from er3a.pipeline.results import AbsentResults, Summary, Verdict, read_stage, write_checksums
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.run import show
from er3a.pipeline.study import load_study
from er3a.pipeline.tables import table_types
from er3a.pipeline.viewing.page import report_absent
from er3a.pipeline.viewing.recording import escaped

ROBOT = "er3_600"
HOSTILE = """ <script>alert("x")</script><img src=http://x/y onerror=alert(1)> $x^$ {{ 7*7 }} </style> ' " &amp;"""
FROM_FILES = ("title", "note", "source")
MARKS = "../marks.js"  # what the index leaves for the headers of a robot's pages
LOADED = {"src", "srcset", "data", "poster", "background", "action"}


class Tags(HTMLParser):
    """Counts of elements, and what a browser would load or carry out on account of their attributes."""

    def __init__(self, html: str):
        super().__init__()
        self.counts: dict[str, int] = {}
        self.loaded: list[str] = []
        self.handlers: list[str] = []
        self.feed(html)

    @property
    def from_elsewhere(self) -> list[str]:
        """What is loaded from outside of the page."""
        return [address for address in self.loaded if not address.startswith("data:")]

    def handle_starttag(self, tag, attrs):
        self.counts[tag] = self.counts.get(tag, 0) + 1
        self.handlers += [name for name, _ in attrs if name.startswith("on")]
        self.loaded += [value for name, value in attrs if name in LOADED or (tag == "link" and name == "href")]


@pytest.fixture(scope="module")
def hostile(small_study, tmp_path_factory):
    """The small study's results with hostile texts in them, and a study whose robot has them in its file."""
    folder = tmp_path_factory.mktemp("hostile")
    shutil.copytree(small_study.folder / "results" / ROBOT, folder / "results" / ROBOT)
    robot = yaml.safe_load((small_study.folder / f"data/robots/{ROBOT}.yaml").read_text(encoding="utf-8"))
    robot |= {"title": "Arm" + HOSTILE, "zero_pose": HOSTILE}
    for group in ("dh", "zero", "limits", "speeds"):
        robot[group]["source"] = HOSTILE
    (folder / f"{ROBOT}.yaml").write_text(yaml.safe_dump(robot), encoding="utf-8")
    study = yaml.safe_load((small_study.folder / "config/small.yaml").read_text(encoding="utf-8"))
    study["robots"][ROBOT]["file"] = str(folder / f"{ROBOT}.yaml")
    (folder / "study.yaml").write_text(yaml.safe_dump(study), encoding="utf-8")
    for name, stage in STAGES.items():
        results = folder / "results" / ROBOT / name
        summary = results / "summary.json"
        summary.write_text(json.dumps(_with_hostile(json.loads(summary.read_text()))), encoding="utf-8")
        for table, kind in table_types(stage.module("model").RESULTS).items():
            file = results / f"{table}.parquet"
            _with_hostile_columns(kind.read(file.read_bytes())).write(file)
        write_checksums(results)
    return load_study(folder / "study.yaml"), folder


def _with_hostile(value):
    if isinstance(value, dict):
        return {
            key: part + HOSTILE if key in FROM_FILES and isinstance(part, str) else _with_hostile(part)
            for key, part in value.items()
        }
    return [_with_hostile(part) for part in value] if isinstance(value, list) else value


def _with_hostile_columns(rows):
    names = [name for name, spec in rows.columns().items() if name in FROM_FILES and not spec.coded]
    columns = {name: [text and text + HOSTILE for text in getattr(rows, name)] for name in names}
    return replace(rows, **{name: np.array(texts, object) for name, texts in columns.items()})


@pytest.mark.parametrize("stage", STAGES)
def test_a_page_shows_hostile_texts_and_does_not_act_on_them(hostile, small_study, stage, tmp_path):
    study, folder = hostile
    page, finished = tmp_path / f"{stage}.html", small_study.folder / f"reports/{ROBOT}/{stage}.html"
    shutil.copy(finished.with_suffix(".webp"), tmp_path)
    show("report", stage, study, ROBOT, folder / "results" / ROBOT / stage, page)
    html = page.read_text(encoding="utf-8")
    found = Tags(html)
    usual = Tags(finished.read_text(encoding="utf-8"))
    assert found.counts == usual.counts
    assert found.handlers == usual.handlers
    assert found.from_elsewhere == [MARKS]
    assert "&lt;script&gt;alert(" in html
    assert "{{ 7*7 }}" in html


def test_the_page_of_a_stage_that_was_not_computed_does_not_act_on_its_reason(hostile, tmp_path):
    study, folder = hostile
    stored = read_stage(folder / "results" / ROBOT / "inverse", STAGES["inverse"])
    absent = AbsentResults(Summary(Verdict("not_computed", fact("stage.not_computed", reason=HOSTILE)), ()))
    report_absent(study, replace(stored, results=absent), tmp_path / "inverse.html")
    html = (tmp_path / "inverse.html").read_text(encoding="utf-8")
    found = Tags(html)
    assert found.handlers == []
    assert found.from_elsewhere == [MARKS]
    assert "&lt;script&gt;alert(" in html
    assert "<script>alert(" not in html


def test_the_page_over_all_robots_does_neither(hostile, small_study, tmp_path):
    study, folder = hostile
    write_index(study, folder / "results", tmp_path)
    html = (tmp_path / "index.html").read_text(encoding="utf-8")
    found, usual = Tags(html), Tags((small_study.folder / "reports/index.html").read_text(encoding="utf-8"))
    assert found.counts["script"] == usual.counts["script"]
    assert found.handlers == []
    assert found.from_elsewhere == ["marks.js"]
    assert "&lt;script&gt;alert(" in html


def test_no_page_names_anything_else_to_load(small_study):
    reports = small_study.folder / "reports"
    for page in reports.rglob("*.html"):
        html = page.read_text(encoding="utf-8")
        assert Tags(html).from_elsewhere == ["marks.js" if page.parent == reports else MARKS], page
        styles = "".join(re.findall(r"<style>(.*?)</style>", html, flags=re.DOTALL))
        assert not re.search(r"@import|url\(\s*['\"]?(?!data:)", styles), page


def test_markdown_in_a_text_is_shown_as_it_is_written():
    assert escaped("![x](http://x/y.png)\n# a_b") == r"\!\[x\](http://x/y.png) \# a\_b"


@pytest.mark.parametrize(
    "name", ["../x", "..", "a/b", "a\\b", "a\0b", "x" * 65, "", "Ä", "a b", "-x", "<b>", "A", "x\n"]
)
def test_a_name_that_would_become_part_of_a_path_is_refused(small_study, tmp_path, name):
    study = yaml.safe_load((small_study.folder / "config/small.yaml").read_text(encoding="utf-8"))
    study["robots"] = {name: study["robots"][ROBOT]}
    (tmp_path / "study.yaml").write_text(yaml.safe_dump(study), encoding="utf-8")
    with pytest.raises(InputError, match=r"study\.yaml: .*refused"):
        load_study(tmp_path / "study.yaml")
