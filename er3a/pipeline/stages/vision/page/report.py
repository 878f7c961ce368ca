"""The page of the vision stage."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Literal

import numpy as np
from markupsafe import Markup
from matplotlib.ticker import MaxNLocator

from er3a.files.hand_eye_file import HandEyeFile, grey_image
from er3a.files.vision_file import VisionFile, load_vision
from er3a.files.yaml_file import load
from er3a.finding import Finding
from er3a.pipeline.language import N_, own_title, tr, with_unit
from er3a.pipeline.messages.numbers import decimals_of_spreads, fixed, number
from er3a.pipeline.messages.say import bracketed, joined, listed, say, word
from er3a.pipeline.messages.vision import MENDING, pose_words
from er3a.pipeline.player.motions import address_of
from er3a.pipeline.player.player import drawing_head, player
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.vision import model
from er3a.pipeline.stages.vision.page.played import (
    grasp_moment,
    motions,
    moved_name,
    moved_text,
    refusal_text,
    seen_shapes,
)
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, Fix, Group, ListRow, Part
from er3a.pipeline.viewing.figures import SIDE, new_figure
from er3a.pipeline.viewing.page import (
    Picture,
    panel_link,
    render_stage,
)
from er3a.pipeline.viewing.palette import HIGHLIGHT, INK, MODEL

MAX_IMAGES = 9
WIDEST_PX = 480
ARROW_PX = 30.0
CUT = 0.9  # of the height of a figure, where bars end that are longer than it


def residual_picture(rows: model.SampleRows, found: model.CalibrationResult) -> Picture:
    """Length of each sample's residual of position; one that was left out is cut off, and named."""
    size, mean, order = np.linalg.norm(rows.residual_mm, axis=1), 1.6 * found.camera_mm, np.arange(1, len(rows) + 1)
    figure, ax = new_figure(width=SIDE, height=2.2)
    ax.bar(order[rows.used], size[rows.used], color=MODEL, label=tr("used"))
    ax.axhline(mean, color=INK, linewidth=1, linestyle="--", label=tr("expected mean"))
    top = 1.3 * max(mean, size[rows.used].max(initial=0.0))
    cut = size > top  # these end in an arrow
    drawn = np.where(cut, CUT * top, size)
    ax.bar(order[~rows.used], drawn[~rows.used], color=HIGHLIGHT, label=tr("left out"))
    ax.plot(order[cut], drawn[cut], "^", color=HIGHLIGHT, markersize=11)
    for k in np.flatnonzero(cut):
        side = "right" if 2 * k > len(rows) else "left"
        text = joined([rows.sample[k], with_unit(number(size[k], 3), "mm")], ": ")
        shift = (-8 if side == "right" else 8, -4)
        ax.annotate(text, (k + 1, top), shift, textcoords="offset points", ha=side, va="top", color=HIGHLIGHT)
    ax.set_ylim(0.0, top)
    ax.set_ylabel(tr("position (mm)"))
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_xlabel(tr("sample"))
    ax.legend(ncols=3, loc="lower left", bbox_to_anchor=(0, 1))
    ax.set_xlim(0.4, len(rows) + 0.6)
    caption = tr("Calibration: residual of each sample.")
    return Picture(figure, caption, caption)


