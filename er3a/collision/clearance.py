"""How far an arm stays clear of its surroundings and of itself, by the Coal library [1]_.

Left out are pairs that can't tell anything: links with at most one link between them, pairs joined over a way shorter
than their two radii (the wrist), and the base with the surroundings that it stands on.

References
----------
.. [1] J. Pan et al., Coal (formerly hpp-fcl), an extension of the Flexible Collision Library: GJK and EPA distances.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

from er3a.collision.envelopes import BASE, capsule_poses, envelopes_of
from er3a.collision.scene import SceneFile
from er3a.errors import Er3aError
from er3a.kinematics.transforms import transform
from er3a.robots.robot import Envelope, Robot

try:
    import coal
except ImportError:  # no wheels for this platform
    coal = None


@dataclass(frozen=True, eq=False)
class Clearance:
    """Least distances of arms.

    Attributes
    ----------
    distance : (N,), m; negative where something overlaps, by the depth
    pair : N texts, what is nearest to what
    """

    distance: np.ndarray
    pair: tuple[str, ...]


def can_measure() -> bool:
    """Whether the Coal library is there."""
    return coal is not None


def clearance(robot: Robot, q: np.ndarray, scene: SceneFile | None) -> Clearance:
    """Least distance of each arm (N, 6) in rad from the scene's solids and from itself.

    Raises
    ------
    Er3aError
        if the Coal library is missing, or the scene is none
    """
    if coal is None:
        raise Er3aError("clearance needs the Coal library, which has no wheels for this platform; leave the scene out")
    if not isinstance(scene, SceneFile | None):
        raise Er3aError(f"the scene is a {type(scene).__name__}; expected what er3a.load_scene returns")
    capsules = envelopes_of(robot)
    shapes = [coal.Capsule(c.radius, float(np.linalg.norm(np.subtract(c.end, c.start)))) for c in capsules]
    solids = _solids(scene) if scene else []
    pairs = _self_pairs(robot)
    distances, names = [], []
    for ends in capsule_poses(robot, capsules, np.asarray(q, float).reshape(-1, 6)):
        placed = [_placed(start, end) for start, end in ends]
        least, pair = np.inf, "nothing near"
        for i, j in pairs:
            value = _distance(shapes[i], placed[i], shapes[j], placed[j])
            if value < least:
                least, pair = value, f"{_link_name(capsules[i])} and {_link_name(capsules[j])}"
        for name, solid, where in solids:
            for capsule, shape, place in zip(capsules, shapes, placed):
                if capsule.link != BASE and (value := _distance(shape, place, solid, where)) < least:
                    least, pair = value, f"{_link_name(capsule)} and {name}"
        distances.append(least)
        names.append(pair)
    return Clearance(np.array(distances), tuple(names))


@lru_cache(maxsize=64)
def _self_pairs(robot: Robot) -> tuple[tuple[int, int], ...]:
    """Pairs of capsules (by number) that can come apart, so that their distance means something."""
    capsules = envelopes_of(robot)
    lengths = {link: 0.0 for link in range(7)}
    for capsule in capsules:
        lengths[capsule.link] += float(np.linalg.norm(np.subtract(capsule.end, capsule.start)))
    pairs = []
    for i, first in enumerate(capsules):
        for j, second in enumerate(capsules[:i]):
            low, high = sorted((first.link, second.link))
            between = sum(lengths[link] for link in range(low + 1, high))
            if high - low > 2 and between > first.radius + second.radius:
                pairs.append((j, i))
    return tuple(pairs)


def _solids(scene: SceneFile) -> list[tuple[str, object, object]]:
    """Name, shape and place of each of the scene's solids."""
    found = []
    for box in scene.boxes:
        found.append((box.name, coal.Box(*(np.array(box.size_mm) / 1000)), _place(box.xyz_mm, box.rpy_deg)))
    for cylinder in scene.cylinders:
        shape = coal.Cylinder(cylinder.radius_mm / 1000, cylinder.length_mm / 1000)
        found.append((cylinder.name, shape, _place(cylinder.xyz_mm, cylinder.rpy_deg)))
    for sphere in scene.spheres:
        found.append((sphere.name, coal.Sphere(sphere.radius_mm / 1000), _place(sphere.xyz_mm, [0.0] * 3)))
    for plane in scene.planes:
        offset = plane.offset_mm / 1000 / np.linalg.norm(plane.normal)
        found.append((plane.name, coal.Halfspace(plane.unit_normal(), offset), coal.Transform3s.Identity()))
    return found


def _place(xyz_mm: list[float], rpy_deg: list[float]):
    T = transform(np.array(xyz_mm) / 1000, np.radians(rpy_deg))
    return coal.Transform3s(T[:3, :3], T[:3, 3])


def _placed(start: np.ndarray, end: np.ndarray):
    """Where a capsule (along its own z, about its middle) lies."""
    along = end - start
    length = np.linalg.norm(along)
    R = Rotation.align_vectors([along / length], [[0.0, 0.0, 1.0]])[0].as_matrix() if length > 0 else np.eye(3)
    return coal.Transform3s(R, (start + end) / 2)


def _distance(a, place_a, b, place_b) -> float:
    return coal.distance(a, place_a, b, place_b, coal.DistanceRequest(), coal.DistanceResult())


def _link_name(capsule: Envelope) -> str:
    return "base" if capsule.link == BASE else f"link {capsule.link}"
