"""The singular segment of a path (singular, near-singular or out of reach), and the result of an avoidance strategy: a
motion, or the reason why it is not possible or not usable.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from er3a.by_value import by_identity
from er3a.finding import Finding
from er3a.kinematics.singularity import NearSingular
from er3a.numerics.arrays import Flags, Reals, runs
from er3a.planning.follow import Followed
from er3a.planning.piecewise import PiecewiseMotion
from er3a.planning.singular_events import SingularEvent
from er3a.planning.timing import JointLimits, fastest, nodes_along, straight
from er3a.robots.robot import Robot

AT_REST = 1e-6  # rad
POINTS = 501  # grid points of a stretch that its timing passes through at most


@by_identity
class Avoidance:
    """A strategy, carried out.

    Attributes
    ----------
    done : share of the path (0..1) that is done
    crosses_by_joints : whether it comes near singular sets in joint moves alone, which they do not affect
    """

    motion: PiecewiseMotion
    done: float = 1.0
    crosses_by_joints: bool = False


@by_identity
class SingularSegment:
    """A path that comes nearer to a singular set than ``near``, or leaves the arm's reach.

    Attributes
    ----------
    followed : the path as it is followed
    t, q : (N,) s and (N, 6) rad, along the path; q NaN where unreachable
    near : the distances that the path is to keep
    limits : of the joints' rates, to which motions are timed
    fixed_start : whether the joints at the start are given, or only the tool's pose
    allowed : what the joints can do, if motions are to be timed to less
    """

    followed: Followed
    t: Reals
    q: Reals
    near: NearSingular
    limits: JointLimits
    fixed_start: bool
    allowed: JointLimits | None = None

    @property
    def robot(self) -> Robot:
        """The arm."""
        return self.followed.robot

    @cached_property
    def good(self) -> Flags:
        """(N,) bool, whether the path can be reached and keeps its distance, away from places where a branch ends."""
        good: Flags = self.near.margin(self.robot, self.q) >= 1.0
        for jump in self.followed.jumps:
            after = np.searchsorted(self.t, jump.t)
            good[max(after - 1, 0) : after + 1] = False
        return good

    @cached_property
    def regions(self) -> list[tuple[int, int]]:
        """Stretches that are not good: index ranges (first, after the last)."""
        return runs(~self.good)

    @cached_property
    def first_joints(self) -> Reals:
        """Joints (6,) at which the arm waits before the path begins; the path's own unless its start is singular."""
        first: Reals = self.q[0] - self.followed.start_turn
        return first

    def begin(self) -> list[PiecewiseMotion]:
        """The turn at rest that a singular start may ask for.

        Returns
        -------
        parts : one joint move from ``first_joints`` to the path's first joints; empty where no turn is needed
        """
        if not np.abs(self.followed.start_turn).max() > AT_REST:
            return []
        return [straight(self.first_joints, self.q[0], self.limits)]

    def along(self, first: int, last: int, programmed: bool = True) -> PiecewiseMotion:
        """The path from one grid point to another, from rest to rest.

        Parameters
        ----------
        first, last : indices of ``t`` and ``q``, with first < last and all joints between known
        programmed : True for the programmed speed, or slower where the joints need it; False for the fastest

        Returns
        -------
        motion : timed within ``limits``; it passes through ``POINTS`` of the grid points at most
        """
        kept = np.unique(np.linspace(first, last, min(POINTS, last - first + 1)).round().astype(int))
        t, q = nodes_along(self.followed.joints, self.t[kept], self.q[kept], self.limits)
        return fastest(q, self.limits, t if programmed else None)


Strategy = Callable[[SingularSegment], Avoidance | Finding]


def coarse(t: Reals) -> Reals:
    """About ``POINTS`` of the times, evenly chosen, with both ends.

    Parameters
    ----------
    t : (N,), s

    Returns
    -------
    kept : (min(N, POINTS),) at most, s
    """
    kept: Reals = t[np.unique(np.linspace(0, len(t) - 1, min(POINTS, len(t))).round().astype(int))]
    return kept


def singular_segment(
    followed: Followed,
    near: NearSingular,
    limits: JointLimits,
    events: list[SingularEvent] | None = None,
    fixed_start: bool = False,
    allowed: JointLimits | None = None,
) -> SingularSegment:
    """What is to be avoided on a path, at its own grid points and at its events.

    Parameters
    ----------
    followed : the path, with the joints along it
    near : the distances that the path is to keep from the singular sets
    limits : of the joints' rates, to which motions are timed
    events : their times (s) join the grid, so that the nearest pose is among its points
    fixed_start : whether the joints at the start are given, or only the tool's pose
    allowed : what the joints can do, if motions are to be timed to less

    Returns
    -------
    segment : with times (N,) in s and joints (N, 6) in rad, manufacturer's angles, NaN where out of reach
    """
    inner = [event.t for event in events or [] if 0 < event.t < followed.t[-1]]
    t = np.unique(np.concatenate([followed.t, inner]))
    q = followed.q
    if len(t) > len(followed.t):
        new = ~np.isin(t, followed.t)
        q = np.empty((len(t), 6))
        q[~new], q[new] = followed.q, followed.joints(t[new])
    return SingularSegment(followed, t, q, near, limits, fixed_start, allowed)
