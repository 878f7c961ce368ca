"""The cheapest measurement that would settle an entry: by eye before a ruler, a ruler before a tracker.

A direction is settled by jogging the joint and looking; the pose is chosen so that the answer does not depend on other
open entries. A length or an angle is measured directly, as finely as its tolerance requires.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import cast

import numpy as np

from er3a.comparison.entries import LENGTHS, Entry, shifted
from er3a.diagnosis.faults import SIDES
from er3a.diagnosis.fitting import ANGLES
from er3a.finding import Finding, fact
from er3a.identifiability.entries import entries_of
from er3a.identifiability.entry_evidence import EntryEvidence, Evidence
from er3a.identifiability.statements import ToolRange
from er3a.kinematics.table_batch import Tables, join, tables_of
from er3a.numerics.arrays import Reals
from er3a.references.predict import predict_tables
from er3a.references.quantities import FRAME_OF_POINT, Point, Pose
from er3a.references.seen import SEEN, Manner, SeenMotion
from er3a.robots.robot import Robot

PLAIN_DEG = 50.0  # of the direction that is named, within which a motion is plain to see
BENT_DEG = 45.0
LENGTH_MM, ANGLE_DEG, LIMIT_DEG, SPEED_SHARE = 1.0, 0.5, 0.5, 0.02
SHARE_OF_TOLERANCE = 0.4
SETTLED = ("settled", "settled_up_to_signs", "given", "gauge", "contradicted")
OBSERVATIONS: tuple[tuple[Point, Manner], ...] = (
    ("flange", "tilts"),
    ("flange", "moves"),
    ("wrist_centre", "moves"),
    ("flange", "turns"),
)


def proposals_of(evidence: Evidence) -> dict[str, Finding]:
    """For each entry that isn't settled, the cheapest measurement that would settle it.

    Parameters
    ----------
    evidence : of all entries

    Returns
    -------
    proposals : by the entry's name; entries that no single measurement of these kinds settles are left out
    """
    robot = evidence.robot
    tool = ToolRange(robot, tables_of(robot))
    by_name = {entry.name: entry for entry in entries_of(robot)}
    found: dict[str, Finding] = {}
    for each in (*evidence.entries, *evidence.combinations):
        if each.status in SETTLED:
            continue
        entry = by_name.get(each.entry) or by_name[each.entry.split()[0].lstrip("-")]
        if proposal := _proposal(evidence, each, entry, tool):
            found[each.entry] = proposal
    return found


def _proposal(evidence: Evidence, each: EntryEvidence, entry: Entry, tool: ToolRange) -> Finding | None:
    name, j = each.entry, entry.joint
    if entry.column == "direction":
        return _look(evidence, entry)
    if entry.column in SIDES:
        return fact("read_limit", entry=name, joint=j, side=entry.column, half_width_deg=LIMIT_DEG)
    if entry.column == "speed":
        return fact(
            "time_joint", entry=name, joint=j, half_width_deg_s=round(SPEED_SHARE * entry.value(evidence.robot), 3)
        )
    if entry.column in LENGTHS:
        return fact(
            "measure_length",
            entry=name,
            column=entry.column,
            joint=j,
            half_width_mm=min(LENGTH_MM, SHARE_OF_TOLERANCE * evidence.tolerance.mm),
        )
    if entry.column in ANGLES:
        return fact(
            "measure_angle",
            entry=name,
            column=entry.column,
            joint=j,
            half_width_deg=_fine_enough(evidence, entry, tool),
        )
    return None


def _fine_enough(evidence: Evidence, entry: Entry, tool: ToolRange) -> float:
    """Half-width in deg with which the tool stays within the tolerance, as a round number."""
    one_degree = tool.off(shifted(tool.table, [entry], np.array([[np.radians(1.0)]])))
    most = min(ANGLE_DEG, evidence.tolerance.deg)
    if one_degree.mm > 0:
        most = min(most, evidence.tolerance.mm / one_degree.mm)
    exact = SHARE_OF_TOLERANCE * most
    digit = 10.0 ** np.floor(np.log10(exact))
    return float(round(np.floor(exact / digit + 1e-9) * digit, 9))


def _look(evidence: Evidence, entry: Entry) -> Finding | None:
    """What to look at to determine a joint's direction, independent of other open entries."""
    others = [each.table for each in evidence.allowed if entry.name not in each.names]
    own = [each.table for each in evidence.readings if entry.name in each.names]
    return look_at(evidence.robot, entry.joint, others, own)


def look_at(
    robot: Robot, joint: int, others: Sequence[Tables] = (), reversed_: Sequence[Tables] = ()
) -> Finding | None:
    """What to look at to determine a joint's direction.

    Parameters
    ----------
    joint : from 1 on
    others : tables that may be right as well, with the same direction
    reversed_ : those with the other one, as which the motion must be seen in the other sense

    Returns
    -------
    look : ``look_at_motion``; None where no pose shows it
    """
    tables, unaffected = join([tables_of(robot), *others, *reversed_]), len(others) + 1
    for pose in _poses(robot):
        for point, manner in OBSERVATIONS:
            if FRAME_OF_POINT[point] > robot.rows:
                continue
            motions = [SeenMotion(pose, joint, point, seen) for seen in SEEN]
            motions = [motion for motion in motions if motion.manner == manner]
            values = predict_tables(tables, robot, motions)
            best = int(np.argmin(values[0]))
            plain = values[:unaffected, best].max() < PLAIN_DEG
            turned = (values[unaffected:, best] > 180.0 - PLAIN_DEG).all()
            if plain and turned:
                return fact(
                    "look_at_motion",
                    entry=f"direction{joint}",
                    joint=joint,
                    point=point,
                    pose_deg=pose,
                    seen=motions[best].seen,
                )
    return None


def _poses(robot: Robot) -> Iterator[Pose]:
    """Poses to look from: the zero pose, then one joint bent, within the limits."""
    lower, upper = np.degrees(robot.lower), np.degrees(robot.upper)
    zero = np.clip(np.zeros(len(lower)), lower, upper)
    yield _pose(zero)
    for joint in range(len(lower)):
        for bend in (BENT_DEG, -BENT_DEG):
            bent: Reals = zero.copy()
            bent[joint] = np.clip(bend, lower[joint], upper[joint])
            yield _pose(bent)


def _pose(angles: Sequence[float] | Reals) -> Pose:
    return cast(Pose, tuple(float(angle) for angle in angles))
