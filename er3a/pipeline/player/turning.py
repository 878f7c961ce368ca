"""3-D figures that can be rotated: clouds, lines and surfaces in layers, drawn by the page itself.

They are drawn like the player's arm, on a plain canvas, so that a page carries no 3-D library.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import jinja2
import numpy as np
from markupsafe import Markup
from matplotlib import colormaps
from matplotlib.colors import to_hex
from scipy.spatial import ConvexHull

from er3a.collision.scene import Cylinder, Scene, Sphere
from er3a.collision.shapes import ROUND, solid_pieces
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.language import N_, own_title, tr
from er3a.pipeline.viewing.palette import MUTED

_HERE = Path(__file__).parent
TEMPLATES = jinja2.Environment(loader=jinja2.FileSystemLoader(_HERE), autoescape=True, trim_blocks=True)
STEPS = 65_535  # that the box around everything is divided into
SHADES = 64
DARKEST = 0.33  # of a scale of colours, which is still seen on a dark page
WORDS = {
    "picture": N_("Drag or use the arrow keys to turn the picture, + and − to zoom."),
    "shown": N_("shown"),
    "no_script": N_("This picture needs JavaScript; the recording of this stage shows the same in the Rerun viewer."),
}


@dataclass(frozen=True, eq=False)
class Layer:
    """Something of a figure in space that can be shown or left out.

    Attributes
    ----------
    name : what the figure's key calls it
    kind : squares at the points, a line through them, or a surface of triangles
    points_mm : (N, 3); a line is interrupted where one is NaN
    colour : ``#rrggbb``; empty for the ink of the page
    width : of a line or a square, px
    shade : (N,) in 0..1, a place in the scale of colours, instead of ``colour``; none for surfaces
    faces : (M, 3), points of each triangle of a surface, counter-clockwise from outside
    """

    name: str
    kind: Literal["points", "line", "surface"]
    points_mm: Reals
    colour: str = ""
    width: float = 2.0
    shade: Reals | None = None
    faces: Integers | None = None


@dataclass(frozen=True)
class ColourScale:
    """What colours mean: a Matplotlib colour map, a title, and texts at places in 0..1."""

    colours: str
    title: str
    ticks: Sequence[tuple[float, str]]


_TURN = np.linspace(0.0, 2.0 * np.pi, 73)
CIRCLE = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=1)
_SHARP = np.cos(np.radians(20.0))  # of the angle between two faces whose edge is drawn


def scene_layers(scene: Scene | None) -> list[Layer]:
    """The edges of what stands in a scene, but for planes; none without a scene."""
    lines: list[Reals] = []
    for solid in scene.solids if scene else ():
        if isinstance(solid, Sphere):
            flat = np.column_stack([solid.radius * CIRCLE, np.zeros(len(CIRCLE))])
            lines += [np.roll(flat, k, axis=1) + solid.T[:3, 3] for k in range(3)]
            continue
        pieces = solid_pieces(solid)
        lines += [line for piece in pieces for line in _edges(piece) or _contours(piece)]
        if isinstance(solid, Cylinder):  # four lines along a wall that turns evenly
            lines += list(pieces[0].reshape(2, -1, 3)[:, :: ROUND // 4].swapaxes(0, 1))
    if not lines or scene is None:
        return []
    gap = np.full((1, 3), np.nan)
    points = np.concatenate([part for line in lines for part in (line, gap)])
    return [Layer(own_title(scene.title), "line", 1000 * points, MUTED, 1.5)]


def _edges(points: Reals) -> list[Reals]:
    """The edges (2, 3) of a convex hull at which its faces turn."""
    hull = ConvexHull(points)
    normals = hull.equations[:, :3]
    return [
        points[np.delete(hull.simplices[face], corner)]
        for face, neighbours in enumerate(hull.neighbors)
        for corner, other in enumerate(neighbours)
        if face < other and normals[face] @ normals[other] < _SHARP
    ]


def _contours(points: Reals) -> list[Reals]:
    """Where a convex hull without edges ends as seen along each axis of the world: closed lines (k, 3)."""
    seen = [ConvexHull(np.delete(points, axis, axis=1)).vertices for axis in range(3)]
    return [points[[*corners, corners[0]]] for corners in seen]


AZIMUTH_DEG = -65.0  # about z, from where a figure is seen at first


def turning_figure(
    groups: Mapping[str, Sequence[Layer]], scale: ColourScale | None = None, first: str | None = None
) -> Markup:
    """The figure as HTML, one a page, whose head holds ``drawing_head``.

    Parameters
    ----------
    groups : layers that are seen together, by name; a reader chooses one
    first : the group that is seen at first, the first of all if None
    """
    points = np.concatenate([layer.points_mm for layers in groups.values() for layer in layers])
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    low[2] = min(low[2], 0.0)
    low, high = low - 50.0, high + 50.0
    back = -1 if scale and scale.colours.endswith("_r") else 1
    shades = colormaps[scale.colours.removesuffix("_r")](np.linspace(DARKEST, 1, SHADES))[::back] if scale else ()
    data = {
        "box": [low.tolist(), high.tolist()],
        "azimuth": float(np.radians(AZIMUTH_DEG)),
        "palette": [to_hex(colour) for colour in shades],
        "first": first,
        "groups": [
            {"name": name, "layers": [_layer(layer, low, high) for layer in layers]} for name, layers in groups.items()
        ],
    }
    return Markup(
        TEMPLATES.get_template("turning.html.j2").render(
            words={key: tr(text) for key, text in WORDS.items()},
            groups=list(groups),
            scale=scale,
            data=data,
            script=(_HERE / "turning.js").read_text(encoding="utf-8"),
        )
    )


def _layer(layer: Layer, low: Reals, high: Reals) -> dict[str, Any]:
    there = np.isfinite(layer.points_mm).all(axis=1)
    places = np.round((layer.points_mm[there] - low) / (high - low) * STEPS)
    packed: dict[str, Any] = {
        "name": layer.name,
        "kind": layer.kind,
        "points": _packed(places, "<u2"),
        "colour": layer.colour,
        "width": layer.width,
    }
    if layer.shade is not None:
        packed["shades"] = _packed(np.clip(layer.shade[there], 0, 1) * (SHADES - 1), "u1")
    if layer.faces is not None:
        packed["faces"] = _packed(layer.faces, "<u4")
    if layer.kind == "line":
        packed["starts"] = np.flatnonzero(np.diff(there.astype(int), prepend=0)[there] > 0).tolist()
    return packed


def _packed(values: Reals | Integers, kind: str) -> str:
    return base64.b64encode(np.round(values).astype(kind).tobytes()).decode("ascii")
