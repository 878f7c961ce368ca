"""Comparison of a model with reference sets, number by number, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from typing import Any, Literal

import numpy as np

from er3a.diagnosis.faults import CONVENTIONS
from er3a.files.robot_file import LONGEST_LENGTH_MM, MIN_LONGEST_MM
from er3a.files.units import WIDEST_IN_RADIANS
from er3a.finding import Amount, Finding, fact, is_one
from er3a.identifiability.entries import GROUP_OF, column_of
from er3a.identifiability.entry_evidence import EntryEvidence, Evidence, Status
from er3a.identifiability.evidence import GRAVEST, PART_OF_GROUP, PartName, together
from er3a.identifiability.reactions import CheckBasis, CheckCounts, CheckKind, CheckTally
from er3a.identifiability.statements import (
    NOT_OFF,
    ToolOff,
    inconsistent_with_own_text,
    is_another_arm,
    not_the_robot_described,
    title_of,
)
from er3a.kinematics import round_trips
from er3a.kinematics.closed_form import SLOTS
from er3a.kinematics.wrist_partitioned import wrist_partition_missing
from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.results import Figure, Verdict
from er3a.pipeline.stages.validation import model
from er3a.references.quantities import Quantity, undecided_from
from er3a.references.reference import Reference, ReferenceSet, conflicts, expected_of
from er3a.references.rows import GROUPS, AxisRow
from er3a.robots.robot import AUTHORITATIVE_GRADES, Robot

ROUNDING = 1e-9  # in the unit of a reference (mm, deg, mm/s, deg/s): what reading and predicting it lose at most
NONE_ALLOWED = 0.5  # tolerance of a count
SIX_TURN = (False,) * 6


def against_itself(
    quantity: model.SelfChecked,
    group: model.ModelGroup,
    measured: float,
    tolerance: float,
    unit: str = "",
    note: Finding | None = None,
) -> model.Judged:
    """A check that needs no document.

    Parameters
    ----------
    measured : should be 0
    tolerance : in the same unit, at which it still passes
    note : of what the check leaves out
    """
    status: Literal["pass", "fail"] = "pass" if abs(measured) <= tolerance else "fail"
    return model.Judged(
        measured, 0.0, measured, tolerance, unit, fact("self_check", quantity=quantity), group, status, note
    )


def checks_of_set(
    references: ReferenceSet,
    values: Reals,
    bases: Sequence[CheckBasis],
    slides: Sequence[bool] | Flags = SIX_TURN,
    size: float = 0.0,
) -> tuple[list[model.Check], list[model.Conflict]]:
    """Judge a model's values (n,) of the set's checkable references, and list what was set aside and what the set says
    nothing about.

    ``bases`` (n,): what each of these checks rests on; ``slides`` : of each joint; ``size`` : of the arm, mm.
    """
    stated = _Stated(references, values, bases, size)
    checks = [stated.check(i) for i in range(len(values))]
    aside = [
        _without_value(references.name, reference, fact("not_of_this_arm", reason=why, joints=len(slides)))
        for row, why in references.set_aside
        for reference in row.references()
    ]
    return [*checks, *aside, *_gaps(references, slides)], stated.conflicts()


class _Stated:
    """Checkable references of a set beside a model's values (n,).

    Attributes
    ----------
    met : (n,), which of them the model meets
    pairs : references that no model can meet both of
    size : mm, of the arm, or of what the references say of it
    """

    def __init__(self, own: ReferenceSet, values: Reals, bases: Sequence[CheckBasis], size: float):
        references = own.checkable
        self.set_name, self.references, self.values, self.bases = own.name, references, values, bases
        self.documents = own.documents
        self.expected, self.tolerance = expected_of(references)
        self.met = np.abs(values - self.expected) <= self.tolerance + ROUNDING
        self.pairs = conflicts(references)
        lengths = [abs(float(each)) for each, own in zip(self.expected, references) if own.unit == "mm"]
        self.size = max(size, *lengths, 0.0)

    def check(self, i: int) -> model.Check:
        """The check of one reference.

        Parameters
        ----------
        i : its number

        Returns
        -------
        check : not judged where the robot's file gives no value, or the source leaves so much open that it decides
            nothing
        """
        reference, value, expected = self.references[i], float(self.values[i]), float(self.expected[i])
        if math.isnan(value):
            return _without_value(self.set_name, reference, fact("not_in_robot_file"))
        bound = undecided_from(reference.quantity, expected, self.size)
        if self.met[i] and reference.uncertainty >= bound:
            return _without_value(
                self.set_name, reference, fact("too_uncertain", uncertainty=reference.uncertainty, undecided_from=bound)
            )
        return model.Judged(
            measured=value,
            expected=expected,
            difference=value - expected,
            tolerance=reference.uncertainty,
            unit=reference.unit,
            subject=reference.subject,
            group=reference.group,
            status=self._status(i),
            reference_set=self.set_name,
            source=reference.source,
            grade=reference.grade,
            kind=self.bases[i].kind,
            independent_of=self.bases[i].independent_of,
        )

    def conflicts(self) -> list[model.Conflict]:
        """What the references contradict each other about."""
        members: dict[Quantity, set[int]] = {}
        for pair in self.pairs:
            members.setdefault(self.references[pair[0]].quantity, set()).update(pair)
        return [self._conflict(sorted(rows)) for rows in members.values()]

    def _conflict(self, rows: list[int]) -> model.Conflict:
        first = self.references[rows[0]]
        statements = tuple(
            model.Statement(
                expected=float(self.expected[i]),
                tolerance=self.references[i].uncertainty,
                difference=float(self.values[i] - self.expected[i]),
                met=bool(self.met[i]),
                source=self.references[i].source,
                grade=self.references[i].grade,
                document=title_of(self.references[i].document, self.documents),
            )
            for i in rows
        )
        return model.Conflict(self.set_name, first.subject, first.unit, float(self.values[rows[0]]), statements)

    def _status(self, i: int) -> Literal["pass", "fail", "conflict"]:
        if self.met[i]:
            return "pass"
        rivals = [b if a == i else a for a, b in self.pairs if i in (a, b)]
        weak = not self.references[i].is_authoritative
        excused = any(self.met[k] and (weak or self.references[k].is_authoritative) for k in rivals)
        return "conflict" if excused else "fail"


def _without_value(set_name: str, reference: Reference, note: model.Note) -> model.Unjudged:
    return model.Unjudged(
        reference.subject,
        reference.group,
        reference.unit,
        note,
        reference_set=set_name,
        source=reference.source,
        grade=reference.grade,
    )


def _gaps(references: ReferenceSet, slides: Sequence[bool] | Flags) -> list[model.Unjudged]:
    """What the set says nothing about."""
    name, note = references.name, fact("set_has_no_data", reference_set=references.name)
    stated = {reference.quantity for reference in references.checkable}
    gaps = [
        _without_value(name, reference, fact("source_gives_none"))
        for reference in references.references
        if reference.expected is None and reference.quantity not in stated
    ]
    present = {reference.group for reference in references.references}
    gaps += [
        model.Unjudged(fact("whole_group", group=group), group, "", note, reference_set=name)
        for group in GROUPS
        if group not in present
    ]
    subjects = {each.subject for each in references.references}
    subjects |= {each.subject for row, _ in references.set_aside for each in row.references()}
    with_axis = {row.joint for row in references.of(AxisRow)}
    for joint in range(1, len(slides) + 1):
        if "axes" in present and joint not in with_axis:
            axis = fact("axis_position", joint=joint, coordinate=None)
            gaps.append(model.Unjudged(axis, "axes", "mm", note, reference_set=name))
        wanted = [("limits", fact("joint_limit", joint=joint, side=side)) for side in ("lower", "upper")]
        wanted.append(("speeds", fact("joint_speed", joint=joint)))
        units = ("mm", "mm/s") if slides[joint - 1] else ("deg", "deg/s")
        gaps += [
            model.Unjudged(subject, group, units[group == "speeds"], note, reference_set=name)
            for group, subject in wanted
            if group in present and subject not in subjects
        ]
    return gaps


JOINT_TOLERANCE_DEG = 1e-6  # of a round trip: far above its rounding, far below any tolerance of a document
POSITION_TOLERANCE_MM = 1e-6
ORIENTATION_TOLERANCE_DEG = 1e-6
SHORTEST, LONGEST = MIN_LONGEST_MM / 1000, LONGEST_LENGTH_MM / 1000  # m, as a robot file may have them
GROUP: Literal["round_trips"] = "round_trips"


def table_checks(robot: Robot) -> list[model.Check]:
    """Checks of the table alone: sound numbers in plausible units, and whether a closed-form inverse applies to it.

    Returns
    -------
    checks : counts of faults, each of which should be 0
    """
    parts = [robot.a, robot.alpha, robot.d, robot.offset, robot.lower, robot.upper, robot.base]
    limits = np.abs([robot.lower, robot.upper])
    lengths = np.concatenate([np.abs([robot.a, robot.d]).ravel(), limits[:, robot.slides].ravel()])
    turning = limits[:, ~robot.slides & ~robot.continuous]
    faults: dict[model.SelfChecked, int] = {
        "numbers_not_finite": sum(int((~np.isfinite(part)).sum()) for part in parts),
        "crossed_limits": int((robot.lower > robot.upper).sum()),
        "odd_directions": int((np.abs(robot.direction) != 1).sum()),
        "length_unit": int(not SHORTEST <= np.nanmax(lengths) <= LONGEST),
        "limit_unit": int(turning.shape[1] > 1 and 0 < np.degrees(np.nanmax(turning)) < WIDEST_IN_RADIANS),
    }
    checks = [against_itself(name, "table_sanity", float(count), NONE_ALLOWED) for name, count in faults.items()]
    missing = fact("numbers_missing") if checks[0].status == "fail" else wrist_partition_missing(robot)
    if missing:
        return [*checks, model.Unjudged(fact("self_check", quantity="closed_form"), "table_sanity", "", missing)]
    return [*checks, against_itself("closed_form", "table_sanity", 0.0, NONE_ALLOWED)]


def round_trip_checks(robot: Robot, poses: int, seed: int) -> tuple[list[model.Check], model.RoundTripErrors | None]:
    """Round trips from random joints to a pose and back, as checks.

    Parameters
    ----------
    poses : how many; fewer of an arm without the closed form of spherical wrists
    seed : of the random joints

    Returns
    -------
    checks : counts of poses, and the worst errors in deg and mm
    errors : None if the arm has no such closed form, or coupled joints
    """
    missing = wrist_partition_missing(robot)
    if missing and not round_trips.has_class(robot):
        return [
            model.Unjudged(
                fact("self_check", quantity="joints_to_pose_to_joints"),
                GROUP,
                "deg",
                fact("no_closed_form", missing=missing),
            )
        ], None
    by_class = missing is not None or robot.coupling is not None
    poses = min(poses, round_trips.MAX_BY_CLASS) if by_class else poses
    found = round_trips.batch_round_trips(robot, np.random.default_rng(seed), poses)
    millimetres, degrees = 1000 * found.worst_position, float(np.degrees(found.worst_orientation))
    lost = found.poses - found.own_found if by_class else found.unsolved
    checks: list[model.Check] = [
        against_itself("unsolved_poses", GROUP, float(lost), NONE_ALLOWED),
        against_itself("position_error", GROUP, millimetres, POSITION_TOLERANCE_MM, "mm"),
        against_itself("orientation_error", GROUP, degrees, ORIENTATION_TOLERANCE_DEG, "deg"),
    ]
    if by_class:
        return checks, None
    joints, regular = float(np.degrees(found.worst_regular)), poses - found.near_singular
    wrist, elbow, shoulder = round_trips.NEAR_WRIST_DEG, round_trips.NEAR_ELBOW_DEG, round_trips.NEAR_SHOULDER_MM
    note = fact("near_singular_left_out", judged=regular, poses=poses, wrist_deg=wrist, shoulder_mm=shoulder)
    checks.insert(1, against_itself("joint_error", GROUP, joints, JOINT_TOLERANCE_DEG, "deg", note))
    margins = model.Margins(wrist, elbow, shoulder)
    errors = (poses, found.near_singular, joints, found.unsolved, found.within_limits / poses)
    return checks, model.RoundTripErrors(*errors, margins)


OF_THE_TOOL: tuple[PartName, ...] = ("geometry", "zero_and_directions")


def parts_found(evidence: Evidence) -> tuple[Finding, ...]:
    """What is known of each part of a table: geometry, zero and directions, and others.

    Parameters
    ----------
    evidence : of its entries and their combinations

    Returns
    -------
    parts : those that the robot's file gives
    """
    by_part: dict[PartName, list[EntryEvidence]] = {part: [] for part in PART_OF_GROUP.values()}
    for each in (*evidence.entries, *evidence.combinations):
        group = GROUP_OF.get(column_of(each.entry.split()[0].lstrip("-")))
        if group is not None:
            by_part[PART_OF_GROUP[group]].append(each)
    return tuple(_part(evidence, part, own) for part, own in by_part.items() if own)


def _part(evidence: Evidence, part: PartName, own: Sequence[EntryEvidence]) -> Finding:
    def named(wanted: Status) -> tuple[str, ...]:
        return tuple(each.entry for each in own if each.status == wanted)

    off = reduce(ToolOff.worse, (each.off for each in own if each.status in ("weak", "open")), NOT_OFF)
    if part == "zero_and_directions" and named("open"):
        off = off.worse(together(evidence, list(named("open"))))
    return fact(
        "part_found",
        part=part,
        status=next((each for each in GRAVEST if named(each)), "settled"),
        entries=sum(each.status != "gauge" for each in own),
        settled=len(named("settled")),
        up_to_signs=len(named("settled_up_to_signs")),
        contradicted=named("contradicted"),
        open=named("open"),
        off_mm=off.mm,
        off_deg=off.deg,
    )


TELLING_SHARE = 0.25  # of the largest difference in mm: a check that is off by less is not the one quoted
SHOWN_DECIMALS = 9


def set_summaries(
    robot: Robot,
    sets: list[ReferenceSet],
    checks: list[model.Check],
    poses: model.KeyPoses,
    diagnoses: Mapping[str, model.SetDiagnosis],
) -> tuple[model.SetSummary, ...]:
    """What was found against each reference set.

    Parameters
    ----------
    checks : of all sets
    poses : at which references state a point
    diagnoses : by the set's name, as far as there are any

    Returns
    -------
    summaries : one for each set, in their order
    """
    found = []
    for references in sets:
        counts = counts_of(check for check in checks if check.reference_set == references.name)
        weighing = counts.independent, counts.consistency
        failed, total = (sum(getattr(each, name) for each in weighing) for name in ("failed", "total"))
        diagnosis = diagnoses.get(references.name)  # none of arms with prismatic or coupled joints
        conclusion = diagnosis.conclusion if diagnosis else None
        found.append(
            model.SetSummary(
                name=references.name,
                grades=tuple(sorted({reference.grade for reference in references.references})),
                counts=counts,
                another_arm=is_another_arm(failed, total, conclusion),
                described=not_the_robot_described(robot, references, conclusion),
                own_text=inconsistent_with_own_text(robot, references),
                zero_pose_flange_off_mm=_zero_pose_error(poses, references.name),
            )
        )
    return tuple(found)


def verdict_of(
    checks: list[model.Check],
    conflicts: list[model.Conflict],
    sets: tuple[model.SetSummary, ...],
    diagnoses: Mapping[str, model.SetDiagnosis],
    evidence: model.TableEvidence | None,
) -> Verdict:
    """The stage's answer.

    Parameters
    ----------
    checks : of the model itself and against all sets
    conflicts : what references contradict each other about
    diagnoses : by the set's name
    evidence : what documents settle of the table; None where no reference states a value

    Returns
    -------
    verdict : fail if the model is unsound or authoritative documents contradict it, no_reference without any of these.
        It passes only if documents settle all that moves the tool.
    """
    documented = [check for check in _referenced(checks) if check.grade in AUTHORITATIVE_GRADES]
    failed = [check for check in documented if check.status == "fail"]
    counts = counts_of(checks)
    common: dict[str, Any] = {
        "counts": tally_facts(counts),
        "claims": _claims(sets),
        "own_text": tuple(each.own_text for each in sets if each.own_text),
    }
    for check in checks:
        if isinstance(check, model.Judged) and check.kind is None and check.status == "fail":
            measured = Amount(check.measured, check.unit)
            return Verdict("fail", fact("validation.model_unsound", **common, check=check.subject, measured=measured))
    grades = tuple(grade for grade in AUTHORITATIVE_GRADES if grade in {check.grade for check in documented})
    if failed:
        every = evidence.entries if evidence else ()
        excluded = tuple(each.entry for each in every if each.status == "contradicted" and each.moves_tool)
        return Verdict("fail", _missed(failed, sets, diagnoses).but(**common, grades=grades, contradicted=excluded))
    if not documented:
        return Verdict("no_reference", fact("validation.no_reference", **common))
    common |= {"contradiction": _contradiction(conflicts) if conflicts else None}
    moving = [part for part in evidence.parts if part.part in OF_THE_TOOL] if evidence else []
    if evidence and moving and all(part.status == "settled" for part in moving):
        return Verdict("pass", fact("validation.confirmed", **common, grades=grades))
    left = fact("validation.left_open", **common, conflicting=counts.independent.conflicting, **_left_of(evidence))
    known = not left.parts or any(part.settled or part.up_to_signs for part in left.parts)
    why = "uncovered" if not counts.independent.total else "uncontradicted" if known else "unsettled"
    return Verdict("caution", left.but(why=why))


def _left_of(evidence: model.TableEvidence | None) -> dict[str, Any]:
    """What evidence leaves open of a table."""
    parts = evidence.parts if evidence else ()
    entries = (*evidence.entries, *evidence.combinations) if evidence else ()
    moving = [part for part in parts if part.part in OF_THE_TOOL]
    return {
        "parts": parts,
        "settled_mm": evidence.tolerance.mm if evidence else None,
        "settled_deg": evidence.tolerance.deg if evidence else None,
        "off_mm": max((part.off_mm for part in moving), default=0.0),
        "off_deg": max((part.off_deg for part in moving), default=0.0),
        "at_least": any(each.at_least for each in entries),
        "unbounded": tuple(each.entry for each in entries if each.moves_tool and each.status == "consistent"),
        "next_measurement": _next_measurement(evidence),
    }


def _next_measurement(evidence: model.TableEvidence | None) -> Finding | None:
    """What would settle the entry for which the tool could be off farthest; of equals, what documents leave open."""
    if evidence is None:
        return None
    by_name = {each.entry: each for each in (*evidence.entries, *evidence.combinations)}

    def gravity(proposal: Finding) -> tuple[float, float, bool]:
        each = by_name[proposal.entry]
        return each.off.mm, each.off.deg, each.status == "open"

    return max(evidence.proposals, key=gravity, default=None)


def counts_of(checks: Iterable[model.Check]) -> CheckCounts:
    """Checks against references, counted by what they rest on.

    Parameters
    ----------
    checks : others than against references do not count

    Returns
    -------
    counts : passed, failed and in conflict, of independent checks, those of consistency, and claims
    """
    referenced = _referenced(checks)

    def tally(kind: CheckKind) -> CheckTally:
        own = [check.status for check in referenced if check.kind == kind]
        return CheckTally(own.count("pass"), own.count("fail"), own.count("conflict"))

    return CheckCounts(tally("independent"), tally("consistency"), tally("claim"))


def _referenced(checks: Iterable[model.Check]) -> list[model.Judged]:
    return [check for check in checks if isinstance(check, model.Judged) and check.kind is not None]


def tally_facts(counts: CheckCounts) -> tuple[Finding, ...]:
    """How many checks pass, by what they rest on; independent ones alone where there are none of any kind.

    Parameters
    ----------
    counts : of claims, which no verdict rests on, nothing is said
    """
    kinds = {"independent": counts.independent, "consistency": counts.consistency}
    shown = {kind: own for kind, own in kinds.items() if own.total} or {"independent": counts.independent}
    return tuple(fact("counted_checks", kind=kind, passed=own.passed, total=own.total) for kind, own in shown.items())


def most_telling(failed: list[model.Judged]) -> model.Judged:
    """The failed check to quote in a verdict.

    Parameters
    ----------
    failed : at least one

    Returns
    -------
    check : of those not far behind the largest difference in mm, the first of the group that tells most
    """
    lengths = [check for check in failed if check.unit == "mm"]
    smallest = TELLING_SHARE * max((abs(check.difference) for check in lengths), default=0.0)
    large = [check for check in lengths if abs(check.difference) >= smallest]
    return min(large or failed, key=lambda check: GROUPS[check.group])


def key_figures(
    checks: list[model.Check],
    axes: model.Axes,
    sets: tuple[model.SetSummary, ...],
    reach: Mapping[str, float],
    trips: model.RoundTripErrors | None,
) -> tuple[Figure, ...]:
    """The stage's key figures.

    Parameters
    ----------
    axes : stated axes against the model's
    reach : mm, by the figure's name
    trips : errors of round trips; None if the arm has no closed form

    Returns
    -------
    figures : mm, deg, or counts; only those that there are data for
    """
    counts = counts_of(checks)
    figures = [
        Figure(name, tally.passed, "", of=tally.total)
        for name, tally in (("independent_checks", counts.independent), ("consistency_checks", counts.consistency))
        if tally.total
    ]
    errors = [
        (each.is_authoritative, each.zero_pose_flange_off_mm)
        for each in sets
        if each.zero_pose_flange_off_mm is not None
    ]
    if errors:
        figures.append(_figure("zero_pose_flange_error", max(errors)[1]))
    trusted = axes.take(np.isin(axes.grade, AUTHORITATIVE_GRADES))
    if len(trusted):
        figures.append(_figure("farthest_axis", float(trusted.distance_mm.max())))
        figures.append(_figure("most_tilted_axis", float(trusted.angle_deg.max()), "deg"))
    labels = [abs(check.difference) for check in _referenced(checks) if check.group == "envelope"]
    if labels:
        figures.append(_figure("worst_drawing_label", max(labels)))
    figures += [_figure(name, value) for name, value in reach.items()]
    if trips:
        figures.append(Figure("round_trip_joint_error", trips.joint_error_deg, "deg"))
        figures.append(Figure("solutions_of_random_pose", trips.solutions, "", of=SLOTS))
    return tuple(figures)


def _figure(name: str, value: float, unit: str = "mm") -> Figure:
    return Figure(name, round(value, SHOWN_DECIMALS), unit)


def _missed(
    failed: list[model.Judged], sets: tuple[model.SetSummary, ...], diagnoses: Mapping[str, model.SetDiagnosis]
) -> Finding:
    """What documents contradict, by the failed check that tells most."""
    quoted = most_telling(failed)
    own = next(each for each in sets if each.name == quoted.reference_set)
    conclusion = diagnoses[own.name].conclusion if own.name in diagnoses else None
    named = conclusion if is_one(conclusion, "named", "mostly") else None
    faults = named.faults if named else ()
    chosen = any(is_one(fault, *CONVENTIONS) for fault in faults)
    chosen &= all(is_one(fault, "wrong_limit", *CONVENTIONS) for fault in faults)
    code = "another_arm" if own.another_arm else "defined_otherwise" if chosen else "contradicted"
    return fact(
        f"validation.{code}",
        reference_set=own.name,
        check=quoted.subject,
        measured=quoted.measured,
        expected=quoted.expected,
        unit=quoted.unit,
        diagnosis=None if own.another_arm else named,
        described=own.described if own.another_arm else None,
    )


def _zero_pose_error(poses: model.KeyPoses, set_name: str) -> float | None:
    own = (poses.reference_set == set_name) & (poses.group == "zero_pose") & (poses.point == "flange")
    own &= np.isfinite(poses.deviation_mm)
    return float(poses.deviation_mm[own].max()) if own.any() else None


def _claims(sets: tuple[model.SetSummary, ...]) -> tuple[Finding, ...]:
    """Of sets of claims alone, and of claims among documents that do not hold."""
    found = [(each, each.counts.claims) for each in sets]
    return tuple(
        fact("claims", reference_set=each.name, claims=claims.total, failed=claims.failed)
        for each, claims in found
        if (claims.failed if each.is_authoritative else claims.total)
    )


def _contradiction(conflicts: list[model.Conflict]) -> Finding:
    first = conflicts[0]
    stated = tuple(statement.expected for statement in first.statements)
    return fact("contradiction", subject=first.subject, unit=first.unit, stated=stated, more=len(conflicts) - 1)
