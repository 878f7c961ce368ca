"""Figures of the validation page; sentences, rows and captions of the diagnosis."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import asdict
from typing import Any

import numpy as np
from matplotlib.axes import Axes as PlotAxes
from matplotlib.figure import Figure

from er3a.finding import is_one
from er3a.kinematics.forward import forward, frames, skeleton
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import N_, own_title, tr
from er3a.pipeline.messages.diagnosis import both
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import joined, say, sentence
from er3a.pipeline.stages.validation import model
from er3a.pipeline.viewing.figures import equal_scale, new_figure
from er3a.pipeline.viewing.palette import HIGHLIGHT, INK, LINK, MODEL, MUTED, REFERENCE
from er3a.references.quantities import nearest_on_axis, point_of
from er3a.robots.robot import Robot

REFERENCE_COLOURS = (REFERENCE, HIGHLIGHT)
MARKERS = (("o", 13), ("s", 18), ("D", 22))
SEEN_END_ON = 0.9
HAIR = 0.9


SIX = 6


def side_view(robot: Robot, stated: model.Axes, corrected: Robot | None, corrected_label: str) -> Figure:
    """The arm in its zero pose from the side, to scale, with its joint axes over those that the references state."""
    figure, axes = new_figure(width=7, height=7.4)
    corners = skeleton(robot, np.zeros(robot.joints)) * 1000
    drawn = [corners]
    if corrected is not None:
        dashed = skeleton(corrected, np.zeros(corrected.joints)) * 1000
        axes.plot(dashed[:, 0], dashed[:, 2], "--", color=MUTED, linewidth=2, label=corrected_label)
        drawn.append(dashed)
    size = float(np.ptp(np.vstack([*drawn, stated.point_mm]), axis=0).max())
    style = {"solid_capstyle": "round", "solid_joinstyle": "round", "zorder": 1}
    axes.plot(corners[:, 0], corners[:, 2], color=LINK, linewidth=9, label=tr("model's links"), **style)
    axes.axhline(0, color=MUTED, linewidth=1, zorder=0)
    for k, (source, own) in enumerate(_by_source(stated)):
        marker, points = MARKERS[k % len(MARKERS)]
        colour = REFERENCE_COLOURS[k % len(REFERENCE_COLOURS)]
        lines = list(zip(own.joint, own.direction, own.point_mm))
        label = tr("axes: {own_source}", own_source=_short(source))
        _axes_of(axes, lines, size * (0.16 + 0.02 * k), label, colour=colour, marker=marker, points=points, hollow=True)
        off = own.distance_mm > 0.05 * size
        if k == 0:
            _label(axes, zip(own.joint[off], own.point_mm[off]), colour, (10, -17))
    lines = _model_axes(robot)
    _axes_of(axes, lines, size * 0.13, tr("model's axes"), colour=MODEL, marker="o", points=6, hollow=False)
    _label(axes, [(joint, point) for joint, _, point in lines], MODEL, (9, 9))
    equal_scale(axes, "x (mm)", "z (mm)")
    axes.margins(0.12)
    figure.legend(loc="outside lower left", ncols=1)
    return figure


def _by_source(stated: model.Axes) -> list[tuple[str, model.Axes]]:
    return [(source, stated.take(stated.source == source)) for source in dict.fromkeys(stated.source)]


def _axes_of(
    axes: PlotAxes, lines: list, half: float, label: str, *, colour: str, marker: str, points: float, hollow: bool
) -> None:
    """Axes seen end on as markers, the others as dash-dotted lines."""
    face = "none" if hollow else colour
    for _, direction, point in lines:
        if abs(direction[1]) > SEEN_END_ON:
            axes.plot(
                point[0], point[2], marker, markersize=points, markerfacecolor=face, markeredgecolor=colour, zorder=3
            )
        else:
            ends = np.array([point - direction * half, point + direction * half])
            axes.plot(ends[:, 0], ends[:, 2], "-.", color=colour, linewidth=HAIR + hollow, zorder=2)
    axes.plot([], [], f"{marker}-.", color=colour, markerfacecolor=face, markersize=min(points, 11), label=label)


def _model_axes(robot: Robot) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """Joint, direction and a point (mm) of each axis in the zero pose; axis 4 at the wrist centre."""
    T = frames(robot, np.zeros(robot.joints))
    if robot.rows != SIX:
        return [(k + 1, T[k, :3, 2], T[k, :3, 3] * 1000) for k in range(robot.rows)]
    points = [*T[:3, :3, 3] * 1000, nearest_on_axis(T, 4, point_of(T, "wrist_centre")), *T[4:6, :3, 3] * 1000]
    return [(k + 1, T[k, :3, 2], points[k]) for k in range(6)]


def _label(axes: PlotAxes, points: Iterable[tuple[int, np.ndarray]], colour: str, shift: tuple[int, int]) -> None:
    """Name joints at their points; joints that share a point share a label."""
    groups = _grouped(points, lambda one, other: float(np.linalg.norm((one - other)[[0, 2]])))
    for point, joints in groups:
        text = ", ".join(f"J{joint}" for joint in joints)
        axes.annotate(text, (point[0], point[2]), shift, textcoords="offset points", color=colour, zorder=6)


def _grouped(
    points: Iterable[tuple[int, Reals]], apart: Callable[[Reals, Reals], float]
) -> list[tuple[Reals, list[int]]]:
    """Points with their numbers, those at one place (to ``SAME_PLACE_MM``) together."""
    groups: list[tuple[Reals, list[int]]] = []
    for number, point in points:
        there = next((numbers for other, numbers in groups if apart(point, other) < SAME_PLACE_MM), None)
        if there is None:
            groups.append((point, [number]))
        else:
            there.append(number)
    return groups


def _short(source: str) -> str:
    """A source's title, which is what stands before a colon."""
    return re.split("[:：]", own_title(source))[0]


