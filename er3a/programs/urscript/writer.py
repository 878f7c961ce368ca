"""Writes URScript: metres, radians, rotation vectors."""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.programs.instructions import RAMP_OF_A_DURATION, Output, PoseTarget, numbers_of
from er3a.programs.urscript.dialect import DEFAULTS
from er3a.programs.writing import LOAD_DIGITS, ReadyMotion, Writer, by_length, cut, fixed, short
from er3a.robots.masses import MassBody

DIGITS = 9


class UrScriptWriter(Writer):
    """Writes URScript."""

    languages = ("urscript",)
    longest_name = 40
    indent = "  "
    stops = False  # whether the arm stops where the program has a zone that URScript has not
    loop = ("while (True):", "end")
    wait = ("sleep({})", 'popup("Go on?", "Program", False, False, blocking=True)', "{}")

    def files(self, head: list[str]) -> dict[str, str]:
        """The .script file: one function, which is the program.

        Returns
        -------
        files : the lines of the head are comments at the function's beginning
        """
        lines = [f"def {self.name}():", *(f"  # {line}" for line in head), *self.lines, "end", ""]
        return {".script": "\n".join(lines)}

    def begin_loop(self) -> None:
        """``while (True):``, with its body indented."""
        super().begin_loop()
        self.indent = "    "

    def end_loop(self) -> None:
        """``end``."""
        self.indent = "  "
        super().end_loop()

    def comment(self, text: str) -> None:
        """Add a comment, ``# text``.

        Parameters
        ----------
        text : a line that begins with a dollar sign and a blank (the pendant's own marks) is kept as it is
        """
        self.line(text if text.startswith("$ ") else f"# {text}")

    def output(self, output: Output) -> None:
        """Write an output, such as ``set_digital_out(0, True)``.

        Parameters
        ----------
        output : TRUE and FALSE are written as URScript has them, other values as they are
        """
        name, _, rest = output.name.partition("[")
        value = output.value.capitalize() if output.value in ("TRUE", "FALSE") else output.value
        self.line(f"set_{name}({rest.rstrip(']')}, {value})" if rest else f"set_{output.name}({value})")

    def verbatim(self, text: str) -> None:
        """Add a line as it was read.

        Parameters
        ----------
        text : of URScript; blanks and line ends become single spaces
        """
        self.line(" ".join(text.split()))

    def set_load(self, load: MassBody | None) -> None:
        """Write ``set_payload``, or ``set_target_payload`` for a load with an inertia.

        Parameters
        ----------
        load : kg, m, kg m^2, in the flange's axes; None is written as a mass of 0
        """
        load = load or MassBody(0.0)
        parts = [f"[{', '.join(short(each, LOAD_DIGITS) for each in part)}]" for part in (load.centre, load.inertia)]
        given = ", ".join((short(load.mass), *parts)) if any(load.inertia) else f"{short(load.mass)}, {parts[0]}"
        self.line(f"set_{'target_' if any(load.inertia) else ''}payload({given})")

    def motion(self, ready: ReadyMotion) -> None:
        """Write movej, movel, movep or movec, and before it the tool where it changes.

        Parameters
        ----------
        ready : targets are joints (rad), or poses in the robot's base; one that can't be written is left out
        """
        motion = ready.motion
        target = self._target(ready)
        base = motion.base
        if target is None or (motion.kind == "arc" and ready.via is None):
            self.omit(motion)
            return
        if base.pose is None and base.name:
            self.name_tool(base.name)
        self._tool(ready)
        if motion.kind == "joint":
            form = "movej"
        elif motion.kind == "arc":
            form = "movec"
        else:
            form = "movep" if motion.form == "movep" else "movel"
        via = "" if ready.via is None else f"{_pose_text(self._in_robot(ready, ready.via))}, "
        self.line(f"{form}({via}{target}{self._speed(ready, form)}{self._zone(ready)})")

    def _target(self, ready: ReadyMotion) -> str | None:
        target = ready.motion.target
        if ready.motion.kind == "joint":
            if isinstance(target, PoseTarget) and target.joints is None and (self.own or ready.joints is None):
                pose = _pose_text(self._in_robot(ready, target.pose))
                near = "" if target.near is None else f", qnear={_joints_text(target.near)}"
                return f"get_inverse_kin({pose}{near})" if near else pose
            return None if ready.joints is None else _joints_text(ready.joints)
        return None if ready.pose is None else _pose_text(self._in_robot(ready, ready.pose))

    def _in_robot(self, ready: ReadyMotion, pose: Reals) -> Reals:
        base = ready.motion.base.pose
        if base is None or np.array_equal(base, np.eye(4)):
            return pose
        return base @ pose

    def _tool(self, ready: ReadyMotion) -> None:
        tool = ready.motion.tool
        if tool.pose is None:
            if tool.name:
                self.name_tool(tool.name)
            return
        self.set_once("tcp", f"set_tcp({_pose_text(tool.pose)})")

    def _speed(self, ready: ReadyMotion, form: str) -> str:
        """Acceleration and speed, or the motion's time, unless that is too short for a motion from rest to rest."""
        motion = ready.motion
        usual_a, usual_v = DEFAULTS[form]
        joint = motion.kind == "joint"
        given = motion.acceleration
        a = given.value if given is not None and given.unit == ("rad/s2" if joint else "m/s2") else usual_a
        speed = motion.speed
        stops, self.stops = self.stops, motion.zone.kind not in ("fine", "distance")
        timed = speed is not None and speed.unit == "s" and speed.value > 0
        if speed is not None and timed and form == "movej" and (stops or self.stops or self._is_short(ready)):
            self.count["estimated"] += 1
            v = self.leading_joint_speed(ready)
            return f", a={short(a)}, v={short(usual_v if v is None else v)}"
        if speed is not None and timed and form in ("movej", "movel"):
            return f", a={short(a)}, t={short(speed.value)}"
        v = self.leading_joint_speed(ready) if joint else by_length(ready, "m/s")
        if v is None and joint and (seconds := by_length(ready, "s")) is not None:
            return f", a={short(a)}, t={short(seconds)}"
        if speed is not None and speed.unit == "s":
            self.count["estimated"] += 1
        return f", a={short(a)}, v={short(v if v is not None and v > 0 else usual_v)}"

    def _is_short(self, ready: ReadyMotion) -> bool:
        """Whether a joint would be too fast if it moved in the motion's time with ramps as check-program takes them."""
        speed, before, after = ready.motion.speed, ready.joints_before, ready.joints
        if speed is None or before is None or after is None or self.robot is None:
            return False
        peak = np.abs(after - before) / speed.value / (1 - RAMP_OF_A_DURATION)
        return any(float(each) > self._speed_of(joint)[0] for joint, each in enumerate(peak))

    def _zone(self, ready: ReadyMotion) -> str:
        zone = ready.motion.zone
        if zone.kind == "distance" and zone.value > 0:
            return f", r={cut(zone.value)}"
        self.count["zones"] += zone.kind != "fine"
        return ""


def _joints_text(joints: Reals) -> str:
    return "[" + ", ".join(fixed(float(value), DIGITS) for value in joints) + "]"


def _pose_text(pose: Reals) -> str:
    return "p[" + ", ".join(fixed(value, DIGITS) for value in numbers_of(pose, "ur")) + "]"
