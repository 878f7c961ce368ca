"""The lattice of joint changes that leave the arm's pose unchanged: sums of whole turns of the rows of its table.

The rows move by u = C q. A revolute row is back at its pose after a whole turn, a prismatic row is not. So the arm has
the same pose at all joint values q + C^-1 k, where k holds whole turns for revolute rows and 0 for prismatic ones: a
whole turn of each joint if nothing is coupled (or by whole numbers, both ways), less than a turn after a gear, a turn
of one joint and a shift of another at a ball screw. Which of these keep the limits on joints and sums is found by
trying turns row by row, with the possible contribution of the remaining rows as a bound [1]_.

References
----------
.. [1] U. Fincke, M. Pohst, "Improved methods for calculating vectors of short length in a lattice", Mathematics of
   Computation 44, 1985.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from er3a.by_value import by_identity
from er3a.geometry.vectors import TURN
from er3a.numerics.arrays import Flags, Integers, Reals, copy_values
from er3a.numerics.jit import inner_kernel, kernel
from er3a.robots.robot import Robot, derived

LIMIT_TOLERANCE = 1e-9  # rad, m
PER_TURN = 1 / TURN
WHOLE = 1e-12  # parts of a turn, by which a number of turns may miss a whole one: rounding of inverted couplings
INVERTIBLE = 1e-9  # smallest determinant of a coupling that is inverted
WIDENED = (1.0, 2.0, 4.0, 8.0, 16.0)  # how far continuous joints are looked for, in halves of what turns move them by


@by_identity
class WholeTurns:
    """Steps that leave the arm as it was, and all sums of them.

    Attributes
    ----------
    steps : (n, r), rad or m, what a turn of each of r rows moves the joints by
    counts : (r, n), turns of these rows for joints: ``counts @ steps`` is the identity
    alone : (n,) bool, joints of which a whole turn leaves the arm as it was
    each : whether the steps are whole turns of one joint each
    lines : (n + s, n), what limits are of: the joints and the s sums; lower, upper : (n + s,), rad or m
    """

    steps: Reals
    counts: Reals
    alone: Flags
    each: bool
    lines: Reals
    lower: Reals
    upper: Reals


@derived
def whole_turns(robot: Robot) -> WholeTurns:
    """The robot's lattice of turns: changes of the joints that leave the arm's pose as it is.

    Parameters
    ----------
    robot : n joints, m rows

    Returns
    -------
    turns : steps in rad or m, and the limits of joints and sums

    Notes
    -----
    Where a coupling moves more rows than there are joints, the lattice is made of those joints alone that a whole turn
    brings back.
    """
    coupling = robot.joint_to_row
    # A whole turn of a joint changes nothing if it turns each row by whole turns, and moves no row that slides.
    parts = np.where(robot.sliding[:, None], coupling, coupling - np.round(coupling))
    alone = ~robot.slides & (np.abs(parts) <= WHOLE).all(axis=0)
    steps, counts = TURN * np.eye(robot.joints)[:, alone], np.eye(robot.joints)[alone] / TURN
    each, undone = True, uncoupling(robot)
    if undone is not None:
        turns = undone[:, ~robot.sliding]
        parts = np.where(robot.slides[:, None], turns, turns - np.round(turns))
        each = bool((alone | robot.slides).all() and np.abs(parts).max(initial=0.0) <= WHOLE)
        if not each:
            steps, counts = TURN * turns, coupling[~robot.sliding] / TURN
    sums = np.array([limit.factors for limit in robot.combined]).reshape(-1, robot.joints)
    lower = np.append(np.where(robot.continuous, -np.inf, robot.lower), [limit.lower for limit in robot.combined])
    upper = np.append(np.where(robot.continuous, np.inf, robot.upper), [limit.upper for limit in robot.combined])
    lines = np.concatenate([np.eye(robot.joints), sums])
    return WholeTurns(np.ascontiguousarray(steps), np.ascontiguousarray(counts), alone, each, lines, lower, upper)


@derived
def uncoupling(robot: Robot) -> Reals | None:
    """The inverse of the coupling, from rows to joints: ``q = uncoupling @ u``.

    Parameters
    ----------
    robot : n joints, m rows

    Returns
    -------
    inverse : (n, n); None without a coupling, with more rows than joints, or if the determinant is below ``INVERTIBLE``
    """
    if robot.coupling is None or robot.rows != robot.joints or abs(np.linalg.det(robot.coupling)) < INVERTIBLE:
        return None
    return np.asarray(np.linalg.inv(robot.coupling), dtype=float)


@derived
def uncoupling_of_linkage(robot: Robot) -> Reals | None:
    """Joints from the rows of a linkage, which has more rows than joints: ``q = uncoupling @ u``.

    Parameters
    ----------
    robot : n joints, m > n rows

    Returns
    -------
    inverse : (n, m), with zeros for m - n rows that it does not need; None if no choice of rows qualifies

    Notes
    -----
    Rows are chosen such that whole turns of rows change joints by whole turns only.
    """
    coupling = robot.coupling
    if coupling is None or robot.rows <= robot.joints or not (whole_turns(robot).alone | robot.slides).all():
        return None
    for chosen in map(list, combinations(range(robot.rows), robot.joints)):
        if abs(np.linalg.det(coupling[chosen])) < INVERTIBLE:
            continue
        found = np.zeros((robot.joints, robot.rows))
        found[:, chosen] = np.linalg.inv(coupling[chosen])
        turns = found[:, ~robot.sliding]
        parts = np.where(robot.slides[:, None], turns, turns - np.round(turns))
        if np.abs(parts).max(initial=0.0) <= WHOLE:
            return found
    return None


def turns_in(robot: Robot, move: Reals) -> Reals:
    """The whole turns of rows that are nearest to moves of joints, row by row.

    Parameters
    ----------
    move : (..., n), rad or m

    Returns
    -------
    turns : (..., n), rad or m, what these turns move the joints by
    """
    turns = whole_turns(robot)
    if turns.each:
        return np.asarray(np.where(turns.alone, TURN, 0.0) * np.round(move / TURN))
    return np.asarray(np.round(move @ turns.counts.T) @ turns.steps.T)


def shortest_move(robot: Robot, move: Reals) -> Reals:
    """Moves of joints, each row in its shorter direction.

    Parameters
    ----------
    move : (..., n), rad or m

    Returns
    -------
    move : (..., n), rad or m, less the whole turns of rows in it; rows turn by half a turn at most
    """
    return move - turns_in(robot, move)


def rows_within(robot: Robot, q: Reals, q_ref: Reals, most: int) -> tuple[Reals, Integers]:
    """The same arm poses by all turns that keep all limits, of joints and of sums.

    Parameters
    ----------
    q : (N, n), rad or m
    q_ref : (n,), rad or m; a continuous joint counts only within half of what a turn of each row moves it by
    most : at most one more than this is searched for, of each pose

    Returns
    -------
    rows : (k, n), rad or m, of one pose after the other
    counts : (N,), how many are of each, ``most`` + 1 at most
    """
    lower, upper = _windows(robot, q_ref[None], 1.0)
    found, counts = np.empty((len(q) * (most + 1), robot.joints)), np.empty(len(q), dtype=np.int64)
    limits = lower[0], upper[0], np.zeros(lower.shape[1])
    total = _all_within_each(np.ascontiguousarray(q), _lattice(robot), limits, most + 1, (found, counts))
    return found[:total], counts


@derived
def turns_alone(robot: Robot) -> bool:
    """Whether each joint turns by itself between limits of its own, as those of most arms do.

    Parameters
    ----------
    robot : without slides, gears, continuous joints or limits on sums, if so
    """
    turns = whole_turns(robot)
    return turns.each and bool(turns.alone.all()) and not robot.combined and not robot.continuous.any()


@kernel
def turned_alone(q: Reals, q_ref: Reals, limits: tuple[Reals, Reals], rows: Reals, of: Integers) -> int:
    """Fill in the turns of poses whose joints turn by themselves, of each pose the nearest to the reference first.

    Kernel, for arms that :func:`turns_alone` is true of. A pose that no turns bring within the limits has the row that
    :func:`er3a.robots.joint_limits.nearest_equivalent` names.

    Parameters
    ----------
    q : (N, n), rad
    q_ref : (n,), rad
    limits : lower and upper (n,), rad
    rows, of : (k, n), rad, and (k,), filled with the turns and the number of the pose that each is of

    Returns
    -------
    count : how many are filled in, -1 if they have too little room
    """
    (lower, upper), joints, count = limits, q.shape[1], 0
    least, size, turn = np.empty(joints), np.empty(joints, np.int64), np.empty(joints, np.int64)
    turned, move, order = np.empty(rows.shape), np.empty(len(rows)), np.empty(len(rows), np.int64)
    for pose in range(len(q)):
        fitting = 1
        for j in range(joints):
            turn[j], least[j] = 0, np.ceil((lower[j] - LIMIT_TOLERANCE - q[pose, j]) / TURN)
            size[j] = max(np.floor((upper[j] + LIMIT_TOLERANCE - q[pose, j]) / TURN) - least[j] + 1.0, 0.0)
            fitting = min(fitting * size[j], len(rows) + 1)
        if count + max(fitting, 1) > len(rows):
            return -1
        for number in range(fitting):
            away = 0.0
            for j in range(joints):
                turned[number, j] = q[pose, j] + TURN * (least[j] + turn[j])
                away = max(away, abs(turned[number, j] - q_ref[j]))
            at = number
            while at > 0 and away < move[at - 1]:
                move[at], order[at] = move[at - 1], order[at - 1]
                at -= 1
            move[at], order[at] = away, number
            _next_turn(turn, size)
        for k in range(fitting):
            copy_values(turned[order[k]], rows[count + k])
        if fitting == 0:
            fitting = 1
            for j in range(joints):
                rows[count, j] = nearest_turn(q[pose, j], q_ref[j], lower[j], upper[j])
        of[count : count + fitting] = pose
        count += fitting
    return count


@inner_kernel
def _next_turn(turn: Integers, size: Integers) -> None:
    """Count one on, the last joint (n,) first."""
    for j in range(len(turn) - 1, -1, -1):
        turn[j] += 1
        if turn[j] < size[j]:
            return
        turn[j] = 0


@inner_kernel
def nearest_turn(angle: float, reference: float, lower: float, upper: float) -> float:
    """The turn of a joint that is nearest to a reference within the limits, else the nearest to the limits. Kernel.

    Parameters
    ----------
    angle : rad
    reference : rad
    lower, upper : rad; infinite of a joint without limits

    Returns
    -------
    angle : rad, whole turns from the one given
    """
    near = angle + TURN * np.rint((reference - angle) * PER_TURN)
    low = np.ceil((lower - LIMIT_TOLERANCE - near) * PER_TURN)
    high = np.floor((upper + LIMIT_TOLERANCE - near) * PER_TURN)
    below, above = near + TURN * (low - 1.0), near + TURN * low
    outside = below if lower - below < above - upper else above
    # one value, not two returns: so the processor takes several joints at once
    chosen: float = near + TURN * min(max(0.0, low), high) if low <= high else outside
    return chosen


@kernel
def nearest_turns(q: Reals, q_ref: Reals, limits: tuple[Reals, Reals, Flags], out: Reals) -> None:
    """Fill in joints by their nearest turns, each by itself: :func:`nearest_turn`. Kernel.

    Parameters
    ----------
    q : (N, n), rad or m
    q_ref : (N or 1, n), rad or m
    limits : lower and upper (n,), and which joints a whole turn brings back (n,); others stay as they are
    out : (N, n), filled; q itself will do
    """
    lower, upper, turns = limits
    for i in range(q.shape[0]):
        ref = i if q_ref.shape[0] > 1 else 0
        for j in range(q.shape[1]):
            out[i, j] = nearest_turn(q[i, j], q_ref[ref, j], lower[j], upper[j]) if turns[j] else q[i, j]


def nearest_rows(
    robot: Robot, q: Reals, q_ref: Reals, around: tuple[Reals, Reals] | None = None
) -> tuple[Reals, Flags]:
    """The same arm poses by the turns that keep all limits and are nearest to references.

    Nearest is the smallest maximum move, then the smallest sum of moves.

    Parameters
    ----------
    q : (N, n), rad or m; rows of NaN stay
    q_ref : (N, n), rad or m
    around : how far below (negative) and above q joints and sums (N, n + s) go, rad or m, all of which keeps limits;
        None for 0

    Returns
    -------
    found : (N, n), rad or m
    fits : (N,) bool, whether turns keep all limits

    Notes
    -----
    Where no turns keep them, joints are left as they are if steps are whole turns of one joint each. Else, of those
    that leave no joint's limit by more than half of what a turn of each row moves it, come the turns that leave limits
    least, then the nearest.
    """
    turns = whole_turns(robot)
    found, fits = q.copy(), np.zeros(len(q), dtype=bool)
    solved = np.isfinite(q).all(axis=1)
    beyond = np.full(len(turns.lines), np.inf)
    beyond[: robot.joints] = 0.5 * np.abs(turns.steps).sum(axis=1)
    tries = [(widened, np.zeros(len(beyond))) for widened in (WIDENED if robot.continuous.any() else WIDENED[:1])]
    for widened, away in tries if turns.each else [*tries, (1.0, beyond)]:
        left = np.flatnonzero(solved & ~fits)
        lower, upper = _windows(robot, q_ref[left], widened)
        if around is not None:
            lower, upper = lower - around[0][left], upper - around[1][left]
        tried, excess = found[left], np.empty(len(left))
        _nearest(q[left], q_ref[left], _lattice(robot), (lower, upper, away), (tried, excess))
        found[left], fits[left] = tried, excess == 0.0
    return found, fits


def turns_inward(robot: Robot, low: Reals, high: Reals) -> Reals:
    """The turns by which motions keep all limits and are nearest to the middle of each joint's range.

    Parameters
    ----------
    low, high : (N, n + s), rad or m, smallest and largest values of joints and sums along each motion

    Returns
    -------
    turns : (N, n), rad or m, what to add to the motion; if none keep the limits, those nearest to the middle

    Notes
    -----
    Continuous joints stay if they can.
    """
    turns = whole_turns(robot)
    middle = (low + high)[:, : robot.joints] / 2
    centre = np.where(robot.continuous, middle, (robot.lower + robot.upper) / 2)
    shift = turns_in(robot, centre - middle)
    if turns.each and not robot.combined:
        return shift
    around = middle @ turns.lines.T
    turned, fits = nearest_rows(robot, middle, centre, (low - around, high - around))
    return np.where(fits[:, None], turned - middle, shift)


@derived
def _lattice(robot: Robot) -> Lattice:
    """The robot's turns as the kernels take them."""
    turns = whole_turns(robot)
    return np.ascontiguousarray(turns.lines @ turns.steps), turns.counts, turns.lines


