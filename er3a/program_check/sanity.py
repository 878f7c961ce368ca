"""Numbers of a program that are likely mistakes: other units, speeds far from the others, a tool or base used once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import chain

import numpy as np

from er3a.finding import Finding, fact
from er3a.kinematics.chain import arm_length
from er3a.numerics.arrays import Reals
from er3a.numerics.si_units import may_be_radians
from er3a.programs.execution import Execution, Step
from er3a.programs.instructions import MM, ArmMotion, JointTarget, Load, NamedFrame, PoseTarget, Rate
from er3a.robots.robot import Robot

IN_SI = ("urscript",)
"""Languages in metres and radians; the others are in millimetres and degrees."""
SMALL = 0.0025  # m, of every coordinate of a target that may have been meant in metres
MOST_TURNED = 4 * np.pi  # rad, beyond which no joint goes; degrees up to 360
MANY_TIMES = 10.0  # the usual speed
USUAL = 3  # motions, from which others are compared with them

Suspect = tuple[Step, str, str, str]
"""A step, the kind of its number, the number as it is written, and what is usual or may be meant."""


def doubtful_settings(execution: Execution, robot: Robot) -> Iterator[tuple[Step, Finding]]:
    """Loads beyond the arm's payload, frames that the program does not set, and numbers that are likely mistakes.

    Parameters
    ----------
    execution : the program, run; each motion of its text counts once
    robot : its size and speeds are the measure

    Returns
    -------
    found : pairs of step and finding, each load and the frames at the first motion with them; suspects are targets that
        look like m or rad, speeds far from the others, a tool or base that one motion alone has
    """
    steps = list({step.place: step for step in execution.steps if isinstance(step.instruction, ArmMotion)}.values())
    motions = [(step, step.instruction) for step in steps if isinstance(step.instruction, ArmMotion)]
    in_mm = execution.program.language not in IN_SI
    frames = [
        (which, [(step, getattr(motion, which)) for step, motion in motions if isinstance(motion.target, PoseTarget)])
        for which in ("tool", "base")
    ]
    suspects = chain(
        _other_units(motions, robot, in_mm),
        _speeds(motions, robot),
        *(_used_once(which, used) for which, used in frames),
    )
    yield from _loads(execution, robot)
    yield from _not_set(execution)
    for step, kind, text, usual in suspects:
        yield step, fact("suspect_number", kind=kind, text=text, usual=usual)


def _loads(execution: Execution, robot: Robot) -> Iterator[tuple[Step, Finding]]:
    wrist = robot.masses.wrist
    first: dict[Load, Step] = {}
    for step in execution.steps:
        if isinstance(what := step.instruction, ArmMotion) and what.load is not None:
            first.setdefault(what.load, step)
    for load, step in first.items():
        if wrist is not None and load.mass is not None and load.mass > wrist.payload:
            yield step, fact("load_above_payload", mass_kg=load.mass, payload_kg=wrist.payload)


def _not_set(execution: Execution) -> Iterator[tuple[Step, Finding]]:
    for step in execution.steps:
        what = step.instruction
        if not isinstance(what, ArmMotion) or not isinstance(what.target, PoseTarget):
            continue
        if not (what.tool.own and what.base.own):
            kind = "tool" if what.base.own else "base" if what.tool.own else "both"
            yield step, fact("frames_from_robot_file", kind=kind)
            return


def _other_units(motions: list[tuple[Step, ArmMotion]], robot: Robot, in_mm: bool) -> Iterator[Suspect]:
    """Targets that are none of the arm's as they are written, and would be in the other unit."""
    reach = arm_length(robot)
    unit, meant, scale = ("mm", "m", MM) if in_mm else ("m", "mm", 1.0)
    for step, motion in motions:
        target, other = motion.target, MM if in_mm else 1 / MM
        if isinstance(target, PoseTarget):
            xyz = target.pose[:3, 3]
            small = np.count_nonzero(np.abs(xyz) > 1e-9) >= 2 and np.abs(xyz).max() < SMALL
            if (small or not in_mm) and 0.1 * reach < other * np.linalg.norm(xyz) < 1.5 * reach:
                yield step, meant, _listed(xyz * scale, unit), _listed(xyz * scale * other, unit)
        elif isinstance(target, JointTarget) and np.isfinite(target.joints).all():
            q = target.joints
            degrees = np.degrees(q)
            if in_mm and may_be_radians(degrees.tolist()):
                yield step, "rad", _listed(degrees, "deg"), _listed(np.degrees(degrees).round(), "deg")
            elif not in_mm and MOST_TURNED < np.abs(q).max() <= 360:
                yield step, "deg", _listed(q, "rad"), _listed(np.radians(q).round(3), "rad")


def _listed(values: Reals, unit: str) -> str:
    return f"({', '.join(f'{value:g}' for value in values)}) {unit}"


def _value(rate: Rate | None, unit: str) -> float | None:
    """A speed in a unit, also of one that the controller does not take."""
    if rate is None or rate.unit != unit:
        return None
    return rate.value if rate.refused is None else rate.refused


def _speeds(motions: list[tuple[Step, ArmMotion]], robot: Robot) -> Iterator[Suspect]:
    known = np.isfinite(robot.speed).all()
    fastest = float(robot.speed.sum()) * arm_length(robot) if known else np.inf  # no point of the arm is faster
    quickest = 2 * float(robot.speed.max()) if known else np.inf
    for step, motion in motions:
        if motion.speed and motion.speed.unit == "share" and motion.speed.text.endswith(" %"):
            yield step, "share", motion.speed.text, "100 %"
        along, turning = _value(motion.speed, "m/s"), _value(motion.speed, "rad/s")
        if along is not None and along > fastest:
            if along / MM < fastest:
                yield step, "mm/s", f"{along:g} m/s", f"{along / MM:g} m/s"
            else:
                yield step, "impossible_speed", f"{MM * along:g} mm/s", f"{MM * fastest:.0f} mm/s"
        if turning is not None and turning > quickest > np.radians(turning):
            yield step, "deg/s", f"{turning:g} rad/s", f"{np.radians(turning):.2f} rad/s"
    given = [(step, motion.speed.value) for step, motion in motions if motion.speed and motion.speed.unit == "m/s"]
    values = [value for _, value in given if value > 0]
    if len(values) > USUAL:
        usual = float(np.median(values))
        for step, value in given:
            if MANY_TIMES * usual < value <= fastest:
                yield step, "speed", f"{1000 * value:g} mm/s", f"{1000 * usual:g} mm/s"


def _used_once(which: str, frames: list[tuple[Step, NamedFrame]]) -> Iterator[Suspect]:
    """Frames that one motion alone has, between others that have one in common."""
    frames = [(step, each) for step, each in frames if each.pose is not None]
    keys = [b"" if each.pose is None else each.pose.round(6).tobytes() for _, each in frames]
    count = Counter(keys)
    for i, (step, frame) in enumerate(frames):
        near = {keys[k] for k in (i - 1, i + 1) if 0 <= k < len(keys)}
        if count[keys[i]] == 1 and len(near) == 1 and count[(usual := near.pop())] >= USUAL - 1:
            other = next(each.name for key, (_, each) in zip(keys, frames) if key == usual)
            yield step, which, frame.name or "?", other or "?"
