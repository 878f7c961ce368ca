"""Hold a model against its reference sets, and against itself."""

from __future__ import annotations

from collections.abc import Sequence

from er3a.files.reference_documents import check_robot_origins
from er3a.files.reference_sets import load_references
from er3a.identifiability.evidence import evidence_of
from er3a.identifiability.proposals import proposals_of
from er3a.identifiability.reactions import bases_of, bases_untold
from er3a.kinematics.table_batch import robot_of
from er3a.kinematics.wrist_partitioned import closed_form_missing
from er3a.pipeline.stages.validation.check_model import Check, Conflict, Unjudged
from er3a.pipeline.stages.validation.checks import checks_of_set
from er3a.pipeline.stages.validation.corrections import calibrate_from_sets
from er3a.pipeline.stages.validation.diagnoses import diagnose_sets, table_record
from er3a.pipeline.stages.validation.entry import ValidationSettings
from er3a.pipeline.stages.validation.geometry_tables import axes_table, key_poses_table, section_table
from er3a.pipeline.stages.validation.model import (
    Checks,
    Circles,
    OtherTableFound,
    Section,
    TableEvidence,
    TableFacts,
    ValidationResults,
    ValidationSummary,
)
from er3a.pipeline.stages.validation.parts_found import parts_found
from er3a.pipeline.stages.validation.self_checks import round_trip_checks, table_checks
from er3a.pipeline.stages.validation.subject import model_of
from er3a.pipeline.stages.validation.validation_findings import InNoSet
from er3a.pipeline.stages.validation.verdict import SHOWN_DECIMALS, counts_of, key_figures, set_summaries, verdict_of
from er3a.pipeline.study import Study
from er3a.references.circle_points import CirclePoints, circle_points
from er3a.references.documents import Documents
from er3a.references.predict import read, state_of
from er3a.references.quantities import MM, ZERO_POSE, AxisDistance, Extreme, Quantity
from er3a.references.reach import search
from er3a.references.reference import ReferenceSet, quantities_of
from er3a.references.subjects import Reach
from er3a.robots.robot import Robot

SIX = 6
WRIST_REACH = AxisDistance("wrist_centre", "greatest", 1)
FLANGE_REACH = AxisDistance("flange", "greatest", 1)
ALWAYS_SEARCHED = (
    WRIST_REACH,
    AxisDistance("wrist_centre", "least", 1),
    AxisDistance("wrist_centre", "greatest", 2),
    AxisDistance("wrist_centre", "least", 2),
    FLANGE_REACH,
    AxisDistance("flange", "least", 1),
)


