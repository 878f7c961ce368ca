"""Two arms matched axis by axis: geometry separated from free choices.

Two serial arms are the same mechanism if, at some joint values, a rigid transform maps the joint axes of one onto those
of the other (as lines; for prismatic joints, as directions). Of a table with rows ``L_k = Tz(d_k) Tx(a_k) Rx(alpha_k)
Ry(beta_k)`` between the motions ``Rz(theta_k)`` these are free choices [1]_ [2]_:

- the sense of each axis and of each common normal (``senses``, ``normals``): signs of a, alpha, d, half turns of theta;
- at each joint what commutes with its motion: the zero, and a shift along the axis. Between parallel axes that shift
  moves to the next row without effect, so only the sum of the d is known; prismatic joints have no location;
- everything before the first joint and after the last: base and flange.

All sign choices are tried. Everything else is linear once the directions agree: translations ``t_k`` of the rows differ
by ``c_k - R_k c_(k+1)`` with free shifts c, and by what entries differ. The smallest set of entries that explains the
difference is taken.

Axes less than ``NEARLY_PARALLEL`` apart have common normals far away, which measurement errors move by metres. They are
compared in two forms, and the one with fewer differences counts: by their normals, which is exact, and by where the
next axis crosses the plane across this one (Hayati's beta), which does not magnify errors. In the second form they
count as parallel, as long as a shift along one stays on the other to within the tolerances. Axes that are parallel in
only one of the two arms can be compared in the second form only.

References
----------
.. [1] J. Denavit, R. S. Hartenberg, "A kinematic notation for lower-pair mechanisms", J. Applied Mechanics 22 (1955).
.. [2] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, section 2.8.2.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.geometry.transforms import exp_rotation, rot_x, rot_y, rot_z, rotation_angle, translation
from er3a.geometry.vectors import wrap_to_pi
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.robots.robot import Robot

Parts = tuple[Reals, Reals, Reals]
"""Of a matrix, its singular value decomposition."""

EXACTLY_PARALLEL = 1e-5  # rad; below it a common normal has no digits left
NEARLY_PARALLEL = math.radians(3.0)  # below it a common normal can be far outside the arm
ON_AXIS = 1e-9  # m
MAX_SENSES = 6
MAX_ENTRIES = 4
TURNED_END = 2  # joints reversed, that a base or flange turned counts for; 1 if an offset at that end would do it
ENTRY = 2.0  # of geometry that differs, in conventions that do
HALF_TURN = rot_x(math.pi)
MAX_HALF_TURN = math.radians(185.0)


TOLERANCE_MM, TOLERANCE_DEG = 0.5, 0.1  # lengths and angles that differ by at most this are equal, unless asked for


@frozen
class Tolerances:
    """By how much entries may differ and still agree: m and rad."""

    length: float = TOLERANCE_MM / 1000
    angle: float = math.radians(TOLERANCE_DEG)

    def exceeded(self, zeros: Reals, sliding: Flags) -> Flags:
        """Which zeros differ by more.

        Parameters
        ----------
        zeros : (m,), rad, or m for rows that slide
        sliding : (m,) bool

        Returns
        -------
        exceeded : (m,) bool
        """
        return np.asarray(np.abs(zeros) > np.where(sliding, self.length, self.angle))


@by_identity
class Mechanism:
    """A table in standard form: ``base Rz(theta_1) L_1 ... Rz(theta_m) flange``, theta = direction * u + offset.

    Attributes
    ----------
    alpha, beta : (m - 1,), rad; a : (m - 1,), m, of the links between two axes
    d : (m,), m; of the first joint and the last it is 0, for base and flange hold it
    offset, direction, sliding : (m,); start : (m,), m, what the shift of a joint that slides begins with
    base, flange : (4, 4), m, before the first joint and after the last
    """

    a: Reals
    alpha: Reals
    beta: Reals
    d: Reals
    offset: Reals
    direction: Reals
    sliding: Flags
    base: Reals
    flange: Reals

    @cached_property
    def between(self) -> Reals:
        """Angles (m - 1,), rad, 0 to pi/2, between neighbouring axes as lines."""
        across = np.hypot(np.sin(self.beta), np.sin(self.alpha) * np.cos(self.beta))
        angles: Reals = np.arctan2(across, np.abs(np.cos(self.alpha) * np.cos(self.beta)))
        return angles


def mechanism_of(robot: Robot, *, ends: bool = True, **otherwise: Reals | str) -> Mechanism:
    """A robot's table in standard form, without its tool.

    Parameters
    ----------
    ends : False to leave out base and flange: they are identities then
    otherwise : columns (m,), m or rad, and a convention, in place of the robot's

    Returns
    -------
    mechanism : modified (Craig) rows are read as standard ones, m and rad
    """
    table = {key: otherwise.get(key, getattr(robot, key)) for key in (*_COLUMNS, "convention")}
    a, alpha, beta, d, offset = (np.array(table[column], float) for column in _COLUMNS)
    base, flange, last = robot.base, robot.flange, len(d) - 1
    if table["convention"] == "modified":  # what follows an axis is one row later
        before, (a, alpha, beta) = (a[0], alpha[0], beta[0]), (np.append(each[1:], 0.0) for each in (a, alpha, beta))
        if ends:
            base = base @ _across(*before)
    elif ends:
        flange = _across(a[last], alpha[last], beta[last]) @ flange
    if ends:
        base, flange = (base @ translation(0, 0, d[0]) if last else base), translation(0, 0, d[last]) @ flange
    else:
        base = flange = np.eye(4)
    d[0] = d[last] = 0.0
    links = a[:last], alpha[:last], beta[:last]
    return Mechanism(*links, d, offset, np.array(robot.direction), robot.sliding, base, flange)


_COLUMNS = "a", "alpha", "beta", "d", "offset"


def _across(a: float, alpha: float, beta: float) -> Reals:
    """(4, 4), ``Tx(a) Rx(alpha) Ry(beta)``."""
    return translation(a, 0, 0) @ rot_x(alpha) @ rot_y(beta)


def _turns_across(mechanism: Mechanism) -> Reals:
    """``Rx(alpha) Ry(beta)`` of all links, (m - 1, 3, 3)."""
    (ca, cb), (sa, sb) = ([part(angle) for angle in (mechanism.alpha, mechanism.beta)] for part in (np.cos, np.sin))
    nothing = np.zeros(len(ca))
    rows = [cb, nothing, sb], [sa * sb, ca, -sa * cb], [-ca * sb, sa, ca * cb]
    return np.array(rows).transpose(2, 0, 1)


# Feet of normals, and other points to measure from -------------------------------------------------------------------


def _measured_at(mechanism: Mechanism, k: int, height: float | None) -> Mechanism:
    """The same arm with link k measured from another point of its axis: ``d[k]`` becomes ``height``.

    None: from the foot of the common normal, with beta = 0.
    """
    a, alpha, beta, d = mechanism.a[k], mechanism.alpha[k], mechanism.beta[k], mechanism.d[k]
    R = (rot_x(alpha) @ rot_y(beta))[:3, :3]
    w, point = R[:, 2], np.array([a, 0.0, d])
    lean = math.hypot(w[0], w[1])
    along = -(a * w[0]) / lean**2 if height is None else (height - d) / w[2]
    crossing = point + along * w
    radius = math.hypot(crossing[0], crossing[1])
    if radius > ON_AXIS:
        turned = math.atan2(crossing[1], crossing[0])
    else:
        turned = math.atan2(w[0], -w[1]) if lean > ON_AXIS else 0.0
    leans = rot_z(-turned)[:3, :3] @ w
    new_alpha, new_beta = math.atan2(-leans[1], leans[2]), math.asin(min(1.0, max(-1.0, leans[0])))
    if height is None:
        new_beta = 0.0
    rest = (rot_x(new_alpha) @ rot_y(new_beta))[:3, :3].T @ rot_z(-turned)[:3, :3] @ R
    found = {key: np.array(getattr(mechanism, key)) for key in ("a", "alpha", "beta", "d", "offset")}
    found["a"][k], found["alpha"][k], found["beta"][k], found["d"][k] = radius, new_alpha, new_beta, crossing[2]
    found["offset"][k] += turned
    found["offset"][k + 1] += math.atan2(rest[1, 0], rest[0, 0])
    flange, base = mechanism.flange, mechanism.base
    if k == 0:
        base = base @ translation(0, 0, found["d"][0])
        found["d"][0] = 0.0
    if k + 2 == len(mechanism.d):
        flange = translation(0, 0, -along) @ flange
    else:
        found["d"][k + 1] -= along
    return replace(mechanism, **found, flange=flange, base=base)


def by_normals(mechanism: Mechanism) -> Mechanism:
    """The arm with beta = 0 wherever neighbouring axes are not parallel to within ``EXACTLY_PARALLEL``.

    Parameters
    ----------
    mechanism : with any beta

    Returns
    -------
    mechanism : the same axes, its links measured along common normals
    """
    for k in np.flatnonzero(mechanism.beta):
        if mechanism.between[k] > EXACTLY_PARALLEL:
            mechanism = _measured_at(mechanism, int(k), None)
    return mechanism


def without_far_normals(mechanism: Mechanism) -> Mechanism:
    """The arm with links between nearly parallel axes measured within it, where their normal lies far outside.

    Far is farther along an axis than all lengths a together. Such entries differ by much where axes differ by little.

    Parameters
    ----------
    mechanism : with common normals

    Returns
    -------
    mechanism : the same axes, with beta other than 0 in such links
    """
    angles, far = mechanism.between, float(np.abs(mechanism.a).sum())
    for k in np.flatnonzero((angles > 0) & (angles < NEARLY_PARALLEL)):
        d = mechanism.d
        if max(abs(d[k]), abs(d[k + 1])) > far:
            mechanism = _measured_at(mechanism, int(k), 0.0)
    return mechanism


def with_senses(mechanism: Mechanism, senses: Reals, normals: Reals) -> Mechanism:
    """The same arm with axes and common normals turned over: signs, and half turns of alpha and theta [1]_ [2]_.

    Parameters
    ----------
    senses : (m,), +1 or -1, of the axes
    normals : (m - 1,), +1 or -1, of the common normals between them

    Returns
    -------
    mechanism : base and flange turned by half a turn about x where the first or last axis is turned over
    """
    folded = senses[:-1] * senses[1:] < 0
    beside = np.concatenate([[1.0], normals, [1.0]])
    over = [HALF_TURN if senses[k] < 0 else np.eye(4) for k in (0, -1)]
    return replace(
        mechanism,
        a=normals * mechanism.a,
        alpha=wrap_to_pi(normals * (mechanism.alpha + np.where(folded, np.pi, 0.0))),
        beta=normals * senses[1:] * mechanism.beta,
        d=senses * mechanism.d,
        offset=senses * mechanism.offset + np.where(beside[:-1] * beside[1:] < 0, np.pi, 0.0),
        direction=senses * mechanism.direction,
        base=mechanism.base @ over[0],
        flange=over[1] @ mechanism.flange,
    )


# Senses of axes and normals -------------------------------------------------------------------------------------------


@by_identity
class _Scores:
    """What each of the S senses of axes leaves different.

    ``entries`` (S,), with a fraction for how much they differ, and ``layers`` (S,), bases, flanges, joints and zeros;
    ``either`` (links, 2): whether a normal may point either way.
    """

    senses: Reals
    normals: Reals
    folds: Integers
    entries: Reals
    layers: Reals
    either: Flags


def _scores(one: Mechanism, other: Mechanism, tolerances: Tolerances) -> _Scores:
    """All senses of the other arm's axes, each with the normals by which the fewest entries differ."""
    m, links = len(one.d), len(one.a)
    senses = 1.0 - 2.0 * np.array(list(itertools.product((0, 1), repeat=m)))
    near = (one.between < NEARLY_PARALLEL) & (other.between < NEARLY_PARALLEL)
    both_lean = near & (np.minimum(one.between, other.between) > EXACTLY_PARALLEL)
    parallel = other.between < np.where(both_lean, NEARLY_PARALLEL, EXACTLY_PARALLEL)
    inexact = near & (np.maximum(one.between, other.between) > EXACTLY_PARALLEL)
    placed = ~_beside_a_slide(one.sliding)
    cost, angles_off = np.empty((2, links, 2, 2))  # by link, fold and sense of the normal
    for fold, turn in ((0, 0.0), (1, np.pi)):
        for side, normal in ((0, 1.0), (1, -1.0)):
            off = np.abs(wrap_to_pi(normal * (other.alpha + turn) - one.alpha))
            gap = np.abs(normal * other.a - one.a)
            angles_off[:, fold, side] = off > np.where(inexact, 2 * NEARLY_PARALLEL, tolerances.angle)
            counted = angles_off[:, fold, side] + ((gap > tolerances.length) & ~inexact & placed)
            cost[:, fold, side] = counted + 1e-4 * off + 1e-4 * gap
    either = ((np.floor(cost) == 1).all(axis=2) | ~placed[:, None]) & (angles_off.sum(axis=2) == 1)
    either |= both_lean[:, None] & (angles_off == 0).all(axis=2)
    folds = (senses[:, :-1] * senses[:, 1:] < 0).astype(int)
    by_link = np.arange(links)
    normals = np.where(cost[by_link, folds, 0] <= cost[by_link, folds, 1], 1.0, -1.0)
    total = cost.min(axis=2)[by_link, folds].sum(axis=1)
    for first, last, along in parallel_blocks(other, parallel):
        if first == 0 or last == m - 1 or not placed[max(first - 1, 0) : last + 1].all():
            continue
        inside = slice(first, last + 1)
        gap = np.abs((other.d[inside] - senses[:, inside] * one.d[inside]) @ along)
        total += (gap > tolerances.length) + 1e-4 * gap
    sides = np.concatenate([np.ones((len(senses), 1)), normals, np.ones((len(senses), 1))], axis=1)
    turned = senses * other.offset + np.where(sides[:, :-1] * sides[:, 1:] < 0, np.pi, 0.0) - one.offset
    moved = np.abs(wrap_to_pi(turned)) > tolerances.angle
    moved[:, [0, -1]] = False
    fixed = one.sliding & ~np.append(parallel, False) & ~np.append(False, parallel)  # their theta is geometry
    total += (moved & fixed).sum(axis=1)
    moved &= ~one.sliding
    layers = (senses * other.direction * one.direction < 0).sum(axis=1) + moved.sum(axis=1)
    layers = layers + _ends_turned(one, other, senses, turned, tolerances)
    return _Scores(senses, normals, folds, total, layers, either)


