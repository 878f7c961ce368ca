"""What a path file may hold (YAML, mm, degrees and seconds): data/paths/<robot>.yaml."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, Self, get_args

import numpy as np
from pydantic import Field, model_validator

from er3a.errors import InputError
from er3a.files.path_table import read_path_table
from er3a.files.robot_file import Name, Text
from er3a.files.target_file import Orientation
from er3a.files.units import JointsDeg, PositionMm, Triple, joint_rates, joint_values
from er3a.files.yaml_file import StrictModel, load
from er3a.kinematics.classes.class_solvers import BranchLabel
from er3a.numerics.arrays import Reals
from er3a.planning.commands import (
    Command,
    CommandSource,
    JointMoveCommand,
    JointSequenceCommand,
    JointTableCommand,
    PlanCommand,
    SegmentCommand,
    Start,
    ToolMoveCommand,
    ToolSequenceCommand,
    ToolTableCommand,
)
from er3a.planning.path_verdicts import PathVerdict
from er3a.planning.profiles import Times
from er3a.robots.robot import MOST_JOINTS, Robot
from er3a.robots.shown import joint_columns

TRAPEZOID_RAMP = 1 / 3  # of a motion's time, on the way up and on the way down

Duration = Annotated[float, Field(gt=0, le=3600)]
Samples = Annotated[int, Field(ge=2, le=100_000)]
Rates = Annotated[list[Annotated[float, Field(ge=-1e6, le=1e6)]], Field(min_length=1, max_length=MOST_JOINTS)]
Blend = Annotated[float, Field(ge=0, le=10_000)]


class PoseEntry(Orientation):
    """A pose of the tool in the base frame: position, and one of the forms of orientation."""

    xyz_mm: PositionMm

    @model_validator(mode="after")
    def _one_orientation(self) -> Self:
        self.check_one_form()
        return self

    def pose(self) -> Reals:
        """T_base_tool (4, 4), m."""
        return self.transform_at(np.array(self.xyz_mm) / 1000)


class NamedPath(StrictModel):
    """What every path has.

    ``expect`` is the verdict that is to come out: any other then counts as a fault, and this one does not.
    """

    name: Name
    title: Text
    title_zh: Text | None = None
    samples: Samples
    expect: PathVerdict | None = None


class Profiled(NamedPath):
    """A path that runs from rest to rest, or from halt to halt.

    ``profile`` is the position's law of time; ``ramp_share`` is the share of the time of each ramp of a trapezoid
    (1/3 if left out).
    """

    duration_s: Duration
    profile: Literal["quintic", "trapezoid"] = "quintic"
    ramp_share: Annotated[float, Field(gt=0, le=0.5)] | None = None

    @model_validator(mode="after")
    def _ramp_of_a_trapezoid(self) -> Self:
        if self.ramp_share is not None and self.profile != "trapezoid":
            raise ValueError("ramp_share: a quintic has no ramps | Remove it, or write profile: trapezoid")
        return self

    @property
    def ramp(self) -> float | None:
        """The trapezoid's share of time per ramp; None for the quintic."""
        return (self.ramp_share or TRAPEZOID_RAMP) if self.profile == "trapezoid" else None


class JointPath(NamedPath):
    """A joint move: quintic in time, all joints together; at rest at the ends unless their rates are given.

    It starts at ``start_deg``, or where the arm stands ``after`` an earlier path of the file.
    """

    kind: Literal["joint"]
    start_deg: JointsDeg | None = None
    after: Name | None = None
    end_deg: JointsDeg
    start_velocity_deg_s: Rates | None = None
    end_velocity_deg_s: Rates | None = None
    start_acceleration_deg_s2: Rates | None = None
    end_acceleration_deg_s2: Rates | None = None
    duration_s: Duration

    @model_validator(mode="after")
    def _one_start(self) -> Self:
        if (self.start_deg is None) == (self.after is None):
            raise ValueError("give either start_deg (joint values) or after (an earlier path) | Keep one of the two")
        return self

    def command(self, source: CommandSource, robot: Robot) -> Command:
        """The path in SI units."""
        return JointMoveCommand(
            Start(joints=_joints(robot, self.start_deg, "start_deg"), after=self.after),
            joint_values(robot, self.end_deg, "end_deg"),
            self.duration_s,
            (
                _rates(robot, self.start_velocity_deg_s, "start_velocity_deg_s"),
                _rates(robot, self.end_velocity_deg_s, "end_velocity_deg_s"),
            ),
            (
                _rates(robot, self.start_acceleration_deg_s2, "start_acceleration_deg_s2"),
                _rates(robot, self.end_acceleration_deg_s2, "end_acceleration_deg_s2"),
            ),
            source=source,
        )


