"""The proof's part of the stage: tables of cells, voids, meshes and the border, and the records of the summary."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd

from er3a.errors import NotWristPartitionedError
from er3a.pipeline.messages.kinematics import say
from er3a.pipeline.messages.language import N_, said
from er3a.robots.robot import Robot
from er3a.workspace.blocks import Blocks, blocks_of, mesh, pockets
from er3a.workspace.causes import describe, relaxations
from er3a.workspace.cavities import Cavity, cavities, rim
from er3a.workspace.general import prove_general
from er3a.workspace.general_arm import general_arm
from er3a.workspace.hull import Hull, depth_inside
from er3a.workspace.lookup import EMPTY, SectionMap
from er3a.workspace.proof import Proof, prove, sharpen
from er3a.workspace.section_arm import SectionArm, section_arm, section_frame
from er3a.workspace.volume import VolumeEstimate, estimate_volume
from er3a.workspace.witness import lies_in_cell, reach_points, witness_joints

TARGET = 0.002
VOID_SHARE = 0.25
GENERAL_CELLS, GENERAL_SAMPLES, GENERAL_BOXES = 4, 250, 1000
"""For each cell of the budget, where the general method is all there is: its cells, samples and boxes."""
POCKET_BLOCKS, TURNS = 64, 180
MESH_BLOCKS, MESH_TURNS = 24, 72
STATES = ("filled", "touched", "empty", "undecided", "partly filled")
_SPECK_M3 = 1e-9


@dataclass(frozen=True, eq=False)
class Proven:
    """What the proof says of a robot.

    Attributes
    ----------
    arm : in its section form; None if it is not wrist-partitioned
    proof, section : its cells, and their map
    R, origin : frame about axis 1, see :func:`er3a.workspace.section_arm.section_frame`
    witness : (cells, 6), rad, a joint vector that reaches into each cell, NaN where none is known
    estimate : of the volume; method : how cells were decided, in words
    """

    arm: SectionArm | None
    proof: Proof
    section: SectionMap
    R: np.ndarray
    origin: np.ndarray
    witness: np.ndarray
    estimate: VolumeEstimate
    method: str

    def in_base(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) from the frame about axis 1 to the base frame."""
        return points @ self.R + self.origin

    def in_section(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distance from axis 1 (m), azimuth (rad) and height (m) of points (n, 3) in the base frame."""
        x, y, z = self.R @ (points - self.origin).T
        return np.hypot(x, y), np.arctan2(y, x), z


def prove_robot(robot: Robot, most_cells: int, points: int, seed: int) -> Proven:
    """Run the proof and the estimate that rests on it; bounds by lengths alone where the arm's build gives no more."""
    try:
        arm = section_arm(robot)
    except NotWristPartitionedError as error:
        return _prove_general(robot, most_cells, points, seed, say(error.property_missing))
    section = SectionMap(prove(arm, TARGET, int((1 - VOID_SHARE) * most_cells)))
    section = _about_voids(arm, section, int(VOID_SHARE * most_cells))
    estimate = estimate_volume(arm, section, arm.reach, arm.heights, points, seed)
    witness = witness_joints(robot, arm, section.proof)
    return Proven(arm, section.proof, section, *section_frame(robot), witness, estimate, N_("spherical wrist"))


def _prove_general(robot: Robot, most_cells: int, points: int, seed: int, lacks: str) -> Proven:
    arm, R, origin = general_arm(robot)
    budgets = (GENERAL_SAMPLES * most_cells, GENERAL_BOXES * most_cells)
    proof, theta = prove_general(arm, GENERAL_CELLS * most_cells, seed, *budgets)
    section = SectionMap(proof)
    q = np.tile((robot.lower + robot.upper) / 2, (len(theta), 1))
    count = theta.shape[1]
    turned = robot.direction[:count] * (theta - robot.offset[:count])
    middle = q[:, :count]
    q[:, :count] = turned + 2 * np.pi * np.round((middle - turned) / (2 * np.pi))
    q = np.where(lies_in_cell(robot, q, proof, R, origin)[:, None], q, np.nan)

    def search(local: np.ndarray) -> np.ndarray:
        cells = section.cell_of(np.hypot(local[:, 0], local[:, 1]), local[:, 2])
        starts = np.where(np.isfinite(q[cells]), q[cells], (robot.lower + robot.upper) / 2)
        return np.isfinite(reach_points(robot, local @ R + origin, starts)[:, 0])

    estimate = estimate_volume(search, section, arm.reach, arm.heights, points, seed)
    method = said("general method, because {lacks}", lacks=lacks)
    return Proven(None, proof, section, R, origin, q, estimate, method)


def _about_voids(arm: SectionArm, section: SectionMap, most_cells: int) -> SectionMap:
    """Spend cells on the rims of enclosed voids, round by round."""
    while True:
        chosen = rim(section, cavities(section)[0])
        most_cells -= 4 * int(chosen.sum())
        if most_cells < 0 or not chosen.any():
            return section
        section = SectionMap(sharpen(arm, section.proof, chosen))


def count_in_empty(proven: Proven, points: np.ndarray) -> int:
    """How many points (n, 3), m, base frame, lie where nothing is reached; more than none would refute the proof."""
    return int((proven.section.status(*proven.in_section(points)) == EMPTY).sum())


def proof_table(proven: Proven) -> pd.DataFrame:
    """All cells: section, volume, status, shares and arcs, and a joint vector that reaches into the cell."""
    proof = proven.proof
    unfilled, empty = proof.unfilled_share, proof.empty_share
    touched = np.isfinite(proven.witness[:, 0])
    state = np.select(
        [unfilled <= 0, empty >= 1 - 1e-12, unfilled < 1 - 1e-12, touched],
        [STATES[0], STATES[2], STATES[4], STATES[1]],
        STATES[3],
    )
    table = pd.DataFrame(proof.cells, columns=["rho_0_m", "rho_1_m", "z_0_m", "z_1_m"])
    return table.assign(
        volume_m3=proof.volumes,
        level=proof.level.astype(np.int16),
        status=state,
        filled_share=1 - unfilled,
        empty_share=empty,
        empty_arcs_deg=[_arcs(row) for row in proof.empty],
        unfilled_arcs_deg=[_arcs(row) for row in proof.unfilled],
        **{f"q{k}_deg": np.degrees(angles) for k, angles in enumerate(proven.witness.T, start=1)},
    )


def _arcs(row: np.ndarray) -> list[float]:
    return np.degrees(row[np.isfinite(row[:, 0])]).ravel().tolist()


def find_proven_voids(robot: Robot, proven: Proven, hull: Hull, shoulder: np.ndarray):
    """Voids inside the hull, the largest first.

    Returns
    -------
    records : as in the summary
    vertices, triangles : tables of their surfaces, in the base frame
    """
    enclosed, outside = cavities(proven.section)
    found = [(cavity, *_outline(proven, cavity)) for cavity in enclosed if cavity.lower > _SPECK_M3]
    blocks = _pocket_blocks(proven, outside)
    inside = blocks.empty > 0.5
    inside[inside] = depth_inside(hull, proven.in_base(blocks.points()[inside])) > 0
    records, surfaces = [], []
    for cavity, fine, mask in found:
        records.append(_record("enclosed", robot, proven, cavity, shoulder))
        surfaces.append((fine, mask))
    for mask in pockets(blocks, inside):
        part = _as_cavity(blocks, mask)
        records.append(_record("open", robot, proven, part, shoulder))
        surfaces.append((blocks, mask))
    order = sorted(range(len(records)), key=lambda n: -records[n]["volume_m3"]["lower"])
    vertices, triangles = [], []
    for number, n in enumerate(order, start=1):
        corners, faces = mesh(*surfaces[n])
        corners = pd.DataFrame(proven.in_base(corners), columns=["x_m", "y_m", "z_m"])
        vertices.append(corners.assign(void=np.int32(number)))
        triangles.append(pd.DataFrame(faces, columns=["a", "b", "c"]).assign(void=np.int32(number)))
    if not records:
        vertices = [pd.DataFrame({"x_m": [], "y_m": [], "z_m": [], "void": []}, dtype=float)]
        triangles = [pd.DataFrame({"a": [], "b": [], "c": [], "void": []}, dtype=np.int64)]
    return [records[n] for n in order], pd.concat(vertices, ignore_index=True), pd.concat(triangles, ignore_index=True)


def _record(kind: str, robot: Robot, proven: Proven, cavity: Cavity, shoulder: np.ndarray) -> dict[str, Any]:
    relaxed = relaxations(robot, cavity, None if proven.arm is not None else proven.in_section)
    low, high = cavity.box()
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    extent = np.ptp(proven.in_base(corners), axis=0)
    local = proven.R @ (shoulder - proven.origin)
    rho, size = np.hypot(local[0], local[1]), proven.section.size
    near = (cavity.cells[:, [0, 2]] <= [rho + size, local[2] + size]).all(axis=1)
    near &= (cavity.cells[:, [1, 3]] >= [rho - size, local[2] - size]).all(axis=1)
    return {
        "kind": kind,
        "status": N_("proven empty"),
        "volume_m3": {"lower": cavity.lower, "upper": cavity.upper},
        "centroid_m": (proven.in_base(cavity.centroid()) + 0.0).tolist(),
        "extent_m": extent.tolist(),
        "cause": describe(relaxed),
        "relaxed": [asdict(limit) for limit in relaxed],
        "holds_shoulder": bool(near.any()),
    }


def _outline(proven: Proven, cavity: Cavity) -> tuple[Blocks, np.ndarray]:
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


def _as_cavity(blocks: Blocks, mask: np.ndarray) -> Cavity:
    """Blocks as arcs of cells."""
    i, j, k = np.nonzero(mask)
    cells = np.stack([blocks.rho[i], blocks.rho[i + 1], blocks.z[j], blocks.z[j + 1]], axis=1)
    arcs = np.stack([blocks.azimuth[k], blocks.azimuth[k + 1]], axis=1)
    # A block that is only partly open counts with what of it is not filled; its empty share is of that part.
    unfilled = blocks.unfilled[i, j, k]
    width = (arcs[:, 1] - arcs[:, 0]) * unfilled
    middle = arcs.mean(axis=1)
    arcs = np.stack([middle - width / 2, middle + width / 2], axis=1)
    return Cavity(False, cells, arcs, np.minimum(1.0, blocks.empty[i, j, k] / unfilled))
