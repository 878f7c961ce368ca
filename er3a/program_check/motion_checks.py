"""The path of a motion, and its faults except collisions.

The duration and time law of a motion, from the program's speeds: from rest to rest at constant acceleration.

A controller's own ramps and blends decide the true times; these are estimates.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from er3a.by_value import ByValue
from er3a.collision.along import RateBounds
from er3a.errors import NotWristPartitionedError, PoseError
from er3a.geometry.transforms import exp_rotation, log_rotation, rotation_angle
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import NearSingular, determinant_factors
from er3a.kinematics.solutions import branch_labels
from er3a.kinematics.wrist_partitioned import wrist_partition_missing
from er3a.numerics.arrays import Reals
from er3a.planning import motion_faults
from er3a.planning.follow import Followed
from er3a.planning.moves import Segment, line
from er3a.planning.piecewise import polynomial_motion
from er3a.planning.profiles import trapezoid
from er3a.planning.sequences import TURN_LENGTH, Arc, ArcWithPath, arc
from er3a.planning.timing import JointLimits
from er3a.planning.tool_proof import ProofRequirements, ToolProof, follow_and_prove
from er3a.program_check import program_check_findings as found_in
from er3a.programs.instructions import RAMP_OF_A_DURATION, ArmMotion, Rate, turn_beside_path
from er3a.robots.joint_limits import joint_shown
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import LIMIT_TOLERANCE


@dataclass(frozen=True)
class MotionLaw:
    """A trapezoidal speed profile.

    Attributes
    ----------
    duration : s; ramp : share of it that each ramp takes, at most 1/2
    """

    duration: float
    ramp: float

    @property
    def breaks(self) -> Reals:
        """Times (s) at which the acceleration steps."""
        ramp = self.ramp * self.duration
        return np.unique([0.0, ramp, self.duration - ramp, self.duration])

    @property
    def saved_by_blend(self) -> float:
        """Time (s) saved by not stopping at one end."""
        return self.duration * self.ramp / 2


@dataclass(frozen=True)
class AssumedRates:
    """What is assumed where a program does not say.

    Attributes
    ----------
    tool_speed : m/s; tool_acceleration : m/s^2; joint_share : of the joints' maximum speed
    """

    tool_speed: float = 0.25
    tool_acceleration: float = 2.0
    joint_share: float = 0.1


def law_of(way: float, speed: float, acceleration: float) -> MotionLaw:
    """The trapezoidal profile over a length, at a speed and an acceleration in the same unit of length."""
    if way * acceleration >= speed * speed:
        duration = way / speed + speed / acceleration
        return MotionLaw(duration, speed / acceleration / duration)
    return MotionLaw(2 * math.sqrt(way / acceleration), 0.5)


def tool_law(motion: ArmMotion, size: float, assumed: AssumedRates) -> MotionLaw:
    """The law of a line or arc; ``size`` in m, where turns count too."""
    speed, acceleration = motion.speed, motion.acceleration
    if speed is not None and speed.unit == "s" and speed.value > 0:
        return MotionLaw(speed.value, RAMP_OF_A_DURATION)
    v = _given(speed, "m/s") or assumed.tool_speed
    a = _given(acceleration, "m/s2") or assumed.tool_acceleration
    return law_of(size, v, a)


def joint_law(
    motion: ArmMotion, steps: Reals, limits: JointLimits, assumed: AssumedRates, length: float = 0.0
) -> MotionLaw:
    """The law of a joint move whose joints turn by ``steps`` (n,) in rad, all together.

    With a speed of the tool it takes as long as the tool's straight way of ``length`` (m), and no joint is faster than
    it can be.
    """
    speed, acceleration = motion.speed, motion.acceleration
    if speed is not None and speed.unit == "s" and speed.value > 0:
        return MotionLaw(speed.value, RAMP_OF_A_DURATION)
    size = np.abs(steps)
    lead = int(np.argmax(size))
    if speed is not None and speed.unit == "rad/s" and speed.value > 0:
        a = _given(acceleration, "rad/s2") or float(limits.acceleration[lead])
        return law_of(float(size[lead]), speed.value, a)
    along = _given(speed, "m/s")
    share = 1.0 if along is not None else _given(speed, "share") or assumed.joint_share
    quick = _given(acceleration, "share") or 1.0
    laws = [
        law_of(float(way), float(v) * share, float(a) * quick)
        for way, v, a in zip(size, limits.speed, limits.acceleration)
        if way > 0
    ]
    law = max(laws, key=lambda law: law.duration)
    if along is None or law.duration >= length / along:
        return law
    return MotionLaw(length / along, law.ramp)


def is_given(motion: ArmMotion) -> bool:
    """Whether the program gives a speed that the motion's law uses."""
    units = ("s", "rad/s", "share", "m/s") if motion.kind == "joint" else ("s", "m/s")
    return motion.speed is not None and motion.speed.unit in units and motion.speed.value > 0


