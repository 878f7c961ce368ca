"""What URScript's motions, poses and functions mean: metres, radians, rotation vectors."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy

from er3a.geometry.transforms import rpy_of, transform
from er3a.numerics.arrays import Reals
from er3a.programs import instructions, syntax
from er3a.programs.evaluation import Dialect, Position, ProgramMemory, evaluated
from er3a.programs.urscript.reader import CHANGED, LIST_METHODS, THREAD
from er3a.robots.masses import MassBody

KINDS: dict[str, instructions.MotionKind] = {"movej": "joint", "movel": "line", "movep": "line", "movec": "arc"}
PARAMETERS = {
    "movej": ("q", "a", "v", "t", "r"),
    "movel": ("pose", "a", "v", "t", "r"),
    "movep": ("pose", "a", "v", "r"),
    "movec": ("pose_via", "pose_to", "a", "v", "r", "mode"),
}
DEFAULTS = {"movej": (1.4, 1.05), "movel": (1.2, 0.25), "movep": (1.2, 0.25), "movec": (1.2, 0.25)}
ROBOT_BASE = instructions.NamedFrame("base", np.eye(4))
PASSING = "%passing"  # whether the program goes on while the arm still moves to its last target
STOPS = ("stopj", "stopl")
READING = ("get_actual_", "get_target_", "get_forward_kin")  # beginnings of functions that read where the arm is
MODE = "%mode"  # what changes the way of each motion until it is ended; empty if nothing does
JOGS = frozenset(("servoc", "servoj", "speedj", "speedl"))  # move the arm, to where is not followed
SAME_TURN = 1e-9  # of an element of a rotation matrix
MODES = {
    "force_mode": "end_force_mode",
    "path_offset_enable": "path_offset_disable",
    "track_conveyor_linear": "stop_conveyor_tracking",
    "track_conveyor_circular": "stop_conveyor_tracking",
}
"""Functions that do so, with those that end it."""
MOUNTED = 0.02  # rad, within which two mountings are one
HARMLESS_TEXT = """
assert binary_list_to_integer conveyor_pulse_decode enable_external_ft_sensor encoder_enable_pulse_decode
encoder_enable_set_tick_count encoder_get_tick_count encoder_set_tick_count encoder_unwind_delta_tick_count
end_force_mode end_freedrive_mode end_screw_driving end_teach_mode force force_mode_set_damping
force_mode_set_gain_scaling ft_rtde_input_enable get_actual_joint_positions_history get_actual_joint_speeds
get_actual_tcp_speed get_analog_in get_analog_out get_base_acceleration get_configurable_digital_in
get_configurable_digital_out get_controller_temp get_conveyor_tick_count get_coriolis_and_centrifugal_torques
get_digital_in get_digital_out get_euromap_input get_euromap_output get_flag get_freedrive_status get_gravity
get_inverse_kin_has_solution get_jacobian get_jacobian_time_derivative get_joint_temp get_joint_torques
get_mass_matrix get_standard_analog_in get_standard_analog_out get_standard_digital_in get_standard_digital_out
get_steptime get_target_joint_accelerations get_target_joint_speeds get_target_payload get_target_payload_cog
get_target_payload_inertia get_target_tcp_speed get_tcp_force get_tool_accelerometer_reading get_tool_analog_in
get_tool_current get_tool_digital_in get_tool_digital_out integer_to_binary_list is_steady
is_within_safety_limits modbus_add_rtu_signal modbus_add_signal modbus_delete_signal modbus_get_error
modbus_get_signal_status modbus_get_time_since_signal_invalid modbus_request_update_signal_value
modbus_send_custom_command modbus_set_digital_input_action modbus_set_output_register modbus_set_output_signal
modbus_set_runstate_dependent_choice modbus_set_signal_update_frequency popup pose_dist pose_sub powerdown
random read_input_boolean_register read_input_float_register read_input_integer_register
read_output_boolean_register read_output_float_register read_output_integer_register read_port_bit
read_port_register request_boolean_from_primary_client request_float_from_primary_client
request_integer_from_primary_client request_string_from_primary_client rpc_factory rtde_set_watchdog
set_analog_inputrange set_analog_out set_analog_outputdomain set_baselight_off set_baselight_solid
set_configurable_digital_input_action set_configurable_digital_out set_conveyor_tick_count set_digital_out
set_euromap_output set_euromap_runstate_dependent_choice set_flag set_gp_boolean_input_action
set_input_actions_to_default
set_runstate_configurable_digital_output_to_value set_runstate_gp_boolean_output_to_value
set_runstate_standard_analog_output_to_value set_runstate_standard_digital_output_to_value
set_runstate_tool_digital_output_to_value set_safety_mode_transition_hardness set_standard_analog_input_domain
set_standard_analog_out set_standard_digital_input_action set_standard_digital_out
set_tool_analog_input_domain set_tool_communication set_tool_digital_input_action set_tool_digital_out
set_tool_digital_output_mode set_tool_output_mode set_tool_voltage sleep socket_close socket_get_var socket_open
socket_read_ascii_float socket_read_binary_integer socket_read_byte_list socket_read_line socket_read_string
socket_send_byte socket_send_int socket_send_line socket_send_string socket_set_var str_at str_cat
str_empty str_find str_len str_sub sync textmsg time to_num to_str tool_contact tool_contact_examples varmsg
write_output_boolean_register write_output_float_register write_output_integer_register write_port_bit
write_port_register zero_ftsensor
"""
HARMLESS = frozenset(HARMLESS_TEXT.split())
"""Functions of the language that move nothing and set no frame; any other name may be anybody's and do anything."""
OUTPUTS = {
    "set_digital_out": "digital_out",
    "set_standard_digital_out": "standard_digital_out",
    "set_configurable_digital_out": "configurable_digital_out",
    "set_tool_digital_out": "tool_digital_out",
    "set_analog_out": "analog_out",
    "set_standard_analog_out": "standard_analog_out",
    "set_flag": "flag",
}
LOADS = {
    "set_payload": ("m", "cog"),
    "set_payload_mass": ("m",),
    "set_payload_cog": ("cog", "transition_time"),
    "set_target_payload": ("m", "cog", "inertia", "transition_time"),
}
"""Functions that say what hangs on the flange, by their parameters."""
SIGNATURES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("get_actual_joint_positions", "get_target_joint_positions", "get_actual_tcp_pose"), ()),
    **dict.fromkeys(("get_target_tcp_pose", "get_target_waypoint", "get_tcp_offset"), ()),
    "get_actual_tool_flange_pose": (),
    "get_forward_kin": ("q", "tcp"),
    "get_inverse_kin": ("x", "qnear", "maxPositionError", "maxOrientationError", "tcp"),
    "pose_trans": ("p_from", "p_from_to"),
    "pose_add": ("p_1", "p_2"),
    "pose_sub": ("p_to", "p_from"),
    "pose_inv": ("p_from",),
    "inv": ("m",),
    "interpolate_pose": ("p_from", "p_to", "alpha"),
    "point_dist": ("p_from", "p_to"),
    "rotvec2rpy": ("rotation_vector",),
    "rpy2rotvec": ("rpy_vector",),
    "norm": ("a",),
    "normalize": ("v",),
    "length": ("v",),
    "get_list_length": ("v",),
    "size": ("v",),
    "make_list": ("length", "initial_value", "capacity"),
    **dict.fromkeys(("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "floor", "ceil", "abs"), ("f",)),
    "atan2": ("x", "y"),
    "pow": ("base", "exponent"),
    "log": ("b", "f"),
    "d2r": ("d",),
    "r2d": ("r",),
}
"""Parameters of the functions that are evaluated. A call that does not fit them is not understood."""
LONGEST_LIST = 10_000
PLAIN: dict[str, Callable[..., float]] = {
    **{name: getattr(math, name) for name in ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "pow")},
    "floor": math.floor,
    "ceil": math.ceil,
    "d2r": math.radians,
    "r2d": math.degrees,
    "log": lambda base, x: math.log(x, base),
    "abs": abs,
}


