"""What RAPID's motions, data and functions mean: mm, degrees, quaternions whose scalar is first.

Sources are named as in :mod:`er3a.programs.rapid.data_types`: "2 RelTool" is the entry of the function RelTool.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from er3a.geometry.transforms import rpy_of, transform
from er3a.numerics.arrays import Reals
from er3a.programs import instructions, syntax
from er3a.programs.evaluation import Dialect, Position, ProgramMemory, evaluated, unresolved
from er3a.programs.rapid import data_types, known_names, reader
from er3a.robots.masses import moved, together

ROBOT_BASE = instructions.NamedFrame("wobj0", np.eye(4))
JOINT_FORMS = ("MOVEJ", "TRIGGJ")
ARC_FORMS = ("MOVEC", "TRIGGC", "SEARCHC")
SLOWEST_RAMP = 20.0  # percent; 1 AccSet: smaller values count as 20
FULL_SPEED = 5000.0  # mm/s, of VelSet where a program sets none
SWITCHES: Mapping[str, frozenset[str]] = {
    **dict.fromkeys(("CROBT", "CPOS"), frozenset(("TOOL", "WOBJ"))),
    **dict.fromkeys(("TRUNC", "ROUND"), frozenset(("DEC",))),
    "RELTOOL": frozenset(("RX", "RY", "RZ")),
    "EULERZYX": frozenset("XYZ"),
}
"""What they take by name; a call with another, such as ``CRobT(\\TaskName:="T_ROB2")``, has no known value."""
IN_DEGREES: Mapping[str, Callable[..., float]] = {
    "ABS": abs,
    "SQRT": math.sqrt,
    "EXP": math.exp,
    "POW": math.pow,
    "SIN": lambda x: math.sin(math.radians(x)),
    "COS": lambda x: math.cos(math.radians(x)),
    "TAN": lambda x: math.tan(math.radians(x)),
    "ASIN": lambda x: math.degrees(math.asin(x)),
    "ACOS": lambda x: math.degrees(math.acos(x)),
    "ATAN": lambda x: math.degrees(math.atan(x)),
    "ATAN2": lambda y, x: math.degrees(math.atan2(y, x)),
    "NUMTODNUM": lambda x: x,
    "DNUMTONUM": lambda x: x,
}
UNCLEAR = syntax.Unclear("")
AS_IT_STANDS = syntax.Unclear("the configuration in which the arm stands")


class RapidDialect(Dialect):
    """RAPID, as a run needs it."""

    modal = frozenset((*known_names.SETTINGS.values(), "%GRIPLOAD"))

    def constant(self, memory: ProgramMemory, name: str) -> syntax.Value | None:
        """Speeds, zones, tool and work object that every controller has, those that a module hides in itself too."""
        return data_types.predefined(name.removeprefix("/"))

    def frame_of(self, value: syntax.Value | None) -> Reals | None:
        """That of tooldata and wobjdata."""
        kind = value.kind if isinstance(value, syntax.Record) else ""
        if kind == "TOOLDATA":
            return frame_of_tool(value)[0]
        return frame_of_object(value)[0] if kind == "WOBJDATA" else None

    def function(self, memory: ProgramMemory, name: str, given: syntax.Invocation) -> syntax.Value:
        """Mathematics, positions, where the arm is; what is unknown, or called otherwise, is unclear."""
        values = tuple(UNCLEAR if each is None else memory.value(each) for each in given.arguments)
        named = {key: memory.value(each) for key, each in given.keywords}
        unclear = syntax.Unclear(f"{given.function.lower()}({', '.join(map(syntax.shown, values))})")
        if name == reader.TYPED:
            assert isinstance(values[1], tuple)
            return data_types.typed(values[0], _as_shape(values[1]))
        if name == reader.ARITHMETIC:
            return arithmetic(str(values[0]), values[1], values[2])
        if name == reader.STEP:
            first, last = syntax.number(values[0]), syntax.number(values[1])
            return syntax.Unclear("a step") if first is None or last is None else 1 if first <= last else -1
        if known_names.PARAMETERS.get(name) != len(values) or named.keys() - SWITCHES.get(name, frozenset()):
            return unclear
        if name in ("CROBT", "CJOINTT", "CPOS"):
            found = _of_position(memory, name, named, dict(given.keywords))
        elif name in IN_DEGREES:
            found = evaluated(IN_DEGREES[name], values)
        else:
            found = _of_data(name, values, named)
        if found is None:
            first_unclear = next((each for each in values if isinstance(each, syntax.Unclear)), None)
            return first_unclear or unclear
        return found

    def motion(self, memory: ProgramMemory, move: syntax.Move) -> instructions.ArmMotion:
        """MoveJ, MoveL, MoveC, MoveAbsJ, and those that do something besides."""
        form = move.form
        arc = form in ARC_FORMS or form.startswith("MOVEC")
        joint = "ABSJ" in form or form.startswith(JOINT_FORMS)
        kind: instructions.MotionKind = "arc" if arc else "joint" if joint else "line"
        placed = list(move.arguments)
        given = ((name, memory.value(each)) for name, each in move.settings)
        options = {name: value for name, value in given if value != reader.ABSENT}
        if form in reader.SEARCHES:  # signal, the point sought, targets, speed and tool; no zone
            placed = [*placed[2:-1], None, placed[-1]] if len(placed) == 5 + arc else []
        targets = 2 if arc else 1
        if not targets + 3 <= len(placed) <= targets + 3 + _beside_motion(form):
            unknown = instructions.UnresolvedTarget(move.text, "not_understood")
            return instructions.ArmMotion(kind, unknown, form, unknown if arc else None)
        at_end = form.startswith("TRIGG")
        zone_at, tool_at = (-2, -1) if at_end else (targets + 1, targets + 2)
        values = [UNCLEAR if each is None else memory.value(each) for each in placed]
        tool, stationary = _tool(memory, placed[tool_at], values[tool_at])
        wobj = dict(move.settings).get("WOBJ")
        base, held = _base(memory, wobj, options.get("WOBJ"))
        frames = (tool, _displaced(memory, base))
        fixed = instructions.UnresolvedTarget(move.text, "external_tool") if stationary or held else None
        checked = memory.read("%CONFJ" if kind == "joint" else "%CONFL") is not False
        made = [
            fixed or self._target(memory, value, (move.text, kind, "ABSJ" in form), checked)
            for value in values[:targets]
        ]
        speed, turn = _speed(memory, values[targets], options, kind)
        zone = instructions.FINE if form in reader.SEARCHES else _zone(values[zone_at], options, placed[zone_at])
        stops = zone.kind == "fine" and (form in reader.SEARCHES or _stops(values[zone_at], options))
        memory.write(reader.PASSING, not stops or "CONC" in options)
        via = made[0] if arc else None
        if isinstance(via, instructions.PoseTarget):
            via = replace(via, branch=None)
        about_one_axis = memory.read("%ARCS") if arc else None
        others = sorted({*options} - reader.MOTION_OPTIONS)
        others += ["CirPathMode"] if isinstance(about_one_axis, syntax.Unclear) else []
        return instructions.ArmMotion(
            kind,
            made[-1],
            SPELLED.get(form, form),
            via,
            None,
            speed,
            _acceleration(memory),
            zone,
            *frames,
            turn_speed=turn,
            load=_load(memory, tool, values[tool_at], options.get("TLOAD")),
            not_followed=", ".join(others),
            with_path=arc and about_one_axis is not True,
        )

    def _target(
        self,
        memory: ProgramMemory,
        value: syntax.Value,
        said: tuple[str, instructions.MotionKind, bool],
        checked: bool,
    ) -> instructions.Target:
        """What a target means; ``said`` is the line, the motion's kind, and whether it wants joint angles."""
        text, kind, absolute = said
        if isinstance(value, syntax.Unclear):
            return unresolved(value, text)
        value = data_types.typed(value, data_types.JOINTTARGET if absolute else data_types.ROBTARGET)
        external = data_types.external_axes(data_types.part(value, "EXTAX"))
        if absolute:
            return _joint_target(memory, value, text, external)
        unclear = next((each for each in _leaves(value) if isinstance(each, syntax.Unclear)), None)
        if unclear is not None:
            return unresolved(unclear)
        pose = data_types.pose_matrix(value)
        if pose is None:
            return instructions.UnresolvedTarget(text, "not_understood")
        conf = data_types.plain(data_types.part(value, "ROBCONF"), 4)
        said_of = _said(data_types.part(value, "ROBCONF"))
        branch = data_types.branch_of(conf, memory.cell.joints) if checked else None
        kept = said_of if checked or kind != "joint" else ()
        return instructions.PoseTarget(pose, kept, external=external, branch=branch)

    def carry_out(self, memory: ProgramMemory, doing: syntax.Doing) -> instructions.Instruction | None:
        """Settings, outputs, what is harmless; the rest is unknown."""
        call = doing.what
        assert isinstance(call, syntax.Invocation)
        if call.function == "GRIPLOAD":
            given = call.arguments[0] if len(call.arguments) == 1 else None
            gripped = UNCLEAR if given is None else memory.value(given)
            memory.write("%GRIPLOAD", gripped)
            return (
                None
                if data_types.load_of(data_types.typed(gripped, data_types.LOADDATA))
                else instructions.Aside(doing.text)
            )
        if call.function == "CIRPATHMODE":
            options = {key for key, _ in call.keywords}
            memory.write("%ARCS", options == {"OBJECTFRAME"})
            return None if options in known_names.FOLLOWED[call.function] else instructions.Aside(doing.text)
        if call.function in known_names.SETTINGS:
            return None if _set(memory, call) else instructions.Unknown(doing.text, may_move=False)
        if call.function in known_names.OUTPUTS and call.arguments:
            first = call.arguments[0]
            return instructions.Output(first.name if isinstance(first, syntax.Variable) else call.function, doing.text)
        if call.function == "EOFFSOFF" or self.harmless(call):
            return instructions.Aside(doing.text)
        return instructions.Unknown(doing.text)

    def harmless(self, call: syntax.Invocation) -> bool:
        """Functions and instructions whose exact name is known, and that set nothing."""
        name = call.function
        return name not in known_names.SETTINGS and name != "GRIPLOAD" and known_names.is_known(name)


