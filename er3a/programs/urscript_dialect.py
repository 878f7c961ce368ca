"""What URScript's motions, poses and functions mean: metres, radians, rotation vectors."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy

from er3a.geometry.transforms import rpy_of, transform
from er3a.numerics.arrays import Reals
from er3a.programs.evaluation import ProgramMemory
from er3a.programs.instructions import (
    FINE,
    ArmMotion,
    Aside,
    Instruction,
    JointTarget,
    MotionKind,
    NamedFrame,
    Output,
    PoseTarget,
    Rate,
    Target,
    Unknown,
    UnresolvedTarget,
    Zone,
    numbers_of,
    pose_of,
)
from er3a.programs.syntax import (
    POSE_KEYS,
    Doing,
    Invocation,
    Move,
    Record,
    Solved,
    Unclear,
    Value,
    finite,
    number,
    numbers,
    shown,
)

KINDS: dict[str, MotionKind] = {"movej": "joint", "movel": "line", "movep": "line", "movec": "arc"}
PARAMETERS = {
    "movej": ("q", "a", "v", "t", "r"),
    "movel": ("pose", "a", "v", "t", "r"),
    "movep": ("pose", "a", "v", "r"),
    "movec": ("pose_via", "pose_to", "a", "v", "r", "mode"),
}
DEFAULTS = {"movej": (1.4, 1.05), "movel": (1.2, 0.25), "movep": (1.2, 0.25), "movec": (1.2, 0.25)}
ROBOT_BASE = NamedFrame("base", np.eye(4))
HARMLESS = (
    *("set_", "get_", "popup", "textmsg", "sync", "socket_", "zero_ftsensor", "write_", "read_", "rtde_", "modbus_"),
    *(
        "stopj",
        "stopl",
        "request_",
        "rpc_factory",
        "modbus",
        "end_",
        "str_",
        "to_",
        "assert",
        "varmsg",
        "rq_set_",
        "is_",
        "encoder_",
        "conveyor_pulse_decode",
        "reset_",
        "tool_contact",
        "time",
        "switch_",
    ),
)
OUTPUTS = {
    "set_digital_out": "digital_out",
    "set_standard_digital_out": "standard_digital_out",
    "set_configurable_digital_out": "configurable_digital_out",
    "set_tool_digital_out": "tool_digital_out",
    "set_analog_out": "analog_out",
    "set_standard_analog_out": "standard_analog_out",
    "set_flag": "flag",
}
PLAIN: dict[str, Callable[..., float]] = {
    **{name: getattr(math, name) for name in ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "pow")},
    "floor": math.floor,
    "ceil": math.ceil,
    "d2r": math.radians,
    "r2d": math.degrees,
    "log": lambda base, x: math.log(x, base),
    "abs": abs,
}


class UrScriptDialect:
    """URScript, as a run needs it."""

    modal = frozenset(("%tcp",))
    local_by_default = True
    whole_division = False
    first_index = 0

    def begin(self, memory: ProgramMemory) -> None:
        """No variable is there from the start."""

    def is_signal(self, name: str) -> bool:
        """Signals are set by functions."""
        return False

    def named(self, name: str) -> bool:
        """Tools have no names."""
        return False

    def constant(self, memory: ProgramMemory, name: str) -> Value | None:
        """Numbers of the language."""
        return math.pi if name == "MATH_PI" else None

    def product(self, left: Value, right: Value) -> Value:
        """There is none."""
        return Unclear("a product")

    def listed(self, kind: str, values: tuple[Value, ...]) -> Value:
        """``[...]``, and ``p[...]`` with six numbers."""
        if not kind:
            return values
        if len(values) != 6:
            return Unclear(f"p[{', '.join(map(shown, values))}]")
        return Record("p", tuple(zip(POSE_KEYS, values)))

    def function(self, memory: ProgramMemory, name: str, given: Invocation) -> Value:
        """Mathematics, poses, where the arm stands; what is not known is unclear."""
        values = [None if each is None else memory.value(each) for each in given.arguments]
        keywords = {key: memory.value(each) for key, each in given.keywords}
        if name == "get_inverse_kin" and values and isinstance(values[0], Record):
            near = values[1] if len(values) > 1 else keywords.get("qnear")
            return Solved(values[0], near if near is not None else ())
        if name == "struct":
            return Record(name, tuple(keywords.items()))
        found = _of_position(memory, name, values)
        if found is None:
            found = _of_poses(name, values, keywords)
        plain = numbers(tuple(values))
        if found is None and name in ("norm", "normalize"):
            found = _of_vector(name, values)
        if found is None and name in PLAIN and plain:
            try:
                found = PLAIN[name](*plain)
            except (ValueError, OverflowError, ZeroDivisionError, TypeError):
                found = None
        if (
            found is None
            and name in ("length", "get_list_length")
            and values
            and isinstance(values[0], (tuple, Record))
        ):
            found = len(values[0] if isinstance(values[0], tuple) else values[0].items)
        return (
            Unclear(f"{name}({', '.join('' if each is None else shown(each) for each in values)})")
            if (found is None)
            else found
        )

    def motion(self, memory: ProgramMemory, move: Move) -> ArmMotion:
        """movej, movel, movep, movec."""
        given = dict(zip(PARAMETERS[move.form], move.arguments))
        given |= dict(move.settings)
        values = {name: memory.value(each) for name, each in given.items() if each is not None}
        kind = KINDS[move.form]
        first, second = PARAMETERS[move.form][:2]
        goal = values.get(second if kind == "arc" else first, Unclear(move.text))
        a, v = DEFAULTS[move.form]
        joint = kind == "joint"
        seconds = number(values.get("t")) or 0.0
        speed = Rate(seconds, "s") if seconds > 0 else _rate(values.get("v", v), "rad/s" if joint else "m/s")
        radius = values.get("r", 0.0)
        blend = number(radius)
        zone = Zone("named", 0.0, shown(radius)) if blend is None else Zone("distance", blend) if blend > 0 else FINE
        return ArmMotion(
            kind,
            _target(goal, move.text),
            move.form,
            _target(values.get(first, Unclear(move.text)), move.text) if kind == "arc" else None,
            None,
            speed,
            _rate(values.get("a", a), "rad/s2" if joint else "m/s2"),
            zone,
            _tool(memory),
            ROBOT_BASE,
        )

    def carry_out(self, memory: ProgramMemory, doing: Doing) -> Instruction | None:
        """The tool, outputs, what is harmless; the rest is unknown."""
        call = doing.what
        assert isinstance(call, Invocation)
        given = [each for each in call.arguments if each is not None]
        if call.function == "set_tcp" and given:
            memory.write("%tcp", memory.value(given[0]))
            return None
        if call.function in OUTPUTS and len(given) == 2:
            values = [memory.value(each) for each in given]
            return Output(f"{OUTPUTS[call.function]}[{shown(values[0])}]", shown(values[1]))
        return Aside(doing.text) if self.harmless(call) else Unknown(doing.text)

    def harmless(self, call: Invocation) -> bool:
        """Signals, messages, sockets; and methods of objects of other processes, which move nothing by themselves."""
        return call.function != "set_tcp" and ("." in call.function or call.function.startswith(HARMLESS))


def _tool(memory: ProgramMemory) -> NamedFrame:
    value = memory.shared.get("%tcp")
    if value is None:
        return NamedFrame("", memory.cell.tool)
    pose = _pose(value)
    return NamedFrame(value.text if isinstance(value, Unclear) else "", pose)


def _rate(value: Value, unit: str) -> Rate | None:
    plain = number(value)
    units = {"rad/s": Rate(plain or 0.0, "rad/s"), "m/s": Rate(plain or 0.0, "m/s")}
    units |= {"rad/s2": Rate(plain or 0.0, "rad/s2"), "m/s2": Rate(plain or 0.0, "m/s2")}
    return None if plain is None else units[unit]


def _pose(value: Value | None) -> Reals | None:
    """The transform (4, 4) of a pose of six finite numbers."""
    if not isinstance(value, Record) or value.kind != "p":
        return None
    plain = numbers(value.values())
    return pose_of(plain, "ur") if plain is not None and finite(plain) else None


def _record(pose: Reals) -> Record:
    return Record("p", tuple(zip(POSE_KEYS, numbers_of(pose, "ur"))))


def _target(value: Value, text: str) -> Target:
    match value:
        case Solved(pose=pose, near=near):
            found = _target(pose, text)
            joints = _joints(near)
            return replace(found, near=joints) if isinstance(found, PoseTarget) else found
        case Unclear(text=unclear):
            return UnresolvedTarget(unclear, "not_finite" if unclear.lower() in ("nan", "inf") else "undefined")
        case Record() | tuple():
            parts = value.values() if isinstance(value, Record) else value
            unclear_part = next((each for each in parts if isinstance(each, Unclear)), None)
            if unclear_part is not None:
                return _target(unclear_part, text)
            plain = numbers(parts)
            if plain is not None and not finite(plain):
                return UnresolvedTarget(text, "not_finite")
            matrix = _pose(value)
            if matrix is not None:
                return PoseTarget(matrix)
            joints = _joints(value)
            if joints is not None:
                return JointTarget(joints)
    return UnresolvedTarget(text, "not_understood")


def _joints(value: Value) -> Reals | None:
    plain = numbers(value) if isinstance(value, tuple) else None
    return np.array(plain) if plain is not None and len(plain) == 6 and finite(plain) else None


def _of_position(memory: ProgramMemory, name: str, values: list[Value | None]) -> Value | None:
    """Functions of where the arm stands, and of its table."""
    if name in ("get_actual_joint_positions", "get_target_joint_positions"):
        return None if memory.here.joints is None else tuple(map(float, memory.here.joints))
    if name in ("get_actual_tcp_pose", "get_target_tcp_pose", "get_target_waypoint"):
        seen = memory.here.seen(_tool(memory), ROBOT_BASE, memory.cell.flange)
        return None if seen is None else _record(seen)
    if name == "get_forward_kin" and memory.cell.flange is not None:
        joints = _joints(values[0]) if values and values[0] is not None else memory.here.joints
        tool = _tool(memory).pose
        if joints is not None and tool is not None:
            return _record(memory.cell.flange(joints) @ tool)
    return None


def _of_vector(name: str, values: list[Value | None]) -> Value | None:
    """The length of a list of numbers, and the list over its length."""
    given = values[0] if len(values) == 1 else None
    plain = numbers(given) if isinstance(given, tuple) else numbers((given,))
    size = None if not plain else math.hypot(*plain)
    if not plain or size is None or not math.isfinite(size):
        return None
    return size if name == "norm" else tuple(each / size for each in plain) if size > 0 else None


def _of_poses(name: str, values: list[Value | None], keywords: dict[str, Value]) -> Value | None:
    """Functions of poses."""
    if name in ("rpy2rotvec", "rotvec2rpy") and values and isinstance(values[0], tuple):
        plain = numbers(values[0])
        if plain is not None and len(plain) == 3 and finite(plain):
            if name == "rpy2rotvec":
                turn = scipy.spatial.transform.Rotation.from_matrix(
                    transform(np.zeros(3), np.array(plain))[:3, :3]
                ).as_rotvec()
            else:
                turn = rpy_of(scipy.spatial.transform.Rotation.from_rotvec(plain).as_matrix())
            return tuple(map(float, turn))
    poses = [pose for pose in map(_pose, values) if pose is not None]
    if name == "pose_inv" and len(poses) == 1:
        return _record(np.asarray(np.linalg.inv(poses[0]), np.float64))
    if len(poses) != 2:
        return None
    a, b = poses
    match name:
        case "pose_trans":
            return _record(a @ b)
        case "pose_add" | "pose_sub":
            found = a.copy()
            sign = 1 if name == "pose_add" else -1
            found[:3, 3] += sign * b[:3, 3]
            found[:3, :3] = (b[:3, :3] if sign > 0 else b[:3, :3].T) @ a[:3, :3]
            return _record(found)
        case "interpolate_pose":
            share = number(values[2] if len(values) > 2 else keywords.get("alpha"))
            if share is None or not math.isfinite(share):
                return None
            turn = scipy.spatial.transform.Rotation.from_matrix(a[:3, :3].T @ b[:3, :3]).as_rotvec()
            found = a.copy()
            found[:3, 3] += share * (b[:3, 3] - a[:3, 3])
            found[:3, :3] = a[:3, :3] @ scipy.spatial.transform.Rotation.from_rotvec(share * turn).as_matrix()
            return _record(found)
        case "point_dist":
            return float(np.linalg.norm(a[:3, 3] - b[:3, 3]))
        case "pose_dist":
            turn = scipy.spatial.transform.Rotation.from_matrix(a[:3, :3].T @ b[:3, :3]).as_rotvec()
            return float(np.linalg.norm([*(a[:3, 3] - b[:3, 3]), *turn]))
    return None
