"""Compute the torques of a robot's motors along its paths and at rest, and compare them with drives and wrist."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Literal

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.collision.shapes import shapes_assumed
from er3a.dynamics import margins
from er3a.dynamics.arm_model import ArmModel, arm_model, drives_of, estimated_links
from er3a.dynamics.plausibility import has_mass, mass_findings
from er3a.dynamics.torques import (
    Demand,
    TorqueParts,
    demand,
    holding_torques,
    known,
    torque_parts,
    worst_holding,
)
from er3a.files.robot_library import LoadFields, load_of
from er3a.finding import Finding, fact, is_one
from er3a.numerics.arrays import Reals
from er3a.pipeline.results import Figure, Status, Verdict
from er3a.pipeline.scope import GAPS, OF_MOTIONS, Check, Coverage, Open, by_reason, coverages
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.dynamics import model
from er3a.pipeline.stages.dynamics.entry import DynamicsSettings
from er3a.pipeline.stages.trajectory.judgement import Judgement, judged
from er3a.pipeline.stages.trajectory.motion import Motion, PartOfProgram, listed_motions, task_of
from er3a.pipeline.study import Study
from er3a.robots.joint_limits import shown
from er3a.robots.masses import LinkMass, Load, MassBody, Masses, together
from er3a.robots.robot import Grade, Robot, Source


def drive_uses(
    robot: Robot, paths: tuple[model.PathLoad, ...], holding: tuple[model.HoldingTorque, ...]
) -> tuple[model.Use, ...]:
    """Torques that are asked of the drives, against what these allow.

    Parameters
    ----------
    paths : of these only those that count
    holding : greatest torques at rest

    Returns
    -------
    uses : N m, or N of joints that slide: peaks against peak torques, RMS and holding torques against rated ones; none
        of limits that are not known
    """
    drives, found = drives_of(robot), []
    for path in paths:
        for load in path.joints if path.counts else ():
            peak, rated = (float(limit[load.joint - 1]) for limit in (drives.peak, drives.rated))
            if np.isfinite(peak):
                upper = load.peak + load.tolerance
                found.append(model.Use("peak", load.joint, path.name, load.peak, upper, peak, load.unit))
            if np.isfinite(rated):
                upper = load.rms + load.rms_tolerance
                found.append(model.Use("rms", load.joint, path.name, load.rms, upper, rated, load.unit))
    for held in holding:
        rated = float(drives.rated[held.joint - 1])
        if np.isfinite(rated):
            asked = abs(held.torque)
            found.append(model.Use("holding", held.joint, None, asked, asked + held.tolerance, rated, held.unit))
    return tuple(found)


def unknowns(robot: Robot, of_load: Sequence[model.LoadPart | Literal["load"]]) -> tuple[Open, ...]:
    """What the files leave open of masses, drives and wrist.

    Parameters
    ----------
    of_load : what the study leaves open of tool and payload

    Returns
    -------
    open : each kind of value once, with its joints or links; without names if it concerns none of these
    """
    drives, wrist = drives_of(robot), robot.masses.wrist
    links = [str(link) for link in range(1, robot.rows + 1) if not has_mass(robot.masses.body(link))]
    last = {joint for joint in range(1, robot.joints + 1)[-3:] if not robot.slides[joint - 1]}
    joints: dict[str, Iterable[int]] = {
        "peak_torques": _open(drives.peak),
        "rated_torques": _open(drives.rated),
        "rotor_inertias": _open(drives.armature),
        "friction": _open(drives.coulomb + drives.viscous),
        "wrist_moments": last - {joint for joint, _ in (wrist.moment if wrist else ())},
        "wrist_inertias": last - {joint for joint, _ in (wrist.inertia if wrist else ())},
    }
    whole = {
        "rated_payload": wrist is None or not np.isfinite(wrist.payload),
        "drives_guess": _is_guess(robot.sources.get("drives")),
        "wrist_guess": _is_guess(robot.sources.get("wrist_load")),
        "load": bool(of_load),
    }
    found = {"link_masses": links} | {reason: [f"J{joint}" for joint in sorted(of)] for reason, of in joints.items()}
    named = [Open(reason, tuple(names)) for reason, names in found.items() if names]
    parts = {"load": tuple(part for part in of_load if part != "load")}
    return (*named, *(Open(reason, parts.get(reason, ())) for reason, holds in whole.items() if holds))


def _is_guess(source: Source | LoadFields | None) -> bool:
    return source is not None and source.grade == "inferred"


def open_of_load(study: Study, name: str) -> tuple[model.LoadPart | Literal["load"], ...]:
    """What the study does not say of tool and payload, or guesses.

    Parameters
    ----------
    name : of a robot

    Returns
    -------
    parts : ``load`` alone if there is none at all; a mass of 0 says that nothing hangs there
    """
    entry, loads = study.entry(name), study.loads(name)
    if not loads:
        return ("load",)
    scene = study.scene(name, "trajectory")  # what has a shape on the flange, or a tip beside it, has a mass
    has_tool = bool(scene and scene.carried) or not np.array_equal(study.robot(name).tool, np.eye(4))
    bodies = [each.body for each in loads if each.body and each.body.mass_kg]
    asked: dict[model.LoadPart, bool] = {
        "tool": has_tool and not entry.tool_load,
        "carried": not entry.payload,
        "load_centre": any("centre_mm" not in body.model_fields_set for body in bodies),
        "load_inertia": not all(any(body.inertia_kg_m2) for body in bodies),
        "load_guess": any(map(_is_guess, loads)),
    }
    return tuple(part for part, is_open in asked.items() if is_open)


def _open(values: np.ndarray) -> tuple[int, ...]:
    return tuple((np.flatnonzero(np.isnan(values)) + 1).tolist())


DOCUMENTED: tuple[Grade, ...] = ("official", "measured")


def verdict_of(
    paths: list[PathTorques],
    holding: tuple[model.HoldingTorque, ...],
    uses: tuple[model.Use, ...],
    findings: tuple[Finding, ...],
    unknown: tuple[Open, ...],
    masses: model.MassesUsed | None,
    *,
    skipped: tuple[str, ...] = (),
) -> Verdict:
    """The stage's answer, by what is asked for against what is allowed.

    Parameters
    ----------
    uses : the tightest first
    findings : doubts about masses, and links without any
    unknown : what the files leave open
    masses : what was used; a guess allows no pass
    skipped : paths that can't be followed

    Returns
    -------
    verdict : fail if something is beyond its limit; no_reference if there is nothing to compare, or no limit to compare
        it with. It passes only if nothing that the files leave open could change that.
    """
    missing = tuple(found.link for found in findings if is_one(found, "missing_link"))
    doubts = tuple(found for found in findings if not is_one(found, "missing_link"))
    grade = None if masses is None or masses.grade in DOCUMENTED else masses.grade
    shown = {"missing_links": missing, "doubts": doubts, "grade": grade}
    if not uses:
        if not holding:
            return Verdict("no_reference", fact("dynamics.no_data"))
        return Verdict("no_reference", _no_limits([path.summary for path in paths], holding).but(**shown))
    beyond = sum(use.ratio > 1 for use in uses)
    unsettled = sum(use.ratio <= 1 and use.upper > use.allowed for use in uses)
    needs = tuple(each.reason for each in unknown)
    nothing_runs = not any(path.summary.counts for path in paths)
    not_run = (
        *skipped,
        *(path.summary.name for path in paths if (path.asked or nothing_runs) and not path.summary.counts),
    )
    open_ = unsettled or doubts or needs or not_run or grade == "inferred"
    code = "dynamics.overload" if beyond else "dynamics.marginal" if open_ else "dynamics.fits"
    status: Status = "fail" if beyond else "caution" if open_ else "pass"
    counts = {"compared": len(uses), "beyond": beyond, "unsettled": unsettled, "unknown": needs, "not_run": not_run}
    return Verdict(status, fact(code, tightest=fact("dynamics.use", **vars(uses[0])), **counts, **shown))


def _no_limits(paths: list[model.PathLoad], holding: tuple[model.HoldingTorque, ...]) -> Finding:
    counted, at_rest = [path for path in paths if path.counts], model.hardest_held(holding)
    held = fact("dynamics.torque", **vars(at_rest) | {"torque": abs(at_rest.torque), "path": None})
    if not counted:
        return fact("dynamics.no_limits", paths=0, torques=(held,))
    path = max(counted, key=lambda path: path.hardest.peak)
    load = path.hardest
    parts = {"joint": load.joint, "torque": load.peak, "tolerance": load.tolerance, "unit": load.unit}
    more = (held,) if held.torque > load.peak and at_rest.unit == load.unit else ()
    return fact(
        "dynamics.no_limits", paths=len(counted), torques=(fact("dynamics.torque", path=path.name, **parts), *more)
    )


@frozen
class LoadedArm:
    """An arm with its loads.

    Attributes
    ----------
    settings : gravity, and the place of the payload whose greatest mass is computed
    links_grade, load_grade : of the masses
    """

    robot: Robot
    load: Load | None
    settings: DynamicsSettings
    links_grade: Grade
    load_grade: Grade

    @cached_property
    def model(self) -> ArmModel:
        """The arm's model of its motion, with its load."""
        return arm_model(self.robot, self.load, self.settings.gravity_m_s2)

    @cached_property
    def with_unit(self) -> ArmModel:
        """The arm's model with its load and 1 kg more, at the place of the payload."""
        x, y, z = (value / 1000 for value in self.settings.payload_centre_mm)
        square = (self.settings.payload_gyration_mm / 1000) ** 2
        unit = MassBody(1.0, (x, y, z), (square, square, square, 0.0, 0.0, 0.0))
        whole = together([body for body in (self.load, unit) if body])
        return arm_model(self.robot, Load(whole.mass, whole.centre, whole.inertia), self.settings.gravity_m_s2)

    @cached_property
    def bare(self) -> ArmModel:
        """The arm's model without its load."""
        return arm_model(self.robot, None, self.settings.gravity_m_s2)

    def tolerance(self, q: Reals, qd: Reals, qdd: Reals) -> Reals:
        """By how much torques may be off, by the tolerances of links and load.

        Parameters
        ----------
        q, qd, qdd : (N, n), rad (m), per s and per s^2

        Returns
        -------
        half_width : (N, n), N m, or N of joints that slide
        """
        return margins.torque_tolerance(self.model, q, qd, qdd, self.links_grade, self.load_grade)


