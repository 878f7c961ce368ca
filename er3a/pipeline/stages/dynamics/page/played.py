"""The paths for player and recording, with the moment of each joint's greatest torque."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.pipeline.language import tr, with_unit
from er3a.pipeline.messages.numbers import decimals_of, fixed, number
from er3a.pipeline.messages.say import joined
from er3a.pipeline.player.motions import Mark, PlayedEvent, PlayedMotion, at_rest
from er3a.pipeline.stages.dynamics.model import DynamicsResults, HoldingTorque, JointLoad, LinkEntry, MassesUsed
from er3a.pipeline.viewing.drawn import drawn_arm, poses_at
from er3a.pipeline.viewing.still import AZIMUTH, axes_of
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

MM = 1000.0
LEVEL = 0.01  # sine of an axis' slope, up to which it counts as level
DROP_M = 0.2  # length of an arrow drawn for a weight
ABOVE_M = 0.14  # of the arm: there its level distance has room
FELT = 0.01  # of the greatest peak: what is less is no event


def motions(robot: Robot, results: DynamicsResults) -> list[PlayedMotion]:
    """The paths that the arm can follow, with the moment at which each joint feels most."""
    motions = []
    for path in results.summary.paths:
        if not path.complete:
            continue
        rows = results.torques.take(results.torques.path == path.name)
        felt = [load for load in path.joints if load.peak > FELT * path.hardest.peak]
        peaks = [
            PlayedEvent(t, t, joined([_peak(load) for load in felt if load.peak_at_s == t], ", "), "plain")
            for t in dict.fromkeys(load.peak_at_s for load in felt)
        ]
        motions.append(PlayedMotion(path.name, path.name, rows.t_s, meant(robot, rows.q), peaks, loads=rows.torque))
    return motions


def held(robot: Robot, results: DynamicsResults) -> list[PlayedMotion]:
    """For each joint the arm at rest in the pose in which it holds most."""
    found = []
    for each in results.summary.holding:
        marks = _weight(robot, results.summary.masses, each)
        found.append(
            at_rest(
                robot,
                holding_name(each.joint),
                q=meant(robot, np.array(each.q)),
                loads=np.tile(each.all_there, (2, 1)),
                marks=marks,
                elevation=0.0,
                turned=_along_axis(robot, each) if marks else None,
            )
        )
    return found


def hanging(
    robot: Robot, masses: MassesUsed | None, held: HoldingTorque
) -> tuple[Sequence[LinkEntry], Reals, Reals, Reals]:
    """What a joint with a level axis holds, if that is nothing but links.

    Returns
    -------
    links : k links with a mass, none for other joints
    axis : (3,), m, the end of the axis that the eye sees
    kg : (k,)
    off : (k, 3), m, the way from the axis to each centre, at a right angle to it
    """
    poses = poses_at(robot, meant(robot, np.array(held.q)))
    axis, row = poses[held.joint, :3, 2], drawn_arm(robot)["rows"][held.joint - 1]
    at = (poses[held.joint] @ [*row["middle"], 1.0])[:3] - row["half"] * np.sign(axis @ axes_of(AZIMUTH, 0.0)[2]) * axis
    links = [each for each in masses.links if each.link >= held.joint and each.mass_kg] if masses else []
    if not masses or masses.load_kg or abs(axis[2]) > LEVEL or robot.slides[held.joint - 1]:
        links = []
    ways = np.array([(poses[each.link] @ [*each.centre_mm, MM])[:3] / MM - at for each in links]).reshape(-1, 3)
    off = ways - np.outer(ways @ axis, axis)
    return links, at, np.array([each.mass_kg for each in links]), off


def _along_axis(robot: Robot, held: HoldingTorque) -> float:
    """By how much (rad) the eye is turned to look along a joint's level axis, on which the weight's lever is seen."""
    axis = poses_at(robot, meant(robot, np.array(held.q)))[held.joint, :3, 2]
    axis = axis * -np.sign(axis @ axes_of(AZIMUTH, 0.0)[2])
    return math.remainder(math.atan2(axis[1], axis[0]) - AZIMUTH, 2 * math.pi)


def _weight(robot: Robot, masses: MassesUsed | None, held: HoldingTorque) -> list[Mark]:
    """The weight that a joint holds, from the centre of gravity down, and its level distance from the axis."""
    links, at, kg, off = hanging(robot, masses, held)
    if not links:
        return []
    centre = at + kg @ off / kg.sum()
    lever = (centre - at) * [1, 1, 0]
    top = np.add(at, [0, 0, ABOVE_M])
    far, heavy = with_unit(fixed(MM * float(np.linalg.norm(lever)), 0), "mm"), with_unit(number(kg.sum(), 3), "kg")
    tip = centre - [0, 0, DROP_M]
    sides = [Mark(0.0, 1.0, tuple(at), tuple(top), ""), Mark(0.0, 1.0, tuple(centre), tuple(top + lever), "")]
    level = Mark(0.0, 1.0, tuple(top), tuple(top + lever), far)
    own = []
    for mass, way in zip(kg, off):
        start, down = at + way, [0, 0, DROP_M * mass / kg.sum()]
        own.append(Mark(0.0, 1.0, tuple(start), tuple(start - down), with_unit(number(mass, 3), "kg"), arrow=True))
    return [level, Mark(0.0, 1.0, tuple(centre), tuple(tip), heavy, arrow=True), *sides, *own]


def within(value: float, tolerance: float, decimals: int = 2) -> str:
    """A value with its tolerance, two digits of that and no more decimals than ``decimals``."""
    shown = min(decimals, decimals_of(value, tolerance, "") if value else decimals)
    return f"{fixed(value, shown)} ± {fixed(tolerance, shown)}"


def holding_name(joint: int) -> str:
    """What the player calls the pose in which a joint holds most, an address on the page as well."""
    return tr("J{joint}, held", joint=joint).replace(" ", "\u00a0")


def _peak(load: JointLoad) -> str:
    return tr(
        "J{joint} peaks: {peak} {unit}",
        joint=load.joint,
        peak=within(load.peak, load.tolerance),
        unit=load.unit,
    )
