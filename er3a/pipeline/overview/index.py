"""The page over all robots: the index (robots x stages, verdicts and key figures).

Variants of a sweep are listed only in the section of their sweep.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from scipy.spatial import ConvexHull

from er3a.files.kept_files import shown_path
from er3a.kinematics.forward import skeleton
from er3a.numerics.arrays import Reals
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.language import N_, own_title, tr
from er3a.pipeline.messages.collision import near_shapes
from er3a.pipeline.messages.diagnosis import CONVENTIONS
from er3a.pipeline.messages.dynamics import payload_text
from er3a.pipeline.messages.numbers import at_least, at_most, fixed, number
from er3a.pipeline.messages.pages import decision, next_step
from er3a.pipeline.messages.say import bracketed, joined, say, sentence
from er3a.pipeline.messages.scope import assumed_text, never_text, not_checked, say_reserved
from er3a.pipeline.messages.scope import missed_text as missed_of_check
from er3a.pipeline.messages.validation import (
    condition,
    how_far_off,
    missed_text,
    not_confirmed,
    settled_parts,
    shortened,
    stated_text,
    unconfirmed,
)
from er3a.pipeline.messages.workspace import judged_void, no_box_text, run_again_text, void_text
from er3a.pipeline.player.motions import Fault, FaultMoment
from er3a.pipeline.results import (
    THE_CODE,
    THE_SETTINGS,
    AbsentResults,
    Provenance,
    Stored,
    is_computed,
    read_stage,
    result_records,
)
from er3a.pipeline.stages.expectations import unmet_expectations
from er3a.pipeline.stages.programs.model import ProgramsResults, ProgramSummary
from er3a.pipeline.stages.programs.page.played import faults as program_faults
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.trajectory.model import PathSummary, TrajectoryResults
from er3a.pipeline.stages.trajectory.page.played import faults as path_faults
from er3a.pipeline.stages.validation.model import (
    AnotherArm,
    Contradicted,
    DefinedOtherwise,
    LeftOpen,
    PartFound,
    TableEvidence,
    ValidationResults,
)
from er3a.pipeline.stages.validation.page.evidence_section import evidence_section
from er3a.pipeline.stages.workspace.model import VoidSummary, WorkspaceResults, WorkspaceSummary
from er3a.pipeline.stages.workspace.page.tray import MOTIONS, Placing, placing, scene_of, sound_motions
from er3a.pipeline.study import Study
from er3a.pipeline.sweeps import ENTRIES, entry_label
from er3a.pipeline.verdicts import NOT_EXAMINED, StageVerdict, read_verdicts, write_junit
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.page import PAGES, Head, alternative_table, head_of, status_word
from er3a.robots.robot import Robot

MAX_CHANGED = 6  # files that have changed since, and are named
Workspaces = Mapping[str, WorkspaceResults | AbsentResults | None]
Outdated = Mapping[tuple[str, str], tuple[str, ...]]
"""What has changed since stages were computed, by robot and stage."""


def changed_text(outdated: Outdated, robots: Set[str]) -> str:
    """What has changed since any stage of robots was computed; empty where nothing has."""
    names = dict.fromkeys(each for (robot, _), changed in outdated.items() if robot in robots for each in changed)
    if not names:
        return ""
    text = N_("Changed since, so what stands here tells of what was before (run the study again): {names}.")
    return tr(text, names=_changed_names([*names]))


def _changed_names(changed: Sequence[str]) -> str:
    named = [tr(each) if each in (THE_SETTINGS, THE_CODE) else each for each in changed[:MAX_CHANGED]]
    more = [sentence("more", count=len(changed) - MAX_CHANGED)] if len(changed) > MAX_CHANGED else []
    return joined([*named, *more], ", ")


@dataclass(frozen=True)
class Point:
    """A variant in a sweep: its value and its stages' results, by stage."""

    name: str
    value: float
    stages: dict[str, Stored[Any]]

    @property
    def workspace(self) -> WorkspaceSummary:
        """What the workspace stage found."""
        return self.stages["workspace"].results.summary

    @property
    def enclosed(self) -> list[VoidSummary]:
        """The enclosed voids that the workspace stage lists."""
        return self.workspace.enclosed_voids

    def litres(self, bound: str) -> float:
        """The ``lower`` or ``upper`` bound of the enclosed voids' volume together, L."""
        return 1000 * sum(getattr(void.volume_m3, bound) for void in self.enclosed)


