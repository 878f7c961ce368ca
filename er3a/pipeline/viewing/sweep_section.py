"""The index page's section about a sweep: its variants against the value that is varied, as a plot and a table."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from er3a.pipeline.messages.language import N_, own_title, tr
from er3a.pipeline.results import Stored, is_computed, read_stage
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.workspace.model import VoidSummary, WorkspaceSummary
from er3a.pipeline.study import Study
from er3a.pipeline.sweeps import ENTRIES, entry_label
from er3a.pipeline.viewing.figures import new_figure
from er3a.pipeline.viewing.numbers import number
from er3a.pipeline.viewing.page import PAGES, Picture, status_word
from er3a.pipeline.viewing.palette import HIGHLIGHT, MODEL, MUTED, REFERENCE, VERDICTS

MARKERS = {"pass": "o", "caution": "^", "fail": "X", "conflict": "D", "no_reference": "s", "not_computed": "x"}
SHORT_TABLE = 12


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


def sweep_sections(study: Study, results: Path) -> list[dict[str, Any]]:
    """What the template shows of each sweep of the study whose variants have all been computed."""
    return [_section(study, name, results) for name in study.sweeps if _is_whole(study, name, results)]


def _is_whole(study: Study, name: str, results: Path) -> bool:
    variants = [variant.name for variant in study.variants.values() if variant.sweep == name]
    return all(is_computed(results / variant / stage) for variant in variants for stage in study.stages(variant))


def _section(study: Study, name: str, results: Path) -> dict[str, Any]:
    sweep = study.sweeps[name]
    variants = [variant for variant in study.variants.values() if variant.sweep == name]
    points = [
        Point(v.name, v.value, {stage: read_stage(results / v.name / stage, STAGES[stage]) for stage in sweep.stages})
        for v in variants
    ]
    content, entry = study.table(sweep.robot), study.entry(sweep.robot)
    own = variants[0].replaced(content, entry.tool or content.tool)
    what, unit = entry_label(ENTRIES[sweep.vary]), ENTRIES[sweep.vary].unit
    ends = {"low": _plain(min(sweep.resolved)), "high": _plain(max(sweep.resolved))}
    title = tr(
        "{robot}: {what} from {low} to {high} {unit}", robot=own_title(content.title), what=what, unit=unit, **ends
    )
    columns, rows = _table(points, what, unit, sweep.stages)
    return {
        "name": name,
        "title": title,
        "count": len(points),
        "picture": Picture(
            _figure(points, f"{what} ({unit})", own, sweep.stages),
            tr("Results of {count} variants against {what}", count=len(points), what=what),
            _caption(points, own, unit, "workspace" in sweep.stages),
        ),
        "columns": columns,
        "rows": rows,
        "open": len(points) <= SHORT_TABLE,
    }


def _computed(points: list[Point]) -> list[Point]:
    """The variants whose workspace was computed."""
    return [point for point in points if point.stages["workspace"].status != "not_computed"]


def _figure(points: list[Point], label: str, own: float | None, stages: list[str]) -> Figure:
    drawers = {_draw_volume: 2.4, _draw_litres: 1.5, _draw_numbers: 1.3} if "workspace" in stages else {}
    heights = [*drawers.values(), 0.35 + 0.25 * len(stages)]
    figure, axes = new_figure(
        len(heights), 1, height=1.0 + sum(heights), sharex=True, squeeze=False, height_ratios=heights
    )
    for drawer, panel in zip(drawers, axes[:, 0]):
        drawer(panel, _computed(points))
    _draw_verdicts(axes[-1, 0], points, stages)
    for panel in axes[:, 0]:
        if own is not None:
            panel.axvline(own, color=MUTED, linestyle=":", zorder=0)
    axes[-1, 0].set_xlabel(label)
    return figure


def _draw_volume(axes: Axes, points: list[Point]) -> None:
    volumes = [point.workspace.volume_m3 for point in _in_order(points)]
    x = [point.value for point in _in_order(points)]
    low, high = ([getattr(volume, bound) for volume in volumes] for bound in ("lower", "upper"))
    axes.fill_between(x, low, high, color=MODEL, alpha=0.25, linewidth=0, label=tr("proven bounds"))
    axes.vlines(x, low, high, color=MODEL, linewidth=1)
    axes.plot(x, [volume.estimate for volume in volumes], ".-", color=MODEL, linewidth=0.8, label=tr("estimate"))
    axes.set_ylabel(tr("reached volume (m³)"))
    axes.legend(loc="best")


def _draw_litres(axes: Axes, points: list[Point]) -> None:
    low, high = ([point.litres(bound) for point in points] for bound in ("lower", "upper"))
    x = [point.value for point in points]
    axes.vlines(x, low, high, color=REFERENCE, linewidth=3)
    axes.plot(x, low, "_", color=REFERENCE)
    axes.set_ylim(bottom=0)
    axes.set_ylabel(tr("enclosed voids (L)"))


def _draw_numbers(axes: Axes, points: list[Point]) -> None:
    x = [point.value for point in points]
    numbers = [len(point.enclosed) for point in points]
    pockets = [len(point.workspace.voids) - count for point, count in zip(points, numbers)]
    axes.plot(x, pockets, "o", color=MUTED, markerfacecolor="none", label=tr("open pockets"))
    axes.plot(x, numbers, ".", color=HIGHLIGHT, label=tr("enclosed"))
    axes.yaxis.get_major_locator().set_params(integer=True)  # type: ignore[call-arg]
    axes.set_ylim(bottom=-0.5, top=max([*pockets, *numbers, 1]) + 0.5)
    axes.set_ylabel(tr("voids"))
    axes.legend(loc="best")


def _draw_verdicts(axes: Axes, points: list[Point], stages: list[str]) -> None:
    rows = list(reversed(stages))
    seen = set()
    for point in points:
        for row, stage in enumerate(rows):
            status = point.stages[stage].status
            label = None if status in seen else status_word(status)
            seen.add(status)
            axes.plot(point.value, row, MARKERS[status], color=VERDICTS[status], linestyle="none", label=label)
    axes.set_yticks(range(len(rows)), [tr(PAGES[stage]) for stage in rows])
    axes.set_ylim(-0.6, len(rows) - 0.4)
    axes.grid(False, axis="y")
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=len(seen), borderpad=0)


def _caption(points: list[Point], own: float | None, unit: str, workspace: bool) -> str:
    said = []
    if workspace and _computed(points):
        ordered = _in_order(_computed(points))
        text = N_(
            "Proven reached volume: {low_1} to {high_1} m³ at {value_1}, {low_2} to {high_2} m³ at {value_2} {unit}."
        )
        parts = {"unit": unit}
        for end, point in enumerate((ordered[0], ordered[-1]), start=1):
            volume = point.workspace.volume_m3
            parts |= {f"low_{end}": number(volume.lower), f"high_{end}": number(volume.upper)}
            parts[f"value_{end}"] = _plain(point.value)
        said.append(tr(text, **parts))
    if own is not None:
        said.append(tr("Dotted: the robot's own value, {value} {unit}.", value=_plain(own), unit=unit))
    return " ".join(said)


def _plain(value: float) -> str:
    """A varied value with the digits that it is written with."""
    return f"{value:.9g}".replace("-", "−")


def _in_order(points: list[Point]) -> list[Point]:
    return sorted(points, key=lambda point: point.value)


def _table(points: list[Point], what: str, unit: str, stages: list[str]) -> tuple[list[str], list[list[Any]]]:
    columns = [tr("variant"), f"{what} ({unit})>", *(tr(PAGES[stage]) for stage in stages)]
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
    if not _computed([point]):
        return ["–"] * 6
    summary = point.workspace
    return [
        number(summary.volume_m3.lower),
        number(summary.volume_m3.upper),
        str(len(point.enclosed)),
        number(point.litres("lower"), 3),
        str(len(summary.voids) - len(point.enclosed)),
        number(1000 * summary.reach_m.furthest_from_axis),
    ]


def _verdict(point: Point, stage: str) -> Markup:
    status = point.stages[stage].status
    return Markup('<a href="{}/{}.html"><span class="badge {}">{}</span></a>').format(
        point.name, stage, status, status_word(status)
    )
