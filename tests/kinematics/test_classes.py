"""Solvers of further classes of arms, against chains written out anew and against each other."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from er3a.geometry.transforms import rot_z
from er3a.kinematics.chain import poses_of
from er3a.kinematics.classes.arm_angle import (
    arm_angle_arm,
    arm_angles_of,
    is_out_of_reach,
    solve_at_arm_angle,
)
from er3a.kinematics.classes.chain_solvers import chain_solver
from er3a.kinematics.classes.four_bar import four_bars, solve_three_parallel
from er3a.kinematics.classes.hidden_joint import TERMS, zeros_on_circle
from er3a.kinematics.classes.parallel_axes import three_parallel
from er3a.kinematics.classes.scara import scara, solve_scara
from er3a.kinematics.classes.six_revolute import CERTAIN, prepared, solve_six_revolute
from testing.arms import links_of_rows

pytestmark = pytest.mark.long  # kernels that take half a minute to compile

H = np.pi / 2
ROWS = {
    "ur5": ([0, -0.425, -0.39225, 0, 0, 0], [H, 0, 0, H, -H, 0], [0.089159, 0, 0, 0.10915, 0.09465, 0.0823]),
    "oblique_ur": ([0.1, 0.4, 0.37, 0.05, 0, 0.02], [1.1, 0, np.pi, -0.8, 1.3, 0.4], [0.3, 0.05, -0.1, 0.13, 0, 0.09]),
    "crx": ([0, 0.71, 0, 0, 0, 0], [-H, np.pi, -H, H, -H, np.pi], [0, 0, 0, -0.54, 0.15, -0.16]),
    "manseur_doty": ([0.3, 1, 0, 1.5, 0, 0], [H, 0.0174532925, H, 0.0174532925, H, 0.0174532925], [0, 0, 0.2, 0, 0, 0]),
    "puma": ([0, 0.4318, 0.0203, 0, 0, 0], [H, 0, -H, H, -H, 0], [0, 0, 0.15005, 0.4318, 0, 0.1]),
    "iiwa": ([0] * 7, [-H, H, H, -H, -H, H, 0], [0.34, 0, 0.4, 0, 0.4, 0, 0.126]),
    "oblique_srs": (
        [0, 0, 0.05, -0.07, 0, 0, 0.03],
        [-1.2, 1.4, 1.3, -H, -1.1, 1.5, 0.4],
        [0.3, 0, 0.4, 0, 0.4, 0, 0.1],
    ),
    "panda": ([0, 0, 0.0825, -0.0825, 0, 0.088, 0], [-H, H, H, -H, H, H, 0], [0.333, 0, 0.316, 0, 0.384, 0, 0.107]),
}


def links(name: str) -> np.ndarray:
    return links_of_rows(*(np.array(column, float) for column in ROWS[name]))


def pose_by_hand(rows, q: np.ndarray, sliding=None) -> np.ndarray:
    """The product of the textbook's D-H matrices, written out."""
    T = np.eye(4)
    for k, (a, alpha, d) in enumerate(zip(*rows)):
        theta = 0.0 if sliding is not None and sliding[k] else q[k]
        d = d + q[k] if sliding is not None and sliding[k] else d
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        T = T @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
    return T


def turn(q: np.ndarray) -> np.ndarray:
    return q - 2 * np.pi * np.round(q / (2 * np.pi))


def nearest(rows: np.ndarray, q: np.ndarray, sliding=False) -> float:
    """Largest joint difference of the row that is nearest to q."""
    away = np.where(sliding, rows - q, turn(rows - q))
    return float(np.nanmin(np.where(np.isnan(away).any(axis=-1), np.inf, np.abs(away).max(axis=-1))))


def multistart(chain: np.ndarray, T: np.ndarray, random, starts: int = 150) -> np.ndarray:
    """Roots that Newton's method with a numerical Jacobian finds from random starts, all starts at once."""
    q = random.uniform(-np.pi, np.pi, (starts, 6))

    def error(q):
        P = poses_of(chain, q)
        R = P[:, :3, :3] @ T[:3, :3].T
        w = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
        return np.concatenate([P[:, :3, 3] - T[:3, 3], w / 2], axis=1), np.trace(R, axis1=1, axis2=2)

    step = 1e-6
    for _ in range(40):
        e, _ = error(q)
        J = np.stack([(error(q + step * x)[0] - error(q - step * x)[0]) / (2 * step) for x in np.eye(6)], axis=2)
        damped = np.swapaxes(J, 1, 2) @ J + 1e-3 * (e * e).sum(axis=1)[:, None, None] * np.eye(6) + 1e-13 * np.eye(6)
        q = q - np.linalg.solve(damped, np.swapaxes(J, 1, 2) @ e[:, :, None])[..., 0]
    e, trace = error(q)
    found: list[np.ndarray] = []
    for row in turn(q[(np.abs(e).max(axis=1) < 1e-10) & (trace > 2.9)]):
        if not any(np.abs(turn(row - other)).max() < 1e-4 for other in found):
            found.append(row)
    return np.array(found).reshape(-1, 6)


