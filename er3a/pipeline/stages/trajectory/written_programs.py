"""Robot programs of a path: written if the path is safe, otherwise refused with the reason."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from er3a.collision.shapes import shapes_assumed
from er3a.finding import Finding, fact, is_one
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.stages.trajectory.model import AvoidanceRows, MinClearance, ProgramFiles
from er3a.pipeline.stages.trajectory.motion import Motion, PartOfProgram, at_lines, missed_points, rows_missed
from er3a.planning.commands import (
    CommandSource,
    JointTableCommand,
    PlanCommand,
    ToolMoveCommand,
)
from er3a.planning.moves import JointMove
from er3a.planning.names import PathVerdict
from er3a.planning.profiles import Times
from er3a.planning.stated_rates import StatedMotion
from er3a.programs.from_commands import listing_of
from er3a.programs.languages import not_written, write_program
from er3a.programs.motion_table import write_csv
from er3a.programs.program_names import LanguageName
from er3a.programs.writing import HEAD, WriteOptions, ascii_text, head_line, program_name
from er3a.robots.joint_limits import joint_columns, meant, shown
from er3a.robots.robot import Robot

LONGEST_NAME = 24
REPAIRED = "_repaired"
STRAIGHT = 1e-4  # rad or m: by how much joints that move straight between written points may be off a motion


def written(
    robot: Robot,
    motion: Motion,
    verdict: PathVerdict,
    language: LanguageName,
    near: tuple[Finding, ...],
    speed: Reals,
) -> tuple[Mapping[str, str], tuple[Finding, ...]]:
    """The files of a path by suffix, and what is to be said of them; ``near`` as of :func:`near_assumed_shapes`.

    ``speed``: (n,), the joints' greatest, rad/s or m/s.

    Raises
    ------
    ValueError
        for a path whose start can't be reached
    InputError
        for a controller's language that has other joints than this arm
    """
    start = motion.q[0]
    if not np.isfinite(start).all():
        raise ValueError(f"{motion.entry.name}: the start can't be reached")
    unsafe: tuple[Finding, ...] = (
        near if verdict == "safe" else (fact("written_unsafe", path=motion.entry.name, verdict=verdict),)
    )
    head = (
        f"path {motion.entry.name} for {ascii_text(robot.title)}: {ascii_text(motion.entry.title)}",
        *_of_its_program(motion),
    )
    if language == "csv":
        times = motion.samples
        joints = motion.joints(times)
        known = np.isfinite(joints[:, 0])
        return _table(robot, times[known], joints[known], (*head, *map(head_line, unsafe))), unsafe
    command = motion.entry.command(CommandSource(), robot)
    if isinstance(command, PlanCommand):  # a planned motion is written as the points that its samples are
        timing = Times(motion.samples, np.arange(len(motion.samples)))
        command = JointTableCommand(motion.joints(motion.samples), timing)
    elif isinstance(motion.built.joints, JointMove | StatedMotion):  # rates at its points may bend its way
        times = np.union1d(motion.samples, motion.curve.times)
        kept = needed_points(motion.joints(times), STRAIGHT)
        if len(kept) > 2:
            command = JointTableCommand(motion.joints(times[kept]), Times(times[kept], np.arange(len(kept))))
    ends: Reals | None = motion.q[-1:] if isinstance(command, ToolMoveCommand) else None
    if ends is not None and not np.isfinite(ends).all():
        ends = None
    load = motion.entry.part.load if isinstance(motion.entry, PartOfProgram) else None
    made = listing_of(command, robot, start, motion.entry.name, ends=ends, load=load)
    missed = missed_points(robot, motion.built)
    beside = (fact("written_beside_points", path=motion.entry.name, missed=missed),) if missed else ()
    options = WriteOptions(robot, start, notes=(*unsafe, *beside, *made.findings), head=head, assumed_speed=speed)
    program = write_program(made.listing, language, options)
    return program.files, program.findings


def _table(robot: Robot, t: Reals, q: Reals, head: Sequence[str]) -> Mapping[str, str]:
    """A motion over time as a table, by suffix: joints (N, n) and poses at times (N,), s, below its head."""
    poses = np.linalg.inv(robot.base) @ forward(robot, q)
    return {".csv": write_csv(t, shown(robot, q), poses, tuple(HEAD + line for line in head), joint_columns(robot))}


def _of_its_program(motion: Motion) -> list[str]:
    """What was found in the program that a path is of, and the path does not show."""
    found = at_lines(motion.entry) if isinstance(motion.entry, PartOfProgram) else []
    return [f"check-program says of the program that this path is of: {ascii_text(each)}" for each in found]


def near_assumed_shapes(robot: Robot, name: str, clearance: MinClearance | None, margin: float) -> tuple[Finding, ...]:
    """The finding that a path passes close to assumed shapes, for the head of its programs.

    Parameters
    ----------
    name : of the path
    clearance : its smallest; None where nothing was measured
    margin : m, within which nothing is settled

    Returns
    -------
    findings : one, or none if the path keeps the margin or the shapes are given
    """
    if clearance is None or not (shapes := shapes_assumed(robot, margin, {name: clearance.least_mm / 1000})):
        return ()
    return (
        (fact("written_near_assumed", path=name, clearance_mm=clearance.least_mm, margin_mm=1000 * margin),)
        if shapes.near
        else ()
    )


def repair_name(path: str) -> str:
    """Name of the program that holds the motion which repairs a path.

    Parameters
    ----------
    path : the path's name

    Returns
    -------
    name : of ``LONGEST_NAME`` letters at most
    """
    return program_name(path, LONGEST_NAME - len(REPAIRED)) + REPAIRED


def program_files(
    robot: Robot,
    motion: Motion,
    verdict: PathVerdict,
    languages: Sequence[LanguageName],
    write_unsafe: bool,
    *,
    near: tuple[Finding, ...],
    repaired: AvoidanceRows,
    speed: Reals,
) -> ProgramFiles:
    """The programs of a path and of the motion that repairs it.

    Parameters
    ----------
    verdict : programs of a path that is not safe are refused unless ``write_unsafe``
    languages : those that can't hold this arm's joints, or round corners nobody asked for, are left out
    near : as of :func:`near_assumed_shapes`
    repaired : rows of the motion that repairs the path; none if there is none
    speed : (n,), rad/s or m/s, in place of greatest joint speeds that nobody states

    Returns
    -------
    rows : one for each file
    """
    rows: list[tuple[str, str, str, str]] = []
    name = program_name(motion.entry.name, LONGEST_NAME)
    allowed = verdict == "safe" or (write_unsafe and np.isfinite(motion.q[0]).all())
    elsewhere = () if write_unsafe or not rows_missed(robot, motion.built) else set(languages) - {"csv"}
    for language in languages if allowed else ():
        if language in elsewhere or not_written(language, robot):
            continue
        files, said = written(robot, motion, verdict, language, near, speed)
        rows += [(language, name + suffix, text, _assumed(said)) for suffix, text in files.items()]
    for language in languages if len(repaired) else ():
        if not not_written(language, robot):
            files, said = _repair(robot, motion, repaired, language, speed)
            own = repair_name(motion.entry.name)
            rows += [(language, own + suffix, text, _assumed(said)) for suffix, text in files.items()]
    return ProgramFiles.of_rows((motion.entry.name, *row) for row in rows)


def _assumed(findings: tuple[Finding, ...]) -> str:
    return next((each.assumed for each in findings if is_one(each, "written_speeds_of_assumed")), "")


def _repair(
    robot: Robot, motion: Motion, rows: AvoidanceRows, language: LanguageName, speed: Reals
) -> tuple[Mapping[str, str], tuple[Finding, ...]]:
    """The motion that repairs a path by suffix: all rows with their times as a table, else as joint moves."""
    comment = f"path {motion.entry.name} for {ascii_text(robot.title)}, repaired: {rows.strategy[0]}"
    head, q = (comment, *_of_its_program(motion)), meant(robot, rows.q_deg)
    if language == "csv":
        return _table(robot, rows.t_s, q, head), ()
    kept = needed_points(q, STRAIGHT)
    command = JointTableCommand(q[kept], Times(rows.t_s[kept], np.arange(len(kept))))
    made = listing_of(command, robot, q[0], repair_name(motion.entry.name))
    within = f"joint moves between points of the checked motion, within {np.degrees(STRAIGHT):.3f} deg of it"
    options = WriteOptions(robot, q[0], notes=made.findings, head=(*head, within), assumed_speed=speed)
    program = write_program(made.listing, language, options)
    return program.files, program.findings


def needed_points(q: Reals, tolerance: float) -> Integers:
    """Rows of a motion between which straight joint moves stay near all others; the first and the last among them.

    Parameters
    ----------
    q : (N, n), rad or m, N at least 2; tolerance : of each joint, rad or m
    """
    kept, spans = {0, len(q) - 1}, [(0, len(q) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        chord = q[last] - q[first]
        between = q[first + 1 : last] - q[first]
        square = float(chord @ chord)
        along = np.clip(between @ chord / square, 0.0, 1.0) if square else np.zeros(len(between))
        off = np.abs(between - along[:, None] * chord).max(axis=1)
        if off.max() > tolerance:
            worst = first + 1 + int(off.argmax())
            kept.add(worst)
            spans += [(first, worst), (worst, last)]
    return np.array(sorted(kept))
