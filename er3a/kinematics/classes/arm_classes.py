"""Which solver an arm's geometry asks for, with the tolerances by which it is told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.kinematics.classes.chain_solvers import chain_solver
from er3a.kinematics.classes.class_solvers import ArmClassCode
from er3a.kinematics.classes.links import axes_of, size_of
from er3a.numerics.arrays import Flags, Reals

PARALLEL = 1e-9  # rad
MEETS_M = 1e-9
NEARLY = 1e-3  # rad or parts of the arm's size: a property that the arm has nearly


@dataclass(frozen=True)
class AxisPair:
    """Two neighbouring axes (numbers from 1): the angle between them (rad, 0 to pi/2) and how far they miss (m)."""

    first: int
    angle: float
    miss: float


@dataclass(frozen=True)
class ArmClass:
    """An arm's class, its number of slots, and neighbouring axes that are parallel or meet nearly, but not quite."""

    code: ArmClassCode
    slots: int
    nearly_parallel: tuple[AxisPair, ...]
    nearly_meeting: tuple[AxisPair, ...]


def arm_class(links: Reals, sliding: Flags | None = None) -> ArmClass:
    """The class of a chain with constant links (n + 1, 4, 4); ``sliding`` (n,) tells prismatic joints.

    - ``spherical_wrist``: axes 2 and 3 parallel to 1e-9 rad, axes 4, 5, 6 meet to 1e-9 m;
    - ``three_parallel``: axes 2, 3, 4 parallel, 5 and 6 meet; ``general_six``: any other six revolute joints;
    - ``six_one_prismatic``: six joints, one of them prismatic; ``six_two_prismatic``: two of them; ``gantry``: three;
    - ``arm_angle``: seven revolute joints, the first three axes meet, and the last three; ``redundant``: others with
      more than six joints;
    - ``scara``: four joints with one direction, one of them prismatic; ``free_roll``: five joints, the turn about the
      tool's z axis is left over; ``planar_wrist``: up to five joints, solved for those poses that they can take
      exactly; ``position``: three joints, solved for the tool point;
    - ``dependent``: joints that move the tool in fewer ways than their number (six at most), such as two parallel
      slides: each pose that they reach, they reach in infinitely many ways; ``unsolved``: none of these.
    """
    sliding = np.zeros(len(links) - 1, dtype=bool) if sliding is None else np.asarray(sliding, dtype=bool)
    pairs, size, solver = _neighbours(links), size_of(links), chain_solver(links, sliding)
    parallel = tuple(pair for pair in pairs if PARALLEL < pair.angle < NEARLY)
    meeting = tuple(pair for pair in pairs if MEETS_M < pair.miss < NEARLY * size)
    return ArmClass(solver.code, solver.slots, parallel, meeting)


def _neighbours(links: Reals) -> tuple[AxisPair, ...]:
    axes, points = axes_of(links)
    found = []
    for k in range(len(axes) - 1):
        across = np.cross(axes[k], axes[k + 1])
        sine = float(np.linalg.norm(across))
        apart = points[k + 1] - points[k]
        miss = np.linalg.norm(np.cross(apart, axes[k])) if sine < PARALLEL else abs(apart @ across) / sine
        found.append(AxisPair(k + 1, float(np.arctan2(sine, abs(axes[k] @ axes[k + 1]))), float(miss)))
    return tuple(found)


def with_joint_fixed(links: Reals, joint: int, value: float) -> Reals:
    """Links (n, 4, 4) of the chain with one revolute joint (number from 0) held at a value in rad.

    With :mod:`six_revolute` this solves any seven-joint arm at one value of the joint that is taken as its redundancy.
    """
    c, s = np.cos(value), np.sin(value)
    turn = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    held = np.array(links[joint] @ turn @ links[joint + 1])
    return np.concatenate([links[:joint], held[None], links[joint + 2 :]])


def with_free_roll(links: Reals) -> Reals:
    """Links of the chain with one more revolute joint, about the tool's z axis: for tools that may turn about it.

    Solved for any pose with the wanted tool point and axis, its last joint is the turn that is left over.
    """
    return np.concatenate([links, np.eye(4)[None]])
