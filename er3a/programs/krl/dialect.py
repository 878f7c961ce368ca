"""The meaning of KRL's motions, frames and functions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.programs import syntax
from er3a.programs.evaluation import (
    IN_DEGREES,
    SIZES,
    Dialect,
    ProgramMemory,
    evaluated,
    external_axes,
    root,
    target_numbers,
    unresolved,
)
from er3a.programs.instructions import (
    FINE,
    ArmMotion,
    Instruction,
    JointTarget,
    Load,
    MeantSolution,
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
    ZoneKind,
    numbers_of,
    pose_of,
)
from er3a.programs.syntax import (
    Element,
    Expression,
    Invocation,
    Move,
    Record,
    Unclear,
    Value,
    Variable,
    numbers,
    rate_of,
    shown,
)
from er3a.robots.masses import MassBody, moved

FRAME_KEYS = ("X", "Y", "Z", "A", "B", "C")
AXIS_KEYS = ("A1", "A2", "A3", "A4", "A5", "A6")
AXIS_KINDS = ("AXIS", "E6AXIS")
EXTERNAL_KEYS = ("E1", "E2", "E3", "E4", "E5", "E6")
COORDINATES = frozenset((*FRAME_KEYS, *AXIS_KEYS, *EXTERNAL_KEYS))
POSITION_FIELDS = COORDINATES | {"S", "T"}
POSITION_KINDS = ("FRAME", "POS", "E6POS", *AXIS_KINDS)
MOST_SPEED = 3.0  # m/s
"""What controllers take along a path at most: ``$VEL_MA.CP`` of their machine data."""
SIGN_ZERO = 1e-7  # rad; nearer to 0 a joint's sign says nothing
Frames = tuple[NamedFrame, NamedFrame]
NULL = (0.0,) * 6


def _has_axes(value: Record) -> bool:
    return value.kind in AXIS_KINDS or any(key in AXIS_KEYS for key, _ in value.items)


def is_frame(value: Value | None) -> bool:
    """Whether a value has a coordinate of a frame.

    Parameters
    ----------
    value : of any kind

    Returns
    -------
    frame : whether it is a record with X, Y, Z, A, B or C among its fields
    """
    return isinstance(value, Record) and any(value.get(key) is not None for key in FRAME_KEYS)


def record_pose(value: Value | None) -> Reals | None:
    """The transform of a frame.

    Parameters
    ----------
    value : X, Y, Z in mm, and A, B, C in deg with R = Rz(A) Ry(B) Rx(C)

    Returns
    -------
    T : (4, 4), m; None for anything else, and for a frame that leaves something out
    """
    if not isinstance(value, Record):
        return None
    plain = numbers(tuple(value.get(key) for key in FRAME_KEYS))
    return pose_of(plain, "kuka") if plain is not None and syntax.finite(plain) else None


def frame_record(pose: Reals) -> Record:
    """A transform as a frame of KRL; the inverse of :func:`record_pose`.

    Parameters
    ----------
    pose : (4, 4), m
    """
    return Record("FRAME", tuple(zip(FRAME_KEYS, numbers_of(pose, "kuka"))))


def target(memory: ProgramMemory, value: Value, frames: Frames, said: tuple[str, bool]) -> Target:
    """What a position in a motion means.

    Parameters
    ----------
    value : axes A1 .. A6 in deg, or a pose in mm and deg; what it leaves out stays as it is
    frames : tool and base in which the pose is
    said : the line, and whether a relative position is meant in the tool's axes, which does not count here

    Returns
    -------
    target : in rad or m; an :class:`UnresolvedTarget` with the reason where it is not known
    """
    found = _position(memory, value, said[0])
    if not isinstance(found, Record):
        return found
    if _has_axes(found):
        here = memory.here.joints
        return _joints(memory, found, said[0], np.full(memory.cell.joints, np.nan) if here is None else here)
    return _pose(memory, found, frames, said[0])


def relative(memory: ProgramMemory, value: Value, frames: Frames, said: tuple[str, bool]) -> Target:
    """A target given by its difference from where the arm is (``PTP_REL``, ``LIN_REL``).

    Parameters
    ----------
    value : axes in deg, or mm and deg along and about the axes of the base, or of the tool
    frames : tool and base in which the arm's pose is seen
    said : the line, and whether the difference is in the tool's axes

    Returns
    -------
    target : in rad or m; an :class:`UnresolvedTarget` where the position or the difference is not known
    """
    text, in_tool = said
    found = _position(memory, value, text)
    if not isinstance(found, Record):
        return found
    if _has_axes(found):
        change = _joints(memory, found, text, np.zeros(memory.cell.joints))
        if not isinstance(change, JointTarget):
            return change
        if memory.here.joints is None:
            return UnresolvedTarget(text, "position_unknown")
        return JointTarget(memory.here.joints + change.joints, change.external)
    given = _components(found, FRAME_KEYS, text)
    if isinstance(given, UnresolvedTarget):
        return given
    seen = memory.here.seen(*frames, memory.cell.flange)
    if seen is None:
        return UnresolvedTarget(text, "position_unknown")
    offset = pose_of([each or 0.0 for each in given], "kuka")
    if in_tool:
        return PoseTarget(seen @ offset, external=external_axes(found, EXTERNAL_KEYS))
    # Along and about the axes of the base, with the tool point as the centre of the turn.
    pose = seen.copy()
    pose[:3, 3] += offset[:3, 3]
    pose[:3, :3] = offset[:3, :3] @ seen[:3, :3]
    return PoseTarget(pose, external=external_axes(found, EXTERNAL_KEYS))


def _position(memory: ProgramMemory, value: Value, text: str) -> Record | UnresolvedTarget:
    """A position of coordinates or axes; why it is none, or why the workpiece may be moved along a fixed tool."""
    if isinstance(value, Unclear):
        return unresolved(value, text)
    fits = isinstance(value, Record) and all(key in POSITION_FIELDS for key, _ in value.items)
    if not isinstance(value, Record) or not fits or (_has_axes(value) and is_frame(value)):
        return UnresolvedTarget(text, "not_understood")
    mode = memory.read("$IPO_MODE")
    if mode in (None, "#BASE") or _has_axes(value):
        return value
    if isinstance(mode, Unclear):
        return UnresolvedTarget(f"$IPO_MODE={mode.text}", "undefined")
    return UnresolvedTarget(text, "external_tool")


def _components(value: Record, keys: tuple[str, ...], text: str) -> list[float | None] | UnresolvedTarget:
    """Numbers of a record, None for what it leaves out."""
    parts = [value.get(key) for key in keys]
    plain = target_numbers([each for each in parts if each is not None], text)
    if isinstance(plain, UnresolvedTarget):
        return plain
    given = iter(plain)
    return [None if each is None else next(given) for each in parts]


def _joints(memory: ProgramMemory, value: Record, text: str, missing: Reals) -> Target:
    degrees = _components(value, AXIS_KEYS, text)
    if isinstance(degrees, UnresolvedTarget):
        return degrees
    count = memory.cell.joints
    if any(degrees[count:]):
        return UnresolvedTarget(text, "too_many_joints")
    joints = [missing[i] if each is None else math.radians(each) for i, each in enumerate(degrees[:count])]
    return JointTarget(np.array(joints), external_axes(value, EXTERNAL_KEYS))


def _pose(memory: ProgramMemory, value: Record, frames: Frames, text: str) -> Target:
    given = _components(value, FRAME_KEYS, text)
    if isinstance(given, UnresolvedTarget):
        return given
    if None in given:
        seen = memory.here.seen(*frames, memory.cell.flange)
        if seen is None:
            return UnresolvedTarget(text, "position_unknown")
        given = [old if each is None else each for each, old in zip(given, numbers_of(seen, "kuka"))]
    words = ((key, value.get(key)) for key in ("S", "T"))
    given_words = ((key, each.text if isinstance(each, Unclear) else syntax.number(each)) for key, each in words)
    configuration = tuple((key, each) for key, each in given_words if each is not None)
    pose = pose_of([each or 0.0 for each in given], "kuka")
    branch = _branch(syntax.number(value.get("T")), memory.cell.joints)
    return PoseTarget(pose, configuration, external=external_axes(value, EXTERNAL_KEYS), branch=branch)


def _branch(turn: float | None, joints: int) -> MeantSolution | None:
    """What Turn says of a solution: bit i - 1 is set where axis i is below 0."""
    if turn is None:
        return None
    below = [(int(turn) >> i) & 1 for i in range(joints)]
    return MeantSolution(np.array([(-np.inf, SIGN_ZERO) if each else (-SIGN_ZERO, np.inf) for each in below]))


def _frame(memory: ProgramMemory, variable: str) -> NamedFrame:
    """The tool or base that is set."""
    value = memory.read(variable)
    if value is None:
        if any(f"{variable}.{key}" in memory.shared for key in FRAME_KEYS):  # a part of one that nothing gives
            return NamedFrame(variable)
        return NamedFrame("", memory.cell.tool if variable == "$TOOL" else memory.cell.base, own=False)
    said = memory.read(variable + "%name")
    name = said.upper() if isinstance(said, str) and said[:1] not in ("{", "") else ""
    pose = record_pose(value)
    if isinstance(value, Unclear):
        name = name or value.text
        own = memory.read(name) if name not in HERE else None
        if isinstance(own, Unclear) and not isinstance(own, syntax.Unset):  # the program or others change it
            name = f"{name}, changed" if own.text == name else f"{name}={own.text}"
    elif pose is None and is_frame(value):
        name = shown(value)
    mapped = memory.cell.frames.get(name)
    return NamedFrame(name, mapped if pose is None else pose)


def _field(data: Value | None, name: str, kept_as: str, usual: Value | None = None) -> Value:
    """A field of motion data; the usual where they don't have it, unclear where there is none."""
    found = data.get(name) if isinstance(data, Record) else None
    unclear = data.text if isinstance(data, Unclear) and data.text else f"{kept_as}.{name}"
    return found or usual or Unclear(unclear) if found is None else found


