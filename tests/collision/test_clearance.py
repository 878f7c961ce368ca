"""Distances of capsules from solids and from one another, against plain geometry."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from er3a.collision.along import clearance
from er3a.collision.bodies import Bodies
from er3a.collision.scene import Scene
from er3a.collision.shapes import arm_bodies, arm_shapes, default_envelopes, link_frames
from er3a.dynamics.arm_model import estimated_links
from er3a.errors import InputError, InputWarning
from er3a.files.robot_library import ROBOTS, load_robot
from er3a.files.robot_writer import write_robot
from er3a.files.scene_file import SceneFile, load_scene
from er3a.finding import fact, is_one
from er3a.kinematics.forward import forward
from er3a.robots.robot import ConvexPiece, Envelope
from testing.arms import joints_at_random, placement


def scene_of(**shapes) -> Scene:
    return SceneFile.model_validate({"kind": "scene", "title": "made"} | shapes).scene()


def segment_distances(ends: np.ndarray, points) -> float:
    """Distance of lines sampled finely from a function of points."""
    t = np.linspace(0, 1, 2001)[:, None]
    return min(points(start + t * (end - start)).min() for start, end in ends)


def capsule_poses(robot, capsules, q) -> np.ndarray:
    """End points (..., n, 2, 3) of the capsules' lines, m, at joint values (..., n)."""
    T = link_frames(robot, q)[..., [each.link for each in capsules], :, :]
    ends = np.array([(each.start, each.end) for each in capsules])
    return np.einsum("...nij,nkj->...nki", T[..., :3, :3], ends) + T[..., None, :3, 3]


def test_capsules_follow_the_arm(robot, random):
    capsules = default_envelopes(robot)
    for q in joints_at_random(robot, random, 5):
        ends = capsule_poses(robot, capsules, q)
        np.testing.assert_allclose(ends[-1, 1], forward(robot, q)[:3, 3], atol=1e-12)
        np.testing.assert_allclose(ends[0, 0], robot.base[:3, 3], atol=1e-12)
    assert [c.link for c in capsules] == sorted(c.link for c in capsules)
    assert all(0.02 < c.radius < 0.1 for c in capsules)


def test_distances_from_solids_are_those_of_geometry(robot, random):
    q = joints_at_random(robot, random, 20)
    capsules = [c for c in arm_shapes(robot).capsules if c.link > 0]
    solids = {
        "spheres": ({"name": "ball", "xyz_mm": [2500, 0, 500], "radius_mm": 100}, None),
        "planes": ({"name": "floor", "normal": [0, 0, 2], "offset_mm": -6000}, None),
        "boxes": ({"name": "box", "xyz_mm": [2600, 0, 0], "size_mm": [400, 8000, 8000]}, None),
        "cylinders": ({"name": "post", "xyz_mm": [0, 2500, 0], "radius_mm": 50, "length_mm": 9000}, None),
    }
    exact = {
        "spheres": lambda p: np.linalg.norm(p - [2.5, 0, 0.5], axis=1) - 0.1,
        "planes": lambda p: p[:, 2] + 3.0,
        "boxes": lambda p: 2.4 - p[:, 0],
        "cylinders": lambda p: np.hypot(p[:, 0], p[:, 1] - 2.5) - 0.05,
    }
    for kind, (solid, _) in solids.items():
        clear = clearance(robot.replace(envelopes=tuple(capsules)), q, scene_of(**{kind: [solid]}))
        for row, distance, pair in zip(q, clear.distance, clear.pair):
            ends = capsule_poses(robot, tuple(capsules), row)
            least = min(
                segment_distances(line[None], exact[kind]) - capsule.radius for line, capsule in zip(ends, capsules)
            )
            if is_one(pair, "link_and_solid"):
                assert distance == pytest.approx(least, abs=1e-4)
            else:
                assert distance <= least + 1e-4


def test_overlap_is_negative_and_named(robot):
    wall = scene_of(planes=[{"name": "ceiling", "normal": [0, 0, -1], "offset_mm": 0}])
    clear = clearance(robot, np.zeros((1, 6)), wall)
    assert clear.distance[0] < 0
    assert clear.pair[0].solid == "ceiling"


