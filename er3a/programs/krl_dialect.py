"""What KRL's motions, frames and functions mean."""

from __future__ import annotations

import math
from typing import NamedTuple

from er3a.programs.angle_conventions import pose_of
from er3a.programs.evaluation import IN_DEGREES, ProgramMemory
from er3a.programs.instructions import (
    FINE,
    ArmMotion,
    Aside,
    Instruction,
    MotionKind,
    NamedFrame,
    Output,
    Rate,
    Unknown,
    Zone,
)
from er3a.programs.krl_settings import base_of, keep_setting, set_by_bas, tool_of
from er3a.programs.krl_targets import FRAME_KEYS, frame_record, is_frame, record_pose, relative, target
from er3a.programs.syntax import Doing, Expression, Invocation, Move, Variable
from er3a.programs.values import Record, Unclear, Value, number, numbers, shown

KINDS: dict[str, MotionKind] = {"PTP": "joint", "LIN": "line", "CIRC": "arc", "SPL": "spline"}
MODAL = ("$TOOL", "$BASE", "$VEL", "$ACC", "$APO", "$VEL_AXIS", "$ACC_AXIS", "$IPO_MODE")
MODAL_DATA = ("PDAT_ACT", "LDAT_ACT", "FDAT_ACT", "%spline")
HARMLESS = frozenset(
    [
        "DELETE_BACKWARD_BUFFER",
        "VAR_STATE",
        "CIOCTL",
        "COPEN",
        "CCLOSE",
        "MSGINFO",
        "MSGLOG",
        "SET_CD_PARAMS",
        "STRCLEAR",
        "STRCOPY",
        "USER_GRP",
        "CHECKHOME",
        "ERR_RAISE",
        "VARSTATE",
        "CAST_TO",
        "CAST_FROM",
        "SWRITE",
        "SREAD",
        "CWRITE",
        "MSGNOTIFY",
        "MSGQUIT",
        "MSGSTATE",
        "MSGDIALOG",
    ]
)
HERE = ("$POS_ACT", "$POS_FOR", "$POS_INT", "$POS_ACT_MES")
HERE_JOINTS = ("$AXIS_ACT", "$AXIS_FOR", "$AXIS_INT", "$AXIS_ACT_MEAS")


class Settings(NamedTuple):
    """What is set when a motion begins."""

    tool: NamedFrame
    base: NamedFrame
    speed: Rate | None
    acceleration: Rate | None
    zone: Zone


