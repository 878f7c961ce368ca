"""What a study takes: its jobs on cores, timings of earlier runs, and what stands for jobs that none has timed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from er3a.errors import Er3aError
from er3a.pipeline.cli import app
from er3a.pipeline.estimate.cost import MachineCalibration, cost, disk_bytes, estimates_of
from er3a.pipeline.estimate.jobs import Job, jobs_of, wall_time
from er3a.pipeline.estimate.speed import SamplingSpeed
from er3a.pipeline.estimate.terminal import duration, size
from er3a.pipeline.estimate.timings import FEW_SAMPLES, Timing, Trial, logged
from er3a.pipeline.stages.workspace.entry import SAMPLES_PER_JOB
from er3a.pipeline.study import load_study
from er3a.pipeline.sweeps import Sweep
from testing.made_stage import write

ROOT = Path(__file__).resolve().parents[2]
ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
MILLION = 1e6
HANDLING = 0.125  # s


@pytest.fixture
def study(monkeypatch):
    monkeypatch.chdir(ROOT)
    return load_study("config/small.yaml")


def with_samples(study, samples: int, blocks: int = 1000):
    return study.model_copy(
        update={"workspace": study.workspace.model_copy(update={"samples": samples, "blocks": blocks})}
    )


@pytest.fixture
def calibration(study):
    """All jobs of the first robot take a second in a trial, their sampling two; a core draws a million a second."""
    kinds = {job.key[:2] for job in jobs_of(study)}
    timings = dict.fromkeys(kinds, Timing(1.0, 100.0)) | {("sample", "workspace"): Timing(2.0, 50.0)}
    trial = Trial(timings, part_bytes=1000, gather_s=0.0, result_bytes=5000)
    speeds = dict.fromkeys(ROBOTS, SamplingSpeed(MILLION, 0.9 * MILLION, 1.1 * MILLION))
    return MachineCalibration(speeds, {}, trial, {"er3a_c60": 5000}, Timing(3.0, 250.0), HANDLING)


def test_jobs_on_one_core_take_the_sum_and_on_many_the_longest_chain():
    jobs = [
        Job("a", "", ""),
        Job("b", "", "", needs=(0,)),
        Job("c", "", "", needs=(0,)),
        Job("d", "", "", needs=(1, 2)),
    ]
    seconds = [1.0, 2.0, 4.0, 8.0]
    assert wall_time(jobs, seconds, 1) == 15
    assert wall_time(jobs, seconds, 2) == 13
    assert wall_time(jobs, seconds, 64) == 13


def test_three_equal_jobs_take_two_rounds_on_two_cores():
    assert wall_time([Job("a", "", str(n)) for n in range(3)], [5.0] * 3, 2) == 10


def test_samples_are_shared_out_over_parts_without_loss(study):
    study = with_samples(study, 10 * SAMPLES_PER_JOB + 7)
    drawn = [job.samples for job in jobs_of(study) if job.key == ("sample", "workspace", "er3_600")]
    assert len(drawn) == study.workspace.parts == 11
    assert sum(drawn) == 10 * SAMPLES_PER_JOB + 7
    assert max(drawn) - min(drawn) <= 1


def test_parts_are_never_more_than_blocks(study):
    assert with_samples(study, 10 * SAMPLES_PER_JOB, blocks=4).workspace.parts == 4
    assert with_samples(study, 1000, blocks=4).workspace.parts == 1


def test_sampling_grows_with_the_samples_and_nothing_else_does(study, calibration):
    few, many = (with_samples(study, samples) for samples in (FEW_SAMPLES, FEW_SAMPLES + 1_000_000))
    before, after = (
        {job.key: estimate.seconds[1] for job, estimate in estimates_of(each, calibration).items()}
        for each in (few, many)
    )
    for key, seconds in after.items():
        grown = 1.0 if key[0] == "sample" else 0.0
        assert seconds - before[key] == pytest.approx(grown), key


def test_wall_time_has_the_start_and_its_range_the_wander_of_the_speed(study, calibration):
    found = cost(with_samples(study, FEW_SAMPLES), calibration, 1)
    jobs = len(jobs_of(study))
    once = 3 + jobs * HANDLING
    assert found.expected_s == pytest.approx(once + jobs + 3 * 1.0)
    assert found.greatest_s - once == pytest.approx(1.1 * (found.expected_s - once))
    assert found.least_s - once == pytest.approx(0.9 * (found.expected_s - once))
    assert found.memory_mb == 250 + 100
    assert cost(study, calibration, 4).memory_mb == 250 + 400
    assert cost(study, calibration, 4).expected_s < found.expected_s / 3


def test_a_job_s_own_timing_goes_before_those_of_others(study, calibration):
    key = ("compute", "validation", "er3a_c60")
    timed = replace(calibration, timings={key: Timing(7.0, 10.0), (*key[:2], "er3_600"): Timing(9.0, 10.0)})
    found = {job.key: estimate for job, estimate in estimates_of(study, timed).items()}
    assert found[key].seconds[1] == 7.0
    other = found[(*key[:2], "er3a_c60_article")].seconds
    assert other[1] == 8.0
    assert other[2] - other[1] == pytest.approx(8.0 * 0.1 + 1.0), "as far as robots differ, on top"


def test_variants_take_what_their_base_takes(study, calibration):
    sweep = Sweep(robot="er3_600", vary="tool.z_mm", values=[100.0, 200.0])
    study = study.model_copy(update={"sweeps": {"grip": sweep}})
    timed = replace(calibration, timings={("compute", "validation", "er3_600"): Timing(9.0, 10.0)})
    found = {job.key: estimate for job, estimate in estimates_of(study, timed).items()}
    assert found["compute", "validation", "er3_600-grip-02"].seconds[1] == 9.0
    assert ("compute", "inverse", "er3_600-grip-02") not in found
    assert disk_bytes(study, calibration) == (5 * 5000, 5 * 1000)


def test_timings_of_a_run_count_where_its_settings_do(study, tmp_path, monkeypatch):
    results, logs = tmp_path / "results", tmp_path / "logs"
    write(results / "er3_600/workspace", study)
    (logs / "er3_600").mkdir(parents=True)
    for name in ("workspace.compute", "workspace.sample.1-of-1", "inverse.compute", "teach"):
        (logs / f"er3_600/{name}.tsv").write_text("s\th:m:s\tmax_rss\n4.5\t0:00:04\t300.0\n")
    expected = {("compute", "workspace", "er3_600"): Timing(4.5, 300.0), ("teach", "", "er3_600"): Timing(4.5, 300.0)}
    assert logged(study, jobs_of(study), results, logs) == expected
    more = with_samples(study, 10**10)
    assert logged(more, jobs_of(more), results, logs) == expected
    finer = study.model_copy(update={"workspace": study.workspace.model_copy(update={"cells_across": 32})})
    assert set(logged(finer, jobs_of(finer), results, logs)) == {("teach", "", "er3_600")}
    (logs / "er3_600/workspace.compute.tsv").write_text("cut off")
    assert set(logged(study, jobs_of(study), results, logs)) == {("teach", "", "er3_600")}


@pytest.mark.parametrize("cores", ["", "0", "two", "1,,2", "-1"])
def test_cores_that_are_no_numbers_are_refused(cores, monkeypatch):
    monkeypatch.chdir(ROOT)
    told = CliRunner().invoke(app, ["estimate", "--study", "config/small.yaml", "--cores", cores])
    assert isinstance(told.exception, Er3aError)
    assert "expected numbers such as 1,2,8,64" in str(told.exception)


def test_times_and_sizes_as_people_say_them():
    assert [duration(seconds) for seconds in (0.44, 12.6, 150, 8000)] == ["0.4 s", "13 s", "2.5 min", "2.2 h"]
    assert [size(count) for count in (2500, 64_300_000, 7_000_000_000)] == ["2 kB", "64.3 MB", "7.0 GB"]
