"""How links look in a URDF: apart from their shapes, where the URDF places them, simplified, through robot files."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from er3a.collision.meshes import simplified
from er3a.collision.shapes import arm_shapes
from er3a.errors import InputError
from er3a.files.robot_library import load_robot
from er3a.files.robot_writer import write_robot
from er3a.formats.urdf import DRAWN_TRIANGLES, export_urdf, import_urdf
from er3a.kinematics.forward import frames
from er3a.pipeline.viewing.drawn import drawn_arm

RADIUS, SIZE = 0.05, (0.1, 0.2, 0.3)
URDF = """<robot name="r"><link name="base"><visual><geometry><mesh filename="lost.stl"/></geometry></visual></link>
<link name="upper"><visual><origin xyz="0.1 0.2 0.3" rpy="0 0.4 0"/><geometry><mesh filename="ball.stl"/></geometry>
</visual><collision><geometry><sphere radius="0.06"/></geometry></collision></link>
<link name="fore"><visual><geometry><box size="0.1 0.2 0.3"/></geometry></visual></link>
<joint name="one" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.4" rpy="0.3 0 0"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="0"/></joint>
<joint name="two" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.5 0 0" rpy="0 0.2 0"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="1" effort="0"/></joint></robot>"""


@pytest.fixture(scope="module")
def imported(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arm")
    trimesh.creation.icosphere(5, RADIUS).export(folder / "ball.stl")  # 20 480 triangles
    (folder / "arm.urdf").write_text(URDF)
    return import_urdf(folder / "arm.urdf")


def surface(robot, link: int) -> trimesh.Trimesh:
    """In the world, all joints at 0."""
    found = next(each for each in robot.visuals if each.link == link)
    T = frames(robot, np.zeros(robot.joints))[link - 1]
    return trimesh.Trimesh(found.points @ T[:3, :3].T + T[:3, 3], found.faces)


@pytest.mark.long
def test_links_look_as_their_urdf_says_and_are_checked_by_other_shapes(imported):
    robot = imported.robot
    assert [each.link for each in robot.visuals] == [1, 2]
    c, s = np.cos(0.3), np.sin(0.3)
    ball, box = surface(robot, 1), surface(robot, 2)
    assert ball.center_mass == pytest.approx([0.1, 0.2 * c - 0.3 * s, 0.4 + 0.2 * s + 0.3 * c], abs=1e-4)
    assert len(ball.faces) <= DRAWN_TRIANGLES // 2
    assert np.linalg.norm(ball.vertices - ball.center_mass, axis=1) == pytest.approx(RADIUS, abs=3e-4)
    assert ball.volume == pytest.approx(4 / 3 * np.pi * RADIUS**3, rel=0.01)
    assert box.volume == pytest.approx(np.prod(SIZE))
    assert [each.radius for each in robot.envelopes] == [0.06]
    (only,) = robot.meshes  # the second link has no collision shape: it is checked as it looks
    assert (only.link, robot.sources["envelopes"].grade) == (2, "inferred")
    np.testing.assert_array_equal(only.points, robot.visuals[1].points)
    assert any("base" in note and "lost.stl is no file of a mesh" in note for note in imported.notes)


@pytest.mark.long
def test_triangles_that_stand_twice_front_and_back_are_simplified_too():
    ball = trimesh.creation.icosphere(4, RADIUS)
    corners = np.array(ball.vertices)
    points, faces = simplified(corners, np.concatenate([ball.faces, ball.faces[:, ::-1]]), 500)
    once_points, once = simplified(corners, np.array(ball.faces), 500)
    assert len(faces) <= 500
    assert np.array_equal(faces, once)
    assert np.array_equal(points, once_points)


@pytest.mark.long
def test_looks_come_back_from_a_robot_file_and_change_no_robot(imported, tmp_path):
    write_robot(imported.robot.replace(name="arm"), tmp_path / "arm.yaml")
    again = load_robot(tmp_path / "arm.yaml")
    for one, other in zip(imported.robot.visuals, again.visuals, strict=True):
        assert np.array_equal(one.points, other.points)
        assert np.array_equal(one.faces, other.faces)
    (tmp_path / "out.urdf").write_text(export_urdf(imported.robot, tmp_path / "meshes"))
    exported = import_urdf(tmp_path / "out.urdf").robot
    for link in (1, 2):
        assert surface(exported, link).volume == pytest.approx(surface(imported.robot, link).volume)
        assert np.allclose(surface(exported, link).bounds, surface(imported.robot, link).bounds, atol=1e-6)
    assert again == again.replace(visuals=())
    assert hash(again) == hash(again.replace(visuals=()))


@pytest.mark.long
def test_pages_get_the_looks_beside_all_shapes_that_are_checked(imported):
    looks = drawn_arm(imported.robot)["looks"]
    assert [each["frame"] for each in looks["visual"] if each["kind"] == "mesh"] == [1, 2]
    (sphere,) = (each for each in looks["checked"] if each["kind"] == "capsule" and each["frame"] == 1)
    assert sphere["radius"] == pytest.approx(0.06)
    assert "visual" not in drawn_arm(imported.robot.replace(visuals=()))["looks"]


def test_a_damaged_surface_is_one_clear_error(imported, tmp_path):
    write_robot(imported.robot.replace(name="arm"), tmp_path / "arm.yaml")
    own = next((tmp_path / "meshes").glob("link_1_*.stl"))
    own.write_bytes(own.read_bytes()[:-1])
    with pytest.raises(InputError, match=rf"{own.name}: was changed"):
        load_robot(tmp_path / "arm.yaml")
    own.unlink()
    with pytest.raises(InputError, match=rf"{own.name}: can't be read"):
        load_robot(tmp_path / "arm.yaml")


@pytest.mark.parametrize("height", ["0.4", "0"])  # of joint one: as of a SCARA, whose table has no length for the base
def test_a_base_whose_mesh_is_missing_leaves_other_links_the_shapes_that_the_file_gives(tmp_path, height):
    text = URDF.replace('"0 0 0.4"', f'"0 0 {height}"').replace("visual", "collision")
    text = text.replace('<collision><geometry><sphere radius="0.06"/></geometry></collision>', "")
    text = text.replace('<mesh filename="ball.stl"/>', '<box size="0.1 0.2 0.3"/>')
    (tmp_path / "arm.urdf").write_text(text)
    imported = import_urdf(tmp_path / "arm.urdf")
    assert imported.robot.sources["envelopes"].grade == "export"
    assert [link for link, _ in arm_shapes(imported.robot).uncovered] == [0]
    assert sum("lost.stl" in note for note in imported.notes) == 1
    drawn = text.replace("</link>", "<visual><geometry><mesh filename='lost.stl'/></geometry></visual></link>", 1)
    (tmp_path / "arm.urdf").write_text(drawn)
    assert sum("lost.stl" in note for note in import_urdf(tmp_path / "arm.urdf").notes) == 1
