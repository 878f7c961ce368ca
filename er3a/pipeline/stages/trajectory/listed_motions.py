"""The motions of a path file, one after another, as every stage that looks at paths takes them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.errors import NotWristPartitionedError
from er3a.files.path_file import load_paths
from er3a.files.scene_file import load_scene
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.trajectory.entry import TrajectorySettings
from er3a.pipeline.stages.trajectory.motion import Motion, motion_of
from er3a.pipeline.stages.trajectory.motion_demands import planning_of, wanted_of
from er3a.pipeline.stages.trajectory.program_paths import planned_entries
from er3a.pipeline.study import Study
from er3a.planning.class_follow import PathEndsError
from er3a.planning.commands import CommandSource
from er3a.planning.tool_proof import Wanted
from er3a.planning.way_around import PlanningTask


@dataclass(frozen=True, eq=False)
class ListedMotion:
    """A motion, the entry that it belongs to, and its name (a program's stretches have names of their own).

    ``motion`` is None for a path of the tool that an arm of its class can't be made to follow, or not to its end;
    ``stops`` is then the time (s) beyond which it is not.
    """

    listed: str
    name: str
    title: str
    motion: Motion | None
    stops: float | None = None


def study_motions(study: Study, name: str, checks_per_sample: int) -> Iterator[ListedMotion]:
    """The motions of a robot of the study, in the scene of its trajectory stage; see :func:`listed_motions`."""
    robot, settings, scene = study.robot(name), study.section(TrajectorySettings), study.scene(name, "trajectory")
    bodies = Bodies(robot, load_scene(scene) if scene else None)
    task = planning_of(robot, settings, bodies, study.seed)
    return listed_motions(Path(study.entry(name).paths), task, wanted_of(robot, settings), checks_per_sample)


def listed_motions(file: Path, task: PlanningTask, wanted: Wanted, checks_per_sample: int) -> Iterator[ListedMotion]:
    """Plan the paths of a file.

    Parameters
    ----------
    task : the arm, what it must not meet and its limits, for motions that are to be planned
    wanted : what is to be settled of paths of the tool
    checks_per_sample : points checked between two samples to begin with

    Raises
    ------
    InputError
        for what can't be planned
    """
    ends: dict[str, Reals] = {}
    for i, listed in enumerate(load_paths(file).paths):
        source = CommandSource(file, f"paths[{i}]")
        for entry in planned_entries(task.robot, listed, source):
            stops = None
            try:
                motion = motion_of(task.robot, entry, checks_per_sample, source, ends, wanted, task=task)
            except NotWristPartitionedError:
                motion = None
            except PathEndsError as error:
                motion, stops = None, error.t
            end = np.full(task.robot.joints, np.nan) if motion is None else motion.q[-1]
            ends[entry.name] = ends[listed.name] = end
            yield ListedMotion(listed.name, entry.name, entry.title, motion, stops)
