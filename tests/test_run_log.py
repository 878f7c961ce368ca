"""What a person sees of a run."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from types import SimpleNamespace

import pytest
from snakemake_interface_logger_plugins.common import LogEvent

from er3a.pipeline.run_study import RunLog, RunLogSettings

OUTPUT = ["results/arm/workspace/summary.json (update)", "results/arm/workspace/SHA256SUMS (update)"]


@pytest.fixture
def log(tmp_path, monkeypatch):
    """Sends records to the log of a run in an empty folder, in which one verdict stands."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "results/arm/workspace"
    folder.mkdir(parents=True)
    (folder / "summary.json").write_text(json.dumps({"verdict": {"status": "fail"}}), encoding="utf-8")
    handler = RunLog(SimpleNamespace(nocolor=True), RunLogSettings())

    def send(event: LogEvent | None, text: str = "", level: int = logging.INFO, **fields: object) -> None:
        record = logging.LogRecord("snakemake", level, __file__, 1, text, (), None)
        record.__dict__.update(fields, **({"event": event} if event else {}))
        handler.emit(record)

    send(LogEvent.RUN_INFO, stats={"compute_workspace": 1, "views_arm": 2, "total": 3})
    return send


def test_a_line_for_each_verdict_with_its_seconds_and_what_is_left(log, capsys):
    log(LogEvent.JOB_INFO, jobid=1, output=OUTPUT)
    log(LogEvent.JOB_FINISHED, job_id=1)
    line = capsys.readouterr().err
    assert line == "✗ arm  workspace   fail  0 s  (2 jobs left)\n"


def test_expected_verdicts_say_so(log, capsys, monkeypatch):
    monkeypatch.setattr(RunLog, "expected", {("arm", "workspace"): "fail"})
    log(LogEvent.JOB_INFO, jobid=1, output=OUTPUT)
    log(LogEvent.JOB_FINISHED, job_id=1)
    assert "fail, as expected" in capsys.readouterr().err


def test_pages_and_snakemakes_own_words_stay_out_errors_do_not(log, capsys):
    log(LogEvent.JOB_INFO, jobid=2, output=["reports/arm/inverse.html"])
    log(LogEvent.JOB_FINISHED, job_id=2)
    log(None, "Building DAG of jobs...")
    assert capsys.readouterr().err == ""
    log(None, "a rule is missing", level=logging.ERROR)
    log(LogEvent.JOB_ERROR, rule_msg="arm: write pages and recordings", log=["logs/arm/views.log"])
    assert capsys.readouterr().err.splitlines() == [
        "a rule is missing",
        "✗ arm: write pages and recordings: ended with an error; see logs/arm/views.log",
    ]


@pytest.mark.parametrize(
    ("ended", "reason"),
    [
        ("returned non-zero exit status 137.", "error: arm: compute workspace: killed (signal 9; out of memory?)"),
        ("died with <Signals.SIGBUS: 7>.", "error: arm: compute workspace: killed (signal 7)"),
        ("returned non-zero exit status 2.", "its own words"),
    ],
)
def test_a_killed_job_s_log_says_so_in_place_of_it(log, capsys, ended, reason):
    told = Path("logs/arm/workspace.compute.log")
    told.parent.mkdir(parents=True)
    told.write_text("its own words\n", encoding="utf-8")
    log(LogEvent.JOB_INFO, jobid=1)
    log(LogEvent.ERROR, f"CalledProcessError:\nCommand 'a; er3a compute 2> {told}' {ended}", level=logging.ERROR)
    log(LogEvent.JOB_ERROR, jobid=1, rule_msg="arm: compute workspace", log=[str(told)])
    (line,) = capsys.readouterr().err.splitlines()
    assert (reason.removeprefix("error: ") in line) == ("killed" in reason)
    assert told.read_text(encoding="utf-8").splitlines()[-1] == reason


def test_what_snakemake_does_not_know_is_one_line(log, capsys):
    text = "MissingRuleException:\nNo rule to produce my.yaml (if you use input functions make sure ...)."
    log(LogEvent.ERROR, text, level=logging.ERROR)
    log(LogEvent.ERROR, "WorkflowError:\nno such profile", level=logging.ERROR)
    log(
        LogEvent.ERROR,
        "CalledProcessError: Command 'er3a 2> x.log' died with <Signals.SIGINT: 2>.",
        level=logging.ERROR,
    )
    unknown, other = capsys.readouterr().err.splitlines()
    assert unknown.startswith("error: my.yaml: no stage (validation, ")
    assert unknown.endswith("a study is given by --study")
    assert other == "error: WorkflowError: no such profile"