def _beside_motion(form: str) -> int:
    """How many arguments a motion has beside targets, speed, zone and tool: an output and its value, a procedure, an
    event."""
    if form.endswith(("DO", "AO", "GO")):
        return 2
    return 1 if form.endswith("SYNC") or form in ("TRIGGJ", "TRIGGL", "TRIGGC", "TRIGGABSJ") else 0


SPELLED = {
    "MOVEJ": "MoveJ",
    "MOVEL": "MoveL",
    "MOVEC": "MoveC",
    "MOVEABSJ": "MoveAbsJ",
    "TRIGGL": "TriggL",
    "TRIGGJ": "TriggJ",
    "TRIGGC": "TriggC",
    "SEARCHL": "SearchL",
    "SEARCHC": "SearchC",
}


def _as_shape(value: tuple[syntax.Value, ...]) -> data_types.Shape:
    return tuple(_as_shape(each) if isinstance(each, tuple) else str(each) for each in value)


def _leaves(value: syntax.Value) -> list[syntax.Value]:
    parts = value.values()[:2] if isinstance(value, syntax.Record) and value.kind == "ROBTARGET" else (value,)
    inside = [each.values() if isinstance(each, syntax.Record) else (each,) for each in parts]
    return [each for values in inside for each in values]


def _said(conf: syntax.Value | None) -> tuple[tuple[str, float | str], ...]:
    """The parts of confdata, as text where they are not known; none where the arm's own configuration was read."""
    if isinstance(conf, syntax.Unclear):
        return (("robconf", conf.text),)
    parts = conf.values() if isinstance(conf, syntax.Record) else ()
    if len(parts) != 4 or AS_IT_STANDS in parts:
        return ()
    return tuple(
        (name, number if (number := syntax.number(each)) is not None else syntax.shown(each))
        for name, each in zip(("cf1", "cf4", "cf6", "cfx"), parts)
    )