def _windows(robot: Robot, q_ref: Reals, widened: float) -> tuple[Reals, Reals]:
    """Limits (N, n + s) of joints and sums; of continuous joints a window about references (N, n), open below."""
    turns = whole_turns(robot)
    half = widened * 0.5 * np.abs(turns.steps).sum(axis=1)
    lower, upper = np.tile(turns.lower, (len(q_ref), 1)), np.tile(turns.upper, (len(q_ref), 1))
    endless = np.flatnonzero(robot.continuous)
    lower[:, endless] = q_ref[:, endless] - half[endless] + 2 * LIMIT_TOLERANCE
    upper[:, endless] = q_ref[:, endless] + half[endless]
    return lower, upper


@inner_kernel
def take_turns_off(step: Reals, turns: tuple[Reals, Reals]) -> None:
    """Make a move of joints the one by the shortest way. Kernel.

    Parameters
    ----------
    step : (n,), rad or m, changed in place
    turns : steps (n, r) and counts (r, n) of :class:`WholeTurns`
    """
    steps, counts = turns
    for i in range(counts.shape[0]):
        count = 0.0
        for j in range(step.shape[0]):
            count += counts[i, j] * step[j]
        count = np.round(count)
        if count != 0.0:
            for j in range(step.shape[0]):
                step[j] -= steps[j, i] * count


