"""The data for a page's player: an arm, its scene, and its motions as joint values."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from er3a.collision.scene import Scene
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import regular_rank
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import N_, tr
from er3a.pipeline.player.motions import PlayedMotion, Weight
from er3a.pipeline.viewing.drawn import Shape, drawn_arm, drawn_scene, drawn_size, floor_of, poses_at, stand
from er3a.pipeline.viewing.page import packed_text, page_environment
from er3a.pipeline.viewing.palette import BODY, DOUBTFUL, INK, TOUCHING
from er3a.pipeline.viewing.still import (
    AZIMUTH,
    DISTANCE,
    FIELD,
    WIDE,
    Still,
    axes_of,
    scene_still,
    triangles_of,
)
from er3a.robots.joint_limits import shown
from er3a.robots.robot import Robot

_HERE = Path(__file__).parent
TEACH, VIEWING = _HERE.with_name("teach"), _HERE.with_name("viewing")
MAX_FRAMES, FRAMES_IN_ALL, MIN_FRAMES = 240, 6000, 40  # of a motion, of all, and of one among many
COLOURS = {"caution": DOUBTFUL, "fail": TOUCHING}
MARGIN, THICK = 0.04, 0.08  # of the arm's size, around what is to be seen, and around the middle of links
TITLE = 0.05  # of the picture's height, for what is said over it
AROUND = 0.4  # of the arm's size, from its way: what bodies have farther off need not be in the picture
TURNED = 0.25  # rad, by which the eye looks at arms along y from another side
TURNS = np.linspace(-np.pi / 2, np.pi / 2, 37)  # of which that is taken from which the arm is seen best
HIDDEN_COSTS, TURN_COSTS = 1.0, 0.05  # by which a view is worse: of the arm that is hidden, and of a rad
WAY_COUNTS = 1.0  # in a view, to the arm
GRAVEST: tuple[Weight, ...] = ("fail", "caution", "plain")  # the last such moment is seen from the side
VIEW = ("turned", "elevation", "length", "target")
FRAMED = 9  # moments of a motion that the picture holds
AXES = ("#b42318", "#18794e", "#0b5c94")
TABLE = (
    *("a", "alpha", "d", "beta", "direction", "offset", "sliding"),
    *("lower", "upper", "continuous", "base"),
)
SPACE = [VIEWING / f"{name}.js" for name in ("orbit", "space", "three")]
DRAWING = [*SPACE, TEACH / "algebra.js", TEACH / "kinematics.js", _HERE / "values.js"]
LOOKS = {
    "visual": N_("meshes"),
    "checked": N_("the shapes checked"),
    "both": N_("both"),
}
"""What an arm with meshes can be shown by; see ``viewing/drawn.py``."""


def player(
    robot: Robot,
    motions: Sequence[PlayedMotion],
    scene: Scene | None = None,
    *,
    beside: Sequence[Robot] = (),
    signs: Sequence[str] = (),
    opened: tuple[str, float] | None = None,
    added: Sequence[Shape] = (),
) -> Markup:
    """The player as HTML, one a page, whose head holds ``drawing_head``; empty where there is no motion.

    Parameters
    ----------
    opened : the motion and the time (s) that it opens at; None for the first motion's start
    beside : further arms, which move at the same time; their bases say where they stand
    added : shapes of ``viewing/drawn.py`` around the arm, or in its tool's frame, that nothing collides with
    signs : what is written below the base of each arm, the first included; nothing if empty
    """
    shown = [motion for motion in motions if len(motion.t) > 1]
    if not shown:
        return Markup()
    data = _data(robot, shown, scene, beside, signs)
    for shape in added:
        data["carried" if shape["frame"] else "scene"].append(shape)
    named = {motion.name: motion for motion in shown}
    data["opened"] = opened if opened and opened[0] in named else (shown[0].name, float(shown[0].t[0]))
    first = named[data["opened"][0]]
    robots = (robot, *beside)
    turned = TURNED
    for own, motion in zip(data["motions"], shown):
        if motion.turned is not None:
            turned = motion.turned
        elif (
            motion.events and not beside
        ):  # what nothing is said of is the one before it in another way, and seen alike
            gravest = min(reversed(motion.events), key=lambda event: GRAVEST.index(event.status))
            turned = best_turn(robot, motion, data["opened"][1] if motion is first else gravest.t, data)
        own |= framed(data, robots, motion, turned) | {"turned": turned, "elevation": motion.elevation}
    data |= {key: own[key] for own in data["motions"] if own["name"] == first.name for key in VIEW}
    return Markup(
        page_environment(_HERE)
        .get_template("player.html.j2")
        .render(
            looks={key: tr(word) for key, word in LOOKS.items()} if robot.visuals else {},
            motions=shown,
            data=data,
            still=_still(robots, first, data).markup(),
            script=(_HERE / "player.js").read_text(encoding="utf-8"),
        )
    )


def picture_at(robot: Robot, motion: PlayedMotion, t: float, scene: Scene | None) -> bytes:
    """A WebP picture of an arm and its scene at time ``t`` (s) of a motion, as a player would open."""
    data = _data(robot, [motion], scene, (), ()) | {"opened": (motion.name, t)}
    turned = best_turn(robot, motion, t, data)
    data |= framed(data, (robot,), motion, turned) | {"turned": turned}
    return _still((robot,), motion, data).picture()


def moment(motion: str, t: float, text: str) -> Markup:
    """A text, for a table's cell, that leads the page's player to time ``t`` (s) of a motion."""
    return Markup('<a href="#player" data-play="{}" data-t="{}">{}</a>').format(motion, t, text)


def stretch(motion: str, t0: float, t1: float) -> Markup:
    """Attributes of an element that leads the player to ``t1`` (s) and is marked from ``t0`` on."""
    return Markup('data-play="{}" data-from="{}" data-t="{}"').format(motion, t0, t1)


def drawing_head(modules: Sequence[Path] = DRAWING) -> Markup:
    """What the head of a page holds that has a player or a figure in space: their style sheet and their modules.

    Parameters
    ----------
    modules : ES modules, each of which the page's scripts import as ``er3a/NAME``
    """
    style = (_HERE / "player.css").read_text(encoding="utf-8")
    library = packed_text((VIEWING / "vendor/three.mjs").read_text(encoding="utf-8"))
    three = Markup('<script type="text/plain" id="three">{}</script>').format(library)
    return Markup("<style>{}</style>{}{}").format(Markup(style), three, import_map(modules))


def _data(
    robot: Robot,
    motions: Sequence[PlayedMotion],
    scene: Scene | None,
    beside: Sequence[Robot],
    signs: Sequence[str],
) -> dict[str, Any]:
    size, floor, arm = drawn_size(robot), floor_of(scene), drawn_arm(robot)
    for look in arm["looks"].values():
        look += stand(robot, floor)
    bases = [arm.base[:3, 3] for arm in (robot, *beside)]
    most = min(MAX_FRAMES, max(MIN_FRAMES, FRAMES_IN_ALL // len(motions)))
    return {
        "table": table_data(robot),
        "size": size,
        **arm,
        "others": [{"table": table_data(arm), **drawn_arm(arm)} for arm in beside],
        "signs": [{"text": text, "at": (at - [0, 0, 0.1 * size]).tolist()} for text, at in zip(signs, bases)],
        "colours": {"touching": TOUCHING, **COLOURS},
        "axes": AXES,
        "floor": floor,
        "scene": drawn_scene(scene.solids if scene else (), robot),
        "carried": drawn_scene(scene.carried if scene else (), robot, robot.rows + 1),
        "motions": [_motion(motion, most) for motion in motions],
        "joints": _joints(robot),
    }


def _corners(shape: Shape) -> Reals:
    """Corners (N, 3) of a body of the scene, m, in the world."""
    T = np.array(shape["T"])
    corners: Reals = triangles_of(shape)[0] @ T[:3, :3].T + T[:3, 3]
    return corners


def framed(data: dict[str, Any], robots: Sequence[Robot], motion: PlayedMotion, turned: float) -> dict[str, Any]:
    """How much has to be seen (m), and around which point, for the picture to hold the arms on their ways and what is
    around them, as far as that is near; ``turned``, rad: of the eye."""
    points = [poses_at(robots[0], q)[:, :3, 3] for q in motion.ghosts]
    for robot, q in zip(robots, (motion.q, *motion.beside)):
        points += [poses_at(robot, q[k])[:, :3, 3] for k in np.linspace(0, len(q) - 1, FRAMED).astype(int)]
    arms, size = np.concatenate(points), data["size"]
    low, high = arms.min(axis=0), arms.max(axis=0)
    bodies = [each for each in data["scene"] if not each.get("large") and each.get("pale") is not True]
    points += [
        corners if "own" in each else corners.clip(low - AROUND * size, high + AROUND * size)
        for each, corners in zip(bodies, map(_corners, bodies))
    ]  # a camera's field is held whole
    points += [np.clip([mark.start], low - size, high + size) for mark in motion.marks]
    axes = axes_of(AZIMUTH + turned, motion.elevation)
    thick = THICK * size * axes[:2].sum(axis=0)
    across = np.concatenate([arms - thick, arms + thick, *points]) @ axes.T
    middle = (across.min(axis=0) + across.max(axis=0)) / 2
    across -= middle
    length = size
    for _ in range(4):  # what is nearer is larger
        nearer = DISTANCE * length / (DISTANCE * length + across[:, 2])
        seen = across[:, :2] * nearer[:, None]
        shift = (seen.min(axis=0) + seen.max(axis=0)) / 2
        middle[:2] += shift
        across[:, :2] -= shift
        width, height = np.ptp(seen, axis=0) / 2 + MARGIN * size
        length = 2 * FIELD / DISTANCE * max(width / WIDE, height / (1 - TITLE))
    middle[1] -= TITLE * height  # upwards
    return {"length": float(length), "target": (middle @ axes).tolist()}


def best_turn(robot: Robot, motion: PlayedMotion, t: float, data: dict[str, Any]) -> float:
    """By how much (rad) the eye is turned to see the arm at a time (s), its way and what is measured then from the
    side, walls along them, and no body before it."""
    q, way = [_at(motion, motion.q, t), *motion.ghosts], forward(robot, motion.q)[:, :3, 3]
    joints = np.array([poses_at(robot, each)[:, :3, 3] for each in q])
    bodies = [(_corners(shape), shape.get("large")) for shape in data["scene"] if "pale" not in shape]
    points = np.concatenate([joints, (joints[:, 1:] + joints[:, :-1]) / 2], axis=1)
    gaps = [np.subtract(mark.end, mark.start) for mark in motion.marks if mark.t0 <= t <= mark.t1 and mark.text]
    if any(event.status == "fail" and event.t <= t <= event.until for event in motion.events):
        gaps = []  # what is inside is seen from no side
    margin = (MARGIN + THICK) * data["size"] / 2
    whole = np.linalg.norm(np.diff(joints, axis=1), axis=2).sum()
    best = []
    for turn in TURNS:
        axes = axes_of(AZIMUTH + turn, motion.elevation).T
        seen = points @ axes
        long = np.linalg.norm(np.diff((joints @ axes)[..., :2], axis=1), axis=2).sum() / whole
        long += WAY_COUNTS * np.linalg.norm(np.ptp((way @ axes)[:, :2], axis=0)) / data["size"]
        long += sum(np.linalg.norm((gap @ axes)[:2]) / np.linalg.norm(gap) for gap in gaps if gap.any())
        hidden = np.zeros(seen.shape[:2], dtype=bool)
        for corners, large in bodies:
            own = corners @ axes
            within = (own.min(axis=0) - margin < seen) & (seen < own.max(axis=0) + margin)
            if large:  # what a wall meets is seen along it
                long -= np.ptp(own[:, 0]) / np.ptp(corners)
            else:  # what an arm reaches into does not hide it
                hidden |= within[..., :2].all(axis=2) & (seen[..., 2] > own[:, 2].max())
        best.append(long - HIDDEN_COSTS * hidden.mean() - TURN_COSTS * abs(turn))
    return float(TURNS[np.argmax(best)])


def _at(motion: PlayedMotion, q: Reals, t: float) -> Reals:
    """Joint values (n,) of a motion at a time, s."""
    return np.array([np.interp(t, motion.t, own) for own in q.T])


def _still(robots: Sequence[Robot], motion: PlayedMotion, data: dict[str, Any]) -> Still:
    """The picture at the moment that the player opens at, which the page shows without WebGL."""
    t = data["opened"][1]
    now = [event for event in motion.events if event.t <= t <= event.until]
    colours = {name: COLOURS.get(event.status, TOUCHING) for event in now for name in event.bodies}
    values = (motion.q, *motion.beside)
    poses = [poses_at(robot, _at(motion, q, t)) for robot, q in zip(robots, values)]
    picture = scene_still(data, poses, colours, data["turned"])
    for q, event in zip(motion.ghosts, motion.events):
        picture.line(poses_at(robots[0], q)[:, :3, 3], COLOURS.get(event.status, BODY), 3.0)
    for robot, q in zip(robots, values):
        picture.line(forward(robot, q[_shown(motion, MAX_FRAMES)])[:, :3, 3], INK, 2.0)
    for mark in motion.marks:
        if mark.t0 <= t <= mark.t1 and mark.start == mark.end:
            picture.dot(np.array(mark.start), "ink", 5.0, rings=True)
            picture.word(mark.text, np.array(mark.start), "fail" if colours else "ink")
        elif mark.t0 <= t <= mark.t1:
            picture.line(np.array([mark.start, mark.end]), INK, 1.5)
    for shape in data["scene"]:
        if "pale" not in shape:
            picture.word(shape["name"], np.array(shape["T"])[:3, 3], "fail" if shape["name"] in colours else "ink")
    return picture


def _joints(robot: Robot) -> list[dict[str, Any]]:
    """Unit and limits of each joint in it, None where it has none."""
    ends = np.round(shown(robot, np.stack([robot.lower, robot.upper])), 6)
    return [
        {"unit": "mm" if slides else "°", "lower": None if free else low, "upper": None if free else high}
        for slides, free, low, high in zip(robot.slides.tolist(), robot.continuous.tolist(), *ends.tolist())
    ]


def table_data(robot: Robot) -> dict[str, Any]:
    """A robot's table and limits as the scripts take them, SI; see ``teach/kinematics.js``."""
    return {
        "convention": robot.convention,
        **{key: getattr(robot, key).tolist() for key in TABLE},
        "tool": robot.last_to_tool.tolist(),
        "slides": robot.slides.tolist(),
        "rank": regular_rank(robot),
        "coupling": None if robot.coupling is None else robot.coupling.tolist(),
        "combined": [asdict(limit) for limit in robot.combined],
    }


