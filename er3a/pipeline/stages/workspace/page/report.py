"""Workspace page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from markupsafe import Markup

from er3a.finding import is_one
from er3a.pipeline.language import tr, with_unit
from er3a.pipeline.messages.dynamics import payload_key, payload_text
from er3a.pipeline.messages.numbers import at_least, at_most, fixed
from er3a.pipeline.messages.say import joined, say
from er3a.pipeline.messages.workspace import millimetres, reaches
from er3a.pipeline.player.player import drawing_head, floor_of
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.workspace import model
from er3a.pipeline.stages.workspace.page import workspace_figures
from er3a.pipeline.stages.workspace.page.capability_section import capability_context
from er3a.pipeline.stages.workspace.page.from_above import from_above
from er3a.pipeline.stages.workspace.page.tray import Placing, found_by, placing_of
from er3a.pipeline.stages.workspace.page.workspace_figures import about, if_normal
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, Fix, Group, ListRow, Mark
from er3a.pipeline.viewing.page import alternative_table, render_stage, whole_sentence
from er3a.robots.robot import Robot

LETTERS = 0.065  # of the reach, in the view from above


def report(study: Study, stored: Stored[model.WorkspaceResults], output: Path) -> None:
    """Render the workspace page of a robot from its results."""
    robot, results = study.robot(stored.robot), stored.results
    summary, scene = results.summary, study.scene(stored.robot, "capability")
    contradicted = stored.withheld
    placing, masses = placing_of(study, stored), found_by(stored, "dynamics")
    known = masses.results.summary if masses else None
    there = tr("What the arm can carry at the tray was not examined.")
    payload = joined([payload_text(known, robot), there], " ")
    trays = [each.tray for each in placing.tried] if placing else []
    settled = stored.table != "unsettled"
    looked = summary.placement is not None and not is_one(summary.placement, "workspace.placement_too_long")
    rows = _tray_as_rows(placing, settled) if looked else []
    answer = _answer(summary, placing, payload_key(known, robot), rows)
    arms = [(robot, results)]
    instead = alternative_table(study, stored.robot, stored.folder) if contradicted else None
    if instead and (right := found_by(stored, "workspace", f"../{instead}")):
        arms.insert(0, (study.robot(instead), right.results))
        far, wrong = (fixed(1000 * each.summary.reach_m.furthest_from_axis, 0) for _, each in arms)
        own, other = (fixed(each.summary.volume_m3.middle, 2) for _, each in arms)
        keys = [(with_unit(own, "m³"), tr("proven, not {wrong} m³", wrong=other))]
        answer = Answer("", tr("The flange reaches {far}, not {wrong} mm.", far=far, wrong=wrong), keys=keys)
    render_stage(
        study,
        stored,
        output,
        answer,
        labelled=_labelled(arms, floor_of(study.scene(instead or stored.robot, "capability")), contradicted),
        trays=[(row, from_above(robot, results, scene, tray, LETTERS), tray.lines) for row, tray in zip(rows, trays)],
        turning=workspace_figures.in_space(robot, results, scene, trays, [row.mark for row in rows]),
        drawing_head=drawing_head(),
        void_rows=[_void_row(n, void) for n, void in enumerate(summary.voids, start=1)],
        **capability_context(robot, results, placing, payload),
    )


def _labelled(
    arms: Sequence[tuple[Robot, model.WorkspaceResults]], floor: float | None, contradicted: bool
) -> Markup | None:
    """The arm in what it reaches, with names, over the floor (m), and where it is contradicted the one to use instead
    before it; None of an arm that slides along its first axis."""
    if any(each.summary.proof.bars or each.summary.is_flat for _, each in arms):
        return None
    floor_mm = None if floor is None else 1000 * (floor - arms[-1][0].base[2, 3])
    return workspace_figures.labelled(arms, floor_mm, contradicted)


def _answer(
    summary: model.WorkspaceSummary, placing: Placing | None, payload: tuple[str, str], rows: Sequence[ListRow]
) -> Answer:
    """How far the arm reaches, its voids, where the tray goes, in ``rows``, and the ``payload``."""
    # The void that the picture shows comes first.
    in_order = sorted(enumerate(summary.voids, 1), key=lambda each: each[1].kind != "enclosed")
    volume, voids = summary.volume_m3, [_void_as_row(*each) for each in in_order]
    said, fix = [whole_sentence(reaches(summary))], None
    if placing and rows[0].mark == "pass":
        said.append(placing.tray.place_text)
        fix = Fix(tr("add the tray and its stand to the scene."), "#tray-1", False)
    keys = [
        (
            with_unit(fixed(volume.middle, 2), "m³"),
            tr("reached: {low} to {high} m³", low=at_least(volume.lower, "m³"), high=at_most(volume.upper, "m³")),
        ),
        payload,
    ]
    groups = Group(tr("Where the tray goes"), rows), Group(tr("Where the tool can't go"), voids)
    frames = [tr("Reach from axis 1, tray in base frame.")]
    if placing and placing.tray.floor:
        low, high = (millimetres([z]) for z in (placing.tray.floor, placing.tray.low[2]))
        frames.append(tr("Stand: z {low} to {high} mm.", low=low, high=high))
    return Answer(joined(said, " "), "", joined(frames, " "), keys, groups, fix)


def _void_as_row(number_: int, void: model.VoidSummary) -> ListRow:
    """A void: which one, how large."""
    note, limits = if_normal(void, about(void)), void.cause.params.get("limits", ())
    if [each.joints for each in limits] == [(1,), (1,)] and limits[0].limit == -limits[1].limit:
        note = tr("{size}: J1 stops at ±{deg:g}°", size=note, deg=abs(limits[0].limit))
    return ListRow("none", workspace_figures.void_name(number_, void), note, f"#hole-{number_}")


def _tray_as_rows(placing: Placing | None, settled: bool) -> list[ListRow]:
    """The best place of the tray on each surface; one row that says so where there is none."""
    if placing is None:
        return [ListRow("caution", tr("nowhere"), tr("no place fits"), "#placement")]
    rows = []
    for number_, tried in enumerate(placing.tried, start=1):
        note = tr("blocks {count} of {all} motions", count=len(tried.hindered), all=placing.passing or 0)
        mark: Mark = "caution" if tried.hindered else "pass" if settled else "no_reference"
        rows.append(ListRow(mark, tried.tray.name, note, f"#tray-{number_}"))
    return rows


def _void_row(row: int, void: model.VoidSummary) -> list[str]:
    return [
        str(row),
        workspace_figures.void_name(row, void),
        workspace_figures.litres(void),
        *map(millimetres, (void.centroid_m, void.low_m, void.high_m)),
        say(void.cause),
    ]
