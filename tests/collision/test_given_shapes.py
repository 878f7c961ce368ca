"""Shapes that a URDF gives, against its own meshes as Pinocchio reads them and Coal measures them."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

from er3a.collision.shapes import arm_shapes
from er3a.formats.urdf import import_urdf
from testing.mesh_peers import held_against_meshes

pytestmark = pytest.mark.long

SHARED = Path(str(find_spec("pinocchio").origin)).parents[4] / "share" / "example-robot-data" / "robots"
XACRO = Path(str(find_spec("rtbdata").origin)).parent / "xacro"
ARMS = {
    "ur5": (SHARED / "ur_description/urdf/ur5_robot.urdf", 0.1),
    "panda": (SHARED / "panda_description/urdf/panda.urdf", 0.5),
    "irb140": (XACRO / "abb_irb140_description/urdf/irb140.urdf", 0.3),
}
POSES = 30


@pytest.mark.parametrize("name", ARMS)
def test_what_is_said_of_shapes_holds_of_the_meshes(name):
    """Never meet, always overlap, clearance as a lower bound; and an arm by its maker moves without hitting itself."""
    path, least_free = ARMS[name]
    imported = import_urdf(path, snap=True)
    found = held_against_meshes(path, imported, POSES, 5)
    assert arm_shapes(imported.robot).given
    assert found.wrong == []
    assert found.errors_apart == found.errors_crossing == []
    assert found.free > least_free
