"""Bodies and arms as Coal, FCL and Pinocchio have them, for tests and campaigns of collisions."""

from __future__ import annotations

import coal
import fcl
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from er3a import export_urdf, load_robot
from er3a.collision.bodies import Bodies
from er3a.collision.convex import cylinder_points, overlap_depth
from er3a.collision.distances import CYLINDER, HALF_SPACE, HULL, some_distances
from er3a.collision.shapes import CORNERS, WORLD, Body, layout_of
from er3a.kinematics.forward import frames
from er3a.robots.robot import Robot

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
    (found,), (deep,), _ = some_distances(layout, np.zeros(robot.joints), np.array([0]))
    if deep:
        cores = [cylinder_points(b.points, b.disc) if b.kind == CYLINDER else b.points for b in (first, second)]
        found -= overlap_depth(*cores)
    return float(found), bool(deep)


class Peer:
    """Pinocchio's model of a robot, with the same bodies and pairs as ours, through its own URDF reader and Coal."""

    def __init__(self, bodies: Bodies) -> None:
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


def _own_frame(robot: Robot, link: int) -> np.ndarray:
    return frames(robot.replace(base=np.eye(4)), np.zeros(6))[link - 1]


def _coal_body(bodies: Bodies, b: int) -> tuple[object, np.ndarray, int]:
    """A body as Coal's shape, its place in the link's frame (in the world for solids), and its link (-1: the world)."""
    layout = bodies.layout
    points, link = layout.points[layout.start[b] : layout.start[b + 1]], int(layout.link[b])
    place = np.eye(4)
    if layout.kind[b] == HALF_SPACE:
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


def coal_distance(first: Outsider, second: Outsider) -> float:
    """Coal's signed distance, m."""
    places = [coal.Transform3s(each.R, each.t) for each in (first, second)]
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    return float(coal.distance(first.coal, places[0], second.coal, places[1], request, result))


def fcl_distance(first: Outsider, second: Outsider) -> float:
    """FCL's distance of bodies that are apart, m."""
    objects = [fcl.CollisionObject(each.fcl, fcl.Transform(each.R, each.t)) for each in (first, second)]
    request = fcl.DistanceRequest(enable_signed_distance=True, gjk_solver_type=fcl.GJKSolverType.GST_LIBCCD)
    return float(fcl.distance(*objects, request, fcl.DistanceResult()))
