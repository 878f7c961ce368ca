"""What a path is asked to be, in arrays: joint moves, lines and arcs of the tool, sequences, points of a table.

:func:`er3a.planning.build.build` makes a path of each. SI units; poses are T_base_tool.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from er3a.errors import InputError
from er3a.numerics.arrays import Reals
from er3a.planning.profiles import Ends, Times


@dataclass(frozen=True)
class CommandSource:
    """Where a command was read, for errors: a file and a field in it; neither for one made in Python."""

    file: Path | None = None
    field: str = ""

    def error(self, part: str, problem: str, remedy: str) -> InputError:
        """What is wrong with a part of the command."""
        separator = "." if self.field and not part.startswith("[") else ""
        return InputError(self.file, f"{self.field}{separator}{part}", problem, remedy)


@dataclass(frozen=True, eq=False)
class Start:
    """Where a path starts: at one of joint angles (6,), a pose (4, 4), or the end of an earlier path.

    Attributes
    ----------
    branch : code of the branch to begin on (:mod:`er3a.kinematics.configuration`); only with a pose
    """

    joints: Reals | None = None
    pose: Reals | None = None
    after: str | None = None
    branch: str | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class _Command:
    source: CommandSource = field(default_factory=CommandSource)


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
class JointSequenceCommand(_Command):
    """Joint moves through points (n, 6) in rad.

    Attributes
    ----------
    blend : rad of the joint that turns most, over which each corner is rounded on either side
    ramp : share of the time of each ramp of a trapezoid; None for the quintic
    """

    points: Reals
    blend: float
    duration: float
    ramp: float | None = None


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
class ToolMoveCommand(_Command):
    """One line or arc; ``ramp`` as of :class:`JointSequenceCommand`."""

    start: Start
    segment: SegmentCommand
    duration: float
    ramp: float | None = None


@dataclass(frozen=True, eq=False)
class ToolSequenceCommand(_Command):
    """Lines and arcs one after another; ``ramp`` as of :class:`JointSequenceCommand`."""

    start: Start
    segments: tuple[SegmentCommand, ...]
    duration: float
    ramp: float | None = None


@dataclass(frozen=True, eq=False)
class JointTableCommand(_Command):
    """Through joint angles (n, 6) in rad, none of which repeats the one before.

    Attributes
    ----------
    timing : s in all, or when the points are passed
    blend : rad, over which corners are rounded at most; None for half of the shorter side
    repeated_rows : lines of the table that repeat the point before
    """

    points: Reals
    timing: float | Times
    blend: float | None = None
    repeated_rows: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
class PlanCommand(_Command):
    """A motion to be planned, between joint angles (n,) in rad or poses (4, 4)."""

    start: Reals
    end: Reals


JointCommand = JointMoveCommand | JointSequenceCommand | JointTableCommand
ToolCommand = ToolMoveCommand | ToolSequenceCommand | ToolTableCommand
Command = JointCommand | ToolCommand | PlanCommand
