"""The Robotics Toolbox's names, against the toolbox's own formulas, and what they refuse."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import er3a
from er3a.planning.moves import JointMove

T = np.linspace(0, 5, 50)
GOAL = np.array([0.8, 0.5, -0.4, 1.0, -0.8, 1.6])
LENGTHS = {"a": [0, 0.65, 0, 0, 0, 0], "d": [0.16977, 0, 0, 0.65161, 0, 0.1256]}
TWISTS = np.radians([-90, 0, -90, 90, -90, 0])


@pytest.fixture(scope="module")
def arm() -> er3a.Robot:
    return er3a.Robot.from_dh(LENGTHS["a"], TWISTS, LENGTHS["d"])


def test_jtraj_is_the_toolbox_s_with_a_time_vector():
    q, qd, qdd = er3a.jtraj(np.zeros(6), GOAL, T)
    from roboticstoolbox import jtraj  # takes a second to import, as spatialmath does

    theirs = jtraj(np.zeros(6), GOAL, T)
    for own, other in ((q, theirs.q), (qd, theirs.qd), (qdd, theirs.qdd)):
        assert np.allclose(own, other, atol=1e-9)


def test_degrees_are_warned_of_where_no_robot_is_given():
    with pytest.warns(er3a.InputWarning, match=r"np\.radians\(q_end\)"):
        er3a.jtraj(np.zeros(6), np.degrees(GOAL), T)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        er3a.jtraj(np.zeros(6), 4 * np.pi * np.ones(6), T)  # two turns


def test_jtraj_counts_from_the_first_time():
    assert np.array_equal(er3a.jtraj(np.zeros(6), GOAL, T + 7)[1], er3a.jtraj(np.zeros(6), GOAL, (T + 7) - 7.0)[1])


def test_ctraj_goes_straight_and_turns_about_one_axis(arm):
    start, end = er3a.forward(arm, 0.3 * GOAL), er3a.forward(arm, GOAL)
    poses = er3a.ctraj(start, end, T)
    assert np.allclose(poses[[0, -1]], [start, end], atol=1e-12)
    along = poses[:, :3, 3] - start[:3, 3]
    assert np.abs(np.cross(along, end[:3, 3] - start[:3, 3])).max() < 1e-12
    turns = Rotation.from_matrix(poses[1:, :3, :3] @ start[:3, :3].T).as_rotvec()
    axes = turns / np.linalg.norm(turns, axis=1, keepdims=True)
    assert np.abs(axes - axes[-1]).max() < 1e-5


def test_ctraj_is_on_the_toolbox_s_trapezoid(arm):
    start, end = er3a.forward(arm, 0.3 * GOAL), er3a.forward(arm, GOAL)
    from roboticstoolbox import ctraj
    from spatialmath import SE3

    theirs = ctraj(SE3(start, check=False), SE3(end, check=False), len(T))
    assert np.allclose(er3a.ctraj(start, end, T)[:, :3, 3], theirs.t, atol=1e-9)


def test_a_pose_is_its_position_and_any_one_orientation():
    from spatialmath import SE3

    random = np.random.default_rng(2)
    for place, angles in zip(random.uniform(-1, 1, (20, 3)), random.uniform(-1.5, 1.5, (20, 3))):
        T = er3a.pose(place, angles)
        assert np.allclose(T, (SE3(place) * SE3.RPY(angles, order="zyx")).A, atol=1e-12)
        assert np.allclose(er3a.rpy(T), angles, atol=1e-9)
        assert np.allclose(er3a.pose(place, zyz=er3a.zyz(T)), T, atol=1e-12)
        assert np.allclose(er3a.pose(place, quaternion=-3 * er3a.quaternion(T)), T, atol=1e-12)
        assert np.allclose(er3a.zyz(er3a.pose(place, zyz=np.abs(angles))), np.abs(angles), atol=1e-9)
        assert np.allclose(er3a.quaternion(T), Rotation.from_matrix(T[:3, :3]).as_quat(True, scalar_first=True))
    assert np.allclose(er3a.zyz(er3a.pose([0, 0, 0], zyz=[0.3, np.pi, 0.2])), [0.1, np.pi, 0])
    assert er3a.quaternion(np.stack([T, T])[None]).shape == (1, 2, 4)


def test_rpy_is_scipy_s_zyx():
    T = er3a.forward(er3a.load_robot("er3_600"), np.random.default_rng(1).uniform(-1, 1, (40, 6)))
    assert np.allclose(er3a.rpy(T)[:, ::-1], Rotation.from_matrix(T[:, :3, :3]).as_euler("ZYX"), atol=1e-9)


def test_from_dh_is_the_robot_of_a_table(arm, tmp_path):
    table = tmp_path / "table.csv"
    rows = zip(LENGTHS["a"], np.degrees(TWISTS), LENGTHS["d"])
    lines = [f"{k},{1000 * a},{alpha},{1000 * d}" for k, (a, alpha, d) in enumerate(rows, start=1)]
    table.write_text("\n".join(["joint,a_mm,alpha_deg,d_mm", *lines]) + "\n", encoding="utf-8")
    with pytest.warns(er3a.InputWarning, match="limits"):
        read = er3a.load_robot(table)
    assert np.allclose(er3a.forward(read, GOAL), er3a.forward(arm, GOAL), atol=1e-12)
    assert np.allclose(er3a.forward(er3a.load_robot("er3a_c60_article"), GOAL), er3a.forward(arm, GOAL), atol=1e-12)
    with pytest.warns(er3a.InputWarning):
        assert er3a.load_robot(table, convention="modified").convention == "modified"
    assert arm.replace(name="other").title == "other"
    assert arm.replace(title="Mine").replace(name="other").title == "Mine"


def test_another_unit_in_a_table_is_warned_of():
    with pytest.warns(er3a.InputWarning, match="divide mm by 1000"):
        er3a.Robot.from_dh(1000 * np.array(LENGTHS["a"]), TWISTS, LENGTHS["d"])
    with pytest.warns(er3a.InputWarning, match="takes rad"):
        er3a.Robot.from_dh(LENGTHS["a"], np.degrees(TWISTS), LENGTHS["d"])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda arm, line: line.poses(T), "expected shares of the way"),
        (lambda arm, line: er3a.line(line.T_start, line.poses(1.0), T), r"duration has shape \(50,\)"),
        (lambda arm, line: er3a.pose([0, 0, 0], [0, 0, 0], zyz=[0, 0, 0]), "rpy and zyz each give"),
        (lambda arm, line: er3a.pose([0, 0]), r"position has shape \(2,\)"),
        (lambda arm, line: er3a.pose([0, 0, 0], quaternion=[0, 0, 0, 0]), "quaternion is 0"),
        (lambda arm, line: line.at(5.1), "lasts from 0 to 5 s"),
        (lambda arm, line: er3a.follow(arm, line, np.linspace(0, 6, 9)), "lasts from 0 to 5 s"),
        (
            lambda arm, line: er3a.follow(arm, line, T).joints([5.0, 7.0]),
            "t runs from 5 to 7 s; .* lasts from 0 to 5 s",
        ),
        (lambda arm, line: er3a.follow(arm, line, T).rates([-1.0]), "lasts from 0 to 5 s"),
        (lambda arm, line: JointMove(0 * GOAL, GOAL, 5.0).joints(7.0), "lasts from 0 to 5 s"),
        (lambda arm, line: JointMove(0 * GOAL, GOAL, 5.0).polynomials().rates(7.0), "lasts from 0 to 5 s"),
        (lambda arm, line: er3a.jtraj(np.zeros(6), GOAL, 50), "expected times in s"),
        (lambda arm, line: er3a.jtraj(np.zeros(6), GOAL, T[::-1]), "does not rise"),
        (lambda arm, line: er3a.jtraj(np.zeros(5), GOAL, T), "q_end has shape"),
        (lambda arm, line: er3a.plot(arm, np.zeros(5)), "q has shape"),
        (lambda arm, line: er3a.plot(arm, np.zeros(6), window=(0, 1)), "window has shape"),
    ],
)
def test_nothing_goes_beyond_the_ends_in_silence(arm, call, message):
    line = er3a.line(er3a.forward(arm, 0.3 * GOAL), er3a.forward(arm, GOAL), 5.0)
    with pytest.raises(er3a.Er3aError, match=message):
        call(arm, line)


def test_a_followed_line_has_a_row_for_each_time_asked_for(arm):
    line = er3a.line(er3a.forward(arm, 0.3 * GOAL), er3a.forward(arm, GOAL), 5.0, ramp=1 / 3)
    found = er3a.follow(arm, line, T)
    assert np.allclose(er3a.forward(arm, found.joints(T)), er3a.ctraj(line.T_start, line.poses(1.0), T), atol=1e-9)
    for shown in (found, er3a.conditioning(arm, found.q)):
        assert len(repr(shown).splitlines()) < 25


def test_conditioning_needs_no_length(arm):
    found = er3a.conditioning(arm, GOAL)
    aligned = er3a.conditioning(arm, GOAL * [1, 1, 1, 1, 0, 1])
    assert aligned.manipulability < 1e-12 < found.manipulability
    assert aligned.condition_number > 1e12 > found.condition_number


@pytest.mark.long
def test_plot_draws_the_arm_where_it_is(arm):
    figure = er3a.plot(arm, GOAL)
    corners = np.array(figure.axes[0].lines[0].get_data_3d()).T
    assert np.allclose(corners[-1], er3a.forward(arm, GOAL)[:3, 3], atol=1e-12)
    assert figure.axes[0].get_zlim()[0] < 0
    assert er3a.plot(arm, GOAL, window=(-1.5, 1.5, -1.5, 1.5, 0, 1.5)).axes[0].get_zlim() == (0, 1.5)
    moving = er3a.plot(arm, er3a.jtraj(np.zeros(6), GOAL, T[:2])[0])
    assert moving.to_jshtml().count("data:image") == 2
