"""What was recorded for a hand-eye calibration, as arrays."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from er3a.by_value import ByValue
from er3a.display import Displayed, Sheet, first_rows
from er3a.errors import ShapeError
from er3a.geometry.transforms import check_poses
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.vision.tangent import inverted

Setup = Literal["eye_in_hand", "eye_to_hand"]


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationSet(ByValue, Displayed):
    """Samples of one board seen by one camera. Lengths in m, angles in rad.

    Attributes
    ----------
    setup : ``eye_in_hand`` (camera on the flange, board fixed) or ``eye_to_hand`` (camera fixed, board on the flange)
    flange : (N, 4, 4), T_base_flange
    target : (N, 4, 4), T_camera_board
    names : N, what a person calls the samples
    camera_covariance : (N, 6, 6) of T_camera_board: position (m) and rotation vector (rad) by the camera's axes; None
        where nobody states it, then it is estimated
    flange_covariance : (6, 6) of T_base_flange, likewise by the base's axes
    q : (N, n), rad, joint angles, where they were recorded
    touched : (M, 2, 3), m: points in the camera (a fixed one) or on the board (a fixed one), and where the robot
        touched them in its base; they take no part in the calibration
    touch_deviation : standard deviation of a touch, m, in each coordinate

    Raises
    ------
    ShapeError, PoseError
        for arrays of other shapes, and matrices that are no rigid transforms
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
        """Where flange and board were, in mm."""
        rows = zip(self.names, *(1000 * self.flange[:, :3, 3].T), *(1000 * self.target[:, :3, 3].T))
        shown, left_out = first_rows(rows, len(self))
        columns = ("sample", *(f"{part}_{c}_mm" for part in ("flange", "board") for c in "xyz"))
        return Sheet(f"{len(self)} samples, {self.setup.replace('_', ' ')}", columns, shown, left_out)

    @property
    def hand(self) -> Reals:
        """F (N, 4, 4) of F X B = Y: T_base_flange for a camera on the flange, T_flange_base for a fixed one."""
        return self.flange if self.setup == "eye_in_hand" else inverted(self.flange)

    def take(self, rows: Flags | Integers) -> CalibrationSet:
        """The chosen samples: a mask (N,) or numbers."""
        rows = np.flatnonzero(rows) if rows.dtype == bool else rows
        covariance = self.camera_covariance
        return replace(
            self,
            flange=self.flange[rows],
            target=self.target[rows],
            names=tuple(self.names[row] for row in rows),
            camera_covariance=None if covariance is None else covariance[rows],
            q=None if self.q is None else self.q[rows],
        )
