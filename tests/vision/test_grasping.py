"""Errors where they matter against drawn ones, the next view, and grasps against what the arm can do."""

from __future__ import annotations

import sys
from dataclasses import replace
from itertools import chain, pairwise, repeat
from types import SimpleNamespace

import numpy as np
import pytest

from er3a.collision.along import clearance
from er3a.collision.bodies import Bodies
from er3a.collision.scene import Sphere
from er3a.files.hand_eye_file import load_hand_eye
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.files.vision_file import load_vision
from er3a.finding import Amount, fact, is_one
from er3a.geometry.transforms import moved, step_between, transform
from er3a.kinematics.forward import forward
from er3a.pipeline.messages import vision  # noqa: F401
from er3a.pipeline.messages.say import say
from er3a.planning.timing import joint_limits
from er3a.robots.joint_limits import within
from er3a.vision.grasp_motion import PARTS
from er3a.vision.grasping import DetectedObject, Grasp, GraspNeeds, GraspTask, plan_grasp
from er3a.vision.hand_eye import calibrate_hand_eye
from er3a.vision.point_error import (
    ArmAccuracy,
    SeenPoseError,
    error_sizes,
    seen_pose,
    seen_pose_error,
    table_covariance,
)
from testing.arms import scara
from testing.camera_cells import CARRIED, FIXED, FOLDER, SCENE
from testing.hand_eye_sets import pose

SPEED = 0.1
BEHIND_THE_POST = np.radians([120, -30, -20, 0, -90, 0])  # from there the straight move to the can meets the post
NEEDS = GraspNeeds(0.005, np.radians(2), 0.02, (0.003, 0.003, 0.004, *np.radians([5, 5, 5])))


CELLS = [
    pytest.param((FIXED, "fixed_camera"), id="fixed"),
    pytest.param((CARRIED, "carried_camera"), id="carried", marks=pytest.mark.long),
]


def erring(covariance: np.ndarray) -> SeenPoseError:
    """An error of the camera alone."""
    nothing = np.zeros((6, 6))
    return SeenPoseError(covariance, nothing, nothing, nothing)


@pytest.fixture(scope="module", params=CELLS)
def cell(request):
    cell, name = request.param
    robot = load_robot(cell.robot)
    return cell, robot, calibrate_hand_eye(load_hand_eye(FOLDER / f"{name}.yaml", robot))


def task_of(cell, robot):
    file = load_vision(FOLDER / f"{cell.robot}.yaml", robot)
    scene = load_scene(SCENE)
    picture = None if file.picture_deg is None else np.radians(file.picture_deg)
    task = GraspTask(robot, Bodies(robot, scene), np.radians(file.home_deg), NEEDS, limits_of(robot), SPEED, 1)
    return file, task, picture


def limits_of(robot):
    return joint_limits(robot, np.radians([180, 180, 180, 360, 360, 360]), 0.25)


def along(chosen, part, count=13):
    """Joint angles (K, n) of a part of the motion."""
    return np.concatenate([leg.sampled(count)[1] for leg in chosen.legs if leg.part == part])


def test_the_study_sets_give_the_truth_within_their_intervals(cell):
    made, _, found = cell
    errors = np.concatenate([step_between(made.X, found.X), step_between(made.Y, found.Y)])
    assert (np.abs(errors) < found.half_width).all()


