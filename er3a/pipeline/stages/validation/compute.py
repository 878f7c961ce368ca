"""Compare a model with its reference sets, and check it for consistency."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from er3a.confirmation.document import controller_set
from er3a.diagnosis.diagnose import Diagnosis, diagnosis_of
from er3a.diagnosis.ranking import usable
from er3a.files.reference_sets import check_robot_origins, load_references
from er3a.finding import fact, is_one
from er3a.identifiability.evidence import evidence_of
from er3a.identifiability.proposals import proposals_of
from er3a.identifiability.reactions import bases_of, undeclared_bases
from er3a.identifiability.statements import made_from_table, title_of
from er3a.kinematics.forward import frames
from er3a.kinematics.table_batch import robot_of
from er3a.kinematics.wrist_partitioned import wrist_partition_missing
from er3a.numerics.si_units import stated
from er3a.pipeline.scope import Check, Coverage, Open, coverages
from er3a.pipeline.stages.validation import model
from er3a.pipeline.stages.validation.checks import (
    OF_THE_TOOL,
    checks_of_set,
    counts_of,
    key_figures,
    parts_found,
    round_trip_checks,
    set_summaries,
    table_checks,
    verdict_of,
)
from er3a.pipeline.stages.validation.entry import ValidationSettings
from er3a.pipeline.study import Study
from er3a.references import quantities
from er3a.references.predict import read, search, state_of
from er3a.references.reference import Documents, ReferenceSet, quantities_of
from er3a.references.rows import GROUPS, AxisRow, PositionRow
from er3a.robots.joint_limits import meant, size_of
from er3a.robots.robot import Robot


def _set_diagnosis(robot: Robot, references: ReferenceSet, diagnosis: Diagnosis) -> model.SetDiagnosis:
    documents = dict.fromkeys(reference.document for reference in usable(references))
    own = [name for name in documents if made_from_table(robot, name, references.documents)]
    return model.SetDiagnosis(
        reference_set=references.name,
        conclusion=diagnosis.conclusion,
        against=tuple(title_of(name, references.documents) for name in documents),
        from_table=tuple(title_of(name, references.documents) for name in own),
        references=diagnosis.references,
        hypotheses=tuple(stated(model.RankedHypothesis, each) for each in diagnosis),
        corrected=stated(model.CorrectedTable, diagnosis[0].corrected) if diagnosis.names_fault else None,
    )


def axes_table(robot: Robot, sets: list[ReferenceSet]) -> model.Axes:
    """Each stated axis line against the model's.

    Parameters
    ----------
    robot : its tool does not count

    Returns
    -------
    rows : directions, mm and deg, in the base frame; the model's point is that of its axis nearest to the stated one
    """
    rows, state = [], state_of(robot, ())
    for references in sets:
        for row in references.of(AxisRow):
            direction, found = state.axis(row.joint)
            stated = found if row.point_mm is None else np.array(row.point_mm)
            nearest = quantities.nearest_on_line(direction, found, stated)
            angle = float(quantities.angle_between(direction, np.array(row.direction), row.signed))
            distance = float(np.linalg.norm(nearest - stated))
            head = (references.name, row.source, row.grade, row.joint, row.direction, stated)
            rows.append((*head, direction, nearest, angle, distance, row.uncertainty_deg, row.uncertainty_mm))
    return model.Axes.of_rows(rows)


def key_poses_table(robot: Robot, sets: list[ReferenceSet]) -> model.KeyPoses:
    """The poses at which references state a point, with the model's point.

    Returns
    -------
    rows : the zero pose first; mm in the base frame. A coordinate that is not stated is the model's.
    """
    rows = []
    for references in sets:
        for row in references.of(PositionRow):
            given = np.array([np.nan if value is None else value for value in row.xyz_mm])
            pose = (*row.pose, *quantities.ZERO_POSE)[: robot.joints]
            modelled = quantities.point_of(frames(robot, meant(robot, np.array(pose))), row.point)
            # A source may give some coordinates only: the others are the model's, and so make no difference.
            stated = given if np.isnan(given).all() else np.where(np.isnan(given), modelled, given)
            head = (
                references.name,
                row.source,
                row.grade,
                row.group,
                fact("named_pose", name=row.name),
                row.point,
                pose,
            )
            rows.append((*head, stated, modelled, float(np.linalg.norm(modelled - stated))))
    table = model.KeyPoses.of_rows(rows)
    return table.take(np.argsort((table.q_deg != 0).any(axis=1), kind="stable"))


SIX = 6
WRIST_REACH = quantities.AxisDistance("wrist_centre", "greatest", 1)
FLANGE_REACH = quantities.AxisDistance("flange", "greatest", 1)
ALWAYS_SEARCHED = (
    WRIST_REACH,
    quantities.AxisDistance("wrist_centre", "least", 1),
    quantities.AxisDistance("wrist_centre", "greatest", 2),
    quantities.AxisDistance("wrist_centre", "least", 2),
    FLANGE_REACH,
    quantities.AxisDistance("flange", "least", 1),
)


def _checked(
    robot: Robot, sets: list[ReferenceSet], values: Mapping[quantities.Quantity, float]
) -> tuple[list[model.Check], list[model.Conflict]]:
    """Checks of the table alone and against each set, and what the sets contradict each other about.

    ``values`` : extremes over the joint limits, mm.
    """
    checks, conflicts = table_checks(robot), list[model.Conflict]()
    for references in sets:
        asked = quantities_of(references.checkable)
        state = state_of(robot, asked, extremes=values)
        bases = (
            bases_of(robot, references.checkable, references.documents)
            if is_turning(robot)
            else undeclared_bases(references.checkable)
        )
        own = np.where([_assumed_of_robot(robot, quantity) for quantity in asked], np.nan, read(asked, state))
        judged, contradictions = checks_of_set(references, own, bases, robot.slides, 1000 * size_of(robot))
        checks += judged
        conflicts += contradictions
    return checks, conflicts


def _assumed_of_robot(robot: Robot, quantity: quantities.Quantity) -> bool:
    """Whether a quantity is a limit or a speed that the robot's file does not give."""
    if isinstance(quantity, quantities.Limit):
        return not robot.states("limits")
    return isinstance(quantity, quantities.Speed) and not robot.states("speeds")


