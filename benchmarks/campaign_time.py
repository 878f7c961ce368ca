"""Processor time of each job of the small study, with an empty cache of kernels and with a full one."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from er3a.pipeline.study import load_study
from testing.evidence import ROOT

STUDY = "config/small.yaml"


def jobs() -> list[tuple[str, ...]]:
    """The words of each job's command, in an order in which each finds what it reads."""
    study = load_study(STUDY)
    found: list[tuple[str, ...]] = []
    for robot in study.robots:
        found += [("compute", stage, robot) for stage in study.stages(robot)]
        found.append(("views", robot, *study.stages(robot), "teach"))
    return [*found, ("index",)]


def seconds(job: tuple[str, ...], folder: Path, cache: Path) -> float:
    """Processor time (s) of a job with all its threads, of user and system."""
    env = os.environ | {"ER3A_STUDY": STUDY, "XDG_CACHE_HOME": str(cache), "PYTHONPATH": str(ROOT)}
    before = os.times()
    subprocess.run([sys.executable, "-m", "er3a", *job], cwd=folder, env=env, check=True, capture_output=True)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def table() -> str:
    """The evidence as Markdown."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made) / "study"
        for name in ("config", "data"):
            shutil.copytree(ROOT / name, folder / name)
        asked, runs = jobs(), []
        for _ in ("cold", "warm"):
            runs.append([seconds(job, folder, Path(made) / "cache") for job in asked])
    lines = [
        "# Time: processor seconds of each job of the small study",
        "",
        "*Cold*: the cache of compiled kernels is empty at first, and each job compiles what those above it have not.",
        "*Warm*: it is full. The difference is compiling. Each job runs alone, one after the other; Snakemake's own",
        "time isn't counted. Written by `make campaigns ARGS=time`.",
        "",
        "| job | cold s | warm s |",
        "|---|---|---|",
        *(f"| {' '.join(job[:3])} | {cold:.1f} | {warm:.1f} |" for job, cold, warm in zip(asked, *runs)),
        f"| **all** | {sum(runs[0]):.0f} | {sum(runs[1]):.0f} |",
    ]
    return "\n".join(lines)
