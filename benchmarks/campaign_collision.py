"""Distances against Coal's and FCL's own, contacts along motions against dense sampling, speed against Pinocchio's."""

from __future__ import annotations

import time
from collections.abc import Callable

import coal
import fcl
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from er3a import export_urdf, load_robot, load_scene
from er3a.collision.bodies import Bodies
from er3a.collision.distance_kernels import CYLINDER, FREE, HULL, ROOM, free_between, judge_polyline, pair_distance
from er3a.collision.overlap_depth import cylinder_points, overlap_depth
from er3a.collision.scene import Box, Cylinder, Plane, Sphere
from er3a.collision.shapes import CORNERS, WORLD, Body, layout_of

ROBOTS = {
    "er3a_c60": "data/scenes/table_and_post.yaml",
    "er3a_c60_article": "data/scenes/wall_and_low_floor.yaml",
    "er3_600": "data/scenes/table_and_post.yaml",
}
PAIRS, MOTIONS, SEED, SAMPLES = 400, 1000, 20261121, 10_000
DEPTH = 1e-4  # m, of the dense check
SHAPES = ("capsule", "sphere", "box", "cylinder", "hull")


class Outsider:
    """One random body: as er3a has it, and as Coal and FCL have it."""

    def __init__(self, kind: str, random: np.random.Generator) -> None:
        radius, length = random.uniform(0.01, 0.1), random.uniform(0.05, 0.5)
        line = np.array([[0, 0, -length / 2], [0, 0, length / 2]])
        match kind:
            case "capsule":
                own, self.coal, self.fcl = (line, radius), coal.Capsule(radius, length), fcl.Capsule(radius, length)
            case "sphere":
                own, self.coal, self.fcl = (np.zeros((1, 3)), radius), coal.Sphere(radius), fcl.Sphere(radius)
            case "box":
                size = random.uniform(0.02, 0.5, 3)
                own, self.coal, self.fcl = (CORNERS * size, 0.0), coal.Box(*size), fcl.Box(*size)
            case "cylinder":
                own = (line, 0.0, CYLINDER, radius)
                self.coal, self.fcl = coal.Cylinder(radius, length), fcl.Cylinder(radius, length)
            case _:
                points = random.normal(size=(int(random.integers(6, 40)), 3)) * 0.1
                hull = ConvexHull(points)
                number = {v: k for k, v in enumerate(hull.vertices)}
                corners = points[hull.vertices]
                inward = np.einsum("ij,ij->i", _normals(hull), hull.equations[:, :3]) < 0
                faces = np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices)
                faces = np.vectorize(number.get)(faces)
                own, self.coal = (corners, 0.0), _coal_convex(corners, faces)
                self.fcl = fcl.Convex(corners, len(faces), np.c_[np.full(len(faces), 3), faces].ravel())
        self.R, self.t = Rotation.random(random_state=random).as_matrix(), random.normal(size=3) * 0.2
        points, radius, *rest = own
        self.own = Body(kind, WORLD, points @ self.R.T + self.t, radius, *(rest or (HULL, 0.0)))


def _normals(hull: ConvexHull) -> np.ndarray:
    corners = hull.points[hull.simplices]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _coal_convex(corners: np.ndarray, faces: np.ndarray) -> object:
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    points.extend(list(corners))
    triangles.extend([coal.Triangle(*map(int, face)) for face in faces])
    return coal.Convex(points, triangles)


def own_distance(first: Body, second: Body) -> tuple[float, bool]:
    """Our signed distance, and whether cores overlap."""
    robot = load_robot("er3_600")
    layout = layout_of(robot, [first, second], [(0, 1)])
    shape = (layout.start, layout.kind, layout.radius, layout.disc)
    found, deep = pair_distance(layout.points, shape, 0, 1, np.empty((ROOM, 3)), np.empty((2, 3)))
    if deep:
        cores = [cylinder_points(b.points, b.disc) if b.kind == CYLINDER else b.points for b in (first, second)]
        found -= overlap_depth(*cores)
    return found, bool(deep)


def distances(kind: str, random: np.random.Generator) -> tuple[float, float, float, int]:
    """Greatest differences (m) from Coal, apart or shallow, and deep; from FCL where apart; how many are deep."""
    apart, deep, of_fcl, count = 0.0, 0.0, 0.0, 0
    for number in range(PAIRS):
        a, b = Outsider(kind, random), Outsider(SHAPES[number % len(SHAPES)], random)
        found, inside = own_distance(a.own, b.own)
        places = [coal.Transform3s(each.R, each.t) for each in (a, b)]
        theirs = coal.distance(a.coal, places[0], b.coal, places[1], coal.DistanceRequest(), coal.DistanceResult())
        if inside:
            deep, count = max(deep, abs(found - theirs)), count + 1
        else:
            apart = max(apart, abs(found - theirs))
        if found > 1e-3:
            objects = [fcl.CollisionObject(each.fcl, fcl.Transform(each.R, each.t)) for each in (a, b)]
            request = fcl.DistanceRequest(enable_signed_distance=True, gjk_solver_type=fcl.GJKSolverType.GST_LIBCCD)
            of_fcl = max(of_fcl, abs(found - fcl.distance(*objects, request, fcl.DistanceResult())))
    return apart, deep, of_fcl, count


