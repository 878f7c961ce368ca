"""Mesh files: of scenes and of links, and every way to bring a bad one."""

from __future__ import annotations

import re
import struct
import subprocess
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

from er3a.collision.along import clearance
from er3a.collision.bodies import Bodies
from er3a.collision.convex import cylinder_points
from er3a.collision.matrix import collision_matrix
from er3a.collision.scene import Box, Scene
from er3a.collision.shapes import depths_in
from er3a.errors import InputError
from er3a.files.robot_library import ROBOTS, load_robot
from er3a.files.scene_file import load_scene
from er3a.formats.mesh_file import read_mesh
from er3a.formats.urdf import import_urdf
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.robots.robot import ConvexPiece, PairRule
from testing.arms import made_of


def angle_iron() -> trimesh.Trimesh:
    """Two plates at a right angle, closed, not convex; 200 mm, in mm."""
    outline = np.array([[0, 0], [200, 0], [200, 20], [20, 20], [20, 200], [0, 200]], float)
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    side = [[k, (k + 1) % 6, (k + 1) % 6 + 6] for k in range(6)] + [[k, (k + 1) % 6 + 6, k + 6] for k in range(6)]
    vertices = np.concatenate([np.c_[outline, np.zeros(6)], np.c_[outline, np.full(6, 100.0)]])
    return trimesh.Trimesh(vertices, np.concatenate([faces[:, ::-1], faces + 6, side]), process=False)


@pytest.mark.filterwarnings("ignore:Setting the shape:DeprecationWarning")  # of the library that writes DAE
@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "dae", "glb"])
def test_formats_give_the_same_mesh(tmp_path, suffix):
    mesh = angle_iron()
    assert mesh.is_watertight
    mesh.export(tmp_path / f"iron.{suffix}")
    found = read_mesh(tmp_path / f"iron.{suffix}", "mm")
    np.testing.assert_allclose(np.ptp(found[0], axis=0), [0.2, 0.2, 0.1], atol=1e-6)
    assert len(found[1]) == 20


@pytest.mark.long
def test_a_mesh_whose_triangles_are_turned_is_read_without_what_only_developers_have(tmp_path):
    mesh = angle_iron()
    mesh.faces[::3] = mesh.faces[::3, ::-1]
    mesh.export(tmp_path / "iron.stl")
    locked = Path("requirements/run.txt").read_text(encoding="utf-8")
    ours = {"er3a", *re.findall(r"^([\w.-]+)==", locked, re.MULTILINE)}
    owners = {
        name: {owner.lower().replace("_", "-") for owner in own} for name, own in packages_distributions().items()
    }
    absent = [name for name, own in owners.items() if not own & ours]
    code = f"import sys; sys.modules |= dict.fromkeys({absent!r}); from er3a.formats.mesh_file import read_mesh"
    code += "; from pathlib import Path; print(len(read_mesh(Path(sys.argv[1]), 'mm')[1]))"
    done = subprocess.run([sys.executable, "-c", code, tmp_path / "iron.stl"], capture_output=True, text=True)
    assert done.stdout == "20\n", done.stderr


def scene_of(folder: Path, **keys: object) -> Scene:
    (folder / "scene.yaml").write_text(yaml.safe_dump({"kind": "scene", "title": "made", **keys}), encoding="utf-8")
    return load_scene(folder / "scene.yaml")


def placed(**keys: object) -> list[dict[str, object]]:
    """An angle iron under the arm's forearm, turned, as an obstacle of a scene."""
    return [
        {"name": "iron", "xyz_mm": [480, -80, 500], "rpy_deg": [20, -35, 50], "mesh": "iron.ply", "unit": "mm", **keys}
    ]


