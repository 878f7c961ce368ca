"""Bend the path past the singular region through a via point, by as little as keeps the distance.

Near a singularity the poses differ from it in a vector of one or two components: how far the tool's axis 6 points
beside axis 4 (wrist), the wrist centre's distance across axis 1 (shoulder), the elbow's angle. The path runs past the
origin of that plane; to first order the smallest shift, or the smallest tilt, that moves it away is across its
direction there. That fixes where to bend; how far is then found on the bent path itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from scipy.spatial.transform import Rotation

from er3a.kinematics.forward import frames
from er3a.kinematics.singularity import TYPES, characteristic_length, determinant_factors
from er3a.kinematics.wrist_partitioned import solve_slots, wrist_partitioned_arm
from er3a.pipeline.messages.language import N_, said
from er3a.planning.avoidance.singular_segment import AT_REST, Trouble, WayAround, coarse, margin, trouble_of
from er3a.planning.follow import follow
from er3a.planning.moves import ToolPath
from er3a.planning.profiles import quintic
from er3a.planning.timing import Timed, joined, straight
from er3a.robots.joint_limits import within

WIDER = 2.5  # a bend spans the region's half width so many times, if the path is long enough
STEP = 1e-6  # of the characteristic length, or rad
POINTS = 120
GROWTH = 1.4
HALVINGS = 12
MOST_SIDES = 8
FARTHEST = {"shift": 0.5, "tilt": 1.0}  # of the characteristic length; rad
SPARE = 1.0005  # keep this much more than the distance


@dataclass(frozen=True, eq=False)
class Bend:
    """A smooth bulge of a path: rises from ``start`` to its full size at ``top``, and falls to nothing at ``end``.

    Attributes
    ----------
    start, top, end : shares of the way
    shift : (3,), m, base frame; tilt : (3,), rad, rotation vector about the tool point, base frame
    """

    start: float
    top: float
    end: float
    shift: np.ndarray
    tilt: np.ndarray

    @property
    def amount(self) -> float:
        """m or rad"""
        return float(np.linalg.norm(self.shift) + np.linalg.norm(self.tilt))

    def size(self, progress: np.ndarray) -> np.ndarray:
        """0 outside, 1 at the top, with continuous second derivative."""
        rise = np.clip((progress - self.start) / (self.top - self.start), 0.0, 1.0)
        fall = np.clip((self.end - progress) / (self.end - self.top), 0.0, 1.0)
        zero, one = np.array(0.0), np.array(1.0)
        return np.where(progress < self.top, quintic(rise, 1.0, zero, one)[0], quintic(fall, 1.0, zero, one)[0])


@dataclass(frozen=True, eq=False)
class BentPath:
    """A path of the tool with bends, on the path's own time law."""

    path: ToolPath
    bends: tuple[Bend, ...] = field(default=())

    @property
    def duration(self) -> float:
        """s"""
        return self.path.duration

    def progress(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the path without bends."""
        return self.path.progress(t)

    def poses(self, progress: np.ndarray) -> np.ndarray:
        """T_base_tool (..., 4, 4) at shares of the way (...,)."""
        progress = np.asarray(progress, float)
        T = self.path.poses(progress)
        for bend in self.bends:
            size = bend.size(progress)[..., None]
            T[..., :3, 3] += size * bend.shift
            if bend.tilt.any():
                turns = Rotation.from_rotvec((size * bend.tilt).reshape(-1, 3)).as_matrix()
                T[..., :3, :3] = turns.reshape(*progress.shape, 3, 3) @ T[..., :3, :3]
        return T


def shifted_via(trouble: Trouble) -> WayAround:
    """Bend the path by the least shift of the tool point, its orientation kept."""
    return _via(trouble, "shift")


def tilted_via(trouble: Trouble) -> WayAround:
    """Bend the path by the least tilt of the tool, the tool point kept on its way."""
    return _via(trouble, "tilt")


def _via(trouble: Trouble, kind: str) -> WayAround:
    name = f"via_{kind}"
    if not trouble.regions:
        return WayAround(name, None, 0.0, N_("there is no singular region to bend around"))
    if trouble.regions[0][0] == 0:
        return WayAround(name, None, 0.0, N_("the path begins inside the region, where no bend can help"))
    if trouble.regions[-1][1] == len(trouble.t):
        return WayAround(name, None, 0.0, N_("the path ends inside the region, where no bend can help"))
    bends = [_bends(trouble, first, last, kind) for first, last in trouble.regions]
    if not all(bends):
        return WayAround(name, None, 0.0, _none_far_enough(trouble, kind))
    fallback = None
    for chosen in sorted(product(*bends), key=lambda some: sum(bend.amount for bend in some))[:MOST_SIDES]:
        path = BentPath(trouble.followed.line, chosen)
        for other in _followed(trouble, path):
            if other.regions:
                continue
            if within(trouble.robot, other.q).all():
                return WayAround(name, _carried_out(trouble, other))
            fallback = fallback or other
    if fallback is None:
        return WayAround(name, None, 0.0, N_("the bent path runs into another singular region"))
    return WayAround(name, _carried_out(trouble, fallback))


def _followed(trouble: Trouble, path: BentPath) -> Iterator[Trouble]:
    """The bent path from the path's own first joints, then from the start pose with other turns of the joints."""
    t = coarse(trouble.t)
    for start in ({"q_start": trouble.q[0]}, {"start_slot": int(trouble.followed.slot[0])}):
        yield trouble_of(follow(trouble.robot, path, t, **start), trouble.near, trouble.limits)


def _carried_out(trouble: Trouble, other: Trouble) -> Timed:
    leave = trouble.first_joints if trouble.fixed_start else other.q[0]
    turn = [straight(leave, other.q[0], trouble.limits)] if np.abs(other.q[0] - leave).max() > AT_REST else []
    return joined([*turn, other.along(0, len(other.t) - 1)])


def _bends(trouble: Trouble, first: int, last: int, kind: str) -> list[Bend]:
    """The smallest bend to either side that clears a region."""
    path, t = trouble.followed.line, trouble.t
    worst = first + int(np.argmin(margin(trouble.robot, trouble.q[first:last], trouble.near)))
    low, top, high = (float(path.progress(t[i])[0]) for i in (first - 1, worst, last))
    half = WIDER * max(top - low, high - top)
    span = max(0.0, top - half), top, min(1.0, top + half)
    slot = int(trouble.followed.slot[np.searchsorted(trouble.followed.t, t[first - 1])])
    singular = _nearest_type(trouble, first, worst)
    bends = [_least(trouble, slot, singular, span, way) for way in _directions(trouble, slot, singular, top, kind)]
    return [bend for bend in bends if bend is not None]


def _nearest_type(trouble: Trouble, first: int, worst: int) -> str:
    q = trouble.q[worst] if np.isfinite(trouble.q[worst, 0]) else trouble.q[first - 1]
    factors = determinant_factors(trouble.robot, q)
    return min(TYPES, key=lambda kind: abs(float(getattr(factors, kind))) / trouble.near[kind])


def _directions(trouble: Trouble, slot: int, singular: str, top: float, kind: str) -> list[np.ndarray]:
    """Unit shifts or tilts (6,) across the path in the plane beside the singularity, to either side."""
    path, length = trouble.followed.line, characteristic_length(trouble.robot)
    part = slice(0, 3) if kind == "shift" else slice(3, 6)
    pose = path.poses(np.array(top))
    size = STEP * (length if kind == "shift" else 1.0)
    moves = np.zeros((6, 6))
    moves[:3, part], moves[3:, part] = size * np.eye(3), -size * np.eye(3)
    ahead = np.array([min(top + 1e-4, 1.0), max(top - 1e-4, 0.0)])
    T = np.concatenate([_moved(pose, moves), path.poses(ahead), pose[None]])
    beside = _beside(trouble, T, slot, singular)
    slope = ((beside[:3] - beside[3:6]) / (2 * size)).T
    along = beside[6] - beside[7]
    if not np.isfinite(slope).all():
        return []
    if len(along) == 1:
        across = [np.ones(1), -np.ones(1)]
    else:
        if not np.isfinite(along).all() or np.linalg.norm(along) < 1e-9:
            along = np.array([-beside[8][1], beside[8][0]]) if beside[8].any() else np.array([1.0, 0.0])
        normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        across = [normal, -normal]
    directions = []
    for normal in across:
        wanted = slope.T @ normal
        if np.linalg.norm(wanted) > 1e-6 * length:
            full = np.zeros(6)
            full[part] = wanted / np.linalg.norm(wanted)
            directions.append(full)
    return directions


def _beside(trouble: Trouble, T: np.ndarray, slot: int, singular: str) -> np.ndarray:
    """How poses (n, 4, 4) lie beside the singularity: (n, 2) or, for the elbow, (n, 1)."""
    robot = trouble.robot
    arm = wrist_partitioned_arm(robot)
    if singular == "shoulder":
        centre = T[:, :3, 3] + T[:, :3, :3] @ arm.wrist_in_tool - arm.points[0]
        return centre @ _plane_across(arm.axes[0]).T
    q, _, gap = solve_slots(robot, T, np.zeros((len(T), 6)))
    if singular == "elbow":
        reached = np.isfinite(q[:, slot, 0])
        bend = np.abs(determinant_factors(robot, q[:, slot]).elbow)
        return np.where(reached, bend, -gap[:, slot])[:, None]
    axes = frames(robot, q[:, slot])[..., :3, 2]
    axis_4, axis_6 = axes[:, 3], axes[:, 5]
    same = np.sign(np.einsum("ni,ni->n", axis_4, axis_6))[:, None]
    return (axis_6 - same * axis_4) @ _plane_across(axis_6[-1]).T


def _plane_across(axis: np.ndarray) -> np.ndarray:
    """Two unit vectors (2, 3) across an axis and each other."""
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first)])


