"""Solves and checks each motion of a program from where the one before left the arm; then all of them for collisions.

Between points of a way that are near to each other a body moves by no more than its points do. Two bodies that are d0
apart at one point and d1 at the next, and move by m in between, stay (d0 + d1 - 2 m) / 2 apart [1]_; parts of a way of
which that is not above 0 are halved, down to the tolerance.

References
----------
.. [1] F. Schwarzer, M. Saha, J.-C. Latombe, "Adaptive dynamic collision checking for single and multiple articulated
   robots in complex environments", IEEE Trans. Robotics 21, 2005.
"""

from __future__ import annotations

import pickle
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from er3a.by_value import ByValue
from er3a.collision.bodies import Bodies
from er3a.collision.scene import Scene
from er3a.collision.shapes import arm_shapes, surely_touch
from er3a.errors import PoseError
from er3a.finding import Amount, Finding, fact, is_one
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.chain import arm_length
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.numerics.arrays import Reals
from er3a.planning.motion_faults import limit_intervals
from er3a.planning.timing import standing
from er3a.program_check import program_check_findings as found_in
from er3a.program_check.motion_checks import (
    ASSUMED_JOINT_SHARE,
    ASSUMED_TOOL_SPEED,
    CheckRules,
    Moments,
    MotionPath,
    arrives_otherwise,
    begun,
    far_turns,
    is_given,
    joint_path,
    path_findings,
    tool_path,
)
from er3a.programs.execution import Execution
from er3a.programs.instructions import ArmMotion, JointTarget, NamedFrame, PoseTarget, Target, UnresolvedTarget, Zone
from er3a.programs.solving import rows_meant, solutions_meant
from er3a.robots.joint_limits import equivalents_within
from er3a.robots.robot import Robot

FLANGE = "tool0"
SAME_DIGITS = 6  # of joints in rad and m
MOST_TURNS = 2 * np.pi  # rad beyond a limit, after which no arm gets there
CHUNK = 4_000  # points whose bodies are placed at a time
MOST_TOUCHING = 200  # points of a motion at which depths are measured
HALVINGS = 5  # of the part of a way in which bodies touch first
CORNER_POINTS = 9
# A line goes to the nearest configuration, whatever its target states. A pose's other solutions turn axis 1, 4 or 6 by
# half a turn or more, so within this of the stated quarter it is the stated solution.
QUARTER = np.pi / 2


@dataclass(eq=False)
class CheckedMotion(ByValue):
    """A motion from one start.

    Attributes
    ----------
    arm : the robot with the motion's tool
    base : T_world_base of the targets (4, 4); None where it is not known
    start, end : (n,), rad or m; None where not known
    path : None where there is none: the arm stays (``stays``), or the way is not known
    findings : with the time (s) of the motion at which each begins; None of those about it as a whole
    clearance : m, smallest on the way, negative by an overlap; None where not measured
    guessed : whether its start was taken among several solutions of an earlier target, so that nothing is certain
    """

    motion: ArmMotion
    arm: Robot
    base: Reals | None
    start: Reals | None
    end: Reals | None = None
    path: MotionPath | None = None
    stays: bool = False
    findings: dict[Finding, float | None] = field(default_factory=dict)
    clearance: float | None = None
    guessed: bool = False

    def add(self, *findings: Finding) -> None:
        """Add findings about the motion as a whole.

        Parameters
        ----------
        findings : each is kept once, without a moment of the motion
        """
        for each in findings:
            self.findings.setdefault(each, None)

    def add_on_way(self, found: Moments) -> None:
        """Add findings that begin somewhere on the way.

        Parameters
        ----------
        found : findings with the time (s) of the motion at which each begins
        """
        for each, moment in found.items():
            self.findings.setdefault(each, moment)