def _initial(memory: ProgramMemory, _: Value) -> None:
    """``BAS(#INITMOV,0)`` as controllers' own bas.src has it: full speed, the robot's base, tool 1, usual zones."""
    _all_axes(memory, "$ACC_AXIS", 100)
    _all_axes(memory, "$VEL_AXIS", 100)
    _line_acceleration(memory, 100)
    memory.write("$VEL.CP", memory.read("DEF_VEL_CP") or Unclear("DEF_VEL_CP"))
    for name in TURN_RATES:
        given = memory.read(f"DEF_{name[1:].replace('.', '_')}")
        if given is None:  # as the machine data say
            memory.shared.pop(name, None)
        else:
            memory.write(name, given)
    for part in ("CPTP", "CDIS", "CVEL", "CORI"):
        memory.write(f"$APO.{part}", memory.read(f"DEF_APO_{part}") or Unclear(f"DEF_APO_{part}"))
    memory.write("$ORI_TYPE", "#VAR")
    memory.write("$CIRC_TYPE", memory.read("DEF_CIRC_TYP") or "#BASE")
    memory.write("$IPO_MODE", "#BASE")
    _base_number(memory, 0)
    _tool_number(memory, 1)


def _joint_speed(memory: ProgramMemory, percent: Value) -> None:
    """Of all axes, in percent; bas.src takes 100 for what is more, which is kept to be named."""
    plain = syntax.number(percent)
    beyond = plain is not None and plain > 100
    _all_axes(memory, "$VEL_AXIS", Record("beyond", (("given", percent),)) if beyond else percent)


