"""Do verdicts of motions rest on the curve? And does the planner's word hold? Random paths and queries, judged apart.

The same generators and judgements as the tests', at full size.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from pathlib import Path

import coal
import numpy as np
from ompl import base, geometric, util

from er3a import load_robot, load_scene
from er3a.collision.bodies import Bodies
from er3a.collision.clearance import clearance
from er3a.planning.timing import joint_limits
from er3a.planning.way_around import PlanningTask, WayAround, way_around
from testing.hard_scenes import hard_scenes
from testing.motion_cases import ASSUMED, JOINT_KINDS, TOOL_KINDS, Tally, compare, looked_at, random_spec
from testing.motion_oracle import GRAZING, GRAZING_RAD, POINTS, TOUCH

ROBOTS = ("er3_600", "er3a_c60")
PATHS = {**dict.fromkeys(JOINT_KINDS, 100), **dict.fromkeys(TOOL_KINDS, 40)}  # per robot
SAMPLES = (2, 500)
QUERIES, SEED, DENSE, OTHER_S = 25, 20261120, 1001, 60.0
FREE = 0.005  # m, by which both ends of a query are clear


def path_rows() -> tuple[list[str], list[str]]:
    """Rows of the table, and in words what is missed or invented."""
    rows, wrong = [], []
    with tempfile.TemporaryDirectory() as folder:
        for kind, count in PATHS.items():
            tallies = {samples: Tally() for samples in SAMPLES}
            for name in ROBOTS:
                robot, random = load_robot(name), np.random.default_rng([SEED, len(rows)])
                for number in range(count):
                    spec, written = random_spec(robot, kind, random, Path(folder))
                    seen = looked_at(robot, spec, POINTS)
                    for samples, tally in tallies.items():
                        found = compare(robot, spec, written, samples, tally, seen)
                        wrong += [f"{name}, {kind} {number}, samples {samples}: {text}" for text in found]
            rows += [row(kind, samples, tally) for samples, tally in tallies.items()]
            print(rows[-2:], wrong, flush=True)
    return rows, wrong


def row(kind: str, samples: int, tally: Tally) -> str:
    """A line of the table."""
    limits, speeds, accelerations = (f"{a:,} / {b} / {c}" for a, b, c in zip(tally.stretches, tally.missed, tally.invented))
    crossings = f"{tally.crossings:,} / {tally.missed_crossings} / {tally.invented_crossings}"
    reach = f"{tally.unreachable} / {tally.missed_unreachable}"
    counts = f"{tally.safe} / {tally.wrong_safe} | {tally.undecided}"
    return f"| {kind} | {samples} | {tally.paths} | {crossings} | {limits} | {speeds} | {accelerations} | {reach} | {counts} |"


def query_rows() -> list[str]:
    """How many queries are planned, against another planner, and whether anything touches."""
    rows = []
    for name in ROBOTS:
        robot = load_robot(name)
        limits = joint_limits(robot, ASSUMED, 0.25)
        scenes = {"default": load_scene("data/scenes/table_and_post.yaml"), **hard_scenes(robot)}
        for title, scene in scenes.items():
            bodies, random = Bodies(robot, scene), np.random.default_rng([SEED, len(rows)])
            times, found, other, both, touching, least = [], 0, 0, 0, 0, np.inf
            for number in range(QUERIES):
                start, end = _query(robot, bodies, random)
                begun = time.process_time()
                way = way_around(PlanningTask(robot, bodies, 1e-3, limits, SEED + number), start, end)
                times.append(time.process_time() - begun)
                solved = isinstance(way, WayAround)
                found += solved
                reference = solved or _other_planner(robot, scene, start, end)
                other += reference
                both += solved and reference
                if isinstance(way, WayAround):
                    distance = _dense(robot, scene, way)
                    touching, least = touching + (distance <= 0), min(least, distance)
            share = 100.0 * both / max(other, 1)
            rows.append(
                f"| {name} | {title} | {QUERIES} | {found} | {other} | {share:.0f} % | {np.median(times):.2f} "
                f"| {max(times):.1f} | {touching} | {least * 1000:.1f} |"
            )
            print(rows[-1], flush=True)
    return rows


def _query(robot, bodies, random):
    """Two arms that are clear, with something between them on the straight move."""
    while True:
        q = random.uniform(robot.lower, robot.upper, (2, 6)) * 0.9
        if bodies.least(q)[0].min() < FREE:
            continue
        if bodies.least(np.linspace(*q, 40))[0].min() < 0:
            return q


def _other_planner(robot, scene, start, end) -> bool:
    """Whether another planner (BIT*), with distances of its own, finds a way within OTHER_S."""
    space, bounds = base.RealVectorStateSpace(6), base.RealVectorBounds(6)
    for j in range(6):
        bounds.setLow(j, float(robot.lower[j]))
        bounds.setHigh(j, float(robot.upper[j]))
    space.setBounds(bounds)
    info = base.SpaceInformation(space)
    info.setStateValidityChecker(
        lambda state: bool(clearance(robot, np.array([[state[j] for j in range(6)]]), scene).distance[0] > 0)
    )
    info.setStateValidityCheckingResolution(0.005)
    info.setup()
    problem = base.ProblemDefinition(info)
    states = [space.allocState(), space.allocState()]
    for state, q in zip(states, (start, end)):
        for j in range(6):
            state[j] = float(q[j])
    problem.setStartAndGoalStates(*states)
    planner = geometric.BITstar(info)
    planner.setProblemDefinition(problem)
    planner.setup()
    util.noOutputHandler()
    planner.solve(base.timedPlannerTerminationCondition(OTHER_S))
    return bool(problem.hasExactSolution())


def _dense(robot, scene, way: WayAround) -> float:
    """Least distance (m) of the capsules at many times, by Coal's own functions on frames worked out here."""
    q = way.motion.curve.joints(np.linspace(0, way.motion.duration, DENSE))
    return float(clearance(robot, q, scene).distance.min())
