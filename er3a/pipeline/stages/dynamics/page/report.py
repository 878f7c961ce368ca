"""The dynamics page, rendered from the stage's results."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from markupsafe import Markup

from er3a.pipeline.language import own_title, tr, with_unit, words
from er3a.pipeline.messages.dynamics import BINDING, payload_key, payload_text, use_text
from er3a.pipeline.messages.numbers import at_least, decimals_of_column, fixed, number
from er3a.pipeline.messages.say import bracketed, joined, listed, word
from er3a.pipeline.player.motions import at_rest
from er3a.pipeline.player.player import drawing_head, player
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.dynamics import model
from er3a.pipeline.stages.dynamics.page.played import hanging, held, holding_name, motions, within
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, Fix, Group, ListRow, Part
from er3a.pipeline.viewing.figures import SIDE, axis_label, new_figure
from er3a.pipeline.viewing.page import Picture, panel_link, render_stage
from er3a.pipeline.viewing.palette import JOINTS
from er3a.robots.robot import Robot

DRAWN = 161
FEW = 0.02  # of the longest bar: joints that bear less are one line


def torque_figure(path: model.PathLoad, rows: model.TorqueRows) -> Picture:
    """Torques of all joints with their intervals."""
    rows = rows.take(np.unique(np.linspace(0, len(rows) - 1, min(DRAWN, len(rows))).round().astype(int)))
    figure, torque = new_figure(width=SIDE, height=4.6)
    unit = model.shared_unit(load.unit for load in path.joints)
    for j in range(rows.torque.shape[1]):
        colour = JOINTS[j % len(JOINTS)]
        low, high = rows.torque[:, j] - rows.tolerance[:, j], rows.torque[:, j] + rows.tolerance[:, j]
        torque.fill_between(rows.t_s, low, high, color=colour, alpha=0.15, linewidth=0)
        torque.plot(rows.t_s, rows.torque[:, j], color=colour, label=f"J{j + 1}")
    torque.legend(ncols=6, handlelength=0.8, loc="lower left", bbox_to_anchor=(0, 1))
    torque.set_ylabel(axis_label(rows, "torque", unit))
    torque.set_xlabel(axis_label(rows, "t_s"))
    caption = tr("Shaded: tolerance of the masses.")
    return Picture(figure, caption, caption, [(torque, path.name)])


def held_parts(robot: Robot, masses: model.MassesUsed | None, held: model.HoldingTorque) -> Group | None:
    """What each link adds to what a joint holds, its mass times its level distance; None where more than links hang."""
    links, _, kg, off = hanging(robot, masses, held)
    if not links:
        return None
    lever = kg @ off * [1, 1, 0]
    far = off @ lever / np.linalg.norm(lever)
    shares = kg * far / (kg @ far)
    names = [tr("link {number}", number=each.link) for each in links]
    parts = zip(names, kg, far, shares, np.cumsum(shares))
    rows = []
    for name, mass, way, share, end in (*parts, (tr("all"), kg.sum(), kg @ far / kg.sum(), 1.0, 1.0)):
        said = joined([name, with_unit(fixed(abs(held.torque) * share, 1), held.unit)], ": ")
        note = f"{with_unit(number(mass, 3), 'kg')} × {with_unit(fixed(1000 * way, 0), 'mm')}"
        part = Part(max(0.0, end - share), end, "none")
        rows.append(ListRow("none", said, note, length=1.0, parts=[part]))
    return Group(tr("Link mass × level distance to J{joint}.", joint=held.joint), rows, counted=False)


MAX_USES = 12
NONE = "–"
WITHOUT = words(
    {"load": "load", "friction": "friction", "rotor_inertias": "rotors", "link_masses": "mass of link {links}"}
)


def report(study: Study, stored: Stored[model.DynamicsResults], output: Path) -> None:
    """Write the dynamics page of a robot."""
    robot, results = study.robot(stored.robot), stored.results
    summary, file = results.summary, str(study.robot_file(stored.robot))
    figures = [
        (path.name, torque_figure(path, results.torques.take(results.torques.path == path.name)))
        for path in summary.paths
        if path.complete
    ]
    render_stage(
        study,
        stored,
        output,
        _answer(robot, results, file),
        payload=payload_text(summary, robot),
        findings=listed(summary.findings),
        links=_links(summary),
        uses=[use_text(use) for use in summary.uses[:MAX_USES]],
        motors=_motors(summary.motors),
        needs=[_need(results, motor) for motor in summary.motors],
        limited=_limited(summary),
        paths=[_path(path) for path in summary.paths if path.counts],
        not_run=joined((path.name for path in summary.paths if not path.counts), ", "),
        margins=any(path.payload or path.speed_scale for path in summary.paths),
        figures=figures,
        parts=[
            (holding_name(each.joint), own)
            for each in summary.holding
            if (own := held_parts(robot, summary.masses, each))
        ],
        player=player(
            robot,
            [*motions(robot, results), *held(robot, results)] or [at_rest(robot, own_title(robot.title))],
            opened=_opened(results, _worst(summary.motors)) if summary.motors else None,
        ),
        drawing_head=drawing_head(),
        units=_units(summary),
        held=_held(summary.holding),
    )


def _opened(results: model.DynamicsResults, motor: model.MotorNeed) -> tuple[str, float]:
    """Where a joint needs most: the pose that it holds, if that asks for more than any path."""
    return max(_needs(results, motor))[2]


def _moment_of(results: model.DynamicsResults, motor: model.MotorNeed) -> tuple[str, float, float]:
    """The path and the time (s) at which a joint needs most, and the tolerance of that."""
    rows = results.torques
    at = int(np.argmin(np.abs(np.abs(rows.torque[:, motor.joint - 1]) - motor.peak)))
    return str(rows.path[at]), float(rows.t_s[at]), float(rows.tolerance[at, motor.joint - 1])


def _needs(
    results: model.DynamicsResults, motor: model.MotorNeed
) -> list[tuple[tuple[float, float], str, tuple[str, float]]]:
    """The most that a joint bears at rest and moving, with its tolerance; when that is, in words and for a player."""
    path, t, off = _moment_of(results, motor)
    held, name = results.summary.holding[motor.joint - 1], holding_name(motor.joint)
    moving = (motor.peak, off), joined([f"J{motor.joint}", path], ", "), (path, t)
    return [((motor.holding, held.tolerance), name, (name, 0.0)), moving]


def _need(results: model.DynamicsResults, motor: model.MotorNeed) -> str:
    """The most that a joint bears, moving or at rest, with the tolerance of that; nothing where no mass is known."""
    most, *_ = max(_needs(results, motor))
    return with_unit(within(*most), motor.unit) if any(most) else "?"


def _worst(motors: Sequence[model.MotorNeed]) -> model.MotorNeed:
    return max(motors, key=lambda motor: motor.peak if motor.unit == motors[0].unit else 0.0)


def _answer(robot: Robot, results: model.DynamicsResults, file: str) -> Answer:
    """The greatest torque that is needed, and that of each joint against its limit."""
    summary = results.summary
    value, meaning = payload_key(summary, robot)
    payload = value, Markup('<a href="#payload">{}</a>').format(meaning)
    if not summary.motors:
        held = model.hardest_held(summary.holding) if summary.holding else None
        if held is None:
            return Answer(tr("Torques need the links' masses."), tr("No usable ones are given."), keys=[payload])
        torque = with_unit(within(abs(held.torque), held.tolerance), held.unit)
        return Answer(tr("J{joint} bears most: {torque}.", joint=held.joint, torque=torque), keys=[payload])
    worst = _worst(summary.motors)
    limited = _limited(summary)
    over = [f"J{motor.joint}" for motor in summary.motors if _mark(motor) == "fail"]
    bears = tr("J{joint} bears most: {torque}.", joint=worst.joint, torque=_need(results, worst))
    headline = tr("Within all limits.") if limited else bears
    if over:
        headline = tr("Too much for {joints}.", joints=joined(over, ", "))
    needs = [(motor, *need) for motor in summary.motors for need in _needs(results, motor)]
    most = max(sum(need) for _, need, *_ in needs) or 1.0
    step = 10.0 ** np.floor(np.log10(most))
    scale = float(step * np.ceil(most / step))  # of all bars without a limit of their own
    felt = [each for each in needs if each[0].peak_limit is not None or sum(each[1]) >= FEW * scale]
    felt.sort(key=lambda each: -each[1][0])
    still, moving = (
        [
            _row(motor, need, title, moment, scale, None if rests else motor.peak_limit)
            for motor, need, title, moment in felt
            if (moment[0] == holding_name(motor.joint)) == rests
        ]
        for rests in (True, False)
    )
    few = [f"J{motor.joint}" for motor in summary.motors if motor not in [each[0] for each in felt]]
    ends = [with_unit(f"{share * scale:g}", worst.unit) for share in (1.0, FEW)]
    if few:
        moving.append(ListRow("none", joined(few, ", "), tr("less than {few}", few=ends[1])))
    left = [
        tr(WITHOUT[each.reason], links=joined(each.names, " + ")) for each in summary.assumed if each.reason in WITHOUT
    ]
    todo = tr("enter the motors' peak torques: {file}", file=file)
    return Answer(
        headline,
        "" if limited or over else tr("Not judged: limits missing."),
        tr("± from the masses. Not included: {parts}.", parts=joined(left, ", ")) if left else "",
        [payload],
        [
            Group(title, rows, counted=False)
            for title, rows in (
                (tr("Held still, worst pose; bars to {most}", most=ends[0]), still),
                (tr("Greatest torque on the paths"), moving),
            )
        ],
        None if limited else Fix(todo, "#drives", False),
    )


def _limited(summary: model.DynamicsSummary) -> bool:
    """Whether the limits of all motors are known."""
    return all(motor.peak_limit is not None for motor in summary.motors)


def _mark(motor: model.MotorNeed) -> Literal["pass", "fail", "none"]:
    """Whether a joint's greatest torque is within its limit; ``none`` where that is not known."""
    if motor.peak_limit is None:
        return "none"
    return "pass" if motor.peak <= motor.peak_limit else "fail"