def sweep_sections(study: Study, results: Path, outdated: Outdated) -> list[dict[str, Any]]:
    """What the template shows of each sweep of the study whose variants have all been computed."""
    return [_section(study, name, results, outdated) for name in study.sweeps if _is_whole(study, name, results)]


def _is_whole(study: Study, name: str, results: Path) -> bool:
    variants = [variant.name for variant in study.variants.values() if variant.sweep == name]
    return all(is_computed(results / variant / stage) for variant in variants for stage in study.stages(variant))


def _section(study: Study, name: str, results: Path, outdated: Outdated) -> dict[str, Any]:
    sweep = study.sweeps[name]
    variants = [variant for variant in study.variants.values() if variant.sweep == name]
    points = [
        Point(v.name, v.value, {stage: read_stage(results / v.name / stage, STAGES[stage]) for stage in sweep.stages})
        for v in variants
    ]
    content = study.table(sweep.robot)
    what, unit = entry_label(ENTRIES[sweep.vary]), ENTRIES[sweep.vary].unit
    ends = {"low": _plain(min(sweep.resolved)), "high": _plain(max(sweep.resolved))}
    title = tr(
        "{robot}: {what} from {low} to {high} {unit}", robot=own_title(content.title), what=what, unit=unit, **ends
    )
    columns, rows = _table(points, what, unit, sweep.stages)
    return {
        "name": name,
        "title": title,
        "outdated": changed_text(outdated, {variant.name for variant in variants}),
        "columns": columns,
        "rows": rows,
    }


def _plain(value: float) -> str:
    """A varied value with the digits that it is written with."""
    return f"{value:.9g}".replace("-", "−")


def _table(points: list[Point], what: str, unit: str, stages: list[str]) -> tuple[list[str], list[list[Any]]]:
    columns = [tr("variant"), bracketed(what, tr(unit)) + ">", *(tr(PAGES[stage]) for stage in stages)]
    rows = [[point.name, _plain(point.value), *(_verdict(point, stage) for stage in stages)] for point in points]
    if "workspace" in stages:
        numbers = (
            tr("reached volume, at least (m³)"),
            tr("at most (m³)"),
            tr("enclosed voids"),
            tr("their volume, at least (L)"),
            tr("open pockets"),
            tr("greatest reach from axis 1 (mm)"),
        )
        columns += [f"{label}>" for label in numbers]
        rows = [[*row, *_workspace_cells(point)] for row, point in zip(rows, points)]
    return columns, rows


def _workspace_cells(point: Point) -> list[str]:
    if point.stages["workspace"].status == "not_computed":
        return ["–"] * 6
    summary = point.workspace
    return [
        at_least(summary.volume_m3.lower, "m³"),
        at_most(summary.volume_m3.upper, "m³"),
        str(len(point.enclosed)),
        at_least(point.litres("lower"), "L"),
        str(len(summary.voids) - len(point.enclosed)),
        number(1000 * summary.reach_m.furthest_from_axis),
    ]


def _verdict(point: Point, stage: str) -> Markup:
    status = point.stages[stage].status
    return Markup('<a href="{}/{}.html"><span class="badge {}">{}</span></a>').format(
        point.name, stage, status, status_word(status)
    )


CORNERS = 24  # of an arc, at most
MARGIN_MM = 40.0


@dataclass(frozen=True)
class Thumbnail:
    """Polylines of an SVG, x to the front and y downwards, in mm: its view box, what bounds the reach, the arm."""

    view_box: str
    reach: list[str]
    arm: str


def thumbnail(robot: Robot, workspace: Stored[Any] | None) -> Thumbnail:
    """Draw a robot, with the outline of the sampled hull."""
    arm = skeleton(robot, np.zeros(robot.joints))[:, ::2] * 1000
    results = workspace.results if workspace else None
    reach = [line * 1000 for line in _reach(results)] if isinstance(results, WorkspaceResults) else []
    corners = np.concatenate([arm, *reach])
    low, high = corners.min(axis=0) - MARGIN_MM, corners.max(axis=0) + MARGIN_MM
    box = (low[0], -high[1], *(high - low))
    return Thumbnail(" ".join(f"{value:.0f}" for value in box), [_points(line) for line in reach], _points(arm))


