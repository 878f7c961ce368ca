"""The recording of the inverse stage: one second for each target, every branch an arm of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr

from er3a.kinematics.forward import skeleton
from er3a.pipeline.messages.kinematics import branch_word, say
from er3a.pipeline.messages.say import listed
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.inverse.model import InverseResults, SolutionRows, TargetResult, shown_targets
from er3a.pipeline.stages.inverse.page.played import refusal_in_short
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import AXES
from er3a.pipeline.viewing.palette import HIGHLIGHT, MUTED, colour_of, rgb, shape_of
from er3a.pipeline.viewing.recording import Logged, Run, escaped, record_stage
from er3a.robots.joint_limits import meant, size_of
from er3a.robots.robot import Robot

NOTE = """# Joint solutions of each target
**Look first** at how differently the arm can reach one and the same tool pose. Each target has one second: drag the
time, or press play.

{findings}

- solid arm: the solution taken; where none is, the arm where it comes from
- thick lines: the other branches within the limits, coloured as on the page
- thin grey lines: branches that leave a joint limit or collide
- magenta ball with axes: the target's frame
- grey solids: the scene

Each branch, the one taken too, is an entity `/inverse/targets/<name>/branch_<number>` that can be switched off in the
tree on the left. A flip and a no-flip branch lie on one another.
"""


def record(study: Study, stored: Stored[InverseResults], output: Path) -> None:
    """Write the recording from the stage's results."""
    name, solutions = stored.robot, stored.results.solutions
    robot, targets = study.robot(name), shown_targets(stored.results.summary.targets)
    record_stage(
        study,
        stored,
        output,
        NOTE,
        runs=[
            _run(robot, target, solutions.take((solutions.target == target.name) & solutions.first_of_branch))
            for target in targets
        ],
        scene=study.scene(name, stored.stage),
        views={"Solutions": ["**"]},
        points=[np.array([target.xyz_mm for target in targets]) / 1000],
        now="This target",
    )


def _run(robot: Robot, target: TargetResult, branches: SolutionRows) -> Run:
    root, size, position = f"targets/{target.name}", size_of(robot), np.array(target.xyz_mm) / 1000
    w, x, y, z = target.quaternion_wxyz
    frame = rr.Transform3D(translation=position, quaternion=rr.Quaternion(xyzw=[x, y, z, w]))
    axes = rr.Arrows3D(vectors=0.12 * size * np.eye(3), colors=AXES, radii=0.003 * size)
    ball = rr.Points3D([position], radii=0.012 * size, colors=rgb(HIGHLIGHT), labels=target.name, show_labels=True)
    shapes: dict[str, Logged] = {f"{root}/frame": [frame, axes], f"{root}/point": ball}
    for k, branch in enumerate(branches.branch):
        points = skeleton(robot, meant(robot, branches.q_deg[k]))
        colour = colour_of(shape_of(int(branch), branches.label[k]))
        width, colour = (0.014, colour) if branches.rank[k] else (0.003, MUTED)
        shapes[f"{root}/branch_{branch}"] = rr.LineStrips3D([points], radii=width * size, colors=[rgb(colour)])
    return Run(
        name=target.name,
        text=_about(target, branches),
        t=np.zeros(1),
        q=meant(robot, np.array([target.chosen_deg or target.q_ref_deg])),
        outcome="taken" if target.chosen_deg is not None else "none taken",
        status="plain" if target.chosen_deg is not None else "caution",
        shapes=[(0.0, entity, shape) for entity, shape in shapes.items()],
    )


def _about(target: TargetResult, branches: SolutionRows) -> str:
    lines = [f"# {target.name}", escaped(target.note or "")]
    verdict = "Taken" if target.chosen_deg is not None else "None taken"
    lines.append(f"**{verdict}:** {say(target.reason)}.")
    lines += listed(target.advice)
    if len(branches):
        rows = [
            f"| {branches.branch[k]} | {branch_word(branches.label[k], int(branches.branch[k]))} | "
            f"{_outcome(branches, k)} |"
            for k in np.argsort(branches.branch, kind="stable")
        ]
        lines.append("\n".join(["| no. | branch | outcome (°) |", "|---|---|---|", *rows]))
    return "\n\n".join(line for line in lines if line)


def _outcome(branches: SolutionRows, k: int) -> str:
    if branches.refusal[k] is not None:
        return refusal_in_short(branches.refusal[k])
    return "taken" if branches.rank[k] == 1 else "within limits"
