"""The shortest time along a path in joint space under the drives' torques and the joints' speeds, by TOPP-RA [1]_.

Along a path q(s) torques are ``a s'' + b s'^2 + c``, so peak torques bound s'' and s'^2 linearly: the rows are those of
toppra's own constraint of joint torques. s is the arc length with each joint measured in its maximum speed, which is
smooth wherever the path is; so the time falls as nodes are added, and what more nodes would gain can be seen.

Viscous friction goes with s', the root of s'^2, and is no row. It is enclosed. Let Y be a speed that no motion
exceeds. Where friction costs torque it is at least its chord up to Y and at most its tangent anywhere; where it helps,
at most its tangent at Y and at least its chord. With the first of each TOPP-RA gives a speed that no motion exceeds,
which is the next Y: no motion on these nodes is shorter than the time of that relaxed problem. With the second it gives
a motion that keeps the limits. Both are repeated until they gain nothing; they meet, because chord and tangent are
exact at Y.

References
----------
.. [1] H. Pham, Q.-C. Pham, "A new approach to time-optimal path parameterization based on reachability analysis",
   IEEE Trans. Robotics 34(3), 2018, section II.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from er3a.dynamics.arm_model import ArmModel, drives_of
from er3a.dynamics.torques import AT_REST, direction_of, holding_torques, known, torque_parts
from er3a.numerics.arrays import Reals
from er3a.planning import timing
from er3a.planning.piecewise import polynomial_motion

MAX_ROUNDS = 30  # each takes one run of TOPP-RA; a few suffice unless viscous friction dominates
GAIN = 1e-4  # of the time: below this a further round gains nothing
SLOWEST = 1e-3  # share of limits that tangents and room are kept above, to divide by nothing that vanishes
SLACK = 1e-3  # by which a speed that no motion exceeds is kept above the one found, because TOPP-RA's is rounded


@dataclass(frozen=True, eq=False)
class TimedTorques:
    """A motion and the torques (N, n) that it takes; at rest friction acts as just after or before.

    Attributes
    ----------
    lower_bound : s; no motion under the same limits at the same nodes is faster
    """

    timed: timing.Timed
    torques: Reals
    lower_bound: float


def fastest_under_torques(model: ArmModel, q: Reals, speed: Reals, torque_limit: Reals) -> TimedTorques:
    """Run along nodes from rest to rest, as fast as torques and joint speeds allow [1]_.

    Parameters
    ----------
    model : with load and gravity
    q : (N, n), rad or m, joined by a cubic spline
    speed : (n,), maximum joint speeds, rad/s or m/s
    torque_limit : (n,), maximum torques, N m or N; NaN where unknown, which bounds nothing

    Returns
    -------
    timed : the motion, its torques (N m or N), and a time (s) that no motion on these nodes undercuts

    Raises
    ------
    TimingError
        if no such time law exists
    """
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0) / speed, axis=1))])
    if (path := timing.path_through(q, s)) is None:
        timed = timing.standing(q[-1], 0.0)
        return TimedTorques(timed, holding_torques(model, timed.q), 0.0)
    _, s, spline = path
    along = TorquesAlong.along(model, s, spline, speed, torque_limit)
    lower_bound, ceiling = along.shortest_time()
    path_speed, t = along.fastest(ceiling)
    timed = timing.Timed(polynomial_motion(timing.run_along(s, spline, path_speed, t), t, timing.SPLINE_DEGREE))
    dry = known(drives_of(model.robot).coulomb) * (direction_of(spline(s, 1)) - direction_of(timed.velocity))
    torques = torque_parts(model, timed.q, timed.velocity, timed.acceleration).total + dry
    return TimedTorques(timed, torques, min(lower_bound, timed.duration))


Rows = tuple[Reals, Reals, Reals, Reals, Reals]


@dataclass(frozen=True, eq=False)
class TorquesAlong:
    """Torques ``a s'' + b s'^2 + c + viscous s'`` at the nodes (N, k) of the k joints whose limit (k,) is known.

    Attributes
    ----------
    s : (N,), at the nodes; spline : the joints (n,) along it; speed : (n,), largest
    speed_bound : (N,), largest s' under the joints' speed limits
    slow : (N,), s' whose viscous friction takes half of what gravity and dry friction leave, at most ``speed_bound``
    """

    s: Reals
    spline: scipy.interpolate.CubicSpline
    speed: Reals
    a: Reals
    b: Reals
    c: Reals
    viscous: Reals
    torque_limit: Reals
    speed_bound: Reals
    slow: Reals

    @classmethod
    def along(
        cls, model: ArmModel, s: Reals, spline: scipy.interpolate.CubicSpline, speed: Reals, torque_limit: Reals
    ) -> TorquesAlong:
        """The torques along a path, at its nodes.

        Parameters
        ----------
        model : with load and gravity
        s : (N,), arc length with each joint measured in its maximum speed, s
        spline : joint values (n,), rad or m, over s
        speed : (n,), rad/s or m/s
        torque_limit : (n,), N m or N; NaN where unknown

        Returns
        -------
        along : rows of the k joints whose limit is known
        """
        bound, drives = np.isfinite(torque_limit), drives_of(model.robot)
        a, b, c = _torque_rows(model, s, spline, torque_limit)
        slope = spline(s, 1)
        viscous = known(drives.viscous) * slope
        with np.errstate(divide="ignore", invalid="ignore"):
            speed_bound = (speed / np.abs(slope)).min(axis=1)
            room = np.maximum(torque_limit - np.abs(c), SLOWEST * torque_limit) / (2 * np.abs(viscous))
        slow = np.minimum(speed_bound, np.where(np.isfinite(room), room, np.inf).min(axis=1))
        rows = a[:, bound], b[:, bound], c[:, bound], viscous[:, bound]
        return cls(s, spline, speed, *rows, torque_limit[bound], speed_bound, slow)

    def shortest_time(self) -> tuple[float, Reals]:
        """A time that no motion undercuts, by relaxed rows, repeated until it gains nothing.

        Returns
        -------
        lower_bound : s
        ceiling : (N,), s' at the nodes that no motion exceeds
        """
        ceiling, lower_bound = self.speed_bound, 0.0
        for _ in range(MAX_ROUNDS):
            path_speed, t = self._solved(self._relaxed(ceiling), ceiling)
            gained, lower_bound = t[-1] > lower_bound * (1 + GAIN), max(lower_bound, float(t[-1]))
            ceiling = np.clip(path_speed * (1 + SLACK), SLOWEST * self.speed_bound, ceiling)
            if not (gained and self.viscous.any()):
                break
        return lower_bound, ceiling

    def fastest(self, ceiling: Reals) -> tuple[Reals, Reals]:
        """A motion that keeps the limits, by tightened rows, repeated until it gains nothing.

        Parameters
        ----------
        ceiling : (N,), s' at the nodes that no motion exceeds

        Returns
        -------
        path_speed : (N,), s' at the nodes
        t : (N,), s, times at the nodes
        """
        around, best = self.slow, np.inf
        for _ in range(MAX_ROUNDS):
            path_speed, t = self._solved(self._kept(around, ceiling), ceiling)
            gained, best = t[-1] < best * (1 - GAIN), float(t[-1])
            around = np.maximum(path_speed, SLOWEST * self.slow)
            if not (gained and self.viscous.any()):
                break
        return path_speed, t

    def _relaxed(self, ceiling: Reals) -> Rows:
        """Rows that every motion keeps which is nowhere faster than ``ceiling`` (N,)."""
        return self._rows(0.0, 1 / ceiling, ceiling / 2, 1 / (2 * ceiling))

    def _kept(self, around: Reals, ceiling: Reals) -> Rows:
        """Rows that keep the limits up to ``ceiling`` (N,); exact at ``around`` (N,) where friction costs torque."""
        return self._rows(around / 2, 1 / (2 * around), 0.0, 1 / ceiling)

    def _rows(
        self,
        friction_opposing: Reals | float,
        per_opposing: Reals,
        friction_assisting: Reals | float,
        per_assisting: Reals,
    ) -> Rows:
        """``F (a s'' + b s'^2 + c) <= g`` with a, b, c, g (N, 2k), F the unit matrix: upper ends first, then lower.

        s' counts as ``friction_opposing + per_opposing s'^2`` where friction costs torque, as
        ``friction_assisting + per_assisting s'^2`` where it helps.
        """
        viscous = np.concatenate([self.viscous, -self.viscous], axis=1)
        opposing, assisting = np.maximum(viscous, 0.0), np.minimum(viscous, 0.0)
        a, b, c = (np.concatenate([part, -part], axis=1) for part in (self.a, self.b, self.c))
        b = b + opposing * per_opposing[:, None] + assisting * per_assisting[:, None]
        constant = opposing * np.reshape(friction_opposing, (-1, 1)) + assisting * np.reshape(
            friction_assisting, (-1, 1)
        )
        F = np.broadcast_to(np.eye(a.shape[1]), (len(a), a.shape[1], a.shape[1])).copy()
        return a, b, c, F, np.tile(self.torque_limit, 2) - constant

    def _solved(self, rows: Rows, ceiling: Reals) -> tuple[Reals, Reals]:
        """Speeds s', at most ``ceiling``, and times (s) at the nodes (N,); rows hold at both ends of each step."""
        constraint, s = timing.toppra_library().constraint, self.s

        class Torques(constraint.LinearConstraint):  # type: ignore[misc, name-defined]
            def get_dof(self) -> int:
                """Joints whose torque is limited. toppra calls it."""
                return count

            def compute_constraint_params(self, path: Any, gridpoints: Any) -> Any:
                """The rows at the nodes, and s'^2 at most the ceiling's, in toppra's order. toppra calls it."""
                collocated = constraint.linear_constraint.canlinear_colloc_to_interpolate
                squares = np.stack([np.zeros(len(s)), ceiling**2], axis=1)
                return collocated(*rows, None, squares, gridpoints, identical=False)

        count = len(self.speed)
        speeds = constraint.JointVelocityConstraint(np.stack([-self.speed, self.speed], axis=1))
        return timing.solved(timing.toppra_path(s, self.spline, AT_REST), s, [speeds, Torques()])


def _torque_rows(
    model: ArmModel, s: Reals, spline: scipy.interpolate.CubicSpline, torque_limit: Reals
) -> tuple[Reals, Reals, Reals]:
    """Torques ``a s'' + b s'^2 + c`` at the nodes, (N, n) each, by toppra's constraint of joint torques."""
    drives = drives_of(model.robot)
    armature = known(drives.armature)

    def torques(q: Reals, qd: Reals, qdd: Reals) -> Reals:
        rigid = model.rigid_torques(q[None], qd[None], qdd[None])
        whole: Reals = (rigid + model.tool_torques(q[None]))[0] + armature * qdd
        return whole

    constraint = timing.toppra_library().constraint.JointTorqueConstraint(
        torques, np.stack([-torque_limit, torque_limit], axis=1), known(drives.coulomb)
    )
    a, b, c = constraint.compute_constraint_params(timing.toppra_path(s, spline, AT_REST), s)[:3]
    return a, b, c
