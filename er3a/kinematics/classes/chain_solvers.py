"""The solver of any chain, chosen from its geometry, with one interface for all classes.

Chains are constant links and joints that turn about or slide along z (:mod:`links`); base, tool, offsets and
coupling are the caller's. Chains with more than six joints hold one joint after another at a given value until a class
is met that needs none (six joints) or has its own parameter (arm angle); chains with fewer are completed by joints that
they lack, and of what those turn it is told.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Literal, Protocol, get_args

import numpy as np

from er3a.geometry.angles import TURN
from er3a.kinematics.classes.arm_angle import ArmAngleArm, arm_angle_arm, arm_angles_of, solve_at_arm_angle
from er3a.kinematics.classes.four_bar import four_bars, solve_three_parallel
from er3a.kinematics.classes.gantry import Gantry, gantry, solve_gantry
from er3a.kinematics.classes.links import axes_of, inverse_rigid, poses_of, size_of
from er3a.kinematics.classes.parallel_axes import ThreeParallel, three_parallel
from er3a.kinematics.classes.scara import Scara, scara, solve_scara
from er3a.kinematics.classes.self_motion import PoseChain
from er3a.kinematics.classes.six_revolute import CERTAIN, CONTINUUM, RowsFound, prepared, solve_six_revolute
from er3a.kinematics.classes.spherical_joints import about_x, about_z, frame_along
from er3a.kinematics.classes.two_slides import solve_two_slides, two_slides
from er3a.kinematics.closed_form import BOUNDARY_M, REACHED, ArmConstants, solve
from er3a.kinematics.wrist_partitioned import WristPartitionedArm, constants_of, recognised
from er3a.numerics.arrays import Flags, Integers, Reals

ArmClassCode = Literal[
    "spherical_wrist",
    "three_parallel",
    "general_six",
    "six_one_prismatic",
    "six_two_prismatic",
    "gantry",
    "arm_angle",
    "redundant",
    "scara",
    "free_roll",
    "planar_wrist",
    "position",
    "dependent",
    "unsolved",
]
FULL_RANK = 1e-7
SlotName = Literal[
    "front_elbow_up_no_flip",
    "front_elbow_up_flip",
    "front_elbow_down_no_flip",
    "front_elbow_down_flip",
    "back_elbow_up_no_flip",
    "back_elbow_up_flip",
    "back_elbow_down_no_flip",
    "back_elbow_down_flip",
    "shoulder_plus_elbow_plus_wrist_plus",
    "shoulder_plus_elbow_plus_wrist_minus",
    "shoulder_plus_elbow_minus_wrist_plus",
    "shoulder_plus_elbow_minus_wrist_minus",
    "shoulder_minus_elbow_plus_wrist_plus",
    "shoulder_minus_elbow_plus_wrist_minus",
    "shoulder_minus_elbow_minus_wrist_plus",
    "shoulder_minus_elbow_minus_wrist_minus",
    "elbow_plus",
    "elbow_minus",
    "wrist_plus",
    "wrist_minus",
]
SLOT_NAMES: tuple[SlotName, ...] = get_args(SlotName)
LEFT_OVER = 1e-6  # rad by which a pose may miss those that fewer than six joints can take
RANK_LOST = 1e-6  # smallest singular value below which a joint may be free
NEAR_SINGULAR = 1e-7  # rad or parts of the reach: a closed form's row so near to its singular sets is looked at again
PREFERENCE: tuple[ArmClassCode, ...] = (
    "spherical_wrist",
    "three_parallel",
    "arm_angle",
    "gantry",
    "general_six",
    "six_two_prismatic",
    "six_one_prismatic",
)


@dataclass(frozen=True)
class Redundancy:
    """What a pose leaves open in chains of seven and more: a joint (from 0), or the arm angle (-1)."""

    joint: int
    code: Literal["locked_joint", "arm_angle"]


class ChainSolver(Protocol):
    """What every class offers.

    ``rows`` takes poses (N, 4, 4) in m and values (N, k) of the k parameters; it gives joint values (N, slots, n), NaN
    in empty slots, and how sure it is (N,): CERTAIN, UNCERTAIN, or CONTINUUM where branches meet or a joint is free.
    ``names`` tells the slots' names, with joint values (n,) of the manufacturer's zero pose; none where no sign factors
    separate the solutions.
    """

    @property
    def code(self) -> ArmClassCode: ...

    @property
    def slots(self) -> int: ...

    @property
    def parameters(self) -> tuple[Redundancy, ...]: ...

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]: ...

    def values_of(self, x: Reals) -> Reals: ...

    def seeds(self, T: Reals, values: Reals) -> Reals: ...

    def names(self, x: Reals) -> tuple[SlotName, ...]: ...


class _Fixed:
    """A class without parameters."""

    parameters: tuple[Redundancy, ...] = ()

    def values_of(self, x: Reals) -> Reals:
        return np.empty((*x.shape[:-1], 0))

    def seeds(self, T: Reals, values: Reals) -> Reals:
        """Members (k, n) of continua of one pose (4, 4) that the class knows without a search."""
        return np.empty((0, 6))

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        return ()


@dataclass(frozen=True, eq=False)
class SphericalWristSolver(_Fixed):
    """Axes 2 and 3 parallel, and a spherical wrist."""

    links: Reals
    constants: ArmConstants
    code: ArmClassCode = "spherical_wrist"
    slots: int = 8

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        shape = len(T), 8
        q, fault, gap = np.full((*shape, 6), np.nan), np.zeros(shape, dtype=np.int8), np.zeros(shape)
        plain = np.ones(6), np.zeros(6)
        solve(self.constants, plain, np.ascontiguousarray(T), np.zeros((len(T), 6)), True, True, (q, fault, gap))
        q[fault != REACHED] = np.nan
        return q, np.where(_branches_meet(q, ((4, 0), (2, 2), (1, 4))), CONTINUUM, CERTAIN)

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        k = self.constants
        w1, w2 = np.array(k.axis_1), np.array(k.axis_2)
        T = poses_of(self.links, x)
        W = T[:3, 3] + T[:3, :3] @ np.array(k.wrist_in_tool) - np.array(k.point_1)
        side = float(np.cross(w1, w2) @ _turned_back(W, w1, x[0]))
        return _three_signs(w1, w2, side if abs(side) > BOUNDARY_M else 1.0)


@dataclass(frozen=True, eq=False)
class ParallelAxes(_Fixed):
    """Axes 2, 3 and 4 parallel, 5 and 6 meet."""

    arm: ThreeParallel
    code: ArmClassCode = "three_parallel"
    slots: int = 8

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        q, marked = solve_three_parallel(self.arm, T)
        certainty = np.full(len(T), CERTAIN)
        for n in np.flatnonzero(marked):
            chain = PoseChain.of(self.arm.links, np.zeros(6, dtype=bool), T[n], size_of(self.arm.links))
            solved = q[n][np.isfinite(q[n, :, 0])]
            certainty[n] = CONTINUUM if any(chain.smallest(x) < RANK_LOST for x in solved) else CERTAIN
        return q, certainty

    def seeds(self, T: Reals, values: Reals) -> Reals:
        found = [
            family.members(np.array([0.5 * (low + high), 0.25 * low + 0.75 * high]), elbow)
            for family in four_bars(self.arm, T)
            for low, high in family.intervals
            for elbow in (0, 1)
        ]
        return np.concatenate([np.empty((0, 6)), *found])

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        axes, points = axes_of(self.arm.links)
        T = poses_of(self.arm.links, x)
        W = T[:3, 3] + T[:3, :3] @ np.array(self.arm.constants.wrist_in_tool) - points[0]
        side = float(np.cross(axes[0], axes[1]) @ _turned_back(W, axes[0], x[0]))
        return _three_signs(axes[0], axes[1], side if abs(side) > BOUNDARY_M else 1.0)


@dataclass(frozen=True, eq=False)
class General(_Fixed):
    """Any six joints of which at most two slide."""

    solve: Callable[[Reals], RowsFound]
    code: ArmClassCode
    slots: int = 16

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        found = self.solve(T)
        return found.q, found.certainty


@dataclass(frozen=True, eq=False)
class ArmAngle:
    """Seven joints with a spherical shoulder and wrist."""

    arm: ArmAngleArm
    spare: ArmAngleArm  # with another reference
    code: ArmClassCode = "arm_angle"
    slots: int = 8
    parameters: tuple[Redundancy, ...] = (Redundancy(-1, "arm_angle"),)

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        q, singular = solve_at_arm_angle(self.arm, T, values[:, 0])
        lost = np.flatnonzero(singular & np.isnan(q).all(axis=(1, 2)))
        if lost.size:  # shoulder and wrist may be in line with the reference
            q[lost] = solve_at_arm_angle(self.spare, T[lost], np.nan_to_num(values[lost, 0]))[0]
        return q, np.where(singular, CONTINUUM, CERTAIN)

    def values_of(self, x: Reals) -> Reals:
        angles = arm_angles_of(self.arm, x)
        if np.isnan(angles).any():
            angles = np.where(np.isnan(angles), arm_angles_of(self.spare, x), angles)
        return angles[..., None]

    def seeds(self, T: Reals, values: Reals) -> Reals:
        return np.empty((0, 7))

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        # slots are 4 elbow + 2 shoulder + wrist
        first = SLOT_NAMES.index("shoulder_plus_elbow_plus_wrist_plus")
        return tuple(SLOT_NAMES[first + 4 * (s // 2 % 2) + 2 * (s // 4) + s % 2] for s in range(8))


@dataclass(frozen=True, eq=False)
class ThreeSliding(_Fixed):
    """Six joints, three of which slide."""

    arm: Gantry
    code: ArmClassCode = "gantry"
    slots: int = 2

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        q, singular = solve_gantry(self.arm, T)
        return q, np.where(singular, CONTINUUM, CERTAIN)

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        return "wrist_plus", "wrist_minus"


@dataclass(frozen=True, eq=False)
class PlanarFour(_Fixed):
    """Four joints of one direction, one of them sliding."""

    arm: Scara
    code: ArmClassCode = "scara"
    slots: int = 2

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        q, second = solve_scara(self.arm, T)[0], self.arm.turning[1]
        meet = np.abs(_turned(q[:, 0, second] - q[:, 1, second])) < NEAR_SINGULAR
        return q, np.where(meet, CONTINUUM, CERTAIN)

    def seeds(self, T: Reals, values: Reals) -> Reals:
        return np.empty((0, 4))

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        return "elbow_plus", "elbow_minus"


@dataclass(frozen=True, eq=False)
class Completed(_Fixed):
    """Fewer than six joints, solved with joints that the chain lacks at these places (from 0, rising)."""

    rest: ChainSolver
    lacking: tuple[int, ...]
    code: ArmClassCode
    slots: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "slots", self.rest.slots)

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        x, certainty = self.rest.rows(T, values)
        if self.code == "planar_wrist":  # what these joints would have to turn, the tool can't
            x[np.abs(_turned(x[:, :, list(self.lacking)])).max(axis=2) > LEFT_OVER] = np.nan
        x = np.delete(x, self.lacking, axis=2)
        for first in range(x.shape[1]):  # rows that differ in the joints that are not there
            same = np.abs(_turned(x[:, first + 1 :] - x[:, first : first + 1])).max(axis=2, initial=0.0) < 1e-9
            x[:, first + 1 :][same] = np.nan
        return x, certainty

    def seeds(self, T: Reals, values: Reals) -> Reals:
        return np.empty((0, 6 - len(self.lacking)))

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        if self.code == "position":  # rows that differ in the joints that are not there are one
            return ()
        full = np.zeros(6)
        full[[j for j in range(6) if j not in self.lacking]] = x
        return self.rest.names(full)


@dataclass(frozen=True, eq=False)
class LockedJoint:
    """More than six joints, one of which is held at a value; ``rest`` solves the others."""

    links: Reals
    sliding: Flags
    joint: int
    rest: ChainSolver | None
    code: ArmClassCode
    slots: int
    parameters: tuple[Redundancy, ...]

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        own = values[:, 0]
        q = np.full((len(T), self.slots, len(self.sliding)), np.nan)
        certainty = np.full(len(T), CERTAIN)
        others = [j for j in range(len(self.sliding)) if j != self.joint]
        if self.rest is not None:
            q[:, :, others], certainty = self.rest.rows(self._without(T, own), values[:, 1:])
        else:
            for value in np.unique(own):
                at = own == value
                rest = chain_solver(*held(self.links, self.sliding, self.joint, float(value)))
                q[np.ix_(at, np.arange(rest.slots), np.array(others))], certainty[at] = rest.rows(T[at], values[at, 1:])
        q[:, :, self.joint] = np.where(np.isnan(q[:, :, others[0]]), np.nan, own[:, None])
        return q, certainty

    def _without(self, T: Reals, own: Reals) -> Reals:
        """The poses for the chain without its first or last joint."""
        ends = (0, 1) if self.joint == 0 else (len(self.sliding) - 1, len(self.sliding))
        links = np.array([self.links[ends[0]] if self.joint == 0 else np.eye(4), self.links[ends[1]]])
        if self.joint == 0:
            links[1] = np.eye(4)
        step = inverse_rigid(poses_of(links, own[:, None], self.sliding[[self.joint]]))
        return np.asarray(step @ T if self.joint == 0 else T @ step)

    def values_of(self, x: Reals) -> Reals:
        own = x[..., self.joint, None]
        if self.rest is None or not self.rest.parameters:
            return own
        return np.concatenate([own, self.rest.values_of(np.delete(x, self.joint, axis=-1))], axis=-1)

    def seeds(self, T: Reals, values: Reals) -> Reals:
        return np.empty((0, len(self.sliding)))

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        return self.rest.names(np.delete(x, self.joint)) if self.rest is not None else ()


@dataclass(frozen=True, eq=False)
class Unsolved(_Fixed):
    """A chain for which nothing here knows all solutions."""

    joints: int
    code: ArmClassCode = "unsolved"
    slots: int = 16

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        return np.full((len(T), self.slots, self.joints), np.nan), np.full(len(T), CONTINUUM)

    def seeds(self, T: Reals, values: Reals) -> Reals:
        return np.empty((0, self.joints))


def _turned_back(v: Reals, axis: Reals, angle: float) -> Reals:
    """A vector as seen with joint 1 at 0."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(c * v - s * np.cross(axis, v) + (1 - c) * (axis @ v) * axis)


