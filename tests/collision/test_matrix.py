"""The allowed collision matrix: what it proves, against dense sampling by Coal; and the known faults of MoveIt's."""

from __future__ import annotations

from itertools import pairwise

import coal
import numpy as np
import pytest
import trimesh

from er3a.collision.along import clearance
from er3a.collision.bodies import Bodies
from er3a.collision.matrix import collision_matrix
from er3a.collision.pairs import label_of
from er3a.collision.scene import Scene
from er3a.collision.shapes import arm_shapes
from er3a.errors import InputError
from er3a.files.robot_library import ROBOTS, load_robot
from er3a.files.robot_writer import write_robot
from er3a.files.scene_file import SceneFile
from er3a.finding import fact
from er3a.kinematics.forward import frames
from er3a.numerics.quasi_random import quasi_random_points
from er3a.pipeline.scope import Open
from er3a.pipeline.stages.covered import covered_collisions
from er3a.robots.robot import ConvexPiece, Envelope, LinkMesh, PairRule, Robot
from testing.arms import OTHERS_LONG, made_of, make_arm

SAMPLES = 500
BENT = ((0.0, 0.0, 0.1), (0.16, 0.0, 0.1), (0.16, 0.0, -0.12))  # m, in the frame of link 6


def bent_tool(robot: Robot) -> Robot:
    """The arm with a tool that leads back over the flange: capsules of 15 mm."""
    tool = tuple(Envelope(6, start, end, 0.015) for start, end in pairwise(BENT))
    return robot.replace(envelopes=(*arm_shapes(robot).capsules, *tool))


def rows_of(robot: Robot):
    return {(row.first, row.second): row for row in collision_matrix(robot).rows}


