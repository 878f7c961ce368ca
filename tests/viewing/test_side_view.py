"""Arms drawn from the side."""

import re

import numpy as np

from er3a.pipeline.viewing.side_view import SeenArm, side_view

ARM = np.array([[0.0, 0.0], [0.0, 300.0], [400.0, 300.0]])
RING = np.array([[-700.0, -700.0], [700.0, -700.0], [700.0, 700.0], [-700.0, 700.0]])


def seen_at(*reaches: float) -> list[int]:
    """Left, top, width and height of a drawing of arms that reach so many times ``RING``."""
    arms = [SeenArm("", "", "wrong" if k else "right", ARM, [times * RING]) for k, times in enumerate(reaches)]
    (box,) = re.findall(r'viewBox="([^"]*)"', side_view(arms, ratio=2.0))
    return [int(value) for value in box.split()]


def test_a_wrong_arm_that_reaches_far_leaves_the_first_as_large_as_it_is():
    assert seen_at(1.0) == seen_at(1.0, 2.0)
    assert seen_at(2.0)[2] > 1.5 * seen_at(1.0)[2]


def test_the_floor_is_named_and_below_the_arm():
    drawn = side_view([SeenArm("", "", "right", ARM, [RING])], 0.0, ratio=2.0)
    assert drawn.count("floor</span>") == 1
    assert '<rect class="floor"' in drawn
