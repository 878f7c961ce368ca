"""The proof for any serial arm against samples, numerical search, formulas and the proof for spherical wrists."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import transform
from er3a.kinematics.chain import joint_starts
from er3a.kinematics.forward import forward, jacobian
from er3a.kinematics.numerical import solve
from er3a.kinematics.wrist_partitioned import wrist_partitioned_arm
from er3a.robots.robot import CombinedLimit, Robot
from er3a.workspace.general_arm import general_arm, place
from er3a.workspace.general_proof import prove_general
from er3a.workspace.proven import EMPTY, FILLED, SectionMap, prove_robot


def skew() -> Robot:
    """The ER3-600 with axes 5 and 6 40 mm apart: no spherical wrist, no closed form here."""
    plain = load_robot("er3_600")
    return plain.replace(a=plain.a + np.array([0, 0, 0, 0, 0.04, 0]))


def states(robot: Robot, proof, R, origin, points: np.ndarray) -> np.ndarray:
    x, y, z = R @ (points - origin).T
    return SectionMap(proof).status(np.hypot(x, y), np.arctan2(y, x), z)


def scara(lower_2: float, upper_2: float, turn: float) -> Robot:
    """Two links of 0.4 and 0.3 m and a stroke of 0.2 m: a tool point whose volume a formula gives."""
    plain = load_robot("er3_600")
    zero = np.zeros(4)
    return plain.replace(
        a=[0.4, 0.3, 0.0, 0.0],
        d=[0.5, 0.0, 0.0, 0.0],
        alpha=zero,
        beta=zero,
        offset=zero,
        direction=[1, -1, 1, 1],
        sliding=[False, False, True, False],
        lower=[-turn, lower_2, -0.2, -1.0],
        upper=[turn, upper_2, 0.0, 1.0],
        speed=zero + 1,
        continuous=zero > 0,
        envelopes=(),
        hulls=(),
        base=transform([1.0, 2.0, 3.0], [0.3, 0.2, 0.1]),
        tool=np.eye(4),
        references=(),
    )


@pytest.mark.long
def test_bounds_of_an_arm_with_a_skew_wrist(random):
    robot = skew()
    arm, R, origin = general_arm(robot)
    proof = prove_general(arm, 0.0, 6000, 1)
    lower, upper = proof.bounds
    assert 1.2 < lower < upper < 1.4
    points = forward(robot, random.uniform(robot.lower, robot.upper, (300_000, 6)))[:, :3, 3]
    assert not (states(robot, proof, R, origin, points) == EMPTY).any()

    cube = random.uniform([-0.7, -0.7, -0.33], [0.7, 0.7, 1.07], (1500, 3))
    filled = cube[states(robot, proof, R, origin, cube) == FILLED]
    assert len(filled) > 500
    T = np.tile(np.eye(4), (len(filled), 1, 1))
    T[:, :3, 3] = filled
    starts = np.tile((robot.lower + robot.upper) / 2, (len(filled), 1))
    place_alone = np.array([1, 1, 1, 0, 0, 0])
    assert solve(robot, T, starts, mask=place_alone, restarts=200, position_tolerance=1e-9).solved.all()


@pytest.mark.long
@pytest.mark.parametrize(("lower_2", "upper_2", "turn"), [(-1.0, 2.5, np.pi), (0.5, 2.5, 1.2)])
def test_bounds_of_a_scara_hold_the_volume_that_a_formula_gives(lower_2, upper_2, turn):
    proof = prove_general(general_arm(scara(lower_2, upper_2, turn))[0], 0.0, 12_000, 1)
    nearest = 0.0 if lower_2 < 0 < upper_2 else min(abs(lower_2), abs(upper_2))
    a, b = (0.25 + 0.24 * np.cos(angle) for angle in (max(abs(lower_2), abs(upper_2)), nearest))
    exact = turn * (b - a) * 0.2  # each radius is reached over as wide an arc as joint 1 turns
    lower, upper = proof.bounds
    assert lower <= exact <= upper
    assert proof.width < (0.02 if turn == np.pi else 0.06)


@pytest.mark.long
def test_an_iiwa_without_limits_fills_a_ball():
    robot = load_robot("lbr_iiwa_14")
    free = robot.replace(lower=np.full(7, -np.pi), upper=np.full(7, np.pi))
    lower, upper = prove_general(general_arm(free)[0], 0.0, 6000, 1).bounds
    assert lower < 4 / 3 * np.pi * 0.946**3 < upper
    assert lower > 0.92 * upper


@pytest.mark.long
def test_a_tool_point_on_the_wrist_centre(random):
    robot = load_robot("er3_600")
    depth = wrist_partitioned_arm(robot)
    tool = robot.tool.copy()
    tool[:3, 3] += tool[:3, :3] @ depth.wrist_in_tool
    robot = robot.replace(tool=tool)
    proven = prove_robot(robot, 2000, 1)
    assert proven.proof.width < 0.1
    points = forward(robot, random.uniform(robot.lower, robot.upper, (100_000, 6)))[:, :3, 3]
    assert proven.count_in_empty(points) == 0


@pytest.mark.long
def test_narrow_limits_of_a_spherical_wrist_leave_a_bracket(random):
    robot = load_robot("er3a_c60")
    middle, half = (robot.lower + robot.upper) / 2, np.radians([60, 60, 60, 40, 40, 40])
    robot = robot.replace(lower=middle - half, upper=middle + half)
    proven = prove_robot(robot, 500, 1)
    assert proven.proof.bounds[0] > 0
    assert proven.proof.width < 0.3
    points = forward(robot, random.uniform(robot.lower, robot.upper, (100_000, 6)))[:, :3, 3]
    assert proven.count_in_empty(points) == 0


@pytest.mark.long
def test_limits_of_sums_count(random):
    plain = skew()
    coupling = np.eye(6)
    coupling[2, 1] = -1.0
    robot = plain.replace(
        coupling=coupling,
        lower=plain.lower + np.array([0, 0, plain.lower[1], 0, 0, 0]),
        upper=plain.upper + np.array([0, 0, plain.upper[1], 0, 0, 0]),
        combined=(CombinedLimit((0.0, -1.0, 1.0, 0.0, 0.0, 0.0), plain.lower[2], plain.upper[2]),),
    )
    bounds = [prove_general(general_arm(each)[0], 0.0, 4000, 1).bounds for each in (plain, robot)]
    assert bounds[0][0] <= bounds[1][1]
    assert bounds[1][0] <= bounds[0][1]
    assert bounds[1][0] > 0.85 * bounds[1][1]


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize("robot", [skew(), scara(-1.0, 2.0, 1.0)], ids=["skew", "scara"])
def test_the_chain_gives_what_forward_and_jacobian_give(random, robot):
    arm, R, origin = general_arm(robot)
    n = len(arm.lower)
    for q in random.uniform(robot.lower, robot.upper, (20, robot.joints)):
        theta = (robot.direction * q + joint_starts(robot))[:n]
        radii, columns = np.empty(n), np.empty((n, 3))
        point = np.array(place(arm, theta, radii, columns))
        assert point @ R + origin == pytest.approx(forward(robot, q)[:3, 3], abs=1e-12)
        expected = jacobian(robot, q)[:3, :n] * robot.direction[:n]
        assert np.abs(R.T @ columns.T - expected).max() < 1e-12
        assert (radii <= arm.levers + 1e-12).all()
        assert arm.heights[0, 0] - 1e-12 <= point[2] <= arm.heights[0, 1] + 1e-12


angles = st.floats(-np.pi, np.pi)
lengths = st.lists(st.floats(-0.4, 0.4), min_size=6, max_size=6)
slides = st.tuples(st.just(False), *[st.booleans()] * 5)


@pytest.mark.long
@settings(max_examples=2, phases=[Phase.generate])
@given(
    lengths,
    lengths,
    st.lists(angles, min_size=6, max_size=6),
    st.lists(st.floats(0, 7), min_size=6, max_size=6),
    slides,
)
def test_no_sample_of_a_random_table_lies_in_an_empty_cell(a, d, alpha, spans, sliding):
    robot = load_robot("er3_600").replace(
        a=a,
        d=np.array(d) + 0.05,
        alpha=alpha,
        lower=np.full(6, -1.0),
        upper=np.array(spans) - 1.0,
        sliding=sliding,
        tool=transform([0.02, 0.0, 0.1], [0.1, 0.2, 0.3]),
        base=transform([1.0, 2.0, 3.0], [0.3, 0.2, 0.1]),
    )
    arm, R, origin = general_arm(robot)
    proof = prove_general(arm, 0.0, 3000, 1)
    q = np.random.default_rng(2).uniform(robot.lower, robot.upper, (20_000, 6))
    assert not (states(robot, proof, R, origin, forward(robot, q)[:, :3, 3]) == EMPTY).any()
    assert 0 <= proof.bounds[0] <= proof.bounds[1]


@pytest.mark.parametrize("height", [0.0, 0.7])
def test_an_arm_of_one_joint_has_a_ring_that_holds_it(height, random):
    columns = {"a": [0.4], "alpha": [0.3], "d": [height], "offset": [0.1], "direction": [1]}
    robot = Robot(name="one", title="one", convention="standard", lower=[-2], upper=[2.5], **columns)
    proven = prove_robot(robot, 500, 1)
    q = random.uniform(robot.lower, robot.upper, (1000, 1))
    assert proven.count_in_empty(forward(robot, q)[:, :3, 3]) == 0
    assert proven.count_in_empty(np.array([[0, 0, height + 0.5], [1.0, 0, height]])) == 2