def compute(study: Study, name: str) -> model.ValidationResults:
    """Check a robot's model against its reference sets and against itself, and say what is most likely wrong with it.

    Parameters
    ----------
    name : of a robot; tool and base of the study do not count

    Returns
    -------
    results : the same on every run with the study's seed

    Raises
    ------
    InputError
        naming file and row, or field, that can't be used
    """
    robot = model.model_of(study, name)
    settings = study.section(ValidationSettings)
    sets = [load_references(reference, robot) for reference in robot.references]
    if shown := study.entry(name).confirm:
        sets.append(controller_set(study.robot(name), robot, Path(shown)))
    check_robot_origins(robot, [document for own in sets for document in own.documents.by_name])

    turning = is_turning(robot)
    stated = [quantity for references in sets for quantity in quantities_of(references.checkable)]
    sought = [quantity for quantity in stated if isinstance(quantity, quantities.Extreme)]
    wanted = dict.fromkeys([*always_searched(robot), *sought])
    values: dict[quantities.Quantity, float] = {
        quantity: search(robot, quantity, settings.reach_starts)[0] for quantity in wanted
    }
    checks, conflicts = _checked(robot, sets, values)
    checks += _without_reference(robot, values, checks)
    trip_checks, trips = round_trip_checks(robot, settings.round_trips, study.seed)
    checks += trip_checks

    axes, poses = axes_table(robot, sets), key_poses_table(robot, sets)
    diagnosed = [diagnosis_of(robot, references) for references in sets if turning]
    diagnoses = tuple(_set_diagnosis(robot, *pair) for pair in zip(sets, diagnosed))
    found = {each.reference_set: each for each in diagnoses}
    summaries = set_summaries(robot, sets, checks, poses, found)
    reaches = {"wrist_centre_reach": WRIST_REACH, "flange_reach": FLANGE_REACH}
    reach = {name: values[quantity] for name, quantity in reaches.items() if quantity in values}
    found_right = [each[0].corrected for each in diagnosed if each and each[0].explains]
    evidence = evidence_of_table(robot, sets, found_right) if turning else None
    summary = model.ValidationSummary(
        verdict=verdict_of(checks, conflicts, summaries, found, evidence),
        figures=key_figures(checks, axes, summaries, reach, trips),
        checks=tuple(checks),
        conflicts=tuple(conflicts),
        sets=summaries,
        diagnoses=diagnoses,
        table=model.TableFacts(robot.convention, wrist_partition_missing(robot)),
        round_trips=trips,
        counts=counts_of(checks),
        evidence=evidence,
        checked=_covered(bool(sets), trips, evidence),
        assumed=tuple(_assumed(checks, study.robot(name), robot)),
    )
    return model.ValidationResults(
        summary=summary,
        checks=model.Checks.of_records(checks),
        axes=axes,
        key_poses=poses,
    )


