"""The numerical inverse: any arm, from a start guess, with or without limits, for a full or partial pose.

Levenberg-Marquardt on the pose error in the tool frame of the target: the position in parts of a length, the rotation
as a rotation vector [2]_. The damping falls with the squared error [3]_, so that convergence is quadratic. Joints at a
limit that the step would leave are held there (projected Gauss-Newton). A start that stalls is replaced by a random
one; random numbers depend on seed, pose and start alone [4]_.

The damped step is ``J^T y`` with ``(J J^T + damping) y = e``: six equations for any number of joints [1]_.

Joint values of prismatic joints are counted in parts of the arm's length; coupled joints have the sum of their rows'
columns.

References
----------
.. [1] S. R. Buss, "Introduction to inverse kinematics with Jacobian transpose, pseudoinverse and damped least squares
   methods", 2004, equation 11.
.. [2] R. M. Murray, Z. Li, S. S. Sastry, *A Mathematical Introduction to Robotic Manipulation*, 1994, equation 2.18;
   its derivative: J. Sola et al., "A micro Lie theory", arXiv 1812.01537, equations 145 and 146.
.. [3] T. Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method", IEEE Trans.
   Robotics 27(5), 2011.
.. [4] G. L. Steele, D. Lea, C. H. Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
"""

from __future__ import annotations

from numbers import Integral, Real
from typing import NamedTuple

import numpy as np

from er3a.by_value import by_identity
from er3a.errors import Er3aError, PoseError, ShapeError
from er3a.finding import fact
from er3a.geometry.transforms import check_poses
from er3a.geometry.vectors import Vector, cross, dot, scaled
from er3a.kinematics.by_class import distinct
from er3a.kinematics.chain import arm_length, constant_links, joint_starts
from er3a.kinematics.classes.polish import error_and_columns
from er3a.kinematics.classes.self_motion import shortest_step
from er3a.kinematics.forward import checked_joints, jacobian
from er3a.kinematics.solutions import NotFound, Solutions
from er3a.numerics.arrays import Flags, Integers, Reals, as_floats, for_kernel
from er3a.numerics.jit import inner_kernel, kernel, parallel_for
from er3a.robots.joint_limits import limits_exceeded, nearest_equivalent, unwound, within
from er3a.robots.robot import Robot

DAMPING = 0.1  # times the squared error
MAX_ITERATIONS = 40  # of one start
LONGEST_STEP = 1.0  # rad
STALLED = 0.9  # the squared error must fall by this factor ...
PATIENCE = 3  # ... within so many iterations
MIN_DAMPING = 1e-15  # keeps the normal matrix positive at the solution

Arm = tuple[Reals, Reals, Reals, Flags]
"""What joints, slides in parts of the arm's length, move the table's rows by (m, n), start (m,), links (m + 1, 4, 4),
sliding (m,)."""
Limits = tuple[Reals, Reals, bool]  # lower, upper, and whether the iteration keeps to them
Goal = tuple[Reals, Reals, float]  # mask, tolerances, length
Draws = tuple[int, np.uint64, int]  # restarts, seed, number of the first pose


class Room(NamedTuple):
    """Scratch memory: row values (m,), frames (2, 4, 4), the pose error (6,), its derivatives by rows (6, m) and by
    joints (6, n), and the joints' step (n,)."""

    x: Reals
    frames: Reals
    e: Reals
    of_rows: Reals
    J: Reals
    step: Reals


@kernel
def new_room(arm: Arm) -> Room:
    """Scratch memory for an arm of n joints and m rows. Kernel.

    Parameters
    ----------
    arm : see ``Arm``

    Returns
    -------
    room : not filled
    """
    m, n = arm[0].shape
    return Room(np.empty(m), np.empty((2, 4, 4)), np.empty(6), np.empty((6, m)), np.empty((6, n)), np.empty(n))


