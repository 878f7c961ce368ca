"""The robot model, a frozen dataclass, and its conversion to the other Denavit-Hartenberg convention.

The two conventions split the same product of elementary transforms at different places, so the rows shift by one and
nothing is approximated: a standard row's ``Tx(a) Rx(alpha)`` is the next modified row's ``Rx(alpha) Tx(a)`` (they
commute). The remainders go to the ends: after the last joint to the flange, before joint 1 to the base.

Reference: J. J. Craig, *Introduction to Robotics*, 3rd ed., section 3.4 and its notes on the two conventions.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from functools import cached_property, update_wrapper
from pathlib import Path
from typing import Any, Concatenate, Literal, ParamSpec, TypeVar, get_args

import numpy as np

from er3a.by_value import ByValue, Displayed, ReadOnly, Sheet, frozen, shortly
from er3a.errors import InputWarning, PoseError, RobotError, ShapeError
from er3a.geometry.transforms import rot_x, rot_y, rpy_of, translation
from er3a.numerics.arrays import Flags, Integers, Reals, as_floats
from er3a.robots.masses import Masses

MAX_JOINTS = 10  # a sample has twelve random numbers (er3a/sampling/random_joints.py)
Convention = Literal["standard", "modified"]
CONVENTIONS: tuple[Convention, ...] = get_args(Convention)
Grade = Literal["official", "measured", "cad", "export", "claim", "inferred"]
GRADES: tuple[Grade, ...] = get_args(Grade)
AUTHORITATIVE_GRADES: tuple[Grade, ...] = ("official", "measured", "cad", "export")


@frozen
class Source:
    """Where a group of values comes from, how far it can be relied on (``GRADES``), and its document, if named."""

    source: str
    grade: Grade
    origin: str = ""


@frozen
class Envelope:
    """A capsule around a link, for clearance: all points within ``radius`` (m) of a line from ``start`` to ``end``.

    Attributes
    ----------
    link : 0 for the base, 1..m for the link that the joint of that row moves (the tool belongs to the last)
    start, end : points (m) in the frame on that joint's axis that turns with it; for link 0 in the base's frame
    """

    link: int
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float

    def __post_init__(self) -> None:
        _keep_shape(self, "radius", start=self.start, end=self.end)


@frozen
class CombinedLimit:
    """Limits of a sum of joints: ``lower <= factors @ q <= upper``, such as J2 + J3 of arms with a parallelogram.

    ``factors`` has one number for each of the n joints; lower and upper are in rad (m if all its joints slide; among
    revolute joints, factors of slides are in rad/m).
    """

    factors: tuple[float, ...]
    lower: float
    upper: float


@frozen
class ConvexPiece:
    """A convex piece of a link: all points within ``margin`` (m) of the hull of ``points`` (m, frame as of Envelope).

    The margin is by how far the mesh that the piece is part of may stick out of its pieces.
    """

    link: int
    points: tuple[tuple[float, float, float], ...]
    margin: float

    def __post_init__(self) -> None:
        _keep_shape(self, "margin", points=self.points)


def _keep_shape(shape: Envelope | ConvexPiece, size: Literal["radius", "margin"], **points: Any) -> None:
    """Keep a shape's points (..., 3) and size as floats; one with numbers that no shape can have is refused."""
    arrays = {key: as_floats(value, key) for key, value in points.items()}
    for key, array in arrays.items():
        if array.shape[-1:] != (3,) or not np.isfinite(array).all():
            raise PoseError(f"{key} of a shape of link {shape.link} must be points of three finite numbers")
        whole = tuple(map(tuple, array.tolist())) if array.ndim > 1 else tuple(array.tolist())
        object.__setattr__(shape, key, whole)
    value = float(getattr(shape, size))
    if shape.link < 0 or not (np.isfinite(value) and value >= 0):
        raise PoseError(f"a shape of link {shape.link} has a {size} of {value:g} m; link and {size} must be 0 or more")
    object.__setattr__(shape, size, value)


@frozen
class LinkMesh(ByValue):
    """A surface of a link: points (k, 3), m, in the frame as of :class:`Envelope`, and triangles (f, 3) of them."""

    link: int
    points: Reals
    faces: Integers


@frozen
class PairRule:
    """What a person decided of a pair of bodies: not looked at (``allow``) or looked at as a whole (``watch``).

    Bodies are named ``base``, ``link_1`` ..., or as the scene names its solids and what is carried.
    """

    first: str
    second: str
    rule: Literal["allow", "watch"]
    reason: str