@by_identity
class PathTorques:
    """A path with its torques.

    Attributes
    ----------
    asked : whether the path is to be run, not to show a fault
    demand : None where the arm can't follow it
    inertia : (n,), largest that each joint moves, without rotor
    """

    summary: model.PathLoad
    asked: bool
    rows: model.TorqueRows
    demand: Demand | None
    inertia: Reals


def path_torques(arm: LoadedArm, motion: Motion, found: Judgement, wrist: tuple[int, ...]) -> PathTorques:
    """Torques of a path: its table at evenly spread times; peaks and means also where the path was solved and checked,
    and within pieces of it that are shorter than their steps.

    Parameters
    ----------
    found : what it came to
    wrist : joints whose moments by the load are wanted
    """
    entry, n = motion.entry, arm.robot.joints
    asked = set(entry.expected) <= {"safe"}
    t = np.linspace(0.0, motion.curve.duration, arm.settings.samples)
    q, qd, qdd = motion.rates(t)
    if not np.isfinite([q, qd, qdd]).all():
        nothing = (float(t[-1]), (), (), None, None)
        absent = model.PathLoad(entry.name, entry.title, found.outcomes, False, False, *nothing)
        return PathTorques(absent, asked, model.TorqueRows.empty(), None, np.full(n, np.nan))
    evenly, checked = t, np.union1d(t, motion.t)
    t = np.union1d(checked, within_short_pieces(motion, float(np.diff(checked).max(initial=0.0))))
    rates = np.stack(motion.rates(t), axis=1)
    known = np.isfinite(rates).all(axis=(1, 2))
    t, (q, qd, qdd) = t[known], rates[known].swapaxes(0, 1)
    parts = torque_parts(arm.model, q, qd, qdd)
    tau, tolerance = parts.total, arm.tolerance(q, qd, qdd)
    needed = demand(t, qd, tau)
    own = np.diagonal(arm.model.mass_matrix(q[np.isin(t, checked)]), axis1=1, axis2=2)
    payload, scale = _margins(arm, parts, t, q, qd, qdd)
    summary = model.PathLoad(
        name=entry.name,
        title=entry.title,
        outcomes=found.outcomes,
        counts=found.may_run,
        complete=True,
        duration_s=float(t[-1]),
        joints=_joint_loads(arm.robot, t, parts, tolerance, needed),
        wrist=_wrist_moments(arm, t, q, qd, qdd, wrist),
        payload=_bound(payload, t),
        speed_scale=_bound(scale, t),
    )
    rows = model.TorqueRows.of(
        path=entry.name,
        t_s=t,
        q=shown(arm.robot, q),
        torque=tau,
        tolerance=tolerance,
        **{name: getattr(parts, name) for name in model.PARTS},
        power_w=tau * qd,
    ).take(np.isin(t, evenly))
    return PathTorques(summary, asked, rows, needed, own.max(axis=0))


