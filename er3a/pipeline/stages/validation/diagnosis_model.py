"""What the stage stores of diagnosis and calibration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from er3a.calibration.calibrate import Close
from er3a.calibration.outcomes import CalibrationConclusion, Held, LevelName, MorePositions, NotCalibrated
from er3a.diagnosis.conclusions import Conclusion, NextMeasurement
from er3a.diagnosis.fault_kinds import Faults
from er3a.numerics.arrays import Reals
from er3a.pipeline.tables import Findings, Table, Texts, column, findings
from er3a.references.quantities import Unit
from er3a.references.subjects import ReferenceSubject

Six = tuple[float, ...]


@dataclass(frozen=True)
class RankedHypothesis:
    """A hypothesis of a diagnosis; see :class:`er3a.diagnosis.diagnose.Hypothesis`."""

    faults: Faults
    residual_before: float
    residual_after: float
    unit: Unit
    explains: bool
    half_widths: float
    indistinguishable_from: tuple[Faults, ...]
    to_decide: NextMeasurement | None
    score: float


@dataclass(frozen=True)
class CorrectedTable:
    """A Denavit-Hartenberg table without its most likely fault, in m and rad."""

    convention: Literal["standard", "modified"]
    a: Six
    alpha: Six
    beta: Six
    d: Six
    direction: Six
    offset: Six
    lower: Six
    upper: Six


@dataclass(frozen=True)
class SetDiagnosis:
    """What a reference set says about which number of the table is wrong.

    Attributes
    ----------
    references : how many it rests on; hypotheses_tried : how many were evaluated
    against : titles of the documents that residuals are measured against; from_table : of those among them that the
        table was taken from, or that were made from it, which are no evidence for its numbers
    hypotheses : best first
    corrected : where the conclusion names a fault
    """

    reference_set: str
    conclusion: Conclusion
    against: tuple[str, ...]
    from_table: tuple[str, ...]
    references: int
    hypotheses_tried: int
    hypotheses: tuple[RankedHypothesis, ...]
    corrected: CorrectedTable | None


@dataclass(frozen=True, eq=False)
class Residuals(Table):
    """Residuals before and after the best hypothesis, worst first, for sets with something to explain."""

    reference_set: Texts = column("name of the reference set", dtype=object)
    source: Texts = column("source of the reference", dtype=object)
    group: Texts = column("group of the reference", dtype=object)
    subject: Findings = findings("what the reference is about; coordinates of one point together", ReferenceSubject)
    unit: Texts = column("unit of the three numbers", dtype=object)
    before: Reals = column("difference between model and reference")
    after: Reals = column("the same with the best hypothesis corrected")
    uncertainty: Reals = column("half-width of the interval that the source leaves open")


@dataclass(frozen=True)
class Calibrated:
    """What the positions of a reference set say about the table's entries; see
    :class:`er3a.calibration.calibrate.Calibration`."""

    conclusion: CalibrationConclusion
    level: LevelName
    coordinates: int
    poses: int
    held: tuple[Held, ...]
    close: tuple[Close, ...]
    singular_values: tuple[float, ...]
    rms_before_mm: float
    rms_after_mm: float
    scatter: float
    more: MorePositions | None


@dataclass(frozen=True)
class SetCalibration:
    """The calibration from a reference set: its result, or why there is none."""

    reference_set: str
    result: Calibrated | NotCalibrated


@dataclass(frozen=True, eq=False)
class Corrections(Table):
    """Estimated corrections to the table's entries, of the sets whose positions they meet."""

    reference_set: Texts = column("name of the reference set", dtype=object)
    entry: Texts = column("entry of the table, such as d4", dtype=object)
    unit: Texts = column("unit of the numbers, mm or deg", dtype=object)
    nominal: Reals = column("value in the table")
    correction: Reals = column("to be added to it")
    standard_error: Reals = column("of the correction")
    half_width: Reals = column("half-width of the 95 % interval")
