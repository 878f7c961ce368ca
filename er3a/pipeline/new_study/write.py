"""Finds targets and paths for a new study, and writes its files; existing files are kept.

Targets that the arm reaches and paths that it can do are found with the checks of the inverse and trajectory stages.
Poses are searched above the scene's table with the tool straight down, then at random joint values within the limits,
away from singular poses and clear of collisions. The written values are those that were tested: millimetres and
degrees, rounded before they are solved, with the joint values as reference that make the inverse stage choose them.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import chain, combinations, islice, product
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from er3a.collision.bodies import Bodies
from er3a.collision.scene import Scene
from er3a.collision.shapes import arm_shapes
from er3a.errors import Er3aError, InputError
from er3a.files.dh_table import AngleUnit, LengthUnit, read_dh_table
from er3a.files.kept_files import ROOT, write_atomically
from er3a.files.path_file import PathFile, ProgramPath
from er3a.files.reference_sets import FORMATS, reference_folder
from er3a.files.robot_file import NAME_PATTERN, RobotFile
from er3a.files.robot_library import read_robot, robot_of, robot_path
from er3a.files.robot_writer import robot_file, robot_text, surface_files, yaml_text
from er3a.files.scene_file import SceneFile
from er3a.files.target_file import TargetEntry
from er3a.files.yaml_file import parse, read_yaml
from er3a.formats.mesh_file import read_text
from er3a.formats.urdf import import_urdf
from er3a.formats.urdf_tree import plain_urdf
from er3a.geometry.transforms import rpy_of
from er3a.kinematics.by_class import arm_solver
from er3a.kinematics.classes.chain_solvers import Unsolved
from er3a.kinematics.forward import forward, frames
from er3a.kinematics.inverse import inverse
from er3a.kinematics.solutions import Solutions, Target
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.language import written_title
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.trajectory.judgement import Surroundings, judge, measured
from er3a.pipeline.stages.trajectory.motion import limits_of, motion_of, near_singular
from er3a.planning.commands import CommandSource
from er3a.robots.joint_limits import limit_margin, shown, within
from er3a.robots.robot import Convention, ConvexPiece, LinkMesh, Robot, robot_name
from er3a.selection.nearest import nearest
from er3a.selection.select import refusals_of

POINTS_DRAWN = 4000
SIDES_DEG = (0, 90, -90, 180)
FLOOR_BELOW_MM = 5
ROOM_BELOW_M, ROOM_BELOW = 0.1, 0.1  # at least, and of the reach
TABLE_TOP, TABLE_FROM, TABLE_LENGTH, TABLE_WIDTH = 0.12, 0.4, 0.5, 0.9  # of the reach
TABLE_THICKNESS_MM = 40
MIN_RADIUS_M = 0.05


@dataclass(frozen=True, eq=False)
class SampledReach:
    """Of the tool point over random joint values.

    Attributes
    ----------
    q : (N, n) rad or m, drawn within the limits, a tenth of each range away from them
    poses : (N, 4, 4) m
    radius : m, largest distance from the base's origin
    side_deg : about the base's z axis, where most of the points lie; one of ``SIDES_DEG``
    stands : whether the arm works above its mounting plane rather than below it
    """

    q: Reals
    poses: Reals
    radius: float
    side_deg: int
    stands: bool


def reach_of(robot: Robot) -> SampledReach:
    """Sample what an arm reaches; the same for each call."""
    margin = 0.1 * (robot.upper - robot.lower)
    random = np.random.default_rng(0)
    q = random.uniform(robot.lower + margin, robot.upper - margin, (POINTS_DRAWN, robot.joints))
    q = q[kept] if (kept := within(robot, q)).any() else q
    poses = forward(robot, q)
    away = poses[:, :3, 3] - robot.base[:3, 3]
    azimuth = np.degrees(np.arctan2(away[:, 1], away[:, 0]))
    near = [np.count_nonzero(np.abs((azimuth - side + 180) % 360 - 180) < 45) for side in SIDES_DEG]
    side = SIDES_DEG[0] if near[0] > 0.4 * max(near) else SIDES_DEG[int(np.argmax(near))]
    radius = max(float(np.linalg.norm(away, axis=1).max()), MIN_RADIUS_M)
    return SampledReach(q, poses, radius, side, bool(np.mean(away[:, 2] > 0) >= 0.5))


def scenes(robot: Robot, reach: SampledReach) -> list[dict[str, Any]]:
    """Scene files to try, the fullest first: the last is a floor below all that the arm reaches."""
    ground = _foot_of(robot) * 1000
    room = max(ROOM_BELOW_M, ROOM_BELOW * reach.radius)
    low = math.floor((float(frames(robot, reach.q)[..., 2, 3].min()) - room) * 100) * 10
    deep = _scene(written_title("Floor below all that the arm reaches"), float(low))
    if not reach.stands:
        return [deep]
    top, from_axis, length, width = (
        round(share * reach.radius * 100) * 10 for share in (TABLE_TOP, TABLE_FROM, TABLE_LENGTH, TABLE_WIDTH)
    )
    turn = math.radians(reach.side_deg)
    out = from_axis + length / 2
    x, y = robot.base[:2, 3] * 1000 + out * np.array([math.cos(turn), math.sin(turn)])
    table = {
        "name": "table",
        "size_mm": [float(length), float(width), float(TABLE_THICKNESS_MM)],
        "xyz_mm": [round(float(x), 1), round(float(y), 1), round(ground + top - TABLE_THICKNESS_MM / 2, 1)],
        "rpy_deg": [0.0, 0.0, float(reach.side_deg)],
    }
    floor = _scene(written_title("Table on the floor"), round(ground - FLOOR_BELOW_MM, 1))
    bare = _scene(written_title("Floor"), round(ground - FLOOR_BELOW_MM, 1))
    return [floor | {"boxes": [table]}, bare, deep]


def _foot_of(robot: Robot) -> float:
    """Height (m) on which the arm stands: of the base's frame, or where the base goes deeper."""
    shapes = arm_shapes(robot)
    lines = [point for each in shapes.capsules if each.link == 0 for point in (each.start, each.end)]
    solids: tuple[ConvexPiece | LinkMesh, ...] = (*shapes.pieces, *shapes.meshes)
    points = [(0.0, 0.0, 0.0), *lines, *(point for each in solids if each.link == 0 for point in each.points)]
    heights: Reals = np.array(points) @ robot.base[2, :3] + robot.base[2, 3]
    return float(heights.min())


