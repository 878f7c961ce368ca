"""Argument checks of the public functions, those that ``er3a`` exports.

Arguments of er3a's own types are compared with the function's annotations. Robots are checked for values that no arm
can have, and joint values for NaN and degrees (:mod:`er3a.robots.usable`). The functions themselves check other arrays.
Inside the library the same functions are called without these checks, because validation computes with tables that no
arm can have.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial, update_wrapper
from inspect import Parameter, signature
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from er3a.errors import ArgumentError, with_extra
from er3a.robots.robot import Robot
from er3a.robots.usable import check_joint_values, check_robot

Check = Callable[[Any, Any], None]  # of the first argument, and of the one that is checked
Function = TypeVar("Function", bound=Callable[..., Any])
LOOK_FOR_CROSSED_LIMITS = {"diagnose"}
JOINT_VALUES = ("q", "q_ref", "q0", "q_start")
CALLED = {str: "a text", Path: "a path", NoneType: "None"}


def checked(function: Function) -> Function:
    """The public form of a function, which refuses unusable arguments with an :class:`er3a.Er3aError`."""
    checks = _checks(function)

    def public(*args: Any, **named: Any) -> Any:
        first, given = args[0] if args else named.get("robot"), len(args)
        for place, name, check in checks:
            if place < given:
                check(first, args[place])
            elif name in named:
                check(first, named[name])
        try:
            return function(*args, **named)
        except ModuleNotFoundError as error:
            raise with_extra(error) from None

    update_wrapper(public, function)
    public.__module__ = "er3a"  # where a pickle finds it
    return cast(Function, public)


def _checks(function: Callable[..., Any]) -> tuple[tuple[int, str, Check], ...]:
    # Without what it returns, which may be of a library that is not installed.
    own = {name: hint for name, hint in function.__annotations__.items() if name != "return"}
    hints = get_type_hints(type("Parameters", (), {"__annotations__": own}), function.__globals__)
    found, parameters = [], signature(function).parameters
    of_robot = next(iter(parameters), "") == "robot"
    for place, (name, parameter) in enumerate(parameters.items()):
        check = _check_of(name, hints[name], function.__name__ in LOOK_FOR_CROSSED_LIMITS)
        if of_robot and name in JOINT_VALUES:
            check = partial(check_joint_values, argument=name)
        if check is not None:
            found.append((place if parameter.kind is not Parameter.KEYWORD_ONLY else 1_000, name, check))
    return tuple(found)


def _check_of(name: str, hint: Any, crossed_limits: bool) -> Check | None:
    """The check for an argument with this annotation; None if the function checks it itself."""
    if hint is Robot:
        return lambda _, value: check_robot(value, crossed_limits)
    allowed = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    if set(allowed) == {Robot, NoneType}:
        return lambda _, value: None if value is None else check_robot(value, crossed_limits)
    plain = tuple(each for each in allowed if isinstance(each, type) and (_ours(each) or each in CALLED))
    listed = tuple(get_args(each)[0] for each in allowed if get_origin(each) is Sequence and _ours(get_args(each)[0]))
    if len(plain) + len(listed) != len(allowed):
        return None
    expected = " or ".join(
        [CALLED.get(each, _article(each)) for each in plain] + [f"several {each.__name__}" for each in listed]
    )

    def check(_: Any, value: Any) -> None:
        if isinstance(value, plain):
            return
        if not listed or isinstance(value, str) or not isinstance(value, Sequence):
            raise ArgumentError(name, value, expected)
        for number, each in enumerate(value):
            if not isinstance(each, listed):
                raise ArgumentError(f"{name}[{number}]", each, " or ".join(map(_article, listed)))

    return check


def _ours(kind: Any) -> bool:
    return isinstance(kind, type) and kind.__module__.startswith("er3a.")


def _article(kind: type) -> str:
    return f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"
