"""The meaning of KRL's motions, frames and functions."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import repeat
from typing import NamedTuple

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.programs import instructions, syntax
from er3a.programs.evaluation import (
    IN_DEGREES,
    SIZES,
    Dialect,
    ProgramMemory,
    evaluated,
    known,
    root,
    unresolved,
    variable_of,
)
from er3a.robots.masses import MassBody, moved

FRAME_KEYS = ("X", "Y", "Z", "A", "B", "C")
AXIS_KEYS = ("A1", "A2", "A3", "A4", "A5", "A6")
AXIS_KINDS = ("AXIS", "E6AXIS")
LEFT_OUT = "left out of"
EXTERNAL_KEYS = ("E1", "E2", "E3", "E4", "E5", "E6")
COORDINATES = frozenset((*FRAME_KEYS, *AXIS_KEYS, *EXTERNAL_KEYS))
POSITION_FIELDS = COORDINATES | {"S", "T"}
POSITION_KINDS = ("FRAME", "POS", "E6POS", *AXIS_KINDS)
MOST_SPEED = 3.0  # m/s
"""What controllers take along a path at most: ``$VEL_MA.CP`` of their machine data."""
SIGN_ZERO = 1e-7  # rad; nearer to 0 a joint's sign says nothing
Frames = tuple[instructions.NamedFrame, instructions.NamedFrame]
UNREAD = syntax.Unclear("")
"""The value of a motion's arguments that are more or fewer than it has."""


def _has_axes(value: syntax.Record) -> bool:
    return value.kind in AXIS_KINDS or any(key in AXIS_KEYS for key, _ in value.items)


def is_frame(value: syntax.Value | None) -> bool:
    """Whether a value has a coordinate of a frame."""
    return isinstance(value, syntax.Record) and any(value.get(key) is not None for key in FRAME_KEYS)


def record_pose(value: syntax.Value | None) -> Reals | None:
    """The transform (4, 4) in m of a frame; None for anything else, and for a frame that leaves something out."""
    if not isinstance(value, syntax.Record):
        return None
    given = [syntax.number(value.get(key)) for key in FRAME_KEYS]
    plain = tuple(each for each in given if each is not None)
    return instructions.pose_of(plain, "kuka") if len(plain) == 6 and syntax.finite(plain) else None


def frame_record(pose: Reals, kind: str = "FRAME") -> syntax.Record:
    """A transform (4, 4) in m as a frame."""
    return syntax.Record(kind, tuple(zip(FRAME_KEYS, instructions.numbers_of(pose, "kuka"))))


def target(memory: ProgramMemory, value: syntax.Value, frames: Frames, said: tuple[str, bool]) -> instructions.Target:
    """What a position in a motion means; ``said`` is the line, and whether a relative position is meant by the tool."""
    text = said[0]
    if isinstance(value, syntax.Unclear) and value is not UNREAD:
        return unresolved(value)
    if not isinstance(value, syntax.Record) or not _is_position(value):
        return instructions.UnresolvedTarget(text, "not_understood")
    if _has_axes(value):
        return _joints(memory, value, text)
    return _by_fixed_tool(memory, text) or _pose(memory, value, frames, text)


def _is_position(value: syntax.Record) -> bool:
    """Whether a record has fields of positions alone, and not both coordinates and axes."""
    return all(key in POSITION_FIELDS for key, _ in value.items) and not (_has_axes(value) and is_frame(value))


def _by_fixed_tool(memory: ProgramMemory, text: str) -> instructions.UnresolvedTarget | None:
    """That the workpiece is moved along a fixed tool, or may be; None where it is known that the tool is moved."""
    mode = memory.read("$IPO_MODE")
    if mode in (None, "#BASE"):
        return None
    if isinstance(mode, syntax.Unclear):
        return instructions.UnresolvedTarget(f"$IPO_MODE={mode.text}", "undefined")
    return instructions.UnresolvedTarget(text, "external_tool")


def relative(memory: ProgramMemory, value: syntax.Value, frames: Frames, said: tuple[str, bool]) -> instructions.Target:
    """A target given by its difference from where the arm is."""
    text, in_tool = said
    if not isinstance(value, syntax.Record) or not _is_position(value):
        if isinstance(value, syntax.Unclear) and value is not UNREAD:
            return unresolved(value)
        return instructions.UnresolvedTarget(text, "not_understood")
    if _has_axes(value):
        change = _joints(memory, value, text, missing=0.0)
        if not isinstance(change, instructions.JointTarget):
            return change
        if memory.here.joints is None:
            return instructions.UnresolvedTarget(text, "position_unknown")
        return instructions.JointTarget(memory.here.joints + change.joints, change.external)
    if (fixed := _by_fixed_tool(memory, text)) is not None:
        return fixed
    steps = syntax.Record(value.kind, (*((key, 0.0) for key in FRAME_KEYS if value.get(key) is None), *value.items))
    given = _components(steps, FRAME_KEYS, text)
    if isinstance(given, instructions.UnresolvedTarget):
        return given
    offset, seen = record_pose(steps), memory.here.seen(*frames, memory.cell.flange)
    if offset is None or seen is None:
        return instructions.UnresolvedTarget(text, "position_unknown")
    if in_tool:
        return instructions.PoseTarget(seen @ offset, external=_external(value))
    found = seen.copy()
    found[:3, 3] += offset[:3, 3]
    found[:3, :3] = offset[:3, :3] @ seen[:3, :3]
    return instructions.PoseTarget(found, external=_external(value))


