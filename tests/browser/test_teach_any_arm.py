"""The teach panel's kinematics and distances for arms of any joints, in a real browser, against Python's."""

from __future__ import annotations

from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from er3a.collision.bodies import Bodies
from er3a.collision.convex import TOO_WIDE
from er3a.collision.scene import Mesh, Scene
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.formats.mesh_file import link_mesh
from er3a.kinematics.forward import forward, frames, jacobian
from er3a.kinematics.singularity import TYPES, characteristic_length, conditioning, determinant_factors
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.pipeline.study import load_study
from er3a.pipeline.teach.panel import clearance_data, panel_data, write_teach_page
from er3a.robots.robot import CombinedLimit, Robot
from testing.arms import five_axis, gantry, joints_at_random, made_of, make_arm, palletiser, pose_errors, scara
from testing.small_study import ROOT
from testing.teach_kinematics import NEAR

pytestmark = pytest.mark.long

AGREE = 1e-9
POSES = 60
LONG = [("R", 100, 90 * (k % 2 * 2 - 1), 150, -170, 170) for k in range(10)]
COUPLED = np.eye(6)
COUPLED[2, 1] = 1.0
ARMS = {
    "scara": scara,
    "gantry": gantry,
    "palletiser": palletiser,
    "five_axis": five_axis,
    "one_joint": lambda: made_of([("R", 300, 0, 100, -90, 90)]),
    "ten_joints": lambda: made_of(LONG),
    "on_a_rail": lambda: made_of([("P", 0, -90, 0, 0, 2000), *LONG[:6]]),
    "modified": lambda: scara().replace(convention="modified"),
    "ur5e": lambda: load_robot("ur5e"),
    "coupled": lambda: load_robot("er3_600").replace(coupling=COUPLED),
    "iiwa": lambda: load_robot("lbr_iiwa_14"),
}
FORWARD = """
const [panel, joints, done] = arguments;
import("er3a/kinematics").then(({ conditioning, constantLinks, determinantFactors, frames, jacobian }) => {
  const { table, characteristic_length: length, singular_sets: sets } = panel;
  const links = constantLinks(table);
  done(joints.map((q) => {
    const T = frames(table, links, q);
    const factors = sets && determinantFactors(T, sets);
    return { T, J: jacobian(table, T), measures: conditioning(table, T, length), factors };
  }));
}).catch((error) => done(String(error.stack)));
"""
REACH = """
const [panel, pairs, starts, done] = arguments;
Promise.all([import("er3a/kinematics"), import("er3a/goal")]).then(([{ constantLinks }, { goalOf, jointsFor }]) => {
  const goal = goalOf(panel, constantLinks(panel.table));
  done({ rank: goal.rank, found: pairs.map(([q, T]) => jointsFor(goal, null, T, q, starts)) });
}).catch((error) => done(String(error.stack)));
"""
DISTANCES = """
const [panel, data, joints, done] = arguments;
Promise.all([import("er3a/kinematics"), import("er3a/clearance")]).then(([kinematics, { nearestPair }]) => {
  const { constantLinks, frames } = kinematics;
  const links = constantLinks(panel.table);
  done(joints.map((q) => {
    const found = nearestPair(data, panel.table.base, frames(panel.table, links, q));
    return found && { ...found, number: data.pairs.indexOf(found.pair) };
  }));
}).catch((error) => done(String(error.stack)));
"""


@pytest.fixture(scope="module")
def page(browser, tmp_path_factory):
    """The browser on a teach panel, whose modules the tests call."""
    file = tmp_path_factory.mktemp("teach") / "teach.html"
    write_teach_page(load_study("config/small.yaml"), "er3a_c60", Path("nowhere"), file)
    browser.get(file.as_uri())
    browser.set_script_timeout(60)
    return browser


def asked(page, script: str, *arguments):
    found = page.execute_async_script(script, *arguments)
    assert not isinstance(found, str), found
    return found


