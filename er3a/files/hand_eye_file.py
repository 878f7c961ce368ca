"""Calibration sets of cameras: a YAML file that describes the recording, and CSV tables beside it with the samples.

A table has one row for each sample: the flange, as joint angles (``q1_deg`` ..) or as a pose (``flange_x_mm`` ..), and
the board as the camera saw it (``target_x_mm`` ..), or an ``image``. Orientations are ``_qw`` .. ``_qz``,
``_roll_deg``, ``_pitch_deg``, ``_yaw_deg`` (R = Rz(yaw) Ry(pitch) Rx(roll)), ``_r11`` .. ``_r33`` by rows, or
``_rx_rad`` .. ``_rz_rad`` (a rotation vector). ``name`` is optional.

Poses in CSV tables: a position in mm and an orientation in one of four forms. Errors name row and column.

Rotation vectors (axis times angle, in rad) are used by OpenCV and by the pendants of Universal Robots.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from pydantic import Field, model_validator

from er3a.by_value import by_identity
from er3a.errors import InputError
from er3a.files.csv_file import METRES, CsvColumn, CsvRows, read_csv, read_header, refuse_unit
from er3a.files.orientations import FORMS, POSITION, form_in, poses_of
from er3a.files.robot_file import Text
from er3a.files.units import WIDEST_IN_RADIANS, doubt, joint_names, refuse_radians
from er3a.files.yaml_file import InputFile, StrictModel, load
from er3a.finding import Finding, fact
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.numerics.si_units import in_si
from er3a.robots.joint_limits import joint_columns, meant
from er3a.robots.robot import Robot
from er3a.vision.boards import Board, BoardNotFoundError, BoardViews, Camera, board_views
from er3a.vision.calibration_set import CalibrationSet

TOLERANCE = 1e-3  # quaternions are written with as few as four digits


def _poses(path: Path, rows: CsvRows, stream: str, form: str) -> Reals:
    """Poses (N, 4, 4), m, of which the units are judged, too."""
    prefix = f"{stream}_"
    refuse_unit(path, rows, [prefix + name for name in POSITION], METRES)
    if form in ("rpy_deg", "zyz_deg"):
        where = f"columns {prefix}{FORMS[form][0]} to {prefix}{FORMS[form][-1]}"
        values = np.array([[row[prefix + name] for name in FORMS[form]] for row in rows], float)
        refuse_radians(path, where, values, WIDEST_IN_RADIANS / 2)
    return poses_of(path, rows, form, prefix, TOLERANCE)


SHOWN_HEADER = 60
EXAMPLE = "flange_x_mm, .., flange_qw, .., flange_qz, target_x_mm, .., target_qz (lengths in mm)"
MIN_SQUARE_MM = 0.5
MIN_DEVIATION_MM = 5e-3
"""Of a camera or an arm; less is in metres."""
EPOCH_DIGITS = 10  # of the seconds since 1970, which recorders write
PICTURES = ("PNG", "JPEG", "TIFF", "BMP", "WEBP", "PPM")  # of others, some are drawn by programs that are called for it
POINTS = {f"{part}_{c}_mm": CsvColumn() for part in ("seen", "touched") for c in "xyz"}

Positive = Annotated[float, Field(gt=0, le=1e5)]


class StandardDeviations(StrictModel):
    """Standard deviations of a pose, in the axes of its frame: one value for all axes, or values for x, y and z."""

    position_mm: Positive | Annotated[list[Positive], Field(min_length=3, max_length=3)]
    rotation_deg: Positive | Annotated[list[Positive], Field(min_length=3, max_length=3)]

    @model_validator(mode="after")
    def _in_mm(self) -> Self:
        if np.max(self.position_mm) < MIN_DEVIATION_MM:
            doubt(self, "position_mm", f"{self.position_mm} mm", "metres")
        return self

    def covariance(self) -> Reals:
        """Covariance (6, 6) of a pose, m^2 and rad^2: of its position, then of its rotation about its own axes."""
        position = np.broadcast_to(np.array(self.position_mm) / 1000, 3)
        return np.diag(np.concatenate([position, np.broadcast_to(np.radians(self.rotation_deg), 3)]) ** 2)


class BoardEntry(StrictModel):
    """A printed board. ``squares``: along x and y; ``marker_mm`` and ``dictionary``: of boards with markers."""

    pattern: Literal["chessboard", "charuco", "apriltag"]
    squares: Annotated[list[Annotated[int, Field(ge=2, le=100)]], Field(min_length=2, max_length=2)]
    square_mm: Positive
    marker_mm: Positive | None = None
    dictionary: Text = "DICT_4X4_50"

    @model_validator(mode="after")
    def _markers_fit(self) -> Self:
        if self.square_mm < MIN_SQUARE_MM:
            raise ValueError(f"square_mm: {self.square_mm:g} mm can only be metres | Multiply by 1000")
        if self.pattern == "chessboard":
            return self
        if self.marker_mm is None:
            raise ValueError("marker_mm: the markers' size is missing | Add it, as printed")
        if self.marker_mm >= self.square_mm:
            raise ValueError("marker_mm: markers as large as the squares touch each other | Measure both again")
        return self

    def board(self) -> Board:
        """The board in the units of the library, lengths in m."""
        return in_si(Board, self)


class Intrinsics(StrictModel):
    """A camera's focal lengths and principal point in pixels, and distortion k1, k2, p1, p2, k3 as in OpenCV."""

    fx: Positive
    fy: Positive
    cx: float
    cy: float
    distortion: Annotated[list[float], Field(max_length=8)] = []


