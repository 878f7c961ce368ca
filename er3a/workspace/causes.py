"""What makes a void: each limit is widened by itself, and the void's cells are judged again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from er3a.kinematics.forward import forward
from er3a.pipeline.messages.language import N_, joined, said
from er3a.robots.robot import Robot
from er3a.workspace.cavities import Cavity
from er3a.workspace.proof import judge, ring_volumes
from er3a.workspace.section_arm import FULL_TURN, section_arm

PROBES, SAMPLES = 300, 400_000
STEPS = (15.0, 30.0, 60.0, 90.0, 180.0)
"""By how much a limit is widened, deg, until the void vanishes."""
_GONE, _SHRUNK = 0.98, 0.10


@dataclass(frozen=True)
class Relaxed:
    """One limit widened.

    Attributes
    ----------
    joint : 1 to 6, or 0 for all joints; side : "lower", "upper" or "both"
    limit_deg : the limit as it is, deg; None for all joints
    by_deg : by how much it is widened: the least of ``STEPS`` that makes the void vanish, or the most there is
    filled : share of the void that is then reached
    """

    joint: int
    side: str
    limit_deg: float | None
    by_deg: float | None
    filled: float


def relaxations(robot: Robot, cavity: Cavity, in_section: Callable[[np.ndarray], tuple] | None = None) -> list[Relaxed]:
    """Judge a void's cells with each limit widened, strongest first; then with all of them.

    Parameters
    ----------
    in_section : for an arm without a section form: from points (n, 3), m, in the base frame to their radius, azimuth
        and height about axis 1. Cells then count as reached if a random sample of the widened arm lies in them.
    """
    chosen = _probes(cavity)
    if in_section is None:
        before = _open_angle(robot, cavity, chosen)
        joints = range(1, 6)

        def share_filled(widened: Robot) -> float:
            return _share_filled(widened, cavity, chosen, before)
    else:
        joints = range(1, 7)

        def share_filled(widened: Robot) -> float:
            return _share_sampled(robot, widened, cavity, chosen, in_section)

    found = []
    for joint in joints:
        if robot.upper[joint - 1] - robot.lower[joint - 1] >= FULL_TURN:
            continue
        for side in ("lower", "upper"):
            limit = float(getattr(robot, side)[joint - 1])
            for step in STEPS:
                share = share_filled(_widened(robot, [joint], side, np.radians(step)))
                if share >= _GONE:
                    break
            found.append(Relaxed(joint, side, float(np.degrees(limit)), step, share))
    found.sort(key=lambda relaxed: (relaxed.filled < _GONE, relaxed.by_deg, -relaxed.filled, relaxed.joint))
    free = share_filled(_widened(robot, [1, 2, 3, 4, 5, 6], "both", 2 * np.pi))
    return [*found, Relaxed(0, "both", None, None, free)]


def describe(relaxed: list[Relaxed]) -> str:
    """The cause in one clause."""
    *single, everything = relaxed
    gone = [limit for limit in single if limit.filled >= _GONE]
    if gone:
        nearest = [limit for limit in gone if limit.by_deg == gone[0].by_deg]
        if len(nearest) == 1:
            return said("vanishes when {widened}", widened=_exceed(nearest[0]))
        return said("vanishes when {first} or {second}", first=_exceed(nearest[0]), second=_exceed(nearest[1]))
    single.sort(key=lambda limit: -limit.filled)
    part = [limit for limit in single if limit.filled >= _SHRUNK]
    shrinks = ""
    if part:
        shrinks = said("shrinks by {share:.0f} % when {widened}", share=100 * part[0].filled, widened=_exceed(part[0]))
    if everything.filled >= _GONE:
        if shrinks:
            return joined([shrinks, N_("only several limits together make it")])
        return N_("made by several limits together")
    left = said("geometry: {share:.0f} % of it stays without any joint limit", share=100 * (1 - everything.filled))
    return joined([left, shrinks])


def _exceed(limit: Relaxed) -> str:
    told = {"joint": limit.joint, "limit": f"{limit.limit_deg:+.4g}".replace("-", "−"), "by": limit.by_deg}
    if limit.side == "upper":
        return said("joint {joint} may exceed {limit} deg by {by:.3g} deg", **told)
    return said("joint {joint} may fall below {limit} deg by {by:.3g} deg", **told)


def _widened(robot: Robot, joints: list[int], side: str, by: float) -> Robot:
    lower, upper = robot.lower.copy(), robot.upper.copy()
    for joint in joints:
        if side in ("upper", "both"):
            upper[joint - 1] += by
        if side in ("lower", "both"):
            lower[joint - 1] -= by
    return robot.replace(lower=lower, upper=upper)


def _probes(cavity: Cavity) -> np.ndarray:
    """Numbers of the arcs that hold most of what is proven empty."""
    weight = cavity.volumes * cavity.empty
    chosen = np.argsort(-weight, kind="stable")[:PROBES]
    return chosen[weight[chosen] > 0]


def _open_angle(robot: Robot, cavity: Cavity, chosen: np.ndarray) -> np.ndarray:
    """How much (rad) of each chosen arc an arm leaves open, at the middle of its cell."""
    middle = cavity.cells[chosen].reshape(-1, 2, 2).mean(axis=2)
    half = np.minimum(1e-6, middle[:, 0] / 2)
    probes = np.stack([middle[:, 0] - half, middle[:, 0] + half, middle[:, 1] - half, middle[:, 1] + half], axis=1)
    looked = judge(section_arm(robot), probes)
    low, high = cavity.arcs[chosen].T
    a, b = np.maximum(looked.unfilled[..., 0], low[:, None]), np.minimum(looked.unfilled[..., 1], high[:, None])
    return np.nansum(np.maximum(0, b - a), axis=1)


def _share_filled(robot: Robot, cavity: Cavity, chosen: np.ndarray, before: np.ndarray) -> float:
    """Share of what was open in the chosen arcs, by volume, that another arm fills."""
    section = ring_volumes(cavity.cells[chosen])
    return float(1 - (section @ _open_angle(robot, cavity, chosen)) / (section @ before))


def _share_sampled(robot: Robot, widened: Robot, cavity: Cavity, chosen: np.ndarray, in_section: Callable) -> float:
    """Share by volume of the chosen arcs that samples of a widened arm lie in; fewer samples can only lower it."""
    random = np.random.Generator(np.random.Philox(key=len(chosen)))
    q = random.uniform(widened.lower, widened.upper, (SAMPLES, 6))
    # The arm as it is does not come here: at least one joint must be beyond its limit.
    q = q[((q < robot.lower) | (q > robot.upper)).any(axis=1)]
    rho, azimuth, z = in_section(forward(widened, q)[:, :3, 3])
    a, b, c, d = cavity.cells[chosen].T
    low, high = cavity.arcs[chosen].T
    inside = (rho > a.min()) & (rho < b.max()) & (z > c.min()) & (z < d.max())
    rho, azimuth, z = rho[inside], azimuth[inside] % (2 * np.pi), z[inside]
    hit = np.array(
        [
            ((rho > a[n]) & (rho < b[n]) & (z > c[n]) & (z < d[n]) & (azimuth >= low[n]) & (azimuth <= high[n])).any()
            for n in range(len(chosen))
        ],
        dtype=bool,
    )
    volumes = cavity.volumes[chosen]
    return float(volumes[hit].sum() / volumes.sum()) if len(chosen) else 0.0
