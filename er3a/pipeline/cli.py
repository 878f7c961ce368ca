"""The command line: what the workflow's rules call, and what a person may call by hand."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer

from er3a.errors import Er3aError
from er3a.pipeline.messages import language
from er3a.pipeline.stages import run
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import Study, load_study

app = typer.Typer(
    name="er3a",
    help="Can this kinematic model of a six-axis robot be trusted, and what can the robot do?",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

StageName = Annotated[str, typer.Argument(metavar="STAGE", help=" | ".join(STAGES))]
RobotName = Annotated[str, typer.Argument(metavar="ROBOT", help="a robot of the study")]
StudyFile = Annotated[Path, typer.Option("--study", envvar="ER3A_STUDY", help="the study file")]
Results = Annotated[Path, typer.Option(help="folder of the results")]
Reports = Annotated[Path, typer.Option(help="folder of the reports")]

DEFAULT_STUDY = Path("config/config.yaml")
DEFAULT_RESULTS = Path("results")
DEFAULT_REPORTS = Path("reports")


@app.command()
def check(files: Annotated[list[Path], typer.Argument(help="robot, study, target, path, scene or reference files")]):
    """Check input files and say of each what it is, or what is wrong with it."""
    from er3a.pipeline.check import check_file

    faults = 0
    for file in files:
        try:
            print(f"{file}: {check_file(file)}, in order")
        except Er3aError as error:
            faults += 1
            _complain(error)
    if faults:
        raise typer.Exit(2)


@app.command()
def sample(
    robot: RobotName,
    part: Annotated[str, typer.Option(help="which part of the blocks, e.g. 2-of-4")],
    output: Annotated[Path, typer.Option(help="the part's file")],
    study: StudyFile = DEFAULT_STUDY,
):
    """Draw one part of the workspace's seeded sample blocks."""
    number, _, count = part.partition("-of-")
    if not (number.isdigit() and count.isdigit() and 1 <= int(number) <= int(count)):
        raise Er3aError(f"--part is '{part}'; expected for example 2-of-4")
    from er3a.pipeline.stages.workspace.sample import sample as draw

    draw(load_study(study), robot, int(number), int(count), output)


@app.command()
def compute(
    stage: StageName,
    robot: RobotName,
    parts: Annotated[
        list[Path] | None, typer.Argument(help="workspace only: sampled parts; drawn here if absent")
    ] = None,
    study: StudyFile = DEFAULT_STUDY,
    results: Results = DEFAULT_RESULTS,
):
    """Compute a stage's numbers: tables and summary.json."""
    loaded, folder = _folder(study, results, robot, stage)
    if parts and not STAGES[stage].sampled:
        raise Er3aError(f"the stage {stage} takes no sampled parts")
    if absent := run.compute(stage, loaded, robot, folder, parts):
        print(f"note: {robot}, {stage}: {absent}", file=sys.stderr)


@app.command()
def record(
    stage: StageName,
    robot: RobotName,
    study: StudyFile = DEFAULT_STUDY,
    results: Results = DEFAULT_RESULTS,
    reports: Reports = DEFAULT_REPORTS,
):
    """Write a stage's Rerun recording from its results, in English: the viewer has no other letters."""
    from er3a.pipeline.checksums import write_checksum

    loaded, folder = _folder(study, results, robot, stage)
    recording = reports / robot / f"{stage}.rrd"
    run.show("record", stage, loaded, robot, folder, recording)
    write_checksum(recording)


@app.command()
def preview(stage: StageName, robot: RobotName, reports: Reports = DEFAULT_REPORTS):
    """Draw a stage's recording as a picture for its page; an empty file where nothing can draw it."""
    from er3a.pipeline.checksums import check_checksum, write_checksum
    from er3a.pipeline.viewing.preview import draw_preview

    recording = reports / robot / f"{stage}.rrd"
    check_checksum(recording)
    picture = recording.with_suffix(".webp")
    if problem := draw_preview(recording, picture):
        print(f"note: previews of recordings were skipped: {problem}", file=sys.stderr)
    write_checksum(picture)


@app.command()
def report(
    stage: StageName,
    robot: RobotName,
    study: StudyFile = DEFAULT_STUDY,
    results: Results = DEFAULT_RESULTS,
    reports: Reports = DEFAULT_REPORTS,
):
    """Write a stage's page from its results."""
    from er3a.pipeline.checksums import write_checksum
    from er3a.pipeline.viewing.figures import house_style

    loaded, folder = _folder(study, results, robot, stage)
    page = reports / robot / f"{stage}.html"
    language.use(loaded.report.language, loaded.own_titles())
    with house_style():
        run.show("report", stage, loaded, robot, folder, page)
    write_checksum(page)


