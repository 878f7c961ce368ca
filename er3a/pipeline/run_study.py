"""`make run` and `er3a run`: one run at a time, inputs checked first, then Snakemake; and what a person sees of it.

After `kill -9` Snakemake's own lock remains. The lock of the operating system that is taken here ends with its process,
so a run that gets it knows that no other run is active, and may clear Snakemake's lock.

The progress display, a line for each verdict with how many jobs are left, is a logger plugin of Snakemake, which writes
its own log into ``.snakemake/log/`` besides.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
import time
from argparse import Namespace
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, redirect_stderr, suppress
from dataclasses import dataclass
from io import StringIO
from itertools import chain
from logging import WARNING, LogRecord
from pathlib import Path
from types import ModuleType

from filelock import FileLock, Timeout
from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.registry import LoggerPluginRegistry
from snakemake_interface_logger_plugins.settings import LogHandlerSettingsBase

from er3a.errors import Er3aError, ResultError
from er3a.files.kept_files import ROOT, half_written
from er3a.pipeline.check import check_study
from er3a.pipeline.results import JUNIT, OVERALL, SUMMARY, check_checksum, check_results, checksum_file, withheld
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import Study
from er3a.pipeline.verdicts import write_junit_error


def corrupted(study: Study, results: Path, reports: Path) -> Iterator[tuple[Path, ResultError]]:
    """Files that are there and not as they were written, or of another format version, each with what is wrong.

    These are results, pages, recordings and their pictures. Of a stage's results it is the summary that is named,
    without which the stage counts as not done.
    """
    files = [reports / page for page in (*OVERALL, *study.article_pages().values())]
    for robot in study.names:
        files += [reports / robot / f"{page}.html" for page in study.pages(robot)]
        for stage in study.stages(robot):
            files.append(results / robot / stage / SUMMARY)
            files += [reports / robot / f"{stage}.{kind}" for kind in ("rrd", "webp")]
    for path in filter(Path.is_file, files):
        try:
            if path.name == SUMMARY:
                check_results(path.parent)
            else:
                check_checksum(path)
        except ResultError as error:
            yield path, error


MARKS = {"pass": "✓", "caution": "!", "fail": "✗"}
_JOB_ENDED = re.compile(r"2> (\S+)' (?:died with <Signals\.\w+: (\d+)>|returned non-zero exit status (\d+))")
"""How a job ended, of which a line of its own tells: its log, and the signal or the exit code."""

Expected = Mapping[tuple[str, str], str]


def logger_words(expected: Expected) -> list[str]:
    """The words that make Snakemake, called in this process, report to a person in this way.

    Parameters
    ----------
    expected : verdicts that it expects, by robot and stage
    """
    module = ModuleType("snakemake_logger_plugin_er3a")
    module.LogHandler = type("LogHandler", (RunLog,), {"expected": expected})  # type: ignore[attr-defined]
    module.LogHandlerSettings = RunLogSettings  # type: ignore[attr-defined]
    LoggerPluginRegistry().register_plugin(module.__name__, module)
    return ["--logger", "er3a"]


@dataclass
class RunLogSettings(LogHandlerSettingsBase):
    """Snakemake requires one; it has no settings."""


class RunLog(LogHandlerBase):
    """Writes to standard error; records come one at a time, from one thread."""

    expected: Expected = {}
    writes_to_stream = True
    writes_to_file = False
    has_filter = True
    has_formatter = False
    needs_rulegraph = False

    def __post_init__(self) -> None:
        self._jobs: dict[int, tuple[Sequence[str], float]] = {}  # outputs, and when it began
        self._left = 0
        self._killed: dict[str, int] = {}

    def emit(self, record: LogRecord) -> None:
        """Show what a record of Snakemake says to a person, if anything.

        Parameters
        ----------
        record : of an event of the run, or a message

        Notes
        -----
        A job that a signal killed gets a line in its own log, where reasons are looked for when the run has ended.
        """
        event = getattr(record, "event", None)
        if event == LogEvent.RUN_INFO:
            self._left = record.__dict__["stats"]["total"]
        elif event == LogEvent.JOB_INFO:
            job = record.__dict__
            self._jobs[job["jobid"]] = job.get("output") or (), time.monotonic()
        elif event == LogEvent.JOB_FINISHED:
            self._finish(record.__dict__["job_id"])
        elif event == LogEvent.JOB_ERROR:
            job = record.__dict__
            name, logs = job.get("rule_msg") or job.get("rule_name"), [str(log) for log in job.get("log") or ()]
            number = self._killed.get(logs[0], 0) if logs else 0
            # SIGKILL is 9, a name that Windows lacks.
            reason = f"killed (signal {number}{'; out of memory?' * (number == 9)})"
            self._print(f"✗ {name}: {reason if number else 'ended with an error'}; see {', '.join(logs)}")
            if number and (log := Path(logs[0])).is_file():
                with log.open("a", encoding="utf-8") as told:  # where reasons are looked for when the run has ended
                    told.write(f"\nerror: {name}: {reason}\n")
        elif event == LogEvent.ERROR:
            if ended := _JOB_ENDED.search(record.getMessage()):
                self._killed[ended[1]] = int(ended[2] or max(int(ended[3]) - 128, 0))
            elif "At least one job did not complete" not in record.getMessage():  # each has its own line
                self._print(_error_line(record.getMessage()))
        elif event is None and _concerns_a_person(record):
            self._print(record.getMessage())

    def _finish(self, job: int) -> None:
        """A line for each stage that a job has computed; Snakemake adds to names of files what they are flagged as."""
        outputs, begun = self._jobs.pop(job, ((), 0.0))
        self._left -= 1
        for output in outputs:
            path = Path(str(output).partition(" (")[0])
            if path.name != SUMMARY:
                continue
            robot, stage = path.parts[-3:-1]
            status = _verdict(robot, stage)
            note = ", as expected" if self.expected.get((robot, stage)) == status else ""
            took = f"{time.monotonic() - begun:.0f} s  ({self._left} jobs left)"
            mark = MARKS.get(status, "–")
            self._print(f"{mark} {robot}  {stage:<10}  {status.replace('_', ' ')}{note}  {took}")

    def _print(self, line: str) -> None:
        print(line, file=sys.stderr, flush=True)


def _concerns_a_person(record: LogRecord) -> bool:
    """Whether a plain message of Snakemake is shown: what it warns of, unless a job's own line has said it."""
    text = record.getMessage()
    if text.startswith("Exiting because a job execution failed") or "were not present when the DAG was created" in text:
        return False  # a first page is there before its job, which writes the same again
    return record.levelno >= WARNING or text.startswith("Nothing to be done")


