"""When a pose counts as near-singular: one rule (:meth:`NearSingular.is_near`) for columns, events and avoidance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from er3a.kinematics.rank_loss import scaled_jacobian
from er3a.kinematics.singularity import TYPES, DeterminantFactors, SingularityType, determinant_factors
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot

LEAST_SINGULAR_VALUE = 0.02


@dataclass(frozen=True)
class NearSingular:
    """Distance from each singular set below which a pose is near-singular.

    ``smallest`` is the smallest singular value (:mod:`er3a.kinematics.rank_loss`) for arms without those sets.
    """

    wrist_rad: float
    elbow_rad: float
    shoulder_m: float
    smallest: float = LEAST_SINGULAR_VALUE

    def of(self, kind: SingularityType) -> float:
        """The threshold of one type, rad or m."""
        return {"wrist": self.wrist_rad, "elbow": self.elbow_rad, "shoulder": self.shoulder_m}[kind]

    def is_near(self, kind: SingularityType, distance: Reals) -> Flags:
        """Whether distances (...,), rad or m, from the singular set of one type are below its threshold; NaN is not."""
        near: Flags = distance < self.of(kind)
        return near

    def ratios(self, factors: DeterminantFactors) -> Reals:
        """Distances from the three singular sets over their thresholds, (3, ...) in the order of TYPES."""
        return np.stack([np.abs(factor_of(factors, kind)) / self.of(kind) for kind in TYPES])

    def contains(self, factors: DeterminantFactors) -> Flags:
        """Whether poses (...,) are near-singular; False where the factors are NaN."""
        near: Flags = np.any([self.is_near(kind, np.abs(factor_of(factors, kind))) for kind in TYPES], axis=0)
        return near

    def margin(self, robot: Robot, q: Reals) -> Reals:
        """Least of the ratios (N,) at joint angles (N, 6) in rad; -1 where they are NaN, for unreachable poses."""
        if not has_branches(robot):
            smallest = np.linalg.svd(scaled_jacobian(robot, q), compute_uv=False)[..., -1]
            return np.nan_to_num(smallest / self.smallest, nan=-1.0)
        ratios = self.ratios(determinant_factors(robot, q))
        return np.where(np.isnan(ratios[0]), -1.0, ratios.min(axis=0))


def factor_of(factors: DeterminantFactors, kind: SingularityType) -> Any:
    """The determinant's factor of one type, (...,) in rad or m."""
    return getattr(factors, kind)