def test_errors_of_a_seen_pose_are_those_of_drawn_calibrations_and_readings(cell):
    """Drawn anew by moving calibration, reading and arm, with no derivative of ours."""
    made, robot, found = cell
    file, _, picture = task_of(made, robot)
    target = file.objects[0].detected()
    q_there = np.radians([10, -30, -20, 5, -30, 10])
    accuracy = ArmAccuracy(repeatability=2e-4)
    parts = seen_pose_error(found, target.T_camera_object, target.covariance, accuracy, (robot, q_there, picture))
    random = np.random.default_rng(7)
    count, s = 4000, accuracy.position_deviation
    X = moved(found.X, random.multivariate_normal(np.zeros(6), found.covariance[:6, :6], count))
    seen = moved(target.T_camera_object, random.multivariate_normal(np.zeros(6), target.covariance, count))
    placed = X @ seen
    if picture is not None:
        A = np.tile(forward(robot.without_tool(), picture), (count, 1, 1))
        A[:, :3, 3] += random.normal(0, s, (count, 3))
        placed = A @ placed
    placed[:, :3, 3] += random.normal(0, s, (count, 3))
    A = None if picture is None else forward(robot.without_tool(), picture)
    errors = step_between(seen_pose(found, target.T_camera_object, A), placed)
    drawn = np.cov(errors.T)
    np.testing.assert_allclose(np.diag(drawn), np.diag(parts.whole), rtol=0.12)
    distance = np.quantile(np.linalg.norm(errors[:, :3], axis=1), 0.95)
    assert error_sizes(parts.whole)[0] == pytest.approx(distance, rel=0.06)


@pytest.mark.long
def test_repeatability_after_iso_9283_comes_back_from_its_deviation():
    """RP = mean distance from the mean + three standard deviations of it, from a million drawn positions."""
    accuracy = ArmAccuracy(repeatability=1e-4)
    drawn = np.random.default_rng(8).normal(0, accuracy.position_deviation, (1_000_000, 3))
    distance = np.linalg.norm(drawn - drawn.mean(axis=0), axis=1)
    assert distance.mean() + 3 * distance.std() == pytest.approx(1e-4, rel=2e-3)


@pytest.mark.long
def test_an_object_is_graspable_only_at_the_probability_asked_for(cell):
    made, robot, _ = cell
    if made is not FIXED:
        pytest.skip("one cell shows it")
    file, task, _ = task_of(made, robot)
    target = file.objects[0].detected()
    T = made.X @ target.T_camera_object

    def plan(sigma: float, level: float, others: float | None = None):
        """With that deviation, or another one of all grasps but the first."""
        own, sizes = replace(task, needs=replace(NEEDS, probability=level)), chain([sigma], repeat(others or sigma))
        return plan_grasp(own, target, T, lambda q: erring(np.eye(6) * next(sizes) ** 2))

    sure, wide = plan(1e-4, 0.95), plan(2e-2, 0.95)
    assert sure.chosen.probability > 0.99
    assert wide.chosen is None
    assert is_one(wide.refusal, "grasp_unlikely")
    assert wide.refusal.probability < 0.1
    assert wide.refusal.needed == 0.95
    assert plan(2e-2, 0.0).chosen.probability == pytest.approx(wide.refusal.probability, abs=0.05)
    assert 0.1 < plan(3e-3, 0.95, others=2e-2).refusal.probability < 0.95  # that of the likeliest


@pytest.mark.long
def test_table_errors_are_those_of_tables_with_drawn_entries():
    robot, q = load_robot("er3a_c60"), np.radians([10, -30, -20, 5, -30, 10])
    accuracy = ArmAccuracy(length_deviation=1e-4, angle_deviation=2e-4)
    random, T = np.random.default_rng(9), forward(robot, q)
    picture = np.radians([-20, 10, 15, 0, 40, 0])
    A, T_camera_object = forward(robot.without_tool(), picture), transform(np.array([0.02, 0.01, 0.1]), np.zeros(3))
    found = SimpleNamespace(
        X=transform(np.array([0.1, 0.0, 0.3]), np.radians([5, 0, 90])), covariance=np.zeros((12, 12))
    )
    there = found.X @ T_camera_object
    errors, seen = [], []
    for _ in range(3000):
        lengths, angles = random.normal(0, 1e-4, (2, 6)), random.normal(0, 2e-4, (2, 6))
        other = robot.replace(
            a=robot.a + lengths[0],
            d=robot.d + lengths[1],
            alpha=robot.alpha + angles[0],
            offset=robot.offset + angles[1],
        )
        errors.append(step_between(T, forward(other, q)))
        seen.append(step_between(A @ there, forward(other.without_tool(), picture) @ there))
    expected = table_covariance(robot, q, accuracy)
    np.testing.assert_allclose(np.diag(np.cov(np.array(errors).T)), np.diag(expected), rtol=0.12)
    parts = seen_pose_error(found, T_camera_object, np.zeros((6, 6)), accuracy, (robot, q, picture))
    np.testing.assert_allclose(np.diag(np.cov(np.array(seen).T)), np.diag(parts.table - expected), rtol=0.12)


