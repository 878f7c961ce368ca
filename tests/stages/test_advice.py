"""What pages advise is carried out as printed, and then passes the stage's own check with its margin."""

from __future__ import annotations

import re

import numpy as np
import pytest

import er3a.pipeline.messages.inverse  # noqa: F401
from er3a.collision.bodies import Bodies
from er3a.collision.scene import Plane, Scene
from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import rpy_of, transform
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.solutions import Target
from er3a.pipeline.messages.say import say
from er3a.pipeline.stages.inverse.compute import LITTLE_MARGIN_DEG, solve_target
from er3a.pipeline.stages.inverse.model import TargetResult
from er3a.robots.joint_limits import limit_margin
from er3a.workspace.causes import cause_of, relaxations
from er3a.workspace.proven import EMPTY, cavities, prove_robot

pytestmark = pytest.mark.long

ROBOT = load_robot("er3a_c60")
FLOOR = Scene("floor", (Plane("floor", np.array([0.0, 0.0, 1.0]), 0.05),))
CLEARANCE = 0.02
CELLS = 1500  # twice as many tell half a step from a whole one no better
NUMBERS = r"(-?[\d.]+), (-?[\d.]+), (-?[\d.]+)"


def target(T: np.ndarray) -> Target:
    return Target("asked", T)


def solved(T: np.ndarray, scene: Scene | None):
    return solve_target(ROBOT, target(T), scene, clearance=CLEARANCE).result


def refused_poses() -> dict[str, np.ndarray]:
    """Poses out of reach, beyond the limits, in the floor and where the arm hits itself."""
    random = np.random.default_rng(7)
    q = random.uniform(ROBOT.lower, ROBOT.upper, (400, 6))
    hits = q[~Bodies(ROBOT, None).free(q)]
    beyond = np.where(np.arange(6) == 1, ROBOT.upper + np.radians(25.0), 0.0) + np.radians([0, 0, 10, 5, 40, 0])
    return {
        "far": transform([1.5, 0.4, 0.9], [0.0, 1.2, 0.3]),
        "limits": forward(ROBOT, beyond),
        "floor": transform([0.4, 0.1, 0.06], [np.pi, 0.0, 0.0]),
        "level": transform([0.35, 0.0, 0.11], [0.0, np.pi / 2, 0.0]),
        **{f"itself_{k}": forward(ROBOT, each) for k, each in enumerate(hits[:6])},
    }


@pytest.fixture(scope="module")
def refused() -> dict[str, tuple[np.ndarray, TargetResult]]:
    """Poses that no arm takes above the floor, with what is found of them."""
    found = {name: (T, solved(T, FLOOR)) for name, T in refused_poses().items()}
    return {name: each for name, each in found.items() if each[1].chosen_deg is None}


def test_a_target_moved_or_turned_as_advised_is_reached_with_margin(refused):
    carried_out = 0
    for name, (T, before) in refused.items():
        texts = {advice.code: say(advice).replace("−", "-") for advice in before.advice}
        poses = []
        if "turn_tool" in texts:
            rpy = re.search(f"yaw = {NUMBERS}°", texts["turn_tool"]).groups()
            poses.append(transform(T[:3, 3], np.radians(np.array(rpy, float))))
        if "shift_tool" in texts:
            xyz = re.search(rf"\({NUMBERS}\)", texts["shift_tool"]).groups()
            poses.append(transform(np.array(xyz, float) / 1000, rpy_of(T)))
        carried_out += len(poses)
        for pose in poses:
            assert solved(pose, FLOOR).outcome == "reached", name
            assert usable(pose, FLOOR), name
    assert len(refused) >= 6
    assert carried_out >= 10


def usable(T: np.ndarray, scene: Scene | None) -> bool:
    """Whether some arm at a pose keeps the margins, one by one and by distances in full."""
    found = inverse(ROBOT, T)
    q = found.q[found.within_limits]
    margin = np.degrees(limit_margin(ROBOT, q)) >= LITTLE_MARGIN_DEG - 1e-9
    return bool((margin & (Bodies(ROBOT, scene).min_distance(q)[0] >= CLEARANCE - 1e-9)).any())


def test_the_obstacle_is_to_be_moved_only_where_the_arm_alone_keeps_its_margins(refused):
    colliding = [(T, found) for T, found in refused.values() if found.outcome == "collides"]
    advised = ["move_obstacle" in {advice.code for advice in found.advice} for _, found in colliding]
    assert advised == [usable(T, None) for T, _ in colliding]
    assert any(advised)
    assert not all(advised)


def test_a_void_disappears_when_a_limit_is_extended_as_the_page_says():
    """The changed arm is proven anew."""
    robot, carried_out = load_robot("er3a_c60_article"), 0
    for void in cavities(prove_robot(robot, CELLS, 1).section)[0]:
        cause = cause_of(*relaxations(robot, void))
        middle = void.cells.reshape(-1, 2, 2).mean(axis=2)
        for each in getattr(cause, "limits", ()):
            limits = getattr(robot, each.side).copy()
            limits[each.joints[0] - 1] = np.radians(each.extended)
            changed = prove_robot(robot.replace(**{each.side: limits}), CELLS, 1).section
            empty = changed.status(middle[:, 0], void.arcs.mean(axis=1), middle[:, 1]) == EMPTY
            assert np.average(empty, weights=void.volumes * void.empty) < 0.02, cause
            carried_out += 1
    assert carried_out == 3