def _reach(workspace: WorkspaceResults) -> list[Reals]:
    flat = workspace.hull_vertices.point_m[:, ::2]
    if len(flat) < 3 or np.ptp(flat, axis=0).min() == 0:
        return []
    outline = ConvexHull(flat).vertices
    return [flat[np.append(outline, outline[0])]]


def _points(line: Reals) -> str:
    return " ".join(f"{x:.0f},{-z:.0f}" for x, z in line)


SHOWN_FIGURES = 3
RATES = ("own_speeds", "own_accelerations")
MAY_RUN = {name: motions for name, motions in MOTIONS.items() if STAGES[name].may_run}
MAX_TALLIED = 3  # that do not pass, though nothing expects it, and are named beside their number
MAX_FAULTS = 20  # of a robot's paths, and of its programs, that are listed
INLINE = ("a", "b", "code", "em", "i", "mark", "span", "strong", "sub", "sup", "wbr")  # no blank before or behind
_NOT_READ = re.compile(r'<(script|style)\b.*?</\1>|\ssrc="data:[^"]*"|\sdata-[\w-]+="[^"]*"', re.DOTALL)
FIRST = ("fail", "conflict", "caution", "no_reference", "not_computed", "pass")  # what is open stands first


def write_index(study: Study, results: Path, folder: Path) -> None:
    """Render ``index.html`` and ``junit.xml`` from the results of all robots and stages.

    Stages that have not been computed yet are named as such, and those whose inputs have changed since.
    """
    verdicts = read_verdicts(study, results)
    outdated = {(each.robot, each.stage): each.outdated for each in verdicts if each.outdated}
    stored = {name: _computed(study, name, results / name) for name in study.robots}
    robots = [
        _entry(study, name, alternative_table(study, name, results), stored, outdated)
        | {"thumbnail": thumbnail(study.robot(name), stored[name].get("workspace"))}
        for name in study.robots
    ]
    contradicted = {each["robot"].name for each in robots if each["table"] == "fail"}
    page.render(
        Path(__file__).with_name("index.html.j2"),
        folder / "index.html",
        places=page.packed_text(json.dumps([*_places(study, folder, contradicted)], ensure_ascii=False)),
        robots=robots,
        article=study.article is not None,
        questions={stage.name: stage.question for stage in STAGES.values()},
        shown_figures=SHOWN_FIGURES,
        run_words=MAY_RUN,
        never=never_text("trajectory"),
        conventions=CONVENTIONS,
        most_faults=MAX_FAULTS,
        sweeps=sweep_sections(study, results, outdated),
        command=page.run_command(study, "index.html"),
        provenance=Provenance(
            inputs=result_records(results, study.names),
            code=code_digest(),
            seed=study.seed,
        ),
    )
    write_junit(verdicts, folder / "junit.xml")


class _TextOfPage(HTMLParser):
    """All text of a page's main part, folded or not: by heading, in the page's order, that of each block and row."""

    ROWS = ("caption", "table", "tr")
    TEXTS = ("dl", "dt", "h2", "h3", "li", "ol", "p", "pre", "ul")
    BLOCKS = frozenset((*ROWS, *TEXTS, "details", "div", "figcaption", "figure", "img", "main", "section", "summary"))
    NOT_READ = frozenset(("button", "nav", "select", "svg", "thead"))

    def __init__(self) -> None:
        super().__init__()
        self.texts: dict[str, dict[str, None]] = {}
        self._heads = {"h2": "", "h3": ""}
        self._depth = dict.fromkeys(("main", "tr", *self.NOT_READ), 0)
        self._parts = list[str]()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin a block or row; what an image shows counts as text."""
        named = dict(attrs)
        self._between(tag)
        if tag in self._depth:
            self._depth[tag] += 1
        self.handle_data(named.get("alt") or "")

    def handle_endtag(self, tag: str) -> None:
        """End a block or row; a heading's text is that of what follows."""
        if tag in self._depth:
            self._depth[tag] -= 1
        if tag in self._heads:
            self._heads |= {"h3": ""} | {tag: " ".join("".join(self._parts).split())}
        self._between(tag)

    def handle_data(self, data: str) -> None:
        """Take text of the main part, but for what is in ``NOT_READ``."""
        if self._depth["main"] and not any(self._depth[tag] for tag in self.NOT_READ):
            self._parts.append(data)

    def _between(self, tag: str) -> None:
        """Where a block begins or ends, what came before is one text; cells and what is in them stay in their row's."""
        if tag not in self.BLOCKS or self._depth["tr"]:
            self._parts.append("" if tag in INLINE else " ")
            return
        text = " ".join("".join(self._parts).split())
        if len(text) > 1:
            self.texts.setdefault(joined([*filter(None, self._heads.values())], " "), {})[text] = None
        self._parts = []


