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
from typing import Any, Literal, cast

import numpy as np
import scipy

from er3a.kinematics.forward import frames
from er3a.kinematics.singularity import TYPES, SingularityType, characteristic_length, determinant_factors, factor_of
from er3a.kinematics.wrist_partitioned import solve_slots, wrist_partitioned_arm
from er3a.numerics.arrays import Reals
from er3a.planning.avoidance import avoidance
from er3a.planning.avoidance.avoidance import AT_REST, Avoidance, NotPossible, SingularSegment, coarse, singular_segment
from er3a.planning.follow import follow
from er3a.planning.moves import ToolPath
from er3a.planning.profiles import quintic
from er3a.planning.timing import Timed, joined, straight
from er3a.robots.joint_limits import within

Kind = Literal["shift", "tilt"]

WIDER = 2.5  # a bend spans the region's half width so many times, if the path is long enough
STEP = 1e-6  # of the characteristic length, or rad
POINTS = 120
GROWTH = 1.4
HALVINGS = 12
MOST_SIDES = 8
FARTHEST: dict[Kind, float] = {"shift": 0.5, "tilt": 1.0}  # of the characteristic length; rad
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
    shift: Reals
    tilt: Reals

    @property
    def amount(self) -> float:
        """m or rad"""
        return float(np.linalg.norm(self.shift) + np.linalg.norm(self.tilt))

    def size(self, progress: Reals) -> Reals:
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

    def progress(self, t: Reals) -> tuple[Reals, Reals, Reals]:
        """Of the path without bends."""
        return self.path.progress(t)

    def poses(self, progress: Reals) -> Reals:
        """T_base_tool (..., 4, 4) at shares of the way (...,)."""
        progress = np.asarray(progress, float)
        T = self.path.poses(progress)
        for bend in self.bends:
            size = bend.size(progress)[..., None]
            T[..., :3, 3] += size * bend.shift
            if bend.tilt.any():
                turns = scipy.spatial.transform.Rotation.from_rotvec((size * bend.tilt).reshape(-1, 3)).as_matrix()
                T[..., :3, :3] = turns.reshape(*progress.shape, 3, 3) @ T[..., :3, :3]
        return T


def shifted_via(segment: SingularSegment) -> Avoidance | NotPossible:
    """Bend the path by the smallest shift of the tool point, its orientation kept."""
    return _via(segment, "shift")


def tilted_via(segment: SingularSegment) -> Avoidance | NotPossible:
    """Bend the path by the least tilt of the tool, the tool point kept on its way."""
    return _via(segment, "tilt")


def _via(segment: SingularSegment, kind: Kind) -> Avoidance | NotPossible:
    if not segment.regions:
        return avoidance.NoSingularRegion()
    if segment.regions[0][0] == 0:
        return avoidance.BeginsInRegion()
    if segment.regions[-1][1] == len(segment.t):
        return avoidance.EndsInRegion()
    bends = [_bends(segment, first, last, kind) for first, last in segment.regions]
    if not all(bends):
        return _none_far_enough(segment, kind)
    fallback = None
    for chosen in sorted(product(*bends), key=lambda some: sum(bend.amount for bend in some))[:MOST_SIDES]:
        path = BentPath(segment.followed.line, chosen)
        for other in _followed(segment, path):
            if other.regions:
                continue
            if within(segment.robot, other.q).all():
                return Avoidance(_carried_out(segment, other))
            fallback = fallback or other
    if fallback is None:
        return avoidance.BentPathSingular()
    return Avoidance(_carried_out(segment, fallback))


def _followed(segment: SingularSegment, path: BentPath) -> Iterator[SingularSegment]:
    """The bent path from the path's own first joints, then from the start pose with other turns of the joints."""
    t = coarse(segment.t)
    starts: tuple[dict[str, Any], ...] = ({"q_start": segment.q[0]}, {"start_slot": int(segment.followed.slot[0])})
    for start in starts:
        followed = follow(segment.robot, cast(ToolPath, path), t, **start)  # only its joints are asked for
        yield singular_segment(followed, segment.near, segment.limits)


def _carried_out(segment: SingularSegment, other: SingularSegment) -> Timed:
    leave = segment.first_joints if segment.fixed_start else other.q[0]
    turn = [straight(leave, other.q[0], segment.limits)] if np.abs(other.q[0] - leave).max() > AT_REST else []
    return joined([*turn, other.along(0, len(other.t) - 1)])


