"""The validation page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from er3a.files.robot_library import robot_of
from er3a.files.robot_writer import robot_file, robot_text
from er3a.finding import is_one
from er3a.identifiability.entries import column_of
from er3a.identifiability.proposals import look_at
from er3a.kinematics.forward import frames
from er3a.pipeline.language import N_, own_title, tr, unit_sign, with_unit
from er3a.pipeline.messages.diagnosis import CONVENTIONS
from er3a.pipeline.messages.numbers import fixed, measured
from er3a.pipeline.messages.pages import GRADE_NAMES
from er3a.pipeline.messages.references import entry_word
from er3a.pipeline.messages.say import bracketed, joined, say, word
from er3a.pipeline.messages.validation import GRADES
from er3a.pipeline.player.motions import PlayedMotion
from er3a.pipeline.player.player import drawing_head, player
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.validation import model
from er3a.pipeline.stages.validation.page import diagnosis_section
from er3a.pipeline.stages.validation.page.entries_played import LENGTHS, entries_played, jog_rows, reach_played
from er3a.pipeline.stages.validation.page.evidence_section import (
    cells_of,
    evidence_section,
    known_alone,
    other_robot,
    plain_table,
    poses_to_read,
    to_confirm,
    to_settle,
)
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, Fix, ListRow
from er3a.pipeline.viewing.page import (
    alternative_table,
    render_stage,
    text_address,
)
from er3a.pipeline.viewing.side_view import (
    UPRIGHT,
    DrawnLine,
    Label,
    beyond,
    entry_lines,
    flanges_off,
    seen_arm,
    side_view,
)
from er3a.references.predict import REACH_STARTS, search
from er3a.references.quantities import AxisDistance
from er3a.robots.robot import Robot

LONGER_M, MATTERS = 1e-3, 0.1  # what a length is changed by, and the part of it by which a reach changes that it is in
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

Judged = model.Judged


def check_row(check: Judged) -> list[str]:
    """A check in the columns of ``COLUMNS``."""
    values = [_value(value, check) for value in (check.measured, check.expected, check.difference)]
    source = tr("the model itself")
    if check.source and check.grade:
        source = bracketed(own_title(check.source), word("grade", GRADE_NAMES, check.grade))
    return [say(check.subject), *values, f"{check.tolerance:g}", unit_sign(check.unit), source]


def _value(value: float, check: model.Check) -> str:
    """A value in its unit's decimals; errors of round trips, which are far smaller, by what they are below."""
    if check.group == "round_trips" and 0 < abs(value) < 1e-3:
        return measured(value, None, check.unit)
    return fixed(value, DECIMALS[check.unit])