class Peer:
    """Pinocchio's model of a robot, with the same bodies and pairs as ours, through its own URDF reader and Coal."""

    def __init__(self, name: str, bodies: Bodies) -> None:
        robot = bodies.robot
        self.model = pin.buildModelFromXML(export_urdf(robot.replace(base=np.eye(4))))
        self.base = pin.SE3(robot.base)
        self.geometry = pin.GeometryModel()
        zero = pin.neutral(self.model)
        data = self.model.createData()
        pin.forwardKinematics(self.model, data, zero)
        numbers = {}
        layout = bodies.layout
        for b in sorted({*layout.first.tolist(), *layout.second.tolist()}):
            shape, place, link = _coal_body(bodies, b)
            joint = max(link, 0)
            T = pin.SE3(place)
            if link >= 1:  # our link frames are the joints' but for the zero angle
                T = pin.SE3(np.linalg.inv(data.oMi[joint].homogeneous) @ _own_frame(robot, link) @ place)
            numbers[b] = self.geometry.addGeometryObject(pin.GeometryObject(f"body_{b}", joint, T, shape))
        for a, b in zip(layout.first.tolist(), layout.second.tolist()):
            self.geometry.addCollisionPair(pin.CollisionPair(numbers[a], numbers[b]))
        self.data, self.geometry_data = data, pin.GeometryData(self.geometry)

    def collides(self, q: np.ndarray) -> bool:
        """Whether any pair does, by Pinocchio's own loop over the pairs."""
        return pin.computeCollisions(self.model, self.data, self.geometry, self.geometry_data, q, False)

    def all_pairs(self, q: np.ndarray) -> np.ndarray:
        """Which pairs collide."""
        self.collides(q)
        return np.array([result.isCollision() for result in self.geometry_data.collisionResults])


def _own_frame(robot, link: int) -> np.ndarray:
    from er3a.kinematics.forward import frames

    return frames(robot.replace(base=np.eye(4)), np.zeros(6))[link - 1]


def _coal_body(bodies: Bodies, b: int) -> tuple[object, np.ndarray, int]:
    """A body as Coal's shape, its place in the link's frame (in the world for solids), and its link (-1: the world)."""
    layout = bodies.layout
    points, link = layout.points[layout.start[b] : layout.start[b + 1]], int(layout.link[b])
    place = np.eye(4)
    if layout.kind[b] == 2:
        return coal.Halfspace(points[0], float(points[1, 0])), place, link
    if layout.kind[b] == HULL and len(points) == 8:
        sides = [points[k] - points[0] for k in (4, 2, 1)]
        place[:3, :3] = np.stack([side / np.linalg.norm(side) for side in sides], axis=1)
        place[:3, 3] = points.mean(axis=0)
        return coal.Box(*(float(np.linalg.norm(side)) for side in sides)), place, link
    place[:3, 3] = points.mean(axis=0)
    if len(points) == 1:
        return coal.Sphere(float(layout.radius[b])), place, link
    axis = points[1] - points[0]
    length = float(np.linalg.norm(axis))
    place[:3, :3] = Rotation.align_vectors(axis[None] / length, [[0.0, 0.0, 1.0]])[0].as_matrix()
    if layout.kind[b] == CYLINDER:
        return coal.Cylinder(float(layout.disc[b]), length), place, link
    return coal.Capsule(float(layout.radius[b]), length), place, link


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
    """Least of three runs, s."""
    times = []
    for _ in range(3):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
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
    states = np.empty(SAMPLES - 1, np.int64)
    judge_polyline(bodies.layout, q[:3], DEPTH, states)
    proof = timed(lambda: judge_polyline(bodies.layout, q, DEPTH, states))
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
        assert all(isinstance(solid, Box | Cylinder | Plane | Sphere) for solid in load_scene(scene).solids)
        peer = Peer(name, bodies)
        free, meet, open_, wrong = contacts(bodies, peer, random)
        pairs, theirs, ours, proof, differ = speed(bodies, peer, random)
        lines.append(
            f"| {name} | {free} | {meet} | {open_} | {wrong} | {pairs} | {theirs:.1f} | {ours:.1f} | {proof:.1f} | "
            f"{ours / theirs:.2f} | {proof / theirs:.2f} | {differ} |"
        )
    lines += ["", f"Seed {SEED}. Written by `make campaigns ARGS=collision`."]
    return "\n".join(lines) + "\n"