def least_cost(one: Mechanism, other: Mechanism, tolerances: Tolerances) -> float:
    """About how much at least differs, without a full match: ``ENTRY`` for each entry, 1 for each convention.

    Parameters
    ----------
    one, other : with the same number of rows, of the same kinds
    tolerances : in m and rad

    Returns
    -------
    cost : shifts of base and flange are not in it
    """
    scores = _scores(one, other, tolerances)
    return float((ENTRY * np.floor(scores.entries) + scores.layers).min())


def _likely_senses(one: Mechanism, other: Mechanism, tolerances: Tolerances) -> list[tuple[Reals, Reals]]:
    """Senses (m,) and normals (m - 1,) of the other arm, those first by which the fewest entries differ, then those
    that turn the fewest bases, flanges, joints and zeros."""
    scores, by_link = _scores(one, other, tolerances), np.arange(len(one.a))
    total = scores.entries
    order = np.argsort(np.floor(total) + 0.01 * scores.layers + 1e-3 * (total % 1), kind="stable")
    best = order[np.floor(total[order]) <= np.floor(total).min() + 1][: MAX_SENSES * (4 if one.sliding.any() else 1)]
    found = []
    for k in best:
        senses, normals = scores.senses[k], scores.normals[k]
        found.append((senses, normals))
        for link in np.flatnonzero(scores.either[by_link, scores.folds[k]]):  # a normal and a twist: one of both signs
            found.append((senses, np.where(by_link == link, -normals, normals)))
    return found


