"""Observations by eye: one joint is jogged a little, and the direction in which a point or the tool moves is noted.

Directions are those of the base: forward is +x, left +y, up +z. A tilt is the motion of the direction in which the
flange faces, its z axis. A turn is clockwise as seen when looking forward, up, and so on.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import field
from typing import ClassVar, Literal, get_args

import numpy as np

from er3a.by_value import frozen
from er3a.numerics.arrays import Reals
from er3a.references import quantities

Seen = Literal[
    "up", "down", "left", "right", "forward", "back",
    "tilts_up", "tilts_down", "tilts_left", "tilts_right", "tilts_forward", "tilts_back",
    "clockwise_looking_up", "clockwise_looking_down", "clockwise_looking_left", "clockwise_looking_right",
    "clockwise_looking_forward", "clockwise_looking_back",
]  # fmt: skip
SEEN: tuple[Seen, ...] = get_args(Seen)
TOWARD: dict[str, quantities.Vector] = {
    "up": (0.0, 0.0, 1.0),
    "down": (0.0, 0.0, -1.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
    "forward": (1.0, 0.0, 0.0),
    "back": (-1.0, 0.0, 0.0),
}
Manner = Literal["moves", "tilts", "turns"]
MANNERS: dict[str, Manner] = {"tilts": "tilts", "clockwise": "turns"}
COARSE_DEG = 60.0
"""Half-width of what the eye can be trusted with: a motion up and to the side may be seen as either."""
STILL = 1e-9  # m/rad or 1: a motion below this is rounding, and has no direction
PARALLEL = np.sin(np.radians(1.0))  # axes within a degree have no common normal that can be measured


@frozen
class SeenMotion(quantities.QuantityAtPose):
    """Angle between a motion while one joint is jogged in + and the direction in which it was seen; 90 if nothing
    moves."""

    joint: int
    point: quantities.Point
    seen: Seen = field(compare=False)
    unit: ClassVar[quantities.Unit] = "deg"

    def value(self, state: quantities.ModelState) -> Reals:
        """Angle between the motion and the direction in which it was seen.

        Parameters
        ----------
        state : of one model, or of a batch

        Returns
        -------
        angle : (...), deg, 0 to 180; 90 if nothing moves
        """
        return quantities.angle_between(*self._directions(state), True)

    def off(self, state: quantities.ModelState, expected: float) -> Reals:
        """Components across the seen direction whose length is the angle, if 0 is expected.

        Parameters
        ----------
        state : of one model, or of a batch
        expected : deg, nearly always 0

        Returns
        -------
        off : (..., 2), deg, for an expected angle of 0; else (..., 1)
        """
        return quantities.turned_apart(*self._directions(state)) if expected == 0 else super().off(state, expected)

    @property
    def vector(self) -> Hashable:
        """The motion of the point, or of the tool, of which this is one observation."""
        return self.pose, self.joint, self.point, self.manner

    @property
    def manner(self) -> Manner:
        """Whether a point moves, or the tool tilts or turns."""
        return MANNERS.get(self.seen.partition("_")[0], "moves") if "_" in self.seen else "moves"

    def apart(self, expected: float, other: quantities.Quantity, other_expected: float) -> float:
        """Angle between the directions in which two observations saw the motion.

        Parameters
        ----------
        expected, other_expected : not looked at: both are angles from the direction that was seen
        other : the same joint and pose; an observation in another manner contradicts nothing

        Returns
        -------
        angle : deg, 0 to 180
        """
        if not isinstance(other, SeenMotion) or other.manner != self.manner:
            return 0.0
        return float(quantities.angle_between(self._seen_toward(), other._seen_toward(), True))

    def _seen_toward(self) -> Reals:
        """The direction that was seen, (3,), base frame."""
        return np.array(TOWARD[self.seen.rpartition("_")[2]])

    def _directions(self, state: quantities.ModelState) -> tuple[Reals, Reals]:
        """The motion's direction and the one that was seen, (..., 3) each."""
        T = state.at(self.pose)
        moves = {self.joint - 1: 1.0} if state.coupling is None else dict(enumerate(state.coupling[:, self.joint - 1]))
        motion = np.zeros_like(T[..., 0, :3, 2])
        frame = quantities.FRAME_OF_POINT[self.point]
        for row, factor in moves.items():
            if 0 <= frame < row and self.manner == "moves":
                continue  # the joint comes after the point
            axis = factor * T[..., row, :3, 2] * state.direction[..., row, None]
            arm = T[..., quantities.FRAME_OF_POINT[self.point], :3, 3] - T[..., row, :3, 3]
            if state.sliding is not None and state.sliding[row]:
                motion = motion + (axis if self.manner == "moves" else 0.0)
            elif self.manner == "turns":
                motion = motion + axis
            else:
                motion = motion + np.cross(axis, T[..., -1, :3, 2] if self.manner == "tilts" else arm)
        toward = np.broadcast_to(self._seen_toward(), motion.shape)
        still = np.linalg.norm(motion, axis=-1, keepdims=True) < STILL
        across = np.roll(toward, 1, axis=-1)  # replaces a missing motion: square to every direction
        return np.where(still, across, motion), toward


