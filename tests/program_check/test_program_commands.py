"""The commands about programs: lines, JSON, SARIF and exit codes of check-program; what program write refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from er3a.finding import fact
from er3a.pipeline import (
    cli,  # noqa: F401
    path_programs,
)
from er3a.pipeline.commands.options import app
from er3a.pipeline.path_programs import PathProgram
from er3a.pipeline.scope import Open
from er3a.programs.languages import execute, read_program

ROOT = Path(__file__).resolve().parents[2]
FAULTS = "data/programs/faults"
HOME = "0,-10,-10,0,-70,0"
SCENE = "data/scenes/table_and_post.yaml"


@pytest.fixture(autouse=True)
def in_the_root(monkeypatch):
    """Paths are those of the project."""
    monkeypatch.chdir(ROOT)


def run(*words: str):
    """A call of the command line."""
    return CliRunner().invoke(app, [*words])


def check(*words: str):
    """A call of check-program for the ER3A-C60."""
    return run("check-program", *words, "--robot", "er3a_c60", "--start", HOME)


def test_what_was_checked_is_said_once_and_findings_are_lines_as_compilers_print_them():
    done = check(f"{FAULTS}/outside_limits.src")
    assert done.exit_code == 1
    scope, *findings = done.stdout.splitlines()
    assert scope.startswith(f"{FAULTS}/outside_limits.src: 1 of 2 motions pass limits, reach, configuration, ")
    assert scope.endswith("; 1 fail (lines 9); not checked: scene (none given: --scene)")
    (found,) = findings
    assert found.startswith(f"{FAULTS}/outside_limits.src:9: error: J3 reaches 140.0°; upper limit 105°")
    assert found.endswith("[above_limit]")


@pytest.mark.long
def test_the_exit_code_follows_what_is_asked():
    assert check("data/programs/weld_seam.src").exit_code == 0
    assert check("data/programs/weld_seam.src", "--require", "scene,tool").exit_code == 1
    assert check("data/programs/weld_seam.src", "--require", "scene", "--scene", SCENE).exit_code == 0
    assert check(f"{FAULTS}/joint_jump.src").exit_code == 0
    assert check(f"{FAULTS}/joint_jump.src", "--fail-on", "caution").exit_code == 1
    assert check("data/programs/weld_seam.dat").exit_code == 2


def test_a_cause_is_one_line_and_what_was_accepted_is_none(tmp_path):
    moves = "\n".join(
        f"PTP {{A1 0,A2 -10,A3 {110 + i},A4 0,A5 -70,A6 0}}\nLIN {{X 400,Y XP{i},Z 400}}" for i in range(30)
    )
    (tmp_path / "a.src").write_text(f"DEF a( )\n{moves}\nEND\n")
    sarif = tmp_path / "found.sarif"
    done = check(str(tmp_path / "a.src"), "--sarif", str(sarif))
    assert done.exit_code == 1
    assert len(done.stdout.splitlines()) <= 11
    every = check(str(tmp_path / "a.src"), "--all")
    assert len(every.stdout.splitlines()) > 60
    again = check(str(tmp_path / "a.src"), "--baseline", str(sarif))
    assert "[above_limit]" not in again.stdout


def test_what_is_assumed_of_calls_and_values_is_followed(tmp_path):
    text = "def a():\n  movej([0,-0.17,-0.17,0,-1.22,0])\n  rq_move(5)\n  if part:\n"
    text += "    movej([0.1,-0.17,-0.17,0,-1.22,0])\n"
    (tmp_path / "a.script").write_text(text + "  end\nend\n")
    alone = json.loads(check(str(tmp_path / "a.script"), "--json").stdout)[0]
    assert [each["followed"] for each in alone["motions"]] == [True, False]
    words = ("--assume", "rq_*", "--assume", "part=TRUE", "--json")
    known = json.loads(check(str(tmp_path / "a.script"), *words).stdout)[0]
    assert [each["followed"] for each in known["motions"]] == [True, True]
    assert known["level"] in ("pass", "note")


def test_limits_and_links_that_nothing_is_known_of_are_no_pass(tmp_path):
    robot = yaml.safe_load(Path("data/robots/er3a_c60.yaml").read_text())
    robot["envelopes"]["capsules"] = robot["envelopes"]["capsules"][:2]
    (tmp_path / "er3a_c60.yaml").write_text(yaml.safe_dump(robot))
    words = ("check-program", "data/programs/weld_seam.src", "--robot", str(tmp_path / "er3a_c60.yaml"))
    done = run(*words, "--start", HOME, "--fail-on", "caution")
    assert "would pass" in done.stdout
    assert "Not fully checked: " in done.stderr
    assert done.exit_code == 1


def test_a_broken_program_names_its_line_and_others_are_checked(tmp_path):
    broken = tmp_path / "a.src"
    broken.write_text("DEF a( )\nLOOP\nEND\n")
    done = check(str(broken), f"{FAULTS}/outside_limits.src")
    assert done.exit_code == 2
    assert "a.src:2: error:" in done.stdout
    assert "[above_limit]" in done.stdout


def test_each_motion_has_a_line_on_request():
    done = check("data/programs/WELD_SEAM.XPL", "--verdicts")
    moves = [line for line in done.stdout.splitlines() if line.endswith("[motion]")]
    assert len(moves) == 26
    assert "(Main/mlin[23])" in done.stdout


@pytest.mark.long
def test_json_holds_verdicts_and_parameters():
    found = json.loads(check(f"{FAULTS}/zone_larger_than_segment.src", "--json").stdout)[0]
    assert found["level"] == "caution"
    assert [each["params"]["zone_mm"] for each in found["findings"]] == pytest.approx([80, 80])
    assert found["not_checked"] == ["scene"]
    assert [each["line"] for each in found["motions"]] == [8, 9, 11, 12, 13]
    assert [each["remedy"] for each in found["findings"]] == ["Make the zone 10.0 mm at most."] * 2
    assert [each["moment_s"] for each in found["findings"]] == [None, None]
    beyond = json.loads(check(f"{FAULTS}/outside_limits.src", "--json").stdout)[0]["findings"]
    moments = {each["code"]: each["moment_s"] for each in beyond}
    assert moments["above_limit"] > 0


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::er3a.errors.DoubtfulUnit")
def test_no_motion_passes_by_numbers_that_look_like_another_unit(tmp_path):
    scene, program = yaml.safe_load(Path(SCENE).read_text()), "data/programs/weld_seam.src"
    scene["boxes"][0]["rpy_deg"] = [0, 0, 1.5708]
    turned, confirmed = tmp_path / "turned.yaml", tmp_path / "confirmed.yaml"
    turned.write_text(yaml.safe_dump(scene))
    confirmed.write_text(yaml.safe_dump(scene | {"units_checked": True}))
    row = "0,-1.03,0.45,0,0.99,0"
    for file, scene_file, start, expected in (
        (program, str(turned), HOME, "turned.yaml: boxes[0].rpy_deg: [0, 0, 1.5708] deg"),
        (program, str(confirmed), HOME, ""),
        (program, SCENE, row, f"--start: [{row.replace(',', ', ')}] deg"),
        (program, SCENE, f"{row} deg", ""),
    ):
        words = ("check-program", file, "--robot", "er3a_c60", "--start", start, "--scene", scene_file)
        found = json.loads(run(*words, "--json").stdout)[0]
        named = [each["names"] for each in found["gaps"] if each["reason"] == "units"]
        assert [name.rpartition("/")[2] for names in named for name in names] == ([expected] if expected else [])
        assert not expected or found["level"] != "pass"
        assert not any(each["code"] == "not_understood" for each in found["findings"])


@pytest.mark.long
def test_sarif_has_rules_places_and_fingerprints_that_stay(tmp_path):
    def log(file: Path) -> dict:
        output = tmp_path / "found.sarif"
        check(str(file), "--sarif", str(output))
        return json.loads(output.read_text())

    text = (ROOT / FAULTS / "outside_limits.src").read_text()
    program = tmp_path / "a.src"
    program.write_text(text)
    first = log(program)
    program.write_text(text.replace("DEF", "&ACCESS RVP\n&REL 2\nDEF", 1))
    moved = log(program)
    assert first["version"] == "2.1.0"
    (run_of,) = first["runs"]
    rules = {rule["id"] for rule in run_of["tool"]["driver"]["rules"]}
    for result, other in zip(run_of["results"], moved["runs"][0]["results"], strict=True):
        assert result["ruleId"] in rules
        assert result["level"] in ("error", "warning", "note")
        place, later = (each["locations"][0]["physicalLocation"]["region"]["startLine"] for each in (result, other))
        assert later == place + 2 or place == 1
        assert result["partialFingerprints"] == other["partialFingerprints"]
        place = result["locations"][0]["physicalLocation"]["artifactLocation"]
        assert place["uri"].startswith("../")  # beside the folder that the command runs in
        assert place["uriBaseId"] in run_of["originalUriBaseIds"]
    relative = tmp_path / "b.sarif"
    check(f"{FAULTS}/outside_limits.src", "--sarif", str(relative))
    results = json.loads(relative.read_text())["runs"][0]["results"]
    uris = {each["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] for each in results}
    assert uris == {f"{FAULTS}/outside_limits.src"}


def test_frames_and_start_are_checked():
    assert "expected 6 joint values" in str(
        run("check-program", "x.src", "--robot", "er3a_c60", "--start", "1,2").exception
    )


@pytest.mark.long
def test_paths_are_written_and_unsafe_ones_refused(tmp_path):
    words = ("program", "write", "data/paths/er3a_c60.yaml", "--robot", "er3a_c60", "--language", "krl")
    done = run(*words, "--output", str(tmp_path), "--only", "line_clean", "--only", "line_limits")
    assert done.exit_code == 1
    assert {path.name for path in tmp_path.iterdir()} == {"line_clean.src", "line_clean.dat"}
    assert "not safe" in done.stderr
    assert run(*words, "--output", str(tmp_path), "--only", "line_limits", "--unsafe").exit_code == 0
    text = (tmp_path / "line_limits.src").read_text()
    assert "; er3a: NOT SAFE: the path line_limits leaves limits" in text
    assert "; er3a: Run no path or program on the arm until its table is confirmed." in text
    assert read_program(tmp_path / "line_clean.src").motions()


def test_a_joint_move_that_its_speeds_at_the_ends_bend_is_written_as_points_of_its_way(tmp_path):
    paths, ends = tmp_path / "paths.yaml", "start_deg: [0,-10,-10,0,-70,0], end_deg: [40,-10,-10,0,-70,0]"
    rates = "start_velocity_deg_s: [0,-40,0,0,0,0], end_velocity_deg_s: [{0},{1},0,0,0,0]"
    path = "  - {{name: {0}, title: P, kind: joint, samples: 60, duration_s: 3, {1}, {2}}}\n"
    straight = "end_velocity_deg_s: [10,0,0,0,0,0]"
    paths.write_text(
        f"kind: paths\npaths:\n{path.format('bent', ends, rates.format(0, 40))}{path.format('even', ends, straight)}"
    )
    words = ("program", "write", str(paths), "--robot", "er3a_c60", "--language", "urscript", "--output", str(tmp_path))
    assert run(*words).exit_code == 0
    moves = [
        [move.target.joints for move in execute(read_program(tmp_path / f"{name}.script")).listing().motions]
        for name in ("bent", "even")
    ]
    lowest = [np.degrees(min(joints[1] for joints in each)) for each in moves]
    assert lowest[0] < -25
    assert (len(moves[1]), lowest[1]) == (2, pytest.approx(-10))


def test_a_program_settles_what_its_path_leaves_open(tmp_path):
    """The half turn is written as two halves, and the first pose is gone to by its joints."""
    start, end = (f"{{xyz_mm: [400, {y}, 400], rpy_deg: [180, 0, {yaw}]}}" for y, yaw in ((0, 0), (60, 180)))
    (tmp_path / "paths.yaml").write_text(
        "kind: paths\npaths:\n  - {name: turn, title: Turn, kind: line, samples: 30, duration_s: 6, "
        f"start: {start}, end: {end}}}\n"
    )
    words = ("program", "write", str(tmp_path / "paths.yaml"), "--robot", "er3a_c60", "--language", "krl")
    done = run(*words, "--output", str(tmp_path))
    assert done.exit_code == 0, done.stderr
    assert (tmp_path / "turn.src").is_file()


def test_a_program_is_written_as_the_paths_of_its_stretches(tmp_path):
    paths = tmp_path / "paths.yaml"
    paths.write_text(
        "kind: paths\npaths:\n  - {name: weld, title: Weld, kind: program, samples: 30, "
        "start_deg: [0,-10,-10,0,-70,0], program: data/programs/weld_seam.src}\n"
    )
    words = ("program", "write", str(paths), "--robot", "er3a_c60", "--language", "urscript", "--output", str(tmp_path))
    done = run(*words)
    assert done.exit_code == 0, done.stderr
    kinds = [(tmp_path / f"weld_{number}.script").read_text() for number in (1, 2, 3)]
    assert "movec(" in kinds[1]
    assert "movel(" not in kinds[0] + kinds[2]


@pytest.mark.parametrize(
    ("findings", "missed", "reason"),
    [
        ((fact("written_targets_left_out", motions=1),), (), "left out"),
        ((), (Open("program_rest", ("line: 3",)),), "(line: 3)"),
    ],
)
def test_a_program_that_loses_a_motion_ends_with_1(tmp_path, monkeypatch, findings, missed, reason):
    made = PathProgram("line", "safe", {"line.src": "DEF line( )\nEND\n"}, findings, missed)
    monkeypatch.setattr(path_programs, "programs_of", lambda *_: iter([made]))
    words = ("program", "write", "data/paths/er3a_c60.yaml", "--robot", "er3a_c60", "--language", "krl")
    done = run(*words, "--output", str(tmp_path))
    assert (tmp_path / "line.src").is_file()
    assert done.exit_code == 1
    assert reason in done.stderr
    assert "shapes are assumed" in done.stderr


def test_a_long_line_is_cut_in_json_and_sarif_as_in_messages(tmp_path):
    (tmp_path / "a.src").write_text(f"DEF a( )\nPTP {{A1 0,{'A' * 100_000} 0}}\nEND\n")
    done = check(str(tmp_path / "a.src"), "--json", "--sarif", str(tmp_path / "a.sarif"))
    assert done.exit_code == 1
    assert len(done.stdout) + (tmp_path / "a.sarif").stat().st_size < 10_000


def test_a_file_that_is_no_program_says_in_one_line_which_kinds_are_taken(tmp_path):
    (tmp_path / "x.json").write_text('{"a": 1}')
    done = check(str(tmp_path / "x.json"))
    assert done.exit_code == 2
    assert [all(each in line for each in (".src", ".script", ".pgm", ".mod")) for line in done.stdout.splitlines()] == [
        True
    ]
