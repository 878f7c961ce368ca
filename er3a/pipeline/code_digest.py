"""Digests of the package's own files: Snakemake does not see that an imported package was edited.

There are two. Numbers rest on all code but that of views; views, which show numbers, rest on everything. So another
wording or picture computes nothing again.
"""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]
VIEWS = ("messages", "viewing", "player", "teach", "article", "overview", "commands", "new_study", "page")
"""Folders below ``pipeline/`` of which no number depends; import-linter holds that computing imports none of them."""
_KINDS = (".py", ".j2", ".css", ".js", ".po")


@cache
def numbers_digest() -> str:
    """SHA-256 over the names and contents of all files that numbers can depend on."""
    return _digest(views=False)


@cache
def code_digest() -> str:
    """SHA-256 over the names and contents of all files that pages and recordings can depend on."""
    return _digest(views=True)


def _digest(views: bool) -> str:
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*")):
        name = path.relative_to(_PACKAGE)
        if path.suffix in _KINDS and name.parts[0] != "shipped" and (views or not _is_view(name)):
            digest.update(name.as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _is_view(name: Path) -> bool:
    return name.parts[0] == "pipeline" and not set(VIEWS).isdisjoint(name.parts[1:-1])
