"""One comparison of the model with a reference or with itself, and references that contradict each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

from er3a.identifiability.reactions import CheckKind
from er3a.pipeline.stages.validation.validation_findings import (
    CheckSubject,
    ModelGroup,
    NearSingularLeftOut,
    Note,
    SelfCheck,
)
from er3a.references.subjects import ReferenceSubject
from er3a.robots.robot import AUTHORITATIVE_GRADES, Grade

MODEL_GROUPS: tuple[ModelGroup, ...] = get_args(ModelGroup)


@dataclass(frozen=True)
class _Compared:
    """What the model says (``measured``) beside what it should; ``difference``: measured - expected."""

    measured: float
    expected: float
    difference: float
    tolerance: float
    unit: str

    @property
    def tolerances_off(self) -> float:
        """How many tolerances the difference is."""
        return abs(self.difference) / self.tolerance


@dataclass(frozen=True)
class ModelCheck(_Compared):
    """A check of the model against itself, which needs no document."""

    subject: SelfCheck
    group: ModelGroup
    status: Literal["pass", "fail"]
    note: NearSingularLeftOut | None = None
    kind: None = None
    reference_set: None = None
    source: None = None
    grade: None = None
    is_authoritative: ClassVar[bool] = True


@dataclass(frozen=True)
class ReferenceCheck(_Compared):
    """A check against a reference; ``conflict`` is one that the model misses while meeting another that contradicts
    it.

    ``kind`` is what it rests on; ``independent_of`` names the entries that it reacts to and whose document is another,
    with nothing in common.
    """

    subject: ReferenceSubject
    group: str
    status: Literal["pass", "fail", "conflict"]
    reference_set: str
    source: str
    grade: Grade
    kind: CheckKind
    independent_of: tuple[str, ...]
    note: None = None

    @property
    def is_authoritative(self) -> bool:
        """Whether the verdict may rest on it."""
        return self.grade in AUTHORITATIVE_GRADES


@dataclass(frozen=True)
class Unjudged:
    """What could be checked, had the sources, or the robot's file, a value."""

    subject: CheckSubject
    group: str
    unit: str
    note: Note
    status: Literal["no_reference"] = "no_reference"
    reference_set: str | None = None
    measured: float | None = None
    source: str | None = None
    grade: Grade | None = None
    expected: None = None
    difference: None = None
    tolerance: None = None
    kind: None = None

    @property
    def is_authoritative(self) -> bool:
        """Whether the verdict could rest on it."""
        return self.grade in AUTHORITATIVE_GRADES or self.group in MODEL_GROUPS


Check = ModelCheck | ReferenceCheck | Unjudged


@dataclass(frozen=True)
class Statement:
    """What one source says about a number that others contradict it about."""

    expected: float
    tolerance: float
    difference: float
    met: bool
    source: str
    grade: Grade


@dataclass(frozen=True)
class Conflict:
    """References of one set about one number that no model can meet all."""

    reference_set: str
    subject: ReferenceSubject
    unit: str
    measured: float
    statements: tuple[Statement, ...]
