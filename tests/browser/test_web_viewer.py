"""Recordings in a browser: the viewer shows them, and nobody outside is asked for anything."""

from __future__ import annotations

import threading
import time

import pytest
from selenium.common.exceptions import TimeoutException

from er3a.pipeline.viewing.viewer import address, server
from testing import chromium
from tests.viewing.pictures import joints_seen

pytestmark = pytest.mark.long

DRAWS_BY_ITSELF = ("use-angle=swiftshader", "enable-unsafe-swiftshader", "window-size=1000,700")
PATIENCE_S = 300


@pytest.fixture
def drawing_browser(browser, tmp_path, monkeypatch):
    """A browser that draws in 3-D without a graphics processor (``browser`` tells whether there is one at all)."""
    switches = [switch for switch in chromium.SWITCHES if not switch.startswith(("disable-gpu", "window-size"))]
    monkeypatch.setattr(chromium, "SWITCHES", (*switches, *DRAWS_BY_ITSELF))
    started = chromium.start(tmp_path / "profile")
    yield started
    started.quit()


def joints_shown(browser) -> int:
    """How many joints the browser shows, 0 while it is too busy to say."""
    try:
        return joints_seen(browser.get_screenshot_as_png())
    except TimeoutException:
        return 0


def test_the_viewer_shows_a_recording_in_its_layout_and_asks_nobody_else(small_study, drawing_browser):
    recordings = [small_study.folder / "reports/er3_600/inverse.rrd"]
    with server(recordings) as listening:
        threading.Thread(target=listening.serve_forever, daemon=True).start()
        drawing_browser.get(address(listening, recordings))
        deadline = time.monotonic() + PATIENCE_S
        while joints_shown(drawing_browser) < 4:
            assert time.monotonic() < deadline, "the browser shows no arm: fewer than four joint colours"
            time.sleep(1)
        asked = drawing_browser.execute_script("return performance.getEntriesByType('resource').map((one) => one.name)")
        listening.shutdown()
    root = f"http://127.0.0.1:{listening.server_port}/"
    assert f"{root}er3_600/inverse.rrd" in asked
    assert [url for url in asked if not url.startswith(root)] == []
    refused = [
        entry["message"] for entry in drawing_browser.get_log("browser") if "Security Policy" in entry["message"]
    ]
    assert any("tel.rerun.io" in message for message in refused), "Rerun's statistics have moved; look where they go"