def _ends_turned(one: Mechanism, other: Mechanism, senses: Reals, turned: Reals, tolerances: Tolerances) -> Reals:
    """What base and flange that turn count for, (S,), by senses (S, m) and turns (S, m) of zeros."""
    total = np.zeros(len(senses))
    for k, own, theirs in ((0, one.base, other.base), (-1, one.flange, other.flange)):
        spun = exp_rotation(turned[:, [k]] * np.eye(3)[2])
        over = np.where(np.arange(3), senses[:, [k]], 1.0)[:, None]  # half a turn about x, or none
        if k == 0:
            R, axis = (theirs[:3, :3] * over) @ spun @ own[:3, :3].T, own[:3, 2]
        else:
            R, axis = own[:3, :3].T @ (spun * over) @ theirs[:3, :3], own[2, :3]
        about_axis = R @ axis @ axis > math.cos(tolerances.angle)
        total += np.where(about_axis, 1, TURNED_END) * (
            np.trace(R, axis1=1, axis2=2) < 1 + 2 * math.cos(tolerances.angle)
        )
    return total


def _beside_a_slide(sliding: Flags) -> Flags:
    """Links (m - 1,) whose translation belongs to a chain of links around a joint that slides, or to an end of them."""
    links = len(sliding) - 1
    touched = sliding[:-1] | sliding[1:] if links else np.zeros(0, dtype=bool)
    return np.asarray(touched)


