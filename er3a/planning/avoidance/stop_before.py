"""Stop before the singular region, with an alarm."""

from __future__ import annotations

from er3a.planning.avoidance.avoidance_findings import BeginsInRegion, NoSingularRegion, NotPossible
from er3a.planning.avoidance.singular_segment import Avoidance, SingularSegment
from er3a.planning.timing import joined


def stop(segment: SingularSegment) -> Avoidance | NotPossible:
    """Follow the path exactly, and come to rest at the last pose that keeps its distance."""
    if not segment.regions:
        return NoSingularRegion()
    last = segment.regions[0][0] - 1
    if last < 1:
        return BeginsInRegion()
    motion = joined([*segment.begin(), segment.along(0, last)])
    return Avoidance(motion, done=float(segment.followed.line.progress(segment.t[last])[0]))
