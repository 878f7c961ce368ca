"""Curves of joint values that keep the tool at rest: traced by steps along the Jacobian's null space.

A step goes along the direction of the null space that is nearest to the last one, so the curve runs on through points
where two curves cross; minimum-norm Newton steps, blind to directions without a clear singular value, bring it
back [1]_. Lengths are in units of the chain's size. A task that leaves the tool's turn about its own z axis open, or
all of its orientation, has an error of 0 in what is open, and so has the Jacobian's share in it.

References
----------
.. [1] J. W. Burdick, "On the inverse kinematics of redundant manipulators: characterization of the self-motion
   manifolds", IEEE Int. Conf. Robotics and Automation (1989).
"""

from __future__ import annotations

import numpy as np

from er3a.by_value import by_identity
from er3a.geometry.vectors import TURN
from er3a.kinematics.classes.polish import error_and_columns, largest_of
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.jit import inner_kernel, kernel

STEP = np.radians(2.0)  # largest joint move between two points of a curve
MAX_POINTS, FEW_POINTS = 1200, 30  # of a traced curve (some 40 rad), and to see that it goes on
REGULAR = 1e-6  # pivots of J J^T above this part of the largest diagonal entry
TRUNCATED = 1e-9  # singular values below this part of the largest are no directions: rounding, not a small bend
SOLVES = 1e-11  # error (rad, parts of the size) at which Newton's steps may stop as soon as they gain nothing
ON_CURVE = 2e-10  # of each component, in parts of the size: sums of three stay below the 1e-9 that rows are held to
SOLVES_AS_ROOT = 1e-12  # error, rad or parts of the size, that a root may have
ABOVE_ROUNDING = 1e-15  # of the trace
MIN_PIVOT = 1e-15  # keeps the root of a pivot that rounding has made negative
FEW_HALVINGS = 6  # of a step that does not come back to the curve, to 1/32 of it
SHORTEST = np.radians(6.0)  # what ends on both sides nearer than so is a root of high order
PROBE = 2e-3  # rad or parts of the size: a step along the null space, which must stay on the pose
LOST, CLOSED, OPEN = 0, 1, 2
POSE, OPEN_ROLL, POSITION = 0, 1, 2  # tasks

Posed = tuple[Reals, Flags, Reals, int]
"""Links (n + 1, 4, 4), which joints slide (n,), a pose (4, 4), and the task: POSE, OPEN_ROLL or POSITION."""


@kernel
def error_and_jacobian(posed: Posed, x: Reals, e: Reals, J: Reals) -> float:
    """Pose error and geometric Jacobian of a chain of any length, lengths in parts of its size. Kernel.

    Parameters
    ----------
    posed : chain, pose and task
    x : (n,), rad, or parts of the size
    e : (6,), filled: position, then half the sum of the vector products of the axes
    J : (6, n), filled: linear rows, then angular rows

    Returns
    -------
    largest : the error's largest component; at least 1 beyond 90 deg
    """
    links, sliding, T, task = posed
    w = np.empty((2, 4, 4))
    trace = error_and_columns(links, sliding, T, x, w, e, J)
    if task != POSE:
        trace = _without_what_is_open(T, task, w[x.shape[0] % 2], e, J)
    return largest_of(e, trace)


@inner_kernel
def _without_what_is_open(T: Reals, task: int, frame: Reals, e: Reals, J: Reals) -> float:
    """Take what the task leaves open out of the error and the Jacobian; returns the cosine between the z axes, 1 if
    orientation is open."""
    e[3:] = 0.0
    if task == POSITION:
        J[3:] = 0.0
        return 1.0
    cosine = 0.0
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        e[3 + i] = frame[a, 2] * T[b, 2] - frame[b, 2] * T[a, 2]
        cosine += frame[i, 2] * T[i, 2]
    for k in range(J.shape[1]):
        along = 0.0
        for i in range(3):
            along += J[3 + i, k] * T[i, 2]
        for i in range(3):
            J[3 + i, k] -= along * T[i, 2]
    return cosine


