"""The determinant's factors as functions of single joints, for arms with a spherical wrist and parallel axes 2 and 3.

The wrist factor turns with joint 5 alone and the elbow factor with joint 3 alone: both are asin(sin(q + phase)), the
signed distance of q + phase from the nearest multiple of pi. The shoulder factor is a constant and two sines: of q2,
and of q2 and q3 together. Where joints are coupled, q is what the rows of the table move by. Phases and coefficients
are read off the factors themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.kinematics.singularity import determinant_factors
from er3a.kinematics.wrist_partitioned import wrist_partitioned_arm
from er3a.numerics.arrays import Reals
from er3a.robots.derived import derived
from er3a.robots.robot import Robot

ELBOW_JOINT, WRIST_JOINT = 2, 4
FORM_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class FactorForms:
    """Forms of the three factors.

    Attributes
    ----------
    wrist_phase, elbow_phase : rad
    sense : +1 or -1, by which joint 3 counts beside joint 2
    shoulder : (5,), m: constant, cosine and sine of q2, cosine and sine of q2 + sense q3
    """

    wrist_phase: float
    elbow_phase: float
    sense: float
    shoulder: Reals

    def shoulder_at(self, q2: Reals, q23: Reals) -> Reals:
        """The shoulder factor (...,) in m at angles q2 and q2 + sense q3 (...,) in rad."""
        c = self.shoulder
        value: Reals = c[0] + c[1] * np.cos(q2) + c[2] * np.sin(q2) + c[3] * np.cos(q23) + c[4] * np.sin(q23)
        return value

    @property
    def shoulder_slopes(self) -> tuple[float, float]:
        """Greatest slopes, m per rad, of the shoulder factor in q2 and in q2 + sense q3."""
        return float(np.hypot(*self.shoulder[1:3])), float(np.hypot(*self.shoulder[3:5]))


@derived
def factor_forms(robot: Robot) -> FactorForms:
    """The forms of an arm.

    Raises
    ------
    NotWristPartitionedError
        if the arm's determinant does not factor this way
    """
    arm = wrist_partitioned_arm(robot)
    back = np.eye(6) if robot.coupling is None else np.linalg.inv(robot.coupling)
    phases = []
    for joint, kind in ((WRIST_JOINT, "wrist"), (ELBOW_JOINT, "elbow")):
        q = np.zeros((2, 6))
        q[1, joint] = np.pi / 2
        at_0, at_90 = np.sin(getattr(determinant_factors(robot, q @ back.T), kind))
        phases.append(float(np.arctan2(at_0, at_90)))
    sense = float(robot.direction[1] * robot.direction[2] * arm.elbow_sign)
    q = np.zeros((25, 6))
    q[:, 1:3] = np.stack(np.meshgrid(*[np.linspace(0, 5, 5)] * 2), axis=-1).reshape(-1, 2)
    both = q[:, 1] + sense * q[:, 2]
    columns = np.stack([np.ones(25), np.cos(q[:, 1]), np.sin(q[:, 1]), np.cos(both), np.sin(both)], axis=1)
    shoulder = np.linalg.lstsq(columns, determinant_factors(robot, q @ back.T).shoulder, rcond=None)[0]
    return FactorForms(phases[0], phases[1], sense, shoulder)