@pytest.mark.parametrize("name", ARMS)
def test_frames_jacobian_and_measures_are_python_s(page, name, random):
    robot = ARMS[name]()
    q = joints_at_random(robot, random, POSES)
    found = asked(page, FORWARD, panel_data(robot, NEAR), q.tolist())
    np.testing.assert_allclose([one["T"] for one in found], frames(robot, q), atol=AGREE)
    J = np.swapaxes([one["J"] for one in found], 1, 2)
    np.testing.assert_allclose(J, jacobian(robot, q), atol=AGREE)
    expected = conditioning(robot, q, characteristic_length(robot))
    smallest = [one["measures"]["smallestSingularValue"] for one in found]
    assert smallest == pytest.approx(expected.smallest_singular_value, abs=AGREE)
    named = determinant_factors(robot, q) if has_branches(robot) else None
    assert (found[0]["factors"] is None) == (named is None)
    for kind in TYPES if named else ():
        assert [one["factors"][kind] for one in found] == pytest.approx(getattr(named, kind), abs=AGREE)


@pytest.mark.parametrize(
    ("name", "rank"),
    [
        *(("scara", 4), ("gantry", 3), ("palletiser", 4), ("five_axis", 5), ("one_joint", 1), ("ur5e", 6), ("iiwa", 6)),
        *(("on_a_rail", 6), ("ten_joints", 6)),
    ],
)
def test_iteration_finds_joints_for_poses_that_there_are(page, name, rank, random):
    """Poses of random joints from other random joints: Python's forward kinematics say that each is met."""
    robot = ARMS[name]()
    goals, starts = (joints_at_random(robot, random, 30) for _ in range(2))
    T = forward(robot, goals)
    answer = asked(page, REACH, panel_data(robot, NEAR), [list(pair) for pair in zip(starts.tolist(), T.tolist())], 60)
    assert answer["rank"] == rank
    q = np.array([one["q"] for one in answer["found"]])
    assert len(q) == len(goals)
    assert ((q >= robot.lower - AGREE) & (q <= robot.upper + AGREE)).all()
    for errors in pose_errors(forward(robot, q), T):
        assert errors.max() < 1e-8


