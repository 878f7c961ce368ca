"""Times beside the peers' in the same run, with accuracy beside each time.

One thread, pinned to one processor, except where the table says two. What is compared runs in turn, round by round, so
that other work on the machine meets all alike; times are the least of all rounds, wall time.
"""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from pathlib import Path

import ik_geo
import numpy as np
import pinocchio
import roboticstoolbox as rtb
import ruckig
import ssik
from eaik.IK_DH import DhRobot
from eaik.IK_HP import HPRobot
from py_opw_kinematics import KinematicModel
from py_opw_kinematics import Robot as OpwRobot
from scipy.spatial.transform import RigidTransform

from benchmarks.campaign_kinematics import pinocchio_model
from er3a import forward, inverse, inverse_batch, jacobian, load_robot, solve
from er3a.geometry.transforms import rotation_angle
from er3a.kinematics.chain import constant_links
from er3a.kinematics.solutions import Solutions
from er3a.planning.timing import joint_limits, straight
from er3a.sampling.grid import make_grid
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import tally_blocks
from testing.evidence import sized

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
PARTS = 100
PEERS = ("eaik", "ik-geo", "ssik", "py-opw-kinematics", "ruckig", "roboticstoolbox-python", "pin", "numba")
SINGLE = (("er3a_c60", "spherical_two_parallel"), ("ur5e", "three_parallel_two_intersecting"), ("panda", ""))
POSES, FORWARD_POSES, NUMERICAL_POSES, PEER_POSES = (sized(n) for n in (100_000, 1_000_000, 10_000, 5_000))
SINGLE_POSES, MOVES = sized(300), 40
SEED, ROUNDS = 20261120, 7
THREAD_ROUNDS = 40


def least_times(count: int, *runs: Callable[[], object], rounds: int = ROUNDS) -> list[float]:
    """Least time of each run over several rounds, ns for each of ``count`` items; a first round is not counted."""
    least = [np.inf] * len(runs)
    for number in range(rounds + 1):
        for k, run in enumerate(runs):
            start = time.perf_counter()
            run()
            if number:
                least[k] = min(least[k], time.perf_counter() - start)
    return [value / count * 1e9 for value in least]


def pinned(processors: set[int]):
    """Keep this process on these processors, where the system can."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, processors)


def errors(T: np.ndarray, asked: np.ndarray) -> str:
    """Worst position (m) and rotation (rad) error, as text."""
    position = np.linalg.norm(T[..., :3, 3] - asked[..., :3, 3], axis=-1).max()
    return f"{position:.1e} / {rotation_angle(T[..., :3, :3], asked[..., :3, :3]).max():.1e}"


def inverse_rows(robot, random) -> list[str]:
    """All solutions of random reachable poses: EAIK, one thread, two threads."""
    T = forward(robot, random.uniform(robot.lower, robot.upper, (POSES, 6)))
    peer = DhRobot(np.array(robot.alpha), np.array(robot.a), np.array(robot.d))
    found = peer.IK_batched(T[:PEER_POSES], 1)
    rows = [
        (n, np.asarray(theta)) for n, each in enumerate(found) for theta, rough in zip(each.Q, each.is_LS) if not rough
    ]
    back = forward(robot, robot.direction * (np.array([theta for _, theta in rows]) - robot.offset))
    theirs, one, turns = least_times(
        POSES,
        lambda: peer.IK_batched(T, 1),
        lambda: inverse_batch(robot, T),
        lambda: inverse_batch(robot, T, turns=True),
    )
    solved = inverse_batch(robot, T)
    index, slot = np.nonzero(solved.solved)
    accuracy = errors(forward(robot, solved.q[index, slot]), T[index])
    asked = T[[n for n, _ in rows]]
    lines = [
        f"| {robot.name} | EAIK `IK_batched`, singular handling on | {theirs:.0f} | 1 | {errors(back, asked)} |",
        f"| {robot.name} | er3a `inverse_batch` | {one:.0f} | {theirs / one:.1f} | {accuracy} |",
        f"| {robot.name} | the same, with turns | {turns:.0f} | {theirs / turns:.1f} | {accuracy} |",
    ]
    return lines + (two_thread_rows(robot, T, solved.q) if os.cpu_count() > 1 else [])


def two_thread_rows(robot, T: np.ndarray, q: np.ndarray) -> list[str]:
    """Two threads on two processors against one, in turn, and how much more work two do in all."""
    work = {1: np.inf, 2: np.inf}

    def run(threads: int) -> Solutions:
        start = time.process_time()
        solved = inverse_batch(robot, T, threads=threads)
        work[threads] = min(work[threads], time.process_time() - start)
        return solved

    pinned({0, 1})
    one, two = least_times(POSES, lambda: run(1), lambda: run(2), rounds=THREAD_ROUNDS)
    equal = np.array_equal(run(2).q, q, equal_nan=True)
    pinned({0})
    return [
        f"| {robot.name} | two threads: {one / two:.2f} times one; processor time {work[2] / work[1]:.2f} of one's "
        f"| {two:.0f} | | {'equal bits' if equal else 'DIFFERS'} |"
    ]


def elementary(robot):
    """The arm as a Robotics Toolbox sequence of elementary transforms, in maker's angles."""
    sequence = rtb.ET.tz(0.0)
    for k in range(6):
        if robot.offset[k]:
            sequence = sequence * rtb.ET.Rz(robot.offset[k])
        sequence = sequence * rtb.ET.Rz(flip=bool(robot.direction[k] < 0), qlim=[robot.lower[k], robot.upper[k]])
        for part, value in ((rtb.ET.tz, robot.d[k]), (rtb.ET.tx, robot.a[k]), (rtb.ET.Rx, robot.alpha[k])):
            if value:
                sequence = sequence * part(value)
    return sequence