def _joint_target(
    memory: ProgramMemory, value: syntax.Value, text: str, external: tuple[tuple[str, float], ...]
) -> instructions.Target:
    axes = data_types.part(value, "ROBAX")
    values = axes.values() if isinstance(axes, syntax.Record) else ()
    unclear = next((each for each in values if isinstance(each, syntax.Unclear)), None)
    if unclear is not None:
        return unresolved(unclear)
    degrees = data_types.plain(axes, 6)
    if degrees is None:
        return instructions.UnresolvedTarget(text, "not_understood")
    count = memory.cell.joints
    if any(each and abs(each) < data_types.NO_AXIS / 10 for each in degrees[count:]):
        return instructions.UnresolvedTarget(text, "too_many_joints")
    return instructions.JointTarget(np.radians(degrees[:count]), external)


def frame_of_tool(value: syntax.Value | None) -> tuple[Reals | None, bool]:
    """T_flange_tool (4, 4) in m of tooldata, and whether the tool is stationary (3 tooldata: robhold).

    None where that is not known.
    """
    data = data_types.typed(value, data_types.TOOLDATA) if value is not None else None
    held = data_types.part(data, "ROBHOLD")
    pose = None if isinstance(held, syntax.Unclear) else data_types.pose_matrix(data_types.part(data, "TFRAME"))
    return pose, held is False


