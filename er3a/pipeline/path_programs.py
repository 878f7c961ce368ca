"""The paths of a file as robot programs, outside a study."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from er3a.by_value import frozen
from er3a.collision.bodies import Bodies
from er3a.collision.pairs import PENETRATION_TOLERANCE
from er3a.collision.scene import Scene
from er3a.errors import InputError
from er3a.files.path_file import load_paths
from er3a.finding import Finding
from er3a.pipeline.scope import Open
from er3a.pipeline.stages.trajectory.judgement import judged, min_clearance
from er3a.pipeline.stages.trajectory.motion import CHOSEN, MotionTask, listed_motions
from er3a.pipeline.stages.trajectory.written_programs import LONGEST_NAME, near_assumed_shapes, written
from er3a.planning.names import PathVerdict
from er3a.program_check.check_program import CheckOptions, assumed_limits
from er3a.programs.languages import WITHOUT_JOINTS, not_written
from er3a.programs.program_names import LanguageName
from er3a.programs.writing import program_name
from er3a.robots.robot import Robot

CHECKS_PER_SAMPLE = 5
SEED = 0  # of the planner


@frozen
class PathProgram:
    """A path as a program.

    Attributes
    ----------
    files : texts by name; None where it was refused
    """

    name: str
    verdict: PathVerdict
    files: Mapping[str, str] | None
    findings: tuple[Finding, ...] = ()
    open: tuple[Open, ...] = ()


def programs_of(
    file: Path, robot: Robot, language: LanguageName, scene: Scene | None, only: Sequence[str] | None, unsafe: bool
) -> Iterator[PathProgram]:
    """The paths of a file one after another, by the thresholds of a check of programs.

    Raises
    ------
    InputError
        for a path file that can't be used, a name that it does not have, an arm that the language can't move by joints
    """
    if reason := not_written(language, robot):
        raise InputError(None, None, reason, WITHOUT_JOINTS)
    bodies, limits = Bodies(robot, scene), assumed_limits(robot, CheckOptions())
    task = MotionTask(robot, bodies, PENETRATION_TOLERANCE, limits, SEED)
    listed = load_paths(file).paths
    missing = next((name for name in only or () if name not in {entry.name for entry in listed}), None)
    if missing is not None:
        raise InputError(file, "paths", f"there is no path '{missing}'", f"Known: {', '.join(e.name for e in listed)}")
    for each in listed_motions(file, task, CHECKS_PER_SAMPLE):
        if only and each.listed not in only:
            continue
        if each.refused:
            raise each.refused
        if each.motion is None:
            yield PathProgram(each.name, each.outcome_unfollowed, None)
            continue
        found = judged(task, each.motion)
        verdict = found.verdict
        rest = tuple(left for left in each.open if left.reason not in CHOSEN)
        elsewhere = language != "csv" and any(left.reason == "points_missed" for left in rest)
        if ((verdict != "safe" or elsewhere) and not unsafe) or not np.isfinite(each.motion.q[0]).all():
            yield PathProgram(each.name, verdict, None, open=rest)
            continue
        near = near_assumed_shapes(robot, each.name, min_clearance(found.along), CheckOptions.assumed_margin)
        files, findings = written(robot, each.motion, verdict, language, near, limits.speed)
        name = program_name(each.name, LONGEST_NAME)
        yield PathProgram(each.name, verdict, {name + suffix: text for suffix, text in files.items()}, findings, rest)