class JointSequencePath(Profiled):
    """Joint moves through points, all joints together; each corner rounded over ``blend_deg`` on either side.

    ``blend_deg`` counts in the joint that turns most; with 0 the arm stops at each corner.
    """

    kind: Literal["joint_sequence"]
    points_deg: Annotated[list[JointsDeg], Field(min_length=2)]
    blend_deg: Blend = 0.0

    def command(self, source: CommandSource, robot: Robot) -> Command:
        """The path in SI units."""
        points = [joint_values(robot, row, f"points_deg[{i}]") for i, row in enumerate(self.points_deg)]
        blend = float(np.radians(self.blend_deg))
        return JointSequenceCommand(np.array(points), blend, self.duration_s, self.ramp, source=source)


class ToolStart(Profiled):
    """Where a path of the tool starts: at joint angles, at a pose, or where the arm stands ``after`` an earlier path.

    ``start_branch`` (only with a start pose) fixes the branch to begin on, in the words of the inverse's solutions.
    """

    start_deg: JointsDeg | None = None
    start: PoseEntry | None = None
    after: Name | None = None
    start_branch: Text | None = None

    @model_validator(mode="after")
    def _one_start(self) -> Self:
        if [self.start, self.start_deg, self.after].count(None) != 2:
            ways = "start_deg (joint values) or start (a pose) or after (an earlier path)"
            raise ValueError(f"give either {ways} | Keep one of them")
        if self.start_branch is not None and self.start is None:
            what = "after" if self.after else "start_deg"
            raise ValueError(f"start_branch: {what} already fixes the branch | Remove start_branch")
        return self

    def start_command(self, robot: Robot) -> Start:
        """The start in SI units."""
        pose = self.start.pose() if self.start else None
        return Start(_joints(robot, self.start_deg, "start_deg"), pose, self.after, _branch(self.start_branch))


class LineTo(StrictModel):
    """A straight line to a pose; ``half_turn_axis`` chooses the sense of a rotation by exactly 180 deg."""

    end: PoseEntry
    half_turn_axis: Triple | None = None

    def segment(self) -> SegmentCommand:
        """The segment in SI units."""
        return SegmentCommand(self.end.pose(), half_turn_axis=_axis(self.half_turn_axis))


class ArcTo(LineTo):
    """A circular arc through a point to a pose."""

    via_mm: PositionMm

    def segment(self) -> SegmentCommand:
        """The segment in SI units."""
        return replace(super().segment(), via=np.array(self.via_mm) / 1000)


class LinePath(ToolStart, LineTo):
    """A straight line of the tool."""

    kind: Literal["line"]

    def command(self, source: CommandSource, robot: Robot) -> Command:
        """The path in SI units."""
        return ToolMoveCommand(self.start_command(robot), self.segment(), self.duration_s, self.ramp, source=source)


class ArcPath(ToolStart, ArcTo):
    """A circular arc of the tool."""

    kind: Literal["arc"]

    def command(self, source: CommandSource, robot: Robot) -> Command:
        """The path in SI units."""
        return ToolMoveCommand(self.start_command(robot), self.segment(), self.duration_s, self.ramp, source=source)


class LineSegment(LineTo):
    """A line of a sequence; ``blend_mm`` rounds the corner at its end over that length on either side."""

    kind: Literal["line"]
    blend_mm: Blend = 0.0


class ArcSegment(ArcTo):
    """An arc of a sequence; ``blend_mm`` rounds the corner at its end over that length on either side."""

    kind: Literal["arc"]
    blend_mm: Blend = 0.0


class SequencePath(ToolStart):
    """Lines and arcs one after another; the tool stops at each corner that is not rounded."""

    kind: Literal["sequence"]
    segments: Annotated[
        list[Annotated[LineSegment | ArcSegment, Field(discriminator="kind")]], Field(min_length=1, max_length=1000)
    ]

    @model_validator(mode="after")
    def _no_corner_at_the_end(self) -> Self:
        if self.segments[-1].blend_mm:
            last = len(self.segments) - 1
            raise ValueError(f"segments[{last}].blend_mm: the last segment has no corner at its end | Remove it")
        return self

    def command(self, source: CommandSource, robot: Robot) -> Command:
        """The path in SI units."""
        segments = tuple(replace(part.segment(), blend=part.blend_mm / 1000) for part in self.segments)
        return ToolSequenceCommand(self.start_command(robot), segments, self.duration_s, self.ramp, source=source)


