"""Shapes that a URDF gives, against its own meshes as Pinocchio reads them and Coal measures them."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest

from er3a.collision.shapes import arm_shapes
from er3a.formats.urdf import UrdfImport, import_urdf
from testing.mesh_peers import HeldAgainstMeshes, held_against_meshes

SHARED = Path(str(find_spec("pinocchio").origin)).parents[4] / "share" / "example-robot-data" / "robots"
XACRO = Path(str(find_spec("rtbdata").origin)).parent / "xacro"
ARMS = {
    "ur5": (SHARED / "ur_description/urdf/ur5_robot.urdf", 0.1),
    "panda": (SHARED / "panda_description/urdf/panda.urdf", 0.5),
    "z1": (SHARED / "z1_description/urdf/z1.urdf", 0.5),
    "irb140": (XACRO / "abb_irb140_description/urdf/irb140.urdf", 0.3),
    "kr210": (XACRO / "kuka_description/kuka_kr210/urdf/kr210l150.urdf", 0.3),
    "iiwa": (XACRO / "kuka_description/kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820.urdf", 0.5),
}
POSES = 200


@cache
def held(name: str) -> HeldAgainstMeshes:
    return held_against_meshes(ARMS[name][0], imported(name), POSES, 5)


@cache
def imported(name: str) -> UrdfImport:
    return import_urdf(ARMS[name][0], snap=True)


@pytest.mark.long
@pytest.mark.parametrize("name", ARMS)
def test_what_is_said_of_shapes_holds_of_the_meshes(name):
    """Never meet, always overlap, clearance as a lower bound; and an arm by its maker moves without hitting itself."""
    found = held(name)
    assert arm_shapes(imported(name).robot).given
    assert found.wrong == []
    assert found.errors_apart == found.errors_crossing == []
    assert found.free > ARMS[name][1]