def frame_of_object(value: syntax.Value | None) -> tuple[Reals | None, bool]:
    """T_robot_object (4, 4) in m of wobjdata, and whether the arm holds the object (3 wobjdata: robhold).

    The object's frame is in the user's frame, and that in the world, which is the robot's base unless a controller
    is set up otherwise. None where an external unit moves the user's frame (ufprog FALSE, ufmec).
    """
    data = data_types.typed(value, data_types.WOBJDATA) if value is not None else None
    user, own = (
        data_types.pose_matrix(data_types.part(data, "UFRAME")),
        data_types.pose_matrix(data_types.part(data, "OFRAME")),
    )
    still = data_types.part(data, "UFPROG") is True
    held = data_types.part(data, "ROBHOLD")
    if user is None or own is None or not still or isinstance(held, syntax.Unclear):
        return None, held is True
    return user @ own, held is True


def _name_of(expression: object) -> str:
    return expression.name.lower() if isinstance(expression, syntax.Variable) else ""


def _mapped(memory: ProgramMemory, name: str) -> Reals | None:
    """The frame that the cell gives for a name, however its letters are written."""
    return next((pose for key, pose in memory.cell.frames.items() if key.lower() == name), None)


def _tool(memory: ProgramMemory, expression: object, value: syntax.Value) -> tuple[instructions.NamedFrame, bool]:
    pose, stationary = frame_of_tool(value)
    name = _name_of(expression)
    if pose is None:
        name = value.text.lower() if isinstance(value, syntax.Unclear) else name or "tooldata"
        pose = _mapped(memory, name)
    load = data_types.load_of(data_types.part(data_types.typed(value, data_types.TOOLDATA), "TLOAD"))
    return instructions.NamedFrame(
        name, pose, load if load is not None and load.mass > data_types.MIN_LOAD else None
    ), stationary


def _load(
    memory: ProgramMemory, tool: instructions.NamedFrame, data: syntax.Value, total: syntax.Value | None
) -> instructions.Load | None:
    """What the program says hangs on the flange: the tool, and what GripLoad says is in it (in the tool's frame).

    ``\\TLoad`` says all of it; load0 there is as if it were not given (1 MoveL).
    """
    whole = data_types.load_of(data_types.typed(total, data_types.LOADDATA)) if total is not None else None
    if total is not None and whole is None:
        return instructions.UnclearLoad(f"\\TLoad {total.text if isinstance(total, syntax.Unclear) else ''}".strip())
    if whole is not None and whole.mass > data_types.MIN_LOAD:
        return whole
    stated = data_types.part(data_types.typed(data, data_types.TOOLDATA), "TLOAD")
    own = instructions.UnclearLoad(f"tload ({tool.name})") if _is_open(stated) else tool.load
    value = memory.read("%GRIPLOAD")
    if value is None:
        return own
    gripped = data_types.load_of(data_types.typed(value, data_types.LOADDATA))
    if gripped is None:
        return instructions.UnclearLoad(f"GripLoad {value.text if isinstance(value, syntax.Unclear) else ''}".strip())
    if gripped.mass <= data_types.MIN_LOAD or isinstance(own, instructions.UnclearLoad):
        return own
    if tool.pose is None:
        return instructions.UnclearLoad(f"GripLoad ({tool.name})", gripped.mass)
    return together([*([own] if own else []), moved(gripped, tool.pose)])


