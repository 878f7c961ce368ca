"""The wheel, as a stranger has it: installed in an environment of its own, used in an empty folder."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path

import pytest

from er3a import __version__
from er3a.files.robot_library import load_robot
from er3a.formats.urdf import export_urdf
from testing.processes import run
from testing.small_study import CALLS, ROOT, on_least_budgets

ROBOTS_BLOCK = re.compile(r"^robots:\n(?:[ #].*\n|\n)+", re.MULTILINE)
DH = """joint,a_mm,alpha_deg,d_mm,offset_deg,direction,lower_deg,upper_deg,speed_deg_s
1,0,-90,400,0,1,-170,170,300
2,350,0,0,-90,1,-90,120,300
3,40,-90,0,0,1,-190,60,300
4,0,90,360,0,1,-180,180,400
5,0,-90,0,0,1,-120,120,400
6,0,0,80,0,1,-350,350,500
"""
STRANGER = {key: value for key, value in os.environ.items() if key not in {"PYTHONPATH", "VIRTUAL_ENV"}}
RUN, OTHERS = ("validation", "workspace"), ("collision", "inverse", "trajectory", "dynamics")
pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Path:
    """A folder with wheel and sdist."""
    folder = tmp_path_factory.mktemp("built")
    done = run([sys.executable, "-m", "hatchling", "build", "--directory", folder], cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def wheel(built) -> Path:
    (found,) = built.glob("*.whl")
    return found


def uv(*words: str | Path, **settings: str | Path) -> None:
    """Install something with all that it depends on, by its own metadata, in the versions of the lock."""
    command = [Path(sys.prefix, "bin/uv"), *words, "--quiet", "--constraints", ROOT / "requirements/run.txt"]
    done = run(command, env=STRANGER | {key: str(value) for key, value in settings.items()})
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def programs(wheel, tmp_path_factory) -> Path:
    """The folder of programs of an environment of its own, in which the wheel is installed with a study's needs."""
    place = tmp_path_factory.mktemp("fresh") / "venv"
    assert run([sys.executable, "-m", "venv", "--without-pip", place]).returncode == 0
    uv("pip", "install", "--python", place / "bin/python", f"{wheel}[study]")
    return place / "bin"


@pytest.fixture(scope="module")
def er3a(programs):
    """Calls the er3a of the wheel in a folder."""

    def call(folder: Path, *words: str | Path) -> subprocess.CompletedProcess[str]:
        return run([programs / "er3a", *words], cwd=folder, env=STRANGER)

    return call


