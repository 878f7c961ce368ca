"""What a model must meet without any document: a sane table, and joints that are found again from their pose."""

from __future__ import annotations

from dataclasses import asdict
from typing import Literal

import numpy as np

from er3a.kinematics.round_trips import (
    MOST_BY_CLASS,
    NEAR_ELBOW_DEG,
    NEAR_SHOULDER_MM,
    NEAR_WRIST_DEG,
    batch_round_trips,
    has_class,
    slot_round_trips,
)
from er3a.kinematics.wrist_partitioned import closed_form_missing
from er3a.pipeline.stages.validation.check_model import Check, Unjudged
from er3a.pipeline.stages.validation.checks import against_itself
from er3a.pipeline.stages.validation.model import Margins, RoundTripErrors
from er3a.pipeline.stages.validation.validation_findings import (
    NearSingularLeftOut,
    NoClosedForm,
    NumbersMissing,
    SelfCheck,
    SelfChecked,
)
from er3a.robots.robot import Robot

JOINT_TOLERANCE_DEG = 1e-6
POSITION_TOLERANCE_MM = 1e-6
ORIENTATION_TOLERANCE_DEG = 1e-6
SHORTEST, LONGEST = 0.01, 20.0  # m
WIDEST_IN_RADIANS = 2.01 * np.pi
GROUP: Literal["round_trips"] = "round_trips"


def table_checks(robot: Robot) -> list[Check]:
    """Checks of the table alone: sound numbers in plausible units, and whether a closed-form inverse applies to it."""
    parts = [robot.a, robot.alpha, robot.d, robot.offset, robot.lower, robot.upper, robot.base]
    limits = np.abs([robot.lower, robot.upper])
    lengths = np.concatenate([np.abs([robot.a, robot.d]).ravel(), limits[:, robot.slides].ravel()])
    turning = limits[:, ~robot.slides & ~robot.continuous]
    faults: dict[SelfChecked, int] = {
        "numbers_not_finite": sum(int((~np.isfinite(part)).sum()) for part in parts),
        "crossed_limits": int((robot.lower > robot.upper).sum()),
        "odd_directions": int((np.abs(robot.direction) != 1).sum()),
        "length_unit": int(not SHORTEST <= np.nanmax(lengths) <= LONGEST),
        "limit_unit": int(turning.shape[1] > 1 and 0 < np.degrees(np.nanmax(turning)) < WIDEST_IN_RADIANS),
    }
    checks = [against_itself(name, "table_sanity", float(count), 0.5) for name, count in faults.items()]
    missing = NumbersMissing() if checks[0].status == "fail" else closed_form_missing(robot)
    if missing:
        return [*checks, Unjudged(SelfCheck("closed_form"), "table_sanity", "", missing)]
    return [*checks, against_itself("closed_form", "table_sanity", 0.0, 0.5)]


def _class_checks(robot: Robot, poses: int, seed: int) -> list[Check]:
    """Round trips of an arm without the closed form of spherical wrists, by its class."""
    missing = closed_form_missing(robot)
    if missing and not has_class(robot):
        return [Unjudged(SelfCheck("joints_to_pose_to_joints"), GROUP, "deg", NoClosedForm(missing))]
    found = batch_round_trips(robot, np.random.default_rng(seed), poses)
    return [
        against_itself("unsolved_poses", GROUP, float(found.poses - found.own_found), 0.5),
        against_itself("position_error", GROUP, found.worst_position * 1000, POSITION_TOLERANCE_MM, "mm"),
        against_itself(
            "orientation_error", GROUP, float(np.degrees(found.worst_orientation)), ORIENTATION_TOLERANCE_DEG, "deg"
        ),
    ]


def round_trip_checks(robot: Robot, poses: int, seed: int) -> tuple[list[Check], RoundTripErrors | None]:
    """Round trips as checks, and their errors; None if the arm has no closed form."""
    missing = closed_form_missing(robot)
    if missing or robot.coupling is not None:
        return _class_checks(robot, min(poses, MOST_BY_CLASS), seed), None
    found = slot_round_trips(robot, poses, seed)
    note = NearSingularLeftOut(poses - found.near_singular, poses, NEAR_WRIST_DEG, NEAR_SHOULDER_MM)
    checks: list[Check] = [
        against_itself("unsolved_poses", GROUP, float(found.unsolved), 0.5),
        against_itself("joint_error", GROUP, found.joint_error_deg, JOINT_TOLERANCE_DEG, "deg", note),
        against_itself("position_error", GROUP, found.position_error_mm, POSITION_TOLERANCE_MM, "mm"),
        against_itself("orientation_error", GROUP, found.orientation_error_deg, ORIENTATION_TOLERANCE_DEG, "deg"),
    ]
    margins = Margins(NEAR_WRIST_DEG, NEAR_ELBOW_DEG, NEAR_SHOULDER_MM)
    return checks, RoundTripErrors(**asdict(found), margins=margins)
