"""One target: all its solutions as a table, and the entry that the summary holds of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from er3a.collision.scene import Scene
from er3a.files.target_file import Target
from er3a.geometry.transforms import rotation_angle, rpy_of
from er3a.kinematics.admissible import Choice, limit_margin, nearest
from er3a.kinematics.closed_form import ORIENTATION
from er3a.kinematics.families import Family
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import CLOSED_FORM, Solutions, inverse
from er3a.kinematics.singularity import TYPES, characteristic_length, conditioning, determinant_factors
from er3a.kinematics.wrist_partitioned import solve_slots
from er3a.pipeline.messages.language import N_, joined, said
from er3a.pipeline.stages.inverse.advice import Neighbours, neighbours
from er3a.pipeline.stages.inverse.columns import COLUMNS, JOINT_COLUMNS, TURN_COLUMNS
from er3a.robots.joint_limits import LIMIT_TOLERANCE
from er3a.robots.robot import Robot
from er3a.selection.select import all_collide, refusals

SINGULAR = 1e-6
LITTLE_MARGIN_DEG = 2.0


def solve_target(
    robot: Robot, target: Target, random: np.random.Generator, scene: Scene | None = None
) -> tuple[dict[str, Any], pd.DataFrame, Solutions]:
    """Solve, choose, explain; solutions that collide with the scene or with themselves are not chosen.

    Returns
    -------
    entry : plain data for the summary
    table : one row per solution, turns included
    solutions : what the table was made from
    """
    T, q_ref = target.pose(robot), target.reference()
    solutions = inverse(robot, T, q_ref)
    refused = refusals(robot, solutions, scene)
    choice = nearest(robot, solutions, q_ref, np.array([not text for text in refused], dtype=bool))
    table = _table(robot, target, T, solutions, choice, refused)
    collide = choice.chosen is None and bool(solutions.within_limits.any())
    entry = refused_target(robot, target, all_collide(robot, solutions, refused) if collide else choice.reason)
    entry["solutions"] = int(table["branch"].nunique())
    entry["within_limits"] = int(table.loc[table["within_limits"], "branch"].nunique())
    entry["rows_within_limits"] = int(table["within_limits"].sum())
    entry["collide"] = int(table.loc[table["collision"] != "", "branch"].nunique())
    entry["unsolved"] = list(solutions.unsolved)
    entry["method"] = solutions.method
    entry["families"] = [_family(family) for family in solutions.families]
    if collide:
        within = entry["within_limits"]
        entry["short_reason"] = said("all {count} branches within the limits collide", count=within)
        entry["advice"] = [N_("Move the part, the obstacle or the base: limits leave this pose reachable.")]
        return entry, table, solutions
    if choice.chosen is None:
        missing = _missing(robot, T, q_ref, solutions) if not len(solutions.q) else None
        entry["short_reason"] = _short_reason(entry["solutions"], missing)
        if solutions.method == CLOSED_FORM:
            entry["neighbours"] = _plain(near := neighbours(robot, T, random))
            entry["advice"] = _what_would_help(near)
        return entry, table, solutions
    row = table.iloc[choice.chosen]
    entry["chosen_deg"] = row[JOINT_COLUMNS].astype(float).tolist()
    entry["chosen_branch"] = int(row["branch"])
    entry["short_reason"] = N_("nearest") if choice.runner_up is not None else N_("the only one")
    entry["advice"] = _what_to_know(row)
    return entry, table, solutions


def refused_target(robot: Robot, target: Target, reason: str) -> dict[str, Any]:
    """The summary's entry of a target for which nothing was found."""
    T = target.pose(robot)
    return {
        "name": target.name,
        "note": target.note,
        "xyz_mm": (T[:3, 3] * 1000).tolist(),
        "rpy_deg": np.degrees(rpy_of(T)).tolist(),
        "quaternion_wxyz": Rotation.from_matrix(T[:3, :3]).as_quat(canonical=True, scalar_first=True).tolist(),
        "q_ref_deg": list(target.q_ref_deg),
        "solutions": 0,
        "within_limits": 0,
        "rows_within_limits": 0,
        "collide": 0,
        "chosen_deg": None,
        "chosen_branch": None,
        "short_reason": N_("not solved"),
        "reason": reason,
        "unsolved": [],
        "method": None,
        "families": [],
        "neighbours": None,
        "advice": [],
    }


def _table(
    robot: Robot, target: Target, T: np.ndarray, solutions: Solutions, choice: Choice, refused: list[str]
) -> pd.DataFrame:
    q, count = solutions.q, len(solutions.q)
    back = forward(robot, q)
    singular = _singularities(robot, solutions)
    rank = np.zeros(count, dtype=int)
    rank[choice.order] = np.arange(1, len(choice.order) + 1)
    table = pd.DataFrame(
        {
            "target": target.name,
            "branch": solutions.branch,
            "label": list(solutions.label),
            **dict(zip(JOINT_COLUMNS, np.degrees(q).T + 0.0)),
            **dict(zip(TURN_COLUMNS, solutions.turn.reshape(-1, 6).T)),
            "within_limits": solutions.within_limits,
            "reason": list(solutions.reason),
            "beyond": [_beyond(robot, row) for row in q],
            "collision": [text if ok else "" for text, ok in zip(refused, solutions.within_limits)],
            "rank": rank,
            "first_of_branch": _first_of_branch(solutions.branch, rank),
            "position_residual_mm": np.linalg.norm(back[:, :3, 3] - T[:3, 3], axis=1) * 1000,
            "orientation_residual_deg": np.degrees(rotation_angle(back[:, :3, :3], np.tile(T[:3, :3], (count, 1, 1)))),
            "manipulability": conditioning(robot, q, characteristic_length(robot)).manipulability,
            "singular": singular,
            "limit_margin_deg": np.degrees(limit_margin(robot, q)),
            "greatest_move_deg": np.degrees(choice.greatest_move),
            "distance_deg": np.degrees(choice.distance),
        }
    )
    return table[COLUMNS].astype(
        dict.fromkeys(("target", "label", "reason", "beyond", "collision", "singular"), object)
    )


