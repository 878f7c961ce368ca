"""Follows the steps of a program that was run, and checks each motion from where the one before left the arm.

The ways round a corner between two lines: joints at poses of a triangle of the tool, and by how much they bend.

The poses have two coordinates from 0, at most 1 in sum: shares of the ways back to where the zone begins and on to
where it ends; the tool turns with the same shares. Along a straight way of the coordinates J q' = v. From a pose that
is solved, with J0 there, all bounds are taken joint by joint: as long as the joints have moved by no more than d,
``|J0^-1 (J - J0)| <= E(d)``, of the derivatives of J at that pose and a bound of the second ones (no derivative of a
column is longer than the longest column). Then ``|q'| <= (I - E)^-1 |J0^-1 v|`` [1]_; where that comes out no greater
than d, all poses of the triangle are solved, on one branch. Second derivatives follow from J q'' = v' - J' q'. The
error of linear interpolation over a triangle is half the mean, by the shares of its corners, of the second derivatives
towards them: at most an eighth of the sum that two of its sides give.

References
----------
.. [1] A. Neumaier, *Interval Methods for Systems of Equations*, 1990, sections 3.6 and 4.1.

Whether an arm stays clear however it rounds a corner within its zone.

Round a corner with a joint motion, the ways lie in the triangle of joint values between where the zone begins, the
corner, and where it ends, but for ``bend``: the joints of a line leave the straight way between its ends. Round a
corner of two lines the tool's poses lie in a triangle, and joints are solved at the corners of each part of it. A part
is free if at its middle each pair of bodies is farther apart than they can come nearer to each other within it; else it
is cut in four. How near they can come is bounded by levers: no point of a body is farther from a joint's axis than the
links between and the body are long.
"""

from __future__ import annotations

import heapq
import math
from collections import defaultdict
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from er3a.by_value import ByValue
from er3a.collision.along import ClearanceAlong, clearance_along
from er3a.collision.bodies import Bodies
from er3a.collision.pairs import Pair
from er3a.collision.scene import Scene
from er3a.collision.shapes import arm_shapes, enlarged_by, link_frames
from er3a.errors import PoseError
from er3a.geometry.transforms import rotation_angle
from er3a.geometry.vectors import TURN
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.chain import row_values
from er3a.kinematics.forward import forward, jacobian
from er3a.kinematics.inverse import inverse
from er3a.kinematics.singularity import characteristic_length
from er3a.kinematics.wrist_partitioned import solve_slots, wrist_partition_missing
from er3a.numerics.arrays import Reals
from er3a.planning.avoidance.strategies import deviation
from er3a.planning.follow import turned_difference
from er3a.planning.tool_proof import inverse_and_reach
from er3a.program_check import program_check_findings as found_in
from er3a.program_check.motion_checks import (
    CheckRules,
    MotionPath,
    is_given,
    joint_motion_path,
    limit_findings,
    tool_motion_path,
)
from er3a.programs import instructions
from er3a.programs.execution import Ending, Execution
from er3a.programs.writing import solutions_meant
from er3a.robots.joint_limits import equivalents_within, joint_shown, within
from er3a.robots.robot import Robot

FLANGE = "tool0"
SAME_DIGITS = 6  # of angles in rad


@dataclass(frozen=True, eq=False)
class PlacedMotion(ByValue):
    """A motion, and the arm with the motion's tool.

    Attributes
    ----------
    arm : the robot with the motion's tool; without one where the tool is not known
    base : T_world_base of the targets (4, 4); None where the base is not known
    missing : frames that are not given
    taken : frames that were taken for ones that are not given, or not wholly
    """

    motion: instructions.ArmMotion
    arm: Robot
    base: Reals | None
    missing: tuple[found_in.FrameNotGiven, ...]
    taken: tuple[found_in.FrameTakenAsFlange | found_in.FrameOfSeveral, ...]

    @property
    def needed(self) -> tuple[found_in.FrameNotGiven, ...]:
        """The frames that are not given, for a motion that needs them."""
        return tuple(replace(each, needed=True) for each in self.missing)


class Arms:
    """The robot with each tool of a program, made once."""

    def __init__(self, robot: Robot):
        self.robot = robot
        self._by_tool: dict[bytes, Robot] = {robot.tool.tobytes(): robot}

    def placed(self, motion: instructions.ArmMotion) -> PlacedMotion:
        """A motion placed in the world, with the frames that are unknown."""
        missing: list[found_in.FrameNotGiven] = []
        taken: list[found_in.FrameTakenAsFlange | found_in.FrameOfSeveral] = []
        arm, base = self.robot, motion.base.pose
        if motion.tool.pose is not None:
            arm = self._with(motion.tool.pose)
            taken += [found_in.FrameOfSeveral(motion.tool.name, "tool")] if motion.tool.one_of_several else []
        elif motion.tool.name == FLANGE:
            arm = self._with(np.eye(4))
            taken.append(found_in.FrameTakenAsFlange(FLANGE))
        elif motion.tool.name:
            missing.append(found_in.FrameNotGiven(motion.tool.name, "tool", needed=False))
        if base is None and motion.base.name:
            missing.append(found_in.FrameNotGiven(motion.base.name, "base", needed=False))
        if base is not None and motion.base.one_of_several:
            taken.append(found_in.FrameOfSeveral(motion.base.name, "base"))
        known = None if base is None and motion.base.name else self.robot.base @ (np.eye(4) if base is None else base)
        return PlacedMotion(motion, arm, known, tuple(missing), tuple(taken))

    def _with(self, tool: Reals) -> Robot:
        key = tool.tobytes()
        if key not in self._by_tool:
            self._by_tool[key] = self.robot.replace(tool=tool)
        return self._by_tool[key]


@dataclass(frozen=True, eq=False)
class Goal:
    """Where a motion goes.

    Attributes
    ----------
    joints : (n,), rad; None where no solution is known
    pose : T_world_tool (4, 4), m, of a target that is a pose
    known : whether the target itself is known
    """

    joints: Reals | None
    pose: Reals | None
    known: bool
    findings: tuple[found_in.CheckFinding, ...] = ()


def goal_of(placed: PlacedMotion, target: instructions.Target | None, before: Reals | None) -> Goal:
    """The goal of a target, from joints (n,), rad; of several solutions, the nearest within the limits."""
    if isinstance(target, instructions.UnresolvedTarget) and target.reason == "position_unknown" and placed.missing:
        return Goal(None, None, False, placed.needed)
    if target is None or isinstance(target, instructions.UnresolvedTarget):
        unknown = (
            found_in.TargetNotGiven("", "undefined")
            if target is None
            else found_in.TargetNotGiven(target.text, target.reason)
        )
        return Goal(None, None, False, (unknown,))
    if isinstance(target, instructions.JointTarget):
        open_ = np.isnan(target.joints)
        if not open_.any():
            return Goal(target.joints, None, True)
        if before is None:
            stays = bool(open_.all())
            return Goal(None, None, stays, () if stays else (found_in.TargetNotGiven("", "position_unknown"),))
        return Goal(np.where(open_, before, target.joints), None, True)
    if placed.missing or placed.base is None:
        return Goal(None, None, False, placed.needed)
    pose = placed.base @ target.pose
    return _solved(placed, target, pose, before)


