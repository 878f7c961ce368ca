"""Scene files: obstacles of simple shape around an arm, in the frame that the robot's base is placed in."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from er3a.files.robot_file import Name, Text
from er3a.files.units import FARTHEST_MM, PositionMm, RpyDeg, Triple
from er3a.files.yaml_file import StrictModel, load

SMALLEST_OBSTACLE_MM = 2.0
SHAPES = ("boxes", "cylinders", "spheres", "planes")

Length = Annotated[float, Field(gt=0, le=FARTHEST_MM)]


class Obstacle(StrictModel):
    """A named solid; its own axes lie at ``xyz_mm`` (the solid's centre), turned by ``rpy_deg``."""

    name: Name
    xyz_mm: PositionMm
    rpy_deg: RpyDeg = [0.0, 0.0, 0.0]


class Box(Obstacle):
    """``size_mm``: edges along x, y and z."""

    size_mm: Annotated[list[Length], Field(min_length=3, max_length=3)]

    @field_validator("size_mm")
    @classmethod
    def _large_enough(cls, values):
        _check_size(max(values))
        return values


class Cylinder(Obstacle):
    """A cylinder along its own z axis."""

    radius_mm: Length
    length_mm: Length

    @model_validator(mode="after")
    def _large_enough(self):
        _check_size(max(2 * self.radius_mm, self.length_mm))
        return self


class Sphere(StrictModel):
    name: Name
    xyz_mm: PositionMm
    radius_mm: Length

    @field_validator("radius_mm")
    @classmethod
    def _large_enough(cls, value):
        _check_size(2 * value)
        return value


class Plane(StrictModel):
    """All points p with normal . p <= offset are solid; the normal points out and needs no unit length."""

    name: Name
    normal: Triple
    offset_mm: Annotated[float, Field(ge=-FARTHEST_MM, le=FARTHEST_MM)]

    @field_validator("normal")
    @classmethod
    def _has_direction(cls, values):
        if not 1e-6 <= math.hypot(*values) <= 1e6:
            raise ValueError("the normal has no direction | Write a vector of about unit length out of the solid")
        return values

    def unit_normal(self) -> np.ndarray:
        """The normal at unit length, (3,)."""
        return np.array(self.normal) / np.linalg.norm(self.normal)


class SceneFile(StrictModel):
    """data/scenes/NAME.yaml."""

    kind: Literal["scene"]
    title: Text
    boxes: list[Box] = []
    cylinders: list[Cylinder] = []
    spheres: list[Sphere] = []
    planes: list[Plane] = []

    @model_validator(mode="after")
    def _obstacles_with_own_names(self):
        seen: dict[str, str] = {}
        for shape in SHAPES:
            for i, obstacle in enumerate(getattr(self, shape)):
                where = f"{shape}[{i}]"
                if obstacle.name in seen:
                    raise ValueError(f"{where}: the name '{obstacle.name}' is that of {seen[obstacle.name]} | Rename")
                seen[obstacle.name] = where
        if not seen:
            raise ValueError(f"the scene is empty | Add an obstacle under {', '.join(SHAPES)}")
        return self


def load_scene(path: str | Path) -> SceneFile:
    """Read and check a scene file.

    Raises
    ------
    InputError
        naming file, field and remedy
    """
    return load(SceneFile, path)


def _check_size(longest: float) -> None:
    if longest < SMALLEST_OBSTACLE_MM:
        raise ValueError(f"its longest side of {longest:g} mm can only be metres | Multiply by 1000")
