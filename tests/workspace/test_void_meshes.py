"""Surfaces of voids: closed and of the volume that they are of."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.geometry.vectors import TURN
from er3a.workspace.voids import Blocks, mesh

AROUND = 36


def volume(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """Within a closed surface turned outwards, every edge of which two triangles share, one each way."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    assert sorted(map(tuple, edges.tolist())) == sorted(map(tuple, edges[:, ::-1].tolist()))
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def blocks(shape: tuple[int, int], bar: float = 0.0) -> Blocks:
    """Blocks of 10 mm from axis 1 on."""
    rho, z = (0.01 * np.arange(count + 1) for count in shape)
    none = np.zeros((*shape, AROUND))
    return Blocks(rho, z, np.linspace(0, TURN, AROUND + 1), none, none, bar)


@pytest.mark.parametrize("inner", [0, 2])
def test_a_ring_s_mesh_is_closed_and_has_the_volume_of_its_prism(inner):
    mask = np.zeros((5, 4, AROUND), dtype=bool)
    mask[inner:4, 1:3] = True
    vertices, triangles = mesh(blocks((5, 4)), mask)
    area = AROUND / 2 * np.sin(TURN / AROUND) * (0.04**2 - (0.01 * inner) ** 2)  # of a regular polygon less another
    assert volume(vertices, triangles) == pytest.approx(0.02 * area, rel=1e-9)


def test_a_sector_s_mesh_and_a_bar_s_are_closed():
    mask = np.zeros((5, 4, AROUND), dtype=bool)
    mask[0:3, 1:3, 5:14] = True
    sector = AROUND / 2 * np.sin(TURN / AROUND) * 0.03**2 * 9 / AROUND
    assert volume(*mesh(blocks((5, 4)), mask)) == pytest.approx(0.02 * sector, rel=1e-9)
    assert volume(*mesh(blocks((5, 4), bar=0.36), mask)) == pytest.approx(0.02 * 0.03 * 0.09, rel=1e-9)