def _solved(placed: PlacedMotion, target: instructions.PoseTarget, pose: Reals, before: Reals | None) -> Goal:
    reference = target.near if target.near is not None else before
    try:
        found = inverse(placed.arm, pose, reference, self_motion_rows=True)
    except PoseError:
        return Goal(None, None, False, (found_in.TargetNotGiven("", "too_far"),))
    if not len(found.q):
        return Goal(None, pose, True, (*placed.taken, found_in.TargetOutOfReach(found.unsolved, bool(target.external))))
    rows = found.q[found.within_limits] if found.within_limits.any() else found.q
    findings: list[found_in.CheckFinding] = []
    joint = placed.motion.kind == "joint"
    met = np.ones(len(rows), np.bool_)
    if target.branch is not None and joint:
        met = solutions_meant(target.branch, placed.arm, rows)
        rows = rows[met] if met.any() else rows
    if not met.any():
        findings.append(_branch_not_met(target, joint))
    elif target.configuration and joint and _different(rows) > 1:
        words = (
            f"{key} {value}" if isinstance(value, str) else f"{key} {value:g}" for key, value in target.configuration
        )
        findings.append(found_in.ConfigurationNotRead(", ".join(words)))
    if reference is None and not findings and (different := _different(rows)) > 1:
        findings.append(found_in.ConfigurationGuessed(different))
    start = np.zeros(rows.shape[1]) if reference is None else reference
    away = np.abs(rows - start).max(axis=1)
    return Goal(rows[int(away.argmin())], pose, True, (*placed.taken, *findings))


def _different(rows: Reals) -> int:
    """Number of distinct solutions among (k, n), rad."""
    return len(np.unique(np.round(rows, SAME_DIGITS), axis=0))


def _branch_not_met(target: instructions.PoseTarget, joint: bool) -> found_in.CheckFinding:
    """The finding that no solution has a target's configuration, or that a line does not end in it."""
    given = dict(target.configuration)
    if isinstance(turn := given.get("T"), (int, float)):
        return found_in.TurnNotMet(int(turn))
    shown = ", ".join(f"{key} {value:g}" if isinstance(value, float) else f"{value}" for key, value in given.items())
    return found_in.ConfigurationNotMet(shown, "target" if joint else "line")


MAX_REASONS = 1000  # targets out of reach whose reasons are looked for


def target_findings(
    arms: Arms, motions: Mapping[int, instructions.ArmMotion], keys: Mapping[int, Hashable]
) -> tuple[int, dict[int, tuple[found_in.CheckFinding, ...]]]:
    """Number of targets examined, and their findings by step number.

    Parameters
    ----------
    keys : equal for motions that are the same in all numbers
    """
    first: dict[Hashable, int] = {}
    for number in motions:
        first.setdefault(keys[number], number)
    findings: dict[int, tuple[found_in.CheckFinding, ...]] = {}
    poses: dict[int, list[tuple[int, PlacedMotion]]] = defaultdict(list)
    for number in first.values():
        placed = arms.placed(motions[number])
        target = placed.motion.target
        if isinstance(target, instructions.JointTarget):
            known = np.where(np.isnan(target.joints), placed.arm.lower, target.joints)
            findings[number] = limit_findings(placed.arm, known)
        elif not isinstance(target, instructions.PoseTarget) or placed.base is None or placed.missing:
            findings[number] = goal_of(placed, target, None).findings
        elif wrist_partition_missing(placed.arm) is None and placed.arm.coupling is None:  # others take too long
            poses[id(placed.arm)].append((number, placed))
    for group in poses.values():
        findings |= _of_poses(group)
    looked = [number for number in motions if first[keys[number]] in findings]
    return len(looked), {number: found for number in looked if (found := findings[first[keys[number]]])}


def _of_poses(group: list[tuple[int, PlacedMotion]]) -> dict[int, tuple[found_in.CheckFinding, ...]]:
    """Findings on pose targets of one arm."""
    arm = group[0][1].arm
    findings: dict[int, tuple[found_in.CheckFinding, ...]] = {number: () for number, _ in group}
    try:
        found = inverse_batch(arm, np.stack([_pose(placed) for _, placed in group]))
    except PoseError:  # one of them is no pose
        return {number: goal_of(placed, placed.motion.target, None).findings for number, placed in group}
    away = np.where(found.solved, np.abs(found.q).max(axis=2), np.inf)
    inside = (found.solved & within(arm, found.q)).any(axis=1)
    reasons = 0
    for i in np.flatnonzero(~inside).tolist():
        number, placed = group[i]
        if found.solved[i].any():
            findings[number] = limit_findings(arm, found.q[i, int(away[i].argmin())])
        elif (reasons := reasons + 1) <= MAX_REASONS:
            findings[number] = goal_of(placed, placed.motion.target, None).findings
        else:
            outer = getattr(placed.motion.target, "external", ())
            findings[number] = (found_in.TargetOutOfReach((), bool(outer)),)
    return findings


def _pose(placed: PlacedMotion) -> Reals:
    assert placed.base is not None
    assert isinstance(placed.motion.target, instructions.PoseTarget)
    found: Reals = placed.base @ placed.motion.target.pose
    return found


MAX_TURN = 1.0  # rad, to which the twist of a rotation vector that changes has been bounded
MAX_GROWTH = 0.7  # spectral radius of what bounds a joint's motion by itself: beyond, the bound does not converge
FIRST_GUESS, LARGER = 1.2, 1.1  # times the motion to first order, tried as its bound; times the bound that fails
STEP, BLUR = 1e-5, 1e-8  # rad, of differences of the Jacobian; their error
ATTEMPTS = 6
SAME = 1e-7  # rad
MAX_INVERSE = 1e6  # of the scaled Jacobian; beyond, nothing is proven


