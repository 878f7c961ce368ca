"""Masses of links and loads, drives and wrist limits: the data that dynamics needs, in SI units."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Literal

import numpy as np

from er3a.by_value import ByValue, frozen
from er3a.errors import ShapeError
from er3a.numerics.arrays import Reals, as_floats

Three = tuple[float, float, float]
SixMoments = tuple[float, float, float, float, float, float]

GRAVITY = 9.81
"""m/s^2, unless a caller says otherwise."""
TRIANGLE_TOLERANCE = 0.01
"""By how much of itself a principal moment may exceed the sum of the other two: printed digits are rounded."""

NoBody = Literal["not_finite", "negative_mass", "negative_moment", "triangle"]


@frozen
class MassBody:
    """Mass, centre of mass, and inertia about that centre; axes are those of the frame in which the centre is given.

    Attributes
    ----------
    mass : kg
    centre : m
    inertia : ixx, iyy, izz, ixy, ixz, iyz in kg m^2; the products are the matrix's entries, as in a URDF
    mass_tolerance, centre_tolerance : half-widths in kg and m; None: by the grade of the source
    """

    mass: float
    centre: Three = (0.0, 0.0, 0.0)
    inertia: SixMoments = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    mass_tolerance: float | None = None
    centre_tolerance: float | None = None

    @property
    def inertia_matrix(self) -> Reals:
        """(3, 3), kg m^2, about the centre."""
        xx, yy, zz, xy, xz, yz = self.inertia
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


@frozen
class LinkMass:
    """The body of a link, in the frame on its joint's axis that moves with it, as for envelopes; link 0 is the base."""

    link: int
    body: MassBody


@frozen
class Load(MassBody):
    """The load on the flange (centre and inertia in the flange's frame), and the wrench of the surroundings on the
    tool.

    Attributes
    ----------
    force, moment : of the surroundings on the tool at the tool point, in the tool's axes, N and N m
    """

    force: Three = (0.0, 0.0, 0.0)
    moment: Three = (0.0, 0.0, 0.0)


@frozen
class Drives(ByValue):
    """What is known of the joints' drives, at the joint: (n,) each, NaN where unknown; N in place of N m for prismatic
    joints.

    Attributes
    ----------
    armature : rotor inertia times the gear ratio squared, kg m^2
    gear_ratio : turns of the motor for one of the joint
    coulomb, viscous : friction, N m and N m s/rad
    rated, peak : continuous (rated) and peak torque of a drive, N m
    """

    armature: Reals
    gear_ratio: Reals
    coulomb: Reals
    viscous: Reals
    rated: Reals
    peak: Reals

    def __post_init__(self) -> None:
        for part in fields(self):
            array = np.array(as_floats(getattr(self, part.name), part.name))
            if array.ndim != 1 or len(array) != len(np.atleast_1d(self.armature)):
                raise ShapeError(part.name, array.shape, "one number for each joint")
            array.setflags(write=False)
            object.__setattr__(self, part.name, array)

    @classmethod
    def unknown(cls, joints: int) -> Drives:
        """Drives of which nothing is known.

        Parameters
        ----------
        joints : how many, n

        Returns
        -------
        drives : every attribute is (n,) of NaN
        """
        return cls(*(np.full(joints, np.nan) for _ in fields(cls)))


@frozen
class WristLoad(ByValue):
    """What the manufacturer lets the wrist carry.

    Attributes
    ----------
    payload : kg, NaN where unknown
    moment, inertia : by joint (from 1) the allowed moment (N m) and inertia (kg m^2) about its axis
    """

    payload: float = np.nan
    moment: tuple[tuple[int, float], ...] = ()
    inertia: tuple[tuple[int, float], ...] = ()


@frozen
class Masses(ByValue):
    """Everything of a robot that dynamics rests on, in addition to its table.

    Attributes
    ----------
    links : bodies of the links that are known
    drives : None where nothing is known
    wrist : None where nothing is known
    weight : of the whole arm as its manufacturer states it, kg; NaN where unknown
    """

    links: tuple[LinkMass, ...] = ()
    drives: Drives | None = None
    wrist: WristLoad | None = None
    weight: float = np.nan

    def body(self, link: int) -> MassBody | None:
        """The mass body of a link.

        Parameters
        ----------
        link : 0 for the base, 1 to m for the link that a row moves

        Returns
        -------
        body : kg, m and kg m^2, in the frame as of :class:`LinkMass`; None where it is unknown
        """
        return next((each.body for each in self.links if each.link == link), None)


