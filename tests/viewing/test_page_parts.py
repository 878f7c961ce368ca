"""What all pages share: addresses of figures and tables that stay, words that lead on, and the table to use instead."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

import er3a
from er3a.identifiability.entry_evidence import EntryEvidence
from er3a.pipeline.messages.pages import Caveat
from er3a.pipeline.messages.references import STATUS_WORDS
from er3a.pipeline.overview.index import _tally, _TextOfPage, write_index
from er3a.pipeline.player.motions import Fault, FaultMoment
from er3a.pipeline.results import read_stage
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.validation.page.evidence_section import rounded_within, table_to_use
from er3a.pipeline.study import load_study
from er3a.pipeline.viewing.page import VERDICT_WORDS, Head, Numbering, _tray_edges, linked, page_environment
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


def test_the_first_of_a_name_leads_on_and_texts_stay_texts():
    text = "Not er3a_c60_article <b>: use er3a_c60, and er3a_c60 again."
    html = linked(text, {"er3a_c60": "../er3a_c60/validation.html"})
    assert html == (
        'Not er3a_c60_article &lt;b&gt;: use <a href="../er3a_c60/validation.html">er3a_c60</a>, and er3a_c60 again.'
    )


def test_the_table_to_use_is_whole_and_as_its_file_gives_it():
    real, article = er3a.load_robot("er3a_c60"), er3a.load_robot("er3a_c60_article")
    open_ones = [
        EntryEvidence("alpha6", 0.0, "deg", "open", None, (), (), None),
        EntryEvidence("a2", 270.0, "mm", "settled", None, (), (), None),
    ]
    section = table_to_use(article, real, "alpha 6, all limits", SimpleNamespace(entries=open_ones))
    rows = [[value for value, *_ in cells] for _, cells in section["rows"]]
    assert "Not confirmed: alpha 6, all limits. “One source”: only the source of er3a_c60 gives it" in section["text"]
    assert [mark for _, cells in section["rows"] for *_, mark in cells if mark] == ["?"]
    assert section["rows"][5][1][1][2:] == ("", "?")
    assert section["page"] == "../er3a_c60/validation.html"
    assert rows[1] == ["270", "0", "0", "−90", "−1", "−130", "90"]
    marked = np.array([[differs for _, differs, *_ in cells] for _, cells in section["rows"]])
    assert marked[1].tolist() == [True, False, False, True, True, True, True]
    same = table_to_use(real, real, "", None)["rows"]
    assert not any(differs or mark for _, cells in same for _, differs, _, mark in cells)


@pytest.mark.parametrize(
    ("value", "interval", "shown"), [(269.999, (269.9, 270.1), 270), (321.48, (321.45, 321.55), 321.5)]
)
def test_a_value_is_rounded_as_far_as_documents_leave_open(value, interval, shown):
    entry = EntryEvidence("a2", 650.0, "mm", "contradicted", interval, (), (), "article")
    assert rounded_within(value, entry) == shown


def test_the_index_marks_each_entry_of_a_table_as_validation_found_it(small_results, tmp_path):
    """By the summary alone: class, value and what the evidence gives beside it, and no entry is left out."""
    study = load_study("config/small.yaml")
    for name in study.robots:
        (tmp_path / name).mkdir()
        (tmp_path / name / "validation").symlink_to(small_results("validation", name, study).resolve())
    write_index(study, tmp_path, tmp_path)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    legends = page.split('class="key entries"')[1:]
    assert len(legends) == len(study.robots)  # above each table, where its link leads
    legend = " ".join(each.split("</p>")[0] for each in legends)
    better = read_stage(tmp_path / "er3a_c60/validation", STAGES["validation"]).results.summary.evidence
    to_use = {each.entry: each.status for each in better.entries}
    for name in study.robots:
        evidence = read_stage(tmp_path / name / "validation", STAGES["validation"]).results.summary.evidence
        for entry in (each for each in evidence.entries if each.value is not None):
            link = re.escape(f'<a href="{name}/validation.html#entry-{entry.entry}">')
            (status, value, rest) = re.search(
                rf'<td class="n (\w+)" title="[^"]*">{link}(.*?)</a>(.*?)</td>', page
            ).groups()
            alone = name == "er3a_c60_article" and "settled" in entry.status and to_use[entry.entry] == "consistent"
            shown = "consistent" if alone else entry.status  # what one source gives is not coloured as confirmed
            assert (status, float(value.replace("−", "-"))) == (shown, round(entry.value, 3)), entry
            assert ("✓ one source, agrees" in rest or "(✓) one source, agrees" in rest) == alone, (
                entry
            )  # beside the table to use
            assert f'<span class="{status}">' in legend
            assert f"{STATUS_WORDS[status]}" in legend  # in the words of the validation page
            if status == "contradicted":
                given, alone = re.search("→ <strong>(.*?)( one source)?</strong>", rest).groups()
                given = float(given.replace("−", "-"))
                assert bool(alone) == (to_use[entry.entry] == "consistent"), entry
                assert entry.interval[0] <= given <= entry.interval[1], entry
            else:
                assert "→" not in rest
    for twin in ("alpha6", "offset6"):
        assert re.search(rf'er3a_c60/validation.html#entry-{twin}">0</a> <span>or 180 ', page)
    assert "alpha6 = 180 (here 0), offset6 = 180 (here 0)" in page
    assert '<a href="#dh-er3a_c60">er3a_c60</a>' in page
    groups = [re.findall(r"<strong>(.*?)</strong>: (.*?)(?=<strong>|$)", each.split("</p>")[0]) for each in legends]
    marks = {verdict: set(re.findall('class="(\\w+)"', text)) for found in groups for verdict, text in found}
    assert marks["confirmed"] <= {"settled", "settled_up_to_signs"}
    assert marks["nothing to confirm"] == {"gauge"}
    assert "one source (the only document that gives the value agrees with it, but confirms none of its own" in page


def test_a_box_that_may_be_placed_is_named_where_nothing_recommends_against_it():
    study = load_study(ROOT / "config/config.yaml")
    stored = SimpleNamespace(robot="er3a_c60", rests_on={"validation": "caution"})
    assert _tray_edges(study, stored) == "200 × 150 × 50"
    stored.rests_on["validation"] = "fail"
    assert _tray_edges(study, stored) == ""


def test_what_fails_though_nothing_expects_it_is_named_beside_the_count():
    def fault(name: str, meant: bool) -> Fault:
        return Fault(name, "", "fail", "collides", meant, "", (FaultMoment("x"),), "", "trajectory.html")

    meant = [fault(f"m{k}", True) for k in range(2)]
    assert _tally("trajectory", 5, meant, 0) == "5 of 7 paths pass in the model; the other 2 are expected to fail"
    assert _tally("trajectory", 5, meant[:1], 0).endswith("; the other one is expected to fail")
    assert _tally("programs", 3, [], 0) == "3 of 3 programs pass in the model"
    others = [fault(f"o{k}", False) for k in range(5)]
    assert _tally("trajectory", 1, [*meant, *others], 1) == (
        "1 of 9 paths pass in the model; 2 expected to fail; o0: collides; o1: collides; o2: collides; "
        "2 more do not pass; 1 not followed to the end"
    )


@pytest.mark.parametrize(
    ("status", "demonstrations", "foundation", "sign"),
    [
        ("pass", 0, "pass", "pass"),
        ("pass", 7, "caution", "pass as_meant"),
        ("caution", 7, "pass", "caution"),
        ("pass", 7, "fail", "no_verdict"),
        ("not_computed", 0, "fail", "not_computed"),
    ],
)
def test_a_stage_has_one_sign_on_all_pages(status, demonstrations, foundation, sign):
    caveats = {"validation": Caveat(foundation, "read this")} if foundation != "pass" else {}
    head = Head("arm", "trajectory", status, "", (), None, caveats, demonstrations, None)
    assert head.sign == sign
    badge = (
        page_environment()
        .from_string('{% import "macros.html.j2" as ui %}{{ ui.stage_badge(head, words) }}')
        .render(head=head, words=VERDICT_WORDS)
    )
    assert f'class="badge {sign}"' in badge
    assert ("no verdict" in badge) == (sign == "no_verdict")
    assert ("7 expected to fail" in badge) == (demonstrations > 0 and sign != "no_verdict")


def test_the_search_has_all_text_of_a_page_by_heading():
    page = """<nav>All robots</nav><main><p>Cau<b>tio</b>n: 2 of 3.</p>
    <details><summary><h2>Paths</h2></summary><p>One<br>two</p><img alt="A curve">
    <table><thead><tr><th>path</th></tr></thead>
    <tr><td>line</td><td><p>safe</p></td></tr></table></details>
    <h3>More</h3><button>Play</button><ul><li>a</li><li>bc <ul><li>de</li></ul></li></ul>
    <h2>Last</h2><table><tr><td>line 2</td></tr></table></main><footer>sha256</footer>"""
    parser = _TextOfPage()
    parser.feed(page)
    assert {head: list(texts) for head, texts in parser.texts.items()} == {
        "": ["Caution: 2 of 3."],
        "Paths": ["Paths", "One two", "A curve", "line safe"],
        "Paths More": ["More", "bc", "de"],
        "Last": ["Last", "line 2"],
    }
