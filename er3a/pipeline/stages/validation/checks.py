"""A model held against reference sets, number by number."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.pipeline.messages.language import N_, said
from er3a.references.quantities import Limit, Speed
from er3a.references.reference import GROUPS, Reference, ReferenceSet, conflicts
from er3a.references.scalars import axis_name, limit_name, speed_name

Status = Literal["pass", "fail", "no_reference", "conflict"]
ROUNDING = 1e-9
THE_MODEL = N_("the model itself")
MISSING_WORDS = {
    "zero pose": N_("zero pose"),
    "axes": N_("joint axes"),
    "key poses": N_("key poses"),
    "reach": N_("reach"),
    "envelope": N_("labels of a workspace drawing"),
    "limits": N_("joint limits"),
    "speeds": N_("joint speeds"),
}


@dataclass(frozen=True)
class Check:
    """One comparison.

    Attributes
    ----------
    status : ``conflict`` is a reference that the model misses while meeting another that contradicts it
    measured : what the model says; difference : measured - expected; both None where there is nothing to compare
    grade : None for checks of the model against itself
    """

    name: str
    group: str
    reference_set: str | None
    status: Status
    measured: float | None
    expected: float | None
    difference: float | None
    tolerance: float | None
    unit: str
    source: str
    grade: str | None
    note: str = ""

    @property
    def ratio(self) -> float:
        """How many tolerances the difference is; 0 where there is none."""
        if not self.tolerance or self.difference is None:
            return math.inf if self.difference else 0.0
        return abs(self.difference) / self.tolerance


@dataclass(frozen=True)
class Conflict:
    """References of one set about one number that no model can meet all."""

    reference_set: str
    name: str
    unit: str
    measured: float
    statements: tuple[dict, ...]


def against_itself(name: str, group: str, measured: float, tolerance: float, unit: str, note: str = "") -> Check:
    """A check that needs no document: ``measured`` should be 0."""
    status = "pass" if abs(measured) <= tolerance else "fail"
    return Check(name, group, None, status, measured, 0.0, measured, tolerance, unit, THE_MODEL, None, note)


def nothing_to_compare(name: str, group: str, unit: str, note: str, **known) -> Check:
    """A check for which there is no reference, or no value in the robot's file."""
    values = {"reference_set": None, "measured": None, "source": "", "grade": None} | known
    return Check(
        name=name, group=group, status="no_reference", expected=None, difference=None, tolerance=None, unit=unit,
        note=note, **values,
    )  # fmt: skip


def checks_of_set(references: ReferenceSet, values: np.ndarray) -> tuple[list[Check], list[Conflict]]:
    """Judge a model's values (n,) of the set's checkable references, and list what the set says nothing about."""
    stated = references.checkable
    met = [abs(value - r.expected) <= r.uncertainty + ROUNDING for r, value in zip(stated, values)]
    pairs = conflicts(stated)
    checks = [
        _check(references.name, reference, float(value), _status(i, stated, met, pairs))
        for i, (reference, value) in enumerate(zip(stated, values))
    ]
    return checks + _gaps(references), _conflicts(references.name, stated, values, met, pairs)


def _status(i: int, stated: tuple[Reference, ...], met: list[bool], pairs: list[tuple[int, int]]) -> Status:
    if met[i]:
        return "pass"
    rivals = [b if a == i else a for a, b in pairs if i in (a, b)]
    excused = any(met[k] and (stated[k].weighty or not stated[i].weighty) for k in rivals)
    return "conflict" if excused else "fail"


def _check(set_name: str, reference: Reference, value: float, status: Status) -> Check:
    if math.isnan(value):
        return nothing_to_compare(
            reference.name, reference.group, reference.unit, N_("the robot's file gives no value"),
            reference_set=set_name, source=reference.source, grade=reference.grade,
        )  # fmt: skip
    return Check(
        name=reference.name,
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
            reference.name, reference.group, reference.unit, N_("the source gives none"),
            reference_set=references.name, source=reference.source, grade=reference.grade,
        )
        for reference in references.references
        if reference.expected is None
    ]  # fmt: skip
    present = {reference.group for reference in references.references}
    note = said("{own_set} has no data", own_set=references.name)
    for group in GROUPS:
        if group not in present:
            gaps.append(nothing_to_compare(MISSING_WORDS[group], group, "", note, reference_set=references.name))
    quantities = {reference.quantity for reference in references.references}
    with_axis = {row.joint for row in references.axes}
    for joint in range(1, 7):
        if "axes" in present and joint not in with_axis:
            gaps.append(nothing_to_compare(axis_name(joint), "axes", "mm", note, reference_set=references.name))
        limits = [("limits", limit_name(joint, side), Limit(joint, side)) for side in ("lower", "upper")]
        for group, name, quantity in (*limits, ("speeds", speed_name(joint), Speed(joint))):
            if group in present and quantity not in quantities:
                gaps.append(nothing_to_compare(name, group, quantity.unit, note, reference_set=references.name))
    return gaps


def _conflicts(
    set_name: str, stated: tuple[Reference, ...], values: np.ndarray, met: list[bool], pairs: list[tuple[int, int]]
) -> list[Conflict]:
    members: dict = {}
    for pair in pairs:
        members.setdefault(stated[pair[0]].quantity, set()).update(pair)
    found = []
    for rows in members.values():
        first = stated[min(rows)]
        statements = tuple(
            {
                "expected": float(stated[i].expected),
                "tolerance": stated[i].uncertainty,
                "difference": float(values[i] - stated[i].expected),
                "met": bool(met[i]),
                "source": stated[i].source,
                "grade": stated[i].grade,
            }
            for i in sorted(rows)
        )
        found.append(Conflict(set_name, first.name, first.unit, float(values[min(rows)]), statements))
    return found
