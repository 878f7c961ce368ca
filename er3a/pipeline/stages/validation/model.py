"""What the stage's results hold."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np

from er3a.identifiability.entry_evidence import EntryEvidence, Tolerance
from er3a.identifiability.proposals import Proposal
from er3a.identifiability.reactions import CheckCounts
from er3a.identifiability.statements import InconsistentWithOwnText, NotTheRobotDescribed
from er3a.kinematics.round_trips import SlotRoundTrips
from er3a.kinematics.wrist_partitioned import ClosedFormMissing
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.pipeline.results import Results, Summary, Verdict
from er3a.pipeline.stages.validation.check_model import Check, Conflict
from er3a.pipeline.stages.validation.diagnosis_model import (
    CorrectedTable,
    Corrections,
    Residuals,
    SetCalibration,
    SetDiagnosis,
)
from er3a.pipeline.stages.validation.validation_findings import (
    CheckSubject,
    KeyPose,
    Note,
    PartFound,
    Validated,
)
from er3a.pipeline.tables import Findings, Table, Texts, column, findings, per_joint, vector
from er3a.robots.robot import Grade


@dataclass(frozen=True)
class SetSummary:
    """What was found against one reference set.

    Attributes
    ----------
    counts : of its checks, by what they rest on
    another_arm : most of those that the verdict rests on fail, and no one or two faults explain that
    described : what no one or two corrections remove of the mismatch, if that is said of the set's arm
    own_text : what it says against the table, if its author is the table's
    zero_pose_flange_off_mm : None where the set does not say where the flange is
    """

    name: str
    grades: tuple[Grade, ...]
    counts: CheckCounts
    another_arm: bool
    described: NotTheRobotDescribed | None
    own_text: InconsistentWithOwnText | None
    zero_pose_flange_off_mm: float | None

    @property
    def is_authoritative(self) -> bool:
        """Whether a verdict rests on any of its checks."""
        return self.counts.independent.total + self.counts.consistency.total > 0

    @property
    def failed(self) -> int:
        """Checks that the verdict rests on and that fail."""
        return self.counts.independent.failed + self.counts.consistency.failed


@dataclass(frozen=True)
class Circles:
    """The point that the flange carries for circle point analysis (in its frame), and its tracks, joint by joint."""

    offset_mm: tuple[float, ...]
    radius_mm: tuple[float, ...]
    roundness_mm: tuple[float, ...]


@dataclass(frozen=True)
class TableFacts:
    """The table's D-H convention, and why the arm has no closed-form inverse, if so."""

    convention: str
    no_closed_form: ClosedFormMissing | None


@dataclass(frozen=True)
class Margins:
    """How near to a singularity a pose is too near to judge its joints."""

    wrist_deg: float
    elbow_deg: float
    shoulder_mm: float


@dataclass(frozen=True)
class RoundTripErrors(SlotRoundTrips):
    """Worst errors of random poses taken back to joints, and the margins near to which joints are not judged."""

    margins: Margins


@dataclass(frozen=True)
class OtherTableFound:
    """Another table; see :class:`er3a.identifiability.entry_evidence.OtherTable`."""

    table: CorrectedTable
    code: Literal["described", "allowed"]


@dataclass(frozen=True)
class TableEvidence:
    """What independent documents settle of the table, entry by entry (``er3a.identifiability``).

    Attributes
    ----------
    tolerance : how far a settled entry may leave the tool off
    combinations : what of entries that are gauge is determined together
    proposals : the cheapest measurement for each entry that isn't settled, as far as one settles it
    table_meets : whether the table as it is meets all independent references
    other : another table, and whether evidence describes it instead of the robot's or can't tell the two apart
    """

    tolerance: Tolerance
    entries: tuple[EntryEvidence, ...]
    combinations: tuple[EntryEvidence, ...]
    parts: tuple[PartFound, ...]
    proposals: tuple[Proposal, ...]
    table_meets: bool
    other: OtherTableFound | None


@dataclass(frozen=True)
class ValidationSummary(Summary):
    """The stage's summary.

    Attributes
    ----------
    section_origin_mm : where the workspace drawing has its origin, x of axis 1 and z of axis 2 in the base frame
    counts : checks against references by what they rest on
    evidence : None where no reference speaks about the table
    """

    verdict: Verdict[Validated]
    checks: tuple[Check, ...]
    conflicts: tuple[Conflict, ...]
    sets: tuple[SetSummary, ...]
    diagnoses: tuple[SetDiagnosis, ...]
    calibrations: tuple[SetCalibration, ...]
    circle_points: Circles
    table: TableFacts
    round_trips: RoundTripErrors | None
    section_origin_mm: tuple[float, float]
    counts: CheckCounts
    evidence: TableEvidence | None


