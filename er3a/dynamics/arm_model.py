"""A robot as Pinocchio's model, and its algorithms [1]_ [2]_ over batches in the manufacturer's joint values.

The model's joints are the rows of the table, with ``x = direction * (coupling @ q) + start``; so velocities are
``S @ qd`` with ``S = diag(direction) @ coupling``, and torques ``S.T @ tau`` (virtual work). Rotor inertia and friction
belong to the joints that the drives move, and are added there, because Pinocchio's model knows no coupling, and its
``rnea`` no friction.

References
----------
.. [1] R. Featherstone, *Rigid Body Dynamics Algorithms*, chapters 5 to 7 (RNEA, CRBA, ABA).
.. [2] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, 7.2 and 7.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from er3a.dynamics.library import pinocchio
from er3a.errors import RobotError
from er3a.kinematics.chain import constant_links, joint_starts, row_values
from er3a.kinematics.forward import forward, jacobian
from er3a.numerics.arrays import Reals
from er3a.robots.derived import derived
from er3a.robots.masses import GRAVITY, Drives, Load, MassBody, moved, no_body
from er3a.robots.robot import Robot

PARAMETERS = 10
"""Numbers of a body in the regressor: m, m c (3), and inertia about the frame's origin xx, xy, yy, xz, yz, zz."""

PROBLEMS = {
    "not_finite": "holds something that is no finite number",
    "negative_mass": "has a mass below 0",
    "negative_moment": "has a principal moment of inertia below 0",
    "triangle": "has a principal moment of inertia above the sum of the other two, which no body has",
}


@dataclass(frozen=True, eq=False)
class ArmModel:
    """An arm with its load, ready for batches. Joint values, velocities and accelerations are (N, n), contiguous.

    Attributes
    ----------
    to_rows : (m, n), S
    bodies : (link from 1, body in the frame that moves with the link's joint), the load (link None) last
    """

    robot: Robot
    load: Load | None
    model: Any
    to_rows: Reals
    bodies: tuple[tuple[int | None, MassBody], ...]

    def rigid_torques(self, q: Reals, qd: Reals, qdd: Reals) -> Reals:
        """Torques (N, n) of gravity and of the masses' motion (RNEA); no rotors, no friction, no forces at the tool."""
        if not len(q):
            return np.empty_like(q)
        pin = pinocchio()
        pool = pin.ModelPool(self.model, 1)
        rows = [np.asfortranarray(values.T) for values in (self._x(q), qd @ self.to_rows.T, qdd @ self.to_rows.T)]
        found = np.asarray(pin.rneaInParallel(1, pool, *rows))  # one row or one sample comes back as a vector
        tau: Reals = found.reshape(self.robot.rows, len(q)).T @ self.to_rows
        return tau

    def mass_matrix(self, q: Reals) -> Reals:
        """Mass matrices (N, n, n) by CRBA, without rotors."""
        pin, data = pinocchio(), self.model.createData()
        upper = [np.triu(pin.crba(self.model, data, x)) for x in self._x(q)]
        M = np.array(upper).reshape(-1, self.robot.rows, self.robot.rows)
        M = M + np.swapaxes(np.triu(M, 1), 1, 2)
        found: Reals = self.to_rows.T @ M @ self.to_rows
        return found

    def potential_energy(self, q: Reals) -> Reals:
        """Potential energy (N,) in J, by Pinocchio's forward kinematics; the base's counts nothing."""
        pin, data = pinocchio(), self.model.createData()
        return np.array([pin.computePotentialEnergy(self.model, data, x) for x in self._x(q)])

    def regressor(self, q: Reals, qd: Reals, qdd: Reals) -> Reals:
        """Y (N, n, links, 10) with torques ``sum(Y * parameters)``; ``links`` are those that joints move, m of them."""
        pin, data = pinocchio(), self.model.createData()
        rows = zip(self._x(q), qd @ self.to_rows.T, qdd @ self.to_rows.T)
        Y = np.array([pin.computeJointTorqueRegressor(self.model, data, *row) for row in rows])
        m = self.robot.rows
        found: Reals = np.einsum("rj,Nrlp->Njlp", self.to_rows, Y.reshape(-1, m, m, PARAMETERS))
        return found

    def tool_torques(self, q: Reals) -> Reals:
        """Torques (N, n) that hold against what the surroundings do to the tool: ``-J.T @ wrench``."""
        load = self.load
        if load is None or not (any(load.force) or any(load.moment)):
            return np.zeros_like(q)
        R = forward(self.robot, q)[:, :3, :3]
        wrench = np.concatenate([R @ np.array(load.force), R @ np.array(load.moment)], axis=1)
        held: Reals = -np.einsum("Nwj,Nw->Nj", jacobian(self.robot, q), wrench)
        return held

    def _x(self, q: Reals) -> Reals:
        x: Reals = self.robot.direction * row_values(self.robot, q) + joint_starts(self.robot)
        return x


@derived
def arm_model(robot: Robot, load: Load | None = None, gravity: float = GRAVITY) -> ArmModel:
    """The model of a robot and its load; links without a body count as massless.

    Parameters
    ----------
    gravity : m/s^2, along -z of the world, in which ``robot.base`` places the arm (wall, ceiling)

    Raises
    ------
    RobotError
        if no link that a joint moves has a body, or one has numbers that no body can have
    Er3aError
        if Pinocchio is not installed
    """
    pin = pinocchio()
    bodies: list[tuple[int | None, MassBody]] = [(each.link, each.body) for each in robot.masses.links if each.link > 0]
    if not bodies:
        raise RobotError(robot.name, "no link has a mass; add the group inertia to its file")
    if load is not None:
        bodies.append((None, moved(load, flange_in_last_link(robot))))
    model, links = pin.Model(), constant_links(robot)
    model.gravity.linear = np.array([0.0, 0.0, -gravity])
    for k in range(robot.rows):
        joint = pin.JointModelPZ() if robot.sliding[k] else pin.JointModelRZ()
        model.addJoint(k, joint, pin.SE3(links[k]), f"joint_{k + 1}")
    for link, body in bodies:
        if problem := no_body(body):
            named = "the load" if link is None else f"the inertia of link {link}"
            raise RobotError(robot.name, f"{named} {PROBLEMS[problem]}")
        inertia = pin.Inertia(body.mass, np.array(body.centre), body.inertia_matrix)
        model.appendBodyToJoint(robot.rows if link is None else link, inertia, pin.SE3.Identity())
    coupling = np.eye(robot.rows) if robot.coupling is None else robot.coupling
    return ArmModel(robot, load, model, robot.direction[:, None] * coupling, tuple(bodies))


def flange_in_last_link(robot: Robot) -> Reals:
    """The flange (4, 4) in the frame that moves with the last joint."""
    last: Reals = constant_links(robot.without_tool())[-1]
    return last


def drives_of(robot: Robot) -> Drives:
    """The robot's drives; all unknown where its file gives none."""
    return robot.masses.drives or Drives.unknown(robot.joints)
