"""Masses, drives and wrist loads as the groups of a robot file."""

from __future__ import annotations

from typing import Any

import numpy as np

from er3a.files.mass_fields import SLIDING, TURNING
from er3a.robots.robot import Robot


def mass_groups(robot: Robot) -> dict[str, dict[str, Any]]:
    """The groups of which something is known; bodies in the frames that move with the joints."""
    masses = robot.masses
    found: dict[str, dict[str, Any]] = {}
    if masses.links:
        found["inertia"] = {"frame": "joint", "links": [_link(each.link, each.body) for each in masses.links]}
    if masses.drives:
        rows = [{"joint": k + 1, **_drive(robot, k)} for k in range(robot.joints)]
        found["drives"] = {"rows": [row for row in rows if len(row) > 1] or rows[:1]}
    if masses.wrist:
        by_joint: dict[int, dict[str, Any]] = {}
        for key, values in (("moment_n_m", masses.wrist.moment), ("inertia_kg_m2", masses.wrist.inertia)):
            for joint, value in values:
                by_joint.setdefault(joint, {"joint": joint})[key] = value
        payload = {"payload_kg": masses.wrist.payload} if np.isfinite(masses.wrist.payload) else {}
        found["wrist_load"] = payload | {"rows": [by_joint[joint] for joint in sorted(by_joint)]}
    if np.isfinite(masses.weight):
        found["weight"] = {"kg": masses.weight}
    return found


def _link(link: int, body: Any) -> dict[str, Any]:
    row = {
        "link": link,
        "mass_kg": body.mass,
        "centre_mm": [round(value * 1000, 11) + 0.0 for value in body.centre],
        "inertia_kg_m2": list(body.inertia),
    }
    if body.mass_tolerance is not None:
        row["mass_tolerance_kg"] = body.mass_tolerance
    if body.centre_tolerance is not None:
        row["centre_tolerance_mm"] = body.centre_tolerance * 1000
    return row


def _drive(robot: Robot, k: int) -> dict[str, float]:
    drives = robot.masses.drives
    assert drives is not None
    columns = (drives.armature, drives.coulomb, drives.viscous, drives.rated, drives.peak)
    named = dict(zip(SLIDING if robot.slides[k] else TURNING, columns)) | {"gear_ratio": drives.gear_ratio}
    return {key: float(column[k]) for key, column in named.items() if np.isfinite(column[k])}
