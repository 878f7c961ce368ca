"""Solids of simple shape around an arm, in the world frame in which its base is placed; metres."""

from __future__ import annotations

import numpy as np

from er3a.by_value import ByValue, Displayed, Sheet, frozen, shortly
from er3a.errors import PoseError
from er3a.geometry.transforms import check_poses
from er3a.numerics.arrays import Integers, Reals
from er3a.robots.robot import PairRule

UNIT_LENGTH = 1e-6  # by which a normal's length may differ from 1


@frozen
class Box(ByValue):
    """A box about its own middle.

    Attributes
    ----------
    T : (4, 4), T_world_box; size : (3,), m, edges along its x, y and z
    """

    name: str
    T: Reals
    size: Reals

    def __post_init__(self) -> None:
        _check(self.name, self.T, *np.ravel(self.size))

    @property
    def measures(self) -> str:
        """Where it is, and its edges, in mm."""
        return f"{_place(self.T)}; size {shortly(tuple((1000 * np.asarray(self.size)).tolist()))}"


@frozen
class Cylinder(ByValue):
    """A cylinder about its own middle, along its z axis.

    Attributes
    ----------
    T : (4, 4), T_world_cylinder; radius, length : m
    """

    name: str
    T: Reals
    radius: float
    length: float

    def __post_init__(self) -> None:
        _check(self.name, self.T, self.radius, self.length)

    @property
    def measures(self) -> str:
        """Where it is, radius and length, in mm."""
        return f"{_place(self.T)}; radius {1000 * self.radius:.6g}, length {1000 * self.length:.6g}"


@frozen
class Sphere(ByValue):
    """A ball.

    Attributes
    ----------
    T : (4, 4), T_world_sphere, not turned; radius : m
    """

    name: str
    T: Reals
    radius: float

    def __post_init__(self) -> None:
        _check(self.name, self.T, self.radius)

    @property
    def measures(self) -> str:
        """Where it is, and its radius, in mm."""
        return f"{_place(self.T)}; radius {1000 * self.radius:.6g}"


@frozen
class Plane(ByValue):
    """A half-space: all points p with normal . p <= offset are solid.

    Attributes
    ----------
    normal : (3,), of unit length, out of the solid; offset : m
    """

    name: str
    normal: Reals
    offset: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.offset) and abs(np.linalg.norm(self.normal) - 1.0) <= UNIT_LENGTH):
            raise PoseError(f"the plane '{self.name}' needs a normal of length 1 and a finite offset")

    @property
    def measures(self) -> str:
        """Its normal, and how far along it (mm) the solid ends."""
        return f"normal {shortly(tuple(np.asarray(self.normal).tolist()))}; offset {1000 * self.offset:.6g}"


@frozen
class Mesh(ByValue):
    """A surface of triangles; what is inside a closed one is solid.

    Attributes
    ----------
    T : (4, 4), T_world_mesh; points : (k, 3), m, in the mesh's frame; faces : (f, 3), rows of points
    """

    name: str
    T: Reals
    points: Reals
    faces: Integers

    def __post_init__(self) -> None:
        _check(self.name, self.T, float(np.ptp(self.points[self.faces], axis=(0, 1)).max()))

    @property
    def measures(self) -> str:
        """Where it is, and of how many triangles."""
        return f"{_place(self.T)}; {len(self.faces)} triangles"


Solid = Box | Cylinder | Sphere | Plane | Mesh


@frozen
class Scene(ByValue, Displayed):
    """What an arm may not touch; no two solids have the same name.

    Attributes
    ----------
    carried : what the tool carries, placed in the tool's frame; it belongs to the last link
    pair_rules : contacts that are allowed: of links, of what is carried, and of solids
    """

    title: str
    solids: tuple[Solid, ...]
    carried: tuple[Solid, ...] = ()
    pair_rules: tuple[PairRule, ...] = ()

    def sheet(self) -> Sheet:
        """What the notebook shows: a row for each solid, measures in mm.

        Returns
        -------
        sheet : its first rows, and how many are left out
        """
        rows = ((solid.name, type(solid).__name__.lower(), solid.measures) for solid in self.solids)
        return Sheet.of_table(f"Scene: {shortly(self.title)}", ("name", "solid", "measures"), rows)


def _check(name: str, T: Reals, *sizes: float) -> None:
    """Refuse a solid that has no place or no size."""
    check_poses(T, f"the place of '{name}'")
    if not all(np.isfinite(size) and size > 0 for size in sizes):
        raise PoseError(f"the solid '{name}' needs sizes above 0")


def _place(T: Reals) -> str:
    return f"at {shortly(tuple((1000 * T[:3, 3]).tolist()))}"
