"""The paths for player and recording: singular poses, faults and contacts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.collision.pairs import names_of
from er3a.collision.scene import Scene
from er3a.finding import Finding, fact, is_one
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import N_, tr, with_unit
from er3a.pipeline.messages.collision import hit_word
from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.planning import rate_needed, times_needed
from er3a.pipeline.messages.programs import remedies
from er3a.pipeline.messages.say import joined, say, sentence
from er3a.pipeline.messages.trajectory import (
    FaultText,
    Slowed,
    cause_of,
    cause_text,
    end_text,
    event_word,
    first_faults,
    no_repair,
    path_text,
    repair_lead,
    repair_text,
    switch_text,
)
from er3a.pipeline.player.motions import Fault, FaultMoment, Mark, PlayedEvent, PlayedMotion, Weight, address_of
from er3a.pipeline.stages.expectations import is_met
from er3a.pipeline.stages.trajectory import model
from er3a.planning.motion_faults import RATES, by_kind, rate_ratio
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

SLOWER = 0.97  # of the programmed pace, below which a motion counts as slower
LARGEST_PART = 0.9  # of a path's time, up to which it is slower only there
MIN_LENGTH = 1e-6  # m
MOMENT = 0.001  # s
DASHES = 3  # of the rest of a path that the arm does not reach
SINGULAR_AXES = {"wrist": (4, 6), "elbow": (2, 3), "shoulder": (1,)}  # rows of the table that such a pose is of
RANKS: tuple[Weight, ...] = ("fail", "caution", "plain")


def motions(robot: Robot, results: model.TrajectoryResults, scene: Scene | None = None) -> list[PlayedMotion]:
    """The paths as programmed, as far as the arm reaches them, each followed by the motion that repairs it.

    ``scene``: to which narrow gaps are drawn.
    """
    checks, avoidance, motions = results.checks, results.avoidance, []
    for path in worst_first(results.summary.paths):
        whole = checks.take(checks.path == path.name)
        rows = whole.take(whole.reachable)
        near = near_assumed(path, results.summary)
        text = say(near) if near else path_text(path)
        seen = [*events(path), *_near_events(path, near, results.clearance)]
        if path.verdict == "safe" and not near:
            seen += _nearest(path.clearance)
        seen += safe_end(path, results.clearance)
        marks, q = [*contact(path), *_beyond(path, whole)], meant(robot, rows.q_deg)
        if near and path.clearance and scene:
            least = path.clearance
            then = np.array([np.interp(least.t_s, rows.t_s, own) for own in q.T])
            marks.append(gap(Bodies(robot, scene), then, least.least_mm, least.t_s - MOMENT, least.t_s + MOMENT))
        motions.append(PlayedMotion(path.name, text, rows.t_s, q, seen, marks, whole_s=path.duration_s))
        if path.chosen:
            repair = avoidance.take((avoidance.path == path.name) & (avoidance.strategy == path.strategy))
            text = repair_lead(path, slowed(path, rows, repair))
            q = meant(robot, repair.q_deg)
            seen = _nearest(path.chosen.motion.clearance if path.chosen.motion else None)
            motions.append(PlayedMotion(repaired(path), text, repair.t_s, q, seen))
    return motions


def gap(bodies: Bodies, q: Reals, far_mm: float, t0: float, t1: float) -> Mark:
    """Where the arm is nearest to anything, as a line from ``t0`` to ``t1`` (s) with that distance.

    Parameters
    ----------
    q : (n,), rad or m
    far_mm : how near, as the results say it
    """
    start, end = bodies.surface_points(q, int(bodies.min_distance(q[None])[1][0])).tolist()
    return Mark(t0, t1, start, end, with_unit(fixed(far_mm, 1), "mm"))


def _nearest(least: model.MinClearance | None) -> list[PlayedEvent]:
    """The moment at which a motion is nearest to anything, where that was measured."""
    if least is None:
        return []
    text = sentence("least_clearance", far_mm=least.least_mm, pair=least.between)
    return [PlayedEvent(least.t_s, least.t_s, text, "plain")]


def safe_end(path: model.PathSummary, clearance: model.Clearances) -> list[PlayedEvent]:
    """The moment up to which a path that meets something may be run: how clear it is there, and after a stop."""
    end, last = path.sound_end, path.clear_until
    if end is None or last is None or end.t_s < last.t_s:
        return []
    rows = clearance.take((clearance.path == path.name) & (clearance.strategy == ""))
    here = fixed(float(np.interp(end.t_s, rows.t_s, rows.clearance_mm)), 1)
    text = tr("{here} mm clear here, {after} mm after the stop", here=here, after=fixed(last.margin_mm, 1))
    return [PlayedEvent(end.t_s, end.t_s, text, "plain")]


def worst_first(paths: Sequence[model.PathSummary]) -> list[model.PathSummary]:
    """Those that fail first, of them those that were not expected to."""
    return sorted(paths, key=lambda path: (RANKS.index(_weight_of(path)), is_met(path)))


def _weight_of(path: model.PathSummary) -> Weight:
    """How much its verdict weighs, with what was found in its program."""
    return "fail" if path.fails else "plain" if path.verdict == "safe" and not path.of_program else "caution"


def faults(results: model.TrajectoryResults) -> list[Fault]:
    """The paths that may not be run as they are, the worst first."""
    found = []
    for path in worst_first(results.summary.paths):
        near = near_assumed(path, results.summary)
        if model.is_safe(path, results.summary.verdict.shapes):
            continue
        clearance = path.clearance if path.verdict == "safe" else None
        rows = results.checks.take(results.checks.path == path.name)
        wrong: list[FaultText | FaultMoment] = [*_in_program(path)]
        if near and clearance:
            wrong.append(FaultText(clearance.t_s, say(near), clearance.t_s))
        elif path.verdict != "safe":
            wrong = [*_faults(path), *wrong]
        status, verdict = shown_verdict(path, near)
        own = results.avoidance.take(results.avoidance.path == path.name)
        to_do, instead = _to_do(path, rows, own, results.summary)
        moments = tuple(_linked(_moment(fault, rows), path.name) for fault in wrong)
        found.append(
            Fault(
                path.name,
                status,
                verdict,
                path.verdict != "safe" and is_met(path),
                moments,
                to_do,
                address_of("trajectory", path.name, moments[0].seen_s or 0.0, path.name),
                instead,
                cause_of(path),
            )
        )
    return found


def _faults(path: model.PathSummary) -> list[FaultText] | list[FaultMoment]:
    """What is wrong with a path that is not safe, and when (s): first, and what weighs more later."""
    found = [] if path.not_planned else first_faults(path)
    if found or not path.singularities or path.not_planned:
        return found or [FaultMoment(path_text(path))]
    first = min(event.t_s for event in path.singularities)
    return [FaultText(first, path_text(path), first)]


def _in_program(path: model.PathSummary) -> list[FaultMoment]:
    """What was found in the program that a path is of, each text once with its lines, the worst first."""
    lines: dict[str, dict[str, None]] = {}
    for each in sorted(path.of_program, key=lambda each: each.level != "fail"):
        line = tr("line {line}", line=each.line) if each.line else ""
        lines.setdefault(say(each.finding), {})[line] = None
    return [FaultMoment(text, joined(named, ", ")) for text, named in lines.items()]


def _moment(fault: FaultText | FaultMoment, rows: model.PathChecks) -> FaultMoment:
    """A fault of a path with its time, when it is worst, and its place then, between the path's rows."""
    if isinstance(fault, FaultMoment):
        return fault
    when = tr("{time} s", time=fixed(fault.t_s, 3))
    if fixed(fault.seen_s, 3) != fixed(fault.t_s, 3):
        when = tr("{when}, at worst {time} s", when=when, time=fixed(fault.seen_s, 3))
    if not len(rows):
        return FaultMoment(fault.text, when, seen_s=fault.seen_s)
    far, *xyz = (float(np.interp(fault.seen_s, rows.t_s, values)) for values in (1000 * rows.s_m, *rows.xyz_mm.T))
    place = tr("{far} mm, ({xyz})", far=fixed(far, 0), xyz=", ".join(fixed(value, 0) for value in xyz))
    return FaultMoment(fault.text, when, place if np.isfinite([far, *xyz]).all() else "", fault.seen_s)