def parallel_blocks(mechanism: Mechanism, parallel: Flags) -> list[tuple[int, int, Reals]]:
    """Runs of parallel axes: the first and the last axis, and the sense of each along the first."""
    found, first = [], 0
    for k in range(len(mechanism.d)):
        if k < len(parallel) and parallel[k]:
            continue
        along = np.cumprod([1.0, *np.sign(np.cos(mechanism.alpha[first:k]))])
        found.append((first, k, along))
        first = k + 1
    return found


# The match ------------------------------------------------------------------------------------------------------------


@frozen
class EntryDifference:
    """An entry of the first table that the other arm has otherwise: m or rad.

    ``column`` is a, alpha, beta, d or theta (of a joint that slides); ``link`` counts rows of a standard table from 0.
    ``alike``: entries that no data can tell from this one, as (column, link).
    """

    column: str
    link: int
    one: float
    other: float
    alike: tuple[tuple[str, int], ...] = ()

    @property
    def size(self) -> float:
        """By how much the entry differs, m or rad, angles within half a turn."""
        gap = self.other - self.one
        return abs(gap if self.column in ("a", "d") else float(wrap_to_pi(np.array(gap))))


@by_identity
class Match:
    """The other arm brought onto the first one.

    Attributes
    ----------
    differences : of geometry, the fewest that explain the other arm; worst_length, worst_angle : m and rad
    invariants : how many numbers were compared; unexplained : m, what no entries explain
    reverses : (m,) bool, rows that the other arm moves in the other direction
    zeros : (m,), rad or m, other's ``offset`` less the first's once the other is brought there; 0 of the ends
    base : (4, 4), the other's base in the first's base; flange : (4, 4), other's flange in the first's flange
    """

    differences: tuple[EntryDifference, ...]
    worst_length: float
    worst_angle: float
    invariants: int
    unexplained: float
    reverses: Flags
    zeros: Reals
    base: Reals
    flange: Reals
    layers: int

    @property
    def rank(self) -> tuple[float, int, float, float]:
        """What less of is a better match.

        Returns
        -------
        entries, layers : how many entries differ (beta, which few tables have, counts more), and how many conventions
        size, turns : sum of the entries' differences (m and rad), and turns of base and flange (rad)
        """
        entries = sum(1.5 if each.column == "beta" else 1.0 for each in self.differences)
        size = sum(each.size for each in self.differences)
        turns = turn_of(self.base) + turn_of(self.flange)
        return entries + 2 * (self.unexplained > 0), self.layers, round(size, 6), round(turns, 4)

    @property
    def cost(self) -> float:
        """How much differs: ``ENTRY`` for each entry, 1 for each convention."""
        return ENTRY * self.rank[0] + self.layers


