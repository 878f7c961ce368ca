"""A joint whose zero is off is named where the samples show it, and nothing else is taken for one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from er3a.kinematics.forward import forward
from er3a.vision.hand_eye import calibrate_hand_eye, zeros_tried
from er3a.vision.vision_findings import grave_warnings
from testing.hand_eye_coverage import ROBOT, a_set

pytestmark = pytest.mark.long


@pytest.mark.parametrize("setup", ["eye_in_hand", "eye_to_hand"])
def test_a_joint_zero_that_is_off_is_named_and_one_that_no_sample_shows_is_not_examined(setup):
    for joint, deg in ((3, 5.0), (6, 5.0), (3, 0.0)):
        samples = a_set(setup, 5, {f"offset{joint}": ROBOT.direction[joint - 1] * np.radians(deg)}, 12, stated=False)
        found, unseen, least = zeros_tried(calibrate_hand_eye(samples), ROBOT)
        assert unseen == ("J1", "J6")
        assert 0.5 <= least < (6.0 if deg else 2.0)
        if joint in (1, 6) or not deg:
            assert found.warnings == ()
            continue
        (zero,) = grave_warnings(found.warnings)
        assert zero.joint == joint
        assert abs(zero.offset_deg - deg) < 2 * zero.half_width_deg < 0.5
        q = samples.q + np.radians(zero.offset_deg) * np.eye(6)[joint - 1]
        again = replace(samples, q=q, flange=forward(ROBOT.without_tool(), q))
        assert zeros_tried(calibrate_hand_eye(again), ROBOT)[0].warnings == ()
    poses = replace(samples, q=None)
    assert zeros_tried(calibrate_hand_eye(poses), ROBOT)[1] == ("J1", "J2", "J3", "J4", "J5", "J6")


def test_a_joint_zero_below_the_size_that_is_stated_goes_unnamed():
    for share, named in ((0.5, False), (1.5, True)):
        least = zeros_tried(calibrate_hand_eye(a_set("eye_to_hand", 5, {}, 12, stated=False)), ROBOT)[2]
        off = {"offset3": ROBOT.direction[2] * np.radians(share * least)}
        found, *_ = zeros_tried(calibrate_hand_eye(a_set("eye_to_hand", 5, off, 12, stated=False)), ROBOT)
        assert ("joint_zero" in {each.code for each in found.warnings}) == named


def test_a_moved_camera_is_no_joint_zero():
    samples = a_set("eye_to_hand", 6, {}, 14, stated=False)
    samples.target[7:, :3, 3] += [0.02, 0, 0]
    found, *_ = zeros_tried(calibrate_hand_eye(samples), ROBOT)
    assert "moved_between" in {each.code for each in found.warnings}