def compute(study: Study, name: str) -> ValidationResults:
    """Check a robot's model, and say what is most likely wrong with it."""
    robot = model_of(study, name)
    settings = study.section(ValidationSettings)
    sets = [load_references(reference) for reference in robot.references]
    check_robot_origins(robot, [document for own in sets for document in own.documents.by_name])

    plain = is_six_turning(robot)
    stated = [quantity for references in sets for quantity in quantities_of(references.checkable)]
    sought = [quantity for quantity in stated if isinstance(quantity, Extreme)]
    wanted = dict.fromkeys([*always_searched(robot), *sought])
    extremes = {quantity: search(robot, quantity, settings.reach_starts) for quantity in wanted}
    values: dict[Quantity, float] = {quantity: value for quantity, (value, _) in extremes.items()}

    circles = circle_points(robot)
    checks, conflicts = table_checks(robot), list[Conflict]()
    for references in sets:
        quantities = quantities_of(references.checkable)
        state = state_of(robot, quantities, extremes=values, axes=circles.axes)
        bases = (
            bases_of(robot, references.checkable, references.documents) if plain else bases_untold(references.checkable)
        )
        judged, contradictions = checks_of_set(references, read(quantities, state), bases, robot.joints)
        checks += judged
        conflicts += contradictions
    checks += _without_reference(robot, values, checks)
    trip_checks, trips = round_trip_checks(robot, settings.round_trips, study.seed)
    checks += trip_checks

    axes, poses = axes_table(circles, sets), key_poses_table(robot, sets, extremes)
    diagnoses, residuals = diagnose_sets(robot, sets if plain else [])
    calibrations, corrections = calibrate_from_sets(robot, sets if plain else [])
    found = {each.reference_set: each for each in diagnoses}
    summaries = set_summaries(robot, sets, checks, poses, found)
    reaches = {"wrist_centre_reach": WRIST_REACH, "flange_reach": FLANGE_REACH}
    reach = {name: values[quantity] for name, quantity in reaches.items() if quantity in values}
    evidence = evidence_of_table(robot, sets) if plain else None
    counts = counts_of(checks)
    summary = ValidationSummary(
        verdict=verdict_of(checks, conflicts, summaries, found, evidence),
        figures=key_figures(checks, axes, summaries, reach, trips),
        checks=tuple(checks),
        conflicts=tuple(conflicts),
        sets=summaries,
        diagnoses=diagnoses,
        calibrations=calibrations,
        circle_points=_rounded(circles),
        table=TableFacts(robot.convention, closed_form_missing(robot)),
        round_trips=trips,
        section_origin_mm=_section_origin_mm(robot),
        counts=counts,
        evidence=evidence,
    )
    return ValidationResults(
        summary=summary,
        checks=Checks.of_records(checks),
        axes=axes,
        key_poses=poses,
        section=section_table(robot, extremes) if plain else Section.empty(),
        residuals=residuals,
        corrections=corrections,
    )


def evidence_of_table(robot: Robot, sets: Sequence[ReferenceSet]) -> TableEvidence | None:
    """What independent documents settle of the table; None where no reference states a value."""
    references = [reference for own in sets for reference in own.references]
    if not any(reference.expected is not None for reference in references):
        return None
    documents = Documents({name: each for own in sets for name, each in own.documents.by_name.items()})
    found = evidence_of(robot, references, documents)
    return TableEvidence(
        tolerance=found.tolerance,
        entries=found.entries,
        combinations=found.combinations,
        parts=parts_found(found),
        proposals=tuple(proposals_of(found).values()),
        table_meets=found.table_meets,
        other=OtherTableFound(table_record(robot_of(found.other.table, 0, robot)), found.other.code)
        if found.other
        else None,
    )


def is_six_turning(robot: Robot) -> bool:
    """Whether the arm is one of those that diagnosis, calibration and evidence are made for."""
    return robot.rows == robot.joints == SIX and not robot.sliding.any() and robot.coupling is None


def always_searched(robot: Robot) -> tuple[AxisDistance, ...]:
    """The reaches that are searched for whatever the references say; an arm with other joints has no wrist centre."""
    six = robot.rows == SIX and not robot.sliding.any()
    return ALWAYS_SEARCHED if six else tuple(each for each in ALWAYS_SEARCHED if each.point == "flange")


def _without_reference(robot: Robot, values: dict[Quantity, float], checks: list[Check]) -> list[Unjudged]:
    """Reach that no reference gives, as measured."""
    stated = {check.subject for check in checks}
    subjects = {Reach(distance.extreme, distance.point, distance.axis): distance for distance in always_searched(robot)}
    return [
        Unjudged(subject, "reach", "mm", InNoSet(), measured=values[distance])
        for subject, distance in subjects.items()
        if subject not in stated
    ]


def _rounded(circles: CirclePoints) -> Circles:
    return Circles(
        offset_mm=tuple(circles.offset_mm.tolist()),
        radius_mm=tuple(circles.radius_mm.round(SHOWN_DECIMALS).tolist()),
        roundness_mm=tuple(circles.roundness_mm.round(SHOWN_DECIMALS).tolist()),
    )


def _section_origin_mm(robot: Robot) -> tuple[float, float]:
    """Where axis 1 (x) and axis 2 (z) are in the base frame, which is the workspace drawing's origin."""
    zero = state_of(robot, ()).at(ZERO_POSE)
    return float(zero[0, 0, 3] * MM), float(zero[1, 2, 3] * MM)
