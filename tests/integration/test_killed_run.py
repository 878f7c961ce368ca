"""A run that is killed goes on where it stopped."""

from __future__ import annotations

import base64
import subprocess
import sys
import time
from pathlib import Path

import pytest

from testing.processes import started
from testing.small_study import STUDY
from tests.conftest import ROBOT, leave_one_robot

COMPUTED = ("compute_inverse", "compute_validation")


def finished_results(run) -> list[Path]:
    """Summaries of stages that Snakemake knows as done: written, and no output marked as in the making.

    The marks are taken away one by one when a job has ended, so a stage with any mark left is made again.
    """
    marks = (run.folder / ".snakemake/incomplete").glob("*")
    in_the_making = {run.folder / Path(base64.urlsafe_b64decode(mark.name).decode()).parent for mark in marks}
    return [path for path in run.folder.glob("results/*/*/summary.json") if path.parent not in in_the_making]


@pytest.mark.long
def test_kill_9_in_mid_run_then_run_again(small_study, fresh_project):
    run = fresh_project("killed")
    leave_one_robot(run.folder / STUDY)
    command = [sys.executable, "-m", "er3a", "run", "--study", STUDY, "--", "--cores", "2"]
    quiet = subprocess.DEVNULL
    with started(command, cwd=run.folder, env=run.environment(), stdout=quiet, stderr=quiet):
        deadline = time.monotonic() + 120
        while not finished_results(run) and time.monotonic() < deadline:
            time.sleep(0.05)
    finished = {path: path.stat().st_mtime_ns for path in finished_results(run)}
    assert finished
    assert any((run.folder / ".snakemake/locks").iterdir()), "the killed run should have left its lock"

    done = run.make_run("--cores", "2", "--until", *COMPUTED)
    assert "left its lock" in done.stderr
    compared = 0
    for rule in COMPUTED:
        for path in small_study.folder.glob(f"results/{ROBOT}/{rule.removeprefix('compute_')}/*"):
            assert (run.folder / path.relative_to(small_study.folder)).read_bytes() == path.read_bytes()
            compared += 1
    assert compared >= 6
    for path, changed in finished.items():
        assert path.stat().st_mtime_ns == changed, f"{path} was finished and yet made again"
