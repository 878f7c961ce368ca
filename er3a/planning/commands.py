"""Descriptions of paths, as arrays: joint moves, lines and arcs of the tool, sequences, points of a table.

:func:`build` turns each into a joint move or a tool path. SI units; poses are T_base_tool.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import assert_never

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.errors import InputError, PathError, PoseError
from er3a.kinematics.forward import forward
from er3a.kinematics.solutions import branch_labels
from er3a.numerics.arrays import Reals
from er3a.planning.moves import JointMove, Segment, ToolPath, line, rotation_between
from er3a.planning.profiles import Ends, LegTimes, Times
from er3a.planning.sequences import TURN_LENGTH, JointSequence, arc, joint_sequence, segment_path
from er3a.planning.stated_rates import StatedMotion, StatedRates, stated_motion
from er3a.robots.robot import Robot


@frozen
class CommandSource:
    """Where a command was read, for errors: a file and a field in it; neither for one made in Python."""

    file: Path | None = None
    field: str = ""

    def error(self, part: str, problem: str, remedy: str) -> InputError:
        """An input error that names the file and field in which the command was read.

        Parameters
        ----------
        part : field within the command, such as ``"via"`` or ``"[3]"``
        problem, remedy : what is wrong with it, and what the user can do

        Returns
        -------
        error : to be raised by the caller
        """
        separator = "." if self.field and not part.startswith("[") else ""
        return InputError(self.file, f"{self.field}{separator}{part}", problem, remedy)


@by_identity
class Start:
    """Where a path starts: at one of joint angles (6,), a pose (4, 4), or the end of an earlier path.

    Attributes
    ----------
    branch : code of the branch to begin on (:mod:`er3a.kinematics.solutions`); only with a pose
    """

    joints: Reals | None = None
    pose: Reals | None = None
    after: str | None = None
    branch: str | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class _Command:
    source: CommandSource = field(default_factory=CommandSource)


@by_identity
class JointMoveCommand(_Command):
    """All joints together to angles (6,) in rad, in so many seconds.

    Attributes
    ----------
    velocities, accelerations : at start and end, (6,) in rad/s and rad/s^2, or 0
    """

    start: Start
    end: Reals
    duration: float
    velocities: Ends = (0.0, 0.0)
    accelerations: Ends = (0.0, 0.0)


@by_identity
class JointSequenceCommand(_Command):
    """Joint moves through points (n, 6) in rad.

    Attributes
    ----------
    blend : rad of the joint that turns most, over which each corner is rounded on either side
    duration : s in all, shared out by size between stops; or of each move
    ramp : of the former, share of the time of each ramp of a trapezoid; None for the quintic
    """

    points: Reals
    blend: float
    duration: float | LegTimes
    ramp: float | None = None


@by_identity
class SegmentCommand:
    """A line of the tool to a pose (4, 4), or an arc through ``via`` (3,) in m.

    Attributes
    ----------
    half_turn_axis : (3,), base frame, chooses the sense of a rotation by exactly half a turn
    blend : m, over which the corner at its end is rounded on either side
    """

    end: Reals
    via: Reals | None = None
    half_turn_axis: Reals | None = None
    blend: float = 0.0


@by_identity
class ToolMoveCommand(_Command):
    """One line or arc; ``ramp`` as of :class:`JointSequenceCommand`."""

    start: Start
    segment: SegmentCommand
    duration: float
    ramp: float | None = None


@by_identity
class ToolSequenceCommand(_Command):
    """Lines and arcs one after another; ``duration`` and ``ramp`` as of :class:`JointSequenceCommand`."""

    start: Start
    segments: tuple[SegmentCommand, ...]
    duration: float | LegTimes
    ramp: float | None = None


@by_identity
class JointTableCommand(_Command):
    """Through joint angles (n, 6) in rad, none of which repeats the one before.

    Attributes
    ----------
    timing : s in all, or when the points are passed
    blend : rad, over which corners are rounded at most; None for half of the shorter side
    repeated_rows : lines of the table that repeat the point before
    rates : what the points state beside their times, for a motion through them all; None to round corners
    """

    points: Reals
    timing: float | Times
    blend: float | None = None
    repeated_rows: tuple[int, ...] = ()
    rates: StatedRates | None = None


@by_identity
class ToolTableCommand(_Command):
    """Through poses (n, 4, 4); the rest as of :class:`JointTableCommand`, with ``blend`` in m.

    Attributes
    ----------
    names : what the points are called in errors
    """

    poses: Reals
    names: tuple[str, ...]
    timing: float | Times
    blend: float | None = None
    repeated_rows: tuple[int, ...] = ()
    branch: str | None = None
    half_turn_axis: Reals | None = None


@by_identity
class PlanCommand(_Command):
    """A motion to be planned, between joint angles (n,) in rad or poses (4, 4)."""

    start: Reals
    end: Reals


JointCommand = JointMoveCommand | JointSequenceCommand | JointTableCommand
ToolCommand = ToolMoveCommand | ToolSequenceCommand | ToolTableCommand
Command = JointCommand | ToolCommand | PlanCommand


GEOMETRY = 1.0  # s; a segment's own duration is of no account in a sequence


@by_identity
class Built:
    """A path, ready to be carried out; of a motion that is planned neither ``joints`` nor ``tool``.

    Attributes
    ----------
    joints : the move, for paths in joint space; else None
    tool : the path of the tool; None for paths in joint space
    q_start : (6,), rad, joints at the start, where they are given
    start_slot : closed-form branch (0..7) to begin on, where one is named
    repeated_rows : lines of the table that repeat the point before
    unasked : whether corners are rounded as nobody asked for: over half of the shorter side
    turns_open : numbers of segments that turn the tool by half a turn, and nobody said which way
    """

    joints: JointMove | JointSequence | StatedMotion | None = None
    tool: ToolPath | None = None
    q_start: Reals | None = None
    start_slot: int | None = None
    repeated_rows: tuple[int, ...] = ()
    unasked: bool = False
    turns_open: tuple[int, ...] = ()

    @property
    def duration(self) -> float:
        """Duration, s."""
        move = self.joints or self.tool
        assert move is not None
        return move.duration


def build(robot: Robot, command: Command, ends: Mapping[str, Reals]) -> Built:
    """Make a path of a command.

    Parameters
    ----------
    ends : joint angles (6,) in rad at the end of each earlier path, NaN where it is not reached

    Returns
    -------
    built : a joint move or a tool path, with what it starts from

    Raises
    ------
    InputError
        for a start branch that this robot lacks, a half-turn axis that can't choose, points that fix no circle, a
        corner that can't be rounded so far, an earlier path without end
    """
    match command:
        case JointMoveCommand():
            return _joint_move(command, ends)
        case JointSequenceCommand():
            return _joint_sequence(command)
        case ToolMoveCommand() | ToolSequenceCommand():
            return _tool(robot, command, ends)
        case JointTableCommand():
            if command.rates is not None and isinstance(command.timing, Times):
                return Built(joints=stated_motion(command.timing.times, command.points, command.rates))
            sizes = np.abs(np.diff(command.points, axis=0)).max(axis=1)
            joints = joint_sequence(command.points, _blends(sizes, command.blend), command.timing)
            return Built(joints=joints, repeated_rows=command.repeated_rows, unasked=command.blend is None)
        case ToolTableCommand():
            return _tool_table(robot, command)
        case PlanCommand():
            raise command.source.error("plan", "a motion is planned in a scene", "Run the trajectory stage")
    assert_never(command)


def _joint_move(command: JointMoveCommand, ends: Mapping[str, Reals]) -> Built:
    start = _start_joints(command.start, command.source, ends)
    if start is None:
        raise command.source.error("start", "a joint move starts at joint angles", "Give them, or an earlier path")
    return Built(joints=JointMove(start, command.end, command.duration, command.velocities, command.accelerations))


def _joint_sequence(command: JointSequenceCommand) -> Built:
    blends = np.full(len(command.points) - 2, command.blend)
    try:
        return Built(joints=joint_sequence(command.points, blends, command.duration, command.ramp))
    except PathError as error:
        part = f"points_deg[{error.segment}]"
        problem = f"its way there {error.problem}"
        raise command.source.error(part, problem, "Correct the point or blend_deg") from None


def _start_joints(start: Start, source: CommandSource, ends: Mapping[str, Reals]) -> Reals | None:
    """Joint angles (6,) at the start in rad, where they are given or those of the path before."""
    if start.after is None:
        return start.joints
    if np.isnan(ends[start.after]).any():
        remedy = "Correct that path, or start from a pose"
        raise source.error("after", f"the path '{start.after}' does not reach its end", remedy)
    return ends[start.after]


def _tool(robot: Robot, command: ToolMoveCommand | ToolSequenceCommand, ends: Mapping[str, Reals]) -> Built:
    source = command.source
    q_start = _start_joints(command.start, source, ends)
    pose = command.start.pose if q_start is None else forward(robot, q_start)
    if pose is None:
        raise source.error("start", "a path of the tool starts somewhere", "Give joint angles, a pose or a path before")
    slot = _slot(robot, command.start.branch, source)
    if isinstance(command, ToolMoveCommand):
        only = _segment(pose, command.segment, command.duration, command.ramp, source)
        return Built(tool=only, q_start=q_start, start_slot=slot, turns_open=_turns_open([only], [command.segment]))
    segments: list[Segment] = []
    for k, part in enumerate(command.segments):
        here = CommandSource(source.file, f"{source.field}.segments[{k}]")
        segments.append(_segment(pose, part, GEOMETRY, None, here))
        pose = part.end
    blends = np.array([part.blend for part in command.segments[:-1]])
    try:
        path: ToolPath = segment_path(segments, blends, command.duration, command.ramp)
    except PathError as error:
        part_name = f"segments[{error.segment - 1}]"
        raise source.error(part_name, f"the segment {error.problem}", "Correct its end or blend_mm") from None
    return Built(tool=path, q_start=q_start, start_slot=slot, turns_open=_turns_open(segments, command.segments))


def _turns_open(segments: Sequence[Segment], parts: Sequence[SegmentCommand | ToolTableCommand]) -> tuple[int, ...]:
    """The numbers of segments that turn by half a turn, of which the commands do not say which way."""
    pairs = enumerate(zip(segments, parts), 1)
    return tuple(k for k, (segment, part) in pairs if segment.half_turn and part.half_turn_axis is None)


def _segment(
    T_start: Reals, part: SegmentCommand, duration: float, ramp: float | None, source: CommandSource
) -> Segment:
    try:
        rotation_between(T_start, part.end, part.half_turn_axis)
    except PoseError as error:
        raise source.error("half_turn_axis", str(error), "Remove it, or name the turn's axis") from None
    if part.via is None:
        return line(T_start, part.end, duration, part.half_turn_axis, ramp)
    try:
        return arc(T_start, part.via, part.end, duration, part.half_turn_axis, ramp)
    except PoseError as error:
        raise source.error("via_mm", str(error), "Give three points that fix a circle") from None


def _tool_table(robot: Robot, command: ToolTableCommand) -> Built:
    segments = _lines(command)
    sizes = np.array([max(part.length, part.turned * TURN_LENGTH) for part in segments])
    path = segment_path(segments, _blends(sizes, command.blend), command.timing)
    slot = _slot(robot, command.branch, command.source)
    return Built(
        tool=path,
        start_slot=slot,
        repeated_rows=command.repeated_rows,
        unasked=command.blend is None,
        turns_open=_turns_open(segments, [command] * len(segments)),
    )


def _lines(command: ToolTableCommand) -> list[Segment]:
    """Lines from point to point; the half-turn axis is for those that turn by half a turn."""
    axis, source = command.half_turn_axis, command.source
    segments: list[Segment] = []
    for name, (a, b) in zip(command.names[1:], pairwise(command.poses)):
        part = line(a, b, GEOMETRY)
        if part.half_turn and axis is not None:
            try:
                part = line(a, b, GEOMETRY, axis)
            except PoseError as error:
                problem = f"on the way to {name}, {error}"
                raise source.error("half_turn_axis", problem, "Name the turn's axis") from None
        segments.append(part)
    if axis is not None and not any(part.half_turn for part in segments):
        raise source.error("half_turn_axis", "nothing in the table turns by 180 deg", "Remove it")
    return segments


def _blends(sizes: Reals, wanted: float | None) -> Reals:
    most: Reals = np.minimum(sizes[:-1], sizes[1:]) / 2
    return most if wanted is None else np.minimum(most, wanted)


def _slot(robot: Robot, name: str | None, source: CommandSource) -> int | None:
    if name is None:
        return None
    labels: tuple[str, ...] = branch_labels(robot)
    if name not in labels:
        raise source.error("start_branch", f"this robot has no branch '{name}'", f"Known: {'; '.join(labels)}")
    return labels.index(name)