@dataclass(frozen=True, eq=False)
class ZonePatch:
    """The poses round a corner.

    Attributes
    ----------
    corner : T_world_tool (4, 4), m
    sides : (2, 3), m, from the corner to where the zone begins and to where it ends
    turns : (2, 3), rotation vectors, likewise, in the world's frame
    slack : m and rad, by which the tool may be off the triangle
    """

    arm: Robot
    corner: Reals
    sides: Reals
    turns: Reals
    slack: tuple[float, float]

    def poses(self, at: Reals) -> Reals:
        """T_world_tool (k, 4, 4) at coordinates (k, 2)."""
        found = np.tile(self.corner, (len(at), 1, 1))
        found[:, :3, 3] += at @ self.sides
        found[:, :3, :3] = Rotation.from_rotvec(at @ self.turns).as_matrix() @ self.corner[:3, :3]
        return found

    def joints(self, at: Reals, near: Reals) -> Reals:
        """Solutions (k, n), rad, nearest to joints (k, n) at coordinates (k, 2); NaN where there is none."""
        solved = solve_slots(self.arm, self.poses(at), near)[0]
        steps = turned_difference(near[:, None], solved)
        away = np.where(np.isnan(steps).any(axis=-1), np.inf, np.abs(steps).max(axis=-1))
        best = away.argmin(axis=1)
        rows = np.arange(len(at))
        return np.where(np.isfinite(away[rows, best])[:, None], near + steps[rows, best], np.nan)

    def bend(self, at: Reals, q: Reals) -> tuple[Reals, Reals]:
        """By how much joints (n,) are off the flat triangle at most, and off it by slack alone, rad.

        Parameters
        ----------
        at : (3, 2), coordinates; q : (3, n), rad, solutions there

        Returns
        -------
        bend, slack : the first infinite where nothing is proven of so large a part
        """
        n = q.shape[1]
        open_ = np.full(n, np.inf), np.zeros(n)
        turned = float(np.linalg.norm(self.turns, axis=1).sum())
        near = NearJoints.of(self.arm, q[0]) if np.isfinite(q).all() and turned <= MAX_TURN else None
        if near is None:
            return open_
        edges = at[1:] - at[0]
        turning = edges @ self.turns
        angles = np.linalg.norm(turning, axis=1)
        twists = np.concatenate([edges @ self.sides / near.length, turning], axis=1)
        # a twist turns with the tool, by no more than the tool does; slack adds to what has to be gone
        off, off_turn = self.slack[0] / near.length, self.slack[1]
        aside = [near.size @ np.repeat([off, off_turn + turned * angle], 3) for angle in angles]
        first = np.abs(twists @ near.inverse.T) + np.stack(aside)
        moved = FIRST_GUESS * np.maximum(first.max(axis=0), first.max() / 5)
        for _ in range(ATTEMPTS):
            grown = near.grown(moved)
            if grown is None:
                return open_
            rates = first @ grown.T
            if (rates <= moved).all():
                break
            moved = np.maximum(moved, LARGER * rates.max(axis=0))
        else:
            return open_
        if (np.abs(q[1:] - q[0]) > rates * (1 + 1e-6) + SAME).any():  # another branch
            return open_
        bent = sum(
            near.second(moved, rates[i], rates[j]) + near.size @ np.repeat([0.0, angles[i] * angles[j]], 3)
            for i in range(2)
            for j in range(2)
        )
        slack: Reals = grown @ near.size @ np.repeat([off, off_turn], 3)
        return grown @ bent / 8 + slack, slack


@dataclass(frozen=True, eq=False)
class NearJoints:
    """The scaled Jacobian J0 near solved joints.

    Attributes
    ----------
    inverse : (n, 6), of J0; size : its absolute values
    changes : (n, n, n), sizes of J0^-1 dJ/dq_i, by i
    weights : (n,), by which rows of the table move per joint, in sum
    reach : largest lever of the tool point, over ``length`` (m)
    """

    inverse: Reals
    size: Reals
    changes: Reals
    weights: Reals
    reach: float
    length: float

    @classmethod
    def of(cls, arm: Robot, q: Reals) -> NearJoints | None:
        """At joints (n,) in rad; None where J0 has no inverse to speak of."""
        n, length = len(q), characteristic_length(arm)
        (b,), (reach,) = inverse_and_reach(arm, q[None], length)
        if not b < MAX_INVERSE:
            return None
        steps = STEP * np.eye(n)
        J = jacobian(arm, np.concatenate([q[None], q + steps, q - steps]))
        J[:, :3] /= length
        inverse = np.linalg.inv(J[0])
        changes = np.abs(inverse @ (J[1 : n + 1] - J[n + 1 :]) / (2 * STEP)) + BLUR * np.abs(inverse).max()
        weights = np.ones(n) if arm.coupling is None else np.abs(arm.coupling).sum(axis=0)
        return cls(inverse, np.abs(inverse), changes, weights, float(reach), length)

    @property
    def norms(self) -> Reals:
        """Lengths (n,) of the rows of J0^-1."""
        return np.asarray(np.sqrt((self.inverse**2).sum(axis=1)), np.float64)

    def column(self, moved: Reals) -> tuple[Reals, float]:
        """Largest length of the columns (n,) of J while joints move by (n,), and by how much rows do in sum."""
        rows = float(self.weights @ moved)
        longest = math.hypot(1.0, self.reach * math.exp(min(rows, 1.0)))
        return longest * self.weights, rows

    def grown(self, moved: Reals) -> Reals | None:
        """(I - E)^-1 (n, n) while joints move by no more than (n,), rad; None if E is too great."""
        columns, rows = self.column(moved)
        E = np.tensordot(moved, self.changes, 1) + self.norms[:, None] * columns * rows**2 / 2
        if rows >= 1.0 or np.abs(np.linalg.eigvals(E)).max() >= MAX_GROWTH:
            return None
        return np.asarray(np.linalg.inv(np.eye(len(E)) - E), np.float64)

    def second(self, moved: Reals, one: Reals, other: Reals) -> Reals:
        """Sizes (n,) of J0^-1 D_J[one] other while joints move by no more than ``moved``, rates (n,) at most."""
        columns, rows = self.column(moved)
        rest = self.norms * rows * (self.weights @ one) * float(columns @ other)
        found = np.asarray(np.einsum("iac,i,c->a", self.changes, one, other) + rest, np.float64)
        return found


def patch_of(arm: Robot, corners: Reals, slack: tuple[float, float] = (0.0, 0.0)) -> ZonePatch:
    """The poses between joints (3, n) where the zone begins, at the corner, and where it ends."""
    poses = forward(arm, corners)
    turns = Rotation.from_matrix(poses[[0, 2], :3, :3] @ poses[1, :3, :3].T).as_rotvec()
    return ZonePatch(arm, poses[1], poses[[0, 2], :3, 3] - poses[1, :3, 3], turns, slack)


def bend_of_line(arm: Robot, q: Reals, slack: tuple[float, float] = (0.0, 0.0)) -> Reals:
    """By how much joints (n,) are off the chord at most on a line through solved joints (k, n), rad.

    ``slack`` (m, rad) is by how far the way may be off the straight lines between them; infinite where nothing is
    proven.
    """
    shares = np.linspace(0, 1, len(q))[:, None]
    nodes = np.abs(q - q[0] - shares * (q[-1] - q[0])).max(axis=0)
    at = np.array([[0.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    parts = [
        patch_of(arm, np.stack([a, a, b]), slack).bend(at, np.stack([a, b, a]))[0]
        if np.isfinite([a, b]).all()
        else np.full(q.shape[1], np.inf)
        for a, b in pairwise(q)
    ]
    found: Reals = nodes + np.max(parts, axis=0)
    return found


MAX_POSES, MAX_SOLVED = 4000, 500
WHOLE = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])  # shares of where the zone begins and ends
PARTS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])  # of corners and of the middles between them