def match(one: Mechanism, other: Mechanism, tolerances: Tolerances) -> Match:
    """The match by which the fewest entries differ, and of those the one with the fewest differences of convention.

    Parameters
    ----------
    one, other : with the same number of rows, of the same kinds
    tolerances : in m and rad

    Returns
    -------
    match : of ``other`` brought onto ``one``
    """
    most = np.maximum(one.between, other.between)
    near = (most > EXACTLY_PARALLEL) & (most < NEARLY_PARALLEL)
    lone = near & (np.minimum(one.between, other.between) < EXACTLY_PARALLEL)
    exact = by_normals(one), by_normals(other)
    local = without_far_normals(one), without_far_normals(other)
    best: Match | None = None
    best_rank: tuple[float, ...] = ()
    for senses, normals in _likely_senses(*exact, tolerances):
        pairs = [] if lone.any() else [(exact[0], with_senses(exact[1], senses, normals))]
        if near.any():
            turned = with_senses(local[1], senses, _normals_of_near(local, near, normals))
            pairs.append(_measured_alike(local[0], turned))
            pairs.append((one, with_senses(other, senses, _normals_of_near((one, other), near, normals))))
        for first, second in pairs:
            for found in _settled(first, second, tolerances):
                entries, layers, *sizes = found.rank
                rank = entries, layers, float(first is not one), *sizes  # of equals in the entries that are printed
                if best is None or rank < best_rank:
                    best, best_rank = found, rank
        if best is not None and best.rank[0] == best.layers == 0:
            break
    assert best is not None
    return best


def is_same_mechanism(one: Mechanism, other: Mechanism, tolerances: Tolerances) -> bool:
    """Whether no entry of geometry differs; much faster than :func:`match` where many do.

    Parameters
    ----------
    one, other : with the same number of rows, of the same kinds
    tolerances : in m and rad

    Returns
    -------
    same : zeros, directions, base and flange may differ
    """
    return not _links_differ(one, other, tolerances) and match(one, other, tolerances).rank[0] == 0


def _links_differ(one: Mechanism, other: Mechanism, tolerances: Tolerances) -> bool:
    """Whether some link's length or twist differs for all senses of axes and normals."""
    if one.beta.any() or other.beta.any():
        return False
    angles = np.stack([one.between, other.between])
    least, most = angles.min(axis=0), angles.max(axis=0)
    placed = ~_beside_a_slide(one.sliding) & ((least > NEARLY_PARALLEL) | (most < EXACTLY_PARALLEL))
    apart = placed & (np.abs(np.abs(one.a) - np.abs(other.a)) > tolerances.length)
    return bool((apart | (most - least > np.where(least > NEARLY_PARALLEL, tolerances.angle, NEARLY_PARALLEL))).any())


def _normals_of_near(arms: tuple[Mechanism, Mechanism], near: Flags, normals: Reals) -> Reals:
    """Senses (m - 1,) of normals; those of nearly parallel axes by lengths measured within the arm, for one far away
    can point anywhere."""
    product = arms[0].a * arms[1].a
    return np.where(near & (product != 0), np.sign(product), normals)


def _measured_alike(one: Mechanism, other: Mechanism) -> tuple[Mechanism, Mechanism]:
    """Both arms with links between nearly parallel axes measured from the same height of the axis."""
    for k in range(len(one.a)):
        widest = max(one.between[k], other.between[k])
        if EXACTLY_PARALLEL < widest < NEARLY_PARALLEL:
            other = _measured_at(other, k, float(one.d[k]))
    return one, other


def _settled(one: Mechanism, other: Mechanism, tolerances: Tolerances) -> Iterator[Match]:
    """The match for chosen senses; where axes beside a slide are parallel to it, also the one with its own theta."""
    least = NEARLY_PARALLEL if one.beta.any() or other.beta.any() else EXACTLY_PARALLEL
    parallel = other.between < np.where(one.between < NEARLY_PARALLEL, least, EXACTLY_PARALLEL)
    ways = [_with_free_turns(one, other, parallel, tolerances)]
    beside = one.sliding & (np.append(parallel, False) | np.append(False, parallel))
    if (np.abs(wrap_to_pi(other.offset - one.offset))[1:-1][beside[1:-1]] > tolerances.angle).any():
        ways.append(_with_free_turns(one, other, parallel, tolerances, of_slides=False))
    for placed in ways:
        yield _settled_at(one, other, parallel, placed, tolerances)


