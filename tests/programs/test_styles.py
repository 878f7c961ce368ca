"""Programs in the styles that pendants save: inline forms, motion data, exports of PolyScope; nothing is dropped.

They were written for these tests after the languages' manuals; what they hold is meant for no robot.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.instructions import ArmMotion, Aside, Output, Pause, Remark, Unknown
from er3a.programs.languages import execute, files_of, read_program

STYLES = Path(__file__).with_name("styles")
ROBOT = load_robot("er3a_c60")
MOVING = {
    ".src": re.compile(r"(?i)^\s*(?:S?PTP|S?LIN|S?CIRC|SPL|PTP_REL|LIN_REL|ASYPTP)\b"),
    ".script": re.compile(r"^\s*(?:move[jlpc]|servoj|speedl|freedrive_mode|force_mode|path_offset_enable)\("),
    ".pgm": re.compile(r"^\s*(?:MJOINT|MLIN|MARC)\("),
    ".XPL": re.compile(r"<(?:mjoint|mlin|mcirc)[ >]"),
}


@pytest.mark.long
@pytest.mark.parametrize("name", ["WELD1.src", "poly.script", "job2.pgm", "JOB1.XPL"])
def test_every_line_that_moves_has_a_verdict_or_a_finding(name):
    program = read_program(STYLES / name)
    check = check_program(program, ROBOT, CheckOptions(measures=False))
    told = {verdict.place.line for verdict in check.verdicts} | {each.place.line for each in check.findings}
    told |= {step.place.line for step in check.execution.steps if isinstance(step.instruction, Remark)}
    comment = 0
    for number, line in enumerate(program.lines, 1):
        comment += line.count("(*") - line.count("*)")
        of_if = name == "JOB1.XPL" and number in (39, 40)  # its bodies are left out, and the if is named
        if MOVING[Path(name).suffix].search(line) and not comment and not of_if:
            assert number in told, (number, line)
    assert check.execution.complete


def test_inline_forms_take_tool_base_speed_and_zone_from_their_data():
    execution = execute(read_program(STYLES / "WELD1.src"), ROBOT)
    by_line = {step.place.line: step.instruction for step in execution.steps}
    home, first, line, arc = (by_line[number] for number in (25, 33, 40, 51))
    np.testing.assert_allclose(np.degrees(home.target.joints), [0, -10, -10, 0, -70, 0])  # of $config.dat
    assert (first.tool.name, first.base.name) == ("TOOL_DATA[1]", "BASE_DATA[2]")
    np.testing.assert_allclose(first.tool.pose[:3, 3], [0, 0, 0.12])
    np.testing.assert_allclose(first.base.pose[:3, 3], [0, 0, 0.1])
    assert (first.speed.value, first.zone.kind, first.zone.value) == (0.5, "distance", 0.1)
    assert (line.speed.value, line.speed.unit, line.zone.kind) == (0.2, "m/s", "fine")
    assert (arc.kind, arc.speed.value, arc.zone.value) == ("arc", 0.02, 0.05)
    assert [by_line[number].kind for number in (57, 60)] == ["line", "joint"]
    assert by_line[44] == Output("$OUT[5]", "TRUE")
    assert by_line[63] == Pause(0.5)
    assert isinstance(by_line[68], Aside)
    assert {each.name for each in files_of(STYLES / "WELD1.src")} == {"WELD1.src", "WELD1.dat", "$config.dat"}


def test_an_export_of_polyscope():
    execution = execute(read_program(STYLES / "poly.script"), ROBOT)
    motions = [step for step in execution.steps if isinstance(step.instruction, ArmMotion)]
    lines = [step.place.line for step in motions]
    assert lines[:7] == [44, 46, 47, 48, 60, 60, 60]
    start = motions[0].instruction
    np.testing.assert_allclose(
        np.degrees(start.target.near), np.degrees([0.4424, -0.4336, -0.3753, 0, -0.7619, 0.4424])
    )
    np.testing.assert_allclose(start.tool.pose[:3, 3], [0, 0, 0.12])
    levels = [step.instruction.target.pose[2, 3] for step in motions[4:7]]
    np.testing.assert_allclose(levels, [0.3, 0.29, 0.28])
    before, towards = (step.instruction for step in motions if step.place.line in (70, 76))
    tool = forward(ROBOT.replace(tool=before.tool.pose), before.target.joints)
    np.testing.assert_allclose(towards.target.pose[:3, 3], tool[:3, 3] + [0, 0, 0.05], atol=1e-6)
    unknown = {step.place.line for step in execution.steps if isinstance(step.instruction, Unknown)}
    assert {63, 64, 79, 80, 81} <= unknown
