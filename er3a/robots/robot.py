"""The frozen robot model that everything else takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Literal, get_args

import numpy as np

from er3a.display import Displayed, Sheet, shortly
from er3a.errors import RobotError, ShapeError
from er3a.geometry.transforms import as_floats, rpy_of
from er3a.numerics.arrays import Reals

Convention = Literal["standard", "modified"]
CONVENTIONS: tuple[Convention, ...] = get_args(Convention)
Grade = Literal["official", "measured", "cad", "export", "claim", "inferred"]
GRADES: tuple[Grade, ...] = get_args(Grade)
AUTHORITATIVE_GRADES: tuple[Grade, ...] = ("official", "measured", "cad", "export")


@dataclass(frozen=True)
class Source:
    """Where a group of values comes from, how far it can be relied on (``GRADES``), and its document, if named."""

    source: str
    grade: Grade
    origin: str = ""


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


@dataclass(frozen=True)
class ConvexPiece:
    """A convex piece of a link: all points within ``margin`` (m) of the hull of ``points`` (m, frame as of Envelope).

    The margin is by how far the mesh that the piece is part of may stand out of its pieces.
    """

    link: int
    points: tuple[tuple[float, float, float], ...]
    margin: float


@dataclass(frozen=True)
class PairRule:
    """What a person decided of a pair of bodies: not looked at (``allow``) or looked at as a whole (``watch``).

    Bodies are named ``base``, ``link_1`` ..., or as the scene names its solids and what is carried.
    """

    first: str
    second: str
    rule: Literal["allow", "watch"]
    reason: str


@dataclass(frozen=True, eq=False, repr=False)
class Robot(Displayed):
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
    envelopes, hulls : capsules around the links, and convex pieces of them; both empty where the file gives none
    pair_rules : which pairs of links a person decided on
    derived : what :func:`er3a.robots.derived.derived` keeps of this robot
    sources : per group of values ("dh", "zero", "limits", "speeds", "base", "tool", "envelopes") its source and grade
    origins : documents of single entries ("d4", "direction2", "lower6") that have another one than their group

    Raises
    ------
    ShapeError, PoseError
        for arrays of another shape, or of something that is no number
    RobotError
        for a convention or a direction that there isn't
    """

    name: str
    title: str
    convention: Convention
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
    hulls: tuple[ConvexPiece, ...] = ()
    pair_rules: tuple[PairRule, ...] = ()
    sources: Mapping[str, Source] = field(default_factory=dict)
    origins: Mapping[str, str] = field(default_factory=dict)
    derived: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        for key in ("a", "alpha", "d", "beta", "direction", "offset", "lower", "upper", "speed", "base", "tool"):
            array = np.array(as_floats(getattr(self, key), key))
            expected = (4, 4) if key in ("base", "tool") else (6,)
            if array.shape != expected:
                raise ShapeError(key, array.shape, str(expected))
            array.setflags(write=False)
            object.__setattr__(self, key, array)
        if self.convention not in CONVENTIONS:
            raise RobotError(self.name, f"the convention is {self.convention!r}; expected one of {CONVENTIONS}")
        wrong = np.flatnonzero(np.abs(self.direction) != 1)
        if wrong.size:
            value = self.direction[wrong[0]]
            raise RobotError(self.name, f"direction of joint {wrong[0] + 1} is {value:g}; expected 1 or -1")
        object.__setattr__(self, "sources", MappingProxyType(dict(self.sources)))
        object.__setattr__(self, "origins", MappingProxyType(dict(self.origins)))

    def without_tool(self) -> Robot:
        """The robot with its flange as tool: references speak of the flange, which is frame 6 of the table."""
        return self.replace(tool=np.eye(4))

    def replace(self, **changes: Any) -> Robot:
        """A copy with other values for some attributes."""
        return replace(self, **changes)

    def sheet(self) -> Sheet:
        """The table in mm and degrees, and where tool and base are."""
        columns = [
            np.arange(1, 7),
            *(
                1000 * self.a,
                np.degrees(self.alpha),
                1000 * self.d,
                *([np.degrees(self.beta)] if self.beta.any() else []),
            ),
            *(self.direction.astype(int), np.degrees(self.offset)),
            *(np.degrees(self.lower), np.degrees(self.upper), np.degrees(self.speed)),
        ]
        names = ["joint", "a_mm", "alpha_deg", "d_mm", *(["beta_deg"] if self.beta.any() else [])]
        names += ["direction", "offset_deg", "lower_deg", "upper_deg", "speed_deg_s"]
        placed = [("base", self.base), ("tool", self.tool)]
        return Sheet(
            f"Robot {self.name}: {shortly(self.title)} ({self.convention} D-H)",
            tuple(names),
            tuple(tuple(shortly(value) for value in row) for row in zip(*columns)),
            facts=(
                *(f"{name}: {_placement(T)}" for name, T in placed if (np.eye(4) != T).any()),
                *([f"references: {', '.join(self.references)}"] if self.references else []),
            ),
        )


def _placement(T: Reals) -> str:
    xyz, rpy = (shortly(tuple(values.tolist())) for values in (1000 * T[:3, 3], np.degrees(rpy_of(T))))
    return f"xyz_mm {xyz}; rpy_deg {rpy}"
