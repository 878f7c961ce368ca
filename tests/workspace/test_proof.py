"""The proof against random samples, the closed-form inverse and workspaces that are known exactly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.kinematics.wrist_partitioned import solve_slots
from er3a.robots.robot import Robot
from er3a.workspace.causes import Disappears, cause_of, joints_after, relaxations
from er3a.workspace.proven import (
    EMPTY,
    FILLED,
    UNDECIDED,
    SectionMap,
    cavities,
    estimate_volume,
    wilson,
    witness_joints,
)
from er3a.workspace.section_arm import MAX_ARCS, measure, meets, remove, section_arm, section_frame, wrist_and_forearm
from er3a.workspace.section_proof import Proof, judge, prove
from er3a.workspace.side_view import border

RIGHT = np.pi / 2


def about_axis_1(robot: Robot, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    R, origin = section_frame(robot)
    x, y, z = R @ (points - origin).T
    return np.hypot(x, y), np.arctan2(y, x), z


def samples(robot: Robot, count: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(robot.lower, robot.upper, (count, 6))


def states_of_samples(robot: Robot, section: SectionMap, count: int) -> np.ndarray:
    return section.status(*about_axis_1(robot, forward(robot, samples(robot, count))[:, :3, 3]))


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


@pytest.fixture(
    scope="module", params=["er3a_c60", "er3a_c60_article", pytest.param("er3_600", marks=pytest.mark.long)]
)
def proven(request):
    robot = load_robot(request.param)
    return robot, SectionMap(prove(section_arm(robot), 0.0, 3000))


# --- the known arms ---


@pytest.mark.long
def test_no_sample_lies_in_an_empty_cell(proven):
    robot, section = proven
    states = states_of_samples(robot, section, 400_000)
    assert not (states == EMPTY).any()
    assert (states == FILLED).mean() > 0.9


@pytest.mark.long
def test_filled_cells_are_reached_at_random_points(proven, random):
    robot, section = proven
    R, origin = section_frame(robot)
    low, high = section_arm(robot).heights
    n = 150
    rho, azimuth = section_arm(robot).reach * np.sqrt(random.random(n)), 2 * np.pi * random.random(n)
    z = random.uniform(low, high, n)
    chosen = section.status(rho, azimuth, z) == FILLED
    points = np.stack([rho * np.cos(azimuth), rho * np.sin(azimuth), z], axis=1)[chosen] @ R + origin
    missed = [point for point in points if not reachable(robot, point, random)]
    missed = [point for point in missed if not reachable(robot, point, random, 200_000)]  # few orientations do
    assert len(points) > 50
    assert not missed


def test_bracket_narrows_and_holds_the_estimate(proven):
    robot, section = proven
    arm = section_arm(robot)
    coarse = prove(arm, 0.0, 800)
    finer = section.proof
    assert coarse.bounds[0] <= finer.bounds[0] <= finer.bounds[1] <= coarse.bounds[1]
    assert finer.width < 0.07
    guess = estimate_volume(arm, coarse, 20_000, 7)
    assert guess.low < finer.bounds[1]
    assert guess.high > finer.bounds[0]
    assert coarse.bounds[0] < guess.low < guess.value < guess.high < coarse.bounds[1]
    assert guess.high - guess.low < 0.2 * (coarse.bounds[1] - coarse.bounds[0])
    assert guess.undecided < 40


@pytest.mark.long
def test_intervals_of_the_estimate_hold_a_volume_known_exactly():
    """A shell of radii 0.1 and 0.9 m."""
    arm, exact = section_arm(two_links(0.1)), 4 / 3 * np.pi * (0.9**3 - 0.1**3)
    proof = prove(arm, 0.0, 300)
    guesses = [estimate_volume(arm, proof, 3000, seed) for seed in range(30)]
    assert sum(guess.low <= exact <= guess.high for guess in guesses) >= 26
    assert all(proof.bounds[0] <= guess.low < guess.high <= proof.bounds[1] for guess in guesses)
    error = np.std([guess.value for guess in guesses])
    assert abs(np.mean([guess.value for guess in guesses]) - exact) < error
    assert guesses[0].high - guesses[0].low < 6 * error


def test_points_of_the_estimate_are_even_over_arcs_that_are_open(random):
    """Those of a cylinder's points that two cells, which differ in arcs and volume, leave open."""
    cells = np.array([[0.2, 0.5, -0.1, 0.2], [0.5, 0.8, -0.1, 0.2]])
    unfilled, empty = np.full((2, 2, MAX_ARCS, 2), np.nan)
    unfilled[0, :2], empty[0, 0] = [(0.0, 1.0), (3.0, 6.0)], (4.0, 5.0)
    unfilled[1, 0], empty[1, 0] = (2.0, 2.5), (2.0, 2.1)
    proof = Proof(cells, unfilled, empty, np.zeros(2, np.int64), np.zeros((2, 4)), 0)
    chosen: list[np.ndarray] = []

    def search(points):
        chosen.append(points)
        return np.ones(len(points), dtype=bool)

    estimate_volume(search, proof, 400_000, 3)
    x, y, z = chosen[0].T
    drawn = np.stack([np.hypot(x, y), np.arctan2(y, x) % (2 * np.pi), z])
    section = SectionMap(proof)
    n = 400_000
    box = np.stack([np.sqrt(random.uniform(0.04, 0.64, n)), 2 * np.pi * random.random(n), random.uniform(-0.1, 0.2, n)])
    expected = box[:, section.status(*box) == UNDECIDED]
    assert (section.status(*drawn) == UNDECIDED).all()
    assert drawn.shape[1] == pytest.approx(expected.shape[1], rel=0.03)
    bins = [np.linspace(0.2, 0.8, 7), np.linspace(0, 2 * np.pi, 13), np.linspace(-0.1, 0.2, 4)]
    shares = [np.histogramdd(points.T, bins)[0] / points.shape[1] for points in (drawn, expected)]
    np.testing.assert_allclose(*shares, atol=0.004)


