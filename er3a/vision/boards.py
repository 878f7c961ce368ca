"""Boards in images: corners found by OpenCV, a pose with its covariance from each image.

Corners scatter by a stated standard deviation in pixels. With J the derivatives of the projected corners by the pose,
the pose's covariance is that deviation squared times (J^T J)^-1; the refinement over all poses with these covariances
has, to first order, the same maximum as one over all pixels. Where the camera's intrinsics are estimated from the same
images, all images share their errors. Their covariance is that of the bundle of all corners, with the poses eliminated
by Schur's complement, and each pose says how far a standard deviation of each of them moves it.

Frames as OpenCV has them: the camera looks along z, x to the right and y down; the board's z axis leaves x and y by
the right hand, from the first inner corner (chessboard, ChArUco) or the first tag's first corner (grid of tags). Which
end of a chessboard is the first can't be told from a picture; samples turned so are found when they are calibrated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from er3a.by_value import ByValue, by_identity, frozen
from er3a.errors import Er3aError
from er3a.finding import Finding, fact
from er3a.geometry.transforms import exp_rotation, inverse_right_jacobian, log_rotation, posed
from er3a.numerics.arrays import Reals


@lru_cache(maxsize=1)
def opencv() -> Any:
    """The module ``cv2``, on one thread, so that equal images give equal numbers.

    Raises
    ------
    Er3aError
        saying what to install
    """
    try:
        import cv2
    except ImportError:
        raise Er3aError("images of boards need OpenCV: install er3a[vision]; sets of poses do without") from None
    if not hasattr(cv2, "aruco") or not hasattr(cv2.aruco, "CharucoDetector"):
        raise Er3aError(f"OpenCV {cv2.__version__} has no detector of ChArUco boards: install er3a[vision]")
    cv2.setNumThreads(1)
    return cv2


Pattern = Literal["chessboard", "charuco", "apriltag"]
MIN_CORNERS = 6
MIN_IMAGES = 5
MIN_RATIO = 2.0  # of the reprojection errors of a flat board's two poses, below which either may be the true one

Image = NDArray[np.uint8]


@frozen
class Board:
    """A printed board.

    Attributes
    ----------
    squares : along x and y; tags, for a grid of tags
    square : m, from one to the next; marker : m, edge of a marker or tag; dictionary : OpenCV's name of the markers
    """

    pattern: Pattern
    squares: tuple[int, int]
    square: float
    marker: float | None = None
    dictionary: str = "DICT_4X4_50"


@frozen
class Camera(ByValue):
    """Intrinsics: matrix (3, 3) in pixels, distortion (k,) as OpenCV has it."""

    matrix: Reals
    distortion: Reals


@frozen
class BoardViews(ByValue):
    """What was found in images.

    Attributes
    ----------
    numbers : (N,), of the images that show the board, from 0; without : numbers of the others, and corners in each
    target : (N, 4, 4), T_camera_board; covariance : (N, 6, 6), m and rad by the camera's axes
    shared : (N, 6, k), m and rad: how one standard deviation of each of k independent errors, which all images share,
        moves the poses: of intrinsics that are estimated from them; None where they are given
    corners, reprojected : N arrays (k, 2), pixels; points : N arrays (k, 3), m, on the board
    ambiguous : (N,), the ratio of the reprojection errors of the other pose of a flat board to this one's
    camera : with the intrinsics used
    """

    numbers: tuple[int, ...]
    without: tuple[tuple[int, int], ...]
    target: Reals
    covariance: Reals
    shared: Reals | None
    points: tuple[Reals, ...]
    corners: tuple[Reals, ...]
    reprojected: tuple[Reals, ...]
    ambiguous: Reals
    camera: Camera


class BoardNotFoundError(Er3aError):
    """No image shows such a board; ``corners``: the most that one of them (by number, from 0) shows."""

    def __init__(self, image: int, corners: int):
        self.image, self.corners = image, corners
        super().__init__(
            f"no image shows the board; most corners are in image {image + 1}, {corners}; {MIN_CORNERS} are needed"
        )


def board_views(
    images: Sequence[Image], board: Board, camera: Camera | None = None, pixel_deviation: float = 0.3
) -> BoardViews:
    """Poses of a board in grey images, with their covariances.

    Parameters
    ----------
    images : (h, w) each, all of one size
    camera : intrinsics; None to estimate them from these images
    pixel_deviation : standard deviation of a corner in each direction, pixels

    Returns
    -------
    views : of the N images that show the board, T_camera_board (N, 4, 4), m

    Raises
    ------
    BoardNotFoundError
        if none shows the board; single ones are left out
    Er3aError
        if OpenCV is missing, or too few images are to give intrinsics too
    """
    find = _detector(board)
    found = [find(image) for image in images]
    counts = [len(in_image) for _, in_image in found]
    numbers = tuple(number for number, count in enumerate(counts) if count >= MIN_CORNERS)
    if not numbers:
        most = int(np.argmax(counts))
        raise BoardNotFoundError(most, counts[most])
    without = tuple((number, count) for number, count in enumerate(counts) if count < MIN_CORNERS)
    size = images[0].shape[1], images[0].shape[0]
    points, corners = zip(*(found[number] for number in numbers))
    views = views_of_corners(points, corners, size, camera, pixel_deviation)
    return replace(views, numbers=numbers, without=without)


def views_of_corners(
    points: Sequence[Reals],
    corners: Sequence[Reals],
    size: tuple[int, int],
    camera: Camera | None = None,
    pixel_deviation: float = 0.3,
) -> BoardViews:
    """Poses of a board from corners that were found in images, with their covariances.

    Parameters
    ----------
    points : N arrays (k, 3), m, on the board
    corners : N arrays (k, 2), pixels, where they were found
    size : width and height of the images, pixels
    camera : intrinsics; None to estimate them from these corners
    pixel_deviation : standard deviation of a corner in each direction, pixels

    Returns
    -------
    views : T_camera_board (N, 4, 4), m, with covariances by the camera's axes

    Raises
    ------
    Er3aError
        if OpenCV is missing, or too few images are to give intrinsics too
    """
    estimated = camera is None
    camera = estimated_camera(points, corners, size) if camera is None else camera
    found = [_pose(P, c, camera, pixel_deviation) for P, c in zip(points, corners)]
    shared: Reals | None = None
    if estimated:
        deviations = np.linalg.cholesky(intrinsics_covariance(found, corners))
        shared = np.array([each.by_camera for each in found]) @ deviations
    return BoardViews(
        numbers=tuple(range(len(found))),
        without=(),
        target=np.array([each.T for each in found]),
        covariance=np.array([each.covariance for each in found]),
        shared=shared,
        points=tuple(points),
        corners=tuple(corners),
        reprojected=tuple(each.pixels for each in found),
        ambiguous=np.array([each.ratio for each in found]),
        camera=camera,
    )


def intrinsics_covariance(found: Sequence[_Pose], corners: Sequence[Reals]) -> Reals:
    """Covariance of intrinsics that are estimated from all corners, the poses eliminated by Schur's complement.

    Parameters
    ----------
    found : N poses, with the derivatives of their corners
    corners : N arrays (k, 2), pixels, where they were found; their misfit gives the scale

    Returns
    -------
    covariance : (c, c), of fx, fy, cx, cy (pixels) and the distortion
    """
    k = found[0].by_camera.shape[1]
    information, squares = np.zeros((k, k)), 0.0
    for each, seen in zip(found, corners):
        own = each.J_camera - each.J_pose @ np.linalg.lstsq(each.J_pose, each.J_camera)[0]
        information += own.T @ own
        squares += float(((each.pixels - seen) ** 2).sum())
    free = sum(2 * len(seen) - 6 for seen in corners) - k
    covariance: Reals = squares / max(free, 1) * np.linalg.inv(information)
    return covariance


def ambiguous_tilts(views: BoardViews, names: Sequence[str]) -> tuple[Finding, ...]:
    """The images that leave open which way the board is tilted.

    Parameters
    ----------
    views : N of them
    names : N, of the samples

    Returns
    -------
    findings : where the other pose's reprojection errors are less than ``MIN_RATIO`` times as large
    """
    found = zip(names, views.ambiguous.tolist())
    return tuple(fact("ambiguous_tilt", sample=name, ratio=ratio) for name, ratio in found if ratio < MIN_RATIO)


def estimated_camera(points: Sequence[Reals], corners: Sequence[Reals], size: tuple[int, int]) -> Camera:
    """Intrinsics and distortion from corners of a flat board, as OpenCV estimates them.

    Parameters
    ----------
    points : N arrays (k, 3), m, on the board
    corners : N arrays (k, 2), pixels
    size : width and height of the images, pixels

    Returns
    -------
    camera : matrix (3, 3) in pixels, and distortion

    Raises
    ------
    Er3aError
        for fewer than ``MIN_IMAGES`` images, or if OpenCV is missing

    Notes
    -----
    The method is that of Z. Zhang, "A flexible new technique for camera calibration", IEEE T-PAMI 22(11), 2000.
    """
    if len(points) < MIN_IMAGES:
        raise Er3aError(f"{len(points)} images can't give the camera's intrinsics too; take {MIN_IMAGES}, or give them")
    cv2 = opencv()
    on_board, in_image = ([part.astype(np.float32) for part in parts] for parts in (points, corners))
    found = cv2.calibrateCamera(on_board, in_image, size, None, None)
    return Camera(found[1], found[2].ravel())


def projected(points: Reals, T_camera_board: Reals, camera: Camera) -> Reals:
    """Pixels at which points of a board are seen.

    Parameters
    ----------
    points : (k, 3), m, on the board
    T_camera_board : (4, 4), m; the camera looks along its z axis, x to the right and y down

    Returns
    -------
    pixels : (k, 2), distortion included
    """
    turn = log_rotation(T_camera_board[:3, :3])
    pixels = opencv().projectPoints(points, turn, T_camera_board[:3, 3], camera.matrix, camera.distortion)[0]
    found: Reals = pixels.reshape(-1, 2)
    return found


def board_points(board: Board) -> Reals:
    """The corners that detectors find on a chessboard or ChArUco board: its inner ones.

    Parameters
    ----------
    board : with squares along x and y

    Returns
    -------
    points : (k, 3), m, in the board's frame, x fastest
    """
    x, y = board.squares
    grid = np.stack(np.meshgrid(np.arange(x - 1), np.arange(y - 1)), axis=-1).reshape(-1, 2)
    return np.column_stack([grid * board.square, np.zeros(len(grid))])


def board_drawing(board: Board) -> Any:
    """OpenCV's own board, which can draw itself; chessboards have none.

    Parameters
    ----------
    board : a grid of tags, or else taken as ChArUco; lengths in m

    Returns
    -------
    drawing : a ``GridBoard`` or ``CharucoBoard``

    Raises
    ------
    Er3aError
        if OpenCV is missing, or knows no such dictionary of markers
    """
    cv2 = opencv()
    dictionary = cv2.aruco.getPredefinedDictionary(_dictionary(board.dictionary))
    marker = float(board.marker or board.square / 2)
    if board.pattern == "apriltag":
        return cv2.aruco.GridBoard(board.squares, marker, board.square - marker, dictionary)
    return cv2.aruco.CharucoBoard(board.squares, board.square, marker, dictionary)


def _dictionary(name: str) -> int:
    aruco = opencv().aruco
    if not (name.startswith("DICT_") and hasattr(aruco, name)):
        known = ", ".join(each for each in dir(aruco) if each.startswith("DICT_"))
        raise Er3aError(f"OpenCV has no dictionary of markers '{name}'; known: {known}")
    return int(getattr(aruco, name))


def _detector(board: Board) -> Any:
    """A function from an image to corners on the board (k, 3) in m and in the image (k, 2) in pixels."""
    cv2 = opencv()
    if board.pattern == "chessboard":
        inner = (board.squares[0] - 1, board.squares[1] - 1)

        def chessboard(image: Image) -> tuple[Reals, Reals]:
            """Inner corners, all or none."""
            found, corners = cv2.findChessboardCornersSB(image, inner, flags=cv2.CALIB_CB_ACCURACY)
            return (board_points(board), corners.reshape(-1, 2).astype(float)) if found else _NOTHING

        return chessboard
    drawing = board_drawing(board)
    if board.pattern == "charuco":
        detector = cv2.aruco.CharucoDetector(drawing)
        origin = np.array([board.square, board.square, 0.0])

        def charuco(image: Image) -> tuple[Reals, Reals]:
            """Inner corners that are seen, counted from the first one, a square in from the board's edge."""
            corners, numbers, _, _ = detector.detectBoard(image)
            if numbers is None:
                return _NOTHING
            points = np.asarray(drawing.getChessboardCorners(), float)[numbers.ravel()]
            return points - origin, corners.reshape(-1, 2).astype(float)

        return charuco
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    tags = cv2.aruco.ArucoDetector(drawing.getDictionary(), parameters)

    def apriltag(image: Image) -> tuple[Reals, Reals]:
        corners, numbers, _ = tags.detectMarkers(image)
        if numbers is None:
            return _NOTHING
        points, pixels = drawing.matchImagePoints(corners, numbers)
        if points is None:
            return _NOTHING
        return points.reshape(-1, 3).astype(float), pixels.reshape(-1, 2).astype(float)

    return apriltag


