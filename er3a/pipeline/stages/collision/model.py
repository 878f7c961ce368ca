"""The stage's results: summary and tables."""

from __future__ import annotations

from typing import Literal

from er3a.by_value import frozen
from er3a.collision.matrix import PairState
from er3a.collision.pairs import Pair
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.pipeline.language import N_
from er3a.pipeline.results import Results, Summary
from er3a.pipeline.scope import OF_MOTIONS
from er3a.pipeline.tables import Findings, Table, Texts, column, findings, per_joint, vector


@frozen
class FreeShare:
    """A share of random joint vectors, with its 95 % interval (Wilson)."""

    ratio: float
    interval: tuple[float, float]


@frozen
class PlacesSummary:
    """Cells of space that the tool point was brought to, of edge ``cell_m``; volumes are those of whole cells."""

    cell_m: float
    reached: int
    clear: int
    joined: int
    tries_in_lost: int
    lost_m3: float


@frozen
class Mounting:
    """A solid that the base overlaps, which is taken as what it is mounted on; ``inside``: its middle is in it."""

    solid: str
    depth_mm: float
    inside: bool


@frozen
class Closest:
    """Where a target's chosen solution or a path comes nearest to anything; points on the two bodies, in mm."""

    name: str
    kind: Literal["target", "path"]
    clearance_mm: float
    between: Pair
    t_s: float | None
    q_deg: tuple[float, ...]
    from_mm: tuple[float, float, float]
    to_mm: tuple[float, float, float]


NEAR_MM = 50.0  # what is farther from an arm decides nothing


@frozen
class SteadyPair:
    """Two bodies that are as near in all targets' and paths' nearest poses, and how near they are there, mm."""

    between: Pair
    least_mm: float
    most_mm: float


HomeFrom = Literal["study", "zero", "chosen"]


class CollisionSummary(Summary):
    """What the stage found.

    Attributes
    ----------
    scene : title of the scene; None in open space
    samples : random joint vectors tried
    home_from : whether the study gives home, joints are at 0 there, or it was chosen
    home_deg : where places are to be joined to; None where home is not free of overlap
    proven_m : cells' witnesses are joined by moves that are proven free but for overlaps less deep than this
    closest : but for ``steady`` pairs, which are left out of clearances of targets and paths, too
    """

    needs = ("self_collision", "scene_collision", "limits", *OF_MOTIONS)

    scene: str | None
    samples: int
    of_itself: FreeShare
    of_scene: FreeShare
    whole: FreeShare
    home_from: HomeFrom
    home_deg: tuple[float, ...] | None
    proven_m: float
    penetration_tolerance_mm: float
    places: PlacesSummary
    mounting: tuple[Mounting, ...]
    closest: tuple[Closest, ...]
    steady: tuple[SteadyPair, ...]


class MatrixRows(Table):
    """The allowed collision matrix: one row for each pair of links, and of a link with what is carried."""

    first: Texts = column("the body nearer to the base")
    second: Texts = column("the body farther out")
    state: Texts = column("never, joined, overlaps, coarse, meets, undecided, allowed or watched")
    watched: Flags = column("whether distances of the pair are measured")
    least_mm: Reals = column("of pairs that never meet, a proven lower bound of their distance")
    left_out_mm: Reals = column("radius of the region around the joint that is left out; 0 where none is")
    boxes: Integers = column("ranges of joint values looked at to prove it")
    witness_deg: Reals = per_joint("a joint vector in which watched parts overlap; NaN: none")
    reason: Texts = column("what the person who decided on the pair wrote")


class PairShares(Table):
    """How often each pair overlaps among random joint vectors."""

    between: Findings = findings("the two bodies")
    of_itself: Flags = column("whether both belong to the arm or to what it carries")
    ratio: Reals = column("share of the joint vectors in which they overlap")
    low: Reals = column("lower end of its 95 % interval")
    high: Reals = column("upper end of its 95 % interval")
    always: Flags = column("whether they overlap in every joint vector, proven")


class PlaceRows(Table):
    """Cells that the tool point was brought to."""

    middle_mm: Reals = vector("{}_mm", "middle of the cell")
    tries: Integers = column("arms tried with the tool in it")
    clear: Flags = column("whether one of them is free of overlap")
    joined: Flags = column("whether that one is joined to home by a proven motion")
    witness_deg: Reals = per_joint("the first such arm; NaN where none was found")


class TargetClearances(Table):
    """Clearance of each target's solutions within the limits."""

    target: Texts = column("name of the target")
    branch: Integers = column("number of the branch")
    label: Texts = column("code of the branch")
    q_deg: Reals = per_joint("joint angle")
    clearance_mm: Reals = column("smallest distance; negative by the depth of overlap")
    between: Texts = column("what is nearest to what")


class PathClearances(Table):
    """Clearance over time of each path, with the points of both bodies that are nearest."""

    path: Texts = column("name of the path")
    t_s: Reals = column("time since the path's start", heading=N_("time"))
    q_deg: Reals = per_joint("joint angle; NaN where the path can't be reached")
    clearance_mm: Reals = column("smallest distance; negative by the depth of overlap", heading=N_("clearance"))
    between: Texts = column("what is nearest to what")
    from_mm: Reals = vector("from_{}_mm", "the nearest point of the first body")
    to_mm: Reals = vector("to_{}_mm", "the nearest point of the second body")


class CollisionResults(Results):
    """The stage's results."""

    summary: CollisionSummary
    matrix: MatrixRows
    pairs: PairShares
    places: PlaceRows
    targets: TargetClearances
    paths: PathClearances


RESULTS = CollisionResults
STATES: tuple[PairState, ...] = ("overlaps", "coarse", "meets", "undecided", "watched", "joined", "allowed", "never")