def _components(
    value: syntax.Record, keys: tuple[str, ...], text: str
) -> list[float | None] | instructions.UnresolvedTarget:
    """Numbers of a record, None for what it leaves out."""
    found: list[float | None] = []
    given = dict(value.items)
    for key in keys:
        part = given.get(key)
        if isinstance(part, syntax.Unclear):
            return unresolved(part)
        plain = syntax.number(part)
        if part is not None and plain is None:
            return instructions.UnresolvedTarget(text, "not_understood")
        if plain is not None and not math.isfinite(plain):
            return instructions.UnresolvedTarget(text, "not_finite")
        found.append(plain)
    return found


def _external(value: syntax.Record) -> tuple[tuple[str, float], ...]:
    """Axes beside the arm that are given and not 0; NaN where the value is not known."""
    parts = dict(value.items)
    given = ((key, number) for key in EXTERNAL_KEYS if key in parts and (number := _of_axis(parts[key])))
    return tuple(given)


def _of_axis(value: syntax.Value) -> float:
    """The value of an external axis; 0 of one that an assignment left out."""
    if isinstance(value, syntax.Unclear):
        return 0.0 if value.text.startswith(LEFT_OUT) else math.nan
    return syntax.number(value) or 0.0


def _joints(
    memory: ProgramMemory, value: syntax.Record, text: str, missing: float | None = None
) -> instructions.Target:
    degrees = _components(value, AXIS_KEYS, text)
    if isinstance(degrees, instructions.UnresolvedTarget):
        return degrees
    count = memory.cell.joints
    if any(degrees[count:]):
        return instructions.UnresolvedTarget(text, "too_many_joints")
    here = memory.here.joints
    kept = np.full(count, np.nan) if here is None else here
    if missing is not None:
        kept = np.full(count, missing)
    joints = [kept[i] if each is None else math.radians(each) for i, each in enumerate(degrees[:count])]
    return instructions.JointTarget(np.array(joints), _external(value))


def _pose(memory: ProgramMemory, value: syntax.Record, frames: Frames, text: str) -> instructions.Target:
    given = _components(value, FRAME_KEYS, text)
    if isinstance(given, instructions.UnresolvedTarget):
        return given
    if None in given:
        seen = memory.here.seen(*frames, memory.cell.flange)
        if seen is None:
            return instructions.UnresolvedTarget(text, "position_unknown")
        given = [old if each is None else each for each, old in zip(given, instructions.numbers_of(seen, "kuka"))]
    plain = tuple(each for each in given if each is not None)
    words = ((key, value.get(key)) for key in ("S", "T"))
    given_words = ((key, each.text if isinstance(each, syntax.Unclear) else syntax.number(each)) for key, each in words)
    configuration = tuple((key, each) for key, each in given_words if each is not None)
    branch = _branch(syntax.number(value.get("T")), memory.cell.joints)
    return instructions.PoseTarget(
        instructions.pose_of(plain, "kuka"), configuration, external=_external(value), branch=branch
    )


def _posture(position: syntax.Record, joints: Reals | None, name: str) -> syntax.Record:
    """Where the arm is with its Turn, where its joints are known; its Status depends on the arm, and is not known."""
    turn: syntax.Value = syntax.Unclear(f"T of {name}")
    if joints is not None:
        turn = sum(1 << i for i, each in enumerate(joints) if each < 0)
    return position.having("S", syntax.Unclear(f"S of {name}")).having("T", turn)


def _branch(turn: float | None, joints: int) -> instructions.MeantSolution | None:
    """What Turn says of a solution: bit i - 1 is set where axis i is below 0."""
    if turn is None:
        return None
    below = [(int(turn) >> i) & 1 for i in range(joints)]
    return instructions.MeantSolution(
        np.array([(-np.inf, SIGN_ZERO) if each else (-SIGN_ZERO, np.inf) for each in below])
    )


def tool_of(memory: ProgramMemory) -> instructions.NamedFrame:
    """The tool that is set."""
    return _frame(memory, "$TOOL")


def base_of(memory: ProgramMemory) -> instructions.NamedFrame:
    """The base that is set."""
    return _frame(memory, "$BASE")


def _frame(memory: ProgramMemory, variable: str) -> instructions.NamedFrame:
    value = memory.read(variable)
    if value is None:
        if any(f"{variable}.{key}" in memory.shared for key in FRAME_KEYS):  # a part of one that nothing gives
            return instructions.NamedFrame(variable)
        return instructions.NamedFrame("", memory.cell.tool if variable == "$TOOL" else memory.cell.base, own=False)
    said = memory.read(variable + "%name")
    name = said.upper() if isinstance(said, str) and said[:1] not in ("{", "") else ""
    own, pose = memory.read(name) if name and name not in HERE else None, record_pose(value)
    if isinstance(value, syntax.Unclear):
        name = name or value.text
        if isinstance(own, syntax.Unclear) and not isinstance(own, syntax.Unset):  # the program or others change it
            name = f"{name}, changed" if own.text == name else f"{name}={own.text}"
    elif pose is None and is_frame(value):
        name = syntax.shown(value)
    mapped = memory.cell.frames.get(name)
    if pose is None or (mapped is not None and value == frame_record(mapped)):
        pose = mapped
    return instructions.NamedFrame(name, pose)


