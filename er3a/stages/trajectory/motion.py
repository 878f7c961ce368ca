"""A path of the path file as a motion of one robot: joints, rates and tool pose at any time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicHermiteSpline

from er3a.errors import InputError, PoseError
from er3a.kinematics.branch import branch_labels
from er3a.kinematics.forward import forward, jacobian
from er3a.kinematics.transforms import transform
from er3a.planning.follow import follow
from er3a.planning.followed import Followed
from er3a.planning.moves import JointMove, Line, line
from er3a.planning.path_file import JointPath, LinePath, PathEntry, PoseEntry
from er3a.robots.robot import Robot

Times = np.ndarray


@dataclass(frozen=True, eq=False)
class Motion:
    """A path, ready to be checked.

    Attributes
    ----------
    samples, checks : times in s of the path's own points, and with the points checked between them
    t, q : (N,) s and (N, 6) rad, the checks and whatever the branches of a line needed besides; q NaN where unreachable
    joints : angles (..., 6) at times (...,)
    rates : angles, velocities and accelerations, each (n, 6), at times (n,)
    tool : T_base_tool (n, 4, 4) that the path asks for at times (n,)
    way : length of the tool point's way (n,) in m at times (n,)
    followed : how a line is followed; None for a joint move
    """

    entry: PathEntry
    samples: Times
    checks: Times
    t: Times
    q: np.ndarray
    joints: Callable[[Times], np.ndarray]
    rates: Callable[[Times], tuple[np.ndarray, np.ndarray, np.ndarray]]
    tool: Callable[[Times], np.ndarray]
    way: Callable[[Times], np.ndarray]
    followed: Followed | None


def motion_of(robot: Robot, entry: PathEntry, checks_per_sample: int, field: str, file: Path) -> Motion:
    """Plan a path, and follow it if it is a line.

    Raises
    ------
    InputError
        for a start branch that this robot or pose has not, or a half-turn axis that can't choose; ``field`` names it
    """
    samples = np.linspace(0.0, entry.duration_s, entry.samples)
    checks = np.linspace(0.0, entry.duration_s, (entry.samples - 1) * (checks_per_sample + 1) + 1)
    checks[:: checks_per_sample + 1] = samples
    if isinstance(entry, JointPath):
        return _joint_motion(robot, entry, samples, checks)
    return _line_motion(robot, entry, samples, checks, field, file)


def _joint_motion(robot: Robot, entry: JointPath, samples: Times, checks: Times) -> Motion:
    move = JointMove(np.radians(entry.start_deg), np.radians(entry.end_deg), entry.duration_s)
    q, velocity, _ = move.joints(checks)
    speed = np.linalg.norm(np.einsum("nij,nj->ni", jacobian(robot, q)[:, :3], velocity), axis=1)
    way = CubicHermiteSpline(checks, cumulative_simpson(speed, x=checks, initial=0.0), speed)
    return Motion(
        entry=entry,
        samples=samples,
        checks=checks,
        t=checks,
        q=q,
        joints=lambda t: move.joints(t)[0],
        rates=move.joints,
        tool=lambda t: forward(robot, move.joints(t)[0]),
        way=way,
        followed=None,
    )


def _line_motion(robot: Robot, entry: LinePath, samples: Times, checks: Times, field: str, file: Path) -> Motion:
    q_start, slot = None, None
    if entry.start_deg is not None:
        q_start = np.radians(entry.start_deg)
        T_start = forward(robot, q_start)
    else:
        T_start = _pose(entry.start)
    if entry.start_branch is not None:
        labels = branch_labels(robot)
        if entry.start_branch not in labels:
            problem = f"this robot has no branch '{entry.start_branch}'"
            raise InputError(file, f"{field}.start_branch", problem, f"Known: {'; '.join(labels)}")
        slot = labels.index(entry.start_branch)
    axis = None if entry.half_turn_axis is None else np.array(entry.half_turn_axis)
    try:
        way: Line = line(T_start, _pose(entry.end), entry.duration_s, axis)
    except PoseError as error:
        raise InputError(file, f"{field}.half_turn_axis", str(error), "Remove it, or name the turn's axis") from None
    try:
        followed = follow(robot, way, checks, q_start, slot)
    except PoseError:
        problem = f"'{entry.start_branch}' has no solution at the start pose"
        raise InputError(file, f"{field}.start_branch", problem, "Choose another branch, or leave it out") from None
    return Motion(
        entry=entry,
        samples=samples,
        checks=checks,
        t=followed.t,
        q=followed.q,
        joints=followed.joints,
        rates=followed.rates,
        tool=lambda t: way.poses(way.progress(t)[0]),
        way=lambda t: way.length * way.progress(t)[0],
        followed=followed,
    )


def _pose(entry: PoseEntry) -> np.ndarray:
    return transform(np.array(entry.xyz_mm) / 1000, np.radians(entry.rpy_deg))
