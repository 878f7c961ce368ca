"""The validation page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from markupsafe import Markup

from er3a.files.robot_library import robot_of
from er3a.files.robot_writer import robot_file, robot_text
from er3a.finding import is_one
from er3a.identifiability.entries import column_of
from er3a.kinematics.forward import frames
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import N_, own_title, tr, with_unit
from er3a.pipeline.messages.diagnosis import CONVENTIONS
from er3a.pipeline.messages.numbers import fixed, measured
from er3a.pipeline.messages.pages import GRADE_NAMES
from er3a.pipeline.messages.say import bracketed, joined, say, word
from er3a.pipeline.messages.validation import GRADES, GROUPS
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.validation import model
from er3a.pipeline.stages.validation.page import diagnosis_section
from er3a.pipeline.stages.validation.page.evidence_section import (
    SETTLED,
    evidence_section,
    other_robot,
    plain_table,
)
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, Fix, Group, ListRow, Part
from er3a.pipeline.viewing.page import (
    alternative_table,
    render_stage,
    status_word,
    text_address,
)
from er3a.pipeline.viewing.side_view import (
    COLUMN,
    UPRIGHT,
    Label,
    LabelKind,
    beyond,
    entry_places,
    flanges_off,
    seen_arm,
    side_view,
)
from er3a.robots.robot import Robot

ANGLES = ("alpha", "beta", "offset")
AROUND = np.radians(np.linspace(-125.0, 125.0, 31))  # of an arrow around an axis: open at the back
SEEN_FROM_SIDE = 0.64  # of that: the half before an axis in the drawing's plane
HEAD = 0.5  # of its radius, the length of its head
TILT = 0.35  # of a circle around an axis in the drawing's plane, seen a little from above
RADIUS = 0.045  # of such an arrow, of the size of the arm
BELOW = 0.07  # of a reach: how far below the base its dimension is drawn
SEEN = "seen"  # address in the picture of what is to be done next
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


def group_rows(checks: Iterable[Judged]) -> list[list[Any]]:
    """A row for each set and group."""
    rows, sets = [], dict[str, list[Judged]]()
    for check in checks:
        sets.setdefault(check.reference_set or tr("the model itself"), []).append(check)
    for title, own in sets.items():
        for group in dict.fromkeys(check.group for check in own):
            part = [check for check in own if check.group == group]
            counted = Counter(check.status for check in part)
            status = "fail" if counted["fail"] else "conflict" if counted["conflict"] else "pass"
            worst = max(part, key=lambda check: check.tolerances_off)
            off = with_unit(_value(worst.difference, worst), worst.unit)
            counts = counted["pass"], counted["fail"], counted["conflict"]
            rows.append([title, word("group", GROUPS, group), status_word(status), *counts, say(worst.subject), off])
    return rows


KINDS = {
    "independent": N_("independent documents"),
    "consistency": N_("documents it is made from"),
    "claim": N_("claims of a source"),
    None: N_("the model itself"),
}
"""What a check rests on, as the page names it."""


def check_row(check: Judged) -> list[str]:
    """A check in the columns of ``COLUMNS``."""
    values = [_value(value, check) for value in (check.measured, check.expected, check.difference)]
    if check.source is not None and check.grade is not None:
        grade = word("grade", GRADE_NAMES, check.grade)
        source = bracketed(own_title(check.source), grade)
    else:
        source = tr("the model itself")
    return [say(check.subject), *values, f"{check.tolerance:g}", tr(check.unit), source]


def _value(value: float, check: model.Check) -> str:
    """A value in its unit's decimals; errors of round trips, which are far smaller, by what they are below."""
    if check.group == "round_trips" and 0 < abs(value) < 1e-3:
        return measured(value, None, check.unit)
    return fixed(value, DECIMALS[check.unit])


def _by_kind(checks: Sequence[Judged]) -> Group:
    """How many checks of each kind pass, each with its bar."""
    rows = []
    for kind, title in KINDS.items():
        own = [check.status for check in checks if check.kind == kind]
        passed, total = own.count("pass"), len(own)
        mark: Literal["pass", "fail", "caution"] = "pass" if passed == total else "fail" if "fail" in own else "caution"
        parts = [Part(passed / total, 1.0, mark)] if passed < total else ()
        if own:
            rows.append(ListRow(mark, tr(title), f"{passed}/{total}", "#checks", None, 1.0, parts))
    return Group(tr("Checks"), rows)


