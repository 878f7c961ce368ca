"""The command line's application, and the arguments that several commands take."""

from __future__ import annotations

import json
import sys
import warnings
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from er3a.errors import Er3aError, InputWarning
from er3a.files.kept_files import given_file
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import load_study
from er3a.version import __version__

DEFAULT_STUDY = Path("config/config.yaml")
DEFAULT_RESULTS = Path("results")
DEFAULT_REPORTS = Path("reports")

FIRST = "A study, from start to end"
ROBOT_FILES = "Robot files"
PROGRAMS = "Robot programs"
JOBS = "Single jobs, as the workflow calls them"

_START = """\
er3a: can this kinematic model of a serial robot be trusted, and what can the robot do?

  er3a new cell --urdf arm.urdf   a study of your arm in the folder cell (or --dh table.csv, or --robot er3_600)
  er3a check FILE ...             what is wrong with a robot, study, target, path, scene or reference file
  er3a run                        carry out the study of this folder; then open reports/index.html
  er3a verdicts                   what came out, in the terminal
  er3a view                       the recordings, to move and to play

All commands: er3a --help. What one takes: er3a run --help."""

app = typer.Typer(
    name="er3a",
    help="Can this kinematic model of a serial robot be trusted, and what can the robot do?",
    pretty_exceptions_enable=False,
)


class FailOn(StrEnum):
    """From which verdict on a command ends with exit code 1."""

    caution = "caution"
    fail = "fail"


@app.callback(invoke_without_command=True)
def start(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and end.")] = False,
) -> None:
    """Can this kinematic model of a serial robot be trusted, and what can the robot do?"""
    if version:
        print(f"er3a {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        print(_START)


def _stages(incomplete: str) -> list[str]:
    return [name for name in STAGES if name.startswith(incomplete)]


def _robots(context: typer.Context, incomplete: str) -> list[str]:
    try:
        study = load_study(context.params.get("study") or DEFAULT_STUDY)
    except (Er3aError, OSError):
        return []
    return [name for name in study.names if name.startswith(incomplete)]


def given_files(files: Any) -> Any:
    """One file or several, or none, as :func:`er3a.files.kept_files.given_file` finds them: a callback of typer."""
    if isinstance(files, list):
        return [given_file(file) for file in files]
    return files and given_file(files)


StageName = Annotated[str, typer.Argument(metavar="STAGE", help=" | ".join(STAGES), autocompletion=_stages)]
RobotName = Annotated[str, typer.Argument(metavar="ROBOT", help="a robot of the study", autocompletion=_robots)]
SomeRobot = Annotated[
    str | None, typer.Argument(metavar="[ROBOT]", help="one robot; all if absent", autocompletion=_robots)
]
AnyRobot = Annotated[str, typer.Argument(metavar="ROBOT", help="a robot's name or file")]
StudyFile = Annotated[Path, typer.Option("--study", envvar="ER3A_STUDY", help="the study file")]
Results = Annotated[Path, typer.Option(help="folder of the results")]
Reports = Annotated[Path, typer.Option(help="folder of the reports")]
Split = Annotated[bool, typer.Option(help="split a URDF's collision meshes into convex pieces; else their hulls")]
Xacro = Annotated[
    list[str] | None, typer.Option(metavar="NAME:=VALUE", help="an argument of a URDF that is xacro; can be repeated")
]
AsJson = Annotated[bool, typer.Option("--json", help="print JSON, for another program")]


def print_json(content: Any) -> None:
    """What another program reads: on standard output, with nothing else."""
    print(json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False))


def print_note(text: str) -> None:
    """What is worth knowing besides the result."""
    print(f"note: {text}", file=sys.stderr)


def print_warning(message: Warning | str, category: type[Warning], *rest: Any, **named: Any) -> None:
    """What may be a slip in a file, once; other warnings as Python shows them."""
    if issubclass(category, InputWarning):
        if str(message) not in _told:
            print(f"warning: {message}", file=sys.stderr)
        _told.add(str(message))
    else:
        _show_warning(message, category, *rest, **named)


_show_warning = warnings.showwarning
_told: set[str] = set()


def print_error(error: Er3aError | str) -> None:
    """What a person has to correct."""
    print(f"error: {error}", file=sys.stderr)
