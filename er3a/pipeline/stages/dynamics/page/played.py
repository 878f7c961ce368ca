"""The paths for player and recording, with the moment of each joint's greatest torque."""

from __future__ import annotations

from er3a.pipeline.language import tr
from er3a.pipeline.messages.numbers import measured
from er3a.pipeline.player.motions import PlayedEvent, PlayedMotion
from er3a.pipeline.stages.dynamics.model import DynamicsResults, JointLoad
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot


def motions(robot: Robot, results: DynamicsResults) -> list[PlayedMotion]:
    """The paths that the arm can follow, with the moment at which each joint feels most."""
    motions = []
    for path in results.summary.paths:
        if not path.complete:
            continue
        rows = results.torques.take(results.torques.path == path.name)
        peaks = [PlayedEvent(load.peak_at_s, load.peak_at_s, _peak(load), "plain") for load in path.joints]
        motions.append(PlayedMotion(path.name, "", rows.t_s, meant(robot, rows.q), peaks))
    return motions


def _peak(load: JointLoad) -> str:
    return tr(
        "J{joint} at its peak: {peak} {unit}",
        joint=load.joint,
        peak=measured(load.peak, None, load.unit),
        unit=load.unit,
    )
