"""The pages over all robots: the index (robots x stages, verdicts and key figures) and the comparison of two.

Variants of a sweep stand in the section of their sweep only.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.messages.decision import decision
from er3a.pipeline.messages.language import tr
from er3a.pipeline.results import AbsentResults, Provenance, is_computed, read_stage, result_records
from er3a.pipeline.stages.registry import STAGES, all_messages
from er3a.pipeline.stages.validation.validation_findings import LeftOpen
from er3a.pipeline.stages.workspace.model import WorkspaceResults
from er3a.pipeline.study import Study
from er3a.pipeline.verdicts import NOT_EXAMINED, read_verdicts
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.comparison import write_compare
from er3a.pipeline.viewing.heads import stage_head
from er3a.pipeline.viewing.instead import table_instead
from er3a.pipeline.viewing.junit import write_junit
from er3a.pipeline.viewing.sweep_section import sweep_sections
from er3a.pipeline.viewing.thumbnail import thumbnail

SHOWN_FIGURES = 3
FIRST = ("fail", "conflict", "caution", "no_reference", "not_computed", "pass")  # what is open stands first


def write_index(study: Study, results: Path, folder: Path) -> None:
    """Render ``index.html``, ``compare.html`` and ``junit.xml`` from the results of all robots and stages.

    Stages that have not been computed yet are named as such.
    The comparison offers the robots that are written in the study, not the variants that sweeps make of them.
    """
    workspaces = {name: _workspace(results / name / "workspace") for name in study.robots}
    robots = [
        _entry(study, name, results / name) | {"thumbnail": thumbnail(study.robot(name), workspaces[name])}
        for name in study.robots
    ]
    page.render(
        Path(__file__).with_name("index.html.j2"),
        folder / "index.html",
        robots=robots,
        questions={stage.name: stage.question for stage in STAGES.values()},
        shown_figures=SHOWN_FIGURES,
        sweeps=sweep_sections(study, results),
        command=page.run_command(study, "index.html"),
        provenance=Provenance(
            inputs=result_records(results, study.names),
            code=code_digest(__name__, *all_messages()),
            seed=study.seed,
        ),
    )
    write_compare(study, results, workspaces, folder / "compare.html")
    write_junit(read_verdicts(study, results), folder / "junit.xml")


def _workspace(folder: Path) -> WorkspaceResults | AbsentResults | None:
    """What the workspace stage found; None if it has not been computed yet."""
    return read_stage(folder, STAGES["workspace"]).results if is_computed(folder) else None


def _entry(study: Study, name: str, results: Path) -> dict[str, Any]:
    """What the index shows of a robot."""
    expected = study.entry(name).expect
    stages = [stage for stage in study.stages(name) if stage in STAGES]
    heads = {stage: stage_head(results / stage, STAGES[stage]) for stage in stages if is_computed(results / stage)}
    failed = [
        tr(STAGES[stage].title)
        for stage, head in heads.items()
        if head.status == "fail" and expected.get(stage) != "fail"  # one that is expected is a demonstration
    ]
    table = heads["validation"].status if "validation" in heads else NOT_EXAMINED
    shown = sorted(heads.values(), key=lambda head: FIRST.index(head.status))
    return {
        "robot": study.robot(name),
        "table": table,
        "heads": [(head, *page.led(head.text)) for head in shown],
        "counts": [(status, sum(head.status == status for head in shown)) for status in FIRST],
        "expected": expected,
        "not_examined": [tr(STAGES[stage].title) for stage in stages if stage not in heads],
        "decision": decision(
            table, failed, table_instead(study, name, results.parent), _geometry(heads.get("validation"))
        ),
    }


def _geometry(head: page.Head | None) -> tuple[int, int] | None:
    """How many of how many entries of a table's geometry are settled, where only part of it is."""
    if head is None or not isinstance(head.finding, LeftOpen):
        return None
    return next(((part.settled, part.entries) for part in head.finding.parts if part.part == "geometry"), None)