def image_picture(rows: model.CornerRows, folder: Path) -> Picture:
    """The images with the largest residuals: corners detected, and arrows to where arm and calibration put them."""
    off = rows.by_arm_px - rows.seen_px
    size = {
        name: float(np.sqrt((off[rows.image == name] ** 2).sum(axis=1).mean())) for name in dict.fromkeys(rows.image)
    }
    shown = sorted(size, key=lambda name: -size[name])[:MAX_IMAGES]
    columns = min(3, len(shown))
    lines = -(-len(shown) // columns)
    figure, axes = new_figure(lines, columns, height=2.6 * lines, squeeze=False)
    usual = float(np.median(list(size.values())))
    scale = max(1.0, float(f"{ARROW_PX / max(usual, 1e-3):.1g}"))
    for ax, name in zip(axes.ravel(), shown):
        own = rows.image == name
        picture = grey_image(folder / name)
        step = max(1, picture.shape[1] // WIDEST_PX)
        height, width = picture.shape
        frame = (-0.5, width - 0.5, height - 0.5, -0.5)
        ax.imshow(picture[::step, ::step], cmap="gray", vmin=0, vmax=255, extent=frame, rasterized=True)
        seen, arrow = rows.seen_px[own], scale * off[own]
        ax.plot(*seen.T, ".", color=MODEL, markersize=3, label=tr("detected"))
        ends = np.stack([seen, seen + arrow, np.full_like(seen, np.nan)], axis=1).reshape(-1, 2)
        ax.plot(*ends.T, color=HIGHLIGHT, linewidth=1, label=tr("to the reprojected corner"))
        left = "" if rows.used[own].all() else tr(", left out")
        ax.set_title(f"{rows.sample[own][0]}: {fixed(size[name], 2)} px{left}", fontsize=8)
        ax.set_xlim(-0.5, width - 0.5)
        ax.set_ylim(height - 0.5, -0.5)
        ax.set_aspect("equal")
        ax.set_axis_off()
    for ax in axes.ravel()[len(shown) :]:
        ax.set_axis_off()
    axes[0, 0].legend(loc="lower left", fontsize=6)
    caption = tr(
        "Detected corners with lines towards their position by arm and calibration, magnified {scale:g} times; "
        "the {shown} of {count} images with the greatest residuals. Lines all in one direction: wrong pose of arm or "
        "board. Lines circling a point: board detected the wrong way round. Short lines in all directions: noise.",
        scale=scale,
        shown=len(shown),
        count=len(size),
    )
    return Picture(figure, tr("Images of the board with detected and reprojected corners"), caption)


def _least_sure(objects: Iterable[model.ObjectResult]) -> model.ObjectResult | None:
    """The object whose grasp succeeds least often; None where nothing is grasped."""
    sure = [(each.grasp.probability, k, each) for k, each in enumerate(objects) if each.grasp and each.error_mm]
    return min(sure)[2] if sure else None


def _errors(each: model.ObjectResult | None, task: VisionFile) -> list[Group]:
    """By how much the tool misses an object, and by what cause: bars to one scale, with the gripper's tolerance."""
    if each is None or not each.error_mm:
        return []
    limit = min(task.gripper.tolerance_mm)
    mm, rows = each.error_mm, list[ListRow]()
    scale = 1.1 * max(limit, mm.together)
    for part, cause in PARTS.items():
        off = getattr(mm, part)
        mark: Literal["pass", "fail", "none"] = "none" if rows else "pass" if off <= limit else "fail"
        text = f"{fixed(off, 2)} mm, {fixed(getattr(each.error_deg, part), 2)}°"
        parts = [Part(0.0, off / scale, mark), Part(limit / scale, 1.0, "rest")]
        rows.append(ListRow(mark, tr(cause), text, length=1.0, parts=parts))
    turn = min(task.gripper.tolerance_deg)
    allowed = tr("allowed: {limit:g} mm, {turn:g}°", limit=limit, turn=turn)
    title = tr("{name}: 95 % error; {allowed}", name=each.name, allowed=allowed)
    return [Group(title, rows, counted=False)]


RESIDUALS = "#figure-residuals"
AXES = ("x", "y", "z")
PARTS = {
    "together": N_("all together"),
    "camera": N_("camera's noise"),
    "table": N_("D-H table"),
    "calibration": N_("calibration"),
    "repeatability": N_("repeatability"),
}


def report(study: Study, stored: Stored[model.VisionResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, results, summary = stored.robot, stored.results, stored.results.summary
    found, scene = summary.calibration, study.scene(name, stored.stage)
    task = load_vision(str(study.entry(name).vision))
    file = study.scene_file(name, stored.stage)
    robot, answer = study.robot(name), _answer(results, task, file)
    rows = [row for group in answer.shown_groups for row in group.rows]
    first = "fail" if summary.verdict.status == "fail" else "pass"  # else what is not grasped is not to be
    render_stage(
        study,
        stored,
        output,
        answer,
        errors=_errors(_least_sure(summary.objects), task),
        found=found,
        file=file,
        poses=[*zip(pose_words(found.setup), map(_pose_rows, (found.hand_eye, found.board)))] if found else [],
        suspects=listed((*found.suspects, *found.open_tilts, *found.boardless, *found.warnings)) if found else [],
        touched=_touched(found.touch) if found and found.touch else [],
        residuals=residual_picture(results.samples, found) if found else None,
        images=image_picture(results.corners, _image_folder(study, name)) if len(results.corners) else None,
        slides=bool(robot.slides.any()),
        grasps=[_grasp(each) for each in summary.objects if each.grasp],
        player=player(
            robot,
            motions(robot, results, task),
            scene,
            opened=min(rows, key=lambda row: row.mark != first).play if rows else None,
            added=seen_shapes(robot, task, summary),
        ),
        drawing_head=drawing_head(),
    )


def _answer(results: model.VisionResults, task: VisionFile, scene: Path | None) -> Answer:
    """How many objects can be grasped, what that leaves open, and how well the camera's place is known."""
    summary, objects = results.summary, results.summary.objects
    grasped = [each for each in objects if each.grasp]
    caught = sum(not each.grasp and each.outcome == each.expect for each in objects)
    found = summary.calibration
    headline = tr("{count} of {all} objects can be grasped.", count=len(grasped), all=len(objects) - caught)
    if not objects:
        headline = tr("The camera's place is known.") if found else tr("The camera's place is not known.")
    keys, limit, turn = list[tuple[str, str]](), min(task.gripper.tolerance_mm), min(task.gripper.tolerance_deg)
    least = _least_sure(objects)
    if least and least.grasp and least.error_mm:
        made = joined([tr("in 95 % of grasps"), tr("simulated") if found and found.simulated else ""], ", ")
        asked = {"least": 100 * summary.least_success, "limit": limit, "turn": turn}
        allowed = tr("{name}: grasps within {limit:g} mm, {turn:g}° ({least:g} % needed)", name=least.name, **asked)
        keys = [
            (f"{fixed(100 * least.grasp.probability, 1)} %", allowed),
            (tr("{far} off", far=with_unit(fixed(least.error_mm.together, 1), "mm")), made),
        ]
    elif found:
        half = fixed(max(found.hand_eye.half_width_mm), 2)
        place = f"{_listed(found.hand_eye.xyz_mm, 0)} ± {half}"
        keys = [(with_unit(place, "mm"), tr("camera's place, 95 %"))]
    gaps = {gap.reason for check in summary.verdict.missed for gap in check.gaps}
    fix = Fix(tr("describe the gripper: {file}", file=scene), "#carried", False) if "gripper" in gaps else None
    ordered = sorted(objects, key=lambda each: each.grasp.probability if each.grasp else 0.0)
    shown = [_row(each, grasp_moment(results, each), fix) for each in ordered]
    refused = [row for row in shown if row.mark == "fail"]
    groups = [
        Group(tr("Can't be grasped"), refused),
        Group(tr("Can be grasped"), [row for row in shown if row.mark == "pass"]),
    ]
    if found:
        rows = [ListRow("caution", tr("camera"), say(each)) for each in found.warnings]
        if not shown:
            rows += [ListRow("caution", each.sample, _why_left_out(each), RESIDUALS) for each in found.suspects]
        groups.append(Group(tr("Doubts"), rows))
    return Answer(headline, "", "", keys, groups, fix)


def _row(each: model.ObjectResult, moment: tuple[str, float], fix: Fix | None) -> ListRow:
    """An object: how surely it is grasped, else why it is not, and what to do."""
    if each.grasp:
        text = tr("{percent} % succeed", percent=fixed(100 * each.grasp.probability, 1))
        return ListRow("pass", each.name, text, "#objects", moment, fix=fix)
    there = address_of("vision", moved_name(each), 0.0, "objects") if each.moved_to_mm else ""
    return ListRow(
        "fail",
        each.name,
        refusal_text(each),
        "#objects",
        moment,
        fix=Fix(moved_text(each), there),
        meant=each.outcome == each.expect,
    )


def _why_left_out(found: Finding) -> str:
    """Why the calibration does not use a sample, in few words."""
    kind = found.params.get("kind")
    return joined([tr("left out"), word("vision.mending", MENDING, kind) if kind else ""], ": ")


def _image_folder(study: Study, name: str) -> Path:
    """Where the table of samples stands, beside which its images are."""
    file = Path(str(study.entry(name).vision))
    head = file.parent / load_vision(file).calibration
    return (head.parent / load(HandEyeFile, head).samples).parent


def _listed(values: Iterable[float], digits: int = 1) -> str:
    return ", ".join(fixed(value, digits) for value in values)


def _pose_rows(pose: model.PoseEstimate) -> list[list[str]]:
    mm, deg = decimals_of_spreads(pose.half_width_mm), decimals_of_spreads(pose.half_width_deg)
    shifts = [
        [f"{axis} (mm)", fixed(value, mm), f"± {fixed(half, mm)}"]
        for axis, value, half in zip(AXES, pose.xyz_mm, pose.half_width_mm)
    ]
    names = (tr("roll"), tr("pitch"), tr("yaw"))
    turns = [
        [bracketed(name, "°"), fixed(value, deg), tr("± {half} about {axis}", half=fixed(half, deg), axis=axis)]
        for name, value, half, axis in zip(names, pose.rpy_deg, pose.half_width_deg, AXES)
    ]
    return [*shifts, *turns]


def _touched(found: model.TouchResult) -> list[list[str]]:
    return [
        [str(k + 1), *(f"{fixed(d, 2)} ± {fixed(h, 2)}" for d, h in zip(point.difference_mm, point.half_width_mm))]
        for k, point in enumerate(found.points)
    ]


def _grasp(each: model.ObjectResult) -> list[str]:
    grasp = each.grasp
    assert grasp is not None
    near = tr("none") if grasp.clearance_mm is None else fixed(grasp.clearance_mm, 0)
    name = Markup("{}<br><small>{}</small>").format(each.name, own_title(each.note)) if each.note else each.name
    return [
        name,
        tr("{grasp}, turned by {turn}°", grasp=grasp.grasp, turn=fixed(grasp.turn_deg, 0)),
        f"{100 * grasp.probability:.1f} ± {196 * grasp.deviation:.1f} %",
        _listed(grasp.tool_xyz_mm),
        panel_link(grasp.q_before_deg, _listed(grasp.q_before_deg)),
        panel_link(grasp.q_deg, _listed(grasp.q_deg)),
        bracketed(near, say(grasp.nearest)) if grasp.nearest else near,
        fixed(grasp.duration_s, 1),
        fixed(grasp.limit_margin_deg, 0),
        fixed(grasp.singular_value, 2),
    ]
