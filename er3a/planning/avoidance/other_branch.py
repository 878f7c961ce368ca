"""Take another solution of the arm before the region: one for which the path is not singular there."""

from __future__ import annotations

import numpy as np

from er3a.errors import PoseError
from er3a.kinematics.closed_form import SLOTS
from er3a.pipeline.messages.language import N_
from er3a.planning.avoidance.singular_segment import Trouble, WayAround, coarse, margin, trouble_of
from er3a.planning.follow import follow
from er3a.planning.followed import Followed
from er3a.planning.timing import joined, straight
from er3a.robots.joint_limits import within

COARSE = 201


def branch(trouble: Trouble) -> WayAround:
    """Change to another branch by a joint move at rest, and follow the rest of the path on it.

    A change before the path begins is preferred: where only the tool's pose is given there, the arm may as well begin
    on that branch. Else the change is made at the last good pose. Of the branches on which the rest keeps its distance
    within the limits, the one nearest in joint travel is taken.
    """
    bad = ~(trouble.good & within(trouble.robot, trouble.q))
    if not bad.any():
        return WayAround("branch", None, 0.0, N_("there is nothing to avoid"))
    few = np.linspace(0.0, trouble.followed.line.duration, COARSE)
    others = [_follow(trouble, slot, few) for slot in range(SLOTS) if slot != trouble.followed.slot[0]]
    begin = max(int(np.argmax(bad)) - 1, 0)
    for index in sorted({0, begin}):
        leave = trouble.first_joints if index == 0 else trouble.q[index]
        found = []
        for other in others:
            if other is not None and _keeps_clear(trouble, other, trouble.t[index]):
                step = other.joints(trouble.t[index : index + 1])[0] - leave
                found.append((float(np.abs(step / trouble.limits.speed).max()), int(other.slot[0])))
        for _, slot in sorted(found):
            times = np.union1d(coarse(trouble.t), trouble.t[index])
            other = _follow(trouble, slot, times)
            if _keeps_clear(trouble, other, trouble.t[index]):
                return _changed(trouble, other, index, leave)
    reason = N_("the other branches are singular, beyond a limit or out of reach there too")
    return WayAround("branch", None, 0.0, reason)


def _follow(trouble: Trouble, slot: int, t: np.ndarray) -> Followed | None:
    try:
        return follow(trouble.robot, trouble.followed.line, t, start_slot=slot)
    except PoseError:
        return None


def _keeps_clear(trouble: Trouble, other: Followed, start: float) -> bool:
    rest = other.q[np.searchsorted(other.t, start) :]
    if other.jumps or np.isnan(rest[:, 0]).any() or not within(trouble.robot, rest).all():
        return False
    return bool(margin(trouble.robot, rest, trouble.near).min() >= 1.0)


def _changed(trouble: Trouble, followed: Followed, index: int, leave: np.ndarray) -> WayAround:
    other = trouble_of(followed, trouble.near, trouble.limits)
    at = int(np.searchsorted(other.t, trouble.t[index]))
    before = [*trouble.begin(), trouble.along(0, index)] if index > 0 else []
    waits = index == 0 and not trouble.fixed_start
    change = [] if waits else [straight(leave, other.q[at], trouble.limits)]
    return WayAround("branch", joined([*before, *change, other.along(at, len(other.t) - 1)]))