def _line_speed(memory: ProgramMemory, speed: Value) -> None:
    """Some controllers bound it by DEF_VEL_CP, others by their machine data."""
    memory.write("$VEL.CP", speed)


def _line_acceleration(memory: ProgramMemory, percent: Value) -> None:
    plain, full = syntax.number(percent), syntax.number(memory.read("DEF_ACC_CP"))
    if plain is None:
        memory.write("$ACC.CP", percent)
        return
    share = min(plain / 100, 1.0)
    memory.write("$ACC.CP", Record("", (("share", share),)) if full is None else share * full)


def _all_axes(memory: ProgramMemory, name: str, value: Value) -> None:
    for axis in range(1, 7):
        memory.write(f"{name}[{axis}]", value)


def _number(memory: ProgramMemory, variable: str, array: str, given: Value) -> None:
    """Set tool or base by its number; 0, and -1 of what was never taught, is the null frame."""
    plain = syntax.number(given)
    memory.shared.pop(variable + "%name", None)
    if plain is None:
        memory.write(variable, Unclear(f"{array}[?]"))
        return
    name = f"{array}[{plain:g}]" if plain > 0 else "$NULLFRAME"
    memory.write(variable, memory.read(name) or Unclear(name))
    memory.write(variable + "%name", name)


def _base_number(memory: ProgramMemory, given: Value) -> None:
    _number(memory, "$BASE", "BASE_DATA", given)


def _tool_number(memory: ProgramMemory, given: Value) -> None:
    """Tool and load by their number, as controllers' own bas.src sets both."""
    _number(memory, "$TOOL", "TOOL_DATA", given)
    _load_number(memory, given)


def _load_number(memory: ProgramMemory, given: Value) -> None:
    memory.shared.pop("$LOAD.M", None)
    number = syntax.number(given)
    unknown = Unclear("LOAD_DATA[?]")
    memory.write("$LOAD", unknown if number is None else memory.read(f"LOAD_DATA[{number:g}]") or 0)