@pytest.mark.parametrize("name", ["crx", "manseur_doty", "ur5", "puma"])
def test_general_solver_finds_the_arm_it_came_from(name):
    random = np.random.default_rng(3)
    chain = links(name)
    arm = prepared(chain)
    q = random.uniform(-np.pi, np.pi, (150, 6))
    T = np.array([pose_by_hand(ROWS[name], row) for row in q])
    found = solve_six_revolute(arm, T)
    assert max(nearest(found.q[n], q[n]) for n in range(len(q))) < 1e-6
    for n in range(len(q)):
        for row in found.q[n, : found.count[n]]:
            assert np.abs(pose_by_hand(ROWS[name], row) - T[n]).max() < 1e-11
        rows = found.q[n, : found.count[n]]
        apart = np.abs(turn(rows[:, None] - rows[None])).max(axis=2) + 9 * np.eye(len(rows))
        assert apart.min() > 1e-6
    assert (found.count % 2 == 0).all()


@pytest.mark.parametrize("name", ["crx", "manseur_doty"])
def test_sixteen_solutions_exist(name):
    random = np.random.default_rng(11)
    arm, chain = prepared(links(name)), links(name)
    found = solve_six_revolute(arm, poses_of(chain, random.uniform(-np.pi, np.pi, (1500, 6))))
    assert found.count.max() == 16


@pytest.mark.parametrize("name", ["crx", "manseur_doty", "random"])
def test_multistart_finds_nothing_more(name):
    random = np.random.default_rng(5)
    chain = (
        links(name)
        if name != "random"
        else links_of_rows(random.uniform(-1, 1, 6), random.uniform(-3, 3, 6), random.uniform(-1, 1, 6))
    )
    arm = prepared(chain)
    T = poses_of(chain, random.uniform(-np.pi, np.pi, (4, 6)))
    found = solve_six_revolute(arm, T)
    for n, pose in enumerate(T):
        peers = multistart(chain, pose, random)
        assert len(peers) >= 2
        assert len(peers) <= found.count[n]
        assert all(nearest(found.q[n], row) < 1e-6 for row in peers)


@given(st.integers(0, 2**31), st.sampled_from(["puma", "ur5", "crx"]), st.sampled_from([1e-8, 1e-6, 1e-4, 1e-2]))
@example(2536, "puma", 1e-8)  # no more than noise in four of ten readings
@example(1021, "puma", 1e-3)  # ten zeros within five degrees
def test_general_solver_beside_special_geometry(seed, name, size):
    random = np.random.default_rng(seed)
    a, alpha, d = (np.array(column, float) + size * random.uniform(-1, 1, 6) for column in ROWS[name])
    chain = links_of_rows(a, alpha, d)
    q = random.uniform(-np.pi, np.pi, (20, 6))
    found = solve_six_revolute(prepared(chain), poses_of(chain, q))
    away = [nearest(found.q[n], q[n]) for n in range(len(q))]
    # next to a singularity joints are told less exactly; an arm that is missed is not near at all
    assert max(away) < 1e-4


def test_one_prismatic_joint():
    random = np.random.default_rng(2)
    rows = ([0] * 6, [-H, H, 0, -H, H, 0], [0.412, 0.154, 0, 0, 0, 0.263])  # Stanford arm
    sliding = np.array([0, 0, 1, 0, 0, 0], bool)
    arm = prepared(links_of_rows(*(np.array(column, float) for column in rows)), sliding)
    q = random.uniform(-np.pi, np.pi, (40, 6))
    q[:, 2] = random.uniform(0.2, 1.0, 40)
    T = np.array([pose_by_hand(rows, row, sliding) for row in q])
    found = solve_six_revolute(arm, T)
    for n in range(len(q)):
        assert nearest(found.q[n], q[n], sliding) < 1e-6
        for row in found.q[n, : found.count[n]]:
            assert np.abs(pose_by_hand(rows, row, sliding) - T[n]).max() < 1e-11


