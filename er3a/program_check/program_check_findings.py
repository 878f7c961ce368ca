"""Findings of a program check, in addition to those of :mod:`er3a.planning.motion_faults`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Literal

from er3a.by_value import Finding
from er3a.collision.pairs import Pair, PairsUnexamined
from er3a.kinematics.singularity import SingularityType
from er3a.kinematics.solutions import Unsolved
from er3a.planning.motion_faults import AboveLimit, AccelerationTooGreat, BelowLimit, TooFast, TooFastIfAssumed
from er3a.programs.instructions import Unresolved
from er3a.programs.program_findings import ProgramFinding
from er3a.robots.joint_limits import CombinationExceeded, SlideExceeded

Level = Literal["pass", "note", "caution", "fail"]
RANKS: dict[Level, int] = {"pass": 0, "note": 1, "caution": 2, "fail": 3}
"""Of errors, of questions that an input answers, of notes."""

NotFollowedReason = Literal[
    Unresolved,
    "instruction",
    "setting",
    "tool",
    "base",
    "turns_with_path",
    "external_axes",
    "arc_angle",
    "half_turn",
    "redundant",
    "operations",
    "ways",
    "depth",
    "unreached",
]


class NotFollowed(Finding):
    """What the check does not follow: an instruction, a target, a frame or a setting of a motion (``text``), or the
    program's course from here on."""

    text: str
    reason: NotFollowedReason


class StartNotKnown(Finding, code="way_not_known"):
    """The start of the motion is not known, so only its target was checked."""


class ConfigurationGuessed(Finding):
    """Neither the start nor the intended solution is known; the solution nearest to 0 was taken."""

    solutions: int


class ConfigurationNotMet(Finding):
    """No solution within the limits has the target's configuration, or a line does not end in it."""

    text: str


class TargetOutOfReach(Finding):
    """No IK solution reaches the target."""

    reasons: tuple[Unsolved, ...]


class StretchOutOfReach(Finding, code="way_out_of_reach"):
    """The tool leaves the arm's reach on the way to the target."""

    at_mm: float
    reasons: tuple[Unsolved, ...]


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
    """Bodies overlap during the motion, in the order of first contact; ``assumed``: by shapes of the arm that no
    document gives, and by none of what is carried."""

    touches: tuple[BodiesTouch, ...]
    assumed: bool = False

    @property
    def at_mm(self) -> float | None:
        """How far the tool has come when the first bodies touch; None of a joint move."""
        return self.touches[0].at_mm

    def with_touches_of(self, others: Iterable[MotionCollides]) -> MotionCollides:
        """The same collision, together with what was found for other ways to the same motion.

        Parameters
        ----------
        others : findings of the same instruction

        Returns
        -------
        finding : each pair with its greatest depth; pairs that touch only in the others follow
        """
        deepest: dict[Pair, BodiesTouch] = {touch.pair: touch for touch in self.touches}
        for touch in (touch for other in others for touch in other.touches):
            first = deepest.setdefault(touch.pair, touch)
            depth, at_target = max(first.depth_mm, touch.depth_mm), first.at_target or touch.at_target
            deepest[touch.pair] = replace(first, depth_mm=depth, at_target=at_target)
        return MotionCollides(tuple(deepest.values()), self.assumed)


class ClearOfAssumed(Finding):
    """The clearance to assumed shapes is less than their assumed uncertainty."""

    pair: Pair
    clearance_mm: float
    margin_mm: float


class ZoneCollides(Finding):
    """The programmed path is free of collisions, but not the corner that its zone rounds; ``assumed`` as of
    :class:`MotionCollides`."""

    pair: Pair
    depth_mm: float
    assumed: bool = False


class ZoneTooLarge(Finding):
    """A zone is larger than half of a motion that it belongs to."""

    zone_mm: float
    motion_mm: float


class ClearanceNotProven(Finding):
    """Points of the motion are clear, but what lies between them was not settled in the given time."""


class SpeedNotGiven(Finding):
    """The program does not give the speed, or by ``word``, which is not known; one was assumed (m/s, or a share).

    ``refused``: whether it is a number that no controller takes.
    """

    assumed: float
    unit: Literal["m/s", "share"]
    word: str = ""
    refused: bool = False


