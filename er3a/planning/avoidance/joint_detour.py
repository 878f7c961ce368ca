"""Cross the region by a joint move: the tool leaves the path, the joints do not notice the singularity."""

from __future__ import annotations

import numpy as np

from er3a.pipeline.messages.language import N_
from er3a.planning.avoidance.singular_segment import Trouble, WayAround
from er3a.planning.timing import joined, straight


def detour(trouble: Trouble) -> WayAround:
    """Follow the path up to the last good pose, move the joints to the next good one, and go on, at every region.

    Where the path begins or ends inside a region, its first or last joints take the place of the good pose.
    """
    if not trouble.regions:
        return WayAround("detour", None, 0.0, N_("there is no singular region to go around"))
    count, parts, at = len(trouble.t), [], 0
    for first, last in trouble.regions:
        before, after = max(first - 1, 0), min(last, count - 1)
        for index, reason in ((before, N_("the path begins out of reach")), (after, N_("the path ends out of reach"))):
            if np.isnan(trouble.q[index, 0]):
                return WayAround("detour", None, 0.0, reason)
        if before > at:
            parts += [*(trouble.begin() if at == 0 else []), trouble.along(at, before)]
        leave = trouble.q[before] if before > 0 else trouble.first_joints
        parts.append(straight(leave, trouble.q[after], trouble.limits))
        at = after
    if at < count - 1:
        parts.append(trouble.along(at, count - 1))
    return WayAround("detour", joined(parts))
