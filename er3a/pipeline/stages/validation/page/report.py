"""The validation page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from er3a.files.robot_library import robot_of
from er3a.files.robot_writer import robot_file, robot_text
from er3a.kinematics.forward import skeleton
from er3a.kinematics.symbolic import Factor, Product, SymbolicTransform, arm_transform, link_transforms
from er3a.pipeline.language import N_, own_title, tr, with_unit
from er3a.pipeline.messages.diagnosis import CONVENTIONS
from er3a.pipeline.messages.numbers import fixed, measured, number
from er3a.pipeline.messages.pages import GRADE_NAMES
from er3a.pipeline.messages.say import bracketed, joined, say, word
from er3a.pipeline.messages.validation import GRADES, GROUPS, counted_checks, unconfirmed
from er3a.pipeline.results import Stored, read_stage
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.validation import model
from er3a.pipeline.stages.validation.page import validation_figures
from er3a.pipeline.stages.validation.page.evidence_section import (
    OTHER_TITLES,
    SETTLED,
    evidence_section,
    other_robot,
    table_to_use,
)
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, Fix
from er3a.pipeline.viewing.page import (
    Picture,
    alternative_table,
    render_stage,
    text_address,
)
from er3a.pipeline.viewing.side_view import UPRIGHT, seen_arm, side_view
from er3a.references.subjects import SegmentInclination
from er3a.robots.robot import AUTHORITATIVE_GRADES, Robot

SEEN_M = 2e-3  # by which two arms differ in a drawing
DECIMALS = {"mm": 2, "deg": 2, "deg/s": 1, "mm/s": 1, "": 0}
COLUMNS = (
    N_("Check"),
    N_("Model>"),
    N_("Reference>"),
    N_("Difference>"),
    N_("Tolerance>"),
    N_("Unit"),
    N_("Source"),
)

Judged = model.ModelCheck | model.ReferenceCheck


def by_set(checks: Iterable[Judged]) -> dict[str, list[Judged]]:
    """Checks by the set that they come from, as the page names it."""
    found: dict[str, list[Judged]] = {}
    for check in checks:
        found.setdefault(check.reference_set or tr("the model itself"), []).append(check)
    return found


def group_rows(checks: Iterable[Judged]) -> list[dict[str, Any]]:
    """A row for each set and group."""
    rows = []
    for title, own in by_set(checks).items():
        for group in dict.fromkeys(check.group for check in own):
            part = [check for check in own if check.group == group]
            counted = Counter(check.status for check in part)
            status = "fail" if counted["fail"] else "conflict" if counted["conflict"] else "pass"
            worst = max(part, key=lambda check: check.tolerances_off)
            rows.append(
                dict(
                    set=title,
                    group=word("group", GROUPS, group),
                    status=status,
                    counts=(counted["pass"], counted["fail"], counted["conflict"]),
                    worst=say(worst.subject),
                    difference=with_unit(_value(worst.difference, worst), worst.unit),
                )
            )
    return rows


def check_row(check: Judged) -> list[str]:
    """A check in the columns of ``COLUMNS``."""
    values = [_value(value, check) for value in (check.measured, check.expected, check.difference)]
    if isinstance(check, model.ReferenceCheck):
        grade = word("grade", GRADE_NAMES, check.grade)
        source = bracketed(own_title(check.source), grade)
    else:
        source = tr("the model itself")
    return [say(check.subject), *values, _tolerance(check), tr(check.unit), source]


def _value(value: float, check: model.Check) -> str:
    """A value in its unit's decimals; errors of round trips, which are far smaller, by what they are below."""
    if check.group == "round_trips" and 0 < abs(value) < 1e-3:
        return measured(value, None, check.unit)
    return fixed(value, DECIMALS[check.unit])


def _tolerance(check: Judged) -> str:
    """A check's tolerance as it is given."""
    given = f"{check.tolerance:g}"
    return number(check.tolerance, 1) if "e" in given else given


def blank_row(check: model.Unjudged) -> list[str]:
    """What is not judged: its name, the model's value, the set, and why."""
    measured = with_unit(_value(check.measured, check), check.unit) if check.measured is not None else "–"
    return [say(check.subject), measured, check.reference_set or "–", say(check.note)]


FRAME_COLUMNS = "noap"  # of a transform: the frame's x, y and z axis, and its origin
MM = 1000.0
DIGITS = 6
MAX_PRODUCTS = 200  # of one entry; nobody reads more


@dataclass(frozen=True)
class Formulas:
    """MathML of a table's transforms.

    Attributes
    ----------
    moved : what moves of each row, its theta or its d, by the joints
    links : a matrix in symbols and one in numbers for each link, lengths in mm
    arm : name, formula and value in the zero pose of each entry of the upper three rows; none if one is too long
    longest : products of the arm's longest entry
    """

    moved: list[Markup]
    links: list[Markup]
    arm: list[tuple[Markup, Markup, str]]
    longest: int