@inner_kernel
def shortest_step(J: Reals, e: Reals, damping: float, out: Reals) -> bool:  # noqa: C901, PLR0912
    """The shortest solution of a linear system, damped or with independent rows, by Cholesky's factors of
    ``J J^T + damping``. Kernel.

    Parameters
    ----------
    J : (6, n), n of at least 6 unless damped
    e : (6,), right side
    damping : added to the diagonal of ``J J^T``
    out : (n,), filled with the shortest x of ``J x = e``, or with the damped one

    Returns
    -------
    regular : False if J is nearly dependent; then ``out`` means nothing, unless it is damped
    """
    n = J.shape[1]
    M, y = np.empty((6, 6)), np.empty(6)
    most = 0.0
    for r in range(6):
        for c in range(r + 1):
            total = 0.0
            for k in range(n):
                total += J[r, k] * J[c, k]
            M[r, c] = total
        M[r, r] += damping
        most = max(most, M[r, r])
    for c in range(6):
        for k in range(c):
            M[c, c] -= M[c, k] * M[c, k]
        if damping == 0.0 and not M[c, c] > REGULAR * most:
            return False
        M[c, c] = np.sqrt(max(M[c, c], MIN_PIVOT))
        for r in range(c + 1, 6):
            for k in range(c):
                M[r, c] -= M[r, k] * M[c, k]
            M[r, c] /= M[c, c]
    for r in range(6):
        y[r] = e[r]
        for k in range(r):
            y[r] -= M[r, k] * y[k]
        y[r] /= M[r, r]
    for r in range(5, -1, -1):
        for k in range(r + 1, 6):
            y[r] -= M[k, r] * y[k]
        y[r] /= M[r, r]
    for k in range(n):
        out[k] = 0.0
        for r in range(6):
            out[k] += J[r, k] * y[r]
    return True


@kernel
def null_share(J: Reals, v: Reals, out: Reals) -> int:
    """The part of a vector in the null space of a Jacobian. Kernel.

    Parameters
    ----------
    J : (6, n)
    v : (n,)
    out : (n,), filled

    Returns
    -------
    dimension : of the null space
    """
    n: int = J.shape[1]
    # Cheaper than singular values: subtract what moves the tool.
    if n > 6:
        moved = np.zeros(6)
        for r in range(6):
            for k in range(n):
                moved[r] += J[r, k] * v[k]
        if shortest_step(J, moved, 0.0, out):
            for k in range(n):
                out[k] = v[k] - out[k]
            return n - 6
    _, s, Vt = np.linalg.svd(J, False)
    out[:] = v
    dimension: int = J.shape[1]
    for r in range(s.shape[0]):
        if s[r] > TRUNCATED * s[0]:
            dimension -= 1
            along = 0.0
            for k in range(v.shape[0]):
                along += Vt[r, k] * v[k]
            for k in range(v.shape[0]):
                out[k] -= along * Vt[r, k]
    return dimension


@inner_kernel
def _add_step(J: Reals, e: Reals, least: float, most: float, x: Reals) -> None:
    """Add the shortest step that takes an error (6,) off to joint values (n,): in directions whose singular value is
    above ``least`` times the first, by at most ``most`` in each."""
    U, s, Vt = np.linalg.svd(J, False)
    for r in range(s.shape[0]):
        if s[r] > least * s[0]:
            along = 0.0
            for i in range(6):
                along += U[i, r] * e[i]
            along = max(min(along / s[r], most), -most)
            for k in range(x.shape[0]):
                x[k] += along * Vt[r, k]


@inner_kernel
def onto_curve(posed: Posed, x: Reals, e: Reals, J: Reals) -> float:
    """Bring joint values back onto the pose by minimum-norm Newton steps [1]_. Kernel.

    Parameters
    ----------
    posed : chain, pose and task
    x : (n,), rad, or parts of the size, changed in place
    e, J : (6,) and (6, n), scratch memory

    Returns
    -------
    error : that is left, rad and parts of the size
    """
    smallest, step = np.inf, np.empty(x.shape[0])
    for _ in range(25):
        error = error_and_jacobian(posed, x, e, J)
        if error < 1e-15 or (error < SOLVES and error >= 0.5 * smallest):
            return error
        if error > 0.5:
            return error
        smallest = min(smallest, error)
        if x.shape[0] > 6 and shortest_step(J, e, 0.0, step):
            for k in range(x.shape[0]):
                x[k] += step[k]
            continue
        _add_step(J, e, TRUNCATED, np.inf, x)
    return error_and_jacobian(posed, x, e, J)


