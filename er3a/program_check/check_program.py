"""The check of a robot program, motion by motion: :func:`check_program`."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from er3a.by_value import ByValue
from er3a.collision.pairs import ASSUMED_MARGIN, PENETRATION_TOLERANCE, PairsUnexamined, ShapesAssumed
from er3a.collision.scene import Scene
from er3a.collision.shapes import shapes_assumed
from er3a.errors import InputError
from er3a.geometry.transforms import rotation_angle
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
from er3a.planning.sequences import TURN_LENGTH, ArcWithPath
from er3a.planning.timing import JointLimits, joint_limits
from er3a.program_check import program_check_findings as found_in
from er3a.program_check.motion_checks import AssumedRates, CheckRules, MotionPath
from er3a.program_check.step_checks import CheckedMotion, StepChecker, obstacles_of
from er3a.programs.execution import Ending, Execution, KeepOn, RunLimits, Step
from er3a.programs.instructions import (
    ArmMotion,
    Decision,
    JointTarget,
    Load,
    MovesBeside,
    Pause,
    Place,
    PoseTarget,
    UnclearLoad,
    Unknown,
    turns_apart,
)
from er3a.programs.machine import execute
from er3a.programs.program_findings import BegunWithin, NotSimulated, NotUnderstood
from er3a.programs.syntax import Fixed, Move, Program
from er3a.programs.writing import SAME_TURN
from er3a.robots.robot import Robot

ASSUMED_SPEED, ASSUMED_SLIDE = np.radians(180.0), 0.5  # rad/s and m/s
MAX_MOTIONS = 1_000
MAX_ROUNDS = 20  # times as many motions as may differ are carried out


@dataclass(frozen=True, eq=False)
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
    assumed_margin : m; if the arm's shapes are assumed, a motion nearer to them than this is a caution
    measures : whether to check collisions
    most_motions : number of different motions (and a multiple of it for all executed ones) that are checked in full; of
        later ones only the targets are checked, with a note
    keep_on : called while the program is followed and its motions are checked; if it returns False, the check ends
    """

    start: Reals | None = None
    frames: Mapping[str, Reals] = field(default_factory=dict)
    scene: Scene | None = None
    near: NearSingular = USUAL_NEAR
    joint_limits: JointLimits | None = None
    penetration_tolerance: float = PENETRATION_TOLERANCE
    assumed_margin: float = ASSUMED_MARGIN
    measures: bool = True
    most_motions: int = MAX_MOTIONS
    assumed: AssumedRates = field(default_factory=AssumedRates)
    limits: RunLimits = field(default_factory=RunLimits)
    keep_on: KeepOn | None = None


@dataclass(frozen=True)
class NotExamined:
    """What was not examined: a motion instruction, or not each time that it is carried out; the way of a motion whose
    start is not known; where the program's course was not followed on; or what an ``instruction`` does that is not
    understood or not simulated."""

    place: Place
    what: Literal["motion", "way", "course", "instruction"]


@dataclass(frozen=True)
class LocatedFinding:
    """A finding and its place.

    Attributes
    ----------
    calls : where the routines were called, the outermost first, when it was found first
    times : how often the instruction was carried out with it; it says how far that goes at worst
    step : number of the step that it was found at first, None where it belongs to none
    moment : s from the start of that step's motion, when it begins; None of what is about the motion as a whole
    joint_moves : (n,) each, deg: joint moves, one or two, that take the tool where that motion does, and pass
    off_mm, off_deg : by how much the tool leaves that motion's line or arc on these; None of a joint motion
    """

    level: found_in.Level
    finding: found_in.CheckFinding
    place: Place
    calls: tuple[Place, ...] = ()
    times: int = 1
    step: int | None = None
    moment: float | None = None
    joint_moves: tuple[tuple[float, ...], ...] = ()
    off_mm: float | None = None
    off_deg: float | None = None


@dataclass(frozen=True)
class MotionVerdict:
    """The result for a motion instruction of the program's text.

    Attributes
    ----------
    line : in the program's own file, of the call for a motion of another module; 0 where there is none
    text : as the program has it; kind : of its motion; empty if it is never reached
    level : the worst of its findings
    times : how often it was carried out, or that many different times in a loop without end
    duration_s : of the longest; least_clearance_mm : of all; None where unknown
    """

    place: Place
    line: int
    text: str
    kind: str
    level: found_in.Level
    times: int
    duration_s: float | None
    least_clearance_mm: float | None


