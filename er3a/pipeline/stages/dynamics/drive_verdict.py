"""What is compared with limits, what is unknown, and the verdict."""

from __future__ import annotations

import numpy as np

from er3a.dynamics.arm_model import drives_of
from er3a.dynamics.plausibility import MassFinding, MissingLink
from er3a.pipeline.results import Status, Verdict
from er3a.pipeline.stages.dynamics.model import (
    AllWithin,
    DataOpen,
    HoldingTorque,
    Marginal,
    MassesUsed,
    Need,
    NoData,
    NoLimits,
    Overload,
    PathLoad,
    Use,
    hardest_held,
)
from er3a.robots.masses import Load
from er3a.robots.robot import Robot

DynamicsVerdict = Verdict[NoData | NoLimits | AllWithin | Marginal | Overload]


def drive_uses(robot: Robot, paths: tuple[PathLoad, ...], holding: tuple[HoldingTorque, ...]) -> tuple[Use, ...]:
    """Peak and effective torques of the paths against peak and rated ones, holding torques against rated ones."""
    drives, found = drives_of(robot), []
    for path in paths:
        for load in path.joints:
            peak, rated = (float(limit[load.joint - 1]) for limit in (drives.peak, drives.rated))
            if np.isfinite(peak):
                upper = load.peak + load.tolerance
                found.append(Use("peak", load.joint, path.name, load.peak, upper, peak, load.unit))
            if np.isfinite(rated):
                upper = load.rms + load.rms_tolerance
                found.append(Use("rms", load.joint, path.name, load.rms, upper, rated, load.unit))
    for held in holding:
        rated = float(drives.rated[held.joint - 1])
        if np.isfinite(rated):
            upper = held.bound + held.tolerance
            found.append(Use("holding", held.joint, None, abs(held.torque), upper, rated, held.unit))
    return tuple(found)


def unknowns(robot: Robot, load: Load | None) -> tuple[DataOpen, ...]:
    """What the files leave open, with links or joints."""
    drives, wrist, joints = drives_of(robot), robot.masses.wrist, range(1, robot.joints + 1)
    links = tuple(link for link in range(1, robot.rows + 1) if robot.masses.body(link) is None)
    open_joints: dict[Need, tuple[int, ...]] = {
        "masses": links,
        "peak": _open(drives.peak),
        "rated": _open(drives.rated),
        "armature": _open(drives.armature),
        "friction": _open(drives.coulomb + drives.viscous),
    }
    found = [
        DataOpen(what, () if len(numbers) == (robot.rows if what == "masses" else robot.joints) else numbers)
        for what, numbers in open_joints.items()
        if numbers
    ]
    last = {joint for joint in joints[-3:] if not robot.slides[joint - 1]}
    if wrist is None or not np.isfinite(wrist.payload):
        found.append(DataOpen("payload"))
    asked: tuple[tuple[Need, set[int]], ...] = (
        ("wrist_moment", last - {joint for joint, _ in (wrist.moment if wrist else ())}),
        ("wrist_inertia", last - {joint for joint, _ in (wrist.inertia if wrist else ())}),
    )
    found += [DataOpen(what, tuple(sorted(missing))) for what, missing in asked if missing]
    return (*found, DataOpen("load")) if load is None else tuple(found)


def _open(values: np.ndarray) -> tuple[int, ...]:
    return tuple((np.flatnonzero(np.isnan(values)) + 1).tolist())


def verdict_of(
    paths: tuple[PathLoad, ...],
    holding: tuple[HoldingTorque, ...],
    uses: tuple[Use, ...],
    findings: tuple[MassFinding, ...],
    unknown: tuple[DataOpen, ...],
    masses: MassesUsed | None,
) -> DynamicsVerdict:
    """Fit, marginal, overload; no_reference where there is nothing to compare, or no limit to compare it with."""
    missing = tuple(found.link for found in findings if isinstance(found, MissingLink))
    doubts = len(findings) - len(missing)
    inferred = masses is not None and masses.grade == "inferred"
    if not uses:
        if not holding:
            return Verdict("no_reference", NoData(unknown))
        return Verdict("no_reference", _no_limits(paths, holding, missing, doubts, inferred))
    beyond = sum(use.ratio > 1 for use in uses)
    unlimited: tuple[Need, ...] = tuple(
        each.what for each in unknown if each.what in ("peak", "rated", "wrist_moment", "wrist_inertia", "payload")
    )
    at_limit = any(use.upper > use.allowed for use in uses)
    kind = Overload if beyond else Marginal if at_limit or doubts else AllWithin
    status: Status = "fail" if beyond else "caution" if at_limit or doubts else "pass"
    return Verdict(status, kind(len(uses), beyond, uses[0], unlimited, missing, doubts, inferred))


def _no_limits(
    paths: tuple[PathLoad, ...],
    holding: tuple[HoldingTorque, ...],
    missing: tuple[int, ...],
    doubts: int,
    inferred: bool,
) -> NoLimits:
    followed = [path for path in paths if path.complete]
    if followed:
        path = max(followed, key=lambda path: path.hardest.peak)
        load, shown = path.hardest, (missing, doubts, inferred)
        return NoLimits(len(followed), load.joint, load.peak, load.tolerance, load.unit, path.name, *shown)
    held = hardest_held(holding)
    return NoLimits(0, held.joint, abs(held.torque), held.tolerance, held.unit, None, missing, doubts, inferred)
