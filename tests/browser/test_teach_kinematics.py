"""The teach panel's kinematics, run in a real browser, against those in Python and against SciPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from er3a.files.robot_library import load_robot
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.closed_form import REACHED
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.singularity import TYPES, characteristic_length, conditioning, determinant_factors
from er3a.kinematics.wrist_partitioned import solve_slots
from er3a.pipeline.study import load_study
from er3a.pipeline.teach.panel import panel_data, write_teach_page
from er3a.robots.robot import Robot
from testing.arms import arms, joints_at_random, make_arm, margin, pose_errors
from testing.teach_kinematics import NEAR, SOLVE

pytestmark = pytest.mark.long

POSES, AGREE = 150, 1e-9
STUDY = load_study("config/small.yaml")

REPRESENT = """
const [poses, done] = arguments;
import("er3a/algebra").then((algebra) =>
  done(poses.map((T) => [algebra.rollPitchYaw(T), algebra.eulerZYZ(T), algebra.quaternion(T)])));
"""


@pytest.fixture(scope="module")
def page(browser, tmp_path_factory):
    """The browser on a teach panel, whose modules the tests call."""
    file = tmp_path_factory.mktemp("teach") / "teach.html"
    write_teach_page(STUDY, "er3a_c60", Path("nowhere"), file)
    browser.get(file.as_uri())
    return browser


def in_the_browser(page, robot: Robot, q: np.ndarray) -> list[dict[str, Any]]:
    found = page.execute_async_script(SOLVE, panel_data(robot, NEAR), q.tolist())
    assert isinstance(found, list), found
    return found


def check_forward_and_measures(robot: Robot, q: np.ndarray, found: list[dict[str, Any]]) -> None:
    for errors in pose_errors(np.array([one["T"] for one in found]), forward(robot, q)):
        assert errors.max() < AGREE
    expected = conditioning(robot, q, characteristic_length(robot))
    for name, values in (
        ("manipulability", expected.manipulability),
        ("smallestSingularValue", expected.smallest_singular_value),
    ):
        assert np.array([one["measures"][name] for one in found]) == pytest.approx(values, abs=AGREE)


@pytest.mark.parametrize("name", ["er3a_c60", "er3_600"])
def test_agrees_with_python_on_random_poses(page, name, random):
    robot = load_robot(name)
    q = joints_at_random(robot, random, POSES)
    found = in_the_browser(page, robot, q)
    check_forward_and_measures(robot, q, found)
    factors = determinant_factors(robot, q)
    for kind in TYPES:
        assert np.array([one["factors"][kind] for one in found]) == pytest.approx(getattr(factors, kind), abs=AGREE)
    T = forward(robot, q)
    fault, gap = solve_slots(robot, T, q, keep_folds=True, keep_free=True)[1:]
    for n in range(POSES):
        solved, expected = found[n]["solved"], inverse(robot, T[n], q[n])
        assert [row["slot"] for row in solved["rows"]] == expected.branch.tolist()
        assert [row["withinLimits"] for row in solved["rows"]] == expected.within_limits.tolist()
        # Rounding may swap turns that are equally near, or show another turn of a branch that is outside the limits.
        apart = np.array([row["q"] for row in solved["rows"]])[:, None] - expected.q
        apart[~expected.within_limits] = wrap_to_pi(apart[~expected.within_limits])
        apart = np.abs(apart).max(axis=-1) + 9.0 * (expected.branch[:, None] != expected.branch)
        assert apart.min(axis=0).max() < AGREE
        assert apart.min(axis=1).max() < AGREE
        missing = np.flatnonzero(fault[n] != REACHED)
        assert [slot["slot"] for slot in solved["unsolved"]] == missing.tolist()
        assert [slot["gap"] for slot in solved["unsolved"]] == pytest.approx(gap[n][missing], abs=AGREE)


FRAMES = """
const [data, q, done] = arguments;
import("er3a/kinematics").then(({ constantLinks, frames, tableFrames }) =>
  done(tableFrames(data.table, frames(data.table, constantLinks(data.table), q))));
"""
REACH = """
const [data, q, T, done] = arguments;
Promise.all([import("er3a/kinematics"), import("er3a/goal")]).then(([{ constantLinks }, { goalOf, jointsFor }]) =>
  done(jointsFor(goalOf(data, constantLinks(data.table)), null, T, q)));
