"""The stage's entry in the registry, and its settings in a study."""

from __future__ import annotations

from pathlib import Path

from er3a.files.robot_file import Text
from er3a.files.yaml_file import StrictModel
from er3a.pipeline.language import N_
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.stage import Stage, StudyFiles


class InverseSettings(StrictModel):
    """``scene`` holds the obstacles that clearance is measured from and that solutions may not touch."""

    scene: Text | None = None


def _inputs(study: StudyFiles, robot: str) -> list[Path]:
    return [Path(study.entry(robot).targets), *study.scenes(robot, STAGE.name)]


STAGE = Stage(
    name="inverse",
    title=N_("Poses"),
    question=N_("Which joint solutions reach a pose?"),
    settings={"inverse": InverseSettings, "trajectory": TrajectorySettings},
    inputs=_inputs,
    rests_on=("validation",),
)
