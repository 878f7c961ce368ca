"""The viewer that `er3a view` starts: reachable from this machine alone, and telling nobody of its use."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import psutil
import pytest

from er3a.errors import ResultError
from er3a.pipeline.cli import app
from er3a.pipeline.commands import options
from er3a.pipeline.results import check_checksum, write_checksum
from er3a.pipeline.viewing.viewer import free_port, viewer_running, without_statistics

RERUN = Path(sys.executable).with_name("rerun")
RECORDING = """
import rerun as rr
with rr.RecordingStream("er3a") as stream:
    stream.save("{path}")
    stream.log("a", rr.Points3D([[0, 0, 0]]))
"""


def with_home(folder: Path) -> dict[str, str]:
    """An environment with an empty home, in which Rerun would begin to collect statistics (in CI it never does)."""
    (folder / "home").mkdir()
    kept = {key: value for key, value in os.environ.items() if not key.startswith("XDG_") and key != "CI"}
    return kept | {"HOME": str(folder / "home")}


@pytest.fixture
def home(tmp_path):
    return with_home(tmp_path)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A recording, and the environment that it was written in."""
    folder = tmp_path_factory.mktemp("written")
    path, environment = folder / "a.rrd", with_home(folder)
    subprocess.run([sys.executable, "-c", RECORDING.format(path=path)], env=environment, check=True, timeout=60)
    return path, environment


@pytest.fixture
def recording(written, tmp_path):
    return Path(shutil.copy(written[0], tmp_path / "a.rrd"))


def kept_in(home) -> list[str]:
    return [str(path) for path in Path(home["HOME"]).rglob("*rerun*")]


@pytest.mark.long
def test_writing_a_recording_leaves_no_statistics(written):
    path, environment = written
    assert path.stat().st_size > 0
    assert kept_in(environment) == []


@pytest.mark.long
def test_rerun_collects_statistics_by_itself(home, recording):
    subprocess.run([RERUN, "rrd", "verify", recording], env=home, check=True, capture_output=True, timeout=60)
    assert kept_in(home), "if this fails, Rerun has changed its ways, and without_statistics() may be of no use"


@pytest.mark.long
def test_without_statistics_it_does_not(home, recording):
    with without_statistics() as environment:
        quiet = home | {"XDG_CONFIG_HOME": environment["XDG_CONFIG_HOME"]}
        told = subprocess.run([RERUN, "analytics", "config"], env=quiet, check=True, capture_output=True, timeout=60)
        subprocess.run([RERUN, "rrd", "verify", recording], env=quiet, check=True, capture_output=True, timeout=60)
        folder = Path(environment["XDG_CONFIG_HOME"])
        assert [path.name for path in folder.rglob("*") if path.is_file()] == ["analytics.json"]
    assert json.loads(told.stdout)["analytics_enabled"] is False
    assert kept_in(home) == []
    assert not folder.exists()


def listened_to(process: psutil.Process) -> list:
    """Addresses that a process or one that it started listens on."""
    connections = []
    for each in (process, *process.children(recursive=True)):
        with suppress(psutil.NoSuchProcess):
            connections += each.net_connections()
    return [connection.laddr for connection in connections if connection.status == psutil.CONN_LISTEN]


@pytest.mark.long
def test_it_listens_on_the_loopback_address_alone(recording):
    port, page = free_port(), free_port()
    words = ("--serve-web", "--port", str(port), "--web-viewer-port", str(page))
    with viewer_running([recording], *words) as viewer:
        deadline = time.monotonic() + 60
        listening: list = []
        while not {port, page} <= {address.port for address in listening}:
            assert time.monotonic() < deadline
            assert viewer.poll() is None, "the viewer ended early"
            time.sleep(0.1)
            listening = listened_to(psutil.Process(viewer.pid))
    assert {address.ip for address in listening} == {"127.0.0.1"}


@pytest.mark.long
def test_a_recording_cut_in_half_is_one_line_and_is_not_opened(recording, monkeypatch):
    from typer.testing import CliRunner

    reports = recording.parent
    folder = reports / "er3_600"
    folder.mkdir()
    path = recording.rename(folder / "inverse.rrd")
    write_checksum(path)
    check_checksum(path)
    monkeypatch.setenv("DISPLAY", ":0")
    started = []
    monkeypatch.setattr(subprocess, "run", lambda command, **_: started.append(command))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    monkeypatch.setattr(options, "REPORTS", reports)
    done = CliRunner().invoke(app, ["view"])
    assert isinstance(done.exception, ResultError)
    assert str(done.exception).startswith(f"{path}: damaged (its checksum does not agree). Delete the file")
    assert started == []
