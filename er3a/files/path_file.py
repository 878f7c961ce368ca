"""Path files (YAML, mm, degrees and seconds): data/paths/<robot>.yaml.

Paths as CSV tables, one point per row: of the tool, or of the joints; with or without times.

Columns of the tool: ``x_mm``, ``y_mm``, ``z_mm`` and those of one form of orientation
(:data:`er3a.files.target_file.FORMS`). Columns of the joints: ``q1_deg`` .. ``qn_deg``, or ``q3_mm`` for a prismatic
joint. Both may have ``t_s``, which starts at 0 and rises, and ``units_checked``, with yes in each row where small
angles are degrees although they look like radians. A row that repeats the point before is a stop if the table
has times; otherwise it is left out.

A joint trajectory of ROS or MoveIt (``trajectory_msgs/JointTrajectory``, or ``moveit_msgs/RobotTrajectory`` around it)
as YAML or JSON is a timed table of joints. Only positions and times of its points are used; the number in a joint's
name is its place (Universal Robots: ``shoulder_pan_joint`` to ``wrist_3_joint``). Keys that these messages do not have
are refused.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self, get_args

import numpy as np
import scipy
from pydantic import BeforeValidator, Field, model_validator

from er3a.by_value import by_identity
from er3a.errors import InputError
from er3a.files.csv_file import (
    CHECKED_COLUMN,
    METRES,
    UNITS_CHECKED,
    CsvColumn,
    CsvRows,
    is_own,
    read_csv,
    read_header,
    refuse_unit,
)
from er3a.files.kept_files import own_or_shipped
from er3a.files.orientations import FORMS, POSITION, form_in, poses_of
from er3a.files.robot_file import Name, Text
from er3a.files.target_file import KNOWN_FORMS, PoseEntry
from er3a.files.units import (
    JointsDeg,
    PositionMm,
    Triple,
    check_degrees,
    doubt_degrees,
    joint_names,
    joint_rates,
    joint_values,
)
from er3a.files.yaml_file import InputFile, StrictModel, check_own_names, load, parse, read_yaml
from er3a.kinematics.classes.class_solvers import BranchLabel
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.planning import commands
from er3a.planning.names import PathVerdict
from er3a.planning.profiles import Times
from er3a.planning.stated_rates import StatedRates
from er3a.robots.joint_limits import joint_columns
from er3a.robots.robot import MAX_JOINTS, Robot

LONGEST_S = 3600.0
MAX_ROWS = 200_000
SAME_POINT = 1e-9  # m or rad
MAX_RAD = 10 * 2 * math.pi
TRAJECTORIES = (".yaml", ".yml", ".json")  # endings of joint trajectories of ROS and MoveIt
UR_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")


@by_identity
class PathTable:
    """The points of a table.

    Attributes
    ----------
    rows : (n,) int, lines of the file
    times : (n,), s, rising from 0; None for a table without
    poses : (n, 4, 4), T_base_tool; None for a table of joints
    joints : (n, joints), rad or m; None for a table of the tool
    sliding : for a table of joints, which of them are in mm; None if the units are not stated, as in ROS
    repeated : (n,) bool, whether a row repeats the point before
    rates : what a ROS trajectory states at its points beside joints and times; None for other tables
    """

    file: Path
    rows: Integers
    times: Reals | None
    poses: Reals | None
    joints: Reals | None
    repeated: Flags
    sliding: tuple[bool, ...] | None = ()
    rates: StatedRates | None = None


def read_path_table(path: str | Path) -> PathTable:
    """Read a table.

    Raises
    ------
    InputError
        naming row and column: no known columns, too few points, NaN, times that do not rise, wrong units, an invalid
        orientation
    """
    path = own_or_shipped(path)
    if path.suffix in TRAJECTORIES:
        at, values, rates = _ros_trajectory(path)
        _repeated(path, np.abs(np.diff(values, axis=0)).max(axis=1))
        kept = np.zeros(len(values), bool)
        return PathTable(path, np.arange(1, len(values) + 1), at, None, values, kept, None, rates)
    header = set(read_header(path))
    of_pose = {*POSITION, *(name for columns in FORMS.values() for name in columns)}
    beside = header & of_pose if is_own(path) else set()  # where the joints put the tool
    header -= beside
    form = form_in(path, header)
    own = joint_names(path, header)
    of_joints = bool(own)
    if of_joints and (form or header & set(POSITION)):
        raise InputError(path, "header", "the table has both joint angles and poses", "Keep one of the two")
    if not of_joints and not form:
        problem = "no orientation" if header & set(POSITION) else "neither joint angles nor poses"
        remedy = f"Give the columns x_mm, y_mm, z_mm with {KNOWN_FORMS}; or q1_deg .. qn_deg"
        raise InputError(path, "header", f"the table has {problem}", remedy)
    columns = own if of_joints else (*POSITION, *FORMS[str(form)])
    timed = {"t_s": CsvColumn()} if "t_s" in header else {}
    rows = read_csv(path, timed | {name: CsvColumn() for name in (*columns, *sorted(beside))} | CHECKED_COLUMN)
    if len(rows) < 2:
        raise InputError(path, None, "the path has fewer than two points", "Give at least two rows")
    if len(rows) > MAX_ROWS:
        raise InputError(path, None, f"{len(rows)} rows are more than {MAX_ROWS}", "Split the path")
    lines = np.array([row["row"] for row in rows])
    times = np.array([row["t_s"] for row in rows]) if timed else None
    if times is not None:
        _check_times(path, [f"row {line}, column t_s" for line in lines], times)
    if of_joints:
        joints = _row_joints(path, rows, own)
        size, poses = np.abs(np.diff(joints, axis=0)).max(axis=1), None
    else:
        poses, joints = _poses(path, rows, str(form)), None
        turn = scipy.spatial.transform.Rotation.from_matrix(
            np.swapaxes(poses[:-1, :3, :3], -1, -2) @ poses[1:, :3, :3]
        ).magnitude()
        size = np.maximum(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1), turn)
    sliding = tuple(name.endswith("_mm") for name in own)
    return PathTable(path, lines, times, poses, joints, _repeated(path, size), sliding)


def _repeated(path: Path, size: Reals) -> Flags:
    repeated = np.concatenate([[False], size < SAME_POINT])
    if repeated[1:].all():
        raise InputError(path, None, f"all {len(repeated)} points are the same", "Give points that differ")
    return repeated


def is_ros_trajectory(path: Path) -> bool:
    """Whether a YAML or JSON file is meant as a joint trajectory of ROS or MoveIt and not as a file of er3a's own.

    Raises
    ------
    InputError
        if it is no YAML
    """
    content = read_yaml(path)
    return "kind" not in content and not content.keys().isdisjoint({"joint_trajectory", "joint_names", "points"})


class RosTime(StrictModel):
    """Seconds and nanoseconds, as ROS 2 names them or as ROS 1 does."""

    sec: float = 0.0
    nanosec: float = 0.0
    secs: float = 0.0
    nsecs: float = 0.0


def _as_seconds(value: Any) -> Any:
    return {"sec": value} if isinstance(value, int | float) else value


class RosPoint(StrictModel):
    """A point of ``trajectory_msgs/JointTrajectory``; its efforts are not used."""

    positions: list[float]
    velocities: list[float] | None = None
    accelerations: list[float] | None = None
    effort: Any = None
    time_from_start: Annotated[RosTime, BeforeValidator(_as_seconds)]

    @property
    def seconds(self) -> float:
        """Time from the start, s."""
        t = self.time_from_start
        return t.sec + t.secs + (t.nanosec + t.nsecs) * 1e-9


class RosTrajectory(StrictModel):
    """``trajectory_msgs/JointTrajectory``."""

    header: Any = None
    joint_names: Annotated[list[str], Field(min_length=1)]
    points: Annotated[list[RosPoint], Field(min_length=2, max_length=MAX_ROWS)]


class RosRobotTrajectory(StrictModel):
    """``moveit_msgs/RobotTrajectory``: only joints of the arm move."""

    joint_trajectory: RosTrajectory
    multi_dof_joint_trajectory: dict[str, Any] | None = None

    @model_validator(mode="after")
    def _of_the_arm_alone(self) -> Self:
        if (self.multi_dof_joint_trajectory or {}).get("points"):
            problem = "moves more than the arm's joints, which is not followed"
            raise ValueError(f"multi_dof_joint_trajectory: {problem} | Give a trajectory of the arm alone")
        return self


def _ros_trajectory(path: Path) -> tuple[Reals, Reals, StatedRates]:
    """Times (n,) in s, joint values (n, joints) in rad or m, and their rates, of a joint trajectory of ROS."""
    content = read_yaml(path)
    if "joint_trajectory" in content:
        body = parse(RosRobotTrajectory, content, path).joint_trajectory
    else:
        body = parse(RosTrajectory, content, path)
    order, points = _joint_order(path, body.joint_names), body.points
    joints, velocities, accelerations = np.full((3, len(points), len(order)), np.nan)
    for k, point in enumerate(points):
        for rows, key in ((joints, "positions"), (velocities, "velocities"), (accelerations, "accelerations")):
            values = getattr(point, key)
            if key == "positions" or values:
                if len(values) != len(order):
                    where, problem = f"points[{k}].{key}", f"not {len(order)} numbers"
                    raise InputError(path, where, problem, "Give one for each joint")
                rows[k] = values
        if point.accelerations and not point.velocities:
            problem = "accelerations without velocities, between which no controller interpolates"
            raise InputError(path, f"points[{k}].accelerations", problem, "Give velocities too, or leave them out")
    times = np.array([point.seconds for point in points])
    _check_times(path, [f"points[{k}].time_from_start" for k in range(len(points))], times)
    if np.abs(joints).max() > MAX_RAD:
        k = int(np.abs(joints).max(axis=1).argmax())
        problem = f"{np.abs(joints[k]).max():g} rad are more than ten turns"
        raise InputError(path, f"points[{k}].positions", problem, "Write radians, or metres for a prismatic joint")
    return times, joints[:, order], StatedRates(velocities[:, order], accelerations[:, order])


def _joint_order(path: Path, names: list[str]) -> list[int]:
    """Where joints 1 to n stand, by the last numbers in their names, from 1 or 0 on, which one text precedes; those of
    Universal Robots by their words."""
    words = [match for name in names if (match := re.fullmatch(rf"(.*?)({'|'.join(UR_JOINTS)})(?:_joint)?", name))]
    alike = len(words) == len(names) and len({match[1] for match in words}) == 1
    if alike and sorted(match[2] for match in words) == sorted(UR_JOINTS):
        return sorted(range(len(names)), key=lambda k: UR_JOINTS.index(words[k][2]))
    found = [match for name in names if (match := re.fullmatch(r"(.*?)(\d+)\D*", name, re.DOTALL))]
    numbers, stems = [int(match[2]) for match in found], {match[1] for match in found}
    first = min(numbers, default=0)
    if sorted(numbers) != list(range(first, first + len(names))) or first > 1 or len(stems) > 1:
        problem = f"joints can't be identified by {', '.join(names)}"
        raise InputError(path, "joint_names", problem, "Name them joint_1, joint_2 ... from the base on")
    return sorted(range(len(names)), key=numbers.__getitem__)


def _row_joints(path: Path, rows: CsvRows, names: tuple[str, ...]) -> Reals:
    """Joint values (n, joints) in rad, or m of columns in mm."""
    turning = [name for name in names if name.endswith("_deg")]
    values = np.array([[row[name] for name in names] for row in rows])
    if turning:
        _block(path, rows, turning)
    return np.where([name.endswith("_mm") for name in names], values / 1000, np.radians(values))


def _check_times(path: Path, places: Sequence[str], times: Reals) -> None:
    if times[0] != 0:
        raise InputError(path, places[0], f"the path starts at {times[0]:g} s", "Start at 0")
    for i in np.flatnonzero(np.diff(times) <= 0).tolist():
        problem = f"{times[i + 1]:g} s is not later than {times[i]:g} s of the row before"
        raise InputError(path, places[i + 1], problem, "Let the times rise from row to row")
    if times[-1] > LONGEST_S:
        raise InputError(path, places[-1], f"{times[-1]:g} s is too long", "Write seconds, not ms")


def _poses(path: Path, rows: CsvRows, form: str) -> Reals:
    refuse_unit(path, rows, POSITION, METRES)
    if form in ("rpy_deg", "zyz_deg"):
        _block(path, rows, FORMS[form])
    return poses_of(path, rows, form)


def _block(path: Path, rows: CsvRows, names: Sequence[str]) -> None:
    """Judge the unit of columns of angles by the largest row: others may well be small."""
    values = np.array([[row[name] for name in names] for row in rows])
    top = int(np.argmax(np.abs(values).max(axis=1)))
    where, largest = f"row {rows[top]['row']}, column {', '.join(names)}", values[top].tolist()
    try:
        check_degrees(largest)
    except ValueError as error:
        problem, _, remedy = str(error).partition(" | ")
        raise InputError(path, where, problem, remedy) from None
    if not all(row[UNITS_CHECKED] for row in rows):
        doubt_degrees(largest, key=where, file=path)


TRAPEZOID_RAMP = 1 / 3  # of a motion's time, on the way up and on the way down

Duration = Annotated[float, Field(gt=0, le=3600)]
Samples = Annotated[int, Field(ge=2, le=100_000)]
Expected = Annotated[
    list[PathVerdict],
    Field(min_length=1),
    BeforeValidator(
        lambda value: [value] if isinstance(value, str) else value,
        json_schema_input_type=PathVerdict | Annotated[list[PathVerdict], Field(min_length=1)],
    ),
]
"""One verdict, or several that a path comes to at once."""
Rates = Annotated[list[Annotated[float, Field(ge=-1e6, le=1e6)]], Field(min_length=1, max_length=MAX_JOINTS)]
Blend = Annotated[float, Field(ge=0, le=10_000)]


class NamedPath(StrictModel):
    """The keys of every path.

    ``expect`` is the expected verdict: another one is a fault, and the expected one is not. A path that also collides
    is as expected only if both are given (``[leaves limits, collides]``).
    """

    name: Name
    title: Text
    title_zh: Text | None = None
    samples: Samples
    expect: Expected | None = None

    @property
    def expected(self) -> tuple[PathVerdict, ...]:
        """All that is expected of it; empty where nothing is said."""
        return tuple(self.expect or ())


class Profiled(NamedPath):
    """A path from rest to rest, or from stop to stop.

    ``profile`` is the time law of the position; ``ramp_share`` is the share of the time of each ramp of a trapezoid
    (default 1/3).
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
    """A joint move: quintic in time, all joints together; at rest at the ends unless rates are given.

    It starts at ``start_deg``, or where an earlier path of the file ends (``after``).
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

    def command(self, source: commands.CommandSource, robot: Robot) -> commands.Command:
        """The path in SI units.

        Parameters
        ----------
        source : file and field where the path was read, for errors
        robot : its joints, of which some may slide, give the units of values and rates

        Returns
        -------
        command : joints in rad or m, rates in rad/s or m/s, accelerations in rad/s^2 or m/s^2

        Raises
        ------
        InputError
            if values or rates are not as many as the joints
        """
        velocities, accelerations = (
            (_rates(robot, self, f"start_{key}"), _rates(robot, self, f"end_{key}"))
            for key in ("velocity_deg_s", "acceleration_deg_s2")
        )
        start = commands.Start(joints=_joints(robot, self.start_deg, "start_deg"), after=self.after)
        end = joint_values(robot, self.end_deg, "end_deg")
        return commands.JointMoveCommand(start, end, self.duration_s, velocities, accelerations, source=source)


class JointSequencePath(Profiled):
    """Joint moves through points, all joints together; each corner rounded over ``blend_deg`` on either side.

    ``blend_deg`` is measured in the joint that turns most; with 0 the arm stops at each corner.
    """

    kind: Literal["joint_sequence"]
    points_deg: Annotated[list[JointsDeg], Field(min_length=2)]
    blend_deg: Blend = 0.0

    def command(self, source: commands.CommandSource, robot: Robot) -> commands.Command:
        """The path in SI units.

        Parameters
        ----------
        source : file and field where the path was read, for errors
        robot : its joints give the units of the points

        Returns
        -------
        command : points (k, n) in rad or m, blend in rad

        Raises
        ------
        InputError
            if a point has not as many values as the arm has joints
        """
        points = [joint_values(robot, row, f"points_deg[{i}]") for i, row in enumerate(self.points_deg)]
        blend = float(np.radians(self.blend_deg))
        return commands.JointSequenceCommand(np.array(points), blend, self.duration_s, self.ramp, source=source)


class ToolStart(Profiled):
    """The start of a tool path: joint angles, a pose, or where an earlier path ends (``after``).

    ``start_branch`` (only with a start pose) sets the branch at the start, by the name of an inverse solution.
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

    def start_command(self, robot: Robot) -> commands.Start:
        """The start of a tool path in SI units.

        Returns
        -------
        start : joints (n,) in rad or m, or a pose T_base_tool (4, 4) in m, or the name of the path before; and the
            branch's code if one is named

        Raises
        ------
        InputError
            if the joint values are not as many as the robot's
        """
        pose = self.start.pose() if self.start else None
        return commands.Start(_joints(robot, self.start_deg, "start_deg"), pose, self.after, _branch(self.start_branch))


