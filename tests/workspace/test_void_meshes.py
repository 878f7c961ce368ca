"""Surfaces of voids: closed and of the volume that they are of; single changes of a table."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.finding import fact
from er3a.geometry.vectors import TURN
from er3a.workspace.causes import relaxed_limit, single_changes
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


@pytest.mark.long
def test_single_changes_of_the_article_s_table():
    upper_2 = relaxed_limit((2,), (1.0,), "upper", "deg", 155.0, (60.0, 1.0))
    found = single_changes(load_robot("er3a_c60_article"), fact("void_disappears", limits=(upper_2,)), 1)
    left = {
        (f"{change.column}{change.joint}", change.tried): change.left_litres for change in found if change.left_litres
    }
    assert left["offset2", -90.0][1] < 1 < 150 < left["offset2", 180.0][0]
    assert left["upper2", 215.0][1] < 1
    assert {tried for entry, tried in left if entry == "a2"} == {-650.0, 325.0, 1300.0}
    assert not {entry for entry, _ in left} & {"offset1", "offset4", "offset6"}  # they turn the reach into itself
    assert [high for _, high in left.values()] == sorted(high for _, high in left.values())
