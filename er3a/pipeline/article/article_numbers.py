"""er3a's results for the statements of the article: from a study's results, or computed here if no stage has them.

The article's own inputs are constants here, with the section that they come from. All else is computed.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.stats import kendalltau

from er3a.comparison.compare import compare
from er3a.geometry.transforms import rotation_angle, rpy_of, transform
from er3a.kinematics.forward import forward, frames, jacobian
from er3a.kinematics.inverse import inverse
from er3a.kinematics.numerical import solve
from er3a.kinematics.singularity import characteristic_length, conditioning
from er3a.numerics.arrays import Reals
from er3a.pipeline.results import read_stage
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.trajectory.model import PathChecks, PathSummary, TrajectorySummary
from er3a.pipeline.stages.validation.model import ValidationSummary
from er3a.pipeline.stages.workspace.model import WorkspaceSummary
from er3a.pipeline.study import ArticleTables, Study
from er3a.planning.names import StrategyName
from er3a.robots.robot import Robot

EXAMPLE = np.array([0, np.pi / 4, -np.pi / 6, 0, np.pi / 3, 0])  # section 4.1
TARGET_MM, TARGET_RPY_DEG = (500.0, 200.0, 700.0), (0.0, 90.0, 0.0)  # section 4.2
SAME_RPY_DEG = (30.0, 90.0, 30.0)  # the target's orientation too, because its pitch is 90 deg
WINDOW_Z_MM = (0.0, 1500.0)  # section 3.2
STATEMENTS = "er3a_c60_article"  # the reference set with the article's sentences and table
MOVE, LINE = "article_joint", "article_line"  # paths of the study
COMPARED = 1000  # random poses that two measures rank
NEAR_WRIST_DEG = 1.0


@dataclass(frozen=True)
class TableNumbers:
    """What one table comes to.

    Attributes
    ----------
    statements, statements_met : sentences and entries of the article that the table is checked against, if it is
    checks, checks_met : independent checks of the validation stage
    upper_arm_deg, forearm_deg : from the vertical, all joints at 0
    tool_mm, example_mm, example_rpy_deg : tool point at 0, and the pose of the article's example
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
    example_rpy_deg: tuple[float, ...]
    solutions: int
    within_limits: int
    volume_m3: tuple[float, float]
    reach_mm: float
    void_litres: tuple[float, float] | None
    void_mm: tuple[float, ...] | None
    line: str | None
    crossings_s: tuple[float, ...]
    line_speed_deg_s: float | None


@dataclass(frozen=True)
class ArticleNumbers:
    """All that the page shows: three tables, and what concerns the printed one alone (mm, deg, deg/s, ratios)."""

    printed: TableNumbers
    corrected: TableNumbers
    real: TableNumbers
    fault: str
    fault_deg: float
    missed_before_mm: float
    missed_after_mm: float
    literal_rise_mm: float
    circle_mm: float
    circle_error_mm: float
    off_anywhere_mm: float | None
    off_aligned_mm: float | None
    wrist_turn_deg: float
    wrist_gain: float
    residual_mm: float
    free_beyond_deg: float
    free_joint: int
    kept_solved: bool
    same_pose_deg: float
    move_speed_deg_s: float
    strategy: StrategyName | None
    strategies_usable: tuple[StrategyName, ...]
    ranked_apart_percent: float
    round_trip_deg: float
    round_trips: int


Agreement = Literal["agrees", "differs", "in_part", "not_examined", "done"]
EXACT_MM, EXACT_DEG, STATED_DEG = 1e-6, 1e-6, 0.5