def link_poses(robot: Robot, q: np.ndarray) -> list[np.ndarray]:
    """Frames of base and links by the table alone: those that turn with each joint (standard D-H)."""
    assert robot.convention == "standard"
    assert (robot.beta == 0).all()
    T = [robot.base]
    before = robot.base
    for k in range(6):
        c, s = np.cos(robot.direction[k] * q[k] + robot.offset[k]), np.sin(robot.direction[k] * q[k] + robot.offset[k])
        turned = before @ [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        T.append(turned)
        ca, sa = np.cos(robot.alpha[k]), np.sin(robot.alpha[k])
        before = turned @ [[1, 0, 0, robot.a[k]], [0, ca, -sa, 0], [0, sa, ca, robot.d[k]], [0, 0, 0, 1]]
    return T


def coal_distance(robot: Robot, q: np.ndarray, first: str, second: str) -> float:
    """Least distance of two links' capsules by Coal."""
    T, least = link_poses(robot, q), np.inf
    placed: dict[str, list] = {first: [], second: []}
    for capsule in arm_shapes(robot).capsules:
        name = f"link_{capsule.link}" if capsule.link else "base"
        if name in placed:
            start, end = (T[capsule.link][:3, :3] @ p + T[capsule.link][:3, 3] for p in (capsule.start, capsule.end))
            along = end - start
            length = np.linalg.norm(along)
            axis = along / length if length else np.array([0.0, 0, 1])
            R = np.linalg.svd(axis[None])[2].T[:, [1, 2, 0]]
            R[:, 2] = axis
            R[:, 0] = np.cross(R[:, 1], R[:, 2])
            placed[name].append((coal.Capsule(capsule.radius, length), coal.Transform3s(R, (start + end) / 2)))
    for one, at in placed[first]:
        for other, there in placed[second]:
            found = coal.distance(one, at, other, there, coal.DistanceRequest(), coal.DistanceResult())
            least = min(least, found)
    return least


@pytest.mark.long
@OTHERS_LONG
def test_every_pair_of_links_stands_in_it_with_what_dense_sampling_finds(robot, random):
    """No pair that is said never to meet does, and witnesses overlap; by Coal on frames worked out apart."""
    robot = bent_tool(robot).replace(pair_rules=())
    rows = rows_of(robot)
    links = sorted({capsule.link for capsule in arm_shapes(robot).capsules})
    assert len(rows) == len(links) * (len(links) - 1) / 2
    watched = {(a.name, b.name) for a, b in collision_matrix(robot).watched}
    q = random.uniform(robot.lower, robot.upper, (SAMPLES, 6))
    for (first, second), row in rows.items():
        distances = np.array([coal_distance(robot, each, first, second) for each in q])
        if row.state == "never":
            assert 0 < row.lower_bound <= distances.min() + 1e-9
        elif row.state == "joined":
            assert distances.max() < 0
        elif row.state == "meets":
            assert coal_distance(robot, row.witness, first, second) < 0
        else:
            assert row.state == "undecided"
            assert (first, second) in watched
            assert 0 < distances.min() < 0.02  # the bounds need more boxes only where it is narrow


@pytest.mark.long
def test_bent_tool_that_enters_the_forearm_is_found():
    """59 mm deep, at J5 of up to 105 deg, where links at most two apart used to be left out."""
    robot = bent_tool(load_robot("er3a_c60"))
    q = np.zeros((43, 6))
    q[:, 4] = np.radians(np.linspace(0, 105, 43))
    clear = clearance(robot, q, None)
    assert clear.distance.min() == pytest.approx(-0.059, abs=1e-3)
    assert clear.pair[int(clear.distance.argmin())] == fact("link_pair", first=4, second=6)
    tool = tuple(c for c in robot.envelopes if c.link == 4 or c.radius == 0.015)
    deepest = min(coal_distance(robot.replace(envelopes=tool), each, "link_4", "link_6") for each in q)
    assert clear.distance.min() == pytest.approx(deepest, abs=1e-6)


def test_forearm_that_folds_onto_the_upper_arm_is_seen():
    robot = load_robot("er3_600")
    row = rows_of(robot)["link_2", "link_4"]
    assert row.state == "joined"
    folded, straight = np.radians([[0, 0, -65, 0, 0, 0], [0, 0, 85, 0, 0, 0]])
    clear = clearance(robot, np.array([folded, straight]), None)
    assert clear.distance[0] < 0 < clear.distance[1]
    assert clear.pair[0] == fact("link_pair", first=2, second=4)


def test_overlap_in_the_region_of_the_joint_is_all_that_is_left_out():
    """Beyond the region of the joint, distances are those of capsules cut there."""
    robot = load_robot("er3_600")
    row = rows_of(robot)["link_2", "link_4"]
    radius = row.left_out
    upper, forearm = (next(c for c in arm_shapes(robot).capsules if c.link == k) for k in (2, 4))
    assert radius == pytest.approx(upper.radius + forearm.radius)
    bodies = Bodies(robot, None)
    cut = {body.link: body.points for pair in collision_matrix(robot).watched for body in pair if body.link in (2, 4)}
    assert len(bodies.pairs) >= 6
    assert np.linalg.norm(cut[2] - upper.end, axis=1).min() <= radius + 1e-9 or np.ptp(cut[2], axis=0).max() > 0.2


class TestFaultsOfOthers:
    """What goes wrong in the setup assistant of MoveIt, by the numbers of its issues."""

    def test_pair_that_collides_at_the_default_pose_stays_watched(self):
        """moveit2#2772: off because it collides in the default state."""
        robot = load_robot("er3a_c60")
        folded = Envelope(6, (0.0, 0.0, -0.3), (0.0, 0.0, -0.2), 0.05)  # lies in the forearm at J5 = 0
        robot = robot.replace(envelopes=(*arm_shapes(robot).capsules, folded))
        assert coal_distance(robot, np.zeros(6), "link_4", "link_6") < 0
        assert clearance(robot, np.zeros((1, 6)), None).distance[0] < 0

    def test_pair_that_always_overlaps_is_proven_so(self):
        """moveit2#2915: "always" missed. Each joint's own two links, whatever the poses drawn."""
        article = load_robot("er3a_c60_article")
        stated = article.replace(envelopes=arm_shapes(article).capsules)
        for robot in (load_robot("er3_600"), load_robot("er3a_c60"), stated):
            rows = rows_of(robot.replace(pair_rules=()))
            assert rows["base", "link_2"].state == rows["link_2", "link_4"].state == "joined"

    def test_matrix_survives_writing_and_reading_of_the_robot(self, tmp_path):
        """moveit#3073: lost on update."""
        rules = (
            PairRule("link_2", "link_4", "allow", "seen on the real arm"),
            PairRule("base", "link_3", "watch", "a cable hangs there"),
        )
        robot = load_robot("er3_600").replace(name="arm", pair_rules=rules)
        write_robot(robot, tmp_path / "arm.yaml")
        again = load_robot(tmp_path / "arm.yaml")
        assert again.pair_rules == rules
        rows = rows_of(again)
        assert (rows["link_2", "link_4"].state, rows["link_2", "link_4"].reason) == ("allowed", rules[0].reason)
        assert rows["base", "link_3"].state == "watched"
        assert fact("link_pair", first=0, second=3) in Bodies(again, None).pairs
        assert fact("link_pair", first=2, second=4) not in Bodies(again, None).pairs

    def test_arm_without_shapes_has_a_matrix(self):
        """moveit#3351: empty without collision geometry."""
        robot = load_robot("er3_600").replace(envelopes=(), hulls=())
        rows = rows_of(robot)
        assert rows
        assert any(row.state == "meets" for row in rows.values())

    def test_pair_that_random_poses_miss_is_watched(self, random):
        """moveit2_tutorials#647: too few samples. A thin pin that meets the base in one pose of tens of thousands."""
        robot = make_arm(
            envelopes=(
                Envelope(0, (0.48, 0.0, 0.3), (0.48, 0.0, 0.3), 0.001),
                Envelope(2, (0.38, 0.0, 0.0), (0.38, 0.0, 0.0), 0.001),
            )
        )
        q = random.uniform(robot.lower, robot.upper, (10_000, 6))
        assert not Bodies(robot.replace(pair_rules=(PairRule("base", "link_2", "watch", ""),)), None).overlaps(q).any()
        row = rows_of(robot)["base", "link_2"]
        assert row.state == "meets"
        assert coal_distance(robot, row.witness, "base", "link_2") < 0


@pytest.mark.long
def test_what_the_tool_carries_is_looked_at_and_may_touch_what_is_allowed():
    robot = load_robot("er3_600")
    scene = {
        "kind": "scene",
        "title": "made",
        "boxes": [{"name": "table", "size_mm": [500, 800, 40], "xyz_mm": [500, 0, 80]}],
        "carried": {"boxes": [{"name": "part", "size_mm": [400, 40, 40], "xyz_mm": [0, 0, 20]}]},
    }

    def made(**more) -> Scene:
        return SceneFile.model_validate(scene | more).scene()

    bodies = Bodies(robot, made())
    assert fact("carried_and_solid", carried="part", solid="table") in bodies.pairs
    assert fact("carried_and_link", carried="part", link=2) in bodies.pairs
    assert not any("link_6/part" in label_of(pair) for pair in bodies.pairs)  # a gripper's own
    allowed = {"allow": [{"pair": ["part", "table"], "reason": "it is picked up there"}]}
    assert fact("carried_and_solid", carried="part", solid="table") not in Bodies(robot, made(collision=allowed)).pairs
    q = np.radians([[0, -60, -30, 0, 60, 0]])
    assert clearance(robot, q, made()).distance[0] <= clearance(robot, q, made(carried={})).distance[0]


def test_files_decide_only_on_what_there_is():
    assert (ROBOTS / "er3_600.yaml").is_file()
    rules = (PairRule("base", "link_9", "allow", "x"),)
    with pytest.raises(InputError, match="there is no 'link_9'"):
        write_robot(load_robot("er3_600").replace(pair_rules=rules), ROBOTS / "never_written.yaml")


def test_a_default_shape_that_slides_in_its_guide_is_too_coarse_to_be_checked():
    """Of a SCARA the quill in the outer arm; shapes that a file states are taken at their word."""
    zero = np.zeros(4)
    scara = Robot(
        "scara", "scara", "standard", np.array([0.325, 0.275, 0, 0]), np.array([0, np.pi, 0, 0]),
        np.array([0.4, 0, 0, 0.05]), zero + 1, zero, np.array([-2.2, -2.4, 0, -6]), np.array([2.2, 2.4, 0.2, 6]),
        sliding=np.array([False, False, True, False]),
    )  # fmt: skip
    assert rows_of(scara)["link_2", "link_4"].state == "coarse"
    raised = np.array([[0.4, 0.2, slide, turn] for slide in (0.0, 0.03, 0.2) for turn in (0.0, 3.0)])
    assert Bodies(scara, None).free(raised).all()
    stated = scara.replace(envelopes=arm_shapes(scara).capsules)
    assert rows_of(stated)["link_2", "link_4"].state == "meets"
    assert not Bodies(stated, None).free(raised[:2]).any()


def test_a_guess_that_overlaps_at_many_poses_refuses_none_of_them_and_is_named():
    """A bare table answers as its robot file does, which allows these pairs; stated shapes are taken at their word."""
    arm = load_robot("er3a_c60_article")
    bare = arm.replace(pair_rules=())
    states = {names: row.state for names, row in rows_of(bare).items()}
    assert states["base", "link_2"] == states["link_2", "link_4"] == "coarse"
    q = quasi_random_points(arm.lower, arm.upper, 2000)
    assert np.array_equal(Bodies(bare, None).free(q), Bodies(arm, None).free(q))
    assert Bodies(bare, None).coarse == (fact("link_pair", first=0, second=2), fact("link_pair", first=2, second=4))
    assert Bodies(bare, None).in_error == Bodies(arm, None).in_error == ()
    stated = bare.replace(envelopes=arm_shapes(bare).capsules)
    assert not Bodies(stated, None).free(np.radians([[0.0, 45.0, -30.0, 0.0, 60.0, 0.0]])).any()


TABLES = {  # a mm, alpha deg, d mm, limits deg
    "irb120": (
        (0, 270, 70, 0, 0, 0),
        (-90, 0, -90, 90, -90, 0),
        (290, 0, 0, 302, 0, 72),
        (165, 110, 110, 160, 120, 400),
    ),
    "kr6": ((25, 455, 35, 0, 0, 0), (-90, 0, -90, 90, -90, 0), (400, 0, 0, 420, 0, 80), (170, 190, 156, 185, 120, 350)),
    "puma": (
        (0, 432, 20, 0, 0, 0),
        (90, 0, -90, 90, -90, 0),
        (672, 0, 150, 432, 0, 56),
        (160, 225, 225, 170, 100, 266),
    ),
}


def bare_table(name: str, tool_mm: tuple[float, float, float]) -> Robot:
    a, alpha, d, limits = (np.array(each, float) for each in TABLES[name])
    tool = np.eye(4)
    tool[:3, 3] = np.array(tool_mm) / 1e3
    return Robot(
        name, name, "standard", a / 1e3, np.radians(alpha), d / 1e3, np.ones(6), np.zeros(6), -np.radians(limits),
        np.radians(limits), tool=tool,
    )  # fmt: skip


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("length_mm", [0, 1, 30, 100])
def test_a_straight_tool_changes_nothing_across_a_wrist_of_guessed_shapes(name, length_mm):
    """No pose within the limits is refused for the two beside the wrist."""
    robot = bare_table(name, (0, 0, length_mm))
    bodies = Bodies(robot, None)
    found = bodies.overlaps(quasi_random_points(robot.lower, robot.upper, 2000))
    assert not found[
        :, [k for k, pair in enumerate(bodies.pairs) if pair == fact("link_pair", first=4, second=6)]
    ].any()


def test_a_bent_tool_is_watched_beyond_the_wrist_of_guessed_shapes():
    """Where it enters the forearm it refuses a pose."""
    bodies = Bodies(bare_table("irb120", (150, 0, 30)), None)
    assert fact("link_pair", first=4, second=6) in bodies.pairs
    assert bodies.joined[bodies.pairs.index(fact("link_pair", first=4, second=6))]
    q = np.zeros((2, 6))
    q[0, 4], q[1, 4] = np.radians(30), np.radians(-118)
    found = [{label_of(pair) for pair in np.array(bodies.pairs)[row]} for row in bodies.overlaps(q)]
    assert "link_4/link_6" not in found[0]
    q[1, 5] = np.pi
    turned = [{label_of(pair) for pair in np.array(bodies.pairs)[row]} for row in bodies.overlaps(q)]
    assert "link_4/link_6" in found[1] | turned[1]


@pytest.mark.long
def test_a_tool_does_not_put_guessed_shapes_in_error():
    """As of a UR10, whose flange is as near to link 4 as its housings are thick."""
    arm = Robot.from_dh(
        [0, -0.612, -0.5723, 0, 0, 0],
        [np.pi / 2, 0, 0, np.pi / 2, -np.pi / 2, 0],
        [0.1273, 0, 0, 0.16394, 0.1157, 0.0922],
    )
    tool = np.eye(4)
    tool[2, 3] = 0.1
    assert Bodies(arm, None).in_error == Bodies(arm.replace(tool=tool), None).in_error == ()


def test_neighbours_between_three_parallel_axes_may_lie_side_by_side():
    """As upper arm and forearm of a UR, which bends its elbow to about 160 deg. Others are checked as before."""
    arm = load_robot("ur5e")
    states = {names: row.state for names, row in rows_of(arm).items()}
    assert states["link_2", "link_3"] == "coarse"
    assert states["link_3", "link_4"] == "joined"
    assert states["link_2", "link_4"] == "meets"
    bodies = Bodies(arm, None)
    assert fact("link_pair", first=2, second=3) in bodies.coarse
    assert bodies.free(np.radians([[0.0, -90.0, 145.0, -90.0, -90.0, 0.0]])).all()


def box_around(link: int, low: tuple[float, float, float], high: tuple[float, float, float]) -> ConvexPiece:
    return ConvexPiece(
        link, tuple((x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])), 0.0
    )


