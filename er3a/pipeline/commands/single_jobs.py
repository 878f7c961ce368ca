"""Commands for single jobs, called by the rules of the workflow; they can be called by hand too."""

from __future__ import annotations

import fcntl
import shlex
from pathlib import Path
from typing import Annotated

import typer

from er3a.errors import Er3aError
from er3a.pipeline.commands import options
from er3a.pipeline.messages import language
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import Study, load_study


@options.app.command(rich_help_panel=options.JOBS)
def sample(
    robot: options.RobotName,
    part: Annotated[str, typer.Option(help="the part of the blocks, e.g. 2-of-4")],
    output: Annotated[Path, typer.Option(help="the file to write")],
    study: options.StudyFile = options.DEFAULT_STUDY,
):
    """Draw one part of the workspace stage's random samples."""
    number, _, count = part.partition("-of-")
    if not (number.isdigit() and count.isdigit() and 1 <= int(number) <= int(count)):
        raise Er3aError(f"--part is '{part}'; expected for example 2-of-4")
    from er3a.pipeline.stages.workspace.sample import sample as draw

    draw(load_study(study), robot, int(number), int(count), output)


@options.app.command(rich_help_panel=options.JOBS)
def compute(
    stage: options.StageName,
    robot: options.RobotName,
    parts: Annotated[
        list[Path] | None, typer.Argument(help="workspace only: files of sampled parts (default: drawn now)")
    ] = None,
    study: options.StudyFile = options.DEFAULT_STUDY,
    results: options.Results = options.DEFAULT_RESULTS,
):
    """Compute a stage: tables and summary.json."""
    from er3a.pipeline.stages import run

    loaded, folder = _folder(study, results, robot, stage)
    if parts and not STAGES[stage].sampled:
        raise Er3aError(f"the stage {stage} takes no sampled parts")
    if absent := run.compute(stage, loaded, robot, folder, parts):
        options.print_note(f"{robot}, {stage}: {absent}")


@options.app.command(rich_help_panel=options.JOBS)
def record(
    stage: options.StageName,
    robot: options.RobotName,
    study: options.StudyFile = options.DEFAULT_STUDY,
    results: options.Results = options.DEFAULT_RESULTS,
    reports: options.Reports = options.DEFAULT_REPORTS,
):
    """Write a stage's Rerun recording from its results (always in English).

    The viewer also draws it as a picture for the stage's page. For variants of a sweep the picture stays empty.
    """
    from er3a.pipeline.results import write_checksum
    from er3a.pipeline.stages import run
    from er3a.pipeline.viewing.viewer import draw_preview, write_empty

    loaded, folder = _folder(study, results, robot, stage)
    recording = reports / robot / f"{stage}.rrd"
    run.show("record", stage, loaded, robot, folder, recording)
    write_checksum(recording)
    picture = recording.with_suffix(".webp")
    if robot in loaded.variants:
        write_empty(picture)
    elif problem := draw_preview(recording, picture):
        options.print_note(f"previews of recordings were skipped: {problem}")
    write_checksum(picture)


@options.app.command(rich_help_panel=options.JOBS)
def report(
    stage: options.StageName,
    robot: options.RobotName,
    study: options.StudyFile = options.DEFAULT_STUDY,
    results: options.Results = options.DEFAULT_RESULTS,
    reports: options.Reports = options.DEFAULT_REPORTS,
):
    """Write a stage's page from its results."""
    from er3a.pipeline.results import write_checksum
    from er3a.pipeline.stages import run
    from er3a.pipeline.viewing.figures import house_style

    loaded, folder = _folder(study, results, robot, stage)
    page = reports / robot / f"{stage}.html"
    language.use(loaded.report.language, loaded.own_titles())
    with house_style():
        run.show("report", stage, loaded, robot, folder, page)
    write_checksum(page)