def set_by_bas(memory: ProgramMemory, call: syntax.Invocation) -> bool:
    """Carry ``BAS(#COMMAND, value)`` out; False if the command is none that sets anything."""
    values = [memory.value(each) for each in call.arguments if each is not None]
    command = values[0] if values else ""
    given: syntax.Value = values[1] if len(values) > 1 else syntax.Unclear("BAS")
    match command:
        case "#INITMOV":
            _initial(memory)
        case "#VEL_PTP":
            _joint_speed(memory, given)
        case "#ACC_PTP":
            _all_axes(memory, "$ACC_AXIS", given)
        case "#VEL_CP":  # which some controllers bound by DEF_VEL_CP, others by their machine data
            memory.write("$VEL.CP", given)
        case "#ACC_CP":
            _line_acceleration(memory, given)
        case "#TOOL":
            _tool_number(memory, given)
        case "#BASE":
            _number(memory, "$BASE", "BASE_DATA", given)
        case "#EX_BASE":
            memory.write("$BASE", syntax.Unclear("BASE_DATA on an external axis"))
            memory.shared.pop("$BASE%name", None)
        case "#FRAMES":
            _frames(memory)
        case "#PTP_DAT" | "#PTP_PARAMS":
            data = memory.read("PDAT_ACT")
            _joint_data(memory, data)
            if command == "#PTP_PARAMS":
                _frames(memory)
            _joint_speed(memory, _field(data, "VEL", "PDAT_ACT") if command == "#PTP_DAT" else given)
        case "#CP_DAT" | "#CP_PARAMS":
            data = memory.read("LDAT_ACT")
            _line_data(memory, data)
            if command == "#CP_PARAMS":
                _frames(memory)
            memory.write("$VEL.CP", _field(data, "VEL", "LDAT_ACT") if command == "#CP_DAT" else given)
        case "#OUT_SYNC" | "#OUT_ASYNC":
            memory.forget("$OUT")
        case "#GROUP" | "#ACC_GLUE":
            pass
        case _:
            return False
    return True


def _initial(memory: ProgramMemory) -> None:
    """``BAS(#INITMOV,0)`` as controllers' own bas.src has it: full speed, the robot's base, tool 1, usual zones."""
    _all_axes(memory, "$ACC_AXIS", 100)
    _all_axes(memory, "$VEL_AXIS", 100)
    _line_acceleration(memory, 100)
    memory.write("$VEL.CP", memory.read("DEF_VEL_CP") or syntax.Unclear("DEF_VEL_CP"))
    for name in TURN_RATES:
        given = memory.read(f"DEF_{name[1:].replace('.', '_')}")
        if given is None:  # as the machine data say
            memory.shared.pop(name, None)
        else:
            memory.write(name, given)
    for part in ("CPTP", "CDIS", "CVEL", "CORI"):
        memory.write(f"$APO.{part}", memory.read(f"DEF_APO_{part}") or syntax.Unclear(f"DEF_APO_{part}"))
    memory.write("$ORI_TYPE", "#VAR")
    memory.write("$CIRC_TYPE", memory.read("DEF_CIRC_TYP") or "#BASE")
    memory.write("$IPO_MODE", "#BASE")
    _number(memory, "$BASE", "BASE_DATA", 0)
    _tool_number(memory, 1)


def _field(data: syntax.Value | None, name: str, kept_as: str) -> syntax.Value:
    """A field of motion data; unclear where they don't have it."""
    found = data.get(name) if isinstance(data, syntax.Record) else None
    return syntax.Unclear(f"{kept_as}.{name}") if found is None else found


def _joint_speed(memory: ProgramMemory, percent: syntax.Value) -> None:
    plain = syntax.number(percent)
    _all_axes(memory, "$VEL_AXIS", percent if plain is None else min(plain, 100.0))


def _line_acceleration(memory: ProgramMemory, percent: syntax.Value) -> None:
    plain, full = syntax.number(percent), syntax.number(memory.read("DEF_ACC_CP"))
    if plain is None:
        memory.write("$ACC.CP", percent)
        return
    share = min(plain / 100, 1.0)
    memory.write("$ACC.CP", syntax.Record("", (("share", share),)) if full is None else share * full)


def keep_setting(memory: ProgramMemory, name: str, expression: syntax.Expression) -> None:
    """One item of a WITH."""
    if not isinstance(expression, syntax.Invocation):
        value = memory.value(expression)
        if name in ("$VEL_AXIS[1]", "$ACC_AXIS[1]"):
            _all_axes(memory, name[:-3], value)
        else:
            frame, _, part = name.partition(".")
            if part and frame in ("$TOOL", "$BASE"):
                old = memory.read(frame)
                name = frame
                value = old.having(part, value) if isinstance(old, syntax.Record) else syntax.Unclear(f"{frame}.{part}")
            memory.write(name, value)
            memory.shared.pop(name + "%name", None)
        return
    first = expression.arguments[0] if expression.arguments else None
    given = syntax.Unclear(name) if first is None else memory.value(first)
    match expression.function:
        case "SVEL_CP":
            memory.write("$VEL.CP", given)
        case "SVEL_JOINT":
            _all_axes(memory, "$VEL_AXIS", given)
        case "SACC_JOINT":
            _all_axes(memory, "$ACC_AXIS", _field(given, "ACC", name))
        case "SACC_CP":
            _line_acceleration(memory, _field(given, "ACC", name))
        case "SAPO":
            memory.write("$APO.CDIS", _field(given, "APO_DIST", name))
        case "SAPO_PTP":
            if _zone_data(memory, given, "#CDIS") == "#CDIS":
                memory.write("$APO.CPTP", "#CDIS")  # 100 on the controller, so that the distance decides
        case "STOOL2" if isinstance(given, syntax.Record):
            _tool_data(memory, given)
        case "SBASE":
            _number(memory, "$BASE", "BASE_DATA", given)
        case "SLOAD":
            _load_number(memory, given)
        case "SIPO_MODE":
            memory.write("$IPO_MODE", given)
        case "SORI_TYP" | "SORI_TYPE":
            memory.write(name, _typed(given, "ORI_TYP", "#VAR"))
        case "SCIRC_TYPE" | "SCIRC_TYP":
            memory.write(name, _typed(given, "CIRC_TYP", "#BASE"))
        case _:
            if name in ("$TOOL", "$BASE"):
                memory.write(name, syntax.Unclear(f"{expression.function}(...)"))
                memory.shared.pop(name + "%name", None)


