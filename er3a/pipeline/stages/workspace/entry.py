"""The stage's entry in the registry, and its settings in a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field, field_validator, model_validator

from er3a.files.robot_file import Text
from er3a.files.units import MAX_DISTANCE_MM, Triple, as_millimetres
from er3a.files.yaml_file import StrictModel
from er3a.pipeline.language import N_
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.stage import Stage, StudyFiles


class WorkspaceSettings(StrictModel):
    """Monte Carlo budget and grid.

    ``samples`` are drawn in ``blocks`` seeded blocks, uniform in the joints; ``cells_across`` cells span the bounding
    box's longest side, the recording shows ``cloud_points``.
    The proof looks at four cells of the section for each of ``proof_cells``.
    """

    samples: Annotated[int, Field(ge=1, le=100_000_000_000)]
    blocks: Annotated[int, Field(ge=1, le=100_000)]
    cells_across: Annotated[int, Field(ge=8, le=1024)]
    cloud_points: Annotated[int, Field(ge=1, le=300_000)]
    proof_cells: Annotated[int, Field(ge=1, le=10_000_000)] = 8000

    @model_validator(mode="after")
    def _a_sample_per_block(self):
        if self.samples < self.blocks:
            raise ValueError(f"{self.samples} samples can't fill {self.blocks} blocks | Lower workspace.blocks")
        return self


class BoxTask(StrictModel):
    """A tray that the tool must serve, in the frame that the robot's base is placed in.

    ``box_mm`` are its edges along x, y, z (it may stand turned by 90 deg about z), ``lowest_mm`` the lowest height of
    its underside, ``clear_of_axis_mm`` the smallest distance of its points from axis 1. At every point the tool must
    reach all directions within ``cone_deg`` of ``tool_direction`` (z of the tool frame), ``limit_margin_deg`` within
    the limits of joints with less than a full turn and of sums of revolute joints.
    """

    box_mm: Annotated[
        list[Annotated[float, Field(gt=0)]], Field(min_length=3, max_length=3), AfterValidator(as_millimetres)
    ] = [200, 150, 50]
    tool_direction: Triple = [0, 0, -1]
    cone_deg: Annotated[float, Field(ge=0, le=180)] = 30
    limit_margin_deg: Annotated[float, Field(ge=0, le=45)] = 2
    lowest_mm: Annotated[float, Field(ge=-MAX_DISTANCE_MM, le=MAX_DISTANCE_MM)] = 0
    clear_of_axis_mm: Annotated[float, Field(ge=0, le=MAX_DISTANCE_MM)] = 150

    @field_validator("tool_direction")
    @classmethod
    def _has_length(cls, values):
        if max(map(abs, values)) < 1e-6:
            raise ValueError("the vector has no direction | Write for example [0, 0, -1]: the tool points down")
        return values


class CapabilitySettings(StrictModel):
    """What the tool can do in each cell of the workspace.

    ``directions`` are spread over the sphere, with ``rolls`` about each where the roll matters (a tool beside axis 6,
    which takes as many times longer). ``scene`` holds what the arm may not touch where it serves the tray.
    """

    directions: Annotated[int, Field(ge=12, le=10_000)] = 300
    rolls: Annotated[int, Field(ge=1, le=360)] = 8
    scene: Text | None = None
    placement: BoxTask = BoxTask()


def _inputs(study: StudyFiles, robot: str) -> list[Path]:
    return study.scenes(robot, "capability")


STAGE = Stage(
    name="workspace",
    title=N_("Reach"),
    question=N_("What can it reach, where are the voids, and where can a tray stand?"),
    settings={"workspace": WorkspaceSettings, "capability": CapabilitySettings, "trajectory": TrajectorySettings},
    inputs=_inputs,
    rests_on=("validation",),
    shows=("inverse", "trajectory", "programs", "vision", "dynamics"),
)
