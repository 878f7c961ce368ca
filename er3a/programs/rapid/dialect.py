"""What RAPID's motions, data and functions mean: mm, degrees, quaternions whose scalar is first.

Sources are named as in :mod:`er3a.programs.rapid.data_types`: "2 RelTool" is the entry of the function RelTool.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from er3a.geometry.transforms import transform
from er3a.numerics.arrays import Reals
from er3a.programs import syntax
from er3a.programs.evaluation import IN_DEGREES, Dialect, Position, ProgramMemory, evaluated, unresolved
from er3a.programs.instructions import (
    FINE,
    ArmMotion,
    Aside,
    Instruction,
    JointTarget,
    Load,
    MotionKind,
    NamedFrame,
    Output,
    PoseTarget,
    Rate,
    Target,
    UnclearLoad,
    Unknown,
    UnresolvedTarget,
    Zone,
)
from er3a.programs.rapid import data_types, known_names
from er3a.programs.rapid.data_types import NO_AXIS, pose_matrix, pose_record, remembered
from er3a.programs.syntax import Record, Unclear, Value, Variable, numbers, rate_of, shown

ROBOT_BASE = NamedFrame("wobj0", np.eye(4))
SLOWEST_RAMP = 20.0  # percent; 1 AccSet: smaller values count as 20
FULL_SPEED = 5000.0  # mm/s, of VelSet where a program sets none
OPTIONS = frozenset(("ID", "INPOS", "NOEOFFS", "T", "WOBJ"))
"""Optional arguments of motions that are followed, or leave them as they are."""
OTHERS = ("WOBJDATA", "TOOLDATA")
"""What is no tool, and what is no work object."""
UNCLEAR = Unclear("")
AS_IT_STANDS = Unclear("the configuration in which the arm stands")
KINDS: dict[str, MotionKind] = {"J": "joint", "L": "line", "C": "arc", "A": "joint"}
SPELLED = {"MOVEJ": "MoveJ", "MOVEL": "MoveL", "MOVEC": "MoveC", "MOVEABSJ": "MoveAbsJ"}


class RapidDialect(Dialect):
    """RAPID, as a run needs it."""

    modal = frozenset(("%CONFJ", "%CONFL", "%ACC", "%SPEED", "%ARCS"))
    harmless = known_names.HARMLESS
    reading = known_names.READING
    by_reference = True

    def constant(self, memory: ProgramMemory, name: str) -> Value | None:
        """Speeds, zones, tool and work object that every controller has.

        Returns
        -------
        value : as of :func:`er3a.programs.rapid.data_types.predefined`; None for other names
        """
        return data_types.predefined(name)

    def typed(self, kind: str, value: Value) -> Value:
        """A value with the names of its type's components.

        Parameters
        ----------
        kind : the declared type, in capital letters

        Returns
        -------
        value : as of :func:`er3a.programs.rapid.data_types.typed`
        """
        return data_types.typed(value, kind)

    def function(self, memory: ProgramMemory, name: str, given: syntax.Invocation) -> Value:
        """The value of a function of RAPID: mathematics in degrees, positions, where the arm is.

        Returns
        -------
        value : in mm, deg and quaternions; unclear for a function that is unknown, or called with other arguments
        """
        values = tuple(UNCLEAR if each is None else memory.value(each) for each in given.arguments)
        named = {key: memory.value(each) for key, each in given.keywords}
        found: Value | None = None
        if name in ("CROBT", "CPOS") and not values and named.keys() <= {"TOOL", "WOBJ"}:
            found = _of_position(memory, name, named, dict(given.keywords))
        elif name in IN_DEGREES and not named:
            found = evaluated(IN_DEGREES[name], values)
        else:
            found = _of_data(name, values, named)
        if found is not None:
            return found
        unclear = f"{given.function.lower()}({', '.join(map(shown, values))})"
        return next((each for each in values if isinstance(each, Unclear)), Unclear(unclear))

    def motion(self, memory: ProgramMemory, move: syntax.Move) -> ArmMotion:
        """The motion of MoveJ, MoveL, MoveC and MoveAbsJ, also of those that set an output with it.

        Returns
        -------
        motion : its target is unresolved if the tool is stationary or the arm holds the work object. ``not_followed``
            names options that are not followed.
        """
        kind, absolute = KINDS[move.form[4]], move.form[4] == "A"
        options = {name: memory.value(each) for name, each in move.settings}
        values = [UNCLEAR if each is None else memory.value(each) for each in move.arguments]
        targets = 2 if kind == "arc" else 1
        beside = 2 if move.form.endswith("DO") else 0
        if not targets + 3 <= len(values) <= targets + 3 + beside:
            unknown = UnresolvedTarget(move.text, "not_understood")
            return ArmMotion(kind, unknown, move.form, unknown if kind == "arc" else None)
        speed_at, zone_at, tool_at = targets, targets + 1, targets + 2
        tool, stationary = _tool(memory, move.arguments[tool_at], values[tool_at])
        base, held = _base(memory, dict(move.settings).get("WOBJ"), options.get("WOBJ"))
        checked = memory.read("%CONFJ" if kind == "joint" else "%CONFL") is not False
        said, joints = (move.text, kind, absolute), memory.cell.joints
        made = [_target(value, joints, said, checked) for value in values[:targets]]
        if stationary or held:
            made = [UnresolvedTarget(move.text, "external_tool")] * targets
        taken = values[tool_at], options.get("WOBJ")
        if any(isinstance(each, Record) and each.kind == other for each, other in zip(taken, OTHERS)):
            made = [UnresolvedTarget(move.text, "not_understood")] * targets
        via = made[0] if kind == "arc" else None
        if isinstance(via, PoseTarget):
            via = replace(via, branch=None)
        speed, turn = _speed(memory, values[speed_at], options, kind)
        load: Load | None = tool.load
        if (stated := data_types.part(data_types.typed(values[tool_at], "TOOLDATA"), "TLOAD")) is not None:
            load = UnclearLoad(f"tload ({tool.name})") if _is_open(stated) else load
        percent = syntax.number(memory.read("%ACC"))
        return ArmMotion(
            kind,
            made[-1],
            SPELLED.get(move.form, move.form),
            via,
            speed,
            None if percent is None else Rate(percent / 100, "share"),
            _zone(values[zone_at], options, move.arguments[zone_at]),
            tool,
            base,
            turn_speed=turn,
            load=load,
            not_followed=", ".join(sorted({*options} - OPTIONS)),
            with_path=kind == "arc" and memory.read("%ARCS") is not True,
        )

    def carry_out(self, memory: ProgramMemory, doing: syntax.Doing) -> Instruction | None:
        """Carry out settings (``ConfJ``, ``AccSet``, ``VelSet`` ...) and outputs; the rest as in all languages.

        Returns
        -------
        instruction : None for a setting that is followed
        """
        call = doing.what
        values = tuple(UNCLEAR if each is None else memory.value(each) for each in call.arguments)
        options = {key for key, _ in call.keywords}
        match call.function:
            case "CONFJ" | "CONFL":
                memory.write(f"%{call.function}", "OFF" not in options)
                return None
            case "CIRPATHMODE" if options <= {"PATHFRAME", "OBJECTFRAME"}:
                memory.write("%ARCS", "OBJECTFRAME" in options)
                return None
            case "SINGAREA" if options == {"OFF"}:
                return Aside(doing.text)
            case "ACCSET" if values and (percent := syntax.number(values[0])) is not None:
                memory.write("%ACC", max(percent, SLOWEST_RAMP))
                return None
            case "VELSET" if len(values) == 2 and (found := numbers(values)) is not None:
                memory.write("%SPEED", found)
                return None
            case name if name in known_names.NOT_SIMULATED | known_names.SHIFTING:
                return Unknown(doing.text, may_move=False, shapes=name in known_names.SHIFTING)
            case name if name in known_names.OUTPUTS and call.arguments:
                first = call.arguments[0]
                return Output(first.name if isinstance(first, Variable) else name, doing.text)
        return super().carry_out(memory, doing)


@remembered
def _target(value: Value, joints: int, said: tuple[str, MotionKind, bool], checked: bool) -> Target:
    """What a target means; ``said`` is the line, the motion's kind, and whether it wants joint angles."""
    text, kind, absolute = said
    if isinstance(value, Unclear):
        return unresolved(value, text)
    value = data_types.typed(value, "JOINTTARGET" if absolute else "ROBTARGET")
    first, second = ("ROBAX", "ROBAX") if absolute else ("TRANS", "ROT")
    parts = [data_types.part(value, name) for name in (first, second)]
    inside = [each for part in parts for each in (part.values() if isinstance(part, Record) else (part,))]
    unclear = next((each for each in inside if isinstance(each, Unclear)), None)
    if unclear is not None:
        return unresolved(unclear)
    external = data_types.external_axes(data_types.part(value, "EXTAX"))
    if absolute:
        degrees = data_types.plain(parts[0], 6)
        if degrees is None:
            return UnresolvedTarget(text, "not_understood")
        if any(each and abs(each) < NO_AXIS / 10 for each in degrees[joints:]):
            return UnresolvedTarget(text, "too_many_joints")
        return JointTarget(np.radians(degrees[:joints]), external)
    pose = pose_matrix(value)
    if pose is None:
        return UnresolvedTarget(text, "not_understood")
    conf = data_types.part(value, "ROBCONF")
    branch = data_types.branch_of(conf, joints) if checked else None
    return PoseTarget(pose, _said(conf) if checked or kind != "joint" else (), external=external, branch=branch)


