"""The exact border of the section, as circular arcs with the joint values that make them.

In the arm's plane, with points as complex numbers x + i z, an arm that is its own mirror image has

    W = C + e^(-i theta_2) (U + e^(-i tau) M),    p = W + d e^(-i gamma) f,    f = e^(-i (theta_2 + tau)) F

with the tilt gamma of the tool against the forearm. On the border, each joint stands at a limit or the links that it
moves are in line with what they turn about (Kumar and Waldron 1981 [1]_): one joint sweeps, the others stand, so the
border is made of circular arcs. Of all such arcs, the parts are kept that have proven unreachable points beside them.

References
----------
.. [1] A. Kumar, K. J. Waldron, "The workspaces of a mechanical manipulator", J. Mech. Design 103, 1981.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.jit import kernel
from er3a.numerics.runs import runs
from er3a.workspace.empty import STACK, is_empty
from er3a.workspace.section_arm import SectionArm

Complexes = NDArray[np.complex128]
Swept = Literal["theta_2", "tau", "gamma"]

SAMPLES = 121
_SWEPT: tuple[Swept, ...] = ("theta_2", "tau", "gamma")
_BESIDE = 4e-3
_MOST_BOXES = 12_000
_ANGLE = 1e-9


@dataclass(frozen=True)
class BorderArc:
    """Part of a circle in the section.

    Attributes
    ----------
    points : (n, 2), m, radius (in a side view: x, negative behind axis 1) and height
    joints : (n, 3), rad, theta_2, tau and gamma
    """

    points: Reals
    joints: Reals
    sweeps: Swept


def border(arm: SectionArm, side_view: bool = False) -> list[BorderArc]:
    """Arcs of the border of the section; none if the arm is no mirror image of itself.

    A limited joint 1 is left out of account: what counts is whether any azimuth reaches the ring, or, in a side view,
    whether the arm reaches the point of its own plane without joint 1, as manufacturers draw it.
    """
    if not arm.mirrored or arm.inner_low > arm.inner_high:
        return []
    arcs, seen = [], set()
    for sweeps, joints in _candidates(arm):
        points = _points(arm, joints)
        key = tuple(np.round(points[[0, SAMPLES // 3, -1]].view(float), 9))
        if key in seen or np.ptp(np.abs(points - points.mean())) == 0:
            continue
        seen.add(key)
        kept = _on_border(arm, points, side_view)
        for run in _runs(kept):
            across = points[run].real if side_view else np.abs(points[run].real)
            section = np.stack([across, points[run].imag], axis=1)
            arcs.append(BorderArc(section, joints[run], sweeps))
    return arcs


def _points(arm: SectionArm, joints: Reals) -> Complexes:
    centre, upper, forearm, direction = (
        complex(vector[0], vector[2]) for vector in (arm.centre, arm.upper, arm.forearm, arm.direction)
    )
    theta_2, tau, gamma = joints.T
    wrist = centre + np.exp(-1j * theta_2) * (upper + np.exp(-1j * tau) * forearm)
    points: Complexes = wrist + arm.d * np.exp(-1j * (theta_2 + tau + gamma)) * direction
    return points


def _candidates(arm: SectionArm) -> Iterator[tuple[Swept, Reals]]:
    """All arcs on which one joint sweeps: pairs of its name and joint values (SAMPLES, 3)."""
    upper, forearm, tool = (complex(v[0], v[2]) for v in (arm.upper, arm.forearm, arm.direction))
    tool = arm.d * tool
    tilts = _tilts(arm)
    ends = {end for tilt in tilts for end in tilt if abs(end) > _ANGLE and end < np.pi}
    tilt_ends = sorted(ends) or [0.0]

    def in_line(fixed: complex, moving: complex, ranges: list[tuple[float, float]]) -> list[float]:
        """Angles within the ranges at which e^(-i angle) moving points along or against ``fixed``."""
        if min(abs(fixed), abs(moving)) < 1e-9:
            return []
        angle = -np.angle(fixed / moving)
        turns = [float(angle + half * np.pi) for half in range(-4, 5)]
        return sorted({turn for low, high in ranges for turn in turns if low - _ANGLE <= turn <= high + _ANGLE})

    def sweep(joint: int, low: float, high: float, values: tuple[float, float, float]) -> tuple[Swept, Reals]:
        joints = np.tile(np.array(values), (SAMPLES, 1))
        joints[:, joint] = np.linspace(low, high, SAMPLES)
        return _SWEPT[joint], joints

    stands = [(tau, gamma) for tau in arm.tau for gamma in tilt_ends]
    for tau in arm.tau:
        bend = np.exp(-1j * tau)
        stands += [(tau, gamma) for gamma in in_line(upper + bend * forearm, bend * tool, tilts)]
    for gamma in [*tilt_ends, *in_line(forearm, tool, tilts)]:
        stands += [(tau, gamma) for tau in in_line(upper, forearm + np.exp(-1j * gamma) * tool, [arm.tau])]
    for tau, gamma in stands:
        yield sweep(0, *arm.theta_2, (0.0, tau, gamma))
    for theta_2 in arm.theta_2:
        for gamma in [*tilt_ends, *in_line(forearm, tool, tilts)]:
            yield sweep(1, *arm.tau, (theta_2, 0.0, gamma))
        for tau in arm.tau if arm.d > 0 else ():
            for low, high in tilts:
                yield sweep(2, low, high, (theta_2, tau, 0.0))


def _tilts(arm: SectionArm) -> list[tuple[float, float]]:
    """Ranges of gamma in the arm's plane."""
    if arm.d == 0:
        return [(0.0, 0.0)]
    least, most = float(np.arccos(arm.inner_high)), float(np.arccos(arm.inner_low))
    return [(-most, most)] if least < _ANGLE else [(-most, -least), (least, most)]


def _on_border(arm: SectionArm, points: Complexes, side_view: bool) -> Flags:
    """Which points have a proven unreachable ring (or point of the plane) close beside them, on either side."""
    along = np.gradient(points)
    length = np.abs(along)
    normal = np.where(length > 0, 1j * along / np.where(length > 0, length, 1), 0)
    beside = np.concatenate([points + s * _BESIDE * arm.reach * normal for s in (1, -1)])
    rings = np.stack([np.abs(beside.real), beside.imag], axis=1)
    angles = np.tile([0.0, np.pi], (len(rings), 1))
    if side_view:
        angles[:] = np.where(beside.real >= 0, 0.0, np.pi)[:, None]
    free = np.zeros(len(rings), dtype=bool)
    _unreachable(arm, rings, angles, free)
    return free[: len(points)] | free[len(points) :]


@kernel
def _unreachable(arm: SectionArm, rings: Reals, angles: Reals, out: Flags) -> None:
    stack = np.empty((STACK, 6))
    for n in range(rings.shape[0]):
        rho, z = rings[n, 0], rings[n, 1]
        out[n], _ = is_empty(arm, (rho, rho, z, z), angles[n, 0], angles[n, 1], _MOST_BOXES, stack)


def _runs(kept: Flags) -> list[slice]:
    """Stretches of at least three points in a row."""
    return [slice(a, b) for a, b in runs(kept) if b - a >= 3]
