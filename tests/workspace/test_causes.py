"""Which limits make a void, for arms whose joints slide, go with others or have limits of sums; arms whose reach is
known by geometry."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.finding import is_one
from er3a.robots.robot import CombinedLimit, Robot
from er3a.workspace.causes import (
    cause_of,
    relaxations,
)
from er3a.workspace.cell_frame import cell_frame
from er3a.workspace.proven import Cavity
from testing.arms import made_of, tools_by_hand

pytestmark = pytest.mark.long

TURN = 2 * np.pi
DEG = np.pi / 180


def polar() -> Robot:
    """A turn, a lift and a slide outwards from 300 mm on: a hole of that radius about axis 1."""
    rows = [("R", 0, 0, 0, -180, 180), ("P", 0, 90, 0, 0, 500), ("P", 0, 0, 0, 300, 1000)]
    return made_of(rows, offset=np.array([0, 90, 0]) * DEG)


def on_a_slide() -> Robot:
    """Two links that turn about the slide they stand on: folded by 100 deg at most, they leave a tube."""
    return made_of([("P", 0, 0, 0, 0, 1000), ("R", 500, 0, 0, -180, 180), ("R", 400, 0, 0, -100, 100)])


def summed(coupling: np.ndarray | None = None) -> Robot:
    """The same links on a turning column; only a sum of joints keeps them from folding."""
    factors = (0, 0, 1.0) if coupling is None else (0, -1.0, 1.0)
    return made_of(
        [("R", 0, 90, 0, -180, 180), ("R", 500, 0, 0, -180, 180), ("R", 400, 0, 0, -180, 180)],
        coupling=coupling,
        combined=(CombinedLimit(factors, -100 * DEG, 100 * DEG),),
    )


def of_cells(robot: Robot, rho: tuple[float, float], z: tuple[float, float], arc: tuple[float, float]) -> Cavity:
    """A void of cells between radii and heights, m."""
    frame, count = cell_frame(robot), 6
    a, b = np.linspace(*rho, count + 1), np.linspace(*z, count + 1)
    cells = np.array([[a[i], a[i + 1], b[j], b[j + 1]] for i in range(count) for j in range(count)])
    arcs = np.tile(arc, (len(cells), 1))
    return Cavity(False, cells, arcs, np.ones(len(cells)), frame.bar)


def share_by_hand(robot: Robot, cavity: Cavity, lower: np.ndarray, upper: np.ndarray, sums: float) -> float:
    """Of the cells, those that random joints reach, with other limits and the sum's limits wider by ``sums`` (rad)."""
    frame, random = cell_frame(robot), np.random.default_rng(7)
    q = random.uniform(lower, upper, (60_000, robot.joints))
    for limit in robot.combined:
        total = q @ np.array(limit.factors)
        q = q[(total >= limit.lower - sums) & (total <= limit.upper + sums)]
    points = tools_by_hand(robot, q)[:, :3, 3]
    x, y, z = ((points - frame.origin) @ frame.R.T).T
    rho = x if frame.bar else np.hypot(x, y)
    hit = [((rho > a) & (rho < b) & (z > c) & (z < d)).any() for a, b, c, d in cavity.cells]
    return float(np.mean(hit))


def test_a_slide_that_ends_too_far_out_makes_a_hole():
    robot = polar()
    cavity = of_cells(robot, (0.06, 0.29), (0.05, 0.45), (0.0, TURN))
    cause = cause_of(*relaxations(robot, cavity))
    assert is_one(cause, "void_disappears")
    (limit,) = cause.limits
    assert (limit.joints, limit.side, limit.unit, limit.extended) == ((3,), "lower", "mm", pytest.approx(-100))
    assert share_by_hand(robot, cavity, robot.lower, robot.upper, 0.0) == 0
    for by, filled in ((0.2, False), (0.4, True)):
        found = share_by_hand(robot, cavity, robot.lower - [0, 0, by], robot.upper, 0.0)
        assert (found == 1) == filled