class UrScriptDialect(Dialect):
    """URScript, as a run needs it. Its numbers have 32 bits [1]_.

    Attributes
    ----------
    servers : names of variables that hold what ``rpc_factory`` gives: other processes, which move nothing here

    References
    ----------
    .. [1] Universal Robots, *User Manual UR5/CB3*, version 3.4.5, section 14.3; *User Manual UR16e*, section 7.2.
    """

    def __init__(self, program: syntax.Program):
        assigned = (each for each in program.operations() if isinstance(each, syntax.Assign))
        self.servers = frozenset(
            each.target.name
            for each in assigned
            if isinstance(each.target, syntax.Variable)
            and isinstance(each.value, syntax.Invocation)
            and each.value.function == "rpc_factory"
        )
        reads = any(word in line for line in program.lines for word in READING + STOPS)
        self.modal = frozenset(("%tcp", "%load", MODE, *((PASSING,) if reads else ())))

    local_by_default = True
    frames = ("%tcp",)
    first_index = 0

    def constant(self, memory: ProgramMemory, name: str) -> syntax.Value | None:
        """Numbers of the language."""
        return math.pi if name == "MATH_PI" else None

    def listed(self, kind: str, values: tuple[syntax.Value, ...]) -> syntax.Value:
        """``[...]``, and ``p[...]`` with six numbers."""
        if not kind:
            return values
        if len(values) != 6:
            return syntax.Unclear(f"p[{', '.join(map(syntax.shown, values))}]")
        return syntax.Record("p", tuple(zip(syntax.POSE_KEYS, values)))

    def function(self, memory: ProgramMemory, name: str, given: syntax.Invocation) -> syntax.Value:
        """Mathematics, poses, where the arm is; what is unknown, or called otherwise than known, is unclear."""
        values = [None if each is None else memory.value(each) for each in given.arguments]
        keywords = {key: memory.value(each) for key, each in given.keywords}
        if name == "struct":
            return syntax.Record(name, tuple(keywords.items()))
        unclear = syntax.Unclear(f"{name}({', '.join('' if each is None else syntax.shown(each) for each in values)})")
        if name == CHANGED:
            return _changed(values, unclear)
        placed = _placed(SIGNATURES.get(name), values, keywords)
        if placed is None:
            return unclear
        found = _of_position(memory, name, placed)
        if found is None:
            found = _of_poses(name, placed)
        if found is None:
            found = _of_lists(name, placed)
        if found is None and name in PLAIN:
            found = evaluated(PLAIN[name], [placed.get(key) for key in SIGNATURES[name]])
        return unclear if found is None else found

    def motion(self, memory: ProgramMemory, move: syntax.Move) -> instructions.ArmMotion:
        """movej, movel, movep, movec."""
        kind = KINDS[move.form]
        placed = [None if each is None else memory.value(each) for each in move.arguments]
        settings = {name: memory.value(each) for name, each in move.settings}
        values = _placed(PARAMETERS[move.form], placed, settings)
        if values is None:
            unknown = instructions.UnresolvedTarget(move.text, "not_understood")
            return instructions.ArmMotion(
                kind, unknown, move.form, unknown if kind == "arc" else None, tool=_tool(memory)
            )
        first, second = PARAMETERS[move.form][:2]
        goal = values.get(second if kind == "arc" else first, syntax.Unclear(move.text))
        made = _target(memory, goal, move.text)
        via = _target(memory, values.get(first, syntax.Unclear(move.text)), move.text) if kind == "arc" else None
        a, v = DEFAULTS[move.form]
        joint = kind == "joint"
        timed = syntax.number(values.get("t")) != 0.0 and "t" in values  # 0: by speed and acceleration
        speed = (
            syntax.rate_of(values["t"], "s")
            if timed
            else syntax.rate_of(values.get("v", v), "rad/s" if joint else "m/s")
        )
        radius = values.get("r", 0.0)
        blend = syntax.number(radius)
        zone = (
            instructions.Zone("named", 0.0, syntax.shown(radius))
            if blend is None
            else instructions.Zone("distance", blend)
            if blend > 0
            else instructions.FINE
        )
        if PASSING in self.modal:
            memory.write(PASSING, zone is not instructions.FINE)
        return instructions.ArmMotion(
            kind,
            made,
            move.form,
            via,
            None,
            speed,
            syntax.rate_of(values.get("a", a), "rad/s2" if joint else "m/s2"),
            zone,
            _tool(memory),
            ROBOT_BASE,
            load=_load(memory.read("%load")),
            not_followed=str(memory.read(MODE) or ("mode" if syntax.number(values.get("mode", 0)) != 0 else "")),
        )

    def carry_out(self, memory: ProgramMemory, doing: syntax.Doing) -> instructions.Instruction | None:
        """The tool, outputs, what is harmless; the rest is unknown."""
        call = doing.what
        assert isinstance(call, syntax.Invocation)
        values = [None if each is None else memory.value(each) for each in call.arguments]
        keywords = {key: memory.value(each) for key, each in call.keywords}
        if call.function == "set_tcp":
            given = _placed(("pose", "tcp_name"), values, keywords)
            pose = None if given is None else given.get("pose")
            if given is None or not isinstance(pose, (syntax.Record, syntax.Unclear)):
                memory.write("%tcp", syntax.Unclear(doing.text))
                return instructions.Unknown(doing.text)
            memory.write(
                "%tcp",
                pose if isinstance(pose, syntax.Unclear) or _pose(pose) is not None else syntax.Unclear(doing.text),
            )
            return None
        if call.function in JOGS:
            memory.here = Position()
            return instructions.Unknown(doing.text, may_move=False)
        if call.function in MODES:
            memory.write(MODE, doing.text)
        elif call.function in MODES.values():
            moved = memory.read(MODE) and memory.here.key() != Position().key()
            memory.write(MODE, "")
            if moved:  # to a target, from which the mode has led the arm away
                return instructions.Unknown(doing.text)
        if call.function == "set_gravity":
            given = _placed(("d",), values, keywords)
            return _mounted(memory, None if given is None else given.get("d"), doing.text)
        if call.function in LOADS:
            loaded = _placed(LOADS[call.function], values, keywords)
            memory.write(
                "%load", syntax.Unclear(doing.text) if loaded is None else _load_set(memory.read("%load"), loaded)
            )
            return (
                instructions.Aside(doing.text)
                if isinstance(_load(memory.read("%load")), instructions.UnclearLoad)
                else None
            )
        if call.function in STOPS:  # within a blend the arm stops somewhere on its way
            return instructions.Unknown(doing.text) if memory.read(PASSING) else instructions.Aside(doing.text)
        output = _placed(("n", "b"), values, keywords) if call.function in OUTPUTS else None
        if output is not None and len(output) == 2:
            return instructions.Output(
                f"{OUTPUTS[call.function]}[{syntax.shown(output['n'])}]", syntax.shown(output["b"])
            )
        return instructions.Aside(doing.text) if self.harmless(call) else instructions.Unknown(doing.text)

    def harmless(self, call: syntax.Invocation) -> bool:
        """Functions whose exact name is known, and those that other processes answer."""
        if "." in call.function:
            name, _, method = call.function.partition(".")
            return name in self.servers or method in LIST_METHODS
        return call.function in HARMLESS or call.function in SIGNATURES or call.function in ("struct", CHANGED, THREAD)


