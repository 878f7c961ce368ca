"""The finished study's pages in a real browser without a graphics processor: size and time to usable."""

from __future__ import annotations

import os
import statistics
import tempfile
from pathlib import Path

from er3a.pipeline.study import STAGES, load_study
from testing import chromium

REPORTS = Path("reports").resolve()
SCREENS = {"laptop": (1280, 900), "4K": (3840, 2160)}
OPENINGS = 3
LARGEST_MB, LONGEST_MS = 6.0, 1500
QUIET_MS = 500  # without a long task: the page has settled

USABLE = """
const [quiet, done] = arguments;
let end = performance.getEntriesByType("navigation")[0].loadEventEnd;
const note = (list) => list.getEntries().forEach((task) => (end = Math.max(end, task.startTime + task.duration)));
new PerformanceObserver(note).observe({ type: "longtask", buffered: true });
const wait = () => (performance.now() - end > quiet ? done(end) : setTimeout(wait, 50));
setTimeout(wait, 50);
"""
DRAWN = """
const [done] = arguments, start = performance.now();
const figure = document.getElementById("turning");
figure.scrollIntoView();
const isDrawn = () => performance.getEntriesByName("turning").length;
const wait = () => (isDrawn() ? done(performance.now() - start) : setTimeout(wait, 20));
wait();
"""


def usable(browser, page: Path) -> float:
    """Milliseconds from the start of the navigation until the page has loaded and its main thread is free; median."""
    times = []
    for _ in range(OPENINGS):
        browser.get("about:blank")
        browser.get(page.as_uri())
        times.append(browser.execute_async_script(USABLE, QUIET_MS))
    return statistics.median(times)


def drawn(browser, page: Path) -> float:
    """Milliseconds from scrolling to a page's 3-D figure until it is drawn."""
    browser.get(page.as_uri())
    return browser.execute_async_script(DRAWN)


def table() -> str:
    """The evidence as Markdown."""
    if reason := chromium.lacking():
        raise SystemExit(f"error: {reason}")
    robots = load_study("config/config.yaml").robots
    pages = ["index.html", "compare.html", *(f"{robot}/{page}.html" for robot in robots for page in (*STAGES, "teach"))]
    if missing := [page for page in pages if not (REPORTS / page).is_file()]:
        raise SystemExit(f"error: reports/{missing[0]} is missing; `make run` writes it")
    load = os.getloadavg()[0]
    rows, slowest, largest = [], 0.0, 0.0
    with tempfile.TemporaryDirectory() as folder:
        browser = chromium.start(Path(folder))
        browser.set_script_timeout(120)
        try:
            for page in pages:
                file = REPORTS / page
                size, times = file.stat().st_size / 1e6, []
                for width, height in SCREENS.values():
                    with chromium.emulating(browser, width, height):
                        times.append(usable(browser, file))
                with chromium.emulating(browser, *SCREENS["laptop"]):
                    turning = f"{drawn(browser, file):.0f}" if 'id="turning"' in file.read_text("utf-8") else "–"
                slowest, largest = max(slowest, *times), max(largest, size)
                rows.append(f"| {page} | {size:.2f} | {' | '.join(f'{time:.0f}' for time in times)} | {turning} |")
                print(rows[-1], flush=True)
        finally:
            browser.quit()
    screens = " | ".join(f"usable, {name} {width} x {height} (ms)" for name, (width, height) in SCREENS.items())
    lines = [
        "# The pages in a real browser",
        "",
        "The default study's pages in headless Chromium with `--disable-gpu`: the processor paints everything, 3-D",
        "figures too. *Usable*: from the start of the navigation until the load event is over, all scripts have run",
        f"and the main thread is free: the last task over 50 ms before {QUIET_MS} ms without one has ended; median of",
        f"{OPENINGS} openings. *3-D figure*: drawn only when a reader comes near it; from scrolling there until it is",
        "drawn, once.",
        "",
        f"Largest page: {largest:.2f} MB (limit {LARGEST_MB:.0f} MB). Slowest: usable after {slowest:.0f} ms (aim "
        f"{LONGEST_MS} ms).",
        f"Load average at the start: {load:.1f} on {os.cpu_count()} processors; times suffer from load.",
        "Written by `make campaigns ARGS=pages` after `make run`.",
        "",
        f"| page | size (MB) | {screens} | 3-D figure (ms) |",
        "|---|---|---|---|---|",
        *rows,
    ]
    return "\n".join(lines) + "\n"