def _row(
    motor: model.MotorNeed,
    need: tuple[float, float],
    name: str,
    moment: tuple[str, float],
    most: float,
    limit: float | None = None,
) -> ListRow:
    """What a joint needs at a moment with its tolerance, as a bar of its limit, or else of the scale of all."""
    value, (share, spread) = within(*need, decimals=1), np.minimum(1.0, np.array(need) / (limit or most))
    if limit:
        value = tr("{value} of {limit}", value=value, limit=number(limit, 2))
    mark = _mark(motor) if limit else "none"
    parts = [Part(0.0, share, mark), Part(share, 1.0, "rest"), Part(share - spread, share + spread, "spread")]
    return ListRow(mark, name, with_unit(value, motor.unit), f"#{moment[0]}", moment, 1.0, parts)


def _links(summary: model.DynamicsSummary) -> list[list[str]]:
    rows = []
    for link in summary.masses.links if summary.masses else ():
        name = tr("base") if link.link == 0 else str(link.link)
        origin = tr("guessed") if link.estimated else tr("file") if link.mass_kg is not None else tr("unknown")
        mass = fixed(link.mass_kg, 3) if link.mass_kg is not None else NONE
        rows.append([name, mass, ", ".join(fixed(value, 1) for value in link.centre_mm) or NONE, origin])
    return rows


