"""Writes ABB RAPID: a module with a procedure ``main``.

Joint motions are MoveAbsJ, because cfx would need ABB's own zero and signs; lines and arcs carry the quarters of axes
1, 4 and 6 where the joints are known, and are not supervised (``ConfL \\Off``). What was read as RAPID keeps its
configuration. Durations are written as ``\\T``. A tool is declared with all that hangs on the flange, once for each
load; one without known mass has the least load that a controller takes, and is named.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.programs.instructions import ArmMotion, JointTarget, Listing, NamedFrame, Output, PoseTarget, Zone, numbers_of
from er3a.programs.rapid import data_types
from er3a.programs.rapid.data_types import MIN_LOAD, TURN_SPEED
from er3a.programs.writing import (
    LOAD_DIGITS,
    ReadyMotion,
    WriteOptions,
    Writer,
    ascii_text,
    cut,
    fixed,
    principal_axes,
    short,
)
from er3a.robots.masses import MassBody

NO_AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
DIGITS, QUATERNION_DIGITS = 6, 10
RESERVED_TEXT = """
alias and backward case connect const default div do else elseif endfor endfunc endif endmodule endproc endrecord
endtest endtrap endwhile error exit false for from func goto if inout local main mod module nostepin not noview or pers
proc raise readonly record retry return step sysmodule task test then to trap true trynext undo var viewonly while with
xor
"""
RESERVED = frozenset(RESERVED_TEXT.split())


class RapidWriter(Writer):
    """Writes RAPID."""

    languages = ("rapid",)
    remark, ends = "!", ";"
    loop = ("WHILE TRUE DO", "ENDWHILE")
    wait = ("WaitTime {};", "Stop;", "{}")

    def __init__(self, listing: Listing, options: WriteOptions):
        super().__init__(listing, options)
        if self.name.lower() in RESERVED:
            self.name = f"p{self.name}"
        self.frames: dict[tuple[str, bytes, MassBody | None], str] = {}
        self.declared: list[str] = []

    def files(self, head: list[str]) -> dict[str, str]:
        """The .mod file: tools, work objects and loads, then ``PROC main``.

        Returns
        -------
        files : one text, with the lines of the head as comments
        """
        lines = [
            f"MODULE {self.name}",
            *(f"  ! {ascii_text(line)}" for line in head),
            *(f"  {each}" for each in self.declared),
        ]
        body = ["PROC main()", *(f"  {line}" for line in self.lines), "ENDPROC"]
        return {".mod": "\n".join((*lines, *(f"  {line}" for line in body), "ENDMODULE", ""))}

    def output(self, output: Output) -> None:
        """Write an output by the instruction that was read.

        Parameters
        ----------
        output : its value is the whole instruction
        """
        self.verbatim(output.value)

    def set_load(self, load: MassBody | None) -> None:
        """Write nothing here: loads are in the data of the tools (:meth:`_frame`).

        Parameters
        ----------
        load : of the next motions, which carry it themselves
        """

    def motion(self, ready: ReadyMotion) -> None:
        """Write MoveAbsJ, MoveJ, MoveL or MoveC, and before it what has to be set.

        Parameters
        ----------
        ready : joint motions need the joints (rad); those read from RAPID with a pose keep it. One that can't be
            written is left out.
        """
        motion = ready.motion
        target = motion.target
        own_pose = self.own and motion.kind == "joint" and isinstance(target, PoseTarget)
        if motion.kind == "joint" and not own_pose:
            joints = ready.joints
            if joints is None and isinstance(target, JointTarget):
                joints = target.joints
            if joints is None or np.isnan(joints).any():
                self.omit(motion)
                return
            form, texts = "MoveAbsJ", [_joints_text(joints)]
        else:
            if ready.pose is None or (motion.kind == "arc" and ready.via is None):
                self.omit(motion)
                return
            form = {"arc": "MoveC", "joint": "MoveJ"}.get(motion.kind, "MoveL")
            conf = self._configuration(ready, "ConfJ" if motion.kind == "joint" else "ConfL")
            texts = [] if ready.via is None or motion.kind != "arc" else [_target_text(ready.via, conf)]
            texts.append(_target_text(ready.pose, conf))
        speed = self._speed(ready)
        zone = self._zone(motion)
        base = (
            "" if motion.base.pose is None and not motion.base.name else f"\\WObj:={self._frame(motion.base, 'wobj')}"
        )
        load = motion.load if isinstance(motion.load, MassBody) else motion.tool.load
        tool = self._frame(replace(motion.tool, load=load), "tool")
        if motion.kind == "arc":
            self.set_once("arcs", f"CirPathMode \\{'PathFrame' if motion.with_path else 'ObjectFrame'};")
        self._set_before(motion)
        self.lines.append(f"{form} {','.join(texts)},{speed},{zone},{tool}{base};")

    def _configuration(self, ready: ReadyMotion, supervision: str) -> str:
        """The target's confdata as it was read, or by the joints; not supervised where neither is known."""
        target = ready.motion.target
        said = dict(target.configuration) if isinstance(target, PoseTarget) and self.own else {}
        if {"cf1", "cf4", "cf6", "cfx"} <= said.keys():
            followed = isinstance(target, PoseTarget) and target.branch is not None
            self.set_once(supervision, f"{supervision} \\{'On' if followed else 'Off'};")
            return "[" + ",".join(f"{float(said[key]):g}" for key in ("cf1", "cf4", "cf6", "cfx")) + "]"
        self.set_once(supervision, f"{supervision} \\Off;")
        joints = ready.joints if not self.own and ready.motion.kind != "joint" else None
        if joints is None or len(joints) != 6 or np.isnan(joints).any():
            return "[0,0,0,0]"
        return "[" + ",".join(map(str, data_types.quarters_of(joints))) + ",0]"

    def _frame(self, frame: NamedFrame, kind: str) -> str:
        """The name of a tool or work object, which is declared once."""
        plain = frame.name.isidentifier() and frame.name.isascii() and frame.name.lower() not in RESERVED
        null = f"{kind}0"
        if frame.pose is None:
            if frame.name:
                self.name_tool(frame.name)
            return frame.name if plain else null
        unnamed = not frame.name or frame.name.lower() in (null, "base", "world")
        if np.array_equal(frame.pose, np.eye(4)) and unnamed and frame.load is None:
            return null
        key = (kind, frame.pose.tobytes(), frame.load)
        if key not in self.frames:
            taken = {*self.frames.values(), "tool0", "wobj0"}
            name = frame.name if plain and frame.name not in taken else f"er3a_{kind}{len(self.frames) + 1}"
            self.frames[key] = name
            pose = _pose_text(frame.pose)
            if kind == "tool":
                self.declared.append(f"PERS tooldata {name}:=[TRUE,{pose},{_load_text(frame.load)}];")
                if frame.load is None:
                    self.name_tool(f"the load of {name}")
            else:
                null_pose = "[[0,0,0],[1,0,0,0]]"
                self.declared.append(f'PERS wobjdata {name}:=[FALSE,TRUE,"",{pose},{null_pose}];')
        return self.frames[key]

    def _speed(self, ready: ReadyMotion) -> str:
        motion = ready.motion
        speed = motion.speed
        given = speed is not None and speed.value > 0
        share = None
        if speed is not None and given and speed.unit not in ("s", "m/s"):
            share = self.share(ready)
            self.count["estimated"] += speed.unit != "share"
        if share is not None:
            self.set_once("vel", f"VelSet {short(max(share, 0.001) * 100, 3)},5000;")
            return "vmax"
        self.set_once("vel", "VelSet 100,5000;")  # it may scale timed motions too
        if speed is None or not given:
            return "v100" if motion.kind != "joint" else "vmax"
        if speed.unit == "s":
            return f"v1000\\T:={short(speed.value)}"
        if speed.unit != "m/s":
            return "v100"
        along = speed.value * 1000
        turn = math.degrees(motion.turn_speed) if motion.turn_speed else TURN_SPEED
        if along in data_types.TOOL_SPEEDS and abs(turn - TURN_SPEED) < 1e-9:
            return f"v{along:g}"
        return f"[{short(along)},{short(turn)},{data_types.SLIDE_SPEED:g},{data_types.AXIS_SPEED:g}]"

    def _zone(self, motion: ArmMotion) -> str:
        """A zone by its name, or with turn and external axes as those that have one."""
        zone: Zone = motion.zone
        if zone.kind != "distance" or zone.value <= 0:
            self.count["zones"] += zone.kind != "fine"
            return "fine"
        size = zone.value * 1000
        name = next((name.lower() for name, own in data_types.ZONES.items() if abs(own - size) < 1e-9), "")
        own, wide, turn = (cut(share * size) for share in (1.0, 1.5, 0.15))
        return name or f"[FALSE,{own},{wide},{wide},{turn},{wide},{turn}]"

    def _set_before(self, motion: ArmMotion) -> None:
        acceleration = motion.acceleration
        if acceleration is None:
            return
        if acceleration.unit == "share":
            self.set_once("acc", f"AccSet {short(min(max(acceleration.value * 100, 20), 100), 3)},100;")
        elif acceleration.unit == "m/s2":
            value = short(acceleration.value)
            self.set_once("limit", f"PathAccLim TRUE\\AccMax:={value},TRUE\\DecelMax:={value};")


