"""Findings of a program check, in addition to those of :mod:`er3a.planning.motion_faults`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from er3a.by_value import Finding
from er3a.collision.pairs import Pair, PairsUnexamined
from er3a.kinematics.classes.class_solvers import BranchLabel
from er3a.kinematics.singularity import SingularityType
from er3a.kinematics.solutions import Unsolved
from er3a.planning.motion_faults import AboveLimit, BelowLimit, TooFast
from er3a.planning.tool_proof import Undecided
from er3a.programs.execution import EndKind
from er3a.programs.instructions import Unresolved
from er3a.programs.program_findings import ProgramFinding
from er3a.robots.joint_limits import CombinationExceeded, SlideExceeded

Level = Literal["pass", "note", "caution", "fail"]
RANKS: dict[Level, int] = {"pass": 0, "note": 1, "caution": 2, "fail": 3}


class TargetNotGiven(Finding):
    """The program's text does not fix the target."""

    target: str
    reason: Unresolved


class FrameNotGiven(Finding):
    """A tool or base is known by its name alone; ``needed`` if the motion can't be placed without it."""

    name: str
    frame: Literal["tool", "base"]
    needed: bool


class FrameTakenAsFlange(Finding):
    """A tool that is called tool0 and given nowhere was taken for the flange."""

    name: str


class PathNotKnown(Finding, code="way_not_known"):
    """Where the arm comes from is not known, so that only the target was checked."""


class TargetOutOfReach(Finding):
    """No solution of the arm brings the tool to the target; ``reasons`` are empty where they were not looked for."""

    reasons: tuple[Unsolved, ...]


class StretchOutOfReach(Finding, code="way_out_of_reach"):
    """The tool leaves the reach on its way to the target."""

    at_mm: float
    reasons: tuple[Unsolved, ...]


class ConfigurationEnds(Finding):
    """On the way the arm would have to go over to another configuration at once: a joint would have to jump."""

    at_mm: float
    joint: int
    angle_deg: float
    slides: bool = False


class MeetsSingularity(Finding):
    """The tool's way meets a singular pose; ``bounded`` if the joint speeds stay finite there."""

    type: SingularityType
    at_mm: float
    bounded: bool


class PassesSingularity(Finding):
    """The tool's way passes by a singular pose at a distance (of wrist and elbow in deg, of the shoulder in mm)."""

    type: SingularityType
    at_mm: float
    distance: float


class FasterThanAssumed(Finding):
    """A joint (from 1) of no documented speed would have to move faster than is assumed; mm if it ``slides``."""

    joint: int
    needed_deg_s: float
    assumed_deg_s: float
    slides: bool = False


class AcceleratesMoreThanAssumed(Finding):
    """A joint (from 1) would have to accelerate more than is assumed of it; values are in mm if it ``slides``."""

    joint: int
    needed_deg_s2: float
    assumed_deg_s2: float
    slides: bool = False


class MoreThanFullSpeed(Finding):
    """A joint move asks for more than 100 % of the joints' speed or acceleration."""

    percent: float


class ConfigurationChanges(Finding):
    """A joint move goes over to another configuration of the arm."""

    before: BranchLabel
    after: BranchLabel


class JointJumps(Finding):
    """A joint turns far in a joint move that takes the tool hardly anywhere."""

    joint: int
    angle_deg: float
    moved_mm: float


class WholeTurn(Finding):
    """A joint turns by more than half a turn, where its nearest equivalent within the limits is nearer."""

    joint: int
    angle_deg: float
    nearest_deg: float


class ArrivesOtherwise(Finding):
    """A line or arc to joint angles ends at their tool pose, but in other joint angles; mm if the joint ``slides``."""

    joint: int
    difference_deg: float
    slides: bool = False


class TurnsAtStart(Finding):
    """At the singular start of a line a joint has to turn with the tool at rest."""

    joint: int
    angle_deg: float


class TurnNotMet(Finding):
    """No solution within the limits has the signs of the joint angles that the target's Turn (T) asks for."""

    turn: int


class ConfigurationNotMet(Finding):
    """No solution within the limits has the target's configuration, or a ``line`` does not arrive in it."""

    text: str
    where: Literal["target", "line"]


class ConfigurationNotRead(Finding):
    """What the target says of its configuration is not known; the solution nearest to the joints before was taken."""

    text: str


class ConfigurationGuessed(Finding):
    """Where the arm comes from is not known, nor which of its solutions is meant: the one nearest to 0 was taken."""

    solutions: int


class BodiesTouch(Finding):
    """Two bodies that overlap on the way, from a time (s) of the motion on, and a place of a line; how deep at most.

    ``at_target``: whether they overlap at the motion's end.
    """

    pair: Pair
    t_s: float
    at_mm: float | None
    depth_mm: float
    at_target: bool = False


class MotionCollides(Finding):
    """Bodies overlap on the way, the first to touch first."""

    touches: tuple[BodiesTouch, ...]

    @property
    def at_mm(self) -> float | None:
        """How far the tool has come when the first bodies touch; None of a joint move."""
        return self.touches[0].at_mm


