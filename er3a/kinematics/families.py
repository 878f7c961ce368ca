"""Self-motions of arms with a spherical wrist: continua of joint solutions of one pose.

There are three kinds, each a line or curve of solutions in joint space:

- *wrist*: axes 4 and 6 in one line; joints 4 and 6 turn against each other, a straight line;
- *shoulder*: the wrist centre on axis 1; joint 1 turns and the wrist follows;
- *elbow*: upper arm and forearm of equal length folded onto each other; joint 2 turns and the wrist follows.

Solutions with axes 4 and 6 in one line, in which joints 4 and 6 can turn against each other.

The closed form alone does not show them all. Where the arm is nearly straight, rounding moves the elbow by 1e-8 rad
without moving the wrist centre, and with it axis 4; where the wrist centre is on axis 1 (or 2), that joint is free and
only one of its angles may put the axes in line. So joint 5 is set to where they are in line, and joints 1, 2, 3 and 6
compensate for it by least squares.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from er3a.by_value import ByValue, Displayed, Sheet, frozen, shortly
from er3a.geometry.transforms import skew_part
from er3a.geometry.vectors import TURN, signed_angle, wrap_to_pi
from er3a.kinematics.chain import arm_length
from er3a.kinematics.closed_form import BOUNDARY_M, SLOTS
from er3a.kinematics.forward import forward, frames, jacobian
from er3a.kinematics.self_motions import last_within, line_of, place_of_least
from er3a.kinematics.singularity import SingularityType, determinant_factors
from er3a.kinematics.wrist_partitioned import solve_slots, wrist_partitioned_arm
from er3a.numerics.arrays import Reals
from er3a.numerics.jit import kernel
from er3a.robots.joint_limits import nearest_equivalent, within
from er3a.robots.robot import Robot, derived
from er3a.robots.whole_turns import LIMIT_TOLERANCE, whole_turns

SOLVES_M = SOLVES_RAD = 0.9e-9  # a family is given where it solves the pose to 1e-9, rounding included
ALMOST_IN_LINE = 1e-3  # sine between axes 4 and 6 beyond which no small motion aligns them
NO_DIRECTION = 1e-13  # sine between two axes below which their common normal is rounding
MOVING = [0, 1, 2, 5]  # joints that make up for joint 5; joint 4 would only turn with joint 6
REGULAR_RAD, REGULAR_M = 0.05, 1e-3
MAX_STEPS, ROUNDING, SETTLED, INDEPENDENT = 8, 1e-14, 0.01, 1e-9


def aligned_arms(robot: Robot, T: Reals, q: Reals) -> Iterator[tuple[tuple[int, int], Reals]]:
    """Arms that solve a pose to 1e-9 m and rad with an aligned wrist.

    Parameters
    ----------
    T : (4, 4), m
    q : (8, 6), rad, its closed-form solutions, NaN where a slot has none

    Yields
    ------
    pair : the two wrist slots it belongs to
    q : (6,), rad
    """
    for first in range(0, len(q), 2):
        row = q[first] if np.isfinite(q[first, 0]) else q[first + 1]
        if not np.isfinite(row[0]):
            continue
        candidates = [row, *_turned_about(robot, T, row, 0, first)]
        if arm_folds_fully(robot):
            candidates += _turned_about(robot, T, row, 1, first)
        for candidate in candidates:
            if (arm := _in_line(robot, T, candidate)) is not None:
                yield (first, first + 1), arm


def bend_of_wrist(robot: Robot, q: Reals) -> Reals:
    """By how much joint 5 is away from where axes 4 and 6 are in line.

    Parameters
    ----------
    q : (..., 6), rad

    Returns
    -------
    bend : (...), rad, signed, -pi/2 to pi/2, in the sense of the table's theta
    """
    arm = wrist_partitioned_arm(robot)
    w = [tuple(axis) for axis in arm.axes.tolist()]
    bend: Reals = robot.direction[4] * q[..., 4] + robot.offset[4] + signed_angle(w[3], w[5], w[4])
    return bend - np.pi * np.round(bend / np.pi)


def wrist_line(robot: Robot, q: Reals) -> tuple[Reals, Reals]:
    """The line of solutions through an arm with its wrist aligned.

    Parameters
    ----------
    q : (6,), rad, nearly aligned

    Returns
    -------
    q : (6,), rad, with axes 4 and 6 exactly in line
    direction : (6,), rad per rad of joint 4, whose turn joint 6 undoes
    """
    q = q.copy()
    q[4] -= robot.direction[4] * bend_of_wrist(robot, q)
    T = frames(robot, q)
    same = np.sign(T[3, :3, 2] @ T[5, :3, 2]) * robot.direction[3] * robot.direction[5]
    return q, np.array([0, 0, 0, 1.0, 0, -same])


def wrist_centre_on_axis(robot: Robot, T: Reals, q: Reals, joint: int) -> Reals:
    """The pose shifted so that the wrist centre lies on the axis of joint 1 or 2.

    Parameters
    ----------
    T : (4, 4), m
    q : (6,), rad, an arm that nearly does so
    joint : 0 or 1

    Returns
    -------
    T : (4, 4), m, a copy
    """
    arm = wrist_partitioned_arm(robot)
    axis = frames(robot, q)[joint]
    away = T[:3, :3] @ arm.wrist_in_tool + T[:3, 3] - axis[:3, 3]
    moved = T.copy()
    moved[:3, 3] -= away - axis[:3, 2] * (axis[:3, 2] @ away)
    return moved


@derived
def arm_folds_fully(robot: Robot) -> bool:
    """Whether upper arm and forearm are equally long, so that the wrist centre can lie on axis 2.

    Parameters
    ----------
    robot : with a spherical wrist

    Returns
    -------
    folds : to 1e-9 m
    """
    arm = wrist_partitioned_arm(robot)
    return abs(arm.upper_arm_length - arm.forearm_length) < BOUNDARY_M


def _turned_about(robot: Robot, T: Reals, q: Reals, joint: int, slot: int) -> list[Reals]:
    """With the wrist centre on the axis of joint 1 or 2: arms with axes 4 and 6 at the same angle about it."""
    moved = wrist_centre_on_axis(robot, T, q, joint)
    if np.linalg.norm(moved[:3, 3] - T[:3, 3]) >= SOLVES_M:
        return []
    arm = wrist_partitioned_arm(robot)
    placed = frames(robot, q)
    axis, axis_4 = tuple(placed[joint, :3, 2].tolist()), tuple(placed[3, :3, 2].tolist())
    axis_6 = tuple((T[:3, :3] @ arm.tool_rotation.T @ arm.axes[5]).tolist())
    if np.linalg.norm(np.cross(axis, axis_6)) < NO_DIRECTION:
        return []
    turn = signed_angle(axis_4, axis_6, axis)
    reference = np.tile(q, (2, 1))
    reference[:, joint] += robot.direction[joint] * np.array([turn, turn + np.pi])
    return list(solve_slots(robot, np.broadcast_to(moved, (2, 4, 4)), reference)[0][:, slot])


def _in_line(robot: Robot, T: Reals, q: Reals) -> Reals | None:
    """The arm with its wrist put in line and joints 1, 2, 3 and 6 moved to compensate; None if it misses the pose.

    At a fold these joints move the tool in second order only, which least squares can solve.
    """
    arm = wrist_partitioned_arm(robot)
    w = [tuple(axis) for axis in arm.axes.tolist()]
    axis_6, axis_4 = T[:3, :3] @ arm.tool_rotation.T @ arm.axes[5], frames(robot, q)[3, :3, 2]
    if np.linalg.norm(np.cross(axis_4, axis_6)) > ALMOST_IN_LINE:
        return None
    folded = 0.0 if axis_4 @ axis_6 > 0 else np.pi
    q = q.copy()
    q[4] = robot.direction[4] * (folded - signed_angle(w[3], w[5], w[4]) - robot.offset[4])
    best, smallest, before = None, SOLVES_M, np.inf
    for _ in range(MAX_STEPS):
        reached = forward(robot, q)
        turn = skew_part(T[:3, :3] @ reached[:3, :3].T)  # a small one, so its sine will do
        miss = np.append(T[:3, 3] - reached[:3, 3], np.multiply(turn, 0.5))
        far = float(max(np.linalg.norm(miss[:3]), np.linalg.norm(miss[3:])))
        if far < smallest:
            best, smallest = q.copy(), far
        if far < ROUNDING or abs(far - before) < SETTLED * far:
            break
        before = far
        q[MOVING] += np.linalg.lstsq(jacobian(robot, q)[:, MOVING], miss, rcond=INDEPENDENT)[0]
    return best


GRID = np.radians(2.0)  # of the free joint, on which its limits are first looked at
SAME_FAMILY = 1e-6  # rad; next to two singularities families that solve a pose to 1e-9 differ by no more
SAME_CURVE = SAME_FAMILY * np.array([1, 1, 0.2, 1, 1, 1])  # rounding makes the roots of one elbow differ by no more
FREE_MOTION = 1e-7  # singular value below which joints move with the tool at rest
CURVES: tuple[tuple[SingularityType, int, int], ...] = (("shoulder", 4, 0), ("elbow", 2, 1))  # step in slots, joint
FREE_JOINT: dict[SingularityType, int] = {"shoulder": 0, "elbow": 1}


@frozen
class Family(ByValue, Displayed):
    """A continuum of solutions of one pose.

    For kind *wrist* its members are ``q0 + t * direction``. For the others joint 1 (*shoulder*) or 2 (*elbow*) is that
    of q0 plus t and the wrist follows on a curve with the tangent ``direction`` at q0;
    :meth:`members` gives both.

    Attributes
    ----------
    kind : wrist, shoulder or elbow
    q0 : (6,), rad, the member nearest to the reference (Euclidean norm), within the limits if any is
    direction : (6,), rad per rad of t
    range : (2,), rad, smallest and largest t whose members stay within the limits, all between them too; a full circle
        if no member is within them
    within_limits : whether any member is
    branches : slots that the family belongs to
    """

    kind: SingularityType
    q0: Reals
    direction: Reals
    range: Reals
    within_limits: bool
    branches: tuple[int, ...]
    robot: Robot
    T: Reals

    @cached_property
    def dimension(self) -> int:
        """Degrees of freedom of the joints at most members with the tool at rest; 2 on a surface of solutions.

        A surface is given by its curves through q0 alone.
        """
        J = jacobian(self.robot, self.members(np.linspace(float(self.range[0]), float(self.range[1]), 5)))
        J[:, :3] /= arm_length(self.robot)
        values = np.linalg.svd(J, compute_uv=False)
        return int(np.median((values < FREE_MOTION).sum(axis=1)))

    def holds(self, q: Reals) -> bool:
        """Whether joint values are a member of a curve within its range, turns of other joints aside.

        Parameters
        ----------
        q : (6,), rad

        Returns
        -------
        member : False for the lines of a wrist
        """
        if self.kind == "wrist":
            return False
        t = q[FREE_JOINT[self.kind]] - self.q0[FREE_JOINT[self.kind]]
        if not self.range[0] - SAME_FAMILY <= t <= self.range[1] + SAME_FAMILY:
            return False
        return bool((np.abs(wrap_to_pi(self.members(t) - q)) < SAME_CURVE).all())

    def members(self, t: Reals) -> Reals:
        """Members of the family.

        Parameters
        ----------
        t : (...), rad

        Returns
        -------
        q : (..., 6), rad
        """
        t = np.asarray(t, float)
        if self.kind == "wrist":
            return self.q0 + t[..., None] * self.direction
        joint = FREE_JOINT[self.kind]
        q = _on_curve(self.robot, self.T, joint, self.q0[joint] + t.reshape(-1), self.q0, self.branches[0])
        q = nearest_equivalent(self.robot, nearest_wrists(self.robot, q, self.q0), self.q0)
        q[:, joint] = self.q0[joint] + t.reshape(-1)
        return q.reshape(*t.shape, 6)

    def sheet(self) -> Sheet:
        """A line for printing: kind, range (deg) and the nearest member (deg).

        Returns
        -------
        sheet : without rows
        """
        return line_of(self, f"Family {self.kind}", f"q0_deg {shortly(tuple(np.degrees(self.q0).tolist()))}")


def families(robot: Robot, T: Reals, q: Reals, q_ref: Reals) -> tuple[Family, ...]:
    """All continua that solve a pose to 1e-9 m and rad.

    Parameters
    ----------
    T : (4, 4), m
    q : (8, 6), rad, its closed-form solutions, NaN where a slot has none
    q_ref : (6,), rad

    Returns
    -------
    families : nearest to the reference first within each kind
    """
    found: list[Family] = []
    for pair, on_line in aligned_arms(robot, T, q):
        _add(found, _wrist_families(robot, T, on_line, q_ref, pair))
    solved, slots = np.isfinite(q[:, 0]), np.arange(SLOTS)
    for kind, step, joint in CURVES:
        for slot in slots[(slots // step % 2 == 0) & solved]:
            moved = wrist_centre_on_axis(robot, T, q[slot], joint)
            if np.linalg.norm(moved[:3, 3] - T[:3, 3]) < SOLVES_M and (joint == 0 or arm_folds_fully(robot)):
                _add(found, _curve_families(robot, moved, kind, q_ref, (int(slot), int(slot) + step)))
    return tuple(found)


def is_regular(robot: Robot, q: Reals) -> bool:
    """Whether all solutions of a pose are so far from singular poses that no joint can move with the tool at rest.

    Parameters
    ----------
    q : (8, 6), rad, its closed-form solutions, NaN where a slot has none

    Returns
    -------
    regular : by the factors of the Jacobian's determinant, far beyond where two branches or a family could meet
    """
    factors = determinant_factors(robot, q)
    return _away(factors.wrist, factors.elbow, factors.shoulder, arm_folds_fully(robot))


@kernel
def _away(wrist: Reals, elbow: Reals, shoulder: Reals, folds: bool) -> bool:
    """Whether factors (N,) are away from 0, the elbow's (rad, in half a turn) only where the arm folds fully."""
    away = True
    for k in range(len(wrist)):
        near = abs(wrist[k]) < REGULAR_RAD or abs(shoulder[k]) < REGULAR_M
        bent = abs(elbow[k] - np.pi * np.round(elbow[k] / np.pi))
        away &= not (near or (folds and bent < REGULAR_RAD))
    return away