def _three_signs(w1: Reals, w2: Reals, zero_side: float) -> tuple[SlotName, ...]:
    """Names of the slots ``4 shoulder + 2 elbow + wrist``.

    As :func:`er3a.kinematics.configuration.branch_labels`: *front* is where the wrist is in the zero pose; *up*: with
    the arm stretched out level on that side the elbow is above the line from shoulder to wrist.
    """
    names = []
    for slot in range(8):
        shoulder, elbow, wrist = slot // 4, slot // 2 % 2, slot % 2
        outward = (-1.0 if shoulder == 0 else 1.0) * np.cross(w1, w2)
        back = (outward @ np.cross(w1, w2)) * zero_side < 0
        down = (1.0 if elbow == 0 else -1.0) * (np.cross(w2, outward) @ w1) >= 0
        names.append(SLOT_NAMES[4 * int(back) + 2 * int(down) + wrist])
    return tuple(names)


def _turned(x: Reals) -> Reals:
    return np.asarray(x - TURN * np.round(x / TURN))


def _branches_meet(q: Reals, pairs: tuple[tuple[int, int], ...]) -> Flags:
    """Whether two rows that differ in one root (slots apart, joint that tells it) lie within a small angle, (N,)."""
    meet = np.zeros(len(q), dtype=bool)
    for step, joint in pairs:
        for slot in range(8):
            if slot // step % 2 == 0:
                meet |= np.abs(_turned(q[:, slot, joint] - q[:, slot + step, joint])) < NEAR_SINGULAR
    return meet


