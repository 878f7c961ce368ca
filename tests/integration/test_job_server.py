"""Jobs that a server forks: they are what the command itself would have done, and end with it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from er3a.pipeline import job_server
from testing.small_study import ROOT

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(sys.platform != "linux", reason="elsewhere jobs are not forked"),
]


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """A server; yields the environment of its jobs."""
    lock = os.open(tmp_path_factory.mktemp("run") / "lock", os.O_RDWR | os.O_CREAT)
    with job_server.running(lock):
        yield os.environ | job_server.SETTINGS
    os.close(lock)


def _job(environment, *words: str, **how) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "er3a", *words]
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, env=environment, **streams, **how)


def _children(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def _server_pid() -> int:
    (found,) = [pid for pid in _children(os.getpid()) if b"job_server" in Path(f"/proc/{pid}/cmdline").read_bytes()]
    return found


@pytest.mark.parametrize("words", [("compute", "inverse", "no_arm"), ("report", "--help")])
def test_a_job_ends_as_without_a_server(server, words, tmp_path):
    own = {key: value for key, value in server.items() if key != job_server.ADDRESS}
    (alone, forked) = (_job(each, *words, cwd=ROOT) for each in (own, server))
    assert (alone.communicate(), alone.wait()) == (forked.communicate(), forked.wait())


def test_a_job_reads_the_folder_and_the_environment_of_its_command(server, tmp_path):
    (tmp_path / "mine.yaml").write_text("kind: robot\n", encoding="utf-8")
    job = _job(server | {"ER3A_STUDY": "mine.yaml"}, "compute", "inverse", "er3_600", cwd=tmp_path)
    assert "error: mine.yaml" in job.communicate()[1]
    assert job.returncode == 2


def test_a_job_whose_command_is_killed_ends(server):
    job = _job(server, "compute", "inverse", "er3_600", "--results", os.devnull, cwd=ROOT)
    deadline = time.monotonic() + 60
    while not (running := _children(_server_pid())):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    job.send_signal(signal.SIGKILL)
    job.communicate()
    while any(Path(f"/proc/{pid}").exists() for pid in running):
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_other_commands_are_not_handed_over(server, monkeypatch):
    monkeypatch.setattr(os, "environ", server)
    assert job_server.hand_over(["check", "config/config.yaml"]) is None
    assert job_server.hand_over([]) is None


def test_what_a_server_loads_before_it_forks_starts_no_threads():
    """Rerun's runtime begins as it is imported, and a fork leaves its threads behind: a job would wait for ever."""
    words = (
        "import sys; from er3a.pipeline import job_server; job_server.load_libraries(); print('rerun' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", words], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False"]
