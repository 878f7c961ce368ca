"""Chains of one to ten joints that turn or slide, coupled or not: kinematics, limits, sampling, files."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from er3a.files.robot_library import load_robot
from er3a.files.robot_writer import write_robot
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.forward import forward, frames, jacobian
from er3a.kinematics.inverse import inverse
from er3a.kinematics.table_batch import frames_of, tables_of
from er3a.robots.joint_limits import limit_margin, limits_exceeded, nearest_equivalent, turn_bounds, within
from er3a.robots.robot import CombinedLimit, Robot, to_modified, to_standard
from er3a.sampling.grid import make_grid, tool_bound
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import search_reach, tally_blocks
from testing.arms import PinocchioArm, chains, joints_at_random, joints_within, make_arm, pose_errors

FANUC = np.array([[1.0, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 1, 1, 0, 0, 0], *np.eye(6)[3:]])


def stanford() -> Robot:
    """Two joints that turn, one that slides, three that turn."""
    return Robot(
        name="stanford",
        title="made after the Stanford arm",
        convention="standard",
        a=np.zeros(6),
        alpha=np.radians([-90, 90, 0, -90, 90, 0]),
        d=[0.412, 0.154, 0, 0, 0, 0.263],
        direction=np.ones(6),
        offset=np.radians([0, 0, -90, 0, 0, 0]),
        lower=[-3, -3, 0.3, -3, -1.5, -3],
        upper=[3, 3, 1.3, 3, 1.5, 3],
        sliding=np.arange(6) == 2,
    )


@pytest.mark.long
@given(data=st.data(), robot=chains())
def test_any_chain_agrees_with_pinocchio(data, robot):
    q, peer = data.draw(joints_within(robot))[None], PinocchioArm(robot)
    distance, angle = pose_errors(forward(robot, q), peer.forward(q))
    assert max(distance[0], angle[0]) < 1e-11
    np.testing.assert_allclose(jacobian(robot, q), peer.jacobian(q), rtol=0, atol=1e-11)
    T = frames(robot, q)
    assert T.shape == (1, robot.rows + 1, 4, 4)
    np.testing.assert_allclose(T[:, -1], forward(robot, q), rtol=0, atol=1e-12)
    for same in (to_modified(robot), to_standard(robot)):
        np.testing.assert_allclose(forward(same, q), forward(robot, q), rtol=0, atol=1e-11)


@pytest.mark.long
@given(data=st.data(), robot=chains(coupled=False))
def test_many_tables_have_the_frames_of_one(data, robot):
    q = np.stack([data.draw(joints_within(robot)) for _ in range(2)])
    T = frames_of(tables_of(robot), robot, q)
    np.testing.assert_allclose(T[0], frames(robot.without_tool(), q), rtol=0, atol=1e-12)


def counted(robot, grid, q):
    """Samples per cell of the section, by forward kinematics in double precision."""
    offset = forward(robot, q)[:, :3, 3] - grid.axis_point
    height = offset @ grid.axis
    rho = np.linalg.norm(offset - height[:, None] * grid.axis, axis=1)
    edges = [grid.section_origin[i] + np.arange(grid.section_shape[i] + 1) * grid.section_cell for i in range(2)]
    return np.histogram2d(rho, height, edges)[0]


@pytest.mark.long
@given(robot=chains())
def test_no_sample_leaves_the_bound_and_single_precision_follows_double(robot):
    grid, draw = make_grid(robot, 16), Draw(7, 600, 2)
    counts = tally_blocks(robot, grid, draw, range(2))
    assert counts.sum() == 600
    np.testing.assert_array_less(np.abs(counts - counted(robot, grid, draw.opening_joints(robot, 600))).sum(), 40)
    bound, points = tool_bound(robot), forward(robot, draw.opening_joints(robot, 600))[:, :3, 3]
    offset = points - bound.axis_point
    height = offset @ bound.axis
    across = np.linalg.norm(offset - height[:, None] * bound.axis, axis=1)
    assert np.hypot(np.maximum(across - bound.offset, 0), height - bound.height).max() <= bound.radius + 1e-9


@pytest.mark.long
def test_samples_keep_limits_of_sums():
    arm = make_arm(coupling=FANUC, combined=(CombinedLimit((0, 1, 1, 0, 0, 0), -0.5, 0.7),))
    draw = Draw(3, 40_000, 4)
    q = draw.opening_joints(arm, 40_000)
    assert within(arm, q).all()
    free = arm.replace(combined=())
    every = draw.joints(free, np.repeat(np.arange(4), 10_000), np.tile(np.arange(10_000), 4))
    kept = within(arm, every)
    assert 0.05 < kept.mean() < 0.4
    np.testing.assert_array_equal(q, every[kept])
    grid = make_grid(arm, 24)
    counts = tally_blocks(arm, grid, draw, range(4))
    assert abs(int(counts.sum()) - int(kept.sum())) <= 2  # single precision at the edge
    assert np.abs(counts - counted(arm, grid, q)).sum() < 100
    extremes = search_reach(arm, grid, q)
    best = search_reach(free, grid, every)
    assert extremes.furthest_from_axis <= best.furthest_from_axis + 1e-9


def test_a_continuous_joint_has_no_limits():
    arm = make_arm(lower=np.full(6, -1.0), upper=np.full(6, 1.0), continuous=np.arange(6) == 5)
    q = np.array([0, 0, 0, 0, 0, 40.0])
    assert within(arm, q)
    assert limits_exceeded(arm, q) is None
    assert limit_margin(arm, q) == pytest.approx(1.0)
    assert limits_exceeded(arm, q + 2).joints[0].joint == 1
    near = nearest_equivalent(arm, np.zeros(6), q)
    assert near[5] == pytest.approx(12 * np.pi)
    assert np.array_equal(turn_bounds(arm, q)[0][5:], [0])


def test_a_sliding_joint_has_no_turns():
    arm = stanford()
    q = np.array([0, 0, 0.9, 0, 0, 0])
    np.testing.assert_array_equal(nearest_equivalent(arm, q, q + 6), q)
    found = limits_exceeded(arm, np.array([0, 0, 1.5, 0, 0, 0])).joints[0]
    assert (found.code, found.joint, found.side) == ("limit_exceeded", 3, "above")
    assert (found.excess.value, found.excess.unit) == (pytest.approx(200), "mm")


def test_the_sums_limit_is_named():
    arm = make_arm(combined=(CombinedLimit((0, 1, 1, 0, 0, 0), -0.5, 0.5),))
    q = np.radians([0, 20, 20, 0, 0, 0])
    assert not within(arm, np.stack([q, -q])).any()
    found = limits_exceeded(arm, q).joints[0]
    assert (found.joints, found.side) == ((2, 3), "above")
    assert found.excess.value == pytest.approx(40 - np.degrees(0.5))
    assert limit_margin(arm, q) == limit_margin(arm, -q) == pytest.approx(0.5 - np.radians(40))
    slide = stanford().replace(combined=(CombinedLimit((0, 0, 2, 0, 0, 0), 0.0, 1.0),))
    (found,) = limits_exceeded(slide, np.array([0, 0, 0.9, 0, 0, 0])).joints
    assert tuple(size.value for size in (found.value, found.excess, found.limit)) == pytest.approx((1800, 800, 1000))
    assert found.value.unit == "mm"


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::er3a.errors.InputWarning")
@given(robot=chains())
def test_any_chain_is_written_and_read_back(robot, tmp_path_factory):
    robot = robot.replace(
        speed=np.where(np.arange(robot.joints) % 2, 1.5, 2.5),
        combined=(CombinedLimit((1.0,) * robot.joints, -1.0, 1.0),),
    )
    path = tmp_path_factory.mktemp("files") / "drawn.yaml"
    write_robot(robot, path)
    again = load_robot(path)
    for name in ("a", "alpha", "d", "offset", "direction", "speed", "sliding", "continuous", "coupling"):
        given, read = getattr(robot, name), getattr(again, name)
        if name == "coupling" and given is not None:
            np.testing.assert_array_equal(given, read)
        elif given is not None:
            np.testing.assert_allclose(np.asarray(given, float), np.asarray(read, float), rtol=0, atol=1e-12)
    fixed = ~robot.continuous
    np.testing.assert_allclose(again.lower[fixed], robot.lower[fixed], rtol=0, atol=1e-12)
    assert len(again.combined) == 1
    q = joints_at_random(robot, np.random.default_rng(0), 20)
    np.testing.assert_allclose(forward(again, q), forward(robot, q), rtol=0, atol=1e-11)


@pytest.mark.long
def test_a_coupled_arm_is_solved_in_the_angles_of_its_pendant():
    """Fanuc's J2 and J3: the closed form gives pendant angles, and the limit of their sum refuses some."""
    arm = make_arm(coupling=FANUC, combined=(CombinedLimit((0, 1, 1, 0, 0, 0), -1.5, 1.5),))
    own = joints_at_random(arm, np.random.default_rng(2), 300)
    T = forward(arm, own)
    many = inverse_batch(arm, T)
    back = forward(arm, many.q[many.solved])
    np.testing.assert_allclose(back, np.repeat(T, many.solved.sum(axis=1), axis=0), rtol=0, atol=1e-9)
    assert (np.abs(wrap_to_pi(many.q - own[:, None])).max(axis=2) < 1e-6).any(axis=1).all()
    np.testing.assert_array_equal(many.within_limits, many.solved & within(arm, many.q))
    one = inverse(arm, T[0])
    assert len(one.q) >= many.solved[0].sum()
    np.testing.assert_allclose(forward(arm, one.q), np.broadcast_to(T[0], (len(one.q), 4, 4)), rtol=0, atol=1e-9)
    assert {"combination_exceeded"} <= {why.joints[-1].code for why in one.reason if why} or one.within_limits.all()
