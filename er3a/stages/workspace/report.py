"""Workspace page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from er3a.results import read_summary, read_table
from er3a.robots.robot import Robot
from er3a.stages.workspace.capability_texts import capability_context
from er3a.stages.workspace.plots import convergence, top_view
from er3a.stages.workspace.proof_plots import sections, slices
from er3a.stages.workspace.side_plots import arc_rows, side_view
from er3a.stages.workspace.turning import turning_figure
from er3a.study import Study
from er3a.viewing.page import Picture, fixed, number, render, run_command

LISTED = 12
TABLES = (
    "section",
    "side_view",
    "cells",
    "curve",
    "proof",
    "border",
    "drawing",
    "cloud",
    "void_vertices",
    "void_triangles",
)
CAN_DO = ("capability", "places")
KINDS = {"enclosed": "enclosed", "open": "open pocket"}


def report(study: Study, name: str, folder: Path, output: Path) -> None:
    """Render the workspace page of a robot from its results in ``folder``."""
    robot, summary = study.robot(name), read_summary(folder)
    tables = {table: read_table(folder / f"{table}.parquet") for table in TABLES}
    enclosed = [void for void in summary["voids"] if void["kind"] == "enclosed"]
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        command=run_command(study, f"{name}/workspace.html"),
        robot=robot,
        section=Picture(
            sections(robot, summary, tables),
            "Side sections about axis 1: density of the samples, and proven cells with the exact border",
            _section_caption(summary, enclosed, len(tables["drawing"]) > 0),
        ),
        side=_side(robot, tables),
        arc_rows=arc_rows(tables["border"]),
        rule=_rule(enclosed),
        pocket_mm=3000 * summary["pocket_block_m"],
        top=Picture(
            top_view(robot, summary, tables["cells"]),
            "The cloud from above with the limits of joint 1",
            _top_caption(robot),
        ),
        slices=Picture(
            slices(summary, tables["proof"]), "Three level slices of the proof", _slices_caption(summary, enclosed)
        ),
        convergence=Picture(
            convergence(summary, tables["curve"]),
            "Touched volume over the number of samples for three cell sizes, with the proven bounds and the estimate",
            _curve_caption(summary, tables["curve"]),
        ),
        turning=turning_figure(
            robot, summary, *(tables[name] for name in ("cloud", "void_vertices", "void_triangles"))
        ),
        void_rows=[_void_row(n, void) for n, void in enumerate(summary["voids"][:LISTED], start=1)],
        voids_more=max(0, len(summary["voids"]) - LISTED),
        astray=summary["verdict"]["code"] == "workspace.void_unexpected",
        wide=100 * summary["proof"]["width"],
        **capability_context(robot, summary, *(read_table(folder / f"{name}.parquet") for name in CAN_DO)),
    )


def _side(robot: Robot, tables: dict[str, Any]) -> Picture | None:
    """The side view, where the arm has a wrist centre and an exact border."""
    if not len(tables["border"]):
        return None
    text = "The border's arcs are exact (numbered on the left); samples fill them and none lies beyond. "
    if len(tables["drawing"]):
        text += "The maker's labels (green) should meet the orange border: extents touch it, corners lie on it."
    else:
        text += "No drawing of this arm's envelope is on file to compare with."
    return Picture(
        side_view(tables, not np.array_equal(robot.tool, np.eye(4))),
        "Side views of wrist centre and flange in the arm's plane, with exact borders and the maker's labels",
        text,
    )


def _rule(enclosed: list[dict[str, Any]]) -> str:
    """The rule that an unexpected hole points to joints 2 and 3, applied."""
    rule = "The rule that an unexpected hole points to a wrong limit or direction of joint 2 or 3 was applied: "
    astray = [void for void in enclosed if not void["holds_shoulder"]]
    if not astray:
        return rule + "no enclosed void lies away from the shoulder, so it accuses nothing."
    named = sum("joint 2" in void["cause"] or "joint 3" in void["cause"] for void in astray)
    lie = "void lies" if len(astray) == 1 else "voids lie"
    return (
        f"{rule}{len(astray)} enclosed {lie} away from the shoulder, and relaxing one limit at a time names joint 2 or "
        f"3 for {named} of them."
    )


def _void_row(row: int, void: dict[str, Any]) -> list[str]:
    low, high = (1000 * void["volume_m3"][key] for key in ("lower", "upper"))
    return [
        str(row),
        KINDS[void["kind"]],
        void["status"],
        f"{number(low, 3)} to {number(high, 3)}",
        ", ".join(fixed(1000 * value, 0) for value in void["centroid_m"]),
        " × ".join(fixed(1000 * value, 0) for value in void["extent_m"]),
        void["cause"],
        "yes" if void["holds_shoulder"] else "no",
    ]


def _section_caption(summary: dict[str, Any], enclosed: list[dict[str, Any]], drawn: bool) -> str:
    text = (
        "What is white on the right is proven unreachable from every side; blank cells on the left only were not hit. "
    )
    if enclosed:
        where = "about the shoulder" if enclosed[0]["holds_shoulder"] else "away from the shoulder"
        text += f"The largest closed hollow lies {where}. "
    if drawn:
        text += (
            "Green are the maker's labels of the wrist centre: extents touch its border, corners are single stances. "
        )
    proof = summary["proof"]
    inside = proof["points_in_empty_cells"] or "none"
    return f"{text}Of {number(proof['points_checked'])} recorded samples, {inside} lie in an empty cell."


def _top_caption(robot: Robot) -> str:
    if robot.upper[0] - robot.lower[0] >= 2 * np.pi - 1e-9:
        return "Density depends on the distance from axis 1 alone, as a full turn of joint 1 demands."
    return "Between the limits of joint 1 the tool gets only by leaning back or turning the wrist aside, and less far."


def _slices_caption(summary: dict[str, Any], enclosed: list[dict[str, Any]]) -> str:
    pockets = sum(void["kind"] == "open" for void in summary["voids"])
    inner = f"{len(enclosed)} enclosed void{'s' * (len(enclosed) != 1)}" if enclosed else "no enclosed void"
    return (
        f"The hull holds {inner} and {pockets} open pocket{'s' * (pockets != 1)}. Every point of the blue area can be "
        "reached by some joint vector within the limits; place nothing in the white."
    )


def _curve_caption(summary: dict[str, Any], curve: Any) -> str:
    volume = summary["volume_m3"]
    finest = curve[curve["cell_mm"] == curve["cell_mm"].min()]["touched_m3"].to_numpy()[-1]
    over = finest > volume["upper"]
    verb = "overstates the volume: cells on the border count whole" if over else "is no estimate of the volume"
    return (
        f"The touched volume depends on cell size and number of samples and {verb}. Use the band: the reached volume "
        f"lies between {number(volume['lower'])} and {number(volume['upper'])} m³."
    )
