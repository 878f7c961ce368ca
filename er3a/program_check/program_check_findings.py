"""Findings of a program check, in addition to those of :mod:`er3a.planning.motion_faults`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Literal

from er3a.by_value import Finding
from er3a.collision.pairs import Pair, PairsUnexamined
from er3a.kinematics.classes.class_solvers import BranchLabel
from er3a.kinematics.singularity import SingularityType
from er3a.kinematics.solutions import Unsolved
from er3a.planning.motion_faults import AboveLimit, AccelerationTooGreat, BelowLimit, TooFast
from er3a.planning.tool_proof import Undecided
from er3a.programs.execution import EndKind
from er3a.programs.instructions import Unresolved
from er3a.programs.program_findings import ProgramFinding
from er3a.robots.joint_limits import CombinationExceeded, SlideExceeded

Level = Literal["pass", "note", "caution", "fail"]
RANKS: dict[Level, int] = {"pass": 0, "note": 1, "caution": 2, "fail": 3}


class TargetNotGiven(Finding):
    """The program's text does not determine the target."""

    target: str
    reason: Unresolved


class FrameNotGiven(Finding):
    """A tool or base is known by its name alone; ``needed`` if the motion can't be placed without it."""

    name: str
    frame: Literal["tool", "base"]
    needed: bool


class FrameTakenAsFlange(Finding):
    """A tool named tool0 that is defined nowhere was taken to be the flange."""

    name: str


class FrameOfSeveral(Finding):
    """The program takes a tool or base by an index that is not known; one was given for all of them."""

    name: str
    frame: Literal["tool", "base"]


class FramesFromRobotFile(Finding):
    """The program sets no tool, no base, or neither, before a pose; those of the robot file were taken."""

    kind: Literal["tool", "base", "both"]


class FramesDecide(Finding):
    """A pose that decides which way the program takes is read with a tool, base or both that it does not set; those of
    the robot file were taken."""

    kind: Literal["tool", "base", "both"]


class FrameGivenTwice(Finding):
    """The program itself gives a frame that the check was given otherwise; the program's was taken."""

    name: str
    moved_mm: float
    turned_deg: float


class KeptToNextStart(Finding):
    """A variable that decides motions is changed and keeps its value; only the first start was checked."""

    name: str


class SetElsewhere(Finding):
    """A variable that decides motions is set by another program too; the value of the data file was taken."""

    name: str
    file: str
    line: int


class WaitsForOthers(Finding):
    """A wait for what is false, or a loop that goes on without a motion; nothing that was read ends it, but another
    task does, which may do more."""

    condition: str


class ErrorsNotFollowed(Finding):
    """A handler after which the program goes on that had an error; few errors are followed."""


class ToolStatedElsewhere(Finding):
    """A table's pose of the tool is not where its joints put it; in the row where it is farthest away."""

    moved_mm: float
    turned_deg: float


class PositionCompleted(Finding):
    """A variable's position leaves coordinates out (``text``); they were taken from where the arm is."""

    text: str


class TurnsOtherwise(Finding):
    """A line of KRL turns the tool in a way that no public text settles; it was checked with one turn about one axis,
    from which swinging the tool's x axis and turning about it are ``off_deg`` away at most."""

    off_deg: float


class TurnsEitherWay(Finding):
    """A line or arc turns the tool by half a turn, to which both ways are as long; it was checked with the turn about
    ``axis`` of the robot's base, and no public text says which way a controller takes."""

    axis: tuple[float, float, float]


class TurnNotFollowed(Finding):
    """A setting (``text``) asks for another turn of the tool than the one with which a line or arc of KRL was checked:
    evenly to the target's orientation."""

    text: str


class RelativeTurnAssumed(Finding):
    """Angles of a relative position were taken for turns about the axes of the base; added to those of the position
    before, they lead to an orientation that is ``off_deg`` from that."""

    off_deg: float


class FramesInDoubt(Finding):
    """An instruction before, which is not understood, may have set another tool, base or path for this motion."""

    text: str


class PathNotKnown(Finding, code="way_not_known"):
    """The start of the motion is unknown, so only its target was checked."""


class TargetOutOfReach(Finding):
    """No IK solution reaches the target; ``reasons`` are empty where they were not determined.

    ``carried`` where the target sets external axes, which were left out: they may bring the arm or the target near.
    """

    reasons: tuple[Unsolved, ...]
    carried: bool = False


class StretchOutOfReach(Finding, code="way_out_of_reach"):
    """The tool leaves the arm's reach on the way to the target; ``carried`` as for :class:`TargetOutOfReach`."""

    at_mm: float
    reasons: tuple[Unsolved, ...]
    carried: bool = False


