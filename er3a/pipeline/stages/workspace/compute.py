"""Workspace: gather the samples' tally and work out hull, volumes and voids."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy import ndimage

from er3a.kinematics.forward import forward, jacobian
from er3a.pipeline.messages.language import N_, keeps_sentences
from er3a.pipeline.results import Figure, write_summary, write_table
from er3a.pipeline.stages.workspace.capability_numbers import can_do
from er3a.pipeline.stages.workspace.envelope_marks import drawing_table
from er3a.pipeline.stages.workspace.parts import gather
from er3a.pipeline.stages.workspace.proof_results import (
    count_in_empty,
    find_proven_voids,
    pocket_block,
    proof_table,
    prove_robot,
)
from er3a.pipeline.stages.workspace.sample import draw_of, sampled
from er3a.pipeline.stages.workspace.verdict import judge
from er3a.pipeline.study import Study
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid, make_grid
from er3a.sampling.random_joints import Draw
from er3a.sampling.reach_search import reach_figures
from er3a.sampling.tally import UNTOUCHED, Tally
from er3a.workspace.hull import Hull, cells_inside, convex_hull
from er3a.workspace.sampled_voids import Voids, find_voids, shape_of, unseen_cells
from er3a.workspace.side_view import border_table, side_view_table

COARSER = (1, 2, 4)
SECTION_VOID_CELLS = 16
UNLISTED = -1


@keeps_sentences
def compute(study: Study, name: str, folder: Path, parts: list[Path] | None = None) -> None:
    """Write tables and ``summary.json`` of a robot's workspace into ``folder``.

    Parameters
    ----------
    parts : part files that hold each block of the study once; None to sample here and now

    Raises
    ------
    ResultError
        naming the part file that is damaged, foreign or one too many
    InputError
        if the grid does not fit into memory
    """
    robot, settings = study.robot(name), study.workspace
    grid = make_grid(robot, settings.cells_across)
    if parts is None:
        tally = sampled(study, robot, grid, range(settings.blocks))
    else:
        tally = gather([Path(part) for part in parts], study, robot)
    draw = draw_of(study)
    q_extreme = draw.joints(robot, tally.extremes.block, tally.extremes.sample)
    hull = convex_hull(forward(robot, q_extreme)[:, :3, 3])
    inside = cells_inside(hull, grid)
    voids = find_voids(tally.counts, inside)
    q_cloud = _cloud_joints(robot, draw, settings.cloud_points)
    shoulder = _shoulder(robot, grid)
    proven = prove_robot(robot, settings.proof_cells, settings.volume_points, study.seed)
    records, vertices, triangles = find_proven_voids(robot, proven, hull, shoulder)
    if proven.arm is None:
        records += _sampled_records(voids, grid, shoulder, records)
    write_table(folder / "proof.parquet", proof_table(proven))
    write_table(folder / "border.parquet", border_table(robot))
    height = float((shoulder - grid.axis_point) @ grid.axis)
    write_table(folder / "drawing.parquet", drawing_table(robot, height))
    write_table(folder / "void_vertices.parquet", vertices)
    write_table(folder / "void_triangles.parquet", triangles)

    doing = can_do(robot, study.capability, grid.cell)
    for table_name, table in doing.tables.items():
        write_table(folder / f"{table_name}.parquet", table)

    write_table(folder / "cells.parquet", _cells(tally, inside, voids))
    write_table(folder / "section.parquet", _section(tally, grid))
    write_table(folder / "side_view.parquet", side_view_table(robot, tally, grid, draw))
    write_table(folder / "curve.parquet", _curve(draw, tally, grid))
    write_table(folder / "cloud.parquet", _cloud(robot, q_cloud))
    _write_hull(folder, hull, q_extreme)

    cells = {"touched": int((tally.counts > 0).sum()), "inside_hull": int(inside.sum())}
    cells["touched_inside_hull"] = int(((tally.counts > 0) & inside).sum())
    unseen = unseen_cells(tally.counts)
    reach = reach_figures(robot, grid, np.concatenate([q_extreme, q_cloud]))
    filled = cells["touched_inside_hull"] / cells["inside_hull"] if cells["inside_hull"] else None
    lower, upper = proven.proof.bounds
    enclosed = [record["volume_m3"] for record in records if record["kind"] == "enclosed"]
    touched = cells["touched"] * grid.cell_volume
    guess = proven.estimate
    figures = [
        Figure(N_("greatest reach from axis 1"), reach["furthest_from_axis"] * 1000, "mm"),
        Figure(N_("enclosed voids, at least"), 1000 * sum(volume["lower"] for volume in enclosed), "L"),
        Figure(N_("reached volume"), guess.value, "m³", max(guess.value - guess.low, guess.high - guess.value)),
        Figure(N_("reached volume, at least"), lower, "m³"),
        Figure(N_("reached volume, at most"), upper, "m³"),
        Figure(N_("convex hull"), hull.volume, "m³"),
        Figure(N_("least distance from axis 1"), reach["nearest_to_axis"] * 1000, "mm"),
        Figure(N_("samples"), settings.samples, ""),
    ]
    write_summary(
        folder,
        study,
        name,
        "workspace",
        judge(hull, records, cells, unseen, proven.arm is not None),
        figures,
        samples=settings.samples,
        sampling=settings.sampling,
        volume_m3={"lower": lower, "upper": upper, "estimate": guess.value, "ci95": [guess.low, guess.high]},
        volume_points={"drawn": guess.points, "reached": guess.reached, "undecided": guess.undecided},
        touched_m3=touched,
        proof={
            "method": proven.method,
            "cells": len(proven.proof.cells),
            "width": proven.proof.width,
            "points_checked": len(q_extreme) + len(q_cloud),
            "points_in_empty_cells": count_in_empty(
                proven, forward(robot, np.concatenate([q_extreme, q_cloud]))[:, :3, 3]
            ),
        },
        hull={
            "volume_m3": hull.volume,
            "area_m2": hull.area,
            "directions": settings.hull_directions,
            "vertices": len(hull.vertices),
            "touched_share": filled,
        },
        reach_m=reach,
        grid={"origin_m": grid.origin.tolist(), "cell_m": grid.cell, "shape": list(grid.shape)},
        axis={"point_m": grid.axis_point.tolist(), "direction": grid.axis.tolist(), "shoulder_m": shoulder.tolist()},
        section_cell_m=grid.section_cell,
        cells={**cells, "unseen_estimate": unseen},
        voids=records,
        pocket_block_m=pocket_block(proven),
        specks={"count": voids.specks, "volume_m3": voids.speck_cells * grid.cell_volume},
        skin_m3=voids.skin_cells * grid.cell_volume,
        **doing.summary,
    )


def _cloud_joints(robot: Robot, draw: Draw, points: int) -> np.ndarray:
    """The first samples of each block, drawn again: (n, 6)."""
    wanted = Draw(draw.seed, min(points, draw.samples), draw.blocks).sizes
    blocks = np.repeat(np.arange(draw.blocks), wanted)
    samples = np.concatenate([np.arange(count) for count in wanted])
    return draw.joints(robot, blocks, samples)


def _cloud(robot: Robot, q: np.ndarray) -> pd.DataFrame:
    points = forward(robot, q)[:, :3, 3]
    table = pd.DataFrame(points, columns=["x_m", "y_m", "z_m"])
    return table.assign(manipulability_m3=np.abs(np.linalg.det(jacobian(robot, q))))


def _cells(tally: Tally, inside: np.ndarray, voids: Voids) -> pd.DataFrame:
    """Touched cells, and untouched ones in the hull with the number of their void (from 1; -1: speck or skin)."""
    number = np.where(inside & (tally.counts == 0), UNLISTED, 0)
    for n, void in enumerate(voids.listed, start=1):
        number[tuple(void.cells.T)] = n
    shown = (tally.counts > 0) | (number != 0)
    table = pd.DataFrame(np.argwhere(shown).astype(np.int16), columns=["ix", "iy", "iz"])
    first = tally.first_block[shown]
    return table.assign(
        samples=tally.counts[shown],
        first_block=np.where(first == UNTOUCHED, -1, first),
        void=number[shown].astype(np.int32),
    )


def _section(tally: Tally, grid: Grid) -> pd.DataFrame:
    """Cells of the side section that were touched, or are cut off by touched ones (the axis counts as a wall)."""
    padded = np.pad(tally.section == 0, ((0, 1), (1, 1)), constant_values=True)
    labels, _ = ndimage.label(padded)
    sizes = np.bincount(labels.ravel())
    is_void = (sizes >= SECTION_VOID_CELLS) & (np.arange(len(sizes)) != labels[-1, 0])
    is_void[0] = False
    void = is_void[labels][:-1, 1:-1]
    shown = (tally.section > 0) | void
    index = np.argwhere(shown)
    rho, z = (grid.section_origin + (index + 0.5) * grid.section_cell).T
    return pd.DataFrame({"rho_m": rho, "z_m": z, "samples": tally.section[shown], "void": void[shown]})


def _curve(draw: Draw, tally: Tally, grid: Grid) -> pd.DataFrame:
    """Touched volume after each block, at several cell sizes."""
    drawn = np.cumsum(draw.sizes)
    tables = []
    for factor in COARSER:
        first = tally.first_block
        padding = [(0, -size % factor) for size in first.shape]
        first = np.pad(first, padding, constant_values=UNTOUCHED)
        nx, ny, nz = (size // factor for size in first.shape)
        first = first.reshape(nx, factor, ny, factor, nz, factor).min(axis=(1, 3, 5))
        cells = np.cumsum(np.bincount(first[first != UNTOUCHED], minlength=len(drawn)))
        cell = grid.cell * factor
        tables.append(pd.DataFrame({"cell_mm": cell * 1000, "samples": drawn, "touched_m3": cells * cell**3}))
    return pd.concat(tables, ignore_index=True)


def _write_hull(folder: Path, hull: Hull, q_extreme: np.ndarray) -> None:
    """Vertices with the joint angles that reach them, and triangles as row numbers of the vertices."""
    vertices = pd.DataFrame(hull.vertices, columns=["x_m", "y_m", "z_m"])
    for k, angles in enumerate(np.degrees(q_extreme[hull.of]).T, start=1):
        vertices[f"q{k}_deg"] = angles
    write_table(folder / "hull_vertices.parquet", vertices)
    write_table(folder / "hull_triangles.parquet", pd.DataFrame(hull.triangles, columns=["a", "b", "c"]))


def _shoulder(robot: Robot, grid: Grid) -> np.ndarray:
    """The point of axis 1 at the height of joint 2: (3,), m."""
    joint_2 = forward(robot, np.zeros(6), frame=1)[:3, 3]
    return grid.axis_point + ((joint_2 - grid.axis_point) @ grid.axis) * grid.axis


def _sampled_records(
    voids: Voids, grid: Grid, shoulder: np.ndarray, proven: list[dict[str, Any]]
) -> list[dict[str, Any]]:
    """Voids that only the samples tell of: those that lie in no proven one's box."""
    cell_of_shoulder = np.floor((shoulder - grid.origin) / grid.cell)
    return [
        {
            "kind": void.kind,
            "status": N_("undersampled"),
            "volume_m3": {"lower": 0.0, "upper": len(void.cells) * grid.cell_volume},
            **shape_of(void, grid),
            "cause": N_("unknown: only samples tell of it"),
            "relaxed": [],
            "holds_shoulder": bool(np.any(np.all(np.abs(void.cells - cell_of_shoulder) <= 1, axis=1))),
        }
        for void in voids.listed
        if not any(_in_box(shape_of(void, grid)["centroid_m"], record) for record in proven)
    ]


def _in_box(point: list[float], record: dict[str, Any]) -> bool:
    away = np.abs(np.array(point) - record["centroid_m"])
    return bool((away <= np.array(record["extent_m"]) / 2).all())