def slides_of(sliding: Flags, coupling: Reals | None) -> Flags:
    """Joints that are distances: the row of their number slides, or else one that they move.

    Parameters
    ----------
    sliding : (m,) bool, of rows
    coupling : (m, n), what moves the rows; None where each is moved by the joint of its number

    Returns
    -------
    slides : (n,) bool
    """
    if coupling is None:
        return sliding
    moved: Flags = (coupling[sliding] != 0).any(axis=0)
    return np.where(coupling.diagonal() != 0, sliding[: coupling.shape[1]], moved)


@frozen
class Robot(ByValue, Displayed):
    """A serial arm of 1 to 10 joints. SI units; angles are in rad, arrays are read-only.

    With q the joint values that the teach pendant shows, joint i moves by ``u = coupling @ q`` (``u = q`` without a
    coupling). The D-H angle of a revolute joint is ``theta_i = direction_i * u_i + offset_i``. For a prismatic joint,
    theta is ``offset_i`` and the distance along its axis ``d_i + direction_i * u_i``.

    n is the number of joints in q, and m the number of rows in the table. They differ only if a coupling moves more
    rows than there are joints (linkages that keep a wrist level).

    Attributes
    ----------
    name, title : short name (file stem) and display name
    convention : "standard" (row i follows joint i) or "modified" (Craig: a and alpha of row i precede joint i)
    a, d : (m,), m
    alpha, offset : (m,), rad
    beta : (m,), rad, Hayati's rotation about y after Rx(alpha), for nearly parallel axes; usually 0
    direction : (m,), +1 or -1
    sliding : (m,) bool, rows of prismatic joints
    coupling : (m, n), or None for the identity
    lower, upper : (n,), rad or m, limits of q; for a continuous joint, the turn that is sampled
    speed : (n,), rad/s or m/s, maximum joint speed, NaN where unknown
    continuous : (n,) bool, revolute joints without limits
    combined : limits on sums of joints, in addition to those of each joint
    base : (4, 4), T_world_base; tool : (4, 4), T_flange_tool
    flange : (4, 4), from the table's last frame to the flange, on which tools, loads and cameras are mounted.
        References, and joint values without a tool, refer to it. The identity if the table ends at the flange
    zero_pose : description of the arm at q = 0
    references : names of the reference sets (folders of data/manual_refs) for its validation
    envelopes, hulls, meshes : shapes of the links for collisions: capsules, convex pieces, and surfaces of triangles;
        all empty if the file gives none
    visuals : how the links look, if given, for pictures, and to check whether a link extends beyond its shapes; not
        used in comparisons of robots
    pair_rules : pairs of links that the robot file allows, or requires to be checked
    masses : of links, and the limits of drives and wrist, as far as known
    home : (n,), rad or m, where the arm rests and places are joined to; None if its file gives none
    notes : what was left out or assumed when a URDF was read, in words
    derived : what :func:`er3a.robots.robot.derived` keeps of this robot
    sources : for each group of values ("dh", "zero", "limits", "speeds", "base", "flange", "tool", "envelopes",
        "inertia", "drives", "wrist_load", "weight") its source and grade
    origins : documents of single entries ("d4", "direction2", "lower6") that differ from their group's

    Raises
    ------
    ShapeError, PoseError
        for arrays of the wrong shape, or with values that are not numbers
    RobotError
        for a convention or a direction that does not exist
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
    speed: Reals = field(default_factory=lambda: np.empty(0))
    beta: Reals = field(default_factory=lambda: np.empty(0))
    base: Reals = field(default_factory=lambda: np.eye(4))
    tool: Reals = field(default_factory=lambda: np.eye(4))
    flange: Reals = field(default_factory=lambda: np.eye(4))
    zero_pose: str = ""
    references: tuple[str, ...] = ()
    envelopes: tuple[Envelope, ...] = ()
    sliding: Flags = field(default_factory=lambda: np.empty(0, dtype=bool))
    coupling: Reals | None = None
    continuous: Flags = field(default_factory=lambda: np.empty(0, dtype=bool))
    combined: tuple[CombinedLimit, ...] = ()
    hulls: tuple[ConvexPiece, ...] = ()
    meshes: tuple[LinkMesh, ...] = ()
    visuals: tuple[LinkMesh, ...] = field(default=(), compare=False)
    pair_rules: tuple[PairRule, ...] = ()
    masses: Masses = field(default_factory=Masses)
    home: Reals | None = None
    notes: tuple[str, ...] = field(default=(), compare=False)
    sources: Mapping[str, Source] = field(default_factory=dict)
    origins: Mapping[str, str] = field(default_factory=dict)
    derived: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        rows, joints = np.size(self.direction), np.size(self.speed) or np.size(self.lower)
        unset = {"speed": np.full(joints, np.nan), "beta": np.zeros(rows)}
        for key in (*_OF_ROWS, *_OF_JOINTS, *_PLACED):
            given = getattr(self, key)
            array = np.array(unset[key] if key in unset and np.size(given) == 0 else as_floats(given, key))
            self._keep(key, array, (4, 4) if key in _PLACED else ((rows if key in _OF_ROWS else joints),))
        for key, count in (("sliding", rows), ("continuous", joints)):
            given = getattr(self, key)
            self._keep(key, np.array(given, bool) if np.size(given) else np.zeros(count, bool), (count,))
        if self.coupling is not None:
            self._keep("coupling", np.array(as_floats(self.coupling, "coupling")), (rows, joints))
        if self.home is not None:
            self._keep("home", np.array(as_floats(self.home, "home")), (joints,))
        self._refuse_wrong(rows, joints)
        object.__setattr__(self, "sources", ReadOnly(self.sources))
        object.__setattr__(self, "origins", ReadOnly(self.origins))

    def _refuse_wrong(self, rows: int, joints: int) -> None:
        """Raise :class:`ShapeError` or :class:`RobotError` for values that make no arm."""
        if not (1 <= joints <= MAX_JOINTS and joints <= rows <= MAX_JOINTS):
            raise ShapeError("lower", (joints,), f"(1,) to ({MAX_JOINTS},)")
        if rows != joints and self.coupling is None:
            raise ShapeError("lower", (joints,), f"({rows},), or a coupling ({rows}, {joints})")
        if self.convention not in CONVENTIONS:
            raise RobotError(self.name, f"the convention is {self.convention!r}; expected one of {CONVENTIONS}")
        wrong = np.flatnonzero(np.abs(self.direction) != 1)
        if wrong.size:
            value = self.direction[wrong[0]]
            raise RobotError(self.name, f"direction of joint {wrong[0] + 1} is {value:g}; expected 1 or -1")
        if (endless := np.flatnonzero(self.continuous & self.slides)).size:
            raise RobotError(self.name, f"joint {endless[0] + 1} slides and is continuous; give it limits")
        shapes: tuple[Envelope | ConvexPiece | LinkMesh, ...] = (*self.envelopes, *self.hulls, *self.meshes)
        for link in {shape.link for shape in shapes}:
            if link > rows:
                raise RobotError(self.name, f"a shape belongs to link {link}; the arm has links 0 to {rows}")
        for limit in self.combined:
            if len(limit.factors) != joints:
                raise ShapeError("combined", (len(limit.factors),), f"({joints},)")

    def __hash__(self) -> int:
        if "hash" not in self.derived:
            self.derived["hash"] = super().__hash__()
        found: int = self.derived["hash"]
        return found

    def _keep(self, key: str, array: Reals | Flags, expected: tuple[int, ...]) -> None:
        """Keep an array as read-only, or refuse one of another shape."""
        if array.shape != expected:
            raise ShapeError(key, array.shape, str(expected))
        array.setflags(write=False)
        object.__setattr__(self, key, array)

    @classmethod
    def from_dh(
        cls,
        a: Reals,
        alpha: Reals,
        d: Reals,
        *,
        offset: Reals | None = None,
        lower: Reals | None = None,
        upper: Reals | None = None,
        convention: Convention = "standard",
        sliding: Flags | None = None,
        name: str = "arm",
        **more: Any,
    ) -> Robot:
        """A robot from the columns of a D-H table, in m and rad, joint directions +1.

        Warns (``er3a.InputWarning``) of lengths that can only be mm and of angles that can only be degrees.

        Parameters
        ----------
        a, alpha, d : (n,), m and rad
        offset : (n,), rad; None for 0
        lower, upper : (n,), rad or m; None for a turn around 0, and for 0 to 1 m for a prismatic joint
        convention : "standard" or "modified"
        sliding : (n,) bool; None for an arm with revolute joints only
        more : further attributes, such as ``base``, ``tool`` or ``speed``

        Raises
        ------
        ShapeError, RobotError
            as for the class
        """
        count = np.size(a)
        slides = np.zeros(count, bool) if sliding is None else np.asarray(sliding, bool)
        robot = cls(
            **{"name": name, "title": name, "direction": np.ones(count)} | more,
            convention=convention,
            a=a,
            alpha=alpha,
            d=d,
            offset=np.zeros(count) if offset is None else offset,
            lower=np.where(slides, 0.0, -np.pi) if lower is None else lower,
            upper=np.where(slides, 1.0, np.pi) if upper is None else upper,
            sliding=slides,
        )
        _warn_of_units(robot)
        return robot

    @property
    def joints(self) -> int:
        """How many joints there are in q, n."""
        return len(self.lower)

    @property
    def rows(self) -> int:
        """How many rows the table has, m."""
        return len(self.a)

    @property
    def joint_to_row(self) -> Reals:
        """(m, n), the coupling, or the identity where the robot has none: ``u = joint_to_row @ q``."""
        return np.eye(self.rows) if self.coupling is None else self.coupling

    @property
    def slides(self) -> Flags:
        """(n,) bool, joints of q that are distances: the row of their number slides, or else one that they move."""
        return slides_of(self.sliding, self.coupling)

    def without_tool(self) -> Robot:
        """The robot with its flange as tool, as references describe it.

        Returns
        -------
        robot : a copy whose ``tool`` is the identity
        """
        return self.replace(tool=np.eye(4))

    def with_tool(self, tool: Reals) -> Robot:
        """The robot with another tool.

        Parameters
        ----------
        tool : (4, 4), T_flange_tool, m

        Returns
        -------
        robot : a copy; :class:`er3a.Er3aError` for what is no pose
        """
        return self.replace(tool=np.asarray(tool, float))

    @cached_property
    def flange_is_last_frame(self) -> bool:
        """Whether the table ends at the flange."""
        return np.array_equal(self.flange, np.eye(4))

    @property
    def last_to_tool(self) -> Reals:
        """(4, 4), from the table's last frame through the flange to the tool."""
        return self.tool if self.flange_is_last_frame else self.flange @ self.tool

    def states(self, group: str) -> bool:
        """Whether the robot's file, or what it was read from, gives a group of values.

        Parameters
        ----------
        group : as in ``sources``

        Returns
        -------
        states : False if a reader assumed it: its grade is ``inferred``
        """
        source = self.sources.get(group)
        return source is None or source.grade != "inferred"

    def replace(self, **changes: Any) -> Robot:
        """A copy with other values for some attributes.

        Parameters
        ----------
        changes : attributes by name, in SI; a title that was the name follows a new name

        Returns
        -------
        robot : a new object, checked like any other

        Raises
        ------
        ShapeError, PoseError, RobotError
            as for the class
        """
        if "name" in changes and self.title == self.name:
            changes = {"title": changes["name"]} | changes
        return replace(self, **changes)

    def sheet(self) -> Sheet:
        """The table in mm and degrees, and where base, flange and tool are, for printing.

        Returns
        -------
        sheet : a row for each row of the table; limits and speeds only if each row has its own joint
        """
        turning = not self.sliding.any()
        columns = {
            "row" if self.coupling is not None else "joint": np.arange(1, self.rows + 1),
            **({} if turning else {"type": np.where(self.sliding, "prismatic", "revolute")}),
            "a_mm": 1000 * self.a,
            "alpha_deg": np.degrees(self.alpha),
            "d_mm": 1000 * self.d,
            **({"beta_deg": np.degrees(self.beta)} if self.beta.any() else {}),
            "direction": self.direction.astype(int),
            "offset_deg": np.degrees(self.offset),
        }
        unit, scale = ("deg", np.degrees(1.0)) if turning else ("deg_or_mm", np.where(self.slides, 1000, np.degrees(1)))
        if self.rows == self.joints:
            limits = {"lower": self.lower, "upper": self.upper, "speed": self.speed}
            columns |= {f"{key}_{unit}{'_s' * (key == 'speed')}": scale * value for key, value in limits.items()}
        placed = [(name, getattr(self, name)) for name in _PLACED]
        return Sheet(
            f"Robot {self.name}: {shortly(self.title)} ({self.convention} D-H)",
            tuple(columns),
            tuple(tuple(shortly(value) for value in row) for row in zip(*columns.values())),
            facts=(
                *(f"{name}: {placement_text(T)}" for name, T in placed if (np.eye(4) != T).any()),
                *([f"references: {', '.join(self.references)}"] if self.references else []),
            ),
        )