@dataclass(frozen=True, eq=False)
class Checks(Table):
    """The summary's checks as a table."""

    subject: Findings = findings("what is compared", CheckSubject)
    group: Texts = column("group of the check", dtype=object)
    reference_set: Texts = column("reference set, none for checks of the model against itself", dtype=object)
    status: Texts = column("pass, fail, conflict or no_reference", dtype=object)
    measured: Reals = column("the model's value", "see unit")
    expected: Reals = column("the reference's value", "see unit")
    difference: Reals = column("measured - expected", "see unit")
    tolerance: Reals = column("greatest difference that passes", "see unit")
    unit: Texts = column("unit of the numbers", dtype=object)
    source: Texts = column("source of the reference", dtype=object)
    grade: Texts = column("grade of the source", dtype=object)
    kind: Texts = column("what it rests on: independent, consistency or claim; none without a document", dtype=object)
    note: Findings = findings("why it is not judged, or how", Note)

    @classmethod
    def of_records(cls, checks: Iterable[Check]) -> Self:
        """The table of checks."""
        return cls.of_rows(tuple(getattr(check, name) for name in cls.columns()) for check in checks)


@dataclass(frozen=True, eq=False)
class Axes(Table):
    """Each stated axis line in the zero pose beside the model's, in the base frame."""

    reference_set: Texts = column("reference set", dtype=object)
    source: Texts = column("source of the line", dtype=object)
    grade: Texts = column("grade of the source", dtype=object)
    joint: Integers = column("number of the joint, from 1", dtype=np.int64)
    direction: Reals = vector("direction_{}", "stated direction")
    point_mm: Reals = vector("{}_mm", "stated point of the axis", "mm")
    model_direction: Reals = vector("model_direction_{}", "the model's direction of positive rotation")
    model_point_mm: Reals = vector("model_{}_mm", "point of the model's axis nearest to the stated one", "mm")
    angle_deg: Reals = column("angle between the directions", "deg")
    distance_mm: Reals = column("distance of the two points", "mm")
    uncertainty_deg: Reals = column("the source's uncertainty of the direction", "deg")
    uncertainty_mm: Reals = column("the source's uncertainty of the line's place", "mm")

    @property
    def is_off(self) -> Flags:
        """Which lines the model misses by more than their uncertainty."""
        return (self.distance_mm > self.uncertainty_mm) | (self.angle_deg > self.uncertainty_deg)


@dataclass(frozen=True, eq=False)
class KeyPoses(Table):
    """Poses at which references look at the arm, the zero pose first, with the stated point and the model's (base
    frame)."""

    reference_set: Texts = column("reference set", dtype=object)
    source: Texts = column("source of the point", dtype=object)
    grade: Texts = column("grade of the source", dtype=object)
    group: Texts = column("group of the references", dtype=object)
    pose: Findings = findings("the pose", KeyPose)
    point: Texts = column("flange or wrist_centre", dtype=object)
    q_deg: Reals = per_joint("q{}_deg", "joint angle", "deg")
    point_mm: Reals = vector("{}_mm", "stated point, with the model's coordinate where none is stated", "mm")
    model_point_mm: Reals = vector("model_{}_mm", "the model's point", "mm")
    deviation_mm: Reals = column("distance of the two points", "mm")


@dataclass(frozen=True, eq=False)
class Section(Table):
    """The wrist centre in the side view (joint 1 at 0) over a grid of joints 2 and 3 within their limits."""

    q2_deg: Reals = column("joint 2", "deg")
    q3_deg: Reals = column("joint 3", "deg")
    x_mm: Reals = column("distance from axis 1 along x", "mm")
    z_mm: Reals = column("height over axis 2", "mm")
    on_q2_line: Flags = column("on a line of constant q2 where the region can end", dtype=bool)
    on_q3_line: Flags = column("on a line of constant q3 where the region can end", dtype=bool)


@dataclass(frozen=True, eq=False)
class ValidationResults(Results[ValidationSummary]):
    """The stage's results."""

    checks: Checks
    axes: Axes
    key_poses: KeyPoses
    section: Section
    residuals: Residuals
    corrections: Corrections


RESULTS = ValidationResults
