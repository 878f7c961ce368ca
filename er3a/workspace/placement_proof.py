"""Proof that a box can be served: every point of it, every direction of the cone.

The box times the cone is split into bricks with patches of directions until one branch and roll is good for each whole
piece (:mod:`interval_inverse`), or the middle of a piece turns out to be out of reach.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from er3a.kinematics.block_inverse import BlockConstants
from er3a.kinematics.closed_form import SLOTS
from er3a.kinematics.wrist_partitioned import constants_for_blocks
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.jit import inner_kernel, kernel
from er3a.robots.robot import Robot
from er3a.workspace.cell_frame import cell_frame
from er3a.workspace.directions import Roll, across, left_to_roll, point_tool
from er3a.workspace.interval_inverse import GOOD, NEVER, States, branches, holds, misses, theta_ranges
from er3a.workspace.placement import MIXED, NO, Field, Free, InCone, Places, Task, fitting_places, narrowed, survey
from er3a.workspace.tool_inverse import proofs_hold

Answer = Literal["proven", "refuted", "undecided"]
PROVEN: Answer = "proven"
REFUTED: Answer = "refuted"
_ANSWERS: tuple[Answer, ...] = ("undecided", PROVEN, REFUTED)
Constants = tuple[BlockConstants, Reals, Reals, float, Reals, float, float]
SAME_DIRECTION = 1e-9
"""Directions are the same if their product lacks less of 1."""
_STACK = 512
_MOST_TRIES = 200
_POSES_PER_BRICK = 512
_SMALLEST = (0.2, 0.05, 0.0125, 0.003, 0.0)  # half-widths, rad or length per lever, of pieces to split


@dataclass(frozen=True, eq=False)
class Chosen:
    """The best places that don't overlap.

    Attributes
    ----------
    row : their rows of the places; slot : the branch that serves each, or MIXED
    proven : whether each is proven, or else rests on samples; branch_proven : whether that one branch serves it all is
    refuted : how many better-ranked places the proof refused; poses : how many neighbourhoods it looked at
    """

    row: list[int]
    slot: list[int]
    proven: list[bool]
    branch_proven: list[bool]
    refuted: int
    poses: int


@dataclass(frozen=True, eq=False)
class BoxPlacement:
    """Where a box can stand: the lattice, the places on it, and the best of them."""

    field: Field
    places: Places
    chosen: Chosen

    def room(self, row: int) -> Reals:
        """How far (3, 2), m, the box can be moved from a place along x, y and z, down and up.

        In steps of the lattice, through places of the same turn that are proven if this one is: a box between two of
        them lies in both together.
        """
        places = self.places
        same = (places.turned == places.turned[row]) & (places.proven | ~places.proven[row])
        steps = np.round((places.centre[same] - places.centre[row]) / self.field.spacing).astype(int)
        there = {tuple(step) for step in steps.tolist()}
        count = np.zeros((3, 2))
        for axis, way in np.ndindex(3, 2):
            step = np.zeros(3, dtype=int)
            step[axis] = 2 * way - 1
            while tuple((int(count[axis, way] + 1) * step).tolist()) in there:
                count[axis, way] += 1
        return count * self.field.spacing[:, None]

    @property
    def best_turns(self) -> Places:
        """The better of both turns at each centre."""
        key = np.round((self.places.centre - self.field.origin) / self.field.spacing * 2).astype(np.int64)
        _, first = np.unique(key, axis=0, return_index=True)
        return self.places.rows(np.sort(first))


def find_places(
    robot: Robot,
    task: Task,
    roll: Roll,
    grid: float,
    count: int,
    most_poses: int,
    *,
    free: Free | None = None,
    in_cone: InCone | None = None,
) -> BoxPlacement:
    """Survey where the box can stand and put the best places to the proof.

    Parameters
    ----------
    robot : with its own limits; grid : m, about the lattice's spacing
    count : how many places to choose; most_poses : how many neighbourhoods of poses their proofs may look at
    free : which arms count at the lattice's points; the proofs, of reach alone, look at none
    in_cone : what is asked at points; directions with this roll, unless told otherwise

    Nothing is proven of arms without a spherical wrist.
    """
    robot = narrowed(robot, task.margin)
    field = survey(robot, task, roll, grid, free, in_cone=in_cone)
    places = fitting_places(field, proven_bricks(robot, task, field, roll), task.box)
    chosen = choose_places(robot, task, places, roll, count, most_poses)
    proven = places.proven.copy()
    proven[[row for row, is_proven in zip(chosen.row, chosen.proven) if is_proven]] = True
    return BoxPlacement(field, replace(places, proven=proven), chosen)


def choose_places(robot: Robot, task: Task, places: Places, roll: Roll, count: int, most_poses: int) -> Chosen:
    """Take up to ``count`` places in their order, each put to the proof.

    None overlaps one before it, or is one before it turned about axis 1.

    A place whose one branch is refuted is tried with any mix of branches.

    Raises
    ------
    NotWristPartitionedError
    """
    rows: list[int] = []
    slots: list[int] = []
    proven: list[bool] = []
    branch_proven: list[bool] = []
    refuted = used = 0
    sizes = np.where(places.turned[:, None], task.box[[1, 0, 2]], task.box)
    free = np.ones(len(places.slot), dtype=bool)

    def proved(row: int, slot: int, most: int) -> tuple[Answer, int]:
        if not proofs_hold(robot):
            return "undecided", 0
        return prove_place(robot, task, places.centre[row], bool(places.turned[row]), slot, roll, most_poses=most)

    while len(rows) < count and refuted < _MOST_TRIES and free.any():
        row = int(np.argmax(free))
        budget = (most_poses - used) // (count - len(rows))
        slot = int(places.slot[row])
        answer, spent = proved(row, slot, budget)
        used += spent
        if answer == REFUTED and slot != MIXED:
            slot = MIXED
            answer, spent = proved(row, slot, budget)
            used += spent
        if answer == REFUTED:
            free[row], refuted = False, refuted + 1
            continue
        rows.append(row)
        slots.append(slot)
        proven.append(answer == PROVEN or bool(places.proven[row]))
        branch_proven.append(answer == PROVEN and slot != MIXED)
        apart = np.abs(places.centre - places.centre[row]) >= (sizes + sizes[row]) / 2 - 1e-9
        free &= apart.any(axis=1) & ~_turned_about_axis_1(robot, task, places.centre, row)
    return Chosen(rows, slots, proven, branch_proven, refuted, used)


def _turned_about_axis_1(robot: Robot, task: Task, centre: Reals, row: int) -> Flags:
    """Which places (n, 3) are that of ``row`` but for a turn about axis 1, where the task looks the same after one."""
    frame = cell_frame(robot)
    if frame.bar or abs(task.axis @ frame.R[2]) < 1 - SAME_DIRECTION:
        return np.zeros(len(centre), dtype=bool)
    local = (centre - frame.origin) @ frame.R.T
    rho = np.hypot(local[:, 0], local[:, 1])
    near = np.abs(rho - rho[row]) < task.box[:2].min() - 1e-9
    same: Flags = near & (np.abs(local[:, 2] - local[row, 2]) < task.box[2] - 1e-9)
    return same


def prove_place(
    robot: Robot, task: Task, centre: Reals, turned: bool, slot: int, roll: Roll, *, most_poses: int
) -> tuple[Answer, int]:
    """Decide one place.

    Parameters
    ----------
    centre : (3,), m, of the box; turned : whether it stands turned by 90 deg about z
    slot : the branch that must serve it all, or MIXED for any
    most_poses : how many neighbourhoods of poses to look at

    Returns
    -------
    answer : refuted means that there is a point and direction that no branch reaches, with any of the rolls
    used : how many neighbourhoods were looked at

    Raises
    ------
    NotWristPartitionedError
    """
    half = (task.box[[1, 0, 2]] if turned else task.box) / 2
    constants, middle = _constants(robot, task, roll), np.ascontiguousarray(centre, float)
    answer = used = 0
    # Coarse pieces first, everywhere: what refutes a place is found before effort goes into its rims.
    for smallest in _SMALLEST:
        answer, spent = _prove(constants, middle, half, slot, most_poses - used, smallest)
        used += int(spent)
        if answer or used >= most_poses:
            break
    return _ANSWERS[answer], used


def proven_bricks(robot: Robot, task: Task, field: Field, roll: Roll) -> Flags:
    """Which bricks between eight lattice points are served at every point, by any mix of branches: (nx-1, ny-1, nz-1).

    None of an arm without a spherical wrist.
    """
    serving = field.least_any > NO
    for axis in range(3):
        serving = np.minimum(np.delete(serving, -1, axis), np.delete(serving, 0, axis))
    bricks = np.argwhere(serving)
    good = np.zeros(len(bricks), dtype=bool)
    centres = np.ascontiguousarray(field.origin + (bricks + 0.5) * field.spacing)
    if proofs_hold(robot):
        _prove_all(_constants(robot, task, roll), centres, field.spacing / 2, MIXED, _POSES_PER_BRICK, good)
    proven = np.zeros(serving.shape, dtype=bool)
    proven[tuple(bricks.T)] = good
    return proven


def _constants(robot: Robot, task: Task, roll: Roll) -> Constants:
    """What the kernels take of an arm and a task."""
    asked = left_to_roll(robot, roll)
    arm, ranges = constants_for_blocks(asked), theta_ranges(asked)
    x, y = across(task.axis[None])
    frame = np.stack([x[0], y[0], task.axis], axis=1)
    scale = 2.0 / float(arm.upper_arm + arm.forearm)
    return arm, ranges, frame, task.half_angle, np.array(roll.angles), roll.reach, scale


@kernel
def _prove_all(constants: Constants, centres: Reals, half: Reals, slot: int, most_poses: int, good: Flags) -> None:
    for n in range(centres.shape[0]):
        good[n] = _prove(constants, centres[n], half, slot, most_poses, 0.0)[0] == 1


@kernel
def _prove(
    constants: Constants, centre: Reals, half: Reals, slot: int, most_poses: int, smallest: float
) -> tuple[int, int]:
    arm, ranges, frame, half_angle, angles, reach, scale = constants
    T, state, theta_1 = np.eye(4), np.empty(SLOTS, dtype=np.int8), np.empty((SLOTS, 2))
    stack, size = np.empty((_STACK, 10)), np.empty(5)
    for k in range(3):
        stack[0, 2 * k], stack[0, 2 * k + 1] = centre[k] - half[k], centre[k] + half[k]
    stack[0, 6], stack[0, 7], stack[0, 8], stack[0, 9] = 0.0, half_angle, 0.0, 2.0 * np.pi
    top, used, answer = 1, 0, 1
    while top > 0:
        top -= 1
        piece = stack[top]
        p_0, p_1 = piece[6], piece[7]
        wide = 1.0 if p_0 < 0.5 * np.pi < p_1 else max(np.sin(p_0), np.sin(p_1))
        square = 0.0
        for k in range(3):
            size[k] = 0.5 * (piece[2 * k + 1] - piece[2 * k])
            square += size[k] * size[k]
            size[k] *= scale
            T[k, 3] = 0.5 * (piece[2 * k + 1] + piece[2 * k])
        size[3], size[4] = 0.5 * (p_1 - p_0), 0.5 * (piece[9] - piece[8]) * wide
        rho, delta = np.sqrt(square), np.hypot(size[3], size[4])
        good, lost = False, True
        for j in range(angles.shape[0]):
            point_tool(T, frame, 0.5 * (p_0 + p_1), 0.5 * (piece[8] + piece[9]), np.cos(angles[j]), np.sin(angles[j]))
            used += 2
            branches(arm, ranges, T, rho, delta, reach, state, theta_1)
            if _some(ranges, state, theta_1, slot):
                good = True
                break
            branches(arm, ranges, T, 0.0, 0.0, reach, state, theta_1)
            lost = lost and _none(ranges, state, theta_1, slot)
        if good:
            continue
        if lost:
            return 2, used
        if used >= most_poses or top + 2 > _STACK:
            return 0, used
        widest = 0
        for k in range(5):
            if size[k] > size[widest]:
                widest = k
        if size[widest] < smallest:
            answer = 0
            continue
        middle = 0.5 * (piece[2 * widest] + piece[2 * widest + 1])
        for k in range(10):
            stack[top + 1, k] = piece[k]
        stack[top + 1, 2 * widest] = middle
        stack[top, 2 * widest + 1] = middle
        top += 2
    return answer, used


@kernel
def _some(ranges: Reals, state: States, theta_1: Reals, slot: int) -> bool:
    """Whether some branch, or the one asked for, is good with joint 1 too."""
    for k in range(SLOTS):
        if (slot == MIXED or k == slot) and state[k] == GOOD and holds(ranges, 0, theta_1[k, 0], theta_1[k, 1]):
            return True
    return False


@inner_kernel
def _none(ranges: Reals, state: States, theta_1: Reals, slot: int) -> bool:
    """Whether no branch, or not the one asked for, is possible."""
    for k in range(SLOTS):
        if (slot == MIXED or k == slot) and state[k] != NEVER and not misses(ranges, 0, theta_1[k, 0], theta_1[k, 1]):
            return False
    return True
