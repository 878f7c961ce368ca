"""Arms with the meshes of their URDF, as Pinocchio places them and Coal measures them: the oracle for an arm's shapes.

Nothing of ours is used: Pinocchio reads the URDF and its meshes itself, and they are measured as triangles.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin

from er3a.formats.urdf import UrdfImport


class MeshPeer:
    """The collision geometry of an import, by our numbers of links.

    Attributes
    ----------
    links : of each number of a link that has any, its geometry's numbers
    """

    def __init__(self, path: Path, imported: UrdfImport) -> None:
        self.model = pin.buildModelFromUrdf(str(path))
        folders = [str(parent) for parent in path.resolve().parents]
        self.geometry = pin.buildGeomFromUrdf(self.model, str(path), pin.GeometryType.COLLISION, folders)
        self.data, self.placed = self.model.createData(), pin.GeometryData(self.geometry)
        self.joints = [self.model.joints[self.model.getJointId(name)] for name in imported.joints]
        numbers = {joint.id: k + 1 for k, joint in enumerate(self.joints)} | {0: 0}
        self.links: dict[int, list[int]] = {}
        for number, shape in enumerate(self.geometry.geometryObjects):
            if shape.parentJoint in numbers:
                self.links.setdefault(numbers[shape.parentJoint], []).append(number)

    def place(self, q: np.ndarray) -> None:
        """Move the arm to joint values (n,), rad or m; all other joints of the URDF stay at 0."""
        values = pin.neutral(self.model)
        for joint, value in zip(self.joints, q):
            values[joint.idx_q : joint.idx_q + joint.nq] = value if joint.nq == 1 else (np.cos(value), np.sin(value))
        pin.updateGeometryPlacements(self.model, self.data, self.geometry, self.placed, values)

    def distance(self, first: int, second: int) -> float:
        """Least distance (m) of two links' surfaces in the arm's pose; 0 or less where they touch or cross."""
        return self._least(self.links[first], self.links[second])

    def _least(self, first: Sequence[int], second: Sequence[int]) -> float:
        least, shapes, poses = np.inf, self.geometry.geometryObjects, self.placed.oMg
        for a, b in product(first, second):
            at = [coal.Transform3s(poses[k].rotation, poses[k].translation) for k in (a, b)]
            found = coal.distance(
                shapes[a].geometry, at[0], shapes[b].geometry, at[1], coal.DistanceRequest(), coal.DistanceResult()
            )
            least = min(least, float(found))
        return least
