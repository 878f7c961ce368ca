"""The house rules that can be read off the source: short functions, few arguments, names that stand for one thing."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LONGEST_FUNCTION = 80
MOST_POSITIONAL = 6
IN_EVERY_STAGE = {"entry", "model", "compute", "record", "report"}
MESSAGES = "er3a/pipeline/messages"  # its modules are named after those that they speak for
KERNELS = {"kernel", "inner_kernel"}


@cache
def trees() -> dict[str, ast.Module]:
    """All modules of the package, parsed, by their paths."""
    paths = sorted((ROOT / "er3a").rglob("*.py"))
    return {path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8")) for path in paths}


@cache
def definitions() -> tuple[tuple[str, ast.FunctionDef | ast.ClassDef], ...]:
    """All functions and classes of the package, with the place that each begins at."""
    kinds = (ast.FunctionDef, ast.ClassDef)
    walked = ((path, node) for path, tree in trees().items() for node in ast.walk(tree) if isinstance(node, kinds))
    return tuple((f"{path}:{node.lineno}", node) for path, node in walked)


def functions() -> Iterator[tuple[str, ast.FunctionDef]]:
    """All functions that are no kernels, with place and name."""
    for place, node in definitions():
        if isinstance(node, ast.FunctionDef) and not KERNELS & {
            getattr(each, "id", "") for each in node.decorator_list
        }:
            yield f"{place} {node.name}", node


def several(places: dict[str, set[str]]) -> dict[str, set[str]]:
    """Those names that stand in more than one place."""
    return {name: where for name, where in places.items() if len(where) > 1}


def test_the_rules_are_read_off_the_whole_package():
    assert len(trees()) > 200
    assert len(list(functions())) > 1000


def test_no_function_is_long():
    long = [place for place, function in functions() if function.end_lineno - function.lineno >= LONGEST_FUNCTION]
    assert long == []


def test_no_function_takes_many_positional_arguments():
    taken = {place: [each.arg for each in (*node.args.posonlyargs, *node.args.args)] for place, node in functions()}
    many = {place for place, names in taken.items() if len({*names} - {"self", "cls"}) > MOST_POSITIONAL}
    assert many == set()


def test_no_two_modules_of_different_rooms_share_a_name():
    places: dict[str, set[str]] = defaultdict(set)
    for path in map(Path, trees()):
        if path.parent.as_posix() != MESSAGES and path.stem not in {"__init__", *IN_EVERY_STAGE}:
            places[path.stem].add(path.as_posix())
    assert several(places) == {}


def test_stages_alone_have_the_modules_of_a_stage():
    contract = [Path(path) for path in trees() if Path(path).stem in IN_EVERY_STAGE]
    assert {path.parent.parent.as_posix() for path in contract} == {"er3a/pipeline/stages"}


def test_no_two_classes_share_a_name():
    places: dict[str, set[str]] = defaultdict(set)
    for place, node in definitions():
        if isinstance(node, ast.ClassDef):
            places[node.name].add(place)
    assert several(places) == {}