def _units(summary: model.DynamicsSummary) -> dict[str, str]:
    """Units of torques and speeds in headings, by what the arm's joints do."""
    torque = model.shared_unit(held.unit for held in summary.holding)
    speeds = {model.TORQUE: "°/s", model.FORCE: "mm/s"}
    return {"torque": tr(torque), "speed": speeds.get(torque, tr("°/s or mm/s"))}


def _label(joint: int, unit: model.Unit) -> str:
    return f"J{joint}" if unit == model.TORQUE else tr("J{joint} (slides)", joint=joint)


def _motors(motors: Sequence[model.MotorNeed]) -> list[list[str]]:
    torque = decimals_of_column(value for motor in motors for value in (motor.peak, motor.holding))
    power = decimals_of_column(motor.power_w for motor in motors)
    return [
        [
            _label(motor.joint, motor.unit),
            *(fixed(value, torque) if motor.inertia_high else NONE for value in (motor.peak, motor.rms, motor.holding)),
            fixed(motor.speed, 1),
            fixed(motor.power_w, power) if motor.inertia_high else NONE,
            *(
                NONE if value is None else number(value, 3)
                for value in (motor.motor_torque, motor.motor_rpm, motor.rated_limit, motor.peak_limit)
            ),
        ]
        for motor in motors
    ]


def _path(path: model.PathLoad) -> list[str]:
    worst = path.hardest
    energy, back = sum(load.work_j for load in path.joints), sum(load.recovered_j for load in path.joints)
    return [
        Markup('<a href="#{0}">{0}</a>').format(path.name),
        f"{within(worst.peak, worst.tolerance)} {worst.unit} (J{worst.joint})",
        fixed(energy, 2),
        fixed(back, 2),
        _bound(path.payload),
        _bound(path.speed_scale),
    ]


def _bound(bound: model.BindingLimit | None) -> str:
    if bound is None:
        return NONE
    value = tr("no bound") if bound.value is None else at_least(bound.value, "")
    if bound.by is None:
        return value
    return bracketed(value, joined([f"J{bound.joint}", word("dynamics.binding", BINDING, bound.by)], ", "))


def _held(holding: Sequence[model.HoldingTorque]) -> list[list[str]]:
    decimals = decimals_of_column(abs(held.torque) for held in holding)
    return [
        [
            _label(held.joint, held.unit),
            fixed(abs(held.torque), decimals),
            fixed(held.tolerance, decimals),
            panel_link(held.q, ", ".join(fixed(value, 0) for value in held.q)),
        ]
        for held in holding
    ]