def wrist_of_boxes() -> Robot:
    """A spherical wrist of boxes without a margin: the last one reaches through the middle one into the first."""
    boxes = (
        box_around(1, (-0.04, -0.04, -0.3), (0.04, 0.04, 0.05)),
        box_around(2, (-0.03, -0.03, -0.03), (0.03, 0.03, 0.03)),
        box_around(3, (-0.02, -0.02, -0.02), (0.02, 0.02, 0.3)),
    )
    rows = [("R", 0, -90, 0, -180, 180), ("R", 0, 90, 0, -120, 120), ("R", 0, 0, 100, -180, 180)]
    return made_of(rows).replace(hulls=boxes)


def test_boxes_of_a_wrist_are_held_by_their_joints_also_across_two_of_them():
    """Cores that overlap measure 0 without a margin: that is overlap, and no reason to forbid all poses."""
    robot = wrist_of_boxes()
    states = {names: row.state for names, row in rows_of(robot).items()}
    assert states["link_1", "link_2"] == states["link_2", "link_3"] == states["link_1", "link_3"] == "joined"
    bodies = Bodies(robot, None)
    assert bodies.in_error == ()
    assert bodies.free(np.zeros((1, 3))).all()


def test_neighbours_of_given_hulls_are_not_looked_at():
    """A square bar that turns beside a wall, which it meets in some poses."""
    wall = box_around(0, (-0.1, 0.02, -0.1), (0.1, 0.06, 0.1))
    bar = box_around(1, (-0.015, -0.015, -0.05), (0.015, 0.015, 0.05))
    row = rows_of(made_of([("R", 0, 0, 0, -180, 180)]).replace(hulls=(wall, bar)))["base", "link_1"]
    assert row.state == "joined"