def progress(law: MotionLaw, t: Reals) -> tuple[Reals, Reals, Reals]:
    """Path parameter (0 to 1) at times (n,), s, with its first and second time derivative."""
    return trapezoid(np.clip(t, 0.0, law.duration), law.duration, law.ramp)


def _given(rate: Rate | None, unit: str) -> float | None:
    return rate.value if rate is not None and rate.unit == unit and rate.value > 0 else None


PARTS, HALVINGS = 200, 50


def time_of_share(law: MotionLaw, share: float) -> float:
    """Time (s) at which the path parameter (0 to 1) is reached."""
    low, high = 0.0, law.duration
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        early = float(progress(law, np.array(middle))[0]) < share
        low, high = (middle, high) if early else (low, middle)
    return high


def limit_moment(law: MotionLaw, side: motion_faults.LimitSide, start: Reals, end: Reals) -> float:
    """When (s) a joint move between joints (n,) goes beyond a side of a limit that its end is beyond; 0 if it begins
    there."""
    at_start, at_end, bound = float(side.of(start)), float(side.of(end)), side.sign * side.limit
    return 0.0 if at_start >= bound else time_of_share(law, (bound - at_start) / (at_end - at_start))


def speed_moment(law: MotionLaw, share_of_max: float) -> float:
    """Time (s) on the ramp up at which the speed is a ratio (0 to 1) of its maximum."""
    return law.ramp * law.duration * share_of_max


def change_moment(law: MotionLaw, kind: Callable[[float], int | None]) -> float:
    """Time (s) at which ``kind``, a function of the path parameter, first differs from its value at the start."""
    shares = np.linspace(0.0, 1.0, PARTS + 1)
    first = kind(0.0)
    other = next((i for i, share in enumerate(shares) if kind(float(share)) not in (first, None)), PARTS)
    low, high = float(shares[other - 1]), float(shares[other])
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if kind(middle) == first else (low, middle)
    return time_of_share(law, high)


POINTS_APART_M, POINTS_APART_RAD = 0.01, np.radians(2.0)
MIN_POINTS, MAX_POINTS = 21, 501
NO_WAY = 1e-9  # m or rad
SPEED_TOLERANCE = 1e-6  # relative
FAR_TURN, NEAR_MOVE = np.radians(90.0), 0.05  # of a joint that jumps: it turns so far where the tool moves less
SPARED = np.radians(10.0)  # the other way round is named where it is shorter by so much
SAME_ARRIVAL = 1e-4  # rad


@dataclass(frozen=True, eq=False)
class CheckRules(ByValue):
    """What motions are checked against.

    Attributes
    ----------
    near : distances below which a pose of a line counts as near-singular
    limits : of the joints, assumed where no document gives them
    """

    near: NearSingular
    limits: JointLimits
    assumed: AssumedRates