@dataclass(frozen=True)
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


@dataclass(frozen=True, eq=False)
class ProgramCheck(ByValue):
    """The result of a program check.

    Attributes
    ----------
    findings : in the order of the text; like ones of one instruction grouped
    verdicts : of each motion instruction
    motions : as they were carried out, by the number of their step; of a second round only what the first never meets
    main : numbers of the steps of the way with the most motions
    not_examined : in the order of the text; each has a finding, of at least caution but for the way of a motion whose
        start is not known
    shapes : on which what is said of collisions rests, if no document gives them
    """

    execution: Execution
    level: found_in.Level
    findings: tuple[LocatedFinding, ...]
    verdicts: tuple[MotionVerdict, ...]
    motions: Mapping[int, CheckedMotion]
    main: tuple[int, ...]
    cycle: CycleTime
    not_examined: tuple[NotExamined, ...] = ()
    shapes: ShapesAssumed | None = None

    def short_of(self, missed: bool) -> ProgramCheck:
        """The check where something was not examined of any motion: none of its verdicts is a pass."""
        if not missed:
            return self
        verdicts = tuple(replace(each, level=found_in.worst_of((each.level, "caution"))) for each in self.verdicts)
        return replace(self, level=found_in.worst_of((self.level, "caution")), verdicts=verdicts)

    @property
    def arms(self) -> tuple[tuple[str, Robot], ...]:
        """The robot with each tool that motions have, and the name that the program gives the tool."""
        placed = (motion.placed for motion in self.motions.values())
        return tuple({id(each.arm): (each.motion.tool.name, each.arm) for each in placed}.values())


def assumed_limits(robot: Robot, options: CheckOptions) -> JointLimits:
    """Joint limits, assumed where no document gives them."""
    assumed = np.where(robot.slides, ASSUMED_SLIDE, ASSUMED_SPEED)
    return options.joint_limits or joint_limits(robot, assumed, ACCELERATION_TIME)


def check_program(program: Program, robot: Robot, options: CheckOptions | None = None) -> ProgramCheck:
    """Follow a program and check each of its motions.

    Raises
    ------
    ShapeError, PoseError
        for a start without one value for each joint, and a frame that is not a rigid transform
    """
    options = options or CheckOptions()
    followed = replace(options.limits, second_round=True)
    execution = execute(program, robot, options.start, options.frames, followed, options.keep_on)
    limits = assumed_limits(robot, options)
    around = options.scene, options.penetration_tolerance, options.assumed_margin
    obstacles = obstacles_of(robot, *around) if options.measures else None
    checker = StepChecker(robot, CheckRules(options.near, limits, options.assumed), obstacles, execution)
    checker.start = options.start
    end = _checked_until(checker, options)
    for ending in execution.endings:
        if end == len(execution.steps):
            checker.close_loop(ending)
    located = _located(execution, robot, checker, end)
    located = _with_joint_moves(located, checker, options.keep_on)
    missed = _not_examined(execution, located, end)
    first = _first_met(execution)
    motions = {number: motion for number, motion in checker.motions.items() if number in first}
    verdicts = _verdicts(program, execution, motions, located, missed)
    level: found_in.Level = found_in.worst_of(each.level for each in located)
    main = execution.main() if execution.endings else None
    way = () if main is None else execution.way(main)
    cycle = _cycle(execution, motions, main, way)
    shapes = shapes_assumed(robot, options.assumed_margin, {}) if options.measures else None
    return ProgramCheck(execution, level, located, verdicts, motions, way, cycle, missed, shapes)


def _checked_until(checker: StepChecker, options: CheckOptions) -> int:
    """Check step by step; returns the number of the first step not checked."""
    steps, most, keep_on = checker.execution.steps, options.most_motions, options.keep_on
    for number, step in enumerate(steps):
        if isinstance(step.instruction, ArmMotion):
            full = checker.different >= most or len(checker.motions) >= MAX_ROUNDS * most
            if full or (keep_on is not None and not keep_on("checking", number, len(steps))):
                return number
        checker.check(number)
    return len(steps)


