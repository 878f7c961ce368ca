"""What models say about references, against independent computation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward, frames
from er3a.references.predict import predict, read, search, state_of
from er3a.references.quantities import (
    ZERO_POSE,
    AxisAngle,
    AxisCoordinate,
    AxisDistance,
    Extreme,
    Limit,
    LimitExcess,
    ModelState,
    SectionExtent,
    SegmentAngle,
    Speed,
)
from er3a.references.reference import Reference, conflicts, expected_of, quantities_of
from er3a.references.rows import PositionRow
from er3a.robots.robot import Robot
from testing.arms import OTHERS_LONG
from testing.reference_subjects import axis_direction, joint_limit

# Joint origins (m, rad) of the URDF in hanliumaozhi/efort_description: xyz, then fixed-axis roll, pitch, yaw.
URDF = (
    ((0, 0, 0.1815), (0, 0, 0)),
    ((0.05, 0, 0.14), (1.5708, -1.5708, 0)),
    ((0.27, 0, 0), (0, 0, 0)),
    ((0.07, -0.299, 0), (-1.5708, 0, -3.1416)),
    ((0, 0, 0), (1.5708, 0, 0)),
    ((0, 0.0785, 0), (1.5708, 0, 3.1416)),
)


def urdf_flange_mm(pose_deg) -> np.ndarray:
    T = np.eye(4)
    for (xyz, rpy), angle in zip(URDF, pose_deg):
        step = np.eye(4)
        turn = Rotation.from_euler("xyz", rpy) * Rotation.from_euler("z", angle, degrees=True)
        step[:3, :3], step[:3, 3] = turn.as_matrix(), xyz
        T = T @ step
    return T[:3, 3] * 1000


def published_modified_table() -> Robot:
    """The modified table of the ER3A-C60's CAD project, which ends at the wrist: the flange is 78.5 mm further."""
    standard = load_robot("er3a_c60")
    return standard.replace(
        convention="modified",
        a=np.array([0, 50, 270, 70, 0, 0]) / 1000,
        alpha=np.radians([0, 90, 0, 90, -90, 90]),
        d=np.array([321.5, 0, 0, 299, 0, 78.5]) / 1000,
        direction=np.ones(6),
        offset=np.radians([0, 90, 0, 0, 0, 0]),
    )


def test_committed_positions_follow_from_the_urdf():
    rows = [
        row for row in load_references("er3a_c60").of(PositionRow) if row.grade == "export" and row.point == "flange"
    ]
    assert len(rows) >= 7
    for row in rows:
        np.testing.assert_allclose(urdf_flange_mm(row.pose), row.xyz_mm, atol=0.006)


@pytest.mark.long
def test_published_modified_table_is_the_same_robot(random):
    standard, modified = load_robot("er3a_c60"), published_modified_table()
    q = random.uniform(-3, 3, (1000, 6))
    np.testing.assert_allclose(forward(modified, q), forward(standard, q), atol=1e-12)
    stated = load_references("er3a_c60").checkable
    values, expected_values = predict(modified, stated), predict(standard, stated)
    np.testing.assert_allclose(values, expected_values, atol=1e-6)
    expected, uncertainty = expected_of(stated)
    assert (np.abs(values - expected) <= uncertainty).all()


def test_axis_lines_agree_with_circles_of_a_carried_point(robot):
    """Circle point analysis: one joint turned alone, the track of a point on the flange gives the axis."""
    state = state_of(robot, ())
    carried = np.array([0.15, 0.12, 0.2, 1.0])
    for joint in range(1, 7):
        q = np.zeros((5, 6))
        q[:, joint - 1] = np.radians([-40, -15, 5, 30, 55])
        track = (forward(robot, q) @ carried)[:, :3]
        normal = np.linalg.svd(track - track.mean(axis=0))[2][2]
        chords = track[1:] - track[0]
        halves = (track[1:] + track[0]) / 2
        rows = np.vstack([chords, normal])
        centre = np.linalg.lstsq(rows, np.append((chords * halves).sum(axis=1), normal @ track[0]), rcond=None)[0]
        assert AxisAngle(joint, tuple(normal), False).value(state) == pytest.approx(0, abs=1e-6)
        for k, letter in enumerate("xyz"):
            value = AxisCoordinate(joint, letter, tuple(centre * 1000)).value(state)
            assert value == pytest.approx(centre[k] * 1000, abs=1e-6)


def test_sense_of_an_axis_counts_only_if_signed():
    state = state_of(load_robot("er3a_c60"), ())
    assert AxisAngle(2, (0, 1, 0), False).value(state) == pytest.approx(0, abs=1e-9)
    assert AxisAngle(2, (0, 1, 0), True).value(state) == pytest.approx(180)
    assert AxisAngle(2, (0, -1, 0), True).value(state) == pytest.approx(0, abs=1e-9)


def test_segments_of_the_article_arm_lie_as_the_table_has_them():
    state = state_of(load_robot("er3a_c60_article"), ())
    assert SegmentAngle("upper_arm").value(state) == pytest.approx(90)
    assert SegmentAngle("forearm").value(state) == pytest.approx(180)