def test_a_wheel_holds_what_a_study_needs(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert f"er3a-{__version__}-" in wheel.name
    for folder in ("data", "workflow", "profiles"):
        files = [path for path in (ROOT / folder).rglob("*") if path.is_file() and "__pycache__" not in path.parts]
        assert {f"er3a/shipped/{path.relative_to(ROOT).as_posix()}" for path in files} <= names
    needed = ("Snakefile", "config/study.schema.json", "config/config.yaml", "requirements/run.txt")
    assert {f"er3a/shipped/{name}" for name in needed} | {"er3a/py.typed"} <= names
    assert any(name.endswith("LC_MESSAGES/er3a.po") for name in names)
    assert [name for name in names if name.startswith(("tests/", "testing/", "benchmarks/"))] == []


@pytest.fixture(scope="module")
def core(built, tmp_path_factory) -> Path:
    """The environment that uv makes of the sdist as a tool, without extras."""
    (sdist,) = built.glob("*.tar.gz")
    place = tmp_path_factory.mktemp("tools")
    uv("tool", "install", "--python", sys.executable, sdist, UV_TOOL_DIR=place, UV_TOOL_BIN_DIR=place / "bin")
    return place / "er3a"


def test_an_sdist_installed_as_a_tool_is_what_the_wheel_holds(core, wheel):
    (packages,) = core.glob("lib/python*/site-packages")
    installed = {
        path.relative_to(packages).as_posix(): path.read_bytes()
        for path in (packages / "er3a").rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }
    with zipfile.ZipFile(wheel) as archive:
        held = {name: archive.read(name) for name in archive.namelist() if name.startswith("er3a/")}
    assert installed == held


def test_the_core_is_light_and_answers_without_extras(core, wheel, tmp_path):
    assert wheel.name.endswith("-py3-none-any.whl")
    assert wheel.stat().st_size <= 3_000_000
    files = {(each.stat().st_ino, each.stat().st_size) for each in core.rglob("*") if each.is_file()}
    assert sum(size for _, size in files) <= 350e6
    (tmp_path / "table.csv").write_text(DH, encoding="utf-8")
    (tmp_path / "one.src").write_text("DEF p( )\nPTP {A1 10, A2 -20, A3 -20, A4 0, A5 -40, A6 0}\nEND\n")
    for code, words in (
        (1, ("compare", "table.csv", "irb120")),
        (0, ("export-urdf", "er3_600", "--output", "a.urdf")),
        (0, ("teach", "table.csv")),
        (0, ("check-program", "one.src", "--robot", "er3_600")),  # of one motion: kernels run as Python
        (2, ("run",)),
    ):
        done = run([core.parent / "bin/er3a", *words], cwd=tmp_path, env=STRANGER)
        assert done.returncode == code, done.stderr
    assert "er3a[study]" in done.stderr


@pytest.fixture
def new_cell(er3a, tmp_path):
    """Makes a study of an arm in an empty folder, with the least budgets."""
    (tmp_path / "Odd arm.urdf").write_text(export_urdf(load_robot("er3_600").replace(envelopes=())), encoding="utf-8")

    def make(*given: str) -> Path:
        made = er3a(tmp_path, "new", "my cell", *given)
        assert made.returncode == 0, made.stderr
        written = [line.removesuffix(": written") for line in made.stdout.splitlines() if line.endswith(": written")]
        checked = er3a(tmp_path, "check", *(file for file in written if file.endswith(".yaml")))
        assert checked.returncode == 0, checked.stderr
        study = tmp_path / "my cell/config/config.yaml"
        study.write_text(_on_small_budgets(study.read_text(encoding="utf-8")), encoding="utf-8")
        return tmp_path / "my cell"

    return make


def test_a_study_from_nothing_to_its_reports(er3a, programs, new_cell):
    """Two stages as a run makes them; the others, which need more libraries, in one process that loads them once."""
    cell = new_cell("--urdf", "Odd arm.urdf")
    study = cell / "config/config.yaml"
    whole = study.read_text(encoding="utf-8")
    study.write_text(re.sub(r"^(  odd_arm:\n)", f"\\1    stages: [{', '.join(RUN)}]\n", whole, flags=re.M), "utf-8")
    done = er3a(cell, "run", "--cores", "2")
    assert done.returncode == 0, done.stderr
    pages = {path.relative_to(cell / "reports").as_posix() for path in (cell / "reports").rglob("*.html")}
    assert pages == {"index.html", *(f"odd_arm/{page}.html" for page in (*RUN, "teach"))}
    verdicts = {each["stage"]: each["status"] for each in json.loads(er3a(cell, "verdicts", "--json").stdout)}
    assert verdicts.keys() == set(RUN)
    assert verdicts["validation"] == "no_reference"
    cases = ElementTree.parse(cell / "reports/junit.xml").findall(".//testcase")
    assert [case.get("name") for case in cases] == list(RUN)
    foot = (cell / "reports/odd_arm/validation.html").read_text(encoding="utf-8")
    assert "er3a run --study config/config.yaml reports/odd_arm/validation.html" in foot
    assert str(cell) not in foot
    study.write_text(whole, encoding="utf-8")
    jobs = [["compute", stage, "odd_arm"] for stage in OTHERS] + [["views", "odd_arm", *OTHERS]]
    done = run([programs / "python", "-Pc", CALLS, json.dumps(jobs)], cwd=cell, env=STRANGER)
    assert done.returncode == 0, done.stderr
    for stage in OTHERS:
        summary = json.loads((cell / f"results/odd_arm/{stage}/summary.json").read_text(encoding="utf-8"))
        status = summary["verdict"]["status"]
        assert status == "pass" if stage in ("inverse", "trajectory") else status != "not_computed", stage
        assert (cell / f"reports/odd_arm/{stage}.html").is_file()


def test_a_robot_of_the_package_has_its_references(programs, tmp_path):
    asked = "from er3a import load_references, load_robot as robot; print(load_references('er3_600', robot('er3_600')))"
    done = run([programs / "python", "-c", asked], cwd=tmp_path, env=STRANGER)
    assert done.returncode == 0, done.stderr
    assert "key_poses" in done.stdout


def _on_small_budgets(written: str) -> str:
    """The small study's sections on the least budgets, with the robot and the scene of a new study."""
    small = on_least_budgets((ROOT / "config/small.yaml").read_text(encoding="utf-8"))
    robots = ROBOTS_BLOCK.search(written)
    assert robots is not None
    return re.sub(r"data/scenes/\w+\.yaml", "data/scenes/cell.yaml", ROBOTS_BLOCK.sub(robots[0], small, count=1))
