"""The validation page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.results import read_summary, read_table
from er3a.pipeline.stages.validation.axis_figures import axis_deviation, side_view, workspace_drawing
from er3a.pipeline.stages.validation.checks import THE_MODEL
from er3a.pipeline.stages.validation.corrected import mended_robot
from er3a.pipeline.stages.validation.diagnosis_figures import correction_stories, culprit_stories
from er3a.pipeline.stages.validation.subject import model_of
from er3a.pipeline.stages.validation.wording import in_a_row, listed
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.page import Picture, fixed, number, render, run_command
from er3a.references.scalars import SEGMENT_NAMES
from er3a.robots.robot import GRADES, WEIGHTY_GRADES, Robot

SHOWN_FAILURES = 12
DECIMALS = {"mm": 2, "deg": 2, "deg/s": 1, "": 0}
COLUMNS = (
    N_("Check"),
    N_("Model>"),
    N_("Reference>"),
    N_("Difference>"),
    N_("Tolerance>"),
    N_("Unit"),
    N_("Source"),
)
SEGMENTS = {
    SEGMENT_NAMES["upper_arm"]: N_("the upper arm stands {measured}° from the vertical where {expected}° is stated"),
    SEGMENT_NAMES["forearm"]: N_("the forearm stands {measured}° from the vertical where {expected}° is stated"),
}


def report(study: Study, name: str, folder: Path, output: Path) -> None:
    """Write the page from the stage's results."""
    robot = model_of(study, name)
    summary = read_summary(folder)
    axes, poses = read_table(folder / "axes.parquet"), read_table(folder / "key_poses.parquet")
    checks = summary["checks"]
    failed = sorted((check for check in checks if check["status"] == "fail"), key=_tolerances_off, reverse=True)
    labels = _labels(poses)
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        command=run_command(study, f"{name}/validation.html"),
        robot=robot,
        robot_pages=study.pages(name),
        sets=[_set_story(finding, checks, poses) for finding in summary["sets"]],
        culprits=culprit_stories(summary, read_table(folder / "residuals.parquet")),
        corrections=correction_stories(summary, read_table(folder / "corrections.parquet")),
        circles=summary["circle_points"],
        groups=_groups(checks),
        failed=[_row(check) for check in failed[:SHOWN_FAILURES]],
        more_failed=[_row(check) for check in failed[SHOWN_FAILURES:]],
        passed={
            title: [_row(check) for check in own if check["status"] == "pass"] for title, own in _by_set(checks).items()
        },
        columns=[tr(label) for label in COLUMNS],
        conflicts=summary["conflicts"],
        blanks=[_blank(check) for check in checks if check["status"] == "no_reference"],
        side=_side_picture(robot, axes, summary),
        deviation=_deviation_picture(_drawn_axes(axes)),
        drawing=_drawing_picture(read_table(folder / "section.parquet"), labels, summary),
        labels=_label_rows(labels, checks),
        round_trips=summary["round_trips"],
        grades=GRADES,
    )


def _set_story(finding: dict[str, Any], checks: list[dict], poses: pd.DataFrame) -> dict[str, Any]:
    """What the page says about one reference set, in numbers."""
    own = [check for check in checks if check["reference_set"] == finding["name"]]
    failed_groups = {check["group"] for check in own if check["status"] == "fail"}
    segments = [check for check in own if check["name"] in SEGMENTS]
    zero = poses[(poses["reference_set"] == finding["name"]) & (poses["group"] == "zero pose")]
    zero = zero[zero["point"] == "flange"].head(1)
    counted = finding["weighty"] if finding["weighty"]["total"] else finding["claims"]
    return finding | {
        "weighs": finding["weighty"]["total"] > 0,
        "counted": counted,
        "telling": [_row(check) for check in _telling(own)],
        "failed_groups": listed(sorted(failed_groups)),
        "held_groups": listed(sorted({check["group"] for check in own if check["status"] == "pass"} - failed_groups)),
        "zero_model": _point(zero, "model_"),
        "zero_stated": _point(zero, ""),
        "segments": listed(_segment(check) for check in segments),
        "segments_hold": all(check["status"] == "pass" for check in segments),
    }