def load_of(value: Value | None) -> Load | None:
    """What a LOAD says hangs on the flange.

    Parameters
    ----------
    value : ``{M kg, CM {X mm, Y, Z, A deg, B, C}, J {X kg m^2, Y, Z}}``: J about the axes of CM, through the centre of
        mass

    Returns
    -------
    load : kg, m, kg m^2, in the flange's frame; None for a mass below 0, which means unknown, and for 0. An
        :class:`UnclearLoad` where a number is not known.
    """
    if not isinstance(value, Record):
        return UnclearLoad(value.text) if isinstance(value, Unclear) else None
    mass, moments = syntax.number(value.get("M")), value.get("J")
    if mass is not None and mass <= 0:
        return None
    centre = record_pose(value.get("CM"))
    given = numbers(tuple(moments.get(key) for key in "XYZ")) if isinstance(moments, Record) else NULL[:3]
    if mass is None or not math.isfinite(mass) or centre is None or given is None:
        return UnclearLoad("LOAD", mass)
    x, y, z = given
    return moved(MassBody(mass, inertia=(x, y, z, 0.0, 0.0, 0.0)), centre)


def _tool_data(memory: ProgramMemory, data: Value) -> None:
    _tool_number(memory, _field(data, "TOOL_NO", "FDAT"))
    memory.write("$IPO_MODE", _field(data, "IPO_FRAME", "FDAT", "#BASE"))


def _frames(memory: ProgramMemory, _: Value) -> None:
    data = memory.read("FDAT_ACT") or Unclear("FDAT_ACT")
    _tool_data(memory, data)
    _base_number(memory, _field(data, "BASE_NO", "FDAT"))


def _joint_data(memory: ProgramMemory, speed: Value | None) -> None:
    data = memory.read("PDAT_ACT")
    _all_axes(memory, "$ACC_AXIS", _field(data, "ACC", "PDAT_ACT"))
    _zone_data(memory, data, "#CPTP")
    _joint_speed(memory, _field(data, "VEL", "PDAT_ACT") if speed is None else speed)


def _line_data(memory: ProgramMemory, speed: Value | None) -> None:
    data = memory.read("LDAT_ACT")
    _line_acceleration(memory, _field(data, "ACC", "LDAT_ACT"))
    memory.write("$APO.CDIS", _field(data, "APO_DIST", "LDAT_ACT"))
    memory.write("$ORI_TYPE", _field(data, "ORI_TYP", "LDAT_ACT", "#VAR"))
    memory.write("$CIRC_TYPE", _field(data, "CIRC_TYP", "LDAT_ACT", memory.read("DEF_CIRC_TYP") or "#BASE"))
    _line_speed(memory, _field(data, "VEL", "LDAT_ACT") if speed is None else speed)


def _zone_data(memory: ProgramMemory, data: Value | None, usual: str) -> Value:
    """``APO_DIST`` of a joint motion's data, in percent or mm as its mode, which is returned, says; unclear where one
    of the two is not known. The other size stays as it is, as in controllers' own bas.src."""
    mode = _field(data, "APO_MODE", "zone", usual)
    distance = syntax.number(_field(data, "APO_DIST", "zone"))
    if distance is None or isinstance(mode, Unclear):
        for part in ("CDIS", "CPTP"):
            memory.write(f"$APO.{part}", Unclear("APO_DIST"))
    elif mode == "#CPTP":
        memory.write("$APO.CPTP", min(distance, 100.0))
    else:
        memory.write("$APO.CDIS", distance)
    return mode


def _with_frames(memory: ProgramMemory, setting: Setting, speed: Value) -> None:
    setting(memory, speed)
    _frames(memory, speed)


Setting = Callable[[ProgramMemory, Value], None]
BAS: dict[str, Setting] = {
    "#INITMOV": _initial,
    "#VEL_PTP": _joint_speed,
    "#ACC_PTP": lambda memory, given: _all_axes(memory, "$ACC_AXIS", given),
    "#VEL_CP": _line_speed,
    "#ACC_CP": _line_acceleration,
    "#TOOL": _tool_number,
    "#BASE": _base_number,
    "#FRAMES": _frames,
    "#PTP_DAT": lambda memory, _: _joint_data(memory, None),
    "#PTP_PARAMS": lambda memory, given: _with_frames(memory, _joint_data, given),
    "#CP_DAT": lambda memory, _: _line_data(memory, None),
    "#CP_PARAMS": lambda memory, given: _with_frames(memory, _line_data, given),
}
"""What commands of BAS do, by the value after them."""


def _joint_zone(memory: ProgramMemory, data: Value) -> None:
    if _zone_data(memory, data, "#CDIS") == "#CDIS":
        memory.write("$APO.CPTP", "#CDIS")  # 100 on the controller, so that the distance decides


