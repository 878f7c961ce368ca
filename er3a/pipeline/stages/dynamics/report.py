"""The dynamics page, rendered from the stage's results."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from markupsafe import Markup

from er3a.pipeline.messages.dynamics import BINDING, FIGURES
from er3a.pipeline.messages.dynamics_verdict import quantity_word
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import listed, say, word
from er3a.pipeline.player.player import PlayedEvent, PlayedMotion, moment, player, player_style
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.dynamics.load_figures import PARTS, bound_text, diagram_figure, holding_figure, torque_figure
from er3a.pipeline.stages.dynamics.model import (
    BindingLimit,
    DynamicsResults,
    DynamicsSummary,
    HoldingTorque,
    JointLoad,
    MotorNeed,
    PathLoad,
    Unit,
    Use,
)
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.page import fixed, head_of, number, render, run_command
from er3a.pipeline.viewing.panel_link import panel_link
from er3a.robots.robot import Robot
from er3a.robots.shown import meant

MOST_USES = 12
NONE = "–"


def report(study: Study, stored: Stored[DynamicsResults], output: Path) -> None:
    """Write the dynamics page of a robot."""
    robot, results = study.robot(stored.robot), stored.results
    summary = results.summary
    figures = [
        (path, torque_figure(path, results.torques.take(results.torques.path == path.name)))
        for path in summary.paths
        if path.complete
    ]
    holding = holding_figure(summary) if summary.holding else None
    diagram = diagram_figure(summary, results.diagram) if len(results.diagram) else None
    render(
        Path(__file__).with_name("report.html.j2"),
        output,
        summary,
        head=head_of(stored, FIGURES),
        command=run_command(study, f"{stored.robot}/dynamics.html"),
        robot=robot,
        robot_pages=study.pages(stored.robot),
        findings=listed(summary.findings),
        unknown=listed(summary.unknown),
        links=_links(summary),
        uses=[_use(use) for use in summary.uses[:MOST_USES]],
        more_uses=max(0, len(summary.uses) - MOST_USES),
        motors=[_motor(motor) for motor in summary.motors],
        paths=[_path(path) for path in summary.paths],
        margins=any(path.payload or path.speed_scale or path.torque_timed_s for path in summary.paths),
        figures=figures,
        player=player(robot, _motions(robot, results)),
        player_style=player_style(),
        joints=[(path.name, _joints(path)) for path in summary.paths if path.complete],
        wrist=_wrist(summary),
        wrist_uses=_wrist_uses(summary),
        units=_units(summary),
        holding=holding,
        held=[_held(held) for held in summary.holding],
        diagram=diagram,
    )


def _motions(robot: Robot, results: DynamicsResults) -> list[PlayedMotion]:
    """The paths that the arm can follow, with the moment at which each joint feels most."""
    motions = []
    for path in results.summary.paths:
        if not path.complete:
            continue
        rows = results.torques.take(results.torques.path == path.name)
        peaks = [PlayedEvent(load.peak_at_s, load.peak_at_s, _peak(load), "plain") for load in path.joints]
        motions.append(PlayedMotion(path.name, "", rows.t_s, meant(robot, rows.q), peaks))
    return motions


def _peak(load: JointLoad) -> str:
    return tr("J{joint} at its peak: {peak} {unit}", joint=load.joint, peak=number(load.peak, 3), unit=load.unit)


def _links(summary: DynamicsSummary) -> list[list[str]]:
    rows = []
    for link in summary.masses.links if summary.masses else ():
        name = tr("base") if link.link == 0 else str(link.link)
        origin = tr("guessed") if link.estimated else tr("file") if link.mass_kg is not None else tr("unknown")
        mass = number(link.mass_kg, 4) if link.mass_kg is not None else NONE
        rows.append([name, mass, ", ".join(fixed(value, 1) for value in link.centre_mm) or NONE, origin])
    return rows


def _use(use: Use) -> list[str]:
    return [
        quantity_word(use.quantity),
        f"J{use.joint}" if use.joint else NONE,
        use.path or tr("at rest"),
        number(use.asked, 3),
        number(use.upper, 3),
        number(use.allowed, 3),
        use.unit,
        fixed(100 * use.ratio, 0),
    ]


def _units(summary: DynamicsSummary) -> dict[str, str]:
    """Units of torques, speeds and inertias in headings, by what the arm's joints do."""
    torque = {held.unit for held in summary.holding}
    turning = {"torque": "N m", "speed": "deg/s", "inertia": "kg m²"}
    sliding = {"torque": "N", "speed": "mm/s", "inertia": "kg"}
    mixed = {"torque": tr("N m or N"), "speed": tr("deg/s or mm/s"), "inertia": tr("kg m² or kg")}
    return mixed if len(torque) > 1 else sliding if torque == {"N"} else turning


