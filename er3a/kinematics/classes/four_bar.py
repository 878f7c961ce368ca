"""Poses of an arm with axes 2, 3, 4 parallel, singular ones included: rows and continua.

Where axis 6 is parallel to the three (q5 = 0 of a UR) the turn phi about them is free: axis 4 runs on a circle about W,
where axes 5 and 6 meet, while joints 2 and 3 follow, a four-bar linkage. Its members follow from phi in closed form,
and the ends of its ranges follow from the triangle's inequality.
"""

from __future__ import annotations

import numpy as np

from er3a.by_value import by_identity
from er3a.geometry.vectors import TURN, wrap_to_pi
from er3a.kinematics.chain import size_of
from er3a.kinematics.classes.arm_angle import about_z
from er3a.kinematics.classes.parallel_axes import (
    ParallelConstants,
    ThreeParallel,
    parallel_rows,
    polish_rows,
)
from er3a.numerics.arrays import Flags, Reals

SAME_FAMILY = 1e-6  # rad, of joints 1 and 5
FREE = 1e-9  # rad between axis 6 and the parallel axes within which joint 5's roots are one family


@by_identity
class FourBar:
    """A continuum of solutions: axis 6 along the parallel axes, links 2, 3, 4 and the line to W turn as a four-bar.

    Attributes
    ----------
    arm : the solver
    theta_1, theta_5 : rad, the same in all members
    wrist : (2,), m, W in the plane; total : rad, constant sum (or difference) of phi and ``sense_6`` joint 6
    intervals : (k, 2), rad, ranges of phi that the arm reaches; both elbows meet at an end; a full turn has none
    shoulders : roots of joint 1 (0, 1) that it belongs to
    """

    arm: ThreeParallel
    theta_1: float
    theta_5: float
    wrist: Reals
    total: float
    sense_6: float
    intervals: Reals
    shoulders: tuple[int, ...]

    def nearest(self, phi: float) -> float:
        """The turn within the intervals that is nearest to a given one, whole turns aside.

        Parameters
        ----------
        phi : rad

        Returns
        -------
        phi : rad
        """
        best, at = np.inf, phi
        for low, high in self.intervals:
            middle = 0.5 * (low + high)
            turned = middle + float(wrap_to_pi(np.array(phi - middle)))
            inside = min(max(turned, low), high)
            for each in (inside, low, high):
                away = abs(float(wrap_to_pi(np.array(each - phi))))
                if away < best:
                    best, at = away, float(each)
        return at

    def members(self, phi: Reals, elbow: int) -> Reals:
        """Members of the four-bar's continuum.

        Parameters
        ----------
        phi : (...), rad, turn of joints 2, 3 and 4 together
        elbow : 0 or 1

        Returns
        -------
        q : (..., 6), rad, in (-pi, pi]; NaN outside the intervals
        """
        k = self.arm.constants
        phi = np.asarray(phi, float)
        c, s = np.cos(phi), np.sin(phi)
        x = self.wrist[0] - (c * k.rest[0] - s * k.rest[1]) - k.axis_2[0]
        y = self.wrist[1] - (s * k.rest[0] + c * k.rest[1]) - k.axis_2[1]
        squared = x * x + y * y
        far, near = (k.upper_arm + k.forearm) ** 2 - squared, squared - (k.upper_arm - k.forearm) ** 2
        slack = 1e-12 * (k.upper_arm + k.forearm) ** 2
        bend = 2 * np.arctan2(np.sqrt(np.maximum(far, 0)), np.sqrt(np.maximum(near, 0))) * (1 - 2 * elbow)
        bend = np.where((far < -slack) | (near < -slack), np.nan, bend)
        first = np.arctan2(y, x) - np.arctan2(k.forearm * np.sin(bend), k.upper_arm + k.forearm * np.cos(bend))
        q = np.empty((*phi.shape, 6))
        q[..., 0], q[..., 4] = self.theta_1, self.theta_5
        q[..., 1], q[..., 2] = first - k.zero_2, k.sense_3 * (bend - k.zero_3)
        q[..., 3] = k.sense_4 * (phi - k.wrist.zero_1 - (first - k.zero_2) - (bend - k.zero_3))
        q[..., 5] = self.sense_6 * (self.total - phi)
        return np.where(np.isfinite(bend)[..., None], wrap_to_pi(q), np.nan)