def _linked(moment: FaultMoment, path: str) -> FaultMoment:
    """A moment with its address, where the player shows it."""
    return (
        moment
        if moment.seen_s is None
        else replace(moment, address=address_of("trajectory", path, moment.seen_s, path))
    )


def _assumed(part: model.Stretch) -> bool:
    """Whether what a stretch exceeds is an assumed limit."""
    return isinstance(part.cause, Finding) and part.cause.basis == "assumed"


def _to_do(
    path: model.PathSummary, rows: model.PathChecks, motions: model.AvoidanceRows, summary: model.TrajectorySummary
) -> tuple[str, tuple[str, str] | None]:
    """What to do instead of running a path as it is, and the motion that may be run with its address."""
    if path.chosen:
        name, repair = repaired(path), motions.take(motions.strategy == path.strategy)
        text = repair_text(path, slowed(path, rows, repair), _switch(path, rows, motions))
        return text, (name, address_of("trajectory", name, 0.0, path.name))
    if path.verdict == "safe":
        near = near_assumed(path, summary)
        text = N_("Measure this gap on the arm: {far} mm by assumed shapes.")
        measure = tr(text, far=fixed(near.clearance_mm, 1)) if near else ""
        return joined([*remedies(path.of_program), measure], " "), None
    last = path.sound_end
    if last is None:
        todo = advised(path, rows)
        return sentence("finding", finding=todo) if todo else "", None
    name = tr("{path}, up to {time} s", path=path.name, time=fixed(last.t_s, 3))
    address = address_of("trajectory", path.name, last.t_s, path.name, last.t_s)
    return end_text(path, last), (name, address)


