"""Expected against actual outcomes of targets, paths, programs and objects: findings of stages."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from typing import Protocol, TypeVar

from er3a.by_value import Finding
from er3a.kinematics.solutions import TargetOutcome
from er3a.pipeline.results import Status
from er3a.planning.names import PathVerdict
from er3a.programs.syntax import ProgramOutcome
from er3a.vision.vision_findings import GraspOutcome

Outcome = TargetOutcome | PathVerdict | ProgramOutcome | GraspOutcome


class UnmetExpectation(Finding):
    """Something came to another end than the file expects."""

    name: str
    expected: Outcome
    found: Outcome


class Demonstration(Finding):
    """A target, a path or an object that fails as it is meant to: all that it came to, the first first."""

    name: str
    found: tuple[Outcome, ...]


class ExpectationsUnmet(Finding):
    """Of so many expectations these are not met."""

    expectations: int
    unmet: tuple[UnmetExpectation, ...]


class Judged(Protocol):
    """A target, a path or an object with what it came to, and what it is said to come to."""

    @property
    def name(self) -> str: ...

    @property
    def expect(self) -> Outcome | None: ...

    @property
    def outcome(self) -> Outcome: ...


def unmet_expectations(judged: Iterable[Judged]) -> ExpectationsUnmet | None:
    """The expectations that are not met; None if all are."""
    expected = [(each, each.expect) for each in judged if each.expect is not None]
    unmet = tuple(
        UnmetExpectation(each.name, expect, each.outcome) for each, expect in expected if expect != each.outcome
    )
    return ExpectationsUnmet(len(expected), unmet) if unmet else None


def pass_of(asked: Collection[Judged]) -> Status:
    """What a stage comes to whose ``asked`` are all sound: no pass where there are demonstrations alone."""
    return "pass" if asked else "no_reference"


JudgedT = TypeVar("JudgedT", bound=Judged)


def demonstrations(
    judged: Iterable[JudgedT],
    sound: Outcome,
    outcomes: Callable[[JudgedT], tuple[Outcome, ...]] = lambda each: (each.outcome,),
) -> tuple[Demonstration, ...]:
    """What fails as it is meant to; ``sound``: what counts as no failure; ``outcomes``: all that one came to."""
    return tuple(Demonstration(each.name, outcomes(each)) for each in judged if each.expect == each.outcome != sound)
