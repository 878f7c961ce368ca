"""Solids of simple shape around an arm, in the frame that its base is placed in; metres."""

from __future__ import annotations

from dataclasses import dataclass

from er3a.numerics.arrays import Reals


@dataclass(frozen=True, eq=False)
class Box:
    """A box about its own middle.

    Attributes
    ----------
    T : (4, 4), T_world_box; size : (3,), m, edges along its x, y and z
    """

    name: str
    T: Reals
    size: Reals


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A cylinder about its own middle, along its z axis.

    Attributes
    ----------
    T : (4, 4), T_world_cylinder; radius, length : m
    """

    name: str
    T: Reals
    radius: float
    length: float


@dataclass(frozen=True, eq=False)
class Sphere:
    """A ball.

    Attributes
    ----------
    T : (4, 4), T_world_sphere, not turned; radius : m
    """

    name: str
    T: Reals
    radius: float


@dataclass(frozen=True, eq=False)
class Plane:
    """A half-space: all points p with normal . p <= offset are solid.

    Attributes
    ----------
    normal : (3,), of unit length, out of the solid; offset : m
    """

    name: str
    normal: Reals
    offset: float


Solid = Box | Cylinder | Sphere | Plane


@dataclass(frozen=True, eq=False)
class Scene:
    """What an arm may not touch; no two solids have the same name."""

    title: str
    boxes: tuple[Box, ...] = ()
    cylinders: tuple[Cylinder, ...] = ()
    spheres: tuple[Sphere, ...] = ()
    planes: tuple[Plane, ...] = ()

    @property
    def solids(self) -> tuple[Solid, ...]:
        """All of them."""
        return (*self.boxes, *self.cylinders, *self.spheres, *self.planes)
