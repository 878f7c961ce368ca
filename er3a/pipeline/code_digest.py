"""A digest of just the modules that a module uses, so that an edit reruns what depends on it and nothing else.

Imports are read from the source text and followed inside this package. The packages' ``__init__`` files hold no code
that computes, so only the modules that are named count.
"""

from __future__ import annotations

import ast
import hashlib
from functools import cache
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]
VIEWS = ("report.py", "page.py", "panel.py", "index.py")


@cache
def code_digest(*modules: str) -> str:
    """SHA-256 over the sources of modules, of all modules of er3a that they import (transitively), and of templates
    (``*.j2``, ``*.css``, ``*.js``) that stand beside those that are part of a view."""
    reached: set[Path] = set()
    for module in modules:
        if _file(module) is None:
            raise ModuleNotFoundError(f"er3a has no module '{module}'")
        reached |= _reached(module)
    digest = hashlib.sha256()
    for path in sorted(reached):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _reached(module: str) -> set[Path]:
    found: set[Path] = set()
    todo = [module]
    while todo:
        path = _file(todo.pop())
        if path is None or path in found:
            continue
        found.add(path)
        if path.name in VIEWS:
            found |= {file for kind in ("j2", "css", "js") for file in path.parent.glob(f"*.{kind}")}
        todo += _imports(path)
    return found


@cache
def _imports(path: Path) -> tuple[str, ...]:
    names: list[str] = []
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return tuple(name for name in names if name.split(".")[0] == "er3a")


def _file(module: str) -> Path | None:
    path = _PACKAGE.joinpath(*module.split(".")[1:]).with_suffix(".py")
    return path if path.is_file() else None