@dataclass(frozen=True, eq=False)
class MotionPath(ByValue):
    """A motion's way.

    Attributes
    ----------
    t : (N,), s, rising from 0; q : (N, n), rad, NaN where unreachable
    joints : angles (..., n) at times (...,)
    joints_at : angles (..., n) at shares of the way (...,)
    rates : bounds of speeds and accelerations between times
    length : m, of the tool point's way; for a joint move of the straight line between its ends
    turned : rad, by which the tool turns, or for a joint move the joint that turns most
    end : (n,), rad; None where the end is not reached
    tool_path : of the tool; None for a joint move
    moments : s, when what is found begins; not of findings about the way as a whole
    """

    arm: Robot
    law: MotionLaw
    t: Reals
    q: Reals
    joints: Callable[[Reals], Reals]
    joints_at: Callable[[Reals], Reals]
    rates: RateBounds
    length: float
    turned: float
    end: Reals | None
    findings: tuple[found_in.CheckFinding, ...]
    tool_path: Segment | None = None
    moments: Mapping[found_in.CheckFinding, float] = field(default_factory=dict)

    def sagitta(self, share: float) -> tuple[float, float]:
        """By how much (m, rad) a share of the tool's way bulges over the straight line between its ends.

        Of a turn that is the eighth of its second derivative, and for what the rotation vectors' own frame bends of
        turns up to 1 rad, beyond which nothing is proven of corners, as much again.
        """
        path = self.tool_path
        if not isinstance(path, Arc):
            return 0.0, 0.0
        half = min(path.angle * share / 2, np.pi)
        turn = path.turning_bend * share**2 / 4 if isinstance(path, ArcWithPath) else 0.0
        return float(path.radius * (1 - np.cos(half))), turn

    def along_mm(self, t: float) -> float:
        """Length (mm) of the tool point's path up to a time."""
        return round(1000 * self.length * float(progress(self.law, np.array(t))[0]), 3)


@dataclass(frozen=True, eq=False)
class _JointMove(ByValue):
    """A synchronous joint move from ``start`` by ``step``, both (n,), rad or m."""

    law: MotionLaw
    start: Reals
    step: Reals

    def joints_at(self, share: Reals) -> Reals:
        """Joint values (..., n) at shares of the way (...,)."""
        return self.start + np.asarray(share)[..., None] * self.step

    def joints(self, t: Reals) -> Reals:
        """Joint values (..., n) at times (...,)."""
        return self.joints_at(progress(self.law, np.asarray(t, float))[0])

    def rates(self, t: Reals) -> tuple[Reals, Reals, Reals]:
        """Joint values, speeds and accelerations (N, n) at times (N,)."""
        share, speed, acceleration = (each[..., None] * self.step for each in progress(self.law, t))
        return self.start + share, speed, acceleration


def joint_motion_path(arm: Robot, motion: ArmMotion, start: Reals, end: Reals, rules: CheckRules) -> MotionPath | None:
    """A joint move; None if no joint moves."""
    step = end - start
    if np.abs(step).max() < NO_WAY:
        return None
    tool = forward(arm, np.stack([start, end]))
    moved = float(np.linalg.norm(tool[1, :3, 3] - tool[0, :3, 3]))
    law = joint_law(motion, step, rules.limits, rules.assumed, moved)
    move = _JointMove(law, start, step)
    turn = tool[1, :3, :3] @ tool[0, :3, :3].T
    turned = float(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))
    times = np.linspace(0.0, law.duration, _points(0.0, float(np.abs(step).max())))
    top = 1 / (1 - law.ramp) / law.duration
    peaks = np.abs(step) * top, np.abs(step) * top / (law.ramp * law.duration)
    moments = {
        **_limit_moments(arm, law, start, end),
        **_rate_moments(arm, law, peaks, rules.limits),
        **_configuration_moment(arm, law, move.joints_at),
    }
    findings = (*moments, *_joint_jumps(arm, start, end, moved, turned))
    lead = float(np.abs(step).max())
    rates = polynomial_motion(move.rates, law.breaks, 2).rate_bounds
    return MotionPath(
        *(arm, law, times, move.joints(times), move.joints, move.joints_at, rates, moved, lead, end, findings),
        moments=moments,
    )


