"""The tray where the workspace stage puts it: which motions meet it, or what it stands on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from er3a.collision.along import STEP, first_overlap
from er3a.collision.scene import Box, Scene
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.left_out import body_word
from er3a.pipeline.messages.say import joined
from er3a.pipeline.player.player import moment
from er3a.pipeline.results import Stored, is_computed, read_stage
from er3a.pipeline.stages.programs.model import ProgramsResults
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.trajectory.model import TrajectoryResults
from er3a.pipeline.stages.trajectory.played import repaired
from er3a.pipeline.stages.vision.model import VisionResults
from er3a.pipeline.stages.workspace.model import PlacementSummary, PlaceSummary, StandSummary
from er3a.pipeline.study import Study
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot


@dataclass(frozen=True, eq=False)
class Tray:
    """A tray at a place, with the stand that it needs.

    Attributes
    ----------
    low, high : (3,), m, its corners; floor : m, the height that its stand comes from, None without one
    on : name of the surface below it
    """

    low: Reals
    high: Reals
    floor: float | None
    on: str = ""

    @property
    def centre(self) -> Reals:
        """Its middle (3,), m."""
        found: Reals = (self.low + self.high) / 2
        return found

    @property
    def corners(self) -> tuple[Reals, Reals]:
        """Lower and upper corner (3,), m, of it and its stand together."""
        low = self.low.copy()
        low[2] = low[2] if self.floor is None else min(low[2], self.floor)
        return low, self.high

    def scene(self, carried: Scene | None) -> Scene:
        """It and its stand as solids, for an arm that carries what that of ``carried`` does."""
        low, high = self.corners
        whole = Box("tray", transform((low + high) / 2, np.zeros(3)), high - low)
        return Scene("tray", (whole,), carried.carried if carried else ())


@dataclass(frozen=True, eq=False)
class Stretch:
    """A motion as it is stored: times (n,) in s, joints (n, joints) in rad or m, tool points (n, 3) in m."""

    name: str
    t: Reals
    q: Reals
    points: Reals

    @property
    def whole(self) -> bool:
        """Whether the arm is known all along."""
        return len(self.t) > 1 and bool(np.isfinite(self.points).all())


@dataclass(frozen=True)
class Meeting:
    """When a motion meets the tray first (s), and with what."""

    t: float
    body: str


def trays(workspace: Any) -> list[Tray]:
    """The tray at its best place, then at the best one on or over each surface; empty if these results put none."""
    placement = getattr(workspace.summary, "placement", None)
    if not isinstance(placement, PlacementSummary) or not placement.named_places:
        return []
    over = placement.over if placement.stand is None else placement.stand
    standing = [(each, each.place or each.above) for each in placement.stands]
    return [_tray(placement.best, over), *(_tray(place, stand) for stand, place in standing if place)]


def _tray(place: PlaceSummary, stand: StandSummary | None) -> Tray:
    centre, half = np.array(place.centre_m), np.array(place.size_m) / 2
    below = stand is not None and stand.place is None
    return Tray(centre - half, centre + half, stand.height_m if stand and below else None, stand.name if stand else "")


def stretches(results: object, robot: Robot) -> Iterator[Stretch]:
    """The motions of a stage's results: paths and what repairs them, programs, grasps; of others none."""
    if isinstance(results, VisionResults):
        for each in results.summary.objects:
            if each.outcome == "grasped":
                way = results.ways.take(results.ways.target == each.name)
                q = meant(robot, way.q_deg)
                yield Stretch(each.name, way.t_s, q, forward(robot, q)[:, :3, 3])
    elif isinstance(results, ProgramsResults):
        for program in results.summary.programs:
            motion = results.motion.take(results.motion.program == program.name)
            yield Stretch(program.name, motion.t_s, meant(robot, motion.q_deg), motion.xyz_mm / 1000)
    elif isinstance(results, TrajectoryResults):
        for path in results.summary.paths:
            rows = results.checks.take(results.checks.path == path.name)
            yield Stretch(path.name, rows.t_s, meant(robot, rows.q_deg), rows.xyz_mm / 1000)
            if path.chosen:
                own = (results.avoidance.path == path.name) & (results.avoidance.strategy == path.strategy)
                repair = results.avoidance.take(own)
                yield Stretch(repaired(path), repair.t_s, meant(robot, repair.q_deg), repair.xyz_mm / 1000)


def met(robot: Robot, tray: Tray, carried: Scene | None, motions: Iterable[Stretch]) -> dict[str, Meeting]:
    """Of each motion by name when its tool point or a body of the arm first meets a tray or its stand, if it does."""
    found, scene = dict[str, Meeting](), tray.scene(carried)
    for each in motions:
        at = first_inside(each.t, each.points, *tray.corners)
        meetings = [] if at is None else [Meeting(at, tr("tool point"))]
        if len(each.t) and (overlap := first_overlap(robot, scene, each.t, each.q)):
            first, _, _ = overlap[1].label.partition("/")
            meetings.append(Meeting(overlap[0], body_word(first)))
        if meetings:
            found[each.name] = min(meetings, key=lambda meeting: meeting.t)
    return found


def scene_of(study: Study, robot: str, stage: str) -> Scene | None:
    """The scene in which a stage's motions are checked; that of paths counts for programs too."""
    return study.scene(robot, stage if stage == "vision" else "trajectory")


def in_tray(study: Study, stored: Stored[Any]) -> Mapping[str, Markup] | None:
    """Of each motion of a stage that meets the tray when it first does, as a link to that moment; None where the
    robot's workspace stage puts no tray."""
    folder = stored.folder.parent / "workspace" if stored.folder else None
    placed = trays(read_stage(folder, STAGES["workspace"]).results) if folder and is_computed(folder) else []
    if not placed:
        return None
    robot = study.robot(stored.robot)
    scene = scene_of(study, stored.robot, stored.stage)
    firsts = met(robot, placed[0], scene, stretches(stored.results, robot))
    return {
        name: moment(name, each.t, tr("meets the tray at {t:.2f} s: {body}", t=each.t, body=each.body))
        for name, each in firsts.items()
    }


def compared_with_tray(met_it: Mapping[str, object] | None) -> str:
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
        "Compared at the stored times and every {turn:.1f} deg or {way:.0f} mm of a joint between them.",
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
