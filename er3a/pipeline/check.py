"""Checking an input file without computing anything from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import chdir
from pathlib import Path

from pydantic import BaseModel

from er3a.errors import InputError
from er3a.files.by_name import load_measurements
from er3a.files.csv_file import read_header
from er3a.files.dh_table import read_dh_table
from er3a.files.hand_eye_file import HandEyeFile, check_samples, load_hand_eye, sample_rows
from er3a.files.path_file import (
    TRAJECTORIES,
    PathFile,
    ProgramPath,
    TablePath,
    is_ros_trajectory,
    load_paths,
    read_path_table,
)
from er3a.files.printed_table import table_in
from er3a.files.program_file import ProgramsFile, load_programs
from er3a.files.reference_sets import FILE as DOCUMENTS
from er3a.files.reference_sets import (
    FORMATS,
    check_reference_file,
    check_robot_origins,
    load_documents,
    load_references,
)
from er3a.files.robot_file import RobotFile
from er3a.files.robot_library import URDF, holds_table, load_of, load_robot
from er3a.files.scene_file import SceneFile, load_scene
from er3a.files.target_file import TargetFile, load_targets, read_targets
from er3a.files.vision_file import VisionFile, load_vision
from er3a.files.yaml_file import load, read_yaml
from er3a.formats.urdf_lint import WRONG, lint
from er3a.pipeline.messages.urdf import rule_text
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import Study, load_study
from er3a.planning.commands import CommandSource
from er3a.program_check.check_program import LocatedFinding
from er3a.programs.languages import SUFFIXES, read_program
from er3a.robots.robot import Robot

SCHEMAS: dict[str, type[BaseModel]] = {
    "study": Study,
    "robot": RobotFile,
    "targets": TargetFile,
    "paths": PathFile,
    "scene": SceneFile,
    "programs": ProgramsFile,
    "hand_eye": HandEyeFile,
    "vision": VisionFile,
}


def _check_robot(path: Path) -> None:
    check_references(load_robot(path))


def check_references(robot: Robot) -> None:
    """Check a robot's reference sets, and that the documents which its file names are among theirs.

    Raises
    ------
    InputError
        naming the set's file and row, or the entry of the robot's file
    """
    sets = [load_references(reference, robot) for reference in robot.references]
    check_robot_origins(robot, [document for own in sets for document in own.documents.by_name])


def _check_paths(path: Path, robot: Robot | None = None) -> None:
    for i, planned in enumerate(load_paths(path).paths):
        if isinstance(planned, ProgramPath):
            read_program(planned.program)
        elif robot is not None:
            source = CommandSource(path, f"paths[{i}]")
            try:
                planned.command(source, robot)
            except InputError as error:
                raise error if error.file else source.error(error.field or "", error.problem, error.remedy) from None
        elif isinstance(planned, TablePath):
            planned.table(CommandSource(path, f"paths[{i}]"))


def _check_programs(path: Path) -> None:
    for program in load_programs(path).programs:
        read_program(program.file)


def _check_hand_eye(path: Path) -> None:
    file = load(HandEyeFile, path)
    for table in filter(None, (file.samples, file.touched)):
        check_samples(path.parent / table)
    if file.images is not None:
        samples = path.parent / file.samples
        for row in sample_rows(samples)[0]:
            if not (samples.parent / str(row.get("image"))).is_file():
                where = f"row {row['row']}, column image"
                raise InputError(samples, where, f"'{row.get('image')}' is not a file", "Name the sample's image")


def _check_vision(path: Path) -> None:
    _check_hand_eye(path.parent / load_vision(path).calibration)


URDF_FILE = "a URDF"


def rules_broken(path: Path, kind: str, xacro: Sequence[str] = ()) -> list[tuple[LocatedFinding, str]]:
    """The rules that a URDF breaks, each with its text.

    Parameters
    ----------
    kind : of the file, as :func:`check_file` says it; no others have rules
    xacro : arguments of a xacro file, ``NAME:=VALUE``

    Raises
    ------
    InputError
        for what is no XML
    """
    if kind != URDF_FILE:
        return []
    return [
        (LocatedFinding("fail" if found.code in WRONG else "caution", found, place), rule_text(found))
        for found, place in lint(path, xacro)
    ]


_CHECKS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "study": ("a study", lambda path: check_study(path)),
    "robot": ("a robot", _check_robot),
    "targets": ("targets", read_targets),
    "paths": ("paths", _check_paths),
    "scene": ("a scene", load_scene),
    "programs": ("programs", _check_programs),
    "hand_eye": ("a calibration set", _check_hand_eye),
    "vision": ("objects before a camera", _check_vision),
}
"""By kind of file: what it is in words, and what reads it."""
PROGRAM = "a robot program"


def check_file(path: Path, xacro: Sequence[str] = (), base: str | None = None, tip: str | None = None) -> str:
    """Check a file and return in words what it is; :class:`er3a.errors.InputError` if something is wrong with it.

    A folder means the study in it. ``xacro``: arguments of a xacro file, ``NAME:=VALUE``; ``base``, ``tip``: links of a
    URDF at which the arm begins and ends.

    Each file that it names is looked at too, from the folder that a study is run in: that which ``config`` or ``data``,
    where it stands, stands in, or else the working folder.
    """
    if path.is_dir():
        return check_file(path / "config" / "config.yaml")
    if path.suffix == ".csv" or path.name == DOCUMENTS:
        return _check_table(path)
    if path.suffix.lower() in SUFFIXES and path.suffix != ".csv":
        read_program(path)
        return PROGRAM
    if path.suffix in TRAJECTORIES and is_ros_trajectory(path):
        read_path_table(path)
        return "a path"
    if holds_table(path) and table_in(path):
        read_dh_table(path, "arm")
        return "a D-H table"
    if path.suffix in URDF and path.exists():
        load_robot(path, xacro=xacro, base=base, tip=tip)
        return URDF_FILE
    if path.suffix not in (".yaml", ".yml"):
        if not path.exists():
            raise InputError(path, None, "there is no such file", "Check the path")
        ending = f"'{path.suffix}' files" if path.suffix else "files without an ending"
        raise InputError(
            path, None, f"{ending} are none of er3a's inputs", "Give a .yaml file, a table or a trajectory"
        )
    kind = read_yaml(path).get("kind")
    if not isinstance(kind, str) or kind not in _CHECKS:
        problem = "missing" if kind is None else f"'{kind}' is not known"
        raise InputError(path, "kind", problem, f"Write one of: {', '.join(_CHECKS)}")
    # The working folder does not lie in it: who works below some ``data`` names files from there.
    own = [each for each in path.absolute().parents if each.name == "config" or not Path.cwd().is_relative_to(each)]
    homes = (each.parent for each in own if each.name in ("config", "data"))
    home = next((home for home in homes if (home / "data").is_dir()), Path.cwd())
    within = path if home == Path.cwd() else path.absolute().relative_to(home)
    with chdir(home):
        try:
            words, read = _CHECKS[kind]
            read(within)
        except InputError as error:
            if kind == "study" or error.file is None or Path(error.file).name == path.name:
                raise
            where = str(error.file) + (f": {error.field}" if error.field else "")
            raise InputError(path, where, error.problem, error.remedy) from None
    return words


def _check_table(path: Path) -> str:
    """What a CSV is, by its name or its columns."""
    if path.name == DOCUMENTS:
        load_documents(path)
        return "documents of references"
    header = [] if path.stem in FORMATS else read_header(path)
    if {"target_x_mm", "seen_x_mm"} & set(header):
        return check_samples(path)
    if {"q1_deg", "q1_mm"} & set(header) and "point" in header:
        load_measurements(path)
        return "measured positions"
    if path.stem not in FORMATS and table_in(path):
        read_dh_table(path, "arm")
        return "a D-H table"
    if {"name", "x_mm"} <= set(header):
        read_targets(path)
        return "targets"
    if {"q1_deg", "q1_mm", "x_mm"} & set(header):
        read_path_table(path)
        return "a path"
    if path.stem not in FORMATS:
        remedy = "A D-H table has the columns joint, a_mm, alpha_deg, d_mm; targets name, x_mm, y_mm, z_mm and an "
        remedy += "orientation; measured positions q1_deg ..., point, x_mm, y_mm, z_mm; a reference table is named one "
        remedy += f"of {', '.join(f'{name}.csv' for name in FORMATS)}"
        raise InputError(path, "header", "no table that er3a reads has these columns", remedy)
    check_reference_file(path)
    return f"references about {path.stem}"


def check_study(path: Path) -> Study:
    """Check a study file and every file that it leads to, before a run starts.

    Parameters
    ----------
    path : of the study; its own paths are relative to the current folder

    Returns
    -------
    study : checked, with no stage computed

    Raises
    ------
    InputError
        naming the file and the place in it that can't be used
    """
    study = load_study(path)
    for name in study.names:
        try:
            robot, entry = study.robot(name), study.entry(name)
        except InputError as error:
            raise InputError(error.file or path, error.field, error.problem, error.remedy) from None
        check_references(robot)
        load_targets(entry.targets, robot)
        _check_paths(Path(entry.paths), robot)
        if entry.programs:
            _check_programs(Path(entry.programs))
        if entry.vision:
            own = load_vision(entry.vision, robot)
            load_hand_eye(Path(entry.vision).parent / own.calibration, robot)
        load_of(study.loads(name))
        for key in (
            key for stage in STAGES.values() for key in stage.settings if hasattr(getattr(study, key), "scene")
        ):
            study.scene(name, key)
    return study
