"""The bodies of a scene in a drawing seen along an axis of the base frame."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from matplotlib.axes import Axes
from matplotlib.lines import AxLine
from matplotlib.patches import Polygon

from er3a.collision.scene import Box, Cylinder, Mesh, Plane, Scene, Sphere
from er3a.numerics.arrays import Reals
from er3a.pipeline.viewing.palette import MUTED

_CORNERS = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T
_TURN = np.linspace(0.0, 2.0 * np.pi, 73)
_CIRCLE = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=1)
_EDGE_ON = 1e-6  # by which a plane's normal may leave the drawing for the plane to be a line in it
_STYLE: dict[str, Any] = {"edgecolor": MUTED, "linewidth": 1.1, "hatch": "////", "fill": False, "zorder": 1.5}


def draw_scene(axes: Axes, scene: Scene | None, shown: list[int]) -> None:
    """Draw the solids of a scene in mm, which widen no limits of the drawing; a plane only where it is seen edge on.

    Parameters
    ----------
    shown : the numbers of the two axes that the drawing shows
    """
    for solid in scene.solids if scene else ():
        if isinstance(solid, Plane):
            normal = np.asarray(solid.normal)[shown]
            if abs(np.linalg.norm(normal) - 1.0) < _EDGE_ON:
                along = np.array([-normal[1], normal[0]])
                start = 1000 * solid.offset * normal
                axes.add_artist(AxLine(tuple(start), tuple(start + along), None, color=MUTED, linewidth=1.1))
            continue
        for outline in outlines(solid, shown):
            axes.add_artist(Polygon(1000 * outline, **_STYLE))


def outlines(solid: Box | Cylinder | Sphere | Mesh, shown: list[int]) -> list[Reals]:
    """The outline of each convex piece of a solid, corners (k, 2) in m, seen along the axis that is not shown."""
    if isinstance(solid, Sphere):
        return [np.asarray(solid.T)[:3, 3][shown] + solid.radius * _CIRCLE]
    pieces = [points @ solid.T[:3, :3].T + solid.T[:3, 3] for points in _pieces(solid)]
    return [piece[scipy.spatial.ConvexHull(piece).vertices] for piece in (own[:, shown] for own in pieces)]


def _pieces(solid: Box | Cylinder | Mesh) -> list[Reals]:
    """Points (k, 3), m, in the solid's frame, whose hulls are its pieces."""
    if isinstance(solid, Box):
        return [_CORNERS * solid.size]
    if isinstance(solid, Mesh):
        return list(solid.pieces)
    circle, half = solid.radius * _CIRCLE, solid.length / 2
    return [np.concatenate([np.column_stack([circle, np.full(len(circle), z)]) for z in (-half, half)])]
