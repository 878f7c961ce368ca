"""Scenes in drawings: the outlines of their solids, and what limits a drawing keeps."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from er3a.collision.scene import Box, Cylinder, Mesh, Plane, Scene, Sphere
from er3a.geometry.transforms import transform
from er3a.pipeline.stages.workspace.page.capability_section import draw_scene
from er3a.pipeline.viewing.drawn import outlines

TURNED = transform(np.array([0.3, -0.2, 0.1]), np.array([0.0, np.pi / 2, 0.0]))  # z along the base frame's x


def sides(outline: np.ndarray) -> list[float]:
    return [*outline.min(axis=0), *outline.max(axis=0)]


@pytest.mark.parametrize(
    ("solid", "above", "beside"),
    [
        (Box("box", TURNED, np.array([0.1, 0.2, 0.4])), (0.1, -0.3, 0.5, -0.1), (0.1, 0.05, 0.5, 0.15)),
        (Cylinder("rod", TURNED, 0.05, 0.4), (0.1, -0.25, 0.5, -0.15), (0.1, 0.05, 0.5, 0.15)),
        (Sphere("ball", TURNED, 0.05), (0.25, -0.25, 0.35, -0.15), (0.25, 0.05, 0.35, 0.15)),
        (Mesh("tip", TURNED, np.eye(3), np.arange(3)[None]), (0.3, -0.2, 1.3, 0.8), (0.3, -0.9, 1.3, 0.1)),
    ],
)
def test_outlines_seen_from_above_and_from_the_side(solid, above, beside):
    for shown, expected in (([0, 1], above), ([0, 2], beside)):
        (outline,) = outlines(solid, shown)
        assert sides(outline) == pytest.approx(expected, abs=1e-12)


def test_what_stands_far_off_widens_no_drawing_and_planes_are_lines_where_seen_edge_on():
    axes = Figure().subplots()
    axes.plot([0, 100], [0, 50])
    before = axes.axis()
    far = Box("far", transform(np.full(3, 9.0), np.zeros(3)), np.ones(3))
    floor = Plane("floor", np.array([0.0, 0.0, 1.0]), -0.2)
    scene = Scene("cell", (far, floor))
    draw_scene(axes, scene, [0, 1])
    assert [type(part).__name__ for part in axes.artists] + [type(part).__name__ for part in axes.patches] == [
        "Polygon"
    ]
    draw_scene(axes, scene, [0, 2])
    assert [line for line in axes.lines if type(line).__name__ == "AxLine"]
    draw_scene(axes, None, [0, 1])
    assert axes.axis() == before
