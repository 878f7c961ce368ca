"""Findings of a program check, in addition to those of :mod:`er3a.planning.motion_faults`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

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


@dataclass(frozen=True)
class TargetNotGiven:
    """The program's text does not fix the target."""

    target: str
    reason: Unresolved
    code: Literal["target_not_given"] = "target_not_given"


@dataclass(frozen=True)
class FrameNotGiven:
    """A tool or base is known by its name alone; ``needed`` if the motion can't be placed without it."""

    name: str
    frame: Literal["tool", "base"]
    needed: bool
    code: Literal["frame_not_given"] = "frame_not_given"


@dataclass(frozen=True)
class FrameTakenAsFlange:
    """A tool that is called tool0 and given nowhere was taken for the flange."""

    name: str
    code: Literal["frame_taken_as_flange"] = "frame_taken_as_flange"


@dataclass(frozen=True)
class PathNotKnown:
    """Where the arm comes from is not known, so that only the target was checked."""

    code: Literal["way_not_known"] = "way_not_known"


@dataclass(frozen=True)
class TargetOutOfReach:
    """No solution of the arm brings the tool to the target; ``reasons`` are empty where they were not looked for."""

    reasons: tuple[Unsolved, ...]
    code: Literal["target_out_of_reach"] = "target_out_of_reach"


@dataclass(frozen=True)
class StretchOutOfReach:
    """The tool leaves the reach on its way to the target."""

    at_mm: float
    reasons: tuple[Unsolved, ...]
    code: Literal["way_out_of_reach"] = "way_out_of_reach"


@dataclass(frozen=True)
class ConfigurationEnds:
    """On the way the arm would have to go over to another configuration at once: a joint would have to jump."""

    at_mm: float
    joint: int
    angle_deg: float
    slides: bool = False
    code: Literal["configuration_ends"] = "configuration_ends"


@dataclass(frozen=True)
class MeetsSingularity:
    """The tool's way meets a singular pose; ``bounded`` if the joint speeds stay finite there."""

    type: SingularityType
    at_mm: float
    bounded: bool
    code: Literal["meets_singularity"] = "meets_singularity"


@dataclass(frozen=True)
class PassesSingularity:
    """The tool's way passes by a singular pose at a distance (of wrist and elbow in deg, of the shoulder in mm)."""

    type: SingularityType
    at_mm: float
    distance: float
    code: Literal["passes_singularity"] = "passes_singularity"


@dataclass(frozen=True)
class FasterThanAssumed:
    """A joint (from 1) of no documented speed would have to move faster than is assumed; mm if it ``slides``."""

    joint: int
    needed_deg_s: float
    assumed_deg_s: float
    slides: bool = False
    code: Literal["faster_than_assumed"] = "faster_than_assumed"


@dataclass(frozen=True)
class AcceleratesMoreThanAssumed:
    """A joint (from 1) would have to accelerate more than is assumed of it; values are in mm if it ``slides``."""

    joint: int
    needed_deg_s2: float
    assumed_deg_s2: float
    slides: bool = False
    code: Literal["accelerates_more_than_assumed"] = "accelerates_more_than_assumed"


@dataclass(frozen=True)
class MoreThanFullSpeed:
    """A joint move asks for more than 100 % of the joints' speed or acceleration."""

    percent: float
    code: Literal["more_than_full_speed"] = "more_than_full_speed"


@dataclass(frozen=True)
class ConfigurationChanges:
    """A joint move goes over to another configuration of the arm."""

    before: BranchLabel
    after: BranchLabel
    code: Literal["configuration_changes"] = "configuration_changes"


@dataclass(frozen=True)
class JointJumps:
    """A joint turns far in a joint move that takes the tool hardly anywhere."""

    joint: int
    angle_deg: float
    moved_mm: float
    code: Literal["joint_jumps"] = "joint_jumps"


@dataclass(frozen=True)
class WholeTurn:
    """A joint turns by more than half a turn, where its nearest equivalent within the limits is nearer."""

    joint: int
    angle_deg: float
    nearest_deg: float
    code: Literal["whole_turn"] = "whole_turn"


@dataclass(frozen=True)
class ArrivesOtherwise:
    """A line or arc to joint angles ends at their tool pose, but in other joint angles; mm if the joint ``slides``."""

    joint: int
    difference_deg: float
    slides: bool = False
    code: Literal["arrives_otherwise"] = "arrives_otherwise"


@dataclass(frozen=True)
class TurnsAtStart:
    """At the singular start of a line a joint has to turn with the tool at rest."""

    joint: int
    angle_deg: float
    code: Literal["turns_at_start"] = "turns_at_start"


@dataclass(frozen=True)
class TurnNotMet:
    """No solution within the limits has the signs of the joint angles that the target's Turn (T) asks for."""

    turn: int
    code: Literal["turn_not_met"] = "turn_not_met"


@dataclass(frozen=True)
class ConfigurationNotMet:
    """No solution within the limits has the target's configuration, or a ``line`` does not arrive in it."""

    text: str
    where: Literal["target", "line"]
    code: Literal["configuration_not_met"] = "configuration_not_met"


@dataclass(frozen=True)
class ConfigurationNotRead:
    """What the target says of its configuration is not known; the solution nearest to the joints before was taken."""

    text: str
    code: Literal["configuration_not_read"] = "configuration_not_read"


@dataclass(frozen=True)
class ConfigurationGuessed:
    """Where the arm comes from is not known, nor which of its solutions is meant: the one nearest to 0 was taken."""

    solutions: int
    code: Literal["configuration_guessed"] = "configuration_guessed"