@pytest.fixture
def arm_and_poses(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    angle_iron().export(tmp_path / "iron.ply")
    robot = load_robot("er3_600")
    return robot, np.random.default_rng(7).uniform(robot.lower, robot.upper, (400, 6))


def test_a_mesh_of_a_scene_is_checked_by_its_triangles(tmp_path, arm_and_poses):
    """The forearm's capsules against the solid of the angle iron: two boxes, which share an edge."""
    robot, q = arm_and_poses
    found = clearance(robot, q, scene_of(tmp_path, meshes=placed())).distance
    T = transform(np.array([480, -80, 500]) / 1000, np.radians([20, -35, 50]))
    plates = [
        Box(f"{k}", T @ transform(np.array(m), np.zeros(3)), np.array(size)) for k, (m, size) in enumerate(PLATES)
    ]
    expected = clearance(robot, q, Scene("made", tuple(plates))).distance
    assert ((found < 0) == (expected < 0)).all()
    assert (expected < 0).sum() > 10
    np.testing.assert_allclose(found[expected > 0], expected[expected > 0], atol=1e-7)


PLATES = [((0.1, 0.01, 0.05), (0.2, 0.02, 0.1)), ((0.01, 0.1, 0.05), (0.02, 0.2, 0.1))]


def test_what_is_inside_a_closed_mesh_is_in_collision_and_what_is_carried_moves_with_the_tool(tmp_path, arm_and_poses):
    robot, q = arm_and_poses
    trimesh.creation.torus(2.0, 1.9, 64, 32).export("ring.glb")
    ring = {"name": "ring", "xyz_mm": [2000, 0, 400], "mesh": "ring.glb", "unit": "m"}
    around = Bodies(robot, scene_of(tmp_path, meshes=[ring]))
    assert around.overlaps(q).any(axis=1).all()
    (depth,) = depths_in(around.scene.solids[0], np.array([[0.0, 0.0, 0.4]]))
    assert 1.85 < depth <= 1.9

    carried = {"name": "iron", "xyz_mm": [0, 0, 100], "mesh": "iron.ply", "unit": "mm"}
    floor = {"name": "floor", "normal": [0, 0, 1], "offset_mm": 0}
    scene = scene_of(tmp_path, planes=[floor], carried={"meshes": [carried]})
    bodies = Bodies(robot, scene)
    pair = next(
        k
        for k, each in enumerate(bodies.pairs)
        if getattr(each, "carried", "") == "iron" and each.code == "carried_and_solid"
    )
    for joints in q[:50]:
        corners = np.array(angle_iron().vertices) / 1000 + [0, 0, 0.1]
        T = forward(robot, joints)
        lowest = (corners @ T[:3, :3].T + T[:3, 3])[:, 2].min()
        assert bodies.distances(joints, np.array([pair]))[0] == pytest.approx(lowest, abs=1e-7)


@pytest.mark.usefixtures("arm_and_poses")
def test_a_robot_takes_meshes_from_files_and_a_scene_no_unknown_keys(tmp_path):
    content = yaml.safe_load((ROBOTS / "er3_600.yaml").read_text(encoding="utf-8")) | {"name": "arm"}
    content["envelopes"]["meshes"] = [{"link": 6, "mesh": "iron.ply", "unit": "mm", "xyz_mm": [0, 0, 128.5]}]
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    arm = load_robot(tmp_path / "arm.yaml")
    np.testing.assert_allclose(np.ptp(arm.meshes[0].points, axis=0), [0.2, 0.2, 0.1], atol=1e-6)
    assert all(pair.first != pair.second for pair in Bodies(arm, None).pairs)  # a gripper's own bodies are one link's

    with pytest.raises(InputError) as caught:
        scene_of(tmp_path, meshes=[{"name": "iron", "xyz_mm": [0, 0, 0], "pieces": "iron.json"}])
    assert caught.value.field == "meshes[0].pieces"


def write_stl_head(path, triangles: int) -> None:
    with path.open("wb") as file:
        file.write(b"\0" * 80 + struct.pack("<I", triangles))
        file.truncate(84 + 50 * triangles)


BAD = {
    "in metres": ("can only be metres", "unit: m"),
    "ten million triangles": ("larger than 200 MB", "Simplify"),
    "no format": ("is not a mesh format", "Save it as"),
    "empty": ("holds no triangles", "as triangles"),
    "nowhere": ("there is no such file", "Check"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_mesh_is_refused_in_one_line(case, tmp_path):
    path = tmp_path / "mesh.stl"
    mesh = trimesh.creation.box((100.0, 100.0, 100.0))
    match case:
        case "in metres":
            mesh.apply_scale(1e-3)
            mesh.export(path)
        case "ten million triangles":
            write_stl_head(path, 10_000_000)
        case "no format":
            path = tmp_path / "mesh.step"
            path.write_text("x", encoding="utf-8")
        case "empty":
            path.write_bytes(b"")
    with pytest.raises(InputError) as caught:
        read_mesh(path, "mm")
    for words in BAD[case]:
        assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_collision_geometry_of_a_urdf_is_taken_over(tmp_path):
    """Boxes, cylinders, spheres and meshes where the URDF has them: distances are those of its own geometry."""
    from er3a.formats.urdf import export_urdf

    robot = load_robot("er3_600")
    trimesh.creation.icosphere(radius=0.05).export(tmp_path / "ball.stl")
    text = export_urdf(robot.replace(envelopes=()))
    shapes = {
        "link_2": '<origin xyz="0.1 0 0" rpy="0 0 0.3"/><geometry><box size="0.2 0.1 0.1"/></geometry>',
        "link_4": '<origin xyz="0 0 0.1"/><geometry><cylinder radius="0.04" length="0.2"/></geometry>',
        "link_6": '<geometry><mesh filename="ball.stl"/></geometry>',
        "tool": '<geometry><sphere radius="0.03"/></geometry>',
        "base": '<geometry><mesh filename="package://nowhere/base.stl"/></geometry>',
    }
    for name, inside in shapes.items():
        text = text.replace(f'<link name="{name}" />', f'<link name="{name}"><collision>{inside}</collision></link>')
    (tmp_path / "arm.urdf").write_text(text, encoding="utf-8")
    found = import_urdf(tmp_path / "arm.urdf")
    assert sorted(hull.link for hull in found.robot.hulls) == [2, 4]
    assert [mesh.link for mesh in found.robot.meshes] == [6]
    (ball,) = found.robot.envelopes
    assert (ball.link, ball.radius) == (6, 0.03)
    assert any("base.stl is no file" in note for note in found.notes)
    box = next(np.array(hull.points) for hull in found.robot.hulls if hull.link == 2)
    assert np.ptp(box, axis=0).max() < 0.26
    np.testing.assert_allclose(np.linalg.norm(box.mean(axis=0)), 0.1, atol=1e-9)  # 100 mm from axis 2's origin


def test_hulls_without_margin_that_overlap_are_found_by_every_search():
    """A pole that turns about the middle of a box on a slide: its first corner is always inside the box."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    box = ConvexPiece(1, tuple(map(tuple, (0.25 * corners).tolist())), 0.0)
    pole = ConvexPiece(2, tuple(map(tuple, (corners * [0.02, 0.5, 0.02] + [0, 0.5, 0]).tolist())), 0.0)
    rule = PairRule("link_1", "link_2", "watch", "else the two are neighbours, and their joint is left out")
    robot = made_of([("P", 0, 90, 0, -1000, 1000), ("R", 0, 0, 0, -180, 180)])
    robot = robot.replace(hulls=(box, pole), pair_rules=(rule,))
    bodies = Bodies(robot, None)
    q = np.random.default_rng(4).uniform(robot.lower, robot.upper, (50, 2))
    assert bodies.overlaps(q).all()
    assert not bodies.free(q).any()
    assert (bodies.min_distance(q)[0] < 0).all()
    assert [row.state for row in bodies.matrix] == ["watched"]
    assert [row.state for row in collision_matrix(robot.replace(pair_rules=())).rows] == ["joined"]


def test_faces_that_nearly_touch_are_as_far_apart_as_they_are():
    """Two plates of many corners, 2 um apart, that turn face to face: rounding makes simplices of them flat."""
    random = np.random.default_rng(0)
    rule = PairRule("base", "link_1", "watch", "else the two are neighbours, and their joint is left out")
    for _ in range(20):
        angle = np.sort(random.uniform(-np.pi, np.pi, 30))
        rim = random.uniform(0.1, 0.2, 30)[:, None] * np.c_[np.cos(angle), np.sin(angle)]
        plates = [
            ConvexPiece(link, tuple((x, y, z) for z in heights for x, y in rim.tolist()), 0.0)
            for link, heights in ((0, (-0.3, 0.0)), (1, (2e-6, 0.6)))
        ]
        base = transform(random.normal(size=3), random.uniform(-np.pi, np.pi, 3))
        robot = made_of([("R", 0, 0, 0, -180, 180)]).replace(hulls=tuple(plates), pair_rules=(rule,), base=base)
        distance = Bodies(robot, None).min_distance(random.uniform(-np.pi, np.pi, (200, 1)))[0]
        assert (distance <= 2e-6 + 1e-9).all()
        assert (distance > -1e-9).all()


@pytest.mark.parametrize("radius", [1e-5, 0.002, 0.03, 0.15, 2.0])
def test_a_prism_around_a_cylinder_is_nowhere_more_than_a_twentieth_of_a_mm_too_wide(radius):
    points = cylinder_points(np.array([[0, 0, -0.1], [0, 0, 0.1]]), radius)
    corners = points[points[:, 2] > 0, :2]
    middles = (corners + np.roll(corners, 1, axis=0)) / 2
    assert np.linalg.norm(corners, axis=1).max() <= radius + 5e-5 + 1e-12
    assert np.linalg.norm(middles, axis=1) == pytest.approx(radius, rel=1e-9)
