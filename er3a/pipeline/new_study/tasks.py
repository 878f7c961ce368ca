"""Targets and paths that an arm can do, for a new study: searched, then tested by the checks of its stages.

Poses are searched above the scene's table with the tool straight down, then at random joint values within the limits,
away from singular poses and clear of collisions. The written values are those that were tested: millimetres and
degrees, rounded before they are solved, with the joint values as reference that make the inverse stage choose them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain, combinations, islice, product
from typing import Any

import numpy as np

from er3a.by_value import by_identity
from er3a.collision.bodies import Bodies
from er3a.collision.scene import Scene
from er3a.collision.shapes import arm_shapes
from er3a.errors import Er3aError
from er3a.files.path_file import PathFile, ProgramPath
from er3a.files.scene_file import SceneFile
from er3a.files.target_file import TargetEntry
from er3a.files.yaml_file import parse
from er3a.geometry.transforms import rot_x, rpy_of
from er3a.kinematics.forward import forward, frames
from er3a.kinematics.inverse import inverse
from er3a.kinematics.solutions import Solutions, Target
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.language import written_title
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.trajectory.judgement import judged
from er3a.pipeline.stages.trajectory.motion import motion_of, planning_of
from er3a.planning.commands import CommandSource
from er3a.robots.joint_limits import limit_margin, shown, within
from er3a.robots.robot import Robot
from er3a.selection.nearest import nearest
from er3a.selection.select import refusals_of
from er3a.workspace.orientations import along_last_axis

POINTS_DRAWN = 4000
JUDGED = 1000  # of them, for conditions of a target
ROOM_BELOW = 0.1  # of the reach, and at least so many m
FLOOR_BELOW_MM, TABLE_THICKNESS_MM = 5, 40
TABLE_TOP, TABLE_FROM, TABLE_LENGTH, TABLE_WIDTH = 0.12, 0.4, 0.5, 0.9  # of the reach
MIN_RADIUS_M = 0.05
MAX_TARGETS, MIN_TARGETS = 5, 2
APART = 0.1  # of the reach
TRIES, CHOICE = 60, 20  # of poses above the ground and of drawn ones each; solved ones to choose from
LIMIT_MARGIN_RAD, FROM_SCENE = np.radians(8.0), 0.02  # rad, m
FULL_POSE = 6  # joints that it takes to hold any pose
FINE_BELOW = 40.0  # deg or mm: joints of a smaller range are written in hundredths
SINGULAR_MARGIN = 2.0  # times what the study calls near
HEIGHTS, DISTANCES, ASIDE = (0.3, 0.4, 0.22), (0.6, 0.5, 0.7, 0.42), (0.0, 0.25, -0.25)  # of the reach
STEPS = ((0, 1, 0), (0, 0, 1), (1, 0, 0), (0, -1, 0), (0, 0, -1), (-1, 0, 0))
LENGTHS = (0.3, 0.2, 0.12, 0.06)  # of the reach
DURATIONS_S = (3.0, 6.0, 12.0)
PATH_SAMPLES = 50


@by_identity
class SampledReach:
    """Of the tool point over random joint values.

    Attributes
    ----------
    q : (N, n) rad or m, drawn within the limits, a tenth of each range away from them
    poses : (N, 4, 4) m
    radius : m, largest distance from the base's origin
    side : unit vector (3,) of the base's x, y, -y or -x axis to whose side most of the points lie
    stands : whether the arm works above its mounting plane rather than below it
    """

    q: Reals
    poses: Reals
    radius: float
    side: Reals
    stands: bool


def reach_of(robot: Robot) -> SampledReach:
    """Sample what an arm reaches; the same for each call.

    The arm's front, along x, is taken for its side if a fair share of the points lies there.
    """
    margin = 0.1 * (robot.upper - robot.lower)
    random = np.random.default_rng(0)
    q = random.uniform(robot.lower + margin, robot.upper - margin, (POINTS_DRAWN, robot.joints))
    q = q[kept] if (kept := within(robot, q)).any() else q
    poses = forward(robot, q)
    away = poses[:, :3, 3] - robot.base[:3, 3]
    sides = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]])
    ahead = away @ sides.T > np.hypot(away[:, 0], away[:, 1])[:, None] * np.cos(np.pi / 4)
    near = ahead.sum(axis=0)
    side = sides[0] if near[0] > 0.4 * near.max() else sides[int(near.argmax())]
    radius = max(float(np.linalg.norm(away, axis=1).max()), MIN_RADIUS_M)
    return SampledReach(q, poses, radius, side, bool(np.mean(away[:, 2] > 0) >= 0.5))


def scenes(robot: Robot, reach: SampledReach) -> list[dict[str, Any]]:
    """Scene files to try, the fullest first: the last is a floor below all that the arm reaches.

    A table on the floor is no scene for an arm whose home meets it, such as one on a stand that its file does not give.
    """
    room = ROOM_BELOW * max(1.0, reach.radius)
    low = math.floor((float(frames(robot, reach.q)[..., 2, 3].min()) - room) * 100) * 10
    deep = _scene(written_title("Floor below all that the arm reaches"), float(low))
    if not reach.stands:
        return [deep]
    ground = _foot_of(robot) * 1000
    top, from_axis, length, width = (
        round(share * reach.radius * 100) * 10 for share in (TABLE_TOP, TABLE_FROM, TABLE_LENGTH, TABLE_WIDTH)
    )
    x, y = robot.base[:2, 3] * 1000 + (from_axis + length / 2) * reach.side[:2]
    table = {
        "name": "table",
        "size_mm": [float(length), float(width), float(TABLE_THICKNESS_MM)],
        "xyz_mm": [round(float(x), 1), round(float(y), 1), round(ground + top - TABLE_THICKNESS_MM / 2, 1)],
        "rpy_deg": [0.0, 0.0, float(np.degrees(np.arctan2(reach.side[1], reach.side[0])))],
    }
    floor = _scene(written_title("Table on the floor"), round(ground - FLOOR_BELOW_MM, 1))
    stood = floor | {"boxes": [table]}
    home = robot.home
    clear = home is None or Bodies(robot, parse(SceneFile, stood, None).scene()).free(home[None])[0]
    return [stood, deep] if clear else [deep]


def _foot_of(robot: Robot) -> float:
    """Height (m) on which the arm stands: of the base's frame, or where the base goes deeper."""
    shapes = arm_shapes(robot)
    points = [(0.0, 0.0, 0.0)]
    points += [point for each in shapes.capsules if each.link == 0 for point in (each.start, each.end)]
    points += [point for each in shapes.pieces if each.link == 0 for point in each.points]
    points += [point for each in shapes.meshes if each.link == 0 for point in each.points]
    heights: Reals = np.array(points) @ robot.base[2, :3] + robot.base[2, 3]
    return float(heights.min())


