"""The data for a page's player: an arm, its scene, and its motions as joint values."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import scipy
from markupsafe import Markup

from er3a.collision.meshes import simplified
from er3a.collision.scene import Box, Cylinder, Plane, Scene, Solid, Sphere
from er3a.collision.shapes import arm_shapes, hull_faces, solid_pieces
from er3a.geometry.vectors import fibonacci_sphere
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.language import N_, tr
from er3a.pipeline.player.motions import PlayedMotion
from er3a.pipeline.viewing.palette import BODY, INK, JOINTS, LINK, VERDICTS, link_colour
from er3a.robots.joint_limits import shown, size_of, theta_limits
from er3a.robots.robot import Robot

_HERE = Path(__file__).parent
TEMPLATES = jinja2.Environment(loader=jinja2.FileSystemLoader(_HERE), autoescape=True, trim_blocks=True)
TEACH = _HERE.with_name("teach")
MAX_FRAMES, FRAMES_IN_ALL, MIN_FRAMES = 240, 6000, 40  # of a motion, of all, and of one among many
MAX_FACES, MIN_CORNERS = 2000, 12  # of an arm, and of a convex piece
BALL = 24  # corners of each end of a capsule
SCENE_COLOUR = "#b9a78f"
COLOURS = {status: VERDICTS[status] for status in ("caution", "fail")}
AXES = ("#b42318", "#18794e", "#0b5c94")
TABLE = (
    *("a", "alpha", "d", "beta", "direction", "offset", "sliding"),
    *("lower", "upper", "continuous", "base"),
)
DRAWING = ("algebra", "kinematics", "orbit", "scene", "solids")
LEVEL = 1e-6  # by which a plane's normal may differ from the vertical to be drawn as the floor
LOOKS = {
    "visual": N_("meshes"),
    "checked": N_("the shapes checked"),
    "both": N_("both"),
}
"""What an arm with meshes can be shown by; see ``teach/solids.js``."""
WORDS = {
    "looks": N_("arm drawn as"),
    "player": N_("Motion playback"),
    "motion": N_("motion"),
    "play": N_("Play"),
    "pause": N_("Pause"),
    "back": N_("one step back"),
    "forward": N_("one step forward"),
    "next": N_("Next event"),
    "speed": N_("speed ×"),
    "time": N_("time of the motion"),
    "clock": N_("{t} of {end} s"),
    "joints": N_(
        "Joint values at this moment, and how far each is from the nearer of its limits. ✕ and ▲ mark joints that fail "
        "then, with what they would need."
    ),
    "nearest": N_("Nearest its limit: {joints}."),
    "nearest_joint": N_("{joint}, {room}"),
    "room": N_("{room} to limit"),
    "beyond": N_("{room} beyond"),
    "unlimited": N_("no limit"),
    "start": N_("start"),
    "end": N_("end"),
    "start_and_end": N_("start and end"),
    "undock": N_("return the player to its place"),
    "picture": N_("The arm on its path. Drag or use the arrow keys to turn the picture, + and − to zoom."),
    "joint_values": N_("Joints"),
    "no_script": N_("The player needs JavaScript; recordings show the same in the Rerun viewer."),
}


def player(
    robot: Robot,
    motions: Sequence[PlayedMotion],
    scene: Scene | None = None,
    beside: Sequence[Robot] = (),
    signs: Sequence[str] = (),
    opened: tuple[str, float] | None = None,
) -> Markup:
    """The player as HTML, one a page, whose head holds ``drawing_head``; empty where there is no motion.

    Parameters
    ----------
    opened : the motion and the time (s) that it opens at
    beside : further arms, which move at the same time; their bases say where they stand
    signs : what is written below the base of each arm, the first included; nothing if empty
    """
    shown = [motion for motion in motions if len(motion.t) > 1]
    if not shown:
        return Markup()
    words = {key: tr(word) for key, word in WORDS.items()} | {"between": tr("; ")}
    return Markup(
        TEMPLATES.get_template("player.html.j2").render(
            words=words,
            looks={key: tr(word) for key, word in LOOKS.items()} if robot.visuals else {},
            motions=shown,
            data=_data(robot, shown, scene, words, beside, signs) | {"opened": opened},
            script=(_HERE / "player.js").read_text(encoding="utf-8"),
        )
    )


def moment(motion: str, t: float, text: str) -> Markup:
    """A text, for a table's cell, that leads the page's player to time ``t`` (s) of a motion."""
    return Markup('<a href="#player" data-play="{}" data-t="{}">{}</a>').format(motion, t, text)


def stretch(motion: str, t0: float, t1: float) -> Markup:
    """Attributes of an element that leads the player to ``t1`` (s) and is marked from ``t0`` on."""
    return Markup('data-play="{}" data-from="{}" data-t="{}"').format(motion, t0, t1)


def drawing_head() -> Markup:
    """What the head of a page holds that has a player or a figure in space: their style sheet and their modules."""
    style = (_HERE / "player.css").read_text(encoding="utf-8")
    modules = import_map([*(TEACH / f"{name}.js" for name in DRAWING), _HERE / "values.js"])
    return Markup("<style>{}</style>{}").format(Markup(style), modules)


def _data(
    robot: Robot,
    motions: Sequence[PlayedMotion],
    scene: Scene | None,
    words: dict[str, str],
    beside: Sequence[Robot],
    signs: Sequence[str],
) -> dict[str, Any]:
    size = drawn_size(robot)
    bases = [arm.base[:3, 3] for arm in (robot, *beside)]
    most = min(MAX_FRAMES, max(MIN_FRAMES, FRAMES_IN_ALL // len(motions)))
    return {
        "table": table_data(robot),
        "size": size,
        **drawn_shapes(robot),
        "beside": [{"table": table_data(arm), **drawn_shapes(arm)} for arm in beside],
        "signs": [{"text": text, "at": (at - [0, 0, 0.1 * size]).tolist()} for text, at in zip(signs, bases)],
        "width": max(size, 0.7 * (size + float(np.ptp(bases, axis=0).max()))),
        "target": (np.mean(bases, axis=0) + robot.base[:3, 2] * 0.35 * size).tolist(),
        "colours": {"joints": JOINTS, "link": LINK, "body": BODY, "mark": INK, "touching": VERDICTS["fail"], **COLOURS},
        "axes": AXES,
        "floor": floor_of(scene),
        "scene": scene_data(scene.solids if scene else ()),
        "carried": scene_data(scene.carried if scene else ()),
        "motions": [_motion(motion, most) for motion in motions],
        "joints": _joints(robot),
        "words": words,
    }


def _joints(robot: Robot) -> list[dict[str, Any]]:
    """Unit and limits of each joint in it, None where it has none."""
    ends = np.round(shown(robot, np.stack([robot.lower, robot.upper])), 6)
    return [
        {"unit": "mm" if slides else tr("deg"), "lower": None if free else low, "upper": None if free else high}
        for slides, free, low, high in zip(robot.slides.tolist(), robot.continuous.tolist(), *ends.tolist())
    ]


def table_data(robot: Robot) -> dict[str, Any]:
    """A robot's table and limits as the scripts take them, SI; see ``teach/kinematics.js``."""
    return {
        "convention": robot.convention,
        **{key: getattr(robot, key).tolist() for key in TABLE},
        "tool": robot.last_to_tool.tolist(),
        "slides": robot.slides.tolist(),
        "coupling": None if robot.coupling is None else robot.coupling.tolist(),
        "combined": [asdict(limit) for limit in robot.combined],
    }


