"""The stage's entry in the registry, and its settings in a study."""

from __future__ import annotations

from pathlib import Path

from er3a.files.yaml_file import read_yaml
from er3a.pipeline.language import N_
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.stage import Stage, StudyFiles, program_files


def _inputs(study: StudyFiles, robot: str) -> list[Path]:
    paths = study.entry(robot).paths
    return [Path(paths), *_tables_of(paths), *study.scenes(robot, STAGE.name)]


def _tables_of(path_file: str) -> list[Path]:
    """The CSV tables and programs that a path file names; the file is checked elsewhere."""
    paths = read_yaml(path_file).get("paths")
    listed = [path for path in paths if isinstance(path, dict)] if isinstance(paths, list) else []
    tables = [Path(file) for path in listed if isinstance(file := path.get("file"), str)]
    programs = [program_files(Path(file)) for path in listed if isinstance(file := path.get("program"), str)]
    return [*tables, *(file for files in programs for file in files)]


STAGE = Stage(
    name="trajectory",
    title=N_("Paths"),
    question=N_("Are the paths safe, and if not, where and why?"),
    settings={"trajectory": TrajectorySettings},
    inputs=_inputs,
    rests_on=("validation",),
    shows=("workspace", "programs", "vision"),
    motions=N_("paths"),
    may_run=True,
)