def _add(found: list[Family], new: list[Family]) -> None:
    """Add families that are new; of one that is known the branches are joined."""
    for family in new:
        for k, known in enumerate(found):
            most = SAME_FAMILY if family.kind == "wrist" else SAME_CURVE
            same = known.kind == family.kind and bool((np.abs(known.q0 - family.q0) < most).all())
            if known.kind == family.kind and known.holds(family.q0):
                same = True
            elif same:
                same = bool(np.abs(known.direction - family.direction).max() < SAME_FAMILY)
            if same:
                both = tuple(sorted({*known.branches, *family.branches}))
                found[k] = replace(known, branches=both)
                break
        else:
            found.append(family)


def _wrist_families(robot: Robot, T: Reals, q: Reals, q_ref: Reals, branches: tuple[int, ...]) -> list[Family]:
    """One family for each sum (or difference) of joints 4 and 6 that the limits admit; one where either of them turns
    without end."""
    q, direction = wrist_line(robot, q)
    rest = nearest_equivalent(robot, q, q_ref)
    rest[[3, 5]] = q[[3, 5]] + TURN * np.round((q_ref - q) / TURN)[[3, 5]]
    limits, families = whole_turns(robot), []
    rates, endless = limits.lines @ direction, bool(robot.continuous[[3, 5]].any())
    moved = rates != 0
    most = int(np.ceil((robot.upper - robot.lower)[[3, 5]].sum() / TURN)) + 2
    # Whole turns of joint 6 against joint 4 are other lines of the same poses.
    for k in range(-most, most + 1):
        start = rest + TURN * k * np.eye(6)[5]
        smallest, greatest = limits.lower - limits.lines @ start, limits.upper - limits.lines @ start
        if (smallest > LIMIT_TOLERANCE)[~moved].any() or (greatest < -LIMIT_TOLERANCE)[~moved].any():
            continue
        ends = np.sort(np.stack([smallest[moved], greatest[moved]]) / rates[moved], axis=0)
        nearest = _nearest_on_line(start, direction, q_ref)
        low, high = float(ends[0].max()), float(ends[1].min())
        if np.isinf(high - low):  # nothing ends it: one lap
            low, high = nearest - TURN / 2, nearest + TURN / 2
        if low <= high + LIMIT_TOLERANCE:
            high = max(low, high)
            t = float(np.clip(nearest, low, high))
            span = np.array([low - t, high - t])
            families.append(Family("wrist", start + t * direction, direction, span, True, branches, robot, T))
    if not families:
        t = _nearest_on_line(rest, direction, q_ref)
        span = np.array([-np.pi, np.pi])
        families = [Family("wrist", rest + t * direction, direction, span, False, branches, robot, T)]
    families.sort(key=lambda family: float(np.linalg.norm(family.q0 - q_ref)))
    return families[:1] if endless else families