def bare_loops() -> dict[str, Callable]:
    """The same forward kinematics as bare C loops, pose by pose and over blocks; none without a compiler."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        return {}
    library = Path(tempfile.mkdtemp()) / "bare_loop.so"
    flags = ["-O3", "-march=native", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-shared", "-fPIC"]
    if platform.machine() == "x86_64":
        flags.append("-mprefer-vector-width=512")
    source = Path(__file__).with_name("bare_loop.c")
    subprocess.run([compiler, *flags, str(source), "-o", str(library), "-lm"], check=True)
    loaded = ctypes.CDLL(str(library))

    def call(function, robot, q, out):
        function.restype = None
        arrays = (q, robot.direction, robot.offset, constant_links(robot), out)
        function(ctypes.c_size_t(len(q)), *(a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in arrays))

    words = {"pose by pose": loaded.forward, "over blocks of poses": loaded.forward_blocks}
    return {key: partial(call, function) for key, function in words.items()}


def forward_rows(robot, random) -> list[str]:
    """Forward kinematics of a million poses."""
    q = random.uniform(robot.lower, robot.upper, (FORWARD_POSES, 6))
    sequence, loops = elementary(robot), bare_loops()
    T, out, other = forward(robot, q), np.empty((FORWARD_POSES, 4, 4)), np.empty((FORWARD_POSES, 4, 4))

    def in_parts():
        for part in np.split(q, PARTS):
            forward(robot, part, out=out[: len(part)])

    theirs, fresh, reused, parts, *bare = least_times(
        FORWARD_POSES,
        lambda: sequence.eval(q),
        lambda: forward(robot, q),
        lambda: forward(robot, q, out=out),
        in_parts,
        *(partial(loop, robot, q, other) for loop in loops.values()),
    )
    agree = errors(T[:PEER_POSES], sequence.eval(q[:PEER_POSES]))
    lines = [
        f"| {robot.name} | Robotics Toolbox `ets.eval` | {theirs:.1f} | 1 | |",
        f"| {robot.name} | er3a `forward`, new output | {fresh:.1f} | {theirs / fresh:.1f} | {agree} |",
        f"| {robot.name} | er3a `forward`, `out=` reused | {reused:.1f} | {theirs / reused:.1f} | {agree} |",
        f"| {robot.name} | er3a `forward`, {FORWARD_POSES // PARTS:,} poses at a time, in the same `out=` (in cache) "
        f"| {parts:.1f} | {theirs / parts:.1f} | {agree} |",
    ]
    for words, loop, value in zip(loops, loops.values(), bare):
        loop(robot, q, other)
        note = "equal bits" if np.array_equal(other, T) else f"{errors(other[:PEER_POSES], T[:PEER_POSES])}"
        lines.append(
            f"| {robot.name} | bare C loop {words}: er3a takes {reused / value:.2f} of it | {value:.1f} | | {note} |"
        )
    return lines


def jacobian_rows(robot, random) -> list[str]:
    """Jacobians: er3a's batch against Pinocchio in a loop."""
    q = random.uniform(robot.lower, robot.upper, (POSES, 6))
    model, frame = pinocchio_model(robot)
    data, world = model.createData(), pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
    theta = robot.direction * q[:PEER_POSES] + robot.offset

    def peer():
        return [pinocchio.computeFrameJacobian(model, data, row, frame, world) for row in theta]

    ours, theirs = least_times(1, lambda: jacobian(robot, q), peer)
    ours, theirs = ours / POSES, theirs / PEER_POSES
    apart = np.abs(jacobian(robot, q[:PEER_POSES]) - np.array(peer()) * robot.direction).max()
    return [
        f"| {robot.name} | Pinocchio `computeFrameJacobian`, in a loop | {theirs:.0f} | 1 | |",
        f"| {robot.name} | er3a `jacobian` | {ours:.0f} | {theirs / ours:.1f} | {apart:.1e} (m, 1) |",
    ]


