"""Maps of what tools do, of any arm: what is asked in a cell against bounded least squares on rows written by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from er3a.files.robot_library import load_robot
from er3a.finding import fact, is_one
from er3a.geometry.vectors import fibonacci_sphere
from er3a.kinematics.forward import forward
from er3a.pipeline.stages.workspace.entry import CapabilitySettings
from er3a.pipeline.stages.workspace.model import PlacementSummary
from er3a.pipeline.stages.workspace.tool_capability import tool_capability
from er3a.robots.robot import CombinedLimit, Robot
from er3a.workspace.capability import map_capability
from er3a.workspace.cell_frame import cell_frame
from er3a.workspace.orientations import asked_of
from er3a.workspace.tool_inverse import all_solutions, lacking_for_maps
from testing.arms import (
    dh_matrix,
    five_axis,
    gantry,
    joints_at_random,
    made_of,
    make_arm,
    palletiser,
    placement,
    pose_errors,
    scara,
)

pytestmark = pytest.mark.long  # kernels that take half a minute to compile

DIRECTIONS, TILTS = 24, 10


def place_of(frame, sector):
    """The middle of a sector, rad about axis 1, or m along the bar."""
    return np.asarray(frame.width * (sector + (0.5 if frame.bar else 0.0)), dtype=float)


def crx_like() -> Robot:
    """Six turning joints without a wrist centre, axes 2 and 3 parallel."""
    rows = [("R", 0, -90, 245, -180, 180), ("R", 710, 0, 0, -100, 100), ("R", 0, -90, 0, -250, 70)]
    return made_of([*rows, ("R", 0, 90, 540, -190, 190), ("R", 0, -90, 150, -120, 120), ("R", 0, 0, 160, -225, 225)])


def gantry_with_wrist() -> Robot:
    """Three slides and a wrist."""
    slides = [("P", 0, -90, 0, 0, 1200), ("P", 0, 90, 0, 0, 800), ("P", 0, 0, 0, 0, 500)]
    return made_of(
        [*slides, ("R", 0, -90, 0, -180, 180), ("R", 0, 90, 0, -100, 100), ("R", 0, 0, 100, -360, 360)],
        offset=np.radians([0, -90, 0, 0, 0, 0]),
        direction=np.array([1.0, -1, 1, 1, 1, 1]),
    )


def free_roll() -> Robot:
    """Five joints that can point the tool, but not choose the turn about it."""
    rows = [("R", 50, 90, 300, -170, 170), ("R", 350, 0, 0, -10, 170), ("R", 300, 0, 0, -150, 150)]
    turned = placement([0, 0, 0], [0, 0, 0.3])  # the tool says where it points: not along axis 5
    return made_of([*rows, ("R", 0, 90, 0, -150, 150), ("R", 60, 90, 90, -180, 180)], tool=turned)


def coupled() -> Robot:
    """Joint 3 goes with joint 2, and their sum is limited."""
    coupling = np.eye(6)
    coupling[2, 1] = -1.0
    return make_arm(
        coupling=coupling,
        lower=np.radians([-170, -100, -120, -180, -100, -180]),
        upper=np.radians([170, 100, 120, 180, 100, 180]),
        combined=(CombinedLimit((0, 1.0, 1.0, 0, 0, 0), -1.2, 1.5),),
    )


def tool_by_hand(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Tool pose (4, 4) from the table's rows."""
    T, moved = robot.base, q if robot.coupling is None else robot.coupling @ q
    for k in range(robot.rows):
        shift = robot.direction[k] * moved[k]
        theta, d = (0.0, shift) if robot.sliding[k] else (shift, 0.0)
        T = T @ dh_matrix("standard", robot.a[k], robot.alpha[k], robot.d[k] + d, theta + robot.offset[k])
    return T @ robot.tool


def reached(robot: Robot, miss, random: np.random.Generator, tries: int = 12) -> bool:
    """Whether least squares find joints within all limits whose tool pose ``miss`` (of a pose) nothing."""
    factors = np.array([limit.factors for limit in robot.combined]).reshape(-1, robot.joints)
    ends = np.array([[limit.lower, limit.upper] for limit in robot.combined]).reshape(-1, 2)

    def off(q: np.ndarray) -> np.ndarray:
        sums = factors @ q
        return np.concatenate(
            [miss(tool_by_hand(robot, q)), np.maximum(0, sums - ends[:, 1]), np.maximum(0, ends[:, 0] - sums)]
        )

    for _ in range(tries):
        found = least_squares(off, random.uniform(robot.lower, robot.upper), bounds=(robot.lower, robot.upper))
        if np.abs(found.fun).max() < 1e-6:
            return True
    return False


def pointing(point: np.ndarray, direction: np.ndarray):
    """What a pose lacks of a point and a direction of its z axis."""
    return lambda T: np.concatenate([T[:3, 3] - point, T[:3, 2] - direction])


@pytest.mark.parametrize(
    ("make", "middle", "sector"),
    [
        (lambda: load_robot("ur5e"), (0.14, 0.2), 0),
        (lambda: load_robot("lbr_iiwa_14"), (0.62, 0.55), 0),
        (free_roll, (0.62, 0.25), 0),
        (gantry_with_wrist, (0.12, -0.3), 30),
    ],
)
def test_reachability_is_what_least_squares_find(make, middle, sector, random):
    robot, asked = make(), asked_of(make(), 4)
    count = DIRECTIONS if robot.joints == 7 else DIRECTIONS // 2
    found = map_capability(robot, np.array([middle]), count, asked)
    frame = cell_frame(robot)
    point = frame.points(np.array(middle[0]), place_of(frame, np.array(sector)), np.array(middle[1]))
    tries = 40 if make is free_roll else 12
    directions = fibonacci_sphere(count) @ frame.R
    share = np.mean([reached(robot, pointing(point, row), random, tries) for row in directions])
    ratio = found.reachability[0, sector]
    assert 0.1 < share < 1.0
    if robot.joints < 7:
        assert ratio == pytest.approx(share)
    else:  # more is reached between arm angles
        assert share - 2 / count <= ratio <= share


