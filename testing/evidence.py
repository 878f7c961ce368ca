"""Pages of evidence: which there are, how large their campaigns are, and which commit a page was made from.

A page is about the code that it was made from, and names its version, commit and date. It is not made again after every
edit: ``make campaigns`` makes the pages again whose code, data or studies have changed since their commit.

make release-check            an error if the papers of a release disagree; lists pages about other code
"""

from __future__ import annotations

import os
import re
import subprocess
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGES = (
    "kinematics",
    "classes",
    "singularities",
    "speed",
    "diagnosis",
    "calibration",
    "real_arms",
    "hand_eye",
    "workspace",
    "paths",
    "clearance",
    "motion",
    "collision",
    "capability",
    "teach",
    "pages",
    "fleet",
    "comparison",
    "arms",
    "confirm",
    "time",
    "programs",
)
PARTS = {"fuzz": "reliability.md", "faults": "reliability.md", "kills": "reliability.md"}
CAMPAIGNS = (*PAGES, *PARTS)
COUNTING = ("er3a", "testing", "benchmarks", "data", "config", "workflow", "profiles", "Snakefile", "requirements")
SHARE = "CAMPAIGN_SHARE"
LINE = (
    "Made from er3a {version} at commit `{commit}` ({date}) by `make campaigns ARGS={name}`, in {seconds:.0f} s "
    "of processor time."
)
_NAMED = re.compile(r"^Made from er3a \S+ at commit `([0-9a-f]+)` \([\d-]+\) by `make campaigns ARGS=(\w+)`", re.M)


def sized(count: int, least: int = 1) -> int:
    """A campaign's number of cases, or the share of it that this process is to try (``CAMPAIGN_SHARE``)."""
    return max(least, round(count * float(os.environ.get(SHARE, "1"))))


@dataclass(frozen=True)
class Evidence:
    """A page, or a part of one; ``commit`` that it says it was made from, None if it names none."""

    campaign: str
    page: Path
    commit: str | None


def page_of(campaign: str, root: Path = ROOT) -> Path:
    """The page that a campaign writes, or writes a part of."""
    return root / "docs" / PARTS.get(campaign, f"evidence/{campaign}.md")


def evidence(root: Path = ROOT) -> tuple[Evidence, ...]:
    """All pages and parts, in the order of the campaigns."""
    found = []
    for campaign in CAMPAIGNS:
        page = page_of(campaign, root)
        text = page.read_text(encoding="utf-8") if page.is_file() else ""
        named = {name: commit for commit, name in _NAMED.findall(text)}
        found.append(Evidence(campaign, page, named.get(campaign)))
    return tuple(found)


def is_of_this_code(each: Evidence, root: Path = ROOT) -> bool:
    """Whether nothing that a campaign could rest on has changed since the commit that a page names."""
    if each.commit is None:
        return False
    return _git(root, "diff", "--quiet", each.commit, "--", *COUNTING).returncode == 0


def made_from(campaign: str, seconds: float, root: Path = ROOT) -> str:
    """The line that a page ends with.

    Raises
    ------
    RuntimeError
        if code that counts is not committed, so that no commit names it
    """
    if _git(root, "diff", "--quiet", "HEAD", "--", *COUNTING).returncode:
        raise RuntimeError("the code has changes that are not committed, so no commit names it: commit them first")
    commit = _git(root, "rev-parse", "--short=10", "HEAD").stdout.strip()
    date = datetime.now(UTC).date().isoformat()
    return LINE.format(version=_version(root), commit=commit, date=date, name=campaign, seconds=seconds)


def _git(root: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=False)


def _version(root: Path) -> str:
    text = (root / "er3a/version.py").read_text(encoding="utf-8")
    return str(re.findall(r'^__version__ = "(.+)"$', text, re.MULTILINE)[0])


def papers_out_of_order(root: Path = ROOT) -> tuple[str, ...]:
    """Why the files of a release are not ready: a version that they don't name, changes still under Unreleased."""
    version = _version(root)
    stated = {
        "CITATION.cff": rf"^version: {re.escape(version)}$",
        "CHANGELOG.md": rf"^## \[{re.escape(version)}\] - \d{{4}}-\d\d-\d\d$",
    }
    missing = [
        f"{file} does not name version {version} of er3a/version.py"
        for file, line in stated.items()
        if not re.search(line, (root / file).read_text(encoding="utf-8"), re.MULTILINE)
    ]
    log = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    if re.search(r"^## \[Unreleased\]\s+(?!##)\S", log, re.MULTILINE):
        missing.append("CHANGELOG.md has entries under Unreleased")
    return tuple(missing)


def main() -> int:
    """Of a release: list the pages about other code; 1 if its papers disagree."""
    for each in evidence():
        if not is_of_this_code(each):
            print(f"{each.page.relative_to(ROOT)} ({each.campaign}) tells of {each.commit or 'code that it names not'}")
    problems = papers_out_of_order()
    for problem in problems:
        print(problem)
    return 1 if problems else 0


if __name__ == "__main__":
    raise SystemExit(main())
