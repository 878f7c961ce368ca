"""Keep the path, and give up its speed where the joints can't keep it."""

from __future__ import annotations

import numpy as np

from er3a.pipeline.messages.language import N_, said
from er3a.planning.avoidance.singular_segment import Trouble, WayAround
from er3a.planning.timing import joined


def slow(trouble: Trouble) -> WayAround:
    """Follow the path exactly, as programmed wherever the joints can, slower where they can't."""
    if np.isnan(trouble.q[:, 0]).any():
        return WayAround("slow", None, 0.0, N_("a part of the path is out of reach"))
    if trouble.followed.jumps:
        jump = trouble.followed.jumps[0]
        reason = said("at t = {t:.4g} s the branch ends: J{joint} would have to jump", t=jump.t, joint=jump.joint)
        return WayAround("slow", None, 0.0, reason)
    return WayAround("slow", joined([*trouble.begin(), trouble.along(0, len(trouble.t) - 1)]))