_OF_ROWS = "a", "alpha", "d", "beta", "direction", "offset"
_OF_JOINTS = "lower", "upper", "speed"
_PLACED = "base", "flange", "tool"


LONGEST_M, MAX_TURNED = 20.0, 20 * np.pi  # beyond which a number is another unit's


def _warn_of_units(robot: Robot) -> None:
    """Warn of a table that was given in mm or degrees."""
    turned = np.concatenate([robot.alpha, robot.offset, (robot.upper - robot.lower)[~robot.slides]])
    if max(np.abs(robot.a).max(), np.abs(robot.d).max()) > LONGEST_M:
        _warn(robot, f"a link is longer than {LONGEST_M:g} m", "er3a takes m: divide mm by 1000")
    if np.abs(turned).max() > MAX_TURNED:
        _warn(robot, "an angle is more than ten turns in rad", "er3a takes rad: np.radians(...)")


def _warn(robot: Robot, problem: str, remedy: str) -> None:
    """Warn in the name of the caller of :meth:`Robot.from_dh`."""
    warnings.warn(f"{robot.name}: {problem}; {remedy}", InputWarning, stacklevel=4)


def robot_name(path: Path) -> str:
    """A name for the robot in a file, made from the file's name.

    Parameters
    ----------
    path : only its stem matters, of ``arm.urdf.xacro`` the ``arm``

    Returns
    -------
    name : small letters, digits and underscores, 64 at most; ``imported`` if nothing is left
    """
    stem = path.stem.lower().removesuffix(".urdf")
    name = "".join(c if c.isalnum() and c.isascii() else "_" for c in stem).strip("_")[:64]
    return name or "imported"