@pytest.mark.parametrize("arm", ["lbr_iiwa_14", "scara"])
def test_errors_of_every_row_of_the_table_count(arm):
    robot = scara() if arm == "scara" else load_robot(arm)
    accuracy, q = ArmAccuracy(length_deviation=1e-3), np.full(robot.joints, 0.1)
    rows = [table_covariance(robot, q, replace(accuracy, length_deviation=0.0))]
    for name in ("a", "d"):
        for row in range(robot.rows):
            entries = np.array(getattr(robot, name))
            entries[row] += 1e-6
            step = step_between(forward(robot, q), forward(robot.replace(**{name: entries}), q)) / 1e-6
            rows.append(1e-6 * np.outer(step, step))
    np.testing.assert_allclose(table_covariance(robot, q, accuracy), sum(rows), rtol=1e-6, atol=1e-14)


@pytest.mark.long
def test_grasps_are_what_the_arm_can_carry_out(cell):
    made, robot, found = cell
    file, task, picture = task_of(made, robot)
    A = None if picture is None else forward(robot.without_tool(), picture)
    for entry in file.objects:
        target = entry.detected()
        T = seen_pose(found, target.T_camera_object, A)
        plan = plan_grasp(task, target, T, lambda q, own=target.covariance: erring(own))
        assert ("grasped" if plan.chosen else "not graspable") == entry.expect
        if plan.chosen is None:
            assert plan.refusal is not None
            continue
        chosen = plan.chosen
        approach, retreat = along(chosen, "approach"), along(chosen, "retreat")
        for q, wanted in ((chosen.q, chosen.T_base_tool), (approach[-1], chosen.T_base_tool)):
            assert np.abs(step_between(wanted, forward(robot, q))).max() < 1e-6
        line = forward(robot, approach)[:, :3, 3]
        tool_z = chosen.T_base_tool[:3, 2]
        off_line = (line - line[-1]) - np.outer((line - line[-1]) @ tool_z, tool_z)
        assert np.abs(off_line).max() < 1e-6
        assert np.linalg.norm(line[0] - line[-1]) == pytest.approx(target.approach, abs=1e-6)
        away = forward(robot, retreat)[:, :3, 3]
        np.testing.assert_allclose(away[-1] - away[0], [0, 0, target.retreat], atol=1e-6)
        every = np.concatenate([approach, retreat])
        assert within(robot, every).all()
        assert clearance(robot, every, task.bodies.scene).distance.min() >= NEEDS.clearance
        whole = np.concatenate([along(chosen, part, 301) for part in PARTS])
        assert clearance(robot, whole, task.bodies.scene).distance.min() >= chosen.clearance


def chosen_from(home, name="fixed_camera"):
    """The fixed cell's arm, scene, and its plan for the can from a place where it waits."""
    robot = load_robot(FIXED.robot)
    found = calibrate_hand_eye(load_hand_eye(FOLDER / f"{name}.yaml", robot))
    file, task, _ = task_of(FIXED, robot)
    target = file.objects[0].detected()
    T = seen_pose(found, target.T_camera_object)
    return robot, task, plan_grasp(replace(task, home=home), target, T, lambda q: erring(target.covariance))


@pytest.fixture(scope="module")
def round_the_post():
    return chosen_from(BEHIND_THE_POST)


