"""er3a's results for each statement of the article: from a study's results, or computed here if no stage has them.

The article's own inputs are constants here, with the section that they come from. All else is computed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.stats import kendalltau

from er3a.collision.pairs import ShapesAssumed
from er3a.comparison.compare import compare
from er3a.dynamics.torques import gravity
from er3a.geometry.transforms import rotation_angle, rpy_of, transform
from er3a.kinematics.forward import forward, frames, jacobian, skeleton
from er3a.kinematics.inverse import inverse
from er3a.kinematics.numerical import solve
from er3a.kinematics.singularity import characteristic_length, conditioning
from er3a.numerics.arrays import Reals
from er3a.pipeline.results import read_stage
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.trajectory.model import PathChecks, PathSummary, TrajectorySummary
from er3a.pipeline.stages.validation.model import ReferenceCheck, ValidationSummary
from er3a.pipeline.stages.workspace.model import VoidSummary, VoidUnexpected, WorkspaceSummary
from er3a.pipeline.study import Study
from er3a.planning.names import StrategyName
from er3a.planning.profiles import quintic, trapezoid
from er3a.planning.toolbox import RAMP, quaternion, zyz
from er3a.references.subjects import Reach
from er3a.robots.masses import Load
from er3a.robots.robot import Robot
from er3a.workspace.causes import SingleChange, with_entry

EXAMPLE = np.array([0, np.pi / 4, -np.pi / 6, 0, np.pi / 3, 0])  # section 4.1
TARGET_MM, TARGET_RPY_DEG = (500.0, 200.0, 700.0), (0.0, 90.0, 0.0)  # section 4.2
MOVE_END = np.array([np.pi / 4, np.pi / 6, -np.pi / 8, np.pi / 3, -np.pi / 4, np.pi / 2])  # section 5.2
LINE_END_MM, LINE_END_RPY_DEG = (600.0, 300.0, 500.0), (0.0, 180.0, 0.0)  # section 5.2
DURATION_S, SAMPLES = 5.0, 50  # section 5.2
WINDOW_Z_M = (0.0, 1.5)  # section 3.2
CLOUD = 10_000  # section 5.1
STATEMENTS = "er3a_c60_article"  # the reference set with the article's sentences and table
MOVE, LINE = "article_joint", "article_line"  # paths of the study
COMPARED = 1000  # random poses that two measures rank
HOLE_CAUSES = ("lower", "upper", "direction")  # section 6.2, as columns of a table
NEAR_WRIST_DEG = (5.0, 1.0, 0.1)
SHIFTED_DEG = (0.0, 5.0, 30.0)
PAYLOAD_KG = 6.0  # section 1


@dataclass(frozen=True)
class TableNumbers:
    """What one table comes to.

    Attributes
    ----------
    statements, statements_met : sentences and entries of the article that the table is checked against, if it is
    checks, checks_met : independent checks of the validation stage
    upper_arm_deg, forearm_deg : from the vertical, all joints at 0
    tool_mm, example_mm, example_rpy_deg : tool point at 0, and the pose of the article's example
    solutions, within_limits : of the article's target; ``nearest_deg`` the one within the limits that is nearest to 0
    volume_m3 : proven bounds; reach_mm : largest distance of the tool point from axis 1
    void_litres : proven bounds of the largest enclosed void, None without one; void_mm : its centre
    other_voids : bounds (L) of other enclosed ones, and z (mm) of their centres
    line : of the article's straight line the verdict; None where the study has no such path
    move_clearance_mm, line_clearance_mm : smallest clearance on the article's paths
    rests_on : assumed shapes that these are of, if they are
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
    example_zyz_deg: tuple[float, ...]
    example_quaternion: tuple[float, ...]
    solutions: int
    within_limits: int
    nearest_deg: tuple[float, ...] | None
    volume_m3: tuple[float, float]
    reach_mm: float
    void_litres: tuple[float, float] | None
    void_mm: tuple[float, ...] | None
    other_voids: tuple[tuple[float, float, float], ...]
    line: str | None
    line_crossings_s: tuple[float, ...]
    line_speed_deg_s: float | None
    move_clearance_mm: float | None
    line_clearance_mm: float | None
    rests_on: ShapesAssumed | None = None