def _segment(check: dict) -> str:
    """How a segment of the arm stands, and how it is stated to."""
    template = SEGMENTS[check["name"]]
    return tr(template, measured=fixed(check["measured"], 0), expected=fixed(check["expected"], 0))


def _telling(own: list[dict]) -> list[dict]:
    """One failed length per group, the farthest off."""
    worst: dict[str, dict] = {}
    for check in own:
        if check["status"] != "fail" or check["unit"] != "mm":
            continue
        group = check["group"]
        if group not in worst or abs(check["difference"]) > abs(worst[group]["difference"]):
            worst[group] = check
    return list(worst.values())


def _point(rows: pd.DataFrame, prefix: str) -> str:
    if rows.empty:
        return ""
    return ", ".join(fixed(rows.iloc[0][f"{prefix}{c}_mm"], 1) for c in "xyz")


def _by_set(checks: list[dict]) -> dict[str, list[dict]]:
    found: dict[str, list[dict]] = {}
    for check in checks:
        found.setdefault(check["reference_set"] or THE_MODEL, []).append(check)
    return found


def _groups(checks: list[dict]) -> list[list[Any]]:
    """One row per set and group: counts, and the check that comes nearest to failing or fails worst."""
    rows = []
    for title, own in _by_set(checks).items():
        for group in dict.fromkeys(check["group"] for check in own):
            part = [check for check in own if check["group"] == group and check["status"] != "no_reference"]
            if not part:
                continue
            counts = [sum(check["status"] == status for check in part) for status in ("pass", "fail", "conflict")]
            worst = max(part, key=_tolerances_off)
            status = "fail" if counts[1] else "conflict" if counts[2] else "pass"
            difference = f"{_number(worst, 'difference')} {worst['unit']}".strip()
            rows.append([title, group, status, *counts, worst["name"], difference])
    return rows


def _tolerances_off(check: dict) -> float:
    if check["difference"] is None:
        return -1.0
    return abs(check["difference"]) / check["tolerance"]


def _row(check: dict) -> list[str]:
    unit = check["unit"]
    values = [_number(check, key) for key in ("measured", "expected", "difference")]
    source, grade = check["source"], check["grade"]
    source = tr("{own_source} ({grade})", own_source=source, grade=grade) if grade else source
    return [check["name"], *values, f"{check['tolerance']:g}", unit, source]


def _number(check: dict, key: str) -> str:
    """A value in its unit's decimals; errors of round trips, which are far smaller, with one digit."""
    value = check[key]
    if check["group"] == "round trips" and 0 < abs(value) < 1e-3:
        return number(value, 1)
    return fixed(value, DECIMALS[check["unit"]])


def _blank(check: dict) -> list[str]:
    measured = f"{_number(check, 'measured')} {check['unit']}" if check["measured"] is not None else "–"
    return [check["name"], measured, check["reference_set"] or "–", check["note"]]


def _drawn_axes(axes: pd.DataFrame) -> pd.DataFrame:
    """Axes to draw: those from sources that count, or else the claims."""
    weighty = axes[axes["grade"].isin(WEIGHTY_GRADES)]
    return weighty if len(weighty) else axes


