"""What URScript's motions, poses and functions mean: metres, radians, rotation vectors."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.programs.evaluation import Dialect, Position, ProgramMemory, evaluated, target_numbers
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
    RateUnit,
    Target,
    UnclearLoad,
    Unknown,
    UnresolvedTarget,
    Zone,
    numbers_of,
    pose_of,
)
from er3a.programs.syntax import (
    POSE_KEYS,
    Doing,
    Expression,
    Invocation,
    Move,
    Record,
    Unclear,
    Value,
    finite,
    number,
    numbers,
    rate_of,
    shown,
)
from er3a.robots.masses import MassBody

KINDS: dict[str, MotionKind] = {"movej": "joint", "movel": "line", "movep": "line", "movec": "arc"}
PARAMETERS = {
    "movej": ("q", "a", "v", "t", "r"),
    "movel": ("pose", "a", "v", "t", "r"),
    "movep": ("pose", "a", "v", "r"),
    "movec": ("pose_via", "pose_to", "a", "v", "r", "mode"),
}
DEFAULTS = {"movej": (1.4, 1.05), "movel": (1.2, 0.25), "movep": (1.2, 0.25), "movec": (1.2, 0.25)}
SAME_TURN = 1e-9  # of an element of a rotation matrix
ROBOT_BASE = NamedFrame("base", np.eye(4))
LIST_METHODS = frozenset(["append", "clear", "extend", "insert", "pop", "remove", "sort"])
RESTING = frozenset(["run", "set_payload_mass", "set_payload_cog", "servoc", "servoj", "speedj", "speedl"])
"""What is not followed, and sets no tool; some of them move the arm."""
HARMLESS_TEXT = """
assert binary_list_to_integer conveyor_pulse_decode enable_external_ft_sensor encoder_enable_pulse_decode
encoder_enable_set_tick_count encoder_get_tick_count encoder_set_tick_count encoder_unwind_delta_tick_count
end_freedrive_mode end_screw_driving end_teach_mode force force_mode_set_damping
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
modbus_set_runstate_dependent_choice modbus_set_signal_update_frequency popup pose_dist powerdown
interpolate_pose rotvec2rpy rpy2rotvec make_list size log
stopj stopl
random read_input_boolean_register read_input_float_register read_input_integer_register
read_output_boolean_register read_output_float_register read_output_integer_register read_port_bit
read_port_register request_boolean_from_primary_client request_float_from_primary_client
request_integer_from_primary_client request_string_from_primary_client rpc_factory rtde_set_watchdog
set_analog_inputrange set_analog_out set_analog_outputdomain set_baselight_off set_baselight_solid
set_configurable_digital_input_action set_configurable_digital_out set_conveyor_tick_count set_digital_out
set_euromap_output set_euromap_runstate_dependent_choice set_flag set_gp_boolean_input_action
set_gravity set_input_actions_to_default set_runstate_outputs
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
write_port_register zero_ftsensor get_actual_tool_flange_pose get_list_length
"""
HARMLESS = frozenset(HARMLESS_TEXT.split())
"""Functions of the language that move nothing and set no frame; any other name may be anybody's and do anything."""
OUTPUTS_TEXT = """
set_digital_out set_standard_digital_out set_configurable_digital_out set_tool_digital_out set_analog_out
set_standard_analog_out set_flag
"""
OUTPUTS = frozenset(OUTPUTS_TEXT.split())
LOADS = {"set_payload": ("m", "cog"), "set_target_payload": ("m", "cog", "inertia", "transition_time")}
"""Functions that say what hangs on the flange, by their parameters."""
WHERE_TEXT = """
get_actual_joint_positions get_target_joint_positions get_actual_tcp_pose get_target_tcp_pose get_target_waypoint
get_tcp_offset
"""
MATHS_TEXT = "sqrt sin cos tan asin acos atan floor ceil"
SIGNATURES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(WHERE_TEXT.split(), ()),
    "get_forward_kin": ("q",),
    "get_inverse_kin": ("x", "qnear"),
    "pose_trans": ("p_from", "p_from_to"),
    "pose_add": ("p_1", "p_2"),
    "pose_sub": ("p_to", "p_from"),
    "pose_inv": ("p_from",),
    "point_dist": ("p_from", "p_to"),
    "norm": ("a",),
    "normalize": ("v",),
    "length": ("v",),
    **dict.fromkeys(MATHS_TEXT.split(), ("f",)),
    "abs": ("f",),
    "atan2": ("x", "y"),
    "pow": ("base", "exponent"),
    "d2r": ("d",),
    "r2d": ("r",),
}
"""Parameters of the functions that are evaluated. A call that does not fit them is not understood."""
PLAIN: dict[str, Callable[..., float]] = {
    **{name: getattr(math, name) for name in (*MATHS_TEXT.split(), "atan2", "pow")},
    "d2r": math.radians,
    "r2d": math.degrees,
    "abs": abs,
}
Values = dict[str, Value]


