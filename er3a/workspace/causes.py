"""What makes a void: each limit is widened by itself, and the void's cells are judged again."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot
from er3a.workspace.cavities import Cavity
from er3a.workspace.proof import ring_volumes, unfilled_arcs
from er3a.workspace.section_arm import FULL_TURN, section_arm

InSection = Callable[[Reals], tuple[Reals, Reals, Reals]]

PROBES, SAMPLES = 300, 400_000
STEPS = (15.0, 30.0, 60.0, 90.0, 180.0)
"""By how much a limit is widened, deg, until the void vanishes."""
_GONE, _SHRUNK = 0.98, 0.10

Side = Literal["lower", "upper"]
_SIDES: tuple[Side, Side] = ("lower", "upper")


@dataclass(frozen=True)
class Relaxed:
    """One limit widened.

    Attributes
    ----------
    joint : from 1; joints that slide are left as they are
    limit_deg : the limit as it is
    by_deg : by how much it is widened: the least of ``STEPS`` that makes the void vanish, or the most there is
    filled : ratio of the void that is then reached
    """

    joint: int
    side: Side
    limit_deg: float
    by_deg: float
    filled: float

    @property
    def extended_deg(self) -> float:
        """The limit as it would be."""
        return self.limit_deg + (self.by_deg if self.side == "upper" else -self.by_deg)


@dataclass(frozen=True)
class Unlimited:
    """All limits taken away; ``filled`` is the ratio of the void that is then reached."""

    filled: float
    joint: Literal[0] = 0
    side: Literal["both"] = "both"


@dataclass(frozen=True)
class Disappears:
    """One limit alone makes the void, or each of two."""

    limits: tuple[Relaxed, ...]
    code: Literal["void_disappears"] = "void_disappears"


@dataclass(frozen=True)
class SeveralLimits:
    """Only several limits together make the void; ``most`` is the one that shrinks it most, if one does."""

    most: Relaxed | None
    code: Literal["void_of_several_limits"] = "void_of_several_limits"


@dataclass(frozen=True)
class Geometry:
    """Part of the void stays without any limit; ``most`` is the limit that shrinks it most, if one does."""

    remaining_ratio: float
    most: Relaxed | None
    code: Literal["void_of_geometry"] = "void_of_geometry"


@dataclass(frozen=True)
class OnlySampled:
    """Only samples tell of the void, so nothing is known of its cause."""

    code: Literal["void_only_sampled"] = "void_only_sampled"


VoidCause = Disappears | SeveralLimits | Geometry | OnlySampled


def relaxations(robot: Robot, cavity: Cavity, in_section: InSection | None = None) -> tuple[list[Relaxed], Unlimited]:
    """Judge a void's cells with each limit widened, the strongest first; then without any.

    Parameters
    ----------
    in_section : for an arm without a section form: from points (n, 3), m, in the base frame to their radius, azimuth
        and height about axis 1. Cells then count as reached if a random sample of the widened arm lies in them.
    """
    chosen = _probes(cavity)
    turning = [joint for joint in range(1, robot.joints + 1) if not robot.slides[joint - 1]]
    if in_section is None:
        before = _open_angle(robot, cavity, chosen)
        joints = list(range(1, 6))

        def ratio_filled(widened: Robot) -> float:
            return _ratio_filled(widened, cavity, chosen, before)
    else:
        joints = turning

        def ratio_filled(widened: Robot) -> float:
            return _ratio_sampled(robot, widened, cavity, chosen, in_section)

    found = [
        _relaxed(robot, joint, side, ratio_filled, in_section is None)
        for joint in joints
        if robot.upper[joint - 1] - robot.lower[joint - 1] < FULL_TURN
        for side in _SIDES
    ]
    found.sort(key=lambda relaxed: (relaxed.filled < _GONE, relaxed.by_deg, -relaxed.filled, relaxed.joint))
    return found, Unlimited(ratio_filled(_widened(robot, turning, _SIDES, 2 * np.pi)))


def _relaxed(robot: Robot, joint: int, side: Side, ratio_filled: Callable[[Robot], float], proven: bool) -> Relaxed:
    limit = float((robot.lower if side == "lower" else robot.upper)[joint - 1])

    def widened_by(step: float) -> Relaxed:
        filled = ratio_filled(_widened(robot, [joint], [side], float(np.radians(step))))
        return Relaxed(joint, side, float(np.degrees(limit)), step, filled)

    if proven and (most := widened_by(STEPS[-1])).filled < _GONE:
        return most  # no lesser step fills more; samples, spread thinner over a wider range, may tell otherwise
    for step in STEPS:
        found = widened_by(step)
        if found.filled >= _GONE:
            break
    return found


def cause_of(single: list[Relaxed], unlimited: Unlimited) -> VoidCause:
    """The cause that the relaxations show."""
    gone = [limit for limit in single if limit.filled >= _GONE]
    if gone:
        return Disappears(tuple(limit for limit in gone if limit.by_deg == gone[0].by_deg)[:2])
    strongest = max(single, key=lambda limit: limit.filled, default=None)
    most = strongest if strongest is not None and strongest.filled >= _SHRUNK else None
    if unlimited.filled >= _GONE:
        return SeveralLimits(most)
    return Geometry(1 - unlimited.filled, most)


def joints_behind(cause: VoidCause) -> set[int]:
    """The joints whose limits a cause names."""
    if isinstance(cause, Disappears):
        return {limit.joint for limit in cause.limits}
    return set() if isinstance(cause, OnlySampled) or cause.most is None else {cause.most.joint}


def _widened(robot: Robot, joints: Iterable[int], sides: Iterable[Side], by: float) -> Robot:
    lower, upper = robot.lower.copy(), robot.upper.copy()
    for joint in joints:
        if "upper" in sides:
            upper[joint - 1] += by
        if "lower" in sides:
            lower[joint - 1] -= by
    return robot.replace(lower=lower, upper=upper)


def _probes(cavity: Cavity) -> NDArray[np.intp]:
    """Numbers of the arcs that hold most of what is proven empty."""
    weight = cavity.volumes * cavity.empty
    chosen = np.argsort(-weight, kind="stable")[:PROBES]
    return chosen[weight[chosen] > 0]


def _open_angle(robot: Robot, cavity: Cavity, chosen: NDArray[np.intp]) -> Reals:
    """How much (rad) of each chosen arc an arm leaves open, at the middle of its cell."""
    middle = cavity.cells[chosen].reshape(-1, 2, 2).mean(axis=2)
    half = np.minimum(1e-6, middle[:, 0] / 2)
    probes = np.stack([middle[:, 0] - half, middle[:, 0] + half, middle[:, 1] - half, middle[:, 1] + half], axis=1)
    arcs = unfilled_arcs(section_arm(robot), probes)
    low, high = cavity.arcs[chosen].T
    a, b = np.maximum(arcs[..., 0], low[:, None]), np.minimum(arcs[..., 1], high[:, None])
    open_angle: Reals = np.nansum(np.maximum(0, b - a), axis=1)
    return open_angle


def _ratio_filled(robot: Robot, cavity: Cavity, chosen: NDArray[np.intp], before: Reals) -> float:
    """Ratio of what was open in the chosen arcs, by volume, that another arm fills."""
    section = ring_volumes(cavity.cells[chosen])
    return float(1 - (section @ _open_angle(robot, cavity, chosen)) / (section @ before))


def _ratio_sampled(
    robot: Robot, widened: Robot, cavity: Cavity, chosen: NDArray[np.intp], in_section: InSection
) -> float:
    """Ratio by volume of the chosen arcs that samples of a widened arm lie in; fewer samples can only lower it."""
    random = np.random.Generator(np.random.Philox(key=len(chosen)))
    q = random.uniform(widened.lower, widened.upper, (SAMPLES, robot.joints))
    # The arm as it is does not come here: at least one joint must be beyond its limit.
    q = q[((q < robot.lower) | (q > robot.upper)).any(axis=1)]
    rho, azimuth, z = in_section(forward(widened, q)[:, :3, 3])
    a, b, c, d = cavity.cells[chosen].T
    low, high = cavity.arcs[chosen].T
    inside = (rho > a.min()) & (rho < b.max()) & (z > c.min()) & (z < d.max())
    rho, azimuth, z = rho[inside], azimuth[inside] % (2 * np.pi), z[inside]
    hit = np.zeros(len(chosen), dtype=bool)
    for n in range(len(chosen)):
        in_cell = (rho > a[n]) & (rho < b[n]) & (z > c[n]) & (z < d[n])
        hit[n] = (in_cell & (azimuth >= low[n]) & (azimuth <= high[n])).any()
    volumes = cavity.volumes[chosen]
    return float(volumes[hit].sum() / volumes.sum()) if len(chosen) else 0.0
