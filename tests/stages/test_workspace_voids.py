"""Hull, voids and reach of the workspace stage against analytic workspaces and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward
from er3a.pipeline.messages.workspace import say
from er3a.pipeline.stages.workspace.compute import judge
from er3a.robots.robot import Robot
from er3a.sampling.grid import make_grid
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import search_reach
from er3a.workspace.causes import Disappears, OnlySampled, Relaxed
from er3a.workspace.proven import SectionMap, cavities
from er3a.workspace.section_arm import section_arm
from er3a.workspace.section_proof import prove
from er3a.workspace.voids import Void, cells_inside, convex_hull, find_voids, unseen_cells
from tests.stages.workspace_arms import SEED, extreme_points, tally_of, two_link_arm

# --- hull ---


def test_hull_agrees_with_scipy(robot):
    grid, draw, tally = tally_of(robot, 20_000, 2, 24)
    points = extreme_points(robot, draw, tally.extremes)
    ours, theirs = convex_hull(points), ConvexHull(points)
    assert ours.volume == pytest.approx(theirs.volume, rel=1e-12)
    assert ours.area == pytest.approx(theirs.area, rel=1e-12)
    assert np.array_equal(points[ours.of], ours.vertices)
    centres = grid.centres(np.argwhere(np.ones(grid.shape, dtype=bool)))
    expected = (centres @ theirs.equations[:, :3].T + theirs.equations[:, 3] <= 0).all(axis=1).reshape(grid.shape)
    assert np.array_equal(cells_inside(ours, grid), expected)


def test_hull_does_not_depend_on_the_order_of_points(random):
    points = random.normal(size=(300, 3))
    one, other = convex_hull(points), convex_hull(points[random.permutation(300)])
    assert np.array_equal(one.vertices, other.vertices)
    assert np.array_equal(one.triangles, other.triangles)
    assert (one.volume, one.area) == (other.volume, other.area)


@pytest.mark.parametrize(
    "points", [np.ones((5, 3)), np.eye(3), np.c_[np.random.default_rng(0).random((50, 2)), np.zeros(50)]]
)
def test_a_flat_hull_has_no_volume(points):
    hull = convex_hull(points)
    assert hull.volume == 0
    assert hull.area == 0
    assert hull.triangles.shape == (0, 3)


# --- voids ---


def voids_of(robot: Robot, samples: int, across: int):
    grid, draw, tally = tally_of(robot, samples, 8, across, 1000)
    hull = convex_hull(extreme_points(robot, draw, tally.extremes))
    return grid, tally, hull, find_voids(tally.counts, cells_inside(hull, grid))


def test_two_link_arm_leaves_the_ball_it_can_not_fold_into():
    """Full turns: the workspace is the ball of radius 1.0 m about the shoulder without that of radius 0.2 m."""
    turn = [-180.0] * 6, [180.0] * 6
    robot = two_link_arm(*turn)
    grid, tally, hull, voids = voids_of(robot, 1_500_000, 40)
    assert hull.volume == pytest.approx(4 / 3 * np.pi, rel=0.02)
    assert [void.kind for void in voids] == ["enclosed"]
    (void,) = voids
    assert void.status == "sampled"
    assert void.centroid(grid) == pytest.approx([0, 0, 0.3], abs=0.01)
    centres = grid.centres(np.argwhere(tally.counts > 0))
    distance = np.linalg.norm(centres - [0, 0, 0.3], axis=1)
    diagonal = grid.cell * np.sqrt(3) / 2
    assert distance.min() > 0.2 - diagonal
    assert distance.max() < 1.0 + diagonal
    wholly_inside = 4 / 3 * np.pi * (0.2 - diagonal) ** 3
    assert wholly_inside < len(void.cells) * grid.cell_volume < 4 / 3 * np.pi * (0.2 + diagonal) ** 3


@pytest.mark.long
def test_a_void_of_40_mm_that_a_cloud_can_not_show_is_proven():
    """Links of 0.6 and 0.4 m, and a tool of 0.16 m that turns every way: the ball of radius 40 mm can't be reached."""
    robot = two_link_arm([-180.0] * 6, [180.0] * 6).replace(d=[0.3, 0, 0, 0.4, 0, 0.16])
    _, _, _, voids = voids_of(robot, 10_000, 40)
    assert not [void for void in voids if void.kind == "enclosed" and void.status == "sampled"]
    enclosed, _ = cavities(SectionMap(prove(section_arm(robot), 0.0, 6000)))
    (ball,) = enclosed
    assert ball.centroid() == pytest.approx([0, 0, 0.3], abs=0.002)
    assert 4 / 3 * np.pi * 0.02**3 < ball.lower < 4 / 3 * np.pi * 0.04**3 < ball.upper


def test_a_gap_of_joint_1_opens_the_hollow():
    """With half a turn of joint 1 and the elbow one way only, the hollow reaches the outside through the gap."""
    robot = two_link_arm([-60, -90, -60, -180, -180, -180], [60, 0, 60, 180, 180, 180])
    _, _, _, voids = voids_of(robot, 1_000_000, 40)
    assert {void.kind for void in voids} == {"open"}


