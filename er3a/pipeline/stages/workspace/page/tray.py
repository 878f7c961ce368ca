"""The tray where the workspace stage can put it: which motions meet it, or what it stands on, and where it is in the
way of the fewest."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from er3a.by_value import by_identity, frozen
from er3a.collision.along import STEP, first_overlap
from er3a.collision.pairs import names_of
from er3a.collision.scene import Box, Scene
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import as_text, own_title, tr
from er3a.pipeline.messages.say import joined
from er3a.pipeline.messages.scope import body_word
from er3a.pipeline.messages.workspace import millimetres
from er3a.pipeline.player.player import moment
from er3a.pipeline.results import AbsentResults, Stored, is_computed, read_stage
from er3a.pipeline.stages.expectations import unmet_expectations
from er3a.pipeline.stages.inverse.model import TargetRows
from er3a.pipeline.stages.programs.model import ProgramsResults, ProgramSummary
from er3a.pipeline.stages.programs.page.played import faults as program_faults
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.trajectory.model import PathSummary, TrajectoryResults
from er3a.pipeline.stages.trajectory.page.played import faults as path_faults
from er3a.pipeline.stages.trajectory.page.played import repaired
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
        """Its centre, and how high its stand is, or else what it is on."""
        if self.floor is None:
            return whole_sentence(self.where)
        centre, gap = millimetres(self.place.centre_m), millimetres([self.low[2] - self.floor])
        return tr("Tray at ({centre}) mm, stand {gap} mm.", centre=centre, gap=gap)

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

    @property
    def whole(self) -> bool:
        """Whether the arm is known all along."""
        return len(self.t) > 1 and bool(np.isfinite(self.points).all())


@frozen
class Meeting:
    """When a motion meets the tray first (s), and with what."""

    t: float
    body: str

    @property
    def text(self) -> str:
        """When, and with what."""
        return tr("meets the tray at {t:.2f} s: {body}", t=self.t, body=self.body)


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
    """The motions of a stage's results: paths and what repairs them, programs, grasps; of others none."""
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
            if path.chosen:
                own = (results.avoidance.path == path.name) & (results.avoidance.strategy == path.strategy)
                repair = results.avoidance.take(own)
                yield StoredMotion(repaired(path), repair.t_s, meant(robot, repair.q_deg), repair.xyz_mm / 1000)


def met(robot: Robot, tray: Tray, carried: Scene | None, motions: Iterable[StoredMotion]) -> dict[str, Meeting]:
    """Of each motion by name when its tool point or a body of the arm first meets a tray or its stand, if it does."""
    found, scene = dict[str, Meeting](), tray.scene(carried)
    for each in motions:
        at = first_inside(each.t, each.points, *tray.corners)
        meetings = [] if at is None else [Meeting(at, tr("tool point"))]
        if len(each.t) and (overlap := first_overlap(robot, scene, each.t, each.q)):
            first, _ = names_of(overlap[1])
            meetings.append(Meeting(overlap[0], body_word(first)))
        if meetings:
            found[each.name] = min(meetings, key=lambda meeting: meeting.t)
    return found


def scene_of(study: Study, robot: str, stage: str) -> Scene | None:
    """The scene in which a stage's motions are checked; that of paths counts for programs too."""
    return study.scene(robot, stage if stage == "vision" else "trajectory")


@by_identity
class Tried:
    """A tray at a place, and of each stage's motions by name when they meet it or its stand first."""

    tray: Tray
    met: Mapping[str, Mapping[str, Meeting]]


