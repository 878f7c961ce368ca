"""A robot as Pinocchio's model, and its algorithms [1]_ [2]_ over batches in the manufacturer's joint values.

The model's joints are the rows of the table, with ``x = direction * (coupling @ q) + start``; so velocities are
``S @ qd`` with ``S = diag(direction) @ coupling``, and torques ``S.T @ tau`` (virtual work). Rotor inertia and friction
belong to the joints that the drives move, and are added there, because Pinocchio's model knows no coupling, and its
``rnea`` no friction.

The one place where Pinocchio [3]_ is imported.

References
----------
.. [1] R. Featherstone, *Rigid Body Dynamics Algorithms*, chapters 5 to 7 (RNEA, CRBA, ABA).
.. [2] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, 7.2 and 7.5.
.. [3] J. Carpentier et al., "The Pinocchio C++ library", IEEE/SICE Int. Symp. on System Integration (2019).
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import Any

import numpy as np
import scipy

from er3a.by_value import by_identity
from er3a.collision.shapes import arm_shapes
from er3a.errors import Er3aError, RobotError
from er3a.kinematics.chain import constant_links, joint_starts, row_values
from er3a.kinematics.forward import forward, jacobian
from er3a.numerics.arrays import Reals
from er3a.robots.masses import GRAVITY, Drives, LinkMass, Load, MassBody, moved, no_body, six_moments, together
from er3a.robots.robot import Envelope, Robot, derived


def pinocchio() -> Any:
    """The library Pinocchio, imported on first use.

    Returns
    -------
    module : ``pinocchio``

    Raises
    ------
    Er3aError
        if it is not installed
    """
    try:
        return import_module("pinocchio")
    except ModuleNotFoundError:
        raise Er3aError(
            "dynamics needs Pinocchio (package pin), which is not installed; not every platform has wheels of it"
        ) from None


PARAMETERS = 10
"""Numbers of a body in the regressor: m, m c (3), and inertia about the frame's origin xx, xy, yy, xz, yz, zz."""

PROBLEMS = {
    "not_finite": "holds a value that is not finite",
    "negative_mass": "has a mass below 0",
    "negative_moment": "has a principal moment of inertia below 0",
    "triangle": "has a principal moment of inertia above the sum of the other two, which no body has",
}


@by_identity
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
        """Torques of gravity and of the masses' motion, by the recursive Newton-Euler algorithm [1]_.

        Parameters
        ----------
        q, qd, qdd : (N, n), rad or m, and per s and s^2

        Returns
        -------
        tau : (N, n), N m, or N for prismatic joints; no rotors, no friction, no forces at the tool
        """
        if not len(q):
            return np.empty_like(q)
        pin = pinocchio()
        pool = pin.ModelPool(self.model, 1)
        rows = [np.asfortranarray(values.T) for values in (self._x(q), qd @ self.to_rows.T, qdd @ self.to_rows.T)]
        found = np.asarray(pin.rneaInParallel(1, pool, *rows))  # one row or one sample comes back as a vector
        return found.reshape(self.robot.rows, len(q)).T @ self.to_rows

    def mass_matrix(self, q: Reals) -> Reals:
        """Mass matrices, by the composite rigid body algorithm [1]_, without rotors.

        Parameters
        ----------
        q : (N, n), rad or m

        Returns
        -------
        M : (N, n, n), kg m^2 (kg m and kg with prismatic joints), symmetric
        """
        pin, data = pinocchio(), self.model.createData()
        M = np.array([pin.crba(self.model, data, x) for x in self._x(q)]).reshape(-1, self.robot.rows, self.robot.rows)
        M = np.triu(M) + np.swapaxes(np.triu(M, 1), 1, 2)
        found: Reals = self.to_rows.T @ M @ self.to_rows
        return found

    def regressor(self, q: Reals, qd: Reals, qdd: Reals) -> Reals:
        """The regressor of the torques, which are linear in the masses: ``tau = Y p`` [2]_.

        Parameters
        ----------
        q, qd, qdd : (N, n), rad or m, and per s and s^2

        Returns
        -------
        Y : (N, n, m, 10), with torques ``sum(Y * parameters)`` over the m links that joints move, see ``PARAMETERS``
        """
        pin, data = pinocchio(), self.model.createData()
        rows = zip(self._x(q), qd @ self.to_rows.T, qdd @ self.to_rows.T)
        Y = np.array([pin.computeJointTorqueRegressor(self.model, data, *row) for row in rows])
        m = self.robot.rows
        found: Reals = np.einsum("rj,Nrlp->Njlp", self.to_rows, Y.reshape(-1, m, m, PARAMETERS))
        return found

    def tool_torques(self, q: Reals) -> Reals:
        """Torques that hold against what the surroundings do to the tool: ``-J.T @ wrench``.

        Parameters
        ----------
        q : (N, n), rad or m

        Returns
        -------
        tau : (N, n), N m, or N for prismatic joints; 0 without force and moment
        """
        load = self.load
        if load is None or not (any(load.force) or any(load.moment)):
            return np.zeros_like(q)
        R = forward(self.robot, q)[:, :3, :3]
        wrench = np.concatenate([R @ np.array(load.force), R @ np.array(load.moment)], axis=1)
        held: Reals = -np.einsum("Nwj,Nw->Nj", jacobian(self.robot, q), wrench)
        return held

    def _x(self, q: Reals) -> Reals:
        """Motion (N, m) of Pinocchio's joints."""
        return self.robot.direction * row_values(self.robot, q) + joint_starts(self.robot)


