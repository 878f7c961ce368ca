"""Boards rendered with a known camera in known places, found by OpenCV."""

from __future__ import annotations

import builtins
import json
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest
from PIL import Image

from er3a.errors import Er3aError, InputError
from er3a.files.hand_eye_file import load_hand_eye, read_calibration
from er3a.finding import fact
from er3a.vision.boards import (
    Board,
    BoardNotFoundError,
    Camera,
    _pose,
    ambiguous_tilts,
    board_drawing,
    board_points,
    board_views,
    intrinsics_covariance,
    opencv,
    views_of_corners,
)
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.hand_eye import calibrate_hand_eye
from er3a.vision.likelihood import refine
from er3a.vision.typical_causes import fitted_distances, half_widths
from testing.hand_eye_sets import off, pose
from tests.vision.test_hand_eye_file import HEAD, columns, write

SIZE = (1280, 960)
K = np.array([[1100.0, 0, 640], [0, 1105, 470], [0, 0, 1]])
CHARUCO = Board("charuco", (7, 5), 0.03, 0.022, "DICT_4X4_50")
CHESS = Board("chessboard", (8, 6), 0.03)
TAGS = Board("apriltag", (4, 3), 0.05, 0.04, "DICT_APRILTAG_36h11")
MARGIN, PIXEL = 0.03, 2e-4  # m of white around the print, and m per pixel of it


def printed(board: Board) -> tuple[np.ndarray, np.ndarray]:
    """The print as an image, and where on it (pixels) the board's frame has its origin."""
    edge = round(MARGIN / PIXEL)
    x, y = board.squares
    size = (round(x * board.square / PIXEL), round(y * board.square / PIXEL))
    if board.pattern == "chessboard":
        step = round(board.square / PIXEL)
        image = np.kron((np.indices((y, x)).sum(axis=0) % 2 * 255).astype(np.uint8), np.ones((step, step), np.uint8))
        origin = np.array([step, step])
    elif board.pattern == "charuco":
        image = board_drawing(board).generateImage(size, marginSize=0)
        origin = np.array([1, 1]) * board.square / PIXEL
    else:
        gap = board.square - board.marker
        size = (round((x * board.square - gap) / PIXEL), round((y * board.square - gap) / PIXEL))
        image, origin = board_drawing(board).generateImage(size, marginSize=0), np.zeros(2)
    return cv2.copyMakeBorder(image, *[edge] * 4, cv2.BORDER_CONSTANT, value=255), origin + edge - 0.5


