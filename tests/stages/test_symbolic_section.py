"""The validation page's formulas: well-formed MathML whose numbers are those of forward kinematics."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward
from er3a.pipeline.stages.validation.symbolic_section import formulas


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


def test_an_arm_with_a_joint_that_slides_has_none():
    robot = load_robot("er3a_c60").replace(sliding=[True, False, False, False, False, False])
    assert formulas(robot) is None
