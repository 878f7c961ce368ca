"""Which files a vision file and a calibration set name, read without looking at what is in them."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from er3a.files.yaml_file import read_yaml


def vision_files(path: str | Path) -> list[Path]:
    """A vision file, its calibration set, and the tables and images of that."""
    own = Path(path)
    calibration = read_yaml(own).get("calibration")
    return [own, *(calibration_files(own.parent / calibration) if isinstance(calibration, str) else [])]


def calibration_files(path: str | Path) -> list[Path]:
    """A calibration set's own file and the tables and images that it names."""
    path = Path(path)
    head: dict[str, Any] = read_yaml(path)
    streams = head.get("streams")
    named = [head.get("samples"), head.get("touched")]
    named += [streams.get("flange"), streams.get("target")] if isinstance(streams, dict) else []
    files = [path, *(path.parent / name for name in named if isinstance(name, str))]
    if head.get("images") is not None and isinstance(head.get("samples"), str):
        table = path.parent / head["samples"]
        if table.is_file():
            with table.open(encoding="utf-8-sig", newline="") as lines:
                files += [table.parent / row["image"] for row in csv.DictReader(lines) if row.get("image")]
    return files
