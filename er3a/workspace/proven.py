"""What the proof says of a robot: its cells, a joint vector that reaches into each, and an estimate of the volume."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.kinematics.chain import constant_links
from er3a.kinematics.wrist_partitioned import ClosedFormMissing, CoupledJoints, closed_form_missing
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot
from er3a.sampling.grid import tool_bound
from er3a.workspace.azimuths import MOST_ARCS, TURN
from er3a.workspace.cavities import cavities, rim
from er3a.workspace.general import prove_general
from er3a.workspace.general_arm import coupled, general_arm
from er3a.workspace.lookup import EMPTY, OUTSIDE, SectionMap
from er3a.workspace.proof import Proof, in_section, prove, sharpen
from er3a.workspace.section_arm import SectionArm, section_arm, section_frame
from er3a.workspace.volume import VolumeEstimate, estimate_volume
from er3a.workspace.witness import lies_in_cell, reach_points, witness_joints

CellState = Literal["filled", "touched", "empty", "undecided", "partly_filled"]

TARGET = 0.002
BEYOND_ROUNDING = 1 + 1e-9
LEAST_BOUND_M = 1e-4  # for a tool point that no joint moves
VOID_RATIO = 0.25
NEAR_WRIST = 0.07
WIDE, WIDEST = 6.3, 0.5
"""Width of the bracket times the root of the budget (and width) from which the general method is tried, too."""
_SETTLED = 0.1  # of the volume
GENERAL_CELLS = 4
"""For each cell of the budget, where the general method is used: its cells."""


@dataclass(frozen=True)
class SphericalWrist:
    """The cells were decided by the method for spherical wrists."""

    code: Literal["spherical_wrist"] = "spherical_wrist"


@dataclass(frozen=True)
class ToolNearWrist:
    """The tool point is so near to the wrist centre, for the arm's reach, that its sphere proves little."""

    distance_mm: float
    code: Literal["tool_near_wrist"] = "tool_near_wrist"


@dataclass(frozen=True)
class BoundsFarApart:
    """The method for spherical wrists leaves so much between its bounds, for narrow limits say, and this one less."""

    percent: float
    code: Literal["bounds_far_apart"] = "bounds_far_apart"


@dataclass(frozen=True)
class GeneralMethod:
    """The cells were decided by the method for any arm, because of what this one lacks."""

    lacks: ClosedFormMissing | ToolNearWrist | BoundsFarApart
    code: Literal["general_method"] = "general_method"


ProofMethod = SphericalWrist | GeneralMethod


@dataclass(frozen=True, eq=False)
class Proven:
    """What the proof says of a robot.

    Attributes
    ----------
    arm : in its section form; None if it is not wrist-partitioned
    proof, section : its cells, and their map
    R, origin : frame about axis 1, see :func:`er3a.workspace.section_arm.section_frame`
    witness : (cells, 6), rad, a joint vector that reaches into each cell, NaN where none is known
    estimate : of the volume; method : how cells were decided
    """

    arm: SectionArm | None
    proof: Proof
    section: SectionMap
    R: Reals
    origin: Reals
    witness: Reals
    estimate: VolumeEstimate
    method: ProofMethod

    @property
    def settles(self) -> bool:
        """Whether so little is left undecided that the voids found are those there are."""
        return self.arm is not None or self.proof.width <= _SETTLED

    def in_base(self, points: Reals) -> Reals:
        """Points (..., 3) from the frame about axis 1 to the base frame."""
        return points @ self.R + self.origin

    def in_section(self, points: Reals) -> tuple[Reals, Reals, Reals]:
        """Distance from axis 1 (m), azimuth (rad) and height (m) of points (n, 3) in the base frame; or places across
        and along bars."""
        return in_section((points - self.origin) @ self.R.T, self.proof.bar)

    def count_in_empty(self, points: Reals) -> int:
        """How many points (n, 3), m, base frame, lie where nothing is reached; more than none would refute the
        proof."""
        return int((self.section.status(*self.in_section(points)) == EMPTY).sum())

    def nowhere(self, rho: Reals, z: Reals) -> Flags:
        """Whether nothing is reached at any azimuth (or place along bars) at radii and heights (n,), m, of the
        section."""
        cell = self.section.cell_of(rho, z)
        return np.asarray((cell == OUTSIDE) | (self.proof.empty_ratio[cell] >= 1 - 1e-12))

    def cell_states(self) -> list[CellState]:
        """What each cell is; touched: not proven filled, but a joint vector reaches into it."""
        unfilled, empty = self.proof.unfilled_ratio, self.proof.empty_ratio
        touched = np.isfinite(self.witness[:, 0])
        states: tuple[CellState, ...] = ("filled", "empty", "partly_filled", "touched", "undecided")
        chosen = np.select([unfilled <= 0, empty >= 1 - 1e-12, unfilled < 1 - 1e-12, touched], [0, 1, 2, 3], 4)
        return [states[n] for n in chosen]