@app.command()
def teach(robot: RobotName, study: StudyFile = DEFAULT_STUDY, reports: Reports = DEFAULT_REPORTS):
    """Write a robot's teach panel: sliders, the arm in 3-D, its pose and all ways to it, in one page."""
    from er3a.pipeline.checksums import write_checksum
    from er3a.pipeline.teach.panel import write_teach_page

    page = reports / robot / "teach.html"
    write_teach_page(_study_to_show(study), robot, page)
    write_checksum(page)


@app.command()
def index(study: StudyFile = DEFAULT_STUDY, results: Results = DEFAULT_RESULTS, reports: Reports = DEFAULT_REPORTS):
    """Write the pages over all robots and stages: the index and the comparison of two robots."""
    from er3a.pipeline.checksums import OVERALL, write_checksum
    from er3a.pipeline.viewing.figures import house_style
    from er3a.pipeline.viewing.index import write_index

    with house_style():
        write_index(_study_to_show(study), results, reports)
    for page in OVERALL:
        write_checksum(reports / page)


@app.command()
def estimate(
    cores: Annotated[str, typer.Option(help="numbers of cores, of one machine or of nodes together")] = "1,2,8,64",
    study: StudyFile = DEFAULT_STUDY,
    results: Results = DEFAULT_RESULTS,
    reports: Reports = DEFAULT_REPORTS,
    logs: Annotated[Path, typer.Option(help="folder of a run's timings")] = Path("logs"),
):
    """Say what the study will take: samples/s, wall time, memory and disk, from a short calibration on this machine."""
    from rich.console import Console

    from er3a.pipeline.estimate.cost import measured_here
    from er3a.pipeline.estimate.terminal import print_estimate

    numbers = cores.split(",")
    if not all(number.strip().isdigit() and int(number) > 0 for number in numbers):
        raise Er3aError(f"--cores is '{cores}'; expected numbers such as 1,2,8,64")
    loaded = load_study(study)
    with Console(stderr=True).status("Measuring on this machine ..."):
        measured = measured_here(loaded, results, reports, logs)
    print_estimate(loaded, measured, sorted({int(number) for number in numbers}))


@app.command()
def diff(
    old: Annotated[Path, typer.Argument(help="a results folder")],
    new: Annotated[Path, typer.Argument(help="another results folder")],
    output: Annotated[Path | None, typer.Option(help="also write them as a page")] = None,
    words: Annotated[str, typer.Option("--language", help=" | ".join(language.LANGUAGES))] = "en",
):
    """Compare two results folders: verdicts, key figures and tables that moved."""
    from dataclasses import astuple

    from rich import box
    from rich.console import Console
    from rich.table import Column, Table

    from er3a.pipeline.viewing.diff import COLUMNS, changes, write_diff

    if words not in language.LANGUAGES:
        raise Er3aError(f"--language is '{words}'; known: {', '.join(language.LANGUAGES)}")
    language.use(words)
    found = changes(old, new)
    table = Table(*(Column(language.tr(column), overflow="fold") for column in COLUMNS), box=box.SIMPLE, padding=0)
    for change in found:
        table.add_row(*astuple(change))
    Console().print(table if found else language.tr("Nothing differs."))
    if output:
        write_diff(old, new, found, output)


@app.command()
def archive(
    output: Annotated[Path, typer.Option(help="the zip to write")] = Path("er3a-study.zip"),
    study: StudyFile = DEFAULT_STUDY,
    results: Results = DEFAULT_RESULTS,
    reports: Reports = DEFAULT_REPORTS,
):
    """Pack a finished study into one zip with RO-Crate metadata."""
    from er3a.pipeline.archive import archive as pack

    print(f"{output}: written, {pack(study, results, reports, output)} files with RO-Crate metadata")


@app.command()
def view(
    robot: Annotated[str | None, typer.Argument(help="one robot; all if absent")] = None,
    reports: Reports = DEFAULT_REPORTS,
):
    """Open the recordings in the Rerun viewer; where there is no desktop, serve them to a browser."""
    from er3a.pipeline.checksums import check_checksum
    from er3a.pipeline.viewing.viewer import has_display, viewer_command, without_statistics
    from er3a.pipeline.viewing.web_viewer import serve

    recordings = sorted(reports.glob(f"{robot or '*'}/*.rrd"))
    if not recordings:
        raise Er3aError(f"no recordings below {reports / (robot or '')}; `make run` writes them")
    for recording in recordings:
        check_checksum(recording)
    if not has_display():
        serve(recordings)
        return
    with without_statistics() as environment:
        done = subprocess.run(viewer_command(recordings), env=environment, check=False)
    raise typer.Exit(done.returncode)