class TablePath(NamedPath):
    """A path through the rows of a CSV table (:mod:`er3a.files.path_table`).

    ``duration_s`` is for tables without times. Corners are rounded over ``blend_mm`` (``blend_deg`` for joint angles)
    on either side, less where half of a side is shorter; left out, over half of the shorter side.
    """

    kind: Literal["table"]
    file: Text
    duration_s: Duration | None = None
    blend_mm: Blend | None = None
    blend_deg: Blend | None = None
    start_branch: Text | None = None
    half_turn_axis: Triple | None = None

    def command(self, source: CommandSource, robot: Robot) -> Command:
        """The table's points in SI units, without those that repeat the point before.

        Raises
        ------
        InputError
            for a table that can't be read, or does not go with ``duration_s`` and the blends
        """
        table = read_path_table(self.file)
        kept = ~table.repeated
        timing: float | Times
        if table.times is None and self.duration_s is not None:
            timing = self.duration_s
        elif table.times is not None and self.duration_s is None:
            timing = Times(table.times, np.cumsum(kept) - 1)
        elif table.times is None:
            problem, remedy = "missing, and the table has no column t_s", "Give duration_s, or times in the table"
            raise source.error("duration_s", problem, remedy)
        else:
            raise source.error("duration_s", "the table's t_s gives it too", "Remove one of the two")
        repeated = tuple(table.rows[table.repeated].tolist())
        if table.joints is not None:
            if table.sliding != tuple(robot.slides.tolist()):
                columns = ", ".join(joint_columns(robot))
                raise source.error("file", f"its joints are not those of {robot.name}", f"Give the columns {columns}")
            if self.blend_mm is not None:
                raise source.error("blend_mm", "the table holds joint angles", "Write blend_deg")
            blend = None if self.blend_deg is None else float(self.blend_deg * np.radians(1.0))
            return JointTableCommand(table.joints[kept], timing, blend, repeated, source=source)
        assert table.poses is not None
        if self.blend_deg is not None:
            raise source.error("blend_deg", "the table holds poses", "Write blend_mm")
        return ToolTableCommand(
            table.poses[kept],
            tuple(f"row {row} of {table.file}" for row in table.rows[kept]),
            timing,
            blend=None if self.blend_mm is None else self.blend_mm * 1e-3,
            repeated_rows=repeated,
            branch=_branch(self.start_branch),
            half_turn_axis=_axis(self.half_turn_axis),
            source=source,
        )


class PlanEnds(StrictModel):
    """Between what a motion is planned: joint angles, or poses of the tool."""

    from_: Annotated[JointsDeg | PoseEntry, Field(alias="from")]
    to: JointsDeg | PoseEntry


class PlanPath(NamedPath):
    """A motion that the planner finds: from rest to rest, clear of the scene and of the arm itself."""

    kind: Literal["plan"]
    plan: PlanEnds

    def command(self, source: CommandSource, robot: Robot) -> Command:
        """What is to be planned."""
        start, end = (
            part.pose() if isinstance(part, PoseEntry) else joint_values(robot, part, f"plan.{key}")
            for key, part in (("from", self.plan.from_), ("to", self.plan.to))
        )
        return PlanCommand(start, end, source=source)


class ProgramPath(NamedPath):
    """A robot program: a path for each stretch of joint moves, and each stretch of lines and arcs."""

    kind: Literal["program"]
    program: Text
    start_deg: JointsDeg | None = None


PathEntry = PlanPath | JointPath | JointSequencePath | LinePath | ArcPath | SequencePath | TablePath


class PathFile(StrictModel):
    """A list of named paths."""

    kind: Literal["paths"]
    paths: Annotated[list[Annotated[PathEntry | ProgramPath, Field(discriminator="kind")]], Field(min_length=1)]

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [entry.name for entry in self.paths]
        for i, name in enumerate(names):
            if name in names[:i]:
                raise ValueError(f"paths[{i}].name: '{name}' names an earlier path too | Give each path its own name")
            after = getattr(self.paths[i], "after", None)
            if after and after not in names[:i]:
                raise ValueError(f"paths[{i}].after: no earlier path is named '{after}' | Name one that stands above")
        return self


def load_paths(path: str | Path) -> PathFile:
    """Read and check a path file.

    Raises
    ------
    InputError
        naming file, field and remedy
    """
    try:
        return load(PathFile, path)
    except InputError as error:
        kinds = "joint_sequence|joint|line|arc|sequence|table|plan|program"
        field = error.field and re.sub(rf"((?:paths|segments)\[\d+\])\.(?:{kinds})\b", r"\1", error.field)
        raise InputError(error.file, field, error.problem, error.remedy) from None


def _joints(robot: Robot, values: list[float] | None, field: str) -> Reals | None:
    return None if values is None else joint_values(robot, values, field)


def _axis(axis: list[float] | None) -> Reals | None:
    return None if axis is None else np.array(axis)


def _branch(words: str | None) -> str | None:
    """The code of a branch: "front, elbow up, flip" is front_elbow_up_flip; other words stay as they are."""
    code = re.sub(r"[ ,]+", "_", words or "")
    return code if code in get_args(BranchLabel) else words


def _rates(robot: Robot, values: list[float] | None, field: str) -> Reals | float:
    return 0.0 if values is None else joint_rates(robot, values, field)