def _is_open(value: syntax.Value | None) -> bool:
    """Whether a part of a value is not known."""
    if isinstance(value, syntax.Record):
        return any(map(_is_open, value.values()))
    return isinstance(value, syntax.Unclear) or (isinstance(value, tuple) and any(map(_is_open, value)))


def _base(
    memory: ProgramMemory, expression: object, value: syntax.Value | None
) -> tuple[instructions.NamedFrame, bool]:
    if value is None or value == reader.ABSENT:
        return ROBOT_BASE, False
    pose, held = frame_of_object(value)
    name = _name_of(expression)
    if pose is None:
        name = value.text.lower() if isinstance(value, syntax.Unclear) else name or "wobjdata"
        pose = _mapped(memory, name)
    return instructions.NamedFrame(name, pose), held


def _displaced(memory: ProgramMemory, base: instructions.NamedFrame) -> instructions.NamedFrame:
    """A work object with the program's displacement."""
    moved = memory.read("%PDISP")
    if moved is None or base.pose is None:
        return base
    pose = data_types.pose_matrix(moved)
    if pose is None:
        pose = _mapped(memory, "pdispon")
    if pose is None or not np.array_equal(pose, np.eye(4)):
        base = instructions.NamedFrame("PDispOn" if pose is None else "", None if pose is None else base.pose @ pose)
    return base


def _speed(
    memory: ProgramMemory, value: syntax.Value, options: Mapping[str, syntax.Value], kind: instructions.MotionKind
) -> tuple[instructions.Rate | None, float | None]:
    """Speed of the tool and of its turn (rad/s). 1 VelSet scales and bounds it, but no time, as the faster reading."""
    if "T" in options:
        return syntax.rate_of(options["T"], "s"), None
    share, most = _velocity(memory)
    if isinstance(value, syntax.Record) and value.get("FASTEST") is True:
        if kind == "joint":
            return instructions.Rate(share, "share", "vmax"), None
        return instructions.Rate(most / 1000 * share, "m/s", "vmax"), math.radians(data_types.TURN_SPEED) * share
    data = data_types.typed(value, data_types.SPEEDDATA)
    turn = syntax.number(data_types.part(data, "V_ORI"))
    along = syntax.rate_of(options.get("V", data_types.part(data, "V_TCP")), "m/s")
    if along is None or along.text:
        return along or instructions.Rate(0.0, "m/s", syntax.shown(value)), None
    limited = min(along.value * share, most)
    return instructions.Rate(limited / 1000, "m/s"), math.radians(turn) * share if turn and kind != "joint" else None


def _velocity(memory: ProgramMemory) -> tuple[float, float]:
    """The share of programmed speeds, and the largest in mm/s."""
    found = data_types.plain(memory.read("%SPEED"), 2)
    return (1.0, FULL_SPEED) if found is None else (found[0] / 100, found[1])


def _acceleration(memory: ProgramMemory) -> instructions.Rate | None:
    percent = syntax.number(memory.read("%ACC"))
    return None if percent is None else instructions.Rate(percent / 100, "share")


def _stops(value: syntax.Value, options: Mapping[str, syntax.Value]) -> bool:
    """Whether a program waits until the arm is at the target: a zone of no size is none at which it does."""
    finep = data_types.part(data_types.typed(value, data_types.ZONEDATA), "FINEP")
    return "INPOS" in options or ("Z" not in options and finep is True)


def _zone(value: syntax.Value, options: Mapping[str, syntax.Value], expression: object) -> instructions.Zone:
    """3 zonedata; ``\\Z`` replaces the size of the path's zone; ``\\Inpos`` asks for a stop."""
    if "INPOS" in options:
        return instructions.FINE
    own = syntax.number(options.get("Z"))
    data = data_types.typed(value, data_types.ZONEDATA)
    stops = data_types.part(data, "FINEP")
    if "Z" not in options and stops is True:
        return instructions.FINE
    size = own if "Z" in options else syntax.number(data_types.part(data, "PZONE_TCP"))
    if size is None or ("Z" not in options and isinstance(stops, syntax.Unclear)):
        return instructions.Zone("named", 0.0, _name_of(expression) or "zonedata")
    return (
        instructions.Zone("distance", size / 1000, _name_of(expression) if own is None else "")
        if size > 0
        else instructions.FINE
    )