@pytest.mark.parametrize(
    ("length", "wall", "state", "kept"),
    [
        (0.015, 0.0175, "coarse", True),
        (0.015, 0.02, "meets", True),
        (0.05, 0.052, "meets", False),
        (0.05, 0.037, "meets", False),
    ],
)
def test_a_margin_is_asked_of_links_that_can_keep_it(length, wall, state, kept):
    """A bar that turns about two joints beside a wall: at most 2.5 or 5 mm from it, or, as it is longer, 37 or 22 mm.

    The first and the last meet the wall in most joint vectors; the last one can also be well clear of it.
    """
    boxes = (
        box_around(0, (-0.1, wall, -0.1), (0.1, wall + 0.1, 0.1)),
        box_around(1, (-0.005, -0.005, -0.005), (0.005, 0.005, 0.005)),
        box_around(2, (-length, -0.015, -0.05), (length, 0.015, 0.05)),
    )
    robot = made_of([("R", 0, 0, 0, -180, 180)] * 2).replace(hulls=boxes)
    bodies, q = Bodies(robot, None), quasi_random_points(robot.lower, robot.upper, 200)
    assert rows_of(robot)["base", "link_2"].state == state
    assert bodies.free(q).all() == (state == "coarse") == bool(bodies.coarse)
    assert np.array_equal(bodies.free(q, 0.02), bodies.free(q)) == kept
    assert np.isfinite(bodies.min_distance(q)[0][bodies.free(q)]).any() != kept
    bar = {"name": "bar", "size_mm": [2000 * length, 30, 100], "xyz_mm": [0, 0, 0]}
    scene = SceneFile.model_validate({"kind": "scene", "title": "made", "carried": {"boxes": [bar]}}).scene()
    carrying = Bodies(robot.replace(hulls=boxes[:2]), scene)
    assert 0 < carrying.free(q).mean() < 1  # what is carried is no housing