@dataclass(frozen=True)
class BodiesTouch:
    """Two bodies that overlap on the way, from a time (s) of the motion on, and a place of a line; how deep at most."""

    pair: Pair
    t_s: float
    at_mm: float | None
    depth_mm: float
    code: Literal["bodies_touch"] = "bodies_touch"


@dataclass(frozen=True)
class MotionCollides:
    """Bodies overlap on the way, the first to touch first."""

    touches: tuple[BodiesTouch, ...]
    code: Literal["motion_collides"] = "motion_collides"

    @property
    def at_mm(self) -> float | None:
        """How far the tool has come when the first bodies touch; None of a joint move."""
        return self.touches[0].at_mm


@dataclass(frozen=True)
class ClearOfAssumed:
    """The arm is clear of assumed shapes by less than what such shapes may be wrong by."""

    pair: Pair
    clearance_mm: float
    margin_mm: float
    code: Literal["clear_of_assumed"] = "clear_of_assumed"


@dataclass(frozen=True)
class ZoneCollides:
    """The arm is free on the programmed way, but not on each way round the corner that the zone allows."""

    pair: Pair
    depth_mm: float
    code: Literal["zone_collides"] = "zone_collides"


@dataclass(frozen=True)
class ZoneNotSettled:
    """So near to something that the ways round the corner could not all be measured."""

    least_mm: float
    code: Literal["zone_not_settled"] = "zone_not_settled"


@dataclass(frozen=True)
class ZoneTooLarge:
    """A zone is larger than half of a motion that it lies on."""

    zone_mm: float
    motion_mm: float
    code: Literal["zone_too_large"] = "zone_too_large"


@dataclass(frozen=True)
class ZoneWithoutSize:
    """A zone whose size the program does not give; half of each motion was taken."""

    zone: str
    code: Literal["zone_without_size"] = "zone_without_size"


@dataclass(frozen=True)
class ArcHasNoCircle:
    """The arc's points fix no circle, or one of them is not known."""

    code: Literal["arc_has_no_circle"] = "arc_has_no_circle"


@dataclass(frozen=True)
class ArcGoesOn:
    """The arc has an angle of its own (CA) and ends elsewhere than at its target.

    Attributes
    ----------
    angle_deg : None if it is not known; the arc is not checked then
    turns : whether the tool turns on the way, so that its orientation at the end is the target's by assumption
    """

    angle_deg: float | None
    turns: bool
    code: Literal["arc_goes_on"] = "arc_goes_on"


@dataclass(frozen=True)
class SplineAsLine:
    """A spline was checked as a straight line between its points."""

    code: Literal["spline_as_line"] = "spline_as_line"


@dataclass(frozen=True)
class ExternalAxesLeftOut:
    """Axes beyond the arm's were taken to stand still."""

    axes: tuple[str, ...]
    code: Literal["external_axes_left_out"] = "external_axes_left_out"


@dataclass(frozen=True)
class LineNotChecked:
    """The arm has no closed-form inverse, so that lines and arcs were not followed; only their targets were checked."""

    code: Literal["line_not_checked"] = "line_not_checked"


@dataclass(frozen=True)
class SpeedNotGiven:
    """The program does not give the speed, or by ``word``, which is not known; one was assumed (m/s, or a share)."""

    assumed: float
    unit: Literal["m/s", "share"]
    word: str = ""
    code: Literal["speed_not_given"] = "speed_not_given"


@dataclass(frozen=True)
class MayMove:
    """An instruction that is not understood and may move the arm."""

    text: str
    code: Literal["may_move"] = "may_move"


@dataclass(frozen=True)
class MovesBesideProgram:
    """A routine moves the arm beside the program; its motions and the program's were not checked as one."""

    routine: str
    kind: Literal["thread", "interrupt"]
    code: Literal["moves_beside"] = "moves_beside"


@dataclass(frozen=True)
class NeverReached:
    """A motion that no way through the program comes to, so that it was not examined; or, if it ``moves`` not for sure,
    an instruction that is not understood."""

    moves: bool = True
    code: Literal["never_reached"] = "never_reached"


@dataclass(frozen=True)
class MotionNotReached:
    """A motion that the program had not come to when it was followed no further."""

    code: Literal["not_come_to"] = "not_come_to"


@dataclass(frozen=True)
class RestNotChecked:
    """The program has more motions than are checked; of those from here on only ``targets`` targets are."""

    checked: int
    targets: int
    code: Literal["rest_not_checked"] = "rest_not_checked"


@dataclass(frozen=True)
class BothSidesChecked:
    """A condition that only the cell knows; both sides were followed."""

    condition: str
    code: Literal["both_sides_checked"] = "both_sides_checked"


@dataclass(frozen=True)
class NotFollowedToEnd:
    """A way through the program was not followed to its end; ``limit`` as of an ending."""

    kind: EndKind
    limit: int = 0
    code: Literal["not_followed_to_end"] = "not_followed_to_end"


@dataclass(frozen=True)
class LoopComesBackOtherwise:
    """When the loop begins again, a joint is elsewhere than in the round that was checked; mm if it ``slides``."""

    joint: int
    difference_deg: float
    slides: bool = False
    code: Literal["loop_comes_back_otherwise"] = "loop_comes_back_otherwise"


@dataclass(frozen=True)
class LoadNotExamined:
    """From here on the program says what hangs on the flange; no torque is computed with it.

    Attributes
    ----------
    mass_kg : None where the text of the load does not give all its numbers
    text : of such a load
    """

    mass_kg: float | None
    text: str = ""
    code: Literal["load_not_examined"] = "load_not_examined"


@dataclass(frozen=True)
class LoadAbovePayload:
    """What the program says hangs on the flange is more than the arm's document allows."""

    mass_kg: float
    payload_kg: float
    code: Literal["load_above_payload"] = "load_above_payload"


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