def _set(memory: ProgramMemory, call: syntax.Invocation) -> bool:
    """Carry a setting out; False for one that is not understood."""
    values = [UNCLEAR if each is None else memory.value(each) for each in call.arguments]
    options = {key: memory.value(each) for key, each in call.keywords}
    match call.function:
        case "CONFJ" | "CONFL":
            memory.write(f"%{call.function}", "OFF" not in options)
            return True
        case "ACCSET":
            percent = syntax.number(values[0]) if values else None
            memory.write("%ACC", syntax.Unclear("AccSet") if percent is None else max(percent, SLOWEST_RAMP))
            return percent is not None
        case "VELSET":
            found = syntax.numbers(tuple(values)) if len(values) == 2 else None
            memory.write("%SPEED", syntax.Unclear("VelSet") if found is None else found)
            return found is not None
        case "PDISPOFF":
            memory.write("%PDISP", data_types.pose_record(np.eye(4)))
            return True
        case "PDISPSET":
            pose = data_types.pose_matrix(values[0]) if values else None
            memory.write("%PDISP", syntax.Unclear("PDispSet") if pose is None else data_types.pose_record(pose))
            return pose is not None
        case _:
            memory.write("%PDISP", syntax.Unclear("PDispOn"))
            return False


def arithmetic(sign: str, left: syntax.Value, right: syntax.Value) -> syntax.Value:
    """Sums and products: of numbers, texts and positions, a number times a position, cross products, turns.

    RAPID Reference Manual, 7.1: pos * pos is the cross product, orient * orient the product of turns.
    """
    for side in (left, right):
        if isinstance(side, syntax.Unclear):
            return side
    unclear = syntax.Unclear(f"{syntax.shown(left)} {sign} {syntax.shown(right)}")
    if sign == "+" and isinstance(left, str) and isinstance(right, str):
        return left + right if len(left) + len(right) < 1000 else unclear
    a, b = syntax.number(left), syntax.number(right)
    if a is not None and b is not None:
        if sign != "*" and a and b and max(abs(a), abs(b)) >= data_types.NO_AXIS / 10:  # an axis where it is
            return unclear
        found = a + b if sign == "+" else a - b if sign == "-" else a * b
        return int(found) if isinstance(left, int) and isinstance(right, int) else found
    xyz, other = data_types.plain(left, 3), data_types.plain(right, 3)
    if xyz is not None and other is not None:
        p, q = np.array(xyz), np.array(other)
        return data_types.pos_record((p + q if sign == "+" else p - q if sign == "-" else np.cross(p, q)) / 1000)
    if sign == "*" and (a is not None or b is not None) and (xyz is not None or other is not None):
        scale = a if a is not None else b
        assert scale is not None
        return data_types.pos_record(scale * np.array(xyz if xyz is not None else other) / 1000)
    turn, then = data_types.rotation_of(left), data_types.rotation_of(right)
    return data_types.orient_record(turn @ then) if sign == "*" and turn is not None and then is not None else unclear


def _here(memory: ProgramMemory) -> Position:
    """Where the arm is; unknown after a motion that the program does not wait for (7-zonedata-1)."""
    return memory.here if memory.read(reader.PASSING) in (None, False) else Position()


def _of_position(
    memory: ProgramMemory, name: str, named: Mapping[str, syntax.Value], words: Mapping[str, syntax.Expression]
) -> syntax.Value | None:
    """Where the arm is.

    2 CRobT, 2 CPos: in the work object, for the tool; where none is given, those of the last motion.
    """
    here = _here(memory)
    if name == "CJOINTT":
        if here.joints is None:
            return None
        degrees: list[syntax.Value] = [*map(float, np.degrees(here.joints)), *[0.0] * (6 - len(here.joints))]
        return data_types.typed((tuple(degrees), (data_types.NO_AXIS,) * 6), data_types.JOINTTARGET)
    tool = _tool(memory, words.get("TOOL"), named["TOOL"])[0] if "TOOL" in named else here.tool
    base = _base(memory, words.get("WOBJ"), named.get("WOBJ"))[0] if "WOBJ" in named else here.base
    seen = here.seen(tool, _displaced(memory, base) if "WOBJ" in named else base, memory.cell.flange)
    if seen is None or name == "CPOS":
        return None if seen is None else data_types.pos_record(seen[:3, 3])
    conf: syntax.Value = (AS_IT_STANDS,) * 4
    if here.joints is not None and len(here.joints) == 6:
        conf = (*data_types.quarters_of(here.joints), -1)
    return _robtarget(seen, conf)


