"""The trajectory page, rendered from the stage's results."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.kinematics import branch_word
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import say
from er3a.pipeline.messages.trajectory import (
    FIGURES,
    advice,
    event_distance,
    event_word,
    kind_word,
    path_text,
    reasons,
    strategy_word,
)
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.trajectory.clearance_figures import clearance_section
from er3a.pipeline.stages.trajectory.model import (
    AvoidanceRows,
    NearThresholds,
    PathChecks,
    PathSummary,
    Singularity,
    StrategyMotion,
    TrajectoryResults,
    TriedStrategy,
)
from er3a.pipeline.stages.trajectory.path_figure_3d import turning_figure
from er3a.pipeline.stages.trajectory.path_figures import PathFigure
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.page import fixed, head_of, number, render, run_command
from er3a.planning.path_verdicts import PathVerdict
from er3a.robots.robot import Robot

DRAWN = 250
STATUS: dict[PathVerdict, str] = {
    "safe": "pass",
    "near-singular": "caution",
    "singular": "caution",
    "too fast": "fail",
    "leaves limits": "fail",
    "collides": "fail",
    "unreachable": "fail",
}


@dataclass(frozen=True)
class PathDrawing:
    """A drawn image for the ``picture`` macro: its data address, what it shows, what to conclude, its width."""

    uri: str
    alt: str
    caption: str
    inches: float


@dataclass(frozen=True)
class PathSection:
    """A path on the page: the record, and what it says in the page's language."""

    path: PathSummary
    status: str
    verdict: str
    kind: str
    text: str
    advice: str | None
    branches: list[str]
    speed: str
    events: list[list[str]]
    faults: list[list[str]]
    strategies: list[list[str]]
    figure: PathDrawing


def report(study: Study, stored: Stored[TrajectoryResults], output: Path) -> None:
    """Write the trajectory page of a robot."""
    robot, results = study.robot(stored.robot), stored.results
    summary, checks, motions = results.summary, results.checks, results.avoidance
    figure, sections = PathFigure(), []
    for path in summary.paths:
        rows, own = checks.take(checks.path == path.name), motions.take(motions.path == path.name)
        sections.append(_section(path, rows, _figure(figure, robot, path, rows, own, summary.near)))
    assumed = [f"J{j + 1}" for j, is_assumed in enumerate(summary.joint_limits.speed_assumed) if is_assumed]
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        head=head_of(stored, FIGURES),
        command=run_command(study, f"{stored.robot}/trajectory.html"),
        robot=robot,
        robot_pages=study.pages(stored.robot),
        sections=sections,
        clearance=clearance_section(results),
        assumed=assumed,
        turning=turning_figure(robot, results),
    )


def _section(path: PathSummary, rows: PathChecks, figure: PathDrawing) -> PathSection:
    return PathSection(
        path=path,
        status=STATUS[path.verdict],
        verdict=outcome_word(path.verdict),
        kind=kind_word(path.kind),
        text=path_text(path),
        advice=advice(path),
        branches=[branch_word(label) for label in path.branches],
        speed=_speed(path),
        events=[_event_row(event) for event in path.singularities],
        faults=_faults(path),
        strategies=_strategies(path),
        figure=figure,
    )


def _figure(
    figure: PathFigure, robot: Robot, path: PathSummary, rows: PathChecks, motions: AvoidanceRows, near: NearThresholds
) -> PathDrawing:
    alt = tr(
        "Panels over time for {path}: joint angles, velocities and accelerations; distances from the singular sets, "
        "condition number, manipulability; the path in space; joint speeds against their limits. {finding}.",
        path=path.name,
        finding=path_text(path),
    )
    uri = figure.draw(robot, path, _drawn(path, rows), motions, near)
    return PathDrawing(uri, alt, _conclusion(path, rows), float(figure.figure.get_figwidth()))


