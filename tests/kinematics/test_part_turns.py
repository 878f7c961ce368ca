"""Arms behind gears and ball screws: all motor values are the lattice C^-1 (u + whole turns of rows), limits kept."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.robots import joint_limits
from er3a.robots.joint_limits import nearest_equivalent
from er3a.robots.robot import CombinedLimit, Robot

UPPER, FORE, TURN = 0.3, 0.25, 2 * np.pi
COUPLINGS = {
    "gear of half a turn": [[1, 0, 0, 0], [0.5, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
    "gears of its own": [[0.5, 0, 0, 0], [0, 2, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1 / 3]],
    "ball screw": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.02], [0, 0, 0, 1]],
    "screw and nut": [[1, 0, 0, 0], [0, 1, 0, 0], [-0.03, 0, 1, 0.02], [0, 0, 0.4, 1]],
    "all": [[1, 0.2, 0.1, -0.3], [0.3, 0.8, 0, 0.1], [0, 0.02, 1, 0.01], [-0.4, 0.1, 0.2, 1.2]],
}


def scara(coupling: list, combined: tuple[CombinedLimit, ...] = (), most: float = 7.0, **changes) -> Robot:
    """Two links in a plane, a slide and a turn."""
    return Robot(
        name="scara",
        title="SCARA",
        convention="standard",
        a=[UPPER, FORE, 0, 0],
        alpha=np.zeros(4),
        d=np.zeros(4),
        direction=np.ones(4),
        offset=np.zeros(4),
        lower=np.array([-most, -most, -0.3, -most]),
        upper=np.array([most, most, 0.4, most]),
        sliding=np.arange(4) == 2,
        coupling=np.array(coupling, float),
        combined=combined,
        **changes,
    )


def both_elbows(T: np.ndarray) -> np.ndarray:
    """What the rows move by (2, 4), by the law of cosines."""
    x, y, z, yaw = *T[:3, 3], np.arctan2(T[1, 0], T[0, 0])
    bend = np.arccos((x * x + y * y - UPPER**2 - FORE**2) / (2 * UPPER * FORE))
    rows = []
    for second in (bend, -bend):
        first = np.arctan2(y, x) - np.arctan2(FORE * np.sin(second), UPPER + FORE * np.cos(second))
        rows.append([first, second, z, yaw - first - second])
    return np.array(rows)


def lattice(robot: Robot, u: np.ndarray) -> np.ndarray:
    """All joints (k, 4) within the limits that move rows by u but for whole turns of those that turn."""
    far = np.abs(robot.coupling) @ np.maximum(np.abs(robot.lower), np.abs(robot.upper))
    turns = [range(-k, k + 1) for k in (np.ceil((far + np.abs(u)) / TURN).astype(int) * ~robot.sliding).tolist()]
    q = np.linalg.solve(robot.coupling, (u + TURN * np.array(list(product(*turns)))).T).T
    fits = ((q <= robot.upper + 1e-9) & (q >= robot.lower - 1e-9)).all(axis=1)
    for limit in robot.combined:
        total = q @ np.array(limit.factors)
        fits &= (total <= limit.upper + 1e-9) & (total >= limit.lower - 1e-9)
    return q[fits]


@pytest.mark.parametrize("summed", [(), (CombinedLimit((1.0, 1.0, 0.0, 0.5), -4.0, 5.0),)], ids=["alone", "sum"])
@pytest.mark.parametrize("name", COUPLINGS)
def test_all_motor_values_are_the_lattice_of_whole_turns(name, summed, random):
    robot = scara(COUPLINGS[name], summed)
    done = 0
    while done < 12:
        q, ref = random.uniform(robot.lower, robot.upper, (2, 4))
        if any(not limit.lower <= q @ np.array(limit.factors) <= limit.upper for limit in summed):
            continue
        done += 1
        T = forward(robot, q)
        each = [lattice(robot, u) for u in both_elbows(T)]
        expected = np.concatenate(each)
        found = inverse(robot, T, q)
        got = found.q[found.within_limits]
        assert found.method.code == "by_class"
        assert len(got) == len(expected)
        assert np.abs(got[:, None] - expected).max(axis=2).min(axis=0).max() < 1e-7
        assert np.abs(forward(robot, found.q) - T).max() < 1e-9
        batch = inverse_batch(robot, T[None], ref)
        for rows in each:
            nearest = np.abs(rows - ref).max(axis=1, initial=0.0).min(initial=np.inf)
            slot = [row for row in batch.q[0][batch.within_limits[0]] if len(rows) and _among(rows, row)]
            assert len(slot) == min(1, len(rows))
            assert not slot or np.abs(slot[0] - ref).max() == pytest.approx(nearest, abs=1e-7)


def _among(rows: np.ndarray, row: np.ndarray) -> bool:
    return bool(np.abs(rows - row).max(axis=1).min() < 1e-7)


def test_without_room_the_turns_that_leave_limits_least_are_told(random):
    robot = scara(COUPLINGS["gear of half a turn"], most=1.2)
    for _ in range(50):
        q = random.uniform(-6, 6, 4) * [1, 1, 0, 1]
        given = nearest_equivalent(robot, q, np.zeros(4))
        away = robot.coupling @ (given - q) / TURN
        assert np.abs(away - np.round(away))[[0, 1, 3]].max() < 1e-9
        steps = np.array(list(product(range(-3, 4), repeat=3))) @ np.eye(4)[[0, 1, 3]]
        every = q + np.linalg.solve(robot.coupling, TURN * steps.T).T
        every = np.concatenate([every, every - TURN * np.array([1, -0.5, 0, 0])])
        excess = np.maximum(np.maximum(every - robot.upper, robot.lower - every), 0).sum(axis=1)
        own = np.maximum(np.maximum(given - robot.upper, robot.lower - given), 0).sum()
        assert own <= excess.min() + 1e-8


def test_a_continuous_joint_behind_a_gear_is_taken_where_the_others_keep_their_limits(random):
    """Row 2 turns by a third of joint 1's turns: three turns of joint 1 are needed to have joint 2 where it may be."""
    coupling = [[1, 0, 0, 0], [1 / 3, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    robot = scara(coupling, continuous=np.arange(4) == 0)
    robot = robot.replace(lower=robot.lower * [1, 0.15, 1, 1], upper=robot.upper * [1, 0.15, 1, 1])
    for _ in range(20):
        q = random.uniform(robot.lower, robot.upper)
        q[0] = random.uniform(-9, 9)
        batch = inverse_batch(robot, forward(robot, q)[None])
        assert (np.abs(batch.q[0][batch.within_limits[0]] - q)[:, 1:3].max(axis=1) < 1e-7).any()


@pytest.mark.parametrize("name", ["er3a_c60", "ur5e", "lbr_iiwa_14"])
def test_turns_of_joints_that_turn_by_themselves_are_those_that_the_search_finds(name, random, monkeypatch):
    robot = load_robot(name)
    for _ in range(50):
        q, q_ref = random.uniform(-4, 4, (random.integers(1, 9), robot.joints)), random.uniform(-3, 3, robot.joints)
        listed = joint_limits.equivalents_within(robot, q, q_ref)
        with monkeypatch.context() as searching:
            searching.setattr(joint_limits, "ROOMS", ())
            found = joint_limits.equivalents_within(robot, q, q_ref)
        assert all(np.array_equal(one, other) for one, other in zip(listed, found))
