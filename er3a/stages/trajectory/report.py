"""The trajectory page, rendered from the stage's results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from er3a.results import read_summary, read_table
from er3a.robots.robot import Robot
from er3a.stages.trajectory.clearance_section import clearance_section
from er3a.stages.trajectory.drawings import curves, views
from er3a.study import Study
from er3a.viewing.page import Picture, fixed, number, render

STATUS = {
    "safe": "pass",
    "near-singular": "caution",
    "singular": "caution",
    "too fast": "fail",
    "leaves limits": "fail",
    "collides": "fail",
    "unreachable": "fail",
}
KINDS = {
    "joint": "joint move",
    "joint_sequence": "joint moves in sequence",
    "line": "straight line",
    "arc": "circular arc",
    "sequence": "lines and arcs in sequence",
    "table": "path from a table",
}


def report(study: Study, name: str, folder: Path, output: Path) -> None:
    """Write the trajectory page of a robot from the results in ``folder``."""
    robot = study.robot(name)
    summary = read_summary(folder)
    checks = read_table(folder / "checks.parquet")
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        robot=robot,
        paths=[_section(robot, record, checks[checks["path"] == record["name"]]) for record in summary["paths"]],
        clearance=clearance_section(summary, read_table(folder / "clearance.parquet")),
        near=summary["near"],
        length_mm=summary["characteristic_length_m"] * 1000,
        speeds_known=bool(np.isfinite(robot.speed).any()),
    )


def _section(robot: Robot, record: dict[str, Any], rows: pd.DataFrame) -> dict[str, Any]:
    return {
        **record,
        "status": STATUS[record["verdict"]],
        "kind_words": KINDS[record["kind"]],
        "speed": _speed(record),
        "events": [_event_row(event) for event in record["singularities"]],
        "faults": [
            [word, fixed(part["t0_s"], 3), fixed(part["t1_s"], 3), *_way(part), part["cause"]]
            for word, key in (
                ("not reachable", "unreachable"),
                ("outside limits", "out_of_limits"),
                ("too fast", "too_fast"),
                ("collision", "collisions"),
            )
            for part in record[key]
        ],
        "curves": Picture(
            curves(robot, record, rows),
            f"Six panels over time for {record['name']}: joint angles, velocities and accelerations; manipulability, "
            f"condition number and smallest singular value. {record['text']}.",
            _conclusion(record, rows),
        ),
        "views": Picture(
            views(robot, record, rows),
            f"The path {record['name']} from above and from the side, coloured by the condition number.",
            "The darker the path, the worse a small tool motion maps to joint motion.",
        ),
    }


def _conclusion(record: dict[str, Any], rows: pd.DataFrame) -> str:
    """What the curves show, in one or two sentences."""
    fastest = record["max_joint_speed_deg_s"]
    condition = rows["condition_number"]
    parts = []
    if fastest:
        joint = int(np.argmax(fastest))
        parts.append(f"J{joint + 1} is the fastest joint, with {number(fastest[joint], 3)} deg/s.")
    elif rows["reachable"].any():
        parts.append("Towards the edge of reach the joint speeds grow without bound: the path has to end before it.")
    else:
        parts.append("No point of the path can be reached.")
    if np.isinf(condition).any() or any(event["crossing"] for event in record["singularities"]):
        parts.append("The condition number has no bound at the marked singular poses.")
    elif condition.notna().any():
        parts.append(f"The condition number rises to {number(float(condition.max()), 3)} at most.")
    return " ".join(parts)


def _speed(record: dict[str, Any]) -> str:
    fastest = record["max_joint_speed_deg_s"]
    if not fastest:
        return "–" if not record["joint_speed_bounded"] and record["verdict"] == "unreachable" else "unbounded"
    joint = int(np.argmax(fastest))
    return f"{number(fastest[joint], 3)} (J{joint + 1})"


def _event_row(event: dict[str, Any]) -> list[str]:
    when = fixed(event["t_s"], 6)
    if event["until_s"] > event["t_s"]:
        when += f" to {fixed(event['until_s'], 6)}"
    if event["crossing"]:
        return [event["type"], when, "meets it", "0"]
    if event["type"] == "shoulder":
        return [event["type"], when, "passes by", f"{number(event['distance_mm'], 3)} mm"]
    return [event["type"], when, "passes by", f"{number(event['distance_deg'], 3)} deg"]


def _way(part: dict[str, Any]) -> list[str]:
    return [fixed(part["s0_m"] * 1000, 1), fixed(part["s1_m"] * 1000, 1)]
