"""Random motions past small obstacles: is every contact found, and with how few distance measurements?"""

from __future__ import annotations

import numpy as np

from er3a import forward, load_robot
from er3a.collision.along import clearance_along
from er3a.collision.bodies import Bodies
from er3a.collision.matrix import collision_matrix
from er3a.collision.pairs import Pair
from er3a.collision.scene import Cylinder, Scene, Sphere
from er3a.geometry.transforms import transform
from er3a.planning.moves import JointMove
from testing.dense_contacts import Contacts
from testing.evidence import sized
from testing.motion_cases import contacts_of

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
MOTIONS, SEED, DEPTH = sized(400), 20261120, 1e-4
DENSE, FINE = 501, 40  # even times of a motion; of each interval of them in which the bodies are near
NEAR = 0.02  # m
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


def dense_distances(apart: Contacts, move: JointMove) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) and Coal's distances (n,) in m: even ones, and finer ones wherever the bodies are near."""
    times = np.linspace(0, 1, DENSE)
    distances = apart.least(move.joints(times)[0])
    near = np.minimum(distances[:-1], distances[1:]) < NEAR
    between = np.linspace(times[:-1][near], times[1:][near], FINE + 1)[1:-1].T.ravel()
    if not len(between):
        return times, distances
    times, distances = np.r_[times, between], np.r_[distances, apart.least(move.joints(between)[0])]
    order = np.argsort(times)
    return times[order], distances[order]


def links_of(pair: Pair) -> tuple[str, str] | None:
    """Names of two links of the arm that meet, as in the collision matrix."""
    if pair.code != "link_pair":
        return None
    first, second = ("base" if link == 0 else f"link_{link}" for link in (pair.first, pair.second))
    return first, second


def judged(robot, random) -> tuple[int, int, int, float, float, float, int]:
    """Contacts, missed, invented, worst error of their ends in s, widest step in m, arm poses measured, contacts that
    26 samples miss.
    """
    met, missed, invented, worst, step, measured, between = 0, 0, 0, 0.0, 0.0, [], 0
    joined = {(row.first, row.second) for row in collision_matrix(robot).rows if row.state == "joined"}
    while len(measured) < MOTIONS:
        move, scene = past_an_obstacle(robot, random)
        bodies = Bodies(robot, scene)
        found = clearance_along(
            bodies, lambda t, move=move: move.joints(t)[0], move.polynomials().rate_bounds, ENDS, ENDS, DEPTH
        )
        if any(links_of(pair) in joined for contact in found.contacts for pair in contact.pairs):
            continue
        apart = contacts_of(robot, scene)
        times, dense = dense_distances(apart, move)
        step = max(step, float(np.abs(np.diff(dense))[np.diff(times) < 0.5 / (DENSE - 1)].max(initial=0.0)))
        inside = np.zeros(len(times), bool)
        for contact in found.contacts:
            inside |= (times >= contact.start) & (times <= contact.end)
        met += bool((dense < 0).any())
        missed += bool((~inside & (dense < -DEPTH)).any())
        invented += bool((inside & (dense > DEPTH)).any())
        even = np.linspace(0, 1, 26)
        between += bool((dense < 0).any() and not (np.interp(even, times, dense) < 0).any())
        measured.append(found.measured)
        edges = [t for contact in found.contacts for t in (contact.start, contact.end) if 0 < t < 1]
        if edges:
            worst = max(worst, float(np.abs(apart.least(move.joints(np.array(edges))[0])).max()))
    return met, missed, invented, worst, step, float(np.mean(measured)), between


PAGE = """# Clearance along motions

{motions:,} random joint moves per robot past a bead (1.2 to 6 mm in radius) or a wire (0.2 to 5 mm), measured by
`clearance_along` from nothing but both ends, no overlap deeper than {depth:g} mm to be missed. Judged by Coal on
frames worked out apart (`testing/dense_contacts.py`): at {dense} even times of each motion, and {fine} times more
often wherever the bodies are nearer than {near:g} mm. Motions that fold two links at their common joint are drawn
again: there er3a leaves out a region around the joint, which Coal doesn't know. *Missed*: motions that overlap by more
than {depth:g} mm at one of these times outside every contact found. *Invented*: motions that are clear by more than
{depth:g} mm inside one. *Ends*: the greatest distance, by Coal, at the times at which contacts are said to begin or
end. *Step*: the greatest change of distance from one of the finer times to the next. *Between samples*: motions in
contact that 26 even samples don't touch. *Poses*: arm poses that er3a measures per motion, on average. Seed {seed}.
Written by `make campaigns ARGS=clearance`.

| robot | motions | in contact | missed | invented | ends (µm) | step (mm) | poses | between samples |
|---|---|---|---|---|---|---|---|---|
{rows}
"""


def table() -> str:
    """The evidence as Markdown."""
    rows = []
    for name in ROBOTS:
        met, missed, invented, worst, step, poses, between = judged(load_robot(name), np.random.default_rng(SEED))
        rows.append(
            f"| {name} | {MOTIONS:,} | {met} | {missed} | {invented} | {worst * 1e6:.2g} | {step * 1000:.2g} "
            f"| {poses:.0f} | {between} |"
        )
        print(rows[-1], flush=True)
    return PAGE.format(
        motions=MOTIONS,
        depth=DEPTH * 1000,
        dense=DENSE,
        fine=FINE,
        near=NEAR * 1000,
        seed=SEED,
        rows="\n".join(rows),
    )
