"""A run that is killed goes on where it stopped."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time


def test_kill_9_in_mid_run_then_run_again(small_study, fresh_project):
    run = fresh_project("killed")
    command = [sys.executable, "workflow/scripts/run.py", "--study", "config/small.yaml", "--", "--cores", "2"]
    process = subprocess.Popen(
        command,
        cwd=run.folder,
        env=run.environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    deadline = time.monotonic() + 120
    while not list(run.folder.glob("results/*/*/summary.json")) and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    finished = {path: path.stat().st_mtime_ns for path in run.folder.glob("results/*/inverse/summary.json")}
    assert any((run.folder / ".snakemake/locks").iterdir()), "the killed run should have left its lock"

    done = run.make_run("--cores", "2", "--until", "compute_inverse")
    assert "left its lock" in done.stdout
    for path in small_study.folder.glob("results/*/inverse/*"):
        assert (run.folder / path.relative_to(small_study.folder)).read_bytes() == path.read_bytes()
    for path, changed in finished.items():
        assert path.stat().st_mtime_ns == changed, f"{path} was finished and yet made again"


def test_two_runs_at_once_are_refused(small_study):
    import fcntl

    with open(small_study.folder / ".snakemake/er3a.lock") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = small_study.make_run(check=False)
    assert done.returncode == 2
    assert done.stderr == "error: another run is active in this folder; wait for its end, or stop it\n"
