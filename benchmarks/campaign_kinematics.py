"""Forward kinematics and Jacobian against Pinocchio, and the closed-form inverse against its own poses."""

from __future__ import annotations

import time

import numpy as np
import pinocchio

from er3a import forward, jacobian, load_robot
from er3a.geometry.transforms import rotation_angle
from er3a.kinematics.wrist_partitioned import solve_slots
from testing.evidence import sized

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
POSES, ROUND_TRIPS, SEED = sized(10_000), sized(1_000_000), 20261120


def pinocchio_model(robot):
    """The same arm as a Pinocchio model, built from the table's numbers alone; q of the model is theta."""

    def step(rpy, xyz):
        return pinocchio.SE3(pinocchio.rpy.rpyToMatrix(*rpy), np.array(xyz, dtype=float))

    model = pinocchio.Model()
    parent, before = 0, pinocchio.SE3(robot.base)
    for k in range(6):
        across = step((robot.alpha[k], 0.0, 0.0), (robot.a[k], 0.0, 0.0))  # Tx(a) and Rx(alpha) commute
        along = step((0.0, 0.0, 0.0), (0.0, 0.0, robot.d[k]))
        placement = before if robot.convention == "standard" else before * across
        parent = model.addJoint(parent, pinocchio.JointModelRZ(), placement, f"joint_{k + 1}")
        before = along * across if robot.convention == "standard" else along
    tool = before * pinocchio.SE3(robot.tool)
    frame = model.addFrame(pinocchio.Frame("tool", parent, tool, pinocchio.FrameType.OP_FRAME))
    return model, frame


def agreement(robot, random) -> tuple[float, float, float]:
    """Worst position (m), rotation (rad) and Jacobian differences on random poses."""
    model, frame = pinocchio_model(robot)
    data = model.createData()
    q = random.uniform(robot.lower, robot.upper, (POSES, 6))
    T, J = forward(robot, q), jacobian(robot, q)
    theirs, their_jacobian = np.empty_like(T), np.empty_like(J)
    for n in range(POSES):
        theta = robot.direction * q[n] + robot.offset
        pinocchio.framesForwardKinematics(model, data, theta)
        theirs[n] = data.oMf[frame].homogeneous
        world = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        their_jacobian[n] = pinocchio.computeFrameJacobian(model, data, theta, frame, world) * robot.direction
    position = np.abs(T[:, :3, 3] - theirs[:, :3, 3]).max()
    rotation = rotation_angle(T[:, :3, :3], theirs[:, :3, :3]).max()
    return float(position), float(rotation), float(np.abs(J - their_jacobian).max())


def round_trips(robot, random) -> tuple[float, float, float]:
    """Worst pose residual (m, or entry of R), share of poses whose own joints are found, time a pose (us)."""
    q = random.uniform(robot.lower, robot.upper, (ROUND_TRIPS, 6))
    T = forward(robot, q)
    zeros = np.zeros_like(q)
    solve_slots(robot, T[:1], zeros[:1])
    start = time.process_time()
    solutions = solve_slots(robot, T, zeros)[0]
    elapsed = time.process_time() - start
    rows, slots = np.nonzero(np.isfinite(solutions).all(axis=-1))
    residual = np.abs(forward(robot, solutions[rows, slots]) - T[rows]).max()
    away = np.abs((solutions - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)
    found = (np.nanmin(away, axis=1) < 1e-6).mean()
    return float(residual), float(found), elapsed / ROUND_TRIPS * 1e6


def table() -> str:
    """The evidence as Markdown."""
    random = np.random.default_rng(SEED)
    lines = [
        "# Kinematics against Pinocchio, and round trips",
        "",
        f"Pinocchio {pinocchio.__version__}; {POSES:,} random poses per robot for the agreement, {ROUND_TRIPS:,} for",
        "the round trips pose -> all solutions -> pose (processor time, one thread). Poses of random joints within the",
        f"limits, seed {SEED}. Written by `make campaigns ARGS=kinematics`.",
        "",
        "| robot | position (m) | rotation (rad) | Jacobian (m, 1) | inverse: worst residual (m, 1) "
        "| own joints found to 1e-6 rad | inverse (us a pose) |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in ROBOTS:
        robot = load_robot(name)
        position, rotation, difference = agreement(robot, random)
        residual, found, time_us = round_trips(robot, random)
        lines.append(
            f"| {name} | {position:.1e} | {rotation:.1e} | {difference:.1e} | {residual:.1e} "
            f"| {found:.4%} | {time_us:.1f} |"
        )
    return "\n".join(lines) + "\n"