PER_PIECE = 4  # times computed within a piece of a motion
BEFORE_END = 1e-6  # of a piece, as accelerations step from piece to piece


def within_short_pieces(motion: Motion, step: float) -> Reals:
    """Times within pieces of a motion of the joints that evenly spread samples would pass over.

    Parameters
    ----------
    step : s, between two samples

    Returns
    -------
    t : (k,), s, begin, middle and end of each such piece; none of a path of the tool
    """
    if motion.followed is not None:
        return np.empty(0)
    starts, spans = motion.curve.times[:-1], np.diff(motion.curve.times)
    short = spans < PER_PIECE * step
    found: Reals = starts[short, None] + spans[short, None] * [0.0, 0.5, 1 - BEFORE_END]
    return found.ravel()


def _joint_loads(
    robot: Robot, t: Reals, parts: TorqueParts, tolerance: Reals, asked: Demand
) -> tuple[model.JointLoad, ...]:
    found, most = [], (np.abs(parts.total) + tolerance).max(axis=0)
    for j, slides in enumerate(robot.slides):
        at = int(asked.peak_at[j])
        found.append(
            model.JointLoad(
                joint=j + 1,
                unit=model.FORCE if slides else model.TORQUE,
                peak=float(asked.peak[j]),
                tolerance=float(most[j] - asked.peak[j]),
                peak_at_s=float(t[at]),
                rms=float(asked.rms[j]),
                rms_tolerance=float(np.sqrt(np.mean(tolerance[:, j] ** 2))),
                **{name: float(np.abs(getattr(parts, name)[:, j]).max()) for name in model.PARTS},
                power_w=float(asked.power[j]),
                braking_w=float(asked.braking[j]),
                work_j=float(asked.work[j]),
                recovered_j=float(asked.recovered[j]),
            )
        )
    return tuple(found)