def _nearest_on_line(q: Reals, direction: Reals, q_ref: Reals) -> float:
    """The parameter of the point of a line nearest to a reference."""
    return float((q_ref - q) @ direction / (direction @ direction))


def _on_curve(robot: Robot, T: Reals, joint: int, values: Reals, q_ref: Reals, slot: int) -> Reals:
    """Solutions (n, 6) of one slot with the free joint at given angles (n,)."""
    reference = np.tile(q_ref, (len(values), 1))
    reference[:, joint] = values
    return solve_slots(robot, np.broadcast_to(T, (len(values), 4, 4)), reference, keep_folds=True)[0][:, slot]


def _curve_families(
    robot: Robot, T: Reals, kind: SingularityType, q_ref: Reals, branches: tuple[int, ...]
) -> list[Family]:
    """One for each part of the free joint's range in which the limits are kept, nearest to the reference first; one for
    the whole of it if they are kept nowhere."""
    joint, slot = FREE_JOINT[kind], branches[0]
    low, high = robot.lower[joint], robot.upper[joint]
    if robot.continuous[joint]:
        low, high = q_ref[joint] - TURN / 2, q_ref[joint] + TURN / 2
    grid = np.arange(low, high + GRID, GRID)
    grid = np.unique(np.append(np.minimum(grid, high), np.clip(q_ref[joint], low, high)))

    def members(values: Reals) -> Reals:
        q = nearest_wrists(robot, _on_curve(robot, T, joint, values, q_ref, slot), q_ref)
        q = nearest_equivalent(robot, q, q_ref)
        q[:, joint] = values
        return q

    def costs(q: Reals) -> Reals:
        return np.where(within(robot, q) | (not any_inside), np.sum((q - q_ref) ** 2, axis=1), np.inf)

    q = members(grid)
    inside = within(robot, q)
    any_inside = bool(inside.any())
    parts = [np.arange(len(grid))]
    if any_inside:
        parts = np.split(np.arange(len(grid)), np.flatnonzero(np.diff(inside)) + 1)
        parts = [part for part in parts if inside[part[0]]]
    found: list[Family] = []
    for part in parts:
        best = int(part[costs(q[part]).argmin()])
        q0 = members(np.array([place_of_least(lambda values: costs(members(values)), grid, best)]))[0]
        family = Family(kind, q0, _tangent(robot, q0, joint), np.zeros(2), any_inside, branches, robot, T)
        found.append(replace(family, range=_range(family, grid) if any_inside else np.array([-np.pi, np.pi])))
    return sorted(found, key=lambda family: float(np.linalg.norm(family.q0 - q_ref)))