def _not_examined(execution: Execution, located: tuple[LocatedFinding, ...], end: int) -> tuple[NotExamined, ...]:
    """``end``: number of the first step that was not checked."""
    moves = (step.place for step in execution.steps[end:] if isinstance(step.instruction, ArmMotion))
    found = [NotExamined(place, "motion") for place in moves]
    found += [NotExamined(place, "motion") for places in _unreached(execution).values() for place in places]
    found += [
        NotExamined(each.place, "motion")
        for each in located
        if isinstance(each.finding, found_in.TargetNotGiven) and each.level == "caution"
    ]
    found += [NotExamined(each.place, "way") for each in located if isinstance(each.finding, found_in.PathNotKnown)]
    ends = (
        found_in.NotFollowedToEnd,
        found_in.KeptToNextStart,
        found_in.SetElsewhere,
        found_in.WaitsForOthers,
        found_in.ErrorsNotFollowed,
        found_in.FramesDecide,
        BegunWithin,
    )
    found += [NotExamined(each.place, "course") for each in located if isinstance(each.finding, ends)]
    strange = (found_in.MayMove, found_in.TurnNotFollowed, NotUnderstood, NotSimulated)
    found += [NotExamined(each.place, "instruction") for each in located if isinstance(each.finding, strange)]
    files = {each.place.file: i for i, each in enumerate(located)}
    order = dict.fromkeys(found)
    return tuple(sorted(order, key=lambda each: (files.get(each.place.file, len(files)), each.place.line)))


def _located(execution: Execution, robot: Robot, checker: StepChecker, end: int) -> tuple[LocatedFinding, ...]:
    """All findings, like ones of an instruction grouped; ``end``: number of the first step that was not checked."""
    program = execution.program
    top = Place(program.file)
    moving = {step.place for step in execution.steps if isinstance(step.instruction, Unknown)}
    found = [
        LocatedFinding(found_in.level_of(each), each, _place_of(each, top))
        for each in program.findings
        if not (isinstance(each, NotUnderstood) and each.place in moving)
    ]
    if end < len(execution.steps):
        targets, wrong = checker.rest(end)
        rest = found_in.RestNotChecked(len(checker.motions), targets)
        found.append(LocatedFinding("caution", rest, execution.steps[end].place))
        for number, each_wrong in wrong.items():
            step = execution.steps[number]
            found += [LocatedFinding(found_in.level_of(each), each, step.place, step.calls) for each in each_wrong]
    steps = _first_met(execution)
    for number, step in steps.items():
        motion = checker.motions.get(number)
        if motion is not None:
            found += [
                LocatedFinding(
                    *(found_in.level_of(each), each, step.place, step.calls, 1),
                    step=None if (number, each) in checker.elsewhere else number,
                    moment=motion.moments.get(each),
                )
                for each in motion.findings
            ]
    found += _begun_again(execution, checker, found)
    arms = checker.obstacles.bodies.values() if checker.obstacles else ()
    if pairs := tuple(dict.fromkeys(pair for bodies in arms for pair in bodies.in_error)):
        found.append(LocatedFinding("caution", PairsUnexamined(pairs), top))
    for step in steps.values():
        what = step.instruction
        if isinstance(what, Unknown):
            unknown = found_in.MayMove(what.text) if what.may_move else NotUnderstood(what.text, step.place)
            found.append(LocatedFinding("fail" if what.stops else "caution", unknown, step.place, step.calls))
        elif isinstance(what, MovesBeside) and what.kind != "entered":
            sets = ", ".join(what.sets)
            beside = found_in.MovesBesideProgram(what.routine, "sets" if sets else what.kind, sets)
            found.append(LocatedFinding("caution", beside, step.place, step.calls))
        elif isinstance(what, Pause) and what.by_others:
            waits = found_in.WaitsForOthers(what.condition or "")
            found.append(LocatedFinding("caution", waits, step.place, step.calls))
        elif isinstance(what, Decision) and what.taken:
            found.append(LocatedFinding("note", found_in.BothSidesChecked(what.condition), step.place, step.calls))
    found += [*_loads(execution, robot), *_stated_elsewhere(execution, robot), *_not_set(execution)]
    found += [
        LocatedFinding("caution", found_in.FrameGivenTwice(each.name, each.moved_mm, each.turned_deg), each.place)
        for each in execution.frames_twice
    ]
    found += [LocatedFinding("caution", found_in.KeptToNextStart(name), place) for name, place in execution.kept]
    found += [
        LocatedFinding("caution", found_in.SetElsewhere(name, place.file.name if place.file else "", place.line), top)
        for name, place in execution.elsewhere
    ]
    found += [LocatedFinding("caution", found_in.ErrorsNotFollowed(), place) for place in execution.errors]
    found += [LocatedFinding("caution", other, ending.place) for ending, other in checker.returns]
    for ending in execution.endings:
        if ending.kind not in ("end", "repeats", "joins"):
            stopped = found_in.NotFollowedToEnd(ending.kind, ending.limit)
            found.append(LocatedFinding(found_in.level_of(stopped), stopped, ending.place))
    for place, moves in _first_unreached(execution):
        missed: found_in.CheckFinding = (
            found_in.NeverReached(moves) if execution.complete else found_in.MotionNotReached()
        )
        found.append(LocatedFinding(found_in.level_of(missed), missed, place))
    groups: dict[tuple[Place, str, str], list[LocatedFinding]] = defaultdict(list)
    for each in found:
        groups[each.place, each.finding.code, _which(each.finding)].append(each)
    grouped = [_at_worst(same) for same in groups.values()]
    order = {path: i for i, path in enumerate(dict.fromkeys(str(each.place.file) for each in grouped))}
    return tuple(
        sorted(grouped, key=lambda each: (order[str(each.place.file)], each.place.line, -found_in.RANKS[each.level]))
    )


