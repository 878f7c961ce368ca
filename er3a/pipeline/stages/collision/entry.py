"""The stage's entry in the registry, and its settings in a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from er3a.collision.pairs import PENETRATION_TOLERANCE
from er3a.files.robot_file import Text
from er3a.files.yaml_file import StrictModel
from er3a.pipeline.language import N_
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.stage import Stage, StudyFiles
from er3a.pipeline.stages.trajectory.entry import STAGE as TRAJECTORY


class CollisionSettings(StrictModel):
    """``samples``: random joint vectors tried. ``cells_across``: cells along the longest side of what they reach.

    In a cell without an arm free of overlap, 8 further poses are tried in each of ``rounds`` rounds, with all branches.
    Two places are joined by straight joint moves to ``neighbours`` of the nearest others. ``scene`` holds the
    obstacles; overlaps less deep than ``penetration_tolerance_mm`` may go unnoticed between the points of a path.
    """

    samples: Annotated[int, Field(ge=1000, le=10_000_000)] = 100_000
    cells_across: Annotated[int, Field(ge=4, le=64)] = 16
    rounds: Annotated[int, Field(ge=0, le=1000)] = 4
    neighbours: Annotated[int, Field(ge=1, le=50)] = 8
    scene: Text | None = None
    penetration_tolerance_mm: Annotated[float, Field(ge=0.01, le=100)] = 1000 * PENETRATION_TOLERANCE


def _inputs(study: StudyFiles, robot: str) -> list[Path]:
    named = [Path(study.entry(robot).targets), *TRAJECTORY.inputs(study, robot), *study.scenes(robot, STAGE.name)]
    return list(dict.fromkeys(named))


STAGE = Stage(
    name="collision",
    title=N_("Collisions"),
    question=N_("Where is it free of collisions?"),
    settings={"collision": CollisionSettings, "trajectory": TrajectorySettings},
    inputs=_inputs,
    rests_on=("validation",),
    shows=("trajectory",),
)
