"""What `er3a estimate` predicts against what runs then take: one robot, small budgets, ever more samples."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import psutil
import yaml

from er3a.pipeline.estimate.cost import MachineCalibration, cost, disk_bytes, measured_here
from er3a.pipeline.estimate.terminal import duration, size
from er3a.pipeline.estimate.timings import written_bytes
from er3a.pipeline.study import Study, load_study
from testing.small_study import STUDY, environment, fresh, run_command

ROBOT, BLOCKS = "er3a_c60", 32
SAMPLES = tuple(10**exponent for exponent in range(6, 11))
CORES = 2
MORE_CORES = (1, 2, 8, 64)
MADE = ("results", "reports", "logs", ".snakemake")


def study_of(samples: int) -> Study:
    """The small study with one robot and this many samples, also written to its file in the working folder."""
    content = yaml.safe_load(Path(STUDY).read_text(encoding="utf-8"))
    content["robots"] = {ROBOT: content["robots"][ROBOT]}
    content["workspace"] |= {"samples": samples, "blocks": BLOCKS}
    Path(STUDY).write_text(yaml.safe_dump(content), encoding="utf-8")
    return load_study(STUDY)


def calibration_of(study: Study) -> MachineCalibration:
    """What `er3a estimate` measures in the working folder."""
    return measured_here(study, Path("results"), Path("reports"), Path("logs"))


def run_from_nothing(samples: int) -> tuple[float, float]:
    """Wall time (s) and peak memory (MB) of `make run` with no results there."""
    study_of(samples)
    for name in MADE:
        shutil.rmtree(name, ignore_errors=True)
    start, peak, quiet = time.perf_counter(), 0, subprocess.DEVNULL
    process = psutil.Popen(run_command(), stdout=quiet, stderr=quiet)
    while process.poll() is None:
        with contextlib.suppress(psutil.NoSuchProcess):
            peak = max(peak, sum(each.memory_info().rss for each in [process, *process.children(recursive=True)]))
        time.sleep(0.2)
    if process.returncode:
        raise SystemExit(f"the study with {samples:,} samples does not run")
    return time.perf_counter() - start, peak / 1e6


def table() -> str:
    """The evidence as Markdown."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = fresh(Path(temporary) / "project")
        os.environ |= environment(folder)
        with contextlib.chdir(folder):
            run_from_nothing(SAMPLES[0])  # compiles the kernels
            for name in MADE:
                shutil.rmtree(name)
            start = time.perf_counter()
            by_trial = calibration_of(study_of(SAMPLES[0]))
            took = time.perf_counter() - start
            measured = [run_from_nothing(SAMPLES[0])]
            by_run = calibration_of(study_of(SAMPLES[1]))
            measured += [run_from_nothing(samples) for samples in SAMPLES[1:]]
            whole = written_bytes([Path("results"), Path("reports")])
            return _page(by_trial, by_run, took, measured, whole)


def _page(
    by_trial: MachineCalibration,
    by_run: MachineCalibration,
    took: float,
    measured: list[tuple[float, float]],
    whole: int,
) -> str:
    speed = by_run.speeds[ROBOT]
    lines = [
        "# What a study takes, predicted and measured",
        "",
        f"`er3a estimate` on the small study with {ROBOT} alone, {CORES} cores. Written by "
        f"`make campaigns ARGS=estimate`, with a load of {os.getloadavg()[2]:.1f} on {os.cpu_count()} processors.",
        "",
        f"*Trial*: no run was there to learn from, the calibration took {took:.0f} s. *Run*: the timings of the run "
        f"with {_power(SAMPLES[0])} samples were there. One core samples {speed.mean / 1e6:.0f} million a second "
        f"({speed.least / 1e6:.0f} to {speed.greatest / 1e6:.0f}).",
        "",
        "| samples | predicted by trial | off by | predicted by run | off by | measured | memory, at most | measured |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for samples, (seconds, memory) in zip(SAMPLES, measured, strict=True):
        study = study_of(samples)
        first, second = (cost(study, calibration, CORES) for calibration in (by_trial, by_run))
        off = [f"{found.expected_s / seconds - 1:+.0%}" for found in (first, second)]
        after = (duration(second.expected_s), off[1]) if samples != SAMPLES[0] else ("", "")
        cells = (
            _power(samples),
            duration(first.expected_s),
            off[0],
            *after,
            duration(seconds),
            f"{second.memory_mb:.0f} MB",
            f"{memory:.0f} MB",
        )
        lines.append(f"| {' | '.join(cells)} |")
    lines += [
        "",
        f"Disk: predicted {size(disk_bytes(study, by_run)[0])}, measured {size(whole)}.",
        "",
        "Predicted for other numbers of cores like these, from least to greatest:",
        "",
        f"| samples | {' | '.join(f'{cores} cores' if cores > 1 else '1 core' for cores in MORE_CORES)} |",
        f"|---|{'---|' * len(MORE_CORES)}",
    ]
    for samples in SAMPLES:
        found = [cost(study_of(samples), by_run, cores) for cores in MORE_CORES]
        ranges = (f"{duration(each.least_s)} to {duration(each.greatest_s)}" for each in found)
        lines.append(f"| {_power(samples)} | {' | '.join(ranges)} |")
    return "\n".join(lines) + "\n"


def _power(samples: int) -> str:
    return f"10^{len(str(samples)) - 1}"