def _bends(segment: SingularSegment, first: int, last: int, kind: Kind) -> list[Bend]:
    """The smallest bend to either side that clears a region."""
    path, t = segment.followed.line, segment.t
    worst = first + int(np.argmin(segment.near.margin(segment.robot, segment.q[first:last])))
    low, top, high = (float(path.progress(t[i])[0]) for i in (first - 1, worst, last))
    half = WIDER * max(top - low, high - top)
    span = max(0.0, top - half), top, min(1.0, top + half)
    slot = int(segment.followed.slot[np.searchsorted(segment.followed.t, t[first - 1])])
    singular = _nearest_type(segment, first, worst)
    bends = [_least(segment, slot, singular, span, way) for way in _directions(segment, slot, singular, top, kind)]
    return [bend for bend in bends if bend is not None]


def _nearest_type(segment: SingularSegment, first: int, worst: int) -> SingularityType:
    q = segment.q[worst] if np.isfinite(segment.q[worst, 0]) else segment.q[first - 1]
    factors = determinant_factors(segment.robot, q)
    return TYPES[int(np.argmin(segment.near.ratios(factors)))]


def _directions(segment: SingularSegment, slot: int, singular: SingularityType, top: float, kind: Kind) -> list[Reals]:
    """Unit shifts or tilts (6,) across the path in the plane beside the singularity, to either side."""
    path, length = segment.followed.line, characteristic_length(segment.robot)
    part = slice(0, 3) if kind == "shift" else slice(3, 6)
    pose = path.poses(np.array(top))
    size = STEP * (length if kind == "shift" else 1.0)
    moves = np.zeros((6, 6))
    moves[:3, part], moves[3:, part] = size * np.eye(3), -size * np.eye(3)
    ahead = np.array([min(top + 1e-4, 1.0), max(top - 1e-4, 0.0)])
    T = np.concatenate([_moved(pose, moves), path.poses(ahead), pose[None]])
    beside = _beside(segment, T, slot, singular)
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


def _beside(segment: SingularSegment, T: Reals, slot: int, singular: SingularityType) -> Reals:
    """How poses (n, 4, 4) lie beside the singularity: (n, 2) or, for the elbow, (n, 1)."""
    robot = segment.robot
    arm = wrist_partitioned_arm(robot)
    if singular == "shoulder":
        centre = T[:, :3, 3] + T[:, :3, :3] @ arm.wrist_in_tool - arm.points[0]
        across: Reals = centre @ _plane_across(arm.axes[0]).T
        return across
    q, _, gap = solve_slots(robot, T, np.zeros((len(T), 6)))
    if singular == "elbow":
        reached = np.isfinite(q[:, slot, 0])
        bend = np.abs(determinant_factors(robot, q[:, slot]).elbow)
        return np.where(reached, bend, -gap[:, slot])[:, None]
    axes = frames(robot, q[:, slot])[..., :3, 2]
    axis_4, axis_6 = axes[:, 3], axes[:, 5]
    same = np.sign(np.einsum("ni,ni->n", axis_4, axis_6))[:, None]
    apart: Reals = (axis_6 - same * axis_4) @ _plane_across(axis_6[-1]).T
    return apart


def _plane_across(axis: Reals) -> Reals:
    """Two unit vectors (2, 3) across an axis and each other."""
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first)])


def _moved(pose: Reals, moves: Reals) -> Reals:
    T = np.repeat(pose[None], len(moves), axis=0)
    T[:, :3, 3] += moves[:, :3]
    T[:, :3, :3] = scipy.spatial.transform.Rotation.from_rotvec(moves[:, 3:]).as_matrix() @ T[:, :3, :3]
    return T


def _least(
    segment: SingularSegment, slot: int, singular: SingularityType, span: tuple[float, float, float], direction: Reals
) -> Bend | None:
    """The least bend in a direction (6,) that keeps the distance; None if none up to FARTHEST does."""
    path = segment.followed.line
    grid = np.unique(np.concatenate([np.linspace(span[0], span[2], POINTS), [span[1]]]))
    kind: Kind = "shift" if direction[:3].any() else "tilt"
    most = FARTHEST[kind] * (characteristic_length(segment.robot) if kind == "shift" else 1.0)

    def bend(size: float) -> Bend:
        return Bend(*span, size * direction[:3], size * direction[3:])

    def keeps(size: float) -> bool:
        T = BentPath(path, (bend(size),)).poses(grid)
        q = solve_slots(segment.robot, T, np.zeros((len(T), 6)))[0][:, slot]
        distance = np.abs(factor_of(determinant_factors(segment.robot, q), singular))
        return bool((distance >= SPARE * segment.near.of(singular)).all())

    low, high = 0.0, most / 50
    while not keeps(high):
        low, high = high, high * GROWTH
        if high > most:
            return None
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if keeps(middle) else (middle, high)
    return bend(high)


def _none_far_enough(segment: SingularSegment, kind: Kind) -> NotPossible:
    if kind == "shift":
        return avoidance.NoShiftKeepsDistance(FARTHEST["shift"] * characteristic_length(segment.robot) * 1000)
    return avoidance.NoTiltKeepsDistance(float(np.degrees(FARTHEST["tilt"])))
