"""Targets that an arm reaches and paths that it can do, found by solving and by the judgement of the trajectory stage.

Poses are looked for above the scene's table with the tool straight down first, then anywhere. What is written is what
was tried: millimetres and degrees, rounded before they are solved.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.collision.scene import Scene
from er3a.errors import Er3aError
from er3a.files.path_file import PathFile, ProgramPath
from er3a.files.target_file import TargetEntry
from er3a.files.yaml_file import parse
from er3a.geometry.transforms import rpy_of
from er3a.kinematics.by_class import arm_solver
from er3a.kinematics.classes.chain_solvers import Unsolved
from er3a.kinematics.inverse import inverse
from er3a.kinematics.near_singular import NearSingular
from er3a.kinematics.singularity import characteristic_length, conditioning
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.new_study.surroundings import SampledReach
from er3a.pipeline.stages.trajectory.collisions import Surroundings, measured
from er3a.pipeline.stages.trajectory.entry import TrajectorySettings
from er3a.pipeline.stages.trajectory.judgement import judge
from er3a.pipeline.stages.trajectory.motion import motion_of
from er3a.pipeline.stages.trajectory.motion_demands import limits_of, wanted_of
from er3a.planning.commands import CommandSource
from er3a.planning.polynomial_checks import limit_intervals, rate_intervals
from er3a.planning.timing import JointLimits
from er3a.planning.tool_proof import Wanted
from er3a.robots.joint_limits import limit_margin, within
from er3a.robots.robot import Robot
from er3a.robots.shown import shown

MOST_TARGETS, LEAST_TARGETS, CHOICE = 5, 2, 30
APART = 0.1  # of the reach
TRIES, TRIES_SLOW = 300, 40
LIMIT_MARGIN_RAD = np.radians(8.0)
FULL_POSE = 6  # joints that it takes to hold any pose
FINE_BELOW = 40.0  # deg or mm
SINGULAR_MARGIN = 2.0  # times what the study calls near
LEAST_SINGULAR_VALUE = 0.05  # for arms without a closed form
DOWN_DEG = (180, 0, 0)
HEIGHTS, DISTANCES, ASIDE = (0.3, 0.4, 0.22), (0.6, 0.5, 0.7, 0.42), (0.0, 0.25, -0.25, 0.12, -0.12)  # of the reach
STEPS = ((0, 1, 0), (0, 0, 1), (1, 0, 0), (0, -1, 0), (0, 0, -1), (-1, 0, 0))
LENGTHS = (0.3, 0.2, 0.12, 0.06)  # of the reach
DURATIONS_S = (3.0, 6.0, 12.0)
SAMPLES = 50


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


@dataclass
class TaskSearch:
    """What an arm can do in a scene, by the settings of the study's trajectory stage."""

    robot: Robot
    reach: SampledReach
    scene: Scene
    settings: TrajectorySettings
    follows_tool: bool = field(init=False)
    near: NearSingular = field(init=False)
    limits: JointLimits = field(init=False)
    wanted: Wanted = field(init=False)
    bodies: Bodies = field(init=False)

    def __post_init__(self) -> None:
        self.follows_tool = has_branches(self.robot)
        self.limits, self.wanted = limits_of(self.robot, self.settings), wanted_of(self.robot, self.settings)
        self.near, self.bodies = self.wanted.near, Bodies(self.robot, self.scene)

    def spots(self) -> list[Spot]:
        """Poses far from one another: at most ``MOST_TARGETS``, fewer where the arm reaches no more of those tried."""
        slow = self.robot.joints > FULL_POSE or isinstance(arm_solver(self.robot).chain, Unsolved)
        tries = TRIES_SLOW if slow else TRIES
        tried = (self._spot(written) for written in islice(self._candidates(), tries))
        choice = list(islice(filter(None, tried), CHOICE))
        found = choice[:1]
        while choice and len(found) < MOST_TARGETS:
            away = [min(_distance(spot, other) for other in found) for spot in choice]
            if max(away) < APART * self.reach.radius * 1000:
                break
            found.append(choice[int(np.argmax(away))])
        return found

    def any_spots(self) -> list[Spot]:
        """Poses of drawn joint values, whatever is in the way."""
        reach = self.reach
        values = [self._written(q) for q in reach.q[:MOST_TARGETS]]
        written = [{"q_deg": each, "q_ref_deg": [*each]} for each in values]
        points = (reach.poses[:MOST_TARGETS, :3, 3] * 1000).tolist()
        return [Spot(pose, (x, y, z), q, "") for pose, (x, y, z), q in zip(written, points, reach.q)]

    def any_path(self, spots: list[Spot]) -> list[dict[str, Any]]:
        """A joint move between two of them, whatever is in the way."""
        return list(islice(self._joint_moves(spots), len(DURATIONS_S) - 1, len(DURATIONS_S)))

    def paths(self, spots: list[Spot]) -> list[dict[str, Any]]:
        """Entries of a path file, each safe: a joint move and, where the arm has a closed form, a line and an arc."""
        found = [self._first_safe(self._joint_moves(spots))]
        if self.follows_tool:
            found += [self._first_safe(self._lines(spots)), self._first_safe(self._arcs(spots))]
        return [entry for entry in found if entry]

    def _candidates(self) -> Iterator[dict[str, list[float]]]:
        """Poses to try: above the ground on the side where the arm works, tool down; then those of drawn joints.

        Arms with fewer than six joints get joint values alone: a rounded pose is none that they can hold. Those with
        more get the joint values that settle what a pose leaves open.
        """
        if self.robot.joints < FULL_POSE:
            for q in self.reach.q:
                yield {"q_deg": self._written(q)}
            return
        if self.robot.joints > FULL_POSE:
            middle = {"q_ref_deg": self._written(self.reach.q.mean(axis=0))}
            yield from (pose | middle for pose in islice(self._above_ground(), TRIES_SLOW // 2))
            yield from (pose | {"q_ref_deg": self._written(q)} for pose, q in zip(self._drawn(), self.reach.q))
        else:
            yield from self._above_ground()
            yield from self._drawn()

    def _above_ground(self) -> Iterator[dict[str, list[float]]]:
        base = self.robot.base
        if not self.reach.stands:
            return
        turn = np.radians(self.reach.side_deg)
        out, aside = np.array([np.cos(turn), np.sin(turn), 0]), np.array([-np.sin(turn), np.cos(turn), 0])
        for height in HEIGHTS:
            for distance in DISTANCES:
                for share in ASIDE:
                    point = base[:3, 3] + self.reach.radius * (distance * out + share * aside + [0, 0, height])
                    yield {"xyz_mm": _millimetres(point), "rpy_deg": [180.0, 0.0, 0.0]}

    def _drawn(self) -> Iterator[dict[str, list[float]]]:
        for pose in self.reach.poses:
            yield {"xyz_mm": _millimetres(pose[:3, 3]), "rpy_deg": np.round(np.degrees(rpy_of(pose))).tolist()}

    def _spot(self, pose: dict[str, list[float]]) -> Spot | None:
        """The pose with its best solution: within the limits, clear of everything, far from singular."""
        try:
            target = parse(TargetEntry, {"name": "spot", **pose}, None).target(self.robot)
            solutions = inverse(self.robot, target.T, target.q_ref, self_motion_rows=True)
        except Er3aError:
            return None
        margin = limit_margin(self.robot, solutions.q)
        rows = np.flatnonzero(solutions.solved & within(self.robot, solutions.q) & self._roomy(solutions.q))
        rows = rows[self._regular(solutions.q[rows])]
        rows = rows[self.bodies.free(solutions.q[rows])]
        if not rows.size:
            return None
        best = int(rows[margin[rows].argmax()])
        x, y, z = (target.T[:3, 3] * 1000).tolist()
        written = {key: [*values] for key, values in pose.items()}  # lists of its own: YAML would alias those it shares
        return Spot(written, (x, y, z), solutions.q[best], str(solutions.label[best]))

    def _roomy(self, q: Reals) -> Flags:
        """Whether joints (N, n) are away from their limits, by 8 deg or a twentieth of the range."""
        robot = self.robot
        least = np.minimum(np.where(robot.slides, np.inf, LIMIT_MARGIN_RAD), (robot.upper - robot.lower) / 20)
        room = (np.minimum(q - robot.lower, robot.upper - q) > least) | robot.continuous
        return np.asarray(room.all(axis=-1))

    def _written(self, q: Reals) -> list[float]:
        """Joint values (n,) as files have them: whole degrees and mm, hundredths where the range is small."""
        step = np.where(shown(self.robot, self.robot.upper - self.robot.lower) > FINE_BELOW, 1.0, 0.01)
        values: list[float] = (np.round(np.round(shown(self.robot, q) / step) * step, 2) + 0.0).tolist()
        return values

    def _regular(self, q: Reals) -> Any:
        if self.follows_tool:
            return self.near.margin(self.robot, q) > SINGULAR_MARGIN
        smallest = conditioning(self.robot, q, characteristic_length(self.robot)).smallest_singular_value
        return smallest > LEAST_SINGULAR_VALUE

    def _joint_moves(self, spots: list[Spot]) -> Iterator[dict[str, Any]]:
        for first, start in enumerate(spots):
            for end in spots[first + 1 :]:
                degrees = [self._written(spot.q) for spot in (start, end)]
                for duration in DURATIONS_S:
                    yield {
                        "name": "joint_move",
                        "kind": "joint",
                        "title": "All joints together, from one target to another",
                        "title_zh": "各关节同时运动，从一个目标到另一个",
                        "start_deg": degrees[0],
                        "end_deg": degrees[1],
                        "duration_s": duration,
                        "samples": SAMPLES,
                    }

    def _lines(self, spots: list[Spot]) -> Iterator[dict[str, Any]]:
        for length in LENGTHS:
            for spot in spots:
                for step in STEPS:
                    end = _shifted(spot, length * self.reach.radius * np.array(step))
                    titles = {"title": "A straight line, the tool held as it is", "title_zh": "直线，工具姿态不变"}
                    yield from _moves("line", titles, spot, {"end": end})

    def _arcs(self, spots: list[Spot]) -> Iterator[dict[str, Any]]:
        titles = {"title": "Half a circle, the tool held as it is", "title_zh": "半圆，工具姿态不变"}
        for length in LENGTHS:
            for spot in spots:
                for step, side in zip(STEPS, (*STEPS[2:], *STEPS[:2])):
                    way, bulge = (length * self.reach.radius * np.array(each) for each in (step, side))
                    via = _shifted(spot, way / 2 + bulge / 2)["xyz_mm"]
                    yield from _moves("arc", titles, spot, {"via_mm": via, "end": _shifted(spot, way)})

    def _first_safe(self, entries: Iterator[dict[str, Any]]) -> dict[str, Any] | None:
        return next((entry for entry in entries if self._safe(entry)), None)

    def _safe(self, written: dict[str, Any]) -> bool:
        """Whether the trajectory stage would call a path safe."""
        entry = parse(PathFile, {"kind": "paths", "paths": [written]}, None).paths[0]
        assert not isinstance(entry, ProgramPath)
        try:
            motion = motion_of(
                self.robot, entry, self.settings.checks_per_sample, CommandSource(None, ""), {}, self.wanted
            )
        except Er3aError:
            return False
        if self.follows_tool:
            if judge(self.robot, motion, self.near, self.limits).verdict != "safe":
                return False
        elif (
            (curve := motion.polynomials) is None
            or limit_intervals(self.robot, curve)
            or any(rate_intervals(curve, limit) for limit in self.limits.rates)
        ):
            return False
        around = Surroundings(self.bodies, self.settings.penetration_tolerance_mm / 1000)
        return not measured(around, motion).contacts


def _moves(kind: str, titles: dict[str, str], spot: Spot, rest: dict[str, Any]) -> Iterator[dict[str, Any]]:
    branch = spot.label.replace("_elbow", ", elbow").replace("_no_flip", ", no flip").replace("_flip", ", flip")
    for duration in DURATIONS_S:
        yield {
            "name": kind,
            "kind": kind,
            **titles,
            "start": spot.pose,
            "start_branch": branch.replace("_", " "),
            **rest,
            "duration_s": duration,
            "samples": SAMPLES,
        }


def _distance(spot: Spot, other: Spot) -> float:
    return float(np.linalg.norm(np.subtract(spot.xyz_mm, other.xyz_mm)))


def _millimetres(point: Reals) -> list[float]:
    rounded: list[float] = (np.round(point * 200) * 5 + 0.0).tolist()  # to 5 mm
    return rounded


def _shifted(spot: Spot, way: Reals) -> dict[str, list[float]]:
    return {"xyz_mm": _millimetres(np.array(spot.xyz_mm) / 1000 + way), "rpy_deg": [*spot.written["rpy_deg"]]}
