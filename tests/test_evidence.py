"""Pages of evidence name the commit that they were made from; a release's papers agree; documents quote what holds."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

import er3a
from benchmarks.campaigns import main as campaigns
from benchmarks.campaigns import write
from er3a.errors import ResultError
from er3a.pipeline.results import FORMAT_VERSION
from testing import evidence as pages
from testing.evidence import CAMPAIGNS, PARTS, ROOT, evidence, is_of_this_code, made_from, papers_out_of_order, sized

PAPERS = ("CITATION.cff", "CHANGELOG.md")
FILES = ("er3a/version.py", "er3a/kinematics/forward.py", *PAPERS, "docs/reliability.md", "docs/evidence/motion.md")


def git(folder: Path, *words: str) -> None:
    named = ("-c", "user.name=nobody", "-c", "user.email=nobody@localhost")
    subprocess.run(["git", *named, *words], cwd=folder, check=True, capture_output=True)


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A repository with a few of the project's files, all committed."""
    for name in FILES:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", "-A")
    git(tmp_path, "commit", "-qm", "all")
    return tmp_path


def standing(root: Path, campaign: str) -> bool:
    (each,) = (each for each in evidence(root) if each.campaign == campaign)
    return is_of_this_code(each, root)


def test_every_campaign_is_known_and_has_its_page():
    assert {f"campaign_{name}" for name in CAMPAIGNS} == {
        path.stem for path in (ROOT / "benchmarks").glob("campaign_*")
    }
    for each in evidence():
        text = each.page.read_text(encoding="utf-8")
        assert each.campaign not in PARTS or f"<!-- written by: make campaigns ARGS={each.campaign} -->" in text


def test_each_page_says_which_commit_it_tells_of():
    for each in evidence():
        text = each.page.read_text(encoding="utf-8")
        assert re.search(rf"^Made (from|before) .*commit `[0-9a-f]+`.*ARGS={each.campaign}`", text, re.MULTILINE)


@pytest.mark.parametrize("campaign", ["motion", "kills"])
def test_a_page_is_made_again_when_code_has_changed_since_its_commit(campaign, copy, monkeypatch):
    monkeypatch.setattr(pages, "ROOT", copy)
    monkeypatch.setattr("benchmarks.campaigns.page_of", lambda name: pages.page_of(name, copy))
    assert not standing(copy, campaign), "no commit of this repository is named"
    write(campaign, "a new text", made_from(campaign, 12.3, copy))
    text = pages.page_of(campaign, copy).read_text(encoding="utf-8")
    assert "a new text" in text
    assert re.search(rf"er3a {re.escape(er3a.__version__)} at commit `\w+` \(20.*ARGS={campaign}`, in 12 s of\s", text)
    assert standing(copy, campaign)
    git(copy, "commit", "-qam", "the page")
    assert standing(copy, campaign), "a page's own commit is no change of the code"
    with (copy / "er3a/kinematics/forward.py").open("a") as file:
        file.write("# changed\n")
    assert not standing(copy, campaign)
    with pytest.raises(RuntimeError, match="not committed"):
        made_from(campaign, 1.0, copy)


def test_a_share_of_a_campaign_has_as_many_cases(monkeypatch):
    assert sized(1000) == 1000
    monkeypatch.setenv(pages.SHARE, "0.01")
    assert (sized(1000), sized(10), sized(10, 3)) == (10, 1, 3)


def test_a_campaign_that_is_not_there_is_one_line(capsys):
    assert campaigns(["nothing"]) == 2
    assert capsys.readouterr().err.startswith("error: no campaign 'nothing'; known: kinematics,")


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
