"""The validation page."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from er3a.pipeline.messages.decision import decision
from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.messages.say import counted, joined, say, word
from er3a.pipeline.messages.validation import CONVENTIONS, FIGURES, GRADE_NAMES, GRADES, GROUPS
from er3a.pipeline.messages.validation_verdict import counted_checks
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.validation.axis_figures import axis_deviation, side_view, workspace_drawing
from er3a.pipeline.stages.validation.check_model import ReferenceCheck, Unjudged
from er3a.pipeline.stages.validation.check_rows import COLUMNS, Judged, blank_row, by_kind, check_row, group_rows
from er3a.pipeline.stages.validation.corrected import corrected_robot
from er3a.pipeline.stages.validation.diagnosis_figures import correction_stories, diagnosis_stories
from er3a.pipeline.stages.validation.evidence_section import OTHER_TITLES, evidence_section, other_robot
from er3a.pipeline.stages.validation.frames_figure import link_frames
from er3a.pipeline.stages.validation.model import (
    Axes,
    KeyPoses,
    Section,
    SetSummary,
    ValidationResults,
    ValidationSummary,
)
from er3a.pipeline.stages.validation.subject import model_of
from er3a.pipeline.stages.validation.symbolic_section import formulas
from er3a.pipeline.stages.validation.wording import typographic
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.instead import table_instead
from er3a.pipeline.viewing.page import Head, Picture, fixed, head_of, render, run_command
from er3a.references.subjects import SegmentInclination
from er3a.robots.robot import AUTHORITATIVE_GRADES, Robot

SHOWN_FAILURES = 12
REVERSED_DEG = 135
SEGMENTS = {
    "upper_arm": N_("the upper arm stands {measured}° from the vertical where {expected}° is stated"),
    "forearm": N_("the forearm stands {measured}° from the vertical where {expected}° is stated"),
}


@dataclass(frozen=True)
class SetStory:
    """What the page says about one reference set; counts, groups, segments, points and statements in words."""

    found: SetSummary
    counted: str
    is_authoritative: bool
    conflicting: int
    statements: list[str]
    telling: list[list[str]]
    failed_groups: str
    held_groups: str
    zero_model: str
    zero_stated: str
    segments: str
    segments_hold: bool


def report(study: Study, stored: Stored[ValidationResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, results, summary = stored.robot, stored.results, stored.results.summary
    robot, checks = model_of(study, name), summary.checks
    judged = [check for check in checks if not isinstance(check, Unjudged)]
    failed = [check for check in judged if check.status == "fail"]
    failed.sort(key=lambda check: check.tolerances_off, reverse=True)
    labels = results.key_poses.take(results.key_poses.group == "envelope")
    drawn = _drawn_axes(results.axes)
    source = robot.sources.get("dh")
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        head=_head(study, stored),
        command=run_command(study, f"{name}/validation.html"),
        robot=robot,
        robot_pages=study.pages(name),
        table_evidence=evidence_section(summary.evidence),
        frames=_frames_picture(robot, summary),
        formulas=formulas(robot),
        sets=[_set_story(found, judged, results.key_poses) for found in summary.sets],
        diagnoses=diagnosis_stories(summary, results.residuals),
        corrections=correction_stories(summary, results.corrections),
        groups=group_rows(judged),
        failed=[check_row(check) for check in failed[:SHOWN_FAILURES]],
        more_failed=[check_row(check) for check in failed[SHOWN_FAILURES:]],
        passed={
            title: [check_row(check) for check in own if check.status == "pass"]
            for title, own in by_kind(judged).items()
        },
        columns=[tr(label) for label in COLUMNS],
        conflicts=[(say(conflict.subject), conflict) for conflict in summary.conflicts],
        blanks=[blank_row(check) for check in checks if isinstance(check, Unjudged)],
        side=_side_picture(robot, drawn, summary),
        deviation=_deviation_picture(drawn) if len(drawn) else None,
        drawing=_drawing_picture(results.section, labels, summary) if len(labels) else None,
        labels=_label_rows(labels, judged),
        table_source=source and (source.source, word("grade", GRADES, source.grade)),
        convention=word("convention", CONVENTIONS, robot.convention),
        grade_names={grade: word("grade", GRADE_NAMES, grade) for grade in GRADE_NAMES},
    )


def _head(study: Study, stored: Stored[ValidationResults]) -> Head:
    """The head; the verdict on a table that evidence contradicts begins with what to do."""
    head = head_of(stored, FIGURES)
    if head.status != "fail":
        return head
    instead = table_instead(study, stored.robot, stored.folder.parents[1]) if stored.folder else None
    return replace(head, text=joined([decision(head.status, (), instead), head.text], " "))


def _set_story(found: SetSummary, checks: Iterable[Judged], poses: KeyPoses) -> SetStory:
    own = [check for check in checks if isinstance(check, ReferenceCheck) and check.reference_set == found.name]
    failed = {check.group for check in own if check.status == "fail"}
    held = {check.group for check in own if check.status == "pass"} - failed
    segments = [(check.subject, check) for check in own if isinstance(check.subject, SegmentInclination)]
    at_zero = (poses.reference_set == found.name) & (poses.group == "zero_pose") & (poses.point == "flange")
    zero = poses.take(np.flatnonzero(at_zero)[:1])
    claims, weighing = found.counts.claims, (found.counts.independent, found.counts.consistency)
    return SetStory(
        found=found,
        counted=counted_checks(found.counts)
        if found.is_authoritative
        else tr("{passed} of {total} claims hold", passed=claims.passed, total=claims.total),
        is_authoritative=found.is_authoritative,
        conflicting=sum(each.conflicting for each in weighing),
        statements=[typographic(say(each)) for each in (found.described, found.own_text) if each],
        telling=[check_row(check) for check in _telling(own)],
        failed_groups=_group_words(failed),
        held_groups=_group_words(held),
        zero_model=_point(zero.model_point_mm),
        zero_stated=_point(zero.point_mm),
        segments=joined((_segment(subject, check) for subject, check in segments), ", "),
        segments_hold=all(check.status == "pass" for _, check in segments),
    )


def _group_words(groups: Iterable[str]) -> str:
    return joined((word("group", GROUPS, group) for group in sorted(groups)), ", ")


def _segment(subject: SegmentInclination, check: ReferenceCheck) -> str:
    """How a segment of the arm stands, and how it is stated to."""
    template = SEGMENTS[subject.segment]
    return tr(template, measured=fixed(check.measured, 0), expected=fixed(check.expected, 0))


def _telling(own: list[ReferenceCheck]) -> list[ReferenceCheck]:
    """One failed length per group, the farthest off."""
    worst: dict[str, ReferenceCheck] = {}
    for check in own:
        if check.status != "fail" or check.unit != "mm":
            continue
        if check.group not in worst or abs(check.difference) > abs(worst[check.group].difference):
            worst[check.group] = check
    return list(worst.values())


def _point(points_mm: np.ndarray) -> str:
    return ", ".join(fixed(value, 1) for value in points_mm[0]) if len(points_mm) else ""


def _drawn_axes(axes: Axes) -> Axes:
    """Axes to draw: those from authoritative sources, or else the claims."""
    authoritative = np.isin(axes.grade, AUTHORITATIVE_GRADES)
    return axes.take(authoritative) if authoritative.any() else axes


def _frames_picture(robot: Robot, summary: ValidationSummary) -> Picture:
    other = other_robot(robot, summary.evidence)
    code = summary.evidence.other.code if summary.evidence and summary.evidence.other else ""
    label = word(code, OTHER_TITLES, code) if code == "described" else ""
    caption = tr(
        "All joints at 0. Frame 0 is the base, frame k the one that row k of the table leads to, frame 6 the flange."
    )
    if code == "described":
        caption = joined([caption, tr("Dashed: the arm that independent documents describe.")], " ")
    alt = tr("The arm in its zero pose, seen from a corner, with its link frames.")
    return Picture(link_frames(robot, other if label else None, label), alt, caption)


def _side_picture(robot: Robot, drawn: Axes, summary: ValidationSummary) -> Picture:
    corrected, label = corrected_robot(robot, summary.diagnoses)
    if not len(drawn):
        caption = tr("No reference states any axis: there is nothing to compare the model's with.")
    elif not drawn.is_off.any():
        caption = tr("Each axis of the model lies on the stated one: the links have the right lengths and offsets.")
    else:
        farthest = drawn.distance_mm.max()
        template = (
            N_(
                "The model's axes are up to {farthest} mm from the stated ones: the two arms differ in size and "
                "shape, not in a detail."
            )
            if any(found.another_arm for found in summary.sets)
            else N_("The model's axes are up to {farthest} mm from the stated ones.")
        )
        caption = tr(template, farthest=fixed(farthest, 0 if farthest >= 10 else 2))
        if corrected is not None:
            corrected_set = next(found.reference_set for found in summary.diagnoses if found.corrected)
            correction = (
                tr("The dashed arm has the named fault corrected: it meets the stated axes.")
                if drawn.reference_set[0] == corrected_set
                else tr("The dashed arm has the model's own zero pose corrected; it still misses the stated axes.")
            )
            caption = joined([caption, correction], " ")
    alt = tr("Side view of the zero pose: links and joint axes of the model, and the axes that references state.")
    return Picture(side_view(robot, drawn, corrected, label), alt, caption)


def _deviation_picture(axes: Axes) -> Picture:
    off = axes.take(axes.is_off)
    if len(off):
        caption = tr("Outside the source's uncertainty: {joints}.", joints=_joints(off))
        turned = off.take(off.angle_deg > REVERSED_DEG)
        if len(turned):
            caption = joined([caption, tr("Turning the other way: {joints}.", joints=_joints(turned))], " ")
    else:
        caption = tr("No axis is outside its source's uncertainty (outlined boxes).")
    alt = tr("Bars per joint and source: distance and angle between the model's axis and the stated one.")
    return Picture(axis_deviation(axes), alt, caption)


def _joints(axes: Axes) -> str:
    return joined((f"J{joint}" for joint in np.unique(axes.joint)), ", ")


def _label_rows(labels: KeyPoses, checks: Iterable[Judged]) -> list[list[str]]:
    """The drawing's labels with the numbers that they have in the figure."""
    numbers = {pose: place for place, pose in reversed(list(enumerate(labels.pose, 1)))}
    rows = []
    for check in checks:
        if check.group == "envelope":
            values = [fixed(check.expected, 1), fixed(check.measured, 2), fixed(check.difference, 2)]
            place = numbers[check.subject.whole]
            rows.append((place, [str(place), say(check.subject), *values, f"{check.tolerance:g}"]))
    return [row for _, row in sorted(rows, key=lambda row: row[0])]


def _drawing_picture(section: Section, labels: KeyPoses, summary: ValidationSummary) -> Picture:
    missed = [check for check in summary.checks if check.group == "envelope" and check.status == "fail"]
    worst = fixed(labels.deviation_mm.max(), 2)
    caption = (
        tr(
            "The manufacturer's labels lie on the region's edge, off by {worst} mm at most: lengths, limits of J2 and "
            "J3 and the signs of both joints agree with the drawing.",
            worst=worst,
        )
        if not missed
        else counted(
            "labels_missed",
            "{count} label is missed, by up to {worst} mm.",
            "{count} labels are missed, by up to {worst} mm.",
            len(missed),
            worst=worst,
        )
    )
    alt = tr("Region that the wrist centre sweeps with joints 2 and 3, and the drawing's labels, numbered.")
    return Picture(workspace_drawing(section, labels, summary.section_origin_mm), alt, caption)