def _placed(
    names: tuple[str, ...] | None, values: list[syntax.Value | None], keywords: dict[str, syntax.Value]
) -> dict[str, syntax.Value] | None:
    """Arguments by the names of a function's parameters; None for a call that does not fit them."""
    if names is None or len(values) > len(names) or None in values or not keywords.keys() <= set(names):
        return None
    placed = {name: each for name, each in zip(names, values) if each is not None}
    return None if placed.keys() & keywords.keys() else placed | keywords


def _mounted(memory: ProgramMemory, up: syntax.Value | None, text: str) -> instructions.Instruction:
    """Gravity shows how the arm is mounted: where up is in the frame of its base; otherwise than in the robot file, the
    cell's shapes are elsewhere."""
    given = syntax.numbers(up) if isinstance(up, tuple) else None
    if given is None or len(given) != 3 or not syntax.finite(given) or not any(given):
        return instructions.Unknown(text, may_move=False)
    said, known = np.array(given) / math.hypot(*given), np.array(memory.cell.up)
    angle = float(2 * np.arctan2(np.linalg.norm(said - known), np.linalg.norm(said + known)))
    if angle < MOUNTED:
        return instructions.Aside(text)
    turned = f"{text}: mounted {math.degrees(angle):.0f} deg otherwise than in the robot file"
    return instructions.Unknown(turned, may_move=False)


