"""The recording's part about what the tool can do: voxels by reachability, and the best places of the box."""

from __future__ import annotations

import numpy as np
import rerun as rr
from matplotlib import colormaps

from er3a.pipeline.stages.workspace.cell_lookup import CellLookup
from er3a.pipeline.stages.workspace.model import (
    CapabilityMissing,
    CapabilitySummary,
    PlacementSummary,
    WorkspaceResults,
)
from er3a.pipeline.stages.workspace.workspace_tables import CapabilityCells
from er3a.pipeline.viewing.palette import HIGHLIGHT, MUTED, rgb

_CLASSES = (0.0, 0.25, 0.5, 0.75, 1.0)
_NAMES = ("below_25_percent", "25_to_50_percent", "50_to_75_percent", "75_percent_and_more", "all")


def log_capability(stream: rr.RecordingStream, results: WorkspaceResults) -> None:
    """Log voxels coloured by reachability, by halves and classes of it, and the best places."""
    capability, placement = results.summary.capability, results.summary.placement
    if isinstance(capability, CapabilityMissing):
        return
    if len(results.capability):
        _log_voxels(stream, capability, results.capability)
    places = placement.places if isinstance(placement, PlacementSummary) else ()
    for number, place in enumerate(places, start=1):
        box = rr.Boxes3D(
            centers=[place.centre_m],
            sizes=[place.size_m],
            colors=[rgb(HIGHLIGHT if place.status == "proven" else MUTED)],
            labels=[str(number)],
            radii=rr.Radius.ui_points(1.5),
        )
        stream.log(f"workspace/places/{number}", box, static=True)


def _log_voxels(stream: rr.RecordingStream, capability: CapabilitySummary, cells: CapabilityCells) -> None:
    lookup = CellLookup(capability, cells)
    axes, cell = np.array(capability.frame.axes), lookup.cell
    count = int(np.ceil(lookup.reach / cell))
    line = (np.arange(-count, count) + 0.5) * cell
    height = np.arange(lookup.heights[0] + cell / 2, lookup.heights[1], cell)
    along = np.arange(cell / 2, capability.bar_m, cell) if lookup.bars else line
    x, y, z = (part.ravel() for part in np.meshgrid(line, along, height, indexing="ij"))
    row = lookup.row(x, y, z) if lookup.bars else lookup.row(np.hypot(x, y), np.arctan2(y, x), z)
    reached = row >= 0
    value, local = cells.reachability[row[reached]], np.stack([x, y, z], axis=1)[reached]
    colours = (colormaps["viridis"](value)[:, :3] * 255).astype(np.uint8)
    far = (local @ axes)[:, 1] >= (float(local[:, 1].mean()) if lookup.bars else 0.0)
    level = np.digitize(value, _CLASSES[1:])
    placed = rr.Transform3D(translation=capability.frame.origin_m, mat3x3=axes.T)
    stream.log("workspace/capability", placed, static=True)
    for half, side in (("far", far), ("near", ~far)):
        for number, name in enumerate(_NAMES):
            chosen = side & (level == number)
            if chosen.any():
                voxels = rr.Boxes3D(
                    centers=local[chosen],
                    half_sizes=np.full((chosen.sum(), 3), cell / 2),
                    colors=colours[chosen],
                    fill_mode="solid",
                )
                stream.log(f"workspace/capability/{half}/{name}", voxels, static=True)