@kernel
def solve_numerically(
    arm: Arm, limits: Limits, T: Reals, q: Reals, goal: Goal, draws: Draws, out: tuple[Reals, Integers]
) -> None:
    """Solve poses of any arm by iteration. Kernel.

    Random starts depend on the pose's number. Where no start reaches the tolerances, ``q`` is the nearest arm found and
    ``starts`` is 0.

    Parameters
    ----------
    arm : see ``Arm``
    limits : lower and upper (n,), rad or parts of the length, and whether to keep to them
    T : (N, 4, 4), m
    q : (N, n), rad or parts of the length, first start; replaced by what is found
    goal : mask (6,), tolerances (m, rad), length (m)
    draws : restarts, seed, number of the first pose
    out : fills ``error`` (N, 2) in m and rad, ``starts`` (N,)
    """
    (_, tolerances, length), (error, starts), room, now = goal, out, new_room(arm), np.empty(q.shape[1])
    for n in range(T.shape[0]):
        best, starts[n], first = np.inf, 0, q[n].copy()
        for start in range(draws[0] + 1):
            _begin(now, first, n, start, limits, draws)
            mark, since, count, solved, square = np.inf, 0, 0, False, np.inf
            position, rotation = np.inf, np.inf
            while not solved and since <= PATIENCE and count <= MAX_ITERATIONS:
                if count:
                    _step(limits, room, now)
                position, rotation = evaluate(arm, goal, T[n], now, room)
                square = (position / length) ** 2 + rotation**2
                solved = position <= tolerances[0] and rotation <= tolerances[1]
                mark, since = (square, 0) if square < STALLED * mark else (mark, since + 1)
                count += 1
            if solved or square < best or start == 0:
                best, error[n, 0], error[n, 1] = square, position, rotation
                q[n] = now
            if solved:
                starts[n] = start + 1
                break


