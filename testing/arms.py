"""Random and hand-made arms, and their kinematics computed without er3a's code."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from er3a.kinematics.singularity import DeterminantFactors, determinant_factors
from er3a.robots.robot import Robot

DEG = np.pi / 180
OTHERS_LONG = pytest.mark.parametrize(
    "robot",
    ["er3_600", pytest.param("er3a_c60_article", marks=pytest.mark.long)],
    indirect=True,
)
"""For a test of the fixture ``robot`` that takes seconds: one robot in the fast set, another among the long ones."""


def links_of_rows(a: np.ndarray, alpha: np.ndarray, d: np.ndarray, offset: np.ndarray | None = None) -> np.ndarray:
    """Constant links (n + 1, 4, 4) of standard D-H rows (n,) in m and rad; joint angles are theta less ``offset``.

    For a prismatic joint ``d`` is the joint's offset and ``offset`` its fixed theta.
    """
    n = len(a)
    turn = np.zeros(n) if offset is None else np.asarray(offset, float)
    links = np.tile(np.eye(4), (n + 1, 1, 1))
    for k in range(n):
        c, s, ct, st = np.cos(alpha[k]), np.sin(alpha[k]), np.cos(turn[k]), np.sin(turn[k])
        links[k + 1] = [
            [ct, -st * c, st * s, ct * a[k]],
            [st, ct * c, -ct * s, st * a[k]],
            [0, s, c, d[k]],
            [0, 0, 0, 1],
        ]
    return links


def placement(xyz, rpy) -> np.ndarray:
    """A transform from metres and roll-pitch-yaw, by SciPy."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("ZYX", rpy[::-1]).as_matrix()
    T[:3, 3] = xyz
    return T


def make_arm(convention="standard", **changes) -> Robot:
    """A six-axis arm of common shape: shoulder offset 0.1, upper arm 0.4, elbow offset 0.05, forearm 0.35 (m)."""
    values = {
        "name": "made",
        "title": "made up",
        "convention": convention,
        "a": [0.1, 0.4, 0.05, 0, 0, 0],
        "alpha": np.array([-90, 0, -90, 90, -90, 0]) * DEG,
        "d": [0.3, 0, 0, 0.35, 0, 0.08],
        "direction": np.ones(6),
        "offset": np.zeros(6),
        "lower": np.full(6, -np.pi),
        "upper": np.full(6, np.pi),
    }
    if convention == "modified":
        values["a"] = [0, 0.1, 0.4, 0.05, 0, 0]
        values["alpha"] = np.array([0, -90, 0, -90, 90, -90]) * DEG
    return Robot(**(values | changes))


def made_of(rows: list[tuple[str, float, float, float, float, float]], **changes) -> Robot:
    """An arm of standard rows: ``R`` or ``P``, a (mm), alpha (deg), d (mm), lower and upper (deg or mm)."""
    kind, a, alpha, d, lower, upper = zip(*rows)
    sliding = np.array([each == "P" for each in kind])
    unit = np.where(sliding, 1e-3, DEG)
    values = {
        "name": "made",
        "title": "made up",
        "convention": "standard",
        "a": np.array(a) / 1000,
        "alpha": np.array(alpha) * DEG,
        "d": np.array(d) / 1000,
        "direction": np.ones(len(rows)),
        "offset": np.zeros(len(rows)),
        "sliding": sliding,
        "lower": np.array(lower) * unit,
        "upper": np.array(upper) * unit,
    }
    return Robot(**(values | changes))


def scara() -> Robot:
    """Two parallel axes, a slide downwards and a turn about it."""
    return made_of(
        [
            ("R", 325, 0, 200, -130, 130),
            ("R", 225, 180, 0, -145, 145),
            ("P", 0, 0, 0, 0, 180),
            ("R", 0, 0, 20, -360, 360),
        ]
    )


def gantry() -> Robot:
    """Three slides at right angles, without any link lengths."""
    return made_of(
        [("P", 0, -90, 0, 0, 1200), ("P", 0, 90, 0, 0, 800), ("P", 0, 0, 0, 0, 500)],
        offset=np.array([0, -90, 0]) * DEG,
        direction=np.array([1.0, -1, 1]),
    )


def palletiser() -> Robot:
    """Four joints that move five rows: the wrist stays level whatever joints 2 and 3 do."""
    rows = [
        *(("R", 150, -90, 450, -170, 170), ("R", 600, 0, 0, -130, 10), ("R", 600, 0, 0, -10, 150)),
        *(("R", 100, -90, 0, -175, 175), ("R", 0, 0, 120, -300, 300)),
    ]
    coupling = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, -1, 1, 0], [0, 0, -1, 0], [0, 0, 0, 1]])
    limits = np.array([[-170, -130, -10, -300], [170, 10, 150, 300]]) * DEG
    return made_of(rows, coupling=coupling, lower=limits[0], upper=limits[1])