def test_a_locked_arm_stays_on_its_sphere():
    robot = two_link_arm([-180, -180, 90, 0, 0, 0], [180, 180, 90, 0, 0, 0])
    grid, draw, tally = tally_of(robot, 50_000, 2, 32)
    radius = np.linalg.norm(forward(robot, robot.lower)[:3, 3] - [0, 0, 0.3])
    distance = np.linalg.norm(grid.centres(np.argwhere(tally.counts > 0)) - [0, 0, 0.3], axis=1)
    assert np.abs(distance - radius).max() < grid.cell
    assert convex_hull(extreme_points(robot, draw, tally.extremes)).volume == pytest.approx(
        4 / 3 * np.pi * radius**3, rel=0.05
    )


def test_kinds_of_voids_on_a_made_up_grid():
    inside = np.zeros((20, 20, 20), dtype=bool)
    inside[1:-1, 1:-1, 1:-1] = True
    counts = np.where(inside, 50, 0)
    counts[4:7, 4:7, 4:7] = 0
    counts[12:17, 12:17, 12:19] = 0
    counts[9, 9, 9] = 0
    voids = find_voids(counts, inside)
    assert [(void.kind, len(void.cells), void.status) for void in voids] == [
        ("open", 5 * 5 * 7, "sampled"),
        ("enclosed", 27, "sampled"),
    ]


def test_a_thin_cloud_shows_no_voids(random):
    inside = np.ones((20, 20, 20), dtype=bool)
    counts = random.poisson(0.4, size=inside.shape)
    voids = find_voids(counts, inside)
    assert all(void.status == "undersampled" for void in voids)


def test_unseen_cells_are_predicted_or_understated(random):
    even, uneven = random.poisson(1.5, size=20_000), random.poisson(random.gamma(2.0, 1.0, size=20_000))
    assert unseen_cells(even[even > 0]) == pytest.approx((even == 0).sum(), rel=0.1)
    assert 0.5 * (uneven == 0).sum() < unseen_cells(uneven[uneven > 0]) < (uneven == 0).sum()


def void_record(status: str, at_shoulder: bool) -> Void:
    limit = Relaxed((3,), (1.0,), "upper", "deg", 75.0, 15.0, 1.0)
    proven = status == "proven_empty"
    return Void(
        kind="enclosed",
        status=status,
        lower=0.002,
        upper=0.003,
        centroid=np.array([0.1, -0.2, 0.0004]),
        low=np.full(3, -0.05),
        high=np.full(3, 0.05),
        cause=Disappears((limit,)) if proven else OnlySampled(),
        relaxed=(limit,) if proven else (),
        holds_shoulder=at_shoulder,
        vertices=np.empty((0, 3)),
        triangles=np.empty((0, 3), dtype=np.int64),
    )


@pytest.mark.parametrize(
    ("voids", "status", "code"),
    [
        ([], "pass", "no_void"),
        ([void_record("proven_empty", True)], "pass", "void_at_shoulder"),
        ([void_record("undersampled", True)], "pass", "void_at_shoulder"),
        ([void_record("proven_empty", True), void_record("undersampled", False)], "caution", "void_uncertain"),
        ([void_record("undersampled", False), void_record("proven_empty", False)], "caution", "void_unexpected"),
    ],
)
def test_an_enclosed_void_away_from_the_shoulder_is_never_passed_over(voids, status, code):
    verdict = judge(1 / 6, voids, 1000, 0.0, True)
    assert (verdict.status, verdict.finding.code) == (status, f"workspace.{code}")
    assert code == "no_void" or verdict.finding.litres == 2
    assert code == "no_void" or "2.00 L" in say(verdict.finding)


def test_a_verdict_says_which_limit_makes_the_void():
    verdict = judge(1 / 6, [void_record("proven_empty", False)], 1000, 0.0, True)
    assert verdict.finding.cause == Disappears((Relaxed((3,), (1.0,), "upper", "deg", 75.0, 15.0, 1.0),))
    assert "It disappears if joint 3's upper limit is extended to +90 deg: check the limits" in say(verdict.finding)


# --- reach ---


@pytest.mark.parametrize(
    ("name", "reach_mm"), [("er3_600", 592.8 + 78.5), ("er3a_c60", 627.1 + 78.5), ("er3a_c60_article", 1301.61 + 125.6)]
)
def test_reach_meets_the_known_figures(name, reach_mm):
    robot = load_robot(name)
    q = Draw(SEED, 3000, 1).joints(robot, np.zeros(3000), np.arange(3000))
    reach = search_reach(robot, make_grid(robot, 16), q)
    assert 1000 * reach.furthest_from_axis == pytest.approx(reach_mm, abs=0.06)
    assert reach.nearest_to_axis == pytest.approx(0, abs=1e-6)