@pytest.mark.long
def test_the_planner_leads_round_what_the_straight_move_meets(round_the_post):
    robot, task, plan = round_the_post
    chosen = plan.chosen
    moves = [leg for leg in chosen.legs if leg.part == "move"]
    assert len(moves) > 1
    straight = np.linspace(BEHIND_THE_POST, chosen.q_before, 301)
    assert clearance(robot, straight, task.bodies.scene).distance.min() < 0
    every = np.concatenate([leg.sampled(301)[1] for leg in chosen.legs])
    assert clearance(robot, every, task.bodies.scene).distance.min() >= chosen.clearance > 0
    assert within(robot, every).all()
    np.testing.assert_allclose(moves[0].joints(np.zeros(1))[0], BEHIND_THE_POST)
    for leg, behind in pairwise(chosen.legs):
        np.testing.assert_allclose(leg.joints(np.array([leg.duration]))[0], behind.joints(np.zeros(1))[0], atol=1e-9)


@pytest.mark.long
def test_rates_of_the_motion_keep_the_limits(round_the_post):
    """By differences of angles, whatever the bounds say."""
    robot, _, plan = round_the_post
    limits = limits_of(robot)
    for leg in plan.chosen.legs:
        t, q = leg.sampled(2001)
        speed = np.diff(q, axis=0) / t[1]
        assert (np.abs(speed) <= limits.speed * (1 + 1e-6)).all()
        assert (np.abs(np.diff(speed, axis=0)) / t[1] <= limits.acceleration * (1 + 1e-4)).all()
        if leg.part != "move":
            tool = forward(robot, q)[:, :3, 3]
            assert np.linalg.norm(np.diff(tool, axis=0), axis=1).max() / t[1] <= SPEED * (1 + 1e-6)


@pytest.mark.long
def test_the_move_to_the_approach_keeps_the_clearance_asked_for(monkeypatch):
    home = np.radians([-60, 20, -20, 0, -90, 0])
    robot, task, plan = chosen_from(home)
    middle = forward(robot, (home + plan.chosen.q_before)[None] / 2)[0, :3, 3]
    outward = middle * [1, 1, 0] / np.hypot(*middle[:2])
    bump = Sphere("bump", transform(middle + 0.057 * outward, np.zeros(3)), 0.02)
    scene = replace(task.bodies.scene, solids=(*task.bodies.scene.solids, bump))
    passed = clearance(robot, np.linspace(home, plan.chosen.q_before, 201), scene).distance.min()
    assert 0 < passed < NEEDS.clearance
    monkeypatch.setattr("er3a.vision.grasp_motion.way_around", lambda *given: fact("none_found", rounds=1))
    file, task, _ = task_of(FIXED, robot)
    near = replace(task, home=home, bodies=Bodies(robot, scene))
    target = file.objects[0].detected()
    found = calibrate_hand_eye(load_hand_eye(FOLDER / "fixed_camera.yaml", robot))
    T = seen_pose(found, target.T_camera_object)
    refused = plan_grasp(near, target, T, lambda q: erring(target.covariance)).refusal
    assert is_one(refused, "way_collides")
    assert (refused.part, "bump" in say(refused)) == ("move", True)
    closer = replace(near, needs=replace(NEEDS, clearance=0.001))
    assert plan_grasp(closer, target, T, lambda q: erring(target.covariance)).chosen.clearance == pytest.approx(
        passed, abs=5e-4
    )


@pytest.mark.long
def test_without_the_planner_the_object_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "ompl", None)
    _, _, plan = chosen_from(BEHIND_THE_POST)
    assert plan.chosen is None
    assert plan.refusal == fact("no_transfer", why=fact("library_missing", name="OMPL"))


@pytest.mark.long
def test_a_start_outside_the_limits_is_named():
    robot = load_robot(FIXED.robot)
    _, _, plan = chosen_from(BEHIND_THE_POST + np.array([robot.upper[0], 0, 0, 0, 0, 0]))
    assert is_one(plan.refusal, "no_transfer")
    assert is_one(plan.refusal.why, "no_end")