def limit_findings(arm: Robot, q: Reals) -> tuple[motion_faults.LimitCause, ...]:
    """Joints (n,) in rad or m, and sums of them, that are beyond a limit."""
    return tuple(side.cause(float(side.of(q))) for side in _sides_left(arm, q))


def _sides_left(arm: Robot, q: Reals) -> list[motion_faults.LimitSide]:
    return [
        side for side in motion_faults.limit_sides(arm) if float(side.of(q)) > side.sign * side.limit + LIMIT_TOLERANCE
    ]


def _limit_moments(arm: Robot, law: MotionLaw, start: Reals, end: Reals) -> dict[found_in.CheckFinding, float]:
    """Limits that the end (n,) of a joint move exceeds, with the times (s) at which the move crosses them."""
    return {side.cause(float(side.of(end))): limit_moment(law, side, start, end) for side in _sides_left(arm, end)}


def tool_motion_path(
    arm: Robot, motion: ArmMotion, start: Reals, goal: tuple[Reals, Reals | None, Reals | None], rules: CheckRules
) -> MotionPath | found_in.CheckFinding | None:
    """A line or arc from joints (n,) in rad; None if the tool does not move, a finding if it can't be followed.

    Parameters
    ----------
    goal : T_world_tool (4, 4) at the end; joints (n,) there, where the program gives them; the arc's point (4, 4), m
    """
    end, given, via = goal
    T_start = forward(arm, start)
    try:
        shape = line(T_start, end, 1.0) if via is None else _arc(T_start, via, end, (1.0, None), motion)
    except PoseError:
        return found_in.ArcHasNoCircle()
    if max(shape.length, TURN_LENGTH * shape.turned) < NO_WAY:
        return None
    law, said = _turning_law(motion, (T_start, end), (shape.length, shape.turned), rules.assumed)
    said += _turns_otherwise(motion, T_start, end)
    if via is not None and isinstance(shape, ArcWithPath):
        said += (found_in.ArcTurnInDoubt(),) if _beside(T_start, via, end, shape)[1] else ()
    elif shape.turned > np.pi - SIDE_OPEN:
        x, y, z = (np.round(arm.base[:3, :3].T @ shape.rotation / shape.turned, 3) + 0.0).tolist()
        said += (found_in.TurnsEitherWay((x, y, z)),)
    path: Segment = (
        line(T_start, end, law.duration, None, law.ramp)
        if via is None
        else _arc(T_start, via, end, (law.duration, law.ramp), motion)
    )
    times = np.linspace(0.0, law.duration, _points(path.length, path.turned))
    try:
        followed, proof = follow_and_prove(arm, path, times, ProofRequirements(rules.limits.rates, rules.near), start)
    except NotWristPartitionedError:
        return found_in.LineNotChecked()
    last = followed.q[-1]
    end_joints = last if np.isfinite(last).all() else None
    way = MotionPath(
        *(arm, law, followed.t, followed.q, followed.joints, followed.joints_at, proof.rate_bounds),
        *(path.length, path.turned, end_joints, (), path),
    )
    carried = bool(getattr(motion.target, "external", ()))
    moments = _followed_moments(followed, proof, way, rules, carried) | _arrival_moments(followed, given, way)
    return replace(way, findings=(*said, *moments), moments=moments)


