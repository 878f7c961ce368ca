"""Results of the small study that tests of several stages read."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from er3a.pipeline.stages import run
from er3a.pipeline.study import Study


@pytest.fixture(scope="session")
def small_results(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str, Study], Path]:
    """Makes a folder with a stage's results of a robot: of the finished study that SMALL_STUDY names, or computed."""
    finished = os.environ.get("SMALL_STUDY")

    def made(stage: str, name: str, study: Study) -> Path:
        folder = tmp_path_factory.mktemp(f"{name}_{stage}") / "results"
        there = Path(finished) / "results" / name / stage if finished else folder
        if there.is_dir():
            shutil.copytree(there, folder)
        else:
            run.compute(stage, study, name, folder)
        return folder

    return made