def _scene(title: str, height_mm: float) -> dict[str, Any]:
    plane = {"name": "floor", "normal": [0.0, 0.0, 1.0], "offset_mm": height_mm}
    return {"kind": "scene", "title": title, "planes": [plane]}


@by_identity
class Spot:
    """A pose that the arm reaches, and the solution (n,) in rad or m that is best there.

    Attributes
    ----------
    written : the pose as target files write it: ``xyz_mm`` with ``rpy_deg`` in whole degrees, or ``q_deg``
    xyz_mm : the tool point
    label : of the solution's branch
    down : whether the tool points straight down
    """

    written: dict[str, list[float]]
    xyz_mm: tuple[float, float, float]
    q: Reals
    label: str
    down: bool = False


class TaskSearch:
    """What an arm can do in a scene, by the settings of the study's trajectory stage.

    Attributes
    ----------
    drawn, fit : joint vectors (k, n), rad or m, within the limits: all that were judged, and those that meet all
        conditions for a target
    """

    def __init__(self, robot: Robot, reach: SampledReach, scene: Scene, settings: TrajectorySettings) -> None:
        self.robot, self.reach, self.settings = robot, reach, settings
        turned = np.linalg.inv(robot.tool) @ along_last_axis(robot)[0].tool
        self.down_deg = (np.round(np.degrees(rpy_of(rot_x(np.pi) @ turned.T))) + 0.0).tolist()
        self.bodies = Bodies(robot, scene)
        own = [pair for pair, other in zip(self.bodies.pairs, self.bodies.second.tolist()) if other >= 0]
        self.around = Bodies(robot, scene, own)
        self.task = planning_of(robot, settings, self.bodies)
        self.margin = settings.assumed_margin_mm / 1000 if arm_shapes(robot).assumed else 0.0
        self.drawn = reach.q[:JUDGED]
        self.fit = self.drawn[self._fits(self.drawn)]

    def spots(self) -> list[Spot]:
        """Poses far from one another: at most ``MAX_TARGETS``, fewer where the arm reaches no more of those tried."""
        written = chain(islice(self._above_ground(), TRIES), islice(self._drawn(), TRIES))
        choice = list(islice(filter(None, map(self._spot, written)), CHOICE))
        found = choice[:1]
        while choice and len(found) < MAX_TARGETS:
            away = [min(np.linalg.norm(np.subtract(spot.xyz_mm, other.xyz_mm)) for other in found) for spot in choice]
            if max(away) < APART * self.reach.radius * 1000:
                break
            found.append(choice[int(np.argmax(away))])
        return found

    def any_spots(self) -> list[Spot]:
        """Poses of drawn joint values, whatever is in the way."""
        found = []
        for q, pose in islice(zip(self.reach.q, self.reach.poses), MAX_TARGETS):
            x, y, z = (1000 * pose[:3, 3]).tolist()
            found.append(Spot({"q_deg": self._written(q), "q_ref_deg": self._written(q)}, (x, y, z), q, ""))
        return found

    def any_path(self, spots: list[Spot]) -> list[dict[str, Any]]:
        """A slow joint move between two of them, whatever is in the way."""
        timing = {"duration_s": DURATIONS_S[-1], "samples": PATH_SAMPLES}
        return [entry | timing for entry in islice(self._joint_moves(spots), 1)]

    def paths(self, spots: list[Spot]) -> list[dict[str, Any]]:
        """Entries of a path file, each safe and away from singular poses: a joint move and, where the arm has branches,
        a line."""
        kinds = [self._joint_moves(spots), *([self._lines(spots)] if has_branches(self.robot) else [])]
        return [found for entries in kinds if (found := self._first_safe(entries))]

    def _above_ground(self) -> Iterator[dict[str, list[float]]]:
        """Poses above the ground on the side where the arm works, tool down, for arms that can hold any pose."""
        if not self.reach.stands or self.robot.joints < FULL_POSE:
            return
        out = self.reach.side
        across = np.array([-out[1], out[0], 0.0])
        open_ = self._where_open(self.reach.q.mean(axis=0))
        for height, distance, share in product(HEIGHTS, DISTANCES, ASIDE):
            point = self.reach.radius * (distance * out + share * across + np.array([0.0, 0.0, height]))
            yield {"xyz_mm": _millimetres(self.robot.base[:3, 3] + point), "rpy_deg": [*self.down_deg]} | open_

    def _drawn(self) -> Iterator[dict[str, list[float]]]:
        """Poses of drawn joint values that meet all conditions: of arms with fewer than six joints the joint values.

        A rounded pose is none that those can hold.
        """
        for q, pose in zip(self.fit, forward(self.robot, self.fit)):
            if self.robot.joints < FULL_POSE:
                yield {"q_deg": self._written(q)}
            else:
                rpy = np.round(np.degrees(rpy_of(pose))).tolist()
                yield {"xyz_mm": _millimetres(pose[:3, 3]), "rpy_deg": rpy} | self._where_open(q)

    def _where_open(self, q: Reals) -> dict[str, list[float]]:
        """The joint values (n,) that settle what a pose leaves open, for arms with more than six joints."""
        return {"q_ref_deg": self._written(q)} if self.robot.joints > FULL_POSE else {}

    def _spot(self, pose: dict[str, list[float]]) -> Spot | None:
        """The pose with its solution that has most room; None if the inverse stage would not choose one that fits."""
        try:
            solutions = self._solutions(pose)[0]
            rows = np.flatnonzero(solutions.solved & within(self.robot, solutions.q))
            rows = rows[self._fits(solutions.q[rows])]
            if not rows.size:
                return None
            best = rows[limit_margin(self.robot, solutions.q[rows]).argmax()]
            written = pose | {"q_ref_deg": self._written(solutions.q[best])}
            solutions, target = self._solutions(written)
        except Er3aError:
            return None
        chosen = nearest(self.robot, solutions, target.q_ref, refusals_of(self.bodies, solutions)).chosen
        if chosen is None or not self._fits(solutions.q[[chosen]])[0]:
            return None
        x, y, z = (target.T[:3, 3] * 1000).tolist()
        written = {key: [*values] for key, values in written.items()}  # YAML would alias lists that several share
        down = written.get("rpy_deg") == self.down_deg
        return Spot(written, (x, y, z), solutions.q[chosen], str(solutions.label[chosen]), down)

    def _solutions(self, pose: dict[str, list[float]]) -> tuple[Solutions, Target]:
        target = parse(TargetEntry, {"name": "spot", **pose}, None).target(self.robot)
        return inverse(self.robot, target.T, target.q_ref, self_motion_rows=True), target

    def _fits(self, q: Reals) -> Flags:
        """Whether joints (N, n) are away from limits and singular poses, and clear of everything: by the study's margin
        where shapes are assumed, and of the scene by ``FROM_SCENE``.

        Away are 8 deg or a twentieth of a joint's range, and twice what the study calls near a singular pose.
        """
        robot = self.robot
        smallest = np.minimum(np.where(robot.slides, np.inf, LIMIT_MARGIN_RAD), (robot.upper - robot.lower) / 20)
        room = (np.minimum(q - robot.lower, robot.upper - q) > smallest) | robot.continuous
        fits: Flags = room.all(axis=-1) & (self.task.near.margin(robot, q) > SINGULAR_MARGIN)
        fits[fits] = self.bodies.free(q[fits], self.margin)
        fits[fits] = self.around.free(q[fits], FROM_SCENE)
        return fits

    def _written(self, q: Reals) -> list[float]:
        """Joint values (n,) as files have them: whole degrees and mm, hundredths where the range is small."""
        step = np.where(shown(self.robot, self.robot.upper - self.robot.lower) > FINE_BELOW, 1.0, 0.01)
        values: list[float] = (np.round(np.round(shown(self.robot, q) / step) * step, 2) + 0.0).tolist()
        return values

    def _joint_moves(self, spots: list[Spot]) -> Iterator[dict[str, Any]]:
        for start, end in combinations(spots, 2):
            yield {
                "name": "joint_move",
                "kind": "joint",
                "title": written_title("All joints together, from one target to another"),
                "start_deg": self._written(start.q),
                "end_deg": self._written(end.q),
            }

    def _lines(self, spots: list[Spot]) -> Iterator[dict[str, Any]]:
        """Straight lines of the tool from a target, on that target's branch, to poses that are reached with room."""
        for length, spot, step in product(LENGTHS, spots, STEPS):
            way = np.array(spot.xyz_mm) / 1000 + length * self.reach.radius * np.array(step)
            end = {"xyz_mm": _millimetres(way), "rpy_deg": [*spot.written["rpy_deg"]]}
            solutions = self._solutions(end)[0]
            same = solutions.solved & np.array([str(label) == spot.label for label in solutions.label], bool)
            if self._fits(solutions.q[same]).any():
                branch = spot.label.replace("_elbow", ", elbow").replace("_no_flip", ", no flip")
                yield {
                    "name": "line",
                    "kind": "line",
                    "title": written_title("A straight line, the tool held as it is"),
                    "start": {key: [*spot.written[key]] for key in ("xyz_mm", "rpy_deg")},
                    "start_branch": branch.replace("_flip", ", flip").replace("_", " "),
                    "end": end,
                }

    def _first_safe(self, entries: Iterator[dict[str, Any]]) -> dict[str, Any] | None:
        """The first entry that is safe, with the shortest of ``DURATIONS_S`` in which it is."""
        for entry, duration in product(entries, DURATIONS_S):
            timed = entry | {"duration_s": duration, "samples": PATH_SAMPLES}
            if self._is_safe(timed):
                return timed
        return None

    def _is_safe(self, written: dict[str, Any]) -> bool:
        """Whether the trajectory stage would call a path safe and away from singular poses."""
        entry = parse(PathFile, {"kind": "paths", "paths": [written]}, None).paths[0]
        assert not isinstance(entry, ProgramPath)
        try:
            motion = motion_of(self.robot, entry, self.settings.checks_per_sample, CommandSource(None, ""), {})
        except Er3aError:
            return False
        found = judged(self.task, motion)
        at, distance = found.along.closest, found.along.distance
        return found.verdict == "safe" and not found.events and bool(at < 0 or distance[at] >= self.margin)


def _millimetres(point: Reals) -> list[float]:
    rounded: list[float] = (np.round(point * 200) * 5 + 0.0).tolist()  # to 5 mm
    return rounded
