"""Draws an arm with Matplotlib, in a window or a notebook: one pose, or a motion with the tool's trail."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib import pyplot
from matplotlib.animation import FuncAnimation
from matplotlib.figure import Figure

from er3a.errors import ShapeError
from er3a.kinematics.forward import forward, frames, skeleton
from er3a.numerics.arrays import Reals, as_floats
from er3a.pipeline.viewing.palette import INK, JOINTS, MUTED
from er3a.robots.joint_limits import size_of
from er3a.robots.robot import Robot

TOOL_AXES = ("#b42318", "#18794e", "#0b5c94")
MAX_FRAMES = 200
AXES_LENGTH = 0.12  # of the tool's axes, in parts of the arm's size


def plot(robot: Robot, q: Reals, seconds: float = 5.0, window: Sequence[float] | None = None) -> Figure | FuncAnimation:
    """Draw an arm: its links, its joints, and its tool's axes (x red, y green, z blue).

    Parameters
    ----------
    q : (n,), rad or m, for a figure; (N, n) for an animation with the tool's trail
    seconds : duration of the animation
    window : (6,), m, range of the axes: smallest and largest x, y, z, as ``workspace`` of the Robotics Toolbox; None
        for the range of the motion

    Returns
    -------
    drawn : a Matplotlib figure or animation. A notebook shows it; in a script call ``matplotlib.pyplot.show()`` (keep
        the animation in a variable until then). ``.savefig`` or ``.save`` writes it to a file

    Raises
    ------
    ShapeError
        if q has another shape, or the window does not have six numbers
    """
    edges = None if window is None else as_floats(np.asarray(window), "window")
    if edges is not None and edges.shape != (6,):
        raise ShapeError("window", edges.shape, "(6,)")
    values = as_floats(q, "q")
    if values.ndim not in (1, 2) or values.shape[-1] != robot.joints or not len(values):
        raise ShapeError("q", values.shape, f"({robot.joints},) or (N, {robot.joints})")
    motion = values if values.ndim == 2 else values[None]
    motion = motion[np.unique(np.linspace(0, len(motion) - 1, MAX_FRAMES).round().astype(int))]
    figure = pyplot.figure()
    axes: Any = figure.add_subplot(projection="3d")
    trail = forward(robot, motion)[:, :3, 3]
    _frame(axes, robot, motion, edges)
    parts = _parts(axes, robot)

    def show(number: int) -> list[Any]:
        arm, joints, tool, way = parts
        corners, T = skeleton(robot, motion[number]), frames(robot, motion[number])
        arm.set_data_3d(*corners.T)
        joints._offsets3d = tuple(T[:-1, :3, 3].T)
        for c, line in enumerate(tool):
            end = T[-1, :3, 3] + AXES_LENGTH * size_of(robot) * T[-1, :3, c]
            line.set_data_3d(*np.stack([T[-1, :3, 3], end]).T)
        way.set_data_3d(*trail[: number + 1].T)
        return [arm, joints, way, *tool]

    show(0)
    if values.ndim == 1:
        return figure
    animation = FuncAnimation(figure, show, frames=len(motion), interval=1000 * seconds / len(motion))
    pyplot.rcParams["animation.html"] = "jshtml"
    if "inline" in matplotlib.get_backend():
        pyplot.close(figure)  # a notebook would show it beside the animation
    return animation


def _parts(axes: Any, robot: Robot) -> tuple[Any, Any, list[Any], Any]:
    """The drawn parts: links, joints, the tool's axes, its trail."""
    (arm,) = axes.plot([], [], [], "-", color=MUTED, linewidth=4)
    joints = axes.scatter(*np.zeros((3, robot.rows)), color=[JOINTS[k % len(JOINTS)] for k in range(robot.rows)], s=45)
    tool = [axes.plot([], [], [], "-", color=colour, linewidth=2)[0] for colour in TOOL_AXES]
    (way,) = axes.plot([], [], [], "-", color=INK, linewidth=1)
    return arm, joints, tool, way


def _frame(axes: Any, robot: Robot, motion: Reals, window: Reals | None) -> None:
    """Axes of one scale that hold the whole motion, or show what a window (6,) in m does."""
    if window is not None:
        axes.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)", title=robot.title)
        axes.set(**{f"{name}lim": window[2 * k : 2 * k + 2] for k, name in enumerate("xyz")})
        axes.set_box_aspect(np.ptp(window.reshape(3, 2), axis=1))
        return
    points = np.concatenate([skeleton(robot, each) for each in motion])
    middle, half = (points.max(axis=0) + points.min(axis=0)) / 2, 0.55 * np.ptp(points, axis=0).max()
    axes.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)", title=robot.title)
    axes.set(**{f"{name}lim": (at - half, at + half) for name, at in zip("xyz", middle)})
    axes.set_box_aspect((1, 1, 1))