def _typed(data: syntax.Value, name: str, usual: syntax.Value) -> syntax.Value:
    """How motion data say that the tool turns; as usual where they don't."""
    return data.get(name) or usual if isinstance(data, syntax.Record) else data


def _all_axes(memory: ProgramMemory, name: str, value: syntax.Value) -> None:
    for axis in range(1, 7):
        memory.write(f"{name}[{axis}]", value)


def _number(memory: ProgramMemory, variable: str, array: str, given: syntax.Value) -> None:
    """Set tool or base by its number; 0, and -1 of what was never taught, is the null frame."""
    plain = syntax.number(given)
    memory.shared.pop(variable + "%name", None)
    if plain is None:
        memory.write(variable, syntax.Unclear(f"{array}[?]"))
        return
    name = f"{array}[{plain:g}]" if plain > 0 else "$NULLFRAME"
    memory.write(variable, memory.read(name) or syntax.Unclear(name))
    memory.write(variable + "%name", name)


def _tool_number(memory: ProgramMemory, given: syntax.Value) -> None:
    """Tool and load by their number, as controllers' own bas.src sets both."""
    _number(memory, "$TOOL", "TOOL_DATA", given)
    _load_number(memory, given)


def _load_number(memory: ProgramMemory, given: syntax.Value) -> None:
    for name in _load_parts(memory):
        del memory.shared[name]
    number = syntax.number(given)
    unknown = syntax.Unclear("LOAD_DATA[?]")
    memory.write("$LOAD", unknown if number is None else memory.read(f"LOAD_DATA[{number:g}]") or 0)


def _load_parts(memory: ProgramMemory) -> list[str]:
    """Parts of $LOAD that are set one by one, as by ``$LOAD.M=5``, where the whole is not known."""
    return [name for name in memory.shared if name.startswith("$LOAD.")]


def _load(memory: ProgramMemory) -> instructions.Load | None:
    """What the program says hangs on the flange."""
    whole, parts = memory.read("$LOAD"), _load_parts(memory)
    if parts and not isinstance(whole, syntax.Record):
        return instructions.UnclearLoad(", ".join(parts), syntax.number(memory.read("$LOAD.M")))
    return load_of(whole)


def load_of(value: syntax.Value | None) -> instructions.Load | None:
    """What a LOAD says hangs on the flange; None for a mass below 0, which means unknown.

    ``{M kg, CM {X mm, Y, Z, A deg, B, C}, J {X kg m^2, Y, Z}}``: J about the axes of CM, through the centre of mass.
    """
    if not isinstance(value, syntax.Record):
        return instructions.UnclearLoad(value.text) if isinstance(value, syntax.Unclear) else None
    mass, moments = syntax.number(value.get("M")), value.get("J")
    if mass is not None and mass <= 0:
        return None
    centre = record_pose(value.get("CM"))
    parts = [syntax.number(moments.get(key)) for key in "XYZ"] if isinstance(moments, syntax.Record) else [0.0] * 3
    given = [each for each in parts if each is not None]
    if mass is None or not math.isfinite(mass) or centre is None or len(given) < 3:
        return instructions.UnclearLoad("LOAD", mass)
    x, y, z = given
    return moved(MassBody(mass, inertia=(x, y, z, 0.0, 0.0, 0.0)), centre)


def _tool_data(memory: ProgramMemory, data: syntax.Record) -> None:
    _tool_number(memory, _field(data, "TOOL_NO", "FDAT"))
    memory.write("$IPO_MODE", data.get("IPO_FRAME") or "#BASE")


def _frames(memory: ProgramMemory) -> None:
    data = memory.read("FDAT_ACT")
    if isinstance(data, syntax.Record):
        _tool_data(memory, data)
        _number(memory, "$BASE", "BASE_DATA", _field(data, "BASE_NO", "FDAT"))
    else:
        of = data.text if isinstance(data, syntax.Unclear) else "FDAT_ACT"
        for variable in ("$TOOL", "$BASE"):
            memory.write(variable, syntax.Unclear(f"{variable[1:]} of {of}"))
            memory.shared.pop(variable + "%name", None)


def _joint_data(memory: ProgramMemory, data: syntax.Value | None) -> None:
    _all_axes(memory, "$ACC_AXIS", _field(data, "ACC", "PDAT_ACT"))
    _zone_data(memory, data, "#CPTP")


def _line_data(memory: ProgramMemory, data: syntax.Value | None) -> None:
    given = syntax.Unclear("LDAT_ACT") if data is None else data
    _line_acceleration(memory, _field(given, "ACC", "LDAT_ACT"))
    memory.write("$APO.CDIS", _field(given, "APO_DIST", "LDAT_ACT"))
    memory.write("$ORI_TYPE", _typed(given, "ORI_TYP", "#VAR"))
    memory.write("$CIRC_TYPE", _typed(given, "CIRC_TYP", memory.read("DEF_CIRC_TYP") or "#BASE"))


