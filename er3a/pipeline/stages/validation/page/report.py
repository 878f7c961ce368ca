"""The validation page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from er3a.files.robot_library import robot_of
from er3a.files.robot_writer import robot_file, robot_text
from er3a.finding import Finding, is_one
from er3a.identifiability.entries import column_of
from er3a.kinematics.forward import frames, skeleton
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import N_, own_title, tr, unit_sign, with_unit
from er3a.pipeline.messages.diagnosis import CONVENTIONS
from er3a.pipeline.messages.numbers import fixed, measured
from er3a.pipeline.messages.pages import GRADE_NAMES
from er3a.pipeline.messages.references import entry_word
from er3a.pipeline.messages.say import bracketed, joined, say, word
from er3a.pipeline.messages.validation import GRADES
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.validation import model
from er3a.pipeline.stages.validation.page import diagnosis_section
from er3a.pipeline.stages.validation.page.evidence_section import (
    evidence_section,
    known_alone,
    other_robot,
    plain_table,
    poses_to_read,
    to_settle,
)
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, Fix
from er3a.pipeline.viewing.page import (
    alternative_table,
    render_stage,
    text_address,
)
from er3a.pipeline.viewing.side_view import (
    UPRIGHT,
    DrawnLine,
    Kind,
    Label,
    LabelKind,
    SeenArm,
    beyond,
    dimension,
    entry_lines,
    flanges_off,
    seen_arm,
    side_view,
)
from er3a.references.predict import REACH_STARTS, search
from er3a.references.quantities import AxisDistance
from er3a.references.seen import SeenMotion
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

ANGLES = ("alpha", "beta", "offset")
AROUND = np.radians(np.linspace([-110.0, -220.0], [110.0, 80.0], 31)).T  # of an arrow over an axis, and around one
HEAD = 0.5  # of its radius, the length of its head
TILT = 0.5  # of a circle around an axis in the drawing's plane, seen a little from above
RADIUS = 0.036  # of such an arrow, of the size of the arm
BELOW = 0.15  # of a reach: from one line to the next below the base
LARGER, GLASS = 10, 0.8  # the difference between what documents state, in a glass of this radius, of such a step
ROUND = np.linspace(0.0, 2 * np.pi, 49)
AHEAD = 1.12  # of the way to a jogged arm's end: what is said of it
UP, MARK_MM = [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)], 1000.0  # where a mark on the flange is that is seen to turn
JOG = np.radians(np.linspace(0.0, 30.0, 13))  # of a joint that one looks at
VIEWS = {  # from x, y and z to what is to the right and upwards for one who looks from there
    N_("from behind"): [(0, 0.6), (-1, 0), (0, 0.8)],  # and from a little above
    N_("from the side"): [(1, 0), (0, 0), (0, 1)],
}
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
    evidence = evidence_section(summary.evidence)
    disputed = [each for each in summary.conflicts if is_one(each.subject, "reach") and each.subject.axis == 1]
    q = np.zeros(robot.joints)
    for each in disputed[:1]:
        _, q = search(robot, AxisDistance(**each.subject.params), REACH_STARTS)
    render_stage(
        study,
        stored,
        output,
        _answer(study, name, summary, instead, disputed),
        arms=_both_arms(
            robot,
            study.robot(instead) if instead else other_robot(robot, summary.evidence),
            evidence or {},
            disputed,
            q,
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


def _both_arms(
    robot: Robot, other: Robot | None, evidence: Mapping[str, Any], disputed: Sequence[model.Conflict], q: Reals
) -> Markup:
    """The arm of the table, with its doubtful entries, and the one that documents describe, from the side at one
    scale.

    The lengths that evidence contradicts are named, and angles that it leaves open. Where each entry is seen is
    marked while it is asked for, with what the other arm has instead. Where documents contradict each other about a
    reach, the arm is stretched, and what each states is a dimension from axis 1 on below it, with its source; that of
    the table in its colour."""
    arms = [seen_arm(robot, tr("This table"), tr("stretched out") if disputed else "", q=q)]
    if other is not None:
        arms.insert(0, seen_arm(other, tr("Documents"), tr("describe this arm"), q=q))
    off = flanges_off(arms)
    arms = [arms[0], replace(arms[-1], kind="wrong")] if off else arms[-1:]
    own = arms[-1]
    labels, over = list[Label](), list[DrawnLine]()
    for each in disputed:
        step, kinds = BELOW * each.measured, dict[float, LabelKind]()
        for row, stated in enumerate(each.statements, 1):
            kind: LabelKind = "right" if stated.met else "open"
            kinds[stated.expected] = kind
            text = joined([with_unit(fixed(stated.expected, 1), each.unit), own_title(stated.document)], ": ")
            labels.append(Label(text, np.array([0.0, -step * row]), kind, "seen", written_there=True))
            over += dimension(stated.expected, -step * (row + 0.5), own.points_mm[-1, 1], kind)
        ends = np.array([stated.expected for stated in each.statements])[[0, -1]]
        seen = np.array([ends.mean(), 1.5 * step])
        glass = seen - [3 * step, 0]
        ring = np.column_stack([np.cos(ROUND), np.sin(ROUND)]) * step * GLASS
        over += [
            DrawnLine(at, "dimension") for at in (seen + ring / LARGER, glass + ring, np.array([glass + ring[0], seen]))
        ]
        for end, way in zip(ends, (1, -1)):
            line = glass + [[LARGER * (end - seen[0]), up * step / 2] for up in (way, -way)]
            over.append(DrawnLine(line, "dimension " + kinds[end]))
            labels.append(Label(fixed(end, 1), line[0] + [-step / 4, way * step / 2], kinds[end], written_there=True))
        text = tr("{far}, {times} times larger", far=with_unit(fixed(np.ptp(ends), 1), each.unit), times=LARGER)
        labels.append(Label(text, glass - [step, 1.4 * step], "open", "seen", written_there=True))
    cells = {cell["entry"]: cell for _, row in evidence.get("rows", ()) for cell in row if cell}
    lines, right = entry_lines(robot, cells, q), entry_lines(other, cells, q) if off and other else {}
    radius = RADIUS * float(np.ptp(own.points_mm, axis=0).max())
    for entry, cell in cells.items():
        column, kind, gives = column_of(entry), cell["look"], cell["gives"]
        if column == "direction" and kind == "open":
            if disputed or off:  # what is asked is a length, or another table
                continue
            turn = _turn_arrow(robot, q, entry, lines[entry][0], radius)
            over.append(replace(turn, points=_headed(turn.points[::-1], radius)) if cell["status"] == "open" else turn)
            continue
        angle = column in ANGLES
        if not disputed and cell["status"] == "open" if angle else column in "ad" and kind == "wrong":
            said = with_unit(
                joined([cell["value"], gives], " → " if kind == "wrong" else tr(" or ")), "deg" if angle else "mm"
            )
            text = joined([entry_word(entry), said + "?" * (kind == "open")], ": ")
            labels.append(Label(text, lines[entry].mean(0), kind, entry))
        over.append(DrawnLine(lines[entry], f"mark {own.kind}", entry))
        if angle and kind == "open" and gives:
            over += _readings(robot, q, entry, (cell["value"], gives), radius)
        if entry in right:
            over.append(DrawnLine(right[entry], "mark right", entry, gives or cell["value"]))
    labels += off
    drawn = side_view(arms, ratio=UPRIGHT, labels=labels, column_mm=beyond(arms), over=over)
    return drawn + Markup("").join(jog_seen(robot, each) for each in evidence.get("looks", ()))


def jog_seen(robot: Robot, found: Finding) -> Markup:
    """Where the arm goes when a joint is jogged, and where it would if its direction were the other, seen from where
    the flange is farthest off; where the flange turns in its place, where a mark on it goes.

    Parameters
    ----------
    found : a proposal to look at a motion: joint, pose in deg, and how it is seen to move

    Returns
    -------
    drawing : in HTML
    """
    q, jog = meant(robot, found.pose_deg), np.eye(robot.joints)[found.joint - 1]
    ways = np.array([[1000 * skeleton(robot, q + turn * jog) for turn in way] for way in (JOG, -JOG)])
    manner = SeenMotion(found.pose_deg, found.joint, found.point, found.seen).manner
    if manner != "moves":
        flanges = np.array([[frames(robot, q + turn * jog)[-1, :3, :3] for turn in way] for way in (JOG, -JOG)])
        marks = flanges[0, 0, :, 2:].T if manner == "tilts" else np.array(UP)
        ways_of_marks = np.moveaxis(flanges @ flanges[0, 0].T @ marks.T, 3, 0)
        tips = max(ways_of_marks, key=lambda way: float(np.linalg.norm(way[0, -1] - way[0, 0])))
        ways = np.stack([np.zeros_like(tips), MARK_MM * tips], axis=2)
    side = max(VIEWS, key=lambda each: np.linalg.norm((ways[0, -1, -1] - ways[0, 0, -1]) @ VIEWS[each]))
    own = int(robot.direction[found.joint - 1])
    kinds: dict[Kind, str] = {"right": N_("keep {value}"), "wrong": N_("enter {value}")}
    arms = [
        SeenArm(tr(kinds[kind], value=fixed(value, 0)), "", kind, way[-1], way=way)
        for kind, way, value in zip(kinds, ways @ VIEWS[side], (own, -own))
    ]
    size = 2 * RADIUS * float(np.ptp(arms[0].points_mm, axis=0).max())
    turns = [DrawnLine(_headed(np.array(arm.way)[:, -1], size), f"turn {arm.kind}") for arm in arms]
    labels = [Label(arm.title, AHEAD * arm.points_mm[-1], arm.kind) for arm in arms]
    before = DrawnLine(np.array(arms[0].way)[0], "before")
    drawn = side_view(arms, ratio=1.0, labels=labels, over=[before, *turns])
    title = tr("+J{joint}, {side}", joint=found.joint, side=tr(side))
    look = '<div class="look" data-entry="{}" data-next="{}"><b>{}</b>{}</div>'
    return Markup(look).format(found.entry, say(found), title, drawn)


def _readings(robot: Robot, q: Reals, entry: str, values: Sequence[str], size: float) -> list[DrawnLine]:
    """Where the flange's z points, or its x if a turn about z is asked for, for each of an angle's values."""
    column, found = column_of(entry), list[DrawnLine]()
    axis = "z" if column == "alpha" else "x"
    for value, look in zip(values, ("right", "open")):
        table = getattr(robot, column).copy()
        table[int(entry.removeprefix(column)) - 1] = np.radians(float(value.replace("−", "-")))
        T = frames(robot.replace(**{column: table}), q)[-1, :3:2]
        way = 1000 * T[:, 3] + size * np.outer(np.arange(4), T[:, "xyz".index(axis)])
        text = tr("{axis} if {value}", axis=axis, value=with_unit(value, "deg"))
        found.append(DrawnLine(_headed(way, size), f"mark reading {look}", entry, text))
    return found


def _turn_arrow(robot: Robot, q: Reals, entry: str, at: Reals, radius: float) -> DrawnLine:
    """An arrow about a place (2,), mm, as an axis turns with its joint's value: before an axis in the drawing's
    plane, over one across it; the arm is at joint values (n,), rad or m."""
    joint = int(entry.removeprefix("direction"))
    axis = robot.direction[joint - 1] * frames(robot, q)[joint - 1, :3, 2]
    across = abs(axis[1]) > np.sqrt(0.5)
    first = [0.0, 0.0, 1.0] if across else [0.0, -1.0, 0.0]
    turn = AROUND[0 if across else 1]
    ring = np.outer(np.cos(turn), first) + np.outer(np.sin(turn), np.cross(axis, first))
    seen = ring[:, ::2] + TILT * ring[:, 1:2] * np.abs(axis[::2])
    return DrawnLine(_headed(at + radius * seen, radius), "turn", entry, f"J{joint}")


def _headed(line: Reals, size: float) -> Reals:
    """A line (k, 2) with an arrow's head of a size at its end."""
    tip, back = line[-1], line[-3] - line[-1]
    back *= HEAD * size / np.linalg.norm(back)
    wide = back[::-1] * [-0.7, 0.7]
    found: Reals = np.stack([*line, tip + back + wide, tip, tip + back - wide])
    return found


