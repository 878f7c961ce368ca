"""The page of the vision stage."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from er3a.files.hand_eye_file import HandEyeFile
from er3a.files.scene_file import load_scene
from er3a.files.vision_file import load_vision
from er3a.files.yaml_file import load
from er3a.pipeline.messages.hand_eye import correction_verdict
from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.messages.say import joined, listed, say, word
from er3a.pipeline.messages.vision import FIGURES, METHODS, direction_word, pose_words
from er3a.pipeline.player.player import Mark, PlayedEvent, PlayedMotion, player, player_style
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.trajectory.entry import TrajectorySettings
from er3a.pipeline.stages.vision.model import (
    CalibrationResult,
    GraspPrograms,
    ObjectResult,
    PoseEstimate,
    TableResult,
    TouchResult,
    VisionResults,
)
from er3a.pipeline.stages.vision.vision_figures import image_picture, map_picture, residual_picture
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.numbers import fixed, number
from er3a.pipeline.viewing.page import head_of, render, run_command, text_address
from er3a.pipeline.viewing.panel_link import panel_link
from er3a.programs.arm_joints import WORDS, not_written
from er3a.vision.table_corrections import NoCorrections

NEARLY_HALF_TURN = 170.0
POINTER_M = 0.15
WAYS = {"move": N_("move to the approach"), "approach": N_("approach"), "retreat": N_("retreat")}
AXES = ("x", "y", "z")
PARTS = {
    "camera": N_("camera's noise in one reading"),
    "calibration": N_("calibration"),
    "repeatability": N_("arm's repeatability"),
    "table": N_("arm's table"),
    "together": N_("together"),
}


def report(study: Study, stored: Stored[VisionResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, results, summary = stored.robot, stored.results, stored.results.summary
    found, scene = summary.calibration, study.scene(name, stored.stage)
    robot = study.robot(name)
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        head=head_of(stored, FIGURES),
        command=run_command(study, f"{name}/vision.html"),
        robot=robot,
        robot_pages=study.pages(name),
        found=found,
        poses=_poses(found) if found else [],
        suspects=listed((*found.suspects, *found.open_tilts)) if found else [],
        warnings=listed(found.warnings) if found else [],
        methods=_methods(found) if found else [],
        disagreement=_disagreement(found) if found else "",
        directions=_directions(found) if found else [],
        corrections=_corrections(found.table) if found and isinstance(found.table, TableResult) else [],
        held=_held(found.table) if found else [],
        corrected=_corrected(found.table) if found and isinstance(found.table, TableResult) else "",
        touched=_touched(found.touch) if found and found.touch else [],
        residuals=residual_picture(results.samples, found) if found else None,
        images=image_picture(results.corners, _image_folder(study, name)) if len(results.corners) else None,
        map=map_picture(results.error_map, summary.objects) if len(results.error_map) else None,
        overview=[_overview(each) for each in summary.objects],
        grasps=[_grasp(each) for each in summary.objects if each.grasp],
        programs=_programs(results.programs),
        unwritten=[WORDS[each] for each in study.section(TrajectorySettings).programs if not_written(each, robot)],
        errors=[_errors(each) for each in summary.objects if each.error_mm],
        error_columns=[tr("Object"), *(f"{word('vision.part_of_error', PARTS, part)}>" for part in PARTS)],
        player=player(robot, _motions(results), load_scene(scene) if scene else None),
        player_style=player_style(),
        next_pose=panel_link(found.next_view.q_deg, _listed(found.next_view.q_deg))
        if found and found.next_view
        else "",
    )


def _image_folder(study: Study, name: str) -> Path:
    """Where the table of samples stands, beside which its images are."""
    file = Path(str(study.entry(name).vision))
    head = file.parent / load_vision(file).calibration
    return (head.parent / str(load(HandEyeFile, head).samples)).parent


def _programs(rows: GraspPrograms) -> list[tuple[str, list[tuple[str, str]]]]:
    """Of each object its programs: the file's name, and the data address of its text."""
    found: dict[str, list[tuple[str, str]]] = {}
    for target, file, text in zip(rows.target.tolist(), rows.file.tolist(), rows.text.tolist()):
        found.setdefault(target, []).append((file, text_address(text)))
    return list(found.items())


def _motions(results: VisionResults) -> list[PlayedMotion]:
    """The way to each object grasped and away from it, with a line that points at the object."""
    motions = []
    for each in results.summary.objects:
        rows = results.ways.take(results.ways.target == each.name)
        if each.grasp is None or not len(rows):
            continue
        parts = [(part, rows.t_s[rows.part == part]) for part in dict.fromkeys(rows.part.tolist())]
        events = [PlayedEvent(float(own[0]), float(own[-1]), tr(WAYS[part]), "plain") for part, own in parts]
        x, y, z = (value / 1000 for value in each.xyz_mm)
        mark = Mark(0.0, float(rows.t_s[-1]), (x, y, z), (x, y, z + POINTER_M), each.name)
        text = tr("{grasp}, turned by {turn} deg", grasp=each.grasp.grasp, turn=fixed(each.grasp.turn_deg, 0))
        motions.append(PlayedMotion(each.name, text, rows.t_s, np.radians(rows.q_deg), events, [mark]))
    return motions


def _listed(values: Iterable[float], digits: int = 1) -> str:
    return ", ".join(fixed(value, digits) for value in values)


