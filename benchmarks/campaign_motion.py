"""Do verdicts of motions rest on the curve? And does the planner's word hold? Random paths and queries, judged apart.

The same generators and judgements as the tests', at full size.
"""

from __future__ import annotations

import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from ompl import base, geometric, util

from er3a import load_robot, load_scene
from er3a.collision.bodies import Bodies
from er3a.planning.timing import joint_limits
from er3a.planning.way_around import PlanningTask, WayAround, way_around
from testing.dense_contacts import Contacts
from testing.evidence import sized
from testing.hard_scenes import hard_scenes
from testing.motion_cases import ASSUMED, JOINT_KINDS, Tally, compare, contacts_of, looked_at, random_spec
from testing.motion_oracle import GRAZING, GRAZING_JERK, GRAZING_RAD, POINTS, SPAN_S, TOUCH, WIDER

ROBOTS = ("er3_600", "er3a_c60")
PATHS = dict.fromkeys((*JOINT_KINDS, "lines"), sized(100))  # per robot
PATHS |= dict.fromkeys(("arcs", "rounded sequences"), sized(40))
SAMPLES = (2, 500)
QUERIES, SEED, DENSE, OTHER_S = sized(30), 20261120, 1001, 20.0
FREE = 0.005  # m, by which both ends of a query are clear


def path_rows(kind: str) -> tuple[list[str], list[str]]:
    """Rows of the table, and in words what is missed or invented."""
    wrong, seed = [], [SEED, list(PATHS).index(kind)]
    tallies = {samples: Tally() for samples in SAMPLES}
    with tempfile.TemporaryDirectory() as folder:
        for name in ROBOTS:
            robot, random = load_robot(name), np.random.default_rng(seed)
            for number in range(PATHS[kind]):
                spec, written = random_spec(robot, kind, random, Path(folder))
                seen = looked_at(robot, spec, POINTS)
                for samples, tally in tallies.items():
                    found = compare(robot, spec, written, samples, tally, seen)
                    wrong += [f"{name}, {kind} {number}, samples {samples}: {text}" for text in found]
    rows = [row(kind, samples, tally) for samples, tally in tallies.items()]
    print(*rows, *wrong, sep="\n", flush=True)
    return rows, wrong


def row(kind: str, samples: int, tally: Tally) -> str:
    """A line of the table."""
    limits, speeds, accelerations, jerks = (
        f"{a:,} / {b} / {c}" for a, b, c in zip(tally.stretches, tally.missed, tally.invented)
    )
    crossings = f"{tally.crossings:,} / {tally.missed_crossings} / {tally.invented_crossings}"
    reach = f"{tally.unreachable} / {tally.missed_unreachable}"
    counts = f"{tally.safe} | {tally.milder} | {tally.undecided}"
    found = (crossings, limits, speeds, accelerations, jerks, reach, counts)
    return f"| {kind} | {samples} | {tally.paths} | {' | '.join(found)} |"


def query_rows(name: str) -> list[str]:
    """How many queries are planned, against another planner, and whether anything touches."""
    rows, robot = [], load_robot(name)
    limits = joint_limits(robot, ASSUMED, 0.25)
    scenes = {"default": load_scene("data/scenes/table_and_post.yaml"), **hard_scenes(robot)}
    for title, scene in scenes.items():
        bodies, random = Bodies(robot, scene), np.random.default_rng([SEED, len(rows)])
        apart = contacts_of(robot, scene)
        times, found, other, both, touching, least = [], 0, 0, 0, 0, np.inf
        for number in range(QUERIES):
            start, end = _query(robot, bodies, random)
            begun = time.process_time()
            way = way_around(PlanningTask(robot, bodies, 1e-3, limits, SEED + number), start, end)
            times.append(time.process_time() - begun)
            solved = isinstance(way, WayAround)
            found += solved
            reference = solved or _other_planner(apart, robot, start, end)
            other += reference
            both += solved and reference
            if isinstance(way, WayAround):
                distance = float(apart.least(way.motion.joints(np.linspace(0, way.motion.duration, DENSE))).min())
                touching, least = touching + (distance <= 0), min(least, distance)
        rows.append(
            f"| {name} | {title} | {QUERIES} | {found} | {other} | {100.0 * both / max(other, 1):.1f} % "
            f"| {np.median(times):.2f} | {max(times):.1f} | {touching} | {least * 1000:.1f} |"
        )
        print(rows[-1], flush=True)
    return rows


