"""The README's answers on the default study, for tests that compare them with results."""

from __future__ import annotations

import re
from pathlib import Path

README = Path(__file__).resolve().parent.parent / "README.md"


def answer(question: str) -> str:
    """The README's answer to the question that begins with this text, without thousands separators."""
    row = re.search(rf"^\| {question}[^|]*\| ([^|]+) \|$", README.read_text(encoding="utf-8"), flags=re.MULTILINE)
    if row is None:
        raise LookupError(f"README.md answers no question that begins with '{question}'")
    return re.sub(r"(?<=\d) (?=\d{3}\b)", "", row[1])