def tilted(T: np.ndarray, angle: float) -> np.ndarray:
    turn = np.eye(4)
    turn[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return T @ turn


@pytest.mark.parametrize(
    ("name", "q", "least"),
    [("scara", [20, 30, 0, 10], 0.2), ("five_axis", [20, 40, 60, 30, 50], 0.0), ("gantry", [0, 0, 0], 0.2)],
)
def test_an_arm_that_can_t_follow_a_whole_pose_meets_its_position_and_says_what_is_missing(page, name, q, least):
    robot = ARMS[name]()
    q = np.radians(q)
    T = tilted(forward(robot, q), 0.2)
    (found,) = asked(page, REACH, panel_data(robot, NEAR), [[q.tolist(), T.tolist()]], 60)["found"]
    length, angle = (errors.max() for errors in pose_errors(forward(robot, np.array(found["q"])), T))
    assert length < 1e-6
    assert found["left"]["length"] == pytest.approx(length, abs=1e-9)
    assert found["left"]["angle"] == pytest.approx(angle, abs=1e-8)
    assert least - 1e-9 <= angle <= 0.2 + 1e-9


def test_a_five_joint_arm_pitches_from_where_its_roll_is_zero(page):
    """Its tool turns about one of its own axes only there; that must not count as what it can never follow."""
    robot = five_axis()
    q = np.radians([0.0, 40, 60, 30, 0])
    for axis in (0, 1):
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec(0.1 * np.eye(3)[axis]).as_matrix()
        T = forward(robot, q) @ turn
        (found,) = asked(page, REACH, panel_data(robot, NEAR), [[q.tolist(), T.tolist()]], 1)["found"]
        pitched = np.abs(np.array(found["q"]) - q).max() > 0.05
        assert pitched == (found["left"]["angle"] < 1e-8)
        assert found["left"]["length"] < 1e-6
        if pitched:
            return
    pytest.fail("neither axis turned the tool")


def test_what_is_out_of_reach_is_missed_by_no_less_than_the_arm_s_length_says(page):
    robot = scara()
    q = np.radians([20.0, 30, 0, 10])
    far = forward(robot, q)
    far[0, 3] = 2.0
    (found,) = asked(page, REACH, panel_data(robot, NEAR), [[q.tolist(), far.tolist()]], 60)["found"]
    assert "q" not in found
    least = np.hypot(2.0, far[1, 3]) - (0.325 + 0.225)
    assert least - 1e-9 <= found["miss"]["length"] < 1.01 * least


def test_limits_of_sums_of_joints_bind_the_iteration(page):
    robot = make_arm(
        combined=(CombinedLimit((0, 1, 1, 0, 0, 0), -0.5, 0.5),), alpha=np.radians([-90, 5, -90, 90, -90, 0])
    )
    q = np.array([0.1, 0.6, 0.6, 0.2, 0.5, 0.1])
    (found,) = asked(page, REACH, panel_data(robot, NEAR), [[q.tolist(), forward(robot, q).tolist()]], 1)["found"]
    assert found == {"row": {"q": pytest.approx(q.tolist(), abs=1e-6)}}


def some_arms() -> dict[str, Robot]:
    named = {name: load_robot(name) for name in ("er3a_c60", "er3_600", "er3a_c60_article")}
    return named | {name: ARMS[name]() for name in ("ur5e", "iiwa", "scara", "palletiser")}


@pytest.mark.parametrize(
    ("name", "scene"), list(zip(some_arms(), cycle(["table_and_post", "wall_and_low_floor"]), strict=False))
)
def test_the_least_distance_is_python_s(page, name, scene, random):
    robot, around = some_arms()[name], load_scene(ROOT / f"data/scenes/{scene}.yaml")
    q = joints_at_random(robot, random, POSES)
    found = asked(page, DISTANCES, panel_data(robot, NEAR), clearance_data(robot, around), q.tolist())
    bodies = Bodies(robot, around)
    least, _ = bodies.min_distance(q)
    assert not any(one["deep"] for one in found)
    distance = np.array([one["distance"] for one in found])
    rim = 2 * TOO_WIDE  # Python's cylinders overlap as prisms around them
    assert np.abs(distance - least)[least > 0].max() < 1e-8
    assert (distance - least).min() > -1e-6
    assert (distance - least).max() < rim + 1e-6
    for k in np.flatnonzero(least > 1e-3):
        assert bodies.distances(q[k], np.array([found[k]["number"]]))[0] == pytest.approx(least[k], abs=1e-8)
        ends = np.array([found[k]["from"], found[k]["to"]])
        assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(least[k], abs=1e-8)


@pytest.mark.parametrize("scene", [None, "wall_and_low_floor"])
def test_the_panel_measures_the_triangles_of_meshes(page, scene, random):
    robot = load_robot("er3_600")
    tori = [trimesh.creation.torus(0.12, 0.03, 24, 12).apply_transform(random_pose(random)) for _ in range(7)]
    robot = robot.replace(envelopes=(), hulls=(), meshes=tuple(link_mesh(k, t.triangles) for k, t in enumerate(tori)))
    around = load_scene(ROOT / f"data/scenes/{scene}.yaml") if scene else None
    q = joints_at_random(robot, random, POSES)
    found = asked(page, DISTANCES, panel_data(robot, NEAR), clearance_data(robot, around), q.tolist())
    least, _ = Bodies(robot, around).min_distance(q)
    distance = np.array([one["distance"] for one in found])
    assert 0 < (least > 0).mean() < 1
    assert np.array_equal(distance > 0, least > 0)
    assert np.abs(distance - least)[least > 0].max() < 4e-6  # corners are passed on to 1 µm


@pytest.mark.parametrize("name", ["er3a_c60", "iiwa"])
def test_the_panel_measures_the_triangles_of_a_scene(page, name, random):
    """A ring that an arm without triangles reaches through, and one that it carries."""
    robot, ring = some_arms()[name], trimesh.creation.torus(0.3, 0.05, 24, 12)
    T = random_pose(random)
    T[0, 3] += 0.4
    around = Scene(
        "rings", (Mesh("ring", T, ring.vertices, ring.faces),), (Mesh("held", T, ring.vertices / 3, ring.faces),)
    )
    q = joints_at_random(robot, random, POSES)
    found = asked(page, DISTANCES, panel_data(robot, NEAR), clearance_data(robot, around), q.tolist())
    least, _ = Bodies(robot, around).min_distance(q)
    distance = np.array([one["distance"] for one in found])
    assert 0 < (least > 0).mean() < 1
    assert np.array_equal(distance > 0, least > 0)
    assert np.abs(distance - least)[least > 0].max() < 4e-6


def random_pose(random: np.random.Generator) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.random(random_state=random).as_matrix(), random.normal(size=3) * 0.05
    return T