def _settled_at(
    one: Mechanism,
    other: Mechanism,
    parallel: Flags,
    placed: tuple[Reals, Reals],
    tolerances: Tolerances,
) -> Match:
    """The match for chosen senses, and offsets and translations of the other's links."""
    m, links = len(one.d), len(one.a)
    offset, steps = placed
    turned = wrap_to_pi(offset - one.offset)
    slides = [k for k in range(1, m - 1) if one.sliding[k]]
    differences, worst_angle = _angles_differ(one, other, turned, slides, tolerances)
    gaps = steps - np.stack([one.a, np.zeros(links), one.d[:links]], axis=1)
    shifts, near, far = _free_shifts(one, other, parallel, offset)
    parts = np.linalg.svd(shifts) if links else (np.eye(0), np.empty(0), np.eye(shifts.shape[1]))
    entries, counted, left = _entries(one, gaps.ravel(), parts, tolerances)
    differences += entries
    explained = np.zeros((links, 3))
    for each in entries:
        explained[each.link, 0 if each.column == "a" else 2] += each.other - each.one
    left_over = (gaps - explained).ravel()
    near, far = _shifts_chosen(one, other, left_over, parts, (near, far), turned=turned, tolerances=tolerances)

    for k in np.flatnonzero(parallel & (other.between > tolerances.angle)).tolist():  # what moving along one leaves
        off_axis = math.sin(other.between[k]) - tolerances.angle
        left = max(left, abs(float(near[k + 1, 2])) * off_axis)
    zeros = np.where(one.sliding, (far - near)[:, 2], turned)
    zeros[np.array([k in (0, m - 1) and not one.sliding[k] for k in range(m)])] = 0.0
    placed = _ends_placed(one, other, turned, (near[0], far[-1]))
    reverses = one.direction * other.direction < 0
    moved = tolerances.exceeded(zeros, one.sliding)
    at_axes = np.linalg.inv(one.base) @ placed[0] @ one.base, one.flange @ placed[1] @ np.linalg.inv(one.flange)
    ends = sum(_end_moved(T, tolerances) for T in at_axes)
    layers = int(reverses.sum() + moved.sum()) + ends
    lengths = [abs(each.other - each.one) for each in entries]
    return Match(
        tuple(differences),
        max([0.0, left, *lengths, *counted[1]]),
        worst_angle,
        links + len(slides) + counted[0],
        left if left > tolerances.length else 0.0,
        reverses,
        zeros,
        *placed,
        layers,
    )


def _angles_differ(
    one: Mechanism, other: Mechanism, turned: Reals, slides: list[int], tolerances: Tolerances
) -> tuple[list[EntryDifference], float]:
    """Twists, betas, and the theta of joints that slide between others, that differ; the largest gap of all, rad."""
    places = np.array(slides, dtype=int)
    gaps = wrap_to_pi(other.alpha - one.alpha), wrap_to_pi(other.beta - one.beta), turned[places]
    differences, values = [], (one.alpha, one.beta, one.offset[places])
    for column, off, own in zip(("alpha", "beta", "theta"), gaps, values):
        for k in np.flatnonzero(np.abs(off) > tolerances.angle).tolist():
            link = slides[k] if column == "theta" else k
            value = float(own[k] + off[k])
            value = float(wrap_to_pi(np.array(value))) if abs(value) > MAX_HALF_TURN else value
            differences.append(EntryDifference(column, link, float(own[k]), value))
    return differences, float(np.abs(np.concatenate(gaps)).max(initial=0.0))


def _ends_placed(one: Mechanism, other: Mechanism, turned: Reals, shifts: tuple[Reals, Reals]) -> tuple[Reals, Reals]:
    """The other's base in the first's base, and its flange in the first's flange (4, 4), by turns (m,) of zeros and
    shifts (3,) of the first joint and the last."""
    base = other.base @ rot_z(turned[0]) @ rot_z(one.offset[0] * one.sliding[0]) @ translation(*shifts[0])
    base = base @ rot_z(-one.offset[0] * one.sliding[0])
    last_turn = turned[-1] if len(turned) > 1 else 0.0
    flange = translation(*(-shifts[1])) @ rot_z(last_turn) @ other.flange
    return one.base @ np.linalg.inv(base), np.linalg.inv(one.flange) @ flange


def _end_moved(T: Reals, tolerances: Tolerances) -> int:
    """What a base or flange counts for that is moved by T, given in the frame of the joint there."""
    about_axis = T[2, 2] > math.cos(tolerances.angle)
    shifts = int(np.linalg.norm(T[:3, 3]) > tolerances.length)
    return shifts + (1 if about_axis else TURNED_END) * int(turn_of(T) > tolerances.angle)


