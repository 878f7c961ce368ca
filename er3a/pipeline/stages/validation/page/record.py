"""The validation recording: the arm steps through the key poses, with the point that each reference states."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import rerun as rr

import er3a.pipeline.messages.validation  # noqa: F401
from er3a.finding import fact
from er3a.pipeline.messages.say import say
from er3a.pipeline.player.motions import Weight
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.validation.model import Checks, KeyPoses, ValidationResults, model_of
from er3a.pipeline.stages.validation.page.diagnosis_section import corrected_robot
from er3a.pipeline.study import Study
from er3a.pipeline.tables import Texts
from er3a.pipeline.viewing.palette import HIGHLIGHT, MODEL, REFERENCE, rgb
from er3a.pipeline.viewing.recording import BRIEFLY_S, GONE, Curves, Logged, Run, escaped, record_stage
from er3a.robots.joint_limits import meant, size_of
from er3a.robots.robot import AUTHORITATIVE_GRADES, Robot

HOLD_S, MOVE_S, STEPS = 2.0, 1.0, 30
MIN_ARROW_MM = 0.1
HEAD, FINDINGS = "# Key poses of {title}\n\n", "\n{findings}\n"
LOOK = f"""**Look first** at the largest deviation of each pose, a curve below: go to the pose where it is highest. The
arm stops {HOLD_S:g} s at each pose that a reference names; press play, or drag the time.
"""
POSES = """
- blue ball: the model's flange or wrist centre
- orange ball (magenta for claims): where the reference has it; the arrow is the deviation (from 0.1 mm on)
"""


def record(study: Study, stored: Stored[ValidationResults], output: Path) -> None:
    """Write the recording from the stage's results."""
    results, robot = stored.results, model_of(study, stored.robot)
    poses = results.key_poses
    stations = _stations(robot, poses)
    corrected, fault = corrected_robot(robot, results.summary.diagnoses)
    parts = [HEAD, LOOK if len(poses) else "", FINDINGS, POSES if len(poses) else ""]
    parts.append(f"- see-through arm: the same table, {fault}\n" if corrected is not None else "")
    record_stage(
        study,
        stored,
        output,
        "".join(parts),
        robot=robot,
        runs=[_run(robot, rows, following, results.checks) for rows, following in pairwise([*stations, None]) if rows],
        curves=[Curves("deviation", "Largest deviation (mm)", ["largest deviation"], [REFERENCE], whole=True)],
        home=np.zeros(robot.joints),
        views={"Key poses": ["**"]},
        points=[points / 1000 for points in (poses.point_mm, poses.model_point_mm)],
        ghost=corrected,
        now="This pose",
    )


def _stations(robot: Robot, poses: KeyPoses) -> list[KeyPoses]:
    """Rows of equal joint angles together, in the order of the table; the zero pose if there are none."""
    if not len(poses):
        nowhere = (np.nan,) * 3
        return [
            KeyPoses.of_rows(
                [
                    (
                        "",
                        "",
                        "",
                        "",
                        fact("named_pose", name="zero pose"),
                        "",
                        (0.0,) * robot.joints,
                        nowhere,
                        nowhere,
                        np.nan,
                    )
                ]
            )
        ]
    rounded = poses.q_deg.round(6)
    return [poses.take((rounded == pose).all(axis=1)) for pose in dict.fromkeys(map(tuple, rounded))]


def _run(robot: Robot, rows: KeyPoses, following: KeyPoses | None, checks: Checks) -> Run:
    """Hold at a station, then move smoothly to the next."""
    share = np.linspace(0, 1, STEPS + 1) if following is not None else np.empty(0)
    here, then = (meant(robot, each.q_deg[0]) for each in (rows, following or rows))
    times = np.concatenate([[0.0, HOLD_S], HOLD_S + BRIEFLY_S + share * (MOVE_S - BRIEFLY_S)])
    worst = np.full((len(times), 1), np.nan)
    worst[:2] = np.fmax.reduce(rows.deviation_mm)
    pose = " / ".join(escaped(say(pose)) for pose in dict.fromkeys(rows.pose))
    stated = np.isfinite(rows.deviation_mm)
    return Run(
        name=pose,
        text=_text(rows, pose),
        t=times,
        q=np.concatenate([[here, here], here + (share**2 * (3 - 2 * share))[:, None] * (then - here)]),
        outcome=f"off by {worst[0, 0]:.2f} mm at most" if stated.any() else "",
        status=_status(rows, checks),
        curves={"deviation": worst} if stated.any() else {},
        shapes=_points(rows, 0.012 * size_of(robot)),
        pause_s=0.0,
    )


def _status(rows: KeyPoses, checks: Checks) -> Weight:
    """Whether points are farther off than lengths of the same reference set may be, and documents say so."""
    of_lengths = checks.unit == "mm"
    allowed = [
        np.nanmax(checks.tolerance[of_lengths & (checks.reference_set == each)], initial=0.0)
        for each in rows.reference_set
    ]
    too_far = rows.deviation_mm > np.array(allowed)
    by_documents = np.isin(rows.grade, [*AUTHORITATIVE_GRADES])
    return "fail" if (too_far & by_documents).any() else "caution" if too_far.any() else "plain"


def _text(rows: KeyPoses, pose: str) -> str:
    angles = ", ".join(f"{angle:g}" for angle in rows.q_deg[0].round(3))
    lines = [f"### {pose}", f"joints ({angles})°", ""]
    for point, deviation, source, grade in zip(rows.point, rows.deviation_mm, rows.source, rows.grade):
        if np.isfinite(deviation):
            lines.append(f"- {point.replace('_', ' ')}: off by **{deviation:.2f} mm**, {escaped(source)} ({grade})")
    return "\n".join(lines)


def _points(rows: KeyPoses, radius: float) -> list[tuple[float, str, Logged]]:
    """The points of the model and of the references, while the arm holds."""
    stated = rows.take(np.flatnonzero(np.isfinite(rows.point_mm).all(axis=1)))
    points, model = stated.point_mm / 1000, stated.model_point_mm / 1000
    colours = np.array(_colours(stated.grade))
    seen = stated.deviation_mm >= MIN_ARROW_MM
    shapes = {
        "reference/points": rr.Points3D(points, radii=radius, colors=colours),
        "model": rr.Points3D(model, radii=radius * 1.15, colors=rgb(MODEL)),
        "deviation": rr.Arrows3D(
            origins=model[seen],
            vectors=(points - model)[seen],
            radii=radius * 0.35,
            colors=colours[seen],
            labels=[f"{deviation:.1f} mm" for deviation in stated.deviation_mm[seen]],
            show_labels=True,
        ),
    }
    return [(t, entity, GONE if t else shape) for t in (0.0, HOLD_S) for entity, shape in shapes.items()]


def _colours(grades: Texts) -> list[tuple[int, int, int]]:
    """The colour of each source: claims have one of their own."""
    return [rgb(REFERENCE if grade in AUTHORITATIVE_GRADES else HIGHLIGHT) for grade in grades]
