"""A study's cost in the terminal."""

from __future__ import annotations

import os
from collections import Counter, defaultdict
from dataclasses import asdict

from rich import box
from rich.console import Console
from rich.table import Table

from er3a.pipeline.estimate.cost import MachineCalibration, cost, disk_bytes, estimates_of
from er3a.pipeline.estimate.jobs import jobs_of
from er3a.pipeline.stages.workspace.entry import WorkspaceSettings
from er3a.pipeline.study import Study


def print_estimate(study: Study, calibration: MachineCalibration, cores: list[int]) -> None:
    """Print speeds, processor time by kind of job, wall time and memory by number of cores, and disk space."""
    console = Console()
    here = os.cpu_count() or 1
    total = study.section(WorkspaceSettings).samples * sum("workspace" in study.stages(name) for name in study.names)
    console.print(f"{len(study.names)} robots, {total:.3g} samples together. Measured here, all {here} cores busy:")

    speeds = Table("robot", box=box.SIMPLE)
    speeds.add_column("samples/s and core", justify="right")
    for robot, speed in calibration.speeds.items():
        half = (speed.greatest - speed.least) / 2
        speeds.add_row(robot, f"{speed.mean / 1e6:.1f} ± {half / 1e6:.1f} million")
    console.print(speeds)

    kinds = Table("what", "timed", box=box.SIMPLE)
    for column in ("jobs", "core time"):
        kinds.add_column(column, justify="right")
    estimates = estimates_of(study, calibration)
    seen: Counter[tuple[str, str]] = Counter()
    seconds: defaultdict[tuple[str, str], float] = defaultdict(float)
    for job in jobs_of(study):
        seen[job.key[:2]] += 1
        seconds[job.key[:2]] += estimates[job].seconds[1]
    ran = {key[:2] for key in calibration.timings}
    for kind, count in seen.items():
        source = "in an earlier run" if kind in ran else "now"
        kinds.add_row(" ".join(kind).strip(), source, str(count), duration(seconds[kind]))
    console.print(kinds)

    table = Table(box=box.SIMPLE)
    for column in ("cores", "wall time", "from", "to", "memory, at most"):
        table.add_column(column, justify="right")
    for number in cores:
        found = cost(study, calibration, number)
        times = (duration(value) for value in (found.expected_s, found.least_s, found.greatest_s))
        table.add_row(str(number), *times, f"{found.memory_mb / 1000:.1f} GB")
    console.print(table)
    whole, parts = disk_bytes(study, calibration)
    console.print(
        f"Disk: {size(whole)} of results and views, while sampling up to {size(parts)} more.\n"
        "From and to: how much repeated timings differed, and robots from each other where one stands for others. "
        "A machine that gets busier, and the queue of a cluster, come on top."
    )


def estimate_record(study: Study, calibration: MachineCalibration, cores: list[int]) -> dict[str, object]:
    """The same as plain data, for another program: seconds, MB and bytes."""
    whole, parts = disk_bytes(study, calibration)
    return {
        "robots": study.names,
        "samples_per_second_and_core": {robot: asdict(speed) for robot, speed in calibration.speeds.items()},
        "costs": [asdict(cost(study, calibration, number)) for number in cores],
        "disk_bytes": whole,
        "more_while_sampling_bytes": parts,
    }


def duration(seconds: float) -> str:
    """Seconds as people say them."""
    if seconds < 100:
        return f"{seconds:.1f} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes = seconds / 60
    return f"{minutes:.1f} min" if minutes < 100 else f"{minutes / 60:.1f} h"


def size(count: int) -> str:
    """Bytes as people say them."""
    for unit, factor in (("GB", 1e9), ("MB", 1e6)):
        if count >= factor:
            return f"{count / factor:.1f} {unit}"
    return f"{count / 1e3:.0f} kB"
