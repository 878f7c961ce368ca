"""The stage's results, and the model of the robot that they describe."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, Self

from er3a.by_value import frozen
from er3a.diagnosis.diagnose import RankedHypothesis
from er3a.files.robot_library import robot_of
from er3a.finding import Finding, is_one
from er3a.identifiability.entry_evidence import EntryEvidence, Tolerance
from er3a.identifiability.reactions import CheckCounts, CheckKind
from er3a.kinematics.wrist_partitioned import ClosedFormMissing
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.language import N_
from er3a.pipeline.results import Results, Summary
from er3a.pipeline.study import Study
from er3a.pipeline.tables import Findings, Table, Texts, column, findings, per_joint, vector
from er3a.references.subjects import Subject
from er3a.robots.robot import Grade, Robot

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


Note = Finding | ClosedFormMissing


@frozen
class Judged:
    """What the model says (``measured``) against what it should; ``difference``: measured - expected.

    Attributes
    ----------
    status : ``conflict`` of a reference that the model misses while meeting another that contradicts it
    kind : what it rests on; None, like ``reference_set``, of a check of the model against itself
    independent_of : the entries that it reacts to and whose document is another, with nothing in common
    """

    measured: float
    expected: float
    difference: float
    tolerance: float
    unit: str
    subject: Subject
    group: str
    status: Literal["pass", "fail", "conflict"]
    note: Finding | None = None
    reference_set: str | None = None
    source: str | None = None
    grade: Grade | None = None
    kind: CheckKind | None = None
    independent_of: tuple[str, ...] = ()

    @property
    def tolerances_off(self) -> float:
        """How many tolerances the difference is."""
        return abs(self.difference) / self.tolerance


@frozen
class Unjudged:
    """What could be checked, had the sources, or the robot's file, a value."""

    subject: Subject
    group: str
    unit: str
    note: Note
    status: Literal["no_reference"] = "no_reference"
    reference_set: str | None = None
    measured: float | None = None
    source: str | None = None
    grade: Grade | None = None
    expected: None = None
    difference: None = None
    tolerance: None = None
    kind: None = None


Check = Judged | Unjudged


@frozen
class Statement:
    """What one source says about a number that others contradict it about."""

    expected: float
    tolerance: float
    difference: float
    met: bool
    source: str
    grade: Grade
    document: str = ""


@frozen
class Conflict:
    """References of one set about one number that no model can meet all."""

    reference_set: str
    subject: Subject
    unit: str
    measured: float
    statements: tuple[Statement, ...]


Floats = tuple[float, ...]


@frozen
class CorrectedTable:
    """A Denavit-Hartenberg table without its most likely fault, in m and rad; ``base`` and ``flange`` (4, 4)."""

    convention: Literal["standard", "modified"]
    a: Floats
    alpha: Floats
    beta: Floats
    d: Floats
    direction: Floats
    offset: Floats
    lower: Floats
    upper: Floats
    base: tuple[Floats, ...]
    flange: tuple[Floats, ...]


@frozen
class SetDiagnosis:
    """What a reference set says about which number of the table is wrong.

    Attributes
    ----------
    references : how many it rests on
    against : titles of the documents that residuals are measured against; from_table : of those among them that the
        table was taken from, or that were made from it, which are no evidence for its numbers
    hypotheses : best first
    corrected : where the conclusion names a fault
    """

    reference_set: str
    conclusion: Finding
    against: tuple[str, ...]
    from_table: tuple[str, ...]
    references: int
    hypotheses: tuple[RankedHypothesis, ...]
    corrected: CorrectedTable | None


@frozen
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
    described: Finding | None
    own_text: Finding | None
    zero_pose_flange_off_mm: float | None

    @property
    def is_authoritative(self) -> bool:
        """Whether a verdict rests on any of its checks."""
        return self.counts.independent.total + self.counts.consistency.total > 0

    @property
    def failed(self) -> int:
        """Checks that the verdict rests on and that fail."""
        return self.counts.independent.failed + self.counts.consistency.failed


@frozen
class TableFacts:
    """The table's D-H convention, and why the arm has no closed-form inverse, if so."""

    convention: str
    no_closed_form: ClosedFormMissing | None


@frozen
class Margins:
    """How near to a singularity a pose is too near to judge its joints."""

    wrist_deg: float
    elbow_deg: float
    shoulder_mm: float


@frozen
class RoundTripErrors:
    """Worst errors of random poses taken back to joints, and the margins near to which joints are not judged.

    Attributes
    ----------
    poses : how many; near_singular : how many of them nearer to a singularity than the margins
    joint_error_deg : worst angle between the joints and the nearest solution, over the other poses
    unsolved : poses without any solution; solutions : mean number of those within the limits
    """

    poses: int
    near_singular: int
    joint_error_deg: float
    unsolved: int
    solutions: float
    margins: Margins


@frozen
class OtherTableFound:
    """Another table; see :class:`er3a.identifiability.entry_evidence.OtherTable`."""

    table: CorrectedTable
    code: Literal["described", "allowed"]


@frozen
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
    parts: tuple[Finding, ...]
    proposals: tuple[Finding, ...]
    table_meets: bool
    other: OtherTableFound | None

    @property
    def contradicted(self) -> int:
        """How many entries of the table evidence excludes."""
        return sum(each.status == "contradicted" for each in self.entries)

    @property
    def unconfirmed(self) -> list[str]:
        """The entries of the table to confirm before they are used."""
        return [each.entry for each in self.entries if each.trust in ("open", "weak", "consistent")]


