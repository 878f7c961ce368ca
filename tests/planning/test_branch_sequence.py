"""The branch sequence against every other sequence, tried one by one."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward
from er3a.planning.follow import WIDE_STEP, branches_along, follow, turned_difference, with_whole_turns
from er3a.planning.moves import line

pytestmark = pytest.mark.long

GRID = np.linspace(0, 1, 121)


def through_aligned_wrist(robot, random):
    """A line that meets an aligned wrist somewhere, with the tool turning, so that axes 4 and 6 wind up."""
    q = random.uniform(robot.lower, robot.upper) * 0.7
    q[4] = 0.0
    middle = forward(robot, q)
    share = random.uniform(0.3, 0.7)
    step, turn = random.uniform(-0.1, 0.1, 3), random.uniform(-1, 1, 3)
    turn *= random.uniform(1.5, 3.0) / np.linalg.norm(turn)
    ends = []
    for part in (-share, 1 - share):
        T = middle.copy()
        T[:3, 3] += part * step
        T[:3, :3] = Rotation.from_rotvec(part * turn).as_matrix() @ middle[:3, :3]
        ends.append(T)
    return line(*ends, 1.0)


def every_sequence(grid):
    """All sequences without jumps that change branch twice at most, only where branches meet."""
    n = len(grid.t)
    steps = np.abs(turned_difference(grid.q[:-1, :, None], grid.q[1:, None])).max(axis=-1)
    near = grid.meeting[:-1].any(axis=1) | grid.meeting[1:].any(axis=1)
    places = np.flatnonzero(near)
    for start in range(8):
        for changes in range(3):
            for at in combinations(places, changes):
                for to in product(range(8), repeat=changes):
                    slot = np.full(n, start)
                    for place, branch in zip(at, to):
                        slot[place + 1 :] = branch
                    taken = steps[np.arange(n - 1), slot[:-1], slot[1:]]
                    if (taken <= WIDE_STEP).all():
                        yield slot


@pytest.mark.parametrize("name", ["er3a_c60", "er3_600"])
def test_no_other_sequence_stays_within_limits_for_longer(name):
    robot, random = load_robot(name), np.random.default_rng(6)
    compared, switched = 0, 0
    while compared < 8:
        path = through_aligned_wrist(robot, random)
        grid = branches_along(robot, path, GRID)
        if not grid.reached.all() or grid.meeting.any(axis=1).sum() > 4 or grid.free_shoulder.any():
            continue
        share = np.gradient(grid.t)
        none = np.zeros(len(grid.t) - 1, bool)
        costs = {
            tuple(slot): with_whole_turns(robot, grid.q[np.arange(len(slot)), slot], slot, none, share, None).cost[1]
            for slot in every_sequence(grid)
        }
        followed = follow(robot, path, GRID)
        assert not followed.jumps
        ours = with_whole_turns(
            robot, grid.q[np.arange(len(grid.t)), followed.slot], followed.slot, none, share, None
        ).cost[1]
        assert ours <= min(costs.values()) + 2e-6
        compared += 1
        switched += len(set(followed.slot)) > 1
    assert switched > 0
