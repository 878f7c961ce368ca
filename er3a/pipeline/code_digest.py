"""Digests of the package's own files: Snakemake does not see that an imported package was edited.

There are two. Numbers rest on all code but that of views; views, which show numbers, rest on everything. So another
wording or picture computes nothing again.
"""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]
FOLDERS = "messages", "viewing", "player", "teach", "page", "overview", "article", "commands", "new_study"
FILES = (
    "check",
    "cli",
    "dictionary",
    "path_programs",
    "program_reports",
    "run_study",
    "sarif",
    "verdicts",
    "working_folder",
)
VIEWS = frozenset((*FOLDERS, *(f"{name}.py" for name in FILES)))
"""Folders and files of ``pipeline/`` on which no number rests: computing imports none of them (import-linter)."""
_KINDS = (".py", ".j2", ".css", ".js", ".mjs")


@cache
def numbers_digest() -> str:
    """Digest of the code that numbers can depend on.

    Returns
    -------
    digest : SHA-256 over the names and contents of these files, in hex; computed once in a process
    """
    return _digest(views=False)


@cache
def code_digest() -> str:
    """Digest of the code that pages and recordings can depend on, which is all of it.

    Returns
    -------
    digest : SHA-256 over the names and contents of these files, in hex; computed once in a process
    """
    return _digest(views=True)


def _digest(views: bool) -> str:
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*")):
        name = path.relative_to(_PACKAGE)
        is_view = name.parts[0] == "pipeline" and not VIEWS.isdisjoint(name.parts)
        if path.suffix in _KINDS and name.parts[0] != "shipped" and (views or not is_view):
            digest.update(name.as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()
