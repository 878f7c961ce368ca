"""The stage's entry in the registry, and its settings in a study."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from er3a.files.robot_file import Text
from er3a.files.yaml_file import StrictModel, read_yaml
from er3a.pipeline.language import N_
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.stage import Stage, StudyFiles


def vision_files(path: str | Path) -> list[Path]:
    """A vision file, its calibration set, and the tables and images of that.

    Parameters
    ----------
    path : of the vision file

    Raises
    ------
    InputError
        if it, or its calibration set, is no YAML file
    """
    own = Path(path)
    calibration = read_yaml(own).get("calibration")
    return [own, *(calibration_files(own.parent / calibration) if isinstance(calibration, str) else [])]


def calibration_files(path: str | Path) -> list[Path]:
    """A calibration set's own file, and the tables and images that it names.

    Parameters
    ----------
    path : of the calibration set

    Returns
    -------
    files : its own first; others may be missing

    Raises
    ------
    InputError
        if it is no YAML file
    """
    path = Path(path)
    head: dict[str, Any] = read_yaml(path)
    named = [head.get("samples"), head.get("touched")]
    files = [path, *(path.parent / name for name in named if isinstance(name, str))]
    if head.get("images") is not None and isinstance(head.get("samples"), str):
        table = path.parent / head["samples"]
        if table.is_file():
            with table.open(encoding="utf-8-sig", newline="") as lines:
                files += [table.parent / row["image"] for row in csv.DictReader(lines) if row.get("image")]
    return files


class VisionSettings(StrictModel):
    """What is asked of grasps. ``scene``: the obstacles that the arm may not come nearer to than the clearance.

    ``least_limit_margin_deg`` : of joints from their limits, mm of a prismatic joint.
    ``least_singular_value`` : of the Jacobian with lengths divided by the wrist's reach. ``least_success`` : the
    probability of success below which an object is not graspable.
    ``line_speed_mm_s`` : the tool's maximum speed on approach and retreat. Limits of the joints' rates
    are those of ``trajectory``.
    """

    scene: Text | None = None
    least_clearance_mm: Annotated[float, Field(ge=0, le=1000)] = 5.0
    least_limit_margin_deg: Annotated[float, Field(ge=0, le=90)] = 2.0
    least_singular_value: Annotated[float, Field(ge=0, le=1)] = 0.02
    least_success: Annotated[float, Field(ge=0, le=1)] = 0.95
    line_speed_mm_s: Annotated[float, Field(gt=0, le=10_000)] = 100.0


def _inputs(study: StudyFiles, robot: str) -> list[Path]:
    file = study.entry(robot).vision
    return [*vision_files(file), *study.scenes(robot, STAGE.name)] if file else []


STAGE = Stage(
    name="vision",
    title=N_("Camera"),
    question=N_("Is the camera calibrated well enough, and which objects can be grasped?"),
    settings={"vision": VisionSettings, "trajectory": TrajectorySettings},
    inputs=_inputs,
    is_configured=lambda study, robot: study.entry(robot).vision is not None,
    rests_on=("validation",),
    motions=N_("grasps"),
)
