"""Every recording is sound, and is drawn by the real viewer where its drawing software is present."""

from __future__ import annotations

import colorsys
import ctypes.util
import os
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rerun.experimental import ViewerClient

from er3a.viewing.palette import JOINTS, rgb
from tests.conftest import viewer_on

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
    path, picture = small_study.folder / "reports" / recording, tmp_path / "drawn.png"
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with viewer_on(path, "--port", str(port), "--window-size", "1200x800") as viewer:
        deadline = time.monotonic() + 90
        while joints_drawn(port, picture) < 4:  # it takes a while to load
            assert time.monotonic() < deadline, "the picture shows no arm: fewer than four joint colours"
            assert viewer.poll() is None, "the viewer ended early"
            time.sleep(0.5)


def joints_drawn(port: int, picture: Path) -> int:
    """Have the viewer draw itself; how many joints its picture shows, 0 while it does not answer."""
    try:
        ViewerClient(f"rerun+http://127.0.0.1:{port}/proxy").save_screenshot(str(picture))
    except (ConnectionError, RuntimeError):
        return 0
    return joints_seen(picture)


def joints_seen(picture: Path) -> int:
    """How many of the six joints' colours (by hue, shaded as they are) fill a spot of the picture."""
    pixels = Image.open(picture).convert("HSV").resize((1200, 800), Image.Resampling.NEAREST)
    hue, saturation, value = (np.asarray(band, dtype=float) for band in pixels.split())
    strong = (saturation > 100) & (value > 60)
    seen = 0
    for colour in JOINTS:
        wanted = colorsys.rgb_to_hsv(*(part / 255 for part in rgb(colour)))[0] * 255
        apart = np.abs((hue - wanted + 127.5) % 255 - 127.5)
        seen += int((strong & (apart < 4)).sum() > 40)
    return seen
