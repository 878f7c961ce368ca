"""er3a's results for what the article says of its own table: from a study's results, or computed here if no stage has
them. What needs no study is in ``docs/notebooks/article_steps.md``.

The article's own inputs are constants here, with the section that they come from. All else is computed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from er3a.by_value import frozen
from er3a.comparison.compare import compare
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward, frames
from er3a.kinematics.inverse import inverse
from er3a.numerics.arrays import Reals
from er3a.pipeline.results import read_stage
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.trajectory.model import PathChecks, TrajectorySummary
from er3a.pipeline.stages.validation.model import ValidationSummary
from er3a.pipeline.stages.workspace.model import WorkspaceSummary
from er3a.pipeline.study import ArticleTables, Study
from er3a.robots.robot import Robot

EXAMPLE = np.array([0, np.pi / 4, -np.pi / 6, 0, np.pi / 3, 0])  # section 4.1
TARGET_MM, TARGET_RPY_DEG = (500.0, 200.0, 700.0), (0.0, 90.0, 0.0)  # section 4.2
WINDOW_Z_MM = (0.0, 1500.0)  # section 3.2
STATEMENTS = "er3a_c60_article"  # the reference set with the article's sentences and table
MOVE, LINE = "article_joint", "article_line"  # paths of the study


@frozen
class TableNumbers:
    """What one table comes to.

    Attributes
    ----------
    statements, statements_met : sentences and entries of the article that the table is checked against, if it is
    checks, checks_met : independent checks of the validation stage
    upper_arm_deg, forearm_deg : from the vertical, all joints at 0
    tool_mm, example_mm : tool point at 0, and at the article's example
    solutions, within_limits : branches of the article's target
    volume_m3 : proven bounds; reach_mm : largest distance of the tool point from axis 1
    void_litres : proven bounds of the largest enclosed void, None without one; void_mm : its centre
    line : of the article's straight line the verdict; None where the study has no such path
    crossings_s : times at which that line is singular; line_speed_deg_s : its fastest joint, None if it can't be run
    """

    statements: int | None
    statements_met: int | None
    checks: int
    checks_met: int
    upper_arm_deg: float
    forearm_deg: float
    tool_mm: tuple[float, ...]
    example_mm: tuple[float, ...]
    solutions: int
    within_limits: int
    volume_m3: tuple[float, float]
    reach_mm: float
    void_litres: tuple[float, float] | None
    void_mm: tuple[float, ...] | None
    line: str | None
    crossings_s: tuple[float, ...]
    line_speed_deg_s: float | None


@frozen
class ArticleNumbers:
    """All that the page shows: three tables, and what concerns the printed one alone (mm, deg, deg/s, ratios)."""

    printed: TableNumbers
    corrected: TableNumbers
    real: TableNumbers
    fault: str
    fault_deg: float
    missed_before_mm: float
    missed_after_mm: float
    off_anywhere_mm: float | None
    round_trip_deg: float
    round_trips: int


Agreement = Literal["agrees", "differs", "in_part", "not_examined"]
EXACT_DEG, STATED_DEG = 1e-6, 0.5


def agreements(numbers: ArticleNumbers) -> dict[str, Agreement]:
    """Whether what is computed agrees with what the article says, by the codes of its items."""
    printed, corrected = numbers.printed, numbers.corrected
    void, left = printed.void_litres, corrected.void_litres

    def agrees(holds: bool, examined: object = True) -> Agreement:
        return ("agrees" if holds else "differs") if examined else "not_examined"

    return {
        "zero_pose": agrees(printed.upper_arm_deg < STATED_DEG and abs(printed.forearm_deg - 90) < STATED_DEG),
        "offset": agrees(printed.statements_met == printed.statements, printed.statements),
        "plot": agrees(WINDOW_Z_MM[0] <= printed.tool_mm[2] <= WINDOW_Z_MM[1]),
        "unreachable": "in_part" if printed.within_limits < corrected.within_limits else "agrees",
        "void": agrees(printed.void_mm is not None and printed.void_mm[2] < 0),
        "line_singular": "in_part" if printed.crossings_s else agrees(True, printed.line),
        "key_poses": agrees(printed.checks_met == printed.checks, printed.checks),
        "round_trip": agrees(numbers.round_trip_deg < EXACT_DEG),
        "hole": "in_part" if void and (left is None or left[1] < 0.1 * void[0]) else "not_examined",
    }


def article_numbers(study: Study, tables: ArticleTables, results: Path) -> ArticleNumbers:
    """Compute what the page shows from the results of the study's three tables.

    Parameters
    ----------
    results : folder with the results of validation, workspace and trajectory of each table

    Raises
    ------
    ResultError
        if some of them are missing or damaged
    """
    robot = study.robot(tables.printed)
    validation: ValidationSummary = summary_of(results, tables.printed, "validation")
    hypothesis = next(found for found in validation.diagnoses if found.reference_set == STATEMENTS).hypotheses[0]
    fault = hypothesis.faults[0]
    rounds = validation.round_trips
    assert rounds is not None
    return ArticleNumbers(
        printed=_table(robot, results, tables.printed),
        corrected=_table(study.robot(tables.corrected), results, tables.corrected),
        real=_table(study.robot(tables.real), results, tables.real),
        fault=f"{fault.code}{getattr(fault, 'joint', '')}",
        fault_deg=float(getattr(fault, "fits_deg", np.nan)),
        missed_before_mm=hypothesis.residual_before,
        missed_after_mm=hypothesis.residual_after,
        off_anywhere_mm=compare(robot, study.robot(tables.real)).as_printed_mm,
        round_trip_deg=rounds.joint_error_deg,
        round_trips=rounds.poses,
    )


def summary_of(results: Path, robot: str, stage: str):  # type: ignore[no-untyped-def]  # the stage's own
    """The summary of a stage's results of a robot, as the stage's own type."""
    return read_stage(results / robot / stage, STAGES[stage]).results.summary


def path_rows(results: Path, robot: str, path: str) -> PathChecks:
    """A robot's path as it was checked, where the arm reaches it."""
    rows: PathChecks = read_stage(results / robot / "trajectory", STAGES["trajectory"]).results.checks
    return rows.take((rows.path == path) & rows.reachable)


