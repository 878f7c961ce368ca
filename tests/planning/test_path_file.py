"""Path files: what is refused, and in which words."""

from __future__ import annotations

import copy
from pathlib import Path

import pytest
import yaml

from er3a.errors import InputError
from er3a.files.path_file import load_paths

JOINT = {
    "name": "move",
    "kind": "joint",
    "title": "A move",
    "start_deg": [0, 0, 0, 0, 0, 0],
    "end_deg": [45, 30, -22.5, 60, -45, 90],
    "duration_s": 5,
    "samples": 50,
}
LINE = {
    "name": "line",
    "kind": "line",
    "title": "A line",
    "start": {"xyz_mm": [300, 0, 300], "rpy_deg": [180, 0, 0]},
    "end": {"xyz_mm": [300, 150, 300], "rpy_deg": [180, 0, 0]},
    "duration_s": 2,
    "samples": 20,
}


def write(folder: Path, *paths: dict) -> Path:
    file = folder / "paths.yaml"
    file.write_text(yaml.safe_dump({"kind": "paths", "paths": [copy.deepcopy(path) for path in paths]}))
    return file


@pytest.mark.parametrize("name", ["er3a_c60", "er3a_c60_article", "er3_600"])
def test_files_of_the_project_are_in_order(name):
    paths = load_paths(f"data/paths/{name}.yaml").paths
    assert {path.kind for path in paths} >= {"joint", "line", "arc"}


@pytest.mark.parametrize(
    ("path", "change", "message"),
    [
        (JOINT, {"duration_s": 0}, r"paths\[0\]\.duration_s: 0 is refused"),
        (LINE, {"duration_s": -1}, r"paths\[0\]\.duration_s: -1 is refused"),
        (JOINT, {"samples": 1}, r"paths\[0\]\.samples: 1 is refused"),
        (JOINT, {"end_deg": [0, 0, float("nan"), 0, 0, 0]}, r"paths\[0\]\.end_deg\[2\]: nan is not a finite number"),
        (JOINT, {"durations_s": 5}, r"paths\[0\]\.durations_s: unknown key .*Did you mean 'duration_s'"),
        (LINE, {"end": {"xyz_mm": [0.6, 0.3, 0.5], "rpy_deg": [0, 180, 0]}}, r"paths\[0\]\.end\.xyz_mm.*metres"),
        (LINE, {"start_deg": [0, 0, 0, 0, 0, 0]}, r"paths\[0\]: give either start_deg .* or start"),
        (LINE, {"start": None}, r"paths\[0\]: give either start_deg .* or start"),
        (LINE, {"start": None, "start_deg": [0] * 6, "start_branch": "x"}, r"paths\[0\]\.start_branch"),
        (LINE, {"kind": "arc"}, r"paths\[0\]"),
    ],
)
def test_bad_paths_are_refused_by_field(tmp_path, path, change, message):
    with pytest.raises(InputError, match=message) as caught:
        load_paths(write(tmp_path, path | change))
    assert caught.value.file == str(tmp_path / "paths.yaml")


def test_duplicate_names_and_empty_lists_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"paths\[1\]\.name: 'move' is also that of paths\[0\]"):
        load_paths(write(tmp_path, JOINT, LINE | {"name": "move"}))
    with pytest.raises(InputError, match="paths"):
        load_paths(write(tmp_path))
