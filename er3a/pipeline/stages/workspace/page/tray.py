"""The tray where the workspace stage can put it: which motions meet it, or what it stands on, and where it is in the
way of the fewest."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from er3a.by_value import by_identity
from er3a.collision.along import first_overlap
from er3a.collision.scene import Box, Scene
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import as_text, own_title, tr
from er3a.pipeline.messages.say import joined
from er3a.pipeline.messages.workspace import millimetres
from er3a.pipeline.results import AbsentResults, Stored, is_computed, read_stage
from er3a.pipeline.stages.expectations import unmet_expectations
from er3a.pipeline.stages.programs.model import ProgramsResults, ProgramSummary
from er3a.pipeline.stages.programs.page.played import faults as program_faults
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.trajectory.model import PathSummary, TrajectoryResults
from er3a.pipeline.stages.trajectory.page.played import faults as path_faults
from er3a.pipeline.stages.vision.model import ObjectResult, VisionResults
from er3a.pipeline.stages.workspace.model import PlacementSummary, PlaceSummary, StandSummary, TaskSummary
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.page import whole_sentence
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

MOTIONS = {name: stage.motions for name, stage in STAGES.items() if stage.motions}


def _box(name: str, low: Reals, high: Reals) -> Box:
    """A level box between two corners (3,), m."""
    return Box(name, transform((low + high) / 2, np.zeros(3)), high - low)


@by_identity
class Tray:
    """A tray at a place, with the stand that it needs.

    Attributes
    ----------
    place : of the tray
    below : the surface that it stands on or over, None in open space
    task : what the tool does there
    """

    place: PlaceSummary
    below: StandSummary | None
    task: TaskSummary

    @property
    def low(self) -> Reals:
        """Its lower corner (3,), m."""
        found: Reals = np.array(self.place.centre_m) - np.array(self.place.size_m) / 2
        return found

    @property
    def high(self) -> Reals:
        """Its upper corner (3,), m."""
        return self.low + self.place.size_m

    @property
    def floor(self) -> float | None:
        """The height (m) that its stand comes from; None without one."""
        return self.below.height_m if self.below and self.below.place is None else None

    @property
    def name(self) -> str:
        """The surface that it is on or over, in few words."""
        return tr("tray over {name}", name=own_title(self.below.name)) if self.below else tr("tray")

    @property
    def place_text(self) -> str:
        """Its centre, or that it is in the air."""
        if self.below is None:
            return whole_sentence(self.where)
        return tr("Tray: ({centre}) mm.", centre=millimetres(self.place.centre_m))

    @property
    def where(self) -> str:
        """On what it stands."""
        if self.below is None:
            return tr("In the air: no surface is known there")
        name = own_title(self.below.name)
        if self.floor is None:
            return tr("On {name}", name=name)
        return tr("On a stand {gap} mm high on {name}", gap=millimetres([self.low[2] - self.floor]), name=name)

    @property
    def line(self) -> str:
        """Where it stands, its centre and its edges."""
        return tr(
            "{where}, centre ({centre}) mm, edges {size} mm along x, y, z",
            where=self.where,
            centre=millimetres(self.place.centre_m),
            size=self.edges,
        )

    @property
    def lines(self) -> str:
        """It and its stand as lines of a scene file."""
        boxes = [
            (box.name, *(np.round(1000 * each, 3).tolist() for each in (box.size, box.T[:3, 3]))) for box in self.parts
        ]
        return "\n".join(
            ["boxes:", *(f"  - {{name: {name}, size_mm: {size}, xyz_mm: {at}}}" for name, size, at in boxes)]
        )

    @property
    def edges(self) -> str:
        """Its edges along x, y and z, mm."""
        return " × ".join(as_text(1000 * edge, ".6g") for edge in self.place.size_m)

    @property
    def corners(self) -> tuple[Reals, Reals]:
        """Lower and upper corner (3,), m, of it and its stand together."""
        low = self.low
        low[2] = low[2] if self.floor is None else min(low[2], self.floor)
        return low, self.high

    @property
    def parts(self) -> list[Box]:
        """It, and the stand that it needs."""
        found = [_box("tray", self.low, self.high)]
        if self.floor is not None:
            found.append(_box("stand", np.array([*self.low[:2], self.floor]), np.array([*self.high[:2], self.low[2]])))
        return found

    def scene(self, carried: Scene | None) -> Scene:
        """It and its stand as solids, for an arm that carries what that of ``carried`` does."""
        return Scene("tray", (_box("tray", *self.corners),), carried.carried if carried else ())


@by_identity
class StoredMotion:
    """A motion as it is stored: times (n,) in s, joints (n, joints) in rad or m, tool points (n, 3) in m."""

    name: str
    t: Reals
    q: Reals
    points: Reals


def trays(workspace: Any) -> list[Tray]:
    """The tray at its best place, then at the best ones on or over other surfaces; empty if these results put none."""
    placement = getattr(workspace.summary, "placement", None)
    if not isinstance(placement, PlacementSummary) or not placement.named_places:
        return []
    best, task = placement.best, placement.task
    below = placement.over if placement.stand is None else placement.stand
    standing = [(stand.place or stand.above, stand) for stand in placement.stands]
    return [
        Tray(best, below, task),
        *(Tray(place, stand, task) for place, stand in standing if place and place != best),
    ]


def stored_motions(results: object, robot: Robot) -> Iterator[StoredMotion]:
    """The motions of a stage's results: paths, programs, grasps; of others none."""
    if isinstance(results, VisionResults):
        for each in results.summary.objects:
            if each.outcome == "grasped":
                way = results.ways.take(results.ways.target == each.name)
                q = meant(robot, way.q_deg)
                yield StoredMotion(each.name, way.t_s, q, forward(robot, q)[:, :3, 3])
    elif isinstance(results, ProgramsResults):
        for program in results.summary.programs:
            motion = results.motion.take(results.motion.program == program.name)
            yield StoredMotion(program.name, motion.t_s, meant(robot, motion.q_deg), motion.xyz_mm / 1000)
    elif isinstance(results, TrajectoryResults):
        for path in results.summary.paths:
            rows = results.checks.take(results.checks.path == path.name)
            yield StoredMotion(path.name, rows.t_s, meant(robot, rows.q_deg), rows.xyz_mm / 1000)


