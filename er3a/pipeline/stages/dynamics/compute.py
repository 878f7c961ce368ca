"""Compute what the motors of a robot feel along its paths and at rest, and whether drives and wrist bear it."""

from __future__ import annotations

import numpy as np

from er3a.dynamics.arm_model import drives_of
from er3a.dynamics.holding import worst_holding
from er3a.dynamics.link_shapes import estimated_links
from er3a.dynamics.plausibility import mass_findings
from er3a.dynamics.uncertainty import ASSUMED
from er3a.files.load_file import load_of
from er3a.pipeline.results import Figure
from er3a.pipeline.stages.dynamics.drive_verdict import drive_uses, unknowns, verdict_of
from er3a.pipeline.stages.dynamics.entry import DynamicsSettings
from er3a.pipeline.stages.dynamics.model import (
    DynamicsResults,
    DynamicsSummary,
    HoldingTorque,
    LinkEntry,
    MassesUsed,
    MotorNeed,
    TolerancesUsed,
    TorqueRows,
    hardest_held,
)
from er3a.pipeline.stages.dynamics.path_loads import LoadedArm, PathTorques, path_torques
from er3a.pipeline.stages.dynamics.wrist_check import diagram_rows, wrist_uses
from er3a.pipeline.stages.trajectory.entry import TrajectorySettings
from er3a.pipeline.stages.trajectory.listed_motions import study_motions
from er3a.pipeline.stages.trajectory.motion_demands import limits_of
from er3a.pipeline.study import Study
from er3a.robots.masses import LinkMass, Load, MassBody, Masses
from er3a.robots.robot import Grade, Robot

CHECKS_PER_SAMPLE = 1
WRIST_JOINTS = 3
NO_FIGURE = Figure("holding_torque", None, "")


def compute(study: Study, name: str) -> DynamicsResults:
    """Compute the dynamics stage of a robot."""
    settings = study.section(DynamicsSettings)
    given = study.robot(name)
    robot = with_estimates(given, settings.capsule_density_kg_m3)
    loads = study.loads(name)
    load, load_grade = load_of(loads), _worst_grade([each.grade for each in loads])
    grade = "inferred" if robot is not given else _links_grade(given)
    moving = any(each.link > 0 for each in robot.masses.links)
    arm = _loaded_arm(study, robot, load, (grade, load_grade), settings)
    paths = _paths(study, name, arm, settings) if moving else []
    holding = _holding(arm) if moving else ()
    motors = _motors(robot, paths, holding) if any(path.demand for path in paths) else ()
    summaries = tuple(path.summary for path in paths)
    uses = (
        *drive_uses(robot, summaries, holding),
        *wrist_uses(robot, load, load_grade, settings.gravity_m_s2, summaries),
    )
    uses = tuple(sorted(uses, key=lambda use: -use.ratio))
    findings = mass_findings(robot) if moving else ()
    unknown = unknowns(robot, load)
    masses = _masses_used(given, robot, load, (grade, load_grade if load else None), settings)
    imbalances = [path.imbalance for path in paths if path.imbalance is not None]
    summary = DynamicsSummary(
        verdict=verdict_of(summaries, holding, uses, findings, unknown, masses),
        figures=_figures(summaries, holding, uses, imbalances, masses),
        gravity_m_s2=settings.gravity_m_s2,
        masses=masses,
        findings=findings,
        unknown=unknown,
        payload_centre_mm=tuple(settings.payload_centre_mm),
        payload_gyration_mm=settings.payload_gyration_mm,
        paths=summaries,
        holding=holding,
        motors=motors,
        uses=uses,
        power_imbalance=max(imbalances, default=None),
    )
    rows = TorqueRows.stacked([path.rows for path in paths if path.demand]) if motors else TorqueRows.empty()
    return DynamicsResults(summary, rows, diagram_rows(robot, load, settings.gravity_m_s2))


def with_estimates(robot: Robot, density: float | None) -> Robot:
    """The robot with guessed masses for links that have none, if a density asks for them; itself if none is missing."""
    if density is None:
        return robot
    known = robot.masses.links
    missing = [each for each in estimated_links(robot, density) if robot.masses.body(each.link) is None]
    if not missing:
        return robot
    links: tuple[LinkMass, ...] = tuple(sorted((*known, *missing), key=lambda each: each.link))
    kept = robot.masses
    return robot.replace(masses=Masses(links, kept.drives, kept.wrist, kept.weight))


def _links_grade(robot: Robot) -> Grade:
    source = robot.sources.get("inertia")
    return source.grade if source else "inferred"


def _worst_grade(grades: list[Grade]) -> Grade:
    order: tuple[Grade, ...] = ("measured", "official", "cad", "export", "claim", "inferred")
    return max(grades, key=order.index, default="official")


def _loaded_arm(
    study: Study, robot: Robot, load: Load | None, grades: tuple[Grade, Grade], settings: DynamicsSettings
) -> LoadedArm:
    trajectory = study.section(TrajectorySettings)
    x, y, z = (value / 1000 for value in settings.payload_centre_mm)
    square = (settings.payload_gyration_mm / 1000) ** 2
    return LoadedArm(
        robot=robot,
        load=load,
        unit_payload=MassBody(1.0, (x, y, z), (square, square, square, 0.0, 0.0, 0.0)),
        gravity=settings.gravity_m_s2,
        links_grade=grades[0],
        load_grade=grades[1],
        limits=limits_of(robot, trajectory),
    )