def _scene(title: str, height_mm: float) -> dict[str, Any]:
    plane = {"name": "floor", "normal": [0.0, 0.0, 1.0], "offset_mm": height_mm}
    return {"kind": "scene", "title": title, "planes": [plane]}


MAX_TARGETS, MIN_TARGETS = 5, 2
NAMED_PAIRS = 3
APART = 0.1  # of the reach
TRIES, CHOICE = 150, 30  # of poses above the ground and of drawn ones each; solved ones to choose from
TRIES_SLOW, CHOICE_SLOW = 20, 10  # of arms that are solved slowly
DRAWN = 1000  # joint vectors that are judged at once
LIMIT_MARGIN_RAD = np.radians(8.0)
FULL_POSE = 6  # joints that it takes to hold any pose
FINE_BELOW = 40.0  # deg or mm
SINGULAR_MARGIN = 2.0  # times what the study calls near
DOWN_DEG = (180, 0, 0)
HEIGHTS, DISTANCES, ASIDE = (0.3, 0.4, 0.22), (0.6, 0.5, 0.7, 0.42), (0.0, 0.25, -0.25, 0.12, -0.12)  # of the reach
STEPS = ((0, 1, 0), (0, 0, 1), (1, 0, 0), (0, -1, 0), (0, 0, -1), (-1, 0, 0))
LENGTHS = (0.3, 0.2, 0.12, 0.06)  # of the reach
DURATIONS_S = (3.0, 6.0, 12.0)
PATH_SAMPLES = 50


