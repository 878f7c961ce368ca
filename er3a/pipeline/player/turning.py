"""3-D figures that can be turned and cut open: clouds and surfaces in layers among solids, drawn by the page."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from er3a.by_value import by_identity
from er3a.collision.scene import Scene
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.language import own_title, tr
from er3a.pipeline.viewing.drawn import SCENE_COLOUR, drawn_arm, drawn_scene, poses_at
from er3a.pipeline.viewing.page import page_environment
from er3a.pipeline.viewing.palette import BODY
from er3a.pipeline.viewing.still import Still
from er3a.robots.robot import Robot

_HERE = Path(__file__).parent
STEPS = 65_535  # that the box around everything is divided into


@by_identity
class Layer:
    """Something of a figure in space that can be shown or left out.

    Attributes
    ----------
    name : what the figure's key calls it
    points_mm : (N, 3)
    colour : ``#rrggbb``
    faces : (M, 3), points of each triangle of a surface, counter-clockwise from outside
    cut : whether the plane that a reader moves cuts it open
    address : by which a list leads to it
    """

    name: str
    points_mm: Reals
    colour: str
    faces: Integers | None = None
    cut: bool = False
    address: str = ""


@by_identity
class Solids:
    """Shapes of ``viewing/drawn.py`` under one name, which can be left out: an arm in one pose, or a scene.

    Attributes
    ----------
    poses : (k, 4, 4), of the frames that the shapes are in, m
    reached : the arm's poses (m + 2, 4, 4) that show how it serves them; none for those of the first solids
    ways : dimensions from point to point (3,), m, with a word each, shown with the shapes
    """

    name: str
    shapes: Sequence[dict[str, Any]]
    poses: Reals
    colour: str
    address: str = ""
    reached: Sequence[Any] = ()
    ways: Sequence[tuple[Sequence[float], Sequence[float], str]] = ()


def surroundings(robot: Robot, scene: Scene | None, ways: Sequence[Any]) -> list[Solids]:
    """The arm with all joints at 0 and dimensions of its reach, and what is around it."""
    at_zero = poses_at(robot, np.zeros(robot.joints))
    solids = [Solids(tr("arm"), drawn_arm(robot)["looks"]["checked"], at_zero, BODY, ways=ways)]
    if scene:
        solids.append(Solids(own_title(scene.title), drawn_scene(scene.solids, robot), np.eye(4)[None], SCENE_COLOUR))
    return solids


AZIMUTH_DEG, ELEVATION_DEG = -52.0, 15.0  # from where a figure is seen at first
FILLED = 0.315  # of the distance that holds the box's diagonal


def turning_figure(
    layers: Sequence[Layer],
    solids: Sequence[Solids],
    cut_m: float,
    floor_m: float,
) -> Markup:
    """The figure as HTML, one a page, whose head holds ``drawing_head``.

    Parameters
    ----------
    layers, solids : what is seen
    cut_m : y of the plane that cuts layers open at first, m
    floor_m : height of the grid, m
    """
    points = np.concatenate([layer.points_mm for layer in layers])
    low, high = points.min(axis=0), points.max(axis=0)
    low[2] = min(low[2], 1000 * floor_m)
    low, high = low - 50.0, high + 50.0
    data = {
        "box": [low.tolist(), high.tolist()],
        "azimuth": float(np.radians(AZIMUTH_DEG)),
        "elevation": float(np.radians(ELEVATION_DEG)),
        "filled": FILLED,
        "floor": floor_m,
        "cut": float((1000 * cut_m - low[1]) / (high[1] - low[1])),
        "solids": [{**vars(each), "shapes": list(each.shapes), "poses": each.poses.tolist()} for each in solids],
        "layers": [_layer(layer, low, high) for layer in layers],
    }
    return Markup(
        page_environment(_HERE)
        .get_template("turning.html.j2")
        .render(
            cut=data["cut"],
            data=data,
            still=_still(layers, solids, data),
            script=(_HERE / "turning.js").read_text(encoding="utf-8"),
        )
    )


def _still(layers: Sequence[Layer], solids: Sequence[Solids], data: dict[str, Any]) -> Markup:
    """The figure for a page without WebGL: a body that can be cut is seen through."""
    low, high = np.array(data["box"]) / 1000
    length = FILLED * float(np.linalg.norm(high - low))
    picture = Still((low + high) / 2, length, data["azimuth"], data["elevation"])
    for each in solids:
        picture.solids(each.shapes, each.poses, {})
    for layer in sorted(layers, key=lambda layer: layer.cut):
        points = layer.points_mm / 1000
        if layer.faces is not None:
            picture.surface(points, layer.faces, layer.colour, 0.3 if layer.cut else 1.0)
    return picture.markup()


def _layer(layer: Layer, low: Reals, high: Reals) -> dict[str, Any]:
    places = np.round((layer.points_mm - low) / (high - low) * STEPS)
    packed: dict[str, Any] = {
        "name": layer.name,
        "points": _packed(places, "<u2"),
        "colour": layer.colour,
        "cut": layer.cut,
        "address": layer.address,
    }
    if layer.faces is not None:
        packed["faces"] = _packed(layer.faces, "<u4")
    return packed


def _packed(values: Reals | Integers, kind: str) -> str:
    return base64.b64encode(np.round(values).astype(kind).tobytes()).decode("ascii")
