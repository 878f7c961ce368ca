"""Six joints, the last three about axes that meet and one of the first three a slide: all solutions, up to eight.

The pose gives the wrist centre. One of the two joints that turn before it goes out with what it leaves as it is: height
along its axis and distance from its origin. With d the slide, and X, Y the place of the centre across the axis of the
other one, both are ``a X + b Y + g = 0``, with coefficients that are polynomials of d, and ``X^2 + Y^2 = n(d)``: a
quartic in d [1]_, or, where both lines are parallel for all d (axes that meet or are parallel), an equation of lower
degree. Newton's method on the three equations decides what is a solution. The wrist then has two.

Where rows meet or a joint is free, the general solver looks at the pose.

References
----------
.. [1] D. L. Pieper, *The Kinematics of Manipulators under Computer Control*, thesis, Stanford (1968).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from er3a.by_value import by_identity
from er3a.geometry.transforms import frame_along, inverted
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.chain import axes_of, meeting_point, poses_of, size_of
from er3a.kinematics.classes.arm_angle import SphericalConstants, spherical_constants
from er3a.kinematics.classes.scara import wrist_angles
from er3a.kinematics.classes.six_revolute import CERTAIN, SLOTS, UNCERTAIN, RowsFound, in_order
from er3a.numerics.arrays import Flags, Reals, zeros_of

MEETS = 1e-9  # of the size, by which axes miss the wrist centre; sine between neighbouring axes of the wrist
PARALLEL = 1e-11  # of the lines' coefficients, by which they are parallel for all d
PLACES = DEGREE = 4  # of joints 1 to 3 for one wrist centre
NEARLY_REAL, NEARLY_MEETS = 1e-3, 1e-4  # of the size: roots and lines next to the circle that Newton's method begins at
NEAR = 1e-2  # of the size: a root that nothing so near to it solves leaves a doubt
ROUNDS = 10  # of Newton's method, always all of them
EXACT, SOLVES = 1e-15, 1e-12  # errors of the equations
SAME, APART = 1e-9, 1e-5  # of the size: nearer places are one; nearer than the second they may be two that meet
REGULAR = 1e-6  # determinant of the three equations, distance from an axis: a doubt below
WRIST = 1e-9  # squared half tilt of the wrist, about
POSE = 1e-10  # what rows may miss a pose by


@by_identity
class SlideAndWrist:
    """The solver of one arm, lengths in units of its size.

    The wrist centre before joint ``first`` (from 0), the first that turns, is ``A + d e`` with A of the pose, and
    after it ``y0 + d f + X y1 + Y y2``; ``v0 + d v1`` is the place before joint ``second``, of which ``n`` is the
    square across its axis.
    """

    links: Reals
    size: float
    sliding: Flags
    first: int
    second: int
    centre_in_tool: Reals
    e: Reals
    y0: Reals
    f: Reals
    y1: Reals
    y2: Reals
    v0: Reals
    v1: Reals
    wrist: SphericalConstants
    frame: Reals
    behind: Reals


def slide_and_wrist(links: Reals, sliding: Flags) -> SlideAndWrist | None:
    """Recognise six joints with a spherical wrist and one slide among the first three.

    Parameters
    ----------
    links : (7, 4, 4), m
    sliding : (6,), prismatic joints

    Returns
    -------
    solver : None if the chain is of another kind
    """
    slides = np.flatnonzero(sliding)
    if len(slides) != 1 or slides[0] > 2:
        return None
    size = size_of(links)
    L = np.array(links, float)
    L[:, :3, 3] /= size
    axes, points = axes_of(L)
    if min(np.linalg.norm(np.cross(axes[k], axes[k + 1])) for k in (3, 4)) < MEETS:
        return None
    centre, miss = meeting_point(axes[3:], points[3:])
    if miss > MEETS:
        return None
    before_3 = poses_of(L[:3], np.zeros(2))  # frame of joint 3 with all at 0
    c = inverted(before_3)[:3, :3] @ centre + inverted(before_3)[:3, 3]
    slide, z, none = int(slides[0]), np.array([0.0, 0.0, 1.0]), np.zeros(3)
    (R1, t1), (R2, t2) = ((L[k, :3, :3], L[k, :3, 3]) for k in (1, 2))
    if slide == 2:
        v0, v1 = R2 @ c + t2, R2 @ z
        R, y0, f, e = R1, t1 + v0[2] * R1[:, 2], v1[2] * R1[:, 2], none
    else:
        v0, v1 = c, none
        R, y0 = R2, t2 + c[2] * R2[:, 2]
        f, e = none, -R1.T @ z
        if slide == 1:
            R, y0, f, e = R1 @ R2, R1 @ y0 + t1, R1[:, 2], none
    frame = frame_along(axes[3])
    wrist, G = spherical_constants(axes[3:], frame)
    T = poses_of(L, np.zeros(6))
    first, second = (j for j in range(3) if j != slide)
    tool = inverted(T)
    in_tool = tool[:3, :3] @ centre + tool[:3, 3]
    sliding = np.asarray(sliding, dtype=bool)
    return SlideAndWrist(
        L, size, sliding, first, second, in_tool, e, y0, f, R[:, 0], R[:, 1], v0, v1, wrist, frame, T[:3, :3].T @ G
    )


def solve_slide_and_wrist(arm: SlideAndWrist, otherwise: Callable[[Reals], RowsFound], T: Reals) -> RowsFound:
    """All solutions for poses, by a quartic of the slide [1]_; those in doubt by another solver.

    Parameters
    ----------
    otherwise : solves poses (k, 4, 4), m, in general
    T : (N, 4, 4), m

    Returns
    -------
    found : (N, 16, 6), rad and m, NaN after the last
    """
    T = np.ascontiguousarray(T, dtype=float)
    scaled = T.copy()
    scaled[:, :3, 3] /= arm.size
    q, count = np.full((len(T), SLOTS, 6), np.nan), np.zeros(len(T), dtype=np.int64)
    certainty = np.full(len(T), CERTAIN)
    front, doubt = _before_wrist(arm, scaled)
    n, place = np.nonzero(np.isfinite(front[..., 0]))
    x = np.zeros((len(n), 2, 6))
    x[:, :, :3] = front[n, place, None]
    turned = poses_of(arm.links[:4], x[:, 0, :3], arm.sliding[:3])[:, :3, :3]
    zero = poses_of(arm.links[:4], np.zeros(3))[:3, :3]
    smallest = np.empty(len(n))
    turn = arm.frame @ zero @ turned.transpose(0, 2, 1) @ scaled[n, :3, :3] @ arm.behind
    wrist_angles(arm.wrist, np.ascontiguousarray(turn), x[:, :, 3:], smallest)
    x[..., ~arm.sliding] = wrap_to_pi(x[..., ~arm.sliding])
    solved = np.isfinite(x[..., 3])
    off = np.abs(poses_of(arm.links, x, arm.sliding) - scaled[n, None]).max(axis=(2, 3))
    doubt[n[(np.abs(smallest) < WRIST) | (off > POSE).any(axis=1)]] = True
    for row, root in np.argwhere(solved):
        q[n[row], count[n[row]]] = x[row, root]
        count[n[row]] += 1
    in_order(q, count)
    q[:, :, arm.sliding] *= arm.size
    if doubt.any():
        rest = otherwise(T[doubt])
        q[doubt], count[doubt], certainty[doubt] = rest.q, rest.count, np.maximum(rest.certainty, UNCERTAIN)
    return RowsFound(q, count, certainty)


def _before_wrist(arm: SlideAndWrist, T: Reals) -> tuple[Reals, Flags]:
    """Joints 1 to 3 (N, 4, 3) that take the wrist centre where the poses have it, NaN where there are none; poses in
    doubt (N,)."""
    centre = np.append(arm.centre_in_tool, 1.0)[:, None]
    start = inverted(arm.links[0] @ arm.links[1] if arm.first == 1 else arm.links[0])
    A = (start @ (T @ centre))[:, :3, 0]
    places, doubt = _places(arm, A)
    X, Y, d = np.moveaxis(places, -1, 0)
    y = arm.y0 + d[..., None] * arm.f + X[..., None] * arm.y1 + Y[..., None] * arm.y2
    p = A[:, None] + d[..., None] * arm.e
    v = arm.v0 + d[..., None] * arm.v1
    close = np.minimum(np.hypot(p[..., 0], p[..., 1]), np.hypot(X, Y)) < REGULAR
    joints = np.empty(places.shape)
    joints[..., arm.first] = np.arctan2(p[..., 1], p[..., 0]) - np.arctan2(y[..., 1], y[..., 0])
    joints[..., arm.second] = np.arctan2(Y, X) - np.arctan2(v[..., 1], v[..., 0])
    joints[..., 3 - arm.first - arm.second] = d
    return joints, doubt | close.any(axis=1)


def _places(arm: SlideAndWrist, A: Reals) -> tuple[Reals, Flags]:
    """X, Y, d (N, 4, 3) of each place for points A (N, 3), NaN where there are none; points in doubt (N,)."""
    count = len(A)
    lines, n = _equations(arm, A)
    d, doubt = _slides(lines, n)
    crosses = arm.y1[2] ** 2 + arm.y2[2] ** 2 > PARALLEL
    a, b, g = (_at(part, d) for part in lines[0 if crosses else 1])
    with np.errstate(all="ignore"):
        over = 1 / (a * a + b * b)
        beside = _at(n, d) - g * g * over
        root = np.where(beside < -NEARLY_MEETS, np.nan, np.sqrt(np.maximum(beside, 0.0) * over))
    starts = [np.stack([-g * a * over - b * side, -g * b * over + a * side, d], axis=-1) for side in (root, -root)]
    candidates, error, determinant = _polished(lines, n, np.concatenate(starts, axis=1))
    tried, solved = np.isfinite(candidates[..., 0]), error < SOLVES * (1 + np.abs(candidates).max(axis=2)) ** 2
    places, filled = np.full((count, PLACES, 3), np.nan), np.zeros(count, dtype=np.int64)
    for k in range(candidates.shape[1]):
        away = np.abs(places - candidates[:, k, None]).max(axis=2)
        away = np.where(np.isnan(away), np.inf, away).min(axis=1)
        doubt |= solved[:, k] & (((away > SAME) & (away < APART)) | (determinant[:, k] < REGULAR))
        new = solved[:, k] & (away >= SAME)
        doubt |= new & (filled == PLACES)
        rows = np.flatnonzero(new & (filled < PLACES))
        places[rows, filled[rows]] = candidates[rows, k]
        filled[rows] += 1
    kept = solved & (np.abs(candidates[..., 2] - np.tile(d, 2)) < NEAR * (1 + np.abs(np.tile(d, 2))))
    lost = tried.reshape(count, 2, -1).any(axis=1) & ~kept.reshape(count, 2, -1).any(axis=1)
    return places, doubt | lost.any(axis=1)


def _equations(arm: SlideAndWrist, A: Reals) -> tuple[Reals, Reals]:
    """Coefficients (2, 3, N, 3) of a, b, g in 1, d, d^2 of both lines, and those of n (N, 3)."""
    count = len(A)
    lines, n = np.zeros((2, 3, count, 3)), np.zeros((count, 3))
    for part, y in enumerate((arm.y1, arm.y2)):
        lines[0, part, :, 0] = y[2]
        lines[1, part, :, :2] = 2 * (arm.y0 @ y), 2 * (arm.f @ y)
    v0, v1 = arm.v0[:2], arm.v1[:2]
    n[:] = v0 @ v0, 2 * (v0 @ v1), v1 @ v1
    lines[0, 2, :, 0], lines[0, 2, :, 1] = arm.y0[2] - A[:, 2], arm.f[2] - arm.e[2]
    behind = np.array([arm.y0 @ arm.y0, 2 * (arm.y0 @ arm.f), arm.f @ arm.f])
    before = np.stack([(A * A).sum(axis=1), 2 * (A * arm.e).sum(axis=1), np.full(count, arm.e @ arm.e)], axis=1)
    lines[1, 2] = n + behind - before
    # the second line less its share, linear in d, along the first: what is left is across it
    a, b = arm.y1[2], arm.y2[2]
    if a * a + b * b > PARALLEL:
        share = (lines[1, 0] * a + lines[1, 1] * b) / (a * a + b * b)
        for part in range(3):
            lines[1, part] -= _product(share, lines[0, part])[:, :3]
    return lines, n


def _slides(lines: Reals, n: Reals) -> tuple[Reals, Flags]:
    """Values d (N, up to 4) at which the lines may meet on the circle, NaN where there are less; points in doubt."""
    (a1, b1, g1), (a2, b2, g2) = lines
    cross = _product(a1, b2) - _product(a2, b1)
    if np.abs(cross).max(initial=0.0) > PARALLEL:
        left, right = _product(b1, g2) - _product(b2, g1), _product(a2, g1) - _product(a1, g2)
        polynomial = (_product(left, left) + _product(right, right))[:, : DEGREE + 1]
        polynomial = polynomial - _product(n, _product(cross, cross))[:, : DEGREE + 1]
    else:
        polynomial = g2 if np.abs([a1, b1]).max(initial=0.0) > np.sqrt(PARALLEL) else g1
    size = np.abs(polynomial).max(axis=1, initial=0.0)
    d, degree = np.full((len(n), DEGREE), np.nan), np.zeros(len(n), dtype=int)
    for k in range(1, polynomial.shape[1]):
        degree[np.abs(polynomial[:, k]) > PARALLEL * size] = k
    for own in np.unique(degree[degree > 0]).tolist():
        at = degree == own
        roots = zeros_of(polynomial[at, : own + 1])
        d[at, :own] = np.where(np.abs(roots.imag) < NEARLY_REAL * (1 + np.abs(roots)), roots.real, np.nan)
    return d, size < PARALLEL


def _polished(lines: Reals, n: Reals, found: Reals) -> tuple[Reals, Reals, Reals]:
    """X, Y, d (N, k, 3) moved to solutions of the three equations; their errors, and the equations' determinants (N, k)
    in parts of their rows' lengths."""
    best, error, determinant = found, np.full(found.shape[:2], np.inf), np.zeros(found.shape[:2])
    (a1, b1, g1), (a2, b2, g2) = lines
    with np.errstate(all="ignore"):
        for _ in range(ROUNDS):  # as many for each pose, whatever its batch
            X, Y, d = np.moveaxis(found, -1, 0)
            a, b, c, e = _at(a1, d), _at(b1, d), _at(a2, d), _at(b2, d)
            value_1, value_2 = a * X + b * Y + _at(g1, d), c * X + e * Y + _at(g2, d)
            value_3 = X * X + Y * Y - _at(n, d)
            u = _slope(a1, d) * X + _slope(b1, d) * Y + _slope(g1, d)
            v = _slope(a2, d) * X + _slope(b2, d) * Y + _slope(g2, d)
            w = -_slope(n, d)
            # Cramer's rule for rows (a, b, u), (c, e, v), (2 X, 2 Y, w)
            minor_1, minor_2, minor_3 = e * w - 2 * v * Y, 2 * v * X - c * w, 2 * (c * Y - e * X)
            total = a * minor_1 + b * minor_2 + u * minor_3
            now = np.maximum(np.maximum(np.abs(value_1), np.abs(value_2)), np.abs(value_3))
            better = (now < error) & (error > EXACT)
            lengths = (a * a + b * b + u * u) * (c * c + e * e + v * v) * (4 * (X * X + Y * Y) + w * w)
            best = np.where(better[..., None], found, best)
            error, determinant = (
                np.where(better, now, error),
                np.where(better, np.abs(total) / np.sqrt(lengths), determinant),
            )
            p = value_1 * minor_1 + value_2 * (2 * u * Y - b * w) + value_3 * (b * v - u * e)
            q = value_1 * minor_2 + value_2 * (a * w - 2 * u * X) + value_3 * (u * c - a * v)
            r = value_1 * minor_3 + value_2 * 2 * (b * X - a * Y) + value_3 * (a * e - b * c)
            found = found - np.stack([p, q, r], axis=-1) / total[..., None]
    return best, error, determinant


def _at(polynomial: Reals, d: Reals) -> Reals:
    """Values (N, k) of polynomials (N, 3) at d (N, k)."""
    c0, c1, c2 = polynomial.T[:, :, None]
    return np.asarray(c0 + d * (c1 + d * c2))


def _slope(polynomial: Reals, d: Reals) -> Reals:
    """Derivatives (N, k) of polynomials (N, 3) at d (N, k)."""
    _, c1, c2 = polynomial.T[:, :, None]
    return np.asarray(c1 + 2 * d * c2)


def _product(p: Reals, q: Reals) -> Reals:
    """Products (N, k + l - 1) of polynomials (N, k) and (N, l)."""
    out = np.zeros((len(p), p.shape[1] + q.shape[1] - 1))
    for k in range(p.shape[1]):
        out[:, k : k + q.shape[1]] += p[:, k, None] * q
    return out
