"""Hand-eye sets with known truth, made without the project's own camera cells."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

POSITION_M, ROTATION_RAD = 5e-4, 2e-3


def pose(rpy_deg, xyz) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", rpy_deg, degrees=True).as_matrix()
    T[:3, 3] = xyz
    return T


X_TRUE, Y_TRUE = pose([170, 5, 30], [0.6, 0.2, 0.8]), pose([10, -5, 30], [0.02, 0.03, 0.1])


def flange_poses(random: np.random.Generator, count: int, turn: float = 0.5) -> np.ndarray:
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, :3] = Rotation.from_rotvec(random.normal(0, turn, (count, 3))).as_matrix()
    T[:, :3, 3] = random.normal([0.4, 0, 0.4], 0.2, (count, 3))
    return T


def seen(setup: str, flange: np.ndarray, X=X_TRUE, Y=Y_TRUE) -> np.ndarray:
    """T_camera_board without errors."""
    F = flange if setup == "eye_in_hand" else np.linalg.inv(flange)
    return np.linalg.inv(F @ X) @ Y


def noisy(T: np.ndarray, random: np.random.Generator, position=POSITION_M, rotation=ROTATION_RAD) -> np.ndarray:
    out = T.copy()
    turns = Rotation.from_rotvec(random.normal(0, rotation, (*T.shape[:-2], 3)).reshape(-1, 3)).as_matrix()
    out[..., :3, :3] = turns.reshape(*T.shape[:-2], 3, 3) @ T[..., :3, :3]
    out[..., :3, 3] += random.normal(0, position, (*T.shape[:-2], 3))
    return out


def covariance(count: int, position=POSITION_M, rotation=ROTATION_RAD) -> np.ndarray:
    return np.tile(np.diag([position**2] * 3 + [rotation**2] * 3), (count, 1, 1))


def off(T: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Position (m) and rotation vector (rad), by the parent's axes, from the truth to an estimate (..., 6)."""
    turn = Rotation.from_matrix((T[..., :3, :3] @ truth[:3, :3].T).reshape(-1, 3, 3)).as_rotvec()
    return np.concatenate([T[..., :3, 3] - truth[:3, 3], turn.reshape(*T.shape[:-2], 3)], axis=-1)


SQUARES = np.stack([*np.meshgrid(0.02 * np.arange(9), 0.02 * np.arange(6)), np.zeros((6, 9))], axis=2).reshape(-1, 3)
"""Corners of a board (54, 3), m; its origin is one of them."""
PIXELS = np.array([[900.0, 0, 640], [0, 900, 360], [0, 0, 1]])
PICTURE = np.array([1280, 720])


def views(random: np.random.Generator, count: int, distance: tuple[float, float], tilt: float) -> np.ndarray:
    """Places of the board in a picture (count, 4, 4): tilts up to ``tilt`` deg, any turn, distances in m."""
    found: list[np.ndarray] = []
    while len(found) < count:
        a, size = random.uniform(0, 2 * np.pi), np.radians(tilt) * np.sqrt(random.uniform())
        turn = Rotation.from_rotvec([size * np.cos(a), size * np.sin(a), 0]) * Rotation.from_euler(
            "z", random.uniform(-np.pi, np.pi)
        )
        middle = random.uniform(*distance) * np.linalg.solve(PIXELS, [*(random.uniform(0.2, 0.8, 2) * PICTURE), 1.0])
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = turn.as_matrix(), middle - turn.apply(SQUARES.mean(axis=0))
        corners = projected(T)
        if ((corners > 0) & (corners < PICTURE)).all():
            found.append(T)
    return np.array(found)


def projected(T: np.ndarray) -> np.ndarray:
    """The board's corners in the picture, (54, 2) pixels."""
    seen_at = (SQUARES @ T[:3, :3].T + T[:3, 3]) @ PIXELS.T
    return seen_at[:, :2] / seen_at[:, 2:]


def by_solve_pnp(T: np.ndarray, random: np.random.Generator, pixels: float, given: np.ndarray = PIXELS) -> np.ndarray:
    """Poses (N, 4, 4) that OpenCV computes, by intrinsics ``given``, from corners so many pixels off."""
    found = np.tile(np.eye(4), (len(T), 1, 1))
    for pose_found, true in zip(found, T):
        corners = projected(true) + random.normal(0, pixels, (len(SQUARES), 2))
        _, rotation, position = cv2.solvePnP(SQUARES, corners, given, None)
        rotation, position = cv2.solvePnPRefineLM(SQUARES, corners, given, None, rotation, position)
        pose_found[:3, :3], pose_found[:3, 3] = cv2.Rodrigues(rotation)[0], position[:, 0]
    return found


def flange_of(setup: str, T: np.ndarray, X: np.ndarray = X_TRUE, Y: np.ndarray = Y_TRUE) -> np.ndarray:
    """Where the flange is (N, 4, 4) if the camera sees the board at T."""
    F = Y @ np.linalg.inv(X @ T)
    return F if setup == "eye_in_hand" else np.linalg.inv(F)