def _at_worst(same: list[LocatedFinding]) -> LocatedFinding:
    """One of like findings of an instruction: when and where it is so first, and how far it goes at worst."""
    level = max((each.level for each in same), key=found_in.RANKS.__getitem__)
    grave = [each for each in same if each.level == level]
    first, found = grave[0], max((each.finding for each in grave), key=found_in.gravity)
    if isinstance(first.finding, found_in.MotionCollides):
        others = [each.finding for each in same if isinstance(each.finding, found_in.MotionCollides)]
        found = first.finding.with_touches_of(others)
    elif (at_mm := getattr(first.finding, "at_mm", None)) is not None:
        found = replace(found, at_mm=at_mm)  # type: ignore[call-arg]
    return replace(first, finding=found, times=len(same))


def _first_met(execution: Execution) -> dict[int, Step]:
    """Steps by number, without those of a second round where the first comes to the same place."""
    seen = {step.place for step in execution.steps if not step.again}
    return {i: step for i, step in enumerate(execution.steps) if not (step.again and step.place in seen)}


def _begun_again(execution: Execution, checker: StepChecker, found: list[LocatedFinding]) -> Iterator[LocatedFinding]:
    """What is found at motions in the second round alone, to which a controller may go on or not."""
    known = {(each.place, each.finding.code) for each in found if each.level in ("caution", "fail")}
    told: dict[Place, list[str]] = {}
    for number, motion in checker.motions.items():
        step = execution.steps[number]
        if step.again:
            grave = (each.code for each in motion.findings if _is_of_its_own(each))
            told.setdefault(step.place, []).extend(code for code in grave if (step.place, code) not in known)
    for place, codes in told.items():
        if codes:
            yield LocatedFinding("caution", found_in.BegunAgain(tuple(dict.fromkeys(codes))), place)


def _is_of_its_own(finding: found_in.CheckFinding) -> bool:
    """Whether a finding is no note, nor only that what was before left the start unknown, which is told there."""
    return found_in.level_of(finding) in ("caution", "fail") and not isinstance(finding, found_in.PathNotKnown)


def _loads(execution: Execution, robot: Robot) -> Iterator[LocatedFinding]:
    """Each load that the program states, at the first motion with it."""
    wrist, seen = robot.masses.wrist, set()
    for step in execution.steps:
        load = step.instruction.load if isinstance(step.instruction, ArmMotion) else None
        if load is None or load in seen:
            continue
        seen.add(load)
        found: found_in.CheckFinding
        if wrist is not None and load.mass is not None and load.mass > wrist.payload:
            found = found_in.LoadAbovePayload(load.mass, wrist.payload)
        elif isinstance(load, UnclearLoad):
            found = found_in.LoadNotExamined(load.mass, load.text)
        else:
            found = found_in.LoadNotExamined(load.mass)
        yield LocatedFinding(found_in.level_of(found), found, step.place, step.calls)


