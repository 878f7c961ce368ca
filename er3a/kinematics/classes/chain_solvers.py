"""The solver of any chain, chosen from its geometry, with one interface for all classes.

Chains are constant links, with revolute and prismatic joints about and along z (:mod:`chain`); base, tool, offsets and
coupling are the caller's. In chains with more than six joints, one joint after another is held at a given value until a
class applies that needs none (six joints) or has its own parameter (arm angle). Chains with fewer joints are completed
by added joints; their axes are stated.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from er3a.by_value import by_identity
from er3a.geometry.transforms import frame_along, inverted
from er3a.kinematics.chain import axes_of, poses_of, size_of
from er3a.kinematics.classes import class_solvers
from er3a.kinematics.classes.arm_angle import about_x, about_z, arm_angle_arm
from er3a.kinematics.classes.parallel_axes import three_parallel
from er3a.kinematics.classes.scara import gantry, scara
from er3a.kinematics.classes.six_revolute import CERTAIN, CONTINUUM, prepared, solve_six_revolute
from er3a.kinematics.classes.slide_and_wrist import slide_and_wrist, solve_slide_and_wrist
from er3a.kinematics.classes.two_slides import solve_two_slides, two_slides
from er3a.kinematics.wrist_partitioned import WristPartitionedArm, constants_of, recognised
from er3a.numerics.arrays import Flags, Integers, Reals

FULL_RANK = 1e-7  # smallest singular value at some of a few random joint values; dependent joints have rounding there
PREFERENCE = tuple(class_solvers.ARM_CLASSES)


@by_identity
class LockedJoint(class_solvers.ChainSolver):
    """More than six joints, one of which is held at a value; ``rest`` solves the others. Self-motions are collected
    over the value."""

    links: Reals
    sliding: Flags
    joint: int
    rest: class_solvers.ChainSolver | None
    code: class_solvers.ArmClassCode
    slots: int
    parameters: tuple[class_solvers.Redundancy, ...]

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        """Rows of the chain with this joint at its value.

        Parameters
        ----------
        T : (N, 4, 4), m
        values : (N, k), rad or m, this joint's first, then those of the rest

        Returns
        -------
        q : (N, slots, n), rad or m, NaN in empty slots
        certainty : (N,), of the rest
        """
        own = values[:, 0]
        q = np.full((len(T), self.slots, len(self.sliding)), np.nan)
        certainty = np.full(len(T), CERTAIN)
        others = [j for j in range(len(self.sliding)) if j != self.joint]
        if self.rest is not None:
            q[:, :, others], certainty = self.rest.rows(self._without(T, own), values[:, 1:])
        else:
            # A joint within the arm: each value makes another chain, with constants of its own.
            for value in np.unique(own):
                at = own == value
                rest = chain_solver(*held(self.links, self.sliding, self.joint, float(value)))
                q[np.ix_(at, np.arange(rest.slots), np.array(others))], certainty[at] = rest.rows(T[at], values[at, 1:])
        q[:, :, self.joint] = np.where(np.isnan(q[:, :, others[0]]), np.nan, own[:, None])
        return q, certainty

    def _without(self, T: Reals, own: Reals) -> Reals:
        """The poses for the chain without its first or last joint."""
        ends = (0, 1) if self.joint == 0 else (len(self.sliding) - 1, len(self.sliding))
        links = np.array([self.links[ends[0]] if self.joint == 0 else np.eye(4), self.links[ends[1]]])
        if self.joint == 0:
            links[1] = np.eye(4)
        step = inverted(poses_of(links, own[:, None], self.sliding[[self.joint]]))
        return np.asarray(step @ T if self.joint == 0 else T @ step)

    def values_of(self, x: Reals) -> Reals:
        """Values of the parameters at joint values: this joint's own, then those of the rest.

        Parameters
        ----------
        x : (..., n), rad or m

        Returns
        -------
        values : (..., k), rad or m
        """
        own = x[..., self.joint, None]
        if self.rest is None or not self.rest.parameters:
            return own
        return np.concatenate([own, self.rest.values_of(np.delete(x, self.joint, axis=-1))], axis=-1)

    def names(self, x: Reals) -> tuple[class_solvers.SlotName, ...]:
        """The rest's slot names; none if the rest differs from value to value.

        Parameters
        ----------
        x : (n,), rad or m, the manufacturer's zero pose

        Returns
        -------
        names : in the order of the slots
        """
        return self.rest.names(np.delete(x, self.joint)) if self.rest is not None else ()


@by_identity
class Unsolved(class_solvers.ChainSolver):
    """A chain for which nothing here knows all solutions."""

    joints: int
    code: class_solvers.ArmClassCode = "unsolved"
    slots: int = 16

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        """No rows, and no certainty about any pose.

        Parameters
        ----------
        T : (N, 4, 4), m
        values : not looked at

        Returns
        -------
        q : (N, 16, n), NaN
        certainty : (N,), CONTINUUM
        """
        return np.full((len(T), self.slots, self.joints), np.nan), np.full(len(T), CONTINUUM)


def chain_solver(links: Reals, sliding: Flags, pointing: Reals | None = None) -> class_solvers.ChainSolver:
    """The solver of a chain, chosen from its geometry.

    Parameters
    ----------
    links : (n + 1, 4, 4), m
    sliding : (n,), prismatic joints
    pointing : (3,), in the tool's frame, the axis about which five joints leave the tool's turn open; None: its z

    Returns
    -------
    solver : ``Unsolved`` where no class applies
    """
    links, sliding = np.ascontiguousarray(links, dtype=float), np.asarray(sliding, dtype=bool)
    for recognised_as in CLOSED_FORMS:
        if (solver := recognised_as(links, sliding)) is not None:
            return solver
    n = len(sliding)
    if n == 6:
        return _by_elimination(links, sliding)
    if n > 6:
        return _locked(links, sliding)
    return _completed(links, sliding, np.array([0.0, 0.0, 1.0]) if pointing is None else pointing)


def _with_spherical_wrist(links: Reals, sliding: Flags) -> class_solvers.ChainSolver | None:
    """The closed form for axes 2 and 3 parallel and a spherical wrist."""
    if len(sliding) != 6 or sliding.any():
        return None
    wrist = recognised(*axes_of(links), poses_of(links, np.zeros(6)))
    return (
        class_solvers.SphericalWristSolver(links, constants_of(wrist))
        if isinstance(wrist, WristPartitionedArm)
        else None
    )


def _with_parallel_axes(links: Reals, sliding: Flags) -> class_solvers.ChainSolver | None:
    """The closed form for axes 2, 3 and 4 parallel, 5 and 6 meeting."""
    parallel = three_parallel(links) if len(sliding) == 6 and not sliding.any() else None
    return None if parallel is None else class_solvers.ParallelAxes(parallel)


def _with_three_slides(links: Reals, sliding: Flags) -> class_solvers.ChainSolver | None:
    """The closed form for three slides and three joints that turn, if these have six degrees of freedom."""
    if len(sliding) != 6 or sliding.sum() != 3 or not full_rank(links, sliding):
        return None
    three = gantry(links, sliding)
    return None if three is None else class_solvers.GantrySolver(three)


def _with_arm_angle(links: Reals, sliding: Flags) -> class_solvers.ChainSolver | None:
    """The closed form for seven joints with a spherical shoulder and wrist."""
    if len(sliding) != 7 or sliding.any():
        return None
    arm = arm_angle_arm(links)
    return None if arm is None else class_solvers.ArmAngle(arm)


def _as_scara(links: Reals, sliding: Flags) -> class_solvers.ChainSolver | None:
    """The closed form for four joints of one direction, one of them a slide."""
    planar = scara(links, sliding) if len(sliding) == 4 else None
    return None if planar is None else class_solvers.ScaraSolver(planar)


CLOSED_FORMS: tuple[Callable[[Reals, Flags], class_solvers.ChainSolver | None], ...] = (
    _with_spherical_wrist,
    _with_parallel_axes,
    _with_three_slides,
    _with_arm_angle,
    _as_scara,
)
"""For each class in closed form what recognises it: links (n + 1, 4, 4) and sliding (n,) to a solver or None. The first
that does is taken; what none recognises is solved by elimination, with joints held, or with joints added."""


def _by_elimination(links: Reals, sliding: Flags) -> class_solvers.ChainSolver:
    """The solver of any other six joints, by how many of them slide."""
    if not full_rank(links, sliding):
        return Unsolved(6, "dependent")
    if sliding.sum() == 2:
        two = two_slides(links, sliding)
        return (
            Unsolved(6)
            if two is None
            else class_solvers.EliminationSolver(partial(solve_two_slides, two), "six_two_prismatic")
        )
    arm = prepared(links, sliding)
    if not arm.readings:
        return Unsolved(6)
    by_elimination = partial(solve_six_revolute, arm)
    if not arm.clear and (with_wrist := slide_and_wrist(links, sliding)) is not None:
        return class_solvers.EliminationSolver(
            partial(solve_slide_and_wrist, with_wrist, by_elimination), "six_one_prismatic"
        )
    return class_solvers.EliminationSolver(by_elimination, "six_one_prismatic" if sliding.any() else "general_six")


def full_rank(links: Reals, sliding: Flags, at_rest: tuple[int, ...] = ()) -> bool:
    """Whether the chain has as many degrees of freedom as joints (six at most), by random joint values.

    Parameters
    ----------
    links : (n + 1, 4, 4), m
    sliding : (n,), prismatic joints
    at_rest : joints from 0 that stay at 0

    Returns
    -------
    full : the largest of the smallest singular values found is above ``FULL_RANK``
    """
    random = np.random.default_rng(5)
    scaled = np.array(links, float)
    scaled[:, :3, 3] /= size_of(links)
    best = 0.0
    for x in random.uniform(-2.5, 2.5, (4, len(sliding))):
        x[list(at_rest)] = 0.0
        values = np.linalg.svd(_jacobian(scaled, sliding, x), compute_uv=False)
        best = max(best, float(values[-1]))
    return best > FULL_RANK


def _jacobian(links: Reals, sliding: Flags, x: Reals) -> Reals:
    """Jacobian (6, n) of scaled links at random joint values, for its rank."""
    n = len(sliding)
    frames = [poses_of(links[: k + 1], x[:k], sliding[:k]) for k in range(n)]
    tip = poses_of(links, x, sliding)[:3, 3]
    J = np.zeros((6, n))
    for k, frame in enumerate(frames):
        z = frame[:3, 2]
        J[:, k] = np.r_[z, 0, 0, 0] if sliding[k] else np.r_[np.cross(z, tip - frame[:3, 3]), z]
    return J


def held(links: Reals, sliding: Flags, joint: int, value: float) -> tuple[Reals, Flags]:
    """The chain with one joint held at a value.

    Parameters
    ----------
    links : (n + 1, 4, 4), m
    sliding : (n,), prismatic joints
    joint : from 0
    value : rad or m

    Returns
    -------
    links : (n, 4, 4), m
    sliding : (n - 1,)
    """
    step = poses_of(np.array([links[joint], links[joint + 1]]), np.array([value]), sliding[[joint]])
    return np.concatenate([links[:joint], step[None], links[joint + 2 :]]), np.delete(sliding, joint)


def _locked(links: Reals, sliding: Flags) -> class_solvers.ChainSolver:
    """Of the joints that can be held, one at an end if there is any (then the rest is one chain for all values), and
    that which leaves the class easiest to solve; a sliding one before others."""
    n = len(sliding)
    best: tuple[tuple[int, int, int], int, class_solvers.ChainSolver] | None = None
    for joint in (*(j for j in (0, n - 1) if sliding[j]), n - 1, 0, *range(1, n - 1)):
        if best is not None and 0 < joint < n - 1:
            break
        rest_links, rest_sliding = held(links, sliding, joint, 0.4321)
        if joint == 0:
            rest_links = links[1:]
        elif joint == n - 1:
            rest_links = links[:-1]
        if not full_rank(rest_links, rest_sliding):
            continue
        rest = chain_solver(rest_links, rest_sliding)
        code = rest.code if not isinstance(rest, LockedJoint) else "redundant"
        rating = (isinstance(rest, Unsolved), not bool(sliding[joint]), PREFERENCE.index(code))
        if best is None or rating < best[0]:
            best = (rating, joint, rest)  # type: ignore[assignment]
    if best is None or isinstance(best[2], Unsolved):
        return Unsolved(n, "unsolved" if full_rank(links, sliding) else "dependent")
    _, joint, rest = best
    inner = tuple(
        class_solvers.Redundancy(p.joint + (p.joint >= joint), p.code) if p.joint >= 0 else p for p in rest.parameters
    )
    parameters = (class_solvers.Redundancy(joint, "locked_joint"), *inner)
    at_end = joint in (0, n - 1)
    return LockedJoint(links, sliding, joint, rest if at_end else None, "redundant", rest.slots, parameters)


def _completed(links: Reals, sliding: Flags, pointing: Reals) -> class_solvers.ChainSolver:
    """The chain with joints at the tool, or before its last joint, that make it a chain of six."""
    n = len(sliding)
    if not full_rank(links, sliding):
        return Unsolved(n, "dependent")
    best: tuple[int, class_solvers.ChainSolver] | None = None
    for code, places, candidate in _completions(links, n, pointing):
        more = np.zeros(6, dtype=bool)
        more[[j for j in range(6) if j not in places]] = sliding
        # where the added joints must be 0, not only where they would turn the tool elsewhere
        if not full_rank(candidate, more, places if code == "planar_wrist" else ()):
            continue
        rest = chain_solver(candidate, more)
        if isinstance(rest, Unsolved):
            continue
        place = PREFERENCE.index(rest.code)
        if best is not None and code == "planar_wrist" and places == tuple(range(n, 6)):
            break  # made for any chain, and needed by those alone that nothing else completes
        if best is None or (code == best[1].code and place < best[0]):
            best = (place, class_solvers.PaddedChain(rest, places, code))
    return Unsolved(n) if best is None else best[1]


def _completions(
    links: Reals, n: int, pointing: Reals
) -> list[tuple[class_solvers.ArmClassCode, tuple[int, ...], Reals]]:
    """Code, places of the added joints, and links (7, 4, 4) with them; the last is made for any chain."""
    eye = np.eye(4)
    axes, _ = axes_of(links)
    found: list[tuple[class_solvers.ArmClassCode, tuple[int, ...], Reals]] = []
    if n == 5:
        turn = eye.copy()
        turn[:3, :3] = frame_along(pointing).T
        found.append(("free_roll", (5,), np.concatenate([links[:-1], [links[-1] @ turn, turn.T]])))
        across = np.cross(axes[3], axes[4])
        if np.linalg.norm(across) > 1e-6:
            found.append(("planar_wrist", (4,), _with_joint_between(links, 4, across)))
    if n == 4:
        w = poses_of(links, np.zeros(4))[:3, :3].T @ axes[3]
        first, second = eye.copy(), eye.copy()
        second[:3, :3] = frame_along(w)[[1, 2, 0]].T  # z across the last axis
        first[:3, :3] = frame_along(w)[[2, 0, 1]].T  # z across both
        more = [links[-1] @ first, inverted(first) @ second, inverted(second)]
        found.append(("planar_wrist", (4, 5), np.concatenate([links[:-1], more])))
    if n == 3:
        # a wrist about the tool point; at right angles, so that it takes every orientation (one askew would lose arms
        # whose tool is tilted further than it can), and with the tool's own none of its singular ones
        across = eye.copy()
        across[:3, :3] = about_x(np.pi / 2)
        last = eye.copy()
        last[:3, :3] = about_z(0.7) @ about_x(1.1)
        found.append(("position", (3, 4, 5), np.concatenate([links, [across], [inverted(across)], [last]])))
    found.append(("planar_wrist", tuple(range(n, 6)), _with_any_joints(links, n)))
    return found


def _with_any_joints(links: Reals, n: int) -> Reals:
    """Links (7, 4, 4) with joints after the tool about axes without special places."""
    size, more = size_of(links), []
    for k in range(6 - n):
        step = np.eye(4)
        step[:3, :3] = about_z(0.7 + 0.9 * k) @ about_x(1.1 - 0.3 * k)
        step[:3, 3] = size * np.array([0.31, -0.17 + 0.13 * k, 0.23 - 0.19 * k])
        more.append(step)
    back = np.eye(4)
    for step in more:
        back = back @ step
    return np.array([*links[:-1], links[-1] @ more[0], *more[1:], inverted(back)])


def _with_joint_between(links: Reals, joint: int, axis: Reals) -> Reals:
    """Links with one more joint before ``joint`` (from 0): about ``axis`` (base frame, all joints at 0), through the
    point of that joint's axis nearest to the axis before it."""
    axes, points = axes_of(links)
    w = axis / np.linalg.norm(axis)
    before, own = axes[joint - 1], axes[joint]
    # where the common normal meets the joint's axis
    s = np.linalg.lstsq(np.column_stack([own, -before, w]), points[joint - 1] - points[joint], rcond=None)[0][0]
    frame = np.eye(4)
    x = own - (own @ w) * w
    x /= np.linalg.norm(x)
    frame[:3, :3] = np.column_stack([x, np.cross(w, x), w])
    frame[:3, 3] = points[joint] + s * own
    start = poses_of(links[:joint], np.zeros(joint - 1))  # frame of the joint before, all at 0
    own_frame = poses_of(links[: joint + 1], np.zeros(joint))
    first, second = np.linalg.inv(start) @ frame, np.linalg.inv(frame) @ own_frame
    return np.concatenate([links[:joint], [first], [second], links[joint + 1 :]])