def _robtarget(T: Reals, conf: syntax.Value) -> syntax.Record:
    """A robtarget of a pose (4, 4) in m; its cfx is -1 where the arm's sides are not known."""
    items = (("TRANS", data_types.pos_record(T[:3, 3])), ("ROT", data_types.orient_record(T[:3, :3])))
    found = data_types.typed((0, 0, conf, (data_types.NO_AXIS,) * 6), data_types.ROBTARGET)
    assert isinstance(found, syntax.Record)
    return syntax.Record("ROBTARGET", (*items, *found.items[2:]))


def _of_data(name: str, values: tuple[syntax.Value, ...], named: Mapping[str, syntax.Value]) -> syntax.Value | None:
    """Functions of positions, texts and numbers, as ABB's manual defines them (2, each by its name)."""
    plain_values = syntax.numbers(values)
    match name:
        case "OFFS" | "RELTOOL":
            return _shifted(name, values, named)
        case "POSEMULT":
            a, b = map(data_types.pose_matrix, values)
            return None if a is None or b is None else data_types.pose_record(a @ b)
        case "POSEINV":
            pose = data_types.pose_matrix(values[0])
            return None if pose is None else data_types.pose_record(np.asarray(np.linalg.inv(pose), np.float64))
        case "ORIENTZYX" if plain_values is not None:  # about z, then the new y, then the new x
            return data_types.orient_record(transform(np.zeros(3), np.radians(plain_values[::-1]))[:3, :3])
        case "EULERZYX":
            turn = data_types.rotation_of(values[0])
            axis = next((i for i, letter in enumerate("XYZ") if letter in named), None)
            return None if turn is None or axis is None else float(np.degrees(rpy_of(turn)[axis]))
        case "DISTANCE":
            a3, b3 = data_types.plain(values[0], 3), data_types.plain(values[1], 3)
            if a3 is None or b3 is None:
                return None
            return float(np.linalg.norm(np.subtract(a3, b3)))
        case "TRUNC" | "ROUND" if plain_values is not None:
            digits = 0.0 if named.get("DEC", reader.ABSENT) == reader.ABSENT else syntax.number(named["DEC"])
            return None if digits is None else _rounded(name, plain_values[0], digits)
        case "PRESENT":
            return None if isinstance(values[0], syntax.Unclear) else values[0] != reader.ABSENT
    return None


def _shifted(name: str, values: tuple[syntax.Value, ...], named: Mapping[str, syntax.Value]) -> syntax.Value | None:
    """2 Offs: along the object's axes. 2 RelTool: along the tool's, then turned about x, the new y, the new z."""
    target = data_types.typed(values[0], data_types.ROBTARGET)
    pose = data_types.pose_matrix(target)
    shift = syntax.numbers(values[1:])
    if not isinstance(target, syntax.Record) or pose is None or shift is None:
        return None
    moved = pose.copy()
    if name == "OFFS":
        moved[:3, 3] += np.array(shift) / 1000
        return target.having("TRANS", data_types.pos_record(moved[:3, 3]))
    turns = [syntax.number(named.get(key, 0.0)) for key in ("RX", "RY", "RZ")]
    angles = [each for each in turns if each is not None]
    if len(angles) < 3:
        return None
    step = np.eye(4)
    step[:3, 3] = np.array(shift) / 1000
    step[:3, :3] = Rotation.from_euler("XYZ", angles, degrees=True).as_matrix()
    return data_types.moved_target(target, pose @ step)


def _rounded(name: str, value: float, digits: float) -> syntax.Value:
    scale = 10.0 ** int(digits)
    found = math.trunc(value * scale) if name == "TRUNC" else math.floor(abs(value) * scale + 0.5)
    signed = found if name == "TRUNC" else math.copysign(found, value)
    return int(signed) if not digits else signed / scale
