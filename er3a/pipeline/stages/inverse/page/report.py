"""The page of the inverse stage."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from markupsafe import Markup

from er3a.collision.bodies import Bodies
from er3a.finding import is_one
from er3a.pipeline.language import tr, with_unit
from er3a.pipeline.messages.collision import clearance_text
from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.inverse import NEAREST_RULE
from er3a.pipeline.messages.kinematics import branch_word
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import joined, listed, say
from er3a.pipeline.player.motions import address_of
from er3a.pipeline.player.player import drawing_head, moment, player, stretch
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.inverse import model
from er3a.pipeline.stages.inverse.page.played import (
    SHOWN_S,
    refusal_in_short,
    short_of,
    solutions_played,
    with_singularity,
)
from er3a.pipeline.stages.trajectory.page.report import both_arms
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, Fix, Group, ListRow, all_caught
from er3a.pipeline.viewing.page import panel_address, panel_link, render_stage
from er3a.pipeline.viewing.palette import JOINTS
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

NO_BREAK_SPACE = "\u00a0"
SAME = 1e-6  # deg or mm
OVER = 0.12  # of a joint's way, beyond its limit, at most, where a joint is drawn that leaves it


def report(study: Study, stored: Stored[model.InverseResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, results, summary = stored.robot, stored.results, stored.results.summary
    robot, chosen = study.robot(name), model.shown_targets(summary.targets)
    names = results.solutions.target

    def of_target(target: model.TargetResult) -> model.SolutionRows:
        return results.solutions.take(names == target.name)

    scene = study.scene(name, stored.stage)
    bodies = None if stored.withheld else Bodies(robot, scene)
    played = [solutions_played(robot, target, best_of_branches(of_target(target)), bodies) for target in chosen]
    answer, shown = both_arms(study, stored, played) or (
        _answer(results.targets, chosen),
        {"player": player(robot, played, scene, opened=_opened(chosen))},
    )
    render_stage(
        study,
        stored,
        output,
        answer,
        **shown,
        drawing_head=drawing_head(),
        nearest_rule=tr(NEAREST_RULE),
        colours=JOINTS,
        sections=[_section(robot, target, of_target(target)) for target in chosen],
        sliding=_sliding(robot),
        count=len(results.targets),
    )


def _opened(shown: Sequence[model.TargetResult]) -> tuple[str, float]:
    """A target that is not reached and should be, or else the one with the least clearance, rather one that is served
    without a singular pose."""
    ranks = {
        each.name: (
            each.outcome in ("reached", each.expect),
            is_one(each.reason, "nearest_regular") or _singular(each),
            each.clearance.least_mm if each.clearance else np.inf,
            -each.within_limits,
        )
        for each in shown
    }
    return min(ranks, key=ranks.__getitem__), 0.0


def _answer(targets: model.TargetRows, shown: Sequence[model.TargetResult]) -> Answer:
    """How many targets the arm can take, and of each what came of it."""
    caught = int(targets.caught.sum())
    headline = tr("{count} of {due} poses reached.", count=targets.reached.sum(), due=len(targets) - caught)
    clear = targets.clearance_mm[np.isfinite(targets.clearance_mm)]
    keys = [(with_unit(fixed(min(clear), 1), "mm"), tr("least clearance"))] if len(clear) else []
    nearest = sorted(shown, key=lambda each: each.clearance.least_mm if each.clearance else np.inf)
    rows = [_row(each) for each in nearest]
    return Answer(
        headline,
        all_caught(caught),
        "",
        keys,
        (
            Group(tr("Not reached"), [row for row in rows if row.mark == "fail"]),
            Group(tr("Reached"), [row for row in rows if row.mark != "fail"]),
        ),
        next((row.fix for row in rows if row.fix), None),
    )


def _singular(target: model.TargetResult) -> bool:
    """Whether nothing but a singular pose serves a target."""
    return any(is_one(each, "at_singularity") for each in target.advice)


def _row(target: model.TargetResult) -> ListRow:
    """A target: how clear the chosen solution is, or what it came to, and what to do."""
    near = target.neighbours
    note = short_of(near.least_shift_mm) if near and near.least_shift_mm else outcome_word(target.outcome)
    if target.clearance:
        note = tr("{far} mm clear", far=fixed(target.clearance.least_mm, 1))
    mark: Literal["pass", "caution", "fail"] = "fail"
    if target.outcome == "reached":
        mark = "caution" if _singular(target) else "pass"
    fix = None
    if target.chosen_deg:
        fix = _jogged(target.chosen_deg)
    elif target.advice and mark == "fail":
        seen = address_of("inverse", target.name, 1.0, target.name) if near and near.shifted_to_mm else ""
        fix = Fix(say(target.advice[-1]), seen)
    meant = target.outcome == target.expect != "reached"
    return ListRow(mark, target.name, note, f"#{target.name}", (target.name, 0.0), fix=fix, meant=meant)


def _jogged(q_deg: Iterable[float]) -> Fix:
    return Fix(tr("save this pose as a program point."), panel_address(q_deg), instead=False)


def _section(robot: Robot, target: model.TargetResult, rows: model.SolutionRows) -> dict[str, Any]:
    branches = best_of_branches(rows)
    cells = _branch_rows(branches)
    return dict(
        target=target,
        position=_listed(target.xyz_mm),
        orientation=_listed(target.rpy_deg),
        reference=_joints(target.q_ref_deg),
        start=_listed(target.q_ref_deg) if any(target.q_ref_deg) else tr("zero"),
        reason=say(target.reason),
        short=_row(target).note,
        clearance=_clearance(target),
        advice=listed(target.advice),
        joints=[f"J{k + 1} ({'mm' if slides else '°'})>" for k, slides in enumerate(robot.slides)],
        method="" if is_one(target.method, "closed_form") else say(target.method),
        unsolved=joined(listed(target.unsolved)),
        rows=cells,
        listed=_solutions_listed(robot, target, branches),
    )


def _solutions_listed(
    robot: Robot, target: model.TargetResult, branches: model.SolutionRows
) -> list[tuple[str, Markup, Fix | None, Markup, Sequence[float], str]]:
    """The branches as they are listed by the player: mark, where it shows each, what to do then, its name, where each
    joint is between its limits (0 to 1), and how far the joints move."""
    singular = np.asarray(branches.singular.any(axis=1))
    ways = np.where(robot.upper - robot.lower < np.inf, robot.upper - robot.lower, 1.0)
    count = (branches.rank > 0).sum()
    used = tr("use solution {which}.", which=f"1–{count}" if count > 1 else 1)
    instead = Fix(used, address_of("inverse", target.name, 0.0, target.name)) if target.chosen_deg else None
    shares = np.where(ways == 1.0, 0.5, (meant(robot, branches.q_deg) - robot.lower) / ways)
    return [
        (
            "fail" if branches.refusal[k] else "caution" if singular[k] else "pass",
            stretch(target.name, k, k + SHOWN_S),
            instead if branches.refusal[k] else _jogged(branches.q_deg[k]),
            moment(target.name, k, _on_one_line(branches.label[k], int(branches.branch[k]))),
            shares[k].clip(-OVER, 1 + OVER).tolist(),
            _outcome(branches, k, with_unit(fixed(branches.greatest_move_deg[k], 0), "deg")),
        )
        for k in range(len(branches))
    ]


def best_of_branches(rows: model.SolutionRows) -> model.SolutionRows:
    """The best row of each branch of a target, by its place in the ranking, refused ones last."""
    best = rows.take(rows.first_of_branch)
    return best.take(np.lexsort((best.branch, best.rank, best.rank == 0)))


def _clearance(target: model.TargetResult) -> str:
    near = target.clearance
    return clearance_text(near.least_mm, near.between) if near else ""


def _branch_rows(branches: model.SolutionRows) -> list[list[str]]:
    cells = []
    for k in range(len(branches)):
        cells.append(
            [
                panel_link(branches.q_deg[k], _on_one_line(branches.label[k], int(branches.branch[k]))),
                *(fixed(angle, 1) for angle in branches.q_deg[k]),
                fixed(branches.limit_margin_deg[k], 1),
                fixed(branches.manipulability[k], 3),
                fixed(branches.greatest_move_deg[k], 1),
                _outcome(branches, k, tr("choice {place}", place=k + 1) if k else tr("chosen")),
            ]
        )
    return cells


def _outcome(branches: model.SolutionRows, k: int, taken: str) -> str:
    """Why a solution is refused, or else what is said of it as ``taken``, with what is to be known of it."""
    if branches.refusal[k] is not None:
        return refusal_in_short(branches.refusal[k])
    if (freed := float(branches.freed_turn_deg[k])) > SAME:
        taken = tr("{taken}; tool turned by {angle}", taken=taken, angle=with_unit(fixed(freed, 1), "deg"))
    return with_singularity(taken, branches, k)


def _on_one_line(label: str, branch: int) -> str:
    """A branch in words that need little room."""
    return branch_word(label, branch).replace("elbow ", "").replace(" ", NO_BREAK_SPACE)


def _sliding(robot: Robot) -> str:
    """That some joints' values are in mm; empty where all turn."""
    names = ", ".join(f"J{j + 1}" for j in np.flatnonzero(robot.slides))
    return tr(", {joints} in mm", joints=names) if names else ""


def _joints(q_deg: Iterable[float]) -> str:
    """Joint angles that lead to the arm in the teach panel."""
    return panel_link(q_deg, _listed(q_deg))


def _listed(values: Iterable[float]) -> str:
    """Numbers, with one decimal where one of them needs it, kept on one line."""
    texts = [fixed(value, 1) for value in values]
    whole = all(text.endswith(".0") for text in texts)
    return f",{NO_BREAK_SPACE}".join(text.removesuffix(".0") if whole else text for text in texts)