def _drawn(path: PathSummary, rows: PathChecks) -> PathChecks:
    """The rows that a curve needs: evenly spread ones, those at singular poses, and the greatest speeds."""
    even = np.linspace(0, len(rows) - 1, min(DRAWN, len(rows))).round()
    events = [int(np.argmin(np.abs(rows.t_s - event.t_s))) for event in path.singularities]
    speed = np.nan_to_num(rows.speed_ratio)
    fast = np.flatnonzero(speed > 0.5 * speed.max())[:: max(1, len(rows) // DRAWN // 2)]
    return rows.take(np.unique(np.concatenate([even, events, fast]).astype(int)))


def _faults(path: PathSummary) -> list[list[str]]:
    kinds = (
        (tr("not reachable"), path.unreachable),
        (tr("outside limits"), path.out_of_limits),
        (tr("too fast"), path.too_fast),
        (tr("collision"), path.collisions),
    )
    return [
        [
            word,
            fixed(part.t0_s, 3),
            fixed(part.t1_s, 3),
            fixed(part.s0_m * 1000, 1),
            fixed(part.s1_m * 1000, 1),
            say(part.cause),
        ]
        for word, stretches in kinds
        for part in stretches
    ]


def _strategies(path: PathSummary) -> list[list[str]]:
    """Rows of the comparison: the programme, each strategy, and the exact path at its fastest."""
    if not path.avoidance:
        return []
    clearance = _clearance(path.clearance.least_mm if path.clearance else None)
    ratios = _ratio(path.max_joint_speed_ratio), _ratio(path.max_joint_acceleration_ratio)
    programmed = ["0", "0", *ratios, clearance, fixed(path.duration_s, 2), tr("the path to be repaired")]
    rows = [[tr("as programmed"), *programmed]]
    for tried in path.avoidance:
        name = strategy_word(tried.name) + (" ←" if tried.name == path.strategy else "")
        if tried.motion is None:
            rows.append([name, *["–"] * 6, tr("not possible: {reason}", reason=reasons(tried))])
        else:
            rows.append([name, *_costs(tried.motion), _remark(tried, tried.motion)])
    if path.fastest_s:
        costs = ["0", "0", "1.00", "1.00", clearance, fixed(path.fastest_s, 2)]
        rows.append([tr("the path at its fastest"), *costs, tr("for comparison")])
    return rows


def _costs(motion: StrategyMotion) -> list[str]:
    return [
        _small(motion.max_deviation_mm),
        _small(motion.max_deviation_deg),
        _ratio(motion.max_joint_speed_ratio),
        _ratio(motion.max_joint_acceleration_ratio),
        _clearance(motion.clearance_mm),
        fixed(motion.duration_s, 2),
    ]


def _clearance(value: float | None) -> str:
    return "–" if value is None else fixed(value, 0)


def _remark(tried: TriedStrategy, motion: StrategyMotion) -> str:
    if tried.reasons:
        return tr("not usable: {reason}", reason=reasons(tried))
    if tried.name == "detour":
        return tr("joint moves are unaffected by singularities")
    return tr("keeps its distance from singular poses") if motion.keeps_clear else tr("goes through the region")


def _ratio(value: float | None) -> str:
    return tr("no bound") if value is None else fixed(value, 2)


def _small(value: float) -> str:
    return "0" if value < 5e-4 else number(value, 3)


def _conclusion(path: PathSummary, rows: PathChecks) -> str:
    """What the curves show, in one or two sentences."""
    condition, parts = rows.condition_number, []
    joint = path.fastest_joint
    if path.max_joint_speed_deg_s and joint is not None:
        speed = number(path.max_joint_speed_deg_s[joint], 3)
        parts.append(tr("J{joint} is the fastest joint, with {speed} deg/s.", joint=joint + 1, speed=speed))
    elif rows.reachable.any():
        parts.append(tr("Towards the edge of reach the joint speeds grow without bound: the path must end before it."))
    else:
        parts.append(tr("No point of the path can be reached."))
    if np.isinf(condition).any() or any(event.crossing for event in path.singularities):
        parts.append(tr("The condition number has no bound at the marked singular poses."))
    elif not np.isnan(condition).all():
        most = number(float(np.nanmax(condition)), 3)
        parts.append(tr("The condition number rises to {most} at most.", most=most))
    return " ".join(parts)


def _speed(path: PathSummary) -> str:
    joint = path.fastest_joint
    if not path.max_joint_speed_deg_s or joint is None:
        return "–" if not path.joint_speed_bounded and path.verdict == "unreachable" else tr("unbounded")
    return f"{number(path.max_joint_speed_deg_s[joint], 3)} (J{joint + 1})"


def _event_row(event: Singularity) -> list[str]:
    when = fixed(event.t_s, 6)
    if event.until_s > event.t_s:
        when += f" – {fixed(event.until_s, 6)}"
    if event.crossing:
        return [event_word(event), when, tr("meets it"), "0"]
    return [event_word(event), when, tr("passes by"), event_distance(event)]
