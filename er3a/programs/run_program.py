"""Runs a program that was read: :func:`execute`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from er3a.errors import InputError, ShapeError
from er3a.geometry.transforms import check_poses
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.programs.arm_joints import not_expressed
from er3a.programs.dialect import Dialect
from er3a.programs.execution import Execution, KeepOn, RunLimits
from er3a.programs.krl_dialect import KrlDialect
from er3a.programs.machine import Machine
from er3a.programs.position import Cell
from er3a.programs.rpl_dialect import RplDialect
from er3a.programs.syntax import Language, Program
from er3a.programs.urscript_dialect import UrScriptDialect
from er3a.robots.robot import Robot

DIALECTS: Mapping[Language, type[Dialect]] = {
    "krl": KrlDialect,
    "urscript": UrScriptDialect,
    "rpl": RplDialect,
    "xpl": RplDialect,
    "csv": RplDialect,
}


def execute(
    program: Program,
    robot: Robot | None = None,
    start: Reals | None = None,
    frames: Mapping[str, Reals] | None = None,
    limits: RunLimits | None = None,
    keep_on: KeepOn | None = None,
) -> Execution:
    """The instructions of a program in the order of their execution, on every way through it.

    Parameters
    ----------
    robot : the arm, for what the text gives by where the arm stands: partial and relative targets
    start : (n,), rad, joints where the program starts
    frames : T_flange_tool of tools and T_robot_base of bases (4, 4) in m, by the program's names for them
    keep_on : asked whether to go on; where it says no, each way ends as ``stopped``

    Raises
    ------
    InputError
        for an arm that the program's language, or the table, has not the joints of
    ShapeError, PoseError
        for a start that has not an angle for each joint, and a frame that is no rigid transform
    """
    if robot is not None and (reason := _not_meant(program, robot)):
        raise InputError(program.file, None, reason, "Give the arm that the program is meant for")
    if robot is not None and start is not None and np.shape(start) != robot.lower.shape:
        raise ShapeError("start", np.shape(start), f"({len(robot.lower)},)")
    flange = None
    if robot is not None:
        bare = robot.without_tool().replace(base=np.eye(4))

        def flange(joints: Reals) -> Reals:
            return forward(bare, joints)

    known = {name: check_poses(pose, name) for name, pose in (frames or {}).items()}
    cell = Cell(flange, start, frames=known)
    if robot is not None:
        cell = replace(cell, joints=robot.joints, tool=robot.tool, base=np.eye(4))
    return Machine(program, DIALECTS[program.language](), cell, limits or RunLimits(), keep_on).run()


def _not_meant(program: Program, robot: Robot) -> str:
    """Why a program is none of an arm's; empty if it is."""
    if program.language != "csv":
        return not_expressed(program.language, robot)
    if len(program.slides) != robot.joints:
        return f"the table has {len(program.slides)} joints, and this arm has {robot.joints}"
    for joint, (slides, own) in enumerate(zip(program.slides, robot.slides.tolist()), 1):
        if slides != own:
            return f"joint {joint} is in {'mm' if slides else 'deg'}, and this arm's {'slides' if own else 'turns'}"
    return ""