def test_a_tube_along_a_slide_is_of_the_elbow():
    robot = on_a_slide()
    frame = cell_frame(robot)
    (x, _, z), hollow = -frame.R @ frame.origin, 0.35  # the column's axis; two links at 100 deg leave 0.58 m
    box = (x - hollow, x + hollow), (z - hollow, z + hollow)
    cavity = of_cells(robot, *box, (0.3 * TURN, 0.6 * TURN))
    cause = cause_of(*relaxations(robot, cavity))
    assert is_one(cause, "void_disappears", "void_of_geometry")
    limits = cause.limits if is_one(cause, "void_disappears") else (cause.most,)
    assert {limit.unit for limit in limits} == {"deg"}
    assert {joint for limit in limits for joint in limit.joints} == {3}
    assert share_by_hand(robot, cavity, robot.lower, robot.upper, 0.0) == 0
    wide, aside = np.array([0, 0, 180 * DEG]), np.array([0.4, 0, 0])
    assert share_by_hand(robot, cavity, robot.lower, robot.upper + wide, 0.0) > 0.9
    assert share_by_hand(robot, cavity, robot.lower - aside, robot.upper + aside, 0.0) == 0


@pytest.mark.parametrize("coupling", [None, np.array([[1.0, 0, 0], [0, 1, 0], [0, -1, 1]])])
def test_a_hole_by_a_sum_of_joints_is_told_so(coupling):
    robot = summed(coupling)
    cavity = of_cells(robot, (0.22, 0.4), (-0.3, 0.3), (0.0, TURN))
    cause = cause_of(*relaxations(robot, cavity))
    assert is_one(cause, "void_disappears")
    (limited,) = robot.combined
    factors = tuple(factor for factor in limited.factors if factor)
    assert all((limit.factors, limit.unit) == (factors, "deg") for limit in cause.limits)
    assert {joint for limit in cause.limits for joint in limit.joints} == ({3} if coupling is None else {2, 3})
    assert share_by_hand(robot, cavity, robot.lower, robot.upper, 0.0) == 0
    by = cause.limits[0].by * DEG
    assert share_by_hand(robot, cavity, robot.lower, robot.upper, by) == 1


def test_a_hole_by_a_sum_of_slides_is_told_so():
    """Two slides outwards, each from 0: only their sum keeps the tool 300 mm from axis 1."""
    rows = [("R", 0, 0, 0, -180, 180), ("P", 0, 90, 0, 0, 500), ("P", 0, 0, 0, 0, 500), ("P", 0, 0, 0, 0, 500)]
    limit = CombinedLimit((0, 0, 1.0, 1.0), 0.3, 1.0)
    robot = made_of(rows, offset=np.array([0, 90, 0, 0]) * DEG, combined=(limit,))
    cavity = of_cells(robot, (0.06, 0.29), (0.05, 0.45), (0.0, TURN))
    cause = cause_of(*relaxations(robot, cavity))
    assert is_one(cause, "void_disappears")
    (found,) = cause.limits
    assert (found.joints, found.factors, found.unit) == ((3, 4), (1.0, 1.0), "mm")
    assert (found.side, found.extended) == ("lower", pytest.approx(-100))
    assert share_by_hand(robot, cavity, robot.lower, robot.upper, 0.0) == 0
    assert share_by_hand(robot, cavity, robot.lower, robot.upper, 0.4) == 1
    assert share_by_hand(robot, cavity, robot.lower - 0.4 * robot.sliding, robot.upper, 0.0) == 0


@pytest.mark.parametrize("factor", [1.0, 40.0])
def test_a_hole_by_a_sum_of_a_turn_and_a_slide_is_told_so(factor):
    """A slide outwards from 0, which a turning joint behind it only lets come in where that turns: rad, and rad/m."""
    rows = [("R", 0, 0, 0, -180, 180), ("P", 0, 90, 0, 0, 500), ("P", 0, 0, 0, 0, 1000), ("R", 0, 0, 0, -20, 20)]
    limit = CombinedLimit((0, 0, factor, 0.2), 0.3 * factor + 0.2 * 20 * DEG, 2 * factor)
    robot = made_of(rows, offset=np.array([0, 90, 0, 0]) * DEG, combined=(limit,))
    cavity = of_cells(robot, (0.06, 0.29), (0.05, 0.45), (0.0, TURN))
    single, unlimited = relaxations(robot, cavity)
    cause = cause_of(single, unlimited)
    assert is_one(cause, "void_disappears")
    (found,) = cause.limits
    assert (found.joints, found.factors, found.side, found.unit) == ((3, 4), (factor, 0.2), "lower", "deg")
    assert share_by_hand(robot, cavity, robot.lower, robot.upper, 0.0) == 0
    assert share_by_hand(robot, cavity, robot.lower, robot.upper, found.by * DEG) == 1
    for narrower in (step for step in (15, 30, 60, 90, 180) if step < found.by):
        assert share_by_hand(robot, cavity, robot.lower, robot.upper, narrower * DEG) < 1
    joints = [(each.joints, each.side) for each in single]
    assert len(joints) == len(set(joints))
