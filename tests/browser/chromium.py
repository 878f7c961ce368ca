"""Headless Chromium, without a graphics processor and without the network."""

from __future__ import annotations

import shutil
from pathlib import Path

from selenium import webdriver

SWITCHES = (
    "headless",
    "no-sandbox",
    "disable-gpu",
    "disable-quic",
    "no-first-run",
    "disable-background-networking",
    "disable-component-update",
    "disable-sync",
    "window-size=1200,900",
)


def lacking() -> str | None:
    """Why there is no browser to test in; None if there is one."""
    return None if _binary() and shutil.which("chromedriver") else "no Chromium with chromedriver on this machine"


def start(profile: Path) -> webdriver.Chrome:
    """Start the browser with a new profile in an empty folder."""
    options = webdriver.ChromeOptions()
    options.binary_location = _binary()
    for switch in (*SWITCHES, f"user-data-dir={profile}"):
        options.add_argument(f"--{switch}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver")))


def _binary() -> str | None:
    return shutil.which("chromium") or shutil.which("google-chrome")
