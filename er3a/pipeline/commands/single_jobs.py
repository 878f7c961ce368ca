"""Commands for single jobs, called by the rules of the workflow; they can be called by hand too."""

from __future__ import annotations

import shlex
from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Any

import typer

from er3a.errors import Er3aError
from er3a.pipeline import language
from er3a.pipeline.commands import options
from er3a.pipeline.commands.dh_options import Angles, Conventions, Lengths
from er3a.pipeline.results import is_current, write_checksum
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import Study, load_study

TEACH = "teach"


def _stages(incomplete: str) -> list[str]:
    return [name for name in STAGES if name.startswith(incomplete)]


StageNames = Annotated[
    str,
    typer.Argument(metavar="STAGE", help=f"{' | '.join(STAGES)}, or several with commas", autocompletion=_stages),
]


@options.app.command()
def compute(
    stage: StageNames,
    robot: options.RobotName,
    study: options.StudyFile = options.DEFAULT_STUDY,
    *,
    changed: Annotated[bool, typer.Option("--changed", help="only stages whose results are not up to date")] = False,
    show: Annotated[str, typer.Option(metavar="STAGE", help="write this one's page, too, as soon as it can be")] = "",
):
    """Compute a stage: tables and summary.json."""
    from er3a.pipeline.stages import run

    show = show and _known(show, STAGES)
    for name in [_known(each, STAGES) for each in stage.split(",")]:
        loaded = load_study(study)  # for each: what is noted while files are read belongs to the stage that reads them
        folder = options.RESULTS / robot / name
        if changed and is_current(folder, loaded, robot, name):
            continue
        if absent := run.compute(name, loaded, robot, folder):
            options.print_note(f"{robot}, {name}: {absent}")
        if name == show:
            with language.using("en"):  # which it is again for the other stages
                views(robot, [show], study)
            print(f"{options.REPORTS / robot / show}.html can be read while the rest is computed", flush=True)


@options.app.command()
def views(
    robot: options.RobotName,
    pages: Annotated[
        list[str] | None, typer.Argument(metavar="[PAGE]...", help="stages, and teach (default: all that it has)")
    ] = None,
    study: options.StudyFile = options.DEFAULT_STUDY,
):
    """Write a robot's recordings (always in English), a picture of each, and pages from results."""
    from er3a.pipeline.stages import run
    from er3a.pipeline.viewing.figures import house_style

    loaded = _study_to_show(study)
    loaded.entry(robot)
    named = [_known(page, (*STAGES, TEACH)) for page in pages or loaded.pages(robot)]
    stages = [STAGES[page] for page in named if page != TEACH]

    def show(verb: str, stage: str, kind: str) -> None:
        view = options.REPORTS / robot / f"{stage}.{kind}"
        run.show(verb, stage, loaded, robot, options.RESULTS / robot / stage, view)
        write_checksum(view)

    with language.using("en"):
        for stage in stages:  # first: pages show their pictures where there is no WebGL
            if "record" in stage.views:
                show("record", stage.name, "rrd")
                write_checksum(options.REPORTS / robot / f"{stage.name}.webp")
    with house_style():
        for stage in stages:
            show("report", stage.name, "html")
    if TEACH in named:
        _write_teach_page(loaded, robot)


def _write_teach_page(study: Study, robot: str) -> None:
    from er3a.pipeline.teach.panel import write_teach_page

    page = options.REPORTS / robot / "teach.html"
    write_teach_page(study, robot, options.RESULTS, page)
    write_checksum(page)


@options.app.command()
def teach(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="a robot of the study, or a robot file, D-H table or URDF")
    ],
    study: options.StudyFile = options.DEFAULT_STUDY,
    output: Annotated[
        Path | None, typer.Option(help="the page to write, if ROBOT is a file (default: NAME.html)")
    ] = None,
    *,
    convention: Conventions = None,
    length_unit: Lengths = None,
    angle_unit: Angles = None,
    base: options.Base = None,
    tip: options.Tip = None,
    xacro: options.Xacro = None,
    srdf: options.Srdf = None,
):
    """Write a teach panel as one page: sliders, the arm in 3-D, its pose and all IK solutions.

    A file (.yaml, .urdf, a D-H table in any form) needs no study, nor does a known arm where there is none: the page is
    written into the current folder.
    """
    from er3a.files.arm_catalogue import known_arms
    from er3a.robots.robot import robot_name

    given: dict[str, Any] = {"convention": convention, "length_unit": length_unit, "angle_unit": angle_unit}
    given |= {"base": base, "tip": tip, "xacro": xacro or (), "srdf": srdf}
    if robot == "-" or Path(robot).suffix or (robot in known_arms() and (output or not study.is_file())):
        _teach_file(robot, output or Path(f"{robot_name(Path(robot))}.html"), given)
        return
    if output is not None:
        raise Er3aError(
            "--output needs a file or a known arm as ROBOT; that of a study's robot is written to the reports folder"
        )
    _write_teach_page(_study_to_show(study), robot)


def _teach_file(source: str, page: Path, given: dict[str, Any]) -> None:
    """Write the panel of an arm that is given as a file, read as the options say."""
    from er3a.files.arm_catalogue import ARMS
    from er3a.files.kept_files import sha256
    from er3a.files.robot_library import read_arm
    from er3a.pipeline.code_digest import code_digest
    from er3a.pipeline.results import Input, Provenance
    from er3a.pipeline.teach.panel import write_panel

    arm = read_arm(source, whole=True, **given)
    for note in arm.notes:
        options.print_note(note)
    file = Path(source) if Path(source).is_file() else ARMS if source != "-" else None
    provenance = Provenance((Input(source, sha256(file), {}),) if file else (), code_digest())
    command = shlex.join(["er3a", "teach", source, "--output", str(page)])
    write_panel(arm.robot, page, command=command, provenance=provenance)
    print(f"{page}: written")


@options.app.command()
def index(
    study: options.StudyFile = options.DEFAULT_STUDY,
):
    """Write the index."""
    from er3a.pipeline.overview.index import write_index
    from er3a.pipeline.results import OVERALL
    from er3a.pipeline.viewing.figures import house_style

    shown = _study_to_show(study)
    with house_style():
        write_index(shown, options.RESULTS, options.REPORTS)
    for page in OVERALL:
        write_checksum(options.REPORTS / page)


@options.app.command()
def article(
    study: options.StudyFile = options.DEFAULT_STUDY,
):
    """Write the page on the article from results; `er3a run --study config/article.yaml` also computes them."""
    from er3a.pipeline.article.article_page import write_article

    shown = _study_to_show(study)
    if shown.article is None:
        raise Er3aError(f"{study}: article: missing. Name the tables to compare: printed, corrected and real")
    write_article(shown, shown.article, options.RESULTS, options.REPORTS)
    for page in shown.article_pages().values():
        write_checksum(options.REPORTS / page)


def _study_to_show(file: Path) -> Study:
    """Load a study and set the language of pages to the study's."""
    study = load_study(file)
    language.use(study.report.language, study.own_titles())
    return study


def _known(name: str, names: Collection[str]) -> str:
    if name not in names:
        raise Er3aError(f"there is no stage '{name}'; known: {', '.join(names)}")
    return name