def test_tilts_are_those_that_least_squares_find(random):
    robot, rho, z = five_axis(), 0.55, 0.62
    found = map_capability(robot, np.array([[rho, z]]), TILTS, asked_of(robot, 1))
    frame = cell_frame(robot)
    x, _, up = frame.R
    point = frame.points(np.array(rho), np.array(0.0), np.array(z))
    tilts = 2 * np.pi * np.arange(TILTS) / TILTS
    share = np.mean([reached(robot, pointing(point, np.cos(t) * up + np.sin(t) * x), random, 12) for t in tilts])
    assert 0.1 < share < 1.0
    assert found.reachability[0, 0] == pytest.approx(share)


def test_turns_of_a_scara_are_those_that_least_squares_find(random):
    robot = scara().replace(lower=np.array([-2.2, -2.5, 0, -1.0]), upper=np.array([2.2, 2.5, 0.18, 1.5]))
    found = map_capability(robot, np.array([[0.4, 0.1]]), DIRECTIONS, asked_of(robot, 1))
    point = np.array([0.4, 0, 0.1])
    start = tool_by_hand(robot, np.zeros(4))[:3, :3]

    def turned(angle: float):
        wanted = Rotation.from_rotvec([0, 0, angle]).as_matrix() @ start
        return lambda T: np.concatenate([T[:3, 3] - point, (T[:3, :3] - wanted).ravel()])

    turns = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    share = np.mean([reached(robot, turned(angle), random, 6) for angle in turns])
    assert 0.1 < share < 1.0
    assert found.reachability[0, 0] == pytest.approx(share)


def test_points_of_three_slides_are_a_box():
    robot, frame = gantry(), cell_frame(gantry())
    rho, z = (grid.ravel() for grid in np.meshgrid(np.linspace(0, frame.reach, 9), np.linspace(*frame.heights, 7)))
    found = map_capability(robot, np.stack([rho, z], axis=1), 1, asked_of(robot, 1))
    place = place_of(frame, np.arange(frame.sectors))
    points = frame.points(rho[:, None], place[None], z[:, None])
    ends = [tool_by_hand(robot, q)[:3, 3] for q in (robot.lower, robot.upper)]
    low, high = np.minimum(*ends), np.maximum(*ends)
    inside = ((points >= low - 1e-9) & (points <= high + 1e-9)).all(axis=-1)
    assert 0.2 < inside.mean() < 0.95
    assert ((found.reachability > 0) == inside).all()


@pytest.mark.parametrize(
    "make",
    [lambda: load_robot("ur5e"), lambda: load_robot("lbr_iiwa_14"), crx_like, free_roll, scara, coupled],
)
def test_solutions_reach_their_poses_within_the_limits(make, random):
    robot = make()
    drawn = joints_at_random(robot, random, 400)
    sums = np.array([drawn @ np.array(limit.factors) for limit in robot.combined]).reshape(-1, 400)
    ends = np.array([[limit.lower, limit.upper] for limit in robot.combined]).reshape(-1, 2)
    T = forward(robot, drawn[((sums >= ends[:, :1]) & (sums <= ends[:, 1:])).all(axis=0)][:40])
    q, within = all_solutions(robot, T)
    pose, slot = np.nonzero(within)
    distance, angle = pose_errors(forward(robot, q[pose, slot]), T[pose])
    assert set(pose) == set(range(40)) or robot.joints == 7
    assert distance.max() < 1e-6
    assert angle.max() < (1e-3 if robot.joints == 6 and make is crx_like else np.inf if make is free_roll else 1e-6)
    assert ((q[pose, slot] >= robot.lower - 1e-9) & (q[pose, slot] <= robot.upper + 1e-9)).all()
    for limit in robot.combined:
        total = q[pose, slot] @ np.array(limit.factors)
        assert ((total >= limit.lower - 1e-8) & (total <= limit.upper + 1e-8)).all()


def test_a_scara_serves_the_boxes_it_is_said_to(random):
    robot = scara()
    done = tool_capability(robot, CapabilitySettings(directions=12), 0.05)
    assert isinstance(done.placement, PlacementSummary)
    assert done.placement.places
    for place in done.placement.places[:1]:
        corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T / 2
        for point in place.centre_m + corners * place.size_m:
            assert reached(robot, lambda T, point=point: T[:3, 3] - point, random, 6)


def test_a_scara_that_points_down_serves_no_box_from_the_side():
    asked = CapabilitySettings.model_validate({"directions": 12, "placement": {"tool_direction": [1, 0, 0]}})
    done = tool_capability(scara(), asked, 0.05)
    assert is_one(done.placement, "workspace.tool_points_elsewhere")
    assert done.placement.direction == pytest.approx((0, 0, -1))
    assert len(done.places) == 0


def test_what_no_maps_are_made_of_is_told():
    assert lacking_for_maps(palletiser()) == fact("orientations_unknown", joints=4)
    shared = make_arm(combined=(CombinedLimit((1.0, 1.0, 0, 0, 0, 0), -1.0, 1.0),))
    assert lacking_for_maps(shared) == fact("joint_one_shared")
    rows = [("R", 0, 90, 300, -170, 170), ("R", 350, 0, 0, -10, 170), ("R", 0, 90, 0, -150, 150)]
    assert lacking_for_maps(made_of([*rows, ("R", 0, 0, 200, -180, 180)])) in (
        fact("inverse_unknown"),
        fact("orientations_unknown", joints=4),
    )