def _poses(found: CalibrationResult) -> list[tuple[str, str, list[list[str]]]]:
    """Title, quaternion and rows of both poses with intervals."""
    both = zip(pose_words(found.setup), (found.hand_eye, found.board))
    return [(title, _listed(pose.quaternion_wxyz, 6), _pose_rows(pose)) for title, pose in both]


def _pose_rows(pose: PoseEstimate) -> list[list[str]]:
    shifts = [
        [f"{axis} (mm)", fixed(value, 3), f"± {fixed(half, 3)}"]
        for axis, value, half in zip(AXES, pose.xyz_mm, pose.half_width_mm)
    ]
    names = (tr("roll"), tr("pitch"), tr("yaw"))
    turns = [
        [f"{name} (°)", fixed(value, 4), tr("± {half} about {axis}", half=fixed(half, 4), axis=axis)]
        for name, value, half, axis in zip(names, pose.rpy_deg, pose.half_width_deg, AXES)
    ]
    return [*shifts, *turns]


def _methods(found: CalibrationResult) -> list[list[str]]:
    rows = [[tr("maximum likelihood"), "", "", "", fixed(_rms(found), 3)]]
    for each in found.methods:
        numbers = (each.apart_mm, each.apart_deg, each.beyond, each.rms_mm)
        cells = [tr("fails") if value is None else fixed(value, 3) for value in numbers]
        rows.append([METHODS[each.method], *cells])
    return rows


def _rms(found: CalibrationResult) -> float:
    return found.directions[0].rms_mm or 0.0


def _disagreement(found: CalibrationResult) -> str:
    off = [METHODS[each.method] for each in found.methods if each.beyond is not None and each.beyond > 1]
    if not off:
        return tr(
            "All closed-form methods are within the 95 % intervals of the maximum-likelihood pose: the choice "
            "hardly matters."
        )
    why = (
        tr(
            "Some motions rotate by nearly 180 deg, where the smallest error flips the sign of quaternions and "
            "axes: this affects Tsai, Horaud and Daniilidis most."
        )
        if found.greatest_turn_deg > NEARLY_HALF_TURN
        else ""
    )
    weights = tr(
        "Outside the 95 % intervals: {names}. Closed-form methods weight all samples and coordinates equally, "
        "and most solve for the rotation first, so its error enters the position; the maximum-likelihood pose "
        "weights each coordinate by its standard deviation.",
        names=", ".join(off),
    )
    return joined([weights, why], " ")


def _directions(found: CalibrationResult) -> list[list[str]]:
    return [
        [
            direction_word(each),
            tr("fails") if each.rms_mm is None else number(each.rms_mm, 3),
            tr("fails") if each.rms_deg is None else number(each.rms_deg, 3),
            say(each).partition(": ")[2],
        ]
        for each in found.directions
    ]


def _corrections(found: TableResult) -> list[list[str]]:
    return [
        [
            each.entry,
            f"{fixed(each.nominal, 3)} {each.unit}",
            fixed(each.correction, 4),
            f"± {fixed(each.half_width, 4)}",
            tr("differs") if abs(each.correction) > each.half_width else "",
        ]
        for each in found.entries
    ]


def _held(found: TableResult | NoCorrections | None) -> list[str]:
    """Why entries keep their values, or why none is corrected."""
    if found is None:
        return []
    return [say(found)] if isinstance(found, NoCorrections) else listed(found.held)


def _corrected(found: TableResult) -> str:
    return correction_verdict(found.probability, found.scatter_before, found.scatter)


def _touched(found: TouchResult) -> list[list[str]]:
    return [
        [str(k + 1), *(f"{fixed(d, 2)} ± {fixed(h, 2)}" for d, h in zip(point.difference_mm, point.half_width_mm))]
        for k, point in enumerate(found.points)
    ]


def _overview(each: ObjectResult) -> list[str]:
    if each.grasp:
        parts = {"grasp": each.grasp.grasp, "turn": fixed(each.grasp.turn_deg, 0)}
        outcome = tr("{grasp}, turned by {turn} deg", **parts)
        success = f"{100 * each.grasp.probability:.1f} ± {196 * each.grasp.deviation:.1f} %"
    else:
        outcome, success = say(each.refusal), tr("none")
    counts = tr("{poses} poses, {solutions} solutions", poses=each.poses, solutions=each.solutions)
    return [each.name, _listed(each.xyz_mm), outcome, success, counts]


def _grasp(each: ObjectResult) -> list[str]:
    grasp = each.grasp
    assert grasp is not None
    near = tr("none") if grasp.clearance_mm is None else fixed(grasp.clearance_mm, 0)
    return [
        each.name,
        _listed(grasp.tool_xyz_mm),
        panel_link(grasp.q_before_deg, _listed(grasp.q_before_deg)),
        panel_link(grasp.q_deg, _listed(grasp.q_deg)),
        f"{near} ({say(grasp.nearest)})" if grasp.nearest else near,
        tr("straight") if not grasp.corners else tr("planned, {corners} corners", corners=grasp.corners),
        fixed(grasp.duration_s, 1),
        fixed(grasp.limit_margin_deg, 0),
        fixed(grasp.singular_value, 2),
    ]


def _errors(each: ObjectResult) -> list[str]:
    mm, deg = each.error_mm, each.error_deg
    assert mm is not None
    assert deg is not None
    return [each.name, *(f"{fixed(getattr(mm, part), 2)} mm, {fixed(getattr(deg, part), 2)}°" for part in PARTS)]