class ConfigurationEnds(Finding):
    """The configuration ends on the way: to go on in another one, a joint would have to jump."""

    at_mm: float
    joint: int
    angle_deg: float
    slides: bool = False


class MeetsSingularity(Finding):
    """The tool's path meets a singular pose; ``bounded`` if joint speeds stay finite there."""

    type: SingularityType
    at_mm: float
    bounded: bool


class PassesSingularity(Finding):
    """The tool's path passes a singular pose at a distance (wrist and elbow in deg, shoulder in mm)."""

    type: SingularityType
    at_mm: float
    distance: float


class FasterThanAssumed(Finding):
    """A joint (from 1) without a documented speed limit exceeds the assumed one; in mm/s if it ``slides``."""

    joint: int
    needed_deg_s: float
    assumed_deg_s: float
    slides: bool = False


class AcceleratesMoreThanAssumed(Finding):
    """A joint (from 1) exceeds its assumed acceleration; in mm/s^2 if it ``slides``."""

    joint: int
    needed_deg_s2: float
    assumed_deg_s2: float
    slides: bool = False


class MoreThanFullSpeed(Finding):
    """A joint move asks for more than 100 % of the joints' speed or acceleration."""

    percent: float


class ConfigurationChanges(Finding):
    """A joint move ends in another configuration than it starts in."""

    before: BranchLabel
    after: BranchLabel


class JointJumps(Finding):
    """A joint turns far in a joint move that hardly moves the tool."""

    joint: int
    angle_deg: float
    moved_mm: float


class WholeTurn(Finding):
    """A joint turns by more than half a turn, although an equivalent value within the limits is nearer."""

    joint: int
    angle_deg: float
    nearest_deg: float


class ArrivesOtherwise(Finding):
    """A line or arc ends at the tool pose of the given joints, but with other angles; mm if the joint ``slides``."""

    joint: int
    difference_deg: float
    slides: bool = False


class TurnsAtStart(Finding):
    """At the singular start of a line, a joint has to turn while the tool is at rest."""

    joint: int
    angle_deg: float


class TurnNotMet(Finding):
    """No solution within the limits has the signs of joint angles that the target's Turn (T) requires."""

    turn: int


class ConfigurationNotMet(Finding):
    """No solution within the limits has the target's configuration, or a ``line`` does not end in it."""

    text: str
    where: Literal["target", "line"]


class ConfigurationNotRead(Finding):
    """The target's configuration is unknown; the solution nearest to the previous joint values was taken."""

    text: str


class ConfigurationGuessed(Finding):
    """Neither the start nor the intended solution is known; the solution nearest to 0 was taken."""

    solutions: int


class BodiesTouch(Finding):
    """Two bodies that overlap on the way, from a time (s) of the motion on, and a place of a line; how deep at most.

    ``at_target``: whether they overlap at the motion's end. ``enlarged_mm``: by how much their shapes are larger than
    the meshes in them; an overlap by less is no contact for sure.
    """

    pair: Pair
    t_s: float
    at_mm: float | None
    depth_mm: float
    at_target: bool = False
    enlarged_mm: float = 0.0

    @property
    def is_certain(self) -> bool:
        """Whether the bodies overlap by more than their shapes are too large."""
        return self.depth_mm > self.enlarged_mm


class MotionCollides(Finding):
    """Bodies overlap during the motion, in the order of first contact; ``assumed``: no document gives the arm's
    shapes."""

    touches: tuple[BodiesTouch, ...]
    assumed: bool = False

    @property
    def at_mm(self) -> float | None:
        """How far the tool has come when the first bodies touch; None of a joint move."""
        return self.touches[0].at_mm

    def with_touches_of(self, others: Iterable[MotionCollides]) -> MotionCollides:
        """The same, each pair as deep as in any of the others, and followed by pairs that touch only there."""
        deepest: dict[Pair, BodiesTouch] = {touch.pair: touch for touch in self.touches}
        for touch in (touch for other in others for touch in other.touches):
            first = deepest.setdefault(touch.pair, touch)
            deepest[touch.pair] = replace(
                first,
                depth_mm=max(first.depth_mm, touch.depth_mm),
                at_target=first.at_target or touch.at_target,
            )
        return MotionCollides(tuple(deepest.values()), self.assumed)


class ClearOfAssumed(Finding):
    """The clearance to assumed shapes is less than their assumed uncertainty."""

    pair: Pair
    clearance_mm: float
    margin_mm: float


class ZoneCollides(Finding):
    """The programmed path is free of collisions, but not every path that the corner's zone allows; ``assumed`` as of
    :class:`MotionCollides`."""

    pair: Pair
    depth_mm: float
    assumed: bool = False


class ZoneNotSettled(Finding):
    """Not every path round the corner could be proven free: a body is too near."""

    least_mm: float