_NOTHING: tuple[Reals, Reals] = (np.empty((0, 3)), np.empty((0, 2)))


@by_identity
class _Pose:
    """A board in an image.

    Attributes
    ----------
    T : (4, 4); covariance : (6, 6); pixels : (k, 2), the corners reprojected
    ratio : how much worse the flat board's other pose fits
    J_pose, J_camera : (2k, 6) and (2k, c), derivatives of the pixels
    by_camera : (6, c), derivatives of the pose by the intrinsics
    """

    T: Reals
    covariance: Reals
    pixels: Reals
    ratio: float
    J_pose: Reals
    J_camera: Reals
    by_camera: Reals


def _pose(points: Reals, corners: Reals, camera: Camera, deviation: float) -> _Pose:
    cv2 = opencv()
    K, distortion = camera.matrix, camera.distortion
    _, turns, shifts, errors = cv2.solvePnPGeneric(points, corners, K, distortion, flags=cv2.SOLVEPNP_IPPE)
    errors = np.ravel(errors)
    ratio = float(errors[1] / max(errors[0], 1e-9)) if len(errors) > 1 else np.inf
    turn, shift = cv2.solvePnPRefineLM(points, corners, K, distortion, turns[0], shifts[0])
    pixels, J = cv2.projectPoints(points, turn, shift, K, distortion)
    inverse = np.linalg.inv(J[:, :6].T @ J[:, :6])
    J_camera = J[:, 6 : 10 + len(distortion)]
    left = np.linalg.inv(inverse_right_jacobian(-turn.ravel()))
    carry = np.zeros((6, 6))  # from rotation vector and position to position and turns about the camera's axes
    carry[:3, 3:], carry[3:, :3] = np.eye(3), left
    return _Pose(
        T=posed(exp_rotation(turn.ravel()), shift.ravel()),
        covariance=deviation**2 * carry @ inverse @ carry.T,
        pixels=pixels.reshape(-1, 2),
        ratio=ratio,
        J_pose=J[:, :6],
        J_camera=J_camera,
        by_camera=-carry @ inverse @ J[:, :6].T @ J_camera,
    )
