"""Voids inside the hull: what the proof finds empty, and what only samples tell of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid
from er3a.workspace.blocks import Blocks, blocks_of, mesh, pockets
from er3a.workspace.causes import OnlySampled, Relaxed, Unlimited, VoidCause, cause_of, relaxations
from er3a.workspace.cavities import Cavity, cavities
from er3a.workspace.hull import Hull, inside_hull
from er3a.workspace.proven import Proven
from er3a.workspace.sampled_voids import SampledVoid, VoidKind

POCKET_BLOCKS, TURNS = 64, 180
MESH_BLOCKS, MESH_TURNS = 24, 72
_SPECK_M3 = 1e-9


@dataclass(frozen=True, eq=False)
class Void:
    """A void inside the hull, in the base frame.

    Attributes
    ----------
    status : whether the lower volume is proven empty, or only samples tell of the void
    lower, upper : bounds of its volume, m^3
    centroid, extent : (3,), m
    relaxed : what of it is reached with each limit widened; none if only samples tell of it
    holds_shoulder : whether it holds the point of axis 1 at the height of joint 2
    vertices, triangles : (V, 3), m, and (F, 3), its surface; none if only samples tell of it
    """

    kind: VoidKind
    status: Literal["proven_empty", "undersampled"]
    lower: float
    upper: float
    centroid: Reals
    extent: Reals
    cause: VoidCause
    relaxed: tuple[Relaxed | Unlimited, ...]
    holds_shoulder: bool
    vertices: Reals
    triangles: Integers


def proven_voids(robot: Robot, proven: Proven, hull: Hull, shoulder: Reals) -> list[Void]:
    """Voids that the proof finds inside the hull, the largest first."""
    enclosed, outside = cavities(proven.section)
    found = [
        _void("enclosed", robot, proven, cavity, shoulder, _outline(proven, cavity))
        for cavity in enclosed
        if cavity.lower > _SPECK_M3
    ]
    blocks = _pocket_blocks(proven, outside)
    inside = blocks.empty > 0.5
    inside[inside] = inside_hull(hull, proven.in_base(blocks.points()[inside]))
    for mask in pockets(blocks, inside):
        found.append(_void("open", robot, proven, _as_cavity(blocks, mask), shoulder, (blocks, mask)))
    return sorted(found, key=lambda void: -void.lower)


def sampled_only(voids: list[SampledVoid], grid: Grid, shoulder: Reals, proven: list[Void]) -> list[Void]:
    """Voids that only the samples tell of: those that lie in no proven one's box."""
    cell_of_shoulder = np.floor((shoulder - grid.origin) / grid.cell)
    found = []
    for void in voids:
        centroid = void.centroid(grid)
        if any((np.abs(centroid - other.centroid) <= other.extent / 2).all() for other in proven):
            continue
        near = np.all(np.abs(void.cells - cell_of_shoulder) <= 1, axis=1)
        found.append(
            Void(
                kind=void.kind,
                status="undersampled",
                lower=0.0,
                upper=len(void.cells) * grid.cell_volume,
                centroid=centroid,
                extent=void.extent(grid),
                cause=OnlySampled(),
                relaxed=(),
                holds_shoulder=bool(np.any(near)),
                vertices=np.empty((0, 3)),
                triangles=np.empty((0, 3), np.int64),
            )
        )
    return found


def _void(
    kind: VoidKind, robot: Robot, proven: Proven, cavity: Cavity, shoulder: Reals, surface: tuple[Blocks, Flags]
) -> Void:
    single, unlimited = relaxations(
        robot, cavity, None if proven.arm is not None else (proven.in_section, proven.in_base)
    )
    low, high = cavity.box()
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    extent = np.ptp(proven.in_base(corners), axis=0)
    size, (rho, _, z) = proven.section.size, (float(part[0]) for part in proven.in_section(shoulder[None]))
    near = (cavity.cells[:, [0, 2]] <= [rho + size, z + size]).all(axis=1)
    near &= (cavity.cells[:, [1, 3]] >= [rho - size, z - size]).all(axis=1)
    vertices, triangles = mesh(*surface)
    return Void(
        kind=kind,
        status="proven_empty",
        lower=cavity.lower,
        upper=cavity.upper,
        centroid=proven.in_base(cavity.centroid()) + 0.0,
        extent=extent,
        cause=cause_of(single, unlimited),
        relaxed=(*single, unlimited),
        holds_shoulder=bool(near.any()),
        vertices=proven.in_base(vertices),
        triangles=triangles,
    )


def _outline(proven: Proven, cavity: Cavity) -> tuple[Blocks, Flags]:
    """A void on blocks fine enough to show its shape."""
    low, high = cavity.cells[:, [0, 2]].min(axis=0), cavity.cells[:, [1, 3]].max(axis=0)
    root = proven.section.size * 2 ** int(proven.proof.level.max())
    size = root
    while size > (high - low).max() / MESH_BLOCKS and size > 1.5 * proven.section.size:
        size /= 2
    low = proven.section.low + np.floor((low - proven.section.low) / size + 1e-6) * size
    high = proven.section.low + np.ceil((high - proven.section.low) / size - 1e-6) * size
    blocks = blocks_of(cavity, size, low, high, MESH_TURNS)
    mask = blocks.empty > 0.5
    return blocks, mask if mask.any() else blocks.empty > 0


def pocket_block(proven: Proven) -> float:
    """Edge (m) of the blocks that open pockets are looked for on."""
    cells = proven.proof.cells
    low, high = cells[:, [0, 2]].min(axis=0), cells[:, [1, 3]].max(axis=0)
    size = float((cells[:, 1] - cells[:, 0]).max())
    while 2 * size < 1.01 * (high - low).max() / POCKET_BLOCKS:
        size *= 2
    while size > 1.01 * (high - low).max() / POCKET_BLOCKS and size > 1.5 * proven.section.size:
        size /= 2
    return size


def _pocket_blocks(proven: Proven, outside: Cavity) -> Blocks:
    cells, size = proven.proof.cells, pocket_block(proven)
    low, high = cells[:, [0, 2]].min(axis=0), cells[:, [1, 3]].max(axis=0)
    return blocks_of(outside, size, low, low + np.ceil((high - low) / size - 1e-6) * size, TURNS)


def _as_cavity(blocks: Blocks, mask: Flags) -> Cavity:
    """Blocks as arcs of cells."""
    i, j, k = np.nonzero(mask)
    cells = np.stack([blocks.rho[i], blocks.rho[i + 1], blocks.z[j], blocks.z[j + 1]], axis=1)
    arcs = np.stack([blocks.azimuth[k], blocks.azimuth[k + 1]], axis=1)
    # A block that is only partly open counts with what of it is not filled; its empty share is of that part.
    unfilled = blocks.unfilled[i, j, k]
    width = (arcs[:, 1] - arcs[:, 0]) * unfilled
    middle = arcs.mean(axis=1)
    arcs = np.stack([middle - width / 2, middle + width / 2], axis=1)
    return Cavity(False, cells, arcs, np.minimum(1.0, blocks.empty[i, j, k] / unfilled), blocks.bar)
