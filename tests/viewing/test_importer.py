"""What Rerun's viewer gets when it is asked to open a robot file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from er3a.files.robot_library import robot_path
from er3a.pipeline.viewing.importer import NOT_MINE

ROOT = Path(__file__).resolve().parents[2]


def called(file: Path) -> subprocess.CompletedProcess[bytes]:
    words = [str(file), "--recording-id", "a", "--application-id", "b", "--of-a-later-viewer", "c"]
    command = [sys.executable, "-m", "er3a.pipeline.viewing.importer", *words]
    return subprocess.run(command, capture_output=True, cwd=ROOT, check=False)


@pytest.mark.long
def test_a_robot_file_becomes_a_recording_in_which_each_joint_moves(tmp_path):
    done = called(robot_path("er3_600"))
    assert done.returncode == 0, done.stderr
    (tmp_path / "arm.rrd").write_bytes(done.stdout)
    chunks = RrdReader(tmp_path / "arm.rrd").stream().to_chunks()
    moves = next(each for each in chunks if each.entity_path == "/arm/tool" and not each.is_static)
    places = moves.to_record_batch().column("Transform3D:translation").to_pylist()
    assert len({tuple(np.round(place[0], 6)) for place in places}) > 5 * 50  # the sixth joint moves no point


@pytest.mark.parametrize(
    ("name", "text", "code"),
    [
        ("config.yaml", "kind: study\n", NOT_MINE),
        pytest.param("notes.txt", "", NOT_MINE, marks=pytest.mark.long),
        ("arm.yaml", "kind: robot\n", 1),
    ],
)
def test_other_files_are_left_to_others_and_broken_ones_named(tmp_path, name, text, code):
    (tmp_path / name).write_text(text)
    done = called(tmp_path / name)
    assert (done.returncode, done.stdout) == (code, b"")
    assert (b"error: " in done.stderr) == (code == 1)
