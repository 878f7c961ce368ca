"""What axis 1 sweeps, what is around the arm, and the tray, seen from above."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from er3a.collision.scene import Scene
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import own_title, tr, with_unit
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.stages.workspace.model import WorkspaceResults
from er3a.pipeline.stages.workspace.page.tray import Tray
from er3a.pipeline.viewing.drawn import outlines
from er3a.robots.robot import Robot

AROUND = 1.1  # of the reach, that is shown to each side
DEAD = 0.2  # rad that axis 1 does not turn to: there is room for a word
LETTER = 0.3  # half the width of a letter, of its height
BASE, AXES = 0.06, 0.3  # of the reach: radius of the dot at axis 1, length of x and y


def from_above(robot: Robot, results: WorkspaceResults, scene: Scene | None, tray: Tray, letters: float) -> Markup:
    """The drawing as SVG, y to the left of x.

    Parameters
    ----------
    letters : height of words, in parts of the reach

    Returns
    -------
    drawing : colours come from the page's style sheet
    """
    reach = 1000 * results.summary.reach_m.furthest_from_axis
    size, height = AROUND * reach, letters * reach
    low, high = robot.lower[0], robot.upper[0]
    parts = [Markup('<path class="reached" d="{}"/>').format(_sector(reach, low, high))]
    words = []
    for solid in scene.solids if scene else ():
        if seen := [1000 * corners for corners in outlines(solid, [0, 1])]:
            parts += [Markup('<polygon class="solid" points="{}"/>').format(_line(corners)) for corners in seen]
            around = np.concatenate(seen)
            at = np.array([around[:, 0].mean(), around[:, 1].max() + BASE * reach])
            words.append(_word(at, height, own_title(solid.name), "", size))
    (left, below), (right, above) = (1000 * corner[:2] for corner in tray.corners)
    corners = np.array([[left, below], [right, below], [right, above], [left, above]])
    parts.append(Markup('<polygon class="tray" points="{}"/>').format(_line(corners)))
    x, y = 1000 * np.array(tray.place.centre_m[:2])
    beyond = above + height / 3 if y > 0 else below - height  # away from the way that leads there
    words.append(_word(np.array([(left + right) / 2, beyond]), height, tr("tray"), "tray", size))
    parts.append(Markup('<path class="way" d="M0,0H{:.0f}V{:.0f}"/>').format(x, -y))
    far = reach * _way(3 * np.pi / 4 if y <= 0 else -3 * np.pi / 4)  # where the tray is not
    parts.append(Markup('<path class="scale" d="M0,0L{:.0f},{:.0f}"/>').format(far[0], -far[1]))
    words.append(_word(0.6 * far, height, with_unit(fixed(reach, 0), "mm"), "", size))
    gap = 2 * np.pi - (high - low)
    if gap > DEAD:
        parts.append(Markup('<path class="dead" d="{}"/>').format(_sector(reach, high, high + gap)))
        words.append(_word(0.6 * reach * _way(high + gap / 2), height, tr("J1's dead zone"), "zone", size))
    parts.append(Markup('<path class="axes" d="M{0:.0f},0H0V-{0:.0f}"/>').format(AXES * reach))
    words += [_word((AXES + BASE) * reach * way, height, axis, "", size) for axis, way in zip("xy", np.eye(2))]
    parts.append(Markup('<circle class="base" cx="0" cy="0" r="{:.0f}"/>').format(BASE * reach))
    box = f"{-size:.0f} {-size:.0f} {2 * size:.0f} {2 * size:.0f}"
    said = tr("From above: what axis 1 sweeps, what stands there, and the tray, {far} mm at most", far=fixed(reach, 0))
    drawing = '<svg class="plan-view" viewBox="{}" role="img" aria-label="{}">{}</svg>'
    return Markup(drawing).format(box, said, Markup("").join([*parts, *words]))


def _way(angle: float) -> Reals:
    """The direction (2,) at an angle, rad, about axis 1."""
    return np.array([np.cos(angle), np.sin(angle)])


def _sector(radius: float, low: float, high: float) -> str:
    """What an arm that turns from ``low`` to ``high`` (rad) sweeps."""
    turn = np.linspace(low, min(high, low + 2 * np.pi), 73)
    arc = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    centre = "" if high - low >= 2 * np.pi - 1e-6 else "M0,0 L"
    return f"{centre or 'M'}{_line(arc)}Z"


def _line(points: Reals) -> str:
    return " ".join(f"{x:.0f},{-y:.0f}" for x, y in points)


def _word(at: Reals, letters: float, text: str, kind: str, size: float) -> Markup:
    """A word in the middle of a place (2,), or as near to it as it is whole in a drawing of ``size`` to each side."""
    room = max(0.0, size - LETTER * letters * len(text))
    return Markup('<text class="{}" x="{:.0f}" y="{:.0f}" font-size="{:.0f}">{}</text>').format(
        kind, np.clip(at[0], -room, room), -at[1], letters, text
    )