@pytest.mark.parametrize("name", ["ur5", "oblique_ur"])
def test_three_parallel_axes_agree_with_the_general_solver(name):
    random = np.random.default_rng(8)
    chain = links(name)
    arm = three_parallel(chain)
    q = random.uniform(-np.pi, np.pi, (200, 6))
    T = np.array([pose_by_hand(ROWS[name], row) for row in q])
    rows, singular = solve_three_parallel(arm, T)
    general = solve_six_revolute(prepared(chain), T)
    for n in np.flatnonzero(~singular):
        solved = rows[n, np.isfinite(rows[n, :, 0])]
        assert nearest(solved, q[n]) < 1e-8
        assert len(solved) == general.count[n]
        for row in solved:
            assert np.abs(pose_by_hand(ROWS[name], row) - T[n]).max() < 1e-12
            assert nearest(general.q[n], row) < 1e-7


@pytest.mark.parametrize("q5", [0.0, np.pi])
def test_four_bar_of_a_ur(q5):
    random = np.random.default_rng(4)
    arm = three_parallel(links("ur5"))
    for _ in range(20):
        q = random.uniform(-np.pi, np.pi, 6)
        q[4] = q5
        T = pose_by_hand(ROWS["ur5"], q)
        families = [each for each in four_bars(arm, T) if abs(turn(each.theta_1 - q[0])) < 1e-7]
        assert len(families) == 1
        family, away = families[0], np.inf
        assert abs(turn(family.theta_5 - q5)) < 1e-9
        for low, high in family.intervals:
            for elbow in (0, 1):
                rows = family.members(np.linspace(low, high, 2001), elbow)
                assert np.isfinite(rows).all()
                assert max(np.abs(pose_by_hand(ROWS["ur5"], row) - T).max() for row in rows[::100]) < 1e-11
                away = min(away, nearest(rows, q))
            if high - low < 2 * np.pi - 1e-9:
                assert np.isnan(family.members(np.array([low - 1e-6, high + 1e-6]), 0)).all()
                ends = [family.members(np.array([low, high]), elbow) for elbow in (0, 1)]
                assert np.abs(turn(ends[0] - ends[1])).max() < 1e-5
        assert away < 0.05
        rows, singular = solve_three_parallel(arm, T[None])
        assert singular[0]
        solved = rows[0, np.isfinite(rows[0, :, 0])]
        assert 2 <= len(solved) <= 8
        assert max(np.abs(pose_by_hand(ROWS["ur5"], row) - T).max() for row in solved) < 1e-10


@pytest.mark.parametrize("name", ["iiwa", "oblique_srs"])
def test_arm_angle(name):
    random = np.random.default_rng(6)
    arm = arm_angle_arm(links(name))
    q = random.uniform(-3, 3, (300, 7))
    T = np.array([pose_by_hand(ROWS[name], row) for row in q])
    psi = arm_angles_of(arm, q)
    rows, singular = solve_at_arm_angle(arm, T, psi)
    assert not singular.any()
    for n in range(len(q)):
        solved = rows[n, np.isfinite(rows[n, :, 0])]
        assert nearest(solved, q[n]) < 1e-7
        assert np.abs(turn(arm_angles_of(arm, solved) - psi[n])).max() < 1e-9
        for row in solved:
            assert np.abs(pose_by_hand(ROWS[name], row) - T[n]).max() < 1e-12


@pytest.mark.parametrize("name", ["iiwa", "oblique_srs"])
@pytest.mark.parametrize("bent", [0.0, np.pi])
def test_out_of_reach_begins_where_the_elbow_is_straight_or_folded(name, bent):
    """With joint 4 at the least (0) and greatest distance of S and W, and W moved 0.1 mm along their line."""
    random = np.random.default_rng(8)
    arm = arm_angle_arm(links(name))
    k = arm.constants
    for q in random.uniform(-3, 3, (20, 7)):
        q[3] = bent - k.zero_4
        T = pose_by_hand(ROWS[name], q)
        along = T[:3, 3] + T[:3, :3] @ np.array(k.wrist_in_tool) - np.array(k.shoulder)
        if bent == 0.0 and np.linalg.norm(along) < 1e-3:  # forearm and upper arm of one length: S is as near as it gets
            assert not is_out_of_reach(arm, T)
            continue
        outward = (along if bent else -along) / np.linalg.norm(along)
        beyond, inside = T.copy(), T.copy()
        beyond[:3, 3] += 1e-4 * outward
        inside[:3, 3] -= 1e-4 * outward
        assert is_out_of_reach(arm, beyond)
        assert not is_out_of_reach(arm, inside)
        assert np.isnan(solve_at_arm_angle(arm, np.tile(beyond, (9, 1, 1)), np.linspace(-3, 3, 9))[0]).all()