def zone_clearance(
    bodies: Bodies,
    corners: Reals,
    tolerance: float,
    bend: Reals | None = None,
    patch: ZonePatch | None = None,
    margin: float = 0.0,
) -> found_in.ZoneCollides | found_in.ZoneNotSettled | None:
    """Look for a path round a corner that collides; None if all are proven free.

    Parameters
    ----------
    corners : (3, n), rad, joints where the zone begins, at the corner, where it ends
    tolerance : m; no overlap deeper than this goes unnoticed
    bend : (n,), rad, by which joints may be off the triangle of joint values; None for not at all
    patch : the triangle of poses instead, round a corner of two lines
    margin : m; what comes nearer than this counts as colliding, with the depth -1000 times its distance
    """
    every = np.arange(len(bodies.pairs))
    if not every.size:
        return None
    levers = pair_levers(bodies, corners)
    coupling = bodies.robot.coupling
    per_joint = levers if coupling is None else levers @ np.abs(coupling)
    bend = np.zeros(corners.shape[1]) if bend is None else bend
    waiting: list[tuple[float, int, Reals, Reals]] = [(0.0, 0, WHOLE, corners)]
    most = MAX_POSES if patch is None else MAX_SOLVED
    measured, nearest, settled = 0, np.inf, True
    while waiting:
        _, _, at, triangle = heapq.heappop(waiting)  # the nearest to anything first
        middle = triangle.mean(axis=0)
        if not np.isfinite(middle).all():
            settled = False
            continue
        bent, lasting = (bend, bend) if patch is None else patch.bend(at, triangle)
        proven = bool(np.isfinite(bent).all())
        off = per_joint @ bent if proven else np.full(len(every), np.inf)
        distances = bodies.counted(bodies.distances(middle, every))
        measured += 1
        worst = int(np.argmin(distances))
        nearest = min(nearest, float(distances[worst]))
        if distances[worst] < margin - tolerance - (0.0 if patch is None else off[worst]):
            return found_in.ZoneCollides(bodies.pairs[worst], -1000 * float(distances[worst]))
        nearer = (levers @ np.abs(row_values(bodies.robot, triangle - middle)).T).max(axis=1)
        open_ = distances <= nearer + off + margin - tolerance
        if not open_.any():
            continue
        if measured >= most or (proven and (open_ & (nearer < np.maximum(per_joint @ lasting, tolerance))).any()):
            settled = False  # smaller parts would show no more
            if measured >= most:
                break
            continue
        between = (at + at[[1, 2, 0]]) / 2
        halves = (triangle + triangle[[1, 2, 0]]) / 2
        solved = halves if patch is None else patch.joints(between, halves)
        places, joints = np.concatenate([at, between]), np.concatenate([triangle, solved])
        for i, part in enumerate(PARTS):
            heapq.heappush(waiting, (float(distances[worst]), 4 * measured + i, places[part], joints[part]))
    return None if settled else found_in.ZoneNotSettled(1000 * nearest)


def pair_levers(bodies: Bodies, corners: Reals) -> Reals:
    """By how much a pair of bodies can come nearer per motion of each row of the table: (P, m), m/rad or m/m.

    Of two links only the rows between them count. Holds for joints (n,) between the corners (k, n).
    """
    robot = bodies.robot
    origins = link_frames(robot, corners)[..., :3, 3]
    along = np.linalg.norm(np.diff(origins, axis=-2), axis=-1).max(axis=0)  # of a slide the longest is at a corner
    before = np.concatenate([[0.0], np.cumsum(along)])
    links = np.array([body.link for body in bodies.capsules], dtype=int)
    size = np.array([np.linalg.norm(body.points, axis=1).max() for body in bodies.capsules])
    row = np.arange(robot.rows)
    reach = before[links][:, None] - before[row + 1] + size[:, None]  # a link's origin is on its joint's axis
    reach = np.where(robot.sliding, 1.0, reach) * (row < links[:, None])
    own = bodies.second >= 0
    far = np.where(own, bodies.second, bodies.first)
    base = np.where(own, links[bodies.first], 0)
    found: Reals = reach[far] * (row >= base[:, None])
    return found


MAX_MOTION_SHARE = 0.5  # that a zone may take
TOLERANCE = 1e-9
SAME_JOINTS = 1e-4  # rad
BEND_PARTS = 16
NEAR_PARTS = 129


@dataclass(frozen=True, eq=False)
class Obstacles:
    """The bodies that the arm must not touch.

    Attributes
    ----------
    tolerance : m, of an overlap that may go unnoticed
    assumed_margin : m, within which of the arm's shapes nothing is settled; 0 where a document gives them
    """

    scene: Scene | None
    tolerance: float
    assumed_margin: float
    bodies: dict[int, Bodies]

    def of(self, arm: Robot) -> Bodies:
        """The bodies of the robot with one tool, made once."""
        if id(arm) not in self.bodies:
            self.bodies[id(arm)] = Bodies(arm, self.scene)
        return self.bodies[id(arm)]

    def hit(self, arm: Robot, touches: Iterable[found_in.BodiesTouch]) -> found_in.MotionCollides:
        """A collision, with what is known of the shapes that overlap."""
        return found_in.MotionCollides(
            tuple(replace(each, enlarged_mm=1000 * enlarged_by(arm, self.scene, each.pair.names)) for each in touches),
            arm_shapes(arm).assumed,
        )


def obstacles_of(robot: Robot, scene: Scene | None, tolerance: float, assumed_margin: float) -> Obstacles:
    """What a robot must not meet, itself among it; ``assumed_margin`` holds if its shapes are assumed."""
    margin = assumed_margin if arm_shapes(robot).assumed else 0.0
    return Obstacles(scene, tolerance, margin, {id(robot): Bodies(robot, scene)})


@dataclass(frozen=True, eq=False)
class CheckedMotion(ByValue):
    """A motion as executed.

    Attributes
    ----------
    start : (n,), rad; None if not known
    way : None where there is none: the arm stays (``stays``), or the way is not known
    end : (n,), rad, where the motions that follow go on from; None if not known
    clearance : m, smallest on the way, negative by an overlap; None where not measured
    blended_ends : of its two ends, how many have a zone that is not fine
    moments : s from the motion's start, when what is found begins; not of findings about the motion as a whole
    """

    kind: str
    placed: PlacedMotion
    start: Reals | None
    way: MotionPath | None
    end: Reals | None
    findings: tuple[found_in.CheckFinding, ...]
    clearance: float | None = None
    stays: bool = False
    blended_ends: int = 0
    moments: Mapping[found_in.CheckFinding, float] = field(default_factory=dict)


MOVE_POINTS = 201  # of a joint move, at which its tool's distance from a way is measured
MAX_SOLUTIONS = 8  # of a target, to which joint moves are tried
MAX_MOTIONS_AGAIN = 1_000  # that are checked again after two ways with the same tool pose and other joints have joined
VIA_TURNS = (20.0, 40.0)  # deg, by which joints are turned away on the way round


