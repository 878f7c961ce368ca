"""The page over all robots: the arms, what to do with each, a number for each robot and stage, and the tiles."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from er3a.by_value import frozen
from er3a.files.kept_files import write_text
from er3a.finding import is_one
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.language import own_title, tr
from er3a.pipeline.messages.say import joined
from er3a.pipeline.overview.glances import glance
from er3a.pipeline.overview.search import places
from er3a.pipeline.overview.tiles import first_with, motions_tile, table_tile, tray_tile
from er3a.pipeline.results import THE_CODE, THE_SETTINGS, Provenance, Stored, is_computed, read_stage, result_records
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.validation.model import ValidationResults
from er3a.pipeline.stages.validation.page.evidence_section import to_confirm
from er3a.pipeline.stages.workspace.model import WorkspaceResults
from er3a.pipeline.stages.workspace.page.workspace_figures import labelled
from er3a.pipeline.study import Study
from er3a.pipeline.verdicts import StageVerdict, read_verdicts, write_junit
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.drawn import floor_of
from er3a.pipeline.viewing.page import PAGES, Head, head_of
from er3a.pipeline.viewing.side_view import seen_arm, side_view

USES = ("use", "plan", "measure", "never")  # from what may be relied on most
WIDE = 2.06  # width of the picture, of its height
MAX_CHANGED = 6  # files that have changed since, and are named
Results = Mapping[str, Stored[Any]]
"""The results of a robot's stages that are there, by stage."""


@frozen
class StageCell:
    """A stage of a robot: its verdict, its number, what is to be known of that in few words, and the whole sentence."""

    stage: str
    status: str
    value: str
    note: str
    text: str = ""


@frozen
class RobotRow:
    """A robot on the index.

    Attributes
    ----------
    decision, use : what to do with it, in few words, and in one: ``plan``, ``never``, ``measure``
    cells : in the order of the stages; None where a stage was not asked for
    outdated : what has changed since its results were computed; empty where nothing has
    """

    name: str
    title: str
    use: str
    decision: str
    cells: Sequence[StageCell | None]
    outdated: str


def write_index(study: Study, results: Path, folder: Path) -> None:
    """Render ``index.html``, ``marks.js`` and ``junit.xml`` from the results of all robots and stages.

    Stages that have not been computed yet are named as such, and those whose inputs have changed since.

    Parameters
    ----------
    results : folder of all results
    folder : of the reports
    """
    verdicts = read_verdicts(study, results)
    stored = {name: _computed(study, name, results / name) for name in study.robots}
    entries = [_entry(study, name, stored[name], verdicts) for name in study.robots]
    wrong = [entry for entry in entries if entry.use == "never"]
    ranked = sorted(entries, key=lambda entry: USES.index(entry.use))
    chosen = ranked[0]
    drawn = [chosen, *[entry for entry in wrong if entry is not chosen][:1]]
    page.render(
        Path(__file__).with_name("index.html.j2"),
        folder / "index.html",
        entries=entries,
        stages=_asked(study),
        questions={name: stage.question for name, stage in STAGES.items()},
        arms=_picture(study, drawn, stored),
        steps=_steps(chosen, stored[chosen.name]),
        tiles=_tiles(study, ranked, drawn[-1].name, stored),
        article=study.article is not None,
        command=page.run_command(study, "index.html"),
        provenance=Provenance(inputs=result_records(results, study.names), code=code_digest(), seed=study.seed),
    )
    found = places(study, folder, {entry.name for entry in wrong})
    _write_marks(entries, page.packed_text(json.dumps([*found], ensure_ascii=False)), folder / "marks.js")
    write_junit(verdicts, folder / "junit.xml")


def _changed_text(verdicts: Iterable[StageVerdict]) -> str:
    """What has changed since any stage of a robot was computed; empty where nothing has."""
    names = [*dict.fromkeys(name for each in verdicts for name in each.outdated)]
    if not names:
        return ""
    named = [tr(each) if each in (THE_SETTINGS, THE_CODE) else each for each in names[:MAX_CHANGED]]
    more = ["…"] * (len(names) > MAX_CHANGED)
    return tr("Made before {names} changed (run the study again).", names=joined([*named, *more], ", "))


def _computed(study: Study, name: str, folder: Path) -> Results:
    return {
        stage: read_stage(folder / stage, STAGES[stage]) for stage in study.stages(name) if is_computed(folder / stage)
    }


def _asked(study: Study) -> list[str]:
    """The stages that any robot is asked for."""
    return [name for name in STAGES if any(name in study.stages(robot) for robot in study.robots)]


