"""How far torques can be off because masses and centres are: linear, by the regressor.

``tau = Y(q, qd, qdd) p`` is linear in each body's ten parameters p [1]_. A body's mass is off with its centre and radii
of gyration kept, so p moves along itself; its centre is off with mass and inertia about it kept. Worst cases add.

References
----------
.. [1] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, 7.2.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.dynamics.arm_model import PARAMETERS, ArmModel
from er3a.numerics.arrays import Reals
from er3a.robots.masses import MassBody, about
from er3a.robots.robot import Grade

AXES = np.eye(3)
UPPER = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))


@dataclass(frozen=True)
class MassTolerance:
    """By how much a grade's masses (as a ratio) and centres of mass (m) are taken to be off at most."""

    mass_ratio: float
    centre: float


ASSUMED: dict[Grade, MassTolerance] = {
    "official": MassTolerance(0.05, 0.003),
    "measured": MassTolerance(0.01, 0.001),
    "cad": MassTolerance(0.10, 0.005),
    "export": MassTolerance(0.20, 0.010),
    "claim": MassTolerance(0.30, 0.020),
    "inferred": MassTolerance(0.50, 0.030),
}
"""Assumptions, used where a file gives no tolerances: no source states such numbers."""


def parameters(body: MassBody) -> Reals:
    """(10,): m, m c, and the inertia about the frame's origin as xx, xy, yy, xz, yz, zz."""
    c = np.array(body.centre)
    tensor = body.inertia_matrix + body.mass * about(c)
    return np.array([body.mass, *(body.mass * c), *(tensor[entry] for entry in UPPER)])


def centre_directions(body: MassBody) -> Reals:
    """(3, 10): how the parameters change per m that the centre moves along each axis."""
    c, found = np.array(body.centre), np.zeros((3, PARAMETERS))
    for axis in range(3):
        e = AXES[axis]
        tensor = 2 * c[axis] * np.eye(3) - np.outer(e, c) - np.outer(c, e)
        found[axis] = [0.0, *e, *(tensor[entry] for entry in UPPER)]
    return body.mass * found


def torque_tolerance(model: ArmModel, q: Reals, qd: Reals, qdd: Reals, links: Grade, load: Grade = "official") -> Reals:
    """Half-widths (N, n) of the torques' intervals, for motions (N, n) each.

    Parameters
    ----------
    links, load : grades of the links' masses and of the load, for bodies without tolerances of their own
    """
    return sum(_halves(model, (q, qd, qdd), links, load), np.zeros_like(q))


def load_tolerance(model: ArmModel, q: Reals, qd: Reals, qdd: Reals, load: Grade) -> Reals:
    """Half-widths (N, n) of what the load alone adds to the torques; 0 without one."""
    return _halves(model, (q, qd, qdd), load, load)[-1] if model.load else np.zeros_like(q)


def _halves(model: ArmModel, motion: tuple[Reals, Reals, Reals], links: Grade, load: Grade) -> list[Reals]:
    """What each body's tolerances add, the load's last."""
    Y, halves = model.regressor(*motion), []
    for link, body in model.bodies:
        mass, centre = tolerances_of(body, load if link is None else links)
        own = Y[:, :, (model.robot.rows if link is None else link) - 1]
        half = np.abs(own @ centre_directions(body).T).sum(axis=2) * centre
        if body.mass:
            half += np.abs(own @ parameters(body)) * mass / body.mass
        halves.append(half)
    return halves


def tolerances_of(body: MassBody, grade: Grade) -> tuple[float, float]:
    """By how much a body's mass (kg) and centre (m) may be off: its own tolerances, or those of the grade."""
    assumed = ASSUMED[grade]
    mass = assumed.mass_ratio * body.mass if body.mass_tolerance is None else body.mass_tolerance
    return mass, assumed.centre if body.centre_tolerance is None else body.centre_tolerance