def test_stages_of_a_telescope_drawn_too_large_are_not_checked_and_named():
    """They part by 40 mm at the end of their slides, and overlap in most positions."""
    stages = tuple(box_around(k, (-0.02, -0.02, 0.0), (0.02, 0.02, 0.16)) for k in range(3))
    robot = made_of([("P", 0, 0, 0, 0, 100)] * 2).replace(hulls=stages)
    bodies = Bodies(robot, None)
    assert rows_of(robot)["base", "link_2"].state == "coarse"
    assert bodies.coarse == (fact("link_pair", first=0, second=2),)
    assert Open("coarse_shapes", ("base/link_2",)) in covered_collisions(robot, bodies, None).gaps
    assert bodies.unexamined == bodies.coarse


def test_what_overlaps_in_every_pose_without_a_joint_is_an_error_of_the_shapes():
    """A base in the wrong unit, as a ball of 3 m: the rest of the arm is checked as before."""
    robot = load_robot("er3_600").replace(pair_rules=())
    swollen = robot.replace(envelopes=(Envelope(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 3.0), *robot.envelopes[1:]))
    rows, bodies = rows_of(swollen), Bodies(swollen, None)
    assert {names[1] for names, row in rows.items() if row.state == "overlaps"} == {"link_3", "link_4", "link_6"}
    assert bodies.in_error == (
        fact("link_pair", first=0, second=3),
        fact("link_pair", first=0, second=4),
        fact("link_pair", first=0, second=6),
    )
    assert not {pair for pair in bodies.pairs if pair in bodies.in_error}
    q = np.random.default_rng(1).uniform(robot.lower, robot.upper, (200, 6))
    alone = Bodies(robot.replace(envelopes=robot.envelopes[1:]), None)
    np.testing.assert_array_equal(bodies.free(q), alone.free(q))
    assert 0.05 < bodies.free(q).mean() < 1
    allowed = tuple(PairRule("base", f"link_{k}", "allow", "made so") for k in (3, 4, 6))
    assert Bodies(swollen.replace(pair_rules=allowed), None).in_error == ()


@pytest.mark.long  # kernels of surfaces take half a minute to compile
@pytest.mark.parametrize(("inner", "adjacent"), [(0.0493, True), (0.046, False)])
def test_housings_that_turn_in_each_other_are_adjacent(inner, adjacent):
    """A ball on link 6 in an open shell on link 4, both about the wrist's centre: apart by less than 1 mm, or more."""
    robot = load_robot("er3a_c60")
    poses, shapes = frames(robot, np.zeros(6)), []
    centre = poses[4][:3, 3]
    for link, radius in ((4, 0.05), (6, inner)):
        ball = trimesh.creation.icosphere(3, radius)
        R, place = poses[link - 1][:3, :3], poses[link - 1][:3, 3]
        points = ball.vertices + (centre - place) @ R
        shapes.append(LinkMesh(link, points, np.array(ball.faces[link == 4 :])))
    between = Envelope(5, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.001)  # without it no link with a shape is between the two
    rows = rows_of(robot.replace(envelopes=(between,), meshes=tuple(shapes)))
    assert (rows["link_4", "link_6"].state == "joined") == adjacent
