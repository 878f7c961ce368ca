"""Each thing that a check of programs can find says what to do about it."""

from __future__ import annotations

import re
from typing import get_args

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.kinematics.forward import forward
from er3a.pipeline.messages.programs import PACED, REMEDIES, remedies, remedy, remedy_at
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.program_check.program_check_findings import (
    NOTES,
    AcceleratesMoreThanAssumed,
    CheckFinding,
    FasterThanAssumed,
    ZoneTooLarge,
)
from er3a.programs.languages import read_program

ROBOT = load_robot("er3a_c60")


@pytest.mark.parametrize("kind", get_args(CheckFinding), ids=lambda kind: kind.__name__)
def test_every_caution_and_fail_has_a_remedy(kind):
    assert kind.code in NOTES or kind.code in REMEDIES or kind in remedy.registry


def test_no_remedy_is_for_what_is_never_found():
    assert set(REMEDIES) <= {kind.code for kind in get_args(CheckFinding)}


def test_of_speeds_the_lowest_is_told_and_each_thing_once():
    fast = [FasterThanAssumed(1, 358.1, 180.0), FasterThanAssumed(4, 3786.6, 360.0)]
    told = remedies([*fast, AcceleratesMoreThanAssumed(1, 9.0, 8.0), AcceleratesMoreThanAssumed(2, 9.0, 8.0)])
    assert told == ["Lower the speed of this line to 9.5 % of its own or less, and its acceleration to 0.9 %."]
    assert 0.095 * 3786.6 <= 360.0 < 0.096 * 3786.6


START = "[0.3, -0.3, -0.2, 0.0, -1.0, 0.0]"


@pytest.mark.parametrize("acceleration", [40, 400, 2000])
@pytest.mark.parametrize(
    "line",
    [
        "movel(pose_trans(get_forward_kin({start}), p[0, 0, -0.02, 0, 0, 0]), a={a}, v={v})",
        "movej([0.9, -0.3, -0.2, 0.3, -1.0, 0.0], a={a}, v={v})",
    ],
)
def test_a_line_at_the_pace_advised_passes(tmp_path, line, acceleration):
    """Also where the speed is never reached, so that lowering it alone would change nothing."""

    def found(a: float, v: float):
        text = f"def a():\n  movej({START}, a=1, v=0.5)\n  {line.format(start=START, a=a, v=v)}\nend\n"
        (tmp_path / "a.script").write_text(text)
        check = check_program(read_program(tmp_path / "a.script"), ROBOT, CheckOptions(start=np.zeros(6)))
        return [at.finding for at in check.findings if at.place.line == 3]

    (text,) = [each for each in remedies(found(acceleration, 8.0)) if "acceleration" in each]
    speed, acc = (float(percent) / 100 for percent in re.findall(r"([\d.]+) %", text))
    assert not [each for each in found(acceleration * acc, 8.0 * speed) if isinstance(each, PACED)]


def test_a_zone_may_take_half_of_the_shorter_motion():
    assert remedy(ZoneTooLarge(80.0, 20.0)) == "Make the zone 10.0 mm at most."


SCENE = load_scene("data/scenes/table_and_post.yaml")
ANGLES = re.compile(r"\(([^)]*)\) deg")
HEAD = "DEF a( )\n$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\n$VEL.CP=0.05\nBAS(#VEL_PTP,10)\n"


@pytest.mark.parametrize(
    ("code", "start", "line"),
    [
        ("above_limit", "0,-10,-10,0,-70,0", "PTP {A4 185}"),
        ("whole_turn", "0,-10,-10,0,-70,-100", "PTP {A6 300}"),
        ("motion_collides", "0,-10,-10,0,-70,0", "PTP {A1 100}"),
        ("configuration_changes", "0,-10,-10,0,-70,0", "PTP {A4 170,A5 70,A6 170}"),
        ("passes_singularity", "0,-10,-10,0,-30,0", "LIN {A1 1,A5 30}"),
    ],
)
def test_joint_moves_that_are_advised_pass(tmp_path, code, start, line):
    """Carried out: the line replaced by the moves that its remedy gives, at the speed at which they were checked."""

    def found(*lines: str):
        (tmp_path / "a.src").write_text(HEAD + "".join(f"{each}\n" for each in lines) + "END\n")
        options = CheckOptions(start=np.radians([float(each) for each in start.split(",")]), scene=SCENE)
        return check_program(read_program(tmp_path / "a.src"), ROBOT, options)

    before = found(line)
    (advised,) = [each for each in before.findings if each.finding.code == code]
    moves = [angles.split(", ") for angles in ANGLES.findall(remedy_at(advised.finding, advised.joint_moves))]
    assert moves
    lines = ["PTP {" + ",".join(f"A{i} {angle}" for i, angle in enumerate(move, 1)) + "}" for move in moves]
    after = found(*lines)
    assert [verdict.level for verdict in after.verdicts] == ["pass"] * len(moves)
    if code != "above_limit":  # of which no arm has the end
        ends = [list(check.motions.values())[-1].end for check in (before, after)]
        np.testing.assert_allclose(*(forward(ROBOT, end)[:3, 3] for end in ends if end is not None), atol=1e-4)


def test_what_no_joint_move_mends_says_so_by_not_advising_one(tmp_path):
    (tmp_path / "a.src").write_text(f"{HEAD}PTP {{A2 -80,A3 -10}}\nEND\n")  # into the table
    options = CheckOptions(start=np.radians([0, -10, -10, 0, -70, 0]), scene=SCENE)
    found = check_program(read_program(tmp_path / "a.src"), ROBOT, options).findings
    assert [(each.finding.code, each.joint_moves) for each in found] == [("motion_collides", ())]
    assert "joint move" not in remedy_at(found[0].finding, found[0].joint_moves)
