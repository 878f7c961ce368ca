"""Where to take the next sample: the pose that shrinks the error at the work most, of those that can be had."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.collision.along import clearance
from er3a.collision.scene import Scene
from er3a.geometry.transforms import inverted, skew
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot
from er3a.vision.hand_eye import HandEye
from er3a.vision.likelihood import residuals
from er3a.vision.point_error import error_sizes

CANDIDATES = 4000
MEASURED_FOR_CLEARANCE = 25
MAX_TILT = np.radians(55)  # of the board against the line of sight: detectors lose it beyond
LIMIT_SHARE = 0.02  # of each joint's range, kept from both its ends


@dataclass(frozen=True)
class FieldOfView:
    """What the camera sees, and the board.

    Attributes
    ----------
    half_angles : rad, from the axis of sight to the picture's left and right, and to its upper and lower edge
    nearest, farthest : m, along the axis of sight
    board : m, edges of the board along its x and y from its origin
    """

    half_angles: tuple[float, float]
    nearest: float
    farthest: float
    board: tuple[float, float]


@dataclass(frozen=True, eq=False)
class NextView:
    """The pose to add.

    Attributes
    ----------
    q : (n,), rad; target : (4, 4), T_camera_board to be expected there
    error_before, error_after : m, that 95 % of the calibration's errors at the point of work stay below
    clearance : m; None where it can't be measured
    tried, in_view : poses drawn within the limits, and those among them that see the whole board
    """

    q: Reals
    target: Reals
    error_before: float
    error_after: float
    clearance: float | None
    tried: int
    in_view: int


def in_sight(view: FieldOfView, points: Reals) -> Flags:
    """Whether points (..., 3), m, by the camera's axes are in the picture (...,), near and far enough."""
    depth = points[..., 2]
    seen: Flags = (depth > view.nearest) & (depth < view.farthest)
    for k, half in enumerate(view.half_angles):
        seen = seen & (np.abs(points[..., k]) < np.tan(half) * np.abs(depth))
    return seen


def board_visible(view: FieldOfView, T_camera_board: Reals, facing: float = 1.0) -> Flags:
    """Whether all corners (...,) of the board are in the picture, and its printed side is turned to the camera.

    Parameters
    ----------
    facing : 1 if the board's z axis leads away from whoever looks at its print, as OpenCV has it; -1 if towards
    """
    x, y = view.board
    corners = np.array([[0, 0, 0, 1], [x, 0, 0, 1], [0, y, 0, 1], [x, y, 0, 1]], dtype=float)
    seen = np.einsum("...ij,cj->...ci", T_camera_board, corners)[..., :3]
    sight = seen.mean(axis=-2)
    sight = sight / np.linalg.norm(sight, axis=-1, keepdims=True)
    tilted = facing * (sight * T_camera_board[..., :3, 2]).sum(axis=-1)
    visible: Flags = in_sight(view, seen).all(axis=-1) & (tilted > np.cos(MAX_TILT))
    return visible


def next_view(
    robot: Robot, found: HandEye, view: FieldOfView, point: Reals, scene: Scene | None, seed: int
) -> NextView | None:
    """The next pose to record; None if no pose drawn sees the board, within the limits and clear of everything.

    Parameters
    ----------
    point : (3,), m, in the camera's frame: where the calibration's error shall shrink
    """
    q = _drawn(robot, found, seed)
    A = forward(robot.without_tool(), q)
    F = A if found.samples.setup == "eye_in_hand" else inverted(A)
    B = inverted(F @ found.X) @ found.Y
    facing = float(np.sign(np.median(found.samples.target[found.used, 2, 2])))
    seen = np.flatnonzero(board_visible(view, B, facing))
    if not seen.size:
        return None
    q, F, B = q[seen], F[seen], B[seen]
    before, after = _point_covariances(found, F, B, point)
    order = np.argsort(np.trace(after, axis1=1, axis2=2), kind="stable")
    order = order[:MEASURED_FOR_CLEARANCE]
    clear = clearance(robot, q[order], scene).distance
    free = np.flatnonzero(clear > 0)
    if not free.size:
        return None
    best, space = int(order[free[0]]), float(clear[free[0]])
    sizes = error_sizes(np.stack([_padded(before), _padded(after[best])]))[0]
    return NextView(q[best], B[best], float(sizes[0]), float(sizes[1]), space, CANDIDATES, len(seen))


def _drawn(robot: Robot, found: HandEye, seed: int) -> Reals:
    """Joint angles: half near those recorded, half anywhere within the limits."""
    random = np.random.default_rng(seed)
    inner = LIMIT_SHARE * (robot.upper - robot.lower)
    low, high = robot.lower + inner, robot.upper - inner
    anywhere = random.uniform(low, high, (CANDIDATES, len(low)))
    known = found.samples.q
    if known is None:
        return anywhere
    near = known[random.integers(0, len(known), CANDIDATES // 2)]
    near = near + random.normal(0.0, np.radians(25), near.shape)
    return np.concatenate([np.clip(near, low, high), anywhere[CANDIDATES // 2 :]])


def _point_covariances(found: HandEye, F: Reals, B: Reals, point: Reals) -> tuple[Reals, Reals]:
    """Covariance (3, 3) of where the camera puts a point, and after each of the samples (K, 4, 4) (K, 3, 3)."""
    J = residuals(F, B, found.X, found.Y)[1] / np.repeat(found.deviations, 3)[:, None]
    information = np.linalg.inv(found.covariance)
    more = np.linalg.inv(information + np.swapaxes(J, 1, 2) @ J)
    at = np.concatenate([np.eye(3), -skew(found.X[:3, :3] @ point)], axis=1)
    return at @ found.covariance[:6, :6] @ at.T, at @ more[:, :6, :6] @ at.T


def _padded(covariance: Reals) -> Reals:
    out = np.zeros((6, 6))
    out[:3, :3] = covariance
    return out