def _tool_value(memory: ProgramMemory) -> syntax.Value | None:
    """The pose of the tool as a value; None where neither program nor cell gives it."""
    value = memory.read("%tcp")
    return _record(memory.cell.tool) if value is None and memory.cell.tool is not None else value


def _tool(memory: ProgramMemory) -> instructions.NamedFrame:
    value = memory.read("%tcp")
    if value is None:
        return instructions.NamedFrame("", memory.cell.tool, own=False)
    pose = _pose(value)
    return instructions.NamedFrame(value.text if isinstance(value, syntax.Unclear) else "", pose)


def _load_set(before: syntax.Value | None, given: dict[str, syntax.Value]) -> syntax.Value:
    """Mass (kg), centre of mass (m, in the flange's frame) and inertia (kg m^2, about it); what a call leaves out stays
    as it was, but for the inertia, which only ``set_target_payload`` sets."""
    kept = dict(before.items) if isinstance(before, syntax.Record) else {}
    return syntax.Record("load", tuple((kept | given | {"inertia": given.get("inertia", (0.0,) * 6)}).items()))


def _load(value: syntax.Value | None) -> instructions.Load | None:
    """What the program says hangs on the flange."""
    if not isinstance(value, syntax.Record):
        return instructions.UnclearLoad(value.text) if isinstance(value, syntax.Unclear) else None
    mass, centre, inertia = (value.get(key) for key in ("m", "cog", "inertia"))
    parts = (mass, *(centre if isinstance(centre, tuple) else ()), *(inertia if isinstance(inertia, tuple) else ()))
    plain = syntax.numbers(parts)
    if plain is None or len(plain) != 10 or not syntax.finite(plain) or plain[0] < 0:
        text = "set_payload" if mass is None else f"set_payload({syntax.shown(mass)})"
        return instructions.UnclearLoad(text, syntax.number(mass))
    kg, x, y, z, xx, yy, zz, xy, xz, yz = plain
    return MassBody(kg, (x, y, z), (xx, yy, zz, xy, xz, yz)) if kg else None