class UrScriptDialect(Dialect):
    """URScript, as a run needs it. Its numbers have 32 bits [1]_.

    References
    ----------
    .. [1] Universal Robots, *User Manual UR5/CB3*, version 3.4.5, section 14.3; *User Manual UR16e*, section 7.2.
    """

    modal = frozenset(("%tcp", "%load"))
    local_by_default = True
    frames = ("%tcp",)
    first_index = 0
    harmless = HARMLESS | SIGNATURES.keys() | {"struct"}

    def listed(self, kind: str, values: tuple[Value, ...]) -> Value:
        """The value of ``[...]``, and of ``p[...]`` with six numbers.

        Parameters
        ----------
        kind : ``p`` of a pose, empty for a list

        Returns
        -------
        value : a pose is x, y, z in m and a rotation vector in rad; one with other than six values is unclear
        """
        if not kind:
            return values
        if len(values) != 6:
            return Unclear(f"p[{', '.join(map(shown, values))}]")
        return Record("p", tuple(zip(POSE_KEYS, values)))

    def function(self, memory: ProgramMemory, name: str, given: Invocation) -> Value:
        """The value of a function of URScript: mathematics, poses, lists, where the arm is.

        Returns
        -------
        value : in m and rad; unclear for a function that is unknown, or called otherwise than known
        """
        values, keywords = _given(memory, given.arguments, given.keywords)
        if name == "struct":
            return Record(name, tuple(keywords.items()))
        unclear = Unclear(f"{name}({', '.join('' if each is None else shown(each) for each in values)})")
        placed = _placed(SIGNATURES.get(name), values, keywords)
        if placed is None:
            return unclear
        if name in PLAIN:
            found = evaluated(PLAIN[name], [placed.get(key) for key in SIGNATURES[name]])
        else:
            found = _of_position(memory, name, placed)
            found = _of_values(name, list(placed.values())) if found is None else found
        return unclear if found is None else found

    def motion(self, memory: ProgramMemory, move: Move) -> ArmMotion:
        """The motion of movej, movel, movep and movec.

        Returns
        -------
        motion : speed and acceleration that are left out are the manual's defaults (``DEFAULTS``); a time of more than
            0 takes precedence. The blend radius is a zone in m.
        """
        kind, tool = KINDS[move.form], _tool(memory)
        values = _placed(PARAMETERS[move.form], *_given(memory, move.arguments, move.settings))
        if values is None:
            unknown = UnresolvedTarget(move.text, "not_understood")
            return ArmMotion(kind, unknown, move.form, unknown if kind == "arc" else None, tool=tool)
        goals = [values.get(name, Unclear(move.text)) for name in PARAMETERS[move.form][: 1 + (kind == "arc")]]
        made = [_target(goal, move.text) for goal in goals]
        a, v = DEFAULTS[move.form]
        unit: tuple[RateUnit, RateUnit] = ("m/s", "m/s2")
        if kind == "joint":
            unit = ("rad/s", "rad/s2")
        timed = "t" in values and number(values["t"]) != 0.0  # 0: by speed and acceleration
        speed = rate_of(values["t"], "s") if timed else rate_of(values.get("v", v), unit[0])
        radius = values.get("r", 0.0)
        blend = number(radius)
        zone = Zone("named", 0.0, shown(radius))
        if blend is not None:
            zone = Zone("distance", blend) if blend > 0 else FINE
        return ArmMotion(
            kind,
            made[-1],
            move.form,
            made[0] if kind == "arc" else None,
            speed,
            rate_of(values.get("a", a), unit[1]),
            zone,
            tool,
            ROBOT_BASE,
            load=_load(memory.read("%load")),
            not_followed="" if number(values.get("mode", 0)) == 0 else "mode",
        )

    def carry_out(self, memory: ProgramMemory, doing: Doing) -> Instruction | None:
        """Carry out settings of tool and load, and outputs; the rest as in all languages.

        Returns
        -------
        instruction : None for a tool or load that is known. Servo and speed commands, which are not
            followed, leave the arm's position unknown.
        """
        call = doing.what
        values, keywords = _given(memory, call.arguments, call.keywords)
        if call.function == "set_tcp":
            pose = (_placed(("pose", "tcp_name"), values, keywords) or {}).get("pose")
            known = isinstance(pose, Unclear) or _pose(pose) is not None
            memory.write("%tcp", pose if known and pose is not None else Unclear(doing.text))
            return None if known or isinstance(pose, Record) else Unknown(doing.text)
        if call.function in LOADS:
            loaded = _placed(LOADS[call.function], values, keywords)
            usual: Values = {"cog": (0.0,) * 3, "inertia": (0.0,) * 6}
            load = Unclear(doing.text) if loaded is None else Record("load", tuple((usual | loaded).items()))
            memory.write("%load", load)
            return Aside(doing.text) if isinstance(_load(load), UnclearLoad) else None
        if call.function in RESTING:
            memory.here = Position()
            return Unknown(doing.text, may_move=False)
        if memory.here.passing and call.function in ("stopj", "stopl"):  # within a blend, somewhere on its way
            return Unknown(doing.text)
        output = _placed(("n", "b"), values, keywords) if call.function in OUTPUTS else None
        if output is not None and len(output) == 2:
            name = f"{call.function.removeprefix('set_')}[{shown(output['n'])}]"
            return Output(name, shown(output["b"]))
        if call.function.partition(".")[2] in LIST_METHODS:
            return Aside(doing.text)
        return super().carry_out(memory, doing)