def _margins(
    arm: LoadedArm, parts: TorqueParts, t: Reals, q: Reals, qd: Reals, qdd: Reals
) -> tuple[margins.Margin | None, margins.Margin | None]:
    """Largest further payload and maximum speed scale under peak and rated torques, and joint speeds."""
    drives = drives_of(arm.robot)
    more = arm.with_unit.rigid_torques(q, qd, qdd) - arm.model.rigid_torques(q, qd, qdd)
    viscous = known(drives.viscous) * qd
    at_rest = parts.gravity + parts.tool + parts.friction - viscous
    limits = margins.DriveLimits(drives.peak, drives.rated, arm.robot.speed)
    return (
        margins.max_payload(t, parts.total, more, limits),
        margins.max_speed_scale(t, (at_rest, viscous, parts.inertia + parts.velocity), qd, limits),
    )


def _held_payload(arm: LoadedArm) -> model.BindingLimit | None:
    """The largest further payload that the drives hold still wherever the arm is."""
    drives = drives_of(arm.robot)

    def held(q: Reals) -> tuple[Reals, Reals]:
        without = holding_torques(arm.model, q)
        return without, holding_torques(arm.with_unit, q) - without

    limits = margins.DriveLimits(drives.peak, drives.rated, arm.robot.speed)
    return _bound(margins.held_payload(arm.robot, held, limits), np.zeros(1))


