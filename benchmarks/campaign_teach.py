"""The teach panel in a real browser without a graphics processor: time to usable, frame rate, agreement with Python."""

from __future__ import annotations

import os
import statistics
import tempfile
from pathlib import Path

import numpy as np

from er3a import forward, inverse, load_robot
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.singularity import TYPES, characteristic_length, conditioning, determinant_factors
from er3a.pipeline.study import load_study
from er3a.pipeline.teach.panel import panel_data, write_teach_page
from testing import chromium
from testing.arms import joints_at_random, pose_errors
from testing.evidence import sized
from testing.teach_kinematics import NEAR, SOLVE

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
SCREENS = {"phone": (375, 800), "laptop": (1280, 900), "4K": (3840, 2160)}
OPENINGS, SECONDS = 9, 5
POSES, BATCH, SEED = sized(10_000, 1000), 1000, 20261120

ANIMATE = """
const [seconds, done] = arguments;
const { lower, upper } = JSON.parse(document.getElementById("panel-data").textContent).table;
import("er3a/panel").then((panel) => {
  const times = [];
  const step = (now) => {
    times.push(now);
    const t = (now - times[0]) / 1000;
    if (t > seconds) return done(times.slice(1).map((time, i) => time - times[i]));
    panel.moveTo(lower.map((low, k) => low + (upper[k] - low) * (0.5 + 0.45 * Math.sin((0.7 + 0.2 * k) * t))));
    requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
});
"""


def speed(browser, file: Path, width: int, height: int) -> list[float]:
    """Time to usable (ms, median), frames/s, the frame time (ms) that 95 % keep, processor time per frame (ms)."""
    browser.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
    )
    usable = []
    for _ in range(OPENINGS):
        browser.get("about:blank")
        browser.get(file.as_uri())
        usable.append(browser.execute_script("return performance.getEntriesByName('usable')[0].startTime"))
    before = chromium.processor_time(browser)
    frames = browser.execute_async_script(ANIMATE, SECONDS)
    used = chromium.processor_time(browser) - before
    rate, slow = 1000 * len(frames) / sum(frames), float(np.quantile(frames, 0.95))
    return [statistics.median(usable), rate, slow, 1000 * used / len(frames)]


def agreement(browser, name: str) -> tuple[int, list[float]]:
    """Rows compared, and worst differences: tool (m), tool (rad), measures, factors (rad and m), joints (rad)."""
    robot, worst, rows = load_robot(name), np.zeros(5), 0
    length = characteristic_length(robot)
    for q in np.split(joints_at_random(robot, np.random.default_rng(SEED), POSES), POSES // BATCH):
        found = browser.execute_async_script(SOLVE, panel_data(robot, NEAR), q.tolist())
        T, measures, factors = forward(robot, q), conditioning(robot, q, length), determinant_factors(robot, q)
        apart = [part.max() for part in pose_errors(np.array([one["T"] for one in found]), T)]
        values = np.array(
            [[one["measures"][key] for key in ("manipulability", "smallestSingularValue")] for one in found]
        )
        expected = np.stack([measures.manipulability, measures.smallest_singular_value], axis=1)
        apart.append(np.abs(values - expected).max())
        apart.append(
            max(np.abs([one["factors"][kind] for one in found] - getattr(factors, kind)).max() for kind in TYPES)
        )
        joints = 0.0
        for n, one in enumerate(found):
            solutions = inverse(robot, T[n], q[n])
            there, here = np.array([row["q"] for row in one["solved"]["rows"]]), solutions.q
            if sorted(row["slot"] for row in one["solved"]["rows"]) != sorted(solutions.branch):
                joints = np.inf
                continue
            between = np.abs(wrap_to_pi(there[:, None] - here)).max(axis=-1)
            joints = max(joints, between.min(axis=0).max(), between.min(axis=1).max())
            rows += len(here)
        worst = np.maximum(worst, [*apart, joints])
    return rows, worst.tolist()


def table() -> str:
    """The evidence as Markdown."""
    if reason := chromium.lacking():
        raise SystemExit(f"error: {reason}")
    study = load_study("config/config.yaml")
    lines = [
        "# The teach panel in a real browser",
        "",
        "Headless Chromium with `--disable-gpu`: every pixel is painted by the processor. *Usable*: from the start of",
        f"the navigation until controls, picture and list are there, median of {OPENINGS} openings. *Frames*: all six",
        f"joints move for {SECONDS} s, picture and read-outs follow in every frame, the list every 120 ms; the browser",
        "draws 60 frames/s at most. *Processor*: what all processes of the browser computed for a frame, which load",
        "hardly changes; below 33 ms one processor makes 30 frames/s.",
        f"Load average at the start: {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors; rates suffer from load.",
        "Written by `make campaigns ARGS=teach`.",
        "",
        "| robot | screen | page (kB) | usable (ms) | frames/s | 95 % of frames within (ms) | processor (ms) |",
        "|---|---|---|---|---|---|---|",
    ]
    agreed = []
    with tempfile.TemporaryDirectory() as folder:
        browser = chromium.start(Path(folder) / "profile")
        try:
            for name in ROBOTS:
                file = Path(folder) / f"{name}.html"
                write_teach_page(study, name, Path("results"), file)
                for screen, (width, height) in SCREENS.items():
                    usable, rate, slow, used = speed(browser, file, width, height)
                    where = f"{screen}, {width} x {height}"
                    size = file.stat().st_size / 1000
                    lines.append(
                        f"| {name} | {where} | {size:.0f} | {usable:.0f} | {rate:.1f} | {slow:.1f} | {used:.1f} |"
                    )
                    print(lines[-1], flush=True)
                rows, worst = agreement(browser, name)
                agreed.append(f"| {name} | {POSES:,} | {rows:,} | {' | '.join(f'{value:.1e}' for value in worst)} |")
                print(agreed[-1], flush=True)
        finally:
            browser.quit()
    lines += [
        "",
        f"Agreement of the page's kinematics with Python's on random joints within the limits (seed {SEED}), greatest",
        "differences. *Measures*: manipulability and smallest singular value. *Factors*: distances from the",
        "singularities, rad and m. *Joints*: of all solutions of the poses, up to whole turns (`inf`: a branch is",
        "missing).",
        "",
        "| robot | poses | solutions | tool (m) | tool (rad) | measures | factors | joints (rad) |",
        "|---|---|---|---|---|---|---|---|",
        *agreed,
    ]
    return "\n".join(lines) + "\n"