def is_identity(T: Reals, tolerances: Tolerances) -> bool:
    """Whether a transform moves nothing by more than the tolerances.

    Parameters
    ----------
    T : (4, 4), m
    tolerances : m for its position, rad for its rotation

    Returns
    -------
    identity : True also exactly at a tolerance
    """
    return bool(np.linalg.norm(T[:3, 3]) <= tolerances.length and turn_of(T) <= tolerances.angle)


def turn_of(T: Reals) -> float:
    """Angle by which a transform turns.

    Parameters
    ----------
    T : (4, 4)

    Returns
    -------
    angle : rad, 0 to pi
    """
    return float(rotation_angle(np.eye(3), T[:3, :3]))


def _with_free_turns(
    one: Mechanism, other: Mechanism, parallel: Flags, tolerances: Tolerances, *, of_slides: bool = True
) -> tuple[Reals, Reals]:
    """The other's offsets (m,), and translations (m - 1, 3) of its links, with turns that parallel axes share put where
    they are free: to joints that turn, off those that slide (``of_slides``); of coincident axes to the joint farther
    out."""
    m, links = len(one.d), len(one.a)
    parallel = parallel & (np.maximum(one.between, other.between) <= tolerances.angle)
    offset = other.offset.copy()
    steps = np.stack([other.a, np.zeros(links), other.d[:links]], axis=1)

    def turn(k: int, angle: float) -> None:
        offset[k] -= angle
        steps[k] = rot_z(angle)[:3, :3] @ steps[k]
        offset[k + 1] += angle * np.sign(np.cos(other.alpha[k]))

    def gap(k: int) -> float:
        return float(wrap_to_pi(offset[k] - one.offset[k]))

    for k in range(m - 2, 0, -1):
        if of_slides and one.sliding[k] and parallel[k - 1]:
            turn(k - 1, -gap(k) * float(np.sign(np.cos(other.alpha[k - 1]))))
    for k in range(1, m - 1):
        if of_slides and one.sliding[k] and parallel[k]:
            turn(k, gap(k))
    for k in range(links):
        coincident = parallel[k] and max(abs(one.a[k]), abs(other.a[k])) < tolerances.length
        if coincident and not (one.sliding[k] or one.sliding[k + 1]):
            if k == 0:
                turn(0, -gap(1) * float(np.sign(np.cos(other.alpha[0]))))
            else:
                turn(k, gap(k))
    return offset, steps


def _free_shifts(one: Mechanism, other: Mechanism, parallel: Flags, offset: Reals) -> tuple[Reals, Reals, Reals]:
    """What the translations of links (3 (m - 1), s) change by s shifts that are free at the joints, and where these
    (m, 3, s) move a joint's near and far side, in its own frame.

    Of joint k: one along its axis if it turns; if it slides two across it, and one along it on either side.
    """
    places = np.cumsum([0, *np.where(one.sliding, 4, 1)])
    near, far = np.zeros((2, len(one.d), 3, places[-1]))
    for k, slides in enumerate(one.sliding):
        if slides:
            near[k][:, places[k] + np.array([0, 1, 2])] = far[k][:, places[k] + np.array([0, 1, 3])] = np.eye(3)
        else:
            near[k, 2, places[k]] = far[k, 2, places[k]] = 1.0
    turns = _turns_across(other)
    for link in np.flatnonzero(parallel):
        turns[link] = np.diag([1.0, 0.0, 0.0]) + np.sign(np.cos(other.alpha[link])) * np.diag([0.0, 1.0, 1.0])
    spun = exp_rotation(np.append(offset[:-1], one.offset[-1])[1:, None] * np.eye(3)[2])
    matrix = far[:-1] - turns @ spun @ near[1:]
    return matrix.reshape(-1, places[-1]), near, far