@dataclass(frozen=True, eq=False)
class Spot:
    """A pose that the arm reaches, and the solution (n,) in rad or m that is best there.

    Attributes
    ----------
    written : the pose as target files write it: ``xyz_mm`` with ``rpy_deg`` in whole degrees, or ``q_deg``
    xyz_mm : the tool point
    """

    written: dict[str, list[float]]
    xyz_mm: tuple[float, float, float]
    q: Reals
    label: str

    @property
    def pose(self) -> dict[str, list[float]]:
        """As path files write it."""
        return {key: [*self.written[key]] for key in ("xyz_mm", "rpy_deg")}

    @property
    def down(self) -> bool:
        """Whether the tool is asked to point straight down."""
        return tuple(self.written.get("rpy_deg", ())[:2]) == DOWN_DEG[:2]


@dataclass(frozen=True)
class DrawnCounts:
    """How many of the joint vectors drawn within the limits meet each condition for a target.

    Attributes
    ----------
    fit : those that meet all conditions
    near_limit, near_singular, colliding : those that fail it, whatever else they fail
    overlaps : pairs of bodies, those that overlap most often first, with in how many
    """

    drawn: int
    fit: int
    near_limit: int
    near_singular: int
    colliding: int
    overlaps: tuple[tuple[str, int], ...]