def _motion(motion: PlayedMotion, most: int) -> dict[str, Any]:
    rows = _shown(motion, most)
    return {
        "name": motion.name,
        "text": motion.text,
        "whole": motion.whole_s,
        "times": np.round(motion.t[rows], 4).tolist(),
        "values": [_packed(q[rows]) for q in (motion.q, *motion.beside)],
        "ghosts": [q.tolist() for q in motion.ghosts],
        "loads": None if motion.loads is None else _packed(motion.loads[rows]),
        "events": [asdict(event) for event in sorted(motion.events, key=lambda event: event.t)],
        "marks": [
            {"from": mark.start, "to": mark.end, "text": mark.text, "t0": mark.t0, "t1": mark.t1, "arrow": mark.arrow}
            for mark in motion.marks
        ],
    }


def _packed(values: Reals) -> str:
    return base64.b64encode(values.astype("<f4").tobytes()).decode("ascii")


def _shown(motion: PlayedMotion, most: int) -> np.ndarray:
    """Rows to be drawn: evenly spread in time, at most so many, and those next to events."""
    even = np.searchsorted(motion.t, np.linspace(motion.t[0], motion.t[-1], min(most, len(motion.t))))
    events = np.searchsorted(motion.t, [time for event in motion.events for time in (event.t, event.until)])
    rows = np.unique(np.clip(np.concatenate([even, events, [0, len(motion.t) - 1]]), 0, len(motion.t) - 1))
    _, first = np.unique(np.round(motion.t[rows], 4), return_index=True)
    return rows[first].astype(int)


def import_map(files: Iterable[Path]) -> Markup:
    """A page's import map: each ES module as ``er3a/NAME``. It is to precede the page's first module.

    The scripts are data addresses, because a page opened from a disk may not import other files.
    """
    addresses = {f"er3a/{file.stem}": _address(file) for file in files}
    return Markup(f'<script type="importmap">{json.dumps({"imports": addresses})}</script>')


def _address(file: Path) -> str:
    return "data:text/javascript;base64," + base64.b64encode(file.read_bytes()).decode("ascii")
