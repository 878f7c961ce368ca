"""What a motion leaves room for, the worst poses, wrist loads, and times under torques."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy

import er3a
from er3a.dynamics.arm_model import arm_model
from er3a.dynamics.margins import (
    DriveLimits,
    held_payload,
    levers,
    max_payload,
    max_speed_scale,
    worst_levers,
    wrist_use,
)
from er3a.dynamics.torques import demand, holding_torques, torque_parts, worst_holding
from er3a.robots.joint_limits import within
from er3a.robots.masses import Drives, LinkMass, Load, MassBody, Masses, WristLoad
from er3a.robots.robot import CombinedLimit, Robot
from testing.arms import make_arm
from tests.dynamics.test_torques import COUPLED, mass_and_potential, random_arm

PEAK = np.array([30.0, 45.0, 25.0, 8.0, 5.0, 3.0])
UNKNOWN = np.full(6, np.nan)
TIMES = np.linspace(0, 3, 401)


def limits(peak: np.ndarray = PEAK, rated: np.ndarray = UNKNOWN, speed: np.ndarray = UNKNOWN) -> DriveLimits:
    return DriveLimits(peak, rated, speed)


@pytest.fixture(scope="module")
def arm() -> Robot:
    robot = er3a.load_robot("er3a_c60")
    drives = replace(
        Drives.unknown(6),
        coulomb=np.full(6, 0.4),
        viscous=np.full(6, 0.2),
        armature=np.full(6, 0.02),
        peak=PEAK,
    )
    return robot.replace(masses=replace(robot.masses, drives=drives), speed=np.full(6, 4.0))


@pytest.mark.parametrize("rated", [UNKNOWN, np.array([20.0, 41.0, 20.0, 7.0, 4.0, 2.0])])
def test_a_held_payload_breaks_no_limit_in_any_pose_and_a_heavier_one_does(arm, rated, random):
    def torques(q: np.ndarray, kg: float) -> np.ndarray:
        return holding_torques(arm_model(arm, Load(kg, (0.0, 0.0, 0.1))), q)

    found = held_payload(arm, lambda q: (torques(q, 0.0), torques(q, 1.0) - torques(q, 0.0)), limits(rated=rated))
    allowed, q = np.fmin(PEAK, rated), random.uniform(arm.lower, arm.upper, (20_000, 6))
    assert 0.5 < found.value < 20
    assert (np.abs(torques(q, found.value)) <= allowed).all()
    assert (np.abs(torques(q, 1.15 * found.value)) > allowed)[:, found.joint].any()
    assert found.by == ("peak" if np.isnan(rated).any() else "rms")


def path(count: int = 301) -> np.ndarray:
    share = np.linspace(0, 1, count)[:, None]
    start, end = np.array([0, -0.3, 0.2, 0, 0.3, 0]), np.array([1.2, 0.5, -0.4, 0.8, -0.5, 1])
    return start + share * (end - start) + 0.1 * np.sin(6 * share + np.arange(6))


def swing(count: int = 401) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    t, phase = np.linspace(0, 3, count)[:, None], np.arange(6)
    return 0.4 * np.sin(2 * t + phase), 0.8 * np.cos(2 * t + phase), -1.6 * np.sin(2 * t + phase)


def test_an_arm_that_its_drives_can_not_hold_carries_nothing_even_if_a_load_would_relieve_them():
    without, per_kg = np.array([[12.0, 0.0]]), np.array([[-1.0, 1.0]])
    found = max_payload(np.zeros(1), without, per_kg, limits(np.array([10.0, 50.0]), UNKNOWN[:2], UNKNOWN[:2]))
    assert (found.value, found.by, found.joint) == (0.0, "peak", 0)


def test_the_greatest_payload_brings_one_drive_to_its_peak(arm):
    q, qd, qdd = swing()
    centre, moments = (0.02, 0.0, 0.08), (0.002, 0.002, 0.001, 0.0, 0.0, 0.0)
    without = er3a.torques(arm, q, qd, qdd)
    per_kg = er3a.torques(arm, q, qd, qdd, Load(1.0, centre, moments)) - without
    found = max_payload(TIMES, without, per_kg, limits())
    assert found.by == "peak"

    def utilisation(mass: float) -> np.ndarray:
        load = Load(mass, centre, tuple(mass * value for value in moments))
        return np.abs(er3a.torques(arm, q, qd, qdd, load)) / PEAK

    assert 0.1 < found.value < 50
    ratios = utilisation(found.value)
    assert ratios.max() == pytest.approx(1.0, rel=1e-9)
    assert np.unravel_index(ratios.argmax(), ratios.shape) == (found.sample, found.joint)
    assert utilisation(0.999 * found.value).max() < 1 < utilisation(1.001 * found.value).max()


def test_the_greatest_speed_scale_brings_one_drive_to_its_peak(arm):
    q, qd, qdd = swing()
    parts, drives = torque_parts(arm_model(arm), q, qd, qdd), arm.masses.drives
    viscous = drives.viscous * qd
    at_rest = parts.gravity + parts.friction - viscous
    args = TIMES, (at_rest, viscous, parts.inertia + parts.velocity), qd
    found = max_speed_scale(*args, limits())

    def utilisation(scale: float) -> float:
        return float((np.abs(er3a.torques(arm, q, scale * qd, scale**2 * qdd)) / PEAK).max())

    assert utilisation(found.value) == pytest.approx(1.0, rel=1e-9)
    assert all(utilisation(share * found.value) <= 1 + 1e-9 for share in np.linspace(0.01, 1, 50))
    # Joint speeds may bind first.
    slow = max_speed_scale(*args, limits(speed=np.full(6, 0.8)))
    assert slow.value == pytest.approx(1.0, rel=1e-4)
    assert slow.by == "speed"


def test_an_arm_that_cannot_stand_has_no_margin_and_unknown_limits_none(arm):
    q, qd, qdd = swing()
    parts = torque_parts(arm_model(arm), q, qd, qdd)
    weak = np.where(np.arange(6) == 1, 0.5, np.nan)
    zero = np.zeros_like(q)
    for by, weakest in (("peak", limits(weak)), ("rms", limits(UNKNOWN, weak))):
        payload = max_payload(TIMES, parts.total, np.ones_like(q), weakest)
        speed = max_speed_scale(TIMES, (parts.gravity, zero, parts.inertia), qd, weakest)
        assert (payload.value, payload.by, payload.joint) == (0.0, by, 1)
        assert (speed.value, speed.by, speed.joint) == (0.0, by, 1)
    assert max_payload(TIMES, parts.total, np.ones_like(q), limits(UNKNOWN)) is None
    assert max_speed_scale(TIMES, (parts.gravity, zero, parts.inertia), qd, limits(UNKNOWN)) is None
    assert max_speed_scale(TIMES, (zero, zero, zero), zero, limits()).value == np.inf


@pytest.mark.parametrize(
    ("at_rest", "linear", "square", "expected"),
    [
        (0.0, 2.0, -1.0, 1 + np.sqrt(2)),  # touches the peak at 1 and falls again, to minus the peak
        (1.0, 2.0, -1.0, 0.0),  # stands at the peak and rises
        (1.0, -2.0, 1.0, 2.0),  # stands at the peak, falls, and is back at 2
    ],
)
def test_the_greatest_speed_scale_is_where_a_torque_leaves_its_limits(at_rest, linear, square, expected):
    parts = [np.full((2, 1), part) for part in (at_rest, linear, square)]
    one, unknown = np.ones(1), UNKNOWN[:1]
    for drive in (limits(one, unknown, unknown), limits(unknown, one, unknown)):
        found = max_speed_scale(np.array([0.0, 1.0]), parts, np.zeros((2, 1)), drive)
        assert found.value == pytest.approx(expected)


def test_rated_torques_bound_payload_and_speed_by_the_effective_ones(arm):
    q, qd, qdd = swing()
    centre, moments = (0.02, 0.0, 0.08), (0.002, 0.002, 0.001, 0.0, 0.0, 0.0)
    rated = 0.4 * PEAK

    def effective(scale: float = 1.0, mass: float = 0.0) -> np.ndarray:
        """By Simpson's rule, of torques as the public function gives them."""
        load = Load(mass, centre, tuple(mass * value for value in moments)) if mass else None
        tau = er3a.torques(arm, q, scale * qd, scale**2 * qdd, load)
        return np.sqrt(scipy.integrate.simpson(tau**2, x=TIMES, axis=0) / TIMES[-1])

    without = er3a.torques(arm, q, qd, qdd)
    per_kg = er3a.torques(arm, q, qd, qdd, Load(1.0, centre, moments)) - without
    payload = max_payload(TIMES, without, per_kg, limits(PEAK, rated))
    assert (payload.by, payload.sample) == ("rms", None)
    assert payload.value < max_payload(TIMES, without, per_kg, limits()).value
    ratios = effective(mass=payload.value) / rated
    assert ratios.max() == pytest.approx(1.0, rel=2e-3)  # friction jumps within an interval
    assert ratios.argmax() == payload.joint
    parts = torque_parts(arm_model(arm), q, qd, qdd)
    viscous = arm.masses.drives.viscous * qd
    at_rest = parts.gravity + parts.friction - viscous
    scale = max_speed_scale(TIMES, (at_rest, viscous, parts.inertia + parts.velocity), qd, limits(UNKNOWN, rated))
    ratios = effective(scale=scale.value) / rated
    assert (scale.by, int(ratios.argmax())) == ("rms", scale.joint)
    assert ratios.max() == pytest.approx(1.0, rel=2e-3)
    assert all((effective(scale=share * scale.value) < rated).all() for share in np.linspace(0.05, 0.99, 20))