@kernel
def uniform(seed: np.uint64, pose: int, start: int, joint: int) -> float:
    """A random number from a counter, by SplitMix64 [4]_. Kernel.

    Parameters
    ----------
    seed : of the search
    pose, start, joint : the counter

    Returns
    -------
    number : in [0, 1), a multiple of 2^-53
    """
    z = np.uint64(seed) + np.uint64(0x9E3779B97F4A7C15) * np.uint64(((pose * 65536 + start) * 8 + joint) + 1)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.float64(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@inner_kernel
def _begin(q: Reals, first: Reals, n: int, start: int, limits: Limits, draws: Draws) -> None:
    """Set joints to a start: the guess, or a random one within the limits."""
    (lower, upper, respect), (_, seed, before) = limits, draws
    for j in range(q.shape[0]):
        q[j] = first[j] if start == 0 else lower[j] + uniform(seed, before + n, start, j) * (upper[j] - lower[j])
        if respect:
            q[j] = min(max(q[j], lower[j]), upper[j])


@inner_kernel
def _seen_from(T: Reals, x: float, y: float, z: float) -> Vector:
    """A direction in the coordinates of a frame."""
    return (
        T[0, 0] * x + T[1, 0] * y + T[2, 0] * z,
        T[0, 1] * x + T[1, 1] * y + T[2, 1] * z,
        T[0, 2] * x + T[1, 2] * y + T[2, 2] * z,
    )


@kernel
def evaluate(arm: Arm, goal: Goal, T: Reals, q: Reals, room: Room) -> tuple[float, float]:
    """Find the masked pose error in the target's tool frame, and its derivatives by the joints. Kernel.

    Parameters
    ----------
    arm : see ``Arm``
    goal : mask, tolerances, length
    T : (4, 4), m, the target
    q : (n,), rad or parts of the length
    room : its ``e`` is filled with the position over the length and the rotation vector [2]_, its ``J`` with their
        derivatives

    Returns
    -------
    position, rotation : m and rad, sizes of what the mask asks
    """
    (motion, start, links, sliding), (mask, _, length), (x, frames, e, of_rows, J, _) = arm, goal, room
    for k in range(x.shape[0]):
        x[k] = start[k]
        for j in range(q.shape[0]):
            x[k] += motion[k, j] * q[j]
    cosine = 0.5 * (error_and_columns(links, sliding, T, x, frames, e, of_rows) - 1.0)
    frame = frames[x.shape[0] % 2]
    turn, shift = _seen_from(frame, e[3], e[4], e[5]), _seen_from(T, -e[0], -e[1], -e[2])
    sine = np.sqrt(dot(turn, turn))
    squared = 1.0 / 12.0
    if sine > 1e-8:
        theta = np.arctan2(sine, cosine)
        turn = scaled(turn, theta / sine)
        squared = 1.0 / (theta * theta) - (1.0 + cosine) / (2.0 * theta * sine)
    elif cosine <= 0.0:  # next to half a turn the axis is undefined; the error counts as half a turn about any axis
        turn, squared = (np.pi, np.pi, np.pi), 1.0 / np.pi**2
    for r in range(3):
        e[r], e[3 + r] = mask[r] * shift[r] / length, mask[3 + r] * turn[r]
    for k in range(x.shape[0]):
        v = _seen_from(T, of_rows[0, k], of_rows[1, k], of_rows[2, k])
        # Angular velocity in the arm's tool frame, then minus the inverse left Jacobian of the rotation vector.
        b = _seen_from(frame, of_rows[3, k], of_rows[4, k], of_rows[5, k])
        c = cross(turn, b)
        d = cross(turn, c)
        for r in range(3):
            of_rows[r, k] = mask[r] * v[r] / length
            of_rows[3 + r, k] = -mask[3 + r] * (b[r] - 0.5 * c[r] + squared * d[r])
    for r in range(6):
        for j in range(q.shape[0]):
            J[r, j] = 0.0
            for k in range(x.shape[0]):
                J[r, j] += of_rows[r, k] * motion[k, j]
    position = length * np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
    return position, np.sqrt(e[3] * e[3] + e[4] * e[4] + e[5] * e[5])


@inner_kernel
def _step(limits: Limits, room: Room, q: Reals) -> None:
    """Move by a damped step, at most ``LONGEST_STEP`` for any joint; joints that press against a limit stay."""
    (lower, upper, respect), e, J, step = limits, room.e, room.J, room.step
    damping, longest = MIN_DAMPING, LONGEST_STEP
    for r in range(6):
        damping += DAMPING * e[r] * e[r]
    for j in range(q.shape[0] if respect else 0):
        gradient = 0.0
        for r in range(6):
            gradient += J[r, j] * e[r]
        if (q[j] <= lower[j] and gradient > 0.0) or (q[j] >= upper[j] and gradient < 0.0):
            J[:, j] = 0.0
    shortest_step(J, e, damping, step)
    for j in range(q.shape[0]):
        longest = max(longest, abs(step[j]))
    for j in range(q.shape[0]):
        q[j] -= LONGEST_STEP / longest * step[j]
        if respect:
            q[j] = min(max(q[j], lower[j]), upper[j])


RESTARTS = 500  # random starts of a caller who names no other number
MISS_RESTARTS = 20  # where the nearest arm is asked for, without a reason
DIAGNOSIS_RESTARTS = 100  # to find out whether other starts or wider limits would help
TOLERANCE = 1e-10  # m or rad
NEARLY = 1e-6  # m (in parts of the arm's length) or rad: so near, only a singularity keeps the iteration from its end
RANK = 1e-3  # smallest singular value below which the end of an iteration counts as singular
SAME_ARM = 1e-6  # rad or m: ends of two starts so near are one solution
SMALLEST_PART = 64  # poses that are worth a thread's start


def solve(
    robot: Robot,
    T: Reals,
    q0: Reals | None = None,
    *,
    mask: Reals | None = None,
    respect_limits: bool = True,
    restarts: int = RESTARTS,
    position_tolerance: float = TOLERANCE,
    rotation_tolerance: float = TOLERANCE,
    seed: int = 0,
    threads: int = 1,
) -> Solutions:
    """Solve poses by iteration from a start guess, then from random ones (Levenberg-Marquardt [3]_).

    Parameters
    ----------
    T : (..., 4, 4), T_base_tool, m
    q0 : (n,) or (..., n), rad or m, where to start; None means the middle of the limits
    mask : 6 of 1 or 0: which of x, y, z and the rotations about x, y, z of the target's tool frame must be met; None
        means all. ``[1, 1, 1, 1, 1, 0]`` leaves the rotation about the tool's axis free.
    respect_limits : keep the joint limits inside the iteration; otherwise angles are returned in (-pi, pi]
    restarts : number of random starts after ``q0`` (0 to 65535)
    position_tolerance : m
    rotation_tolerance : rad
    seed : of the random starts; equal seeds give equal results for any number of threads
    threads : number of threads

    Returns
    -------
    solutions : one row for each pose: the solution, or the nearest arm found with the reason why there is none

    Raises
    ------
    ShapeError, PoseError, Er3aError
        naming the argument that can't be used
    """
    T = np.ascontiguousarray(check_poses(T))
    shape = T.shape[:-2]
    mask = _checked_mask(mask)
    for name, value, most in (("restarts", restarts, 65535), ("seed", seed, 2**63 - 1)):
        if not (isinstance(value, Integral) and 0 <= value <= most):
            raise Er3aError(f"{name} is {value!r}; expected a whole number from 0 to {most}")
    for name, tolerance in (("position_tolerance", position_tolerance), ("rotation_tolerance", rotation_tolerance)):
        if not (isinstance(tolerance, Real) and tolerance > 0):
            raise Er3aError(f"{name} is {tolerance!r}; expected a number above 0")
    q0 = (robot.lower + robot.upper) / 2 if q0 is None else checked_joints(robot, q0, "q0")
    n = robot.joints
    if q0.shape not in ((n,), (*shape, n)):
        raise ShapeError("q0", q0.shape, f"({n},) or {(*shape, n)}")
    if not np.isfinite(q0).all():
        raise PoseError("q0 holds NaN or infinity")
    search = _Search(robot, mask, np.array([position_tolerance, rotation_tolerance]), seed)
    return search.solutions(T, q0, respect_limits, restarts, threads, explained=True)


def nearest_arm(robot: Robot, T: Reals, q0: Reals, mask: Reals, respect_limits: bool) -> Solutions:
    """What :func:`solve` gives for one pose, without the reason where it finds none.

    Parameters
    ----------
    T : (4, 4), m
    q0 : (n,), rad or m, where to start
    mask : (6,), as for :func:`solve`
    respect_limits : keep the joint limits inside the iteration

    Returns
    -------
    solutions : one row

    Notes
    -----
    The reason takes ten times as long as the search.
    """
    search = _Search(robot, mask, np.full(2, TOLERANCE), seed=0)
    return search.solutions(np.ascontiguousarray(T), q0, respect_limits, MISS_RESTARTS, threads=1, explained=False)


def polished(robot: Robot, T: Reals, q: Reals, mask: Reals) -> Reals:
    """Joint values to which the iteration, blind to limits, leads from given ones.

    Parameters
    ----------
    T : (k, 4, 4), m
    q : (k, n), rad or m
    mask : (6,), as for :func:`solve`

    Returns
    -------
    q : (k, n), rad or m, whether they solve or not; tolerance 1e-12 m and rad
    """
    return _Search(robot, mask, np.full(2, 1e-12), seed=0).run(T, q, False, 0, 1)[0]


def all_found(robot: Robot, T: Reals, starts: int) -> Reals:
    """Different joint solutions that random starts find for one pose.

    Parameters
    ----------
    T : (4, 4), m
    starts : how many

    Returns
    -------
    q : (k, n), rad or m, angles in (-pi, pi]

    Notes
    -----
    There may be more: a search from random starts can't prove that it has found all.
    """
    search = _Search(robot, np.ones(6), np.array([1e-12, 1e-12]), seed=1)
    low, high = search.without_limits()
    begin = np.random.default_rng([0, 2]).uniform(low, high, (starts, robot.joints))
    q, _, used = search.run(np.tile(T, (starts, 1, 1)), begin, False, 0, 1)
    q = q[used > 0]
    return q[distinct(robot, q, SAME_ARM)]


@by_identity
class _Search:
    """A search for poses of one robot: what must be met, to which tolerances (m, rad), from which random numbers."""

    robot: Robot
    mask: Reals
    tolerances: Reals
    seed: int

    def solutions(
        self, T: Reals, q0: Reals, respect: bool, restarts: int, threads: int, *, explained: bool
    ) -> Solutions:
        """Search for poses, with the reason where none is found.

        Parameters
        ----------
        T : (..., 4, 4), m
        q0 : (n,) or (..., n), rad or m
        respect : keep the joint limits
        restarts : random starts after q0
        threads : number of threads
        explained : whether to find out why a pose was not solved

        Returns
        -------
        solutions : one row for each pose
        """
        robot, shape = self.robot, T.shape[:-2]
        poses = T.reshape(-1, 4, 4)
        starts_at = np.broadcast_to(q0, (*shape, robot.joints)).reshape(-1, robot.joints)
        q, error, starts = self.run(poses, starts_at, respect, restarts, threads)
        unsolved = tuple(
            fact("pose_unsolved", pose=int(n), why=self.explain(poses[n], q[n], error[n], respect, restarts))
            for n in (np.flatnonzero(starts == 0) if explained else ())
        )
        q = q.reshape(*shape, robot.joints)
        return Solutions(
            robot,
            q,
            solved=(starts > 0).reshape(shape),
            within_limits=(starts > 0).reshape(shape) & within(robot, q),
            branch=np.full(shape, -1),
            method=fact("iteration", starts=1 + restarts, lacking=None),
            unsolved=unsolved,
            position_error=error[:, 0].reshape(shape),
            rotation_error=error[:, 1].reshape(shape),
            starts=starts.reshape(shape),
        )

    def run(self, T: Reals, q0: Reals, respect: bool, restarts: int, threads: int) -> tuple[Reals, Reals, Integers]:
        """Run the kernel that fits the arm, in threads.

        Parameters
        ----------
        T : (N, 4, 4), m
        q0 : (N, n), rad or m
        respect, restarts, threads : as for :meth:`solutions`

        Returns
        -------
        q : (N, n), rad or m
        error : (N, 2), m and rad
        starts : (N,), 0 where none succeeded
        """
        robot, count, length = self.robot, len(T), arm_length(self.robot)
        error, starts, units = (
            np.empty((count, 2)),
            np.empty(count, dtype=np.int64),
            np.where(robot.slides, length, 1.0),
        )
        low, high = (robot.lower, robot.upper) if respect else self.without_limits()
        limits, q = (for_kernel(low / units), for_kernel(high / units), respect), q0 / units
        motion = for_kernel(robot.direction[:, None] * robot.joint_to_row * units)
        arm = motion, joint_starts(robot), for_kernel(constant_links(robot)), for_kernel(robot.sliding)
        goal, T = (for_kernel(self.mask), for_kernel(self.tolerances), length), for_kernel(T)

        def part(rows: slice) -> None:
            draws, out = (restarts, np.uint64(self.seed), rows.start), (error[rows], starts[rows])
            solve_numerically(arm, limits, T[rows], q[rows], goal, draws, out)

        parallel_for(count, threads, SMALLEST_PART, part)
        q *= units
        return (q if respect else unwound(robot, q)), error, starts

    def without_limits(self) -> tuple[Reals, Reals]:
        """Where joints start that need not keep to limits.

        Returns
        -------
        low, high : (n,), a turn about 0, rad; of slides a range twice as wide as theirs, m
        """
        robot = self.robot
        middle, half = (robot.lower + robot.upper) / 2, robot.upper - robot.lower
        low, high = np.where(robot.slides, middle - half, -np.pi), np.where(robot.slides, middle + half, np.pi)
        return low, high

    def explain(self, T: Reals, q: Reals, error: Reals, respect: bool, restarts: int) -> NotFound:
        """Why one pose was not solved: its nearest arm and a search without what may have hindered it.

        Parameters
        ----------
        T : (4, 4), m
        q : (n,), rad or m, the nearest arm found
        error : (2,), m and rad
        respect, restarts : of the search that failed

        Returns
        -------
        why : another start, the limits, a singular end, or no reach
        """
        miss = fact("nearest_miss", position_mm=float(error[0] * 1000), rotation_deg=float(np.degrees(error[1])))
        if restarts < DIAGNOSIS_RESTARTS:
            _, _, starts = self.run(T[None], q[None], respect, DIAGNOSIS_RESTARTS, 1)
            if starts[0]:
                return fact("bad_guess", miss=miss, solved_by="other_starts")
        if respect:
            free, _, starts = self.run(T[None], q[None], False, DIAGNOSIS_RESTARTS, 1)
            if starts[0]:
                exceeded = limits_exceeded(self.robot, nearest_equivalent(self.robot, free[0], q))
                return (
                    fact("limit_bound", miss=miss, exceeded=exceeded)
                    if exceeded
                    else fact("bad_guess", miss=miss, solved_by="without_limits")
                )
        length = arm_length(self.robot)
        J = jacobian(self.robot, q)
        J[:3] /= length
        singular = np.linalg.svd(J[self.mask > 0], compute_uv=False)[-1] < RANK
        if singular and max(error[0] / length, error[1]) < NEARLY:
            return fact("singular", miss=miss)
        return fact("unreachable", miss=miss)


def _checked_mask(mask: Reals | None) -> Reals:
    """The mask as six of 0.0 or 1.0; anything else is refused."""
    values = np.ones(6) if mask is None else as_floats(mask, "mask")
    if values.shape != (6,):
        raise ShapeError("mask", values.shape, "(6,)")
    if not np.isin(values, (0.0, 1.0)).all() or not values.any():
        raise Er3aError(f"mask is {values.tolist()}; expected six of 0 or 1, at least one 1")
    return values
