"""The stage's entry in the registry, and its settings in a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from er3a.files.program_file import load_programs
from er3a.files.yaml_file import StrictModel
from er3a.pipeline.language import N_
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.stage import Stage, StudyFiles, program_files


class ProgramsSettings(StrictModel):
    """What is assumed where a program does not say, and how far a program is followed.

    Thresholds, joint limits and the scene are those of the trajectory stage.
    """

    tool_speed_mm_s: Annotated[float, Field(gt=0, le=10_000)] = 250
    tool_acceleration_mm_s2: Annotated[float, Field(gt=0, le=100_000)] = 2000
    joint_speed_percent: Annotated[float, Field(gt=0, le=100)] = 10
    most_steps: Annotated[int, Field(ge=100, le=100_000_000)] = 500_000
    most_branches: Annotated[int, Field(ge=1, le=100_000)] = 64
    loop_rounds: Annotated[int, Field(ge=1, le=1_000_000)] = 100


def _inputs(study: StudyFiles, robot: str) -> list[Path]:
    file = study.entry(robot).programs
    if file is None:
        return []
    programs = [path for entry in load_programs(file).programs for path in program_files(Path(entry.file))]
    return [Path(file), *programs, *study.scenes(robot, "trajectory")]


STAGE = Stage(
    name="programs",
    title=N_("programs"),
    question=N_("Can the robot carry out its programs?"),
    settings={"programs": ProgramsSettings, "trajectory": TrajectorySettings},
    inputs=_inputs,
    is_configured=lambda study, robot: study.entry(robot).programs is not None,
    rests_on=("validation",),
    shows=("workspace", "trajectory", "vision"),
    obstacles=True,
    motions=N_("programs"),
    may_run=True,
)
