"""Which arms have the closed form, what can't be reached and by how much, and what the branches are called."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from er3a.errors import NotWristPartitionedError
from er3a.finding import fact
from er3a.kinematics.closed_form import OFF_AXIS, ORIENTATION, TOO_FAR, TOO_NEAR
from er3a.kinematics.forward import forward, frames
from er3a.kinematics.inverse import inverse
from er3a.kinematics.solutions import branch_labels
from er3a.kinematics.wrist_partitioned import solve_slots, wrist_partition_missing, wrist_partitioned_arm
from er3a.pipeline.messages import kinematics  # noqa: F401
from er3a.pipeline.messages.say import say
from testing.arms import DEG, OTHERS_LONG, joints_at_random, make_arm, number, placement, pose_errors

SIDEWAYS = {"a": [0, 0.4318, 0.0203, 0, 0, 0], "d": [0.66, 0, 0.15, 0.4318, 0, 0.05]}


def pose_with_wrist_at(robot, centre, rpy=(0.4, 0.9, -0.3)):
    """The tool pose of this orientation whose wrist centre is there, for arms whose row 6 has only a length d."""
    T = placement(centre, rpy)
    T[:3, 3] += robot.d[5] * T[:3, 2]
    return T


def unsolved(solution, side):
    """Why one side has no solution."""
    (why,) = [found.why for found in solution.unsolved if found.side == side]
    return why


def lengths(robot):
    """Upper arm and forearm of a standard table without sideways offsets."""
    return robot.a[1], np.hypot(robot.a[2], robot.d[3])


@pytest.mark.parametrize("outside", [1e-6, 1e-3, 0.0217, 0.25, 3.0])
def test_too_far_says_by_how_much(robot, outside):
    reach = sum(lengths(robot)) + outside
    centre = [robot.a[0] + reach * np.cos(0.4), 0, robot.d[0] + reach * np.sin(0.4)]
    solution = inverse(robot, pose_with_wrist_at(robot, centre))
    assert len(solution.q) == 0
    assert solution.q.shape == (0, 6)
    assert unsolved(solution, "front").gap_mm == pytest.approx(outside * 1000, abs=1e-9)
    back = np.hypot(centre[0] + robot.a[0], centre[2] - robot.d[0]) - sum(lengths(robot))
    assert unsolved(solution, "back").gap_mm == pytest.approx(back * 1000, abs=1e-9)
    for found in solution.unsolved:
        assert found.why.code == "wrist_too_far"
        assert found.why.reach_mm == pytest.approx(sum(lengths(robot)) * 1000)
        assert f"{sum(lengths(robot)) * 1000:.1f} mm from axis 2" in say(found)
        assert "e+" not in say(found)


@pytest.mark.long
@given(
    lengths_m=st.tuples(number(0, 0.3), number(0.1, 1), number(-0.15, 0.15), number(0.2, 1)),
    angle=number(-1.2, 1.2),
    outside=st.one_of(number(-5e-10, 5e-10), number(1e-6, 2)),
)
def test_boundary_of_the_reach(lengths_m, angle, outside):
    a1, a2, a3, d4 = lengths_m
    arm = make_arm(a=[a1, a2, a3, 0, 0, 0], d=[0.3, 0, 0, d4, 0, 0.08])
    reach = sum(lengths(arm)) + outside
    T = pose_with_wrist_at(arm, [a1 + reach * np.cos(angle), 0, 0.3 + reach * np.sin(angle)])
    _, fault, gap = (batch[0] for batch in solve_slots(arm, T[None], np.zeros((1, 6))))
    if outside < 1e-9:
        rows = inverse(arm, T).q
        assert len(rows) > 0
        assert max(part.max() for part in pose_errors(forward(arm, rows), T)) < 1e-9
    else:
        assert (fault == TOO_FAR).all()
        assert gap.min() == pytest.approx(outside, abs=1e-12)


@given(
    lengths_m=st.tuples(number(0, 0.3), number(0.5, 1), number(-0.1, 0.1), number(0.2, 0.3)),
    angle=number(-1.2, 1.2),
    inside=st.one_of(number(-5e-10, 5e-10), number(1e-6, 0.1)),
)
def test_boundary_of_the_folded_arm(lengths_m, angle, inside):
    a1, a2, a3, d4 = lengths_m
    arm = make_arm(a=[a1, a2, a3, 0, 0, 0], d=[0.3, 0, 0, d4, 0, 0.08])
    upper, fore = lengths(arm)
    reach = upper - fore - inside
    T = pose_with_wrist_at(arm, [a1 + reach * np.cos(angle), 0, 0.3 + reach * np.sin(angle)])
    _, fault, gap = (batch[0] for batch in solve_slots(arm, T[None], np.zeros((1, 6))))
    front = slice(0, 4) if branch_labels(arm)[0].startswith("front_") else slice(4, 8)
    if inside < 1e-9:
        rows = inverse(arm, T).q
        assert len(rows) > 0
        assert max(part.max() for part in pose_errors(forward(arm, rows), T)) < 1e-9
    else:
        assert (fault[front] == TOO_NEAR).all()
        np.testing.assert_allclose(gap[front], inside, rtol=0, atol=1e-12)


def test_too_near_says_by_how_much(robot):
    """The wrist centre on axis 2 itself."""
    upper, fore = lengths(robot)
    solution = inverse(robot, pose_with_wrist_at(robot, [robot.a[0], 0, robot.d[0]]))
    assert unsolved(solution, "front").gap_mm == pytest.approx(abs(upper - fore) * 1000, rel=0.02)
    assert unsolved(solution, "front").code == "wrist_too_near"
    assert unsolved(solution, "front").least_mm == pytest.approx(abs(upper - fore) * 1000)


@pytest.mark.parametrize("inside", [1e-6, 0.01, 0.1499])
def test_too_near_to_axis_one_for_an_arm_with_sideways_offset(inside):
    arm = make_arm(**SIDEWAYS)
    radius = 0.15 - inside
    T = pose_with_wrist_at(arm, [radius * np.cos(2), radius * np.sin(2), 1.0])
    _, fault, gap = (batch[0] for batch in solve_slots(arm, T[None], np.zeros((1, 6))))
    assert (fault == OFF_AXIS).all()
    np.testing.assert_allclose(gap, inside, rtol=0, atol=1e-12)
    solution = inverse(arm, T)
    for side in ("front", "back"):
        assert unsolved(solution, side).gap_mm == pytest.approx(inside * 1000, abs=1e-9)
        assert unsolved(solution, side).code == "wrist_too_near_axis_1"


@pytest.mark.parametrize("offset", [-5e-10, 0.0, 5e-10])
def test_wrist_centre_at_the_sideways_offset_is_solved(offset):
    arm = make_arm(**SIDEWAYS)
    radius = 0.15 - offset
    T = pose_with_wrist_at(arm, [radius * np.cos(2), radius * np.sin(2), 1.2])
    rows = inverse(arm, T).q
    assert len(rows) > 0
    assert max(part.max() for part in pose_errors(forward(arm, rows), T)) < 1e-9


@pytest.mark.parametrize("beyond_deg", [1e-4, 3.0, 20.0])
def test_wrist_that_can_t_tilt_far_enough_says_by_how_much(beyond_deg):
    """A wrist with axes 60 deg apart tilts axis 6 by no more than 120 deg from axis 4."""
    arm = make_arm(alpha=np.array([-90, 0, -90, 60, 60, 0]) * DEG)
    q = np.array([0.2, -1.0, 0.4, 0.3, 0.0, 0.1])
    T = forward(arm, q)
    F = frames(arm, q)
    axis_4, axis_6 = F[3, :3, 2], F[5, :3, 2]
    assert np.degrees(np.arccos(axis_4 @ axis_6)) == pytest.approx(120)
    across = np.cross(axis_4, axis_6) / np.linalg.norm(np.cross(axis_4, axis_6))
    tilted = placement([0, 0, 0], [0, 0, 0])
    tilted[:3, :3] = Rotation.from_rotvec(beyond_deg * DEG * across).as_matrix() @ T[:3, :3]
    tilted[:3, 3] = T[:3, 3] + arm.d[5] * (tilted[:3, 2] - T[:3, 2])
    slots, fault, gap = (batch[0] for batch in solve_slots(arm, T[None], np.zeros((1, 6))))
    own = int(np.nanargmin(np.abs(slots - q).max(axis=1)))
    slots, fault, gap = (batch[0] for batch in solve_slots(arm, tilted[None], np.zeros((1, 6))))
    assert fault[own] == ORIENTATION
    assert np.degrees(gap[own]) == pytest.approx(beyond_deg, abs=1e-9)
    assert np.isnan(slots[own]).all()


def test_a_wrist_that_can_t_tilt_far_enough_is_named():
    arm = make_arm(alpha=np.array([-90, 0, -90, 30, 30, 0]) * DEG)
    T = pose_with_wrist_at(arm, [0.6, 0, 0.4], rpy=(0, -0.6, 0))
    solution = inverse(arm, T)
    assert len(solution.unsolved) == 2
    codes = {found.why.code for found in solution.unsolved}
    assert "wrist_tilts_too_little" in codes
    assert codes <= {"wrist_tilts_too_little", "wrist_too_far", "wrist_too_near"}


@pytest.mark.parametrize(
    ("change", "lacks"),
    [
        ({"alpha": np.array([-90, 1, -90, 90, -90, 0]) * DEG}, fact("elbow_axes_not_parallel")),
        ({"alpha": np.array([0, 0, -90, 90, -90, 0]) * DEG}, fact("neighbouring_axes_parallel", first=1, second=2)),
        ({"alpha": np.array([-90, 0, -90, 0, -90, 0]) * DEG}, fact("neighbouring_axes_parallel", first=4, second=5)),
        ({"alpha": np.array([-90, 0, -90, 90, 180, 0]) * DEG}, fact("neighbouring_axes_parallel", first=5, second=6)),
        ({"d": [0.3, 0, 0, 0.35, 0.02, 0.08]}, fact("no_common_point_of_axes_4_5_6", miss_mm=pytest.approx(10))),
        ({"d": [0.3, 0, 0, 0.35, 2e-6, 0.08]}, fact("no_common_point_of_axes_4_5_6", miss_mm=pytest.approx(1e-3))),
        ({"coupling": np.diag([1.0, 1.0, 2.0, 1.0, 1.0, 1.0])}, fact("coupled_wrist")),
        ({"a": [0.1, 0.4, 0.05, 0.001, 0, 0]}, fact("no_common_point_of_axes_4_5_6", miss_mm=pytest.approx(2 / 3))),
        ({"a": [0.1, 0.0, 0.05, 0, 0, 0]}, fact("upper_arm_or_forearm_without_length")),
        ({"a": [0.1, 0.4, 0, 0, 0, 0], "d": [0.3, 0, 0, 0, 0, 0.08]}, fact("upper_arm_or_forearm_without_length")),
    ],
)
def test_other_arms_are_told_what_they_lack(change, lacks):
    arm = make_arm(**change)
    with pytest.raises(NotWristPartitionedError, match=r"^made: no closed-form inverse \(") as caught:
        wrist_partitioned_arm(arm)
    assert caught.value.property_missing == wrist_partition_missing(arm) == lacks


def test_a_collaborative_arm_without_wrist_centre_is_told_so():
    """The published D-H table of the UR5, whose axes 2, 3 and 4 are parallel."""
    arm = make_arm(
        a=[0, -0.425, -0.39225, 0, 0, 0],
        alpha=np.array([90, 0, 0, 90, -90, 0]) * DEG,
        d=[0.089159, 0, 0, 0.10915, 0.09465, 0.0823],
    )
    missing = wrist_partition_missing(arm)
    assert missing.code == "no_common_point_of_axes_4_5_6"
    assert re.fullmatch(r"axes 4, 5 and 6 miss a common point by [\d.]+ mm", say(missing))


def test_recognised_lengths(robot):
    arm = wrist_partitioned_arm(robot)
    upper, fore = lengths(robot)
    assert arm.upper_arm_length == pytest.approx(upper, abs=1e-15)
    assert arm.forearm_length == pytest.approx(fore, abs=1e-15)
    assert arm.wrist_reach == pytest.approx(upper + fore, abs=1e-15)
    np.testing.assert_allclose(arm.wrist_in_tool, [0, 0, -robot.d[5]], atol=1e-15)


@pytest.mark.parametrize(("name", "reach_mm"), [("er3a_c60", 577.1), ("er3a_c60_article", 1301.61), ("er3_600", 592.8)])
def test_reach_of_the_wrist_from_axis_two(robot, name, reach_mm):
    if robot.name == name:
        assert wrist_partitioned_arm(robot).wrist_reach * 1000 == pytest.approx(reach_mm, abs=0.05)


def test_branch_labels_are_distinct_and_in_slot_order(robot):
    labels = branch_labels(robot)
    assert len(set(labels)) == 8
    for slot, label in enumerate(labels):
        assert label.endswith("_no_flip") == (slot % 2 == 0)
        assert label.split("_")[0] == labels[4 * (slot // 4)].split("_")[0]
        assert label.split("_")[2] == labels[2 * (slot // 2)].split("_")[2]


@OTHERS_LONG
def test_branch_labels_mean_what_they_say(robot, random):
    """Front and back, up and down, judged on the points of the arm (zero pose facing +x, axis 1 vertical)."""
    checked = {"front": 0, "back": 0, "up": 0, "down": 0}
    for q in joints_at_random(robot, random, 300):
        solution = inverse(robot, forward(robot, q))
        for row, slot in zip(solution.q, solution.branch):
            shoulder, _, elbow, wrist = branch_labels(robot)[slot].split("_", 3)
            F = frames(robot, row)
            facing = np.array([np.cos(row[0]), np.sin(row[0]), 0])
            wrist_centre = F[6, :3, 3] - robot.d[5] * F[6, :3, 2]
            ahead = facing @ wrist_centre
            assert shoulder == ("front" if ahead > 0 else "back")
            checked[shoulder] += 1
            theta_5 = robot.direction[4] * row[4] + robot.offset[4]
            assert wrist == ("flip" if np.sin(theta_5) < 0 else "no_flip")
            # The line from axis 2 to the wrist centre, where it leads outward at less than 45 deg.
            outward = facing * np.sign(ahead)
            line, elbow_from_2 = wrist_centre - F[1, :3, 3], F[2, :3, 3] - F[1, :3, 3]
            if outward @ line > abs(line[2]):
                above = elbow_from_2[2] - line[2] * (outward @ elbow_from_2) / (outward @ line)
                assert elbow == ("up" if above > 0 else "down")
                checked[elbow] += 1
    assert min(checked.values()) > 50


def test_labels_of_an_arm_that_stands_upright_in_its_zero_pose():
    """With the wrist centre on axis 1 in the zero pose, front is a side that rounding can't turn over."""
    arm = make_arm(a=[0, 0.4, 0, 0, 0, 0], offset=np.array([0, -90, -90, 0, 0, 0]) * DEG)
    T = forward(arm, np.zeros(6), frame=4)
    assert np.abs(T[:2, 3]).max() < 1e-15
    nudged = arm.replace(offset=arm.offset + np.array([0, 1e-13, 0, 0, 0, 0]))
    assert branch_labels(arm) == branch_labels(nudged) == branch_labels(arm.replace(offset=arm.offset - 1e-13))
