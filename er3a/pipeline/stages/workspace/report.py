"""Workspace page."""

from __future__ import annotations

from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np

from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.results import read_summary, read_table
from er3a.pipeline.stages.workspace.capability_texts import capability_context
from er3a.pipeline.stages.workspace.cloud_figure import turning_figure
from er3a.pipeline.stages.workspace.proof_figures import sections, slices
from er3a.pipeline.stages.workspace.section_figures import convergence, top_view
from er3a.pipeline.stages.workspace.side_figures import arc_rows, side_view
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.page import Picture, fixed, number, render, run_command
from er3a.robots.robot import Robot

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
KINDS = {"enclosed": N_("enclosed"), "open": N_("open pocket")}


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
        robot_pages=study.pages(name),
        section=Picture(
            sections(robot, summary, tables),
            tr("Side sections about axis 1: density of the samples, and proven cells with the exact border"),
            _section_caption(summary, enclosed, len(tables["drawing"]) > 0),
        ),
        side=_side(robot, tables),
        arc_rows=arc_rows(tables["border"]),
        rule=_rule(enclosed),
        pocket_mm=3000 * summary["pocket_block_m"],
        top=Picture(
            top_view(robot, summary, tables["cells"]),
            tr("The cloud from above with the limits of joint 1"),
            _top_caption(robot),
        ),
        slices=Picture(
            slices(summary, tables["proof"]),
            tr("Three level slices of the proof"),
            _slices_caption(summary, len(enclosed)),
        ),
        convergence=Picture(
            convergence(summary, tables["curve"]),
            tr(
                "Touched volume over the number of samples for three cell sizes, with the proven bounds and the "
                "estimate"
            ),
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
    exact = tr("The border's arcs are exact (numbered on the left); samples fill them and none lies beyond.")
    if len(tables["drawing"]):
        maker = tr("The maker's labels (green) should meet the orange border: extents touch it, corners lie on it.")
    else:
        maker = tr("No drawing of this arm's envelope is on file to compare with.")
    return Picture(
        side_view(tables, not np.array_equal(robot.tool, np.eye(4))),
        tr("Side views of wrist centre and flange in the arm's plane, with exact borders and the maker's labels"),
        _one_after_another(exact, maker),
    )


def _one_after_another(*sentences: str) -> str:
    return reduce(lambda first, rest: tr("{first} {rest}", first=first, rest=rest), sentences)


def _rule(enclosed: list[dict[str, Any]]) -> str:
    """The rule that an unexpected hole points to joints 2 and 3, applied."""
    astray = [void for void in enclosed if not void["holds_shoulder"]]
    if not astray:
        return tr(
            "The rule that an unexpected hole points to a wrong limit or direction of joint 2 or 3 was applied: no "
            "enclosed void lies away from the shoulder, so it accuses nothing."
        )
    named = sum("joint 2" in void["cause"] or "joint 3" in void["cause"] for void in astray)
    if len(astray) == 1:
        return tr(
            "The rule that an unexpected hole points to a wrong limit or direction of joint 2 or 3 was applied: 1 "
            "enclosed void lies away from the shoulder, and relaxing one limit at a time names joint 2 or 3 for "
            "{named} of them.",
            named=named,
        )
    return tr(
        "The rule that an unexpected hole points to a wrong limit or direction of joint 2 or 3 was applied: {count} "
        "enclosed voids lie away from the shoulder, and relaxing one limit at a time names joint 2 or 3 for {named} of "
        "them.",
        count=len(astray),
        named=named,
    )


def _void_row(row: int, void: dict[str, Any]) -> list[str]:
    low, high = (1000 * void["volume_m3"][key] for key in ("lower", "upper"))
    return [
        str(row),
        KINDS[void["kind"]],
        void["status"],
        tr("{low} to {high}", low=number(low, 3), high=number(high, 3)),
        ", ".join(fixed(1000 * value, 0) for value in void["centroid_m"]),
        " × ".join(fixed(1000 * value, 0) for value in void["extent_m"]),
        void["cause"],
        tr("yes") if void["holds_shoulder"] else tr("no"),
    ]


def _section_caption(summary: dict[str, Any], enclosed: list[dict[str, Any]], drawn: bool) -> str:
    told = [
        tr(
            "What is white on the right is proven unreachable from every side; blank cells on the left only were not "
            "hit."
        )
    ]
    if enclosed and enclosed[0]["holds_shoulder"]:
        told.append(tr("The largest closed hollow lies about the shoulder."))
    elif enclosed:
        told.append(tr("The largest closed hollow lies away from the shoulder."))
    if drawn:
        told.append(
            tr(
                "Green are the maker's labels of the wrist centre: extents touch its border, corners are single "
                "stances."
            )
        )
    proof = summary["proof"]
    checked, inside = number(proof["points_checked"]), proof["points_in_empty_cells"]
    if inside:
        told.append(tr("Of {checked} recorded samples, {inside} lie in an empty cell.", checked=checked, inside=inside))
    else:
        told.append(tr("Of {checked} recorded samples, none lie in an empty cell.", checked=checked))
    return _one_after_another(*told)


def _top_caption(robot: Robot) -> str:
    if robot.upper[0] - robot.lower[0] >= 2 * np.pi - 1e-9:
        return tr("Density depends on the distance from axis 1 alone, as a full turn of joint 1 demands.")
    return tr(
        "Between the limits of joint 1 the tool gets only by leaning back or turning the wrist aside, and less far."
    )


def _slices_caption(summary: dict[str, Any], enclosed: int) -> str:
    pockets = sum(void["kind"] == "open" for void in summary["voids"])
    if enclosed == 0:
        inner = tr("no enclosed void")
    else:
        inner = tr("1 enclosed void") if enclosed == 1 else tr("{count} enclosed voids", count=enclosed)
    return tr(
        "The hull holds {voids} and {pockets}. Every point of the blue area can be reached by some joint vector within "
        "the limits; place nothing in the white.",
        voids=inner,
        pockets=tr("1 open pocket") if pockets == 1 else tr("{count} open pockets", count=pockets),
    )


def _curve_caption(summary: dict[str, Any], curve: Any) -> str:
    volume = summary["volume_m3"]
    finest = curve[curve["cell_mm"] == curve["cell_mm"].min()]["touched_m3"].to_numpy()[-1]
    if finest > volume["upper"]:
        touched = tr(
            "The touched volume depends on cell size and number of samples and overstates the volume: cells on the "
            "border count whole."
        )
    else:
        touched = tr("The touched volume depends on cell size and number of samples and is no estimate of the volume.")
    band = tr(
        "Use the band: the reached volume lies between {low} and {high} m³.",
        low=number(volume["lower"]),
        high=number(volume["upper"]),
    )
    return _one_after_another(touched, band)