Lattice = tuple[Reals, Reals, Reals]
"""What turns of rows change what limits are of by (m, r), turns of rows for joints (r, n), and what limits are of."""
Limits = tuple[Reals, Reals, Reals]
"""Lower and upper limits, and how far they may be left, (m,) each; of many poses (N, m) but for the last."""


@inner_kernel
def _room(q: Reals, lattice: Lattice, limits: Limits) -> tuple[Reals, Reals, Reals, Reals]:
    """Turns of each row (r,) between which joints (n,) keep to limits, and what rows from each one on can add to what
    limits are of, at least and at most (r + 1, m)."""
    (G, counts, _), (lower, upper, away) = lattice, limits
    m, rows = G.shape
    least, most = np.empty(rows), np.empty(rows)
    for i in range(rows):
        low, high = 0.0, 0.0
        for j in range(q.shape[0]):
            a = counts[i, j]
            if a != 0.0:
                below, above = lower[j] - away[j] - q[j], upper[j] + away[j] - q[j]
                low += a * (below if a > 0.0 else above)
                high += a * (above if a > 0.0 else below)
        least[i], most[i] = np.ceil(low - LIMIT_TOLERANCE), np.floor(high + LIMIT_TOLERANCE)
    adds, addable = np.zeros((rows + 1, m)), np.zeros((rows + 1, m))
    for i in range(rows - 1, -1, -1):
        for c in range(m):
            a, b = G[c, i] * least[i], G[c, i] * most[i]
            adds[i, c], addable[i, c] = adds[i + 1, c] + min(a, b), addable[i + 1, c] + max(a, b)
    return least, most, adds, addable