def _covered(
    documents: bool, trips: model.RoundTripErrors | None, evidence: model.TableEvidence | None
) -> tuple[Coverage, ...]:
    """Of the table's entries how many documents settle, if there are any; of poses solved back how many were found."""
    parts = [part for part in evidence.parts if part.part in OF_THE_TOOL] if evidence else []
    settled = sum(part.entries if part.status == "settled" else part.settled for part in parts)
    entries = sum(part.entries for part in parts)
    asked: dict[Check, tuple[int, int]] = {"table": (settled, entries)} if documents else {}
    gaps = [Open("unsettled")] if settled < entries else []
    return coverages(asked | ({"round_trips": (trips.poses, trips.poses)} if trips else {}), gaps)


def _assumed(checks: list[model.Check], placed: Robot, robot: Robot) -> Iterator[Open]:
    """What no reference states or settles, and what the study places otherwise than the model that was checked."""
    judged = {check.subject for check in checks if check.kind is not None}
    groups = {check.group for check in checks if check.kind is not None}
    missing = {
        check.group
        for check in checks
        if isinstance(check, model.Unjudged)
        and check.group in GROUPS
        and (check.group not in groups if is_one(check.subject, "whole_group") else check.subject not in judged)
    }
    if unstated := tuple(group for group in GROUPS if group in missing or group not in groups):
        yield Open("references", unstated)
    if loose := tuple(dict.fromkeys(check.group for check in checks if is_one(check.note, "too_uncertain"))):
        yield Open("loose_references", loose)
    names = tuple(name for name in ("tool", "base") if not np.array_equal(getattr(placed, name), getattr(robot, name)))
    if names:
        yield Open("tool_and_base", names)


def evidence_of_table(
    robot: Robot, sets: Sequence[ReferenceSet], corrected: Sequence[Robot] = ()
) -> model.TableEvidence | None:
    """What independent documents settle of the table, entry by entry.

    Parameters
    ----------
    robot : with revolute joints, one for each row
    corrected : the robot without the faults that explain best what each set misses

    Returns
    -------
    evidence : with another table that documents describe or allow, if one was found; None where no reference states a
        value
    """
    references = [reference for own in sets for reference in own.references]
    if not any(reference.expected is not None for reference in references):
        return None
    documents = Documents({name: each for own in sets for name, each in own.documents.by_name.items()})
    found = evidence_of(robot, references, documents, corrected=corrected)
    return stated(
        model.TableEvidence,
        found,
        parts=parts_found(found),
        proposals=tuple(proposals_of(found).values()),
        other=model.OtherTableFound(
            stated(model.CorrectedTable, robot_of(found.other.table, 0, robot)), found.other.code
        )
        if found.other
        else None,
    )


def is_turning(robot: Robot) -> bool:
    """Whether the arm is one of those that diagnosis and evidence are made for.

    Returns
    -------
    turning : whether all joints are revolute, one for each row of the table
    """
    return not robot.sliding.any() and robot.coupling is None


def always_searched(robot: Robot) -> tuple[quantities.AxisDistance, ...]:
    """The reaches that are searched for whatever the references say.

    Returns
    -------
    quantities : distances from axes; those of the wrist centre only of arms with six revolute joints
    """
    six = robot.rows == SIX and not robot.sliding.any()
    return ALWAYS_SEARCHED if six else tuple(each for each in ALWAYS_SEARCHED if each.point == "flange")


def _without_reference(
    robot: Robot, values: dict[quantities.Quantity, float], checks: list[model.Check]
) -> list[model.Unjudged]:
    """Reach that no reference gives, as measured."""
    stated = {check.subject for check in checks}
    found = []
    for each in always_searched(robot):
        subject = fact("reach", extreme=each.extreme, point=each.point, axis=each.axis)
        if subject not in stated:
            found.append(model.Unjudged(subject, "reach", "mm", fact("in_no_set"), measured=values[each]))
    return found