def _turning_law(
    motion: ArmMotion, ends: tuple[Reals, Reals], size: tuple[float, float], assumed: AssumedRates
) -> tuple[MotionLaw, tuple[found_in.CheckFinding, ...]]:
    """The law of a line or arc: that of its path or of its tool's turn, whichever takes longer.

    A turn whose speed the program does not give counts as a length; that is said where it decides.

    Parameters
    ----------
    ends : T_world_tool (4, 4) at the start and at the end
    size : m, of the path; rad, of the whole turn
    """
    length, turned = size
    if motion.speed is not None and motion.speed.unit == "s" and motion.speed.value > 0:
        return tool_law(motion, length, assumed), ()
    about = log_rotation(ends[0][:3, :3].T @ ends[1][:3, :3])
    laws: list[MotionLaw] = []
    words, open_parts = [], []
    for angle, limit in zip((float(np.hypot(about[1], about[2])), abs(float(about[0]))), motion.turning):
        if limit is None or not limit.speed.value > 0:
            open_parts.append(angle)
            words.append("" if limit is None else limit.speed.text)
        elif angle > NO_WAY:
            ramp = _given(limit.acceleration, "rad/s2") or assumed.tool_acceleration / TURN_LENGTH
            laws.append(law_of(angle, limit.speed.value, ramp))
    turn = turned if len(open_parts) == len(motion.turning) else math.hypot(*open_parts)
    turn_length, along = TURN_LENGTH, _given(motion.speed, "m/s")
    if motion.turn_speed is not None and along is not None:
        turn_length = along / motion.turn_speed
    size_m = max(length, turn_length * turn)
    laws += [tool_law(motion, size_m, assumed)] if size_m > 0 else []
    law = max(laws, key=lambda each: each.duration)
    if motion.turn_speed is not None or turn_length * turn <= length or law is not laws[-1]:
        return law, ()
    speed = (along or assumed.tool_speed) / TURN_LENGTH
    return law, (found_in.TurnSpeedNotGiven(math.degrees(speed), next(filter(None, words), "")),)


KRL_LINES = ("LIN", "SLIN", "CIRC", "SCIRC")
APART = math.radians(1.0)
SIDE_OPEN = 1e-5
"""rad from half a turn, within which a controller's rounding may take the turn the other way round."""


def _turns_otherwise(motion: ArmMotion, start: Reals, end: Reals) -> tuple[found_in.CheckFinding, ...]:
    """That a line of KRL may turn the tool on another way than about one axis, as it is checked.

    KRL has speeds of their own for the turn of the tool's x axis and for that about it, and no public text says on
    which way the tool turns if it does both.
    """
    if motion.form.removesuffix("_REL") not in KRL_LINES:
        return ()
    turn = start[:3, :3].T @ end[:3, :3]
    x = turn[:, 0]
    side = math.hypot(x[1], x[2])
    swing = np.array([0.0, -x[2], x[1]]) * (math.atan2(side, x[0]) / side if side > 0 else 0.0)
    about_x = log_rotation(exp_rotation(-swing) @ turn)
    shares = np.array([0.25, 0.5, 0.75])[:, None]
    apart = rotation_angle(
        exp_rotation(shares * log_rotation(turn)), exp_rotation(shares * swing) @ exp_rotation(shares * about_x)
    ).max()
    return (found_in.TurnsOtherwise(math.degrees(apart)),) if apart > APART else ()


def _arc(T_start: Reals, via: Reals, end: Reals, time: tuple[float, float | None], motion: ArmMotion) -> Arc:
    """An arc in a time (s) with a ramp; with an angle (rad) of its own that far along its circle."""
    made, angle = arc(T_start, via[:3, 3], end, time[0], None, time[1]), motion.angle
    if motion.with_path:
        rotation = _beside(T_start, via, end, made)[0]
        return ArcWithPath(T_start, rotation, made.duration, False, made.ramp, made.centre, made.normal, made.angle)
    if angle is None:
        return made
    return replace(made, normal=made.normal if angle > 0 else -made.normal, angle=abs(angle))


def _beside(T_start: Reals, via: Reals, end: Reals, made: Arc) -> tuple[Reals, bool]:
    return turn_beside_path(T_start, via, end, (made.centre, made.normal, made.angle))