def slowed(path: model.PathSummary, rows: model.PathChecks, repair: model.AvoidanceRows) -> Slowed | None:
    """Where a repair that keeps the path goes slower than programmed, or the path is too fast; None of others, and
    where that is everywhere.

    ``rows``, ``repair``: of the path and of its repair, compared where the tool point has come equally far.
    """
    length = _kept_length(path, rows, repair)
    if length is None:
        return None
    programmed = np.interp(length, rows.s_m, rows.t_s)
    pace = np.diff(programmed) / np.diff(repair.t_s)
    slow = np.flatnonzero(pace < SLOWER)
    if not len(slow):
        return None
    start = min([programmed[slow[0]], *(part.t0_s for part in path.too_fast)])
    end = max([programmed[slow[-1] + 1], *(part.t1_s for part in path.too_fast)])
    if end - start > LARGEST_PART * path.duration_s:
        return None
    return Slowed(float(start), float(end), float(pace.min()))


def _kept_length(path: model.PathSummary, rows: model.PathChecks, repair: model.AvoidanceRows) -> Reals | None:
    """The arc length (N,), m, of the tool point at the rows of a repair that keeps the path; None of others, and of
    paths on which the tool point stays where it is."""
    if path.strategy != "slow" or len(repair) < 2 or len(rows) < 2:
        return None
    length: Reals = np.append(0.0, np.linalg.norm(np.diff(repair.xyz_mm, axis=0), axis=1).cumsum()) / 1000
    return length if np.isfinite(length[-1]) and length[-1] >= MIN_LENGTH else None


def advised(path: model.PathSummary, rows: model.PathChecks) -> str:
    """Why nothing repairs a path that may end nowhere, and that no part of it is to be run; empty where nothing was
    tried. ``rows``: of the path."""
    if not path.avoidance:
        return ""
    no_part = sentence("advice.no_part")
    if not path.in_joint_space and len(rows) and rows.near_singular[0]:
        return joined([sentence("path.cause", event=no_part, pose=sentence("advice.near")), no_repair(path)], ". ")
    return joined([no_repair(path), no_part if path.fails else ""], ". ")


def _switch(path: model.PathSummary, rows: model.PathChecks, motions: model.AvoidanceRows) -> str:
    """Where a motion on another IK solution begins, and whether the way there was checked; empty for other motions."""
    own = motions.take(motions.strategy == path.strategy)
    if path.strategy != "branch" or not len(rows) or not len(own):
        return ""
    return switch_text((own.q_deg[0] - rows.q_deg[0]).tolist(), path.sliding)


def repaired(path: model.PathSummary) -> str:
    """The name of the motion that repairs a path."""
    return tr("{path}, repaired", path=path.name)


def shown_verdict(path: model.PathSummary, near: Finding | None) -> tuple[Weight, str]:
    """A path's verdict in colour and words; ``near`` as of :func:`near_assumed`."""
    weight = _weight_of(path)
    if path.verdict == "safe" and path.of_program:
        return weight, tr("fault in its program") if weight == "fail" else tr("doubt in its program")
    if path.verdict == "safe" and near:
        return "caution", tr("{far} mm clear (assumed)", far=fixed(near.clearance_mm, 1))
    said = {each: outcome_word(each) for each in path.outcomes}
    if path.of("collides"):
        said["collides"] = hit_word(path.of("collides")[0].cause.touches[0].pair)
    return weight, joined(said.values(), ", ")