@dataclass(frozen=True)
class ReachCheck:
    """A known reach of the real arm (mm), and what the printed table has for it."""

    known_mm: float
    printed_mm: float
    passed: bool


@dataclass(frozen=True)
class ArticleNumbers:
    """All that the page shows: three tables, and what concerns the printed one alone (mm, deg, s, ratios)."""

    printed: TableNumbers
    corrected: TableNumbers
    real: TableNumbers
    fault: str
    fault_deg: float
    missed_before_mm: float
    missed_after_mm: float
    literal_rise_mm: float
    shifted_apart_mm: float
    off_zero_mm: float
    off_documented_mm: float | None
    off_anywhere_mm: float | None
    off_aligned_mm: float | None
    holding_nm: float | None
    holding_loaded_nm: float | None
    reach: ReachCheck | None
    circle_mm: float
    circle_error_mm: float
    length_m: float
    degrees_off_mm: float
    hidden_percent: float
    wrist_turn_deg: float
    wrist_against_deg: float
    wrist_shift_mm: tuple[float, ...]
    wrist_gain: tuple[float, ...]
    residual_mm: float
    free_beyond_deg: float
    free_joint: int
    kept_solved: bool
    same_pose_rpy_deg: tuple[tuple[float, ...], tuple[float, ...]]
    same_pose_apart_deg: float
    cloud_lowest_mm: float
    cloud_farthest_mm: float
    cloud_nearest_to_void_mm: float
    move_speed_deg_s: float
    move_acceleration_deg_s2: float
    line_speed_deg_s: float
    quintic_crossings_s: tuple[float, ...]
    crossing_speed_deg_s: float
    peak_joint: int
    peak_s: float
    line_turn_deg: float
    strategy: StrategyName | None
    strategies_usable: tuple[StrategyName, ...]
    strategies_unusable: tuple[StrategyName, ...]
    repair_mm: float | None
    repair_deg: float | None
    repair_longer_s: float | None
    ranked_apart_percent: float
    round_trip_deg: float
    round_trips: int
    changes_tried: int
    changes_undecided: int
    changes_gone: tuple[SingleChange, ...]
    changes_meeting: tuple[SingleChange, ...]


Agreement = Literal["agrees", "differs", "in_part", "not_examined", "done"]
EXACT_MM, EXACT_DEG, STATED_DEG = 1e-6, 1e-6, 0.5


def agreements(numbers: ArticleNumbers) -> dict[str, Agreement]:
    """Whether what is computed agrees with what the article says, by the codes of its items.

    "done" is for what can be carried out, but where the article gives nothing to compare with. Items that are missing
    here have a stage of the pipeline of their own.
    """
    printed, corrected = numbers.printed, numbers.corrected

    def agrees(holds: bool, examined: object = True) -> Agreement:
        return ("agrees" if holds else "differs") if examined else "not_examined"

    return {
        "payload": "not_examined",
        "toolbox": "not_examined",
        "definitions": agrees(numbers.literal_rise_mm < EXACT_MM),
        "zero_pose": agrees(printed.upper_arm_deg < STATED_DEG and abs(printed.forearm_deg - 90) < STATED_DEG),
        "circle": agrees(numbers.circle_error_mm < EXACT_MM),
        "offset": agrees(printed.statements_met == printed.statements, printed.statements),
        "plot": agrees(numbers.hidden_percent == 0),
        "wrist": agrees(numbers.wrist_turn_deg > 1 + EXACT_DEG),
        "target": "in_part" if numbers.same_pose_apart_deg < EXACT_DEG else "agrees",
        "ikine": "in_part" if numbers.free_beyond_deg > 0 else "agrees",
        "ikcon": agrees(numbers.kept_solved),
        "unreachable": "in_part" if printed.within_limits < corrected.within_limits else "agrees",
        "eight": agrees(0 < printed.solutions <= 8 and numbers.residual_mm < EXACT_MM),
        "void": agrees(printed.void_mm is not None and printed.void_mm[2] < 0),
        "line_singular": "in_part" if printed.line_crossings_s else agrees(True, printed.line),
        "condition": agrees(numbers.ranked_apart_percent == 0),
        "key_poses": agrees(printed.checks_met == printed.checks, printed.checks),
        "boundary": "not_examined" if numbers.reach is None else agrees(numbers.reach.passed),
        "round_trip": agrees(numbers.round_trip_deg < EXACT_DEG),
        "hole": "in_part"
        if any(change.column not in HOLE_CAUSES for change in numbers.changes_meeting)
        else agrees(True, numbers.changes_tried > numbers.changes_undecided),
    }


