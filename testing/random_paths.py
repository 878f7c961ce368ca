"""Random joint moves and straight lines, and the events that a finer sampling finds on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import TYPES, NearSingular, determinant_factors, factor_of
from er3a.numerics.arrays import runs
from er3a.planning.follow import follow
from er3a.planning.moves import JointMove, line
from er3a.planning.singular_events import SingularEvent, singular_events
from er3a.planning.tool_curve import curve_of

NEAR = NearSingular(float(np.radians(5)), float(np.radians(5)), 0.03)
COARSE = 101
FINER = 100


@dataclass(frozen=True)
class Path:
    """Joint angles at times within 0..1, and the events found with the coarse sampling."""

    joints: Callable[[np.ndarray], np.ndarray]
    events: list[SingularEvent]
    jumps: tuple[tuple[float, float], ...]  # grid points before and behind them


def random_joint_move(robot, random) -> Path:
    move = JointMove(*random.uniform(robot.lower, robot.upper, (2, 6)), 1.0)
    return Path(lambda at: move.joints(at)[0], singular_events(robot, move.polynomials(), NEAR), ())


def random_line(robot, random) -> Path:
    """A line between the tool poses of two random joint vectors near each other; it may leave the reach."""
    q = random.uniform(robot.lower, robot.upper)
    return _followed(robot, q, q + random.uniform(-0.6, 0.6, 6))


def random_plane_line(robot, random) -> Path:
    """A line within the arm's own plane: the only ones that meet the aligned wrist, but for chance."""
    q = random.uniform(robot.lower, robot.upper)
    q[3:] = 0.0, random.uniform(-0.5, 0.5), 0.0
    return _followed(robot, q, q + random.uniform(-0.8, 0.8, 6) * [0, 1, 1, 0, 1, 0])


def _followed(robot, start, end) -> Path:
    followed = follow(robot, line(*forward(robot, np.stack([start, end])), 1.0), np.linspace(0, 1, COARSE), start)
    events = singular_events(robot, curve_of(followed)[0], NEAR)
    return Path(
        followed.joints,
        events,
        tuple((float(followed.t[np.searchsorted(followed.t, j.t) - 1]), j.t) for j in followed.jumps),
    )


@dataclass
class Found:
    """Counts: crossings and near passes of the finer sampling, and how many of them the events lack."""

    crossings: int = 0
    missed_crossings: int = 0
    passes: int = 0
    missed_passes: int = 0

    def add(self, robot, path: Path) -> None:
        """Compare a path's events with a sampling FINER times as fine."""
        t = np.linspace(0, 1, (COARSE - 1) * FINER + 1)
        factors = determinant_factors(robot, path.joints(t))
        for kind in TYPES:
            f = factor_of(factors, kind)
            events = [event for event in path.events if event.type == kind]
            for i in np.flatnonzero(f[:-1] * f[1:] < 0):
                if any(t[i + 1] >= before and t[i] <= behind for before, behind in path.jumps):
                    continue
                self.crossings += 1
                self.missed_crossings += not any(
                    event.crossing and t[i] - 1e-9 <= event.t <= t[i + 1] + 1e-9 for event in events
                )
            for first, last in runs(np.abs(f) < NEAR.of(kind)):
                if any(t[last - 1] >= before and t[first] <= behind for before, behind in path.jumps):
                    continue
                self.passes += 1
                least = np.abs(f[first:last]).min()
                spans = t[max(first - 1, 0)], t[min(last, len(t) - 1)]
                near = [e.distance for e in events if spans[0] <= e.until and e.t <= spans[1]]
                self.missed_passes += bool(not near or min(near) > least + 1e-12)


KINDS = {
    "joint moves": random_joint_move,
    "straight lines": random_line,
    "lines in the arm's plane": random_plane_line,
}