def chain_solver(links: Reals, sliding: Flags) -> ChainSolver:
    """The solver of a chain with constant links (n + 1, 4, 4), m, whose joints slide where ``sliding`` (n,) says so."""
    links, sliding = np.ascontiguousarray(links, dtype=float), np.asarray(sliding, dtype=bool)
    n = len(sliding)
    if n == 6:
        return _of_six(links, sliding)
    if n == 7 and not sliding.any():
        arm, spare = arm_angle_arm(links), arm_angle_arm(links, frame_along(axes_of(links)[0][0])[0])
        if arm is not None and spare is not None:
            return ArmAngle(arm, spare)
    if n > 6:
        return _locked(links, sliding)
    if n == 4 and (planar := scara(links, sliding)) is not None:
        return PlanarFour(planar)
    return _completed(links, sliding)


def _of_six(links: Reals, sliding: Flags) -> ChainSolver:
    if not sliding.any():
        axes, points = axes_of(links)
        wrist = recognised(axes, points, poses_of(links, np.zeros(6)))
        if isinstance(wrist, WristPartitionedArm):
            return SphericalWristSolver(links, constants_of(wrist))
        parallel = three_parallel(links)
        if parallel is not None:
            return ParallelAxes(parallel)
    if full_rank(links, sliding):
        three = gantry(links, sliding)
        if three is not None:
            return ThreeSliding(three)
        if sliding.sum() == 2:
            two = two_slides(links, sliding)
            return Unsolved(6) if two is None else General(partial(solve_two_slides, two), "six_two_prismatic")
        arm = prepared(links, sliding)
        if arm.readings:
            return General(partial(solve_six_revolute, arm), "six_one_prismatic" if sliding.any() else "general_six")
        return Unsolved(6)
    return Unsolved(6, "dependent")