def _places(
    study: Study, folder: Path, contradicted: Set[str]
) -> Iterator[tuple[str, str, list[tuple[str, list[str]]]]]:
    """Of each page that is there its address, its title, and by heading all of its text; a title says which robots'
    tables evidence contradicts."""
    pages = [(name, stage) for name in study.names for stage in study.pages(name)]
    warned = {name: tr("never use this table") if name in contradicted else "" for name in study.names}
    titles = {name: bracketed(own_title(study.robot(name).title), warned[name]) for name in study.names}
    named = {
        f"{name}/{stage}.html": tr("{robot}: {page}", robot=titles[name], page=tr(PAGES[stage]))
        for name, stage in pages
    }
    if study.article:
        named["article.html"] = tr("The article, item by item")
    for address, title in named.items():
        if (folder / address).is_file():
            parser = _TextOfPage()
            parser.feed(_NOT_READ.sub("", (folder / address).read_text(encoding="utf-8")))
            yield address, title, [(head, list(texts)) for head, texts in parser.texts.items()]


def _computed(study: Study, name: str, folder: Path) -> dict[str, Stored[Any]]:
    """The results of a robot's stages that are there, by stage."""
    return {
        stage: read_stage(folder / stage, STAGES[stage]) for stage in study.stages(name) if is_computed(folder / stage)
    }


def _evidence(stored: Mapping[str, Stored[Any]]) -> TableEvidence | None:
    """What evidence says of a robot's table; None before the validation stage has been computed."""
    results = stored["validation"].results if "validation" in stored else None
    return results.summary.evidence if isinstance(results, ValidationResults) else None


def _entry(
    study: Study, name: str, instead: str | None, of_robots: Mapping[str, Mapping[str, Stored[Any]]], outdated: Outdated
) -> dict[str, Any]:
    """What the index shows of a robot; ``instead``: the robot whose table is to be used in place of its own."""
    changed = {stage: files for (robot_name, stage), files in outdated.items() if robot_name == name}
    robot, expected = study.robot(name), study.entry(name).expect
    stages, stored = study.stages(name), of_robots[name]
    heads = {stage: head_of(each) for stage, each in stored.items()}
    failed = {
        stage: tr(STAGES[stage].title)
        for stage, head in heads.items()
        if StageVerdict(name, stage, head.status, head.finding.code, "", expected=expected.get(stage)).counts("fail")
    }
    table = heads["validation"].status if "validation" in heads else NOT_EXAMINED
    finding = heads["validation"].finding if "validation" in heads else None
    same_arm, evidence = isinstance(finding, DefinedOtherwise), _evidence(stored)
    unproven, settled = _settled(finding, evidence)
    entries = evidence_section(robot, evidence, _evidence(of_robots[instead]) if instead else None)
    computed = {stage: each for stage, each in stored.items() if heads[stage].status != "not_computed"}
    runs, grasped, placed = _motions(study, robot, name, computed)
    return {
        "robot": robot,
        "table": table,
        "contradicted": table == "fail" and not same_arm,
        "may_run": table != "fail",
        "decision": decision(
            table, [*failed.values()], instead, unproven=unproven, same_arm=same_arm, conflict=_conflict(finding)
        ),
        "entries": entries,
        "instead": {instead: f"#{instead}"} if instead else {},
        "dh_instead": {instead: f"#dh-{instead}"} if instead else {},
        "answers": [*([settled] if settled else []), *_answers(heads, robot, placed)],
        "outdated": changed_text(outdated, {name}),
        "notes": _notes(heads, runs, changed),
        "bare": any(_assumes(heads[stage], "carried", "tool") for stage in MAY_RUN if stage in heads),
        "bodies": [each.name for each in scene.solids] if (scene := study.scene(name, "trajectory")) else [],
        "runs": runs,
        "grasped": grasped,
        "grasps_missed": not_checked(missed)
        if "vision" in computed and (missed := computed["vision"].results.summary.verdict.missed)
        else "",
        "condition": condition(_parts(heads), getattr(finding, "unbounded", ()), rates := _assumed_rates(heads)),
        "rates": rates,
        "box": joined([_without_box(), placed.compared], " ") if placed else "",
        "in_box": placed.met if placed else {},
        "shapes": next((say(shapes.but(near=())) for shapes in (head.shapes for head in heads.values()) if shapes), ""),
        "next": next_step(
            name,
            table,
            failed,
            instead=instead,
            same_arm=same_arm,
            **proposed(finding, shown_path(study.robot_file(name))),
        ),
        "cells": _cells(heads, changed),
        "expected": expected,
        "meant": _meant(heads, expected),
        "not_examined": [tr(STAGES[stage].title) for stage in stages if stage not in heads],
        "not_asked": [tr(stage.title) for name, stage in STAGES.items() if name not in stages],
    }


