"""Writes KUKA KRL: a .src file with its .dat file.

Joint motions are in axis form, because status and turn would need KUKA's own zero and signs; positions keep the S and
T that were read, and get none otherwise.
"""

from __future__ import annotations

import math

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.programs import instructions
from er3a.programs.instructions import PoseTarget
from er3a.programs.krl.dialect import AXIS_KEYS, FRAME_KEYS, TURN_RATES, ZONES
from er3a.programs.writing import (
    LOAD_DIGITS,
    ReadyMotion,
    WriteOptions,
    Writer,
    ascii_text,
    by_length,
    cut,
    fixed,
    principal_axes,
    short,
)
from er3a.robots.masses import MassBody

DIGITS = 6
KNOWN_FRAMES = ("TOOL_DATA[", "BASE_DATA[", "$NULLFRAME", "$WORLD", "$ROBROOT")


class KrlWriter(Writer):
    """Writes KRL."""

    languages = ("krl",)
    remark = ";"
    loop = ("LOOP", "ENDLOOP")
    wait = ("WAIT SEC {}", "HALT", "WAIT FOR {}")

    def __init__(self, listing: instructions.Listing, options: WriteOptions):
        super().__init__(listing, options)
        given = (motion.acceleration for motion in listing.motions if motion.kind == "joint")
        self.accelerates_fully = all(each is None or (each.unit, each.value) == ("share", 1.0) for each in given)

    def files(self, head: list[str]) -> dict[str, str]:
        """The .src and the .dat file, which have to be loaded together.

        Returns
        -------
        files : the .src begins with ``BAS(#INITMOV,0)``, after the lines of the head as comments
        """
        body = [f"; {ascii_text(line)}" for line in head]
        body += ["BAS(#INITMOV,0)", *self.lines]
        lines = ["&ACCESS RVP", "&REL 1", f"DEF {self.name}( )", *body, "END", ""]
        data = [f"DEFDAT {self.name} PUBLIC", "EXT BAS (BAS_COMMAND :IN,REAL :IN)", "ENDDAT", ""]
        return {".src": "\n".join(lines), ".dat": "\n".join(data)}

    def output(self, output: instructions.Output) -> None:
        """Write an output, such as ``$OUT[8]=TRUE``.

        Parameters
        ----------
        output : a value with brackets is a whole statement, such as a PULSE, and is repeated
        """
        called = "(" in output.value
        self.lines.append(output.value if called else f"{output.name}={output.value}")

    def set_load(self, load: MassBody | None) -> None:
        """Write ``$LOAD``, with the principal axes of its inertia.

        Parameters
        ----------
        load : kg, m, kg m^2, in the flange's frame; None is written as a mass below 0, which means unknown
        """
        pose, moments = (np.eye(4), np.zeros(3)) if load is None else principal_axes(load)
        about = ",".join(f"{axis} {short(float(each), LOAD_DIGITS)}" for axis, each in zip("XYZ", moments))
        mass = "-1.0" if load is None else short(load.mass)
        self.set_once("$LOAD", f"$LOAD={{M {mass},CM {_frame_text(pose)},J {{{about}}}}}")

    def motion(self, ready: ReadyMotion) -> None:
        """Write PTP, LIN or CIRC, and before it tool, base, speeds and zone where they change.

        Parameters
        ----------
        ready : joint motions are written by their axes; one whose target can't be written is left out
        """
        motion = ready.motion
        target = self._target(ready)
        via = None if ready.via is None else _frame_text(ready.via)
        if target is None or (motion.kind == "arc" and via is None):
            self.omit(motion)
            return
        self._frame("$TOOL", motion.tool)
        self._frame("$BASE", motion.base)
        self._speeds(ready)
        zone = self._zone(motion)
        if motion.kind == "arc":
            self.lines.append(f"CIRC {via}, {target}{zone}")
        else:
            self.lines.append(f"{'PTP' if motion.kind == 'joint' else 'LIN'} {target}{zone}")

    def _target(self, ready: ReadyMotion) -> str | None:
        target = ready.motion.target
        if ready.motion.kind == "joint":
            turns = self._turns(target)
            if isinstance(target, PoseTarget) and {"S", "T"} <= turns.keys():
                return _frame_text(target.pose, turns)
            if ready.joints is not None:
                return _axes_text(ready.joints)
            return _axes_text(target.joints) if isinstance(target, instructions.JointTarget) else None
        if ready.pose is None:
            return None
        return _frame_text(ready.pose, self._turns(target))

    def _turns(self, target: instructions.Target) -> dict[str, int]:
        """Status and Turn of a target that was read from KRL, as far as they are known."""
        given = target.configuration if isinstance(target, PoseTarget) and self.own else ()
        return {key: int(value) for key, value in given if key in ("S", "T") and not isinstance(value, str)}

    def _frame(self, variable: str, frame: instructions.NamedFrame) -> None:
        if frame.name.startswith(KNOWN_FRAMES):
            text = frame.name
        elif frame.pose is not None:
            null = np.array_equal(frame.pose, np.eye(4))
            text = "$NULLFRAME" if null else _frame_text(frame.pose).replace("{", "{FRAME: ", 1)
        else:
            if frame.name:
                self.name_tool(frame.name)
            return
        self.set_once(variable, f"{variable}={text}")

    def _speeds(self, ready: ReadyMotion) -> None:
        motion = ready.motion
        if motion.kind == "joint":
            self._joint_speed(ready)
            acceleration = motion.acceleration
            if acceleration is not None and acceleration.unit == "share" and not self.accelerates_fully:  # by INITMOV
                self.set_once("acc", f"BAS(#ACC_PTP,{short(acceleration.value * 100, 3)})")
            return
        speed = by_length(ready, "m/s")
        if speed is not None and speed > 0:
            self.set_once("$VEL.CP", f"$VEL.CP={short(speed)}")
        if motion.speed is not None and motion.speed.unit != "m/s":
            self.count["estimated"] += 1
        if motion.acceleration is not None and motion.acceleration.unit == "m/s2":
            self.set_once("$ACC.CP", f"$ACC.CP={short(motion.acceleration.value)}")
        if motion.turn_speed is not None:
            for name in TURN_RATES:
                self.set_once(name, f"{name}={short(math.degrees(motion.turn_speed))}")

    def _joint_speed(self, ready: ReadyMotion) -> None:
        speed = ready.motion.speed
        share = self.share(ready)
        if speed is None or (share is None and speed.unit == "share"):
            return
        if speed.unit != "share":
            self.count["estimated"] += 1
        if share is None:
            return
        self.set_once("vel", f"BAS(#VEL_PTP,{short(max(share, 0.001) * 100, 3)})")

    def _zone(self, motion: instructions.ArmMotion) -> str:
        zone, joint = motion.zone, motion.kind == "joint"
        for word, (kind, variable, scale) in ZONES.items():
            sized = zone.kind == kind
            if joint == (word == "C_PTP") and (sized or (zone.kind == "named" and zone.text == word)):
                if sized:
                    self.set_once(variable, f"{variable}={cut(zone.value * scale, 3)}")
                return f" {word}"
        self.count["zones"] += zone.kind != "fine"
        return ""


def _axes_text(joints: Reals) -> str:
    parts = [
        f"{key} {fixed(math.degrees(value), DIGITS)}" for key, value in zip(AXIS_KEYS, joints) if not np.isnan(value)
    ]
    return "{" + ",".join(parts) + "}"


def _frame_text(pose: Reals, turns: dict[str, int] | None = None) -> str:
    parts = [f"{key} {fixed(value, DIGITS)}" for key, value in zip(FRAME_KEYS, instructions.numbers_of(pose, "kuka"))]
    parts += [f"{key} {value}" for key, value in (turns or {}).items()]
    return "{" + ",".join(parts) + "}"
