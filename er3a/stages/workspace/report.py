"""Workspace page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from er3a.results import read_summary, read_table
from er3a.robots.robot import Robot
from er3a.stages.workspace.plots import convergence, section_and_top, slices
from er3a.study import Study
from er3a.viewing.page import Picture, fixed, number, render

LISTED = 12
KINDS = {"enclosed": "enclosed", "open": "open pocket"}
STATUSES = {"sampled": "sampled, not proven", "undersampled": "undersampled"}


def report(study: Study, name: str, folder: Path, output: Path) -> None:
    """Render the workspace page of a robot from its results in ``folder``."""
    robot, summary = study.robot(name), read_summary(folder)
    section, cells, curve = (read_table(folder / f"{table}.parquet") for table in ("section", "cells", "curve"))
    enclosed = [void for void in summary["voids"] if void["kind"] == "enclosed"]
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        robot=robot,
        section=Picture(
            section_and_top(robot, summary, section, cells),
            "Density of the tool point in a half plane through axis 1, with the arm at zero, and seen from above",
            _section_caption(section, enclosed) + _top_caption(robot),
        ),
        slices=Picture(
            slices(summary, cells),
            "One upright and three level slices of the voxel grid, voids marked",
            _slices_caption(summary, enclosed),
        ),
        convergence=Picture(
            convergence(summary, curve),
            "Touched volume over the number of samples for three cell sizes, with the hull's volume",
            _curve_caption(summary, curve),
        ),
        void_rows=[_void_row(void) for void in summary["voids"][:LISTED]],
        voids_more=max(0, len(summary["voids"]) - LISTED),
        astray=summary["verdict"]["code"] == "workspace.void_unexpected",
    )


def _void_row(void: dict[str, Any]) -> list[str]:
    return [
        KINDS[void["kind"]],
        STATUSES[void["status"]],
        number(void["volume_m3"]["untouched"] * 1000, 3),
        number(100 * void["unseen_cells"] / void["cells"], 2),
        ", ".join(fixed(1000 * value, 0) for value in void["centroid_m"]),
        " × ".join(fixed(1000 * value, 0) for value in void["extent_m"]),
        "yes" if void["holds_shoulder"] else "no",
    ]


def _section_caption(section: Any, enclosed: list[dict[str, Any]]) -> str:
    if not section["void"].any():
        return "All azimuths are folded into the section. It has no gap: the arm reaches throughout its outline."
    if enclosed:
        where = "about the shoulder" if enclosed[0]["holds_shoulder"] else "away from the shoulder"
        return (
            "All azimuths are folded into the section, so what stays blank is blank all around. The outlined hollow "
            f"{where} was reached from no side."
        )
    return (
        "All azimuths are folded into the section. The outlined gap is closed in this plane, but in space "
        "it is open to the outside, so it counts as a pocket."
    )


def _top_caption(robot: Robot) -> str:
    if robot.upper[0] - robot.lower[0] >= 2 * np.pi - 1e-9:
        return " From above, density depends on the distance from axis 1 alone, as a full turn of joint 1 demands."
    return " Between the limits of joint 1 the tool gets only by leaning back or turning the wrist aside, and less far."


def _slices_caption(summary: dict[str, Any], enclosed: list[dict[str, Any]]) -> str:
    pockets = sum(void["kind"] == "open" for void in summary["voids"])
    inner = f"{len(enclosed)} enclosed void{'s' * (len(enclosed) != 1)}" if enclosed else "no enclosed void"
    return (
        f"The hull holds {inner} and {pockets} open pocket{'s' * (pockets != 1)} at this cell size. Don't place "
        "work in the coloured cells; pale cells next to them are reached by few joint vectors only."
    )


def _curve_caption(summary: dict[str, Any], curve: Any) -> str:
    finest = curve[curve["cell_mm"] == curve["cell_mm"].min()]["touched_m3"].to_numpy()
    gain = 100 * (finest[-1] / finest[len(finest) // 2 - 1] - 1) if len(finest) > 1 else None
    unseen = 100 * summary["cells"]["unseen_estimate"] / summary["cells"]["touched"]
    start = f"The second half of the samples added {number(gain, 2)} % to the touched volume, and " if gain else ""
    text = (
        f"{start}about {number(unseen, 2)} % more cells would be touched by further samples. The touched volume counts "
        "cells on the border whole, so coarse cells overstate it, even past the hull; it is no estimate of the "
        "reachable volume."
    )
    return text[0].upper() + text[1:]
