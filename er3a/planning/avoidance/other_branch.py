"""Take another solution of the arm before the region: one for which the path is not singular there."""

from __future__ import annotations

import numpy as np

from er3a.errors import PoseError
from er3a.kinematics.closed_form import SLOTS
from er3a.numerics.arrays import Reals
from er3a.planning.avoidance.avoidance_findings import NoOtherBranch, NothingToAvoid, NotPossible
from er3a.planning.avoidance.singular_segment import Avoidance, SingularSegment, coarse, singular_segment
from er3a.planning.follow import follow
from er3a.planning.followed import Followed
from er3a.planning.timing import joined, straight
from er3a.robots.joint_limits import within

COARSE = 201


def branch(segment: SingularSegment) -> Avoidance | NotPossible:
    """Change to another branch by a joint move at rest, and follow the rest of the path on it.

    A change before the path begins is preferred: where only the tool's pose is given there, the arm may as well begin
    on that branch. Else the change is made at the last good pose. Of the branches on which the rest keeps its distance
    within the limits, the one nearest in joint travel is taken.
    """
    bad = ~(segment.good & within(segment.robot, segment.q))
    if not bad.any():
        return NothingToAvoid()
    few = np.linspace(0.0, segment.followed.line.duration, COARSE)
    others = [_follow(segment, slot, few) for slot in range(SLOTS) if slot != segment.followed.slot[0]]
    begin = max(int(np.argmax(bad)) - 1, 0)
    for index in sorted({0, begin}):
        leave = segment.first_joints if index == 0 else segment.q[index]
        found = []
        for other in others:
            if other is not None and _keeps_clear(segment, other, segment.t[index]):
                step = other.joints(segment.t[index : index + 1])[0] - leave
                found.append((float(np.abs(step / segment.limits.speed).max()), int(other.slot[0])))
        for _, slot in sorted(found):
            times = np.union1d(coarse(segment.t), segment.t[index])
            other = _follow(segment, slot, times)
            if other is not None and _keeps_clear(segment, other, segment.t[index]):
                return _changed(segment, other, index, leave)
    return NoOtherBranch()


def _follow(segment: SingularSegment, slot: int, t: Reals) -> Followed | None:
    try:
        return follow(segment.robot, segment.followed.line, t, start_slot=slot)
    except PoseError:
        return None


def _keeps_clear(segment: SingularSegment, other: Followed, start: float) -> bool:
    rest = other.q[np.searchsorted(other.t, start) :]
    if other.jumps or np.isnan(rest[:, 0]).any() or not within(segment.robot, rest).all():
        return False
    return bool(segment.near.margin(segment.robot, rest).min() >= 1.0)


def _changed(segment: SingularSegment, followed: Followed, index: int, leave: Reals) -> Avoidance:
    other = singular_segment(followed, segment.near, segment.limits)
    at = int(np.searchsorted(other.t, segment.t[index]))
    before = [*segment.begin(), segment.along(0, index)] if index > 0 else []
    waits = index == 0 and not segment.fixed_start
    change = [] if waits else [straight(leave, other.q[at], segment.limits)]
    return Avoidance(joined([*before, *change, other.along(at, len(other.t) - 1)]))