def article_numbers(study: Study, results: Path) -> ArticleNumbers:
    """Compute what the page shows from the results of the study's three tables."""
    tables = study.article
    assert tables is not None
    robot = study.robot(tables.printed)
    validation: ValidationSummary = summary_of(results, tables.printed, "validation")
    trajectory: TrajectorySummary = summary_of(results, tables.printed, "trajectory")
    workspace: WorkspaceSummary = summary_of(results, tables.printed, "workspace")
    printed, corrected, real = (_table(study, results, name) for name in tables.names)
    compared = compare(robot, study.robot(tables.real))
    hypothesis = next(found for found in validation.diagnoses if found.reference_set == STATEMENTS).hypotheses[0]
    fault = hypothesis.faults[0]
    literal = _points(robot.replace(convention="modified"), _base_turned(robot))
    random = random_joints(robot, study.seed, CLOUD)
    shifted = np.abs(_points(_one_row_down(robot), random) - _points(robot, random))
    circle = _points(robot, _base_turned(robot))
    radius = np.hypot(circle[:, 0], circle[:, 1])
    target = _target()
    free, kept = solve(robot, target, np.zeros(6), respect_limits=False), solve(robot, target, np.zeros(6))
    beyond = np.degrees(np.maximum(free.q - robot.upper, robot.lower - free.q))
    cloud = 1000 * _points(robot, random)
    void = np.array(printed.void_mm if printed.void_mm else (np.nan,) * 3)
    move, line = (next(path for path in trajectory.paths if path.name == name) for name in (MOVE, LINE))
    repair = line.chosen.motion if line.chosen else None
    rpy = (0.0, 90.0, 0.0), (30.0, 90.0, 30.0)
    same = [transform(np.zeros(3), np.radians(angles)) for angles in rpy]
    rounds = validation.round_trips
    assert rounds is not None
    return ArticleNumbers(
        printed=printed,
        corrected=corrected,
        real=real,
        fault=f"{fault.code}{getattr(fault, 'joint', '')}",
        fault_deg=float(getattr(fault, "fits_deg", np.nan)),
        missed_before_mm=hypothesis.residual_before,
        missed_after_mm=hypothesis.residual_after,
        literal_rise_mm=float(1000 * np.ptp(literal[:, 2])),
        shifted_apart_mm=float(1000 * shifted.max()),
        off_zero_mm=float(np.linalg.norm(np.subtract(printed.tool_mm, real.tool_mm))),
        off_documented_mm=max((each.described.mismatch_mm for each in validation.sets if each.described), default=None),
        off_anywhere_mm=compared.as_printed_mm,
        off_aligned_mm=compared.aligned_mm,
        holding_nm=_holding_nm(study.robot(tables.real), study.seed, None),
        holding_loaded_nm=_holding_nm(study.robot(tables.real), study.seed, Load(PAYLOAD_KG)),
        reach=_reach_check(validation, tables.real),
        circle_mm=float(1000 * radius.mean()),
        circle_error_mm=float(1000 * max(np.ptp(radius), np.ptp(circle[:, 2]))),
        length_m=float(np.abs(robot.a).sum() + np.abs(robot.d).sum()),
        degrees_off_mm=_off_mm(robot, np.degrees(EXAMPLE), EXAMPLE),
        hidden_percent=_hidden_percent(robot),
        wrist_turn_deg=_turn_deg(robot, (0, 0, 0, 1, 0, 0)),
        wrist_against_deg=_turn_deg(robot, (0, 0, 0, 1, 0, -1)),
        wrist_shift_mm=tuple(_shift_mm(robot, np.radians(angle)) for angle in SHIFTED_DEG),
        wrist_gain=tuple(_wrist_gain(robot, np.radians(angle)) for angle in NEAR_WRIST_DEG),
        residual_mm=_residual_mm(robot, target),
        free_beyond_deg=float(beyond.max()),
        free_joint=int(beyond.argmax()) + 1,
        kept_solved=bool(np.all(kept.solved)),
        same_pose_rpy_deg=rpy,
        same_pose_apart_deg=float(np.degrees(rotation_angle(same[0][:3, :3], same[1][:3, :3]))),
        cloud_lowest_mm=float(cloud[:, 2].min()),
        cloud_farthest_mm=float(np.hypot(cloud[:, 0], cloud[:, 1]).max()),
        cloud_nearest_to_void_mm=float(np.linalg.norm(cloud - void, axis=1).min()),
        move_speed_deg_s=max(move.max_joint_speed_deg_s or (np.nan,)),
        move_acceleration_deg_s2=float(np.nanmax(np.abs(path_rows(results, tables.printed, MOVE).q_deg_s2))),
        line_speed_deg_s=max(line.max_joint_speed_deg_s or (np.nan,)),
        line_turn_deg=_line_turn_deg(robot),
        **_of_the_line(results, tables.printed, printed, line),
        repair_mm=repair.max_deviation_mm if repair else None,
        repair_deg=repair.max_deviation_deg if repair else None,
        repair_longer_s=repair.duration_s - line.duration_s if repair else None,
        ranked_apart_percent=_ranked_apart_percent(robot, study.seed),
        round_trip_deg=rounds.joint_error_deg,
        round_trips=rounds.poses,
        **_changes_of_the_void(robot, workspace, printed),
    )