@options.app.command(rich_help_panel=options.ROBOT_FILES)
def teach(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="a robot of the study, or a robot file, D-H table or URDF")
    ],
    study: options.StudyFile = options.DEFAULT_STUDY,
    results: options.Results = options.DEFAULT_RESULTS,
    reports: options.Reports = options.DEFAULT_REPORTS,
    output: Annotated[
        Path | None, typer.Option(help="the page to write, if ROBOT is a file (default: NAME.html)")
    ] = None,
):
    """Write a teach panel as one page: sliders, the arm in 3-D, its pose and all IK solutions.

    A file (.csv with a D-H table, .yaml, .urdf) needs no study: its page is written into the current folder.
    """
    from er3a.files.arm_file import READ
    from er3a.pipeline.results import write_checksum
    from er3a.pipeline.teach.panel import write_teach_page

    if Path(robot).suffix in READ:
        _teach_file(robot, output or Path(f"{Path(robot).stem}.html"))
        return
    if output is not None:
        raise Er3aError(
            "--output needs a file as ROBOT; the panel of a robot of the study is written to the reports folder"
        )
    page = reports / robot / "teach.html"
    write_teach_page(_study_to_show(study), robot, results, page)
    write_checksum(page)


def _teach_file(source: str, page: Path) -> None:
    """Write the panel of an arm that is given as a file."""
    from er3a.files.arm_file import read_arm
    from er3a.files.kept_files import sha256
    from er3a.pipeline.code_digest import code_digest
    from er3a.pipeline.results import Input, Provenance
    from er3a.pipeline.teach.panel import write_panel

    arm = read_arm(source)
    for note in arm.notes:
        options.print_note(note)
    provenance = Provenance((Input(source, sha256(Path(source)), {}),), code_digest(__name__))
    command = shlex.join(["er3a", "teach", source, "--output", str(page)])
    write_panel(arm.robot, page, command=command, provenance=provenance)
    print(f"{page}: written")


@options.app.command(rich_help_panel=options.JOBS)
def index(
    study: options.StudyFile = options.DEFAULT_STUDY,
    results: options.Results = options.DEFAULT_RESULTS,
    reports: options.Reports = options.DEFAULT_REPORTS,
):
    """Write the index and the page that compares two robots."""
    from er3a.pipeline.results import OVERALL, write_checksum
    from er3a.pipeline.viewing.figures import house_style
    from er3a.pipeline.viewing.index import write_index

    shown = _study_to_show(study)
    reports.mkdir(parents=True, exist_ok=True)
    with (reports / ".index.lock").open("w") as lock, house_style():
        fcntl.flock(lock, fcntl.LOCK_EX)  # a run writes it now and then while it lasts
        write_index(shown, results, reports)
        for page in OVERALL:
            write_checksum(reports / page)


@options.app.command(rich_help_panel=options.JOBS)
def article(
    study: options.StudyFile = options.DEFAULT_STUDY,
    results: options.Results = options.DEFAULT_RESULTS,
    reports: options.Reports = options.DEFAULT_REPORTS,
):
    """Write the page on the article from results; `er3a run --study config/article.yaml` also computes them."""
    from er3a.pipeline.article.article_page import write_article
    from er3a.pipeline.results import write_checksum

    shown = _study_to_show(study)
    if shown.article is None:
        raise Er3aError(f"{study}: article: missing. Name the tables to compare: printed, corrected and real")
    write_article(shown, results, reports)
    for page in shown.article_pages().values():
        write_checksum(reports / page)


def _study_to_show(file: Path) -> Study:
    """Load a study and set the language of pages to the study's."""
    study = load_study(file)
    language.use(study.report.language, study.own_titles())
    return study


def _folder(study_file: Path, results: Path, robot: str, stage: str) -> tuple[Study, Path]:
    if stage not in STAGES:
        raise Er3aError(f"there is no stage '{stage}'; known: {', '.join(STAGES)}")
    study = load_study(study_file)
    study.entry(robot)
    return study, results / robot / stage