def five_axis() -> Robot:
    """Shoulder, elbow, wrist pitch and roll: a direction of the tool, but no turn about it."""
    rows = [("R", 0, 90, 300, -170, 170), ("R", 350, 0, 0, -10, 170), ("R", 300, 0, 0, -150, 150)]
    return made_of([*rows, ("R", 0, 90, 0, -150, 150), ("R", 0, 0, 90, -180, 180)])


def number(low: float, high: float):
    return st.floats(low, high, allow_nan=False)


def six(low: float, high: float):
    return st.lists(number(low, high), min_size=6, max_size=6).map(np.array)


@st.composite
def arms(draw, orthogonal_wrist: bool = False) -> Robot:
    """Wrist-partitioned arms with parallel axes 2 and 3, in both conventions, with every optional entry of a table."""
    convention = draw(st.sampled_from(["standard", "modified"]))
    right = st.sampled_from([-90.0, 90.0])
    wrist = right if orthogonal_wrist else st.one_of(right, number(35, 145), number(-145, -35))
    alpha = [
        draw(st.one_of(right, number(30, 150))),
        draw(st.sampled_from([0.0, 180.0])),
        draw(st.one_of(right, number(-120, -40))),
        draw(wrist),
        draw(wrist),
    ]
    lengths = [draw(number(-0.3, 0.3)), draw(number(0.1, 1.0)), draw(number(-0.15, 0.15)), 0.0, 0.0]
    end_a, end_alpha = draw(number(-0.2, 0.2)), draw(number(-180, 180))
    if convention == "standard":
        a, alpha = [*lengths, end_a], [*alpha, end_alpha]
    else:
        a, alpha = [end_a, *lengths], [end_alpha, *alpha]
    d = [draw(number(-0.5, 0.5)), draw(number(-0.2, 0.2)), draw(number(-0.2, 0.2)), draw(number(0.2, 1.0)), 0.0]
    return Robot(
        name="drawn",
        title="drawn at random",
        convention=convention,
        a=a,
        alpha=np.array(alpha) * DEG,
        d=[*d, draw(number(-0.3, 0.3))],
        direction=draw(st.lists(st.sampled_from([-1.0, 1.0]), min_size=6, max_size=6)),
        offset=draw(six(-np.pi, np.pi)),
        lower=draw(six(-350 * DEG, -30 * DEG)),
        upper=draw(six(30 * DEG, 350 * DEG)),
        base=placement(draw(six(-2, 2))[:3], draw(six(-np.pi, np.pi))[:3]),
        flange=placement(draw(six(-0.3, 0.3))[:3], draw(six(-np.pi, np.pi))[:3]),
        tool=placement(draw(six(-0.3, 0.3))[:3], draw(six(-np.pi, np.pi))[:3]),
    )


@st.composite
def chains(draw, least: int = 1, most: int = 10, coupled: bool = True) -> Robot:
    """Arms of any number of joints that turn or slide, some with a coupling, in both conventions."""
    rows = draw(st.integers(least, most))
    joints = draw(st.integers(max(least, rows - 1), rows)) if coupled else rows

    def numbers(low: float, high: float, count: int = rows) -> np.ndarray:
        return np.array(draw(st.lists(number(low, high), min_size=count, max_size=count)))

    coupling = None
    if joints < rows or (coupled and draw(st.booleans())):
        coupling = np.eye(rows, joints) + np.tril(np.round(numbers(-1, 1, rows * joints).reshape(rows, joints)), -1)
    sliding = np.array(draw(st.lists(st.booleans(), min_size=rows, max_size=rows)))
    endless = np.array(draw(st.lists(st.booleans(), min_size=joints, max_size=joints)))
    return Robot(
        name="drawn",
        title="drawn at random",
        convention=draw(st.sampled_from(["standard", "modified"])),
        a=np.append(0.1, numbers(-0.5, 0.5)[1:]),
        alpha=numbers(-np.pi, np.pi),
        d=numbers(-0.5, 0.5),
        direction=draw(st.lists(st.sampled_from([-1.0, 1.0]), min_size=rows, max_size=rows)),
        offset=numbers(-np.pi, np.pi),
        lower=numbers(-3, -0.1, joints),
        upper=numbers(0.1, 3, joints),
        sliding=sliding,
        coupling=coupling,
        continuous=endless & ~sliding[:joints],
        base=placement(numbers(-2, 2, 3), numbers(-3, 3, 3)),
        flange=placement(numbers(-0.3, 0.3, 3), numbers(-3, 3, 3)),
        tool=placement(numbers(-0.3, 0.3, 3), numbers(-3, 3, 3)),
    )


@st.composite
def joints_within(draw, robot: Robot) -> np.ndarray:
    """Joint values (n,) within the robot's limits."""
    unit = st.lists(number(0, 1), min_size=robot.joints, max_size=robot.joints)
    return robot.lower + np.array(draw(unit)) * (robot.upper - robot.lower)


def joints_at_random(robot: Robot, random: np.random.Generator, count: int) -> np.ndarray:
    """Uniform joint values (count, n) within the robot's limits."""
    return random.uniform(robot.lower, robot.upper, (count, robot.joints))


