"""The paths for player and recording: the line between the nearest points, and overlaps with their times."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from er3a.pipeline.language import tr
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import sentence
from er3a.pipeline.messages.scope import body_word
from er3a.pipeline.player.motions import Mark, PlayedEvent, PlayedMotion, at_rest
from er3a.pipeline.stages.collision.model import Closest, CollisionResults, PathClearances
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

MOMENT = 1e-6  # s
TOUCHING = 1e-3  # mm: far above what is left where bodies first touch


def motions(robot: Robot, results: CollisionResults, ends: Mapping[str, PlayedEvent]) -> list[PlayedMotion]:
    """The paths, as far as the arm reaches them, with the line between the nearest points at each moment; ``ends``: up
    to where those that meet something may be run, as the page of paths says it."""
    motions = []
    for name in dict.fromkeys(results.paths.path.tolist()):
        own = results.paths.take(results.paths.path == name)
        rows = own.take(np.isfinite(own.q_deg.sum(axis=1)))
        q = meant(robot, rows.q_deg)
        motions.append(
            PlayedMotion(
                name, "", rows.t_s, q, events(results, name, rows), nearest(rows, ends.get(name)), whole_s=own.t_s[-1]
            )
        )
    return motions


def poses(robot: Robot, results: CollisionResults) -> list[PlayedMotion]:
    """The chosen solution of each target at rest, with the line between what is nearest."""
    return [_pose(robot, found) for found in results.summary.closest if found.kind == "target"]


def _pose(robot: Robot, found: Closest) -> PlayedMotion:
    start, end = (np.array([found.from_mm, found.to_mm]) / 1000).tolist()
    mark = Mark(0.0, 1.0, start, end, _clearance(found.clearance_mm))
    return at_rest(robot, found.name, _least(found).text, q=meant(robot, np.array(found.q_deg)), marks=[mark])


def events(results: CollisionResults, path: str, rows: PathClearances) -> list[PlayedEvent]:
    """Where a path is nearest to something, and where bodies overlap."""
    closest = [found for found in results.summary.closest if (found.kind, found.name) == ("path", path)]
    return [*(_least(found) for found in closest[:1] if found.clearance_mm >= 0), *_overlaps(rows)]


def _overlaps(rows: PathClearances) -> list[PlayedEvent]:
    """Where the nearest bodies overlap, each stretch with one pair."""
    far = rows.clearance_mm
    label = np.where(far < TOUCHING, rows.between, "")
    starts = np.union1d(np.flatnonzero(label != np.roll(label, 1)), [0])
    ends = np.append(starts[1:], len(rows) - 1)
    return [
        PlayedEvent(
            rows.t_s[i], rows.t_s[j - (label[j] == "")], _inside(bodies, rows.take(np.arange(i, j + 1))), "fail", bodies
        )
        for i, j in zip(starts, ends)
        if len(bodies := tuple(label[i].split("/"))) == 2
    ]


def _inside(bodies: tuple[str, ...], rows: PathClearances) -> str:
    """How deep a body gets into another one while they overlap, and when."""
    (one, other), worst = map(body_word, bodies), int(rows.clearance_mm.argmin())
    far, at = fixed(-rows.clearance_mm[worst], 1), fixed(rows.t_s[worst], 2)
    return tr("{one} is up to {far} mm inside {other}, at {at} s", one=one, far=far, other=other, at=at)


def _least(found: Closest) -> PlayedEvent:
    text, t = sentence("least_clearance", far_mm=found.clearance_mm, pair=found.between), found.t_s or 0.0
    return PlayedEvent(t, t, text, "plain")


def nearest(rows: PathClearances, end: PlayedEvent | None = None) -> list[Mark]:
    """The nearest points, each pair shown until the next was measured; at the ``end`` that a path may have also how
    clear it is after the stop."""
    until = np.append(rows.t_s[1:], rows.t_s[-1:])
    until[-2:-1] -= MOMENT  # the last pair alone is shown at the end
    return [
        Mark(t0, t1, start, other, end.text if end and t0 <= end.t < t1 else _clearance(clearance))
        for t0, t1, start, other, clearance in zip(
            rows.t_s.tolist(),
            until.tolist(),
            np.round(rows.from_mm / 1000, 5).tolist(),
            np.round(rows.to_mm / 1000, 5).tolist(),
            rows.clearance_mm.tolist(),
        )
        if np.isfinite(start).all() and np.isfinite(other).all()
    ]


def _clearance(clearance_mm: float) -> str:
    return tr("{clearance} mm", clearance=fixed(clearance_mm, 1))
