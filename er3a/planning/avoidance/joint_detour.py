"""Cross the region by a joint move: the tool leaves the path, the joints do not notice the singularity."""

from __future__ import annotations

import numpy as np

from er3a.planning.avoidance.avoidance_findings import BeginsOutOfReach, EndsOutOfReach, NoSingularRegion, NotPossible
from er3a.planning.avoidance.singular_segment import Avoidance, SingularSegment
from er3a.planning.timing import Timed, joined, straight


def detour(segment: SingularSegment) -> Avoidance | NotPossible:
    """Follow the path up to the last good pose, move the joints to the next good one, and go on, at every region.

    Where the path begins or ends inside a region, its first or last joints take the place of the good pose.
    """
    if not segment.regions:
        return NoSingularRegion()
    count, at = len(segment.t), 0
    parts: list[Timed] = []
    for first, last in segment.regions:
        before, after = max(first - 1, 0), min(last, count - 1)
        if np.isnan(segment.q[before, 0]):
            return BeginsOutOfReach()
        if np.isnan(segment.q[after, 0]):
            return EndsOutOfReach()
        if before > at:
            parts += [*(segment.begin() if at == 0 else []), segment.along(at, before)]
        leave = segment.q[before] if before > 0 else segment.first_joints
        parts.append(straight(leave, segment.q[after], segment.limits))
        at = after
    if at < count - 1:
        parts.append(segment.along(at, count - 1))
    return Avoidance(joined(parts))
