"""Torques, mass matrices and gravity loads at the joints, in the manufacturer's signs.

``tau = M(q) qdd + C(q, qd) qd + g(q) + armature qdd + viscous qd + coulomb sign(qd) - J(q).T wrench``: what the drives
must give. N m for revolute joints, N for prismatic ones.
"""

from __future__ import annotations

import numpy as np
import scipy

from er3a.by_value import by_identity
from er3a.dynamics.arm_model import ArmModel, arm_model, drives_of
from er3a.dynamics.worst_poses import Maxima, max_over_poses
from er3a.errors import ShapeError
from er3a.kinematics.forward import checked_joints
from er3a.numerics.arrays import Reals
from er3a.robots.masses import Drives, Load
from er3a.robots.robot import Robot

AT_REST = 1e-5
"""rad/s or m/s: joints slower than that are at rest but for rounding."""


@by_identity
class TorqueParts:
    """Torques (N, n) by their cause; unknown friction and rotor inertia count nothing.

    Attributes
    ----------
    inertia : of accelerations, rotors included
    velocity : centrifugal and Coriolis
    tool : against forces at the tool
    """

    gravity: Reals
    inertia: Reals
    velocity: Reals
    friction: Reals
    tool: Reals

    @property
    def total(self) -> Reals:
        """Their sum: what the drives give."""
        return self.gravity + self.inertia + self.velocity + self.friction + self.tool


def torques(robot: Robot, q: Reals, qd: Reals, qdd: Reals, load: Load | None = None) -> Reals:
    """Torques that the drives must supply for a motion, including friction and rotors if the robot file gives them.

    Links without mass in the file count as massless. Gravity is 9.81 m/s^2 along -z of the world, in which the robot's
    base places the arm; for a wall or ceiling mount, rotate the base.

    Parameters
    ----------
    q, qd, qdd : (..., n), rad, rad/s, rad/s^2 (m for prismatic joints), in the manufacturer's signs
    load : the load on the flange and the wrench of the surroundings on the tool

    Returns
    -------
    tau : (..., n), N m, or N for prismatic joints

    Raises
    ------
    ShapeError, PoseError
        if an array has the wrong shape
    RobotError
        if the robot's links have no masses, or impossible ones
    """
    (q, qd, qdd), shape = _flat(robot, {"q": q, "qd": qd, "qdd": qdd})
    return torque_parts(arm_model(robot, load), q, qd, qdd).total.reshape(shape)


def mass_matrix(robot: Robot, q: Reals, load: Load | None = None) -> Reals:
    """Mass matrices at joint values, rotors included.

    Parameters
    ----------
    q : (..., n), rad or m
    load : on the flange; None for none

    Returns
    -------
    M : (..., n, n), kg m^2 (kg, kg m for prismatic joints)

    Raises
    ------
    ShapeError, PoseError, RobotError
        as :func:`torques`
    """
    (q,), shape = _flat(robot, {"q": q})
    M = arm_model(robot, load).mass_matrix(q) + np.diag(known(drives_of(robot).armature))
    return M.reshape(*shape, robot.joints)


def gravity(robot: Robot, q: Reals, load: Load | None = None) -> Reals:
    """Torques that hold the arm at rest, forces at the tool included, friction not.

    Parameters
    ----------
    q : (..., n), rad or m
    load : on the flange; None for none

    Returns
    -------
    tau : (..., n), N m, or N for prismatic joints

    Raises
    ------
    ShapeError, PoseError, RobotError
        as :func:`torques`
    """
    (q,), shape = _flat(robot, {"q": q})
    return holding_torques(arm_model(robot, load), q).reshape(shape)


def torque_parts(model: ArmModel, q: Reals, qd: Reals, qdd: Reals) -> TorqueParts:
    """Torques of a motion by their cause.

    Parameters
    ----------
    model : with load and gravity
    q, qd, qdd : (N, n), rad or m, and per s and s^2

    Returns
    -------
    parts : (N, n) each, N m or N

    Notes
    -----
    Three runs of RNEA: at rest, without acceleration, and whole. Their differences are the parts.
    """
    rest, drives = np.zeros_like(q), drives_of(model.robot)
    held = model.rigid_torques(q, rest, rest)
    moving = model.rigid_torques(q, qd, rest)
    whole = model.rigid_torques(q, qd, qdd)
    return TorqueParts(
        gravity=held,
        inertia=whole - moving + known(drives.armature) * qdd,
        velocity=moving - held,
        friction=friction_torques(drives, qd),
        tool=model.tool_torques(q),
    )


