"""The tables of the workspace stage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.pipeline.tables import Table, Texts, column, lists, per_joint, vector

Singles = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Cells(Table):
    """Touched cells of the grid, and untouched ones inside the hull."""

    index: NDArray[np.int16] = vector("i{}", "index of the cell along x, y, z of the grid", dtype=np.int16)
    samples: Integers = column("samples in the cell", dtype=np.int64)
    first_block: NDArray[np.int32] = column("earliest block that touched the cell, -1 if none did", dtype=np.int32)
    void: NDArray[np.int32] = column(
        "number of the sampled void from 1, -1 in the hull but in no void, 0 touched", dtype=np.int32
    )


@dataclass(frozen=True, eq=False)
class SectionCells(Table):
    """Cells of the side section about axis 1 that were touched or are cut off by touched ones."""

    rho_m: Reals = column("distance of the cell's centre from axis 1", "m")
    z_m: Reals = column("height of the cell's centre along axis 1", "m")
    samples: Integers = column("samples in the cell, all azimuths", dtype=np.int64)
    void: Flags = column("whether touched cells cut it off", dtype=np.bool_)


@dataclass(frozen=True, eq=False)
class SideViewCells(Table):
    """Touched cells of the side views in the arm's plane."""

    x_m: Reals = column("middle of the cell to the front", "m")
    z_m: Reals = column("height of the cell's centre along axis 1", "m")
    cell_m: Reals = column("edge of the cell", "m")
    samples: Integers = column("samples in the cell", dtype=np.int64)
    point: Texts = column("tool_point or wrist_centre", dtype=object)


@dataclass(frozen=True, eq=False)
class GrowthCurve(Table):
    """Touched volume after each block of samples, at several cell sizes."""

    cell_mm: Reals = column("edge of the cells", "mm")
    samples: Integers = column("samples drawn so far", dtype=np.int64)
    touched_m3: Reals = column("volume of the touched cells", "m^3")


@dataclass(frozen=True, eq=False)
class Cloud(Table):
    """The first samples of each block."""

    point_m: Reals = vector("{}_m", "tool point in the base frame", "m")
    manipulability_m3: Reals = column("|det J|", "m^3")


@dataclass(frozen=True, eq=False)
class HullVertices(Table):
    """Corners of the convex hull."""

    point_m: Reals = vector("{}_m", "tool point in the base frame", "m")
    q_deg: Reals = per_joint("q{}_deg", "joint angle that reaches the corner", "deg")


@dataclass(frozen=True, eq=False)
class HullTriangles(Table):
    """Faces of the convex hull, counter-clockwise from outside."""

    corners: Integers = vector("{}", "row of the corner among the hull's vertices", parts="abc", dtype=np.int64)


@dataclass(frozen=True, eq=False)
class ProofCells(Table):
    """Cells of the proof: rings about axis 1, or bars along a first joint that slides (``proof.bars`` of the summary,
    with the frame); of these rho is x, and 360 deg are their length."""

    rho_m: Reals = vector("rho_{}_m", "inner and outer distance from axis 1", "m", parts="01")
    z_m: Reals = vector("z_{}_m", "lowest and highest height along axis 1", "m", parts="01")
    volume_m3: Reals = column("volume of the cell", "m^3")
    level: NDArray[np.int16] = column("how often the cell was split off", dtype=np.int16)
    status: Texts = column("filled, touched, empty, partly_filled or undecided", dtype=object)
    filled_ratio: Reals = column("ratio of the cell that is proven filled")
    empty_ratio: Reals = column("ratio of the cell that is proven empty")
    empty_arcs_deg: Texts = lists("ends of the azimuths that are proven empty", "deg")
    unfilled_arcs_deg: Texts = lists("ends of the azimuths that are not proven filled", "deg")
    q_deg: Reals = per_joint("q{}_deg", "joint angle that reaches into the cell, NaN if none is known", "deg")


