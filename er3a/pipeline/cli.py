"""The command line, used by people and by the workflow's rules.

Exit codes: 0; 1 for findings at the level of ``--fail-on``, and for a difference; 2 for an error that the user can
correct; 143 for a command that SIGTERM ended. Results go to standard output, notes and progress to standard error.
"""

from __future__ import annotations

import os
import re
import signal
import sys
import warnings
from types import FrameType
from typing import Any

import typer

from er3a.errors import Er3aError, with_extra
from er3a.pipeline.commands.options import app, print_error, print_warning

_UsageError: Any = typer.BadParameter.__base__  # click's, which some versions of typer carry with them


def main() -> None:
    """Run a command and end the process with its exit code.

    Errors that a user can correct are one line on standard error.

    Raises
    ------
    SystemExit
        with the codes at the head of this module; 1 also where the reader of standard output has closed it
    """
    warnings.showwarning = print_warning
    signal.signal(signal.SIGTERM, _end)
    try:
        _refuse_files_as_options(sys.argv[1:])
        raise SystemExit(app(standalone_mode=False, prog_name="er3a"))
    except _UsageError as error:
        _complain_of_usage(error)
    except typer.Abort:
        print_error("stopped")
    except Er3aError as error:
        print_error(error)
    except MemoryError:
        _complain_of_memory()
    except ImportError as error:
        if "failed to map" in str(error):
            _complain_of_memory()
        elif isinstance(error, ModuleNotFoundError) and isinstance(named := with_extra(error), Er3aError):
            print_error(named)
        else:
            raise
    except BrokenPipeError:  # the reader closed the pipe
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise SystemExit(1) from None
    except OSError as error:
        print_error(f"{error.filename or 'the system'}: {error.strerror or error}")
    raise SystemExit(2)


def _refuse_files_as_options(words: list[str]) -> None:
    """Refuse an option that is also a file here: a pattern, or a hook, names all files of a folder."""
    options = words[: words.index("--")] if "--" in words else words
    for word in options:
        if word.startswith("-") and os.path.lexists(word):
            raise Er3aError(f"{word} is a file of this folder, read as an option; write -- before the names of files")


def _end(number: int, frame: FrameType | None) -> None:
    """End on SIGTERM: ``finally`` blocks run, so temporary files are removed."""
    print_error("ended by SIGTERM")
    raise SystemExit(128 + number)


def _complain_of_usage(error: Any) -> None:
    """Print one line for a wrong option or argument; the help of a group that was called without a command."""
    if type(error).__name__ == "NoArgsIsHelpError":
        error.show()
        return
    problem = re.sub(r"\bValue error, ", "", " ".join(error.format_message().split())).rstrip(".")
    command = error.ctx.command_path if error.ctx else "er3a"
    print_error(f"{problem}{'' if problem.endswith('?') else '.'} See: {command} --help")


def _complain_of_memory() -> None:
    print_error(f"out of memory in `er3a {' '.join(sys.argv[1:])}`; give it more, lower the study's budgets or --cores")
