"""Which pages of evidence still rest on the code that stands here.

Each page that a campaign writes ends with a digest of the campaign's source and of every module of er3a and of its test
tools that it imports, or that the commands use which it starts. Another digest means that the page tells of other code.

make evidence                 lists the pages and what has become of them
make release-check            the same, and ends with 1 if any is stale or the release's papers are not in order
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from er3a.pipeline.code_digest import digest_of, sources

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = (
    "kinematics",
    "classes",
    "singularities",
    "speed",
    "diagnosis",
    "calibration",
    "hand_eye",
    "workspace",
    "paths",
    "clearance",
    "motion",
    "collision",
    "capability",
    "teach",
    "pages",
    "estimate",
    "fleet",
)
PARTS = {"fuzz": "reliability.md", "faults": "reliability.md", "kills": "reliability.md", "slurm": "cluster.md"}
CAMPAIGNS = (*PAGES, *PARTS)
STARTING_COMMANDS = {"pages", "estimate", "faults", "kills", "slurm"}
DIGITS = 16
LINE = "Code: `{digest}`, a digest of `benchmarks/campaign_{name}.py` and of {count} modules that it rests on."
_NAMED = re.compile(r"^Code: `([0-9a-f]+)`, a digest of `benchmarks/campaign_(\w+)\.py`", re.MULTILINE)

Standing = Literal["current", "stale", "not named"]


@dataclass(frozen=True)
class Evidence:
    """A page, or a part of one, that a campaign wrote; ``named`` is the digest that stands there, if any."""

    campaign: str
    page: Path
    named: str | None
    present: str

    @property
    def standing(self) -> Standing:
        """Whether the page rests on the code that is here."""
        if self.named is None:
            return "not named"
        return "current" if self.named == self.present else "stale"


def page_of(campaign: str, root: Path = ROOT) -> Path:
    """The page that a campaign writes, or writes a part of."""
    return root / "docs" / PARTS.get(campaign, f"evidence/{campaign}.md")


def files_of(campaign: str, root: Path = ROOT) -> set[Path]:
    """The sources that a campaign's page rests on."""
    modules = [f"benchmarks.campaign_{campaign}"]
    if campaign in STARTING_COMMANDS:
        modules += ["er3a.pipeline.cli", *_verbs(root)]
    return sources(modules, root, ("er3a", "testing", "benchmarks"))


def _verbs(root: Path) -> Iterable[str]:
    """Modules of stages, which the command line imports by name."""
    for file in sorted((root / "er3a/pipeline/stages").glob("*/*.py")):
        if file.stem in {"compute", "record", "report"}:
            yield ".".join(file.relative_to(root).with_suffix("").parts)


def digest(campaign: str, root: Path = ROOT) -> str:
    """The digest of those sources."""
    return digest_of(files_of(campaign, root), root)[:DIGITS]


def code_line(campaign: str, root: Path = ROOT) -> str:
    """The line that a page ends with."""
    return LINE.format(digest=digest(campaign, root), name=campaign, count=len(files_of(campaign, root)) - 1)


def evidence(root: Path = ROOT) -> tuple[Evidence, ...]:
    """All pages and parts, in the order of the campaigns."""
    found = []
    for campaign in CAMPAIGNS:
        page = page_of(campaign, root)
        text = page.read_text(encoding="utf-8") if page.is_file() else ""
        named = {name: digest for digest, name in _NAMED.findall(text)}
        found.append(Evidence(campaign, page, named.get(campaign), digest(campaign, root)))
    return tuple(found)


def papers_out_of_order(root: Path = ROOT) -> tuple[str, ...]:
    """What a release's papers say against each other."""
    version = re.findall(
        r'^__version__ = "(.+)"$', (root / "er3a/version.py").read_text(encoding="utf-8"), re.MULTILINE
    )[0]
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


def main(words: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Lists which pages of evidence rest on the code that is here.")
    parser.add_argument("--release", action="store_true", help="end with 1 unless a release could be made of this")
    release = parser.parse_args(words).release
    every = evidence()
    for each in every:
        campaign = "" if each.standing == "current" else f"   make campaigns ARGS={each.campaign}"
        print(f"{each.standing:<9}  {each.page.relative_to(ROOT)} ({each.campaign}){campaign}")
    stale = sum(each.standing != "current" for each in every)
    print(f"{stale} of {len(every)} rest on other code than is here")
    problems = papers_out_of_order() if release else ()
    for problem in problems:
        print(problem)
    return 1 if release and (stale or problems) else 0


if __name__ == "__main__":
    raise SystemExit(main())
