"""Commands for robot files: URDF import and export, calibration, hand-eye."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from er3a.errors import Er3aError, InputError
from er3a.files.robot_file import NAME_PATTERN
from er3a.pipeline.commands import options
from er3a.pipeline.language import LANGUAGES, using
from er3a.pipeline.progress import shown_work

if TYPE_CHECKING:
    from er3a.calibration.calibrate import Calibration
    from er3a.calibration.observations import Measurement
    from er3a.robots.robot import Robot


class FixedPlacement(StrEnum):
    """What a calibration keeps as the robot file has it."""

    BASE = "base"
    TOOL = "tool"
    RATIOS = "ratios"


@options.app.command()
def import_urdf(
    file: Annotated[Path, typer.Argument(help="a URDF or xacro of a serial arm")],
    output: Annotated[Path, typer.Option(help="the robot file to write")],
    *,
    base: options.Base = None,
    tip: options.Tip = None,
    snap: Annotated[bool, typer.Option(help="take rounded angles (1.571) as the multiples of 45 deg meant")] = True,
    xacro: options.Xacro = None,
    srdf: options.Srdf = None,
    as_json: options.AsJson = False,
):
    """Write a robot file (D-H table, directions, offsets, limits) from a URDF."""
    from er3a.files.robot_writer import write_robot
    from er3a.formats.urdf import import_urdf as read_urdf
    from er3a.robots.robot import robot_name

    with shown_work(f"{file}: reading the arm"):
        imported = read_urdf(file, base=base, tip=tip, snap=snap, xacro=xacro or (), srdf=srdf)
    name = robot_name(output)
    output = output.with_name(f"{name}.yaml") if re.fullmatch(NAME_PATTERN, output.stem) is None else output
    write_robot(imported.robot.replace(name=output.stem), output)
    for note in imported.notes:
        options.print_note(note)
    if as_json:
        options.print_json({"output": str(output), "misfit_mm": imported.misfit_m * 1000, "notes": imported.notes})
        return
    print(f"{output}: written; differs from the URDF by at most {imported.misfit_m * 1000:.2g} mm on random poses")


@options.app.command()
def export_urdf(
    robot: options.AnyRobot,
    output: Annotated[Path, typer.Option(help="the URDF to write")],
    srdf: Annotated[
        Path | None, typer.Option(help="also write an SRDF for MoveIt: the pairs of links not to check")
    ] = None,
):
    """Write a robot as URDF."""
    from er3a.files.kept_files import write_text
    from er3a.files.robot_library import load_robot
    from er3a.formats.urdf import assumed_pairs, export_srdf, pairs_not_checked
    from er3a.formats.urdf import export_urdf as urdf_text

    arm = load_robot(robot)
    texts = {output: urdf_text(arm, output.with_name(f"{output.stem}_meshes"))}
    if srdf is not None:
        texts[srdf] = export_srdf(arm)
        if rests := assumed_pairs(arm):
            options.print_note(f"{srdf}: {rests}")
        for pair in pairs_not_checked(arm):
            options.print_note(f"{srdf}: {pair} overlap where no arm can; their shapes are in error, not checked")
    if arm.combined:
        options.print_note(f"{output}: limits on sums of joints are left out, as a URDF has no place for them")
    for file, text in texts.items():
        write_text(file, text)
        print(f"{file}: written")


@options.app.command()
def import_calibration(
    file: Annotated[
        Path, typer.Argument(help="calibration.conf of a Universal Robots arm, or the YAML of extract_calibration")
    ],
    robot: Annotated[str, typer.Option(help="the arm's nominal table: a robot's name or file")],
    output: Annotated[Path, typer.Option(help="the robot file to write")],
):
    """Write a robot file from a factory calibration; huge d values that cancel become Hayati parameters."""
    from er3a.files.factory_calibration import load_factory_calibration
    from er3a.files.robot_library import load_robot
    from er3a.files.robot_writer import write_robot

    nominal = load_robot(robot)
    found = load_factory_calibration(file, nominal)
    if nominal.envelopes or nominal.hulls or nominal.meshes or nominal.references or nominal.masses != found.masses:
        options.print_note(f"{output}: without shapes, masses and references of {robot}: they belong to its own table")
    write_robot(found.replace(name=output.stem, title=f"{found.title}, as calibrated by its factory"), output)
    print(f"{output}: written")


def _check_options(output: Path | None, words: str) -> None:
    """Before the long work begins: a language, a name for a robot."""
    if words not in LANGUAGES:
        raise Er3aError(f"--language is '{words}'; known: {', '.join(LANGUAGES)}")
    if output and not re.fullmatch(NAME_PATTERN, output.stem):
        problem = f"'{output.stem}' can't be a robot's name"
        raise InputError(output, "--output", problem, "Use a to z, 0 to 9, - and _, 64 at most, as in mine.yaml")


def _measured(path: Path, arm: Robot) -> Sequence[Measurement]:
    """Measured positions; of another table than er3a's own, the controller's poses in it, with orientations."""
    from er3a.calibration.observations import Measurement
    from er3a.confirmation.poses import read_pairs
    from er3a.confirmation.screen import likeliest_form
    from er3a.files.by_name import load_measurements
    from er3a.files.csv_file import read_header
    from er3a.files.units import JOINT_COLUMN
    from er3a.references.quantities import MM
    from er3a.robots.joint_limits import shown

    rows: Sequence[Measurement]
    header = read_header(path)
    if "point" in header and any(map(JOINT_COLUMN.fullmatch, header)):
        rows = load_measurements(path, arm)
    else:
        pairs = read_pairs(path, arm)
        values = zip(pairs.lines.tolist(), shown(arm, pairs.q).tolist(), (MM * pairs.xyz).tolist())
        rows = [Measurement(line, tuple(q), "tool", (xyz[0], xyz[1], xyz[2])) for line, q, xyz in values]
        if pairs.turns:
            turns = pairs.turns[likeliest_form(arm, pairs)].tolist()
            rows = [replace(row, turn=R) for row, R in zip(rows, turns)]
    return rows


def _explained(path: Path, arm: Robot, rows: Sequence[Measurement]) -> list[str]:
    """What is between the arm and measurements that don't fit, as ``er3a confirm`` has it; nothing of touches."""
    from er3a.confirmation.confirm import confirm
    from er3a.pipeline.messages.confirm import lines_of

    seen = arm.without_tool() if rows[0].point == "flange" else arm
    with suppress(Er3aError):
        return lines_of(confirm(seen, path))
    return []