def _entry(study: Study, name: str, stored: Results, verdicts: Sequence[StageVerdict]) -> RobotRow:
    """What the index shows of a robot."""
    heads = {stage: head_of(each) for stage, each in stored.items()}
    own = {each.stage: each for each in verdicts if each.robot == name}
    failed = [tr(PAGES[stage]) for stage, each in own.items() if replace(each, outdated=()).counts("fail")]
    table = own["validation"].status if "validation" in own else "not_examined"
    use, said = _use(table, heads.get("validation"), failed)
    cells = [_cell(own[each], heads, stored) if each in own else None for each in _asked(study)]
    return RobotRow(name, own_title(study.robot(name).title), use, said, cells, _changed_text(own.values()))


def _use(table: str, head: Head | None, failed: Sequence[str]) -> tuple[str, str]:
    """What to do with a robot's table: a word for its colour, and a few for its reader."""
    finding = head.finding if head else None
    if table == "fail":
        same_arm = is_one(finding, "validation.defined_otherwise")
        return "never", tr("correct it first") if same_arm else tr("never use")
    if failed:
        return "measure", tr("see {stages}", stages=joined(failed, ", "))
    if table == "pass":
        return "use", tr("confirmed")
    if table == "not_examined":
        return "measure", tr("not examined yet")
    if table == "caution" and is_one(finding, "validation.left_open") and not finding.contradiction:
        settled = [part.settled or part.up_to_signs for part in finding.parts if part.part == "geometry"]
        if any(settled):  # by independent documents, of lengths and twists
            return "plan", tr("plan only")
    return "measure", tr("measure first")


def _cell(verdict: StageVerdict, heads: Mapping[str, Head], stored: Results) -> StageCell:
    """A stage's number; of a table that evidence contradicts it counts for nothing."""
    stage, head = verdict.stage, heads.get(verdict.stage)
    if head is None or head.status == "not_computed":
        return StageCell(stage, "not_computed", "–", tr("not computed"), head.text if head else "")
    if head.no_verdict:
        return StageCell(stage, "no_verdict", "", tr("wrong table"))
    value, note = glance(stored[stage].results)
    if verdict.said_by:
        note = tr("see {stages}", stages=tr(PAGES[verdict.said_by]))
    return StageCell(stage, head.sign, value, note, head.text)


def _picture(study: Study, drawn: Sequence[RobotRow], stored: Mapping[str, Results]) -> str:
    """The arm that may be relied on, with its voids, and over it the wrong one; without what they reach where that was
    not computed."""
    robots = [study.robot(entry.name) for entry in drawn]
    reached = [stored[entry.name]["workspace"].results for entry in drawn if "workspace" in stored[entry.name]]
    wrong = drawn[-1].use == "never"
    if len(reached) == len(drawn) and all(isinstance(each, WorkspaceResults) for each in reached):
        floor = floor_of(study.scene(drawn[0].name, "trajectory"))
        return labelled([*zip(robots, reached)], floor and 1000 * floor, wrong, WIDE)
    arms = [seen_arm(robot, own_title(robot.title), "") for robot in robots]
    return side_view([*arms[:-1], replace(arms[-1], kind="wrong") if wrong else arms[-1]], ratio=WIDE)


def _steps(chosen: RobotRow, stored: Results) -> list[tuple[str, str]]:
    """What to confirm before the real arm moves, each with the place on the validation's page that says how."""
    results = stored["validation"].results if "validation" in stored else None
    address = f"{chosen.name}/validation.html"
    if not isinstance(results, ValidationResults):
        return [(tr("Validate the table."), address)]
    return [(row.name, address + row.address) for row in to_confirm(results.summary.evidence)]


def _tiles(study: Study, entries: Sequence[RobotRow], doubtful: str, stored: Mapping[str, Results]) -> list[Any]:
    """Which numbers are wrong, which paths fail, where the tray goes: as far as the study asks."""
    trusted = [entry.name for entry in entries if entry.use != "never"]
    found = [
        table_tile(doubtful, stored[doubtful]),
        *(
            motions_tile(study, name, stored[name][stage])
            for stage in ("trajectory", "programs")
            if (name := first_with(stage, trusted, stored))
        ),
        tray_tile(study, name, stored[name]) if (name := first_with("workspace", trusted, stored)) else None,
    ]
    return [tile for tile in found if tile]


def _write_marks(entries: Sequence[RobotRow], found: str, file: Path) -> None:
    """What pages need of all: what each stage of each robot came to, for marks in headers, and what is found where."""
    marks = {entry.name: {cell.stage: cell.status for cell in entry.cells if cell} for entry in entries}
    write_text(file, f'globalThis.MARKS = {json.dumps(marks, sort_keys=True)};\nglobalThis.PLACES = "{found}";\n')
