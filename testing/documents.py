"""README and guides, split into code, prose and command lines."""

from __future__ import annotations

import re
from pathlib import Path
from textwrap import dedent

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted(
    page
    for page in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), ROOT / "data/manual_refs/README.md")
    if page.name != "CHANGELOG.md" and not {"_build", "generated"} & set(page.parts)
)
_FENCED = re.compile(r"^( *)```(\S*)[^\n]*\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)
_COMMAND = re.compile(r"`((?:er3a|make) [^`]+)`")


def name_of(page: Path) -> str:
    """A page's place in the project."""
    return page.relative_to(ROOT).as_posix()


def blocks(page: Path, *languages: str) -> list[str]:
    """The fenced blocks of a page in some languages."""
    text = page.read_text(encoding="utf-8")
    return [dedent(found[3]) for found in _FENCED.finditer(text) if found[2] in languages]


def prose(page: Path) -> str:
    """A page without its fenced blocks."""
    return _FENCED.sub("", page.read_text(encoding="utf-8"))


def commands(page: Path) -> list[str]:
    """The commands of er3a and make that a page names, within its text and in blocks of their own."""
    lines = [
        line.split("  #")[0].strip() for block in blocks(page, "", "console", "bash") for line in block.splitlines()
    ]
    own = [part.strip().removeprefix(".venv/bin/") for line in lines for part in line.split("&&")]
    return _COMMAND.findall(prose(page)) + [line for line in own if line.startswith(("er3a ", "make "))]
