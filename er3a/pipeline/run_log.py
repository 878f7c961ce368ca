"""What a person sees of a run: a line for each verdict as it falls, and how long the rest will take.

A logger plugin of Snakemake, which writes its own log into ``.snakemake/log/`` besides.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from logging import WARNING, LogRecord
from pathlib import Path
from types import ModuleType
from typing import Any

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.registry import LoggerPluginRegistry
from snakemake_interface_logger_plugins.settings import LogHandlerSettingsBase

from er3a.pipeline import job_server

MARKS = {"pass": "✓", "caution": "!", "fail": "✗"}
NO_VERDICT = "–"
INDEX_EVERY_S = 25.0
HEAVY = {"sample_workspace": 6.0, "compute_workspace": 8.0, "compute_validation": 5.0, "compute_programs": 5.0}
"""Jobs beside the others, by rule: what they take on average, in units of a page."""

Expected = Mapping[tuple[str, str], str]


def logger_words(study: Path, expected: Expected) -> list[str]:
    """The words that make Snakemake, called in this process, report to a person in this way.

    Parameters
    ----------
    study : its file
    expected : verdicts that it expects, by robot and stage
    """
    module = ModuleType("snakemake_logger_plugin_er3a")
    module.LogHandler = type("LogHandler", (RunLog,), {"study": study, "expected": expected})  # type: ignore[attr-defined]
    module.LogHandlerSettings = RunLogSettings  # type: ignore[attr-defined]
    LoggerPluginRegistry().register_plugin(module.__name__, module)
    return ["--logger", "er3a"]


@dataclass
class RunLogSettings(LogHandlerSettingsBase):
    """Snakemake asks for one; there is nothing to set."""


class RunLog(LogHandlerBase):
    """Writes to standard error; records come one at a time, from one thread."""

    study = Path("config/config.yaml")
    expected: Expected = {}
    writes_to_stream = True
    writes_to_file = False
    has_filter = True
    has_formatter = False
    needs_rulegraph = False

    def __post_init__(self) -> None:
        self._start = time.monotonic()
        self._jobs: dict[int, tuple[str, dict[str, str], float]] = {}
        self._sampled: dict[tuple[str, str], float] = {}
        self._left: dict[str, int] = {}
        self._done = 0.0
        self._index: subprocess.Popen[bytes] | None = None
        self._indexed = -INDEX_EVERY_S
        self._bar = _bar() if sys.stderr.isatty() and not self.common_settings.nocolor else None

    def emit(self, record: LogRecord) -> None:
        """Show what a record says to a person, if anything."""
        event = getattr(record, "event", None)
        if event == LogEvent.RUN_INFO:
            self._left = {rule: n for rule, n in record.stats.items() if rule != "total"}  # type: ignore[attr-defined]
        elif event == LogEvent.JOB_INFO:
            job = record.__dict__
            self._jobs[job["jobid"]] = (job["rule_name"], dict(job["wildcards"] or {}), time.monotonic())
        elif event == LogEvent.JOB_FINISHED:
            self._finish(record.__dict__["job_id"])
        elif event == LogEvent.JOB_ERROR:
            job = record.__dict__
            logs = ", ".join(str(log) for log in job.get("log") or ())
            self._print(f"✗ {job.get('rule_msg') or job.get('rule_name')}: ended with an error; see {logs}")
        elif event is None and _concerns_a_person(record):
            self._print(record.getMessage())

    def close(self) -> None:
        """Take the bar away, and let an index that is being written be finished."""
        if self._bar:
            self._bar.stop()
        if self._index:
            self._index.wait()
        super().close()

    def _finish(self, job: int) -> None:
        rule, wildcards, begun = self._jobs.pop(job, ("", {}, time.monotonic()))
        seconds = time.monotonic() - begun
        self._done += HEAVY.get(rule, 1.0)
        self._left[rule] = self._left.get(rule, 1) - 1
        verb, _, stage = rule.partition("_")
        of = wildcards.get("robot", ""), stage
        if verb == "sample":
            self._sampled[of] = self._sampled.get(of, 0.0) + seconds
        elif verb == "compute":
            status = _verdict(*of)
            note = ", as expected" if self.expected.get(of) == status else ""
            took = seconds + self._sampled.get(of, 0.0)
            mark = MARKS.get(status, NO_VERDICT)
            self._print(f"{mark} {of[0]}  {stage:<10}  {status.replace('_', ' ')}{note}  {took:.0f} s", self._rest())
        elif rule == "report" and self._left.get("index"):
            self._write_index()
        if self._bar:
            share = self._done / max(self._done + self._weight_left(), 1e-9)
            self._bar.update(self._bar.task_ids[0], completed=share, description=self._rest())

    def _write_index(self) -> None:
        """Have the index written with what is there; that of the whole run comes last, as one of its jobs."""
        if time.monotonic() - self._indexed < INDEX_EVERY_S or (self._index and self._index.poll() is None):
            return
        self._indexed = time.monotonic()
        self._index = subprocess.Popen(
            [sys.executable, "-m", "er3a", "index", "--study", str(self.study)],
            env=os.environ | job_server.SETTINGS,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def _weight_left(self) -> float:
        return sum(HEAVY.get(rule, 1.0) * max(n, 0) for rule, n in self._left.items())

    def _rest(self) -> str:
        """How many jobs are left and how long they will take, at the speed so far."""
        jobs = sum(max(n, 0) for n in self._left.values())
        seconds = (time.monotonic() - self._start) * self._weight_left() / max(self._done, 1e-9)
        return f"{jobs} jobs left, about {seconds:.0f} s" if jobs else "all jobs done"

    def _print(self, line: str, rest: str = "") -> None:
        """A line; how much is left behind it where no bar says so."""
        if self._bar:
            self._bar.console.print(line, markup=False, highlight=False)
        else:
            print(f"{line}  ({rest})" if rest else line, file=sys.stderr, flush=True)


def _concerns_a_person(record: LogRecord) -> bool:
    text = record.getMessage()
    if "output files of rule index were not present" in text:  # it was written meanwhile, by this log
        return False
    return record.levelno >= WARNING or text.startswith("Nothing to be done")


def _bar() -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, Progress

    bar = Progress(BarColumn(), "{task.description}", console=Console(stderr=True), transient=True)
    bar.add_task("", total=1.0)
    bar.start()
    return bar


def _verdict(robot: str, stage: str) -> str:
    try:
        summary = json.loads(Path("results", robot, stage, "summary.json").read_bytes())
        return str(summary["verdict"]["status"])
    except (OSError, ValueError, KeyError):
        return "no result"
