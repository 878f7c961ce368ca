"""The stage's results: summary and tables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from er3a.by_value import frozen
from er3a.collision.pairs import Pair
from er3a.finding import Finding
from er3a.kinematics.solutions import Method, TargetOutcome, Unsolved
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.pipeline.results import Results, Summary
from er3a.pipeline.tables import Findings, Table, Texts, column, findings, per_joint, vector
from er3a.selection.nearest import WhyFirst
from er3a.selection.regular_first import SINGULAR_PARTS


@frozen
class NeighbourPoses:
    """Poses near a target without solution that have one; None where none was found (``kinematics.neighbours``)."""

    orientation_ratio: float
    least_turn_deg: float | None
    turned_to_deg: tuple[float, float, float] | None
    least_shift_mm: float | None
    shifted_to_mm: tuple[float, float, float] | None


@frozen
class TargetClearance:
    """How near a chosen solution comes to anything, negative by the depth of an overlap, and what comes so near."""

    least_mm: float
    between: Pair


@frozen
class TargetResult:
    """One target.

    Attributes
    ----------
    solutions, within_limits : branches that reach it, and that do so within the limits
    chosen_deg : the solution taken; None if there is none
    reason : why it was taken, or why none was; obstacle : the latter in short, None where one was taken
    outcome, expect : what it came to, and what its file says that it should
    unsolved : why branches have no solution, where others have one; else ``reason`` says why
    neighbours : only for targets without a solution within the limits
    clearance : of the chosen solution; None where nothing can meet
    """

    name: str
    note: str | None
    xyz_mm: tuple[float, float, float]
    rpy_deg: tuple[float, float, float]
    quaternion_wxyz: tuple[float, float, float, float]
    q_ref_deg: tuple[float, ...]
    solutions: int
    within_limits: int
    chosen_deg: tuple[float, ...] | None
    reason: WhyFirst | Finding
    obstacle: Finding | None
    outcome: TargetOutcome
    expect: TargetOutcome | None
    unsolved: tuple[Unsolved, ...]
    method: Method
    neighbours: NeighbourPoses | None
    advice: tuple[Finding, ...]
    clearance: TargetClearance | None = None


class InverseSummary(Summary):
    """What the stage found.

    Attributes
    ----------
    scene : title of the scene whose solids are not to be touched
    turns : whether the solutions stand in all turns; else (many targets) in the one nearest to the reference
    targets : of many only those that a page shows; all stand in the table of targets
    """

    needs = ("reach", "limits", "self_collision", "scene_collision")

    scene: str | None
    turns: bool
    targets: tuple[TargetResult, ...]


class SolutionRows(Table):
    """One row for each solution of each target, turns included. A mm of a prismatic joint counts as a deg in margin,
    move and distance."""

    target: Texts = column("name of the target")
    branch: Integers = column("4 * shoulder + 2 * elbow + wrist; else the number of the arm found")
    label: Texts = column("code of the branch")
    q_deg: Reals = per_joint("joint angle")
    turn: Integers = per_joint("full turns added to the angle in (-180, 180]")
    within_limits: Flags = column("whether all joints are within their limits")
    refusal: Findings = findings("which limits are left, or what overlaps; none for admissible solutions")
    rank: Integers = column("1 is the chosen one; 0 for refused ones")
    first_of_branch: Flags = column("whether it is the branch's best")
    position_residual_mm: Reals = column("by how much forward kinematics misses the target")
    orientation_residual_deg: Reals = column("by how much forward kinematics misses the target")
    freed_turn_deg: Reals = column("the tool's turn from the target in what fewer than six joints leave open; else 0")
    manipulability: Reals = column("of the Jacobian with lengths divided by the wrist's reach")
    singular: Flags = vector(
        "singular_{}",
        "whether the arm is on this singularity, to 1e-6 rad or m (rank: of an arm without closed form)",
        parts=SINGULAR_PARTS,
    )
    limit_margin_deg: Reals = column("smallest distance of a joint from its limits; negative outside")
    greatest_move_deg: Reals = column("the farthest that a joint turns from the reference")
    distance_deg: Reals = column("root of the summed squares of the joint moves")


class TargetRows(Table):
    """One row for each target."""

    target: Texts = column("name of the target")
    point_mm: Reals = vector("{}_mm", "where it is, in the base frame")
    outcome: Texts = column("what it came to")
    expect: Texts = column("what its file says that it should come to; empty where it says nothing")
    obstacle: Findings = findings("why none of its solutions was chosen")
    clearance_mm: Reals = column("of the chosen solution; NaN where nothing can meet")

    @property
    def reached(self) -> Flags:
        """Which targets (rows,) are reached."""
        return self.outcome == "reached"

    @property
    def caught(self) -> Flags:
        """Which targets (rows,) are not reached, as their file says."""
        return ~self.reached & (self.outcome == self.expect)


class InverseResults(Results):
    """The stage's results."""

    summary: InverseSummary
    targets: TargetRows
    solutions: SolutionRows


RESULTS = InverseResults


MAX_SHOWN = 32


def shown_targets(targets: Sequence[TargetResult]) -> list[TargetResult]:
    """The targets that a page shows, and of many those that the summary holds.

    Parameters
    ----------
    targets : of the whole stage

    Returns
    -------
    targets : all, in their order; of more than ``MAX_SHOWN`` about as many of each outcome, taken evenly over the list
    """
    if len(targets) <= MAX_SHOWN:
        return list(targets)
    by_outcome: dict[str, list[int]] = {}
    for number, target in enumerate(targets):
        by_outcome.setdefault(target.outcome, []).append(number)
    taken: list[int] = []
    left, kinds = MAX_SHOWN, len(by_outcome)
    for done, numbers in enumerate(sorted(by_outcome.values(), key=len)):
        count = min(len(numbers), left // (kinds - done))
        taken += [numbers[int(k)] for k in np.linspace(0, len(numbers) - 1, count).round()]
        left -= count
    return [targets[number] for number in sorted(taken)]