def _paths(study: Study, name: str, arm: LoadedArm, settings: DynamicsSettings) -> list[PathTorques]:
    joints = arm.robot.joints
    last = range(max(1, joints - WRIST_JOINTS + 1), joints + 1)
    wrist = tuple(joint for joint in last if not arm.robot.slides[joint - 1])
    motions = study_motions(study, name, CHECKS_PER_SAMPLE)
    return [path_torques(arm, each.motion, settings.samples, wrist) for each in motions if each.motion]


def _holding(arm: LoadedArm) -> tuple[HoldingTorque, ...]:
    found = worst_holding(arm.model)
    rest = np.zeros_like(found.q)
    tolerance = np.diagonal(arm.tolerance(found.q, rest, rest))
    slides = arm.robot.slides
    q = np.where(slides, 1000 * found.q, np.degrees(found.q))
    return tuple(
        HoldingTorque(
            joint=j + 1,
            torque=float(found.values[j]),
            bound=float(found.bound[j]),
            tolerance=float(tolerance[j]),
            unit="N" if slides[j] else "N m",
            q=tuple(q[j].tolist()),
        )
        for j in range(arm.robot.joints)
    )


def _motors(robot: Robot, paths: list[PathTorques], holding: tuple[HoldingTorque, ...]) -> tuple[MotorNeed, ...]:
    asked = [path.demand for path in paths if path.demand]
    drives = drives_of(robot)
    low = np.nanmin([path.inertia[:, 0] for path in paths], axis=0)
    high = np.nanmax([path.inertia[:, 1] for path in paths], axis=0)
    speed = np.max([each.speed for each in asked], axis=0)
    found = []
    for j, slides in enumerate(robot.slides):
        peak = max(float(each.peak[j]) for each in asked)
        ratio = drives.gear_ratio[j]
        found.append(
            MotorNeed(
                joint=j + 1,
                unit="N" if slides else "N m",
                peak=peak,
                rms=max(float(each.rms[j]) for each in asked),
                holding=abs(holding[j].torque),
                speed=float(1000 * speed[j] if slides else np.degrees(speed[j])),
                power_w=max(float(each.power[j]) for each in asked),
                inertia_low=float(low[j]),
                inertia_high=float(high[j]),
                inertia_ratio=_known(high[j] / drives.armature[j]) if drives.armature[j] > 0 else None,
                motor_rpm=_known(speed[j] * ratio * 30 / np.pi) if not slides else None,
                motor_torque=_known(peak / ratio),
                peak_limit=_known(drives.peak[j]),
                rated_limit=_known(drives.rated[j]),
            )
        )
    return tuple(found)


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _masses_used(
    given: Robot, robot: Robot, load: Load | None, grades: tuple[Grade, Grade | None], settings: DynamicsSettings
) -> MassesUsed | None:
    if not robot.masses.links:
        return None
    links = []
    for link in range(robot.rows + 1):
        body = robot.masses.body(link)
        centre = tuple(1000 * value for value in body.centre) if body else ()
        links.append(LinkEntry(link, body.mass if body else None, centre, given.masses.body(link) is not body))
    source = robot.sources.get("inertia")
    stated = [each.body for each in given.masses.links if each.link > 0]
    own = bool(stated) and all(body.mass_tolerance is not None for body in stated)
    tolerance = ASSUMED[grades[0]]
    return MassesUsed(
        grade=grades[0],
        source=source.source if source else "",
        density_kg_m3=settings.capsule_density_kg_m3 if robot is not given else None,
        links=tuple(links),
        weight_kg=_known(robot.masses.weight),
        load_kg=load.mass if load else None,
        load_centre_mm=tuple(1000 * value for value in load.centre) if load else (),
        load_grade=grades[1],
        tolerances=TolerancesUsed(grades[0], 100 * tolerance.mass_ratio, 1000 * tolerance.centre, not own),
    )


def _figures(summaries, holding, uses, imbalances, masses) -> tuple[Figure, ...]:
    loads = [load for path in summaries for load in path.joints]
    turning = [load for load in loads if load.unit == "N m"]
    peak = max(turning, key=lambda load: load.peak, default=None)
    held = hardest_held(holding) if holding else None
    energy = [sum(load.work_j for load in path.joints) for path in summaries if path.complete]
    total = sum(link.mass_kg or 0.0 for link in masses.links) if masses else None
    figures = (
        Figure("paths", sum(path.complete for path in summaries), "", of=len(summaries)),
        Figure("mass", total, "kg"),
        Figure("peak_torque", peak.peak if peak else None, "N m", peak.tolerance if peak else None),
        Figure("holding_torque", abs(held.torque), held.unit, held.tolerance) if held else NO_FIGURE,
        Figure("energy", max(energy, default=None), "J"),
        Figure("utilisation", 100 * uses[0].ratio if uses else None, "%"),
        Figure("power_balance", max(imbalances) * 1e9 if imbalances else None, "ppb"),
    )
    return tuple(figure for figure in figures if figure.value is not None and figure.of != 0)