def _not_set(execution: Execution) -> Iterator[LocatedFinding]:
    """Tool and base that a program does not set: at the first motion or line that needs them, and where they decide."""
    needed = [(each.before, each.place, each.calls, each.kinds) for each in execution.unset if not each.decides]
    for number, step in enumerate(execution.steps):
        what = step.instruction
        if not isinstance(what, ArmMotion) or (what.kind == "joint" and not isinstance(what.target, PoseTarget)):
            continue
        own = {"tool": what.tool.own, "base": what.base.own or not isinstance(what.target, PoseTarget)}
        kinds: frozenset[str] = frozenset(kind for kind, is_own in own.items() if not is_own)
        if kinds:
            needed.append((number, step.place, step.calls, kinds))
    if needed:
        _, place, calls, _ = min(needed, key=lambda each: each[0])
        all_kinds = frozenset[str]().union(*(kinds for *_, kinds in needed))
        yield LocatedFinding("note", found_in.FramesFromRobotFile(_both(all_kinds)), place, calls)
    for each in execution.unset:
        if each.decides:
            yield LocatedFinding("caution", found_in.FramesDecide(_both(each.kinds)), each.place, each.calls)


def _both(kinds: frozenset[str]) -> Literal["tool", "base", "both"]:
    return "both" if len(kinds) > 1 else "tool" if "tool" in kinds else "base"


STATED_MM, STATED_DEG = 1.0, 0.5
"""By how much a table's pose may differ from its joints, which tables often round to 0.1 deg."""


def _stated_elsewhere(execution: Execution, robot: Robot) -> Iterator[LocatedFinding]:
    """The row of a table whose tool is farthest from where its joints put it."""
    rows = [
        (step, step.instruction.target)
        for step in execution.steps
        if isinstance(step.instruction, ArmMotion) and isinstance(step.instruction.target, JointTarget)
    ]
    rows = [(step, target) for step, target in rows if target.stated is not None]
    if not rows:
        return
    stated = np.stack([target.stated for _, target in rows if target.stated is not None])
    reached = np.linalg.inv(robot.base) @ forward(robot, np.stack([target.joints for _, target in rows]))
    moved = np.linalg.norm(stated[:, :3, 3] - reached[:, :3, 3], axis=1) * 1000
    turned = np.nan_to_num(np.degrees(rotation_angle(stated[:, :3, :3], reached[:, :3, :3])))
    worst = int((moved / STATED_MM + turned / STATED_DEG).argmax())
    if moved[worst] > STATED_MM or turned[worst] > STATED_DEG:
        other = found_in.ToolStatedElsewhere(float(moved[worst]), float(turned[worst]))
        yield LocatedFinding("caution", other, rows[worst][0].place)


BY_JOINT_MOVES = frozenset(
    (
        *("above_limit", "below_limit", "slide_exceeded", "combination_exceeded", "way_out_of_reach"),
        *("configuration_ends", "meets_singularity", "passes_singularity", "arrives_otherwise", "turns_at_start"),
        *("configuration_changes", "joint_jumps", "whole_turn", "motion_collides", "clear_of_assumed", "undecided"),
    )
)
"""Findings of motions that joint moves to another solution, or round by a point, may be free of."""
MAX_ADVISED = 20  # motions for which such moves are looked for


def _with_joint_moves(
    located: tuple[LocatedFinding, ...], checker: StepChecker, keep_on: KeepOn | None
) -> tuple[LocatedFinding, ...]:
    """Findings, with joint moves that pass instead of the motion where some were found."""
    moves: dict[int, dict[str, Any]] = {}
    for each in located:
        if each.step is None or each.step in moves or each.finding.code not in BY_JOINT_MOVES:
            continue
        if len(moves) == MAX_ADVISED or (keep_on is not None and not keep_on("checking", each.step, 0)):
            break
        found = checker.joint_moves_instead(each.step)
        off = checker.off_way(each.step, found) if found else None
        moves[each.step] = dict(
            joint_moves=tuple(tuple((np.round(np.degrees(row), 3) + 0.0).tolist()) for row in found),
            off_mm=None if off is None else 1000 * off[0],
            off_deg=None if off is None else float(np.degrees(off[1])),
        )
    return tuple(
        replace(each, **moves[each.step]) if each.step in moves and each.finding.code in BY_JOINT_MOVES else each
        for each in located
    )


def _which(finding: found_in.CheckFinding) -> str:
    """Key that distinguishes findings of one code at one instruction."""
    names = ("joint", "joints", "side", "type", "name", "text", "condition", "kind", "mass_kg")
    return " ".join(f"{getattr(finding, name)}" for name in names if hasattr(finding, name))


def _place_of(finding: found_in.CheckFinding, top: Place) -> Place:
    """The place of a finding about the text."""
    place = getattr(finding, "place", None)
    return place if isinstance(place, Place) else top


