"""The proof against random samples, the closed-form inverse and workspaces that are known exactly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from er3a.files.robot_library import load_robot
from er3a.finding import is_one
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.kinematics.wrist_partitioned import solve_slots
from er3a.robots.robot import Robot
from er3a.workspace.arcs import MAX_ARCS, measure, meets, remove
from er3a.workspace.causes import cause_of, relaxations
from er3a.workspace.cells import Proof
from er3a.workspace.general_arm import general_arm
from er3a.workspace.general_proof import unfilled_about
from er3a.workspace.proven import EMPTY, FILLED, Proven, SectionMap, cavities, prove_robot

RIGHT = np.pi / 2


def samples(robot: Robot, count: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(robot.lower, robot.upper, (count, 6))


def states(proven: Proven, points: np.ndarray) -> np.ndarray:
    """What the proof says of points (n, 3) in the base frame."""
    return proven.section.status(*proven.in_section(points))


def states_of_samples(robot: Robot, proven: Proven, count: int) -> np.ndarray:
    return states(proven, forward(robot, samples(robot, count))[:, :3, 3])


def reachable(robot: Robot, point: np.ndarray, random: np.random.Generator, tries: int = 4000) -> bool:
    """Whether the closed-form inverse, which knows nothing of the proof, finds any orientation within the limits."""
    T = np.tile(np.eye(4), (tries, 1, 1))
    T[:, :3, :3], T[:, :3, 3] = Rotation.random(tries, rng=random).as_matrix(), point
    q, _, _ = solve_slots(robot, T, np.zeros((tries, 6)))
    turns = np.ceil((robot.lower - q - 1e-9) / (2 * np.pi))
    return bool((q + turns * 2 * np.pi <= robot.upper + 1e-9).all(axis=-1).any())


def two_links(tool: float = 0.1, **changes) -> Robot:
    """Links of 0.5 and 0.3 m from a shoulder 0.3 m up, all joints over a full turn."""
    return Robot(
        name="two_links",
        title="two links",
        convention="standard",
        a=[0, 0.5, 0, 0, 0, 0],
        alpha=[-RIGHT, 0, -RIGHT, RIGHT, -RIGHT, 0],
        d=[0.3, 0, 0, 0.3, 0, tool],
        direction=np.ones(6),
        offset=np.zeros(6),
        lower=np.full(6, -np.pi),
        upper=np.full(6, np.pi),
    ).replace(**changes)


@pytest.fixture(scope="module", params=["er3a_c60_article", pytest.param("er3a_c60", marks=pytest.mark.long)])
def proven(request):
    robot = load_robot(request.param)
    return robot, prove_robot(robot, 2000, 1)


# --- the known arms ---


@pytest.mark.long
def test_no_sample_lies_in_an_empty_cell(proven):
    robot, proof = proven
    found = states_of_samples(robot, proof, 400_000)
    assert not (found == EMPTY).any()
    assert (found == FILLED).mean() > 0.9


@pytest.mark.long
def test_filled_cells_are_reached_at_random_points(proven, random):
    robot, proof = proven
    reached = forward(robot, samples(robot, 20_000))[:, :3, 3]
    points = random.uniform(reached.min(axis=0), reached.max(axis=0), (200, 3))
    points = points[states(proof, points) == FILLED]
    missed = [point for point in points if not reachable(robot, point, random)]
    missed = [point for point in missed if not reachable(robot, point, random, 200_000)]  # few orientations do
    assert len(points) > 50
    assert not missed


@pytest.mark.long
def test_filled_cells_about_axis_1_are_reached(proven, random):
    """Their proof is another one: a cube about the axis, for joint 1 at rest."""
    robot, proof = proven
    beside = proof.proof.cells[:, 0] < 2 * (proof.proof.cells[:, 1] - proof.proof.cells[:, 0])
    filled = proof.proof.cells[beside & (proof.proof.unfilled_ratio == 0)]
    assert (filled[:, 0] == 0).sum() > 30
    for rho_0, rho_1, z_0, z_1 in filled[random.choice(len(filled), 12, replace=False)]:
        rho, azimuth, z = random.uniform(rho_0, rho_1), random.uniform(0, 2 * np.pi), random.uniform(z_0, z_1)
        point = proof.in_base(np.array([rho * np.cos(azimuth), rho * np.sin(azimuth), z]))
        assert reachable(robot, point, random) or reachable(robot, point, random, 200_000)


@pytest.mark.long
def test_bracket_narrows(proven):
    robot, proof = proven
    coarse, finer = prove_robot(robot, 500, 1).proof, proof.proof
    assert max(coarse.bounds[0], finer.bounds[0]) <= min(coarse.bounds[1], finer.bounds[1])
    assert finer.width < 0.06
    assert finer.width < 0.7 * coarse.width


@pytest.mark.long
def test_points_that_are_filled_one_by_one_are_reached_and_contradict_no_cell(proven, random):
    robot, proof = proven
    reached = forward(robot, samples(robot, 20_000))[:, :3, 3]
    points = random.uniform(reached.min(axis=0), reached.max(axis=0), (300, 3))
    rho, azimuth, z = proof.in_section(points)
    open_arcs = unfilled_about(general_arm(robot)[0], rho, z, 60_000)
    turned = azimuth[:, None] % (2 * np.pi)
    filled = ~((open_arcs[..., 0] <= turned) & (turned <= open_arcs[..., 1])).any(axis=1)
    known = states(proof, points)
    assert not (filled & (known == EMPTY)).any()
    assert filled[known == FILLED].mean() > 0.98
    assert all(reachable(robot, point, random, 20_000) for point in points[filled][:40])


@pytest.mark.parametrize(("gap", "is_open"), [((1, 0), True), ((1, 2), True), ((2, 1), True), ((0, 1), False)])
def test_a_void_is_open_to_all_sides_but_the_axis_and_nothing_is_reached_beyond_the_cells(gap, is_open):
    """Nine rings, filled but for the middle one and one beside it."""
    places = [(i, j) for i in range(3) for j in range(3)]
    unfilled = np.full((9, MAX_ARCS, 2), np.nan)
    unfilled[[places.index(each) for each in ((1, 1), gap)], 0] = 0.0, 2 * np.pi
    cells = np.array([[i, i + 1, j, j + 1] for i, j in places], float)
    section = SectionMap(Proof(cells, unfilled, unfilled.copy(), np.zeros(9, np.int64)))
    enclosed, outside = cavities(section)
    inner = ((gap[0] + 1) ** 2 - gap[0] ** 2 + 3) * np.pi  # m^3 of the two rings
    assert [cavity.upper for cavity in enclosed] == ([] if is_open else [pytest.approx(inner)])
    assert outside.upper == pytest.approx(inner if is_open else 0.0)
    beyond = section.status(np.array([3.5, 2.5]), np.zeros(2), np.array([2.5, 2.5]))
    assert beyond.tolist() == [EMPTY, FILLED]


@pytest.mark.long
def test_the_small_void_at_the_articles_shoulder_is_found():
    """About 40 mm in radius, in a workspace of 1.4 m: no cloud of 10 000 points shows it."""
    robot = load_robot("er3a_c60_article")
    large, small = cavities(prove_robot(robot, 4000, 1).section)[0]
    assert small.centroid() == pytest.approx([0, 0, 0.16977], abs=0.003)
    assert 4 / 3 * np.pi * 0.025**3 < small.lower < small.upper < 4 / 3 * np.pi * 0.065**3
    assert 0.21 < large.lower < large.upper < 0.26
    cause = cause_of(*relaxations(robot, small))
    assert is_one(cause, "void_disappears")
    assert [(limit.joints, limit.side, limit.limit, limit.by) for limit in cause.limits] == [
        ((3,), "upper", pytest.approx(75), 15)
    ]
    cause = cause_of(*relaxations(robot, large))
    assert is_one(cause, "void_disappears")
    assert {limit.joints for limit in cause.limits} <= {(2,), (3,)}


# --- workspaces known exactly ---


@pytest.mark.long
@pytest.mark.parametrize(("tool", "inner"), [(0.1, 0.1), (0.25, 0.0)])
def test_two_links_reach_a_shell(tool, inner):
    robot = two_links(tool)
    section = prove_robot(robot, 6000, 1).section
    lower, upper = section.proof.bounds
    exact = 4 / 3 * np.pi * ((0.8 + tool) ** 3 - inner**3)
    assert lower < exact < upper
    assert (upper - lower) / upper < 0.03
    enclosed, _ = cavities(section)
    assert len(enclosed) == (inner > 0)
    if enclosed:
        assert enclosed[0].lower < 4 / 3 * np.pi * inner**3 < enclosed[0].upper


@pytest.mark.long
def test_a_limited_joint_1_leaves_a_wedge():
    full = two_links(0.1)
    half = full.replace(lower=np.array([-1.0, *full.lower[1:]]), upper=np.array([1.0, *full.upper[1:]]))
    wedge = prove_robot(half, 800, 1)
    lower, upper = wedge.proof.bounds
    whole = prove_robot(full, 800, 1).proof.bounds
    assert lower <= whole[1]
    assert upper <= whole[1] * (1 + 1e-9)
    assert not (states_of_samples(half, wedge, 200_000) == EMPTY).any()


# --- odd arms ---


angles = st.floats(-np.pi, np.pi)
small = st.floats(-0.15, 0.15)


@pytest.mark.long
@settings(max_examples=5)
@given(
    st.lists(st.tuples(angles, st.floats(0, 7)), min_size=6, max_size=6),
    st.tuples(small, small, small, angles, angles, angles),
    st.tuples(small, angles, angles, angles),
    st.tuples(st.floats(0, 0.1), small, small),
    st.integers(0, 7),
)
def test_no_sample_of_a_random_arm_lies_in_an_empty_cell(limits, tool, base, offsets, locked):
    """Limits from none to more than a turn, any tool and base, a shoulder beside axis 1, at times a locked joint."""
    lower = np.array([low for low, _ in limits])
    upper = lower + np.array([0 if k == locked else span for k, (_, span) in enumerate(limits)])
    robot = Robot(
        name="random",
        title="random",
        convention="standard",
        a=[offsets[0], 0.4, offsets[1], 0, 0, 0],
        alpha=[-RIGHT, 0, -RIGHT, RIGHT, -RIGHT, 0],
        d=[0.3, offsets[2], 0, 0.35, 0, 0.08],
        direction=[1, -1, -1, 1, -1, 1],
        offset=np.zeros(6),
        lower=lower,
        upper=upper,
        tool=transform(np.array(tool[:3]), np.array(tool[3:])),
        base=transform(np.full(3, base[0]), np.array(base[1:])),
    )
    proof = prove_robot(robot, 400, 1)
    assert not (states_of_samples(robot, proof, 20_000) == EMPTY).any()
    assert 0 <= proof.proof.bounds[0] <= proof.proof.bounds[1]


@pytest.mark.long
def test_filled_holds_for_an_offset_tool_and_a_short_joint_4(random):
    plain = load_robot("er3_600")
    lower, upper = plain.lower.copy(), plain.upper.copy()
    lower[3], upper[3] = np.radians([-100, 95])
    for robot in (
        plain.replace(lower=lower, upper=upper),
        plain.replace(tool=transform(np.array([0.06, 0.03, 0.1]), np.zeros(3))),
    ):
        proof = prove_robot(robot, 1000, 1)
        points = np.stack([np.array([0.35, 0.0, 0.3]), np.array([0.25, 0.2, 0.6])])
        assert (states(proof, points) == FILLED).all()
        assert all(reachable(robot, point, random) for point in points)


# --- parts ---


@pytest.mark.long
@given(st.lists(st.tuples(st.floats(-20, 20), st.floats(0, 7)), max_size=8), st.booleans())
def test_arcs_agree_with_a_fine_grid(cuts, more):
    arcs = np.full((MAX_ARCS, 2), np.nan)
    arcs[0] = 0, 2 * np.pi
    count, kept = 1, np.ones(3600, dtype=bool)
    grid = (np.arange(3600) + 0.5) * 2 * np.pi / 3600
    for low, width in cuts:
        count = remove(arcs, count, low, low + width, more)
        kept &= ~((grid - low) % (2 * np.pi) < width) if width < 2 * np.pi else False
    assert measure(arcs, count) == pytest.approx(kept.sum() * 2 * np.pi / 3600, abs=0.003 * (len(cuts) + 1))
    for low, width in cuts[:2]:
        inside = (grid - low) % (2 * np.pi) < width if width < 2 * np.pi else np.ones(3600, dtype=bool)
        if kept[inside].any():
            assert meets(arcs, count, low, low + width)