def _wrist_moments(
    arm: LoadedArm, t: Reals, q: Reals, qd: Reals, qdd: Reals, wrist: tuple[int, ...]
) -> tuple[model.WristMoment, ...]:
    """What the load's own mass, and the surroundings' forces on the tool, ask of the wrist's joints."""
    if arm.load is None:
        return ()
    by_mass = arm.model.rigid_torques(q, qd, qdd) - arm.bare.rigid_torques(q, qd, qdd)
    by_load = np.abs(by_mass + arm.model.tool_torques(q))
    off = margins.load_tolerance(arm.model, q, qd, qdd, arm.load_grade)
    peak, most = by_load.max(axis=0), (by_load + off).max(axis=0)
    when = t[by_load.argmax(axis=0)]
    return tuple(model.WristMoment(j, *(float(each[j - 1]) for each in (peak, most - peak, when))) for j in wrist)


def _bound(margin: margins.Margin | None, t: Reals) -> model.BindingLimit | None:
    if margin is None:
        return None
    value = margin.value if np.isfinite(margin.value) else None
    joint = None if margin.joint is None else margin.joint + 1
    return model.BindingLimit(value, margin.by, joint, None if margin.sample is None else float(t[margin.sample]))


UNITS = {"payload": "kg", "moment": "N m", "inertia": "kg m²"}


def wrist_uses(
    robot: Robot, load: Load | None, grade: Grade, gravity: float, paths: Sequence[PathTorques]
) -> tuple[model.Use, ...]:
    """What the study's load asks of the wrist, against what the wrist's data allow.

    Parameters
    ----------
    load : tool and payload; None for none
    grade : of the load, which decides its tolerances
    gravity : m/s^2
    paths : with moments from accelerations too, N m

    Returns
    -------
    uses : kg, N m or kg m^2; upper ends by the load's tolerances. None if the robot's file gives no data of the wrist.
    """
    wrist = robot.masses.wrist
    if wrist is None:
        return ()
    at_rest = margins.wrist_use(robot, wrist, load, gravity, margins.tolerances_of(load, grade)) if load else ()
    uses = [
        model.Use(use.quantity, use.joint, None, use.asked, use.most, use.allowed, UNITS[use.quantity])
        for use in at_rest
    ]
    allowed = dict(wrist.moment)
    for path in (each.summary for each in paths):
        for moment in path.wrist if path.counts else ():
            asked = moment.moment_n_m
            if moment.joint in allowed:
                upper, limit = asked + moment.tolerance, allowed[moment.joint]
                uses.append(model.Use("moment", moment.joint, path.name, asked, upper, limit, "N m"))
    return tuple(uses)


WRIST_JOINTS = 3
NO_FIGURE = Figure("holding_torque", None, "")


def compute(study: Study, name: str) -> model.DynamicsResults:
    """Compute the torques of a robot's motors along its paths and at rest, and compare them with drives and wrist.

    Parameters
    ----------
    name : of a robot

    Returns
    -------
    results : without torques if no link has a mass; the verdict is then about the wrist alone, or no_reference

    Raises
    ------
    InputError
        naming file and field that can't be used
    """
    settings = study.section(DynamicsSettings)
    given, margin = study.robot(name), study.assumed_margin(name)
    robot = with_estimates(given, settings.capsule_density_kg_m3)
    loads = study.loads(name)
    load, load_grade = load_of(loads), _worst_grade([each.grade for each in loads])
    source = given.sources.get("inertia")
    grade = source.grade if source and robot is given else "inferred"
    moving = any(each.link > 0 for each in robot.masses.links)
    arm = LoadedArm(robot, load, settings, grade, load_grade)
    paths, skipped, rest = _paths(study, name, arm) if moving else ([], (), ())
    holding = _holding(arm) if moving else ()
    motors = _motors(robot, paths, holding) if any(path.summary.counts for path in paths) else ()
    summaries = tuple(path.summary for path in paths)
    uses = (
        *drive_uses(robot, summaries, holding),
        *wrist_uses(robot, load, load_grade, settings.gravity_m_s2, paths),
    )
    uses = tuple(sorted(uses, key=lambda use: -use.ratio))
    findings = mass_findings(robot) if moving else ()
    unknown = unknowns(robot, open_of_load(study, name))
    masses = _masses_used(given, robot, load, (grade, load_grade if load else None), settings)
    summary = model.DynamicsSummary(
        verdict=verdict_of(paths, holding, uses, findings, unknown, masses, skipped=skipped).with_assumed_shapes(
            shapes_assumed(robot, margin, {}) if paths else None
        ),
        figures=_figures(summaries, holding, uses, masses),
        gravity_m_s2=settings.gravity_m_s2,
        masses=masses,
        findings=findings,
        payload_centre_mm=tuple(settings.payload_centre_mm),
        payload_gyration_mm=settings.payload_gyration_mm,
        held_payload=_held_payload(arm) if moving else None,
        paths=summaries,
        holding=holding,
        motors=motors,
        uses=uses,
        checked=_checked(paths, rest, settings, bool(uses)) if moving else (),
        assumed=(
            *(each for each in rest if each.reason not in GAPS),
            *_mounting(study, name),
            *(() if study.scene(name, "trajectory") or not paths else (Open("open_space"),)),
            *unknown,
        )
        if moving or uses
        else (),
    )
    followed = [path.rows for path in paths if path.demand]
    rows = model.TorqueRows.stacked(followed).of_joints(robot.slides)
    return model.DynamicsResults(summary, rows)


