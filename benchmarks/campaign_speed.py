"""Times beside the peers' in the same run, with accuracy beside each time.

One thread, pinned to one processor, except where the table says two. Times are the least of several runs of wall time.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pinocchio
import roboticstoolbox as rtb
from campaign_kinematics import pinocchio_model
from eaik.IK_DH import DhRobot

from er3a import forward, inverse_batch, jacobian, load_robot, solve
from er3a.kinematics.chain import constant_links
from er3a.kinematics.transforms import rotation_angle

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
POSES, FORWARD_POSES, NUMERICAL_POSES, PEER_POSES, SEED, RUNS = 100_000, 1_000_000, 10_000, 5_000, 20261120, 7


def least_time(run: Callable[[], object], count: int, runs: int = RUNS) -> float:
    """Least time of several runs, ns for each of ``count`` items; the first run is not counted."""
    run()
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times) / count * 1e9


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
    q = random.uniform(robot.lower, robot.upper, (POSES, 6))
    T = forward(robot, q)
    peer = DhRobot(np.array(robot.alpha), np.array(robot.a), np.array(robot.d))
    theirs = least_time(lambda: peer.IK_batched(T, 1), POSES, runs=3)
    found = peer.IK_batched(T[:PEER_POSES], 1)
    rows = [
        (n, np.asarray(theta)) for n, each in enumerate(found) for theta, rough in zip(each.Q, each.is_LS) if not rough
    ]
    back = forward(robot, robot.direction * (np.array([theta for _, theta in rows]) - robot.offset))
    lines = [
        f"| {robot.name} | EAIK `IK_batched`, singular handling on | {theirs:.0f} | 1 "
        f"| {errors(back, T[[n for n, _ in rows]])} |"
    ]
    one = least_time(lambda: inverse_batch(robot, T), POSES)
    solved = inverse_batch(robot, T)
    index, slot = np.nonzero(solved.valid)
    accuracy = errors(forward(robot, solved.q[index, slot]), T[index])
    lines.append(f"| {robot.name} | er3a `inverse_batch` | {one:.0f} | {theirs / one:.1f} | {accuracy} |")
    turns = least_time(lambda: inverse_batch(robot, T, turns=True), POSES)
    lines.append(f"| {robot.name} | the same, with turns | {turns:.0f} | {theirs / turns:.1f} | {accuracy} |")
    if os.cpu_count() > 1:
        pinned({0, 1})
        pair = least_time(lambda: inverse_batch(robot, T, threads=2), POSES)
        pinned({0})
        equal = np.array_equal(inverse_batch(robot, T, threads=2).q, solved.q, equal_nan=True)
        note = "equal bits" if equal else "DIFFERS"
        lines.append(f"| {robot.name} | the same, two threads ({one / pair:.2f} times one) | {pair:.0f} | | {note} |")
    return lines


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


def bare_loop() -> Callable | None:
    """The same forward kinematics as a plain C loop; None without a compiler."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        return None
    folder = tempfile.mkdtemp()
    library = Path(folder) / "bare_loop.so"
    source = Path(__file__).with_name("bare_loop.c")
    flags = ["-O3", "-march=native", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, str(source), "-o", str(library), "-lm"], check=True)
    function = ctypes.CDLL(str(library)).forward
    function.restype = None

    def run(robot, q, out):
        arrays = (q, robot.direction, robot.offset, constant_links(robot), out)
        function(ctypes.c_size_t(len(q)), *(a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in arrays))

    return run