class TaskSearch:
    """What an arm can do in a scene, by the settings of the study's trajectory stage.

    Attributes
    ----------
    fit : (k, n), rad or m, joint vectors drawn within the limits that meet all conditions for a target
    counts : how many meet which
    tried : how many poses were solved
    rejected : kind of path -> why paths of it that were tried are none that the arm can do, with how many
    """

    def __init__(self, robot: Robot, reach: SampledReach, scene: Scene, settings: TrajectorySettings) -> None:
        self.robot, self.reach, self.settings = robot, reach, settings
        self.limits, self.near = limits_of(robot, settings), near_singular(settings)
        self.bodies = Bodies(robot, scene)
        self.tried, self.rejected = 0, dict[str, Counter[str]]()
        q = reach.q[:DRAWN]
        inside, nonsingular, free = self._away_from_limits(q), self._away_from_singularities(q), self.bodies.free(q)
        self.fit = q[inside & nonsingular & free]
        touching = Counter({pair.label: 0 for pair in self.bodies.pairs})
        for pair, count in zip(self.bodies.pairs, self.bodies.overlaps(q).sum(axis=0).tolist()):
            touching[pair.label] = max(touching[pair.label], count)
        near_limit, too_singular, colliding = (int(np.count_nonzero(~each)) for each in (inside, nonsingular, free))
        often = tuple((label, count) for label, count in touching.most_common(NAMED_PAIRS) if count)
        self.counts = DrawnCounts(len(q), len(self.fit), near_limit, too_singular, colliding, often)

    def spots(self) -> list[Spot]:
        """Poses far from one another: at most ``MAX_TARGETS``, fewer where the arm reaches no more of those tried."""
        if not len(self.fit):
            return []
        slow = self.robot.joints > FULL_POSE or isinstance(arm_solver(self.robot).chain, Unsolved)
        tries, most = (TRIES_SLOW, CHOICE_SLOW) if slow else (TRIES, CHOICE)
        written = chain(islice(self._above_ground(), tries), islice(self._drawn(), tries))
        choice = list(islice(filter(None, map(self._spot, written)), most))
        found = choice[:1]
        while choice and len(found) < MAX_TARGETS:
            away = [min(np.linalg.norm(np.subtract(spot.xyz_mm, other.xyz_mm)) for other in found) for spot in choice]
            if max(away) < APART * self.reach.radius * 1000:
                break
            found.append(choice[int(np.argmax(away))])
        return found

    def any_spots(self) -> list[Spot]:
        """Poses of drawn joint values, whatever is in the way."""
        reach = self.reach
        values = [self._written(q) for q in reach.q[:MAX_TARGETS]]
        written = [{"q_deg": each, "q_ref_deg": [*each]} for each in values]
        points = (reach.poses[:MAX_TARGETS, :3, 3] * 1000).tolist()
        return [Spot(pose, (x, y, z), q, "") for pose, (x, y, z), q in zip(written, points, reach.q)]

    def any_path(self, spots: list[Spot]) -> list[dict[str, Any]]:
        """A slow joint move between two of them, whatever is in the way."""
        timing = {"duration_s": DURATIONS_S[-1], "samples": PATH_SAMPLES}
        return [entry | timing for entry in islice(self._joint_moves(spots), 1)]

    def paths(self, spots: list[Spot]) -> list[dict[str, Any]]:
        """Entries of a path file, each safe and away from singular poses: a joint move and, where the arm has branches,
        a line and an arc.
        """
        kinds = {"joint": self._joint_moves}
        if has_branches(self.robot):
            kinds |= {"line": self._lines, "arc": self._arcs}
        return [found for kind, entries in kinds.items() if (found := self._first_safe(kind, entries(spots)))]

    def _above_ground(self) -> Iterator[dict[str, list[float]]]:
        """Poses above the ground on the side where the arm works, tool down, for arms that can hold any pose."""
        base = self.robot.base
        if not self.reach.stands or self.robot.joints < FULL_POSE:
            return
        turn = np.radians(self.reach.side_deg)
        out, aside = np.array([np.cos(turn), np.sin(turn), 0]), np.array([-np.sin(turn), np.cos(turn), 0])
        open_ = self._where_open(self.reach.q.mean(axis=0))
        for height in HEIGHTS:
            for distance in DISTANCES:
                for share in ASIDE:
                    point = base[:3, 3] + self.reach.radius * (distance * out + share * aside + [0, 0, height])
                    yield {"xyz_mm": _millimetres(point), "rpy_deg": [180.0, 0.0, 0.0]} | open_

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
        self.tried += 1
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
        return Spot(written, (x, y, z), solutions.q[chosen], str(solutions.label[chosen]))

    def _solutions(self, pose: dict[str, list[float]]) -> tuple[Solutions, Target]:
        target = parse(TargetEntry, {"name": "spot", **pose}, None).target(self.robot)
        return inverse(self.robot, target.T, target.q_ref, self_motion_rows=True), target

    def _fits(self, q: Reals) -> Flags:
        """Whether joints (N, n) are away from limits and singular poses, and clear of everything."""
        fits = self._away_from_limits(q) & self._away_from_singularities(q)
        fits[fits] = self.bodies.free(q[fits])
        return fits

    def _away_from_limits(self, q: Reals) -> Flags:
        """Whether joints (N, n) are away from their limits, by 8 deg or a twentieth of the range."""
        robot = self.robot
        smallest = np.minimum(np.where(robot.slides, np.inf, LIMIT_MARGIN_RAD), (robot.upper - robot.lower) / 20)
        room = (np.minimum(q - robot.lower, robot.upper - q) > smallest) | robot.continuous
        return np.asarray(room.all(axis=-1))

    def _written(self, q: Reals) -> list[float]:
        """Joint values (n,) as files have them: whole degrees and mm, hundredths where the range is small."""
        step = np.where(shown(self.robot, self.robot.upper - self.robot.lower) > FINE_BELOW, 1.0, 0.01)
        values: list[float] = (np.round(np.round(shown(self.robot, q) / step) * step, 2) + 0.0).tolist()
        return values

    def _away_from_singularities(self, q: Reals) -> Flags:
        """Whether joints (N, n) are away from singular poses, by twice what the study calls near."""
        return np.asarray(self.near.margin(self.robot, q) > SINGULAR_MARGIN)

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
        title = written_title("A straight line, the tool held as it is")
        for length, spot, step in product(LENGTHS, spots, STEPS):
            end = _shifted(spot, length * self.reach.radius * np.array(step))
            if self._reached(spot, end):
                yield _move("line", title, spot, {"end": end})

    def _arcs(self, spots: list[Spot]) -> Iterator[dict[str, Any]]:
        title = written_title("Half a circle, the tool held as it is")
        for length, spot, (step, side) in product(LENGTHS, spots, zip(STEPS, (*STEPS[2:], *STEPS[:2]))):
            way, bulge = (length * self.reach.radius * np.array(each) for each in (step, side))
            via, end = _shifted(spot, way / 2 + bulge / 2), _shifted(spot, way)
            if self._reached(spot, via) and self._reached(spot, end):
                yield _move("arc", title, spot, {"via_mm": via["xyz_mm"], "end": end})

    def _reached(self, spot: Spot, pose: dict[str, list[float]]) -> bool:
        """Whether the arm reaches another pose on a target's branch, with room and clear of everything."""
        solutions = self._solutions(pose)[0]
        same = np.array([str(label) == spot.label for label in solutions.label], bool)
        rows = np.flatnonzero(solutions.solved & same)
        return bool(self._fits(solutions.q[rows]).any())

    def _first_safe(self, kind: str, entries: Iterator[dict[str, Any]]) -> dict[str, Any] | None:
        """The first entry that is safe, with the shortest of ``DURATIONS_S`` in which it is."""
        rejected = self.rejected[kind] = Counter()
        for entry in entries:
            for duration in DURATIONS_S:
                timed = entry | {"duration_s": duration, "samples": PATH_SAMPLES}
                if (fault := self._fault(timed)) is None:
                    return timed
                if not fault.startswith("too fast"):
                    break
            rejected[fault or ""] += 1
        return None

    def _fault(self, written: dict[str, Any]) -> str | None:
        """Why the trajectory stage would not call a path safe and away from singular poses; None where it would."""
        entry = parse(PathFile, {"kind": "paths", "paths": [written]}, None).paths[0]
        assert not isinstance(entry, ProgramPath)
        try:
            motion = motion_of(self.robot, entry, self.settings.checks_per_sample, CommandSource(None, ""), {})
        except Er3aError:
            return "can't be followed"
        judgement = judge(self.robot, motion, self.near, self.limits)
        if judgement.verdict != "safe":
            return judgement.verdict
        if judgement.events:
            return "near-singular"
        around = Surroundings(self.bodies, self.settings.penetration_tolerance_mm / 1000)
        return "collides" if measured(around, motion).contacts else None


