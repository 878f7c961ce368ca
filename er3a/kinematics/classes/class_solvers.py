"""The solvers of the classes of arms, with one interface.

Chains are constant links, with revolute and prismatic joints about and along z (:mod:`chain`); base, tool, offsets and
coupling are the caller's.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import field
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from er3a.by_value import by_identity, frozen
from er3a.geometry.transforms import exp_rotation
from er3a.geometry.vectors import Vector, wrap_to_pi
from er3a.kinematics.chain import axes_of, poses_of, size_of
from er3a.kinematics.classes.arm_angle import ArmAngleArm, arm_angles_of, solve_at_arm_angle
from er3a.kinematics.classes.four_bar import four_bars, solve_three_parallel
from er3a.kinematics.classes.parallel_axes import ThreeParallel, parallel_rows
from er3a.kinematics.classes.scara import Gantry, Scara, solve_gantry, solve_scara
from er3a.kinematics.classes.self_motion import PoseChain
from er3a.kinematics.classes.six_revolute import CERTAIN, CONTINUUM, RowsFound
from er3a.kinematics.closed_form import BOUNDARY_M, REACHED, ArmConstants, solve
from er3a.numerics.arrays import Flags, Integers, Reals, for_kernel

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


@frozen
class ArmClassTraits:
    """What is known of a class, in addition to its solver.

    Attributes
    ----------
    closed_form : whether its solutions come without elimination, where rounding may lose some, and without search
    searched : whether a pose in doubt is searched for self-motions from many starts
    task : which of x, y, z and the rotations about x, y, z of the tool's frame its solutions meet
    """

    closed_form: bool = False
    searched: bool = False
    task: tuple[int, int, int, int, int, int] = (1, 1, 1, 1, 1, 1)


ARM_CLASSES: dict[ArmClassCode, ArmClassTraits] = {
    "spherical_wrist": ArmClassTraits(closed_form=True),
    "three_parallel": ArmClassTraits(closed_form=True),
    "arm_angle": ArmClassTraits(closed_form=True),
    "gantry": ArmClassTraits(closed_form=True, searched=True),
    "general_six": ArmClassTraits(searched=True),
    "six_two_prismatic": ArmClassTraits(searched=True),
    "six_one_prismatic": ArmClassTraits(searched=True),
    "scara": ArmClassTraits(closed_form=True, searched=True, task=(1, 1, 1, 0, 0, 1)),
    "redundant": ArmClassTraits(),
    "free_roll": ArmClassTraits(searched=True, task=(1, 1, 1, 1, 1, 0)),
    "planar_wrist": ArmClassTraits(searched=True),
    "position": ArmClassTraits(searched=True, task=(1, 1, 1, 0, 0, 0)),
    "dependent": ArmClassTraits(),
    "unsolved": ArmClassTraits(),
}
"""All classes; where a chain can be taken as one of several, the first is preferred.

- ``spherical_wrist``: axes 2 and 3 parallel to 1e-9 rad, axes 4, 5, 6 meet to 1e-9 m;
- ``three_parallel``: axes 2, 3, 4 parallel, 5 and 6 meet; ``general_six``: any other six revolute joints;
- ``six_one_prismatic``: six joints, one of them prismatic; ``six_two_prismatic``: two of them; ``gantry``: three;
- ``arm_angle``: seven revolute joints, the first three axes meet, and the last three; ``redundant``: others with
  more than six joints;
- ``scara``: four joints with one direction, one of them prismatic; ``free_roll``: five joints, the turn about the
  tool's z axis is left over; ``planar_wrist``: up to five joints, solved for those poses that they can take exactly;
  ``position``: three joints, solved for the tool point;
- ``dependent``: fewer degrees of freedom than joints (six at most), for example two parallel slides: each pose within
  reach has infinitely many solutions; ``unsolved``: none of these.
