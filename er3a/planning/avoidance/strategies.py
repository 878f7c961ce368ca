"""All ways around side by side: what each costs, and which one to take."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from er3a.kinematics.forward import forward
from er3a.pipeline.messages.kinematics import say
from er3a.pipeline.messages.language import joined, said
from er3a.planning.avoidance.damped_least_squares import damped
from er3a.planning.avoidance.deviation import deviation
from er3a.planning.avoidance.joint_detour import detour
from er3a.planning.avoidance.other_branch import branch
from er3a.planning.avoidance.singular_segment import Trouble, WayAround, margin
from er3a.planning.avoidance.slow_down import slow
from er3a.planning.avoidance.stop_before import stop
from er3a.planning.avoidance.via_point import shifted_via, tilted_via
from er3a.planning.timing import Timed, TimingError
from er3a.robots.joint_limits import limits_exceeded, within

WAYS: dict[str, Callable[[Trouble], WayAround]] = {
    "slow": slow,
    "branch": branch,
    "via_shift": shifted_via,
    "via_tilt": tilted_via,
    "damped": damped,
    "detour": detour,
    "stop": stop,
}
ARRIVED = 1e-3, np.radians(0.1)  # m and rad from the path's end
ON_PATH = 1e-6, np.radians(1e-4)
OVER = 1e-6  # relative, by which rounding may exceed a limit


@dataclass(frozen=True, eq=False)
class Price:
    """A way around, and what it costs.

    Attributes
    ----------
    motion : None where the way is not possible
    usable : whether it does the whole path within the limits of angles, speeds and accelerations
    reason : why it is not possible or not usable; empty if it is
    done : share of the path that is done
    distance, angle : (N,), m and rad: how far the tool is from the path
    speed, acceleration : greatest share of a joint's limit that is needed
    clear : whether the arm keeps its distance from the singular sets wherever the tool is on or beside the path (a
        joint move may pass them: it takes no harm)
    """

    name: str
    motion: Timed | None
    usable: bool
    reason: str
    done: float = 0.0
    distance: np.ndarray | None = None
    angle: np.ndarray | None = None
    speed: float = np.nan
    acceleration: float = np.nan
    clear: bool = False


def compare(trouble: Trouble, chosen: str | None = None) -> list[Price]:
    """Try all ways around, or the chosen one."""
    return [_priced(trouble, name, way) for name, way in WAYS.items() if chosen in (None, name)]


def best(prices: list[Price], meets: bool) -> Price | None:
    """Of the usable ways the one that leaves the path least (mm and deg added), then the quickest; else None.

    Parameters
    ----------
    meets : whether the path meets a singular pose; a way that goes through it is then taken only if no other is usable
    """
    usable = [price for price in prices if price.usable]

    def cost(price: Price) -> tuple[bool, float, float]:
        far, turned = price.distance.max(), price.angle.max()
        on_path = far < ON_PATH[0] and turned < ON_PATH[1]
        return (
            meets and not price.clear,
            0.0 if on_path else float(far * 1000 + np.degrees(turned)),
            price.motion.duration,
        )

    return min(usable, key=cost, default=None)


def _priced(trouble: Trouble, name: str, way: Callable[[Trouble], WayAround]) -> Price:
    try:
        found = way(trouble)
    except TimingError as error:
        return Price(name, None, False, str(error))
    if found.motion is None:
        return Price(name, None, False, found.reason)
    robot, motion, line = trouble.robot, found.motion, trouble.followed.line
    T = forward(robot, motion.q)
    distance, angle, _ = deviation(line, T)
    speed, acceleration = motion.share(trouble.limits)
    faults = []
    last = line.poses(np.array(1.0))
    left = float(np.linalg.norm(T[-1, :3, 3] - last[:3, 3]))
    twisted = 2 * np.arcsin(min(1.0, float(np.linalg.norm(T[-1, :3, :3] - last[:3, :3])) / np.sqrt(8.0)))
    if name == "stop":
        faults.append(said("only {share:.0%} of the path is done", share=found.done))
    elif left > ARRIVED[0] or twisted > ARRIVED[1]:
        far = {"mm": left * 1000, "deg": np.degrees(twisted)}
        faults.append(said("it ends {mm:.3g} mm and {deg:.3g} deg from the path's end", **far))
    outside = ~within(robot, motion.q)
    if outside.any():
        faults.append(say(limits_exceeded(robot, motion.q[_worst(trouble, motion.q)])))
    if speed > 1 + OVER:
        faults.append(said("a joint needs {share:.2f} times its greatest speed", share=speed))
    if acceleration > 1 + OVER:
        faults.append(said("a joint needs {share:.2f} times its greatest acceleration", share=acceleration))
    keeps = name in ("stop", "detour") or bool(margin(robot, motion.q, trouble.near).min() > 1 - 1e-6)
    if name == "branch":
        keeps = True
    reason = joined(faults)
    return Price(name, motion, not faults, reason, found.done, distance, angle, speed, acceleration, keeps)


def _worst(trouble: Trouble, q: np.ndarray) -> int:
    beyond = np.maximum(q - trouble.robot.upper, trouble.robot.lower - q).max(axis=1)
    return int(np.argmax(beyond))
