"""What jobs take on this machine: out of the timings of an earlier run, or timed here."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import yaml

from er3a.errors import Er3aError, ResultError
from er3a.pipeline.estimate.jobs import Job
from er3a.pipeline.results import read_provenance
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.workspace.entry import WorkspaceSettings
from er3a.pipeline.stages.workspace.parts import gather
from er3a.pipeline.study import Study

FEW_SAMPLES = 1 << 22
_ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
_SAMPLING = ("samples", "blocks")

Key = tuple[str, str, str]
"""Verb, stage and robot of a job; see :class:`er3a.pipeline.estimate.jobs.Job`."""


@dataclass(frozen=True)
class Timing:
    """Wall time (s) and peak memory (MB) of a job."""

    seconds: float
    memory_mb: float


def logged(study: Study, jobs: list[Job], results: Path, logs: Path) -> dict[Key, Timing]:
    """Timings that a run has left of jobs, sampling apart, whose settings are the same but for the samples."""
    found = {}
    for job in jobs:
        if job.verb == "sample" or (job.stage and not _same_settings(study, job, results)):
            continue
        name = f"{job.stage}.{job.verb}" if job.stage else job.verb
        try:
            with (logs / job.robot / f"{name}.tsv").open(newline="") as file:
                row = next(csv.DictReader(file, delimiter="\t"))
            found[job.key] = Timing(float(row["s"]), float(row["max_rss"]))
        except (OSError, StopIteration, KeyError, ValueError):
            continue
    return found


def _same_settings(study: Study, job: Job, results: Path) -> bool:
    try:
        config = read_provenance(results / job.robot / job.stage).config or {}
    except ResultError:
        return False
    now = study.settings(job.robot, job.stage)
    return all(
        {**config.get(part, {}), **dict.fromkeys(_SAMPLING)} == {**now[part], **dict.fromkeys(_SAMPLING)}
        for part in ("robot", job.stage)
    )


@dataclass(frozen=True)
class Trial:
    """Jobs of one robot, timed here.

    Attributes
    ----------
    timings : by verb and stage; sampling with ``FEW_SAMPLES``
    part_bytes, gather_s : size of a file of samples, and the time to take it over
    result_bytes : size of results and views
    """

    timings: dict[tuple[str, str], Timing]
    part_bytes: int
    gather_s: float
    result_bytes: int


def trial(study: Study, robot: str, whole: bool) -> Trial:
    """Sample a robot's workspace; ``whole``: also carry out its stages at the study's budgets, on all cores here."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        settings = study.section(WorkspaceSettings).model_copy(update={"samples": FEW_SAMPLES, "blocks": 1})
        alone = {"workspace": settings, "robots": {robot: study.robots[robot]}, "sweeps": {}}
        small = study.model_copy(update=alone)
        content = small.model_dump(mode="json", by_alias=True, exclude_none=True)
        file, part = folder / "study.yaml", folder / "1-of-1.npz"
        file.write_text(yaml.safe_dump(content), encoding="utf-8")
        timings: dict[tuple[str, str], Timing] = {}
        places: dict[str, list[str | Path]] = {
            "sample": ["--study", file, "--part", "1-of-1", "--output", part],
            "compute": ["--study", file, "--results", folder / "results"],
            "teach": ["--study", file, "--results", folder / "results", "--reports", folder / "reports"],
        }

        def carry_out(verb: str, stage: str, *words: str | Path) -> None:
            options = places.get(verb, [*places["compute"], "--reports", folder / "reports"])
            timings[verb, stage] = timed([str(word) for word in ("er3a", verb, *words, *options)])

        def carry_out_stage(stage: str) -> None:
            carry_out("compute", stage, stage, robot, *([part] if STAGES[stage].sampled else []))
            for view in STAGES[stage].views:
                carry_out(view, stage, stage, robot)

        carry_out("sample", "workspace", robot)
        if whole:
            with ThreadPoolExecutor(os.cpu_count()) as pool:
                list(pool.map(carry_out_stage, small.stages(robot)))
            carry_out("teach", "", robot)
            carry_out("index", "")
        start = time.perf_counter()
        gather([part], small, small.robot(robot))
        gathered = time.perf_counter() - start
        return Trial(timings, part.stat().st_size, gathered, written_bytes([folder / "results", folder / "reports"]))


def written_bytes(folders: list[Path]) -> int:
    """Size of all files in some folders."""
    return sum(path.stat().st_size for folder in folders for path in folder.rglob("*") if path.is_file())


def timed(command: list[str]) -> Timing:
    """Run a module of Python with some arguments to its end; :class:`Er3aError` with its last words if it fails."""
    environment = os.environ | _ONE_THREAD | {"PYTHONHASHSEED": "0"}
    quiet = subprocess.DEVNULL
    start = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", *command], env=environment, stdout=quiet, stderr=subprocess.PIPE, text=True
    )
    assert process.stderr is not None  # it is a pipe
    with process.stderr as told:
        said = told.read()
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - start
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        last = (said.strip().splitlines() or ["it said nothing"])[-1].removeprefix("error: ")
        raise Er3aError(f"`{' '.join(command[:4])}`, timed for the estimate, failed: {last}")
    return Timing(seconds, usage.ru_maxrss / 1024)