def _notes(
    heads: Mapping[str, Head], runs: Sequence[Mapping[str, Any]], changed: Mapping[str, Sequence[str]]
) -> dict[str, str]:
    """What stands beside the name of each stage."""
    return {
        stage: tr("changed since") if stage in changed else _note(head, [r for r in runs if r["stage"] == stage])
        for stage, head in heads.items()
    }


def _cells(heads: Mapping[str, Head], changed: Mapping[str, Sequence[str]]) -> list[dict[str, Any]]:
    """What is said of each stage: first what has changed since, then the gravest."""
    order = sorted(heads.values(), key=lambda head: (head.stage not in changed, FIRST.index(head.status)))
    return [_cell(head, changed.get(head.stage, ())) for head in order]


def _motions(
    study: Study, robot: Robot, name: str, computed: Mapping[str, Stored[Any]]
) -> tuple[list[dict[str, Any]], Sequence[str], Placing | None]:
    """The paths and programs of a robot, the objects that its tool can grasp, and where to put the tray."""
    runs = [_run(stage, name, computed[stage].results) for stage in MAY_RUN if stage in computed]
    grasped = sound_motions(computed["vision"].results) if "vision" in computed else []
    sound = {run["stage"]: run["sound"] for run in runs} | {"vision": grasped}
    scenes = {stage: scene_of(study, name, stage) for stage in MOTIONS}
    return runs, grasped, placing(computed, robot, scenes, sound)


def _conflict(finding: object) -> str:
    """The values of one number about which references contradict each other; empty where they don't."""
    found = getattr(finding, "contradiction", None)
    return stated_text(found) if found else ""


def _assumed_rates(heads: Mapping[str, Head]) -> str:
    """Which of the joints' speeds and accelerations paths and programs rest on without a document."""
    speeds, rates = ([_assumes(heads[stage], each) for stage in MAY_RUN if stage in heads] for each in RATES)
    if any(speeds) and any(rates):
        return tr("joint speeds and accelerations")
    return tr("joint speeds") if any(speeds) else tr("joint accelerations") if any(rates) else ""


def _meant(heads: Mapping[str, Head], expected: Mapping[str, str]) -> str:
    """Which stages fail as the study expects; empty where none does."""
    named = [tr(STAGES[stage].title) for stage, head in heads.items() if head.status == "fail" == expected.get(stage)]
    return tr("{count} expected to fail: {names}", count=len(named), names=joined(named, ", ")) if named else ""


def proposed(finding: object, robot_file: str) -> dict[str, str]:
    """The measurement that validation proposes, as :func:`next_step` takes it; empty where it proposes none."""
    if not isinstance(finding, LeftOpen) or finding.next_measurement is None:
        return {}
    proposal, entry = finding.next_measurement, finding.next_measurement.entry
    seen = N_("If so, {entry} is correct; if not, turn its sign in {file}, and run again.")
    settles = seen if proposal.code == "look_at_motion" else N_("It settles {entry}.")
    step = [
        page.whole_sentence(say(proposal)),
        tr(settles, entry=entry if " " in entry else shortened([entry]), file=robot_file),
    ]
    open_ = sum(part.entries - part.settled - part.up_to_signs for part in finding.parts)
    if open_ > 1 or any(name != entry for name in finding.unbounded):
        step.append(tr("Then check the other entries that are not settled, as that page says."))
    return {"measurement": joined(step, " "), "entry": entry.replace(" ", "")}


