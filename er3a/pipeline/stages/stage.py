"""The description of a stage for the pipeline; its folder holds the rest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from er3a.by_value import frozen
from er3a.files.yaml_file import StrictModel
from er3a.finding import Finding
from er3a.numerics.jit import kernels_folder
from er3a.robots.robot import Robot

StudyFiles = Any
"""What a stage asks of a study to name its inputs: ``er3a.pipeline.study.StudyBase``, which imports the stages."""


@frozen
class Stage:
    """An entry of the registry.

    ``compute`` stands in the module of that name in the stage's folder, ``model`` holds its results, and the views
    that it has stand in its folder ``page``.

    Attributes
    ----------
    name : of the stage's folder, of its key in the study file, and of its results
    title, question : marked with ``N_``: the page's title, and what it answers
    settings : per key of the study file the model of what stands there; the first is the stage's own
    inputs : the files that a robot's results rest on besides its own file
    extra_inputs : what else of the study they rest on besides settings, as plain data by name
    is_configured : whether the study gives a robot what the stage reads; without that it does not run
    applies : why the stage can't be computed for a robot, a finding of one of ``absences``; None if it can
    views : ``record`` (a recording, with its picture) and ``report`` (a page), as far as the stage has them
    rests_on : names of the stages whose verdict its pages say first
    shows : names of the stages whose results its page shows besides its own, as far as they are there
    motions : in plural and marked with ``N_``, what its motions are; the index compares them with the tray
    weighs : whether it looks at the masses of the arm's links
    may_run : whether the index says which of its motions may be run
    """

    name: str
    title: str
    question: str
    settings: Mapping[str, type[StrictModel]]
    inputs: Callable[[StudyFiles, str], list[Path]] = lambda study, robot: []
    extra_inputs: Callable[[StudyFiles, str], dict[str, Any]] = lambda study, robot: {}
    is_configured: Callable[[StudyFiles, str], bool] = lambda study, robot: True
    applies: Callable[[Robot], Finding | None] = lambda robot: None
    views: tuple[str, ...] = ("record", "report")
    rests_on: tuple[str, ...] = ()
    shows: tuple[str, ...] = ()
    motions: str = ""
    weighs: bool = False
    may_run: bool = False

    def module(self, name: str) -> Any:
        """A module of the stage's folder, imported when it is needed.

        Parameters
        ----------
        name : such as ``compute`` or ``page.report``
        """
        return import_module(f"{self.package}.{name}")

    @property
    def package(self) -> str:
        """The full name of the stage's folder."""
        return f"er3a.pipeline.stages.{self.name}"

    @property
    def messages(self) -> str:
        """The module with the sentences of the stage's verdict and page, and the names of its key figures."""
        return f"er3a.pipeline.messages.{self.name}"

    @property
    def compiled(self) -> Path:
        """The file that says that this stage was computed once on this machine: its kernels have been compiled."""
        return kernels_folder() / f"{self.name}.computed"


def program_files(path: Path) -> tuple[Path, ...]:
    """A program's file and those that belong to it.

    Parameters
    ----------
    path : of the program

    Notes
    -----
    The module is imported by its name here, as all pages import the stages, and few read programs.
    """
    files: tuple[Path, ...] = import_module("er3a.programs.languages").files_of(path)
    return files