def solve_three_parallel(arm: ThreeParallel, T: Reals) -> tuple[Reals, Flags]:
    """All solutions for poses of an arm with axes 2, 3 and 4 parallel, singular ones included.

    Parameters
    ----------
    T : (N, 4, 4), m

    Returns
    -------
    q : (N, 8, 6), rad, in (-pi, pi]; NaN where a slot has none
    singular : (N,), True where branches meet to 1e-6: there rows were polished by Newton's steps, and
        :func:`four_bars` may have a family, of whose each range and elbow the middle is a row
    """
    T = np.ascontiguousarray(T, dtype=float)
    q, marked = parallel_rows(arm, T)
    if len(left := np.flatnonzero(marked)):
        q[left] = _careful_rows(arm, T[left], True)
        for n in left:
            _put_members(q[n], four_bars(arm, T[n]))
    return q, marked


def _careful_rows(arm: ThreeParallel, T: Reals, once: bool) -> Reals:
    """Rows (N, 8, 6) of poses near singular ones, polished as :func:`polish_rows` does."""
    rows = parallel_rows(arm, T, arm.constants.near_m)[0]
    polish_rows(arm.links, size_of(arm.links), T, rows, once)
    return rows


def solve_near_reference(arm: ThreeParallel, T: Reals, x_ref: Reals) -> tuple[Reals, Reals]:
    """All slots for poses with the free turn of a four-bar where a reference has it.

    Where joint 5's roots meet, so do the slots of both; each elbow has its member in them.

    Parameters
    ----------
    T : (N, 4, 4), m
    x_ref : (N, 6), rad, row values

    Returns
    -------
    q : (N, 8, 6), rad, in (-pi, pi]; NaN where a slot has none
    gap : (N, 8), m, by how much W or axis 4 are out of reach in slots without solution, 0 in others
    """
    T = np.ascontiguousarray(T, dtype=float)
    q, marked = parallel_rows(arm, T)
    for n in np.flatnonzero(marked):
        q[n] = _careful_rows(arm, T[n : n + 1], False)[0]
        phi = turn_of_three(arm, x_ref[n])
        for family in four_bars(arm, T[n]):
            for elbow in (0, 1):
                member = family.members(np.array(family.nearest(float(phi))), elbow)
                for shoulder in family.shoulders:
                    q[n, 4 * shoulder + 2 * elbow : 4 * shoulder + 2 * elbow + 2] = member
    return q, _gaps(arm, T, q)


def turn_of_three(arm: ThreeParallel, x: Reals) -> Reals:
    """The turn of joints 2, 3 and 4 together about their direction.

    Parameters
    ----------
    x : (..., 6), rad

    Returns
    -------
    phi : (...), rad, not wrapped
    """
    k = arm.constants
    return np.asarray(x[..., 1] + k.sense_3 * x[..., 2] + k.sense_4 * x[..., 3] + k.wrist.zero_1)


def _gaps(arm: ThreeParallel, T: Reals, q: Reals) -> Reals:
    """By how much (N, 8), m, slots without solution are out of reach."""
    k, gap = arm.constants, np.zeros(q.shape[:2])
    for n in np.flatnonzero(np.isnan(q[..., 0]).any(axis=1)):
        p, across, wanted = _wrist_in_frame(k, T[n])
        root = np.sqrt(max(across**2 - wanted**2, 0.0))
        for shoulder, v in ((0, -root), (1, root)):
            W = np.array([k.cos_lean * wanted - k.sin_lean * p[2], v])
            away, slack = float(np.linalg.norm(W - k.axis_2)), float(np.hypot(*k.rest))
            reach, smallest = k.upper_arm + k.forearm, abs(k.upper_arm - k.forearm)
            # axis 4 is somewhere on a circle about W
            most = max(abs(wanted) - across, away - reach - slack, smallest - slack - away, 1e-12)
            part = slice(4 * shoulder, 4 * shoulder + 4)
            gap[n, part] = np.where(np.isnan(q[n, part, 0]), most, 0.0)
    return gap


def _wrist_in_frame(k: ParallelConstants, T: Reals) -> tuple[Reals, float, float]:
    """W of a pose (4, 4) in the arm's frame (3,), its distance from axis 1, and what the root of joint 1 takes (m)."""
    p = (T[:3, :3] @ np.array(k.wrist_in_tool) + T[:3, 3] - np.array(k.place)) @ np.array(k.turn).T
    return p, float(np.hypot(p[0], p[1])), (k.height - k.cos_lean * p[2]) / k.sin_lean