class ToolMove(StrictModel):
    """A straight line to a pose, or a circular arc through a point to it.

    ``half_turn_axis`` chooses the sense of a rotation by exactly 180 deg.
    """

    kind: Literal["line", "arc"]
    end: PoseEntry
    via_mm: PositionMm | None = None
    half_turn_axis: Triple | None = None

    @model_validator(mode="after")
    def _an_arc_has_a_point(self) -> Self:
        if (self.via_mm is None) == (self.kind == "arc"):
            raise ValueError("via_mm: an arc passes a point, and a line none | Add or remove it, or change kind")
        return self

    def segment(self, blend: float = 0.0) -> commands.SegmentCommand:
        """The segment in SI units: its end T_base_tool (4, 4), and the point (3,) that an arc passes, m."""
        via = None if self.via_mm is None else np.array(self.via_mm) / 1000
        return commands.SegmentCommand(self.end.pose(), via, _axis(self.half_turn_axis), blend)


class ToolMovePath(ToolStart, ToolMove):
    """One line or arc of the tool."""

    def command(self, source: commands.CommandSource, robot: Robot) -> commands.Command:
        """One line or arc in SI units.

        Parameters
        ----------
        source : file and field where the path was read, for errors
        robot : needed for a start given by joint values

        Returns
        -------
        command : segment in m, duration in s, and the share of time of each ramp (None for the quintic)
        """
        return commands.ToolMoveCommand(
            self.start_command(robot), self.segment(), self.duration_s, self.ramp, source=source
        )