class Judge:
    """Solves motions, each once from one start: what it solves is a :class:`er3a.programs.execution.Moved`."""

    def __init__(self, robot: Robot, rules: CheckRules):
        self.robot, self.rules = robot, rules
        self.motions: dict[Hashable, CheckedMotion] = {}
        self._arms: dict[bytes, Robot] = {robot.tool.tobytes(): robot}
        self._guessed: set[bytes] = set()  # joints at which the arm stands if what was guessed is right

    def __call__(self, motion: ArmMotion, before: Reals | None) -> CheckedMotion:
        """A motion from joints (n,), None where they are not known."""
        key = pickle.dumps(motion), _rounded(before)  # equal bytes are equal motions; hashes of arrays are crude
        if key not in self.motions:
            self.motions[key] = checked = self._checked(motion, before)
            checked.guessed = before is not None and _rounded(before) in self._guessed
            chosen = motion.kind != "joint" or isinstance(motion.target, PoseTarget)
            followed = motion.kind != "joint" and before is not None  # ends where its way leads
            guesses = ("configuration_guessed",) if followed else ("configuration_guessed", "configuration_not_met")
            first = any(each.code in guesses for each in checked.findings)
            if checked.end is not None and (first or (checked.guessed and chosen)):
                self._guessed.add(_rounded(checked.end))
        return self.motions[key]

    def _arm(self, tool: NamedFrame) -> Robot | None:
        """The robot with a tool; None where the tool is not known."""
        if tool.pose is None and tool.name and tool.name != FLANGE:
            return None
        pose = np.eye(4) if tool.name == FLANGE else self.robot.tool
        pose = pose if tool.pose is None else tool.pose
        key = pose.tobytes()
        if key not in self._arms:
            self._arms[key] = self.robot.replace(tool=pose)
        return self._arms[key]

    def _checked(self, motion: ArmMotion, before: Reals | None) -> CheckedMotion:
        arm, base = self._arm(motion.tool), motion.base.pose
        if base is None and not motion.base.name:
            base = np.eye(4)
        outer = ", ".join(
            {name: None for each in (motion.target, motion.via) for name, _ in getattr(each, "external", ())}
        )
        placed = None if base is None or outer else self.robot.base @ base  # such axes may carry arm or workpiece
        checked = CheckedMotion(motion, arm or self.robot, placed, before)
        target, of_tool = motion.target, motion.kind != "joint"
        if isinstance(target, UnresolvedTarget):
            by_tool = target.reason == "position_unknown" and arm is None
            text, reason = (motion.tool.name, "tool") if by_tool else (target.text, target.reason)
            checked.add(fact("not_followed", text=text, reason=reason))
            return checked
        if outer:
            checked.add(fact("not_followed", text=outer, reason="external_axes"))
        if motion.not_followed:
            checked.add(fact("not_followed", text=motion.not_followed, reason="setting"))
        if arm is None and (of_tool or isinstance(target, PoseTarget)):
            checked.add(fact("not_followed", text=motion.tool.name, reason="tool"))
        elif placed is None and isinstance(target, PoseTarget):
            if not outer:
                checked.add(fact("not_followed", text=motion.base.name, reason="base"))
        elif of_tool:
            self._along_tool_path(checked, target)
        else:
            self._to_joints(checked, target)
        if checked.path is not None and not is_given(motion):
            word = "" if motion.speed is None else motion.speed.text
            speed = Amount(ASSUMED_TOOL_SPEED, "m/s") if of_tool else Amount(100 * ASSUMED_JOINT_SHARE, "%")
            refused = motion.speed is not None and motion.speed.refused is not None
            checked.add(fact("speed_not_given", assumed=speed, word=word, refused=refused))
        return checked

    def _to_joints(self, checked: CheckedMotion, target: JointTarget | PoseTarget) -> None:
        """A joint move."""
        goal = self._goal(checked, target)
        if goal is None:
            return
        if checked.start is None:
            limits = limit_intervals(checked.arm, standing(goal, 0.0))
            checked.add(fact("way_not_known"), *begun(limits))
            checked.end = goal
            return
        checked.path = joint_path(checked.arm, checked.motion, checked.start, goal, self.rules)
        checked.stays = checked.path is None
        beyond = np.maximum(goal - checked.arm.upper, checked.arm.lower - goal).max()
        checked.end = goal if beyond < MOST_TURNS else None
        if checked.path is not None:
            checked.add_on_way(path_findings(checked.path, self.rules, None))
            if isinstance(target, JointTarget) or target.branch is None:  # no configuration that is meant
                checked.add_on_way(dict.fromkeys(far_turns(checked.path), 0.0))

    def _along_tool_path(self, checked: CheckedMotion, target: JointTarget | PoseTarget) -> None:
        """A line or an arc."""
        motion, arm = checked.motion, checked.arm
        given = target.joints if isinstance(target, JointTarget) else None
        if given is not None and np.isnan(given).any():
            checked.add(fact("not_followed", text=motion.form, reason="position_unknown"))
            return
        if given is not None:
            end = forward(arm, given)
        else:
            assert isinstance(target, PoseTarget)
            assert checked.base is not None
            end = checked.base @ target.pose
        if checked.start is None:
            checked.add(fact("way_not_known"))
            checked.end = given if given is not None else self._goal(checked, target)
            return
        via = self._via(checked) if motion.kind == "arc" else None
        if motion.kind == "arc" and via is None:
            text = getattr(motion.via, "text", motion.form)
            checked.add(fact("not_followed", text=text, reason=getattr(motion.via, "reason", "undefined")))
            return
        found = tool_path(arm, motion, checked.start, end, via)
        if not isinstance(found, MotionPath):
            checked.stays = found is None
            checked.end = checked.start if found is None else None
            checked.add(*(() if found is None else (found,)))
            return
        checked.path, checked.end = found, found.end
        checked.add_on_way(path_findings(found, self.rules, end))
        if given is not None and (other := arrives_otherwise(found, given)) is not None:
            checked.add(other)
        branch = target.branch if isinstance(target, PoseTarget) else None
        ends = None if branch is None or found.end is None else solutions_meant(branch, arm, found.end[None], QUARTER)
        if ends is not None and not ends[0]:
            checked.add(fact("configuration_not_met", text=_configuration(target)))

    def _via(self, checked: CheckedMotion) -> Reals | None:
        """The arc's point: T_world_tool (4, 4), m."""
        via = checked.motion.via
        if isinstance(via, PoseTarget) and checked.base is not None:
            return checked.base @ via.pose
        if isinstance(via, JointTarget) and not np.isnan(via.joints).any():
            return forward(checked.arm, via.joints)
        return None

    def _goal(self, checked: CheckedMotion, target: JointTarget | PoseTarget) -> Reals | None:
        """Joints (n,) of a target, of several solutions the nearest within the limits; None where unknown."""
        before = checked.start
        if isinstance(target, JointTarget):
            open_ = np.isnan(target.joints)
            if before is None and open_.any():
                if not open_.all():
                    checked.add(fact("not_followed", text=checked.motion.form, reason="position_unknown"))
                return None
            return target.joints if before is None else np.where(open_, before, target.joints)
        assert checked.base is not None
        pose = checked.base @ target.pose
        near = before if target.near is None else target.near
        reference = np.zeros(checked.arm.joints) if near is None else near
        try:
            found = inverse_batch(checked.arm, pose[None], reference)
        except PoseError:
            checked.add(fact("not_followed", text=checked.motion.form, reason="too_far"))
            return None
        rows = found.q[0][found.solved[0]]
        if not len(rows):
            checked.add(fact("target_out_of_reach", reasons=inverse(checked.arm, pose, reference).unsolved))
            return None
        rows, _ = equivalents_within(checked.arm, rows, reference)
        if (checked.motion.kind == "joint" or before is None) and target.branch is not None:
            rows, met = rows_meant(target.branch, checked.arm, pose, rows)
            if not met:  # the stated solution all the same, if there is one
                rows, met = rows_meant(target.branch, checked.arm, pose, rows, QUARTER)
                met = met and checked.motion.kind != "joint"
            if not met:
                checked.add(fact("configuration_not_met", text=_configuration(target)))
        away = np.abs(rows - reference).max(axis=1)
        said = checked.motion.kind == "joint" and target.branch is None and bool(target.configuration)
        if (near is None or said) and (different := len(np.unique(np.round(rows, SAME_DIGITS), axis=0))) > 1:
            checked.add(fact("configuration_guessed", solutions=different))
            if near is None:  # the one farthest from the limits
                away = -np.minimum(rows - checked.arm.lower, checked.arm.upper - rows).min(axis=1)
        return np.asarray(rows[int(away.argmin())], np.float64)


