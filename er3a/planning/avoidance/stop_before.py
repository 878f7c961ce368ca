"""Stop before the singular region, with an alarm."""

from __future__ import annotations

from er3a.pipeline.messages.language import N_
from er3a.planning.avoidance.singular_segment import Trouble, WayAround
from er3a.planning.timing import joined


def stop(trouble: Trouble) -> WayAround:
    """Follow the path exactly, and come to rest at the last pose that keeps its distance."""
    if not trouble.regions:
        return WayAround("stop", None, 0.0, N_("there is no singular region to stop at"))
    last = trouble.regions[0][0] - 1
    if last < 1:
        return WayAround("stop", None, 0.0, N_("the path begins inside the region"))
    motion = joined([*trouble.begin(), trouble.along(0, last)])
    done = float(trouble.followed.line.progress(trouble.t[last])[0])
    return WayAround("stop", motion, done)
