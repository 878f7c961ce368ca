"""The page that sets two robots side by side: parameters, key figures, exact section borders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.messages.foundations import caveat
from er3a.pipeline.messages.language import N_, own_title, tr
from er3a.pipeline.results import (
    AbsentResults,
    Input,
    Provenance,
    input_records,
    is_computed,
    result_records,
)
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.workspace.model import WorkspaceResults
from er3a.pipeline.study import Study
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.heads import stage_head
from er3a.pipeline.viewing.numbers import number
from er3a.robots.robot import Robot
from er3a.robots.shown import shown

BORDER_POINT = "tool_point"
Workspaces = Mapping[str, WorkspaceResults | AbsentResults | None]
CONVENTIONS = {"standard": N_("standard"), "modified": N_("modified")}


def write_compare(study: Study, results: Path, workspaces: Workspaces, output: Path) -> None:
    """Render ``compare.html`` from the tables and summaries of all robots, and their workspaces."""
    robots = {name: study.robot(name) for name in study.robots}
    values = {
        name: parameters(robot) | key_figures(results / name, study.stages(name)) for name, robot in robots.items()
    }
    borders = {name: border_mm(workspaces[name]) for name in robots}
    rows = list(dict.fromkeys(key for own in values.values() for key in own))
    groups = list(dict.fromkeys(group for group, _, _ in rows))
    rows.sort(key=lambda row: groups.index(row[0]))
    data = {
        name: {
            "title": own_title(robot.title),
            "values": [values[name].get(row) for row in rows],
            "border": borders[name],
        }
        for name, robot in robots.items()
    }
    validated = {name: results / name / "validation" for name in robots}
    corners = np.array([point for border in borders.values() for line in border for point in line] or [[0, 0]])
    page.render(
        Path(__file__).with_name("compare.html.j2"),
        output,
        command=page.run_command(study, "compare.html"),
        provenance=Provenance(_inputs(study, results), code_digest(__name__), seed=study.seed),
        rows=rows,
        data=data,
        caveats={
            name: caveat(stage_head(folder, STAGES["validation"]).status if is_computed(folder) else "not_computed")
            for name, folder in validated.items()
        },
        low=corners.min(axis=0).tolist(),
        high=corners.max(axis=0).tolist(),
        compare_script=Path(__file__).with_name("compare.js").read_text(encoding="utf-8"),
    )


def _inputs(study: Study, results: Path) -> tuple[Input, ...]:
    return input_records(study.robot_file(name) for name in study.robots) + result_records(results, study.robots)


def parameters(robot: Robot) -> dict[tuple[str, str, str], float | str | None]:
    """Values of a robot's table by (group, name, unit); None where unknown."""
    of_joints = ["mm" if slides else "deg" for slides in robot.slides]
    own = shown(robot, np.stack([robot.lower, robot.upper, robot.speed]))
    columns = (
        (tr("D-H table"), "a", ["mm"] * robot.rows, robot.a * 1000),
        (tr("D-H table"), "α", ["deg"] * robot.rows, np.degrees(robot.alpha)),
        (tr("D-H table"), "d", ["mm"] * robot.rows, robot.d * 1000),
        (tr("zero"), tr("offset"), ["deg"] * robot.rows, np.degrees(robot.offset)),
        (tr("zero"), tr("direction"), [""] * robot.rows, [_sense(value) for value in robot.direction.tolist()]),
        (tr("limits"), tr("lower limit"), of_joints, own[0]),
        (tr("limits"), tr("upper limit"), of_joints, own[1]),
        (tr("speeds"), tr("greatest speed"), [f"{unit}/s" for unit in of_joints], own[2]),
    )
    found: dict[tuple[str, str, str], float | str | None] = {
        (tr("D-H table"), tr("convention"), ""): tr(CONVENTIONS[robot.convention])
    }
    for group, name, units, values in columns:
        for joint, (unit, value) in enumerate(zip(units, values), start=1):
            found[group, f"J{joint} {name}", unit] = value if isinstance(value, str) else _finite(value)
    return found


def _sense(direction: float) -> str:
    return tr("+1: positive as the D-H row") if direction > 0 else tr("−1: positive against the D-H row")


def _finite(value: float) -> float | None:
    return round(float(value), 9) if np.isfinite(value) else None


def key_figures(folder: Path, stages: Sequence[str]) -> dict[tuple[str, str, str], float | str | None]:
    """Verdicts and key figures of a robot's stages by (stage, name, unit)."""
    found: dict[tuple[str, str, str], float | str | None] = {}
    for stage in (STAGES[name] for name in stages if name in STAGES and is_computed(folder / name)):
        head, title = stage_head(folder / stage.name, stage), tr(stage.title)
        found[title, tr("verdict"), ""] = page.status_word(head.status)
        for figure in head.figures:
            value, unit = figure.value, figure.unit
            if figure.part and value is not None:  # the whole differs from robot to robot
                found[title, figure.label, ""] = f"{number(value)} {unit}"
            else:
                found[title, figure.label, unit] = value
    return found


def border_mm(workspace: WorkspaceResults | AbsentResults | None) -> list[list[list[float]]]:
    """The arcs of the tool point's border in the section through axis 1: lists of (radius, height) in mm."""
    if not isinstance(workspace, WorkspaceResults):
        return []
    border: pd.DataFrame = workspace.border.frame()
    arcs = border[(border["point"] == BORDER_POINT) & (border["view"] == "section")].groupby("arc", sort=False)
    return [(arc[["rho_m", "z_m"]].to_numpy() * 1000).round(2).tolist() for _, arc in arcs]
