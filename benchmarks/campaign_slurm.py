"""What Slurm and Snakemake cost beside the sampling that they schedule, on a real Slurm on this machine. Needs root."""

from __future__ import annotations

import csv
import os
import re
import subprocess
import tempfile
from datetime import datetime
from pathlib import Path

import psutil
import yaml

from testing.evidence import sized
from testing.small_study import ROOT, STUDY, environment, fresh, run_command

ROBOT, CORES, BLOCKS = "er3a_c60", 2, 4
BLOCK = sized(10_000_000_000)
"""Samples in a block of the size that docs/cluster.md recommends."""
PID_FILES = [
    Path("/run", name) for name in ("slurmd.node1.pid", "slurmd.node2.pid", "slurmctld.pid", "munge/munged.pid")
]
SLURM = (
    "--workflow-profile profiles/slurm --slurm-no-account --slurm-status-command squeue "
    "--slurm-init-seconds-before-status-checks 5 --until sample_workspace --notemp"
)


def sampling_study(folder: Path, block: int) -> None:
    """Leave one robot in the copy's small study, with blocks of this many samples."""
    study = yaml.safe_load((folder / STUDY).read_text(encoding="utf-8"))
    study["robots"] = {ROBOT: study["robots"][ROBOT]}
    study["workspace"] |= {"samples": BLOCKS * block, "blocks": BLOCKS}
    (folder / STUDY).write_text(yaml.safe_dump(study), encoding="utf-8")


def run_on_slurm(folder: Path) -> list[tuple[float, float]]:
    """Sample on Slurm; begin and end (s) of each Slurm job, by its own books."""
    resources = ["--default-resources", "slurm_partition=main", "mem_mb=500", "slurm_extra='--nodelist=node1'"]
    command = [*run_command()[:-2], *SLURM.split(), "--set-scatter", f"blocks={BLOCKS}", *resources]
    done = subprocess.run(command, cwd=folder, env=environment(folder), capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"the study does not run on Slurm:\n{done.stdout}\n{done.stderr}")
    told = subprocess.run(["scontrol", "show", "job", "--oneliner"], capture_output=True, text=True, check=True).stdout
    mine = [line for line in told.splitlines() if f"WorkDir={folder}" in line]
    return [tuple(_moment(line, key) for key in ("StartTime", "EndTime")) for line in mine]


def _moment(line: str, key: str) -> float:
    return datetime.fromisoformat(re.search(rf"\b{key}=(\S+)", line)[1]).timestamp()


def job_seconds(folder: Path) -> list[float]:
    """What each sampling job took by itself, process start included."""
    found = []
    for path in sorted(folder.glob(f"logs/{ROBOT}/workspace.sample.*.tsv")):
        with path.open(newline="") as file:
            found.append(float(next(csv.DictReader(file, delimiter="\t"))["s"]))
    return found


def _process(pid_file: Path) -> psutil.Process | None:
    """The running daemon that wrote a pid file."""
    try:
        return psutil.Process(int(pid_file.read_text()))
    except (OSError, ValueError, psutil.NoSuchProcess):
        return None


def table(block: int = BLOCK) -> str:
    """The evidence as Markdown, for blocks of this many samples."""
    running = [file for file in PID_FILES if _process(file)]
    subprocess.run([ROOT / ".ci/slurm"], check=True, stdout=subprocess.DEVNULL)
    try:
        with tempfile.TemporaryDirectory() as temporary:
            folder = fresh(Path(temporary).resolve() / "project")
            sampling_study(folder, block)
            spans, seconds = run_on_slurm(folder), job_seconds(folder)
    finally:
        for process in [_process(file) for file in PID_FILES if file not in running]:
            if process:
                process.terminate()
    if not len(spans) == len(seconds) == BLOCKS:
        raise SystemExit(f"{len(spans)} Slurm jobs and {len(seconds)} timings, {BLOCKS} of each were expected")
    work = sum(seconds)
    inside = sum(end - begin for begin, end in spans)
    held = CORES * (max(end for _, end in spans) - min(begin for begin, _ in spans))
    lines = [
        f"{BLOCKS} blocks of {block:,} samples, one Slurm job each, on {CORES} cores. While this was measured, "
        f"{os.getloadavg()[1]:.1f} processes wanted the {os.cpu_count()} processors.",
        "",
        "| | core time (s) | beyond the work |",
        "|---|---|---|",
        f"| sampling by itself, start of its processes included | {work:.0f} | |",
        f"| the Slurm jobs, begin to end | {inside:.0f} | {inside / work - 1:.1%} |",
        f"| all {CORES} cores from the first begin to the last end | {held:.0f} | **{held / work - 1:.1%}** |",
    ]
    return "\n".join(lines) + "\n"
