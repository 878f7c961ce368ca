"""Where a box can stand, against brute force, closed forms and random poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from er3a.collision.scene import Box, Cylinder, Plane, Scene
from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import transform
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.forward import jacobian
from er3a.kinematics.inverse import inverse
from er3a.robots.robot import CombinedLimit, Robot
from er3a.workspace.directions import cone_directions, from_polar, poses, roll_of, tool_rotations
from er3a.workspace.orientations import asked_of
from er3a.workspace.placement import (
    MIXED,
    NO,
    Places,
    Task,
    choose_places,
    fits_on,
    fitting_places,
    lattice_spacing,
    narrowed,
    serve,
    supports_of,
    survey,
)
from testing.arms import placement

DOWN = np.array([0.0, 0.0, -1.0])
TRAY = Task(np.array([0.2, 0.15, 0.05]), DOWN, np.radians(20), 0.0, 0.15, np.radians(2))


def places_of(robot: Robot, task: Task, coarsest: float = 0.06) -> Places:
    robot = narrowed(robot, task.margin)
    return fitting_places(survey(robot, task, asked_of(robot, 2), coarsest), task.box)


def lattice_in(centre: np.ndarray, size: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    axes = [
        c + np.linspace(-s / 2, s / 2, max(2, int(np.ceil(s / h - 1e-6)) + 1)) for c, s, h in zip(centre, size, spacing)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def random_service(task: Task, centre: np.ndarray, size: np.ndarray, roll, random, count: int) -> np.ndarray:
    """Poses at random points of the box along random directions of the cone: (count, rolls, 4, 4)."""
    points = centre + (random.random((count, 3)) - 0.5) * size
    polar = np.arccos(1 - random.random(count) * (1 - np.cos(task.half_angle)))
    rotations = tool_rotations(from_polar(task.axis, polar, random.random(count) * 2 * np.pi), roll)
    return poses(points[:, None], rotations)


def test_places_agree_with_brute_force_one_pose_at_a_time():
    robot = load_robot("er3_600")
    task = Task(np.array([0.2, 0.1, 0.1]), DOWN, 0.0, 0.2, 0.15)
    field = survey(robot, task, asked_of(robot, 1), 0.1)
    assert field.spacing == pytest.approx([0.1, 0.1, 0.1])
    (rotation,) = tool_rotations(cone_directions(DOWN, 0.0), roll_of(robot, 1))[:, 0]
    good = np.zeros(field.manipulability_any.shape, dtype=bool)
    for index in np.ndindex(good.shape):
        point = field.origin + index * field.spacing
        if point[2] < 0.2 - 1e-9 or np.hypot(*point[:2]) < 0.15 or np.hypot(*point[:2]) > 0.5 or point[2] > 0.8:
            good[index] = field.manipulability_any[index] > NO
            continue
        good[index] = inverse(robot, poses(point, rotation)).within_limits.any()
    assert np.array_equal(good, field.manipulability_any > NO)
    expected = set()
    for turned, (a, b, c) in ((False, (3, 2, 2)), (True, (2, 3, 2))):
        for i, j, k in np.ndindex(good.shape):
            window = good[i : i + a, j : j + b, k : k + c]
            if window.shape == (a, b, c) and window.all():
                middle = field.origin + (np.array([i, j, k]) + (np.array([a, b, c]) - 1) / 2) * field.spacing
                expected.add((turned, *np.round(middle, 6).tolist()))
    places = fitting_places(field, task.box)
    found = {(bool(t), *np.round(c, 6).tolist()) for t, c in zip(places.turned, places.centre)}
    assert len(expected) > 50
    assert found == expected


def test_the_margin_of_a_point_counts_limits_of_sums(random):
    """Joints 2 and 3, and 3, 4 and 5, of limited sums: the margin by hand from the joints that serve each point."""
    robot = load_robot("er3_600")
    sums = ([0, 1, 1, 0, 0, 0], -2.0, 0.4), ([0, 0, 1, 0.5, -1, 0], -2.2, 2.4)
    limits = tuple(CombinedLimit(tuple(map(float, factors)), low, high) for factors, low, high in sums)
    robot = robot.replace(combined=limits)
    points = random.uniform([0.15, -0.3, 0.1], [0.45, 0.3, 0.5], (80, 3))
    (rotation,) = rotations = tool_rotations(cone_directions(DOWN, 0.0), roll_of(robot, 1))
    least, _, margin = serve(robot, points, rotations, roll_of(robot, 1))
    rows = inverse_batch(robot, poses(points[:, None], rotation).reshape(-1, 4, 4))
    own = np.flatnonzero(robot.upper - robot.lower < 2 * np.pi - 1e-6)
    by_sums = 0
    for n, slot in zip(*np.nonzero(least > NO)):
        q = rows.q[n, slot]
        alone = min(min(q[j] - robot.lower[j], robot.upper[j] - q[j]) for j in own)
        summed = min(min(q @ factors - low, high - q @ factors) for factors, low, high in sums)
        assert margin[n, slot] == pytest.approx(min(alone, summed), abs=1e-9)
        by_sums += summed < alone
    assert by_sums > 10


@pytest.mark.parametrize("name", ["er3a_c60", "er3_600"])
def test_places_serve_nearly_all_random_points_and_directions(name, random):
    """Only the lattice is tested: what lies between may fail, at borders of what is reached."""
    robot = load_robot(name)
    places, roll, tight = places_of(robot, TRAY), roll_of(robot, 1), narrowed(robot, TRAY.margin)
    chosen = choose_places(tight, TRAY, places, 3)
    assert len(chosen) == 3
    for row in (*chosen, *random.choice(len(places.slot), 20)):
        size = TRAY.box[[1, 0, 2]] if places.turned[row] else TRAY.box
        T = random_service(TRAY, places.centre[row], size, roll, random, 300)
        within = inverse_batch(robot.replace(lower=tight.lower, upper=tight.upper), T[:, 0]).within_limits
        assert within.any(axis=1).mean() > (0.99 if row in chosen else 0.9)
        assert row not in chosen or places.slot[row] == MIXED or within[:, places.slot[row]].mean() > 0.99


def test_the_criterion_is_the_least_over_box_and_cone(random):
    robot = narrowed(load_robot("er3_600"), TRAY.margin)
    places, roll = places_of(load_robot("er3_600"), TRAY), roll_of(robot, 1)
    assert places.slot[0] != MIXED
    one = places.rows(places.slot != MIXED)
    shares = np.minimum(
        one.manipulability / places.manipulability.max(), one.limit_margin / np.nanmax(places.limit_margin)
    )
    assert (np.diff(shares) < 2e-6).all()
    size = TRAY.box[[1, 0, 2]] if places.turned[0] else TRAY.box
    spacing = lattice_spacing(TRAY.box, 0.06)
    points = lattice_in(places.centre[0], np.ceil(size / spacing - 1e-6) * spacing, spacing)
    T = poses(points[:, None], tool_rotations(cone_directions(DOWN, TRAY.half_angle), roll)[:, 0]).reshape(-1, 4, 4)
    found = inverse_batch(robot, T)
    q = found.q[:, places.slot[0]]
    assert found.within_limits[:, places.slot[0]].all()
    assert np.abs(np.linalg.det(jacobian(robot, q))).min() == pytest.approx(places.manipulability[0], rel=1e-9)
    limit_margin = np.minimum(q - robot.lower, robot.upper - q)[:, [0, 1, 2, 4]].min()
    assert limit_margin == pytest.approx(places.limit_margin[0], abs=1e-9)


@pytest.mark.long
def test_harder_tasks_are_never_easier():
    robot = load_robot("er3a_c60")
    easy = places_of(robot, TRAY)

    def lattice(places: Places) -> dict:
        return {(bool(t), *np.round(c, 6)): v for t, c, v in zip(places.turned, places.centre, places.manipulability)}

    most = lattice(easy)
    for harder in (replace(TRAY, half_angle=np.radians(35)), replace(TRAY, margin=np.radians(8))):
        fewer = lattice(places_of(robot, harder))
        assert len(fewer) < len(most)
        if harder.half_angle == TRAY.half_angle:
            assert set(fewer) <= set(most)
    larger = replace(TRAY, box=np.array([0.3, 0.15, 0.1]))
    fields = [survey(robot, task, asked_of(robot, 1), 0.05) for task in (TRAY, larger)]
    assert fields[0].spacing == pytest.approx(fields[1].spacing)
    small, large = (fitting_places(fields[0], task.box) for task in (TRAY, larger))
    assert 0 < len(large.slot) < len(small.slot)
    assert large.manipulability.max() <= small.manipulability.max()


def test_no_place_that_is_chosen_is_another_turned_about_axis_1():
    """A box under a tool that points down is the same task wherever joint 1 stands."""
    places = places_of(load_robot("er3_600"), TRAY)
    centres = places.centre[choose_places(load_robot("er3_600"), TRAY, places, 3)]
    assert len(centres) > 1
    for i, one in enumerate(centres):
        for other in centres[:i]:
            apart = abs(np.hypot(*one[:2]) - np.hypot(*other[:2])), abs(one[2] - other[2])
            assert apart[0] >= TRAY.box[:2].min() - 1e-6 or apart[1] >= TRAY.box[2] - 1e-6


def test_boxes_that_overlap_by_less_than_half_are_not_chosen_both():
    """Of a tool that points ahead, so that no place is another turned about axis 1; one box stands turned by 90 deg."""
    task = replace(TRAY, box=np.array([0.06, 0.04, 0.02]), axis=np.array([1.0, 0.0, 0.0]))
    robot = narrowed(load_robot("er3_600"), task.margin)
    steps = np.array([[0, 0, 0], [0.04, 0, 0], [0, 0.03, 0], [0, 0, 0.015], [0.045, 0, 0], [0, 0.045, 0], [0, 0, 0.02]])
    turned = np.array([False, False, False, False, True, True, False])
    count = len(steps)
    places = Places(
        np.array([0.35, 0.0, 0.5]) + steps,
        turned,
        np.full(count, MIXED),
        np.linspace(1.0, 0.5, count),
        np.full(count, np.nan),
    )
    assert choose_places(robot, task, places, count) == [
        0,
        6,
    ]  # the one on top; turned boxes reach 50 mm along both axes
    farther = replace(places, centre=places.centre + 0.0051 * (steps > 0.04))
    assert choose_places(robot, task, farther, count) == [0, 4, 5, 6]


def test_a_turned_base_turns_the_places():
    task = replace(TRAY, half_angle=np.radians(10))
    robot = load_robot("er3_600")
    turned = robot.replace(base=placement([0, 0, 0], [0, 0, np.pi / 2]))
    one, other = places_of(robot, task), places_of(turned, task)
    assert len(one.slot) == len(other.slot)
    assert np.sort(one.manipulability) == pytest.approx(np.sort(other.manipulability), rel=1e-6)
    key = {(bool(t), *(np.round(c, 4) + 0.0)) for t, c in zip(other.turned, other.centre)}
    expected = {(not t, *(np.round([-c[1], c[0], c[2]], 4) + 0.0)) for t, c in zip(one.turned, one.centre)}
    assert key == expected


def test_a_box_too_large_stands_nowhere():
    task = replace(TRAY, box=np.array([1.5, 1.5, 0.5]))
    places = places_of(load_robot("er3_600"), task, 0.2)
    assert len(places.slot) == 0
    robot = load_robot("er3_600")
    assert choose_places(robot, task, places, 5) == []


@pytest.mark.long
def test_what_is_level_is_a_support_and_a_box_fits_on_it_where_all_of_it_lies_over_it(random):
    on_its_side = transform(np.array([0.5, 0.1, 0.3]), np.array([np.pi / 2, 0.0, 0.4]))
    tilted = transform(np.array([0.0, 1.0, 0.0]), np.array([0.1, 0.0, 0.0]))
    table, post = Box("table", on_its_side, np.array([0.5, 0.2, 0.3])), Cylinder("post", np.eye(4), 0.1, 0.4)
    floor, wall = Plane("floor", np.array([0.0, 0.0, 1.0]), -0.1), Plane("wall", np.array([1.0, 0.0, 0.0]), -1.0)
    rod, ramp = Cylinder("rod", on_its_side, 0.1, 0.4), Box("ramp", tilted, np.ones(3))
    supports = supports_of(Scene("cell", (floor, wall, ramp, rod, post, table)))
    assert [support.name for support in supports] == ["table", "post", "floor"]
    assert [support.height for support in supports] == pytest.approx([0.4, 0.2, -0.1])
    points = np.append(random.uniform(-1, 1, (4000, 2)), np.full((4000, 1), 0.3), axis=1)
    local = (points - on_its_side[:3, 3]) @ on_its_side[:3, :3]
    over = (np.abs(local[:, [0, 2]]) <= [0.25, 0.15]).all(axis=1)
    assert 50 < over.sum() < 500
    assert np.array_equal(supports[0].holds(points[:, :2]), over)
    corners = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) / 2
    for support, middle in ((supports[0], on_its_side[:2, 3]), (supports[1], np.zeros(2))):
        for size in random.uniform(0.02, 0.4, (40, 2)):
            # Both outlines are symmetric about their middle: what fits at all fits there.
            fits = any(support.holds(middle + corners * edges).all() for edges in (size, size[::-1]))
            assert fits_on(support, np.append(size, 0.1)) == fits
    assert fits_on(supports[2], np.full(3, 100.0))
