"""Scene files: obstacles of simple shape around an arm, in the world frame in which the robot's base is placed."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from er3a.collision import scene as library
from er3a.files.kept_files import own_or_shipped
from er3a.files.robot_file import CollisionPairs, DecidedPair, MeshFile, Name, Placement, Text
from er3a.files.units import MAX_DISTANCE_MM, SHORTEST_PLAIN_LENGTH_MM, PositionMm, RpyDeg, Triple, doubt
from er3a.files.yaml_file import InputFile, StrictModel, load
from er3a.geometry.transforms import transform

SMALLEST_OBSTACLE_MM = 2.0
THIN_MM = 1.0
PLAIN_OBSTACLE_MM = 10.0
"""What stands in a cell is longer; a shorter one may be written in metres."""
FURNITURE_MM = 100.0
"""A scene with something as long is in mm."""
FAR_IN_METRES = 20.0
"""A place farther out than this is none of an arm's cell if it is in metres."""
MAX_LINKS = 30
SHAPES = ("boxes", "cylinders", "spheres", "planes", "meshes")

Length = Annotated[float, Field(gt=0, le=MAX_DISTANCE_MM)]


class Obstacle(Placement):
    """A named solid; its own axes lie at ``xyz_mm`` (the solid's centre), turned by ``rpy_deg``."""

    name: Name
    xyz_mm: PositionMm
    rpy_deg: RpyDeg = [0.0, 0.0, 0.0]


class BoxObstacle(Obstacle):
    """``size_mm``: edges along x, y and z."""

    size_mm: Annotated[list[Length], Field(min_length=3, max_length=3)]

    @field_validator("size_mm")
    @classmethod
    def _large_enough(cls, values: list[float]) -> list[float]:
        _check_size(max(values))
        return values

    def solid(self) -> library.Box:
        """The box in the units of the library: edges (3,) in m."""
        return library.Box(self.name, self.transform(), np.array(self.size_mm) / 1000)


class CylinderObstacle(Obstacle):
    """A cylinder along its own z axis."""

    radius_mm: Length
    length_mm: Length

    @model_validator(mode="after")
    def _large_enough(self) -> Self:
        _check_size(max(2 * self.radius_mm, self.length_mm))
        if self.radius_mm < THIN_MM:
            doubt(self, "radius_mm", f"{self.radius_mm:g} mm", "metres")
        return self

    def solid(self) -> library.Cylinder:
        """The cylinder in the units of the library: radius and length in m, its axis along z."""
        return library.Cylinder(self.name, self.transform(), self.radius_mm / 1000, self.length_mm / 1000)


class MeshObstacle(Obstacle, MeshFile):
    """The triangles of a mesh file; its own axes lie at ``xyz_mm``."""

    def solid(self) -> library.Mesh:
        """In the units of the library; :class:`InputError` for a file that holds no triangles."""
        return library.Mesh(self.name, self.transform(), *self.triangles())


class SphereObstacle(StrictModel):
    name: Name
    xyz_mm: PositionMm
    radius_mm: Length

    @field_validator("radius_mm")
    @classmethod
    def _large_enough(cls, value: float) -> float:
        _check_size(2 * value)
        return value

    def solid(self) -> library.Sphere:
        """The sphere in the units of the library: radius in m."""
        return library.Sphere(self.name, transform(np.array(self.xyz_mm) / 1000, np.zeros(3)), self.radius_mm / 1000)


class PlaneObstacle(StrictModel):
    """All points p with normal . p <= offset are solid; the normal points out and needs no unit length."""

    name: Name
    normal: Triple
    offset_mm: Annotated[float, Field(ge=-MAX_DISTANCE_MM, le=MAX_DISTANCE_MM)]

    @field_validator("normal")
    @classmethod
    def _has_direction(cls, values: list[float]) -> list[float]:
        if not 1e-6 <= math.hypot(*values) <= 1e6:
            raise ValueError("the normal has no direction | Write a vector of about unit length out of the solid")
        return values

    @model_validator(mode="after")
    def _plain_offset(self) -> Self:
        if 0 < abs(self.offset_mm) < SHORTEST_PLAIN_LENGTH_MM and not self.offset_mm.is_integer():
            doubt(self, "offset_mm", f"{self.offset_mm:g} mm", "metres")
        return self

    def solid(self) -> library.Plane:
        """In the units of the library."""
        length = np.linalg.norm(self.normal)
        return library.Plane(self.name, np.array(self.normal) / length, float(self.offset_mm / 1000 / length))