def drawn_size(robot: Robot) -> float:
    """A length (m) to scale drawings with: of all links, of the tool, and of how far joints slide."""
    ways = np.ptp(theta_limits(robot), axis=1)[robot.sliding].sum()
    return size_of(robot) + float(np.linalg.norm(robot.last_to_tool[:3, 3]) + ways) or 1.0


def drawn_shapes(robot: Robot) -> dict[str, list[dict[str, Any]]]:
    """What an arm's links are drawn by: ``visuals``, how they look, and ``pieces``, the convex pieces and surfaces.

    Beside visuals, the shapes that collisions are measured with are all among the pieces, capsules too.
    """
    visuals = [_drawn(each.link, each.points, each.faces) for each in robot.visuals]
    shapes = [(each.link, np.array(each.points)) for each in robot.hulls]
    for each in arm_shapes(robot).capsules if visuals else ():
        ball = each.radius * fibonacci_sphere(BALL)
        shapes.append((each.link, np.concatenate([ball + each.start, ball + each.end])))
    corners = max(MIN_CORNERS, MAX_FACES // (2 * len(shapes) or 1))
    meshes = robot.meshes
    pieces = [_drawn(each.link, *simplified(each.points, each.faces, MAX_FACES // len(meshes))) for each in meshes]
    for link, points in shapes:
        if len(points) > corners:
            points = points[np.unique((fibonacci_sphere(corners) @ points.T).argmax(axis=1))]
        try:
            pieces.append(_drawn(link, points, hull_faces(points)))
        except scipy.spatial.QhullError:  # flat: nothing to be seen of it but from above
            continue
    return {"pieces": pieces, "visuals": visuals}


def _drawn(link: int, points: Reals, faces: Integers) -> dict[str, Any]:
    """A surface of a link, grey with something of its joint's colour."""
    return {"link": link, "points": np.round(points, 5).tolist(), "faces": faces.tolist(), "colour": link_colour(link)}


def floor_of(scene: Scene | None) -> float | None:
    """The height (m) of the highest level floor of a scene, None where it has none."""
    solids = scene.solids if scene else ()
    return max((s.offset for s in solids if isinstance(s, Plane) and s.normal[2] > 1 - LEVEL), default=None)


def scene_data(solids: Sequence[Solid]) -> list[dict[str, Any]]:
    """Solids as the drawing code takes them; planes are left out."""
    return [_solid(solid) for solid in solids if not isinstance(solid, Plane)]


def _solid(solid: Solid) -> dict[str, Any]:
    """An obstacle as the drawing code takes it; one that it has no shape for as the hulls of its pieces."""
    common: dict[str, Any] = {"name": solid.name, "colour": SCENE_COLOUR}
    if isinstance(solid, Box | Cylinder | Sphere):
        common["T"] = np.asarray(solid.T).tolist()
    match solid:
        case Box():
            return {**common, "kind": "box", "size": np.asarray(solid.size).tolist()}
        case Cylinder():
            return {**common, "kind": "cylinder", "radius": solid.radius, "length": solid.length}
        case Sphere():
            return {**common, "kind": "sphere", "radius": solid.radius}
    pieces = solid_pieces(solid)
    starts = np.cumsum([0, *(len(piece) for piece in pieces)])
    faces = np.concatenate([start + hull_faces(piece) for start, piece in zip(starts, pieces)])
    points = np.concatenate(pieces)
    return {**common, "kind": "mesh", "T": np.eye(4).tolist(), "points": points.tolist(), "faces": faces.tolist()}


def _motion(motion: PlayedMotion, most: int) -> dict[str, Any]:
    rows = _shown(motion, most)
    return {
        "name": motion.name,
        "text": motion.text,
        "times": np.round(motion.t[rows], 4).tolist(),
        "values": [base64.b64encode(q[rows].astype("<f4")).decode() for q in (motion.q, *motion.beside)],
        "events": [asdict(event) for event in sorted(motion.events, key=lambda event: event.t)],
        "marks": [
            {"from": mark.start, "to": mark.end, "text": mark.text, "t0": mark.t0, "t1": mark.t1}
            for mark in motion.marks
        ],
    }


def _shown(motion: PlayedMotion, most: int) -> np.ndarray:
    """Rows to be drawn: evenly spread in time, at most so many, and those next to events."""
    even = np.searchsorted(motion.t, np.linspace(motion.t[0], motion.t[-1], min(most, len(motion.t))))
    events = np.searchsorted(motion.t, [time for event in motion.events for time in (event.t, event.until)])
    rows = np.unique(np.clip(np.concatenate([even, events, [0, len(motion.t) - 1]]), 0, len(motion.t) - 1))
    _, first = np.unique(np.round(motion.t[rows], 4), return_index=True)
    return rows[first].astype(int)


def import_map(files: Iterable[Path]) -> Markup:
    """A page's import map: each ES module as ``er3a/NAME``. It stands before the page's first module.

    The scripts are data addresses, because a page opened from a disk may not import other files.
    """
    addresses = {f"er3a/{file.stem}": _address(file) for file in files}
    return Markup(f'<script type="importmap">{json.dumps({"imports": addresses})}</script>')


def _address(file: Path) -> str:
    return "data:text/javascript;base64," + base64.b64encode(file.read_bytes()).decode("ascii")
