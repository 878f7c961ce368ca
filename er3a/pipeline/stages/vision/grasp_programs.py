"""Programs of a grasp, for controllers: to the approach, to the grasp, where the gripper closes, and away."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.vision.model import GraspPrograms
from er3a.programs.arm_joints import not_written
from er3a.programs.csv_program import write_csv
from er3a.programs.from_commands import TO_START
from er3a.programs.instructions import (
    ArmMotion,
    Instruction,
    JointTarget,
    Listing,
    NamedFrame,
    Pause,
    PoseTarget,
    Rate,
    Remark,
)
from er3a.programs.syntax import Language
from er3a.programs.write_program import write_program
from er3a.programs.writing import HEAD, WriteOptions, ascii_text, program_name
from er3a.robots.robot import Robot
from er3a.robots.shown import joint_columns, shown
from er3a.vision.grasp_motion import GraspLeg
from er3a.vision.grasping import ChosenGrasp

LONGEST_NAME = 24
GRIPPER_S = 1.0
CLOSE = "close the gripper here"  # in a controller's file, which is plain ASCII
CSV_POINTS = 41


def grasp_programs(
    robot: Robot, name: str, home: Reals, chosen: ChosenGrasp, languages: Sequence[Language]
) -> GraspPrograms:
    """A grasp in each language that has this arm's joints."""
    own = program_name(f"grasp_{name}", LONGEST_NAME)
    head = f"grasp {ascii_text(chosen.grasp)} of {ascii_text(name)} by {ascii_text(robot.title)}, from where it waits"
    rows: list[tuple[str, str, str]] = []
    for language in languages:
        if not_written(language, robot):
            continue
        if language == "csv":
            files = {".csv": _table(robot, chosen, head)}
        else:
            options = WriteOptions(robot, home, head=(head,))
            files = dict(write_program(_listing(robot, own, home, chosen), language, options).files)
        rows += [(language, own + suffix, text) for suffix, text in files.items()]
    return GraspPrograms(
        target=np.full(len(rows), name, object),
        language=np.array([row[0] for row in rows], object),
        file=np.array([row[1] for row in rows], object),
        text=np.array([row[2] for row in rows], object),
    )


def _listing(robot: Robot, name: str, home: Reals, chosen: ChosenGrasp) -> Listing:
    tool, base, to_robot = NamedFrame("", robot.tool), NamedFrame("", np.eye(4)), np.linalg.inv(robot.base)
    found: list[Instruction] = [ArmMotion("joint", JointTarget(home), speed=TO_START, tool=tool, base=base)]
    for before, leg in zip((None, *chosen.legs), chosen.legs):
        if before is not None and _closes(before, leg):
            found += [Remark(CLOSE), Pause(GRIPPER_S)]
        rate = Rate(leg.duration, "s")
        if leg.T_end is None:
            found.append(ArmMotion("joint", JointTarget(leg.q_end), speed=rate, tool=tool, base=base))
        else:
            target = PoseTarget(to_robot @ leg.T_end, joints=leg.q_end)
            found.append(ArmMotion("line", target, speed=rate, tool=tool, base=base))
    return Listing(name, tuple(found))


def _table(robot: Robot, chosen: ChosenGrasp, head: str) -> str:
    """The motion over time, at rest where the gripper closes."""
    times, rows, now = [np.zeros(1)], [chosen.legs[0].joints(np.zeros(1))], 0.0
    for leg, next_leg in zip(chosen.legs, (*chosen.legs[1:], None)):
        t, q = leg.sampled(CSV_POINTS)
        times.append(now + t[1:])
        rows.append(q[1:])
        now += leg.duration
        if next_leg is not None and _closes(leg, next_leg):
            now += GRIPPER_S
            times.append(np.array([now]))
            rows.append(q[-1:])
    joints = np.concatenate(rows)
    poses = np.linalg.inv(robot.base) @ forward(robot, joints)
    return write_csv(np.concatenate(times), shown(robot, joints), poses, (HEAD + head,), joint_columns(robot))


def _closes(before: GraspLeg, behind: GraspLeg) -> bool:
    """Whether the gripper closes between two legs."""
    return before.part == "approach" and behind.part == "retreat"