def report(study: Study, stored: Stored[model.ValidationResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, summary = stored.robot, stored.results.summary
    robot, checks = model.model_of(study, name), summary.checks
    judged = [check for check in checks if not isinstance(check, model.Unjudged)]
    failed = sorted((each for each in judged if each.status == "fail"), key=lambda each: -each.tolerances_off)
    source = robot.sources.get("dh")
    corrected, _ = diagnosis_section.corrected_robot(robot_of(study.table(name)).replace(name=name), summary.diagnoses)
    file = robot_file(corrected) if corrected and not summary.is_beyond_correction else None
    text = robot_text(file) if file else ""
    instead = (
        alternative_table(study, name, stored.folder.parents[1])
        if summary.verdict.status == "fail" and stored.folder
        else None
    )
    evidence, disputed = evidence_section(robot, summary.evidence), _disputed(robot, summary.conflicts)
    render_stage(
        study,
        stored,
        output,
        _answer(study, name, summary, instead, disputed),
        arms=_both_arms(
            robot, study.robot(instead) if instead else other_robot(robot, summary.evidence), evidence or {}, disputed
        ),
        at_side=True,
        plain_table=None if evidence else plain_table(robot),
        robot=robot,
        table_evidence=evidence,
        diagnoses=diagnosis_section.diagnosis_stories(summary),
        corrected=text,
        corrected_address=text_address(text),
        groups=group_rows(judged),
        by_kind=[_by_kind(judged)],
        failed=[*map(check_row, failed)],
        columns=COLUMNS,
        conflicts=[(say(conflict.subject), conflict) for conflict in summary.conflicts],
        table_source=source and (own_title(source.source), word("grade", GRADES, source.grade)),
        convention=word("convention", CONVENTIONS, robot.convention),
    )


def _both_arms(robot: Robot, other: Robot | None, evidence: Mapping[str, Any], disputed: Sequence[Label]) -> Markup:
    """The arm of the table, with its doubtful entries, and the one that documents describe, from the side at one
    scale."""
    arms = [seen_arm(robot, own_title(robot.title), tr("this table"), "right")]
    if other is not None:
        arms.insert(0, seen_arm(other, tr("Documents"), tr("describe this arm"), "right"))
    off = flanges_off(arms)
    arms = [arms[0], replace(arms[-1], kind="wrong")] if off else arms[-1:]
    labels = [*_entries_seen(robot, evidence), *off, *disputed]
    column = max([beyond(arms), *((1 + COLUMN) * label.at[0] for label in disputed)])
    places, over = entry_places(robot), []
    radius = RADIUS * float(np.ptp(arms[-1].points_mm, axis=0).max())
    for joint, cells in evidence.get("rows", ()):
        if any(cell and column_of(cell["entry"]) == "direction" and _kind(cell["status"]) == "open" for cell in cells):
            over.append(_turn_arrow(robot, joint, places[f"d{joint}"], radius))
    for label in disputed:
        over += _dimension(label, float(places["1"][1]))
    return side_view(arms, ratio=UPRIGHT, labels=labels, column_mm=column, over=over)


def _turn_arrow(robot: Robot, joint: int, at: Reals, radius: float) -> tuple[str, Reals]:
    """An arrow about a place (2,), mm, as an axis turns with its joint's value: before an axis in the drawing's
    plane, over one across it."""
    axis = robot.direction[joint - 1] * frames(robot, np.zeros(robot.joints))[joint - 1, :3, 2]
    across = abs(axis[1]) > np.sqrt(0.5)
    first, around = ([0.0, 0.0, 1.0], AROUND) if across else ([0.0, -1.0, 0.0], SEEN_FROM_SIDE * AROUND)
    ring = np.outer(np.cos(around), first) + np.outer(np.sin(around), np.cross(axis, first))
    seen = ring[:, ::2] + TILT * ring[:, 1:2] * np.abs(axis[::2])
    tip, back = seen[-1], seen[-3] - seen[-1]
    back *= HEAD / np.linalg.norm(back)
    wide = back[::-1] * [-0.7, 0.7]
    return f"turn J{joint}", at + radius * np.stack([*seen, tip + back + wide, tip, tip + back - wide])


def _dimension(label: Label, height: float) -> list[tuple[str, Reals]]:
    """A dimension below the base, from axis 1 to where the flange is farthest from it, at the ``height`` (mm) of axis
    2: its line with a tick at both ends, and what is measured above it."""
    far, low = label.at
    tick = BELOW * far / 3
    ends = [(x, low + side * tick) for x, sides in ((0.0, (-1, 1, 0)), (far, (0, 1, -1))) for side in sides]
    return [("dimension", np.array(ends)), ("dimension far", np.array([(far, low), (far, height)]))]


def _disputed(robot: Robot, conflicts: Iterable[model.Conflict]) -> list[Label]:
    """What documents contradict each other about: a reach, from axis 1, at the end of its dimension."""
    return [
        Label(
            with_unit(tr(" or ").join(fixed(found.expected, 1) for found in each.statements), each.unit),
            np.array([each.measured, -BELOW * each.measured]),
            "open",
            SEEN,
        )
        for each in conflicts
        if is_one(each.subject, "reach") and each.subject.axis == 1
    ]


def _entries_seen(robot: Robot, evidence: Mapping[str, Any]) -> list[Label]:
    """The lengths of the table, and the angles that evidence leaves open, each at the link or joint that it is of."""
    places, found = entry_places(robot), []
    for joint, cells in evidence.get("rows", ()):
        for cell in filter(None, cells):
            entry, given = cell["entry"], cell["gives"] or cell["value"] != "0"
            if given if column_of(entry) in ("a", "d") else cell["status"] == "open" and column_of(entry) in ANGLES:
                kind, gives = _kind(cell["status"]), cell["gives"]
                text = joined([f"{entry} = {cell['value']}", gives], " → " if kind == "wrong" else " / ")
                found.append(Label(text, places.get(entry, places[str(joint)]), kind))
    return found


def _kind(status: str) -> LabelKind:
    return "wrong" if status == "contradicted" else "sound" if status in SETTLED else "open"


def _answer(
    study: Study, robot: str, summary: model.ValidationSummary, instead: str | None, disputed: Sequence[Label]
) -> Answer:
    """How many checks pass, how much of the table is confirmed, and what to do."""
    found, counts = summary.verdict.finding, summary.counts.independent
    evidence = summary.evidence
    bad, unsure = (evidence.contradicted, len(evidence.unconfirmed)) if evidence else (0, 0)
    headline, rest = _headline(summary, bad, unsure)
    keys = [(f"{counts.passed}/{counts.total}", tr("independent checks pass"))] if counts.total else []
    if bad:
        keys.append((str(bad), tr("entries contradicted")))
    elif evidence:
        keys.append((str(unsure), tr("entries unconfirmed")))
    if instead:
        fix = Fix(
            tr("use the table of {robot}.", robot=own_title(study.robot(instead).title)),
            f"../{instead}/validation.html",
        )
    elif disputed:
        fix = Fix(joined([tr("measure the reach from axis 1"), disputed[0].text], tr(": ")), f"#{SEEN}", instead=False)
    elif is_one(found, "validation.left_open") and found.next_measurement:
        fix = Fix(say(found.next_measurement), f"#cell-{found.next_measurement.entry}", instead=False)
    elif is_one(found, "validation.no_reference"):
        fix = Fix(tr("read five poses at the pendant: er3a confirm {robot} --plan", robot=robot), instead=False)
    else:
        fix = None
    return Answer(headline, rest, "", keys, (), fix)


def _headline(summary: model.ValidationSummary, bad: int, unsure: int) -> tuple[str, str]:
    """The verdict in two short sentences; ``bad``, ``unsure``: entries contradicted, and not confirmed."""
    status = summary.verdict.status
    if is_one(summary.verdict.finding, "validation.defined_otherwise"):
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