def full_rank(links: Reals, sliding: Flags, at_rest: tuple[int, ...] = ()) -> bool:
    """Whether the chain moves its tool in as many ways as it has joints (six at most) at random joint values; those
    ``at_rest`` (from 0) are 0."""
    random = np.random.default_rng(5)
    scaled = np.array(links, float)
    scaled[:, :3, 3] /= size_of(links)
    best = 0.0
    for x in random.uniform(-2.5, 2.5, (4, len(sliding))):
        x[list(at_rest)] = 0.0
        values = np.linalg.svd(_jacobian(scaled, sliding, x), compute_uv=False)
        best = max(best, float(values[-1]))
    return best > FULL_RANK


def _jacobian(links: Reals, sliding: Flags, x: Reals) -> Reals:
    n = len(sliding)
    frames = [poses_of(links[: k + 1], x[:k], sliding[:k]) for k in range(n)]
    tip = poses_of(links, x, sliding)[:3, 3]
    J = np.zeros((6, n))
    for k, frame in enumerate(frames):
        z = frame[:3, 2]
        J[:, k] = np.r_[z, 0, 0, 0] if sliding[k] else np.r_[np.cross(z, tip - frame[:3, 3]), z]
    return J


def held(links: Reals, sliding: Flags, joint: int, value: float) -> tuple[Reals, Flags]:
    """The chain with one joint (from 0) held at a value, in rad or m."""
    step = poses_of(np.array([links[joint], links[joint + 1]]), np.array([value]), sliding[[joint]])
    return np.concatenate([links[:joint], step[None], links[joint + 2 :]]), np.delete(sliding, joint)