def _changes_of_the_void(robot: Robot, workspace: WorkspaceSummary, printed: TableNumbers) -> dict[str, Any]:
    """Single changes of the printed table that take its void away, and those of them that keep the pose at zero."""
    finding = workspace.verdict.finding
    changes = finding.single_changes if isinstance(finding, VoidUnexpected) else ()
    smallest = 0.1 * printed.void_litres[0] if printed.void_litres else 0.0
    gone = tuple(change for change in changes if change.left_litres and change.left_litres[1] < smallest)
    meeting = [each for each in gone if _meets_zero_pose(with_entry(robot, each.column, each.joint, each.tried))]
    undecided = sum(change.left_litres is None for change in changes)
    return {
        "changes_tried": len(changes),
        "changes_undecided": undecided,
        "changes_gone": gone,
        "changes_meeting": tuple(meeting),
    }


def summary_of(results: Path, robot: str, stage: str):  # type: ignore[no-untyped-def]  # the stage's own
    return read_stage(results / robot / stage, STAGES[stage]).results.summary


def path_rows(results: Path, robot: str, path: str) -> PathChecks:
    """A robot's path as it was checked, where the arm reaches it."""
    rows: PathChecks = read_stage(results / robot / "trajectory", STAGES["trajectory"]).results.checks
    return rows.take((rows.path == path) & rows.reachable)


def _table(study: Study, results: Path, name: str) -> TableNumbers:
    robot = study.robot(name)
    validation: ValidationSummary = summary_of(results, name, "validation")
    workspace: WorkspaceSummary = summary_of(results, name, "workspace")
    trajectory: TrajectorySummary = summary_of(results, name, "trajectory")
    claims = next((found.counts.claims for found in validation.sets if found.name == STATEMENTS), None)
    checks = validation.counts.independent
    upper_arm_deg, forearm_deg = _zero_pose_deg(robot)
    example = forward(robot, EXAMPLE)
    found = inverse(robot, _target())
    kept = found.q[found.within_limits]
    nearest = kept[np.abs(kept).max(axis=1).argmin()] if len(kept) else None
    voids = sorted(workspace.enclosed_voids, key=lambda each: -each.volume_m3.lower)
    void = voids[0] if voids else None
    line, move = (next((path for path in trajectory.paths if path.name == own), None) for own in (LINE, MOVE))
    return TableNumbers(
        statements=claims.passed + claims.failed if claims else None,
        statements_met=claims.passed if claims else None,
        checks=checks.passed + checks.failed,
        checks_met=checks.passed,
        upper_arm_deg=upper_arm_deg,
        forearm_deg=forearm_deg,
        tool_mm=_mm(forward(robot, np.zeros(6))[:3, 3]),
        example_mm=_mm(example[:3, 3]),
        example_rpy_deg=tuple(np.degrees(rpy_of(example)).round(9).tolist()),
        example_zyz_deg=tuple(np.degrees(zyz(example)).round(9).tolist()),
        example_quaternion=tuple(quaternion(example).round(12).tolist()),
        solutions=len(np.unique(found.branch)),
        within_limits=len(np.unique(found.branch[found.within_limits])),
        nearest_deg=None if nearest is None else tuple(np.degrees(nearest).tolist()),
        volume_m3=(workspace.volume_m3.lower, workspace.volume_m3.upper),
        reach_mm=1000 * workspace.reach_m.furthest_from_axis,
        void_litres=_litres(void) if void else None,
        void_mm=_mm(np.array(void.centroid_m)) if void else None,
        other_voids=tuple((*_litres(each), 1000 * each.centroid_m[2]) for each in voids[1:]),
        line=line.verdict if line else None,
        line_crossings_s=tuple(each.t_s for each in line.singularities if each.crossing) if line else (),
        line_speed_deg_s=max(line.max_joint_speed_deg_s) if line and line.max_joint_speed_deg_s else None,
        move_clearance_mm=move.clearance.least_mm if move and move.clearance else None,
        line_clearance_mm=line.clearance.least_mm if line and line.clearance else None,
        rests_on=trajectory.verdict.shapes,
    )