def _zone_data(memory: ProgramMemory, data: syntax.Value | None, usual: str) -> syntax.Value:
    """``APO_DIST`` of a joint motion's data, in percent or mm as its mode, which is returned, says; unclear where one
    of the two is not known. The other size stays as it is, as in controllers' own bas.src."""
    given = data.get("APO_MODE") if isinstance(data, syntax.Record) else None
    mode, distance = given or usual, syntax.number(_field(data, "APO_DIST", "zone"))
    if distance is None or isinstance(mode, syntax.Unclear):
        for part in ("CDIS", "CPTP"):
            memory.write(f"$APO.{part}", syntax.Unclear("APO_DIST"))
    elif mode == "#CPTP":
        memory.write("$APO.CPTP", min(distance, 100.0))
    else:
        memory.write("$APO.CDIS", distance)
    return mode


KINDS: dict[str, instructions.MotionKind] = {"PTP": "joint", "LIN": "line", "CIRC": "arc", "SPL": "spline"}
MODAL = ("$TOOL", "$BASE", "$LOAD", "$VEL", "$ACC", "$APO", "$VEL_AXIS", "$ACC_AXIS", "$IPO_MODE", "$ORI_TYPE")
SIZES_BY_AXES = frozenset(f"{name}{SIZES}" for name in ("$VEL_AXIS", "$ACC_AXIS", "$VEL_AXIS_C", "$ACC_AXIS_C"))
"""Sizes of the system's lists with an element for each axis of the arm; external axes have lists of their own."""
MODAL_DATA = ("PDAT_ACT", "LDAT_ACT", "FDAT_ACT", "%spline")
TURN_RATES = ("$VEL.ORI1", "$VEL.ORI2", "$ACC.ORI1", "$ACC.ORI2")
HARMLESS_TEXT = """
BASISTECH_PLC_INIT BASISTECH_PLC_LOOP CAST_FROM CAST_TO CCLOSE CHECKHOME CIOCTL CLEAR_KRLMSG COPEN CREAD CWRITE
DELETE_BACKWARD_BUFFER EB EB_ABS EK EKI_CHECK EKI_CHECKBUFFER EKI_CLEAR EKI_CLEARBUFFER EKI_CLOSE EKI_GETBOOL
EKI_GETBOOLARRAY EKI_GETFRAME EKI_GETFRAMEARRAY EKI_GETINT EKI_GETINTARRAY EKI_GETREAL EKI_GETREALARRAY EKI_GETSTRING
EKI_INIT EKI_LOCK EKI_OPEN EKI_SEND EKI_SETBOOL EKI_SETFRAME EKI_SETINT EKI_SETREAL EKI_SETSTRING EKI_UNLOCK EO
ERR_CLEAR ERR_RAISE EXISTS_KRLDLG EXISTS_KRLMSG FORWARD GETVARSTATE GET_MSGBUFFER GET_SIG_INF GET_SYSTEM_DATA H50 H70
INVERSE IR_STOPM LK MSGDIALOG MSGINFO MSGLOG MSGNOTIFY MSGQUIT MSGSTATE P00 PULSE RESET_CD_PARAMS SET_CD_PARAMS
SET_KRLDLG SET_KRLMSG SREAD STRADD STRCLEAR STRCOMP STRCOPY STRDECLLEN STRFIND STRLEN STRTOBOOL STRTOFRAME STRTOINT
STRTOPOS STRTOREAL STRTOSTRING SWRITE SYNC TQM_FIFO_READ TQM_INI USERSPOT USER_GRP VARSTATE VAR_STATE
"""
HARMLESS = frozenset(HARMLESS_TEXT.split())
"""Functions of the controller that move nothing and set no frame."""
EVALUATED = frozenset((*IN_DEGREES, "ATAN2", "INV_POS"))
READING_TEXT = """
BAS CHECKHOME CLEAR_KRLMSG CWRITE EKI_CHECKBUFFER EKI_CLEAR EKI_CLEARBUFFER EKI_CLOSE EKI_INIT EKI_LOCK EKI_OPEN
EKI_SEND EKI_SETBOOL EKI_SETFRAME EKI_SETINT EKI_SETREAL EKI_SETSTRING EKI_UNLOCK EXISTS_KRLMSG MSGINFO MSGLOG MSGNOTIFY
MSGQUIT MSGSTATE PULSE STRCOMP STRDECLLEN STRFIND STRLEN VARSTATE VAR_STATE
"""
READING = frozenset(READING_TEXT.split())
"""Functions of a controller that only read their arguments; others, as ``SREAD`` and ``EKI_GETREAL``, may set them."""
OF_SETTINGS_TEXT = """
SVEL_CP SVEL_JOINT SACC_CP SACC_JOINT SAPO SAPO_PTP STOOL STOOL2 SBASE SIPO_MODE SJERK SLOAD SGEAR_JERK SORI_TYP
SORI_TYPE SCIRC_TYP SCIRC_TYPE SCIRC_M USE_CM_PRO_VALUES USE_CM_PRO_VALUES_ONLY
"""
OF_SETTINGS = frozenset(OF_SETTINGS_TEXT.split())
"""Functions after WITH, which :func:`keep_setting` reads."""
HARMLESS_VARIABLES_TEXT = """
$ACT_BASE $ACT_TOOL $CIRC_TYPE $FILTER $LOAD_A1 $LOAD_A2 $LOAD_A3
$ACCU_STATE $ACC_EXTAX $ACT_GROUP $ADVANCE $ANOUT $AXWORKSPACE $BWDSTART $CMD $COLLMON_TOL_PRO $CP_STATMON
$CP_VEL_TYPE $CYCFLAG $CYCLE $DATE $ECO_LEVEL $EDIT_MODE $ERR $EXT $FLAG $GEAR_JERK $H_POS $I_O_ACT $JERK $LOOP_CONT
$LOOP_MSG $MSG_T $OUT $OUT_NODRIVE $OV_APPL $OV_PRO $OV_ROB $PERI_RDY $PRO_ACT $PRO_MODE $PRO_STATE $RED_VEL
$SOFT_PLCBOOL $SOFT_PLCINT $SOFT_PLCREAL $STOPNOAPROX $TIMER $TIMER_FLAG $TIMER_STOP $TORQMON $TORQMON_COM $TORQMON_DEF
$TRACE $VEL_EXTAX $WBOXDISABLE $WORKSPACE
"""
HARMLESS_VARIABLES = frozenset((*MODAL, *HARMLESS_VARIABLES_TEXT.split()))
"""System variables that are followed, or set nothing but speeds, stops, watches, signals, loads and marks; another may
make axes soft, shift paths (``$CORR_T``, ``$TECH``) or choose other postures (``$SINGUL_POS``)."""
RUNNING = ("$CYCFLAG", "$DATE", "$OV_PRO", "$SOFT_PLCBOOL", "$SOFT_PLCINT", "$SOFT_PLCREAL", "$TIMER", "$TIMER_FLAG")
"""System variables that change after they are set: watches, expressions that are evaluated again and again, what the
PLC of the controller writes."""
ORIENTATION_TYPES = {"$ORI_TYPE": ("#VAR", "#CONSTANT"), "$CIRC_TYPE": ("#BASE",)}
"""How the tool may turn on lines and arcs so that they are followed as they are meant."""
HERE = ("$POS_ACT", "$POS_FOR", "$POS_ACT_MES")
HERE_JOINTS = ("$AXIS_ACT", "$AXIS_FOR", "$AXIS_ACT_MEAS")
WHERE_INTERRUPTED = ("$POS_INT", "$AXIS_INT")
"""Where the arm was when an interrupt came, which is known nowhere."""