def _pose(value: syntax.Value | None) -> Reals | None:
    """The transform (4, 4) of a pose of six finite numbers."""
    if not isinstance(value, syntax.Record) or value.kind != "p":
        return None
    plain = syntax.numbers(value.values())
    return instructions.pose_of(plain, "ur") if plain is not None and syntax.finite(plain) else None


def _record(pose: Reals) -> syntax.Record:
    return syntax.Record("p", tuple(zip(syntax.POSE_KEYS, instructions.numbers_of(pose, "ur"))))


def _target(memory: ProgramMemory, value: syntax.Value, text: str) -> instructions.Target:
    match value:
        case syntax.Solved():
            return _solved_target(memory, value, text)
        case syntax.Unclear(text=unclear):
            if unclear.lower() in ("nan", "inf"):
                return instructions.UnresolvedTarget(unclear, "not_finite")
            return instructions.UnresolvedTarget(unclear, "undefined")
        case syntax.Record() | tuple():
            parts = value.values() if isinstance(value, syntax.Record) else value
            unclear_part = next((each for each in parts if isinstance(each, syntax.Unclear)), None)
            if unclear_part is not None:
                return _target(memory, unclear_part, text)
            plain = syntax.numbers(parts)
            if plain is not None and not syntax.finite(plain):
                return instructions.UnresolvedTarget(text, "not_finite")
            matrix = _pose(value)
            if matrix is not None:
                return instructions.PoseTarget(matrix)
            joints = _joints(value)
            if joints is not None:
                return instructions.JointTarget(joints)
    return instructions.UnresolvedTarget(text, "not_understood")