class ValidationSummary(Summary):
    """The stage's summary.

    The verdict's finding is one of the codes below after ``validation.``, else ``confirmed``, ``no_reference`` or
    ``model_unsound``. All have ``counts`` of the checks against references, by what they rest on; ``claims``, of the
    sets that hold nothing but claims; and ``own_text``, what the table's own author says against it.

    ``left_open``: nothing contradicts the table, but independent documents don't settle all that moves the tool. It has
    the ``parts`` of the table, each with how many entries mean something alone (``entries``), how many of these are
    ``settled`` outright, or but for a sign or half turn that depends on what is open elsewhere (``up_to_signs``), and
    the names of those ``contradicted`` and ``open``; how far what counts as settled may leave the tool off
    (``settled_mm``, ``settled_deg``), and how far what is weak or open may (``off_mm``, ``off_deg``; ``at_least``: more
    may be left open); the entries that only their own document speaks of, for which there is no bound (``unbounded``);
    and the ``next_measurement``, which settles the entry for which the tool could be off farthest.

    ``contradicted``, ``another_arm`` and ``defined_otherwise`` (the same arm, with zeros, directions, base or flange
    that the ``diagnosis`` names) quote one failed ``check``, and name the entries that documents exclude.
    ``described``: what no one or two corrections remove of another arm's mismatch.

    Attributes
    ----------
    counts : checks against references by what they rest on
    evidence : None where no reference speaks about the table
    """

    needs = ("table",)

    checks: tuple[Check, ...]
    conflicts: tuple[Conflict, ...]
    sets: tuple[SetSummary, ...]
    diagnoses: tuple[SetDiagnosis, ...]
    table: TableFacts
    round_trips: RoundTripErrors | None
    counts: CheckCounts
    evidence: TableEvidence | None

    @property
    def is_beyond_correction(self) -> bool:
        """Whether documents describe another arm, which no correction of the table makes it."""
        same = is_one(self.verdict.finding, "validation.defined_otherwise")
        return not same and any(found.another_arm for found in self.sets)


class Checks(Table):
    """The summary's checks as a table."""

    subject: Findings = findings("what is compared")
    group: Texts = column("group of the check")
    reference_set: Texts = column("reference set, none for checks of the model against itself")
    status: Texts = column("pass, fail, conflict or no_reference")
    measured: Reals = column("the model's value", "see unit")
    expected: Reals = column("the reference's value", "see unit")
    difference: Reals = column("measured - expected", "see unit")
    tolerance: Reals = column("greatest difference that passes", "see unit")
    unit: Texts = column("unit of the numbers")
    source: Texts = column("source of the reference")
    grade: Texts = column("grade of the source")
    kind: Texts = column("what it rests on: independent, consistency or claim; none without a document")
    note: Findings = findings("why it is not judged, or how")

    @classmethod
    def of_records(cls, checks: Iterable[Check]) -> Self:
        """The table of checks.

        Parameters
        ----------
        checks : of the summary

        Returns
        -------
        table : one row for each, in their order
        """
        return cls.of_rows(tuple(getattr(check, name) for name in cls.columns()) for check in checks)


class Axes(Table):
    """Each stated axis line in the zero pose beside the model's, in the base frame."""

    reference_set: Texts = column("reference set")
    source: Texts = column("source of the line")
    grade: Texts = column("grade of the source")
    joint: Integers = column("number of the joint, from 1")
    direction: Reals = vector("direction_{}", "stated direction")
    point_mm: Reals = vector("{}_mm", "stated point of the axis")
    model_direction: Reals = vector("model_direction_{}", "the model's direction of positive rotation")
    model_point_mm: Reals = vector("model_{}_mm", "point of the model's axis nearest to the stated one")
    angle_deg: Reals = column("angle between the directions", heading=N_("angle"))
    distance_mm: Reals = column("distance of the two points", heading=N_("distance"))
    uncertainty_deg: Reals = column("the source's uncertainty of the direction")
    uncertainty_mm: Reals = column("the source's uncertainty of the line's place")


class KeyPoses(Table):
    """Poses at which references state a point, the zero pose first, with that point and the model's (base frame)."""

    reference_set: Texts = column("reference set")
    source: Texts = column("source of the point")
    grade: Texts = column("grade of the source")
    group: Texts = column("group of the references")
    pose: Findings = findings("the pose")
    point: Texts = column("flange or wrist_centre")
    q_deg: Reals = per_joint("joint angle")
    point_mm: Reals = vector("{}_mm", "stated point, with the model's coordinate where none is stated")
    model_point_mm: Reals = vector("model_{}_mm", "the model's point")
    deviation_mm: Reals = column("distance of the two points")


class ValidationResults(Results):
    """The stage's results."""

    summary: ValidationSummary
    checks: Checks
    axes: Axes
    key_poses: KeyPoses


RESULTS = ValidationResults


def model_of(study: Study, name: str) -> Robot:
    """The robot as its file has it, without tool: references speak of its flange and of the manufacturer's base.

    Parameters
    ----------
    name : of a robot

    Raises
    ------
    InputError
        naming file and field that can't be used
    """
    return robot_of(study.table(name)).without_tool().replace(name=name)