def _said(conf: Value | None) -> tuple[tuple[str, float | str], ...]:
    """The parts of confdata, as text where they are not known; none where the arm's own configuration was read."""
    if isinstance(conf, Unclear):
        return (("robconf", conf.text),)
    parts = conf.values() if isinstance(conf, Record) else ()
    if len(parts) != 4 or AS_IT_STANDS in parts:
        return ()
    known = [number if (number := syntax.number(each)) is not None else shown(each) for each in parts]
    return tuple(zip(("cf1", "cf4", "cf6", "cfx"), known))


@remembered
def frame_of_tool(value: Value | None) -> tuple[Reals | None, bool]:
    """The pose of a tool, and whether it is stationary.

    Parameters
    ----------
    value : tooldata (3 tooldata: robhold, tframe)

    Returns
    -------
    T : T_flange_tool (4, 4), m; None where it is not known
    stationary : whether the arm does not hold the tool
    """
    data = data_types.typed(value, "TOOLDATA") if value is not None else None
    held = data_types.part(data, "ROBHOLD")
    pose = None if isinstance(held, Unclear) else pose_matrix(data_types.part(data, "TFRAME"))
    return pose, held is False


@remembered
def frame_of_object(value: Value | None) -> tuple[Reals | None, bool]:
    """T_robot_object (4, 4) in m of wobjdata, and whether the arm holds the object (3 wobjdata: robhold).

    The object's frame is in the user's frame, and that in the world, which is the robot's base unless a controller
    is set up otherwise. None where an external unit moves the user's frame (ufprog FALSE, ufmec).
    """
    data = data_types.typed(value, "WOBJDATA") if value is not None else None
    user, own = (pose_matrix(data_types.part(data, name)) for name in ("UFRAME", "OFRAME"))
    still = data_types.part(data, "UFPROG") is True
    held = data_types.part(data, "ROBHOLD")
    if user is None or own is None or not still or isinstance(held, Unclear):
        return None, held is True
    return user @ own, held is True


