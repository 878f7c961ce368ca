"""What was recorded for a hand-eye calibration, as arrays.

Two streams of poses may have clocks of their own. :func:`time_offset` estimates the offset between them, and
:func:`paired` interpolates poses at equal times. Hand and eye turn by equal angles over equal times, so the offset is
the one at which the board's rotation angles over short times agree best with the arm's. It is searched on a grid and
refined.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import scipy

from er3a.by_value import ByValue, Displayed, Sheet
from er3a.errors import Er3aError, ShapeError
from er3a.geometry.transforms import check_poses, inverted, posed, step_between
from er3a.numerics.arrays import Flags, Integers, Reals

PLACE_M, PLACE_RAD = 1e-3, np.radians(0.2)  # within which the flange stands at one place
Setup = Literal["eye_in_hand", "eye_to_hand"]
OpenFrame = Literal["flange_frame", "base_frame"]
"""What recorded poses may not be: the flange's, and in the robot's own base."""


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationSet(ByValue, Displayed):
    """Samples of one board seen by one camera. Lengths in m, angles in rad.

    Attributes
    ----------
    setup : ``eye_in_hand`` (camera on the flange, board fixed) or ``eye_to_hand`` (camera fixed, board on the flange)
    flange : (N, 4, 4), T_base_flange
    target : (N, 4, 4), T_camera_board
    names : N, names of the samples
    camera_covariance : (N, 6, 6) of T_camera_board: position (m) and rotation vector (rad) in the camera's axes; None
        if it is unknown: then it is estimated
    shared : (N, 6, k), m and rad in the camera's axes: the change of T_camera_board by one standard deviation of each
        of k independent errors that all samples share (intrinsics estimated from their images); None if there are none
    flange_covariance : (6, 6) of T_base_flange, in the base's axes
    q : (N, n), rad, joint angles, if they were recorded
    of_joints : whether ``flange`` was computed from joint values by the robot's table, also where these are not kept
    touched : (M, 2, 3), m: points in the frame of a fixed camera, or on a fixed board, and the same points in the
        robot's base as the robot touched them; not used in the calibration
    touch_deviation : standard deviation of a touch, m, in each coordinate

    Raises
    ------
    ShapeError, PoseError
        for arrays of the wrong shape, and matrices that are not rigid transforms
    """

    setup: Setup
    flange: Reals
    target: Reals
    names: tuple[str, ...] = ()
    camera_covariance: Reals | None = None
    flange_covariance: Reals | None = None
    q: Reals | None = None
    touched: Reals | None = None
    touch_deviation: float = 0.0
    shared: Reals | None = None
    of_joints: bool = False

    def __post_init__(self) -> None:
        for name in ("flange", "target"):
            object.__setattr__(self, name, check_poses(getattr(self, name), name))
        count = len(self.flange)
        if self.target.shape != self.flange.shape or self.flange.ndim != 3:
            raise ShapeError("target", self.target.shape, f"that of flange, {self.flange.shape}")
        names = self.names or tuple(str(number + 1) for number in range(count))
        if len(names) != count:
            raise ShapeError("names", (len(names),), f"({count},)")
        object.__setattr__(self, "names", names)

    def __len__(self) -> int:
        return len(self.flange)

    def sheet(self) -> Sheet:
        """What the notebook shows: where flange and board were, in mm.

        Returns
        -------
        sheet : a row for each sample
        """
        rows = zip(self.names, *(1000 * self.flange[:, :3, 3].T), *(1000 * self.target[:, :3, 3].T))
        columns = ("sample", *(f"{part}_{c}_mm" for part in ("flange", "board") for c in "xyz"))
        return Sheet.of_table(f"{len(self)} samples, {self.setup.replace('_', ' ')}", columns, rows, len(self))

    @cached_property
    def places(self) -> Integers:
        """At which place the flange was (N,), numbered from 0: errors of the arm, and most of the board's, are one at
        each, so that samples at one place count as one."""
        step = step_between(self.flange[:, None], self.flange[None])
        distance, turn = np.linalg.norm(step[..., :3], axis=2), np.linalg.norm(step[..., 3:], axis=2)
        near = (distance < PLACE_M) & (turn < PLACE_RAD)
        numbers: Integers = scipy.sparse.csgraph.connected_components(near, directed=False)[1]
        return numbers

    @property
    def hand(self) -> Reals:
        """F (N, 4, 4) of F X B = Y: T_base_flange for a camera on the flange, T_flange_base for a fixed one."""
        return self.flange if self.setup == "eye_in_hand" else inverted(self.flange)

    def open_frames(self, simulated: bool) -> tuple[OpenFrame, ...]:
        """Frames in which recorded poses may be meant, as nothing is compared with them.

        Joint values say which flange and base are meant, touched points where the base is; simulated poses are known.

        Parameters
        ----------
        simulated : whether the samples were made by a simulation

        Returns
        -------
        frames : empty if nothing is open
        """
        if simulated or self.states_joints:
            return ()
        return ("flange_frame", "base_frame") if self.touched is None else ("flange_frame",)

    @property
    def states_joints(self) -> bool:
        """Whether joint values say where the flange was; recorded poses may be a tool's, or in another frame."""
        return self.of_joints or self.q is not None

    def take(self, rows: Flags | Integers) -> CalibrationSet:
        """The chosen samples, with all that belongs to them; touched points stay.

        Parameters
        ----------
        rows : a mask (N,), or numbers from 0 in any order

        Returns
        -------
        samples : in the order of the numbers
        """
        rows = np.flatnonzero(rows) if rows.dtype == bool else rows
        covariance = self.camera_covariance
        return replace(
            self,
            flange=self.flange[rows],
            target=self.target[rows],
            names=tuple(self.names[row] for row in rows),
            camera_covariance=None if covariance is None else covariance[rows],
            q=None if self.q is None else self.q[rows],
            shared=None if self.shared is None else self.shared[rows],
        )


