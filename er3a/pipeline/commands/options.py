"""The command line's application, and the arguments that several commands take."""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Iterable, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from er3a.errors import Er3aError, InputWarning
from er3a.files.kept_files import own_or_shipped
from er3a.pipeline.commands.names import app
from er3a.version import __version__

__all__ = ["app"]

DEFAULT_STUDY = Path("config/config.yaml")
RESULTS, REPORTS = Path("results"), Path("reports")

_START = """\
er3a: can this kinematic model of a serial robot be trusted, and what can the robot do?

  er3a new cell --urdf arm.urdf   write a study of your arm into the folder cell (or --dh table.csv, or --robot er3_600)
  er3a check FILE ...             find errors in robot, study, target, path, scene or reference files
  er3a run                        run the study in this folder; then open reports/index.html
  er3a verdicts                   print the verdicts
  er3a view                       play the 3-D recordings

All commands: er3a --help. Options of one command: er3a run --help."""


class FailOn(StrEnum):
    """The mildest verdict for which a command ends with exit code 1."""

    caution = "caution"
    fail = "fail"


@app.callback(invoke_without_command=True)
def start(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False,
) -> None:
    """Can this kinematic model of a serial robot be trusted, and what can the robot do?"""
    if version:
        print(f"er3a {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        print(_START)


def _robots(context: typer.Context, incomplete: str) -> list[str]:
    from er3a.pipeline.study import load_study

    try:
        study = load_study(context.params.get("study") or DEFAULT_STUDY)
    except (Er3aError, OSError):
        return []
    return [name for name in study.names if name.startswith(incomplete)]


def given_files(files: Any) -> Any:
    """One file or several, or none, as :func:`er3a.files.kept_files.own_or_shipped` finds them: a callback of typer."""
    if isinstance(files, list):
        return [own_or_shipped(file) for file in files]
    return files and own_or_shipped(files)


RobotName = Annotated[str, typer.Argument(metavar="ROBOT", help="a robot of the study", autocompletion=_robots)]
SomeRobot = Annotated[
    str | None, typer.Argument(metavar="[ROBOT]", help="a robot of the study (default: all)", autocompletion=_robots)
]
AnyRobot = Annotated[str, typer.Argument(metavar="ROBOT", help="a robot's name or file")]
StudyFile = Annotated[Path, typer.Option("--study", envvar="ER3A_STUDY", help="the study file")]
Base = Annotated[str | None, typer.Option(help="the link of a URDF at which the arm begins (default: the root)")]
Tip = Annotated[str | None, typer.Option(help="the link of a URDF at which the arm ends, if there are several ends")]
Columns = Annotated[
    str | None,
    typer.Option("--column", help="what a D-H table's columns are, in order: theta,d,a,alpha (-: not read)"),
]
Xacro = Annotated[list[str] | None, typer.Option(metavar="NAME:=VALUE", help="a xacro argument; can be repeated")]
Srdf = Annotated[
    Path | None, typer.Option(help="the SRDF of a URDF, whose state home, else the first that is not singular, is home")
]
AsJson = Annotated[bool, typer.Option("--json", help="print JSON")]


def columns_of(given: str | None) -> list[str]:
    """The meanings of columns that --column gives, with commas or blanks between them."""
    return (given or "").replace(",", " ").split()


def as_json_text(content: Any) -> str:
    """JSON text, as :func:`print_json` prints it."""
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)


def print_json(content: Any) -> None:
    """Print JSON on standard output."""
    print(as_json_text(content))


def print_table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table, its cells folded to the width of the terminal."""
    from rich import box
    from rich.console import Console
    from rich.table import Column, Table
    from rich.text import Text

    table = Table(*(Column(column, overflow="fold") for column in columns), box=box.SIMPLE, padding=0)
    for row in rows:
        table.add_row(*map(Text, row))
    Console().print(table)


def print_note(text: str) -> None:
    """Print a note on standard error."""
    print(f"note: {text}", file=sys.stderr)


def print_warning(message: Warning | str, category: type[Warning], *rest: Any, **named: Any) -> None:
    """Print an :class:`er3a.InputWarning` as one line, once; other warnings as Python shows them."""
    if issubclass(category, InputWarning):
        if str(message) not in _told:
            print(f"warning: {message}", file=sys.stderr)
        _told.add(str(message))
    else:
        _show_warning(message, category, *rest, **named)


_show_warning = warnings.showwarning
_told: set[str] = set()


def print_error(error: Er3aError | str) -> None:
    """Print an error that the user can correct."""
    print(f"error: {error}", file=sys.stderr)
