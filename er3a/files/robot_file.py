"""What a robot file may hold (YAML, mm and degrees), and the checks that need only the file itself."""

from __future__ import annotations

import math
from collections.abc import Collection
from pathlib import PurePosixPath
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, field_validator, model_validator

from er3a.files.units import FARTHEST_MM, MOST_DEG, Triple
from er3a.files.yaml_file import StrictModel
from er3a.robots.robot import Grade, PairRule

NAME_PATTERN = r"^[a-z0-9][a-z0-9_-]{0,63}$"
SHORTEST_PLAIN_LENGTH_MM = 2.0
LONGEST_LENGTH_MM = 20_000.0
FASTEST_DEG_S = 36_000.0

Text = Annotated[str, Field(min_length=1, max_length=2000)]
Name = Annotated[str, Field(pattern=NAME_PATTERN)]
JointNumber = Annotated[int, Field(ge=1, le=6)]


def _inside_the_study(value: str) -> str:
    path = PurePosixPath(value)
    if path.is_absolute() or ".." in path.parts:
        raise ValueError(f"'{value}' lies outside the study | Give a path below the folder that the study is run in")
    return value


PiecesPath = Annotated[Text, AfterValidator(_inside_the_study)]
"""A file that ``er3a mesh`` wrote, below the folder that the study is run in."""


class Sourced(StrictModel):
    """A group of values with its source and grade; ``origin``: its document, by its name in the reference sets."""

    source: Text
    grade: Grade
    origin: Name | None = None


class OfOneJoint(StrictModel):
    """A row; ``origin``: its document, if that is another one than the group's."""

    joint: JointNumber
    origin: Name | None = None


class DhRow(OfOneJoint):
    """One row; ``beta_deg`` is Hayati's turn about y, in calibrated tables of arms with parallel axes."""

    a_mm: float
    alpha_deg: float
    d_mm: float
    beta_deg: float | None = None


def _sign(value: int) -> int:
    # A Literal[1, -1] would let `true` pass, which equals 1.
    if value not in (1, -1):
        raise ValueError(f"{value} is no direction | Write 1 or -1")
    return value


class ZeroRow(OfOneJoint):
    """``direction_origin``: the direction's document, if that is another one than the offset's."""

    direction: Annotated[int, AfterValidator(_sign), Field(json_schema_extra={"enum": [1, -1]})]
    offset_deg: float
    direction_origin: Name | None = None


class JointLimitRow(OfOneJoint):
    lower_deg: float
    upper_deg: float


class JointSpeedRow(OfOneJoint):
    speed_deg_s: Annotated[float, Field(gt=0, le=FASTEST_DEG_S)]


class DhTable(Sourced):
    """Denavit-Hartenberg rows. ``calibrated: true`` admits lengths below 2 mm, which otherwise count as metres."""

    convention: Literal["standard", "modified"]
    calibrated: bool = False
    rows: list[DhRow]


class Zero(Sourced):
    """theta = direction * q + offset, per joint."""

    rows: list[ZeroRow]


class Limits(Sourced):
    rows: list[JointLimitRow]


class Speeds(Sourced):
    rows: list[JointSpeedRow]


class Placement(StrictModel):
    """A rigid transform: position, and roll-pitch-yaw with R = Rz(yaw) Ry(pitch) Rx(roll)."""

    xyz_mm: Triple = [0.0, 0.0, 0.0]
    rpy_deg: Triple = [0.0, 0.0, 0.0]


class SourcedPlacement(Placement, Sourced):
    pass


class Capsule(StrictModel):
    """All points within ``radius_mm`` of the line between two points, in the frame that turns with joint ``link``."""

    link: Annotated[int, Field(ge=0, le=6)]
    from_mm: Triple
    to_mm: Triple
    radius_mm: Annotated[float, Field(ge=SHORTEST_PLAIN_LENGTH_MM, le=LONGEST_LENGTH_MM)]

    @field_validator("from_mm", "to_mm")
    @classmethod
    def _plain_lengths(cls, values):
        if 0 < max(map(abs, values)) < SHORTEST_PLAIN_LENGTH_MM:
            raise ValueError(f"{values} mm can only be metres | Multiply by 1000")
        if max(map(abs, values)) > LONGEST_LENGTH_MM:
            raise ValueError(f"{values} mm is longer than any robot's link | Write the point in mm")
        return values


