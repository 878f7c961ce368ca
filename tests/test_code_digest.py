"""The code digest changes with what a module uses, and with nothing else; so does the folder of compiled kernels."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import er3a
from er3a.pipeline.code_digest import code_digest, imported_names

PACKAGE = Path(er3a.__file__).parent


class Copy:
    """A copy of the package, imported by processes of its own."""

    def __init__(self, folder: Path):
        self.folder = folder
        shutil.copytree(PACKAGE, folder / "er3a", ignore=shutil.ignore_patterns("__pycache__"))

    def write(self, path: str, text: str) -> None:
        file = self.folder / "er3a" / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")

    def append(self, path: str, text: str = "\n# changed\n") -> None:
        with (self.folder / "er3a" / path).open("a", encoding="utf-8") as file:
            file.write(text)

    def run(self, code: str) -> str:
        environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
        environment |= {"PYTHONPATH": str(self.folder), "XDG_CACHE_HOME": str(self.folder / "cache")}
        # Python takes a module for unchanged if size and second of change are the same, which they are in a test.
        environment["PYTHONDONTWRITEBYTECODE"] = "1"
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=self.folder, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    def digests(self, *modules: str) -> list[str]:
        head = "from er3a.pipeline.code_digest import code_digest\n"
        code = head + f"for name in {modules}: print(code_digest('er3a.' + name))"
        return self.run(code).split()


def package_with_a_stage(folder: Path) -> Copy:
    """A copy with a stage of its own: compute uses the forward kinematics, the report the page."""
    copy = Copy(folder)
    copy.write("pipeline/stages/made/compute.py", "from er3a.kinematics.forward import forward\n")
    copy.write(
        "pipeline/stages/made/report.py",
        "from er3a.pipeline.viewing.page import Picture\nimport er3a.pipeline.stages.made.parts\n",
    )
    copy.write("pipeline/stages/made/parts.py", "from er3a.kinematics import chain\n")
    copy.write("pipeline/stages/made/report.html.j2", "a template")
    copy.write("pipeline/stages/made/script.js", "a script")
    return copy


MADE = ("pipeline.stages.made.compute", "pipeline.stages.made.report")


@pytest.fixture
def package(tmp_path: Path) -> Copy:
    return package_with_a_stage(tmp_path)


@pytest.fixture(scope="module")
def before(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Digests of the made stage in an unchanged copy."""
    return package_with_a_stage(tmp_path_factory.mktemp("unchanged")).digests(*MADE)


# Of an edited file, whether it changes the digests of the made stage's compute and report.
EDITS = {
    "pipeline/stages/made/compute.py": (True, False),
    "numerics/jit.py": (True, True),
    "robots/robot.py": (True, True),
    "kinematics/chain.py": (True, True),
    "pipeline/stages/made/parts.py": (False, True),
    "pipeline/stages/made/report.html.j2": (False, True),
    "pipeline/viewing/base.html.j2": (False, True),
    "pipeline/viewing/style.css": (False, True),
    "pipeline/stages/made/script.js": (False, True),
    "workspace/general_proof.py": (False, False),
    "programs/syntax.py": (False, False),
    "pipeline/stages/workspace/report.html.j2": (False, False),
    "pipeline/stages/workspace/compute.py": (False, False),
    "pipeline/cli.py": (False, False),
    "kinematics/__init__.py": (False, False),
}
AFTER_EACH_EDIT = f"""
import os
from pathlib import Path
from er3a.pipeline.code_digest import code_digest
for path in {tuple(EDITS)}:
    file = Path("er3a", path)
    content = file.read_bytes()
    file.write_bytes(content + b"\\n# changed\\n")
    if os.fork() == 0:  # digests are kept as long as a process lives
        print(*(code_digest("er3a." + module) for module in {MADE}), flush=True)
        os._exit(0)
    os.wait()
    file.write_bytes(content)
"""


def test_digest_changes_with_what_is_used(package, before):
    after = [line.split() for line in package.run(AFTER_EACH_EDIT).splitlines()]
    changed = [tuple(old != new for old, new in zip(before, each, strict=True)) for each in after]
    assert dict(zip(EDITS, changed, strict=True)) == EDITS


def test_digest_is_that_of_the_content_not_of_the_place(package):
    assert package.digests("kinematics.forward", "pipeline.study") == [
        code_digest("er3a.kinematics.forward"),
        code_digest("er3a.pipeline.study"),
    ]