@kernel
def free_direction(posed: Posed, x: Reals, v: Reals) -> int:
    """Find a direction in which joints can move with the tool at rest. Kernel.

    Parameters
    ----------
    posed : chain, pose and task
    x : (n,), rad, or parts of the size, a solution
    v : (n,), filled with the direction, of largest component 1

    Returns
    -------
    dimension : of the null space there; 0 if no step in any of its directions stays on the pose
    """
    n: int = x.shape[0]
    e, J, y = np.empty(6), np.empty((6, n)), np.empty(n)
    error_and_jacobian(posed, x, e, J)
    _, s, Vt = np.linalg.svd(J, True)
    dimension = n
    for r in range(s.shape[0]):
        if s[r] > TRUNCATED * s[0]:
            dimension -= 1
    for r in range(n - dimension, n):
        largest = np.abs(Vt[r]).max()
        for sign in range(2):
            step = PROBE / largest * (1.0 - 2.0 * sign)
            y[:] = x + step * Vt[r]
            if onto_curve(posed, y, e, J) < ON_CURVE:
                moved = 0.0
                for k in range(n):
                    moved += (y[k] - x[k]) * Vt[r, k]
                if moved * np.sign(step) > 0.5 * abs(step):
                    v[:] = Vt[r] / largest * np.sign(step)
                    return dimension
    return 0


@kernel
def trace(posed: Posed, x: Reals, v: Reals, points: Reals) -> tuple[int, int]:  # noqa: C901, PLR0912
    """Follow a curve of solutions [1]_. Kernel.

    Parameters
    ----------
    posed : chain, pose and task
    x : (n,), rad, or parts of the size, where to start
    v : (n,), the sense
    points : (k, n), filled with joint values along the curve, not wrapped

    Returns
    -------
    count : how many points
    end : CLOSED (back at the start but for whole turns, the last point), OPEN (``points`` is full), LOST (no further
        step solves the pose)
    """
    sliding, n = posed[1], x.shape[0]
    e, J, y, along, last = np.empty(6), np.empty((6, n)), np.empty(n), np.empty(n), v.copy()
    points[0] = x
    count = 1
    while count < points.shape[0]:
        here = points[count - 1]
        error_and_jacobian(posed, here, e, J)
        null_share(J, last, along)
        largest = np.abs(along).max()
        if largest < 1e-9:
            return count, LOST
        along /= largest
        step, ahead = STEP, False
        for _ in range(FEW_HALVINGS):
            y[:] = here + step * along
            if onto_curve(posed, y, e, J) < ON_CURVE:
                away, forward = np.abs(y - here).max(), ((y - here) * along).sum()
                if away < 1.5 * step and forward > 0.2 * step:
                    ahead = True
                    break
            step *= 0.5
        if not ahead:
            return count, LOST
        length = np.abs(y - here).max()
        last[:] = (y - here) / length
        points[count] = y
        count += 1
        if count > 4:
            # the start, but for whole turns, between the last two points?
            apart, at, squared = 0.0, 0.0, 0.0
            for k in range(n):
                away = points[0, k] - here[k]
                if not sliding[k]:
                    away -= TURN * np.round(away / TURN)
                at += away * (y[k] - here[k])
                squared += (y[k] - here[k]) ** 2
            share = at / squared
            for k in range(n):
                away = points[0, k] - here[k]
                if not sliding[k]:
                    away -= TURN * np.round(away / TURN)
                apart = max(apart, abs(away - share * (y[k] - here[k])))
            if -0.01 < share <= 1.01 and apart < 0.2 * length:
                for k in range(n):
                    away = points[0, k] - y[k]
                    if not sliding[k]:
                        away -= TURN * np.round(away / TURN)
                    points[count - 1, k] += away
                return count, CLOSED
    return count, OPEN