def near_assumed(path: model.PathSummary, summary: model.TrajectorySummary) -> Finding | None:
    """That a path is clear of assumed shapes by less than these may be wrong by."""
    shapes = summary.verdict.shapes
    if shapes is None or path.name not in shapes.near or path.clearance is None:
        return None
    return fact(
        "clear_of_assumed",
        pair=path.clearance.between,
        clearance_mm=path.clearance.least_mm,
        margin_mm=shapes.margin_mm,
    )


def events(path: model.PathSummary) -> list[PlayedEvent]:
    """Singular poses and faults of a path; none of one that passes: joint moves pass singular poses unharmed."""
    faults = [(outcome_word(kind), part) for kind, own in by_kind(path.faults).items() for part in own]
    return [
        PlayedEvent(s.t_s, s.until_s, _singular(s), "caution", axes=s.axes or SINGULAR_AXES.get(s.type, ()))
        for s in path.singularities
        if path.verdict != "safe"
    ] + [
        PlayedEvent(
            s.t0_s,
            s.t1_s,
            tr("{fault}: {cause}, at {t:.2f} s", fault=kind, cause=_few_words(s), t=s.t0_s),
            _weight(s),
            _touching(s.cause),
            _joints(s.cause),
        )
        for kind, s in faults
    ]


def _few_words(part: model.Stretch) -> str:
    """Why a stretch is an event, up to where its details begin; of bodies that overlap the first two."""
    if is_one(part.cause, "bodies_overlap"):
        return say(part.cause.touches[0].pair)
    few = re.split(" ?[;(；（]", cause_text(part))[0]
    return rate_needed(part.cause) if is_one(part.cause, *RATES) else re.split("[:：] ?", few)[-1]


def _near_events(path: model.PathSummary, near: Finding | None, clearance: model.Clearances) -> list[PlayedEvent]:
    """From when to when a path is as near to assumed shapes as these may be wrong, at its nearest."""
    if near is None or path.clearance is None:
        return []
    rows = clearance.take((clearance.path == path.name) & (clearance.strategy == ""))
    at = path.clearance.t_s
    far = rows.t_s[~(rows.clearance_mm < near.margin_mm)]
    start = min(rows.t_s[rows.t_s > max(far[far < at], default=-np.inf)], default=at)
    end = max(rows.t_s[rows.t_s < min(far[far > at], default=np.inf)], default=at)
    return [PlayedEvent(min(start, at), max(end, at), say(near), "caution", names_of(near.pair))]


def _joints(cause: object) -> tuple[tuple[int, str], ...]:
    """The joint that fails, if it is one, with what it would need of what it has."""
    joint = getattr(cause, "joint", None)
    if joint is None:
        return ()
    if not is_one(cause, "too_fast", "acceleration_too_great"):
        return ((joint, ""),)
    return ((joint, times_needed(rate_ratio(cause))),)


def _weight(part: model.Stretch) -> Weight:
    return "caution" if _assumed(part) or is_one(part.cause, "undecided") else "fail"


def contact(path: model.PathSummary) -> list[Mark]:
    """Where bodies first touch, while they do."""
    if path.clear_until is None:
        return []
    x, y, z = (value / 1000 for value in path.clear_until.contact_mm)
    return [Mark(part.t0_s, part.t1_s, (x, y, z), (x, y, z), tr("first contact")) for part in path.of("collides")[:1]]


def _beyond(path: model.PathSummary, rows: model.PathChecks) -> list[Mark]:
    """The rest of a path that ends beyond the reach, dashed, and how far beyond it ends; ``rows``: of the path."""
    if not path.of("unreachable") or rows.reachable[-1]:
        return []
    at = np.linspace(np.flatnonzero(rows.reachable).max(initial=0), len(rows) - 1, 2 * DASHES + 1).astype(int)
    points, said = (rows.xyz_mm[at] / 1000).tolist(), [*[""] * (DASHES - 1), _few_words(path.of("unreachable")[-1])]
    return [Mark(0.0, path.duration_s, *ends) for ends in zip(points[1::2], points[2::2], said)]


def _touching(cause: object) -> tuple[str, ...]:
    """The bodies that the text of a collision names: those that touch first."""
    return names_of(cause.touches[0].pair) if is_one(cause, "bodies_overlap") else ()


def _singular(event: model.Singularity) -> str:
    word = event_word(event)
    return tr("singular: {type}", type=word) if event.crossing else tr("near-singular: {type}", type=word)