def _move(kind: str, title: str, spot: Spot, rest: dict[str, Any]) -> dict[str, Any]:
    """A path of the tool, without its duration."""
    branch = spot.label.replace("_elbow", ", elbow").replace("_no_flip", ", no flip").replace("_flip", ", flip")
    branch = branch.replace("_", " ")
    return {"name": kind, "kind": kind, "title": title, "start": spot.pose, "start_branch": branch, **rest}


def _millimetres(point: Reals) -> list[float]:
    rounded: list[float] = (np.round(point * 200) * 5 + 0.0).tolist()  # to 5 mm
    return rounded


def _shifted(spot: Spot, way: Reals) -> dict[str, list[float]]:
    return {"xyz_mm": _millimetres(np.array(spot.xyz_mm) / 1000 + way), "rpy_deg": [*spot.written["rpy_deg"]]}


SCHEMA_LINE = "# yaml-language-server: $schema=../../config/robot.schema.json\n"


@dataclass(frozen=True, eq=False)
class Arm:
    """An arm, and what its file in the study says.

    Attributes
    ----------
    text : of the robot file
    notes : what was assumed about it, in words
    references : texts of the files of its reference sets, by their place in the study
    """

    robot: Robot
    text: str
    notes: tuple[str, ...] = ()
    references: Mapping[str, str] = field(default_factory=dict)