@pytest.mark.parametrize(("gap", "is_open"), [((1, 0), True), ((1, 2), True), ((2, 1), True), ((0, 1), False)])
def test_a_void_is_open_to_all_sides_but_the_axis_and_nothing_is_reached_beyond_the_cells(gap, is_open):
    """Nine rings, filled but for the middle one and one beside it."""
    places = [(i, j) for i in range(3) for j in range(3)]
    unfilled = np.full((9, MAX_ARCS, 2), np.nan)
    unfilled[[places.index(each) for each in ((1, 1), gap)], 0] = 0.0, 2 * np.pi
    cells = np.array([[i, i + 1, j, j + 1] for i, j in places], float)
    section = SectionMap(Proof(cells, unfilled, unfilled.copy(), np.zeros(9, np.int64), np.zeros((9, 4)), 0))
    enclosed, outside = cavities(section)
    inner = ((gap[0] + 1) ** 2 - gap[0] ** 2 + 3) * np.pi  # m^3 of the two rings
    assert [cavity.upper for cavity in enclosed] == ([] if is_open else [pytest.approx(inner)])
    assert outside.upper == pytest.approx(inner if is_open else 0.0)
    beyond = section.status(np.array([3.5, 2.5]), np.zeros(2), np.array([2.5, 2.5]))
    assert beyond.tolist() == [EMPTY, FILLED]


@pytest.mark.parametrize(("reached", "share"), [(0.0, 0.5), (1.0, 1.0), (0.25, 0.625)])
def test_points_that_could_not_be_decided_count_half(reached, share):
    unfilled, empty = np.full((2, 1, MAX_ARCS, 2), np.nan)
    unfilled[0, 0] = 0.0, 2 * np.pi
    proof = Proof(np.array([[0.0, 1.0, 0.0, 1.0]]), unfilled, empty, np.zeros(1, np.int64), np.zeros((1, 4)), 0)

    def search(points):
        return np.arange(len(points)) < reached * len(points)

    assert estimate_volume(search, proof, 1000, 3).value == pytest.approx(share * np.pi)