def _renamed(found: Calibration, name: str) -> Robot:
    """The corrected robot as it is written."""
    alone = " (without terms beyond a robot file)" if found.beyond else ""
    return found.robot.replace(name=name, title=f"{found.robot.title}, calibrated{alone}")


def _write_calibrated(corrected: Robot, record: dict[str, object], output: Path) -> Path:
    """Write the robot file, and beside it the whole model, whose path is returned."""
    from er3a.files.kept_files import write_text
    from er3a.files.robot_writer import write_robot

    write_robot(corrected, output)
    model = output.with_name(f"{output.stem}_model.json")
    write_text(model, options.as_json_text(record) + "\n")
    return model


@options.app.command()
def calibrate(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="a robot's name or file: the table to start from")],
    measurements: Annotated[Path, typer.Argument(help="a CSV of measured positions")],
    *,
    output: Annotated[
        Path | None, typer.Option(help="the robot file to write, and NAME_model.json with all terms (default: none)")
    ] = None,
    fixed: Annotated[
        list[FixedPlacement] | None, typer.Option(help="values of the robot file to keep; can be repeated")
    ] = None,
    held_back: Annotated[Path | None, typer.Option(help="a CSV of positions to test the result, not to fit")] = None,
    html: Annotated[Path | None, typer.Option(help="also write a page")] = None,
    words: Annotated[str, typer.Option("--language", help=f"language of the page: {' | '.join(LANGUAGES)}")] = "en",
    as_json: options.AsJson = False,
):
    """Estimate corrections to a robot's table, base and tool from measured positions; write the corrected robot file.

    Joint errors beyond D-H (ratio, once and twice a turn, sag) are fitted if they improve poses left out of the fit.
    The whole model goes to NAME_model.json, for er3a.load_calibration in Python. The robot file has the table that is
    best without such errors, and ratios and couplings as its coupling.

    Poses that a controller shows can be given too, as er3a confirm reads them, with orientations. They repeat the
    controller's model, so er3a confirm answers first what is between both.

    Exit code 1 if measurements and table don't fit (what remains or is corrected is far beyond errors of arms and of
    measuring), or positions held back contradict the result. It is written all the same.
    """
    from er3a.calibration.observations import check_poses
    from er3a.calibration.parameters import CalibrationError
    from er3a.files.by_name import calibrate as calibrate_robot
    from er3a.files.robot_library import load_robot
    from er3a.pipeline.messages.calibration import calibration_record, held_back_line, kept_lines, lines_of
    from er3a.pipeline.messages.say import say

    _check_options(output, words)
    arm = load_robot(robot)
    rows = _measured(measurements, arm)
    others = _measured(held_back, arm) if held_back else ()
    check_poses(rows, arm, measurements)
    try:
        with shown_work(f"{robot}: estimating corrections"):
            found = calibrate_robot(arm, rows, [each.value for each in fixed or ()])
    except CalibrationError as error:
        raise Er3aError("\n".join([say(error.finding), *_explained(measurements, arm, rows)])) from None
    corrected = _renamed(found, output.stem if output else f"{arm.name}_calibrated")
    settled = len(found.open) < len(found.estimates)
    record = {"output": str(output) if output and settled else None, **calibration_record(found, arm, rows, others)}
    model = _write_calibrated(corrected, record, output) if output and settled else None
    if html:
        from er3a.pipeline.viewing.calibration import write_calibration

        command, files = ["er3a", *sys.argv[1:]], [given for given in (Path(robot), measurements) if given.is_file()]
        shown = partial(write_calibration, command=command, files=files, corrected=corrected)
        with using(words):
            shown(arm, rows, found, html, held_back=others)
    if as_json:
        options.print_json(record)
    else:
        lines = [lines_of(found, rows, others), *([held_back_line(found, others)] if others else [])]
        why = [] if found.fits else _explained(measurements, arm, rows)
        print("\n".join([*lines, *why, *([f"{html}: written"] if html else [])]))
    if output and not settled:
        raise Er3aError(
            f"{output}: not written, as these measurements settle none of the table's numbers; measure more"
        )
    contradicted = bool(record["held_back_contradicts"])
    if not as_json:
        print("\n".join(kept_lines(found, robot, output, model, contradicted=contradicted)))
    if contradicted or not found.fits:
        raise typer.Exit(1)