def formulas(robot: Robot) -> Formulas:
    """A robot's transforms."""
    zero, arm = np.where(robot.sliding, robot.d, robot.offset), arm_transform(robot)
    values = arm.at(zero)
    longest = max(len(entry) for row in arm.entries for entry in row)
    entries = [(r, c) for c in range(4) for r in range(3)] if longest <= MAX_PRODUCTS else []
    return Formulas(
        moved=[_moved(robot, k) for k in range(robot.rows)],
        links=[_link(k, link, zero) for k, link in enumerate(link_transforms(robot))],
        arm=[
            (
                _math(_sub(FRAME_COLUMNS[c], "xyz"[r])),
                _math(_sum(arm.entries[r][c], c == 3)),
                fixed(values[r, c] * (MM if c == 3 else 1.0), 2 if c == 3 else 4),
            )
            for r, c in entries
        ],
        longest=longest,
    )


def _moved(robot: Robot, k: int) -> Markup:
    """``θ3 = q2 + q3 + 90°`` or ``d3 = −q3 + 200``: what moves of a row, by the joints."""
    by_joint = robot.direction[k] * (np.eye(robot.rows) if robot.coupling is None else robot.coupling)[k]
    terms = Markup("")
    for n in np.flatnonzero(by_joint):
        terms += _signed(by_joint[n], _sub("q", int(n) + 1), first=not terms)
    if robot.sliding[k]:
        name, shift, unit = "d", float(robot.d[k]) * MM, ""
    else:
        name, shift, unit = "θ", float(np.degrees(robot.offset[k])), "°"
    if shift:
        terms += Markup("<mo>{}</mo><mn>{}{}</mn>").format("+" if shift > 0 else "−", _plain(abs(shift)), unit)
    return _math(Markup("{}<mo>=</mo>{}").format(_sub(name, k + 1), terms))


def _signed(factor: float, symbol: Markup, first: bool) -> Markup:
    sign = "−" if factor < 0 else "" if first else "+"
    shown = Markup("") if abs(factor) == 1 else _number(abs(factor))
    return Markup("{}{}{}").format(Markup("<mo>{}</mo>").format(sign) if sign else "", shown, symbol)


def _link(k: int, link: SymbolicTransform, zero: np.ndarray) -> Markup:
    symbols = [[_sum(entry, c == 3 and r < 3) for c, entry in enumerate(row)] for r, row in enumerate(link.entries)]
    values = link.at(zero) * np.array([[1, 1, 1, MM]] * 3 + [[1] * 4])
    numbers = [[_number(value) for value in row] for row in values]
    return _math(Markup("{}<mo>=</mo>{}<mo>=</mo>{}").format(_sub("A", k + 1), _matrix(symbols), _matrix(numbers)))


def _sum(entry: Mapping[Product, float], is_length: bool) -> Markup:
    terms = Markup("")
    for product, coefficient in entry.items():
        in_mm = is_length and not any(function == "d" for function, _ in product)
        size = abs(coefficient) * (MM if in_mm else 1.0)
        sign = "−" if coefficient < 0 else "+" if terms else ""
        shown = Markup("") if product and abs(size - 1) < 1e-9 and not in_mm else _number(size)
        factors = Markup("<mo>&#8290;</mo>").join(map(_factor, product))
        terms += Markup("{}{}{}").format(Markup("<mo>{}</mo>").format(sign) if sign else "", shown, factors)
    return terms or _number(0.0)


def _factor(factor: Factor) -> Markup:
    return _sub(factor[0], "".join(map(str, factor[1])))


def _sub(letter: str, index: int | str) -> Markup:
    return Markup("<msub><mi>{}</mi><mn>{}</mn></msub>").format(letter, index)


def _number(value: float) -> Markup:
    rounded = round(value, DIGITS) + 0.0
    sign = Markup("<mo>−</mo>") if rounded < 0 else Markup("")
    return Markup("<mrow>{}<mn>{}</mn></mrow>").format(sign, _plain(abs(rounded)))


def _plain(value: float) -> str:
    return f"{value:.{DIGITS}f}".rstrip("0").rstrip(".")


def _matrix(rows: list[list[Markup]]) -> Markup:
    cells = [Markup("").join(Markup("<mtd>{}</mtd>").format(cell) for cell in row) for row in rows]
    lines = Markup("").join(Markup("<mtr>{}</mtr>").format(row) for row in cells)
    return Markup("<mrow><mo>[</mo><mtable>{}</mtable><mo>]</mo></mrow>").format(lines)