def test_scara_and_other_seven_joints():
    random = np.random.default_rng(9)
    rows = ([0.325, 0.225, 0, 0], [0, np.pi, 0, 0], [0.4, 0, 0.1, 0.05])
    sliding = np.array([0, 0, 1, 0], bool)
    arm = scara(links_of_rows(*(np.array(column, float) for column in rows)), sliding)
    for q in random.uniform(-2, 2, (20, 4)):
        T = pose_by_hand(rows, q, sliding)
        found, tilt = solve_scara(arm, T[None])
        assert tilt[0] < 1e-12
        assert nearest(found[0], q) < 1e-7
        assert max(np.abs(pose_by_hand(rows, row, sliding) - T).max() for row in found[0]) < 1e-12
    q = random.uniform(-2, 2, 7)
    whole = links("panda")
    held = np.concatenate([whole[:6], (whole[6] @ rot_z(q[6]) @ whole[7])[None]])
    found = solve_six_revolute(prepared(held), pose_by_hand(ROWS["panda"], q)[None])
    assert nearest(found.q[0], q[:6]) < 1e-7
    short = links_of_rows(*(np.array(column[:5], float) for column in ROWS["ur5"]))
    q = random.uniform(-2, 2, 6)
    rolling = np.concatenate([short, np.eye(4)[None]])
    found = solve_six_revolute(prepared(rolling), poses_of(rolling, q)[None])
    assert nearest(found.q[0], q) < 1e-7


@pytest.mark.parametrize(
    ("name", "code"),
    [
        ("ur5", "three_parallel"),
        ("oblique_ur", "three_parallel"),
        ("crx", "general_six"),
        ("manseur_doty", "general_six"),
        ("puma", "spherical_wrist"),
        ("iiwa", "arm_angle"),
        ("panda", "redundant"),
    ],
)
def test_classes(name, code):
    chain = links(name)
    assert chain_solver(chain, np.zeros(len(chain) - 1, dtype=bool)).code == code


@given(st.lists(st.floats(-3.1, 3.1), min_size=1, max_size=8, unique=True), st.integers(0, 1000))
def test_zeros_on_a_circle(angles, seed):
    random = np.random.default_rng(seed)
    angles = sorted(angles)
    if any(b - a < 1e-3 for a, b in pairwise(angles)) or len(angles) % 2:
        return
    grid = 2 * np.pi * np.arange(64) / 64
    values = np.prod([np.sin((grid - x) / 2) for x in angles], axis=0)
    values = values * (1.5 + np.cos(grid - random.uniform(-3, 3)))
    spectrum = np.fft.rfft(values) / 32
    terms = np.zeros(20)
    terms[0], terms[1:17:2], terms[2:17:2] = spectrum[0].real / 2, spectrum[1:9].real, -spectrum[1:9].imag
    found = np.zeros((48, 3))
    count = zeros_on_circle(terms, 1e-13 * np.abs(values).max(), found, np.zeros((100, TERMS + 2)))
    told = found[:count]
    for x in angles:
        low, high = turn(told[:, 0] - x), turn(told[:, 1] - x)
        assert ((low < 1e-6) & (high > -1e-6)).any()
    for low, high, _ in told:
        assert any(turn(np.array(low - x)) < 1e-6 and turn(np.array(high - x)) > -1e-6 for x in angles)


def test_regular_poses_of_a_general_arm_leave_no_doubt():
    random = np.random.default_rng(1)
    chain = links_of_rows(random.uniform(-1, 1, 6), random.uniform(-3, 3, 6), random.uniform(-1, 1, 6))
    found = solve_six_revolute(prepared(chain), poses_of(chain, random.uniform(-3, 3, (100, 6))))
    assert (found.certainty == CERTAIN).mean() > 0.95


def test_branches_beside_a_self_motion_are_kept():
    """Where one root of joint 1 has a four-bar, those of the other stand alone."""
    random = np.random.default_rng(0)
    arm = three_parallel(links("ur5"))
    for _ in range(60):
        q = random.uniform(-2.5, 2.5, 6)
        q[4] = 0.0
        T = pose_by_hand(ROWS["ur5"], q)
        rows = solve_three_parallel(arm, T[None])[0][0]
        solved = rows[np.isfinite(rows[:, 0])]
        alone = solved[np.abs(np.sin(solved[:, 4])) > 1e-6]
        general = solve_six_revolute(prepared(links("ur5")), T[None]).q[0]
        general = general[np.isfinite(general[:, 0])]
        wanted = general[np.abs(np.sin(general[:, 4])) > 1e-6]
        assert all(nearest(alone, row) < 1e-6 for row in wanted)
