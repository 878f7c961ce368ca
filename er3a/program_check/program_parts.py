"""A program as paths: stretches of joint moves, and stretches of lines and arcs, one after another."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from er3a.errors import InputError
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.planning.commands import (
    Command,
    CommandSource,
    JointSequenceCommand,
    SegmentCommand,
    Start,
    ToolSequenceCommand,
)
from er3a.program_check.check_program import ProgramCheck
from er3a.program_check.motion_laws import RAMP_OF_A_DURATION
from er3a.program_check.step_checks import CheckedMotion
from er3a.program_check.ways import MotionWay
from er3a.programs.instructions import PoseTarget
from er3a.robots.robot import Robot

MOST_OF_A_MOTION = 0.49  # that a rounded corner takes


@dataclass(frozen=True, eq=False)
class ProgramPart:
    """A stretch of a program: joint moves with a stop at each target, or lines and arcs.

    Attributes
    ----------
    lines : of the first and the last instruction
    """

    kind: Literal["joint_sequence", "sequence"]
    lines: tuple[int, int]
    made: Command

    def command(self, source: CommandSource) -> Command:
        """The path, with what errors call it."""
        return replace(self.made, source=source)


def parts_of(check: ProgramCheck, robot: Robot, source: CommandSource) -> list[ProgramPart]:
    """The way with the most motions, up to the first motion that can't be carried out; that one is the last.

    Raises
    ------
    InputError
        for a program that does not move the arm, or whose tool is not the robot's
    """
    groups: list[list[tuple[int, CheckedMotion]]] = []
    for number in check.main:
        motion = check.motions.get(number)
        if motion is None or motion.stays or motion.start is None:
            continue
        if motion.way is None or motion.placed.motion.angle is not None:
            break
        line = check.execution.steps[number].place.line
        if motion.kind != "joint" and not np.allclose(motion.placed.arm.tool, robot.tool, rtol=0, atol=1e-12):
            problem = f"line {line} moves another tool than the robot's"
            raise source.error("program", problem, "Give the robot this tool in its file or in the study")
        same = groups and (groups[-1][-1][1].kind == "joint") == (motion.kind == "joint")
        if same:
            groups[-1].append((line, motion))
        else:
            groups.append([(line, motion)])
        if motion.end is None:
            break
    if not groups:
        raise InputError(source.file, f"{source.field}.program", "no motion has a known way", "Give start_deg")
    return [_part(group) for group in groups]


def _part(group: list[tuple[int, CheckedMotion]]) -> ProgramPart:
    lines = (group[0][0], group[-1][0])
    motions = [motion for _, motion in group]
    ways = [motion.way for motion in motions if motion.way is not None]
    duration = sum(way.law.duration for way in ways)
    start = motions[0].start
    assert start is not None
    if motions[0].kind == "joint":
        points = np.stack([start, *(motion.end for motion in motions if motion.end is not None)])
        return ProgramPart("joint_sequence", lines, JointSequenceCommand(points, 0.0, duration, RAMP_OF_A_DURATION))
    blends = [_blend(motion, way, after) for motion, (way, after) in zip(motions, pairwise(ways))] + [0.0]
    segments = tuple(_segment(motion, blend) for motion, blend in zip(motions, blends))
    command = ToolSequenceCommand(Start(joints=start), segments, duration, RAMP_OF_A_DURATION)
    return ProgramPart("sequence", lines, command)


def _blend(motion: CheckedMotion, way: MotionWay, after: MotionWay) -> float:
    zone = motion.placed.motion.zone
    if zone.kind != "distance":
        return 0.0
    return min(zone.value, MOST_OF_A_MOTION * way.length, MOST_OF_A_MOTION * after.length)


def _segment(checked: CheckedMotion, blend: float) -> SegmentCommand:
    """The motion's end and point, in the frame that the robot's base is placed in."""
    motion, base = checked.placed.motion, checked.placed.base
    via: Reals | None = None
    if motion.kind == "arc" and isinstance(motion.via, PoseTarget) and base is not None:
        via = (base @ motion.via.pose)[:3, 3]
    if isinstance(motion.target, PoseTarget) and base is not None:
        return SegmentCommand(base @ motion.target.pose, via, blend=blend)
    assert checked.end is not None
    return SegmentCommand(forward(checked.placed.arm, checked.end), via, blend=blend)
