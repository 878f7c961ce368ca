"""The check of a robot program, motion by motion: :func:`check_program`.

Of each motion it says what was checked: its target is known, limits, reach, configuration, singular poses, speeds,
clearance of the arm from itself and, where they are given, from a scene and with a tool. What is not followed passes
nothing.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import field, replace
from difflib import get_close_matches
from itertools import chain
from pathlib import Path
from typing import Literal

import numpy as np

from er3a.by_value import ByValue, Displayed, Sheet, by_identity, frozen
from er3a.collision.pairs import ASSUMED_MARGIN, PENETRATION_TOLERANCE
from er3a.collision.scene import Scene
from er3a.collision.shapes import has_bare_tool, shapes_assumed
from er3a.errors import InputError
from er3a.finding import Finding, fact, is_one
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import USUAL_NEAR, NearSingular
from er3a.numerics.arrays import Reals
from er3a.planning.commands import (
    Command,
    CommandSource,
    JointSequenceCommand,
    SegmentCommand,
    Start,
    ToolSequenceCommand,
)
from er3a.planning.names import ACCELERATION_TIME
from er3a.planning.profiles import LegTimes
from er3a.planning.timing import JointLimits, joint_limits
from er3a.program_check.motion_checks import CheckRules
from er3a.program_check.program_check_findings import (
    RANKS,
    Level,
    NotFollowedReason,
    gravity,
    level_of,
    which,
    with_touches_of,
    worst_of,
)
from er3a.program_check.sanity import doubtful_settings
from er3a.program_check.step_checks import CheckedMotion, Judge, Obstacles
from er3a.programs.execution import Execution, RunLimits, Step
from er3a.programs.instructions import Load, Pause, Place, PoseTarget, Unknown
from er3a.programs.languages import execute, read_program
from er3a.programs.syntax import Assign, Program, Variable
from er3a.robots.robot import Robot

ASSUMED_SPEED = np.radians(180.0)  # rad/s

Check = Literal["limits", "reach", "configuration", "singularity", "rates", "self-collision", "scene", "tool"]
CHECKS: tuple[Check, ...] = ("limits", "reach", "configuration", "singularity", "rates", "self-collision")
"""What is checked of each motion with the arm alone."""


def _always() -> bool:
    """Options are pickled, which no lambda is."""
    return True


@frozen
class CheckOptions(ByValue):
    """Settings of a program check.

    Attributes
    ----------
    start : (n,), rad or m, joint values before the program; None if unknown
    frames : T_flange_tool of tools and T_robot_base of bases (4, 4) in m, by the program's names for them
    scene : the obstacles; None for none
    near : thresholds below which a pose of a line is near-singular
    joint_limits : speeds and accelerations of the joints; None for the robot's own speeds, and assumed ones where it
        has none
    penetration_tolerance : m; no overlap deeper than this goes unnoticed
    assumed_margin : m; a motion that passes nearer than this to assumed shapes of the arm is named
    measures : whether to check collisions
    keep_on : asked while clearance is proven between points of motions; if it is False, what is left is named
    """

    start: Reals | None = None
    frames: Mapping[str, Reals] = field(default_factory=dict)
    scene: Scene | None = None
    near: NearSingular = USUAL_NEAR
    joint_limits: JointLimits | None = None
    penetration_tolerance: float = PENETRATION_TOLERANCE
    assumed_margin: float = ASSUMED_MARGIN
    measures: bool = True
    limits: RunLimits = field(default_factory=RunLimits)
    keep_on: Callable[[], bool] = _always


@frozen
class LocatedFinding:
    """A finding and its place.

    Attributes
    ----------
    calls : where the routines were called, the outermost first, when it was found first
    times : how often the instruction was carried out with it; it says how far that goes at worst
    step : number of the step that it was found at first, None where it belongs to none
    moment : s from the start of that step's motion, when it begins; None of what is about the motion as a whole
    """

    level: Level
    finding: Finding
    place: Place
    calls: tuple[Place, ...] = ()
    times: int = 1
    step: int | None = None
    moment: float | None = None


@frozen
class MotionVerdict:
    """The result for a motion instruction of the program's text.

    Attributes
    ----------
    line : in the program's own file, of the call for a motion of another module; 0 where there is none
    text : as the program has it; kind : of its motion; empty if it is never reached
    level : the worst of its findings
    followed : whether its target and its start were known each time that it may be carried out
    times : how often it was carried out, or that many different times in a loop without end
    duration_s : of the longest; least_clearance_mm : of all; None where unknown
    """

    place: Place
    line: int
    text: str
    kind: str
    level: Level
    followed: bool
    times: int
    duration_s: float | None
    least_clearance_mm: float | None

    @property
    def unreached(self) -> bool:
        """Whether no way through the program comes to it."""
        return not self.followed and self.level == "note"


@frozen
class CycleTime:
    """How long the main way takes, or one round of it if it is repeated for ever: estimates.

    Attributes
    ----------
    blended_s : with every corner rounded whose zone is not fine; stopping_s : with a stop at every target
    pauses_s : waits of given length, which both hold
    waits : for signals or the operator, which neither holds
    complete : whether every motion on it has a duration
    """

    blended_s: float
    stopping_s: float
    pauses_s: float
    waits: int
    repeats: bool
    complete: bool


@frozen
class ProgramCheck(ByValue, Displayed):
    """The result of a program check.

    Attributes
    ----------
    findings : in the order of the text; like ones of one instruction grouped
    verdicts : of each motion instruction
    motions : as they were carried out, by the number of their step
    main : numbers of the steps of the way with the most motions
    checked : what the motions that pass were checked for
    shapes : on which what is said of collisions rests, if no document gives them
    """

    execution: Execution
    level: Level
    findings: tuple[LocatedFinding, ...]
    verdicts: tuple[MotionVerdict, ...]
    motions: Mapping[int, CheckedMotion]
    main: tuple[int, ...]
    cycle: CycleTime
    checked: tuple[Check, ...]
    shapes: Finding | None = None

    def sheet(self) -> Sheet:
        """The level, how many motions pass, and a row for each finding."""
        levels = [each.level for each in self.verdicts]
        return Sheet.of_table(
            f"{self.execution.program.name}: {self.level}, {levels.count('pass')} of {len(levels)} motions pass",
            ("line", "level", "finding"),
            ((each.place.line, each.level, each.finding) for each in self.findings),
        )

    @property
    def arms(self) -> tuple[tuple[str, Robot], ...]:
        """The tools that motions of the program have, each on the robot.

        Returns
        -------
        arms : pairs of the tool's name in the program and the robot with that tool
        """
        return tuple({id(each.arm): (each.motion.tool.name, each.arm) for each in self.motions.values()}.values())


def assumed_limits(robot: Robot, options: CheckOptions) -> JointLimits:
    """Limits of joint speeds and accelerations, assumed where no document gives them.

    Returns
    -------
    limits : those of the options if they have any; else the robot's speeds, with 180 deg/s for unknown ones,
        and accelerations that reach them in ``ACCELERATION_TIME``
    """
    assumed = np.full(robot.joints, ASSUMED_SPEED)
    return options.joint_limits or joint_limits(robot, assumed, ACCELERATION_TIME)


def check_program(program: Program | str | Path, robot: Robot, options: CheckOptions | None = None) -> ProgramCheck:
    """Follow a program and check each of its motions.

    Parameters
    ----------
    program : its file, or what ``er3a.read_program`` read from it

    Raises
    ------
    InputError
        for a file that can't be read as a program
    ShapeError, PoseError
        for a start without one value for each joint, and a frame that is not a rigid transform
    """
    program = program if isinstance(program, Program) else read_program(program)
    options = options or CheckOptions()
    judge = Judge(robot, CheckRules(options.near, assumed_limits(robot, options)))
    execution = execute(program, robot, options.start, options.frames, options.limits, judge)
    motions = {number: execution.steps[number].moved for number in execution.motions}
    obstacles = None
    if options.measures:
        obstacles = Obstacles(robot, options.scene, motions, options.penetration_tolerance, options.assumed_margin)
        obstacles.check(execution, options.keep_on)
    main = execution.main() if execution.endings else None
    way = () if main is None else execution.way(main)
    again = None if main is None else execution.round_from(main)
    unreached = execution.unreached
    located = _located(execution, robot, motions, unreached, obstacles)
    return ProgramCheck(
        execution,
        worst_of(each.level for each in located),
        located,
        _verdicts(execution, motions, unreached, located),
        motions,
        way,
        _cycle(execution, motions, way if again is None else way[way.index(again) :], again is not None),
        _checks(robot, options, motions),
        shapes_assumed(robot, options.assumed_margin, {}) if options.measures else None,
    )


def _checks(robot: Robot, options: CheckOptions, motions: Mapping[int, CheckedMotion]) -> tuple[Check, ...]:
    """What the motions that pass were checked for."""
    checked = [each for each in CHECKS if each != "self-collision" or options.measures]
    if options.scene is not None and options.scene.solids and options.measures:
        checked.append("scene")
    arms = {id(each.arm): each.arm for each in motions.values()}.values()
    carries = options.scene is not None and bool(options.scene.carried)
    if options.measures and (carries or not any(has_bare_tool(arm, options.scene) for arm in arms)):
        checked.append("tool")
    return tuple(checked)


def _located(
    execution: Execution,
    robot: Robot,
    motions: Mapping[int, CheckedMotion],
    unreached: Mapping[Place, str],
    obstacles: Obstacles | None,
) -> tuple[LocatedFinding, ...]:
    """All findings, like ones of an instruction grouped."""
    program, steps = execution.program, execution.steps
    top = Place(program.file)
    found: list[LocatedFinding] = []
    named = {step.instruction.text for step in steps if isinstance(step.instruction, Unknown)}
    assigned = (each.target for each in chain(program.data, program.operations()) if isinstance(each, Assign))
    given = {target.name for target in assigned if isinstance(target, Variable)}
    for number, motion in motions.items():
        step = steps[number]
        for finding, moment in motion.findings.items():
            # What follows from an instruction that is named at its own line is no second question.
            known = is_one(finding, "not_followed") and finding.text in named
            if is_one(finding, "not_followed") and finding.reason == "undefined":
                others = {
                    name for name in given if _letters(name) != _letters(finding.text)
                }  # p10 is not p11 misspelled
                finding = finding.but(near=get_close_matches(finding.text, sorted(others), 1, NEAR_NAME))
            level: Level = "note" if known else level_of(finding, motion.guessed)
            found.append(LocatedFinding(level, finding, step.place, step.calls, 1, number, moment))
    found += [
        LocatedFinding(level_of(each), each, step.place, step.calls)
        for step, each in chain(_not_understood(steps), doubtful_settings(execution, robot))
    ]
    placed = [(each.place, fact("not_followed", text="", reason=each.kind)) for each in execution.cut]
    placed += [(place, fact("not_followed", text=text, reason="unreached")) for place, text in unreached.items()]
    placed += [] if program.motions() else [(top, fact("program_nothing_moves"))]
    if obstacles is not None and (unseen := obstacles.bodies.unexamined):
        placed.append((top, fact("pairs_unexamined", pairs=unseen)))
    found += [LocatedFinding(level_of(each), each, place) for place, each in placed]
    groups: dict[tuple[Place, str, str], list[LocatedFinding]] = defaultdict(list)
    for each in found:
        groups[each.place, each.finding.code, which(each.finding)].append(each)
    grouped = [_at_worst(same) for same in groups.values()]
    order = {path: i for i, path in enumerate(dict.fromkeys(str(each.place.file) for each in grouped))}
    return tuple(sorted(grouped, key=lambda each: (order[str(each.place.file)], each.place.line, -RANKS[each.level])))


def _letters(name: str) -> str:
    return name.strip("0123456789")


def _not_understood(steps: Iterable[Step]) -> Iterator[tuple[Step, Finding]]:
    """Instructions that are not followed, and those at which the controller stops."""
    for step in steps:
        if isinstance(what := step.instruction, Unknown):
            reason: NotFollowedReason = "setting" if what.shapes and not what.may_move else "instruction"
            if what.stops:
                yield step, fact("program_not_understood", text=what.text, place=step.place)
            else:
                yield step, fact("not_followed", text=what.text, reason=reason)


def _at_worst(same: list[LocatedFinding]) -> LocatedFinding:
    """One of like findings of an instruction: when and where it is so first, and how far it goes at worst."""
    level = max((each.level for each in same), key=RANKS.__getitem__)
    grave = [each for each in same if each.level == level]
    first, found = grave[0], max((each.finding for each in grave), key=gravity)
    if is_one(first.finding, "motion_collides"):
        others = [each.finding for each in same if is_one(each.finding, "motion_collides")]
        found = with_touches_of(first.finding, others)
    elif (at_mm := getattr(first.finding, "at_mm", None)) is not None:
        found = found.but(at_mm=at_mm)
    return replace(first, finding=found, times=len(same))


NEAR_NAME = 0.75  # of the letters of both names, in order: what may be misspelled
NOT_FOLLOWED = ("not_followed", "way_not_known", "configuration_guessed")


def _verdicts(
    execution: Execution,
    motions: Mapping[int, CheckedMotion],
    unreached: Mapping[Place, str],
    located: tuple[LocatedFinding, ...],
) -> tuple[MotionVerdict, ...]:
    program = execution.program
    done: dict[Place, list[CheckedMotion]] = defaultdict(list)
    lines: dict[Place, int] = {}
    for number, motion in motions.items():
        step = execution.steps[number]
        done[step.place].append(motion)
        lines.setdefault(step.place, execution.own_line(step))
    levels: dict[Place, list[Level]] = defaultdict(list)
    lost: set[Place] = set()
    for each in located:
        levels[each.place].append(each.level)
        if is_one(each.finding, *NOT_FOLLOWED):
            lost.add(each.place)
    found = []
    for place, text in program.motions():
        here = done[place]
        if not here and place.file != program.file:
            continue
        followed = bool(here) and place not in lost and execution.complete
        durations = [each.path.law.duration for each in here if each.path is not None]
        clear = [each.clearance for each in here if each.clearance is not None]
        found.append(
            MotionVerdict(
                place,
                lines.get(place, place.line),
                " ".join(text.split()),
                here[0].motion.kind if here else "",
                worst_of((*levels[place], "pass" if followed or place in unreached else "caution")),
                followed,
                len(here),
                max(durations, default=None),
                min(clear) * 1000 if clear else None,
            )
        )
    return tuple(sorted(found, key=lambda each: each.line))


def _cycle(
    execution: Execution, motions: Mapping[int, CheckedMotion], part: tuple[int, ...], repeats: bool
) -> CycleTime:
    stopping, saved, pauses, waits, complete = 0.0, 0.0, 0.0, 0, True
    before: CheckedMotion | None = None
    for number in part:
        instruction = execution.steps[number].instruction
        if isinstance(instruction, Pause):
            pauses += instruction.seconds or 0.0
            waits += instruction.seconds is None
        if number not in motions:
            continue
        motion = motions[number]
        if motion.path is None:
            complete = complete and motion.stays
            continue
        stopping += motion.path.law.duration
        if before is not None and before.path is not None and before.motion.zone.kind != "fine":
            saved += before.path.law.saved_by_blend + motion.path.law.saved_by_blend
        before = motion
    return CycleTime(stopping - saved + pauses, stopping + pauses, pauses, waits, repeats, complete)


SAME_PLACE = 1e-6  # rad or m, by which the start of a motion may be off the end of the one before


@by_identity
class ProgramPart:
    """A stretch of a program, with a stop at each target: joint moves, or lines and arcs.

    Attributes
    ----------
    lines : of the first and the last instruction
    load : what the program says hangs on the flange, as of its motions
    found : of at least caution that the program's check finds at its motions, and that a check of the path alone does
        not
    """

    kind: Literal["joint_sequence", "sequence"]
    lines: tuple[int, int]
    made: Command
    load: Load | None = None
    found: tuple[LocatedFinding, ...] = ()

    def command(self, source: CommandSource) -> Command:
        """The stretch of the program as a path's command.

        Parameters
        ----------
        source : what errors about the path name as its place

        Returns
        -------
        command : in SI units, with this source
        """
        return replace(self.made, source=source)


FOUND_OF_PATHS = frozenset(
    (
        *("above_limit", "below_limit", "combination_exceeded", "target_out_of_reach"),
        *("way_out_of_reach", "configuration_ends", "meets_singularity", "motion_collides", "pairs_unexamined"),
    )
)
"""Findings that a check of the path makes too, of the motions that it is made of: it follows the same joints."""


def parts_of(check: ProgramCheck, robot: Robot, source: CommandSource) -> tuple[list[ProgramPart], tuple[int, ...]]:
    """The way with the most motions, up to the first motion that can't be carried out; that one is the last.

    A stretch ends where the next motion starts elsewhere, or something between them moves the arm, or may.

    Returns
    -------
    parts : its stretches
    rest : the program's lines that may move the arm otherwise: on other ways, after the last, or not followed

    Raises
    ------
    InputError
        for a program that does not move the arm, or whose tool is not the robot's
    """
    groups: list[list[tuple[Place, CheckedMotion]]] = []
    rest = {each.place: each.line for each in check.verdicts}
    rest |= {each.place: each.place.line for each in check.findings if is_one(each.finding, "not_followed")}
    joined, times = True, Counter(id(motion) for motion in check.motions.values())
    for number in check.main:
        step, motion = check.execution.steps[number], check.motions.get(number)
        if motion is None or motion.stays or motion.start is None:
            lost = isinstance(step.instruction, Unknown) and step.instruction.may_move
            joined = joined and not lost and (motion is None or motion.stays)
            if motion is not None and motion.stays:
                rest.pop(step.place, None)
            continue
        if motion.path is None:
            break
        if motion.motion.kind != "joint" and not np.allclose(motion.arm.tool, robot.tool, rtol=0, atol=1e-12):
            problem = f"line {step.place.line} moves another tool than the robot's"
            raise source.error("program", problem, "Give the robot this tool in its file or in the study")
        if groups and joined and _goes_on(groups[-1][-1][1], motion):
            groups[-1].append((step.place, motion))
        else:
            groups.append([(step.place, motion)])
        joined = True
        times[id(motion)] = 0
        if not any(
            times[id(each)] for i, each in check.motions.items() if check.execution.steps[i].place == step.place
        ):
            rest.pop(step.place, None)
        if motion.end is None:
            break
    if not groups:
        raise InputError(source.file, f"{source.field}.program", "no motion has a known start", "Give start_deg")
    whose = [{place for place, _ in group} for group in groups]
    found = _beyond_paths(check, set().union(*whose))
    parts = [
        replace(
            _part([(place.line, motion) for place, motion in group]),
            found=tuple(each for each in found if each.place in own or not any(each.place in other for other in whose)),
        )
        for group, own in zip(groups, whose)
    ]
    return parts, tuple(sorted({*rest.values()} - {0}))


def _beyond_paths(check: ProgramCheck, held: set[Place]) -> list[LocatedFinding]:
    """What is found of at least caution, but for what a check of paths made of motions at places finds itself."""
    return [
        each
        for each in check.findings
        if RANKS[each.level] >= RANKS["caution"]
        and not (each.finding.code in FOUND_OF_PATHS and (each.place in held or not each.place.line))
    ]


def _goes_on(before: CheckedMotion, motion: CheckedMotion) -> bool:
    """Whether a motion belongs to the stretch of the one before."""
    assert before.end is not None
    assert motion.start is not None
    same_place = np.allclose(before.end, motion.start, rtol=0, atol=SAME_PLACE)
    same_kind = (before.motion.kind == "joint") == (motion.motion.kind == "joint")
    return bool(same_place and same_kind and before.motion.load == motion.motion.load)


def _part(group: list[tuple[int, CheckedMotion]]) -> ProgramPart:
    lines = (group[0][0], group[-1][0])
    motions = [motion for _, motion in group]
    start = motions[0].start
    assert start is not None
    laws = [motion.path.law for motion in motions if motion.path is not None]
    timing = LegTimes(np.array([law.duration for law in laws]), np.array([law.ramp for law in laws]))
    if motions[0].motion.kind == "joint":
        points = np.stack([start, *(motion.end for motion in motions if motion.end is not None)])
        return ProgramPart("joint_sequence", lines, JointSequenceCommand(points, 0.0, timing), motions[0].motion.load)
    command = ToolSequenceCommand(Start(joints=start), tuple(map(_segment, motions)), timing)
    return ProgramPart("sequence", lines, command, motions[0].motion.load)


def _segment(checked: CheckedMotion) -> SegmentCommand:
    """The motion's end and point, in the frame that the robot's base is placed in."""
    motion, base = checked.motion, checked.base
    via: Reals | None = None
    if motion.kind == "arc" and isinstance(motion.via, PoseTarget) and base is not None:
        via = (base @ motion.via.pose)[:3, 3]
    if isinstance(motion.target, PoseTarget) and base is not None:
        return SegmentCommand(base @ motion.target.pose, via)
    assert checked.end is not None
    return SegmentCommand(forward(checked.arm, checked.end), via)