OF_ONE_MOTION: dict[str, Setting] = {
    "SVEL_CP": _line_speed,
    "SVEL_JOINT": _joint_speed,
    "SACC_JOINT": lambda memory, data: _all_axes(memory, "$ACC_AXIS", _field(data, "ACC", "SACC_JOINT")),
    "SACC_CP": lambda memory, data: _line_acceleration(memory, _field(data, "ACC", "SACC_CP")),
    "SAPO": lambda memory, data: memory.write("$APO.CDIS", _field(data, "APO_DIST", "SAPO")),
    "SAPO_PTP": _joint_zone,
    "STOOL2": _tool_data,
    "SBASE": _base_number,
    "SLOAD": _load_number,
    "SIPO_MODE": lambda memory, given: memory.write("$IPO_MODE", given),
    "SORI_TYP": lambda memory, data: memory.write("$ORI_TYPE", _field(data, "ORI_TYP", "SORI_TYP", "#VAR")),
    "SCIRC_TYPE": lambda memory, data: memory.write("$CIRC_TYPE", _field(data, "CIRC_TYP", "SCIRC_TYPE", "#BASE")),
}
"""Functions after WITH, by the value that they are given."""


def keep_setting(memory: ProgramMemory, name: str, expression: Expression) -> None:
    """Carry out one item of a WITH, which holds for one motion.

    Parameters
    ----------
    memory : is changed; whoever calls this restores it after the motion
    name : of the variable that is set, or a name for the call
    expression : the value, or a call such as ``SVEL_JOINT(50)``
    """
    called = expression if isinstance(expression, Invocation) else None
    setting = OF_ONE_MOTION.get(called.function) if called else None
    if called and setting is not None:
        first = called.arguments[0] if called.arguments else None
        setting(memory, Unclear(name) if first is None else memory.value(first))
        return
    value = memory.value(expression)
    variable, _, index = name.rstrip("]").partition("[")
    if index.isdecimal():  # an element that the list may not have
        memory.key(Element(Variable(variable), (syntax.Constant(float(index)),)))
    if name in ("$VEL_AXIS[1]", "$ACC_AXIS[1]"):
        _all_axes(memory, name[:-3], value)
        return
    frame, _, part = name.partition(".")
    if part and frame in ("$TOOL", "$BASE"):
        old, name = memory.read(frame), frame
        value = old.having(part, value) if isinstance(old, Record) else Unclear(f"{frame}.{part}")
    memory.write(name, value)
    memory.shared.pop(name + "%name", None)


KINDS: dict[str, MotionKind] = {"PTP": "joint", "LIN": "line", "CIRC": "arc"}
MODAL = ("$TOOL", "$BASE", "$LOAD", "$VEL", "$ACC", "$APO", "$VEL_AXIS", "$ACC_AXIS", "$IPO_MODE", "$ORI_TYPE")
SIZES_BY_AXES = frozenset(f"{name}{SIZES}" for name in ("$VEL_AXIS", "$ACC_AXIS", "$VEL_AXIS_C", "$ACC_AXIS_C"))
"""Sizes of the system's lists with an element for each axis of the arm; external axes have lists of their own."""
TURN_RATES = ("$VEL.ORI1", "$VEL.ORI2")
READING_TEXT = """
CHECKHOME CLEAR_KRLMSG CWRITE EKI_CHECKBUFFER EKI_CLEAR EKI_CLEARBUFFER EKI_CLOSE EKI_INIT EKI_LOCK EKI_OPEN
EKI_SEND EKI_SETBOOL EKI_SETFRAME EKI_SETINT EKI_SETREAL EKI_SETSTRING EKI_UNLOCK EXISTS_KRLMSG MSGINFO MSGLOG MSGNOTIFY
MSGQUIT MSGSTATE STRCOMP STRDECLLEN STRFIND STRLEN VARSTATE VAR_STATE
"""
READING = frozenset(READING_TEXT.split())
"""Functions of a controller that only read their arguments; others, as ``SREAD`` and ``EKI_GETREAL``, may set them."""
HARMLESS_TEXT = """
BASISTECH_PLC_INIT BASISTECH_PLC_LOOP CAST_FROM CAST_TO CCLOSE CIOCTL COPEN CREAD
DELETE_BACKWARD_BUFFER EB EB_ABS EK EKI_GETBOOL
EKI_GETBOOLARRAY EKI_GETFRAME EKI_GETFRAMEARRAY EKI_GETINT EKI_GETINTARRAY EKI_GETREAL EKI_GETREALARRAY EKI_GETSTRING EO
ERR_CLEAR ERR_RAISE EXISTS_KRLDLG FORWARD GETVARSTATE GET_MSGBUFFER GET_SIG_INF GET_SYSTEM_DATA H50 H70
INVERSE IR_STOPM LK MSGDIALOG P00 PULSE RESET_CD_PARAMS SET_CD_PARAMS
SET_KRLDLG SET_KRLMSG SREAD STRADD STRCLEAR STRCOPY STRTOBOOL STRTOFRAME STRTOINT
STRTOPOS STRTOREAL STRTOSTRING SWRITE SYNC TQM_FIFO_READ TQM_INI USERSPOT USER_GRP
"""
HARMLESS = frozenset(HARMLESS_TEXT.split()) | READING
"""Functions of the controller that move nothing and set no frame."""
EVALUATED = frozenset((*IN_DEGREES, "INV_POS"))
OF_SETTINGS_TEXT = "STOOL SJERK SGEAR_JERK SORI_TYPE SCIRC_TYP SCIRC_M USE_CM_PRO_VALUES USE_CM_PRO_VALUES_ONLY"
OF_SETTINGS = frozenset((*OF_ONE_MOTION, *OF_SETTINGS_TEXT.split()))
"""Functions after WITH; those that :func:`keep_setting` does not read give no known value."""
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
FOLLOWED_TYPES = {"$ORI_TYPE": "#VAR", "$CIRC_TYPE": "#BASE"}
"""How the tool may turn on lines and arcs so that they are followed as they are meant."""
HERE = ("$POS_ACT", "$POS_FOR", "$POS_ACT_MES")
HERE_JOINTS = ("$AXIS_ACT", "$AXIS_FOR", "$AXIS_ACT_MEAS")