def _put_members(rows: Reals, families: tuple[FourBar, ...]) -> None:
    """Put the middle of each range of each family, with both elbows, into the rows (8, 6) of its joints 1 and 5."""
    for family in families:
        same = np.abs(wrap_to_pi(rows[:, [0, 4]] - [family.theta_1, family.theta_5])).max(axis=1) < SAME_FAMILY
        rows[same] = np.nan
        for low, high in family.intervals:
            for elbow in (0, 1):
                free = np.flatnonzero(np.isnan(rows[:, 0]))
                if free.size:
                    rows[free[0]] = family.members(np.array(0.5 * (low + high)), elbow)


def four_bars(arm: ThreeParallel, T: Reals) -> tuple[FourBar, ...]:
    """The continua of solutions of one pose.

    Parameters
    ----------
    T : (4, 4), m

    Returns
    -------
    families : empty where axis 6 is not parallel to axes 2, 3 and 4, or joint 1 has no root
    """
    k = arm.constants
    p, across, wanted = _wrist_in_frame(k, T)
    axis_6 = np.array(k.turn) @ T[:3, :3] @ np.array(k.axis_6_in_tool)
    beside = np.array(k.turn) @ T[:3, :3] @ np.array(k.beside_6_in_tool)
    if abs(wanted) > across + k.near_m:
        return ()
    spread = np.arctan2(np.sqrt(max((across - wanted) * (across + wanted), 0.0)), wanted)
    found: list[FourBar] = []
    for shoulder, sign in ((0, 1.0), (1, -1.0)):
        theta_1 = np.arctan2(p[1], p[0]) + sign * spread
        back = about_z(-theta_1)
        to_plane = np.array([[k.cos_lean, 0, -k.sin_lean], [0, 1, 0], [k.sin_lean, 0, k.cos_lean]]) @ back
        z, x, W = to_plane @ axis_6, to_plane @ beside, (to_plane @ p)[:2]
        if np.hypot(z[0], z[1]) > FREE:
            continue
        up = 1.0 if z[2] > 0 else -1.0
        # w, axis 5, axis 6 lie in one plane: phi_5 is 0 (axis 6 = w) or pi (against it)
        phi_5 = 0.0 if up > 0 else np.pi
        if abs(k.wrist.cos_12 * k.wrist.cos_23 + up * k.wrist.sin_12 * k.wrist.sin_23 - up) > 1e-9:
            continue
        # Rz(phi) Rx(w5) Rz(phi_5) Rx(-s56) Rz(theta_6): a turn by phi + theta_6, or Rz(phi) Ry(pi) Rz(theta_6)
        total = float(np.arctan2(x[1], x[0])) - phi_5
        intervals = _intervals(k, W)
        if len(intervals) and not any(abs(np.cos(theta_1 - other.theta_1) - 1) < 1e-12 for other in found):
            shoulders = (shoulder,) if spread > 1e-6 else (0, 1)
            found.append(
                FourBar(
                    arm,
                    float(wrap_to_pi(np.array(theta_1))),
                    float(wrap_to_pi(np.array(phi_5 - k.wrist.zero_2))),
                    W,
                    total,
                    up,
                    intervals,
                    shoulders,
                )
            )
    return tuple(found)


def _intervals(k: ParallelConstants, W: Reals) -> Reals:
    """Ranges of phi in which axis 4, on its circle about W, is within the reach of joints 2 and 3."""
    away, rest = W - np.array(k.axis_2), np.array(k.rest)
    D, r = float(np.linalg.norm(away)), float(np.linalg.norm(rest))
    smallest, most = (k.upper_arm - k.forearm) ** 2, (k.upper_arm + k.forearm) ** 2
    if D * r < 1e-15:
        inside = smallest <= D * D + r * r <= most
        return np.array([[-np.pi, np.pi]]) if inside else np.empty((0, 2))
    middle = float(np.arctan2(away[1], away[0]) - np.arctan2(rest[1], rest[0]))
    low, high = (D * D + r * r - most) / (2 * D * r), (D * D + r * r - smallest) / (2 * D * r)  # bounds of the cosine
    if low > 1 or high < -1:
        return np.empty((0, 2))
    near, far = float(np.arccos(min(high, 1.0))), float(np.arccos(max(low, -1.0)))
    if near == 0.0 and far == np.pi:
        return np.array([[middle - np.pi, middle + np.pi]])
    if near == 0.0:
        return np.array([[middle - far, middle + far]])
    if far == np.pi:
        return np.array([[middle + near, middle + TURN - near]])
    return np.array([[middle - far, middle - near], [middle + near, middle + far]])
