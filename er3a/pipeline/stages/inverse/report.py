"""The page of the inverse stage."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from markupsafe import Markup

from er3a.kinematics.solutions import ClosedForm
from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.inverse import FIGURES, FREE_AT, NEAREST_RULE, limits_in_short
from er3a.pipeline.messages.kinematics import branch_word, singularity_word
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import joined, listed, say, word
from er3a.pipeline.messages.selection import RULE_NAMES, RULE_TITLES
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.inverse.model import (
    SINGULAR_PARTS,
    InverseResults,
    RankingRows,
    SelfMotion,
    SolutionRows,
    TargetResult,
)
from er3a.pipeline.stages.inverse.model import Sequence as Visits
from er3a.pipeline.stages.inverse.shown_targets import shown_targets
from er3a.pipeline.stages.inverse.solution_figures import histogram, overlay, solutions_per_position
from er3a.pipeline.stages.inverse.symptoms import symptoms
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.page import Picture, fixed, head_of, number, render, run_command
from er3a.pipeline.viewing.panel_link import panel_link
from er3a.robots.joint_limits import LimitsExceeded
from er3a.robots.robot import Robot
from er3a.selection.rules import RULES

NO_BREAK_SPACE = "\u00a0"


MOST_SELF_MOTIONS = 6


@dataclass(frozen=True)
class TargetSection:
    """What the page says about a target, in words; the worst residuals are None where nothing solves it."""

    target: TargetResult
    picture: Picture
    position: str
    orientation: str
    reference: str
    reason: str
    advice: list[str]
    joints: list[str]
    method: str
    families: list[str]
    unsolved: str
    rows: list[list[str]]
    rules: list[list[str]]
    residual_mm: float | None
    residual_deg: float | None


def report(study: Study, stored: Stored[InverseResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, results, summary = stored.robot, stored.results, stored.results.summary
    robot, trips, chosen = study.robot(name), summary.round_trips, shown_targets(summary.targets)
    rules = list(dict.fromkeys(results.rankings.rule))
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        head=head_of(stored, FIGURES),
        command=run_command(study, f"{name}/inverse.html"),
        robot=robot,
        robot_pages=study.pages(name),
        nearest_rule=tr(NEAREST_RULE),
        overview=[_overview_row(target) for target in chosen],
        sections=[_section(robot, target, results, rules) for target in chosen],
        outcomes=_outcomes(summary.targets),
        not_advised=_not_advised(summary.targets),
        units=_units(robot),
        chosen_heading=tr("Chosen J1 to J{count} ({units})", count=robot.joints, units=_units(robot)),
        optimised_heading=tr("J1 to J{count}, optimised ({units})", count=robot.joints, units=_units(robot)),
        rule_columns=[tr("Branch"), *map(_rule_heading, rules)],
        trips=trips,
        histogram=histogram(trips) if trips else None,
        map=solutions_per_position(results.map) if len(results.map) else None,
        symptoms=symptoms(summary),
        rules=[(_rule(rule), word("rule.title", RULE_TITLES, rule)) for rule in RULES],
        mix=tr(", ").join(f"{_rule(rule)} {weight:g}" for rule, weight in summary.mix.items()),
        stops=_stops(summary.sequence, {target.name for target in chosen}),
        move=_move_rule(summary.sequence),
    )


def _section(robot: Robot, target: TargetResult, results: InverseResults, rules: list[str]) -> TargetSection:
    rows = results.solutions.take(results.solutions.target == target.name)
    branches = best_of_branches(rows)
    return TargetSection(
        target=target,
        picture=overlay(robot, target, branches),
        position=_listed(target.xyz_mm),
        orientation=_listed(target.rpy_deg),
        reference=_joints(target.q_ref_deg),
        reason=say(target.reason),
        advice=listed(target.advice),
        joints=[f"J{k + 1} ({'mm' if slides else '°'})>" for k, slides in enumerate(robot.slides)],
        method="" if isinstance(target.method, ClosedForm) else say(target.method),
        families=_self_motions(robot, target.families),
        unsolved=joined(listed(target.unsolved)),
        rows=_branch_rows(rows, branches),
        rules=_rule_rows(results.rankings.take(results.rankings.target == target.name), rules),
        residual_mm=rows.position_residual_mm.max() if len(rows) else None,
        residual_deg=rows.orientation_residual_deg.max() if len(rows) else None,
    )


def best_of_branches(rows: SolutionRows) -> SolutionRows:
    """The best row of each branch of a target, by number of the branch."""
    best = rows.take(rows.first_of_branch)
    return best.take(np.argsort(best.branch, kind="stable"))


def _rule(rule: str) -> str:
    return word("rule", RULE_NAMES, rule)


def _rule_heading(rule: str) -> str:
    unit = next((own.unit for name, own in RULES.items() if name == rule), "1")
    return f"{_rule(rule)}{'' if unit == '1' else f' ({unit})'}>"


def _rule_rows(ranked: RankingRows, rules: list[str]) -> list[list[str]]:
    """One row for each branch: the measure of each rule, with its place; a dash for a rule that this target lacks."""
    rows, collides = [], tr("collides")
    for branch in np.unique(ranked.branch):
        own = ranked.take(ranked.branch == branch)
        cells = {
            rule: f"{number(_no_noise(measure), 3)}{NO_BREAK_SPACE}({place or collides})"
            for rule, measure, place in zip(own.rule, own.measure, own.place)
        }
        rows.append([_on_one_line(own.label[0], int(branch)), *(cells.get(rule, "–") for rule in rules)])
    return rows


def _no_noise(measure: float) -> float:
    """0 for what is nothing but rounding."""
    return 0.0 if abs(measure) < 1e-9 else float(measure)


def _self_motions(robot: Robot, families: tuple[SelfMotion, ...]) -> list[str]:
    """The nearest self-motions, and how many more there are."""
    told = [_self_motion(robot, family) for family in families[:MOST_SELF_MOTIONS]]
    if len(families) > MOST_SELF_MOTIONS:
        told.append(tr("{count} more in summary.json", count=len(families) - MOST_SELF_MOTIONS))
    return told


def _self_motion(robot: Robot, family: SelfMotion) -> str:
    text = _curve(robot, family)
    if family.dimension > 1:
        return tr(
            "{text}; this is one curve of a surface of solutions, on which the arm can move in {count} ways at once "
            "and stay on the target",
            text=text,
            count=family.dimension,
        )
    return text


def _curve(robot: Robot, family: SelfMotion) -> str:
    of_slide = f"{NO_BREAK_SPACE}mm/°"
    moving = [
        f"J{j + 1} {'+' if rate > 0 else ''}{fixed(rate, 2)}{of_slide if robot.slides[j] else ''}"
        for j, rate in enumerate(family.direction)
        if abs(rate) > 1e-9
    ]
    low, high = family.range_deg
    parts = {
        "where": word("self_motion", FREE_AT, family.kind),
        "joints": f"({_listed(family.q0_deg)}){NO_BREAK_SPACE}{_units(robot)}",
        "rates": ", ".join(moving),
    }
    if not family.within_limits:
        return tr(
            "{where}: from {joints}, nearest to the reference, joints move on the target in the ratio {rates}, but "
            "every member leaves the limits",
            **parts,
        )
    return tr(
        "{where}: from {joints}, nearest to the reference, joints move on the target in the ratio {rates}, for {low} "
        "to {high} deg",
        low=fixed(low, 1),
        high=fixed(high, 1),
        **parts,
    )


def _move_rule(sequence: Visits | None) -> tuple[str, str]:
    """Unit and title of the rule that moves in the sequence are ranked by."""
    return (RULES[sequence.rule].unit, word("rule.title", RULE_TITLES, sequence.rule)) if sequence else ("", "")


def _outcomes(targets: Iterable[TargetResult]) -> str:
    """How many targets came to what."""
    counts = Counter(target.outcome for target in targets)
    return tr(", ").join(f"{outcome_word(outcome)} {number(count)}" for outcome, count in counts.most_common())


def _not_advised(targets: Iterable[TargetResult]) -> int:
    """How many targets without solution were not looked at for what would help, where others were."""
    without = [target.neighbours for target in targets if target.outcome in ("unreachable", "leaves limits")]
    return without.count(None) if any(without) else 0


def _stops(sequence: Visits | None, named: set[str]) -> list[list[str]]:
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


def _overview_row(target: TargetResult) -> list[str]:
    unreached = target.obstacle if not target.solutions else None
    return [
        Markup('<a href="#{0}">{0}</a>').format(target.name),
        _listed(target.xyz_mm),
        tr("{within} of {all}", within=target.within_limits, all=target.solutions),
        tr("none") if target.chosen_deg is None else _joints(target.chosen_deg),
        say(unreached or target.reason),
    ]


def _branch_rows(rows: SolutionRows, branches: SolutionRows) -> list[list[str]]:
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


def _outcome(branches: SolutionRows, k: int, place: int, turns: int) -> str:
    refusal = branches.refusal[k]
    if refusal is not None:
        return limits_in_short(refusal) if isinstance(refusal, LimitsExceeded) else say(refusal)
    taken = tr("chosen") if branches.rank[k] == 1 else tr("place {place}", place=place)
    if turns > 1:
        taken = tr("{taken}, {turns} turns", taken=taken, turns=turns)
    kinds = [kind for kind, on in zip(SINGULAR_PARTS, branches.singular[k]) if on]
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
    return tr("deg, {joints} in mm", joints=", ".join(sliding)) if sliding else "deg"


def _joints(q_deg: Iterable[float]) -> str:
    """Joint angles that lead to the arm in the teach panel."""
    return panel_link(q_deg, _listed(q_deg))


def _listed(values: Iterable[float]) -> str:
    """Numbers with one decimal where they need it, kept on one line."""
    texts = (fixed(value, 1).removesuffix(".0") for value in values)
    return f",{NO_BREAK_SPACE}".join(texts)