@dataclass(frozen=True, eq=False)
class Border(Table):
    """Exact borders as arcs, with the joint values that make them."""

    rho_m: Reals = column("distance from axis 1; in a side view: x to the front", "m")
    z_m: Reals = column("height along axis 1", "m")
    q2_deg: Reals = column("joint 2", "deg")
    q3_deg: Reals = column("joint 3", "deg")
    tilt_deg: Reals = column("angle of the tool point's direction to axis 4", "deg")
    arc: Integers = column("number of the arc among those of its point and view", dtype=np.int64)
    point: Texts = column("tool_point, wrist_centre or flange", dtype=object)
    sweeps: Texts = column("what moves along the arc: joint_2, joint_3 or wrist", dtype=object)
    view: Texts = column("section (folded about axis 1) or side", dtype=object)


@dataclass(frozen=True, eq=False)
class Drawing(Table):
    """Labels of the manufacturer's drawing of the wrist centre's envelope: extents (one coordinate) and corners."""

    rho_m: Reals = column("distance from axis 1, NaN for heights", "m")
    x_m: Reals = column("the same, positive in front of axis 1", "m")
    z_m: Reals = column("height along axis 1, NaN for distances", "m")
    q2_deg: Reals = column("joint 2 at a corner, else NaN", "deg")
    q3_deg: Reals = column("joint 3 at a corner, else NaN", "deg")


@dataclass(frozen=True, eq=False)
class VoidVertices(Table):
    """Corners of the voids' surfaces."""

    point_m: Reals = vector("{}_m", "in the base frame", "m")
    void: NDArray[np.int32] = column("number of the void from 1, as in the summary", dtype=np.int32)


@dataclass(frozen=True, eq=False)
class VoidTriangles(Table):
    """Faces of the voids' surfaces."""

    corners: Integers = vector("{}", "row of the corner among those of its void", parts="abc", dtype=np.int64)
    void: NDArray[np.int32] = column("number of the void from 1, as in the summary", dtype=np.int32)


@dataclass(frozen=True, eq=False)
class CapabilityCells(Table):
    """Reached cells of the section, by sector of azimuth; or bars along a first joint that slides (``bar_m`` of the
    summary), of which rho is x, and 360 deg are their length."""

    rho_m: Reals = column("distance of the cell's centre from axis 1", "m")
    z_m: Reals = column("height of the cell's centre along axis 1", "m")
    azimuth_deg: Reals = column("the sector's middle; 0 for all azimuths if there is one sector", "deg")
    reachability: Singles = column(
        "ratio of the tool directions (tilts, turns; ``asked`` of the summary) that are reached", dtype=np.float32
    )
    solutions: Singles = column("mean number of solutions per reached direction", dtype=np.float32)
    most_solutions: NDArray[np.int8] = column("most solutions that any direction has", dtype=np.int8)
    manipulability_m3: Singles = column(
        "greatest |det J| of any reached pose; of arms with joints that slide less one m for each that places the tool",
        "m^3",
        dtype=np.float32,
    )
    reached_tries: NDArray[np.int16] = column("of the random poses tried there, those that are reached", dtype=np.int16)
    clear_tries: NDArray[np.int16] = column(
        "of these, those that an arm holds that touches neither the scene nor itself", dtype=np.int16
    )


@dataclass(frozen=True, eq=False)
class BoxPlaces(Table):
    """Positions of the box on the lattice that pass, the better of both turns at each."""

    centre_m: Reals = vector("{}_m", "middle of the box in the base frame", "m")
    turned: Flags = column("whether the box stands turned by 90 deg about z", dtype=np.bool_)
    slot: NDArray[np.int8] = column("number of the branch that serves it all, -1 if none does", dtype=np.int8)
    manipulability_m3: Singles = column("least |det J| over the box and its directions", "m^3", dtype=np.float32)
    limit_margin_deg: Singles = column("least distance of joints from the task's limits", "deg", dtype=np.float32)
    proven: Flags = column("whether every point and direction is proven", dtype=np.bool_)
