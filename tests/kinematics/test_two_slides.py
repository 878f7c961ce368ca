"""Six joints of which one or two slide, against D-H matrices written out and Newton's method from many starts."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from er3a.finding import fact
from er3a.kinematics.classes.chain_solvers import chain_solver
from er3a.kinematics.classes.six_revolute import CERTAIN, CONTINUUM
from er3a.kinematics.inverse import inverse
from er3a.robots.robot import Robot
from testing.arms import links_of_rows

pytestmark = pytest.mark.long  # kernels that take half a minute to compile

PAIRS = list(combinations(range(6), 2))
Rows = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def flags(pair) -> np.ndarray:
    sliding = np.zeros(6, bool)
    sliding[list(pair)] = True
    return sliding


def poses(rows: Rows, sliding: np.ndarray, q: np.ndarray) -> np.ndarray:
    """The product of the textbook's D-H matrices (N, 4, 4), written out."""
    T = np.tile(np.eye(4), (len(q), 1, 1))
    for k, (a, alpha, d, theta) in enumerate(zip(*rows)):
        turn = np.full(len(q), theta) if sliding[k] else q[:, k]
        along = d + q[:, k] if sliding[k] else np.full(len(q), d)
        c, s, ca, sa, one = np.cos(turn), np.sin(turn), np.cos(alpha), np.sin(alpha), np.ones(len(q))
        step = [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0 * one, sa * one, ca * one, along]]
        T = T @ np.concatenate([np.array(step), np.array([[0 * one, 0 * one, 0 * one, one]])]).transpose(2, 0, 1)
    return T


def away(x: np.ndarray, y: np.ndarray, sliding: np.ndarray) -> np.ndarray:
    step = x - y
    return np.abs(np.where(sliding, step, step - 2 * np.pi * np.round(step / (2 * np.pi)))).max(axis=-1)


def multistart(rows: Rows, sliding: np.ndarray, T: np.ndarray, random, starts: int = 60) -> np.ndarray:
    """Roots that damped steps with a numerical Jacobian find from random starts, all at once."""
    q = random.uniform(-1, 1, (starts, 6)) * np.where(sliding, 2.0, np.pi)

    def error(q):
        P = poses(rows, sliding, q)
        R = P[:, :3, :3] @ T[:3, :3].T
        w = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
        return np.concatenate([P[:, :3, 3] - T[:3, 3], w / 2], axis=1), np.trace(R, axis1=1, axis2=2)

    for _ in range(40):
        e, _ = error(q)
        J = np.stack([(error(q + 1e-6 * x)[0] - error(q - 1e-6 * x)[0]) / 2e-6 for x in np.eye(6)], axis=2)
        damped = np.swapaxes(J, 1, 2) @ J + (1e-3 * (e * e).sum(axis=1) + 1e-13)[:, None, None] * np.eye(6)
        q = q - np.linalg.solve(damped, np.swapaxes(J, 1, 2) @ e[:, :, None])[..., 0]
    e, trace = error(q)
    found: list[np.ndarray] = []
    for row in q[(np.abs(e).max(axis=1) < 1e-9) & (trace > 2.9)]:
        if not any(away(row, other, sliding) < 1e-4 for other in found):
            found.append(row)
    return np.array(found).reshape(-1, 6)


def general(random, sliding) -> Rows:
    lengths = random.uniform(-0.5, 0.5, (2, 6))
    return lengths[0], random.uniform(-np.pi, np.pi, 6), lengths[1], random.uniform(-3, 3, 6) * sliding


def special(random, sliding) -> Rows:
    H = np.pi / 2
    alpha = random.choice([0, H, -H, np.pi, 0.7], 6, p=[0.25, 0.25, 0.25, 0.1, 0.15])
    a, d = random.choice([0, 0, 0.3, 0.4], 6), random.choice([0, 0, 0.2, 0.35], 6)
    return a, alpha, d, random.choice([0, H, 0.6], 6) * sliding


@pytest.mark.parametrize("travel", [1.0, 100.0])
def test_every_order_finds_its_own_joints_and_nothing_else(travel, random):
    for pair in PAIRS:
        sliding = flags(pair)
        rows = general(random, sliding)
        solver = chain_solver(links_of_rows(*rows), sliding)
        assert solver.code == "six_two_prismatic"
        q = random.uniform(-1, 1, (25, 6)) * np.where(sliding, travel, np.pi)
        T = poses(rows, sliding, q)
        x, _ = solver.rows(T, np.empty((25, 0)))
        for n in range(len(q)):
            found = x[n][np.isfinite(x[n, :, 0])]
            assert away(found, q[n], sliding).min() < 1e-6
            assert np.abs(poses(rows, sliding, found) - T[n]).max() < 1e-9 * travel
            assert len(found) in (2, 4, 6, 8)
            apart = away(found[:, None], found[None], sliding) + 9 * np.eye(len(found))
            assert apart.min() > 1e-6


