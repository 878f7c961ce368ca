"""Random motions past small obstacles: is every contact found, and with how few distance measurements?"""

from __future__ import annotations

import numpy as np

from er3a import forward, load_robot
from er3a.collision.along import clearance_along
from er3a.collision.bodies import Bodies
from er3a.collision.scene import Cylinder, Scene, Sphere
from er3a.geometry.transforms import transform
from er3a.planning.moves import JointMove

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
MOTIONS, DENSE, SEED, DEPTH = 400, 501, 20261120, 1e-3
ENDS = np.array([0.0, 1.0])


def past_an_obstacle(robot, random) -> tuple[JointMove, Scene]:
    """A move of up to 60 deg per joint, and a bead or a wire within 120 mm, along each axis, of the tool's way."""
    a = random.uniform(robot.lower, robot.upper) * 0.7
    move = JointMove(a, a + random.uniform(-1.05, 1.05, 6), 1.0)
    at = forward(robot, move.joints(np.array(random.uniform(0.2, 0.8)))[0])[:3, 3] + random.uniform(-0.12, 0.12, 3)
    radius = float(random.uniform(0.2, 5)) / 1000
    if random.uniform() < 0.5:
        return move, Scene("bead", (Sphere("obstacle", transform(at, np.zeros(3)), radius + 1e-3),))
    T = transform(at, np.radians(random.integers(-90, 90, 3)))
    return move, Scene("wire", (Cylinder("obstacle", T, radius, 0.3),))


def judged(robot, random) -> tuple[int, int, int, float, float, int]:
    """Contacts, missed, invented, worst error of their ends in s, arm poses measured, contacts that 26 samples miss."""
    times, met, missed, invented, worst, measured, between = np.linspace(0, 1, DENSE), 0, 0, 0, 0.0, [], 0
    for _ in range(MOTIONS):
        move, scene = past_an_obstacle(robot, random)
        bodies = Bodies(robot, scene)
        every = np.arange(len(bodies.pairs))
        dense = np.array([bodies.distances(ends, every).min() for ends in bodies.ends(move.joints(times)[0])])
        found = clearance_along(
            bodies, lambda t, move=move: move.joints(t)[0], move.polynomials().rate_bounds, ENDS, ENDS, DEPTH
        )
        inside = np.zeros(DENSE, bool)
        for contact in found.contacts:
            inside |= (times >= contact.start) & (times <= contact.end)
        met += bool((dense < 0).any())
        missed += bool((~inside & (dense < -DEPTH)).any())
        invented += bool((inside & (dense > DEPTH)).any())
        if (dense < 0).any() and not (dense[:: (DENSE - 1) // 25] < 0).any():
            between += 1
        measured.append(found.measured)
        edges = [t for contact in found.contacts for t in (contact.start, contact.end) if 0 < t < 1]
        if edges:
            ends = bodies.ends(move.joints(np.array(edges))[0])
            worst = max(worst, *(abs(bodies.distances(end, every).min()) for end in ends))
    return met, missed, invented, worst, float(np.mean(measured)), between


def table() -> str:
    """The evidence as Markdown."""
    lines = [
        "# Clearance along motions",
        "",
        f"{MOTIONS} random joint moves per robot past a bead (1.2 to 6 mm in radius) or a wire (0.2 to 5 mm), measured",
        "by `clearance_along` from nothing but both ends, no overlap deeper than 1 mm to be missed, and at",
        f"{DENSE} even times for comparison. *Missed*: motions that overlap by more than 1 mm at one of these outside",
        "every contact found. *Invented*: motions that are clear by more than 1 mm inside one. *Ends*: the greatest",
        "distance between the bodies at the times at which contacts are said to begin or end. *Between samples*:",
        "contacts that 26 even samples don't touch. *Poses*: arm poses measured per motion, on average.",
        f"Seed {SEED}. Written by `make campaigns ARGS=clearance`.",
        "",
        "| robot | contacts | missed | invented | ends (µm) | poses | between samples |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in ROBOTS:
        met, missed, invented, worst, poses, between = judged(load_robot(name), np.random.default_rng(SEED))
        lines.append(f"| {name} | {met} | {missed} | {invented} | {worst * 1e6:.2g} | {poses:.0f} | {between} |")
    return "\n".join(lines) + "\n"