@app.command()
def import_urdf(
    file: Annotated[Path, typer.Argument(help="a URDF of a six-axis serial arm")],
    output: Annotated[Path, typer.Option(help="the robot file to write")],
    snap: Annotated[bool, typer.Option(help="take angles within 1e-4 rad of a right angle for it, and say so")] = False,
):
    """Derive a robot file (D-H table, directions, offsets, limits) from a URDF's axes."""
    from er3a.files.robot_writer import write_robot
    from er3a.formats.urdf import import_urdf as read_urdf

    imported = read_urdf(file, snap=snap)
    write_robot(imported.robot.replace(name=output.stem), output)
    for note in imported.notes:
        print(f"note: {note}")
    print(f"{output}: written; differs from the URDF by at most {imported.misfit_m * 1000:.2g} mm on random poses")


@app.command()
def export_urdf(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="a robot's name or file")],
    output: Annotated[Path, typer.Option(help="the URDF to write")],
):
    """Write a robot as URDF."""
    from er3a.files.kept_files import write_atomically
    from er3a.files.robot_library import load_robot
    from er3a.formats.urdf import export_urdf as urdf_text

    text = urdf_text(load_robot(robot))
    write_atomically(output, lambda path: path.write_text(text, encoding="utf-8"))
    print(f"{output}: written")


@app.command()
def calibrate(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="a robot's name or file: the table to start from")],
    measurements: Annotated[str, typer.Argument(help="a CSV of measured positions, or a reference set's name")],
    output: Annotated[Path, typer.Option(help="the robot file to write")],
):
    """Estimate corrections to a robot's table from measured positions, and write the corrected robot file."""
    from er3a.calibration.outcomes import CalibrationError
    from er3a.files.by_name import calibrate as calibrate_robot
    from er3a.files.reference_sets import load_references
    from er3a.files.robot_library import load_robot
    from er3a.files.robot_writer import write_robot
    from er3a.pipeline.messages.calibration import lines_of
    from er3a.pipeline.messages.say import say

    source = Path(measurements) if measurements.endswith(".csv") else load_references(measurements)
    try:
        found = calibrate_robot(load_robot(robot), source)
    except CalibrationError as error:
        raise Er3aError(say(error.finding)) from None
    print(lines_of(found))
    write_robot(found.robot.replace(name=output.stem, title=f"{found.robot.title}, calibrated"), output)
    print(f"{output}: written")


@app.command()
def schema(
    folder: Annotated[Path, typer.Option(help="where the schemas of input files go")] = Path("config"),
    docs: Annotated[Path, typer.Option(help="where the documents about results go")] = Path("docs/results"),
):
    """Write the JSON schemas of input files and of results, and the dictionary of all tables."""
    from er3a.pipeline.check import SCHEMAS
    from er3a.pipeline.dictionary import data_dictionary, summary_schema

    schemas = {folder / f"{kind}.schema.json": model.model_json_schema() for kind, model in SCHEMAS.items()}
    schemas |= {docs / f"{name}.schema.json": summary_schema(stage) for name, stage in STAGES.items()}
    for file, content in schemas.items():
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    (docs / "dictionary.md").write_text(data_dictionary(), encoding="utf-8")


def main() -> None:
    """Entry point: errors that a user can correct are one line on standard error and exit code 2."""
    try:
        app(standalone_mode=True)
    except Er3aError as error:
        _complain(error)
    except MemoryError:
        _complain_of_memory()
    except ImportError as error:
        if "failed to map" not in str(error):
            raise
        _complain_of_memory()
    except OSError as error:
        _complain(f"{error.filename or 'the system'}: {error.strerror or error}")
    raise SystemExit(2)


def _complain(error: Er3aError | str) -> None:
    print(f"error: {error}", file=sys.stderr)


def _complain_of_memory() -> None:
    _complain(f"out of memory in `er3a {' '.join(sys.argv[1:])}`; give it more, lower the study's budgets or --cores")


def _study_to_show(file: Path) -> Study:
    """A study whose language is the one that pages are written in from here on."""
    study = load_study(file)
    language.use(study.report.language, study.own_titles())
    return study


def _folder(study_file: Path, results: Path, robot: str, stage: str) -> tuple[Study, Path]:
    if stage not in STAGES:
        raise Er3aError(f"there is no stage '{stage}'; known: {', '.join(STAGES)}")
    study = load_study(study_file)
    study.entry(robot)
    return study, results / robot / stage
