"""Arms of 4 to 8 joints: their programs are written, read and checked where the language has words for them, else
there is one clear error."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

import er3a.pipeline.messages.programs  # noqa: F401
from er3a.errors import InputError
from er3a.files.robot_library import load_robot
from er3a.pipeline import cli  # noqa: F401
from er3a.pipeline.commands.options import app
from er3a.planning.commands import JointSequenceCommand
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.from_commands import listing_of
from er3a.programs.languages import execute, read_program, write_program
from er3a.programs.writing import WriteOptions
from er3a.robots.robot import Robot

LENGTHS = [0.1, 0.3, 0.25, 0.05, 0.05, 0.05, 0.05, 0.05]


def arm(joints, sliding=False):
    """An arm whose joints turn about axes that cross; the third one may slide."""
    a = np.array(LENGTHS[:joints])
    alpha = np.resize([np.pi / 2, 0.0], joints)
    slides = np.zeros(joints, bool)
    slides[2] = sliding
    limit, ones = np.full(joints, 2.5), np.ones(joints)
    return Robot("made", "made", "standard", a, alpha, 0 * a, ones, 0 * ones, -limit, limit, sliding=slides)


def written(robot, language, folder, count=5):
    """Random joints of an arm, and the file of the program that goes through them."""
    path = np.random.default_rng(robot.joints).uniform(robot.lower, robot.upper, (count, robot.joints))
    listing = listing_of(JointSequenceCommand(path, 0.0, 4.0), robot, path[0]).listing
    files = write_program(listing, language, WriteOptions(robot)).files
    for suffix, text in files.items():
        (folder / f"path{suffix}").write_text(text)
    return path, folder / f"path{next(iter(files))}"


@pytest.mark.parametrize("joints", [4, 5, 6])
def test_krl_moves_as_many_axes_as_the_arm_has(joints, tmp_path):
    robot = arm(joints)
    path, file = written(robot, "krl", tmp_path)
    program = read_program(file)
    assert all((f"A{joints} " in line) and (f"A{joints + 1} " not in line) for line in program.lines if "PTP {" in line)
    visited = [each.target.joints for each in execute(program, robot).listing().motions]
    np.testing.assert_allclose(np.degrees(visited), np.degrees(path), rtol=0, atol=0.51e-6)
    check = check_program(program, robot, CheckOptions(start=path[0], measures=False))
    assert [each.kind for each in check.verdicts] == ["joint"] * len(path)


@pytest.mark.parametrize(
    ("language", "joints"), [("krl", 7), ("krl", 8), ("urscript", 5), ("urscript", 7), ("rpl", 4), ("xpl", 8)]
)
def test_a_language_without_these_joints_is_refused_in_one_line(language, joints, tmp_path):
    robot = arm(joints)
    with pytest.raises(InputError, match=rf"joint angles, and this arm has {joints}\. ") as caught:
        written(robot, language, tmp_path)
    assert "\n" not in str(caught.value)
    _, file = written(arm(6), language, tmp_path)
    with pytest.raises(InputError, match=f"joint angles, and this arm has {joints}"):
        execute(read_program(file), robot)
    path = np.zeros((2, joints))
    listing = listing_of(JointSequenceCommand(path, 0.0, 4.0), robot, path[0]).listing
    with pytest.raises(InputError, match=f"this arm has {joints}"):
        write_program(listing, language)


@pytest.mark.parametrize("language", ["krl", "urscript", "rpl", "xpl"])
def test_an_arm_with_a_slide_is_refused(language, tmp_path):
    with pytest.raises(InputError, match="joint 3 of this arm slides"):
        written(arm(6, sliding=True), language, tmp_path)
    _, file = written(arm(6), language, tmp_path)
    with pytest.raises(InputError, match="joint 3 of this arm slides"):
        execute(read_program(file), arm(6, sliding=True))


def test_axes_that_the_arm_does_not_have_may_be_0_and_nothing_else(tmp_path):
    (tmp_path / "a.src").write_text("DEF a( )\nPTP {A1 1,A2 2,A3 3,A4 4,A5 0,A6 0}\nPTP {A1 1,A5 5}\nEND\n")
    check = check_program(read_program(tmp_path / "a.src"), arm(4), CheckOptions(start=np.zeros(4), measures=False))
    assert [verdict.level for verdict in check.verdicts] == ["note", "fail"]
    found = [each.finding for each in check.findings if each.finding.code == "not_followed"]
    assert [each.reason for each in found] == ["too_many_joints"]


def test_the_commands_say_it_in_one_line(tmp_path):
    _, file = written(load_robot("er3a_c60"), "krl", tmp_path)
    told = CliRunner().invoke(app, ["check-program", str(file), "--robot", "lbr_iiwa_14"])
    assert told.exit_code == 2
    assert "KRL gives an arm 1 to 6 joint angles, and this arm has 7" in told.stdout
    told = CliRunner().invoke(
        app, ["program", "write", "data/paths/lbr_iiwa_14.yaml", "--robot", "lbr_iiwa_14", "--language", "krl"]
    )
    assert isinstance(told.exception, InputError | SystemExit)
    assert "this arm has 7" in str(told.exception) + told.output