def _joints_text(joints: Reals) -> str:
    degrees = [fixed(math.degrees(value), DIGITS) for value in joints]
    return f"[[{','.join([*degrees, *['0'] * (6 - len(degrees))])}],{NO_AXES}]"


def _load_text(load: MassBody | None) -> str:
    """loaddata, with the principal axes of the inertia; the least that a controller takes if it is not known."""
    if load is None:
        return f"[{MIN_LOAD},[0,0,{MIN_LOAD}],[1,0,0,0],0,0,0]"
    pose, moments = principal_axes(load)
    quaternion = ",".join(fixed(each, QUATERNION_DIGITS) for each in numbers_of(pose, "abb")[3:])
    centre = ",".join(short(each * 1000) for each in load.centre)
    about = ",".join(short(float(each), LOAD_DIGITS) for each in moments)
    return f"[{short(load.mass)},[{centre}],[{quaternion}],{about}]"


def _pose_text(pose: Reals) -> str:
    x, y, z, *quaternion = numbers_of(pose, "abb")
    turn = ",".join(fixed(each, QUATERNION_DIGITS) for each in quaternion)
    return f"[[{fixed(x, DIGITS)},{fixed(y, DIGITS)},{fixed(z, DIGITS)}],[{turn}]]"


def _target_text(pose: Reals, conf: str) -> str:
    return f"{_pose_text(pose)[:-1]},{conf},{NO_AXES}]"
