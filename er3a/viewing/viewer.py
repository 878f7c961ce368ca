"""Starting the Rerun viewer so that nobody else can reach it and it tells nobody of its use."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

LOOPBACK = "127.0.0.1"


def viewer_command(recordings: Sequence[Path], *words: str) -> list[str]:
    """The viewer on some recordings; by itself it would listen on all of the machine's addresses."""
    viewer = Path(sys.executable).with_name("rerun")
    return [str(viewer), *map(str, recordings), "--bind", LOOPBACK, *words]


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