class LinkPieces(StrictModel):
    """Convex pieces of a mesh (``pieces``: a file written by ``er3a mesh``), placed in the frame of joint ``link``."""

    link: Annotated[int, Field(ge=0)]
    pieces: PiecesPath
    xyz_mm: Triple = [0.0, 0.0, 0.0]
    rpy_deg: Triple = [0.0, 0.0, 0.0]


class LinkHull(StrictModel):
    """The hull of points, taken larger by ``margin_mm``, in the frame that turns with joint ``link``."""

    link: Annotated[int, Field(ge=0)]
    margin_mm: Annotated[float, Field(ge=0, le=LONGEST_LENGTH_MM)] = 0.0
    points_mm: Annotated[list[Triple], Field(min_length=4, max_length=1000)]


class Envelopes(Sourced):
    """Capsules around links and tool, and convex pieces of their shapes, for clearance."""

    capsules: Annotated[list[Capsule], Field(max_length=100)] = []
    meshes: Annotated[list[LinkPieces], Field(max_length=100)] = []
    hulls: Annotated[list[LinkHull], Field(max_length=1000)] = []

    @model_validator(mode="after")
    def _holds_a_shape(self):
        if not (self.capsules or self.meshes or self.hulls):
            raise ValueError("no shapes | Write capsules, meshes or hulls, or leave envelopes out")
        return self


class DecidedPair(StrictModel):
    """Two bodies by name (``base``, ``link_1`` ..., in a scene also solids and what is carried), and why."""

    pair: Annotated[list[Name], Field(min_length=2, max_length=2)]
    reason: Text


class CollisionPairs(StrictModel):
    """Pairs that are not looked at (``allow``), or looked at as a whole (``watch``), whatever the matrix finds."""

    allow: list[DecidedPair] = []
    watch: list[DecidedPair] = []

    def rules(self) -> tuple[PairRule, ...]:
        """As the library takes them."""
        return (
            *(PairRule(entry.pair[0], entry.pair[1], "allow", entry.reason) for entry in self.allow),
            *(PairRule(entry.pair[0], entry.pair[1], "watch", entry.reason) for entry in self.watch),
        )

    def check(self, known: Collection[str]) -> None:
        """Refuse names that there are not, and a pair that is decided twice: ``ValueError``."""
        seen: set[frozenset[str]] = set()
        for key in ("allow", "watch"):
            for i, entry in enumerate(getattr(self, key)):
                where, pair = f"{key}[{i}].pair", frozenset(entry.pair)
                for name in entry.pair:
                    if name not in known:
                        raise ValueError(f"{where}: there is no '{name}' | Known: {', '.join(sorted(known))}")
                if len(pair) == 1 or pair in seen:
                    problem = "is decided twice" if pair in seen else "is one body with itself"
                    raise ValueError(f"{where}: the pair {' and '.join(entry.pair)} {problem} | Remove it")
                seen.add(pair)


