"""The verbs of a stage, as the command line calls them."""

from __future__ import annotations

from importlib import import_module
from inspect import signature
from pathlib import Path
from typing import Any

from er3a.pipeline.messages.say import say
from er3a.pipeline.stage_results import read_results, write_results
from er3a.pipeline.study import Study


def compute(stage: str, study: Study, robot: str, folder: Path, **extra: Any) -> None:
    """Compute a stage of a robot and write its results into ``folder``."""
    verb = _module(stage, "compute").compute
    if "folder" in signature(verb).parameters:
        verb(study, robot, folder, **extra)
        return
    results = verb(study, robot, **extra)
    import_module(f"er3a.pipeline.messages.{stage}_verdict")
    write_results(folder, study, robot, stage, results, say)


def show(verb: str, stage: str, study: Study, robot: str, folder: Path, output: Path) -> None:
    """Write a view of a stage's results: ``record`` or ``report``."""
    view = getattr(_module(stage, verb), verb)
    if "folder" in signature(view).parameters:
        view(study, robot, folder, output)
        return
    view(study, read_results(folder, _module(stage, "model").RESULTS), output)


def _module(stage: str, name: str) -> Any:
    return import_module(f"er3a.pipeline.stages.{stage}.{name}")