def test_witnesses_reach_the_middle_of_their_cell(proven):
    robot, section = proven
    arm, proof = section_arm(robot), section.proof
    known = proof.witness[:, 3] > 0
    middle = proof.cells[known].reshape(-1, 2, 2).mean(axis=2)
    for (theta_2, tau, phi, _), (rho, z) in zip(proof.witness[known][::7], middle[::7]):
        W, f = wrist_and_forearm(arm, theta_2, tau)
        v = np.array([rho * np.cos(phi), rho * np.sin(phi), z]) - W
        assert np.linalg.norm(v) == pytest.approx(arm.d, abs=1e-9)
        assert arm.d * arm.outer_low - 1e-9 <= v @ f <= arm.d * arm.outer_high + 1e-9
        assert arm.theta_2[0] <= theta_2 <= arm.theta_2[1]
        assert arm.tau[0] <= tau <= arm.tau[1]


def test_the_small_void_at_the_articles_shoulder_is_found():
    """About 40 mm in radius, in a workspace of 1.4 m: no cloud of 10 000 points shows it."""
    robot = load_robot("er3a_c60_article")
    section = SectionMap(prove(section_arm(robot), 0.0, 3000))
    large, small = cavities(section)[0]
    assert small.centroid() == pytest.approx([0, 0, 0.16977], abs=0.003)
    assert 4 / 3 * np.pi * 0.025**3 < small.lower < small.upper < 4 / 3 * np.pi * 0.065**3
    assert 0.21 < large.lower < large.upper < 0.26
    cause = cause_of(*relaxations(robot, small))
    assert isinstance(cause, Disappears)
    assert [(limit.joints, limit.side, limit.limit, limit.by) for limit in cause.limits] == [
        ((3,), "upper", pytest.approx(75), 15)
    ]
    cause = cause_of(*relaxations(robot, large))
    limits = cause.limits if isinstance(cause, Disappears) else (cause.most,)
    assert ((3,), "lower") in [(limit.joints, limit.side) for limit in limits]
    assert joints_after(cause) & {2, 3}


def test_the_border_is_where_filled_meets_empty(proven):
    robot, section = proven
    arcs = border(section_arm(robot))
    assert len(arcs) >= 4
    for arc in arcs:
        on = section.status(arc.points[:, 0], np.zeros(len(arc.points)), arc.points[:, 1])
        assert (on == FILLED).mean() < 0.2
    radius = max(arc.points[:, 0].max() for arc in border(section_arm(robot, wrist_centre=True)))
    known = {"er3a_c60": 0.6271, "er3_600": 0.5928, "er3a_c60_article": 1.30161}[robot.name]
    assert radius == pytest.approx(known, abs=1e-4)


# --- workspaces known exactly ---


@pytest.mark.long
@pytest.mark.parametrize(("tool", "inner"), [(0.1, 0.1), (0.25, 0.0), (0.05, 0.15)])
def test_two_links_reach_a_shell(tool, inner):
    robot = two_links(tool)
    section = SectionMap(prove(section_arm(robot), 0.0, 6000))
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
    lower, upper = prove(section_arm(half), 0.0, 800).bounds
    whole = prove(section_arm(full), 0.0, 800).bounds
    assert lower <= whole[1]
    assert upper <= whole[1] * (1 + 1e-9)
    section = SectionMap(prove(section_arm(half), 0.0, 400))
    assert not (states_of_samples(half, section, 200_000) == EMPTY).any()


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
    section = SectionMap(prove(section_arm(robot), 0.0, 300, across=16))
    assert not (states_of_samples(robot, section, 20_000) == EMPTY).any()
    assert 0 <= section.proof.bounds[0] <= section.proof.bounds[1]