def _solved_target(memory: ProgramMemory, solved: syntax.Solved, text: str) -> instructions.Target:
    """The joints that bring the tool of then to the pose, as a pose of the tool of now."""
    found = _target(memory, solved.pose, text)
    if not isinstance(found, instructions.PoseTarget):
        return found
    if isinstance(solved.near, syntax.Unclear):
        return instructions.UnresolvedTarget(solved.near.text, "undefined")
    now = _tool_value(memory)
    if solved.tool != now:
        then, tool = _pose(solved.tool), _pose(now)
        if then is None or tool is None:
            return instructions.UnresolvedTarget(text, "not_understood")
        found = instructions.PoseTarget(found.pose @ np.linalg.inv(then) @ tool)
    near = _joints(solved.near)
    if near is None and solved.here != memory.here.key():  # which of the solutions was nearest then is not known
        return instructions.UnresolvedTarget(text, "position_unknown")
    return replace(found, near=near)


def _joints(value: syntax.Value) -> Reals | None:
    plain = syntax.numbers(value) if isinstance(value, tuple) else None
    return np.array(plain) if plain is not None and len(plain) == 6 and syntax.finite(plain) else None


def _of_position(memory: ProgramMemory, name: str, given: dict[str, syntax.Value]) -> syntax.Value | None:
    """Functions of where the arm is, and of its table.

    After a motion with a blend radius the program goes on where the arm enters it [1]_, so that what it reads of the
    arm is not known; the waypoint is. Nor is it known while something changes the way of each motion (:data:`MODES`).

    References
    ----------
    .. [1] Universal Robots, *User Manual UR5/CB3*, version 3.10, section 14.6, conditional blend trajectories.
    """
    elsewhere = memory.read(PASSING) or memory.read(MODE)
    here = Position() if elsewhere and name != "get_target_waypoint" else memory.here
    if name in ("get_actual_joint_positions", "get_target_joint_positions"):
        if here.joints is None:
            return None
        return tuple(map(float, here.joints))
    if name in ("get_actual_tcp_pose", "get_target_tcp_pose", "get_target_waypoint", "get_actual_tool_flange_pose"):
        tool = instructions.NamedFrame("flange", np.eye(4)) if name.endswith("flange_pose") else _tool(memory)
        seen = here.seen(tool, ROBOT_BASE, memory.cell.flange)
        return None if seen is None else _record(seen)
    if name == "get_tcp_offset":
        tool = _tool(memory)
        return None if tool.pose is None else _record(tool.pose)
    if name == "get_forward_kin":
        tool = instructions.NamedFrame("", _pose(given["tcp"])) if "tcp" in given else _tool(memory)
        joints = _joints(given["q"]) if "q" in given else None
        if "q" in given and joints is None:
            return None
        seen = (here if joints is None else Position(joints)).seen(tool, ROBOT_BASE, memory.cell.flange)
        return None if seen is None else _record(seen)
    if name == "get_inverse_kin" and isinstance(pose := given.get("x"), syntax.Record):
        near = given.get("qnear", () if memory.here.joints is None else tuple(map(float, memory.here.joints)))
        tool_value = given.get("tcp", _tool_value(memory))
        plain = isinstance(near, syntax.Unclear) or near == () or _joints(near) is not None
        if plain and (tool_value is None or _pose(tool_value) is not None):
            return syntax.Solved(pose, near, tool_value, memory.here.key())
    return None