def met(robot: Robot, tray: Tray, carried: Scene | None, motions: Iterable[StoredMotion]) -> list[str]:
    """Names of the motions of which the tool point or a body of the arm meets a tray or its stand."""
    scene = tray.scene(carried)
    return [
        each.name
        for each in motions
        if len(each.t) and (enters(each.points, *tray.corners) or first_overlap(robot, scene, each.t, each.q))
    ]


def scene_of(study: Study, robot: str, stage: str) -> Scene | None:
    """The scene in which a stage's motions are checked; that of paths counts for programs too."""
    return study.scene(robot, stage if stage == "vision" else "trajectory")


@by_identity
class Tried:
    """A tray at a place, and the names of the motions that pass without it, but meet it or its stand there."""

    tray: Tray
    hindered: Sequence[str]


@by_identity
class Placing:
    """Where to put the tray: of the best places on or over each surface the one in the way of the fewest motions that
    pass without it, of equals the one that comes first.

    Attributes
    ----------
    tried : that place, then the others
    passing : how many motions pass without the tray; None where there are none to compare with it
    """

    tried: Sequence[Tried]
    passing: int | None

    @property
    def tray(self) -> Tray:
        """The tray at that place."""
        return self.tried[0].tray

    @property
    def hindrance(self) -> str:
        """Of which of the motions that pass it is in the way."""
        if self.passing is None:
            return tr("no path, program or grasp was compared with it")
        hindered = self.tried[0].hindered
        said = tr(
            "in the way of {some} of the {count} motions that pass without it", some=len(hindered), count=self.passing
        )
        return joined([said, joined(hindered, ", ")], ": ")