"""


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_the_table_s_frames_are_those_of_forward_kinematics(page, convention, random):
    robot = load_robot("er3a_c60").replace(convention=convention)
    for q in joints_at_random(robot, random, 5):
        found = page.execute_async_script(FRAMES, panel_data(robot, NEAR), q.tolist())
        expected = [robot.base, *(forward(robot, q, frame=k) for k in range(1, 7))]
        np.testing.assert_allclose(found, expected, atol=1e-12)


def test_iteration_reaches_poses_of_any_arm_and_stays_within_the_limits(page, random):
    robot = make_arm(alpha=np.radians([-90, 5, -90, 90, -90, 0]))
    starts = joints_at_random(robot, random, 20) * 0.5
    goals = forward(robot, np.clip(starts + 0.3, robot.lower, robot.upper))
    reached = 0
    for start, T in zip(starts, goals):
        found = page.execute_async_script(REACH, panel_data(robot, NEAR), start.tolist(), T.tolist())
        if "q" in found:
            q = np.array(found["q"])
            assert ((q >= robot.lower) & (q <= robot.upper)).all()
            for errors in pose_errors(forward(robot, q), T):
                assert errors.max() < 1e-8
            reached += 1
    assert reached >= 18


@given(robot=arms(), data=st.data())
@settings(max_examples=8, suppress_health_check=[HealthCheck.too_slow])
def test_any_table_of_the_class_is_solved(page, robot, data):
    seed = data.draw(st.integers(0, 2**32 - 1))
    q = joints_at_random(robot, np.random.default_rng(seed), 10)
    found = in_the_browser(page, robot, q)
    check_forward_and_measures(robot, q, found)
    for n in np.flatnonzero(margin(robot, q) > 1e-2):
        rows = np.array([row["q"] for row in found[n]["solved"]["rows"]])
        for errors in pose_errors(forward(robot, rows), np.array(found[n]["T"])):
            assert errors.max() < AGREE
        assert np.abs(rows - q[n]).max(axis=1).min() < AGREE
        assert len(rows) == len(inverse(robot, forward(robot, q[n]), q[n]).q)


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_tables_outside_the_class_have_forward_kinematics_and_a_reason(page, convention, random):
    robot = make_arm(convention, alpha=random.uniform(-2, 2, 6), beta=random.uniform(-0.1, 0.1, 6))
    q = joints_at_random(robot, random, 50)
    assert panel_data(robot, NEAR)["no_closed_form"] == "axes 2 and 3 are not parallel"
    check_forward_and_measures(robot, q, in_the_browser(page, robot, q))


@pytest.mark.parametrize("name", ["er3a_c60_article", "er3_600"])
def test_singular_poses_keep_every_branch(page, name, random):
    """Wrist aligned, elbow straight, both: each row solves the pose, and Python's closed form has no branch more."""
    robot = load_robot(name)
    q = joints_at_random(robot, random, 30)
    q[::3, 4] = 0
    straight = determinant_factors(robot, np.zeros(6)).elbow
    for row in q[1::3]:
        row[2] = -robot.direction[2] * straight
    for n, one in enumerate(in_the_browser(page, robot, q)):
        rows = np.array([row["q"] for row in one["solved"]["rows"]])
        for errors in pose_errors(forward(robot, rows), forward(robot, q[n])):
            assert errors.max() < AGREE
        slots = {row["slot"] for row in one["solved"]["rows"]}
        assert slots == set(inverse(robot, forward(robot, q[n]), q[n]).branch.tolist())
        if n % 3 == 0:
            assert one["solved"]["free"] == ["wrist"]
            assert np.abs(rows - q[n]).max(axis=1).min() < AGREE


def test_representations_are_those_of_scipy(page, random):
    rotations = Rotation.random(200, rng=random)
    special = [np.eye(3), np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1])]
    turns = np.concatenate([rotations.as_matrix(), special])
    T = np.tile(np.eye(4), (len(turns), 1, 1))
    T[:, :3, :3] = turns
    found = page.execute_async_script(REPRESENT, T.tolist())
    for n, (rpy, zyz, (w, *xyz)) in enumerate(found):
        back = [Rotation.from_euler("ZYX", rpy[::-1]), Rotation.from_euler("ZYZ", zyz), Rotation.from_quat([*xyz, w])]
        assert w >= 0
        assert 0 <= zyz[1] <= np.pi
        assert abs(rpy[1]) <= np.pi / 2
        for rotation in back:
            assert np.abs(rotation.as_matrix() - turns[n]).max() < AGREE
