"""A study's scene in a recording: what the arm may not touch, below ``/<stage>/scene``."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import rerun as rr

from er3a.files.scene_file import Plane, SceneFile, load_scene
from er3a.geometry.transforms import transform
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import size_of
from er3a.pipeline.viewing.palette import MUTED, rgb

_PLANE_THICKNESS = 0.002  # m


def log_scene(stream: rr.RecordingStream, study: Study, name: str, stage: str) -> None:
    """Log the solids of a robot's scene in a stage, each an entity of its own; of planes the part around the arm."""
    file = study.scene(name, stage)
    if file is None:
        return
    robot = study.robot(name)
    for solid, T, shape in _solids(load_scene(file), robot.base[:3, 3], 3 * size_of(robot)):
        place = rr.Transform3D(translation=T[:3, 3], mat3x3=T[:3, :3])
        stream.log(f"{stage}/scene/{solid}", place, shape, static=True)


def _solids(
    scene: SceneFile, base: np.ndarray, plane_size: float
) -> Iterator[tuple[str, np.ndarray, rr.Boxes3D | rr.Cylinders3D | rr.Ellipsoids3D]]:
    """Name, place (4, 4) and shape of each solid; planes are squares of ``plane_size`` (m) nearest to the base (3,)."""
    style = {"colors": [(*rgb(MUTED), 120)], "fill_mode": "transparentfillmajorwireframe"}
    for box in scene.boxes:
        shape = rr.Boxes3D(sizes=[np.array(box.size_mm) / 1000], **style)
        yield box.name, _place(box.xyz_mm, box.rpy_deg), shape
    for cylinder in scene.cylinders:
        length, radius = cylinder.length_mm / 1000, cylinder.radius_mm / 1000
        shape = rr.Cylinders3D(lengths=[length], radii=[radius], **style)
        yield cylinder.name, _place(cylinder.xyz_mm, cylinder.rpy_deg), shape
    for sphere in scene.spheres:
        shape = rr.Ellipsoids3D(radii=[sphere.radius_mm / 1000], **style)
        yield sphere.name, _place(sphere.xyz_mm, [0, 0, 0]), shape
    for plane in scene.planes:
        shape = rr.Boxes3D(sizes=[[plane_size, plane_size, _PLANE_THICKNESS]], **style)
        yield plane.name, _below(plane, base), shape


def _place(xyz_mm: list[float], rpy_deg: list[float]) -> np.ndarray:
    return transform(np.array(xyz_mm) / 1000, np.radians(rpy_deg))


def _below(plane: Plane, base: np.ndarray) -> np.ndarray:
    """Where a slab lies whose upper side is in the plane, its middle next to the base."""
    normal = plane.unit_normal()
    offset = plane.offset_mm / 1000 / np.linalg.norm(plane.normal)
    x = np.linalg.svd(normal[None])[2][1]
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(normal, x), normal], axis=1)
    T[:3, 3] = base - (normal @ base - offset + _PLANE_THICKNESS / 2) * normal
    return T