def _answer(
    study: Study, robot: str, summary: model.ValidationSummary, instead: str | None, disputed: Sequence[model.Conflict]
) -> Answer:
    """How many checks pass, how much of the table is confirmed, and what to do."""
    found, counts = summary.verdict.finding, summary.counts.independent
    evidence = summary.evidence
    bad, unsure = (evidence.contradicted, len(evidence.unconfirmed)) if evidence else (0, 0)
    keys = [(f"{counts.passed}/{counts.total}", tr("independent checks pass"))] if counts.total else []
    if evidence and bad:
        keys.append((f"{bad}/{known_alone(evidence)}", tr("entries contradicted")))
    values = [stated.expected for each in disputed[:1] for stated in each.statements]
    if disputed:
        off = with_unit(fixed(max(values) - min(values), 1), disputed[0].unit)
        keys.insert(0, (tr("{far} of difference", far=off), tr("between documents")))
    fix = None
    if instead:
        fix = Fix(
            tr("use the table of {robot}.", robot=own_title(study.robot(instead).title)),
            f"../{instead}/validation.html",
        )
    elif disputed:
        stated = joined([fixed(value, 1) for value in values], " or ")
        fix = Fix(
            tr("measure the {subject}: {values} mm?", subject=say(disputed[0].subject), values=stated), instead=False
        )
    elif is_one(found, "validation.left_open") and found.next_measurement:
        fix = Fix(to_settle(found.next_measurement), f"#cell-{found.next_measurement.entry}", instead=False)
    elif is_one(found, "validation.no_reference"):
        fix = Fix(tr("read five poses at the pendant: er3a confirm {robot} --plan", robot=robot), instead=False)
    return replace(_headline(summary, bad, unsure), keys=keys, fix=fix)


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
