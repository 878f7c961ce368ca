"""The stage's tables, filled from what the library found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from er3a.kinematics.forward import forward, jacobian
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.workspace.model import (
    Border,
    BoxPlaces,
    CapabilityCells,
    Cells,
    Cloud,
    GrowthCurve,
    HullVertices,
    ProofCells,
    SectionCells,
    SideViewCells,
    VoidTriangles,
    VoidVertices,
)
from er3a.pipeline.tables import Texts
from er3a.robots.joint_limits import shown
from er3a.robots.robot import Robot
from er3a.sampling import tally
from er3a.sampling.tally import UNTOUCHED, Tally
from er3a.workspace.capability import Capability, ClearPoses
from er3a.workspace.placement import Places
from er3a.workspace.proven import Proven
from er3a.workspace.side_view import BorderLine, SideView
from er3a.workspace.voids import Hull, Void


def cells(tally: Tally, void_number: NDArray[np.int64]) -> Cells:
    """Touched cells, and untouched ones in the hull with the number of their void."""
    shown = (tally.counts > 0) | (void_number != 0)
    first = tally.first_block[shown]
    return Cells(
        index=np.argwhere(shown).astype(np.int16),
        samples=tally.counts[shown],
        first_block=np.where(first == UNTOUCHED, -1, first),
        void=void_number[shown].astype(np.int32),
    )


def section(found: tally.TouchedSection) -> SectionCells:
    """The side section."""
    return SectionCells(found.rho, found.z, found.samples, found.void)


def side_view(views: Sequence[SideView]) -> SideViewCells:
    """The side views, one after another."""
    return SideViewCells.stacked(
        SideViewCells(view.x, view.z, np.full(len(view.x), view.cell), view.samples, _repeated(view.point, len(view.x)))
        for view in views
    )


def curve(growth: Sequence[tally.Growth]) -> GrowthCurve:
    """Growth of the touched volume, one cell size after another."""
    return GrowthCurve.stacked(
        GrowthCurve(np.full(len(part.samples), part.cell * 1000), part.samples, part.volume) for part in growth
    )


def cloud(robot: Robot, q: Reals) -> Cloud:
    """Tool points of samples (n, joints), rad or m, and their manipulability: of arms with other than six joints the
    product of the singular values."""
    J = jacobian(robot, q)
    square = robot.joints == J.shape[-2]
    measure = np.abs(np.linalg.det(J)) if square else np.linalg.svd(J, compute_uv=False).prod(axis=-1)
    return Cloud(forward(robot, q)[:, :3, 3], measure)


def hull_vertices(robot: Robot, hull: Hull, q_extreme: Reals) -> HullVertices:
    """The hull's corners with the joint angles that reach them."""
    return HullVertices(hull.vertices, shown(robot, q_extreme[hull.of])).of_joints(robot.slides)


def proof(proven: Proven) -> ProofCells:
    """All cells of a proof."""
    found = proven.proof
    return ProofCells(
        rho_m=found.cells[:, :2],
        z_m=found.cells[:, 2:],
        volume_m3=found.volumes,
        level=found.level.astype(np.int16),
        status=_texts(proven.cell_states()),
        filled_ratio=1 - found.unfilled_ratio,
        empty_ratio=found.empty_ratio,
        empty_arcs_deg=_arcs(found.empty),
        unfilled_arcs_deg=_arcs(found.unfilled),
        q_deg=np.degrees(proven.witness),
    )


def border(lines: Sequence[BorderLine]) -> Border:
    """The points of border lines, one line after another."""
    return Border.stacked(
        Border(
            rho_m=line.points[:, 0],
            z_m=line.points[:, 1],
            q2_deg=np.degrees(line.q[:, 0]),
            q3_deg=np.degrees(line.q[:, 1]),
            tilt_deg=np.degrees(line.tilt),
            arc=np.full(len(line.tilt), line.number),
            point=_repeated(line.point, len(line.tilt)),
            sweeps=_repeated(line.sweeps, len(line.tilt)),
            view=_repeated(line.view, len(line.tilt)),
        )
        for line in lines
    )


def void_surfaces(voids: Sequence[Void]) -> tuple[VoidVertices, VoidTriangles]:
    """The surfaces of voids, numbered from 1."""
    numbered = list(enumerate(voids, start=1))
    return (
        VoidVertices.stacked(VoidVertices(void.vertices, np.full(len(void.vertices), n)) for n, void in numbered),
        VoidTriangles.stacked(VoidTriangles(void.triangles, np.full(len(void.triangles), n)) for n, void in numbered),
    )


def capability(middles: Reals, found: Capability, tried: ClearPoses, bars: bool) -> CapabilityCells:
    """Reached cells and sectors, in which poses were tried; ``middles`` (n, 2), m, are those of all cells, which are
    bars or rings."""
    cell, sector = np.nonzero(found.reachability)
    return CapabilityCells(
        reached_tries=tried.reached.astype(np.int16),
        clear_tries=tried.clear.astype(np.int16),
        rho_m=middles[cell, 0],
        z_m=middles[cell, 1],
        azimuth_deg=360.0 * (sector + (0.5 if bars else 0.0)) / found.reachability.shape[1],
        reachability=found.reachability[cell, sector].astype(np.float32),
        solutions=found.solutions[cell, sector].astype(np.float32),
        most_solutions=found.most_solutions[cell, sector].astype(np.int8),
        manipulability_m3=found.manipulability[cell, sector].astype(np.float32),
    )


def places(found: Places) -> BoxPlaces:
    """Positions of the box."""
    margin = np.where(np.isinf(found.limit_margin), np.nan, found.limit_margin)
    return BoxPlaces.of(found, manipulability_m3=found.least, limit_margin=margin)


def _repeated(text: str, count: int) -> Texts:
    return np.full(count, text, dtype=object)


def _texts(values: Sequence[str]) -> Texts:
    array = np.empty(len(values), dtype=object)
    array[:] = values
    return array


def _arcs(rows: Reals) -> Texts:
    """Arcs (n, arcs, 2), rad, unused ones NaN, as lists of their ends in deg."""
    array = np.empty(len(rows), dtype=object)
    array[:] = [np.degrees(row[np.isfinite(row[:, 0])]).ravel().tolist() for row in rows]
    return array
