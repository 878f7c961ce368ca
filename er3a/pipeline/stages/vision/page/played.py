"""The objects for the player: the way to each one's grasp, the camera with what it sees, and each object's place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from er3a.collision.pairs import names_of
from er3a.files.vision_file import VisionFile
from er3a.finding import is_one
from er3a.geometry.transforms import inverted, posed
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import N_, tr, with_unit
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import say
from er3a.pipeline.player.motions import Mark, PlayedEvent, PlayedMotion, at_rest
from er3a.pipeline.stages.vision.model import CIRCLES_MM, ObjectResult, PoseEstimate, VisionResults, VisionSummary
from er3a.pipeline.viewing.drawn import Shape, frame_between
from er3a.pipeline.viewing.palette import REFERENCE, VERDICTS
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

WAYS = {"move": N_("move to the approach"), "approach": N_("straight to the grasp"), "retreat": N_("retreat")}
OBJECT_M = (0.04, 0.04, 0.06)  # how an object is drawn: no file gives its shape
ROUND_M = {"radius": 0.02, "length": 0.06}
SIGHT = 0.7  # of the farthest distance, how far the pyramid reaches that shows where a camera looks
EDGE, EDGE_M = 0.5, 0.0015  # opacity and radius of the pyramid's edges
CAMERA_M = (0.09, 0.07, 0.07)
EDGES = ((0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1))  # of a pyramid, its top first


def motions(robot: Robot, results: VisionResults, task: VisionFile) -> list[PlayedMotion]:
    """The way to each object and away from it; the arm where it waits for an object that it does not grasp."""
    home, objects = meant(robot, np.array(task.home_deg)), results.summary.objects
    moved = [_moved(robot, each) for each in objects if each.moved_to_mm]
    allowed = min(task.gripper.tolerance_mm)
    return [*(_motion(robot, results, each, home, allowed) for each in objects), *moved]


def moved_name(each: ObjectResult) -> str:
    """What the player calls an object at the place at which it could be grasped."""
    return tr("{name}, moved", name=each.name)


def moved_text(each: ObjectResult) -> str:
    """How far an object has to be moved to be grasped, and to where; that it can't be, if no place was found."""
    if each.moved_to_mm is None:
        return tr("No place found within {far} mm.", far=max(CIRCLES_MM))
    at = ", ".join(fixed(value, 0) for value in each.moved_to_mm)
    return tr("Move {name} by {far}, to ({at}) mm.", name=each.name, far=_far(each.xyz_mm, each.moved_to_mm), at=at)


def _far(start: Sequence[float], end: Sequence[float]) -> str:
    return with_unit(fixed(float(np.linalg.norm(np.subtract(start, end))), 0), "mm")


def _moved(robot: Robot, each: ObjectResult) -> PlayedMotion:
    """The arm as it grasps an object at the place to which it would have to be moved."""
    assert each.moved_to_mm is not None
    q, way = meant(robot, np.array(each.moved_q_deg)), (_metres(each.xyz_mm), _metres(each.moved_to_mm))
    marks = [Mark(0.0, 1.0, *way, _far(each.xyz_mm, each.moved_to_mm))]
    return at_rest(robot, moved_name(each), tr("Can be grasped here"), "plain", q, marks=marks)


def _motion(robot: Robot, results: VisionResults, each: ObjectResult, home: Reals, allowed_mm: float) -> PlayedMotion:
    rows = results.ways.take(results.ways.target == each.name)
    if each.grasp is None or not len(rows):
        hit = each.refusal.params if is_one(each.refusal, "grasp_collides") else {}
        place = hit.get("near_m", _metres(each.xyz_mm))
        bodies = names_of(hit["pair"]) if hit else ()
        mark = Mark(0.0, 1.0, place, place, "")
        q = np.array(hit.get("q", home))
        return at_rest(robot, each.name, refusal_text(each), "fail", q, bodies, marks=[mark])
    parts = [(part, rows.t_s[rows.part == part]) for part in dict.fromkeys(rows.part.tolist())]
    events = [PlayedEvent(float(own[0]), float(own[-1]), tr(WAYS[part]), "plain") for part, own in parts]
    text = tr("Can be grasped here")
    if each.error_mm:
        off = fixed(each.error_mm.together, 1)
        text = tr("Grasp: 95 % within {off} mm, {allowed:g} mm allowed", off=off, allowed=allowed_mm)
    there = grasp_moment(results, each)[1]
    events.append(PlayedEvent(there, there, text, "plain"))
    return PlayedMotion(each.name, text, rows.t_s, meant(robot, rows.q_deg), events)