def _named(memory: ProgramMemory, expression: object, value: Value, pose: Reals | None) -> tuple[str, Reals | None]:
    """The name of a frame, and its pose as the program or else the cell gives it, however its letters are written."""
    name = expression.name.lower() if isinstance(expression, Variable) else ""
    if pose is None:
        name = value.text.lower() if isinstance(value, Unclear) else name or "?"
        pose = next((each for key, each in memory.cell.frames.items() if key.lower() == name), None)
    return name.rpartition("/")[2], pose


def _tool(memory: ProgramMemory, expression: object, value: Value) -> tuple[NamedFrame, bool]:
    own, stationary = frame_of_tool(value)
    name, pose = _named(memory, expression, value, own)
    load = data_types.load_of(data_types.part(data_types.typed(value, "TOOLDATA"), "TLOAD"))
    load = load if load is not None and load.mass > data_types.MIN_LOAD else None
    return NamedFrame(name, pose, load), stationary


@remembered
def _is_open(value: Value) -> bool:
    """Whether a part of a value is not known."""
    parts = value.values() if isinstance(value, Record) else value if isinstance(value, tuple) else ()
    return isinstance(value, Unclear) or any(map(_is_open, parts))


def _base(memory: ProgramMemory, expression: object, value: Value | None) -> tuple[NamedFrame, bool]:
    if value is None:
        return ROBOT_BASE, False
    own, held = frame_of_object(value)
    return NamedFrame(*_named(memory, expression, value, own)), held


