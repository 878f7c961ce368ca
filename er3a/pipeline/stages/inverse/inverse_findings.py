"""Findings of the stage: why a target has no solution, what would help, and what the verdict can be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from er3a.pipeline.stages.expectations import Demonstration


@dataclass(frozen=True)
class NothingFound:
    """Iteration found no solution."""

    code: Literal["nothing_found"] = "nothing_found"


@dataclass(frozen=True)
class TiltMissing:
    """The wrist would have to tilt further, by the branch that comes nearest."""

    angle_deg: float
    code: Literal["tilt_missing"] = "tilt_missing"


@dataclass(frozen=True)
class ReachMissing:
    """The wrist centre is out of reach, of the branch that comes nearest."""

    gap_mm: float
    code: Literal["reach_missing"] = "reach_missing"


@dataclass(frozen=True)
class BranchesLeaveLimits:
    """So many branches reach the target, all outside the limits."""

    count: int
    code: Literal["branches_leave_limits"] = "branches_leave_limits"


@dataclass(frozen=True)
class BranchesCollide:
    """So many branches reach the target within the limits, and all collide."""

    count: int
    code: Literal["branches_collide"] = "branches_collide"


Obstacle = NothingFound | TiltMissing | ReachMissing | BranchesLeaveLimits | BranchesCollide


@dataclass(frozen=True)
class TurnTool:
    """Turning the tool helps: part of random orientations that have a solution, and the least turn found."""

    orientation_ratio: float
    least_turn_deg: float
    code: Literal["turn_tool"] = "turn_tool"


@dataclass(frozen=True)
class TurningDoesNotHelp:
    """No orientation tried at this position has a solution."""

    code: Literal["turning_does_not_help"] = "turning_does_not_help"


@dataclass(frozen=True)
class ShiftTool:
    """Moving the part or the base helps: the least shift of the tool found, and where it ends."""

    shift_mm: float
    to_mm: tuple[float, float, float]
    code: Literal["shift_tool"] = "shift_tool"


@dataclass(frozen=True)
class ShiftingDoesNotHelp:
    """No position tried has a solution with this orientation."""

    code: Literal["shifting_does_not_help"] = "shifting_does_not_help"


@dataclass(frozen=True)
class MoveObstacle:
    """Only what is around the arm is in the way."""

    code: Literal["move_obstacle"] = "move_obstacle"


@dataclass(frozen=True)
class AtSingularity:
    """The arm taken is at a singularity."""

    kind: Literal["wrist", "elbow", "shoulder"]
    code: Literal["at_singularity"] = "at_singularity"


@dataclass(frozen=True)
class NearLimit:
    """A joint of the arm taken is near its limit."""

    margin_deg: float
    code: Literal["near_limit"] = "near_limit"


Advice = TurnTool | TurningDoesNotHelp | ShiftTool | ShiftingDoesNotHelp | MoveObstacle | AtSingularity | NearLimit


@dataclass(frozen=True)
class UnsolvedTarget:
    """A target without an admissible solution."""

    name: str
    obstacle: Obstacle
    code: Literal["unsolved_target"] = "unsolved_target"


@dataclass(frozen=True)
class NotReproduced:
    """The solver misses poses that it says it solves, or loses joint angles that made a pose."""

    worst_mm: float
    worst_deg: float
    lost: int
    code: Literal["inverse.not_reproduced"] = "inverse.not_reproduced"


@dataclass(frozen=True)
class AllSolved:
    """Every target has an admissible solution, but for those that are meant to have none (``demonstrations``).

    ``collisions``: a scene was given, so that the solutions touch nothing of it. The arm never touches itself.
    Demonstrations are not counted.
    """

    targets: int
    solved: int
    unsolved: tuple[UnsolvedTarget, ...]
    collisions: bool
    demonstrations: tuple[Demonstration, ...]
    code: Literal["inverse.all_solved"] = "inverse.all_solved"


@dataclass(frozen=True)
class SomeUnsolved:
    """Some targets have no admissible solution."""

    targets: int
    solved: int
    unsolved: tuple[UnsolvedTarget, ...]
    collisions: bool
    demonstrations: tuple[Demonstration, ...]
    code: Literal["inverse.some_unsolved"] = "inverse.some_unsolved"


@dataclass(frozen=True)
class NoneSolved:
    """No target has an admissible solution."""

    targets: int
    solved: int
    unsolved: tuple[UnsolvedTarget, ...]
    collisions: bool
    demonstrations: tuple[Demonstration, ...]
    code: Literal["inverse.none_solved"] = "inverse.none_solved"