def _unreached(execution: Execution) -> dict[str, dict[Place, bool]]:
    """Motions that no way comes to, and instructions that may move the arm (False), by routine: of the program's own
    file and of the routines of other files that are called."""
    program, met = execution.program, {step.place for step in execution.steps}
    motions, unmet = {place for place, _ in _motion_texts(program)} - met, {*execution.unmet}
    found: dict[str, dict[Place, bool]] = {}
    for name, routine in program.routines.items():
        places = (each.place for each in routine.operations if each.place in motions or each.place in unmet)
        here = {each: each in motions for each in places if each.file == program.file or name in execution.entered}
        if here:
            found[name] = here
    return found


def _first_unreached(execution: Execution) -> Iterator[tuple[Place, bool]]:
    """These, of routines of other files the first alone, whose others are like it."""
    own = execution.program.file
    for places in _unreached(execution).values():
        yield from (each for each in places.items() if each[0].file == own)
        yield from [each for each in places.items() if each[0].file != own][:1]


def _motion_texts(program: Program) -> list[tuple[Place, str]]:
    """All motion instructions of the text."""
    found: list[tuple[Place, str]] = []
    for operation in program.operations():
        if isinstance(operation, Move):
            found.append((operation.place, operation.text))
        elif isinstance(operation, Fixed) and isinstance(operation.instruction, ArmMotion):
            found.append((operation.place, operation.instruction.form))
    return list(dict.fromkeys(found))


def _verdicts(
    program: Program,
    execution: Execution,
    motions: Mapping[int, CheckedMotion],
    located: tuple[LocatedFinding, ...],
    missed: tuple[NotExamined, ...],
) -> tuple[MotionVerdict, ...]:
    done: dict[Place, list[CheckedMotion]] = defaultdict(list)
    lines: dict[Place, int] = {}
    for number, motion in motions.items():
        step = execution.steps[number]
        done[step.place].append(motion)
        lines.setdefault(step.place, execution.own_line(step))
    worst: dict[Place, found_in.Level] = {}
    for each in located:
        worst[each.place] = found_in.worst_of((worst.get(each.place, "pass"), each.level))
    for missing in (each for each in missed if each.what in ("motion", "course")):
        worst[missing.place] = found_in.worst_of((worst.get(missing.place, "pass"), "caution"))
    met = {step.place for step in execution.steps}
    found = []
    for place, text in _motion_texts(program):
        here = done[place]
        if not here and place not in met and place.file != program.file:
            continue
        if not here and place in met:
            worst[place] = found_in.worst_of((worst.get(place, "pass"), "caution"))
        durations = [each.way.law.duration for each in here if each.way is not None]
        clear = [each.clearance for each in here if each.clearance is not None]
        found.append(
            MotionVerdict(
                place,
                lines.get(place, place.line),
                " ".join(text.split()),
                here[0].kind if here else "",
                worst.get(place, "pass"),
                len(here),
                max(durations, default=None),
                min(clear) * 1000 if clear else None,
            )
        )
    return tuple(sorted(found, key=lambda each: each.line))


def _cycle(
    execution: Execution, motions: Mapping[int, CheckedMotion], main: Ending | None, way: tuple[int, ...]
) -> CycleTime:
    again = None if main is None else execution.round_from(main)
    part = way if again is None else way[way.index(again) :]
    stopping, saved, pauses, waits, complete = 0.0, 0.0, 0.0, 0, True
    for number in part:
        instruction = execution.steps[number].instruction
        if isinstance(instruction, Pause):
            pauses += instruction.seconds or 0.0
            waits += instruction.seconds is None
        elif number in motions:
            motion = motions[number]
            if motion.way is None:
                complete = complete and motion.stays
                continue
            stopping += motion.way.law.duration
            saved += motion.way.law.saved_by_blend * motion.blended_ends
        elif isinstance(instruction, ArmMotion):
            complete = False  # most_motions, or the time, ended before it
    return CycleTime(stopping - saved + pauses, stopping + pauses, pauses, waits, again is not None, complete)


MAX_MOTION_SHARE = 0.49  # that a rounded corner takes
SAME_PLACE = 1e-6  # rad or m, by which the start of a motion may be off the end of the one before


@dataclass(frozen=True, eq=False)
class ProgramPart:
    """A stretch of a program: joint moves with a stop at each target, or lines and arcs.

    Attributes
    ----------
    lines : of the first and the last instruction
    load : what the program says hangs on the flange, as of its motions
    found : of at least caution that the program's check finds, and that a check of the path alone does not: at its
        motions, or at none of any stretch
    """

    kind: Literal["joint_sequence", "sequence"]
    lines: tuple[int, int]
    made: Command
    load: Load | None = None
    found: tuple[LocatedFinding, ...] = ()

    def command(self, source: CommandSource) -> Command:
        """The path, with what errors call it."""
        return replace(self.made, source=source)