class Settings(NamedTuple):
    """What is set when a motion begins."""

    tool: instructions.NamedFrame
    base: instructions.NamedFrame
    speed: instructions.Rate | None
    acceleration: instructions.Rate | None
    zone: instructions.Zone
    load: instructions.Load | None


class KrlDialect(Dialect):
    """KRL, as a run needs it."""

    frames = ("$TOOL", "$BASE")
    whole_division = True
    modal = frozenset((*MODAL, *MODAL_DATA))

    def is_signal(self, name: str) -> bool:
        """Outputs."""
        return name.startswith(("$OUT[", "$ANOUT["))

    def runs_on(self, name: str) -> bool:
        """Timers, cyclic flags, the override."""
        return root(name) in RUNNING

    def is_followed(self, name: str, value: syntax.Value) -> bool:
        """Whether motions are followed as a variable asks that is set to a value."""
        return not name.startswith("$") or root(name) in HARMLESS_VARIABLES

    def frame_of(self, value: syntax.Value | None) -> Reals | None:
        """A frame's."""
        return record_pose(value)

    def named(self, name: str) -> bool:
        """Tool and base keep the name of what they are set to."""
        return name in ("$TOOL", "$BASE")

    def typed(self, kind: str, value: syntax.Value) -> syntax.Value:
        """Coordinates are REAL, however they are written; a field of the program's own type is what it declares."""
        if not isinstance(value, syntax.Record) or kind not in ("", *POSITION_KINDS):
            return value
        if kind == "FRAME":
            value = syntax.Record(value.kind, tuple(each for each in value.items if each[0] not in ("S", "T")))
        items = (
            (key, float(each) if isinstance(each, int) and key in COORDINATES and not isinstance(each, bool) else each)
            for key, each in value.items
        )
        return syntax.Record(value.kind, tuple(items))

    def assigned(self, old: syntax.Value, new: syntax.Value) -> syntax.Value:
        """A position that leaves out what the variable had: no source says whether the controller keeps that."""
        if (
            not isinstance(old, syntax.Record)
            or not isinstance(new, syntax.Record)
            or not (is_frame(new) or _has_axes(new))
        ):
            return new
        missing = tuple(
            (key, syntax.Unclear(f"{LEFT_OUT} {syntax.shown(new)}")) for key, _ in old.items if new.get(key) is None
        )
        return syntax.Record(new.kind, (*new.items, *missing))

    def constant(self, memory: ProgramMemory, name: str) -> syntax.Value | None:
        """Frames of the controller and of the cell, and where the arm is."""
        if name in ("$NULLFRAME", "$WORLD", "$ROBROOT"):
            return frame_record(instructions.pose_of((0.0,) * 6, "kuka"))
        if name == "$NUM_AX":
            return memory.cell.joints
        if name in SIZES_BY_AXES:
            return (max(6, memory.cell.joints),)
        if (mapped := memory.cell.frames.get(name)) is not None:
            return frame_record(mapped)
        if name in HERE:
            seen = memory.here.seen(tool_of(memory), base_of(memory), memory.cell.flange)
            return None if seen is None else _posture(frame_record(seen, "E6POS"), memory.here.joints, name)
        if name in HERE_JOINTS and memory.here.joints is not None:
            degrees = [math.degrees(each) for each in memory.here.joints]
            return syntax.Record("E6AXIS", tuple((f"A{i + 1}", each) for i, each in enumerate(degrees)))
        return None

    def function(self, memory: ProgramMemory, name: str, given: syntax.Invocation) -> syntax.Value:
        """Mathematics in degrees, and inverse frames."""
        values = tuple(None if each is None else memory.value(each) for each in given.arguments)
        if name == "INV_POS" and len(values) == 1 and is_frame(values[0]):
            pose = record_pose(values[0])
            if pose is not None:
                inverse = pose.copy()
                inverse[:3, :3] = pose[:3, :3].T
                inverse[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
                return frame_record(inverse)
        found: syntax.Value | None = None
        if name == "ATAN2":
            found = evaluated(lambda y, x: math.degrees(math.atan2(y, x)), values)
        elif name in IN_DEGREES:
            found = evaluated(IN_DEGREES[name], values)
        return syntax.Unclear(f"{name}(...)") if found is None else found

    def product(self, left: syntax.Value, right: syntax.Value) -> syntax.Value:
        """The geometric operator: ``right`` in the frame ``left``."""
        for each in (left, right):
            if isinstance(each, syntax.Unclear):
                return each
        a, b = record_pose(left), record_pose(right)
        if a is None or b is None or not isinstance(right, syntax.Record):
            return syntax.Unclear(f"{syntax.shown(left)}:{syntax.shown(right)}")
        found = syntax.Record(right.kind, frame_record(a @ b).items)
        rest = [(key, value) for key, value in right.items if key not in FRAME_KEYS]
        return syntax.Record(found.kind, (*found.items, *rest))

    def motion(self, memory: ProgramMemory, move: syntax.Move) -> instructions.ArmMotion:
        """PTP, LIN, CIRC and their relatives and splines."""
        if not move.settings:
            return self._motion(memory, move, None)
        kept, angle, other = dict(memory.shared), None, ""
        for name, expression in move.settings:
            if name == "CA":
                degrees = syntax.number(memory.value(expression))
                angle = math.radians(degrees) if degrees is not None else math.nan
                continue
            keep_setting(memory, name, expression)
            value = known(memory.read(name), name)
            if not self.is_followed(name, value):
                other = f"{name}={syntax.shown(value)}"
        found = self._motion(memory, move, angle)
        memory.shared = kept
        memory.kept.clear()
        return replace(found, not_followed=found.not_followed or other)

    def _motion(self, memory: ProgramMemory, move: syntax.Move, angle: float | None) -> instructions.ArmMotion:
        plain = move.form.removesuffix("_REL")
        kind = KINDS[plain.removeprefix("S") if plain != "SPL" else plain]
        tool, base, speed, acceleration, zone, load = _settings(memory, kind, move)
        values = [self._argument(memory, each) for each in move.arguments]
        if len(values) != (2 if kind == "arc" else 1):
            values = [UNREAD, UNREAD]
        left_out = () if plain != move.form else tuple(map(_left_out, repeat(memory), move.arguments, values))
        make = relative if plain != move.form else target
        in_tool = "#TOOL" in move.words
        made = [make(memory, value, (tool, base), (move.text, in_tool)) for value in values]
        if kind in ("line", "arc", "spline") and memory.read("$ORI_TYPE") == "#CONSTANT":
            made = [self._unturned(memory, each, (tool, base)) for each in made]
        if kind != "joint":  # which ignores S and T
            made = [replace(each, branch=None) if isinstance(each, instructions.PoseTarget) else each for each in made]
        said = [*left_out, self._turns(memory, kind)]
        if plain != move.form and not in_tool:  # no public text says how angles are added to those before
            said += [text for value in values if (text := _turned_by(value))]
        via = made[0] if kind == "arc" else None
        block = memory.shared.get("%spline")
        return instructions.ArmMotion(
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
            not_followed="; ".join(filter(None, said)),
            turning=(None, None) if kind == "joint" else (_turning(memory, "ORI1"), _turning(memory, "ORI2")),
            load=load,
        )

    def _turns(self, memory: ProgramMemory, kind: instructions.MotionKind) -> str:
        """The setting of how the tool turns on lines and arcs that is not followed; empty for none."""
        if kind == "joint":
            return ""
        given = ((name, memory.read(name)) for name in ORIENTATION_TYPES if kind == "arc" or name != "$CIRC_TYPE")
        other = (
            f"{name}={syntax.shown(value)}" for name, value in given if value and value not in ORIENTATION_TYPES[name]
        )
        return ", ".join(other)

    def _unturned(self, memory: ProgramMemory, goal: instructions.Target, frames: Frames) -> instructions.Target:
        """The target with the orientation that the tool has before: ``$ORI_TYPE=#CONSTANT``."""
        if not isinstance(goal, instructions.PoseTarget):
            return goal
        seen = memory.here.seen(*frames, memory.cell.flange)
        if seen is None:
            return instructions.UnresolvedTarget("$ORI_TYPE=#CONSTANT", "position_unknown")
        pose = goal.pose.copy()
        pose[:3, :3] = seen[:3, :3]
        return replace(goal, pose=pose)

    def _argument(self, memory: ProgramMemory, argument: syntax.Expression | None) -> syntax.Value:
        """A motion's argument; to go to where the arm is, wherever that is, no joint moves."""
        if argument is None:
            return syntax.Unclear("")
        name = argument.name if isinstance(argument, syntax.Variable) else ""
        lost = name in WHERE_INTERRUPTED and memory.here.joints is None and memory.here.pose is None
        if (lost or name in HERE + HERE_JOINTS) and isinstance(memory.value(argument), syntax.Unclear):
            return syntax.Record("E6AXIS", ())
        return memory.value(argument)

    def carry_out(self, memory: ProgramMemory, doing: syntax.Doing) -> instructions.Instruction | None:
        """Settings by BAS, ends of splines, signals by PULSE; the rest is unknown."""
        call = doing.what
        assert isinstance(call, syntax.Invocation)
        if call.function in ("%SPLINE", "%ENDSPLINE"):
            memory.write("%spline", doing.place.line if call.function == "%SPLINE" else 0)
            return None
        if call.function == "BAS":
            return None if set_by_bas(memory, call) else instructions.Unknown(doing.text)
        if call.function == "PULSE" and call.arguments and call.arguments[0] is not None:
            name = memory.key(call.arguments[0]) or "$OUT"
            memory.forget("$OUT")  # which is what it was again, but nobody knows when
            return instructions.Output(name, doing.text)
        return instructions.Aside(doing.text) if self.harmless(call) else instructions.Unknown(doing.text)

    def harmless(self, call: syntax.Invocation) -> bool:
        """Messages, files, signals."""
        if call.function == "CWRITE" and syntax.Variable("$CMD") in call.arguments:  # commands, as to run a program
            return False
        return call.function in HARMLESS | EVALUATED | OF_SETTINGS


def _turned_by(value: syntax.Value) -> str:
    """The angles of a relative position, as text; empty where it does not turn."""
    items = value.items if isinstance(value, syntax.Record) else ()
    turned = (
        f"{key} {syntax.shown(part)}" for key, part in items if key in FRAME_KEYS[3:] and syntax.number(part) != 0
    )
    return ", ".join(turned)


def _left_out(memory: ProgramMemory, argument: syntax.Expression | None, value: syntax.Value) -> str:
    """What a variable's position leaves out, which no source says where it is taken from; empty for nothing."""
    held = isinstance(argument, (syntax.Variable, syntax.Member, syntax.Element))
    if not held or not isinstance(value, syntax.Record) or not value.items:
        return ""
    keys = AXIS_KEYS[: memory.cell.joints] if _has_axes(value) else FRAME_KEYS
    return ", ".join(key for key in keys if value.get(key) is None)


def changed_arguments(call: syntax.Invocation) -> tuple[syntax.Expression | None, ...]:
    """What a function outside the program may change: all that it is given, as KRL passes by reference, but for system
    variables that nothing sets; and the program's number by ``P00``."""
    name = call.function
    if name == "P00":
        return (syntax.Variable("PGNO"),)
    if name.startswith("%") or name in EVALUATED | OF_SETTINGS | READING:
        return ()
    return tuple(each for each in call.arguments if each is not None and _is_set(variable_of(each)))


def _is_set(name: str) -> bool:
    """Whether a variable may be set: no system variable but those that motions use, outputs and flags."""
    return not name.startswith("$") or name in (*MODAL, "$ANOUT", "$FLAG", "$OUT")


def _settings(memory: ProgramMemory, kind: instructions.MotionKind, move: syntax.Move) -> Settings:
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
            _load(memory),
        )
        memory.kept[key] = found
    return found