def rendered(board: Board, T: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """The board as a pinhole camera sees it at T_camera_board, with blur and grey noise."""
    image, origin = printed(board)
    to_board = np.array([[PIXEL, 0, -PIXEL * origin[0]], [0, PIXEL, -PIXEL * origin[1]], [0, 0, 1]])
    H = K @ T[:3, [0, 1, 3]] @ to_board
    seen = cv2.warpPerspective(image, H, SIZE, flags=cv2.INTER_AREA, borderMode=cv2.BORDER_CONSTANT, borderValue=128)
    grey = cv2.GaussianBlur(seen, (0, 0), 0.8).astype(float) + random.normal(0, 2, (SIZE[1], SIZE[0]))
    return np.clip(grey, 0, 255).astype(np.uint8)


def board_places(random: np.random.Generator, count: int) -> list[np.ndarray]:
    return [
        pose([*random.uniform(-35, 35, 2), random.uniform(-40, 40)], [*random.uniform(-0.12, 0.0, 2), z])
        for z in random.uniform(0.45, 0.65, count)
    ]


@pytest.mark.parametrize(
    "board", [CHARUCO, pytest.param(CHESS, marks=pytest.mark.long), TAGS], ids=lambda board: board.pattern
)
def test_rendered_boards_are_found_where_they_are(board):
    random = np.random.default_rng(1)
    places = board_places(random, 5)
    views = board_views([rendered(board, T, random) for T in places], board, Camera(K, np.zeros(5)))
    x, y = np.multiply(np.subtract(CHESS.squares, 2), CHESS.square)
    other_end = pose([0, 0, 180], [x, y, 0])  # which end of a chessboard is the first can't be told
    for T, found in zip(places, views.target):
        ends = (T, T @ other_end) if board is CHESS else (T,)
        error = min((off(found, end) for end in ends), key=np.linalg.norm)
        assert np.linalg.norm(error[:3]) < 1.5e-3
        assert np.linalg.norm(error[3:]) < np.radians(0.4)
    assert all(np.abs(a - b).max() < 1.5 for a, b in zip(views.corners, views.reprojected))


def test_covariances_are_those_of_corners_that_scatter():
    """Poses from corners with drawn errors scatter as the covariance says; no image is needed for that."""
    random = np.random.default_rng(2)
    points, T = board_points(CHESS), board_places(random, 1)[0]
    exact = cv2.projectPoints(points, cv2.Rodrigues(T[:3, :3])[0], T[:3, 3], K, np.zeros(5))[0].reshape(-1, 2)
    camera = Camera(K, np.zeros(5))
    found = [_pose(points, exact + random.normal(0, 0.3, exact.shape), camera, 0.3) for _ in range(400)]
    errors = np.array([off(each.T, T) for each in found])
    white = np.linalg.solve(np.linalg.cholesky(found[0].covariance), errors.T)
    assert np.abs(np.cov(white) - np.eye(6)).max() < 0.25


def test_a_board_seen_head_on_leaves_its_tilt_open_until_it_is_nearer_or_tilted():
    """Small and nearly head-on; then as its text advises: from nearer, or tilted by 30 deg."""
    random = np.random.default_rng(8)
    far, tilt = np.array([-0.1, -0.05, 1.5]), [1, 0.5, 10]
    places = {"far": pose(tilt, far), "nearer": pose(tilt, far / 4), "tilted": pose([31, 0.5, 10], far)}
    views = board_views([rendered(CHARUCO, T, random) for T in places.values()], CHARUCO, Camera(K, np.zeros(5)))
    assert [each.sample for each in ambiguous_tilts(views, tuple(places))] == ["far"]


@pytest.mark.long
def test_a_camera_is_calibrated_from_images_alone_and_those_without_a_board_are_left_out_and_listed(tmp_path, call):
    """Eye-to-hand: images, joint poses and nothing else; the truth lies within twice the intervals."""
    random = np.random.default_rng(3)
    Y = pose([3, -4, 20], [0.02, 0.03, 0.05])
    X = pose([120, 5, 30], [0.7, 0.1, 0.6])
    places = board_places(random, 12)
    flange = np.array([X @ T @ np.linalg.inv(Y) for T in places])
    for number, T in enumerate(places):
        Image.fromarray(rendered(CHARUCO, T, random)).save(tmp_path / f"{number}.png")
    head = HEAD.format(setup="eye_to_hand") + (
        "images:\n  board: {pattern: charuco, squares: [7, 5], square_mm: 30, marker_mm: 22}\n"
        "  intrinsics: {fx: 1100.0, fy: 1105.0, cx: 640.0, cy: 470.0}\n  pixel_standard_deviation: 0.1\n"
    )
    table = columns(flange, "flange", "quaternion") | {"image": np.array([f"{n}.png" for n in range(12)])}
    samples = load_hand_eye(write(tmp_path, table, head))
    found = calibrate_hand_eye(samples)
    assert np.linalg.norm(off(found.X, X)[:3]) < 2e-3
    assert np.linalg.norm(off(found.X, X)[3:]) < np.radians(0.2)
    assert np.abs(off(found.Y, Y)[:3]).max() < 2e-3
    blank = range(1, 12, 2)
    for number in blank:
        Image.fromarray(np.full((960, 1280), 128, np.uint8)).save(tmp_path / f"{number}.png")
    again, images = read_calibration(tmp_path / "set.yaml", None)
    assert images.boardless == tuple(
        fact("boardless_image", sample=f"row {k + 2}", image=f"{k}.png", corners=0) for k in blank
    )
    assert again.names == tuple(f"row {k + 2}" for k in range(0, 12, 2))
    np.testing.assert_array_equal(again.target, samples.target[::2])
    np.testing.assert_array_equal(again.flange, samples.flange[::2])
    done = call("hand-eye", tmp_path / "set.yaml")
    assert done.returncode == 0
    assert "6 of 12 samples used" in done.stdout
    assert done.stdout.count("left out; 0 corners") == 6
    assert "assumed: the intrinsics are exact" in done.stdout
    record = json.loads(call("hand-eye", tmp_path / "set.yaml", "--json").stdout)
    assert record["samples"] == 12
    assert [each["params"]["sample"] for each in record["boardless"]] == [f"row {k + 2}" for k in blank]


def test_without_any_board_in_the_images_there_is_one_error(tmp_path):
    for number in range(3):
        Image.fromarray(np.full((96, 128), 128, np.uint8)).save(tmp_path / f"{number}.png")
    head = HEAD.format(setup="eye_to_hand") + (
        "images:\n  board: {pattern: charuco, squares: [7, 5], square_mm: 30, marker_mm: 22}\n"
    )
    flange = np.stack([pose([0, 0, k], [0.4, 0, 0.4]) for k in range(3)])
    table = columns(flange, "flange", "quaternion") | {"image": np.array([f"{n}.png" for n in range(3)])}
    with pytest.raises(InputError, match="no image shows a charuco board of 7 x 5: 0 corners in the best of 3 images"):
        load_hand_eye(write(tmp_path, table, head))


@pytest.mark.long
def test_intervals_include_intrinsics_that_are_estimated_from_the_same_images():
    """Corners with drawn errors: errors of the camera's pose scatter as stated, and OpenCV's deviations agree."""
    random, points = np.random.default_rng(4), board_points(CHESS)
    X, Y = pose([120, 5, 30], [0.7, 0.1, 0.6]), pose([3, -4, 20], [0.02, 0.03, 0.05])
    places = board_places(random, 12)
    flange = np.array([X @ T @ np.linalg.inv(Y) for T in places])
    squares, errors = [], []
    for _ in range(10):
        views = views_of_corners([points] * 12, seen_corners(random, places), SIZE)
        samples = CalibrationSet(
            "eye_to_hand", flange, views.target, camera_covariance=views.covariance, shared=views.shared
        )
        found = calibrate_hand_eye(samples)
        errors.append(off(found.X, X))
        squares.append(errors[-1] @ np.linalg.solve(found.covariance[:6, :6], errors[-1]) / 6)
    narrow = calibrate_hand_eye(replace(samples, shared=None)).covariance[:6, :6]
    assert 0.5 < np.mean(squares) < 1.8
    assert np.mean([error @ np.linalg.solve(narrow, error) / 6 for error in errors]) > 3


@pytest.mark.long
def test_a_focal_length_that_its_images_leave_open_is_no_wrong_board():
    """Images almost head-on hardly tell the focal length, which scales all distances as a board does."""
    random, points = np.random.default_rng(5), board_points(CHESS)
    X, Y = pose([120, 5, 30], [0.7, 0.1, 0.6]), pose([3, -4, 20], [0.02, 0.03, 0.05])
    scales = []
    for _ in range(12):
        places = [
            pose([*random.uniform(-4, 4, 2), random.uniform(-40, 40)], [*random.uniform(-0.12, 0.0, 2), z])
            for z in random.uniform(0.45, 0.65, 12)
        ]
        flange = np.array([X @ T @ np.linalg.inv(Y) for T in places])
        views = views_of_corners([points] * 12, seen_corners(random, places), SIZE)
        samples = CalibrationSet(
            "eye_to_hand", flange, views.target, camera_covariance=views.covariance, shared=views.shared
        )
        refined = refine(samples, X, Y)
        fit = fitted_distances("board_scale", samples, refined)
        factor, (alone, shared) = 1 + fit.values[0], half_widths("board_scale", samples, refined, fit)
        half_width = np.hypot(alone, shared)
        scales.append([abs(factor - 1) / half_width, abs(factor - 1) / alone])
    beyond, beyond_alone = (np.array(scales) > 1).sum(axis=0)
    assert beyond <= 2
    assert beyond_alone >= 6


def test_an_image_of_another_size_and_squares_in_metres_are_named(tmp_path):
    for number, size in enumerate([(128, 96), (128, 96), (64, 48)]):
        Image.fromarray(np.full(size[::-1], 128, np.uint8)).save(tmp_path / f"{number}.png")
    head = HEAD.format(setup="eye_to_hand") + (
        "images:\n  board: {pattern: charuco, squares: [7, 5], square_mm: 30, marker_mm: 22}\n"
    )
    flange = np.stack([pose([0, 0, k], [0.4, 0, 0.4]) for k in range(3)])
    table = columns(flange, "flange", "quaternion") | {"image": np.array([f"{n}.png" for n in range(3)])}
    with pytest.raises(InputError, match="64 x 48 pixels, and the first image 128 x 96") as caught:
        load_hand_eye(write(tmp_path, table, head))
    assert caught.value.field == "sample 3"
    metres = head.replace("square_mm: 30, marker_mm: 22", "square_mm: 0.03, marker_mm: 0.022")
    with pytest.raises(InputError, match="can only be metres"):
        load_hand_eye(write(tmp_path, table, metres))


def test_intrinsics_estimated_from_corners_come_with_opencvs_deviations():
    corners = seen_corners(np.random.default_rng(4), board_places(np.random.default_rng(4), 8))
    points = [board_points(CHESS)] * 8
    camera = views_of_corners(points, corners, SIZE).camera
    assert (np.abs(camera.matrix[[0, 1, 0, 1], [0, 1, 2, 2]] - [1100, 1105, 640, 470]) < 12).all()
    single = [np.array(part, np.float32) for part in (points, corners)]
    deviations = cv2.calibrateCameraExtended([*single[0]], [*single[1]], SIZE, None, None)[5].ravel()[:9]
    found = [_pose(P, c, camera, 0.3) for P, c in zip(points, corners)]
    np.testing.assert_allclose(np.sqrt(np.diag(intrinsics_covariance(found, corners))), deviations, rtol=0.05)


def seen_corners(random: np.random.Generator, places: list[np.ndarray]) -> list[np.ndarray]:
    """Corners of the chessboard at places, with drawn errors."""
    points, none = board_points(CHESS), np.zeros(5)
    exact = [cv2.projectPoints(points, cv2.Rodrigues(T[:3, :3])[0], T[:3, 3], K, none)[0][:, 0] for T in places]
    return [each + random.normal(0, 0.3, each.shape) for each in exact]


@pytest.mark.long
def test_another_board_is_not_found():
    random = np.random.default_rng(5)
    image = rendered(CHESS, board_places(random, 1)[0], random)
    with pytest.raises(BoardNotFoundError):
        board_views([image], Board("chessboard", (9, 7), 0.03), Camera(K, np.zeros(5)))


def test_without_opencv_images_say_so_and_numbers_work(monkeypatch):
    real = builtins.__import__

    def refused(name, *args, **more):
        if name == "cv2":
            raise ImportError(name)
        return real(name, *args, **more)

    monkeypatch.delitem(sys.modules, "cv2")
    monkeypatch.setattr(builtins, "__import__", refused)
    opencv.cache_clear()
    with pytest.raises(Er3aError, match=r"install er3a\[vision\]"):
        opencv()
    random = np.random.default_rng(6)
    from testing.hand_eye_sets import flange_poses, noisy, seen

    flange = flange_poses(random, 8)
    calibrate_hand_eye(CalibrationSet("eye_in_hand", flange, noisy(seen("eye_in_hand", flange), random)))
    opencv.cache_clear()