def with_estimates(robot: Robot, density: float | None) -> Robot:
    """The robot with guessed masses for links that have none.

    Parameters
    ----------
    density : kg/m^3, of the shapes of the links; None asks for no guess

    Returns
    -------
    robot : itself if nothing is guessed
    """
    if density is None:
        return robot
    known = robot.masses.links
    missing = [each for each in estimated_links(robot, density) if robot.masses.body(each.link) is None]
    if not missing:
        return robot
    links: tuple[LinkMass, ...] = tuple(sorted((*known, *missing), key=lambda each: each.link))
    kept = robot.masses
    return robot.replace(masses=Masses(links, kept.drives, kept.wrist, kept.weight))


def _worst_grade(grades: list[Grade]) -> Grade:
    order: tuple[Grade, ...] = ("measured", "official", "cad", "export", "claim", "inferred")
    return max(grades, key=order.index, default="official")


def _checked(
    paths: Sequence[PathTorques], rest: tuple[Open, ...], settings: DynamicsSettings, limited: bool
) -> tuple[Coverage, ...]:
    """What the checks cover of the paths that are given to be run; torques only if a motor's limit is known."""
    own = [path for path in paths if path.asked]
    elsewhere = not ON_EARTH[0] <= settings.gravity_m_s2 <= ON_EARTH[1]
    not_run = tuple(path.summary.name for path in own if not path.summary.counts)
    gaps = [*rest, *([Open("gravity", amount=settings.gravity_m_s2)] if elsewhere else [])]
    gaps += [Open("paths_not_run", not_run)] if not_run else []
    gaps += [] if limited else [Open("no_torque_limits")]
    counts = (len(own), len(own))
    covered = len(own) - len(not_run) if limited else 0
    asked: dict[Check, tuple[int, int]] = {"torque": (covered, len(own)), "limits": counts}
    asked |= dict.fromkeys(OF_MOTIONS, counts)
    return coverages(asked, (each for each in gaps if each.reason in GAPS))


ON_EARTH = (9.76, 9.84)  # m/s^2, from the equator's mountains to the poles


def _mounting(study: Study, name: str) -> tuple[Open, ...]:
    """That nothing says how the base is mounted."""
    placed = study.table(name).base is not None or study.entry(name).base is not None
    return () if placed else (Open("mounting"),)


def _paths(study: Study, name: str, arm: LoadedArm) -> tuple[list[PathTorques], tuple[str, ...], tuple[Open, ...]]:
    """The paths, the names of those that an arm of its class can't follow, and what programs have besides."""
    joints, task = arm.robot.joints, task_of(study, name)
    last = range(max(1, joints - WRIST_JOINTS + 1), joints + 1)
    wrist = tuple(joint for joint in last if not arm.robot.slides[joint - 1])
    found, skipped, rest = [], [], list[Open]()
    checks = study.section(TrajectorySettings).checks_per_sample
    for each in listed_motions(study.entry(name).paths, task, checks):
        rest += each.open if each.meant_safe else ()
        if each.motion is None:
            skipped.append(each.name)
        else:
            found.append(path_torques(arm, each.motion, judged(task, each.motion), wrist))
            if isinstance(each.motion.entry, PartOfProgram) and each.motion.entry.part.load is not None:
                rest.append(Open("program_loads", (each.name,)))
    return found, tuple(skipped), by_reason(rest)


