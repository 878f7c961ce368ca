"""Volumes of arms whose first joint slides or goes with others, against computations that
share no code with the proof: formulas, forward kinematics by hand, and SciPy's bounded least squares."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from er3a.robots.robot import CombinedLimit, Robot
from er3a.workspace.proven import EMPTY, FILLED, Proven, prove_robot
from testing.arms import DEG, dh_matrix, gantry, made_of, placement, tools_by_hand

pytestmark = pytest.mark.long

TILTED = placement([0.3, -0.2, 0.5], [0.4, -0.7, 1.1])
ARM = [
    *(("R", 90, -90, 300, -100, 150), ("R", 350, 0, 40, -120, 40), ("R", 60, -90, 0, -70, 130)),
    *(("R", 0, 90, 310, -160, 120), ("R", 30, -90, 0, -100, 110), ("R", 0, 0, 70, -180, 180)),
]


def on_a_track() -> Robot:
    """An arm without a spherical wrist on a tilted track."""
    return made_of([("P", 0, 90, 0, -300, 900), *ARM], base=TILTED, tool=placement([0.05, 0.02, 0.1], [0.3, 0.2, 0.1]))


def skew_gantry() -> Robot:
    """Slides that are not at right angles, and a wrist."""
    rows = [("P", 0, -80, 0, 100, 1300), ("P", 30, 75, 0, -200, 500), ("P", 20, 15, 0, 0, 400)]
    rows += [("R", 80, 60, 0, -120, 120), ("R", 60, 0, 90, -100, 60)]
    return made_of(rows, base=TILTED, direction=np.array([1.0, -1, 1, -1, 1]))


def lift() -> Robot:
    """A column that lifts two links and a slide askew."""
    return made_of(
        [("P", 0, 0, 100, 0, 500), ("R", 300, 20, 0, -140, 100), ("R", 200, 90, 0, -150, 30), ("P", 0, 0, 50, 0, 150)]
    )


def sum_with_joint_1() -> Robot:
    """Joint 1 and joint 2 share a limit."""
    return made_of(ARM, combined=(CombinedLimit((1.0, 0.6, 0.0, 0.0, 0.0, 0.0), -80 * DEG, 100 * DEG),))


def follows_joint_1() -> Robot:
    """Axes 1 and 2 are driven by sums of both joints."""
    coupling = np.eye(6)
    coupling[0, 1], coupling[1, 0] = 0.4, -0.5
    return made_of(ARM, coupling=coupling, base=TILTED)


def slide_in_a_sum() -> Robot:
    """A track that the second joint's value shortens."""
    limit = CombinedLimit((1.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0), -0.2, 0.9)
    return made_of([("P", 0, 90, 0, -300, 900), *ARM], combined=(limit,), base=TILTED)


WITH_JOINT_1 = [sum_with_joint_1, follows_joint_1, slide_in_a_sum]
MADE = [on_a_track, skew_gantry, lift, *WITH_JOINT_1]


def point_by_hand(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Tool point (3,) from the table's rows."""
    u = q if robot.coupling is None else robot.coupling @ q
    T = robot.base.copy()
    for k in range(robot.rows):
        moved = robot.direction[k] * u[k]
        turned, along = (0.0, moved) if robot.sliding[k] else (moved, 0.0)
        T = T @ dh_matrix("standard", robot.a[k], robot.alpha[k], robot.d[k] + along, turned + robot.offset[k])
    return (T @ robot.tool)[:3, 3]


def beyond_sums(robot: Robot, q: np.ndarray) -> np.ndarray:
    """By how much joint values miss the limits of sums."""
    totals = [(q @ np.array(limit.factors), limit) for limit in robot.combined]
    return np.array([max(0.0, limit.lower - total, total - limit.upper) for total, limit in totals])


def is_reached(robot: Robot, point: np.ndarray, random: np.random.Generator) -> bool:
    """Whether bounded least squares find joint values for a point."""

    def miss(q: np.ndarray) -> np.ndarray:
        return np.concatenate([point_by_hand(robot, q) - point, beyond_sums(robot, q)])

    for _ in range(40):
        found = least_squares(miss, random.uniform(robot.lower, robot.upper), bounds=(robot.lower, robot.upper))
        if np.abs(found.fun).max() < 1e-6:
            return True
    return False


def states(proven: Proven, points: np.ndarray) -> np.ndarray:
    """What the proof says of points (n, 3)."""
    return proven.section.status(*proven.in_section(points))


@pytest.mark.parametrize("make", MADE, ids=lambda make: make.__name__)
def test_empty_cells_hold_no_point_and_filled_ones_are_reached(make, random):
    robot = make()
    proven = prove_robot(robot, 1500, 1)
    span = robot.upper - robot.lower
    q = robot.lower + span * np.clip(random.uniform(-0.2, 1.2, (8000, robot.joints)), 0, 1)  # many at limits
    q = np.array([row for row in q if not beyond_sums(robot, row).any()])
    points = tools_by_hand(robot, q)[:, :3, 3]
    assert len(points) > 1000
    assert not (states(proven, points) == EMPTY).any()

    box = random.uniform(points.min(axis=0), points.max(axis=0), (4000, 3))
    filled = box[states(proven, box) == FILLED][:3]
    assert len(filled) == (0 if make in WITH_JOINT_1 else 3)  # these are bounded by lengths alone
    assert all(is_reached(robot, point, random) for point in filled)


def test_the_volume_of_a_gantry_lies_in_its_bracket():
    proven = prove_robot(gantry(), 500, 1)
    lower, upper = proven.proof.bounds
    assert lower < 1.2 * 0.8 * 0.5 < upper
    assert lower > 0.8 * upper


def test_an_ur5_on_a_track_is_bounded_to_a_tenth():
    rows = [
        *(("R", 0, 90, 89.2, -360, 360), ("R", -425, 0, 0, -360, 360), ("R", -392.25, 0, 0, -360, 360)),
        *(("R", 0, 90, 109.15, -360, 360), ("R", 0, -90, 94.65, -360, 360), ("R", 0, 0, 82.3, -360, 360)),
    ]
    assert prove_robot(made_of([("P", 0, 90, 0, 0, 2000), *rows]), 8000, 1).proof.width < 0.1


def test_a_sphere_that_slides_has_the_volume_of_a_formula():
    """A ball's shell is swept along the track: no void is left in a shell that is moved by more than its hole."""
    rows = [("P", 0, 0, 0, 0, 800), ("R", 0, 90, 0, -180, 180), ("R", 0, -90, 0, -180, 180), ("P", 0, 0, 0, 100, 400)]
    lower, upper = prove_robot(made_of(rows), 2000, 1).proof.bounds
    assert lower < 4 / 3 * np.pi * 0.4**3 + np.pi * 0.4**2 * 0.8 < upper
    assert lower > 0.8 * upper
