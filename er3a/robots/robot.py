"""The frozen robot model that everything else takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Literal, get_args

import numpy as np

from er3a.errors import ShapeError
from er3a.numerics.arrays import Reals

Grade = Literal["official", "cad", "export", "claim", "inferred"]
GRADES: tuple[Grade, ...] = get_args(Grade)
AUTHORITATIVE_GRADES: tuple[Grade, ...] = ("official", "cad", "export")


@dataclass(frozen=True)
class Source:
    """Where a group of values comes from, and how far it can be relied on (``GRADES``)."""

    source: str
    grade: Grade


@dataclass(frozen=True)
class Envelope:
    """A capsule around a link, for clearance: all points within ``radius`` (m) of a line from ``start`` to ``end``.

    Attributes
    ----------
    link : 0 for the base, 1..6 for the link that joint 1..6 turns (the tool belongs to 6)
    start, end : points (m) in the frame on that joint's axis that turns with it; for link 0 in the base's frame
    """

    link: int
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float


@dataclass(frozen=True, eq=False)
class Robot:
    """A six-revolute serial arm. SI units; angles are in rad, arrays are read-only.

    The D-H angle of joint i is ``theta_i = direction_i * q_i + offset_i``, where q is what the teach pendant shows.

    Attributes
    ----------
    name, title : short name (file stem) and name for people
    convention : "standard" (row i follows joint i) or "modified" (Craig: a and alpha of row i precede joint i)
    a, d : (6,), m
    alpha, offset : (6,), rad
    beta : (6,), rad, Hayati's turn about y behind Rx(alpha), for axes that are parallel but for an error; usually 0
    direction : (6,), +1 or -1
    lower, upper : (6,), rad, limits of q
    speed : (6,), rad/s, greatest joint speed, NaN where unknown
    base : (4, 4), T_world_base; tool : (4, 4), T_flange_tool
    zero_pose : what the arm looks like at q = 0, in words
    references : names of the reference sets (folders of data/manual_refs) that it is checked against
    envelopes : capsules around the links; empty where the file gives none
    derived : what :func:`er3a.robots.derived.derived` keeps of this robot
    sources : per group of values ("dh", "zero", "limits", "speeds", "base", "tool", "envelopes") its source and grade
    """

    name: str
    title: str
    convention: Literal["standard", "modified"]
    a: Reals
    alpha: Reals
    d: Reals
    direction: Reals
    offset: Reals
    lower: Reals
    upper: Reals
    speed: Reals = field(default_factory=lambda: np.full(6, np.nan))
    beta: Reals = field(default_factory=lambda: np.zeros(6))
    base: Reals = field(default_factory=lambda: np.eye(4))
    tool: Reals = field(default_factory=lambda: np.eye(4))
    zero_pose: str = ""
    references: tuple[str, ...] = ()
    envelopes: tuple[Envelope, ...] = ()
    sources: Mapping[str, Source] = field(default_factory=dict)
    derived: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        for key in ("a", "alpha", "d", "beta", "direction", "offset", "lower", "upper", "speed", "base", "tool"):
            array = np.array(getattr(self, key), dtype=float)
            expected = (4, 4) if key in ("base", "tool") else (6,)
            if array.shape != expected:
                raise ShapeError(key, array.shape, str(expected))
            array.setflags(write=False)
            object.__setattr__(self, key, array)
        object.__setattr__(self, "sources", MappingProxyType(dict(self.sources)))

    def without_tool(self) -> Robot:
        """The robot with its flange as tool: references speak of the flange, which is frame 6 of the table."""
        return self.replace(tool=np.eye(4))

    def replace(self, **changes: Any) -> Robot:
        """A copy with other values for some attributes."""
        return replace(self, **changes)
