"""Every recording is sound, and is drawn by the real viewer where its drawing software is present."""

from __future__ import annotations

import ctypes.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

RERUN = Path(sys.executable).with_name("rerun")
RECORDINGS = [
    f"{robot}/{stage}.rrd"
    for robot in ("er3a_c60", "er3a_c60_article", "er3_600")
    for stage in ("validation", "workspace", "inverse", "trajectory")
]


@pytest.fixture(scope="session")
def vulkan() -> None:
    """A Vulkan loader to draw with; skipped with its reason where there is none."""
    if ctypes.util.find_library("vulkan") is None:
        if os.environ.get("CI") == "true":
            pytest.fail("CI must have libvulkan1 and mesa-vulkan-drivers")
        pytest.skip("no Vulkan loader on this machine, so the viewer can't draw without a display")


@pytest.mark.parametrize("recording", RECORDINGS)
def test_recording_is_sound_and_holds_an_arm(small_study, recording):
    path = small_study.folder / "reports" / recording
    assert subprocess.run([RERUN, "rrd", "verify", path], capture_output=True, check=False).returncode == 0
    shown = subprocess.run([RERUN, "rrd", "print", path], capture_output=True, text=True, check=True).stdout
    assert "/link_1" in shown
    assert "TextDocument" in shown
    assert "blueprint" in shown.lower()


@pytest.mark.parametrize("recording", RECORDINGS)
def test_recording_is_drawn(small_study, recording, vulkan, tmp_path):
    picture = tmp_path / "drawn.png"
    command = [RERUN, small_study.folder / "reports" / recording, "--headless", "--screenshot-to", picture]
    subprocess.run([*command, "--window-size", "1200x800"], capture_output=True, timeout=120, check=True)
    assert picture.stat().st_size > 20_000
