"""A model held against reference sets, number by number."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er3a.pipeline.stages.validation.findings import (
    CheckSubject,
    Note,
    NotInRobotFile,
    SelfCheck,
    SelfChecked,
    SetHasNoData,
    SourceGivesNone,
    WholeGroup,
)
from er3a.pipeline.stages.validation.model import (
    Check,
    CheckStatus,
    Conflict,
    ModelGroup,
    Statement,
)
from er3a.references.quantities import Limit, Quantity, Speed
from er3a.references.reference import Reference, ReferenceSet, conflicts
from er3a.references.rows import GROUPS, AxisRow
from er3a.references.subjects import AxisPosition, JointLimit, JointSpeed

ROUNDING = 1e-9


def against_itself(
    quantity: SelfChecked,
    group: ModelGroup,
    measured: float,
    tolerance: float,
    unit: str = "",
    note: Note | None = None,
) -> Check:
    """A check that needs no document: ``measured`` should be 0."""
    status: CheckStatus = "pass" if abs(measured) <= tolerance else "fail"
    return Check(SelfCheck(quantity), group, None, status, measured, 0.0, measured, tolerance, unit, None, None, note)


def nothing_to_compare(subject: CheckSubject, group: str, unit: str, note: Note, **known: Any) -> Check:
    """A check for which there is no reference, or no value in the robot's file."""
    values = {"reference_set": None, "measured": None, "source": None, "grade": None} | known
    return Check(
        subject=subject, group=group, status="no_reference", expected=None, difference=None, tolerance=None, unit=unit,
        note=note, **values,
    )  # fmt: skip


def checks_of_set(references: ReferenceSet, values: NDArray[np.float64]) -> tuple[list[Check], list[Conflict]]:
    """Judge a model's values (n,) of the set's checkable references, and list what the set says nothing about."""
    stated = references.checkable
    met = [abs(value - r.expected) <= r.uncertainty + ROUNDING for r, value in zip(stated, values)]
    pairs = conflicts(stated)
    checks = [
        _check(references.name, reference, float(value), _status(i, stated, met, pairs))
        for i, (reference, value) in enumerate(zip(stated, values))
    ]
    return checks + _gaps(references), _conflicts(references.name, stated, values, met, pairs)


def _status(i: int, stated: tuple[Reference, ...], met: list[bool], pairs: list[tuple[int, int]]) -> CheckStatus:
    if met[i]:
        return "pass"
    rivals = [b if a == i else a for a, b in pairs if i in (a, b)]
    excused = any(met[k] and (stated[k].authoritative or not stated[i].authoritative) for k in rivals)
    return "conflict" if excused else "fail"


def _check(set_name: str, reference: Reference, value: float, status: CheckStatus) -> Check:
    if math.isnan(value):
        return nothing_to_compare(
            reference.subject, reference.group, reference.unit, NotInRobotFile(),
            reference_set=set_name, source=reference.source, grade=reference.grade,
        )  # fmt: skip
    return Check(
        subject=reference.subject,
        group=reference.group,
        reference_set=set_name,
        status=status,
        measured=value,
        expected=float(reference.expected),
        difference=value - float(reference.expected),
        tolerance=reference.uncertainty,
        unit=reference.unit,
        source=reference.source,
        grade=reference.grade,
    )


def _gaps(references: ReferenceSet) -> list[Check]:
    gaps = [
        nothing_to_compare(
            reference.subject, reference.group, reference.unit, SourceGivesNone(),
            reference_set=references.name, source=reference.source, grade=reference.grade,
        )
        for reference in references.references
        if reference.expected is None
    ]  # fmt: skip
    present = {reference.group for reference in references.references}
    note = SetHasNoData(references.name)
    for group in GROUPS:
        if group not in present:
            gaps.append(nothing_to_compare(WholeGroup(group), group, "", note, reference_set=references.name))
    quantities = {reference.quantity for reference in references.references}
    with_axis = {row.joint for row in references.of(AxisRow)}
    for joint in range(1, 7):
        if "axes" in present and joint not in with_axis:
            subject = AxisPosition(joint, None)
            gaps.append(nothing_to_compare(subject, "axes", "mm", note, reference_set=references.name))
        limits = [("limits", JointLimit(joint, side), Limit(joint, side)) for side in ("lower", "upper")]
        for group, subject, quantity in (*limits, ("speeds", JointSpeed(joint), Speed(joint))):
            if group in present and quantity not in quantities:
                gaps.append(nothing_to_compare(subject, group, quantity.unit, note, reference_set=references.name))
    return gaps


def _conflicts(
    set_name: str,
    stated: tuple[Reference, ...],
    values: NDArray[np.float64],
    met: list[bool],
    pairs: list[tuple[int, int]],
) -> list[Conflict]:
    members: dict[Quantity, set[int]] = {}
    for pair in pairs:
        members.setdefault(stated[pair[0]].quantity, set()).update(pair)
    found = []
    for rows in members.values():
        first = stated[min(rows)]
        statements = tuple(
            Statement(
                expected=float(stated[i].expected),
                tolerance=stated[i].uncertainty,
                difference=float(values[i] - stated[i].expected),
                met=bool(met[i]),
                source=stated[i].source,
                grade=stated[i].grade,
            )
            for i in sorted(rows)
        )
        found.append(Conflict(set_name, first.subject, first.unit, float(values[min(rows)]), statements))
    return found