def _rounded(joints: Reals | None) -> bytes:
    return b"" if joints is None else (np.round(joints, SAME_DIGITS) + 0.0).tobytes()


def _configuration(target: Target) -> str:
    given = target.configuration if isinstance(target, PoseTarget) else ()
    return ", ".join(f"{key} {value:g}" if isinstance(value, float) else f"{key} {value}" for key, value in given)


class Obstacles:
    """The bodies that an arm must not touch, itself among it.

    What is carried hangs at the flange, where the robot's own tool puts it, or if it has none the one of ``motions``,
    the first of them that is no bare flange: it stays there whatever tool a motion names.

    Parameters
    ----------
    tolerance : m, of an overlap that may go unnoticed
    assumed_margin : m, within which of the arm's shapes nothing is settled, unless a document gives them
    """

    def __init__(
        self,
        robot: Robot,
        scene: Scene | None,
        motions: Mapping[int, CheckedMotion],
        tolerance: float,
        assumed_margin: float,
    ):
        self.motions = motions
        bare = np.array_equal(robot.tool, np.eye(4))
        tools = [each.motion.tool.pose for each in motions.values() if each.motion.tool.pose is not None]
        carrier = next((each for each in tools if bare and not np.array_equal(each, np.eye(4))), robot.tool)
        self.robot = robot if scene is None or not scene.carried else robot.replace(tool=carrier)
        self.scene, self.bodies, self.tolerance = scene, Bodies(self.robot, scene), tolerance
        self.assumed_margin = assumed_margin if arm_shapes(robot).assumed else 0.0

    def check(self, execution: Execution, keep_on: Callable[[], bool]) -> None:
        """Measure the clearance of motions and corners, and find what touches; both are added to the motions.

        Parameters
        ----------
        execution : that the motions are of; those without a way are passed over
        keep_on : asked before each round; once it is False, motions with open parts get :class:`ClearanceNotProven`

        Notes
        -----
        Parts of a way are halved until the bound of [1]_ shows them clear or touching, or bodies move by less than the
        tolerance.
        """
        once = {id(each): each for each in self.motions.values()}.values()
        paths = [(each, each.path) for each in once if each.path is not None and len(each.path.q)]
        if paths and self.bodies.pairs:
            self._measure(paths, keep_on)
        for one, other in self._corners(execution):
            self._corner(one, other)

    def _measure(self, paths: list[tuple[CheckedMotion, MotionPath]], keep_on: Callable[[], bool]) -> None:
        q = np.concatenate([path.q for _, path in paths])
        share = np.concatenate([path.share for _, path in paths])
        owner = np.repeat(np.arange(len(paths)), [len(path.q) for _, path in paths])
        d, pair = self.bodies.min_distance(q)
        parts = np.flatnonzero(owner[:-1] == owner[1:])
        i, j = parts, parts + 1
        while len(i):
            # Clear between two points if their distances together exceed twice the motion [1]_; touching if both touch.
            moved = self._moved(q[i], q[j])
            apart, touching = d[i] + d[j] - 2 * moved, np.maximum(d[i], d[j]) < 0
            open_ = (apart <= 0) & ~touching & (moved > self.tolerance)
            i, j = i[open_], j[open_]
            if not len(i):
                break
            if not keep_on():
                for number in np.unique(owner[i]).tolist():
                    paths[number][0].add(fact("clearance_not_proven"))
                break
            middle = np.arange(len(i)) + len(q)
            more = (q[i] + q[j]) / 2
            found, which = self.bodies.min_distance(more)
            q, share = np.concatenate([q, more]), np.concatenate([share, (share[i] + share[j]) / 2])
            owner, d, pair = (
                np.concatenate([owner, owner[i]]),
                np.concatenate([d, found]),
                np.concatenate([pair, which]),
            )
            i, j = np.concatenate([i, middle]), np.concatenate([middle, j])
        order = np.lexsort((share, owner))
        starts = np.searchsorted(owner[order], np.arange(len(paths) + 1))
        for number, (checked, _) in enumerate(paths):
            rows = order[starts[number] : starts[number + 1]]
            self._judge(checked, share[rows], d[rows], pair[rows])

    def _moved(self, q: Reals, r: Reals) -> Reals:
        """By how much a body moves at most on straight ways in joint space between joints (k, n), m."""
        bulge = arm_length(self.robot) * np.abs(r - q).sum(axis=1) ** 2 / 8
        parts = [slice(k, k + CHUNK) for k in range(0, len(q), CHUNK)]
        chords = [
            np.linalg.norm(self.bodies.ends(r[part]) - self.bodies.ends(q[part]), axis=-1).max(axis=(1, 2), initial=0.0)
            for part in parts
        ]
        found: Reals = np.concatenate(chords) + bulge
        return found

    def _judge(self, checked: CheckedMotion, share: Reals, d: Reals, pair: NDArray[np.int64]) -> None:
        """What is found at the points of one motion, in the order of time."""
        assert checked.path is not None
        nearest = int(np.argmin(d))
        checked.clearance = float(d[nearest])
        if d[nearest] < 0:
            checked.add_on_way(self._touching(checked.path, share, np.flatnonzero(d < 0)))
        elif d[nearest] < self.assumed_margin:
            near = fact(
                "clear_of_assumed",
                pair=self.bodies.pairs[int(pair[nearest])],
                clearance_mm=1000 * checked.clearance,
                margin_mm=1000 * self.assumed_margin,
            )
            checked.add_on_way({near: float(checked.path.law.times(share[nearest]))})

    def _touching(self, path: MotionPath, share: Reals, rows: NDArray[np.intp]) -> Moments:
        """What touches at points of a way, of which ``rows`` do: from the first contact to the last, evenly."""
        clear, first = share[max(int(rows[0]) - 1, 0)], share[int(rows[0])]
        for _ in range(HALVINGS):
            middle = (clear + first) / 2
            touches_there = self.bodies.min_distance(path.at(np.array([middle])))[0][0] < 0
            clear, first = (clear, middle) if touches_there else (middle, first)
        every = np.arange(len(self.bodies.pairs))
        shares = np.linspace(first, share[int(rows[-1])], MOST_TOUCHING)
        depths = np.array([-1000 * self.bodies.distances(joints, every) for joints in path.at(shares)])
        touches = []
        for i, k in sorted((int(np.argmax(depths[:, k] > 0)), k) for k in every.tolist() if (depths[:, k] > 0).any()):
            name, at = self.bodies.pairs[k], float(shares[i])
            touch = fact(
                "bodies_touch",
                depth_mm=float(depths[:, k].max()),
                pair=name,
                t_s=float(path.law.times(np.array(at))),
                at_mm=path.along_mm(at) if path.of_tool else None,
                certain=surely_touch(self.robot, name, float(depths[:, k].max()) / 1000, self.assumed_margin),
                at_target=bool(depths[-1, k] > 0 and shares[-1] > 1 - 1e-9),
                place_m=tuple(self.bodies.surface_points(path.at(np.array(at)), k).mean(axis=0).tolist()),
            )
            touches.append(touch)
        if not touches:
            return {}
        given = any(is_one(each.pair, "carried_and_solid") for each in touches)  # by the scene, not the arm
        assumed = arm_shapes(self.robot).assumed and not given
        hit = fact("motion_collides", touches=(), assumed=assumed)
        return {found_in.with_touches_of(hit, [hit.but(touches=tuple(touches))]): float(path.law.times(first))}

    def _corners(self, execution: Execution) -> Iterator[tuple[CheckedMotion, CheckedMotion]]:
        """Motions that follow each other, each pair once."""
        joins: dict[int, list[int]] = defaultdict(list)  # by step, the last ones of ways that go on with it
        for ending in execution.endings:
            if ending.repeats_from is not None:
                joins[ending.repeats_from].append(ending.step)
        last: dict[int, set[int]] = {-1: set()}  # by step, the motions that may be the last up to it
        pairs: dict[tuple[int, int], tuple[CheckedMotion, CheckedMotion]] = {}
        for _ in range(2):  # the second time with what joins from further on
            for number, step in enumerate(execution.steps):
                before = set().union(*(last.get(each, ()) for each in (step.before, *joins[number])))
                if number not in self.motions:
                    last[number] = before
                    continue
                last[number], other = {number}, self.motions[number]
                pairs |= {(id(one), id(other)): (one, other) for one in map(self.motions.__getitem__, sorted(before))}
        yield from pairs.values()

    def _corner(self, one: CheckedMotion, other: CheckedMotion) -> None:
        """Find what the corner between two motions touches that a zone rounds; what is found is added to the first.

        Parameters
        ----------
        one, other : motions that follow each other; the zone is that of the first

        Notes
        -----
        The corner is looked at on the chord between the ends of the zone, and on the parabola with the target as its
        control point. Both are only looked at where the motions themselves are clear.
        """
        zone, before, after = one.motion.zone, one.path, other.path
        if zone.kind == "fine" or before is None or after is None or before.ahead is not None:
            return
        shares = [zone_share(zone, path) for path in (before, after)]
        if zone.kind == "distance" and max(shares) > 0.5 + 1e-9:
            one.add(
                fact("zone_too_large", zone_mm=zone.value * 1000, motion_mm=min(before.length, after.length) * 1000)
            )
        if not self.bodies.pairs or min(one.clearance or 0.0, other.clearance or 0.0) <= 0:
            return
        begins, corner = before.at(np.array([1 - min(shares[0], 0.5)]))[0], before.q[-1]
        ends = after.at(np.array([min(shares[1], 0.5)]))[0]
        # How a controller rounds a corner is not known: looked at are the shortest way and a parabola within the zone.
        s = np.linspace(0, 1, CORNER_POINTS)[:, None]
        chord = begins + s * (ends - begins)
        rounded = (1 - s) ** 2 * begins + 2 * s * (1 - s) * corner + s**2 * ends
        d, pair = self.bodies.min_distance(np.concatenate([chord, rounded]))
        worst = int(np.argmin(d))
        if d[worst] < -self.tolerance:
            name = self.bodies.pairs[int(pair[worst])]
            one.add(
                fact(
                    "zone_collides", pair=name, depth_mm=-1000 * float(d[worst]), assumed=arm_shapes(self.robot).assumed
                )
            )


def zone_share(zone: Zone, path: MotionPath) -> float:
    """The share of a motion's way that its zone may take.

    Parameters
    ----------
    zone : by a distance in m, a turn in rad, or a share

    Returns
    -------
    share : over one half for a distance that is larger than half of the way; one half where the size is not known
    """
    match zone.kind:
        case "distance" if path.length > 1e-9:
            return zone.value / path.length
        case "angle" if path.turned > 1e-9:
            return min(zone.value / path.turned, 0.5)
        case "share":
            return min(zone.value, 1.0) / 2
    return 0.5