def _error_line(text: str) -> str:
    """What Snakemake can't do, in one line; words that it was given and doesn't know are most often a study's file."""
    if unknown := re.search(r"^MissingRuleException:\s+No rule to produce (\S+)", text):
        return f"error: {unknown[1]}: no stage ({', '.join(STAGES)}) or file of this one; a study is given by --study"
    return f"error: {' '.join(text.split())}"


def _verdict(robot: str, stage: str) -> str:
    try:
        summary = json.loads(Path("results", robot, stage, SUMMARY).read_bytes())
        status = str(summary["verdict"]["status"])
    except (OSError, ValueError, KeyError):
        return "no result"
    below = _verdict(robot, "validation") if STAGES[stage].rests_on else None
    return "no verdict" if withheld(status, below) else status


_STATE = Path(".snakemake")


class RunError(Er3aError):
    """A run can't be started in this folder."""


def run_study(study_file: Path, results: Path, reports: Path, words: Sequence[str]) -> bool:
    """Run a study in the working folder.

    Parameters
    ----------
    words : passed on to Snakemake

    Returns
    -------
    done : whether all jobs were done

    Raises
    ------
    RunError
        another run is active, the folder can't be written into, or Snakemake knows no such option
    InputError
        the study, or a file that it leads to, can't be used
    """
    asked = parsed(words)
    with ExitStack() as until_done:
        os.environ["ER3A_STAGES"] = " ".join(asked_stages(asked.targets))
        until_done.callback(os.environ.pop, "ER3A_STAGES")
        if asked.dryrun:
            return _dry_run(study_file, results, reports, words, asked)
        until_done.callback(_taken_lock().release)
        refuse_links_outside(results, reports, Path("logs"))
        try:
            done = _run(study_file, results, reports, words, asked)
        except Er3aError as error:
            _report_error(reports, str(error))
            raise
    if not done:
        _report_error(reports, "The run did not end well: its output on standard error, and logs/, say why.")
    return done


