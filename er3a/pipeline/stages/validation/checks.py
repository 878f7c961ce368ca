"""A model held against reference sets, number by number."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Literal

import numpy as np

from er3a.identifiability.reactions import CheckBasis
from er3a.kinematics.round_trips import (
    MOST_BY_CLASS,
    NEAR_ELBOW_DEG,
    NEAR_SHOULDER_MM,
    NEAR_WRIST_DEG,
    batch_round_trips,
    has_class,
    slot_round_trips,
)
from er3a.kinematics.wrist_partitioned import closed_form_missing
from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.stages.validation.model import (
    Check,
    Conflict,
    Margins,
    ModelCheck,
    ModelGroup,
    NearSingularLeftOut,
    NoClosedForm,
    Note,
    NotInRobotFile,
    NotOfThisArm,
    NumbersMissing,
    ReferenceCheck,
    RoundTripErrors,
    SelfCheck,
    SelfChecked,
    SetHasNoData,
    SourceGivesNone,
    Statement,
    Unjudged,
    WholeGroup,
)
from er3a.references.quantities import Limit, Quantity, Speed
from er3a.references.reference import Reference, ReferenceSet, conflicts, expected_of
from er3a.references.rows import GROUPS, AxisRow
from er3a.references.subjects import AxisPosition, JointLimit, JointSpeed, ReferenceSubject
from er3a.robots.robot import Robot

ROUNDING = 1e-9
SIX_TURN = (False,) * 6


def against_itself(
    quantity: SelfChecked,
    group: ModelGroup,
    measured: float,
    tolerance: float,
    unit: str = "",
    note: NearSingularLeftOut | None = None,
) -> ModelCheck:
    """A check that needs no document: ``measured`` should be 0."""
    status: Literal["pass", "fail"] = "pass" if abs(measured) <= tolerance else "fail"
    return ModelCheck(measured, 0.0, measured, tolerance, unit, SelfCheck(quantity), group, status, note)


def checks_of_set(
    references: ReferenceSet, values: Reals, bases: Sequence[CheckBasis], slides: Sequence[bool] | Flags = SIX_TURN
) -> tuple[list[Check], list[Conflict]]:
    """Judge a model's values (n,) of the set's checkable references, and list what was set aside and what the set says
    nothing about.

    ``bases`` (n,): what each of these checks rests on; ``slides`` : of each joint of the arm.
    """
    stated = _Stated(references.name, references.checkable, values, bases)
    checks = [stated.check(i) for i in range(len(values))]
    aside = [
        _without_value(references.name, reference, NotOfThisArm(why, len(slides)))
        for row, why in references.set_aside
        for reference in row.references()
    ]
    return [*checks, *aside, *_gaps(references, slides)], stated.conflicts()


class _Stated:
    """Checkable references of a set beside a model's values (n,).

    Attributes
    ----------
    met : (n,), which of them the model meets
    pairs : references that no model can meet both of
    """

    def __init__(self, set_name: str, references: tuple[Reference, ...], values: Reals, bases: Sequence[CheckBasis]):
        self.set_name, self.references, self.values, self.bases = set_name, references, values, bases
        self.expected, self.tolerance = expected_of(references)
        self.met = np.abs(values - self.expected) <= self.tolerance + ROUNDING
        self.pairs = conflicts(references)

    def check(self, i: int) -> Check:
        """The check of a reference; not judged where the robot's file gives no value."""
        reference, value, expected = self.references[i], float(self.values[i]), float(self.expected[i])
        if math.isnan(value):
            return _without_value(self.set_name, reference, NotInRobotFile())
        return ReferenceCheck(
            measured=value,
            expected=expected,
            difference=value - expected,
            tolerance=reference.uncertainty,
            unit=reference.unit,
            subject=reference.subject,
            group=reference.group,
            status=self._status(i),
            reference_set=self.set_name,
            source=reference.source,
            grade=reference.grade,
            kind=self.bases[i].kind,
            independent_of=self.bases[i].independent_of,
        )

    def conflicts(self) -> list[Conflict]:
        """What the references contradict each other about."""
        members: dict[Quantity, set[int]] = {}
        for pair in self.pairs:
            members.setdefault(self.references[pair[0]].quantity, set()).update(pair)
        return [self._conflict(sorted(rows)) for rows in members.values()]

    def _conflict(self, rows: list[int]) -> Conflict:
        first = self.references[rows[0]]
        statements = tuple(
            Statement(
                expected=float(self.expected[i]),
                tolerance=self.references[i].uncertainty,
                difference=float(self.values[i] - self.expected[i]),
                met=bool(self.met[i]),
                source=self.references[i].source,
                grade=self.references[i].grade,
            )
            for i in rows
        )
        return Conflict(self.set_name, first.subject, first.unit, float(self.values[rows[0]]), statements)

    def _status(self, i: int) -> Literal["pass", "fail", "conflict"]:
        if self.met[i]:
            return "pass"
        rivals = [b if a == i else a for a, b in self.pairs if i in (a, b)]
        weak = not self.references[i].authoritative
        excused = any(self.met[k] and (weak or self.references[k].authoritative) for k in rivals)
        return "conflict" if excused else "fail"


def _without_value(set_name: str, reference: Reference, note: Note) -> Unjudged:
    return Unjudged(
        reference.subject,
        reference.group,
        reference.unit,
        note,
        reference_set=set_name,
        source=reference.source,
        grade=reference.grade,
    )