class ImageEntry(StrictModel):
    """How to read boards from images. ``intrinsics``: estimated from the images themselves if left out."""

    board: BoardEntry
    intrinsics: Intrinsics | None = None
    pixel_standard_deviation: Annotated[float, Field(gt=0, le=100)] = 0.3


@by_identity
class SeenImages:
    """Image files that show the board, as the table names them, what was found in each, and those without it."""

    names: tuple[str, ...]
    views: BoardViews
    boardless: tuple[Finding, ...]


class HandEyeFile(InputFile):
    """A calibration set. ``simulated: true``: it was not recorded by a camera; verdicts say so.

    ``camera_standard_deviation`` is that of T_camera_board in the camera's axes; it is estimated if not given.
    ``board_mm``: the board's edges along its x and y, as a note. ``touched``: a table of points as the camera located
    them (``seen_x_mm``; with the camera on the flange: points on the board) and as the robot touched them
    (``touched_x_mm``).
    """

    kind: Literal["hand_eye"]
    title: Text
    title_zh: Text | None = None
    source: Text
    simulated: bool = False
    setup: Literal["eye_in_hand", "eye_to_hand"]
    samples: Text
    images: ImageEntry | None = None
    camera_standard_deviation: StandardDeviations | None = None
    board_mm: Annotated[list[Positive], Field(min_length=2, max_length=2)] | None = None
    touched: Text | None = None
    touch_standard_deviation_mm: Positive = 0.1


def load_hand_eye(path: str | Path, arm: Robot | None = None) -> CalibrationSet:
    """Read a calibration set.

    Parameters
    ----------
    arm : the robot that was used, to convert joint angles into flange poses; not needed for sets with flange poses.
        What is in the robot's base (flange poses and touched points by its controller) is placed by ``arm.base``

    Raises
    ------
    InputError
        naming file, row and column
    """
    return read_calibration(path, arm)[0]


