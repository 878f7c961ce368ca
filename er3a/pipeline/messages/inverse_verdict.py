"""The inverse stage's verdict as a sentence."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.pipeline.messages.expectations import demonstrated
from er3a.pipeline.messages.say import counted, joined, listed, say, sentence
from er3a.pipeline.stages.expectations import Demonstration
from er3a.pipeline.stages.inverse.model import (
    AllSolved,
    BranchesCollide,
    BranchesLeaveLimits,
    NoneSolved,
    NothingFound,
    NotReproduced,
    ReachMissing,
    SomeUnsolved,
    TiltMissing,
    UnsolvedTarget,
)

NAMED = 3


@say.register
def _(found: NotReproduced) -> str:
    return sentence(
        found.code,
        "The solver can't be trusted here: worst residual {worst_mm:.2g} mm and {worst_deg:.2g} deg, the "
        "joint angles of {lost} random poses not found again.",
        worst_mm=found.worst_mm,
        worst_deg=found.worst_deg,
        lost=found.lost,
    )


@say.register
def _(found: AllSolved) -> str:
    if not found.targets:
        return _and_demonstrations("", found.demonstrations)
    where = _where(found.collisions)
    if not found.demonstrations:
        return sentence(found.code, "Every target ({count}) has a solution {where}.", count=found.targets, where=where)
    some = counted(
        found.code,
        "{count} of {total} targets has a solution {where}.",
        "{count} of {total} targets have a solution {where}.",
        found.targets,
        total=found.targets + len(found.demonstrations),
        where=where,
    )
    return _and_demonstrations(some, found.demonstrations)


@say.register
def _(found: NoneSolved) -> str:
    none = sentence(
        found.code,
        "No target has a solution {where}: {none_for}.",
        where=_where(found.collisions),
        none_for=_none_for(found.unsolved),
    )
    return _and_demonstrations(none, found.demonstrations)


@say.register
def _(found: SomeUnsolved) -> str:
    some = counted(
        found.code,
        "{count} of {total} targets has a solution {where}; none for {none_for}.",
        "{count} of {total} targets have a solution {where}; none for {none_for}.",
        found.solved,
        total=found.targets + len(found.demonstrations),
        where=_where(found.collisions),
        none_for=_none_for(found.unsolved),
    )
    return _and_demonstrations(some, found.demonstrations)


def _and_demonstrations(text: str, shown: tuple[Demonstration, ...]) -> str:
    told = demonstrated(shown)
    return joined([text, sentence("trajectory.verdict", "{finding}.", finding=told) if told else ""], " ")


def _where(collisions: bool) -> str:
    if collisions:
        return sentence("where", "within the limits and free of collisions")
    return sentence("where", "within the limits and free of self-collision")


def _none_for(unsolved: tuple[UnsolvedTarget, ...]) -> str:
    named = listed(unsolved[:NAMED])
    if len(unsolved) > NAMED:
        named.append(sentence("none_for", "{count} more", count=len(unsolved) - NAMED))
    return joined(named, ", ")


@say.register
def _(found: UnsolvedTarget) -> str:
    return sentence(found.code, "{own_name} ({reason})", own_name=found.name, reason=say(found.obstacle))


@say.register
def _(found: NothingFound) -> str:
    return sentence(found.code, "no solution found")


@say.register
def _(found: TiltMissing) -> str:
    return sentence(found.code, "{angle:.3g} deg beyond the wrist's range", angle=found.angle_deg)


@say.register
def _(found: ReachMissing) -> str:
    if found.gap_mm >= 10:
        return sentence(found.code, "{gap:.0f} mm out of reach", gap=found.gap_mm)
    return sentence(found.code, "{gap:.2g} mm out of reach", gap=found.gap_mm)


@say.register
def _(found: BranchesLeaveLimits) -> str:
    return counted(
        found.code,
        "the only solution is outside the limits",
        "all {count} solutions are outside the limits",
        found.count,
    )


@say.register
def _(found: BranchesCollide) -> str:
    return counted(
        found.code,
        "the only branch within the limits collides",
        "all {count} branches within the limits collide",
        found.count,
    )