@kernel
def between(posed: Posed, points: Reals, at: Reals, out: Reals) -> None:
    """Find a curve's points between those of its polyline. Kernel.

    Parameters
    ----------
    posed : chain, pose and task
    points : (m, n), rad, or parts of the size, the polyline
    at : (k,), places, counted in points of the polyline
    out : (k, n), filled; where nothing is found between two points it is the nearer one of them
    """
    n = points.shape[1]
    e, J = np.empty(6), np.empty((6, n))
    for i in range(at.shape[0]):
        low = min(max(int(np.floor(at[i])), 0), points.shape[0] - 2)
        share = at[i] - low
        out[i] = (1.0 - share) * points[low] + share * points[low + 1]
        if not onto_curve(posed, out[i], e, J) < ON_CURVE:
            out[i] = points[low + int(share > 0.5)]


@inner_kernel
def _to_rounding(posed: Posed, x: Reals, e: Reals, J: Reals) -> float:
    """Onto a curve, or to a root where the Jacobian is nearly singular: there each step halves what is missing."""
    error = onto_curve(posed, x, e, J)
    best, smallest = x.copy(), error
    for _ in range(40):
        if smallest < SOLVES_AS_ROOT * 1e-2:
            break
        _add_step(J, e, 1e-12, 1e-2, x)
        error = error_and_jacobian(posed, x, e, J)
        if error < smallest:
            best[:] = x
            smallest = error
    x[:] = best
    return smallest


@kernel
def roots_from_starts(posed: Posed, starts: Reals, out: Reals) -> int:
    """Search for solutions from many starts, by damped Gauss-Newton steps. Kernel.

    Parameters
    ----------
    posed : chain, pose and task
    starts : (k, n), rad, or parts of the size
    out : (k, n), filled with joint values that solve the pose, one for each start that leads to one

    Returns
    -------
    count : how many, with repetitions
    """
    sliding, n = posed[1], starts.shape[1]
    e, J, y = np.empty(6), np.empty((6, n)), np.empty(n)
    count = 0
    for k in range(starts.shape[0]):
        y[:] = starts[k]
        solved = False
        for _ in range(40):
            error = error_and_jacobian(posed, y, e, J)
            if error < 1e-9:
                solved = True
                break
            M = J.T @ J
            # not below the rounding of M, with which a singular M stays so
            damping = 1e-2 * (e @ e) + 1e-15 + ABOVE_ROUNDING * np.trace(M)
            for i in range(n):
                M[i, i] += damping
            step = np.linalg.solve(M, J.T @ e)
            y += step
        if solved and _to_rounding(posed, y, e, J) < SOLVES_AS_ROOT:
            for i in range(n):
                if not sliding[i]:
                    y[i] -= TURN * np.ceil((y[i] - np.pi) / TURN)
            out[count] = y
            count += 1
    return count


@by_identity
class TracedCurve:
    """A traced curve of self-motion.

    Attributes
    ----------
    points : (k, n), rad and m, not wrapped; of a closed curve the last is the first but for whole turns
    closed : whether it comes back to its start
    dimension : of the Jacobian's null space at most points; above 1 the curve is one of many on a surface
    """

    points: Reals
    closed: bool
    dimension: int


