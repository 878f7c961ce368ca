"""The validation page's formulas: well-formed MathML whose numbers are those of forward kinematics."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward
from er3a.pipeline.stages.validation.page.report import formulas
from er3a.robots.robot import Robot
from testing.arms import make_arm


@pytest.mark.parametrize("name", ["er3a_c60", "er3a_c60_article", "ur5e"])
def test_formulas_are_typeset_whole_and_their_numbers_are_those_of_the_zero_pose(name):
    robot = load_robot(name)
    found = formulas(robot)
    reached = robot.base
    for link in found.links:
        cells = ElementTree.fromstring(str(link).replace("&#8290;", "")).findall(".//mtd")
        assert len(cells) == 2 * 16
        texts = ["".join(cell.itertext()).replace("−", "-") for cell in cells[16:]]
        numbers = np.array([float(text) for text in texts]).reshape(4, 4)
        numbers[:3, 3] /= 1000
        reached = reached @ numbers
    np.testing.assert_allclose(reached @ robot.tool, forward(robot, np.zeros(6)), atol=1e-5)
    shown = [float(value.replace("−", "-").replace("\u202f", "")) for _, _, value in found.arm]
    expected = forward(robot, np.zeros(6))[:3].T * np.array([[1], [1], [1], [1000]])
    np.testing.assert_allclose(shown, expected.ravel(), atol=6e-3)


def text_of(formula):
    return "".join(ElementTree.fromstring(str(formula)).itertext())


def test_what_moves_is_told_by_the_joints_of_the_pendant():
    coupling = np.eye(6)
    coupling[2, 1], coupling[4, 3] = 1, -0.5
    robot = make_arm().replace(coupling=coupling, sliding=[True] + 5 * [False], direction=[1, 1, -1, 1, 1, 1])
    told = [text_of(each) for each in formulas(robot).moved]
    assert told == ["d1=q1+300", "θ2=q2", "θ3=−q2−q3", "θ4=q4", "θ5=−0.5q4+q5", "θ6=q6"]
    assert text_of(formulas(robot).arm[-1][1]).endswith("+d1")  # the tool's height in mm, without a factor


def test_formulas_that_nobody_reads_are_not_written():
    rng = np.random.default_rng(5)
    values = {key: rng.uniform(-1, 1, 8) for key in ("alpha", "a", "d", "offset")}
    limits = {"lower": -np.ones(8), "upper": np.ones(8), "direction": np.ones(8)}
    found = formulas(Robot(name="skew", title="skew", convention="standard", **values, **limits))
    assert (found.arm, len(found.links)) == ([], 8)
    assert found.longest > 1000
