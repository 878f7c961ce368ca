"""Calibration sets and detections with known truth, for the default study and for tests.

``python -m testing.camera_cells`` writes ``data/vision`` again. All numbers are simulated: poses of an arm by its
table, a camera and a board whose places are set here, and normal errors from one seed. No camera took a picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from er3a.collision.along import clearance
from er3a.files.kept_files import ROOT
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.geometry.transforms import inverted, moved, posed
from er3a.kinematics.forward import forward
from er3a.vision.field_of_view import FieldOfView, in_sight

SEED = 20261120
FOLDER = ROOT / "data" / "vision"
SCENE = ROOT / "data" / "scenes" / "table_and_post.yaml"
BOARD_MM = (160.0, 120.0)
POSITION_MM, ROTATION_DEG = (0.15, 0.15, 0.4), (0.12, 0.12, 0.06)
OBJECT_MM, OBJECT_DEG = (0.4, 0.4, 0.8), (0.5, 0.5, 0.3)
TURNED = 11  # number of the sample whose board is detected turned by 180 deg
TOUCHES = 4
TOUCH_MM = 0.1
MAX_TILT = np.radians(55)  # of the board against the line of sight: detectors lose it beyond


def looking(at: tuple[float, float, float], to: tuple[float, float, float]) -> np.ndarray:
    """A camera (4, 4) at a point, looking to another, m; its x axis level, y downwards."""
    z = np.subtract(to, at) / np.linalg.norm(np.subtract(to, at))
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return posed(np.stack([x, np.cross(z, x), z], axis=1), np.array(at))


@dataclass(frozen=True, eq=False)
class Cell:
    """A camera's place and a board's: X and Y (4, 4) as :mod:`er3a.vision.classic_methods` has them, and the truth."""

    robot: str
    setup: str
    X: np.ndarray
    Y: np.ndarray
    view: FieldOfView


FIXED = Cell(
    "er3a_c60",
    "eye_to_hand",
    looking((1.15, 0.05, 0.85), (0.35, 0.0, 0.25)),
    posed(Rotation.from_euler("xyz", [184, -3, 40], degrees=True).as_matrix(), np.array([-0.05, -0.06, 0.012])),
    FieldOfView((np.radians(35), np.radians(28)), 0.3, 1.6),
)
CARRIED = Cell(
    "er3_600",
    "eye_in_hand",
    posed(Rotation.from_euler("xyz", [2, -4, 88], degrees=True).as_matrix(), np.array([0.06, 0.01, 0.03])),
    posed(Rotation.from_euler("xyz", [180, 0, 25], degrees=True).as_matrix(), np.array([0.38, 0.02, 0.1])),
    FieldOfView((np.radians(35), np.radians(28)), 0.15, 1.0),
)


def board_visible(view: FieldOfView, T_camera_board: np.ndarray) -> np.ndarray:
    """Whether all corners (...,) of the board are in the picture, and its printed side is turned to the camera."""
    x, y = np.array(BOARD_MM) / 1000
    corners = np.array([[0, 0, 0, 1], [x, 0, 0, 1], [0, y, 0, 1], [x, y, 0, 1]], dtype=float)
    seen = np.einsum("...ij,cj->...ci", T_camera_board, corners)[..., :3]
    sight = seen.mean(axis=-2)
    sight = sight / np.linalg.norm(sight, axis=-1, keepdims=True)
    tilted = (sight * T_camera_board[..., :3, 2]).sum(axis=-1)
    return in_sight(view, seen).all(axis=-1) & (tilted > np.cos(MAX_TILT))


def seen_from(cell: Cell, q: np.ndarray) -> np.ndarray:
    """T_camera_board (..., 4, 4) without errors at joint angles (..., 6)."""
    A = forward(load_robot(cell.robot).without_tool(), q)
    return inverted((A if cell.setup == "eye_in_hand" else inverted(A)) @ cell.X) @ cell.Y


def poses(cell: Cell, count: int, random: np.random.Generator) -> np.ndarray:
    """Joint angles (count, 6), rad, rounded to 0.001 deg, within limits, clear of the scene, with the board in view."""
    robot, chosen = load_robot(cell.robot), list[np.ndarray]()
    scene = load_scene(SCENE)
    while len(chosen) < count:
        q = np.radians(np.round(np.degrees(random.uniform(robot.lower, robot.upper, (4000, 6))), 3))
        q = q[board_visible(cell.view, seen_from(cell, q))]
        clear = clearance(robot, q[:400], scene).distance > 0.01
        chosen += list(q[:400][clear])
    return np.array(chosen[:count])


def noisy(T: np.ndarray, random: np.random.Generator, mm=POSITION_MM, deg=ROTATION_DEG) -> np.ndarray:
    """Poses (..., 4, 4) with normal errors by the axes of their parent frame."""
    deviations = np.concatenate([np.array(mm) / 1000, np.radians(deg)])
    return moved(T, random.normal(size=(*T.shape[:-2], 6)) * deviations)


def rows_of(T: np.ndarray) -> str:
    """Poses (N, 4, 4) as position (mm) and quaternion (w first), one text each."""
    q = Rotation.from_matrix(T[:, :3, :3]).as_quat(canonical=True, scalar_first=True)
    return [",".join([*(f"{1000 * c:.4f}" for c in p), *(f"{c:.8f}" for c in o)]) for p, o in zip(T[:, :3, 3], q)]


def write_set(cell: Cell, name: str, count: int, folder: Path, random: np.random.Generator) -> None:
    """A table of samples and one of touched points."""
    q = poses(cell, count, random)
    B = noisy(seen_from(cell, q), random)
    if cell is FIXED:
        B[TURNED] = B[TURNED] @ posed(np.diag([-1.0, -1.0, 1.0]), np.array([*BOARD_MM, 0.0]) / 1000)
    header = ",".join(
        ["name", *(f"q{j}_deg" for j in range(1, 7)), *(f"target_{c}" for c in ("x_mm", "y_mm", "z_mm", *_QUATERNION))]
    )
    lines = [
        f"pose_{k + 1:02d}," + ",".join(f"{angle:.3f}" for angle in np.degrees(q[k])) + "," + target
        for k, target in enumerate(rows_of(B))
    ]
    (folder / f"{name}.csv").write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
    fixed = cell.setup == "eye_to_hand"
    base = random.uniform([0.3, -0.2, 0.1], [0.5, 0.2, 0.25], (TOUCHES, 3))
    if not fixed:
        base = (
            cell.Y
            @ np.concatenate(
                [random.uniform(0, 0.12, (TOUCHES, 2)), np.zeros((TOUCHES, 1)), np.ones((TOUCHES, 1))], axis=1
            ).T
        ).T[:, :3]
    seen = (inverted(cell.X if fixed else cell.Y) @ np.concatenate([base, np.ones((TOUCHES, 1))], axis=1).T).T[:, :3]
    if fixed:
        seen = seen + random.normal(size=seen.shape) * np.array(POSITION_MM) / 1000
    touched = base + random.normal(size=base.shape) * TOUCH_MM / 1000
    header = ",".join(f"{part}_{c}_mm" for part in ("seen", "touched") for c in "xyz")
    lines = [",".join(f"{1000 * v:.3f}" for v in (*s, *t)) for s, t in zip(seen, touched)]
    (folder / f"{name}_touched.csv").write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")


_QUATERNION = ("qw", "qx", "qy", "qz")


def detections(cell: Cell, random: np.random.Generator, places, picture_deg=None) -> list[str]:
    """What a detector reports of objects at places (x, y, z in mm, turn about z in deg): position and quaternion."""
    camera = cell.X
    if picture_deg is not None:
        camera = forward(load_robot(cell.robot).without_tool(), np.radians(picture_deg)) @ cell.X
    T = np.array([posed(Rotation.from_euler("z", a, degrees=True).as_matrix(), np.array(p) / 1000) for *p, a in places])
    return rows_of(noisy(inverted(camera) @ T, random, OBJECT_MM, OBJECT_DEG))


def write(folder: Path) -> None:
    """The tables of both cells."""
    folder.mkdir(parents=True, exist_ok=True)
    write_set(FIXED, "fixed_camera", 20, folder, np.random.default_rng([SEED, 0]))
    write_set(CARRIED, "carried_camera", 16, folder, np.random.default_rng([SEED, 1]))


if __name__ == "__main__":
    write(FOLDER)
    fixed = ((380, 120, 140, 20), (420, -140, 130, 0), (330, 330, 130, 0), (720, 60, 130, 0))
    print("\n".join(detections(FIXED, np.random.default_rng([SEED, 2]), fixed)))
    print()
    carried = ((380, 60, 140, 20), (420, -120, 130, 0), (330, 10, 130, 45))
    print("\n".join(detections(CARRIED, np.random.default_rng([SEED, 3]), carried, [0, 20, 20, 0, 90, 0])))
