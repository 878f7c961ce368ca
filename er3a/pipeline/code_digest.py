"""A digest of the modules that a module uses, so that an edit reruns only what depends on it.

Imports are read from the source text and followed inside this package. The packages' ``__init__`` files compute
nothing, so only the named modules count.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

_ROOT = Path(__file__).resolve().parents[2]
_PACKAGE = _ROOT / "er3a"
# Every process asks for a digest, and a parser would take a second for it; a line of prose that looks like this names
# no module. One line (a comment left off), or a bracket of lines.
_IMPORT = re.compile(r"^[ \t]*(?:from (?P<module>[\w.]+) )?import (?P<names>\([^)]*\)|[\w., \t]+)", flags=re.MULTILINE)
VIEWS = ("report.py", "page.py", "panel.py", "index.py")


@cache
def code_digest(*modules: str) -> str:
    """SHA-256 over the sources of modules, of all modules of er3a that they import (transitively), and of templates
    (``*.j2``, ``*.css``, ``*.js``) beside those that are part of a view."""
    for module in modules:
        if _file(module) is None:
            raise ModuleNotFoundError(f"er3a has no module '{module}'")
    digest = hashlib.sha256()
    for path in sorted(_sources(modules)):
        digest.update(_named_source(path))
    return digest.hexdigest()


@cache
def _named_source(path: Path) -> bytes:
    return path.relative_to(_PACKAGE).as_posix().encode() + b"\0" + path.read_bytes() + b"\0"


def _sources(modules: Iterable[str]) -> set[Path]:
    """The files of modules, of those that they import (transitively), and templates of views."""
    found: set[Path] = set()
    todo = [path for module in modules if (path := _file(module))]
    while todo:
        path = todo.pop()
        if path in found:
            continue
        found.add(path)
        if path.name in VIEWS:
            found |= {file for kind in ("j2", "css", "js") for file in path.parent.glob(f"*.{kind}")}
        todo += _imported(path)
    return found


@cache
def _imported(path: Path) -> tuple[Path, ...]:
    """The files that a file imports."""
    return tuple(file for name in imported_names(path) if (file := _file(name)))


def imported_names(path: Path) -> tuple[str, ...]:
    """All names that a file imports, public names of er3a by the modules that they come from."""
    names: list[str] = []
    for found in _IMPORT.finditer(path.read_text(encoding="utf-8")):
        module, listed = (
            found["module"],
            [part.split()[0] for part in found["names"].strip("()").split(",") if part.split()],
        )
        if module is None:
            names += listed
        elif module == "er3a":
            names += [_public().get(name, f"er3a.{name}") for name in listed]
        else:
            names += [module, *(f"{module}.{name}" for name in listed)]
    return tuple(names)


@cache
def _public() -> dict[str, str]:
    """The public names of er3a, and their modules, as its ``__init__`` lists them."""
    tree = ast.parse((_PACKAGE / "__init__.py").read_bytes())
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "_PUBLIC":
            public: dict[str, str] = ast.literal_eval(node.value)
            return public
    return {}


@cache
def _file(module: str) -> Path | None:
    path = _ROOT.joinpath(*module.split(".")).with_suffix(".py")
    return path if module.partition(".")[0] == _PACKAGE.name and path.is_file() else None
