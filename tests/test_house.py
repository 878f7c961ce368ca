"""The house rules that can be read off the source: short functions, few arguments, names that stand for one thing, no
circle of files, documents that name files where they stand."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

pytestmark = pytest.mark.long  # the whole package is parsed

LONGEST_FUNCTION = 60  # lines without its docstring
MAX_POSITIONAL = 6
KERNELS = {"kernel", "inner_kernel", "borrowing_kernel", "inlined_kernel"}


@cache
def trees() -> dict[str, ast.Module]:
    """All modules of the package, parsed, by their paths."""
    paths = sorted((ROOT / "er3a").rglob("*.py"))
    return {path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8")) for path in paths}


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """All statements within a module or a statement; expressions hold no definition and no import."""
    for part in ("body", "handlers", "orelse", "finalbody", "cases"):
        for child in getattr(node, part, ()):
            yield child
            yield from statements(child)


@cache
def definitions() -> tuple[tuple[str, ast.FunctionDef | ast.ClassDef], ...]:
    """All functions and classes of the package, with the place that each begins at."""
    kinds = (ast.FunctionDef, ast.ClassDef)
    walked = ((path, node) for path, tree in trees().items() for node in statements(tree) if isinstance(node, kinds))
    return tuple((f"{path}:{node.lineno}", node) for path, node in walked)


def functions() -> Iterator[tuple[str, ast.FunctionDef]]:
    """All functions that are no kernels, with place and name."""
    for place, node in definitions():
        if isinstance(node, ast.FunctionDef) and not KERNELS & {
            getattr(each, "id", "") for each in node.decorator_list
        }:
            yield f"{place} {node.name}", node


def lines_of(function: ast.FunctionDef) -> int:
    """The lines of a function without its docstring."""
    text = function.body[0] if ast.get_docstring(function) else None
    return function.end_lineno - function.lineno + 1 - (text.end_lineno - text.lineno + 1 if text else 0)


def several(places: dict[str, set[str]]) -> dict[str, set[str]]:
    """Those names that stand in more than one place."""
    return {name: where for name, where in places.items() if len(where) > 1}


def test_the_rules_are_read_off_the_whole_package():
    assert len(trees()) > 200
    assert len(list(functions())) > 1000


def test_no_function_is_long():
    assert [place for place, function in functions() if lines_of(function) > LONGEST_FUNCTION] == []


def test_no_function_takes_many_positional_arguments():
    taken = {place: [each.arg for each in (*node.args.posonlyargs, *node.args.args)] for place, node in functions()}
    many = {place for place, names in taken.items() if len({*names} - {"self", "cls"}) > MAX_POSITIONAL}
    assert many == set()


def test_no_two_classes_share_a_name():
    places: dict[str, set[str]] = defaultdict(set)
    for place, node in definitions():
        if isinstance(node, ast.ClassDef):
            places[node.name].add(place)
    assert several(places) == {}


def modules_imported(tree: ast.Module) -> set[str]:
    """Full names that a module may import, those within functions and for type checkers too."""
    found = set()
    for node in statements(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found


def test_no_files_import_each_other_in_a_circle():
    """Files that import nothing left are taken away until none is; what stays imports itself by a detour."""
    names = {path.removesuffix(".py").removesuffix("/__init__").replace("/", "."): path for path in trees()}
    left = {name: modules_imported(trees()[path]) & {*names} - {name} for name, path in names.items()}
    while free := [name for name, others in left.items() if not others & {*left}]:
        for name in free:
            del left[name]
    assert sorted(left) == []


def test_documents_name_files_where_they_stand():
    missing = []
    for document in (*(ROOT / "docs").glob("*.md"), ROOT / "CONTRIBUTING.md", ROOT / "README.md"):
        for named in re.findall(r"`((?:er3a/)?[a-z_]+/[a-z_/]+\.py)`", document.read_text(encoding="utf-8")):
            places = [
                ROOT / named,
                ROOT / "er3a" / named,
                ROOT / "er3a/pipeline" / named,
                ROOT / "er3a/pipeline/stages" / named,
            ]
            missing += [] if any(map(Path.exists, places)) else [f"{document.name}: {named}"]
    assert missing == []


def test_docstrings_name_modules_that_are_there():
    names = {part for path in trees() for part in path.removesuffix(".py").split("/")}
    named = {
        (path, reference)
        for path in trees()
        for reference in re.findall(r":mod:`[~.]*([\w.]+)`", (ROOT / path).read_text(encoding="utf-8"))
    }
    assert [each for each in sorted(named) if each[1].split(".")[-1] not in names] == []


def names_of(module: ast.Module) -> set[str]:
    """What a module defines or imports at its top level."""
    targets = [target for node in module.body if isinstance(node, ast.Assign) for target in node.targets]
    targets += [node.target for node in module.body if isinstance(node, ast.AnnAssign)]
    assigned = {each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name)}
    imported = [alias for node in module.body if isinstance(node, ast.Import | ast.ImportFrom) for alias in node.names]
    defined = [node.name for node in module.body if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    return {*defined, *assigned, *(alias.asname or alias.name for alias in imported)}


def test_the_guide_names_rooms_and_modules_that_are_there():
    guide = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    named = re.findall(r"`([\w/]+(?:/|\.py))`", " ".join(re.findall(r"^\| (`.+?) \|", guide, flags=re.MULTILINE)))
    assert len(named) > 30
    assert [
        each for each in named if not (ROOT / each).exists() and not any(f"/{each}" in path for path in trees())
    ] == []


def test_what_the_package_offers_is_there():
    (offered,) = (node.value for node in trees()["er3a/__init__.py"].body if "_PUBLIC" in names_of(ast.Module([node])))
    for name, module in ast.literal_eval(offered).items():
        assert name in names_of(trees()[f"{module.replace('.', '/')}.py"]), (name, module)


IDENTIFIER = re.compile(r"`(_?[A-Za-z][A-Za-z0-9_]*_[A-Za-z0-9_]*|[A-Z][a-z]+[A-Z]\w*)(?:\(\))?`")
