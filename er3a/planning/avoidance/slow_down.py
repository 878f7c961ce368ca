"""Keep the path, and give up its speed where the joints can't keep it."""

from __future__ import annotations

import numpy as np

from er3a.planning.avoidance.avoidance_findings import BranchEnds, NotPossible, PartlyOutOfReach
from er3a.planning.avoidance.singular_segment import Avoidance, SingularSegment
from er3a.planning.timing import joined


def slow(segment: SingularSegment) -> Avoidance | NotPossible:
    """Follow the path exactly, as programmed wherever the joints can, slower where they can't."""
    if np.isnan(segment.q[:, 0]).any():
        return PartlyOutOfReach()
    if segment.followed.jumps:
        jump = segment.followed.jumps[0]
        return BranchEnds(jump.t, jump.joint)
    return Avoidance(joined([*segment.begin(), segment.along(0, len(segment.t) - 1)]))
