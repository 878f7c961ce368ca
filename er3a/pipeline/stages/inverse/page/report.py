"""The page of the inverse stage."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from er3a.finding import is_one
from er3a.kinematics.forward import skeleton
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import tr, with_unit
from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.inverse import (
    FREE_AT,
    NEAREST_RULE,
    limits_in_short,
)
from er3a.pipeline.messages.kinematics import RULE_TITLES, branch_word, singularity_word
from er3a.pipeline.messages.numbers import fixed, number
from er3a.pipeline.messages.say import joined, listed, say, word
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.inverse import model
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, Group, ListRow, all_caught
from er3a.pipeline.viewing.page import panel_link, render_stage
from er3a.pipeline.viewing.palette import shape_of
from er3a.pipeline.viewing.side_view import UPRIGHT, Kind, SeenArm, side_view
from er3a.robots.joint_limits import meant, shown
from er3a.robots.robot import Robot
from er3a.selection.select import RULES


def solutions_seen(robot: Robot, target: model.TargetResult, branches: model.SolutionRows) -> Markup:
    """All arm shapes that solve a target, from the side, along its direction; the one taken over the others.

    Parameters
    ----------
    branches : the best row of each branch
    """
    from_world = np.linalg.inv(robot.base)

    def seen(points_m: Reals) -> Reals:
        points: Reals = (points_m @ from_world[:3, :3].T + from_world[:3, 3]) * 1000
        return np.stack([points[..., :2] @ level, points[..., 2]], axis=-1)

    def arm(q: Reals, title: str, note: str, kind: Kind) -> SeenArm:
        return SeenArm(title, note, kind, seen(skeleton(robot, meant(robot, q))))

    level = np.array([1.0, 0.0])
    goal = from_world[:2] @ [*np.array(target.xyz_mm) / 1000, 1.0]
    level = goal / np.hypot(*goal) if np.hypot(*goal) > AT_AXIS else level
    arms = []
    shapes = np.array([shape_of(int(branch), label) for branch, label in zip(branches.branch, branches.label)])
    for rows in (branches.take(shapes == shape) for shape in np.unique(shapes)):
        refused, taken = not (rows.rank > 0).any(), (rows.rank == 1).any()
        kind: Kind = "right" if taken else "wrong" if refused else "other"
        note = tr("chosen") if taken else tr("refused") if refused else ""
        arms.append(arm(rows.q_deg[0], _shape_word(rows.label[0], int(rows.branch[0])), note, kind))
    if not arms:
        arms = [arm(np.array(target.q_ref_deg), tr("arm at the reference"), "", "other")]
    arms.sort(key=lambda each: ("wrong", "other", "right").index(each.kind))
    places = [(tr("target"), target.xyz_mm)]
    if target.neighbours and target.neighbours.shifted_to_mm:
        places.append((tr("nearest position with a solution"), target.neighbours.shifted_to_mm))
    named = [(f"◂ {word}", seen(np.array(place) / 1000)) for word, place in places]
    return side_view([*arms[:-1], replace(arms[-1], holes=named)], least_wide=UPRIGHT)


def _shape_word(label: str, branch: int) -> str:
    """An arm shape: a branch whatever its wrist."""
    return branch_word(label.removesuffix("_flip").removesuffix("_no"), branch)


NO_BREAK_SPACE = "\u00a0"
SAME = 1e-6  # deg or mm
AT_AXIS = 1e-3  # m, nearer to axis 1 a target has no direction


MAX_SELF_MOTIONS = 6


def report(study: Study, stored: Stored[model.InverseResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, results, summary = stored.robot, stored.results, stored.results.summary
    robot, trips, chosen = study.robot(name), summary.round_trips, model.shown_targets(summary.targets)
    names = results.solutions.target

    def of_target(target: model.TargetResult) -> model.SolutionRows:
        return results.solutions.take(names == target.name)

    contradicted = stored.rests_on.get("validation") == "fail"
    render_stage(
        study,
        stored,
        output,
        _answer(summary, chosen),
        nearest_rule=tr(NEAREST_RULE),
        overview=[overview_row(robot, target, of_target(target)) for target in chosen],
        sections=[_section(robot, target, of_target(target), contradicted) for target in chosen],
        outcomes=_outcomes(summary.targets),
        not_advised=_not_advised(summary.targets),
        units=_units(robot),
        slides=bool(robot.slides.any()),
        chosen_heading=tr("Chosen branch, and its J1 to J{count} ({units})", count=robot.joints, units=_units(robot)),
        optimised_heading=tr("J1 to J{count}, optimised ({units})", count=robot.joints, units=_units(robot)),
        trips=trips,
        stops=_stops(summary.sequence, {target.name for target in chosen}),
        move=_move_rule(robot, summary.sequence),
    )


def _answer(summary: model.InverseSummary, shown: Sequence[model.TargetResult]) -> Answer:
    """How many targets the arm can take, and of each what came of it."""
    met = [each for each in summary.targets if each.outcome == "reached"]
    caught = [each for each in summary.targets if each.outcome != "reached" and each.outcome == each.expect]
    due = len(summary.targets) - len(caught)
    headline = tr("{count} of {due} poses reached.", count=len(met), due=due)
    clear = [each.clearance.least_mm for each in met if each.clearance]
    keys = [(with_unit(fixed(min(clear), 1), "mm"), tr("least clearance"))] if clear else []
    if summary.round_trips:
        keys.append((number(summary.round_trips.solutions), tr("solutions confirmed by forward kinematics")))
    failed = Group(tr("No solution to take"), [_row(each) for each in shown if each.outcome != "reached"])
    return Answer(
        headline,
        all_caught(len(caught)),
        "",
        keys,
        (failed, Group(tr("Reached"), [_row(each) for each in shown if each in met])),
    )


def _row(target: model.TargetResult) -> ListRow:
    """A target: how many branches serve it, or what it came to."""
    note = (
        tr("{within} of {all} solutions within limits", within=target.within_limits, all=target.solutions)
        if target.outcome == "reached"
        else outcome_word(target.outcome)
    )
    return ListRow("pass" if target.outcome == "reached" else "fail", target.name, note, f"#{target.name}")


def _section(
    robot: Robot,
    target: model.TargetResult,
    rows: model.SolutionRows,
    contradicted: bool,
) -> dict[str, Any]:
    branches = best_of_branches(rows)
    own = [tr("Evidence contradicts this table: move nothing because of what it says here.")] if target.advice else []
    return dict(
        target=target,
        picture=solutions_seen(robot, target, branches),
        position=_listed(target.xyz_mm),
        orientation=_listed(target.rpy_deg),
        reference=_joints(target.q_ref_deg),
        reason=say(target.reason),
        advice=own if contradicted else listed(target.advice),
        joints=[f"J{k + 1} ({'mm' if slides else '°'})>" for k, slides in enumerate(robot.slides)],
        method="" if is_one(target.method, "closed_form") else say(target.method),
        families=_self_motions(robot, target.families),
        unsolved=joined(listed(target.unsolved)),
        rows=_branch_rows(rows, branches),
        residual_mm=rows.position_residual_mm.max() if len(rows) else None,
        residual_deg=rows.orientation_residual_deg.max() if len(rows) else None,
    )


def best_of_branches(rows: model.SolutionRows) -> model.SolutionRows:
    """The best row of each branch of a target, by number of the branch."""
    best = rows.take(rows.first_of_branch)
    return best.take(np.argsort(best.branch, kind="stable"))


def _self_motions(robot: Robot, families: tuple[model.SelfMotion, ...]) -> list[str]:
    """The nearest self-motions, and how many more there are."""
    texts = [_self_motion(robot, family) for family in families[:MAX_SELF_MOTIONS]]
    if len(families) > MAX_SELF_MOTIONS:
        texts.append(tr("{count} more in summary.json", count=len(families) - MAX_SELF_MOTIONS))
    return texts


def _self_motion(robot: Robot, family: model.SelfMotion) -> str:
    low, high = (fixed(end, 1) for end in family.range_deg)
    return tr(
        "{where}: the arm can move about ({joints}) {units} with the tool at rest, {room}",
        where=word("self_motion", FREE_AT, family.kind),
        joints=_listed(family.q0_deg),
        units=_units(robot),
        room=tr("for {low} to {high} deg", low=low, high=high)
        if family.within_limits
        else tr("but every member leaves the limits"),
    )


def _move_rule(robot: Robot, sequence: model.VisitOrder | None) -> tuple[str, str]:
    """Unit and title of the rule that moves in the sequence are ranked by."""
    if sequence is None:
        return "", ""
    return tr(RULES[sequence.rule].unit_of(robot)), word("rule.title", RULE_TITLES, sequence.rule)


def _outcomes(targets: Iterable[model.TargetResult]) -> str:
    """How many targets came to what."""
    counts = Counter(target.outcome for target in targets)
    return tr(", ").join(f"{outcome_word(outcome)} {number(count)}" for outcome, count in counts.most_common())


def _not_advised(targets: Iterable[model.TargetResult]) -> int:
    """How many targets without solution were not looked at for what would help, where others were."""
    without = [target.neighbours for target in targets if target.obstacle]
    return without.count(None) if any(without) else 0


def _stops(sequence: model.VisitOrder | None, named: set[str]) -> list[list[str]]:
    return [
        [
            stop.target,
            _short(stop.label, stop.branch),
            _short(stop.greedy_label, stop.greedy_branch),
            _joints(stop.q_deg),
        ]
        for stop in (sequence.stops if sequence else ())
        if stop.target in named
    ]


def overview_row(robot: Robot, target: model.TargetResult, rows: model.SolutionRows) -> list[str]:
    """The cells of a target with its ``rows``: name, place, branches, what is chosen, and its clearance."""
    near = target.clearance
    return [
        Markup('<a href="#{0}">{0}</a>').format(target.name),
        _listed(target.xyz_mm),
        tr("{within} of {all}", within=target.within_limits, all=target.solutions),
        tr("none") if target.chosen_deg is None else _chosen(robot, target, rows),
        tr("{far} mm: {pair}", far=fixed(near.least_mm, 1), pair=say(near.between)) if near else "–",
    ]


def _chosen(robot: Robot, target: model.TargetResult, rows: model.SolutionRows) -> str:
    """The solution taken of a target's rows: its branch and joints; at a singularity that it is, and the best solution
    that is at none."""
    chosen = rows.take(rows.rank == 1)
    name = branch_word(chosen.label[0], int(chosen.branch[0]))
    cell = Markup("{0}<br>{1}").format(name, Markup(_joints(target.chosen_deg or ())))
    if not (kinds := _singular(chosen, 0)):
        return cell
    other = rows.take((rows.rank > 0) & rows.first_of_branch & ~rows.singular.any(axis=1))
    said = tr("▲ {kinds} singularity: joint moves only", kinds=kinds)
    if len(other):
        k = int(np.argmin(other.rank))
        moved = np.abs(other.q_deg[k] - np.array(target.q_ref_deg))
        room = np.minimum(other.q_deg[k] - shown(robot, robot.lower), shown(robot, robot.upper) - other.q_deg[k])
        said = tr(
            "{singular}; not singular: {branch} ({move} move, {margin} from a limit)",
            singular=said,
            branch=branch_word(other.label[k], int(other.branch[k])),
            move=of_a_joint(robot, moved, float(other.greatest_move_deg[k]), 0),
            margin=of_a_joint(robot, room, float(other.limit_margin_deg[k]), 1),
        )
    return cell + Markup("<br><strong>{0}</strong>").format(said)


def of_a_joint(robot: Robot, of_joints: np.ndarray, value: float, digits: int) -> str:
    """The value of one joint, in its unit, among those ``of_joints`` (n,), deg or mm; deg, if it is that of a sum."""
    apart = np.abs(of_joints - value)
    slides = apart.min() < SAME and robot.slides[int(apart.argmin())]
    return with_unit(fixed(value, digits), "mm" if slides else "deg")


def _singular(rows: model.SolutionRows, k: int) -> str:
    """At which singularities a solution is; empty for none."""
    kinds = [kind for kind, on in zip(model.SINGULAR_PARTS, rows.singular[k]) if on]
    return tr(", ").join(map(singularity_word, kinds))


def _branch_rows(rows: model.SolutionRows, branches: model.SolutionRows) -> list[list[str]]:
    inside = rows.branch[rows.within_limits]
    ranks = branches.rank[branches.rank > 0]
    cells = []
    for k in range(len(branches)):
        place, turns = int((ranks <= branches.rank[k]).sum()), int((inside == branches.branch[k]).sum())
        cells.append(
            [
                panel_link(branches.q_deg[k], _on_one_line(branches.label[k], int(branches.branch[k]))),
                *(fixed(angle, 1) for angle in branches.q_deg[k]),
                fixed(branches.limit_margin_deg[k], 1),
                fixed(branches.manipulability[k], 3),
                fixed(branches.greatest_move_deg[k], 1),
                _outcome(branches, k, place, turns),
            ]
        )
    return cells


def _outcome(branches: model.SolutionRows, k: int, place: int, turns: int) -> str:
    refusal = branches.refusal[k]
    if refusal is not None:
        return limits_in_short(refusal) if is_one(refusal, "limits_exceeded") else say(refusal)
    taken = tr("chosen") if branches.rank[k] == 1 else tr("place {place}", place=place)
    if turns > 1:
        taken = tr("{taken}, {turns} turns", taken=taken, turns=turns)
    if (freed := float(branches.freed_turn_deg[k])) > SAME:
        taken = tr("{taken}; tool turned by {angle}", taken=taken, angle=with_unit(fixed(freed, 1), "deg"))
    kinds = [kind for kind, on in zip(model.SINGULAR_PARTS, branches.singular[k]) if on]
    if not kinds:
        return taken
    if kinds == ["rank"]:
        return tr("{taken}; rank singularity", taken=taken)
    return tr("{taken}; {kinds} singularity", taken=taken, kinds=tr(", ").join(map(singularity_word, kinds)))


def _short(label: str, branch: int) -> str:
    """A branch in words that need little room."""
    return branch_word(label, branch).replace("elbow ", "")


def _on_one_line(label: str, branch: int) -> str:
    return _short(label, branch).replace(" ", NO_BREAK_SPACE)


def _units(robot: Robot) -> str:
    """The unit of joint values, or of most of them and of those that slide."""
    sliding = [f"J{j + 1}" for j in np.flatnonzero(robot.slides)]
    return tr("deg, {joints} in mm", joints=", ".join(sliding)) if sliding else tr("deg")


def _joints(q_deg: Iterable[float]) -> str:
    """Joint angles that lead to the arm in the teach panel."""
    return panel_link(q_deg, _listed(q_deg))


def _listed(values: Iterable[float]) -> str:
    """Numbers, with one decimal where one of them needs it, kept on one line."""
    texts = [fixed(value, 1) for value in values]
    whole = all(text.endswith(".0") for text in texts)
    return f",{NO_BREAK_SPACE}".join(text.removesuffix(".0") if whole else text for text in texts)