def _speed(
    memory: ProgramMemory, value: Value, options: Mapping[str, Value], kind: MotionKind
) -> tuple[Rate | None, float | None]:
    """Speed of the tool and of its turn (rad/s). 1 VelSet scales and bounds it, but no time, as the faster reading."""
    if "T" in options:
        return rate_of(options["T"], "s"), None
    percent, most = data_types.plain(memory.read("%SPEED"), 2) or (100.0, FULL_SPEED)
    share = percent / 100
    if isinstance(value, Record) and value.get("FASTEST") is True:
        if kind == "joint":
            return Rate(share, "share", "vmax"), None
        return Rate(most / 1000 * share, "m/s", "vmax"), math.radians(data_types.TURN_SPEED) * share
    data = data_types.typed(value, "SPEEDDATA")
    turn = syntax.number(data_types.part(data, "V_ORI"))
    along = rate_of(data_types.part(data, "V_TCP"), "m/s")
    if along is None or along.text:
        return along or Rate(0.0, "m/s", shown(value)), None
    limited = min(along.value * share, most)
    return Rate(limited / 1000, "m/s"), math.radians(turn) * share if turn and kind != "joint" else None


def _zone(value: Value, options: Mapping[str, Value], expression: object) -> Zone:
    """3 zonedata; ``\\Inpos`` asks for a stop."""
    data = data_types.typed(value, "ZONEDATA")
    stops = data_types.part(data, "FINEP")
    if "INPOS" in options or stops is True:
        return FINE
    name = expression.name.lower() if isinstance(expression, Variable) else ""
    size = syntax.number(data_types.part(data, "PZONE_TCP"))
    if size is None or isinstance(stops, Unclear):
        return Zone("named", 0.0, name or "zonedata")
    return Zone("distance", size / 1000, name) if size > 0 else FINE


def _of_position(
    memory: ProgramMemory, name: str, named: Mapping[str, Value], words: Mapping[str, syntax.Expression]
) -> Value | None:
    """Where the arm is; unknown after a motion that the program does not wait for (7-zonedata-1).

    2 CRobT, 2 CPos: in the work object, for the tool; where none is given, those of the last motion.
    """
    here = Position() if memory.here.passing else memory.here
    tool = _tool(memory, words.get("TOOL"), named["TOOL"])[0] if "TOOL" in named else here.tool
    base = _base(memory, words.get("WOBJ"), named.get("WOBJ"))[0] if "WOBJ" in named else here.base
    seen = here.seen(tool, base, memory.cell.flange)
    if seen is None or name == "CPOS":
        return None if seen is None else pose_record(seen).values()[0]
    conf: Value = (AS_IT_STANDS,) * 4  # cfx is -1 where the arm's sides are not known
    if here.joints is not None and len(here.joints) == 6:
        conf = (*data_types.quarters_of(here.joints), -1)
    return data_types.typed((*pose_record(seen).values(), conf, (NO_AXIS,) * 6), "ROBTARGET")


def _of_data(name: str, values: tuple[Value, ...], named: Mapping[str, Value]) -> Value | None:
    """Functions of positions, as ABB's manual defines them (2, each by its name)."""
    plain = numbers(values)
    poses = [pose for each in values if (pose := pose_matrix(each)) is not None]
    match name, len(values):
        case "OFFS" | "RELTOOL", 4:
            return _shifted(name, values, named)
        case "POSEMULT", 2 if len(poses) == 2:
            return pose_record(poses[0] @ poses[1])
        case "ORIENTZYX", 3 if plain is not None:  # about z, then the new y, then the new x
            return pose_record(transform(np.zeros(3), np.radians(plain[::-1]))).values()[1]
    return None


def _shifted(name: str, values: tuple[Value, ...], named: Mapping[str, Value]) -> Value | None:
    """2 Offs: along the object's axes. 2 RelTool: along the tool's, then turned about x, the new y, the new z."""
    target = data_types.typed(values[0], "ROBTARGET")
    pose, shift = pose_matrix(target), numbers(values[1:])
    angles = numbers(tuple(named.get(key, 0.0) for key in ("RX", "RY", "RZ")))
    if not isinstance(target, Record) or pose is None or shift is None or angles is None:
        return None
    step = np.eye(4)
    step[:3, 3] = np.array(shift) / 1000
    if name == "OFFS":
        pose[:3, 3] += step[:3, 3]
        return target.having("TRANS", pose_record(pose).values()[0])
    step[:3, :3] = Rotation.from_euler("XYZ", angles, degrees=True).as_matrix()
    trans, rot = pose_record(pose @ step).values()
    return target.having("TRANS", trans).having("ROT", rot)