def nearest_wrists(robot: Robot, q: Reals, q_ref: Reals) -> Reals:
    """Rows with an aligned wrist, moved along their line to the member nearest to a reference.

    Parameters
    ----------
    q : (n, 6), rad, changed in place
    q_ref : (6,), rad

    Returns
    -------
    q : (n, 6), rad, the same array
    """
    for row in np.flatnonzero(np.abs(bend_of_wrist(robot, q)) < SOLVES_RAD):
        on_line, direction = wrist_line(robot, q[row])
        axis_4, axis_6 = frames(robot, on_line)[[3, 5], :3, 2]
        if np.linalg.norm(np.cross(axis_4, axis_6)) > SOLVES_RAD:  # an oblique wrist is never in line
            continue
        on_line = q_ref + wrap_to_pi(on_line - q_ref)
        q[row] = on_line + _nearest_on_line(on_line, direction, q_ref) * direction
    return q


def _tangent(robot: Robot, q: Reals, joint: int) -> Reals:
    """Joint rates that leave the tool at rest while the free joint turns at rate 1: the wrist undoes its rotation."""
    spin = jacobian(robot, q)[3:]
    direction = np.zeros(6)
    direction[joint] = 1.0
    held = spin[:, joint]
    direction[3:] = -np.linalg.lstsq(spin[:, 3:], held, rcond=1e-9)[0]
    return direction


def _range(family: Family, grid: Reals) -> Reals:
    """Ends of the connected part within the limits around q0, by the grid and bisection."""
    joint = FREE_JOINT[family.kind]
    steps = grid - family.q0[joint]
    inside = within(family.robot, family.members(steps))
    ends = []
    for side in (-1, 1):
        outward = steps[steps * side > 0][::side]
        ok = inside[steps * side > 0][::side]
        if ok.all():
            ends.append(outward[-1] if len(outward) else 0.0)
            continue
        ends.append(last_within(family.robot, family.members, outward, ok))
    return np.array(ends)