def refuse_links_outside(*written: Path) -> None:
    """Refuse links that would have a run write or delete files in folders that a study merely points to.

    Parameters
    ----------
    written : folders that a run writes into, below the working folder

    Raises
    ------
    RunError
        for the first link that leads out of the working folder
    """
    here = Path.cwd().resolve()
    for folder in written:
        inside = (Path(place, name) for place, folders, files in os.walk(folder) for name in (*folders, *files))
        for path in chain([folder], inside):
            if path.is_symlink() and not path.resolve().is_relative_to(here):
                raise RunError(f"{path}: a run writes here, and it links to {path.resolve()}. Remove the link")


def _report_error(reports: Path, problem: str) -> None:
    """Have continuous integration find an error, not the verdicts of an earlier run, if it finds any.

    The report gets no checksum, so that the next run makes it again.
    """
    report = reports / JUNIT
    if report.is_file():
        with suppress(Er3aError, OSError):  # what went wrong first is what a person is told
            checksum_file(report).unlink(missing_ok=True)
            write_junit_error(problem, report)


def _run(study_file: Path, results: Path, reports: Path, words: Sequence[str], asked: Namespace) -> bool:
    """Check a study and run it; whether all jobs were done."""
    study = check_study(study_file)
    if not checksum_file(reports / JUNIT).is_file():
        (reports / JUNIT).unlink(missing_ok=True)
    for path in (*half_written(results), *half_written(reports)):
        path.unlink()
    for path, fault in corrupted(study, results, reports):
        print(f"note: {fault.file}: {fault.problem}; it is made again", file=sys.stderr)
        path.unlink()
    if any((_STATE / "locks").glob("*")):
        print("note: a run that was cut off left its lock; going on where it stopped", file=sys.stderr)
        shutil.rmtree(_STATE / "locks", ignore_errors=True)
    sys.stdout.flush()
    plain = ["--nocolor"] if os.environ.get("NO_COLOR") else []
    expected = {(name, stage): verdict for name in study.names for stage, verdict in study.entry(name).expect.items()}
    own_log = asked.logger or asked.verbose or asked.printshellcmds or asked.debug_dag
    shown = [] if own_log else logger_words(expected)
    on_this_machine = not (asked.executor or asked.profile or asked.workflow_profile)
    first = _one_at_first() if on_this_machine and not asked.resources else []
    # Names of what to make stand first, options that take as many words as follow before one that takes one.
    return _snakemake([*words, *first, *shown, *plain, *_of_er3a(study_file, asked)])


def _of_er3a(study_file: Path, asked: Namespace) -> list[str]:
    """The words that name er3a's workflow and profile, and the study. They are the last ones: Snakemake takes all words
    after ``--configfile`` for more studies.

    A profile holds Python that Snakemake evaluates. It would take that of the working folder unasked, and would look
    there for a name that is meant for er3a's or the user's own: a folder's profile has to be named by a path.

    Raises
    ------
    RunError
        for a profile's name that this folder has, too
    """
    named = asked.workflow_profile or "default"
    own = ROOT / "profiles" / named
    places = [(name, name) for name in asked.profile or ()]
    if not own.is_dir():
        places += [(named, named), (named, f"profiles/{named}")]
    for name, place in places:
        if not os.path.dirname(name) and os.path.lexists(place):
            raise RunError(f"the profile {name} is also in this folder; if you trust it, name it as ./{place}")
    profile = str(own if own.is_dir() else named)
    return ["--snakefile", str(ROOT / "Snakefile"), "--workflow-profile", profile, "--configfile", str(study_file)]


