"""Arms drawn from the side."""

import re

import numpy as np
import pytest

from er3a import load_robot
from er3a.pipeline.viewing.side_view import DrawnLine, SeenArm, entry_lines, side_view

ARM = np.array([[0.0, 0.0], [0.0, 300.0], [400.0, 300.0]])
RING = np.array([[-700.0, -700.0], [700.0, -700.0], [700.0, 700.0], [-700.0, 700.0]])


def seen_at(*reaches: float) -> list[int]:
    """Left, top, width and height of a drawing of arms that reach so many times ``RING``."""
    arms = [SeenArm("", "", "wrong" if k else "right", ARM, [times * RING]) for k, times in enumerate(reaches)]
    (box,) = re.findall(r'viewBox="([^"]*)"', side_view(arms, ratio=2.0))
    return [int(value) for value in box.split()]


def test_what_a_wrong_arm_reaches_does_not_make_the_arms_small():
    left, top, width, height = seen_at(1.0, 2.0)
    assert left < -700
    assert top < -700
    assert left + width > 700
    assert top + height > 700
    assert [left, top, width, height] == seen_at(1.0, 1.0)


def test_the_floor_is_named_and_below_the_arm():
    drawn = side_view([SeenArm("", "", "right", ARM, [RING])], 0.0, ratio=2.0)
    assert drawn.count("floor</text>") == 1
    assert '<rect class="floor"' in drawn


def test_the_word_of_a_line_is_near_it_where_the_arm_is_not():
    upright = SeenArm("", "", "right", np.array([[0.0, 0.0], [50.0, 0.0], [50.0, 400.0]]))
    around = DrawnLine(np.array([[30.0, 0.0], [50.0, 20.0], [70.0, 0.0]]), "turn", "direction2", "J2")
    (x, y) = re.search(
        r'<text class="" x="(-?\d+)" y="(-?\d+)"', side_view([upright], ratio=0.8, over=[around])
    ).groups()
    assert int(x) > 70
    assert np.hypot(int(x) - 50, int(y)) < 80


def test_a_length_is_seen_along_its_link_and_an_angle_at_its_end():
    robot = load_robot("er3a_c60")
    seen = entry_lines(robot, ["a2", "alpha2", "direction2"], np.zeros(6))
    assert np.linalg.norm(np.diff(seen["a2"], axis=0)) == pytest.approx(270.0)
    assert np.array_equal(seen["alpha2"][0], seen["a2"][0])
    assert np.ptp(seen["direction2"], axis=0).max() == 0.0