def agreements(numbers: ArticleNumbers) -> dict[str, Agreement]:
    """Whether what is computed agrees with what the article says, by the codes of its items.

    "done" is for what can be carried out, but where the article gives nothing to compare with. Items that are missing
    here have a stage of the pipeline of their own.
    """
    printed, corrected, real = numbers.printed, numbers.corrected, numbers.real
    void, left = printed.void_litres, corrected.void_litres

    def agrees(holds: bool, examined: object = True) -> Agreement:
        return ("agrees" if holds else "differs") if examined else "not_examined"

    return {
        "payload": "not_examined",
        "toolbox": "not_examined",
        "definitions": agrees(numbers.literal_rise_mm < EXACT_MM),
        "zero_pose": agrees(printed.upper_arm_deg < STATED_DEG and abs(printed.forearm_deg - 90) < STATED_DEG),
        "circle": agrees(numbers.circle_error_mm < EXACT_MM),
        "offset": agrees(printed.statements_met == printed.statements, printed.statements),
        "plot": agrees(WINDOW_Z_MM[0] <= printed.tool_mm[2] <= WINDOW_Z_MM[1]),
        "wrist": agrees(numbers.wrist_turn_deg > 1 + EXACT_DEG),
        "target": "in_part" if numbers.same_pose_deg < EXACT_DEG else "agrees",
        "ikine": "in_part" if numbers.free_beyond_deg > 0 else "agrees",
        "ikcon": agrees(numbers.kept_solved),
        "unreachable": "in_part" if printed.within_limits < corrected.within_limits else "agrees",
        "eight": agrees(0 < printed.solutions <= 8 and numbers.residual_mm < EXACT_MM),
        "void": agrees(printed.void_mm is not None and printed.void_mm[2] < 0),
        "line_singular": "in_part" if printed.crossings_s else agrees(True, printed.line),
        "condition": agrees(numbers.ranked_apart_percent == 0),
        "key_poses": agrees(printed.checks_met == printed.checks, printed.checks),
        "boundary": agrees(abs(printed.reach_mm - real.reach_mm) < 1.0),
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
    paths = _paths(results, tables.printed)
    compared = compare(robot, study.robot(tables.real))
    hypothesis = next(found for found in validation.diagnoses if found.reference_set == STATEMENTS).hypotheses[0]
    fault = hypothesis.faults[0]
    literal = _base_turned(robot.replace(convention="modified"))
    circle = _base_turned(robot)
    radius = np.hypot(circle[:, 0], circle[:, 1])
    target = transform(np.array(TARGET_MM) / 1000, np.radians(TARGET_RPY_DEG))
    same = transform(np.array(TARGET_MM) / 1000, np.radians(SAME_RPY_DEG))
    free, kept = solve(robot, target, np.zeros(6), respect_limits=False), solve(robot, target, np.zeros(6))
    beyond = np.degrees(np.maximum(free.q - robot.upper, robot.lower - free.q))
    reached = forward(robot, inverse(robot, target).q)[:, :3, 3]
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
        literal_rise_mm=float(np.ptp(literal[:, 2])),
        circle_mm=float(radius.mean()),
        circle_error_mm=float(max(np.ptp(radius), np.ptp(circle[:, 2]))),
        off_anywhere_mm=compared.as_printed_mm,
        off_aligned_mm=compared.aligned_mm,
        **_of_the_wrist(robot),
        residual_mm=float(1000 * np.linalg.norm(reached - target[:3, 3], axis=1).max()),
        free_beyond_deg=float(beyond.max()),
        free_joint=int(beyond.argmax()) + 1,
        kept_solved=bool(np.all(kept.solved)),
        same_pose_deg=float(np.degrees(rotation_angle(same[:3, :3], target[:3, :3]))),
        move_speed_deg_s=max(paths[MOVE].max_joint_speed_deg_s or (np.nan,)),
        strategy=paths[LINE].strategy,
        strategies_usable=tuple(tried.name for tried in paths[LINE].avoidance if tried.usable),
        ranked_apart_percent=_ranked_apart_percent(robot, study.seed),
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


def _paths(results: Path, robot: str) -> dict[str, PathSummary]:
    summary: TrajectorySummary = summary_of(results, robot, "trajectory")
    return {path.name: path for path in summary.paths}


def _table(robot: Robot, results: Path, name: str) -> TableNumbers:
    validation: ValidationSummary = summary_of(results, name, "validation")
    workspace: WorkspaceSummary = summary_of(results, name, "workspace")
    claims = next((found.counts.claims for found in validation.sets if found.name == STATEMENTS), None)
    checks = validation.counts.independent
    upper_arm_deg, forearm_deg = _zero_pose_deg(robot)
    example = forward(robot, EXAMPLE)
    found = inverse(robot, transform(np.array(TARGET_MM) / 1000, np.radians(TARGET_RPY_DEG)))
    void = max(workspace.enclosed_voids, key=lambda each: each.volume_m3.lower, default=None)
    line = _paths(results, name).get(LINE)
    return TableNumbers(
        statements=claims.passed + claims.failed if claims else None,
        statements_met=claims.passed if claims else None,
        checks=checks.passed + checks.failed,
        checks_met=checks.passed,
        upper_arm_deg=upper_arm_deg,
        forearm_deg=forearm_deg,
        tool_mm=_rounded(1000 * forward(robot, np.zeros(6))[:3, 3]),
        example_mm=_rounded(1000 * example[:3, 3]),
        example_rpy_deg=_rounded(np.degrees(rpy_of(example))),
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


def _base_turned(robot: Robot) -> Reals:
    """Tool points (100, 3) in mm, joint 1 over its range and the others at 0."""
    q = np.zeros((100, 6))
    q[:, 0] = np.linspace(robot.lower[0], robot.upper[0], len(q))
    return 1000 * forward(robot, q)[:, :3, 3]


def _random_joints(robot: Robot, seed: int, count: int) -> Reals:
    """Joint values (count, n), evenly drawn within the limits, as the article draws its cloud."""
    return np.random.default_rng(seed).uniform(robot.lower, robot.upper, (count, robot.joints))


def _of_the_wrist(robot: Robot) -> dict[str, Any]:
    """By how much one degree of joint 4 turns the tool at joint angles 0 (deg), and the fastest wrist joint while the
    tool turns at one unit about the worst axis near there."""
    T = forward(robot, np.radians(np.outer([0.0, 1.0], [0, 0, 0, 1, 0, 0])))
    near = np.radians(NEAR_WRIST_DEG) * np.array([0, 0, 0, 0, 1, 0])
    gains = np.linalg.norm(np.linalg.inv(jacobian(robot, near)[3:, 3:]), axis=1)
    return {
        "wrist_turn_deg": float(np.degrees(rotation_angle(T[0, :3, :3], T[1, :3, :3]))),
        "wrist_gain": float(gains.max()),
    }


def _ranked_apart_percent(robot: Robot, seed: int) -> float:
    """Of pairs of random poses, those that manipulability and condition number rank differently (Kendall's tau)."""
    measures = conditioning(robot, _random_joints(robot, seed, COMPARED), characteristic_length(robot))
    tau = kendalltau(measures.manipulability, -measures.condition_number).statistic
    return float(50 * (1 - tau))
