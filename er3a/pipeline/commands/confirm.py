"""``er3a confirm``: does a model agree with its controller?"""

from __future__ import annotations

import shlex
import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from er3a.errors import Er3aError, InputError
from er3a.files.kept_files import names, write_text
from er3a.pipeline.commands.options import AsJson, Base, Tip, app, print_json, print_note

if TYPE_CHECKING:
    from er3a.confirmation.confirm import Confirmation
    from er3a.confirmation.plan import Plan
    from er3a.robots.robot import Robot

MAX_LETTERS = 50_000_000


class Expected(StrEnum):
    """What may be between model and controller without an exit code of 1."""

    frames = "frames"
    small = "small"


@app.command()
def confirm(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="a robot's name or file, a D-H table or a URDF")],
    poses: Annotated[
        str, typer.Argument(metavar="POSES", help="joint values and poses of the controller; - for standard input")
    ] = "",
    *,
    angles: Annotated[
        str | None, typer.Option(help="form of orientations: abc | rpy | zyz | xyz | rotation_vector")
    ] = None,
    units: Annotated[str | None, typer.Option(help="unit of positions: mm | m | cm | in")] = None,
    expect: Annotated[
        list[Expected] | None, typer.Option(help="what may differ: a base or tool, a factory's calibration")
    ] = None,
    output: Annotated[
        Path | None, typer.Option(help="write the corrected robot file (.yaml); of a plan, the table to fill (.csv)")
    ] = None,
    plan: Annotated[bool, typer.Option("--plan", help="print five poses to read at the pendant")] = False,
    programs: Annotated[Path | None, typer.Option(help="of a plan: a folder for programs that move there")] = None,
    html: Annotated[Path | None, typer.Option(help="write the answer as a page")] = None,
    every: Annotated[bool, typer.Option("--all", help="list each pose")] = False,
    base: Base = None,
    tip: Tip = None,
    as_json: AsJson = False,
):
    """Does the model agree with the controller? Compares joint values and poses as the pendant shows them.

    If not, the least that explains it is named: another reading of the file, a base or tool, a joint's zero or sense, a
    factory's calibration, another arm. Exit code 1 if anything is between model and controller that is not expected.
    """
    from er3a.files.robot_library import read_arm

    read = read_arm(robot, base=base, tip=tip)
    for note in read.notes:
        print_note(note)
    if plan:
        _print_plan(read.robot, output, programs)
        return
    if not poses:
        raise Er3aError("give a file of poses, or --plan for poses to read at the pendant")
    found = _confirmed(read.robot, poses, angles, units)
    nearest = _nearest(found.corrected, read.robot.name) if "another" in found.layers else ""
    _print_found(found, (robot, nearest), every=every, as_json=as_json)
    if output is not None:
        _write(found, output)
        if not as_json:
            print(f"{output}: written")
    if html is not None:
        from er3a.pipeline.viewing.confirmation import write_confirmation

        files = [Path(each) for each in (robot, poses) if Path(each).is_file()]
        command = shlex.join(["er3a", "confirm", robot, poses, "--html", str(html)])
        write_confirmation(read.robot, found, html, nearest=nearest, command=command, files=files)
        if not as_json:
            print(f"{html}: written")
    if found.verdict == "open" or not set(found.layers) <= {each.value for each in expect or ()}:
        raise typer.Exit(1)


def _confirmed(robot: Robot, poses: str, angles: str | None, units: str | None) -> Confirmation:
    from er3a.confirmation.confirm import confirm as confirm_robot
    from er3a.confirmation.poses import read_pairs

    text = sys.stdin.read(MAX_LETTERS) if poses == "-" else None
    source = "standard input" if poses == "-" else poses
    return confirm_robot(robot, read_pairs(source, robot, text, angles=angles, units=units))


def _print_found(found: Confirmation, named: tuple[str, str], *, every: bool, as_json: bool) -> None:
    """Print an answer; ``named``: the robot as it was given, and the arm that the corrected table is."""
    from er3a.pipeline.messages.confirm import confirmation_record, lines_of

    if as_json:
        print_json(confirmation_record(found, *named))
    else:
        print("\n".join(lines_of(found, nearest=named[1], every=every)))


def _nearest(corrected: Robot, own: str) -> str:
    """The arm among er3a's robots and its catalogue that a corrected table is."""
    from er3a.comparison.compare import best_of
    from er3a.comparison.nearest import likely
    from er3a.files.arm_catalogue import known_arms
    from er3a.files.robot_library import load_robot

    arms = {name: arm.robot for name, arm in known_arms().items()}
    arms |= {name: load_robot(name) for name in names("data/robots", "*.yaml")}
    arms.pop(own, None)
    ranked = best_of(corrected, {each: arms[each] for each in likely(corrected, arms)})
    return next((name for name, found in ranked[:1] if found.verdict in ("equal", "same_arm")), "")


def _write(found: Confirmation, output: Path) -> None:
    from er3a.files.robot_writer import write_robot

    if output.suffix not in (".yaml", ".yml"):
        raise InputError(output, "--output", "a robot file ends in .yaml", "Name it so")
    write_robot(found.corrected.replace(name=output.stem), output)


def _print_plan(robot: Robot, output: Path | None, programs: Path | None) -> None:
    from er3a.confirmation.plan import plan
    from er3a.pipeline.messages.confirm import plan_lines, table_to_fill

    found = plan(robot)
    print("\n".join(plan_lines(found, robot)))
    if output is not None:
        text = table_to_fill(found, robot)
        write_text(output, text)
        print(f"{output}: written; fill it in, then: er3a confirm {robot.name} {output}")
    if programs is not None:
        for path in _write_programs(found, robot, programs):
            print(f"{path}: written")


def _write_programs(found: Plan, robot: Robot, folder: Path) -> list[Path]:
    """A program in each language that has a writer and takes this arm: joint moves at a tenth of the speed."""
    from er3a.programs.instructions import ArmMotion, JointTarget, Listing, Pause, Rate
    from er3a.programs.languages import LANGUAGES, not_written, write_program
    from er3a.programs.writing import WriteOptions

    steps: list[ArmMotion | Pause] = []
    for q in found.q:
        steps += [ArmMotion("joint", JointTarget(q), speed=Rate(0.1, "share")), Pause()]
    listing, written = Listing("confirm", tuple(steps)), []
    folder.mkdir(parents=True, exist_ok=True)
    for name, language in LANGUAGES.items():
        if language.writer is None or not_written(name, robot):
            continue
        for suffix, text in write_program(listing, name, WriteOptions(robot, found.q[0])).files.items():
            written.append(folder / f"confirm{suffix}")
            write_text(written[-1], text)
    return written
