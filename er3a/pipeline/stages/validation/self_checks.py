"""What a model must meet without any document: a sane table, and joints that are found again from their pose."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from er3a.kinematics.round_trips import NEAR_ELBOW_DEG, NEAR_SHOULDER_MM, NEAR_WRIST_DEG, slot_round_trips
from er3a.kinematics.wrist_partitioned import closed_form_missing
from er3a.pipeline.messages.kinematics import say
from er3a.pipeline.messages.language import N_, said
from er3a.pipeline.stages.validation.checks import Check, against_itself, nothing_to_compare
from er3a.robots.robot import Robot

JOINT_TOLERANCE_DEG = 1e-6
POSITION_TOLERANCE_MM = 1e-6
ORIENTATION_TOLERANCE_DEG = 1e-6
SHORTEST, LONGEST = 0.01, 20.0  # m
WIDEST_IN_RADIANS = 2.01 * np.pi
GROUP = "round trips"


def table_checks(robot: Robot) -> list[Check]:
    """Checks of the table alone: sound numbers in plausible units, and whether a closed-form inverse applies to it."""
    parts = [robot.a, robot.alpha, robot.d, robot.offset, robot.lower, robot.upper, robot.base]
    lengths, limits = np.abs([robot.a, robot.d]), np.abs([robot.lower, robot.upper])
    faults = {
        N_("numbers that are not finite"): sum(int((~np.isfinite(part)).sum()) for part in parts),
        N_("joints whose limits are crossed"): int((robot.lower >= robot.upper).sum()),
        N_("joint directions other than +1 and -1"): int((np.abs(robot.direction) != 1).sum()),
        N_("lengths in another unit (longest below 10 mm or above 20 m)"): int(
            not SHORTEST <= np.nanmax(lengths) <= LONGEST
        ),
        N_("limits in another unit (widest below 6.3 deg)"): int(0 < np.degrees(np.nanmax(limits)) < WIDEST_IN_RADIANS),
    }
    checks = [against_itself(name, "table sanity", float(count), 0.5, "") for name, count in faults.items()]
    missing = N_("numbers are missing") if checks[0].status == "fail" else closed_form(robot)
    name = N_("properties lacking for a closed-form inverse (parallel axes 2 and 3, spherical wrist)")
    if missing:
        return [*checks, nothing_to_compare(name, "table sanity", "", missing)]
    return [*checks, against_itself(name, "table sanity", 0.0, 0.5, "")]


def closed_form(robot: Robot) -> str:
    """Why the arm has no closed-form inverse; empty if it has one."""
    missing = closed_form_missing(robot)
    return say(missing) if missing else ""


def round_trip_checks(robot: Robot, poses: int, seed: int) -> tuple[list[Check], dict | None]:
    """Round trips as checks, and as plain data with the margins; None if the arm has no closed form."""
    missing = closed_form(robot)
    if missing:
        note = said("no closed-form inverse, because {missing}", missing=missing)
        return [nothing_to_compare(N_("joints to pose to joints"), GROUP, "deg", note)], None
    result = slot_round_trips(robot, poses, seed)
    note = said(
        "{judged} of {poses} random poses; the others lie within {wrist:g} deg (wrist, elbow) or {shoulder:g} mm "
        "(shoulder) of a singularity, where joints follow from a pose less exactly",
        judged=poses - result.near_singular,
        poses=poses,
        wrist=NEAR_WRIST_DEG,
        shoulder=NEAR_SHOULDER_MM,
    )
    checks = [
        against_itself(N_("random poses without any solution"), GROUP, float(result.unsolved), 0.5, ""),
        against_itself(N_("worst joint error"), GROUP, result.joint_error_deg, JOINT_TOLERANCE_DEG, "deg", note),
        against_itself(N_("worst position error"), GROUP, result.position_error_mm, POSITION_TOLERANCE_MM, "mm"),
        against_itself(
            N_("worst orientation error"), GROUP, result.orientation_error_deg, ORIENTATION_TOLERANCE_DEG, "deg"
        ),
    ]
    margins = {"wrist_deg": NEAR_WRIST_DEG, "elbow_deg": NEAR_ELBOW_DEG, "shoulder_mm": NEAR_SHOULDER_MM}
    return checks, asdict(result) | {"margins": margins}