def holding_torques(model: ArmModel, q: Reals) -> Reals:
    """Torques at rest, without friction.

    Parameters
    ----------
    model : with load and gravity
    q : (N, n), rad or m

    Returns
    -------
    tau : (N, n), N m or N, forces at the tool included
    """
    rest = np.zeros_like(q)
    return model.rigid_torques(q, rest, rest) + model.tool_torques(q)


def friction_torques(drives: Drives, qd: Reals) -> Reals:
    """Torques against Coulomb's and viscous friction; unknown ones count nothing.

    Parameters
    ----------
    drives : of n joints
    qd : (N, n), rad/s or m/s

    Returns
    -------
    tau : (N, n), N m or N

    Notes
    -----
    A joint slower than :data:`AT_REST` is at rest, because rounding has no direction.
    """
    return known(drives.viscous) * qd + known(drives.coulomb) * direction_of(qd)


def direction_of(qd: Reals) -> Reals:
    """The sign of velocities, 0 for joints at rest.

    Parameters
    ----------
    qd : (..., n), rad/s or m/s

    Returns
    -------
    direction : (..., n), -1, 0 or 1
    """
    return np.where(np.abs(qd) > AT_REST, np.sign(qd), 0.0)


def known(values: Reals) -> Reals:
    """Values with 0 in place of unknown ones (NaN).

    Parameters
    ----------
    values : any shape

    Returns
    -------
    values : same shape, a copy
    """
    return np.nan_to_num(values, nan=0.0)


def _flat(robot: Robot, named: dict[str, Reals]) -> tuple[list[Reals], tuple[int, ...]]:
    """Arrays (..., n) as (N, n), broadcast against one another, and the shape that they had."""
    arrays = [checked_joints(robot, values, name) for name, values in named.items()]
    try:
        together = np.broadcast_arrays(*arrays)
    except ValueError:
        name = next(name for name, each in zip(named, arrays) if each.shape != arrays[0].shape)
        raise ShapeError(name, np.shape(named[name]), f"{arrays[0].shape}, as q has") from None
    shape = together[0].shape
    return [np.ascontiguousarray(each).reshape(-1, robot.joints) for each in together], shape


@by_identity
class Demand:
    """Of each joint (n,), over a motion; N m, W, J, rad/s (N, m/s for prismatic joints).

    Attributes
    ----------
    peak, peak_at : maximum torque by its absolute value, and the number of its sample
    rms : root mean square of the torque, which heats the motor
    power : largest power given, 0 where the drive only brakes
    braking : largest power taken back, as a positive number
    work, recovered : energy given and taken back
    speed : largest
    """

    peak: Reals
    peak_at: np.ndarray
    rms: Reals
    power: Reals
    braking: Reals
    work: Reals
    recovered: Reals
    speed: Reals


def demand(t: Reals, qd: Reals, tau: Reals) -> Demand:
    """What a motion requires of each joint's drive.

    Parameters
    ----------
    t : (N,), s
    qd : (N, n), rad/s or m/s
    tau : (N, n), N m or N

    Returns
    -------
    demand : (n,) each, N m, W, J, rad/s (N, m/s for prismatic joints)
    """
    power, duration = tau * qd, float(t[-1] - t[0])

    def whole(values: Reals) -> Reals:
        return time_mean(t, values) * duration

    return Demand(
        peak=np.abs(tau).max(axis=0),
        peak_at=np.abs(tau).argmax(axis=0),
        rms=np.sqrt(time_mean(t, tau**2)),
        power=np.maximum(power, 0.0).max(axis=0),
        braking=np.maximum(-power, 0.0).max(axis=0),
        work=whole(np.maximum(power, 0.0)),
        recovered=whole(np.maximum(-power, 0.0)),
        speed=np.abs(qd).max(axis=0),
    )


def time_mean(t: Reals, values: Reals) -> Reals:
    """Means over time, by the trapezoidal rule.

    Parameters
    ----------
    t : (N,), s, ascending
    values : (N, n)

    Returns
    -------
    mean : (n,), in the unit of the values; the plain mean if no time passes
    """
    if t[-1] > t[0]:
        mean: Reals = scipy.integrate.trapezoid(values, t, axis=0) / (t[-1] - t[0])
        return mean
    still: Reals = values.mean(axis=0)
    return still


def worst_holding(model: ArmModel) -> Maxima:
    """The largest holding torque of each joint that a search over all poses within the limits finds.

    Parameters
    ----------
    model : with load and gravity

    Returns
    -------
    worst : N m or N, each with the sign that it has in its pose
    """
    found = max_over_poses(model.robot, lambda q: np.abs(holding_torques(model, q)))
    return Maxima(np.diagonal(holding_torques(model, found.q)).copy(), found.q)
