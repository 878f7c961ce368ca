"""Fixtures that all tests share."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.robots.load import load_robot
from er3a.robots.robot import Robot

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")


@pytest.fixture(params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> Robot:
    """Each of the project's robots in turn."""
    return load_robot(request.param)


@pytest.fixture
def random() -> np.random.Generator:
    """A generator with a fixed seed."""
    return np.random.default_rng(20261120)
