"""Which arms keep a margin, asked by bodies that are larger by it, against distances in full."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.collision.bodies import Bodies
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene


@pytest.mark.parametrize("name", ["er3a_c60", "ur5e"])
@pytest.mark.parametrize("margin", [0.0, 0.001, 0.02, 0.05])
def test_arms_that_keep_a_margin_are_those_whose_least_distance_does(name, margin, random):
    robot = load_robot(name)
    bodies = Bodies(robot, load_scene("data/scenes/table_and_post.yaml"))
    q = random.uniform(robot.lower, robot.upper, (2000, robot.joints))
    least = bodies.min_distance(q)[0]
    kept = bodies.free(q, margin)
    np.testing.assert_array_equal(kept, least >= margin if margin else least > 0)
    assert 0 < kept.sum() < len(q)
