"""Hand-eye sets with known truth, made without the project's own camera cells."""

from __future__ import annotations

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
