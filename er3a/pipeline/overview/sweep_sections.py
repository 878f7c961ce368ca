"""The index's sections on sweeps: a table of each sweep's variants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markupsafe import Markup

from er3a.pipeline.language import N_, own_title, tr
from er3a.pipeline.messages.numbers import at_least, at_most, number
from er3a.pipeline.messages.say import bracketed, joined, sentence
from er3a.pipeline.results import THE_CODE, THE_SETTINGS, Stored, is_computed, read_stage
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.workspace.model import VoidSummary, WorkspaceSummary
from er3a.pipeline.study import Study
from er3a.pipeline.sweeps import ENTRIES, entry_label
from er3a.pipeline.viewing.page import PAGES, status_word

MAX_CHANGED = 6  # files that have changed since, and are named
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
