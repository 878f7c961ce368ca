"""Arcs, and lines and arcs in sequence."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from er3a.errors import PathError, PoseError
from er3a.geometry.transforms import transform
from er3a.planning.moves import line
from er3a.planning.profiles import Times
from er3a.planning.sequences import arc, joint_sequence, segment_path, spin


def random_pose(random):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.random(rng=random).as_matrix(), random.uniform(-1, 1, 3)
    return T


def check_rates(path, progress, step=1e-6):
    """Twists against differences of the poses, and their slopes against differences of the twists."""
    before, here, after = (path.poses(progress + aside) for aside in (-step, 0, step))
    slope = (after - before) / (2 * step)
    spins = slope[:, :3, :3] @ np.swapaxes(here[:, :3, :3], -1, -2)
    omega = np.stack([spins[:, 2, 1], spins[:, 0, 2], spins[:, 1, 0]], axis=-1)
    twist, bend = path.twists(progress)
    size = np.abs(twist).max()
    np.testing.assert_allclose(slope[:, :3, 3], twist[:, :3], atol=1e-7 * size)
    np.testing.assert_allclose(omega, twist[:, 3:], atol=1e-7 * size)
    differences = (path.twists(progress + step)[0] - path.twists(progress - step)[0]) / (2 * step)
    np.testing.assert_allclose(differences, bend, atol=1e-6 * (np.abs(bend).max() + size))


def test_arc_runs_on_the_circle_through_its_three_points(random):
    progress = np.linspace(0, 1, 41)
    for _ in range(50):
        a, b, via = random_pose(random), random_pose(random), random.uniform(-1, 1, 3)
        way = arc(a, via, b, 2.0)
        T = way.poses(progress)
        np.testing.assert_allclose(T[0], a, atol=1e-12)
        np.testing.assert_allclose(T[-1], b, atol=1e-10)
        np.testing.assert_allclose(np.linalg.norm(T[:, :3, 3] - way.centre, axis=1), way.radius, rtol=1e-12)
        share = np.linspace(0, 1, 5001)
        assert np.linalg.norm(way.points(share) - via, axis=1).min() < 1e-3 * way.length
        chords = np.linalg.norm(np.diff(way.points(share), axis=0), axis=1).sum()
        assert chords == pytest.approx(way.length, rel=1e-5)
        slerp = Slerp([0, 1], Rotation.from_matrix([a[:3, :3], b[:3, :3]]))(progress).as_matrix()
        np.testing.assert_allclose(T[:, :3, :3], slerp, atol=1e-12)
        check_rates(way, progress[1:-1])


def test_points_that_fix_no_circle_are_refused():
    a, b = transform([0, 0, 0], [0, 0, 0]), transform([1, 0, 0], [0, 0, 0])
    with pytest.raises(PoseError, match="on a straight line"):
        arc(a, [0.5, 0, 0], b, 1.0)
    with pytest.raises(PoseError, match="two of the arc's three points are one"):
        arc(a, [0.5, 0.5, 0], a, 1.0)
    with pytest.raises(PoseError, match="two of the arc's three points are one"):
        arc(a, [1, 0, 0], b, 1.0)


@given(st.lists(st.floats(-2, 2), min_size=9, max_size=9), st.floats(1e-4, 1.0))
def test_spin_of_a_rotation_vector_is_that_of_the_rotation(numbers, scale):
    w, v, a = np.array(numbers).reshape(3, 3) * scale

    def rotation(s):
        return Rotation.from_rotvec(w + s * v + s * s / 2 * a)

    step = 1e-4
    around = (rotation(step) * rotation(-step).inv()).as_rotvec() / (2 * step)
    ahead, behind = (spin(w + s * v + s * s / 2 * a, v + s * a, a)[0] for s in (step, -step))
    omega, slope = spin(w, v, a)
    np.testing.assert_allclose(omega, around, atol=1e-6)
    np.testing.assert_allclose(slope, (ahead - behind) / (2 * step), atol=1e-6)


def three_segments(random):
    a, b, c, d = (random_pose(random) for _ in range(4))
    return [line(a, b, 1.0), arc(b, random.uniform(-1, 1, 3), c, 1.0), line(c, d, 1.0)]


@pytest.mark.long
def test_rounded_sequence_has_the_rates_that_differences_give_also_across_its_joins(random):
    for _ in range(5):
        segments = three_segments(random)
        path = segment_path(segments, np.array([0.08, 0.1]), 4.0)
        check_rates(path, np.linspace(0.001, 0.999, 200))
        sharpest = np.abs(path.twists(np.linspace(0, 1, 1000))[1]).max()
        for edge in path.curve.edges[1:-1]:
            (a, b), (c, d) = path.twists(edge - 1e-9), path.twists(edge + 1e-9)
            np.testing.assert_allclose(a, c, atol=1e-5 * np.abs(a).max())
            np.testing.assert_allclose(b, d, atol=1e-5 * sharpest)
        np.testing.assert_allclose(
            path.poses(np.array([0.0, 1.0])), [segments[0].T_start, segments[2].poses(np.array(1.0))], atol=1e-12
        )
        share = np.linspace(0, 1, 5001)
        chords = np.linalg.norm(np.diff(path.poses(share)[:, :3, 3], axis=0), axis=1)
        np.testing.assert_allclose(path.arc_length(share[1:]), np.cumsum(chords), atol=1e-4)


def test_motion_in_time_of_a_rounded_sequence_has_continuous_rates(random):
    path = segment_path(three_segments(random), np.array([0.1, 0.1]), 4.0)
    t, step = np.linspace(0.01, 3.99, 300), 1e-6
    _, speed, acceleration = path.progress(t)
    before, after = path.progress(t - step), path.progress(t + step)
    np.testing.assert_allclose((after[0] - before[0]) / (2 * step), speed, atol=1e-8)
    np.testing.assert_allclose((after[1] - before[1]) / (2 * step), acceleration, atol=1e-8)


@pytest.mark.parametrize("degrees", [30, 90, 150])
def test_rounding_passes_the_corner_as_the_formula_says(degrees):
    g = np.radians(degrees)
    a, b = transform([0, 0, 0], [0, 0, 0]), transform([0.3, 0, 0], [0, 0, 0])
    c = transform([0.3 + 0.3 * np.cos(g), 0.3 * np.sin(g), 0], [0, 0, 0])
    path = segment_path([line(a, b, 1), line(b, c, 1)], np.array([0.08]), 1.0)
    passed = np.linalg.norm(path.poses(np.array(0.5))[:3, 3] - b[:3, 3])
    np.testing.assert_allclose(passed, 3 / 8 * 0.08 * np.sin(g / 2), rtol=1e-9)
    np.testing.assert_allclose(path.misses, [passed, 0.0], atol=1e-12)
    back = joint_sequence(np.array([[0.0, 0.2], [1.0, 0.2], [0.0, 0.2]]), np.array([0.5]), 1.0)
    np.testing.assert_allclose(back.misses, [3 / 8 * 0.5, 0.0])


def test_sharp_corner_is_a_halt_and_a_straight_one_is_none():
    a, b, c, d = (transform(p, [0, 0, 0]) for p in ([0, 0, 0], [0.1, 0, 0], [0.3, 0, 0], [0.3, 0.2, 0]))
    path = segment_path([line(a, b, 1), line(b, c, 1), line(c, d, 1)], np.zeros(2), 5.0)
    np.testing.assert_allclose(path.law.progress, [0, 0.6, 1])
    np.testing.assert_allclose(path.law.times, [0, 3, 5])
    np.testing.assert_allclose(path.progress(np.array([3.0]))[1], 0, atol=1e-12)
    assert path.progress(np.array([1.0]))[1] > 0
    np.testing.assert_allclose(path.poses(np.array([0.2, 0.6]))[:, :3, 3], [[0.1, 0, 0], [0.3, 0, 0]], atol=1e-12)


def test_corners_are_passed_at_their_times():
    points = [transform(p, [0, 0, 0]) for p in ([0, 0, 0], [0.1, 0, 0], [0.1, 0.2, 0], [0.3, 0.2, 0])]
    segments = [line(a, b, 1) for a, b in pairwise(points)]
    times = Times(np.array([0.0, 1.0, 1.5, 2.0, 4.0]), np.array([0, 1, 2, 2, 3]))
    path = segment_path(segments, np.array([0.0, 0.02]), times)
    share, speed, _ = path.progress(times.times)
    np.testing.assert_allclose(share, [0, 0.2, 0.6, 0.6, 1], atol=1e-12)
    np.testing.assert_allclose(speed, 0, atol=1e-12)
    assert path.duration == 4.0


def test_turn_on_the_spot_is_a_segment_too():
    a, b, c = transform([0, 0, 0], [0, 0, 0]), transform([0, 0, 0], [0, 0, 1.0]), transform([0.1, 0, 0], [0, 0, 1.0])
    path = segment_path([line(a, b, 1), line(b, c, 1)], np.array([0.03]), 2.0)
    check_rates(path, np.linspace(0.011, 0.987, 50))
    assert path.turned == pytest.approx(1.0)


def test_segments_that_no_sequence_can_hold_are_named():
    a, b, c = (transform(p, [0, 0, 0]) for p in ([0, 0, 0], [0.1, 0, 0], [0.1, 0.2, 0]))
    with pytest.raises(PathError, match="segment 2 has no way"):
        segment_path([line(a, b, 1), line(b, b, 1)], np.zeros(1), 1.0)
    with pytest.raises(PathError, match=r"segment 1 .* over 60 mm: half of the shorter side is 50 mm"):
        segment_path([line(a, b, 1), line(b, c, 1)], np.array([0.06]), 1.0)


def test_joint_sequence_rates_corners_and_halts(random):
    points = random.uniform(-2, 2, (5, 6))
    sizes = np.abs(np.diff(points, axis=0)).max(axis=1)
    blends = np.minimum(sizes[:-1], sizes[1:]) * [0.3, 0.0, 0.5]
    move = joint_sequence(points, blends, 6.0)
    q, v, _ = move.joints(np.array([0.0, 6.0]))
    np.testing.assert_allclose(q, points[[0, -1]], atol=1e-12)
    np.testing.assert_allclose(v, 0, atol=1e-12)
    halt = move.law.times[1]
    np.testing.assert_allclose(move.joints(np.array(halt))[0], points[2], atol=1e-12)
    t, step = np.linspace(0.01, 5.99, 301), 1e-6
    _, v, a = move.joints(t)
    before, after = move.joints(t - step), move.joints(t + step)
    np.testing.assert_allclose((after[0] - before[0]) / (2 * step), v, atol=1e-7)
    away = np.abs(t - halt) > 1e-4
    np.testing.assert_allclose(((after[1] - before[1]) / (2 * step))[away], a[away], atol=1e-3)
    rounded = np.abs(move.joints(np.linspace(0, 6, 6001))[0][:, None] - points[[1, 3]]).max(axis=2).min(axis=0)
    assert (rounded > 1e-6).all()