def _speed(memory: ProgramMemory, kind: instructions.MotionKind) -> instructions.Rate | None:
    if kind == "joint":
        return _axis_share(memory, "$VEL_AXIS")
    speed = syntax.rate_of(memory.read("$VEL.CP"), "m/s")
    if speed is not None and speed.value > MOST_SPEED:
        return instructions.Rate(0.0, "m/s", f"$VEL.CP={speed.value:g}")
    return speed


def _acceleration(memory: ProgramMemory, kind: instructions.MotionKind) -> instructions.Rate | None:
    if kind == "joint":
        return _axis_share(memory, "$ACC_AXIS")
    value = memory.read("$ACC.CP")
    if isinstance(value, syntax.Record):
        return syntax.rate_of(value.get("share"), "share")
    return syntax.rate_of(value, "m/s2")


def _turning(memory: ProgramMemory, part: str) -> instructions.Turning | None:
    """How fast the tool may turn on lines and arcs, deg/s and deg/s2: ORI1 of its direction, ORI2 about that."""
    speed = syntax.rate_of(memory.read(f"$VEL.{part}"), "rad/s", math.degrees(1.0))
    if speed is None:
        return None
    return instructions.Turning(speed, syntax.rate_of(memory.read(f"$ACC.{part}"), "rad/s2", math.degrees(1.0)))