@by_identity
class Placing:
    """Where to put the tray: of the best places on or over each surface the one in the way of the fewest motions that
    pass without it, of equals the one that comes first.

    Attributes
    ----------
    tried : that place, then the others
    sound : per stage, in the order of ``met``, the names of motions that pass without the tray
    targets : those with a solution, whose tool points lie in the tray or its stand
    unseen : names of motions that are not known, or not all
    """

    tried: tuple[Tried, ...]
    sound: Mapping[str, Sequence[str]]
    targets: tuple[str, ...]
    unseen: tuple[str, ...]

    @property
    def tray(self) -> Tray:
        """The tray at that place."""
        return self.tried[0].tray

    @property
    def met(self) -> Mapping[str, Mapping[str, Meeting]]:
        """What meets it there."""
        return self.tried[0].met

    @property
    def passing(self) -> int:
        """How many motions pass without it."""
        return sum(len(self.sound.get(stage, ())) for stage in self.met)

    def hindered(self, tried: Tried) -> dict[str, list[str]]:
        """Of motions that pass without the tray those that meet it at a place, per stage."""
        found = {stage: [name for name in self.sound.get(stage, ()) if name in met] for stage, met in tried.met.items()}
        return {stage: names for stage, names in found.items() if names}

    @property
    def hindrance(self) -> str:
        """Of how many of the motions that pass it is in the way."""
        some = sum(map(len, self.hindered(self.tried[0]).values()))
        if not self.met:
            return tr("no path, program or grasp was compared with it")
        if not self.passing:
            return tr("no motion passes that it could be in the way of")
        if not some:
            return tr(
                "in the way of none of the {count} motions that pass without it; nothing was planned around it",
                count=self.passing,
            )
        return tr("in the way of {some} of the {count} motions that pass without it", some=some, count=self.passing)

    @property
    def compared(self) -> str:
        """What was compared with the tray, and what of it was found; empty where nothing was."""
        if not self.met:
            return ""
        said = [compared_with_tray([name for found in self.met.values() for name in found])]
        if self.targets:
            said.append(tr("Targets in it or its stand: {names}.", names=joined(self.targets, ", ")))
        if self.unseen:
            said.append(tr("Not compared, or not all of it: {names}.", names=joined(self.unseen, ", ")))
        return joined(said, " ")


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
    motions = {stage: [*stored_motions(stored[stage].results, robot)] for stage in MOTIONS if stage in stored}
    tried = [
        Tried(tray, {stage: met(robot, tray, scenes.get(stage), each) for stage, each in motions.items()})
        for tray in places
    ]
    best = min(
        tried, key=lambda each: sum(len(found.keys() & sound.get(stage, ())) for stage, found in each.met.items())
    )
    unseen = [each.name for moved in motions.values() for each in moved if not each.whole]
    for stage in motions:
        unseen += [each.name for each in getattr(stored[stage].results.summary, "not_followed", ())]
    low, high = (1000 * corner for corner in best.tray.corners)
    targets = stored["inverse"].results.targets if "inverse" in stored else TargetRows.empty()
    inside = targets.reached & np.all((low <= targets.point_mm) & (targets.point_mm <= high), axis=1)
    return Placing(
        (best, *(each for each in tried if each is not best)), sound, tuple(targets.target[inside]), tuple(unseen)
    )


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
    names = ("workspace", "inverse", *MOTIONS)
    found = {name: each for name in names if (each := found_by(stored, name))}
    found[stored.stage] = stored
    if "workspace" not in found:
        return None
    sound = {stage: sound_motions(found[stage].results) for stage in MOTIONS if stage in found}
    scenes = {stage: scene_of(study, stored.robot, stage) for stage in sound}
    return placing(found, study.robot(stored.robot), scenes, sound)


def met_in_tray(study: Study, stored: Stored[Any]) -> Mapping[str, Meeting] | None:
    """Of each motion of a stage that meets the tray when it first does; None where no place of the tray is known."""
    found = placing_of(study, stored)
    return None if found is None else found.met.get(stored.stage, {})


def in_tray(study: Study, stored: Stored[Any]) -> Mapping[str, Markup] | None:
    """The same as links to these moments."""
    return linked(met_in_tray(study, stored))


def linked(met: Mapping[str, Meeting] | None) -> Mapping[str, Markup] | None:
    """When motions meet the tray, as links to these moments of the page's player."""
    return None if met is None else {name: moment(name, each.t, each.text) for name, each in met.items()}


def compared_with_tray(met_it: Collection[str] | None) -> str:
    """What a page says of motions that were compared with the tray, ``met_it`` those that do; empty for None."""
    if met_it is None:
        return ""
    found = (
        tr(
            "“Meets the tray”: when the tool point, or a link's shape or what is carried, is first found in the tray "
            "or its stand."
        )
        if met_it
        else tr("Neither the tool point nor a link's shape nor what is carried was found in the tray or its stand.")
    )
    how = tr(
        "Compared at the stored times and every {turn:.1f}° or {way:.0f} mm of a joint between them.",
        turn=np.degrees(STEP),
        way=1000 * STEP,
    )
    return joined([found, how], " ")


def first_inside(t: Reals, points: Reals, low: Reals, high: Reals) -> float | None:
    """When a point that moves straight from each of ``points`` (n, 3) at ``t`` (n,) to the next enters a box first.

    ``low``, ``high``: (3,), the box's corners. None if it never does.
    """
    way = np.diff(points, axis=0, append=points[-1:])
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([low - points, high - points]) / way
    ends = np.sort(np.where(np.isnan(ends), [[[-np.inf]], [[np.inf]]], ends), axis=0)  # 0/0: along a face
    enters, leaves = np.maximum(ends[0].max(axis=1), 0), np.minimum(ends[1].min(axis=1), 1)
    (hits,) = np.nonzero((enters <= leaves) & np.isfinite(points + way).all(axis=1))
    if not len(hits):
        return None
    row = hits[0]
    return float(t[row] + enters[row] * (t[min(row + 1, len(t) - 1)] - t[row]))
