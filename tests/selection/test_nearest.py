"""Which of several solutions is nearest, and how far it stays from the limits."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.finding import Amount, fact
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.solutions import Solutions
from er3a.pipeline.messages import kinematics  # noqa: F401
from er3a.pipeline.messages.say import say
from er3a.robots.joint_limits import limit_margin
from er3a.robots.robot import CombinedLimit
from er3a.selection.nearest import nearest
from er3a.selection.select import select, select_sequence
from testing.arms import scara


def solutions_of(q, within, branch) -> Solutions:
    return Solutions(
        load_robot("er3_600"), np.array(q, float), np.ones(len(q), bool), np.array(within), np.array(branch)
    )


def test_nearest_breaks_ties_by_all_joints_then_branch():
    robot = load_robot("er3_600")
    rows = [[1, 0.5, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0], [-1, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0]]
    choice = nearest(robot, solutions_of(rows, [True, True, True, False], [0, 5, 4, 1]), np.zeros(6))
    assert choice.order.tolist() == [2, 1, 0]
    assert (choice.reason.code, choice.reason.next_best.branch) == ("lower_branch_number", 5)
    choice = nearest(robot, solutions_of(rows[:2], [True, True], [0, 1]), np.zeros(6))
    assert choice.chosen == 1
    assert choice.reason.code == "moves_less_together"
    assert choice.reason.less.value == pytest.approx(np.degrees(np.hypot(1, 0.5) - 1))


def test_nearest_of_none_and_of_one():
    robot = load_robot("er3_600")
    choice = nearest(robot, solutions_of([[9, 0, 0, 0, 0, 0]], [False], [3]), np.zeros(6))
    assert choice.chosen is None
    assert (choice.reason.code, choice.reason.count, choice.reason.branch) == ("all_outside_limits", 1, 3)
    assert [one.joint for one in choice.reason.exceeded.joints] == [1]
    choice = nearest(robot, solutions_of([[1, 0, 0, 0, 0, 0]], [True], [3]), np.zeros(6))
    assert choice.order.tolist() == [0]
    assert choice.reason == fact(
        "only_admissible", move=fact("greatest_move", joint=1, move=Amount(np.degrees(1), "deg"))
    )
    assert say(choice.reason) == "greatest joint move 57.3° (J1); the only admissible solution"


def test_nearest_counts_turns_from_the_reference(robot):
    q_ref = np.radians([0, 0, 0, 0, 0, 300])
    T = forward(robot, np.radians([10, 20, 10, 30, 40, -50]))
    solutions = inverse(robot, T, q_ref)
    chosen = solutions.q[nearest(robot, solutions, q_ref).chosen]
    assert np.degrees(chosen[5]) == pytest.approx(310)


def test_limit_margin_is_negative_outside():
    robot = load_robot("er3_600")
    np.testing.assert_allclose(np.degrees(limit_margin(robot, np.zeros((2, 6)))), [65, 65])
    assert np.degrees(limit_margin(robot, np.radians([0, 95, 0, 0, 0, 0]))) == pytest.approx(-10)


def test_a_millimetre_of_a_slide_counts_as_a_degree_and_is_told_as_one():
    """A SCARA: both arms of a pose move the slide by as much, and have the same distance to its end."""
    robot = scara().replace(upper=np.array([2.2, 2.5, 0.18, 3.0]), lower=np.array([-2.2, -2.5, 0.0, -3.0]))
    q = np.array([0.3, 0.5, 0.150, 0.1])
    assert np.degrees(limit_margin(robot, q)) == pytest.approx(30)  # of 0 to 180 mm
    near = np.append(q[:2], [0.179, 0.1])
    assert np.degrees(limit_margin(robot, near)) == pytest.approx(1)
    summed = robot.replace(combined=(CombinedLimit((0, 0, 2, 0), 0.0, 0.32),))
    assert np.degrees(limit_margin(summed, q)) == pytest.approx(20)
    q_ref = q - [0.0, 0.0, 0.120, 0.0]
    solutions = inverse(robot, forward(robot, q), q_ref)
    choice = nearest(robot, solutions, q_ref)
    assert np.degrees(choice.max_joint_move) == pytest.approx(120)
    assert choice.reason.move == fact("greatest_move", joint=3, move=Amount(pytest.approx(120), "mm"))
    assert say(choice.reason).startswith("greatest joint move 120.0 mm (J3); the next best")
    assert "needs as much, but" in say(choice.reason)
    assert "° (mm of a prismatic joint)" in say(choice.reason)
    ranking = select(robot, solutions, {"nearest": 1, "limits": 1}, q_ref)
    np.testing.assert_allclose(ranking.measured["nearest"], 120)
    np.testing.assert_allclose(ranking.measured["limits"], 30)
    assert "limits 30° (mm of a prismatic joint)" in say(ranking.chosen_reason)
    assert "q3_mm" in repr(select_sequence(robot, [solutions], q_ref))