def _settled(finding: object, evidence: TableEvidence | None) -> tuple[bool, Answer | None]:
    """Whether nothing of a table's geometry is settled; and of one that is contradicted by what, of one that is settled
    in part what is not, how much is, and how far off the tool could be."""
    title, place = tr("D-H table"), "validation.html"
    if isinstance(finding, Contradicted | AnotherArm):
        return False, Answer(title, missed_text(finding), page=place)
    if not isinstance(finding, LeftOpen):
        return False, None
    part = next((part for part in finding.parts if part.part == "geometry"), None)
    conflict = say(finding.contradiction) if finding.contradiction else ""
    sums = joined([each.entry for each in evidence.combinations] if evidence else [], ", ")
    counted = tr("Counted as one entry, because only the sum matters: {names}.", names=sums) if sums else ""
    names, said = unconfirmed(finding.parts, finding.unbounded), settled_parts(finding)
    open_ = not_confirmed(names)
    lead = joined([open_ or said, conflict], " ")
    rest = joined([said.removesuffix(open_).rstrip() if open_ else "", counted, *how_far_off(finding)], " ")
    return part is not None and not (part.settled or part.up_to_signs), Answer(title, lead, rest, place)


@dataclass(frozen=True)
class Answer:
    """An answer to what is asked of an arm first: in a line or two, the rest, and where it is shown; ``places``: of the
    tray, where there are several."""

    title: str
    lead: str
    rest: str = ""
    page: str = ""
    places: Sequence[Sequence[str]] = ()


def _answers(heads: Mapping[str, Head], robot: Robot, placing: Placing | None) -> Iterator[Answer]:
    """What is asked of an arm first; ``placing``: where to put the tray."""
    workspace = heads["workspace"].summary if "workspace" in heads else None
    if isinstance(workspace, WorkspaceSummary):
        reach = _reach_text(workspace, bare=_assumes(heads["workspace"], "tool"))
        yield Answer(tr("Reach"), reach, page="workspace.html")
    summary = heads["dynamics"].summary if "dynamics" in heads else None
    yield Answer(tr("Payload"), *payload_text(summary, robot), "dynamics.html#payload" if summary else "")
    if not workspace:
        return
    row = ""
    if isinstance(workspace, WorkspaceSummary) and workspace.enclosed_voids:
        row = f"#void-{workspace.voids.index(judged_void(workspace)) + 1}"
    yield Answer(tr("Void"), *void_text(workspace, confirmed=_limits_confirmed(heads)), f"workspace.html{row}")
    if placing is None:
        yield Answer(tr("Tray"), no_box_text(workspace), page="workspace.html#placement")
        return
    rest = run_again_text(workspace)
    places = placing.rows if len(placing.rows) > 1 else ()
    yield Answer(tr("Tray"), placing.line, rest, "workspace.html#placement", places)


def _reach_text(summary: WorkspaceSummary, *, bare: bool) -> str:
    """How far from axis 1 and how high the tool point comes; ``bare``: whether the robot has no tool."""
    reach = summary.reach_m
    least, most, low, high = (
        fixed(1000 * value, 1)
        for value in (reach.nearest_to_axis, reach.furthest_from_axis, reach.lowest, reach.highest)
    )
    point = tr("the flange's centre (no tool is given)") if bare else tr("the tool point")
    return tr(
        "{least} to {most} mm from axis 1 and {low} to {high} mm along it, of {point}; {smallest} to {largest} m³ in "
        "all (proven).",
        point=point,
        least=least,
        most=most,
        low=low,
        high=high,
        smallest=at_least(summary.volume_m3.lower, "m³"),
        largest=at_most(summary.volume_m3.upper, "m³"),
    )


def _limits_confirmed(heads: Mapping[str, Head]) -> bool:
    """Whether independent documents settle all limits of the joints."""
    return not unconfirmed([part for part in _parts(heads) if part.part == "limits"]) and bool(_parts(heads))


def _parts(heads: Mapping[str, Head]) -> Sequence[PartFound]:
    """What is known of each part of the table; empty where validation has no evidence of it."""
    evidence = getattr(heads["validation"].summary, "evidence", None) if "validation" in heads else None
    return evidence.parts if evidence else ()


def _assumes(head: Head, *reasons: str) -> bool:
    """Whether a stage assumes something."""
    return any(each.reason in reasons for each in head.summary.assumed)


def _without_box() -> str:
    return tr(
        "These pass without the tray and its stand: put both into the study's scene file and run again before "
        "you run any of them there."
    )