class StepChecker:
    """Checks steps in their order."""

    def __init__(self, robot: Robot, rules: CheckRules, obstacles: Obstacles | None, execution: Execution):
        self.arms, self.rules, self.obstacles, self.execution = Arms(robot), rules, obstacles, execution
        self.start: Reals | None = None
        self.motions: dict[int, CheckedMotion] = {}
        self.returns: list[tuple[Ending, found_in.LoopComesBackOtherwise]] = []
        self._joints: list[Reals | None] = []
        self._before: list[tuple[int, bool]] = []  # as of _after, by step
        self._known: dict[Hashable, CheckedMotion] = {}
        self._corners: dict[Hashable, tuple[found_in.CheckFinding, ...]] = {}
        self._again = 0  # motions that were checked from other joints
        self.elsewhere: set[tuple[int, found_in.CheckFinding]] = set()  # by step, found from other joints alone
        self._following: dict[int, list[int]] = defaultdict(list)
        for number, step in enumerate(execution.steps):
            self._following[step.before].append(number)

    def check(self, number: int) -> None:
        """Check a step; all earlier steps must have been checked."""
        step = self.execution.steps[number]
        joints = self._before_it(number)
        before = self._before[step.before] if step.before >= 0 else (-1, False)
        what = step.instruction
        if isinstance(what, instructions.ArmMotion):
            self.motions[number] = motion = self._from_start(self._motion(what, joints), joints)
            joints = motion.end
            self._corner(before, number)
        elif _is_lost(what):
            joints = None
        self._joints.append(joints)
        self._before.append(self._after(before, number))

    def _after(self, before: tuple[int, bool], number: int) -> tuple[int, bool]:
        """The motion that the arm may blend from after a step, -1 for none; and whether it may stop at its target too.

        A wait for which the arm need not stop may be over before the corner, so that it is rounded. So may be that
        before a motion to where the arm is.
        """
        what, motion = self.execution.steps[number].instruction, before[0]
        if isinstance(what, instructions.ArmMotion):
            passes = motion >= 0 and self.motions[number].stays and what.zone.kind != "fine"
            return (motion, True) if passes else (number, False)
        if isinstance(what, instructions.Pause):
            return (-1, False) if what.stops else (motion, True)
        return (-1, False) if _is_lost(what) else before

    def _from_start(self, motion: CheckedMotion, joints: Reals | None) -> CheckedMotion:
        """The first motion, with limits that the arm stands beyond before it: no target before says so."""
        if joints is None or joints is not self.start:
            return motion
        beyond = [each for each in limit_findings(motion.placed.arm, joints) if each not in motion.findings]
        moments: dict[found_in.CheckFinding, float] = {**motion.moments, **{each: 0.0 for each in beyond}}
        return replace(motion, findings=(*motion.findings, *beyond), moments=moments)

    @property
    def different(self) -> int:
        """Number of distinct motions checked."""
        return len(self._known)

    def rest(self, first: int) -> tuple[int, dict[int, tuple[found_in.CheckFinding, ...]]]:
        """As :func:`target_findings`, of the steps from one on."""
        steps = self.execution.steps
        motions = {
            i: what
            for i in range(first, len(steps))
            if isinstance(what := steps[i].instruction, instructions.ArmMotion)
        }
        return target_findings(self.arms, motions, {i: _key(motion) for i, motion in motions.items()})

    def close_loop(self, ending: Ending) -> None:
        """Where a way comes to what was followed before: the corner there, and what follows from where the arm stands.

        A loop that comes back otherwise is named. A way that joins another one by the tool's pose alone, as its joints
        differ, is checked on until they are the same.
        """
        if ending.repeats_from is None or ending.step < 0:
            return
        at = self.execution.steps[ending.repeats_from].before
        then, now, before = self._before_it(ending.repeats_from), self._joints[ending.step], self._before[ending.step]
        loops = ending.kind == "repeats"
        if then is None or now is None or not _apart(then, now):
            self._checked_on(at, then, before)
        elif loops or not self._checked_on(at, now, before):
            joint = int(np.argmax(np.abs(now - then)))
            other = joint_shown(self.arms.robot, joint, float(now[joint] - then[joint]))
            self.returns.append((ending, found_in.LoopComesBackOtherwise(joint + 1, *other)))
            if loops:
                self._checked_on(at, then, before)

    def _before_it(self, number: int) -> Reals | None:
        """Joints (n,) before a step, rad; None if not known."""
        before = self.execution.steps[number].before
        return self._joints[before] if before >= 0 else self.start

    def _checked_on(self, at: int, joints: Reals | None, before: tuple[int, bool]) -> bool:
        """Check what follows a step from other joints, or after another motion, until both make no difference.

        Returns
        -------
        done : False where that takes too many motions
        """
        steps = self.execution.steps
        last = self.motions.get(before[0])
        waiting = [(number, joints, before, last) for number in self._following[at]]
        while waiting:
            number, joints, before, last = waiting.pop()
            what, same = steps[number].instruction, not _apart(joints, self._before_it(number))
            if isinstance(what, instructions.ArmMotion):
                self._again += not same
                if self._again > MAX_MOTIONS_AGAIN:
                    return False
                motion = self.motions[number] if same else self._motion(what, joints)
                self.elsewhere |= {(number, each) for each in motion.findings} - self._found_at(number)
                self._add(number, motion.findings, motion.moments)
                if last is not None:
                    self._add(before[0], self._corner_findings(last, motion))
                if same:
                    continue
                joints = motion.end
            elif _is_lost(what) or (same and before[0] < 0):
                continue
            after = self._after(before, number)
            if after[0] != before[0]:
                last = motion if after[0] == number else None
            waiting += [(each, joints, after, last) for each in self._following[number]]
        return True

    def _found_at(self, number: int) -> set[tuple[int, found_in.CheckFinding]]:
        return {(number, each) for each in self.motions[number].findings}

    def _add(
        self,
        number: int,
        findings: Iterable[found_in.CheckFinding],
        moments: Mapping[found_in.CheckFinding, float] | None = None,
    ) -> None:
        """Add what is new of findings to those of a motion."""
        motion = self.motions[number]
        new = tuple(each for each in dict.fromkeys(findings) if each not in motion.findings)
        if new:
            moments = {**(moments or {}), **motion.moments}
            self.motions[number] = replace(motion, findings=(*motion.findings, *new), moments=moments)

    def joint_moves_instead(self, number: int) -> tuple[Reals, ...]:
        """Joint moves (n,), one or two, that take the tool where a motion does and pass its checks; empty if none was
        found, and of arms with prismatic joints.

        The first that passes is taken: straight to the solution on the way to which the tool turns least, of like ones
        the nearest to the start, or else round by the middle of both with some joints turned away. They are checked at
        the share of full speed that is assumed.
        """
        checked = self.motions[number]
        goal = self._goal_pose(checked)
        if checked.start is None or goal is None or checked.placed.arm.slides.any():
            return ()
        try:
            found = inverse(checked.placed.arm, goal, checked.start, self_motion_rows=True)
        except PoseError:
            return ()
        arm, inside = checked.placed.arm, found.q[found.within_limits]
        rows = np.concatenate([inside[:0], *(equivalents_within(arm, q, checked.start) for q in inside)])
        rows = self._free(checked.placed, _as_written(rows))
        away, turns = np.abs(rows - checked.start).max(axis=1), _turns(arm, checked.start, rows)
        rows = rows[np.lexsort((away, np.round(turns / LIKE_TURNS)))][:MAX_SOLUTIONS]
        if len(rows) and np.abs(rows[0] - checked.start).max() < SAME_JOINTS:
            return ()  # the tool is there already: no move is needed
        straight = [(row,) for row in rows]
        vias = self._free(checked.placed, _vias(checked.placed.arm, checked.start, rows[0])) if len(rows) else ()
        round_about = [(via, rows[0]) for via in vias]
        for moves in (*straight, *round_about):
            starts = (checked.start, *moves[:-1])
            if all(self._passes(checked.placed, start, end) for start, end in zip(starts, moves)):
                return tuple(moves)
        return ()

    def off_way(self, number: int, moves: tuple[Reals, ...]) -> tuple[float, float] | None:
        """By how much the tool on joint moves (n,) leaves the way of a motion at most, m and rad; None of a motion
        without a way of the tool.

        Of each pose the way's nearest counts, where 1 mm weighs as much as 1 deg.
        """
        checked = self.motions[number]
        if checked.start is None or checked.way is None or checked.way.tool_path is None:
            return None
        share = np.linspace(0, 1, MOVE_POINTS)[:, None]
        q = np.concatenate([a + share * (b - a) for a, b in pairwise((checked.start, *moves))])
        distance, angle, _ = deviation(checked.way.tool_path, forward(checked.placed.arm, q))
        return float(distance.max()), float(angle.max())

    def _goal_pose(self, checked: CheckedMotion) -> Reals | None:
        """T_world_tool (4, 4), m, of a motion's target."""
        placed, target = checked.placed, checked.placed.motion.target
        if placed.missing or placed.motion.angle is not None:
            return None
        if isinstance(target, instructions.PoseTarget):
            return None if placed.base is None else _pose(placed)
        if isinstance(target, instructions.JointTarget) and checked.start is not None:
            return forward(placed.arm, np.where(np.isnan(target.joints), checked.start, target.joints))
        return None

    def _free(self, placed: PlacedMotion, q: Reals) -> Reals:
        """Which of joint vectors (k, n), rad, keep the required clearance."""
        if self.obstacles is None or not len(q):
            return q
        free: Reals = q[self.obstacles.of(placed.arm).free(q, self.obstacles.assumed_margin)]
        return free

    def _passes(self, placed: PlacedMotion, start: Reals, end: Reals) -> bool:
        """Whether a joint move with a motion's tool has no finding more severe than a note."""
        speed = instructions.Rate(self.rules.assumed.joint_share, "share")
        move = instructions.ArmMotion(
            "joint", instructions.JointTarget(end), speed=speed, tool=placed.motion.tool, base=placed.motion.base
        )
        found = self._checked(move, start, measured=False)
        return _good(found) and _good(self._measured(found))

    def _motion(self, motion: instructions.ArmMotion, before: Reals | None) -> CheckedMotion:
        key = (_key(motion), None if before is None else before.tobytes())
        if key not in self._known:
            self._known[key] = self._checked(motion, before)
        return self._known[key]

    def _checked(self, motion: instructions.ArmMotion, before: Reals | None, measured: bool = True) -> CheckedMotion:
        """``measured``: whether clearance along joint moves is, too."""
        placed = self.arms.placed(motion)
        goal = goal_of(placed, motion.target, before)
        findings: list[found_in.CheckFinding] = [*goal.findings, *_said(motion)]
        if motion.kind != "joint":  # the tool's path depends on it even between joint targets
            findings += [each for each in placed.taken if each not in findings]
        if motion.angle is not None and not np.isfinite(motion.angle):
            return CheckedMotion(
                motion.kind, placed, before, None, None, (*findings, found_in.ArcGoesOn(None, turns=False))
            )
        if not goal.known:
            return CheckedMotion(motion.kind, placed, before, None, None, tuple(findings))
        if not is_given(motion):
            assumed = self.rules.assumed
            word = "" if motion.speed is None else motion.speed.text
            findings.append(
                found_in.SpeedNotGiven(assumed.joint_share, "share", word)
                if motion.kind == "joint"
                else found_in.SpeedNotGiven(assumed.tool_speed, "m/s", word)
            )
        timed = motion.speed is not None and motion.speed.unit == "s"
        if motion.acceleration is not None and motion.acceleration.value == 0 and not timed:
            findings.append(found_in.AccelerationNotKnown(motion.acceleration.text))
        for each in motion.turning:
            if each is not None and each.acceleration is not None and each.acceleration.value == 0:
                findings.append(found_in.AccelerationNotKnown(each.acceleration.text))
        if before is None:
            findings.append(found_in.PathNotKnown())
            findings += () if goal.joints is None else limit_findings(placed.arm, goal.joints)
            return CheckedMotion(motion.kind, placed, None, None, goal.joints, tuple(findings))
        if motion.kind == "joint":
            move = self._joint_move(placed, goal, before, findings)
            return self._measured(move) if measured else move
        return self._tool_move(placed, goal, before, findings)

    def _joint_move(
        self, placed: PlacedMotion, goal: Goal, before: Reals, findings: list[found_in.CheckFinding]
    ) -> CheckedMotion:
        findings += [each for each in placed.missing if each not in findings]
        if goal.joints is None:
            return CheckedMotion("joint", placed, before, None, None, tuple(findings))
        way = joint_motion_path(placed.arm, placed.motion, before, goal.joints, self.rules)
        if way is None:
            return self._standing(
                CheckedMotion("joint", placed, before, None, goal.joints, tuple(findings), stays=True)
            )
        found = (*findings, *way.findings)
        beyond = np.maximum(goal.joints - placed.arm.upper, placed.arm.lower - goal.joints).max()
        if beyond > TURN:  # no arm gets there, and nothing goes on from there
            return CheckedMotion("joint", placed, before, None, None, found, moments=way.moments)
        return CheckedMotion("joint", placed, before, way, way.end, found, moments=way.moments)

    def _tool_move(
        self, placed: PlacedMotion, goal: Goal, before: Reals, findings: list[found_in.CheckFinding]
    ) -> CheckedMotion:
        kind = placed.motion.kind
        if placed.missing:
            said = tuple(dict.fromkeys((*findings, *placed.needed)))
            return CheckedMotion(kind, placed, before, None, goal.joints, said)
        end = goal.pose
        given = None
        if end is None:
            assert goal.joints is not None
            given = goal.joints
            end = forward(placed.arm, given)
        via = self._via(placed, before) if kind == "arc" else None
        if kind == "arc" and via is None:
            return CheckedMotion(kind, placed, before, None, goal.joints, (*findings, found_in.ArcHasNoCircle()))
        if placed.motion.angle is not None:  # it goes elsewhere
            findings = [each for each in findings if not isinstance(each, found_in.TargetOutOfReach)]
            turns = bool(np.abs(end[:3, :3] - forward(placed.arm, before)[:3, :3]).max() > SAME_JOINTS)
            findings.append(found_in.ArcGoesOn(float(np.degrees(placed.motion.angle)), turns))
            given = None
        way = tool_motion_path(placed.arm, placed.motion, before, (end, given, via), self.rules)
        if way is None:
            return self._standing(CheckedMotion(kind, placed, before, None, before, tuple(findings), stays=True))
        if not isinstance(way, MotionPath):
            return CheckedMotion(kind, placed, before, None, goal.joints, (*findings, way))
        if any(isinstance(each, found_in.StretchOutOfReach) for each in way.findings):
            findings = [each for each in findings if not isinstance(each, found_in.TargetOutOfReach)]
        seen = (*findings, *way.findings)
        target = placed.motion.target
        if isinstance(target, instructions.PoseTarget) and target.branch is not None and way.end is not None:
            arrived = solutions_meant(target.branch, way.arm, way.end[None])[0]
            seen += () if arrived else (_branch_not_met(target, joint=False),)
        return self._measured(CheckedMotion(kind, placed, before, way, way.end, seen, moments=way.moments))

    def _via(self, placed: PlacedMotion, before: Reals) -> Reals | None:
        """The arc's point: T_world_tool (4, 4), m."""
        target = placed.motion.via
        if isinstance(target, instructions.PoseTarget) and placed.base is not None:
            pose: Reals = placed.base @ target.pose
            return pose
        if isinstance(target, instructions.JointTarget):
            return forward(placed.arm, np.where(np.isnan(target.joints), before, target.joints))
        return None

    def _measured(self, motion: CheckedMotion) -> CheckedMotion:
        """The motion with its clearance and collisions."""
        way = motion.way
        if self.obstacles is None or way is None or not np.isfinite(way.q).any():
            return motion
        bodies = self.obstacles.of(way.arm)
        ends = way.t[[0, -1]]
        along = clearance_along(bodies, way.joints, way.rates, way.t, ends, self.obstacles.tolerance)
        clearance = float(along.distance[along.closest]) if along.closest >= 0 else None
        if not along.contacts:
            return self._clear(replace(motion, clearance=clearance), along)
        touches: dict[Pair, found_in.BodiesTouch] = {}
        reached = way.q[-1:][np.isfinite(way.q[-1:]).all(axis=1)]  # no row, if the motion ends out of reach
        at_target = {bodies.pairs[k] for k in np.flatnonzero(bodies.overlaps(reached).any(axis=0))}
        for touch in (each for contact in along.contacts for each in contact.touches):  # in the order of time
            at = None if motion.kind == "joint" else way.along_mm(touch.start)
            first = touches.get(
                touch.pair, found_in.BodiesTouch(touch.pair, touch.start, at, 0.0, touch.pair in at_target)
            )
            touches[touch.pair] = replace(first, depth_mm=max(first.depth_mm, touch.depth * 1000))
        hit = self.obstacles.hit(way.arm, touches.values())
        moments = {**motion.moments, hit: along.contacts[0].start}
        return replace(motion, findings=(*motion.findings, hit), clearance=clearance, moments=moments)

    def _standing(self, motion: CheckedMotion) -> CheckedMotion:
        """A motion that leaves the arm where it is, with the limits it is beyond and what it touches there."""
        q, arm = motion.start, motion.placed.arm
        assert q is not None
        found: list[found_in.CheckFinding] = [each for each in limit_findings(arm, q) if each not in motion.findings]
        clearance = None
        if self.obstacles is not None:
            bodies, margin = self.obstacles.of(arm), self.obstacles.assumed_margin
            distances = bodies.counted(bodies.distances(q, np.arange(len(bodies.pairs))))
            nearest = int(distances.argmin()) if len(distances) else -1
            clearance = float(distances[nearest]) if nearest >= 0 and np.isfinite(distances[nearest]) else None
            touching = np.flatnonzero(distances < 0)
            touches = [found_in.BodiesTouch(bodies.pairs[k], 0.0, None, -1000 * distances[k], True) for k in touching]
            if touches:
                found.append(self.obstacles.hit(arm, touches))
            elif clearance is not None and clearance < margin:
                found.append(found_in.ClearOfAssumed(bodies.pairs[nearest], 1000 * clearance, 1000 * margin))
        moments = {**motion.moments, **dict.fromkeys(found, 0.0)}
        return replace(motion, findings=(*motion.findings, *found), clearance=clearance, moments=moments)

    def _clear(self, motion: CheckedMotion, along: ClearanceAlong) -> CheckedMotion:
        """A collision-free motion, with a finding where it comes near assumed shapes."""
        assert self.obstacles is not None
        margin = self.obstacles.assumed_margin
        pair = along.pair[along.closest] if along.closest >= 0 else None
        if pair is None or motion.clearance is None or motion.clearance >= margin:
            return motion
        near = found_in.ClearOfAssumed(pair, 1000 * motion.clearance, 1000 * margin)
        moments = {**motion.moments, near: float(along.t[along.closest])}
        return replace(motion, findings=(*motion.findings, near), moments=moments)

    def _corner(self, before: tuple[int, bool], second: int) -> None:
        """Check the corner between two motions if a zone rounds it; ``before`` as of :meth:`_after`."""
        first, may_stop = before
        if first < 0:
            return
        motion = self.motions[first]
        if motion.placed.motion.zone.kind == "fine":
            return
        self._add(first, self._corner_findings(motion, self.motions[second]))
        for number in () if may_stop else (first, second):
            blended = self.motions[number]
            self.motions[number] = replace(blended, blended_ends=min(blended.blended_ends + 1, 2))

    def _corner_findings(self, motion: CheckedMotion, after: CheckedMotion) -> list[found_in.CheckFinding]:
        """Findings on the corner between two motions if a zone rounds it."""
        zone = motion.placed.motion.zone
        findings: list[found_in.CheckFinding] = []
        entry = after.placed.motion.entry if zone.kind == "share" else None
        if zone.kind in ("named", "velocity") or (entry is not None and entry.kind == "named"):
            findings.append(found_in.ZoneWithoutSize(zone.text))
        if zone.kind != "fine" and motion.way is not None and after.way is not None:
            findings += self._rounded(motion.way, after.way, motion, entry)
        return findings

    def _round_corner(
        self, way: MotionPath, after: MotionPath, corners: Reals, shares: tuple[float, float], margin: float = 0.0
    ) -> found_in.ZoneCollides | found_in.ZoneNotSettled | None:
        """Collisions round a corner with joints (3, n), rad: where the zone begins, at the corner, where it ends."""
        assert self.obstacles is not None
        bodies, tolerance = self.obstacles.of(way.arm), self.obstacles.tolerance
        if way.tool_path is None or after.tool_path is None or way.arm is not after.arm:
            bend = _bend(way, 1 - shares[0], 1.0) + _bend(after, 0.0, shares[1])
            return zone_clearance(bodies, corners, tolerance, bend, margin=margin)
        before, then = way.sagitta(shares[0]), after.sagitta(shares[1])
        slack = max(before[0], then[0]), max(before[1], then[1])
        return zone_clearance(bodies, corners, tolerance, patch=patch_of(way.arm, corners, slack), margin=margin)

    def _rounded(
        self, way: MotionPath, after: MotionPath, motion: CheckedMotion, entry: instructions.Zone | None
    ) -> tuple[found_in.CheckFinding, ...]:
        key = (id(way), id(after), entry)
        if key not in self._corners:
            self._corners[key] = self._zone_findings(way, after, motion, entry)
        return self._corners[key]

    def _zone_findings(
        self, way: MotionPath, after: MotionPath, motion: CheckedMotion, entry: instructions.Zone | None
    ) -> tuple[found_in.CheckFinding, ...]:
        """``entry``: how much of the second motion the corner may take, if not as much as the zone says."""
        zone = motion.placed.motion.zone
        shares = [_zone_share(zone, part) for part in (way, after)]
        if entry is not None and entry.kind != "named":
            shares[1] = max(shares[1], _zone_share(entry, after))
        found: list[found_in.CheckFinding] = []
        if zone.kind == "distance" and max(shares) > MAX_MOTION_SHARE + TOLERANCE:
            found.append(found_in.ZoneTooLarge(zone.value * 1000, min(way.length, after.length) * 1000))
        if self.obstacles is None or motion.clearance is None or motion.clearance < 0:
            return tuple(found)
        share_before, share_after = (
            max(min(share, MAX_MOTION_SHARE), _share_near(zone, part, at_end))
            for share, part, at_end in zip(shares, (way, after), (True, False))
        )
        corners = np.stack(
            [
                way.joints_at(np.array(1 - share_before)),
                way.joints_at(np.array(1.0)),
                after.joints_at(np.array(share_after)),
            ]
        )
        if np.isfinite(corners).all():
            hit = self._round_corner(way, after, corners, (share_before, share_after))
            margin = self.obstacles.assumed_margin
            if isinstance(hit, found_in.ZoneCollides):
                found.append(replace(hit, assumed=arm_shapes(way.arm).assumed))
            elif hit is not None:
                found.append(hit)
            elif 0 < margin <= motion.clearance:
                near = self._round_corner(way, after, corners, (share_before, share_after), margin)
                if isinstance(near, found_in.ZoneCollides):
                    found.append(found_in.ClearOfAssumed(near.pair, -near.depth_mm, 1000 * margin))
                elif near is not None:
                    found.append(near)
        return tuple(found)


