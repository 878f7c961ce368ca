"""Figures of the dynamics page: torques and powers over time, holding torques, the load diagram."""

from __future__ import annotations

import numpy as np

from er3a.pipeline.messages.language import tr
from er3a.pipeline.stages.dynamics.model import DiagramRows, DynamicsSummary, PathLoad, TorqueRows, Unit, hardest_held
from er3a.pipeline.viewing.figures import new_figure, row_of_panels
from er3a.pipeline.viewing.page import Picture, number
from er3a.pipeline.viewing.palette import HIGHLIGHT, INK, JOINTS, MUTED

DRAWN = 161
PARTS = ("gravity", "inertia", "velocity", "friction", "tool")
STYLES = ("-", "--", ":", "-.", (0, (6, 2, 1, 2, 1, 2)))


def joint_colour(joint: int) -> str:
    """The colour of a joint (from 0)."""
    return JOINTS[joint % len(JOINTS)]


def bound_text(bound: float) -> str:
    """Four digits of an upper bound, rounded up, because fewer would claim more."""
    digit = 10.0 ** (np.floor(np.log10(bound)) - 3) if bound else 1.0
    return number(float(np.ceil(bound / digit - 1e-5) * digit), 4)


def torque_unit(units: set[Unit]) -> str:
    """The unit of torques and forces of several joints, for a heading."""
    return units.pop() if len(units) == 1 else tr("N m or N")


def torque_figure(path: PathLoad, rows: TorqueRows) -> Picture:
    """Torques of all joints with their intervals, the parts of the most loaded one, and powers."""
    rows = rows.take(np.unique(np.linspace(0, len(rows) - 1, min(DRAWN, len(rows))).round().astype(int)))
    figure, (torque, parts, power) = row_of_panels(3, 13.0, 3.4, (0.75, 0.55, 0.1, 0.15, 0.85))
    load, unit = path.hardest, torque_unit({load.unit for load in path.joints})
    worst = load.joint - 1
    for j in range(rows.torque.shape[1]):
        colour = joint_colour(j)
        low, high = rows.torque[:, j] - rows.tolerance[:, j], rows.torque[:, j] + rows.tolerance[:, j]
        torque.fill_between(rows.t_s, low, high, color=colour, alpha=0.15, linewidth=0)
        torque.plot(rows.t_s, rows.torque[:, j], color=colour, label=f"J{j + 1}")
        power.plot(rows.t_s, rows.power_w[:, j], color=colour, label=f"J{j + 1}")
    torque.legend(ncols=3, fontsize=8)
    torque.set_ylabel(tr("drive torque ({unit})", unit=unit))
    names = dict(
        zip(
            PARTS, (tr("gravity"), tr("inertia"), tr("Coriolis, centrifugal"), tr("friction"), tr("forces at the tool"))
        )
    )
    for part, style in zip(PARTS, STYLES):
        if part == "tool" and not rows.tool.any():
            continue
        parts.plot(rows.t_s, getattr(rows, part)[:, worst], color=INK, linestyle=style, label=names[part])
    parts.legend(fontsize=8)
    parts.set_ylabel(tr("contributions at J{joint} ({unit})", joint=worst + 1, unit=load.unit))
    power.axhline(0.0, color=MUTED, linewidth=0.8)
    power.set_ylabel(tr("drive power (W)"))
    for ax in (torque, parts, power):
        ax.set_xlabel(tr("time (s)"))
    most = max(PARTS, key=lambda part: getattr(load, part))
    caption = tr(
        "J{joint} needs the greatest torque, {peak} ± {tolerance} {unit} at {t:.2f} s; largest contribution: "
        "{part}. Shaded: uncertainty of the torques from the tolerances of masses and centres. Power below 0 is"
        " fed back to the drive.",
        joint=load.joint,
        peak=number(load.peak, 3),
        tolerance=number(load.tolerance, 2),
        unit=load.unit,
        t=load.peak_at_s,
        part=names[most],
    )
    alt = tr("Three panels over time for {path}: torques, their contributions, powers.", path=path.name)
    return Picture(figure, alt, caption, [(ax, path.name) for ax in (torque, parts, power)])


def holding_figure(summary: DynamicsSummary) -> Picture:
    """Bars of the greatest holding torque at each joint."""
    figure, ax = new_figure(1, 1, width=7.0, height=2.8)
    joints = np.arange(len(summary.holding))
    size = np.array([abs(held.torque) for held in summary.holding])
    tolerance = np.array([held.tolerance for held in summary.holding])
    ax.bar(joints, size, color=[joint_colour(int(j)) for j in joints], width=0.6)
    ax.errorbar(joints, size, yerr=tolerance, fmt="none", ecolor=INK, capsize=4)
    ax.set_xticks(joints, [f"J{j + 1}" for j in joints])
    ax.set_ylabel(tr("holding torque ({unit})", unit=torque_unit({held.unit for held in summary.holding})))
    ax.grid(visible=False, axis="x")
    worst = hardest_held(summary.holding)
    caption = tr(
        "At rest J{joint} needs the greatest holding torque: {torque} ± {tolerance} {unit}. No pose within the "
        "joint limits needs more than {bound} {unit} there, for the masses as given.",
        joint=worst.joint,
        torque=number(abs(worst.torque), 3),
        tolerance=number(worst.tolerance, 2),
        unit=worst.unit,
        bound=bound_text(worst.bound),
    )
    return Picture(figure, tr("Bars: the greatest holding torque at each joint, with its tolerance."), caption)


def diagram_figure(summary: DynamicsSummary, rows: DiagramRows) -> Picture:
    """The load diagram, with the load in it."""
    figure, ax = new_figure(1, 1, width=7.0, height=4.2)
    for i, mass in enumerate(np.unique(rows.mass_kg)):
        own = rows.take(rows.mass_kg == mass)
        ax.plot(own.along_mm, own.across_mm, color=joint_colour(i), label=tr("{mass:.3g} kg", mass=mass))
    masses = summary.masses
    if masses and masses.load_kg is not None:
        x, y, z = masses.load_centre_mm
        ax.plot([z], [np.hypot(x, y)], "o", color=HIGHLIGHT, label=tr("the load, {mass:.3g} kg", mass=masses.load_kg))
    ax.set_xlim(left=0)
    ax.set_ylim(bottom=0)
    ax.set_xlabel(tr("from the flange along the last axis (mm)"))
    ax.set_ylabel(tr("from the last axis (mm)"))
    ax.legend(loc="upper right")
    caption = tr(
        "A load whose centre lies below the curve of its mass is within the allowed moments and inertias of the wrist. "
        "The curves take the load as a point; its own inertia counts in the comparison above."
    )
    return Picture(figure, tr("The load diagram: one curve for each mass."), caption)