def _axis_share(memory: ProgramMemory, name: str) -> instructions.Rate | None:
    """What is set for the axes in percent: one that is not known, else one beyond 100, else the slowest."""
    values = [memory.read(f"{name}[{axis}]") for axis in range(1, 7)]
    given = [rate for value in values if (rate := syntax.rate_of(value, "share", 100.0)) is not None]
    if any(rate.text for rate in given):
        return next(rate for rate in given if rate.text)
    beyond = [rate for rate in given if rate.value > 1]
    return min(beyond or given, key=lambda rate: rate.value, default=None)


def _zone(memory: ProgramMemory, kind: instructions.MotionKind, words: tuple[str, ...]) -> instructions.Zone:
    given = [word for word in words if word.startswith("C_")]
    if not given:
        return instructions.FINE
    word = given[0]
    if kind == "joint" and {"C_ORI", "C_VEL"}.intersection(given):  # which hold on the line or arc after it
        return instructions.Zone("named", 0.0, " ".join(given))
    distance, joint_zone = syntax.number(memory.read("$APO.CDIS")), memory.read("$APO.CPTP")
    share = syntax.number(joint_zone)
    if (word == "C_PTP" or (word == "C_SPL" and kind == "joint")) and share is not None:
        return instructions.Zone("share", share / 100, word)
    if (word in ("C_DIS", "C_SPL") or (word == "C_PTP" and joint_zone == "#CDIS")) and distance is not None:
        return instructions.Zone("distance", distance / 1000, word)
    angle, slow = syntax.number(memory.read("$APO.CORI")), syntax.number(memory.read("$APO.CVEL"))
    if word == "C_ORI" and angle is not None:
        return instructions.Zone("angle", math.radians(angle), word)
    if word == "C_VEL" and slow is not None:
        return instructions.Zone("velocity", slow / 100, word)
    return instructions.Zone("named", 0.0, word)
