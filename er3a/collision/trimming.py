"""Parts of bodies: without the region around a joint in which they touch the next link, and balls inside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from er3a.collision.shapes import Body
from er3a.numerics.arrays import Reals

SHORTEST = 1e-6  # m


def girth(body: Body, centre: Reals, within: float = np.inf) -> float:
    """How far a body stands out from the line that leads from ``centre`` (3,) through its middle, m.

    Of a hull only what is nearer than ``within`` (m) in the direction of its middle counts.
    """
    along = body.points.mean(axis=0) - centre
    length = float(np.linalg.norm(along))
    hull = len(body.points) > 2
    away = (_split(body, centre, within)[0] if hull and np.isfinite(within) else body.points) - centre
    if not len(away):
        return body.radius + body.disc
    if length > SHORTEST:
        away = away - np.outer(away @ along, along) / length**2
    return float(np.linalg.norm(away, axis=1).max()) + body.radius + body.disc


def ball_inside(body: Body, point: Reals) -> Body | None:
    """The largest ball about a point (3,), m, that is inside a body; None where the point is not inside its surface."""
    if len(body.points) > 2:
        try:
            faces = scipy.spatial.ConvexHull(body.points).equations
        except scipy.spatial.QhullError:  # flat
            return None
        depth = -float((faces @ np.append(point, 1.0)).max())
        depth = depth + body.radius if depth >= 0 else 0.0
    else:
        start, along = body.points[0], body.points[-1] - body.points[0]
        share = np.clip((point - start) @ along / max(float(along @ along), SHORTEST**2), 0.0, 1.0)
        depth = body.radius - float(np.linalg.norm(point - start - share * along))
    return replace(body, points=point[None], radius=depth) if depth > 0 else None


def trimmed(body: Body, centre: Reals, radius: float) -> list[Body]:
    """What is left of a body without the region around a joint.

    Of a line the part outside the ball about ``centre`` (3,) with ``radius`` (m), of a hull the part that is farther
    than that in the direction of its middle.
    """
    if len(body.points) > 2:
        return _clipped(body, centre, radius)
    start, end = body.points[0], body.points[-1]
    along, away = end - start, start - centre
    length = float(along @ along)
    if length <= SHORTEST**2:
        return [body] if np.linalg.norm(away) > radius else []
    return _outside(body, away, along, radius)


def beside_axis(body: Body, point: Reals, axis: Reals, radius: float) -> list[Body]:
    """What is left of a line that is farther than ``radius`` (m) from an axis through a point, both (3,)."""
    start, along = body.points[0] - point, body.points[-1] - body.points[0]
    away, across = start - (start @ axis) * axis, along - (along @ axis) * axis
    if across @ across <= SHORTEST**2:
        return [body] if np.linalg.norm(away) > radius else []
    return _outside(body, away, across, radius)


def _outside(body: Body, away: Reals, along: Reals, radius: float) -> list[Body]:
    """The parts of a body's line where ``away + s along``, s from 0 to 1, is longer than ``radius``."""
    length = float(along @ along)
    middle, half = -float(away @ along) / length, float((away @ along) ** 2 - length * (away @ away - radius**2))
    if half <= 0:
        return [body]
    half = float(np.sqrt(half)) / length
    parts = [(0.0, min(1.0, middle - half)), (max(0.0, middle + half), 1.0)]
    start, line = body.points[0], body.points[-1] - body.points[0]
    return [
        replace(body, points=np.array([start + low * line, start + high * line]))
        for low, high in parts
        if high > low and (high - low) ** 2 * length > SHORTEST**2
    ]


def _clipped(body: Body, centre: Reals, radius: float) -> list[Body]:
    near, points = _split(body, centre, radius)
    if not len(points):
        return []
    if not len(near):
        return [body]
    try:
        points = points[scipy.spatial.ConvexHull(points).vertices]
    except scipy.spatial.QhullError:  # a sliver
        return []
    return [replace(body, points=points)]


def _split(body: Body, centre: Reals, radius: float) -> tuple[Reals, Reals]:
    """Corners (n, 3) of a hull's parts nearer and farther than ``radius`` in the direction of its middle."""
    outward = body.points.mean(axis=0) - centre
    outward /= max(float(np.linalg.norm(outward)), SHORTEST)
    height = (body.points - centre) @ outward - radius
    kept, cut = body.points[height >= 0], body.points[height < 0]
    if not (len(kept) and len(cut)):
        return cut, kept
    share = (height[height >= 0][:, None] / (height[height >= 0][:, None] - height[height < 0]))[..., None]
    crossings = (kept[:, None] + share * (cut[None] - kept[:, None])).reshape(-1, 3)
    return np.concatenate([cut, crossings]), np.concatenate([kept, crossings])