class SequenceSegment(ToolMove):
    """A line or arc of a sequence; ``blend_mm`` rounds the corner at its end over that length on either side."""

    blend_mm: Blend = 0.0


class SequencePath(ToolStart):
    """Lines and arcs one after another; the tool stops at each corner that is not rounded."""

    kind: Literal["sequence"]
    segments: Annotated[list[SequenceSegment], Field(min_length=1, max_length=1000)]

    @model_validator(mode="after")
    def _no_corner_at_the_end(self) -> Self:
        if self.segments[-1].blend_mm:
            last = len(self.segments) - 1
            raise ValueError(f"segments[{last}].blend_mm: the last segment has no corner at its end | Remove it")
        return self

    def command(self, source: commands.CommandSource, robot: Robot) -> commands.Command:
        """Lines and arcs in SI units.

        Parameters
        ----------
        source : file and field where the path was read, for errors
        robot : needed for a start given by joint values

        Returns
        -------
        command : segments and the blends at their ends in m, the duration of the whole in s
        """
        segments = tuple(part.segment(part.blend_mm / 1000) for part in self.segments)
        return commands.ToolSequenceCommand(
            self.start_command(robot), segments, self.duration_s, self.ramp, source=source
        )


class TablePath(NamedPath):
    """A path through the rows of a CSV table (:mod:`er3a.files.path_file`).

    ``duration_s`` is for tables without times. Corners are rounded over ``blend_mm`` (``blend_deg`` for joint angles)
    on either side, or over half of a side if that is shorter; by default over half of the shorter side.
    """

    kind: Literal["table"]
    file: Text
    duration_s: Duration | None = None
    blend_mm: Blend | None = None
    blend_deg: Blend | None = None
    start_branch: Text | None = None
    half_turn_axis: Triple | None = None

    def table(self, source: commands.CommandSource) -> PathTable:
        """The table as it stands.

        Raises
        ------
        InputError
            for a table that can't be read, or does not go with ``duration_s`` and the blends, whatever the robot
        """
        table = read_path_table(self.file)
        if table.times is None and self.duration_s is None:
            problem, remedy = "missing, and the table has no column t_s", "Give duration_s, or times in the table"
            raise source.error("duration_s", problem, remedy)
        if table.times is not None and self.duration_s is not None:
            raise source.error("duration_s", "the table's t_s gives it too", "Remove one of the two")
        if table.joints is not None and self.blend_mm is not None:
            raise source.error("blend_mm", "the table holds joint angles", "Write blend_deg")
        if table.rates is not None and self.blend_deg is not None:
            raise source.error("blend_deg", "a trajectory of ROS goes through its points", "Remove it")
        if table.joints is None and self.blend_deg is not None:
            raise source.error("blend_deg", "the table holds poses", "Write blend_mm")
        return table

    def command(self, source: commands.CommandSource, robot: Robot) -> commands.Command:
        """The table's points in SI units, without those that repeat the point before.

        Raises
        ------
        InputError
            for a table that can't be read, or does not go with ``duration_s`` and the blends
        """
        table = self.table(source)
        kept = ~table.repeated
        timing: float | Times | None = self.duration_s
        if table.times is not None:
            timing = Times(table.times, np.cumsum(kept) - 1)
        assert timing is not None
        repeated = tuple(table.rows[table.repeated].tolist())
        if table.joints is not None:
            slides = tuple(robot.slides.tolist())
            if len(slides) != table.joints.shape[1] or table.sliding not in (None, slides):
                columns = ", ".join(joint_columns(robot))
                raise source.error("file", f"its joints are not those of {robot.name}", f"Give the columns {columns}")
            blend = None if self.blend_deg is None else float(self.blend_deg * np.radians(1.0))
            return commands.JointTableCommand(table.joints[kept], timing, blend, repeated, table.rates, source=source)
        assert table.poses is not None
        return commands.ToolTableCommand(
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
    """The ends of a planned motion: joint angles, or poses of the tool."""

    from_: Annotated[JointsDeg | PoseEntry, Field(alias="from")]
    to: JointsDeg | PoseEntry


class PlanPath(NamedPath):
    """A planned motion from rest to rest, clear of the scene and of the arm itself."""

    kind: Literal["plan"]
    plan: PlanEnds

    def command(self, source: commands.CommandSource, robot: Robot) -> commands.Command:
        """The ends between which a motion is to be planned, in SI units.

        Parameters
        ----------
        source : file and field where the path was read, for errors
        robot : gives the units of ends that are joint values

        Returns
        -------
        command : each end either joints (n,) in rad or m, or a pose T_base_tool (4, 4) in m

        Raises
        ------
        InputError
            if joint values are not as many as the robot's
        """
        start, end = (
            part.pose() if isinstance(part, PoseEntry) else joint_values(robot, part, f"plan.{key}")
            for key, part in (("from", self.plan.from_), ("to", self.plan.to))
        )
        return commands.PlanCommand(start, end, source=source)


class ProgramPath(NamedPath):
    """A robot program: one path for each stretch of joint moves, and for each stretch of lines and arcs."""

    kind: Literal["program"]
    program: Text
    start_deg: JointsDeg | None = None


PathEntry = PlanPath | JointPath | JointSequencePath | ToolMovePath | SequencePath | TablePath


class PathFile(InputFile):
    """A list of named paths."""

    kind: Literal["paths"]
    paths: Annotated[list[Annotated[PathEntry | ProgramPath, Field(discriminator="kind")]], Field(min_length=1)]

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [entry.name for entry in self.paths]
        check_own_names("paths", names)
        for i, entry in enumerate(self.paths):
            after = getattr(entry, "after", None)
            if after and after not in names[:i]:
                raise ValueError(f"paths[{i}].after: no earlier path is named '{after}' | Name one that is above")
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


def _rates(robot: Robot, path: JointPath, field: str) -> Reals | float:
    values = getattr(path, field)
    return 0.0 if values is None else joint_rates(robot, values, field)