def arm_of(
    urdf: Path | None,
    dh: Path | None,
    robot: str | None,
    *,
    name: str | None = None,
    convention: Convention | None = None,
    length_unit: LengthUnit | None = None,
    angle_unit: AngleUnit | None = None,
    ends: tuple[str | None, str | None] = (None, None),
    xacro: Sequence[str] = (),
) -> Arm:
    """The arm that exactly one of a URDF, a D-H table and a robot's name or file describes.

    Parameters
    ----------
    name : of the robot in the study; by default that of the file
    convention, length_unit, angle_unit : of the D-H table, where its columns don't say; "standard" if None
    ends : the URDF's links at which the arm begins and ends, where the file leaves a choice
    xacro : arguments ``NAME:=VALUE`` of a URDF that is xacro

    Raises
    ------
    Er3aError
        for none or several of them, a name that no robot can have, and what reading the file refuses
    """
    given = [word for word, value in {"--urdf": urdf, "--dh": dh, "--robot": robot}.items() if value is not None]
    if len(given) != 1:
        problem = f"{' and '.join(given)} each name an arm" if given else "which arm?"
        raise Er3aError(f"{problem} Give one of --urdf FILE, --dh FILE.csv and --robot NAME")
    if name is not None and not re.match(NAME_PATTERN, name):
        allowed = "small letters, digits, - and _, a letter or digit first, 64 at most"
        raise Er3aError(f"--name '{name}' can't be a robot's name: {allowed}")
    if dh is None and (convention, length_unit, angle_unit) != (None, None, None):
        raise Er3aError("--convention, --length-unit and --angle-unit say how a table is meant; give them with --dh")
    if urdf is None and (ends != (None, None) or xacro):
        raise Er3aError("--base, --tip and --xacro say how a URDF is read; give them with --urdf")
    if urdf is not None:
        with plain_urdf(urdf, xacro) as file:
            return _from_urdf(file, name or robot_name(file), ends)
    if dh is not None:
        units: Any = {"length_unit": length_unit, "angle_unit": angle_unit}
        content, notes = read_dh_table(dh, name or robot_name(dh), convention or "standard", **units)
        return Arm(robot_of(content), _text(content), notes)
    return _known(str(robot), name)


def _from_urdf(path: Path, name: str, ends: tuple[str | None, str | None]) -> Arm:
    imported = import_urdf(path, base=ends[0], tip=ends[1], snap=True)
    robot = imported.robot.replace(name=name)
    content = robot_file(robot, path)
    misfit = f"the table's flange differs from the URDF's by at most {imported.misfit_m * 1000:.2g} mm on random poses"
    notes = [*imported.notes, misfit]
    if not arm_shapes(robot).given:
        notes.append("the URDF gives no collision shapes; capsules are guessed from the table's axes")
    return Arm(robot_of(content), _text(content), tuple(notes))


def _known(robot: str, name: str | None) -> Arm:
    """A robot file as it is written, with its comments, and its references; under another name if one is asked for."""
    path = robot_path(robot)
    content = read_robot(path)
    text = read_text(path)
    if name is not None and name != content.name:
        content = content.model_copy(update={"name": name})
        text = re.sub(r"^name:.*$", f"name: {name}", text, count=1, flags=re.MULTILINE)
    return Arm(robot_of(content), text, references=_references(path, content.references))


def _references(robot: Path, names: Sequence[str]) -> dict[str, str]:
    """The files of sets that stand beside a robot's file, else in the study at hand or in er3a."""
    found: dict[str, str] = {}
    for name in names:
        beside = robot.parent.parent / "manual_refs" / name
        folder = beside if beside.is_dir() else reference_folder(name)
        if not folder.is_dir():
            problem, remedy = (
                f"there is no reference set '{name}'",
                f"Copy its folder to {beside}, or leave the name out",
            )
            raise InputError(robot, "references", problem, remedy)
        files = (each for each in sorted(folder.iterdir()) if each.suffix.lower() in (".csv", ".po"))
        found |= {f"{REFERENCES}/{name}/{each.name}": each.read_text(encoding="utf-8") for each in files}
    return found


def _text(content: RobotFile) -> str:
    return SCHEMA_LINE + robot_text(content)


STUDY = "config/config.yaml"
SCENE = "data/scenes/cell.yaml"
REFERENCES = "data/manual_refs"
HELP = f"{REFERENCES}/README.md"
SCHEMAS = ("study", "robot", "targets", "paths", "scene")
SAMPLES = 8_000_000
"""Of the workspace: a quarter of the project's own study."""
PATH_WORDS = {"joint": "move of the joints", "line": "line of the tool", "arc": "arc of the tool"}


