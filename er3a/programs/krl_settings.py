"""How KRL sets speeds, zones, tool and base: by system variables, by BAS, and by the WITH of a spline motion."""

from __future__ import annotations

from er3a.programs.evaluation import ProgramMemory
from er3a.programs.instructions import NamedFrame
from er3a.programs.krl_targets import is_frame, record_pose
from er3a.programs.syntax import Expression, Invocation
from er3a.programs.values import Record, Unclear, Value, number


def tool_of(memory: ProgramMemory) -> NamedFrame:
    """The tool that is set."""
    return _frame(memory, "$TOOL")


def base_of(memory: ProgramMemory) -> NamedFrame:
    """The base that is set."""
    return _frame(memory, "$BASE")


def _frame(memory: ProgramMemory, variable: str) -> NamedFrame:
    value = memory.read(variable)
    if value is None:
        return NamedFrame("", memory.cell.tool if variable == "$TOOL" else memory.cell.base)
    said = memory.read(variable + "%name")
    name = said.upper() if isinstance(said, str) and said[:1] not in ("{", "") else ""
    pose = record_pose(value) if is_frame(value) else None
    if isinstance(value, Unclear):
        name = name or value.text
    return NamedFrame(name, memory.cell.frames.get(name) if pose is None else pose)


def set_by_bas(memory: ProgramMemory, call: Invocation) -> bool:
    """Carry ``BAS(#COMMAND, value)`` out; False if the command is none that sets anything."""
    values = [memory.value(each) for each in call.arguments if each is not None]
    command = values[0] if values else ""
    given: Value = values[1] if len(values) > 1 else Unclear("BAS")
    match command:
        case "#INITMOV":
            pass  # values of the controller's own, which no program tells
        case "#VEL_PTP":
            _all_axes(memory, "$VEL_AXIS", given)
        case "#ACC_PTP":
            _all_axes(memory, "$ACC_AXIS", given)
        case "#VEL_CP":
            memory.write("$VEL.CP", given)
        case "#ACC_CP":
            memory.write("$ACC.CP", given)
        case "#TOOL":
            _number(memory, "$TOOL", "TOOL_DATA", given)
        case "#BASE":
            _number(memory, "$BASE", "BASE_DATA", given)
        case "#FRAMES":
            _frames(memory)
        case "#PTP_DAT" | "#PTP_PARAMS":
            _joint_data(memory, memory.read("PDAT_ACT"))
            if command == "#PTP_PARAMS":
                _frames(memory)
                _all_axes(memory, "$VEL_AXIS", given)
        case "#CP_DAT" | "#CP_PARAMS":
            _line_data(memory, memory.read("LDAT_ACT"))
            if command == "#CP_PARAMS":
                _frames(memory)
                memory.write("$VEL.CP", given)
        case _:
            return False
    return True


def keep_setting(memory: ProgramMemory, name: str, expression: Expression) -> None:
    """One item of a WITH."""
    if not isinstance(expression, Invocation):
        value = memory.value(expression)
        if name in ("$VEL_AXIS[1]", "$ACC_AXIS[1]"):
            _all_axes(memory, name[:-3], value)
        else:
            memory.write(name, value)
            memory.shared.pop(name + "%name", None)
        return
    first = expression.arguments[0] if expression.arguments else None
    given = Unclear(name) if first is None else memory.value(first)
    match expression.function:
        case "SVEL_CP":
            memory.write("$VEL.CP", given)
        case "SVEL_JOINT":
            _all_axes(memory, "$VEL_AXIS", given)
        case "SACC_JOINT" if isinstance(given, Record):
            _all_axes(memory, "$ACC_AXIS", given.get("ACC") or Unclear(name))
        case "SACC_CP":
            _share(memory, given)
        case "SAPO":
            _zone_data(memory, given, "#CDIS")
        case "SAPO_PTP":
            _zone_data(memory, given, "#CPTP")
        case "STOOL2" if isinstance(given, Record):
            _tool_data(memory, given)
        case "SBASE":
            _number(memory, "$BASE", "BASE_DATA", given)
        case "SIPO_MODE":
            memory.write("$IPO_MODE", given)
        case _:
            if name in ("$TOOL", "$BASE"):
                memory.write(name, Unclear(f"{expression.function}(...)"))
                memory.shared.pop(name + "%name", None)


def _all_axes(memory: ProgramMemory, name: str, value: Value) -> None:
    for axis in range(1, 7):
        memory.write(f"{name}[{axis}]", value)


def _number(memory: ProgramMemory, variable: str, array: str, given: Value) -> None:
    """Set tool or base by its number; 0 is the null frame."""
    plain = number(given)
    memory.shared.pop(variable + "%name", None)
    if plain is None:
        memory.write(variable, Unclear(f"{array}[?]"))
        return
    name = f"{array}[{plain:g}]" if plain else "$NULLFRAME"
    memory.write(variable, memory.read(name) or Unclear(name))
    memory.write(variable + "%name", name)


def _tool_data(memory: ProgramMemory, data: Record) -> None:
    _number(memory, "$TOOL", "TOOL_DATA", data.get("TOOL_NO") or 0)
    memory.write("$IPO_MODE", data.get("IPO_FRAME") or "#BASE")


def _frames(memory: ProgramMemory) -> None:
    data = memory.read("FDAT_ACT")
    if isinstance(data, Record):
        _tool_data(memory, data)
        _number(memory, "$BASE", "BASE_DATA", data.get("BASE_NO") or 0)
    elif isinstance(data, Unclear):
        for variable in ("$TOOL", "$BASE"):
            memory.write(variable, Unclear(f"{variable[1:]} of {data.text}"))
            memory.shared.pop(variable + "%name", None)


def _joint_data(memory: ProgramMemory, data: Value | None) -> None:
    if isinstance(data, Record):
        _all_axes(memory, "$ACC_AXIS", data.get("ACC") or Unclear("ACC"))
        _zone_data(memory, data, "#CPTP")


def _line_data(memory: ProgramMemory, data: Value | None) -> None:
    if isinstance(data, Record):
        _share(memory, data)
        _zone_data(memory, data, "#CDIS")


def _share(memory: ProgramMemory, data: Value) -> None:
    percent = number(data.get("ACC")) if isinstance(data, Record) else None
    if percent is not None:
        memory.write("$ACC.CP", Record("", (("share", percent / 100),)))


def _zone_data(memory: ProgramMemory, data: Value, usual: str) -> None:
    """``APO_DIST`` of motion data: mm, or percent of a joint motion."""
    distance = number(data.get("APO_DIST")) if isinstance(data, Record) else None
    if not isinstance(data, Record) or distance is None:
        return
    mode = data.get("APO_MODE") or usual
    if mode == "#CPTP":
        memory.write("$APO.CPTP", distance)
    else:
        memory.write("$APO.CDIS", distance)
        memory.shared.pop("$APO.CPTP", None)
