"""Result types of the inverse: joint solutions with their verdict, and the reason if there are none.

The eight branches of a wrist-partitioned arm are slots: ``4 * shoulder + 2 * elbow + wrist``. Each part is the sign of
one factor of the Jacobian's determinant, so that a branch can only change where the arm passes a singularity of it:

- shoulder 0: the wrist centre lies against ``w1 x w2``, as seen from axis 1 (w: axis directions, D-H sense);
- elbow 0: the forearm is turned by 0 to pi from the upper arm about axis 2;
- wrist 0: axis 6 is turned by 0 to pi from axis 4 about axis 5, both projected across it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from er3a.by_value import ByValue, Displayed, Sheet, frozen, shortly
from er3a.errors import with_extra
from er3a.finding import Finding, fact, is_one
from er3a.geometry.vectors import TURN, wrap_to_pi
from er3a.kinematics.by_class import arm_solver
from er3a.kinematics.classes.class_solvers import BranchLabel, SlotName
from er3a.kinematics.closed_form import BOUNDARY_M
from er3a.kinematics.families import Family
from er3a.kinematics.self_motions import SelfMotionCurve, to_rows
from er3a.kinematics.singularity import determinant_factors
from er3a.kinematics.wrist_partitioned import has_branches, wrist_partitioned_arm
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.robots.joint_limits import but_for_turns, joint_columns, limits_exceeded, shown
from er3a.robots.robot import Robot, derived, placement_text

if TYPE_CHECKING:
    import pandas as pd

Side = Literal["front", "back"]
LABELS: tuple[BranchLabel, ...] = get_args(BranchLabel)


@derived
def branch_labels(robot: Robot) -> tuple[BranchLabel, ...]:
    """The codes of the eight slots, of arms with a spherical wrist or with parallel axes 2, 3 and 4.

    *front*: the wrist centre is on the side of axis 1 where it is in the manufacturer's zero pose (if it is on axis 1
    there, the side of the cross product of axes 1 and 2); *back*: reached over the head. *up*: with the arm stretched
    out level on that side, the elbow is above the line from shoulder to wrist. *flip*: the wrist root with the
    negative angle.

    Returns
    -------
    labels : eight, in the order of the slots

    Raises
    ------
    NotWristPartitionedError
        for other arms
    """
    if not has_branches(robot):
        wrist_partitioned_arm(robot)  # says what the arm lacks
    names = arm_solver(robot).chain.names(to_rows(robot, np.zeros(6)))
    return tuple(LABELS[LABELS.index(name)] for name in names)  # type: ignore[arg-type]


@derived
def slot_labels(robot: Robot) -> tuple[BranchLabel | SlotName, ...]:
    """The codes of the slots of the arm's class.

    Returns
    -------
    labels : empty where no signs separate the solutions, which are numbered then
    """
    return arm_solver(robot).chain.names(to_rows(robot, np.zeros(robot.joints)))


@derived
def side_of(robot: Robot, slot: int) -> Side:
    """Whether a slot's wrist is in front of axis 1 or reached over the head (see :func:`branch_labels`).

    Parameters
    ----------
    slot : 0 to 7

    Returns
    -------
    side : "front" or "back"
    """
    at_zero = determinant_factors(robot, np.zeros(6)).shoulder
    zero_side = 1.0 if abs(at_zero) < BOUNDARY_M else np.sign(at_zero)
    return "front" if _outward(slot) == zero_side else "back"


def _outward(slot: int) -> float:
    """On which side of axis 1 the wrist is, along w1 x w2: slot 0 has theta_1 = phi + delta and lies against it."""
    return -1.0 if slot < 4 else 1.0


Label = BranchLabel | SlotName | Literal["found_arm"]


Method = Finding
"""How solutions were found: ``closed_form`` (all of them), ``by_class`` (``arm_class``; ``certain``: whether the solver
left no doubt that these are all; ``named``: whether signs of factors separate them, so that branches have names, else
they are numbered), or ``iteration`` from random ``starts``, which may miss some; ``lacking``: why the arm has no closed
form."""
CLOSED_FORM = fact("closed_form", arm_class="spherical_wrist")


def in_doubt(method: Method) -> Method:
    """The method of solving, no longer certain that its solutions are all.

    Parameters
    ----------
    method : as found

    Returns
    -------
    method : a closed form becomes its class, not certain; iteration stays, as it never is
    """
    if is_one(method, "closed_form"):
        return fact("by_class", arm_class=method.arm_class, certain=False, named=True)
    return method.but(certain=False) if is_one(method, "by_class") else method


NotFound = Finding


Unsolved = Finding
"""``side_unsolved``: why no branch exists with the wrist in front of axis 1, or reached over the head (back).
``pose_unsolved``: why a pose has no solution by the arm's class, or iteration found none; numbered as the poses lie in
memory."""


@frozen
class Solutions(ByValue, Displayed):
    """Joint solutions of one pose (``inverse``) or of many (``inverse_batch``, ``solve``).

    What is known of each solution has the leading axes of ``q``: (k,) from ``inverse``; (N, S) from ``inverse_batch``,
    one slot for each branch, S by the arm's class; those of the poses from ``solve``, one arm for each.

    Attributes
    ----------
    q : (..., n), rad or m, manufacturer's values; NaN in empty slots. ``inverse`` gives each branch once per turn that
        the limits allow, or once if it leaves them; ``inverse_batch`` of the turns within the limits the nearest to the
        reference, else the nearest to the limits; ``solve`` the nearest arm found where it solves nothing
    solved : (...,) bool, whether this is a solution
    within_limits : (...,) bool
    branch : (...,) int, the slot, of arms with a spherical wrist ``4 * shoulder + 2 * elbow + wrist``; of ``solve`` -1
    method : closed form, the solver of the arm's class, or iteration
    unsolved : ``inverse``: per shoulder side without solution, why (both sides: the pose can't be reached);
        ``solve``: per pose without solution, why
    families : of ``inverse``: continua of solutions, where a joint can turn with the tool at rest; of arms with more
        than six joints traced when they are first read
    turn_range : (..., 6, 2) int8, smallest and largest number of whole turns that can be added to each joint within its
        limits (smallest above largest: none); None unless ``inverse_batch`` was called with ``turns``
    position_error, rotation_error : (...,), m and rad, of the degrees of freedom in the ``mask`` of ``solve``
    starts : (...,) int, starts that ``solve`` used; 0 where none succeeded
    certain : of ``inverse_batch`` for other classes (N,): whether the solver left no doubt that these are all
    freed_turn : (...,), rad, of arms whose joints can't meet all of a pose (``task_mask``): by how much the tool is
        turned from the pose in what is left open, 0 where all of it is met; None for other arms
    """

    robot: Robot
    q: Reals
    solved: Flags
    within_limits: Flags
    branch: Integers
    method: Method = CLOSED_FORM
    unsolved: tuple[Unsolved, ...] = ()
    families: Sequence[Family | SelfMotionCurve] = ()
    turn_range: NDArray[np.int8] | None = None
    position_error: Reals | None = None
    rotation_error: Reals | None = None
    starts: Integers | None = None
    certain: Flags | None = None
    freed_turn: Reals | None = None

    @cached_property
    def turn(self) -> Integers:
        """(..., n), full turns added to the angle in (-pi, pi]; 0 in empty slots and of prismatic joints."""
        turns = np.nan_to_num(np.round((self.q - wrap_to_pi(self.q)) / TURN)).astype(int)
        return np.where(self.robot.slides, 0, turns)

    @cached_property
    def label(self) -> NDArray[np.object_]:
        """(...,), each branch's code (``configuration.BranchLabel``), or ``found_arm`` where they are numbered."""
        names = slot_labels(self.robot) if not is_one(self.method, "iteration") else ()
        if not names:
            return np.full(self.branch.shape, "found_arm", dtype=object)
        padded = [*names, *["found_arm"] * max(0, int(self.branch.max(initial=0)) + 1 - len(names))]
        return np.array(padded, dtype=object)[self.branch]

    @cached_property
    def reason(self) -> NDArray[np.object_]:
        """(...,), which limits each solution leaves (``LimitsExceeded``); None for those within, and in empty slots."""
        found = np.full(self.q.shape[:-1], None, dtype=object)
        for at in np.argwhere(self.solved & ~self.within_limits):
            found[tuple(at)] = limits_exceeded(self.robot, self.q[tuple(at)])
        return found

    def take(self, rows: NDArray[Any]) -> Solutions:
        """Some of the solutions of one pose.

        Parameters
        ----------
        rows : mask or numbers

        Returns
        -------
        solutions : in the order chosen
        """
        names = "q", "solved", "within_limits", "branch", *(("freed_turn",) if self.freed_turn is not None else ())
        return replace(self, **{name: getattr(self, name)[rows] for name in names})

    def to_frame(self) -> pd.DataFrame:
        """The solutions as a table.

        Returns
        -------
        table : a row for each solution, with the pose's number where there are many, the branch's code, joint values in
            deg (mm of prismatic joints) and whether they keep the limits

        Raises
        ------
        MissingLibraryError
            without pandas (``er3a[study]``)
        """
        try:
            import pandas as pd
        except ModuleNotFoundError as error:
            raise with_extra(error) from None
        at = np.argwhere(self.solved)
        found: dict[str, Any] = {"pose": at[:, 0]} if at.shape[1] > 1 else {}
        found |= {"branch": self.label[self.solved]}
        found |= dict(zip(joint_columns(self.robot), shown(self.robot, self.q[self.solved]).T))
        return pd.DataFrame(found | {"within_limits": self.within_limits[self.solved]})

    def without_turns(self) -> Solutions:
        """Solutions of one pose that differ by more than whole turns.

        Returns
        -------
        solutions : of rows that are others but for whole turns the first, the one nearest to the reference
        """
        first = np.unique(np.column_stack([self.branch, but_for_turns(self.robot, self.q)]), axis=0, return_index=True)[
            1
        ]
        return self.take(np.sort(first))

    def sheet(self) -> Sheet:
        """The solutions for printing.

        Returns
        -------
        sheet : one pose: each solution. Many, or a search: how many solutions there are in all
        """
        if self.q.ndim == 2 and self.position_error is None:
            return self._sheet_of_pose()
        poses = int(np.prod(self.solved.shape if self.position_error is not None else self.solved.shape[:-1]))
        return Sheet(f"Solutions of {poses} poses of {self.robot.name}: {self._counted()} ({self.method.code})")

    def _counted(self) -> str:
        """How many rows are solutions, and how many of these are within the limits, in words."""
        return f"{np.count_nonzero(self.solved)} solutions, {np.count_nonzero(self.within_limits)} within the limits"

    def _sheet_of_pose(self) -> Sheet:
        """Each solution of one pose."""
        turned = () if self.freed_turn is None else (np.degrees(self.freed_turn),)
        rows = (
            (row, label, *more, bool(inside), why)
            for row, label, more, inside, why in zip(
                range(len(self.q)),
                self.label,
                np.column_stack([shown(self.robot, self.q), *turned]),
                self.within_limits,
                self.reason,
            )
        )
        return Sheet.of_table(
            f"Solutions of one pose of {self.robot.name}: {self._counted()} ({self.method.code})",
            ("row", "branch", *joint_columns(self.robot), *("turned_deg" for _ in turned), "within", "reason"),
            rows,
            facts=(
                *(f"self-motion: {family!r}" for family in self.families),
                *(f"unsolved: {shortly(why)}" for why in self.unsolved),
            ),
        )


MANY_TARGETS = 1000
"""Beyond this number of targets a stage keeps of each solution only the whole turn nearest to the reference."""

TargetOutcome = Literal["reached", "unreachable", "leaves limits", "collides"]
"""Whether an admissible solution exists, or what rules it out."""


@frozen
class Target(ByValue, Displayed):
    """A pose of the tool.

    Attributes
    ----------
    T : (4, 4), T_base_tool, m, in the frame that the robot's base is placed in
    q_ref_deg : n, the joint values that the arm comes from, as they are written (mm of prismatic joints)
    joints_before : (n,), the same in rad or m; None where all joints turn
    expect : what is to come out, where the target says so
    """

    name: str
    T: Reals
    note: str | None = None
    q_ref_deg: tuple[float, ...] = (0.0,) * 6
    expect: TargetOutcome | None = None
    joints_before: Reals | None = None

    def sheet(self) -> Sheet:
        """A line for printing: name, position (mm) and roll, pitch, yaw (deg).

        Returns
        -------
        sheet : without rows
        """
        return Sheet(f"Target {self.name}: {placement_text(self.T)}")

    @property
    def q_ref(self) -> Reals:
        """``q_ref_deg`` in rad, or m of prismatic joints, (n,)."""
        return np.radians(self.q_ref_deg) if self.joints_before is None else self.joints_before
