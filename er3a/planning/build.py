"""From an entry of a path file to a move of the joints or a path of the tool."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from er3a.errors import InputError, PathError, PoseError
from er3a.files.path_file import (
    ArcPath,
    ArcTo,
    JointPath,
    JointSequencePath,
    LinePath,
    LineTo,
    PathEntry,
    PoseEntry,
    SequencePath,
    TablePath,
)
from er3a.files.path_table import PathTable, read_path_table
from er3a.geometry.transforms import transform
from er3a.kinematics.configuration import branch_labels
from er3a.kinematics.forward import forward
from er3a.pipeline.messages.kinematics import BRANCHES
from er3a.planning.arcs import arc
from er3a.planning.moves import JointMove, Line, ToolPath, line, rotation_between
from er3a.planning.sequences import (
    TURN_LENGTH,
    JointSequence,
    Segment,
    Times,
    joint_sequence,
    segment_path,
)
from er3a.robots.robot import Robot

GEOMETRY = 1.0  # s; a segment's own duration is of no account in a sequence


@dataclass(frozen=True, eq=False)
class Built:
    """A path, ready to be carried out.

    Attributes
    ----------
    joints : the move, for paths in joint space; else None
    tool : the path of the tool; None for paths in joint space
    q_start : (6,), rad, joints at the start, where the entry gives them
    start_slot : closed-form branch (0..7) to begin on, where the entry names one
    repeated_rows : lines of the table that repeat the point before
    """

    joints: JointMove | JointSequence | None = None
    tool: ToolPath | None = None
    q_start: np.ndarray | None = None
    start_slot: int | None = None
    repeated_rows: tuple[int, ...] = ()

    @property
    def duration(self) -> float:
        """Duration, s."""
        move = self.joints or self.tool
        return move.duration


def build(robot: Robot, entry: PathEntry, field: str, file: Path, ends: Mapping[str, np.ndarray]) -> Built:
    """Make a path of an entry; ``field`` names it in the file.

    Parameters
    ----------
    ends : joint angles (6,) in rad at the end of each earlier path of the file, NaN where it is not reached

    Raises
    ------
    InputError
        for a start branch that this robot has not, a half-turn axis that can't choose, points that fix no circle, a
        corner that can't be rounded so far, a table that can't be read, an earlier path without end
    """
    q_start = _start(entry, field, file, ends)
    if isinstance(entry, JointPath):
        rates = (
            entry.start_velocity_deg_s,
            entry.end_velocity_deg_s,
            entry.start_acceleration_deg_s2,
            entry.end_acceleration_deg_s2,
        )
        given = (0.0 if rate is None else np.radians(rate) for rate in rates)
        return Built(joints=JointMove(q_start, np.radians(entry.end_deg), entry.duration_s, *given))
    if isinstance(entry, JointSequencePath):
        points = np.radians(entry.points_deg)
        blends = np.full(len(points) - 2, np.radians(entry.blend_deg))
        try:
            return Built(joints=joint_sequence(points, blends, entry.duration_s, entry.ramp))
        except PathError as error:
            where = f"{field}.points_deg[{error.segment}]"
            raise InputError(file, where, f"its way there {error.problem}", "Mend the point or blend_deg") from None
    if isinstance(entry, TablePath):
        return _table(robot, entry, field, file)
    return _tool(robot, entry, q_start, field, file)


def _start(entry: PathEntry, field: str, file: Path, ends: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """Joint angles (6,) at the start in rad, where the entry gives them or names the path before."""
    after = getattr(entry, "after", None)
    if after is not None and np.isnan(ends[after]).any():
        remedy = "Mend that path, or start from a pose"
        raise InputError(file, f"{field}.after", f"the path '{after}' does not reach its end", remedy)
    given = getattr(entry, "start_deg", None)
    return ends[after] if after else None if given is None else np.radians(given)


def _tool(
    robot: Robot, entry: LinePath | ArcPath | SequencePath, q_start: np.ndarray | None, field: str, file: Path
) -> Built:
    T_start = _pose(entry.start) if q_start is None else forward(robot, q_start)
    slot = _slot(robot, entry.start_branch, field, file)
    if not isinstance(entry, SequencePath):
        path: ToolPath = _segment(T_start, entry, entry.duration_s, entry.ramp, field, file)
        return Built(tool=path, q_start=q_start, start_slot=slot)
    segments: list[Segment] = []
    for k, part in enumerate(entry.segments):
        segments.append(_segment(T_start, part, GEOMETRY, None, f"{field}.segments[{k}]", file))
        T_start = _pose(part.end)
    blends = np.array([part.blend_mm for part in entry.segments[:-1]]) / 1000
    try:
        path = segment_path(segments, blends, entry.duration_s, entry.ramp)
    except PathError as error:
        where = f"{field}.segments[{error.segment - 1}]"
        raise InputError(file, where, f"the segment {error.problem}", "Mend its end or blend_mm") from None
    return Built(tool=path, q_start=q_start, start_slot=slot)


def _segment(T_start: np.ndarray, part: LineTo, duration: float, ramp: float | None, field: str, file: Path) -> Segment:
    axis = None if part.half_turn_axis is None else np.array(part.half_turn_axis)
    T_end = _pose(part.end)
    try:
        rotation_between(T_start, T_end, axis)
    except PoseError as error:
        raise InputError(file, f"{field}.half_turn_axis", str(error), "Remove it, or name the turn's axis") from None
    if not isinstance(part, ArcTo):
        return line(T_start, T_end, duration, axis, ramp)
    try:
        return arc(T_start, np.array(part.via_mm) / 1000, T_end, duration, axis, ramp)
    except PoseError as error:
        raise InputError(file, f"{field}.via_mm", str(error), "Give three points that fix a circle") from None


def _table(robot: Robot, entry: TablePath, field: str, file: Path) -> Built:
    table = read_path_table(entry.file)
    if (table.times is None) == (entry.duration_s is None):
        problem = "missing, and the table has no column t_s" if table.times is None else "the table's t_s gives it too"
        remedy = "Give duration_s, or times in the table" if table.times is None else "Remove one of the two"
        raise InputError(file, f"{field}.duration_s", problem, remedy)
    wrong = "blend_mm" if table.poses is None else "blend_deg"
    if getattr(entry, wrong) is not None:
        what = "joint angles" if table.poses is None else "poses"
        raise InputError(file, f"{field}.{wrong}", f"the table holds {what}", f"Write {_other(wrong)}")
    kept = np.flatnonzero(~table.repeated)
    timing: float | Times = (
        entry.duration_s if table.times is None else Times(table.times, np.cumsum(~table.repeated) - 1)
    )
    repeated = tuple(int(row) for row in table.rows[table.repeated])
    if table.joints is not None:
        points = table.joints[kept]
        blends = _blends(np.abs(np.diff(points, axis=0)).max(axis=1), entry.blend_deg, np.radians(1.0))
        return Built(joints=joint_sequence(points, blends, timing), repeated_rows=repeated)
    segments = _lines(table, kept, entry, field, file)
    sizes = np.array([max(part.length, part.turned * TURN_LENGTH) for part in segments])
    path = segment_path(segments, _blends(sizes, entry.blend_mm, 1e-3), timing)
    slot = _slot(robot, entry.start_branch, field, file)
    return Built(tool=path, start_slot=slot, repeated_rows=repeated)


def _lines(table: PathTable, kept: np.ndarray, entry: TablePath, field: str, file: Path) -> list[Line]:
    """Lines from point to point; the half-turn axis is for those that turn by half a turn."""
    axis = None if entry.half_turn_axis is None else np.array(entry.half_turn_axis)
    poses = table.poses[kept]
    segments = []
    for k, (a, b) in enumerate(pairwise(poses)):
        part = line(a, b, GEOMETRY)
        if part.half_turn and axis is not None:
            try:
                part = line(a, b, GEOMETRY, axis)
            except PoseError as error:
                problem = f"on the way to row {table.rows[kept[k + 1]]} of {table.file}, {error}"
                raise InputError(file, f"{field}.half_turn_axis", problem, "Name the turn's axis") from None
        segments.append(part)
    if axis is not None and not any(part.half_turn for part in segments):
        raise InputError(file, f"{field}.half_turn_axis", "nothing in the table turns by 180 deg", "Remove it")
    return segments


def _blends(sizes: np.ndarray, wanted: float | None, unit: float) -> np.ndarray:
    most = np.minimum(sizes[:-1], sizes[1:]) / 2
    return most if wanted is None else np.minimum(most, wanted * unit)


def _slot(robot: Robot, name: str | None, field: str, file: Path) -> int | None:
    if name is None:
        return None
    labels = [BRANCHES[label] for label in branch_labels(robot)]
    if name not in labels:
        problem = f"this robot has no branch '{name}'"
        raise InputError(file, f"{field}.start_branch", problem, f"Known: {'; '.join(labels)}")
    return labels.index(name)


def _other(blend: str) -> str:
    return "blend_deg" if blend == "blend_mm" else "blend_mm"


def _pose(entry: PoseEntry) -> np.ndarray:
    return transform(np.array(entry.xyz_mm) / 1000, np.radians(entry.rpy_deg))
