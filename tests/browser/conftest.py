"""A real browser, if the machine has one; CI must have one."""

from __future__ import annotations

import os

import pytest

from testing import chromium


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory):
    """Headless Chromium; skipped with its reason where there is none."""
    if reason := chromium.lacking():
        if os.environ.get("CI") == "true":
            pytest.fail("CI must have Chromium and its driver")
        pytest.skip(reason)
    started = chromium.start(tmp_path_factory.mktemp("chromium"))
    yield started
    started.quit()