def margin(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Distance from singularities: the smallest of |sin wrist|, |sin elbow| and |shoulder| / 1 m."""
    factors: DeterminantFactors = determinant_factors(robot, q)
    parts = [np.sin(factors.wrist), np.sin(factors.elbow), factors.shoulder]
    return np.abs(parts).min(axis=0)


def dh_matrix(convention: str, a: float, alpha: float, d: float, theta: float) -> np.ndarray:
    """One row's transform, in the closed form that the textbooks print."""
    ca, sa, ct, st_ = np.cos(alpha), np.sin(alpha), np.cos(theta), np.sin(theta)
    if convention == "standard":
        return np.array(
            [[ct, -st_ * ca, st_ * sa, a * ct], [st_, ct * ca, -ct * sa, a * st_], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return np.array(
        [[ct, -st_, 0, a], [st_ * ca, ct * ca, -sa, -sa * d], [st_ * sa, ct * sa, ca, ca * d], [0, 0, 0, 1]]
    )


def tools_by_hand(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Tool poses (n, 4, 4) of joints (n, joints), from standard rows, with slides and couplings."""
    u = q if robot.coupling is None else q @ robot.coupling.T
    T = np.tile(robot.base, (len(q), 1, 1))
    for k in range(robot.rows):
        moved = robot.direction[k] * u[:, k]
        turned, along = (0 * moved, moved) if robot.sliding[k] else (moved, 0 * moved)
        c, s = np.cos(turned + robot.offset[k]), np.sin(turned + robot.offset[k])
        ca, sa, a = np.cos(robot.alpha[k]), np.sin(robot.alpha[k]), robot.a[k]
        step = np.zeros((len(q), 4, 4))
        step[:, 0] = np.stack([c, -s * ca, s * sa, a * c], axis=1)
        step[:, 1] = np.stack([s, c * ca, -c * sa, a * s], axis=1)
        step[:, 2, 1], step[:, 2, 2], step[:, 2, 3], step[:, 3, 3] = sa, ca, robot.d[k] + along, 1
        T = T @ step
    return T @ robot.tool


def frame_by_hand(robot: Robot, q: np.ndarray, frame: int) -> np.ndarray:
    """Frame after joint ``frame``, base included, flange and tool not."""
    T = robot.base.copy()
    for k in range(frame):
        theta = robot.direction[k] * q[k] + robot.offset[k]
        T = T @ dh_matrix(robot.convention, robot.a[k], robot.alpha[k], robot.d[k], theta)
    return T


class PinocchioArm:
    """The same arm in Pinocchio: joints move about or along +-z, all else of the table goes into their placements."""

    def __init__(self, robot: Robot):
        self.coupling = np.eye(robot.rows) if robot.coupling is None else robot.coupling
        self.model = pin.Model()
        before = pin.SE3(robot.base[:3, :3], robot.base[:3, 3])
        parent = 0
        for k in range(robot.rows):
            across = pin.SE3(pin.utils.rotate("x", robot.alpha[k]), np.array([robot.a[k], 0, 0]))
            along = pin.SE3(np.eye(3), np.array([0, 0, robot.d[k]]))
            offset = pin.SE3(pin.utils.rotate("z", robot.offset[k]), np.zeros(3))
            modified = robot.convention == "modified"
            kind = pin.JointModelPrismaticUnaligned if robot.sliding[k] else pin.JointModelRevoluteUnaligned
            axis = kind(np.array([0, 0, robot.direction[k]]))
            parent = self.model.addJoint(parent, axis, before * across if modified else before, f"joint_{k + 1}")
            before = offset * along if modified else offset * along * across
        for T in (robot.flange, robot.tool):
            before = before * pin.SE3(T[:3, :3], T[:3, 3])
        frame = pin.Frame("tool", parent, 0, before, pin.FrameType.OP_FRAME)
        self.tool = self.model.addFrame(frame)
        self.data = self.model.createData()

    def forward(self, q: np.ndarray) -> np.ndarray:
        """Tool poses (N, 4, 4)."""
        poses = np.empty((len(q), 4, 4))
        for pose, row in zip(poses, q @ self.coupling.T):
            pin.forwardKinematics(self.model, self.data, row)
            pose[:] = pin.updateFramePlacement(self.model, self.data, self.tool).homogeneous
        return poses

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        """Jacobians (N, 6, n) at the tool, in the base's orientation, linear rows first."""
        reference = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        rows = [
            pin.computeFrameJacobian(self.model, self.data, row, self.tool, reference) for row in q @ self.coupling.T
        ]
        return np.array(rows).reshape(len(q), 6, -1) @ self.coupling


def pose_errors(A: np.ndarray, B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (m) and angle (rad) between poses (..., 4, 4)."""
    distance = np.linalg.norm(A[..., :3, 3] - B[..., :3, 3], axis=-1)
    chord = np.linalg.norm(A[..., :3, :3] - B[..., :3, :3], axis=(-1, -2))
    return distance, 2 * np.arcsin(np.minimum(chord / np.sqrt(8), 1.0))