@pytest.mark.long
def test_success_is_the_share_of_errors_that_the_gripper_forgives(cell):
    """With an error along one axis alone the probability is known: 2 Phi(tolerance / deviation) - 1."""
    made, robot, found = cell
    file, task, picture = task_of(made, robot)
    target = file.objects[0].detected()
    A = None if picture is None else forward(robot.without_tool(), picture)
    T = seen_pose(found, target.T_camera_object, A)
    plan = plan_grasp(task, target, T, lambda q: erring(np.diag([0, 0, 0.004**2, 0, 0, 0])))
    assert plan.chosen.probability == pytest.approx(0.6827, abs=0.025)


@pytest.mark.long
def test_a_can_forgives_turns_about_its_axis_and_a_box_does_not(cell):
    made, robot, found = cell
    file, task, picture = task_of(made, robot)
    A = None if picture is None else forward(robot.without_tool(), picture)
    shares = {}
    for entry in file.objects[:2]:
        target = entry.detected()
        T = seen_pose(found, target.T_camera_object, A)
        about_z = np.zeros((6, 6))
        about_z[3:, 3:] = np.radians(20) ** 2 * np.outer(T[:3, 2], T[:3, 2])
        shares[entry.name] = plan_grasp(task, target, T, lambda q, own=about_z: erring(own)).chosen.probability
    assert shares["can"] > 0.999
    assert shares["box"] < 0.3


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "home"), [("ur5e", [0, -90, 90, -90, -90, 0]), ("lbr_iiwa_14", [0, 30, 0, -60, 0, 90, 0])]
)
def test_other_arms_grasp_along_straight_lines(name, home):
    """A UR by its own closed form, seven joints by short moves of the joints: the tool stays on the line."""
    robot = load_robot(name)
    limits = joint_limits(robot, np.full(len(robot.lower), np.pi), 0.25)
    task = GraspTask(robot, Bodies(robot, None), np.radians(home), NEEDS, limits, SPEED, 1)
    T, certain = pose([0, 0, 10], [0.45, 0.1, 0.2]), np.eye(6) * 1e-10
    target = DetectedObject("thing", T, certain, 4, (Grasp("top", pose([180, 0, 0], [0, 0, 0.1])),), 0.08, 0.08)
    chosen = plan_grasp(task, target, T, lambda q: erring(certain)).chosen
    for part in ("approach", "retreat"):
        q = along(chosen, part, 21)
        tool = forward(robot, q)[:, :3, 3]
        assert np.linalg.norm((tool - tool[0])[:, :2], axis=1).max() < 5e-4
        assert abs(tool[-1] - tool[0])[2] == pytest.approx(0.08, abs=1e-5)
        assert within(robot, q).all()
    if name == "ur5e":
        assert [leg.part for leg in chosen.legs] == ["move", "approach", "retreat"]


def test_a_margin_asked_for_in_degrees_is_millimetres_of_a_slide():
    """2 deg are not the 35 mm that metres taken for radians make of them."""
    robot = scara()
    needs = GraspNeeds(0.0, np.radians(2), 0.0, (1.0,) * 6)
    limits = joint_limits(robot, np.array([3.0, 3, 0.5, 6]), 0.25)
    task = GraspTask(robot, Bodies(robot, None), np.array([0.2, 0.4, 0.1, 0]), needs, limits, SPEED, 1)
    for slide, margin in ((0.150, 30), (0.179, 1)):
        T = forward(robot, np.array([0.3, 0.5, slide, 0.1]))
        target = DetectedObject("t", T, 1e-12 * np.eye(6), 1, (Grasp("g", np.eye(4)),), 0.02, 0.02)
        plan = plan_grasp(task, target, T, lambda _: erring(1e-12 * np.eye(6)))
        if margin < 2:
            assert (plan.refusal.code, plan.refusal.solutions) == ("grasp_near_limits", 4)
            unit = "deg (mm of a prismatic joint)"
            assert (plan.refusal.margin, plan.refusal.needed) == (Amount(pytest.approx(1), unit), Amount(2.0, unit))
        else:
            assert np.degrees(plan.chosen.limit_margin) == pytest.approx(margin, abs=0.1)
