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
from er3a.pipeline.stages.registry import STAGES
from testing.processes import started
from testing.small_study import STUDY
from tests.conftest import ROBOT, leave_one_robot


def finished_results(run) -> list[Path]:
    """Summaries of stages that Snakemake knows as done: written, and no output marked as in the making.

    The marks are taken away one by one when a job has ended, so a stage with any mark left is made again.
    """
    marks = (run.folder / ".snakemake/incomplete").glob("*")
    in_the_making = {run.folder / Path(base64.urlsafe_b64decode(mark.name).decode()).parent for mark in marks}
    return [path for path in run.folder.glob("results/*/*/summary.json") if path.parent not in in_the_making]


@pytest.mark.long
def test_kill_9_in_mid_run_then_the_same_bytes_on_one_core_and_with_another_scatter(small_study, fresh_project):
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

    done = run.make_run("--cores", "1", "--set-scatter", "blocks=3", "--until", "record")
    assert "left its lock" in done.stderr
    results = [path for path in (small_study.folder / "results" / ROBOT).rglob("*") if path.is_file()]
    assert len(results) >= 2 * len(STAGES)
    for path in results:
        assert (run.folder / path.relative_to(small_study.folder)).read_bytes() == path.read_bytes(), path.name
    for path in (small_study.folder / "reports" / ROBOT).rglob("*.rrd"):
        command = [Path(sys.executable).with_name("rerun"), "rrd", "compare", "--unordered", path]
        command.append(run.folder / path.relative_to(small_study.folder))
        compared = subprocess.run(command, capture_output=True, text=True, check=False)
        assert compared.returncode == 0, f"{path}: {compared.stderr[-500:]}"
    kept = {path: at for path, at in finished.items() if path.parent.name != "workspace"}  # its blocks are others now
    for path, changed in kept.items():
        assert path.stat().st_mtime_ns == changed, f"{path} was finished and yet made again"


@pytest.mark.long
@pytest.mark.parametrize(("number", "name"), [(signal.SIGTERM, "SIGTERM"), (signal.SIGINT, "Ctrl-C")])
def test_a_signal_ends_a_run_and_its_jobs_with_one_line_and_without_temporary_files(
    fresh_project, tmp_path, number, name
):
    """Ctrl-C goes to all processes of a terminal, SIGTERM to the run alone."""
    run = fresh_project("ended")
    command = [sys.executable, "-m", "er3a", "run", "--study", "config/small.yaml", "--", "--cores", "2"]
    told = tmp_path / "told"
    environment = run.environment() | {"TMPDIR": str(tmp_path / "temporary")}
    (tmp_path / "temporary").mkdir()
    with (
        told.open("w") as output,
        started(
            command,
            cwd=run.folder,
            env=environment,
            stdout=output,
            stderr=output,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a test in the background ignores it
        ) as own,
    ):
        deadline = time.monotonic() + 120
        while not (jobs := jobs_below(own.pid)) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert jobs
        (os.killpg if number == signal.SIGINT else os.kill)(own.pid, number)
        assert own.wait(60) == 128 + number
        assert not [job for job in jobs if job.is_running() and job.status() != psutil.STATUS_ZOMBIE]
    assert told.read_text().splitlines()[-1].startswith(f"error: ended by {name}")
    assert told.read_text().count("error") == 1
    assert not half_written(run.folder / "results")
    assert not list((run.folder / ".snakemake/locks").glob("*"))
    assert not list((tmp_path / "temporary").iterdir())


def jobs_below(pid: int) -> list[psutil.Process]:
    """The processes of jobs below a run, the server's that do them in their name too; none before there is a job."""
    below = [each for each in psutil.Process(pid).children(recursive=True) if each.status() != psutil.STATUS_ZOMBIE]
    try:
        return below if any({"compute", "sample"} & set(each.cmdline()) for each in below) else []
    except psutil.NoSuchProcess:  # one has just ended
        return []
