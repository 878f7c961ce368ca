"""The stage's entry in the registry, and its settings in a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from er3a.files.reference_sets import reference_folder
from er3a.files.yaml_file import StrictModel
from er3a.pipeline.language import N_
from er3a.pipeline.stages.stage import Stage, StudyFiles


class ValidationSettings(StrictModel):
    """``round_trips``: random joint vectors taken to a pose and back. ``reach_starts``: starts of each reach search."""

    round_trips: Annotated[int, Field(ge=1, le=10_000_000)]
    reach_starts: Annotated[int, Field(ge=1, le=10_000)]


def _inputs(study: StudyFiles, robot: str) -> list[Path]:
    sets = [file for name in study.references(robot) for file in sorted(reference_folder(name).glob("*.csv"))]
    poses = study.entry(robot).confirm
    return [*sets, Path(poses)] if poses else sets


STAGE = Stage(
    name="validation",
    title=N_("D-H table"),
    question=N_("Does the table match the manufacturer's data?"),
    settings={"validation": ValidationSettings},
    inputs=_inputs,
)