def _moved(pose: np.ndarray, moves: np.ndarray) -> np.ndarray:
    T = np.repeat(pose[None], len(moves), axis=0)
    T[:, :3, 3] += moves[:, :3]
    T[:, :3, :3] = Rotation.from_rotvec(moves[:, 3:]).as_matrix() @ T[:, :3, :3]
    return T


def _least(
    trouble: Trouble, slot: int, singular: str, span: tuple[float, float, float], direction: np.ndarray
) -> Bend | None:
    """The least bend in a direction (6,) that keeps the distance; None if none up to FARTHEST does."""
    path = trouble.followed.line
    grid = np.unique(np.concatenate([np.linspace(span[0], span[2], POINTS), [span[1]]]))
    kind = "shift" if direction[:3].any() else "tilt"
    most = FARTHEST[kind] * (characteristic_length(trouble.robot) if kind == "shift" else 1.0)

    def bend(size: float) -> Bend:
        return Bend(*span, size * direction[:3], size * direction[3:])

    def keeps(size: float) -> bool:
        T = BentPath(path, (bend(size),)).poses(grid)
        q = solve_slots(trouble.robot, T, np.zeros((len(T), 6)))[0][:, slot]
        distance = np.abs(getattr(determinant_factors(trouble.robot, q), singular))
        return bool((distance >= SPARE * trouble.near[singular]).all())

    low, high = 0.0, most / 50
    while not keeps(high):
        low, high = high, high * GROWTH
        if high > most:
            return None
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if keeps(middle) else (middle, high)
    return bend(high)


def _none_far_enough(trouble: Trouble, kind: str) -> str:
    if kind == "shift":
        far = FARTHEST["shift"] * characteristic_length(trouble.robot) * 1000
        return said("no shift of the tool point up to {far:.0f} mm keeps the distance", far=far)
    return said("no tilt of the tool up to {far:.0f} deg keeps the distance", far=np.degrees(FARTHEST["tilt"]))
