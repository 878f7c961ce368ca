"""Standard and modified tables of the same arm."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.kinematics.forward import forward
from er3a.robots.robot import Robot, to_modified, to_standard


def random_arm(random: np.random.Generator, convention: str) -> Robot:
    angles = random.uniform(-np.pi, np.pi, (2, 6))
    tool = np.eye(4)
    tool[:3, 3] = random.uniform(-1, 1, 3)
    return Robot(
        name="random",
        title="random",
        convention=convention,
        a=random.uniform(-1, 1, 6),
        alpha=angles[0],
        d=random.uniform(-1, 1, 6),
        direction=random.choice([-1.0, 1.0], 6),
        offset=angles[1],
        lower=np.full(6, -np.pi),
        upper=np.full(6, np.pi),
        tool=tool,
    )


@pytest.mark.parametrize(("convention", "convert"), [("standard", to_modified), ("modified", to_standard)])
def test_conversion_keeps_the_tool_pose(random, convention, convert):
    for _ in range(50):
        arm = random_arm(random, convention)
        converted = convert(arm)
        assert converted.convention != convention
        q = random.uniform(-np.pi, np.pi, (100, 6))
        np.testing.assert_allclose(forward(converted, q), forward(arm, q), atol=1e-14)


def test_conversion_there_and_back_keeps_the_rows(random):
    arm = random_arm(random, "standard").replace(alpha=np.append(np.full(5, 0.5), 0.0), a=np.append(np.ones(5), 0.0))
    back = to_standard(to_modified(arm))
    for key in ("a", "alpha", "d", "offset", "direction", "tool", "base"):
        np.testing.assert_array_equal(getattr(back, key), getattr(arm, key))


def test_a_table_of_that_convention_is_returned_as_it_is(random):
    arm = random_arm(random, "modified")
    assert to_modified(arm) is arm
