"""From a path's command to a sequence of instructions: lines stay lines, joint moves joint moves, tables points."""

from __future__ import annotations

from itertools import pairwise
from typing import assert_never

import numpy as np

from er3a.by_value import by_identity
from er3a.finding import Finding, fact
from er3a.geometry.transforms import rotation_angle
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.planning import commands
from er3a.planning.moves import line, rotation_between
from er3a.planning.profiles import LegTimes, Times
from er3a.planning.sequences import TURN_LENGTH, arc
from er3a.programs.instructions import (
    FINE,
    ArmMotion,
    Instruction,
    JointTarget,
    Listing,
    Load,
    MotionKind,
    NamedFrame,
    Pause,
    PoseTarget,
    Rate,
    Zone,
)
from er3a.robots.robot import Robot

TO_START = Rate(0.1, "share")


@by_identity
class PathListing:
    """A path as a sequence.

    Attributes
    ----------
    start : (n,), rad, its first target
    """

    listing: Listing
    start: Reals
    findings: tuple[Finding, ...] = ()


def listing_of(
    command: commands.JointCommand | commands.ToolCommand,
    robot: Robot,
    start: Reals,
    name: str = "path",
    *,
    ends: Reals | None = None,
    load: Load | None = None,
) -> PathListing:
    """A path's command as a sequence that begins with a joint motion to its start.

    Parameters
    ----------
    start : (n,), rad, joints at the path's start
    ends : (k, n), rad, joints at the end of each segment or row after the start, where they are known: they fix the
        branch for languages that write joints
    load : what hangs on the flange, as of :class:`er3a.programs.instructions.ArmMotion`
    """
    making = _Making(robot, start, load)
    match command:
        case commands.JointMoveCommand():
            making.joints(command.end[None], np.array([command.duration]), [FINE])
        case commands.JointSequenceCommand():
            points = command.points[1:]
            zones = [Zone("angle", command.blend)] * (len(points) - 1) + [FINE]
            making.joints(points, _shared(_joint_sizes(command.points), command.duration), _plain(zones))
        case commands.JointTableCommand():
            points = command.points[1:]
            zone = Zone("angle", command.blend) if command.blend is not None else Zone("named", 0.0, "half")
            zones = [zone] * (len(points) - 1) + [FINE]
            making.halts = _halts(command.timing, len(points))
            making.joints(points, _row_times(command.timing, _joint_sizes(command.points)), _plain(zones))
        case commands.ToolMoveCommand():
            making.segments((command.segment,), command.duration, ends)
        case commands.ToolSequenceCommand():
            making.segments(command.segments, command.duration, ends)
        case commands.ToolTableCommand():
            sizes = making.sizes(tuple(map(commands.SegmentCommand, command.poses[1:])))
            halves = np.append(np.minimum(sizes[:-1], sizes[1:]) / 2, 0.0)  # as er3a.planning.commands rounds corners
            blends = halves if command.blend is None else np.minimum(halves, command.blend)
            axis = command.half_turn_axis
            parts = tuple(
                commands.SegmentCommand(pose, half_turn_axis=axis, blend=float(blend))
                for pose, blend in zip(command.poses[1:], blends)
            )
            making.halts = _halts(command.timing, len(parts))
            making.segments(parts, _row_times(command.timing, sizes), ends)
        case _:
            assert_never(command)
    findings = (fact("written_half_turns_split", lines=making.split),) if making.split else ()
    return PathListing(Listing(name, tuple(making.found)), start, findings)


