"""Orientations read by another convention than they were written by, found because the samples fit only by the other.

Quaternions whose real part stands at the other end keep all turning angles, for that moves them as a rotation and a
mirror of four dimensions does; so do some orders of Euler angles. Only a fit can tell them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import permutations

import numpy as np
import scipy

from er3a.geometry.transforms import rpy_of
from er3a.numerics.arrays import Reals
from er3a.vision.calibration_set import CalibrationSet
from er3a.vision.classic_methods import solved_by
from er3a.vision.likelihood import residuals
from er3a.vision.suspects import MOST_DEVIATION, angles_between
from er3a.vision.tangent import posed, quaternion_of, transposed
from er3a.vision.vision_findings import AngleOrder, OtherReading, QuaternionOrder, Streams, TransposedRotations

MUCH_DISTANCE, MUCH_ROTATION = 0.01, np.radians(3)  # m, rad
MUCH_BETTER = 5
STREAMS: tuple[Streams, ...] = ("flange", "target", "both")
NAMED = {"x": "roll", "y": "pitch", "z": "yaw"}
SWAPPED = {"z": "roll", "y": "pitch", "x": "yaw"}
COLUMNS = ("roll", "pitch", "yaw")


def _products() -> dict[str, tuple[str, list[int]]]:
    """Other products of three turns: what they are called, their axes, and the column of each angle."""
    found = {}
    for named in (NAMED, SWAPPED):
        for axes in permutations("xyz"):
            text = " ".join(f"R{axis}({named[axis]})" for axis in axes)
            found[text] = "".join(axes).upper(), [COLUMNS.index(named[axis]) for axis in axes]
    found["Rz(roll) Ry(pitch) Rz(yaw)"] = "ZYZ", [0, 1, 2]
    del found["Rz(yaw) Ry(pitch) Rx(roll)"]  # as they are read
    return found


PRODUCTS = _products()


def other_reading(samples: CalibrationSet, residual: Reals) -> OtherReading | None:
    """The convention by which the samples fit much better; None if they fit, or if none makes them.

    Parameters
    ----------
    residual : (N, 6), m and rad, of the fit as the samples are read
    """
    given, turned = _misfit(residual)
    if given < 1:
        return None
    best: tuple[float, OtherReading] | None = None
    for again, finding in _readings(samples, turned):
        mismatch = np.abs(angles_between(again.flange[:, :3, :3]) - angles_between(transposed(again.target)[:, :3, :3]))
        if np.median(mismatch) > MOST_DEVIATION:
            continue
        try:
            raw = residuals(again.hand, again.target, *solved_by("park", again.hand, again.target))[0]
        except np.linalg.LinAlgError:
            continue
        size, turn = _misfit(raw)
        if size < given / MUCH_BETTER and (best is None or size < best[0]):
            best = size, replace(finding, rms_other_deg=turn)
    return best[1] if best else None


def _misfit(residual: Reals) -> tuple[float, float]:
    """Residuals (N, 6) in what a camera of any use keeps, both parts added; and root mean square of the turns, deg."""
    distance, turn = (float(np.sqrt((residual[:, part] ** 2).mean())) for part in (slice(3), slice(3, 6)))
    return distance / MUCH_DISTANCE + turn / MUCH_ROTATION, float(np.degrees(turn))


def _readings(samples: CalibrationSet, given: float) -> Iterator[tuple[CalibrationSet, OtherReading]]:
    for stream in STREAMS:
        for shift in (0, 2):  # x, y, z, w taken for w, x, y, z, and the other way round
            yield _with(samples, stream, partial(_rolled, shift=shift)), QuaternionOrder(stream, given, given)
        for text, (axes, columns) in PRODUCTS.items():
            turned = partial(_product, axes=axes, columns=columns)
            yield _with(samples, stream, turned), AngleOrder(stream, text, given, given)
        yield _with(samples, stream, _transposed), TransposedRotations(stream, given, given)


def _with(samples: CalibrationSet, stream: Streams, rotations: Callable[[Reals], Reals]) -> CalibrationSet:
    """The samples with other rotations of a stream."""
    T, B = samples.flange, samples.target
    if stream != "target":
        T = posed(rotations(T), T[:, :3, 3])
    if stream != "flange":
        B = posed(rotations(B), B[:, :3, 3])
    return replace(samples, flange=T, target=B)


def _transposed(T: Reals) -> Reals:
    return transposed(T[:, :3, :3])


def _rolled(T: Reals, shift: int) -> Reals:
    R: Reals = scipy.spatial.transform.Rotation.from_quat(np.roll(quaternion_of(T), shift, axis=1)).as_matrix()
    return R


def _product(T: Reals, axes: str, columns: list[int]) -> Reals:
    R: Reals = scipy.spatial.transform.Rotation.from_euler(axes, rpy_of(T)[:, columns]).as_matrix()
    return R