@inner_kernel
def _combine(combinations: Reals, q: Reals, out: Reals) -> None:
    """Fill out (k,) with combinations (k, n) of joints (n,)."""
    for i in range(combinations.shape[0]):
        out[i] = 0.0
        for j in range(q.shape[0]):
            out[i] += combinations[i, j] * q[j]


@inner_kernel
def _all_within(q: Reals, lattice: Lattice, limits: Limits, found: Reals) -> int:
    """Fill ``found`` (k, n) with joints (n,) by all turns that keep limits (m,), as many as there is room for; returns
    how many."""
    (G, _, lines), (lower, upper, _) = lattice, limits
    m, rows = G.shape
    least, most, low, high = _room(q, lattice, limits)
    value, at, count, i = np.empty((rows + 1, m)), least - 1.0, 0, 0
    if (least > most).any():
        return 0
    _combine(lines, q, value[0])
    while i >= 0:
        if i < rows:
            at[i] += 1.0
            if at[i] > most[i]:
                i -= 1
                continue
            for c in range(m):
                value[i + 1, c] = value[i, c] + G[c, i] * at[i]
            i += 1
        fits = True
        for c in range(m):
            fits &= value[i, c] + low[i, c] <= upper[c] + LIMIT_TOLERANCE
            fits &= value[i, c] + high[i, c] >= lower[c] - LIMIT_TOLERANCE
        if fits and i < rows:
            at[i] = least[i] - 1.0
            continue
        if fits:
            if count == found.shape[0]:
                return count
            copy_values(value[rows], found[count])
            count += 1
        i -= 1
    return count


