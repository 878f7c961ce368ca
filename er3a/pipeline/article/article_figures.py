"""The figures of the page on the article."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from er3a.kinematics.forward import forward, jacobian
from er3a.kinematics.singularity import characteristic_length, conditioning
from er3a.pipeline.article.article_numbers import (
    CLOUD,
    COMPARED,
    DURATION_S,
    LINE,
    MOVE_END,
    WINDOW_Z_M,
    ArticleNumbers,
    random_joints,
)
from er3a.pipeline.messages.language import tr
from er3a.pipeline.results import read_stage
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.figures import new_figure
from er3a.pipeline.viewing.index import border_mm
from er3a.pipeline.viewing.numbers import fixed, number
from er3a.pipeline.viewing.page import Picture
from er3a.pipeline.viewing.palette import HIGHLIGHT, INK, JOINT_NAMES, MODEL, MUTED, REFERENCE
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.planning.moves import JointMove
from er3a.robots.robot import Robot

COLOURS = (REFERENCE, MODEL, MUTED)  # printed, corrected, real
DOTS = 3000


def draw(study: Study, results: Path, numbers: ArticleNumbers) -> dict[str, Picture]:
    """The figures by name, in the order in which they stand on the page."""
    tables = study.article
    assert tables is not None
    robots = [study.robot(name) for name in tables.names]
    names = [tr("as printed"), tr("offset 2 = −90°"), tr("the real ER3A-C60")]
    return {
        "zero": _zero_pose(robots, names, numbers),
        "reach": _reach(results, tables.names, robots, names, numbers, study.seed),
        "wrist": _wrist(robots[0], numbers),
        "move": _move(numbers),
        "line": _line(results, tables.names[:2], names, numbers),
        "measures": _measures(robots[0], study.seed, numbers),
    }


def _zero_pose(robots: list[Robot], names: list[str], numbers: ArticleNumbers) -> Picture:
    figure, axes = new_figure(width=7.0, height=5.2)
    low, high = (1000 * z for z in WINDOW_Z_M)
    axes.axhspan(low, high, color=MUTED, alpha=0.12, linewidth=0, label=tr("window of the article's plot"))
    for robot, name, colour in zip(robots, names, COLOURS):
        corners = 1000 * skeleton(robot, np.zeros(robot.joints))
        axes.plot(corners[:, 0], corners[:, 2], "o-", color=colour, linewidth=2.5, markersize=4, label=name)
    axes.set(xlabel="x (mm)", ylabel="z (mm)", aspect="equal")
    axes.legend(loc="center left", bbox_to_anchor=(1.02, 0.5))
    return Picture(
        figure,
        tr("Side view of three arms with all joints at 0, and the band of heights that the article's plot shows"),
        tr(
            "All joints at 0, from the side. As printed the tool is at z = {printed} mm, with offset 2 = −90° at "
            "{corrected} mm; the window from 0 to 1 500 mm shows {shown} % of the printed arm.",
            printed=fixed(numbers.printed.tool_mm[2], 2),
            corrected=fixed(numbers.corrected.tool_mm[2], 2),
            shown=fixed(100 - numbers.hidden_percent, 0),
        ),
    )


def _reach(
    results: Path,
    tables: tuple[str, ...],
    robots: list[Robot],
    names: list[str],
    numbers: ArticleNumbers,
    seed: int,
) -> Picture:
    figure, panels = new_figure(1, 3, width=12.0, height=5.2, sharex=True, sharey=True)
    found = (numbers.printed, numbers.corrected, numbers.real)
    for axes, table, robot, name, colour, own in zip(panels, tables, robots, names, COLOURS, found):
        points = 1000 * forward(robot, random_joints(robot, seed, CLOUD))[:DOTS, :3, 3]
        axes.plot(np.hypot(points[:, 0], points[:, 1]), points[:, 2], ",", color=MUTED)
        for arc in border_mm(read_stage(results / table / "workspace", STAGES["workspace"]).results):
            axes.plot(*np.array(arc).T, color=colour, linewidth=1)
        if own.void_mm and own.void_litres:
            axes.plot(np.hypot(*own.void_mm[:2]), own.void_mm[2], "*", color=HIGHLIGHT, markersize=11)
            text = tr(
                "void of {low} to {high} L", low=number(own.void_litres[0], 3), high=number(own.void_litres[1], 3)
            )
            axes.annotate(text, (np.hypot(*own.void_mm[:2]), own.void_mm[2]), (8, 8), textcoords="offset points")
        axes.set(title=name, xlabel=tr("distance from axis 1 (mm)"), aspect="equal")
    panels[0].set_ylabel("z (mm)")
    return Picture(
        figure,
        tr("Sections through what the tool reaches of three tables, with random samples, exact border and void"),
        tr(
            "What the tool reaches, folded about axis 1: samples as the article draws them, the exact border, and the "
            "middle of the largest enclosed void (star). The printed table's void is at z = {z} mm, above the base.",
            z=fixed(numbers.printed.void_mm[2], 0) if numbers.printed.void_mm else "–",
        ),
    )


def _wrist(robot: Robot, numbers: ArticleNumbers) -> Picture:
    angles = np.geomspace(0.05, 90.0, 200)
    q = np.zeros((len(angles), robot.joints))
    q[:, 4] = np.radians(angles)
    gain = np.linalg.norm(np.linalg.inv(jacobian(robot, q)[:, 3:, 3:]), axis=2).max(axis=1)
    figure, axes = new_figure(width=7.0, height=3.6)
    axes.loglog(angles, gain, color=REFERENCE, label=tr("fastest wrist joint, per unit of the tool's angular velocity"))
    turned = np.full(len(angles), numbers.wrist_turn_deg)
    axes.loglog(angles, turned, color=MODEL, label=tr("turn of the tool (°) by one degree of joint 4"))
    axes.set(xlabel=tr("joint 5 (°)"))
    axes.legend(loc="upper right")
    return Picture(
        figure,
        tr("Joint speed needed, and turn of the tool by joint 4, against the angle of joint 5"),
        tr(
            "Towards joint 5 = 0 it is not the tool that turns faster: the joints have to, without bound. One degree "
            "of joint 4 turns the tool by {turn}° everywhere.",
            turn=fixed(numbers.wrist_turn_deg, 3),
        ),
    )


def _move(numbers: ArticleNumbers) -> Picture:
    t = np.linspace(0, DURATION_S, 250)
    curves = JointMove(np.zeros(6), MOVE_END, DURATION_S).joints(t)
    figure, panels = new_figure(1, 3, width=11.0, height=3.4)
    for axes, values, label in zip(
        panels, curves, (tr("angle (°)"), tr("velocity (°/s)"), tr("acceleration (°/s²)")), strict=True
    ):
        for joint, (name, curve) in enumerate(zip(JOINT_NAMES, np.degrees(values).T)):
            axes.plot(t, curve, color=f"C{joint}", label=name)
        axes.set(xlabel=tr("time (s)"), ylabel=label)
    panels[0].legend(ncols=2)
    return Picture(
        figure,
        tr("Angles, velocities and accelerations of the article's joint move over time"),
        tr(
            "The article's joint move: at most {speed}°/s and {acceleration}°/s².",
            speed=fixed(numbers.move_speed_deg_s, 1),
            acceleration=fixed(numbers.move_acceleration_deg_s2, 1),
        ),
        over_time=[(axes, "article_joint") for axes in panels],
    )


def _line(results: Path, tables: tuple[str, ...], names: list[str], numbers: ArticleNumbers) -> Picture:
    figure, axes = new_figure(width=8.0, height=3.8)
    for table, name, colour in zip(tables, names, COLOURS):
        stored = read_stage(results / table / "trajectory", STAGES["trajectory"]).results
        rows = stored.checks.take((stored.checks.path == LINE) & stored.checks.reachable)
        axes.semilogy(rows.t_s, np.abs(rows.q_deg_s).max(axis=1) + 1e-3, color=colour, label=name)
    for found, colour in zip((numbers.printed, numbers.corrected), COLOURS):
        for t in found.line_crossings_s:
            axes.axvline(t, color=colour, linestyle=":", linewidth=1.2)
    axes.set(xlabel=tr("time (s)"), ylabel=tr("fastest joint (°/s)"))
    axes.legend(loc="lower center")
    return Picture(
        figure,
        tr("The fastest joint along the article's straight line over time, of two tables, and where it is singular"),
        tr(
            "The article's straight line. Dotted: singular poses. The fastest joint reaches {printed}°/s as printed "
            "and {corrected}°/s with offset 2 = −90°.",
            printed=number(numbers.printed.line_speed_deg_s, 4),
            corrected=number(numbers.corrected.line_speed_deg_s, 4),
        ),
        over_time=[(axes, LINE)],
    )


def _measures(robot: Robot, seed: int, numbers: ArticleNumbers) -> Picture:
    measures = conditioning(robot, random_joints(robot, seed, COMPARED), characteristic_length(robot))
    figure, axes = new_figure(width=6.5, height=4.2)
    axes.loglog(measures.manipulability, measures.condition_number, ".", color=INK, markersize=3, alpha=0.6)
    axes.set(xlabel=tr("manipulability"), ylabel=tr("condition number"))
    return Picture(
        figure,
        tr("Condition number against manipulability at random poses"),
        tr(
            "{count} random poses of the printed table. Of two of them both measures name another one as nearer to a "
            "singularity in {apart} % of the cases.",
            count=COMPARED,
            apart=fixed(numbers.ranked_apart_percent, 0),
        ),
    )
