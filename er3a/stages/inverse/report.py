"""The page of the inverse stage."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from er3a.results import read_summary, read_table
from er3a.stages.inverse.columns import JOINT_COLUMNS
from er3a.stages.inverse.pictures import histogram, overlay
from er3a.study import Study
from er3a.viewing.page import fixed, render

NO_BREAK_SPACE = "\u00a0"


def report(study: Study, name: str, folder: Path, output: Path) -> None:
    """Render the page of a robot of the study from its results."""
    robot = study.robot(name)
    summary = read_summary(folder)
    solutions = read_table(folder / "solutions.parquet")
    sections = []
    for target in summary["targets"]:
        rows = solutions[solutions["target"] == target["name"]]
        branches = rows[rows["first_of_branch"].astype(bool)].sort_values("branch")
        sections.append(
            {
                "target": target,
                "picture": overlay(robot, target, branches),
                "position": _listed(target["xyz_mm"]),
                "orientation": _listed(target["rpy_deg"]),
                "reference": _listed(target["q_ref_deg"]),
                "rows": _branch_rows(rows, branches),
                "residual_mm": rows["position_residual_mm"].max() if len(rows) else None,
                "residual_deg": rows["orientation_residual_deg"].max() if len(rows) else None,
            }
        )
    trips = summary["round_trips"]
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        robot=robot,
        overview=[_overview_row(target) for target in summary["targets"]],
        sections=sections,
        trips=trips,
        histogram=histogram(trips) if trips else None,
    )


def _overview_row(target: dict[str, Any]) -> list[str]:
    joints = target["chosen_deg"]
    return [
        target["name"],
        _listed(target["xyz_mm"]),
        f"{target['within_limits']} of {target['solutions']}",
        "none" if joints is None else _listed(joints),
        target["reason"] if target["solutions"] else target["short_reason"],
    ]


def _branch_rows(rows: pd.DataFrame, branches: pd.DataFrame) -> list[list[str]]:
    turns = rows[rows["within_limits"].astype(bool)].groupby("branch").size()
    ranks = branches.loc[branches["within_limits"].astype(bool), "rank"]
    return [
        [
            branch["label"].replace("elbow ", "").replace(" ", NO_BREAK_SPACE),
            *(fixed(branch[column], 1) for column in JOINT_COLUMNS),
            fixed(branch["limit_margin_deg"], 1),
            fixed(branch["manipulability"], 3),
            fixed(branch["greatest_move_deg"], 1),
            _outcome(branch, place=int((ranks <= branch["rank"]).sum()), turns=int(turns.get(branch["branch"], 0))),
        ]
        for _, branch in branches.iterrows()
    ]


def _outcome(branch: pd.Series, place: int, turns: int) -> str:
    if not branch["within_limits"]:
        return branch["beyond"]
    words = "chosen" if branch["rank"] == 1 else f"place {place}"
    words += f", {turns} turns" if turns > 1 else ""
    return f"{words}; {branch['singular'].replace(' ', ', ')} singularity" if branch["singular"] else words


def _listed(values: list[float]) -> str:
    """Numbers with one decimal where they need it, kept on one line."""
    texts = (fixed(value, 1).removesuffix(".0") for value in values)
    return f",{NO_BREAK_SPACE}".join(texts)