class ZoneTooLarge(Finding):
    """A zone is larger than half of a motion that it belongs to."""

    zone_mm: float
    motion_mm: float


class ZoneWithoutSize(Finding):
    """The program does not give the zone's size; half of each motion was assumed."""

    zone: str


class ArcHasNoCircle(Finding):
    """The arc's points determine no circle, or one of them is unknown."""


class ArcGoesOn(Finding):
    """The arc has an angle of its own (CA) and ends elsewhere than at its target.

    Attributes
    ----------
    angle_deg : None if it is not known; the arc is not checked then
    turns : whether the tool turns on the way, so that its orientation at the end is the target's by assumption
    """

    angle_deg: float | None
    turns: bool


class ArcTurnInDoubt(Finding):
    """The orientation of the arc's point does not tell in which sense the tool turns; the nearer one was checked."""


class SplineAsLine(Finding):
    """A spline was checked as a straight line between its points."""


class ExternalAxesLeftOut(Finding):
    """External axes were assumed not to move."""

    axes: tuple[str, ...]


class LineNotChecked(Finding):
    """The arm has no closed-form inverse: of lines and arcs only the targets were checked."""


class SpeedNotGiven(Finding):
    """The program does not give the speed, or by ``word``, which is not known; one was assumed (m/s, or a share)."""

    assumed: float
    unit: Literal["m/s", "share"]
    word: str = ""


class TurnSpeedNotGiven(Finding):
    """A line or arc takes as long as its tool turns, and the program does not give how fast it turns, or by ``word``,
    which is not known; a speed (deg/s) was assumed."""

    assumed_deg_s: float
    word: str = ""


class AccelerationNotKnown(Finding):
    """The program gives the acceleration by ``word``, whose value is not known; one was assumed."""

    word: str


class MayMove(Finding):
    """An instruction that was not understood may move the arm."""

    text: str


class MovesBesideProgram(Finding, code="moves_beside"):
    """A concurrent routine moves the arm; its motions were not checked together with the program's. Or (``sets``) it
    moves nothing, but sets ``names`` on which motions depend; these were checked without that."""

    routine: str
    kind: Literal["thread", "interrupt", "sets"]
    names: str = ""


class NeverReached(Finding):
    """A motion that no way through the program comes to, so that it was not examined; or, if it ``moves`` not for sure,
    an instruction that is not understood."""

    moves: bool = True


class MotionNotReached(Finding, code="not_come_to"):
    """A motion that was not reached before execution stopped."""


class RestNotChecked(Finding):
    """The program has more motions than are checked; from here on only ``targets`` targets were checked."""

    checked: int
    targets: int


class BothSidesChecked(Finding):
    """A condition that depends on the cell; both branches were followed."""

    condition: str


class NotFollowedToEnd(Finding):
    """An execution path was not followed to its end; ``limit`` as in ``Ending``."""

    kind: EndKind
    limit: int = 0


class LoopComesBackOtherwise(Finding):
    """When the loop repeats, a joint starts elsewhere than in the round that was checked; mm if it ``slides``."""

    joint: int
    difference_deg: float
    slides: bool = False


class BegunAgain(Finding):
    """At this motion more is found (by their ``codes``) if the program is begun again from where it ends."""

    codes: tuple[str, ...]


class LoadNotExamined(Finding):
    """From here on the program says what hangs on the flange; no torque is computed with it.

    Attributes
    ----------
    mass_kg : None where the text of the load does not give all its numbers
    text : of such a load
    """

    mass_kg: float | None
    text: str = ""


class LoadAbovePayload(Finding):
    """The load that the program states exceeds the arm's documented payload."""

    mass_kg: float
    payload_kg: float


CheckFinding = (
    ProgramFinding
    | AboveLimit
    | BelowLimit
    | SlideExceeded
    | CombinationExceeded
    | TooFast
    | AccelerationTooGreat
    | TargetNotGiven
    | FrameNotGiven
    | FrameTakenAsFlange
    | FrameOfSeveral
    | FramesFromRobotFile
    | FramesDecide
    | FrameGivenTwice
    | KeptToNextStart
    | SetElsewhere
    | WaitsForOthers
    | ErrorsNotFollowed
    | ToolStatedElsewhere
    | PositionCompleted
    | TurnsOtherwise
    | TurnsEitherWay
    | TurnNotFollowed
    | RelativeTurnAssumed
    | FramesInDoubt
    | PathNotKnown
    | TargetOutOfReach
    | StretchOutOfReach
    | ConfigurationEnds
    | MeetsSingularity
    | PassesSingularity
    | FasterThanAssumed
    | AcceleratesMoreThanAssumed
    | Undecided
    | MoreThanFullSpeed
    | ConfigurationChanges
    | JointJumps
    | WholeTurn
    | ArrivesOtherwise
    | TurnsAtStart
    | TurnNotMet
    | ConfigurationNotMet
    | ConfigurationNotRead
    | ConfigurationGuessed
    | MotionCollides
    | ClearOfAssumed
    | PairsUnexamined
    | ZoneCollides
    | ZoneNotSettled
    | ZoneTooLarge
    | ZoneWithoutSize
    | ArcHasNoCircle
    | ArcGoesOn
    | ArcTurnInDoubt
    | SplineAsLine
    | ExternalAxesLeftOut
    | LineNotChecked
    | SpeedNotGiven
    | TurnSpeedNotGiven
    | AccelerationNotKnown
    | MayMove
    | MovesBesideProgram
    | NeverReached
    | MotionNotReached
    | RestNotChecked
    | BothSidesChecked
    | NotFollowedToEnd
    | LoopComesBackOtherwise
    | BegunAgain
    | LoadNotExamined
    | LoadAbovePayload
)