@dataclass(frozen=True, eq=False)
class WrittenStudy:
    """What was written.

    Attributes
    ----------
    files : apart from schemas and the description of reference tables
    shortcomings : why targets or paths are none that the arm can do, or were not examined for, in words
    missing : kinds of path of which none was found beside others, in words
    """

    files: tuple[Path, ...]
    shortcomings: tuple[str, ...]
    missing: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class FoundTasks:
    """Scene, targets and paths of a study.

    Attributes
    ----------
    clear, safe : whether the targets, the paths are within limits, away from singular poses and clear of collisions;
        else the targets are drawn joint values, the path is a move between two
    shortcomings, missing : see :class:`WrittenStudy`
    """

    scene: dict[str, Any]
    spots: list[Spot]
    paths: list[dict[str, Any]]
    clear: bool
    safe: bool
    shortcomings: tuple[str, ...]
    missing: tuple[str, ...] = ()


def write_study(arm: Arm, folder: Path) -> WrittenStudy:
    """Write a study of an arm into a folder.

    Raises
    ------
    Er3aError
        a file exists where one would be written; then nothing is written
    """
    name = arm.robot.name
    own = (f"data/{kind}/{name}.yaml" for kind in ("robots", "targets", "paths"))
    places = {"README.md", STUDY, SCENE, *own, *arm.references}
    if there := sorted(place for place in places if (folder / place).exists()):
        raise Er3aError(f"{folder / there[0]} is there already, and is kept; give another folder")
    found = _found(arm)
    texts = {
        STUDY: _study(name),
        SCENE: _with_schema("scene", found.scene),
        f"data/robots/{name}.yaml": arm.text,
        f"data/targets/{name}.yaml": _with_schema("targets", {"kind": "targets", "targets": _targets(found)}),
        f"data/paths/{name}.yaml": _with_schema("paths", {"kind": "paths", "paths": found.paths}),
        "README.md": _readme(arm, found),
        **arm.references,
    }
    aids = [HELP, *(f"config/{kind}.schema.json" for kind in SCHEMAS)]
    texts |= {place: (ROOT / place).read_text(encoding="utf-8") for place in aids}
    for place, text in texts.items():
        write_atomically(folder / place, partial(Path.write_text, data=text, encoding="utf-8"))
    for surface, content in surface_files(arm.robot.meshes).items():
        write_atomically(folder / "data" / "robots" / surface, partial(Path.write_bytes, data=content))
    return WrittenStudy(
        tuple(folder / place for place in texts if place not in aids), found.shortcomings, found.missing
    )


def _found(arm: Arm) -> FoundTasks:
    """What is found in the first scene in which the arm finds targets and a path; else in that with most targets."""
    reach = reach_of(arm.robot)
    settings = parse(TrajectorySettings, read_yaml(ROOT / STUDY)["trajectory"], STUDY)
    best: tuple[dict[str, Any], TaskSearch, list[Spot]] | None = None
    for scene in scenes(arm.robot, reach):
        search = TaskSearch(arm.robot, reach, parse(SceneFile, scene, None).scene(), settings)
        spots = search.spots()
        if len(spots) >= MIN_TARGETS and (paths := search.paths(spots)):
            found = {path["kind"] for path in paths}
            missing = (f"No {_without_path(kind, search)}" for kind in search.rejected if kind not in found)
            return FoundTasks(scene, spots, paths, True, True, tuple(_unexamined(arm, search)), tuple(missing))
        if best is None or len(spots) >= len(best[2]):
            best = scene, search, spots
    assert best is not None
    scene, search, spots = best
    clear = len(spots) >= MIN_TARGETS
    if clear:
        why = " ".join(f"No {_without_path(kind, search)}." for kind in search.rejected)
        shortcoming = f"The path is a move of the joints between two targets that the arm can't be said to do. {why}"
    else:
        shortcoming = _without_targets(arm, search, len(spots))
        spots = search.any_spots()
    return FoundTasks(scene, spots, search.any_path(spots), clear, False, (shortcoming, *_unexamined(arm, search)))