def _label(joint: int, unit: Unit) -> str:
    return f"J{joint}" if unit == "N m" else tr("J{joint} (slides)", joint=joint)


def _motor(motor: MotorNeed) -> list[str]:
    inertia = f"{number(motor.inertia_low, 2)} – {number(motor.inertia_high, 2)}"
    needs = motor.peak, motor.rms, motor.holding, motor.speed, motor.power_w
    return [
        _label(motor.joint, motor.unit),
        *(number(_no_noise(value), 3) for value in needs),
        inertia,
        *(
            NONE if value is None else number(value, 3)
            for value in (
                motor.inertia_ratio,
                motor.motor_torque,
                motor.motor_rpm,
                motor.rated_limit,
                motor.peak_limit,
            )
        ),
    ]


def _path(path: PathLoad) -> list[str]:
    if not path.complete:
        return [path.name, tr("not followed to its end"), *[NONE] * 6]
    worst = path.hardest
    energy, back = sum(load.work_j for load in path.joints), sum(load.recovered_j for load in path.joints)
    timed = NONE if path.torque_timed_s is None else fixed(path.torque_timed_s, 2)
    if path.no_law:
        timed = say(path.no_law)
    return [
        Markup('<a href="#{0}">{0}</a>').format(path.name),
        f"{number(worst.peak, 3)} ± {number(worst.tolerance, 2)} {worst.unit} (J{worst.joint})",
        number(energy, 3),
        number(back, 3),
        _bound(path.payload),
        _bound(path.speed_scale),
        timed,
        NONE if path.kinematic_s is None else fixed(path.kinematic_s, 2),
    ]


def _bound(bound: BindingLimit | None) -> str:
    if bound is None:
        return NONE
    value = tr("no bound") if bound.value is None else number(bound.value, 3)
    if bound.by is None:
        return value
    return f"{value} (J{bound.joint}, {word('dynamics.binding', BINDING, bound.by)})"


def _joints(path: PathLoad) -> list[list[str]]:
    return [
        [
            _label(load.joint, load.unit),
            f"{number(_no_noise(load.peak), 3)} ± {number(_no_noise(load.tolerance), 2)}",
            moment(path.name, load.peak_at_s, fixed(load.peak_at_s, 2)),
            f"{number(_no_noise(load.rms), 3)} ± {number(_no_noise(load.rms_tolerance), 2)}",
            *(number(_no_noise(getattr(load, part)), 3) for part in PARTS),
            _both(load.power_w, load.braking_w),
            _both(load.work_j, load.recovered_j),
        ]
        for load in path.joints
    ]


def _both(given: float, taken: float) -> Markup:
    return Markup("{}<br>{}").format(number(_no_noise(given), 3), number(_no_noise(taken), 3))


def _held(held: HoldingTorque) -> list[str]:
    found, bound, tolerance = (_no_noise(value) for value in (abs(held.torque), held.bound, held.tolerance))
    pose = panel_link(held.q, ", ".join(fixed(value, 0) for value in held.q))
    return [_label(held.joint, held.unit), number(found, 4), bound_text(bound), number(tolerance, 2), pose]


def _wrist_uses(summary: DynamicsSummary) -> list[list[str]]:
    at_rest = [use for use in summary.uses if use.path is None and use.quantity in ("payload", "moment", "inertia")]
    return [[*_use(use)[:2], *_use(use)[3:]] for use in at_rest]


def _wrist(summary: DynamicsSummary) -> list[list[str]]:
    return [
        [
            path.name,
            f"J{moment.joint}",
            f"{number(_no_noise(moment.moment_n_m), 3)} ± {number(_no_noise(moment.tolerance), 2)}",
            fixed(moment.t_s, 2),
        ]
        for path in summary.paths
        for moment in path.wrist
    ]


def _no_noise(value: float) -> float:
    return 0.0 if abs(value) < 1e-9 or not np.isfinite(value) else value
