"""The paths for player and recording: singular poses, faults and contacts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from er3a.pipeline.messages.expectations import as_expected, outcome_words
from er3a.pipeline.messages.language import own_title, tr
from er3a.pipeline.messages.programs import remedy, say
from er3a.pipeline.messages.say import joined, sentence
from er3a.pipeline.messages.trajectory import (
    IF_ASSUMED,
    advice,
    cause_text,
    end_text,
    event_word,
    first_faults,
    path_text,
    repair_text,
    switch_text,
)
from er3a.pipeline.player.motions import Fault, FaultMoment, Mark, PlayedEvent, PlayedMotion, Weight, address_of
from er3a.pipeline.stages.expectations import is_met
from er3a.pipeline.stages.trajectory import model
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


def motions(robot: Robot, results: model.TrajectoryResults) -> list[PlayedMotion]:
    """The paths as programmed, as far as the arm reaches them, each followed by the motion that repairs it."""
    checks, avoidance, motions = results.checks, results.avoidance, []
    for path in worst_first(results.summary.paths):
        rows = checks.take((checks.path == path.name) & checks.reachable)
        motions.append(
            PlayedMotion(path.name, path_text(path), rows.t_s, meant(robot, rows.q_deg), events(path), contact(path))
        )
        if path.chosen:
            repair = avoidance.take((avoidance.path == path.name) & (avoidance.strategy == path.strategy))
            text = advice(path, results.summary.joint_limits) or ""
            motions.append(PlayedMotion(repaired(path), text, repair.t_s, meant(robot, repair.q_deg)))
    return motions


def worst_first(paths: Sequence[model.PathSummary]) -> list[model.PathSummary]:
    """Those that fail first, of them those that were not expected to."""
    ranks = ("fail", "caution", "plain")
    return sorted(paths, key=lambda path: (ranks.index(WEIGHTS[path.verdict]), is_met(path)))


def faults(results: model.TrajectoryResults) -> list[Fault]:
    """The paths that may not be run as they are, the worst first."""
    found = []
    for path in worst_first(results.summary.paths):
        near = near_assumed(path, results.summary)
        if model.is_safe(path, results.summary.verdict.shapes):
            continue
        clearance = path.clearance if path.verdict == "safe" else None
        wrong = [(clearance.t_s, say(near))] if clearance else _faults(path)
        status, verdict = shown_verdict(path, near)
        rows = results.checks.take(results.checks.path == path.name)
        own = results.avoidance.take(results.avoidance.path == path.name)
        to_do, instead = _to_do(path, rows, own, results.summary)
        found.append(
            Fault(
                path.name,
                own_title(path.title),
                status,
                verdict,
                path.verdict != "safe" and is_met(path),
                as_expected(path),
                tuple(_moment(text, t, rows) for t, text in wrong),
                to_do,
                address_of("trajectory", path.name, wrong[0][0] or 0.0, path.name),
                instead,
            )
        )
    return found


def _faults(path: model.PathSummary) -> Sequence[tuple[float | None, str]]:
    """What is wrong with a path that is not safe, and when (s), if it has a time: first, and what weighs more later."""
    found = [] if path.not_planned else first_faults(path)
    if (path.verdict in ("singular", "near-singular") and len(found) <= 1) or not found:
        times = [] if path.not_planned else path.singular_times_s or [event.t_s for event in path.singularities]
        return [(min(times, default=None), path_text(path))]
    return found


def _moment(what: str, t: float | None, rows: model.PathChecks) -> FaultMoment:
    """A fault at a time (s) of a path, with the place of it between the path's rows."""
    if t is None:
        return FaultMoment(what)
    when = tr("{time} s", time=fixed(t, 3))
    if not len(rows):
        return FaultMoment(what, when)
    far, *xyz = (float(np.interp(t, rows.t_s, values)) for values in (1000 * rows.s_m, *rows.xyz_mm.T))
    place = tr("{far} mm, ({xyz})", far=fixed(far, 0), xyz=", ".join(fixed(value, 0) for value in xyz))
    return FaultMoment(what, when, place if np.isfinite([far, *xyz]).all() else "")


def _assumed(part: model.Stretch[Any]) -> bool:
    """Whether what a stretch exceeds is an assumed limit."""
    return bool(part.cause.code.endswith(IF_ASSUMED))


