"""Scenes in drawings: the outlines of their solids."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.collision.scene import Box, Cylinder, Mesh, Sphere
from er3a.geometry.transforms import transform
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
        widest = 5e-5 if isinstance(solid, Cylinder) else 1e-12  # m, of a prism around a cylinder
        assert sides(outline) == pytest.approx(expected, abs=widest)