def _query(robot, bodies, random):
    """Two arms that are clear, with something between them on the straight move."""
    while True:
        q = random.uniform(robot.lower, robot.upper, (2, 6)) * 0.9
        if bodies.min_distance(q)[0].min() < FREE:
            continue
        if bodies.min_distance(np.linspace(*q, 40))[0].min() < 0:
            return q


def _other_planner(apart: Contacts, robot, start, end) -> bool:
    """Whether another planner (BIT*), with distances of its own, finds a way within OTHER_S."""
    space, bounds = base.RealVectorStateSpace(6), base.RealVectorBounds(6)
    for j in range(6):
        bounds.setLow(j, float(robot.lower[j]))
        bounds.setHigh(j, float(robot.upper[j]))
    space.setBounds(bounds)
    info = base.SpaceInformation(space)
    info.setStateValidityChecker(lambda state: bool(apart.least(np.array([state[j] for j in range(6)]))[0] > 0))
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


PAGE = """# Motions

Written by `make campaigns ARGS=motion`; the tests hold smaller forms of both tables.

## Nothing is missed, whatever the samples

Random paths of {robots}, judged at `samples: 2` and 500, against {points:,} even points of an oracle that
imports nothing of er3a (`testing/motion_oracle.py`): laws of time, rounded corners and rotations are written down once
more, the joints of paths of the tool follow from plane trigonometry, speeds and accelerations are differences of
angles, jerks means over {jerk_ms:g} ms of them. About two paths of five have a limit of jerk, half of them known
accelerations instead of assumed ones. In each cell: what the oracle finds / what of that is missed / what is invented.
Crossings are changes of sign of the three singular distances, matched one to one (for moves of the joints; a path of
the tool that meets a singular pose is left out of the comparison, because which branch goes on behind it is a choice).
Limits, speeds, accelerations and jerks are stretches of a joint. *Milder* are verdicts milder than what the oracle
finds, assumed limits told from known ones. Grazing is left open within {grazing_rad:g} rad of a joint limit,
{grazing:g} of a limit of speed or acceleration, {grazing_jerk:g} of a limit of jerk, {touch:g} rad or m between two
crossings next to each other. Of jerks shorter than those means the oracle sees only a part; an
acceleration of the tool's paths beyond its limit for fewer than {wider} points has to be so on their mean. Seed {seed}.

| paths | samples | number | crossings | limits | speeds | accelerations | jerks | unreachable / contradicted | safe | milder | undecided |
|---|---|---|---|---|---|---|---|---|---|---|---|
{rows}

Contradictions: {wrong}.

## A way around

{queries} random queries per robot and scene: both ends {free:g} mm clear, something between them on the straight move
(`testing/hard_scenes.py`). *Planned* is what er3a finds and proves; *solvable* adds what BIT* of OMPL finds in
{other:g} s with distances of its own; *touching* are planned motions that come into contact at one of {dense} even
times, by Coal on frames worked out apart (`testing/dense_contacts.py`). Times are the processor's.

| robot | scene | queries | planned | solvable | of these planned | median (s) | longest (s) | touching | least clearance (mm) |
|---|---|---|---|---|---|---|---|---|---|
{query_rows}
"""  # noqa: E501


def table() -> str:
    """The evidence as Markdown."""
    with ProcessPoolExecutor(2) as processes:
        queries = [processes.submit(query_rows, name) for name in ROBOTS]
        parts = list(processes.map(path_rows, reversed(PATHS)))[::-1]
    rows, wrong = ([text for part in parts for text in part[k]] for k in range(2))
    return PAGE.format(
        robots=" and ".join(ROBOTS),
        points=POINTS,
        grazing_rad=GRAZING_RAD,
        grazing=GRAZING,
        grazing_jerk=GRAZING_JERK,
        jerk_ms=3000 * SPAN_S,
        touch=TOUCH,
        wider=WIDER,
        seed=SEED,
        rows="\n".join(rows),
        wrong="; ".join(wrong) or "none",
        queries=QUERIES,
        free=FREE * 1000,
        other=OTHER_S,
        dense=DENSE,
        query_rows="\n".join(text for rows_of_robot in queries for text in rows_of_robot.result()),
    )
