"""A path's torques, and what they leave room for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from er3a.dynamics.arm_model import ArmModel, arm_model, drives_of
from er3a.dynamics.demands import Demand, demand, power_imbalance
from er3a.dynamics.margins import DriveLimits, Margin, greatest_payload, greatest_speed_scale
from er3a.dynamics.torque_timing import fastest_under_torques
from er3a.dynamics.torques import TorqueParts, known, torque_parts
from er3a.dynamics.uncertainty import load_tolerance, torque_tolerance
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.dynamics.model import BindingLimit, JointLoad, PathLoad, TorqueRows, WristMoment
from er3a.pipeline.stages.trajectory.motion import Motion
from er3a.planning.timing import JointLimits, NoTimeLaw, TimingError, fastest, nodes_along
from er3a.robots.masses import Load, MassBody, together
from er3a.robots.robot import Grade, Robot


@dataclass(frozen=True)
class LoadedArm:
    """An arm with what hangs on it.

    Attributes
    ----------
    unit_payload : 1 kg of the payload whose greatest mass is asked for
    links_grade, load_grade : of the masses
    limits : joint speeds and accelerations, partly assumed
    """

    robot: Robot
    load: Load | None
    unit_payload: MassBody
    gravity: float
    links_grade: Grade
    load_grade: Grade
    limits: JointLimits

    @cached_property
    def model(self) -> ArmModel:
        """With its load."""
        return arm_model(self.robot, self.load, self.gravity)

    @cached_property
    def with_unit(self) -> ArmModel:
        """With its load and 1 kg more."""
        bodies = [body for body in (self.load, self.unit_payload) if body]
        whole = together(bodies)
        return arm_model(self.robot, Load(whole.mass, whole.centre, whole.inertia), self.gravity)

    @cached_property
    def bare(self) -> ArmModel:
        """Without its load."""
        return arm_model(self.robot, None, self.gravity)

    def tolerance(self, q: Reals, qd: Reals, qdd: Reals) -> Reals:
        """Half-widths (N, n) of the torques' intervals."""
        return torque_tolerance(self.model, q, qd, qdd, self.links_grade, self.load_grade)


@dataclass(frozen=True, eq=False)
class PathTorques:
    """A path with its torques; ``inertia`` (n, 2): least and greatest that each joint moves, without rotor."""

    summary: PathLoad
    rows: TorqueRows
    demand: Demand | None
    inertia: Reals
    imbalance: float | None


def path_torques(arm: LoadedArm, motion: Motion, samples: int, wrist: tuple[int, ...]) -> PathTorques:
    """Torques of a path at evenly spread times; ``wrist``: joints whose moments by the load are wanted."""
    entry, n = motion.entry, arm.robot.joints
    t = np.linspace(0.0, motion.built.duration, samples)
    q, qd, qdd = motion.rates(t)
    if not np.isfinite([q, qd, qdd]).all():
        absent = PathLoad(entry.name, entry.title, False, float(t[-1]), (), (), None, None, None, None, None)
        return PathTorques(absent, TorqueRows.empty(), None, np.full((n, 2), np.nan), None)
    parts = torque_parts(arm.model, q, qd, qdd)
    tau, tolerance = parts.total, arm.tolerance(q, qd, qdd)
    asked = demand(t, qd, tau)
    own = np.diagonal(arm.model.mass_matrix(q), axis1=1, axis2=2)
    payload, scale = _margins(arm, parts, t, q, qd, qdd)
    timed, kinematic, no_law = _timings(arm, motion.joints, t, q)
    summary = PathLoad(
        name=entry.name,
        title=entry.title,
        complete=True,
        duration_s=float(t[-1]),
        joints=_joint_loads(arm.robot, t, parts, tolerance, asked),
        wrist=_wrist_moments(arm, t, q, qd, qdd, wrist),
        payload=_bound(payload, t),
        speed_scale=_bound(scale, t),
        torque_timed_s=timed,
        kinematic_s=kinematic,
        no_law=no_law,
    )
    rows = TorqueRows(
        path=np.full(len(t), entry.name, object),
        t_s=t,
        q=np.where(arm.robot.slides, 1000 * q, np.degrees(q)),
        torque=tau,
        tolerance=tolerance,
        **{name: getattr(parts, name) for name in PARTS},
        power_w=tau * qd,
    )
    inertia = np.stack([own.min(axis=0), own.max(axis=0)], axis=1)
    return PathTorques(summary, rows, asked, inertia, power_imbalance(arm.model, parts, q, qd, qdd))