@derived
def arm_model(robot: Robot, load: Load | None = None, gravity: float = GRAVITY) -> ArmModel:
    """The model of a robot and its load; links without a body count as massless.

    Parameters
    ----------
    load : on the flange; None for none
    gravity : m/s^2, along -z of the world, in which ``robot.base`` places the arm (wall, ceiling)

    Returns
    -------
    model : kept with the robot, so that a second call costs nothing

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
    return ArmModel(robot, load, model, robot.direction[:, None] * robot.joint_to_row, tuple(bodies))


def flange_in_last_link(robot: Robot) -> Reals:
    """The flange in the frame that moves with the last joint, in which the last link's body is given.

    Parameters
    ----------
    robot : its tool does not count

    Returns
    -------
    T : (4, 4), m
    """
    last: Reals = constant_links(robot.without_tool())[-1]
    return last


def drives_of(robot: Robot) -> Drives:
    """The robot's drives.

    Parameters
    ----------
    robot : n joints

    Returns
    -------
    drives : all unknown (NaN) where the robot's file gives none
    """
    return robot.masses.drives or Drives.unknown(robot.joints)


WATER = 1000.0  # kg/m^3
STEPS = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
AROUND = STEPS[np.abs(STEPS).sum(axis=1) > 0] / np.linalg.norm(STEPS[np.abs(STEPS).sum(axis=1) > 0], axis=1)[:, None]
"""26 directions: a ball by their points is too small by 8 % of its radius at most."""


@by_identity
class LinkShape:
    """The shape of a link in the frame that moves with its joint.

    Attributes
    ----------
    water : the shape filled with water
    points : (k, 3), m, whose hull is around the shape
    guessed : from lengths of the table alone, which leaves out how a link is offset along parallel axes
    """

    water: MassBody
    points: Reals
    guessed: bool

    def outside(self, point: Reals) -> float:
        """How far a point is outside the hull of the shape, where no centre of mass can be.

        Parameters
        ----------
        point : (3,), m, in the frame that moves with the link's joint

        Returns
        -------
        distance : m, a lower bound outside (the largest distance from a face's plane); negative inside
        """
        return float((scipy.spatial.ConvexHull(self.points).equations @ np.append(point, 1.0)).max())


def link_shapes(robot: Robot) -> dict[int, LinkShape]:
    """Shapes of the links that have any, to check masses against.

    Parameters
    ----------
    robot : its meshes, convex pieces or capsules; else capsules guessed from the table

    Returns
    -------
    shapes : by link, from 0 for the base
    """
    guessed = not arm_shapes(robot).given
    found = {}
    for link, parts in _link_parts(robot).items():
        points = np.concatenate([_outline(part) for part in parts])
        found[link] = LinkShape(together([_body(part, WATER) for part in parts]), points, guessed)
    return found


def estimated_links(robot: Robot, density: float) -> tuple[LinkMass, ...]:
    """A body for each link that has shapes, filled evenly with a material.

    Parameters
    ----------
    robot : its shapes as for :func:`link_shapes`
    density : kg/m^3

    Returns
    -------
    links : by ascending link; overlaps of a link's shapes count twice

    Notes
    -----
    Whoever uses them grades them ``inferred``.
    """
    parts = sorted(_link_parts(robot).items())
    return tuple(LinkMass(link, together([_body(part, density) for part in own])) for link, own in parts)


def _link_parts(robot: Robot) -> dict[int, Sequence[Envelope] | Sequence[Reals]]:
    """What fills each link: its convex pieces (k, 3), m, that have a volume, hulls of surfaces; else capsules."""
    shapes, pieces, capsules = arm_shapes(robot), dict[int, list[Reals]](), dict[int, list[Envelope]]()
    for piece in shapes.pieces:
        points = np.array(piece.points)
        if len(points) > 3 and np.linalg.matrix_rank(points - points[0]) == 3:
            pieces.setdefault(piece.link, []).append(points)
    for mesh in shapes.meshes:
        pieces.setdefault(mesh.link, []).append(mesh.points)
    for capsule in shapes.capsules:
        capsules.setdefault(capsule.link, []).append(capsule)
    return {**capsules, **pieces}


def _body(part: Envelope | Reals, density: float) -> MassBody:
    """A part filled at a density, kg/m^3."""
    return capsule_body(part, density) if isinstance(part, Envelope) else filled(part, density)


def _outline(part: Envelope | Reals) -> Reals:
    """Points (k, 3), m, whose hull is around a part."""
    if isinstance(part, Envelope):
        return np.concatenate([np.array(end) + part.radius * AROUND for end in (part.start, part.end)])
    return part


def filled(points: Reals, density: float = WATER) -> MassBody:
    """The hull of points, filled with a material.

    Parameters
    ----------
    points : (k, 3), m, not all in one plane
    density : kg/m^3

    Returns
    -------
    body : in the frame of the points, inertia about its own centre
    """
    from trimesh.convex import convex_hull  # takes a while

    found = convex_hull(points).mass_properties
    x, y, z = found.center_mass.tolist()
    return MassBody(density * float(found.mass), (x, y, z), six_moments(density * found.inertia))


def capsule_body(capsule: Envelope, density: float) -> MassBody:
    """A solid capsule: a cylinder and two half balls.

    Parameters
    ----------
    capsule : ends and radius, m, in any frame
    density : kg/m^3

    Returns
    -------
    body : in the capsule's frame, inertia about its own centre
    """
    start, end, r = np.array(capsule.start), np.array(capsule.end), capsule.radius
    length = float(np.linalg.norm(end - start))
    cylinder, ball = density * np.pi * r**2 * length, density * 4 / 3 * np.pi * r**3
    # A half ball's centre is 3/8 of the radius beyond the cylinder's end; hence 0.375 by the parallel axis theorem.
    across = cylinder * (length**2 / 12 + r**2 / 4) + ball * (0.4 * r**2 + length**2 / 4 + 0.375 * length * r)
    round_ = cylinder * r**2 / 2 + 0.4 * ball * r**2
    body = MassBody(cylinder + ball, (0.0, 0.0, 0.0), (across, across, round_, 0.0, 0.0, 0.0))
    T = np.eye(4)
    T[:3, 3] = (start + end) / 2
    if length > 0:
        z = (end - start) / length
        x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
        x /= np.linalg.norm(x)
        T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return moved(body, T)
