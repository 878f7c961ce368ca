"""What a model must meet without any document: a sane table, and joints that are found again from their pose."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from er3a.errors import NotWristPartitionedError
from er3a.geometry.angles import wrap_to_pi
from er3a.geometry.transforms import rotation_angle
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import determinant_factors
from er3a.kinematics.wrist_partitioned import solve_slots, wrist_partitioned_arm
from er3a.pipeline.messages.language import N_, said
from er3a.pipeline.stages.validation.checks import Check, against_itself, nothing_to_compare
from er3a.robots.robot import Robot

NEAR_WRIST_DEG = NEAR_ELBOW_DEG = 0.5
NEAR_SHOULDER_MM = 1.0
JOINT_TOLERANCE_DEG = 1e-6
POSITION_TOLERANCE_MM = 1e-6
ORIENTATION_TOLERANCE_DEG = 1e-6
BLOCK = 20_000
SHORTEST, LONGEST = 0.01, 20.0  # m
WIDEST_IN_RADIANS = 2.01 * np.pi
GROUP = "round trips"


@dataclass(frozen=True)
class RoundTrips:
    """Worst errors of random poses taken back to joints.

    Attributes
    ----------
    poses : how many; near_singular : how many of them nearer to a singularity than the margins
    joint_error_deg : worst angle between the joints and the nearest solution, over the other poses
    position_error_mm, orientation_error_deg : worst over all solutions of all poses
    unsolved : poses without any solution
    """

    poses: int
    near_singular: int
    joint_error_deg: float
    position_error_mm: float
    orientation_error_deg: float
    unsolved: int


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
    try:
        wrist_partitioned_arm(robot)
    except NotWristPartitionedError as error:
        return error.property_missing
    return ""


def round_trips(robot: Robot, poses: int, seed: int) -> RoundTrips:
    """Draw joints uniformly within the limits, take them to a pose, solve it, and compare.

    Parameters
    ----------
    robot : an arm with a closed-form inverse
    """
    random = np.random.default_rng(seed)
    blocks = [_block(robot, random, min(BLOCK, poses - done)) for done in range(0, poses, BLOCK)]
    table = np.array(blocks)
    worst = table.max(axis=0)
    return RoundTrips(poses, int(table[:, 0].sum()), *map(float, worst[1:4]), int(table[:, 4].sum()))


def round_trip_checks(robot: Robot, poses: int, seed: int) -> tuple[list[Check], dict | None]:
    """Round trips as checks, and as plain data with the margins; None if the arm has no closed form."""
    missing = closed_form(robot)
    if missing:
        note = said("no closed-form inverse, because {missing}", missing=missing)
        return [nothing_to_compare(N_("joints to pose to joints"), GROUP, "deg", note)], None
    result = round_trips(robot, poses, seed)
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


def _block(robot: Robot, random: np.random.Generator, count: int) -> tuple[float, ...]:
    q = robot.lower + random.random((count, 6)) * (robot.upper - robot.lower)
    T = forward(robot, q)
    found = solve_slots(robot, T, np.zeros_like(q))[0]
    solved = np.isfinite(found).all(axis=2)
    gap = np.abs(wrap_to_pi(found - q[:, None])).max(axis=2)
    nearest = np.where(solved, gap, np.inf).min(axis=1)

    factors = determinant_factors(robot, q)
    near = np.abs(factors.wrist) < np.radians(NEAR_WRIST_DEG)
    near |= np.abs(factors.elbow) < np.radians(NEAR_ELBOW_DEG)
    near |= np.abs(factors.shoulder) * 1000 < NEAR_SHOULDER_MM
    judged = nearest[~near & solved.any(axis=1)]

    rows, slots = np.nonzero(solved)
    back = forward(robot, found[rows, slots])
    position = np.linalg.norm(back[:, :3, 3] - T[rows, :3, 3], axis=1)
    orientation = rotation_angle(back[:, :3, :3], T[rows, :3, :3])
    return (
        float(near.sum()),
        float(np.degrees(judged.max(initial=0.0))),
        float(position.max(initial=0.0) * 1000),
        float(np.degrees(orientation.max(initial=0.0))),
        float((~solved.any(axis=1)).sum()),
    )
