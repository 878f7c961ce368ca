"""Shapes that a URDF gives, against its own meshes as Pinocchio reads them and Coal measures them."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

from er3a.collision.shapes import arm_shapes
from er3a.formats.urdf import import_urdf
from testing.mesh_peers import held_against_meshes

SHARED = Path(str(find_spec("pinocchio").origin)).parents[4] / "share" / "example-robot-data" / "robots"
XACRO = Path(str(find_spec("rtbdata").origin)).parent / "xacro"
ARMS = {
    "ur5": (SHARED / "ur_description/urdf/ur5_robot.urdf", 0.1),
    "ur10": (SHARED / "ur_description/urdf/ur10_robot.urdf", 0.1),
    "panda": (SHARED / "panda_description/urdf/panda.urdf", 0.5),
    "kinova": (SHARED / "kinova_description/robots/kinova.urdf", 0.5),
    "xarm7": (SHARED / "xarm_description/urdf/xarm7.urdf", 0.5),
    "z1": (SHARED / "z1_description/urdf/z1.urdf", 0.5),
    "so101": (SHARED / "so_arm_description/urdf/so101.urdf", 0.3),
    "irb140": (XACRO / "abb_irb140_description/urdf/irb140.urdf", 0.3),
    "kr16": (XACRO / "kuka_description/kuka_kr16/urdf/kr16_2.urdf", 0.5),
    "kr210": (XACRO / "kuka_description/kuka_kr210/urdf/kr210l150.urdf", 0.3),
    "iiwa": (XACRO / "kuka_description/kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820.urdf", 0.5),
}
POSES = 200
NEAR = 0.005  # m, of meshes whose hulls overlap


@pytest.mark.long
@pytest.mark.parametrize("name", ARMS)
def test_what_is_said_of_shapes_holds_of_the_meshes(name):
    """Never meet, always overlap, clearance as a lower bound; and an arm by its maker moves without hitting itself."""
    path, least_free = ARMS[name]
    imported = import_urdf(path, snap=True)
    assert arm_shapes(imported.robot).given
    found = held_against_meshes(path, imported, POSES, 5)
    assert found.wrong == []
    assert found.errors_apart == found.errors_crossing == []
    assert found.free > least_free
    assert found.folded_apart < NEAR


@pytest.mark.long
def test_a_forearm_that_folds_onto_the_upper_arm_is_seen():
    """Of links that a joint joins only what is near the joint is left out."""
    path, _ = ARMS["ur5"]
    found = held_against_meshes(path, import_urdf(path, snap=True), POSES, 5)
    assert found.folded > 20
