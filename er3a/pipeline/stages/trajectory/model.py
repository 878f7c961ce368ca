"""What the trajectory stage computes.

Times count from a path's start, ways along the tool point's path. Angles are the manufacturer's, degrees.
"""

from __future__ import annotations

from typing import Literal

from er3a.by_value import frozen
from er3a.collision.pairs import Pair
from er3a.finding import Finding
from er3a.kinematics.classes.class_solvers import BranchLabel
from er3a.kinematics.singularity import EventType
from er3a.kinematics.wrist_partitioned import ClosedFormMissing
from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.language import N_
from er3a.pipeline.results import Results, Summary
from er3a.pipeline.scope import CHECKS_OF_MOTIONS
from er3a.pipeline.stages.programs.model import FindingAt
from er3a.pipeline.tables import Table, Texts, column, per_joint, vector
from er3a.planning.motion_faults import by_kind
from er3a.planning.names import FAULTS, TOO_FAST, PathVerdict, StrategyName

PathKind = Literal["joint", "joint_sequence", "line", "arc", "sequence", "table", "plan"]
FASTEST: Literal["fastest"] = "fastest"
"""In the table of strategies: the path itself, as fast as the joints can."""


@frozen
class NearThresholds:
    """Distance from each singular set below which a pose counts as near-singular."""

    wrist_deg: float
    elbow_deg: float
    shoulder_mm: float


@frozen
class LimitsUsed:
    """The joint limits that motions are judged by and timed with.

    Attributes
    ----------
    acceleration_assumed : whether the study gives no accelerations, so that each joint is taken to reach its full speed
        in ``acceleration_time_s``
    jerk_deg_s3 : None where nothing bounds the jerk
    """

    speed_deg_s: tuple[float, ...]
    speed_assumed: tuple[bool, ...]
    acceleration_deg_s2: tuple[float, ...]
    acceleration_assumed: bool
    acceleration_time_s: float
    jerk_deg_s3: tuple[float, ...] | None


@frozen
class HalfTurn:
    """A rotation by exactly 180 deg, and the axis in the base frame of the one of two ways that is taken."""

    segment: int
    axis: tuple[float, ...]


@frozen
class Singularity:
    """A pass through a singular set (``crossing``), or by it at a distance.

    Attributes
    ----------
    until_s : differs from ``t_s`` where the path stays on the set
    distance_deg : of wrist and elbow; distance_mm : of the shoulder
    """

    t_s: float
    until_s: float
    type: EventType
    crossing: bool
    distance_deg: float | None
    distance_mm: float | None
    axes: tuple[int, ...] = ()
    smallest_singular_value: float | None = None


@frozen
class Jump:
    """Where the branch in use ends, and the joint (from 1) that would have to move farthest to go on."""

    t_s: float
    joint: int
    angle_deg: float


@frozen
class Stretch:
    """A stretch of a path, in time and along its way, on which something is wrong; and when it is worst, where that has
    a value."""

    t0_s: float
    t1_s: float
    s0_m: float
    s1_m: float
    cause: Finding
    worst_s: float | None = None


@frozen
class MinClearance:
    """Where a path comes nearest to its surroundings or the arm to itself; negative by the depth of an overlap."""

    least_mm: float
    t_s: float
    between: Pair


@frozen
class ClearUntil:
    """The last point of a path that collides, from whose start to there, and in a stop from there, it keeps a margin.

    Attributes
    ----------
    stop_s : that the joints take to stop there
    xyz_mm, rpy_deg : of the tool in the base frame; q_deg : in mm for a prismatic joint
    contact_mm : where the first bodies touch, further on
    """

    margin_mm: float
    t_s: float
    stop_s: float
    s_m: float
    xyz_mm: tuple[float, ...]
    rpy_deg: tuple[float, ...]
    q_deg: tuple[float, ...]
    contact_mm: tuple[float, ...]


@frozen
class SoundEnd:
    """The last point at which a path may end: before anything is wrong, and with time to stop there.

    Attributes
    ----------
    xyz_mm : of the tool in the base frame
    left_s, stop_s : time from there to the first fault, and that which the joints take to stop there; None where a
        contact comes first, from which the point is clear by the margin of ``ClearUntil``
    """

    t_s: float
    xyz_mm: tuple[float, ...]
    left_s: float | None = None
    stop_s: float | None = None


@frozen
class StrategyMotion:
    """A strategy's motion, against the path as programmed.

    Attributes
    ----------
    keeps_clear : whether the arm keeps its distance from singular poses wherever the tool is on or beside the path
    clearance : None where none was measured
    """

    max_deviation_mm: float
    max_deviation_deg: float
    duration_s: float
    keeps_clear: bool
    max_joint_speed_deg_s: tuple[float, ...]
    max_joint_speed_ratio: float
    max_joint_acceleration_ratio: float
    clearance: MinClearance | None