FAILS = frozenset(
    (
        *("target_not_given", "target_out_of_reach", "way_out_of_reach", "configuration_ends"),
        *(
            "above_limit",
            "below_limit",
            "slide_exceeded",
            "combination_exceeded",
            "too_fast",
            "acceleration_too_great",
            "motion_collides",
            "arc_has_no_circle",
            "load_above_payload",
        ),
    )
)
NOTES = frozenset(
    (
        *(
            "frames_from_robot_file",
            "speed_not_given",
            "turn_speed_not_given",
            "load_not_examined",
        ),
        *("both_sides_checked", "program_form_inferred", "program_other_encoding", "program_rows_from_rest"),
        "program_joint_speed_inferred",
    )
)


NOT_AT_FAULT = ("turns_with_arc", "perhaps_changed", "not_evaluated", "position_unknown")
"""Why a target may not be known though the program determines it."""


def level_of(finding: CheckFinding) -> Level:
    """Severity of a finding; ``fail`` where the program can't be executed as written."""
    if isinstance(finding, MeetsSingularity):
        return "caution" if finding.bounded else "fail"
    if isinstance(finding, NotFollowedToEnd) and finding.kind == "recursion":
        return "fail"
    if isinstance(finding, ArcGoesOn):
        return "caution" if finding.turns or finding.angle_deg is None else "note"
    if isinstance(finding, TargetNotGiven) and finding.reason in NOT_AT_FAULT:
        return "caution"
    if isinstance(finding, FrameNotGiven):
        return "fail" if finding.needed else "caution"
    if isinstance(finding, TargetOutOfReach | StretchOutOfReach) and finding.carried:
        return "caution"
    if isinstance(finding, MotionCollides):
        return "fail" if any(touch.is_certain for touch in finding.touches) else "caution"
    if isinstance(finding, SpeedNotGiven | TurnSpeedNotGiven) and finding.word:
        return "caution"
    if isinstance(finding, LoadNotExamined) and (finding.mass_kg is None or finding.text):
        return "caution"
    return "fail" if finding.code in FAILS else "note" if finding.code in NOTES else "caution"


SIZES = (
    *("depth_mm", "needed_deg_s", "needed_deg_s2", "percent", "excess_mm", "excess"),
    *("angle_deg", "difference_deg", "off_deg"),
)
"""Parameters of which the greater is the worse."""


def gravity(finding: CheckFinding) -> float:
    """How far a finding goes: of like ones at one instruction the greatest is the worst. 0 where it has no size."""
    if isinstance(finding, AboveLimit | BelowLimit):
        return abs(finding.reached_deg - finding.limit_deg)
    if isinstance(finding, ClearOfAssumed):
        return -finding.clearance_mm
    if isinstance(finding, ZoneNotSettled):
        return -finding.least_mm
    if isinstance(finding, PassesSingularity):
        return -finding.distance
    if isinstance(finding, TargetOutOfReach | StretchOutOfReach):
        return min((_misses_by(each) for each in finding.reasons), default=0.0)
    if isinstance(finding, ZoneTooLarge):
        return finding.zone_mm / max(finding.motion_mm, 1e-9)
    return max((abs(getattr(finding, name, None) or 0.0) for name in SIZES), default=0.0)


def _misses_by(reason: Unsolved) -> float:
    """mm by which the arm misses a pose, deg if its wrist tilts too little."""
    miss = getattr(reason.why, "miss", None)
    return float(miss.position_mm if miss is not None else getattr(reason.why, "gap_mm", 0.0))


def worst_of(levels: Iterable[Level]) -> Level:
    """The most severe level; ``pass`` if there are no findings."""
    return max(levels, key=RANKS.__getitem__, default="pass")