def placing(
    stored: Mapping[str, Stored[Any]],
    robot: Robot,
    scenes: Mapping[str, Scene | None],
    sound: Mapping[str, Sequence[str]],
) -> Placing | None:
    """Where to put the tray of the study among the places of the workspace stage; None if it puts none.

    ``scenes``: of each stage, for what the arm carries. ``sound``: what passes in each.
    """
    places = trays(stored["workspace"].results) if "workspace" in stored else []
    if not places:
        return None
    motions = {
        stage: [each for each in stored_motions(stored[stage].results, robot) if each.name in sound.get(stage, ())]
        for stage in MOTIONS
        if stage in stored
    }
    tried = [
        Tried(tray, sum((met(robot, tray, scenes.get(stage), each) for stage, each in motions.items()), list[str]()))
        for tray in places
    ]
    passing = sum(map(len, motions.values())) if motions else None
    return Placing(sorted(tried, key=lambda each: len(each.hindered)), passing)


def sound_motions(results: object) -> list[str]:
    """Names of a stage's motions that pass as they are."""
    if isinstance(results, VisionResults):
        return [each.name for each in results.summary.objects if each.grasp and _is_sound(each, results)]
    followed: Sequence[ProgramSummary | PathSummary]
    if isinstance(results, ProgramsResults):
        followed, faults = results.summary.programs, program_faults(results)
    elif isinstance(results, TrajectoryResults):
        followed, faults = results.summary.paths, path_faults(results)
    else:
        return []
    unmet = unmet_expectations(followed)
    faulty = {fault.name for fault in faults} | {each.name for each in (unmet.unmet if unmet else ())}
    return [each.name for each in followed if each.name not in faulty]


def _is_sound(grasped: ObjectResult, results: VisionResults) -> bool:
    """Whether a grasp passes: no other outcome was expected, and no assumed shape is near it."""
    shapes = results.summary.verdict.shapes
    return grasped.expect in (None, "grasped") and (shapes is None or grasped.name not in shapes.near)


def found_by(stored: Stored[Any], stage: str, robot: str = "") -> Stored[Any] | None:
    """What another stage found, of the same robot or of one that is elsewhere; None where it found nothing.

    Parameters
    ----------
    stored : what a stage found, as it was read from a folder
    robot : way from the folder of the stage's robot to that of the other one
    """
    folder = stored.folder.parent / robot / stage if stored.folder else None
    found = read_stage(folder, STAGES[stage]) if folder and is_computed(folder) else None
    return None if found and isinstance(found.results, AbsentResults) else found


def placing_of(study: Study, stored: Stored[Any]) -> Placing | None:
    """Where to put the tray, from the results that lie beside those of a stage.

    None if that is nowhere, or evidence contradicts the table that all rests on.
    """
    if stored.withheld:
        return None
    names = ("workspace", *MOTIONS)
    found = {name: each for name in names if (each := found_by(stored, name))}
    found[stored.stage] = stored
    if "workspace" not in found:
        return None
    sound = {stage: sound_motions(found[stage].results) for stage in MOTIONS if stage in found}
    scenes = {stage: scene_of(study, stored.robot, stage) for stage in sound}
    return placing(found, study.robot(stored.robot), scenes, sound)


def enters(points: Reals, low: Reals, high: Reals) -> bool:
    """Whether a point that moves straight from each of ``points`` (n, 3) to the next enters a box with these corners
    (3,)."""
    way = np.diff(points, axis=0, append=points[-1:])
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([low - points, high - points]) / way
    ends = np.sort(np.where(np.isnan(ends), [[[-np.inf]], [[np.inf]]], ends), axis=0)  # 0/0: along a face
    inside = np.maximum(ends[0].max(axis=1), 0) <= np.minimum(ends[1].min(axis=1), 1)
    return bool((inside & np.isfinite(points + way).all(axis=1)).any())
