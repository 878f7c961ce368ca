"""Distances against Coal's and FCL's own, contacts along motions against dense sampling, speed against Pinocchio's."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from er3a import load_robot, load_scene
from er3a.collision.bodies import Bodies
from er3a.collision.distances import FREE, free_between
from testing.collision_peers import SHAPES, Outsider, Peer, coal_distance, fcl_distance, own_distance
from testing.evidence import sized

ROBOTS = {
    "er3a_c60": "data/scenes/table_and_post.yaml",
    "er3a_c60_article": "data/scenes/wall_and_low_floor.yaml",
    "er3_600": "data/scenes/table_and_post.yaml",
}
PAIRS, MOTIONS, SEED, SAMPLES = sized(400), sized(1000), 20261121, sized(10_000)
DEPTH = 1e-4  # m, of the dense check


def distances(kind: str, random: np.random.Generator) -> tuple[float, float, float, int]:
    """Greatest differences (m) from Coal, apart or shallow, and deep; from FCL where apart; how many are deep."""
    apart, deep, of_fcl, count = 0.0, 0.0, 0.0, 0
    for number in range(PAIRS):
        a, b = Outsider(kind, random), Outsider(SHAPES[number % len(SHAPES)], random)
        found, inside = own_distance(a.own, b.own)
        theirs = coal_distance(a, b)
        if inside:
            deep, count = max(deep, abs(found - theirs)), count + 1
        else:
            apart = max(apart, abs(found - theirs))
        if found > 1e-3:
            of_fcl = max(of_fcl, abs(found - fcl_distance(a, b)))
    return apart, deep, of_fcl, count


def contacts(bodies: Bodies, peer: Peer, random: np.random.Generator) -> tuple[int, int, int, int]:
    """Motions proven free, those that meet, undecided ones; and proven ones in which Pinocchio's loop finds contact."""
    robot, counts, wrong = bodies.robot, [0, 0, 0], 0
    for _ in range(MOTIONS):
        a = random.uniform(robot.lower, robot.upper)
        b = np.clip(a + random.uniform(-0.6, 0.6, 6), robot.lower, robot.upper)
        found = free_between(bodies.layout, a, b, DEPTH, 100_000)[0]
        counts[found] += 1
        along = a + np.linspace(0, 1, 400)[:, None] * (b - a)
        met = any(peer.collides(each) for each in along)
        wrong += met if found == FREE else 0
    return (*counts, wrong)


def timed(work: Callable[[], object]) -> float:
    """Least processor time of three runs, s."""
    times = []
    for _ in range(3):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def speed(bodies: Bodies, peer: Peer, random: np.random.Generator) -> tuple[int, float, float, float, int]:
    """Pairs; µs per arm of a path of 10 000: Pinocchio's loop, ours, and ours with the proof between; disagreements."""
    robot = bodies.robot
    ends = random.uniform(robot.lower, robot.upper, (21, 6)) * 0.8
    s = np.linspace(0, 20, SAMPLES)
    q = np.stack([np.interp(s, np.arange(21), ends[:, k]) for k in range(6)], axis=1)
    bodies.overlaps(q[:10])
    theirs = timed(lambda: [peer.collides(each) for each in q])
    ours = timed(lambda: bodies.overlaps(q))
    proof = timed(lambda: [free_between(bodies.layout, a, b, DEPTH, 10_000) for a, b in pairwise(q)])
    differ = int((bodies.overlaps(q)[::20] != [peer.all_pairs(each) for each in q[::20]]).any(axis=1).sum())
    return len(bodies.pairs), *(1e6 * each / SAMPLES for each in (theirs, ours, proof)), differ


def table() -> str:
    """The evidence as Markdown."""
    lines = [
        "# Collisions against outsiders",
        "",
        f"Distances of {PAIRS} random pairs for each kind of body (the other of any kind) against Coal's and FCL's,",
        "greatest differences. *Deep*: where cores, of a capsule its line, overlap, so that the depth is compared.",
        "",
        "| body | apart or shallow, Coal (µm) | deep, Coal (µm) | deep pairs | apart, FCL (µm) |",
        "|---|---|---|---|---|",
    ]
    random = np.random.default_rng(SEED)
    for kind in SHAPES:
        apart, deep, of_fcl, count = distances(kind, random)
        lines.append(f"| {kind} | {apart * 1e6:.2g} | {deep * 1e6:.2g} | {count} | {of_fcl * 1e6:.2g} |")
    lines += [
        "",
        f"Straight joint moves ({MOTIONS} a robot, up to 34 deg per joint) in the default scenes, judged between",
        f"their ends, no overlap deeper than {DEPTH * 1e3:g} mm to be missed; Pinocchio's loop over 400 points is the",
        "check. *Wrong*: proven free, with a contact. *Speed*: a path of 10 000 arms, all pairs, in µs per arm:",
        "Pinocchio's C++ loop called for each arm; ours; ours with all moves between them proven besides.",
        "",
        "| robot | free | meet | undecided | wrong | pairs | Pinocchio | ours | with proof | ratio | ratio with proof "
        "| arms that differ |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, scene in ROBOTS.items():
        random = np.random.default_rng(SEED)
        bodies = Bodies(load_robot(name), load_scene(scene))
        peer = Peer(bodies)
        free, meet, open_, wrong = contacts(bodies, peer, random)
        pairs, theirs, ours, proof, differ = speed(bodies, peer, random)
        lines.append(
            f"| {name} | {free} | {meet} | {open_} | {wrong} | {pairs} | {theirs:.1f} | {ours:.1f} | {proof:.1f} | "
            f"{ours / theirs:.2f} | {proof / theirs:.2f} | {differ} |"
        )
    lines += ["", f"Seed {SEED}. Written by `make campaigns ARGS=collision`."]
    return "\n".join(lines) + "\n"