class ClearOfAssumed(Finding):
    """The arm is clear of assumed shapes by less than what such shapes may be wrong by."""

    pair: Pair
    clearance_mm: float
    margin_mm: float


class ZoneCollides(Finding):
    """The arm is free on the programmed way, but not on each way round the corner that the zone allows."""

    pair: Pair
    depth_mm: float


class ZoneNotSettled(Finding):
    """So near to something that the ways round the corner could not all be measured."""

    least_mm: float


class ZoneTooLarge(Finding):
    """A zone is larger than half of a motion that it lies on."""

    zone_mm: float
    motion_mm: float


class ZoneWithoutSize(Finding):
    """A zone whose size the program does not give; half of each motion was taken."""

    zone: str


class ArcHasNoCircle(Finding):
    """The arc's points fix no circle, or one of them is not known."""


class ArcGoesOn(Finding):
    """The arc has an angle of its own (CA) and ends elsewhere than at its target.

    Attributes
    ----------
    angle_deg : None if it is not known; the arc is not checked then
    turns : whether the tool turns on the way, so that its orientation at the end is the target's by assumption
    """

    angle_deg: float | None
    turns: bool


class SplineAsLine(Finding):
    """A spline was checked as a straight line between its points."""


class ExternalAxesLeftOut(Finding):
    """Axes beyond the arm's were taken to stand still."""

    axes: tuple[str, ...]


class LineNotChecked(Finding):
    """The arm has no closed-form inverse, so that lines and arcs were not followed; only their targets were checked."""


class SpeedNotGiven(Finding):
    """The program does not give the speed, or by ``word``, which is not known; one was assumed (m/s, or a share)."""

    assumed: float
    unit: Literal["m/s", "share"]
    word: str = ""


class MayMove(Finding):
    """An instruction that is not understood and may move the arm."""

    text: str


class MovesBesideProgram(Finding, code="moves_beside"):
    """A routine moves the arm beside the program; its motions and the program's were not checked as one."""

    routine: str
    kind: Literal["thread", "interrupt"]


class NeverReached(Finding):
    """A motion that no way through the program comes to, so that it was not examined; or, if it ``moves`` not for sure,
    an instruction that is not understood."""

    moves: bool = True


class MotionNotReached(Finding, code="not_come_to"):
    """A motion that the program had not come to when it was followed no further."""


class RestNotChecked(Finding):
    """The program has more motions than are checked; of those from here on only ``targets`` targets are."""

    checked: int
    targets: int


class BothSidesChecked(Finding):
    """A condition that only the cell knows; both sides were followed."""

    condition: str


class NotFollowedToEnd(Finding):
    """A way through the program was not followed to its end; ``limit`` as of an ending."""

    kind: EndKind
    limit: int = 0


class LoopComesBackOtherwise(Finding):
    """When the loop begins again, a joint is elsewhere than in the round that was checked; mm if it ``slides``."""

    joint: int
    difference_deg: float
    slides: bool = False


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
    """What the program says hangs on the flange is more than the arm's document allows."""

    mass_kg: float
    payload_kg: float


CheckFinding = (
    ProgramFinding
    | AboveLimit
    | BelowLimit
    | SlideExceeded
    | CombinationExceeded
    | TooFast
    | TargetNotGiven
    | FrameNotGiven
    | FrameTakenAsFlange
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
    | SplineAsLine
    | ExternalAxesLeftOut
    | LineNotChecked
    | SpeedNotGiven
    | MayMove
    | MovesBesideProgram
    | NeverReached
    | MotionNotReached
    | RestNotChecked
    | BothSidesChecked
    | NotFollowedToEnd
    | LoopComesBackOtherwise
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
            "motion_collides",
            "arc_has_no_circle",
            "load_above_payload",
        ),
    )
)
NOTES = frozenset(
    (
        *("way_not_known", "frame_taken_as_flange", "speed_not_given", "load_not_examined"),
        *("both_sides_checked", "program_form_inferred", "program_other_encoding"),
    )
)


def level_of(finding: CheckFinding) -> Level:
    """How much a finding weighs: ``fail`` where the program can't be carried out as it is written."""
    if isinstance(finding, MeetsSingularity):
        return "caution" if finding.bounded else "fail"
    if isinstance(finding, NotFollowedToEnd) and finding.kind == "recursion":
        return "fail"
    if isinstance(finding, ArcGoesOn):
        return "caution" if finding.turns or finding.angle_deg is None else "note"
    if isinstance(finding, FrameNotGiven):
        return "fail" if finding.needed else "caution"
    if isinstance(finding, SpeedNotGiven) and finding.word:
        return "caution"
    return "fail" if finding.code in FAILS else "note" if finding.code in NOTES else "caution"


def worst_of(levels: Iterable[Level]) -> Level:
    """The level that weighs most; ``pass`` of none."""
    return max(levels, key=RANKS.__getitem__, default="pass")