def _zero_pose_deg(robot: Robot) -> tuple[float, float]:
    """Angles of upper arm and forearm from the vertical, all joints at 0."""
    T = frames(robot, np.zeros(6))
    shoulder, elbow, wrist = (T[k, :3, 3] for k in (1, 2, 4))
    forearm = T[3, :3, 2] * (1.0 if T[3, :3, 2] @ (wrist - elbow) >= 0 else -1.0)
    return _from_vertical_deg(elbow - shoulder), _from_vertical_deg(forearm)


def _meets_zero_pose(robot: Robot) -> bool:
    """Whether the upper arm is vertical and the forearm horizontal, as section 2.2 says."""
    upper_arm, forearm = _zero_pose_deg(robot)
    return upper_arm < STATED_DEG and abs(forearm - 90) < STATED_DEG


def _litres(void: VoidSummary) -> tuple[float, float]:
    return 1000 * void.volume_m3.lower, 1000 * void.volume_m3.upper


def _mm(point: Reals) -> tuple[float, ...]:
    return tuple((np.round(1000 * point, 6) + 0.0).tolist())


def _target() -> Reals:
    return transform(np.array(TARGET_MM) / 1000, np.radians(TARGET_RPY_DEG))


def _from_vertical_deg(vector: Reals) -> float:
    return float(np.degrees(np.arccos(np.clip(vector[2] / np.linalg.norm(vector), -1, 1))))


def _base_turned(robot: Robot) -> Reals:
    """Joint values (100, 6), joint 1 over its range and the others at 0."""
    q = np.zeros((100, 6))
    q[:, 0] = np.linspace(robot.lower[0], robot.upper[0], len(q))
    return q


def _one_row_down(robot: Robot) -> Robot:
    """The table as Craig would write it: a and alpha of row i, after joint i, are in row i + 1."""
    a, alpha = (np.concatenate([[0.0], values[:-1]]) for values in (robot.a, robot.alpha))
    return robot.replace(convention="modified", a=a, alpha=alpha)


def _points(robot: Robot, q: Reals) -> Reals:
    return forward(robot, q)[:, :3, 3]


def random_joints(robot: Robot, seed: int, count: int) -> Reals:
    """Joint values (count, n), evenly drawn within the limits, as the article draws its cloud."""
    return np.random.default_rng(seed).uniform(robot.lower, robot.upper, (count, robot.joints))


def _off_mm(robot: Robot, q: Reals, right: Reals) -> float:
    """How far the tool point is off at joint values."""
    return float(1000 * np.linalg.norm(forward(robot, q)[:3, 3] - forward(robot, right)[:3, 3]))


def _hidden_percent(robot: Robot) -> float:
    """Part of the arm's length that is outside the article's plot window, all joints at 0."""
    corners = skeleton(robot, np.zeros(6))
    share = np.linspace(0, 1, 1001)[:, None]
    steps = [(1 - share) * start + share * end for start, end in pairwise(corners)]
    weights = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    low, high = WINDOW_Z_M
    outside = [np.mean((points[:, 2] < low) | (points[:, 2] > high)) for points in steps]
    return float(100 * np.average(outside, weights=weights))