def read_calibration(path: str | Path, robot: Robot | None) -> tuple[CalibrationSet, SeenImages | None]:
    """Read a calibration set of a camera, with all files that it names.

    Parameters
    ----------
    path : the YAML file; its tables and images are in the same folder or below
    robot : takes joint angles to poses of the flange; may be None if the tables give poses

    Returns
    -------
    samples : poses T_world_flange and T_camera_board in m, and joint values in rad or m where they were recorded
    images : what was found in the pictures; None without pictures. Samples whose picture shows no board are left out.

    Raises
    ------
    InputError
        naming the file, and row or column, that can't be used
    """
    path = Path(path)
    head = load(HandEyeFile, path)
    images: SeenImages | None = None
    covariance = head.camera_standard_deviation
    per_sample: Reals | None = None
    shared: Reals | None = None
    table = path.parent / head.samples
    rows, header = sample_rows(table)
    flange, q = _flange(table, rows, header, robot)
    names = tuple(str(row.get("name") or f"row {row['row']}") for row in rows)
    if head.images is not None:
        images = _targets_of_images(table, rows, names, head.images)
        target, per_sample, shared = images.views.target, images.views.covariance, images.views.shared
        kept = list(images.views.numbers)
        flange, names = flange[kept], tuple(names[number] for number in kept)
        q = None if q is None else q[kept]
    else:
        target = _poses(table, rows, "target", _form(table, header, "target"))
    if covariance is not None:
        per_sample = np.broadcast_to(covariance.covariance(), (len(flange), 6, 6))
    samples = CalibrationSet(
        setup=head.setup,
        flange=flange,
        target=target,
        names=names,
        camera_covariance=per_sample,
        q=q,
        touched=_touched(path.parent / head.touched, robot) if head.touched else None,
        touch_deviation=head.touch_standard_deviation_mm / 1000,
        shared=shared,
        of_joints=q is not None,
    )
    return samples, images


def check_samples(table: Path) -> str:
    """Check a table of samples or of touched points by itself, and say which of the two it is.

    Raises
    ------
    InputError
        naming row and column
    """
    if "seen_x_mm" in read_header(table):
        _touched(table)
        return "touched points"
    rows, header = sample_rows(table)
    for stream in ("flange", "target"):
        if form := form_in(table, header, f"{stream}_"):
            _poses(table, rows, stream, form)
    return "samples of a hand-eye calibration"


def sample_rows(table: Path) -> tuple[CsvRows, list[str]]:
    """Read a table of samples, whose columns depend on how flange and board are given.

    Parameters
    ----------
    table : CSV; joints ``q1_deg`` .., or poses ``flange_x_mm`` .. and ``target_x_mm`` .., or an ``image``

    Returns
    -------
    rows : by column, each with the key ``row`` (line of the file); mm, deg and s as in the file
    header : the names of all columns

    Raises
    ------
    InputError
        for a header without any column of samples, no rows, or a cell that can't be read
    """
    header = read_header(table)
    columns: dict[str, CsvColumn] = {}
    for name in ("name", "image"):
        if name in header:
            columns[name] = CsvColumn(str, optional=name == "name")
    if "t_s" in header:  # of recordings; not used
        columns["t_s"] = CsvColumn(digits=EPOCH_DIGITS, quantity="time in s")
    columns |= {name: CsvColumn() for name in joint_names(table, header)}
    for stream in ("flange", "target"):
        if form := form_in(table, header, f"{stream}_"):
            columns |= {f"{stream}_{name}": CsvColumn() for name in (*POSITION, *FORMS[form])}
    if not columns:
        first = ", ".join(header)[:SHOWN_HEADER]
        problem = f"the first line names no column of samples: {first}"
        raise InputError(table, "header", problem, f"Begin with a header such as {EXAMPLE}")
    rows = read_csv(table, columns)
    if not rows:
        raise InputError(table, None, "the table has a header but no samples", "Add a row for each sample")
    return rows, header


def _form(table: Path, header: list[str], stream: str) -> str:
    form = form_in(table, header, f"{stream}_")
    if form is None:
        remedy = f"Add {stream}_x_mm, {stream}_y_mm, {stream}_z_mm and {stream}_qw to {stream}_qz, or another form"
        raise InputError(table, "header", f"nothing says where the {stream} was", remedy)
    return form