def test_filled_holds_for_an_offset_tool_and_a_short_joint_4(random):
    plain = load_robot("er3_600")
    lower, upper = plain.lower.copy(), plain.upper.copy()
    lower[3], upper[3] = np.radians([-100, 95])
    for robot in (
        plain.replace(lower=lower, upper=upper),
        plain.replace(tool=transform(np.array([0.06, 0.03, 0.1]), np.zeros(3))),
    ):
        arm = section_arm(robot)
        assert arm.inner_low < arm.inner_high
        section = SectionMap(prove(arm, 0.0, 1500))
        points = np.stack([np.array([0.35, 0.0, 0.3]), np.array([0.25, 0.2, 0.6])])
        R, origin = section_frame(robot)
        assert (section.status(*about_axis_1(robot, points @ R + origin)) == FILLED).all()
        assert all(reachable(robot, point, random) for point in points @ R + origin)


def test_the_zone_holds_all_samples_and_is_reached(random):
    robot = load_robot("er3a_c60").replace(tool=transform(np.array([0.05, -0.02, 0.1]), np.array([0.4, 0.3, 0.1])))
    arm = section_arm(robot)
    q = samples(robot, 20_000)
    R, origin = section_frame(robot)
    cosines = np.empty(len(q))
    points = (forward(robot, q)[:, :3, 3] - origin) @ R.T
    theta = robot.direction * q + robot.offset
    for n, (x, (t1, t2, t3, *_)) in enumerate(zip(points, theta)):
        W, f = wrist_and_forearm(arm, t2, t3)
        c, s = np.cos(t1), np.sin(t1)
        v = np.array([c * x[0] + s * x[1], c * x[1] - s * x[0], x[2]]) - W
        assert np.linalg.norm(v) == pytest.approx(arm.d, abs=1e-9)
        cosines[n] = v @ f / arm.d
    assert arm.outer_low <= cosines.min() < arm.outer_low + 0.05
    assert arm.outer_high - 0.05 < cosines.max() <= arm.outer_high


# --- parts ---


@settings(max_examples=200)
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


def test_wilson_meets_known_values():
    assert wilson(50, 100) == pytest.approx((0.4038, 0.5962), abs=1e-4)
    assert wilson(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)


def test_a_cell_judged_alone_contradicts_nothing(proven):
    """In the proof a cell begins from what is known of the one it was split off, so it may know more, never less."""
    robot, section = proven
    chosen = np.arange(0, len(section.proof.cells), 97)
    alone, known = judge(section_arm(robot), section.proof.cells[chosen]), section.proof.rows(chosen)
    assert (alone.unfilled_ratio >= known.unfilled_ratio - 1e-9).all()
    assert (alone.empty_ratio <= known.unfilled_ratio + 1e-9).all()
    assert (known.empty_ratio <= alone.unfilled_ratio + 1e-9).all()


def test_threads_change_nothing(proven):
    robot, _ = proven
    one, two = (prove(section_arm(robot), 0.0, 500, threads=threads) for threads in (1, 2))
    assert np.array_equal(one.unfilled, two.unfilled, equal_nan=True)
    assert np.array_equal(one.empty, two.empty, equal_nan=True)


def test_touched_cells_keep_a_joint_vector_that_reaches_them(proven):
    robot, section = proven
    q = witness_joints(robot, section_arm(robot), section.proof)
    known = np.flatnonzero(np.isfinite(q[:, 0]))
    assert len(known) >= 0.99 * (section.proof.witness[:, 3] > 0).sum()
    assert (q[known] >= robot.lower - 1e-12).all()
    assert (q[known] <= robot.upper + 1e-12).all()
    rho, _, z = about_axis_1(robot, forward(robot, q[known])[:, :3, 3])
    assert (section.cell_of(rho, z) == known).all()