def prove_robot(robot: Robot, most_cells: int, points: int, seed: int) -> Proven:
    """Run the proof and the estimate that rests on it; bounds by lengths alone where the arm's build gives no more."""
    if lacks := lacking_for_proof(robot):
        return _prove_general(robot, most_cells, points, seed, lacks)
    arm = section_arm(robot)
    if arm.d < NEAR_WRIST * arm.reach:
        return _prove_general(robot, most_cells, points, seed, ToolNearWrist(1000 * arm.d))
    section = SectionMap(prove(arm, TARGET, int((1 - VOID_RATIO) * most_cells)))
    section = _about_voids(arm, section, int(VOID_RATIO * most_cells))
    if (width := section.proof.width) > min(WIDE / np.sqrt(most_cells), WIDEST):
        general = _prove_general(robot, most_cells, points, seed, BoundsFarApart(100 * width))
        if general.proof.width < width:
            return general
    estimate = estimate_volume(arm, section.proof, points, seed)
    witness = witness_joints(robot, arm, section.proof)
    return Proven(arm, section.proof, section, *section_frame(robot), witness, estimate, SphericalWrist())


def lacking_for_proof(robot: Robot) -> ClosedFormMissing | None:
    """Why the method for spherical wrists does not apply, which takes each joint's range by itself; None if it does."""
    return CoupledJoints() if coupled(robot) else closed_form_missing(robot)


def _bounded_by_lengths(robot: Robot, points: int, seed: int, method: GeneralMethod) -> Proven:
    """One ring that the tool point can't leave, of arms whose joint 1 slides or goes with others."""
    bound = tool_bound(robot)
    reach, radius = (BEYOND_ROUNDING * max(length, LEAST_BOUND_M) for length in (bound.reach, bound.radius))
    low, high = bound.height - radius, bound.height + radius
    unfilled, empty = np.full((2, 1, MOST_ARCS, 2), np.nan)
    unfilled[0, 0] = 0.0, TURN
    cells, none = np.array([[0.0, reach, low, high]]), np.zeros((1, 4))
    proof = Proof(cells, unfilled, empty, np.zeros(1, dtype=np.int64), none, 0)
    section = SectionMap(proof)
    estimate = estimate_volume(_nothing_found, proof, points, seed)
    R = constant_links(robot)[0, :3, :3].T
    witness = np.full((1, robot.joints), np.nan)
    return Proven(None, proof, section, R, bound.axis_point, witness, estimate, method)


def _nothing_found(local: Reals) -> Flags:
    """A search that leaves every point undecided."""
    return np.zeros(len(local), dtype=bool)


def _prove_general(
    robot: Robot, most_cells: int, points: int, seed: int, lacks: ClosedFormMissing | ToolNearWrist | BoundsFarApart
) -> Proven:
    arm, R, origin = general_arm(robot)
    if not arm.carries_around:
        return _bounded_by_lengths(robot, points, seed, GeneralMethod(lacks))
    proof, v = prove_general(arm, TARGET, GENERAL_CELLS * most_cells, seed)
    section = SectionMap(proof)
    q = np.tile((robot.lower + robot.upper) / 2, (len(v), 1))
    first = 0 if arm.combined[:, :1].any() else 1
    q[:, first : v.shape[1]] = arm.joints(v)[:, first:]
    q = np.where(lies_in_cell(robot, q, proof, R, origin)[:, None], q, np.nan)

    def search(local: Reals) -> Flags:
        rho, _, z = in_section(local, arm.bar)
        cells = section.cell_of(rho, z)
        starts = np.where(np.isfinite(q[cells]), q[cells], (robot.lower + robot.upper) / 2)
        return np.isfinite(reach_points(robot, local @ R + origin, starts)[:, 0])

    estimate = estimate_volume(search, proof, points, seed)
    return Proven(None, proof, section, R, origin, q, estimate, GeneralMethod(lacks))


def _about_voids(arm: SectionArm, section: SectionMap, most_cells: int) -> SectionMap:
    """Spend cells on the rims of enclosed voids, round by round."""
    while True:
        chosen = rim(section, cavities(section)[0])
        most_cells -= 4 * int(chosen.sum())
        if most_cells < 0 or not chosen.any():
            return section
        section = SectionMap(sharpen(arm, section.proof, chosen))
