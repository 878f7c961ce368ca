"""The stages, in the order in which pages show them. A new stage is a folder beside this file and a line here."""

from __future__ import annotations

from er3a.pipeline.stages.collision.entry import STAGE as COLLISION
from er3a.pipeline.stages.dynamics.entry import STAGE as DYNAMICS
from er3a.pipeline.stages.inverse.entry import STAGE as INVERSE
from er3a.pipeline.stages.programs.entry import STAGE as PROGRAMS
from er3a.pipeline.stages.stage import Stage
from er3a.pipeline.stages.trajectory.entry import STAGE as TRAJECTORY
from er3a.pipeline.stages.validation.entry import STAGE as VALIDATION
from er3a.pipeline.stages.vision.entry import STAGE as VISION
from er3a.pipeline.stages.workspace.entry import STAGE as WORKSPACE

STAGES: dict[str, Stage] = {
    stage.name: stage for stage in (VALIDATION, WORKSPACE, COLLISION, INVERSE, TRAJECTORY, PROGRAMS, DYNAMICS, VISION)
}