@frozen
class TableEntry(quantities.Quantity):
    """An entry of the table itself, measured by itself: a length (a, d) in mm, or an angle (alpha, offset) in deg.

    A length d is the distance along an axis between the common normals with the axes before and after it that are not
    parallel to it: between parallel axes the normal is anywhere, so their d is one length together.
    """

    column: Literal["a", "d", "alpha", "offset"]
    joint: int

    @property
    def unit(self) -> quantities.Unit:
        """mm or deg."""
        return "mm" if self.column in ("a", "d") else "deg"

    def value(self, state: quantities.ModelState) -> Reals:
        """The table's entry; d summed over neighbouring parallel axes.

        Parameters
        ----------
        state : of one model, or of a batch, with its ``columns``

        Returns
        -------
        entry : (...), mm (a, d) or deg (alpha, offset)
        """
        column = state.columns[self.column]
        if self.column == "d":
            return self._along_parallel(column, state.columns["twist"]) * quantities.MM
        entry = column[..., self.joint - 1]
        return entry * quantities.MM if self.unit == "mm" else np.degrees(entry)

    def _along_parallel(self, d: Reals, twist: Reals) -> Reals:
        """Sum (...,) of d over the axes that are parallel to the joint's, each counted along it."""
        at = self.joint - 1
        factors = np.where(np.abs(np.sin(twist)) < PARALLEL, np.cos(twist), 0.0)
        total: Reals = d[..., at]
        for steps in (range(at, d.shape[-1] - 1), range(at - 1, -1, -1)):
            factor = np.ones(d.shape[:-1])
            for k in steps:
                factor = factor * factors[..., k]
                total = total + factor * d[..., k + 1 if k >= at else k]
        return total

    def off(self, state: quantities.ModelState, expected: float) -> Reals:
        """Difference from the stated entry; of angles the shorter way round.

        Parameters
        ----------
        state : of one model, or of a batch
        expected : mm or deg

        Returns
        -------
        off : (..., 1), mm, or deg from -180 to 180
        """
        off = self.value(state) - expected
        return (off if self.unit == "mm" else off - 360.0 * np.round(off / 360.0))[..., None]

    def apart(self, expected: float, other: quantities.Quantity, other_expected: float) -> float:
        """Difference of two stated entries; of angles the shorter way round.

        Parameters
        ----------
        expected, other_expected : mm or deg
        other : the same entry

        Returns
        -------
        distance : mm, or deg from 0 to 180
        """
        off = expected - other_expected
        return abs(off) if self.unit == "mm" else abs(off - 360.0 * round(off / 360.0))
