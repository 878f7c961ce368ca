"""The tray where the workspace stage puts it: which motions pass through it, or through what it stands on."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from markupsafe import Markup

from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.language import tr
from er3a.pipeline.player.player import moment
from er3a.pipeline.results import Stored, is_computed, read_stage
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.workspace.model import PlacementSummary


def placed_tray(workspace: Any) -> tuple[Reals, Reals] | None:
    """Lower and upper corner (3,) in mm of the tray, with the stand that it needs; None if these results put none."""
    placement = getattr(workspace.summary, "placement", None)
    if not isinstance(placement, PlacementSummary) or not placement.named_places:
        return None
    centre, size = (1000 * np.array(each) for each in (placement.best.centre_m, placement.best.size_m))
    low, high = centre - size / 2, centre + size / 2
    if placement.stand is None and placement.over:
        low[2] = min(low[2], 1000 * placement.over.height_m)
    return low, high


def in_tray(stored: Stored[Any], motions: Iterable[tuple[str, Reals, Reals]]) -> dict[str, Markup] | None:
    """Of each motion (name, times in s, tool points in mm) that enters the tray when it first does, as a link to that
    moment; None where the robot's workspace stage puts no tray."""
    folder = stored.folder.parent / "workspace" if stored.folder else None
    tray = placed_tray(read_stage(folder, STAGES["workspace"]).results) if folder and is_computed(folder) else None
    if tray is None:
        return None
    firsts = {name: first_inside(t, points, *tray) for name, t, points in motions}
    return {name: moment(name, t, tr("in the tray at {t:.2f} s", t=t)) for name, t in firsts.items() if t is not None}


def first_inside(t: Reals, points: Reals, low: Reals, high: Reals) -> float | None:
    """When a point that moves straight from each of ``points`` (n, 3) at ``t`` (n,) to the next enters a box first.

    ``low``, ``high``: (3,), the box's corners. None if it never does.
    """
    way = np.diff(points, axis=0, append=points[-1:])
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([low - points, high - points]) / way
    ends = np.sort(np.where(np.isnan(ends), [[[-np.inf]], [[np.inf]]], ends), axis=0)  # 0/0: along a face
    enters, leaves = np.maximum(ends[0].max(axis=1), 0), np.minimum(ends[1].min(axis=1), 1)
    (hits,) = np.nonzero((enters <= leaves) & np.isfinite(points + way).all(axis=1))
    if not len(hits):
        return None
    row = hits[0]
    return float(t[row] + enters[row] * (t[min(row + 1, len(t) - 1)] - t[row]))