AZIMUTH, ELEVATION = np.radians(-58.0), np.radians(18.0)
FRAME_COLOURS = ("#d62728", "#2ca02c", "#1f77b4")
ARROW = 0.09
SAME_PLACE_MM = 1.0
LABEL_SHIFT = 9


def link_frames(robot: Robot, other: Robot | None, other_label: str) -> Figure:
    """The links at all joints 0 with frames 0 (base) to n (flange), x red, y green, z blue; another table dashed."""
    figure, axes = new_figure(width=5.4, height=5.6)
    zero = np.zeros(robot.joints)
    corners = skeleton(robot, zero) * 1000
    drawn = [corners]
    if other is not None:
        drawn.append(skeleton(other, zero) * 1000)
        axes.plot(*_seen(drawn[1]).T, "--", color=MUTED, linewidth=1.6, label=other_label, zorder=2)
    axes.plot(*_seen(corners).T, color=LINK, linewidth=8, solid_capstyle="round", solid_joinstyle="round", zorder=1)
    size = float(np.ptp(np.vstack(drawn), axis=0).max())
    T = np.concatenate([robot.base[None], _frames_of_links(robot)])
    origins = 1000 * T[:, :3, 3]
    for frame, origin in zip(T, origins):
        _triad(axes, origin, frame[:3, :3], ARROW * size)
    groups = _grouped(enumerate(origins), lambda one, other: float(np.linalg.norm(one - other)))
    for origin, numbers in groups:
        text = ", ".join(map(str, numbers))
        axes.annotate(
            text, _seen(origin[None])[0], (-LABEL_SHIFT, -LABEL_SHIFT), textcoords="offset points", color=INK,
            ha="right", va="top", fontsize=10, weight="bold", zorder=5,
        )  # fmt: skip
    for colour, name in zip(FRAME_COLOURS, "xyz"):
        axes.plot([], [], color=colour, linewidth=2.2, label=tr("{name} of a frame", name=name))
    axes.legend(loc="upper left", fontsize=8)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    axes.set_axis_off()
    return figure


def _frames_of_links(robot: Robot) -> Reals:
    """Frames 1 to m - 1 of the table, in which its rows are written, and the flange (m, 4, 4), at all joints 0."""
    zero = np.zeros(robot.joints)
    own = [forward(robot, zero, frame=k) for k in range(1, robot.rows)]
    return np.stack([*own, forward(robot.without_tool(), zero)])


