"""Hull, voids and reach of the workspace stage against analytic workspaces and SciPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import Delaunay

from er3a.collision.scene import Plane, Scene
from er3a.files.robot_library import load_robot
from er3a.finding import fact
from er3a.kinematics.forward import forward
from er3a.pipeline.messages import workspace  # noqa: F401
from er3a.pipeline.messages.say import say
from er3a.pipeline.stages.workspace.compute import buried, judge
from er3a.sampling.grid import make_grid
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import search_reach, section_cells
from er3a.workspace.causes import relaxed_limit
from er3a.workspace.proven import cavities, prove_robot
from er3a.workspace.voids import Void, inside_hull, is_flat
from tests.stages.workspace_arms import SEED, tally_of, two_link_arm

# --- hull ---


def test_the_inside_of_a_hull_is_that_of_its_tetrahedra(random):
    corners, points = random.normal(size=(200, 3)), random.normal(size=(9000, 3))
    assert np.array_equal(inside_hull(corners, points), Delaunay(corners).find_simplex(points) >= 0)


@pytest.mark.parametrize(
    "points", [np.ones((5, 3)), np.eye(3), np.c_[np.random.default_rng(0).random((50, 2)), np.zeros(50)]]
)
def test_points_in_a_plane_are_flat_and_nothing_is_inside(points):
    assert is_flat(points)
    assert not inside_hull(points, points.mean(axis=0)[None]).any()


# --- voids ---


@pytest.mark.long
def test_a_void_of_40_mm_that_a_cloud_can_not_show_is_proven():
    """Links of 0.6 and 0.4 m, and a tool of 0.16 m that turns every way: the ball of radius 40 mm can't be reached."""
    robot = two_link_arm([-180.0] * 6, [180.0] * 6).replace(d=[0.3, 0, 0, 0.4, 0, 0.16])
    enclosed, _ = cavities(prove_robot(robot, 6000, 1).section)
    (ball,) = enclosed
    assert ball.centroid() == pytest.approx([0, 0, 0.3], abs=0.002)
    assert 4 / 3 * np.pi * 0.02**3 < ball.lower < 4 / 3 * np.pi * 0.04**3 < ball.upper


@pytest.mark.long
def test_a_gap_of_joint_1_opens_the_hollow():
    """With half a turn of joint 1 and the elbow one way only, the hollow reaches the outside through the gap."""
    robot = two_link_arm([-60, -90, -60, -180, -180, -180], [60, 0, 60, 180, 180, 180])
    assert cavities(prove_robot(robot, 2000, 1).section)[0] == []


@pytest.mark.long
def test_a_locked_arm_stays_on_its_sphere():
    robot = two_link_arm([-180, -180, 90, 0, 0, 0], [180, 180, 90, 0, 0, 0])
    grid, _, counts = tally_of(robot, 50_000, 2, 32)
    radius, touched = np.linalg.norm(forward(robot, robot.lower)[:3, 3] - [0, 0, 0.3]), section_cells(counts, grid)
    distance = np.hypot(touched.rho, touched.z + grid.axis_point[2] - 0.3)
    assert np.abs(distance - radius).max() < grid.section_cell


def void_record(at_shoulder: bool) -> Void:
    limit = relaxed_limit((3,), (1.0,), "upper", "deg", 75.0, (15.0, 1.0))
    return Void(
        kind="enclosed",
        lower=0.002,
        upper=0.003,
        centroid=np.array([0.1, -0.2, 0.0004]),
        low=np.full(3, -0.05),
        high=np.full(3, 0.05),
        cause=fact("void_disappears", limits=(limit,)),
        holds_shoulder=at_shoulder,
        vertices=np.empty((0, 3)),
        triangles=np.empty((0, 3), dtype=np.int64),
    )


@pytest.mark.parametrize(
    ("voids", "undecided", "status", "code"),
    [
        ([], 0.02, "pass", "no_void"),
        ([], 0.2, "caution", "unsettled"),
        ([void_record(True)], 0.02, "pass", "void_at_shoulder"),
        ([void_record(True)], 0.2, "caution", "unsettled"),
        ([void_record(True), void_record(False)], 0.2, "caution", "void_unexpected"),
    ],
)
def test_an_enclosed_void_away_from_the_shoulder_is_never_passed_over(voids, undecided, status, code):
    verdict = judge(voids, undecided)
    assert (verdict.status, verdict.finding.code) == (status, f"workspace.{code}")
    assert "void_" not in code or verdict.finding.litres == 2


@pytest.mark.parametrize(
    ("kind", "height", "within"), [("open", 0.1, True), ("open", 0.0, False), ("enclosed", 0.1, False)]
)
def test_an_open_void_below_the_floor_is_no_finding(kind, height, within):
    """An enclosed one says of the arm's limits what it says anywhere."""
    void = replace(void_record(True), kind=kind, vertices=np.array([[0.3, 0, 0.05], [0.3, 0, -0.2], [0.4, 0, -0.1]]))
    assert buried(void, Scene("made", (Plane("floor", np.array([0.0, 0.0, 1.0]), height),))) is within
    assert not buried(void, None)


def test_a_verdict_says_which_limit_makes_the_void():
    verdict = judge([void_record(False)], 0.02)
    assert verdict.finding.cause == fact(
        "void_disappears", limits=(relaxed_limit((3,), (1.0,), "upper", "deg", 75.0, (15.0, 1.0)),)
    )
    assert "J3 ≤ 75°; it disappears at J3 ≤ 90°" in say(verdict.finding)


# --- reach ---


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "reach_mm"), [("er3_600", 592.8 + 78.5), ("er3a_c60", 627.1 + 78.5), ("er3a_c60_article", 1301.61 + 125.6)]
)
def test_reach_meets_the_known_figures(name, reach_mm):
    robot = load_robot(name)
    q = Draw(SEED, 3000, 1).joints(robot, np.zeros(3000), np.arange(3000))
    reach = search_reach(robot, make_grid(robot, 16), q)
    assert 1000 * reach.furthest_from_axis == pytest.approx(reach_mm, abs=0.06)
    assert reach.nearest_to_axis == pytest.approx(0, abs=1e-6)