def _table(robot: Robot, results: Path, name: str) -> TableNumbers:
    validation: ValidationSummary = summary_of(results, name, "validation")
    workspace: WorkspaceSummary = summary_of(results, name, "workspace")
    claims = next((found.counts.claims for found in validation.sets if found.name == STATEMENTS), None)
    checks = validation.counts.independent
    upper_arm_deg, forearm_deg = _zero_pose_deg(robot)
    found = inverse(robot, transform(np.array(TARGET_MM) / 1000, np.radians(TARGET_RPY_DEG)))
    void = max(workspace.enclosed_voids, key=lambda each: each.volume_m3.lower, default=None)
    paths: TrajectorySummary = summary_of(results, name, "trajectory")
    line = next((path for path in paths.paths if path.name == LINE), None)
    return TableNumbers(
        statements=claims.passed + claims.failed if claims else None,
        statements_met=claims.passed if claims else None,
        checks=checks.passed + checks.failed,
        checks_met=checks.passed,
        upper_arm_deg=upper_arm_deg,
        forearm_deg=forearm_deg,
        tool_mm=_rounded(1000 * forward(robot, np.zeros(6))[:3, 3]),
        example_mm=_rounded(1000 * forward(robot, EXAMPLE)[:3, 3]),
        solutions=len(np.unique(found.branch)),
        within_limits=len(np.unique(found.branch[found.within_limits])),
        volume_m3=(workspace.volume_m3.lower, workspace.volume_m3.upper),
        reach_mm=1000 * workspace.reach_m.furthest_from_axis,
        void_litres=(1000 * void.volume_m3.lower, 1000 * void.volume_m3.upper) if void else None,
        void_mm=_rounded(1000 * np.array(void.centroid_m)) if void else None,
        line=line.verdict if line else None,
        crossings_s=tuple(each.t_s for each in line.singularities if each.crossing) if line else (),
        line_speed_deg_s=max(line.max_joint_speed_deg_s) if line and line.max_joint_speed_deg_s else None,
    )


def _rounded(values: Reals) -> tuple[float, ...]:
    """Numbers without the noise of computing them, and without negative zeros."""
    return tuple((np.round(values, 6) + 0.0).tolist())


def _zero_pose_deg(robot: Robot) -> tuple[float, float]:
    """Angles of upper arm and forearm from the vertical, all joints at 0."""
    T = frames(robot, np.zeros(6))
    shoulder, elbow, wrist = (T[k, :3, 3] for k in (1, 2, 4))
    forearm = T[3, :3, 2] * (1.0 if T[3, :3, 2] @ (wrist - elbow) >= 0 else -1.0)
    return _from_vertical_deg(elbow - shoulder), _from_vertical_deg(forearm)


def _from_vertical_deg(vector: Reals) -> float:
    return float(np.degrees(np.arccos(np.clip(vector[2] / np.linalg.norm(vector), -1, 1))))