def _entries(
    one: Mechanism, gaps: Reals, shifts: Parts, tolerances: Tolerances
) -> tuple[list[EntryDifference], tuple[int, list[float]], float]:
    """The fewest lengths that explain translations that differ by ``gaps``, up to free ``shifts``.

    Returns
    -------
    entries; how many lengths can be distinguished, and by how much those differ that agree; what is unexplained, m
    """
    links = len(one.a)
    if not links:
        return [], (0, []), 0.0
    names = [("a", k) for k in range(links)] + [("d", k) for k in range(1, links)]
    rows = [3 * k + (0 if column == "a" else 2) for column, k in names]
    kept = shifts[0][:, int((shifts[1] > 1e-9).sum()) :]
    columns, wanted = kept[rows].T, kept.T @ gaps  # what shifts leave of entries and gaps
    sizes = np.linalg.norm(columns, axis=0)
    classes: list[list[int]] = []
    for j in np.flatnonzero(sizes > 1e-7).tolist():
        for members in classes:
            i = members[0]
            if abs(columns[:, i] @ columns[:, j]) > (1 - 1e-9) * sizes[i] * sizes[j]:
                members.append(j)
                break
        else:
            classes.append([j])
    heads = [members[0] for members in classes]
    amounts, residual, distinct = _fewest(columns[:, heads], wanted, np.abs(gaps[rows])[heads], tolerances)
    found, small = [], []
    for members, amount in zip(classes, amounts.tolist()):
        j = members[0]
        if len(members) > 1:
            raw = np.abs(gaps[[rows[i] for i in members]])
            printed = np.abs([getattr(one, names[i][0])[names[i][1]] for i in members])
            apart = raw > tolerances.length
            j = members[int(np.argmax(raw if apart.sum() == 1 else printed))]
            amount *= float(columns[:, members[0]] @ columns[:, j]) / sizes[j] ** 2
        if abs(amount) > tolerances.length:
            column, k = names[j]
            value = float(getattr(one, column)[k])
            alike = tuple(names[i] for i in members if i != j)
            found.append(EntryDifference(column, k, value, value + amount, alike))
        else:
            small.append(abs(amount))
    return found, (distinct, small), residual


def _fewest(columns: Reals, wanted: Reals, printed: Reals, tolerances: Tolerances) -> tuple[Reals, float, int]:
    """Amounts of columns that make up what is wanted: all of them if that is unique, else as few as will do."""
    count = columns.shape[1]
    if not count:
        return np.empty(0), float(np.abs(wanted).max(initial=0.0)), 0
    solved = np.linalg.lstsq(columns, wanted, rcond=1e-7)
    amounts = np.asarray(solved[0], float)
    rank = int(solved[2])
    if rank == count or np.linalg.norm(amounts) < 0.2 * tolerances.length:
        return amounts, float(np.abs(wanted - columns @ amounts).max(initial=0.0)), rank
    fit = float(np.abs(wanted - columns @ amounts).max()) + 0.1 * tolerances.length
    for size in range(1, min(rank, MAX_ENTRIES) + 1):
        chosen = np.array(list(itertools.combinations(range(count), size)))
        some = columns.T[chosen].transpose(0, 2, 1)  # (sets, rows, size)
        values = np.linalg.pinv(some, rcond=1e-7) @ wanted
        left = np.abs(wanted - np.einsum("srk,sk->sr", some, values)).max(axis=1)
        fits = np.flatnonzero(left <= fit)
        if len(fits):
            strange = np.sum(printed) - printed[chosen[fits]].sum(axis=1) + 1e-6 * np.abs(values[fits]).sum(axis=1)
            best = fits[int(np.argmin(strange))]
            full = np.zeros(count)
            full[chosen[best]] = values[best]
            return full, float(np.abs(wanted - columns @ full).max()), rank
    return amounts, float(np.abs(wanted - columns @ amounts).max()), rank


def _shifts_chosen(
    one: Mechanism,
    other: Mechanism,
    gaps: Reals,
    shifts: Parts,
    sides: tuple[Reals, Reals],
    *,
    turned: Reals,
    tolerances: Tolerances,
) -> tuple[Reals, Reals]:
    """The shifts (m, 3), m, on the near and on the far side of the joints, in their own frames.

    What is free throughout (all axes parallel, or slides at the ends) is chosen so that as few as can be of base,
    zeros and flange differ.
    """
    (near, far), (U, S, V) = sides, shifts
    rank = int((S > 1e-9).sum())
    y, free = V[:rank].T @ ((U[:, :rank].T @ gaps) / S[:rank]), V[rank:].T

    def outcome(values: Reals) -> Reals:
        """Gaps (m,) left at base (3), joints that slide, flange (3)."""
        start = rot_z(one.offset[0] * one.sliding[0])[:3, :3] @ near[0] @ values
        at_base = other.base[:3, 3] + other.base[:3, :3] @ start - one.base[:3, 3]
        at_flange = (rot_z(turned[-1] if len(near) > 1 else 0.0) @ other.flange)[:3, 3] - far[-1] @ values
        return np.concatenate([at_base, (far - near)[one.sliding, 2] @ values, at_flange - one.flange[:3, 3]])

    reference = outcome(y)
    response = np.array([outcome(y + each) - reference for each in free.T]).T
    slides = int(one.sliding.sum())
    best, fewest = y, np.inf
    for spared in ((slides + 3, slides + 6), (3, slides + 3), (0, 3)) if free.size else ():
        weight = np.ones(slides + 6)
        weight[slice(*spared)] = 1e-5
        step = np.linalg.lstsq(weight[:, None] * response, -weight * reference, rcond=1e-9)[0]
        left = np.abs(reference + response @ step)
        parts = left[:3].max(), *left[3 : 3 + slides].tolist(), left[3 + slides :].max()
        apart = sum(part > tolerances.length for part in parts)
        if apart < fewest:
            best, fewest = y + free @ step, apart
    return near @ best, far @ best
