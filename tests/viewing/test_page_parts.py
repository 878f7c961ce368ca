"""What all pages share: addresses of figures and tables that stay, words that lead on, and the table to use instead."""

from __future__ import annotations

import json
import re
from types import SimpleNamespace

import pytest

from er3a.identifiability.entry_evidence import EntryEvidence
from er3a.pipeline.messages.pages import Caveat
from er3a.pipeline.overview.index import write_index
from er3a.pipeline.overview.search import TextOfPage
from er3a.pipeline.results import read_stage
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.validation.page.evidence_section import LOOKS, rounded_within
from er3a.pipeline.study import load_study
from er3a.pipeline.viewing.page import Head, Numbering
from tests.conftest import ROOT

CALL = re.compile(r"ui\.(picture|table)\((.*)\) \}\}")


def test_addresses_are_of_names_and_unique():
    numbered = Numbering()
    marks = [numbered("figure", name) for name in ("reach", "", "reach", "Wall & floor")]
    assert [mark.id for mark in marks] == ["figure-reach", "figure-2", "figure-reach-2", "figure-Wall-floor"]
    assert [mark.text for mark in marks] == ["Figure 1", "Figure 2", "Figure 3", "Figure 4"]


def test_each_figure_and_table_of_a_template_has_a_name():
    for file in sorted((ROOT / "er3a/pipeline").rglob("*.j2")):
        for kind, arguments in CALL.findall(file.read_text(encoding="utf-8")):
            named = "name=" in arguments if kind == "table" else "," in arguments
            assert named, f"{file.name}: {arguments}"


@pytest.mark.parametrize(
    ("value", "interval", "shown"), [(269.999, (269.9, 270.1), 270), (321.48, (321.45, 321.55), 321.5)]
)
def test_a_value_is_rounded_as_far_as_documents_leave_open(value, interval, shown):
    entry = EntryEvidence("a2", 650.0, "mm", "contradicted", interval, (), (), "article")
    assert rounded_within(value, entry) == shown


def test_the_index_marks_each_entry_of_a_wrong_table_as_validation_found_it(small_results, tmp_path):
    """By the summary alone: class, value where its source states one, and what the evidence gives instead."""
    study, name = load_study("config/small.yaml"), "er3a_c60_article"
    for robot in study.robots:
        (tmp_path / robot).mkdir()
        (tmp_path / robot / "validation").symlink_to(small_results("validation", robot, study).resolve())
    write_index(study, tmp_path, tmp_path)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    evidence = read_stage(tmp_path / name / "validation", STAGES["validation"]).results.summary.evidence
    stated = [each for each in evidence.entries if each.value is not None]
    for entry in stated:
        link = re.escape(f'href="{name}/validation.html#cell-{entry.entry}"')
        look, shown = re.search(rf'<td class="(\w+)" title="[^"]*"><a {link}[^>]*>(.*?)</a></td>', page).groups()
        assert look == LOOKS[entry.trust], entry
        if look != "wrong":
            assert "→" not in shown
            continue
        assert ("?" in shown) == (len(entry.by) == 1), entry  # one document alone gives what to enter instead
        value, given = re.search(r"<s>(.*?)</s> <b><i>→</i>([-.\d]+)", shown.replace("−", "-")).groups()
        assert float(value) == round(entry.value, 3), entry
        assert entry.interval[0] <= float(given) <= entry.interval[1], entry
    assert any("direction" in each.entry and each.status == "contradicted" for each in stated)
    wrong = sum(each.status == "contradicted" for each in stated)
    alone = sum(each.status != "gauge" for each in stated)
    assert f"{wrong} of {alone} contradicted" in page
    marks = json.loads((tmp_path / "marks.js").read_text().split(" = ")[1].split(";\n")[0])
    assert marks[name]["validation"] == "fail"


@pytest.mark.parametrize(
    ("status", "foundation", "sign"),
    [
        ("pass", "pass", "pass"),
        ("pass", "caution", "pass"),
        ("pass", "unsettled", "caution"),
        ("caution", "pass", "caution"),
        ("pass", "fail", "no_verdict"),
        ("not_computed", "fail", "not_computed"),
    ],
)
def test_a_stage_has_one_sign_on_all_pages(status, foundation, sign):
    caveat = Caveat(foundation, "read this") if foundation != "pass" else None
    head = Head("arm", "trajectory", status, "", (), None, caveat, SimpleNamespace())
    assert head.sign == sign


def test_the_search_has_headings_rows_and_captions_by_heading():
    page = """<nav>All robots</nav><main><p>Cau<b>tio</b>n: 2 of 3.</p>
    <details><summary><h2>Paths</h2></summary><p>One<br>two</p><img alt="A curve">
    <table><thead><tr><th>path</th></tr></thead>
    <tr><td>line</td><td><p>safe</p></td></tr></table></details>
    <h3>More</h3><button>Play</button><ul><li>a</li><li>bc <ul><li>de</li></ul></li></ul>
    <h2>Last</h2><table><tr><td>line 2</td></tr></table></main><footer>sha256</footer>"""
    parser = TextOfPage()
    parser.feed(page)
    assert {head: list(texts) for head, texts in parser.texts.items()} == {
        "Paths": ["Paths", "line safe"],
        "Paths More": ["More", "de"],
        "Last": ["Last", "line 2"],
    }


def test_the_index_draws_the_arm_that_its_headline_names(small_results, tmp_path):
    study = load_study("config/small.yaml")
    robots = {name: study.robots[name] for name in ("er3_600", "er3a_c60_article", "er3a_c60")}
    study = study.model_copy(update={"robots": robots})
    for robot in robots:
        (tmp_path / robot).mkdir()
        (tmp_path / robot / "validation").symlink_to(small_results("validation", robot, study).resolve())
    write_index(study, tmp_path, tmp_path)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "Plan with EFORT ER3A-C60." in page
    assert (
        re.search(r'<div class="shown"><div class="arms".*?<p class="right"><b>(.*?)</b>', page)[1] == "EFORT ER3A-C60"
    )