class SuspectNumber(Finding):
    """A number that is likely a mistake: ``text`` is what it is, ``usual`` what it would be, or what others are.

    ``unit``: in which it seems to be meant.
    """

    kind: Literal["unit", "speed", "impossible_speed", "share", "tool", "base"]
    text: str
    usual: str
    unit: str = ""


class FramesFromRobotFile(Finding):
    """The program sets no tool, no base, or neither, before a pose; those of the robot file were taken."""

    kind: Literal["tool", "base", "both"]


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
    | TooFastIfAssumed
    | NotFollowed
    | StartNotKnown
    | ConfigurationGuessed
    | ConfigurationNotMet
    | TargetOutOfReach
    | StretchOutOfReach
    | ConfigurationEnds
    | MeetsSingularity
    | PassesSingularity
    | JointJumps
    | WholeTurn
    | ArrivesOtherwise
    | MotionCollides
    | ClearOfAssumed
    | PairsUnexamined
    | ZoneCollides
    | ZoneTooLarge
    | ClearanceNotProven
    | SpeedNotGiven
    | SuspectNumber
    | FramesFromRobotFile
    | LoadAbovePayload
)

FAILS = frozenset(
    (
        *("target_out_of_reach", "way_out_of_reach", "configuration_ends", "above_limit", "below_limit"),
        *("slide_exceeded", "combination_exceeded", "too_fast", "acceleration_too_great", "load_above_payload"),
    )
)
NOTES = frozenset(("frames_from_robot_file", "clear_of_assumed", "passes_singularity"))
WRONG = frozenset(("not_understood", "not_finite", "too_far", "too_many_joints"))
"""Why a target is none: the program gives it, but not as a target of its motion or of the arm."""


def level_of(finding: CheckFinding) -> Level:
    """Severity of a finding: ``fail`` where the program can't be executed as written, never on a guess.

    Parameters
    ----------
    finding : of any kind; a collision fails only with shapes that are not assumed, and bodies that overlap for certain

    Returns
    -------
    level : ``note``, ``caution`` or ``fail``; ``caution`` for all that no rule names
    """
    match finding:
        case MeetsSingularity(bounded=bounded):
            return "note" if bounded else "fail"
        case NotFollowed(reason=reason):
            return "fail" if reason in WRONG else "caution"
        case SpeedNotGiven(word=word, refused=refused):
            return "fail" if refused else "caution" if word else "note"
        case SuspectNumber(kind="impossible_speed") | SuspectNumber(unit="mm" | "mm/s"):
            return "fail"
        case MotionCollides(touches=touches, assumed=assumed):
            return "fail" if not assumed and any(touch.is_certain for touch in touches) else "caution"
    return "fail" if finding.code in FAILS else "note" if finding.code in NOTES else "caution"


def gravity(finding: CheckFinding) -> float:
    """How far a finding goes, to choose the worst of like ones.

    Parameters
    ----------
    finding : compared only with those of its kind at the same instruction

    Returns
    -------
    size : in the finding's own unit, the greater the worse; 0 where it has no size
    """
    if isinstance(finding, AboveLimit | BelowLimit):
        return abs(finding.reached_deg - finding.limit_deg)
    if isinstance(finding, ClearOfAssumed):
        return -finding.clearance_mm
    if isinstance(finding, PassesSingularity):
        return -finding.distance
    if isinstance(finding, ZoneTooLarge):
        return finding.zone_mm / max(finding.motion_mm, 1e-9)
    sizes = ("depth_mm", "needed_deg_s", "needed_deg_s2", "excess_mm", "excess", "angle_deg", "difference_deg")
    return max((abs(getattr(finding, name, None) or 0.0) for name in sizes), default=0.0)


def worst_of(levels: Iterable[Level]) -> Level:
    """The most severe of levels.

    Parameters
    ----------
    levels : in any order

    Returns
    -------
    level : ``pass`` if there are none; the order is pass, note, caution, fail
    """
    return max(levels, key=RANKS.__getitem__, default="pass")