@options.app.command()
def predict(
    model: Annotated[Path, typer.Argument(help="NAME_model.json, which er3a calibrate --output NAME.yaml writes")],
    joints: Annotated[Path, typer.Argument(help="a CSV with the columns q1_deg ... (q3_mm of a joint that slides)")],
    robot: Annotated[str, typer.Option(help="the robot that the calibration started from: a name or file")],
):
    """Print where a calibrated arm's tool is at commanded joint values, by the whole model with all its terms: a CSV
    with position and roll, pitch and yaw."""
    import numpy as np

    from er3a.files.by_name import load_calibration, load_joint_values
    from er3a.files.robot_library import load_robot
    from er3a.geometry.transforms import rpy_of
    from er3a.robots.joint_limits import shown

    arm = load_robot(robot)
    q = load_joint_values(joints, arm)
    T = load_calibration(model, arm).forward(q)
    names = [f"q{joint}_{'mm' if slides else 'deg'}" for joint, slides in enumerate(arm.slides, 1)]
    print(",".join([*names, "x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg"]))
    for values, pose in zip(shown(arm, q), T):
        numbers = [*values, *1000 * pose[:3, 3], *np.degrees(rpy_of(pose))]
        print(",".join(f"{number:.6f}" for number in numbers))


@options.app.command()
def hand_eye(
    file: Annotated[
        Path, typer.Argument(callback=options.given_files, help="a calibration set (YAML, kind: hand_eye)")
    ],
    robot: Annotated[
        str | None, typer.Option(help="the robot that was used, if the samples hold joint angles: a name or file")
    ] = None,
    as_json: options.AsJson = False,
):
    """Estimate the pose of a camera, with 95 % intervals; name samples and conventions that can't be right.

    Exit code 1 if the calibration can't be used.
    """
    import numpy as np

    from er3a.files.hand_eye_file import HandEyeFile, read_calibration
    from er3a.files.robot_library import load_robot
    from er3a.files.yaml_file import load
    from er3a.finding import plain
    from er3a.pipeline.messages.say import say
    from er3a.pipeline.messages.scope import assumed_text, gap_text
    from er3a.pipeline.messages.vision import hand_eye_lines
    from er3a.pipeline.scope import GAPS, Open
    from er3a.pipeline.stages.vision.compute import calibration_result, open_of_calibration
    from er3a.vision.boards import ambiguous_tilts
    from er3a.vision.hand_eye import calibrate_hand_eye, zeros_tried
    from er3a.vision.vision_findings import HandEyeError, grave_warnings

    # What is printed is for the controller, and so in the robot's own base, wherever its file places that.
    arm = load_robot(robot).replace(base=np.eye(4)) if robot else None
    head = load(HandEyeFile, file)
    with shown_work(f"{file}: reading the samples") as at:
        samples, images = read_calibration(file, arm)
        open_tilts = ambiguous_tilts(images.views, samples.names) if images else ()
        at(f"{file}: estimating the camera's pose")
        try:
            found = calibrate_hand_eye(samples)
            found, unseen, least_zero = zeros_tried(found, arm) if arm else (found, None, 0.0)
        except HandEyeError as error:
            raise Er3aError(f"{file}: {say(error.finding)}") from None
    boardless = images.boardless if images else ()
    missed = [
        *open_of_calibration(samples, head, images, (found, unseen, least_zero)),
        *map(Open, samples.open_frames(head.simulated)),
    ]
    not_checked = [gap_text(each) for each in missed if each.reason in GAPS]
    assumed = [assumed_text(each) for each in missed if each.reason not in GAPS]
    touched_elsewhere = found.touch is not None and found.touch.contradiction is not None
    if as_json:
        more = {"touch_contradicts": touched_elsewhere, "not_checked": not_checked, "assumed": assumed}
        options.print_json(plain(calibration_result(head, found, images)) | more)
    else:
        sample_lines = [f"sample {say(each)}" for each in (*open_tilts, *boardless)]
        sample_lines += [f"not checked: {each}" for each in not_checked]
        sample_lines += [f"assumed: {each}" for each in assumed]
        print("\n".join([hand_eye_lines(found, boardless), *sample_lines]))
    if grave_warnings(found.warnings) or touched_elsewhere:
        raise typer.Exit(1)