def asked_stages(targets: Iterable[str] | None) -> list[str]:
    """The stages that a run is asked for, and those whose verdict their pages show.

    Parameters
    ----------
    targets : each names a stage, or a file of a stage such as ``reports/er3_600/inverse.html``

    Returns
    -------
    stages : in their order; none where it may be all of them
    """
    asked: list[str] = []
    for target in targets or ():
        parts = Path(target).parts
        of = Path(parts[2]).stem if len(parts) > 2 and parts[0] in ("results", "reports") else target
        stage = STAGES.get("validation" if of == "teach" else of)
        if stage is None:
            return []
        asked += [stage.name, *stage.rests_on]
    return [name for name in STAGES if name in asked]


def _one_at_first() -> list[str]:
    """Words that let just one job of a stage run at a time where its kernels are not compiled yet.

    Others of the stage would wait for that job's compiling, on a core that other stages can use.
    """
    new = [stage.name for stage in STAGES.values() if not stage.compiled.exists()]
    return ["--resources", *(f"compiles_{stage}=1" for stage in new)] if new else []


def asked_robots(targets: Iterable[str] | None) -> set[str]:
    """The robots whose files a run is asked for.

    Parameters
    ----------
    targets : each names a stage, or a file of a robot such as ``reports/er3_600/inverse.html``

    Returns
    -------
    robots : empty where it may be all of them
    """
    parts = [Path(target).parts for target in targets or ()]
    return {each[1] for each in parts} if all(len(each) > 2 for each in parts) else set()


def parsed(words: Sequence[str]) -> Namespace:
    """What a user's words request of Snakemake.

    Parameters
    ----------
    words : options and targets, such as ``-np`` or ``--dry-run``

    Raises
    ------
    RunError
        for words that Snakemake does not know, or less than one core or job to run with
    """
    from snakemake.cli import get_argument_parser
    from snakemake.exceptions import CliException

    said = StringIO()
    try:
        with redirect_stderr(said):
            asked = get_argument_parser().parse_args(list(words))
    except CliException as error:
        raise RunError(" ".join(str(error).split())) from None
    except SystemExit as end:
        if not end.code:
            raise
        problem = said.getvalue().strip().rpartition("error: ")[2]
        raise RunError(f"{' '.join(problem.split())}. See: snakemake --help") from None
    for option, count in (("--cores", asked.cores), ("--jobs", asked.jobs)):
        if isinstance(count, int) and count < 1 and not asked.dryrun:  # Snakemake would wait for ever
            raise RunError(f"{option} is {count}; a run needs 1 or more")
    return asked


def _dry_run(study_file: Path, results: Path, reports: Path, words: Sequence[str], asked: Namespace) -> bool:
    """Say what a run would do, and change nothing."""
    for _, fault in corrupted(check_study(study_file), results, reports):
        print(f"note: {fault.file}: {fault.problem}; a run makes it again", file=sys.stderr)
    sys.stdout.flush()
    return _snakemake([*words, "--nolock", *_of_er3a(study_file, asked)])


def _taken_lock() -> FileLock:
    """The lock that one run at a time holds, until its process ends."""
    lock = FileLock(_STATE / "er3a.lock", timeout=0)
    try:
        _STATE.mkdir(exist_ok=True)
        lock.acquire()
    except Timeout:
        raise RunError("another run is active in this folder; wait for its end, or stop it") from None
    except OSError as error:
        raise RunError(f"{error.filename}: {error.strerror}; a run writes into this folder") from None
    return lock


def _snakemake(words: list[str]) -> bool:
    """Run Snakemake in this process, so that what stops the one stops the other."""
    from snakemake.cli import args_to_api, parse_args
    from snakemake.exceptions import print_exception

    said = StringIO()  # which profile it takes, that of this project
    try:
        with redirect_stderr(said):
            parser, asked = parse_args(words)
    except BaseException as end:  # what it said before it ended stands where a person looks
        print(said.getvalue(), end="", file=sys.stderr)
        if not isinstance(end, SystemExit):
            raise
        return end.code in (0, None)
    try:
        return bool(args_to_api(asked, parser))
    except SystemExit as end:
        return end.code in (0, None)
    except Exception as error:  # of any of its plugins: shown as Snakemake shows its own
        print_exception(error)
        return False