class KrlDialect(Dialect):
    """KRL, as a run needs it."""

    frames = ("$TOOL", "$BASE")
    signals = ("$OUT[", "$ANOUT[")
    whole_division = True
    modal = frozenset((*MODAL, "PDAT_ACT", "LDAT_ACT", "FDAT_ACT"))
    harmless = HARMLESS | EVALUATED | OF_SETTINGS
    reading = READING | EVALUATED | OF_SETTINGS | {"BAS"}
    by_reference = True
    running = RUNNING

    def is_followed(self, name: str) -> bool:
        """Whether motions are followed as a variable asks.

        Returns
        -------
        followed : True for the program's own variables, and for those of the system that are known
            (``HARMLESS_VARIABLES``)
        """
        return not name.startswith("$") or root(name) in HARMLESS_VARIABLES

    def typed(self, kind: str, value: Value) -> Value:
        """What a variable of a type holds: coordinates are REAL, however they are written, and a frame has no posture.

        Parameters
        ----------
        kind : the declared type; records of other types than positions stay as they are

        Returns
        -------
        value : without S and T for a FRAME
        """
        if not isinstance(value, Record) or kind not in ("", *POSITION_KINDS):
            return value
        items = (
            (key, float(each) if key in COORDINATES and isinstance(each, int) and not isinstance(each, bool) else each)
            for key, each in value.items
            if kind != "FRAME" or key not in ("S", "T")
        )
        return Record(value.kind, tuple(items))

    def constant(self, memory: ProgramMemory, name: str) -> Value | None:
        """Frames of the controller and of the cell, and where the arm is.

        Returns
        -------
        value : such as ``$NULLFRAME``, ``$POS_ACT`` (mm, deg; Status depends on the arm and is unclear) or
            ``$AXIS_ACT`` (deg); None for other names, and where the position is not known
        """
        if name in ("$NULLFRAME", "$WORLD", "$ROBROOT"):
            return frame_record(pose_of(NULL, "kuka"))
        if name == "$NUM_AX":
            return memory.cell.joints
        if name in SIZES_BY_AXES:
            return (max(6, memory.cell.joints),)
        if (mapped := memory.cell.frames.get(name)) is not None:
            return frame_record(mapped)
        joints = memory.here.joints
        if name in HERE:
            seen = memory.here.seen(_frame(memory, "$TOOL"), _frame(memory, "$BASE"), memory.cell.flange)
            if seen is None:
                return None
            turn = Unclear(f"T of {name}") if joints is None else sum(1 << i for i, q in enumerate(joints) if q < 0)
            posture = (("S", Unclear(f"S of {name}")), ("T", turn))  # Status depends on the arm
            return Record("E6POS", (*frame_record(seen).items, *posture))
        if name in HERE_JOINTS and joints is not None:
            return Record("E6AXIS", tuple((f"A{i + 1}", math.degrees(q)) for i, q in enumerate(joints)))
        return None

    def function(self, memory: ProgramMemory, name: str, given: Invocation) -> Value:
        """The value of a function of KRL: mathematics in degrees, and ``INV_POS``.

        Returns
        -------
        value : unclear for other functions, and for arguments that are not known
        """
        values = tuple(None if each is None else memory.value(each) for each in given.arguments)
        found: Value | None = None
        if name == "INV_POS" and len(values) == 1 and (pose := record_pose(values[0])) is not None:
            found = frame_record(np.asarray(np.linalg.inv(pose), np.float64))
        elif name in IN_DEGREES:
            found = evaluated(IN_DEGREES[name], values)
        return Unclear(f"{name}(...)") if found is None else found

    def combined(self, sign: str, left: Value, right: Value) -> Value | None:
        """The geometric operator ``left : right``, the frame ``right`` in the frame ``left``.

        Returns
        -------
        value : of the kind of ``right``, with its other fields such as S and T; None for other operators and values
        """
        a, b = record_pose(left), record_pose(right)
        if sign != ":" or a is None or b is None or not isinstance(right, Record):
            return None
        rest = (pair for pair in right.items if pair[0] not in FRAME_KEYS)
        return Record(right.kind, (*frame_record(a @ b).items, *rest))

    def motion(self, memory: ProgramMemory, move: Move) -> ArmMotion:
        """The motion of PTP, LIN, CIRC and their relatives.

        Parameters
        ----------
        move : its settings (``WITH``, ``CA``) hold for this motion alone

        Returns
        -------
        motion : ``not_followed`` names a setting whose effect is not followed. Where an arc with CA ends is not known.
        """
        if not move.settings:
            return self._motion(memory, move)
        kept, other = dict(memory.shared), ""
        for name, expression in move.settings:
            keep_setting(memory, name, expression)
            if not self.is_followed(name):
                other = name
        found = self._motion(memory, move)
        memory.shared = kept
        return replace(found, not_followed=found.not_followed or other)

    def _motion(self, memory: ProgramMemory, move: Move) -> ArmMotion:
        plain = move.form.removesuffix("_REL")
        kind, is_relative = KINDS[plain.removeprefix("S")], plain != move.form
        settings = _settings(memory, kind, move)
        values = [_argument(memory, each) for each in move.arguments]
        in_tool = "#TOOL" in move.words
        make = relative if is_relative else target
        made = [make(memory, value, (settings.tool, settings.base), (move.text, in_tool)) for value in values]
        if len(made) != (2 if kind == "arc" else 1):
            made = [UnresolvedTarget(move.text, "not_understood")] * 2
        if any(name == "CA" for name, _ in move.settings):
            made = [UnresolvedTarget("CA", "arc_angle")] * 2
        said = [] if kind == "joint" else _other_turns(memory, kind)
        if kind != "joint":  # which ignores S and T
            made = [replace(each, branch=None) if isinstance(each, PoseTarget) else each for each in made]
        for argument, value in zip(move.arguments, values):
            if not is_relative:
                said += _left_out(memory, argument, value)
            elif not in_tool:  # no public text says how angles are added to those before
                said += _turned_by(value)
        via, said_of_all = made[0] if kind == "arc" else None, ", ".join(said)
        return replace(settings, target=made[-1], form=move.form, via=via, not_followed=said_of_all)

    def carry_out(self, memory: ProgramMemory, doing: syntax.Doing) -> Instruction | None:
        """Carry out settings by BAS, and signals by PULSE; the rest as in all languages.

        Returns
        -------
        instruction : None for a setting; ``CWRITE`` to ``$CMD``, which can start a program, may move the arm
        """
        call = doing.what
        values = [memory.value(each) for each in call.arguments if each is not None]
        if call.function == "BAS" and values and str(values[0]) in BAS:
            memory.shared.pop("$BASE%name", None)
            BAS[str(values[0])](memory, values[1] if len(values) > 1 else Unclear("BAS"))
            return None
        if call.function == "PULSE" and values:
            return Output("$OUT", doing.text)
        if call.function == "P00":
            memory.forget("PGNO")
        if call.function == "CWRITE" and Variable("$CMD") in call.arguments:  # commands, as to run a program
            return Unknown(doing.text)
        return super().carry_out(memory, doing)