FOUND_OF_PATHS = frozenset(
    (
        *("above_limit", "below_limit", "slide_exceeded", "combination_exceeded", "target_out_of_reach"),
        *("way_out_of_reach", "configuration_ends", "meets_singularity", "passes_singularity", "undecided"),
        *("motion_collides", "pairs_unexamined"),
    )
)
"""Findings that a check of the path makes too, of the motions that it is made of: it follows the same joints. Speeds
and zones are not among these: between stops a stretch has one law of time, and one way round each corner or a stop
there; nor are clearances, which may be those of a corner's rounding."""


def parts_of(check: ProgramCheck, robot: Robot, source: CommandSource) -> tuple[list[ProgramPart], tuple[int, ...]]:
    """The way with the most motions, up to the first motion that can't be carried out; that one is the last.

    A stretch ends where the next motion starts elsewhere, or something between them moves the arm, or may.

    Returns
    -------
    parts : its stretches
    rest : the program's lines that may move the arm otherwise: on other ways, after the last, or not understood

    Raises
    ------
    InputError
        for a program that does not move the arm, or whose tool is not the robot's
    """
    groups: list[list[tuple[Place, CheckedMotion]]] = []
    kept: set[int | None] = set()  # steps
    rest, joined = _moving(check), True
    for number in check.main:
        step, motion = check.execution.steps[number], check.motions.get(number)
        if motion is None or motion.stays or motion.start is None:
            leads_on = not _may_move(step.instruction) if motion is None else motion.stays
            joined = joined and leads_on
            continue
        if motion.way is None or motion.placed.motion.angle is not None or _turns_with_path(motion):
            break
        line = step.place.line
        if motion.kind != "joint" and not np.allclose(motion.placed.arm.tool, robot.tool, rtol=0, atol=1e-12):
            problem = f"line {line} moves another tool than the robot's"
            raise source.error("program", problem, "Give the robot this tool in its file or in the study")
        if groups and joined and _goes_on(groups[-1][-1][1], motion):
            groups[-1].append((step.place, motion))
        else:
            groups.append([(step.place, motion)])
        joined = True
        kept.add(number)
        rest.pop(_same_for(check, number), None)
        if motion.end is None:
            break
    if not groups:
        raise InputError(source.file, f"{source.field}.program", "no motion has a known start", "Give start_deg")
    found = [each for each in check.findings if found_in.RANKS[each.level] >= found_in.RANKS["caution"]]
    found = [replace(each, joint_moves=()) for each in found if not _is_of_path(each, kept)]
    whose = [{place for place, _ in group} for group in groups]
    parts = [
        replace(
            _part([(place.line, motion) for place, motion in group]),
            found=tuple(each for each in found if each.place in own or not any(each.place in other for other in whose)),
        )
        for group, own in zip(groups, whose)
    ]
    return parts, tuple(sorted({*rest.values()} - {0}))


def _is_of_path(found: LocatedFinding, kept: set[int | None]) -> bool:
    """Whether a check of the path that these steps make finds the same."""
    of_pairs = isinstance(found.finding, PairsUnexamined)
    return found.finding.code in FOUND_OF_PATHS and (of_pairs or found.step in kept)


def _turns_with_path(checked: CheckedMotion) -> bool:
    """Whether an arc turns the tool otherwise than that of a path, which turns it about one axis."""
    way = checked.way.tool_path if checked.way else None
    via, base = checked.placed.motion.via, checked.placed.base
    if not isinstance(way, ArcWithPath) or not isinstance(via, PoseTarget) or base is None:
        return False
    start, end = way.poses(np.array([0.0, 1.0]))
    return turns_apart(start, base @ via.pose, end) > SAME_TURN


def _may_move(instruction: object) -> bool:
    return isinstance(instruction, Unknown) and instruction.may_move


def _goes_on(before: CheckedMotion, motion: CheckedMotion) -> bool:
    """Whether a motion belongs to the stretch of the one before."""
    assert before.end is not None
    assert motion.start is not None
    same_place = np.allclose(before.end, motion.start, rtol=0, atol=SAME_PLACE)
    loads = before.placed.motion.load, motion.placed.motion.load
    return bool(same_place and (before.kind == "joint") == (motion.kind == "joint") and loads[0] == loads[1])


