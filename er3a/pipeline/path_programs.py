"""Programs of the paths of a file, outside of any study: each path is checked first, as the trajectory stage does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.collision.scene import Scene
from er3a.errors import InputError
from er3a.files.path_file import load_paths
from er3a.pipeline.stages.trajectory.collisions import Surroundings, collisions, measured
from er3a.pipeline.stages.trajectory.judgement import judge
from er3a.pipeline.stages.trajectory.listed_motions import listed_motions
from er3a.pipeline.stages.trajectory.written_programs import LONGEST_NAME, written
from er3a.planning.path_verdicts import PATH_VERDICTS, PathVerdict
from er3a.planning.tool_proof import Wanted
from er3a.planning.way_around import PlanningTask
from er3a.program_check.check_program import NEAR, CheckOptions, assumed_limits
from er3a.programs.arm_joints import not_written
from er3a.programs.program_findings import WriteFinding
from er3a.programs.syntax import Language
from er3a.programs.write_program import WITHOUT_JOINTS
from er3a.programs.writing import program_name
from er3a.robots.robot import Robot

CHECKS_PER_SAMPLE = 5
TOLERANCE = 0.001  # m
SEED = 0  # of the planner


@dataclass(frozen=True)
class PathProgram:
    """A path as a program.

    Attributes
    ----------
    files : texts by name; None where it was refused
    """

    name: str
    verdict: PathVerdict
    files: Mapping[str, str] | None
    findings: tuple[WriteFinding, ...] = ()


def programs_of(
    file: Path, robot: Robot, language: Language, scene: Scene | None, only: Sequence[str] | None, unsafe: bool
) -> Iterator[PathProgram]:
    """The paths of a file one after another, by the thresholds of a check of programs.

    Raises
    ------
    InputError
        for a path file that can't be used, a name that it does not have, an arm that the language can't move by joints
    """
    if reason := not_written(language, robot):
        raise InputError(None, None, reason, WITHOUT_JOINTS)
    surroundings = Surroundings(Bodies(robot, scene), TOLERANCE)
    task = PlanningTask(robot, surroundings.bodies, TOLERANCE, assumed_limits(robot, CheckOptions()), SEED)
    listed = load_paths(file).paths
    missing = next((name for name in only or () if name not in {entry.name for entry in listed}), None)
    if missing is not None:
        raise InputError(file, "paths", f"there is no path '{missing}'", f"Known: {', '.join(e.name for e in listed)}")
    for each in listed_motions(file, task, Wanted(task.limits.rates, NEAR), CHECKS_PER_SAMPLE):
        if each.motion is None or (only and each.listed not in only):
            continue
        verdict = judge(robot, each.motion, NEAR, task.limits).verdict
        if collisions(measured(surroundings, each.motion)):
            verdict = min((verdict, "collides"), key=PATH_VERDICTS.index)
        if (verdict != "safe" and not unsafe) or not np.isfinite(each.motion.q[0]).all():
            yield PathProgram(each.name, verdict, None)
            continue
        files, findings = written(robot, each.motion, verdict, language)
        name = program_name(each.name, LONGEST_NAME)
        yield PathProgram(each.name, verdict, {name + suffix: text for suffix, text in files.items()}, findings)
