"""A model held against reference sets, number by number."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from er3a.identifiability.reactions import CheckBasis
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.validation.check_model import Check, Conflict, ModelCheck, ReferenceCheck, Statement, Unjudged
from er3a.pipeline.stages.validation.validation_findings import (
    ModelGroup,
    NearSingularLeftOut,
    Note,
    NotInRobotFile,
    SelfCheck,
    SelfChecked,
    SetHasNoData,
    SourceGivesNone,
    WholeGroup,
)
from er3a.references.quantities import Limit, Quantity, Speed
from er3a.references.reference import Reference, ReferenceSet, conflicts, expected_of
from er3a.references.rows import GROUPS, AxisRow
from er3a.references.subjects import AxisPosition, JointLimit, JointSpeed, ReferenceSubject

ROUNDING = 1e-9


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
    references: ReferenceSet, values: Reals, bases: Sequence[CheckBasis], joints: int = 6
) -> tuple[list[Check], list[Conflict]]:
    """Judge a model's values (n,) of the set's checkable references, and list what the set says nothing about.

    ``bases`` (n,): what each of these checks rests on; ``joints`` : of the arm.
    """
    stated = _Stated(references.name, references.checkable, values, bases)
    checks = [stated.check(i) for i in range(len(values))]
    return [*checks, *_gaps(references, joints)], stated.conflicts()


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


def _gaps(references: ReferenceSet, joints: int) -> list[Unjudged]:
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
    quantities = {reference.quantity for reference in references.references}
    with_axis = {row.joint for row in references.of(AxisRow)}
    for joint in range(1, joints + 1):
        if "axes" in present and joint not in with_axis:
            gaps.append(Unjudged(AxisPosition(joint, None), "axes", "mm", note, reference_set=name))
        wanted: list[tuple[str, ReferenceSubject, Quantity]] = [
            ("limits", JointLimit(joint, "lower"), Limit(joint, "lower")),
            ("limits", JointLimit(joint, "upper"), Limit(joint, "upper")),
            ("speeds", JointSpeed(joint), Speed(joint)),
        ]
        gaps += [
            Unjudged(subject, group, quantity.unit, note, reference_set=name)
            for group, subject, quantity in wanted
            if group in present and quantity not in quantities
        ]
    return gaps
