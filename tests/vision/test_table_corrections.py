"""Corrections to a table from hand-eye samples: known truth, what can't be told apart, and how often intervals hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import t as student

from er3a.calibration.outcomes import MovesNothing, NotToldApart
from er3a.kinematics.forward import forward
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.hand_eye import calibrate_hand_eye
from er3a.vision.table_corrections import NoCorrections, TableCorrections, correct_table, zeros_tried
from er3a.vision.vision_findings import grave_warnings
from testing.hand_eye_coverage import POSITION, ROBOT, ROTATION, a_set
from testing.hand_eye_sets import X_TRUE, Y_TRUE, flange_poses, noisy, off, seen

WRONG = {"a2": 4e-4, "d4": -3e-4, "offset3": np.radians(0.05), "alpha5": np.radians(-0.04)}


def corrected(samples) -> TableCorrections:
    found = correct_table(calibrate_hand_eye(samples), ROBOT)
    assert isinstance(found, TableCorrections)
    return found


@pytest.mark.long
@pytest.mark.parametrize("stated", [True, False])
@pytest.mark.parametrize("setup", ["eye_in_hand", "eye_to_hand"])
def test_wrong_entries_are_found_within_their_intervals(setup, stated):
    found = corrected(a_set(setup, 1, WRONG, 40, stated))
    by_name = {each.name: (each.correction, half) for each, half in zip(found.estimates, found.entry_half_width)}
    for entry, error in WRONG.items():
        value, half = by_name[entry]
        truth = 1000 * error if entry[:-1] in ("a", "d") else np.degrees(error)
        assert abs(value) > half or entry == "d4"
        assert abs(value - truth) < 2 * half
    assert found.probability < 1e-6
    assert found.scatter < 1.2
    assert np.abs(off(found.X, X_TRUE)[:3]).max() < 5e-4


@pytest.mark.long
def test_a_right_table_is_not_spoken_against():
    by_chance = [corrected(a_set("eye_to_hand", seed, {})).probability for seed in range(3)]
    assert min(by_chance) > 1e-3


@pytest.mark.parametrize(
    ("setup", "base", "flange"),
    [("eye_in_hand", "T_base_board", "T_flange_camera"), ("eye_to_hand", "T_base_camera", "T_flange_board")],
)
def test_what_can_not_be_told_apart_is_named(setup, base, flange):
    """What moves the base's frame, the flange's, or two parallel axes, as the poses or each other do."""
    held = {each.entries[0]: each for each in corrected(a_set(setup, 2, {})).held if isinstance(each, NotToldApart)}
    for entry, pose in {"d1": base, "offset1": base, "d6": flange, "offset6": flange, "a6": flange}.items():
        assert held[entry].entries == (entry, pose)
    assert set(held["d2"].entries) == {"d2", "d3"}
    assert held["d2"].parallel_joints == (2, 3)


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


@pytest.mark.long
def test_held_entries_change_no_prediction():
    """An error of a held entry is taken up in full by what it can't be told from: the residuals stay as they were."""
    alike = corrected(a_set("eye_to_hand", 3, {"d1": 2e-3, "offset6": np.radians(0.3)}))
    sound = corrected(a_set("eye_to_hand", 3, {}))
    assert alike.scatter == pytest.approx(sound.scatter, abs=1e-6)
    for a, b in zip(alike.estimates, sound.estimates):
        assert a.correction == pytest.approx(b.correction, abs=1e-4)


@pytest.mark.long
def test_corrections_and_their_intervals_are_those_of_scipys_least_squares():
    """An oracle with forward kinematics of plain matrices, for the entries that were estimated."""
    samples = a_set("eye_in_hand", 4, WRONG)
    found = corrected(samples)
    assert ROBOT.convention == "standard"
    names = [each.name for each in found.estimates if not each.name.startswith("beta")]
    betas = [each.name for each in found.estimates if each.name.startswith("beta")]

    def predicted(p):
        table = {name: np.array(getattr(ROBOT, name)) for name in ("a", "d", "alpha", "offset", "beta")}
        for entry, amount in zip(names + betas, p[12:]):
            table[entry[:-1]][int(entry[-1]) - 1] += amount
        flange = np.tile(ROBOT.base, (len(samples), 1, 1))
        for j in range(6):
            theta = ROBOT.direction[j] * samples.q[:, j] + table["offset"][j]
            turn = np.tile(np.eye(4), (len(theta), 1, 1))
            turn[:, :3, :3] = Rotation.from_rotvec(np.outer(theta, [0, 0, 1])).as_matrix()
            link = np.eye(4)
            link[:3, :3] = Rotation.from_euler("XY", [table["alpha"][j], table["beta"][j]]).as_matrix()
            link[:3, 3] = table["a"][j], 0, table["d"][j]
            flange = flange @ turn @ link
        X, Y = np.eye(4), np.eye(4)
        X[:3, :3], X[:3, 3] = Rotation.from_rotvec(p[3:6]).as_matrix(), p[:3]
        Y[:3, :3], Y[:3, 3] = Rotation.from_rotvec(p[9:12]).as_matrix(), p[6:9]
        return np.linalg.inv(flange @ X) @ Y

    def cost(p):
        T = predicted(p)
        turn = Rotation.from_matrix(samples.target[:, :3, :3] @ np.swapaxes(T[:, :3, :3], 1, 2)).as_rotvec()
        return np.concatenate([(samples.target[:, :3, 3] - T[:, :3, 3]) / POSITION, turn / ROTATION]).ravel()

    start = np.concatenate(
        [np.r_[T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_rotvec()] for T in (X_TRUE, Y_TRUE)]
        + [np.zeros(len(names) + len(betas))]
    )
    least = least_squares(cost, start, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    by_name = {each.name: each for each in found.estimates}
    for entry, amount in zip(names + betas, least.x[12:]):
        assert by_name[entry].correction == pytest.approx(amount * by_name[entry].parameter.in_unit, abs=2e-5)
    free = len(least.fun) - len(least.x)
    size = np.linalg.norm(least.jac, axis=0)
    inverse = np.linalg.inv((least.jac / size).T @ (least.jac / size))
    error = np.sqrt(2 * least.cost / free * np.diag(inverse)) / size
    half_width = dict(zip((each.name for each in found.estimates), found.entry_half_width))
    for entry, own in zip(names + betas, student.ppf(0.975, free) * error[12:]):
        # Ours rest on the scatter of whole samples, the oracle's on independent numbers; here the noise is independent.
        assert half_width[entry] == pytest.approx(own * by_name[entry].parameter.in_unit, rel=1 / 3)


def test_without_joint_angles_or_samples_enough_it_says_so():
    flange = flange_poses(np.random.default_rng(5), 12)
    poses = calibrate_hand_eye(
        CalibrationSet("eye_in_hand", flange, noisy(seen("eye_in_hand", flange), np.random.default_rng(6)))
    )
    assert correct_table(poses, ROBOT) == NoCorrections("joints")
    few = a_set("eye_in_hand", 7, {}, 5)
    assert correct_table(calibrate_hand_eye(few), ROBOT) == NoCorrections("few")


def test_a_level_asks_for_its_entries_only():
    found = correct_table(calibrate_hand_eye(a_set("eye_in_hand", 8, {})), ROBOT, "lengths")
    assert {each.name[0] for each in found.estimates} <= {"a", "d"}
    assert not any(isinstance(each, MovesNothing) for each in found.held)