def _locked(links: Reals, sliding: Flags) -> ChainSolver:
    """Of the joints that can be held, one at an end if there is any (then the rest is one chain for all values), and
    that which leaves the class easiest to solve; a sliding one before others."""
    n = len(sliding)
    best: tuple[tuple[int, int, int], int, ChainSolver] | None = None
    for joint in (*(j for j in (0, n - 1) if sliding[j]), n - 1, 0, *range(1, n - 1)):
        if best is not None and 0 < joint < n - 1:
            break
        rest_links, rest_sliding = held(links, sliding, joint, 0.4321)
        if joint == 0:
            rest_links = links[1:]
        elif joint == n - 1:
            rest_links = links[:-1]
        if not full_rank(rest_links, rest_sliding):
            continue
        rest = chain_solver(rest_links, rest_sliding)
        code = rest.code if not isinstance(rest, LockedJoint) else "redundant"
        place = PREFERENCE.index(code) if code in PREFERENCE else len(PREFERENCE)
        rating = (isinstance(rest, Unsolved), not bool(sliding[joint]), place)
        if best is None or rating < best[0]:
            best = (rating, joint, rest)  # type: ignore[assignment]
    if best is None or isinstance(best[2], Unsolved):
        return Unsolved(n, "unsolved" if full_rank(links, sliding) else "dependent")
    _, joint, rest = best
    inner = tuple(Redundancy(p.joint + (p.joint >= joint), p.code) if p.joint >= 0 else p for p in rest.parameters)
    parameters = (Redundancy(joint, "locked_joint"), *inner)
    at_end = joint in (0, n - 1)
    return LockedJoint(links, sliding, joint, rest if at_end else None, "redundant", rest.slots, parameters)


