"""The paths as page and recording play them: singular poses, faults, and what touches what."""

from __future__ import annotations

from typing import Any

from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.trajectory import advice, cause_text, event_word, path_text
from er3a.pipeline.player.motions import Mark, PlayedEvent, PlayedMotion, Weight
from er3a.pipeline.stages.trajectory.model import BodiesOverlap, PathSummary, Singularity, Stretch, TrajectoryResults
from er3a.planning.names import PathVerdict
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

WEIGHTS: dict[PathVerdict, Weight] = {
    "safe": "plain",
    "near-singular": "caution",
    "singular": "caution",
    "too fast for the assumed limits": "caution",
    "undecided": "caution",
    "too fast": "fail",
    "leaves limits": "fail",
    "collides": "fail",
    "unreachable": "fail",
    "none found": "fail",
}


def motions(robot: Robot, results: TrajectoryResults) -> list[PlayedMotion]:
    """The paths as programmed, as far as the arm reaches them, each followed by the motion that repairs it."""
    checks, avoidance, motions = results.checks, results.avoidance, []
    for path in results.summary.paths:
        rows = checks.take((checks.path == path.name) & checks.reachable)
        motions.append(
            PlayedMotion(path.name, path_text(path), rows.t_s, meant(robot, rows.q_deg), events(path), contact(path))
        )
        if path.chosen:
            repair = avoidance.take((avoidance.path == path.name) & (avoidance.strategy == path.strategy))
            name = tr("{path}, repaired", path=path.name)
            motions.append(PlayedMotion(name, advice(path) or "", repair.t_s, meant(robot, repair.q_deg)))
    return motions


def events(path: PathSummary) -> list[PlayedEvent]:
    """Singular poses and faults of a path."""
    passes = [PlayedEvent(e.t_s, e.until_s, _singular(e), "caution") for e in path.singularities]
    faults = [(word, stretch) for word, stretches in kinds(path) for stretch in stretches]
    return passes + [
        PlayedEvent(s.t0_s, s.t1_s, f"{word}: {cause_text(path, s)}", "fail", _touching(s.cause)) for word, s in faults
    ]


def contact(path: PathSummary) -> list[Mark]:
    """Where bodies first touch, while they do."""
    if path.clear_until is None:
        return []
    x, y, z = (value / 1000 for value in path.clear_until.contact_mm)
    return [Mark(part.t0_s, part.t1_s, (x, y, z), (x, y, z), tr("first contact")) for part in path.collisions[:1]]


def _touching(cause: object) -> tuple[str, ...]:
    pairs = cause.pairs if isinstance(cause, BodiesOverlap) else ()
    return tuple(dict.fromkeys(name for pair in pairs for name in pair.names))


def _singular(event: Singularity) -> str:
    word = event_word(event)
    return tr("singular: {type}", type=word) if event.crossing else tr("near-singular: {type}", type=word)


def kinds(path: PathSummary) -> tuple[tuple[str, tuple[Stretch[Any], ...]], ...]:
    """The stretches of each kind of fault, with its name."""
    return (
        (tr("not reachable"), path.unreachable),
        (tr("outside limits"), path.out_of_limits),
        (tr("too fast"), path.too_fast),
        (tr("undecided"), path.undecided),
        (tr("collision"), path.collisions),
    )
