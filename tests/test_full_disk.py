"""A disk that is full or read-only: one line that names the file, nothing half-written, and never a wait."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
import rerun.blueprint as rrb

from er3a.errors import WriteError
from er3a.files.kept_files import write_atomically
from er3a.numerics.arrays import Reals
from er3a.pipeline.tables import Table, vector
from er3a.pipeline.viewing.recording import recording


class Points(Table):
    """Many points."""

    point_m: Reals = vector("{}_m", "where", "m")


NOISE = np.random.default_rng(1).random((20_000, 3))


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 200 kB; only root may make one."""
    if os.geteuid() != 0:
        if os.environ.get("CI") == "true":
            pytest.fail("CI must run as root, to make a small file system")
        pytest.skip("only root can make a small file system (tmpfs)")
    disk = tmp_path / "disk"
    disk.mkdir()
    made = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=200k", "er3a-test", disk], check=False)
    if made.returncode != 0:
        pytest.skip("this machine lets not even root mount a tmpfs")
    yield disk
    subprocess.run(["umount", disk], check=True)


def write_large_table(path: Path) -> None:
    write_atomically(path, Points(NOISE).write)


def write_large_recording(path: Path) -> None:
    with recording(path, "er3_600", "inverse", rrb.Spatial3DView()) as stream:
        stream.log("cloud", rr.Points3D(NOISE))


@pytest.mark.parametrize("write", [write_large_table, write_large_recording])
def test_a_full_disk(small_disk, write):
    path = small_disk / "folder" / "file.out"
    with pytest.raises(WriteError, match=r"file\.out: can't be written .No space left on device") as caught:
        write(path)
    assert "\n" not in str(caught.value)
    assert list(path.parent.iterdir()) == []


@pytest.mark.parametrize("write", [write_large_table, write_large_recording])
def test_a_disk_that_can_only_be_read(small_disk, write):
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    with pytest.raises(WriteError, match=r"file\.out: can't be written .Read-only file system"):
        write(small_disk / "file.out")