def _flange(table: Path, rows: CsvRows, header: list[str], robot: Robot | None) -> tuple[Reals, Reals | None]:
    """T_world_flange (N, 4, 4), from joint values by the robot's table where they are given; else a controller gives it
    from the robot's own base."""
    given = joint_names(table, header)
    if not given:
        poses = _poses(table, rows, "flange", _form(table, header, "flange"))
        return poses if robot is None else robot.base @ poses, None
    if form_in(table, header, "flange_"):
        raise InputError(table, "header", "joint angles and flange poses both say where the arm was", "Keep one")
    if robot is None:
        raise InputError(table, "columns q1_deg ...", "joint angles need a robot's table", "Name the robot")
    if given != (wanted := joint_columns(robot)):
        problem = f"the joint columns are not those of {robot.name}"
        raise InputError(table, f"columns {given[0]} to {given[-1]}", problem, f"Give {', '.join(wanted)}")
    values = np.array([[row[name] for name in given] for row in rows], dtype=float)
    refuse_radians(table, f"columns {given[0]} to {given[-1]}", values[:, ~robot.slides])
    q = meant(robot, values)
    return forward(robot.without_tool(), q), q


def _touched(table: Path, robot: Robot | None = None) -> Reals:
    """Points (k, 2, 3), m, as the camera located them and as the robot touched them; of a robot in the world."""
    rows = read_csv(table, POINTS)
    found = np.array([[row[name] for name in POINTS] for row in rows], dtype=float).reshape(-1, 2, 3) / 1000
    if not len(found):
        raise InputError(table, None, "the table has a header but no points", "Add a row for each point touched")
    if robot is not None:
        found[:, 1] = found[:, 1] @ robot.base[:3, :3].T + robot.base[:3, 3]
    return found


def _targets_of_images(table: Path, rows: CsvRows, names: tuple[str, ...], entry: ImageEntry) -> SeenImages:
    for row in rows:
        if not row.get("image"):
            raise InputError(table, f"row {row['row']}, column image", "no image is named", "Name its file")
    camera = None
    if entry.intrinsics is not None:
        own = entry.intrinsics
        K = np.array([[own.fx, 0, own.cx], [0, own.fy, own.cy], [0, 0, 1.0]])
        camera = Camera(K, np.array(own.distortion))
    files = [table.parent / row["image"] for row in rows]
    images = [grey_image(file) for file in files]
    for row, file, image in zip(rows, files, images):
        if image.shape != images[0].shape:
            (height, width), (first_height, first_width) = image.shape, images[0].shape
            problem = f"is {width} x {height} pixels, and the first image {first_width} x {first_height}"
            where = f"sample {row.get('name') or row['row'] - 1}"
            raise InputError(file, where, problem, "Take all images with one camera setting; remove the sample")
    try:
        views = board_views(images, entry.board.board(), camera, entry.pixel_standard_deviation)
    except BoardNotFoundError as error:
        x, y = entry.board.squares
        found = f"{error.corners} corners in the best of {len(files)} images, sample {names[error.image]}"
        problem = f"no image shows a {entry.board.pattern} board of {x} x {y}: {found}"
        raise InputError(
            table, "column image", problem, "Check pattern, squares and dictionary, or the images"
        ) from None
    shown = tuple(str(rows[number]["image"]) for number in views.numbers)
    boardless = tuple(
        fact("boardless_image", sample=names[k], image=str(rows[k]["image"]), corners=corners)
        for k, corners in views.without
    )
    return SeenImages(shown, views, boardless)


def grey_image(file: Path) -> NDArray[np.uint8]:
    """A picture's grey levels.

    Parameters
    ----------
    file : in one of the formats of ``PICTURES``; colours are turned to grey

    Returns
    -------
    levels : (h, w), 0 (black) to 255

    Raises
    ------
    InputError
        if there is no such file, or it is not a picture that can be read
    """
    try:
        with Image.open(file, formats=PICTURES) as image:
            return np.asarray(image.convert("L"))
    except (OSError, ValueError) as error:
        reason = "there is no such file" if isinstance(error, FileNotFoundError) else "is not a readable image"
        raise InputError(file, None, reason, "Correct the name, or save it as PNG or JPEG") from None
