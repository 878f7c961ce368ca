"""Starts the Rerun viewer on the loopback address only and without usage statistics.

Shows recordings in a browser on this machine if there is no desktop.

With Rerun's own web server the viewer in the browser would send usage statistics, ask for updates and fetch fonts, and
recordings would lose their blueprints. So the viewer's files are taken from it once and served from here, together with
the recordings, under a policy that lets the browser connect to no other address.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import urlencode

from er3a.errors import Er3aError

LOOPBACK = "127.0.0.1"
LONGEST_S = 120
PROGRAMS = ("Rerun.app/Contents/MacOS/Rerun", "rerun.exe", "rerun")


def viewer_command(recordings: Sequence[Path], *words: str) -> list[str]:
    """The command that opens Rerun's viewer on some recordings.

    Parameters
    ----------
    words : further options of the viewer

    Returns
    -------
    command : bound to the loopback address; by itself the viewer would listen on all of the machine's addresses
    """
    import rerun_cli

    # The program itself: Rerun's script would start it as a process of its own, which outlives the script on Windows.
    folder = Path(str(rerun_cli.__file__)).parent
    program = next(folder / name for name in PROGRAMS if (folder / name).is_file())
    return [str(program), *map(str, recordings), "--bind", LOOPBACK, *words]


def free_port() -> int:
    """A port of the loopback address that nothing listens on.

    Returns
    -------
    port : free when it was asked for; another program may take it meanwhile
    """
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return probe.getsockname()[1]


@contextmanager
def viewer_running(recordings: Sequence[Path], *words: str) -> Iterator[subprocess.Popen[bytes]]:
    """A viewer in the background, without statistics; ended with all its processes.

    Should this process be killed, the viewer ends after LONGEST_S where the system has the command `timeout`.
    """
    limited = ["timeout", str(LONGEST_S)] if shutil.which("timeout") else []
    with without_statistics() as environment:
        viewer = subprocess.Popen(
            [*limited, *viewer_command(recordings, *words)],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            yield viewer
        finally:
            _end_all(viewer)
            viewer.wait()


def _end_all(viewer: subprocess.Popen[bytes]) -> None:
    """End a viewer, and on all systems but Windows, where it starts none, its processes."""
    if sys.platform == "win32":
        viewer.kill()
        return
    with suppress(ProcessLookupError):
        os.killpg(viewer.pid, signal.SIGKILL)


def has_display() -> bool:
    """Whether a window can be opened here.

    Returns
    -------
    display : True on other systems than Linux; there, whether X11 or Wayland is named in the environment
    """
    return sys.platform != "linux" or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))


@contextmanager
def without_statistics() -> Iterator[dict[str, str]]:
    """An environment in which Rerun's programs collect no usage statistics, on Linux.

    Rerun 0.41 takes this setting from a file alone (``$XDG_CONFIG_HOME/rerun/analytics.json``), so one is made for the
    time being; the user's own is not touched. The library that writes recordings collects none.
    """
    with TemporaryDirectory(prefix="er3a-viewer-") as folder:
        settings = Path(folder) / "rerun" / "analytics.json"
        settings.parent.mkdir()
        content = {
            "analytics_enabled": False,
            "analytics_id": "",
            "metadata": {},
            "config_file_path": str(settings),
            "data_dir_path": str(settings.parent),
        }
        settings.write_text(json.dumps(content), encoding="utf-8")
        yield os.environ | {"XDG_CONFIG_HOME": folder}


VIEWER_FILES = ("", "re_viewer.js", "re_viewer_bg.wasm", "favicon.ico")
POLICY = "default-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' data: blob:"
SERVER_PATIENCE_S = 30


def serve(recordings: Sequence[Path]) -> None:
    """Serve recordings to a browser on this machine, until Ctrl+C or a request to end (SIGTERM).

    Parameters
    ----------
    recordings : read once, when this begins; the address is printed
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with server(recordings) as listening:
        port = listening.server_port
        print("There is no desktop here. Ctrl+C stops what is served to a browser on this machine at")
        print(f"  {address(listening, recordings)}")
        print(f"To reach it from another machine: ssh -L {port}:{LOOPBACK}:{port} THIS_MACHINE", flush=True)
        try:
            listening.serve_forever()
        except KeyboardInterrupt:
            print()


def server(recordings: Sequence[Path]) -> ThreadingHTTPServer:
    """A server for the viewer's files and recordings.

    Parameters
    ----------
    recordings : read into memory here

    Returns
    -------
    server : on a free port of the loopback address; it lets the browser connect to no other address
    """
    files = _viewer_files() | {_place(path): ("application/octet-stream", path.read_bytes()) for path in recordings}

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            """Answer with a file that is kept in memory, under the policy; 404 for any other path."""
            kind, content = files.get(self.path.partition("?")[0], (None, b""))
            self.send_response(200 if kind else 404)
            self.send_header("Content-Type", kind or "text/plain")
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Content-Security-Policy", POLICY)
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *_: object) -> None:
            """Say nothing of each request."""

    return ThreadingHTTPServer((LOOPBACK, 0), Handler)


def address(listening: ThreadingHTTPServer, recordings: Sequence[Path]) -> str:
    """The address that shows recordings in the browser.

    Parameters
    ----------
    listening : of :func:`server`, for the same recordings

    Returns
    -------
    address : on the loopback address, with all recordings in its query
    """
    root = f"http://{LOOPBACK}:{listening.server_port}"
    shown = [("url", root + _place(recording)) for recording in recordings]
    return f"{root}/?{urlencode([('hide_welcome_screen', ''), ('persist', '0'), *shown], safe=':/')}"


def _place(recording: Path) -> str:
    return f"/{recording.parent.name}/{recording.name}"


def _viewer_files() -> dict[str, tuple[str, bytes]]:
    """Type and content of the web viewer's files, by path."""
    port, deadline = free_port(), time.monotonic() + SERVER_PATIENCE_S
    words = ("--serve-web", "--port", str(free_port()), "--web-viewer-port", str(port))
    with viewer_running([], *words) as viewer:
        while viewer.poll() is None and time.monotonic() < deadline:
            try:
                return {f"/{name}": _fetched(f"http://{LOOPBACK}:{port}/{name}") for name in VIEWER_FILES}
            except OSError:
                time.sleep(0.05)
    raise Er3aError("Rerun's web viewer does not start; on a machine with a desktop `er3a view` opens a window")


def _fetched(url: str) -> tuple[str, bytes]:
    with urllib.request.urlopen(url, timeout=SERVER_PATIENCE_S) as answer:
        kind, content = answer.headers["Content-Type"], answer.read()
    # No policy keeps a browser from connecting ahead of a font that it may not load then.
    return kind, re.sub(rb"<link\b[^>]*https://[^>]*>", b"", content) if kind.startswith("text/html") else content