def numerical_rows(robot, random) -> list[str]:
    """One solution for each pose, from the middle of the limits."""
    T = forward(robot, random.uniform(robot.lower, robot.upper, (NUMERICAL_POSES, 6)))
    q0, sequence, lines = (robot.lower + robot.upper) / 2, elementary(robot), []
    few = T[:PEER_POSES]
    for respect in (True, False):
        options = {"q0": q0, "k": 0.1, "tol": 1e-12, "joint_limits": respect}
        found = [sequence.ik_LM(pose, **options) for pose in few]
        theirs, ours = least_times(
            1,
            lambda options=options: [sequence.ik_LM(pose, **options) for pose in few],
            lambda respect=respect: solve(robot, T, q0, respect_limits=respect),
        )
        theirs, ours = theirs / PEER_POSES, ours / NUMERICAL_POSES
        result = solve(robot, T, q0, respect_limits=respect)
        said = np.array([bool(np.all(each.success)) for each in found])
        words = "within limits" if respect else "any angles"
        for name, value, q, asked, solved in (
            ("Robotics Toolbox `ik_LM`", theirs, np.array([np.ravel(each.q) for each in found]), few, said),
            ("er3a `solve`", ours, result.q, T, result.solved),
        ):
            lines.append(
                f"| {robot.name} | {name}, {words} | {value / 1000:.1f} | {theirs / value:.1f} "
                f"| {solved.mean():.2%} | {to_a_nanometre(robot, q, asked):.2%} "
                f"| {errors(forward(robot, q[solved]), asked[solved])} |"
            )
    return lines


def to_a_nanometre(robot, q: np.ndarray, asked: np.ndarray) -> float:
    """Share of poses reached to 1e-9 m and rad."""
    T = forward(robot, q)
    near = np.linalg.norm(T[:, :3, 3] - asked[:, :3, 3], axis=1) < 1e-9
    return float((near & (rotation_angle(T[:, :3, :3], asked[:, :3, :3]) < 1e-9)).mean())