@pytest.mark.parametrize("geometry", [general, special])
def test_many_starts_find_nothing_more(geometry, random):
    peers = 0
    for pair in PAIRS:
        sliding = flags(pair)
        rows = geometry(random, sliding)
        solver = chain_solver(links_of_rows(*rows), sliding)
        if solver.code == "dependent":
            continue
        q = random.uniform(-1, 1, (2, 6)) * np.where(sliding, 1.0, np.pi)
        T = poses(rows, sliding, q)
        x, certainty = solver.rows(T, np.empty((2, 0)))
        for n in np.flatnonzero(certainty == CERTAIN):
            for row in multistart(rows, sliding, T[n], random):
                peers += 1
                assert away(x[n], row, sliding)[np.isfinite(x[n, :, 0])].min(initial=9.0) < 1e-4
    assert peers > 25


def robot(rows: Rows, sliding) -> Robot:
    a, alpha, d, offset = rows
    limit, ones = np.where(sliding, 2.0, 3.1), np.ones(6)
    return Robot("made", "made", "standard", a, alpha, d, ones, offset, -limit, limit, sliding=sliding)


def test_slides_that_are_always_parallel_are_said_to_be_dependent(random):
    sliding = flags((0, 2))
    a, alpha, d, offset = general(random, sliding)
    alpha[:2] = 0.0  # joint 2 turns about the direction of both slides
    arm = robot((a, alpha, d, offset), sliding)
    q = random.uniform(-1, 1, 6)
    found = inverse(arm, poses((a, alpha, d, offset), sliding, q[None])[0], q)
    assert found.method == fact("iteration", starts=found.method.starts, lacking=fact("dependent_joints"))
    assert away(found.q, q, sliding).min() < 1e-6


def test_slides_that_are_parallel_at_one_pose_have_a_self_motion(random):
    H = np.pi / 2
    sliding = flags((0, 2))
    rows = np.zeros(6), np.array([H, -H, 0.8, 0.9, -1.1, 0]), np.array([0, 0.2, 0.3, 0.25, 0.3, 0.1]), np.zeros(6)
    arm = robot(rows, sliding)
    q = np.array([0.3, 0.0, -0.4, 0.5, 1.2, -0.7])  # joint 2 at 0: slides 1 and 3 undo each other
    T = poses(rows, sliding, q[None])
    assert chain_solver(links_of_rows(*rows), sliding).rows(T, np.empty((1, 0)))[1][0] == CONTINUUM
    found = inverse(arm, T[0], q)
    assert away(found.q, q, sliding).min() < 1e-6
    (motion, *_) = [each for each in found.families if each.within_limits and abs(each.direction[[0, 2]]).min() > 0.1]
    members = motion.members(np.linspace(*motion.range, 9))
    assert np.ptp(members[:, 0]) > 1.0
    assert np.abs(poses(rows, sliding, members) - T[0]).max() < 1e-8


H = np.pi / 2
ONE_SLIDE = {  # readings of the loop with the slide among the joints that are eliminated last tell nothing of them
    "quill": ([0.3, 0, 0, 0.1, 0, 0], [0, 1.32 * H, -H, 0, -H, -1.9], [0, -0.75, 0, 0.05, 0.3, 0], 5),
    "rail": ([0.1, 0, 0.1, 0, 0.19, 0], [H, H, 0, H, -H, H], [0, 0, -0.47, 0.1, 0, 0], 0),
    "zeros that all stand twice": (
        [0, 0.092, 0.3, 0.3, -0.869, 0], [H, np.pi, 0.13, -H, -1.48, -H], [-0.78, 0.1, -0.719, -0.806, 0, 0], 4
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ONE_SLIDE)
def test_one_slide_that_only_a_reading_from_it_on_can_solve(name, random):
    a, alpha, d, place = ONE_SLIDE[name]
    sliding = flags([place])
    rows = np.array(a), np.array(alpha), np.array(d), np.zeros(6)
    arm = robot(rows, sliding).replace(lower=-np.full(6, 9.0), upper=np.full(6, 9.0))
    q = random.uniform(-1, 1, (4, 6)) * np.where(sliding, 1.0, np.pi)
    for own, T in zip(q, poses(rows, sliding, q)):
        found = inverse(arm, T)
        assert found.method.arm_class == "six_one_prismatic"
        assert np.abs(poses(rows, sliding, found.q) - T).max() < 1e-9
        for row in [own, *multistart(rows, sliding, T, random)]:
            on_family = any(motion.chain.holds(motion.curve, row) for motion in found.families)
            assert on_family or away(found.q, row, sliding).min(initial=9.0) < 1e-4
