"""The paths for player and recording: the line between the nearest points, and overlaps with their times."""

from __future__ import annotations

import numpy as np

from er3a.pipeline.language import tr
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import say
from er3a.pipeline.player.motions import Mark, PlayedEvent, PlayedMotion
from er3a.pipeline.stages.collision.model import Closest, CollisionResults, PathClearances
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot


def motions(robot: Robot, results: CollisionResults) -> list[PlayedMotion]:
    """The paths, as far as the arm reaches them, with the line between the nearest points at each moment."""
    motions = []
    for name in dict.fromkeys(results.paths.path.tolist()):
        rows = results.paths.take((results.paths.path == name) & np.isfinite(results.paths.q_deg).all(axis=1))
        q = meant(robot, rows.q_deg)
        motions.append(PlayedMotion(name, "", rows.t_s, q, events(results, name, rows), nearest(rows)))
    return motions


def events(results: CollisionResults, path: str, rows: PathClearances) -> list[PlayedEvent]:
    """Where a path is nearest to something, and where bodies overlap."""
    closest = [found for found in results.summary.closest if (found.kind, found.name) == ("path", path)]
    return [*map(_least, closest[:1]), *_overlaps(rows)]


def _overlaps(rows: PathClearances) -> list[PlayedEvent]:
    """Where the nearest bodies overlap, each stretch with one pair."""
    label = np.where(rows.clearance_mm < 0, rows.between, "")
    starts = np.flatnonzero(label != np.roll(label, 1))
    starts = np.union1d(starts, [0])
    ends = np.append(starts[1:], len(rows) - 1)
    return [
        PlayedEvent(rows.t_s[i], rows.t_s[j], tr("collision"), "fail", tuple(label[i].split("/")))
        for i, j in zip(starts, ends)
        if label[i]
    ]


def _least(found: Closest) -> PlayedEvent:
    text = tr("least clearance {clearance} mm: {pair}", clearance=fixed(found.clearance_mm, 1), pair=say(found.between))
    t = found.t_s or 0.0
    return PlayedEvent(t, t, text, "fail" if found.clearance_mm < 0 else "plain")


def nearest(rows: PathClearances) -> list[Mark]:
    """The nearest points, each pair shown until the next was measured."""
    until = np.append(rows.t_s[1:], rows.t_s[-1:])
    return [
        Mark(t0, t1, start, end, tr("{clearance} mm", clearance=fixed(clearance, 0)))
        for t0, t1, start, end, clearance in zip(
            rows.t_s.tolist(),
            until.tolist(),
            np.round(rows.from_mm / 1000, 5).tolist(),
            np.round(rows.to_mm / 1000, 5).tolist(),
            rows.clearance_mm.tolist(),
        )
        if np.isfinite(start).all() and np.isfinite(end).all()
    ]
