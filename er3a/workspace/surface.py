"""The area that a tool point reaches where it moves on a surface only.

On a plane or a sphere the area follows from a volume: let the tool point slide from the surface along its normal by h,
which stays at rest in the last moving joint's frame. What it reaches then is every reached point times the segment, so
the volume is ``area h`` over a plane, and ``area ((r + h)^3 - r^3) / (3 r^2)`` over a sphere of radius r; the general
proof brackets it. Of any other surface that two joints make, the area they sweep is an integral, which counts twice
what is swept twice.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.kinematics.chain import constant_links, moving_tip
from er3a.kinematics.forward import forward, jacobian
from er3a.numerics.arrays import Reals
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot
from er3a.workspace.general_arm import general_arm
from er3a.workspace.general_proof import prove_general

SurfaceKind = Literal["plane", "sphere", "other"]

_SAMPLES, _FLAT = 400, 1e-9
_ACROSS = 1024


@dataclass(frozen=True)
class Surface:
    """Where the tool point moves on a surface, and the area (m^2) it reaches there.

    Attributes
    ----------
    lower, upper : proven bounds; of another surface ``upper`` is what two joints sweep, by quadrature, and ``lower`` is
        None; None for both where more joints make it
    """

    kind: SurfaceKind
    lower: float | None
    upper: float | None


def surface_of(robot: Robot, most_cells: int, seed: int) -> Surface | None:
    """The surface that a robot's tool point moves on; None if it moves in space, on a line or not at all.

    Parameters
    ----------
    most_cells : how many cells the proof may look at
    """
    random = np.random.Generator(np.random.Philox(key=seed))
    q = random.uniform(robot.lower, robot.upper, (_SAMPLES, robot.joints))
    q = q[within(robot, q)]
    moved = np.where(robot.upper > robot.lower, 1.0, 0.0)  # a joint that is locked moves nothing
    J = jacobian(robot, q)[:, :3] * moved
    size = np.linalg.svd(np.pad(J, ((0, 0), (0, 0), (0, 2))), compute_uv=False)
    if not len(q) or size[:, 2].max(initial=0) > _FLAT * size.max() or size[:, 1].max() <= _FLAT * size.max():
        return None
    normal, radius = _normal(robot, q)
    if normal is None:
        return _swept(robot, np.abs(J).max(axis=(0, 1)) > _FLAT * size.max())
    scale = radius if radius > 0 else float(np.ptp(forward(robot, q)[:, :3, 3], axis=0).max()) / 2
    arm = general_arm(robot, (normal, scale))[0]
    if not arm.carries_around:
        return Surface("sphere" if radius else "plane", None, None)
    proof, _ = prove_general(arm, 0.0, most_cells, seed)
    height = ((radius + scale) ** 3 - radius**3) / (3 * radius**2) if radius > 0 else scale
    lower, upper = (bound / height for bound in proof.bounds)
    return Surface("sphere" if radius > 0 else "plane", lower, upper)


def _normal(robot: Robot, q: Reals) -> tuple[Reals | None, float]:
    """Normal (3,) in the last moving joint's frame, and the sphere's radius (m), 0 for a plane; None for others."""
    last, _ = moving_tip(constant_links(robot), robot.sliding)
    behind = constant_links(robot, last + 1)[last + 1, :3, :3]
    frames = forward(robot, q, frame=last + 1)[:, :3, :3] @ behind.T
    points = forward(robot, q)[:, :3, 3]
    centred = points - points.mean(axis=0)
    _, spread, directions = np.linalg.svd(centred, full_matrices=False)
    if spread[2] <= _FLAT * spread[0]:
        normals, radius = np.tile(directions[2], (len(q), 1)), 0.0
    else:
        A = np.column_stack([2 * centred, np.ones(len(q))])
        centre = np.linalg.lstsq(A, (centred**2).sum(axis=1), rcond=None)[0][:3]
        normals = centred - centre
        lengths = np.linalg.norm(normals, axis=1)
        radius = float(lengths.mean())
        if np.ptp(lengths) > _FLAT * radius:
            return None, 0.0
        normals = normals / lengths[:, None]
    local = np.einsum("nij,ni->nj", frames, normals)
    return (local[0], radius) if np.ptp(local, axis=0).max() <= 1e-6 else (None, 0.0)


def _swept(robot: Robot, moves: Reals) -> Surface:
    """What two joints sweep, by the midpoint rule; no area where more joints move the point.

    Parameters
    ----------
    moves : (n,), whether each joint moves the point
    """
    joints = np.flatnonzero(moves)
    if len(joints) != 2 or robot.combined:
        return Surface("other", None, None)
    q = np.tile(robot.lower, (_ACROSS, _ACROSS, 1))
    span = robot.upper - robot.lower
    if robot.coupling is None:
        span = np.where(robot.slides, span, np.minimum(span, 2 * np.pi))
    steps = (np.arange(_ACROSS) + 0.5) / _ACROSS
    q[..., joints[0]] += span[joints[0]] * steps[:, None]
    q[..., joints[1]] += span[joints[1]] * steps
    first, second = np.moveaxis(jacobian(robot, q.reshape(-1, robot.joints))[:, :3, joints], -1, 0)
    area = np.linalg.norm(np.cross(first, second), axis=1).mean() * span[joints].prod()
    return Surface("other", None, float(area))