def _given(
    memory: ProgramMemory,
    placed: tuple[Expression | None, ...],
    named: tuple[tuple[str, Expression], ...],
) -> tuple[list[Value | None], Values]:
    """The values of arguments by place and by name."""
    values = [None if each is None else memory.value(each) for each in placed]
    return values, {name: memory.value(each) for name, each in named}


def _placed(names: tuple[str, ...] | None, values: list[Value | None], keywords: Values) -> Values | None:
    """Arguments by the names of a function's parameters; None for a call that does not fit them."""
    if names is None or len(values) > len(names) or None in values or not keywords.keys() <= set(names):
        return None
    placed = {name: each for name, each in zip(names, values) if each is not None}
    return None if placed.keys() & keywords.keys() else placed | keywords


def _tool(memory: ProgramMemory) -> NamedFrame:
    value = memory.read("%tcp")
    if value is None:
        return NamedFrame("", memory.cell.tool, own=False)
    return NamedFrame(value.text if isinstance(value, Unclear) else "", _pose(value))


def _load(value: Value | None) -> Load | None:
    """What the program says hangs on the flange: mass (kg), centre (m, in its frame), inertia (kg m^2, about it)."""
    if not isinstance(value, Record):
        return UnclearLoad(value.text) if isinstance(value, Unclear) else None
    mass, centre, inertia = (value.get(key) for key in ("m", "cog", "inertia"))
    parts = (mass, *(centre if isinstance(centre, tuple) else ()), *(inertia if isinstance(inertia, tuple) else ()))
    plain = numbers(parts)
    if plain is None or len(plain) != 10 or not finite(plain) or plain[0] < 0:
        text = "set_payload" if mass is None else f"set_payload({shown(mass)})"
        return UnclearLoad(text, number(mass))
    kg, x, y, z, xx, yy, zz, xy, xz, yz = plain
    return MassBody(kg, (x, y, z), (xx, yy, zz, xy, xz, yz)) if kg else None