@by_identity
class PoseChain:
    """A chain with a pose and a task, scaled to the chain's size, whose curves are traced."""

    posed: Posed
    size: float

    @staticmethod
    def of(links: Reals, sliding: Flags, T: Reals, size: float, task: int = POSE) -> PoseChain:
        """Scale a chain and a pose to the chain's size.

        Parameters
        ----------
        links : (n + 1, 4, 4), m
        sliding : (n,), prismatic joints
        T : (4, 4), m
        size : m, of the chain
        task : POSE, OPEN_ROLL or POSITION

        Returns
        -------
        chain : its methods take and give rad and m
        """
        scaled, pose = np.array(links, float), np.array(T, float)
        scaled[:, :3, 3] /= size
        pose[:3, 3] /= size
        return PoseChain((scaled, np.ascontiguousarray(sliding), pose, task), size)

    @property
    def sliding(self) -> Flags:
        """Which joints are prismatic (n,)."""
        return self.posed[1]

    def _scaled(self, x: Reals) -> Reals:
        """Joint values in rad and m as rad and parts of the size."""
        return np.ascontiguousarray(np.where(self.sliding, np.asarray(x, float) / self.size, x))

    def _in_m(self, x: Reals) -> Reals:
        """Joint values in rad and parts of the size as rad and m."""
        return np.where(self.sliding, x * self.size, x)

    def error(self, x: Reals) -> float:
        """Largest component of the pose error at joint values.

        Parameters
        ----------
        x : (n,), rad or m

        Returns
        -------
        error : rad and parts of the size
        """
        n = len(self.sliding)
        return error_and_jacobian(self.posed, self._scaled(x), np.empty(6), np.empty((6, n)))

    def smallest(self, x: Reals) -> float:
        """Smallest singular value of the scaled Jacobian at joint values.

        Parameters
        ----------
        x : (n,), rad or m

        Returns
        -------
        value : without unit; where it is rounding, joints may move with the tool at rest
        """
        J = np.empty((6, len(self.sliding)))
        error_and_jacobian(self.posed, self._scaled(x), np.empty(6), J)
        return float(np.linalg.svd(J, compute_uv=False)[-1])

    def roots(self, starts: Reals) -> Reals:
        """Solutions that starts lead to, members of curves among them.

        Parameters
        ----------
        starts : (many, n), rad and parts of the size

        Returns
        -------
        x : (k, n), rad and m, with repetitions
        """
        out = np.empty_like(starts)
        count = roots_from_starts(self.posed, starts, out)
        return self._in_m(out[:count])

    def moves(self, x: Reals) -> bool:
        """Whether joint values that solve the pose can move on and on with the tool at rest.

        Parameters
        ----------
        x : (n,), rad or m

        Returns
        -------
        moves : at least ``FEW_POINTS`` steps in one sense, or back to the start
        """
        start, v = self._scaled(x), np.empty(len(x))
        if free_direction(self.posed, start, v) == 0:
            return False
        points = np.empty((FEW_POINTS, len(x)))
        return any(trace(self.posed, start, ahead, points)[1] != LOST for ahead in (v, -v))

    def curve(self, x: Reals) -> TracedCurve | None:
        """The curve of solutions through joint values that solve the pose.

        Parameters
        ----------
        x : (n,), rad or m

        Returns
        -------
        curve : None if they can't move with the tool at rest
        """
        start, v = self._scaled(x), np.empty(len(x))
        dimension = free_direction(self.posed, start, v)
        if dimension == 0:
            return None
        points = np.empty((MAX_POINTS, len(x)))
        count, end = trace(self.posed, start, v, points)
        path, lost = points[:count].copy(), end == LOST
        if end != CLOSED:
            count, other_end = trace(self.posed, start, -v, points)
            path, lost = np.concatenate([points[:count][::-1], path[1:]]), lost and other_end == LOST
        if lost and np.abs(path - start).max() < SHORTEST:
            return None
        return TracedCurve(self._in_m(path), end == CLOSED, self._dimension(path))

    def _dimension(self, path: Reals) -> int:
        """Median dimension of the null space at seven points of a path."""
        n = len(self.sliding)
        e, J, out = np.empty(6), np.empty((6, n)), np.empty(n)
        found = []
        for at in np.linspace(0, len(path) - 1, 7).astype(int):
            error_and_jacobian(self.posed, path[at], e, J)
            found.append(null_share(J, np.zeros(n), out))
        return int(np.median(found))

    def members(self, curve: TracedCurve, at: Reals) -> Reals:
        """Points of a traced curve at any place.

        Parameters
        ----------
        curve : of this chain
        at : (k,), places counted in the curve's points; of closed curves also beyond its ends

        Returns
        -------
        x : (k, n), rad and m, not wrapped
        """
        last = len(curve.points) - 1
        laps = np.floor(at / last) if curve.closed else np.zeros_like(at)
        inside = np.clip(at - laps * last, 0, last)
        out = np.empty((len(at), len(self.sliding)))
        between(self.posed, self._scaled(curve.points), np.ascontiguousarray(inside), out)
        lap = np.where(self.sliding, 0.0, curve.points[-1] - curve.points[0])
        return self._in_m(out) + laps[:, None] * lap

    def holds(self, curve: TracedCurve, x: Reals) -> bool:
        """Whether joint values lie on a traced curve: next to its polyline.

        Parameters
        ----------
        curve : of this chain
        x : (n,), rad or m

        Returns
        -------
        on : some point of the polyline is within a step, turns aside
        """
        away = self._scaled(x) - self._scaled(curve.points)
        away = np.where(self.sliding, away, away - TURN * np.round(away / TURN))
        return bool(np.abs(away).max(axis=1).min() < STEP)
