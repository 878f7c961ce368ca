"""Hand-eye calibration against OpenCV, scipy's own minimum and known truth, and with what people do wrong."""

from __future__ import annotations

from dataclasses import replace
from itertools import cycle
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from scipy.linalg import sqrtm
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.special import stdtrit

from er3a.finding import fact, is_one
from er3a.geometry.transforms import moved, transform
from er3a.pipeline.scope import Open
from er3a.pipeline.stages.vision.compute import _open_frames
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.classic_methods import park
from er3a.vision.hand_eye import CONVENTIONS, calibrate_hand_eye, other_conventions
from er3a.vision.likelihood import refine, residuals
from er3a.vision.typical_causes import moved_between, wrong_distances
from er3a.vision.vision_findings import HandEyeError, grave_warnings
from testing.hand_eye_coverage import board_coverage, pose_coverage
from testing.hand_eye_sets import (
    PIXELS,
    X_TRUE,
    Y_TRUE,
    by_solve_pnp,
    covariance,
    flange_of,
    flange_poses,
    noisy,
    off,
    pose,
    seen,
    views,
)

SETUPS = ("eye_in_hand", "eye_to_hand")


def a_set(setup: str, seed: int = 0, count: int = 15, **more) -> CalibrationSet:
    random = np.random.default_rng(seed)
    flange = flange_poses(random, count)
    return CalibrationSet(setup, flange, noisy(seen(setup, flange), random), **more)


def by_opencv(F: np.ndarray, B: np.ndarray) -> np.ndarray:
    method = cv2.CALIB_HAND_EYE_PARK
    R, t = cv2.calibrateHandEye(F[:, :3, :3], F[:, :3, 3], B[:, :3, :3], B[:, :3, 3], method=method)
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, t.ravel()
    return X


@pytest.mark.parametrize("setup", SETUPS)
def test_the_closed_form_answers_as_opencv_does(setup):
    random = np.random.default_rng(5)
    flange = flange_poses(random, 12, turn=0.35)
    B = noisy(seen(setup, flange), random)
    F = flange if setup == "eye_in_hand" else np.linalg.inv(flange)
    assert np.abs(park(F, B)[0] - by_opencv(F, B)).max() < 1e-9


def test_the_closed_form_finds_the_truth_without_noise():
    flange = flange_poses(np.random.default_rng(6), 6)
    X, Y = park(flange, seen("eye_in_hand", flange))
    assert np.abs(X - X_TRUE).max() < 1e-9
    assert np.abs(Y - Y_TRUE).max() < 1e-9


def test_derivatives_are_those_of_differences():
    random = np.random.default_rng(2)
    flange = flange_poses(random, 4)
    B = noisy(seen("eye_in_hand", flange), random, 0.1, 0.4)
    _, J = residuals(flange, B, X_TRUE, Y_TRUE)
    for k in range(12):
        step = np.zeros(12)
        step[k] = 1e-6
        ends = [residuals(flange, B, moved(X_TRUE, s * step[:6]), moved(Y_TRUE, s * step[6:]))[0] for s in (1, -1)]
        np.testing.assert_allclose(J[..., k], (ends[0] - ends[1]) / 2e-6, atol=1e-8)