def _pose(value: Value | None) -> Reals | None:
    """The transform (4, 4) of a pose of six finite numbers."""
    if not isinstance(value, Record) or value.kind != "p":
        return None
    plain = numbers(value.values())
    return pose_of(plain, "ur") if plain is not None and finite(plain) else None


def _record(pose: Reals) -> Record:
    return Record("p", tuple(zip(POSE_KEYS, numbers_of(pose, "ur"))))


def _target(value: Value, text: str) -> Target:
    if isinstance(value, Record) and value.kind == "near":  # a solution near to given joints
        pose = _target(value.values()[0], text)
        near = _target(value.values()[-1], text)
        if len(value.items) == 1 or not isinstance(near, JointTarget):
            return pose if len(value.items) == 1 else near
        return replace(pose, near=near.joints) if isinstance(pose, PoseTarget) else pose
    parts = value.values() if isinstance(value, Record) else value if isinstance(value, tuple) else (value,)
    plain = target_numbers(parts, text)
    if isinstance(plain, UnresolvedTarget):
        return plain
    if len(plain) != 6 or (isinstance(value, Record) and value.kind != "p"):
        return UnresolvedTarget(text, "not_understood")
    if isinstance(value, Record):
        return PoseTarget(pose_of(plain, "ur"))
    return JointTarget(np.array(plain))


def _of_position(memory: ProgramMemory, name: str, given: Values) -> Value | None:
    """Functions of where the arm is, and of its table; a pose stands for its joints nearest to where the arm is.

    After a motion with a blend radius the program goes on where the arm enters it [1]_, so that what it reads of the
    arm is not known; the waypoint is.

    References
    ----------
    .. [1] Universal Robots, *User Manual UR5/CB3*, version 3.10, section 14.6, conditional blend trajectories.
    """
    here, tool = memory.here, _tool(memory)
    if here.passing and name != "get_target_waypoint":
        here = Position()
    match name:
        case "get_actual_joint_positions" | "get_target_joint_positions":
            return None if here.joints is None else tuple(map(float, here.joints))
        case "get_tcp_offset":
            return None if tool.pose is None else _record(tool.pose)
        case "get_inverse_kin":
            return Record("near", tuple(given.items())) if _pose(given.get("x")) is not None else None
        case "get_forward_kin" if given:
            joints = _target(given["q"], "")
            here = Position(joints.joints) if isinstance(joints, JointTarget) else Position()
        case "get_forward_kin" | "get_actual_tcp_pose" | "get_target_tcp_pose" | "get_target_waypoint":
            pass
        case _:
            return None
    seen = here.seen(tool, ROBOT_BASE, memory.cell.flange)
    return None if seen is None else _record(seen)


def _of_values(name: str, values: list[Value]) -> Value | None:
    """Functions of lists and poses, as the manual defines them [1]_.

    References
    ----------
    .. [1] Universal Robots, *Script manual*, module urmath.
    """
    value = values[0] if values else None
    poses = [pose for pose in map(_pose, values) if pose is not None]
    plain = numbers(value) if isinstance(value, tuple) else None
    match name:
        case "length":
            return len(value) if isinstance(value, tuple) else None
        case "norm" | "normalize" if plain and finite(plain):
            size = math.hypot(*plain)
            return size if name == "norm" else tuple(each / size for each in plain) if size > 0 else None
        case "pose_inv" if len(poses) == 1:
            return _record(np.asarray(np.linalg.inv(poses[0]), np.float64))
        case "pose_trans" if len(poses) == 2:
            return _record(poses[0] @ poses[1])
        case "pose_add" | "pose_sub" if len(poses) == 2:
            (a, b), sign = poses, 1 if name == "pose_add" else -1
            turn = b[:3, :3] if sign > 0 else b[:3, :3].T
            found = a.copy()
            found[:3, 3] += sign * b[:3, 3]
            found[:3, :3] = a[:3, :3] @ turn
            known = sign > 0 or np.allclose(found[:3, :3], turn @ a[:3, :3], rtol=0, atol=SAME_TURN)
            return _record(found) if known else None  # in which frame a difference turns is not documented
    return None
