"""What `make run` and `er3a run` do: one run at a time, inputs checked first, then Snakemake.

After `kill -9` Snakemake's own lock stays behind. The lock of the operating system that is taken here goes with its
process, so whoever gets it knows that no run is active and may clear Snakemake's.
"""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path

from er3a.errors import Er3aError
from er3a.files.kept_files import half_written
from er3a.files.shipped import ROOT
from er3a.pipeline import job_server
from er3a.pipeline.check import check_study
from er3a.pipeline.corrupted import corrupted
from er3a.pipeline.run_log import logger_words
from er3a.pipeline.stages.registry import STAGES

_STATE = Path(".snakemake")


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
        another run is active, or the folder can't be written into
    InputError
        the study, or a file that it leads to, can't be used
    """
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
    sys.stdout.flush()
    plain = ["--nocolor"] if os.environ.get("NO_COLOR") else []
    expected = {(name, stage): verdict for name in study.names for stage, verdict in study.entry(name).expect.items()}
    with job_server.running(lock) if _on_this_machine(words) else nullcontext():
        return _snakemake(
            [*snakemake, *plain, *_one_at_first(words), *logger_words(expected, words), *words, *study_words]
        )


def _one_at_first(words: Sequence[str]) -> list[str]:
    """Words that let just one job of a stage run at a time where its kernels are not compiled yet.

    Others of the stage would wait for that job's compiling, on a core that other stages can use.
    """
    new = [stage.name for stage in STAGES.values() if not stage.compiled.exists()]
    return ["--resources", *(f"compiles_{stage}=1" for stage in new)] if new and "--resources" not in words else []


def _on_this_machine(words: Sequence[str]) -> bool:
    """Whether Snakemake runs jobs itself, not by an executor or a profile that may name one."""
    return not any(word.startswith(("-e", "--executor", "--profile", "--workflow-profile")) for word in words)


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
