"""What `make run` and `er3a run` do: one run at a time, inputs checked first, then Snakemake.

After `kill -9` Snakemake's own lock stays behind. The lock of the operating system that is taken here goes with its
process, so whoever gets it knows that no run is active and may clear Snakemake's.
"""

from __future__ import annotations

import atexit
import fcntl
import os
import signal
import subprocess
import sys
import threading
from argparse import Namespace
from collections.abc import Sequence
from contextlib import nullcontext, redirect_stderr, suppress
from io import StringIO
from pathlib import Path
from typing import Any

import psutil

from er3a.errors import Er3aError
from er3a.files.kept_files import half_written
from er3a.files.shipped import ROOT
from er3a.pipeline import job_server
from er3a.pipeline.check import check_study
from er3a.pipeline.corrupted import corrupted
from er3a.pipeline.run_log import logger_words
from er3a.pipeline.stages.registry import STAGES

_STATE = Path(".snakemake")
_PATIENCE_S = 0.7


class RunError(Er3aError):
    """A run can't be started in this folder."""


def run_study(study_file: Path, results: Path, reports: Path, words: Sequence[str]) -> bool:
    """Run a study in the working folder.

    Parameters
    ----------
    words : passed on to Snakemake

    Returns
    -------
    done : whether all jobs were done

    Raises
    ------
    RunError
        another run is active, the folder can't be written into, or Snakemake knows no such option
    InputError
        the study, or a file that it leads to, can't be used
    """
    asked = _parsed(words)
    if asked.dryrun:
        return _dry_run(study_file, results, reports, words)
    lock = _taken_lock()
    study = check_study(study_file)
    for path in (*half_written(results), *half_written(reports)):
        path.unlink()
    for path, fault in corrupted(study, results, reports):
        print(f"note: {fault.file}: {fault.problem}; it is made again", file=sys.stderr)
        path.unlink()
    snakemake = ["--snakefile", str(ROOT / "Snakefile")]
    study_words = ["--configfile", str(study_file)]  # last: Snakemake takes all words after it for more such files
    if any((_STATE / "locks").glob("*")):
        print("note: a run that was cut off left its lock; going on where it stopped", file=sys.stderr)
        unlock = [sys.executable, "-m", "snakemake", *snakemake, "--unlock", "--quiet", "all", *study_words]
        subprocess.run(unlock, check=True)
    os.set_inheritable(lock, True)  # held until the last job of this run has ended
    _end_on_sigterm(results, reports)
    sys.stdout.flush()
    plain = ["--nocolor"] if os.environ.get("NO_COLOR") else []
    expected = {(name, stage): verdict for name in study.names for stage, verdict in study.entry(name).expect.items()}
    own_log = asked.logger or asked.verbose or asked.printshellcmds or asked.debug_dag
    shown = [] if own_log else logger_words(study_file, expected)
    on_this_machine = not (asked.executor or asked.profile or asked.workflow_profile)
    with job_server.running(lock) if on_this_machine else nullcontext():
        first = _one_at_first() if on_this_machine and not asked.resources else []
        # Options that take as many words as follow stand before one that takes one.
        return _snakemake([*first, *shown, *snakemake, *plain, *words, *study_words])


def _one_at_first() -> list[str]:
    """Words that let just one job of a stage run at a time where its kernels are not compiled yet.

    Others of the stage would wait for that job's compiling, on a core that other stages can use.
    """
    new = [stage.name for stage in STAGES.values() if not stage.compiled.exists()]
    return ["--resources", *(f"compiles_{stage}=1" for stage in new)] if new else []


def _parsed(words: Sequence[str]) -> Namespace:
    """What Snakemake is asked for in words such as ``-np`` or ``--dry-run``."""
    from snakemake.cli import get_argument_parser
    from snakemake.exceptions import CliException

    said = StringIO()
    try:
        with redirect_stderr(said):
            return get_argument_parser().parse_args(list(words))
    except CliException as error:
        raise RunError(" ".join(str(error).split())) from None
    except SystemExit as end:
        if not end.code:
            raise
        problem = said.getvalue().strip().rpartition("error: ")[2]
        raise RunError(f"{' '.join(problem.split())}. All that it takes: snakemake --help") from None


def _dry_run(study_file: Path, results: Path, reports: Path, words: Sequence[str]) -> bool:
    """Say what a run would do, and change nothing."""
    for _, fault in corrupted(check_study(study_file), results, reports):
        print(f"note: {fault.file}: {fault.problem}; a run makes it again", file=sys.stderr)
    sys.stdout.flush()
    return _snakemake(["--snakefile", str(ROOT / "Snakefile"), *words, "--nolock", "--configfile", str(study_file)])


def _end_on_sigterm(results: Path, reports: Path) -> None:
    """Have SIGTERM end this process and all below it at once; Snakemake would wait for the end of its jobs."""
    from snakemake.scheduling.job_scheduler import JobScheduler

    def end(*_: Any) -> None:
        print(
            "error: ended by SIGTERM; what is finished stays, and the same command goes on from there", file=sys.stderr
        )
        sys.stderr.flush()
        silence = os.open(os.devnull, os.O_WRONLY)
        for output in (1, 2):  # Snakemake's threads would tell of each job
            os.dup2(silence, output)
        _end_processes_below()
        for path in (*half_written(results), *half_written(reports), *(_STATE / "locks").glob("*")):
            path.unlink(missing_ok=True)
        atexit._run_exitfuncs()  # Snakemake's temporary folder goes
        os._exit(128 + signal.SIGTERM)  # waits for no thread

    JobScheduler.exit_gracefully = end  # type: ignore[method-assign]
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, end)


def _end_processes_below() -> None:
    """Ask all processes below this one to end, and end those that are still there after a moment."""
    below = psutil.Process().children(recursive=True)
    for ask in (psutil.Process.terminate, psutil.Process.kill):
        for process in below:
            with suppress(psutil.NoSuchProcess):
                ask(process)
        _, below = psutil.wait_procs(below, timeout=_PATIENCE_S)
        below = list({*below, *psutil.Process().children(recursive=True)})


def _taken_lock() -> int:
    """The lock that one run at a time holds, until its process ends."""
    try:
        _STATE.mkdir(exist_ok=True)
        lock = os.open(_STATE / "er3a.lock", os.O_RDWR | os.O_CREAT)
    except OSError as error:
        raise RunError(f"{error.filename}: {error.strerror}; a run writes into this folder") from None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise RunError("another run is active in this folder; wait for its end, or stop it") from None
    return lock


def _snakemake(words: list[str]) -> bool:
    """Run Snakemake in this process, so that what stops the one stops the other."""
    from snakemake.cli import main

    try:
        main(words)
    except SystemExit as end:
        return end.code in (0, None)
    return True
