"""The command line: what the workflow's rules call, and what a person may call by hand.

Exit codes: 0; 1 for findings that were asked for with ``--fail-on``, and for a difference; 2 for what a person has to
correct. Results go to standard output, notes and progress to standard error.
"""

from __future__ import annotations

import sys
import warnings
from importlib import import_module

from er3a.errors import Er3aError
from er3a.pipeline.commands.options import app, print_error, print_warning

for _room in ("studies", "robot_files", "single_jobs"):  # in the order of --help; each registers its commands
    import_module(f"er3a.pipeline.commands.{_room}")


def main() -> None:
    """Entry point: errors that a user can correct are one line on standard error and exit code 2."""
    warnings.showwarning = print_warning
    try:
        app(standalone_mode=True)
    except Er3aError as error:
        print_error(error)
    except MemoryError:
        _complain_of_memory()
    except ImportError as error:
        if "failed to map" not in str(error):
            raise
        _complain_of_memory()
    except OSError as error:
        print_error(f"{error.filename or 'the system'}: {error.strerror or error}")
    raise SystemExit(2)


def _complain_of_memory() -> None:
    print_error(f"out of memory in `er3a {' '.join(sys.argv[1:])}`; give it more, lower the study's budgets or --cores")
