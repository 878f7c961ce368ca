"""Runs the verbs of a stage for the command line: compute, record, report."""

from __future__ import annotations

import sys
import traceback
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from er3a.errors import Er3aError, InputError, ResultError, WriteError
from er3a.files.units import noted_doubts
from er3a.finding import fact
from er3a.pipeline.messages.say import say
from er3a.pipeline.results import (
    AbsentResults,
    Results,
    Stored,
    Summary,
    Verdict,
    input_records,
    read_stage,
    write_results,
)
from er3a.pipeline.scope import uncovered
from er3a.pipeline.stages.covered import assumed_limits, assumed_values, covered_units
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.stage import Stage
from er3a.pipeline.study import Study

FOR_A_PERSON = (InputError, ResultError, WriteError, MemoryError, OSError, ImportError)
"""What a person corrects and runs again; anything else belongs to the stage and the robot, and others go on."""


class Compute(Protocol):
    """What a stage's ``compute.compute`` is: a robot's results from the study."""

    def __call__(self, study: Study, name: str, /) -> Results: ...


class View(Protocol):
    """What a stage's ``record.record`` and ``report.report`` are: they write a view of stored results."""

    def __call__(self, study: Study, stored: Stored[Any], output: Path, /) -> None: ...


def compute(name: str, study: Study, robot: str, folder: Path) -> str | None:
    """Compute a stage of a robot and write its results into ``folder``.

    Returns
    -------
    absent : why the stage was not computed, in words; None if it was
    """
    stage = STAGES[name]
    read = input_records(file for file in study.inputs(robot, name) if file.is_file())
    with noted_doubts() as doubts:
        results = _computed(stage, study, robot)
    doubts = [each for each in doubts if stage.weighs or not each.key.startswith("inertia.")]
    if not isinstance(results, AbsentResults):
        summary = _with_inputs(results.summary, study, robot, stage)
        checked = (*summary.checked, covered_units(len(read), doubts))
        results = replace(results, summary=replace(summary, checked=checked))
    write_results(folder, study, robot, stage, results, read)
    if isinstance(results, AbsentResults):
        import_module(stage.messages)
        return say(results.summary.verdict.finding)
    with suppress(OSError):
        stage.compiled.parent.mkdir(parents=True, exist_ok=True)
        stage.compiled.touch()
    return None


def _with_inputs(summary: Summary, study: Study, name: str, stage: Stage) -> Summary:
    """A summary that says what the robot's file assumes of the values that the stage rests on."""
    if not stage.rests_on:
        return summary
    robot, entry = study.robot(name), study.entry(name)
    replaced = [group for group in ("base", "tool") if getattr(entry, group)]
    checked = uncovered(summary.checked, assumed_limits(robot))
    return replace(summary, checked=checked, assumed=(*summary.assumed, *assumed_values(robot, replaced)))


def _computed(stage: Stage, study: Study, robot: str) -> Results:
    try:
        if finding := stage.applies(study.robot(robot)):
            return AbsentResults(Summary(Verdict("not_computed", finding), ()))
        computing: Compute = stage.module("compute").compute
        return computing(study, robot)
    except FOR_A_PERSON:
        raise
    except Er3aError as error:
        reason = str(error)
    except Exception as error:  # a defect of one stage must not take the others with it; its trace goes to the log
        traceback.print_exc(file=sys.stderr)
        reason = f"{type(error).__name__}: {error}"
    return AbsentResults(Summary(Verdict("not_computed", fact("stage.not_computed", reason=reason)), ()))


def show(verb: str, name: str, study: Study, robot: str, folder: Path, output: Path) -> None:
    """Write a page or recording of a stage's results.

    Parameters
    ----------
    verb : ``record`` or ``report``
    folder : of the stage's results
    output : file, written whole or not at all

    Raises
    ------
    ResultError
        if the results are missing, damaged or of another version
    """
    stage = STAGES[name]
    import_module(stage.messages)
    stored = read_stage(folder, stage)
    if isinstance(stored.results, AbsentResults):
        if verb == "record":  # Rerun is loaded where something is recorded
            from er3a.pipeline.viewing.recording import record_absent as absent
        else:
            from er3a.pipeline.viewing.page import report_absent as absent
        view: View = absent
    else:
        view = getattr(stage.module(f"page.{verb}"), verb)
    view(study, stored, output)
