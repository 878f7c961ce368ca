"""The stage's entry in the registry; thresholds, joint limits and the scene are those of the trajectory stage."""

from __future__ import annotations

from pathlib import Path

from er3a.files.program_file import load_programs
from er3a.pipeline.language import N_
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.stage import Stage, StudyFiles, program_files


def _inputs(study: StudyFiles, robot: str) -> list[Path]:
    file = study.entry(robot).programs
    if file is None:
        return []
    programs = [path for entry in load_programs(file).programs for path in program_files(Path(entry.file))]
    return [Path(file), *programs, *study.scenes(robot, "trajectory")]


STAGE = Stage(
    name="programs",
    title=N_("Programs"),
    question=N_("Can the robot carry out its programs?"),
    settings={"trajectory": TrajectorySettings},
    inputs=_inputs,
    is_configured=lambda study, robot: study.entry(robot).programs is not None,
    rests_on=("validation",),
    shows=("workspace", "trajectory", "vision"),
    motions=N_("programs"),
    may_run=True,
)
