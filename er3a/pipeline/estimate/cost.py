"""What a study costs here and on more cores: a short calibration, then the study's jobs laid on the cores."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from statistics import mean
from tempfile import TemporaryDirectory

from er3a.files.shipped import ROOT
from er3a.pipeline.estimate.jobs import Job, jobs_of, wall_time
from er3a.pipeline.estimate.speed import SamplingSpeed, sampling_speed
from er3a.pipeline.estimate.timings import FEW_SAMPLES, Key, Timing, Trial, logged, timed, trial, written_bytes
from er3a.pipeline.stages.workspace.entry import WorkspaceSettings
from er3a.pipeline.study import Study

IDLE_JOBS = 12
_IDLE_WORKFLOW = f"""
rule all:
    input: expand("{{n}}", n=range({IDLE_JOBS}))
rule idle:
    output: "{{n}}"
    shell: "touch {{output}}"
"""


@dataclass(frozen=True)
class MachineCalibration:
    """What was measured on this machine.

    Attributes
    ----------
    speeds : of sampling, by robot of the study (variants sample as their base does)
    timings : of the jobs that a run has timed; trial : of one robot's jobs, timed now
    result_bytes : size of results and views, by robot
    workflow : what Snakemake takes before the first job, and its memory
    handling_s : what Snakemake adds to each job
    """

    speeds: dict[str, SamplingSpeed]
    timings: dict[Key, Timing]
    trial: Trial
    result_bytes: dict[str, int]
    workflow: Timing
    handling_s: float


@dataclass(frozen=True)
class Cost:
    """Of a study on some cores: wall time (s; least, expected, greatest), and peak memory (MB)."""

    cores: int
    least_s: float
    expected_s: float
    greatest_s: float
    memory_mb: float


def measured_here(study: Study, results: Path, reports: Path, logs: Path) -> MachineCalibration:
    """Measure what :func:`cost` needs: seconds, or as long as one robot's stages take if no run has timed them."""
    jobs = jobs_of(study)
    timings = logged(study, jobs, results, logs)
    known, kinds = {key[:2] for key in timings}, {job.key[:2] for job in jobs if job.verb != "sample"}
    first, whole = next(iter(study.robots)), known != kinds
    tried = trial(study, first, whole)
    done = [name for name in study.robots if ("report", "workspace", name) in timings]
    sizes = {name: written_bytes([results / name, reports / name]) for name in done}
    return MachineCalibration(
        speeds={robot: sampling_speed(study, robot) for robot in study.robots},
        timings=timings,
        trial=tried,
        result_bytes={first: tried.result_bytes} if whole else sizes,
        workflow=_workflow(study),
        handling_s=_handling(),
    )


def _workflow(study: Study) -> Timing:
    return timed(
        [
            "snakemake",
            "--snakefile",
            str(ROOT / "Snakefile"),
            "--dry-run",
            "--forceall",
            "--quiet",
            "all",
            "--configfile",
            str(study.file),
        ]
    )


def _handling() -> float:
    """Time (s) that Snakemake takes for a job that does nothing."""
    with TemporaryDirectory() as folder:
        (Path(folder) / "Snakefile").write_text(_IDLE_WORKFLOW, encoding="utf-8")
        words = ["snakemake", "--directory", folder, "--snakefile", f"{folder}/Snakefile", "--quiet", "all"]
        planned = timed([*words, "--dry-run"]).seconds
        return (timed([*words, "--cores", "1", "--scheduler", "greedy"]).seconds - planned) / IDLE_JOBS


def cost(study: Study, calibration: MachineCalibration, cores: int) -> Cost:
    """Wall time and memory of a study on some cores like this machine's."""
    jobs, estimates = jobs_of(study), estimates_of(study, calibration)
    least, expected, greatest = (
        calibration.workflow.seconds
        + wall_time(jobs, [estimates[job].seconds[end] + calibration.handling_s for job in jobs], cores)
        for end in range(3)
    )
    largest = sorted((estimates[job].memory_mb for job in jobs), reverse=True)[:cores]
    return Cost(cores, least, expected, greatest, calibration.workflow.memory_mb + sum(largest))


def disk_bytes(study: Study, calibration: MachineCalibration) -> tuple[int, int]:
    """Size of the study's results and views, and of sampled parts, which go once they are gathered."""
    sizes = calibration.result_bytes
    whole = sum(sizes.get(_written(name, study), mean(sizes.values())) for name in study.names)
    return round(whole), calibration.trial.part_bytes * study.section(WorkspaceSettings).parts * len(study.names)


@dataclass(frozen=True)
class JobEstimate:
    """Of a job: time (s; least, expected, greatest) and memory (MB)."""

    seconds: tuple[float, float, float]
    memory_mb: float


def estimates_of(study: Study, calibration: MachineCalibration) -> dict[Job, JobEstimate]:
    """What each job of a study takes."""
    speeds = calibration.speeds.values()
    wander = max((speed.greatest - speed.least) / (2 * speed.mean) for speed in speeds)
    return {job: _estimate(job, study, calibration, wander) for job in jobs_of(study)}


def _estimate(job: Job, study: Study, calibration: MachineCalibration, wander: float) -> JobEstimate:
    """A job's own timing or its base's, else what others of its kind took; uncertain by what repeated timings differ
    and, if it is taken from others, by what those differ."""
    written = _written(job.robot, study)
    if job.verb == "sample":
        start, speed = calibration.trial.timings[job.key[:2]], calibration.speeds[written]
        return _uncertain(Timing(start.seconds + (job.samples - FEW_SAMPLES) / speed.mean, start.memory_mb), wander)
    timings = calibration.timings
    alike = [timing for key, timing in timings.items() if key[:2] == job.key[:2]]
    own = timings.get(job.key) or timings.get((job.verb, job.stage, written))
    if own:
        timing = own
    elif alike:
        times = [timing.seconds for timing in alike]
        timing = Timing(mean(times), max(timing.memory_mb for timing in alike))
        wander += (max(times) - min(times)) / (2 * timing.seconds)
    else:
        timing = calibration.trial.timings[job.key[:2]]
    if job.key[:2] == ("compute", "workspace"):
        gathering = study.section(WorkspaceSettings).parts * calibration.trial.gather_s
        timing = Timing(timing.seconds + gathering, timing.memory_mb)
    return _uncertain(timing, wander)


def _uncertain(timing: Timing, spread: float) -> JobEstimate:
    low = timing.seconds * max(0.0, 1 - spread)
    return JobEstimate((low, timing.seconds, timing.seconds * (1 + spread)), timing.memory_mb)


def _written(robot: str, study: Study) -> str:
    """The robot that is written in the study, of which this one may be a variant."""
    return study.variants[robot].base if robot in study.variants else robot
