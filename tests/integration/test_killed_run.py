"""A run that is killed goes on where it stopped."""

from __future__ import annotations

import base64
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from er3a.files.kept_files import half_written
from testing.processes import started
from testing.small_study import STUDY
from tests.conftest import ROBOT, leave_one_robot

pytestmark = pytest.mark.long

QUICK_STAGES = ("inverse", "programs", "dynamics", "validation")  # two jobs: validation has its own


def finished_results(run) -> list[Path]:
    """Summaries of stages that Snakemake knows as done: written, and no output marked as in the making.

    The marks are taken away one by one when a job has ended, so a stage with any mark left is made again.
    """
    marks = (run.folder / ".snakemake/incomplete").glob("*")
    in_the_making = {run.folder / Path(base64.urlsafe_b64decode(mark.name).decode()).parent for mark in marks}
    return [path for path in run.folder.glob("results/*/*/summary.json") if path.parent not in in_the_making]


def test_kill_9_in_mid_run_then_the_same_bytes_on_one_core(small_study, fresh_project):
    """Of some stages; the campaign on kills has all, with pages and recordings."""
    run = fresh_project("killed")
    leave_one_robot(run.folder / STUDY)
    wanted = [f"results/{ROBOT}/{stage}/summary.json" for stage in QUICK_STAGES]
    command = [sys.executable, "-m", "er3a", "run", "--study", STUDY, "--", "--cores", "2", *wanted]
    quiet = subprocess.DEVNULL
    with started(command, cwd=run.folder, env=run.environment(), stdout=quiet, stderr=quiet):
        deadline = time.monotonic() + 120
        while not finished_results(run) and time.monotonic() < deadline:
            time.sleep(0.05)
    finished = {path: path.stat().st_mtime_ns for path in finished_results(run)}
    assert finished
    assert any((run.folder / ".snakemake/locks").iterdir()), "the killed run should have left its lock"

    done = run.make_run("--cores", "1", *wanted)
    assert "left its lock" in done.stderr
    for stage in QUICK_STAGES:
        results = [path for path in (small_study.folder / "results" / ROBOT / stage).rglob("*") if path.is_file()]
        assert len(results) >= 2
        for path in results:
            assert (run.folder / path.relative_to(small_study.folder)).read_bytes() == path.read_bytes(), path.name
    for path, changed in finished.items():
        assert path.stat().st_mtime_ns == changed, f"{path} was finished and yet made again"


def test_ctrl_c_ends_a_run_and_its_jobs_and_the_next_run_goes_on(fresh_project, tmp_path):
    """It goes to all processes of a terminal."""
    run = fresh_project("ended")
    leave_one_robot(run.folder / STUDY)
    wanted = [f"results/{ROBOT}/{stage}/summary.json" for stage in QUICK_STAGES]
    command = [sys.executable, "-m", "er3a", "run", "--study", STUDY, "--", "--cores", "1", *wanted]
    with (
        (tmp_path / "told").open("w") as output,
        started(
            command,
            cwd=run.folder,
            env=run.environment(),
            stdout=output,
            stderr=output,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a test in the background ignores it
        ) as own,
    ):
        deadline = time.monotonic() + 240
        while not (jobs := jobs_below(own.pid)) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert jobs
        os.killpg(own.pid, signal.SIGINT)
        assert own.wait(240) == 2
        assert not [job for job in jobs if job.is_running() and job.status() != psutil.STATUS_ZOMBIE]
    assert not half_written(run.folder / "results")
    assert not list((run.folder / ".snakemake/locks").glob("*"))
    planned = run.planned()
    assert "er3_600: write pages and recordings" in planned


def jobs_below(pid: int) -> list[psutil.Process]:
    """The processes below a run that compute; none before there is one."""
    below = [each for each in psutil.Process(pid).children(recursive=True) if each.status() != psutil.STATUS_ZOMBIE]
    try:
        return below if any("compute" in each.cmdline() for each in below) else []
    except psutil.NoSuchProcess:  # one has just ended
        return []