def _changed(values: list[syntax.Value | None], unclear: syntax.Unclear) -> syntax.Value:
    """A list after one of its methods, whose name is the second argument."""
    found, name, *more = (syntax.Unclear("") if each is None else each for each in values)
    if isinstance(found, tuple) and len(found) < LONGEST_LIST:
        if name == "append" and len(more) == 1:
            return (*found, more[0])
        if name == "clear" and not more:
            return ()
    return unclear


def _of_lists(name: str, given: dict[str, syntax.Value]) -> syntax.Value | None:
    """The number of a list's elements, its length as a vector, and the list over that; a list of one value."""
    value = given.get("v", given.get("a"))
    if name in ("length", "get_list_length", "size"):
        return len(value) if isinstance(value, (tuple, str)) else None
    if name == "make_list":
        count = syntax.number(given.get("length"))
        fits = count is not None and count == int(count) and 0 <= count <= LONGEST_LIST
        return (given["initial_value"],) * int(count or 0) if fits and "initial_value" in given else None
    if name not in ("norm", "normalize"):
        return None
    parts = value.values() if isinstance(value, syntax.Record) and name == "norm" else value
    plain = syntax.numbers(parts) if isinstance(parts, tuple) else syntax.numbers((parts,))
    size = None if not plain else math.hypot(*plain)
    if not plain or size is None or not math.isfinite(size):
        return None
    return size if name == "norm" else tuple(each / size for each in plain) if size > 0 else None


def _of_poses(name: str, given: dict[str, syntax.Value]) -> syntax.Value | None:
    """Functions of poses, as the manual defines them [1]_.

    What it leaves open has no value: how ``pose_dist`` weighs turns against lengths, in which frame ``pose_sub`` turns.

    References
    ----------
    .. [1] Universal Robots, *Script manual*, module urmath.
    """
    values = [given[key] for key in SIGNATURES.get(name, ()) if key in given]
    if name in ("rpy2rotvec", "rotvec2rpy") and values and isinstance(values[0], tuple):
        plain = syntax.numbers(values[0])
        if plain is not None and len(plain) == 3 and syntax.finite(plain):
            if name == "rpy2rotvec":
                turn = scipy.spatial.transform.Rotation.from_matrix(
                    transform(np.zeros(3), np.array(plain))[:3, :3]
                ).as_rotvec()
            else:
                turn = rpy_of(scipy.spatial.transform.Rotation.from_rotvec(plain).as_matrix())
            return tuple(map(float, turn))
    poses = [pose for pose in map(_pose, values) if pose is not None]
    if name in ("pose_inv", "inv") and len(poses) == 1:
        return _record(np.asarray(np.linalg.inv(poses[0]), np.float64))
    if len(poses) != 2:
        return None
    a, b = poses
    match name:
        case "pose_trans":
            return _record(a @ b)
        case "pose_add":
            found = a.copy()
            found[:3, 3] += b[:3, 3]
            found[:3, :3] = a[:3, :3] @ b[:3, :3]
            return _record(found)
        case "pose_sub":
            found = a.copy()
            found[:3, 3] -= b[:3, 3]
            found[:3, :3] = a[:3, :3] @ b[:3, :3].T
            same = np.abs(found[:3, :3] - b[:3, :3].T @ a[:3, :3]).max() < SAME_TURN
            return _record(found) if same else None
        case "interpolate_pose":
            share = syntax.number(given.get("alpha"))
            if share is None or not math.isfinite(share):
                return None
            turn = scipy.spatial.transform.Rotation.from_matrix(a[:3, :3].T @ b[:3, :3]).as_rotvec()
            found = a.copy()
            found[:3, 3] += share * (b[:3, 3] - a[:3, 3])
            found[:3, :3] = a[:3, :3] @ scipy.spatial.transform.Rotation.from_rotvec(share * turn).as_matrix()
            return _record(found)
        case "point_dist":
            return float(np.linalg.norm(a[:3, 3] - b[:3, 3]))
    return None
