"""A path of the path file as a motion of one robot: joints, rates and tool pose at any time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import scipy

from er3a.by_value import by_identity
from er3a.collision.along import RateBounds
from er3a.collision.bodies import Bodies
from er3a.collision.shapes import arm_shapes
from er3a.errors import InputError, NotWristPartitionedError, PoseError
from er3a.files.path_file import PathEntry, ProgramPath, load_paths
from er3a.files.units import joint_values
from er3a.finding import Finding
from er3a.kinematics.by_class import arm_solver
from er3a.kinematics.forward import forward, jacobian
from er3a.kinematics.inverse import inverse
from er3a.kinematics.singularity import USUAL_NEAR, NearSingular
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.scope import GAPS, Open
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.study import Study
from er3a.planning.class_follow import PathEndsError, follow_by_class
from er3a.planning.commands import Built, Command, CommandSource, PlanCommand, build
from er3a.planning.follow import Followed
from er3a.planning.names import PathVerdict
from er3a.planning.piecewise import PiecewiseMotion
from er3a.planning.sequences import TURN_LENGTH, JointSequence, SegmentPath
from er3a.planning.stated_rates import StatedMotion
from er3a.planning.timing import JointLimits, joint_limits, standing, straight
from er3a.planning.tool_curve import follow_as_curve
from er3a.planning.way_around import PlanningTask, WayAround, way_between
from er3a.program_check.check_program import CheckOptions, LocatedFinding, ProgramPart, check_program, parts_of
from er3a.programs.languages import read_program
from er3a.robots.joint_limits import meant, shown
from er3a.robots.robot import Robot


@by_identity
class PartOfProgram:
    """A stretch of a program (``file``) as an entry of a path file; ``rest``: lines that no stretch holds."""

    name: str
    title: str
    samples: int
    expected: tuple[PathVerdict, ...]
    part: ProgramPart
    rest: tuple[int, ...]
    file: Path

    @property
    def kind(self) -> Literal["joint_sequence", "sequence"]:
        """What kind of path it is."""
        return self.part.kind

    def command(self, source: CommandSource, robot: Robot) -> Command:
        """The stretch of the program as a path's command, in SI units.

        Parameters
        ----------
        source : what errors about the path name as its place
        robot : not needed here, unlike for paths of a path file
        """
        return self.part.command(source)


PlannedEntry = PathEntry | PartOfProgram


@by_identity
class MotionTask(PlanningTask):
    """What motions of an arm are planned and judged by, for all stages and programs.

    Attributes
    ----------
    bodies : that must not meet; tolerance : m, the overlap that may go unnoticed
    near : distances below which a pass counts as near-singular
    """

    near: NearSingular = USUAL_NEAR


def planned_entries(task: MotionTask, entry: PathEntry | ProgramPath, source: CommandSource) -> Iterator[PlannedEntry]:
    """A path as it is, a program as its stretches, named by their numbers.

    Raises
    ------
    InputError
        for a program that can't be read or does not move the arm
    """
    if not isinstance(entry, ProgramPath):
        yield entry
        return
    start = None if entry.start_deg is None else joint_values(task.robot, entry.start_deg, "start_deg")
    options = CheckOptions(
        start=start,
        scene=task.bodies.scene,
        near=task.near,
        joint_limits=task.limits,
        penetration_tolerance=task.tolerance,
    )
    check = check_program(read_program(entry.program), task.robot, options)
    parts, rest = parts_of(check, task.robot, source)
    for number, part in enumerate(parts, 1):
        name = f"{entry.name}_{number}" if len(parts) > 1 else entry.name
        first, last = part.lines
        title = f"{entry.title}, lines {first} to {last}" if last > first else f"{entry.title}, line {first}"
        yield PartOfProgram(name, title, entry.samples, entry.expected, part, rest, Path(entry.program))


ROUNDED = 0.0005  # m, by which a pose may be off that is written with one decimal of mm and two of deg
FOLLOWED_AT = 1030  # times at which a path of the tool is solved at least: its branches depend on no samples
EQUAL_TIMES = 1e-12  # share of the duration
MISSED = 1.0  # mm, from which a corner that passes beside its point is said to miss it
MISSED_DEG = 0.1  # likewise of joints: about as much at half a metre


def corner_misses(robot: Robot, built: Built) -> tuple[float, float]:
    """By how much rounded corners miss their points at most.

    Returns
    -------
    far : mm, of the tool; of a move of the joints, of the joint that slides most
    turned : deg, of the tool; of a move of the joints, of the joint that turns most. Both 0 without rounded corners.
    """
    if isinstance(built.tool, SegmentPath):
        return float(1000 * built.tool.misses[0]), float(np.degrees(built.tool.misses[1]))
    if not isinstance(built.joints, JointSequence):
        return 0.0, 0.0
    of_joints = shown(robot, built.joints.misses)
    far, turned = (float(of_joints[kind].max(initial=0.0)) for kind in (robot.slides, ~robot.slides))
    return far, turned


def missed_points(robot: Robot, built: Built) -> str:
    """By how much rounded corners miss their points, in words.

    Returns
    -------
    text : with units; empty below ``MISSED`` (mm) and ``MISSED_DEG``

    Notes
    -----
    A turn of the tool counts as in :data:`er3a.planning.sequences.TURN_LENGTH`.
    """
    far, turned = corner_misses(robot, built)
    least = MISSED_DEG if built.tool is None else float(np.degrees(MISSED / 1000 / TURN_LENGTH))
    parts = (f"{far:.3g} mm" if far > MISSED else "", f"{turned:.3g} deg" if turned > least else "")
    return ", ".join(filter(None, parts))


def rows_missed(robot: Robot, built: Built) -> str:
    """By how much a motion misses rows of its table, whose corners nobody asked to be rounded.

    Returns
    -------
    text : as of :func:`missed_points`; empty for other motions
    """
    return missed_points(robot, built) if built.unasked else ""


def misfits(robot: Robot, built: Built) -> tuple[str, ...]:
    """Rates of a trajectory that its points contradict.

    Returns
    -------
    texts : joint, time in s, the stated rate and the other one with unit; none of motions without stated rates
    """
    found = built.joints.misfits if isinstance(built.joints, StatedMotion) else ()
    named = []
    for each in found:
        scale, unit = (1000.0, "mm") if robot.slides[each.joint] else (float(np.degrees(1.0)), "deg")
        rates = f"{scale * each.stated:.3g} / {scale * each.other:.3g} {unit}/s{'²' * (each.order == 2)}"
        named.append(f"J{each.joint + 1} {each.t:g} s {rates}")
    return tuple(named)


@by_identity
class Motion:
    """A path, ready to be checked.

    Attributes
    ----------
    built : what the entry was made into
    samples, checks : times in s of the path's own points, and with the points checked between them
    t, q : (N,) s and (N, 6) rad, the checks and where a path of the tool was solved besides; q NaN where unreachable
    joints : angles (..., 6) at times (...,)
    rates : angles, velocities and accelerations, each (n, 6), at times (n,)
    tool : T_base_tool (n, 4, 4) that the path asks for at times (n,)
    way : length of the tool point's way (n,) in m at times (n,)
    followed : how a path of the tool is followed; None for one in joint space
    curve : the motion as polynomials, from which a path of the tool may have gaps
    not_planned : why nothing was planned where a motion was to be; the motion is then the straight joint move
    """

    entry: PlannedEntry
    built: Built
    samples: Reals
    checks: Reals
    t: Reals
    q: Reals
    joints: Callable[[Reals], Reals]
    rates: Callable[[Reals], tuple[Reals, Reals, Reals]]
    tool: Callable[[Reals], Reals]
    way: Callable[[Reals], Reals]
    followed: Followed | None
    curve: PiecewiseMotion
    not_planned: Finding | None = None

    @property
    def rate_bounds(self) -> RateBounds:
        """Bounds of speeds and accelerations between times, as :func:`er3a.collision.along.clearance_along` takes."""
        return self.curve.rate_bounds


def motion_of(
    robot: Robot,
    entry: PlannedEntry,
    checks_per_sample: int,
    source: CommandSource,
    ends: Mapping[str, Reals],
    *,
    task: PlanningTask | None = None,
) -> Motion:
    """Plan a path, and follow it if it is one of the tool; ``ends`` as for :func:`er3a.planning.commands.build`.

    ``task`` is for motions to be planned.

    Raises
    ------
    InputError
        for what :func:`er3a.planning.commands.build` refuses, and a start branch that has no solution at the start
    NotWristPartitionedError, PathEndsError
        for a path of the tool that an arm without branches can't be made to follow
    """
    command = entry.command(source, robot)
    if isinstance(command, PlanCommand) and task is not None:
        return _planned(task, entry, command, checks_per_sample)
    built = build(robot, command, ends)
    samples, checks = _times(entry, built.duration, checks_per_sample)
    if built.joints is not None:
        return _joint_motion(robot, entry, built, built.joints.polynomials(), samples, checks)
    path = built.tool
    if path is None:
        raise ValueError(f"{entry.name}: neither a move of the joints nor a path of the tool")
    if not has_branches(robot):
        return _joint_motion(robot, entry, built, follow_by_class(robot, path, built.q_start), samples, checks)
    try:
        even = np.linspace(0.0, built.duration, FOLLOWED_AT)
        followed, curve = follow_as_curve(robot, path, even, built.q_start, built.start_slot)
    except PoseError:
        branch = getattr(entry, "start_branch", None)
        problem = f"'{branch}' has no solution at the start pose"
        raise source.error("start_branch", problem, "Choose another branch, or leave it out") from None
    kept = _apart(followed.t, checks, EQUAL_TIMES * built.duration)
    t = np.concatenate([checks, followed.t[kept]])
    q = np.concatenate([followed.joints(checks), followed.q[kept]])
    order = np.argsort(t)
    return Motion(
        entry=entry,
        built=built,
        samples=samples,
        checks=checks,
        t=t[order],
        q=q[order],
        joints=followed.joints,
        rates=followed.rates,
        tool=lambda t: path.poses(path.progress(t)[0]),
        way=lambda t: path.arc_length(path.progress(t)[0]),
        followed=followed,
        curve=curve,
    )


def _apart(times: Reals, others: Reals, tolerance: float) -> Flags:
    """Which of times (n,) have none of the others (k,), rising, as near as this."""
    right = np.clip(np.searchsorted(others, times), 1, len(others) - 1)
    apart: Flags = np.minimum(np.abs(times - others[right - 1]), np.abs(others[right] - times)) > tolerance
    return apart


def _planned(task: PlanningTask, entry: PlannedEntry, command: PlanCommand, checks_per_sample: int) -> Motion:
    """A planned motion; where none is found the straight joint move, with the reason."""
    robot = task.robot
    starts, ends = (joints_at(robot, end) for end in (command.start, command.end))
    found = way_between(task, starts, ends)
    if isinstance(found, WayAround):
        curve, reason = found.motion, None
    elif len(starts) and len(ends):
        curve, reason = straight(starts[0], ends[0], task.limits), found
    else:
        curve, reason = standing(np.clip(np.zeros(len(robot.lower)), robot.lower, robot.upper), 1.0), found
    motion = _joint_motion(robot, entry, Built(), curve, *_times(entry, curve.duration, checks_per_sample))
    return replace(motion, not_planned=reason)


def joints_at(robot: Robot, end: Reals) -> Reals:
    """Joint vectors within the limits at an end of a motion.

    Parameters
    ----------
    end : joints (n,), rad or m, or a pose T_base_tool (4, 4), m

    Returns
    -------
    q : (k, n); joints as they are given, or all solutions that reach the pose
    """
    if end.ndim == 1:
        return end[None]
    solved = inverse(robot, end, self_motion_rows=True)
    return solved.q[solved.within_limits]


def _times(entry: PlannedEntry, duration: float, checks_per_sample: int) -> tuple[Reals, Reals]:
    """Samples, and the points checked."""
    samples = np.linspace(0.0, duration, entry.samples)
    checks = np.linspace(0.0, duration, (entry.samples - 1) * (checks_per_sample + 1) + 1)
    checks[:: checks_per_sample + 1] = samples
    return samples, checks


def _joint_motion(
    robot: Robot, entry: PlannedEntry, built: Built, curve: PiecewiseMotion, samples: Reals, checks: Reals
) -> Motion:
    q, velocity, _ = curve.rates(checks)
    speed = np.linalg.norm(np.einsum("nij,nj->ni", jacobian(robot, q)[:, :3], velocity), axis=1)
    way = scipy.interpolate.CubicHermiteSpline(
        checks, scipy.integrate.cumulative_simpson(speed, x=checks, initial=0.0), speed
    )
    return Motion(
        entry=entry,
        built=built,
        samples=samples,
        checks=checks,
        t=checks,
        q=q,
        joints=curve.joints,
        rates=curve.rates,
        tool=lambda t: forward(robot, curve.joints(t)),
        way=way,
        followed=None,
        curve=curve,
    )


def near_singular(settings: TrajectorySettings) -> NearSingular:
    """Where a pose counts as near-singular, for all stages and the teach panel.

    Parameters
    ----------
    settings : deg and mm

    Returns
    -------
    near : rad and m
    """
    wrist, elbow = np.radians([settings.near_wrist_deg, settings.near_elbow_deg])
    return NearSingular(float(wrist), float(elbow), settings.near_shoulder_mm / 1000)


def planning_of(robot: Robot, settings: TrajectorySettings, bodies: Bodies, seed: int = 0) -> MotionTask:
    """How motions are planned and judged.

    Parameters
    ----------
    bodies : what they must not meet
    seed : of the planner's random numbers

    Returns
    -------
    task : tolerance in m, limits in rad and m
    """
    tolerance = settings.penetration_tolerance_mm / 1000
    return MotionTask(robot, bodies, tolerance, limits_of(robot, settings), seed, near=near_singular(settings))


def task_of(study: Study, name: str) -> MotionTask:
    """How motions of a robot of the study are planned and judged, in the scene of its trajectory stage.

    Parameters
    ----------
    name : of a robot
    """
    robot = study.robot(name)
    bodies = Bodies(robot, study.scene(name, "trajectory"))
    return planning_of(robot, study.section(TrajectorySettings), bodies, study.seed)


def margin_of(task: MotionTask, assumed_margin: float) -> float:
    """The margin (m) at which a motion that meets something may end; ``assumed_margin``: m, around assumed shapes."""
    return (assumed_margin if arm_shapes(task.robot).assumed else task.tolerance) + ROUNDED


def assumed_speeds(robot: Robot, settings: TrajectorySettings) -> Reals:
    """Speeds of joints whose own is unknown, as the study assumes them.

    Parameters
    ----------
    settings : deg/s for each joint, and mm/s; joints beyond the list have its last value

    Returns
    -------
    speeds : (n,), rad/s, or m/s of joints that slide
    """
    given = settings.assumed_speed_deg_s
    turning = np.radians([given[min(k, len(given) - 1)] for k in range(robot.joints)])
    return np.where(robot.slides, settings.assumed_speed_mm_s / 1000, turning)


def limits_of(robot: Robot, settings: TrajectorySettings) -> JointLimits:
    """Limits of a robot's joints.

    Raises
    ------
    InputError
        for accelerations or jerks of another number of joints
    """
    count = len(robot.lower)
    given: list[Reals | None] = []
    for name in ("acceleration_deg_s2", "jerk_deg_s3"):
        values = getattr(settings, name)
        if values is not None and len(values) != count:
            problem = f"{len(values)} values for the {count} joints of {robot.name}"
            raise InputError(None, f"trajectory.{name}", problem, "Give one for each joint")
        given.append(None if values is None else meant(robot, np.array(values)))
    return joint_limits(robot, assumed_speeds(robot, settings), settings.acceleration_time_s, *given)


@by_identity
class ListedMotion:
    """A motion, the entry that it belongs to, and its name (a program's stretches have names of their own).

    ``motion`` is None for a path of the tool that an arm of its class can't be made to follow, or not to its end;
    ``ends`` then says when and why it is not; ``refused`` why no path can be made of a program, or from its end.
    ``left_out``: lines of its program that no motion is of, what the program's check finds, and what its file gives
    beside points and times.
    """

    listed: str
    name: str
    title: str
    expected: tuple[PathVerdict, ...]
    motion: Motion | None
    ends: PathEndsError | None = None
    open: tuple[Open, ...] = ()
    refused: InputError | None = None

    @property
    def gaps(self) -> tuple[Open, ...]:
        """Why no check covers all of it."""
        return tuple(each for each in self.open if each.reason in GAPS)

    @property
    def assumed(self) -> tuple[Open, ...]:
        """What was chosen for it."""
        return tuple(each for each in self.open if each.reason not in GAPS)

    @property
    def found(self) -> tuple[LocatedFinding, ...]:
        """What the check of the program finds that the path is of, as far as it is about this path."""
        entry = self.motion.entry if self.motion else None
        return entry.part.found if isinstance(entry, PartOfProgram) else ()

    @property
    def meant_safe(self) -> bool:
        """Whether it is given to be run, not to show a fault."""
        return set(self.expected) <= {"safe"}

    @property
    def outcome_unfollowed(self) -> PathVerdict:
        """What a path without a motion came to: where the arm's class has no way to follow it, nothing is known."""
        if self.ends is None:
            return "undecided"
        return "unreachable" if self.ends.kind == "out_of_reach" else "singular"


def listed_motions(file: str | Path, task: MotionTask, checks_per_sample: int) -> Iterator[ListedMotion]:
    """Plan the paths of a file.

    Parameters
    ----------
    task : the arm, what it must not meet and its limits, for motions that are to be planned
    checks_per_sample : points checked between two samples to begin with

    Raises
    ------
    InputError
        for what can't be planned; of a program's path, and what starts at its end, the motion says it
    """
    ends: dict[str, Reals] = {}
    nowhere, lost = np.full(task.robot.joints, np.nan), set[str]()
    for i, listed in enumerate(load_paths(file).paths):
        source = CommandSource(Path(file), f"paths[{i}]")
        try:
            entries = [*planned_entries(task, listed, source)]
        except InputError as error:
            ends[listed.name] = nowhere
            lost.add(listed.name)
            yield ListedMotion(listed.name, listed.name, listed.title, listed.expected, None, refused=error)
            continue
        for entry in entries:
            motion, ended, refused = None, None, None
            try:
                motion = motion_of(task.robot, entry, checks_per_sample, source, ends, task=task)
            except NotWristPartitionedError:
                pass
            except PathEndsError as error:
                ended = error
            except InputError as error:
                if not isinstance(entry, PartOfProgram) and getattr(entry, "after", None) not in lost:
                    raise
                refused = error
                lost |= {listed.name, entry.name}
            ends[entry.name] = ends[listed.name] = nowhere if motion is None else motion.q[-1]
            part = entry if isinstance(entry, PartOfProgram) else None
            parts: tuple[tuple[str, Sequence[object]], ...] = (
                ("program_rest", part.rest if part else ()),
                ("rates_contradict", misfits(task.robot, motion.built) if motion else ()),
                ("points_missed", tuple(filter(None, [motion and rows_missed(task.robot, motion.built)]))),
                ("half_turns", motion.built.turns_open if motion and not part else ()),
            )
            rest = [Open(of, (f"{listed.name}: {', '.join(map(str, own))}",)) for of, own in parts if own]
            rest += [Open(of, (listed.name,)) for of in (_chosen(task.robot, motion) if motion and not part else ())]
            if part and part.part.found:
                rest.append(Open("program_findings", tuple(f"{listed.name}: {at}" for at in at_lines(part))))
            yield ListedMotion(
                *(listed.name, entry.name, entry.title, entry.expected, motion, ended), tuple(rest), refused
            )


CHOSEN: tuple[str, ...] = ("half_turns", "start_branches", "arm_angles")
"""What a path leaves open, and a program that is written of it settles."""


def _chosen(robot: Robot, motion: Motion) -> Iterator[str]:
    """What a path of the tool leaves open, and was chosen here."""
    built = motion.built
    if built.tool is None:
        return
    if built.q_start is None and built.start_slot is None:
        yield "start_branches"
    if arm_solver(robot).chain.code == "arm_angle":
        yield "arm_angles"


def at_lines(entry: PartOfProgram) -> list[str]:
    """What the program's check finds of a stretch, as codes with their lines.

    Returns
    -------
    texts : each code once, with its lines; those of other files as ``FILE:LINE``
    """
    own, lines = entry.file.name, dict[str, dict[str, None]]()
    for each in entry.part.found:
        named = lines.setdefault(each.finding.code, {})
        if each.place.line:
            other = each.place.file.name if each.place.file and each.place.file.name != own else ""
            named[f"{other}:{each.place.line}" if other else f"{each.place.line}"] = None
    return [f"{code} ({', '.join(named)})" if named else code for code, named in lines.items()]
