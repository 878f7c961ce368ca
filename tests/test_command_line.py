"""Manners of the command line: exit codes, what goes where, JSON, completion, colours."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import er3a
from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward
from er3a.pipeline import program_reports, run_study, verdicts
from er3a.pipeline.progress import shown_work, time_left
from er3a.pipeline.study import load_study
from er3a.pipeline.verdicts import StageVerdict
from testing import processes
from testing.small_study import STUDY

ROOT = Path(__file__).resolve().parents[1]
FIRST_FIVE = ("new", "check", "run", "verdicts", "view")


def test_a_bare_call_shows_the_five_commands_that_a_newcomer_needs(call):
    done = call()
    assert done.returncode == 0
    shown = [line.split()[1] for line in done.stdout.splitlines() if line.startswith("  er3a ")]
    assert tuple(shown) == FIRST_FIVE
    assert "\x1b" not in done.stdout


def test_the_version_stands_in_one_place(call):
    done = call("--version")
    assert (done.returncode, done.stdout) == (0, f"er3a {er3a.__version__}\n")
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert 'dynamic = ["version"]' in project
    assert er3a.__version__ not in project


def test_all_commands_have_help(call):
    shown = call("--help").stdout
    assert shown.index("Studies") < shown.index("Robot files") < shown.index("Single jobs")
    assert "\x1b" not in shown


@pytest.mark.long
@pytest.mark.parametrize(
    ("typed", "offered"),
    [("er3a ch", "check"), ("er3a compute val", "validation"), ("er3a views er3_", "er3_600")],
)
def test_completion_knows_commands_stages_and_robots(typed, offered):
    words = {"COMP_WORDS": typed, "COMP_CWORD": str(len(typed.split()) - 1)}
    done = subprocess.run(
        [sys.executable, "-c", "from er3a.pipeline.cli import app; app(prog_name='er3a')"],
        cwd=ROOT,
        env=os.environ | words | {"_ER3A_COMPLETE": "complete_bash"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert offered in done.stdout.split()


def test_a_file_that_would_be_read_as_an_option_is_refused(call, tmp_path):
    (tmp_path / "--scene=evil.src").write_text("", encoding="utf-8")
    done = call("check-program", "--scene=evil.src", "--robot", "er3_600", folder=tmp_path)
    assert done.returncode == 2
    assert "--scene=evil.src is a file" in done.stderr
    done = call("check", "--", "--scene=evil.src", folder=tmp_path)
    assert done.stderr.startswith("error: --scene=evil.src: ")


@pytest.mark.long
def test_a_run_says_what_was_edited_meanwhile(call, monkeypatch):
    verdict = StageVerdict("arm", "workspace", "pass", "code", "text", outdated=("data/robots/arm.yaml",))
    monkeypatch.setattr(run_study, "run_study", lambda *_: True)
    monkeypatch.setattr(verdicts, "read_verdicts", lambda *_: [verdict])
    done = call("run")
    assert (done.returncode, done.stderr) == (1, "note: arm, workspace (pass): text\n")
    assert call("run", "workspace").returncode == 1
    assert call("run", "validation").returncode == 0  # another stage was asked for
    assert call("run", "results/other/workspace/summary.json").returncode == 0


@pytest.mark.long
def test_reading_a_program_ends_in_its_time_and_a_line_of_it_is_not_repeated_whole(call, tmp_path, monkeypatch):
    long = tmp_path / "long.src"
    long.write_text(f"DEF p( )\nPTP {{A1 {'1' * 900_000}}}\n{'X' * 900_000}\nEND\n", encoding="utf-8")
    started = time.monotonic()
    done = call("check-program", long, "--robot", "er3_600", "--verdicts", "--seconds", 60)
    assert time.monotonic() - started < 60
    assert max(map(len, (done.stdout + done.stderr).splitlines())) < 1_000
    monkeypatch.setattr(program_reports, "read_program", lambda _: time.sleep(60))
    done = call("check-program", long, "--robot", "er3_600", "--seconds", 1)
    assert (done.returncode, done.stdout.count("is not read after 1 s")) == (2, 1)


def test_check_for_programs(call, tmp_path):
    bad = tmp_path / "bad.yaml"
    bad.write_text("kind: robot\nname: bad\n")
    done = call("check", "data/robots/er3_600.yaml", bad, "--json")
    first, second = json.loads(done.stdout)
    assert done.returncode == 2
    assert first == {"file": "data/robots/er3_600.yaml", "in_order": True, "kind": "a robot"}
    assert second["in_order"] is False
    assert second["problem"] == "missing"
    assert done.stderr.startswith(f"error: {bad}: ")
    (tmp_path / "odd.src").write_text("DEF odd()\nFOO BAR\nPTP {A1 400}\nEND\n")  # readable, and no more
    told = "what it does, for which see er3a check-program"
    assert json.loads(call("check", tmp_path / "odd.src", "--json").stdout)[0]["not_examined"] == [told]
    assert call("check", tmp_path / "odd.src").stdout.endswith(f"a robot program, in order; not examined: {told}\n")


def test_notes_go_to_standard_error_and_results_to_standard_output(call, tmp_path):
    urdf = tmp_path / "arm.urdf"
    assert call("export-urdf", "er3_600", "--output", urdf).returncode == 0
    text = urdf.read_text().replace("1.5707963267948966", "1.571", 1)
    urdf.write_text(text)
    done = call("import-urdf", urdf, "--output", tmp_path / "arm.yaml", "--snap", "--json")
    assert done.stderr.startswith("note: ")
    told = json.loads(done.stdout)
    assert told["output"] == str(tmp_path / "arm.yaml")
    assert told["misfit_mm"] < 1e-6
    assert len(told["notes"]) == 1


@pytest.mark.long
def test_calibration_for_programs(call, tmp_path):
    robot = load_robot("er3_600")
    random = np.random.default_rng(1)
    q = random.uniform(np.maximum(robot.lower, -1.5), np.minimum(robot.upper, 1.5), (40, 6))
    longer = robot.replace(a=robot.a + np.array([0, 0.0004, 0, 0, 0, 0]))
    table = tmp_path / "measured.csv"
    header = [*(f"q{joint}_deg" for joint in range(1, 7)), "point", "x_mm", "y_mm", "z_mm", "standard_deviation_mm"]
    rows = [
        [*map(repr, np.degrees(angles).tolist()), "flange", *map(repr, (T[:3, 3] * 1000).tolist()), "0.05"]
        for angles, T in zip(q, forward(longer, q))
    ]
    table.write_text("\n".join(",".join(row) for row in (header, *rows)), encoding="utf-8")
    done = call("calibrate", "er3_600", table, "--output", tmp_path / "new.yaml", "--json")
    told = json.loads(done.stdout)
    (upper_arm,) = (entry for entry in told["entries"] if entry["name"] == "a2")
    assert abs(upper_arm["correction"] - 0.4) < 0.01
    assert told["fits"]
    assert Path(told["output"]).is_file()


def test_a_program_reads_verdicts_and_continuous_integration_an_exit_code(call, small_study):
    study = small_study.folder / "config/small.yaml"

    def verdicts(*words: str) -> subprocess.CompletedProcess[str]:
        return call("verdicts", "--study", study, *words, folder=small_study.folder)

    found = json.loads(verdicts("--json").stdout)
    assert {each["robot"] for each in found} == set(small_study.robots)
    told = {"robot", "stage", "status", "code", "text", "expected", "demonstrations", "outdated"}
    told |= {"checked", "not_checked", "assumed", "said_by", "answer", "foundation"}
    assert set(found[0]) == told
    statuses = {each["status"] for each in found}
    assert verdicts("--fail-on", "fail").returncode == int("fail" in statuses)
    done = verdicts("--fail-on", "caution")
    assert done.returncode == int(bool({"fail", "caution"} & statuses))
    meant = [each for each in found if each["expected"] is not None and each["expected"] == each["status"]]
    skipped = statuses - {"pass", "caution", "fail"}
    counted = [each for each in found if each["status"] in ("fail", "caution") and each not in meant]
    assert done.stderr.count("note: ") == len(counted) + bool(meant) + bool(skipped)
    assert "\x1b" not in done.stdout
    assert verdicts("--fail-on", "never").returncode == 2


@pytest.mark.long
def test_a_second_run_does_nothing_and_ends_with_1_for_findings_and_with_2_for_an_input(call, small_study):
    cases = list(ElementTree.parse(small_study.folder / "reports/junit.xml").iter("testcase"))
    stages = load_study(small_study.folder / STUDY).stages
    assert len(cases) == sum(len(stages(robot)) for robot in small_study.robots)
    found = [case for case in cases if "checked: " in case.findtext("system-out", "")]
    assert found, "the small study should have something to tell"
    command = [sys.executable, "-m", "er3a", "run", "--study", STUDY, "--fail-on", "caution"]
    done = processes.run(command, cwd=small_study.folder, env=small_study.environment() | {"NO_COLOR": "1"})
    assert done.returncode == 1, done.stderr
    assert "Nothing to be done" in done.stdout + done.stderr
    assert "\x1b" not in done.stdout + done.stderr
    done = call("run", "--study", "nowhere.yaml", "--fail-on", "fail")
    assert (done.returncode, done.stderr) == (2, "error: nowhere.yaml: there is no such file. Check the path\n")


def test_long_work_says_what_it_does_and_for_how_long(capsys, monkeypatch):
    monkeypatch.setattr("er3a.pipeline.progress.EVERY_S", 0.01)
    shown = ""
    with shown_work("first") as at:
        at("then")
        while "then (0 s)" not in shown:
            shown += capsys.readouterr().err
    capsys.readouterr()


def test_compiling_takes_none_of_the_time(monkeypatch):
    compiled = [5.0]
    monkeypatch.setattr("er3a.numerics.jit.compile_seconds", lambda: sum(compiled))
    monkeypatch.setattr("er3a.pipeline.progress.time", SimpleNamespace(monotonic=lambda: 100.0 + sum(compiled)))
    holds = time_left(30.0)
    compiled.append(40.0)
    assert holds()