def test_base_of_the_arm_turns_the_obstacles_away(random):
    arm = load_robot("er3_600")
    q = joints_at_random(arm, random, 5)
    moved = arm.replace(base=placement([1.0, 2.0, 0.5], [0, 0, 0.7]))
    ball = scene_of(spheres=[{"name": "ball", "xyz_mm": [1000, 2000, 2500], "radius_mm": 100}])
    here = scene_of(spheres=[{"name": "ball", "xyz_mm": [0, 0, 2000], "radius_mm": 100}])
    np.testing.assert_allclose(clearance(moved, q, ball).distance, clearance(arm, q, here).distance, atol=1e-6)


def test_arm_that_reaches_into_its_base_collides_with_itself(random):
    arm = load_robot("er3a_c60")
    q = joints_at_random(arm, random, 400)
    clear = clearance(arm, q, None)
    assert (clear.distance < 0).any()
    assert fact("link_pair", first=0, second=6) in clear.pair


def test_scene_file_is_used_as_written():
    arm = load_robot("er3_600")
    clear = clearance(arm, np.zeros((1, 6)), load_scene("data/scenes/table_and_post.yaml"))
    assert 0 < clear.distance[0] < 1


def test_envelopes_of_the_file_replace_the_default(tmp_path):
    capsule = Envelope(6, (0.0, 0.0, 0.0), (0.0, 0.0, 0.3), 0.02)
    arm = load_robot("er3_600").replace(name="arm", envelopes=(capsule,))
    write_robot(arm, tmp_path / "arm.yaml")
    again = load_robot(tmp_path / "arm.yaml")
    assert again.envelopes == (capsule,)
    assert arm_shapes(again).capsules == (capsule,)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"link": 7}, "envelopes.capsules[0].link"),
        ({"radius_mm": 0.05}, "envelopes.capsules[0].radius_mm"),
        ({"colour": 1}, "envelopes.capsules[0].colour"),
    ],
)
def test_bad_envelopes_are_refused(tmp_path, change, field):
    with pytest.raises(InputError) as caught:
        with_capsule(tmp_path, change)
    assert caught.value.field == field


def test_capsules_that_look_like_metres_are_a_warning(tmp_path):
    with pytest.warns(InputWarning, match=r"envelopes.capsules\[0\].to_mm: .* may be metres"):
        with_capsule(tmp_path, {"to_mm": [0, 0, 0.3]})


def with_capsule(tmp_path, change):
    content = yaml.safe_load((ROBOTS / "er3_600.yaml").read_text(encoding="utf-8"))
    capsule = {"link": 6, "from_mm": [0.0, 0.0, 0.0], "to_mm": [0.0, 0.0, 300.0], "radius_mm": 20.0} | change
    content |= {"name": "arm", "envelopes": {"source": "x", "grade": "inferred", "capsules": [capsule]}}
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    return load_robot(tmp_path / "arm.yaml")


@pytest.mark.long
def test_turns_of_an_arm_are_measured_once(random, monkeypatch):
    arm = load_robot("ur5e")
    bodies, q = Bodies(arm, None), joints_at_random(arm, random, 30)
    turned = np.concatenate([q, q + 2 * np.pi * random.integers(-1, 2, q.shape)])
    each, measured = bodies.min_distance(turned), []
    monkeypatch.setattr(
        bodies, "min_distance", lambda rows: measured.append(len(rows)) or Bodies.min_distance(bodies, rows)
    )
    once = bodies.min_distance_of_turns(turned)
    np.testing.assert_allclose(once[0], each[0], atol=1e-9)
    np.testing.assert_array_equal(once[1], each[1])
    assert measured == [30]


def test_hulls_of_the_file_are_all_shapes_that_an_arm_has():
    """What import-urdf writes for meshes: no guessed capsule beside them; links without a shape are named."""
    corners = tuple((x, y, z) for x in (-0.03, 0.03) for y in (-0.03, 0.03) for z in (0.0, 0.2))
    plain = load_robot("er3_600")
    arm = plain.replace(envelopes=(), hulls=(ConvexPiece(0, corners, 0.0), ConvexPiece(2, corners, 0.001)))
    shapes = arm_shapes(arm)
    assert (shapes.capsules, shapes.pieces, shapes.given, shapes.bare) == ((), arm.hulls, True, (1, 3, 4, 5, 6))
    assert [(body.link, len(body.points)) for body in arm_bodies(arm)] == [(0, 8), (2, 8)]
    assert [each.link for each in estimated_links(arm, 2700.0)] == [0, 2]
    guessed = arm_shapes(plain.replace(envelopes=()))
    assert (guessed.given, guessed.grade) == (False, "inferred")
    assert guessed.capsules == default_envelopes(plain)
