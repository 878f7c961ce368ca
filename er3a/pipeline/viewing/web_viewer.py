"""Recordings shown in a browser on this machine, for where there is no desktop.

Rerun's own web server would let the viewer in the browser report its use, ask for updates and fetch fonts, and hands
recordings over without their blueprints. So the viewer's files are taken from it once, and served from here together
with the recordings, under a policy with which a browser connects to no other address.
"""

from __future__ import annotations

import re
import signal
import time
import urllib.request
from collections.abc import Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import urlencode

from er3a.errors import Er3aError
from er3a.pipeline.viewing.viewer import LOOPBACK, free_port, viewer_running

VIEWER_FILES = ("", "re_viewer.js", "re_viewer_bg.wasm", "favicon.ico")
POLICY = "default-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' data: blob:"
PATIENCE_S = 30


def serve(recordings: Sequence[Path]) -> None:
    """Serve recordings to a browser on this machine, until Ctrl+C or a request to end (SIGTERM)."""
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
    """A server on a free port of the loopback address, for the viewer's files and recordings."""
    files = _viewer_files() | {_place(path): ("application/octet-stream", path.read_bytes()) for path in recordings}

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
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
    """The address that shows the recordings."""
    root = f"http://{LOOPBACK}:{listening.server_port}"
    shown = [("url", root + _place(recording)) for recording in recordings]
    return f"{root}/?{urlencode([('hide_welcome_screen', ''), ('persist', '0'), *shown], safe=':/')}"


def _place(recording: Path) -> str:
    return f"/{recording.parent.name}/{recording.name}"


def _viewer_files() -> dict[str, tuple[str, bytes]]:
    """Type and content of the web viewer's files, by path."""
    port, deadline = free_port(), time.monotonic() + PATIENCE_S
    words = ("--serve-web", "--port", str(free_port()), "--web-viewer-port", str(port))
    with viewer_running([], *words) as viewer:
        while viewer.poll() is None and time.monotonic() < deadline:
            try:
                return {f"/{name}": _fetched(f"http://{LOOPBACK}:{port}/{name}") for name in VIEWER_FILES}
            except OSError:
                time.sleep(0.05)
    raise Er3aError("Rerun's web viewer does not start; on a machine with a desktop `er3a view` opens a window")


def _fetched(url: str) -> tuple[str, bytes]:
    with urllib.request.urlopen(url, timeout=PATIENCE_S) as answer:
        kind, content = answer.headers["Content-Type"], answer.read()
    # No policy keeps a browser from connecting ahead of a font that it may not load then.
    return kind, re.sub(rb"<link\b[^>]*https://[^>]*>", b"", content) if kind.startswith("text/html") else content