def _apart(a: Reals | None, b: Reals | None) -> bool:
    """Whether joints (n,), rad, that are known both, differ."""
    return a is not None and b is not None and bool(np.abs(a - b).max() > SAME_JOINTS)


def _is_lost(what: instructions.Instruction) -> bool:
    """Whether it is not known where the arm is after an instruction."""
    return (isinstance(what, instructions.Unknown) and what.may_move) or (
        isinstance(what, instructions.MovesBeside) and what.kind != "interrupt"
    )


def _bend(way: MotionPath, first: float, last: float) -> Reals:
    """By how much joints (n,) leave the straight way between two shares of a motion, rad; 0 in a joint move."""
    if way.tool_path is None:
        return np.zeros(way.q.shape[1])
    q = way.joints_at(np.linspace(first, last, BEND_PARTS + 1))
    return bend_of_line(way.arm, q, way.sagitta((last - first) / BEND_PARTS))


def _zone_share(zone: instructions.Zone, way: MotionPath) -> float:
    """The share of a way that a zone may take; over one half where the zone is larger than that."""
    match zone.kind:
        case "distance":
            return zone.value / way.length if way.length > TOLERANCE else MAX_MOTION_SHARE
        case "angle":
            return min(zone.value / way.turned, MAX_MOTION_SHARE) if way.turned > TOLERANCE else MAX_MOTION_SHARE
        case "share":
            return min(zone.value, 1.0) * MAX_MOTION_SHARE
    return MAX_MOTION_SHARE