def _singularities(robot: Robot, solutions: Solutions) -> list[str]:
    """Names of the singularities that each row stands on; for arms without closed form by the Jacobian's rank."""
    if solutions.method != CLOSED_FORM:
        smallest = conditioning(robot, solutions.q, characteristic_length(robot)).smallest_singular_value
        return ["rank" if value < SINGULAR else "" for value in smallest]
    factors = determinant_factors(robot, solutions.q)
    rows = range(len(solutions.q))
    return [" ".join(kind for kind in TYPES if abs(getattr(factors, kind)[row]) < SINGULAR) for row in rows]


def _family(family: Family) -> dict[str, Any]:
    return {
        "kind": family.kind,
        "q0_deg": np.degrees(family.q0).tolist(),
        "direction": family.direction.tolist(),
        "range_deg": np.degrees(family.range).tolist(),
        "within_limits": family.within_limits,
        "branches": list(family.branches),
    }


def _beyond(robot: Robot, q: np.ndarray) -> str:
    above, below = np.degrees(q - robot.upper), np.degrees(robot.lower - q)
    out = np.flatnonzero(np.maximum(above, below) > np.degrees(LIMIT_TOLERANCE))
    parts = [
        said("J{joint} {excess:.1f} above", joint=j + 1, excess=above[j])
        if above[j] > below[j]
        else said("J{joint} {excess:.1f} below", joint=j + 1, excess=below[j])
        for j in out
    ]
    return joined(parts, ", ")


def _first_of_branch(branch: np.ndarray, rank: np.ndarray) -> np.ndarray:
    order = np.lexsort((np.arange(len(rank)), rank == 0, rank))
    first = np.zeros(len(rank), dtype=bool)
    seen: set[int] = set()
    for row in order:
        if branch[row] not in seen:
            seen.add(branch[row])
            first[row] = True
    return first


def _missing(robot: Robot, T: np.ndarray, q_ref: np.ndarray, solutions: Solutions) -> tuple[float, bool] | None:
    """By how much the pose is missed (m, or rad if True): the least over the branches; None without closed form."""
    if solutions.method != CLOSED_FORM:
        return None
    _, fault, gap = (batch[0] for batch in solve_slots(robot, T[None], q_ref[None]))
    least = int(gap.argmin())
    return float(gap[least]), bool(fault[least] == ORIENTATION)


def _short_reason(solutions: int, missing: tuple[float, bool] | None) -> str:
    if missing is None and not solutions:
        return N_("no solution found")
    if missing is None:
        return said("all {count} solutions leave the limits", count=solutions)
    amount, is_angle = missing
    if is_angle:
        return said("{angle:.3g} deg of wrist missing", angle=np.degrees(amount))
    if amount >= 0.01:
        return said("{gap:.0f} mm out of reach", gap=amount * 1000)
    return said("{gap:.2g} mm out of reach", gap=amount * 1000)


def _what_would_help(near: Neighbours) -> list[str]:
    texts = []
    if near.least_turn is not None:
        texts.append(
            said(
                "Turn the tool: {share:.2g} % of random orientations at this position have a solution within the "
                "limits, the nearest one found {angle:.1f} deg away.",
                share=100 * near.orientation_share,
                angle=np.degrees(near.least_turn),
            )
        )
    else:
        texts.append(N_("Turning the tool does not help: no orientation tried at this position has a solution."))
    if near.least_shift is not None:
        x, y, z = near.shifted_to * 1000
        texts.append(
            said(
                "Move the part or the base: with the tool's orientation kept, a shift of {shift:.0f} mm to ({x:.0f}, "
                "{y:.0f}, {z:.0f}) mm is enough.",
                shift=near.least_shift * 1000,
                x=x,
                y=y,
                z=z,
            )
        )
    else:
        texts.append(N_("Moving the part alone does not help: no position tried has a solution with this orientation."))
    return texts


def _what_to_know(row: pd.Series) -> list[str]:
    texts = []
    if "wrist" in row["singular"]:
        texts.append(
            N_(
                "Wrist singularity: axes 4 and 6 lie in one line, so J4 and J6 can be traded against one another; the "
                "pair nearest to the reference is taken. Leave this pose by a joint move, not along a straight line."
            )
        )
    if "elbow" in row["singular"]:
        texts.append(N_("Elbow singularity: the arm is stretched or folded; it can't move further along itself."))
    if "shoulder" in row["singular"]:
        texts.append(N_("Shoulder singularity: the wrist centre is on axis 1, so J1 is free while the wrist follows."))
    margin = row["limit_margin_deg"]
    if margin < LITTLE_MARGIN_DEG:
        texts.append(said("Little room: one joint is {margin:.2g} deg from its limit.", margin=margin))
    return texts


def _plain(near: Neighbours) -> dict[str, Any]:
    return {
        "orientation_share": near.orientation_share,
        "least_turn_deg": None if near.least_turn is None else float(np.degrees(near.least_turn)),
        "least_shift_mm": None if near.least_shift is None else near.least_shift * 1000,
        "shifted_to_mm": None if near.shifted_to is None else (near.shifted_to * 1000).tolist(),
    }