def refusal_text(each: ObjectResult) -> str:
    """Why an object is not grasped."""
    return say(each.refusal) if each.refusal else tr("none")


def grasp_moment(results: VisionResults, each: ObjectResult) -> tuple[str, float]:
    """The motion to an object, and when (s) it is there; its start where the arm does not go there."""
    rows = results.ways.take((results.ways.target == each.name) & (results.ways.part == "approach"))
    return each.name, float(rows.t_s[-1]) if len(rows) else 0.0


def placed(pose: PoseEstimate | ObjectResult) -> Reals:
    """A pose, or where an object is, as a transform (4, 4), m."""
    R = scipy.spatial.transform.Rotation.from_quat(pose.quaternion_wxyz, scalar_first=True).as_matrix()
    return posed(R, np.array(pose.xyz_mm) / 1000)


def seen_shapes(robot: Robot, task: VisionFile, summary: VisionSummary) -> list[Shape]:
    """The camera with a pyramid that shows where it looks, and a box at each object, or a cylinder where it looks the
    same at any angle; a camera on the arm moves with it.

    Returns
    -------
    shapes : of ``viewing/drawn.py``
    """
    found = summary.calibration
    kinds = {each.name: "box" if each.symmetry_turns else "cylinder" for each in task.objects}
    shapes = [_object(each, kinds[each.name]) for each in summary.objects]
    if found is None:
        return shapes
    fixed_camera = found.setup == "eye_to_hand"
    T = placed(found.hand_eye) if fixed_camera else inverted(robot.last_to_tool) @ placed(found.hand_eye)
    frame = 0 if fixed_camera else robot.rows + 1
    common = {"frame": frame, "name": tr("camera"), "T": T.tolist(), "colour": REFERENCE}
    low = min(each.xyz_mm[2] / 1000 for each in summary.objects) if fixed_camera and shapes else -np.inf
    corners = _corners(task, T, low)
    points = np.concatenate([np.zeros((1, 3)), corners])
    sight = []
    for i, j in EDGES:
        edge, length = T @ frame_between(points[i], points[j]), float(np.linalg.norm(points[i] - points[j]))
        sight.append({"kind": "cylinder", "T": edge.tolist(), "radius": EDGE_M, "length": length, "pale": EDGE})
    seen = [{**common, "own": REFERENCE, **each} for each in sight]
    return [*shapes, {**common, "kind": "box", "size": CAMERA_M}, *seen]


def _corners(task: VisionFile, T: Reals, low: float) -> Reals:
    """The corners (4, 3) of what a camera at ``T`` sees down to a height, or to where its picture ends, m, in its
    frame."""
    x, y = np.tan(np.radians([task.view.horizontal_deg, task.view.vertical_deg]) / 2)
    rays = np.array([[-x, -y, 1.0], [x, -y, 1.0], [x, y, 1.0], [-x, y, 1.0]])
    down = np.minimum(rays @ T[2, :3], -1e-9)
    found: Reals = rays * np.minimum((low - T[2, 3]) / down, SIGHT * task.view.farthest_mm / 1000)[:, None]
    return found


def _metres(xyz_mm: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (value / 1000 for value in xyz_mm)
    return x, y, z


def _object(each: ObjectResult, kind: str) -> Shape:
    colour, T = VERDICTS["pass" if each.grasp else "fail"], placed(each).tolist()
    return {"frame": 0, "name": each.name, "kind": kind, "T": T, "colour": colour, "size": OBJECT_M, **ROUND_M}