def forward_rows(robot, random) -> list[str]:
    """Forward kinematics of a million poses, and Jacobians."""
    q = random.uniform(robot.lower, robot.upper, (FORWARD_POSES, 6))
    sequence, model_and_frame = elementary(robot), pinocchio_model(robot)
    theirs = least_time(lambda: sequence.eval(q), FORWARD_POSES, runs=2)
    T, out = forward(robot, q), np.empty((FORWARD_POSES, 4, 4))
    few = sequence.eval(q[:PEER_POSES])
    lines = [f"| {robot.name} | Robotics Toolbox `ets.eval` | {theirs:.1f} | 1 | |"]
    reused = least_time(lambda: forward(robot, q, out=out), FORWARD_POSES)
    fresh = least_time(lambda: forward(robot, q), FORWARD_POSES)
    agree = errors(T[:PEER_POSES], few)
    lines.append(f"| {robot.name} | er3a `forward`, `out=` reused | {reused:.1f} | {theirs / reused:.1f} | {agree} |")
    lines.append(f"| {robot.name} | er3a `forward`, new output | {fresh:.1f} | {theirs / fresh:.1f} | {agree} |")
    if (loop := bare_loop()) is not None:
        other = np.empty_like(out)
        bare = least_time(lambda: loop(robot, q, other), FORWARD_POSES)
        agree = errors(other[:PEER_POSES], T[:PEER_POSES])
        lines.append(f"| {robot.name} | bare C loop (er3a takes {reused / bare:.2f} of it) | {bare:.1f} | | {agree} |")
    model, frame = model_and_frame
    data, world = model.createData(), pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
    theta = robot.direction * q[:PEER_POSES] + robot.offset

    def peer():
        return [pinocchio.computeFrameJacobian(model, data, row, frame, world) for row in theta]

    theirs = least_time(peer, PEER_POSES, runs=3)
    ours = least_time(lambda: jacobian(robot, q[:POSES]), POSES)
    apart = np.abs(jacobian(robot, q[:PEER_POSES]) - np.array(peer()) * robot.direction).max()
    lines.append(f"| {robot.name} | Pinocchio `computeFrameJacobian`, in a loop | {theirs:.0f} | 1 | |")
    lines.append(f"| {robot.name} | er3a `jacobian` | {ours:.0f} | {theirs / ours:.1f} | {apart:.1e} (m, 1) |")
    return lines


def numerical_rows(robot, random) -> list[str]:
    """One solution for each pose, from the middle of the limits."""
    T = forward(robot, random.uniform(robot.lower, robot.upper, (NUMERICAL_POSES, 6)))
    q0, sequence, lines = (robot.lower + robot.upper) / 2, elementary(robot), []
    few = T[:PEER_POSES]
    for respect in (True, False):
        options = {"q0": q0, "k": 0.1, "tol": 1e-12, "joint_limits": respect}

        def peer(options=options):
            return [sequence.ik_LM(pose, **options) for pose in few]

        theirs = least_time(peer, PEER_POSES, runs=1)
        found = peer()
        good = np.array([bool(np.all(each.success)) for each in found])
        q = np.array([np.ravel(each.q) for each in found])[good]
        words = "within limits" if respect else "any angles"
        accuracy = f"{good.mean():.2%}, {errors(forward(robot, q), few[good])}"
        lines.append(f"| {robot.name} | Robotics Toolbox `ik_LM`, {words} | {theirs / 1000:.1f} | 1 | {accuracy} |")
        ours = least_time(lambda respect=respect: solve(robot, T, q0, respect_limits=respect), NUMERICAL_POSES)
        result = solve(robot, T, q0, respect_limits=respect)
        accuracy = f"{result.solved.mean():.2%}, {errors(forward(robot, result.q), T)}"
        lines.append(f"| {robot.name} | er3a `solve`, {words} | {ours / 1000:.1f} | {theirs / ours:.1f} | {accuracy} |")
    return lines


def table() -> str:
    """The evidence as Markdown."""
    pinned({0})
    random = np.random.default_rng(SEED)
    robots = [load_robot(name) for name in ROBOTS]
    peers = ", ".join(f"{name} {version(name)}" for name in ("eaik", "roboticstoolbox-python", "pin", "numba"))
    return "\n".join(
        [
            "# Speed beside the peers, with accuracy",
            "",
            "Random poses of joints within the limits; one thread, pinned to one processor, unless said otherwise;",
            f"least wall time of {RUNS} runs. *Times*: how many times faster than the first row of its group. Errors:",
            f"worst position (m) / rotation (rad). {peers}; seed {SEED}.",
            "Written by `make campaigns ARGS=speed`; times differ between machines, and where other work shares the",
            "processors.",
            "",
            f"## All closed-form solutions ({POSES:,} poses; 8 slots, limit verdicts)",
            "",
            "| robot | what | ns a pose | times | errors of all solutions |",
            "|---|---|---|---|---|",
            *(line for robot in robots for line in inverse_rows(robot, random)),
            "",
            f"## Forward kinematics ({FORWARD_POSES:,} poses) and Jacobians",
            "",
            "| robot | what | ns a pose | times | difference from the peer |",
            "|---|---|---|---|---|",
            *(line for robot in robots for line in forward_rows(robot, random)),
            "",
            f"## Numerical inverse ({NUMERICAL_POSES:,} poses)",
            "",
            "Robotics Toolbox at its best setting (k = 0.1, tol = 1e-12); er3a to 1e-10 m and rad.",
            "",
            "| robot | what | us a pose | times | solved, errors |",
            "|---|---|---|---|---|",
            *(line for robot in robots for line in numerical_rows(robot, random)),
            "",
        ]
    )