@frozen
class TriedStrategy:
    """A strategy of singularity avoidance, tried on a path.

    Attributes
    ----------
    reasons : why it is not possible (``motion`` is None then) or not usable
    """

    name: StrategyName
    usable: bool
    reasons: tuple[Finding, ...]
    motion: StrategyMotion | None


@frozen
class PathSummary:
    """What is known of a path.

    Attributes
    ----------
    outcomes : all that it came to, the first fault first
    expect : what its file expects
    in_joint_space : whether it is a move of the joints, which singular poses do no harm
    branches : of the closed form, in the order in which they serve
    start_turn_deg : by which the arm turns at rest before it starts; None in joint space
    faults : where it is out of reach, exceeds a limit of angles or rates, collides, or is not decided between the poses
        that are solved; :meth:`of` has those of a kind
    corner_deviation_mm, corner_deviation_deg : by how much rounded corners miss their points at most
    max_joint_speed_deg_s, max_joint_speed_ratio, max_joint_acceleration_ratio : None where speeds have no bound; speeds
        of prismatic joints (``sliding``, from 1) in mm/s
    clearance : None where none could be measured
    not_planned : why no motion was planned, of one that is to be
    clear_until : how far it could be used; None where it does not collide, or keeps the margin nowhere
    sound_end : where it may end instead, with margins; None where it is not to end earlier, or nowhere may
    fastest_s : of the exact path under the joint limits; None where no motion follows it
    avoidance : the strategies tried; none where the path is safe
    strategy : the one to take
    of_program : what the check of the program that it is of finds, of at least caution, and the path does not show
    """

    name: str
    title: str
    kind: PathKind
    verdict: PathVerdict
    outcomes: tuple[PathVerdict, ...]
    expect: tuple[PathVerdict, ...]
    in_joint_space: bool
    duration_s: float
    samples: int
    length_m: float
    branches: tuple[BranchLabel, ...]
    half_turns: tuple[HalfTurn, ...]
    corner_deviation_mm: float | None
    corner_deviation_deg: float | None
    repeated_rows: tuple[int, ...]
    start_turn_deg: tuple[float, ...] | None
    singularities: tuple[Singularity, ...]
    faults: tuple[Stretch, ...]
    jumps: tuple[Jump, ...]
    max_joint_speed_deg_s: tuple[float, ...] | None
    max_joint_speed_ratio: float | None
    max_joint_acceleration_ratio: float | None
    joint_speed_bounded: bool
    clearance: MinClearance | None
    not_planned: Finding | None
    fastest_s: float | None
    avoidance: tuple[TriedStrategy, ...]
    strategy: StrategyName | None
    sliding: tuple[int, ...] = ()
    clear_until: ClearUntil | None = None
    sound_end: SoundEnd | None = None
    of_program: tuple[FindingAt, ...] = ()

    def of(self, *kinds: PathVerdict) -> tuple[Stretch, ...]:
        """Its stretches of some kinds of faults, each kind in the order of time."""
        found = by_kind(self.faults)
        return tuple(part for kind in kinds for part in found.get(kind, ()))

    @property
    def too_fast(self) -> tuple[Stretch, ...]:
        """Where a joint exceeds a limit of speed, acceleration or jerk."""
        return self.of(*TOO_FAST)

    @property
    def singular(self) -> list[Singularity | Jump]:
        """Where a path of the tool crosses singular poses, or the arm jumps."""
        crossed = [] if self.in_joint_space else [event for event in self.singularities if event.crossing]
        return [*crossed, *self.jumps]

    @property
    def outcome(self) -> PathVerdict:
        """What it came to."""
        return self.verdict

    @property
    def meant_safe(self) -> bool:
        """Whether it is given to be run, not to show a fault."""
        return set(self.expect) <= {"safe"}

    @property
    def fails(self) -> bool:
        """Whether it can't be run as it is: it is at fault, no joints follow it, or its program fails. Only bodies that
        touch for certain are a fault."""
        faults = set(FAULTS).intersection(self.outcomes)
        if not any(touch.certain for part in self.of("collides") for touch in part.cause.touches):
            faults -= {"collides"}
        lost = self.verdict == "singular" and (bool(self.jumps) or not self.joint_speed_bounded)
        return bool(faults) or lost or any(each.level == "fail" for each in self.of_program)

    @property
    def chosen(self) -> TriedStrategy | None:
        """The strategy to take."""
        return next((tried for tried in self.avoidance if tried.name == self.strategy), None)