def _holding(arm: LoadedArm) -> tuple[model.HoldingTorque, ...]:
    found = worst_holding(arm.model)
    rest, there = np.zeros_like(found.q), holding_torques(arm.model, found.q)
    tolerance = np.diagonal(arm.tolerance(found.q, rest, rest))
    slides, q = arm.robot.slides, shown(arm.robot, found.q)
    return tuple(
        model.HoldingTorque(
            joint=j + 1,
            torque=float(found.values[j]),
            tolerance=float(tolerance[j]),
            unit=model.FORCE if slides[j] else model.TORQUE,
            q=tuple(q[j].tolist()),
            all_there=tuple(there[j].tolist()),
        )
        for j in range(arm.robot.joints)
    )


def _motors(
    robot: Robot, paths: list[PathTorques], holding: tuple[model.HoldingTorque, ...]
) -> tuple[model.MotorNeed, ...]:
    paths = [path for path in paths if path.summary.counts]
    asked = [path.demand for path in paths if path.demand]
    drives = drives_of(robot)
    high = np.nanmax([path.inertia for path in paths], axis=0)
    speed = np.max([each.speed for each in asked], axis=0)
    found = []
    for j, slides in enumerate(robot.slides):
        peak = max(float(each.peak[j]) for each in asked)
        ratio = drives.gear_ratio[j]
        found.append(
            model.MotorNeed(
                joint=j + 1,
                unit=model.FORCE if slides else model.TORQUE,
                peak=peak,
                rms=max(float(each.rms[j]) for each in asked),
                holding=abs(holding[j].torque),
                speed=float(1000 * speed[j] if slides else np.degrees(speed[j])),
                power_w=max(float(each.power[j]) for each in asked),
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
) -> model.MassesUsed | None:
    if not robot.masses.links:
        return None
    links = []
    for link in range(robot.rows + 1):
        body = robot.masses.body(link)
        centre = tuple(1000 * value for value in body.centre) if body else ()
        links.append(model.LinkEntry(link, body.mass if body else None, centre, given.masses.body(link) is not body))
    source = robot.sources.get("inertia")
    stated = [each.body for each in given.masses.links if each.link > 0]
    own = bool(stated) and all(body.mass_tolerance is not None for body in stated)
    tolerance = margins.ASSUMED[grades[0]]
    return model.MassesUsed(
        grade=grades[0],
        source=source.source if source else "",
        density_kg_m3=settings.capsule_density_kg_m3 if robot is not given else None,
        links=tuple(links),
        load_kg=load.mass if load else None,
        load_centre_mm=tuple(1000 * value for value in load.centre) if load else (),
        load_grade=grades[1],
        tolerances=model.TolerancesUsed(grades[0], 100 * tolerance.mass_ratio, 1000 * tolerance.centre, not own),
    )


def _figures(summaries, holding, uses, masses) -> tuple[Figure, ...]:
    loads = [load for path in summaries for load in path.joints if path.counts]
    turning = [load for load in loads if load.unit == model.TORQUE]
    peak = max(turning, key=lambda load: load.peak, default=None)
    held = model.hardest_held(holding) if holding else None
    energy = [sum(load.work_j for load in path.joints) for path in summaries if path.counts]
    total = sum(link.mass_kg or 0.0 for link in masses.links) if masses else None
    figures = (
        Figure("paths", sum(path.counts for path in summaries), "", of=len(summaries)),
        Figure("mass", total, "kg"),
        Figure("peak_torque", peak.peak if peak else None, model.TORQUE, peak.tolerance if peak else None),
        Figure("holding_torque", abs(held.torque), held.unit, held.tolerance) if held else NO_FIGURE,
        Figure("energy", max(energy, default=None), "J"),
        Figure("utilisation", 100 * uses[0].ratio if uses else None, "%"),
    )
    return tuple(figure for figure in figures if figure.value is not None and figure.of != 0)