class _Making:
    """Puts the instructions of a path together."""

    def __init__(self, robot: Robot, start: Reals, load: Load | None):
        self.tool, self.base, self.load = (
            NamedFrame("", robot.tool),
            NamedFrame("", np.eye(4)),
            load,
        )
        self.to_robot = np.linalg.inv(robot.base)
        self.pose: Reals = self.to_robot @ forward(robot, start)
        self.found: list[Instruction] = [self._motion("joint", JointTarget(start), TO_START, FINE)]
        self.split = 0
        self.halts: dict[int, float] = {}

    def joints(self, points: Reals, times: Reals, zones: list[Zone]) -> None:
        """Add joint motions to points.

        Parameters
        ----------
        points : (k, n), rad
        times : (k,), s, of each motion
        zones : (k) of them; a point at which a timed table rests is a stop
        """
        for i, (point, seconds, zone) in enumerate(zip(points, times, zones)):
            blend = FINE if i in self.halts else zone
            self.found.append(self._motion("joint", JointTarget(point), Rate(float(seconds), "s"), blend))
            self._rest(i)

    def sizes(self, parts: tuple[commands.SegmentCommand, ...]) -> Reals:
        """Lengths of segments, as a measure of their times.

        Parameters
        ----------
        parts : (k) of them, one after another from where the tool is

        Returns
        -------
        lengths : (k,), m, straight between the ends; at least ``TURN_LENGTH`` for each rad of the tool's turn
        """
        found, pose = [], self.pose
        for part in parts:
            end = self.to_robot @ part.end
            turn = float(rotation_angle(pose[:3, :3], end[:3, :3]))
            found.append(max(float(np.linalg.norm(end[:3, 3] - pose[:3, 3])), TURN_LENGTH * turn))
            pose = end
        return np.array(found)

    def segments(
        self, parts: tuple[commands.SegmentCommand, ...], timing: float | LegTimes | Reals, ends: Reals | None
    ) -> None:
        """Add lines and arcs.

        Parameters
        ----------
        parts : (k) of them, poses in the world frame, m
        timing : s, of all together, of the parts of a leg, or (k,) of each
        ends : (k, n), rad, joints at the end of each; None where they are not known
        """
        times = timing if isinstance(timing, np.ndarray) else _shared(self.sizes(parts), timing)
        for i, part in enumerate(parts):
            end = self.to_robot @ part.end
            zone = Zone("distance", part.blend) if part.blend > 0 and i not in self.halts else FINE
            self._segment(part, end, float(times[i]), zone, None if ends is None else ends[i])
            self.pose = end
            self._rest(i)

    def _rest(self, number: int) -> None:
        if number in self.halts:
            self.found.append(Pause(self.halts[number]))

    def _segment(
        self, part: commands.SegmentCommand, end: Reals, seconds: float, zone: Zone, joints: Reals | None
    ) -> None:
        """A line or an arc; one with half a turn as two halves of it, so that its sense is fixed."""
        here, halves = np.linalg.inv(self.to_robot) @ self.pose, [(1.0, end, zone, joints)]
        half_turn = rotation_between(here, part.end)[1]
        axis = part.half_turn_axis if half_turn else None
        shape = line(here, part.end, 1.0, axis) if part.via is None else arc(here, part.via, part.end, 1.0, axis)
        if half_turn:
            self.split += 1
            halves = [(0.5, self.to_robot @ shape.poses(np.array(0.5)), FINE, None), (0.5, *halves[0][1:])]
        for k, (share, target, stop, known) in enumerate(halves):
            via = None
            if part.via is not None:
                at = part.via if not half_turn else shape.points(np.array(0.25 + 0.5 * k))
                via = PoseTarget(_moved_to(target, (self.to_robot @ np.append(at, 1.0))[:3]))
            goal, rate = PoseTarget(target, joints=known), Rate(share * seconds, "s")
            self.found.append(self._motion("line" if via is None else "arc", goal, rate, stop, via))

    def _motion(
        self,
        kind: MotionKind,
        target: JointTarget | PoseTarget,
        speed: Rate,
        zone: Zone,
        via: PoseTarget | None = None,
    ) -> ArmMotion:
        return ArmMotion(kind, target, via=via, speed=speed, zone=zone, tool=self.tool, base=self.base, load=self.load)


def _moved_to(pose: Reals, point: Reals) -> Reals:
    """A pose (4, 4) at another point (3,)."""
    found = pose.copy()
    found[:3, 3] = point
    return found


def _plain(zones: list[Zone]) -> list[Zone]:
    """Zones of no size are stops."""
    return [FINE if zone.kind == "angle" and zone.value <= 0 else zone for zone in zones]


def _joint_sizes(points: Reals) -> Reals:
    found: Reals = np.abs(np.diff(points, axis=0)).max(axis=1)
    return found


def _shared(sizes: Reals, duration: float | LegTimes) -> Reals:
    """A duration shared out by size, if those of the parts are not given."""
    if isinstance(duration, LegTimes):
        return duration.times
    total = sizes.sum()
    return duration * (sizes / total if total > 0 else np.full(len(sizes), 1 / len(sizes)))


def _row_times(timing: float | Times, sizes: Reals) -> Reals:
    """Seconds from each point of a table to the next."""
    if not isinstance(timing, Times):
        return _shared(sizes, float(timing))
    here = [timing.times[timing.corner == i] for i in range(len(sizes) + 1)]
    return np.array([after[0] - before[-1] for before, after in pairwise(here)])


def _halts(timing: float | Times, count: int) -> dict[int, float]:
    """Seconds for which a timed table rests at a point, by the number of the motion that ends there."""
    if not isinstance(timing, Times):
        return {}
    rests = {i: float(np.ptp(timing.times[timing.corner == i + 1])) for i in range(count)}
    return {i: seconds for i, seconds in rests.items() if seconds > 0}