def no_body(body: MassBody) -> NoBody | None:
    """Why no rigid body can have a mass and an inertia [1]_.

    Parameters
    ----------
    body : as a file gives it

    Returns
    -------
    reason : None if a rigid body can have these numbers

    Notes
    -----
    The principal moments must not be negative and must satisfy the triangle inequality: none exceeds the sum of the
    other two. ``TRIANGLE_TOLERANCE`` allows for rounded digits.

    References
    ----------
    .. [1] S. Traversaro et al., "Identification of fully physical consistent inertial parameters using optimization
       on manifolds", IROS 2016, section III.
    """
    if not np.isfinite([body.mass, *body.centre, *body.inertia]).all():
        return "not_finite"
    if body.mass < 0:
        return "negative_mass"
    moments = np.linalg.eigvalsh(body.inertia_matrix)
    if moments[0] < -TRIANGLE_TOLERANCE * moments[2] or moments[2] < 0:
        return "negative_moment"
    return "triangle" if moments[2] > (moments[0] + moments[1]) * (1 + TRIANGLE_TOLERANCE) else None


def nearest_body(body: MassBody) -> MassBody:
    """The body with the same mass and centre whose inertia is the nearest that a rigid body can have.

    Parameters
    ----------
    body : its inertia may violate the triangle inequality

    Returns
    -------
    body : with the same principal axes

    Notes
    -----
    The second moments of its mass, ``trace(I) / 2 - I``, lose their negative principal values, which is the nearest
    positive semidefinite matrix by Frobenius' norm [2]_; principal axes stay.

    References
    ----------
    .. [2] P. M. Wensing, S. Kim, J.-J. Slotine, "Linear matrix inequalities for physically consistent inertial
       parameter identification", IEEE Robotics and Automation Letters 3 (2018), section III.
    """
    moments, axes = np.linalg.eigh(body.inertia_matrix)
    second = np.maximum(moments.sum() / 2 - moments, 0.0)
    return replace(body, inertia=six_moments((axes * (second.sum() - second)) @ axes.T))


def moved(body: MassBody, T: Reals) -> MassBody:
    """A mass body with its numbers given in another frame; the body itself stays where it is.

    Parameters
    ----------
    body : centre and inertia along the axes of its own frame
    T : (4, 4), takes coordinates of the body's frame to those of the other

    Returns
    -------
    body : centre ``R c + t`` (m), inertia ``R I R^T`` about that centre (kg m^2); the tolerances stay
    """
    R = T[:3, :3]
    x, y, z = (R @ np.array(body.centre) + T[:3, 3]).tolist()
    moments = six_moments(R @ body.inertia_matrix @ R.T)
    return MassBody(body.mass, (x, y, z), moments, body.mass_tolerance, body.centre_tolerance)


def together(bodies: list[MassBody]) -> MassBody:
    """Several mass bodies of one frame as one, by the parallel axis theorem.

    Parameters
    ----------
    bodies : all with centres and inertias in the same frame

    Returns
    -------
    body : total mass, common centre, inertia about it. Tolerances of masses add, that of the centre is the largest;
        each is None if one of the bodies has none
    """
    mass = sum(body.mass for body in bodies)
    centres = np.array([body.centre for body in bodies]).reshape(-1, 3)
    weights = np.array([body.mass for body in bodies])
    centre = weights @ centres / mass if mass else centres.mean(axis=0)
    tensor = sum((body.inertia_matrix + body.mass * about(centre - body.centre) for body in bodies), np.zeros((3, 3)))
    x, y, z = centre.tolist()
    known = [body.mass_tolerance for body in bodies if body.mass_tolerance is not None]
    offsets = [body.centre_tolerance for body in bodies if body.centre_tolerance is not None]
    return MassBody(
        mass,
        (x, y, z),
        six_moments(tensor),
        sum(known) if len(known) == len(bodies) else None,
        max(offsets) if len(offsets) == len(bodies) else None,
    )


def six_moments(tensor: Reals) -> SixMoments:
    """The six independent entries of an inertia tensor, in the order of a URDF's diagonal and products.

    Parameters
    ----------
    tensor : (3, 3), kg m^2, symmetric

    Returns
    -------
    moments : ixx, iyy, izz, ixy, ixz, iyz, kg m^2; the products are the matrix's entries, without a change of sign
    """
    xx, yy, zz, xy, xz, yz = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()
    return xx, yy, zz, xy, xz, yz


def about(offset: Reals) -> Reals:
    """Inertia of a point of 1 kg about the origin: what the parallel axis theorem adds per kg.

    Parameters
    ----------
    offset : (3,), m, the point

    Returns
    -------
    inertia : (3, 3), m^2 (kg m^2 per kg)
    """
    return offset @ offset * np.eye(3) - np.outer(offset, offset)