def _unexamined(arm: Arm, search: TaskSearch) -> list[str]:
    """Which collisions were not looked at, if any."""
    if not search.bodies.in_error:
        return []
    pairs = ", ".join(pair.label for pair in search.bodies.in_error)
    return [f"Collisions of {pairs} were not examined: these shapes overlap where no arm's can. {_remedy(arm)}"]


def _remedy(arm: Arm) -> str:
    """What to do about shapes that overlap always."""
    return f"Correct the shapes, or allow the contact, in data/robots/{arm.robot.name}.yaml."


def _without_path(kind: str, search: TaskSearch) -> str:
    """Why there is no path of a kind."""
    faults = search.rejected[kind]
    counts = ", ".join(f"{fault}: {count}" for fault, count in faults.most_common())
    tried = f"of {faults.total()} tried none is safe ({counts})" if faults else "none begins and ends in reach"
    return f"{PATH_WORDS[kind]} among the paths: {tried}"


def _without_targets(arm: Arm, search: TaskSearch, found: int) -> str:
    """Why there are no targets."""
    counts = search.counts
    text = (
        f"Targets and path are joint values drawn at random, not tasks: of {counts.drawn} joint vectors drawn within "
        f"the limits {counts.fit or 'none'} {'is' if counts.fit == 1 else 'are'} away from the limits (8 deg or a "
        "twentieth of a joint's range), away from singular poses and clear of collisions. "
        f"{counts.near_limit} are too near to a limit, {counts.near_singular} to a singular pose, "
        f"{counts.colliding} collide"
    )
    if counts.overlaps:
        text += f" ({', '.join(f'{pair} in {count}' for pair, count in counts.overlaps)})"
    if counts.fit:
        text += f"; of {search.tried} poses tried {found or 'none'} could be solved so, and {MIN_TARGETS} are needed"
    always = [pair for pair, count in counts.overlaps if count == counts.drawn]
    if always:
        text += f". {', '.join(always)} overlap in all of them, which no arm can do"
    return f"{text}. {_remedy(arm)}" if counts.colliding else f"{text}."


def _targets(found: FoundTasks) -> list[dict[str, Any]]:
    down, other = (
        written_title("Tool straight down."),
        written_title("As the arm holds the tool at random joint values."),
    )
    numbered = enumerate(found.spots, 1)
    return [{"name": f"target_{k}", "note": down if spot.down else other, **spot.written} for k, spot in numbered]


def _study(name: str) -> str:
    """The project's own study with this robot in place of its robots, and the scene in place of its scene."""
    text = (ROOT / STUDY).read_text(encoding="utf-8")
    robots = f"robots:\n  {name}:\n    targets: data/targets/{name}.yaml\n    paths: data/paths/{name}.yaml\n\n"
    text = re.sub(r"^robots:\n(?:[ #].*\n|\n)+", robots, text, count=1, flags=re.MULTILINE)
    text = re.sub(r"data/scenes/\w+\.yaml", SCENE, text)
    text = re.sub(r"(\n  samples: )\d+", rf"\g<1>{SAMPLES}", text, count=1)
    return text.replace("The study that `make run` carries out.", "The study that `er3a run` carries out.")


def _with_schema(kind: str, content: dict[str, Any]) -> str:
    return f"# yaml-language-server: $schema=../../config/{kind}.schema.json\n{yaml_text(content)}"


def _readme(arm: Arm, found: FoundTasks) -> str:
    template = Path(__file__).with_name("README.md.j2").read_text(encoding="utf-8")
    environment = jinja2.Environment(trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined)
    columns = {kind: ",".join(form.all_columns) for kind, form in FORMATS.items()}
    page = environment.from_string(template)
    parts = {"arm": arm, "robot": arm.robot, "found": found, "columns": columns}
    return page.render(**parts, follows_tool=has_branches(arm.robot)) + "\n"
