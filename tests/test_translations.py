"""Chinese documents keep up with the English ones: the same code, commands, settings, headings and links."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from testing.documents import ROOT, blocks, prose

PAIRS = {
    "README.md": "README.zh-CN.md",
    "docs/new-robot.md": "docs/new-robot.zh-CN.md",
    "docs/paths.md": "docs/paths.zh-CN.md",
    "docs/confirm.md": "docs/confirm.zh-CN.md",
    "docs/install.md": "docs/install.zh-CN.md",
    "docs/notebooks/article_steps.md": "docs/notebooks/article_steps_zh.md",
}
COMMENT = re.compile(r"\s*#.*")
CODE = re.compile(r"`([^`\n]+)`")
LINK = re.compile(r"\]\(([^)#]+)")
TEXT = re.compile(r'"[^"]*"')
VALUE = re.compile(r"\{[^{}]*[\w\])][^{}]*\}")
CHINESE = re.compile("[\u4e00-\u9fff]")


def code_of(page: Path) -> list[str]:
    """Code and commands, without comments."""
    found = blocks(page, "", "python", "yaml", "{code-cell}")
    return [COMMENT.sub("", line) for block in found for line in block.splitlines() if COMMENT.sub("", line)]


def spoken(line: str) -> tuple[str, list[str]]:
    """A line of code without the words of its texts, and the values that these show."""
    return TEXT.sub('""', line), sorted(VALUE.findall(line))


@pytest.mark.parametrize("english", PAIRS)
def test_both_have_the_same_code(english):
    other, one = code_of(ROOT / PAIRS[english]), code_of(ROOT / english)
    assert len(other) == len(one)
    for line, original in zip(other, one):
        told = CHINESE.search(line) is not None  # what is printed is translated, but for the values in it
        assert (spoken(line) if told else line) == (spoken(original) if told else original)


@pytest.mark.parametrize("english", PAIRS)
def test_both_have_as_many_sections_and_table_rows(english):
    one, other = (prose(ROOT / name) for name in (english, PAIRS[english]))
    for start in ("#+ ", r"\|"):
        assert len(re.findall(rf"^{start}", other, re.MULTILINE)) == len(re.findall(rf"^{start}", one, re.MULTILINE))


@pytest.mark.parametrize("english", PAIRS)
def test_both_name_the_same_settings_and_commands(english):
    one, other = (set(CODE.findall(" ".join(prose(ROOT / name).split()))) for name in (english, PAIRS[english]))
    assert {text for text in other if not CHINESE.search(text)} - {"er3a", "modified", "coupling"} <= one
    assert len(other) >= 0.9 * len(one)


@pytest.mark.parametrize("english", PAIRS)
def test_both_lead_to_the_same_documents(english):
    one, other = (set(LINK.findall(prose(ROOT / name))) for name in (english, PAIRS[english]))
    languages = {Path(name).name for pair in PAIRS.items() for name in pair}
    assert {link for link in one ^ other if Path(link).name not in languages} == set()
