"""Who may import whom among the package, its tests, its campaigns and what the two share."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[1]
RUNNER = "benchmarks.campaigns"  # of the campaigns, no campaign itself: it is tested
FOREIGN = {
    "er3a": {"testing", "tests", "benchmarks"},
    "testing": {"tests", "benchmarks"},
    "tests": {"benchmarks"},
    "benchmarks": {"tests"},
}


def imported(path: Path) -> set[str]:
    """The top-level packages that a file imports."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    modules = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    modules += [node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module]
    return {module.partition(".")[0] for module in modules if module != RUNNER}


@pytest.mark.parametrize("room", FOREIGN)
def test_a_room_imports_nothing_from_those_above_it(room):
    files = list((ROOT / room).rglob("*.py"))
    assert files
    assert [path.name for path in files if imported(path) & FOREIGN[room]] == []


def test_campaigns_are_imported_by_their_full_names():
    campaigns = {path.stem for path in (ROOT / "benchmarks").glob("*.py")}
    files = [path for room in FOREIGN for path in (ROOT / room).rglob("*.py")]
    assert [path.name for path in files if imported(path) & campaigns] == []
