"""Numbers of a program that are likely mistakes: other units, speeds far from the others, a tool or base used once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Literal

import numpy as np

from er3a.kinematics.chain import arm_length
from er3a.numerics.si_units import may_be_radians
from er3a.program_check.program_check_findings import SuspectNumber
from er3a.programs.execution import Execution, Step
from er3a.programs.instructions import ArmMotion, JointTarget, NamedFrame, PoseTarget
from er3a.robots.robot import Robot

IN_MM = frozenset(("krl", "rapid", "rpl", "xpl"))
SMALL = 0.0025  # m, of every coordinate of a target that may have been meant in metres
MANY_TIMES = 10.0  # the usual speed
USUAL = 3  # motions, from which others are compared with them


def suspect_numbers(execution: Execution, robot: Robot) -> Iterator[tuple[Step, SuspectNumber]]:
    """Numbers of a program that are likely mistakes.

    Parameters
    ----------
    execution : the program, run; each motion of its text counts once
    robot : its size and speeds are the measure

    Returns
    -------
    suspects : pairs of step and finding: targets that look like m or rad, speeds far from the others, a tool or base
        that one motion alone has
    """
    steps = list({step.place: step for step in execution.steps if isinstance(step.instruction, ArmMotion)}.values())
    motions = [(step, step.instruction) for step in steps if isinstance(step.instruction, ArmMotion)]
    if execution.program.language in IN_MM:
        yield from _other_units(motions, robot)
    yield from _speeds(motions, robot)
    for which in ("tool", "base"):
        frames = [(step, getattr(motion, which)) for step, motion in motions if isinstance(motion.target, PoseTarget)]
        yield from ((step, SuspectNumber(which, *names)) for step, *names in _used_once(frames))  # type: ignore[arg-type]


def _other_units(motions: list[tuple[Step, ArmMotion]], robot: Robot) -> Iterator[tuple[Step, SuspectNumber]]:
    reach = arm_length(robot)
    for step, motion in motions:
        if isinstance(motion.target, PoseTarget):
            xyz = motion.target.pose[:3, 3]
            others = np.count_nonzero(np.abs(xyz) > 1e-9) >= 2 and np.abs(xyz).max() < SMALL
            if others and 0.1 * reach < 1000 * np.linalg.norm(xyz) < 1.5 * reach:
                mm = ", ".join(f"{1000 * value:g}" for value in xyz)
                yield step, SuspectNumber("metres", f"({mm}) mm", f"({', '.join(f'{1e6 * v:.0f}' for v in xyz)}) mm")
        elif isinstance(motion.target, JointTarget) and not robot.slides.any():
            degrees = np.degrees(motion.target.joints)
            if np.isfinite(degrees).all() and may_be_radians(degrees.tolist()):
                turned = ", ".join(f"{value:.0f}" for value in np.degrees(degrees))
                yield step, SuspectNumber("radians", f"({', '.join(f'{v:g}' for v in degrees)}) deg", f"({turned}) deg")


def _speeds(motions: list[tuple[Step, ArmMotion]], robot: Robot) -> Iterator[tuple[Step, SuspectNumber]]:
    slides = robot.slides.any() or not np.isfinite(robot.speed).all()
    fastest = np.inf if slides else float(robot.speed.sum()) * arm_length(robot)  # no point of the arm is faster
    for step, motion in motions:
        if motion.speed and motion.speed.unit == "share" and motion.speed.text.endswith(" %"):
            yield step, SuspectNumber("share", motion.speed.text, "100 %")
        if motion.speed and motion.speed.unit == "m/s" and motion.speed.value > fastest:
            kind: Literal["impossible_speed"] = "impossible_speed"
            yield step, SuspectNumber(kind, f"{1000 * motion.speed.value:g} mm/s", f"{1000 * fastest:.0f} mm/s")
    given = [(step, motion.speed.value) for step, motion in motions if motion.speed and motion.speed.unit == "m/s"]
    values = [value for _, value in given if value > 0]
    if len(values) > USUAL:
        usual = float(np.median(values))
        for step, value in given:
            if MANY_TIMES * usual < value <= fastest:
                yield step, SuspectNumber("speed", f"{1000 * value:g} mm/s", f"{1000 * usual:g} mm/s")


def _used_once(frames: list[tuple[Step, NamedFrame]]) -> Iterator[tuple[Step, str, str]]:
    """Frames that one motion alone has, between others that have one in common."""
    frames = [(step, each) for step, each in frames if each.pose is not None]
    keys = [b"" if each.pose is None else each.pose.round(6).tobytes() for _, each in frames]
    count = Counter(keys)
    for i, (step, frame) in enumerate(frames):
        near = {keys[k] for k in (i - 1, i + 1) if 0 <= k < len(keys)}
        if count[keys[i]] == 1 and len(near) == 1 and count[(usual := near.pop())] >= USUAL - 1:
            other = next(each.name for key, (_, each) in zip(keys, frames) if key == usual)
            yield step, frame.name or "?", other or "?"