PARTS = ("gravity", "inertia", "velocity", "friction", "tool")


def _joint_loads(robot: Robot, t: Reals, parts: TorqueParts, tolerance: Reals, asked: Demand) -> tuple[JointLoad, ...]:
    found = []
    for j, slides in enumerate(robot.slides):
        at = int(asked.peak_at[j])
        found.append(
            JointLoad(
                joint=j + 1,
                unit="N" if slides else "N m",
                peak=float(asked.peak[j]),
                tolerance=float(tolerance[at, j]),
                peak_at_s=float(t[at]),
                rms=float(asked.rms[j]),
                rms_tolerance=float(np.sqrt(np.mean(tolerance[:, j] ** 2))),
                **{name: float(np.abs(getattr(parts, name)[:, j]).max()) for name in PARTS},
                power_w=float(asked.power[j]),
                braking_w=float(asked.braking[j]),
                work_j=float(asked.work[j]),
                recovered_j=float(asked.recovered[j]),
            )
        )
    return tuple(found)


def _margins(
    arm: LoadedArm, parts: TorqueParts, t: Reals, q: Reals, qd: Reals, qdd: Reals
) -> tuple[Margin | None, Margin | None]:
    """Greatest further payload and greatest speed scale under peak and rated torques, and joint speeds."""
    drives = drives_of(arm.robot)
    more = arm.with_unit.rigid_torques(q, qd, qdd) - arm.model.rigid_torques(q, qd, qdd)
    viscous = known(drives.viscous) * qd
    at_rest = parts.gravity + parts.tool + parts.friction - viscous
    limits = DriveLimits(drives.peak, drives.rated, arm.robot.speed)
    return (
        greatest_payload(t, parts.total, more, limits),
        greatest_speed_scale(t, (at_rest, viscous, parts.inertia + parts.velocity), qd, limits),
    )


def _timings(
    arm: LoadedArm, joints: Callable[[Reals], Reals], t: Reals, q: Reals
) -> tuple[float | None, float | None, NoTimeLaw | None]:
    """Shortest times under torques and under assumed accelerations; None where peak torques are unknown."""
    peak = drives_of(arm.robot).peak
    if not np.isfinite(peak).any():
        return None, None, None
    _, nodes = nodes_along(joints, t[::20], q[::20], arm.limits)
    try:
        kinematic = fastest(nodes, arm.limits).duration
        return fastest_under_torques(arm.model, nodes, arm.limits.speed, peak).timed.duration, kinematic, None
    except TimingError as error:
        return None, None, error.finding


def _wrist_moments(
    arm: LoadedArm, t: Reals, q: Reals, qd: Reals, qdd: Reals, wrist: tuple[int, ...]
) -> tuple[WristMoment, ...]:
    """What the load's own mass asks of the wrist's joints."""
    if arm.load is None:
        return ()
    by_load = np.abs(arm.model.rigid_torques(q, qd, qdd) - arm.bare.rigid_torques(q, qd, qdd))
    off = load_tolerance(arm.model, q, qd, qdd, arm.load_grade)
    most = [(j, int(by_load[:, j - 1].argmax())) for j in wrist]
    return tuple(WristMoment(j, float(by_load[at, j - 1]), float(off[at, j - 1]), float(t[at])) for j, at in most)


def _bound(margin: Margin | None, t: Reals) -> BindingLimit | None:
    if margin is None:
        return None
    value = margin.value if np.isfinite(margin.value) else None
    joint = None if margin.joint is None else margin.joint + 1
    return BindingLimit(value, margin.by, joint, None if margin.sample is None else float(t[margin.sample]))
