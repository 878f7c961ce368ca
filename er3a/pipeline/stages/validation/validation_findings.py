"""What the stage finds: names of its own checks, reasons why something is not judged, and its verdicts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from er3a.diagnosis.conclusions import MainFault, MostLikelyFault, TooSmallToTell
from er3a.identifiability.entry_evidence import Tolerance
from er3a.identifiability.proposals import Proposal
from er3a.identifiability.reactions import CheckCounts
from er3a.identifiability.statements import InconsistentWithOwnText, NotTheRobotDescribed
from er3a.identifiability.tool_motion import ToolOff
from er3a.identifiability.verdict_parts import PartName, PartStatus
from er3a.kinematics.wrist_partitioned import ClosedFormMissing
from er3a.references.subjects import DrawingCorner, DrawingExtent, Reach, ReferenceSubject, Subject
from er3a.robots.robot import Grade

ModelGroup = Literal["table_sanity", "round_trips"]
SelfChecked = Literal[
    "numbers_not_finite",
    "crossed_limits",
    "odd_directions",
    "length_unit",
    "limit_unit",
    "closed_form",
    "joints_to_pose_to_joints",
    "unsolved_poses",
    "joint_error",
    "position_error",
    "orientation_error",
]


@dataclass(frozen=True)
class SelfCheck(Subject):
    """A check of the model that needs no document."""

    quantity: SelfChecked
    code: Literal["self_check"] = "self_check"


@dataclass(frozen=True)
class WholeGroup(Subject):
    """All that references of a group could say."""

    group: str
    code: Literal["whole_group"] = "whole_group"


CheckSubject = ReferenceSubject | SelfCheck | WholeGroup


@dataclass(frozen=True)
class NamedPose:
    """A pose by the name that its source gives it."""

    name: str
    code: Literal["named_pose"] = "named_pose"


KeyPose = NamedPose | DrawingCorner | DrawingExtent | Reach


@dataclass(frozen=True)
class NotInRobotFile:
    """The robot's file gives no value."""

    code: Literal["not_in_robot_file"] = "not_in_robot_file"


@dataclass(frozen=True)
class SourceGivesNone:
    """The source says that it gives no value."""

    code: Literal["source_gives_none"] = "source_gives_none"


@dataclass(frozen=True)
class SetHasNoData:
    """A reference set says nothing about it."""

    reference_set: str
    code: Literal["set_has_no_data"] = "set_has_no_data"


@dataclass(frozen=True)
class InNoSet:
    """None of the robot's reference sets says anything about it."""

    code: Literal["in_no_set"] = "in_no_set"


@dataclass(frozen=True)
class NumbersMissing:
    """The table lacks numbers, so nothing can be computed from it."""

    code: Literal["numbers_missing"] = "numbers_missing"


@dataclass(frozen=True)
class NoClosedForm:
    """The arm has no closed-form inverse."""

    missing: ClosedFormMissing
    code: Literal["no_closed_form"] = "no_closed_form"


@dataclass(frozen=True)
class NearSingularLeftOut:
    """Joint errors are judged of those random poses only that are not near a singularity."""

    judged: int
    poses: int
    wrist_deg: float
    shoulder_mm: float
    code: Literal["near_singular_left_out"] = "near_singular_left_out"


Note = (
    NotInRobotFile
    | SourceGivesNone
    | SetHasNoData
    | InNoSet
    | NumbersMissing
    | ClosedFormMissing
    | NoClosedForm
    | NearSingularLeftOut
)


LikelyFault = MostLikelyFault | MainFault | TooSmallToTell


@dataclass(frozen=True)
class Contradiction:
    """References that no model can meet all: the first such number, and how many more there are."""

    subject: ReferenceSubject
    unit: str
    stated: tuple[float, ...]
    more: int
    code: Literal["contradiction"] = "contradiction"


@dataclass(frozen=True)
class Claims:
    """How many of a set's claims fail."""

    reference_set: str
    claims: int
    failed: int
    code: Literal["claims"] = "claims"


@dataclass(frozen=True)
class JudgedTable:
    """What every verdict holds.

    Attributes
    ----------
    counts : of the checks against references; conflicts : numbers that references contradict each other about
    sets : names of the reference sets
    claims : of the sets that hold nothing but claims
    own_text : what the table's own author says against it
    """

    counts: CheckCounts
    conflicts: int
    sets: tuple[str, ...]
    claims: tuple[Claims, ...]
    own_text: tuple[InconsistentWithOwnText, ...]


@dataclass(frozen=True)
class Confirmed(JudgedTable):
    """The model meets all that it can, and independent documents settle all that moves the tool."""

    grades: tuple[Grade, ...]
    contradiction: Contradiction | None
    code: Literal["validation.confirmed"] = "validation.confirmed"


@dataclass(frozen=True)
class PartFound:
    """What is known of a part of the table.

    Attributes
    ----------
    status : the gravest of its entries'
    entries, settled : how many it has that mean something alone, and how many of these are settled
    contradicted, open : names of such entries
    off : how far the tool could be off for what is weak or open; what only its own document speaks of has no bound
    """

    part: PartName
    status: PartStatus
    entries: int
    settled: int
    contradicted: tuple[str, ...]
    open: tuple[str, ...]
    off: ToolOff
    code: Literal["part_found"] = "part_found"


@dataclass(frozen=True)
class LeftOpen(JudgedTable):
    """Nothing contradicts the table, but independent documents don't settle all that moves the tool.

    Attributes
    ----------
    parts : of the table
    off : how far the tool could be off for what is weak or open, all over the joint ranges
    at_least : whether that is what was found, and more may be left open
    unbounded : how many entries that move the tool only their own document speaks of: for these there is no bound
    next_measurement : the one that settles the entry for which it could be off farthest
    tolerance : how far what counts as settled may leave the tool off
    """

    parts: tuple[PartFound, ...]
    tolerance: Tolerance | None
    off: ToolOff
    at_least: bool
    unbounded: int
    next_measurement: Proposal | None
    contradiction: Contradiction | None
    code: Literal["validation.left_open"] = "validation.left_open"


@dataclass(frozen=True)
class NothingToCompare(JudgedTable):
    """No authoritative document speaks about the model."""

    code: Literal["validation.no_reference"] = "validation.no_reference"


@dataclass(frozen=True)
class ModelUnsound(JudgedTable):
    """The model fails a check that needs no document."""

    check: SelfCheck
    measured: float
    unit: str
    code: Literal["validation.model_unsound"] = "validation.model_unsound"


@dataclass(frozen=True)
class _Missed(JudgedTable):
    """The model fails checks against documents; ``check`` is the one to quote.

    Attributes
    ----------
    grades : of all authoritative checks
    diagnosis : the likely fault, if there is one
    contradicted : entries that move the tool and whose values independent documents exclude
    """

    reference_set: str
    check: ReferenceSubject
    measured: float
    expected: float
    unit: str
    grades: tuple[Grade, ...]
    diagnosis: LikelyFault | None
    contradicted: tuple[str, ...]


@dataclass(frozen=True)
class Contradicted(_Missed):
    """The model contradicts documents about its arm."""

    code: Literal["validation.contradicted"] = "validation.contradicted"


@dataclass(frozen=True)
class AnotherArm(_Missed):
    """The documents describe another arm; ``described``: what no one or two corrections remove."""

    described: NotTheRobotDescribed | None
    code: Literal["validation.another_arm"] = "validation.another_arm"


Validated = Confirmed | LeftOpen | NothingToCompare | ModelUnsound | Contradicted | AnotherArm