def _followed_moments(
    followed: Followed, proof: ToolProof, way: MotionPath, rules: CheckRules, carried: bool
) -> dict[found_in.CheckFinding, float]:
    """Findings on reach, configuration, limits, singular poses and speeds, each with the time (s) of its start."""
    arm = way.arm
    found: dict[found_in.CheckFinding, float] = {
        found_in.StretchOutOfReach(way.along_mm(stretch.start), stretch.cause.reasons, carried): stretch.start
        for stretch in motion_faults.unreachable(arm, followed)
    }
    for jump in followed.jumps:
        amount, slides = joint_shown(arm, jump.joint - 1, jump.angle)
        found[found_in.ConfigurationEnds(way.along_mm(jump.t), jump.joint, amount, slides)] = jump.t
    ends = bool(found)
    t, kept = np.unique(np.concatenate([way.t, proof.t]), return_index=True)
    solved = np.concatenate([way.q, proof.q])[kept]
    outside = motion_faults.out_of_limits(arm, t, solved, way.joints)
    limits = {(type(each.cause), motion_faults.joints_of(each.cause)): each.cause for each in outside}
    begun = {(type(each.cause), motion_faults.joints_of(each.cause)): each.start for each in reversed(outside)}
    found |= {cause: begun[key] for key, cause in limits.items()}
    events = motion_faults.singular_events(arm, t, solved, way.joints, rules.near)
    at = np.unique(np.concatenate([t, [event.t for event in events]]))
    q, velocity, acceleration = followed.rates(at)
    bounded = not (np.isfinite(q[:, 0]) & np.isnan(velocity[:, 0])).any()
    for event in events:
        assert event.type != "dependent_axes"  # of arms whose lines are not followed here
        where = way.along_mm(event.t)
        if not event.crossing:
            scale = 1000.0 if event.type == "shoulder" else float(np.degrees(1.0))
            found[found_in.PassesSingularity(event.type, where, event.distance * scale)] = event.t
        elif not ends:
            found[found_in.MeetsSingularity(event.type, where, bounded)] = event.t
    if ends:  # towards the end of reach joint speeds grow without bound
        return found
    stretches: list[motion_faults.Interval[motion_faults.RateCause]] = []
    for limit in rules.limits.rates[:2]:
        values = velocity if limit.order == 1 else acceleration
        stretches += motion_faults.rates_exceeded(
            at,
            values,
            limit,
            lambda t, order=limit.order: followed.rates(t)[order],  # type: ignore[misc]
        )
    worst = {_of(each): each.cause for each in sorted(stretches, key=lambda stretch: stretch.cause.ratio)}
    first = {_of(each): each.start for each in sorted(stretches, key=lambda stretch: stretch.start, reverse=True)}
    found |= {_as_checked(worst[key]): first[key] for key in sorted(worst, key=lambda key: key[1])}
    return found | {part.cause: part.start for part in reversed(proof.undecided)}


def _of(stretch: motion_faults.Interval[motion_faults.RateCause]) -> tuple[type, int]:
    """The joint and the limit that an interval exceeds."""
    return type(stretch.cause), stretch.cause.joint


def _as_checked(cause: motion_faults.RateCause) -> found_in.CheckFinding:
    if isinstance(cause, motion_faults.TooFastIfAssumed):
        return found_in.FasterThanAssumed(cause.joint, cause.needed_deg_s, cause.limit_deg_s, cause.slides)
    if isinstance(cause, motion_faults.TooFast | motion_faults.AccelerationTooGreat):
        return cause
    assert isinstance(cause, motion_faults.AccelerationTooGreatIfAssumed)
    return found_in.AcceleratesMoreThanAssumed(cause.joint, cause.needed_deg_s2, cause.limit_deg_s2, cause.slides)


def _arrival_moments(followed: Followed, given: Reals | None, way: MotionPath) -> dict[found_in.CheckFinding, float]:
    """Joint turns at the singular start, and an end in other joints than the program gives; with times (s)."""
    found: dict[found_in.CheckFinding, float] = {}
    turn, last = followed.start_turn, followed.q[-1]
    joint = int(np.argmax(np.abs(turn)))
    if abs(turn[joint]) > SAME_ARRIVAL:
        found[found_in.TurnsAtStart(joint + 1, float(np.degrees(turn[joint])))] = 0.0
    if given is not None and np.isfinite(last).all() and np.abs(last - given).max() > SAME_ARRIVAL:
        joint = int(np.argmax(np.abs(last - given)))
        other = joint_shown(way.arm, joint, float(last[joint] - given[joint]))
        found[found_in.ArrivesOtherwise(joint + 1, *other)] = way.law.duration
    return found


