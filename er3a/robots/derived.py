"""What follows from a robot alone is worked out once and kept with the robot."""

from __future__ import annotations

from collections.abc import Callable
from functools import update_wrapper
from typing import Concatenate, ParamSpec, TypeVar

from er3a.robots.robot import Robot

Rest = ParamSpec("Rest")
Value = TypeVar("Value")


def derived(function: Callable[Concatenate[Robot, Rest], Value]) -> Callable[Concatenate[Robot, Rest], Value]:
    """Keep what a function gives for a robot (and further hashable arguments) as long as the robot is there."""

    def once(robot: Robot, /, *rest: Rest.args, **named: Rest.kwargs) -> Value:
        key = (function, *rest, *named.items())
        kept = robot.derived
        if key not in kept:
            kept[key] = function(robot, *rest, **named)
        value: Value = kept[key]
        return value

    update_wrapper(once, function)
    return once