def _argument(memory: ProgramMemory, argument: Expression | None) -> Value:
    """A motion's argument; to go to where the arm is, wherever that is, no joint moves."""
    if argument is None:
        return Unclear("")
    value = memory.value(argument)
    here = isinstance(argument, Variable) and argument.name in HERE + HERE_JOINTS
    return Record("E6AXIS", ()) if here and isinstance(value, Unclear) else value


def _other_turns(memory: ProgramMemory, kind: MotionKind) -> list[str]:
    """The settings of how the tool turns on lines and arcs that are not followed."""
    given = ((name, memory.read(name)) for name in FOLLOWED_TYPES if kind == "arc" or name != "$CIRC_TYPE")
    return [f"{name}={shown(value)}" for name, value in given if value and value != FOLLOWED_TYPES[name]]


def _turned_by(value: Value) -> list[str]:
    """The angles of a relative position, as text."""
    items = value.items if isinstance(value, Record) else ()
    return [f"{key} {shown(each)}" for key, each in items if key in "ABC" and syntax.number(each) != 0]


def _left_out(memory: ProgramMemory, argument: Expression | None, value: Value) -> list[str]:
    """What a variable's position leaves out, which no source says where it is taken from."""
    held = isinstance(argument, (Variable, syntax.Member, Element))
    if not held or not isinstance(value, Record) or not value.items:
        return []
    keys = AXIS_KEYS[: memory.cell.joints] if _has_axes(value) else FRAME_KEYS
    return [key for key in keys if value.get(key) is None]