def report(study: Study, stored: Stored[model.ValidationResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, summary = stored.robot, stored.results.summary
    robot = model.model_of(study, name)
    judged = [check for check in summary.checks if not isinstance(check, model.Unjudged)]
    failed = sorted((each for each in judged if each.status == "fail"), key=lambda each: -each.tolerances_off)
    source = robot.sources.get("dh")
    table = robot_of(study.table(name)).replace(name=name)
    corrected, _ = diagnosis_section.corrected_robot(table, summary.diagnoses)
    text = robot_text(robot_file(corrected)) if corrected and not summary.is_beyond_correction else ""
    instead = alternative_table(study, stored.robot, stored.folder) if summary.verdict.status == "fail" else None
    disputed = [each for each in summary.conflicts if is_one(each.subject, "reach") and each.subject.axis == 1]
    other = study.robot(instead) if instead else other_robot(robot, summary.evidence)
    asked = [_Asked(robot, each) for each in disputed[:1]]
    evidence = evidence_section(summary.evidence, [name for each in asked for name in each.lengths])
    to_jog = [look for joint in range(1, robot.joints + 1) if (look := look_at(robot, joint))] if not evidence else []
    known = evidence or {"looks": to_jog, "first": to_confirm(None)}
    pictured = _pictured(robot, other, known, asked)
    render_stage(
        study,
        stored,
        output,
        _answer(study, name, summary, instead, disputed),
        **pictured,
        steps=_steps(
            summary.evidence.contradicted if summary.evidence else 0,
            known["first"],
            pictured["jogs"],
            pictured["asked"],
        ),
        at_side=True,
        plain_table=None if evidence else plain_table(robot),
        robot=robot,
        table_evidence=evidence,
        diagnoses=diagnosis_section.diagnosis_stories(summary),
        corrected=text,
        corrected_address=text_address(text),
        poses=poses_to_read(table) if summary.verdict.status != "fail" else ([], []),
        failed=[*map(check_row, failed)],
        columns=COLUMNS,
        conflicts=[(say(conflict.subject), conflict) for conflict in summary.conflicts],
        table_source=source and (own_title(source.source), word("grade", GRADES, source.grade)),
        convention=word("convention", CONVENTIONS, robot.convention),
    )


def _pictured(
    robot: Robot, other: Robot | None, evidence: Mapping[str, Any], asked: Sequence[_Asked]
) -> dict[str, Any]:
    """What the page shows at its left: the arm, which goes where an entry is asked for; or else from the side, at one
    scale, what is wrong of it.

    Of a table that is contradicted the arm is drawn over the one that documents describe, and lengths that are wrong
    are named; where each entry is seen is marked while it is asked for, with what the other arm has instead. Where
    documents contradict each other about a reach, the arm is stretched at first, over what each states."""
    cells, looks = cells_of(evidence), evidence.get("looks", ())
    arms = [seen_arm(robot, tr("This table"), "")]
    if other is not None:
        arms.insert(0, seen_arm(other, tr("Documents"), tr("describe this arm")))
    off = flanges_off(arms)
    if not off:
        motions = [*(each.motion for each in asked), *entries_played(robot, cells, looks)]
        picture = player(robot, motions, opened=(motions[0].name, float(motions[0].t[-1])))
        return {"picture": picture, "drawing_head": drawing_head(), "asked": asked, "jogs": jog_rows(robot, looks)}
    arms = [arms[0], replace(arms[-1], kind="wrong")]
    own = arms[-1]
    labels, over, q = list[Label](), list[DrawnLine](), np.zeros(robot.joints)
    lines, right = entry_lines(robot, cells, q), entry_lines(other, cells, q) if other else {}
    for entry, cell in cells.items():
        column, kind, gives = column_of(entry), cell["look"], cell["gives"]
        if column in "ad" and kind == "wrong":
            said = with_unit(joined([cell["value"], gives], " → "), "mm")
            labels.append(Label(joined([entry_word(entry), said], ": "), lines[entry].mean(0), kind, entry))
        over.append(DrawnLine(lines[entry], f"mark {own.kind}", entry))
        if entry in right:
            over.append(DrawnLine(right[entry], "mark right", entry, gives or cell["value"]))
    labels += off
    drawn = side_view(arms, ratio=UPRIGHT, labels=labels, column_mm=beyond(arms), over=over)
    return {"picture": drawn, "drawing_head": "", "asked": [], "jogs": []}


class _Asked:
    """A reach about which documents disagree, at the joint values (n,) where the table reaches farthest."""

    def __init__(self, robot: Robot, conflict: model.Conflict) -> None:
        self.robot, self.conflict = robot, conflict
        self.reach = AxisDistance(**conflict.subject.params)
        _, self.q = search(robot, self.reach, REACH_STARTS)

    @property
    def motion(self) -> PlayedMotion:
        return reach_played(self.robot, self.reach, self.q, self.conflict)

    @property
    def rows(self) -> list[ListRow]:
        """What each document states, as rows of the page's list."""
        at, fix, unit = (self.robot.name, 1.0), _to_measure(self.conflict), self.conflict.unit
        stated = [(own_title(each.document), fixed(each.expected, 1)) for each in self.conflict.statements]
        return [ListRow("conflict", name, with_unit(value, unit), "", at, fix=fix) for name, value in stated]

    @property
    def lengths(self) -> list[str]:
        """The lengths of the table that the reach is made of."""
        found, before = [], self.reach.measure(frames(self.robot, self.q))
        for column in LENGTHS:
            for row in range(self.robot.rows):
                longer = getattr(self.robot, column).copy()
                longer[row] += LONGER_M
                after = self.reach.measure(frames(self.robot.replace(**{column: longer}), self.q))
                if abs(after - before) > MATTERS * LONGER_M:
                    found.append(f"{column}{row + 1}")
        return found


def _steps(
    contradicted: int, first: Sequence[ListRow], jogs: Sequence[ListRow], asked: Sequence[_Asked]
) -> list[dict[str, Any]]:
    """The list at the table's side: the worst entries; or what to measure, as sources disagree, and what to confirm, of
    the first step each joint, where the picture shows them."""
    if not first:
        return []
    if contradicted:
        title = tr("The {shown} worst of {all} wrong entries", shown=len(first), all=contradicted)
        return [{"title": title, "beside": tr("at worst, tool off by"), "rows": first}]
    before = [{"title": say(each.conflict.subject).capitalize(), "rows": each.rows} for each in asked]
    if not jogs:
        return [*before, {"title": tr("Confirm in this order"), "beside": tr("if wrong, tool off by"), "rows": first}]
    off = first[0].note
    title = tr("❶ Jog each joint (if wrong, off by {off})", off=off) if off else tr("❶ Jog each joint")
    then = [replace(row, fix=Fix(row.name, row.address, instead=False)) for row in first[1:]]
    return [
        *before,
        {"title": title, "beside": tr("if not, enter"), "rows": jogs},
        {"title": "", "rows": then},
    ]


def _answer(
    study: Study, robot: str, summary: model.ValidationSummary, instead: str | None, disputed: Sequence[model.Conflict]
) -> Answer:
    """How many checks pass, how much of the table is confirmed, and what to do."""
    found, counts = summary.verdict.finding, summary.counts.independent
    evidence = summary.evidence
    bad, unsure = (evidence.contradicted, len(evidence.unconfirmed)) if evidence else (0, 0)
    said = tr("checks pass, other values would too") if disputed else tr("independent checks pass")
    keys = [(f"{counts.passed}/{counts.total}", said)] if counts.total else []
    if evidence and bad:
        keys = [(f"{counts.total - counts.passed}/{counts.total}", tr("checks fail"))]
        keys.append((f"{bad}/{known_alone(evidence)}", tr("entries contradicted")))
    if disputed:
        values = [stated.expected for stated in disputed[0].statements]
        off = with_unit(fixed(max(values) - min(values), 1), disputed[0].unit)
        keys.insert(0, (tr("{far} of difference", far=off), tr("between documents")))
    fix = None
    if instead:
        fix = Fix(
            tr("use the table of {robot}.", robot=own_title(study.robot(instead).title)),
            f"../{instead}/validation.html",
        )
    elif disputed:
        fix = _to_measure(disputed[0])
    elif is_one(found, "validation.left_open") and found.next_measurement:
        fix = Fix(to_settle(found.next_measurement), f"#cell-{found.next_measurement.entry}", instead=False)
    elif is_one(found, "validation.no_reference"):
        fix = Fix(tr("read five poses at the pendant: er3a confirm {robot} --plan", robot=robot), instead=False)
    return replace(_headline(summary, bad, unsure), keys=keys, fix=fix)


def _to_measure(conflict: model.Conflict) -> Fix:
    stated = joined([fixed(each.expected, 1) for each in conflict.statements], tr(" or "))
    return Fix(tr("measure the arm: {values}?", values=with_unit(stated, conflict.unit)), instead=False)


def _headline(summary: model.ValidationSummary, bad: int, unsure: int) -> Answer:
    """The verdict in two short sentences; ``bad``, ``unsure``: entries contradicted, and not confirmed."""
    status = summary.verdict.status
    if is_one(summary.verdict.finding, "validation.defined_otherwise"):
        return Answer(tr("The same arm, defined otherwise."), tr("Correct zeros, directions, base or flange first."))
    if status == "fail":
        another = tr("Another arm's table.") if summary.is_beyond_correction else tr("This table is wrong.")
        return Answer(another, tr("Documents contradict {count} entries.", count=bad) if bad else "")
    if summary.conflicts:
        return Answer(tr("Sources disagree."), tr("Measure before you rely on it."))
    if status == "no_reference":
        return Answer(tr("Nothing to check against."), tr("Find documents or measure."))
    if unsure and summary.evidence:
        geometry = (part for part in summary.evidence.parts if part.part == "geometry")  # as the index decides
        known = [part.settled or part.up_to_signs for part in geometry]
        first = tr("Good for planning.") if any(known) else tr("Not settled.")
        return Answer(first, tr("Confirm {count} entries before the arm moves.", count=unsure), good=any(known))
    return Answer(tr("This D-H table is right."), tr("Documents settle every entry."))