def _holding_nm(real: Robot, seed: int, load: Load | None) -> float | None:
    """The maximum torque (N m) that joint 2 holds at rest at random poses; None where no link's mass is known."""
    if not real.masses.links:
        return None
    return float(np.abs(gravity(real, random_joints(real, seed, CLOUD), load)[:, 1]).max())


def _reach_check(validation: ValidationSummary, real: str) -> ReachCheck | None:
    """The largest distance of the wrist centre from axis 1, if the real arm's references know it."""
    wanted = Reach("greatest", "wrist_centre", 1)
    for check in validation.checks:
        if isinstance(check, ReferenceCheck) and check.reference_set == real and check.subject == wanted:
            return ReachCheck(check.expected, check.measured, check.status == "pass")
    return None


def _turn_deg(robot: Robot, step_deg: Sequence[float]) -> float:
    """By how much a step of all joints turns the tool at joint angles 0 (deg)."""
    T = forward(robot, np.radians(np.stack([np.zeros(6), step_deg])))
    return float(np.degrees(rotation_angle(T[0, :3, :3], T[1, :3, :3])))


def _line_turn_deg(robot: Robot) -> float:
    """How far apart (deg) the orientations at both ends of the article's line are."""
    end = transform(np.array(LINE_END_MM) / 1000, np.radians(LINE_END_RPY_DEG))
    return float(np.degrees(rotation_angle(forward(robot, np.zeros(6))[:3, :3], end[:3, :3])))


def _shift_mm(robot: Robot, angle: float) -> float:
    """By how much one degree of joint 4 moves the tool point, joint 5 at an angle (rad) and the others at 0."""
    q = np.zeros((2, 6))
    q[:, 4], q[1, 3] = angle, np.radians(1.0)
    return float(1000 * np.linalg.norm(np.diff(_points(robot, q), axis=0)))


def _on_a_quintic(t: float) -> float:
    """When (s) a quintic is where ctraj's trapezoid is at a time (s), both over the line's duration."""
    there = float(trapezoid(np.array(t), DURATION_S, RAMP)[0])
    times = np.linspace(0, DURATION_S, 100_001)
    return float(np.interp(there, quintic(times, DURATION_S, np.zeros(1), np.ones(1))[0][:, 0], times))


def _wrist_gain(robot: Robot, angle: float) -> float:
    """The fastest wrist joint while the tool turns at one unit about the worst axis, joint 5 at an angle (rad)."""
    q = np.zeros(6)
    q[4] = angle
    return float(np.linalg.norm(np.linalg.inv(jacobian(robot, q)[3:, 3:]), axis=1).max())


def _residual_mm(robot: Robot, target: Reals) -> float:
    """By how much the solutions in closed form miss a target at most."""
    T = forward(robot, inverse(robot, target).q)
    return float(1000 * np.linalg.norm(T[:, :3, 3] - target[:3, 3], axis=1).max())


def _ranked_apart_percent(robot: Robot, seed: int) -> float:
    """Of pairs of random poses, those that manipulability and condition number rank differently (Kendall's tau)."""
    measures = conditioning(robot, random_joints(robot, seed, COMPARED), characteristic_length(robot))
    tau = kendalltau(measures.manipulability, -measures.condition_number).statistic
    return float(50 * (1 - tau))


def _of_the_line(results: Path, robot: str, table: TableNumbers, line: PathSummary) -> dict[str, Any]:
    """When a quintic would cross, how fast joints are at the last crossing and at most, and what can be done."""
    rows = path_rows(results, robot, LINE)
    speeds = np.abs(rows.q_deg_s)
    peak, joint = np.unravel_index(speeds.argmax(), speeds.shape)
    crossings = table.line_crossings_s
    return {
        "quintic_crossings_s": tuple(map(_on_a_quintic, crossings)),
        "crossing_speed_deg_s": float(np.interp(max(crossings, default=np.nan), rows.t_s, speeds.max(axis=1))),
        "peak_joint": int(joint) + 1,
        "peak_s": float(rows.t_s[peak]),
        "strategy": line.strategy,
        "strategies_usable": tuple(tried.name for tried in line.avoidance if tried.usable),
        "strategies_unusable": tuple(tried.name for tried in line.avoidance if not tried.usable),
    }
