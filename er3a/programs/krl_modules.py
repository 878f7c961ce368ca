"""Modules that a KRL program calls: .src files beside its own, each with names of its own."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from er3a.programs.linking import mapped, within
from er3a.programs.program_text import ProgramText, read_program_text
from er3a.programs.syntax import Assign, Expression, Invocation, Operation, Routine, Variable

CALL = re.compile(r"\b([A-Za-z]\w*)\s*\(")
GLOBAL_ROUTINE = re.compile(r"(?im)^\s*GLOBAL\s+DEF(?:FCT\s+\w+(?:\s*\[[^\]]*\])?)?\s+(\w+)")
GLOBAL_NAME = re.compile(r"(?i)\bGLOBAL\b")
MOST_MODULES = 200


def modules_of(path: Path) -> tuple[Path, ...]:
    """The modules that a .src file calls, and those that these call, in the order in which they are met."""
    beside = {
        each.stem.upper(): each
        for each in sorted(path.parent.iterdir())
        if each.suffix.lower() == ".src" and each.is_file()
    }
    beside.pop(path.stem.upper(), None)
    found: list[Path] = []
    waiting = [path]
    while beside and waiting and len(found) < MOST_MODULES:
        called = dict.fromkeys(name.upper() for name in CALL.findall(read_program_text(waiting.pop(0)).text))
        new = [beside.pop(name) for name in called if name in beside]
        found += new
        waiting += new
    return tuple(found)


def apart(
    source: ProgramText, routines: Iterable[Routine], data: Iterable[Assign]
) -> tuple[list[Routine], list[Assign]]:
    """A module's routines and data under names that no other module has, its global ones apart.

    In KRL a routine is seen by other modules if it is named as its file or declared ``GLOBAL``, a name of a .dat file
    if it is declared ``GLOBAL``.
    """
    routines, data, module = list(routines), list(data), source.path.stem.upper()
    seen = {module, *(name.upper() for name in GLOBAL_ROUTINE.findall(source.text))}
    own = {each.target.name for each in data if isinstance(each.target, Variable) and not GLOBAL_NAME.search(each.text)}
    own |= {routine.name for routine in routines} - seen
    names = {name: f"{module}/{name}" for name in own if not name.startswith("$")}

    def code(operations: Iterable[Operation]) -> tuple[Operation, ...]:
        return tuple(_renamed(operation, names) for operation in operations)

    placed = [replace(each, name=names.get(each.name, each.name), code=code(each.code)) for each in routines]
    return placed, [each for each in code(data) if isinstance(each, Assign)]


def _renamed(operation: Operation, names: Mapping[str, str]) -> Operation:
    def each(expression: Expression) -> Expression:
        expression = within(expression, each)
        if isinstance(expression, Variable):
            return replace(expression, name=names.get(expression.name, expression.name))
        if isinstance(expression, Invocation):
            return replace(expression, function=names.get(expression.function, expression.function))
        return expression

    operation = mapped(operation, each)
    return replace(operation, target=each(operation.target)) if isinstance(operation, Assign) else operation