def test_the_refinement_ends_where_scipy_finds_the_least_squares():
    """An oracle with rotation vectors of its own, and no derivative of ours."""
    samples = a_set("eye_in_hand", 8, camera_covariance=covariance(15))

    def cost(p):
        X, Y = pose([0, 0, 0], p[:3]), pose([0, 0, 0], p[6:9])
        X[:3, :3], Y[:3, :3] = (Rotation.from_rotvec(v).as_matrix() for v in (p[3:6], p[9:]))
        predicted = np.linalg.inv(samples.flange @ X) @ Y
        turn = Rotation.from_matrix(samples.target[:, :3, :3] @ np.swapaxes(predicted[:, :3, :3], 1, 2)).as_rotvec()
        return np.concatenate([(samples.target[:, :3, 3] - predicted[:, :3, 3]) / 5e-4, turn / 2e-3]).ravel()

    found = calibrate_hand_eye(samples)
    start = [np.r_[T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_rotvec()] for T in (X_TRUE, Y_TRUE)]
    least = least_squares(cost, np.concatenate(start), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert found.used.all()
    np.testing.assert_allclose(found.X[:3, 3], least.x[:3], atol=1e-7)
    np.testing.assert_allclose(found.X[:3, :3], Rotation.from_rotvec(least.x[3:6]).as_matrix(), atol=1e-7)
    free = 6 * 15 - 12
    np.testing.assert_allclose(found.scatter**2 * free, 2 * least.cost, rtol=1e-9)
    by_sample, positions = np.arange(90).reshape(2, 15, 3).transpose(1, 0, 2).ravel(), [0, 1, 2, 6, 7, 8]
    half_width = clustered_half_width(least.jac[by_sample], least.fun[by_sample])
    refined = refine(samples, found.X, found.Y)
    np.testing.assert_allclose(refined.half_width[positions], half_width[positions], rtol=1e-3)


def clustered_half_width(J: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Bell and McCaffrey's intervals with whole matrices: (12,) of residuals (6 N,), six a sample."""
    count, inverse = len(r) // 6, np.linalg.inv(J.T @ J)
    left = np.eye(len(r)) - J @ inverse @ J.T
    g = np.zeros((12, count, len(r)))
    variance = np.zeros(12)
    for n in range(count):
        own = slice(6 * n, 6 * n + 6)
        weights = inverse @ J[own].T @ np.linalg.inv(sqrtm(left[own, own]).real)
        variance += (weights @ r[own]) ** 2
        g[:, n] = weights @ left[own]
    G = g @ np.swapaxes(g, 1, 2)
    freedom = np.trace(G, axis1=1, axis2=2) ** 2 / (G**2).sum(axis=(1, 2))
    return stdtrit(freedom, 0.975) * np.sqrt(variance)


@pytest.mark.long
@pytest.mark.parametrize(("setup", "stated"), list(zip(SETUPS, (True, False), strict=True)))
def test_intervals_hold_the_truth_as_often_as_they_say(setup, stated):
    """Of 200 runs with 12 numbers: 3.5 standard deviations of each share, and 92 to 98 % in all."""
    held = pose_coverage(setup, stated, 200, 17)
    assert (np.abs(held - 0.95) < 3.5 * np.sqrt(0.95 * 0.05 / 200)).all()
    assert 0.92 < held.mean() < 0.98


@pytest.mark.long
@pytest.mark.parametrize(("setup", "cell"), [("eye_in_hand", "12 samples"), ("eye_to_hand", "the arm errs too")])
def test_intervals_hold_the_truth_of_boards_that_opencv_locates(setup, cell):
    """Positions and rotations, of camera and board; 60 runs leave 3 % either way."""
    held = board_coverage(setup, cell, 60, 20261127).reshape(-1, 4, 3).mean(axis=(0, 2))
    assert (np.abs(held - 0.95) < 0.06).all()


@pytest.mark.long
@pytest.mark.parametrize("setup", SETUPS)
def test_a_board_turned_by_half_is_named_and_left_out(setup):
    samples = a_set(setup, 3)
    samples.target[4] = samples.target[4] @ pose([0, 0, 180], [0.1, 0.08, 0])
    found = calibrate_hand_eye(samples)
    assert [(each.sample, each.kind) for each in found.suspects] == [("5", "half_turn_z")]
    assert not found.used[4]
    assert np.linalg.norm(off(found.X, X_TRUE)[:3]) < 2e-3


@pytest.mark.long
def test_a_mirrored_tilt_is_told_from_other_turns():
    samples = a_set("eye_to_hand", 4)
    T = samples.target[6]
    sight = T[:3, 3] / np.linalg.norm(T[:3, 3])
    T[:3, :3] = (np.eye(3) - 2 * np.outer(sight, sight)) @ T[:3, :3] @ np.diag([1.0, 1.0, -1.0])
    (found,) = calibrate_hand_eye(samples).suspects
    assert is_one(found, "rotation_mismatch")
    assert (found.sample, found.kind) == ("7", "mirrored_tilt")


@pytest.mark.long
def test_a_shifted_board_is_named_though_no_angle_tells_it():
    samples = a_set("eye_in_hand", 9)
    samples.target[2, :3, 3] += [0.01, 0, 0]
    (found,) = calibrate_hand_eye(samples).suspects
    assert is_one(found, "far_from_fit")
    assert found.sample == "3"
    assert found.off_mm == pytest.approx(10, abs=2)


@pytest.mark.long
def test_sound_sets_name_hardly_any_sample():
    named = [len(calibrate_hand_eye(a_set("eye_in_hand", seed, 12)).suspects) for seed in range(25)]
    assert sum(named) <= 2  # 0.25 to be expected at one false alarm in a hundred sets


@pytest.mark.long
def test_copies_of_samples_narrow_no_interval():
    once = a_set("eye_to_hand", 3, 6)
    copied = CalibrationSet("eye_to_hand", np.tile(once.flange, (3, 1, 1)), np.tile(once.target, (3, 1, 1)))
    found = calibrate_hand_eye(copied)
    np.testing.assert_allclose(found.half_width, calibrate_hand_eye(once).half_width, rtol=1e-6)
    assert found.used.sum() == 6
    assert found.copies == tuple(str(k) for k in range(7, 19))


def test_a_fit_that_does_not_converge_can_not_be_used():
    """Three samples: the two variances run away from each other, and intervals change threefold from round to round."""
    for seed, converged in ((4, True), (2, False)):
        found = calibrate_hand_eye(a_set("eye_in_hand", seed, 3))
        assert ("not_converged" in {each.code for each in grave_warnings(found.warnings)}) == (not converged)


@pytest.mark.long
@pytest.mark.parametrize("setup", SETUPS)
def test_poses_without_errors_are_no_reason_to_warn(setup):
    flange = flange_poses(np.random.default_rng(1), 20)
    exact, rounded = seen(setup, flange), seen(setup, flange)
    rounded[:, :3, 3] = np.round(rounded[:, :3, 3], 4)
    for target in (exact, rounded):
        assert calibrate_hand_eye(CalibrationSet(setup, flange, target)).warnings == ()


def test_a_pose_written_again_at_the_end_is_no_other_setup():
    samples = a_set("eye_in_hand", 4, 12)
    samples.flange[9:], samples.target[9:] = samples.flange[8], samples.target[8]
    assert not any(is_one(each, "moved_between") for each in calibrate_hand_eye(samples).warnings)


@pytest.mark.long
def test_places_are_the_same_in_any_order():
    """A chain of small steps, each near the next: one place, whichever comes first."""
    chain = a_set("eye_in_hand", 6, 8)
    for k in (6, 7):
        chain.flange[k] = chain.flange[5]
        chain.flange[k, :3, 3] += [0, 0, 0.0009 * (k - 5)]
    widths = [
        calibrate_hand_eye(chain.take(order)).half_width for order in (np.arange(8), np.array([5, 7, 6, 0, 1, 2, 3, 4]))
    ]
    np.testing.assert_allclose(*widths, rtol=1e-6)


def test_both_streams_inverted_is_the_same_problem_with_the_unknowns_swapped():
    samples = a_set("eye_in_hand", 12)
    F = samples.flange
    X, Y = park(F, samples.target)
    X_swapped, Y_swapped = park(np.linalg.inv(F), np.linalg.inv(seen("eye_in_hand", F)))
    assert np.abs(off(X_swapped, Y_TRUE)).max() < 1e-9
    assert np.abs(off(Y_swapped, X_TRUE)).max() < 1e-9
    assert np.abs(off(X, X_TRUE)).max() < 0.02
    assert np.abs(off(Y, Y_TRUE)).max() < 0.02


def test_a_board_of_another_size_is_named_with_the_factor():
    samples = a_set("eye_to_hand", 13, 20)
    samples.target[:, :3, 3] /= 1.05
    scale = [each for each in calibrate_hand_eye(samples).warnings if is_one(each, "board_scale")]
    assert scale[0].factor == pytest.approx(1.05, abs=scale[0].half_width)


def a_pnp_set(setup: str, seed: int, given: np.ndarray) -> CalibrationSet:
    """Poses that OpenCV computes by intrinsics ``given`` from corners that a camera with others sees, 0.1 px off."""
    random = np.random.default_rng(seed)
    T = views(random, 30, (0.4, 0.7), 25.0)
    return CalibrationSet(setup, flange_of(setup, T), by_solve_pnp(T, random, 0.1, given))


@pytest.mark.long
@pytest.mark.parametrize("setup", SETUPS)
def test_poses_computed_with_a_wrong_focal_length_or_principal_point_are_named(setup):
    """No sample shows it alone; the camera is off by several mm."""
    for factor in (0.95, 1.02, 1.05):
        found = calibrate_hand_eye(a_pnp_set(setup, 5, PIXELS * [[factor], [factor], [1]]))
        assert np.linalg.norm(off(found.X, X_TRUE)[:3]) > 0.003
        (named,) = grave_warnings(found.warnings)
        assert is_one(named, "focal_length")
        assert named.factor == pytest.approx(1 / factor, abs=named.half_width)
    for axis, pixels in (("x", 25), ("y", -25)):
        given = PIXELS.copy()
        given["xy".index(axis), 2] += pixels
        (named,) = grave_warnings(calibrate_hand_eye(a_pnp_set(setup, 6, given)).warnings)
        assert is_one(named, "principal_point")
        assert (named.axis, named.percent) == (axis, pytest.approx(100 * pixels / 900, abs=0.8))
    for seed in range(7, 10):
        assert not grave_warnings(calibrate_hand_eye(a_pnp_set(setup, seed, PIXELS)).warnings)


@pytest.mark.long
def test_sound_sets_have_the_right_board_and_intrinsics():
    """At 10 to 40 samples, with the camera's deviations stated and estimated."""
    wrong = []
    for seed, count in enumerate((10, 14, 20, 30, 40) * 8):
        for setup in SETUPS:
            stated = {"camera_covariance": covariance(count)} if seed % 2 else {}
            samples = a_set(setup, 300 + seed, count, **stated)
            found = wrong_distances(samples, refine(samples, X_TRUE, Y_TRUE))
            wrong.append([each.finding for each in found if each.sure])
    assert wrong == [[]] * 80


MISREAD = {
    "inverted": np.linalg.inv,
    "transposed": lambda T: with_rotations(T, Rotation.inv),
    "real_part_last": lambda T: with_rotations(T, lambda R: Rotation.from_quat(R.as_quat(), scalar_first=True)),
    "real_part_first": lambda T: with_rotations(T, lambda R: Rotation.from_quat(R.as_quat(scalar_first=True))),
    "abc": lambda T: with_rotations(T, lambda R: Rotation.from_euler("xyz", R.as_euler("ZYX"))),
    "turning_axes": lambda T: with_rotations(T, lambda R: Rotation.from_euler("xyz", R.as_euler("XYZ"))),
    "opengl": lambda T: with_positions(T, lambda p: p * [1, -1, -1]),
    "to_optical": lambda T: with_positions(T, lambda p: np.stack([p[:, 2], -p[:, 0], -p[:, 1]], axis=1)),
}
"""What a reader makes of poses that are written by a convention."""


def with_rotations(T: np.ndarray, change) -> np.ndarray:
    out = T.copy()
    out[:, :3, :3] = change(Rotation.from_matrix(T[:, :3, :3])).as_matrix()
    return out


def with_positions(T: np.ndarray, change) -> np.ndarray:
    out = T.copy()
    out[:, :3, 3] = change(T[:, :3, 3])
    return out


@pytest.mark.long
@pytest.mark.parametrize(
    ("convention", "stream"), [*zip(MISREAD, cycle(("flange", "target"))), ("abc", "both"), ("turning_axes", "flange")]
)
def test_poses_read_by_another_convention_are_named(convention, stream):
    """Other setups too: a camera that is taken for one on the flange looks inverted."""
    samples = a_set("eye_in_hand", 14)
    assert other_conventions(samples, calibrate_hand_eye(samples).residual) == ()
    for name in ("flange", "target") if stream == "both" else (stream,):
        samples = replace(samples, **{name: MISREAD[convention](getattr(samples, name))})
    found = calibrate_hand_eye(samples)
    named = [each for each in found.warnings if is_one(each, "other_convention")]
    assert (stream, convention) in {(each.stream, each.convention) for each in named}
    assert max(each.rms_other_mm for each in named) < 3
    assert set(grave_warnings(found.warnings)) >= set(named)


@pytest.mark.parametrize("setup", SETUPS)
def test_recorded_poses_are_doubted_where_nothing_is_compared_with_them(setup):
    """Of one rule: the command lists all frames, grasps rest on the camera's alone."""
    own = "flange_frame" if setup == "eye_in_hand" else "base_frame"
    for joints, touched, simulated, frames in (
        (False, False, False, ("flange_frame", "base_frame")),
        (False, True, False, ("flange_frame",)),
        (True, False, False, ()),
        (False, False, True, ()),
    ):
        samples = a_set(setup, 9, of_joints=joints, touched=np.zeros((3, 2, 3)) if touched else None)
        assert samples.open_frames(simulated) == frames
        head = SimpleNamespace(setup=setup, simulated=simulated)
        assert _open_frames(samples, head) == tuple(Open(each) for each in frames if each == own)


@pytest.mark.long
def test_residuals_that_nothing_explains_are_an_error():
    samples = a_set("eye_in_hand", 14)
    samples.target[:, :3, 3] += np.random.default_rng(3).normal(0, 0.1, (15, 3))
    found = calibrate_hand_eye(samples)
    (grave,) = grave_warnings(found.warnings)
    assert is_one(grave, "unexplained_residuals")
    assert grave.rms_mm > 30


@pytest.mark.long
@pytest.mark.parametrize("stated", [False, True])
def test_a_step_of_the_setup_is_named_with_and_without_stated_deviations(stated):
    samples = a_set("eye_in_hand", 14, **({"camera_covariance": covariance(15)} if stated else {}))
    samples.target[8:] = moved(np.eye(4), np.array([0.02, 0.01, 0, 0, 0, 0.02])) @ samples.target[8:]
    found = calibrate_hand_eye(samples)
    (step,) = [each for each in found.warnings if is_one(each, "moved_between")]
    assert (step.sample, step.what) == (samples.names[8], "camera")


@pytest.mark.long
@pytest.mark.parametrize("setup", SETUPS)
def test_the_other_setup_is_named(setup):
    samples = a_set(setup, 15)
    other = CalibrationSet(next(each for each in SETUPS if each != setup), samples.flange, samples.target)
    assert any(getattr(each, "convention", "") == "inverted" for each in calibrate_hand_eye(other).warnings)
    assert not any(is_one(each, "other_convention") for each in calibrate_hand_eye(samples).warnings)


@pytest.mark.long
def test_residuals_beyond_what_is_stated_are_said():
    good = a_set("eye_in_hand", 15, camera_covariance=covariance(15))
    assert calibrate_hand_eye(good).warnings == ()
    bad = a_set("eye_in_hand", 15, camera_covariance=covariance(15) / 9)
    (found,) = calibrate_hand_eye(bad).warnings
    assert is_one(found, "more_scatter")
    assert found.scatter == pytest.approx(3, abs=0.6)


@pytest.mark.long
def test_samples_too_few_to_be_judged_by_one_another_are_said():
    for count in (4, 6, 7):
        found = calibrate_hand_eye(a_set("eye_in_hand", count=count))
        assert [each.samples for each in found.warnings if is_one(each, "few_samples")] == [count] * (count < 7)
        assert grave_warnings(found.warnings) == ()


def test_little_motion_is_said():
    random = np.random.default_rng(16)
    flange = flange_poses(random, 12, turn=0.03)
    samples = CalibrationSet("eye_in_hand", flange, noisy(seen("eye_in_hand", flange), random))
    found = calibrate_hand_eye(samples)
    assert any(is_one(each, "little_motion") for each in found.warnings)
    assert found.half_width[:3].max() > 2e-3


def refusal(flange: np.ndarray, target: np.ndarray | None = None) -> object:
    target = seen("eye_in_hand", flange) if target is None else target
    with pytest.raises(HandEyeError) as caught:
        calibrate_hand_eye(CalibrationSet("eye_in_hand", flange, target))
    return caught.value.finding


def test_sets_that_determine_nothing_say_why():
    random = np.random.default_rng(20)
    flange = flange_poses(random, 10)
    assert refusal(flange[:2]) == fact("too_few_samples", samples=2, needed=3)
    assert refusal(np.repeat(flange[:1], 5, axis=0)) == fact("all_samples_equal", stream="flange")
    assert refusal(flange, np.repeat(seen("eye_in_hand", flange)[:1], 10, axis=0)) == fact(
        "all_samples_equal", stream="target"
    )
    shifted = flange.copy()
    shifted[:, :3, :3] = flange[0, :3, :3]
    assert is_one(refusal(shifted), "no_rotation")
    about_z = flange.copy()
    about_z[:, :3, :3] = Rotation.from_euler("z", random.uniform(-60, 60, (10, 1)), degrees=True).as_matrix()
    found = refusal(about_z)
    assert is_one(found, "parallel_axes")
    assert abs(found.axis[2]) == pytest.approx(1)


@pytest.mark.long
def test_touched_points_do_not_tell_a_tools_poses_from_the_flanges():
    """What a carried camera saw of the base is where it was, but the camera is off the flange by the tool."""
    flange = a_set("eye_in_hand", 21)
    tool = transform(np.array([0.0, 0.02, 0.16]), np.zeros(3))
    points = np.random.default_rng(4).uniform(-0.1, 0.1, (6, 3))
    base = points @ Y_TRUE[:3, :3].T + Y_TRUE[:3, 3]
    touches = {"touched": np.stack([points, base], axis=1), "touch_deviation": 1e-3}
    for T, off_m in ((np.eye(4), 0.0), (tool, np.linalg.norm(tool[:3, 3]))):
        found = calibrate_hand_eye(replace(flange, flange=flange.flange @ T, **touches))
        assert found.touch.probability > 0.001
        assert found.touch.contradiction is None
        assert np.linalg.norm((T @ found.X)[:3, 3] - X_TRUE[:3, 3]) < 2e-3
        assert np.linalg.norm(found.X[:3, 3] - X_TRUE[:3, 3]) == pytest.approx(off_m, abs=0.1 * off_m + 2e-3)


@pytest.mark.long
def test_touched_points_judge_the_calibration():
    random = np.random.default_rng(21)
    points = random.uniform([-0.2, -0.2, 0.6], [0.2, 0.2, 1.0], (6, 3))
    base = points @ X_TRUE[:3, :3].T + X_TRUE[:3, 3] + random.normal(0, 1e-4, (6, 3))
    touched = np.stack([points + random.normal(0, 5e-4, (6, 3)), base], axis=1)
    good = calibrate_hand_eye(a_set("eye_to_hand", 21, touched=touched, touch_deviation=1e-4))
    assert good.touch.probability > 0.001
    touched[:, 1] += [0.01, 0, 0]
    bad = calibrate_hand_eye(a_set("eye_to_hand", 21, touched=touched, touch_deviation=1e-4))
    assert bad.touch.probability < 1e-6
    assert bad.touch.difference[:, 0].mean() == pytest.approx(0.01, abs=2e-3)


def moving(rotations: Rotation) -> CalibrationSet:
    """A set whose flange has these rotations."""
    random = np.random.default_rng(16)
    flange = flange_poses(random, len(rotations))
    flange[:, :3, :3] = rotations.as_matrix()
    return CalibrationSet("eye_in_hand", flange, noisy(seen("eye_in_hand", flange), random))


def with_poses_added(samples: CalibrationSet) -> CalibrationSet:
    """Beside those of the set, ten poses rotated by 30 deg and more about other axes."""
    turns = np.radians(30) * np.concatenate([np.eye(3), -np.eye(3), 1.5 * np.eye(3), -1.5 * np.eye(3)[:1]])
    more = moving(Rotation.from_rotvec(turns))
    both = (np.concatenate([a, b]) for a, b in ((samples.flange, more.flange), (samples.target, more.target)))
    return CalibrationSet(samples.setup, *both)


def read_as(samples: CalibrationSet, stream: str, read) -> CalibrationSet:
    return replace(samples, **{stream: read(getattr(samples, stream))})


STAYS = np.eye(4)


def of_two_setups(setup: str, count: int, first: int, board=STAYS, camera=STAYS) -> CalibrationSet:
    """Before sample ``first`` everything stands where it should, from there on board or camera is moved."""
    random = np.random.default_rng(31)
    flange = flange_poses(random, count)
    both = np.concatenate([seen(setup, flange[:first]), seen(setup, flange[first:], X_TRUE @ camera, Y_TRUE @ board)])
    return CalibrationSet(setup, flange, noisy(both, random))


SLID, ELSEWHERE, TURNED = (
    pose([0, 0, 0], [0.005, 0.002, 0]),
    pose([5, 0, 20], [0.05, 0.02, 0]),
    pose([0, 3, 0], [0] * 3),
)


@pytest.mark.long
@pytest.mark.parametrize(
    ("setup", "last", "what", "step"),
    [
        ("eye_in_hand", 7, "board", SLID),
        ("eye_to_hand", 3, "board", SLID),
        ("eye_in_hand", 12, "board", ELSEWHERE),
        ("eye_to_hand", 7, "board", ELSEWHERE),
        ("eye_in_hand", 3, "camera", TURNED),
        ("eye_to_hand", 12, "camera", TURNED),
    ],
)
def test_a_set_of_two_setups_is_named_with_the_sample_between(setup, last, what, step):
    found = calibrate_hand_eye(of_two_setups(setup, 18, 18 - last, **{what: step}))
    (named,) = (each for each in found.warnings if is_one(each, "moved_between"))
    assert named.what == what
    assert abs(int(named.sample) - (19 - last)) <= 1
    truth = np.linalg.norm(step[:3, 3]) * 1000
    assert named.moved_mm == pytest.approx(truth, rel=0.3, abs=3)


@pytest.mark.long
def test_sound_sets_are_not_of_two_setups():
    for samples in (a_set(setup, seed, 15) for setup in SETUPS for seed in range(40, 50)):
        assert moved_between(samples, refine(samples, X_TRUE, Y_TRUE)) is None


@pytest.mark.long
@pytest.mark.parametrize(("setup", "apart"), [("eye_in_hand", 1e-4), ("eye_to_hand", 2e-5)])
def test_samples_at_one_pose_count_as_one(setup, apart):
    """Four near copies of each of six samples tell no more than the six: with errors that the copies share."""
    few, random = a_set(setup, 2, 6), np.random.default_rng(5)
    flange, target = (noisy(np.repeat(T, 4, axis=0), random, apart, apart) for T in (few.flange, few.target))
    alone, copied = calibrate_hand_eye(few), calibrate_hand_eye(CalibrationSet(setup, flange, target))
    assert [each.samples for each in copied.warnings if is_one(each, "few_samples")] == [6]
    assert (copied.half_width > 0.5 * alone.half_width).all()
    assert np.abs(off(copied.X, alone.X)).max() < 1e-3


def scaled(samples: CalibrationSet, factor: float) -> CalibrationSet:
    """The set with a board this many times as large."""
    samples.target[:, :3, 3] *= factor
    return samples


def stretched(samples: CalibrationSet, to: int, of: int, share: float) -> CalibrationSet:
    """The set with a share of one coordinate of the board's positions added to another, or to itself."""
    samples.target[:, to, 3] += share * samples.target[:, of, 3]
    return samples


SMALL = Rotation.from_rotvec(np.random.default_rng(2).normal(0, 0.03, (12, 3)))
ABOUT_Z = Rotation.from_euler("z", np.linspace(-60, 60, 10)[:, None], degrees=True)
STILL = Rotation.from_rotvec(np.tile([0.1, 0.2, 0.3], (6, 1)))
MENDED = {
    "other_convention": (
        lambda: read_as(a_set("eye_in_hand", 14), "target", MISREAD["abc"]),
        lambda samples, found: read_as(samples, found.stream, CONVENTIONS[found.convention]),
    ),
    "board_scale": (
        lambda: scaled(a_set("eye_in_hand", 13, 20), 1 / 1.05),
        lambda samples, found: scaled(samples, found.factor),
    ),
    "focal_length": (
        lambda: stretched(a_set("eye_in_hand", 13, 20), 2, 2, 0.02),
        lambda samples, found: stretched(samples, 2, 2, found.factor - 1),
    ),
    "principal_point": (
        lambda: stretched(a_set("eye_in_hand", 13, 20), 0, 2, 0.02),
        lambda samples, found: stretched(samples, "xy".index(found.axis), 2, found.percent / 100),
    ),
    "few_samples": (lambda: a_set("eye_in_hand", 3, 5), lambda samples, _: with_poses_added(samples)),
    "not_converged": (lambda: a_set("eye_in_hand", 2, 3), lambda samples, _: with_poses_added(samples)),
    "moved_between": (
        lambda: of_two_setups("eye_in_hand", 24, 14, pose([0, 0, 0], [0.005, 0.002, 0])),
        lambda samples, found: samples.take(np.arange(samples.names.index(found.sample))),
    ),
    "too_few_samples": (lambda: a_set("eye_in_hand", 3, 2), lambda samples, _: with_poses_added(samples)),
    "little_motion": (lambda: moving(SMALL), lambda samples, _: with_poses_added(samples)),
    "no_rotation": (lambda: moving(STILL), lambda samples, _: with_poses_added(samples)),
    "parallel_axes": (lambda: moving(ABOUT_Z), lambda samples, _: with_poses_added(samples)),
}


@pytest.mark.long
@pytest.mark.parametrize("code", MENDED)
def test_a_set_that_is_mended_as_advised_gives_the_camera_and_no_warning(code):
    make, mend = MENDED[code]
    samples = make()
    try:
        (named,) = (each for each in calibrate_hand_eye(samples).warnings if each.code == code)
    except HandEyeError as error:
        named = error.finding
    assert named.code == code
    after = calibrate_hand_eye(mend(samples, named))
    assert [each.code for each in after.warnings] == []
    assert (np.abs(off(after.X, X_TRUE)) < 2 * after.half_width[:6]).all()