"""
Branches = tuple[Reals, Flags, tuple[NDArray[np.int8], Reals] | None]
AS_IN_TABLE = for_kernel(np.ones(6)), for_kernel(np.zeros(6))  # direction and offset of row values
ALL_OF_POSE = ArmClassTraits().task

BranchLabel = Literal[
    "front_elbow_up_no_flip",
    "front_elbow_up_flip",
    "front_elbow_down_no_flip",
    "front_elbow_down_flip",
    "back_elbow_up_no_flip",
    "back_elbow_up_flip",
    "back_elbow_down_no_flip",
    "back_elbow_down_flip",
]
SlotName = Literal[
    BranchLabel,
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
DOUBLE_ROOT = 1e-6  # rad or m: rows so near are one, split by rounding
NEAR_SINGULAR = 1e-7  # rad or parts of the reach: a closed form's row so near to its singular sets is looked at again


@frozen
class Redundancy:
    """What a pose leaves open in chains of seven and more: a joint (from 0), or the arm angle (-1)."""

    joint: int
    code: Literal["locked_joint", "arm_angle"]


class ChainSolver(ABC):
    """What every class offers: by default no parameters, no seeds and no names.

    ``rows`` takes poses (N, 4, 4) in m and values (N, k) of the k parameters; it gives joint values (N, slots, n), NaN
    in empty slots, and how sure it is (N,): CERTAIN, UNCERTAIN, or CONTINUUM where branches meet or a joint is free.
    ``names`` are the slots' names, with joint values (n,) of the manufacturer's zero pose; none where no sign factors
    separate the solutions.

    Attributes
    ----------
    code : class of the chain
    slots : rows that a pose has place for
    parameters : what a pose leaves open, k of them; empty for up to six joints
    """

    code: ArmClassCode
    slots: int
    parameters: tuple[Redundancy, ...] = ()

    @abstractmethod
    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        """All rows of poses.

        Parameters
        ----------
        T : (N, 4, 4), m
        values : (N, k), of the parameters, rad or m

        Returns
        -------
        q : (N, slots, n), rad or m, NaN in empty slots
        certainty : (N,), CERTAIN, UNCERTAIN or CONTINUUM
        """

    def values_of(self, x: Reals) -> Reals:
        """Values of the parameters at joint values: none.

        Parameters
        ----------
        x : (..., n)

        Returns
        -------
        values : (..., 0)
        """
        return np.empty((*x.shape[:-1], 0))

    def seeds(self, T: Reals) -> list[Reals]:
        """Members of continua of one pose that the class knows without a search.

        Parameters
        ----------
        T : (4, 4), m

        Returns
        -------
        seeds : arrays (j, n), rad or m
        """
        return []

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        """Names of the slots; none where no sign factors separate the solutions.

        Parameters
        ----------
        x : (n,), rad or m, the manufacturer's zero pose

        Returns
        -------
        names : in the order of the slots, or empty
        """
        return ()


@by_identity
class SphericalWristSolver(ChainSolver):
    """Axes 2 and 3 parallel, and a spherical wrist."""

    links: Reals
    constants: ArmConstants
    code: ArmClassCode = "spherical_wrist"
    slots: int = 8

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        """All eight branches, by the closed form.

        Parameters
        ----------
        T : (N, 4, 4), m
        values : not looked at

        Returns
        -------
        q : (N, 8, 6), rad, NaN in empty slots
        certainty : (N,), CONTINUUM where branches meet or the wrist centre is next to axis 1, else CERTAIN
        """
        q, *_ = self.branches(np.ascontiguousarray(T, dtype=float))
        singular = _branches_meet(q, ((4, 0), (2, 2), (1, 4))) | (self._beside_axis_1(T) < NEAR_SINGULAR)
        return q, np.where(singular, CONTINUUM, CERTAIN)

    def branches(self, T: Reals) -> Branches:
        """All eight branches, without a look at how near they are to singular poses.

        Parameters
        ----------
        T : (N, 4, 4), m, contiguous

        Returns
        -------
        q : (N, 8, 6), rad, NaN in empty slots
        marked : (N,), False: where branches meet both have a row
        fault, gap : (N, 8), of empty slots, as of :func:`er3a.kinematics.wrist_partitioned.solve_slots`
        """
        shape = len(T), 8
        q, fault, gap = np.full((*shape, 6), np.nan), np.zeros(shape, dtype=np.int8), np.zeros(shape)
        T, free = T.view(), np.zeros((len(T), 6))
        T.flags.writeable = free.flags.writeable = False
        solve(self.constants, AS_IN_TABLE, T, free, True, True, (q, fault, gap))
        q[fault != REACHED] = np.nan
        return q, np.zeros(len(T), dtype=bool), (fault, gap)

    def _beside_axis_1(self, T: Reals) -> Reals:
        """Distance (N,) of the wrist centre from axis 1, in parts of the reach; next to it that joint is free."""
        k = self.constants
        W = T[:, :3, 3] + T[:, :3, :3] @ np.array(k.wrist_in_tool) - np.array(k.point_1)
        return np.asarray(np.linalg.norm(np.cross(W, np.array(k.axis_1)), axis=1) / k.reach)

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        """Names by the side of axis 1, the elbow and the wrist.

        Parameters
        ----------
        x : (6,), rad, the manufacturer's zero pose

        Returns
        -------
        names : eight, in the order of the slots
        """
        return _names_by_side(self.links, self.constants.wrist_in_tool, x)


@by_identity
class ParallelAxes(ChainSolver):
    """Axes 2, 3 and 4 parallel, 5 and 6 meet."""

    arm: ThreeParallel
    code: ArmClassCode = "three_parallel"
    slots: int = 8

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        """All eight branches, by the closed form.

        Parameters
        ----------
        T : (N, 4, 4), m
        values : not looked at

        Returns
        -------
        q : (N, 8, 6), rad, NaN in empty slots
        certainty : (N,), CONTINUUM where a row's Jacobian is nearly singular, else CERTAIN
        """
        q, marked = solve_three_parallel(self.arm, T)
        certainty = np.full(len(T), CERTAIN)
        for n in np.flatnonzero(marked):
            chain = PoseChain.of(self.arm.links, np.zeros(6, dtype=bool), T[n], size_of(self.arm.links))
            solved = q[n][np.isfinite(q[n, :, 0])]
            certainty[n] = CONTINUUM if any(chain.smallest(x) < RANK_LOST for x in solved) else CERTAIN
        return q, certainty

    def branches(self, T: Reals) -> Branches:
        """All eight branches, without a look at how near they are to singular poses.

        Parameters
        ----------
        T : (N, 4, 4), m, contiguous

        Returns
        -------
        q : (N, 8, 6), rad, NaN in empty slots
        marked : (N,), where branches meet, so that rounding may have lost both
        unsolved : nothing is said of empty slots
        """
        return *parallel_rows(self.arm, T), None

    def seeds(self, T: Reals) -> list[Reals]:
        """Two members of each range of each four-bar, with both elbows.

        Parameters
        ----------
        T : (4, 4), m

        Returns
        -------
        seeds : arrays (2, 6), rad
        """
        return [
            family.members(np.array([0.5 * (low + high), 0.25 * low + 0.75 * high]), elbow)
            for family in four_bars(self.arm, T)
            for low, high in family.intervals
            for elbow in (0, 1)
        ]

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        """Names by the side of axis 1, the elbow and the wrist.

        Parameters
        ----------
        x : (6,), rad, the manufacturer's zero pose

        Returns
        -------
        names : eight, in the order of the slots
        """
        return _names_by_side(self.arm.links, self.arm.constants.wrist_in_tool, x)


BranchSolver = SphericalWristSolver | ParallelAxes
"""Classes whose eight branches are known where no joint is free and no two meet, without a second look."""


@by_identity
class EliminationSolver(ChainSolver):
    """Any six joints of which at most two slide."""

    solve: Callable[[Reals], RowsFound]
    code: ArmClassCode
    slots: int = 16

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        """All solutions, by elimination.

        Parameters
        ----------
        T : (N, 4, 4), m
        values : not looked at

        Returns
        -------
        q : (N, 16, 6), rad or m, NaN after the last
        certainty : (N,), CERTAIN, UNCERTAIN or CONTINUUM
        """
        found = self.solve(T)
        return found.q, found.certainty


@by_identity
class ArmAngle(ChainSolver):
    """Seven joints with a spherical shoulder and wrist; self-motions are collected over the arm angle."""

    arm: ArmAngleArm
    code: ArmClassCode = "arm_angle"
    slots: int = 8
    parameters: tuple[Redundancy, ...] = (Redundancy(-1, "arm_angle"),)

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        """All eight branches at an arm angle.

        Parameters
        ----------
        T : (N, 4, 4), m
        values : (N, 1), rad

        Returns
        -------
        q : (N, 8, 7), rad, NaN in empty slots
        certainty : (N,), CONTINUUM at singularities of shoulder, elbow or wrist, else CERTAIN
        """
        q, singular = solve_at_arm_angle(self.arm, T, values[:, 0])
        return q, np.where(singular, CONTINUUM, CERTAIN)

    def values_of(self, x: Reals) -> Reals:
        """Arm angles of joint angles.

        Parameters
        ----------
        x : (..., 7), rad

        Returns
        -------
        values : (..., 1), rad
        """
        return arm_angles_of(self.arm, x)[..., None]

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        """Names by the roots of shoulder, elbow and wrist.

        Parameters
        ----------
        x : not looked at

        Returns
        -------
        names : eight, in the order of the slots
        """
        # slots are 4 elbow + 2 shoulder + wrist
        first = SLOT_NAMES.index("shoulder_plus_elbow_plus_wrist_plus")
        return tuple(SLOT_NAMES[first + 4 * (s // 2 % 2) + 2 * (s // 4) + s % 2] for s in range(8))


@by_identity
class GantrySolver(ChainSolver):
    """Six joints, three of them prismatic."""

    arm: Gantry
    code: ArmClassCode = "gantry"
    slots: int = 2

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        """Both branches of the wrist.

        Parameters
        ----------
        T : (N, 4, 4), m
        values : not looked at

        Returns
        -------
        q : (N, 2, 6), rad or m, NaN in empty slots
        certainty : (N,), CONTINUUM where both meet or the slides don't span space, else CERTAIN
        """
        q, singular = solve_gantry(self.arm, T)
        return q, np.where(singular, CONTINUUM, CERTAIN)

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        """Names by the root of the wrist.

        Parameters
        ----------
        x : not looked at

        Returns
        -------
        names : two
        """
        return "wrist_plus", "wrist_minus"


@by_identity
class ScaraSolver(ChainSolver):
    """Four joints of one direction, one of them prismatic."""

    arm: Scara
    code: ArmClassCode = "scara"
    slots: int = 2

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        """Both branches of the elbow.

        Parameters
        ----------
        T : (N, 4, 4), m, whose tilt is not met
        values : not looked at

        Returns
        -------
        q : (N, 2, 4), rad or m, NaN in empty slots
        certainty : (N,), CONTINUUM where both meet, else CERTAIN
        """
        q, second = solve_scara(self.arm, T)[0], self.arm.turning[1]
        meet = np.abs(wrap_to_pi(q[:, 0, second] - q[:, 1, second])) < DOUBLE_ROOT
        return q, np.where(meet, CONTINUUM, CERTAIN)

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        """Names by the root of the elbow.

        Parameters
        ----------
        x : not looked at

        Returns
        -------
        names : two
        """
        return "elbow_plus", "elbow_minus"


@by_identity
class PaddedChain(ChainSolver):
    """Fewer than six joints, solved with joints that the chain lacks at these places (from 0, rising)."""

    rest: ChainSolver
    lacking: tuple[int, ...]
    code: ArmClassCode
    slots: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "slots", self.rest.slots)

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        """Rows of the completed chain that need nothing of the joints that are not there.

        Parameters
        ----------
        T : (N, 4, 4), m
        values : not looked at

        Returns
        -------
        q : (N, slots, n), rad or m, NaN in empty slots
        certainty : (N,), of the completed chain; CONTINUUM where two rows meet
        """
        x, certainty = self.rest.rows(T, values)
        if self.code == "planar_wrist":  # what these joints would have to turn, the tool can't
            x[np.abs(wrap_to_pi(x[:, :, list(self.lacking)])).max(axis=2) > LEFT_OVER] = np.nan
        x = np.delete(x, self.lacking, axis=2)
        for first in range(x.shape[1]):  # rows that differ in the joints that are not there
            away = np.abs(wrap_to_pi(x[:, first + 1 :] - x[:, first : first + 1])).max(axis=2, initial=0.0)
            x[:, first + 1 :][away < 1e-9] = np.nan
            meet = (away >= 1e-9) & (away < DOUBLE_ROOT)
            certainty = np.where(meet.any(axis=1), CONTINUUM, certainty)
        return x, certainty

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        """The completed chain's slot names.

        Parameters
        ----------
        x : (n,), rad or m, the manufacturer's zero pose

        Returns
        -------
        names : in the order of the slots; none for arms that solve for the position alone
        """
        if self.code == "position":  # rows that differ in the joints that are not there are one
            return ()
        full = np.zeros(6)
        full[[j for j in range(6) if j not in self.lacking]] = x
        return self.rest.names(full)


@by_identity
class LinkedRows(ChainSolver):
    """A chain whose rows a linkage moves together (a levelling one, say): those of its solutions that keep to it.

    ``apart`` (m, m) takes rows, less ``start`` (m,), to how far they are from what the linkage makes.
    """

    chain: ChainSolver
    apart: Reals
    start: Reals
    sliding: Flags
    code: ArmClassCode
    slots: int

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        """Solutions of the chain that the linkage can make.

        Parameters
        ----------
        T : (N, 4, 4), m
        values : not looked at

        Returns
        -------
        q : (N, slots, m), rad or m, row values, NaN in empty slots
        certainty : (N,), of the chain
        """
        x, certainty = self.chain.rows(T, values)
        off = (x - self.start) @ self.apart.T
        off = np.abs(np.where(self.sliding, off, wrap_to_pi(off))).max(axis=2)
        x[off > LEFT_OVER] = np.nan
        return x, certainty

    def names(self, x: Reals) -> tuple[SlotName, ...]:
        """The chain's slot names.

        Parameters
        ----------
        x : (m,), rad or m, the manufacturer's zero pose

        Returns
        -------
        names : in the order of the slots
        """
        return self.chain.names(x)


def _names_by_side(links: Reals, wrist_in_tool: Vector, x: Reals) -> tuple[SlotName, ...]:
    """Names by the side of axis 1 on which the wrist is in the zero pose x (n,), by the elbow and by the wrist."""
    (w1, w2, *_), points = axes_of(links)
    T = poses_of(links, x)
    W = T[:3, 3] + T[:3, :3] @ np.array(wrist_in_tool) - points[0]
    side = float(np.cross(w1, w2) @ exp_rotation(-x[0] * w1) @ W)
    return _three_signs(w1, w2, side if abs(side) > BOUNDARY_M else 1.0)


def _three_signs(w1: Reals, w2: Reals, zero_side: float) -> tuple[SlotName, ...]:
    """Names of the slots ``4 shoulder + 2 elbow + wrist``.

    As :func:`er3a.kinematics.solutions.branch_labels`: *front* is where the wrist is in the zero pose; *up*: with
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


def _branches_meet(q: Reals, pairs: tuple[tuple[int, int], ...]) -> Flags:
    """Whether two rows that differ in one root (step in slots, joint that shows it) are within a small angle, (N,)."""
    meet = np.zeros(len(q), dtype=bool)
    for step, joint in pairs:
        for slot in range(8):
            if slot // step % 2 == 0:
                meet |= np.abs(wrap_to_pi(q[:, slot, joint] - q[:, slot + step, joint])) < NEAR_SINGULAR
    return meet
