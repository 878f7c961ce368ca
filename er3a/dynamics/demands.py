"""What a motion asks of each drive: greatest and effective torque, power, energy, speed, and the inertia it moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from er3a.dynamics.arm_model import ArmModel
from er3a.dynamics.torques import TorqueParts
from er3a.numerics.arrays import Reals

POWER_STEP = 2e-5  # s


@dataclass(frozen=True, eq=False)
class Demand:
    """Of each joint (n,), over a motion; N m, W, J, rad/s (N, m/s where joints slide).

    Attributes
    ----------
    peak, peak_at : greatest torque by its absolute value, and the number of its sample
    rms : effective torque, which heats the motor
    power : greatest power given, 0 where the drive only brakes
    braking : greatest power taken back, as a positive number
    work, recovered : energy given and taken back
    speed : greatest
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
    """What a motion asks for, of torques and velocities (N, n) at times (N,) in s."""
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
    """Means (n,) over times (N,) in s of values (N, n), by the trapezoidal rule; the plain mean if no time passes."""
    if t[-1] > t[0]:
        mean: Reals = scipy.integrate.trapezoid(values, t, axis=0) / (t[-1] - t[0])
        return mean
    still: Reals = values.mean(axis=0)
    return still


def power_imbalance(model: ArmModel, parts: TorqueParts, q: Reals, qd: Reals, qdd: Reals) -> float:
    """Greatest difference of the power into the masses and the change of their energy, of the greatest power.

    The energy is ``qd.T M qd / 2 + V`` by CRBA and the masses' heights, its change a difference along the motion's
    own Taylor series over 40 us; the power is by RNEA.
    """
    h = POWER_STEP

    def energy(step: float) -> Reals:
        at, velocity = q + step * qd + step**2 / 2 * qdd, qd + step * qdd
        kinetic = 0.5 * np.einsum("Ni,Nij,Nj->N", velocity, model.mass_matrix(at), velocity)
        whole: Reals = kinetic + model.potential_energy(at)
        return whole

    change = (energy(h) - energy(-h)) / (2 * h)
    power = (model.rigid_torques(q, qd, qdd) * qd).sum(axis=1)
    scale = max(float(np.abs(parts.total * qd).sum(axis=1).max(initial=0.0)), 1e-9)
    return float(np.abs(change - power).max(initial=0.0) / scale)