def _share_near(zone: instructions.Zone, way: MotionPath, at_end: bool) -> float:
    """The share of a joint move, at most half, on which the tool is within its zone's distance of the corner."""
    if zone.kind != "distance" or way.tool_path is not None:
        return 0.0
    shares = np.linspace(0.0, MAX_MOTION_SHARE, NEAR_PARTS)
    points = forward(way.arm, way.joints_at(1 - shares if at_end else shares))[:, :3, 3]
    beyond = np.flatnonzero(np.linalg.norm(points - points[0], axis=1) > zone.value)
    return float(shares[beyond[0]]) if beyond.size else MAX_MOTION_SHARE


def _vias(arm: Robot, start: Reals, end: Reals) -> Reals:
    """Joints (k, n) in rad between a start and an end, with one or two of those after the first turned away."""
    middle = (start + end) / 2
    turns = [(1, 0), (-1, 0), (0, 1), (0, -1), (-1, -1), (1, 1), (-1, 1), (1, -1)]
    away = np.zeros((len(VIA_TURNS) * len(turns), len(middle)))
    away[:, 1:3] = np.radians(np.kron(np.array(VIA_TURNS)[:, None], turns))[:, : len(middle) - 1]
    return _as_written(np.clip(middle + away, arm.lower, arm.upper))