def _completed(links: Reals, sliding: Flags) -> ChainSolver:
    """The chain with joints at the tool, or before its last joint, that make it a chain of six."""
    n = len(sliding)
    if not full_rank(links, sliding):
        return Unsolved(n, "dependent")
    best: tuple[int, ChainSolver] | None = None
    for code, places, candidate in _completions(links, n):
        more = np.zeros(6, dtype=bool)
        more[[j for j in range(6) if j not in places]] = sliding
        # where the added joints must be 0, not only where they would turn the tool elsewhere
        if not full_rank(candidate, more, places if code == "planar_wrist" else ()):
            continue
        rest = chain_solver(candidate, more)
        if isinstance(rest, Unsolved):
            continue
        place = PREFERENCE.index(rest.code)
        if best is not None and code == "planar_wrist" and places == tuple(range(n, 6)):
            break  # made for any chain, and needed by those alone that nothing else completes
        if best is None or (code == best[1].code and place < best[0]):
            best = (place, Completed(rest, places, code))
    return Unsolved(n) if best is None else best[1]


def _completions(links: Reals, n: int) -> list[tuple[ArmClassCode, tuple[int, ...], Reals]]:
    """Code, places of the added joints, and links (7, 4, 4) with them; the last is made for any chain."""
    eye = np.eye(4)
    axes, _ = axes_of(links)
    found: list[tuple[ArmClassCode, tuple[int, ...], Reals]] = []
    if n == 5:
        found.append(("free_roll", (5,), np.concatenate([links, eye[None]])))
        across = np.cross(axes[3], axes[4])
        if np.linalg.norm(across) > 1e-6:
            found.append(("planar_wrist", (4,), _with_joint_between(links, 4, across)))
    if n == 4:
        w = poses_of(links, np.zeros(4))[:3, :3].T @ axes[3]
        first, second = eye.copy(), eye.copy()
        second[:3, :3] = frame_along(w)[[1, 2, 0]].T  # z across the last axis
        first[:3, :3] = frame_along(w)[[2, 0, 1]].T  # z across both
        more = [links[-1] @ first, inverse_rigid(first) @ second, inverse_rigid(second)]
        found.append(("planar_wrist", (4, 5), np.concatenate([links[:-1], more])))
    if n == 3:
        # a wrist about the tool point, askew, so that the tool's own orientation is none of its singular ones
        askew = eye.copy()
        askew[:3, :3] = about_x(0.9)
        last = eye.copy()
        last[:3, :3] = about_z(0.7) @ about_x(1.1)
        found.append(("position", (3, 4, 5), np.concatenate([links, [askew], [inverse_rigid(askew)], [last]])))
    found.append(("planar_wrist", tuple(range(n, 6)), _with_any_joints(links, n)))
    return found


def _with_any_joints(links: Reals, n: int) -> Reals:
    """Links (7, 4, 4) with joints behind the tool about axes without special places."""
    size, more = size_of(links), []
    for k in range(6 - n):
        step = np.eye(4)
        step[:3, :3] = about_z(0.7 + 0.9 * k) @ about_x(1.1 - 0.3 * k)
        step[:3, 3] = size * np.array([0.31, -0.17 + 0.13 * k, 0.23 - 0.19 * k])
        more.append(step)
    back = np.eye(4)
    for step in more:
        back = back @ step
    return np.array([*links[:-1], links[-1] @ more[0], *more[1:], inverse_rigid(back)])


def _with_joint_between(links: Reals, joint: int, axis: Reals) -> Reals:
    """Links with one more joint before ``joint`` (from 0): about ``axis`` (base frame, all joints at 0), through the
    point of that joint's axis nearest to the axis before it."""
    axes, points = axes_of(links)
    w = axis / np.linalg.norm(axis)
    before, own = axes[joint - 1], axes[joint]
    # where the common normal meets the joint's axis
    s = np.linalg.lstsq(np.column_stack([own, -before, w]), points[joint - 1] - points[joint], rcond=None)[0][0]
    frame = np.eye(4)
    x = own - (own @ w) * w
    x /= np.linalg.norm(x)
    frame[:3, :3] = np.column_stack([x, np.cross(w, x), w])
    frame[:3, 3] = points[joint] + s * own
    start = poses_of(links[:joint], np.zeros(joint - 1))  # frame of the joint before, all at 0
    own_frame = poses_of(links[: joint + 1], np.zeros(joint))
    first, second = np.linalg.inv(start) @ frame, np.linalg.inv(frame) @ own_frame
    return np.concatenate([links[:joint], [first], [second], links[joint + 1 :]])
