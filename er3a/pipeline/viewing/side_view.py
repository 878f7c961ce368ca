"""Arms from the side, at one scale, with what they reach: one drawing that follows the page's colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from markupsafe import Markup

from er3a.kinematics.forward import skeleton
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.language import tr
from er3a.pipeline.messages.say import joined
from er3a.robots.robot import Robot

Kind = Literal["right", "wrong", "other"]
MARGIN = 0.06  # of the larger side
LETTERS = 0.034  # of the height
WIDE, UPRIGHT = 1.25, 0.77  # at least, of the height
FLATTEST = 1.6  # width, of the height: letters stay legible over a level arm
BONE = 0.045  # an arm's thickness, of the height of what is drawn
SCALES_MM = (100, 200, 500, 1000, 2000)


@dataclass(frozen=True, eq=False)
class SeenArm:
    """An arm from the side.

    Attributes
    ----------
    title, note : beside the drawing, in the arm's colour
    kind : of its colour
    points_mm : (k, 2), the joints' places from the base to the flange: forward, up
    reach_mm : outlines (m, 2) of what the tool point reaches
    holes : a word and a place (2,) each
    """

    title: str
    note: str
    kind: Kind
    points_mm: Reals
    reach_mm: Sequence[Reals] = ()
    holes: Sequence[tuple[str, Reals]] = field(default=())


def seen_arm(robot: Robot, title: str, note: str, kind: Kind, reach_mm: Sequence[Reals] = ()) -> SeenArm:
    """An arm with all joints at 0, seen along y of the frame that its base is placed in."""
    return SeenArm(title, note, kind, skeleton(robot, np.zeros(robot.joints))[:, ::2] * 1000, reach_mm)


def side_view(arms: Sequence[SeenArm], floor_mm: float | None = None, least_wide: float = WIDE) -> Markup:
    """The drawing as SVG.

    Parameters
    ----------
    arms : drawn in this order, later ones over earlier ones
    floor_mm : height of the floor; None where there is none
    least_wide : how wide it is at least, of its height

    Returns
    -------
    svg : colours come from the page's style sheet
    """
    named = [[at] for arm in arms for _, at in arm.holes]
    corners = np.concatenate([*named, *(each for arm in arms for each in (arm.points_mm, *arm.reach_mm))])
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = MARGIN * float(max(high - low))
    low, high = low - margin, high + margin
    flat = max(0.0, float(high[0] - low[0]) / FLATTEST - float(high[1] - low[1])) / 2
    low[1], high[1] = low[1] - flat, high[1] + flat
    names, scale = (lines * 1.7 * LETTERS * (high[1] - low[1]) for lines in (len(arms), 1.2))
    low[1], high[1] = low[1] - scale, high[1] + names  # room for both
    wide, tall = high - low
    low[0] -= max(0.0, least_wide * tall - wide) / 2
    wide = max(wide, least_wide * tall)
    parts = [_reach(arm) for arm in arms]
    if floor_mm is not None:
        parts.append(
            Markup('<rect class="floor" x="{:.0f}" y="{:.0f}" width="{:.0f}" height="{:.0f}"/>').format(
                low[0], -floor_mm, wide, max(0.0, floor_mm - low[1])
            )
        )
    parts += [_arm(arm, BONE * tall) for arm in arms]
    parts += _names(arms, low, high)
    parts.append(_scale(low, wide, LETTERS * tall))
    said = joined(joined((arm.title, arm.note), ", ") for arm in arms)
    return Markup('<svg class="arms" viewBox="{:.0f} {:.0f} {:.0f} {:.0f}" role="img" aria-label="{}">{}</svg>').format(
        low[0], -high[1], wide, tall, said, Markup("").join(parts)
    )


def _line(points: Reals) -> str:
    return " ".join(f"{x:.0f},{-z:.0f}" for x, z in points)


def _reach(arm: SeenArm) -> Markup:
    """What is reached, in one path, so that rings within rings are left empty."""
    rings = " ".join(f"M{_line(ring)}Z" for ring in arm.reach_mm)
    return Markup('<path class="reach {}" fill-rule="evenodd" d="{}"/>').format(arm.kind, rings)


def border_lines(arc: Integers, rho_m: Reals, z_m: Reals) -> list[Reals]:
    """The outline of a section about axis 1 on both sides of the axis.

    Parameters
    ----------
    arc : (k,) number of the closed line that each point is of
    rho_m, z_m : (k,) its distance from the axis, and its height, m

    Returns
    -------
    rings : (m, 2) each, mm
    """
    rings = [1000 * np.stack([rho_m[arc == each], z_m[arc == each]], axis=1) for each in np.unique(arc)]
    return [ring * [side, 1] for ring in rings for side in (1, -1)]


def _arm(arm: SeenArm, thick: float) -> Markup:
    line = _line(arm.points_mm)
    joints = Markup("").join(
        Markup('<circle cx="{:.0f}" cy="{:.0f}" r="{:.0f}"/>').format(x, -z, 0.22 * thick) for x, z in arm.points_mm
    )
    drawn = Markup(
        '<polyline class="edge" points="{0}" stroke-width="{1:.0f}"/><polyline points="{0}" stroke-width="{2:.0f}"/>'
    )
    return Markup('<g class="bones {}">{}{}</g>').format(arm.kind, drawn.format(line, thick, 0.78 * thick), joints)


def _names(arms: Sequence[SeenArm], low: Reals, high: Reals) -> list[Markup]:
    """Titles and notes in the upper corner, one below the other, each in its arm's colour; holes at their places."""
    letters = LETTERS * float(high[1] - low[1])
    named, y = [], -high[1] + 1.6 * letters
    for arm in arms:
        text = '<text class="{}" x="{:.0f}" y="{:.0f}" font-size="{:.0f}"><tspan font-weight="700">{}</tspan> {}</text>'
        named.append(Markup(text).format(arm.kind, low[0] + letters, y, letters, arm.title, arm.note))
        y += 1.5 * letters
        for word, at in arm.holes:
            hole = '<text class="hole" x="{:.0f}" y="{:.0f}" font-size="{:.0f}">{}</text>'
            named.append(Markup(hole).format(at[0] + letters, -at[1], 0.85 * letters, word))
    return named


def _scale(low: Reals, wide: float, letters: float) -> Markup:
    """A bar of a round length, in the lower corner."""
    length = max((each for each in SCALES_MM if each < wide / 3), default=SCALES_MM[0])
    x, y = low[0] + letters, -low[1] - letters
    bar = Markup('<path d="M{:.0f} {:.0f}h{}"/>').format(x, y, length)
    text = Markup('<text x="{:.0f}" y="{:.0f}" font-size="{:.0f}">{}</text>')
    said = text.format(x, y - 0.5 * letters, 0.8 * letters, tr("{length} mm", length=length))
    return Markup('<g class="scale">{}{}</g>').format(bar, said)