def _gaps(references: ReferenceSet, slides: Sequence[bool] | Flags) -> list[Unjudged]:
    """What the set says nothing about."""
    name, note = references.name, SetHasNoData(references.name)
    stated = {reference.quantity for reference in references.checkable}
    gaps = [
        _without_value(name, reference, SourceGivesNone())
        for reference in references.references
        if reference.expected is None and reference.quantity not in stated
    ]
    present = {reference.group for reference in references.references}
    gaps += [
        Unjudged(WholeGroup(group), group, "", note, reference_set=name) for group in GROUPS if group not in present
    ]
    subjects = {each.subject for each in references.references}
    subjects |= {each.subject for row, _ in references.set_aside for each in row.references()}
    with_axis = {row.joint for row in references.of(AxisRow)}
    for joint in range(1, len(slides) + 1):
        if "axes" in present and joint not in with_axis:
            gaps.append(Unjudged(AxisPosition(joint, None), "axes", "mm", note, reference_set=name))
        wanted: list[tuple[str, ReferenceSubject]] = [
            ("limits", JointLimit(joint, "lower")),
            ("limits", JointLimit(joint, "upper")),
            ("speeds", JointSpeed(joint)),
        ]
        units = ("mm", "mm/s") if slides[joint - 1] else (Limit.unit, Speed.unit)
        gaps += [
            Unjudged(subject, group, units[group == "speeds"], note, reference_set=name)
            for group, subject in wanted
            if group in present and subject not in subjects
        ]
    return gaps


JOINT_TOLERANCE_DEG = 1e-6
POSITION_TOLERANCE_MM = 1e-6
ORIENTATION_TOLERANCE_DEG = 1e-6
SHORTEST, LONGEST = 0.01, 20.0  # m
WIDEST_IN_RADIANS = 2.01 * np.pi
GROUP: Literal["round_trips"] = "round_trips"


def table_checks(robot: Robot) -> list[Check]:
    """Checks of the table alone: sound numbers in plausible units, and whether a closed-form inverse applies to it."""
    parts = [robot.a, robot.alpha, robot.d, robot.offset, robot.lower, robot.upper, robot.base]
    limits = np.abs([robot.lower, robot.upper])
    lengths = np.concatenate([np.abs([robot.a, robot.d]).ravel(), limits[:, robot.slides].ravel()])
    turning = limits[:, ~robot.slides & ~robot.continuous]
    faults: dict[SelfChecked, int] = {
        "numbers_not_finite": sum(int((~np.isfinite(part)).sum()) for part in parts),
        "crossed_limits": int((robot.lower > robot.upper).sum()),
        "odd_directions": int((np.abs(robot.direction) != 1).sum()),
        "length_unit": int(not SHORTEST <= np.nanmax(lengths) <= LONGEST),
        "limit_unit": int(turning.shape[1] > 1 and 0 < np.degrees(np.nanmax(turning)) < WIDEST_IN_RADIANS),
    }
    checks = [against_itself(name, "table_sanity", float(count), 0.5) for name, count in faults.items()]
    missing = NumbersMissing() if checks[0].status == "fail" else closed_form_missing(robot)
    if missing:
        return [*checks, Unjudged(SelfCheck("closed_form"), "table_sanity", "", missing)]
    return [*checks, against_itself("closed_form", "table_sanity", 0.0, 0.5)]


def _class_checks(robot: Robot, poses: int, seed: int) -> list[Check]:
    """Round trips of an arm without the closed form of spherical wrists, by its class."""
    missing = closed_form_missing(robot)
    if missing and not has_class(robot):
        return [Unjudged(SelfCheck("joints_to_pose_to_joints"), GROUP, "deg", NoClosedForm(missing))]
    found = batch_round_trips(robot, np.random.default_rng(seed), poses)
    return [
        against_itself("unsolved_poses", GROUP, float(found.poses - found.own_found), 0.5),
        against_itself("position_error", GROUP, found.worst_position * 1000, POSITION_TOLERANCE_MM, "mm"),
        against_itself(
            "orientation_error", GROUP, float(np.degrees(found.worst_orientation)), ORIENTATION_TOLERANCE_DEG, "deg"
        ),
    ]


def round_trip_checks(robot: Robot, poses: int, seed: int) -> tuple[list[Check], RoundTripErrors | None]:
    """Round trips as checks, and their errors; None if the arm has no closed form."""
    missing = closed_form_missing(robot)
    if missing or robot.coupling is not None:
        return _class_checks(robot, min(poses, MOST_BY_CLASS), seed), None
    found = slot_round_trips(robot, poses, seed)
    note = NearSingularLeftOut(poses - found.near_singular, poses, NEAR_WRIST_DEG, NEAR_SHOULDER_MM)
    checks: list[Check] = [
        against_itself("unsolved_poses", GROUP, float(found.unsolved), 0.5),
        against_itself("joint_error", GROUP, found.joint_error_deg, JOINT_TOLERANCE_DEG, "deg", note),
        against_itself("position_error", GROUP, found.position_error_mm, POSITION_TOLERANCE_MM, "mm"),
        against_itself("orientation_error", GROUP, found.orientation_error_deg, ORIENTATION_TOLERANCE_DEG, "deg"),
    ]
    margins = Margins(NEAR_WRIST_DEG, NEAR_ELBOW_DEG, NEAR_SHOULDER_MM)
    return checks, RoundTripErrors(**asdict(found), margins=margins)
