"""The page of the inverse stage."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from er3a.results import read_summary, read_table
from er3a.stages.inverse.columns import JOINT_COLUMNS
from er3a.stages.inverse.pictures import histogram, overlay, ways
from er3a.stages.inverse.symptoms import SYMPTOM_COLUMNS, symptoms
from er3a.study import Study
from er3a.viewing.page import fixed, number, render, run_command

NO_BREAK_SPACE = "\u00a0"


def report(study: Study, name: str, folder: Path, output: Path) -> None:
    """Render the page of a robot of the study from its results."""
    robot = study.robot(name)
    summary = read_summary(folder)
    solutions = read_table(folder / "solutions.parquet")
    ranked, ways_table = read_table(folder / "rankings.parquet"), read_table(folder / "map.parquet")
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
                "rules": _rule_rows(ranked[ranked["target"] == target["name"]]),
                "rule_columns": ["Branch", *(_rule_title(rule, summary) for rule in _rules_of(ranked))],
                "families": [_family_words(family) for family in target["families"]],
                "residual_mm": rows["position_residual_mm"].max() if len(rows) else None,
                "residual_deg": rows["orientation_residual_deg"].max() if len(rows) else None,
            }
        )
    trips = summary["round_trips"]
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        command=run_command(study, f"{name}/inverse.html"),
        robot=robot,
        overview=[_overview_row(target) for target in summary["targets"]],
        sections=sections,
        trips=trips,
        histogram=histogram(trips) if trips else None,
        ways=ways(ways_table) if len(ways_table) else None,
        symptom_columns=SYMPTOM_COLUMNS,
        symptoms=symptoms(summary),
        mix=", ".join(f"{rule} {weight:g}" for rule, weight in summary["mix"].items()),
        stops=_stops(summary["sequence"]),
    )


def _rules_of(ranked: pd.DataFrame) -> list[str]:
    return list(dict.fromkeys(ranked["rule"]))


def _rule_title(rule: str, summary: dict[str, Any]) -> str:
    unit = summary["rules"][rule]["unit"] if rule in summary["rules"] else "1"
    return f"{rule}{'' if unit == '1' else f' ({unit})'}>"


def _rule_rows(ranked: pd.DataFrame) -> list[list[str]]:
    """One row for each branch: the measure of each rule, with its place."""
    rows = []
    for _, group in ranked.groupby("branch", sort=True):
        cells = [
            f"{number(_no_noise(row['measure']), 3)}{NO_BREAK_SPACE}({row['place'] or 'collides'})"
            for _, row in group.iterrows()
        ]
        rows.append([group["label"].iloc[0].replace("elbow ", "").replace(" ", NO_BREAK_SPACE), *cells])
    return rows


def _no_noise(measure: float) -> float:
    """0 for what is nothing but rounding."""
    return 0.0 if abs(measure) < 1e-9 else float(measure)


def _family_words(family: dict[str, Any]) -> str:
    moving = [
        f"J{j + 1} {'+' if rate > 0 else ''}{fixed(rate, 2)}"
        for j, rate in enumerate(family["direction"])
        if abs(rate) > 1e-9
    ]
    low, high = family["range_deg"]
    words = {"wrist": "axes 4 and 6 in line", "shoulder": "wrist centre on axis 1", "elbow": "arm folded onto itself"}
    room = (
        f"for {fixed(low, 1)} to {fixed(high, 1)} deg"
        if family["within_limits"]
        else "but every member leaves the limits"
    )
    return (
        f"{words[family['kind']]}: from ({_listed(family['q0_deg'])}) deg, nearest to the reference, joints turn with "
        f"the tool at rest in the ratio {', '.join(moving)}, {room}"
    )


def _stops(sequence: dict[str, Any] | None) -> list[list[str]]:
    if sequence is None:
        return []
    return [
        [target, label.replace("elbow ", ""), greedy.replace("elbow ", ""), _listed(q)]
        for target, label, greedy, q in zip(
            sequence["targets"], sequence["labels"], sequence["greedy_labels"], sequence["q_deg"]
        )
    ]


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
    ranks = branches.loc[branches["rank"] > 0, "rank"]
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
    if branch["collision"]:
        return branch["collision"]
    words = "chosen" if branch["rank"] == 1 else f"place {place}"
    words += f", {turns} turns" if turns > 1 else ""
    return f"{words}; {branch['singular'].replace(' ', ', ')} singularity" if branch["singular"] else words


def _listed(values: list[float]) -> str:
    """Numbers with one decimal where they need it, kept on one line."""
    texts = (fixed(value, 1).removesuffix(".0") for value in values)
    return f",{NO_BREAK_SPACE}".join(texts)
