"""The page that sets two robots side by side: parameters, key figures, exact section borders."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.results import input_records, read_summary, read_table, result_records
from er3a.pipeline.study import STAGES, Study
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.numbers import number
from er3a.robots.robot import Robot

BORDER = "workspace/border.parquet"
BORDER_POINT = "tool point"
CONVENTIONS = {"standard": N_("standard"), "modified": N_("modified")}


def write_compare(study: Study, results: Path, output: Path) -> None:
    """Render ``compare.html`` from the tables and summaries of all robots."""
    entries = {}
    for name in study.robots:
        robot = study.robot(name)
        values = parameters(robot) | key_figures(results / name)
        entries[name] = {
            "title": robot.title,
            "values": values,
            "border": border_mm(read_table(results / name / BORDER)),
        }
    rows = list(dict.fromkeys(key for entry in entries.values() for key in entry["values"]))
    groups = list(dict.fromkeys(group for group, _, _ in rows))
    rows.sort(key=lambda row: groups.index(row[0]))
    data = {name: entry | {"values": [entry["values"].get(row) for row in rows]} for name, entry in entries.items()}
    corners = np.array([point for entry in entries.values() for line in entry["border"] for point in line] or [[0, 0]])
    page.render(
        Path(__file__).with_name("compare.html.j2"),
        output,
        command=page.run_command(study, "compare.html"),
        provenance={"inputs": _inputs(study, results), "seed": study.seed, "code": code_digest(__name__)},
        rows=rows,
        data=data,
        low=corners.min(axis=0).tolist(),
        high=corners.max(axis=0).tolist(),
        compare_script=Path(__file__).with_name("compare.js").read_text(encoding="utf-8"),
    )


def _inputs(study: Study, results: Path) -> list[dict[str, Any]]:
    return input_records(study.robot_file(name) for name in study.robots) + result_records(results, study.robots)


def parameters(robot: Robot) -> dict[tuple[str, str, str], float | str | None]:
    """Values of a robot's table by (group, name, unit); None where unknown."""
    columns = (
        (N_("D-H table"), "a", "mm", robot.a * 1000),
        (N_("D-H table"), "α", "deg", np.degrees(robot.alpha)),
        (N_("D-H table"), "d", "mm", robot.d * 1000),
        (N_("zero"), tr("offset"), "deg", np.degrees(robot.offset)),
        (N_("zero"), tr("direction"), "", robot.direction),
        (N_("limits"), tr("lower limit"), "deg", np.degrees(robot.lower)),
        (N_("limits"), tr("upper limit"), "deg", np.degrees(robot.upper)),
        (N_("speeds"), tr("greatest speed"), "deg/s", np.degrees(robot.speed)),
    )
    found: dict[tuple[str, str, str], float | str | None] = {
        ("D-H table", N_("convention"), ""): tr(CONVENTIONS[robot.convention])
    }
    for group, name, unit, values in columns:
        for joint, value in enumerate(values, start=1):
            found[group, f"J{joint} {name}", unit] = None if np.isnan(value) else round(float(value), 9)
    return found


def key_figures(folder: Path) -> dict[tuple[str, str, str], float | str | None]:
    """Verdicts and key figures of a robot's stages by (stage, name, unit)."""
    found: dict[tuple[str, str, str], float | str | None] = {}
    for stage in STAGES:
        summary: dict[str, Any] = read_summary(folder / stage)
        found[stage, N_("verdict"), ""] = page.status_word(summary["verdict"]["status"])
        for figure in summary["figures"]:
            name, value, unit = figure["name"], figure["value"], figure["unit"]
            if unit.startswith("of ") and value is not None:  # the total differs from robot to robot
                value, unit = f"{number(value)} {tr(unit)}", ""
            found[stage, name, unit] = value
    return found


def border_mm(border: pd.DataFrame) -> list[list[list[float]]]:
    """The arcs of the tool point's border in the section through axis 1: lists of (radius, height) in mm."""
    arcs = border[border["point"] == BORDER_POINT].groupby("arc", sort=False)
    return [(arc[["rho_m", "z_m"]].to_numpy() * 1000).round(2).tolist() for _, arc in arcs]
