"""Which arms keep a margin, asked by bodies that are larger by it, against distances in full."""

from __future__ import annotations

import numpy as np
import pytest

import er3a
from er3a.collision.bodies import Bodies
from er3a.errors import Er3aError
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.robots.robot import ConvexPiece, Envelope


@pytest.mark.long
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


TWO_LINKS = er3a.Robot.from_dh([1, 1], [0, 0], [0, 0])
BASE = Envelope(0, (0, 0, 0), (0, 0, 1), 0.05)
CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))


def test_shapes_of_whole_numbers_are_those_of_floats(random):
    made = [
        TWO_LINKS.replace(envelopes=(BASE, Envelope(2, number([0, 0, 0]), number([1, 0, 0]), number(1))))
        for number in (np.array, lambda values: np.array(values, float))
    ]
    assert made[0] == made[1]
    q = random.uniform(-3, 3, (50, 2))
    np.testing.assert_array_equal(*(Bodies(robot, None).free(q, 0.02) for robot in made))


@pytest.mark.parametrize(
    "shape",
    [
        lambda: Envelope(3, (0, 0, 0), (1, 0, 0), 0.1),
        lambda: ConvexPiece(3, CORNERS, 0.0),
        lambda: Envelope(-1, (0, 0, 0), (1, 0, 0), 0.1),
        lambda: Envelope(2, (np.nan, 0, 0), (1, 0, 0), 0.1),
        lambda: Envelope(2, (0, 0), (1, 0, 0), 0.1),
        lambda: Envelope(2, (0, 0, 0), (1, 0, 0), -0.1),
        lambda: ConvexPiece(2, CORNERS, np.nan),
    ],
)
def test_shapes_that_nothing_could_hit_are_refused(shape):
    def arm_with(found):
        return TWO_LINKS.replace(**{"hulls" if isinstance(found, ConvexPiece) else "envelopes": (found,)})

    with pytest.raises(Er3aError, match=r"link -?\d"):
        arm_with(shape())