def placement_text(T: Reals) -> str:
    """Position in mm and roll, pitch, yaw in deg, as text.

    Parameters
    ----------
    T : (4, 4), m
    """
    xyz, rpy = (shortly(tuple(values.tolist())) for values in (1000 * T[:3, 3], np.degrees(rpy_of(T))))
    return f"xyz_mm {xyz}; rpy_deg {rpy}"


Rest = ParamSpec("Rest")
Value = TypeVar("Value")
_NOT_YET: Any = object()


def derived(function: Callable[Concatenate[Robot, Rest], Value]) -> Callable[Concatenate[Robot, Rest], Value]:
    """Keep what a function gives for a robot as long as the robot object is there.

    Parameters
    ----------
    function : of a robot and further hashable arguments, without side effects

    Returns
    -------
    once : the same function; the values are kept in :attr:`Robot.derived`, by function and arguments

    Notes
    -----
    A robot is frozen, so values can't go out of date. They must not be changed by callers.
    """

    def once(robot: Robot, /, *rest: Rest.args, **named: Rest.kwargs) -> Value:
        key = (function, *rest, *named.items()) if rest or named else function
        kept = robot.derived
        value: Value = kept.get(key, _NOT_YET)  # one look-up: a pose's forward kinematics asks four times
        if value is _NOT_YET:
            value = kept[key] = function(robot, *rest, **named)
        return value

    update_wrapper(once, function)
    return once


