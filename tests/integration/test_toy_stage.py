"""A new stage is a folder and a line in the registry: rules, study keys, results, documents and the index follow."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys

import pytest

from testing.small_study import CALLS, STUDY

pytestmark = pytest.mark.long

FILES = {
    "pipeline/stages/toy/__init__.py": '"""How long the arm is."""\n',
    "pipeline/stages/toy/entry.py": '''"""The stage in the registry."""
from er3a.finding import fact
from er3a.files.yaml_file import StrictModel
from er3a.pipeline.stages.stage import Stage

class ToySettings(StrictModel):
    """``factor``: how many arms in a row."""
    factor: int = 2

def applies(robot):
    return fact("toy.too_long", length_m=float(robot.a.max())) if robot.a.max() > 0.4 else None

STAGE = Stage(name="toy", title="toy", question="How long?", settings={"toy": ToySettings}, views=("report",),
              applies=applies)
''',
    "pipeline/stages/toy/model.py": '''"""What the stage finds."""
from er3a.finding import Finding
from er3a.pipeline.results import Results, Summary, Verdict
from er3a.numerics.arrays import Reals
from er3a.pipeline.tables import Table, column

class ToySummary(Summary):
    """Nothing more."""

class Lengths(Table):
    """Each length."""
    a_m: Reals = column("length of a link")

class ToyResults(Results):
    """With a table."""

    summary: ToySummary
    lengths: Lengths

RESULTS = ToyResults
''',
    "pipeline/stages/toy/compute.py": '''"""Adds lengths."""
from er3a.finding import fact
from er3a.pipeline.results import Figure, Verdict
from er3a.pipeline.scope import Coverage
from er3a.pipeline.stages.toy.entry import ToySettings
from er3a.pipeline.stages.toy.model import Lengths, ToyResults, ToySummary

def compute(study, name):
    a = study.robot(name).a * study.section(ToySettings).factor
    whole = float(a.sum())
    if not whole:
        raise ZeroDivisionError("no such arm")
    made = (Coverage("torque", 1, 1),)
    summary = ToySummary(Verdict("pass", fact("toy.long", length_m=whole)), (Figure("sum", whole, "m"),), checked=made)
    return ToyResults(summary, Lengths(a))
''',
    "pipeline/stages/toy/page/__init__.py": '"""Its page."""\n',
    "pipeline/stages/toy/page/report.py": '''"""The page."""
from er3a.pipeline.viewing.answer import Answer
from er3a.pipeline.viewing.page import render_stage

def report(study, stored, output):
    """Write it."""
    render_stage(study, stored, output, Answer("Long enough."))
''',
    "pipeline/stages/toy/page/report.html.j2": '{% extends "base.html.j2" %}\n',
    "pipeline/messages/toy.py": '''"""The verdict, and words."""
from er3a.pipeline.messages.say import texts

KEY_FIGURES = {"sum": "All lengths"}
TEXTS = texts(
    {
        "toy.too_long": "A link of {length_m:.2f} m is too long.",
        "toy.long": "The arm is {length_m:.2f} m long.",
    }
)
''',
}


@pytest.fixture(scope="module")
def with_toy(fresh_project, small_study):
    """A copy of the project with the small study's results, and a fifth stage computed for every robot."""
    project = fresh_project("toy")
    package = project.folder / "er3a"
    for path, text in FILES.items():
        (package / path).parent.mkdir(parents=True, exist_ok=True)
        (package / path).write_text(text, encoding="utf-8")
    registry = package / "pipeline/stages/registry.py"
    text = registry.read_text(encoding="utf-8")
    text = text.replace("\nSTAGES:", "from er3a.pipeline.stages.toy.entry import STAGE as TOY\n\nSTAGES:", 1)
    registry.write_text(text.replace("DYNAMICS, VISION)", "DYNAMICS, VISION, TOY)"), encoding="utf-8")
    study = project.folder / STUDY
    text = study.read_text(encoding="utf-8").replace("stages: [validation,", "stages: [toy, validation,")
    study.write_text(text + "\ntoy: {factor: 3}\n", encoding="utf-8")
    for robot in project.robots:
        for stage in (small_study.folder / "results" / robot).iterdir():
            shutil.copytree(stage, project.folder / "results" / robot / stage.name)
    jobs = [job for robot in project.robots for job in (("compute", "toy", robot), ("views", robot, "toy"))]
    er3a(project, *jobs, ("index",))
    return project


