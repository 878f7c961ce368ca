"""Lines of the tool with arms whose axes 2, 3 and 4 are parallel (UR), through their singularities too."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.forward import forward, jacobian
from er3a.kinematics.singularity import NearSingular, determinant_factors
from er3a.kinematics.solutions import LABELS, branch_labels
from er3a.kinematics.wrist_partitioned import solve_slots
from er3a.planning.follow import follow
from er3a.planning.moves import line
from er3a.planning.singular_events import singular_events
from er3a.planning.tool_curve import curve_of
from testing.arms import DEG, joints_at_random, make_arm, pose_errors

pytestmark = pytest.mark.long  # kernels of a class that no fast test compiles
GRID = np.linspace(0, 1, 80)
UR5 = make_arm(
    a=[0, -0.425, -0.39225, 0, 0, 0],
    alpha=np.array([90, 0, 0, 90, -90, 0]) * DEG,
    d=[0.089159, 0, 0, 0.10915, 0.09465, 0.0823],
    lower=[-2 * np.pi] * 6,
    upper=[2 * np.pi] * 6,
)
Q = np.array([0.3, -1.4, 1.9, -2.0, -1.2, 0.4])


def shifted(T, xyz):
    moved = T.copy()
    moved[:3, 3] += xyz
    return moved


def test_slots_have_their_names_and_signs(random):
    assert sorted(branch_labels(UR5)) == sorted(LABELS)
    q = joints_at_random(UR5, random, 500)
    slots, fault, gap = solve_slots(UR5, forward(UR5, q), q)
    own = np.nanargmin(np.abs(wrap_to_pi(slots - q[:, None])).max(axis=2), axis=1)
    assert np.abs(wrap_to_pi(slots[np.arange(len(q)), own] - q)).max() < 1e-7
    factors = determinant_factors(UR5, q)
    for sign, step in ((factors.wrist, 1), (factors.elbow, 2), (factors.shoulder, 4)):
        assert len(set(zip((sign > 0).tolist(), (own // step % 2).tolist()))) == 2
    assert (gap[fault == 0] == 0).all()
    assert (gap[fault > 0] > 0).all()


def test_the_determinant_vanishes_with_its_factors(random):
    q = joints_at_random(UR5, random, 300)
    factors = determinant_factors(UR5, q)
    product = np.sin(factors.wrist) * np.sin(factors.elbow) * factors.shoulder
    assert np.std(np.abs(np.linalg.det(jacobian(UR5, q)) / product)) < 1e-9


def test_a_line_is_followed_to_its_end():
    T = forward(UR5, Q)
    way = line(T, shifted(T, [-0.1, 0.15, 0.1]), 1.0)
    followed = follow(UR5, way, GRID, Q)
    assert followed.jumps == ()
    assert np.abs(followed.q[0] - Q).max() < 1e-9
    position, rotation = pose_errors(forward(UR5, followed.q), way.poses(followed.progress))
    assert max(position.max(), rotation.max()) < 1e-9
    assert np.abs(np.diff(followed.q, axis=0)).max() < 0.35


@pytest.mark.parametrize("samples", [80, 81])
def test_a_line_through_the_singular_wrist_goes_on_and_is_told(samples):
    start, end = Q.copy(), Q.copy()
    start[4], end[4] = -0.2, 0.2
    T, other = forward(UR5, start), forward(UR5, end)
    way = line(T, other, 1.0)
    grid = np.linspace(0, 1, samples)
    followed = follow(UR5, way, grid, start)
    met = np.isfinite(followed.q[:, 0])
    assert met.all()
    position, rotation = pose_errors(forward(UR5, followed.q), way.poses(followed.progress))
    assert max(position.max(), rotation.max()) < 1e-8
    events = singular_events(UR5, curve_of(followed)[0], NearSingular(0.02, 0.02, 0.005))
    assert any(event.type == "wrist" for event in events)


def test_the_stretched_arm_ends_the_line():
    T = forward(UR5, Q)
    way = line(T, shifted(T, [-2.0, 0.0, 0.0]), 1.0)
    followed = follow(UR5, way, GRID, Q)
    reached = np.isfinite(followed.q[:, 0])
    assert reached[0]
    assert not reached[-1]