def to_modified(robot: Robot) -> Robot:
    """The robot with a modified (Craig) table, by shifting a, alpha and beta by one row.

    Parameters
    ----------
    robot : of either convention

    Returns
    -------
    robot : flange and tool poses are the same at all joint values; the same object if its table is modified already

    Notes
    -----
    The last row's a, alpha and beta become part of ``flange``; see the module's text.
    """
    if robot.convention == "modified":
        return robot
    return robot.replace(
        convention="modified",
        **{column: np.roll(getattr(robot, column), 1) * _not_first(robot) for column in _SHIFTED},
        flange=translation(robot.a[-1], 0, 0) @ rot_x(robot.alpha[-1]) @ rot_y(robot.beta[-1]) @ robot.flange,
    )


def to_standard(robot: Robot) -> Robot:
    """The robot with a standard table, by shifting a, alpha and beta by one row.

    Parameters
    ----------
    robot : of either convention

    Returns
    -------
    robot : flange and tool poses are the same at all joint values; the same object if its table is standard already

    Notes
    -----
    The first row's a, alpha and beta become part of ``base``; see the module's text.
    """
    if robot.convention == "standard":
        return robot
    return robot.replace(
        convention="standard",
        **{column: np.roll(getattr(robot, column) * _not_first(robot), -1) for column in _SHIFTED},
        base=robot.base @ rot_x(robot.alpha[0]) @ translation(robot.a[0], 0, 0) @ rot_y(robot.beta[0]),
    )


_SHIFTED = "a", "alpha", "beta"


def _not_first(robot: Robot) -> Reals:
    """A factor for each row: 0 for the first, 1 for the others."""
    return np.where(np.arange(robot.rows) == 0, 0.0, 1.0)
