"""Targets that an arm reaches and paths that it can do, found by solving and by the judgement of the trajectory stage.

Poses are looked for above the scene's table with the tool straight down first, then anywhere. What is written is what
was tried: millimetres and degrees, rounded before they are solved.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from er3a.collision.scene import Scene
from er3a.kinematics.near_singular import NearSingular
from er3a.kinematics.wrist_partitioned import closed_form_missing
from er3a.numerics.arrays import Reals
from er3a.pipeline.new_study.surroundings import SampledReach
from er3a.pipeline.stages.trajectory.entry import TrajectorySettings
from er3a.pipeline.stages.trajectory.limits import limits_of, wanted_of
from er3a.planning.timing import JointLimits
from er3a.planning.tool_proof import Wanted
from er3a.robots.robot import Robot

MOST_TARGETS, LEAST_TARGETS, CHOICE = 5, 2, 30
APART = 0.1  # of the reach
TRIES_CLOSED_FORM, TRIES_ITERATION = 300, 25
LIMIT_MARGIN_RAD = np.radians(8.0)
SINGULAR_MARGIN = 2.0  # times what the study calls near
LEAST_SINGULAR_VALUE = 0.05  # for arms without a closed form
DOWN_DEG = (180, 0, 0)
HEIGHTS, DISTANCES, ASIDE = (0.3, 0.4, 0.22), (0.6, 0.5, 0.7, 0.42), (0.0, 0.25, -0.25, 0.12, -0.12)  # of the reach
STEPS = ((0, 1, 0), (0, 0, 1), (1, 0, 0), (0, -1, 0), (0, 0, -1), (-1, 0, 0))
LENGTHS = (0.3, 0.2, 0.12, 0.06)  # of the reach
DURATIONS_S = (3.0, 6.0, 12.0)
SAMPLES = 50


@dataclass(frozen=True, eq=False)
class Spot:
    """A pose that the arm reaches: xyz in mm, rpy in whole degrees, and the solution (6,) in rad that is best there."""

    xyz_mm: tuple[float, float, float]
    rpy_deg: tuple[float, float, float]
    q: Reals
    label: str

    @property
    def pose(self) -> dict[str, list[float]]:
        """As the files write it."""
        return {"xyz_mm": list(self.xyz_mm), "rpy_deg": list(self.rpy_deg)}

    @property
    def down(self) -> bool:
        """Whether the tool points straight down."""
        return self.rpy_deg[:2] == DOWN_DEG[:2]


@dataclass
class TaskSearch:
    """What an arm can do in a scene, by the settings of the study's trajectory stage."""

    robot: Robot
    reach: SampledReach
    scene: Scene
    settings: TrajectorySettings
    closed_form: bool = field(init=False)
    near: NearSingular = field(init=False)
    limits: JointLimits = field(init=False)
    wanted: Wanted = field(init=False)

    def __post_init__(self) -> None:
        self.closed_form = closed_form_missing(self.robot) is None
        self.limits, self.wanted = limits_of(self.robot, self.settings), wanted_of(self.robot, self.settings)
        self.near = self.wanted.near
