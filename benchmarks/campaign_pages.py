"""The finished study's pages in a real browser without a graphics processor: size and time to usable."""

from __future__ import annotations

import os
import statistics
import tempfile
from pathlib import Path

from er3a.pipeline.study import load_study
from testing import chromium

REPORTS = Path("reports").resolve()
SCREENS = {"laptop": (1280, 900), "4K": (3840, 2160)}
OPENINGS = 3
LARGEST_MB, LONGEST_MS = 2.0, 1000  # of a page, and until its first paint
QUIET_MS = 500  # without a long task: the page has settled

USABLE = """
const [quiet, done] = arguments;
let end = performance.getEntriesByType("navigation")[0].loadEventEnd;
const note = (list) => list.getEntries().forEach((task) => (end = Math.max(end, task.startTime + task.duration)));
new PerformanceObserver(note).observe({ type: "longtask", buffered: true });
const wait = () => (performance.now() - end > quiet ? done(end) : setTimeout(wait, 50));
setTimeout(wait, 50);
"""
FIRST_PAINT = "return performance.getEntriesByName('first-contentful-paint')[0].startTime"


def opened(browser, page: Path) -> tuple[float, float]:
    """Milliseconds from the start of the navigation: until the first paint of content, and until it is usable; medians.

    It is usable when the page has loaded and its main thread is free.
    """
    painted, usable = [], []
    for _ in range(OPENINGS):
        browser.get("about:blank")
        browser.get(page.as_uri())
        usable.append(browser.execute_async_script(USABLE, QUIET_MS))
        painted.append(browser.execute_script(FIRST_PAINT))
    return statistics.median(painted), statistics.median(usable)


def table() -> str:
    """The evidence as Markdown."""
    if reason := chromium.lacking():
        raise SystemExit(f"error: {reason}")
    study = load_study("config/config.yaml")
    shown = {robot: (*study.stages(robot), "teach") for robot in study.robots}
    pages = ["index.html", *(f"{robot}/{page}.html" for robot in shown for page in shown[robot])]
    if missing := [page for page in pages if not (REPORTS / page).is_file()]:
        raise SystemExit(f"error: reports/{missing[0]} is missing; `make run` writes it")
    load = os.getloadavg()[0]
    rows, first_paint, slowest, largest = [], 0.0, 0.0, 0.0
    with tempfile.TemporaryDirectory() as folder:
        browser = chromium.start(Path(folder))
        browser.set_script_timeout(120)
        try:
            for page in pages:
                file = REPORTS / page
                size, times = file.stat().st_size / 1e6, []
                for width, height in SCREENS.values():
                    with chromium.emulating(browser, width, height):
                        times.append(opened(browser, file))
                first_paint, slowest, largest = (
                    max(first_paint, *(painted for painted, _ in times)),
                    max(slowest, *(usable for _, usable in times)),
                    max(largest, size),
                )
                both = " | ".join(f"{painted:.0f} / {usable:.0f}" for painted, usable in times)
                rows.append(f"| {page} | {size:.2f} | {both} |")
                print(rows[-1], flush=True)
        finally:
            browser.quit()
    screens = " | ".join(
        f"first paint / usable, {name} {width} x {height} (ms)" for name, (width, height) in SCREENS.items()
    )
    lines = [
        "# The pages in a real browser",
        "",
        "The default study's pages in headless Chromium with `--disable-gpu`: the processor paints everything, 3-D",
        "figures too. *First paint*: from the start of the navigation until content is painted. *Usable*: until the",
        "load event is over, all scripts have run and the main thread is free: the last task over 50 ms before",
        f"{QUIET_MS} ms without one has ended. Medians of {OPENINGS} openings.",
        "",
        f"Largest page: {largest:.2f} MB (limit {LARGEST_MB:.0f} MB). Slowest first paint: {first_paint:.0f} ms (limit "
        f"{LONGEST_MS} ms). Slowest usable: {slowest:.0f} ms.",
        f"Load average at the start: {load:.1f} on {os.cpu_count()} processors; times suffer from load.",
        "Written by `make campaigns ARGS=pages` after `make run`.",
        "",
        f"| page | size (MB) | {screens} |",
        "|---|---|---|---|",
        *rows,
    ]
    return "\n".join(lines) + "\n"
