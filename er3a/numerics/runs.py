"""Stretches of a sequence."""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Flags


def runs(flags: Flags) -> list[tuple[int, int]]:
    """Index ranges (first, behind the last) of the stretches of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
