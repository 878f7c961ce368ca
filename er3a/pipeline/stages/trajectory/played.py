"""The paths as page and recording play them: singular poses, faults, and what touches what."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.language import own_title, tr
from er3a.pipeline.messages.programs import say
from er3a.pipeline.messages.say import sentence
from er3a.pipeline.messages.trajectory import advice, cause_text, event_word, path_text
from er3a.pipeline.player.motions import Fault, Mark, PlayedEvent, PlayedMotion, Weight, address_of
from er3a.pipeline.stages.trajectory.model import (
    BodiesOverlap,
    PathChecks,
    PathSummary,
    Singularity,
    Stretch,
    TrajectoryResults,
    TrajectorySummary,
    is_safe,
)
from er3a.pipeline.viewing.numbers import fixed
from er3a.planning.names import PathVerdict
from er3a.program_check.program_check_findings import ClearOfAssumed
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
    for path in worst_first(results.summary.paths):
        rows = checks.take((checks.path == path.name) & checks.reachable)
        motions.append(
            PlayedMotion(path.name, path_text(path), rows.t_s, meant(robot, rows.q_deg), events(path), contact(path))
        )
        if path.chosen:
            repair = avoidance.take((avoidance.path == path.name) & (avoidance.strategy == path.strategy))
            name = tr("{path}, repaired", path=path.name)
            motions.append(PlayedMotion(name, advice(path) or "", repair.t_s, meant(robot, repair.q_deg)))
    return motions


def worst_first(paths: Sequence[PathSummary]) -> list[PathSummary]:
    """Those that fail first, of them those that were not expected to."""
    ranks = ("fail", "caution", "plain")
    return sorted(paths, key=lambda path: (ranks.index(WEIGHTS[path.verdict]), path.expect == path.verdict))


def faults(results: TrajectoryResults) -> list[Fault]:
    """The paths that may not be run as they are, the worst first."""
    found = []
    for path in worst_first(results.summary.paths):
        near = near_assumed(path, results.summary)
        if is_safe(path, results.summary.verdict.shapes):
            continue
        where, t = near, path.clearance.t_s if path.clearance else 0.0
        if path.verdict != "safe":
            where, t = _first_fault(path)
        todo = path_advice(path, results.checks.take(results.checks.path == path.name))
        status, verdict = shown_verdict(path, near)
        found.append(
            Fault(
                path.name,
                own_title(path.title),
                status,
                verdict,
                path.expect == path.verdict != "safe",
                where,
                sentence("finding", finding=todo) if todo else "",
                address_of("trajectory", path.name, t, path.name),
            )
        )
    return found


def _first_fault(path: PathSummary) -> tuple[str, float]:
    """What is wrong first with a path that is not safe, and when (s); how fast it is counts where nothing else is,
    singular poses before it."""
    found = [(part.t0_s, word, part) for word, parts in kinds(path) for part in parts]
    at_any_pace = [each for each in found if each[2] not in path.too_fast and each[2] not in path.undecided]
    if at_any_pace or (found and path.verdict != "singular"):
        t, word, part = min(at_any_pace or found, key=lambda each: each[0])
        cause = say(part.cause.touches[0]) if isinstance(part.cause, BodiesOverlap) else cause_text(path, part)
        return tr("at t = {time} s: {text}", time=fixed(t, 2), text=tr("{fault}: {cause}", fault=word, cause=cause)), t
    return path_text(path), min((event.t_s for event in path.singularities), default=0.0)


def path_advice(path: PathSummary, rows: PathChecks) -> str | None:
    """What to do about a path, with the last of its points (``rows``) before anything is wrong, if it leaves the reach;
    None where nothing is to be done."""
    starts = [part.t0_s for _, stretches in kinds(path) for part in stretches]
    sound = rows.take(rows.reachable & (rows.t_s < min(starts, default=0.0)))
    if not path.unreachable or not len(sound):
        return advice(path)
    return advice(path, (float(sound.t_s[-1]), tuple(sound.xyz_mm[-1].tolist())))


def shown_verdict(path: PathSummary, near: str) -> tuple[Weight, str]:
    """A path's verdict in colour and words; ``near`` as of :func:`near_assumed`."""
    if path.verdict == "safe" and near:
        return "caution", tr("clear of assumed shapes only")
    return WEIGHTS[path.verdict], outcome_word(path.verdict)


def near_assumed(path: PathSummary, summary: TrajectorySummary) -> str:
    """That a path is clear of assumed shapes by less than these may be wrong by; else empty."""
    shapes = summary.verdict.shapes
    if shapes is None or path.name not in shapes.near or path.clearance is None:
        return ""
    return say(ClearOfAssumed(path.clearance.between, path.clearance.least_mm, shapes.margin_mm))


def events(path: PathSummary) -> list[PlayedEvent]:
    """Singular poses and faults of a path."""
    passes = [PlayedEvent(e.t_s, e.until_s, _singular(e), "caution") for e in path.singularities]
    faults = [(word, stretch) for word, stretches in kinds(path) for stretch in stretches]
    return passes + [
        PlayedEvent(
            s.t0_s,
            s.t1_s,
            tr("{fault}: {cause}", fault=word, cause=cause_text(path, s)),
            "fail",
            _touching(s.cause),
        )
        for word, s in faults
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
