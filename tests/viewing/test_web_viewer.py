"""The server that shows recordings in a browser."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from urllib.parse import parse_qs, urlsplit

import psutil
import pytest

from er3a.pipeline.cli import app
from er3a.pipeline.commands import options
from er3a.pipeline.results import write_checksum
from er3a.pipeline.viewing import viewer
from testing.processes import started

# A shell without a terminal starts what runs in the background with SIGINT ignored, and so do all its children.
AS_FROM_A_TERMINAL = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from er3a.pipeline.cli import main
main()
"""


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """Reports with two recordings; what is in them does not matter here."""
    folder = tmp_path_factory.mktemp("viewed") / "reports"
    for stage in ("inverse", "workspace"):
        path = folder / f"er3_600/{stage}.rrd"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(f"recording of {stage}".encode())
        write_checksum(path)
    return folder


@pytest.fixture(scope="module")
def root(reports):
    """The address of a server of these recordings."""
    recordings = sorted(reports.glob("*/*.rrd"))
    with viewer.server(recordings) as listening:
        threading.Thread(target=listening.serve_forever, daemon=True).start()
        yield viewer.address(listening, recordings)
        listening.shutdown()


def fetched(address: str, path: str):
    return urllib.request.urlopen(f"http://{urlsplit(address).netloc}{path}", timeout=60)


def test_each_recording_is_in_the_address_and_is_served_as_it_is(root):
    shown = parse_qs(urlsplit(root).query)["url"]
    content = [urllib.request.urlopen(url, timeout=60).read() for url in shown]
    assert content == [b"recording of inverse", b"recording of workspace"]


@pytest.mark.parametrize("path", ["/", "/re_viewer.js", "/re_viewer_bg.wasm", "/er3_600/inverse.rrd"])
def test_a_browser_may_connect_to_nothing_else(root, path):
    with fetched(root, path) as answer:
        answer.read()
        assert answer.headers["Content-Security-Policy"].startswith("default-src 'self'")
        assert "http" not in answer.headers["Content-Security-Policy"]


def test_the_page_names_no_font_elsewhere(root):
    with fetched(root, "/") as answer:
        page = answer.read().decode()
    assert "re_viewer.js" in page
    assert [link for link in re.findall("<link[^>]*>", page) if "://" in link] == []


@pytest.mark.parametrize("path", ["/er3_600/", "/../../etc/passwd", "/er3_600/.inverse.rrd.sha256"])
def test_nothing_else_is_served(root, path):
    with pytest.raises(urllib.error.HTTPError, match="404"):
        fetched(root, path)


@pytest.mark.long
@pytest.mark.parametrize("request_to_end", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
def test_without_a_desktop_view_serves_on_the_loopback_address_until_it_is_told_to_end(reports, request_to_end):
    quiet = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-c", AS_FROM_A_TERMINAL, "view", "er3_600"]
    with started(command, cwd=reports.parent, env=quiet, stdout=subprocess.PIPE) as viewing:
        told = [viewing.stdout.readline() for _ in range(3)]
        assert "Ctrl+C" in told[0]
        with urllib.request.urlopen(told[1].strip(), timeout=60) as answer:
            assert answer.read().startswith(b"<!")
        process = psutil.Process(viewing.pid)
        listening = [one.laddr for one in process.net_connections() if one.status == psutil.CONN_LISTEN]
        assert [(one.ip, one.port) for one in listening] == [("127.0.0.1", urlsplit(told[1].strip()).port)]
        assert process.children(recursive=True) == []
        viewing.send_signal(request_to_end)
        assert viewing.wait(timeout=60) == 0


def test_with_a_desktop_view_opens_a_window(reports, monkeypatch):
    from typer.testing import CliRunner

    started = []
    monkeypatch.setenv("DISPLAY", ":0")
    ended = subprocess.CompletedProcess([], 0)
    monkeypatch.setattr(subprocess, "run", lambda command, **_: started.append(command) or ended)
    monkeypatch.setattr(options, "REPORTS", reports)
    assert CliRunner().invoke(app, ["view"]).exit_code == 0
    assert [part for part in started[0] if part.endswith(".rrd")] == sorted(map(str, reports.glob("*/*.rrd")))