def er3a(project, *commands: tuple[str, ...], folder: str = ".") -> str:
    """Call the copy's command line, in one process."""
    command = [sys.executable, "-c", CALLS, json.dumps(commands)]
    environment = project.environment() | {"ER3A_STUDY": STUDY}
    done = subprocess.run(
        command, cwd=project.folder / folder, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stderr


def test_its_results_are_written_and_read(with_toy):
    summary = json.loads((with_toy.folder / "results/er3_600/toy/summary.json").read_text(encoding="utf-8"))
    assert summary["verdict"] == {
        "status": "pass",
        "code": "toy.long",
        "params": {"length_m": 3 * 0.332},
    }
    assert summary["provenance"]["config"]["toy"] == {"factor": 3}
    page = (with_toy.folder / "reports/er3_600/toy.html").read_text(encoding="utf-8")
    assert "All lengths" in page
    assert "The arm is 1.00 m long." in page
    assert "What was checked" in page
    assert "collisions with the tray" not in page, "it looks for none"


def test_a_robot_for_which_it_fails_has_a_reason_and_the_index_stands(with_toy):
    folder, reason = with_toy.folder, "ZeroDivisionError: no such arm"
    shutil.copytree(folder / "results", folder / "other/results")
    study = (folder / STUDY).read_text(encoding="utf-8").replace("factor: 3", "factor: 0")
    (folder / "other.yaml").write_text(study, encoding="utf-8")
    (folder / "other/data").symlink_to(folder / "data")
    where = ("--study", "../other.yaml")
    verbs = ("compute", "toy", "er3_600", *where), ("views", "er3_600", "toy", *where), ("index", *where)
    told = er3a(with_toy, *verbs, folder="other")
    assert f"note: er3_600, toy: Not computed: {reason}\n" in told
    failed = json.loads((folder / "other/results/er3_600/toy/summary.json").read_text(encoding="utf-8"))
    assert failed["verdict"]["status"] == "not_computed"
    assert failed["verdict"]["params"] == {"reason": reason}
    for page in ("er3_600/toy.html", "index.html"):
        assert reason in (folder / "other/reports" / page).read_text(encoding="utf-8")


def test_a_robot_to_which_it_does_not_apply_has_a_reason_of_its_own(with_toy):
    summary = with_toy.folder / "results/er3a_c60_article/toy/summary.json"
    verdict = json.loads(summary.read_text(encoding="utf-8"))["verdict"]
    assert (verdict["status"], verdict["code"]) == ("not_computed", "toy.too_long")
    assert verdict["params"] == {"length_m": 0.65}
    page = (with_toy.folder / "reports/er3a_c60_article/toy.html").read_text(encoding="utf-8")
    assert "A link of 0.65 m is too long." in page


def test_the_index_shows_it(with_toy):
    index = (with_toy.folder / "reports/index.html").read_text(encoding="utf-8")
    assert "A link of 0.65 m is too long." in index
    assert "How long?" in index
    assert "The arm is 1.00 m long." in index


def test_the_workflow_has_rules_for_it_and_none_for_the_recording_it_lacks(with_toy):
    told = with_toy.snakemake("--dry-run", "--forceall", "--nocolor").stdout
    planned = set(re.findall(r"^Job \d+: (.+)$", told, flags=re.MULTILINE))
    of_toy = {job.partition(":")[0] for job in planned if re.search(r": compute .*\btoy\b", job)}
    assert of_toy == {*with_toy.robots}
    assert "er3_600: write pages and recordings" in with_toy.planned("--forceall", "reports/er3_600/toy.html")
    assert with_toy.snakemake("--dry-run", "reports/er3_600/toy.rrd", check=False).returncode != 0
