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
from er3a.kinematics.forward import forward, skeleton
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import N_, own_title, tr
from er3a.pipeline.messages.diagnosis import both
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import joined, say, sentence
from er3a.pipeline.stages.validation import model
from er3a.pipeline.viewing.figures import new_figure
from er3a.pipeline.viewing.palette import INK, LINK, MUTED
from er3a.robots.robot import Robot


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