def _run(stage: str, robot: str, results: TrajectoryResults | ProgramsResults) -> dict[str, Any]:
    """How many paths or programs there are, which may be run as they are, and why the others may not."""
    followed: Sequence[ProgramSummary | PathSummary]
    if isinstance(results, ProgramsResults):
        followed, lost, faults = results.summary.programs, 0, program_faults(results)
    else:
        followed, lost, faults = results.summary.paths, len(results.summary.not_followed), path_faults(results)
    faults += _otherwise(stage, followed, {fault.name for fault in faults})
    sound = sound_motions(results)
    scope = results.summary
    count = len(sound) + len(faults) + lost
    return {
        "stage": stage,
        "count": count,
        "sound": sound,
        "tally": _tally(stage, len(sound), faults, lost),
        "links": {fault.name: f"{robot}/{fault.address}" for fault in faults}
        | {_passing(stage, len(sound), count): f"#faults-{robot}-{stage}" if faults else f"#runs-{robot}"},
        "faults": faults,
        "missed": [missed_of_check(each) for each in scope.checked if not each.complete],
        "assumed": [assumed_text(each) for each in scope.assumed],
        "no_pass": not_checked(results.summary.verdict.missed),
    }


def _otherwise(stage: str, followed: Sequence[ProgramSummary | PathSummary], faulty: set[str]) -> list[Fault]:
    """Those that pass although their file expects something else: file or check is not what it is taken for."""
    unmet = unmet_expectations(followed)
    return [
        Fault(
            each.name,
            "",
            "fail",
            tr("not as expected"),
            False,
            "",
            (FaultMoment(say(each)),),
            "",
            f"{stage}.html#{each.name}",
        )
        for each in (unmet.unmet if unmet else ())
        if each.name not in faulty
    ]


def _tally(stage: str, sound: int, faults: Sequence[Fault], lost: int) -> str:
    """How many paths or programs pass, how many of the others are expected not to, and which others do not."""
    others, count = [fault for fault in faults if not fault.meant], sound + len(faults) + lost
    meant = len(faults) - len(others)
    passing = tr("{counted} in the model", counted=_passing(stage, sound, count))
    rest = N_("the other one is expected to fail") if meant == 1 else N_("the other {count} are expected to fail")
    whole = N_("{count} expected to fail") if others or lost else rest
    named = [tr("{name}: {verdict}", name=fault.name, verdict=fault.verdict) for fault in others[:MAX_TALLIED]]
    more = tr("{count} more do not pass", count=len(others) - MAX_TALLIED) if len(others) > MAX_TALLIED else ""
    left = tr("{count} not followed to the end", count=lost) if lost else ""
    return joined([passing, tr(whole, count=meant) if meant else "", *named, more, left])


def _passing(stage: str, sound: int, count: int) -> str:
    return tr("{sound} of {count} {what} pass", sound=sound, count=count, what=tr(MAY_RUN[stage]))


def _note(head: Head, runs: Sequence[Mapping[str, Any]]) -> str:
    """What stands beside a stage's name: how many of its paths or programs pass, where some do not, how many targets,
    paths, programs or objects are expected to fail, that its gripper has no shape or its camera is simulated."""
    if head.no_verdict:
        return ""
    parts = [
        tr("{sound} of {count}", sound=len(run["sound"]), count=run["count"])
        for run in runs
        if len(run["sound"]) < run["count"]
    ]
    parts += [tr("{count} expected to fail", count=head.demonstrations)] if head.demonstrations else []
    if head.stage == "vision" and _assumes(head, "carried"):
        parts.append(tr("gripper's shape not given"))
    return joined([*parts, tr("simulated") if _assumes(head, "real_camera") else ""])


def _cell(head: Head, changed: Sequence[str]) -> dict[str, Any]:
    """What the index says of a stage: its answer and the rest of its text, without what all stages of a robot share;
    before it what has ``changed`` since."""
    verdict = head.summary.verdict
    unexamined = [say(found) for found in verdict.findings[1:] if found is not verdict.shapes]
    near = near_shapes(verdict.shapes.margin_mm, verdict.shapes.near) if verdict.shapes else ""
    lead, rest = page.led(joined([say_reserved(head.finding, head.summary.assumed), *unexamined, near], " "))
    if changed:
        lead = sentence("stage.outdated", names=_changed_names(changed), text=lead)
    return {
        "head": head,
        "sign": "no_verdict" if changed else head.sign,
        "changed": changed,
        "lead": lead,
        "rest": rest,
    }
