"""The load on the wrist against what its manufacturer allows, at rest and along the paths, and the load diagram."""

from __future__ import annotations

import numpy as np

from er3a.dynamics.uncertainty import tolerances_of
from er3a.dynamics.wrist import load_diagram, wrist_use
from er3a.pipeline.stages.dynamics.model import DiagramRows, PathLoad, Use
from er3a.robots.masses import Load
from er3a.robots.robot import Grade, Robot

DIAGRAM_POINTS = 501
FARTHEST_M = 1.0
PARTS_OF_PAYLOAD = (1 / 3, 2 / 3, 1.0)
UNITS = {"payload": "kg", "moment": "N m", "inertia": "kg m²"}


def wrist_uses(
    robot: Robot, load: Load | None, grade: Grade, gravity: float, paths: tuple[PathLoad, ...]
) -> tuple[Use, ...]:
    """All that the wrist's data limit; upper ends by the load's tolerances."""
    wrist = robot.masses.wrist
    if wrist is None or load is None:
        return ()
    uses = [
        Use(use.quantity, use.joint, None, use.asked, use.most, use.allowed, UNITS[use.quantity])
        for use in wrist_use(robot, wrist, load, gravity, tolerances_of(load, grade))
    ]
    allowed = dict(wrist.moment)
    for path in paths:
        for moment in path.wrist:
            asked = moment.moment_n_m
            if moment.joint in allowed:
                upper, limit = asked + moment.tolerance, allowed[moment.joint]
                uses.append(Use("moment", moment.joint, path.name, asked, upper, limit, "N m"))
    return tuple(uses)


def diagram_rows(robot: Robot, load: Load | None, gravity: float) -> DiagramRows:
    """Curves for the rated payload and parts of it, and for the load's own mass; none where no limit is known."""
    wrist = robot.masses.wrist
    if wrist is None:
        return DiagramRows.empty()
    masses = {round(part * wrist.payload, 3) for part in PARTS_OF_PAYLOAD if np.isfinite(wrist.payload)}
    masses |= {load.mass} if load and load.mass > 0 else set()
    if not masses:
        return DiagramRows.empty()
    along = np.linspace(0.0, FARTHEST_M, DIAGRAM_POINTS)
    diagram = load_diagram(robot, wrist, np.array(sorted(masses)), along, gravity)
    if diagram is None:
        return DiagramRows.empty()
    reached = np.isfinite(diagram.across).any(axis=0)
    last = min(int(np.flatnonzero(reached).max(initial=0)) + 2, DIAGRAM_POINTS)
    count = len(diagram.mass)
    return DiagramRows(
        mass_kg=np.repeat(diagram.mass, last),
        along_mm=1000 * np.tile(diagram.along[:last], count),
        across_mm=1000 * diagram.across[:, :last].ravel(),
    )
