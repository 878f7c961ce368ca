"""Workspace page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from markupsafe import Markup

from er3a.collision.scene import Scene
from er3a.pipeline.language import tr
from er3a.pipeline.messages.dynamics import payload_text
from er3a.pipeline.messages.numbers import at_least, at_most, fixed, number
from er3a.pipeline.messages.say import bracketed, joined, say, sentence, word
from er3a.pipeline.messages.workspace import VOID_KINDS
from er3a.pipeline.player.player import drawing_head
from er3a.pipeline.results import Stored, is_computed, read_stage
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.workspace import model
from er3a.pipeline.stages.workspace.page import workspace_figures
from er3a.pipeline.stages.workspace.page.capability_section import capability_context
from er3a.pipeline.stages.workspace.page.tray import Placing, placing_of
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.page import Picture, render_stage
from er3a.robots.robot import Robot


def report(study: Study, stored: Stored[model.WorkspaceResults], output: Path) -> None:
    """Render the workspace page of a robot from its results."""
    robot, results = study.robot(stored.robot), stored.results
    summary, scene = results.summary, study.scene(stored.robot, "capability")
    contradicted = stored.rests_on.get("validation") == "fail"
    placing = None if contradicted else placing_of(study, stored)
    context = _context(robot, results, scene, placing, _payload(study, stored) if placing else "")
    if contradicted:
        context |= dict.fromkeys(("nowhere", "tray_line"), sentence("box.contradicted"))
    render_stage(
        study,
        stored,
        output,
        pocket_mm=3000 * summary.pocket_block_m,
        turning=workspace_figures.in_space(robot, results, scene),
        drawing_head=drawing_head(),
        void_rows=[_void_row(n, void) for n, void in enumerate(summary.voids, start=1)],
        wide=100 * summary.proof.width,
        **context,
    )


def _payload(study: Study, stored: Stored[model.WorkspaceResults]) -> str:
    """What is known of the payload at the tray, from the results of the stage dynamics beside these."""
    folder = stored.folder.parent / "dynamics" if stored.folder else None
    summary = read_stage(folder, STAGES["dynamics"]).results.summary if folder and is_computed(folder) else None
    lead, _ = payload_text(summary, study.robot(stored.robot))
    there = tr("What the arm can carry at the tray was not examined.")
    if summary is None:
        return joined([lead, there], " ")
    return Markup('{} <a href="dynamics.html#payload">{}</a>').format(lead, there)


def _context(
    robot: Robot, results: model.WorkspaceResults, scene: Scene | None, placing: Placing | None, payload: str
) -> dict[str, Any]:
    summary = results.summary
    return capability_context(robot, results, scene, placing, payload) | {
        "section": Picture(
            workspace_figures.sections(robot, results),
            tr("Sections across the slide of joint 1: density of the samples, and proven cells")
            if summary.proof.bars
            else tr("Side sections about axis 1: density of the samples, and proven cells"),
            _section_caption(summary),
        ),
        "slices": Picture(
            workspace_figures.slices(results), tr("Three level slices of the proof"), _slices_caption(summary)
        ),
    }


def _void_row(row: int, void: model.VoidSummary) -> list[str]:
    low, high = 1000 * void.volume_m3.lower, 1000 * void.volume_m3.upper
    return [
        str(row),
        bracketed(word("workspace.void_kind", VOID_KINDS, void.kind), tr("shoulder") if void.holds_shoulder else ""),
        _litres(low, high),
        *(
            ", ".join(fixed(1000 * value, 0) for value in corner)
            for corner in (void.centroid_m, void.low_m, void.high_m)
        ),
        say(void.cause),
    ]


def _litres(low: float, high: float) -> str:
    """Bounds of a volume in litres, rounded outwards."""
    return tr("{low} to {high}", low=at_least(low, "L"), high=at_most(high, "L"))


def _section_caption(summary: model.WorkspaceSummary) -> str:
    return tr(
        "What is empty on the right is proven unreachable all around (along a slide: all along); blank cells on the "
        "left were merely not sampled. Of {checked} recorded samples, {inside} lie in a cell proven unreachable.",
        checked=number(summary.proof.points_checked),
        inside=summary.proof.points_in_empty_cells,
    )


def _slices_caption(summary: model.WorkspaceSummary) -> str:
    enclosed = len(summary.enclosed_voids)
    pockets = len(summary.voids) - enclosed
    return tr(
        "In the hull: {voids}, {pockets}. Every point of the blue area is reached; place nothing outside it.",
        voids=sentence("workspace.voids", count=enclosed),
        pockets=sentence("workspace.pockets", count=pockets),
    )