GRID_S = 0.02  # s, between offsets tried before the best is refined
SPAN_S = 0.4  # over which turns are compared
INLIER = 3.0  # standard deviations, beyond which a rotation counts as wrong
MAX_PAIRS = 2000  # of rotations, that are compared at most
MIN_PAIRS = 10  # of rotations, without which an offset is left open


@dataclass(frozen=True, eq=False)
class Stream:
    """Poses T (N, 4, 4), m, at rising times t (N,), s."""

    t: Reals
    T: Reals


@dataclass(frozen=True)
class TimeOffset:
    """The camera's time plus ``offset`` is the arm's, s, with half its 95 % interval; angles differ by ``rms``, rad.

    ``unused``: poses of the camera that no sample was made of.
    """

    offset: float
    half_width: float
    rms: float
    pairs: int
    unused: int = 0


class OffsetOpenError(Er3aError):
    """Two streams leave their offset open: ``pairs`` of the camera's poses can be compared with the arm's, which are
    too few, or the best offset is the ``end`` of the range that was searched, s."""

    def __init__(self, pairs: int, end: float | None = None):
        self.pairs, self.end = pairs, end
        too_few = f"only {pairs} pairs of poses can be compared, and it takes {MIN_PAIRS}"
        super().__init__(too_few if end is None else f"the best offset, {end:.3g} s, is an end of the range searched")


