"""The arm in its zero pose with its link frames, seen from a corner."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes as PlotAxes
from matplotlib.figure import Figure

from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.pipeline.messages.language import tr
from er3a.pipeline.viewing.figures import new_figure
from er3a.pipeline.viewing.palette import INK, LINK, MUTED
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.robots.robot import Robot

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
    groups: list[tuple[Reals, list[int]]] = []
    for number, frame in enumerate(T):
        origin = frame[:3, 3] * 1000
        _triad(axes, origin, frame[:3, :3], ARROW * size)
        alike = [own for place, own in groups if np.linalg.norm(place - origin) < SAME_PLACE_MM]
        if alike:
            alike[0].append(number)
        else:
            groups.append((origin, [number]))
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