@kernel
def _all_within_each(Q: Reals, lattice: Lattice, limits: Limits, most: int, out: tuple[Reals, Integers]) -> int:
    """:func:`_all_within` for rows (N, n), with room for ``most`` of each: all found, how many of each; returns the
    sum."""
    found, counts = out
    total = 0
    for pose in range(Q.shape[0]):
        counts[pose] = _all_within(Q[pose], lattice, limits, found[total : total + most])
        total += counts[pose]
    return total


@kernel
def _nearest(Q: Reals, refs: Reals, lattice: Lattice, limits: Limits, out: tuple[Reals, Reals]) -> None:  # noqa: C901, PLR0912
    """Fill ``found`` (N, n) with joints Q (N, n) by the turns that leave limits least, by no more than each may be
    left, then are nearest to refs (N, n); and ``left`` (N,) with the sum by which they leave them, infinite where there
    are none."""
    (G, counts, lines), (lowers, uppers, away), (found, left) = lattice, limits, out
    (m, rows), n = G.shape, Q.shape[1]
    value, at, middle = np.empty((rows + 1, m)), np.zeros(rows, np.int64), np.empty(rows)
    for pose in range(Q.shape[0]):
        q, ref, lower, upper = Q[pose], refs[pose], lowers[pose], uppers[pose]
        left[pose], max_move, total = np.inf, np.inf, np.inf
        least, most, low, high = _room(q, lattice, (lower, upper, away))
        if (least > most).any():
            continue
        _combine(counts, ref - q, middle)
        for i in range(rows):
            at[i], middle[i] = -1, min(max(np.rint(middle[i]), least[i]), most[i])
        _combine(lines, q, value[0])
        i = 0
        while i >= 0:
            if i < rows:
                at[i] += 1  # from the nearest turn on to both sides
                if at[i] > 2 * max(most[i] - middle[i], middle[i] - least[i]):
                    i -= 1
                    continue
                turn = middle[i] + ((at[i] + 1) // 2) * (1.0 if at[i] % 2 == 1 else -1.0)
                if turn < least[i] or turn > most[i]:
                    continue
                for c in range(m):
                    value[i + 1, c] = value[i, c] + G[c, i] * turn
                i += 1
            beyond, fits, move, moves = 0.0, True, 0.0, 0.0
            for c in range(m):
                over, under = value[i, c] + low[i, c] - upper[c], lower[c] - value[i, c] - high[i, c]
                excess = max(over, under) - LIMIT_TOLERANCE
                if excess > 0.0:
                    beyond += excess
                    fits &= excess <= away[c]
            for c in range(n):
                step = max(value[i, c] + low[i, c] - ref[c], ref[c] - value[i, c] - high[i, c], 0.0)
                move, moves = max(move, step), moves + step
            if beyond > 0.0 or left[pose] > 0.0:
                worse, alike = beyond > left[pose] + LIMIT_TOLERANCE, beyond >= left[pose] - LIMIT_TOLERANCE
                fits &= not worse
            else:
                alike = True
            if fits and alike:
                fits = move < max_move - LIMIT_TOLERANCE or (move <= max_move + LIMIT_TOLERANCE and moves < total)
            if fits and i < rows:
                at[i] = -1
                continue
            if fits:
                left[pose], max_move, total = beyond, move, moves
                copy_values(value[rows], found[pose])
            i -= 1
