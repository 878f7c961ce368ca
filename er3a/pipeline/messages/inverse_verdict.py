"""The inverse stage's verdict as a sentence."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.pipeline.messages.expectations import demonstrated
from er3a.pipeline.messages.say import Plural, joined, listed, say, say_as, sentence, texts
from er3a.pipeline.stages.expectations import Demonstration
from er3a.pipeline.stages.inverse.model import (
    AllSolved,
    NoneSolved,
    ReachMissing,
    SomeUnsolved,
    UnsolvedTarget,
)

NAMED = 3


TEXTS = texts(
    {
        "inverse.not_reproduced": (
            "The solver can't be trusted here: worst residual {worst_mm:.2g} mm and {worst_deg:.2g} deg, the joint "
            "angles of {lost} random poses not found again."
        ),
        "unsolved_target": "{name} ({obstacle})",
        "nothing_found": "no solution found",
        "tilt_missing": "{angle_deg:.3g} deg beyond the wrist's range",
        "branches_leave_limits": Plural(
            "count", "the only solution is outside the limits", "all {count} solutions are outside the limits"
        ),
        "branches_collide": Plural(
            "count", "the only branch within the limits collides", "all {count} branches within the limits collide"
        ),
        "inverse.all_solved#some": Plural(
            "targets",
            "{count} of {total} targets has a solution {where}.",
            "{count} of {total} targets have a solution {where}.",
        ),
        "inverse.all_solved#every": "Every target ({targets}) has a solution {where}.",
        "inverse.none_solved": "No target has a solution {where}: {none_for}.",
        "inverse.some_unsolved": Plural(
            "solved",
            "{count} of {total} targets has a solution {where}; none for {none_for}.",
            "{count} of {total} targets have a solution {where}; none for {none_for}.",
        ),
        "where#itself": "within the limits and free of self-collision",
        "where#scene": "within the limits and free of collisions",
        "reach_missing#near": "{gap_mm:.2g} mm out of reach",
        "reach_missing#far": "{gap_mm:.0f} mm out of reach",
    }
)


@say.register
def _(found: AllSolved) -> str:
    if not found.targets:
        return _and_demonstrations("", found.demonstrations)
    where = _where(found.collisions)
    if not found.demonstrations:
        return say_as(found, "every", where=where)
    some = say_as(found, "some", total=found.targets + len(found.demonstrations), where=where)
    return _and_demonstrations(some, found.demonstrations)


@say.register
def _(found: NoneSolved) -> str:
    none = say_as(found, where=_where(found.collisions), none_for=_none_for(found.unsolved))
    return _and_demonstrations(none, found.demonstrations)


@say.register
def _(found: SomeUnsolved) -> str:
    some = say_as(
        found,
        total=found.targets + len(found.demonstrations),
        where=_where(found.collisions),
        none_for=_none_for(found.unsolved),
    )
    return _and_demonstrations(some, found.demonstrations)


def _and_demonstrations(text: str, shown: tuple[Demonstration, ...]) -> str:
    told = demonstrated(shown)
    return joined([text, sentence("finding", finding=told) if told else ""], " ")


def _where(collisions: bool) -> str:
    if collisions:
        return sentence("where#scene")
    return sentence("where#itself")


def _none_for(unsolved: tuple[UnsolvedTarget, ...]) -> str:
    named = listed(unsolved[:NAMED])
    if len(unsolved) > NAMED:
        named.append(sentence("more", count=len(unsolved) - NAMED))
    return joined(named, ", ")


@say.register
def _(found: ReachMissing) -> str:
    if found.gap_mm >= 10:
        return say_as(found, "far")
    return say_as(found, "near")