def exponentials(robot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """An arm as EAIK, ik-geo and ssik take it: axes (n, 3) and offsets (n + 1, 3), m, at zero, and the tool's rotation.

    Points of axes that meet the next one are where they meet: the solvers know a wrist by that.
    """
    J, T = jacobian(robot, np.zeros(robot.joints)), forward(robot, np.zeros(robot.joints))
    axes = J[3:].T
    points = T[:3, 3] + np.cross(axes, J[:3].T)
    for k in range(1, robot.joints):
        across = np.cross(axes[k - 1], axes[k])
        if np.linalg.norm(across) > 1e-9 and abs(across @ (points[k] - points[k - 1])) < 1e-9:
            s = np.linalg.lstsq(np.stack([axes[k - 1], -axes[k]], axis=1), points[k] - points[k - 1])[0][0]
            points[k - 1 : k + 1] = points[k - 1] + s * axes[k - 1]
    return axes, np.diff([np.zeros(3), *points, T[:3, 3]], axis=0), T[:3, :3]


def single_rows(name: str, kind: str, random) -> list[str]:
    """All solutions of one pose after the other, with whole turns: er3a and peers."""
    robot = load_robot(name)
    q = random.uniform(robot.lower, robot.upper, (SINGLE_POSES, robot.joints))
    T = forward(robot, q)
    axes, offsets, turned = exponentials(robot)
    asked = T.copy()
    asked[:, :3, :3] = T[:, :3, :3] @ turned.T
    theirs = ssik.Manipulator.from_axes(axes, offsets, limits=np.stack([robot.lower, robot.upper], axis=1))
    runs: dict[str, Callable[[int], object]] = {
        "er3a `inverse`": lambda n: inverse(robot, T[n]).q,
        "er3a `inverse`, from where the arm is": lambda n: inverse(robot, T[n], q[n]).q,
        "ssik `solve`": lambda n: [each.q for each in theirs.solve(asked[n])],
    }
    if kind:
        geo = getattr(ik_geo.Robot, kind)(axes.tolist(), offsets.tolist())
        eaik = HPRobot(axes, offsets)
        runs |= {
            f"ik-geo `{kind}`": lambda n: [row[0] for row in geo.get_ik(asked[n, :3, :3], asked[n, :3, 3])],
            "EAIK `IK`": lambda n: eaik.IK(asked[n]).Q,
        }
    if (
        name == "er3a_c60"
    ):  # the one of these arms that OPW's seven lengths describe; their zero is the arm stretched up
        opw = OpwRobot(KinematicModel(*opw_lengths(robot)), degrees=False)
        poses = [RigidTransform.from_matrix(each) for each in T]
        runs["OPW `inverse`"] = lambda n: opw.inverse(poses[n])
    times = least_times(SINGLE_POSES, *(partial(each_pose, run) for run in runs.values()), rounds=3)
    counts = [np.mean([len(run(n)) for n in range(SINGLE_POSES)]) for run in runs.values()]
    return [f"| {name} | {what} | {ns / 1000:.1f} | {count:.1f} |" for what, ns, count in zip(runs, times, counts)]


def each_pose(run: Callable[[int], object]) -> None:
    """One pose after the other."""
    for n in range(SINGLE_POSES):
        run(n)


def opw_lengths(robot) -> tuple[float, ...]:
    """a1, a2, b, c1, c2, c3, c4 (m) of an arm whose elbow's offset is its third row's length."""
    return (
        robot.a[0],
        -robot.a[2],
        0.0,
        robot.base[2, 3] + robot.d[0],
        robot.a[1],
        robot.d[3],
        robot.last_to_tool[2, 3] + robot.d[5],
    )


def other_rows(random) -> list[str]:
    """Samples a second, and joint moves from rest to rest beside Ruckig's."""
    robot, samples = load_robot("er3a_c60"), sized(64_000_000)
    grid, draw = make_grid(robot, 56), Draw(SEED, samples, 1)
    (sampled,) = least_times(samples, lambda: tally_blocks(robot, grid, draw, [0]), rounds=3)
    limits, moves = joint_limits(robot, np.full(6, 2.0), 0.4), random.uniform(robot.lower, robot.upper, (MOVES, 2, 6))
    made = ruckig.Ruckig(6)

    def theirs(start: np.ndarray, end: np.ndarray) -> float:
        asked, found = ruckig.InputParameter(6), ruckig.Trajectory(6)
        asked.current_position, asked.target_position = start.tolist(), end.tolist()
        asked.max_velocity, asked.max_acceleration = limits.speed.tolist(), limits.acceleration.tolist()
        asked.max_jerk = [float("inf")] * 6
        asked.synchronization = ruckig.Synchronization.Phase
        made.calculate(asked, found)
        return found.duration

    def ours(start: np.ndarray, end: np.ndarray) -> float:
        return float(straight(start, end, limits).duration)

    least = least_times(
        MOVES, lambda: [theirs(*move) for move in moves], lambda: [ours(*move) for move in moves], rounds=3
    )
    longer = max(ours(*move) / theirs(*move) - 1 for move in moves)
    return [
        f"{1e3 / sampled:.0f} million samples a second and thread, drawn, through forward kinematics and counted.",
        "",
        f"A joint move from rest to rest takes er3a {least[1] / 1000:.0f} us, in closed form;",
        f"Ruckig {least[0] / 1000:.0f} us. er3a's lasts at most {longer:.1%} longer.",
        "",
    ]


def table() -> str:
    """The evidence as Markdown."""
    pinned({0})
    random = np.random.default_rng(SEED)
    robots = [load_robot(name) for name in ROBOTS]
    peers = ", ".join(f"{name} {version(name)}" for name in PEERS)
    return "\n".join(
        [
            "# Speed beside the peers, with accuracy",
            "",
            "Random poses of joints within the limits; one thread, pinned to one processor, unless said otherwise;",
            f"least wall time of {ROUNDS} rounds (two threads: {THREAD_ROUNDS}), in which all of a group run in turn.",
            "*Times*: how many times faster than the first row of its group. Errors: worst position (m) / rotation",
            f"(rad). {peers}; seed {SEED}.",
            f"Written by `make campaigns ARGS=speed`, while {os.getloadavg()[0]:.1f} processes wanted the "
            f"{os.cpu_count()} processors; times differ between machines.",
            "",
            f"## All closed-form solutions ({POSES:,} poses; 8 slots, limit verdicts)",
            "",
            "| robot | what | ns a pose | times | errors of all solutions |",
            "|---|---|---|---|---|",
            *(line for robot in (*robots, load_robot("ur5e")) for line in inverse_rows(robot, random)),
            "",
            f"## One pose after the other ({SINGLE_POSES} poses)",
            "",
            "*Solutions*: of the mean pose, within the limits and with whole turns for er3a and ssik; others know no",
            "limits. Without a reference er3a holds the Panda's joint 7 at 0; where a pose has no solution there,",
            "it is held as near to that as one has some.",
            "",
            "| robot | what | us a pose | solutions |",
            "|---|---|---|---|",
            *(line for name, kind in SINGLE for line in single_rows(name, kind, random)),
            "",
            "## Sampling and joint moves",
            "",
            *other_rows(random),
            f"## Forward kinematics ({FORWARD_POSES:,} poses) and Jacobians ({POSES:,})",
            "",
            "The C loops (benchmarks/bare_loop.c) fill memory that is used again.",
            "",
            "| robot | what | ns a pose | times | difference from the peer |",
            "|---|---|---|---|---|",
            *(line for robot in robots for line in forward_rows(robot, random)),
            *(line for robot in robots for line in jacobian_rows(robot, random)),
            "",
            f"## Numerical inverse ({NUMERICAL_POSES:,} poses)",
            "",
            "Robotics Toolbox at its best setting (k = 0.1, tol = 1e-12); er3a to 1e-10 m and rad. *Solved* is what",
            "each says of itself.",
            "",
            "| robot | what | us a pose | times | solved | reached to 1e-9 m and rad | errors of the solved |",
            "|---|---|---|---|---|---|---|",
            *(line for robot in robots for line in numerical_rows(robot, random)),
            "",
        ]
    )
