"""Headless Chromium, without the network; the processor draws what else a graphics processor would."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
from selenium import webdriver

SWITCHES = (
    "headless",
    "no-sandbox",
    "use-gl=angle",
    "use-angle=swiftshader",
    "enable-unsafe-swiftshader",
    "disable-gpu-rasterization",  # pages are painted faster without a graphics processor that is computed, too
    "disable-gpu-compositing",
    "disable-quic",
    "no-first-run",
    "disable-background-networking",
    "disable-component-update",
    "disable-sync",
    "window-size=1200,900",
)


def lacking() -> str | None:
    """Why no browser is available for tests; None if one is."""
    return None if _binary() and shutil.which("chromedriver") else "no Chromium with chromedriver on this machine"


def start(profile: Path) -> webdriver.Chrome:
    """Start the browser with a new profile in an empty folder."""
    options = webdriver.ChromeOptions()
    options.binary_location = _binary()
    for switch in (*SWITCHES, f"user-data-dir={profile}"):
        options.add_argument(f"--{switch}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    browser = webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver")))
    # Without a screen some versions never give the page the focus, and its elements no event of it.
    browser.execute_cdp_cmd("Emulation.setFocusEmulationEnabled", {"enabled": True})
    return browser


@contextmanager
def emulating(browser: webdriver.Chrome, width: int = 0, height: int = 900, **media: str) -> Iterator[None]:
    """A screen of another size (CSS px), printed sheets (``type="print"``), or another preference of the reader.

    Preferences are named as in CSS with underscores: ``prefers_color_scheme="dark"``.
    """
    features = [{"name": name.replace("_", "-"), "value": value} for name, value in media.items() if name != "type"]
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": media.get("type", ""), "features": features})
    if width:
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        yield
    finally:
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def processor_time(browser: webdriver.Chrome) -> float:
    """Seconds that all processes of the browser have computed."""
    processes = psutil.Process(browser.service.process.pid).children(recursive=True)
    return sum(sum(process.cpu_times()[:2]) for process in processes)


def _binary() -> str | None:
    return shutil.which("chromium") or shutil.which("google-chrome")