class Carried(StrictModel):
    """What the tool carries, placed in the tool's frame."""

    boxes: list[BoxObstacle] = []
    cylinders: list[CylinderObstacle] = []
    spheres: list[SphereObstacle] = []
    meshes: list[MeshObstacle] = []


class AllowedPairs(CollisionPairs):
    """Pairs that are not checked. A scene can't add checks to those of the collision matrix."""

    watch: Annotated[list[DecidedPair], Field(max_length=0)] = []


class SceneFile(InputFile):
    """data/scenes/NAME.yaml. ``collision``: allowed contacts between the arm, carried objects and solids."""

    kind: Literal["scene"]
    title: Text
    title_zh: Text | None = None
    boxes: list[BoxObstacle] = []
    cylinders: list[CylinderObstacle] = []
    spheres: list[SphereObstacle] = []
    planes: list[PlaneObstacle] = []
    meshes: list[MeshObstacle] = []
    carried: Carried = Carried()
    collision: AllowedPairs = AllowedPairs()

    @model_validator(mode="after")
    def _plain_solids(self) -> Self:
        """What is carried may be small; what stands in the cell is not, but for a pin between larger things."""
        longest = [max(box.size_mm) for box in self.boxes] + [2 * ball.radius_mm for ball in self.spheres]
        longest += [max(2 * each.radius_mm, each.length_mm) for each in self.cylinders]
        in_mm = max(longest, default=0.0) >= FURNITURE_MM
        for box in self.boxes:
            if max(box.size_mm) < PLAIN_OBSTACLE_MM and not (in_mm and _is_pin(box.xyz_mm, min(box.size_mm))):
                doubt(box, "size_mm", f"{box.size_mm} mm", "metres")
        for ball in self.spheres:
            if 2 * ball.radius_mm < PLAIN_OBSTACLE_MM and not (in_mm and _is_pin(ball.xyz_mm, ball.radius_mm)):
                doubt(ball, "radius_mm", f"{ball.radius_mm:g} mm", "metres")
        return self

    def scene(self) -> library.Scene:
        """In the units of the library."""
        solids, carried = (
            tuple(obstacle.solid() for shape in SHAPES for obstacle in getattr(part, shape, []))
            for part in (self, self.carried)
        )
        return library.Scene(self.title, solids, carried, self.collision.rules())

    @model_validator(mode="after")
    def _obstacles_with_own_names(self) -> Self:
        seen: dict[str, str] = {}
        for part, prefix in ((self, ""), (self.carried, "carried.")):
            for shape in SHAPES:
                for i, obstacle in enumerate(getattr(part, shape, [])):
                    where = f"{prefix}{shape}[{i}]"
                    if obstacle.name in seen:
                        problem = f"{where}: the name '{obstacle.name}' is that of {seen[obstacle.name]}"
                        raise ValueError(f"{problem} | Rename")
                    if re.fullmatch(r"base|link_\d+", obstacle.name):
                        raise ValueError(f"{where}: '{obstacle.name}' is the name of a part of the arm | Rename")
                    seen[obstacle.name] = where
        if not seen:
            raise ValueError(f"the scene is empty | Add an obstacle under {', '.join(SHAPES)}")
        links = ["base", *(f"link_{k}" for k in range(1, MAX_LINKS + 1))]
        self.collision.check({*seen, *links})
        return self


def load_scene(path: str | Path) -> library.Scene:
    """Read and check a scene file.

    Parameters
    ----------
    path : or its name in ``data/scenes`` of the study, or of er3a

    Raises
    ------
    InputError
        naming file, field and remedy
    """
    return load(SceneFile, own_or_shipped(path if Path(path).suffix else f"data/scenes/{path}.yaml")).scene()


def _is_pin(xyz_mm: list[float], least: float) -> bool:
    """Whether a small solid can't be in metres: it would be a block of metres each way, and far from any arm."""
    return least >= THIN_MM and max(map(abs, xyz_mm)) > FAR_IN_METRES


def _check_size(longest: float) -> None:
    if longest < SMALLEST_OBSTACLE_MM:
        raise ValueError(f"its longest side of {longest:g} mm can only be metres | Multiply by 1000")
