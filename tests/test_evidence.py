"""Pages of evidence name the code that they rest on, and go stale with it; what documents quote of code holds."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

import er3a
from er3a.errors import ResultError
from er3a.pipeline.results import FORMAT_VERSION
from testing.evidence import CAMPAIGNS, ROOT, code_line, digest, evidence, files_of, main, papers_out_of_order

COPIED = ("er3a", "testing", "benchmarks", "docs")
PAPERS = ("CITATION.cff", "CHANGELOG.md")


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    for name in COPIED:
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__", "_build"))
    for name in PAPERS:
        shutil.copy(ROOT / name, tmp_path / name)
    return tmp_path


def standings(root: Path) -> dict[str, str]:
    return {each.campaign: each.standing for each in evidence(root)}


def test_every_campaign_is_known_and_its_page_names_its_code():
    assert {f"campaign_{name}" for name in CAMPAIGNS} == {
        path.stem for path in (ROOT / "benchmarks").glob("campaign_*")
    }
    assert [each.campaign for each in evidence() if each.named is None] == []


@pytest.mark.long
def test_a_page_goes_stale_with_the_code_it_rests_on_and_with_no_other(copy):
    page = copy / "docs/evidence/kinematics.md"
    page.write_text(page.read_text(encoding="utf-8") + code_line("kinematics", copy) + "\n", encoding="utf-8")
    assert standings(copy)["kinematics"] == "current"
    with (copy / "er3a/pipeline/cli.py").open("a") as file:
        file.write("# changed\n")
    assert digest("kinematics", copy) == digest("kinematics")
    changed = copy / "elsewhere"
    shutil.copytree(copy, changed, ignore=shutil.ignore_patterns("elsewhere"))
    with (changed / "er3a/kinematics/forward.py").open("a") as file:
        file.write("# changed\n")
    assert standings(changed)["kinematics"] == "stale"


def test_public_names_count_by_the_modules_that_they_come_from():
    names = {path.relative_to(ROOT).as_posix() for path in files_of("kinematics")}
    assert {"benchmarks/campaign_kinematics.py", "er3a/kinematics/forward.py", "er3a/files/robot_library.py"} <= names
    assert "er3a/selection/select.py" not in names


def test_campaigns_that_start_commands_rest_on_all_stages():
    names = {path.relative_to(ROOT).as_posix() for path in files_of("faults")}
    assert {"er3a/pipeline/cli.py", "er3a/pipeline/stages/validation/compute.py"} <= names


@pytest.mark.long
def test_the_list_is_no_failure_but_a_release_needs_current_pages(capsys):
    stale = sum(each.standing != "current" for each in evidence())
    assert main([]) == 0
    listed = capsys.readouterr().out
    assert f"{stale} of {len(CAMPAIGNS)} rest on other code" in listed
    assert (main(["--release"]) == 0) == (stale == 0 and not papers_out_of_order())


def test_a_release_needs_papers_that_agree(copy):
    version = re.escape(er3a.__version__)
    log = f"# Changelog\n\n## [Unreleased]\n\n## [{er3a.__version__}] - 2026-11-20\n\n- new\n"
    (copy / "CHANGELOG.md").write_text(log, encoding="utf-8")
    assert papers_out_of_order(copy) == ()
    (copy / "CHANGELOG.md").write_text(
        log.replace("## [Unreleased]\n", "## [Unreleased]\n\n- more\n"), encoding="utf-8"
    )
    assert papers_out_of_order(copy) == ("CHANGELOG.md has entries under Unreleased",)
    citation = (copy / "CITATION.cff").read_text(encoding="utf-8")
    (copy / "CITATION.cff").write_text(re.sub(version, "0.0.9", citation), encoding="utf-8")
    assert papers_out_of_order(copy)[0].startswith("CITATION.cff does not name version")


def test_documents_quote_the_format_version_of_the_code():
    text = (ROOT / "docs/reliability.md").read_text(encoding="utf-8")
    quoted = re.findall(r"summary\.json: (format version \d+, this er3a reads \d+)", text)
    assert quoted == [f"format version {FORMAT_VERSION - 1}, this er3a reads {FORMAT_VERSION}"]
    told = str(ResultError("results/er3_600/trajectory/summary.json", quoted[0])).replace("`", "*")
    assert f"error: {told}" in text