class KrlDialect:
    """KRL, as a run needs it."""

    modal = frozenset((*MODAL, *MODAL_DATA))
    local_by_default = False
    whole_division = True
    first_index = 1

    def begin(self, memory: ProgramMemory) -> None:
        """No variable is there from the start."""

    def is_signal(self, name: str) -> bool:
        """Outputs."""
        return name.startswith(("$OUT[", "$ANOUT["))

    def named(self, name: str) -> bool:
        """Tool and base keep the name of what they are set to."""
        return name in ("$TOOL", "$BASE")

    def constant(self, memory: ProgramMemory, name: str) -> Value | None:
        """Frames of the controller, and where the arm stands."""
        if name in ("$NULLFRAME", "$WORLD", "$ROBROOT"):
            return frame_record(pose_of((0.0,) * 6, "kuka"))
        if name in HERE:
            seen = memory.here.seen(tool_of(memory), base_of(memory), memory.cell.flange)
            return None if seen is None else frame_record(seen, "E6POS")
        if name in HERE_JOINTS and memory.here.joints is not None:
            degrees = [math.degrees(each) for each in memory.here.joints]
            return Record("E6AXIS", tuple((f"A{i + 1}", each) for i, each in enumerate(degrees)))
        return None

    def listed(self, kind: str, values: tuple[Value, ...]) -> Value:
        """KRL has no lists."""
        return values

    def function(self, memory: ProgramMemory, name: str, given: Invocation) -> Value:
        """Mathematics in degrees, and inverse frames."""
        values = tuple(None if each is None else memory.value(each) for each in given.arguments)
        if name == "INV_POS" and values and is_frame(values[0]):
            pose = record_pose(values[0])
            if pose is not None:
                inverse = pose.copy()
                inverse[:3, :3] = pose[:3, :3].T
                inverse[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
                return frame_record(inverse)
        plain = numbers(values)
        try:
            if name == "ATAN2" and plain is not None and len(plain) == 2:
                return math.degrees(math.atan2(*plain))
            if name in IN_DEGREES and plain is not None and len(plain) == 1:
                return float(IN_DEGREES[name](plain[0]))
        except (ValueError, OverflowError):
            pass
        return Unclear(f"{name}(...)")

    def product(self, left: Value, right: Value) -> Value:
        """The geometric operator: ``right`` in the frame ``left``."""
        for each in (left, right):
            if isinstance(each, Unclear):
                return each
        a, b = record_pose(left), record_pose(right)
        if a is None or b is None or not isinstance(right, Record):
            return Unclear(f"{shown(left)}:{shown(right)}")
        found = Record(right.kind, frame_record(a @ b).items)
        rest = [(key, value) for key, value in right.items if key not in FRAME_KEYS]
        return Record(found.kind, (*found.items, *rest))

    def motion(self, memory: ProgramMemory, move: Move) -> ArmMotion:
        """PTP, LIN, CIRC and their relatives and splines."""
        kept = {name: memory.shared.get(name) for name in memory.shared if name in _SET} if move.settings else {}
        angle = None
        for name, expression in move.settings:
            if name == "CA":
                degrees = number(memory.value(expression))
                angle = math.radians(degrees) if degrees is not None else math.nan
            else:
                keep_setting(memory, name, expression)
        found = self._motion(memory, move, angle)
        if move.settings:
            for name in _SET & memory.shared.keys():
                del memory.shared[name]
            memory.shared.update({name: value for name, value in kept.items() if value is not None})
            memory.kept.clear()
        return found

    def _motion(self, memory: ProgramMemory, move: Move, angle: float | None) -> ArmMotion:
        plain = move.form.removesuffix("_REL")
        kind = KINDS[plain.removeprefix("S") if plain != "SPL" else plain]
        tool, base, speed, acceleration, zone = _settings(memory, kind, move)
        values = [self._argument(memory, each) for each in move.arguments]
        make = relative if plain != move.form else target
        in_tool = "#TOOL" in move.words
        made = [make(memory, value, (tool, base), (move.text, in_tool)) for value in values]
        via = made[0] if kind == "arc" and len(made) > 1 else None
        block = memory.shared.get("%spline")
        return ArmMotion(
            kind,
            made[-1],
            move.form,
            via,
            angle if kind == "arc" else None,
            speed,
            acceleration,
            zone,
            tool,
            base,
            block if isinstance(block, int) and block else None,
        )

    def _argument(self, memory: ProgramMemory, argument: Expression | None) -> Value:
        """A motion's argument; to go to where the arm stands, wherever that is, no joint moves."""
        if argument is None:
            return Unclear("")
        here = isinstance(argument, Variable) and argument.name in HERE + HERE_JOINTS
        if here and isinstance(memory.value(argument), Unclear):
            return Record("E6AXIS", ())
        return memory.value(argument)

    def carry_out(self, memory: ProgramMemory, doing: Doing) -> Instruction | None:
        """Settings by BAS, ends of splines, signals by PULSE; the rest is unknown."""
        call = doing.what
        assert isinstance(call, Invocation)
        if call.function in ("%SPLINE", "%ENDSPLINE"):
            memory.write("%spline", doing.place.line if call.function == "%SPLINE" else 0)
            return None
        if call.function == "BAS":
            return None if set_by_bas(memory, call) else Aside(doing.text)
        if call.function == "PULSE" and call.arguments and call.arguments[0] is not None:
            name = memory.key(call.arguments[0]) or "$OUT"
            return Output(name, doing.text)
        return Aside(doing.text) if self.harmless(call) else Unknown(doing.text)

    def harmless(self, call: Invocation) -> bool:
        """Messages, files, signals."""
        return call.function == "PULSE" or call.function in HARMLESS


_SET = frozenset(
    (
        *(*MODAL, "$VEL.CP", "$ACC.CP", "$APO.CDIS", "$APO.CPTP", "$TOOL%name", "$BASE%name"),
        *(f"${kind}_AXIS[{i}]" for kind in ("VEL", "ACC") for i in range(1, 7)),
    )
)


def _settings(memory: ProgramMemory, kind: MotionKind, move: Move) -> Settings:
    """What is set for a motion; it is kept, because most motions follow one whose settings are the same."""
    key = (kind, move.words)
    found = memory.kept.get(key)
    if not isinstance(found, Settings):
        found = Settings(
            tool_of(memory),
            base_of(memory),
            _speed(memory, kind),
            _acceleration(memory, kind),
            _zone(memory, kind, move.words),
        )
        memory.kept[key] = found
    return found


def _speed(memory: ProgramMemory, kind: MotionKind) -> Rate | None:
    if kind == "joint":
        return _axis_share(memory, "$VEL_AXIS")
    speed = number(memory.read("$VEL.CP"))
    return None if speed is None else Rate(speed, "m/s")


def _acceleration(memory: ProgramMemory, kind: MotionKind) -> Rate | None:
    if kind == "joint":
        return _axis_share(memory, "$ACC_AXIS")
    value = memory.read("$ACC.CP")
    if isinstance(value, Record):
        share = number(value.get("share"))
        return None if share is None else Rate(share, "share")
    found = number(value)
    return None if found is None else Rate(found, "m/s2")


def _axis_share(memory: ProgramMemory, name: str) -> Rate | None:
    given = [number(memory.read(f"{name}[{axis}]")) for axis in range(1, 7)]
    least = min((each for each in given if each is not None), default=None)
    return None if least is None else Rate(least / 100, "share")


def _zone(memory: ProgramMemory, kind: MotionKind, words: tuple[str, ...]) -> Zone:
    word = next((word for word in words if word.startswith("C_")), None)
    if word is None:
        return FINE
    distance = number(memory.read("$APO.CDIS"))
    share = number(memory.read("$APO.CPTP"))
    if (word == "C_PTP" or (word == "C_SPL" and kind == "joint")) and share is not None:
        return Zone("share", share / 100, word)
    if word in ("C_DIS", "C_SPL", "C_PTP") and distance is not None:
        return Zone("distance", distance / 1000, word)
    angle, slow = number(memory.read("$APO.CORI")), number(memory.read("$APO.CVEL"))
    if word == "C_ORI" and angle is not None:
        return Zone("angle", math.radians(angle), word)
    if word == "C_VEL" and slow is not None:
        return Zone("velocity", slow / 100, word)
    return Zone("named", 0.0, word)
