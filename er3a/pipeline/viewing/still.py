"""Pictures in space without a browser: what a page shows where there is no WebGL, until there is, and without scripts.

Triangles are painted through a buffer of depths, with the eye, the lamp and the shapes of ``space.js``. The same input
gives the same bytes.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from PIL import Image

from er3a.collision.meshes import hull_faces
from er3a.collision.shapes import CORNERS
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.language import N_, tr
from er3a.pipeline.viewing.painting import paint
from er3a.pipeline.viewing.palette import GRID, rgb

WIDTH, HEIGHT = 800, 645  # px, as wide as a player is at the side of a list
FINE = 2  # px of the painting along one of the picture
FIELD = 1.9  # as in space.js: distance of the eye, in heights of the picture at the target
WIDE = 1.2  # as in space.js: width over height of a picture that is filled on both sides
DISTANCE, AZIMUTH, ELEVATION = 3.7, -1.0, 0.35  # as in orbit.js
LAMP = np.array([0.9, -1.3, 2.4]) / np.linalg.norm([0.9, -1.3, 2.4])
AMBIENT, SHADOW, PALE = 0.62, 0.16, 0.28
SIDES, BELTS, GRID_STEPS = 40, 10, 8
PIECES = 32  # of a line of the grid: painting looks at all that is in the rectangle around each
NEARER = 1.002  # a line is painted as if it were nearer, so that the surface that it lies on does not cut it
LETTER = 17  # px, height of words
PLACES = ((0, -1), (0, 1), (0.7, 0), (-0.7, 0))
"""Where a word may be, in its widths and heights from its point, the best place first."""
FLAT = N_("This browser has no WebGL: the picture shows how the page opened.")
QUALITY = 80  # of the WebP file


def axes_of(azimuth: float, elevation: float) -> Reals:
    """The directions to the right, down and away, (3, 3), of an eye that looks from there, rad."""
    ca, sa, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    back, right = np.array([ca * ce, sa * ce, se]), np.array([-sa, ca, 0.0])
    return np.stack([right, -np.cross(back, right), -back])


class Still:
    """A picture as it is being made; points in m, colours ``#rrggbb``."""

    def __init__(
        self,
        target: Reals,
        length: float,
        azimuth: float = AZIMUTH,
        elevation: float = ELEVATION,
        floor: float | None = None,
    ) -> None:
        self.axes = axes_of(azimuth, elevation)
        self.eye, self.floor = np.asarray(target) - DISTANCE * length * self.axes[2], floor
        shape = (HEIGHT * FINE, WIDTH * FINE)
        self.bodies, self.shadow = ((np.zeros((*shape, k), "f4"), np.zeros(shape, "f4")) for k in (4, 1))
        self.words: list[Markup] = []
        self.taken: list[tuple[float, float, float, float]] = []

    def seen(self, points: Reals) -> Reals:
        """Points (..., 3), m, as x and y in px of the painting and 1 / depth."""
        across, down, depth = np.moveaxis((points - self.eye) @ self.axes.T, -1, 0)
        zoom = HEIGHT * FIELD * FINE / np.maximum(depth, 1e-9)
        inverse = np.where(depth > 0, 1 / np.maximum(depth, 1e-9), 0.0)
        seen: Reals = np.stack([WIDTH * FINE / 2 + zoom * across, HEIGHT * FINE / 2 + zoom * down, inverse], axis=-1)
        return seen

    def solids(self, shapes: Sequence[Mapping[str, Any]], poses: Reals, colours: Mapping[str, str]) -> None:
        """Shapes of ``drawn.py`` in frames at ``poses`` (k, 4, 4); bodies named in ``colours`` are in these."""
        for shape in sorted(shapes, key=lambda each: "pale" in each):
            T = poses[min(shape["frame"], len(poses) - 1)] @ np.array(shape["T"])
            points, faces = triangles_of(shape)
            colour = colours.get(shape["name"], shape["colour"])
            alpha = shape.get("pale", 1.0)
            self.surface(points @ T[:3, :3].T + T[:3, 3], faces, colour, PALE if alpha is True else alpha)

    def surface(self, points: Reals, faces: Integers, colour: str, alpha: float = 1.0) -> None:
        """A surface of triangles (M, 3) between points (N, 3), and its shadow unless it lets light through."""
        corners = points[faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
        away = np.einsum("ij,ij->i", normals, self.eye - corners[:, 0]) < 0
        normals[away] *= -1
        light = AMBIENT + (1 - AMBIENT) * np.maximum(0.0, normals @ LAMP) + 0.12 * normals[:, 2]
        shades = np.minimum(1.0, light[:, None] * np.array(rgb(colour)) / 255)
        if alpha == 1.0 and self.floor is not None:
            fallen = corners - ((corners[..., 2] - self.floor) / LAMP[2])[..., None] * LAMP
            above = (corners[..., 2] > self.floor).all(axis=1)
            paint(self.seen(fallen[above]), np.ones((int(above.sum()), 1)), *self.shadow)
        shades = alpha * np.column_stack([shades, np.ones(len(shades))])
        paint(self.seen(corners), shades, *self.bodies)

    def line(self, points: Reals, colour: str, width: float) -> None:
        """A line through points (N, 3), ``width`` px wide."""
        seen = self.seen(np.asarray(points, dtype=float))
        starts, ends = seen[:-1], seen[1:]
        way = ends[:, :2] - starts[:, :2]
        length = np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
        side = np.zeros_like(starts)
        side[:, :2] = 0.5 * width * FINE * np.stack([-way[:, 1], way[:, 0]], axis=1) / length
        quads = np.stack([starts - side, starts + side, ends + side, ends - side], axis=1)
        quads[..., 2] *= NEARER
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        shades = np.tile([*np.array(rgb(colour)) / 255, 1.0], (len(triangles), 1))
        paint(triangles, shades, *self.bodies)

    def grid(self, centre: Reals, step: float) -> None:
        """A square floor around a point, at the height that shadows fall to."""
        half = GRID_STEPS * step
        for at in np.arange(-GRID_STEPS, GRID_STEPS + 1) * step:
            for ends in (((at, -half), (at, half)), ((-half, at), (half, at))):
                first, last = np.array([[centre[0] + x, centre[1] + y, self.floor] for x, y in ends])
                self.line(np.linspace(first, last, PIECES + 1), GRID, 1.0)

    def dot(self, point: Reals, colour: str, radius: float, rings: bool = False) -> None:
        """A dot at a point (3,), and rings around it where it is to be found at once; a colour of the page's style."""
        x, y, _ = self.seen(np.asarray(point, dtype=float)) / FINE
        circle = '<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" style="{}"/>'
        self.words.append(Markup(circle).format(x, y, radius, f"fill: var(--{colour})"))
        for share in (2.4, 4.0) if rings else ():
            look = f"fill: none; stroke: var(--{colour}); stroke-width: {4 / share:.1f}"
            self.words.append(Markup(circle).format(x, y, share * radius, look))
        width = (8 if rings else 2) * radius
        self.taken.append((x, y, width, width))

    def word(self, text: str, point: Reals, colour: str = "ink") -> None:
        """A word near a point (3,), where there is room for it; a colour of the page's style."""
        x, y, _ = self.seen(np.asarray(point, dtype=float)) / FINE
        width, height = 0.62 * LETTER * len(text), 1.2 * LETTER
        for i, j in PLACES:
            u, v = x + i * width, y + j * height
            if all(abs(u - a) > (width + w) / 2 or abs(v - b) > (height + h) / 2 for a, b, w, h in self.taken):
                self.taken.append((u, v, width, height))
                look = f"fill: var(--{colour}); stroke: var(--card); font-size: {LETTER}px"
                self.words.append(Markup('<text x="{:.1f}" y="{:.1f}" style="{}">{}</text>').format(u, v, look, text))
                return

    def picture(self) -> bytes:
        """The picture without its words, as a WebP file."""
        parts: Reals = np.zeros((HEIGHT, WIDTH, 4), "f4")
        for i, j in np.ndindex(FINE, FINE):
            body, shadow = (layer[0][i::FINE, j::FINE] for layer in (self.bodies, self.shadow))
            parts += body
            parts[..., 3:] += SHADOW * (1 - body[..., 3:]) * shadow
        parts /= FINE**2
        parts[..., :3] /= np.maximum(parts[..., 3:], 1e-6)
        file = io.BytesIO()
        Image.fromarray(np.round(255 * np.clip(parts, 0, 1)).astype(np.uint8)).save(file, "webp", quality=QUALITY)
        return file.getvalue()

    def markup(self) -> Markup:
        """The picture with its words as HTML: what the script of a page writes its own words over."""
        source = "data:image/webp;base64," + base64.b64encode(self.picture()).decode("ascii")
        words = Markup("").join(self.words)
        picture = Markup('<img class="still" alt="" src="{}">').format(source)
        over = '<svg class="words" viewBox="0 0 {} {}" aria-hidden="true">{}</svg><p class="flat">{}</p>'
        return picture + Markup(over).format(WIDTH, HEIGHT, words, tr(FLAT))


def scene_still(
    data: Mapping[str, Any], poses: Sequence[Reals], colours: Mapping[str, str], turned: float = 0.0
) -> Still:
    """Arms in their surroundings.

    Parameters
    ----------
    data : as the scripts take it: ``target``, ``length``, ``floor``, ``scene``; of the first arm ``table``, ``size``,
        ``looks``, ``carried``; of ``others``, if any, the looks
    poses : of each arm those of its frames, (k, 4, 4), see ``drawn.poses_at``
    colours : of bodies by name, where not their own
    turned : rad, by which the eye is turned from where it is at first
    """
    base = np.array(data["table"]["base"])[:3, 3]
    floor = base[2] if data["floor"] is None else data["floor"]
    elevation = data.get("elevation", ELEVATION)
    picture = Still(data["target"], data["length"], AZIMUTH + turned, elevation, floor=floor)
    picture.grid(base, data["size"] / 10)
    picture.solids(data["scene"], np.eye(4)[None], colours)
    for arm, T in zip((data, *data.get("others", ())), poses):
        looks = arm["looks"]
        picture.solids([*looks.get("visual", looks["checked"]), *arm.get("carried", ())], T, colours)
    return picture


def triangles_of(shape: Mapping[str, Any]) -> tuple[Reals, Integers]:
    """Points (N, 3), m, in the shape's own frame, and faces (M, 3) of a shape of ``drawn.py``."""
    if shape["kind"] == "mesh":
        return np.array(shape["points"], dtype=float), np.array(shape["faces"])
    if shape["kind"] == "box":
        corners = CORNERS * shape["size"]
        return corners, hull_faces(corners)
    half, radius = shape.get("length", 0.0) / 2, shape["radius"]
    if shape["kind"] == "cylinder":
        return _turned(np.array([[0.0, -half], [radius, -half], [radius, half], [0.0, half]]))
    rise = np.linspace(-np.pi / 2, np.pi / 2, 2 * BELTS + 2)
    ends = half * np.where(rise < 0, -1, 1)
    return _turned(np.stack([radius * np.cos(rise), radius * np.sin(rise) + ends], axis=1))


def _turned(profile: Reals) -> tuple[Reals, Integers]:
    """The surface that a profile (n, 2), distance from z and height (m) from below, makes when it turns about z."""
    turn = np.linspace(0.0, 2 * np.pi, SIDES, endpoint=False)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    points = np.concatenate([np.column_stack([r * circle, np.full(SIDES, z)]) for r, z in profile])
    belt, side = np.meshgrid(np.arange(len(profile) - 1), np.arange(SIDES), indexing="ij")
    a, b = belt * SIDES + side, belt * SIDES + (side + 1) % SIDES
    quads = np.stack([a, b, b + SIDES, a + SIDES], axis=-1).reshape(-1, 4)
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
