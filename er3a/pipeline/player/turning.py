"""3-D figures that can be turned and cut open: clouds, lines and surfaces in layers among solids, drawn by the page."""

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

from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.language import N_, tr
from er3a.pipeline.viewing.palette import INK, rgb
from er3a.pipeline.viewing.still import Still

_HERE = Path(__file__).parent
TEMPLATES = jinja2.Environment(loader=jinja2.FileSystemLoader(_HERE), autoescape=True, trim_blocks=True)
STEPS = 65_535  # that the box around everything is divided into
SHADES = 64
DARKEST = 0.33  # of a scale of colours, which is still seen on a dark page
WORDS = {
    "picture": N_("Drag or use the arrow keys to turn the picture, + and − to zoom."),
    "shown": N_("shown"),
    "cut": N_("cut"),
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
    cut : whether the plane that a reader moves cuts it open
    """

    name: str
    kind: Literal["points", "line", "surface"]
    points_mm: Reals
    colour: str = ""
    width: float = 2.0
    shade: Reals | None = None
    faces: Integers | None = None
    cut: bool = False


@dataclass(frozen=True)
class ColourScale:
    """What colours mean: a Matplotlib colour map, a title, and texts at places in 0..1."""

    colours: str
    title: str
    ticks: Sequence[tuple[float, str]]


@dataclass(frozen=True, eq=False)
class Solids:
    """Shapes of ``viewing/drawn.py`` under one name, which can be left out: an arm in one pose, or a scene.

    ``poses`` : (k, 4, 4), of the frames that the shapes are in, m
    """

    name: str
    shapes: Sequence[dict[str, Any]]
    poses: Reals
    colour: str


AZIMUTH_DEG, ELEVATION_DEG = -65.0, 15.0  # from where a figure is seen at first
FILLED = 0.45  # of the distance that holds the box's diagonal


def turning_figure(
    groups: Mapping[str, Sequence[Layer]],
    scale: ColourScale | None = None,
    first: str | None = None,
    solids: Sequence[Solids] = (),
    cut_m: float | None = None,
) -> Markup:
    """The figure as HTML, one a page, whose head holds ``drawing_head``.

    Parameters
    ----------
    groups : layers that are seen together, by name; a reader chooses one
    first : the group that is seen at first, the first of all if None
    solids : seen with every group
    cut_m : y of the plane that cuts layers open at first, m; None for the middle
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
        "elevation": float(np.radians(ELEVATION_DEG)),
        "filled": FILLED,
        "palette": [to_hex(colour) for colour in shades],
        "first": first,
        "cut": 0.5 if cut_m is None else float((1000 * cut_m - low[1]) / (high[1] - low[1])),
        "solids": [
            {"name": s.name, "shapes": list(s.shapes), "poses": s.poses.tolist(), "colour": s.colour} for s in solids
        ],
        "groups": [
            {"name": name, "layers": [_layer(layer, low, high) for layer in layers]} for name, layers in groups.items()
        ],
    }
    return Markup(
        TEMPLATES.get_template("turning.html.j2").render(
            words={key: tr(text) for key, text in WORDS.items()},
            groups=list(groups),
            scale=scale,
            cut=data["cut"],
            data=data,
            still=_still(groups[first or next(iter(groups))], solids, data),
            script=(_HERE / "turning.js").read_text(encoding="utf-8"),
        )
    )


def _still(layers: Sequence[Layer], solids: Sequence[Solids], data: dict[str, Any]) -> Markup:
    """The figure as it opens, for a page without WebGL; a body that is cut is its half behind the plane."""
    low, high = np.array(data["box"]) / 1000
    plane = low[1] + data["cut"] * (high[1] - low[1])
    length = FILLED * float(np.linalg.norm(high - low))
    picture = Still((low + high) / 2, length, data["azimuth"], data["elevation"])
    for each in solids:
        picture.solids(each.shapes, each.poses, {})
    for layer in sorted(layers, key=lambda layer: layer.cut):
        points = layer.points_mm / 1000
        behind = ~(points[:, 1] < plane) | (not layer.cut)
        if layer.faces is not None:
            picture.surface(
                points, layer.faces[behind[layer.faces].all(axis=1)], layer.colour, 0.3 if layer.cut else 1.0
            )
        elif layer.kind == "points":
            shades = (
                np.zeros(len(points), int)
                if layer.shade is None
                else np.rint((SHADES - 1) * layer.shade).clip(0, SHADES - 1)
            )
            colours = (
                np.array([rgb(each) for each in data["palette"] or (layer.colour or INK,)])[shades.astype(int)] / 255
            )
            picture.points(points[behind], colours[behind], layer.width)
        else:
            for line in np.split(points, np.flatnonzero(np.isnan(points[:, 0]))):
                picture.line(line[np.isfinite(line[:, 0])], layer.colour or INK, layer.width)
    return picture.markup()


def _layer(layer: Layer, low: Reals, high: Reals) -> dict[str, Any]:
    there = np.isfinite(layer.points_mm).all(axis=1)
    places = np.round((layer.points_mm[there] - low) / (high - low) * STEPS)
    packed: dict[str, Any] = {
        "name": layer.name,
        "kind": layer.kind,
        "points": _packed(places, "<u2"),
        "colour": layer.colour,
        "width": layer.width,
        "cut": layer.cut,
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
