"""Commands for robot programs: check-program, program write."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from er3a.errors import Er3aError
from er3a.finding import is_one
from er3a.numerics.arrays import Reals
from er3a.pipeline.commands.options import AsJson, FailOn, app, given_files, print_json, print_note
from er3a.programs.program_names import LanguageName
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

if TYPE_CHECKING:
    from er3a.pipeline.program_reports import CheckedFile

ProgramFiles = Annotated[
    list[Path],
    typer.Argument(
        callback=given_files,
        help="robot programs (the language is detected)",
    ),
]
RobotOption = Annotated[str, typer.Option("--robot", help="a robot's name or file")]
StartOption = Annotated[
    str | None,
    typer.Option(help="joint values before the program, deg or mm: 0,-10,... (deg at the end confirms small ones)"),
]
FramesFile = Annotated[
    Path | None,
    typer.Option(callback=given_files, help="a file of kind programs: the frames of TOOL_DATA[3] and other names"),
]
SceneFile = Annotated[Path | None, typer.Option(callback=given_files, help="a scene file: the obstacles")]

Assumed = Annotated[
    list[str] | None,
    typer.Option(help="what is not in the files: calls that move nothing (rq_*), or values (NAME=1)"),
]
BaselineFile = Annotated[
    Path | None, typer.Option(callback=given_files, help="a SARIF file: its findings are accepted")
]

Verdicts = Annotated[bool, typer.Option("--verdicts", help="print a line for each motion, also for those that pass")]
Seconds = Annotated[
    float,
    typer.Option(help="time to read each file, and then to prove clearance between points of its motions", min=1),
]


@app.command()
def check_program(
    files: ProgramFiles,
    *,
    robot: RobotOption,
    start: StartOption = None,
    frames: FramesFile = None,
    scene: SceneFile = None,
    assume: Assumed = None,
    require: Annotated[str, typer.Option(help="checks without which nothing passes: scene,tool")] = "",
    every: Annotated[bool, typer.Option("--all", help="print each finding by itself, notes too")] = False,
    verdicts: Verdicts = False,
    sarif: Annotated[Path | None, typer.Option(help="write the findings as SARIF 2.1.0 to this file")] = None,
    baseline: BaselineFile = None,
    seconds: Seconds = 30.0,
    fail_on: Annotated[FailOn, typer.Option(help="exit code 1 for findings of this level or worse")] = FailOn.fail,
    as_json: AsJson = False,
):
    """Check each motion of robot programs. Findings are lines: file:line: level: message \\[code]."""
    from er3a.files.program_file import load_programs
    from er3a.files.robot_library import load_robot
    from er3a.files.scene_file import load_scene
    from er3a.files.units import noted_doubts
    from er3a.pipeline.program_reports import checked_file, json_of, sarif_of, without
    from er3a.pipeline.progress import shown_work, time_left
    from er3a.pipeline.sarif import accepted
    from er3a.program_check.check_program import CheckOptions
    from er3a.program_check.program_check_findings import RANKS
    from er3a.programs.execution import RunLimits

    with noted_doubts() as doubts:
        arm = load_robot(robot)
        names, values = _assumed(assume or [])
        options = CheckOptions(
            start=_joints(start, arm),
            frames=load_programs(frames).transforms() if frames else {},
            scene=load_scene(scene) if scene else None,
            limits=RunLimits(assumed=names, assumed_values=values),
        )
    silenced = accepted(baseline) if baseline else frozenset()
    checked = []
    with shown_work("reading") as at:
        for file in files:
            at(f"{file}: checking")
            own = replace(options, keep_on=time_left(seconds))
            found = checked_file(file, arm, own, doubts, seconds)
            checked.append(without(found, silenced))
    if sarif is not None:
        _write(sarif, json.dumps(sarif_of(checked), indent=1, ensure_ascii=False, allow_nan=False) + "\n")
    required = [each for each in require.split(",") if each]
    if as_json:
        print_json(json_of(checked))
    else:
        _print_checked(checked, arm, every, verdicts)
    if any(each.check is None for each in checked):
        raise typer.Exit(2)
    if any(RANKS[each.level] >= RANKS[fail_on.value] or each.lacks(required) for each in checked):
        raise typer.Exit(1)


def _print_checked(checked: Sequence[CheckedFile], arm: Robot, every: bool, verdicts: bool) -> None:
    """Print findings to standard output, and what holds for all motions to standard error."""
    from er3a.pipeline.program_reports import cycle_line, lines_of, missed_line, scope_line, shapes_line

    for each in checked:
        for line in filter(None, (scope_line(each), *lines_of(each, every, verdicts))):
            print(line)
    missed = tuple(dict.fromkeys(left for each in checked for left in each.missed))
    for line in filter(None, (*map(cycle_line, checked), shapes_line(arm), missed_line(missed))):
        print_note(line)


def _assumed(given: list[str]) -> tuple[tuple[str, ...], dict[str, bool | float]]:
    """Names of calls that move nothing, and values of variables, of what is assumed."""
    values: dict[str, bool | float] = {}
    for text in given:
        name, mark, value = text.partition("=")
        if mark and value.lower() in ("true", "false"):
            values[name] = value.lower() == "true"
        elif mark:
            try:
                values[name] = int(value) if value.lstrip("-").isdigit() else float(value)
            except ValueError:
                raise Er3aError(f"--assume is '{text}'; expected NAME=NUMBER, NAME=TRUE or a call's name") from None
    return tuple(text for text in given if "=" not in text), values


program_app = typer.Typer(help="Write robot programs from paths.", no_args_is_help=True)
app.add_typer(program_app, name="program")


@program_app.command()
def write(
    paths: Annotated[Path, typer.Argument(callback=given_files, help="a path file")],
    *,
    robot: RobotOption,
    language: Annotated[LanguageName, typer.Option(help="the program language, or csv for a table over time")],
    output: Annotated[Path, typer.Option(help="folder for the programs")] = Path("programs"),
    only: Annotated[list[str] | None, typer.Option(help="name of a path; can be repeated (default: all)")] = None,
    scene: SceneFile = None,
    unsafe: Annotated[
        bool, typer.Option("--unsafe", help="also write paths that are not safe, with a warning in the file")
    ] = False,
):
    """Write the paths of a file as programs. Exit code 1 if a path is not safe (refused), or if a motion or a
    given speed is lost."""
    from er3a.files.robot_library import load_robot
    from er3a.files.scene_file import load_scene
    from er3a.files.units import noted_doubts
    from er3a.pipeline.messages.expectations import outcome_word
    from er3a.pipeline.path_programs import programs_of
    from er3a.pipeline.program_reports import missed_checks, missed_line, shapes_line
    from er3a.pipeline.progress import shown_work
    from er3a.pipeline.scope import by_reason
    from er3a.pipeline.stages.covered import assumed_tool, covered_units, gaps_of_program
    from er3a.pipeline.viewing.conditions import program_head
    from er3a.programs.writing import head_line, with_head_lines

    with noted_doubts() as doubts, shown_work(f"{paths}: checking each path"):
        arm, around = load_robot(robot), load_scene(scene) if scene else None
        programs = list(programs_of(paths, arm, language, around, only, unsafe))
    refused, alone = 0, (*gaps_of_program(arm, around), *covered_units(1, doubts).gaps)
    head = program_head(None, missed_checks(alone), assumed_tool(arm))
    for made in programs:
        if made.files is None:
            refused += 1
            unsettled = made.verdict == "safe"  # what is left out is said at the end
            why = "a program may move elsewhere than what was checked" if unsettled else "it is not safe: "
            print_note(f"{made.name}: not written, because {why}{'' if unsettled else outcome_word(made.verdict)}")
            continue
        for name, text in made.files.items():
            file = output / name
            _write(file, with_head_lines(text, head))
            print(f"{file}: written")
        for finding in made.findings:
            print_note(f"{made.name}: {head_line(finding)}")
        refused += bool(made.open) or any(is_one(finding, "written_targets_left_out") for finding in made.findings)
    missed = by_reason(each for made in programs for each in made.open)
    for line in filter(None, (shapes_line(arm), missed_line((*alone, *missed)))):
        print_note(line)
    if refused:
        raise typer.Exit(1)


def _write(file: Path, text: str) -> None:
    from er3a.files.kept_files import write_text

    write_text(file, text)


def _joints(text: str | None, robot: Robot) -> Reals | None:
    """Joint values (n,) in rad or m from a list in degrees, mm of prismatic joints; a "deg" at its end confirms small
    ones, which look like radians."""
    from er3a.files.units import doubt_degrees

    if text is None:
        return None
    try:
        found = [float(part) for part in text.removesuffix("deg").replace(",", " ").split()]
    except ValueError:
        found = []
    if len(found) != len(robot.lower) or not np.isfinite(found).all():
        count = len(robot.lower)
        raise Er3aError(
            f"--start is '{text}'; expected {count} joint values (deg; mm of a slide), such as {','.join('0' * count)}"
        )
    if not text.endswith("deg"):
        doubt_degrees(found, key="--start")
    return meant(robot, np.array(found))
