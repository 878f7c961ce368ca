"""The page of the inverse stage."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.results import read_summary, read_table
from er3a.pipeline.stages.inverse.columns import JOINT_COLUMNS
from er3a.pipeline.stages.inverse.solution_figures import histogram, overlay, ways
from er3a.pipeline.stages.inverse.symptoms import symptoms
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.page import fixed, number, render, run_command

NO_BREAK_SPACE = "\u00a0"
FREE_AT = {
    "wrist": N_("axes 4 and 6 in line"),
    "shoulder": N_("wrist centre on axis 1"),
    "elbow": N_("arm folded onto itself"),
}


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
                "rule_columns": [tr("Branch"), *(_rule_title(rule, summary) for rule in _rules_of(ranked))],
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
        robot_pages=study.pages(name),
        overview=[_overview_row(target) for target in summary["targets"]],
        sections=sections,
        trips=trips,
        histogram=histogram(trips) if trips else None,
        ways=ways(ways_table) if len(ways_table) else None,
        symptoms=symptoms(summary),
        mix=tr(", ").join(f"{tr(rule)} {weight:g}" for rule, weight in summary["mix"].items()),
        stops=_stops(summary["sequence"]),
    )


def _rules_of(ranked: pd.DataFrame) -> list[str]:
    return list(dict.fromkeys(ranked["rule"]))


def _rule_title(rule: str, summary: dict[str, Any]) -> str:
    unit = summary["rules"][rule]["unit"] if rule in summary["rules"] else "1"
    return f"{tr(rule)}{'' if unit == '1' else f' ({unit})'}>"


def _rule_rows(ranked: pd.DataFrame) -> list[list[str]]:
    """One row for each branch: the measure of each rule, with its place."""
    rows, collides = [], tr("collides")
    for _, group in ranked.groupby("branch", sort=True):
        cells = [
            f"{number(_no_noise(row['measure']), 3)}{NO_BREAK_SPACE}({row['place'] or collides})"
            for _, row in group.iterrows()
        ]
        rows.append([_on_one_line(group["label"].iloc[0]), *cells])
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
    parts = {
        "where": FREE_AT[family["kind"]],
        "joints": _listed(family["q0_deg"]),
        "rates": ", ".join(moving),
    }
    if not family["within_limits"]:
        return tr(
            "{where}: from ({joints}) deg, nearest to the reference, joints turn with the tool at rest in the ratio "
            "{rates}, but every member leaves the limits",
            **parts,
        )
    return tr(
        "{where}: from ({joints}) deg, nearest to the reference, joints turn with the tool at rest in the ratio "
        "{rates}, for {low} to {high} deg",
        low=fixed(low, 1),
        high=fixed(high, 1),
        **parts,
    )


def _stops(sequence: dict[str, Any] | None) -> list[list[str]]:
    if sequence is None:
        return []
    return [
        [target, _short(label), _short(greedy), _listed(q)]
        for target, label, greedy, q in zip(
            sequence["targets"], sequence["labels"], sequence["greedy_labels"], sequence["q_deg"]
        )
    ]


def _overview_row(target: dict[str, Any]) -> list[str]:
    joints = target["chosen_deg"]
    return [
        target["name"],
        _listed(target["xyz_mm"]),
        tr("{within} of {all}", within=target["within_limits"], all=target["solutions"]),
        tr("none") if joints is None else _listed(joints),
        target["reason"] if target["solutions"] else target["short_reason"],
    ]


def _branch_rows(rows: pd.DataFrame, branches: pd.DataFrame) -> list[list[str]]:
    turns = rows[rows["within_limits"].astype(bool)].groupby("branch").size()
    ranks = branches.loc[branches["rank"] > 0, "rank"]
    return [
        [
            _on_one_line(branch["label"]),
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
    taken = tr("chosen") if branch["rank"] == 1 else tr("place {place}", place=place)
    if turns > 1:
        taken = tr("{taken}, {turns} turns", taken=taken, turns=turns)
    if not branch["singular"]:
        return taken
    if branch["singular"] == "rank":
        return tr("{taken}; rank singularity", taken=taken)
    kinds = tr(", ").join(tr(kind) for kind in branch["singular"].split())
    return tr("{taken}; {kinds} singularity", taken=taken, kinds=kinds)


def _short(label: str) -> str:
    """A branch in words that need little room."""
    return tr(label).replace("elbow ", "")


def _on_one_line(label: str) -> str:
    return _short(label).replace(" ", NO_BREAK_SPACE)


def _listed(values: list[float]) -> str:
    """Numbers with one decimal where they need it, kept on one line."""
    texts = (fixed(value, 1).removesuffix(".0") for value in values)
    return f",{NO_BREAK_SPACE}".join(texts)