def _settings(memory: ProgramMemory, kind: MotionKind, move: Move) -> ArmMotion:
    """A motion with all that is set for it, but for its target."""
    load, part = memory.read("$LOAD"), memory.read("$LOAD.M")
    given = load_of(load)
    if part is not None and not isinstance(load, Record):  # of a load whose whole is not known
        given = UnclearLoad("$LOAD.M", syntax.number(part))
    return ArmMotion(
        kind,
        UnresolvedTarget(move.text, "undefined"),
        speed=_speed(memory, kind),
        acceleration=_acceleration(memory, kind),
        zone=_zone(memory, kind, move.words),
        tool=_frame(memory, "$TOOL"),
        base=_frame(memory, "$BASE"),
        load=given,
        turn_speed=None if kind == "joint" else _turn_speed(memory),
    )


def _speed(memory: ProgramMemory, kind: MotionKind) -> Rate | None:
    if kind == "joint":
        return _axis_share(memory, "$VEL_AXIS")
    speed = rate_of(memory.read("$VEL.CP"), "m/s")
    if speed is not None and speed.value > MOST_SPEED:
        return Rate(0.0, "m/s", f"$VEL.CP={speed.value:g}")
    return speed


def _acceleration(memory: ProgramMemory, kind: MotionKind) -> Rate | None:
    if kind == "joint":
        return _axis_share(memory, "$ACC_AXIS")
    value = memory.read("$ACC.CP")
    if isinstance(value, Record):
        return rate_of(value.get("share"), "share")
    return rate_of(value, "m/s2")


def _turn_speed(memory: ProgramMemory) -> float | None:
    """How fast the tool may turn on lines and arcs, rad/s: the slower of its direction and of the turn about that."""
    given = [syntax.number(memory.read(name)) for name in TURN_RATES]
    return min((math.radians(each) for each in given if each is not None and each > 0), default=None)


def _axis_share(memory: ProgramMemory, name: str) -> Rate | None:
    """What is set for the axes in percent: one that is not known, else one beyond 100, else the slowest."""
    values = [memory.read(f"{name}[{axis}]") for axis in range(1, 7)]
    if isinstance(values[0], Record):
        return Rate(1.0, "share", f"{shown(values[0].values()[0])} %")
    given = [rate for value in values if (rate := rate_of(value, "share", 100.0)) is not None]
    if any(rate.text for rate in given):
        return next(rate for rate in given if rate.text)
    beyond = [rate for rate in given if rate.value > 1]
    return min(beyond or given, key=lambda rate: rate.value, default=None)


ZONES: dict[str, tuple[ZoneKind, str, float]] = {
    "C_PTP": ("share", "$APO.CPTP", 100.0),
    "C_DIS": ("distance", "$APO.CDIS", 1000.0),
    "C_ORI": ("angle", "$APO.CORI", math.degrees(1.0)),
    "C_VEL": ("velocity", "$APO.CVEL", 100.0),
}
"""Words after a motion: the kind of their zone, the variable of its size, and how many of its units make one of SI."""


def _zone(memory: ProgramMemory, kind: MotionKind, words: tuple[str, ...]) -> Zone:
    given = [word for word in words if word.startswith("C_")]
    if not given:
        return FINE
    word = given[0]
    meant: tuple[str, ...] = (word,)
    if word == "C_SPL":
        meant = ("C_PTP", "C_DIS") if kind == "joint" else ("C_DIS",)
    if "C_PTP" in meant and memory.read("$APO.CPTP") == "#CDIS":
        meant = ("C_DIS",)
    for form, variable, scale in (ZONES[each] for each in meant if each in ZONES):
        if (size := syntax.number(memory.read(variable))) is not None:
            return Zone(form, size / scale, word)
    return Zone("named", 0.0, word)