class RobotFile(StrictModel):
    """A robot file: data/robots/NAME.yaml."""

    kind: Literal["robot"]
    name: Name
    title: Text
    title_zh: Text | None = None
    zero_pose: Text
    references: list[Name] = []
    dh: DhTable
    zero: Zero
    limits: Limits
    speeds: Speeds | None = None
    base: SourcedPlacement | None = None
    tool: SourcedPlacement | None = None
    envelopes: Envelopes | None = None
    collision: CollisionPairs | None = None

    @model_validator(mode="before")
    @classmethod
    def _a_six_joint_arm(cls, content: Any) -> Any:
        groups = [content.get(group) for group in ("dh", "zero", "limits")] if isinstance(content, dict) else []
        rows = [group["rows"] for group in groups if isinstance(group, dict) and isinstance(group.get("rows"), list)]
        counts = {len(each) for each in rows}
        if len(rows) == 3 and len(counts) == 1 and counts != {6}:
            problem = f"dh.rows: a table of {counts.pop()} joints"
            raise ValueError(f"{problem} | er3a models arms with exactly six revolute joints in series")
        return content

    @model_validator(mode="after")
    def _six_joints_in_order(self):
        for group in ("dh", "zero", "limits", "speeds"):
            table = getattr(self, group)
            if table is None:
                continue
            joints = [row.joint for row in table.rows]
            if joints != [1, 2, 3, 4, 5, 6]:
                missing = [joint for joint in range(1, 7) if joint not in joints]
                what = f"joint {missing[0]} is missing" if missing else f"the joints come as {joints}"
                raise ValueError(f"{group}.rows: {what} | Write one row for each joint, 1 to 6 in order")
        return self

    @model_validator(mode="after")
    def _links_there_are(self):
        count = len(self.dh.rows)
        for key in ("meshes", "hulls"):
            for i, shape in enumerate(getattr(self.envelopes, key) if self.envelopes else []):
                if shape.link > count:
                    raise ValueError(f"envelopes.{key}[{i}].link: the arm has no link {shape.link} | 0 to {count}")
        if self.collision:
            try:
                self.collision.check({"base", *(f"link_{k}" for k in range(1, count + 1))})
            except ValueError as error:
                raise ValueError(f"collision.{error}") from None
        return self

    @model_validator(mode="after")
    def _units_plausible(self):
        for i, row in enumerate(self.dh.rows):
            for key in ("a_mm", "d_mm"):
                _check_length(f"dh.rows[{i}].{key}", getattr(row, key), self.dh.calibrated)
            _check_angle(f"dh.rows[{i}].alpha_deg", row.alpha_deg)
            _check_angle(f"dh.rows[{i}].beta_deg", row.beta_deg or 0.0)
            if row.beta_deg and not self.dh.calibrated:
                problem = f"dh.rows[{i}].beta_deg: {row.beta_deg:g} deg in a table that is not calibrated"
                raise ValueError(f"{problem} | Set dh.calibrated: true, or remove it")
            _check_angle(f"zero.rows[{i}].offset_deg", self.zero.rows[i].offset_deg)
        check_placement("base", self.base)
        check_placement("tool", self.tool)
        longest = max(max(abs(row.a_mm), abs(row.d_mm)) for row in self.dh.rows)
        if longest < 10:
            raise ValueError(
                f"dh.rows: the longest length is {longest:g} mm, which can only be metres | Multiply by 1000"
            )
        return self

    @model_validator(mode="after")
    def _limits_plausible(self):
        for i, row in enumerate(self.limits.rows):
            if row.lower_deg > row.upper_deg:
                raise ValueError(
                    f"limits.rows[{i}]: joint {row.joint} has lower_deg {row.lower_deg:g} above "
                    f"upper_deg {row.upper_deg:g} | Swap them"
                )
            if max(abs(row.lower_deg), abs(row.upper_deg)) > MOST_DEG:
                raise ValueError(f"limits.rows[{i}]: joint {row.joint} turns more than ten times | Check the value")
        widest = max(max(abs(row.lower_deg), abs(row.upper_deg)) for row in self.limits.rows)
        if 0 < widest <= 2.01 * math.pi:
            raise ValueError(
                f"limits.rows: the widest limit is {widest:g} deg, which can only be radians | Convert them to degrees"
            )
        return self


def check_placement(field: str, placement: Placement | None) -> None:
    """Refuse a placement that can only be in metres or radians: ``ValueError`` with ``field: problem | remedy``."""
    if placement is None:
        return
    if 0 < max(abs(value) for value in placement.xyz_mm) < SHORTEST_PLAIN_LENGTH_MM:
        raise ValueError(f"{field}.xyz_mm: {placement.xyz_mm} can only be metres | Multiply by 1000")
    if max(abs(value) for value in placement.xyz_mm) > FARTHEST_MM:
        raise ValueError(f"{field}.xyz_mm: {placement.xyz_mm} is more than 100 m | Write mm, not micrometres")
    for i, value in enumerate(placement.rpy_deg):
        _check_angle(f"{field}.rpy_deg[{i}]", value)


def _check_length(field: str, value: float, calibrated: bool) -> None:
    if abs(value) > LONGEST_LENGTH_MM:
        raise ValueError(f"{field}: {value:g} mm is longer than any robot's link | Write the length in mm")
    if 0 < abs(value) < SHORTEST_PLAIN_LENGTH_MM and not calibrated:
        raise ValueError(
            f"{field}: {value:g} mm looks like metres | Write {value * 1000:g}; if so short a length is meant "
            "(a calibrated table), set dh.calibrated: true"
        )


def _check_angle(field: str, value: float) -> None:
    if abs(value) > MOST_DEG:
        raise ValueError(f"{field}: {value:g} deg is more than ten turns | Write degrees within +-{MOST_DEG:g}")
    quarter = value / (math.pi / 2)
    if 0 < abs(value) < 6.3 and round(quarter) and abs(value - round(quarter) * math.pi / 2) < 2e-3:
        raise ValueError(f"{field}: {value:g} deg looks like radians | Write {round(quarter) * 90:g}")