def _to_do(
    path: model.PathSummary, rows: model.PathChecks, motions: model.AvoidanceRows, summary: model.TrajectorySummary
) -> tuple[str, tuple[str, str] | None]:
    """What to do instead of running a path as it is, and the motion that may be run with its address."""
    assumed = summary.verdict.shapes is not None
    if path.chosen:
        name = repaired(path)
        repair_said = repair_text(path, summary.joint_limits, assumed=assumed)
        repair = sentence("finding", finding=joined([repair_said, _switch(path, rows, motions)], ". "))
        return repair, (name, address_of("trajectory", name, 0.0, path.name))
    if path.verdict == "safe" and (near := near_assumed(path, summary)):
        return remedy(near), None
    last = path.sound_end
    if last is None:
        todo = advised(path, rows, motions, summary.joint_limits, assumed=assumed)
        return sentence("finding", finding=todo) if todo else "", None
    name = tr("{path}, up to {time} s", path=path.name, time=fixed(last.t_s, 3))
    end = end_text(path, last, assumed=assumed)
    return end, (name, address_of("trajectory", path.name, last.t_s, path.name, last.t_s))


def advised(
    path: model.PathSummary,
    rows: model.PathChecks,
    motions: model.AvoidanceRows,
    limits: model.LimitsUsed,
    *,
    assumed: bool = False,
) -> str | None:
    """What to do about a path; None where nothing is to be done.

    ``rows``, ``motions``, ``limits``: of the path, of its repairs, of the joints; ``assumed``: whether clearance is
    that of assumed shapes.
    """
    text = advice(path, limits, assumed=assumed)
    if text is None or path.chosen:
        return text and joined([text, _switch(path, rows, motions)], ". ")
    if not path.in_joint_space and len(rows) and rows.near_singular[0]:
        met = any(event.crossing and event.t_s <= rows.t_s[0] for event in path.singularities)
        return joined([sentence("advice.near#met" if met else "advice.near"), text], ". ")
    no_part = path.sound_end is None and WEIGHTS[path.verdict] == "fail"
    return joined([text, sentence("advice.no_part")], ". ") if no_part else text


def _switch(path: model.PathSummary, rows: model.PathChecks, motions: model.AvoidanceRows) -> str:
    """Where a motion on another IK solution begins, and whether the way there was checked; empty for other motions."""
    own = motions.take(motions.strategy == path.strategy)
    if path.strategy != "branch" or not len(rows) or not len(own):
        return ""
    return switch_text((own.q_deg[0] - rows.q_deg[0]).tolist(), path.sliding)


def repaired(path: model.PathSummary) -> str:
    """The name of the motion that repairs a path."""
    return tr("{path}, repaired", path=path.name)


def shown_verdict(path: model.PathSummary, near: ClearOfAssumed | None) -> tuple[Weight, str]:
    """A path's verdict in colour and words; ``near`` as of :func:`near_assumed`."""
    if path.verdict == "safe" and near:
        return "caution", tr("clear of assumed shapes only")
    return WEIGHTS[path.verdict], outcome_words(path.outcomes)


def near_assumed(path: model.PathSummary, summary: model.TrajectorySummary) -> ClearOfAssumed | None:
    """That a path is clear of assumed shapes by less than these may be wrong by."""
    shapes = summary.verdict.shapes
    if shapes is None or path.name not in shapes.near or path.clearance is None:
        return None
    return ClearOfAssumed(path.clearance.between, path.clearance.least_mm, shapes.margin_mm)


def events(path: model.PathSummary) -> list[PlayedEvent]:
    """Singular poses and faults of a path."""
    passes = [PlayedEvent(e.t_s, e.until_s, _singular(e), "caution") for e in path.singularities]
    faults = [(kind, stretch) for kind, stretches in kinds(path) for stretch in stretches]
    return passes + [
        PlayedEvent(
            s.t0_s,
            s.t1_s,
            tr("{fault}: {cause}", fault=kind, cause=cause_text(path, s)),
            _weight(path, s),
            _touching(s.cause),
        )
        for kind, s in faults
    ]


def _weight(path: model.PathSummary, part: model.Stretch[Any]) -> Weight:
    return "caution" if _assumed(part) or part in path.undecided else "fail"


def contact(path: model.PathSummary) -> list[Mark]:
    """Where bodies first touch, while they do."""
    if path.clear_until is None:
        return []
    x, y, z = (value / 1000 for value in path.clear_until.contact_mm)
    return [Mark(part.t0_s, part.t1_s, (x, y, z), (x, y, z), tr("first contact")) for part in path.collisions[:1]]


def _touching(cause: object) -> tuple[str, ...]:
    pairs = cause.pairs if isinstance(cause, model.BodiesOverlap) else ()
    return tuple(dict.fromkeys(name for pair in pairs for name in pair.names))


def _singular(event: model.Singularity) -> str:
    word = event_word(event)
    return tr("singular: {type}", type=word) if event.crossing else tr("near-singular: {type}", type=word)


def kinds(path: model.PathSummary) -> tuple[tuple[str, tuple[model.Stretch[Any], ...]], ...]:
    """The stretches of each kind of fault, with its name."""
    return (
        (tr("not reachable"), path.unreachable),
        (tr("outside limits"), path.out_of_limits),
        (tr("too fast"), path.too_fast),
        (tr("undecided"), path.undecided),
        (tr("collision"), path.collisions),
    )
