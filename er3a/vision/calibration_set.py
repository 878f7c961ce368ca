"""What was recorded for a hand-eye calibration, as arrays."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Literal

import numpy as np
import scipy

from er3a.by_value import ByValue, Displayed, Sheet, frozen
from er3a.errors import ShapeError
from er3a.geometry.transforms import check_poses, inverted, step_between
from er3a.numerics.arrays import Flags, Integers, Reals

PLACE_M, PLACE_RAD = 1e-3, np.radians(0.2)  # within which the flange stands at one place
Setup = Literal["eye_in_hand", "eye_to_hand"]
OpenFrame = Literal["flange_frame", "base_frame"]
"""What recorded poses may not be: the flange's, and in the robot's own base."""


@frozen
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
    q: Reals | None = None
    touched: Reals | None = None
    touch_deviation: float = 0.0
    shared: Reals | None = None
    of_joints: bool = False

    def sheet(self) -> Sheet:
        """What the notebook shows: where flange and board were, in mm.

        Returns
        -------
        sheet : a row for each sample
        """
        rows = zip(self.names, *(1000 * self.flange[:, :3, 3].T), *(1000 * self.target[:, :3, 3].T))
        columns = ("sample", *(f"{part}_{c}_mm" for part in ("flange", "board") for c in "xyz"))
        return Sheet.of_table(f"{len(self)} samples, {self.setup.replace('_', ' ')}", columns, rows)

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

    @cached_property
    def places(self) -> Integers:
        """At which place the flange was (N,), numbered from 0: errors of the arm, and most of the board's, are one at
        each, so that samples at one place count as one."""
        step = step_between(self.flange[:, None], self.flange[None])
        distance, turn = np.linalg.norm(step[..., :3], axis=2), np.linalg.norm(step[..., 3:], axis=2)
        near = (distance < PLACE_M) & (turn < PLACE_RAD)
        numbers: Integers = scipy.sparse.csgraph.connected_components(near, directed=False)[1]
        return numbers

    @cached_property
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