def time_offset(hand: Stream, eye: Stream, widest: float) -> TimeOffset:
    """Estimate the offset between the clocks of two streams, by rotation angles over short times.

    Robust: up to half of the compared rotations may be wrong.

    Parameters
    ----------
    hand, eye : streams of poses with times in s
    widest : s, the offset is sought within this to either side

    Returns
    -------
    offset : to be added to the eye's times, s

    Raises
    ------
    OffsetOpenError
        if the streams have too little time in common, or the offset is not within the range
    """
    arm = scipy.spatial.transform.Slerp(hand.t, scipy.spatial.transform.Rotation.from_matrix(hand.T[:, :3, :3]))
    later = np.searchsorted(eye.t, eye.t + SPAN_S)
    first = np.flatnonzero(later < len(eye.t))
    first = first[eye.t[later[first]] - eye.t[first] < 2 * SPAN_S]
    first = first[:: max(1, len(first) // MAX_PAIRS)]
    last = later[first]
    R = scipy.spatial.transform.Rotation.from_matrix(eye.T[:, :3, :3])
    turned = (R[last] * R[first].inv()).magnitude()
    low, high = eye.t[first] - widest > hand.t[0], eye.t[last] + widest < hand.t[-1]
    kept = low & high
    first, last, turned = first[kept], last[kept], turned[kept]
    if len(first) < MIN_PAIRS:
        raise OffsetOpenError(len(first))

    def off(offset: float) -> Reals:
        there = arm(eye.t[last] + offset) * arm(eye.t[first] + offset).inv()
        difference: Reals = there.magnitude() - turned
        return difference

    grid = np.arange(-widest, widest + GRID_S / 2, GRID_S)
    best = float(grid[int(np.argmin([np.median(np.abs(off(offset))) for offset in grid]))])
    scale = max(float(np.median(np.abs(off(best)))) / 0.674, 1e-9)

    def cost(offset: float) -> float:
        return float(np.sum(np.minimum((off(offset) / scale) ** 2, INLIER**2)))

    found = float(scipy.optimize.minimize_scalar(cost, bounds=(best - GRID_S, best + GRID_S), method="bounded").x)
    if abs(found) > widest - min(GRID_S, widest / 10):
        raise OffsetOpenError(len(first), float(np.copysign(widest, found)))
    rest, slope = off(found), (off(found + 1e-3) - off(found - 1e-3)) / 2e-3
    inlier = np.abs(rest) < INLIER * scale
    deviation = np.sqrt((rest[inlier] ** 2).mean() / max((slope[inlier] ** 2).sum(), 1e-300))
    return TimeOffset(found, float(1.96 * deviation), float(np.sqrt((rest[inlier] ** 2).mean())), int(inlier.sum()))


def paired(hand: Stream, eye: Stream, offset: float, count: int) -> tuple[Reals, Reals, Reals]:
    """Poses of hand and eye at equal times, spread over rotations.

    The arm's poses are interpolated. Poses are chosen one after another, each the farthest in angle from those before.
    Only the half of all times counts at which the arm is slowest: there an error of the offset matters least.

    Parameters
    ----------
    offset : s, to be added to the eye's times
    count : how many poses; fewer if the streams have fewer in common

    Returns
    -------
    hand, eye, t : (count, 4, 4), m, twice, and (count,), s by the hand's clock
    """
    inside = np.flatnonzero((eye.t + offset > hand.t[0]) & (eye.t + offset < hand.t[-1]))
    t = eye.t[inside] + offset
    arm = scipy.spatial.transform.Slerp(hand.t, scipy.spatial.transform.Rotation.from_matrix(hand.T[:, :3, :3]))
    near = np.clip(t, hand.t[0] + 0.05, hand.t[-1] - 0.05)
    speed = (arm(near + 0.05) * arm(near - 0.05).inv()).magnitude()
    slow = np.argsort(speed, kind="stable")[: max(count, len(t) // 2)]
    inside, t = inside[np.sort(slow)], t[np.sort(slow)]
    R = arm(t)
    chosen = [0]
    distance = (R * R[0].inv()).magnitude()
    while len(chosen) < min(count, len(t)):
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, (R * R[chosen[-1]].inv()).magnitude())
    rows = np.sort(chosen)
    position = np.stack([np.interp(t[rows], hand.t, hand.T[:, k, 3]) for k in range(3)], axis=1)
    return posed(R[rows].as_matrix(), position), eye.T[inside[rows]], t[rows]