@frozen
class PathNotFollowed:
    """A path of the tool that could not be followed.

    Attributes
    ----------
    lacking : what the arm lacks for branches
    outcome : what it came to; ``undecided`` for an arm whose class has no way to follow it
    expect : what its file expects
    stops_at_s : of arms that are followed by their class, the time (s) beyond which the path is out of reach or asks a
        joint to leap; else None
    refused : why no path can be made of a program, or from its end; empty for others
    """

    name: str
    title: str
    lacking: ClosedFormMissing | None
    outcome: PathVerdict
    expect: tuple[PathVerdict, ...]
    stops_at_s: float | None = None
    refused: str = ""

    @property
    def outcomes(self) -> tuple[PathVerdict, ...]:
        """What it came to."""
        return (self.outcome,)


def is_safe(path: PathSummary, shapes: Finding | None) -> bool:
    """Whether a path may be run as it is.

    Parameters
    ----------
    shapes : assumed shapes of the arm, with the paths that come as near to them as they may be wrong; None if given

    Returns
    -------
    safe : whether nothing is wrong with the path, nor at the lines of the program that it is of
    """
    return path.verdict == "safe" and not path.of_program and not (shapes and path.name in shapes.near)


class TrajectorySummary(Summary):
    """Head, limits and paths.

    Attributes
    ----------
    characteristic_length_m : by which the Jacobian's linear rows are divided
    scene : title; None where the study names none
    penetration_tolerance_mm : no overlap deeper than this goes unnoticed between points
    """

    needs = (*CHECKS_OF_MOTIONS, "self_collision", "scene_collision")

    characteristic_length_m: float
    near: NearThresholds
    joint_limits: LimitsUsed
    scene: str | None
    penetration_tolerance_mm: float
    paths: tuple[PathSummary, ...]
    not_followed: tuple[PathNotFollowed, ...] = ()


class MotionRows(Table):
    """Motions of the arm; joint columns are NaN where the path can't be reached."""

    path: Texts = column("name of the path")
    t_s: Reals = column("time since the motion's start", heading=N_("time"))
    q_deg: Reals = per_joint("joint angle", heading=N_("joint angle"))
    q_deg_s: Reals = per_joint("joint velocity", heading=N_("velocity"))
    q_deg_s2: Reals = per_joint("joint acceleration", heading=N_("acceleration"))
    xyz_mm: Reals = vector("{}_mm", "tool point in the base frame")
    speed_ratio: Reals = column("greatest ratio of a joint's speed to its limit")
    condition_number: Reals = column("condition number of the scaled Jacobian", heading=N_("condition number"))
    smallest_singular_value: Reals = column("smallest singular value of the scaled Jacobian")


class Samples(MotionRows):
    """The paths' own points."""

    s_m: Reals = column("way of the tool point")
    manipulability: Reals = column("manipulability of the scaled Jacobian")
    wrist_deg: Reals = column("signed distance from the aligned wrist")
    elbow_deg: Reals = column("signed distance from the straight or folded elbow")
    shoulder_mm: Reals = column("signed distance of the wrist centre from the shoulder singularity")
    reachable: Flags = column("whether the arm reaches the pose")
    within_limits: Flags = column("whether all joints are within their limits")
    near_singular: Flags = column("whether the pose is nearer to a singular set than its threshold")


class PathChecks(Samples):
    """The paths' own points, those checked between them, and the closest passes."""

    sample: Flags = column("whether the point is one of the path's own")


class Clearances(Table):
    """Times at which the clearance of paths and strategies was measured in full; NaN where a path can't be reached."""

    path: Texts = column("name of the path")
    strategy: Texts = column("the strategy; empty for the path as programmed")
    t_s: Reals = column("time since the motion's start", heading=N_("time"))
    clearance_mm: Reals = column("smallest distance, negative by the depth of an overlap", heading=N_("clearance"))
    between: Texts = column("the two bodies nearest to each other")


class AvoidanceRows(MotionRows):
    """Motions of the strategies, and of each path at its fastest (``fastest``)."""

    strategy: Texts = column("the strategy, or the path at its fastest")
    deviation_mm: Reals = column("distance of the tool point from the path")
    deviation_deg: Reals = column("angle of the tool to the path's")


class ProgramFiles(Table):
    """Programs of the safe paths for controllers; of others only where the study asks for that, and the motion that
    repairs them as a table in csv."""

    path: Texts = column("name of the path")
    language: Texts = column("language of the program, by its name in a study (`trajectory.programs`)")
    file: Texts = column("name of the file")
    text: Texts = column("what the file holds")
    assumed_speed: Texts = column("greatest joint speeds that are assumed and that its speeds were written with")


class TrajectoryResults(Results):
    """Summary and tables of the stage."""

    summary: TrajectorySummary
    samples: Samples
    checks: PathChecks
    clearance: Clearances
    avoidance: AvoidanceRows
    programs: ProgramFiles


RESULTS = TrajectoryResults
