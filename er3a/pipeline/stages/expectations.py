"""Expected against actual outcomes of targets, paths, programs and objects: findings of stages."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

from er3a.finding import Finding, fact
from er3a.kinematics.solutions import TargetOutcome
from er3a.pipeline.results import Status
from er3a.planning.names import PathVerdict
from er3a.programs.program_names import ProgramOutcome
from er3a.vision.vision_findings import GraspOutcome

Outcome = TargetOutcome | PathVerdict | ProgramOutcome | GraspOutcome


Judged = Any
"""A target, a path or an object with ``name``, ``outcome`` (what it came to, the gravest of ``outcomes`` if it has
several) and ``expect`` (what its file says that it is to come to: None, one or several)."""


def came_to(judged: Judged) -> tuple[Outcome, ...]:
    """All that one came to.

    Parameters
    ----------
    judged : of kinds with a single outcome, that one

    Returns
    -------
    outcomes : the first first
    """
    found: tuple[Outcome, ...] = getattr(judged, "outcomes", (judged.outcome,))
    return found


def expected_of(judged: Judged) -> tuple[Outcome, ...]:
    """All that one is said to come to.

    Parameters
    ----------
    judged : with one expectation, several or none

    Returns
    -------
    outcomes : empty where its file says nothing
    """
    expect = judged.expect
    return expect if isinstance(expect, tuple) else () if expect is None else (expect,)


def is_met(judged: Judged) -> bool:
    """Whether one came to what its file expects, to nothing less and to nothing more.

    Parameters
    ----------
    judged : one without expectation has no outcome to meet, so it is not met

    Returns
    -------
    met : the order of outcomes does not count
    """
    return set(expected_of(judged)) == set(came_to(judged))


def unmet_expectations(judged: Iterable[Judged], sound: Outcome | None = None) -> Finding | None:
    """The expectations that are not met.

    Parameters
    ----------
    judged : all of a stage
    sound : the outcome that is no fault; others without expectation are named too. None names none of these.

    Returns
    -------
    finding : None if all expectations are met
    """
    all_judged = list(judged)
    expected = [each for each in all_judged if expected_of(each)]
    unmet = tuple(
        fact("unmet_expectation", name=each.name, expected=expected_of(each), found=came_to(each))
        for each in expected
        if not is_met(each)
    )
    rest = [each for each in all_judged if not expected_of(each)]
    others = tuple(
        fact("demonstration", name=each.name, found=came_to(each)) for each in rest if sound and each.outcome != sound
    )
    if not unmet:
        return None
    return fact("expectations_unmet", count=len(unmet), expectations=len(expected), unmet=unmet, others=others)


def pass_of(asked: Collection[Judged]) -> Status:
    """The status of a stage that found no fault in what is to be sound.

    Parameters
    ----------
    asked : what is to be sound

    Returns
    -------
    status : ``no_reference`` where there are demonstrations alone
    """
    return "pass" if asked else "no_reference"


def demonstrations(judged: Iterable[Judged], sound: Outcome) -> tuple[Finding, ...]:
    """What fails as it is meant to.

    Parameters
    ----------
    judged : all of a stage
    sound : the outcome that counts as no failure

    Returns
    -------
    found : with all that each came to
    """
    return tuple(
        fact("demonstration", name=each.name, found=came_to(each))
        for each in judged
        if is_met(each) and each.outcome != sound
    )