def _seen(points: Reals) -> Reals:
    """Points (n, 3) as they are seen from the corner, (n, 2)."""
    x, y, z = points.T
    across = x * np.cos(AZIMUTH + np.pi / 2) + y * np.sin(AZIMUTH + np.pi / 2)
    toward = x * np.cos(AZIMUTH) + y * np.sin(AZIMUTH)
    return np.column_stack([across, z * np.cos(ELEVATION) - toward * np.sin(ELEVATION)])


def _triad(axes: PlotAxes, origin: Reals, turn: Reals, length: float) -> None:
    for k, colour in enumerate(FRAME_COLOURS):
        ends = _seen(np.stack([origin, origin + turn[:, k] * length]))
        axes.annotate(
            "", ends[1], ends[0], arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 1.8}, zorder=4
        )


def typographic(text: str) -> str:
    """A text with minus signs instead of hyphens before numbers."""
    return re.sub(r"(?<![0-9A-Za-z])-(?=[0-9])", "−", text)


OWN_CLAIMS = N_(
    "Correcting that makes the table agree with its own source's statements alone, which are no evidence about a real "
    "robot: don't use the corrected table for one."
)
SHOWN_HYPOTHESES = 5


def diagnosis_stories(summary: model.ValidationSummary) -> list[dict[str, Any]]:
    """Per reference set: what the diagnosis says, and the next-best hypotheses."""
    claims = {found.name for found in summary.sets if not found.is_authoritative}
    return [_diagnosis_story(each, each.reference_set in claims) for each in summary.diagnoses]


def _diagnosis_story(diagnosis: model.SetDiagnosis, own_claims: bool) -> dict[str, Any]:
    named = is_one(diagnosis.conclusion, "named", "mostly")
    best = diagnosis.hypotheses[0] if named else None
    return dict(
        reference_set=diagnosis.reference_set,
        text=joined([typographic(say(diagnosis.conclusion)), tr(OWN_CLAIMS) if own_claims and best else ""], " "),
        against=_measured_against(diagnosis),
        others_title=tr("Next best hypotheses")
        if named
        else tr("The best hypotheses, none of which explains the data"),
        others=[_hypothesis_row(each) for each in diagnosis.hypotheses[1 if named else 0 : SHOWN_HYPOTHESES]],
        hypotheses_tried=diagnosis.hypotheses_tried,
    )


def _measured_against(diagnosis: model.SetDiagnosis) -> str:
    """What residuals are measured against, and what of that is no evidence."""
    own = [own_title(title) for title in diagnosis.against if title in diagnosis.from_table]
    others = [own_title(title) for title in diagnosis.against if title not in diagnosis.from_table]
    text = tr("Residuals are measured against: {documents}.", documents=joined(others)) if others else ""
    if own:
        template = (
            N_("Also compared with {documents}: taken from the table, or the table from them, so no evidence for it.")
            if others
            else N_(
                "Residuals are measured against {documents}: the table was taken from it or it from the table, so "
                "they are no evidence for its numbers."
            )
        )
        text = joined([text, tr(template, documents=joined(own))], " ")
    return text


def _hypothesis_row(hypothesis: model.RankedHypothesis) -> list[str]:
    words = both(hypothesis.faults)
    if alike := hypothesis.indistinguishable_from:
        words = sentence(
            "alike",
            faults=words,
            more=len(alike),
        )
    numbers = [fixed(value, 1) for value in (hypothesis.residual_before, hypothesis.residual_after)]
    return [typographic(words), *numbers, tr(hypothesis.unit), fixed(hypothesis.score, 1)]


def corrected_robot(robot: Robot, diagnoses: Iterable[model.SetDiagnosis]) -> tuple[Robot | None, str]:
    """The robot with the first named fault corrected, and its label; None if no fault is named."""
    for diagnosis in diagnoses:
        if diagnosis.corrected and is_one(diagnosis.conclusion, "named", "mostly"):
            label = sentence("corrected", faults=typographic(both(diagnosis.conclusion.faults)))
            return robot.replace(**asdict(diagnosis.corrected)), label
    return None, ""