def test_packages_that_stand_beside_the_package_do_not_count(package, before):
    """As where it is installed: every library that it imports has a folder or file there."""
    package.write("../neighbour.py", "from odd import *\n")
    package.write("../neighbours/inner.py", "import neighbour\n")
    package.append("pipeline/stages/made/compute.py", "import neighbour\nfrom neighbours import inner\n")
    importing = package.digests(*MADE)
    package.append("../neighbour.py")
    package.append("../neighbours/inner.py")
    assert package.digests(*MADE) == importing
    assert importing[0] != before[0]


def test_a_new_template_changes_the_report_only(package, before):
    package.write("pipeline/stages/made/extra.html.j2", "more")
    after = package.digests(*MADE)
    assert before[0] == after[0]
    assert before[1] != after[1]


def test_moving_code_to_another_module_changes_the_digest(package, before):
    package.write("pipeline/stages/made/parts.py", "from er3a.pipeline.stages.made import more\n")
    package.write("pipeline/stages/made/more.py", "from er3a.kinematics import chain\n")
    assert package.digests(*MADE)[1] != before[1]


def test_circular_imports_end(package):
    package.write("pipeline/stages/made/more.py", "from er3a.pipeline.stages.made import compute\n")
    package.write("pipeline/stages/made/compute.py", "from er3a.pipeline.stages.made import more\n")
    assert len(package.digests("pipeline.stages.made.compute")[0]) == 64


WORDINGS = """
from importlib import import_module
from er3a.pipeline import language
from er3a.pipeline.messages.say import sentence
from er3a.pipeline.stages.registry import STAGES
for stage in STAGES.values():
    print(stage.digest("compute"), stage.digest("report"))
import_module(STAGES["workspace"].messages)
for name in language.LANGUAGES:
    language.use(name)
    print(sentence("workspace.flat"))
"""


@pytest.mark.long
def test_another_wording_of_a_verdict_changes_pages_but_no_numbers_and_keeps_its_translation(package):
    before = package.run(WORDINGS).splitlines()
    words = package.folder / "er3a/pipeline/messages/workspace.py"
    source = words.read_text(encoding="utf-8")
    reworded = source.replace("The tool point moves on a line or not at all", "The tool point stays on a line")
    words.write_text(reworded, encoding="utf-8")
    after = package.run(WORDINGS).splitlines()
    *digests, english, chinese = zip(before, after, strict=True)
    pairs = [list(zip(*map(str.split, stage), strict=True)) for stage in digests]
    assert [old == new for (old, new), _ in pairs] == [True] * len(pairs)
    order = package.run("from er3a.pipeline.stages.registry import STAGES; print(*STAGES)").split()
    assert "workspace" in [name for name, (_, (old, new)) in zip(order, pairs, strict=True) if old != new]
    assert english[1].startswith("The tool point stays on a line")
    assert chinese[0] == chinese[1]
    assert not chinese[1].isascii()


@pytest.mark.long
def test_no_stage_s_numbers_depend_on_sentences(package):
    ask = "from er3a.pipeline.stages.registry import STAGES\n"
    ask += "for stage in STAGES.values(): print(stage.name, *map(stage.digest, ('compute', 'report')))"
    before = package.run(ask).splitlines()
    for path in (package.folder / "er3a/pipeline/messages").glob("*.py"):
        if path.stem not in ("language", "__init__"):
            package.append(f"pipeline/messages/{path.name}")
    for old, new in zip(before, package.run(ask).splitlines(), strict=True):
        (_, *numbers), (_, *numbers_after) = old.split(), new.split()
        assert (numbers[0] == numbers_after[0], numbers[1] == numbers_after[1]) == (True, False), old


def test_unknown_module_is_refused():
    with pytest.raises(ModuleNotFoundError, match=r"er3a has no module 'er3a\.pipeline\.stages\.typo\.compute'"):
        code_digest("er3a.pipeline.stages.typo.compute")


@pytest.mark.long
def test_imports_are_read_as_a_parser_reads_them():
    for path in PACKAGE.rglob("*.py"):
        parsed: set[str] = set()
        for node in ast.walk(ast.parse(path.read_bytes())):
            if isinstance(node, ast.Import):
                parsed |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module != "er3a":
                parsed |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        assert parsed <= set(imported_names(path)), path