def _side_picture(robot: Robot, axes: pd.DataFrame, summary: dict) -> Picture:
    drawn = _drawn_axes(axes)
    mended, label = mended_robot(robot, summary["culprits"])
    if drawn.empty:
        caption = tr("No reference states any axis: there is nothing to hold the model's against.")
    elif (drawn["distance_mm"] <= drawn["uncertainty_mm"]).all() and _directions_hold(drawn):
        caption = tr("Each axis of the model lies on the stated one: the links have the right lengths and offsets.")
    else:
        farthest = drawn["distance_mm"].max()
        template = (
            N_(
                "The model's axes stand up to {farthest} mm from the stated ones: the two arms differ in size and "
                "shape, not in a detail."
            )
            if any(finding["another_arm"] for finding in summary["sets"])
            else N_("The model's axes stand up to {farthest} mm from the stated ones.")
        )
        caption = tr(template, farthest=fixed(farthest, 0 if farthest >= 10 else 2))
        if mended is not None and drawn["reference_set"].iloc[0] == _repaired_against(summary):
            mending = tr("The dashed arm has the named fault mended: it meets the stated axes.")
            caption = in_a_row(caption, mending)
        elif mended is not None:
            mending = tr("The dashed arm has the model's own zero pose put right; it still misses the stated axes.")
            caption = in_a_row(caption, mending)
    alt = tr("Side view of the zero pose: links and joint axes of the model, and the axes that references state.")
    return Picture(side_view(robot, drawn, mended, label), alt, caption)


def _repaired_against(summary: dict) -> str:
    """The reference set whose named fault the dashed arm has mended."""
    return next(culprit["reference_set"] for culprit in summary["culprits"] if culprit["repaired"])


def _directions_hold(axes: pd.DataFrame) -> bool:
    return bool((axes["angle_deg"] <= axes["uncertainty_deg"]).all())


def _deviation_picture(axes: pd.DataFrame) -> Picture | None:
    if axes.empty:
        return None
    off = axes[(axes["distance_mm"] > axes["uncertainty_mm"]) | (axes["angle_deg"] > axes["uncertainty_deg"])]
    joints = [f"J{joint}" for joint in sorted(set(off["joint"]))]
    if joints:
        caption = tr("Off by more than the source leaves open: {joints}.", joints=listed(joints))
        reversed_joints = [f"J{joint}" for joint in sorted(set(off[off["angle_deg"] > 135]["joint"]))]
        if reversed_joints:
            caption = in_a_row(caption, tr("Turning the other way: {joints}.", joints=listed(reversed_joints)))
    else:
        caption = tr("No axis is off by more than its source leaves open (outlined boxes).")
    alt = tr("Bars per joint and source: distance and angle between the model's axis and the stated one.")
    return Picture(axis_deviation(axes), alt, caption)


def _labels(poses: pd.DataFrame) -> pd.DataFrame:
    labels = poses[poses["group"] == "envelope"].reset_index(drop=True)
    return labels.assign(number=np.arange(1, len(labels) + 1))


def _label_rows(labels: pd.DataFrame, checks: list[dict]) -> list[list[Any]]:
    """The drawing's labels with the numbers that they have in the figure."""
    rows = []
    for check in checks:
        if check["group"] == "envelope" and check["difference"] is not None:
            number = next(row.number for row in labels.itertuples() if check["name"].startswith(row.name))
            values = [fixed(check[key], decimals) for key, decimals in (("expected", 1), ("measured", 2))]
            rows.append([number, check["name"], *values, fixed(check["difference"], 2), f"{check['tolerance']:g}"])
    return sorted(rows, key=lambda row: row[0])


def _drawing_picture(section: pd.DataFrame, labels: pd.DataFrame, summary: dict) -> Picture | None:
    if labels.empty:
        return None
    missed = [c for c in summary["checks"] if c["group"] == "envelope" and c["status"] == "fail"]
    worst = fixed(labels["deviation_mm"].max(), 2)
    caption = (
        tr(
            "The maker's labels lie on the region's edge, off by {worst} mm at most: lengths, limits of J2 and J3 and "
            "the signs of both joints agree with the drawing.",
            worst=worst,
        )
        if not missed
        else tr("{count} labels are missed, by up to {worst} mm.", count=len(missed), worst=worst)
    )
    alt = tr("Region that the wrist centre sweeps with joints 2 and 3, and the drawing's labels, numbered.")
    return Picture(workspace_drawing(section, labels, summary["section_origin_mm"]), alt, caption)