def _good(motion: CheckedMotion) -> bool:
    """Whether a motion has a way and no finding more severe than a note."""
    worst = found_in.worst_of(found_in.level_of(each) for each in motion.findings)
    return motion.way is not None and worst in ("pass", "note")


def _as_written(q: Reals) -> Reals:
    """Joint angles (..., n) in rad, rounded to 0.001 deg, as reports state them."""
    found: Reals = np.radians(np.round(np.degrees(q), 3))
    return found


LIKE_TURNS = np.radians(30.0)


def _turns(arm: Robot, start: Reals, ends: Reals) -> Reals:
    """The largest turn (k,), rad, of the tool from where it is, on joint moves to ``ends`` (k, n)."""
    share = np.linspace(0, 1, 33)[:, None, None]
    R = forward(arm, start + share * (ends - start))[..., :3, :3]
    found: Reals = rotation_angle(R[0], R).max(axis=0)
    return found


def _said(motion: instructions.ArmMotion) -> list[found_in.CheckFinding]:
    """Findings on a motion that do not depend on the arm."""
    found: list[found_in.CheckFinding] = []
    outer = {name: None for each in (motion.target, motion.via) for name, _ in getattr(each, "external", ())}
    if outer:
        found.append(found_in.ExternalAxesLeftOut(tuple(outer)))
    rates = [rate.value for rate in (motion.speed, motion.acceleration) if rate is not None and rate.unit == "share"]
    if rates and max(rates) > 1 + TOLERANCE:
        found.append(found_in.MoreThanFullSpeed(100 * max(rates)))
    if motion.kind == "spline" or (motion.kind == "joint" and motion.spline_block is not None):
        found.append(found_in.SplineAsLine())
    if motion.left_out:
        found.append(found_in.PositionCompleted(motion.left_out))
    if motion.turn_in_doubt:
        found.append(found_in.RelativeTurnAssumed(math.degrees(motion.turn_in_doubt)))
    if motion.turns:
        found.append(found_in.TurnNotFollowed(motion.turns))
    if motion.doubt:
        found.append(found_in.FramesInDoubt(motion.doubt))
    return found


def _key(motion: instructions.ArmMotion) -> Hashable:
    """A key that is equal for motions with the same numbers."""
    targets = tuple(_target_key(each) for each in (motion.target, motion.via))
    frames = tuple(
        (each.name, None if each.pose is None else each.pose.tobytes()) for each in (motion.tool, motion.base)
    )
    rates = (motion.speed, motion.turn_speed, motion.turning, motion.acceleration)
    return (
        motion.kind,
        motion.form,
        motion.spline_block is None,
        targets,
        motion.angle,
        rates,
        motion.zone,
        frames,
        motion.load,
        motion.left_out,
        motion.doubt,
        motion.turn_in_doubt,
        motion.with_path,
        motion.turns,
    )


def _target_key(target: instructions.Target | None) -> Hashable:
    match target:
        case instructions.JointTarget():
            return (target.joints.tobytes(), target.external)
        case instructions.PoseTarget():
            near = None if target.near is None else target.near.tobytes()
            return (target.pose.tobytes(), target.configuration, target.branch is None, near, target.external)
    return target
