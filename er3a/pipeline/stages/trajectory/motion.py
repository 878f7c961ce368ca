"""A path of the path file as a motion of one robot: joints, rates and tool pose at any time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicHermiteSpline

from er3a.errors import PoseError
from er3a.files.path_file import PathEntry
from er3a.kinematics.forward import forward, jacobian
from er3a.numerics.arrays import Reals
from er3a.planning.build import Built, build
from er3a.planning.commands import CommandSource
from er3a.planning.follow import follow
from er3a.planning.followed import Followed
from er3a.planning.moves import JointMove
from er3a.planning.sequences import JointSequence
from er3a.robots.robot import Robot


@dataclass(frozen=True, eq=False)
class Motion:
    """A path, ready to be checked.

    Attributes
    ----------
    built : what the entry was made into
    samples, checks : times in s of the path's own points, and with the points checked between them
    t, q : (N,) s and (N, 6) rad, the checks and whatever the branches of a line needed besides; q NaN where unreachable
    joints : angles (..., 6) at times (...,)
    rates : angles, velocities and accelerations, each (n, 6), at times (n,)
    tool : T_base_tool (n, 4, 4) that the path asks for at times (n,)
    way : length of the tool point's way (n,) in m at times (n,)
    followed : how a path of the tool is followed; None for one in joint space
    """

    entry: PathEntry
    built: Built
    samples: Reals
    checks: Reals
    t: Reals
    q: Reals
    joints: Callable[[Reals], Reals]
    rates: Callable[[Reals], tuple[Reals, Reals, Reals]]
    tool: Callable[[Reals], Reals]
    way: Callable[[Reals], Reals]
    followed: Followed | None


def motion_of(
    robot: Robot, entry: PathEntry, checks_per_sample: int, source: CommandSource, ends: Mapping[str, Reals]
) -> Motion:
    """Plan a path, and follow it if it is one of the tool; ``ends`` as for :func:`er3a.planning.build.build`.

    Raises
    ------
    InputError
        for what :func:`er3a.planning.build.build` refuses, and a start branch that has no solution at the start
    """
    built = build(robot, entry.command(source, robot), ends)
    samples = np.linspace(0.0, built.duration, entry.samples)
    checks = np.linspace(0.0, built.duration, (entry.samples - 1) * (checks_per_sample + 1) + 1)
    checks[:: checks_per_sample + 1] = samples
    if built.joints is not None:
        return _joint_motion(robot, entry, built, built.joints, samples, checks)
    path = built.tool
    if path is None:
        raise ValueError(f"{entry.name}: neither a move of the joints nor a path of the tool")
    try:
        followed = follow(robot, path, checks, built.q_start, built.start_slot)
    except PoseError:
        branch = getattr(entry, "start_branch", None)
        problem = f"'{branch}' has no solution at the start pose"
        raise source.error("start_branch", problem, "Choose another branch, or leave it out") from None
    return Motion(
        entry=entry,
        built=built,
        samples=samples,
        checks=checks,
        t=followed.t,
        q=followed.q,
        joints=followed.joints,
        rates=followed.rates,
        tool=lambda t: path.poses(path.progress(t)[0]),
        way=lambda t: path.way(path.progress(t)[0]),
        followed=followed,
    )


def _joint_motion(
    robot: Robot, entry: PathEntry, built: Built, move: JointMove | JointSequence, samples: Reals, checks: Reals
) -> Motion:
    q, velocity, _ = move.joints(checks)
    speed = np.linalg.norm(np.einsum("nij,nj->ni", jacobian(robot, q)[:, :3], velocity), axis=1)
    way = CubicHermiteSpline(checks, cumulative_simpson(speed, x=checks, initial=0.0), speed)
    return Motion(
        entry=entry,
        built=built,
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