def _moving(check: ProgramCheck) -> dict[Hashable, int]:
    """Lines of all that moves the arm, or may, or was not followed; motions that are alike are one."""
    execution = check.execution
    found: dict[Hashable, int] = {
        _same_for(check, number): execution.own_line(execution.steps[number])
        for number, motion in check.motions.items()
        if not motion.stays
    }
    for step in execution.steps:
        if _may_move(step.instruction):
            found[step.place] = execution.own_line(step)
    lines = {step.place: execution.own_line(step) for step in execution.steps}
    missed = (each for each in check.not_examined if each.what in ("motion", "course"))
    return found | {each: lines.get(each.place, each.place.line) for each in missed}


def _same_for(check: ProgramCheck, number: int) -> Hashable:
    """A key that is equal for motions of one instruction between the same joints."""
    motion = check.motions[number]
    ends = (None if q is None else q.tobytes() for q in (motion.start, motion.end))
    return check.execution.steps[number].place, *ends


def _part(group: list[tuple[int, CheckedMotion]]) -> ProgramPart:
    lines = (group[0][0], group[-1][0])
    motions = [motion for _, motion in group]
    ways = [motion.way for motion in motions if motion.way is not None]
    start = motions[0].start
    assert start is not None
    if motions[0].kind == "joint":
        points = np.stack([start, *(motion.end for motion in motions if motion.end is not None)])
        joint_moves = JointSequenceCommand(points, 0.0, _leg_times(ways, [0.0] * len(ways)))
        return ProgramPart("joint_sequence", lines, joint_moves, motions[0].placed.motion.load)
    blends = [_blend(one, other) for one, other in pairwise(motions)] + [0.0]
    segments = tuple(_segment(motion, blend) for motion, blend in zip(motions, blends))
    command = ToolSequenceCommand(Start(joints=start), segments, _leg_times(ways, blends))
    return ProgramPart("sequence", lines, command, motions[0].placed.motion.load)


def _leg_times(ways: list[MotionPath], blends: list[float]) -> LegTimes:
    """How long the motions take, as checked, without the ramps that rounded corners (m, at the ends) save."""
    rounded = [False, *(blend > 0 for blend in blends)]
    laws = [way.law for way in ways]
    times = [law.duration - sum(ends) * law.saved_by_blend for law, ends in zip(laws, pairwise(rounded))]
    return LegTimes(np.array(times), np.array([law.ramp * law.duration for law in laws]))


SAME_PACE = 0.01


def _blend(motion: CheckedMotion, after: CheckedMotion) -> float:
    """m, over which the corner between two motions is rounded: a stop if it is none of this size, or the speed changes,
    since between stops a path has one speed."""
    zone = motion.placed.motion.zone
    known = [way for way in (motion.way, after.way) if way is not None]
    if zone.kind != "distance" or len(known) < 2:
        return 0.0
    paces = [_size(way) / (way.law.duration * (1 - way.law.ramp)) for way in known]
    if not _same_speed(motion, after) and abs(paces[0] - paces[1]) > SAME_PACE * max(paces):
        return 0.0
    return min(zone.value, *(MAX_MOTION_SHARE * way.length for way in known))


def _same_speed(motion: CheckedMotion, after: CheckedMotion) -> bool:
    """Whether two motions are to have one speed, though one may be too short to come to it."""
    said = [(each.speed, each.turn_speed, each.turning) for each in (motion.placed.motion, after.placed.motion)]
    speed, turn_speed, turning = said[0]
    turns = turn_speed is not None or turning != (None, None)  # has a speed of its own, which may decide
    return said[0] == said[1] and not turns and (speed is None or speed.unit != "s")


def _size(way: MotionPath) -> float:
    return max(way.length, TURN_LENGTH * way.turned)


def _segment(checked: CheckedMotion, blend: float) -> SegmentCommand:
    """The motion's end and point, in the frame that the robot's base is placed in."""
    motion, base = checked.placed.motion, checked.placed.base
    via: Reals | None = None
    if motion.kind == "arc" and isinstance(motion.via, PoseTarget) and base is not None:
        via = (base @ motion.via.pose)[:3, 3]
    if isinstance(motion.target, PoseTarget) and base is not None:
        return SegmentCommand(base @ motion.target.pose, via, blend=blend)
    assert checked.end is not None
    return SegmentCommand(forward(checked.placed.arm, checked.end), via, blend=blend)