def _math(content: Markup) -> Markup:
    return Markup("<math>{}</math>").format(content)


SHOWN_FAILURES = 12
SEGMENTS = {
    "upper_arm": N_("the upper arm stands {measured}° from the vertical where {expected}° is stated"),
    "forearm": N_("the forearm stands {measured}° from the vertical where {expected}° is stated"),
}


def report(study: Study, stored: Stored[model.ValidationResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, results, summary = stored.robot, stored.results, stored.results.summary
    robot, checks = model.model_of(study, name), summary.checks
    judged = [check for check in checks if not isinstance(check, model.Unjudged)]
    failed = [check for check in judged if check.status == "fail"]
    failed.sort(key=lambda check: check.tolerances_off, reverse=True)
    drawn = _drawn_axes(results.axes)
    source = robot.sources.get("dh")
    contradicted = summary.verdict.status == "fail"
    corrected, _ = validation_figures.corrected_robot(robot_of(study.table(name)).replace(name=name), summary.diagnoses)
    file = robot_file(corrected) if corrected and not summary.is_beyond_correction else None
    text = robot_text(file) if file else ""
    instead = alternative_table(study, name, stored.folder.parents[1]) if contradicted and stored.folder else None
    unsettled, known = _known(stored, instead) if instead else ("", None)
    evidence = evidence_section(robot, summary.evidence, known)
    render_stage(
        study,
        stored,
        output,
        _answer(summary, instead, evidence is not None),
        arms=_both_arms(robot, study.robot(instead) if instead else other_robot(robot, summary.evidence)),
        at_side=evidence is not None,
        head_links={instead: f"../{instead}/validation.html"} if instead else {},
        robot=robot,
        to_use=table_to_use(robot, study.robot(instead), unsettled, known) if instead else None,
        table_evidence=evidence,
        frames=_frames_picture(robot, summary),
        formulas=formulas(robot),
        sets=[_set_story(found, judged, results.key_poses) for found in summary.sets],
        diagnoses=validation_figures.diagnosis_stories(summary),
        corrected=text,
        corrected_address=text_address(text),
        groups=group_rows(judged),
        failed=[check_row(check) for check in failed[:SHOWN_FAILURES]],
        all_failed=len(failed),
        columns=[tr(label) for label in COLUMNS],
        conflicts=[(say(conflict.subject), conflict) for conflict in summary.conflicts],
        blanks=[blank_row(check) for check in checks if isinstance(check, model.Unjudged)],
        side=_side_picture(robot, drawn, summary),
        table_source=source and (own_title(source.source), word("grade", GRADES, source.grade)),
        convention=word("convention", CONVENTIONS, robot.convention),
        grade_names={grade: word("grade", GRADE_NAMES, grade) for grade in GRADE_NAMES},
    )


def _both_arms(robot: Robot, other: Robot | None) -> Markup:
    """The arm of the table, and the one that documents describe, from the side at one scale."""
    zero = np.zeros(robot.joints)
    seen = [skeleton(each, zero) for each in (robot, other) if each is not None]
    differs = len(seen) == 2 and (seen[0].shape != seen[1].shape or np.abs(seen[0] - seen[1]).max() > SEEN_M)
    arms = [seen_arm(robot, own_title(robot.title), tr("this table"), "wrong" if differs else "right")]
    if other is not None and differs:
        arms.append(seen_arm(other, tr("Documents"), tr("describe this arm"), "right"))
    return side_view(arms, least_wide=UPRIGHT)


def _answer(summary: model.ValidationSummary, instead: str | None, has_entries: bool) -> Answer:
    """How many checks pass, how much of the table is confirmed, and what to do."""
    found, counts = summary.verdict.finding, summary.counts.independent
    evidence = summary.evidence
    status = [each.status for each in evidence.entries if each.value is not None] if evidence else []
    bad, unsure = (
        status.count("contradicted"),
        sum(each not in SETTLED for each in status) - status.count("contradicted"),
    )
    headline, rest = _headline(summary, bad, unsure)
    passed = tr("{passed} of {total}", passed=counts.passed, total=counts.total)
    keys = [(passed, tr("checks pass"))] if counts.total else []
    keys += (
        [(str(bad), tr("entries contradicted"))]
        if bad
        else [(str(unsure), tr("entries unconfirmed"))]
        if status
        else []
    )
    if instead:
        fix = Fix(tr("use the table of {robot}.", robot=instead), "#table-to-use")
    elif isinstance(found, model.LeftOpen) and found.next_measurement:
        fix = Fix(say(found.next_measurement), f"#entry-{found.next_measurement.entry}", instead=False)
    else:
        fix = None
    return Answer(headline, rest, "", keys, (), fix)


def _headline(summary: model.ValidationSummary, bad: int, unsure: int) -> tuple[str, str]:
    """The verdict in two short sentences; ``bad``, ``unsure``: entries contradicted, and not confirmed."""
    status = summary.verdict.status
    if isinstance(summary.verdict.finding, model.DefinedOtherwise):
        return tr("The same arm, defined otherwise."), tr("Correct zeros, directions, base or flange first.")
    if status == "fail":
        another = tr("Another arm's table.") if summary.is_beyond_correction else tr("This table is wrong.")
        return another, tr("Entries contradicted: {count}.", count=bad) if bad else ""
    if summary.conflicts:
        return tr("Sources disagree."), tr("Measure before you rely on it.")
    if status == "no_reference":
        return tr("Nothing to check against."), tr("Find documents or measure.")
    if unsure:
        return tr("Nothing contradicts this table."), tr("Entries unconfirmed: {count}.", count=unsure)
    return tr("This table is right."), tr("Documents confirm every entry.")


def _known(stored: Stored[model.ValidationResults], other: str) -> tuple[str, model.TableEvidence | None]:
    """What nothing settles of the table of another robot of the study, and the evidence of its entries."""
    if stored.folder is None:
        return "", None
    summary = read_stage(stored.folder.parents[1] / other / "validation", STAGES["validation"]).results.summary
    parts = summary.evidence.parts if summary.evidence else ()
    return unconfirmed(parts, getattr(summary.verdict.finding, "unbounded", ())), summary.evidence


def _set_story(found: model.SetSummary, checks: Iterable[Judged], poses: model.KeyPoses) -> dict[str, Any]:
    own = [check for check in checks if isinstance(check, model.ReferenceCheck) and check.reference_set == found.name]
    failed = {check.group for check in own if check.status == "fail"}
    held = {check.group for check in own if check.status == "pass"} - failed
    segments = [(check.subject, check) for check in own if isinstance(check.subject, SegmentInclination)]
    at_zero = (poses.reference_set == found.name) & (poses.group == "zero_pose") & (poses.point == "flange")
    zero = poses.take(np.flatnonzero(at_zero)[:1])
    claims, weighing = found.counts.claims, (found.counts.independent, found.counts.consistency)
    return dict(
        found=found,
        counted=counted_checks(found.counts)
        if found.is_authoritative
        else tr("{passed} of {total} statements hold", passed=claims.passed, total=claims.total),
        is_authoritative=found.is_authoritative,
        conflicting=sum(each.conflicting for each in weighing),
        statements=[validation_figures.typographic(say(each)) for each in (found.described, found.own_text) if each],
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


def _segment(subject: SegmentInclination, check: model.ReferenceCheck) -> str:
    """How a segment of the arm stands, and how it is stated to."""
    template = SEGMENTS[subject.segment]
    return tr(template, measured=fixed(check.measured, 0), expected=fixed(check.expected, 0))


def _telling(own: list[model.ReferenceCheck]) -> list[model.ReferenceCheck]:
    """One failed length per group, the farthest off."""
    worst: dict[str, model.ReferenceCheck] = {}
    for check in own:
        if check.status != "fail" or check.unit != "mm":
            continue
        if check.group not in worst or abs(check.difference) > abs(worst[check.group].difference):
            worst[check.group] = check
    return list(worst.values())


def _point(points_mm: np.ndarray) -> str:
    return ", ".join(fixed(value, 1) for value in points_mm[0]) if len(points_mm) else ""


def _drawn_axes(axes: model.Axes) -> model.Axes:
    """Axes to draw: those from authoritative sources, or else the claims."""
    authoritative = np.isin(axes.grade, AUTHORITATIVE_GRADES)
    return axes.take(authoritative) if authoritative.any() else axes


def _frames_picture(robot: Robot, summary: model.ValidationSummary) -> Picture:
    other = other_robot(robot, summary.evidence)
    code = summary.evidence.other.code if summary.evidence and summary.evidence.other else ""
    label = word(code, OTHER_TITLES, code) if code == "described" else ""
    caption = tr(
        "All joints at 0. Frame 0 is the base, frame k the one that row k of the table leads to, frame 6 the flange."
    )
    if code == "described":
        caption = joined([caption, tr("Dashed: the arm that independent documents describe.")], " ")
    alt = tr("The arm in its zero pose, seen from a corner, with its link frames.")
    return Picture(validation_figures.link_frames(robot, other if label else None, label), alt, caption)


def _side_picture(robot: Robot, drawn: model.Axes, summary: model.ValidationSummary) -> Picture:
    corrected, label = validation_figures.corrected_robot(robot, summary.diagnoses)
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
    return Picture(validation_figures.side_view(robot, drawn, corrected, label), alt, caption)
