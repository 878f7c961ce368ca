"""Singular events: none missed that a finer sampling finds, and each located to 1e-9 of the way."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.kinematics.singularity import determinant_factors
from er3a.planning.moves import JointMove
from er3a.planning.singular_events import singular_events
from testing.arms import OTHERS_LONG
from testing.exact_paths import REAL, quintic_time, worst_location
from testing.random_paths import KINDS, NEAR, Found

QUICK = "joint moves"


@OTHERS_LONG
@pytest.mark.parametrize(
    "kind", [QUICK, *(pytest.param(kind, marks=pytest.mark.long) for kind in KINDS if kind != QUICK)]
)
def test_nothing_is_missed_that_a_hundred_times_finer_sampling_finds(robot, random, kind):
    found = Found()
    for _ in range(8):
        found.add(robot, KINDS[kind](robot, random))
    assert found.missed_crossings == found.missed_passes == 0
    assert found.passes > 0
    assert found.crossings > 0 or kind == "straight lines"


def test_the_comparison_can_fail(robot, random):
    """The sieve of the test above catches a crossing that is taken away."""
    found, path = Found(), None
    while path is None or not any(event.crossing for event in path.events):
        path = KINDS["joint moves"](robot, random)
    found.add(robot, type(path)(path.joints, [], ()))
    assert found.missed_crossings > 0


@pytest.mark.long
@OTHERS_LONG
def test_passes_of_lines_are_located_to_1e_9_of_the_way(robot, random):
    """Against plane trigonometry in extended precision, without inverse kinematics."""
    found = worst_location(robot, random, 50)
    assert sum(count for count, _ in found.values()) >= 5
    assert max(worst for _, worst in found.values()) < 1e-9


def test_crossings_of_joint_moves_are_located_to_1e_9_of_the_time(robot, random):
    """Joint 5 passes 0 where the quintic has done a known share of its way."""
    for _ in range(20):
        start, end = random.uniform(robot.lower, robot.upper, (2, 6))
        start[4], end[4] = -abs(start[4]), abs(end[4])
        move = JointMove(start, end, 3.0)
        events = singular_events(robot, move.polynomials(), NEAR)
        exact = 3 * quintic_time(REAL(-start[4]) / (REAL(end[4]) - REAL(start[4])))
        assert min(abs(float(event.t - exact)) for event in events if event.type == "wrist") < 3e-9


def test_distances_by_type_are_those_of_the_angles(robot):
    q = np.radians([10, -20, 15, 40, 3, 70])
    factors = determinant_factors(robot, q)
    assert np.degrees(abs(factors.wrist)) == pytest.approx(3, abs=1e-9)
    turned = determinant_factors(robot, q + np.radians([50, 0, 0, 0, 0, 0]))
    assert turned.shoulder == pytest.approx(factors.shoulder, abs=1e-12)
    assert turned.elbow == pytest.approx(factors.elbow, abs=1e-12)
