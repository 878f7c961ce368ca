"""The stage's entry in the registry, and its settings in a study."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from er3a.files.units import CentreMm
from er3a.files.yaml_file import StrictModel
from er3a.pipeline.language import N_
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.stage import Stage
from er3a.pipeline.stages.trajectory.entry import STAGE as TRAJECTORY


class DynamicsSettings(StrictModel):
    """Torques along each path are computed at ``samples`` times.

    The maximum payload is asked for one with its centre at ``payload_centre_mm`` in the flange's frame and the radius
    of gyration ``payload_gyration_mm`` about each axis. ``capsule_density_kg_m3`` asks for a guess: links without mass
    are filled evenly at this density, and all figures are graded ``inferred``.
    """

    gravity_m_s2: Annotated[float, Field(ge=0, le=30)] = 9.81
    samples: Annotated[int, Field(ge=11, le=20_000)] = 401
    payload_centre_mm: CentreMm = [0.0, 0.0, 50.0]
    payload_gyration_mm: Annotated[float, Field(ge=0, le=1000)] = 30.0
    capsule_density_kg_m3: Annotated[float, Field(ge=10, le=20_000)] | None = None


STAGE = Stage(
    name="dynamics",
    title=N_("Torque"),
    question=N_("How much torque do the motors need, and can they supply it?"),
    settings={"dynamics": DynamicsSettings, "trajectory": TrajectorySettings},
    inputs=TRAJECTORY.inputs,
    extra_inputs=lambda study, robot: {"loads": [load.model_dump() for load in study.loads(robot)]},
    rests_on=("validation",),
    weighs=True,
)
"""Settings of the trajectory stage say how fast joints of unknown speed are taken to be."""