def test_the_worst_holding_pose_of_two_links_is_stretched_out():
    g, a = 9.81, 0.5
    rods = tuple(
        LinkMass(k, MassBody(m, (c, 0.0, 0.0), (0.01, 0.01, 0.01, 0, 0, 0))) for k, m, c in ((1, 3, 0.2), (2, 2, 0.3))
    )
    tilt = np.eye(4)
    tilt[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    arm = Robot(
        name="planar", title="planar", convention="standard", a=[a, 0.4], alpha=[0.0, 0.0], d=[0.0, 0.0],
        direction=[1.0, 1.0], offset=[0.0, 0.0], lower=[-3.0, -2.5], upper=[3.0, 2.5], base=tilt, masses=Masses(rods),
    )  # fmt: skip
    found = worst_holding(arm_model(arm))
    expected = np.array([g * (3 * 0.2 + 2 * (a + 0.3)), g * 2 * 0.3])
    np.testing.assert_allclose(np.abs(found.values), expected, rtol=1e-5)
    # Limits that keep the arm away from there: the greatest by a fine grid of the law of levers.
    kept = arm.replace(lower=[0.9, 0.4], upper=[1.4, 2.5])
    x, y = np.meshgrid(np.linspace(0.9, 1.4, 501), np.linspace(0.4, 2.5, 2101))
    first = np.abs(g * (3 * 0.2 * np.cos(x) + 2 * (a * np.cos(x) + 0.3 * np.cos(x + y)))).max()
    second = np.abs(g * 2 * 0.3 * np.cos(x + y)).max()
    found = worst_holding(arm_model(kept))
    np.testing.assert_allclose(np.abs(found.values), [first, second], rtol=1e-5)


KINDS = ("sliding", "coupled", "sum")
WALL = np.array([[0.0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])


@pytest.mark.long
@pytest.mark.parametrize(
    "kind", ["floor", *(pytest.param(each, marks=pytest.mark.long) for each in ("wall", "pushed", "seven")), *KINDS]
)
def test_no_pose_tried_needs_more_holding_torque_than_found(arm, kind):
    """Of poses drawn at random, each then climbed joint by joint by differences of the torque alone."""
    load = Load(1.5, (0.03, -0.02, 0.09), (0.002, 0.002, 0.001, 0.0, 0.0, 0.0))
    if kind == "wall":
        arm = arm.replace(base=WALL)
    elif kind == "pushed":
        load = replace(load, force=(40.0, -20.0, 90.0), moment=(3.0, -1.0, 2.0))
    elif kind == "sum":
        arm = arm.replace(combined=(CombinedLimit((0.0, 1.0, 1.0, 0.0, 0.0, 0.0), -0.5, 0.6),))
    elif kind in ("sliding", "coupled"):
        coupled = kind == "coupled"
        arm = (
            random_arm(5, "standard", [False] * 4, COUPLED)
            if coupled
            else random_arm(3, "standard", [False, False, True, False])
        )
    elif kind == "seven":
        arm = random_arm(6, "modified", [False] * 7)
    model = arm_model(arm, load)
    found = worst_holding(model)
    q = np.random.default_rng(5).uniform(arm.lower, arm.upper, (20_000, arm.joints))
    q = q[within(arm, q)]
    assert (np.abs(er3a.gravity(arm, q, load)).max(axis=0) <= np.abs(found.values) * (1 + 1e-6) + 1e-9).all()
    assert within(arm, found.q).all()


def test_an_arm_that_hardly_moves_holds_what_it_holds_there(arm):
    """Weight and a push at the tool, together and against each other."""
    load = Load(1.5, (0.03, -0.02, 0.09), force=(40.0, -20.0, 90.0), moment=(3.0, -1.0, 2.0))
    for q in np.random.default_rng(7).uniform(arm.lower, arm.upper, (1, 6)):
        held = np.abs(er3a.gravity(arm, q, load))
        found = worst_holding(arm_model(arm.replace(lower=q - 1e-6, upper=q + 1e-6), load))
        np.testing.assert_allclose(np.abs(found.values), held, rtol=2e-3, atol=1e-3)


def test_the_worked_example_of_a_manual():
    """Epson's N6 manual: 3 kg at 120 + 100 mm make 6.468 N m of 15.2 and 0.1452 kg m^2 of 0.42 (g = 9.8)."""
    arm = make_arm(d=[0.3, 0, 0, 0.35, 0, 0.12])
    wrist = WristLoad(6.0, ((4, 15.2), (5, 15.2)), ((4, 0.42), (5, 0.42)))
    payload, *uses = wrist_use(arm, wrist, Load(3.0, (0.0, 0.0, 0.1)), gravity=9.8)
    assert (payload.asked, payload.allowed, payload.ratio) == (3.0, 6.0, 0.5)
    for use in uses:
        asked, allowed = {"moment": (6.468, 15.2), "inertia": (0.1452, 0.42)}[use.quantity]
        assert use.asked == pytest.approx(asked, rel=1e-6)
        assert use.ratio == pytest.approx(asked / allowed, rel=1e-6)
    # With 0.1 kg and 5 mm more: 3.1 kg at 225 mm.
    payload, *uses = wrist_use(arm, wrist, Load(3.0, (0.0, 0.0, 0.1)), gravity=9.8, off=(0.1, 0.005))
    assert (payload.asked, payload.most) == (3.0, 3.1)
    for use in uses:
        most = {"moment": 3.1 * 9.8 * 0.225, "inertia": 3.1 * 0.225**2}[use.quantity]
        assert use.most == pytest.approx(most, rel=1e-6)


@pytest.mark.long
def test_forces_on_the_tool_count_to_the_wrists_moments(arm):
    """A tool of 120 mm, pushed across by 100 N: joint 5 holds that by a lever of 198.5 mm, besides 1 kg at 30 mm."""
    tool = np.eye(4)
    tool[2, 3] = 0.12
    arm, load = arm.replace(tool=tool), Load(1.0, (0.0, 0.0, 0.03), force=(100.0, 0.0, 0.0), moment=(0.0, 0.0, 0.5))
    wrist = WristLoad(np.nan, ((4, 7.0), (5, 7.0), (6, 4.0)), ())
    uses = {use.joint: use for use in wrist_use(arm, wrist, load)}
    assert uses[5].asked == pytest.approx(100 * 0.1985 + 9.81 * 0.1085, rel=1e-6)
    assert uses[6].asked == pytest.approx(0.5, rel=1e-6)
    q = np.random.default_rng(3).uniform(arm.lower, arm.upper, (500, 6))
    for turn in np.random.default_rng(4).uniform(-np.pi, np.pi, (5, 3)):  # however the arm is mounted
        mounted = arm.replace(base=er3a.pose(np.zeros(3), turn))
        held = np.abs(er3a.gravity(mounted, q, load) - er3a.gravity(mounted, q)).max(axis=0)
        assert all(held[joint - 1] <= use.asked * (1 + 1e-6) for joint, use in uses.items())
    for use in uses.values():
        assert use.most == pytest.approx(use.asked, rel=1e-12)
    off = {use.joint: use.most for use in wrist_use(arm, wrist, load, off=(0.1, 0.005))}
    assert off[5] == pytest.approx(100 * 0.1985 + 1.1 * 9.81 * 0.1135, rel=1e-4)


@pytest.mark.long
def test_levers_are_distances_of_the_load_from_the_axes(arm):
    point, q = np.array([0.03, -0.02, 0.1]), np.random.default_rng(2).uniform(arm.lower, arm.upper, (3000, 6))
    far = worst_levers(arm, point, range(2, 6))
    seen = levers(arm, q, point)
    assert (seen[:, 2:] <= far + 1e-9).all()
    # Of a wrist whose axes meet: the distance from their point for joints 4 and 5, that from its own axis for 6.
    whole = np.hypot(np.hypot(0.03, 0.02), 0.1 + 0.0785)
    np.testing.assert_allclose(far[1:], [whole, whole, np.hypot(0.03, 0.02)], atol=1e-6)
    # Against the cross product of joint 5's column of the Jacobian: a point moves by its distance for each radian.
    tool = np.eye(4)
    tool[:3, 3] = point
    J = er3a.jacobian(arm.replace(tool=tool), q)
    np.testing.assert_allclose(seen, np.linalg.norm(J[:, :3], axis=1), atol=1e-12)


def test_demands_of_a_drive_in_closed_form():
    t = np.linspace(0, 2 * np.pi, 20_001)
    found = demand(t, np.cos(t)[:, None], 3 * np.cos(t)[:, None] + 4 * np.sin(t)[:, None])
    assert found.peak[0] == pytest.approx(5.0, rel=1e-6)
    assert found.rms[0] == pytest.approx(5 / np.sqrt(2), rel=1e-6)
    assert found.work[0] - found.recovered[0] == pytest.approx(3 * np.pi, rel=1e-6)
    assert found.power[0] == pytest.approx(4.0, rel=1e-6)  # 3 cos^2 + 4 sin cos is at most (3 + 5) / 2
    assert found.braking[0] == pytest.approx(1.0, rel=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("joint", [1, 2, 4])
def test_the_worst_pose_of_a_wall_mounted_arm_against_potential_energies_alone(arm, joint):
    """The torque as a derivative of potential energy by complex steps, climbed by SciPy: nothing of the library."""
    mounted = arm.replace(base=WALL)
    bodies = {each.link: each.body for each in arm.masses.links if each.link}

    def torque(q: np.ndarray) -> float:
        step = q.astype(complex)
        step[joint] += 1e-30j
        return abs(mass_and_potential(mounted, step, bodies)[1].imag / 1e-30)

    starts = np.random.default_rng(4).uniform(arm.lower, arm.upper, (200, 6))
    best = sorted(starts, key=torque)[-4:]
    ends = list(zip(arm.lower, arm.upper))
    tops = [scipy.optimize.minimize(lambda q: -torque(q), q, bounds=ends, method="L-BFGS-B").fun for q in best]
    found = worst_holding(arm_model(mounted))
    assert -min(tops) == pytest.approx(abs(found.values[joint]), rel=1e-3)
