"""Whether one factor explains the corrections of all lengths, as a measuring device with a wrong scale makes them.

With c the corrections of a table's lengths, s their half-widths and v the table's values, ``c = k v`` is fitted by
least squares with weights 1/s^2; k has the interval that follows from the covariance of c.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.calibration.calibrate import Calibration, Estimate
from er3a.calibration.outcomes import NotToldApart, SetsScale

EXPLAINED = 1.5
"""Half-widths by which a correction may differ from the factor's; of 20, chance takes one beyond in 1 of 15 cases."""
BEYOND_CHANCE = 2.0
"""Half-widths of its own by which a factor differs from 1 at least, about four standard deviations."""

OPPOSITE = -0.5
"""Cosine of an alpha below which axes may be parallel with opposite directions, so that d along one counts negative."""


@dataclass(frozen=True)
class CommonScale:
    """A factor by which all corrected lengths are the table's.

    Attributes
    ----------
    half_width : of its 95 % interval
    lengths : those that it is estimated from
    """

    factor: float
    half_width: float
    lengths: tuple[str, ...]


def scale_is_assumed(found: Calibration) -> bool:
    """Whether lengths were measured, whose scale counts as exact; else the longest of the table keeps its value."""
    return not any(isinstance(why, SetsScale) for why in found.held)


def common_scale(found: Calibration) -> CommonScale | None:
    """The factor that explains the corrections of all lengths of the table; None where none does, where noise does,
    and where fewer than two lengths that aren't 0 are estimated."""
    if not scale_is_assumed(found):
        return None
    nominal = {k: _nominal(found, each) for k, each in enumerate(found.estimates)}
    chosen = [k for k, value in nominal.items() if value is not None]
    v = np.array([nominal[k] for k in chosen], float)
    if np.count_nonzero(v) < 2:
        return None
    c = np.array([found.estimates[k].correction for k in chosen])
    width = np.array([found.estimates[k].half_width for k in chosen])
    if not (width > 0).all():
        return None
    by = v / width**2 / ((v / width) ** 2).sum()
    k = float(by @ c)
    half_width = float(np.sqrt((by * width) @ found.correlation[np.ix_(chosen, chosen)] @ (by * width)))
    if (np.abs(c - k * v) > EXPLAINED * width).any() or abs(k) < BEYOND_CHANCE * half_width:
        return None
    return CommonScale(1 + k, half_width, tuple(found.estimates[i].name for i, value in zip(chosen, v) if value))


def _nominal(found: Calibration, estimate: Estimate) -> float | None:
    """What a factor acts on: a length of the table, with others that it can't be told apart from; None of base, tool,
    angles, and lengths that an angle looks like."""
    if not (estimate.parameter.joint and estimate.unit == "mm"):
        return None
    value = estimate.nominal
    for why in found.held:
        if isinstance(why, NotToldApart) and estimate.name in why.entries:
            others = [name for name in why.entries if name != estimate.name]
            if not all(name[0] in "ad" and name[1:].isdigit() for name in others):
                return None
            together = sum(1000 * float(getattr(found.robot, name[0])[int(name[1:]) - 1]) for name in others)
            if together and (np.cos(found.robot.alpha) < OPPOSITE).any():
                return None
            value += together
    return value