def _points(length: float, turned: float) -> int:
    intervals = max(length / POINTS_APART_M, turned / POINTS_APART_RAD)
    return int(np.clip(np.ceil(intervals) + 1, MIN_POINTS, MAX_POINTS))


def _rate_moments(
    arm: Robot, law: MotionLaw, greatest: tuple[Reals, Reals], limits: JointLimits
) -> dict[found_in.CheckFinding, float]:
    """Rate findings of a joint move with maximum speeds and accelerations (n,), with the times (s) they begin."""
    found: dict[found_in.CheckFinding, float] = {}
    speed = greatest[0]
    for j in np.flatnonzero(speed > limits.speed * (1 + SPEED_TOLERANCE)).tolist():
        (needed, slides), (able, _) = (joint_shown(arm, j, float(rates[j])) for rates in (speed, limits.speed))
        made = motion_faults.TooFast if np.isfinite(arm.speed[j]) else found_in.FasterThanAssumed
        found[made(j + 1, needed, able, slides)] = speed_moment(law, float(limits.speed[j] / speed[j]))
    return found | dict.fromkeys(_acceleration_findings(arm, greatest[1], limits), 0.0)


def _acceleration_findings(arm: Robot, acceleration: Reals, limits: JointLimits) -> list[found_in.CheckFinding]:
    """The joint with the largest ratio to its acceleration limit, if it exceeds it."""
    ratio = acceleration / limits.acceleration
    worst = int(np.argmax(ratio))
    if ratio[worst] <= 1 + SPEED_TOLERANCE:
        return []
    (needed, slides), (able, _) = (
        joint_shown(arm, worst, float(rates[worst])) for rates in (acceleration, limits.acceleration)
    )
    assumed, known = found_in.AcceleratesMoreThanAssumed, motion_faults.AccelerationTooGreat
    return [(assumed if limits.acceleration_assumed else known)(worst + 1, needed, able, slides)]


def _configuration_moment(
    arm: Robot, law: MotionLaw, joints_at: Callable[[Reals], Reals]
) -> dict[found_in.CheckFinding, float]:
    """The configuration change of a joint move, if any, and the time (s) at which it leaves the first one."""
    if wrist_partition_missing(arm) is not None:
        return {}

    def slot(share: float) -> int | None:
        return _slot(arm, joints_at(np.array(share)))

    labels, first, last = branch_labels(arm), slot(0.0), slot(1.0)
    if first is None or last is None or first == last:
        return {}
    return {found_in.ConfigurationChanges(labels[first], labels[last]): change_moment(law, slot)}


def _joint_jumps(arm: Robot, start: Reals, end: Reals, moved: float, turned: float) -> list[found_in.CheckFinding]:
    found: list[found_in.CheckFinding] = []
    step = end - start
    turned_by = np.where(arm.slides, 0.0, np.abs(step))
    lead = int(np.argmax(turned_by))
    if turned_by[lead] > FAR_TURN and moved < NEAR_MOVE and turned < turned_by[lead] / 2:
        found.append(found_in.JointJumps(lead + 1, float(np.degrees(step[lead])), moved * 1000))
    for j in np.flatnonzero(turned_by > np.pi).tolist():
        nearer = float(wrap_to_pi(step[j]))
        if turned_by[j] - abs(nearer) > SPARED and arm.lower[j] <= start[j] + nearer <= arm.upper[j]:
            found.append(found_in.WholeTurn(j + 1, *np.degrees([step[j], nearer]).tolist()))
    return found


def _slot(arm: Robot, q: Reals) -> int | None:
    """Closed-form branch of joint angles (n,), rad; None at a singular pose, where two branches meet."""
    found = determinant_factors(arm, q)
    factors = np.array([found.shoulder, found.elbow, found.wrist])
    if np.abs(factors).min() < NO_WAY:
        return None
    back, down, flip = (bool(factor) for factor in (factors[0] > 0, factors[1] < 0, factors[2] < 0))
    return 4 * back + 2 * down + flip
