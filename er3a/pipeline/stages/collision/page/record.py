"""The recording of the collision stage: places, bodies and scene, and along each path the pair that is nearest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr

from er3a.pipeline.messages.say import say
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.collision.model import CollisionResults, PathClearances
from er3a.pipeline.stages.collision.page.played import events, nearest
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.palette import JOINTS, MODEL, VERDICTS, rgb
from er3a.pipeline.viewing.recording import Curves, Logged, Run, escaped, record_stage
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

NOTE = """# Where it is free of collisions
**Look first** at the red bodies: they overlap at that moment.

{findings}

- green: with an arm free of collisions, joined to home by a motion that is free of them too
- blue: with such an arm, not joined to home
- red points: none was found, however often tried
- points: places that the tool can be brought to
- the arm: the bodies that are measured (where there are meshes, hidden: `checked`); sand: the scene

Press play: the arm runs along its paths; the magenta line joins the two points that are nearest at that time, and the
curve shows how far they are apart. Below 0 they overlap.
"""


def record(study: Study, stored: Stored[CollisionResults], output: Path) -> None:
    """Write the recording from the stage's results."""
    name, results = stored.robot, stored.results
    robot = study.robot(name)
    record_stage(
        study,
        stored,
        output,
        NOTE,
        runs=[_run(robot, results, path) for path in dict.fromkeys(results.paths.path.tolist())],
        curves=[Curves("clearance", "Clearance (mm)", ["clearance"], [MODEL], whole=True)],
        scene=study.scene(name, stored.stage),
        home=meant(robot, np.array(results.summary.home_deg or np.zeros(robot.joints))),
        views={"Places and nearest pair": ["**"]},
        shapes=_places(results),
        now="This path",
    )


def _places(results: CollisionResults) -> dict[str, Logged]:
    rows, radius = results.places, results.summary.places.cell_m / 30
    groups = {
        "joined": (rows.joined, VERDICTS["pass"]),
        "clear": (rows.clear & ~rows.joined, JOINTS[5]),
        "lost": (~rows.clear, VERDICTS["fail"]),
    }
    return {
        f"places/{name}": rr.Points3D(rows.middle_mm[chosen] / 1000, radii=radius, colors=[(*rgb(colour), 160)])
        for name, (chosen, colour) in groups.items()
    }


def _run(robot: Robot, results: CollisionResults, path: str) -> Run:
    rows: PathClearances = results.paths.take(results.paths.path == path)
    found = next((each for each in results.summary.closest if (each.kind, each.name) == ("path", path)), None)
    outcome = f"nearest: {say(found.between)}, {found.clearance_mm:.1f} mm" if found else "no pose can be reached"
    return Run(
        name=path,
        text=f"## {escaped(path)}\n{escaped(outcome)}",
        t=rows.t_s,
        q=meant(robot, rows.q_deg),
        events=events(results, path, rows),
        marks=nearest(rows),
        outcome=outcome,
        status="fail" if found is None or found.clearance_mm < 0 else "plain",
        curves={"clearance": rows.clearance_mm[:, None]},
    )
