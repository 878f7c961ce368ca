"""The trajectory page, rendered from the stage's results."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.results import read_summary, read_table
from er3a.pipeline.stages.trajectory.clearance_figures import clearance_section
from er3a.pipeline.stages.trajectory.path_figure_3d import turning_figure
from er3a.pipeline.stages.trajectory.path_figures import PathFigure
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.page import fixed, number, render, run_command
from er3a.robots.robot import Robot

DRAWN = 250
STATUS = {
    "safe": "pass",
    "near-singular": "caution",
    "singular": "caution",
    "too fast": "fail",
    "leaves limits": "fail",
    "collides": "fail",
    "unreachable": "fail",
}
WAYS = {
    "slow": N_("slow down on the path"),
    "branch": N_("another solution of the arm first"),
    "via_shift": N_("via point, tool point shifted"),
    "via_tilt": N_("via point, tool tilted"),
    "damped": N_("damped least squares"),
    "detour": N_("joint move across the region"),
    "stop": N_("stop before it, with an alarm"),
}
KINDS = {
    "joint": N_("joint move"),
    "joint_sequence": N_("joint moves in sequence"),
    "line": N_("straight line"),
    "arc": N_("circular arc"),
    "sequence": N_("lines and arcs in sequence"),
    "table": N_("path from a table"),
}


@dataclass(frozen=True)
class Drawing:
    """A drawn image for the ``picture`` macro: its data address, what it shows, what to conclude, its width."""

    uri: str
    alt: str
    caption: str
    inches: float


def report(study: Study, name: str, folder: Path, output: Path) -> None:
    """Write the trajectory page of a robot from the results in ``folder``."""
    robot = study.robot(name)
    summary = read_summary(folder)
    checks, repairs = read_table(folder / "checks.parquet"), read_table(folder / "repairs.parquet")
    sections, figure = [], PathFigure()
    for record in summary["paths"]:
        rows, ways = (table[table["path"] == record["name"]] for table in (checks, repairs))
        sections.append(_section(robot, record, rows, ways, summary["near"], figure))
    limits = summary["joint_limits"]
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        command=run_command(study, f"{name}/trajectory.html"),
        robot=robot,
        robot_pages=study.pages(name),
        paths=sections,
        clearance=clearance_section(summary, read_table(folder / "clearance.parquet")),
        near=summary["near"],
        length_mm=summary["characteristic_length_m"] * 1000,
        limits=limits,
        assumed=[f"J{j + 1}" for j in range(6) if limits["speed_assumed"][j]],
        turning=turning_figure(robot, summary, checks, repairs),
    )


def _section(
    robot: Robot,
    record: dict[str, Any],
    rows: pd.DataFrame,
    ways: pd.DataFrame,
    near: dict[str, float],
    figure: PathFigure,
) -> dict[str, Any]:
    kind, finding = record["kind"], record["text"]
    alt = tr(
        "Panels over time for {path}: joint angles, velocities and accelerations; distances from the singular sets, "
        "condition number, manipulability; the path in space; joint speeds against their limits. {finding}.",
        path=record["name"],
        finding=finding,
    )
    return {
        **record,
        "status": STATUS[record["verdict"]],
        "kind_words": tr(KINDS[kind]),
        "speed": _speed(record),
        "events": [_event_row(event) for event in record["singularities"]],
        "faults": [
            [word, fixed(part["t0_s"], 3), fixed(part["t1_s"], 3), *_way(part), part["cause"]]
            for word, key in (
                (N_("not reachable"), "unreachable"),
                (N_("outside limits"), "out_of_limits"),
                (N_("too fast"), "too_fast"),
                (N_("collision"), "collisions"),
            )
            for part in record[key]
        ],
        "ways": _ways(record),
        "figure": Drawing(
            figure.draw(robot, record, _drawn(record, rows), ways, near),
            alt,
            _conclusion(record, rows),
            float(figure.figure.get_figwidth()),
        ),
    }


def _drawn(record: dict[str, Any], rows: pd.DataFrame) -> pd.DataFrame:
    """The rows that a curve needs: evenly spread ones, those at singular poses, and the greatest speeds."""
    kept = [np.linspace(0, len(rows) - 1, min(DRAWN, len(rows))).round()]
    kept.append([int(np.argmin(np.abs(rows["t_s"].to_numpy() - event["t_s"]))) for event in record["singularities"]])
    speed = np.nan_to_num(rows["speed_share"].to_numpy())
    kept.append(np.flatnonzero(speed > 0.5 * speed.max())[:: max(1, len(rows) // DRAWN // 2)])
    return rows.iloc[np.unique(np.concatenate(kept).astype(int))]


def _ways(record: dict[str, Any]) -> list[list[str]]:
    """Rows of the comparison: the programme, each way around, and the exact path at its fastest."""
    if not record["repairs"]:
        return []
    duration = fixed(record["duration_s"], 2)
    shares = (record[f"max_joint_{kind}_ratio"] for kind in ("speed", "acceleration"))
    clearance = record["clearance"] and record["clearance"]["least_mm"]
    cells = ["0", "0", *(_share(share) for share in shares), _clearance(clearance), duration]
    rows = [[tr("as programmed"), *cells, tr("the path to be repaired")]]
    for price in record["repairs"]:
        way, reason = price["way"], price["reason"]
        name = tr(WAYS[way]) + (" ←" if way == record["repair"] else "")
        if price["duration_s"] is None:
            rows.append([name, *["–"] * 6, tr("not possible: {reason}", reason=reason)])
            continue
        remark = tr("not usable: {reason}", reason=reason) if reason else _remark(price)
        off = (_small(price["max_deviation_mm"]), _small(price["max_deviation_deg"]))
        shares = (_share(price[f"max_joint_{kind}_ratio"]) for kind in ("speed", "acceleration"))
        rows.append([name, *off, *shares, _clearance(price["clearance_mm"]), fixed(price["duration_s"], 2), remark])
    if record["fastest_s"]:
        cells = ["0", "0", "1.00", "1.00", _clearance(clearance), fixed(record["fastest_s"], 2)]
        rows.append([tr("the path at its fastest"), *cells, tr("for comparison")])
    return rows


def _clearance(value: float | None) -> str:
    return "–" if value is None else fixed(value, 0)


def _remark(price: dict[str, Any]) -> str:
    if price["way"] == "detour":
        return tr("a joint move takes no harm from singular poses")
    return tr("keeps its distance from singular poses") if price["keeps_clear"] else tr("goes through the region")


def _share(value: float | None) -> str:
    return tr("no bound") if value is None else fixed(value, 2)


def _small(value: float) -> str:
    return "0" if value < 5e-4 else number(value, 3)


def _conclusion(record: dict[str, Any], rows: pd.DataFrame) -> str:
    """What the curves show, in one or two sentences."""
    fastest = record["max_joint_speed_deg_s"]
    condition = rows["condition_number"]
    parts = []
    if fastest:
        joint = int(np.argmax(fastest))
        speed = number(fastest[joint], 3)
        parts.append(tr("J{joint} is the fastest joint, with {speed} deg/s.", joint=joint + 1, speed=speed))
    elif rows["reachable"].any():
        parts.append(tr("Towards the edge of reach the joint speeds grow without bound: the path must end before it."))
    else:
        parts.append(tr("No point of the path can be reached."))
    if np.isinf(condition).any() or any(event["crossing"] for event in record["singularities"]):
        parts.append(tr("The condition number has no bound at the marked singular poses."))
    elif condition.notna().any():
        most = number(float(condition.max()), 3)
        parts.append(tr("The condition number rises to {most} at most.", most=most))
    return " ".join(parts)


def _speed(record: dict[str, Any]) -> str:
    fastest = record["max_joint_speed_deg_s"]
    if not fastest:
        return "–" if not record["joint_speed_bounded"] and record["verdict"] == "unreachable" else tr("unbounded")
    joint = int(np.argmax(fastest))
    return f"{number(fastest[joint], 3)} (J{joint + 1})"


def _event_row(event: dict[str, Any]) -> list[str]:
    when = fixed(event["t_s"], 6)
    if event["until_s"] > event["t_s"]:
        when += f" – {fixed(event['until_s'], 6)}"
    if event["crossing"]:
        return [event["type"], when, tr("meets it"), "0"]
    if event["type"] == "shoulder":
        return [event["type"], when, tr("passes by"), f"{number(event['distance_mm'], 3)} mm"]
    return [event["type"], when, tr("passes by"), f"{number(event['distance_deg'], 3)} deg"]


def _way(part: dict[str, Any]) -> list[str]:
    return [fixed(part["s0_m"] * 1000, 1), fixed(part["s1_m"] * 1000, 1)]