def test_limits_speeds_and_poses_outside():
    robot = load_robot("er3_600")
    pose = (0.0, 90.0, 0.0, 0.0, 0.0, 0.0)
    state = state_of(robot, (LimitExcess(pose),))
    assert LimitExcess(pose).value(state) == pytest.approx(5)
    below = (0.0, float(np.degrees(robot.lower[1])) - 7.0, *pose[2:])
    assert LimitExcess(below).value(state) == pytest.approx(7)
    assert LimitExcess((0.0,) * 6).value(state) == 0
    assert Limit(3, "upper").value(state) == pytest.approx(185)
    assert Speed(6).value(state) == pytest.approx(840)


def test_a_batch_of_candidates_is_read_at_once():
    """Leading dimensions of the state are candidate tables; the result is each table's prediction."""
    robot = load_robot("er3a_c60")
    references = tuple(r for r in load_references("er3a_c60").checkable if not isinstance(r.quantity, Extreme))
    stated = quantities_of(references)
    candidates = [robot.replace(d=robot.d + shift) for shift in (0.0, 0.001, 0.01)]
    states = [state_of(candidate, stated) for candidate in candidates]
    keys = ("direction", "lower", "upper", "speed")
    batch = ModelState(
        frames=np.stack([state.frames for state in states]),
        index=states[0].index,
        **{key: np.stack([getattr(state, key) for state in states]) for key in keys},
        extremes={},
    )
    values = read(stated, batch)
    assert values.shape == (3, len(stated))
    for row, candidate in zip(values, candidates):
        np.testing.assert_array_equal(row, predict(candidate, references))


@pytest.mark.long
@OTHERS_LONG
@pytest.mark.parametrize("point", ["wrist_centre", "flange"])
@pytest.mark.parametrize(
    ("kind", "where"), [(AxisDistance, 1), (AxisDistance, 2), (SectionExtent, "x"), (SectionExtent, "z")]
)
def test_extremes_are_never_beaten_by_sampling(robot, random, point, kind, where):
    q = random.uniform(robot.lower, robot.upper, (50_000, 6))
    q[:, 0] = 0
    extreme = kind(point, "greatest", where)
    sampled = extreme.measure(frames(robot, q)) * 1000
    greatest, at = search(robot, extreme, 16)
    least, _ = search(robot, kind(point, "least", where), 16)
    assert sampled.max() <= greatest + 1e-6
    assert least - 1e-6 <= sampled.min()
    assert greatest == pytest.approx(float(extreme.measure(frames(robot, at))) * 1000, abs=1e-9)
    assert ((at >= robot.lower - 1e-12) & (at <= robot.upper + 1e-12)).all()


@pytest.mark.parametrize(
    ("name", "reach"), [("er3a_c60", 627.0847), ("er3_600", 592.8074), ("er3a_c60_article", 1301.61)]
)
def test_wrist_reach_is_that_of_the_stretched_arm(name, reach):
    robot = load_robot(name)
    a, d = robot.a * 1000, robot.d * 1000
    assert a[0] + a[1] + np.hypot(a[2], d[3]) == pytest.approx(reach, abs=1e-3)
    assert search(robot, AxisDistance("wrist_centre", "greatest", 1), 32)[0] == pytest.approx(reach, abs=1e-3)


def test_reach_respects_limits():
    """With the elbow held away from straight the reach is that of the bent arm, by the law of cosines."""
    robot = load_robot("er3a_c60_article")
    robot = robot.replace(lower=np.where(np.arange(6) == 2, np.radians(-60), robot.lower))
    robot = robot.replace(upper=np.where(np.arange(6) == 2, np.radians(20), robot.upper))
    bend = np.radians(np.array([-60, 20]) + 90)
    lengths = np.sqrt(0.65**2 + 0.65161**2 + 2 * 0.65 * 0.65161 * np.cos(bend)) * 1000
    value = search(robot, AxisDistance("wrist_centre", "greatest", 2), 32)[0]
    assert value == pytest.approx(lengths.max(), abs=1e-6)


def test_the_manufacturers_two_radii_conflict_and_nothing_else():
    stated = load_references("er3_600").checkable
    pairs = conflicts(stated)
    assert [{stated[i].expected, stated[j].expected} for i, j in pairs] == [{592.8, 600.0}]
    assert not conflicts(load_references("er3a_c60").checkable)


@given(st.floats(-1000, 1000), st.floats(-1000, 1000), st.floats(0.01, 50), st.floats(0.01, 50))
def test_a_conflict_is_what_no_value_can_meet(first, second, u1, u2):
    pair = tuple(
        Reference(joint_limit(1, "upper"), "limits", Limit(1, "upper"), expected, uncertainty, source, "official")
        for expected, uncertainty, source in ((first, u1, "a"), (second, u2, "b"))
    )
    best = (first * u2 + second * u1) / (u1 + u2)
    can_be_met = abs(best - first) <= u1 + 1e-9 and abs(best - second) <= u2 + 1e-9
    if abs(abs(first - second) - (u1 + u2)) > 1e-6:
        assert bool(conflicts(pair)) == (not can_be_met)


def test_directions_conflict_by_the_angle_between_them():
    level, tilted = (1.0, 0.0, 0.0), (np.cos(0.02), 0.0, np.sin(0.02))
    for uncertainty, count in ((0.5, 1), (0.6, 0)):
        pair = tuple(
            Reference(axis_direction(4, False), "axes", AxisAngle(4, toward, False), 0.0, uncertainty, source, "cad")
            for toward, source in ((level, "a"), (tilted, "b"))
        )
        assert len(conflicts(pair)) == count


def test_zero_pose_is_always_seen():
    assert ZERO_POSE in state_of(load_robot("er3_600"), ()).index
