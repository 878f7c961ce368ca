"""Starting the Rerun viewer so that nobody else can reach it and it tells nobody of its use."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

LOOPBACK = "127.0.0.1"
LONGEST_S = 120


def viewer_command(recordings: Sequence[Path], *words: str) -> list[str]:
    """The viewer on some recordings; by itself it would listen on all of the machine's addresses."""
    viewer = Path(sys.executable).with_name("rerun")
    return [str(viewer), *map(str, recordings), "--bind", LOOPBACK, *words]


def free_port() -> int:
    """A port that nothing listens on."""
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return probe.getsockname()[1]


@contextmanager
def viewer_running(
    recordings: Sequence[Path], *words: str, messages: Path | None = None
) -> Iterator[subprocess.Popen[bytes]]:
    """A viewer in the background, without statistics; ended with all its processes.

    Should this process be killed, the viewer ends after LONGEST_S where the system has the command `timeout`.

    Parameters
    ----------
    messages : file for what it tells, errors only
    """
    limited = ["timeout", str(LONGEST_S)] if shutil.which("timeout") else []
    told = messages.open("w") if messages else subprocess.DEVNULL
    with without_statistics() as environment:
        viewer = subprocess.Popen(
            [*limited, *viewer_command(recordings, *words)],
            env=environment | {"RUST_LOG": "error", "RUST_BACKTRACE": "0"},  # warnings would be shown in the picture
            stdout=subprocess.DEVNULL,
            stderr=told,
            start_new_session=True,
        )
        try:
            yield viewer
        finally:
            with suppress(ProcessLookupError):
                os.killpg(viewer.pid, signal.SIGKILL)
            viewer.wait()
            if not isinstance(told, int):
                told.close()


def has_display() -> bool:
    """Whether a window can be opened here."""
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
